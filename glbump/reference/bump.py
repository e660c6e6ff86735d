"""Normals bent by the gradient of a height. Twin of shaders/lib/bump.glsl; float64, arrays (..., n)."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

F64 = npt.NDArray[np.float64]


def _unit(v: F64) -> F64:
    """Unit length, whatever the length; zero stays zero."""
    largest = np.abs(v).max(axis=-1, keepdims=True)
    v = v / np.where(largest == 0, 1.0, largest)
    length = np.linalg.norm(v, axis=-1, keepdims=True)
    result: F64 = v / np.where(length == 0, 1.0, length)
    return result


def surface_gradient(n: npt.ArrayLike, dpdu: npt.ArrayLike, dpdv: npt.ArrayLike, slope: npt.ArrayLike) -> F64:
    """The vector g in the tangent plane with g . dp/du = dB/du and g . dp/dv = dB/dv; zero where dp/du and
    dp/dv span no area (|sine of their angle, seen along n| < 1e-6, or a length below 1e-18).

    Solved from the first fundamental form of dp/du and dp/dv projected to the tangent plane, which the closed
    form of the GLSL does not use.
    """
    n, pu, pv, s = (np.asarray(v, np.float64) for v in (n, dpdu, dpdv, slope))
    n, pu, pv = np.broadcast_arrays(n, pu, pv)
    lu, lv = np.linalg.norm(pu, axis=-1), np.linalg.norm(pv, axis=-1)
    tu, tv = _unit(pu), _unit(pv)
    flat = (np.abs(np.einsum("...i,...i->...", n, np.cross(tu, tv))) < 1e-6) | (lu < 1e-18) | (lv < 1e-18)
    tu, tv = (t - n * np.einsum("...i,...i->...", n, t)[..., None] for t in (tu, tv))
    e, f, g = (np.einsum("...i,...i->...", a, b) for a, b in ((tu, tu), (tu, tv), (tv, tv)))
    det = np.where(flat, 1.0, e * g - f * f)
    su, sv = (s[..., i] / np.where(flat, 1.0, length) for i, length in enumerate((lu, lv)))
    gradient = ((g * su - f * sv) / det)[..., None] * tu + ((e * sv - f * su) / det)[..., None] * tv
    return np.where(flat[..., None], 0.0, gradient)


def surface_gradient_screen(n: npt.ArrayLike, p: npt.ArrayLike, height: npt.ArrayLike) -> F64:
    """surface_gradient of differences within quads of pixels: n, p (..., 2, 2, 3), height (..., 2, 2); [y, x], y up."""
    q, h = np.asarray(p, np.float64), np.asarray(height, np.float64)[..., None]
    dx, dy = ((a[..., 1:, :] - a[..., :1, :], a[..., 1:, :, :] - a[..., :1, :, :]) for a in (q, h))
    (p_x, h_x), (p_y, h_y) = zip(dx, dy, strict=True)
    return surface_gradient(n, p_x, p_y, np.concatenate(np.broadcast_arrays(h_x, h_y), axis=-1))


def full_gradient(
    n: npt.ArrayLike,
    dpdu: npt.ArrayLike,
    dpdv: npt.ArrayLike,
    dndu: npt.ArrayLike,
    dndv: npt.ArrayLike,
    height: npt.ArrayLike,
    slope: npt.ArrayLike,
) -> F64:
    """The g for which n - g is along +-(P'u x P'v), P' = P + B n, with all of its terms (Blinn 1978); on n's side.

    That is the gradient on the surface moved out evenly by B, whose derivatives are Pu + B n_u and Pv + B n_v:
    tests/test_bump_order.py holds it against the displaced surface. Zero where that surface has no area, at a centre
    of curvature. dndu, dndv: of the unit normal; their parts along n do not count. height: (...), in dpdu's lengths.
    """
    b = np.asarray(height, np.float64)[..., None]
    pu, pv, nu, nv = (np.asarray(v, np.float64) for v in (dpdu, dpdv, dndu, dndv))
    return surface_gradient(n, pu + b * nu, pv + b * nv, slope)


def invariant_gradient(n: npt.ArrayLike, dpdu: npt.ArrayLike, dpdv: npt.ArrayLike, slope: npt.ArrayLike) -> F64:
    """The g for which n - g is n turned by atan |slope| about Bv Pu - Bu Pv (Blinn's thesis, 1978, p. 140), the other
    way round where u, v are mirrored: no scale of the surface changes it. Zero where surface_gradient is.
    """
    n, pu, pv, s = (np.asarray(v, np.float64) for v in (n, dpdu, dpdv, slope))
    level = s[..., 1:] * pu - s[..., :1] * pv
    # The axis lies in the tangent plane: dp/du and dp/dv may not, where they are means over triangles.
    level = level - n * np.einsum("...i,...i->...", n, level)[..., None]
    mirrored = np.einsum("...i,...i->...", n, np.cross(_unit(pu), _unit(pv))) < 0
    tangent = np.linalg.norm(s, axis=-1) * np.where(mirrored, 1.0, -1.0)
    turned = tangent[..., None] * np.cross(_unit(level), n)
    none = (surface_gradient(n, pu, pv, _unit(s)) == 0).all(axis=-1, keepdims=True)
    return np.where(none, 0.0, turned)


def orthogonal_gradient(dpdu: npt.ArrayLike, dpdv: npt.ArrayLike, slope: npt.ArrayLike) -> F64:
    """surface_gradient for dp/du and dp/dv at right angles in the tangent plane; zero along one below 1e-12."""
    total: F64 = np.zeros(3)
    for axis, direction in enumerate((dpdu, dpdv)):
        d, s = np.asarray(direction, np.float64), np.asarray(slope, np.float64)[..., axis, None]
        length = np.linalg.norm(d, axis=-1, keepdims=True)
        none = length <= 1e-12
        total = total + np.where(none, 0.0, s / np.where(none, 1.0, length) * _unit(d))
    return total


def volume_gradient(n: npt.ArrayLike, g: npt.ArrayLike) -> F64:
    """The part in the tangent plane of g, the gradient in space of a height: (n x g) x n."""
    unit, gradient = np.asarray(n, np.float64), np.asarray(g, np.float64)
    return np.cross(np.cross(unit, gradient), unit)


def triplanar_shares(n: npt.ArrayLike) -> F64:
    """(..., 3) in 0..1, 1 in all: the eighth powers of the components over their sum; 0 of no normal."""
    power = np.asarray(n, np.float64) ** 8
    total = power.sum(axis=-1, keepdims=True)
    return power / np.where(total == 0, 1.0, total)


def bump_normal(n: npt.ArrayLike, gradient: npt.ArrayLike) -> F64:
    """Unit normal of the surface raised by a height with this surface gradient."""
    return _unit(np.asarray(n, np.float64) - np.asarray(gradient, np.float64))


def tangent_frame(n: npt.ArrayLike, dpdu: npt.ArrayLike, dpdv: npt.ArrayLike) -> tuple[F64, F64]:
    """Unit tangent along dp/du in the tangent plane, and unit bitangent at right angles to it on the side of dp/dv.

    Both zero where dp/du has no part in the tangent plane (below 1e-18): there is no bump.
    """
    n, pu, pv = (np.asarray(v, np.float64) for v in (n, dpdu, dpdv))
    along = pu - n * np.einsum("...i,...i->...", n, pu)[..., None]
    t = np.where(np.linalg.norm(along, axis=-1, keepdims=True) <= 1e-18, 0.0, _unit(along))
    b = np.cross(n, t)
    side = np.where(np.einsum("...i,...i->...", b, pv) < 0, -1.0, 1.0)[..., None]
    return t, side * b
