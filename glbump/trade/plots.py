"""The trade as a picture: time and error of every setting, and the front of those that none beats, as SVG."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from html import escape
from typing import NamedTuple


class Point(NamedTuple):
    """A setting in the plot. series: what it is one of; on_front: whether none beats it."""

    name: str
    series: str
    cost: float
    error: float
    on_front: bool


WIDTH, HEIGHT = 880, 520
_LEFT, _RIGHT, _TOP, _BOTTOM = 70, 190, 16, 48
_COLOURS = (
    "#4477aa",
    "#ee6677",
    "#228833",
    "#ccbb44",
    "#66ccee",
    "#aa3377",
    "#999933",
    "#882255",
    "#44aa99",
    "#bbbbbb",
)
"""Told apart by people of any colour vision (Tol 2021, bright and muted)."""
_STRONG = {"base": "#000000", "preset": "#000000", "combination": "#777777"}


def front_svg(points: Sequence[Point], cost: str, error: str, floor: float = 0.0) -> str:
    """Cost (across) against error (up), both on logarithmic scales; those on the front joined and named.

    cost, error: what the axes say. floor: error that the truth itself leaves open; what lies lower is drawn there.
    """
    shown = [p for p in points if p.cost > 0 and math.isfinite(p.cost) and math.isfinite(p.error)]
    if not shown:
        return _svg(['<text x="20" y="30">nothing was measured</text>'])
    least = min((p.error for p in shown if p.error > 0), default=1.0)
    bottom = max(floor, least / 2, max(p.error for p in shown) * 1e-5)
    x, across = _scale([p.cost for p in shown], _LEFT, WIDTH - _RIGHT)
    y, up = _scale([max(p.error, bottom) for p in shown], HEIGHT - _BOTTOM, _TOP)
    places = {p: (x.of(p.cost), y.of(max(p.error, bottom))) for p in shown}
    parts = [_axes(x, across, y, up, cost, error)]
    if floor > 0 and y.low < floor < y.high:
        at = y.of(floor)
        parts.append(f'<line x1="{_LEFT}" x2="{WIDTH - _RIGHT}" y1="{at:.1f}" y2="{at:.1f}" class="floor"/>')
        parts.append(f'<text x="{_LEFT + 4}" y="{at - 4:.1f}" class="small">what the truth leaves open</text>')
    best = sorted(places[p] for p in shown if p.on_front)
    parts.append(f'<polyline points="{" ".join(f"{a:.1f},{b:.1f}" for a, b in best)}" class="front"/>')
    series = list(dict.fromkeys(p.series for p in shown))
    colours = {s: _STRONG.get(s, _COLOURS[i % len(_COLOURS)]) for i, s in enumerate(series)}
    for p, (a, b) in places.items():
        title = escape(f"{p.name}: {p.cost:.3g} {cost}, {p.error:.3g} {error}")
        radius = 5 if p.on_front else 3.5
        parts.append(
            f'<circle cx="{a:.1f}" cy="{b:.1f}" r="{radius}" fill="{colours[p.series]}"><title>{title}</title></circle>'
        )
    parts += _names([(p.name, *places[p]) for p in shown if p.on_front or p.series in ("base", "preset")])
    for i, name in enumerate(series):
        at = _TOP + 10 + 17 * i
        parts.append(f'<circle cx="{WIDTH - _RIGHT + 20}" cy="{at - 4}" r="4" fill="{colours[name]}"/>')
        parts.append(f'<text x="{WIDTH - _RIGHT + 30}" y="{at}">{escape(name)}</text>')
    return _svg(parts)


class _Scale(NamedTuple):
    """A logarithmic axis from `low` to `high`, at `first` to `last` in the picture."""

    low: float
    high: float
    first: float
    last: float

    def of(self, value: float) -> float:
        share = math.log(value / self.low) / math.log(self.high / self.low)
        return self.first + share * (self.last - self.first)


def _scale(values: Sequence[float], first: float, last: float) -> tuple[_Scale, list[float]]:
    """An axis with some room at its ends, and its marks."""
    low, high = min(values) / 1.15, max(values) * 1.15
    scale = _Scale(low, high, first, last)
    decades = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
    steps = (1, 2, 5) if high / low < 1e3 else (1,)
    return scale, [m * 10.0**d for d in decades for m in steps if low <= m * 10.0**d <= high]


def _axes(x: _Scale, across: Iterable[float], y: _Scale, up: Iterable[float], cost: str, error: str) -> str:
    parts = []
    for mark in across:
        at = x.of(mark)
        parts.append(f'<line x1="{at:.1f}" x2="{at:.1f}" y1="{_TOP}" y2="{HEIGHT - _BOTTOM}" class="grid"/>')
        parts.append(f'<text x="{at:.1f}" y="{HEIGHT - _BOTTOM + 16}" text-anchor="middle">{mark:g}</text>')
    for mark in up:
        at = y.of(mark)
        parts.append(f'<line x1="{_LEFT}" x2="{WIDTH - _RIGHT}" y1="{at:.1f}" y2="{at:.1f}" class="grid"/>')
        parts.append(f'<text x="{_LEFT - 6}" y="{at + 4:.1f}" text-anchor="end">{mark:g}</text>')
    middle, level = (_LEFT + WIDTH - _RIGHT) / 2, (_TOP + HEIGHT - _BOTTOM) / 2
    parts.append(f'<text x="{middle}" y="{HEIGHT - 8}" text-anchor="middle" class="axis">{escape(cost)}</text>')
    turned = f'transform="rotate(-90 16 {level})"'
    parts.append(f'<text x="16" y="{level}" text-anchor="middle" class="axis" {turned}>{escape(error)}</text>')
    return "".join(parts)


def _names(labels: Sequence[tuple[str, float, float]]) -> list[str]:
    """Names beside their points, moved down where they would lie on one another."""
    placed: list[tuple[float, float, float]] = []
    parts = []
    for name, x, y in sorted(labels, key=lambda label: label[2]):
        short = name if len(name) <= 44 else name[:42] + "…"
        width, at = 5.6 * len(short), y - 7
        start = min(x + 7, WIDTH - _RIGHT - width)
        while any(abs(at - b) < 12 and start < a + w and a < start + width for a, b, w in placed):
            at += 12
        placed.append((start, at, width))
        parts.append(f'<text x="{start:.1f}" y="{at:.1f}" class="name">{escape(short)}</text>')
    return parts


_STYLE = (
    "text{font:12px sans-serif;fill:#333}.axis{font-size:13px}.small,.name{font-size:11px}"
    ".name{fill:#000;paint-order:stroke;stroke:#fff;stroke-width:3px}.grid{stroke:#e4e4e4}"
    ".floor{stroke:#c00;stroke-dasharray:4 4}"
    ".front{fill:none;stroke:#444;stroke-width:1.5}circle{stroke:#fff;stroke-width:.7}"
)


def _svg(parts: Iterable[str]) -> str:
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" width="{WIDTH}" height="{HEIGHT}" '
        f'role="img"><style>{_STYLE}</style><rect width="{WIDTH}" height="{HEIGHT}" fill="#fff"/>{"".join(parts)}</svg>'
    )
