"""The cheapest setting that keeps a promise, or the nearest to the truth within a time; measured on this machine.

Knobs are not independent (levels help one sample a pixel, and not sixteen), so no model chooses here. How often a
picture is sampled, and how footprints are averaged, is tried outright, from few samples on; then each of the other
knobs is turned down where the promise still holds. Every error is measured against the truth of the whole picture,
every time beside a bare frame's in the same turns. What was chosen is looked at from where it was not chosen.
"""

from __future__ import annotations

import itertools
import math
import time
from collections.abc import Callable, Hashable, Iterator
from dataclasses import asdict, dataclass, field, replace
from typing import Any

import numpy as np

from glbump import validate as check
from glbump.camera import Camera
from glbump.errors import LimitError, SceneError
from glbump.gl.renderer import Renderer
from glbump.quality import KNOBS, PRESETS, Quality
from glbump.scene import Scene, check_size
from glbump.trade.metrics import compare
from glbump.trade.remembered import Remembered
from glbump.trade.settings import work
from glbump.trade.timing import in_turns, ratios
from glbump.trade.truth import F32

METRICS = ("rmse", "p99", "max", "flip")
SAMPLES = (1, 4, 9, 16, 25, 36, 64)
"""A pixel, from the cheapest on."""
SAMPLING: dict[str, tuple[Any, ...]] = {
    "environment_filter": ("bilinear", "nearest-level", "trilinear"),
    "environment_level": ("longest", "area"),
    "bump_filter": ("bilinear", "nearest-level", "trilinear"),
    "bump_spread": ("none", "lean"),
}
"""What is tried with each number of samples: how footprints are averaged."""
MARGIN = 0.97
"""Of the promise: what a setting is held to, so that the last digits of a truth do not break it."""
RESOLVED = 0.25
"""Of the promise, the most that the truth itself may be off by."""
CHEAPER = 0.98
"""Of a time: what must be less to count as less."""
TURNS = 3
TRUTH_SAMPLES = (36, 64)
"""A pixel: the truth has the second, and the first tell how far off that may be."""
MOST_SAMPLES = 256
"""Of a truth, where a promise asks for more."""
FRAMES = 40
"""Of "exact": what a search may take, truth and all; what is best by then is taken, and looked at from elsewhere."""
LEAST_SECONDS = 10.0
"""What a search may take in any case: of a small picture the frames are the least of it."""


@dataclass(frozen=True)
class Tried:
    """One setting, measured: error by the metric, milliseconds a frame."""

    quality: Quality
    error: float
    ms: float


@dataclass(frozen=True)
class Tuned:
    """What was chosen, and the evidence.

    error, ms: of the scene's own view. views: errors from views that nothing was chosen by. noise: what the truth may
    itself be off by, by the same metric. tried: all that was measured, in order.
    notes: what is to be known, in sentences.
    """

    quality: Quality
    error: float
    ms: float
    metric: str
    views: tuple[float, ...]
    noise: float
    driver: str
    remembered: bool
    tried: tuple[Tried, ...] = field(repr=False)
    notes: tuple[str, ...] = ()

    @property
    def changes(self) -> dict[str, Any]:
        """The knobs that differ from their preset's."""
        preset = PRESETS[self.quality.preset]
        return {name: value for name, value in asdict(self.quality).items() if value != preset.get(name, value)}


def tune(
    scene: Scene,
    *,
    max_error: float | None = None,
    max_ms: float | None = None,
    size: tuple[int, int] = (1024, 1024),
    metric: str = "rmse",
    backend: str = "auto",
) -> Quality:
    """The cheapest Quality whose error is at most `max_error`, or the nearest to the truth that takes `max_ms` a frame.

    max_error: by `metric`, of display values 0..1 over the whole frame (RMSE unless told otherwise). Raises SceneError
    for a wrong call, LimitError where no setting keeps the promise, or the truth cannot tell; and as `render`.
    """
    return tuned(scene, max_error=max_error, max_ms=max_ms, size=size, metric=metric, backend=backend).quality


