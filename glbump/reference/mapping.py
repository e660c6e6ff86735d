"""Surfaces to texture coordinates. Twin of shaders/lib/mapping.glsl; float64, arrays (..., n)."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

F64 = npt.NDArray[np.float64]


def _f64(value: npt.ArrayLike) -> F64:
    return np.asarray(value, np.float64)


def _dot(a: F64, b: F64) -> F64:
    result: F64 = np.einsum("...i,...i->...", a, b)
    return result


def _longitude(x: F64, z: F64) -> F64:
    """Angle about +Y from +Z; 0 on the axis, by rule."""
    return np.where((x == 0) & (z == 0), 0.0, np.arctan2(x, z))


def sphere_step(p_object: npt.ArrayLike, dir_object: npt.ArrayLike, radius: npt.ArrayLike) -> F64:
    """Ray parameter (...) from p_object to where the ray enters the sphere |p| = radius; the closest point's
    where it passes outside. dir_object: unit length."""
    p, d, r = _f64(p_object), _f64(dir_object), _f64(radius)
    b = _dot(p, d)
    return -b - np.sqrt(np.maximum(b * b - (_dot(p, p) - r * r), 0.0))


def sphere_uv(p_object: npt.ArrayLike) -> F64:
    """u = 1/2 + longitude / 2 pi from +Z, v = 1/2 + latitude / pi."""
    x, y, z = np.moveaxis(_f64(p_object), -1, 0)
    return np.stack([0.5 + _longitude(x, z) / (2 * np.pi), 0.5 + np.arctan2(y, np.hypot(x, z)) / np.pi], axis=-1)


def sphere_dpdu(p_object: npt.ArrayLike) -> F64:
    """Derivative by longitude, times 2 pi."""
    x, y, z = np.moveaxis(_f64(p_object), -1, 0)
    return 2 * np.pi * np.stack([z, 0 * y, -x], axis=-1)


def sphere_dpdv(p_object: npt.ArrayLike) -> F64:
    """Derivative by latitude, times pi; at the poles that of longitude 0."""
    x, y, z = np.moveaxis(_f64(p_object), -1, 0)
    longitude = _longitude(x, z)
    return np.pi * np.stack([-y * np.sin(longitude), np.hypot(x, z), -y * np.cos(longitude)], axis=-1)


def sphere_dndu(p_object: npt.ArrayLike, radius: npt.ArrayLike) -> F64:
    """Derivative of the unit normal by u: the normal is p / radius."""
    return sphere_dpdu(p_object) / _f64(radius)[..., None]


def sphere_dndv(p_object: npt.ArrayLike, radius: npt.ArrayLike) -> F64:
    """Derivative of the unit normal by v."""
    return sphere_dpdv(p_object) / _f64(radius)[..., None]


def torus_step(p_object: npt.ArrayLike, dir_object: npt.ArrayLike, radius: npt.ArrayLike, tube: npt.ArrayLike) -> F64:
    """Ray parameter (...) from p_object, near the torus, to the torus: the root of the distance to the tube's
    centre line minus the tube, by Newton's iteration to float64's end. Bounded as the GLSL is: at most three
    tenths of the tube away."""
    p, d, big, small = _f64(p_object), _f64(dir_object), _f64(radius), _f64(tube)
    t = np.zeros(np.broadcast_shapes(p.shape[:-1], d.shape[:-1], big.shape, small.shape))
    for _ in range(12):
        q = p + t[..., None] * d
        h = np.hypot(q[..., 0], q[..., 2])
        to_ring = np.hypot(h - big, q[..., 1])
        outwards = ((h - big) * (q[..., 0] * d[..., 0] + q[..., 2] * d[..., 2]) / np.maximum(h, 1e-300)) + q[
            ..., 1
        ] * d[..., 1]
        slope = outwards / np.maximum(to_ring, 1e-300)
        step = (to_ring - small) / np.where(np.abs(slope) > 1e-12, slope, 1e-12)
        t = np.clip(t - np.clip(step, -0.1 * small, 0.1 * small), -0.3 * small, 0.3 * small)
    return t


def torus_normal(p_object: npt.ArrayLike, radius: npt.ArrayLike) -> F64:
    """Outward unit normal: from the nearest point of the tube's centre line to p_object."""
    p = _f64(p_object)
    longitude = _longitude(p[..., 0], p[..., 2])
    psi = np.arctan2(p[..., 1], np.hypot(p[..., 0], p[..., 2]) - _f64(radius))
    return np.stack([np.cos(psi) * np.sin(longitude), np.sin(psi), np.cos(psi) * np.cos(longitude)], axis=-1)


def torus_uv(p_object: npt.ArrayLike, radius: npt.ArrayLike) -> F64:
    """u by longitude from +Z, v by the angle about the tube: 1/2 on the outer equator, rising."""
    x, y, z = np.moveaxis(_f64(p_object), -1, 0)
    psi = np.arctan2(y, np.hypot(x, z) - _f64(radius))
    return np.stack([0.5 + _longitude(x, z) / (2 * np.pi), 0.5 + psi / (2 * np.pi)], axis=-1)


def torus_dpdu(p_object: npt.ArrayLike) -> F64:
    """Derivative by longitude, times 2 pi."""
    return sphere_dpdu(p_object)


