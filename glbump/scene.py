"""What is drawn: frozen, validated dataclasses that know no OpenGL.

Conventions stand in README.md, "Conventions". Lengths are world units, angles degrees, colours linear.
Every class raises SceneError for values it does not allow.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from glbump import validate as check
from glbump.camera import Camera
from glbump.errors import SceneError, shown, unknown
from glbump.shapes import SHAPES, Shape, Transform, Vec2, Vec3

BYTES = (np.uint8, np.uint16)
"""Array types that mean what files of such integers mean: colour is sRGB, heights are parts of the full range."""


class ArrayImage:
    """A picture given as an array, kept read-only so that a frozen scene stays frozen.

    Arrays of BYTES stay so, all else becomes float32, linear. Two are equal when their pixels are; the hash is the
    shape's.
    """

    __slots__ = ("pixels",)

    def __init__(self, pixels: npt.ArrayLike) -> None:
        array = np.array(pixels)
        if array.dtype not in BYTES:
            # What float32 cannot hold becomes infinite, and is refused with its place when the picture is read.
            with np.errstate(over="ignore"):
                array = array.astype(np.float32)
        array.flags.writeable = False
        self.pixels: npt.NDArray[Any] = array

    def __eq__(self, other: object) -> bool:
        return isinstance(other, ArrayImage) and (
            self is other or np.array_equal(self.pixels, other.pixels, equal_nan=True)
        )

    def __hash__(self) -> int:
        return hash(self.pixels.shape)

    def __repr__(self) -> str:
        return f"array{self.pixels.shape}"


Image = str | Path | npt.NDArray[Any] | ArrayImage
"""A picture: a path, or an array (H, W) or (H, W, C), row 0 on top: floats of linear light, or uint8 or uint16."""


def picture_of(image: Any) -> Path | ArrayImage:
    """A checked scene's picture, as its dataclass stored it."""
    assert isinstance(image, Path | ArrayImage)
    return image


def _image(what: str, value: Any) -> Path | ArrayImage:
    if isinstance(value, ArrayImage | Path):
        return value
    if isinstance(value, str | os.PathLike) and str(value):
        return Path(value)
    if isinstance(value, np.ndarray):
        # Other integers have no full range to be parts of.
        known = value.dtype.kind == "f" or value.dtype in BYTES
        if value.ndim not in (2, 3, 4) or value.size == 0 or not known:
            raise SceneError(
                f"{what} must be a path or a non-empty array (H, W) or (H, W, C) of floats, uint8 or uint16; "
                f"got an array of shape {value.shape} and type {value.dtype}"
            )
        return ArrayImage(value)
    raise SceneError(f"{what} must be a path or an array; got {type(value).__name__} {shown(value)}")


@dataclass(frozen=True)
class Material(check.Frozen):
    """Metallic-roughness, as in glTF. base_color: linear rgb, 0..1. ior: of the dielectric part.

    Specular and diffuse light of base colour 1 add up to all the light, at every angle.
    """

    base_color: Vec3 = (1.0, 1.0, 1.0)
    metallic: float = 0.0
    roughness: float = 0.5
    ior: float = 1.5

    def __post_init__(self) -> None:
        self._store(
            base_color=check.vector("material.base_color", self.base_color, 3, least=0, most=1),
            metallic=check.number("material.metallic", self.metallic, least=0, most=1),
            roughness=check.number("material.roughness", self.roughness, least=0, most=1),
            ior=check.number("material.ior", self.ior, least=1, most=10),
        )


def _repeat(what: str, value: Any) -> Vec2:
    x, y = check.vector(what, check.sequence(value) or (value, value), 2, above=0, most=1e6)
    return (x, y)


