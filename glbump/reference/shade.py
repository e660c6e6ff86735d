"""Whole pictures in float64: rays cast, surfaces shaded as surface.frag does, as many samples as wanted."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt

from glbump import validate as check
from glbump.camera import (
    Camera,
    near_far,
    pixel_rays,
    pixel_steps,
    projection_matrix,
    sample_number,
    sample_offsets,
    view_matrix,
)
from glbump.captures import captured
from glbump.contents import Contents
from glbump.environment import Environment
from glbump.errors import SceneError
from glbump.frame import Frame
from glbump.maps import cube
from glbump.mesh import Mesh
from glbump.quality import Quality, quality_of
from glbump.reference import ggx, reflect
from glbump.reference import spread as spreads
from glbump.reference.capture import with_captures
from glbump.reference.cast import Grid, Hits, cast
from glbump.reference.environment import sh9_irradiance
from glbump.reference.lobe import Facets, lobe_factors
from glbump.reference.relief import Facing, Relief
from glbump.reference.sun import sun_reflected
from glbump.reference.suns import suns_apart
from glbump.reference.surroundings import Surroundings
from glbump.reference.varied import (
    Place,
    Rays,
    Varied,
    kept_above,
    kept_facing,
    normal_met,
    point_met,
    reflection,
    refraction,
)
from glbump.relief import is_normal_mapped
from glbump.scene import Material, Scene, Surface, check_size

F64 = npt.NDArray[np.float64]
Index = npt.NDArray[np.intp]
F32 = npt.NDArray[np.float32]
Region = tuple[int, int, int, int]

BACKGROUND, SEVERAL, UNSEEN = -1, -2, -3
PIECES = 1 << 32

SHOWN = ("normal", "uv", "reflection")
"""What can be shown in place of light."""

MOST_SAMPLES = 1 << 20
"""A pixel; a picture of 256 x 256 takes days by then."""

_RAYS = 1 << 18
"""Rays cast at once; bounds the memory."""


def render(
    scene: Scene,
    size: tuple[int, int] = (256, 256),
    samples: int = 64,
    *,
    quality: str | Quality = "exact",
    contents: Contents | None = None,
    region: Region | None = None,
    show: str | None = None,
) -> Frame:
    """The picture that `glbump.render` at "exact" converges to: float64, ray-cast, no OpenGL.

    samples: a pixel, a square number, on a regular grid; their mean is the pixel (linear light, box filter).
    quality: its filters say how maps are read, "exact" bilinearly at level 0, and its gloss_size and gloss_samples
    which roughness chain, its bump_format and texture_format what is read back of bumps and of environments; what
    surfaces capture is drawn with its samples. Other storage (frames, resampled cubes) is not modelled. contents: maps
    already read. region: the part of the picture to make, (left, top, width, height); its corners lie between the
    picture's quads of 2x2 pixels.
    show: one of SHOWN, in place of light: raw values (glbump.shown) of one sample in the middle of each pixel.
    Errors as glbump.render.
    Returns a Frame of float32 pixels; its stats["surface"] (H, W) says what all samples of a pixel see: PIECES times
    the surface plus the piece of it (a cube has six), BACKGROUND, or SEVERAL of these; its stats["halves"]
    (2, H, W, 4) are the pictures of every other sample, as on a chessboard, and of the rest: half of their difference
    is about what the picture lacks for want of samples. Of one sample there are none.
    """
    return render_regions(scene, size, [region], samples, quality=quality, contents=contents, show=show)[0]


def render_regions(
    scene: Scene,
    size: tuple[int, int],
    regions: Sequence[Region | None],
    samples: int = 64,
    *,
    quality: str | Quality = "exact",
    contents: Contents | None = None,
    show: str | None = None,
) -> list[Frame]:
    """`render` of several regions of one picture, None for all of it; maps are made ready once."""
    started = time.perf_counter()
    size = check_size(size)
    check.instance("scene", scene, Scene)
    samples = check.integer("samples", samples, least=1, most=MOST_SAMPLES)
    contents, quality = contents or Contents(), quality_of(quality)
    if show is not None:
        check.choice("show", show, SHOWN)
    checked = [_checked_region(region, size) for region in regions]
    given = set(scene.environments)
    if captured(scene):
        draw = partial(render, samples=quality.samples, quality=quality, contents=contents)
        scene = with_captures(scene, draw)
    for environment in scene.environments:
        contents.brightest(environment)
    shader = _Shader(scene, quality, contents, samples, frozenset(scene.environments) - given)
    shader.show, samples = show, 1 if show is not None else samples
    return [_drawn(shader, size, region, samples, started) for region in checked]


def _drawn(shader: _Shader, size: tuple[int, int], region: Region, samples: int, started: float) -> Frame:
    """One region of the picture. started: when that was."""
    scene = shader.scene
    left, top, across, down = region
    steps = pixel_steps(scene.camera, size)
    halves = np.zeros((2, down, across, 4))
    counts = [0, 0]
    seen = np.full((down, across), UNSEEN)
    # Bands end where quads of 2x2 pixels, counted from the lowest row, end.
    rows = max(2, _RAYS // across // 2 * 2)
    edges = [0, *range(down % 2 + rows, down, rows), down]
    for number, offset in enumerate(sample_offsets(samples)):
        shader.number = sample_number(float(offset[0]), float(offset[1]), samples)
        half = sum(divmod(number, math.isqrt(samples))) % 2
        counts[half] += 1
        for first, last in pairwise(edges):
            band, corner = slice(first, last), offset + (left, top + first)
            origins, dirs = pixel_rays(scene.camera, size, corner, (across, last - first))
            places = [places_of(scene, i, mesh, size, corner) for i, mesh in enumerate(shader.meshes)]
            light, index = shader.shade(origins, dirs, places, steps)
            halves[half, band] += light
            seen[band] = np.where((seen[band] == UNSEEN) | (seen[band] == index), index, SEVERAL)
    pixels = _straight(halves.sum(axis=0) / samples)
    stats = {
        "backend": "reference",
        "renderer": "NumPy float64",
        "samples": samples,
        "notes": shader.contents.notes(scene),
        "surface": seen,
        "halves": _straight(halves / np.reshape(counts, (2, 1, 1, 1)) if samples > 1 else halves[:0]),
        "ms": {"all": 1e3 * (time.perf_counter() - started)},
    }
    return Frame(pixels, stats, show=shader.show)


def _checked_region(region: Region | None, size: tuple[int, int]) -> Region:
    if region is None:
        return (0, 0, *size)
    left, top, width, height = region
    inside = min(left, top) >= 0 and min(width, height) > 0 and left + width <= size[0] and top + height <= size[1]
    below = size[1] - top - height
    # A column or a row that ends the picture is half a quad.
    between = left % 2 == 0 and (width % 2 == 0 or left + width == size[0]) and below % 2 == 0
    if inside and between and (height % 2 == 0 or top == 0):
        return region
    raise SceneError(
        f"region must be (left, top, width, height) within {size[0]}x{size[1]}, whole quads of 2x2 pixels counted from "
        f"the lower left corner; got {tuple(region)}"
    )


def _straight(light: F64) -> F32:
    """Colour of alpha times colour (..., 4), 0 where there is none; alpha as it is."""
    alpha = light[..., 3:]
    colour = np.divide(light[..., :3], alpha, out=np.zeros_like(light[..., :3]), where=alpha > 0)
    return np.concatenate([colour, alpha], axis=-1).astype(np.float32)


def places_of(scene: Scene, index: int, mesh: Mesh, size: tuple[int, int], offset: F64) -> F64:
    """(V, 3): a mesh's vertices on a grid of rays whose first goes through `offset` (x, y) of the picture, as Grid has
    them."""
    camera: Camera = scene.camera
    projection = projection_matrix(camera, size, *near_far(camera, np.zeros((0, 2, 3))))
    to_clip = projection @ view_matrix(camera) @ scene.surfaces[index].transform.matrix()
    clip = mesh.positions @ to_clip[:, :3].T + to_clip[:, 3]
    w = clip[:, 3:]
    pixels = 0.5 * (clip[:, :2] * (1, -1) + w) * size - w * offset
    result: F64 = np.concatenate([pixels, w], axis=1)
    return result


def _above(surface: Surface, look: Varied, n: Varied, around: Varied | None) -> tuple[Varied, Varied | None]:
    """Directions that bent normals may send under the surface, those mirrored at it; and so with their spread, that of
    `around`, where they have one."""
    if around is None:
        return (kept_above(look, n) if surface.bumps else look), None
    folded = Varied(*spreads.folded(around.at, n.at, around.dx, around.dy))
    return look._replace(at=folded.at), folded


def _f0(material: Material) -> F64:
    """(3,) what a facet mirrors face on."""
    dielectric = np.full(3, reflect.f0_from_ior(material.ior))
    return (1 - material.metallic) * dielectric + material.metallic * np.array(material.base_color)


def _shares(material: Material, n_dot_v: F64, eta: F64, factors: F64 | None) -> tuple[F64, F64]:
    """(K, 3) each: what a surface mirrors, and what of the rest a dielectric scatters or lets through. eta: (K,) as
    `_Shader._light` has it; factors: (K, 2) of split sums, None of a mirror."""

    def share(f0: F64) -> F64:
        return reflect.fresnel_schlick(f0, n_dot_v) if factors is None else ggx.glossy_share(f0, factors)

    metallic = material.metallic
    metal = metallic * share(np.array(material.base_color))
    mirrored = share(np.full(3, reflect.f0_from_ior(material.ior)))
    specular, kept = (1 - metallic) * mirrored + metal, 1 - mirrored
    if not material.is_transmissive:
        return specular, kept
    reflected = reflect.fresnel_dielectric(n_dot_v, eta)[:, None]
    if factors is None:
        return (1 - metallic) * reflected + metal, 1 - reflected
    # From the critical angle on all is reflected, which a fit of smooth curves does not know.
    every = np.where(reflected >= 1, 1 - metallic, 0.0)
    return specular + every * (1 - specular), kept * (1 - every)


class _Shader:
    """One scene's maps, and the light along rays. number: of the pixel's samples that they are."""

    number: int = 0
    show: str | None = None

    def __init__(
        self, scene: Scene, quality: Quality, contents: Contents, samples: int, drawn: frozenset[Environment]
    ) -> None:
        """drawn: the environments that are pictures of the scene."""
        self.scene, self.quality, self.contents = scene, quality, contents
        self.footprint = samples**-0.5
        self.samples = samples
        # Round shapes are cast by formula; their mesh is never looked at.
        self.reliefs = [Relief(surface, quality, contents, samples) for surface in scene.surfaces]
        self.meshes = [
            contents.mesh(surface.shape, normal_map=is_normal_mapped(relief.layers))
            for surface, relief in zip(scene.surfaces, self.reliefs)
        ]
        self.surroundings = {e: Surroundings(e, quality, contents, samples) for e in scene.environments}
        self.suns = {e: suns_apart(scene, e, quality, contents, drawn=e in drawn)[0] for e in scene.environments}

    def shade(self, origins: F64, dirs: F64, places: list[F64], steps: F64) -> tuple[F64, Index]:
        """(H, W, 4) colour times coverage, and coverage, of a band of rays (H, W, 3); (H, W) surface seen. steps: the
        camera's pixel_steps."""
        height, width = dirs.shape[:2]
        origins, dirs = origins.reshape(-1, 3), dirs.reshape(-1, 3)
        out = np.zeros((len(dirs), 4))
        nearest = np.full(len(dirs), np.inf)
        seen = np.full(len(dirs), BACKGROUND)
        hits: list[Hits] = []
        for surface, mesh, place in zip(self.scene.surfaces, self.meshes, places):
            to_object = np.linalg.inv(surface.transform.matrix())
            o = origins @ to_object[:3, :3].T + to_object[:3, 3]
            hit = cast(surface.shape, mesh, Grid(place, width, height), o, dirs @ to_object[:3, :3].T)
            hits.append(hit)
            nearest[hit.ray] = np.minimum(nearest[hit.ray], hit.t)
        for index, hit in enumerate(hits):
            front = np.flatnonzero(hit.t <= nearest[hit.ray])
            if not front.size:
                continue
            at = Place(hit.ray[front], (height, width))
            rays = Rays(dirs[at.ray], hit.t[front], steps)
            out[at.ray, :3] = self._surface(index, hit, front, origins[at.ray], rays, at)
            out[at.ray, 3] = float(self.show != "uv" or hit.uv is not None)
            seen[at.ray] = PIECES * index + hit.piece[front]
        empty = np.isinf(nearest)
        if self.scene.environment.background and empty.any():
            # Shown in front of surfaces too, as far as quads go: a pixel's neighbours look past them.
            at = Place(np.arange(len(dirs)), (height, width))
            behind = self.surroundings[self.scene.environment]
            look = at.varied(dirs @ behind.env_from_world.T)
            if self.scene.camera.projection == "perspective":
                # An orthographic eye is as far off as its background.
                look = behind.seen_from(at.varied(origins), look)
            if self.show == "reflection":
                out[empty, :3] = dirs[empty]
            elif self.show is None:
                out[empty, :3] = behind.light(look)[empty]
            out[empty, 3] = float(self.show in (None, "reflection"))
        return out.reshape(height, width, 4), seen.reshape(height, width)

    def _surface(self, index: int, hit: Hits, front: Index, origins: F64, rays: Rays, at: Place) -> F64:
        """Light (K, 3) from the hits `front` of surface `index` along rays."""
        surface = self.scene.surfaces[index]
        env_from_world = self.scene.environment_of(surface).env_from_world()
        world_from_object = surface.transform.matrix()[:3, :3]
        linear = env_from_world @ world_from_object
        normal = hit.n[front] @ np.linalg.inv(linear)
        n_env = normal / np.linalg.norm(normal, axis=-1, keepdims=True)
        look = rays.directions(env_from_world)
        p_object = point_met(surface.shape, hit, front, rays, world_from_object, at)
        p_world = Varied(origins + rays.t[:, None] * rays.dirs, *(dp @ world_from_object.T for dp in p_object[1:]))
        behind = np.einsum("ni,ni->n", n_env, look.at) > 0
        side = np.where(behind[:, None], -1.0, 1.0)
        n = normal_met(surface.shape, hit.n[front], p_object, n_env, linear, at)
        geometry = n.times(side)
        if self.show == "uv":
            uv = np.zeros((len(front), 2)) if hit.uv is None else hit.uv[front]
            return np.pad(uv, ((0, 0), (0, 1)))
        relief, facings = self.reliefs[index], [Facing(np.ones(len(front)), n, n)]
        has_levels = self.surroundings[self.scene.environment_of(surface)].has_footprint
        seen_apart = not relief.has_spread or (surface.material.roughness == 0 and not has_levels)
        if relief.layers:
            if hit.uv is None and not all(layer.is_triplanar for layer in relief.layers):
                raise SceneError(f"surface {index}: bumps need texture coordinates, and this mesh has none")
            facings = relief.bent(hit, front, p_object, n, linear, at, whole=self.show is not None or seen_apart)
        eta = np.where(behind, surface.material.ior, 1 / surface.material.ior)
        result = np.zeros_like(n_env)
        for share, n, around, tapped in facings:
            n = n.times(side)
            if relief.layers:
                n = kept_facing(n, look)
            if self.show == "normal":
                return n.at @ env_from_world
            spread = None if seen_apart else around._replace(at=n.at)
            result += share[:, None] * self._light(surface, p_world, look, n, geometry, eta, spread, tapped=tapped)
        return result

    def _irradiance_over_pi(self, environment: Environment, n_env: F64) -> F64:
        """Of normals (K, 3), before exposure: the truth in the place of a map."""
        suns, contents = self.suns[environment], self.contents
        if self.quality.diffuse == "sh9":
            result = sh9_irradiance(n_env, contents.irradiance(environment, apart=bool(suns)))
        else:
            result = contents.quadrature(environment, apart=bool(suns))(n_env)
        for sun in suns:
            result = result + np.maximum(n_env @ sun.direction, 0)[:, None] * np.array(sun.irradiance) / np.pi
        return result

    def _blurred(self, environment: Environment, dirs: F64, roughness: Any) -> F64:
        """Light (K, 3) of the roughness chain."""
        around, quality = self.surroundings[environment], self.quality
        apart = bool(self.suns[environment])
        levels = self.contents.gloss(environment, quality.gloss_size, quality.gloss_samples, apart=apart)
        chain = [around.stored.as_read(level) for level in levels]
        return around.exposure * cube.sample_levels(chain, dirs, roughness * (len(chain) - 1))

    def _light(
        self,
        surface: Surface,
        p_world: Varied,
        dir: Varied,
        n: Varied,
        geometry: Varied,
        eta: F64,
        spread: Varied | None,
        *,
        tapped: bool,
    ) -> F64:
        """What surface.frag's light() computes, for any material. eta: (K,) index of refraction on the eye's side over
        that on the other; spread: normals with theirs, in slopes, None where no bumps are averaged; tapped: whether
        that is worth more than one look-up."""
        material, environment = surface.material, self.scene.environment_of(surface)
        around = self.surroundings[environment]
        dir_env, n_env = dir.at, n.at
        still = Varied(dir_env, *[np.zeros_like(dir_env)] * 2)
        roughness: Any = material.roughness
        is_glossy, around_normal = roughness > 0, None
        if spread is not None and is_glossy:
            roughness = spreads.spread_roughness(roughness, spread.dx, spread.dy)
        elif spread is not None:
            around_normal = spread.times(spreads.unit_share(spread.dx, spread.dy)[:, None])._replace(at=n_env)
        look, look_spread = n, around_normal
        if environment.lookup == "reflection":
            look = reflection(dir, n)
            look, look_spread = _above(surface, look, geometry, around_normal and reflection(still, around_normal))
        if self.show == "reflection":
            return look.at @ around.env_from_world
        n_dot_v = -np.einsum("ni,ni->n", dir_env, n_env)
        factors = lobe_factors(n_dot_v, roughness, self.quality.dfg) if is_glossy else None
        specular, kept = _shares(material, n_dot_v, eta, factors)

        def looked_at(look: Varied, spread: Varied | None) -> F64:
            if is_glossy:
                return self._blurred(environment, around.seen_at(p_world.at, look.at), roughness)
            return around.light(around.seen_from(p_world, look), spread, tapped=tapped)

        if is_glossy and self.quality.gloss == "sampled":

            def averaged(dirs: F64, angle: F64, side: F64) -> F64:
                return around.averaged(
                    around.seen_at(p_world.at, reflect.above_surface(dirs, side) if surface.bumps else dirs), angle
                )

            facets = Facets(-dir_env, n_env, roughness, self.quality.lobe_samples, self.number, self.samples)
            seen = replace(facets, v=n_env) if environment.lookup == "normal" else facets
            result = specular * seen.light(lambda d, angle: averaged(d, angle, geometry.at), look.at, _f0(material))
        elif factors is not None:
            look = look._replace(at=ggx.lobe_dir(n_env, look.at, roughness))
            result = specular * looked_at(look, None)
            f0 = _f0(material)
            scattered = specular / np.maximum(f0 * factors[:, :1] + factors[:, 1:], 1e-6)
            for sun in self.suns[environment]:
                lobe = sun_reflected(n_env, -dir_env, np.array(sun.direction), sun.radius, roughness, f0)
                result = result + around.exposure * scattered * lobe * np.array(sun.irradiance)
        else:
            result = specular * looked_at(look, look_spread)
        below = kept * (1 - material.metallic) * np.array(material.base_color)
        if material.is_diffuse:
            irradiance = around.exposure * self._irradiance_over_pi(environment, n_env)
            result = result + below * (1 - material.transmission) * irradiance
        if material.is_transmissive:
            bent_around = around_normal and refraction(still, around_normal, eta)
            bent, bent_spread = _above(surface, refraction(dir, n, eta), geometry.times(-1.0), bent_around)
            if is_glossy and self.quality.gloss == "sampled":
                through = facets.light_through(lambda d, angle: averaged(d, angle, -geometry.at), bent.at, eta)
            else:
                through = looked_at(bent, bent_spread)
            result = result + below * material.transmission * through
        return result
