"""Mesh files -> Mesh: triangles with normals, and with uv, dp/du and dp/dv where the file has uv.

Nothing is welded, smoothed or repaired. What cannot be drawn as the file says is an error, or stands in
`Mesh.notes`: triangles without area (they cover no pixel, and are left out), without area in uv, and the like.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import replace
from importlib import import_module
from pathlib import Path

import numpy as np
import numpy.typing as npt

from glbump.errors import LimitError, MeshError, unknown
from glbump.mesh import Mesh
from glbump.meshformats.raw import Floats, Indices, Raw
from glbump.shapes import MeshData
from glbump.validate import LONGEST

MOST_BYTES = 2_000_000_000

_FORMATS = ("obj", "ply", "stl", "glb")


def load_mesh(path: str | os.PathLike[str]) -> Mesh:
    """The triangles of an OBJ, PLY, STL or GLB file.

    normals: the file's, or by angle-weighted means over triangles that share a position, or one per triangle
    where the format has it so (STL, and GLB without normals). dpdu, dpdv, dndu, dndv: real partial derivatives of
    position and normal, angle-weighted means over the triangles round a vertex; vertices are split where the uv on one
    side are mirrored, so no mean goes across. They are 0 where uv have no area, and bumps have no meaning. tangents: a
    GLB's.

    Raises MeshError, one line, for a file that is missing, damaged, of another kind, or has nothing to draw,
    and LimitError for one that is too large.
    """
    file = Path(path)
    try:
        kind = file.suffix.lower().removeprefix(".")
        if kind == "gltf":
            raise MeshError("is glTF in several files; export it as one .glb")
        if kind not in _FORMATS:
            raise MeshError(unknown("kind of mesh file", file.suffix, [f".{name}" for name in _FORMATS]))
        data = _bytes(file)
        # Imported when needed: a scene of spheres reads none of them.
        read: Callable[[bytes], Raw] = getattr(import_module(f"glbump.meshformats.{kind}"), f"read_{kind}")
        return _mesh(read(data))
    except (MeshError, LimitError) as why:
        raise type(why)(f"{file}: {why}") from None


def mesh_of(data: MeshData) -> Mesh:
    """The triangles of arrays, with what `load_mesh` finds of a file's. MeshError where there is nothing to draw."""
    positions, rows = np.asarray(data.positions), np.asarray(data.triangles)
    uv, normals = (None if values is None else np.asarray(values) for values in (data.uv, data.normals))
    try:
        return _mesh(Raw(positions, rows, uv, rows, normals, rows))
    except MeshError as why:
        raise MeshError(f"{data.name}: {why}") from None


def _bytes(file: Path) -> bytes:
    try:
        if file.is_dir():
            raise MeshError("is a folder; name the mesh file in it")
        if not file.exists():
            raise MeshError("there is no such mesh file")
        if not file.is_file():
            raise MeshError("is no ordinary file")
        if file.stat().st_size > MOST_BYTES:
            raise LimitError(f"has {file.stat().st_size:,} bytes; at most {MOST_BYTES:,} are read")
        data = file.read_bytes()
    except (OSError, ValueError) as why:
        raise MeshError(f"cannot be read: {getattr(why, 'strerror', None) or why}") from None
    if not data:
        raise MeshError("is empty")
    return data


def _check_finite(values: Floats, what: str) -> None:
    wrong = ~np.all(np.abs(values) <= LONGEST, axis=1)  # NaN compares false
    if np.any(wrong):
        row = int(np.argmax(wrong))
        numbers = ", ".join(f"{x:g}" for x in values[row])
        raise MeshError(
            f"{np.count_nonzero(wrong):,} of {len(values):,} {what} are not finite, or beyond {LONGEST:g}; "
            f"the first is number {row:,}, ({numbers})"
        )


