"""Pictures: files <-> linear float arrays. The one place for sRGB, orientation and limits.

What a picture means:

- Integer colour (8 and 16 bits) is sRGB and is decoded, unless the file itself says that it is linear; float
  colour is linear. ICC profiles, and gamma tags other than 1, are not applied.
- Heights and normals are data: never sRGB-decoded.
- The orientation tag (EXIF, TIFF) is obeyed: row 0 is the top as every viewer shows it.
- Of a mip-mapped file, the largest level (`maps.containers` reads all). Several pictures in one file are an error.
- A cube map of a texture file (KTX2, DDS) is a column of its six faces.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from glbump.errors import ImageError
from glbump.frozen import Frozen
from glbump.maps.colour import TONES, linear_from_srgb, srgb_from_linear, tone_map
from glbump.maps.files import write_atomically, write_display, write_picture
from glbump.maps.stored import (
    MAX_BYTES,
    MAX_PIXELS,
    ArraySource,
    Source,
    Stored,
    count_and_first,
    read_stored,
)

__all__ = [
    "MAX_BYTES",
    "MAX_PIXELS",
    "TONES",
    "ArraySource",
    "Picture",
    "Source",
    "linear_from_srgb",
    "read_colour",
    "read_environment",
    "read_height",
    "read_normals",
    "read_picture",
    "require_opaque",
    "srgb_from_linear",
    "tone_map",
    "write_atomically",
    "write_display",
    "write_picture",
]

NORMAL_LENGTH_ERROR = 0.3
"""Most that the vectors of a normal map may differ from length 1, on average. Photographs: 0.26 to 0.6 (and
their z is negative as often as not); real maps: 0.01 to 0.1."""

NORMAL_BEHIND = 0.01
"""Largest share of a normal map's pixels whose normal may point into the surface (z <= 0)."""


class Picture(Frozen, eq=False):
    """A picture in memory.

    pixels: (H, W, C) float32, contiguous, row 0 on top; linear light for colour, -1..1 for normals.
    bits: of one channel in the source. is_float: whether the source held floats.
    envmap: what the header says it is: "latlong" or "cube" (OpenEXR's), "faces" (a cube map of KTX2 or DDS: a column of
    six by the OpenGL table) or None. name: for messages. clear: (H, W) which pixels are not opaque, where some are.
    """

    pixels: npt.NDArray[np.float32]
    bits: int
    is_float: bool
    envmap: str | None
    name: str
    clear: npt.NDArray[np.bool_] | None = None


def read_colour(source: Source) -> Picture:
    """Colour as (H, W, 3) linear light; grey pictures give three equal channels.

    Alpha is dropped where it is 1 everywhere; a transparent pixel is an ImageError, since what would show
    through it is not said. Six faces (6, N, N, C) in an array come out as a column (6N, N, 3).
    """
    stored = read_stored(source)
    if "A" in stored.channels:
        require_opaque(stored.name, _clear(stored))
    return colour_of(stored)


def colour_of(stored: Stored) -> Picture:
    """A picture's colours as (H, W, 3) linear light, whatever its alpha."""
    return _picture(stored, _linear(stored, _rgb(stored)))


def read_environment(source: Source) -> Picture:
    """Colour as read_colour has it, but for transparent pixels, which are black and marked: crosses and discs have them
    where they hold nothing, and the layout decides whether they do."""
    stored = read_stored(source)
    picture = colour_of(stored)
    if "A" not in stored.channels or not (clear := _clear(stored)).any():
        return picture
    nothing = stored.pixels[:, :, stored.channels.index("A")] == 0
    return replace(picture, pixels=np.where(nothing[..., None], np.float32(0), picture.pixels), clear=clear)


def require_opaque(name: str, clear: npt.NDArray[np.bool_]) -> None:
    """ImageError where a pixel (H, W) is not opaque."""
    if clear.any():
        raise ImageError(
            f"{name}: must be opaque; {count_and_first(clear)} have an alpha other than 1; "
            "flatten it on a background, or save it without alpha"
        )


def read_picture(source: Source) -> Picture:
    """Grey or colour as linear light, with straight alpha where there is one: (H, W, 1, 2, 3 or 4).

    For what glbump itself has drawn. OpenEXR's premultiplied colour is divided by its alpha.
    """
    stored = read_stored(source)
    colours = sorted(set(stored.colours()))
    picked = stored.pixels[:, :, colours]
    pixels = _linear(stored, np.ascontiguousarray(picked))
    if "A" in stored.channels:
        alpha = unit_range(stored.pixels[:, :, stored.channels.index("A")], stored)
        if stored.premultiplied and (alpha != 1).any():
            pixels /= np.where(alpha > 0, alpha, 1)[..., None]
        pixels = np.concatenate([pixels, alpha[..., None]], axis=2)
    return _picture(stored, pixels)


def read_height(source: Source, channel: str | None = None) -> Picture:
    """Heights as (H, W, 1): integers divided by their largest value, floats as they are; never sRGB-decoded.

    channel: "r", "g", "b" or "a"; without it the picture must be grey, alone or as three equal channels.
    """
    stored = read_stored(source)
    index = stored.channel(channel) if channel is not None else grey_channel(stored)
    return _picture(stored, unit_range(stored.pixels[:, :, index : index + 1], stored))


