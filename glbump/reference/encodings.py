"""Normals and slopes from how textures store them. Twin of shaders/lib/encodings.glsl; float64.

c is (..., n) in 0..1; middle is half of the number of codes.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

F64 = npt.NDArray[np.float64]


def _unit(v: F64) -> F64:
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


def signed_codes(c: npt.ArrayLike, middle: npt.ArrayLike) -> F64:
    """What c is above or below the middle code, as a share of the codes on either side."""
    half = np.asarray(middle, np.float64)[..., None]
    return (np.asarray(c, np.float64) - half / (2 * half - 1)) * (2 * half - 1) / (half - 1)


def normal_from_rgb(c: npt.ArrayLike, middle: npt.ArrayLike) -> F64:
    """(..., 3) unit length."""
    return _unit(signed_codes(c, middle))


def normal_from_rg(c: npt.ArrayLike, middle: npt.ArrayLike) -> F64:
    """The unit vector over the disc of its x and y; past the disc's edge the one at the edge."""
    xy = signed_codes(c, middle)
    sine = np.linalg.norm(xy, axis=-1, keepdims=True)
    # (1 - s) (1 + s) keeps the digits of 1 - s^2.
    cosine = np.sqrt(np.maximum((1 - sine) * (1 + sine), 0))
    return np.concatenate([xy / np.maximum(sine, 1), cosine], axis=-1)


def normal_from_octahedral(c: npt.ArrayLike, middle: npt.ArrayLike) -> F64:
    """The direction to the point of |x| + |y| + |z| = 1 that this place unfolds: outer triangles are those of -Z."""
    x, y = np.moveaxis(signed_codes(c, middle), -1, 0)
    inside = np.abs(x) + np.abs(y) <= 1
    # Mirrored about the edge of its quarter: (x, y) -> (1 - |y|, 1 - |x|), each on its own side.
    folded_x, folded_y = np.copysign(1 - np.abs(y), x), np.copysign(1 - np.abs(x), y)
    x, y, z = np.where(inside, x, folded_x), np.where(inside, y, folded_y), 1 - np.abs(x) - np.abs(y)
    return _unit(np.stack([x, y, z], axis=-1))


def codes_from_bytes(c: npt.ArrayLike) -> F64:
    """(..., 3) bytes of 0..1 -> (..., 2): the halves of their 24 bits, over 4095."""
    bits = (np.rint(np.asarray(c, np.float64) * 255).astype(np.int64) * [2**16, 2**8, 1]).sum(axis=-1)
    return np.stack([bits >> 12, bits & 4095], axis=-1) / 4095


def slope_from_rg(c: npt.ArrayLike, middle: npt.ArrayLike, steepest: npt.ArrayLike) -> F64:
    """(..., 2) within +-steepest."""
    return signed_codes(c, middle) * np.asarray(steepest, np.float64)[..., None]


def slope_from_normal(n_tan: npt.ArrayLike) -> F64:
    """(-x / z, -y / z), or as steep in the same direction as makes the larger one 128."""
    n = np.asarray(n_tan, np.float64)
    across = np.abs(n[..., :2]).max(axis=-1, keepdims=True)
    steep = n[..., 2:] * 128 <= across
    divisor = np.where(steep, np.where(across == 0, 1.0, across / 128), n[..., 2:])
    return np.where(steep & (across == 0), 0.0, -n[..., :2] / divisor)
