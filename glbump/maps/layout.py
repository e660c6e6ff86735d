"""An environment as texels: its layout says which direction each place of its tiles shows.

One map class for all layouts. A tile is a rectangle of texels: a lat-long picture is one tile, a cube six, a hemicube
six half faces. The coordinate of a place on a tile is (s, t) * scale + offset, so that pictures whose outermost samples
lie on the border (OpenEXR's) are read where they are.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import cached_property

import numpy as np
import numpy.typing as npt

from glbump.frozen import Frozen
from glbump.maps import projections
from glbump.maps.cube import bilinear, by_pieces, face_dir, face_of, pad
from glbump.maps.projections import Place

F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]
Pair = tuple[float, float]


def latlong_uv(dir: npt.ArrayLike) -> F64:
    """Directions (..., 3), any length, as (..., 2) float64 coordinates u, v in 0..1: centre -Z, v down.

    At the poles atan2(0, 0) counts as 0: u = 1/2. Both angles by atan2, which is exact where acos is not.
    """
    d = np.asarray(dir, np.float64)
    x, y, z = d[..., 0], d[..., 1], d[..., 2]
    across = np.hypot(x, z)
    longitude = np.where(across > 0, np.arctan2(x, -z), 0.0)
    return np.stack([0.5 + longitude / (2 * np.pi), np.arctan2(across, y) / np.pi], axis=-1)


def latlong_dir(uv: npt.ArrayLike) -> F64:
    """The unit direction (..., 3) float64 at coordinates (..., 2); inverse of latlong_uv."""
    t = np.asarray(uv, np.float64)
    longitude, colatitude = (t[..., 0] - 0.5) * (2 * np.pi), t[..., 1] * np.pi
    across = np.sin(colatitude)
    return np.stack([across * np.sin(longitude), np.cos(colatitude), -across * np.cos(longitude)], axis=-1)


def _latlong_place(dir: npt.ArrayLike) -> Place:
    uv = latlong_uv(dir)
    return np.zeros(uv.shape[:-1], np.intp), uv[..., 0], uv[..., 1]


def _latlong_dir(tile: npt.ArrayLike, s: npt.ArrayLike, t: npt.ArrayLike) -> F64:
    return latlong_dir(np.stack(np.broadcast_arrays(s, t), axis=-1))


def _cube_dir(tile: npt.ArrayLike, s: npt.ArrayLike, t: npt.ArrayLike) -> F64:
    d = face_dir(tile, s, t)
    result: F64 = d / np.linalg.norm(d, axis=-1, keepdims=True)
    return result


class Layout(Frozen):
    """Which direction each place of an environment's tiles shows.

    place(dir (..., 3), any length) -> tile, s, t; dir(tile, s, t) -> unit (..., 3). aspect: a tile's width over its
    height. whole: shows the whole sphere; else directions of y < 0 have no place of their own. disc: what is more than
    1/2 from a tile's middle is no part of the picture. span: degrees that a tile's height shows.
    """

    name: str
    tiles: int
    aspect: int
    place: Callable[[npt.ArrayLike], Place]
    dir: Callable[[npt.ArrayLike, npt.ArrayLike, npt.ArrayLike], F64]
    whole: bool = True
    disc: bool = False
    span: float = 180.0

    def __repr__(self) -> str:
        return f"Layout({self.name})"

    @property
    def rim_is_pole(self) -> bool:
        """Whether all of its rim is one direction: of a disc that shows the whole sphere."""
        return self.disc and self.whole and self.tiles == 1

    def shape(self, size: int) -> tuple[int, int, int]:
        """Tiles, rows and columns, with tiles `size` texels high; hemicubes `size` wide."""
        return (self.tiles, size // 2, size) if self.name == "hemicube" else (self.tiles, size, self.aspect * size)

    def texels_per_radian(self, size: tuple[int, int]) -> float:
        """Of tiles of `size` (width, height): at the middle of a face or of a lat-long picture; on other layouts the
        root of texels per steradian."""
        width, height = size
        if self is LATLONG:
            return height / np.pi
        if self in (CUBE, HEMICUBE):
            return width / 2
        texels = self.tiles * width * height * (np.pi / 4 if self.disc else 1.0)
        return math.sqrt(texels / (4 * np.pi if self.whole else 2 * np.pi))


LATLONG = Layout("lat-long", 1, 2, _latlong_place, _latlong_dir)
CUBE = Layout("cube", 6, 1, face_of, _cube_dir, span=90)
HEMICUBE = Layout("hemicube", 6, 2, projections.hemicube_place, projections.hemicube_dir, whole=False, span=45)
OCTAHEDRAL = Layout("octahedral", 1, 1, projections.octahedral_place, projections.octahedral_dir)
PARABOLOID = Layout("dual-paraboloid", 2, 1, projections.paraboloid_place, projections.paraboloid_dir, disc=True)
EQUAL_AREA, EQUIDISTANT, ORTHOGRAPHIC = (
    Layout(name, 1, 1, place, dir, whole=False, disc=True)
    for name, place, dir in (
        ("equal-area", projections.equal_area_place, projections.equal_area_dir),
        ("equidistant", projections.equidistant_place, projections.equidistant_dir),
        ("orthographic", projections.orthographic_place, projections.orthographic_dir),
    )
)
ANGULAR = Layout("angular", 1, 1, projections.angular_place, projections.angular_dir, disc=True, span=360)
MIRROR_BALL = Layout(
    "mirror-ball", 1, 1, projections.mirror_ball_place, projections.mirror_ball_dir, disc=True, span=360
)

LAYOUTS = {
    layout.name: layout
    for layout in (
        LATLONG,
        CUBE,
        HEMICUBE,
        OCTAHEDRAL,
        PARABOLOID,
        EQUAL_AREA,
        EQUIDISTANT,
        ORTHOGRAPHIC,
        ANGULAR,
        MIRROR_BALL,
    )
}


class EnvironmentMap(Frozen, eq=False):
    """Radiance by direction.

    pixels: (tiles, H, W, 3) float32, linear light, row 0 at t = 0. scale, offset: of s and of t to texture coordinates,
    0..1 across W and H texels. notes: what was assumed where the file did not say.
    """

    layout: Layout
    pixels: F32
    scale: Pair = (1.0, 1.0)
    offset: Pair = (0.0, 0.0)
    notes: tuple[str, ...] = ()

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of a tile, in texels."""
        return self.pixels.shape[2], self.pixels.shape[1]

    @property
    def has_own_grid(self) -> bool:
        """Whether texture coordinates differ from places."""
        return self.scale != (1.0, 1.0) or self.offset != (0.0, 0.0)

    @property
    def texels_per_radian(self) -> float:
        """As `Layout.texels_per_radian`, of these texels."""
        return self.layout.texels_per_radian(self.size)

    def texel_dirs(self) -> F64:
        """(tiles, H, W, 3) float64 unit directions of the texel centres."""
        return texel_dirs(self.layout, self.size, self.scale, self.offset)

    @cached_property
    def padded(self) -> F32:
        """(tiles, H + 2, W + 2, 3): with a border of neighbouring texels."""
        return padded(self.layout, self.pixels, self.scale, self.offset)


