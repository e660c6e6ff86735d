"""The functions of one GLSL source, and calling them."""

from __future__ import annotations

import contextlib
import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from glbump.errors import ShaderError, nearest, unknown
from glbump.gl.source import Source
from glbump.glsltest import coverage, edits
from glbump.glsltest.again import Again
from glbump.glsltest.arguments import Misfit, Rows, empty_results, results_of, rows_of
from glbump.glsltest.columns import Column, columns_of
from glbump.glsltest.coverage import Mark, Marker
from glbump.glsltest.declarations import Declarations, Signature, Type, declarations
from glbump.glsltest.records import Call, remember
from glbump.glsltest.runners import Runner
from glbump.glsltest.samplers import Sampler, texture
from glbump.glsltest.wrapper import BACKENDS, Plan, plan_call, wrapped

if TYPE_CHECKING:
    from glbump.glsltest.glsl import Glsl


class MissingFunction(ShaderError, AttributeError):
    """A function that a source does not define; its text names the nearest one."""


class Module:
    """The functions of one source: `module.name`, or `module["name(vec3, float)"]` for one overload."""

    def __init__(
        self,
        glsl: Glsl,
        source: Source,
        constants: Mapping[str, object],
        uniforms: Mapping[str, Any],
        loop_limit: int,
        fixed_version: bool,
    ) -> None:
        self.glsl = glsl
        self.source = source
        self.found: Declarations = declarations(source.text)
        self.loop_limit = loop_limit
        self._fixed_version = fixed_version
        self._constants = edits.with_constants(self.found, constants)
        self.uniforms = {name: _uniform(self.found, name, value) for name, value in uniforms.items()}
        self._functions: dict[str, Function] = {}
        self.prefix = _free_prefix(source.text)
        if glsl.coverage is not None:
            glsl.coverage.see(source, self.found)

    @property
    def signatures(self) -> list[Signature]:
        """All function definitions, in the order of the text."""
        return [f for f in self.found.functions if f.name != "main"]

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *{f.name for f in self.signatures}]

    def __getattr__(self, name: str) -> Function:
        if name.startswith("__"):
            raise AttributeError(name)
        return self[name]

    def __getitem__(self, name: str) -> Function:
        key = re.sub(r"\s+", "", name)
        if key in self._functions:
            return self._functions[key]
        chosen = [f for f in self.signatures if key in (f.name, re.sub(r"\s+", "", f.key))]
        if not chosen:
            raise MissingFunction(self._missing(name))
        made = self._functions[key] = Function(self, chosen)
        return made

    def _missing(self, name: str) -> str:
        names = list(dict.fromkeys(f.name for f in self.signatures))
        what = f"{self.source.name} has no function {name!r}"
        close = nearest(name, names)
        if close:
            shown = next(str(f) for f in self.signatures if f.name == close)
            return f"{what}; did you mean {shown}?"
        skipped = f" (not understood: {self.found.skipped[0]})" if self.found.skipped else ""
        return f"{what}; it has {', '.join(names) or 'none'}{skipped}"

    def build(self, plan: Plan, backend: str) -> Built:
        """The compiled call of a plan, with what watches over it."""
        text, found, p = self.source.text, self.found, self.prefix
        reached = found.reached(plan.signature)
        guards, loops = edits.loop_guards(found, reached, p)
        made = [*edits.bare(text, found), *self._constants, *guards]
        before = ""
        if loops:
            before += edits.guard_header(p, self.loop_limit)
            plan = replace(plan, extra=(*plan.extra, (f"{p}status", Column((), Type("uint"), ()))))
        marker = Marker(self.source, p)
        if self.glsl.coverage is not None:
            for f in reached:
                with contextlib.suppress(ShaderError):  # macros that are no GLSL by themselves: not counted
                    marker.function(f, found.body(f))
            made += marker.edits
            before += coverage.header(p, len(marker.marks))
            flags = Column((), Type("uint"), (coverage.words(len(marker.marks)),))
            setup = coverage.setup(p, len(marker.marks))
            plan = replace(plan, extra=(*plan.extra, (f"{p}flags", flags)), setup=setup)
        if backend != "fragment":
            # What is put into a function that is taken out goes with it.
            out = edits.without_fragment_functions(text, found)
            made = [e for e in made if not any(o.start <= e.start < o.end for o in out)] + out
        at = edits.first_function(found)
        edited = self._versioned(edits.apply(text, [edits.Edit(at, at, before), *made]), backend)
        source = wrapped(replace(self.source, text=edited), plan, backend, p)
        return Built(self.glsl.runner(source, plan, backend, p, self.uniforms), loops, marker.marks)

    def _versioned(self, text: str, backend: str) -> str:
        """The #version line that the way of running needs at least."""
        first, rest = text.split("\n", 1)
        if self._fixed_version:
            return text
        number, *profile = first.split()[1:]
        least = {"compute": 430, "feedback": 330, "fragment": 330}[backend]
        if "es" in profile:
            least = 310 if backend == "compute" else 300
        elif int(number) < 150 or not profile:
            profile = ["core"]
        return f"#version {max(int(number), least)} {' '.join(profile)}\n{rest}"

    def origin(self, offset: int) -> str:
        """file:line of an offset in the resolved text."""
        file, line = self.source.origin(self.source.text.count("\n", 0, offset) + 1)
        return f"{file}:{line}"


