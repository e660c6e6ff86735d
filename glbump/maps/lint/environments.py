"""Checks of environments: the light in the picture, and how it lies round the viewer."""

from __future__ import annotations

from itertools import product

import numpy as np
import numpy.typing as npt

from glbump.maps.continuity import edge_steps, turned_faces
from glbump.maps.images import Picture
from glbump.maps.layout import CUBE, LATLONG, EnvironmentMap, latlong_dir, sample
from glbump.maps.lint.finding import DOUBTFUL, NOTE, Finding, border, compressed

F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]

CLIPPED = 0.001
"""Share of the pixels of a picture of display range that may be at its largest value; a sun is a thousandth of that."""

SUN = 0.01
"""A sun, or a lamp, is at most this share of a picture; what is as bright and larger is a sky."""

BRIGHT_MIDDLE = 0.35
"""Median of a display-range picture in linear light; photographs have about 0.18, and 0.46 while sRGB-encoded."""

POLE = 1.5
"""The row at a pole varies at most this much, times what neighbouring rows differ by; real panoramas: 0 to 0.65."""

SKY = np.radians(25)
"""The sky is what is higher than this; the ground what is as far below the horizon."""

UPSIDE_DOWN = 0.05
"""Stops that a picture is brighter below than above, times by how much its share of blue is larger there: of outdoor
panoramas upside down 0.1 and more, of one of a room 0.02."""

LIKE, AHEAD = 0.8, 0.3
"""Least correlation of two pictures of one place; and how much of what is lacking to 1, as the two are laid, may be
lacking once one is laid another way."""

SCATTERED = 4.0
"""Cube faces whose edges differ on average by more than this, times the differences beside them, do not meet."""

# ------------------------------------------------------------ the light


def low_range(picture: Picture) -> list[Finding]:
    """Light that ends at display white, where reflections want all of it."""
    pixels = picture.pixels
    top = float(pixels.max())
    if top > 1 or top <= 0:
        return []
    stored = f"{picture.bits}-bit {'floats' if picture.is_float else 'integers'}"
    at_top = float((pixels >= top).any(axis=-1).mean())
    if picture.is_float and top < 0.99:
        return []
    if at_top > CLIPPED:
        why = f"{stored}, the largest value is {top:.4g}, and {at_top:.2%} of the pixels reach it"
        what = "clipped highlights: a display-range picture where HDR is expected"
        mend = "take the .exr or .hdr it was made from; exposure only scales what is left"
        return [Finding(what, why, mend, DOUBTFUL)]
    why = f"{stored}, the largest value is {top:.4g}; suns and lamps are hundreds of times brighter than white"
    return [Finding("a display-range picture where HDR is expected", why, "take an .exr or .hdr if there is one", NOTE)]


def clipped_sun(picture: Picture) -> list[Finding]:
    """A plateau at the largest value: the same in all three channels, as a clamp leaves it, and small, as suns are."""
    pixels = picture.pixels
    top = float(pixels.max())
    at_top = (pixels == top).all(axis=-1)
    count = int(at_top.sum())
    is_grey = bool((pixels[..., 0] == pixels[..., 1]).all() and (pixels[..., 0] == pixels[..., 2]).all())
    if not picture.is_float or top <= 1 or count < 3 or count > SUN * at_top.size or is_grey:
        return []
    why = f"{count} pixels are all at the largest value {top:.6g} in all three channels; light has no such ceiling"
    if top == 65504:
        why += ", and it is the largest half float"
    return [Finding("a clipped sun", why, "take the picture before it was clamped; its light is lost here", DOUBTFUL)]


def encoded_floats(picture: Picture) -> list[Finding]:
    """Floats, which are taken as linear light, that look sRGB-encoded."""
    pixels = picture.pixels
    top = float(pixels.max())
    if not picture.is_float or top > 1 or top < 0.5 or float(pixels.min()) < 0:
        return []
    bytes_apart = np.abs(pixels * 255 - np.rint(pixels * 255))
    # A half float is off by up to 2**-12 of its value.
    if float(bytes_apart.max()) < 255 * 2.0**-12 + 1e-3:
        levels = len(np.unique(np.rint(pixels * 255)))
        why = f"all values are whole 255ths ({levels} of them): bytes, which are sRGB-encoded, divided by 255"
    else:
        middle = float(np.median(pixels))
        if middle < BRIGHT_MIDDLE:
            return []
        why = f"the median is {middle:.3g} and the largest value {top:.4g}; linear photographs have about 0.18"
        return [Finding("floats that may be sRGB-encoded", why, "decode them before saving as floats", NOTE)]
    return [Finding("floats that are sRGB-encoded", why, "give the 8-bit picture, or decode it first", DOUBTFUL)]


