"""Elliptical weighted averages of an environment: the truth that look-ups by level and along axes are near to."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from glbump.maps.layout import LATLONG, texel_dirs
from glbump.reference.filter import footprint_axes

F64 = npt.NDArray[np.float64]


def elliptical_average(texels: npt.ArrayLike, dir_env: npt.ArrayLike, ddx: npt.ArrayLike, ddy: npt.ArrayLike) -> F64:
    """(K, C) means of a lat-long picture's texels (H, W, C) round unit directions (K, 3), over footprints with
    the sides ddx, ddy (K, 3), at least a texel wide.

    Each texel weighs by its solid angle and by a Gaussian over the footprint (Heckbert, "Fundamentals of Texture
    Mapping and Image Warping", 1989), whose variances are those of the parallelogram: a twelfth of its axes' squares.
    Every texel is looked at: seconds for a thousand directions.
    """
    values = np.asarray(texels, np.float64)
    height, width = values.shape[:2]
    texel_dir = texel_dirs(LATLONG, (width, height))[0].reshape(-1, 3)
    solid_angle = np.hypot(texel_dir[:, 0], texel_dir[:, 2])
    result = np.zeros((len(np.asarray(dir_env)), values.shape[2]))
    least = 2 * np.pi / width
    for i, (d, *axes) in enumerate(zip(np.asarray(dir_env, np.float64), *footprint_axes(ddx, ddy), strict=True)):
        square = np.zeros(len(texel_dir))
        for axis in axes:
            length = np.linalg.norm(axis)
            along = (texel_dir - d) @ (axis / max(length, 1e-30))
            square += (along / max(length, least)) ** 2
        weight = np.where(texel_dir @ d > 0, np.exp(-6 * square), 0.0) * solid_angle
        result[i] = weight @ values.reshape(len(texel_dir), -1) / weight.sum()
    return result
