"""A surface's bumps in float64: what shaders/bump_input.glsl adds up."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from glbump.contents import Contents
from glbump.maps import pyramid
from glbump.maps.bump_formats import CODED, FOLDED_BYTES, XY, XYZ, BumpFormat, code_range
from glbump.quality import Quality
from glbump.reference import bump as bumps
from glbump.reference import encodings, gradients
from glbump.reference import filter as filters
from glbump.reference.cast import Hits
from glbump.relief import HEIGHTS, Layer, layers, terms
from glbump.scene import NormalMap, Surface
from glbump.shapes import Sphere, Torus

F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]
Index = npt.NDArray[np.intp]


class Place:
    """Where in a grid of rays some of them are."""

    def __init__(self, ray: Index, shape: tuple[int, int]) -> None:
        self.ray, self.shape = ray, shape

    def differences(self, values: F64) -> tuple[F64, F64]:
        """dFdx and dFdy (K, C) of values (K, C) of these rays; 0 beside rays that are not among them."""
        grid = np.full((self.shape[0] * self.shape[1], values.shape[1]), np.nan)
        grid[self.ray] = values
        both = filters.quad_differences(grid.reshape(*self.shape, -1))
        ddx, ddy = (np.nan_to_num(d).reshape(len(grid), -1)[self.ray] for d in both)
        return ddx, ddy


class Relief:
    """The bumps of one surface."""

    def __init__(self, surface: Surface, quality: Quality, contents: Contents, samples: int) -> None:
        self.surface, self.how = surface, quality.bump_filter
        self.footprint = samples**-0.5
        self.layers = layers(surface, quality, contents)
        self.full = bool(self.layers) and terms(surface, quality, contents).full
        self._maps = [self._levels(layer, contents) for layer in self.layers]

    def _levels(self, layer: Layer, contents: Contents) -> list[F64]:
        """(H, W, C), row 0 at v = 0, as the texture's filter sees them: what was stored, read back."""
        texels, most = layer.texels(contents, heights=True)[::-1], layer.most(contents)
        levels = [texels] if layer.filter(self.how) == "bilinear" else pyramid.chain(texels)
        return [before_filter(layer.stored, level, most) for level in levels]

    def bent(self, hit: Hits, front: Index, n_env: F64, linear: F64, at: Place) -> F64:
        """Normals (K, 3) of the hits `front`, bent. n_env: unit normals; linear: (3, 3) from the object's frame."""
        assert hit.uv is not None
        assert hit.dpdu is not None
        assert hit.dpdv is not None
        uv = hit.uv[front]
        dpdu, dpdv = hit.dpdu[front] @ linear.T, hit.dpdv[front] @ linear.T
        gradient = np.zeros_like(n_env)
        height, by_uv = np.zeros(len(uv)), np.zeros_like(uv)
        for layer, levels in zip(self.layers, self._maps):
            bump = layer.bump
            value = self._read(layer, levels, uv, at)
            slope = value[:, :2] * bump.slope_scale
            if isinstance(bump, NormalMap):
                t, b = bumps.tangent_frame(n_env, dpdu, dpdv)
                gradient += slope[:, :1] * t + slope[:, 1:] * b
            elif bump.scaling == "parameter":
                gradient += bumps.invariant_gradient(n_env, dpdu, dpdv, slope)
            else:
                by_uv += slope
                height += bump.amplitude * value[:, 2]
        if self.full and hit.dndu is not None and hit.dndv is not None:
            dndu, dndv = (self._turned(d[front], hit.n[front], linear) for d in (hit.dndu, hit.dndv))
            gradient += bumps.full_gradient(n_env, dpdu, dpdv, dndu, dndv, height, by_uv)
        else:
            gradient += bumps.surface_gradient(n_env, dpdu, dpdv, by_uv)
        return bumps.bump_normal(n_env, gradient)

    @staticmethod
    def _turned(change: F64, n: F64, linear: F64) -> F64:
        """Changes (K, 3) of the unit normal in the frame that `linear` leads to, from those of the object's own."""
        inverse = np.linalg.inv(linear)
        normal, change = n @ inverse, change @ inverse
        square = np.einsum("ni,ni->n", normal, normal)[:, None]
        across = change - normal * np.einsum("ni,ni->n", normal, change)[:, None] / square
        result: F64 = across / np.sqrt(square)
        return result

    def _read(self, layer: Layer, levels: list[F64], uv: F64, at: Place) -> F64:
        """(K, 2 or 3): slopes of the map, and heights, at surface coordinates uv (K, 2)."""
        bump = layer.bump
        place = uv * bump.map_repeat
        if layer.kind == HEIGHTS:
            return _from_heights(levels[0][..., 0], place, layer.kernel)
        level, how = np.zeros(len(uv)), layer.filter(self.how)
        if how != "bilinear":
            size = np.array(levels[0].shape[1::-1]) * bump.map_repeat * self.footprint
            ddx, ddy = at.differences(uv)
            if isinstance(self.surface.shape, Sphere | Torus):
                ddx, ddy = filters.wrapped_difference(ddx), filters.wrapped_difference(ddy)
            level = filters.isotropic_level(ddx * size, ddy * size)
        value = filters.through_levels(
            lambda i, chosen: bilinear(levels[i], place[chosen], layer.ends), level, len(levels), how
        )
        value = after_filter(layer.stored, value)
        if layer.ends:
            value[:, :2] *= (place >= 0) & (place <= 1)
        return value


