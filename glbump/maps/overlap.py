"""The cells of a layout's texels, and what each shares with the cells of a lat-long picture.

A cell is bounded by arcs of great circles between its corners (a cube's edges are such arcs; where a layout bends
them, an edge is several, so that a tile has at least 64 along each side). The cells leave no gap and overlap nowhere.
Cells at the border of a tile end there, and those of a disc at its rim.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from glbump.errors import ImageError
from glbump.maps.arcs import Arcs, Cells, Pieces, pieces, turned, under
from glbump.maps.layout import EnvironmentMap, Layout, Pair, on_border

F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]
Index = npt.NDArray[np.intp]
Place = tuple[list[tuple[int, int]], slice, slice]

BLOCK = 64
"""Texels along the sides of the blocks that are worked on at a time: small, so that their arrays stay in the cache."""

ROUNDING = 1e-12
"""Nearer to a pole than this is on it."""


@dataclass(frozen=True)
class Grid:
    """Where an environment's texels lie: size is (width, height) of a tile; scale and offset as in EnvironmentMap."""

    layout: Layout
    size: tuple[int, int]
    scale: Pair = (1.0, 1.0)
    offset: Pair = (0.0, 0.0)

    def __post_init__(self) -> None:
        if min(self.size) < 2:
            width, height = self.size
            raise ImageError(
                f"a tile of a {self.layout.name} environment needs at least 2x2 texels; got {width}x{height}; "
                "choose a larger size"
            )

    @classmethod
    def of(cls, environment: EnvironmentMap) -> Grid:
        """The grid of an environment."""
        return cls(environment.layout, environment.size, environment.scale, environment.offset)

    @classmethod
    def by_size(cls, layout: Layout, size: int, *, border: bool = False) -> Grid:
        """The grid of `layout.shape(size)`; with `border` its outermost samples lie on the tiles' borders."""
        _, height, width = layout.shape(size)
        if border and min(width, height) > 1:
            return cls(layout, (width, height), *on_border((width, height)))
        return cls(layout, (width, height))

    @property
    def shape(self) -> tuple[int, int, int]:
        """Tiles, rows, columns."""
        return self.layout.tiles, self.size[1], self.size[0]

    @property
    def parts(self) -> int:
        """Arcs to a texel's edge. Even where the size is odd: the octahedron's folds cross edges at their middles."""
        least = min(self.size)
        return max(1 << (63 // least).bit_length(), 1 + least % 2)

    @cached_property
    def cells(self) -> Cells:
        """A lat-long grid's texels; where its last column lies on its first, both count as one, the first."""
        width, height = self.size
        columns = round(width * self.scale[0])
        west = 2 * np.pi * (-self.offset[0] / self.scale[0] - 0.5)
        return Cells(columns, height, west, self.scale[1], self.offset[1])

    def places(self, columns: int = 4) -> Iterator[Place]:
        """All blocks of cells: of each the tiles that have its like, the rows and the columns.

        Tiles are alike that are one another turned about +Y by quarters, where `columns` of a lat-long picture are
        too: what a block shares with that picture need be found for the first of them only.
        """
        tiles, height, width = self.shape
        down, right = ([slice(i, min(i + BLOCK, n)) for i in range(0, n, BLOCK)] for n in (height, width))
        groups = [[(tile, 0)] for tile in range(tiles)] if columns % 4 else self._turned
        return ((group, rows, columns) for group in groups for rows in down for columns in right)

    @cached_property
    def _turned(self) -> list[list[tuple[int, int]]]:
        """Groups of tiles and their eastward quarter turns from the first tile of the group."""
        probe = self._probe([0.1, 0.7], [0.2, 0.9])
        groups: list[list[tuple[int, int]]] = []
        for tile, dirs in enumerate(probe):
            x, y, z = np.moveaxis(dirs, -1, 0)
            turns = [np.stack(turn, axis=-1) for turn in ((x, y, z), (z, y, -x), (-x, y, -z), (-z, y, x))]
            for group in groups:
                quarters = [q for q in range(4) if np.allclose(turns[q], probe[group[0][0]], rtol=0, atol=1e-12)]
                if quarters:
                    group.append((tile, quarters[0]))
                    break
            else:
                groups.append([(tile, 0)])
        return groups

    def corners(self, axis: int, first: int, last: int) -> F64:
        """s (axis 0) or t (axis 1) of the edges of texels first..last, with the points between by `parts`."""
        n, k = self.size[axis], self.parts
        at = (np.arange(first * k, last * k + 1) / (k * n) - self.offset[axis]) / self.scale[axis]
        if first == 0:
            at[0] = 0.0
        if last == n:
            at[-1] = 1.0
        return np.clip(at, 0.0, 1.0)

    def dirs(self, tile: int, s: F64, t: F64) -> F64:
        """(len(t), len(s), 3) directions of places on a tile; of a disc's outside, those of its rim."""
        a, b = np.broadcast_arrays(s[None, :] - 0.5, t[:, None] - 0.5)
        if not self.layout.disc:
            return self.layout.dir(tile, a + 0.5, b + 0.5)
        pull = 0.5 / np.maximum(np.hypot(a, b), 0.5)
        dirs = self.layout.dir(tile, 0.5 + a * pull, 0.5 + b * pull)
        # Half of the digits are lost at an orthographic disc's or a mirror ball's rim, which is a horizon, or a point.
        dirs[np.abs(dirs) < 1e-7] = 0.0
        return dirs

    def centres(self, tile: int, rows: slice, columns: slice) -> F64:
        """(h, w, 3) unit directions of the samples of some texels."""
        s = ((np.arange(columns.start, columns.stop) + 0.5) / self.size[0] - self.offset[0]) / self.scale[0]
        t = ((np.arange(rows.start, rows.stop) + 0.5) / self.size[1] - self.offset[1]) / self.scale[1]
        return self.layout.dir(tile, s[None, :], t[:, None])

    def _probe(self, s: list[float], t: list[float]) -> F64:
        """(tiles, len(s), 3) directions of the same places on all tiles."""
        tile = np.arange(self.layout.tiles)[:, None] + np.zeros(len(s), np.intp)
        return self.layout.dir(tile, np.array(s) + 0.0 * tile, np.array(t) + 0.0 * tile)

    @cached_property
    def hands(self) -> F64:
        """(tiles,) 1 where the turn from s to t is the one from longitude to latitude, else -1."""
        return -np.sign(np.linalg.det(self._probe([0.5, 0.6, 0.5], [0.5, 0.5, 0.6])))


class Block:
    """Neighbouring texels of a tile: their solid angles, and what their edges cross.

    A cell's light is the sum over its edges (`around`), rows' edges first, then columns', and `south` times all the
    light there is. north: which cells' sums are right only where light is counted from the north pole on.
    """

    def __init__(self, grid: Grid, tile: int, rows: slice, columns: slice) -> None:
        self._shape = (rows.stop - rows.start, columns.stop - columns.start)
        self._hand = grid.hands[tile]
        s, t = grid.corners(0, columns.start, columns.stop), grid.corners(1, rows.start, rows.stop)
        y, z, x = grid.dirs(tile, s, t).reshape(-1, 3).T
        across = np.hypot(x, y)
        across[across < ROUNDING] = 0.0
        self._x, self._y, self._z = np.where(across > 0, -x, 0.0), np.where(across > 0, y, 0.0), z
        # Any longitude serves for a pole: an arc from there runs along it.
        longitude = np.arctan2(self._y, self._x)
        reference = longitude[len(longitude) // 2]
        self._longitude = np.where(across > 0, reference + turned(longitude - reference), reference)
        self._half = self._z / (1 + across)
        self._start, self._end, self._edge = self._arcs(grid.parts)
        turn = turned(self._longitude[self._end] - self._longitude[self._start])
        # What runs along a meridian has no width; so a cube's upright edges cost nothing.
        some = np.flatnonzero(np.abs(turn) > 1e-15)
        self._start, self._end, self._edge = self._start[some], self._end[some], self._edge[some]
        self._turn = turn[some]
        winding = np.rint(self.around(self.sums(self._edge, self._turn)) / (2 * np.pi))
        area = 2 * np.pi * winding - self.around(
            self.sums(self._edge, under(self._turn, self._half[self._start], self._half[self._end]))
        )
        # Round the south pole, and where a half turn at it was taken for the other one, all the light is too little.
        self.south = -np.floor((area + 1e-6) / (4 * np.pi))
        self.north = winding + self.south != 0
        self.solid_angles = area + 4 * np.pi * self.south

    def _arcs(self, k: int) -> tuple[Index, Index, Index]:
        """First point, last point and edge of all arcs, k to an edge."""
        height, width = self._shape
        point = np.arange((height * k + 1) * (width * k + 1)).reshape(height * k + 1, width * k + 1)
        rows = np.arange((height + 1) * width).reshape(height + 1, width)
        columns = rows.size + np.arange(height * (width + 1)).reshape(height, width + 1)
        start, end = (point[::k, :-1], point[:-1, ::k]), (point[::k, 1:], point[1:, ::k])
        edge = (np.repeat(rows, k, axis=1), np.repeat(columns, k, axis=0))
        first, last, whose = (np.concatenate([part.ravel() for part in both]) for both in (start, end, edge))
        return first, last, whose

    def sums(self, edge: Index, values: F64) -> F64:
        height, width = self._shape
        return np.bincount(edge, values, (height + 1) * width + height * (width + 1)).astype(np.float64, copy=False)

    def around(self, edges: F64) -> F64:
        """(h, w) sums round the cells, counter-clockwise, of values of the edges."""
        height, width = self._shape
        rows = edges[: (height + 1) * width].reshape(height + 1, width)
        columns = edges[(height + 1) * width :].reshape(height, width + 1)
        return self._hand * (np.diff(columns, axis=1) - np.diff(rows, axis=0))

    def between(self, cells: F64) -> F64:
        """Values of the edges: the transpose of around."""
        rows, columns = np.pad(cells, ((1, 1), (0, 0))), np.pad(cells, ((0, 0), (1, 1)))
        return self._hand * np.concatenate([np.diff(rows, axis=0).ravel(), -np.diff(columns, axis=1).ravel()])

    def over(self, cells: Cells) -> Overlap:
        """What this block shares with lat-long cells."""
        eastwards = self._turn > 0
        start, end = np.where(eastwards, self._start, self._end), np.where(eastwards, self._end, self._start)
        (ax, ay, az), (bx, by, bz) = ((self._x[i], self._y[i], self._z[i]) for i in (start, end))
        x0 = (self._longitude[start] - cells.west) / cells.step
        a, b, c = ay * bz - az * by, az * bx - ax * bz, np.abs(ax * by - ay * bx)
        c[c < ROUNDING * np.hypot(a, b)] = 0.0
        # dz / d(lambda) has the sign of a sin(lambda) - b cos(lambda).
        bent = ((a * ay - b * ax) * (a * by - b * bx) < 0) & (c > 0)
        x1 = x0 + np.abs(self._turn) / cells.step
        sign = np.where(eastwards, 1.0, -1.0)
        arcs = Arcs(self._edge, sign, x0, x1, self._half[start], self._half[end], a, b, c, bent)
        return Overlap(self, cells, pieces(arcs, cells))


class Overlap:
    """What the cells of a block share with lat-long cells: a linear map and its transpose.

    P, the light north of a place on its meridian, is told on the edges of the rows that the block reaches, from the
    northernmost of them on; so no sum is longer than it must be.
    """

    def __init__(self, block: Block, cells: Cells, parts: Pieces) -> None:
        self._block, self._cells, self._parts = block, cells, parts
        n, south = cells.columns, bool(block.south.any())
        first, last = (int(parts.column.min()), int(parts.column.max())) if len(parts.column) else (0, 0)
        top, bottom = (int(parts.row.min()), int(parts.row.max())) if len(parts.row) else (0, 0)
        self._count = n if south else min(last - first + 1, n)
        self.rows = slice(0 if block.north.any() else top, cells.rows if south else bottom + 1)
        self._first = first
        self._above = (parts.row - self.rows.start) * self._count + (parts.column - first) % n
        self._thickness = cells.thickness[self.rows][:, None]

    def columns(self, quarters: int) -> Index:
        """The columns that the block reaches when it is turned eastwards."""
        n = self._cells.columns
        return (self._first + quarters * n // 4 + np.arange(self._count)) % n

    def gathered(self, pixels: F32, quarters: int) -> F64:
        """(h, w, C) light, in radiance times steradians, that the block's cells hold of `pixels` (rows, columns, C)."""
        parts, block = self._parts, self._block
        source = pixels[self.rows].take(self.columns(quarters), axis=1)
        north = np.zeros((len(source) + 1, self._count))
        result = np.empty((*block.south.shape, source.shape[2]))
        for channel in range(source.shape[2]):
            np.cumsum(source[..., channel] * self._thickness, axis=0, out=north[1:])
            upper, lower = (north.ravel().take(self._above + shift) for shift in (0, self._count))
            light = block.around(block.sums(parts.edge, parts.width * upper + parts.below * (lower - upper)))
            result[..., channel] = light + block.south * north[-1].sum() * self._cells.step
        return result

    def spread(self, radiance: npt.NDArray[np.floating]) -> F64:
        """(rows, columns, C) the light that the lat-long cells `rows`, `columns` hold of the block's (h, w, C)."""
        parts, block = self._parts, self._block
        rows = self.rows.stop - self.rows.start
        result = np.empty((rows, self._count, radiance.shape[2]))
        for channel in range(radiance.shape[2]):
            one = radiance[..., channel].astype(np.float64)
            value = block.between(one)[parts.edge]
            below = value * parts.below
            north = np.zeros((rows + 1, self._count))
            flat = north.reshape(-1)
            # Of no weights at all bincount makes integers: a block that lies outside a disc has no arcs.
            flat += np.bincount(self._above, value * parts.width - below, flat.size)
            flat += np.bincount(self._above + self._count, below, flat.size)
            north[-1] += (one * block.south).sum() * self._cells.step
            result[..., channel] = self._thickness * np.cumsum(north[:0:-1], axis=0)[::-1]
        return result
