"""Coverage counts what ran, exactly, and changes no bit of what is computed."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from glbump.gl.context import Context
from glbump.gl.source import find_shaders
from glbump.glsltest import Glsl, inputs
from glbump.glsltest.coverage import Coverage
from glbump.glsltest.wrapper import BACKENDS

TEXT = """float f(float x) {
    float y = 0.0;
    if (x > 0.0) y += 1.0; else if (x < -1.0) { y += 2.0; }
    if (x > 2.0)
        if (x > 3.0) y += 4.0;
    y += x > 5.0 ? x > 6.0 ? 1.0 : 2.0 : 3.0;
    for (int i = 0; i < 3; ++i) { if (i == 1) continue; y += 1.0; }
    while (x > 100.0) x -= 100.0;
    do { x -= 1.0; } while (x > 50.0);
    switch (int(y)) { case 5: y = 50.0; break; default: y = 60.0; }
    const float k = 3.0;
    return y + (x > 0.0 && x < 1.0 ? k : 0.0);
}
float never(float x) { return x; }
#if defined(OTHER)
float other() { return 1.0; }
#else
float usual() { return 2.0; }
#endif
"""


@pytest.fixture
def covering(context: Context) -> Iterator[Glsl]:
    with Glsl(context) as made:
        made.coverage = Coverage()
        yield made


def what(coverage: Coverage) -> list[str]:
    return [f"{p.line}:{p.column} {p.what}" for p in coverage.missing()]


@pytest.mark.parametrize("backend", BACKENDS)
def test_what_one_row_leaves_out(covering: Glsl, backend: str) -> None:
    assert covering.coverage is not None
    covering.load(TEXT).f(4.0, backend=backend)
    assert what(covering.coverage) == [
        "3:33 if false",
        "3:33 if false, no else",
        "3:47 if true",
        "4:5 if false, no else",
        "5:9 if false, no else",
        "6:20 ? true",
        "6:30 ? true",
        "6:36 ? false",
        "8:23 while body",
        "10:23 case",
        "12:38 ? true",
        "14:1 function never",
        "15:1 branch #if defined(OTHER)",
        "18:1 function usual",
    ]


def test_more_rows_leave_out_less(covering: Glsl) -> None:
    """Rows of one call, and calls, add up."""
    seen = covering.coverage
    assert seen is not None
    module = covering.load(TEXT)
    module.f([4.0, -3.0, 250.0])
    left = set(what(seen))
    module.f([-0.5, 2.5, 5.5])
    module.never(1.0)
    module.f(inputs.uniform(200, -10, 10))
    covering.load(TEXT, defines={"OTHER": 1})
    assert set(what(seen)) == {"16:1 function other", "18:1 function usual"}
    assert len(left) > 5


def test_results_keep_their_bits(glsl: Glsl, covering: Glsl) -> None:
    """Every function of a library with branches, counted and not."""
    file = find_shaders() / "lib" / "bump.glsl"
    n, u, v = (inputs.directions(500, seed) for seed in (1, 2, 3))
    slope = inputs.uniform(len(n), -1, 1, (2,))
    for name, arguments in (("surface_gradient", (n, u, v, slope)), ("orthogonal_gradient", (u, v, slope))):
        plain = glsl(file)[name](*arguments, backend="feedback")
        counted = covering.load(file)[name](*arguments, backend="feedback")
        assert np.array_equal(plain.view(np.uint32), counted.view(np.uint32))
    x = inputs.uniform(2000, -200, 300)
    assert np.array_equal(glsl(TEXT).f(x), covering.load(TEXT).f(x))


def test_one_folder_and_the_files_no_test_loads(context: Context, tmp_path: Path) -> None:
    lib = tmp_path / "lib"
    lib.mkdir()
    (lib / "a.glsl").write_text("float a(float x) { return x > 0.0 ? 1.0 : 2.0; }\n")
    (lib / "b.glsl").write_text("float b(float x) { return x; }\n")
    (tmp_path / "top.glsl").write_text('#include "lib/a.glsl"\nfloat top(float x) { return a(x); }\n')
    with Glsl(context) as made:
        made.coverage = seen = Coverage(lib)
        made.load(tmp_path / "top.glsl").top(1.0)
        seen.see_folder()
    assert [f"{Path(p.file).name} {p.what}" for p in seen.missing()] == ["a.glsl ? false", "b.glsl function b"]
    assert seen.share == 0.5
    assert [line.split()[1:] for line in seen.table()[1:3]] == [["1/1", "1/2", "66.7", "%"], ["0/1", "0/0", "0.0", "%"]]
    assert seen.lcov().splitlines()[:8] == [
        "TN:",
        f"SF:{lib / 'a.glsl'}",
        "FN:1,a",
        "FNDA:1,a",
        "BRDA:1,0,0,1",
        "BRDA:1,0,1,0",
        "DA:1,1",
        "end_of_record",
    ]
