"""Checks that need only the values of a picture: for every use."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from glbump.maps.heights import HIGHEST
from glbump.maps.lint.finding import DOUBTFUL, NOTE, WRONG, Finding, Floats, border
from glbump.maps.lint.tags import SRGB_GAMMA, Tags
from glbump.maps.stored import Stored, count_and_first

TEXTURE_SIDE = 16384
"""Largest side of a texture on nearly all GPUs, and on Mesa's software driver."""

ANY_TEXTURE_SIDE = 4096
"""A side that every driver of OpenGL 3.3 takes that is known."""

DARK = 0.001
"""Share of an environment's light that negative values may take away before they are more than a note."""


def not_finite(pixels: Floats) -> list[Finding]:
    """NaN and infinities of (H, W, C)."""
    bad = ~np.isfinite(pixels)
    if not bad.any():
        return []
    nan, plus = int(np.isnan(pixels).any(axis=2).sum()), int(np.isposinf(pixels).any(axis=2).sum())
    minus = int(np.isneginf(pixels).any(axis=2).sum())
    return [
        Finding(
            "values that are not finite",
            f"{count_and_first(bad)}: {nan} NaN, {plus} infinite, {minus} negative infinite",
            "repair the picture: no value can be drawn for them",
            WRONG,
        )
    ]


def too_large(pixels: Floats) -> list[Finding]:
    """Finite values of (H, W, C) past what glbump takes: sums and differences of them leave 32-bit floats."""
    over = np.abs(pixels) > HIGHEST
    if not over.any():
        return []
    why = f"{count_and_first(over)} are past {HIGHEST:g}, up to {float(np.abs(pixels).max()):.3g}"
    return [Finding("values without measure", why, "scale the picture, or repair it", WRONG)]


def negative(pixels: Floats) -> list[Finding]:
    """Negative radiance of (H, W, C): no light is."""
    below = pixels < 0
    if not below.any():
        return []
    taken = -float(pixels[below].sum(dtype=np.float64))
    share = taken / max(float(np.abs(pixels).sum(dtype=np.float64)), np.finfo(np.float64).tiny)
    return [
        Finding(
            "negative radiance",
            f"{count_and_first(below)}, down to {float(pixels.min()):.4g}: {share:.2g} of all light",
            "cut it off at 0 where the picture was made; a colour outside its gamut or a sharpening filter leaves it",
            DOUBTFUL if share > DARK else NOTE,
        )
    ]


def size(width: int, height: int, most: Callable[[], int]) -> list[Finding]:
    """A side past the longest one of a texture, `most`, which is asked for only where it may decide; odd sides."""
    longest = max(width, height)
    if longest > ANY_TEXTURE_SIDE and longest > (limit := most()):
        fits = f"{width * limit // longest}x{height * limit // longest}"
        why = f"{width}x{height}; a texture's side is at most {limit}"
        return [Finding("too large for the GPU", why, f"shrink it to {fits}", WRONG)]
    if (width % 2 and width > 1) or (height % 2 and height > 1):
        why = f"{width}x{height}; the next mip level halves it and weighs the last line otherwise than the rest"
        return [Finding("an odd side", why, "even sides, best powers of two, halve without a shift", NOTE)]
    return []


def alpha(stored: Stored, *, is_read: bool) -> list[Finding]:
    """Alpha where none belongs. is_read: whether an alpha other than 1 is refused for this use, not ignored."""
    if "A" not in stored.channels:
        return []
    values = stored.pixels[:, :, stored.channels.index("A")]
    opaque = values.dtype.type(1) if stored.is_float else np.iinfo(values.dtype).max
    clear = np.abs(values - opaque) > 0.005 if stored.is_float else values != opaque
    if not clear.any():
        return [Finding("alpha without use", "it is 1 everywhere", "save it without alpha: a quarter smaller", NOTE)]
    mend = (
        "flatten it on a background, or save it without alpha" if is_read else "save it without alpha: it is not read"
    )
    return [
        Finding("alpha where none belongs", f"{count_and_first(clear)} are not 1", mend, WRONG if is_read else NOTE)
    ]


def colour_tags(tags: Tags) -> list[Finding]:
    """Gamma and profiles of a colour picture that are not applied."""
    found = []
    if tags.gamma is not None and abs(tags.gamma - SRGB_GAMMA) > 0.05:
        linear = abs(tags.gamma - 1) < 0.01
        read = "the values are taken as linear light" if linear else "not applied: the values are taken as sRGB"
        found.append(
            Finding(
                "a gamma tag other than sRGB's",
                f"the file says gamma {tags.gamma:.3g}; {read}",
                "if that is not meant, save it without the gamma tag" if linear else "convert it to sRGB",
                DOUBTFUL,
            )
        )
    if tags.has_profile and not tags.profile_is_srgb:
        why = "the file carries an ICC profile, which is not applied"
        found.append(Finding("a colour profile", why, "convert the picture to sRGB, or to linear floats", NOTE))
    return found


def data_tags(tags: Tags, what: str) -> list[Finding]:
    """Tags that say of heights or normals that they are colour: a note, since many programs write them always."""
    if not tags.says_srgb:
        return []
    why = f"the file says that its values are sRGB-encoded; glbump takes {what} as they stand"
    return [Finding("tagged as sRGB", why, "save it as linear or raw data; right only if they were not encoded", NOTE)]


def not_tiling(values: Floats) -> list[Finding]:
    """Borders of (H, W, C) that do not go on to the opposite ones, which maps on surfaces do."""
    found = []
    for axis, sides in ((1, "left and right"), (0, "top and bottom")):
        if values.shape[axis] >= 6 and (at := border(values, axis)).is_seam:
            why = f"{sides} differ by {at}"
            found.append(Finding("does not tile", why, "keep repeat within 1, or make the borders meet", NOTE))
    return found
