"""Fixtures every test may use."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from glbump.gl.context import Context, open_context
from glbump.gl.renderer import Renderer


@pytest.fixture(scope="session")
def context() -> Iterator[Context]:
    """The one context of the test run."""
    with open_context() as opened:
        yield opened


@pytest.fixture(scope="session")
def glsl_context(context: Context) -> Context:
    """Shader tests run in the one context too."""
    return context


@pytest.fixture(autouse=True)
def gl_error_state(request: pytest.FixtureRequest) -> Iterator[None]:
    """A test that draws in `context` finds and leaves it current and free of GL errors."""
    if "context" not in request.fixturenames:
        yield
        return
    opened: Context = request.getfixturevalue("context")
    opened.check("start a test")
    yield
    opened.check("look for GL errors")
    assert opened.gl.error == "GL_NO_ERROR"


@pytest.fixture(scope="session")
def renderer(context: Context) -> Iterator[Renderer]:
    """The one renderer of the test run, in the one context."""
    with Renderer(context=context) as opened:
        yield opened