def before_filter(how: BumpFormat, texels: F32, most: Sequence[float]) -> F64:
    """(H, W, C) texels as they come out of a texture that stores them so: slopes and heights, or x, y of normals, or
    all of them, in shares of the last code."""
    read = how.as_read(how.stored(texels, most))
    if how.family == CODED:
        range_of = code_range(most)[: texels.shape[-1]]
        return encodings.signed_codes(read, how.middle) * range_of
    if how.is_filtered:
        return read
    place = encodings.codes_from_bytes(read) if how.family == FOLDED_BYTES else read
    return encodings.slope_from_normal(encodings.normal_from_octahedral(place, how.middle))


def after_filter(how: BumpFormat, value: F64) -> F64:
    """(K, C): slopes, of what the filter gave."""
    if how.family == XY:
        return encodings.slope_from_normal(encodings.normal_from_rg(value, how.middle))
    if how.family == XYZ:
        return encodings.slope_from_normal(encodings.normal_from_rgb(value, how.middle))
    return value


def _from_heights(heights: F64, place: F64, kernel: str) -> F64:
    """(K, 3): slopes and height of a map of heights, or of coefficients of their spline."""
    slope = getattr(gradients, f"slope_{kernel}")(heights, place)
    height = (gradients.height_bspline if kernel == "bspline" else gradients.height_at)(heights, place)
    return np.concatenate([slope, height[:, None]], axis=-1)


def bilinear(texels: F64, uv: F64, ends: bool = False) -> F64:
    """Bilinear look-up (..., C) of (H, W, C), row 0 at t = 0, repeating both ways, or ending at its edges."""
    height, width = texels.shape[:2]
    x, y = uv[..., 0] * width - 0.5, uv[..., 1] * height - 0.5
    left, low = np.floor(x), np.floor(y)
    a, b = (x - left)[..., None], (y - low)[..., None]

    def index(first: F64, i: int, count: int) -> Index:
        at = first.astype(np.intp) + i
        return np.clip(at, 0, count - 1) if ends else at % count

    columns = [index(left, i, width) for i in (0, 1)]
    rows = [index(low, i, height) for i in (0, 1)]
    near, far = (texels[row, columns[0]] * (1 - a) + texels[row, columns[1]] * a for row in rows)
    result: F64 = near * (1 - b) + far * b
    return result