def texel_dirs(layout: Layout, size: tuple[int, int], scale: Pair = (1.0, 1.0), offset: Pair = (0.0, 0.0)) -> F64:
    """(tiles, H, W, 3) float64 unit directions of the texel centres of tiles of `size` (width, height)."""
    width, height = size
    s = ((np.arange(width) + 0.5) / width - offset[0]) / scale[0]
    t = ((np.arange(height) + 0.5) / height - offset[1]) / scale[1]
    return layout.dir(np.arange(layout.tiles)[:, None, None], s[None, None, :], t[None, :, None])


def inside(layout: Layout, size: tuple[int, int]) -> npt.NDArray[np.bool_]:
    """(H, W) whether the texel's centre is a part of the picture."""
    width, height = size
    if not layout.disc:
        return np.ones((height, width), bool)
    s, t = (np.arange(width) + 0.5) / width - 0.5, (np.arange(height) + 0.5) / height - 0.5
    result: npt.NDArray[np.bool_] = np.hypot(s[None, :], t[:, None]) <= 0.5
    return result


def beside_rim(size: int) -> npt.NDArray[np.bool_]:
    """(size, size) whether a disc's texel has its centre less than one texel from the rim."""
    from_middle = np.arange(size) + 0.5 - 0.5 * size
    result: npt.NDArray[np.bool_] = np.abs(np.hypot(from_middle[None, :], from_middle[:, None]) - 0.5 * size) < 1
    return result