@dataclass(frozen=True)
class Bump(check.Frozen):
    """Bumps from a picture of heights.

    height: grey picture or (H, W) array; 0..1 is its full range, positive along the outward normal.
    amplitude: the world length of that full range; negative turns bumps into dents.
    repeat: how often the picture repeats per unit of u and of v.
    channel: "r", "g", "b" or "a" where the picture is coloured.
    """

    height: Image
    amplitude: float
    repeat: Vec2 = (1.0, 1.0)
    channel: str | None = None

    def __post_init__(self) -> None:
        self._store(
            height=_image("bump.height", self.height),
            amplitude=check.number("bump.amplitude", self.amplitude, least=-1e30, most=1e30),
            repeat=_repeat("bump.repeat", self.repeat),
        )
        if self.channel is not None:
            check.choice("bump.channel", self.channel, ("r", "g", "b", "a"))

    @property
    def slope_scale(self) -> Vec2:
        """Slopes of the picture (a height of 1, its own u and v) times this are world lengths per surface u, v."""
        return self.amplitude * self.repeat[0], self.amplitude * self.repeat[1]


@dataclass(frozen=True)
class NormalMap(check.Frozen):
    """Bumps from a tangent-space normal map: linear, +Y as in OpenGL and glTF unless `flip_y`.

    scale multiplies the slopes, so 0 is flat and -1 turns bumps into dents.
    """

    normal_map: Image
    scale: float = 1.0
    repeat: Vec2 = (1.0, 1.0)
    flip_y: bool = False

    def __post_init__(self) -> None:
        self._store(
            normal_map=_image("bump.normal_map", self.normal_map),
            scale=check.number("bump.scale", self.scale, least=-1e6, most=1e6),
            repeat=_repeat("bump.repeat", self.repeat),
        )
        check.flag("bump.flip_y", self.flip_y)

    @property
    def slope_scale(self) -> Vec2:
        """Slopes of the map times this are slopes along tangent and bitangent."""
        return self.scale, self.scale


@dataclass(frozen=True)
class Surface(check.Frozen):
    """A shape with its material, its bumps and its place in the world."""

    shape: Shape
    material: Material = Material()
    bump: Bump | NormalMap | None = None
    transform: Transform = Transform()

    def __post_init__(self) -> None:
        check.instance("surface.shape", self.shape, SHAPES)
        check.instance("surface.material", self.material, Material)
        if self.bump is not None:
            check.instance("surface.bump", self.bump, (Bump, NormalMap))
        check.instance("surface.transform", self.transform, Transform)


MOST_RADIANCE = 65504.0
"""Of a colour that an environment is made of: what a half float holds."""


class _Environment(check.Frozen):
    """What all environments share; the fields stand in each class so that signatures stay readable."""

    rotation: float
    exposure: float
    lookup: str
    background: bool

    def _check_common(self) -> None:
        self._store(
            rotation=check.number("environment.rotation", self.rotation),
            exposure=check.number("environment.exposure", self.exposure, least=-64, most=64),
        )
        check.choice("environment.lookup", self.lookup, ("reflection", "normal"))
        check.flag("environment.background", self.background)

    def env_from_world(self) -> npt.NDArray[np.float64]:
        """(3, 3): turns world directions back by the rotation, into the frame of the picture."""
        angle = np.radians(self.rotation)
        c, s = np.cos(angle), np.sin(angle)
        return np.array([[c, 0.0, -s], [0.0, 1.0, 0.0], [s, 0.0, c]])


@dataclass(frozen=True)
class LatLong(_Environment):
    """A latitude-longitude picture, 2:1; its centre is -Z, seen from inside.

    rotation: degrees, counter-clockwise about +Y seen from above. exposure: stops (a factor of 2**exposure).
    lookup: by the "reflection" vector, or by the "normal" as the lecture first says it.
    background: whether the environment is seen behind the surfaces.
    """

    kind: ClassVar[str] = "lat-long"
    image: Image
    rotation: float = 0.0
    exposure: float = 0.0
    lookup: str = "reflection"
    background: bool = True

    def __post_init__(self) -> None:
        self._store(image=_image("environment.image", self.image))
        self._check_common()


