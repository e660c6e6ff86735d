"""Includes, defines, the line table, and driver logs turned into real files and lines."""

from __future__ import annotations

from pathlib import Path

import pytest

from glbump.errors import ShaderError
from glbump.gl.source import find_shaders, resolve


@pytest.fixture
def shaders(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A shaders folder of four files; top.frag includes b, which includes a."""
    root = tmp_path / "shaders"
    (root / "lib").mkdir(parents=True)
    (root / "lib" / "a.glsl").write_text("float a() { return 1.0; }\n")
    (root / "lib" / "b.glsl").write_text('#include "lib/a.glsl"\nfloat b() { return a(); }\n')
    (root / "top.frag").write_text(
        'out vec4 colour;\n#include "lib/b.glsl"\n#include "lib/a.glsl"\nvoid main() {\n    colour = vec4(b());\n}\n'
    )
    monkeypatch.setenv("GLBUMP_SHADERS", str(root))
    return root


def test_every_output_line_knows_where_it_came_from(shaders: Path) -> None:
    source = resolve("top.frag", defines={"N": 3, "ON": True, "X": 0.5})
    out = source.text.splitlines()
    assert out[:4] == ["#version 330 core", "#define N 3", "#define ON 1", "#define X 0.5"]
    assert len(source.lines) == len(out)
    for line, (file, number) in zip(out, source.lines, strict=True):
        if file.startswith("shaders/") and "glbump_once" not in line and line != "#endif":
            assert (shaders.parent / file).read_text().splitlines()[number - 1] == line


def test_an_include_comes_once(shaders: Path) -> None:
    assert resolve("top.frag").text.count("float a()") == 1


def test_an_include_in_a_branch_not_taken_does_not_hide_a_later_one(shaders: Path) -> None:
    """Mutation: without scopes the second include is dropped and a() is missing from the compiled text."""
    text = '#if USE\n#include "lib/a.glsl"\n#else\n#include "lib/b.glsl"\n#endif\n#include "lib/a.glsl"\n'
    out = resolve(text=text, defines={"USE": 0}).text
    assert out.count("float a()") == 3  # guarded: the preprocessor keeps one
    assert out.count("#ifndef glbump_once_shaders_lib_a_glsl") == 3


def test_includes_in_comments_are_not_includes(shaders: Path) -> None:
    text = '// #include "no.glsl"\n/* #include "no.glsl"\n#include "no.glsl" */ float x;\n'
    text += '#define M \\\n#include "no.glsl"\n'
    assert "float x;" in resolve(text=text).text


def test_a_cycle_prints_its_chain(shaders: Path) -> None:
    (shaders / "lib" / "a.glsl").write_text('#include "lib/b.glsl"\n')
    with pytest.raises(ShaderError, match=r"lib/a.glsl:1: .*shaders/lib/b.glsl -> shaders/lib/a.glsl -> shaders/lib/b"):
        resolve("top.frag")


def test_a_file_that_includes_itself_is_a_cycle(shaders: Path) -> None:
    (shaders / "lib" / "a.glsl").write_text('#include "a.glsl"\n')
    with pytest.raises(ShaderError, match=r"circle: shaders/lib/a.glsl -> shaders/lib/a.glsl"):
        resolve("lib/a.glsl")


def test_a_missing_include_names_its_line_and_the_nearest_file(shaders: Path) -> None:
    (shaders / "lib" / "b.glsl").write_text('\n#include "lib/aa.glsl"\n')
    with pytest.raises(ShaderError, match=r"^shaders/lib/b.glsl:2: no .*'lib/aa.glsl'.*'lib/a.glsl'\?$"):
        resolve("top.frag")
    with pytest.raises(ShaderError, match=r"^no shader file 'tip.frag'.*did you mean 'top.frag'"):
        resolve("tip.frag")


def test_versions(shaders: Path) -> None:
    assert resolve("lib/a.glsl", version=430).text.startswith("#version 430 core\n")
    assert resolve(text="#version 300 es\nfloat f;").text.startswith("#version 300 es\n\nfloat f;")
    assert resolve(text="#version 450\n", version=330).text.count("#version") == 1
    (shaders / "lib" / "a.glsl").write_text("#version 330\n")
    with pytest.raises(ShaderError, match=r"lib/a.glsl:1: #version in an included file"):
        resolve("top.frag")


def test_a_source_that_is_no_text(shaders: Path) -> None:
    (shaders / "lib" / "a.glsl").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(ShaderError, match=r"cannot read shader shaders/lib/a.glsl"):
        resolve("top.frag")


@pytest.mark.parametrize(("text", "said"), [("#if 1\n", "without #endif"), ("\n#endif\n", "inline:2: #endif")])
def test_unbalanced_conditions(shaders: Path, text: str, said: str) -> None:
    with pytest.raises(ShaderError, match=said):
        resolve(text=text)


def test_a_define_must_be_a_name_and_one_line(shaders: Path) -> None:
    for bad in ({"1X": 1}, {"X": "1\nfloat y;"}):
        with pytest.raises(ShaderError, match="a define is a GLSL name"):
            resolve("lib/a.glsl", defines=bad)


def test_repository_names_work_too(shaders: Path) -> None:
    assert resolve("shaders/lib/a.glsl").text == resolve("lib/a.glsl").text


def test_shaders_folder_that_is_none(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("GLBUMP_SHADERS", "/no/such/folder")
    with pytest.raises(ShaderError, match="correct GLBUMP_SHADERS"):
        find_shaders()


@pytest.mark.parametrize(
    "log",
    [
        "0:{0}(5): warning: old\n0:{0}(5): error: `c' undeclared",  # Mesa
        "0({0}) : error C1008: `c' undeclared",  # NVIDIA
        "ERROR: 0:{0}: `c' undeclared",  # Intel, AMD, Apple
        "GLSL Compiler failed\n\nfragment_shader\n=====\n0:{0}(5): error: `c' undeclared\n\n",  # moderngl
    ],
)
def test_logs_of_three_vendors_name_the_real_line(shaders: Path, log: str) -> None:
    source = resolve("top.frag", defines={"A": 1})
    line = source.text.splitlines().index("float b() { return a(); }") + 1
    told = source.explain(log.format(line)).splitlines()
    assert told[0] == "shaders/lib/b.glsl:2: `c' undeclared (fragment shader)"
    assert told[1:] == ['     1 | #include "lib/a.glsl"', ">    2 | float b() { return a(); }"]


def test_a_link_log_without_lines(shaders: Path) -> None:
    told = resolve("top.frag").explain("GLSL Linker failed\n\nProgram\n=======\nerror: unresolved `f'\n\n")
    assert told == "shaders/top.frag: GLSL does not build (fragment shader): error: unresolved `f'"
