"""Footprints to mip levels. Twin of shaders/lib/filter.glsl; float64."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

F64 = npt.NDArray[np.float64]


def wrapped_difference(difference: npt.ArrayLike) -> F64:
    """The short way round a coordinate that wraps at 1: within -1/2..1/2."""
    d = np.asarray(difference, np.float64)
    return d - np.rint(d)


def isotropic_level(ddx: npt.ArrayLike, ddy: npt.ArrayLike) -> F64:
    """log2 of the longer of two footprint vectors (..., 2) in texels; -63 for none."""
    longest = np.maximum(*(np.linalg.norm(np.asarray(v, np.float64), axis=-1) for v in (ddx, ddy)))
    return np.log2(np.maximum(longest, 2.0**-63))


def direction_level(ddx: npt.ArrayLike, ddy: npt.ArrayLike, texels_per_radian: npt.ArrayLike) -> F64:
    """log2 of the texels that the longer change (..., 3) of a unit direction spans; -63 for none."""
    longest = np.maximum(*(np.linalg.norm(np.asarray(v, np.float64), axis=-1) for v in (ddx, ddy)))
    return np.log2(np.maximum(longest * texels_per_radian, 2.0**-63))