def _free_prefix(text: str) -> str:
    """A beginning for the wrapper's names that no name of the source has."""
    number = 0
    while f"gbt{number or ''}_" in text:
        number += 1
    return f"gbt{number or ''}_"


def _uniform(found: Declarations, name: str, value: Any) -> bytes:
    """A uniform's value as the bytes OpenGL takes: matrices column by column, bools as integers."""
    allowed = {v.name: v for v in found.variables.values() if "uniform" in v.qualifiers}
    if name not in allowed:
        raise ShaderError(unknown("uniform", name, allowed))
    (column,) = columns_of(allowed[name].type, f"uniform {name}")
    array = np.asarray(value, np.int32 if column.dtype == np.bool_ else column.dtype)
    if array.shape != column.shape:
        raise ShaderError(f"uniform {allowed[name].type} {name} wants shape {column.shape}; got {array.shape}")
    return np.ascontiguousarray(np.swapaxes(array, -1, -2) if len(column.type.tail) == 2 else array).tobytes()


@dataclass(frozen=True)
class Built:
    """A compiled call: the offsets of the loops it guards, and the points whose running it counts."""

    runner: Runner
    loops: list[int]
    marks: list[Mark]


class Function:
    """One GLSL function, or its overloads: call it with arrays.

    An argument's last axes are the GLSL type's (vec3: (..., 3); mat3x2: (..., 2 rows, 3 columns); float[4]:
    (..., 4)), the axes before them are rows and broadcast. Returns float32 (int32, uint32, bool) arrays: the
    returned value, then out and inout parameters, as a tuple where there are several; a struct is a dict.
    Of overloads the one is called whose parameters fit; where several fit, the one with the widest types.
    Functions with screen derivatives take rows of shape (..., 2, 2): [y, x] in a quad of pixels, y up.
    """

    def __init__(self, module: Module, signatures: list[Signature]) -> None:
        self.module = module
        self.overloads = [Overload(module, s) for s in signatures]

    @property
    def signature(self) -> Signature:
        """The one signature; ShaderError where there are overloads."""
        first = self.overloads[0].signature
        if len(self.overloads) > 1:
            raise ShaderError(f"overloaded: {self}; choose one: module[{first.key!r}]")
        return first

    def __str__(self) -> str:
        return "; ".join(str(o.signature) for o in self.overloads)

    def __repr__(self) -> str:
        return f"<GLSL {self} of {self.module.source.name}>"

    def __call__(
        self,
        *arguments: Any,
        filter: str = "linear",
        wrap: str | tuple[str, ...] = "repeat",
        levels: int | str = 1,
        backend: str | None = None,
    ) -> Any:
        """Run over all rows. filter, wrap, levels: of plain arrays given for samplers; see `Sampler`.

        Raises ShaderError: arguments that do not fit (with the signature), GLSL that does not compile (with
        file and line), a loop that does not end.
        """
        overload = self.overloads[0] if len(self.overloads) == 1 else self._chosen(arguments)
        wanted = backend or self.module.glsl.backend
        if (repeated := overload.again(arguments, wanted)) is not None:
            return repeated
        placed = overload.placed(arguments)
        plan = overload.plan
        samplers = [
            a if isinstance(a, Sampler) else Sampler(a, filter, wrap, levels)
            for a in (placed[i] for i in plan.samplers)
        ]
        rows = rows_of(plan, placed)
        result = overload.run(rows, samplers, backend)
        overload.learn(arguments, rows, wanted)
        return result

    def _chosen(self, arguments: tuple[Any, ...]) -> Overload:
        """The overload whose parameters fit; the widest types where several do."""
        fits: list[tuple[tuple[int, int], Overload]] = []
        said: list[str] = []
        for overload in self.overloads:
            try:
                rows = rows_of(overload.plan, overload.placed(arguments))
            except ShaderError as error:
                said.append(str(error))
                continue
            columns = overload.plan.in_columns
            width = sum(len(c.shape) for c in columns)
            plain = [np.asarray(a) for a in arguments if not isinstance(a, Sampler | Mapping)]
            same = sum(a.dtype.kind == c.dtype.kind for a, c in zip(plain, rows.columns, strict=False))
            fits.append(((width, same), overload))
        if not fits:
            raise ShaderError(f"no overload fits: {'; '.join(said)}")
        best = max(score for score, _ in fits)
        chosen = [overload for score, overload in fits if score == best]
        if len(chosen) > 1:
            shown = " or ".join(f"module[{o.signature.key!r}]" for o in chosen)
            raise ShaderError(f"{self.module.source.name}: several overloads fit; choose {shown}")
        return chosen[0]


