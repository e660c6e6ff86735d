"""Scene + quality + driver -> Plan: the only place that decides what is compiled, uploaded and computed."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from glbump import validate as check
from glbump.camera import near_far
from glbump.contents import Contents
from glbump.errors import LimitError, SceneError
from glbump.maps.panorama import Panorama
from glbump.mesh import bounds, segments_for
from glbump.quality import Quality
from glbump.reference.computed import is_averaged
from glbump.scene import Bump, Chrome, Fractal, Procedural, Scene, Sky, Surface
from glbump.shapes import Cube, MeshFile, Plane, Quad, Sphere, Torus

HALF_MAX = 65504.0
HALF_DIM = 2.0**-8
"""Least peak of what is kept in halves: they end in steps of 2**-24, so 1/256 of it still has 8 bits."""
HALF_SUM = 4
"""Most samples that are added up in halves: each addition costs up to 2**-11, and 4096 lose half of the light."""
FAR_OVER_NEAR = 1e3
"""Largest far / near for which depth is kept as OpenGL has it: far off, its 24 bits tell two surfaces apart by
far / near * 2**-24 of their distance. A logarithm tells them apart by log(far / near) * 2**-23 at any distance."""
STEEPEST = 1e12
"""Most that bumps may rise per unit of u or v, in sizes of their surface: past it, gradients leave 32-bit floats."""
Note = Callable[[str, object, str], None]

MESH, SPHERE, TORUS, QUAD = range(4)
NO_BUMP, HEIGHT, NORMAL = range(3)
LATLONG, CUBE, SKY, CHROME, FRACTAL = range(5)
COMPUTED = {Sky: SKY, Chrome: CHROME, Fractal: FRACTAL}
LOOKUPS = {"reflection": 0, "normal": 1}
NONE, ORTHOGONAL, GENERAL = range(3)
BY_POINT, BY_PIXEL = range(2)
WHITE_MIRROR, TINTED_MIRROR, SMOOTH, GLOSSY = range(4)


@dataclass(frozen=True)
class Capabilities:
    """What the driver can do, as far as a plan depends on it."""

    max_texture_size: int = 16384
    max_cube_size: int = 16384
    is_software: bool = False


@dataclass(frozen=True)
class Choice:
    """One decision: what, how, why."""

    what: str
    value: str
    why: str


@dataclass(frozen=True)
class SurfacePlan:
    """How one surface is drawn. defines: what its program is compiled with. segments: of its mesh."""

    defines: tuple[tuple[str, int], ...]
    segments: int
    cull: bool

    def has(self, name: str) -> int:
        """The value of a define."""
        return dict(self.defines)[name]


@dataclass(frozen=True)
class Plan:
    """What a frame is made of; everything that is not here is neither compiled, uploaded nor computed."""

    size: tuple[int, int]
    samples: int
    environment_defines: tuple[tuple[str, int], ...]
    cube_size: int | None
    environment_filter: str
    bump_filter: str
    texture_format: str
    slopes_format: str
    frame_format: str
    sky: bool
    gloss: tuple[int, int] | None
    irradiance: bool
    near_far: tuple[float, float]
    log_depth: bool
    surfaces: tuple[SurfacePlan, ...]
    choices: tuple[Choice, ...]

    def explain(self) -> str:
        """Each choice and its reason, one a line."""
        width = max(len(c.what) for c in self.choices)
        return "\n".join(f"{c.what:<{width}}  {c.value}: {c.why}" for c in self.choices)


def make_plan(
    scene: Scene,
    quality: Quality,
    size: tuple[int, int],
    contents: Contents,
    capabilities: Capabilities | None = None,
) -> Plan:
    """The plan of one frame of `size` (width, height). Raises SceneError, ImageError, MeshError, LimitError."""
    capabilities = capabilities or Capabilities()
    choices: list[Choice] = []

    def note(what: str, value: object, why: str) -> None:
        choices.append(Choice(what, str(value), why))

    check.instance("scene", scene, Scene)
    note("samples", quality.samples, f"{quality.samples} a pixel, as quality {quality.preset} has it")
    environment = scene.environment
    peak = contents.peak(environment)
    bright = contents.brightest(environment)
    texture_format = quality.texture_format
    if not isinstance(environment, Procedural) or any(s.material.roughness > 0 for s in scene.surfaces):
        texture_format = _fitting_format("texture format", texture_format, "environment", peak, note)
    frame_format = _frame_format(quality, bright, note)
    shared, cube_size = _environment(scene, quality, size, contents, capabilities, note)
    for i, surface in enumerate(scene.surfaces):
        _require_uv(i, surface, contents)
    boxes = _world_bounds(scene, contents)
    apart = _apart(boxes)
    near, far = near_far(scene.camera, boxes, size)
    log_depth = scene.camera.projection == "perspective" and far > FAR_OVER_NEAR * near
    if log_depth:
        note("depth", "logarithm", f"it spans {near:.3g} to {far:.3g}; 24 bits would not tell what is far apart")
    shared["LOG_DEPTH"] = int(log_depth)
    surfaces = tuple(
        _surface(i, surface, scene, quality, size, shared, bool(apart[i]), contents, note)
        for i, surface in enumerate(scene.surfaces)
    )
    steepest = max(
        (_steepest(i, scene, contents, capabilities) for i, s in enumerate(surfaces) if s.has("BUMP")), default=0.0
    )
    slopes_format = _fitting_format("slopes format", quality.texture_format, "steepest bump", steepest, note)
    glossy = any(s.has("LIGHT") == GLOSSY for s in surfaces)
    gloss = (quality.gloss_size, quality.gloss_samples) if glossy else None
    note(
        "roughness chain",
        gloss[0] if gloss else "none",
        "a surface is rough" if gloss else "nothing is rough",
    )
    if environment.background:
        note("sky", "drawn", "the environment is shown behind the surfaces")
    else:
        note("sky", "none", "the scene switches the background off")
    return Plan(
        size=size,
        samples=quality.samples,
        environment_defines=tuple(shared.items()),
        cube_size=cube_size,
        environment_filter=quality.environment_filter,
        bump_filter=quality.bump_filter,
        texture_format=texture_format,
        slopes_format=slopes_format,
        frame_format=frame_format,
        sky=environment.background,
        gloss=gloss,
        irradiance=any(s.has("DIFFUSE") for s in surfaces),
        near_far=(near, far),
        log_depth=log_depth,
        surfaces=surfaces,
        choices=tuple(choices),
    )


def _require_uv(index: int, surface: Surface, contents: Contents) -> None:
    shape = surface.shape
    if surface.bump is not None and isinstance(shape, MeshFile) and contents.mesh(shape).uv is None:
        raise SceneError(
            f"surface {index}: {shape.path} has no texture coordinates, and bumps need them; "
            "unwrap the mesh, or leave out bump"
        )


def _steepest(index: int, scene: Scene, contents: Contents, capabilities: Capabilities) -> float:
    """The largest slope in the picture of a surface's bumps; LimitError where it cannot be drawn."""
    surface = scene.surfaces[index]
    bump = surface.bump
    assert bump is not None
    height, width = contents.slopes(bump).shape[:2]
    limit = capabilities.max_texture_size
    if width > limit or height > limit:
        raise LimitError(
            f"surface {index}: its bump picture is {width}x{height} pixels and this driver takes at most {limit} "
            "a side; shrink it first"
        )
    slope = contents.steepest(bump)
    if isinstance(bump, Bump):
        extent = float(np.ptp(contents.bounds(surface.shape), axis=0).max())
        extent *= float(np.abs(np.asarray(surface.transform.scale)).min())
        rise = slope * max(map(abs, bump.slope_scale)) / extent
        if not rise <= STEEPEST:
            raise LimitError(
                f"surface {index}: its bumps rise by {rise:.3g} times its size per unit of u or v; "
                f"at most {STEEPEST:g}: lower bump.amplitude or bump.repeat"
            )
    return slope


