"""What levels of slopes leave out: how the slopes that a texel covers vary about their mean."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from glbump.maps.pyramid import chain, slope_moments

F32 = npt.NDArray[np.float32]


def lean_levels(slopes: npt.NDArray[Any], unit: float) -> list[F32]:
    """Of slopes (H, W, 2) levels 1 and on, (h, w, 3) each: central second moments uu, uv, vv over unit squared (Olano
    and Baker, "LEAN Mapping", 2010; they keep raw moments, which cancel). One level of 0 for a map of one texel."""
    levels = slope_moments(slopes / np.float64(unit))[1:]
    return [moments for _, moments in levels] or [np.zeros((1, 1, 3), np.float32)]


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
