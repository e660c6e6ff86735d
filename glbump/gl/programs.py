"""Programs that are kept between frames."""

from __future__ import annotations

from collections import OrderedDict

import moderngl

from glbump.gl.program import build_program
from glbump.gl.source import resolve
from glbump.gl.uniforms import Uniforms

Defines = tuple[tuple[str, int], ...]


class Programs:
    """Programs with their uniforms, by their files and defines; `most` of them, and those used longest ago go first.
    Mesa's llvmpipe holds some 2.5 MB for each."""

    def __init__(self, gl: moderngl.Context, most: int = 256) -> None:
        self._gl = gl
        self._most = most
        self._kept: OrderedDict[tuple[str, str, Defines], Uniforms] = OrderedDict()

    def get(self, vertex: str, fragment: str, defines: Defines = ()) -> Uniforms:
        """Of a vertex and a fragment shader. ShaderError where they do not compile."""
        key = (vertex, fragment, defines)
        if key not in self._kept:
            named = dict(defines)
            program = build_program(self._gl, resolve(vertex, defines=named), resolve(fragment, defines=named))
            self._kept[key] = Uniforms(self._gl, program)
        self._kept.move_to_end(key)
        return self._kept[key]

    def surplus(self, used: int) -> list[Uniforms]:
        """Those that are too many, to be released; never the `used` that were asked for last."""
        count = max(0, len(self._kept) - max(self._most, used))
        return [self._kept.popitem(last=False)[1] for _ in range(count)]

    def release(self) -> None:
        """Free everything."""
        for uniforms in self._kept.values():
            uniforms.release()
        self._kept.clear()
