"""Glossy reflection. Twin of shaders/lib/ggx.glsl; float64."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

F64 = npt.NDArray[np.float64]

_GOLDEN = (np.sqrt(5) - 1) / 2


def dfg_fit(n_dot_v: npt.ArrayLike, roughness: npt.ArrayLike) -> F64:
    """(..., 2) split-sum factors A, B: the analytic fit of Karis, "Physically Based Shading on Mobile", 2014, not
    below 0."""
    n_dot_v, r = np.broadcast_arrays(np.clip(n_dot_v, 0.0, 1.0), np.asarray(roughness, np.float64))
    x, y = 1 - r, 0.0425 - 0.0275 * r
    z, w = 1.04 - 0.572 * r, -0.04 + 0.022 * r
    a004 = np.minimum(x * x, 2.0 ** (-9.28 * n_dot_v)) * x + y
    return np.maximum(np.stack([z - 1.04 * a004, w + 1.04 * a004], axis=-1), 0.0)


def dfg_place(n_dot_v: npt.ArrayLike, roughness: npt.ArrayLike, size: npt.ArrayLike) -> F64:
    """(..., 2) texture coordinates of the factors in a table: root of n.v, roughness; 0 and 1 at texels' middles."""
    root, r, n = np.broadcast_arrays(np.sqrt(np.clip(n_dot_v, 0.0, 1.0)), np.asarray(roughness, np.float64), size)
    result: F64 = (np.stack([root, r], axis=-1) * (n - 1)[..., None] + 0.5) / n[..., None]
    return result


def glossy_share(f0: npt.ArrayLike, dfg: npt.ArrayLike) -> F64:
    """(..., 3) share of the light reflected, repeated scattering counted in, of split-sum factors (..., 2).

    Turquin 2019, equation 16, with the facets' mean reflectance F = (F0 A + B) / (A + B) in place of F0:
    F E + F^2 (1 - E), E = A + B what leaves after one facet.
    """
    a, b = (np.asarray(dfg, np.float64)[..., i : i + 1] for i in (0, 1))
    facet = (np.asarray(f0, np.float64) * a + b) / (a + b)
    once = np.minimum(a + b, 1)
    result: F64 = facet * once + facet * facet * (1 - once)
    return result


def lobe_dir(n: npt.ArrayLike, mirror_dir: npt.ArrayLike, roughness: npt.ArrayLike) -> F64:
    """(..., 3) where a broad lobe peaks, between the unit normal and the unit mirror direction; not unit length.

    Lagarde and de Rousiers, "Moving Frostbite to Physically Based Rendering", 2014, section 4.9.3.
    """
    n, r = np.asarray(n, np.float64), np.asarray(mirror_dir, np.float64)
    alpha = np.asarray(roughness, np.float64)[..., None] ** 2
    share = (1 - alpha) * (np.sqrt(1 - alpha) + alpha)
    return n + (r - n) * share


def lobe_shape(cosine: npt.ArrayLike, alpha: npt.ArrayLike) -> F64:
    """D(h) (n.l) for n = v, over its peak, of the cosine (...) between n and l: (n.h)^2 = (1 + n.l) / 2."""
    c, square = np.asarray(cosine, np.float64), np.square(np.asarray(alpha, np.float64))
    result: F64 = np.maximum(c, 0) * (square / (1 + (square - 1) * (1 + c) / 2)) ** 2
    return result


def lobe_place(i: npt.ArrayLike, count: npt.ArrayLike) -> F64:
    """(..., 2) in 0..1: place i of `count` on the unit square, golden-ratio steps along x and layers along y."""
    number = np.asarray(i, np.float64)
    up = (number + 0.5) / np.asarray(count, np.float64)
    return np.stack(np.broadcast_arrays(number * _GOLDEN % 1.0, up), axis=-1)


def visible_normal(v_tan: npt.ArrayLike, alpha: npt.ArrayLike, place: npt.ArrayLike) -> F64:
    """(..., 3) unit normal of a facet seen along v_tan (..., 3), z the surface's normal, for a place (..., 2).

    GGX's visible normals by stretching the surface to spheres, whose caps seen are even in height (Dupuy and Benyoub
    2023).
    """
    v, at = np.asarray(v_tan, np.float64), np.asarray(place, np.float64)
    stretch = np.stack(np.broadcast_arrays(alpha, alpha, 1.0), axis=-1).astype(np.float64)
    v = v * stretch
    v = v / np.linalg.norm(v, axis=-1, keepdims=True)
    z = 1 - at[..., 1] * (1 + v[..., 2])
    across, turn = np.sqrt(np.maximum(1 - z * z, 0)), 2 * np.pi * at[..., 0]
    h = np.stack([across * np.cos(turn), across * np.sin(turn), z], axis=-1) + v
    h[..., 2] = np.maximum(h[..., 2], 0)
    h = h * stretch
    result: F64 = h / np.linalg.norm(h, axis=-1, keepdims=True)
    return result


def normal_angle(h_tan: npt.ArrayLike, v_tan: npt.ArrayLike, alpha: npt.ArrayLike, count: npt.ArrayLike) -> F64:
    """(...) solid angle of one of `count` visible normals, round h_tan: 1 / (count p), p = G1(v) (v.h) D(h) / (n.v)."""
    h, v, a = (np.asarray(x, np.float64) for x in (h_tan, v_tan, alpha))
    d = a**2 / (np.pi * (h[..., 0] ** 2 + h[..., 1] ** 2 + (a * h[..., 2]) ** 2) ** 2)
    nv = v[..., 2]
    g1_over_nv = 2 / (nv + np.sqrt(a**2 + (1 - a**2) * nv**2))
    result: F64 = 1 / (
        np.asarray(count, np.float64) * g1_over_nv * np.maximum(np.einsum("...i,...i->...", v, h), 1e-6) * d
    )
    return result


def unshadowed(n_dot_v: npt.ArrayLike, n_dot_l: npt.ArrayLike, alpha: npt.ArrayLike) -> F64:
    """(...) Smith's G2 / G1(v), correlated in height (Heitz 2014, equation 99); 0 where n.l is below 0."""
    to_v, square = np.asarray(n_dot_v, np.float64), np.square(np.asarray(alpha, np.float64))
    to_l = np.maximum(np.asarray(n_dot_l, np.float64), 0)
    slant_v, slant_l = (np.sqrt(square + (1 - square) * c * c) for c in (to_v, to_l))
    result: F64 = to_l * (to_v + slant_v) / np.maximum(to_l * slant_v + to_v * slant_l, 1e-30)
    return result
