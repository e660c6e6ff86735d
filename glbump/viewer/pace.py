"""How many pixels and samples a frame may have, so that what moves keeps moving: from the frames before."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

from glbump.frozen import Frozen

BUDGET = 1000 / 30
"""Milliseconds that a frame may take while something moves."""
SCALES = (1.0, 0.75, 0.5, 0.375, 0.25, 0.1875, 0.125)
"""Shares of the window's width and height that a frame is drawn in."""
ROOM = 0.8
"""A step to more pixels is taken where it would cost at most this share of BUDGET: what lies on the limit would step to
and fro."""
NEWEST = 0.5
"""Weight of the newest frame in the mean of the last ones."""


class Step(NamedTuple):
    """How one frame is drawn: with how many samples a pixel, and at what share of the window's width and height."""

    samples: int
    scale: float


class Pace(Frozen):
    """What frames cost here. one, many: nanoseconds a pixel and sample, of one sample a pixel, and of several, which
    share some work; None until one has been drawn. beside: milliseconds of a frame that go to anything else. scale: of
    the last frame that moved."""

    one: float | None = None
    many: float | None = None
    beside: float = 0.0
    scale: float = 1.0

    def after(self, step: Step, size: tuple[int, int], ms: float, beside: float = 0.0) -> Pace:
        """With one more frame of `size` pixels: drawn in `ms`, and all else of it in `beside`."""
        cost = 1e6 * ms / (size[0] * size[1] * step.samples)
        seen = replace(self, beside=_mean(self.beside, beside))
        if step.samples == 1:
            return replace(seen, one=_mean(self.one, cost), scale=step.scale)
        return replace(seen, many=_mean(self.many, cost), scale=1.0)

    def moving(self, size: tuple[int, int], samples: int) -> Step:
        """For the next frame of a window of `size` pixels, while something moves: the chosen `samples` and all pixels
        where that is fast enough, or else one sample, and as many pixels as are."""
        pixels = 1e-6 * size[0] * size[1]
        budget = max(BUDGET - self.beside, BUDGET / 4)
        whole = self.many if samples > 1 and self.many is not None else self.one
        if whole is None or whole * samples * pixels <= budget * (1.0 if self.scale == 1.0 else ROOM):
            return Step(samples, 1.0)
        one = self.one if self.one is not None else whole
        share = math.sqrt(budget / (one * pixels))
        fits = (s for s in SCALES if s <= (share if s <= self.scale else share * math.sqrt(ROOM)))
        return Step(1, next(fits, SCALES[-1]))


def _mean(before: float | None, newest: float) -> float:
    return newest if before is None else before + NEWEST * (newest - before)


def scaled(size: tuple[int, int], scale: float) -> tuple[int, int]:
    """`size` times `scale`, at least one pixel."""
    return max(1, round(size[0] * scale)), max(1, round(size[1] * scale))
