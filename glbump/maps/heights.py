"""Height fields and normal maps as slopes: what the surface gradient needs, and what may be averaged."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from glbump.errors import ImageError
from glbump.maps.gradients import derivative
from glbump.maps.stored import count_and_first

F32 = npt.NDArray[np.float32]

STEEPEST = 128.0
"""Steepest slope of a normal map, 89.55 degrees (the bound of Mikkelsen's surface gradient framework)."""


HIGHEST = float(np.float32(1e30))
"""Most that a height may differ from 0, 1e30 in 32 bits, so that slopes of any picture stay 32-bit floats."""


def slopes(height: npt.NDArray[Any], kernel: str = "central", border: str = "wrap") -> F32:
    """(H, W) heights -> (H, W, 2) float32: d height / du and d height / dv at the texel centres.

    u runs right and v UP, 0..1 over the picture, whose row 0 is on top. In float64.

    kernel: one of `gradients.METHODS`. Along an axis of one texel every difference is 0, and so is that of two
    which wrap, but forward. Gain of a wave of p texels by "central" differences: sin(2 pi / p) / (2 pi / p), so 0.97
    at 16 and 0.90 at 8; for the others `python -m benchmarks kernels`. "bspline" and "spectral" bring out what is
    between the texels, rounding to 8 bits too: they are for heights of 16 bits or more.
    border: "wrap", as maps on surfaces do, "clamp" or "mirror"; "spectral" wraps only.

    ImageError for heights that are not (H, W), not finite or past HIGHEST, and for unknown names.
    """
    h = _checked(height)[::-1]
    along_u = derivative(h, 1, kernel, border) * h.shape[1]
    along_v = derivative(h, 0, kernel, border) * h.shape[0]
    return np.stack([along_u, along_v], axis=-1).astype(np.float32)[::-1]


def _checked(height: npt.NDArray[Any]) -> npt.NDArray[np.float64]:
    h = np.asarray(height, np.float64)
    if h.ndim != 2 or h.size == 0:
        raise ImageError(f"heights are an array (height, width), at least (1, 1); got {h.shape}; take one channel")
    # NaN compares false, so what is not finite is bad by itself.
    if max(float(h.max()), -float(h.min())) <= HIGHEST:
        return h
    bad = ~(np.abs(h) <= HIGHEST)
    raise ImageError(
        f"heights must lie within -{HIGHEST:g} and {HIGHEST:g}; {count_and_first(bad)} do not, "
        f"that one {h[bad][0]:g}; repair or scale the picture"
    )


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
