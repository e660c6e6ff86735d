"""Signatures, structs and bodies as GLSL has them, and the preprocessor's choice of lines."""

from __future__ import annotations

from pathlib import Path

import pytest

from glbump.errors import ShaderError
from glbump.gl.source import find_shaders, resolve
from glbump.glsltest.declarations import declarations
from glbump.glsltest.grammar import evaluate, parse_expression
from glbump.glsltest.preprocess import active


@pytest.mark.parametrize(
    ("text", "signature"),
    [
        ("highp float f(void) { return 1.0; }", "float f()"),
        ("float[3] f(in vec2[2] a[3], const in lowp int b) { }", "float[3] f(vec2[3][2] a, int b)"),
        ("void f(out mat3x2 m, inout Hit h, vec3) { }", "void f(out mat3x2 m, inout Hit h, vec3)"),
        ("const int N = 3; void f(float a[N * 2 - 1]) { }", "void f(float[5] a)"),
        ("#define T vec3\nT f(T a) { return a; }", "vec3 f(vec3 a)"),
        ("#define S(x) x\n#define P(x) sampler2D x\nfloat f(float g(float)) {} float f(int a) { }", "float f(int a)"),
        ("float f(float a); float f(float a) { if (a > 0.) { return 1.; } return 2.; }", "float f(float a)"),
        ("precise invariant float f() { }", "float f()"),
    ],
)
def test_signatures(text: str, signature: str) -> None:
    found = declarations("struct Hit { float t; };\n" + text)
    assert str(found.functions[-1]) == signature


def test_structs_and_globals() -> None:
    found = declarations(
        "struct A { float x, y[2]; }; struct B { A a[2]; mat2 m; } b; layout(std140) uniform U { vec4 c; } u;"
        "const float E = 2.7, F = E * 2.0; uniform vec3 v; float g; layout(location = 1) out vec4 o;"
    )
    assert str(found.structs["B"].fields[0][1]) == "A[2]"
    assert found.structs["B"].fields[0][1].fields[1][1].dims == (2,)
    assert set(found.variables) >= {"E", "F", "v", "g", "o"}
    assert found.skipped == []


def test_what_is_not_understood_is_skipped_and_said() -> None:
    found = declarations("float f() { return 1.0; }\nwhat ever (3];\nfloat g() { return 2.0; }\n")
    assert [f.name for f in found.functions] == ["f", "g"]
    assert found.skipped[0].startswith("line 2: ")


def test_lines_the_preprocessor_takes() -> None:
    text = """#define A 3
#if A > 2 && !defined(B) || (A == 1 ? 0 : 1) == 7
yes1
#  ifdef C
no1
#  else
yes2
#  endif
#elif 1
no2
#else
no3
#endif
#undef A
#ifndef A // comment
yes3 /* no4
no5 */
#endif
#if (1 << 2) + 0x10 % 7 == 6 - -1 * 0
yes4
#endif
#define LONG \\
   no6
"""
    found = active(text)
    assert found.text.split() == ["yes1", "yes2", "yes3", "yes4"]
    assert len(found.text) == len(text)
    assert found.macros["LONG"].body == "no6"
    assert found.branches == [(2, True), (4, False), (6, True), (9, False), (11, False), (15, True), (19, True)]


def test_a_condition_that_is_none_names_its_line() -> None:
    with pytest.raises(ShaderError, match=r"line 2: cannot evaluate #if 3 \+"):
        active("\n#if 3 +\n#endif\n")


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1 + 2 * 3 - 4", 3),
        ("7 / 2 % 2", 1),
        ("-7 / 2", -3),
        ("-7 % 2", -1),
        ("1 << 3 | 5 & 4 ^ 1", 13),
        ("2 > 1 ? 10 : 20", 10),
    ],
)
def test_constant_expressions(text: str, value: int) -> None:
    """-7 / 2 is -3 in GLSL and -4 in Python."""
    assert evaluate(parse_expression(text), lambda _: 0) == value


def test_every_body_of_our_shaders_parses() -> None:
    names = sorted(p.relative_to(find_shaders()) for p in find_shaders().rglob("*.*"))
    assert len(names) > 5
    for name in names:
        found = declarations(resolve(Path(name)).text)
        assert found.skipped == [], name
        for f in found.functions:
            assert found.body(f).kind == "block"


def test_bodies_keep_their_offsets() -> None:
    text = """int f(int n) {
        for (int i = 0; i < n; i++) n += i > 2 ? 1 : 2;
        do { n--; } while (n > 3);
        switch (n) { case 1: break; default: n = 2; }
        float a[2] = float[2](1., 2.), b;
        { return n; }
    }"""
    found = declarations(text)
    kinds = {node.kind: text[node.start : node.end] for node in found.body(found.functions[0]).walk()}
    assert kinds["ternary"] == "i > 2 ? 1 : 2"
    assert kinds["do"] == "do { n--; } while (n > 3);"
    assert kinds["declaration"] == "float a[2] = float[2](1., 2.), b;"
    assert kinds["case"] == "default:"