@dataclass(frozen=True)
class CubeMap(_Environment):
    """Six faces in the order +X -X +Y -Y +Z -Z.

    image: an OpenEXR cube, a picture of six faces in a column, a sequence of six pictures, or an array
    (6, N, N, 3). orientation: "opengl" (the OpenGL face table) or "inside" (pictures of what one sees from
    inside, mirrored against that table); an OpenEXR `envmap` header decides by itself.
    """

    kind: ClassVar[str] = "cube"
    image: Image | Sequence[Image]
    orientation: str = "opengl"
    rotation: float = 0.0
    exposure: float = 0.0
    lookup: str = "reflection"
    background: bool = True

    def __post_init__(self) -> None:
        if isinstance(self.image, list | tuple):
            if len(self.image) != 6:
                raise SceneError(
                    f"environment.image must be one picture or six (+X -X +Y -Y +Z -Z); got {len(self.image)}"
                )
            faces = tuple(_image(f"environment.image[{i}]", v) for i, v in enumerate(self.image))
            self._store(image=faces)
        else:
            self._store(image=_image("environment.image", self.image))
        check.choice("environment.orientation", self.orientation, ("opengl", "inside"))
        self._check_common()


class Procedural(_Environment):
    """An environment that is a function of the direction: no picture, no texture."""

    kind: ClassVar[str]

    def arguments(self) -> dict[str, Any]:
        """Its own settings, by the names of its function's parameters (shaders/lib/procedural.glsl)."""
        common = ("rotation", "exposure", "lookup", "background")
        return {f.name: getattr(self, f.name) for f in fields(self) if f.name not in common}  # type: ignore[arg-type]

    def colours(self) -> tuple[Vec3, ...]:
        """Those of its settings that are colours; it is nowhere brighter than the brightest of them."""
        return tuple(value for value in self.arguments().values() if isinstance(value, tuple))

    def _check_colours(self, *names: str) -> None:
        for name in names:
            colour = check.vector(f"environment.{name}", getattr(self, name), 3, least=0, most=MOST_RADIANCE)
            self._store(**{name: colour})


@dataclass(frozen=True)
class Sky(Procedural):
    """The lecture's simple environment: up is one colour, down another, and a soft horizon between.

    up, down: linear rgb. softness: degrees above the horizon at which some 85 % of the change from down to up is done.
    The rest as in LatLong.
    """

    kind: ClassVar[str] = "sky"
    up: Vec3 = (0.10, 0.26, 0.72)
    down: Vec3 = (0.13, 0.07, 0.03)
    softness: float = 15.0
    rotation: float = 0.0
    exposure: float = 0.0
    lookup: str = "reflection"
    background: bool = True

    def __post_init__(self) -> None:
        self._check_colours("up", "down")
        self._store(softness=check.number("environment.softness", self.softness, least=0, most=90))
        self._check_common()

    def arguments(self) -> dict[str, Any]:
        """As the function takes them: softness is a sine."""
        return super().arguments() | {"softness": float(np.sin(np.radians(self.softness)))}


@dataclass(frozen=True)
class Chrome(Procedural):
    """The lecture's medium environment: sinusoids between grey and silver.

    grey, silver: linear rgb. bands: how many from straight down to straight up. sway: by how many bands a slower
    sinusoid moves them up and down. The rest as in LatLong.
    """

    kind: ClassVar[str] = "chrome"
    grey: Vec3 = (0.02, 0.022, 0.026)
    silver: Vec3 = (0.90, 0.92, 0.96)
    bands: float = 3.0
    sway: float = 0.3
    rotation: float = 0.0
    exposure: float = 0.0
    lookup: str = "reflection"
    background: bool = True

    def __post_init__(self) -> None:
        self._check_colours("grey", "silver")
        self._store(
            bands=check.number("environment.bands", self.bands, least=0, most=64),
            sway=check.number("environment.sway", self.sway, least=-16, most=16),
        )
        self._check_common()


