"""The extremes of single formulas (NUMERICS, section 5): the naive form misses the bound, glbump's keeps it."""

from __future__ import annotations

import json

import pytest

from glbump.cli import run
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


def test_doctor_prints_it(capsys: pytest.CaptureFixture[str]) -> None:
    """The command on this driver: every case, none broken; the figures for machines."""
    assert run(["doctor", "--stability"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split("  ")[0] for line in lines] == ["extreme", *(e.name for e in EXTREMES)]
    assert all(line.endswith("holds") for line in lines[1:])
    assert run(["doctor", "--stability", "--json"]) == 0
    figures = json.loads(capsys.readouterr().out)
    assert {f["name"]: f["bound"] for f in figures} == {e.name: e.bound for e in EXTREMES}
