"""What is drawn: frozen, validated dataclasses that know no OpenGL.

Conventions stand in README.md, "Conventions". Lengths are world units, angles degrees, colours linear.
Every class raises SceneError for values it does not allow.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields, replace
from typing import Any

from glbump import validate as check
from glbump.camera import Camera
from glbump.environment import ENVIRONMENTS, Captured, Environment, Sky
from glbump.errors import SceneError, shown, unknown
from glbump.frozen import Frozen
from glbump.image import Image, checked_image
from glbump.shapes import SHAPES, Shape, Transform, Vec2, Vec3


class Material(Frozen):
    """Metallic-roughness, as in glTF. base_color: linear rgb, 0..1. ior: of the dielectric part.

    transmission: the share of the light that is not mirrored which goes through a dielectric, bent once by its ior
    (there is no second surface), in place of being scattered. Specular and diffuse or transmitted light of base colour
    1 add up to all the light, at every angle.
    """

    base_color: Vec3 = (1.0, 1.0, 1.0)
    metallic: float = 0.0
    roughness: float = 0.5
    ior: float = 1.5
    transmission: float = 0.0

    def __post_init__(self) -> None:
        self._store(
            base_color=check.vector("material.base_color", self.base_color, 3, least=0, most=1),
            metallic=check.number("material.metallic", self.metallic, least=0, most=1),
            roughness=check.number("material.roughness", self.roughness, least=0, most=1),
            ior=check.number("material.ior", self.ior, least=1, most=10),
            transmission=check.number("material.transmission", self.transmission, least=0, most=1),
        )

    @property
    def is_diffuse(self) -> bool:
        """Whether it scatters light that comes from all sides."""
        return self.metallic < 1.0 and self.transmission < 1.0 and any(self.base_color)

    @property
    def is_transmissive(self) -> bool:
        """Whether light goes through it."""
        return self.metallic < 1.0 and self.transmission > 0.0


def _repeat(what: str, value: Any) -> Vec2:
    x, y = check.vector(what, check.sequence(value) or (value, value), 2, above=0, most=1e6)
    return (x, y)


class Bump(Frozen):
    """Bumps from a picture of heights.

    height: grey picture or (H, W) array; 0..1 is its full range, positive along the outward normal.
    amplitude: the world length of that full range; negative turns bumps into dents.
    repeat: how often the picture repeats per unit of u and of v; triplanar, per unit of the object's coordinates.
    channel: "r", "g", "b" or "a" where the picture is coloured.
    border: what lies beyond the picture's edge: "wrap" (it repeats), "mirror" (every other one is turned round), or
    "clamp" (once, its edges drawn out).
    scaling: "world", amplitude in world units, so that bumps on a larger surface are flatter; or "parameter", in units
    of u and v (Blinn 1978, section 4): the look does not change with the size of the surface.
    mapping: "uv", or "triplanar" for surfaces without u and v: laid along the object's three axes, seen upright from
    outside, and mixed by the normal's components.
    pixel_size: the world length of one pixel of the picture, in place of `repeat`: on a plane, a quad with parallel
    sides, and what is mapped triplanar and not stretched. Heights in metres, as of terrain, have amplitude 1.
    """

    height: Image
    amplitude: float
    repeat: Vec2 = (1.0, 1.0)
    channel: str | None = None
    border: str = "wrap"
    scaling: str = "world"
    mapping: str = "uv"
    pixel_size: float | None = None

    def __post_init__(self) -> None:
        check.choice("bump.border", self.border, ("wrap", "mirror", "clamp"))
        check.choice("bump.scaling", self.scaling, ("world", "parameter"))
        check.choice("bump.mapping", self.mapping, ("uv", "triplanar"))
        if (self.mapping, self.scaling) == ("triplanar", "parameter"):
            raise SceneError('bump.scaling "parameter" is in units of u and v; bump.mapping "triplanar" has none')
        if self.pixel_size is not None:
            self._store(pixel_size=check.length("bump.pixel_size", self.pixel_size))
            if self.repeat != (1.0, 1.0):
                raise SceneError(
                    f"bump.pixel_size says how large the picture is, and so does bump.repeat {self.repeat}; give one"
                )
        self._store(
            height=checked_image("bump.height", self.height),
            amplitude=check.number("bump.amplitude", self.amplitude, least=-1e30, most=1e30),
            repeat=_repeat("bump.repeat", self.repeat),
        )
        if self.channel is not None:
            check.choice("bump.channel", self.channel, ("r", "g", "b", "a"))

    @property
    def map_repeat(self) -> Vec2:
        """How often the map of it is repeated: one that mirrors is the picture and its mirror images in one."""
        times = 0.5 if self.border == "mirror" else 1.0
        return self.repeat[0] * times, self.repeat[1] * times

    @property
    def slope_scale(self) -> Vec2:
        """Slopes of the map (a height of 1, its own u and v) times this are world lengths per surface u, v."""
        return self.amplitude * self.map_repeat[0], self.amplitude * self.map_repeat[1]


class NormalMap(Frozen):
    """Bumps from a tangent-space normal map: linear, +Y as in OpenGL and glTF unless `flip_y`.

    scale multiplies the slopes, so 0 is flat and -1 turns bumps into dents.
    """

    normal_map: Image
    scale: float = 1.0
    repeat: Vec2 = (1.0, 1.0)
    flip_y: bool = False

    def __post_init__(self) -> None:
        self._store(
            normal_map=checked_image("bump.normal_map", self.normal_map),
            scale=check.number("bump.scale", self.scale, least=-1e6, most=1e6),
            repeat=_repeat("bump.repeat", self.repeat),
        )
        check.flag("bump.flip_y", self.flip_y)

    @property
    def map_repeat(self) -> Vec2:
        """As of a Bump."""
        return self.repeat

    @property
    def slope_scale(self) -> Vec2:
        """Slopes of the map times this are slopes along tangent and bitangent."""
        return self.scale, self.scale


MOST_BUMPS = 4


class Surface(Frozen):
    """A shape with its material, its bumps and its place in the world.

    bump: one, or up to MOST_BUMPS of them, whose gradients add up: detail over a base, heights and normal maps.
    environment: what it mirrors, where that is not the scene's: another picture, or what it captures of the scene.
    """

    shape: Shape
    material: Material = Material()
    bump: Bump | NormalMap | Sequence[Bump | NormalMap] | None = None
    transform: Transform = Transform()
    environment: Environment | None = None

    def __post_init__(self) -> None:
        check.instance("surface.shape", self.shape, SHAPES)
        check.instance("surface.material", self.material, Material)
        layers = check.sequence(self.bump)
        if layers is not None:
            if not 1 <= len(layers) <= MOST_BUMPS:
                raise SceneError(f"surface.bump must be one bump or 1 to {MOST_BUMPS} of them; got {len(layers)}")
            for i, layer in enumerate(layers):
                check.instance(f"surface.bump[{i}]", layer, (Bump, NormalMap))
            self._store(bump=tuple(layers))
        elif self.bump is not None:
            check.instance("surface.bump", self.bump, (Bump, NormalMap))
        check.instance("surface.transform", self.transform, Transform)
        if self.environment is not None:
            check.instance("surface.environment", self.environment, ENVIRONMENTS)

    @property
    def bumps(self) -> tuple[Bump | NormalMap, ...]:
        """Its bumps that do anything."""
        layers = self.bump if isinstance(self.bump, tuple) else (self.bump,)
        strength = [layer and (layer.amplitude if isinstance(layer, Bump) else layer.scale) for layer in layers]
        return tuple(layer for layer, s in zip(layers, strength) if s)


class Scene(Frozen):
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
        if isinstance(self.environment, Captured):
            raise SceneError(
                "scene.environment must be what is far away, a picture or a formula; what is captured of a scene "
                "belongs to a surface: give it as surface.environment"
            )
        check.instance("scene.camera", self.camera, Camera)

    def environment_of(self, surface: Surface) -> Environment:
        """What one of its surfaces mirrors."""
        return surface.environment or self.environment

    @property
    def environments(self) -> tuple[Environment, ...]:
        """The scene's own, then those that surfaces have beside it, each once."""
        return tuple(dict.fromkeys([self.environment, *map(self.environment_of, self.surfaces)]))


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
