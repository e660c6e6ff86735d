"""Mip levels of environments: each texel is the mean of the light over the solid angle that it covers.

So the light in all directions together, the sum of radiance times solid angle, is the same at every level; where texels
were counted alike, the poles of a lat-long picture would count as much as its equator, and a sun in the corner of a
cube's face five times less than one in its middle.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from glbump.maps import pyramid
from glbump.maps.cube import PIECE
from glbump.maps.layout import (
    CUBE,
    HEMICUBE,
    LATLONG,
    PARABOLOID,
    EnvironmentMap,
    Layout,
    beside_rim,
    on_border,
    sample,
    texel_dirs,
)
from glbump.maps.poles import rows_at_poles, texels_at_rim

F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]


def level_sizes(environment: EnvironmentMap) -> list[tuple[int, int]]:
    """Width and height of a tile in each of environment_levels."""
    width, height = environment.size
    return [(max(width >> i, 1), max(height >> i, 1)) for i in range(max(width, height).bit_length())]


def environment_levels(environment: EnvironmentMap, how: str = "box") -> list[F32]:
    """Mip levels (tiles, h, w, 3) float32, the environment's own texels first, tiles of one texel last.

    how, as Quality.pyramid: "box", means by solid angle; "kaiser", sharper, for light without bright spots (it rings
    round them), clipped to the picture's own range; "hardware", all texels counted alike, as drivers do.

    "box" keeps the light of all directions, and a constant, exactly but for the rounding of float32; sums are in
    float64. Where a disc's texels reach past its rim, they hold the light of the directions there, too (`completed`).
    At poles levels that are made, but for "hardware", are as `glbump.maps.poles` has them: none has a seam. Samples on
    the border of a tile (OpenEXR) that lie on one edge with others are one in all levels: level 0's are.
    """
    if how == "hardware":
        return pyramid.chain(environment.pixels)
    layout, sizes = environment.layout, level_sizes(environment)
    levels = [environment.pixels]
    mean: npt.NDArray[Any] = environment.pixels
    if layout.rim_is_pole:
        mean = np.concatenate([mean, texel_dirs(layout, sizes[0])], axis=-1)
    kaiser = how == "kaiser" and not layout.disc and not environment.has_own_grid
    for size in sizes[:-1]:
        if kaiser and min(size) >= pyramid.LEAST_KAISER:
            mean = level = _sharp(replace(environment, pixels=mean), levels[0])
        else:
            weights = _weights(environment, size)
            mean = pyramid.merge(mean, weights)
            level = _at_edges(mean, environment, weights.sum(axis=(2, 4)))
        if layout is LATLONG and not environment.has_own_grid:
            level = rows_at_poles(level)
        levels.append(level)
    return levels


def fitting_pyramid(wanted: str, layout: Layout, peak: float, *, own_grid: bool, is_light: bool) -> tuple[str, str]:
    """Who makes an environment's levels where "hardware", "box" or "kaiser" is wanted, and why.

    layout, own_grid: of its texels. peak: its brightest. is_light: whether textures keep light itself, and no codes.
    """
    if wanted == "hardware":
        if layout not in (CUBE, LATLONG):
            return "box", "tiles in borders have levels that no driver makes"
        if not is_light:
            return "box", "drivers would average codes, not light"
        return wanted, "the driver counts texels alike, and of odd sizes drops some: 7 to 3 to 1 reads one of seven"
    if wanted == "kaiser":
        if layout.disc or own_grid:
            return "box", "the kernel would see past the rim, or samples on the border twice"
        if peak > 1:
            return "box", f"round what is as bright as {peak:.3g} the Kaiser kernel would ring"
        return wanted, "sharper than means; clipped to what the picture holds"
    return "box", "means by solid angle: every level has the same light"


def texel_angles(environment: EnvironmentMap, size: tuple[int, int]) -> F64:
    """(tiles or 1, h, w or 1) float64: steradians of the texels of the level whose tiles are `size` (width, height)."""
    places = [_places(np.arange(n + 1) / n, environment, axis) for axis, n in enumerate(size)]
    return angles(environment.layout, *places)


def _places(edges: F64, environment: EnvironmentMap, axis: int) -> F64:
    """Places in a tile of texture coordinates along s (axis 0) or t, as far as the tile goes."""
    scale, offset = environment.scale[axis], environment.offset[axis]
    return edges if scale == 0 else np.clip((edges - offset) / scale, 0, 1)


def _weights(environment: EnvironmentMap, size: tuple[int, int]) -> F64:
    """(tiles or 1, h, p, w or 1, q): steradians of what each texel of the level after the one of `size` shares with the
    p x q texels of this one that it covers; at a dual paraboloid's rim their sizes."""
    layout = environment.layout
    s, t = (_places(pyramid.part_edges(n), environment, axis) for axis, n in enumerate(size))
    steradians = angles(layout, s, t)
    (w, q), (h, p) = (pyramid.parts(n) for n in size)
    if steradians.shape[2] == 1:
        return np.broadcast_to(steradians.reshape(-1, h, p, 1, 1), (len(steradians), h, p, 1, q))
    weights = steradians.reshape(-1, h, p, w, q)
    if layout is PARABOLOID:
        # Where two discs meet, means by solid angle are those of places a little within, on both sides of the seam.
        by_size = np.multiply.outer(*(np.diff(pyramid.part_edges(n)) for n in size[::-1])).reshape(h, p, w, q)
        weights = np.where(beside_rim(w)[:, None, :, None], by_size, weights)
    return weights


