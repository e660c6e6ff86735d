"""The extremes of single formulas (NUMERICS, section 5): the naive form misses the bound, glbump's keeps it."""

from __future__ import annotations

import pytest

from glbump.glsltest import Glsl
from glbump.glsltest.stability import EXTREMES, Extreme, Measured, measure_one, table


@pytest.mark.parametrize("extreme", EXTREMES, ids=lambda e: e.name.replace(" ", "-"))
def test_extreme(extreme: Extreme, glsl: Glsl) -> None:
    found = measure_one(glsl, extreme)
    assert found.used <= extreme.bound
    if extreme.fails:
        assert found.naive > extreme.bound, "the naive form holds: this extreme is none"


def test_the_table_says_what_is_broken() -> None:
    good, bad = (Measured(EXTREMES[1], 1.0, used) for used in (1e-8, 1.0))
    rows = table([good, bad])
    assert rows[0] == ("extreme", "naive", "glbump", "bound", "")
    assert [row[4] for row in rows[1:]] == ["holds", "BROKEN"]
    assert rows[1][:4] == ("normalise 1e-37 to 1e37", "1", "1e-08", "3.6e-07 of unit length")
