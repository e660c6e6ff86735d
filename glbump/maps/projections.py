"""Directions <-> places on tiles, for each layout that an environment may have besides lat-long and cube.

A place is a tile's number and s, t in 0..1: s to the right, t down. Directions need not be unit length; those that come
back are. Beyond the edges of a tile (s or t outside 0..1) each inverse goes on as its formula does, so that a border of
neighbouring texels can be found by direction.

Pictures of discs show what one sees from inside: up, with -Z at the top (so +X on the left); the second tile of the
dual paraboloid looks down, again with -Z at the top (+X on the right).
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

F64 = npt.NDArray[np.float64]
Index = npt.NDArray[np.intp]
Place = tuple[Index, F64, F64]


def _unit(dir: npt.ArrayLike) -> F64:
    d = np.asarray(dir, np.float64)
    d = d / np.abs(d).max(axis=-1, keepdims=True)
    result: F64 = d / np.linalg.norm(d, axis=-1, keepdims=True)
    return result


def _one_tile(s: F64, t: F64) -> Place:
    return np.zeros(s.shape, np.intp), s, t


# ------------------------------------------------------------ octahedral


def octahedral_place(dir: npt.ArrayLike) -> Place:
    """The sphere as an octahedron, unfolded to a square about +Y; s along +X, t along +Z.

    Cigolle et al., A Survey of Efficient Representations for Independent Unit Vectors, JCGT 3(2), 2014.
    """
    d = np.asarray(dir, np.float64)
    x, y, z = np.moveaxis(d / np.abs(d).sum(axis=-1, keepdims=True), -1, 0)
    below = y < 0
    sx, sz = np.where(x < 0, -1.0, 1.0), np.where(z < 0, -1.0, 1.0)
    a = np.where(below, (1 - np.abs(z)) * sx, x)
    b = np.where(below, (1 - np.abs(x)) * sz, z)
    return _one_tile(0.5 + 0.5 * a, 0.5 + 0.5 * b)


def octahedral_dir(tile: npt.ArrayLike, s: npt.ArrayLike, t: npt.ArrayLike) -> F64:
    """Inverse of octahedral_place. Past an edge it is the same edge's other half, turned about its middle."""
    a, b = np.broadcast_arrays(2 * np.asarray(s, np.float64) - 1, 2 * np.asarray(t, np.float64) - 1)
    out_a, out_b = np.abs(a) > 1, np.abs(b) > 1
    folded_a = np.where(out_a, np.sign(a) * 2 - a, a)
    folded_b = np.where(out_b, np.sign(b) * 2 - b, b)
    a, b = np.where(out_b, -folded_a, folded_a), np.where(out_a, -folded_b, folded_b)
    y = 1 - np.abs(a) - np.abs(b)
    fold = np.maximum(-y, 0.0)
    return _unit(np.stack([a - np.where(a < 0, -fold, fold), y, b - np.where(b < 0, -fold, fold)], axis=-1))


# ------------------------------------------------------------ hemispheres as discs about +Y


def _disc_place(dir: npt.ArrayLike, radius_of: str) -> Place:
    d = _unit(dir)
    x, y, z = d[..., 0], d[..., 1], d[..., 2]
    across = np.hypot(x, z)
    if radius_of == "equal-area":
        # sqrt(2) sin(theta / 2): sin(theta / 2) = sin(theta) / sqrt(2 (1 + cos(theta))) has no cancellation.
        per_across = 1 / np.sqrt(np.maximum(1 + y, 1e-300))
    elif radius_of == "equidistant":
        angle = np.arctan2(across, y) * (2 / np.pi)
        per_across = np.divide(angle, across, out=np.full_like(across, 2 / np.pi), where=across > 0)
    else:
        per_across = np.ones_like(across)
    return _one_tile(0.5 - 0.5 * x * per_across, 0.5 + 0.5 * z * per_across)