# ------------------------------------------------------------ how it lies


def not_two_to_one(width: int, height: int) -> list[Finding]:
    """A lat-long picture of another shape."""
    if width == 2 * height:
        return []
    turned = height == 2 * width
    what = "a lat-long picture on its side" if turned else "a lat-long picture that is not 2:1"
    mend = (
        "turn it by 90 degrees" if turned else "crop or pad it to 2:1, or say its layout with --as and convert --from"
    )
    return [Finding(what, f"{width}x{height} is {width / height:.4g}:1", mend, DOUBTFUL)]


def seam(pixels: F32, *, on_border: bool) -> list[Finding]:
    """Whether the left and the right side of a lat-long picture (H, W, 3) meet.

    on_border: the outermost samples lie on the border (OpenEXR's header), so that both columns are the same.
    """
    if pixels.shape[1] < 6:
        return []
    at = border(compressed(pixels), 1)
    if on_border:
        if at.step <= at.typical:
            return []
        why = f"the first and the last column are one, by the header; they differ by {at}"
        return [Finding("sides that do not meet", why, "write it anew, or without the envmap header", DOUBTFUL)]
    if at.step == 0 and at.typical > 0:
        why = "the first and the last column are equal: the samples lie on the border, one column is there twice"
        return [Finding("a doubled column", why, 'drop the last column, or say it in the header "envmap"', NOTE)]
    if not at.is_seam:
        return []
    why = f"left and right differ by {at}"
    return [Finding("a seam", why, "the picture is cropped or no whole panorama; stitch it over 360 degrees", DOUBTFUL)]


def poles(pixels: F32) -> list[Finding]:
    """The outermost rows of a lat-long picture (H, W, 3) circle the poles within half a texel: nearly one colour."""
    if pixels.shape[0] < 8:
        return []
    light = compressed(pixels)
    typical = float(np.abs(np.diff(light, axis=0)).mean())
    spread = {
        name: float(np.abs(row - row.mean(axis=0)).mean()) for name, row in (("top", light[0]), ("bottom", light[-1]))
    }
    found = [name for name, value in spread.items() if typical and value > POLE * typical]
    if not found:
        return []
    times = " and ".join(f"{spread[name] / typical:.3g}" for name in found)
    why = f"along the {' and '.join(found)} row it varies {times} times as much as from row to row; it is one place"
    mend = "the picture ends short of the poles, or is no lat-long picture: pad it to 180 degrees, or say its layout"
    return [Finding("poles that are no points", why, mend, DOUBTFUL)]


def _table(environment: EnvironmentMap, rows: int = 64) -> F64:
    """(rows, 2 * rows, 3) radiance in lat-long directions."""
    v, u = ((np.arange(n) + 0.5) / n for n in (rows, 2 * rows))
    return sample(environment, latlong_dir(np.stack(np.broadcast_arrays(u, v[:, None]), axis=-1)))


def upside_down(environment: EnvironmentMap) -> list[Finding]:
    """Ground above and sky below: skies are brighter and bluer than grounds."""
    if not environment.layout.whole:
        return []
    rows = 64
    light = np.maximum(_table(environment, rows), 0)
    height = np.pi * (0.5 - (np.arange(rows) + 0.5) / rows)
    above, below = (light[where].reshape(-1, 3) for where in (height > SKY, height < -SKY))
    luminance = [float(np.median(part @ (0.2126, 0.7152, 0.0722))) for part in (above, below)]
    blue = [float(np.median(part[:, 2] / np.maximum(part.sum(axis=1), 1e-12))) for part in (above, below)]
    stops = float(np.log2(max(luminance[1], 1e-12) / max(luminance[0], 1e-12)))
    if min(stops, blue[1] - blue[0]) <= 0 or stops * (blue[1] - blue[0]) <= UPSIDE_DOWN:
        return []
    why = f"what is high up is {stops:.2g} stops darker than what is low down, and its "
    why += f"share of blue is {blue[0]:.2f} against {blue[1]:.2f}: the sky seems to be below"
    mend = "turn the picture by 180 degrees; turn it over (top to bottom) if writing in it reads backwards"
    return [Finding("upside down", why, mend, DOUBTFUL)]


