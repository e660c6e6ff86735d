"""Call a function of a GLSL file with NumPy arrays.

with Glsl() as glsl:
    f = glsl.load("shaders/lib/reflect.glsl").reflect_dir
    f(directions, (0, 0, 1))        # (N, 3) and (3,) -> (N, 3) float32
"""

from __future__ import annotations

import re
from collections import Counter, OrderedDict
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any
from weakref import WeakSet

import moderngl
import numpy as np

from glbump.errors import ShaderError, unknown
from glbump.gl.context import Context, open_context
from glbump.gl.source import Define, Source, resolve
from glbump.glsltest.coverage import Coverage
from glbump.glsltest.module import Module
from glbump.glsltest.mutants import Mutant
from glbump.glsltest.runners import RUNNERS, Arena, Runner
from glbump.glsltest.watch import Watch
from glbump.glsltest.wrapper import BACKENDS, Plan

KEPT_PROGRAMS = KEPT_MODULES = 256
LOOP_LIMIT = 50_000


class Glsl:
    """Loads GLSL and calls its functions in one context; `release` gives back all that it made.

    context: a glbump Context, a moderngl.Context, or None: one of its own, opened at the first call.
    backend: "compute", "feedback", "fragment", or "auto": compute where the driver has it (OpenGL 4.3),
    else feedback; fragment for functions with screen derivatives.
    """

    def __init__(self, context: Context | moderngl.Context | None = None, backend: str = "auto") -> None:
        if backend not in ("auto", *BACKENDS):
            raise ShaderError(unknown("backend", backend, ("auto", *BACKENDS)))
        self.backend = backend
        self._given = context
        self._own: Context | None = None
        self._arena: Arena | None = None
        self._runners: OrderedDict[tuple[Any, ...], Runner] = OrderedDict()
        self._modules: dict[Any, Module] = {}
        self.watch: Watch | None = None
        self.coverage: Coverage | None = None
        # For seeded faults: the one in force, whether it did not compile, and which functions have been called.
        self.mutant: Mutant | None = None
        self.stillborn = False
        self.called: set[tuple[str, str]] | None = None
        # moderngl 5.13 never deletes the program object of a shader that does not compile.
        self._failed = 0
        _all.add(self)

    @property
    def context(self) -> Any:
        """The context that calls run in, opened when it is first asked for."""
        if isinstance(self._given, moderngl.Context):
            self._given = _Borrowed(self._given)  # type: ignore[assignment]
        if self._given is None and self._own is None:
            self._own = open_context()
        return self._given or self._own

    @property
    def arena(self) -> Arena:
        if self._arena is None:
            self._arena = Arena(self.context)
        return self._arena

    def load(
        self,
        source: str | Path | None = None,
        *,
        text: str | None = None,
        defines: Mapping[str, Define] | None = None,
        constants: Mapping[str, object] | None = None,
        uniforms: Mapping[str, Any] | None = None,
        version: int | str | None = None,
        folders: Iterable[str | Path] = (),
        loop_limit: int = LOOP_LIMIT,
    ) -> Module:
        """The functions of a GLSL file, or of GLSL text (`text=`, or a source that is no file name).

        defines: put before the source; constants: new values for its global constants; uniforms: values of
        its uniforms; folders: where includes are looked for too; loop_limit: iterations one row may take in
        all. Raises ShaderError for includes that do not resolve.
        """
        if source is not None and text is None and _is_text(source):
            source, text = None, str(source)
        resolved = resolve(source, text=text, defines=defines, version=version, folders=[Path(f) for f in folders])
        if self.mutant is not None:
            resolved = self.mutant.in_source(resolved)
        values = [(name, np.asarray(value).tobytes()) for name, value in (uniforms or {}).items()]
        key = (resolved.text, resolved.lines, repr(constants), tuple(values), loop_limit)
        if key not in self._modules:
            while len(self._modules) >= KEPT_MODULES:
                self._modules.pop(next(iter(self._modules)))
            self._modules[key] = Module(
                self, resolved, dict(constants or {}), dict(uniforms or {}), loop_limit, version is not None
            )
        return self._modules[key]

    __call__ = load

    def runner(self, source: Source, plan: Plan, backend: str, prefix: str, uniforms: Mapping[str, bytes]) -> Runner:
        """The compiled program of a wrapped source, from the cache where it is; one for each set of uniforms."""
        key = (backend, source.text, *uniforms.items())
        if key in self._runners:
            self._runners.move_to_end(key)
            return self._runners[key]
        while len(self._runners) >= KEPT_PROGRAMS:
            self._runners.popitem(last=False)[1].release()
        try:
            made = RUNNERS[backend](self.context, self.arena, plan, prefix, source)
        except ShaderError:
            self._failed += 1
            self.stillborn = True
            raise
        self._runners[key] = made
        return made

    def release(self) -> None:
        """Give back every GL object, and the context where it was opened here."""
        for runner in self._runners.values():
            runner.release()
        self._runners.clear()
        self._modules.clear()
        if self._arena is not None:
            self._arena.release()
            self._arena = None
        if self._own is not None:
            self._own.release()
            self._own = None

    @property
    def objects(self) -> Counter[str]:
        """How many GL objects of each kind are kept for the next calls, here and wherever else in this context.

        The kinds are those of Context.live_objects.
        """
        found: Counter[str] = Counter()
        for one in _all:
            if one._arena is not None and one.context is self.context:
                runners = list(one._runners.values())
                found += one._arena.objects
                found["program"] += len(runners) + one._failed
                found["vertexarray"] += sum(hasattr(r, "vertices") for r in runners)
        return found

    def __enter__(self) -> Glsl:
        return self

    def __exit__(self, *_: object) -> None:
        self.release()


_all: WeakSet[Glsl] = WeakSet()


class _Borrowed:
    """A moderngl.Context of the caller's, who keeps it current."""

    native = None

    def __init__(self, gl: moderngl.Context) -> None:
        self.gl = gl

    def check(self, what: str) -> None:
        """Nothing is known of it."""


def _is_text(source: str | Path) -> bool:
    """GLSL rather than a file name."""
    return isinstance(source, str) and re.search(r"[\n;{}]", source) is not None
