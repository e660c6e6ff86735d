"""The demo's heights and normals: pictures that repeat, computed. Heights are 0..1, rows from the top."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from glbump.demo.noise import F32, fractal, smooth_step
from glbump.maps.heights import slopes


def _uv(size: int) -> tuple[F32, F32]:
    """u to the right and v up at the centres of size x size texels, 0..1."""
    centres = ((np.arange(size) + 0.5) / size).astype(np.float32)
    u, v = np.meshgrid(centres, centres[::-1])
    return u, v


def _spread(height: F32) -> F32:
    """The same heights over the whole of 0..1."""
    low, high = height.min(), height.max()
    return (height - low) / (high - low)


def bricks(size: int = 512, columns: int = 4, rows: int = 8) -> F32:
    """Old bricks in a running bond, `columns` x `rows` of them, their joints deep."""
    u, v = _uv(size)
    # Hand-made edges: what is straight gets a small wobble.
    wobble = np.float32(0.05)
    y = v * rows + wobble * fractal(u * 16, v * 16, 16, 3, 7)
    course = np.floor(y)
    x = u * columns + np.float32(0.5) * (course % 2) + wobble * np.float32(0.5) * fractal(u * 16, v * 16, 16, 3, 8)
    brick = (np.floor(x) % columns + columns * (course % rows)).astype(np.int32)
    across, up = x - np.floor(x) - np.float32(0.5), y - course - np.float32(0.5)

    # Distance to the joint in heights of a course, so that the rim is as wide everywhere.
    aspect = np.float32(rows / columns)
    rim = np.minimum((np.float32(0.5) - np.abs(across)) * aspect, np.float32(0.5) - np.abs(up))
    body = smooth_step(0.055, 0.17, rim)
    random = np.random.default_rng(1)
    lift, tilt_x, tilt_y = random.uniform(-1, 1, (3, columns * rows)).astype(np.float32)
    face = np.float32(0.8) + np.float32(0.06) * lift[brick]
    face += np.float32(0.07) * (tilt_x[brick] * across + tilt_y[brick] * up)
    face += np.float32(0.045) * fractal(u * 16, v * 16, 16, 5, 21, gain=0.55)
    pits = smooth_step(0.2, 0.7, fractal(u * 32, v * 32, 32, 3, 31))
    face -= np.float32(0.05) * pits
    mortar = np.float32(0.12) + np.float32(0.08) * fractal(u * 32, v * 32, 32, 4, 41)
    return _spread(mortar + (face - mortar) * body)


def dimples(size: int = 512, columns: int = 7, rows: int = 8) -> F32:
    """Round dents in a triangular lattice, as on a golf ball."""
    u, v = _uv(size)
    nearest = np.full(u.shape, np.inf, np.float32)
    for row in range(-1, rows + 1):
        dy = (v - np.float32((row + 0.5) / rows)) * columns
        dx = (u * columns - np.float32(0.5 * (row % 2)) + np.float32(0.5)) % 1 - np.float32(0.5)
        nearest = np.minimum(nearest, dx * dx + dy * dy)
    radius = np.float32(0.44)
    inside = np.clip(1 - nearest / radius**2, 0, 1)
    # A bowl; the power rounds its lip.
    return _spread(-(inside ** np.float32(1.3)))


def waves(size: int = 512) -> F32:
    """Wind waves on water: many sines, whole numbers of them across the tile, sharper on top than below."""
    u, v = _uv(size)
    random = np.random.default_rng(4)
    height: F32 = np.zeros_like(u)
    for _ in range(28):
        length = random.uniform(2, 15)
        heading = random.normal(0.5, 0.55)
        x, y = round(length * np.cos(heading)), round(length * np.sin(heading))
        phase = np.float32(2 * np.pi) * (x * u + y * v + np.float32(random.uniform()))
        height += np.exp(np.sin(phase) - 1) / np.float32(max(np.hypot(x, y), 1) ** 1.25)
    return _spread(height)


def stone(size: int = 512) -> F32:
    """Weathered rock: creases and grains of all sizes."""
    u, v = _uv(size)
    bend = np.float32(0.35)
    x = u * 4 + bend * fractal(u * 4, v * 4, 4, 4, 61)
    y = v * 4 + bend * fractal(u * 4, v * 4, 4, 4, 62)
    return _spread(
        fractal(x, y, 4, 7, 63, gain=0.5, ridged=True) + np.float32(0.5) * fractal(u * 8, v * 8, 8, 6, 71, gain=0.55)
    )


def weave(size: int = 512, threads: int = 12) -> F32:
    """Plain weave: `threads` each way, every one over and under its neighbours. An even number."""
    u, v = _uv(size)
    x, y = u * threads, v * threads

    def strand(across: F32, along: F32) -> F32:
        """Height of threads that lie side by side along `across` and run along `along`."""
        index = np.floor(across)
        offset = 2 * (across - index) - 1
        round_top = np.sqrt(np.maximum(1 - (offset * np.float32(1.06)) ** 2, 0))
        swing = np.cos(np.float32(np.pi) * (along - np.float32(0.5) + index))
        return round_top * np.float32(0.55) + np.float32(0.45) * swing

    twist = np.float32(0.03)
    first = strand(x, y) + twist * np.sin(np.float32(2 * np.pi) * (3 * y + x))
    second = strand(y, x + 1) + twist * np.sin(np.float32(2 * np.pi) * (3 * x + y))
    return _spread(np.maximum(first, second))


def quilt(size: int = 512, diamonds: int = 3) -> F32:
    """Padded leather, stitched in diamonds, with a button where the seams cross."""
    u, v = _uv(size)
    a, b = np.float32(np.pi * diamonds) * (u + v), np.float32(np.pi * diamonds) * (u - v)
    padding = (np.abs(np.sin(a)) * np.abs(np.sin(b))) ** np.float32(0.42)
    # Distance to the nearest crossing, in widths of a diamond.
    turn = np.float32(1 / np.pi)
    da, db = a * turn - np.round(a * turn), b * turn - np.round(b * turn)
    reach = np.sqrt((da * da + db * db) * np.float32(0.5))
    button = np.sqrt(np.clip(1 - (reach / np.float32(0.085)) ** 2, 0, 1))
    dent = np.exp(-((reach / np.float32(0.16)) ** 2))
    grain = np.float32(0.003) * fractal(u * 48, v * 48, 48, 3, 81)
    return _spread(padding * (1 - np.float32(0.5) * dent) + np.float32(0.5) * button + grain)


def normals(height: F32, depth: float) -> npt.NDArray[np.uint8]:
    """Heights as a tangent-space normal map: (H, W, 3) bytes, +Y, 128 is 0.

    depth: the length of the full range of heights, in widths of the tile.
    """
    slope = slopes(height) * np.float32(depth)
    vectors = np.concatenate([-slope, np.ones_like(slope[..., :1])], axis=-1)
    vectors /= np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.round(128 + 127 * vectors).astype(np.uint8)
