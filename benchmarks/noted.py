"""Figures that another program found, noted before this one was written, and how far ours are from them."""

from __future__ import annotations

from benchmarks.figures import Target

WITHIN = 5.0
"""Percent that ours may differ; more must be explained in the text."""


def deviation(ours: float, noted: str) -> float:
    """Percent of the noted figure, as printed: half a unit of its last digit is no difference."""
    value = float(noted)
    decimals = len(noted.partition(".")[2])
    beyond = max(abs(ours - value) - 0.5 * 10.0**-decimals, 0.0)
    return 0.0 if beyond == 0 else 100 * beyond / abs(value) if value else float("inf")


def largest(what: str, deviations: list[float]) -> Target:
    """The promise that none is more than WITHIN off."""
    return Target.at_most(what, max(deviations), WITHIN, " %")
