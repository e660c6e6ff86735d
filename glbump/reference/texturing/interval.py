"""Intervals of permitted values, and how many bits of what a driver owes."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

F64 = npt.NDArray[np.float64]


class Interval(NamedTuple):
    """All values from `low` to `high`, arrays of one shape, both included."""

    low: F64
    high: F64

    @property
    def middle(self) -> F64:
        """Half-way between the ends."""
        return self.low + 0.5 * (self.high - self.low)

    @property
    def reach(self) -> F64:
        """From the middle to either end."""
        return 0.5 * (self.high - self.low)

    def excess(self, value: npt.ArrayLike) -> F64:
        """How far `value` lies outside; 0 inside, infinite where it is NaN."""
        v = np.asarray(value, np.float64)
        outside = np.maximum(np.maximum(self.low - v, v - self.high), 0.0)
        result: F64 = np.where(np.isnan(v), np.inf, outside)
        return result

    def wider(self, by: npt.ArrayLike) -> Interval:
        """With `by` more on either side."""
        return Interval(self.low - np.asarray(by, np.float64), self.high + np.asarray(by, np.float64))


@dataclass(frozen=True)
class Precision:
    """Bits that a driver gets right; infinite where nothing is said.

    coordinate: of texture coordinates, relative to the coordinate (of cubes: to the face). subtexel: of a place between
    texels, so of the weights of bilinear filtering. derivative: of the coordinates' derivatives, relative. lod: of a
    level of detail, after the point (the accuracy of its logarithm). mip: of the weight between two levels.
    ideal_rho: whether the footprint is its longer side itself (rho of 8.14.1), or all that 8.14.1 allows in its place:
    from the larger to the sum of its extents along u and v. colour: largest error of the result.
    """

    coordinate: float = math.inf
    subtexel: float = math.inf
    derivative: float = math.inf
    lod: float = math.inf
    mip: float = math.inf
    ideal_rho: bool = False
    colour: float = 0.0


EXACT = Precision(ideal_rho=True)
"""Nothing is left open but ties: of the nearest texel on the edge of two, of the nearest level half-way."""

# VK-GL-CTS, modules/gles3/functional/es3fTextureFilteringTests.cpp: what passes, and what passes with a warning.
HIGH_2D = Precision(coordinate=20, subtexel=7, derivative=18, lod=6)
LOW_2D = Precision(coordinate=20, subtexel=4, derivative=18, lod=4)
HIGH_CUBE = Precision(coordinate=10, subtexel=6, derivative=10, lod=5)
LOW_CUBE = Precision(coordinate=10, subtexel=4, derivative=10, lod=4)
