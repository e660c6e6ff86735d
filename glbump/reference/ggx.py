"""Glossy reflection. Twin of shaders/lib/ggx.glsl; float64."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

F64 = npt.NDArray[np.float64]


def dfg_fit(n_dot_v: npt.ArrayLike, roughness: npt.ArrayLike) -> F64:
    """(..., 2) split-sum factors A, B: the analytic fit of Karis, "Physically Based Shading on Mobile", 2014."""
    n_dot_v, r = np.broadcast_arrays(np.asarray(n_dot_v, np.float64), np.asarray(roughness, np.float64))
    x, y = 1 - r, 0.0425 - 0.0275 * r
    z, w = 1.04 - 0.572 * r, -0.04 + 0.022 * r
    a004 = np.minimum(x * x, 2.0 ** (-9.28 * n_dot_v)) * x + y
    return np.stack([z - 1.04 * a004, w + 1.04 * a004], axis=-1)


def glossy_share(f0: npt.ArrayLike, n_dot_v: npt.ArrayLike, roughness: npt.ArrayLike) -> F64:
    """(..., 3) share of the light reflected, repeated scattering counted in: (F0 A + B) / (A + B)."""
    ab = np.maximum(dfg_fit(np.clip(np.asarray(n_dot_v, np.float64), 0, 1), roughness), 0)
    a, b = ab[..., :1], ab[..., 1:]
    result: F64 = (np.asarray(f0, np.float64) * a + b) / (a + b)
    return result


def lobe_dir(n: npt.ArrayLike, mirror_dir: npt.ArrayLike, roughness: npt.ArrayLike) -> F64:
    """(..., 3) where a broad lobe peaks, between the unit normal and the unit mirror direction; not unit length.

    Lagarde and de Rousiers, "Moving Frostbite to Physically Based Rendering", 2014, section 4.9.3.
    """
    n, r = np.asarray(n, np.float64), np.asarray(mirror_dir, np.float64)
    alpha = np.asarray(roughness, np.float64)[..., None] ** 2
    share = (1 - alpha) * (np.sqrt(1 - alpha) + alpha)
    return n + (r - n) * share
