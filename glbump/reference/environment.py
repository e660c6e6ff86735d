"""Directions to places in an environment picture. Twin of shaders/lib/environment.glsl; float64."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from glbump.maps import cube, layout
from glbump.reference.direction import largest_part, turning, unit_dir

F64 = npt.NDArray[np.float64]


def latlong_uv(dir_env: npt.ArrayLike) -> F64:
    """(..., 3) any length -> (..., 2) in 0..1: centre -Z, v down."""
    return layout.latlong_uv(dir_env)


def latlong_dir(uv: npt.ArrayLike) -> F64:
    """(..., 2) -> (..., 3) unit length; inverse of latlong_uv."""
    return layout.latlong_dir(uv)


def latlong_gradient(dir_env: npt.ArrayLike, change: npt.ArrayLike) -> F64:
    """How latlong_uv (..., 2) changes where dir_env (..., 3) changes by `change` (..., 3); each within -1/2..1/2.

    dphi = (x dz - z dx) / (x^2 + z^2), dtheta = (y d|xz| - |xz| dy) / |d|^2: the derivatives of both atan2.
    """
    d, turn = unit_dir(dir_env), turning(dir_env, change)
    across = np.hypot(d[..., 0], d[..., 2])
    at_pole = across == 0
    x, z = (np.where(at_pole, rule, d[..., i] / np.where(at_pole, 1, across)) for i, rule in ((0, 0.0), (2, -1.0)))
    east = (x * turn[..., 2] - z * turn[..., 0]) / np.maximum(across, 1e-18)
    down = d[..., 1] * (x * turn[..., 0] + z * turn[..., 2]) - across * turn[..., 1]
    return np.clip(np.stack([east / (2 * np.pi), down / np.pi], axis=-1), -0.5, 0.5)


def latlong_gradients(dir_env: npt.ArrayLike, ddx: npt.ArrayLike, ddy: npt.ArrayLike) -> F64:
    """(..., 4): du/dx, dv/dx, du/dy, dv/dy of latlong_uv, from the direction's derivatives (..., 3)."""
    return np.concatenate([latlong_gradient(dir_env, ddx), latlong_gradient(dir_env, ddy)], axis=-1)


def footprint_angle(dir_env: npt.ArrayLike, ddx: npt.ArrayLike, ddy: npt.ArrayLike) -> F64:
    """Solid angle (...) of a direction's footprint: the square of its longer side; from 1e-36 to the sphere's."""
    longest = np.maximum(*(np.linalg.norm(turning(dir_env, side), axis=-1) for side in (ddx, ddy)))
    return np.clip(longest**2, 1e-36, 4 * np.pi)


def latlong_level(dir_env: npt.ArrayLike, ddx: npt.ArrayLike, ddy: npt.ArrayLike, size: npt.ArrayLike) -> F64:
    """Mip level (...) of a lat-long picture of size (..., 2) = (width, height): half the log2 of a footprint's texels.

    A texel has 2 pi / width * pi / height * sin(theta), theta at least that of the middle of the uppermost row.
    """
    d, (width, height) = unit_dir(dir_env), np.moveaxis(np.asarray(size, np.float64), -1, 0)
    sine = np.maximum(np.hypot(d[..., 0], d[..., 2]), np.pi / 2 / height)
    return np.log2(footprint_angle(dir_env, ddx, ddy) / (2 * np.pi / width * np.pi / height * sine)) / 2


def cube_level(dir_env: npt.ArrayLike, ddx: npt.ArrayLike, ddy: npt.ArrayLike, size: npt.ArrayLike) -> F64:
    """Mip level (...) of a cube with faces `size` texels wide: half the log2 of a footprint's texels.

    A texel has (2 / size)^2 / r^3, r the distance of its place on a cube whose faces lie at 1.
    """
    texel = (2 / np.asarray(size, np.float64)) ** 2 * largest_part(unit_dir(dir_env)) ** 3
    return np.log2(footprint_angle(dir_env, ddx, ddy) / texel) / 2


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
