"""Gradients of a height map, at any place. Twin of shaders/lib/gradients.glsl; float64.

Heights are (H, W), row 0 at v = 0, and repeat; places are (..., 2). Linear interpolation commutes with differences of
whole texels, so those kernels are the gradients of the whole map (glbump/maps/gradients.py), interpolated.
"""

from __future__ import annotations

from math import comb

import numpy as np
import numpy.typing as npt

from glbump.maps.gradients import derivative

F64 = npt.NDArray[np.float64]


def height_at(heights: npt.ArrayLike, uv: npt.ArrayLike) -> F64:
    """(...): between the four texel centres about uv, linearly both ways."""
    h, place = np.asarray(heights, np.float64), np.asarray(uv, np.float64)
    rows, columns = h.shape
    x, y = place[..., 0] * columns - 0.5, place[..., 1] * rows - 0.5
    left, low = np.floor(x).astype(np.intp), np.floor(y).astype(np.intp)
    a, b = x - left, y - low
    near, far = ((1 - a) * h[r % rows, left % columns] + a * h[r % rows, (left + 1) % columns] for r in (low, low + 1))
    return (1 - b) * near + b * far


def _of_texels(heights: npt.ArrayLike, uv: npt.ArrayLike, kernel: str) -> F64:
    h = np.asarray(heights, np.float64)
    slopes = [derivative(h, axis, kernel, "wrap") * h.shape[axis] for axis in (1, 0)]
    return np.stack([height_at(s, uv) for s in slopes], axis=-1)


def slope_forward(heights: npt.ArrayLike, uv: npt.ArrayLike) -> F64:
    """(..., 2): to the next texel."""
    return _of_texels(heights, uv, "forward")


def slope_across(heights: npt.ArrayLike, uv: npt.ArrayLike, reach: npt.ArrayLike) -> F64:
    """(..., 2): from `reach` texels before to as many after."""
    h, place, r = np.asarray(heights, np.float64), np.asarray(uv, np.float64), np.asarray(reach, np.float64)
    slopes = []
    for axis, count in ((0, h.shape[1]), (1, h.shape[0])):
        off = r[..., None] / count * np.eye(2)[axis]
        slopes.append((height_at(h, place + off) - height_at(h, place - off)) * count / (2 * r))
    return np.stack(slopes, axis=-1)


def slope_central(heights: npt.ArrayLike, uv: npt.ArrayLike) -> F64:
    """(..., 2): from the texel before to the texel after."""
    return _of_texels(heights, uv, "central")


def slope_half(heights: npt.ArrayLike, uv: npt.ArrayLike) -> F64:
    """(..., 2): over the texel about uv."""
    return slope_across(heights, uv, 0.5)


def slope_fourth(heights: npt.ArrayLike, uv: npt.ArrayLike) -> F64:
    """(..., 2): right for heights up to the fourth power."""
    return _of_texels(heights, uv, "fourth")


def slope_smoothed(heights: npt.ArrayLike, uv: npt.ArrayLike, side: npt.ArrayLike) -> F64:
    """(..., 2): slope_central, less `side` times its second difference along the other axis, in texels."""
    h, place = np.asarray(heights, np.float64), np.asarray(uv, np.float64)
    share = np.asarray(side, np.float64)[..., None]
    slopes = slope_central(h, place)
    for axis, count in ((0, h.shape[1]), (1, h.shape[0])):
        off = np.eye(2)[axis] / count
        second = slope_central(h, place + off) + slope_central(h, place - off) - 2 * slope_central(h, place)
        slopes = slopes + share * second * np.eye(2)[1 - axis]
    return slopes


def slope_sobel(heights: npt.ArrayLike, uv: npt.ArrayLike) -> F64:
    """(..., 2): central differences of three rows or columns, weighted 1 2 1."""
    return _of_texels(heights, uv, "sobel")


def slope_scharr(heights: npt.ArrayLike, uv: npt.ArrayLike) -> F64:
    """(..., 2): central differences of three rows or columns, weighted 3 10 3."""
    return _of_texels(heights, uv, "scharr")


def _spline(x: F64, degree: int) -> F64:
    """The centred uniform B-spline: its sum of truncated powers (Schoenberg 1946)."""
    n, half = degree + 1, (degree + 1) / 2
    powers = ((-1) ** j * comb(n, j) * np.maximum(x + half - j, 0.0) ** degree for j in range(n + 1))
    return np.sum(list(powers), axis=0) / np.prod(np.arange(1, degree + 1))


def cubic_weights(t: npt.ArrayLike) -> F64:
    """(..., 4): the cubic B-spline at t + 1, t, t - 1, t - 2."""
    return _spline(np.asarray(t, np.float64)[..., None] - np.arange(-1, 3), 3)


def quadratic_weights(t: npt.ArrayLike) -> F64:
    """(..., 3): the quadratic B-spline at t + 1/2, t - 1/2, t - 3/2."""
    return _spline(np.asarray(t, np.float64)[..., None] - np.arange(-0.5, 2), 2)


def slope_bspline(coefficients: npt.ArrayLike, uv: npt.ArrayLike) -> F64:
    """(..., 2): the gradient of sum c_ij B(x - i) B(y - j), with B the cubic B-spline and B'(x) the difference of the
    quadratic one half a texel to either side."""
    about, value, rate = _about(coefficients, uv)
    return np.stack(
        [np.einsum("...j,...ji,...i->...", v, about, u) for u, v in ((rate[0], value[1]), (value[0], rate[1]))], axis=-1
    )


def height_bspline(coefficients: npt.ArrayLike, uv: npt.ArrayLike) -> F64:
    """(...): sum c_ij B(x - i) B(y - j)."""
    about, value, _ = _about(coefficients, uv)
    return np.einsum("...j,...ji,...i->...", value[1], about, value[0])


def _about(coefficients: npt.ArrayLike, uv: npt.ArrayLike) -> tuple[F64, list[F64], list[F64]]:
    """The coefficients (..., 4, 4) about places, and weights (..., 4) of values and of slopes, along u and v."""
    c, place = np.asarray(coefficients, np.float64), np.asarray(uv, np.float64)
    index, value, rate = [], [], []
    for axis, count in ((0, c.shape[1]), (1, c.shape[0])):
        x = place[..., axis, None] * count - 0.5
        near = np.floor(x) + np.arange(-1, 3)
        index.append(np.mod(near, count).astype(np.intp))
        value.append(_spline(x - near, 3))
        rate.append(count * (_spline(x - near + 0.5, 2) - _spline(x - near - 0.5, 2)))
    return c[index[1][..., :, None], index[0][..., None, :]], value, rate