def torus_dpdv(p_object: npt.ArrayLike, radius: npt.ArrayLike) -> F64:
    """Derivative by the angle about the tube, times 2 pi."""
    x, y, z = np.moveaxis(_f64(p_object), -1, 0)
    longitude = _longitude(x, z)
    return (
        2 * np.pi * np.stack([-y * np.sin(longitude), np.hypot(x, z) - _f64(radius), -y * np.cos(longitude)], axis=-1)
    )


def torus_dndu(p_object: npt.ArrayLike, radius: npt.ArrayLike) -> F64:
    """Derivative of torus_normal by u: 2 pi cos(psi) along the parallel, psi the angle about the tube; 0 on the axis,
    where there is no parallel."""
    p = _f64(p_object)
    longitude = _longitude(p[..., 0], p[..., 2])
    psi = np.arctan2(p[..., 1], np.hypot(p[..., 0], p[..., 2]) - _f64(radius))
    along = np.stack([np.cos(longitude), 0 * longitude, -np.sin(longitude)], axis=-1)
    off_axis = np.hypot(p[..., 0], p[..., 2]) > 0
    return np.where(off_axis, 2 * np.pi * np.cos(psi), 0.0)[..., None] * along


def torus_dndv(p_object: npt.ArrayLike, radius: npt.ArrayLike) -> F64:
    """Derivative of torus_normal by v: 2 pi along the meridian of the tube."""
    p = _f64(p_object)
    longitude = _longitude(p[..., 0], p[..., 2])
    psi = np.arctan2(p[..., 1], np.hypot(p[..., 0], p[..., 2]) - _f64(radius))
    return (
        2 * np.pi * np.stack([-np.sin(psi) * np.sin(longitude), np.cos(psi), -np.sin(psi) * np.cos(longitude)], axis=-1)
    )


def inverse_bilinear(
    p_object: npt.ArrayLike, a: npt.ArrayLike, b: npt.ArrayLike, c: npt.ArrayLike, d: npt.ArrayLike
) -> F64:
    """u, v with p = (1-u)(1-v) a + u (1-v) b + u v c + (1-u) v d, in the flat convex quad a b c d.

    Written in the quad's own plane coordinates: the quadratic in v of the lecture's inverse bilinear mapping.
    """
    p, a, b, c, d = (_f64(v) for v in (p_object, a, b, c, d))
    normal = np.cross(c - a, d - b)
    along = (b - a) / np.linalg.norm(b - a, axis=-1, keepdims=True)
    across = np.cross(normal, along)
    across = across / np.linalg.norm(across, axis=-1, keepdims=True)

    def flat(v: F64) -> tuple[F64, F64]:
        return _dot(v, along), _dot(v, across)

    def wedge(v: tuple[F64, F64], w: tuple[F64, F64]) -> F64:
        return v[0] * w[1] - v[1] * w[0]

    e, f, g, q = flat(b - a), flat(d - a), flat(a - b + c - d), flat(p - a)
    # q = u e + v f + u v g: wedge with e + v g takes u away.
    k2, k1, k0 = wedge(f, g), wedge(f, e) - wedge(q, g), -wedge(q, e)
    root = np.sqrt(np.maximum(k1 * k1 - 4 * k2 * k0, 0.0))
    # k1 < 0 in a convex quad taken counter-clockwise: the small root, without cancellation.
    v = 2 * k0 / np.where(k1 <= 0, -k1 + root, -k1 - root)
    row = (e[0] + v * g[0], e[1] + v * g[1])
    rest = (q[0] - v * f[0], q[1] - v * f[1])
    u = (rest[0] * row[0] + rest[1] * row[1]) / (row[0] ** 2 + row[1] ** 2)
    return np.stack([u, v], axis=-1)


def bilinear_dpdu(uv: npt.ArrayLike, a: npt.ArrayLike, b: npt.ArrayLike, c: npt.ArrayLike, d: npt.ArrayLike) -> F64:
    """dp/du of the bilinear quad."""
    v = _f64(uv)[..., 1:]
    return (1 - v) * (_f64(b) - _f64(a)) + v * (_f64(c) - _f64(d))


def bilinear_dpdv(uv: npt.ArrayLike, a: npt.ArrayLike, b: npt.ArrayLike, c: npt.ArrayLike, d: npt.ArrayLike) -> F64:
    """dp/dv of the bilinear quad."""
    u = _f64(uv)[..., :1]
    return (1 - u) * (_f64(d) - _f64(a)) + u * (_f64(c) - _f64(b))


def barycentric(p_object: npt.ArrayLike, a: npt.ArrayLike, b: npt.ArrayLike, c: npt.ArrayLike) -> F64:
    """Weights (..., 3) of a, b, c at p_object: areas of the opposite triangles, signed by the normal; (1, 0, 0)
    where the triangle has no area."""
    p, a, b, c = (_f64(v) for v in (p_object, a, b, c))
    normal = np.cross(b - a, c - a)
    area = _dot(normal, normal)
    safe = np.where(area == 0, 1.0, area)
    wb = np.where(area == 0, 0.0, _dot(normal, np.cross(p - a, c - a)) / safe)
    wc = np.where(area == 0, 0.0, _dot(normal, np.cross(b - a, p - a)) / safe)
    return np.stack([1 - wb - wc, wb, wc], axis=-1)
