"""The plugin as its users run it: pytest in a process of its own, on files like theirs."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from glbump.gl.source import find_shaders

REFLECT = """
import numpy as np
from glbump.glsltest import inputs

def test_reflect(glsl, ulp):
    f = glsl("{file}").reflect_dir
    d, n = inputs.unit_vectors(1000), inputs.unit_vectors(1000, seed=1)
    along = np.einsum("ni,ni->n", d.astype(float), n)[:, None] * n
    ulp.assert_close(f(d, n), d - 2 * along, ulps=4, abs=2**-21)
"""


def run(folder: Path, text: str, *options: str, timeout: float = 120, **environment: str) -> tuple[int, str]:
    """Exit status and output of pytest on one file in `folder`; Hypothesis' plugin would cost two seconds a run."""
    (folder / "test_theirs.py").write_text(text)
    command = [
        sys.executable,
        "-m",
        "pytest",
        "-q",
        "-p",
        "no:cacheprovider",
        "-p",
        "no:hypothesispytest",
        *options,
        "test_theirs.py",
    ]
    made = subprocess.run(
        command, cwd=folder, env={**os.environ, **environment}, capture_output=True, text=True, timeout=timeout
    )
    return made.returncode, made.stdout + made.stderr


def test_a_test_passes_in_each_way_and_each_sees_a_broken_copy(tmp_path: Path) -> None:
    """The same test on our function, and on a copy with its sign turned: 3 passed, then 3 failed, each with its row."""
    good = find_shaders() / "lib" / "reflect.glsl"
    broken = tmp_path / "broken.glsl"
    broken.write_text(good.read_text().replace("dir - 2.0", "dir + 2.0"))
    text = REFLECT.format(file=good)
    other = REFLECT.format(file=broken).replace("test_reflect", "test_broken")
    status, said = run(tmp_path, text + other, "--glsl-backend=all")
    assert status == 1
    assert "3 failed, 3 passed" in said
    for way in ("compute", "feedback", "fragment"):
        assert f"FAILED test_theirs.py::test_broken[{way}]" in said
        assert f"test_reflect[{way}]" not in said
    # In the tracebacks; the summary repeats it where the variable CI is set.
    assert (
        len(re.findall(r"^E +AssertionError: reflect_dir: 1000 of 1000 rows differ by more than 4 ULP", said, re.M))
        == 3
    )
    assert "worst: row" in said
    assert "dir = [" in said


def test_one_way_keeps_the_names_of_tests(tmp_path: Path) -> None:
    text = 'def test_a(glsl):\n    assert glsl.backend == "feedback"\n'
    status, said = run(tmp_path, text, "--glsl-backend=feedback", "-rA")
    assert status == 0, said
    assert "PASSED test_theirs.py::test_a\n" in said


def test_what_a_test_leaves_behind_fails_it(tmp_path: Path) -> None:
    text = """
def test_leaks(glsl):
    glsl.context.gl.buffer(reserve=4)
    glsl.context.gl.texture((2, 2), 4)
def test_clean(glsl):
    glsl("float f(float x) { return x; }").f(1.0)
    glsl.context.gl.buffer(reserve=4).release()
"""
    status, said = run(tmp_path, text)
    assert status == 1
    assert "1 failed, 1 passed" in said
    assert "GL objects left behind: 1 texture, 1 buffer" in said


def test_no_driver_skips_with_the_reason_or_fails_when_required(tmp_path: Path) -> None:
    text = "def test_a(glsl):\n    pass\n"
    nowhere = {"GLBUMP_BACKEND": "window", "DISPLAY": "", "WAYLAND_DISPLAY": "", "XDG_RUNTIME_DIR": ""}
    status, said = run(tmp_path, text, "-rs", **nowhere)
    assert status == 0, said
    assert "1 skipped" in said
    assert "no OpenGL here: " in said
    status, said = run(tmp_path, text, "--glsl-required", **nowhere)
    assert status == 1
    assert "--glsl-required: " in said


