"""Seeded noise that repeats."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

F32 = npt.NDArray[np.float32]


def value_noise(x: F32, y: F32, period: int, seed: int) -> F32:
    """Smooth noise in -1..1 at (x, y), any equal shapes, with random values at whole numbers modulo `period`."""
    grid = np.random.default_rng(seed).uniform(-1, 1, (period, period)).astype(np.float32)
    left, low = np.floor(x), np.floor(y)
    a, b = x - left, y - low
    a, b = a * a * a * (a * (a * 6 - 15) + 10), b * b * b * (b * (b * 6 - 15) + 10)
    column, row = left.astype(np.int32) % period, low.astype(np.int32) % period
    flat = grid.ravel()
    here, above = row * period, (row + 1) % period * period
    right = (column + 1) % period
    lower, upper = flat.take(here + column), flat.take(above + column)
    lower += a * (flat.take(here + right) - lower)
    upper += a * (flat.take(above + right) - upper)
    lower += b * (upper - lower)
    return lower


def fractal(x: F32, y: F32, period: int, octaves: int, seed: int, gain: float = 0.5, ridged: bool = False) -> F32:
    """Sum of `octaves` of value noise, each of twice the frequency and `gain` times the height; about -1..1.

    ridged: creases where the noise is 0, as in mountains.
    """
    total: F32 = np.zeros_like(x, dtype=np.float32)
    weight, reach = 1.0, 0.0
    for octave in range(octaves):
        noise = value_noise(x, y, period, seed + octave)
        if ridged:
            noise = 1 - 2 * np.abs(noise)
        total += np.float32(weight) * noise
        reach += weight
        weight *= gain
        # Periods need not grow with the frequency: no one sees a fine pattern repeat.
        x, y, period = x * 2, y * 2, period * 2 if period <= 128 else period
    return total / np.float32(reach)


def smooth_step(low: float, high: float, x: F32) -> F32:
    """0 below `low`, 1 above `high`, a smooth curve between."""
    t = np.clip((x - np.float32(low)) / np.float32(high - low), 0, 1)
    return t * t * (3 - 2 * t)
