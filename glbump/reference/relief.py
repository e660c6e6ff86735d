"""A surface's bumps in float64: what shaders/bump_input.glsl adds up."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from glbump.contents import Contents
from glbump.maps import pyramid
from glbump.maps.bump_formats import CODED, FOLDED_BYTES, XY, XYZ, BumpFormat, code_range
from glbump.maps.moments import moment_scale
from glbump.quality import Quality
from glbump.reference import bump as bumps
from glbump.reference import encodings, footprint, gradients, spread
from glbump.reference import filter as filters
from glbump.reference.cast import Hits
from glbump.reference.direction import axes_across
from glbump.reference.varied import Place, Varied, turned_change
from glbump.relief import HEIGHTS, LEVEL_WIDTH, SCREEN, Layer, flat_share, layers, terms
from glbump.scene import Bump, NormalMap, Surface
from glbump.shapes import Quad, Sphere, Torus

F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]
Index = npt.NDArray[np.intp]


class Facing(NamedTuple):
    """A share (K,) of the surface that a pixel sees, by its bent normals: n, unit length; around: n with the spread of
    those that are not seen one by one, in slopes; tapped: whether that is worth more than one look-up."""

    share: F64
    n: Varied
    around: Varied
    tapped: bool = False


class Relief:
    """The bumps of one surface."""

    def __init__(self, surface: Surface, quality: Quality, contents: Contents, samples: int) -> None:
        self.surface, self.how = surface, quality.bump_filter
        self.footprint, self.anisotropy = samples**-0.5 * LEVEL_WIDTH, quality.anisotropy
        self.layers = layers(surface, quality, contents)
        self.has_taps = quality.bump_spread == "lean"
        self.full = bool(self.layers) and terms(surface, self.layers, quality, contents).full
        self._maps = [self._levels(layer, contents) for layer in self.layers]
        self._spreads = [self._spread_levels(layer, quality, contents) for layer in self.layers]
        steep = [contents.steepest(layer.bump, layer.kernel) > 0 for layer in self.layers]
        self.has_spread = any(levels and bends for levels, bends in zip(self._spreads, steep))
        self._has_flats = flat_share(self.layers, quality, contents) > 0
        self._of_flats = [self._moments_of_flats(layer, contents) for layer in self.layers]

    def _levels(self, layer: Layer, contents: Contents) -> list[F64]:
        """(H, W, C), row 0 at v = 0, as the texture's filter sees them: what was stored, read back."""
        texels, most = layer.texels(contents, heights=True)[::-1], layer.most(contents)
        one = layer.filter(self.how) == "bilinear"
        levels = [texels] if one else pyramid.chain_by(layer.pyramid, texels, wraps=not layer.ends)
        return [before_filter(layer.stored, level, most) for level in levels]

    def _spread_levels(self, layer: Layer, quality: Quality, contents: Contents) -> list[F64]:
        """(h, w, 4) each: second moments of the map's slopes, of levels 1 and on, and the share of steep ones, row 0
        at v = 0; none where none are kept."""
        if quality.bump_spread == "none" or not layer.has_spread(self.how):
            return []
        kept = np.float32 if layer.stored.name == "float" else np.float16
        unit = (contents.steepest(layer.bump, layer.kernel) or 1.0) ** 2
        is_lean = quality.bump_spread == "lean"
        levels = [
            level[::-1].astype(kept).astype(np.float64)
            for level in layer.spread(contents, quality.bump_spread, apart=is_lean)
        ]
        if is_lean:
            return [level * (unit, unit, unit, 1) for level in levels]
        return [
            np.concatenate([level * unit, 0 * level, level * unit, np.ones_like(level)], axis=-1) for level in levels
        ]

    def _moments_of_flats(self, layer: Layer, contents: Contents) -> F64:
        """(3,) second moments of a layer's flat slopes, as slope_scale has them; 0 where these are not kept apart."""
        if not self._has_flats:
            return np.zeros(3)
        return contents.flats(layer.bump, layer.kernel).moments * moment_scale(layer.bump.slope_scale)

    def bent(
        self, hit: Hits, front: Index, p_object: Varied, normals: Varied, linear: F64, at: Place, *, whole: bool
    ) -> list[Facing]:
        """How the hits `front`, at points p_object with these unit normals, face. linear: (3, 3) from the object's
        frame; whole: in one part, also where flat places are kept apart."""
        n_env = normals.at
        uv = np.zeros((len(front), 2)) if hit.uv is None else hit.uv[front]
        p, n = p_object.at, hit.n[front]
        duv = self._changes(hit, front, p_object, uv, at)
        dpdu, dpdv = (np.zeros_like(p) if d is None else d[front] @ linear.T for d in (hit.dpdu, hit.dpdv))
        gradient = np.zeros_like(n_env)
        height, by_uv, on_screen = np.zeros(len(uv)), np.zeros_like(uv), np.zeros(len(uv))
        axes = axes_across(n_env)
        # Of all slopes that are not seen one by one, and of those of them that are flat.
        by_uv_moments, total = np.zeros((2, len(uv), 3)), np.zeros((2, len(uv), 3))
        flats = np.ones(len(uv))
        for layer, levels, spreads, of_flats in zip(self.layers, self._maps, self._spreads, self._of_flats):
            bump = layer.bump
            if layer.is_triplanar:
                # Of a height that is known where the object is: rows, by the inverse.
                inverse = np.linalg.inv(linear)
                object_axes = axes[0] @ inverse.T, axes[1] @ inverse.T
                along, above, moments, flat = self._triplanar(
                    layer, levels, spreads, of_flats, p_object, n, object_axes
                )
                gradient += bumps.volume_gradient(n_env, along @ inverse)
                total += moments
                flats *= flat
                on_screen += above if layer.kind == SCREEN else 0.0
                continue
            place, moved = uv * bump.map_repeat, (duv[0] * bump.map_repeat, duv[1] * bump.map_repeat)
            value, kept = self._averaged(layer, levels, spreads, place, moved)
            moments = _both(kept, of_flats)
            flats *= 1 - kept[:, 3]
            slope = value[:, :2] * bump.slope_scale
            if isinstance(bump, NormalMap):
                t, b = bumps.tangent_frame(n_env, dpdu, dpdv)
                gradient += slope[:, :1] * t + slope[:, 1:] * b
                total += spread.moments_across(*axes, t, b, moments)
            elif bump.scaling == "parameter":
                gradient += bumps.invariant_gradient(n_env, dpdu, dpdv, slope)
                along_u, along_v = (bumps.invariant_gradient(n_env, dpdu, dpdv, unit) for unit in np.eye(2))
                total += spread.moments_across(*axes, along_u, along_v, moments)
            elif layer.kind == SCREEN:
                on_screen += bump.amplitude * value[:, 2]
            else:
                by_uv += slope
                by_uv_moments += moments
                height += bump.amplitude * value[:, 2]
        if self.full and hit.dndu is not None and hit.dndv is not None:
            dndu, dndv = (turned_change(d[front], n, linear) for d in (hit.dndu, hit.dndv))
            gradient += bumps.full_gradient(n_env, dpdu, dpdv, dndu, dndv, height, by_uv)
            dpdu, dpdv = dpdu + height[:, None] * dndu, dpdv + height[:, None] * dndv
        else:
            gradient += bumps.surface_gradient(n_env, dpdu, dpdv, by_uv)
        by_u, by_v = (bumps.surface_gradient(n_env, dpdu, dpdv, unit) for unit in np.eye(2))
        total += spread.moments_across(*axes, by_u, by_v, by_uv_moments)
        if on_screen.any():
            both = zip(at.differences(p @ linear.T), at.differences(on_screen[:, None]), strict=True)
            (p_x, h_x), (p_y, h_y) = both
            gradient += bumps.surface_gradient(n_env, p_x, p_y, np.concatenate([h_x, h_y], axis=-1))
        if whole or not self._has_flats:
            return [self._facing(np.ones(len(uv)), normals, gradient, total[0], at)]
        return self._parted(flats, normals, gradient, total, at)

    def _parted(self, flats: F64, normals: Varied, gradient: F64, moments: F64, at: Place) -> list[Facing]:
        """A share (K,) of flat places, with the surface's own normals, and the others, whose gradients and moments
        follow from those of all, (K, 3) and (2, K, 3), with those of flat ones."""
        axes = axes_across(normals.at)
        mean = np.stack([np.einsum("ki,ki->k", gradient, axis) for axis in axes], axis=-1)
        steep, mean, theirs = spread.steep_part(1 - flats, mean, moments[0])
        gradient = mean[:, :1] * axes[0] + mean[:, 1:] * axes[1]
        return [
            Facing(1 - steep, normals, Varied(normals.at, *spread.spread_along(*axes, moments[1]))),
            self._facing(steep, normals, gradient, theirs, at),
        ]

    def _facing(self, share: F64, normals: Varied, gradient: F64, moments: F64, at: Place) -> Facing:
        """Normals bent by a gradient (K, 3), with its second moments (K, 3) across them."""
        bent, still = bumps.bump_normal(normals.at, gradient), np.zeros_like(gradient)
        changes = (
            footprint.bump_normal_change(normals.at, gradient, dn, dg)
            for dn, dg in zip(normals[1:], at.differences(gradient), strict=True)
        )
        around = spread.spread_along(*axes_across(normals.at), moments)
        spreads = (footprint.bump_normal_change(normals.at, gradient, still, s) for s in around)
        return Facing(share, Varied(bent, *changes), Varied(bent, *spreads), self.has_taps)

    def _changes(self, hit: Hits, front: Index, p: Varied, uv: F64, at: Place) -> tuple[F64, F64]:
        """Changes (K, 2) of u and v from pixel to pixel."""
        if not isinstance(self.surface.shape, Sphere | Torus | Quad):
            return at.differences(uv)
        assert hit.dpdu is not None
        assert hit.dpdv is not None
        by_uv = hit.dpdu[front], hit.dpdv[front]
        return footprint.uv_change(p.dx, *by_uv), footprint.uv_change(p.dy, *by_uv)

    def _triplanar(
        self,
        layer: Layer,
        levels: list[F64],
        spreads: list[F64],
        of_flats: F64,
        p: Varied,
        n: F64,
        axes: tuple[F64, F64],
    ) -> tuple[F64, F64, F64, F64]:
        """Gradients (K, 3) in the object's frame, heights (K), the gradients' second moments (2, K, 3) along two axes
        there, and the share of flat ones (K), of a map laid along the object's own, at points p, normals n (K, 3)."""
        bump = layer.bump
        assert isinstance(bump, Bump)
        gradient, height, total, flats = np.zeros_like(n), np.zeros(len(n)), np.zeros((2, *n.shape)), np.zeros(len(n))
        shares = bumps.triplanar_shares(n)
        for axis, (right, up) in enumerate(_PLANES):
            # Seen upright from outside, so from the other side the other way round.
            side = np.where(n[:, axis] < 0, -1.0, 1.0)[:, None]
            turned = np.where([axis != 1, axis == 1], side, 1.0)
            right_up = np.stack([turned[:, :1] * right, turned[:, 1:] * up], axis=1)
            place, *ddxy = (np.einsum("kij,kj->ki", right_up, v) * bump.map_repeat for v in p)
            value, kept = self._averaged(layer, levels, spreads, place, (ddxy[0], ddxy[1]))
            share, moments = shares[:, axis], _both(kept, of_flats)
            total += share[:, None] ** 2 * spread.moments_across(*axes, right_up[:, 0], right_up[:, 1], moments)
            flats += share * (1 - kept[:, 3])
            gradient += share[:, None] * np.einsum("kij,ki->kj", right_up, value[:, :2] * bump.slope_scale)
            height += share * bump.amplitude * value[:, 2]
        return gradient, height, total, flats

    def _averaged(
        self, layer: Layer, levels: list[F64], spreads: list[F64], place: F64, changes: tuple[F64, F64]
    ) -> tuple[F64, F64]:
        """(K, 3): slopes of the map, and heights, about places (K, 2) on it that change so from pixel to pixel, (K, 2)
        of normal maps; and (K, 4) of the slopes that this averages, as `_around` has it."""
        size = np.array(levels[0].shape[1::-1])
        ddx, ddy = (change * size * self.footprint for change in changes)
        if self.anisotropy == 1 or layer.filter(self.how) == "bilinear":
            level = filters.isotropic_level(ddx, ddy)
            return self._read(layer, levels, place, level), self._around(layer, spreads, place, level)
        major, minor = filters.footprint_axes(ddx, ddy)
        taps = filters.footprint_taps(major, minor, 1.0, self.anisotropy)[:, None]
        level = filters.isotropic_level(major / taps, minor)
        # Levels are narrower than footprints, taps lie all along them.
        step = major / (LEVEL_WIDTH * taps * size)
        numbers = np.arange(taps.max(initial=1))[:, None, None]
        places, counts = place + (numbers + 0.5 - 0.5 * taps) * step, numbers < taps
        values = np.array([self._read(layer, levels, at, level) for at in places])
        mean = (counts * values).sum(axis=0) / taps
        kept = np.array([self._around(layer, spreads, at, level) for at in places])
        u, v = np.moveaxis((values - mean)[..., :2] * layer.bump.slope_scale, -1, 0)
        kept += np.stack([u * u, u * v, v * v, 0 * u], axis=-1)
        return mean, (counts * kept).sum(axis=0) / taps

    def _read(self, layer: Layer, levels: list[F64], place: F64, level: F64) -> F64:
        """(K, 3): slopes of the map, and heights, at places (K, 2) on it and levels (K,); (K, 2) of normal maps."""
        if layer.kind == HEIGHTS:
            return _from_heights(levels[0][..., 0], place, layer.kernel)
        if layer.kind == SCREEN and layer.kernel == "bspline":
            return _heights_alone(gradients.height_bspline(levels[0][..., 0], place))
        value = filters.through_levels(
            lambda i, chosen: bilinear(levels[i], place[chosen], layer.ends), level, len(levels), layer.filter(self.how)
        )
        if layer.kind == SCREEN:
            return _heights_alone(value[:, 0])
        value = after_filter(layer.stored, value)
        if layer.ends:
            value[:, :2] *= (place >= 0) & (place <= 1)
        return value

    def _around(self, layer: Layer, spreads: list[F64], place: F64, level: F64) -> F64:
        """(K, 4): second moments of the slopes that `_read` averages, as slope_scale has them, and the share of those
        that are steep."""
        if not spreads:
            return np.tile(_LEVEL_0, (len(place), 1))
        kept = filters.through_levels(
            lambda i, chosen: bilinear(spreads[i], place[chosen], layer.ends),
            level - 1,
            len(spreads),
            layer.filter(self.how),
        )
        if layer.ends:
            inside = (place >= 0) & (place <= 1)
            both = inside.all(axis=-1)
            kept = _LEVEL_0 + (kept - _LEVEL_0) * np.stack([inside[:, 0], both, inside[:, 1], both], axis=-1)
        kept = _LEVEL_0 + (kept - _LEVEL_0) * np.clip(level, 0, 1)[:, None]
        return kept * (*moment_scale(layer.bump.slope_scale), 1)


_LEVEL_0 = np.array([0.0, 0.0, 0.0, 1.0])
"""What is kept where no slopes are averaged."""


def _both(kept: F64, of_flats: F64) -> F64:
    """(2, K, 3): second moments of all slopes, kept (K, 4), and of flat ones."""
    return np.stack([kept[:, :3], np.broadcast_to(of_flats, (len(kept), 3))])


_PLANES = (((0, 0, -1), (0, 1, 0)), ((1, 0, 0), (0, 0, -1)), ((1, 0, 0), (0, 1, 0)))
"""Where u and v of a map that is laid along x, y or z grow, on the side that faces along that axis."""


def _heights_alone(height: F64) -> F64:
    """(K, 3): no slopes, and heights."""
    return np.stack([np.zeros_like(height), np.zeros_like(height), height], axis=-1)


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