def above(layout: Layout, dir: F64) -> F64:
    """The directions, those that a layout of the upper half does not show turned up: y = |y|."""
    if layout.whole:
        return dir
    return np.stack([dir[..., 0], np.abs(dir[..., 1]), dir[..., 2]], axis=-1)


def completed(layout: Layout, pixels: F32) -> F32:
    """Pixels (tiles, H, W, C) whose texels outside the picture hold what the picture shows in their direction."""
    tiles, height, width, _ = pixels.shape
    if not layout.disc:
        return pixels
    outside = np.broadcast_to(~inside(layout, (width, height)), (tiles, height, width))
    dirs = above(layout, texel_dirs(layout, (width, height))[outside])
    result = pixels.copy()
    # The nearest texel inside: half a texel nearer to the middle than the place itself where that is on the rim.
    result[outside] = _nearest(layout, pixels, dirs)
    return result


def _nearest(layout: Layout, pixels: F32, dirs: F64) -> F32:
    _, height, width, _ = pixels.shape
    tile, s, t = layout.place(dirs)
    a, b = s - 0.5, t - 0.5
    r = np.hypot(a, b)
    if layout.disc:
        # A texel whose centre is inside lies at most half a texel's diagonal nearer to the middle.
        most = 0.5 - np.hypot(0.5 / width, 0.5 / height)
        shrink = np.where(r > most, most / np.maximum(r, 1e-300), 1.0)
        s, t = 0.5 + a * shrink, 0.5 + b * shrink
    i = np.clip((t * height).astype(np.intp), 0, height - 1)
    j = np.clip((s * width).astype(np.intp), 0, width - 1)
    result: F32 = pixels[tile, i, j]
    if layout is MIRROR_BALL:
        # All round its rim is one direction, to which no texel is nearer than the others.
        result[r >= 0.5] = pixels[:, beside_rim(width) & inside(layout, (width, height))].mean(axis=(0, 1), dtype=float)
    return result


def padded(layout: Layout, pixels: F32, scale: Pair = (1.0, 1.0), offset: Pair = (0.0, 0.0)) -> F32:
    """(tiles, H + 2, W + 2, C): with a border of one texel, of what lies beyond the edge.

    A lat-long picture repeats in u and is continued by its first and last row in v, as textures do; a cube's border is
    the neighbouring faces', as seamless cube maps have it; all others look up the direction half a texel outside.
    """
    tiles, height, width, channels = pixels.shape
    if layout is CUBE:
        return pad(pixels)
    result = np.empty((tiles, height + 2, width + 2, channels), np.float32)
    result[:, 1:-1, 1:-1] = pixels
    if layout is LATLONG:
        result[:, 0, 1:-1], result[:, -1, 1:-1] = pixels[:, 0], pixels[:, -1]
        result[:, :, 0], result[:, :, -1] = result[:, :, -2], result[:, :, 1]
        return result
    s, t = (np.arange(-1, width + 1) + 0.5) / width, (np.arange(-1, height + 1) + 0.5) / height
    tile = np.arange(tiles)[:, None, None]
    for where, columns, rows in (
        (np.s_[:, :1, :], s, t[:1]),
        (np.s_[:, -1:, :], s, t[-1:]),
        (np.s_[:, :, :1], s[:1], t),
        (np.s_[:, :, -1:], s[-1:], t),
    ):
        dirs = layout.dir(tile, columns[None, None, :], rows[None, :, None])
        result[where] = _nearest(layout, pixels, above(layout, dirs))
    return result


