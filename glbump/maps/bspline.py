"""The cubic B-spline through samples: its coefficients.

Unser, Aldroubi and Eden, "B-spline signal processing" I and II, IEEE Trans. Signal Processing 41(2), 1993.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

F64 = npt.NDArray[np.float64]

BORDERS = {"wrap": "wrap", "clamp": "edge", "mirror": "symmetric"}
"""How a map goes on past its border, as OpenGL's repeat, clamp to edge and mirrored repeat -> np.pad's words."""

POLE = np.sqrt(3.0) - 2.0
"""Of the inverse of (1 4 1) / 6: each step along it leaves 0.268 of what a border did."""
REACH = 28
"""Steps after which POLE to their power is below half a unit in the last place of a float64."""


def continued(values: F64, axis: int, count: int, border: str) -> F64:
    """(H, W) with `count` more texels at either end of `axis`."""
    widths = [(0, 0), (0, 0)]
    widths[axis] = (count, count)
    return np.pad(values, widths, mode=BORDERS[border])  # type: ignore[call-overload]


def coefficients(height: npt.ArrayLike, border: str = "wrap") -> F64:
    """(H, W) samples -> (H, W) coefficients of the cubic B-spline through them: (1 4 1) / 6 both ways gives them back.

    border: a key of BORDERS, and how the coefficients go on past the border, so that the spline meets the samples
    there too. What shaders/lib/gradients.glsl slope_bspline reads. Heights of 8 bits gain nothing: the inverse
    amplifies their steps, up to three times along each axis.
    """
    return prefiltered(prefiltered(np.asarray(height, np.float64), 0, border), 1, border)


def prefiltered(values: F64, axis: int, border: str) -> F64:
    """The exact inverse of (1 4 1) / 6 along `axis`.

    Two recursions, forth and back, each begun so far outside that its beginning is forgotten. Clamped coefficients
    are those of mirrored samples: both repeat the coefficient at the border once, and the filter reads no farther.
    """
    # Less one sample: what is constant along the axis stays so to the last bit.
    first = values.take([0], axis)
    padded = continued(values - first, axis, REACH, "mirror" if border == "clamp" else border)
    c = np.moveaxis(padded, axis, 0)
    for i in range(1, len(c)):
        c[i] += POLE * c[i - 1]
    for i in range(len(c) - 2, -1, -1):
        c[i] = POLE * (c[i + 1] - c[i])
    return np.moveaxis(6 * c[REACH:-REACH], 0, axis) + first
