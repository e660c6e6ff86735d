"""What one setting of the knobs costs and how far off it is: against the truth, and in turns with a base setting."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt

from glbump.frame import Frame
from glbump.gl.renderer import Renderer
from glbump.gl.targets import read
from glbump.plan import Plan
from glbump.quality import Quality, quality_of
from glbump.scene import Scene
from glbump.trade.errors import errors
from glbump.trade.timing import Spread, in_turns, ratios, spread
from glbump.trade.truth import Truth

F32 = npt.NDArray[np.float32]

LEAST_TURNS, MOST_TURNS = 5, 60
"""Turns are taken until the median is known to CERTAIN or SECONDS are over. Of slow frames there may be two turns."""
CERTAIN, SECONDS = 0.01, 2.0


@dataclass(frozen=True)
class Measured:
    """One setting, measured. error: as errors.FIGURES has it. plan: choices by name. pixels: (H, W, 4) linear.

    cost: ready for JSON; milliseconds, as medians with quartiles where there are several.
    - frame, draw, read: of a frame that stands still: all of it, its drawing until it is finished, its read-back
    - times: a frame's time over the base's in the same turn; cpu: the same of the CPU's time, all threads
    - gpu: of the draw by the GPU's own clock; null where the driver is software. Where it is there, times is of it
    - open, set_up, upload, first_draw: of a first picture in this process, opening the context, reading files and
      planning, compiling and making and uploading maps, the first draw with what drivers leave until then; first: all
    - bytes: of textures and vertices. turns: how many
    """

    quality: Quality
    plan: dict[str, str]
    error: dict[str, float | None]
    cost: dict[str, Any]
    pixels: F32


@dataclass
class _Clock:
    """Milliseconds of each frame."""

    frame: list[float]
    draw: list[float]
    read: list[float]
    gpu: list[float]

    def clear(self) -> None:
        """Forget them."""
        for part in (self.frame, self.draw, self.read, self.gpu):
            part.clear()


class Bench:
    """Measures settings of one scene at one size, all in turns with the same base setting. Use it in a `with`.

    base: what all others are measured beside. truth: of the scene, as `find_truth` finds it; it may be set later.
    """

    def __init__(
        self, scene: Scene, size: tuple[int, int], base: str | Quality = "balanced", backend: str = "auto"
    ) -> None:
        self.scene, self.size, self.base = scene, size, quality_of(base)
        self._backend = backend
        self.renderer = Renderer(backend)
        self.truth: Truth | None = None

    def __enter__(self) -> Bench:
        return self

    def __exit__(self, *_: object) -> None:
        self.renderer.release()

    @property
    def driver(self) -> str:
        """Who draws: the renderer's and the version's string."""
        return self.renderer.context.driver

    @property
    def has_gpu_clock(self) -> bool:
        """Whether draws are timed by timer queries; drivers in software have none that mean anything."""
        return not self.renderer.context.is_software

    def plan(self, quality: Quality, scene: Scene | None = None) -> Plan:
        """What would be drawn."""
        return self.renderer.plan(scene or self.scene, self.size, quality)

    def measure(self, quality: Quality, scene: Scene | None = None, *, turns: int | None = None) -> Measured:
        """One setting, beside the base. scene: another, whose truth is the same. turns: as many as time allows, unless
        given. Raises what `Renderer.render` raises."""
        assert self.truth is not None, "set `truth` first"
        shown = scene or self.scene
        renderer, frame, first = self._first(shown, quality)
        with renderer:
            cost = first | self._steady(renderer, shown, quality, turns) | {"bytes": int(frame.stats["bytes"])}
            pair = self._normals(renderer, shown, quality)
        error = errors(frame, self.truth.pixels, several=self.truth.several, normals=pair)
        return Measured(quality, frame.stats["plan"], error, cost, frame.pixels)

    def _normals(self, renderer: Renderer, scene: Scene, quality: Quality) -> tuple[F32, F32] | None:
        """Those drawn and the true ones, NaN where either is not there."""
        assert self.truth is not None
        true = self.truth.normals
        if true is None:
            return None
        drawn = renderer.render(scene, self.size, quality, show="normal").pixels
        both = np.where((drawn[..., 3:] > 0) & (true[..., 3:] > 0), np.float32(1), np.float32(np.nan))
        return drawn[..., :3] * both, true[..., :3] * both

    def _first(self, scene: Scene, quality: Quality) -> tuple[Renderer, Frame, dict[str, float]]:
        """A new renderer, its first picture, and what that took in milliseconds."""
        marks = [time.perf_counter()]
        renderer = Renderer(self._backend)
        try:
            marks.append(time.perf_counter())
            renderer.plan(scene, self.size, quality)
            marks.append(time.perf_counter())
            drawn = renderer.draw(scene, self.size, quality)
            assert drawn is not None
            renderer.context.gl.finish()
            marks.append(time.perf_counter())
            pixels = read(drawn.frame)
            marks.append(time.perf_counter())
        except BaseException:
            renderer.release()
            raise
        opened, set_up, drew, _ = (1e3 * (b - a) for a, b in pairwise(marks))
        upload = drawn.stats["ms"]["plan and upload"]
        took = {"open": opened, "set_up": set_up, "upload": upload, "first_draw": drew - upload}
        frame = Frame(pixels, drawn.stats, bottom_up=True)
        return renderer, frame, took | {"first": 1e3 * (marks[-1] - marks[0])}

    def _steady(self, renderer: Renderer, scene: Scene, quality: Quality, turns: int | None) -> dict[str, Any]:
        """Frames that stand still, in turns with the base's."""
        clocks = {"base": _Clock([], [], [], []), "this": _Clock([], [], [], [])}
        calls: dict[str, Callable[[], object]] = {
            "base": lambda: self._frame(self.renderer, self.scene, self.base, clocks["base"]),
            "this": lambda: self._frame(renderer, scene, quality, clocks["this"]),
        }
        in_turns(calls, 1, warm_up=0)
        base, this = clocks["base"], clocks["this"]
        for clock in (base, this):
            clock.clear()
        by_gpu, started = self.has_gpu_clock, time.perf_counter()

        def against() -> Spread:
            return ratios(this.gpu, base.gpu) if by_gpu else ratios(this.frame, base.frame)

        def enough() -> bool:
            return turns is None and _is_enough(len(this.frame), against(), time.perf_counter() - started)

        times = in_turns(calls, turns or MOST_TURNS, warm_up=0, enough=enough)
        return {
            "turns": len(this.frame),
            "clock": "GPU timer" if by_gpu else "wall clock",
            "frame": asdict(spread(this.frame)),
            "draw": asdict(spread(this.draw)),
            "read": asdict(spread(this.read)),
            "gpu": asdict(spread(this.gpu)) if by_gpu else None,
            "times": asdict(against()),
            "cpu": asdict(spread([a / max(b, 1e-9) for a, b in zip(times["this"].cpu, times["base"].cpu)])),
        }

    def _frame(self, renderer: Renderer, scene: Scene, quality: Quality, clock: _Clock) -> None:
        """One frame, timed. The drawing is waited for, so that the read-back is none of it."""
        gl = renderer.context.gl
        renderer.context.check("time a frame")
        query = gl.query(time=True) if self.has_gpu_clock else None
        started = time.perf_counter()
        if query is None:
            drawn = renderer.draw(scene, self.size, quality)
        else:
            with query:
                drawn = renderer.draw(scene, self.size, quality)
        assert drawn is not None
        gl.finish()
        finished = time.perf_counter()
        read(drawn.frame)
        over = time.perf_counter()
        if query is not None:
            clock.gpu.append(query.elapsed / 1e6)
        clock.frame.append(1e3 * (over - started))
        clock.draw.append(1e3 * (finished - started))
        clock.read.append(1e3 * (over - finished))


def _is_enough(done: int, against: Spread, seconds: float) -> bool:
    """Whether the median of the turns done is known well enough, or took long enough."""
    if done < LEAST_TURNS:
        return done >= 2 and seconds > 2 * SECONDS
    # The median of n is off by some 0.93 of the distance of the quartiles over root n.
    return 0.93 * (against.high - against.low) / against.median / done**0.5 < CERTAIN or seconds > SECONDS
