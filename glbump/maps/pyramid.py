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


def _halve_axis(array: npt.NDArray[Any], axis: int) -> F64:
    """float64 averages along an axis of length n: n // 2 of them, each over n / (n // 2) texels; 1 stays 1."""
    a = np.moveaxis(array, axis, 0)
    n = len(a)
    if n == 1:
        return array.astype(np.float64)
    m = n // 2
    if n == 2 * m:
        halved = np.add(a[0::2], a[1::2], dtype=np.float64) * 0.5
    else:
        k = np.arange(m, dtype=np.float64).reshape((m,) + (1,) * (a.ndim - 1))
        halved = ((m - k) * a[0:-1:2] + m * a[1::2] + (k + 1) * a[2::2]) / n
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
