"""Directions to places in an environment picture. Twin of shaders/lib/environment.glsl; float64."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from glbump.maps import cube, layout

F64 = npt.NDArray[np.float64]


def latlong_uv(dir_env: npt.ArrayLike) -> F64:
    """(..., 3) any length -> (..., 2) in 0..1: centre -Z, v down."""
    return layout.latlong_uv(dir_env)


def latlong_dir(uv: npt.ArrayLike) -> F64:
    """(..., 2) -> (..., 3) unit length; inverse of latlong_uv."""
    return layout.latlong_dir(uv)


def cube_dir(face: npt.ArrayLike, st: npt.ArrayLike) -> F64:
    """Face 0..5 and (..., 2) texel coordinates 0..1 -> (..., 3), largest component 1 in size."""
    st = np.asarray(st, np.float64)
    return cube.face_dir(face, st[..., 0], st[..., 1])


def cube_border_dir(dir_env: npt.ArrayLike, inset: npt.ArrayLike) -> F64:
    """(..., 3) with its largest component made 1, and the two minor ones times inset (OpenEXR cubes)."""
    d = np.asarray(dir_env, np.float64)
    d = d / np.abs(d).max(axis=-1, keepdims=True)
    major = np.arange(3) == np.abs(d).argmax(axis=-1)[..., None]
    result: F64 = np.where(major, d, d * np.asarray(inset, np.float64)[..., None])
    return result


def sh9_irradiance(n_env: npt.ArrayLike, sh: npt.ArrayLike) -> F64:
    """Irradiance / pi (..., 3) towards (..., 3) unit normals from coefficients (9, 3), never negative.

    Ramamoorthi and Hanrahan 2001, equation 13, with the constants folded into the coefficients.
    """
    x, y, z = np.moveaxis(np.asarray(n_env, np.float64), -1, 0)
    basis = np.stack([np.ones_like(x), y, z, x, x * y, y * z, 3 * z * z - 1, x * z, x * x - y * y], axis=-1)
    return np.maximum(np.einsum("...k,...kc->...c", basis, np.asarray(sh, np.float64)), 0.0)
