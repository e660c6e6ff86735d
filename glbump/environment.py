"""What surfaces mirror: frozen, validated dataclasses, as glbump.scene has them.

Every class raises SceneError for values it does not allow.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from glbump import validate as check
from glbump.errors import SceneError, shown
from glbump.frozen import Frozen
from glbump.image import Image, checked_image
from glbump.shapes import Vec3

MOST_RADIANCE = 65504.0
"""Of a colour that an environment is made of: what a half float holds."""


class BoxBounds(Frozen):
    """The walls of a room, as a box along the world's axes: its lowest and its highest corner."""

    low: Vec3
    high: Vec3

    def __post_init__(self) -> None:
        low, high = check.point("bounds.low", self.low), check.point("bounds.high", self.high)
        if not all(a < b for a, b in zip(low, high)):
            raise SceneError(f"bounds.low must be less than bounds.high in x, y and z; got {low} and {high}")
        self._store(low=low, high=high)

    def holds(self, point: Vec3) -> bool:
        """Whether a point is inside."""
        return all(a < p < b for a, p, b in zip(self.low, point, self.high))

    def least_distance(self, point: Vec3) -> float:
        """From a point inside to the nearest wall."""
        return min(*(p - a for a, p in zip(self.low, point)), *(b - p for p, b in zip(point, self.high)))


class SphereBounds(Frozen):
    """The walls of a round place: a sphere in the world."""

    centre: Vec3
    radius: float

    def __post_init__(self) -> None:
        self._store(centre=check.point("bounds.centre", self.centre), radius=check.length("bounds.radius", self.radius))

    def holds(self, point: Vec3) -> bool:
        """Whether a point is inside."""
        return float(np.linalg.norm(np.subtract(point, self.centre))) < self.radius

    def least_distance(self, point: Vec3) -> float:
        """From a point inside to the nearest wall."""
        return self.radius - float(np.linalg.norm(np.subtract(point, self.centre)))


Bounds = BoxBounds | SphereBounds


class Environment(Frozen, kw_only=True):
    """What all environments share.

    rotation: degrees, counter-clockwise about +Y seen from above. exposure: stops (a factor of 2**exposure).
    lookup: by the "reflection" vector, or by the "normal" as the lecture first says it.
    background: whether the environment is seen behind the surfaces.
    """

    kind: ClassVar[str]
    rotation: float = 0.0
    exposure: float = 0.0
    lookup: str = "reflection"
    background: bool = True

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


# ------------------------------------------------------------ pictures


class Pictured(Environment, kw_only=True):
    """An environment of texels. position: where in the world it was taken. bounds: the walls that it shows, about
    `position`; given, reflections in them are right for objects inside, wherever they stand (parallax correction);
    without, what it shows is infinitely far."""

    bounds: Bounds | None = None
    position: Vec3 = (0.0, 0.0, 0.0)

    def _check_common(self) -> None:
        super()._check_common()
        self._store(position=check.point("environment.position", self.position))
        if self.bounds is None:
            return
        check.instance("environment.bounds", self.bounds, (BoxBounds, SphereBounds))
        if not self.bounds.holds(self.position):
            raise SceneError(f"environment.position must lie inside environment.bounds; got {self.position}")
        if self.rotation and isinstance(self.bounds, BoxBounds):
            raise SceneError(
                "environment.bounds is a box along the world's axes, so environment.rotation must be 0; "
                f"got {self.rotation:g}: turn the surfaces and the camera, or use a sphere"
            )

    @property
    def layout(self) -> str:
        """How the picture lies: a name of glbump.maps.layout.LAYOUTS."""
        return self.kind

    @property
    def images(self) -> tuple[Any, ...]:
        """The pictures it is made of: paths and arrays."""
        image = getattr(self, "image", ())
        return image if isinstance(image, tuple) else (image,)

    def _check_image(self, *counts: int) -> None:
        """One picture, or one of the numbers of pictures that `counts` allows."""
        image: Any = getattr(self, "image")  # noqa: B009
        if counts and isinstance(image, list | tuple):
            if len(image) not in counts:
                many = " or ".join({5: "five (top +X -X +Z -Z)", 6: "six (+X -X +Y -Y +Z -Z)"}[n] for n in counts)
                raise SceneError(f"environment.image must be one picture or {many}; got {len(image)}")
            self._store(image=tuple(checked_image(f"environment.image[{i}]", v) for i, v in enumerate(image)))
        else:
            self._store(image=checked_image("environment.image", image))


class LatLong(Pictured):
    """A latitude-longitude picture, 2:1; its centre is -Z, seen from inside."""

    kind: ClassVar[str] = "lat-long"
    image: Image

    def __post_init__(self) -> None:
        self._check_image()
        self._check_common()