# ------------------------------------------------------------ solid angles


def angles(layout: Layout, s: F64, t: F64) -> F64:
    """(tiles or 1, T, S or 1) float64: steradians between neighbouring s and t, each ascending and symmetric to 1/2.

    One tile, or one column, where all are alike. On lat-long pictures by cosines; else each is two triangles between
    arcs of great circles (Van Oosterom and Strackee 1983), which are the edges themselves on cubes and hemicubes. Where
    a layout bends or folds them, a tile has at least 64 arcs along each side.
    """
    if layout is LATLONG:
        # cos a - cos b as a product, which does not cancel at the poles.
        a, b = np.pi * t[:-1], np.pi * t[1:]
        rows = 2 * np.sin((a + b) / 2) * np.sin((b - a) / 2)
        if np.ptp(widths := np.diff(s)) < 1e-12:
            return rows[None, :, None] * (2 * np.pi * widths[:1])
        return rows[None, :, None] * (2 * np.pi * widths)
    if layout in (CUBE, HEMICUBE):
        return _by_arcs(layout, s, t)
    more_s, more_t = (_arcs(len(e) - 1) for e in (s, t))
    steradians = _by_arcs(layout, _divided(s, more_s), _divided(t, more_t))
    return steradians.reshape(-1, len(t) - 1, more_t, len(s) - 1, more_s).sum(axis=(2, 4))


def _arcs(n: int) -> int:
    """To an edge of n along a side. Even where n is odd: the octahedron's folds cross edges at their middles."""
    return 1 if n >= 64 and n % 2 == 0 else 2 * math.ceil(32 / n)


def _divided(edges: F64, parts: int) -> F64:
    n = len(edges) - 1
    return np.interp(np.arange(n * parts + 1) / parts, np.arange(n + 1), edges)


def _by_arcs(layout: Layout, s: F64, t: F64) -> F64:
    # The first half of each axis, which the other mirrors; of a hemicube's half faces only that from left to right.
    columns, rows = len(s) // 2, len(t) - 1 if layout is HEMICUBE else len(t) // 2
    steradians = _quads(layout, s[: columns + 1], t[: rows + 1])
    steradians = np.concatenate([steradians, steradians[:, : len(s) - 1 - columns][:, ::-1]], axis=1)
    if layout is HEMICUBE:
        # The last is the other half of the face that the last but one is of.
        return np.stack([steradians] * 5 + [steradians[::-1]])
    return np.concatenate([steradians, steradians[: len(t) - 1 - rows][::-1]])[None]


