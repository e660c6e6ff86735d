"""The cheapest setting that keeps a promise, or the nearest to the truth within a time; measured on this machine.

Knobs are not independent (levels help one sample a pixel, and not sixteen), and most of what a search takes is
compiling, so few programs are tried, with many numbers of samples: without levels, until there are enough; then with
levels and fewer samples, where one sample gave hope; then each of the other knobs is turned. What was chosen is looked
at from where it was not chosen.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np

from glbump import validate as check
from glbump.camera import Camera
from glbump.errors import LimitError, SceneError
from glbump.gl.renderer import Renderer
from glbump.quality import KNOBS, PRESETS, Quality
from glbump.scene import Scene, check_size
from glbump.trade.probe import BARE, FRAMES, LEVEL_0, Probe, Tried
from glbump.trade.remembered import Remembered

METRICS = ("rmse", "p99", "max", "flip")
SAMPLES = (1, 4, 9, 16, 25, 36, 64)
"""A pixel, from the cheapest on."""
LEVELS: tuple[dict[str, Any], ...] = (
    {"environment_filter": "trilinear", "bump_filter": "trilinear"},
    {"environment_filter": "trilinear"},
    {"bump_filter": "trilinear"},
    {"environment_filter": "trilinear", "bump_filter": "trilinear", "bump_spread": "lean"},
    {"bump_filter": "trilinear", "bump_spread": "lean"},
)
"""How footprints may be averaged, in place of LEVEL_0."""
TURNED = ("silhouette", "environment_filter", "environment_level", "bump_filter", "bump_spread", "lobe_samples")
"""Knobs of which each value is tried in the end; of the others those that presets have."""
_PRESET_VALUES = {name: {preset[name] for preset in PRESETS.values()} for name in KNOBS}
MARGIN = 0.97
"""Of the promise: what a setting is held to, so that the last digits of a truth do not break it."""
HOPEFUL, HOPEFUL_TIME = 0.8, 1.1
"""What is hoped of more samples: of the gain that they bring without levels, the error; of their time."""
ALIKE = 1.02
"""Of the least error: what counts as no more."""
CHEAPER = 0.95
"""Of a time or an error: what must be less to count as less."""
ENDED = f"the search ended after {FRAMES} frames of exact; more may be gained"


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
        found, driver = remembered or Remembered(), renderer.context.driver
        key = found.key(scene, size, metric, driver)
        known = found.read(key)
        probe = Probe((renderer, beside), scene, size, metric, known, step)
        search = _Search(probe, driver, known.get("chosen", {}), partial(found.write, key))
        if max_error is not None:
            return search.chosen(f"max_error {max_error!r}", lambda: search.within_error(max_error))
        assert max_ms is not None
        return search.chosen(f"max_ms {max_ms!r}", lambda: search.within_time(max_ms))


class _Search:
    """Looks for the setting that a promise asks for. before: what was chosen by promise, and write: keeps rows, the
    truth's noise and that, as Remembered has them."""

    def __init__(
        self,
        probe: Probe,
        driver: str,
        before: dict[str, Any],
        write: Callable[[list[dict[str, Any]], float, dict[str, Any]], None],
    ) -> None:
        self.probe, self.driver = probe, driver
        self.notes: list[str] = []
        self._chosen, self._write = before, write

    def chosen(self, promise: str, search: Callable[[], Tuned]) -> Tuned:
        """What was chosen for the same promise before, timed anew; else what `search` finds, which is remembered."""
        before, probe = self._chosen.get(promise), self.probe
        if before is not None:
            known = next((t for t in probe.tried if asdict(t.quality) == before["quality"]), None)
            if known is not None:
                probe.step("remembered")
                self.notes += before["notes"]
                best = replace(known, ms=probe.ms(known.quality))
                return self._result(best, tuple(before["views"]), remembered=True)
        result = search()
        found = {"quality": asdict(result.quality), "views": list(result.views), "notes": list(result.notes)}
        rows = [{"quality": t.quality, "error": t.error, "ms": t.ms} for t in probe.tried]
        self._write(rows, probe.noise, self._chosen | {promise: found})
        return result

    # ------------------------------------------------------------ what is asked

    def within_error(self, budget: float) -> Tuned:
        """The cheapest setting whose error is at most `budget`."""
        probe = self.probe
        probe.require_resolved(budget)

        def keeps(t: Tried) -> bool:
            return t.error <= MARGIN * budget

        steps = self._climb(lambda _: True, keeps)
        if not keeps(steps[-1]):
            nearest = min(probe.tried, key=lambda t: t.error)
            width, height = probe.size
            raise LimitError(
                f"no setting keeps {probe.shown(budget)} at {width}x{height}: the nearest that was tried, "
                f"{nearest.quality.samples} samples a pixel, is off by {probe.shown(nearest.error)}; "
                "allow that much, or draw a larger picture and shrink it"
            )
        # Of settings with levels, those with the fewest samples that do; more samples cost more.
        singles, found = self._with_levels(steps) if len(steps) > 1 else [], [steps[-1]]
        for step in steps[:-1]:
            gain = HOPEFUL * step.error / steps[0].error
            hopeful = [t for t in singles if t.error * gain <= budget and not self._is_late()]
            found += [t for single in hopeful if keeps(t := self._measured(single, step))]
            if len(found) > 1:
                break
        best = min((probe.timed(t) for t in found), key=_ms)
        return self._held_out(self._turned(best, keeps, _ms, cheaper=True), budget)

    def within_time(self, budget: float) -> Tuned:
        """The setting with the least error that takes at most `budget` milliseconds a frame."""
        probe = self.probe

        def keeps(t: Tried) -> bool:
            return _ms(probe.timed(t)) <= budget

        steps = self._climb(keeps, lambda _: False)
        if not steps:
            bare, (width, height) = probe.measure(BARE), probe.size
            takes = f"{_ms(probe.timed(bare)):.3g} ms" if bare is not None else "more memory than there is"
            raise LimitError(
                f"a bare draw of this scene at {width}x{height} takes {takes} here, and {budget:g} ms are "
                "allowed; allow more, or draw a smaller picture"
            )
        for single in self._with_levels(steps):
            if self._is_late():
                break
            # As many samples as there is time for; a few more take about as much longer as without levels.
            longer = _ms(probe.timed(single)) / _ms(probe.timed(steps[0]))
            for step in reversed(steps):
                is_hopeful = longer * _ms(probe.timed(step)) <= HOPEFUL_TIME * budget
                if is_hopeful and keeps(self._measured(single, step)):
                    break
        best = min((t for t in probe.tried if t.ms is not None and t.ms <= budget), key=_error)
        return self._held_out(self._turned(best, keeps, _error, cheaper=False), None)

    # ------------------------------------------------------------ where to look

    def _climb(self, allowed: Callable[[Tried], bool], enough: Callable[[Tried], bool]) -> list[Tried]:
        """Without levels, more samples from step to step, until it is `enough` or no more `allowed`; of the presets'
        other knobs those that are enough and take the least time, or else that come nearest to the truth."""
        steps: list[Tried] = []
        for samples in SAMPLES:
            drawn = [self.probe.measure(Quality(preset, samples=samples, **LEVEL_0)) for preset in PRESETS]
            found = [t for t in drawn if t is not None and allowed(t)]
            if not found:
                break
            done = [self.probe.timed(t) for t in found if enough(t)]
            steps.append(min(done, key=_ms) if done else min(found, key=_error))
            if done:
                break
        return steps

    def _with_levels(self, steps: Sequence[Tried]) -> list[Tried]:
        """One sample a pixel, footprints averaged in one way or another: those that help. The first way by each
        preset's other knobs, and the others by the cheapest of these that are as good as the best."""
        found: list[Tried] = []
        presets = list(PRESETS)
        for changes in LEVELS:
            for preset in presets:
                if self._is_late():
                    return found
                tried = self.probe.measure(Quality(preset, samples=1, **LEVEL_0 | changes))
                if tried is not None and tried.error < steps[0].error and tried not in found:
                    found.append(tried)
            if len(presets) > 1:
                seen = found or steps[-1:]
                most = ALIKE * min(map(_error, seen))
                presets = [min((self.probe.timed(t) for t in seen if t.error <= most), key=_ms).quality.preset]
        return found

    def _measured(self, single: Tried, step: Tried) -> Tried:
        """What one sample showed, with as many as a step has; the step itself where this driver cannot draw it."""
        return self.probe.measure(replace(single.quality, samples=step.quality.samples)) or step

    def _turned(
        self, best: Tried, keeps: Callable[[Tried], bool], cost: Callable[[Tried], float], *, cheaper: bool
    ) -> Tried:
        """`best`, with each other knob turned to where `cost` is less and the promise holds: towards what is cheaper,
        or towards the truth."""
        for name, knob in KNOBS.items():
            if name == "samples":
                continue
            tried_by = knob.values if name in TURNED else [v for v in knob.values if v in _PRESET_VALUES[name]]
            for value in tried_by if cheaper else reversed(tried_by):
                now = getattr(best.quality, name)
                if now == value or (name != "environment_layout" and _is_after(knob.values, value, now) is cheaper):
                    continue
                if self._is_late():
                    return best
                tried = self.probe.measure(replace(best.quality, **{name: value}))
                if tried is not None and keeps(tried) and cost(self.probe.timed(tried)) < CHEAPER * cost(best):
                    best = self.probe.timed(tried)
                    break  # What is beyond costs more, or is farther from the truth.
        return best

    def _is_late(self) -> bool:
        late = self.probe.is_late
        if late and ENDED not in self.notes:
            self.notes.append(ENDED)
        return late

    # ------------------------------------------------------------ evidence

    def _held_out(self, best: Tried, budget: float | None) -> Tuned:
        """The result, looked at from other views."""
        probe = self.probe
        probe.step("other views")
        errors = tuple(probe.error_from(view, best.quality) for view in other_views(probe.scene))
        if budget is not None and max(errors) > budget:
            self.notes.append(
                f"from another view the error is {probe.shown(max(errors))}: the promise is kept where it was tuned, "
                f"and not there; ask for {probe.shown(budget**2 / max(errors))}, or tune for that view"
            )
        return self._result(best, errors, remembered=False)

    def _result(self, best: Tried, views: tuple[float, ...], *, remembered: bool) -> Tuned:
        probe = self.probe
        return Tuned(
            quality=best.quality,
            error=best.error,
            ms=_ms(best),
            metric=probe.metric,
            views=views,
            noise=probe.noise,
            driver=self.driver,
            remembered=remembered,
            tried=probe.tried,
            notes=tuple(self.notes),
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


def _ms(tried: Tried) -> float:
    assert tried.ms is not None, "not timed"
    return tried.ms


def _error(tried: Tried) -> float:
    return tried.error


def _is_after(values: Sequence[Any], value: Any, other: Any) -> bool:
    return values.index(value) > values.index(other)