def _frame_format(quality: Quality, bright: float, note: Note) -> str:
    if quality.frame_format == "half" and quality.samples > HALF_SUM:
        note("frame format", "float", f"{quality.samples} samples a pixel add up in it; halves would lose them")
        return "float"
    return _fitting_format("frame format", quality.frame_format, "environment", bright, note)


def _fitting_format(what: str, wanted: str, name: str, largest: float, note: Note) -> str:
    if wanted == "half" and largest > HALF_MAX:
        note(what, "float", f"the {name} reaches {largest:.3g}, and a half holds at most {HALF_MAX:.0f}")
        return "float"
    if wanted == "half" and 0.0 < largest < HALF_DIM:
        note(what, "float", f"the {name} reaches {largest:.3g} at most, too near to the end of a half's range")
        return "float"
    note(what, wanted, f"values up to {largest:.3g} fit" if wanted == "half" else "as the quality asks")
    return wanted


def _environment(
    scene: Scene,
    quality: Quality,
    size: tuple[int, int],
    contents: Contents,
    capabilities: Capabilities,
    note: Note,
) -> tuple[dict[str, int], int | None]:
    """The defines of the environment's look-up, and the face size of the cube it is resampled to, if it is."""
    environment = scene.environment
    if isinstance(environment, Procedural):
        return _computed(environment, quality, note), None
    picture = contents.environment(environment)
    height, width = picture.pixels.shape[-3:-1]
    is_panorama = isinstance(picture, Panorama)
    limit = capabilities.max_texture_size if is_panorama else capabilities.max_cube_size
    if width > limit or height > limit:
        raise LimitError(
            f"the environment is {width}x{height} pixels and this driver takes at most {limit} a side; "
            f"shrink it to {limit}x{limit // 2 if is_panorama else limit} first"
        )
    cube_size = None
    border = picture.uv_scale != (1.0, 1.0) if isinstance(picture, Panorama) else picture.border
    if is_panorama and quality.environment_layout == "cube":
        native = 2 ** math.ceil(math.log2(max(width / 4, 4)))
        seen = 2 ** math.ceil(math.log2(max(2.0 / _pixel_angle(scene, size), 16)))
        cube_size = min(native, seen, 2048, capabilities.max_cube_size)
        border = False
        note(
            "environment",
            f"cube of {cube_size}",
            f"resampled once from {width}x{height}; a face texel is no larger than "
            + ("a texel of the picture" if cube_size == native else "a pixel of the frame"),
        )
    else:
        layout = "lat-long" if is_panorama else "cube"
        note(
            "environment",
            layout,
            f"{width}x{height} as given" + (", samples on the border" if border else ""),
        )
    levels = quality.environment_filter != "bilinear"
    why = "levels by footprint" if levels else "level 0 alone; the samples average"
    note("environment filter", quality.environment_filter, why)
    defines = {
        "ENVIRONMENT": LATLONG if is_panorama and cube_size is None else CUBE,
        "ENVIRONMENT_BORDER": int(border),
        "ENVIRONMENT_FOOTPRINT": int(levels),
        "EXPOSURE": int(environment.exposure != 0.0),
    }
    return defines, cube_size


