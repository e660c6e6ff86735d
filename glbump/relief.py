"""How a surface's bumps are read, and which of their terms matter: one answer for the plan and for the reference."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from glbump.contents import Contents
from glbump.errors import SceneError
from glbump.frozen import Frozen
from glbump.maps.bump_formats import BUMP_FORMATS, CODED, PLAIN, BumpFormat
from glbump.maps.encodings import ENCODINGS, HALF_DIM, HALF_MAX, slope_map
from glbump.maps.gradients import IN_SHADERS
from glbump.maps.moments import lean_levels, toksvig_levels
from glbump.quality import Quality
from glbump.scene import Bump, NormalMap, Surface
from glbump.shapes import MESHES, MeshData, MeshFile, Plane, Quad, Sphere, Torus

F32 = npt.NDArray[np.float32]

SLOPES, NORMALS, HEIGHTS, SCREEN = "slopes", "normals", "heights", "screen"


LEVEL_WIDTH = 3**-0.5
"""Width of a level's texel over a sample's. A level is averaged over its texel and over the tent between texels, whose
variances are 1/12 and 1/6 of its square; a sample over 1/12 of its own. Measured from near to far (benchmarks/afar.py):
4 to 15 % less error than texels as wide as samples, at four samples a pixel and at one."""


class Layer(Frozen):
    """One bump as it is read: from a map of slopes, of a normal map's slopes, or of heights, whose gradient is taken
    where they are seen, from texels or from pixel to pixel (SCREEN). why: of heights, the reason for the one or the
    other. stored: how textures keep the map. pyramid: who makes its levels, as in Quality."""

    bump: Bump | NormalMap
    kind: str
    kernel: str
    why: str
    stored: BumpFormat
    stored_why: str
    pyramid: str = "box"

    @property
    def ends(self) -> bool:
        """Whether the map ends at its edge, and does not repeat."""
        return isinstance(self.bump, Bump) and self.bump.border == "clamp"

    @property
    def is_triplanar(self) -> bool:
        """Whether the map lies along the object's axes, and needs no u and v."""
        return isinstance(self.bump, Bump) and self.bump.mapping == "triplanar"

    @property
    def is_raised(self) -> bool:
        """Whether it adds to a height by u and v, in lengths, whose full terms are known."""
        in_lengths = isinstance(self.bump, Bump) and self.bump.scaling == "world"
        return in_lengths and not self.is_triplanar and self.kind != SCREEN

    def filter(self, wanted: str) -> str:
        """How the map is read, where the quality wants "bilinear", "nearest-level" or "trilinear"."""
        of_level_0 = self.kind == HEIGHTS or (self.kind, self.kernel) == (SCREEN, "bspline")
        return wanted if self.stored.is_filtered and not of_level_0 else "bilinear"

    def has_spread(self, filter: str) -> bool:
        """Whether levels of it, where the quality wants `filter`, average slopes that no one sees then. Those of
        heights on the screen do too, but there are no slopes to be kept."""
        return self.kind in (SLOPES, NORMALS) and self.filter(filter) != "bilinear"

    def spread(self, contents: Contents, how: str, *, apart: bool) -> list[F32]:
        """What the levels from 1 on leave out, row 0 on top, in squares of the steepest slope: for "lean" second
        moments (h, w, 3), for "toksvig" one variance (h, w, 1). apart: whether with the share of steep slopes, after
        the moments."""
        slopes = contents.slopes(self.bump, self.kernel)
        unit = contents.steepest(self.bump, self.kernel) or 1.0
        if how == "lean":
            return lean_levels(slopes, unit, contents.flats(self.bump, self.kernel) if apart else None)
        return toksvig_levels(slopes, unit, are_lengths=isinstance(self.bump, NormalMap))

    def texels(self, contents: Contents, *, heights: bool) -> F32:
        """(H, W, C), row 0 on top: slopes of the map's own u, v, or of a normal map's lengths; with the heights where
        they are wanted; or heights alone, or the coefficients of their spline."""
        if isinstance(self.bump, NormalMap):
            return contents.slopes(self.bump)
        if self.kind in (HEIGHTS, SCREEN):
            field = contents.spline(self.bump) if self.kernel == "bspline" else contents.heights(self.bump)
            return field[..., None]
        slopes = contents.slopes(self.bump, self.kernel)
        return np.concatenate([slopes, contents.heights(self.bump)[..., None]], axis=-1) if heights else slopes

    def most(self, contents: Contents) -> tuple[float, ...]:
        """The largest slope of the map, twice, and the largest height, each of either sign."""
        steepest = contents.steepest(self.bump, self.kernel)
        return steepest, steepest, contents.highest(self.bump) if isinstance(self.bump, Bump) else 0.0


