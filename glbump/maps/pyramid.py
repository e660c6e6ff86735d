"""Mip chains by box averages that lose no texel, whatever the size.

Drivers shrink odd sizes with one bilinear tap: 7 -> 3 -> 1 reads one texel of seven. Here every texel counts
by the length it covers (polyphase box weights; Guthe and Heckbert, NVIDIA TR-01838).
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]


def _parts(n: int) -> list[tuple[slice, F64 | float]]:
    """The texels that each of n // 2 averages takes, and their shares, which are those of the length they cover."""
    m = n // 2
    if n == 2 * m:
        return [(slice(0, None, 2), 0.5), (slice(1, None, 2), 0.5)]
    k = np.arange(m, dtype=np.float64)
    return [(slice(0, -1, 2), (m - k) / n), (slice(1, None, 2), np.full(m, m / n)), (slice(2, None, 2), (k + 1) / n)]


def _along(share: F64 | float, ndim: int) -> F64 | float:
    """Shares along the first of `ndim` axes."""
    return share if isinstance(share, float) else share.reshape(-1, *[1] * (ndim - 1))


def _halve_axis(array: npt.NDArray[Any], axis: int) -> F64:
    """float64 averages along an axis of length n: n // 2 of them, each over n / (n // 2) texels; 1 stays 1."""
    a = np.moveaxis(array, axis, 0)
    n = len(a)
    if n == 1:
        return array.astype(np.float64)
    if n % 2 == 0:
        halved = np.add(a[0::2], a[1::2], dtype=np.float64) * 0.5
    else:
        halved = sum(_along(share, a.ndim) * a[part] for part, share in _parts(n))
    return np.moveaxis(halved, 0, axis)


def _halve(array: npt.NDArray[Any]) -> F64:
    return _halve_axis(_halve_axis(array, -3), -2)


def halve(array: npt.NDArray[Any]) -> F32:
    """The next mip level of (..., H, W, C): (..., max(1, H // 2), max(1, W // 2), C) float32.

    Sums in float64. The mean is kept, exactly (but for the rounding to float32) also at odd sizes.
    """
    return _halve(array).astype(np.float32)


def chain(array: npt.NDArray[Any], most: int = 64) -> list[F32]:
    """The mip levels of (..., H, W, C), `array` itself first, 1x1 or level `most` last; float32, each rounded once."""
    levels = [np.asarray(array, np.float32)]
    exact: npt.NDArray[Any] = array
    while max(exact.shape[-3:-1]) > 1 and len(levels) <= most:
        exact = _halve(exact)
        levels.append(exact.astype(np.float32))
    return levels


def slope_moments(slopes: npt.NDArray[Any], most: int = 64) -> list[tuple[F32, F32]]:
    """The levels of slopes (..., H, W, 2): of each the means (..., h, w, 2) and the central second moments uu, uv, vv
    (..., h, w, 3) of all slopes of level 0 that a texel covers, float32; the slopes themselves, and 0, first.

    A texel's moments are the weighted mean of its parts' moments and of the squares of how far their means lie from its
    own (Chan, Golub and LeVeque 1979): nothing is subtracted from a mean of squares, so that nothing cancels, and what
    is a covariance stays one (uu vv >= uv^2). Sums in float64. The means are those of `chain`.
    """
    mean: npt.NDArray[Any] = np.asarray(slopes, np.float64)
    moments = np.zeros((*mean.shape[:-1], 3))
    levels = [(mean.astype(np.float32), moments.astype(np.float32))]
    while max(mean.shape[-3:-1]) > 1 and len(levels) <= most:
        for axis in (-3, -2):
            mean, moments = _merge_axis(mean, moments, axis)
        levels.append((mean.astype(np.float32), moments.astype(np.float32)))
    return levels


def _merge_axis(mean: F64, moments: F64, axis: int) -> tuple[F64, F64]:
    means, old = np.moveaxis(mean, axis, 0), np.moveaxis(moments, axis, 0)
    if len(means) == 1:
        return mean, moments
    merged = np.moveaxis(_halve_axis(mean, axis), axis, 0)
    result = np.zeros((*merged.shape[:-1], 3))
    for part, share in _parts(len(means)):
        off = means[part] - merged
        u, v = off[..., 0], off[..., 1]
        result += _along(share, old.ndim) * (old[part] + np.stack([u * u, u * v, v * v], axis=-1))
    return np.moveaxis(merged, 0, axis), np.moveaxis(result, 0, axis)
