"""How what a ray meets changes from pixel to pixel: ray differentials (Igehy 1999). Twin of shaders/lib/footprint.glsl.

float64, arrays (..., n). Each is the derivative of the function that its name begins with, for changes (..., 3) of its
arguments across a pixel.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from glbump.reference import mapping
from glbump.reference.direction import turning
from glbump.reference.reflect import reflect_dir

F64 = npt.NDArray[np.float64]

LEAST_COSINE = 1e-5
"""Least cosine of rays to a surface that they pass or leave: there changes are without bound."""


def _f64(value: npt.ArrayLike) -> F64:
    return np.asarray(value, np.float64)


def _dot(a: npt.ArrayLike, b: npt.ArrayLike) -> F64:
    result: F64 = np.einsum("...i,...i->...", _f64(a), _f64(b))[..., None]
    return result


def hit_change(dp: npt.ArrayLike, dir: npt.ArrayLike, n: npt.ArrayLike, least: npt.ArrayLike) -> F64:
    """Change (..., 3) of the point where a ray along `dir` meets a surface with normal n (of any length), where at the
    same depth it changes by dp: the distance changes by dt, so that n . (dp + dt dir) = 0 (equation 12). The cosine
    n . dir / |n| counts as `least` (...) at least."""
    along, shortest = _dot(dir, n), _f64(least)[..., None] * np.linalg.norm(_f64(n), axis=-1, keepdims=True)
    along = np.where(np.abs(along) < shortest, np.where(along < 0, -shortest, shortest), along)
    return _f64(dp) - _dot(dp, n) / along * _f64(dir)


def torus_normal_change(p_object: npt.ArrayLike, dp: npt.ArrayLike, radius: npt.ArrayLike) -> F64:
    """Of torus_normal (..., 3), for points of the torus that change by dp along it: dn/du and dn/dv, each by as much
    of u and v as dp has."""
    p = _f64(p_object)
    along = [mapping.torus_dpdu(p), mapping.torus_dpdv(p, radius)]
    turn = [mapping.torus_dndu(p, radius), mapping.torus_dndv(p, radius)]
    parts = [_dot(dp, a) / np.maximum(_dot(a, a), 1e-60) * n for a, n in zip(along, turn, strict=True)]
    result: F64 = parts[0] + parts[1]
    return result


def uv_change(dp: npt.ArrayLike, dpdu: npt.ArrayLike, dpdv: npt.ArrayLike) -> F64:
    """Changes (..., 2) of u and v, where a point changes by dp: dpdu du + dpdv dv = dp along the surface, by Cramer's
    rule; 0 without area."""
    uu, uv, vv, u, v = _dot(dpdu, dpdu), _dot(dpdu, dpdv), _dot(dpdv, dpdv), _dot(dp, dpdu), _dot(dp, dpdv)
    area = np.maximum(uu * vv - uv * uv, 1e-30)
    return np.concatenate([(u * vv - v * uv) / area, (v * uu - u * uv) / area], axis=-1)


def bump_normal_change(n: npt.ArrayLike, gradient: npt.ArrayLike, dn: npt.ArrayLike, dgradient: npt.ArrayLike) -> F64:
    """Of bump_normal (..., 3), for changes of the surface's normal and of the gradient."""
    return turning(_f64(n) - _f64(gradient), _f64(dn) - _f64(dgradient))


def reflect_dir_change(dir: npt.ArrayLike, n: npt.ArrayLike, ddir: npt.ArrayLike, dn: npt.ArrayLike) -> F64:
    """Of reflect_dir (..., 3): the product rule (equation 14)."""
    result: F64 = reflect_dir(_f64(ddir), _f64(n))
    return result - 2 * (_dot(dir, dn) * _f64(n) + _dot(dir, n) * _f64(dn))


def refract_dir_change(
    dir: npt.ArrayLike, n: npt.ArrayLike, eta: npt.ArrayLike, ddir: npt.ArrayLike, dn: npt.ArrayLike
) -> F64:
    """Of refract_dir (..., 3), and of the mirror direction past the critical angle.

    T = eta D + mu N with mu = T.N - eta D.N, so dT = eta dD + mu dN + dmu N, and T.N dT.N = eta^2 D.N d(D.N)
    (equations 15 to 18). T.N counts as LEAST_COSINE at least: there it changes without bound.
    """
    d, normal, ratio = _f64(dir), _f64(n), np.broadcast_to(_f64(eta)[..., None], (*np.shape(dir)[:-1], 1))
    along, change = _dot(d, normal), _dot(ddir, normal) + _dot(d, dn)
    square = 1 - ratio**2 * (1 - along) * (1 + along)
    behind = np.where(along > 0, 1, -1) * np.maximum(np.sqrt(np.maximum(square, 0)), LEAST_COSINE)
    mu, dmu = behind - ratio * along, (ratio * along / behind - 1) * ratio * change
    passing = ratio * _f64(ddir) + mu * _f64(dn) + dmu * normal
    return np.where(square < 0, reflect_dir_change(d, normal, ddir, dn), passing)
