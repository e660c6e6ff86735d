"""Hypothesis strategies for rows of GLSL arguments; a failure shrinks to one row, and that to simple numbers."""

from __future__ import annotations

from typing import Any

import numpy as np
from hypothesis import strategies as st
from hypothesis.strategies import SearchStrategy

LARGEST = float(np.finfo(np.float32).max)


def floats(low: float = -LARGEST, high: float = LARGEST, *, denormals: bool = True) -> SearchStrategy[float]:
    """Finite float32 values; denormals=False leaves out those that drivers may flush to zero."""
    return st.floats(
        float(np.float32(low)), float(np.float32(high)), width=32, allow_nan=False, allow_subnormal=denormals
    )


def vectors(size: int, low: float = -LARGEST, high: float = LARGEST) -> SearchStrategy[Any]:
    """One vector of `size` floats."""
    return st.lists(floats(low, high), min_size=size, max_size=size).map(lambda v: np.array(v, np.float32))


def unit_vectors() -> SearchStrategy[Any]:
    """One direction: integers over their length, so that it shrinks towards an axis."""
    grid = st.tuples(*[st.integers(-1000, 1000)] * 3).filter(any)
    return grid.map(lambda v: (np.array(v, np.float64) / np.linalg.norm(v)).astype(np.float32))


def rows(*elements: SearchStrategy[Any], most: int = 32) -> SearchStrategy[tuple[Any, ...]]:
    """One array for each element strategy, with as many rows in each; shrinks to the one row that fails."""
    drawn = st.lists(st.tuples(*elements), min_size=1, max_size=most)
    return drawn.map(lambda many: tuple(np.array(column, np.float32) for column in zip(*many, strict=True)))
