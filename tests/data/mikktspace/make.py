"""Writes reference.npz: test meshes, and what the reference program for MikkTSpace says of them.

    python make.py mikktspace.c

The program is M. S. Mikkelsen's mikktspace.c (zlib licence), taken from the source package of pymikktspace 0.3.0, and
built by the system's C compiler; it is no part of this repository. Two builds of it are asked:

- "program": as it stands, but that each tangent it makes is given a number, by which corners that share one are known;
- "sorted": the same, and the last run of its list of edges is sorted too. The program sorts each run when it meets
  the next, and so never the last: edges there may go unpaired, by the order of the triangles. Only meshes whose name
  begins with "unsorted" differ in this, and hold both answers.

Not run by the tests.
"""

from __future__ import annotations

import ctypes
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

WRAPPER = r"""
#include "mikktspace.c"
typedef struct { int n; const float *p, *m, *u; float *out; } Data;
static Data *of(const SMikkTSpaceContext *c) { return (Data *)c->m_pUserData; }
static int faces(const SMikkTSpaceContext *c) { return of(c)->n; }
static int three(const SMikkTSpaceContext *c, const int f) { return 3; }
static void position(const SMikkTSpaceContext *c, float o[], const int f, const int v)
{ memcpy(o, of(c)->p + 9 * f + 3 * v, 12); }
static void normal(const SMikkTSpaceContext *c, float o[], const int f, const int v)
{ memcpy(o, of(c)->m + 9 * f + 3 * v, 12); }
static void texcoord(const SMikkTSpaceContext *c, float o[], const int f, const int v)
{ memcpy(o, of(c)->u + 6 * f + 2 * v, 8); }
static void set(const SMikkTSpaceContext *c, const float t[], const float b[], const float s, const float number,
                const tbool keeps, const int f, const int v)
{ float *o = of(c)->out + 5 * (3 * f + v); memcpy(o, t, 12); o[3] = keeps ? 1.0f : -1.0f; o[4] = number; }
int reference(int n, const float *p, const float *m, const float *u, float *out)
{
    Data data = {n, p, m, u, out};
    SMikkTSpaceInterface calls = {faces, three, position, normal, texcoord, 0, set};
    SMikkTSpaceContext context = {&calls, &data};
    return genTangSpaceDefault(&context);
}
"""

Mesh = tuple[np.ndarray, np.ndarray, np.ndarray]  # positions and normals (T, 3, 3), uv (T, 3, 2), all float32


def replaced(text: str, old: str, new: str) -> str:
    assert text.count(old) == 1
    return text.replace(old, new)


def built(source: Path, folder: Path, *, sort_all: bool) -> Any:
    text = source.read_text().replace("\r\n", "\n")
    end = "\treturn res;\n}\n\nstatic tbool CompareSubGroups"
    text = replaced(text, end, "\tstatic int made = 1;\n\tres.fMagT = (float) ++made;\n" + end)
    if sort_all:
        start = text.index("static void BuildNeighborsFast(", text.index("static void BuildNeighborsFast(") + 1)
        head, tail = text[:start], text[start:]
        for before, channel in (
            ("// sub sort over f, which should be fast.", 1),
            ("// pair up, adjacent triangles", 2),
        ):
            call = f"QuickSortEdges(pEdges, iCurStartIndex, iEntries-1, {channel}, uSeed);\n"
            tail = replaced(tail, before, call)
        text = head + tail
    folder.mkdir()
    (folder / "mikktspace.c").write_text(text)
    (folder / "mikktspace.h").write_bytes(source.with_suffix(".h").read_bytes())
    (folder / "wrapper.c").write_text(WRAPPER)
    # No fused multiply and add: each operation is rounded, as in the program's common builds.
    build = ["cc", "-O2", "-ffp-contract=off", "-shared", "-fPIC", "wrapper.c", "-o", "reference.so", "-lm"]
    subprocess.run(build, cwd=folder, check=True)
    return ctypes.CDLL(str(folder / "reference.so"))


def answer(program: Any, mesh: Mesh) -> dict[str, np.ndarray]:
    p, n, uv = (np.ascontiguousarray(a, np.float32) for a in mesh)
    out = np.zeros((len(p), 3, 5), np.float32)
    assert program.reference(len(p), *(a.ctypes.data_as(ctypes.c_void_p) for a in (p, n, uv, out)))
    numbers = np.unique(out[..., 4], return_inverse=True)[1].reshape(-1, 3)
    return {"tangents": out[..., :4], "groups": np.where(out[..., 4] == 1, -1, numbers).astype(np.int16)}