def _computed(environment: Procedural, quality: Quality, note: Note) -> dict[str, int]:
    """The defines of an environment that is a function of the direction."""
    note("environment", environment.kind, "computed for each sample; no picture, no texture, no sampler")
    averaged = is_averaged(quality.environment_filter, quality.samples)
    why = "averaged over each sample's footprint" if averaged else "the function itself; the samples average"
    note("environment filter", "analytic" if averaged else "none", why)
    return {
        "ENVIRONMENT": COMPUTED[type(environment)],
        "ENVIRONMENT_FOOTPRINT": int(averaged),
        "EXPOSURE": int(environment.exposure != 0.0),
    }


def _pixel_angle(scene: Scene, size: tuple[int, int]) -> float:
    """Radians a pixel of the frame spans (of a reflection in a flat mirror, too)."""
    camera = scene.camera
    if camera.projection == "perspective":
        return 2 * math.tan(math.radians(camera.fov) / 2) / size[1]
    # Parallel rays: a curved mirror of the picture's height spreads them over half a turn.
    return math.pi / size[1]


def _surface(
    index: int,
    surface: Surface,
    scene: Scene,
    quality: Quality,
    size: tuple[int, int],
    shared: dict[str, int],
    apart: bool,
    contents: Contents,
    note: Note,
) -> SurfacePlan:
    name = f"surface {index}"
    shape, material, bump = surface.shape, surface.material, surface.bump
    kinds = {Sphere: SPHERE, Torus: TORUS, Quad: QUAD, Plane: MESH, Cube: MESH, MeshFile: MESH}
    inside = _eye_is_inside(surface, scene)
    closed = isinstance(shape, Sphere | Torus | Cube) and not inside
    segments = _stepped(segments_for(shape, _radius_in_pixels(surface, scene, size), quality.silhouette))
    outline = isinstance(shape, Sphere) and closed and apart
    if isinstance(shape, Sphere | Torus):
        value = f"disc of {segments} sides" if outline else f"{segments} segments"
        note(
            f"{name} mesh",
            value,
            f"outline within {quality.silhouette:g} pixels" + (", and nothing comes near to cut it" if outline else ""),
        )
    near = _eye_is_near(surface, scene, contents)
    if near:
        note(f"{name} direction", "by pixel", "the eye is so near that points on it less the eye are mostly rounding")
    bump_kind, why = NO_BUMP, "it has no bump"
    if isinstance(bump, Bump):
        bump_kind, why = (HEIGHT, "heights") if bump.amplitude != 0.0 else (NO_BUMP, "its amplitude is 0")
    elif bump is not None:
        bump_kind, why = (NORMAL, "normal map") if bump.scale != 0.0 else (NO_BUMP, "its scale is 0")
    note(f"{name} bump", quality.bump_filter if bump_kind else "none", why)
    if material.roughness > 0.0:
        light, why = GLOSSY, f"roughness {material.roughness:g}"
    elif material.metallic < 1.0:
        light, why = SMOOTH, "smooth and not all metal: Fresnel's share is mirrored"
    elif material.base_color == (1.0, 1.0, 1.0):
        light, why = WHITE_MIRROR, "a mirror of base colour 1 is the environment itself: no BRDF"
    else:
        light, why = TINTED_MIRROR, "a coloured mirror: Fresnel, no BRDF"
    note(f"{name} light", ("mirror", "tinted mirror", "smooth", "glossy")[light], why)
    diffuse = material.metallic < 1.0 and any(material.base_color)
    defines = {
        "SHAPE": kinds[type(shape)],
        "OUTLINE": int(outline),
        "TRANSFORM": _transform(surface, scene),
        "DIRECTION": BY_PIXEL if near else BY_POINT,
        "BUMP": bump_kind,
        "BUMP_MIP": int(bump_kind != NO_BUMP and quality.bump_filter != "bilinear"),
        "LOOKUP": LOOKUPS[scene.environment.lookup],
        "LIGHT": light,
        "DIFFUSE": int(diffuse and light in (SMOOTH, GLOSSY)),
        "TWO_SIDED": int(not closed),
        **shared,
    }
    if light == GLOSSY:
        # The chain carries all of its light; the environment itself is not looked up here.
        defines["ENVIRONMENT_FOOTPRINT"] = 0
    return SurfacePlan(tuple(defines.items()), segments, closed)