def layers(surface: Surface, quality: Quality, contents: Contents) -> tuple[Layer, ...]:
    """How each of a surface's bumps is read."""
    return tuple(_layer(surface, sized(bump, surface, contents), quality, contents) for bump in surface.bumps)


LEAST_FLATS = 0.05
"""Share of flat places that are worth a look-up of their own."""


def flat_share(layers: tuple[Layer, ...], quality: Quality, contents: Contents) -> float:
    """Share of places where all layers are flat, which mirror as the surface does: 0 where it is not kept, or less than
    LEAST_FLATS."""
    kept = quality.bump_spread == "lean" and all(layer.has_spread(quality.bump_filter) for layer in layers)
    share = math.prod(contents.flats(layer.bump, layer.kernel).share for layer in layers) if kept else 0.0
    return share if share >= LEAST_FLATS else 0.0


def sized(bump: Bump | NormalMap, surface: Surface, contents: Contents) -> Bump | NormalMap:
    """The bump as it repeats on a surface, where it has a pixel_size; SceneError where that is no number of repeats."""
    if isinstance(bump, NormalMap) or bump.pixel_size is None:
        return bump
    lengths = _lengths(surface, bump)
    height, width = contents.heights(bump).shape
    if bump.border == "mirror":
        height, width = height // 2, width // 2
    repeat = (lengths[0] / (width * bump.pixel_size), lengths[1] / (height * bump.pixel_size))
    return replace(bump, repeat=repeat, pixel_size=None)


def _lengths(surface: Surface, bump: Bump) -> tuple[float, float]:
    """World lengths of a unit of u and of v, or of the object's coordinates, where they are the same all over."""
    transform, linear = surface.transform, surface.transform.matrix()[:3, :3]
    if bump.mapping == "triplanar":
        if transform.uniform_scale is None:
            raise SceneError(
                f"bump.pixel_size needs a surface that is not stretched; got transform.scale {transform.scale}"
            )
        return transform.uniform_scale, transform.uniform_scale
    match surface.shape:
        case Plane(size=(x, z)):
            sides = np.diag([x, 0, z])[[0, 2]]
        case Quad(corners=corners) if _is_parallelogram(corners):
            sides = np.subtract([corners[1], corners[3]], corners[0])
        case shape:
            raise SceneError(
                "bump.pixel_size needs u and v of one length all over: a plane's, or a quad's with parallel sides; "
                f'this is a {shape.kind}: give bump.repeat, or bump.mapping "triplanar"'
            )
    u, v = np.linalg.norm(sides @ linear.T, axis=-1)
    return float(u), float(v)


def _is_parallelogram(corners: Sequence[Sequence[float]]) -> bool:
    a, b, c, d = np.array(corners, np.float64)
    return bool(np.abs(a + c - b - d).max() <= 1e-6 * np.abs(c - a).max())


