"""Programs that do not build name the real file and line."""

from __future__ import annotations

from collections.abc import Iterator

import moderngl
import pytest

from glbump.errors import ContextError, ShaderError
from glbump.gl.context import open_context
from glbump.gl.program import build_compute, build_program
from glbump.gl.source import resolve


@pytest.fixture(scope="module")
def ctx() -> Iterator[moderngl.Context]:
    try:
        opened = open_context()
    except ContextError as error:
        pytest.skip(f"no OpenGL here: {error}")
    with opened:
        yield opened.gl


VERTEX = "void main() { gl_Position = vec4(0.0); }"


def test_the_failing_stage_and_line_are_named(ctx: moderngl.Context) -> None:
    good = resolve(text=VERTEX, stage="vertex")
    bad = resolve(
        text="out vec4 c;\n\nvoid main() { c = colour; }",
        name="mine.frag",
        stage="fragment",
        defines={"A": 1},
    )
    with pytest.raises(ShaderError, match=r"^mine.frag:3: .*colour.*\(fragment shader\)\n"):
        build_program(ctx, good, bad)
    with pytest.raises(ShaderError, match=r"^mine.frag:3: .*colour"):
        build_program(ctx, bad, good)


def test_a_function_that_is_nowhere_is_a_link_error(ctx: moderngl.Context) -> None:
    vertex = resolve(text="vec4 f();\nvoid main() { gl_Position = f(); }", name="v.vert", stage="vertex")
    with pytest.raises(ShaderError, match=r"^v.vert"):
        build_program(ctx, vertex, varyings=["gl_Position"])


def test_feedback_program_builds(ctx: moderngl.Context) -> None:
    text = "out float x;\nvoid main() { x = 1.0; }"
    build_program(ctx, resolve(text=text), varyings=["x"]).release()


def test_compute_errors(ctx: moderngl.Context) -> None:
    if ctx.version_code < 430:
        pytest.skip("compute shaders need OpenGL 4.3")
    with pytest.raises(ShaderError, match=r"^c.comp:2: "):
        build_compute(ctx, resolve(text="void main() {\n x; }", name="c.comp", version=430))
