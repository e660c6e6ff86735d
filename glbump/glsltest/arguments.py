"""NumPy values <-> columns of words, checked: a wrong shape or type is an error that shows the signature."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import prod
from typing import Any

import numpy as np
import numpy.typing as npt

from glbump.errors import LimitError, ShaderError, nearest
from glbump.glsltest.columns import Column
from glbump.glsltest.declarations import Signature
from glbump.glsltest.wrapper import Plan

Array = npt.NDArray[Any]
# What NumPy kinds each GLSL scalar takes: no fraction, sign or truth is dropped on the way.
_KINDS = {"float": "fiu", "double": "fiu", "int": "iu", "uint": "iu", "bool": "b"}


class Misfit(ShaderError):
    """An argument that does not fit its parameter; another overload may take it."""


@dataclass(frozen=True)
class Rows:
    """The arguments of one call: an array for each column, `lead` the shape that all broadcast to."""

    columns: tuple[Array, ...]
    lead: tuple[int, ...]

    @property
    def count(self) -> int:
        return prod(self.lead)


def rows_of(plan: Plan, arguments: Mapping[int, Any]) -> Rows:
    """Arguments (by parameter index) as columns: (*lead, *shape of the column) or () + shape where shared."""
    columns: list[Array] = []
    common: tuple[int, ...] | None = None
    mixed = False
    for i, wanted in plan.inputs:
        for column in wanted:
            array = _leaf(plan.signature, i, column, arguments[i])
            lead = array.shape[: array.ndim - len(column.shape)]
            mixed |= common is not None and lead != common
            common = lead if common is None else common
            columns.append(array)
    if mixed:
        leads = [a.shape[: a.ndim - len(c.shape)] for a, c in zip(columns, plan.in_columns, strict=True)]
        try:
            common = np.broadcast_shapes(*leads)
        except ValueError:
            shown = ", ".join(map(str, leads))
            raise Misfit(f"{plan.signature}: rows do not broadcast together: {shown}") from None
        columns = [_spread(plan.signature, a, c, common) for a, c in zip(columns, plan.in_columns, strict=True)]
    else:
        columns = [
            _contiguous(plan.signature, a).reshape((-1, *c.shape))
            for a, c in zip(columns, plan.in_columns, strict=True)
        ]
    return Rows(tuple(columns), common or ())


def _spread(signature: Signature, array: Array, column: Column, lead: tuple[int, ...]) -> Array:
    """(rows, *shape), or (1, *shape) where every row shares the value."""
    own = array.shape[: array.ndim - len(column.shape)]
    if prod(own) == 1:
        return array.reshape((1, *column.shape))
    if own != lead:
        array = np.broadcast_to(array, (*lead, *column.shape))
    return _contiguous(signature, array).reshape((-1, *column.shape))


def _contiguous(signature: Signature, array: Array) -> Array:
    if array.flags.c_contiguous:
        return array
    _check_memory(signature, array.nbytes, "take")
    return np.ascontiguousarray(array)


def _check_memory(signature: Signature, wanted: int, word: str) -> None:
    """LimitError for what this machine's memory does not hold: asking for it may end the process instead."""
    if wanted > (1 << 30) and wanted > _free_memory():
        size = f"{wanted / 2**30:.1f} GiB"
        raise LimitError(f"{signature}: so many rows {word} {size}, more than is free here; call it in parts")


def _leaf(signature: Signature, index: int, column: Column, value: Any) -> Array:
    """The array of one column inside an argument, in the column's type."""
    for key in column.path:
        value = _field(signature, index, column, key, value)
    shape = column.shape
    if isinstance(value, np.ndarray) and value.dtype == column.dtype:
        array = value
    else:
        try:
            array = np.asarray(value)
        except ValueError:
            said = "is ragged: its rows have different lengths"
            raise Misfit(f"{_named(signature, index, column)} {said}") from None
        if array.dtype.kind not in _KINDS[column.type.scalar]:
            said = f"is {column.type.scalar}; got an array of {array.dtype}"
            raise Misfit(f"{_named(signature, index, column)} {said}")
        array = _typed(array, column, signature, index)
    if shape and array.shape[-len(shape) :] != shape:
        want = ", ".join(["...", *map(str, shape)])
        raise Misfit(f"{_named(signature, index, column)} wants shape ({want}); got {array.shape}")
    return array


