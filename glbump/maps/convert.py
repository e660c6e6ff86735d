"""Environments from layout to layout and size to size, and the account of their light before and after."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
import numpy.typing as npt

from glbump.errors import ImageError, unknown
from glbump.maps import remap
from glbump.maps.area import area_means, do_each, solid_angles, weld
from glbump.maps.layout import LATLONG, EnvironmentMap, Layout, completed, sample
from glbump.maps.overlap import Grid, Place

F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]
Filter = Literal["area", "bilinear"]
Colour = tuple[float, float, float]

FILTERS: tuple[Filter, ...] = ("area", "bilinear")


def convert(
    environment: EnvironmentMap,
    layout: Layout,
    size: int,
    filter: Filter | None = None,
    *,
    border: bool = False,
    below: Colour | None = None,
    clamp: float | None = None,
) -> EnvironmentMap:
    """The environment in another layout, with tiles `size` texels high (a hemicube's: wide); float32, linear light.

    filter: "area" gives each texel the mean radiance over its solid angle and keeps total radiance; "bilinear" the
    radiance at its centre; None is area when shrinking and bilinear when enlarging, by texels to the steradian.
    border: the outermost samples lie on the tiles' borders, as OpenEXR has them. below: radiance under the horizon of a
    layout of the upper half; None mirrors the upper half. clamp: radiance above it is cut off before all else.
    ImageError for sizes below 2, unknown filters, NaN and infinities.
    """
    source, target = Grid.of(environment), Grid.by_size(layout, size, border=border)
    if filter is None:
        filter = "area" if texels_per_steradian(source) > texels_per_steradian(target) else "bilinear"
    elif filter not in FILTERS:
        raise ImageError(unknown("filter", filter, FILTERS))
    _require_finite(environment.pixels)
    if clamp is not None:
        environment = clamped(environment, clamp)
    if filter == "area":
        pixels = area_means(environment.pixels, source, target, below)
    else:
        pixels = bilinear(environment, target, below)
    return EnvironmentMap(layout, pixels, target.scale, target.offset, environment.notes)


def texels_per_steradian(grid: Grid) -> float:
    """The mean over what the layout shows."""
    return float(np.prod(grid.shape)) / (4 * np.pi if grid.layout.whole else 2 * np.pi)


def _require_finite(pixels: F32) -> None:
    flat = pixels.reshape(-1)
    # The sum of squares is finite unless a value is not, or some are past 1e19: one quick pass.
    with np.errstate(over="ignore", invalid="ignore"):
        squares = np.dot(flat, flat)
    if not np.isfinite(squares) and not np.isfinite(flat).all():
        bad = ~np.isfinite(pixels)
        tile, row, column, channel = np.argwhere(bad)[0]
        value = pixels[tile, row, column, channel]
        raise ImageError(
            f"the environment has {bad.sum()} values that are NaN or infinite, the first {value} in tile "
            f"{tile}, row {row}, column {column}; radiance must be finite; mend the picture"
        )


def bilinear(environment: EnvironmentMap, target: Grid, below: Colour | None = None) -> F32:
    """(tiles, h, w, 3) float32 radiance at the centres of the target's texels, as `sample` has it."""
    if remap.serves(Grid.of(environment), target):
        result = remap.from_latlong(environment.pixels[0], target)
    else:
        result = _one_by_one(environment, target, below)
    if target.scale != (1.0, 1.0):
        weld(result, np.ones(target.shape), target)
    return completed(target.layout, result)


def _one_by_one(environment: EnvironmentMap, target: Grid, below: Colour | None) -> F32:
    result = np.empty((*target.shape, 3), np.float32)
    # Once, before threads ask for it.
    assert environment.padded is not None

    def work(place: Place) -> None:
        tiles, rows, columns = place
        for tile, _ in tiles:
            dirs = target.centres(tile, rows, columns)
            values = sample(environment, dirs)
            if below is not None and not environment.layout.whole:
                values[dirs[..., 1] < 0] = below
            result[tile, rows, columns] = values

    do_each(work, target.places())
    return result


def clamped(environment: EnvironmentMap, most: float) -> EnvironmentMap:
    """The environment with no radiance above `most`."""
    return replace(environment, pixels=np.minimum(environment.pixels, np.float32(most)))


def total_radiance(environment: EnvironmentMap) -> F64:
    """(3,) float64: radiance integrated over the directions that the layout shows (W / m2 for W / (m2 sr))."""
    return np.einsum("thwc,thw->c", environment.pixels, solid_angles(Grid.of(environment)))


def radiance_below(environment: EnvironmentMap) -> F64:
    """(3,) float64: radiance integrated over the directions below the horizon that the layout shows."""
    if not environment.layout.whole:
        return np.zeros(3)
    halves = Grid.by_size(LATLONG, 2)
    means = area_means(environment.pixels, Grid.of(environment), halves)
    return np.pi * means[0, 1].sum(axis=0, dtype=np.float64) / 2


@dataclass(frozen=True, eq=False)
class Ledger:
    """Where an environment's light went; arrays are (3,) float64: radiance over directions.

    before, after: in all. clamped: what a clamp removed. left_out: what lay below the horizon, where the new layout
    shows the upper half alone. filled: what lies below it, where the old one did. largest_before, largest_after: value.
    """

    before: F64
    after: F64
    clamped: F64
    left_out: F64
    filled: F64
    largest_before: float
    largest_after: float

    @property
    def error(self) -> F64:
        """(3,) what came without a cause, relative to what should be there; the error of the conversion itself."""
        expected = self.before - self.clamped - self.left_out + self.filled
        scale = np.maximum(np.abs(expected), np.finfo(np.float32).tiny)
        return (self.after - expected) / scale


def ledger(before: EnvironmentMap, after: EnvironmentMap, clamp: float | None = None) -> Ledger:
    """The account of a conversion that was told to `clamp` the radiance before all else."""
    kept = before if clamp is None else clamped(before, clamp)
    total = total_radiance(before)
    return Ledger(
        before=total,
        after=total_radiance(after),
        clamped=np.zeros(3) if clamp is None else total - total_radiance(kept),
        left_out=np.zeros(3) if after.layout.whole else radiance_below(kept),
        filled=np.zeros(3) if before.layout.whole else radiance_below(after),
        largest_before=float(before.pixels.max()),
        largest_after=float(after.pixels.max()),
    )
