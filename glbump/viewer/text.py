"""Text for the window: lines on a dark plate, to be read on any picture."""

from __future__ import annotations

from bisect import bisect_right
from functools import lru_cache, partial

import numpy as np
import numpy.typing as npt
from PIL import Image, ImageDraw, ImageFont

Bytes = npt.NDArray[np.uint8]

POINTS = 14
"""Height of the letters at a pixel ratio of 1."""
PLATES = {"plain": (20, 22, 26, 205), "error": (120, 16, 20, 235), "note": (24, 64, 110, 225)}
"""Grounds, straight sRGB and alpha: what is told, what went wrong, what goes on."""
INK = (245, 245, 245, 255)
COLUMN = "\t"
"""Parts a line into two columns."""


@lru_cache(maxsize=4)
def _font(size: int) -> ImageFont.FreeTypeFont | ImageFont.ImageFont:
    return ImageFont.load_default(size)


@lru_cache(maxsize=32)
def plate(text: str, kind: str, width: int, ratio: float = 1.0) -> Bytes | None:
    """(H, W, 4) bytes, read-only: text on its ground, wrapped to at most `width` pixels; None where not even a word
    would fit. ratio: pixels to a point."""
    size = max(6, round(POINTS * ratio))
    font, margin = _font(size), max(2, round(0.6 * size))
    room = width - 2 * margin
    if room < 4 * size:
        return None
    rows = [row for line in text.splitlines() for row in _rows(line, font, room)]
    column = max((font.getlength(row[0]) for row in rows if row[1] is not None), default=0.0) + size
    used = max(column + font.getlength(row[1]) if row[1] is not None else font.getlength(row[0]) for row in rows)
    height = round(1.35 * size)
    picture = Image.new("RGBA", (int(np.ceil(used)) + 2 * margin, height * len(rows) + margin), PLATES[kind])
    draw = ImageDraw.Draw(picture)
    for i, (left, right) in enumerate(rows):
        draw.text((margin, margin // 2 + i * height), left, INK, font)
        if right is not None:
            draw.text((margin + column, margin // 2 + i * height), right, INK, font)
    result = np.asarray(picture).copy()
    result.flags.writeable = False
    return result


def _length(text: str, font: ImageFont.FreeTypeFont | ImageFont.ImageFont, letters: int) -> float:
    return font.getlength(text[:letters])


def _rows(line: str, font: ImageFont.FreeTypeFont | ImageFont.ImageFont, room: float) -> list[tuple[str, str | None]]:
    """A line as rows that fit: its two columns, or its words broken where they must be."""
    left, tab, right = line.partition(COLUMN)
    if tab:
        return [(left, right)]
    rows, row = [], ""
    for word in line.split(" "):
        longer = f"{row} {word}" if row else word
        if row and font.getlength(longer) > room:
            rows.append(row)
            longer = word
        # A letter has a pixel at least: what is longer than the room is pixels wide is not measured.
        while len(longer) > 1 and font.getlength(longer[: int(room) + 1]) > room:
            cut = max(1, bisect_right(range(1, int(room) + 1), room, key=partial(_length, longer, font)))
            rows.append(longer[:cut])
            longer = longer[cut:]
        row = longer
    return [(row, None) for row in [*rows, row]]
