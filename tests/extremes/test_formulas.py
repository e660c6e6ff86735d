"""The extremes of single formulas (NUMERICS, section 5): the naive form misses the bound, glbump's keeps it."""

from __future__ import annotations

import pytest

from glbump.glsltest import Glsl
from glbump.glsltest.stability import EXTREMES, Extreme, measure


@pytest.mark.parametrize("extreme", EXTREMES, ids=lambda e: e.name.replace(" ", "-"))
def test_extreme(extreme: Extreme, glsl: Glsl) -> None:
    found = measure(glsl, extreme)
    assert found.used <= extreme.bound
    if extreme.fails:
        assert found.naive > extreme.bound, "the naive form holds: this extreme is none"
