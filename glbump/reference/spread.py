"""Spreads of normals and directions, each two vectors a, b (..., 3) with the covariance a a^T + b b^T. Twin of
shaders/lib/spread.glsl; float64."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from glbump.reference.direction import axes_across

F64 = npt.NDArray[np.float64]

MOST_SPREAD = 1e16
"""Most that slopes vary: all directions are as likely long before."""


def _f64(value: npt.ArrayLike) -> F64:
    return np.asarray(value, np.float64)


def _dot(a: npt.ArrayLike, b: npt.ArrayLike) -> F64:
    result: F64 = np.einsum("...i,...i->...", _f64(a), _f64(b))
    return result


def _outer(a: F64) -> F64:
    result: F64 = a[..., :, None] * a[..., None, :]
    return result


def _square(moments: npt.ArrayLike) -> F64:
    """Moments (xx, xy, yy) as matrices (..., 2, 2)."""
    m = _f64(moments)
    return np.stack([m[..., :2], m[..., 1:]], axis=-2)


def moments_across(
    x: npt.ArrayLike, y: npt.ArrayLike, u: npt.ArrayLike, v: npt.ArrayLike, moments: npt.ArrayLike
) -> F64:
    """Second moments (..., 3) along x and y of s_x u + s_y v, s having the second moments (uu, uv, vv)."""
    change = np.stack(
        [np.stack([_dot(u, x), _dot(v, x)], axis=-1), np.stack([_dot(u, y), _dot(v, y)], axis=-1)], axis=-2
    )
    carried = change @ _square(moments) @ np.swapaxes(change, -1, -2)
    return np.stack([carried[..., 0, 0], carried[..., 0, 1], carried[..., 1, 1]], axis=-1)


def spread_along(x: npt.ArrayLike, y: npt.ArrayLike, moments: npt.ArrayLike) -> tuple[F64, F64]:
    """The spread of s_x x + s_y y, s having the second moments (xx, xy, yy): the columns of their matrix's
    symmetric root, of its nearest without a negative eigenvalue. MOST_SPREAD, alike in all directions, past that."""
    m = _f64(moments)
    is_past = m[..., 0] + m[..., 2] >= MOST_SPREAD
    values, vectors = np.linalg.eigh(
        _square(np.where(is_past[..., None], MOST_SPREAD / 2 * np.array([1.0, 0.0, 1.0]), m))
    )
    root = (vectors * np.sqrt(np.maximum(values, 0.0))[..., None, :]) @ np.swapaxes(vectors, -1, -2)
    a, b = (root[..., :1, i] * _f64(x) + root[..., 1:, i] * _f64(y) for i in (0, 1))
    return a, b


def steep_part(share: npt.ArrayLike, mean: npt.ArrayLike, moments: npt.ArrayLike) -> tuple[F64, F64, F64]:
    """Of slopes with a mean (..., 2) and moments (..., 3) about it, of which (...) are steep and the others 0: how many
    are steep, their mean and their moments. E[s] and E[s s^T] of all are those of the steep ones times their share,
    which is no less than leaves them a variance of 0 along the mean. Moments past MOST_SPREAD have no flats."""
    m, square = _f64(mean), _square(moments)
    is_kept = np.einsum("...ii->...", square) < MOST_SPREAD
    length = np.linalg.norm(m, axis=-1)
    along = np.einsum("...i,...ij,...j->...", m, square, m) / np.maximum(length, 1e-150) ** 2
    least = np.where(length > 0, length**2 / np.maximum(length**2 + along, 1e-300), 0.0)
    steep = np.where(is_kept, np.maximum(_f64(share), least), 1.0)
    # Of fewer than a thousandth it does not matter how they lie.
    some = np.maximum(steep, 1e-3)
    theirs = m / some[..., None]
    left = square / some[..., None, None] - ((1 - steep)[..., None, None] * _outer(theirs))
    xx, yy = (np.maximum(left[..., i, i], 0.0) for i in (0, 1))
    xy = np.clip(left[..., 0, 1], -np.sqrt(xx * yy), np.sqrt(xx * yy))
    return steep, theirs, np.where(is_kept[..., None], np.stack([xx, xy, yy], axis=-1), _f64(moments))


def unit_share(a: npt.ArrayLike, b: npt.ArrayLike) -> F64:
    """(...) what a spread of slopes is times as that of unit normals: the mean of s_i s_j / (1 + s^2), to the second
    order."""
    result: F64 = 1 / np.sqrt(1 + 2 * (_dot(a, a) + _dot(b, b)))
    return result


def folded_share(y: npt.ArrayLike) -> F64:
    """1 - var |x + y| for x normally distributed about 0 with variance 1, y >= 0."""
    y = _f64(y)
    beyond = np.vectorize(math.erfc, otypes=[float])(y / np.sqrt(2))
    # The mean less y; their squares' difference is what the variance loses, as the mean of squares stays 1 + y^2.
    more = np.sqrt(2 / np.pi) * np.exp(-y * y / 2) - y * beyond
    result: F64 = more * (more + 2 * y)
    return result


def folded(dir: npt.ArrayLike, n: npt.ArrayLike, a: npt.ArrayLike, b: npt.ArrayLike) -> tuple[F64, F64, F64]:
    """The unit mean of normally distributed directions about the unit `dir`, those below the plane that the unit n is
    normal to mirrored at it; and their spread: along n that of |x + y|."""
    d, normal = _f64(dir), _f64(n)
    height, along = _dot(d, normal), (_dot(a, normal), _dot(b, normal))
    variance = np.maximum(along[0] ** 2 + along[1] ** 2, 1e-20)
    share = folded_share(np.abs(height) / np.sqrt(variance))
    moved = d + (np.sqrt(height**2 + share * variance) - height)[..., None] * normal
    left = np.sqrt(1 - share)
    folded_a, folded_b = (_f64(v) + ((left - 1) * up)[..., None] * normal for v, up in zip((a, b), along, strict=True))
    return moved / np.linalg.norm(moved, axis=-1, keepdims=True), folded_a, folded_b


def widened_footprint(
    dir: npt.ArrayLike, ddx: npt.ArrayLike, ddy: npt.ArrayLike, a: npt.ArrayLike, b: npt.ArrayLike
) -> tuple[F64, F64, F64]:
    """Unit axes (..., 3), across the unit dir and each other, and squares (..., 2) of the lengths along them, the
    longer first, of the sum of w w^T of all four. Without any: the first axis across dir."""
    d, *sides = np.broadcast_arrays(_f64(dir), _f64(ddx), _f64(ddy), _f64(a), _f64(b))
    across = np.eye(3) - _outer(d)
    wide = sum((_outer(_dot(across, side[..., None, :])) for side in sides), np.zeros((*d.shape, 3)))
    values, vectors = np.linalg.eigh(wide)
    # Of either sign: on the side of the first axis across dir, and turned from there to the left.
    first = axes_across(d)[0]
    longer = vectors[..., 2] * np.where(_dot(vectors[..., 2], first) < 0, -1.0, 1.0)[..., None]
    longer = np.where(values[..., 2:] > 0, longer, first)
    return longer, np.cross(d, longer), np.maximum(values[..., :0:-1], 0.0)


SPREAD_TAPS = 3
LEAST_TAP = 0.4


def spread_taps(squares: npt.ArrayLike, texels_per_radian: npt.ArrayLike) -> F64:
    """(..., 2): how far apart, and how long, SPREAD_TAPS round footprints along the longer axis are, that vary as the
    whole, its squares (..., 2) as above: side^2 / 4 each, and step^2 (SPREAD_TAPS^2 - 1) / 12 between them. None is
    shorter than a texel."""
    longer, shorter = np.moveaxis(np.sqrt(_f64(squares)), -1, 0)
    side = np.maximum(np.maximum(shorter, LEAST_TAP * longer), 1 / _f64(texels_per_radian))
    step = np.sqrt(np.maximum(longer**2 - side**2, 0) / 4 * 12 / (SPREAD_TAPS**2 - 1))
    return np.stack([step, side], axis=-1)


def spread_roughness(roughness: npt.ArrayLike, a: npt.ArrayLike, b: npt.ArrayLike) -> F64:
    """(alpha^2 + 2 sigma^2)^(1/4), alpha the square of the roughness, 2 sigma^2 the trace; at most 1."""
    return np.minimum(_f64(roughness) ** 4 + _dot(a, a) + _dot(b, b), 1.0) ** 0.25
