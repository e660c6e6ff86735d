"""What levels of slopes leave out: how the slopes that a texel covers vary about their mean."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from glbump.frozen import Frozen
from glbump.maps.pyramid import chain, slope_moments

F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]


FLAT = 0.1
"""Most that a slope that counts as flat is, of the root mean square of a map's. Of bell-shaped slopes 1 % are, of dents
and bricks a fifth and a half; where these are seen from afar twice as much has up to 3 % more error."""


class Flats(Frozen):
    """The flat places of a map of slopes. is_flat: (H, W). share: of all texels. moments: (3,), second moments uu, uv,
    vv of their slopes, about 0."""

    is_flat: npt.NDArray[np.bool_]
    share: float
    moments: F64


def flats(slopes: npt.NDArray[Any]) -> Flats:
    """Where slopes (H, W, 2) are flat."""
    square = np.einsum("...i,...i->...", slopes, slopes, dtype=np.float64)
    is_flat = square <= FLAT**2 * square.mean()
    u, v = slopes[is_flat].astype(np.float64).T
    moments = np.array([u @ u, u @ v, v @ v]) / max(len(u), 1)
    return Flats(is_flat, float(is_flat.mean()), moments)


def lean_levels(slopes: npt.NDArray[Any], unit: float, apart: Flats | None = None) -> list[F32]:
    """Of slopes (H, W, 2) levels 1 and on, (h, w, 3) each: central second moments uu, uv, vv over unit squared (Olano
    and Baker, "LEAN Mapping", 2010; they keep raw moments, which cancel). One level of 0 for a map of one texel.

    apart: the map's flat places; levels are (h, w, 4) then, with the share of the others."""
    levels = [moments for _, moments in slope_moments(slopes / np.float64(unit))[1:]]
    levels = levels or [np.zeros((1, 1, 3), np.float32)]
    if apart is None:
        return levels
    steep = 1 - apart.is_flat[..., None].astype(np.float32)
    shares = chain(steep)[1:] or [steep]
    return [np.concatenate(both, axis=-1, dtype=np.float32) for both in zip(levels, shares, strict=True)]


def moment_scale(scale: npt.ArrayLike) -> F64:
    """(3,) what second moments uu, uv, vv are times, where slopes along u and v are times `scale` (2,)."""
    u, v = np.asarray(scale, np.float64)
    return np.array([u * u, u * v, v * v])


def toksvig_levels(slopes: npt.NDArray[Any], unit: float, *, are_lengths: bool) -> list[F32]:
    """The same as one variance for all directions, (h, w, 1): (1 - |N|) / |N| of the mean N of unit normals (Toksvig,
    "Mipmapping Normal Maps", 2005).

    are_lengths: the slopes are against the surface, as a normal map's. Heights' are not before it is known how they lie
    on it: theirs are taken as gentle, where that is the mean of both axes' variances; of steep ones Toksvig's is less.
    """
    if not are_lengths:
        return [np.float32(0.5) * (level[..., :1] + level[..., 2:]) for level in lean_levels(slopes, unit)]
    normals = np.concatenate([slopes, np.ones_like(slopes[..., :1])], axis=-1, dtype=np.float64)
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    result = []
    for mean in chain(normals)[1:]:
        length = np.linalg.norm(mean.astype(np.float64), axis=-1, keepdims=True)
        result.append((np.maximum(1 - length, 0) / length / unit**2).astype(np.float32))
    return result or [np.zeros((1, 1, 1), np.float32)]