def _layer(surface: Surface, bump: Bump | NormalMap, quality: Quality, contents: Contents) -> Layer:
    kind, kernel, why = _read(bump, quality)
    # Second moments are about means; what rings has others.
    pyramid = "box" if quality.pyramid == "kaiser" and quality.bump_spread != "none" else quality.pyramid
    stored = _stored(surface, bump, kind, kernel, quality.bump_format, contents)
    return Layer(bump, kind, kernel, why, *stored, pyramid)


def _read(bump: Bump | NormalMap, quality: Quality) -> tuple[str, str, str]:
    """Kind and kernel, and why so."""
    kernel = quality.bump_kernel
    if isinstance(bump, NormalMap):
        return NORMALS, kernel, "a normal map is slopes already"
    if kernel == "spectral" and bump.border == "clamp":
        return SLOPES, "central", "a map that ends has no spectrum"
    if quality.bump_read == "screen" and bump.scaling == "world":
        return SCREEN, kernel if kernel == "bspline" else "central", "gradients are taken from pixel to pixel"
    if quality.bump_read == "screen":
        return SLOPES, kernel, "from pixel to pixel there are lengths, and its amplitude is none"
    if quality.bump_read == "baked":
        return SLOPES, kernel, "slopes are made once"
    if kernel not in IN_SHADERS:
        return SLOPES, kernel, f"{kernel} gradients need the whole map"
    if bump.border == "clamp":
        return SLOPES, kernel, "beyond the edge of a map that ends there is nothing to take differences of"
    return HEIGHTS, kernel, "heights are read where they are seen"


def _stored(
    surface: Surface, bump: Bump | NormalMap, kind: str, kernel: str, name: str, contents: Contents
) -> tuple[BumpFormat, str]:
    """How a map is kept that is to be kept as `name`, and what that costs."""
    stored, why = BUMP_FORMATS[name], ""
    if kind in (HEIGHTS, SCREEN):
        return BUMP_FORMATS["float"], "differences of what has fewer bits would be mostly rounding"
    if kind == SLOPES and stored.is_normals:
        stored, why = BUMP_FORMATS["slopes16"], f"{name} holds normals, and heights have slopes by u and v; "
    steepest = contents.steepest(bump, kernel)
    largest = max(steepest, contents.highest(bump)) if isinstance(bump, Bump) else steepest
    if stored.name == "half" and (largest > HALF_MAX or 0.0 < steepest < HALF_DIM):
        stored, why = BUMP_FORMATS["float"], f"values up to {largest:.3g} are too near to an end of a half's range; "
    return stored, why + _cost(surface, bump, stored, steepest, contents)


def _cost(surface: Surface, bump: Bump | NormalMap, stored: BumpFormat, steepest: float, contents: Contents) -> str:
    """How many degrees a format costs normals of this map on this surface."""
    if isinstance(bump, NormalMap):
        tilt = steepest * abs(bump.scale)
    elif bump.scaling == "parameter":
        tilt = steepest * max(map(abs, bump.slope_scale))
    else:
        tilt = _slope(surface, bump, contents)
    if stored.family == PLAIN:
        # Each of both slopes is off by half a unit in the last place: all of it across, of a steep normal.
        off = math.degrees((2**-11 if stored.name == "half" else 2**-24) * math.sin(math.atan(math.sqrt(2) * tilt)))
        return f"normals are off by {off:.2g} degrees at most"
    if stored.family == CODED:
        encoding = slope_map(stored.bits, tilt)
        mean, worst = encoding.mean, encoding.worst
    else:
        encoding = ENCODINGS[stored.encoding]
        gentle = steepest * math.sqrt(2) <= 1
        mean, worst = (encoding.mean_45, encoding.worst_45) if gentle else (encoding.mean, encoding.worst)
        # Slopes times k turn a normal at most k times, or 1 / k times, as much.
        scale = abs(bump.scale) if isinstance(bump, NormalMap) else 1.0
        mean, worst = mean * max(scale, 1 / scale), worst * max(scale, 1 / scale)
    more = ""
    if not stored.is_filtered:
        more = "; level 0, whose texels are decoded before they are averaged"
    elif stored.bits == 8:
        more = "; three times that between texels where a driver's filter rounds to 8 bits, as llvmpipe's does"
    return f"normals are off by {mean:.2g} degrees on average, {worst:.2g} at most{more}"


