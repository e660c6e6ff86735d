"""Triangles as a mesh file has them, and what its readers share."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from glbump.errors import MeshError

Floats = npt.NDArray[np.float64]
Indices = npt.NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Raw:
    """Triangles as a file has them: every corner names its position, and perhaps its uv and its normal.

    positions (P, 3), uv (Q, 2) with v up, normals (R, 3) of any length; corners, uv_corners, normal_corners:
    (T, 3) rows of those. Without normals the surface is smooth wherever triangles share a position's row.
    tangents: (P, 4) at the positions' rows: x, y, z of any length, and w, the bitangent's side; 0 where there is none.
    """

    positions: Floats
    corners: Indices
    uv: Floats | None = None
    uv_corners: Indices | None = None
    normals: Floats | None = None
    normal_corners: Indices | None = None
    notes: list[str] = field(default_factory=list)
    tangents: Floats | None = None


def check_rows(rows: Indices, count: int, what: str) -> Indices:
    """`rows` when all are within 0..count - 1; MeshError naming the first that is not."""
    wrong = (rows < 0) | (rows >= count)
    if np.any(wrong):
        raise MeshError(
            f"{np.count_nonzero(wrong):,} corners name a {what} that is not there, such as number "
            f"{rows[wrong][0]:,}; there are {count:,}, counted from 0"
        )
    return rows


def facet_normals(positions: Floats, corners: Indices) -> tuple[Floats, Indices]:
    """One normal a triangle, and the rows that give it to all three corners: a faceted surface."""
    a, b, c = (positions[corners[:, k]] for k in range(3))
    rows = np.repeat(np.arange(len(corners)), 3).reshape(-1, 3)
    with np.errstate(over="ignore", invalid="ignore"):  # positions are judged later, all of them together
        return np.cross(b - a, c - a), rows


def fan(counts: Indices, points: Floats, notes: list[str]) -> Indices:
    """(T, 3): polygons as triangles round their first corner, given as rows into the list of all corners.

    counts: corners of each polygon. points: (C, 3), the position of each corner. A four-sided polygon that is
    not convex is cut along its other diagonal; one with more sides is reported in `notes`.
    """
    if np.any(counts < 3):
        raise MeshError(f"face number {int(np.argmax(counts < 3)) + 1:,} has fewer than 3 corners")
    first = np.cumsum(counts) - counts
    face = np.repeat(np.arange(len(counts)), counts - 2)
    step = np.arange(len(face)) - np.repeat(np.cumsum(counts - 2) - (counts - 2), counts - 2)
    turn = np.zeros(len(counts), dtype=np.int64)

    def triangles() -> Indices:
        around = np.stack([np.zeros_like(step), step + 1, step + 2], axis=1)
        return first[face][:, None] + (around + turn[face][:, None]) % counts[face][:, None]

    rows = triangles()
    if np.all(counts == 3):
        return rows
    with np.errstate(over="ignore", invalid="ignore"):
        normals = facet_normals(points, rows)[0]
        whole = np.zeros((len(counts), 3))
        np.add.at(whole, face, normals)
        against = face[np.sum(normals * whole[face], axis=1) < 0]
    turn[against[counts[against] == 4]] = 1
    bent = np.unique(against[counts[against] > 4])
    if len(bent):
        notes.append(f"{len(bent):,} faces of five or more corners are not convex and may be cut wrongly")
    return triangles()


def table(lines: Sequence[str], width: int, what: str) -> Floats:
    """(N, width): the numbers after each line's keyword; more of them are ignored."""
    if not lines:
        return np.zeros((0, width))
    try:
        return np.loadtxt(lines, dtype=np.float64, comments=None, usecols=range(1, width + 1), ndmin=2)
    except (ValueError, IndexError):
        parts = (line.split()[1 : width + 1] for line in lines)
        bad = next((p for p in parts if len(p) < width or not all(map(_is_number, p))), [])
        raise MeshError(f"has a {what} that is not {width} numbers: {' '.join(bad)!r:.60}") from None


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