def _quads(layout: Layout, s: F64, t: F64) -> F64:
    """Steradians (T, S) of what lies on the first tile between neighbouring s and t, as two triangles each."""
    result = np.empty((len(t) - 1, len(s) - 1))
    band = max(1, PIECE // len(s))
    for top in range(0, len(result), band):
        dirs = layout.dir(0, s[None, :], t[top : top + band + 1, None])
        x, y, z = np.ascontiguousarray(np.moveaxis(dirs, -1, 0))
        # Along the diagonal and from it, so that small triangles keep their digits: two half triple products.
        right, down = (x[:-1, 1:], y[:-1, 1:], z[:-1, 1:]), (x[1:, :-1], y[1:, :-1], z[1:, :-1])
        near, far = (x[:-1, :-1], y[:-1, :-1], z[:-1, :-1]), (x[1:, 1:], y[1:, 1:], z[1:, 1:])
        along = _minus(far, near)
        normal = _cross(near, along)
        across = _dot(near, far)
        upper, lower = _dot(normal, _minus(right, near)), _dot(normal, _minus(down, near))
        result[top : top + band] = np.abs(
            np.arctan2(upper, 1 + across + _dot(near, right) + _dot(far, right))
            - np.arctan2(lower, 1 + across + _dot(near, down) + _dot(far, down))
        )
    result *= 2
    return result


Vector = tuple[F64, F64, F64]


def _minus(a: Vector, b: Vector) -> Vector:
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def _dot(a: Vector, b: Vector) -> F64:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _cross(a: Vector, b: Vector) -> Vector:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


# ------------------------------------------------------------ edges


def _at_edges(mean: F64, environment: EnvironmentMap, steradians: F64) -> F32:
    """The level (tiles, h, w, 3) of these means, as look-ups across edges need it. Of a disc whose rim is one
    direction, the means of the unit direction follow those of light: (1, n, n, 6)."""
    layout = environment.layout
    if layout.rim_is_pole:
        return texels_at_rim(mean[..., :3], layout, steradians, mean[..., 3:])
    level = mean.astype(np.float32)
    if environment.has_own_grid and min(level.shape[1:3]) > 1:
        return _welded(level, layout, steradians)
    return level


def _welded(level: F32, layout: Layout, steradians: F64) -> F32:
    """The level with one mean in place of texels that lie on one edge: the look-up reads each nearly half-way to the
    other, so that a difference between them would be a step."""
    from glbump.maps.area import weld
    from glbump.maps.overlap import Grid

    tiles, height, width, _ = level.shape
    grid = Grid(layout, (width, height), *on_border((width, height)))
    result = level.copy()
    weld(result, np.broadcast_to(steradians, (tiles, height, width)), grid)
    return result


def _sharp(environment: EnvironmentMap, first: F32) -> F32:
    """The next level by the Kaiser kernel, clipped to what level 0, `first`, holds."""
    light, steradians = _beyond(environment)
    weighted = pyramid.kaiser_inner(light * steradians, environment.size)
    level = weighted / pyramid.kaiser_inner(steradians, environment.size)
    return np.clip(level, first.min(), first.max()).astype(np.float32)


def _beyond(environment: EnvironmentMap) -> tuple[F64, F64]:
    """Texels (tiles, H + 2 m, W + 2 n, 3) with what lies beyond each edge, as far as the kernel sees, and their
    steradians (tiles or 1, H + 2 m, W + 2 n or 1, 1)."""
    layout, (width, height) = environment.layout, environment.size
    across, down = (pyramid.kaiser_margin(n) for n in (width, height))
    s, t = ((np.arange(-m, n + m + 1)) / n for n, m in ((width, across), (height, down)))
    if layout is LATLONG:
        # Beyond a pole lie the rows on the other side of the world.
        pixels = environment.pixels[0].astype(np.float64)
        behind = np.roll(pixels, width // 2, axis=1)
        whole = np.concatenate([behind[:down][::-1], pixels, behind[-down:][::-1]])
        steradians = np.abs(np.diff(np.cos(np.pi * t)))[None, :, None, None]
        return np.pad(whole, ((0, 0), (across, across), (0, 0)), mode="wrap")[None], steradians
    tile = np.arange(layout.tiles)[:, None, None]
    centres = [0.5 * (e[1:] + e[:-1]) for e in (s, t)]
    light = np.empty((layout.tiles, height + 2 * down, width + 2 * across, 3))
    inner = np.s_[:, down:-down, across:-across]
    light[inner] = environment.pixels
    for rows, columns in (
        (slice(0, down), slice(None)),
        (slice(-down, None), slice(None)),
        (slice(down, -down), slice(0, across)),
        (slice(down, -down), slice(-across, None)),
    ):
        dirs = layout.dir(tile, centres[0][None, None, columns], centres[1][None, rows, None])
        light[:, rows, columns] = sample(environment, dirs)
    return light, angles(layout, s, t)[..., None]