def edges_of_faces(environment: EnvironmentMap) -> list[Finding]:
    """Faces of a cube that are turned, mirrored or swapped; edges that do not meet and cannot be made to."""
    if environment.layout is not CUBE or environment.size[0] < 2 or environment.has_own_grid:
        return []
    found = [
        Finding(
            f"{fault}",
            f"the steps across the edges are {fault.before:.3g} times those inside; mended, {fault.after:.3g} times",
            'orientation = "opengl" or "inside"' if len(fault.faces) == 6 else "turn or swap the named faces",
            DOUBTFUL,
        )
        for fault in turned_faces(environment)
    ]
    steps = edge_steps(environment.pixels)
    apart = float(np.mean(list(steps.values())))
    if found or apart <= SCATTERED:
        return found
    edge = max(steps, key=lambda name: steps[name])
    why = (
        f"the steps across the twelve edges are {apart:.3g} times those inside; {edge} is worst with {steps[edge]:.3g}"
    )
    return [Finding("faces that do not meet", why, "are they six faces of one place, and of 90 degrees?", DOUBTFUL)]


def against(first: EnvironmentMap, second: EnvironmentMap) -> list[Finding]:
    """What two environments of one place say about each other: mirrored, turned about +Y, upside down.

    That a picture is mirrored cannot be seen in it alone, where no writing is read.
    """
    if not (first.layout.whole and second.layout.whole):
        return []
    one, other = (compressed(np.maximum(_table(e), 0)) for e in (first, second))
    alike = {
        (mirrored, over, turns): _correlation(one, _laid(other, mirrored, over, turns))
        for mirrored, over, turns in product((False, True), (False, True), range(4))
    }
    best = max(alike, key=lambda key: alike[key])
    plain = alike[False, False, 0]
    if best == (False, False, 0) or alike[best] < LIKE or 1 - alike[best] > AHEAD * (1 - plain):
        return []
    mirrored, over, turns = best
    said = ["mirrored"] * mirrored + ["upside down"] * over + [f"turned by {90 * turns} degrees about +Y"] * bool(turns)
    why = f"laid so, the two agree by {alike[best]:.3f}; as they are, by {plain:.3f}"
    mend = 'mirrored: orientation = "inside" or "opengl" of cubes, or turn the picture over; turned: rotation'
    return [Finding(f"against each other, {', '.join(said)}", why, mend, DOUBTFUL)]


def _laid(table: F64, mirrored: bool, over: bool, turns: int) -> F64:
    table = table[::-1] if over else table
    return np.roll(table[:, ::-1] if mirrored else table, turns * table.shape[1] // 4, axis=1)


def _correlation(one: F64, other: F64) -> float:
    a, b = one - one.mean(axis=(0, 1)), other - other.mean(axis=(0, 1))
    norm = float(np.sqrt((a**2).sum() * (b**2).sum()))
    return float((a * b).sum()) / norm if norm else 0.0


def lies_well(environment: EnvironmentMap, picture: Picture) -> list[Finding]:
    """All checks of how an environment lies. picture: the one it was made from, or the first of its faces."""
    found: list[Finding] = []
    if environment.layout is LATLONG:
        height, width = picture.pixels.shape[:2]
        on_border = picture.envmap == "latlong"
        found += not_two_to_one(width, height) if not on_border else []
        found += seam(picture.pixels, on_border=on_border)
        found += poles(picture.pixels)
    faces = edges_of_faces(environment)
    found += faces + upside_down(environment)
    # Of faces that do not meet it has been said.
    notes = () if faces else environment.notes
    mend = "say the layout or the orientation if it is another"
    return found + [Finding("taken for granted", note, mend, NOTE) for note in notes]