@dataclass(frozen=True)
class Fractal(Procedural):
    """The lecture's complex environment: a fractal landscape in sunlight, which the reflected ray is intersected with.

    sky: straight up; haze: at the horizon; rock, snow: of the ground. Linear rgb. relief: how much higher than the
    ground at the eye the mountains may be, whose feet are some 5 away. seed: another landscape for each.
    steps: how many distances along a ray are looked at, at most. The rest as in LatLong.
    """

    kind: ClassVar[str] = "fractal"
    seed: int = 1
    relief: float = 3.0
    sky: Vec3 = (0.10, 0.27, 0.68)
    haze: Vec3 = (0.60, 0.72, 0.88)
    rock: Vec3 = (0.20, 0.145, 0.10)
    snow: Vec3 = (0.95, 0.96, 1.0)
    steps: int = 96
    rotation: float = 0.0
    exposure: float = 0.0
    lookup: str = "reflection"
    background: bool = True

    def __post_init__(self) -> None:
        self._check_colours("sky", "haze", "rock", "snow")
        self._store(
            seed=check.integer("environment.seed", self.seed, least=0, most=2**31 - 1),
            relief=check.number("environment.relief", self.relief, least=0, most=4),
            steps=check.integer("environment.steps", self.steps, least=8, most=1024),
        )
        self._check_common()


Environment = Sky | Chrome | Fractal | LatLong | CubeMap
ENVIRONMENTS: tuple[type[Any], ...] = (Sky, Chrome, Fractal, LatLong, CubeMap)


@dataclass(frozen=True)
class Scene(check.Frozen):
    """Surfaces in an environment, the lecture's simple Sky unless given, and the camera that sees them."""

    surfaces: Sequence[Surface]
    environment: Environment = Sky()
    camera: Camera = Camera()

    def __post_init__(self) -> None:
        surfaces = check.sequence(self.surfaces)
        if surfaces is None:
            raise SceneError(f"scene.surfaces must be a list of Surface; got {shown(self.surfaces)}")
        self._store(surfaces=tuple(surfaces))
        for i, surface in enumerate(self.surfaces):
            check.instance(f"scene.surfaces[{i}]", surface, Surface)
        check.instance("scene.environment", self.environment, ENVIRONMENTS)
        check.instance("scene.camera", self.camera, Camera)


def check_size(size: Any, *, most: int = 16384) -> tuple[int, int]:
    """(width, height) in pixels, each 1..`most`; SceneError otherwise."""
    pair = check.vector("size", size, 2)
    width, height = (check.integer(f"size[{i}]", v, least=1, most=most) for i, v in enumerate(pair))
    return width, height


def with_value(scene: Scene, dotted: str, value: Any) -> Scene:
    """A copy of `scene` with one field set, named as in a scene file: "surface.0.bump.amplitude"."""

    def put(owner: Any, names: list[str]) -> Any:
        head, rest = names[0], names[1:]
        if isinstance(owner, tuple):
            if not head.isdecimal() or int(head) >= len(owner):
                raise SceneError(f"{dotted}: no item {head!r}; there are {len(owner)}, counted from 0")
            i = int(head)
            return owner[:i] + (put(owner[i], rest) if rest else value,) + owner[i + 1 :]
        known = [f.name for f in fields(owner)]
        name = "surfaces" if isinstance(owner, Scene) and head == "surface" else head
        if name not in known:
            raise SceneError(f"{dotted}: " + unknown("field", head, known))
        if rest and not (
            hasattr(getattr(owner, name), "__dataclass_fields__") or isinstance(getattr(owner, name), tuple)
        ):
            raise SceneError(f"{dotted}: {name} has no fields to set; it is {shown(getattr(owner, name))}")
        return replace(owner, **{name: put(getattr(owner, name), rest) if rest else value})

    result: Scene = put(scene, dotted.split("."))
    return result
