"""What error to expect of a setting before it is drawn: each knob's part of it, from the scene's own light on tiles.

No OpenGL in it. What the float64 reference models of a setting, it shows on a few tiles of the picture; what it does
not, follows from a formula, or is said to be missing. Parts that are independent of one another add as variances, which
saturate where light varies no more; biases add as they are, at worst.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from glbump.captures import captured
from glbump.contents import Contents
from glbump.environment import Environment, Pictured
from glbump.errors import SceneError
from glbump.maps.colour import srgb_from_linear
from glbump.maps.layout import EnvironmentMap, resampled
from glbump.plan import EnvironmentPlan, Plan
from glbump.quality import Quality
from glbump.reference.shade import PIECES, render_regions
from glbump.scene import Scene
from glbump.shapes import Sphere, Torus
from glbump.trade.errors import Bounds, rmse_bounds
from glbump.trade.settings import work
from glbump.trade.truth import tiles

F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]

TOGETHER = (
    *("samples", "environment_filter", "environment_level", "anisotropy", "pyramid", "bump_filter", "bump_spread"),
    *("environment_layout", "bump_read", "gloss", "gloss_size", "gloss_samples", "lobe_samples", "dfg"),
)
"""Knobs of one part: all decide what a sample averages, and none's error stays the same when another is turned."""
APART = (
    ("bump_kernel",),
    ("bump_terms", "direction_error"),
    ("bump_format",),
    ("diffuse", "suns"),
    ("texture_format",),
    ("silhouette",),
    ("frame_format",),
)
"""Knobs whose errors are taken to be independent of all others, but for those beside them."""
MISSING = {"gloss_chain": "the reference sums its roughness chain over a tree; what the GPU draws differs by its noise"}
"""Knobs whose error is not predicted, and why."""

COUNT = 16
"""Tiles that a prediction is made from."""
REACHED = 0.4
"""Of the height over a side that silhouette allows, what outlines have, root mean square: segments come in four steps
an octave, and radii are never taken too small. Measured on spheres and tori of 20 to 40 pixels: 0.2 to 0.7."""
FLIPPED = 0.25
"""Measured on one scene of a sphere and a torus."""
FACTOR = 1.5
"""Predictions are meant to be within this many times of what is measured."""


@dataclass(frozen=True)
class Part:
    """What some knobs add to the error. variance: its mean square about each tile's mean; bias: root mean square of
    these means; of display values, 0..1. source: what it was found by."""

    knobs: tuple[str, ...]
    variance: float
    bias: float
    source: str

    @property
    def rmse(self) -> float:
        """By itself."""
        return math.sqrt(self.variance + self.bias**2)


@dataclass(frozen=True)
class Prediction:
    """The RMSE to expect of a setting, display-referred, 0..1, with bounds at 95 % for what tiles leave open.

    parts: the largest first. missing: what counts and is not in it, in sentences."""

    rmse: Bounds
    parts: tuple[Part, ...]
    missing: tuple[str, ...] = ()

    def facts(self) -> dict[str, Any]:
        """For JSON."""
        parts = [
            {"knobs": part.knobs, "rmse": part.rmse, "bias": part.bias, "from": part.source} for part in self.parts
        ]
        bounds = {"rmse": self.rmse.value, "low": self.rmse.low, "high": self.rmse.high}
        return bounds | {"parts": parts, "missing": self.missing}


def saturated(square: float, variance: float) -> float:
    """The mean square error of light of some variance V, where it would be `square` if light went on as steeply:
    2 V (1 - exp(-square / 2 V)), at most 2 V, as of two pictures that know nothing of one another.

    Measured of mirrors whose normals are off at random: its RMSE is right to 4 % below half of the light's deviation,
    to 7 % above.
    """
    return -2 * variance * math.expm1(-square / (2 * variance)) if variance > 0 else 0.0


def unsaturated(square: float, variance: float) -> float:
    """The other way round; at most 14 times the variance, where nothing is left to tell."""
    share = min(square / (2 * variance), 0.999) if variance > 0 else 0.0
    return -2 * variance * math.log1p(-share)


def combined(parts: Sequence[Part], variance: float) -> float:
    """The mean square error of independent parts on light that varies by `variance`: variances add until they saturate,
    biases add in absolute value."""
    varied = [part.variance for part in parts if part.variance > 0]
    # Of one part alone nothing is assumed.
    total = varied[0] if len(varied) == 1 else saturated(sum(unsaturated(v, variance) for v in varied), variance)
    return max(total, max(varied, default=0.0)) + sum(part.bias for part in parts) ** 2


