"""Seeded faults: made where they should be, killed by tests that look, named where they survive."""

from __future__ import annotations

from pathlib import Path

import pytest

from glbump.errors import ShaderError
from glbump.gl.source import resolve
from glbump.glsltest.mutants import Known, Mutant, Outcome, chosen, mutants_of, read_known

from .test_plugin import run

TEXT = """vec3 f(vec3 a, float b) {
    vec3 n = normalize(cross(a, a.zxy));
    if (b < 2.0) n = -n;
    for (int i = 0; i < 3; ++i) n += sin(b) * a;
    return b == 0.0 ? n : n - a / b;
}
"""


def changes(path: Path) -> set[str]:
    return {f"{m.old} -> {m.new}" for m in mutants_of(path)}


def test_the_slips_people_make(tmp_path: Path) -> None:
    file = tmp_path / "f.glsl"
    file.write_text(TEXT)
    assert changes(file) == {
        "normalize(cross(a, a.zxy)) -> (cross(a, a.zxy))",
        "a, a.zxy -> a.zxy, a",
        "zxy -> xyz",
        "(b < 2.0) -> (!(b < 2.0))",
        "< -> <=",
        "< -> >",
        "2.0 -> 2.2",
        "-n -> n",
        "0 -> 1",
        "3 -> 4",
        "+= -> -=",
        "* -> /",
        "sin -> cos",
        "== -> !=",
        "0.0 -> 0.1",
        "b == 0.0 ? n : n - a / b -> b == 0.0 ? (n - a / b) : (n)",
        "- -> +",
        "n - a / b -> (a / b) - (n)",
        "/ -> *",
        "a / b -> (b) / (a)",
    }


@pytest.mark.parametrize(
    ("number", "wrong"),
    [("2.5", "2.75"), ("1e-3f", "0.0011"), ("0.0", "0.1"), ("7", "8"), ("3u", "4u"), ("0x9e3779b1u", "2654435762u")],
)
def test_wrong_numbers(tmp_path: Path, number: str, wrong: str) -> None:
    (tmp_path / "f.glsl").write_text(f"float f() {{ return float({number}); }}\n")
    assert f"{number} -> {wrong}" in changes(tmp_path / "f.glsl")


def test_a_fault_goes_into_every_source_that_holds_its_place(tmp_path: Path) -> None:
    (tmp_path / "f.glsl").write_text(TEXT)
    (tmp_path / "top.glsl").write_text('\n#include "f.glsl"\n')
    fault = next(m for m in mutants_of(tmp_path / "f.glsl") if m.old == "sin")
    source = resolve(tmp_path / "top.glsl")
    faulty = fault.in_source(source)
    assert faulty.text == source.text.replace("sin", "cos")
    assert faulty.lines == source.lines
    other = resolve(text="float sin2() { return sin(2.0); }")
    assert fault.in_source(other) is other


def test_a_draw_is_repeatable(tmp_path: Path) -> None:
    (tmp_path / "f.glsl").write_text(TEXT)
    every = mutants_of(tmp_path / "f.glsl")
    assert chosen(every, 5, 1) == chosen(every, 5, 1)
    assert chosen(every, 5, 1) != chosen(every, 5, 2)
    assert chosen(every, None, 1) == every


def test_survivors_are_named_and_explained(tmp_path: Path) -> None:
    dead, alive, other = (Mutant("a.glsl", i, 1, "f", "1e-30", f"{i}.0") for i in (1, 2, 3))
    known = [Known("a.glsl", "f", "1e-30 -> 2.0", "a guard"), Known("a.glsl", "g", "x -> y", "gone")]
    lines = Outcome([dead], [alive, other], [], []).report(known)
    assert lines == [
        "1 of 3 seeded faults killed: 33.3 % (0 more did not compile)",
        "survived: a.glsl:2:1: f: 1e-30 -> 2.0 [a guard]",
        "survived: a.glsl:3:1: f: 1e-30 -> 3.0 [not explained]",
        "explained, but killed or gone: a.glsl: g: x -> y",
    ]
    assert Known("a.glsl", "f", "1e-30 -> *", "any").explains(other)
    (tmp_path / "k.toml").write_text('[[survivor]]\nfile = "a"\nfunction = "f"\nchanged = "x"\n')
    with pytest.raises(ShaderError, match=r"a \[\[survivor\]\] has file, function, change, reason"):
        read_known(tmp_path / "k.toml")


def test_a_run_kills_what_the_tests_see(tmp_path: Path) -> None:
    """A test of f that looks at one side of its branch only: what is on the other side survives."""
    (tmp_path / "f.glsl").write_text(
        "float f(float x) {\n    return x > 0.0 ? x + 1.0 : x - 5.0;\n}\nfloat g(float x) { return -x; }\n"
    )
    text = "def test_f(glsl):\n    assert glsl('f.glsl').f([1.0, 2.0]).tolist() == [2, 3]\n"
    status, said = run(tmp_path, text, "--glsl-mutants=f.glsl")
    assert status == 0, said
    survived = {line.split(": ", 2)[2] for line in said.splitlines() if line.startswith("survived: ")}
    assert survived == {
        "f: > -> >= [not explained]",
        "f: - -> + [not explained]",
        "f: x - 5.0 -> (5.0) - (x) [not explained]",
        "f: 5.0 -> 5.5 [not explained]",
        "f: 0.0 -> 0.1 [not explained]",
        "g: -x -> x [no test calls it]",
    }
    assert "4 of 10 seeded faults killed: 40.0 % (0 more did not compile)" in said
    status, said = run(tmp_path, text, "--glsl-mutants=f.glsl", "--glsl-mutants-min=95")
    assert status == 1
    status, said = run(tmp_path, text.replace("3]", "4]"), "--glsl-mutants=f.glsl")
    assert status == 1
    assert "no faults seeded: the tests fail as they are" in said


def test_a_fault_that_does_not_compile_counts_for_nothing(tmp_path: Path) -> None:
    (tmp_path / "f.glsl").write_text("float f(vec3 v) { return normalize(v.yzx).x; }\n")
    text = "def test_f(glsl):\n    assert abs(glsl('f.glsl').f((0.0, 2.0, 0.0)) - 1) < 1e-6\n"
    status, said = run(tmp_path, text, "--glsl-mutants=f.glsl", "--glsl-mutants-min=99")
    assert status == 0, said
    assert "3 of 3 seeded faults killed" in said