class Overload:
    """One signature of a function: its plan, and its program for each way to run."""

    def __init__(self, module: Module, signature: Signature) -> None:
        self.module = module
        self.signature = signature
        self._takes = [i for i, p in enumerate(signature.params) if p.direction != "out"]
        self._programs: dict[str, Built] = {}
        self._label = f"{signature} of {module.source.name}"
        self._last: tuple[str, Again] | None = None

    @cached_property
    def plan(self) -> Plan:
        return plan_call(self.signature)

    @cached_property
    def derives(self) -> bool:
        """Whether it only compiles in a fragment shader: screen derivatives, for one."""
        return edits.needs_fragment(self.module.found, self.signature)

    @cached_property
    def _reached(self) -> set[tuple[str, str]]:
        """The (file, function) of all that a call runs."""
        found = self.module.found.reached(self.signature)
        return {(self.module.origin(f.start).rpartition(":")[0], f.name) for f in found}

    @cached_property
    def implicit_level(self) -> bool:
        """Whether it reads textures at the level that derivatives choose."""
        found = self.module.found
        return any(edits.IMPLICIT_LEVEL & found.words(f) for f in found.reached(self.signature))

    def placed(self, arguments: tuple[Any, ...]) -> dict[int, Any]:
        """Arguments by parameter index; out parameters take none."""
        if len(arguments) != len(self._takes):
            raise Misfit(f"{self.signature} takes {len(self._takes)} arguments; got {len(arguments)}")
        return dict(zip(self._takes, arguments, strict=True))

    def learn(self, arguments: tuple[Any, ...], rows: Rows, wanted: str) -> None:
        """Keep the layout of a call that went well, for calls like it."""
        built = self._programs.get("compute") if wanted in ("auto", "compute") else None
        self._last = None
        if built is not None and self.module.glsl.called is None and Again.fits(built.runner, arguments, rows.lead):
            self._last = (wanted, Again(built.runner, arguments, rows.lead, rows.count))  # type: ignore[arg-type]

    def again(self, arguments: tuple[Any, ...], wanted: str) -> Any:
        """The results where this call is like the last one, else None."""
        if self._last is None or self._last[0] != wanted or not self._last[1].takes(arguments):
            return None
        last, glsl = self._last[1], self.module.glsl
        glsl.context.check("call a GLSL function")
        if glsl.watch is not None:
            glsl.watch.begin(self._label)
        try:
            result = last.run(arguments)
        finally:
            if glsl.watch is not None:
                glsl.watch.end()
        remember(result, Call(self.plan, last.lead, arguments))
        return result

    def run(self, rows: Rows, samplers: list[Sampler], wanted: str | None) -> Any:
        """Call for all rows; returns what the caller gets. wanted: the way to run, where this call names one."""
        quads = self.derives or (self.implicit_level and any(s.has_levels for s in samplers))
        if quads and rows.lead[-2:] != (2, 2):
            said = "takes screen derivatives: rows of shape (..., 2, 2), [y, x] in a quad"
            raise ShaderError(f"{self.signature} {said}; got {rows.lead}")
        glsl = self.module.glsl
        glsl.context.check("call a GLSL function")
        if glsl.called is not None:
            glsl.called |= self._reached
        built = self._program(self._backend(quads, wanted))
        columns = empty_results(built.runner.plan, rows.count)
        if rows.count:
            self._run(built.runner, rows, samplers, columns)
            self._look(built, columns)
        result = results_of(self.plan, columns[: len(self.plan.out_columns)], rows.lead)
        remember(result, Call(self.plan, rows.lead, rows.columns))
        return result

    def _program(self, backend: str) -> Built:
        made = self._programs.get(backend)
        if made is None or made.runner.released:
            made = self._programs[backend] = self.module.build(self.plan, backend)
        return made

    def _look(self, built: Built, columns: list[Any]) -> None:
        """Take the columns that are ours off the results: flags of what ran, and loops that did not end."""
        seen = self.module.glsl.coverage
        if built.marks:
            flags = columns.pop()
            if seen is not None:
                seen.add(self.module.source, built.marks, coverage.raised(flags, len(built.marks)))
        if built.loops:
            status = columns.pop()
            if status.any():
                raise self._endless(status, built.loops)

    def _run(self, runner: Runner, rows: Rows, samplers: list[Sampler], columns: Any) -> None:
        glsl, params = self.module.glsl, self.signature.params
        textures: list[Any] = []
        if glsl.watch is not None:
            glsl.watch.begin(self._label)
        try:
            for sampler, i in zip(samplers, self.plan.samplers, strict=True):
                what = f"{self.signature}: {params[i].name}"
                textures.append(texture(glsl.context, sampler, params[i].type.name, what))
            runner.set_uniforms(self.module.uniforms, textures)
            runner.run(rows.columns, rows.count, columns)
        finally:
            if glsl.watch is not None:
                glsl.watch.end()
            for made in textures:
                made.release()

    def _endless(self, status: Any, loops: list[int]) -> ShaderError:
        row = int(np.flatnonzero(status[:, 0])[0])
        where = self.module.origin(loops[int(status[row, 0]) - 1])
        return ShaderError(
            f"{self.signature}: row {row} of {len(status)} did not end: the loop at {where} took it past "
            f"{self.module.loop_limit} iterations; mend it, or load with a larger loop_limit="
        )

    def _backend(self, quads: bool, wanted: str | None) -> str:
        """The way to run: what the call wants, else what `glsl` prefers and the function allows."""
        way = wanted or self.module.glsl.backend
        if way not in ("auto", *BACKENDS):
            raise ShaderError(unknown("backend", way, ("auto", *BACKENDS)))
        compute = self.module.glsl.context.gl.version_code >= 430
        if quads and wanted not in (None, "auto", "fragment"):
            raise ShaderError(f"{self.signature} takes screen derivatives: {wanted!r} has none; use 'fragment'")
        if quads:
            return "fragment"
        if way == "compute" and not compute:
            raise ShaderError("backend 'compute' needs OpenGL 4.3; use 'feedback'")
        return ("compute" if compute else "feedback") if way == "auto" else way