def _disc_dir(s: npt.ArrayLike, t: npt.ArrayLike, radius_of: str) -> F64:
    a, b = np.broadcast_arrays(1 - 2 * np.asarray(s, np.float64), 2 * np.asarray(t, np.float64) - 1)
    r = np.hypot(a, b)
    # Past the rim, the orthographic disc has no direction: it goes on as its own mirror image.
    if radius_of == "equal-area":
        half = np.arcsin(np.minimum(r / np.sqrt(2), 1.0))
        y, across = np.cos(2 * half), np.sin(2 * half)
    elif radius_of == "equidistant":
        y, across = np.cos(r * np.pi / 2), np.sin(r * np.pi / 2)
    else:
        inside = np.where(r > 1, np.maximum(2 - r, 0.0), r)
        across = inside
        y = np.where(r > 1, -1.0, 1.0) * np.sqrt(np.maximum(1 - inside * inside, 0.0))
    scale = np.divide(across, r, out=np.ones_like(r), where=r > 0)
    return np.stack([a * scale, np.where(r > 0, y, 1.0), b * scale], axis=-1)


def equal_area_place(dir: npt.ArrayLike) -> Place:
    """Lambert's azimuthal equal-area disc of the upper half: r = sqrt(2) sin(theta / 2); 1 at the horizon."""
    return _disc_place(dir, "equal-area")


def equal_area_dir(tile: npt.ArrayLike, s: npt.ArrayLike, t: npt.ArrayLike) -> F64:
    """Inverse of equal_area_place."""
    return _disc_dir(s, t, "equal-area")


def equidistant_place(dir: npt.ArrayLike) -> Place:
    """The equidistant disc (f-theta fisheye) of the upper half: r = theta / 90 degrees."""
    return _disc_place(dir, "equidistant")


def equidistant_dir(tile: npt.ArrayLike, s: npt.ArrayLike, t: npt.ArrayLike) -> F64:
    """Inverse of equidistant_place."""
    return _disc_dir(s, t, "equidistant")


def orthographic_place(dir: npt.ArrayLike) -> Place:
    """The orthographic disc (Nusselt's) of the upper half: r = sin(theta). Below the horizon: the place above it."""
    return _disc_place(dir, "orthographic")


def orthographic_dir(tile: npt.ArrayLike, s: npt.ArrayLike, t: npt.ArrayLike) -> F64:
    """Inverse of orthographic_place."""
    return _disc_dir(s, t, "orthographic")


# ------------------------------------------------------------ dual paraboloid


def paraboloid_place(dir: npt.ArrayLike) -> Place:
    """Two discs, up and down: r = tan(theta / 2) about +Y and -Y (Heidrich and Seidel 1998); 1 at the horizon."""
    d = _unit(dir)
    x, y, z = d[..., 0], d[..., 1], d[..., 2]
    down = y < 0
    k = 0.5 / (1 + np.abs(y))
    return down.astype(np.intp), 0.5 + np.where(down, x, -x) * k, 0.5 + z * k


def paraboloid_dir(tile: npt.ArrayLike, s: npt.ArrayLike, t: npt.ArrayLike) -> F64:
    """Inverse of paraboloid_place; past a disc's rim it goes on round the sphere."""
    side = np.where(np.asarray(tile) == 0, 1.0, -1.0)
    a, b = 1 - 2 * np.asarray(s, np.float64), 2 * np.asarray(t, np.float64) - 1
    side, a, b = np.broadcast_arrays(side, a, b)
    square = a * a + b * b
    return np.stack([2 * a * side, side * (1 - square), 2 * b], axis=-1) / (1 + square)[..., None]


# ------------------------------------------------------------ hemicube

_SIDES = np.array([[1, 0], [-1, 0], [0, 1], [0, -1]], np.float64)
"""x, z of the middle of each side: +X -X +Z -Z."""


def hemicube_place(dir: npt.ArrayLike) -> Place:
    """Six tiles, twice as wide as high: the upper halves of the cube's sides +X -X +Z -Z, then the top, -Z half first.

    As on the cube's faces (OpenGL's table) s runs along -z, +z, +x, -x and on the top along +x; t runs down, on the top
    along +z. A direction below the horizon has the place on its side at t > 1.
    """
    d = np.asarray(dir, np.float64)
    x, y, z = d[..., 0], d[..., 1], d[..., 2]
    ax, az = np.abs(x), np.abs(z)
    top = (y > ax) & (y > az)
    on_x = ax >= az
    side = np.where(on_x, x < 0, 2 + (z < 0))
    major = np.where(top, y, np.where(on_x, ax, az))
    major = np.where(major > 0, major, 1.0)
    along = np.where(on_x, np.where(x < 0, z, -z), np.where(z < 0, -x, x))
    s = 0.5 + 0.5 * np.where(top, x, along) / major
    # 0..2 on the top, whose two halves are a tile each.
    down = np.where(top, 1 + z / major, 1 - y / major)
    lower = top & (down >= 1)
    return np.where(top, 4 + lower, side).astype(np.intp), s, down - lower


