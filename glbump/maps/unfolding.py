"""Cubes and hemicubes laid out flat: crosses, strips and columns, cut into tiles and put together again.

A picture of a cube can be read in two ways, which are mirror images of each other, so that no content tells them apart:

- "inside": the picture shows what one sees from inside, as photographs and panoramas do. Right is +X, the front -Z.
- "opengl": the faces are those of the OpenGL table, which looks at the cube in a left-handed frame. Right is +X, the
  front +Z; seen in a right-handed world, the picture is mirrored.

Where the parts are known by their axes instead (strips, columns, files in a given order), an axis is what it says in
both readings, and only one of the two makes the edges meet.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from glbump.errors import ImageError, unknown
from glbump.frozen import Frozen
from glbump.maps.layout import CUBE, HEMICUBE, Layout

F32 = npt.NDArray[np.float32]

ORIENTATIONS = ("opengl", "inside")


class Part(Frozen):
    """A face in a picture: its first cell, its size in cells, and the quarter turns, counter-clockwise, to set it
    upright."""

    row: int
    column: int
    turns: int = 0
    rows: int = 1
    columns: int = 1


class Unfolding(Frozen):
    """A picture of `rows` x `columns` square cells that holds a cube or a hemicube.

    parts: of a cube +X -X +Y -Y +Z -Z, of a hemicube the half sides +X -X +Z -Z and the top, in the "opengl" reading.
    has_front: its parts are right, left, top, bottom, front and back, so that the reading decides where the front is.
    """

    name: str
    layout: Layout
    rows: int
    columns: int
    parts: tuple[Part, ...]
    has_front: bool = False

    @property
    def orientation(self) -> str:
        """The reading unless told: what has a front was drawn to be looked at, and shows what one sees from inside."""
        return "inside" if self.has_front else "opengl"

    def fits(self, width: int, height: int) -> bool:
        """Whether a picture of this size divides into the cells."""
        return width * self.rows == height * self.columns and width % self.columns == 0

    def holes(self, n: int) -> npt.NDArray[np.bool_]:
        """(rows * n, columns * n): the texels of cells that hold no face, n wide."""
        empty = np.ones((self.rows, self.columns), bool)
        for part in self.parts:
            empty[part.row : part.row + part.rows, part.column : part.column + part.columns] = False
        return empty.repeat(n, axis=0).repeat(n, axis=1)

    def read(self, pixels: npt.NDArray[Any], orientation: str) -> F32:
        """Tiles (tiles, H, W, C) of a picture (rows * n, columns * n, C) in the given reading."""
        n = pixels.shape[0] // self.rows
        parts = [np.rot90(pixels[_window(part, n)], part.turns) for part in self.parts]
        if orientation == "inside" and self.has_front:
            _swap_front(self.layout, parts)
        return oriented(self.layout, tiles_of(self.layout, parts), orientation)

    def write(self, tiles: F32, orientation: str) -> F32:
        """Inverse of `read`; cells without a face are black."""
        n = tiles.shape[1]
        parts = parts_of(self.layout, oriented(self.layout, tiles, orientation))
        if orientation == "inside" and self.has_front:
            _swap_front(self.layout, parts)
        picture = np.zeros((self.rows * n, self.columns * n, tiles.shape[3]), np.float32)
        for part, pixels in zip(self.parts, parts, strict=True):
            picture[_window(part, n)] = np.rot90(pixels, -part.turns)
        return picture


def _window(part: Part, n: int) -> tuple[slice, slice]:
    return (
        slice(part.row * n, (part.row + part.rows) * n),
        slice(part.column * n, (part.column + part.columns) * n),
    )


def _swap_front(layout: Layout, parts: list[Any]) -> None:
    z = 4 if layout is CUBE else 2
    parts[z], parts[z + 1] = parts[z + 1], parts[z]


def tiles_of(layout: Layout, parts: list[Any]) -> npt.NDArray[Any]:
    """Faces as the layout's tiles: a hemicube's top is two of them."""
    if layout is CUBE:
        return np.stack(parts)
    half = parts[4].shape[0] // 2
    return np.stack([*parts[:4], parts[4][:half], parts[4][half:]])


def parts_of(layout: Layout, tiles: npt.NDArray[Any]) -> list[npt.NDArray[Any]]:
    """Inverse of tiles_of."""
    return list(tiles) if layout is CUBE else [*tiles[:4], np.concatenate([tiles[4], tiles[5]])]


def oriented(layout: Layout, tiles: npt.NDArray[Any], orientation: str) -> F32:
    """Tiles of one reading in the other, which is its own inverse: sides are mirrored in s, top and bottom in t."""
    if orientation not in ORIENTATIONS:
        raise ImageError(unknown("orientation of cube faces", orientation, ORIENTATIONS))
    if orientation == "inside":
        flat = (2, 3) if layout is CUBE else (4,)
        parts = [part[::-1] if i in flat else part[:, ::-1] for i, part in enumerate(parts_of(layout, tiles))]
        tiles = tiles_of(layout, parts)
    return np.ascontiguousarray(tiles, np.float32)


def _strip(name: str, rows: int, columns: int) -> Unfolding:
    return Unfolding(name, CUBE, rows, columns, tuple(Part(i % rows, i % columns) for i in range(6)))


HCROSS = Unfolding(
    "hcross", CUBE, 3, 4, (Part(1, 2), Part(1, 0), Part(0, 1), Part(2, 1), Part(1, 1), Part(1, 3)), has_front=True
)
# The back hangs below the bottom, upside down, so that the edge between them is whole (HDRShop's cross).
VCROSS = Unfolding(
    "vcross", CUBE, 4, 3, (Part(1, 2), Part(1, 0), Part(0, 1), Part(2, 1), Part(1, 1), Part(3, 1, 2)), has_front=True
)
HSTRIP, VSTRIP = _strip("hstrip", 1, 6), _strip("vstrip", 6, 1)
HEMICUBE_COLUMN = Unfolding(
    "hemicube-column", HEMICUBE, 6, 2, (*(Part(2 + i, 0, 0, 1, 2) for i in range(4)), Part(0, 0, 0, 2, 2))
)
HEMICUBE_CROSS = Unfolding(
    "hemicube-cross",
    HEMICUBE,
    4,
    4,
    (Part(1, 3, -1, 2, 1), Part(1, 0, 1, 2, 1), Part(3, 1, 0, 1, 2), Part(0, 1, 2, 1, 2), Part(1, 1, 0, 2, 2)),
    has_front=True,
)

UNFOLDINGS = {u.name: u for u in (HCROSS, VCROSS, HSTRIP, VSTRIP, HEMICUBE_COLUMN, HEMICUBE_CROSS)}
