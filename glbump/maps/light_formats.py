"""Light as textures keep it: 8 bits by the sRGB curve, 10 bits, halves, floats; which of them holds a picture, and
what that costs.

What is too bright or too dim for a format is first divided by a power of two, its pre-exposure, which is exact and
which the shader's exposure takes back. The peak of a picture then always fits, so nothing is clamped; what may be lost
is its dark end.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from glbump.frozen import Frozen
from glbump.maps.colour import display_bytes, linear_from_srgb, srgb_from_linear
from glbump.maps.encodings import HALF_DIM, HALF_MAX, packed_10, unpacked_10

F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]
Stored = npt.NDArray[Any]

DISPLAY_ERROR = 1.0
"""Most that 99 % of a picture's values may be off by, in 8-bit display codes while its median is shown as 0.18: else it
gets the next better format."""

_SAMPLE = 1 << 14
"""Texels, at most, that a picture's error is measured on: a regular grid of them."""

_MIDDLE_GREY = 0.18


class LightFormat(Frozen):
    """One way to keep light.

    dtype: of the texture, as glbump/gl/levels.py names it. bytes: of a texel. largest: that it holds; with `signed`, of
    either sign. store: (..., 3) light within that -> (..., n) as it goes to the texture. read: (..., n) as stored ->
    (..., 3) float32 light. error: of values >= 0, the most that they are off by, as linear light.
    """

    name: str
    dtype: str
    bytes: int
    largest: float
    signed: bool
    store: Callable[[F32], Stored]
    read: Callable[[Stored], F32]
    error: Callable[[F64], F64]

    def stored(self, light: F32, exponent: int = 0) -> Stored:
        """(..., 3) light -> (..., n) of the type that goes to the texture, light / 2**exponent."""
        return self.store(np.ldexp(light, -exponent) if exponent else light)

    def as_read(self, light: F32, exponent: int = 0) -> F32:
        """(..., 3) light -> what a shader gets of it, its exposure counted in: the driver's rounding aside."""
        read = self.read(self.stored(light, exponent))
        return np.ldexp(read, exponent) if exponent else read


def _stored_10(light: F32) -> Stored:
    return packed_10(np.rint(np.clip(light, 0, 1) * np.float32(1023)).astype(np.uint16))


def _stored_8(light: F32) -> Stored:
    # By a table of all halves: 0.06 codes more than half a code, and a tenth of the time.
    return display_bytes(light.astype(np.float16))


def _read_8(stored: Stored) -> F32:
    return linear_from_srgb(np.arange(256) / 255).astype(np.float32).take(stored)


def _error_8(light: F64) -> F64:
    return linear_from_srgb(srgb_from_linear(light) + 0.5 / 255).astype(np.float64) - light + light * 2.0**-11


LIGHT_FORMATS = {
    f.name: f
    for f in (
        LightFormat(
            "srgb8",
            "srgb8",
            3,
            1.0,
            False,
            _stored_8,
            _read_8,
            _error_8,
        ),
        LightFormat(
            "rgb10",
            "rgb10",
            4,
            1.0,
            False,
            _stored_10,
            lambda s: unpacked_10(s).astype(np.float32) / np.float32(1023),
            lambda v: np.full_like(v, 0.5 / 1023),
        ),
        # 11 bits down to 2**-14, then steps of 2**-24.
        LightFormat(
            "half",
            "f2",
            6,
            HALF_MAX,
            True,
            lambda v: v.astype(np.float16),
            lambda s: s.astype(np.float32),
            lambda v: np.maximum(v * 2.0**-11, 2.0**-25),
        ),
        LightFormat(
            "float",
            "f4",
            12,
            float(np.finfo(np.float32).max),
            True,
            lambda v: v.astype(np.float32, copy=False),
            lambda s: s,
            np.zeros_like,
        ),
    )
}
"""By name, from what costs least to what is nearest to the truth."""


class Fit(NamedTuple):
    """A format for a picture. exponent: its pre-exposure, 2**-exponent. why: in words, with its error."""

    format: LightFormat
    exponent: int
    why: str

    def as_read(self, light: F32) -> F32:
        """As LightFormat has it."""
        return self.format.as_read(light, self.exponent)


def fitting(wanted: str, light: F32, peak: float, *, scales: bool = True) -> Fit:
    """The first format from `wanted` on that holds the light (..., 3), whose largest value of either sign is `peak`.

    scales: whether it may have a pre-exposure. A format of halves that needs none is taken unmeasured: its error is
    0.05 % of any value down to 6e-5.
    """
    names = list(LIGHT_FORMATS)
    refused = ""
    for name in names[names.index(wanted) :]:
        how = LIGHT_FORMATS[name]
        exponents = _exponents(how, peak)
        if name == "float":
            return Fit(how, 0, refused or "as the quality asks")
        if not how.signed and light.min() < 0:
            refused = refused or f"{name} holds no light below 0, and this goes down to {light.min():.3g}"
        elif not scales and exponents[0]:
            refused = refused or f"{name} does not hold values up to {peak:.3g}"
        elif name == "half" and not exponents[0]:
            return Fit(how, 0, refused or f"values up to {peak:.3g} fit; off by 0.05 %, and by 3e-08 where dark")
        else:
            errors = {e: display_error(how, light, e) for e in exponents if scales or not e}
            exponent = min(errors, key=lambda e: errors[e])
            if errors[exponent] <= DISPLAY_ERROR:
                account = _account(how, peak, exponent, errors[exponent])
                return Fit(how, exponent, f"{refused}; {account}" if refused else account)
            refused = refused or f"in {name}, 1 % of it would be off by {errors[exponent]:.2g} of 255 codes or more"
    raise AssertionError("float holds all there is")


def _exponents(how: LightFormat, peak: float) -> tuple[int, ...]:
    """What to try: 0 where the peak is within reach and not so dim that a half has lost bits of it; what brings it to
    the largest value that the format holds, or a half's to about 1."""
    if peak > how.largest:
        return (math.ceil(math.log2(peak / how.largest)),)
    if how.signed:
        return (math.floor(math.log2(peak)),) if 0.0 < peak < HALF_DIM else (0,)
    # Codes of 8 bits may be the picture's own.
    return (0, math.floor(math.log2(peak)) + 1) if 0.0 < peak < 0.5 else (0,)


def display_error(how: LightFormat, light: F32, exponent: int) -> float:
    """What 99 % of the values of (..., 3) are off by at most, in 8-bit display codes, while their median is 0.18.

    Measured on a grid of some of the texels.
    """
    texels = light.reshape(-1, light.shape[-1])
    some = texels[:: max(1, len(texels) // _SAMPLE)]
    size = np.abs(some[some != 0])
    gain = _MIDDLE_GREY / float(np.median(size)) if size.size else 1.0
    want, got = (
        srgb_from_linear(np.clip(np.abs(v) * gain, 0, 1))
        for v in (some.astype(np.float64), how.as_read(some, exponent))
    )
    return float(np.percentile(255 * np.abs(got - want), 99))


def _account(how: LightFormat, peak: float, exponent: int, error: float) -> str:
    scale = 2.0**exponent
    at = np.array([peak / scale, 0.0])
    top, bottom = how.error(at) * scale
    moved = f"times 2^{-exponent}, which the exposure takes back, " if exponent else ""
    return (
        f"{moved}values up to {peak:.3g} fit: off by {top:.2g} there at most, by {bottom:.2g} where dark; "
        f"99 % by {error:.2g} of 255 codes"
    )
