"""Arcs of great circles cut at the meridians and parallels of a lat-long grid: exact integrals along them.

The light of a cell on the sphere is the integral of the radiance over d(lambda) dz, z = sin(latitude). By Green's
theorem that is the integral of P d(lambda) around its edge, P(lambda, z) being the light of the meridian lambda north
of z. Over a lat-long picture P is constant in lambda within a column and linear in z within a row. So an arc is cut
where it passes from texel to texel, and each piece counts with its width and with the area between it and the equator,
both in closed form: nothing is sampled.

Longitudes grow along a picture's u: lambda = 2 pi (u - 1/2) = atan2(x, -z). Latitudes come as the tangent of their
half, which keeps all digits at the poles.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

F64 = npt.NDArray[np.float64]
Index = npt.NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class Cells:
    """Lat-long texels: `columns` of one width, the first from longitude `west` on; rows by v, 0 at the north pole.

    row = (v * scale + offset) * rows; the outer rows end at the poles.
    """

    columns: int
    rows: int
    west: float = -np.pi
    scale: float = 1.0
    offset: float = 0.0

    @property
    def step(self) -> float:
        """A column's width in radians."""
        return 2 * np.pi / self.columns

    @cached_property
    def v(self) -> F64:
        """(rows + 1,) the rows' edges, from 0 at the north pole to 1."""
        v = (np.arange(self.rows + 1) / self.rows - self.offset) / self.scale
        v[0], v[-1] = 0.0, 1.0
        return v

    @cached_property
    def z(self) -> F64:
        """(rows + 1,) sines of the edges' latitudes."""
        return np.cos(np.pi * self.v)

    @cached_property
    def thickness(self) -> F64:
        """(rows,) differences of z between a row's edges; without cancellation at the poles."""
        v = self.v
        return 2 * np.sin(np.pi / 2 * (v[1:] + v[:-1])) * np.sin(np.pi / 2 * np.diff(v))

    @cached_property
    def half(self) -> F64:
        """(rows + 1,) tangents of half the edges' latitudes."""
        return np.tan(np.pi / 4 - np.pi / 2 * self.v)

    @cached_property
    def meridians(self) -> tuple[F64, F64]:
        """(columns,) cosine and sine of the longitudes of the columns' west edges."""
        longitude = self.west + self.step * np.arange(self.columns)
        return np.cos(longitude), np.sin(longitude)

    def row(self, half: F64) -> Index:
        """The rows that latitudes lie in."""
        y = ((0.5 - 2 / np.pi * np.arctan(half)) * self.scale + self.offset) * self.rows
        return np.clip(y.astype(np.intp), 0, self.rows - 1)


class Arcs(NamedTuple):
    """Arcs eastwards.

    edge: whose part an arc is; sign: -1 where that edge runs westwards; x0 < x1: longitudes of the ends from column 0's
    west edge on, in columns; half0, half1: latitudes of the ends; a, b, c: normal of the plane, its vertical part last,
    0 where a pole is on the arc; bent: whether the arc has its point nearest a pole between its ends.
    """

    edge: Index
    sign: F64
    x0: F64
    x1: F64
    half0: F64
    half1: F64
    a: F64
    b: F64
    c: F64
    bent: npt.NDArray[np.bool_]


class Pieces(NamedTuple):
    """Parts of arcs, each within one texel.

    column: unwrapped; width: d(lambda), with the arc's sign; below: the part of the width that counts with P at the
    row's lower edge. The rest counts with P at its upper one.
    """

    edge: Index
    column: Index
    row: Index
    width: F64
    below: F64


def turned(angle: F64) -> F64:
    """The angles less whole turns: -pi to pi."""
    return angle - 2 * np.pi * np.rint(angle / (2 * np.pi))


def under(width: F64, half0: F64, half1: F64) -> F64:
    """Integrals of z d(lambda) along arcs of `width` radians of longitude: the areas between them and the equator.

    tan(area / 2) = tan(width / 2) sin(mean latitude) / cos(half the latitudes' difference).
    """
    return 2 * np.arctan(np.tan(width / 2) * (half0 + half1) / (1 + half0 * half1))


def _chosen(arcs: Arcs, at: Index) -> Arcs:
    parts: dict[str, Any] = {name: part[at] for name, part in arcs._asdict().items()}
    return Arcs(**parts)


