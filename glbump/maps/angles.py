"""Angles between directions."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

F64 = npt.NDArray[np.float64]


def angle_between(a: npt.ArrayLike, b: npt.ArrayLike) -> F64:
    """(...) float64 radians between unit vectors (..., 3). 2 atan2(|a - b|, |a + b|) is right to the last digits of the
    smallest angle, where the cosine is 1 (Kahan)."""
    one, other = np.asarray(a, np.float64), np.asarray(b, np.float64)
    result: F64 = 2 * np.arctan2(np.linalg.norm(one - other, axis=-1), np.linalg.norm(one + other, axis=-1))
    return result


def degrees_between(a: npt.ArrayLike, b: npt.ArrayLike) -> F64:
    """`angle_between`, in degrees."""
    return np.degrees(angle_between(a, b))
