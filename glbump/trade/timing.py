"""Timing things against each other: one run, taking turns, medians and the spread of their ratios.

Seconds differ from machine to machine and from minute to minute; what two things cost against each other, done in
turns, differs much less. CPU time counts every thread, so it hardly notices what else the machine does.
"""

from __future__ import annotations

import random
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

Call = Callable[[], object]


@dataclass
class Times:
    """Seconds of each turn."""

    wall: list[float] = field(default_factory=list)
    cpu: list[float] = field(default_factory=list)


@dataclass(frozen=True)
class Spread:
    """Median and quartiles."""

    median: float
    low: float
    high: float

    def __str__(self) -> str:
        return f"{self.median:.3g} ({self.low:.3g} to {self.high:.3g})"


def spread(values: Sequence[float]) -> Spread:
    """Median and quartiles of values."""
    low, median, high = (float(v) for v in np.percentile(values, (25, 50, 75)))
    return Spread(median, low, high)


def ratios(times: Sequence[float], base: Sequence[float]) -> Spread:
    """Of each turn's time to the same turn's base, so that what slows a whole turn drops out."""
    return spread([t / b for t, b in zip(times, base, strict=True)])


def differences(times: Sequence[float], base: Sequence[float]) -> Spread:
    """As `ratios`, of differences."""
    return spread([t - b for t, b in zip(times, base, strict=True)])


def own_cpu() -> float:
    """CPU seconds of this process, all threads."""
    return time.process_time()


def in_turns(
    calls: Mapping[str, Call],
    turns: int,
    warm_up: int = 2,
    cpu: Callable[[], float] = own_cpu,
    enough: Callable[[], bool] = lambda: False,
) -> dict[str, Times]:
    """Each call once a turn, in an order of chance that is the same in every run: whatever one leaves behind in the
    caches, each of the others finds it as often. enough: asked after each turn, whether that was the last."""
    for _ in range(warm_up):
        for call in calls.values():
            call()
    times = {name: Times() for name in calls}
    order, chance = list(calls), random.Random(1)
    for _ in range(turns):
        chance.shuffle(order)
        for name in order:
            cpu_started, started = cpu(), time.perf_counter()
            calls[name]()
            times[name].wall.append(time.perf_counter() - started)
            times[name].cpu.append(cpu() - cpu_started)
        if enough():
            break
    return times
