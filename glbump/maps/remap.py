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

_LINES = 16
"""Lines of a window that are copied for one image and then for the next, while they are in the cache."""

_TEXEL = np.dtype("V12")
"""Three floats that are moved as one."""

MOST_SHRUNK = 4
"""Texels of the picture for each of the result, past which it does not pay."""

KEPT = 32
"""Blocks whose places are kept between calls, 0.8 MB each: those of a cube of 1024."""


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

    def of(self, dirs: F64) -> F64:
        """Directions of the first quadrant as those of this one."""
        x, y, z = dirs[..., 0], dirs[..., 1], dirs[..., 2]
        x, y = (-x if self.mirrored else x), (-y if self.upside_down else y)
        for _ in range(self.quarters):
            x, z = -z, x
        return np.stack([x, y, z], axis=-1)

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


@lru_cache
def kinds(layout: Layout, is_square: bool) -> tuple[Kind, ...]:
    """All quadrants of a layout, like ones together."""
    s, t = np.array([0.07, 0.41]), np.array([0.13, 0.32])
    found: list[list[Image]] = []
    for tile, right, down in product(range(layout.tiles), (True, False), (True, False)):
        for kind, turned in product(found, (False, True)[: 1 + is_square]):
            quadrant = Quadrant(tile, right, down, turned)
            images = (Image(quadrant, *how) for how in product(range(4), (False, True), (False, True)))
            first, dirs = kind[0].quadrant.dirs(layout, s, t), quadrant.dirs(layout, s, t)
            like = next((image for image in images if np.allclose(image.of(first), dirs, rtol=0, atol=1e-12)), None)
            if like is not None:
                kind.append(like)
                break
        else:
            found.append([Image(Quadrant(tile, right, down, False), 0, False, False)])
    return tuple(tuple(kind) for kind in found)


@dataclass(frozen=True)
class Taps:
    """The texels of a picture that those of a block lie between.

    rows, columns: of the picture, all that the block needs; past 0 and its width where it repeats. taps: (N, 4) of each
    texel the upper left and right and the lower left and right, counted in that window. weights: (N, 4).
    """

    rows: range
    columns: range
    taps: Index
    weights: F32


@lru_cache(KEPT)
def taps_of(size: tuple[int, int], target: Grid, first: Quadrant, rows: range, columns: range) -> Taps:
    """Of a block of a quadrant, in a picture of `size` (width, height)."""
    s, t = ((np.asarray(part) + 0.5) / n for part, n in zip((columns, rows), target.size))
    s, t = ((c - offset) / scale for c, offset, scale in zip((s, t), target.offset, target.scale))
    place = latlong_uv(first.dirs(target.layout, s, t)).reshape(-1, 2) * size - 0.5
    left, top = np.floor(place).T.astype(np.intp)
    a, b = (place - np.floor(place)).T
    weights = np.stack([(1 - a) * (1 - b), a * (1 - b), (1 - a) * b, a * b], axis=-1)
    across, down = range(left.min(), left.max() + 2), range(top.min(), top.max() + 2)
    corner = (top - down.start) * len(across) + left - across.start
    taps = corner[:, None] + np.array([0, 1, len(across), len(across) + 1])
    return Taps(down, across, taps, weights.astype(np.float32))


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
            values = np.einsum("nt,ntk->nk", taps.weights[some], near.take(taps.taps[some], axis=0, mode="clip"))
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
