"""Colour: the sRGB curve, tone maps, and the way from linear light to 8-bit display values.

Everything works on each channel by itself, so that a frame of half floats is converted by one look-up in a
table of 65,536 entries; `display_bytes` gives the same bytes for a half and for the float of the same value.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import Any

import numpy as np
import numpy.typing as npt

from glbump import validate as check

Floats = npt.NDArray[np.floating[Any]]

REINHARD_WHITE = 4.0
"""Linear value that the "reinhard" curve takes to display white: two stops above 1."""


def _clip(x: Floats) -> Floats:
    return x


def _reinhard(x: Floats) -> Floats:
    """Extended Reinhard curve, x (1 + x/w^2) / (1 + x); w goes to 1.

    Source: Reinhard, Stark, Shirley, Ferwerda, Photographic Tone Reproduction for Digital Images, 2002,
    eq. 4, here per channel instead of on luminance.
    """
    # Above the white point all is white; stopping there keeps infinities from becoming NaN.
    x = np.minimum(x, REINHARD_WHITE)
    return x * (1 + x / REINHARD_WHITE**2) / (1 + x)


def _filmic(x: Floats) -> Floats:
    """A fit of the ACES reference rendering: toe, shoulder, 1 -> 0.80, 0.18 -> 0.27.

    Source: Narkowicz, ACES Filmic Tone Mapping Curve, 2016 (the fit without its pre-exposure of 0.6).
    """
    x = np.minimum(x, 1e4)
    return x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14)


_CURVES: dict[str, Callable[[Floats], Floats]] = {"clip": _clip, "reinhard": _reinhard, "filmic": _filmic}

TONES = tuple(_CURVES)
"""Names of the tone maps: "clip" (0..1, nothing else), "reinhard" (white at 4), "filmic" (ACES fit)."""


def linear_from_srgb(encoded: npt.ArrayLike) -> Floats:
    """sRGB-encoded values -> linear light, by IEC 61966-2-1; float32 stays float32.

    0..1 is the display's range; values outside follow the same two pieces.
    """
    x = _floats(encoded)
    return np.where(x <= 0.04045, x / 12.92, ((np.maximum(x, 0.04045) + 0.055) / 1.055) ** 2.4)


def srgb_from_linear(linear: npt.ArrayLike) -> Floats:
    """Linear light -> sRGB-encoded values, the inverse of `linear_from_srgb`. float32 stays float32."""
    x = _floats(linear)
    return np.where(x <= 0.0031308, x * 12.92, 1.055 * np.maximum(x, 0.0031308) ** (1 / 2.4) - 0.055)


def tone_map(linear: npt.ArrayLike, tone: str = "clip", exposure: float = 0.0) -> Floats:
    """Linear light of any range -> display-linear 0..1, each channel by itself.

    linear: any shape, colour without alpha. exposure: stops, applied before the curve. tone: one of TONES.
    NaN stays NaN: whoever writes a file has to refuse it. SceneError for an unknown tone or exposure.
    """
    check.choice("tone", tone, TONES)
    gain = 2.0 ** check.number("exposure", exposure, least=-64, most=64)
    x = _floats(linear)
    # Past the largest float is white all the same; a signalling NaN is a NaN like the others.
    with np.errstate(over="ignore", invalid="ignore"):
        lit = np.maximum(x * x.dtype.type(gain), 0)
    return np.clip(_CURVES[tone](lit), 0, 1)


def _floats(values: npt.ArrayLike) -> Floats:
    """float64 stays, everything else becomes float32 (integers float64)."""
    x = np.asarray(values)
    if x.dtype == np.float16:
        return x.astype(np.float32)
    return x if x.dtype in (np.float32, np.float64) else x.astype(np.float64)


def eight_bit(values: npt.ArrayLike) -> npt.NDArray[np.uint8]:
    """0..1 -> 0..255, rounded to the nearest; values outside are clipped. No NaN."""
    x = _floats(values)
    rounded: npt.NDArray[np.uint8] = (np.clip(x, 0, 1) * 255 + 0.5).astype(np.uint8)
    return rounded


def display_bytes(linear: Floats, tone: str = "clip", exposure: float = 0.0) -> npt.NDArray[np.uint8]:
    """Linear colour of any shape -> sRGB-encoded bytes through a tone map; half floats go through a table.

    No NaN: whoever writes a file has to refuse it first.
    """
    if linear.dtype == np.float16:
        return _half_table(tone, check.number("exposure", exposure)).take(linear.view(np.uint16))
    return eight_bit(srgb_from_linear(tone_map(linear, tone, exposure)))


def alpha_bytes(alpha: Floats) -> npt.NDArray[np.uint8]:
    """Coverage 0..1 of any shape -> bytes, with no curve; half floats go through a table."""
    if alpha.dtype == np.float16:
        return _half_coverage().take(alpha.view(np.uint16))
    return eight_bit(alpha)


def _every_half() -> npt.NDArray[np.float32]:
    # NaNs become 0: no one looks them up, and their conversion would raise a warning.
    with np.errstate(invalid="ignore"):
        return np.nan_to_num(np.arange(65536, dtype=np.uint16).view(np.float16).astype(np.float32), posinf=np.inf)


@lru_cache(maxsize=16)
def _half_table(tone: str, exposure: float) -> npt.NDArray[np.uint8]:
    return display_bytes(_every_half(), tone, exposure)


@lru_cache(maxsize=1)
def _half_coverage() -> npt.NDArray[np.uint8]:
    return eight_bit(_every_half())