def factor(measured: float, predicted: float) -> float:
    """How many times one is the other, 1 and above; infinite where one alone is 0."""
    low, high = sorted((measured, predicted))
    return 1.0 if high == 0 else high / low if low > 0 else math.inf


class Model:
    """Predicts the errors of one scene's settings at one size. What it has found of a knob it keeps.

    truth: (H, W, 4) linear, the scene's true picture. base: the setting that apart knobs are turned beside. plan: of a
    quality, as `Renderer.plan` makes it. SceneError for a scene that captures its surroundings: they would be cast anew
    for each setting.
    """

    def __init__(
        self,
        scene: Scene,
        size: tuple[int, int],
        truth: F32,
        base: Quality,
        plan: Callable[[Quality], Plan],
        contents: Contents,
    ) -> None:
        if captured(scene):
            raise SceneError("errors of captured surroundings are not predicted: each setting would cast them anew")
        self.scene, self.size, self._plan, self._contents = scene, size, plan, contents
        self.tiles = tiles(size, COUNT)
        self._base = base
        self._anchor = _exact_but(base, TOGETHER)
        parts = [truth[top : top + height, left : left + width] for left, top, width, height in self.tiles]
        self._truth_linear = np.stack(parts)
        self._truth = self._shown(self._truth_linear)
        self.variance = float(self._truth.var(axis=(0, 1, 2)).mean())
        self._pictures: dict[Quality, F64] = {}
        self._parts: dict[tuple[object, ...], Part] = {}

    def predict(self, quality: Quality) -> Prediction:
        """What error to expect of a setting. Raises what planning it raises."""
        plan = self._plan(quality)
        off = self._seen(_exact_but(quality, TOGETHER)) - self._truth
        together = self._part(TOGETHER, off)
        parts = [together, *(self._apart(knobs, quality, plan) for knobs in APART)]
        total = combined(parts, self.variance)
        # What the rest adds is nearly the same on all tiles.
        rest = total - float(np.mean(off**2))
        squares = np.maximum(np.mean(off**2, axis=(1, 2, 3)) + rest, 0)
        bounds = rmse_bounds(squares) if len(squares) >= 4 else Bounds(math.sqrt(total), 0.0, 1.0)
        shown = sorted((part for part in parts if part.rmse > 0), key=lambda part: -part.rmse)
        return Prediction(bounds._replace(value=math.sqrt(total)), tuple(shown), _missing(plan))

    # ------------------------------------------------------------ parts

    def _apart(self, knobs: tuple[str, ...], quality: Quality, plan: Plan) -> Part:
        values = tuple(getattr(quality, knob) for knob in knobs)
        key = knobs, values, plan.passes if knobs == ("frame_format",) else quality.samples
        if key not in self._parts:
            self._parts[key] = self._found(knobs, quality, plan)
        return self._parts[key]

    def _found(self, knobs: tuple[str, ...], quality: Quality, plan: Plan) -> Part:
        if knobs == ("silhouette",):
            return Part(knobs, self._outlines(quality), 0.0, "outlines, their contrast, and how far off they may lie")
        if knobs == ("frame_format",):
            return self._rounding(plan)
        turned = replace(self._anchor, **{knob: getattr(quality, knob) for knob in knobs})
        if turned == self._anchor or work(self._plan(turned)) == work(self._plan(self._anchor)):
            return Part(knobs, 0.0, 0.0, "nothing here depends on it")
        return self._part(knobs, self._seen(turned) - self._seen(self._anchor))

    def _part(self, knobs: tuple[str, ...], off: F64) -> Part:
        """Of differences on the tiles."""
        bias = float(np.mean(off.mean(axis=(1, 2)) ** 2))
        return Part(knobs, max(float(np.mean(off**2)) - bias, 0.0), math.sqrt(bias), f"float64 on {len(off)} tiles")

    def _rounding(self, plan: Plan) -> Part:
        """Of the frame's format: the truth, kept so as often as it is added to."""
        knobs = ("frame_format",)
        if plan.frame_format != "half":
            return Part(knobs, 0.0, 0.0, "32 bits")
        kept = np.clip(self._truth_linear, -65504, 65504).astype(np.float16).astype(np.float32)
        square = float(np.mean((self._shown(kept) - self._truth) ** 2))
        return Part(knobs, square * plan.passes, 0.0, f"float64 on {len(self._truth)} tiles, rounded")

    def _outlines(self, quality: Quality) -> float:
        """Mean square error of round outlines that are polygons: 8/15 of the square of the height over a side. Samples
        that the outline passes, 2/3 of that height on the mean, are mostly off by themselves already: FLIPPED of them
        count."""
        round_ones = [i for i, s in enumerate(self.scene.surfaces) if isinstance(s.shape, Sphere | Torus)]
        if not round_ones:
            return 0.0
        frames = render_regions(self.scene, self.size, self.tiles, 1, contents=self._contents)
        seen = np.stack([frame.stats["surface"] for frame in frames])
        light = self._shown(np.stack([frame.pixels for frame in frames]))
        contrast = 0.0
        for axis in (1, 2):
            # Their lengths, of sides of pixels, are pi / 4 of them on the mean of directions.
            one, other = (np.take(seen, range(i, seen.shape[axis] - 1 + i), axis) for i in (0, 1))
            edge = (one != other) & (np.isin(one // PIECES, round_ones) | np.isin(other // PIECES, round_ones))
            contrast += math.pi / 4 * float(np.mean(np.diff(light, axis=axis)[edge] ** 2, axis=-1).sum())
        off, n = REACHED * quality.silhouette, quality.samples
        return contrast / seen.size * (8 / 15 * min(off, 1.0) * off + FLIPPED * 2 / 3 * off / n)

    # ------------------------------------------------------------ pictures

    def _seen(self, quality: Quality) -> F64:
        """What the reference shows on the tiles (N, h, w, C), as a display has it."""
        if quality not in self._pictures:
            plan = self._plan(quality)
            scene, contents = _as_planned(self.scene, plan), self._contents
            if quality.environment_layout != "given":
                contents = _Resampled(plan.environments, contents)
            frames = render_regions(scene, self.size, self.tiles, quality.samples, quality=quality, contents=contents)
            self._pictures[quality] = self._shown(np.stack([frame.pixels for frame in frames]))
        return self._pictures[quality]

    def _shown(self, linear: F32) -> F64:
        """(..., 3) display values over black; (..., 4) with alpha where the background is off."""
        colour = srgb_from_linear(np.clip(linear[..., :3].astype(np.float64), 0, 1) * linear[..., 3:])
        opaque = self.scene.environment.background
        return np.asarray(colour if opaque else np.concatenate([colour, linear[..., 3:]], axis=-1), np.float64)


class _Resampled(Contents):
    """What a scene names, with its pictures in the layouts that a plan has them resampled to."""

    def __init__(self, plans: tuple[EnvironmentPlan, ...], contents: Contents) -> None:
        super().__init__()
        self._plans = {plan.environment: plan for plan in plans}
        self._given, self._made = contents, dict[Environment, EnvironmentMap]()

    def environment(self, environment: Environment) -> EnvironmentMap:
        if environment not in self._made:
            plan, picture = self._plans.get(environment), self._given.environment(environment)
            if plan is not None and plan.size is not None and plan.layout is not None:
                picture = resampled(picture, plan.layout, plan.size)
            self._made[environment] = picture
        return self._made[environment]


def _exact_but(quality: Quality, knobs: tuple[str, ...]) -> Quality:
    """The truth's quality, with some knobs of another."""
    return Quality("exact", **{knob: getattr(quality, knob) for knob in knobs})


def _as_planned(scene: Scene, plan: Plan) -> Scene:
    """The scene, whose rooms have walls for those alone that the plan lets see them."""

    def without(environment: Environment, parallax: int) -> Environment:
        return replace(environment, bounds=None) if isinstance(environment, Pictured) and not parallax else environment

    if all(not isinstance(e, Pictured) or e.bounds is None for e in scene.environments):
        return scene
    surfaces = [
        replace(surface, environment=without(scene.environment_of(surface), how.has("PARALLAX")))
        for surface, how in zip(scene.surfaces, plan.surfaces)
    ]
    return replace(scene, surfaces=surfaces, environment=without(scene.environment, plan.sky_parallax))


def _missing(plan: Plan) -> tuple[str, ...]:
    drawn = any(e.gloss is not None and e.gloss.drawn for e in plan.environments)
    return (f"gloss_chain: {MISSING['gloss_chain']}",) if drawn else ()
