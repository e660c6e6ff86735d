"""Heights a few rows at a time, so that a picture of any size passes through little memory.

PNG and TIFF are read as they are worked on, where one channel says it all and the rows lie as they are shown; every
other picture, and every array, is held whole.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NoReturn, Protocol

import numpy as np
import numpy.typing as npt

from glbump.errors import ImageError
from glbump.maps.bspline import BORDERS
from glbump.maps.heights import HIGHEST
from glbump.maps.images import grey_channel
from glbump.maps.stored import (
    SCALARS,
    Source,
    check_file,
    check_header,
    open_image,
    read_stored,
    require_decoded,
)

Rows = npt.NDArray[Any]

STREAMED = ("png", "tiff")
"""Formats, by OpenImageIO's names, that hand out rows without decoding all."""

HELD_PIXELS = 2**18
"""Pictures of fewer pixels are held: there is nothing to gain."""

LONGEST = 2**16
"""Most pixels a side of a picture that is not held."""


class Heights(Protocol):
    """A height field: its rows, row 0 on top, as stored; `full` is what a height of 1 is stored as."""

    name: str
    width: int
    height: int
    full: float
    grain: int
    """Reading goes best by a multiple of so many rows."""

    def read(self, first: int, end: int) -> Rows:
        """(end - first, width), as stored: rows first .. end - 1. ImageError for what is damaged or no height."""


@dataclass
class HeldHeights:
    """A height field in memory, (H, W)."""

    pixels: Rows
    full: float
    name: str
    grain: int = 1

    def __post_init__(self) -> None:
        self.height, self.width = self.pixels.shape
        if not _sound(self.pixels):
            _refuse(self)

    def read(self, first: int, end: int) -> Rows:
        return self.pixels[first:end]

    decoded = read


@dataclass
class FiledHeights:
    """A height field in an open PNG or TIFF: `channel` of it, as `kind`, OpenImageIO's scalar type."""

    file: Any
    path: Path
    channel: int
    kind: Any
    full: float

    def __post_init__(self) -> None:
        spec = self.file.spec()
        self.name, self.width, self.height = str(self.path), spec.width, spec.height
        self.is_tiled, self.grain = bool(spec.tile_width), max(1, spec.tile_height)

    def read(self, first: int, end: int) -> Rows:
        rows = self.decoded(first, end)
        if not _sound(rows):
            _refuse(self)
        return rows

    def decoded(self, first: int, end: int) -> Rows:
        """As `read`, whatever the values."""
        begin, stop = first, end
        if self.is_tiled:  # Whole tiles are read, the last ones cut off by the picture's end.
            begin, stop = first // self.grain * self.grain, min(-(-end // self.grain) * self.grain, self.height)
            across = (0, self.width, begin, stop, 0, 1)
            pixels = self.file.read_tiles(*across, self.channel, self.channel + 1, self.kind)
        else:
            pixels = self.file.read_scanlines(begin, stop, 0, self.channel, self.channel + 1, self.kind)
        require_decoded(pixels, self.file, self.path)
        return pixels.reshape(stop - begin, self.width)[first - begin : end - begin]


@contextmanager
def open_heights(source: Source, channel: str | None = None) -> Iterator[Heights]:
    """The heights of a picture, held or in its open file.

    channel: "r", "g", "b" or "a"; without it the picture must be grey. ImageError for what cannot be read, for a
    picture past the limits (`stored` for what is held, LONGEST a side otherwise), and for heights that are not finite
    or past HIGHEST.
    """
    if isinstance(source, str | os.PathLike) and (filed := _filed(Path(source), channel)) is not None:
        try:
            yield filed
        finally:
            filed.file.close()
        return
    stored = read_stored(source, finite=False)
    index = stored.channel(channel) if channel is not None else grey_channel(stored)
    yield HeldHeights(stored.pixels[:, :, index], _full(stored.bits, stored.is_float), stored.name)


def _full(bits: int, is_float: bool) -> float:
    return 1.0 if is_float else 2.0**bits - 1


