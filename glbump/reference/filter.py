"""Footprints to mip levels. Twin of shaders/lib/filter.glsl; float64."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

F64 = npt.NDArray[np.float64]

MOST_THIN = 8
"""Of a direction's footprint: how many times longer than wide it counts at most. Measured on mirror balls in three
pictures: 4 to 16 are best, 1 (the longer side alone) blurs, without a limit it sparkles where it is thinnest."""


def wrapped_difference(difference: npt.ArrayLike) -> F64:
    """The short way round a coordinate that wraps at 1: within -1/2..1/2."""
    d = np.asarray(difference, np.float64)
    return d - np.rint(d)


def isotropic_level(ddx: npt.ArrayLike, ddy: npt.ArrayLike) -> F64:
    """log2 of the longer of two footprint vectors (..., 2) in texels; -63 for none."""
    longest = np.maximum(*(np.linalg.norm(np.asarray(v, np.float64), axis=-1) for v in (ddx, ddy)))
    return np.log2(np.maximum(longest, 2.0**-63))


def longest_level(ddx: npt.ArrayLike, ddy: npt.ArrayLike, texels_per_radian: npt.ArrayLike) -> F64:
    """log2 of the texels that the longer change (..., 3) of a unit direction spans; -63 for none."""
    longest = np.maximum(*(np.linalg.norm(np.asarray(v, np.float64), axis=-1) for v in (ddx, ddy)))
    return np.log2(np.maximum(longest * texels_per_radian, 2.0**-63))


def direction_level(ddx: npt.ArrayLike, ddy: npt.ArrayLike, texels_per_radian: npt.ArrayLike) -> F64:
    """Half the log2 of the texels that a footprint with the sides ddx, ddy (..., 3) covers: by its area, at least a
    MOST_THIN-th of the square of its ellipse's longer axis; -63 for none."""
    x, y = (np.asarray(v, np.float64) for v in (ddx, ddy))
    xx, xy, yy = (np.einsum("...i,...i->...", a, b) for a, b in ((x, x), (x, y), (y, y)))
    longest = (xx + yy) / 2 + np.hypot((xx - yy) / 2, xy)
    area = np.maximum(np.linalg.norm(np.cross(x, y), axis=-1), longest / MOST_THIN)
    return 0.5 * np.log2(np.maximum(area * np.asarray(texels_per_radian) ** 2, 2.0**-126))


def share_above(height: npt.ArrayLike, ddx: npt.ArrayLike, ddy: npt.ArrayLike) -> F64:
    """The share of a footprint above 0, of heights (...) that change by ddx, ddy (...) over it; a step without one."""
    h, width = np.asarray(height, np.float64), np.abs(ddx) + np.abs(ddy)
    none = width < 1e-30
    ramp = np.clip(0.5 + h / np.where(none, 1.0, width), 0.0, 1.0)
    result: F64 = np.where(none, 0.5 + 0.5 * np.sign(h), ramp)
    return result


def footprint_axes(ddx: npt.ArrayLike, ddy: npt.ArrayLike) -> tuple[F64, F64]:
    """(..., 3) twice: the axes of the footprint with the sides ddx, ddy, the longer one first.

    The columns of the matrix [ddx ddy], turned by the angle that sets them at right angles: its singular vectors times
    its singular values (Jacobi).
    """
    x, y = np.asarray(ddx, np.float64), np.asarray(ddy, np.float64)
    xx, xy, yy = (np.einsum("...i,...i->...", *pair)[..., None] for pair in ((x, x), (x, y), (y, y)))
    angle = 0.5 * np.arctan2(2 * xy, xx - yy)
    return np.cos(angle) * x + np.sin(angle) * y, np.cos(angle) * y - np.sin(angle) * x


def footprint_taps(
    major: npt.ArrayLike, minor: npt.ArrayLike, texels_per_radian: npt.ArrayLike, most: npt.ArrayLike
) -> F64:
    """How many samples (...) along a footprint with these axes (..., 3): its length over its width, or its texels,
    rounded up from a hundredth more."""
    long, short = (np.linalg.norm(np.asarray(axis, np.float64), axis=-1) for axis in (major, minor))
    wanted = np.minimum(long / np.maximum(short, 1e-30), long * np.asarray(texels_per_radian))
    return np.clip(np.ceil(wanted - 0.01), 1, most)


def quad_differences(values: npt.ArrayLike) -> tuple[F64, F64]:
    """dFdx and dFdy of values (H, W, C) on a grid of pixels, row 0 on top: differences within quads of 2x2 pixels,
    counted from the lower left as OpenGL does; each row and column of a quad has its own ("fine", as llvmpipe
    takes them). NaN where a pixel that is needed has no value.
    """
    v = np.asarray(values, np.float64)[::-1]
    height, width = v.shape[:2]
    # A last odd row or column has no partner: it takes the difference to the one before.
    y, x = (np.minimum(np.arange(n) // 2 * 2, max(n - 2, 0)) for n in (height, width))
    y1, x1 = np.minimum(y + 1, height - 1), np.minimum(x + 1, width - 1)
    return (v[:, x1] - v[:, x])[::-1], (v[y1] - v[y])[::-1]


def through_levels(look: Callable[[int, npt.NDArray[np.bool_]], F64], level: F64, count: int, how: str) -> F64:
    """Values (K, C) read from a chain of `count` levels at levels of detail (K,).

    look(i, chosen): bilinear values of level i for the chosen ones of the K. how: "nearest-level" rounds the level of
    detail, halves down (OpenGL 4.6, equation 8.23); "trilinear" weights the two levels that it lies between.
    """
    if count == 1:
        return look(0, np.ones(len(level), bool))
    detail = np.clip(level, 0, count - 1)
    below = np.floor(detail) if how == "trilinear" else np.ceil(detail + 0.5) - 1
    weight = detail - below if how == "trilinear" else np.zeros_like(detail)
    result: F64 | None = None
    for i in range(count):
        for share, chosen in ((1 - weight, below == i), (weight, (below == i - 1) & (weight > 0))):
            if chosen.any():
                values = look(i, chosen)
                if result is None:
                    result = np.zeros((len(level), values.shape[-1]))
                result[chosen] += share[chosen, None] * values
    assert result is not None
    return result
