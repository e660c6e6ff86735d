"""What the last calls were given, so that a failed comparison can show the inputs of its worst row."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from glbump.glsltest.wrapper import Plan

KEPT = 16
KEPT_BYTES = 1 << 26


@dataclass(slots=True)  # not frozen: one is made in every call, and freezing costs more than the rest
class Call:
    """One call: its plan, the shape of its rows, and an array for each input column: all rows, or one for all."""

    plan: Plan
    lead: tuple[int, ...]
    columns: tuple[Any, ...]

    def row(self, index: tuple[int, ...]) -> dict[str, Any]:
        """The inputs of one row, by name."""
        flat = int(np.ravel_multi_index(index[: len(self.lead)], self.lead)) if self.lead else 0
        found = {}
        for name, array, column in zip(self.plan.in_names, self.columns, self.plan.in_columns, strict=True):
            rows = array.reshape((-1, *column.shape))
            found[name] = rows[flat if len(rows) > 1 else 0]
        return found


class _Kept:
    """The last results with their calls: so many, and not more than so many bytes."""

    def __init__(self) -> None:
        self.pairs: deque[tuple[Any, Call]] = deque()
        self.bytes = 0

    def add(self, array: Any, call: Call) -> None:
        self.pairs.append((array, call))
        self.bytes += array.nbytes
        while len(self.pairs) > KEPT or (self.bytes > KEPT_BYTES and len(self.pairs) > 1):
            self.bytes -= self.pairs.popleft()[0].nbytes


_kept = _Kept()


def remember(result: Any, call: Call) -> None:
    """Keep what gave `result` (an array, a dict of them, or a tuple of either)."""
    if result.__class__ is np.ndarray:
        _kept.add(result, call)
        return
    for array in _arrays(result):
        _kept.add(array, call)


def _arrays(value: Any) -> Iterator[Any]:
    if isinstance(value, np.ndarray):
        yield value
    elif isinstance(value, Mapping):
        for part in value.values():
            yield from _arrays(part)
    elif isinstance(value, tuple):
        for part in value:
            yield from _arrays(part)


def call_of(array: Any) -> Call | None:
    """The call that gave `array`, or an array it is a view of with the same rows."""
    seen: Any = array
    call: Call
    while isinstance(seen, np.ndarray):
        for kept, call in reversed(_kept.pairs):
            if kept is seen and array.shape[: len(call.lead)] == call.lead:
                return call
        seen = seen.base
    return None
