"""Checks of heights: what would show as bumps that nobody made."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from glbump.maps.images import colour_of, unit_range
from glbump.maps.lint.finding import DOUBTFUL, NOTE, WRONG, Finding
from glbump.maps.lint.tags import Tags
from glbump.maps.lint.values import alpha, data_tags, not_finite, not_tiling, too_large
from glbump.maps.stored import Stored, count_and_first

FLAT = 0.5
"""Stair steps: at least this share of neighbouring texels is equal,"""

ONE_STEP = 0.8
"""and at least this share of the others differs by the smallest step there is."""

EIGHT_BITS = 256


def check_heights(stored: Stored, tags: Tags) -> list[Finding]:
    """All that is found in a picture that is to be a height map."""
    raw = unit_range(stored.pixels, stored)
    bad = not_finite(raw) or too_large(raw)
    if bad:
        return bad
    grey = unit_range(stored.pixels[:, :, stored.colours()[0]], stored)
    return [
        *coloured(stored),
        *alpha(stored, is_read=True),
        *constant(grey),
        *stair_steps(grey, stored.bits),
        *data_tags(tags, "heights"),
        *not_tiling(grey[..., None]),
    ]


def coloured(stored: Stored) -> list[Finding]:
    """A picture in colours: of which channel is not said, and colour is sRGB-encoded as a rule."""
    r, g, b = (stored.pixels[:, :, i] for i in stored.colours())
    other = (r != g) | (r != b)
    if not other.any():
        return []
    grey = colour_of(stored).pixels
    mean = ", ".join(f"{value:.3g}" for value in grey.reshape(-1, 3).mean(axis=0, dtype=np.float64))
    return [
        Finding(
            "colours where heights are expected",
            f"{count_and_first(other)} are coloured, their mean in linear light ({mean}); colour is sRGB-encoded, and "
            "heights are taken as they stand",
            'name the channel that holds the heights, channel = "r", or save heights as linear grey of 16 bits',
            WRONG,
        )
    ]


def constant(heights: npt.NDArray[Any]) -> list[Finding]:
    low, high = float(heights.min()), float(heights.max())
    if low != high:
        return []
    return [Finding("no heights", f"all are {low:.6g}: there is nothing to bump", "give another picture", DOUBTFUL)]


def stair_steps(heights: npt.NDArray[Any], bits: int) -> list[Finding]:
    """Plateaus with steps of one level between them: heights (H, W) that are finite, stored with `bits`."""
    levels = np.unique(heights)
    if len(levels) < 3 or len(levels) > EIGHT_BITS:
        return []
    spacing = float(np.diff(levels.astype(np.float64)).min())
    steps = np.abs(np.concatenate([np.diff(heights, axis=axis).ravel() for axis in (0, 1)]))
    rising = steps[steps > 0]
    flat = 1 - rising.size / steps.size
    single = float((rising < 1.5 * spacing).mean())
    held = f"{len(levels)} distinct levels in {bits} bits"
    if flat >= FLAT and single >= ONE_STEP:
        return [
            Finding(
                "stair steps",
                f"{held}; {flat:.0%} of neighbouring texels are equal and {single:.0%} of the others one level apart: "
                "slopes are 0, or a whole level a texel",
                "save the heights with 16 bits or as floats; from these, blur over the width of a step first",
                DOUBTFUL,
            )
        ]
    if bits > 8 and heights.size > 16 * EIGHT_BITS:
        why = f"{held}, {spacing:.3g} apart: as many as 8 bits hold"
        return [Finding("8 bits in a wider file", why, "save it anew from the original heights", NOTE)]
    return []