def tuned(
    scene: Scene,
    *,
    max_error: float | None = None,
    max_ms: float | None = None,
    size: tuple[int, int] = (1024, 1024),
    metric: str = "rmse",
    backend: str = "auto",
    remembered: Remembered | None = None,
    step: Callable[[str], None] = lambda _: None,
) -> Tuned:
    """As `tune`, with the evidence. remembered: what earlier runs found, the user's own unless given; step: called with
    what is being done."""
    check.instance("scene", scene, Scene)
    size = check_size(size)
    check.choice("metric", metric, METRICS)
    if (max_error is None) == (max_ms is None):
        raise SceneError("tune wants one of max_error and max_ms; give an error to keep, or a time")
    if max_error is not None:
        # Of display values, which end at 1.
        max_error = check.number("max_error", max_error, above=0, most=1)
    if max_ms is not None:
        max_ms = check.number("max_ms", max_ms, above=0, most=1e6)
    with Renderer(backend) as renderer, Renderer(context=renderer.context) as beside:
        search = _Search((renderer, beside), scene, size, metric, remembered or Remembered(), step)
        if max_error is not None:
            return search.chosen(f"max_error {max_error!r}", lambda: search.within_error(max_error))
        assert max_ms is not None
        return search.chosen(f"max_ms {max_ms!r}", lambda: search.within_time(max_ms))


