"""PNG written some rows at a time, on every core.

What takes long is deflating, and that goes by pieces: each is deflated by itself and ends on a whole byte, so that the
pieces one after another are one stream, whose checksum follows from theirs (the idea of pigz, Mark Adler 2007). Each
is an IDAT chunk of its own.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
import numpy.typing as npt

Rows = npt.NDArray[Any]
Bytes = npt.NDArray[np.uint8]

_BLOCK = 2**17
"""Bytes that are filtered at a time: the arrays stay in a core's cache."""

_MOST_STORED = 65535
"""Most bytes of a block that is not compressed."""


@dataclass(frozen=True)
class Piece:
    """Rows as they go into a file: `data`, made of `length` bytes whose Adler-32 is `adler`."""

    data: bytes
    length: int
    adler: int


@dataclass(frozen=True)
class PngLayout:
    """A PNG of (height, width, 3) integers, linear data with no colour space, and where its rows go.

    late: so many rows from the top come last, in one piece. They are stored without compression, so that room can be
    left for them.
    """

    width: int
    height: int
    dtype: np.dtype[Any]
    late: int = 0

    def packed(self, row: int, rows: Rows) -> Piece:
        """(n, W, 3) rows from `row` on, filtered and deflated."""
        filtered = filtered_rows(rows)
        if row < self.late:
            data = _stored(filtered.data)
        else:
            # Matches take half as long again, and files grow by a third (short ones cost more than codes); runs pay
            # where the map is flat.
            mostly_flat = np.count_nonzero(filtered) < filtered.size / 4
            strategy = zlib.Z_RLE if mostly_flat else zlib.Z_HUFFMAN_ONLY
            deflate = zlib.compressobj(1, zlib.DEFLATED, -15, 7, strategy)
            data = deflate.compress(filtered.data) + deflate.flush(zlib.Z_SYNC_FLUSH)
        return Piece(data, filtered.nbytes, zlib.adler32(filtered.data))

    def write(self, path: Path, pieces: Iterable[tuple[int, Piece]]) -> None:
        """Write the file. pieces: (row, piece) from row `late` down to the last, then the late rows."""
        bits = 8 * self.dtype.itemsize
        adler, late_adler, length = 1, 1, 0
        with path.open("wb") as file:
            file.write(b"\x89PNG\r\n\x1a\n")
            _chunk(file, b"IHDR", struct.pack(">IIBBBBB", self.width, self.height, bits, 2, 0, 0, 0))
            _chunk(file, b"IDAT", b"\x78\x01")
            room = file.tell()
            if self.late:
                _chunk(file, b"IDAT", _stored(bytes(self.late * (1 + 3 * self.width * bits // 8))))
            for row, piece in pieces:
                if row < self.late:
                    file.seek(room)
                    late_adler = piece.adler
                else:
                    adler, length = joined_adler(adler, piece.adler, piece.length), length + piece.length
                _chunk(file, b"IDAT", piece.data)
            file.seek(0, 2)
            # An empty last block, and the checksum.
            _chunk(file, b"IDAT", b"\x03\0" + struct.pack(">I", joined_adler(late_adler, adler, length)))
            _chunk(file, b"IEND", b"")


def _chunk(file: BinaryIO, kind: bytes, data: bytes) -> None:
    file.write(struct.pack(">I", len(data)) + kind)
    file.write(data)
    file.write(struct.pack(">I", zlib.crc32(data, zlib.crc32(kind))))


def filtered_rows(rows: Rows) -> Bytes:
    """(n, W, C) integers -> (n, 1 + W C d) bytes as PNG filters them, each row after its filter's number.

    Rows are filtered by Paeth's predictor, which leaves two thirds of what differences to the left neighbour leave of
    smooth maps; the first, which knows none above it, by these differences.
    """
    count, width, channels = rows.shape
    step = channels * rows.itemsize
    plain = rows.astype(rows.dtype.newbyteorder(">"), copy=False).view(np.uint8).reshape(count, width * step)
    filtered = np.empty((count, 1 + width * step), np.uint8)
    filtered[0, 0], filtered[1:, 0] = 1, 4
    residue = filtered[:, 1:]
    residue[0, :step], residue[1:, :step] = plain[0, :step], plain[1:, :step] - plain[:-1, :step]
    np.subtract(plain[0, step:], plain[0, :-step], out=residue[0, step:])
    together = max(1, _BLOCK // plain.shape[1])
    for row in range(1, count, together):
        here = plain[row - 1 : row + together]
        predicted = paeth(here[1:, :-step], here[:-1, step:], here[:-1, :-step])
        np.subtract(here[1:, step:], predicted, out=residue[row : row + together, step:])
    return filtered


def paeth(left: Bytes, above: Bytes, corner: Bytes) -> Bytes:
    """Of the three bytes the nearest to left + above - corner, the earlier where two are as near (PNG, 9.4).

    That is |above - corner| from `left` and |left - corner| from `above`; and from `corner` the difference of these
    two where it lies between the others, else more than either. So bytes suffice.
    """
    from_left, from_above = _apart(above, corner), _apart(left, corner)
    nearer = np.minimum(from_left, from_above)
    is_corner = np.maximum(from_left, from_above) - nearer < nearer
    is_corner &= (corner > left) != (corner > above)
    # Masks of all bits instead of np.where, which takes four times as long.
    result = _mask(from_left <= from_above) & (left ^ above) ^ above
    return _mask(is_corner) & (result ^ corner) ^ result


def _apart(a: Bytes, b: Bytes) -> Bytes:
    return np.maximum(a, b) - np.minimum(a, b)


def _mask(where: npt.NDArray[np.bool_]) -> Bytes:
    return np.negative(where.view(np.uint8))


def _stored(data: bytes | memoryview) -> bytes:
    """Blocks of deflate that hold `data` as it is: their length follows from its."""
    flat = memoryview(data).cast("B")
    blocks = (flat[at : at + _MOST_STORED] for at in range(0, len(flat), _MOST_STORED))
    return b"".join(struct.pack("<BHH", 0, len(b), len(b) ^ 0xFFFF) + bytes(b) for b in blocks)


def joined_adler(first: int, second: int, length: int) -> int:
    """Adler-32 (RFC 1950) of two pieces one after another, from theirs; length: bytes of the second."""
    prime = 65521
    low = ((first & 0xFFFF) + (second & 0xFFFF) - 1) % prime
    high = ((first >> 16) + (second >> 16) + length * ((first & 0xFFFF) - 1)) % prime
    return high << 16 | low
