"""The table of `glbump doctor --stability`: its rows of whole pictures, its text, and the page that carries it."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from glbump.cli import run
from glbump.gl.renderer import Renderer
from glbump.gl.stability import PICTURES, Row, stability_text
from glbump.glsltest.stability import EXTREMES

PAGE = Path(__file__).parents[2] / "docs" / "extremes.md"
NAMES = [e.name for e in EXTREMES] + [name for name, *_ in PICTURES]
BOUNDS = [f"{e.bound:.2g} {e.unit}" for e in EXTREMES] + [f"{bound:.2g} {unit}" for _, _, bound, unit in PICTURES]


@pytest.mark.parametrize("number", range(len(PICTURES)), ids=[name.replace(" ", "-") for name, *_ in PICTURES])
def test_the_naive_form_breaks_the_bound_and_ours_keeps_it(renderer: Renderer, number: int) -> None:
    name, measure, bound, _ = PICTURES[number]
    naive, used = measure(renderer)
    assert used <= bound
    if name != "levels of 7 texels" or "llvmpipe" in renderer.context.info["renderer"]:  # a driver may do it right
        assert naive > bound, "the naive form holds: this extreme is none"


def test_the_text_says_what_is_broken() -> None:
    good, bad = Row("a", 1.0, 1e-8, 1e-6, "of light"), Row("bb", float("inf"), 0.5, 1e-6, "of light")
    assert stability_text([good, bad]).splitlines() == [
        "extreme  naive  glbump  bound",
        "a        1      1e-08   1e-06 of light  holds",
        "bb       inf    0.5     1e-06 of light  BROKEN",
    ]


def test_doctor_measures_every_row(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["doctor", "--stability", "--json"]) == 0
    rows = json.loads(capsys.readouterr().out)
    assert [row["name"] for row in rows] == NAMES
    assert all(row["holds"] and row["glbump"] <= row["bound"] for row in rows)


def test_doctor_fails_where_a_row_is_broken(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    broken = Row("bb", float("inf"), 0.5, 1e-6, "of light")
    monkeypatch.setattr("glbump.gl.stability.stability_report", lambda context: [broken])
    monkeypatch.setattr("glbump.glsltest.stability.report", lambda context: [])
    assert run(["doctor", "--stability"]) == 1
    assert capsys.readouterr().out.splitlines()[1] == "bb       inf    0.5     1e-06 of light  BROKEN"
    assert run(["doctor", "--stability", "--json"]) == 1
    assert json.loads(capsys.readouterr().out)[0]["naive"] is None


def test_the_page_has_every_row_with_its_bound() -> None:
    """docs/extremes.md: extreme | naive form and how it fails | glbump's form | bound | measured."""
    table = [[cell.strip() for cell in line.strip("|").split("|")] for line in PAGE.read_text().splitlines()]
    rows = {cells[0]: cells for cells in table if len(cells) == 5 and not set(cells[0]) <= {"-", ""}}
    assert [name for name in rows if name in NAMES] == NAMES
    for name, wanted in zip(NAMES, BOUNDS):
        _, naive, form, bound, measured = rows[name]
        assert naive
        assert form
        assert bound == wanted
        assert float(measured) <= float(re.split(" ", bound)[0])
