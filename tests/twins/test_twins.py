"""Every function of shaders/lib against its float64 twin, and none without one."""

from __future__ import annotations

import importlib
import inspect
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from glbump.gl.source import find_shaders, resolve
from glbump.glsltest import Glsl, ulp
from glbump.glsltest.declarations import Signature, declarations

from .cases import CASES, Case

FILES = sorted(path.stem for path in (find_shaders() / "lib").glob("*.glsl"))
# Functions of the reference that stand for what the GPU itself does, and so have no GLSL.
NO_GLSL = {"filter": {"quad_differences", "through_levels"}}


def functions(stem: str) -> dict[str, Signature]:
    """The functions that shaders/lib/<stem>.glsl itself defines."""
    source = resolve(find_shaders() / "lib" / f"{stem}.glsl")
    found = declarations(source.text)
    own = [
        f for f in found.functions if source.origin(source.text.count("\n", 0, f.start) + 1)[0].endswith(f"{stem}.glsl")
    ]
    return {f.name: f for f in own}


def twin(stem: str) -> ModuleType:
    return importlib.import_module(f"glbump.reference.{stem}")


@pytest.mark.parametrize("stem", FILES)
def test_both_sides_have_the_same_functions(stem: str) -> None:
    """The same names, the same arguments in the same order; out parameters are what the twin returns."""
    ours, module = functions(stem), twin(stem)
    theirs = {
        name
        for name, f in inspect.getmembers(module, inspect.isfunction)
        if f.__module__ == module.__name__ and not name.startswith("_")
    }
    assert set(ours) == theirs - NO_GLSL.get(stem, set())
    for name, signature in ours.items():
        taken = [p.name for p in signature.params if p.direction != "out"]
        assert taken == list(inspect.signature(getattr(module, name)).parameters), name


def test_every_function_has_its_case_and_its_reason() -> None:
    wanted = {f"{stem}.{name}" for stem in FILES for name in functions(stem)}
    assert set(CASES) == wanted
    assert all(len(case.reason) > 10 and (case.ulps or case.abs or case.period) for case in CASES.values())


@pytest.mark.parametrize("name", sorted(CASES))
def test_twin(name: str, glsl: Glsl) -> None:
    stem, function = name.split(".")
    case = CASES[name]
    # What the shader sees, the twin sees: float32.
    arguments = tuple(np.float32(a) if np.asarray(a).dtype.kind == "f" else a for a in case.rows())
    got = glsl(f"lib/{stem}.glsl")[function](*arguments)
    compare(got, getattr(twin(stem), function)(*arguments), arguments, case)


def compare(got: Any, want: Any, arguments: tuple[Any, ...], case: Case) -> None:
    """As the case says; a coordinate that goes round is taken at its nearest turn. What is too small for a normal
    float may be zero: drivers flush denormals, llvmpipe in all stages but compute."""
    if case.period:
        turns = np.array([p or np.inf for p in case.period])
        want = want + np.where(np.isinf(turns), 0.0, np.rint((got - want) / turns) * np.nan_to_num(turns, posinf=0.0))
    bound = case.abs(*arguments, want) if callable(case.abs) else case.abs
    where = case.where(*arguments) if case.where else None
    parts = got if isinstance(got, tuple) else (got,)
    for part in parts:
        assert np.isfinite(part).all(), "rows that are not compared must be finite all the same"
    compared = zip(parts, want, bound, strict=True) if isinstance(bound, tuple) else [(got, want, bound)]
    for part, wanted, most in compared:
        ulp.assert_close(part, wanted, ulps=case.ulps, abs=np.maximum(most, ulp.TINY), where=where)
