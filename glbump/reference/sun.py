"""The light of one sun, a small disc of even light. Twin of shaders/lib/sun.glsl; float64."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from glbump.reference.reflect import fresnel_schlick

F64 = npt.NDArray[np.float64]


def sun_reflected(
    n: npt.ArrayLike,
    v: npt.ArrayLike,
    sun_dir: npt.ArrayLike,
    radius: npt.ArrayLike,
    roughness: npt.ArrayLike,
    f0: npt.ArrayLike,
) -> F64:
    """(..., 3) radiance towards v per irradiance of a sun: D G2 F / (4 n.v), of unit vectors (..., 3).

    D is GGX's of two roughnesses, each alpha^2 and the square of how far half vectors of the disc reach along that
    axis: radius / 2 in the plane of v and the sun, that over v.h across. At most the 1 / (pi radius^2) of a mirror.
    """
    n, v, to_sun, f0 = (np.asarray(x, np.float64) for x in (n, v, sun_dir, f0))
    radius, square = np.asarray(radius, np.float64), np.asarray(roughness, np.float64) ** 4
    half = v + to_sun
    half = half / np.maximum(np.linalg.norm(half, axis=-1, keepdims=True), 1e-30)
    nl, nv = np.maximum(np.sum(n * to_sun, axis=-1), 0.0), np.maximum(np.sum(n * v, axis=-1), 1e-4)
    across = np.cross(v, to_sun)
    across = across / np.maximum(np.linalg.norm(across, axis=-1, keepdims=True), 1e-6)
    ahead, aside = square + radius**2 / 4, square + (radius / 2 / np.sum(v * half, axis=-1)) ** 2
    to_side = np.sum(n * across, axis=-1) ** 2
    to_front = np.maximum(np.sum(np.cross(n, half) ** 2, axis=-1) - to_side, 0.0)
    tail = to_front / ahead + to_side / aside + np.sum(n * half, axis=-1) ** 2
    d = 1 / (np.pi * np.sqrt(ahead * aside) * tail**2)
    # G2 / (4 n.l n.v), Heitz 2014, equation 99.
    slant_v, slant_l = (np.sqrt(square + (1 - square) * c**2) for c in (nv, nl))
    seen = 1 / (2 * np.maximum(nl * slant_v + nv * slant_l, 1e-30))
    lobe = np.minimum(d * seen * nl, 1 / (np.pi * radius**2))
    result: F64 = lobe[..., None] * fresnel_schlick(f0, np.sum(v * half, axis=-1))
    return result
