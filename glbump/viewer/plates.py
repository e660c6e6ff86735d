"""What is written over the picture: what is shown and how, what goes on, what went wrong, the keys."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from glbump.gl.screen import Box
from glbump.viewer.actions import help_rows
from glbump.viewer.comparing import FLICKER, FULL, HEAT, WIPE, legend
from glbump.viewer.pace import BUDGET, Step, scaled
from glbump.viewer.regions import EDGE
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


def _over_picture(viewer: Viewer) -> list[Box]:
    """What lies on the picture in place: the line of a split, the heat map, the reference."""
    boxes = []
    shown, stage, comparison, reference = viewer.shown, viewer.stage, viewer.comparison, viewer.reference
    if comparison.way == WIPE and comparison.picture is not None:
        boxes.append(Box(_LINE, viewer.split - 1, 0, (2, stage.size[1])))
    elif comparison.way == HEAT and comparison.heat is not None:
        boxes.append(Box(comparison.heat, stage.left, 0, stage.room))
    if reference.region is not None:
        # Light is not what a heat map and a view show.
        light = comparison.way != HEAT and shown.view is None
        framed = reference.box(shown.tone, shown.exposure, filled=light)
        boxes.append(Box(framed, stage.left + reference.region[0] - EDGE, reference.region[1] - EDGE))
    return boxes


def _compared(viewer: Viewer) -> str:
    """The line about the second picture."""
    comparison, ours = viewer.comparison, viewer.shown.quality.preset
    if not comparison.figures:
        return f"{comparison.way}: {comparison.second} is being drawn"
    how = {
        WIPE: f"left: {ours}, right: {comparison.second}",
        FLICKER: f"flicker, now: {comparison.second if comparison.flipped else ours}",
        HEAT: f"{ours} and {comparison.second}, dark: equal, pale: {FULL:.0f} of 255 and more",
    }[comparison.way]
    return f"{how}; {comparison.figures}"


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
    boxes += _over_picture(viewer)
    bottom = height - gap - lay(status(viewer) if line is None else line, "plain", 0, height - gap)
    if viewer.comparison.way:
        bottom -= lay(_compared(viewer), "plain", 0, bottom)
        if viewer.comparison.heat is not None and viewer.comparison.way == HEAT:
            bar = min(round(16 * POINTS * ratio), width - left - gap), round(POINTS * ratio)
            if min(bar) > 2 and bottom - bar[1] > gap:
                boxes.append(Box(legend(*bar), left, bottom - bar[1]))
                bottom -= bar[1] + gap
    if viewer.reference.region is not None:
        bottom -= lay(viewer.reference.says, "plain", 0, bottom)
    top = gap
    for text, kind in ((shown.trouble, "error"), (shown.work, "note"), (shown.note, "note"), (shown.told, "plain")):
        if text:
            top += lay(text, kind, top, bottom)
    if shown.shows_help:
        lay("\n".join(COLUMN.join(row) for row in help_rows()), "plain", top, bottom)
    return boxes