def _at_tops(arcs: Arcs, cells: Cells) -> Arcs:
    """The arcs cut at their points nearest a pole, so that each rises or falls throughout."""
    at = np.flatnonzero(arcs.bent)
    if not len(at):
        return arcs
    west = _chosen(arcs, at)
    up = np.where(west.half0 + west.half1 > 0, 1.0, -1.0)
    flat = np.hypot(west.a, west.b)
    half = up * flat / (np.hypot(flat, west.c) + west.c)
    middle = 0.5 * (west.x0 + west.x1)
    top = np.arctan2(-up * west.b, -up * west.a) - (cells.west + cells.step * middle)
    x = np.clip(middle + turned(top) / cells.step, west.x0, west.x1)
    x1, half1 = arcs.x1.copy(), arcs.half1.copy()
    x1[at], half1[at] = x, half
    east = west._replace(x0=x, half0=half)
    first = arcs._replace(x1=x1, half1=half1)
    return Arcs(*(np.concatenate(both) for both in zip(first, east, strict=True)))


def _parts(count: Index) -> tuple[Index, Index, Index]:
    """Wholes cut into `count` parts each: of every part its whole and its number in it; of every whole its last."""
    end = np.cumsum(count)
    whole = np.repeat(np.arange(len(count)), count)
    return whole, np.arange(len(whole)) - (end - count)[whole], end - 1


def _ends(starts: F64, last: Index, ends: F64) -> F64:
    """Where parts end: where the next begins, the last where the whole does."""
    result = np.empty_like(starts)
    result[:-1] = starts[1:]
    result[last] = ends
    return result


def pieces(arcs: Arcs, cells: Cells) -> Pieces:
    """The arcs cut where they pass from texel to texel."""
    arcs = _at_tops(arcs, cells)
    arc, column, row, width, area = _by_rows(arcs, _by_columns(arcs, cells), cells)
    below = (cells.z[row] * width - area) / cells.thickness[row]
    sign = arcs.sign[arc]
    return Pieces(arcs.edge[arc], column, row, width * sign, below * sign)


class _Spans(NamedTuple):
    """Parts of arcs within one column each: whose, which, and the ends as in Arcs."""

    arc: Index
    column: Index
    x0: F64
    x1: F64
    half0: F64
    half1: F64


def _by_columns(arcs: Arcs, cells: Cells) -> _Spans:
    first = np.floor(arcs.x0).astype(np.intp)
    arc, nth, last = _parts(np.floor(arcs.x1).astype(np.intp) - first + 1)
    column = first[arc] + nth
    x, half = arcs.x0[arc], arcs.half0[arc]
    cut = np.flatnonzero(nth)
    x[cut] = column[cut]
    half[cut] = _on_meridians(arcs, arc[cut], column[cut], cells)
    return _Spans(arc, column, x, _ends(x, last, arcs.x1), half, _ends(half, last, arcs.half1))


def _by_rows(arcs: Arcs, spans: _Spans, cells: Cells) -> tuple[Index, Index, Index, F64, F64]:
    """Of the spans' parts within one row each: arc, column, row, width and area as in `under`."""
    top = cells.row(spans.half0)
    steps = cells.row(spans.half1) - top
    span, nth, last = _parts(np.abs(steps) + 1)
    arc, column = spans.arc[span], spans.column[span]
    x, half = spans.x0[span], spans.half0[span]
    down = np.sign(steps)[span]
    row = top[span] + down * nth
    cut = np.flatnonzero(nth)
    # The edge just crossed: on the way down the row's upper one.
    edge = row[cut] + (down[cut] < 0)
    crossing = _on_parallels(arcs, arc[cut], edge, down[cut], x[cut], cells)
    x[cut] = np.clip(crossing, x[cut], spans.x1[span[cut]])
    half[cut] = cells.half[edge]
    width = cells.step * (_ends(x, last, spans.x1) - x)
    return arc, column, row, width, under(width, half, _ends(half, last, spans.half1))


def _on_meridians(arcs: Arcs, arc: Index, column: Index, cells: Cells) -> F64:
    """Latitudes where arcs cross the west edges of columns."""
    cosine, sine = cells.meridians
    k, c = column % cells.columns, arcs.c[arc]
    level = arcs.a[arc] * cosine[k] + arcs.b[arc] * sine[k]
    # An arc through a pole lies there on all meridians but those of its ends.
    level = np.where(c > 0, level, -(arcs.half0 + arcs.half1)[arc])
    return -level / (np.sqrt(level * level + c * c) + c)


def _on_parallels(arcs: Arcs, arc: Index, edge: Index, down: Index, near: F64, cells: Cells) -> F64:
    """Longitudes, in columns and next to `near`, where arcs that go up (down < 0) or down cross the edges of rows."""
    a, b, half = arcs.a[arc], arcs.b[arc], cells.half[edge]
    tangent = 2 * half / (1 - half * half)
    cosine = -tangent * arcs.c[arc] / np.maximum(np.hypot(a, b), 1e-300)
    longitude = np.arctan2(b, a) - down * np.arccos(np.clip(cosine, -1, 1))
    return near + turned(longitude - cells.west - cells.step * near) / cells.step
