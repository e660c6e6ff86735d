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


def refract_dir(dir: npt.ArrayLike, n: npt.ArrayLike, eta: npt.ArrayLike) -> F64:
    """Direction (..., 3) of dir behind the surface, by Snell's law; the mirror direction where all is reflected.

    dir, n: unit length; n may point to either side. eta: index of refraction before over behind.
    """
    d, n, eta = (np.asarray(a, np.float64) for a in (dir, n, eta))
    cos_i = np.einsum("...i,...i->...", d, n)
    across = eta[..., None] * (d - cos_i[..., None] * n)
    sin2_t = np.einsum("...i,...i->...", across, across)
    cos_t = np.where(cos_i > 0, 1, -1) * np.sqrt(np.maximum(1 - sin2_t, 0))
    return np.where((sin2_t > 1)[..., None], reflect_dir(d, n), across + cos_t[..., None] * n)


def fresnel_dielectric(cos_i: npt.ArrayLike, eta: npt.ArrayLike) -> F64:
    """Share of unpolarised light that a dielectric reflects: the mean of Fresnel's two, 1 past the critical angle.

    cos_i: (...), taken into 0..1. eta: index of refraction before over behind. Born and Wolf, Principles of Optics,
    section 1.5.2, with the squares a^2 - b^2 of each numerator multiplied out: r = (a - b) / (a + b).
    """
    c, eta = np.clip(np.asarray(cos_i, np.float64), 0, 1), np.asarray(eta, np.float64)
    between = (1 - eta) * (1 + eta)
    square = between + (eta * c) ** 2
    total = square < 0
    cos_t = np.sqrt(np.where(total, 1.0, square))
    # Both numerators hold 1 - eta^2 as a factor; denominators are 0 only where it is 0 as well.
    s = between / np.maximum(eta * c + cos_t, 1e-150) ** 2
    p = between * (eta**2 - (1 + eta**2) * c**2) / np.maximum(c + eta * cos_t, 1e-150) ** 2
    return np.where(total, 1.0, (s**2 + p**2) / 2)


def facing(n: npt.ArrayLike, dir: npt.ArrayLike) -> F64:
    """Normals (..., 3), those that face away from the eye mirrored to its side of the plane dir is normal to.

    n, dir: unit length, dir points at the surface. Mikkelsen 2010, FixNormal: n - 2 (n.v) v, v = -dir.
    """
    n, d = np.asarray(n, np.float64), np.asarray(dir, np.float64)
    return n - 2 * np.maximum(np.einsum("...i,...i->...", n, d), 0.0)[..., None] * d


def above_surface(dir: npt.ArrayLike, n: npt.ArrayLike) -> F64:
    """Directions (..., 3), those under the surface with normal n mirrored at it. Unit length, both."""
    d, n = np.asarray(dir, np.float64), np.asarray(n, np.float64)
    return d - 2 * np.minimum(np.einsum("...i,...i->...", d, n), 0.0)[..., None] * n
