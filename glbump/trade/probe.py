"""Settings of one scene at one size, each drawn and timed once: errors against the truth of the whole picture, times
beside a bare frame's in the same turns."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Hashable, Iterable
from dataclasses import dataclass, replace
from typing import Any

from glbump.errors import LimitError
from glbump.gl.renderer import Renderer
from glbump.quality import Quality
from glbump.scene import Scene
from glbump.trade.metrics import compare
from glbump.trade.settings import work
from glbump.trade.timing import in_turns, ratios
from glbump.trade.truth import F32

RESOLVED = 0.25
"""Of a promise, the most that the truth itself may be off by."""
TRUTH_SAMPLES = (36, 64)
"""A pixel: the truth has the second, and the first tell how far off that may be."""
MOST_SAMPLES = 256
"""Of a truth, where a promise asks for more."""
TURNS, SECONDS = 5, 2.0
"""Most turns of a timing, and what ends it sooner."""
FRAMES = 40
"""Of "exact": what probing may take, truth and all."""
LEAST_SECONDS = 60.0
"""What it may take in any case: of a small picture the frames are the least of it, compiling is the most."""

LEVEL_0: dict[str, Any] = {"environment_filter": "bilinear", "bump_filter": "bilinear", "bump_spread": "none"}
"""No footprints: samples alone average."""
BARE = Quality("fast", samples=1, **LEVEL_0)
"""What all are timed beside."""


@dataclass(frozen=True)
class Tried:
    """One setting: its error by the metric, and milliseconds a frame, None where nobody asked."""

    quality: Quality
    error: float
    ms: float | None = None


class Probe:
    """Measures settings. renderers: for what is tried, and for what it is timed beside, so that each keeps what it
    prepared. known: what was measured before, as Remembered.read gives it. step: called with what is being done."""

    def __init__(
        self,
        renderers: tuple[Renderer, Renderer],
        scene: Scene,
        size: tuple[int, int],
        metric: str,
        known: dict[str, Any],
        step: Callable[[str], None],
    ) -> None:
        self.renderer, self._beside = renderers
        self.scene, self.size, self.metric, self.step = scene, size, metric, step
        self.noise: float = known.get("noise", 0.0)
        rows: Iterable[dict[str, Any]] = known.get("rows", ())
        self._tried: dict[Hashable, Tried] = {self._work(row["quality"]): Tried(**row) for row in rows}
        self._truth: F32 | None = None
        self._bare_seconds = math.inf
        self._late = math.inf

    @property
    def tried(self) -> tuple[Tried, ...]:
        """All that was measured, in order."""
        return tuple(self._tried.values())

    @property
    def is_late(self) -> bool:
        """Whether it has taken as long as it may."""
        return time.perf_counter() > self._late

    def measure(self, quality: Quality) -> Tried | None:
        """A setting's error; None where this driver cannot draw it."""
        does = self._work(quality)
        if does not in self._tried:
            truth = self._found_truth()
            self.step(f"{quality.samples} samples, {quality.environment_filter}, {quality.bump_filter} bumps")
            try:
                picture = self.renderer.render(self.scene, self.size, quality).pixels
            except LimitError:
                return None
            self._tried[does] = Tried(quality, self.error(picture, truth))
        return self._tried[does]

    def timed(self, tried: Tried) -> Tried:
        """With its time."""
        does = self._work(tried.quality)
        if self._tried[does].ms is None:
            self._tried[does] = replace(tried, ms=self.ms(tried.quality))
        return self._tried[does]

    def ms(self, quality: Quality) -> float:
        """Of a frame that stands still, in turns with a bare one's, so that a busy minute tells no lies."""
        self._beside.render(self.scene, self.size, BARE)
        self.renderer.render(self.scene, self.size, quality)
        started = time.perf_counter()
        times = in_turns(
            {
                "bare": lambda: self._beside.render(self.scene, self.size, BARE),
                "this": lambda: self.renderer.render(self.scene, self.size, quality),
            },
            TURNS,
            warm_up=0,
            enough=lambda: time.perf_counter() - started > SECONDS,
        )
        self._bare_seconds = min(self._bare_seconds, *times["bare"].wall)
        return 1e3 * self._bare_seconds * ratios(times["this"].wall, times["bare"].wall).median

    def require_resolved(self, budget: float) -> None:
        """LimitError where the truth may itself be off by too much of `budget`; more samples are tried first."""
        if not self._tried or self.noise > RESOLVED * budget:
            truth = self._found_truth()
            if self.noise > RESOLVED * budget:
                finest = self._exact(MOST_SAMPLES)
                self.noise = self.error(truth, finest) * TRUTH_SAMPLES[1] / MOST_SAMPLES
                self._truth = finest
        if self.noise > RESOLVED * budget:
            raise LimitError(
                f"max_error {self.shown(budget)} is below what the truth resolves: it may itself be off by "
                f"{self.shown(self.noise)} for want of samples; allow at least {self.shown(self.noise / RESOLVED)}"
            )

    def error_from(self, view: Scene, quality: Quality) -> float:
        """Of the scene as another camera sees it."""
        truth = self.renderer.render(view, self.size, Quality("exact", samples=TRUTH_SAMPLES[1])).pixels
        return self.error(self.renderer.render(view, self.size, quality).pixels, truth)

    def error(self, got: F32, truth: F32) -> float:
        """By the metric."""
        return float(compare(got, truth, perceptual=self.metric == "flip")[self.metric])

    def shown(self, error: float) -> str:
        """As a message has it."""
        return f"{error:.3g}" if self.metric == "flip" else f"{255 * error:.3g}/255"

    def _work(self, quality: Quality) -> Hashable:
        return work(self.renderer.plan(self.scene, self.size, quality))

    def _found_truth(self) -> F32:
        """The scene's picture at "exact" with many samples; what is measured first looks for it."""
        if self._truth is None:
            self.step("truth")
            self.renderer.render(self.scene, self.size, "exact")
            started = time.perf_counter()
            self.renderer.render(self.scene, self.size, "exact")
            self._late = started + max(FRAMES * (time.perf_counter() - started), LEAST_SECONDS)
            fewer, more = (self._exact(n) for n in TRUTH_SAMPLES)
            # Each is off by its own share of what they differ by, and the more samples, the less.
            self.noise = self.error(fewer, more) * TRUTH_SAMPLES[0] / TRUTH_SAMPLES[1]
            self._truth = more
        return self._truth

    def _exact(self, samples: int) -> F32:
        return self.renderer.render(self.scene, self.size, Quality("exact", samples=samples)).pixels
