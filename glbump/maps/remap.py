"""Lat-long pictures in other layouts, one bilinear read for each texel: what `glbump.maps.layout.sample` gives, faster.

A lat-long picture knows sixteen symmetries: quarter turns, left for right, upside down. Most quadrants of a layout's
tiles are images of one another under them (a cube's 24 are two kinds). So places and weights are found for one quadrant
of each kind, and texels that are images of one another are read together, as one row of numbers.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from itertools import product

import numpy as np
import numpy.typing as npt

from glbump.maps.area import do_each
from glbump.maps.layout import LATLONG, Layout, latlong_uv
from glbump.maps.overlap import Grid

F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]
Index = npt.NDArray[np.intp]
Texels = npt.NDArray[np.void]

BLOCK = 128
"""Texels along the sides of the blocks that are worked on at a time."""

AT_ONCE = 1024
"""Texels of a block whose taps are read at a time, so that they stay in the second-level cache."""

SAME = 1e-12
"""Directions that differ by no more are one: rounding is 1e-15, unlike quadrants differ by 0.1."""

_LINES = 16
"""Lines of a window that are copied for one image and then for the next, while they are in the cache."""

_TEXEL = np.dtype("V12")
"""Three floats that are moved as one."""

MOST_SHRUNK = 4
"""Texels of the picture for each of the result, past which it does not pay."""

KEPT = 32
"""Blocks whose places are kept between calls, 0.4 MB each: those of a cube of 1024."""


@dataclass(frozen=True)
class Quadrant:
    """A quarter of a tile, which begins at a corner. right, down: whether rows and columns run away from the upper left
    corner of the tile, or towards it from another. turned: rows are columns."""

    tile: int
    right: bool
    down: bool
    turned: bool

    def dirs(self, layout: Layout, s: npt.ArrayLike, t: npt.ArrayLike) -> F64:
        """(h, w, 3): s and t count from the corner."""
        a, b = np.broadcast_arrays(np.asarray(s)[None, :], np.asarray(t)[:, None])
        a, b = (b, a) if self.turned else (a, b)
        return layout.dir(self.tile, a if self.right else 1 - a, b if self.down else 1 - b)

    def view(self, texels: Texels) -> Texels:
        """The quadrant of tiles (tiles, H, W) as rows and columns from its corner: to write into."""
        tile = texels[self.tile, :: 1 if self.down else -1, :: 1 if self.right else -1]
        height, width = tile.shape
        return (tile.T if self.turned else tile)[: height // 2, : width // 2]


@dataclass(frozen=True)
class Image:
    """A quadrant that is the first of its kind turned by quarters eastwards, after it was mirrored."""

    quadrant: Quadrant
    quarters: int
    mirrored: bool
    upside_down: bool

    def window(self, source: Texels, rows: range, columns: range) -> Texels:
        """(h, w) of a lat-long picture (H, W), so turned and mirrored, that it repeats sideways; of the rows those
        that there are."""
        height, width = source.shape
        picture = source[:: -1 if self.upside_down else 1, :: -1 if self.mirrored else 1]
        picture = picture[max(rows.start, 0) : min(rows.stop, height)]
        quarter = width // 4 * (-1 if self.mirrored else 1)
        first = (columns.start + self.quarters * quarter) % width
        if first + len(columns) <= width:
            return picture[:, first : first + len(columns)]
        return picture.take((first + np.arange(len(columns))) % width, axis=1)


Kind = tuple[Image, ...]


SYMMETRIES = tuple(product(range(4), (False, True), (False, True)))
"""Quarters, mirrored, upside down."""


def images(dirs: F64) -> F64:
    """(16, ..., 3) directions (..., 3) after each of SYMMETRIES."""
    mirrored = np.array([[-1.0 if m else 1.0, -1.0 if u else 1.0, 1.0] for _, m, u in SYMMETRIES])
    eastwards = np.array([[0, 0, -1], [0, 1, 0], [1, 0, 0]])
    turns = np.stack([np.linalg.matrix_power(eastwards, quarters) for quarters, _, _ in SYMMETRIES])
    return np.einsum("sij,sj,...j->s...i", turns, mirrored, dirs)


@lru_cache
def kinds(layout: Layout, is_square: bool) -> tuple[Kind, ...]:
    """All quadrants of a layout, like ones together."""
    s, t = np.array([0.07, 0.41]), np.array([0.13, 0.32])
    found: list[tuple[F64, list[Image]]] = []
    for tile, right, down in product(range(layout.tiles), (True, False), (True, False)):
        quadrants = [Quadrant(tile, right, down, turned) for turned in (False, True)[: 1 + is_square]]
        for quadrant, (first, kind) in product(quadrants, found):
            apart = np.abs(first - quadrant.dirs(layout, s, t)).max(axis=(1, 2, 3))
            if apart.min() < SAME:
                kind.append(Image(quadrant, *SYMMETRIES[apart.argmin()]))
                break
        else:
            found.append((images(quadrants[0].dirs(layout, s, t)), [Image(quadrants[0], *SYMMETRIES[0])]))
    return tuple(tuple(kind) for _, kind in found)


@dataclass(frozen=True)
class Taps:
    """The texels of a picture that those of a block lie between.

    rows, columns: of the picture, all that the block needs; past 0 and its width where it repeats. first: (N,) of each
    texel the upper left of its four, counted in that window. weights: (N, 4) of upper left and right, lower left and
    right.
    """

    rows: range
    columns: range
    first: Index
    weights: F32

    def four(self, some: slice) -> Index:
        """(n, 4): the four of some texels."""
        return self.first[some, None] + np.array([0, 1, len(self.columns), len(self.columns) + 1])


@lru_cache(KEPT)
def taps_of(size: tuple[int, int], target: Grid, first: Quadrant, rows: range, columns: range) -> Taps:
    """Of a block of a quadrant, in a picture of `size` (width, height)."""
    s, t = ((np.asarray(part) + 0.5) / n for part, n in zip((columns, rows), target.size))
    s, t = ((c - offset) / scale for c, offset, scale in zip((s, t), target.offset, target.scale))
    place = latlong_uv(first.dirs(target.layout, s, t)).reshape(-1, 2) * size - 0.5
    corner = np.floor(place)
    a, b = (place - corner).astype(np.float32).T
    weights = np.empty((len(place), 4), np.float32)
    weights[:, 3] = a * b
    weights[:, 1], weights[:, 2] = a - weights[:, 3], b - weights[:, 3]
    weights[:, 0] = 1 - a - weights[:, 2]
    left, top = corner.astype(np.intp).T
    across, down = range(left.min(), left.max() + 2), range(top.min(), top.max() + 2)
    return Taps(down, across, (top - down.start) * len(across) + left - across.start, weights)


def serves(source: Grid, target: Grid) -> bool:
    """Whether `from_latlong` is for these: a lat-long picture with all its symmetries, tiles that have quadrants, and
    enough texels that most of the picture's are read."""
    width, height = source.size
    is_whole = source.layout is LATLONG and source.scale == (1.0, 1.0) and source.offset == (0.0, 0.0)
    is_even = not (width % 4 or height % 2 or target.size[0] % 2 or target.size[1] % 2)
    return is_whole and is_even and width * height <= MOST_SHRUNK * math.prod(target.shape)


