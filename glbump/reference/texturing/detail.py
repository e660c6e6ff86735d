"""Levels of detail that the specification allows (OpenGL 4.6, 8.14.1), as intervals; float64.

Not clamped to the levels that there are: a look-up does that, after asking whether it magnifies.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from glbump.reference.texturing.interval import F64, Interval, Precision

NO_FOOTPRINT = 2.0**-126
"""Texels: what a footprint of none counts as."""


def given_detail(level: npt.ArrayLike, precision: Precision) -> Interval:
    """The levels that textureLod may take for `level` (...)."""
    exact = np.asarray(level, np.float64)
    return Interval(exact, exact).wider(2.0**-precision.lod)


def detail_2d(ddx: npt.ArrayLike, ddy: npt.ArrayLike, precision: Precision) -> Interval:
    """log2 of a footprint (...) given as the changes (..., 2) of u and v in texels, one pixel to the right and one up.

    rho = max(|(du/dx, dv/dx)|, |(du/dy, dv/dy)|), or any f with max(mu, mv) <= f <= mu + mv, where
    mu = max(|du/dx|, |du/dy|), mv = max(|dv/dx|, |dv/dy|).
    """
    x, y = np.broadcast_arrays(np.asarray(ddx, np.float64), np.asarray(ddy, np.float64))
    if precision.ideal_rho:
        least = most = np.maximum(np.hypot(x[..., 0], x[..., 1]), np.hypot(y[..., 0], y[..., 1]))
    else:
        extent = np.maximum(np.abs(x), np.abs(y))
        least, most = extent.max(axis=-1), extent.sum(axis=-1)
    error = 2.0**-precision.derivative
    low, high = (np.log2(np.maximum(rho, NO_FOOTPRINT)) for rho in (least * (1 - error), most * (1 + error)))
    return Interval(low, high).wider(2.0**-precision.lod)


def detail_cube(
    dir: npt.ArrayLike, ddx: npt.ArrayLike, ddy: npt.ArrayLike, size: int, precision: Precision
) -> Interval:
    """The same of a direction (..., 3), any length, that changes by (..., 3), on the face it falls on, `size` texels
    wide: of s = (sc / |ma| + 1) / 2 (8.13) the derivative is (sc' |ma| - sc |ma|') / (2 ma^2).

    Levels jump from face to face. Where the precision of the direction leaves open which one it is, any may be taken.
    """
    d, x, y = np.broadcast_arrays(*(np.asarray(v, np.float64) for v in (dir, ddx, ddy)))
    largest = np.abs(d).max(axis=-1)
    low, high = np.full(largest.shape, np.inf), np.full(largest.shape, -np.inf)
    for axis in range(3):
        possible = np.abs(d[..., axis]) >= largest * (1 - 2 * 2.0**-precision.coordinate)
        minor = [other for other in range(3) if other != axis]
        at = d[possible]
        right, up = (_on_face(at, change[possible], axis)[:, minor] * (size / 2) for change in (x, y))
        found = detail_2d(right, up, precision)
        low[possible] = np.minimum(low[possible], found.low)
        high[possible] = np.maximum(high[possible], found.high)
    return Interval(low, high)


def _on_face(dir: F64, change: F64, axis: int) -> F64:
    """Change (K, 3) of dir / |dir[axis]|."""
    major = np.abs(dir[:, axis, None])
    result: F64 = (change * major - dir * (np.sign(dir[:, axis, None]) * change[:, axis, None])) / major**2
    return result


def detail_anisotropic(ddx: npt.ArrayLike, ddy: npt.ArrayLike, limit: float, precision: Precision) -> Interval:
    """Levels of the samples of an anisotropic filter: from log2(Pmax / N), N = min(ceil(Pmax / Pmin), limit) of them
    along the longer side Pmax (EXT_texture_filter_anisotropic), to that of isotropic filtering, which is allowed."""
    x, y = (np.hypot(*np.moveaxis(np.asarray(side, np.float64), -1, 0)) for side in (ddx, ddy))
    longer = np.maximum(np.maximum(x, y), NO_FOOTPRINT)
    samples = np.minimum(np.ceil(longer / np.maximum(np.minimum(x, y), NO_FOOTPRINT)), limit)
    isotropic = detail_2d(ddx, ddy, precision)
    finest = np.log2(longer / samples * (1 - 2.0**-precision.derivative)) - 2.0**-precision.lod
    return Interval(np.minimum(finest, isotropic.low), isotropic.high)