def _filed(path: Path, channel: str | None) -> FiledHeights | None:
    """The picture's open file, where its rows can be read one after another; None where it is to be held."""
    import OpenImageIO as oiio

    check_file(path)
    with path.open("rb") as begin:
        if not begin.read(4).startswith((b"\x89PNG", b"II", b"MM")):
            return None
    file = open_image(path, 8 * LONGEST**2)
    spec, form = file.spec(), file.format_name()
    channels = check_header(spec, form, path) if form in STREAMED else ()
    name = channel.upper() if channel is not None else "Y"
    if (
        form not in STREAMED
        or spec.width * spec.height < HELD_PIXELS
        or spec.get_int_attribute("Orientation", 1) != 1
        or name not in channels
        or (channel is None and len(channels) > 1)
        or file.seek_subimage(1, 0)
    ):
        file.close()
        return None
    file.seek_subimage(0, 0)
    file.geterror()  # That there is no second picture is no fault.
    if max(spec.width, spec.height) > LONGEST:
        raise ImageError(f"{path}: is {spec.width}x{spec.height}; at most {LONGEST} a side: shrink it, or cut it up")
    bits, is_float = SCALARS[str(spec.format)]
    kind = oiio.FLOAT if is_float else {8: oiio.UINT8, 16: oiio.UINT16, 32: oiio.UINT32}[bits]
    return FiledHeights(file, path, channels.index(name), kind, _full(bits, is_float))


def _sound(rows: Rows) -> bool:
    # NaN compares false, so what is not finite is not sound.
    return rows.dtype.kind != "f" or bool(max(rows.max(), -rows.min()) <= HIGHEST)


def _refuse(heights: HeldHeights | FiledHeights) -> NoReturn:
    """ImageError: how many heights are none, and where the first is. Reads all of them."""
    count, nan, first = 0, 0, ""
    for row, end in cuts(heights.height, rows_for(heights, 2**20)):
        rows = heights.decoded(row, end)
        bad = ~(np.abs(rows) <= HIGHEST)
        if bad.any() and not first:
            y, x = np.argwhere(bad)[0]
            first = f"the first in row {row + y}, column {x}: {rows[y, x]:g}"
        count, nan = count + int(bad.sum()), nan + int(np.isnan(rows).sum())
    raise ImageError(
        f"{heights.name}: heights must be finite, and within -{HIGHEST:g} and {HIGHEST:g}; {count} of "
        f"{heights.width * heights.height} are not ({nan} NaN), {first}; repair or scale the picture"
    )


def cuts(count: int, step: int) -> Iterator[tuple[int, int]]:
    """(first, end) of `count` things, `step` at a time."""
    return ((first, min(first + step, count)) for first in range(0, count, step))


def rows_for(heights: Heights, pixels: int) -> int:
    """Rows that make about so many pixels, a multiple of what is read well."""
    return max(1, round(pixels / heights.width / heights.grain)) * heights.grain


def late_rows(heights: Heights, reach: int, border: str) -> int:
    """First rows whose neighbours are best read last: a map that wraps is read once then, from its top to its end."""
    return reach if border == "wrap" and isinstance(heights, FiledHeights) and heights.height >= 2 * reach else 0


def windows(heights: Heights, reach: int, border: str, step: int, late: int = 0) -> Iterator[tuple[int, Rows]]:
    """(row, that row and some after it, with `reach` rows above and below them), until every row was there.

    border: what lies beyond the picture, of BORDERS. step: rows that are read at a time. late: `late_rows`, which come
    last; with 0 all come in order, and where a file wraps its end is read first, too.
    """
    tall = heights.height
    if isinstance(heights, HeldHeights) or tall < 2 * reach:
        order = np.pad(np.arange(tall), reach, mode=BORDERS[border])  # type: ignore[call-overload]
        whole = heights.read(0, tall)
        for row, end in cuts(tall, step):
            yield row, whole[order[row : end + 2 * reach]]
        return
    step = max(step, 2 * reach)
    window = heights.read(0, min(step, tall))
    head = window[: 2 * reach].copy()
    row = late
    if not late:
        far = heights.read(tall - reach, tall) if border == "wrap" else head[:0]
        window = np.concatenate([_above(head[:reach], far, border), window])
    for first, end in cuts(tall, step):
        if first > 0:
            yield row, window
            row = first - reach
            window = np.concatenate([window[len(window) - 2 * reach :], heights.read(first, end)])
    tail = window[len(window) - reach :]
    yield row, np.concatenate([window, _above(tail[::-1], head[:reach][::-1], border)[::-1]])
    if late:
        yield 0, np.concatenate([tail, head])


def _above(edge: Rows, far: Rows, border: str) -> Rows:
    """As many rows above a map as `edge`, its topmost rows, has. far: the last rows of the map."""
    if border == "wrap":
        return far
    return np.pad(edge, ((len(edge), 0), (0, 0)), mode=BORDERS[border])[: len(edge)]  # type: ignore[call-overload]
