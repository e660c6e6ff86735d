"""The chosen quality beside the truth: the exact path with more and more samples, while nothing moves."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from glbump.gl.targets import read
from glbump.maps.colour import eight_bit
from glbump.quality import quality_of
from glbump.shown import ramp
from glbump.trade.metrics import compare, difference_picture

if TYPE_CHECKING:
    from glbump.gl.prepared import Drawn
    from glbump.viewer.showing import Showing
    from glbump.viewer.stage import Stage

SAMPLES = (4, 16, 64)
"""Of the truth, one after the other."""
FULL = 16.0
"""Difference on the screen, in 1/255, that the heat map shows palest."""
OFF, WIPE, HEAT = "", "wipe", "heat map"


class Comparison:
    """How the picture is held against the truth: not at all, side by side at the cursor, or as a map of the difference.

    picture: the truth, or None until there is one of what is shown; figures: how far off the picture is, in words;
    heat: (H, W, 4) bytes. Both are of sRGB values without a tone curve, at the exposure of the screen.
    """

    def __init__(self) -> None:
        self.way = OFF
        self._version, self._samples = -1, 0
        self.picture: Drawn | None = None
        self.figures = ""
        self.heat: npt.NDArray[np.uint8] | None = None

    def go(self) -> None:
        """The next way of comparing."""
        ways = (OFF, WIPE, HEAT)
        self.way = ways[(ways.index(self.way) + 1) % len(ways)]

    def begin(self, version: int) -> None:
        """Forget what was of another version."""
        if version != self._version:
            self._version, self._samples = version, 0
            self.picture, self.figures, self.heat = None, "", None

    @property
    def next_samples(self) -> int | None:
        """Of the next truth to draw; None where there is none, or nothing is compared."""
        finer = (samples for samples in SAMPLES if samples > self._samples)
        return next(finer, None) if self.way else None

    def refine(self, shown: Showing, stage: Stage, samples: int, stop: Callable[[], bool]) -> bool:
        """Draw the next truth, and hold the picture against it; False where `stop` gave it up."""
        assert stage.picture is not None
        exact = replace(quality_of("exact"), samples=samples)
        picture = stage.renderer.draw(shown.scene, stage.room, exact, use="truth", stop=stop)
        if picture is None:
            # Its target may be half drawn over.
            self._version = -1
            self.begin(shown.version)
            return False
        self.picture, self._samples = picture, samples
        light = 2.0**shown.exposure
        ours, truth = (read(drawn.frame)[::-1].astype(np.float32) * light for drawn in (stage.picture, picture))
        figures = compare(ours, truth, perceptual=False)
        self.figures = (
            f"off by {255 * figures['rmse']:.2g} of 255 rms, {255 * figures['p99']:.2g} in one pixel of a hundred, "
            f"{255 * figures['max']:.3g} at most; truth: exact, {samples} samples"
        )
        off = ramp(difference_picture(ours, truth, 255 / FULL).max(axis=-1))
        self.heat = np.concatenate([eight_bit(off), np.full((*off.shape[:2], 1), 255, np.uint8)], axis=-1)
        return True