class _Search:
    """Settings of one scene at one size, each measured once. renderers: for what is tried, and for what it is timed
    beside, so that each keeps what it prepared."""

    def __init__(
        self,
        renderers: tuple[Renderer, Renderer],
        scene: Scene,
        size: tuple[int, int],
        metric: str,
        remembered: Remembered,
        step: Callable[[str], None],
    ) -> None:
        self.renderer, self.beside = renderers
        self.scene, self.size, self.metric, self.step = scene, size, metric, step
        info = self.renderer.context.info
        self.driver = f"{info['renderer']}, {info['version']}"
        self.bare = Quality("fast", environment_filter="bilinear", bump_filter="bilinear")
        self.notes: list[str] = []
        self.tried: dict[Hashable, Tried] = {}
        self._remembered, self._key = remembered, remembered.key(scene, size, metric, self.driver)
        known = remembered.read(self._key)
        self.noise: float = known.get("noise", 0.0)
        self._chosen: dict[str, Any] = known.get("chosen", {})
        for row in known.get("rows", ()):
            self.tried[self._work(row["quality"])] = Tried(**row)
        self._truth: F32 | None = None
        self._bare_seconds = math.inf
        self._late = math.inf

    def chosen(self, promise: str, search: Callable[[], Tuned]) -> Tuned:
        """What was chosen for the same promise before, timed anew; else what `search` finds, which is remembered."""
        before = self._chosen.get(promise)
        if before is not None:
            known = next((t for t in self.tried.values() if asdict(t.quality) == before["quality"]), None)
            if known is not None:
                self.step("remembered")
                self.notes += before["notes"]
                self.renderer.render(self.scene, self.size, known.quality)
                best = replace(known, ms=self._ms(known.quality))
                return self._result(best, tuple(before["views"]), remembered=True)
        result = search()
        found = {"quality": asdict(result.quality), "views": list(result.views), "notes": list(result.notes)}
        rows = [{"quality": t.quality, "error": t.error, "ms": t.ms} for t in self.tried.values()]
        self._remembered.write(self._key, rows, self.noise, self._chosen | {promise: found})
        return result

    # ------------------------------------------------------------ what is asked

    def within_error(self, budget: float) -> Tuned:
        """The cheapest setting whose error is at most `budget`."""
        self._require_resolved(budget)

        def keeps(t: Tried) -> bool:
            return t.error <= MARGIN * budget

        best: Tried | None = None
        for samples in SAMPLES:
            found = [t for q in self._with_samples(samples) if (t := self._measure(q)) is not None and keeps(t)]
            best = min(found, key=lambda t: t.ms, default=None)
            if best is not None:
                break
        if best is None:
            nearest = min(self.tried.values(), key=lambda t: t.error)
            raise LimitError(
                f"no setting keeps {self._shown(budget)} at {self.size[0]}x{self.size[1]}: the nearest that was tried, "
                f"{nearest.quality.samples} samples a pixel, is off by {self._shown(nearest.error)}; "
                "allow that much, or draw a larger picture and shrink it"
            )
        best = self._turned(best, keeps, lambda t: t.ms, cheaper=True)
        return self._held_out(best, budget)

    def within_time(self, budget: float) -> Tuned:
        """The setting with the least error that takes at most `budget` milliseconds a frame."""

        def keeps(t: Tried) -> bool:
            return t.ms <= budget

        best = self._measure(self.bare)
        if best is None or not keeps(best):
            takes = f"{best.ms:.3g} ms" if best is not None else "more memory than there is"
            raise LimitError(
                f"a bare draw of this scene at {self.size[0]}x{self.size[1]} takes {takes} here, and {budget:g} ms are "
                "allowed; allow more, or draw a smaller picture"
            )
        for samples in SAMPLES:
            found = [t for q in self._with_samples(samples) if (t := self._measure(q)) is not None and keeps(t)]
            best = min([best, *found], key=lambda t: t.error)
            if not found or self._is_late():
                break
        best = self._turned(best, keeps, lambda t: t.error, cheaper=False)
        return self._held_out(best, None)

    # ------------------------------------------------------------ where to look

    def _with_samples(self, samples: int) -> Iterator[Quality]:
        """Settings with so many samples, of each preset otherwise, that differ in what is drawn."""
        if self._is_late():
            yield Quality("exact", samples=samples)
            return
        seen: set[Hashable] = set()
        knobs = {name: values for name, values in SAMPLING.items() if name in KNOBS}
        for preset in PRESETS:
            for values in itertools.product(*knobs.values()):
                changes = dict(zip(knobs, values))
                if changes["environment_filter"] == "bilinear" and changes["environment_level"] == "longest":
                    continue  # without levels there is nothing to choose
                if samples >= 16 and changes["environment_filter"] != "bilinear":
                    continue  # so many average better by themselves
                quality = Quality(preset, samples=samples, **changes)
                does = self._work(quality)
                if does not in seen:
                    seen.add(does)
                    yield quality

    def _turned(
        self, best: Tried, keeps: Callable[[Tried], bool], cost: Callable[[Tried], float], *, cheaper: bool
    ) -> Tried:
        """`best`, with each other knob turned to where `cost` is less and the promise holds: towards what is cheaper,
        or towards the truth."""
        for name, knob in KNOBS.items():
            now = getattr(best.quality, name)
            if name in SAMPLING or name == "samples" or now not in knob.values:
                continue
            at = knob.values.index(now)
            for value in knob.values[:at] if cheaper else knob.values[at + 1 :]:
                if self._is_late():
                    self.notes.append(f"the search ended after {FRAMES} frames of exact; more may be gained")
                    return best
                tried = self._measure(replace(best.quality, **{name: value}))
                if tried is not None and keeps(tried) and cost(tried) < CHEAPER * cost(best):
                    best = tried
        return best

    def _is_late(self) -> bool:
        return time.perf_counter() > self._late

    # ------------------------------------------------------------ measuring

    def _work(self, quality: Quality) -> Hashable:
        return work(self.renderer.plan(self.scene, self.size, quality))

    def _measure(self, quality: Quality) -> Tried | None:
        """A setting's error and time; None where this driver cannot draw it."""
        does = self._work(quality)
        if does not in self.tried:
            truth = self._found_truth()
            self.step(f"{quality.samples} samples, {quality.environment_filter}")
            try:
                picture = self.renderer.render(self.scene, self.size, quality).pixels
            except LimitError:
                return None
            self.tried[does] = Tried(quality, self._error(picture, truth), self._ms(quality))
        return self.tried[does]

    def _ms(self, quality: Quality) -> float:
        """Of a frame that stands still, in turns with a bare one's, so that a busy minute tells no lies."""
        times = in_turns(
            {
                "bare": lambda: self.beside.render(self.scene, self.size, self.bare),
                "this": lambda: self.renderer.render(self.scene, self.size, quality),
            },
            TURNS,
            warm_up=0,
        )
        self._bare_seconds = min(self._bare_seconds, *times["bare"].wall)
        return 1e3 * self._bare_seconds * ratios(times["this"].wall, times["bare"].wall).median

    def _found_truth(self) -> F32:
        """The scene's picture at "exact" with many samples; what is measured first looks for it."""
        if self._truth is None:
            self.step("truth")
            self.beside.render(self.scene, self.size, self.bare)
            self.renderer.render(self.scene, self.size, "exact")
            started = time.perf_counter()
            self.renderer.render(self.scene, self.size, "exact")
            self._late = started + max(FRAMES * (time.perf_counter() - started), LEAST_SECONDS)
            fewer, more = (self._exact(n) for n in TRUTH_SAMPLES)
            # Each is off by its own share of what they differ by, and the more samples, the less.
            self.noise = self._error(fewer, more) * TRUTH_SAMPLES[0] / TRUTH_SAMPLES[1]
            self._truth = more
        return self._truth

    def _require_resolved(self, budget: float) -> None:
        """LimitError where the truth may itself be off by too much of `budget`; more samples are tried first."""
        if not self.tried:
            self._found_truth()
        if self.noise > RESOLVED * budget and self._truth is not None:
            finest = self._exact(MOST_SAMPLES)
            self.noise = self._error(self._truth, finest) * TRUTH_SAMPLES[1] / MOST_SAMPLES
            self._truth = finest
        if self.noise > RESOLVED * budget:
            raise LimitError(
                f"max_error {self._shown(budget)} is below what the truth resolves: it may itself be off by "
                f"{self._shown(self.noise)} for want of samples; allow at least {self._shown(self.noise / RESOLVED)}"
            )

    def _exact(self, samples: int) -> F32:
        return self.renderer.render(self.scene, self.size, Quality("exact", samples=samples)).pixels

    def _error(self, got: F32, truth: F32) -> float:
        return float(compare(got, truth, perceptual=self.metric == "flip")[self.metric])

    def _shown(self, error: float) -> str:
        return f"{error:.3g}" if self.metric == "flip" else f"{255 * error:.3g}/255"

    # ------------------------------------------------------------ evidence

    def _held_out(self, best: Tried, budget: float | None) -> Tuned:
        """The result, looked at from other views."""
        self.step("other views")
        errors = []
        for view in other_views(self.scene):
            truth = self.renderer.render(view, self.size, Quality("exact", samples=TRUTH_SAMPLES[1])).pixels
            errors.append(self._error(self.renderer.render(view, self.size, best.quality).pixels, truth))
        if budget is not None and max(errors) > budget:
            self.notes.append(
                f"from another view the error is {self._shown(max(errors))}: the promise is kept where it was tuned, "
                f"and not there; ask for {self._shown(budget**2 / max(errors))}, or tune for that view"
            )
        return self._result(best, tuple(errors), remembered=False)

    def _result(self, best: Tried, views: tuple[float, ...], *, remembered: bool) -> Tuned:
        return Tuned(
            best.quality,
            best.error,
            best.ms,
            self.metric,
            views,
            self.noise,
            self.driver,
            remembered,
            tuple(self.tried.values()),
            tuple(self.notes),
        )


def other_views(scene: Scene) -> list[Scene]:
    """The scene from two other places, as far from what is looked at: a little to the left and lower, and more to the
    right and higher."""
    camera: Camera = scene.camera
    eye, target = np.asarray(camera.eye, np.float64), np.asarray(camera.target, np.float64)
    up = np.asarray(camera.up, np.float64)
    views = []
    for across, rise in ((-0.3, -0.1), (0.7, 0.25)):
        away = eye - target
        right = np.cross(up, away)
        right /= max(float(np.linalg.norm(right)), 1e-12)
        distance = float(np.linalg.norm(away))
        moved = away + distance * (across * right + rise * up / np.linalg.norm(up))
        moved *= distance / np.linalg.norm(moved)
        views.append(replace(scene, camera=replace(camera, eye=tuple((target + moved).tolist()))))
    return views