def is_normal_mapped(layers: tuple[Layer, ...]) -> bool:
    """Whether a mesh's own tangents are the axes: of normal maps, and where heights need dp/du and dp/dv, of none."""
    return bool(layers) and all(layer.kind == NORMALS for layer in layers)


class Terms(Frozen):
    """Whether B (N/|N|)_u and _v are kept. error: degrees that normals are off by, at most, without."""

    full: bool
    error: float


def terms(surface: Surface, layers: tuple[Layer, ...], quality: Quality, contents: Contents) -> Terms:
    """Whether a surface's layers need the lecture's full form: where max |B| times the curvature times the slope is
    more than quality.direction_error. A normal map has no heights, and none of these terms."""
    heights = [layer.bump for layer in layers if layer.is_raised and isinstance(layer.bump, Bump)]
    curvature = _curvature(surface, contents) if heights else 0.0
    height = sum(abs(bump.amplitude) * contents.highest(bump) for bump in heights)
    # Of a normal tilted by t, the term turns sin(t) cos(t) B k: at most half of B k.
    slope = sum(_slope(surface, bump, contents) for bump in heights)
    error = math.degrees(height * curvature * min(slope, 0.5))
    if quality.bump_terms != "auto":
        return Terms(quality.bump_terms == "full" and curvature > 0.0, error)
    return Terms(error > quality.direction_error, error)


MOST_MIXING = 4.35
"""Most that the shares of two triplanar maps change where these differ by 1, per radian that the normal turns."""


def mixing(surface: Surface, layer: Layer, contents: Contents) -> float:
    """Degrees that normals of a triplanar layer are off by, at most, where its maps meet: that shares change there is
    left out, as it takes the surface's curvature."""
    assert isinstance(layer.bump, Bump)
    span = float(np.ptp(contents.heights(layer.bump))) * abs(layer.bump.amplitude)
    return math.degrees(math.atan(MOST_MIXING * span * _curvature(surface, contents)))


def scales(surface: Surface) -> tuple[float, float]:
    """The least and the largest that the surface's place in the world stretches it."""
    scale = np.abs(np.asarray(surface.transform.scale))
    return float(scale.min()), float(scale.max())


def _curvature(surface: Surface, contents: Contents) -> float:
    """The largest curvature in the world, per world unit."""
    least, most = scales(surface)
    match surface.shape:
        case Sphere(radius=radius):
            own = 1 / radius
        case Torus(radius=radius, tube=tube):
            own = max(1 / tube, 1 / (radius - tube))
        case MeshFile() | MeshData():
            own = contents.curvature(surface.shape)
        case _:
            own = 0.0
    return own * most / least**2


def _slope(surface: Surface, bump: Bump, contents: Contents) -> float:
    """The steepest that a bump is about the middle of its surface."""
    least, _ = scales(surface)
    if bump.mapping == "triplanar":
        return contents.steepest(bump) * max(map(abs, bump.slope_scale)) / least
    match surface.shape:
        case Sphere(radius=radius):
            lengths = 2 * math.pi * radius, math.pi * radius
        case Torus(radius=radius, tube=tube):
            lengths = 2 * math.pi * (radius - tube), 2 * math.pi * tube
        case shape:
            # The shortest of flat shapes; of meshes, whose triangles may be anything, those in the middle.
            taken = np.median if isinstance(shape, MESHES) else np.min
            lengths = contents.mesh(shape).lengths(taken)
    steepest = contents.steepest(bump)
    return max(steepest * abs(scale) / (length * least) for scale, length in zip(bump.slope_scale, lengths))