def test_a_call_that_does_not_come_back_is_stopped(tmp_path: Path) -> None:
    """Two million rows of long loops: minutes. Stopped after a second, with the function and the test named."""
    text = """
import numpy as np
TEXT = "float slow(float x) { float s = x; for (int i = 0; i < 60000; ++i) s = sin(s + float(i)); return s; }"
def test_slow(glsl):
    glsl(TEXT).slow(np.zeros(2_000_000, np.float32))
"""
    status, said = run(tmp_path, text, "--glsl-timeout=1")
    assert status != 0
    assert "glsl: float slow(float x) of inline: still running after 1 s; stopped" in said
    assert "in test_slow" in said


@pytest.mark.parametrize("module", ["glbump.glsltest.plugin", "glbump.glsltest", "glbump"])
def test_importing_costs_nothing(module: str) -> None:
    """pytest loads the plugin in every run of every project that has glbump installed."""
    heavy = "{'numpy', 'moderngl', 'hypothesis', 'glcontext'}"
    text = f"import sys, {module}; print(sorted({{m.split('.')[0] for m in sys.modules}} & {heavy}))"
    told = subprocess.run([sys.executable, "-c", text], capture_output=True, text=True, check=True)
    assert told.stdout.strip() == "[]"


def test_collecting_opens_no_context(tmp_path: Path) -> None:
    text = "import sys\ndef test_a(glsl): pass\ndef test_modules():\n    assert 'moderngl' not in sys.modules\n"
    status, said = run(tmp_path, text, "-k", "modules")
    assert status == 0, said


def test_coverage_in_the_terminal_as_lcov_and_as_a_limit(tmp_path: Path) -> None:
    (tmp_path / "lib").mkdir()
    (tmp_path / "lib" / "a.glsl").write_text("float a(float x) { return x > 0.0 ? 1.0 : 2.0; }\n")
    (tmp_path / "lib" / "b.glsl").write_text("float b(float x) { return x; }\n")
    text = "def test_a(glsl):\n    assert glsl('lib/a.glsl').a(1.0) == 1\n"
    status, said = run(tmp_path, text, "--glsl-cov=lib", "--glsl-cov-lcov=out.lcov")
    assert status == 0, said
    assert "never ran: lib/a.glsl:1:43: ? false\n" in said
    assert "never ran: lib/b.glsl:1:1: function b\n" in said
    assert (tmp_path / "out.lcov").read_text().count("end_of_record") == 2
    status, said = run(tmp_path, text, "--glsl-cov=lib", "--glsl-cov-min=60")
    assert status == 1
    assert "50.0 % ran: less than --glsl-cov-min=60" in said
    status, said = run(tmp_path, text.replace("(1.0) == 1", "([1.0, -1.0])[1] == 2"), "--glsl-cov-min=100")
    assert status == 0, said
    status, said = run(tmp_path, text, "--glsl-cov=nowhere")
    assert status == 4
    assert "--glsl-cov: nowhere is no folder" in said


def test_hypothesis_and_the_fixture(tmp_path: Path) -> None:
    """The fixture lives as long as the session, so that Hypothesis has nothing against it; what fails is one row."""
    text = """
import numpy as np
from hypothesis import given, settings
from glbump.glsltest import strategies

@settings(max_examples=100, database=None)
@given(rows=strategies.rows(strategies.unit_vectors()))
def test_up(glsl, ulp, rows):
    f = glsl("float up(vec3 d) { return d.y > 0.5 ? d.y : d.y + step(0.25, d.x); }").up
    ulp.assert_close(f(rows[0]), rows[0][:, 1])
"""
    (tmp_path / "test_theirs.py").write_text(text)
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "test_theirs.py"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=120)
    assert done.returncode == 1
    assert "up: 1 of 1 rows differ by more than nothing" in done.stdout
    assert "FailedHealthCheck" not in done.stdout
