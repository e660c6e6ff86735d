"""Twins of shaders/lib/color.glsl: from linear light to what a screen shows, each channel by itself.

Frames are saved with the same curves from glbump.maps.colour, in float32 and by table.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

F64 = npt.NDArray[np.float64]


def srgb_from_linear(linear: npt.ArrayLike) -> F64:
    """sRGB-encoded values of linear light 0..1, any shape (IEC 61966-2-1)."""
    x = np.asarray(linear, np.float64)
    result: F64 = np.where(x > 0.0031308, 1.055 * np.maximum(x, 0.0031308) ** (1 / 2.4) - 0.055, 12.92 * x)
    return result


def reinhard(linear: npt.ArrayLike, white: npt.ArrayLike) -> F64:
    """Extended Reinhard curve: linear light 0 and above, (..., 3), to 0..1; white (...) becomes 1, and so does all that
    is above it (Reinhard, Stark, Shirley, Ferwerda 2002, eq. 4, per channel)."""
    w = np.asarray(white, np.float64)[..., None]
    x = np.minimum(np.asarray(linear, np.float64), w)
    result: F64 = x * (1 + (x / w) / w) / (1 + x)
    return result


def filmic(linear: npt.ArrayLike) -> F64:
    """Narkowicz' fit of the ACES reference rendering (2016, without its pre-exposure): linear light 0 and above, any
    shape, to 0..1.04."""
    x = np.minimum(np.asarray(linear, np.float64), 1e4)
    result: F64 = (2.51 * x**2 + 0.03 * x) / (2.43 * x**2 + 0.59 * x + 0.14)
    return result
