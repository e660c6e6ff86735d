"""Which settings of the knobs a trade tries: one knob at a time, then what looks best together; and Pareto fronts."""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable, Iterable, Sequence
from dataclasses import asdict, dataclass, field, fields, replace
from typing import Any, TypeVar

from glbump.errors import GlbumpError
from glbump.plan import Plan
from glbump.quality import KNOBS, PRESETS, Quality
from glbump.scene import Scene

Row = dict[str, Any]
T = TypeVar("T")

BASE, PRESET, KNOB, COMBINATION, FEATURE = "base", "preset", "knob", "combination", "feature"

ALIKE = 0.02
"""Errors and times that differ by less are not told apart when combinations are chosen."""


@dataclass(frozen=True)
class Setting:
    """One setting to measure, or why not. changes: of knobs, from the base. scene: to be drawn in place of the trade's
    own, None for that. skipped: why it is not measured."""

    name: str
    kind: str
    quality: Quality
    changes: dict[str, Any] = field(default_factory=dict)
    scene: Scene | None = None
    skipped: str = ""


def named(changes: dict[str, Any]) -> str:
    """What a setting is called: its knobs, as Quality takes them."""
    return " ".join(f"{knob}={value}" for knob, value in changes.items())


def work(plan: Plan) -> Hashable:
    """What a plan makes a frame of, without its reasons; two plans of the same work draw the same picture as fast.

    A knob's value that a plan merely hands on is no work by itself: where it matters, a choice names it.
    """
    handed_on: dict[str, Any] = {f.name: None for f in fields(plan) if f.name in KNOBS}
    environments = tuple(replace(e, filter="", texture_format="") for e in plan.environments)
    made = replace(plan, **handed_on | {"environments": environments, "choices": ()})
    return made, tuple((c.what, c.value) for c in plan.choices)


def presets(base: Quality) -> list[Setting]:
    """The base, then the presets that are not it."""
    own = asdict(base)
    result = [Setting(base.preset if base == Quality(base.preset) else "base", BASE, base)]
    for name in PRESETS:
        quality = Quality(name)
        changes = {knob: value for knob, value in asdict(quality).items() if knob in KNOBS and value != own[knob]}
        if changes:
            result.append(Setting(name, PRESET, quality, changes))
    return result


def one_at_a_time(base: Quality, plan: Callable[[Quality], Plan]) -> list[Setting]:
    """Each value of each knob, the others as in the base. plan: of a quality; where it is no other work than the
    base's, or than a value's before, the setting is skipped."""
    at_base = work(plan(base))
    settings = []
    for knob, what in KNOBS.items():
        seen: dict[Hashable, Any] = {at_base: None}
        for value in what.values:
            if value == getattr(base, knob):
                continue
            name = named({knob: value})
            try:
                quality = replace(base, **{knob: value})
                does = work(plan(quality))
            except GlbumpError as why:
                settings.append(Setting(name, KNOB, base, {knob: value}, skipped=str(why)))
                continue
            skipped = ""
            if does in seen:
                other = seen[does]
                skipped = "nothing here depends on it" if other is None else f"the same here as {knob}={other}"
            seen.setdefault(does, value)
            settings.append(Setting(name, KNOB, quality, {knob: value}, skipped=skipped))
    return settings


def front(points: Sequence[tuple[float, float]], alike: float = 0.0) -> list[int]:
    """Numbers of the points (cost, error) that no other beats in both, the cheapest first; of equal ones the first.

    alike: share of an error that a dearer point has to win.
    """
    best = math.inf
    kept = []
    for i in sorted(range(len(points)), key=lambda i: (*points[i], i)):
        if points[i][1] < best * (1 - alike) or best == math.inf:
            kept.append(i)
            best = points[i][1]
    return kept


def combinations(
    base: Quality, rows: Iterable[Row], metric: str, count: int, plan: Callable[[Quality], Plan]
) -> list[Setting]:
    """At most `count` settings of two knobs and more that promise most, from rows of the base and of one knob each.

    A knob is taken to multiply the time and to add to the square of the error whatever the others are; on the front
    that follows from this, settings are picked evenly from the cheapest to the nearest to the truth. Knobs that do
    nothing beside the others are left as they are in the base.
    """
    measured = list(rows)
    error = next(row["error"][metric] for row in measured if row["kind"] == BASE)
    of_knob: dict[str, list[Row]] = {}
    for row in measured:
        if row["kind"] == KNOB:
            of_knob.setdefault(next(iter(row["changes"])), []).append(row)
    # Times, squared error, changes: pruned knob by knob, which loses nothing where both only multiply and add.
    kept: list[tuple[float, float, dict[str, Any]]] = [(1.0, error**2, {})]
    for found in of_knob.values():
        tried = list(kept)
        for row in found:
            times, more = _sure(row["cost"]["times"]), row["error"][metric] ** 2 - error**2
            if times < 1 - ALIKE or row["error"][metric] < error * (1 - ALIKE):
                tried += [(t * times, max(e + more, 0.0), c | row["changes"]) for t, e, c in kept]
        kept = [tried[i] for i in front([(t, e) for t, e, _ in tried])]
    several = [changes for _, _, changes in kept if len(changes) > 1]
    settings: dict[Hashable, Setting] = {}
    for changes in _evenly(several, 4 * count):
        try:
            does, changes = _least(base, changes, plan)
        except GlbumpError:
            continue  # Not every value goes with every other.
        if len(changes) > 1:
            settings.setdefault(does, Setting(named(changes), COMBINATION, replace(base, **changes), changes))
    return _evenly(list(settings.values()), count)


def _sure(times: dict[str, float]) -> float:
    """A row's ratio of times; 1 where its quartiles lie on both sides of that."""
    return 1.0 if times["low"] <= 1 <= times["high"] else times["median"]


def _evenly(items: list[T], count: int) -> list[T]:
    """At most `count` of them, from the first to the last."""
    n = min(count, len(items))
    return [items[round(i * (len(items) - 1) / max(n - 1, 1))] for i in range(n)]


def _least(base: Quality, changes: dict[str, Any], plan: Callable[[Quality], Plan]) -> tuple[Hashable, dict[str, Any]]:
    """What a plan does with these changes, and those of them that it takes."""
    does = work(plan(replace(base, **changes)))
    for knob in list(changes):
        fewer = {k: v for k, v in changes.items() if k != knob}
        try:
            if work(plan(replace(base, **fewer))) == does:
                changes = fewer
        except GlbumpError:
            continue  # It goes with the others only so.
    return does, changes
