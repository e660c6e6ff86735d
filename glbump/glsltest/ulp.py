"""Comparing floats on purpose: so many units in the last place, or an absolute or relative bound, or an interval.

A failure shows the worst row: its inputs (where the array came from a GLSL call), both values, both bit
patterns, and how many rows failed.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from glbump.glsltest.records import Call, call_of

Array = npt.NDArray[Any]
F64 = npt.NDArray[np.float64]
TINY = 2.0**-126  # smallest normal float32: an absolute bound for drivers that flush denormals to zero
Bounds = tuple[float, F64, float]  # ULP, absolute, relative
_UINTS = {2: np.uint16, 4: np.uint32, 8: np.uint64}


@dataclass(frozen=True)
class Interval:
    """A wanted value that may lie anywhere from `low` to `high` (arrays): what a specification permits."""

    low: Any
    high: Any


def spacing(values: npt.ArrayLike, dtype: npt.DTypeLike = np.float32) -> F64:
    """The unit in the last place of `dtype` at float64 `values`; that of the smallest normal below it."""
    info = np.finfo(np.dtype(dtype))
    _, exponent = np.frexp(np.abs(np.asarray(values, np.float64)))
    made: F64 = np.ldexp(1.0, np.maximum(exponent - 1, info.minexp) - info.nmant)
    return made


def distance(got: npt.ArrayLike, want: npt.ArrayLike) -> F64:
    """|got - want| in units in the last place, of `got`'s type, at `want`; NaN where either is none."""
    values = np.asarray(got)
    exact = np.asarray(want, np.float64)
    with np.errstate(invalid="ignore"):
        made: F64 = np.abs(values.astype(np.float64) - exact) / spacing(exact, values.dtype)
    return made


def bits(value: Any) -> str:
    """The bit pattern of NumPy scalars or arrays of floats or integers, in hexadecimal."""
    array = np.asarray(value)
    if array.dtype.itemsize not in _UINTS:
        return ""
    raw = np.atleast_1d(np.ascontiguousarray(array)).view(_UINTS[array.dtype.itemsize]).ravel()
    shown = " ".join(f"0x{int(x):0{2 * array.dtype.itemsize}x}" for x in raw[:16])
    return shown + (" ..." if raw.size > 16 else "")


def assert_close(
    got: Any,
    want: Any,
    *,
    ulps: float = 0,
    abs: npt.ArrayLike = 0.0,
    rel: float = 0.0,
    where: Any = None,
) -> None:
    """Every element of `got` within `ulps` units in the last place of `want`, or within `abs`, or `rel` of it.

    want: float64 values (shape of `got`, or one that broadcasts to it), or an Interval. NaN is wanted where
    `want` is NaN, and nowhere else; so with the infinities, and a value that `got`'s type cannot hold is
    infinite. abs: one bound, or one for each row or element. where: a mask of elements or of rows; the others
    are not compared. Integers and bools too. Structs (dicts) and tuples compare part by part. Nothing to compare
    is a failure: such a test cannot fail.
    """
    __tracebackhide__ = True
    bounds = (float(ulps), np.asarray(abs, np.float64), float(rel))
    for name, part, wanted in _parts("", got, want):
        told = _compare(np.asarray(part), wanted, bounds, where, call_of(part))
        if told:
            raise AssertionError(f"{name}{': ' if name else ''}{told}")


def _parts(name: str, got: Any, want: Any) -> list[tuple[str, Any, Any]]:
    if isinstance(got, Mapping):
        if not isinstance(want, Mapping) or set(got) != set(want):
            raise AssertionError(f"{name or 'got'} is a struct with {', '.join(got)}; want is {_kind(want)}")
        return [part for key in got for part in _parts(f"{name}.{key}".lstrip("."), got[key], want[key])]
    if isinstance(got, tuple):
        if not isinstance(want, tuple | list) or len(got) != len(want):
            raise AssertionError(f"{name or 'got'} is {len(got)} values; want is {_kind(want)}")
        pairs = enumerate(zip(got, want, strict=True))
        return [part for i, (g, w) in pairs for part in _parts(f"{name}[{i}]", g, w)]
    return [(name, got, want)]


def _kind(value: Any) -> str:
    return f"a struct with {', '.join(value)}" if isinstance(value, Mapping) else f"a {type(value).__name__}"


@dataclass(frozen=True)
class _Errors:
    """Per element: whether it passes, how far it is outside of what is wanted, from which end of it, and the most
    that was allowed."""

    passed: npt.NDArray[np.bool_]
    error: F64
    reference: F64
    allowed: F64


def _compare(got: Array, want: Any, bounds: Bounds, where: Any, call: Call | None) -> str:
    low, high = (want.low, want.high) if isinstance(want, Interval) else (want, want)
    try:
        low, high = (np.broadcast_to(np.asarray(b, np.float64), got.shape) for b in (low, high))
    except ValueError:
        return f"shapes differ: got {got.shape}, want {np.shape(low)}"
    mask = _mask(where, got.shape)
    if not mask.any():
        return "nothing to compare: " + ("no elements" if got.size == 0 else "where= leaves none")
    found = _errors(got, low, high, (bounds[0], _spread(bounds[1], got.shape), bounds[2]))
    failed = mask & ~found.passed
    return _report(got, low, high, failed, mask, found, bounds, call) if failed.any() else ""