def _mesh(raw: Raw) -> Mesh:
    notes = list(raw.notes)
    if not len(raw.corners):
        raise MeshError("has no triangles")
    _check_finite(raw.positions, "vertices")
    if raw.uv is not None:
        _check_finite(raw.uv, "texture coordinates")
    if raw.tangents is not None:
        _check_finite(raw.tangents, "tangents")
    raw, angles = _with_area(raw, notes)
    normals, normal_rows = _normals(raw, angles, notes)
    tangents = _tangents(raw, normals[normal_rows], notes)

    # A vertex is what a corner says of position, uv, normal, and of the side the uv are seen from.
    keys: list[Indices] = [raw.corners, _by_value(normals, normal_rows, raw.corners)]
    if raw.uv is not None and raw.uv_corners is not None and tangents is not None:
        keys += [
            _by_value(raw.uv, raw.uv_corners, raw.corners),
            np.broadcast_to(tangents[-1][:, None], raw.corners.shape),
        ]
    first, triangles = _distinct([key.reshape(-1) for key in keys])
    triangles = triangles.reshape(-1, 3)
    uv = dpdu = dpdv = dndu = dndv = own = None
    if raw.uv is not None and raw.uv_corners is not None and tangents is not None:
        uv = raw.uv[raw.uv_corners.reshape(-1)[first]]
        weights = angles * np.abs(tangents[-1])[:, None]
        dpdu, dpdv, dndu, dndv = (_mean(triangles, weights, values, len(first)) for values in tangents[:-1])
        own = None if raw.tangents is None else _own_tangents(raw.tangents, raw.corners, notes)
    return Mesh(
        raw.positions[raw.corners.reshape(-1)[first]],
        triangles.astype(np.int32),
        normals[normal_rows.reshape(-1)[first]],
        uv,
        dpdu,
        dpdv,
        dndu,
        dndv,
        own,
        tuple(notes),
    )


def _by_value(values: Floats, rows: Indices, corners: Indices) -> Indices:
    """`rows`, with one number for all rows that hold the same: many programs write a row for each corner."""
    if np.array_equal(rows, corners):
        return rows
    values = np.ascontiguousarray(values)
    whole_rows = values.view(np.dtype((np.void, values.itemsize * values.shape[1]))).reshape(-1)
    same: Indices = np.unique(whole_rows, return_inverse=True)[1][rows]
    return same


def _distinct(keys: list[Indices]) -> tuple[Indices, Indices]:
    """Like np.unique of the keys together: where each distinct one is first, and for each its number."""
    whole, count = keys[0], int(keys[0].max()) + 1
    for key in keys[1:]:
        low, span = int(key.min()), int(np.ptp(key)) + 1
        if span == 1 or np.array_equal(key, keys[0]):
            continue
        if count * span > 2**62:
            whole = np.unique(whole, return_inverse=True)[1]
            count = int(whole.max()) + 1
        whole, count = whole * span + (key - low), count * span
    _, first, number = np.unique(whole, return_index=True, return_inverse=True)
    return first, number


def _with_area(raw: Raw, notes: list[str]) -> tuple[Raw, Floats]:
    """Without triangles that have no area, and the angles (T, 3) at the corners of the others."""
    p = raw.positions[raw.corners]
    edges = np.roll(p, -1, axis=1) - p  # corner k to corner k + 1
    lengths = np.linalg.norm(edges, axis=2)
    area = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1)
    # 1e-12 of the longest edge: the rounding of positions given with 32 bits is 6e-8 of them.
    keep = area > 1e-12 * lengths.max(axis=1) ** 2
    if not np.any(keep):
        raise MeshError(f"has {len(keep):,} triangles, and none of them has an area")
    if not np.all(keep):
        notes.append(f"{np.count_nonzero(~keep):,} of {len(keep):,} triangles have no area; they are left out")

    def kept(rows: Indices | None) -> Indices | None:
        return None if rows is None else rows[keep]

    edges, area = edges[keep], area[keep]
    back = -np.roll(edges, 1, axis=1)
    angles = np.arctan2(area[:, None], np.sum(edges * back, axis=2))
    kept_corners = kept(raw.uv_corners), kept(raw.normal_corners)
    thinner = replace(raw, corners=raw.corners[keep], uv_corners=kept_corners[0], normal_corners=kept_corners[1])
    return thinner, angles


def _mean(rows: Indices, weights: Floats, values: Floats, count: int) -> Floats:
    """(count, 3): weighted means of what each triangle says, over the corners at each row; 0 where no weight is."""
    at, by = rows.reshape(-1), weights.reshape(-1)
    each = np.repeat(values, 3, axis=0) * by[:, None]
    total = np.bincount(at, by, count)
    sums = np.stack([np.bincount(at, each[:, k], count) for k in range(3)], axis=1)
    return sums / np.where(total > 0, total, 1)[:, None]


