"""What a picture can show in place of light: raw values, and the colours in which they are saved."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]


class Shown(NamedTuple):
    """number: in shaders/show_input.glsl. values: what pixels hold. colours: what they look like on a screen. coloured:
    (H, W, 4) values to (H, W, 3) codes, 0..1."""

    number: int
    values: str
    colours: str
    coloured: Callable[[F32], F64]


def ramp(share: npt.ArrayLike) -> F64:
    """(...) 0..1 -> (..., 3) sRGB codes 0..1, even to the eye: from dark blue by red to pale yellow.

    In Oklab (Ottosson 2020) lightness rises by the same amount for the same step; hue turns from blue through red to
    yellow; colours are as strong as sRGB holds at the ends.
    """
    t = np.clip(np.asarray(share, np.float64), 0.0, 1.0)
    lightness, hue = 0.22 + 0.72 * t, np.radians(-80.0 + 185.0 * t)
    chroma = 0.04 + 0.44 * t * (1 - t)
    a, b = chroma * np.cos(hue), chroma * np.sin(hue)
    cones = [(lightness + i * a + j * b) ** 3 for i, j in _CONES]
    linear = np.stack([sum(k * c for k, c in zip(row, cones, strict=True)) for row in _SRGB], axis=-1)
    linear = np.clip(linear, 0.0, 1.0)
    result: F64 = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    return result


_CONES = ((0.3963377774, 0.2158037573), (-0.1055613458, -0.0638541728), (-0.0894841775, -1.2914855480))
_SRGB = (
    (4.0767416621, -3.3077115913, 0.2309699292),
    (-1.2684380046, 2.6097574011, -0.3413193965),
    (-0.0041960863, -0.7034186147, 1.7076147010),
)


def _directions(values: F32) -> F64:
    return 0.5 + 0.5 * values[..., :3].astype(np.float64)


def _uv(values: F32) -> F64:
    return np.concatenate([values[..., :2] % 1.0, np.zeros_like(values[..., :1])], axis=-1).astype(np.float64)


SHOWN = {
    "level": Shown(
        1,
        "red: the mip level that the environment was read at, below 0 where it is magnified; green: that of the bump",
        "red on the ramp, 0 dark to 8 pale",
        lambda v: ramp(v[..., 0] / 8),
    ),
    "normal": Shown(
        2, "the bent normal in the world, unit length", "x, y, z from -1 to 1 as red, green, blue", _directions
    ),
    "slope": Shown(
        3,
        "the bumps' gradient in the world; its length is the tangent of how far the normal is bent",
        "degrees bent on the ramp, 0 dark to 90 pale",
        lambda v: ramp(np.arctan(np.linalg.norm(v[..., :3], axis=-1)) / (np.pi / 2)),
    ),
    "uv": Shown(4, "red: u; green: v", "u, v less their whole part as red, green", _uv),
    "reflection": Shown(
        5, "the mirrored direction in the world, unit length", "x, y, z from -1 to 1 as red, green, blue", _directions
    ),
    "footprint": Shown(
        6,
        "red, green: length and width, in radians, of what a sample sees of the environment",
        "the length on the ramp, by its logarithm: 1/4096 dark to 4 radians pale",
        lambda v: ramp((np.log2(np.maximum(v[..., 0], 1e-30)) + 12) / 14),
    ),
    "cost": Shown(
        7,
        "red: texture reads of the sample, of environment and bumps",
        "reads on the ramp, by their logarithm: 1 dark to 64 pale",
        lambda v: ramp(np.log2(np.maximum(v[..., 0], 1.0)) / 6),
    ),
}
"""By name. Where there is no such value, as u, v of the sky, all four channels are 0; alpha is 1 elsewhere."""


def colours(name: str, values: F32) -> npt.NDArray[np.uint8]:
    """(H, W, 4) values -> (H, W, 4) bytes for a screen; black, and opaque, where there are none."""
    codes = np.where(values[..., 3:] > 0, SHOWN[name].coloured(values), 0.0)
    opaque = np.ones((*codes.shape[:2], 1))
    return np.rint(255 * np.concatenate([np.clip(codes, 0, 1), opaque], axis=-1)).astype(np.uint8)