def row_edges(source: EnvironmentMap) -> F64:
    """Colatitudes between the rows of a lat-long picture, and of its first and last: (H + 1,), radians."""
    height = source.size[1]
    v = (np.arange(height + 1) / height - source.offset[1]) / source.scale[1]
    return np.clip(v, 0, 1) * np.pi


def sample(environment: EnvironmentMap, dir: npt.ArrayLike) -> F64:
    """Radiance (..., 3) float64 in directions (..., 3): bilinear, level 0, and across the edges of tiles.

    Where the layout shows the upper half alone, the lower mirrors it.
    """
    layout, (width, height) = environment.layout, environment.size
    border = environment.padded
    texels = border.reshape(-1, border.shape[-1])
    rows, columns = height + 2, width + 2

    def look_up(d: F64) -> F64:
        tile, s, t = layout.place(above(layout, d))
        x = (s * environment.scale[0] + environment.offset[0]) * width
        y = (t * environment.scale[1] + environment.offset[1]) * height + 0.5
        x = (x % width if layout is LATLONG else x) + 0.5
        left, top = np.floor(x), np.floor(y)
        if layout is LATLONG:
            top = np.clip(top, 0, height)
            y = np.clip(y, 0, height + 1)
        first = (tile * rows + top.astype(np.intp)) * columns + left.astype(np.intp)
        return bilinear(texels, (first, first + 1, first + columns, first + columns + 1), x - left, y - top)

    return by_pieces(look_up, dir)


def resampled(environment: EnvironmentMap, layout: Layout, size: int) -> EnvironmentMap:
    """The environment in another layout, one bilinear read for each texel."""
    _, height, width = layout.shape(size)
    pixels = sample(environment, texel_dirs(layout, (width, height))).astype(np.float32)
    return EnvironmentMap(layout, pixels, notes=environment.notes)


def sheet_corners(tiles: int, sizes: Sequence[tuple[int, int]]) -> list[tuple[int, int]]:
    """x, y of the upper left texel of each level on `sheet`: level 0, and below it the others side by side."""
    across = np.cumsum([0] + [width + 2 for width, _ in sizes[1:]])
    return [(0, 0)] + [(int(x), tiles * (sizes[0][1] + 2)) for x in across[: len(sizes) - 1]]


def sheet(layout: Layout, levels: Sequence[F32]) -> F32:
    """All levels (tiles, h, w, C) on one picture (H, W, C), for textures without levels of their own: each level a
    column of its tiles, each tile in a border of its neighbours' texels.

    A texture's levels would halve the borders too, and llvmpipe reads four pixels' levels as one.
    """
    tiles, channels = layout.tiles, levels[0].shape[-1]
    sizes = [(level.shape[2], level.shape[1]) for level in levels]
    corners = sheet_corners(tiles, sizes)
    width = max(x + w + 2 for (x, _), (w, _) in zip(corners, sizes))
    height = max(y + tiles * (h + 2) for (_, y), (_, h) in zip(corners, sizes))
    result = np.zeros((height, width, channels), np.float32)
    for (x, y), level in zip(corners, levels):
        column = padded(layout, level)
        column = column.reshape(-1, *column.shape[2:])
        result[y : y + column.shape[0], x : x + column.shape[1]] = column
    return result


def on_border(size: tuple[int, int]) -> tuple[Pair, Pair]:
    """scale and offset of tiles whose outermost samples lie on the border: `size` samples span one step less."""
    width, height = size
    return ((width - 1) / width, (height - 1) / height), (0.5 / width, 0.5 / height)
