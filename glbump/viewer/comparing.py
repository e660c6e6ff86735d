"""The chosen quality beside a second one: a preset, or the truth, of more and more samples while nothing moves."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from glbump.gl.targets import read
from glbump.maps.colour import eight_bit, tone_map
from glbump.quality import PRESETS, quality_of
from glbump.shown import ramp

if TYPE_CHECKING:
    from glbump.gl.prepared import Drawn
    from glbump.viewer.showing import Showing
    from glbump.viewer.stage import Stage

SAMPLES = (4, 16, 64)
"""Of the truth and of the reference, a pixel: one picture after the other."""
FULL = 16.0
"""Difference on the screen, in 1/255, that the heat map shows palest."""
OFF, WIPE, FLICKER, HEAT = "", "split", "flicker", "heat map"
WAYS = (OFF, WIPE, FLICKER, HEAT)
TRUTH = "the truth"
SECONDS = (TRUTH, *PRESETS)
"""What the picture can be held against."""
PERIOD = 0.5
"""Seconds from one flip to the next, while it flickers."""

Bytes = npt.NDArray[np.uint8]
Light = npt.NDArray[np.floating[Any]]


class Comparison:
    """How the picture is held against a second one: one of WAYS, and of SECONDS.

    picture: the second one, or None until there is one of what is shown; flipped: whether it is its turn, while it
    flickers; figures: how far apart the two are, in words; heat: (H, W, 4) bytes, a map of that. Both are of what the
    screen shows: exposure, tone curve, sRGB.
    """

    def __init__(self) -> None:
        self.way, self.second = OFF, TRUTH
        self._version, self._samples, self._flips_at = -1, 0, 0.0
        self._forget()

    def _forget(self) -> None:
        self._samples, self.flipped = 0, False
        self.picture: Drawn | None = None
        self.figures = ""
        self.heat: Bytes | None = None
        self._pair: tuple[Light, Light] | None = None
        self._measured: tuple[str, float] | None = None

    def choose(self, way: str, second: str) -> None:
        """Another way, or another second picture."""
        if second != self.second:
            self._forget()
        self.way, self.second, self.flipped = way, second, False

    def begin(self, version: int) -> None:
        """Forget what was of another version."""
        if version != self._version:
            self._version = version
            self._forget()

    # ------------------------------------------------------------ what is due

    @property
    def next_samples(self) -> int | None:
        """Of the next second picture to draw; None where there is none, or nothing is compared."""
        wanted = SAMPLES if self.second == TRUTH else (quality_of(self.second).samples,)
        finer = (samples for samples in wanted if samples > self._samples)
        return next(finer, None) if self.way else None

    def is_due(self, tone: str, exposure: float) -> bool:
        """Whether there is something to draw or to measure, for a screen with that tone curve and exposure."""
        stale = self._pair is not None and self._measured != (tone, exposure)
        return bool(self.way) and (stale or self.next_samples is not None)

    def carry_on(self, shown: Showing, stage: Stage, stop: Callable[[], bool]) -> bool:
        """Draw the next second picture where there is one, and hold the picture against it; False where `stop` gave it
        up. ImageError where a pixel is not a number."""
        samples = self.next_samples
        if samples is not None:
            assert stage.picture is not None
            second, size = self.second, stage.picture.frame.size
            quality = replace(quality_of("exact" if second == TRUTH else second), samples=samples)

            def stops() -> bool:
                return stop() or self.second != second or not self.way

            picture = None
            try:
                picture = stage.renderer.draw(shown.scene, size, quality, use="second", stop=stops)
            finally:
                if picture is None:
                    # What it was drawn in may be half drawn over, or gone.
                    self._forget()
            if picture is None:
                return False
            self.picture, self._samples = picture, samples
            self._pair = read(stage.picture.frame)[::-1], read(picture.frame)[::-1]
        self._measure(shown.tone, shown.exposure)
        return True

    def _measure(self, tone: str, exposure: float) -> None:
        from glbump.trade.metrics import difference_picture  # of no use before the first picture, as below

        assert self._pair is not None
        ours, second = (on_screen(light, tone, exposure) for light in self._pair)
        name = f"{TRUTH}: exact" if self.second == TRUTH else self.second
        self.figures = f"{apart(ours, second)}; {name}, {self._samples} sample{'s' if self._samples > 1 else ''}"
        off = ramp(difference_picture(ours, second, 255 / FULL).max(axis=-1))
        self.heat = np.concatenate([eight_bit(off), np.full((*off.shape[:2], 1), 255, np.uint8)], axis=-1)
        self._measured = tone, exposure

    # ------------------------------------------------------------ flicker

    def flip(self, now: float) -> bool:
        """Show the other of the two where it is its turn, and whether it was."""
        if self.until_flip(now) > 0:
            return False
        self.flipped, self._flips_at = not self.flipped, now + PERIOD
        return True

    def until_flip(self, now: float) -> float:
        """Seconds until the next flip; infinite where nothing flickers."""
        return max(0.0, self._flips_at - now) if self.way == FLICKER and self.picture is not None else np.inf


@lru_cache(maxsize=4)
def legend(width: int, height: int) -> Bytes:
    """(height, width, 4) bytes: the heat map's colours, from no difference to FULL, in a frame."""
    colours = np.full((height, width, 4), 255, np.uint8)
    colours[1:-1, 1:-1, :3] = eight_bit(ramp(np.linspace(0, 1, width)))[1:-1]
    return colours


def on_screen(light: Light, tone: str, exposure: float) -> npt.NDArray[np.float32]:
    """(H, W, 4) linear light -> display-linear 0..1, as the screen shows it before sRGB's curve; alpha as it is."""
    values = light.astype(np.float32)
    values[..., :3] = tone_map(values[..., :3], tone, exposure)
    return values


def apart(ours: npt.NDArray[np.float32], other: npt.NDArray[np.float32]) -> str:
    """How far two pictures of `on_screen` are apart, in words; figures of glbump.trade."""
    from glbump.trade.metrics import compare

    figures = compare(ours, other, perceptual=False)
    rms, often, most = (255 * figures[name] for name in ("rmse", "p99", "max"))
    return f"{_short(rms)} of 255 apart (rms), {_short(often)} in 1 pixel of 100, {_short(most)} at most"


def _short(value: float) -> str:
    return f"{value:.2g}" if value < 99.5 else f"{value:.0f}"
