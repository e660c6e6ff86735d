"""The words of a plan: what it is made of, and its numbered choices, which shaders know by the same numbers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import field
from typing import NamedTuple

from glbump.contents import Contents
from glbump.environment import Chrome, Environment, Fractal, Sky
from glbump.frozen import Frozen
from glbump.maps.encodings import HALF_DIM, HALF_MAX
from glbump.maps.layout import (
    CUBE,
    EQUAL_AREA,
    EQUIDISTANT,
    HEMICUBE,
    LATLONG,
    OCTAHEDRAL,
    ORTHOGRAPHIC,
    PARABOLOID,
    Layout,
)
from glbump.plan.seen import Seen
from glbump.quality import Quality
from glbump.relief import Layer
from glbump.scene import Scene
from glbump.shown import SHOWN

Defines = tuple[tuple[str, int], ...]

MESH, SPHERE, TORUS, QUAD = range(4)
NO_BUMP, SLOPES, NORMALS, HEIGHTS = range(4)
"""Kinds of bumps; what follows is added to them."""
CLAMPED, PARAMETER, TRIPLANAR, SCREEN = 4, 8, 16, 32
DRAWN_LAYOUTS = (LATLONG, CUBE, HEMICUBE, OCTAHEDRAL, EQUAL_AREA, EQUIDISTANT, ORTHOGRAPHIC, PARABOLOID)
"""Those that shaders read, in the order of their numbers there."""
COMPUTED = {kind: len(DRAWN_LAYOUTS) + i for i, kind in enumerate((Sky, Chrome, Fractal))}
WHOLE, MIRRORED_BELOW, COLOURED_BELOW = range(3)
LEVELS = {"longest": 0, "area": 1}
LOOKUPS = {"reflection": 0, "normal": 1}
NONE, ORTHOGONAL, GENERAL = range(3)
BY_POINT, BY_PIXEL = range(2)
WHITE_MIRROR, TINTED_MIRROR, SMOOTH, GLOSSY = range(4)
NO_PARALLAX, BOX, SPHERICAL = range(3)
SPREADS = {"none": 0, "toksvig": 1, "lean": 2}
DIFFUSES = {"sh9": 1, "map": 2}
GLOSSES = {"chain": 0, "sampled": 1}
FACTORS = {"fit": 0, "table": 1}


def _never() -> bool:
    return False


class Capabilities(Frozen):
    """What the driver can do, as far as a plan depends on it. multisamples: most samples a pixel that one pass draws,
    and shades one by one; 0 where a driver cannot. memory, texture_memory: bytes free in the machine, and on
    the graphics card; None where that is not known. honours_anisotropy: says whether texture units look up along
    footprints, and as often as they are told; asked where a plan depends on it, as it is measured by drawing."""

    max_texture_size: int = 16384
    max_cube_size: int = 16384
    is_software: bool = False
    multisamples: int = 0
    memory: int | None = None
    texture_memory: int | None = None
    honours_anisotropy: Callable[[], bool] = _never


class Choice(Frozen):
    """One decision: what, how, why."""

    what: str
    value: str
    why: str


class ChainPlan(NamedTuple):
    """A roughness chain: size of its first level's faces, samples of its second, and whether the GPU draws it."""

    size: int
    samples: int
    drawn: bool

    @property
    def last_level(self) -> int:
        """Of roughness 1; the first level is the environment itself."""
        from glbump.maps.gloss import SMALLEST_FACES  # most scenes have no chain

        return (self.size // SMALLEST_FACES).bit_length() - 1


class EnvironmentPlan(Frozen):
    """How one environment is kept and looked up. defines: of its look-up.

    layout: of its texels on the GPU, None where it is computed; size: of its tiles, where they are not the picture's.
    filter, pyramid, texture_format: as in Quality; pre_exposure: texels are light / 2**it. gloss: the roughness chain,
    where a surface needs it; diffuse: whether one scatters its light. suns: taken out of both.
    """

    environment: Environment
    defines: Defines
    layout: Layout | None
    size: int | None
    filter: str
    pyramid: str
    texture_format: str
    pre_exposure: int = 0
    gloss: ChainPlan | None = None
    diffuse: bool = False
    suns: int = 0


class SurfacePlan(Frozen):
    """How one surface is drawn. defines: what its program is compiled with. segments: of its mesh. environment: its
    number in the plan. layers: how its bumps are read."""

    defines: Defines
    segments: int
    cull: bool
    environment: int
    layers: tuple[Layer, ...] = ()

    def has(self, name: str) -> int:
        """The value of a define."""
        return dict(self.defines)[name]


class Plan(Frozen):
    """What a frame is made of; everything that is not here is neither compiled, uploaded nor computed.

    environments: the scene's own first, then those that surfaces have beside it. is_multisampled: whether
    one pass has all samples. sky_each: whether the sky is looked up for each of them.
    """

    size: tuple[int, int]
    samples: int
    footprint: float
    show: int
    is_multisampled: bool
    environments: tuple[EnvironmentPlan, ...]
    bump_filter: str
    bump_spread: str
    lobe_samples: int
    frame_format: str
    sky: bool
    sky_each: bool
    sky_parallax: int
    near_far: tuple[float, float]
    log_depth: bool
    surfaces: tuple[SurfacePlan, ...]
    choices: tuple[Choice, ...]

    @property
    def passes(self) -> int:
        """How often the scene is drawn."""
        return 1 if self.is_multisampled else self.samples

    def explain(self) -> str:
        """Each choice and its reason, one a line."""
        width = max(len(c.what) for c in self.choices)
        return "\n".join(f"{c.what:<{width}}  {c.value}: {c.why}" for c in self.choices)


class Draft(Frozen):
    """A plan in the making: what it is for, and the choices so far."""

    scene: Scene
    quality: Quality
    size: tuple[int, int]
    contents: Contents
    capabilities: Capabilities
    seen: Seen
    show: str | None = None
    choices: list[Choice] = field(default_factory=list)

    @property
    def shown(self) -> int:
        """The number of what is shown in place of light; 0: light."""
        return 0 if self.show is None else SHOWN[self.show].number

    @property
    def has_gradients(self) -> bool:
        """Whether the texture unit's own look-ups along footprints are used; they do not say at which levels."""
        return self.quality.anisotropy > 1 and self.show is None and self.capabilities.honours_anisotropy()

    def note(self, what: str, value: object, why: str) -> None:
        """One more choice."""
        self.choices.append(Choice(what, str(value), why))

    def fitting_format(self, what: str, wanted: str, name: str, largest: float) -> str:
        """`wanted`, or "float" where halves do not hold values up to `largest`."""
        if wanted == "half" and largest > HALF_MAX:
            self.note(what, "float", f"the {name} reaches {largest:.3g}, and a half holds at most {HALF_MAX:.0f}")
            return "float"
        if wanted == "half" and 0.0 < largest < HALF_DIM:
            self.note(what, "float", f"the {name} reaches {largest:.3g} at most, too near to the end of a half's range")
            return "float"
        self.note(what, wanted, f"values up to {largest:.3g} fit" if wanted == "half" else "as the quality asks")
        return wanted
