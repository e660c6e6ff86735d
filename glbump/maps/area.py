"""Environments between layouts by area: each texel becomes the mean of the source over its cell, exactly.

The light that a target cell holds is found without sampling (glbump.maps.arcs), and cells neither overlap nor leave
gaps (glbump.maps.overlap). So total radiance is kept to the rounding of float32, and so is a constant.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from glbump.maps.arcs import Cells
from glbump.maps.layout import LATLONG, completed, texel_dirs
from glbump.maps.overlap import BLOCK, Block, Grid, Place

F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]
Index = npt.NDArray[np.intp]

VANISHED = 1e-9
"""Cells below this share of the mean solid angle, at the rim of a disc, show nothing of their own."""


Part = TypeVar("Part")
Result = TypeVar("Result")

MOST_THREADS = 4
"""More would wait for one another, and each needs some 10 MB."""


def each(work: Callable[[Part], Result], parts: Iterable[Part]) -> Iterator[Result]:
    """work(part) of all parts, in their order, on several processors: NumPy lets threads run side by side."""
    with ThreadPoolExecutor(min(os.cpu_count() or 1, MOST_THREADS)) as pool:
        yield from pool.map(work, parts)


def do_each(work: Callable[[Part], None], parts: Iterable[Part]) -> None:
    """work(part) for all parts, on several processors."""
    for _ in each(work, parts):
        pass


def solid_angles(grid: Grid) -> F64:
    """(tiles, H, W) float64 steradians of the texels' cells; where samples share a direction, each has a part of it."""
    result = np.empty(grid.shape)
    if grid.layout is LATLONG:
        result[:] = (grid.cells.thickness * grid.cells.step)[:, None]
        if grid.size[0] > grid.cells.columns:
            result[..., [0, -1]] *= 0.5
        return result

    def work(place: Place) -> None:
        tiles, rows, columns = place
        block = Block(grid, tiles[0][0], rows, columns)
        for tile, _ in tiles:
            result[tile, rows, columns] = block.solid_angles

    do_each(work, grid.places())
    return result


def _once(pixels: F32, cells: Cells) -> F32:
    """(H, columns, C): a lat-long picture whose last column lies on its first has their mean there."""
    if pixels.shape[1] == cells.columns:
        return pixels
    seam = 0.5 * (pixels[:, :1] + pixels[:, -1:])
    return np.concatenate([seam, pixels[:, 1:-1]], axis=1)


def from_latlong(pixels: F32, source: Grid, target: Grid) -> F32:
    """Means (tiles, h, w, C) float32 over the target's cells of a lat-long picture (H, W, C).

    Of a layout of the upper half, the lower half's light is left out.
    """
    cells = source.cells
    once = _once(pixels, cells)
    result = np.empty((*target.shape, pixels.shape[-1]), np.float32)
    shown = np.empty(target.shape, bool)
    least = VANISHED * 4 * np.pi / shown.size

    def work(place: Place) -> None:
        tiles, rows, columns = place
        block = Block(target, tiles[0][0], rows, columns)
        overlap, area = block.over(cells), block.solid_angles
        for tile, quarters in tiles:
            light = overlap.gathered(once, quarters)
            result[tile, rows, columns] = light / np.where(area > least, area, np.inf)[..., None]
            shown[tile, rows, columns] = area > least

    do_each(work, target.places(cells.columns))
    if target.scale != (1.0, 1.0):
        weld(result, solid_angles(target), target)
    if target.layout.disc:
        np.copyto(result, completed(target.layout, result), where=~shown[..., None])
    return result


def to_latlong(pixels: F32, source: Grid, target: Grid, below: tuple[float, ...] | None = None) -> F32:
    """Means (H, W, C) float32 over lat-long cells of a map (tiles, h, w, C).

    below: what lies under the horizon of a layout of the upper half; None mirrors the upper half.
    """
    cells = target.cells
    light = np.zeros((cells.rows, cells.columns, pixels.shape[-1]), np.float32)

    def work(place: Place) -> list[tuple[slice, Index, F64]]:
        tiles, rows, columns = place
        overlap = Block(source, tiles[0][0], rows, columns).over(cells)
        return [
            (overlap.rows, overlap.columns(quarters), overlap.spread(pixels[tile, rows, columns]))
            for tile, quarters in tiles
        ]

    # In order, so that the same call gives the same bits.
    for held in each(work, source.places(cells.columns)):
        for rows, columns, part in held:
            light[rows, columns] += part
    if not source.layout.whole:
        if below is None:
            light += light[::-1]
        else:
            lower = -np.diff(np.minimum(cells.z, 0.0)) * cells.step
            light += lower[:, None, None] * np.asarray(below)
    light /= (cells.thickness * cells.step)[:, None, None]
    return _on_poles_and_seam(light, target)


def _on_poles_and_seam(pixels: F32, grid: Grid) -> F32:
    """A picture on lat-long cells as samples of `grid`: those on a pole are one, and so are the two ends of a row."""
    if grid.scale[1] < 1.0:
        for row in (0, -1):
            pixels[row] = pixels[row].mean(axis=0, dtype=np.float64)
    return pixels if grid.size[0] == grid.cells.columns else np.concatenate([pixels, pixels[:, :1]], axis=1)