def _named(signature: Signature, index: int, column: Column) -> str:
    name = signature.params[index].name or f"argument {index + 1}"
    return f"{signature}: {'.'.join([name, *column.path])}"


def _field(signature: Signature, index: int, column: Column, key: str, value: Any) -> Any:
    if isinstance(value, Mapping):
        if key not in value:
            close = nearest(key, map(str, value))
            hint = f"; did you mean {close!r}?" if close else ""
            raise Misfit(f"{_named(signature, index, column)}: the dict has no {key!r}{hint}")
        return value[key]
    if hasattr(value, key):
        return getattr(value, key)
    got = type(value).__name__
    said = f"a struct is a dict or an object with .{key}; got {got}"
    raise Misfit(f"{_named(signature, index, column)}: {said}")


def _typed(array: Array, column: Column, signature: Signature, index: int) -> Array:
    """`array` in the column's type; ShaderError for values that do not fit it."""
    dtype = column.dtype
    if array.dtype == dtype or array.size == 0:
        return array.astype(dtype, copy=False)
    if array.dtype.kind == "f":
        with np.errstate(over="ignore", invalid="ignore"):
            made = array.astype(dtype)
        if np.isinf(made).any() and (lost := np.isinf(made) & np.isfinite(array)).any():
            value = array[lost].flat[0]
            raise ShaderError(f"{_named(signature, index, column)}: {value} is past the largest float")
        return made
    if dtype.kind in "iu":
        limits = np.iinfo(dtype)
        least, most = int(array.min()), int(array.max())
        if least < limits.min or most > limits.max:
            said = f"{least if least < limits.min else most} does not fit {column.type.scalar}"
            raise ShaderError(f"{_named(signature, index, column)}: {said}")
    return array.astype(dtype)


def words(array: Array) -> npt.NDArray[np.uint32]:
    """A column's array as 32-bit words, flat."""
    flat = array.reshape(-1)
    return flat.astype(np.uint32) if flat.dtype == np.bool_ else flat.view(np.uint32)


def empty_results(plan: Plan, count: int) -> list[npt.NDArray[np.uint32]]:
    """A place for each output column's words, (count, words). LimitError where memory does not suffice."""
    _check_memory(plan.signature, 4 * count * plan.out_words, "give back")
    return [np.empty((count, column.words), np.uint32) for column in plan.out_columns]


def _free_memory() -> float:
    import os

    if not hasattr(os, "sysconf") or "SC_AVPHYS_PAGES" not in os.sysconf_names:
        return float("inf")
    return os.sysconf("SC_AVPHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")


def results_of(plan: Plan, columns: Sequence[npt.NDArray[np.uint32]], lead: tuple[int, ...]) -> Any:
    """Words -> what the caller gets: the returned value, then out and inout in order; one alone stands alone."""
    if len(plan.out_columns) == 1 and not plan.out_columns[0].path:
        return _unpacked(columns[0], plan.out_columns[0], lead)
    arrays = iter([_unpacked(w, c, lead) for w, c in zip(columns, plan.out_columns, strict=True)])
    values = [_assembled({leaf.path: next(arrays) for leaf in leaves}) for _, _, leaves in plan.outputs]
    return values[0] if len(values) == 1 else tuple(values) or None


def _unpacked(raw: Array, column: Column, lead: tuple[int, ...]) -> Array:
    if column.dtype == np.bool_:
        raw = np.not_equal(raw, 0)
    made: Array = raw.view(column.dtype).reshape((*lead, *column.shape))
    return made


def _assembled(leaves: Mapping[tuple[str, ...], Array]) -> Any:
    """Leaves by path -> an array, or nested dicts of them."""
    if () in leaves:
        return leaves[()]
    made: dict[str, Any] = {}
    for key in dict.fromkeys(path[0] for path in leaves):
        made[key] = _assembled({path[1:]: a for path, a in leaves.items() if path[0] == key})
    return made
