"""Heights of 8 bits: what their steps do to slopes, and what kernels, smoothing and dither make of it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt

from benchmarks.figures import Cell, Section, Table
from benchmarks.kernels import normals
from benchmarks.studies.settings import GAIN, few, table
from benchmarks.studies.waves import FINE, SIDE, SLOPE, TRUTH, in_bump, mirror, of_waves
from glbump.maps.angles import degrees_between
from glbump.maps.gradients import derivative
from glbump.quality import Quality

F64 = npt.NDArray[np.float64]

TEXELS = 32
"""Of the shortest wave: terraces are seen where waves are long in texels."""
REACH = 0.5

# Bits (0: floats), dither in steps, times smoothed, kernel.
SETTINGS: dict[str, tuple[tuple[int, float, int], str]] = {
    "8 bits, central": ((8, 0, 0), "central"),
    "8 bits, sobel": ((8, 0, 0), "sobel"),
    "8 bits, bspline": ((8, 0, 0), "bspline"),
    "8 bits, smoothed once, central": ((8, 0, 1), "central"),
    "8 bits, smoothed 4 times, central": ((8, 0, 4), "central"),
    "8 bits, smoothed 16 times, central": ((8, 0, 16), "central"),
    "8 bits, dithered, central": ((8, 1, 0), "central"),
    "8 bits, dithered, smoothed 4 times, central": ((8, 1, 4), "central"),
    "16 bits, central": ((16, 0, 0), "central"),
    "16 bits, bspline": ((16, 0, 0), "bspline"),
    "floats, central": ((0, 0, 0), "central"),
    "floats, bspline": ((0, 0, 0), "bspline"),
}


def stored(height: F64, bits: int, dither: float, smoothed: int) -> F64:
    """Heights in so many steps over their own range, `dither` of a step of even noise added beforehand, each time
    smoothed by 1 2 1 either way."""
    if bits:
        step = np.ptp(height) / (2**bits - 1)
        noise = dither * np.random.default_rng(11).uniform(-0.5, 0.5, height.shape)
        least = height.min()
        height = np.clip(np.rint((height - least) / step + noise), 0, 2**bits - 1) * step + least
    for _ in range(smoothed):
        for axis in (0, 1):
            height = (np.roll(height, 1, axis) + 2 * height + np.roll(height, -1, axis)) / 4
    return height


def _angles() -> Table:
    height, exact = of_waves(TEXELS)
    wanted, texel = normals(exact), SIDE / len(height)
    rows: list[list[Cell]] = []
    for what, (how, kernel) in SETTINGS.items():
        kept = stored(height, *how)
        slope = np.stack([derivative(kept, axis, kernel, "wrap") / texel for axis in (1, 0)], axis=-1)
        off = degrees_between(normals(slope), wanted)
        rows.append([what, float(np.sqrt((off**2).mean())), float(off.max())])
    return Table(("heights", "rms degrees", "largest"), rows)


def study(folder: Path, quick: bool = False) -> Section:
    """A mirror with long waves, 160x160 (quick: 12x12)."""
    size, turns = ((12, 12), 1) if quick else ((160, 160), 9)
    height, _ = of_waves(TEXELS)
    rows = {
        what: (mirror(in_bump(stored(height, *how)), REACH), Quality("exact", samples=4, bump_kernel=kernel))
        for what, (how, kernel) in few(SETTINGS, quick).items()
    }
    step = np.ptp(height) / 255 / (SIDE / len(height))
    return Section(
        "Heights of 8 bits",
        f"A mirror with 98 waves of chance, the shortest {TEXELS} texels long, rms slope {SLOPE:g}; heights rounded to "
        f"256 steps over their own range. One step from texel to texel is a slope of {step:.3f}, "
        f"{np.degrees(np.arctan(step)):.2f} degrees: between steps the surface is flat, and a mirror shows terraces. "
        "A kernel that reads more texels spreads a step over them, a spline goes through each step as if it were "
        "there. Smoothing heights first (1 2 1 both ways, so many times) trades steps against flattened waves; dither, "
        "noise added before heights are rounded, leaves smoothing something to average. 16 bits need none of it. "
        f"The truth is the same waves at {FINE} texels; errors are display-referred, their pictures {GAIN} times. "
        "The second table has the angles alone, in float64 at texels.",
        (table(folder, "heights8", (mirror(in_bump(of_waves(FINE)[0]), REACH), TRUTH), rows, size, turns), _angles()),
    )