def read_normals(source: Source) -> Picture:
    """A tangent-space normal map as (H, W, 3) vectors, not normalised; alpha (often a height) is not read.

    8-bit values c are (c - 128) / 127, so that 128 is 0, and 16 bits alike; floats 2 c - 1; floats that hold vectors
    already (a negative value, or unit length as they stand) are taken as they are.
    ImageError for a picture that is no normal map.
    """
    stored = read_stored(source)
    picture = vectors_of(stored)
    _require_normals(picture.pixels, stored.name)
    return picture


def vectors_of(stored: Stored) -> Picture:
    """A picture's colours as (H, W, 3) vectors, as `read_normals` has them, whether or not they make a normal map."""
    raw = _rgb(stored)
    if stored.bits <= 16 and not stored.is_float:
        middle = 2 ** (stored.bits - 1)
        vectors = (raw.astype(np.float32) - middle) / np.float32(middle - 1)
    elif stored.is_float and (raw.min() < 0 or length_error(raw) < 0.01):
        vectors = raw
    else:
        vectors = 2 * unit_range(raw, stored) - 1
    return _picture(stored, vectors)


def _picture(stored: Stored, pixels: npt.NDArray[np.float32]) -> Picture:
    return Picture(np.ascontiguousarray(pixels), stored.bits, stored.is_float, stored.envmap, stored.name)


def _rgb(stored: Stored) -> npt.NDArray[Any]:
    """The stored colours, (H, W, 3), contiguous; a picture of three channels is not copied."""
    colours = stored.colours()
    if colours == (0, 1, 2) and stored.pixels.shape[2] == 3:
        return np.ascontiguousarray(stored.pixels)
    # Channel by channel takes half of the time that a slice takes, and a third of that of a list of indices.
    rgb = np.empty((*stored.pixels.shape[:2], 3), stored.pixels.dtype)
    for i, channel in enumerate(colours):
        rgb[:, :, i] = stored.pixels[:, :, channel]
    return rgb


def _linear(stored: Stored, pixels: npt.NDArray[Any]) -> npt.NDArray[np.float32]:
    """Stored colour -> linear light float32, by table for integers."""
    if stored.is_float:
        return pixels.astype(np.float32, copy=False)
    if stored.says_linear:
        return unit_range(pixels, stored)
    if stored.bits == 32:
        return linear_from_srgb(unit_range(pixels, stored)).astype(np.float32)
    steps = 2**stored.bits
    return linear_from_srgb(np.arange(steps) / (steps - 1)).astype(np.float32).take(pixels)


def unit_range(pixels: npt.NDArray[Any], stored: Stored) -> npt.NDArray[np.float32]:
    """Integers -> 0..1; floats as they are."""
    if stored.is_float:
        return pixels.astype(np.float32, copy=False)
    # In float64 because 1/65535 times a value, rounded twice, is not the value divided.
    return (pixels / (2.0**stored.bits - 1)).astype(np.float32)


def grey_channel(stored: Stored) -> int:
    """Index of the channel that holds a grey picture's heights; ImageError where it is coloured or not opaque."""
    r, g, b = stored.colours()
    if r != g:
        red = stored.pixels[:, :, r]
        other = (red != stored.pixels[:, :, g]) | (red != stored.pixels[:, :, b])
        if other.any():
            raise ImageError(
                f"{stored.name}: a height picture must be grey; {count_and_first(other)} are "
                'coloured; say which channel holds the heights: channel = "r", "g", "b" or "a"'
            )
    if "A" in stored.channels:
        require_opaque(stored.name, _clear(stored))
    return r


def _clear(stored: Stored) -> npt.NDArray[np.bool_]:
    """(H, W) which pixels are not opaque."""
    alpha = unit_range(stored.pixels[:, :, stored.channels.index("A")], stored)
    # Lossy compression of half floats leaves alpha some thousandths off 1.
    result: npt.NDArray[np.bool_] = np.abs(alpha - 1) > (0.005 if stored.is_float else 0)
    return result


def length_error(vectors: npt.NDArray[Any]) -> float:
    """Mean distance of the vectors' lengths from 1."""
    return float(np.abs(np.sqrt(np.einsum("...i,...i", vectors, vectors)) - 1).mean())


def _require_normals(vectors: npt.NDArray[Any], name: str) -> None:
    x, y, z = np.moveaxis(vectors, -1, 0)
    if vectors.size and np.array_equal(x, y) and np.array_equal(y, z):
        raise ImageError(f"{name}: a grey picture is no normal map; if it holds heights, use bump.height")
    off, behind = length_error(vectors), float((z <= 0).mean())
    if off > NORMAL_LENGTH_ERROR:
        found = f"its lengths differ from 1 by {off:.2g} on average (at most {NORMAL_LENGTH_ERROR:g})"
    elif behind > NORMAL_BEHIND:
        found = f"{behind:.0%} of its vectors point into the surface (blue below the middle)"
    else:
        return
    raise ImageError(
        f"{name}: is no tangent-space normal map: {found}; give a map made for tangent space, "
        "or heights with bump.height"
    )