def _stepped(segments: int) -> int:
    """The next of four steps an octave, so that a moving camera asks for few meshes, not for a new one each time."""
    return math.ceil(2.0 ** (math.ceil(4 * math.log2(segments)) / 4))


def _transform(surface: Surface, scene: Scene) -> int:
    """How object directions become the environment's: not at all, by an orthogonal matrix, or by any."""
    scale = surface.transform.uniform_scale
    if scale is None:
        return GENERAL
    linear = scene.environment.env_from_world() @ surface.transform.matrix()[:3, :3]
    return NONE if np.array_equal(linear, scale * np.eye(3)) else ORTHOGONAL


def _eye_is_inside(surface: Surface, scene: Scene) -> bool:
    """Whether the eye may be within a closed shape, so that its back sides are seen: box test, never too strict."""
    if not isinstance(surface.shape, Sphere | Torus | Cube):
        return False
    eye = surface.transform.to_object(scene.camera.eye)
    low, high = bounds(surface.shape)
    if scene.camera.projection == "orthographic":
        # Its eye is a plane; nearer surfaces may lie behind it.
        return bool(np.linalg.norm(eye) <= np.linalg.norm(high))
    return bool(np.all(eye >= low) and np.all(eye <= high))


NEAR = 0.01
"""In widths of a surface's box: how near the eye may come before directions are taken by pixel. At this distance
32-bit floats leave a point less the eye an error of 1e-5 radians."""