def from_latlong(pixels: F32, target: Grid) -> F32:
    """(tiles, h, w, 3) float32 radiance of a lat-long picture (H, W, 3) at the centres of the target's texels; for
    grids that it `serves`."""
    source = np.ascontiguousarray(pixels, np.float32).view(_TEXEL)[..., 0]
    result = np.empty((*target.shape, 3), np.float32)
    texels = result.view(_TEXEL)[..., 0]
    size, (width, height) = (source.shape[1], source.shape[0]), (target.size[0] // 2, target.size[1] // 2)

    def work(block: tuple[Kind, range, range]) -> None:
        kind, rows, columns = block
        taps = taps_of(size, target, kind[0].quadrant, rows, columns)
        near = _together(source, kind, taps.rows, taps.columns)
        parts = [i.quadrant.view(texels)[rows.start : rows.stop, columns.start : columns.stop] for i in kind]
        lines = max(1, AT_ONCE // len(columns))
        for first in range(0, len(rows), lines):
            some = slice(first * len(columns), (first + lines) * len(columns))
            values = np.einsum("nt,ntk->nk", taps.weights[some], near.take(taps.four(some), axis=0, mode="clip"))
            values = values.view(_TEXEL).reshape(-1, len(columns), len(kind))
            for i, part in enumerate(parts):
                part[first : first + lines] = values[..., i]

    down, right = ([range(i, min(i + BLOCK, n)) for i in range(0, n, BLOCK)] for n in (height, width))
    do_each(work, product(kinds(target.layout, width == height), down, right))
    return result


def _together(source: Texels, kind: Kind, rows: range, columns: range) -> F32:
    """(rows x columns, images x 3): a window of the picture, its images side by side."""
    near = np.empty((len(rows), len(columns), len(kind)), _TEXEL)
    inside = near[max(0, -rows.start) : len(rows) - max(0, rows.stop - len(source))]
    windows = [image.window(source, rows, columns) for image in kind]
    for first in range(0, len(inside), _LINES):
        for i, window in enumerate(windows):
            inside[first : first + _LINES, :, i] = window[first : first + _LINES]
    # The picture's first and last row go on past the poles.
    if rows.start < 0:
        near[0] = near[1]
    if rows.stop > len(source):
        near[-1] = near[-2]
    return near.view(np.float32).reshape(len(rows) * len(columns), -1)
