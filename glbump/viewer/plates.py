"""What is written over the picture: what is shown and how, what goes on, what went wrong, the keys."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from glbump.gl.screen import Box
from glbump.viewer.actions import help_rows
from glbump.viewer.comparing import FULL, HEAT, WIPE
from glbump.viewer.pace import BUDGET, Step, scaled
from glbump.viewer.text import COLUMN, POINTS, plate

if TYPE_CHECKING:
    from glbump.viewer.window import Viewer


def status(viewer: Viewer) -> str:
    """The line at the bottom: the subject, the pixels, the quality, and what the last frame took."""
    width, height = viewer.stage.room
    step, quality = viewer.drawn, viewer.shown.quality
    parts = [viewer.shown.subject.name or "nothing opened", f"{width}x{height}"]
    name = quality.preset if quality == type(quality)(quality.preset) else f"{quality.preset}, changed"
    if viewer.shown.view is not None:
        parts.append(f"{viewer.shown.view}, at {name}")
    elif step == Step(quality.samples, 1.0):
        parts.append(f"{name}, {quality.samples} samples" if quality.samples > 1 else name)
    else:
        across, down = scaled((width, height), step.scale)
        parts.append(f"draft of {name}: {across}x{down}, 1 sample, to stay near {BUDGET:.0f} ms while it moves")
    if viewer.timings:
        last = viewer.timings[-1]
        parts.append(f"{last.plan + last.draw:.2g} ms" if last.draw < 10 else f"{last.plan + last.draw:.0f} ms")
    return "   ".join([*parts, "F1 help"])


_LINE = np.full((1, 1, 4), 255, np.uint8)

SIZES = (1.0, 0.85, 0.7, 0.55, 0.45)
"""Shares of the letters' size that are tried, so that what is long is small before it is not there."""


def plates(viewer: Viewer, size: tuple[int, int], ratio: float, line: str | None = None) -> list[Box]:
    """The plates for a window of `size` pixels, with `ratio` pixels to a point; those that find no room are not. line:
    the one at the bottom, in place of `status`."""
    width, height = size
    gap = round(POINTS * ratio / 2)
    boxes: list[Box] = []
    left = gap + viewer.stage.left

    def lay(text: str, kind: str, top: int, bottom: int) -> int:
        """One plate between two heights, at the lower one if `top` is 0; how high it is with the gap beside it."""
        for share in SIZES:
            pixels = plate(text, kind, width - left - gap, share * ratio)
            if pixels is not None and pixels.shape[0] <= bottom - top:
                boxes.append(Box(pixels, left, top or bottom - pixels.shape[0]))
                return pixels.shape[0] + gap
        return 0

    shown = viewer.shown
    comparison = viewer.comparison
    if comparison.way == WIPE and comparison.picture is not None:
        boxes.append(Box(_LINE, viewer.split - 1, 0, (2, height)))
    elif comparison.way == HEAT and comparison.heat is not None:
        boxes.append(Box(comparison.heat, viewer.stage.left, 0, viewer.stage.room))
    bottom = height - gap - lay(status(viewer) if line is None else line, "plain", 0, height - gap)
    if comparison.way:
        said = comparison.figures or "the truth is being drawn"
        sides = (
            f"left: {shown.quality.preset}; right: the truth" if comparison.way == WIPE else f"heat map, to {FULL:.0f}"
        )
        bottom -= lay(f"{sides}; {said}", "plain", 0, bottom)
    top = gap
    for text, kind in ((shown.trouble, "error"), (shown.work, "note"), (shown.note, "note"), (shown.told, "plain")):
        if text:
            top += lay(text, kind, top, bottom)
    if shown.shows_help:
        lay("\n".join(COLUMN.join(row) for row in help_rows()), "plain", top, bottom)
    return boxes