class CubeMap(Pictured):
    """Six faces in the order +X -X +Y -Y +Z -Z.

    image: an OpenEXR cube, a picture of six faces (a column, a row, a cross), a sequence of six pictures, a folder of
    them or a pattern NAME_{face}.png, or an array (6, N, N, 3). orientation: "opengl" (the OpenGL face table), "inside"
    (pictures of what one sees from inside, mirrored against that table), or "auto": crosses and files named front,
    back, ... are seen from inside, with their front at -Z; of others the edges tell, and it is "opengl" where they do
    not. An OpenEXR `envmap` header decides by itself.
    """

    kind: ClassVar[str] = "cube"
    image: Image | Sequence[Image]
    orientation: str = "auto"

    def __post_init__(self) -> None:
        self._check_image(6)
        check.choice("environment.orientation", self.orientation, ("auto", "opengl", "inside"))
        self._check_common()


MIRRORED = "mirrored"


class _UpperHalf(Pictured, kw_only=True):
    """An environment that shows the upper half of the world. below: linear rgb of all that lies below the horizon, or
    "mirrored": what lies above it, mirrored."""

    below: Vec3 | str = MIRRORED

    def _check_below(self) -> None:
        if isinstance(self.below, str) and self.below == MIRRORED:
            return
        if isinstance(self.below, str) or check.sequence(self.below) is None:
            raise SceneError(f'environment.below must be "{MIRRORED}" or 3 numbers, a colour; got {shown(self.below)}')
        self._store(below=check.vector("environment.below", self.below, 3, least=0, most=MOST_RADIANCE))


class HemiCube(_UpperHalf):
    """The upper half of a cube map, in half its memory: the top and the upper halves of four sides.

    image: a column of the top N x N and the halves N x N/2 of +X -X +Z -Z, the cross 2N x 2N that unfolds about the
    top, or a sequence of five pictures, top first. orientation: as for CubeMap.
    """

    kind: ClassVar[str] = "hemicube"
    image: Image | Sequence[Image]
    orientation: str = "auto"

    def __post_init__(self) -> None:
        self._check_image(5)
        check.choice("environment.orientation", self.orientation, ("auto", "opengl", "inside"))
        self._check_below()
        self._check_common()


HEMISPHERES = ("equal-area", "equidistant", "orthographic", "dual-paraboloid")


class Hemisphere(_UpperHalf):
    """A disc that shows the sky as one sees it looking up, with -Z at the top of the picture, so +X on the left.

    projection: "equal-area" (Lambert), "equidistant" (a fisheye lens), "orthographic", or "dual-paraboloid": two discs
    side by side, looking up and looking down, that show the whole sphere (`below` is not used then).
    """

    kind: ClassVar[str] = "hemisphere"
    image: Image
    projection: str = "equidistant"

    def __post_init__(self) -> None:
        self._check_image()
        check.choice("environment.projection", self.projection, HEMISPHERES)
        self._check_below()
        self._check_common()

    @property
    def layout(self) -> str:
        return self.projection


class Octahedral(Pictured):
    """The sphere as an octahedron unfolded to a square about +Y; s along +X, t (down) along +Z."""

    kind: ClassVar[str] = "octahedral"
    image: Image

    def __post_init__(self) -> None:
        self._check_image()
        self._check_common()


PROBES = ("angular", "mirror-ball")


class LightProbe(Pictured):
    """The whole sphere as one disc, +Y at the top of the picture.

    projection: "angular" (r = angle from -Z over 180 degrees), or "mirror-ball": the photograph of one, taken along -Z
    from far off, cut to the ball's outline.
    """

    kind: ClassVar[str] = "light-probe"
    image: Image
    projection: str = "angular"

    def __post_init__(self) -> None:
        self._check_image()
        check.choice("environment.projection", self.projection, PROBES)
        self._check_common()

    @property
    def layout(self) -> str:
        return self.projection


