"""Tangents of triangle meshes by MikkTSpace, the convention in which normal maps are baked.

M. S. Mikkelsen, Simulation of Wrinkled Surfaces Revisited, 2008, and its reference program, mikktspace.c. A normal
map comes out right only in the frames that it was made in, so what counts here is to answer as the program does:
in 32-bit floats, operation by operation, because which triangles share a tangent, and where that of a sliver points,
hangs on their rounding. Two things differ, where the program itself leaves its rules. It does not sort the last
vertex's edges, and so may miss neighbours there, by the order of the triangles; and squares that underflow in a very
small mesh lose tangents. Here all edges are sorted, and the mesh is first brought near 1 by a power of two, which
changes no digit.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from glbump.errors import MeshError
from glbump.mesh import Mesh
from glbump.validate import LONGEST

F32 = npt.NDArray[np.float32]
Indices = npt.NDArray[np.int64]
Bools = npt.NDArray[np.bool_]

_TINY = np.finfo(np.float32).tiny


class CornerTangents(NamedTuple):
    """What a normal map's x and y axes are at each corner of each triangle.

    tangents: (T, 3, 4) float32: x, y, z at right angles to the normal and of unit length (0 where every tangent there
    is along the normal), then w, +1, or -1 where uv are mirrored: the bitangent is w cross(normal, tangent).
    groups: (T, 3) the same number for corners that share one tangent; -1 where uv give none: no area, and no neighbour
    to take one from. The tangent is then (1, 0, 0) and w -1.
    """

    tangents: F32
    groups: Indices


class _Triangles(NamedTuple):
    """Triangles with three different positions. s, t: (T, 3, 3), their unit dp/du, dp/dv in the plane at right angles
    to each corner's normal; angles (T, 3) in that plane; mirrored (T,); sound (T,), whether s, t and mirrored mean
    anything, or uv have no area; vertices (T, 3), a number for each position, normal and uv."""

    vertices: Indices
    s: F32
    t: F32
    angles: F32
    mirrored: Bools
    sound: Bools


def corner_tangents(positions: npt.ArrayLike, normals: npt.ArrayLike, uv: npt.ArrayLike) -> CornerTangents:
    """MikkTSpace tangents of triangles that are joined wherever corners have the same position, normal and uv.

    positions, normals (T, 3, 3), unit normals; uv (T, 3, 2), v up: values at the corners, rounded to 32-bit floats.
    Triangles round a vertex share a tangent, the mean of theirs weighted by angle, as far as they are joined by edges
    and their uv are turned the same way. Triangles without area in uv go with the first group that meets them; those
    with two corners in one place take the tangent of another triangle that has the same vertex.
    Raises MeshError for shapes other than these, and for values that are not finite, or beyond LONGEST.
    """
    p, n, st = _checked(positions, normals, uv)
    count = len(p)
    tangents = np.tile(np.array([1, 0, 0, -1], np.float32), (3 * count, 1))
    groups = np.full(3 * count, -1)
    corners = np.concatenate([p, n, st], axis=2).reshape(-1, 8)
    vertices = _numbered(corners.view(np.uint64).T)[0].reshape(-1, 3)
    good = ~np.any(np.all(p == np.roll(p, -1, axis=1), axis=2), axis=1)
    if np.any(good):
        rows = np.flatnonzero(np.repeat(good, 3))
        found, of = _grouped(_measured(vertices[good], p[good], n[good], st[good]))
        tangents[rows], groups[rows] = found, np.where(of < 0, -1, rows[of])
        first = np.full(int(vertices.max()) + 1, 3 * count)
        np.minimum.at(first, vertices.reshape(-1)[rows], rows)
        alone = np.flatnonzero(np.repeat(~good, 3))
        like = first[vertices.reshape(-1)[alone]]
        alone, like = alone[like < 3 * count], like[like < 3 * count]
        tangents[alone], groups[alone] = tangents[like], groups[like]
    return CornerTangents(tangents.reshape(count, 3, 4), groups.reshape(count, 3))


def normal_mapped(mesh: Mesh) -> Mesh:
    """The mesh with a normal map's axes for dp/du and dp/dv: tangents, and w cross(normal, tangent), at each vertex.

    They are the file's where it has some, and MikkTSpace's elsewhere; 0 where uv have no area, as dp/du is. Vertices
    are doubled where triangles that meet there share no tangent. All are as long as the mesh is large, so that they
    stay in the range of 32-bit floats in its units. A mesh without uv or normals is left as it is.
    """
    if mesh.uv is None or mesh.normals is None or mesh.dpdu is None:
        return mesh
    rows = mesh.triangles
    tangents = np.zeros((*rows.shape, 4), np.float32) if mesh.tangents is None else mesh.tangents
    missing = ~np.any(tangents != 0, axis=2)
    if np.any(missing):
        found = corner_tangents(mesh.positions[rows], mesh.normals[rows], mesh.uv[rows]).tangents
        flat = ~np.any(mesh.dpdu != 0, axis=1)[rows]
        tangents = np.where(missing[..., None], np.where(flat[..., None], 0, found), tangents)
    columns = np.ascontiguousarray(tangents).reshape(-1, 4).view(np.uint64).T
    triangles, first = _numbered(np.stack([rows.reshape(-1).astype(np.uint64), *columns]))
    vertices, at = rows.reshape(-1)[first], tangents.reshape(-1, 4)[first].astype(np.float64)
    size = np.ptp(mesh.positions, axis=0).max()
    normals = mesh.normals[vertices]
    return replace(
        mesh,
        dndu=None,
        dndv=None,
        positions=mesh.positions[vertices],
        triangles=triangles.reshape(-1, 3).astype(np.int32),
        normals=normals,
        uv=mesh.uv[vertices],
        dpdu=size * at[:, :3],
        dpdv=size * at[:, 3:] * np.cross(normals, at[:, :3]),
    )


def _checked(*arrays: npt.ArrayLike) -> list[F32]:
    names, widths = ("positions", "normals", "texture coordinates"), (3, 3, 2)
    values = [np.asarray(array, np.float64) for array in arrays]
    for name, value, width in zip(names, values, widths):
        if value.shape != (*values[0].shape[:1], 3, width):
            raise MeshError(f"tangents need {name} of shape (triangles, 3, {width}); got {value.shape}")
        wrong = ~np.all(np.abs(value) <= LONGEST, axis=2)  # NaN compares false
        if np.any(wrong):
            corner = int(np.argmax(wrong))
            numbers = ", ".join(f"{x:g}" for x in value.reshape(-1, width)[corner])
            raise MeshError(
                f"tangents need finite {name}, none beyond {LONGEST:g}; corner {corner % 3} of triangle "
                f"{corner // 3:,} has ({numbers})"
            )
    # Lengths of products of uv and position are squared: near 1, neither overflows.
    largest = np.abs(values[0]).max(initial=0)
    values[0] = np.ldexp(values[0], -int(np.frexp(largest)[1]))
    return [value.astype(np.float32) + np.float32(0) for value in values]  # -0 is 0


def _numbered(columns: npt.NDArray[np.uint64]) -> tuple[Indices, Indices]:
    """A number, from 0, for each of N things, the same for those with the same values in columns (K, N); and for each
    number the first that has it."""
    order = np.lexsort(columns)
    new = np.ones(len(order), bool)
    new[1:] = np.any(np.diff(columns[:, order], axis=1) != 0, axis=0)
    numbers = np.empty(len(order), np.int64)
    numbers[order] = np.cumsum(new) - 1
    return numbers, order[new]


def _dot(a: F32, b: F32) -> F32:
    # Written out: the order of the sums is the reference program's.
    return a[..., 0] * b[..., 0] + a[..., 1] * b[..., 1] + a[..., 2] * b[..., 2]


def _unit(v: F32) -> F32:
    length = np.sqrt(_dot(v, v))[..., None]
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(length > 0, (1 / length) * v, 0)


def _in_plane(v: F32, n: F32) -> F32:
    return _unit(v - _dot(n, v)[..., None] * n)


@np.errstate(under="ignore", over="ignore")
def _measured(vertices: Indices, p: F32, n: F32, st: F32) -> _Triangles:
    along, beyond = p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]
    (u1, v1), (u2, v2) = (st[:, 1] - st[:, 0]).T[..., None], (st[:, 2] - st[:, 0]).T[..., None]
    area = u1 * v2 - v1 * u2
    s, t = v2 * along - v1 * beyond, -u2 * along + u1 * beyond  # times area: Mikkelsen 2008, equations 18 and 19
    sound = np.abs(area[:, 0]) > _TINY
    for derivative in (s, t):
        size = np.sqrt(_dot(derivative, derivative))
        sound &= size / np.where(sound, np.abs(area[:, 0]), 1) > _TINY
    mirrored = ~(area[:, 0] > 0)
    turn = np.where(mirrored, np.float32(-1), np.float32(1))[:, None]
    s, t = turn * _unit(s), turn * _unit(t)
    back, ahead = (_in_plane(np.roll(p, k, axis=1) - p, n) for k in (1, -1))
    cosines = np.clip(_dot(back, ahead), -1, 1)
    angles = np.arccos(cosines.astype(np.float64)).astype(np.float32)
    return _Triangles(vertices, _in_plane(s[:, None], n), _in_plane(t[:, None], n), angles, mirrored, sound)


def _neighbours(vertices: Indices) -> tuple[Indices, Indices]:
    """For each corner the one at the same vertex across the edge ahead of it, and across the edge behind; -1: none.

    Of more than two triangles along an edge, the first in one direction goes with the first in the other, and so on.
    """
    a, b = vertices.reshape(-1), np.roll(vertices, -1, axis=1).reshape(-1)
    forward = a < b
    edges = np.minimum(a, b) * (int(vertices.max()) + 1) + np.maximum(a, b)
    order = np.argsort(2 * edges + forward, kind="stable")
    edges, forward = edges[order], forward[order]

    def run_start(changes: Bools) -> Indices:
        at = np.concatenate([[True], changes])
        return np.flatnonzero(at)[np.cumsum(at) - 1]

    new_edge = np.diff(edges) != 0
    rank = np.arange(len(order)) - run_start(new_edge | np.diff(forward))
    place = run_start(new_edge) + rank
    pairs = np.full((2, len(order)), -1)
    pairs[forward.astype(np.int64), place] = order
    c, d = pairs[:, np.all(pairs >= 0, axis=0)]
    ahead, behind = np.full((2, len(order)), -1)
    corner = np.arange(len(order))
    following = corner - corner % 3 + (corner + 1) % 3
    for one, other in ((c, d), (d, c)):
        ahead[one], behind[following[one]] = following[other], other
    return ahead, behind


def _labels(tri: _Triangles) -> tuple[Indices, Bools]:
    """For each corner the first of its group, or -1; and which triangles count as mirrored."""
    ahead, behind = _neighbours(tri.vertices)
    corner = np.arange(len(ahead))
    of = corner // 3
    joined = []
    for across in (ahead, behind):
        same = (across >= 0) & tri.sound[of] & tri.sound[of[across]] & (tri.mirrored[of] == tri.mirrored[of[across]])
        joined.append(np.where(same, across, corner))
    label, before = np.minimum(corner, np.minimum(*joined)), corner
    while not np.array_equal(label, before):
        before = label
        label = np.minimum(label, np.minimum(label[joined[0]], label[joined[1]]))
        np.minimum.at(label, before, label.copy())
        label = label[label]
    if np.all(tri.sound):
        return label, tri.mirrored
    near = np.zeros(int(tri.vertices.max()) + 1, bool)
    near[tri.vertices[~tri.sound]] = True
    return _flooded(label, near[tri.vertices.reshape(-1)], tri, ahead, behind)


def _flooded(label: Indices, near: Bools, tri: _Triangles, ahead: Indices, behind: Indices) -> tuple[Indices, Bools]:
    """`_labels` where triangles without area in uv are met (corners `near`): the first group takes each of them."""
    seeds = np.flatnonzero(near & np.repeat(tri.sound, 3)).tolist()
    label[near] = -1
    labels, mirrored, sound = label.tolist(), tri.mirrored.tolist(), tri.sound.tolist()
    across = np.stack([ahead, behind], axis=1).tolist()
    for seed in seeds:
        if labels[seed] >= 0:
            continue
        side = mirrored[seed // 3]
        labels[seed] = seed
        edge = [seed]
        while edge:
            for corner in across[edge.pop()]:
                if corner < 0 or labels[corner] >= 0:
                    continue
                triangle = corner // 3
                if not sound[triangle] and max(labels[3 * triangle : 3 * triangle + 3]) < 0:
                    mirrored[triangle] = side
                if mirrored[triangle] == side:
                    labels[corner] = seed
                    edge.append(corner)
    return np.array(labels), np.array(mirrored)


def _grouped(tri: _Triangles) -> tuple[F32, Indices]:
    """Tangents (3 T, 4), and for each corner the first that shares its tangent, or -1."""
    label, mirrored = _labels(tri)
    s, t = tri.s.reshape(-1, 3), tri.t.reshape(-1, 3)
    sound = np.repeat(tri.sound, 3)
    shares = np.where(sound, tri.angles.reshape(-1), 0)[:, None] * np.where(sound[:, None], s, 0)
    sums = np.zeros_like(s)
    member = np.flatnonzero(label >= 0)
    for k in range(3):
        np.add.at(sums[:, k], label[member], shares[member, k])  # one after the other, as the program adds
    sums = sums[label]
    # Triangles whose tangents are opposite share none. There are no such two where all are on the first one's side,
    # by more than rounding.
    aside = sound & (label >= 0) & ~((_dot(s, s[label]) > 1e-3) & (_dot(t, t[label]) > 1e-3))
    if np.any(aside):
        order = member[np.argsort(label[member], kind="stable")]
        low, high = (np.searchsorted(label[order], np.unique(label[aside]), side=e) for e in ("left", "right"))
        for begin, end in zip(low, high):
            rows = order[begin:end]
            sums[rows], label[rows] = _split(rows, s[rows], t[rows], shares[rows], sound[rows])
    tangents = np.empty((len(s), 4), np.float32)
    tangents[:, :3] = _unit(sums)
    tangents[:, 3] = np.where(np.repeat(mirrored, 3), -1, 1)
    tangents[label < 0] = 1, 0, 0, -1
    return tangents, label


def _split(rows: Indices, s: F32, t: F32, shares: F32, sound: Bools) -> tuple[F32, Indices]:
    """A group's sums (n, 3) and labels, when each triangle leaves out those whose tangents are opposite to its own.

    Takes n^2 steps, as the program does: 2 s for 5000 triangles round one vertex, with tangents all ways.
    """
    sums, label = np.empty_like(s), np.empty_like(rows)
    known: dict[bytes, int] = {}
    for k in range(len(rows)):
        apart = (_dot(s, s[k]) <= -1) | (_dot(t, t[k]) <= -1)
        apart &= sound & sound[k]
        apart[k] = False
        first = known.setdefault(np.packbits(apart).tobytes(), k)
        sums[k] = sums[first] if first < k else np.cumsum(shares[~apart], axis=0)[-1]
        label[k] = rows[first]
    return sums, label
