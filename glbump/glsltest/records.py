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


@dataclass(frozen=True)
class Call:
    """One call: its plan, the shape of its rows, and the array of each input column, (rows or 1, ...)."""

    plan: Plan
    lead: tuple[int, ...]
    columns: tuple[Any, ...]

    def row(self, index: tuple[int, ...]) -> dict[str, Any]:
        """The inputs of one row, by name."""
        flat = int(np.ravel_multi_index(index[: len(self.lead)], self.lead)) if self.lead else 0
        return {name: a[flat if len(a) > 1 else 0] for name, a in zip(self.plan.in_names, self.columns, strict=True)}


_last: deque[tuple[Any, Call]] = deque(maxlen=KEPT)


def remember(result: Any, call: Call) -> None:
    """Keep what gave `result` (an array, a dict of them, or a tuple of either)."""
    _last.extend((array, call) for array in _arrays(result))
    while len(_last) > 1 and sum(array.nbytes for array, _ in _last) > KEPT_BYTES:
        _last.popleft()


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
        for kept, call in reversed(_last):
            if kept is seen and array.shape[: len(call.lead)] == call.lead:
                return call
        seen = seen.base
    return None
