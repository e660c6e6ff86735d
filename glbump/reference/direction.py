"""Directions of any length, made fit for arithmetic. Twin of shaders/lib/direction.glsl; float64."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

F64 = npt.NDArray[np.float64]
LARGEST = float(np.finfo(np.float32).max)


def finite_dir(dir: npt.ArrayLike) -> F64:
    """(..., 3) at 2^-24 of its length, by the shader's rules for its extremes.

    Infinity counts as the largest float32; what is shorter than 1e-30 afterwards as none, and none as up.
    """
    d = np.clip(np.asarray(dir, np.float64), -LARGEST, LARGEST) / 2**24
    none = np.abs(d).max(axis=-1, keepdims=True) < 1e-30
    result: F64 = np.where(none, [0.0, 1.0, 0.0], d)
    return result


def unit_dir(dir: npt.ArrayLike) -> F64:
    """(..., 3) of any length -> of unit length; no direction at all counts as up."""
    d = finite_dir(dir)
    d = d / np.abs(d).max(axis=-1, keepdims=True)
    result: F64 = d / np.linalg.norm(d, axis=-1, keepdims=True)
    return result


def turned_up(dir: npt.ArrayLike) -> F64:
    """(..., 3) with y = |y|: what lies below the horizon, mirrored above it."""
    d = np.asarray(dir, np.float64)
    return np.stack([d[..., 0], np.abs(d[..., 1]), d[..., 2]], axis=-1)
