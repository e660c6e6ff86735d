"""Spreads of normals and directions. Twin of shaders/lib/spread.glsl; float64, arrays (..., 3) and (..., 3, 3)."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

F64 = npt.NDArray[np.float64]

MOST_SPREAD = 1e16
"""Most that slopes vary: all directions are as likely long before."""


def _f64(value: npt.ArrayLike) -> F64:
    return np.asarray(value, np.float64)


def _dot(a: F64, b: F64) -> F64:
    result: F64 = np.einsum("...i,...i->...", a, b)
    return result


def _outer(a: F64, b: F64) -> F64:
    result: F64 = a[..., :, None] * b[..., None, :]
    return result


def _trace(matrix: F64) -> F64:
    result: F64 = np.einsum("...ii->...", matrix)
    return result


def spread_along(a: npt.ArrayLike, b: npt.ArrayLike, moments: npt.ArrayLike) -> F64:
    """The covariance of a s_x + b s_y, s having the second moments (uu, uv, vv)."""
    m = _f64(moments)
    axes = np.stack([_f64(a), _f64(b)], axis=-1)
    square = np.stack([m[..., :2], m[..., 1:]], axis=-2)
    result: F64 = axes @ square @ np.swapaxes(axes, -1, -2)
    return result


def carried_spread(change: npt.ArrayLike, spread: npt.ArrayLike) -> F64:
    """The covariance of C v, where v has `spread`: C spread C^T."""
    c = _f64(change)
    result: F64 = np.einsum("...ij,...jk,...lk->...il", c, _f64(spread), c)
    return result


def normal_spread(n: npt.ArrayLike, gradient: npt.ArrayLike, spread: npt.ArrayLike) -> F64:
    """The covariance of the normalised n - g, where g has `spread`, to the first order; MOST_SPREAD each way across
    the bent normal where it is past that."""
    bent = _f64(n) - _f64(gradient)
    length = np.linalg.norm(bent, axis=-1)[..., None]
    m = bent / length
    across = np.eye(3) - _outer(m, m)
    result = carried_spread(across / length[..., None], spread)
    return np.where(_trace(result)[..., None, None] < MOST_SPREAD, result, MOST_SPREAD * across)


def unit_spread(spread: npt.ArrayLike) -> F64:
    """A covariance of slopes as that of unit normals: the mean of s_i s_j / (1 + s^2), to the second order."""
    s = _f64(spread)
    return s / (1 + 2 * _trace(s))[..., None, None]


def reflect_matrix(dir: npt.ArrayLike, n: npt.ArrayLike) -> F64:
    """d reflect_dir / dn."""
    d, n = np.broadcast_arrays(_f64(dir), _f64(n))
    return -2 * (_outer(n, d) + _dot(d, n)[..., None, None] * np.eye(3))


def refract_matrix(dir: npt.ArrayLike, n: npt.ArrayLike, eta: npt.ArrayLike) -> F64:
    """d refract_dir / dn, for changes across n; next to the critical angle, where it grows without bound, as where the
    cosine behind the surface is 1e-3."""
    d, n = np.broadcast_arrays(_f64(dir), _f64(n))
    eta = np.broadcast_to(_f64(eta), d.shape[:-1])
    along = _dot(d, n)
    rest = 1 - eta**2 * (1 - along**2)
    through = np.where(along > 0, 1.0, -1.0) * np.sqrt(np.maximum(rest, 1e-6))
    # T = eta d + (through - eta along) n; through changes by eta^2 along / through of what along changes by.
    by_along = eta**2 * along / through - eta
    bent = by_along[..., None, None] * _outer(n, d) + (through - eta * along)[..., None, None] * np.eye(3)
    return np.where(rest[..., None, None] < 0, reflect_matrix(d, n), bent)


def folded_mean(y: npt.ArrayLike) -> F64:
    """The mean of |x + y| for x normally distributed about 0 with variance 1."""
    y = _f64(y)
    result: F64 = y * np.vectorize(math.erf, otypes=[float])(y / np.sqrt(2)) + np.sqrt(2 / np.pi) * np.exp(-y * y / 2)
    return result


def folded_dir(dir: npt.ArrayLike, n: npt.ArrayLike, spread: npt.ArrayLike) -> F64:
    """The unit mean of normally distributed directions about the unit `dir`, those below the plane that the unit n is
    normal to mirrored at it."""
    d, n = np.broadcast_arrays(_f64(dir), _f64(n))
    height, s = _dot(d, n), _height_deviation(n, spread)
    moved = d + (s * folded_mean(np.abs(height) / s) - height)[..., None] * n
    return moved / np.linalg.norm(moved, axis=-1, keepdims=True)


def folded_spread(dir: npt.ArrayLike, n: npt.ArrayLike, spread: npt.ArrayLike) -> F64:
    """The spread of those: along n that of |x + y|, 1 + y^2 - folded_mean(y)^2 of what it was."""
    d, n = np.broadcast_arrays(_f64(dir), _f64(n))
    y = np.abs(_dot(d, n)) / _height_deviation(n, spread)
    mean = folded_mean(y)
    left = np.sqrt(np.clip(1 - (mean - y) * (mean + y), 0, 1))
    return carried_spread(np.eye(3) + (left - 1)[..., None, None] * _outer(n, n), spread)


def _height_deviation(n: F64, spread: npt.ArrayLike) -> F64:
    return np.sqrt(np.maximum(np.einsum("...i,...ij,...j->...", n, _f64(spread), n), 1e-20))


def widened_footprint(
    dir: npt.ArrayLike, ddx: npt.ArrayLike, ddy: npt.ArrayLike, spread: npt.ArrayLike, sides: npt.ArrayLike
) -> tuple[F64, F64]:
    """Axes, at right angles and the longer first, of ddx ddx^T + ddy ddy^T + sides * spread across the unit dir."""
    d, x, y = np.broadcast_arrays(_f64(dir), _f64(ddx), _f64(ddy))
    across = np.eye(3) - _outer(d, d)
    wide = _outer(x, x) + _outer(y, y) + _f64(sides)[..., None, None] * _f64(spread)
    values, vectors = np.linalg.eigh(carried_spread(across, wide))
    # Of either sign: on the side of the first axis across dir, and turned from there to the left.
    first = np.where(np.abs(d[..., :1]) > 0.6, np.cross(d, [0.0, 0.0, 1.0]), np.cross([1.0, 0.0, 0.0], d))
    longer = vectors[..., 2] * np.where(_dot(vectors[..., 2], first) < 0, -1.0, 1.0)[..., None]
    shorter = vectors[..., 1] * np.where(_dot(np.cross(d, longer), vectors[..., 1]) < 0, -1.0, 1.0)[..., None]
    lengths = np.sqrt(np.maximum(values, 0.0))
    return lengths[..., 2:] * longer, lengths[..., 1:2] * shorter


SPREAD_TAPS = 4
LEAST_TAP = 0.45


def spread_taps(wide_x: npt.ArrayLike, wide_y: npt.ArrayLike) -> tuple[F64, F64, F64]:
    """Step, and both axes of each, of SPREAD_TAPS footprints along wide_x that vary as the whole: side^2 / 4 each, and
    step^2 (SPREAD_TAPS^2 - 1) / 12 between them."""
    x, y = np.broadcast_arrays(_f64(wide_x), _f64(wide_y))
    longer, shorter = (np.linalg.norm(v, axis=-1)[..., None] for v in (x, y))
    side = np.maximum(shorter, LEAST_TAP * longer)
    axis, across = (v / np.where(length > 0, length, 1.0) for v, length in ((x, longer), (y, shorter)))
    step = np.sqrt((longer**2 - side**2) / 4 * 12 / (SPREAD_TAPS**2 - 1)) * axis
    return step, side * axis, side * across


def spread_roughness(roughness: npt.ArrayLike, spread: npt.ArrayLike) -> F64:
    """(alpha^2 + 2 sigma^2)^(1/4), alpha the square of the roughness, 2 sigma^2 the trace; at most 1."""
    return np.minimum(_f64(roughness) ** 4 + _trace(_f64(spread)), 1.0) ** 0.25
