"""Checks of single values, so that every dataclass refuses bad input in the same words."""

from __future__ import annotations

import math
import os
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from glbump.errors import SceneError, shown, unknown

SHORTEST, LONGEST = 1e-18, 1e18
"""World units. Beyond these, squares leave the range of the GPU's 32-bit floats."""


def _refusal(what: str, allowed: str, got: object) -> SceneError:
    return SceneError(f"{what} must be {allowed}; got {shown(got)}")


def number(
    what: str,
    value: Any,
    *,
    above: float | None = None,
    least: float | None = None,
    most: float | None = None,
) -> float:
    """`value` as a finite float: greater than `above`, within [`least`, `most`]; SceneError otherwise."""
    try:
        # float() would take the first three all the same.
        refused = isinstance(value, bool | str | bytes) or bool(getattr(value, "ndim", None))
        result = math.nan if refused else float(value)
    except (TypeError, ValueError, OverflowError):
        result = math.nan
    if (
        not math.isfinite(result)
        or (above is not None and result <= above)
        or (least is not None and result < least)
        or (most is not None and result > most)
    ):
        limits = (("above", above), ("at least", least), ("at most", most))
        bounds = [f"{word} {limit:g}" for word, limit in limits if limit is not None]
        raise _refusal(what, " ".join(["a finite number", " and ".join(bounds)]).strip(), value)
    return result


def length(what: str, value: Any) -> float:
    """`value` as a length above 0 in world units, SHORTEST..LONGEST; SceneError otherwise."""
    return number(what, value, least=SHORTEST, most=LONGEST)


def integer(what: str, value: Any, *, least: int, most: int) -> int:
    """`value` as an int within [`least`, `most`]; SceneError otherwise."""
    result = number(what, value, least=least, most=most)
    if result != int(result):
        raise _refusal(what, f"a whole number from {least} to {most}", value)
    return int(result)


def flag(what: str, value: Any) -> bool:
    """`value` when it is True or False; SceneError otherwise."""
    if not isinstance(value, bool):
        raise _refusal(what, "true or false", value)
    return value


def choice(what: str, value: Any, allowed: Iterable[str]) -> str:
    """`value` when it is one of `allowed`; SceneError with the nearest right word otherwise."""
    names = list(allowed)
    if not isinstance(value, str) or value not in names:
        raise SceneError(unknown(what, value, names))
    return value


def vector(what: str, value: Any, length: int, **bounds: float | None) -> tuple[float, ...]:
    """`value` as a tuple of `length` finite floats, each within `bounds` as in `number`."""
    items = sequence(value)
    if items is None or len(items) != length:
        raise _refusal(what, f"{length} numbers", value)
    return tuple(number(f"{what}[{i}]", v, **bounds) for i, v in enumerate(items))


def sequence(value: Any) -> list[Any] | None:
    """The items of a list, a tuple, an array or their like; None for what has no items, or none in order."""
    if isinstance(value, str | bytes | dict | set | frozenset):
        return None
    try:
        return list(value) if len(value) < 1_000_000 else None
    except TypeError:
        return None


def point(what: str, value: Any) -> tuple[float, ...]:
    """`value` as a tuple of three floats, none farther from 0 than LONGEST; SceneError otherwise."""
    return vector(what, value, 3, least=-LONGEST, most=LONGEST)


def path(what: str, value: Any) -> Path:
    """`value` as a Path; SceneError for what is none."""
    if not isinstance(value, str | os.PathLike):
        raise _refusal(what, "a path", value)
    return Path(value)


def instance(what: str, value: Any, kinds: type | Sequence[type]) -> Any:
    """`value` when it is an instance of one of `kinds`; SceneError naming them otherwise."""
    allowed = (kinds,) if isinstance(kinds, type) else tuple(kinds)
    if not isinstance(value, allowed):
        names = ", ".join(k.__name__ for k in allowed)
        raise _refusal(what, f"one of {names}" if len(allowed) > 1 else f"a {names}", value)
    return value
