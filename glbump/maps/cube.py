"""Cube maps: the OpenGL face table, solid angles, and float64 look-ups that know no seam.

Faces +X -X +Y -Y +Z -Z; on each, s runs right and t down, 0..1 (OpenGL 4.6 core, table 8.19). Texel centres
lie at half texels, except in OpenEXR cubes, whose outermost samples lie on the border of the face.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import numpy.typing as npt

F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]
Index = npt.NDArray[np.intp]

FACES = ("+X", "-X", "+Y", "-Y", "+Z", "-Z")

PIECE = 1 << 13
"""Rows that look-ups take at a time, so that their arrays stay in the second-level cache."""

# Per face: the major axis, the axis along s and the axis along t, as vectors.
_MAJOR = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], np.float64)
_ALONG_S = np.array([[0, 0, -1], [0, 0, 1], [1, 0, 0], [1, 0, 0], [1, 0, 0], [-1, 0, 0]], np.float64)
_ALONG_T = np.array([[0, -1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1], [0, -1, 0], [0, -1, 0]], np.float64)


def face_axes() -> F64:
    """(6, 3, 3) float64: of each face the major axis and the axes along s and t, as rows."""
    return np.stack([_MAJOR, _ALONG_S, _ALONG_T], axis=1)


def face_dir(face: npt.ArrayLike, s: npt.ArrayLike, t: npt.ArrayLike) -> F64:
    """Directions (..., 3) float64, not normalised (largest component 1), of points s, t in 0..1 on `face`."""
    f = np.asarray(face)
    a, b = (2 * np.asarray(c, np.float64)[..., None] - 1 for c in (s, t))
    result: F64 = _MAJOR[f] + a * _ALONG_S[f] + b * _ALONG_T[f]
    return result


def face_of(dir: npt.ArrayLike) -> tuple[Index, F64, F64]:
    """Face number and s, t in 0..1 of directions (..., 3), any length; ties go to x before y before z.

    The zero vector has no direction; it counts as the centre of +X, so that it is nowhere an accident.
    """
    d = np.asarray(dir, np.float64)
    x, y, z = d[..., 0], d[..., 1], d[..., 2]
    ax, ay, az = np.abs(x), np.abs(y), np.abs(z)
    on_x = (ax >= ay) & (ax >= az)
    on_y = ~on_x & (ay >= az)
    major = np.where(on_x, x, np.where(on_y, y, z))
    negative = major < 0
    length = np.abs(major)
    length = np.where(length > 0, length, 1.0)
    # The table, in the form s = x or z, t = y or z, with the major axis' sign where it depends on it.
    a = np.where(on_x, -z, x)
    a = np.where(negative & ~on_y, -a, a)
    b = np.where(on_y, np.where(negative, -z, z), -y)
    face = np.where(on_x, 0, np.where(on_y, 2, 4)) + negative
    return face, 0.5 + 0.5 * (a / length), 0.5 + 0.5 * (b / length)


def solid_angles(n: int, *, border: bool = False) -> F64:
    """(n, n) float64 solid angles of one face's texels, in steradians; 4 pi / 6 in all.

    border: of the samples of an OpenEXR cube; of the outermost only one half is on the face.

    Each texel is two triangles, each triangle 2 atan2(a.(b x c), |a||b||c| + (a.b)|c| + (b.c)|a| + (c.a)|b|)
    (Van Oosterom and Strackee 1983). The triple product is exactly the texel's area on the plane, so nothing
    cancels and only rounding is left at any n; the usual four-atan form loses half its digits at n = 16384.
    """
    edge = 2 * np.arange(n + 1) / n - 1
    if border:
        edge = np.clip(edge * (n / (n - 1)), -1, 1)
    x, y = np.broadcast_arrays(edge[None, :], edge[:, None])
    length = np.sqrt(1 + x * x + y * y)
    area = np.diff(edge)[None, :] * np.diff(edge)[:, None]
    a, b, c, d = (np.s_[:-1, :-1], np.s_[:-1, 1:], np.s_[1:, :-1], np.s_[1:, 1:])

    def dot(p: tuple[slice, slice], q: tuple[slice, slice]) -> F64:
        result: F64 = 1 + x[p] * x[q] + y[p] * y[q]
        return result

    def triangle(p: tuple[slice, slice], q: tuple[slice, slice], r: tuple[slice, slice]) -> F64:
        lp, lq, lr = length[p], length[q], length[r]
        volume = lp * lq * lr + dot(p, q) * lr + dot(q, r) * lp + dot(r, p) * lq
        result: F64 = 2 * np.arctan2(area, volume)
        return result

    return triangle(a, b, c) + triangle(d, c, b)


def vector_areas(edge: F64) -> F64:
    """(n, n, 3) float64 integrals of the unit direction over the solid angles of one face's texels, between the places
    `edge` (n + 1,), -1..1, along s and t: along the face's major axis, s and t.

    Half the sum over the sides of the angle each spans times the normal of its plane (Lambert 1760; Arvo, "Analytic
    Methods for Simulated Light Transport", 1995, section 2.2). The sides of a small texel cancel but for 1 / n of them:
    relative error n times rounding.
    """
    n = len(edge) - 1
    corners = np.ones((n + 1, n + 1, 3))
    corners[..., 1], corners[..., 2] = edge[None, :], edge[:, None]

    def side(p: F64, q: F64) -> F64:
        normal = np.cross(p, q)
        length = np.linalg.norm(normal, axis=-1)
        angle = np.arctan2(length, np.einsum("...i,...i", p, q))
        result: F64 = normal * (angle / (2 * np.maximum(length, 1e-300)))[..., None]
        return result

    along = side(corners[:, :-1], corners[:, 1:])
    down = side(corners[:-1], corners[1:])
    return along[:-1] + down[:, 1:] - along[1:] - down[:, :-1]


def pad(faces: F32) -> F32:
    """(6, N, N, C) with a border of one texel, (6, N + 2, N + 2, C): the neighbouring faces' texels, and at
    the corners, where no texel is, the mean of the three that meet there, as seamless cube maps have it."""
    n = faces.shape[1]
    texels = faces.reshape(6 * n * n, -1)
    padded = np.empty((6, n + 2, n + 2, texels.shape[1]), np.float32)
    padded[:, 1:-1, 1:-1] = faces
    face, along = np.arange(6)[:, None], (np.arange(n)[None, :] + 0.5) / n
    # Half a texel outside one face lies inside the texel of its neighbour that shares the edge.
    before, after = np.full((1, 1), -0.5 / n), np.full((1, 1), 1 + 0.5 / n)
    for where, s, t in (
        (np.s_[:, 0, 1:-1], along, before),
        (np.s_[:, -1, 1:-1], along, after),
        (np.s_[:, 1:-1, 0], before, along),
        (np.s_[:, 1:-1, -1], after, along),
    ):
        other, column, row = face_of(face_dir(face, s, t))
        i, j = (np.minimum((c * n).astype(np.intp), n - 1) for c in (row, column))
        padded[where] = texels[(other * n + i) * n + j]
    for i, inner_i in ((0, 1), (-1, -2)):
        for j, inner_j in ((0, 1), (-1, -2)):
            three = padded[:, inner_i, inner_j], padded[:, i, inner_j], padded[:, inner_i, j]
            padded[:, i, j] = np.mean(three, axis=0, dtype=np.float64)
    return padded


def by_pieces(look_up: Callable[[F64], F64], rows: npt.ArrayLike) -> F64:
    """look_up of (..., K) rows, a cache's worth at a time: a third of the time of one large array."""
    r = np.asarray(rows, np.float64)
    flat = r.reshape(-1, r.shape[-1])
    if len(flat) <= PIECE:
        values = look_up(flat)
        # Not -1: of no rows at all it cannot be told.
        return values.reshape(*r.shape[:-1], values.shape[1])
    first = look_up(flat[:PIECE])
    result = np.empty((len(flat), first.shape[1]))
    result[:PIECE] = first
    for i in range(PIECE, len(flat), PIECE):
        result[i : i + PIECE] = look_up(flat[i : i + PIECE])
    return result.reshape(*r.shape[:-1], -1)


def bilinear(texels: F32, corners: Sequence[Index], a: F64, b: F64) -> F64:
    """Values (..., C) float64 between four rows of `texels` (M, C): upper left, upper right, lower left, lower
    right; a and b, shape (...), are the weights of right and of lower."""
    # Channel by channel: NumPy is three times slower where a short last axis meets a broadcast weight.
    channels, values = texels.shape[1], texels.reshape(-1)
    weights = (1 - a) * (1 - b), a * (1 - b), (1 - a) * b, a * b
    firsts = [corner * channels for corner in corners]
    result = np.empty((*a.shape, channels))
    for c in range(channels):
        terms = [weight * values.take(first + c) for weight, first in zip(weights, firsts, strict=True)]
        result[..., c] = terms[0] + terms[1] + terms[2] + terms[3]
    return result


def _look_up(texels: F32, origin: Index | int, n: npt.ArrayLike, face: Index, s: F64, t: F64) -> F64:
    """Bilinear values (..., C) from padded faces of n x n texels that begin at row `origin` of `texels`."""
    size = np.asarray(n)
    x, y = s * size + 0.5, t * size + 0.5
    left, top = np.floor(x), np.floor(y)
    width = size + 2
    first = origin + (face * width + top.astype(np.intp)) * width + left.astype(np.intp)
    return bilinear(texels, (first, first + 1, first + width, first + width + 1), x - left, y - top)


def sample_levels(levels: Sequence[F32], dir: npt.ArrayLike, lod: npt.ArrayLike) -> F64:
    """Radiance (..., 3) float64: trilinear and seamless in a list of levels (6, n, n, 3), finest first.

    lod: level of detail, broadcast against the directions, clamped to the levels there are; its fraction is
    the weight of the coarser of the two levels it lies between.
    """
    padded = [pad(level) for level in levels]
    texels = np.concatenate([level.reshape(-1, level.shape[-1]) for level in padded])
    sizes = np.array([level.shape[1] for level in levels])
    origins = np.cumsum([0] + [level.shape[0] * level.shape[1] ** 2 for level in padded[:-1]])
    d = np.asarray(dir, np.float64)
    detail = np.clip(np.broadcast_to(np.asarray(lod, np.float64), d.shape[:-1]), 0, len(levels) - 1)

    def look_up(rows: F64) -> F64:
        face, s, t = face_of(rows[:, :3])
        fine = rows[:, 3].astype(np.intp)
        weight = (rows[:, 3] - fine)[:, None]
        coarse = np.minimum(fine + 1, len(levels) - 1)
        near, far = (_look_up(texels, origins[level], sizes[level], face, s, t) for level in (fine, coarse))
        return near * (1 - weight) + far * weight

    return by_pieces(look_up, np.concatenate([d, detail[..., None]], axis=-1))
