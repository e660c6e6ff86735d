"""Mip chains by box averages that lose no texel, whatever the size.

Drivers shrink odd sizes with one bilinear tap: 7 -> 3 -> 1 reads one texel of seven. Here every texel counts
by the length it covers (polyphase box weights; Guthe and Heckbert, NVIDIA TR-01838).
"""

from __future__ import annotations

import math
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


def parts(n: int) -> tuple[int, int]:
    """Texels of the level after one of n texels, and how many of the n each covers, wholly or in part."""
    return (1, 1) if n == 1 else (n // 2, 2 + n % 2)


def part_edges(n: int) -> F64:
    """The edges, in 0..1, of all parts of n texels that fall to different texels of the next level, in order."""
    m, _ = parts(n)
    fine = np.arange(n + 1) / n
    return fine if n % 2 == 0 or n == 1 else np.sort(np.concatenate([fine, np.arange(1, m) / m]))


_BAND = 1 << 15
"""Values of a level that are made at a time, so that float64 sums stay in the second-level cache."""


def merge(texels: npt.NDArray[Any], weights: F64) -> F64:
    """The next level of texels (tiles, H, W, C), by weights (tiles or 1, h, p, w or 1, q) of the p x q texels that each
    of the next level covers (`parts`): (tiles, h, w, C) float64. Where all weights are 0, texels count alike."""
    tiles, height, width, channels = texels.shape
    (h, p), (w, q) = parts(height), parts(width)
    result = np.empty((tiles, h, w, channels))
    band = max(1, _BAND // (w * channels))
    total = weights.sum(axis=(2, 4))
    shares = weights / np.where(total > 0, total, 1.0)[:, :, None, :, None]
    shares += np.where(total > 0, 0.0, 1 / (p * q))[:, :, None, :, None]
    for tile in range(tiles):
        share = shares[tile if len(shares) > 1 else 0]
        for top in range(0, h, band):
            rows = slice(top, min(top + band, h))
            values = result[tile, rows]
            _merge_band(texels[tile, 2 * top :], share[rows], values)
    return result


def _merge_band(texels: npt.NDArray[Any], shares: F64, values: F64) -> None:
    """Fill `values` (h, w, C) from the first texels (H, W, C) by shares (h, p, w or 1, q)."""
    h, w, channels = values.shape
    for i in range(shares.shape[1]):
        for j in range(shares.shape[3]):
            # Channel by channel: NumPy is three times slower where a short last axis meets a broadcast weight.
            for c in range(channels):
                part = texels[i : i + 2 * h - 1 : 2, j : j + 2 * w - 1 : 2, c]
                if i == j == 0:
                    np.multiply(part, shares[:, i, :, j], out=values[..., c])
                else:
                    values[..., c] += part * shares[:, i, :, j]


# ------------------------------------------------------------ Kaiser


_ALPHA, _HALF_WIDTH = 4.0, 3.0

LEAST_KAISER = 8
"""Texels along the shorter side below which the kernel, twelve texels wide, would see the far side."""


def _kaiser(x: F64) -> F64:
    """sinc(x) under a Kaiser window of alpha 4 that ends at 3 texels of the coarser level (Castano's choice)."""
    inside = np.maximum(1 - (x / _HALF_WIDTH) ** 2, 0.0)
    window = np.where(np.abs(x) < _HALF_WIDTH, np.i0(_ALPHA * np.sqrt(inside)) / np.i0(_ALPHA), 0.0)
    return np.sinc(x) * window


def kaiser_margin(n: int) -> int:
    """Texels beyond each end of n that the kernel reads."""
    return math.ceil(_HALF_WIDTH * n / parts(n)[0])


def _kaiser_taps(n: int) -> F64:
    """(n // 2, taps): shares of the texels 2 i - margin, 2 i - margin + 1 ... in texel i, whose sum is 1.

    Each is the kernel's mean over the texel, of 32 places: at odd sizes it lies elsewhere from texel to texel.
    """
    m, _ = parts(n)
    ratio, margin = n / m, kaiser_margin(n)
    i = np.arange(m)[:, None, None]
    at = 2 * i - margin + np.arange(2 * margin + 2 + n % 2)[None, :, None] + (np.arange(32) + 0.5) / 32
    shares = _kaiser(at / ratio - (i + 0.5)).mean(axis=-1)
    result: F64 = shares / shares.sum(axis=1, keepdims=True)
    return result


def kaiser_inner(array: F64, size: tuple[int, int]) -> F64:
    """The next level of tiles of `size` (width, height) from (tiles, H + 2 m, W + 2 n, C) float64, with as many texels
    beyond their edges as `kaiser_margin` says; an axis of one value has that all along."""
    tiles, rows, columns, channels = array.shape
    down, right = (
        np.ones((1, 1)) if extent == 1 else _kaiser_taps(n) for extent, n in ((rows, size[1]), (columns, size[0]))
    )
    result = np.empty((tiles, len(down), len(right), channels))
    band = max(1, _BAND // (columns * channels))
    for top in range(0, len(down), band):
        shares = down[top : top + band]
        for tile in range(tiles):
            # Columns first, for long runs of numbers side by side.
            by_columns = np.ascontiguousarray(_weighed(array[tile, 2 * top :], shares).transpose(1, 2, 0))
            narrowed = _weighed(by_columns, right)
            result[tile, top : top + band] = narrowed.transpose(2, 0, 1)
    return result


def _weighed(a: F64, shares: F64) -> F64:
    """Sums over the first axis: (i, ...) of shares (i, taps) times what lies from 2 i on."""
    result = np.zeros((len(shares), *a.shape[1:]))
    for tap in np.flatnonzero(shares.any(axis=0)):
        result += _along(shares[:, tap], a.ndim) * a[tap : tap + 2 * len(shares) - 1 : 2]
    return result


def kaiser(array: npt.NDArray[Any], *, wraps: bool) -> F64:
    """The next level of (H, W, C) by a Kaiser kernel of alpha 4 and width 3 (of a side): (h, w, C) float64.

    Sharper than the box, and it rings: beside an edge values go past both of its sides by up to a tenth of the step,
    so that what must not be negative is to be clipped, and squares do not give covariances. Its sum over texels is the
    picture's where sizes are even and it repeats. wraps: the picture repeats; else its edge goes on beyond it.
    """
    height, width, _ = array.shape
    beyond = [(kaiser_margin(n) if n > 1 else 0,) * 2 for n in (height, width)]
    padded = np.pad(array.astype(np.float64), [*beyond, (0, 0)], mode="wrap" if wraps else "edge")
    return kaiser_inner(padded[None], (width, height))[0]


def chain_by(how: str, array: npt.NDArray[Any], *, wraps: bool) -> list[F32]:
    """The mip levels of (H, W, C) by "kaiser", clipped to the range that `array` has, or else by "box", as `chain`.

    wraps: the map repeats. Levels after one of fewer than 8 texels along a side are means: the kernel sees twelve.
    """
    if how != "kaiser":
        return chain(array)
    levels = [np.asarray(array, np.float32)]
    low, high = array.min(axis=(0, 1)), array.max(axis=(0, 1))
    while min(levels[-1].shape[:2]) >= LEAST_KAISER:
        levels.append(np.clip(kaiser(levels[-1], wraps=wraps), low, high).astype(np.float32))
    return levels[:-1] + chain(levels[-1])


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
