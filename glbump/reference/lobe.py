"""The light of a glossy lobe, facet by facet: what surface.frag's lobe_light computes; float64."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from glbump.frozen import Frozen
from glbump.maps.dfg import table
from glbump.reference import ggx, reflect
from glbump.reference.direction import axes_across

F64 = npt.NDArray[np.float64]

SMOOTHEST = 1e-6
"""Least alpha: a lobe 2e-6 radians wide is a mirror's, and its sums stay 32-bit floats."""

Light = Callable[[F64, F64], F64]
"""Radiance (K, 3) of directions (K, 3), each averaged over a solid angle (K,)."""


def lobe_factors(n_dot_v: npt.ArrayLike, roughness: npt.ArrayLike, dfg: str) -> F64:
    """(..., 2) split-sum factors, as Quality.dfg says."""
    if dfg == "fit":
        return ggx.dfg_fit(n_dot_v, roughness)
    texels = table().astype(np.float64)
    at = ggx.dfg_place(n_dot_v, roughness, float(len(texels))) * len(texels) - 0.5
    first = np.clip(np.floor(at).astype(np.intp), 0, len(texels) - 2)
    x, y = np.moveaxis(at - first, -1, 0)[..., None]
    i, j = np.moveaxis(first, -1, 0)
    near, far = (texels[j + k, i] * (1 - x) + texels[j + k, i + 1] * x for k in (0, 1))
    result: F64 = near * (1 - y) + far * y
    return result


class Facets(Frozen):
    """Directions (K, 3) towards the eye and normals, unit length; roughness (K,) or one; and the facets to be summed:
    `count` of them, those of sample `number` of the pixel's `samples`, which together make one finer set."""

    v: F64
    n: F64
    roughness: npt.ArrayLike
    count: int
    number: int = 0
    samples: int = 1

    def light(self, look: Light, mirror: F64, f0: npt.ArrayLike) -> F64:
        """Radiance (K, 3) that the surface mirrors, over the share that it mirrors: its mean over the lobe, Fresnel's
        reflectance (Schlick, f0) and Smith's shadows as weights. mirror: (K, 3) where a smooth surface would look, for
        rows all of whose facets mirror below the horizon."""

        def facet(h: F64, h_tan: F64, v_tan: F64, angle: F64) -> tuple[F64, F64, F64]:
            v_dot_h = np.einsum("ki,ki->k", v_tan, h_tan)
            n_dot_l = 2 * v_dot_h * h_tan[:, 2] - v_tan[:, 2]
            lit = ggx.unshadowed(v_tan[:, 2], n_dot_l, self._alpha)
            weight = lit[:, None] * reflect.fresnel_schlick(f0, v_dot_h)
            return reflect.reflect_dir(-self.v, h), weight, 4 * v_dot_h * angle

        return self._mean(look, mirror, facet)

    def light_through(self, look: Light, ahead: F64, eta: F64) -> F64:
        """The same of what is seen through it: Fresnel's transmittance and the far side's shadows as weights (Walter et
        al. 2007); eta (K,) as refract_dir has it, ahead (K, 3) where a smooth surface would look."""

        def facet(h: F64, h_tan: F64, v_tan: F64, angle: F64) -> tuple[F64, F64, F64]:
            v_dot_h = np.einsum("ki,ki->k", v_tan, h_tan)
            bent = reflect.refract_dir(-self.v, h, eta)
            t_dot_h = -np.einsum("ki,ki->k", bent, h)
            lit = ggx.unshadowed(1.0, -np.einsum("ki,ki->k", bent, self.n), self._alpha)
            weight = lit * (1 - reflect.fresnel_dielectric(v_dot_h, eta))
            spread = (eta * v_dot_h - t_dot_h) ** 2 / np.maximum(np.abs(t_dot_h), 1e-3)
            return bent, np.repeat(weight[:, None], 3, axis=1), spread * angle

        return self._mean(look, ahead, facet)

    @property
    def _alpha(self) -> F64:
        return np.maximum(np.square(np.asarray(self.roughness, np.float64)), SMOOTHEST)

    def _mean(self, look: Light, instead: F64, facet: Callable[[F64, F64, F64, F64], tuple[F64, F64, F64]]) -> F64:
        n_dot_v = np.clip(np.einsum("ki,ki->k", self.n, self.v), 1e-4, 1)
        x, y = axes_across(self.n)
        along = self.v - n_dot_v[:, None] * self.n
        length = np.linalg.norm(along, axis=-1, keepdims=True)
        aside = length > 1e-4
        x = np.where(aside, along / np.where(aside, length, 1), x)
        y = np.where(aside, np.cross(self.n, x), y)
        v_tan = np.stack([np.sqrt(1 - n_dot_v**2), np.zeros_like(n_dot_v), n_dot_v], axis=-1)
        total, weights = np.zeros_like(self.n), np.zeros_like(self.n)
        total_count = self.count * self.samples
        for i in range(self.count):
            place = ggx.lobe_place(i * self.samples + self.number, total_count)
            h_tan = ggx.visible_normal(v_tan, self._alpha, place)
            angle = ggx.normal_angle(h_tan, v_tan, self._alpha, total_count)
            h = h_tan[:, :1] * x + h_tan[:, 1:2] * y + h_tan[:, 2:] * self.n
            dirs, weight, angle = facet(h, h_tan, v_tan, angle)
            total += weight * look(dirs, np.minimum(angle, 4.0))
            weights += weight
        none = weights.max(axis=-1) <= 0
        mean = total / np.where(weights > 0, weights, 1)
        if none.any():
            mean[none] = look(instead, np.zeros(len(instead)))[none]
        return mean
