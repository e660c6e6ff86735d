"""Resolved sources -> linked programs; a failure names the real file and line."""

from __future__ import annotations

from collections.abc import Sequence

import moderngl

from glbump.errors import ShaderError
from glbump.gl.source import Source


def build_program(
    ctx: moderngl.Context, vertex: Source, fragment: Source | None = None, varyings: Sequence[str] = ()
) -> moderngl.Program:
    """A linked program; with `varyings` (and no fragment source) one for transform feedback.

    Raises ShaderError with the real file, line and the source around it.
    """
    try:
        return ctx.program(
            vertex_shader=vertex.text,
            fragment_shader=fragment.text if fragment else None,
            varyings=tuple(varyings),
        )
    except moderngl.Error as error:
        raise ShaderError(_blamed(str(error), vertex, fragment).explain(str(error))) from None


def build_compute(ctx: moderngl.Context, source: Source) -> moderngl.ComputeShader:
    """A linked compute program (GL 4.3). Raises ShaderError as `build_program` does."""
    try:
        return ctx.compute_shader(source.text)
    except moderngl.Error as error:
        raise ShaderError(source.explain(str(error))) from None


def _blamed(log: str, vertex: Source, fragment: Source | None) -> Source:
    """The source that moderngl's message is about: it names the stage in a heading."""
    return fragment if fragment is not None and "vertex_shader" not in log else vertex