def mesh_of(points: Any, normals: Any, uv: Any, triangles: Any) -> Mesh:
    rows = np.asarray(triangles)
    p, n, st = (np.asarray(a, np.float64)[rows].astype(np.float32) for a in (points, normals, uv))
    return p, n, st


def grid(columns: int, rows: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """u, v (V,) over the unit square, and triangles."""
    u, v = np.meshgrid(np.arange(columns + 1) / columns, np.arange(rows + 1) / rows)
    at = np.arange(u.size).reshape(u.shape)
    a, b, c, d = (q.ravel() for q in (at[:-1, :-1], at[:-1, 1:], at[1:, 1:], at[1:, :-1]))
    return u.ravel(), v.ravel(), np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])


def sphere(columns: int, rows: int, *, one_pole: bool = False) -> Mesh:
    """With a seam, and triangles without area at the poles; one_pole: the corners there share their uv."""
    u, v, triangles = grid(columns, rows)
    along, up = 2 * np.pi * (u % 1), np.pi * (v - 0.5)
    across = np.where((v == 0) | (v == 1), 0, np.cos(up))
    p = np.stack([across * np.sin(along), np.sin(up), across * np.cos(along)], 1)
    uv = np.stack([np.where(one_pole & (across == 0), 0.5, u), v], 1)
    return mesh_of(p, p, uv, triangles)


def cube() -> Mesh:
    faces = []
    for axis in range(3):
        for side in (-1.0, 1.0):
            x, y = np.roll(np.eye(3), axis, axis=1)[1:] * [[side], [1.0]]
            n = np.cross(x, y)
            corners = [n - x - y, n + x - y, n + x + y, n - x + y]
            faces.append(mesh_of(corners, [n] * 4, [[0, 0], [1, 0], [1, 1], [0, 1]], [[0, 1, 2], [0, 2, 3]]))
    return joined(*faces)


def joined(*meshes: Mesh) -> Mesh:
    p, n, uv = (np.concatenate(parts) for parts in zip(*meshes))
    return p, n, uv


def bent_sheet(columns: int, rows: int, uv_of: Any, *, seed: int) -> Mesh:
    u, v, triangles = grid(columns, rows)
    rng = np.random.default_rng(seed)
    p = np.stack([u, v, 0.2 * np.sin(5 * u + 3 * v)], 1) + rng.normal(scale=0.01, size=(len(u), 3))
    n = np.stack([-np.cos(5 * u + 3 * v), -0.6 * np.cos(5 * u + 3 * v), np.ones_like(u)], 1)
    uv = np.stack(uv_of(u, v), 1)
    return mesh_of(p, n / np.linalg.norm(n, axis=1, keepdims=True), uv, triangles)


def mirrored(columns: int = 8) -> Mesh:
    """uv run back again from the middle on, and the two halves share the vertices there."""
    return bent_sheet(columns, 5, lambda u, v: (np.abs(u - 0.5), v), seed=1)


def checkered() -> Mesh:
    """A fan whose triangles have mirrored uv in turn, and in pairs: groups end at each change."""
    turn = np.exp(2j * np.pi * np.arange(12) / 12)
    rim = np.stack([turn.real, turn.imag, 0.1 * np.cos(3 * np.arange(12))], 1)
    reach = np.array([0, 1, 2, 1, 0, 1, 0, 1, 2, 3, 2, 1]) / 4
    points = np.concatenate([[[0, 0, 0.4]], rim])
    uv = np.concatenate([[[0.5, 1]], np.stack([reach, np.zeros(12)], 1)])
    triangles = [[0, 1 + k, 1 + (k + 1) % 12] for k in range(12)]
    return mesh_of(points, [[0, 0, 1]] * 13, uv, triangles)


def folded(axis: int) -> Mesh:
    """Two triangles, one folded onto the other along u, or v: the other derivatives are opposite."""
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0.5, 0, 0] if axis else [0, 0.5, 0]])
    uv = points[:, :2] * ([1, 1], [1, 1], [1, 1], [-1, 1] if axis else [1, -1])
    return mesh_of(points, [[0, 0, 1]] * 4, uv, [[0, 1, 2], [0, 2, 3] if axis else [1, 0, 3]])


