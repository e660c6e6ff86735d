"""The comparison that all shader tests rest on: it passes what it should, and fails what it should."""

from __future__ import annotations

import numpy as np
import pytest

from glbump.glsltest import Glsl, inputs, ulp

ONE = np.float32(1)


def test_distance_is_counted_at_the_wanted_value() -> None:
    assert ulp.distance(np.nextafter(ONE, ONE * 2), 1.0) == 1
    assert ulp.distance(np.float32(1), 1.0 + 2.0**-24) == 0.5
    assert ulp.distance(np.nextafter(np.float32(2), np.float32(0)), 2.0) == 0.5  # half a unit of 2, a whole one below
    assert ulp.distance(np.float32(0), 2.0**-149) == 1
    assert ulp.distance(np.float64(1) + 2.0**-52, 1.0) == 1
    assert ulp.distance(np.float16(1) + np.float16(2**-10), 1.0) == 1


def test_bounds_are_alternatives() -> None:
    got = np.array([1.0 + 2.0**-22], np.float32)
    ulp.assert_close(got, 1.0, ulps=2)
    ulp.assert_close(got, 1.0, abs=2.0**-22)
    ulp.assert_close(got, 1.0, rel=2.0**-22)
    ulp.assert_close(got, 1.0, ulps=2, abs=1e-12, rel=1e-12)
    for bounds in ({"ulps": 1.9}, {"abs": 2.3e-7}, {"rel": 2.3e-7}, {}):
        with pytest.raises(AssertionError, match="1 of 1 rows differ"):
            ulp.assert_close(got, 1.0, **bounds)


@pytest.mark.parametrize(
    ("got", "want", "fine"),
    [
        (np.nan, np.nan, True),
        (np.nan, 1.0, False),
        (1.0, np.nan, False),
        (np.inf, np.inf, True),
        (-np.inf, np.inf, False),
        (np.inf, 3e38, False),
        (3e38, np.inf, False),
        (np.inf, 1e39, True),  # what float32 cannot hold is infinite
        (3e38, 1e39, False),
        (0.0, -0.0, True),
        (np.nan, np.inf, False),
    ],
)
def test_nan_and_infinities_on_purpose(got: float, want: float, fine: bool) -> None:
    value = np.array([got], np.float32)
    if fine:
        ulp.assert_close(value, want, ulps=1e9, abs=1e9)
        return
    with pytest.raises(AssertionError):
        ulp.assert_close(value, want, ulps=1e9, abs=1e9)


def test_intervals() -> None:
    got = np.array([1.0, 2.0, np.inf], np.float32)
    ulp.assert_close(got, ulp.Interval([0.0, 2.0, 5.0], [1.0, 3.0, np.inf]))
    ulp.assert_close(got, ulp.Interval([1.0 + 2.0**-24, 0, 0], [2.0, 3.0, np.inf]), ulps=1)
    with pytest.raises(AssertionError, match=r"(?s)1 of 3 rows.*worst: row 1\n.*from +2\.5 .*\n +to +3\.0"):
        ulp.assert_close(got, ulp.Interval([0.0, 2.5, 5.0], [1.0, 3.0, np.inf]), abs=0.4)


def test_where_takes_rows_and_elements() -> None:
    got, want = np.array([[1.0, 2.0], [3.0, 4.0]], np.float32), np.array([[1.0, 9.0], [9.0, 9.0]])
    ulp.assert_close(got, want, where=[[True, False], [False, False]])
    with pytest.raises(AssertionError, match=r"1 of 1 rows differ by more than nothing\nworst: row 0, element 1"):
        ulp.assert_close(got, want, where=[True, False])


def test_a_bound_for_each_row() -> None:
    got, want = np.array([[1.0, 2.0], [3.0, 4.0]], np.float32), np.array([[1.5, 2.0], [3.0, 4.5]])
    ulp.assert_close(got, want, abs=[0.5, 0.5])
    with pytest.raises(AssertionError, match=r"1 of 2 rows differ by more than 0\.25 absolute there\nworst: row 1"):
        ulp.assert_close(got, want, abs=[0.5, 0.25])


def test_nothing_to_compare_is_a_failure() -> None:
    with pytest.raises(AssertionError, match="nothing to compare: no elements"):
        ulp.assert_close(np.zeros((0, 3), np.float32), 0.0)
    with pytest.raises(AssertionError, match="nothing to compare: where= leaves none"):
        ulp.assert_close(np.zeros(3, np.float32), 0.0, where=False)


def test_shapes_and_parts() -> None:
    with pytest.raises(AssertionError, match=r"shapes differ: got \(3,\), want \(2, 3\)"):
        ulp.assert_close(np.zeros(3, np.float32), np.zeros((2, 3)))
    with pytest.raises(AssertionError, match=r"\[1\]\.a: 1 of 1 rows"):
        ulp.assert_close((ONE, {"a": ONE * 2}), (1.0, {"a": 1.0}))
    with pytest.raises(AssertionError, match="got is 2 values; want is a float"):
        ulp.assert_close((ONE, ONE), 1.0)
    ulp.assert_close(np.array([True, False]), [True, False])
    with pytest.raises(AssertionError):
        ulp.assert_close(np.array([3, 4]), [3, 5])


def test_a_failure_shows_the_worst_row_with_its_inputs_and_bits(glsl: Glsl) -> None:
    f = glsl("float f(vec2 a, float b) { return a.x * a.y + b; }").f
    a = inputs.uniform(100, shape=(2,))
    want = a.astype(np.float64).prod(-1) + 1.0
    want[40] += 1e-3
    want[41] += 2e-3
    with pytest.raises(AssertionError) as caught:
        ulp.assert_close(f(a, 1.0), want, ulps=2)
    lines = str(caught.value).splitlines()
    assert lines[0] == "f: 2 of 100 rows differ by more than 2 ULP"
    assert lines[1] == "worst: row 41"
    got = f(a, 1.0)[41]
    assert lines[2].split() == ["got", str(got), ulp.bits(got)]
    assert lines[3].split() == ["want", repr(float(want[41])), ulp.bits(np.float32(want[41]))]
    assert "0.002" in lines[4]
    assert "ULP" in lines[4]
    assert lines[5].endswith(ulp.bits(a[41]))
    assert lines[5].strip().startswith("a = [")
    assert lines[6].strip() == "b = 1.   0x3f800000"


def test_inputs_of_structs_and_of_parts_of_results(glsl: Glsl) -> None:
    text = "struct P { float x; vec2 y; }; void f(P p, out float a, out vec2 b) { a = p.x; b = p.y; }"
    a, b = glsl(text).f({"x": [1.0, 2.0], "y": (3.0, 4.0)})
    ulp.assert_close(a, [1.0, 2.0])
    with pytest.raises(AssertionError, match=r"(?s)worst: row 1, element 0.*p\.x = 2.*p\.y = \[3\., 4\.\]"):
        ulp.assert_close(b, [[3.0, 4.0], [0.0, 4.0]])
