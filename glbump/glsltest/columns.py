"""A GLSL value as columns of 32-bit words: one column for each number, vector, matrix or array of them in it.

A row of a column is its words, in NumPy's order: arrays outermost, matrices [row, column]. A struct is one
column for each of its fields; an array of structs, one column for each field, with the array's size first.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from math import prod
from typing import Any

import numpy as np
import numpy.typing as npt

from glbump.errors import ShaderError
from glbump.glsltest.declarations import Type

DTYPES: dict[str, npt.DTypeLike] = {
    "float": np.float32,
    "int": np.int32,
    "uint": np.uint32,
    "bool": np.bool_,
    "double": np.float64,
}
_READ = {
    "float": "uintBitsToFloat({0})",
    "int": "int({0})",
    "uint": "{0}",
    "bool": "({0} != 0u)",
    "double": "packDouble2x32(uvec2({0}, {1}))",
}
_WRITE = {
    "float": "floatBitsToUint({0})",
    "int": "uint({0})",
    "uint": "{0}",
    "bool": "uint({0})",
    "double": "unpackDouble2x32({0})",
}


@dataclass(frozen=True)
class Column:
    """One leaf of a GLSL value.

    path: where it is in the Python value (field names); type: of one element; pieces: the array sizes and
    fields that lead to it in GLSL, in order.
    """

    path: tuple[str, ...]
    type: Type
    pieces: tuple[int | str, ...]

    @cached_property
    def dims(self) -> tuple[int, ...]:
        """All array sizes on the way."""
        return tuple(p for p in self.pieces if isinstance(p, int))

    @cached_property
    def shape(self) -> tuple[int, ...]:
        """NumPy shape of one row."""
        return (*self.dims, *self.type.tail)

    @cached_property
    def dtype(self) -> np.dtype[Any]:
        return np.dtype(DTYPES[self.type.scalar])

    @cached_property
    def element_words(self) -> int:
        return prod(self.type.tail) * (2 if self.type.scalar == "double" else 1)

    @cached_property
    def words(self) -> int:
        """32-bit words of one row."""
        return prod(self.dims) * self.element_words


def columns_of(kind: Type, what: str = "value") -> list[Column]:
    """The columns of a type; ShaderError for what cannot be a plain value (`what` names it)."""
    return list(_columns(kind, (), (), what))


def _columns(kind: Type, path: tuple[str, ...], pieces: tuple[int | str, ...], what: str) -> Iterator[Column]:
    if 0 in kind.dims:
        raise ShaderError(f"{what} is an array without a size; give it one")
    here = (*pieces, *kind.dims)
    if kind.fields:
        for name, part in kind.fields:
            yield from _columns(part, (*path, name), (*here, name), f"{what}.{name}")
    elif kind.scalar in DTYPES:
        yield Column(path, kind.element, here)
    else:
        raise ShaderError(f"{what} is a {kind}: only numbers, and structs and arrays of them, are values")


def _loops(column: Column, prefix: str, variable: str) -> tuple[str, str, str]:
    """GLSL loops over a column's arrays: their opening, the element, and its index among the elements."""
    opening, element, index = "", variable, "0"
    depth = 0
    for piece in column.pieces:
        if isinstance(piece, str):
            element += f".{piece}"
            continue
        i = f"{prefix}i{depth}"
        opening += f"for (int {i} = 0; {i} < {piece}; ++{i}) "
        element += f"[{i}]"
        index = i if index == "0" else f"({index}) * {piece} + {i}"
        depth += 1
    return opening, element, index


def reading(column: Column, prefix: str, variable: str, start: str) -> str:
    """GLSL that fills `variable`'s column from words `start`, start + 1, ..."""
    opening, element, index = _loops(column, prefix, variable)
    size = column.element_words
    at = f"{start} + ({index}) * {size}"
    order = list(range(prod(column.type.tail)))
    if len(column.type.tail) == 2:  # GLSL's constructor takes a matrix column by column
        rows, columns = column.type.tail
        order = [r * columns + c for c in range(columns) for r in range(rows)]
    step = 2 if column.type.scalar == "double" else 1
    parts = [
        _READ[column.type.scalar].format(*(f"{prefix}word({at} + {k * step + w})" for w in range(step))) for k in order
    ]
    return f"{opening}{{ {element} = {column.type.name}({', '.join(parts)}); }}"


def writing(column: Column, prefix: str, variable: str, start: str) -> str:
    """GLSL that stores `variable`'s column to words `start`, start + 1, ..."""
    opening, element, index = _loops(column, prefix, variable)
    at = f"{start} + ({index}) * {column.element_words}"
    tail = column.type.tail
    if not tail:
        parts = [element]
    elif len(tail) == 1:
        parts = [f"{element}[{k}]" for k in range(tail[0])]
    else:
        parts = [f"{element}[{c}][{r}]" for r in range(tail[0]) for c in range(tail[1])]
    body = ""
    for k, part in enumerate(parts):
        word = _WRITE[column.type.scalar].format(part)
        if column.type.scalar == "double":
            body += f"{prefix}put({at} + {2 * k}, {word}[0]); {prefix}put({at} + {2 * k + 1}, {word}[1]); "
        else:
            body += f"{prefix}put({at} + {k}, {word}); "
    return f"{opening}{{ {body}}}"
