"""A call like the last one: the same function, way and shapes, so only numbers move.

Small calls are what tests make by the thousand, and most of their time would go into finding out what they are.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import moderngl
import numpy as np

from glbump.glsltest.arguments import Array, results_of
from glbump.glsltest.runners import ComputeRunner
from glbump.glsltest.wrapper import HEADER, LOCAL_SIZE

# Words of a block below which one copy and one write cost less than a write for each argument.
SMALL = 1 << 14


class Again:
    """The layout of one call with compute: `run` repeats it with other numbers of the same shapes and types."""

    def __init__(self, runner: ComputeRunner, arguments: tuple[Array, ...], lead: tuple[int, ...], rows: int) -> None:
        plan = runner.plan
        self.runner, self.lead, self.rows = runner, lead, rows
        self._taken = [(a.shape, a.dtype) for a in arguments]
        head = HEADER + 2 * len(arguments)
        self._block = np.zeros(head + sum(a.size for a in arguments), np.uint32)
        self._block[0] = rows
        self._views: list[Array] = []
        at = head
        for i, (a, column) in enumerate(zip(arguments, plan.in_columns, strict=True)):
            self._block[HEADER + 2 * i] = at
            self._block[HEADER + 2 * i + 1] = 0 if a.shape == column.shape else column.words
            words = self._block[at : at + a.size]
            self._views.append((words if a.dtype == np.bool_ else words.view(a.dtype)).reshape(a.shape))
            at += a.size
        ends = np.cumsum([0, *(rows * column.words for column in plan.out_columns)]).tolist()
        self._parts = list(pairwise(ends))
        only = plan.out_columns[0]
        plain = len(plan.out_columns) == 1 and not only.path and only.dtype != np.bool_
        self._alone = (only.dtype, (*lead, *only.shape)) if plain else None
        self._out_words = rows * plan.out_words
        self._groups = -(-rows // LOCAL_SIZE)

    @staticmethod
    def fits(runner: Any, arguments: tuple[Any, ...], lead: tuple[int, ...]) -> bool:
        """Whether a call can be repeated so: plain small arrays, each of all rows or of one for all, nothing extra."""
        plan = getattr(runner, "plan", None)
        if not isinstance(runner, ComputeRunner) or plan is None or plan.extra or plan.samplers or not plan.out_columns:
            return False
        if any(column.path for column in plan.in_columns) or len(arguments) != len(plan.in_columns):
            return False
        plain = all(
            a.__class__ is np.ndarray
            and a.dtype == c.dtype
            and a.dtype.itemsize <= 4
            and a.shape in (c.shape, lead + c.shape)
            for a, c in zip(arguments, plan.in_columns, strict=True)
        )
        return plain and 0 < sum(a.size for a in arguments) <= SMALL

    def takes(self, arguments: tuple[Any, ...]) -> bool:
        """Whether these are arrays of the same shapes and types."""
        if self.runner.released or len(arguments) != len(self._taken):
            return False
        for a, (shape, dtype) in zip(arguments, self._taken):
            if a.__class__ is not np.ndarray or a.shape != shape or a.dtype != dtype:
                return False
        return True

    def run(self, arguments: tuple[Array, ...]) -> Any:
        """The results, as the ordinary call gives them."""
        runner = self.runner
        for view, a in zip(self._views, arguments):
            view[...] = a
        block = self._block
        block[1] = runner.next_token()
        taken = runner.arena.buffer("in", block.nbytes)
        given = runner.arena.buffer("out", 4 * self._out_words + 4)
        taken.write(block)
        taken.bind_to_storage_buffer(0)
        given.bind_to_storage_buffer(1)
        runner.program.run(self._groups)
        runner.gl.memory_barrier(moderngl.BUFFER_UPDATE_BARRIER_BIT)
        raw = np.empty(self._out_words + 1, np.uint32)
        given.read_into(raw, raw.nbytes)
        if raw[-1] != runner.token:
            raise runner.unwritten()
        runner.check_errors()
        if self._alone is not None:
            dtype, shape = self._alone
            return raw[:-1].view(dtype).reshape(shape)
        return results_of(runner.plan, [raw[a:b] for a, b in self._parts], self.lead)
