"""Height fields and normal maps as slopes: what the surface gradient needs, and what may be averaged."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from glbump.errors import ImageError

F32 = npt.NDArray[np.float32]

STEEPEST = 128.0
"""Steepest slope of a normal map, 89.55 degrees (the bound of Mikkelsen's surface gradient framework)."""


HIGHEST = 1e30
"""Most that a height may differ from 0, so that slopes of any picture stay 32-bit floats."""


def slopes(height: npt.NDArray[Any]) -> F32:
    """(H, W) heights -> (H, W, 2) float32: d height / du and d height / dv at the texel centres.

    u runs right and v UP, 0..1 over the picture, whose row 0 is on top. Central differences, wrapping as maps on
    surfaces do, in float64. Along an axis of one or two texels every difference is 0. Gain of a wave of p texels:
    sin(2 pi / p) / (2 pi / p), so 0.97 at 16 and 0.90 at 8. ImageError for heights past HIGHEST, or not finite.
    """
    h = np.asarray(height, np.float64)
    largest = max(float(h.max()), -float(h.min()))
    if not largest <= HIGHEST:
        raise ImageError(f"heights must lie within -{HIGHEST:g} and {HIGHEST:g}; got {largest:g}; scale the picture")
    rows, columns = h.shape
    along_u = (np.roll(h, -1, axis=1) - np.roll(h, 1, axis=1)) * (columns / 2)
    along_v = (np.roll(h, 1, axis=0) - np.roll(h, -1, axis=0)) * (rows / 2)
    return np.stack([along_u, along_v], axis=-1).astype(np.float32)


def slopes_of_normals(normals: npt.NDArray[Any], flip_y: bool = False) -> F32:
    """(H, W, 3) tangent-space normals, any length -> (H, W, 2) float32 slopes (-x / z, -y / z).

    flip_y: the map's +Y points down, as in DirectX. Slopes are per unit of length along the tangents, and stay
    in the rows the normals were in. A normal that is not finite, points into the surface (z <= 0) or is steeper
    than STEEPEST has no slope: ImageError with how many there are and where the first is.
    """
    n = np.asarray(normals, np.float64)
    x, y, z = n[..., 0], n[..., 1], n[..., 2]
    finite = np.isfinite(n).all(axis=-1)
    # NaN compares false, so what is not finite is bad by itself.
    bad = ~(finite & (z > 0) & (np.maximum(np.abs(x), np.abs(y)) <= STEEPEST * z))
    if bad.any():
        row, column = np.argwhere(bad)[0]
        raise ImageError(
            f"a normal map must point out of the surface, its slopes at most {STEEPEST:g} (89.55 degrees); "
            f"{bad.sum()} of {bad.size} normals do not, the first in row {row}, column {column}: "
            f"({x[row, column]:g}, {y[row, column]:g}, {z[row, column]:g}); mend the map, or give heights"
        )
    return np.stack([-x / z, (y if flip_y else -y) / z], axis=-1).astype(np.float32)
