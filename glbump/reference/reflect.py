"""Reflection and what share of the light it takes. Twin of shaders/lib/reflect.glsl; float64."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

F64 = npt.NDArray[np.float64]


def reflect_dir(dir: npt.ArrayLike, n: npt.ArrayLike) -> F64:
    """Mirror direction (..., 3) of dir, which points at the surface: the part along n turned round."""
    d, n = np.asarray(dir, np.float64), np.asarray(n, np.float64)
    along = np.einsum("...i,...i->...", d, n)[..., None] * n
    return (d - along) - along


def f0_from_ior(ior: npt.ArrayLike) -> F64:
    """Reflectance at normal incidence of a dielectric in air: ((ior - 1) / (ior + 1))^2 (Fresnel)."""
    n = np.asarray(ior, np.float64)
    return ((n - 1) / (n + 1)) ** 2


def fresnel_schlick(f0: npt.ArrayLike, cos_theta: npt.ArrayLike) -> F64:
    """Schlick 1994, equation 15. f0: (..., 3); cos_theta: (...), taken into 0..1."""
    f0 = np.asarray(f0, np.float64)
    m = np.clip(1 - np.asarray(cos_theta, np.float64), 0, 1)[..., None]
    return f0 + (1 - f0) * m**5
