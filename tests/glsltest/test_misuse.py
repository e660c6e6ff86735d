"""Wrong calls, wrong GLSL: one error that says what, what it got, and what to do."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from glbump.errors import LimitError, ShaderError
from glbump.glsltest import Glsl, Sampler

TEXT = """
struct Ray { vec3 origin; vec3 dir; };
float speed(vec3 v) { return length(v); }
float depth(Ray r, sampler2D s) { return r.origin.z; }
int whole(int i) { return i; }
float four(float a[4]) { return a[0]; }
float row(vec2 a, vec2 b) { return dot(a, b); }
"""


@pytest.mark.parametrize(
    ("name", "arguments", "said"),
    [
        ("speed", [(1, 2)], r"^float speed\(vec3 v\): v wants shape \(\.\.\., 3\); got \(2,\)$"),
        ("speed", [], r"takes 1 arguments; got 0$"),
        ("speed", [["a"]], r"v is float; got an array of <U1$"),
        ("speed", [[[1, 2, 3], [1, 2]]], r"v is ragged"),
        ("speed", [np.array([1j, 2, 3])], r"v is float; got an array of complex128"),
        ("speed", [(1e300, 0, 0)], r"v: 1e\+300 is past the largest float"),
        ("whole", [1.5], r"i is int; got an array of float64"),
        ("whole", [2**40], r"i: 1099511627776 does not fit int"),
        ("whole", [True], r"i is int; got an array of bool"),
        ("four", [(1, 2, 3)], r"a wants shape \(\.\.\., 4\); got \(3,\)"),
        ("row", [np.zeros((3, 2)), np.zeros((4, 2))], r"rows do not broadcast together: \(3,\), \(4,\)"),
        ("depth", [{"origin": (1, 2, 3), "dirr": (1, 2, 3)}, np.zeros((2, 2))], r"no 'dir'; did you mean 'dirr'\?"),
        ("depth", [3, np.zeros((2, 2))], r"a struct is a dict or an object with \.origin; got int"),
    ],
)
def test_arguments_that_do_not_fit(glsl: Glsl, name: str, arguments: list[Any], said: str) -> None:
    with pytest.raises(ShaderError, match=said) as caught:
        glsl(TEXT)[name](*arguments)
    assert "\n" not in str(caught.value)


def test_a_function_that_is_not_there(glsl: Glsl) -> None:
    with pytest.raises(ShaderError, match=r"inline has no function 'sped'; did you mean float speed\(vec3 v\)\?"):
        _ = glsl(TEXT).sped
    with pytest.raises(ShaderError, match=r"has no function 'xyzzy'; it has speed, depth, whole, four, row"):
        _ = glsl(TEXT).xyzzy
    assert not hasattr(glsl(TEXT), "sped")


def test_a_source_that_is_no_glsl(glsl: Glsl) -> None:
    with pytest.raises(ShaderError, match=r"has no function 'f'; it has none \(not understood: line 2"):
        _ = glsl("Dear driver, {this} is a letter;").f
    with pytest.raises(ShaderError, match=r"not understood: line 2: '@' is no GLSL"):
        _ = glsl("@ float\n").f


def test_what_does_not_compile_names_its_line(glsl: Glsl, tmp_path: Any) -> None:
    (tmp_path / "bad.glsl").write_text("// one\nfloat good() { return 1.0; }\nfloat f(float x) {\n    return y;\n}\n")
    module = glsl(f'#include "{tmp_path}/bad.glsl"\n')
    with pytest.raises(ShaderError) as caught:
        module.f(1.0)
    first, *rest = str(caught.value).splitlines()
    assert first.split("/")[-1].startswith("bad.glsl:4: `y' undeclared (")
    assert rest[:3] == [
        "     2 | float good() { return 1.0; }",
        "     3 | float f(float x) {",
        ">    4 |     return y;",
    ]


def test_a_loop_without_end_is_stopped(glsl: Glsl) -> None:
    """Each kind of loop; the message names the row and the loop. A loop that ends is left alone."""
    text = """
    float a(float x) { while (x > 0.0) { x += 1.0; } return x; }
    float b(float x) { do x += 1.0; while (x > 0.0); return x; }
    float c(float x) { for (;;) { if (x <= 0.0) break; } return x; }
    float d(float x) { for (float i = 0.0; i < x; i += 0.0) {} return x; }
    float e(float x) { for (int i = 0; i < 100; ++i) { x += 1.0; } return x; }
    """
    for line, name in enumerate("abcd", 2):
        with pytest.raises(ShaderError, match=rf"row 1 of 3 did not end: the loop at inline:{line} took it past 50000"):
            glsl(text)[name]([-5.0, 5.0, -5.0])
        assert glsl(text)[name]([-5.0]) <= 1
    assert glsl(text).e(0.0) == 100.0
    # A limit below what the loop needs: the count is real.
    with pytest.raises(ShaderError, match="past 3 iterations"):
        glsl(text, loop_limit=3).a([-5.0, -2.5, 1.0])
    assert glsl("float f(float n) { float s = 0.0; while (s < n) s += 1.0; return s; }", loop_limit=101).f(100.0) == 100


def test_samplers_that_do_not_fit(glsl: Glsl) -> None:
    module = glsl(
        "float a(sampler2D s) { return 1.0; }  float b(samplerCube s) { return 1.0; }"
        "float c(usampler2D s) { return 1.0; }  float d(samplerBuffer s) { return 1.0; }"
        "float e(sampler2D s[2]) { return 1.0; }"
    )
    flat = np.zeros((4, 4), np.float32)
    for name, value, said in (
        ("a", np.zeros(4), r"s is a sampler2D: wants shape \(height, width\[, 1\.\.4\]\); got \(4,\)"),
        ("a", np.zeros((4, 4, 5)), r"got \(4, 4, 5\)"),
        ("a", np.zeros((0, 4)), r"got \(0, 4\)"),
        ("b", np.zeros((5, 4, 4)), r"wants shape \(6, size, size\[, 1\.\.4\]\)"),
        ("c", flat, r"wants one of uint32, uint16, uint8; got float32"),
        ("d", flat, r"is a samplerBuffer; arrays can be"),
        ("a", Sampler(flat, filter="trilinaer"), r"unknown filter 'trilinaer'; did you mean 'trilinear'\?"),
        ("a", Sampler(flat, wrap="mirror"), r"unknown wrap 'mirror'"),
        ("a", Sampler(flat, levels=9), r"levels is 1\.\.3 or 'all' here; got 9"),
        ("a", Sampler([flat, np.zeros((3, 2), np.float32)]), r"level 1 must be \(2, 2\) texels"),
    ):
        with pytest.raises(ShaderError, match=said):
            module[name](value)
    with pytest.raises(ShaderError, match="only numbers, and structs and arrays of them, are values"):
        module.e(flat)
    wide = np.zeros((1, 40_000_000), np.uint8)
    with pytest.raises(LimitError, match="past this driver's limit of"):
        module.a(wide)


def test_backends_that_are_none(glsl: Glsl) -> None:
    with pytest.raises(ShaderError, match="unknown backend 'vulkan'; choose one of: auto, compute"):
        glsl(TEXT).whole(1, backend="vulkan")
    with pytest.raises(ShaderError, match="unknown backend 'cpu'"):
        Glsl(backend="cpu")


def test_a_failed_call_leaves_nothing(glsl: Glsl) -> None:
    """The plugin counts GL objects around every test: a leaked texture fails this one."""
    module = glsl("float a(sampler2D s, sampler2D t) { return 1.0; }")
    for _ in range(3):
        with pytest.raises(ShaderError):
            module.a(np.zeros((2, 2)), np.zeros(2))


def test_recursive_include(glsl: Glsl, tmp_path: Any) -> None:
    (tmp_path / "a.glsl").write_text('#include "b.glsl"\n')
    (tmp_path / "b.glsl").write_text('#include "a.glsl"\n')
    with pytest.raises(ShaderError, match=r"circle: .*a\.glsl -> .*b\.glsl -> .*a\.glsl"):
        glsl(tmp_path / "a.glsl")
