"""docs/notebook.ipynb: its cells run one after the other, and what ends them shows itself."""

from __future__ import annotations

import ast
import json
from pathlib import Path
from typing import Any

import pytest

from glbump.frame import Frame

NOTEBOOK = Path(__file__).parents[2] / "docs" / "notebook.ipynb"


def run(source: str, names: dict[str, Any]) -> Any:
    """A cell, as a notebook runs it: the value of its last line where that is an expression."""
    tree = ast.parse(source)
    last = tree.body.pop() if tree.body and isinstance(tree.body[-1], ast.Expr) else None
    exec(compile(tree, str(NOTEBOOK), "exec"), names)
    return None if last is None else eval(compile(ast.Expression(last.value), str(NOTEBOOK), "eval"), names)


def test_the_notebook_runs(capsys: pytest.CaptureFixture[str]) -> None:
    content = json.loads(NOTEBOOK.read_text())
    assert content["nbformat"] == 4
    names: dict[str, Any] = {}
    shown = [run("".join(c["source"]), names) for c in content["cells"] if c["cell_type"] == "code"]
    frames = [value for value in shown if isinstance(value, Frame)]
    assert len(frames) == 3
    for frame in frames:
        png = frame._repr_png_()
        assert png is not None
        assert png.startswith(b"\x89PNG")
    assert "frame format" in capsys.readouterr().out
    assert names["errors"]["exact"] < names["errors"]["fast"], "the page says which is nearer"


def test_no_results_are_kept_in_it() -> None:
    """They would be of another version, and of another machine."""
    cells = json.loads(NOTEBOOK.read_text())["cells"]
    assert all(not c["outputs"] and c["execution_count"] is None for c in cells if c["cell_type"] == "code")