class Captured(Pictured):
    """What is seen from `position`: the scene itself, without the surfaces that have this environment, drawn onto a
    cube's faces. Belongs to a surface (`Surface.environment`), not to a scene.

    size: pixels along a face, each of the quality's samples. faces: "cube" (six pictures), or "hemicube" (five, the
    upper half, `size` even; what lies below the horizon mirrors it). bounces: how often light goes on between captured
    surfaces: 1 shows others by the scene's own environment, each more by what they capture.
    The scene's environment is always behind, with its own rotation and exposure, seen in `background` or not. Faces
    lie along the axes of the world; this `rotation` turns what they show, and this `exposure` comes on top.
    Where drawing it anew must be quick, give it to mirrors and glass, and a cube: for rough and diffuse surfaces and
    for hemicubes the faces are read back.
    """

    kind: ClassVar[str] = "captured"
    size: int = 256
    faces: str = "cube"
    bounces: int = 1

    def __post_init__(self) -> None:
        self._store(
            size=check.integer("environment.size", self.size, least=4, most=16384),
            bounces=check.integer("environment.bounces", self.bounces, least=1, most=16),
        )
        check.choice("environment.faces", self.faces, ("cube", "hemicube"))
        if self.faces == "hemicube" and self.size % 2:
            raise SceneError(f"environment.size of a hemicube must be even, as its sides are halved; got {self.size}")
        self._check_common()

    @property
    def layout(self) -> str:
        return self.faces


# ------------------------------------------------------------ formulas


class Procedural(Environment):
    """An environment that is a function of the direction: no picture, no texture."""

    def arguments(self) -> dict[str, Any]:
        """Its own settings, by the names of its function's parameters (shaders/lib/procedural.glsl)."""
        common = {f.name for f in fields(Environment)}
        return {f.name: getattr(self, f.name) for f in fields(self) if f.name not in common}

    def colours(self) -> tuple[Vec3, ...]:
        """Those of its settings that are colours; it is nowhere brighter than the brightest of them."""
        return tuple(value for value in self.arguments().values() if isinstance(value, tuple))

    def _check_colours(self, *names: str) -> None:
        for name in names:
            colour = check.vector(f"environment.{name}", getattr(self, name), 3, least=0, most=MOST_RADIANCE)
            self._store(**{name: colour})


class Sky(Procedural):
    """The lecture's simple environment: up is one colour, down another, and a soft horizon between.

    up, down: linear rgb. softness: degrees above the horizon at which some 85 % of the change from down to up is done.
    """

    kind: ClassVar[str] = "sky"
    up: Vec3 = (0.10, 0.26, 0.72)
    down: Vec3 = (0.13, 0.07, 0.03)
    softness: float = 15.0

    def __post_init__(self) -> None:
        self._check_colours("up", "down")
        self._store(softness=check.number("environment.softness", self.softness, least=0, most=90))
        self._check_common()

    def arguments(self) -> dict[str, Any]:
        """As the function takes them: softness is a sine."""
        return super().arguments() | {"softness": float(np.sin(np.radians(self.softness)))}


class Chrome(Procedural):
    """The lecture's medium environment: sinusoids between grey and silver.

    grey, silver: linear rgb. bands: how many from straight down to straight up. sway: by how many bands a slower
    sinusoid moves them up and down.
    """

    kind: ClassVar[str] = "chrome"
    grey: Vec3 = (0.02, 0.022, 0.026)
    silver: Vec3 = (0.90, 0.92, 0.96)
    bands: float = 3.0
    sway: float = 0.3

    def __post_init__(self) -> None:
        self._check_colours("grey", "silver")
        self._store(
            bands=check.number("environment.bands", self.bands, least=0, most=64),
            sway=check.number("environment.sway", self.sway, least=-16, most=16),
        )
        self._check_common()


class Fractal(Procedural):
    """The lecture's complex environment: a fractal landscape in sunlight, which the reflected ray is intersected with.

    sky: straight up; haze: at the horizon; rock, snow: of the ground. Linear rgb. relief: how much higher than the
    ground at the eye the mountains may be, whose feet are some 5 away. seed: another landscape for each.
    steps: how many distances along a ray are looked at, at most.
    """

    kind: ClassVar[str] = "fractal"
    seed: int = 1
    relief: float = 3.0
    sky: Vec3 = (0.10, 0.27, 0.68)
    haze: Vec3 = (0.60, 0.72, 0.88)
    rock: Vec3 = (0.20, 0.145, 0.10)
    snow: Vec3 = (0.95, 0.96, 1.0)
    steps: int = 96

    def __post_init__(self) -> None:
        self._check_colours("sky", "haze", "rock", "snow")
        self._store(
            seed=check.integer("environment.seed", self.seed, least=0, most=2**31 - 1),
            relief=check.number("environment.relief", self.relief, least=0, most=4),
            steps=check.integer("environment.steps", self.steps, least=8, most=1024),
        )
        self._check_common()


ENVIRONMENTS: tuple[type[Environment], ...] = (
    Sky,
    Chrome,
    Fractal,
    LatLong,
    CubeMap,
    HemiCube,
    Hemisphere,
    Octahedral,
    LightProbe,
    Captured,
)