def _facets(raw: Raw) -> Floats:
    a, b, c = (raw.positions[raw.corners[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    return normals / np.linalg.norm(normals, axis=1, keepdims=True)


def _normals(raw: Raw, angles: Floats, notes: list[str]) -> tuple[Floats, Indices]:
    """Unit normals, and the row of each corner; where there is none, that of a triangle which has one there."""
    facets = _facets(raw)
    if raw.normals is not None and raw.normal_corners is not None:
        rows = raw.normal_corners
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            normals = raw.normals / np.abs(raw.normals).max(axis=1, keepdims=True)
    else:
        rows = raw.corners
        normals = _mean(rows, angles, facets, len(raw.positions))
    with np.errstate(invalid="ignore"):
        lengths = np.linalg.norm(normals, axis=1)
        good = lengths > 1e-6
    used = np.zeros(len(normals), dtype=bool)
    used[rows] = True
    bad = used & ~good
    if np.any(bad):
        notes.append(
            f"{np.count_nonzero(bad):,} of {np.count_nonzero(used):,} normals have no direction; "
            "those of a triangle there are taken"
        )
    normals = np.where(good[:, None], normals, 0) / np.where(good, lengths, 1)[:, None]
    spoiled = bad[rows]
    normals[rows[spoiled]] = np.repeat(facets, 3, axis=0).reshape(-1, 3, 3)[spoiled]
    return normals, rows


def _tangents(
    raw: Raw, normals: Floats, notes: list[str]
) -> tuple[Floats, Floats, Floats, Floats, npt.NDArray[np.int64]] | None:
    """dp/du, dp/dv, dn/du and dn/dv (T, 3) of each triangle, and the sign of its area in uv: -1 where mirrored, 0 where
    none. normals: (T, 3, 3) at the corners; between them the normal is linear, before it is made a unit."""
    if raw.uv is None or raw.uv_corners is None:
        return None
    s, t, r = (raw.uv[raw.uv_corners[:, k]] for k in range(3))
    (u1, v1), (u2, v2) = (t - s).T, (r - s).T
    area = u1 * v2 - u2 * v1
    sign = np.sign(area).astype(np.int64)
    sign[np.abs(area) <= 1e-12 * np.maximum(np.hypot(u1, v1), np.hypot(u2, v2)) ** 2] = 0
    if np.any(sign == 0):
        notes.append(
            f"{np.count_nonzero(sign == 0):,} of {len(sign):,} triangles have no area in uv; bumps do not show on them"
        )
    scale = 1 / np.where(sign == 0, 1, area)[:, None]
    flat = sign == 0

    def derivatives(values: Floats) -> tuple[Floats, Floats]:
        first, second = values[:, 1] - values[:, 0], values[:, 2] - values[:, 0]
        by_u = (first * v2[:, None] - second * v1[:, None]) * scale
        by_v = (second * u1[:, None] - first * u2[:, None]) * scale
        by_u[flat], by_v[flat] = 0, 0
        return by_u, by_v

    return *derivatives(raw.positions[raw.corners]), *derivatives(normals), sign


def _own_tangents(tangents: Floats, corners: Indices, notes: list[str]) -> npt.NDArray[np.float32]:
    """(T, 3, 4): unit tangents and w at the triangles' corners, 0 where the file has none that mean anything."""
    at = np.abs(tangents[:, :3]).max(axis=1, keepdims=True)
    with np.errstate(invalid="ignore", divide="ignore"):
        near_1 = tangents[:, :3] / at
        units = near_1 / np.linalg.norm(near_1, axis=1, keepdims=True)
    good = (at[:, 0] > 0) & (np.abs(np.abs(tangents[:, 3]) - 1) < 1e-3)
    bad = np.unique(corners[np.any(tangents != 0, axis=1)[corners] & ~good[corners]])
    if len(bad):
        notes.append(
            f"{len(bad):,} of {len(np.unique(corners)):,} tangents have no direction, or another w than 1 and -1; "
            "MikkTSpace's are taken there"
        )
    own = np.column_stack([units, np.sign(tangents[:, 3])])
    return np.where(good[:, None], own, 0).astype(np.float32)[corners]