def degenerate() -> Mesh:
    """A mirrored sheet with triangles of all kinds that have no area, in space and in uv, between and beside it."""
    p, n, uv = mirrored()
    rng = np.random.default_rng(7)
    rows = rng.permutation(len(p))
    flat, line, point = rows[:14], rows[14:24], rows[24:34]
    uv[flat] = 0.25  # no area in uv, next to others such
    uv[flat[:7], 1] = 0.5
    doubled = joined((p[line], n[line], uv[line]), (p[point], n[point], uv[point]))
    doubled[0][:10, 2] = doubled[0][:10, 1]  # two corners in one place
    doubled[0][10:, 1:] = doubled[0][10:, :1]  # three
    on_line = (p[line].copy(), n[line], uv[line])
    on_line[0][:, 2] = (on_line[0][:, 0] + on_line[0][:, 1]) / 2  # no area, three places
    # Area in uv and none in space: all places on a line along which u, or v, stays the same.
    stretched = [
        mesh_of([[3 * x] * 3 for x in (0, 0.5, 1)], [[0, 0, 1]] * 3, uv, [[0, 1, 2]])
        for uv in ([[0, 0], [1, 0.5], [0, 1]], [[0, 0], [0.5, 1], [1, 0]])
    ]
    alone = mesh_of(5 + np.eye(3), [[0, 0, 1]] * 3, np.zeros((3, 2)), [[0, 1, 2], [0, 0, 1]])
    return shuffled(joined((p, n, uv), doubled, on_line, *stretched, alone), 8)


def shuffled(mesh: Mesh, seed: int) -> Mesh:
    order = np.random.default_rng(seed).permutation(len(mesh[0]))
    p, n, uv = (a[order] for a in mesh)
    return p, n, uv


def soup(seed: int) -> Mesh:
    """Triangles between few points, many to an edge, on a coarse grid in space, in uv, or in neither."""
    rng = np.random.default_rng(seed)
    points, count = int(rng.integers(4, 24)), int(rng.integers(20, 60))
    p, uv, n = rng.normal(size=(points, 3)), rng.random((points, 2)), rng.normal(size=(points, 3))
    p = np.round(p * 2) / 2 if seed % 2 else p
    uv = np.round(uv * (1 + seed % 3)) if seed % 5 < 2 else uv
    n = np.where(seed % 3 == 0, [[0, 0, 1]], n / np.linalg.norm(n, axis=1, keepdims=True))
    return mesh_of(p, np.broadcast_to(n, p.shape), uv, rng.integers(0, points, (count, 3)))


def meshes() -> dict[str, Mesh]:
    found = {
        "triangle": mesh_of(np.eye(3), np.full((3, 3), 3**-0.5), [[0, 0], [1, 0.25], [0.25, 1]], [[0, 1, 2]]),
        "cube": cube(),
        "sphere": sphere(16, 8),
        "sphere with one pole": sphere(16, 8, one_pole=True),
        "sphere with one pole, shuffled": shuffled(sphere(15, 8, one_pole=True), 2),
        "mirrored": mirrored(),
        "mirrored, shuffled": shuffled(mirrored(), 3),
        "turned": bent_sheet(6, 6, lambda u, v: (3 * v - u, 2 * u + v), seed=2),
        "checkered fan": checkered(),
        "folded along u": folded(0),
        "folded along v": folded(1),
        "degenerate": degenerate(),
        "three sheets on an edge": joined(
            *(bent_sheet(4, 4, lambda u, v, k=k: (u, k * v), seed=4) for k in (1, 2, -1))
        ),
        "far away": tuple(a + 300 * (k == 0) for k, a in enumerate(shuffled(mirrored(), 5))),
    }
    found |= {f"soup {seed}": soup(seed) for seed in range(20)}
    return {name: (p.astype(np.float32), n, uv) for name, (p, n, uv) in found.items()}


def main() -> None:
    with tempfile.TemporaryDirectory() as folder:
        source = Path(sys.argv[1])
        program = built(source, Path(folder) / "program", sort_all=False)
        sorting = built(source, Path(folder) / "sorted", sort_all=True)
        stored: dict[str, np.ndarray] = {}
        for name, mesh in meshes().items():
            by_program, by_sorted = answer(program, mesh), answer(sorting, mesh)
            differ = any(not np.array_equal(by_program[key], by_sorted[key]) for key in by_program)
            name = f"unsorted {name}" if differ else name
            stored |= {f"{name}/{key}": a for key, a in zip(("positions", "normals", "uv"), mesh)}
            stored |= {f"{name}/{key}": a for key, a in by_sorted.items()}
            stored |= {f"{name}/program's {key}": a for key, a in by_program.items()} if differ else {}
            print(f"{name}: {len(mesh[0])} triangles, {len(np.unique(by_sorted['groups']))} tangents")
    np.savez_compressed(Path(__file__).with_name("reference.npz"), allow_pickle=False, **stored)


if __name__ == "__main__":
    main()