def hemicube_dir(tile: npt.ArrayLike, s: npt.ArrayLike, t: npt.ArrayLike) -> F64:
    """Inverse of hemicube_place; past a tile's edges the plane goes on."""
    tile = np.asarray(tile)
    a, b, tile = np.broadcast_arrays(2 * np.asarray(s, np.float64) - 1, np.asarray(t, np.float64), tile)
    top = tile >= 4
    x, z = np.moveaxis(_SIDES[np.where(top, 0, tile)], -1, 0)
    side = np.stack([x + a * z, 1 - b, z - a * x], axis=-1)
    up = np.stack([a, np.ones_like(a), b - 1 + (tile == 5)], axis=-1)
    return _unit(np.where(top[..., None], up, side))


# ------------------------------------------------------------ whole spheres as one disc: photographs


def angular_place(dir: npt.ArrayLike) -> Place:
    """The angular map (Debevec's light probe): r = theta / 180 degrees about -Z, seen from inside, +Y at the top."""
    d = _unit(dir)
    x, y, z = d[..., 0], d[..., 1], d[..., 2]
    across = np.hypot(x, y)
    angle = np.arctan2(across, -z) / np.pi
    per_across = np.divide(angle, across, out=np.full_like(across, 1 / np.pi), where=across > 0)
    return _one_tile(0.5 + 0.5 * x * per_across, 0.5 - 0.5 * y * per_across)


def angular_dir(tile: npt.ArrayLike, s: npt.ArrayLike, t: npt.ArrayLike) -> F64:
    """Inverse of angular_place; past the rim, where +Z is, it goes on round the sphere."""
    a, b = np.broadcast_arrays(2 * np.asarray(s, np.float64) - 1, 1 - 2 * np.asarray(t, np.float64))
    r = np.hypot(a, b)
    scale = np.divide(np.sin(np.pi * r), r, out=np.full_like(r, np.pi), where=r > 0)
    return np.stack([a * scale, b * scale, -np.cos(np.pi * r)], axis=-1)


def mirror_ball_place(dir: npt.ArrayLike) -> Place:
    """A photograph, from far off along -Z, of a mirror ball: r = sin(theta / 2) about +Z, which its middle mirrors."""
    d = _unit(dir)
    x, y, z = d[..., 0], d[..., 1], d[..., 2]
    # The ball's normal is half-way between the direction and +Z.
    normal = np.stack([x, y, z + 1], axis=-1)
    length = np.linalg.norm(normal, axis=-1)
    length = np.where(length > 0, length, 1.0)
    rim = (x == 0) & (y == 0) & (z < 0)
    return _one_tile(0.5 + 0.5 * np.where(rim, 1.0, x / length), 0.5 - 0.5 * y / length)


def mirror_ball_dir(tile: npt.ArrayLike, s: npt.ArrayLike, t: npt.ArrayLike) -> F64:
    """Inverse of mirror_ball_place; the whole rim mirrors -Z, and so does all beyond it."""
    a, b = np.broadcast_arrays(2 * np.asarray(s, np.float64) - 1, 1 - 2 * np.asarray(t, np.float64))
    r = np.hypot(a, b)
    scale = np.where(r > 1, 1 / np.maximum(r, 1.0), 1.0)
    a, b = a * scale, b * scale
    # 0 also where rounding would leave a root of 1e-8, and with it a way to some texel of the rim.
    up = np.where(r < 1, np.sqrt(np.maximum(1 - a * a - b * b, 0.0)), 0.0)
    return np.stack([2 * up * a, 2 * up * b, 2 * up * up - 1], axis=-1)
