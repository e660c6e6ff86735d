"""Where a near environment is seen, from elsewhere than it was taken. Twin of shaders/lib/parallax.glsl; float64.

Positions are relative to where it was taken. Directions (..., 3): any length; those that come back are unit length.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from glbump.reference.direction import unit_dir

F64 = npt.NDArray[np.float64]
FAR = 1e30
"""Walls beyond it are as far as none."""


def box_parallax(p: npt.ArrayLike, dir: npt.ArrayLike, low: npt.ArrayLike, high: npt.ArrayLike) -> F64:
    """Direction (..., 3) to where the ray from p (..., 3) leaves the box low..high (Lagarde and Zanuttini 2012).

    From outside: the far side; past the box: the way out of the first pair of walls, or p itself if that lies behind.
    """
    p, d = np.asarray(p, np.float64), unit_dir(dir)
    wall = np.where(d > 0, high, low) - p
    t = np.divide(wall, d, out=np.full(wall.shape, FAR), where=d != 0).min(axis=-1, keepdims=True)
    return unit_dir(p + np.clip(t, 0, FAR) * d)


def sphere_parallax(p: npt.ArrayLike, dir: npt.ArrayLike, centre: npt.ArrayLike, radius: npt.ArrayLike) -> F64:
    """Direction (..., 3) to where the ray from p (..., 3) leaves the sphere: |p + t d - centre| = radius, the larger t.

    From outside: the far side; past the sphere: where the ray comes nearest, or p itself if that lies behind.
    """
    p, d, r = np.asarray(p, np.float64), unit_dir(dir), np.asarray(radius, np.float64)[..., None]
    offset = (p - centre) / r
    along = np.einsum("...i,...i->...", offset, d)[..., None]
    beside = offset - along * d
    chord = np.sqrt(np.maximum(1 - np.einsum("...i,...i->...", beside, beside)[..., None], 0))
    return unit_dir(p / r + np.maximum(chord - along, 0) * d)