def _mask(where: Any, shape: tuple[int, ...]) -> npt.NDArray[np.bool_]:
    if where is None:
        return np.ones(shape, bool)
    return _spread(np.asarray(where, bool), shape)


def _spread(values: npt.NDArray[Any], shape: tuple[int, ...]) -> npt.NDArray[Any]:
    """Values of rows (the first axes of `shape`), or of elements, for every element."""
    if 0 < values.ndim < len(shape) and values.shape == shape[: values.ndim]:
        values = values.reshape(values.shape + (1,) * (len(shape) - values.ndim))
    return np.broadcast_to(values, shape)


def _errors(got: Array, low: F64, high: F64, bounds: Bounds) -> _Errors:
    values = got.astype(np.float64)
    floats = got.dtype.kind == "f"
    if floats:  # what the type cannot hold is infinite
        with np.errstate(over="ignore", invalid="ignore"):
            low = np.where(np.isinf(low.astype(got.dtype)), np.copysign(np.inf, low), low)
            high = np.where(np.isinf(high.astype(got.dtype)), np.copysign(np.inf, high), high)
    wants_nan = np.isnan(low) | np.isnan(high)
    with np.errstate(invalid="ignore"):
        inside = (values >= low) & (values <= high)
        below = np.where(values < low, low, high)
        error = np.where(inside, 0.0, np.abs(values - below))
        unit = spacing(np.where(np.isfinite(below), below, 0.0), got.dtype) if floats else np.ones_like(values)
        allowed = np.maximum(np.maximum(bounds[0] * unit, bounds[1]), bounds[2] * np.abs(below))
        # An infinity is met by itself alone; no bound makes a finite value of it, or the other way round.
        finite = np.isfinite(values) & np.isfinite(below)
        passed = np.where(wants_nan, np.isnan(values), inside | (finite & (error <= allowed)))
    return _Errors(passed, error, below, allowed)


def _report(
    got: Array,
    low: F64,
    high: F64,
    failed: npt.NDArray[np.bool_],
    mask: npt.NDArray[np.bool_],
    found: _Errors,
    bounds: Bounds,
    call: Call | None,
) -> str:
    with np.errstate(invalid="ignore", divide="ignore"):
        rank = np.where(found.allowed > 0, found.error / found.allowed, found.error)
    rank = np.where(failed, np.where(np.isfinite(rank), rank, np.inf), -1.0)
    worst = tuple(int(i) for i in np.unravel_index(int(np.argmax(rank)), got.shape))
    axes = len(call.lead) if call else max(got.ndim - 1, 1) if got.ndim else 0
    rows = failed.reshape((*got.shape[:axes], -1)).any(-1)
    counted = mask.reshape((*got.shape[:axes], -1)).any(-1)
    absolute = float(_spread(bounds[1], got.shape)[worst])
    limits = (
        (bounds[0], "ULP"),
        (absolute, "absolute" if bounds[1].ndim == 0 else "absolute there"),
        (bounds[2], "relative"),
    )
    allowed = " or ".join(f"{b:g} {text}" for b, text in limits if b) or "nothing"
    name = f"{call.plan.signature.name}: " if call else ""
    lines = [f"{name}{int(rows.sum())} of {int(counted.sum())} rows differ by more than {allowed}"]
    place = (f"row {_index(worst[:axes])}" if axes else "the one row") + (
        f", element {_index(worst[axes:])}" if worst[axes:] else ""
    )
    lines.append(f"worst: {place}")
    value = got[worst]
    lines.append(f"  got    {value!s:24} {bits(value)}")
    for word, bound in (("want", low),) if low[worst] == high[worst] else (("from", low), ("to", high)):
        with np.errstate(over="ignore"):
            stored = bound[worst].astype(got.dtype) if not np.isnan(bound[worst]) or got.dtype.kind == "f" else value
        lines.append(f"  {word:6} {float(bound[worst])!r:24} {bits(stored)}")
    lines.append(f"  error  {_error(float(found.error[worst]), float(found.reference[worst]), got.dtype)}")
    if call is not None:
        for key, row in call.row(worst).items():
            shown = np.array2string(np.asarray(row), threshold=32, separator=", ", floatmode="unique").replace("\n", "")
            lines.append(f"  {key} = {shown}   {bits(row)}")
    return "\n".join(lines)


def _error(error: float, reference: float, dtype: np.dtype[Any]) -> str:
    if not np.isfinite(error):
        return "not a number of units: NaN and the infinities are met by themselves alone"
    told = [f"{error:.4g} absolute"]
    if dtype.kind == "f" and np.isfinite(reference):
        told.insert(0, f"{error / float(spacing(reference, dtype)):.4g} ULP")
    if reference and np.isfinite(reference):
        told.append(f"{error / np.abs(reference):.4g} relative")
    return ", ".join(told)


def _index(index: tuple[int, ...]) -> str:
    return str(index[0]) if len(index) == 1 else str(index)
