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
    return np.where((largest_part(d) < 1e-30)[..., None], [0.0, 1.0, 0.0], d)


def largest_part(dir: npt.ArrayLike) -> F64:
    """(..., 3) -> (...): the largest component's size."""
    return np.abs(np.asarray(dir, np.float64)).max(axis=-1)


def unit_dir(dir: npt.ArrayLike) -> F64:
    """(..., 3) of any length -> of unit length; no direction at all counts as up."""
    d = finite_dir(dir)
    d = d / largest_part(d)[..., None]
    result: F64 = d / np.linalg.norm(d, axis=-1, keepdims=True)
    return result


def turning(dir: npt.ArrayLike, change: npt.ArrayLike) -> F64:
    """How unit_dir(dir) changes where dir (..., 3) changes by `change` (..., 3): across it, in radians.

    The derivative of d / |d|: (c - u (u . c)) / |d|. By the shader's rules for the extremes of both.
    """
    d, u = finite_dir(dir), unit_dir(dir)
    largest = largest_part(d)[..., None]
    c = np.clip(np.clip(np.asarray(change, np.float64), -LARGEST, LARGEST) / 2**24 / largest, -1e18, 1e18)
    return (c - u * np.einsum("...i,...i->...", u, c)[..., None]) / np.linalg.norm(d / largest, axis=-1, keepdims=True)


def axes_across(n: npt.ArrayLike) -> tuple[F64, F64]:
    """Two unit vectors (..., 3) across the unit vector n (..., 3) and each other (Duff et al. 2017)."""
    x, y, z = np.moveaxis(np.asarray(n, np.float64), -1, 0)
    side = np.where(z >= 0, 1.0, -1.0)
    a = -1 / (side + z)
    b = x * y * a
    return np.stack([1 + side * x * x * a, side * b, -side * x], axis=-1), np.stack([b, side + y * y * a, -y], axis=-1)


def turned_up(dir: npt.ArrayLike) -> F64:
    """(..., 3) with y = |y|: what lies below the horizon, mirrored above it."""
    d = np.asarray(dir, np.float64)
    return np.stack([d[..., 0], np.abs(d[..., 1]), d[..., 2]], axis=-1)
