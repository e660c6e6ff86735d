"""Rows made to find bugs are what they say they are."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings

from glbump.glsltest import Glsl, inputs, strategies

# A few ULP: float64 normalised, then rounded to float32 component by component.
UNIT = 2.0**-23


def test_directions_are_unit_and_cover_the_sphere() -> None:
    made = inputs.directions(2000).astype(np.float64)
    assert np.abs(np.linalg.norm(made, axis=-1) - 1).max() < UNIT
    assert np.abs(inputs.unit_vectors(100_000).mean(axis=0)).max() < 5 / np.sqrt(3 * 100_000)  # 5 sigma
    assert len(inputs.axes()) == 6
    assert len(inputs.edges()) == 12
    assert len(inputs.corners()) == 8
    assert inputs.poles().tolist() == [[0, 1, 0], [0, -1, 0]]


def test_nudged_is_one_float_away() -> None:
    made = inputs.nudged([[1.0, 0.0]])
    assert made.shape == (4, 2)
    assert made[0, 0] == np.nextafter(np.float32(1), np.float32(0))
    assert made[3, 1] == np.float32(2.0**-149)


def test_floats_have_the_places_where_arithmetic_changes() -> None:
    made = inputs.floats()
    for x in (0.0, 1.0, 2.0**-149, 2.0**-126, np.finfo(np.float32).max, np.nextafter(np.float32(2), np.float32(0))):
        assert np.float32(x) in made
        assert np.float32(-x) in made
    assert np.signbit(made[made == 0]).tolist() in ([True, False], [False, True])
    assert np.isfinite(made).all()
    assert not np.isfinite(inputs.floats(nonfinite=True)[-3:]).any()
    assert inputs.floats(0, 1).max() == 1
    assert not np.isin(0.0, inputs.floats(0.5, 1))


def test_random_ones_come_from_a_seed() -> None:
    assert np.array_equal(inputs.uniform(10, seed=3), inputs.uniform(10, seed=3))
    assert not np.array_equal(inputs.uniform(10, seed=3), inputs.uniform(10, seed=4))
    octave = np.floor(np.log2(inputs.log_uniform(10_000, 2.0**-10, 2.0**10)))
    assert np.unique(octave, return_counts=True)[1].min() > 10_000 / 20 * 0.7


def test_every_combination() -> None:
    a, b = inputs.every([1, 2, 3], inputs.axes())
    assert a.shape == (18,)
    assert b.shape == (18, 3)
    assert len({(x, *y) for x, y in zip(a.tolist(), b.tolist(), strict=True)}) == 18


def test_a_failing_row_shrinks_to_the_smallest(glsl: Glsl) -> None:
    """A bug past 1000: Hypothesis must come down to one row, at the threshold."""
    f = glsl("float f(float x) { return x > 1000.0 ? -x : x; }").f
    seen: list[np.ndarray] = []

    @settings(max_examples=200, database=None, suppress_health_check=list(HealthCheck))
    @given(strategies.rows(strategies.floats(0, 1e6), most=8))
    def check(rows: tuple[np.ndarray]) -> None:
        got = f(rows[0])
        if not np.array_equal(got, rows[0]):
            seen.append(rows[0])
            raise AssertionError

    with pytest.raises(AssertionError):
        check()
    assert len(seen[-1]) == 1
    assert 1000 < seen[-1][0] <= 1001


@settings(max_examples=50, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(strategies.rows(strategies.unit_vectors(), strategies.vectors(2, -10, 10)))
def test_rows_have_one_array_for_each_strategy(rows: tuple[np.ndarray, np.ndarray]) -> None:
    unit, pair = rows
    assert unit.shape == (len(pair), 3)
    assert pair.shape[1:] == (2,)
    assert np.abs(np.linalg.norm(unit.astype(np.float64), axis=-1) - 1).max() < UNIT
