"""Values that a texture look-up may return (OpenGL 4.6, 8.14.2 to 8.15), as intervals for each channel; float64.

A value between texels is linear in u between their centres, and so in v, and linear in the level between two levels;
over a box of u, v and level it is therefore largest and smallest at corners of the box, or where the box crosses a
centre or a whole level. Levels are read apart from each other: each may have its own error of u and v.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from glbump.maps.cube import face_of, pad
from glbump.reference.texturing.interval import F64, Interval, Precision

Index = npt.NDArray[np.intp]
Mask = npt.NDArray[np.bool_]
Nearness = Literal["nearest", "linear"]
Wrap = Literal["repeat", "mirror", "clamp", "border", "mirror-once"]
Texels = Callable[[Index, Index], F64]
Read = Callable[[int, Nearness, Mask], Interval]


@dataclass(frozen=True)
class Filter:
    """texels: how a level is read; levels: how it is chosen; magnify: how level 0 is read where it is enlarged."""

    texels: Nearness = "linear"
    levels: Literal["none", "nearest", "linear"] = "linear"
    magnify: Nearness = "linear"

    @property
    def threshold(self) -> float:
        """The level of detail up to which a texture counts as enlarged: c of 8.15."""
        return 0.5 if self.magnify == "linear" and self.texels == "nearest" and self.levels != "none" else 0.0


def texture_2d(
    levels: Sequence[npt.NDArray[Any]],
    uv: npt.ArrayLike,
    detail: Interval,
    precision: Precision,
    *,
    filter: Filter = Filter(),
    wrap: tuple[Wrap, Wrap] = ("repeat", "repeat"),
    border: npt.ArrayLike = 0.0,
    along: npt.ArrayLike = 0.0,
) -> Interval:
    """Values (..., C) of levels (h, w, C), finest first, row 0 at v = 0, at (..., 2) and a level of detail (...).

    wrap: of u and of v. border: (C,) or one number, outside with wrap "border". along: (..., 2) or one number, by how
    much more u and v are open on either side.
    """
    places = np.asarray(uv, np.float64)
    flat = places.reshape(-1, 2)
    open_by = np.broadcast_to(np.asarray(along, np.float64), places.shape).reshape(-1, 2)

    def read(number: int, how: Nearness, chosen: Mask) -> Interval:
        level = levels[number]

        def box(axis: int) -> Interval:
            u, size = flat[chosen, axis], level.shape[1 - axis]
            error = np.abs(u) * 2.0**-precision.coordinate + open_by[chosen, axis]
            return Interval(u * size, u * size).wider(error * size + 2.0**-precision.subtexel)

        def texel(column: Index, row: Index) -> F64:
            j, i = (wrapped(at, size, how) for at, size, how in zip((column, row), level.shape[1::-1], wrap))
            values: F64 = np.asarray(level[i, j], np.float64)
            outside = (i < 0) | (j < 0)
            if outside.any():
                values[outside] = border
            return values

        return _in_level(texel, box(0), box(1), how)

    return _filtered(read, detail, places.shape[:-1], levels, filter, precision)


def texture_cube(
    levels: Sequence[npt.NDArray[Any]],
    dir: npt.ArrayLike,
    detail: Interval,
    precision: Precision,
    *,
    filter: Filter = Filter(),
) -> Interval:
    """Values (..., C) of a seamless cube of levels (6, n, n, C) in directions (..., 3), any length.

    Beyond a face's edge lie the texels of the neighbouring faces, and in the corners the mean of the three that meet
    (8.13.1). Places are open by half a texel beyond an edge at most.
    """
    dirs = np.asarray(dir, np.float64)
    face, s, t = face_of(dirs.reshape(-1, 3))
    bordered = [pad(np.asarray(level, np.float32)) for level in levels]

    def read(number: int, how: Nearness, chosen: Mask) -> Interval:
        size, faces, mine = levels[number].shape[1], bordered[number], face[chosen]
        error = size * 2.0**-precision.coordinate + 2.0**-precision.subtexel

        def box(place: F64) -> Interval:
            low, high = Interval(place * size, place * size).wider(error)
            # On an edge both faces' texels are nearest.
            low = np.clip(low - np.finfo(np.float64).tiny, -0.5, np.nextafter(size, 0.0))
            return Interval(low, np.minimum(high, size + 0.5))

        def texel(column: Index, row: Index) -> F64:
            i, j = (np.clip(at + 1, 0, size + 1) for at in (row, column))
            values: F64 = faces[mine, i, j].astype(np.float64)
            return values

        return _in_level(texel, box(s[chosen]), box(t[chosen]), how)

    return _filtered(read, detail, dirs.shape[:-1], levels, filter, precision)


def anisotropic_2d(
    levels: Sequence[npt.NDArray[Any]],
    uv: npt.ArrayLike,
    ddx: npt.ArrayLike,
    ddy: npt.ArrayLike,
    detail: Interval,
    precision: Precision,
    *,
    limit: int,
    wrap: tuple[Wrap, Wrap] = ("repeat", "repeat"),
) -> Interval:
    """Values (..., C) of an anisotropic trilinear look-up: of any weights of any samples in the footprint.

    ddx, ddy: changes (..., 2) of uv; detail: of glbump.reference.texturing.detail.detail_anisotropic.
    EXT_texture_filter_anisotropic leaves samples and weights open, so whatever lies between values there is allowed.
    """
    places = np.asarray(uv, np.float64)
    x, y = (np.broadcast_to(np.asarray(side, np.float64), places.shape) for side in (ddx, ddy))
    texels = np.array(levels[0].shape[1::-1], np.float64)
    is_x = (np.linalg.norm(x * texels, axis=-1) >= np.linalg.norm(y * texels, axis=-1))[..., None]
    longer, shorter = np.where(is_x, x, y), np.where(is_x, y, x)
    # Boxes one after another on the longer side: half a texel, of the finest level read, and the shorter side.
    count = 2 * limit
    reach = np.abs(longer) / (2 * count) + np.abs(shorter) / 2
    found = [
        texture_2d(levels, places + longer * offset, detail, precision, wrap=wrap, along=reach)
        for offset in (np.arange(count) + 0.5) / count - 0.5
    ]
    return Interval(np.min([f.low for f in found], axis=0), np.max([f.high for f in found], axis=0))


def wrapped(at: Index, size: int, how: Wrap) -> Index:
    """Texel numbers 0..size - 1 for any numbers (table 8.20); -1 for the border."""
    if how == "repeat":
        return at % size
    if how == "mirror":
        turned = at % (2 * size)
        return np.minimum(turned, 2 * size - 1 - turned)
    if how == "mirror-once":
        return np.minimum(np.where(at < 0, -1 - at, at), size - 1)
    if how == "border":
        return np.where((at < 0) | (at >= size), -1, at)
    return np.clip(at, 0, size - 1)


# ------------------------------------------------------------ one level


def _in_level(texel: Texels, u: Interval, v: Interval, how: Nearness) -> Interval:
    """Values (K, C) at places from u.low to u.high and v.low to v.high, (K,) each, in texels."""
    one = _bilinear if how == "linear" else _nearest
    low: F64 | None = None
    for x in _places(u, how):
        for y in _places(v, how):
            value = one(texel, x, y)
            if low is None:
                low = high = value
            else:
                low, high = np.minimum(low, value), np.maximum(high, value)
    assert low is not None
    return Interval(low, high)


def _places(box: Interval, how: Nearness) -> Iterator[F64]:
    """The ends of the box, and what lies between: centres of texels, or a place in every texel."""
    offset = 0.5 if how == "linear" else 0.0
    return _steps(box, np.floor(box.low - offset) + offset)


def _steps(box: Interval, first: F64) -> Iterator[F64]:
    widest = np.max(box.high - box.low, initial=0.0)
    for step in range(int(np.ceil(widest)) + 2):
        yield np.clip(first + step, box.low, box.high)


def _nearest(texel: Texels, x: F64, y: F64) -> F64:
    return texel(np.floor(x).astype(np.intp), np.floor(y).astype(np.intp))


def _bilinear(texel: Texels, x: F64, y: F64) -> F64:
    left, upper = np.floor(x - 0.5), np.floor(y - 0.5)
    a, b = (x - 0.5 - left)[:, None], (y - 0.5 - upper)[:, None]
    j, i = left.astype(np.intp), upper.astype(np.intp)
    # Where all four are alike, so is the result, to the last bit.
    one, other = (_mixed(texel(j, row), texel(j + 1, row), a) for row in (i, i + 1))
    return _mixed(one, other, b)


def _mixed(a: F64, b: F64, weight: F64) -> F64:
    return a + weight * (b - a)


# ------------------------------------------------------------ levels


def _filtered(
    read: Read,
    detail: Interval,
    shape: tuple[int, ...],
    levels: Sequence[npt.NDArray[Any]],
    filter: Filter,
    precision: Precision,
) -> Interval:
    """Values (*shape, C): enlarged, reduced, or, where the level of detail leaves that open, either."""
    flat = Interval(*(np.broadcast_to(end, shape).ravel() for end in detail))
    channels = levels[0].shape[-1]
    low, high = np.full((len(flat.low), channels), np.inf), np.full((len(flat.low), channels), -np.inf)
    enlarged, reduced = flat.low <= filter.threshold, flat.high > filter.threshold
    if enlarged.any():
        low[enlarged], high[enlarged] = read(0, filter.magnify, enlarged)
    if reduced.any():
        count = len(levels) if filter.levels != "none" else 1
        if filter.levels == "linear":
            flat = flat.wider(2.0**-precision.mip)
        most = Interval(*(np.clip(end, max(filter.threshold, 0.0), count - 1) for end in flat))
        found = _through_levels(read, most, reduced, count, channels, filter)
        low[reduced] = np.minimum(low[reduced], found.low[reduced])
        high[reduced] = np.maximum(high[reduced], found.high[reduced])
    result = Interval(low, high).wider(precision.colour)
    return Interval(*(end.reshape(*shape, channels) for end in result))


def _through_levels(read: Read, detail: Interval, wanted: Mask, count: int, channels: int, filter: Filter) -> Interval:
    """Values (K, C) at levels of detail (K,) within 0..count - 1; without meaning where they are not wanted."""
    if filter.levels == "linear":
        first, last = np.floor(detail.low), np.ceil(detail.high)
    else:
        # d = ceil(lambda + 1/2) - 1, or floor(lambda + 1/2) (8.14.3).
        first, last = np.ceil(detail.low + 0.5) - 1, np.minimum(np.floor(detail.high + 0.5), count - 1)
    lows = np.full((count, len(first), channels), np.inf)
    highs = np.full((count, len(first), channels), -np.inf)
    for number in range(count):
        chosen = wanted & (first <= number) & (number <= last)
        if chosen.any():
            lows[number, chosen], highs[number, chosen] = read(number, filter.texels, chosen)
    if filter.levels != "linear":
        return Interval(lows.min(axis=0), highs.max(axis=0))
    at = np.arange(len(first))
    low, high = np.full(lows.shape[1:], np.inf), np.full(lows.shape[1:], -np.inf)
    for level in _steps(Interval(detail.low[wanted], detail.high[wanted]), first[wanted]):
        fine, coarse = np.floor(level).astype(np.intp), np.ceil(level).astype(np.intp)
        weight = (level - fine)[:, None]
        k = at[wanted]
        low[k] = np.minimum(low[k], _mixed(lows[fine, k], lows[coarse, k], weight))
        high[k] = np.maximum(high[k], _mixed(highs[fine, k], highs[coarse, k], weight))
    return Interval(low, high)