def _eye_is_near(surface: Surface, scene: Scene, contents: Contents) -> bool:
    """Whether the eye is within NEAR of the surface's box, or inside it."""
    if scene.camera.projection == "orthographic":
        return False
    eye = surface.transform.to_object(scene.camera.eye)
    low, high = contents.bounds(surface.shape)
    away = np.maximum(np.maximum(low - eye, eye - high), 0.0)
    return bool(away.max() < NEAR * (high - low).max())


def _radius_in_pixels(surface: Surface, scene: Scene, size: tuple[int, int]) -> float:
    """The outermost radius of a round surface as it is seen, in pixels: never too small."""
    shape = surface.shape
    if not isinstance(shape, Sphere | Torus):
        return 0.0
    radius = shape.radius + (shape.tube if isinstance(shape, Torus) else 0.0)
    radius *= float(np.abs(np.asarray(surface.transform.scale)).max())
    camera = scene.camera
    if camera.projection == "orthographic":
        return radius / camera.height * size[1]
    nearest = max(math.dist(surface.transform.translate, camera.eye) - radius, 1e-3 * radius)
    return radius / nearest / math.tan(math.radians(camera.fov) / 2) * size[1] / 2


def _world_bounds(scene: Scene, contents: Contents) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    """(N, 2, 3): the box round each surface, in the world."""
    boxes = []
    for surface in scene.surfaces:
        low, high = contents.bounds(surface.shape)
        matrix = surface.transform.matrix()
        centre = matrix[:3, :3] @ ((low + high) / 2) + matrix[:3, 3]
        reach = np.abs(matrix[:3, :3]) @ ((high - low) / 2)
        boxes.append([centre - reach, centre + reach])
    return np.array(boxes, dtype=np.float64).reshape(-1, 2, 3)


def _apart(boxes: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> np.ndarray[tuple[int, ...], np.dtype[np.bool_]]:
    """(N,) whether the box (N, 2, 3) of each surface meets no other's. Then any points of it along the rays, not
    just the nearest, are hidden or seen rightly."""
    if len(boxes) < 2:
        return np.ones(len(boxes), bool)
    low, high = boxes[:, 0], boxes[:, 1]
    meet = (low[:, None] <= high[None]).all(axis=-1) & (low[None] <= high[:, None]).all(axis=-1)
    result: np.ndarray[tuple[int, ...], np.dtype[np.bool_]] = meet.sum(axis=1) == 1
    return result
