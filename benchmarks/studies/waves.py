"""A mirror with waves on it that are known between their texels as well: what gradients and codes are tried on."""

from __future__ import annotations

from functools import cache

import numpy as np
import numpy.typing as npt

from benchmarks.kernels import Waves
from benchmarks.scenes import CHROME, evening
from glbump.camera import Camera
from glbump.quality import Quality
from glbump.scene import Bump, NormalMap, Scene, Surface
from glbump.shapes import Quad

F64 = npt.NDArray[np.float64]

SLOPE = 0.15
"""Root of the mean square of slopes on the mirror."""
SIDE = 2.0
"""Of the mirror, world units; one map lies on it."""
FINE = 64
"""Texels of the shortest wave in the map that stands for the truth; the rest of it is a cubic B-spline's."""


@cache
def of_waves(texels: int) -> tuple[F64, F64]:
    """World heights (N, N) and slopes (N, N, 2) on the mirror at texels' centres, v up; the shortest wave is `texels`
    long, and the waves are the same for every length."""
    waves = Waves(texels, 0)
    centres = (np.arange(waves.size) + 0.5) / waves.size
    height, slope = waves.at(np.stack(np.meshgrid(centres, centres), axis=-1))
    scale = SLOPE * SIDE / (0.5 * waves.size)
    return height * scale, slope * scale / SIDE


def mirror(bump: Bump | NormalMap, reach: float = 0.9) -> Scene:
    """The mirror, square to the eye, which sees `reach` of its side."""
    half = SIDE / 2
    quad = Quad(((-half, -half, 0), (half, -half, 0), (half, half, 0), (-half, half, 0)))
    fov = float(np.degrees(2 * np.arctan(reach * half / 3)))
    return Scene([Surface(quad, CHROME, bump)], evening(), Camera(eye=(0, 0, 3), fov=fov))


def in_bump(height: F64) -> Bump:
    """World heights (N, N), v up, as a bump."""
    least, range_ = height.min(), np.ptp(height)
    return Bump(((height - least) / range_).astype(np.float32)[::-1], float(range_))


TRUTH = Quality("exact", samples=4, bump_kernel="bspline", bump_read="shader")
"""How the truth is drawn; rows take as many samples, so that what differs is their bumps."""