def weld(pixels: F32, areas: npt.NDArray[np.floating], grid: Grid) -> None:
    """Samples on the borders of tiles that show one direction get their common mean, by solid angle, in place."""
    ring = np.ones(grid.shape, bool)
    ring[:, 1:-1, 1:-1] = False
    dirs = texel_dirs(grid.layout, grid.size, grid.scale, grid.offset)[ring]
    # Far finer than texels, far coarser than rounding; the shift keeps the layouts' round values off the cells' edges.
    _, group = np.unique(np.floor(dirs * 1e6 + 0.2718281828), axis=0, return_inverse=True)
    area = areas[ring].astype(np.float64)
    total = np.bincount(group, area)
    for channel in range(pixels.shape[-1]):
        light = np.bincount(group, area * pixels[ring, channel])
        mean = np.divide(light, total, out=np.zeros_like(light), where=total > 0)
        pixels[ring, channel] = mean[group]


class Shares:
    """Lengths that the cells of two divisions of one line share.

    cell, length: of every share its source cell and its length; first: of every target cell its first share.
    """

    def __init__(self, old: npt.NDArray[np.floating], new: npt.NDArray[np.floating]) -> None:
        edges = np.union1d(old[(old > new[0]) & (old < new[-1])], new)
        middles = 0.5 * (edges[1:] + edges[:-1])
        self.cell = np.searchsorted(old, middles) - 1
        self.length = np.diff(edges)
        self.first = np.searchsorted(middles, new[:-1])

    def means(self, values: npt.NDArray[np.floating], axis: int, targets: slice) -> F64:
        """Means over some target cells of the source cells' values along an axis."""
        first = self.first[targets]
        end = self.first[targets.stop] if targets.stop < len(self.first) else len(self.cell)
        part = slice(first[0], end)
        length = self.length[part]
        shape = [-1 if i == axis else 1 for i in range(values.ndim)]
        shared = values.take(self.cell[part], axis=axis) * length.reshape(shape)
        total = np.add.reduceat(length, first - first[0]).reshape(shape)
        return np.add.reduceat(shared, first - first[0], axis=axis) / total


def latlong_to_latlong(pixels: F32, source: Grid, target: Grid) -> F32:
    """Means (h, w, C) float32 over lat-long cells of a lat-long picture (H, W, C): along columns, then along rows."""
    old, new = source.cells, target.cells
    once = _once(pixels, old)
    west = ((new.west - old.west) / old.step) % old.columns
    around = Shares(np.arange(2 * old.columns + 1.0), west + np.arange(new.columns + 1) * (old.columns / new.columns))
    around.cell %= old.columns
    down = Shares(-old.z, -new.z)
    result = np.empty((new.rows, new.columns, pixels.shape[-1]), np.float32)
    band = max(1, BLOCK * new.rows // max(old.rows, new.rows))

    def work(first: int) -> None:
        rows = slice(first, min(first + band, new.rows))
        result[rows] = around.means(down.means(once, 0, rows), 1, slice(0, new.columns))

    do_each(work, range(0, new.rows, band))
    return _on_poles_and_seam(result, target)


def nested(source: Grid, target: Grid) -> bool:
    """Whether each cell of the one is made of whole cells of the other."""
    (w, h), (width, height) = target.size, source.size
    whole = (width % w == 0 and height % h == 0) or (w % width == 0 and h % height == 0)
    # Where edges bend, many small cells are not quite a large one.
    same = source.layout is target.layout and source.scale == target.scale == (1.0, 1.0)
    return whole and same and not source.layout.disc


def within_layout(pixels: F32, source: Grid, target: Grid) -> F32:
    """Means (tiles, h, w, C) float32 over the cells of `nested` grids."""
    (w, h), (width, height) = target.size, source.size
    if w > width:
        return pixels.repeat(h // height, axis=1).repeat(w // width, axis=2)
    tiles, channels = source.layout.tiles, pixels.shape[-1]
    boxes = (tiles, h, height // h, w, width // w)
    area = solid_angles(source).reshape(boxes)
    light = np.einsum("tiajbc,tiajb->tijc", pixels.reshape(*boxes, channels), area)
    return (light / area.sum(axis=(2, 4))[..., None]).astype(np.float32)


def area_means(pixels: F32, source: Grid, target: Grid, below: tuple[float, ...] | None = None) -> F32:
    """Means (tiles, h, w, C) float32 over the target's cells of a map (tiles, H, W, C); below as in `to_latlong`.

    Exact from and to lat-long, and within a layout at whole ratios. Between two others it is exact in energy, by way of
    a lat-long picture at least twice as fine as both, so that light strays by half a texel at most.
    """
    means = _means(pixels, source, target, below)
    # A mean is no less than the least and no more than the most; a sum with rounding may be, next to a sun.
    values = (pixels.min(), pixels.max(), *(below or ()))
    return np.clip(means, min(values), max(values), out=means)


def _means(pixels: F32, source: Grid, target: Grid, below: tuple[float, ...] | None) -> F32:
    if nested(source, target) and source.layout is not LATLONG:
        return within_layout(pixels, source, target)
    if source.layout is LATLONG and target.layout is LATLONG:
        return latlong_to_latlong(pixels[0], source, target)[None]
    if source.layout is LATLONG:
        return from_latlong(pixels[0], source, target)
    if target.layout is LATLONG:
        return to_latlong(pixels, source, target, below)[None]
    texels = max(np.prod(grid.shape) * (1 if grid.layout.whole else 2) for grid in (source, target))
    between = Grid.by_size(LATLONG, 2 * int(np.ceil(np.sqrt(texels / 2))))
    return from_latlong(to_latlong(pixels, source, between, below), between, target)
