"""Mesh files: four formats, one mesh; what is damaged or odd is refused or reported, never half read."""

from __future__ import annotations

import base64
import json
import re
import struct
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from glbump.errors import GlbumpError, LimitError, MeshError
from glbump.mesh import Mesh, tessellate
from glbump.meshfile import load_mesh
from glbump.reference import mapping
from glbump.shapes import Torus

# An asymmetric patch: no two numbers alike, so that a swapped or flipped axis shows.
POINTS = np.array([[0, 0, 0], [2, 0, 0], [2.5, 1.5, 0], [0.25, 1, 0.5]], dtype=np.float64)
UV = np.array([[0.1, 0.2], [0.8, 0.25], [0.9, 0.7], [0.15, 0.6]])
TRIANGLES = np.array([[0, 1, 2], [0, 2, 3]])


def obj(points: Any = POINTS, triangles: Any = TRIANGLES, uv: Any = UV, extra: str = "") -> bytes:
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in np.asarray(points, float).tolist()]
    lines += [] if uv is None else [f"vt {u!r} {v!r}" for u, v in np.asarray(uv, float).tolist()]
    mark = "{0}" if uv is None else "{0}/{0}"
    lines += ["f " + " ".join(mark.format(i + 1) for i in face) for face in triangles]
    return ("\n".join(lines) + "\n" + extra).encode()


def ply(order: str = "ascii", points: Any = POINTS, faces: Any = TRIANGLES, uv: Any = UV) -> bytes:
    columns = np.asarray(points, float) if uv is None else np.hstack([points, uv])
    names = ["x", "y", "z", "s", "t"][: columns.shape[1]]
    header = ["ply", f"format {order} 1.0", "comment made here", f"element vertex {len(columns)}"]
    header += [f"property double {name}" for name in names]
    header += [f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header\n"]
    head = "\n".join(header).encode()
    if order == "ascii":
        rows = [" ".join(map(repr, row)) for row in columns.tolist()]
        rows += [" ".join(map(str, [len(face), *face])) for face in faces]
        return head + ("\n".join(rows) + "\n").encode()
    end = "<" if "little" in order else ">"
    body = columns.astype(f"{end}f8").tobytes()
    for face in faces:
        body += bytes([len(face)]) + np.array(face, f"{end}i4").tobytes()
    return head + body


def stl(points: Any = POINTS, triangles: Any = TRIANGLES) -> bytes:
    body = b"".join(
        np.zeros(3, "<f4").tobytes() + np.asarray(points)[t].astype("<f4").tobytes() + b"\0\0" for t in triangles
    )
    return b"solid but binary".ljust(80) + struct.pack("<I", len(triangles)) + body


def stl_text(points: Any = POINTS, triangles: Any = TRIANGLES) -> bytes:
    text = "solid facet vertex\n"
    for t in triangles:
        text += "facet normal 0 0 0\nouter loop\n"
        text += "".join(f" vertex {x} {y} {z}\n" for x, y, z in np.asarray(points)[t].tolist())
        text += "endloop\nendfacet\n"
    return (text + "endsolid facet vertex\n").encode()


class Glb:
    """Writes a GLB piece by piece."""

    def __init__(self) -> None:
        self.tree: dict[str, Any] = {"asset": {"version": "2.0"}, "buffers": [], "bufferViews": [], "accessors": []}
        self.binary = b""

    def view(self, data: bytes, **more: Any) -> int:
        self.tree["bufferViews"].append({"buffer": 0, "byteOffset": len(self.binary), "byteLength": len(data), **more})
        self.binary += data + b"\0" * (-len(data) % 4)
        return len(self.tree["bufferViews"]) - 1

    def accessor(self, values: Any, kind: str, **more: Any) -> int:
        values = np.ascontiguousarray(values)
        component = {"i1": 5120, "u1": 5121, "i2": 5122, "u2": 5123, "u4": 5125, "f4": 5126}[kind]
        width = 1 if values.ndim == 1 else values.shape[1]
        self.tree["accessors"].append(
            {
                "bufferView": self.view(values.astype(f"<{kind}").tobytes()),
                "componentType": component,
                "count": len(values),
                "type": {1: "SCALAR", 2: "VEC2", 3: "VEC3"}[width],
                **more,
            }
        )
        return len(self.tree["accessors"]) - 1

    def patch(self, triangles: Any = TRIANGLES, uv: bool = True, **primitive: Any) -> int:
        """Adds the patch as a mesh of its own; glTF's v points down."""
        attributes = {"POSITION": self.accessor(POINTS, "f4")}
        if uv:
            attributes["TEXCOORD_0"] = self.accessor(np.column_stack([UV[:, 0], 1 - UV[:, 1]]), "f4")
        part = {"attributes": attributes, "indices": self.accessor(np.ravel(triangles), "u2"), **primitive}
        self.tree.setdefault("meshes", []).append({"primitives": [part]})
        return len(self.tree["meshes"]) - 1

    def nodes(self, *nodes: dict[str, Any], roots: list[int] | None = None) -> Glb:
        self.tree["nodes"] = list(nodes)
        self.tree["scenes"] = [{"nodes": [0] if roots is None else roots}]
        return self

    def bytes(self) -> bytes:
        if not self.tree["buffers"]:
            self.tree["buffers"] = [{"byteLength": len(self.binary)}]
        text = json.dumps(self.tree).encode()
        text += b" " * (-len(text) % 4)
        chunks = struct.pack("<I4s", len(text), b"JSON") + text
        if self.binary:
            chunks += struct.pack("<I4s", len(self.binary), b"BIN\0") + self.binary
        return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def glb(**options: Any) -> bytes:
    made = Glb()
    return made.nodes({"mesh": made.patch(**options)}).bytes()


@pytest.fixture
def load(tmp_path: Path) -> Callable[[str, bytes], Mesh]:
    def loaded(kind: str, data: bytes) -> Mesh:
        file = tmp_path / f"mesh.{kind}"
        file.write_bytes(data)
        mesh = load_mesh(file)
        check(mesh)
        return mesh

    return loaded


def check(mesh: Mesh) -> None:
    """What holds for every mesh that is returned."""
    count = len(mesh.positions)
    assert mesh.triangles.dtype == np.int32
    assert len(mesh.triangles) > 0
    assert np.array_equal(np.unique(mesh.triangles), np.arange(count))
    assert mesh.normals is not None
    np.testing.assert_allclose(np.linalg.norm(mesh.normals, axis=1), 1, rtol=1e-12)
    given = [a is None for a in (mesh.uv, mesh.dpdu, mesh.dpdv)]
    assert all(given) or not any(given)
    for array in (mesh.positions, mesh.normals, mesh.uv, mesh.dpdu, mesh.dpdv):
        assert array is None or (array.dtype == np.float64 and len(array) == count and np.all(np.isfinite(array)))


def corners(mesh: Mesh) -> npt.NDArray[np.float64]:
    """(T, 3, 3 or 5): positions, and uv, of every corner, triangles in one order."""
    table = mesh.positions if mesh.uv is None else np.hstack([mesh.positions, mesh.uv])
    triangles = table[mesh.triangles]
    # A triangle may begin at any of its corners.
    begin = np.lexsort(np.moveaxis(triangles, -1, 0)[::-1])[:, 0]
    triangles = np.stack([np.roll(t, -b, axis=0) for t, b in zip(triangles, begin)])
    return triangles[np.lexsort(triangles.reshape(len(triangles), -1).T[::-1])]


PATCH = np.hstack([POINTS, UV])[TRIANGLES]


@pytest.mark.parametrize(
    ("kind", "data", "tolerance"),
    [
        ("obj", obj(), 0),
        ("ply", ply(), 0),
        ("ply", ply("binary_little_endian"), 0),
        ("ply", ply("binary_big_endian"), 0),
        ("glb", glb(), 1e-7),  # 32 bits
    ],
)
def test_one_mesh_in_every_format(load: Any, kind: str, data: bytes, tolerance: float) -> None:
    mesh = load(kind, data)
    assert mesh.notes == ()
    np.testing.assert_allclose(corners(mesh), PATCH, atol=tolerance, rtol=0)


@pytest.mark.parametrize("data", [stl(), stl_text()])
def test_stl_has_no_uv_and_is_faceted(load: Any, data: bytes) -> None:
    mesh = load("stl", data)
    assert mesh.uv is None
    np.testing.assert_array_equal(corners(mesh), corners(Mesh(POINTS, TRIANGLES.astype(np.int32))))
    assert len(mesh.positions) == 6
    face = np.cross(POINTS[2] - POINTS[0], POINTS[3] - POINTS[0])
    at = int(np.argmax(np.all(mesh.positions == POINTS[3], axis=1)))
    np.testing.assert_allclose(mesh.normals[at], face / np.linalg.norm(face), rtol=1e-12)


def test_suffix_in_capitals(tmp_path: Path) -> None:
    (tmp_path / "A.OBJ").write_bytes(obj())
    assert len(load_mesh(tmp_path / "A.OBJ").triangles) == 2


# dp/du and dp/dv


@pytest.mark.parametrize("mirror", [1, -1])
def test_tangents_of_an_affine_map_are_exact(load: Any, mirror: int) -> None:
    rng = np.random.default_rng(3)
    per_u, per_v, origin = rng.normal(size=(3, 3))
    uv = rng.uniform(size=(30, 2)) * [mirror, 1]
    triangles = rng.permutation(30).reshape(-1, 3)
    mesh = load("obj", obj(origin + uv[:, :1] * per_u + uv[:, 1:] * per_v, triangles, uv))
    # The condition of a random triangle: a few hundred roundings.
    np.testing.assert_allclose(mesh.dpdu, np.tile(per_u, (30, 1)), atol=1e-11)
    np.testing.assert_allclose(mesh.dpdv, np.tile(per_v, (30, 1)), atol=1e-11)


def torus_grid(n: int) -> tuple[Any, Any, Any, Any, Any]:
    """A piece of a torus as an OBJ's tables, with the true dp/du, dp/dv; u and v in quarter turns."""
    u, v = (a.reshape(-1) for a in np.meshgrid(np.linspace(0, 1, n + 1), np.linspace(0, 1, n + 1), indexing="ij"))
    a, b = u * np.pi / 2, v * np.pi / 2

    def point(a: Any, b: Any) -> Any:
        ring = 1 + 0.35 * np.cos(b)
        return np.stack([ring * np.sin(a), 0.35 * np.sin(b), ring * np.cos(a)], axis=-1)

    h = 1e-6  # central: error h^2 and eps/h, both below 1e-9
    per_u = (point(a + h, b) - point(a - h, b)) / (2 * h) * np.pi / 2
    per_v = (point(a, b + h) - point(a, b - h)) / (2 * h) * np.pi / 2
    i, j = (k.reshape(-1) for k in np.meshgrid(np.arange(n), np.arange(n), indexing="ij"))
    p = i * (n + 1) + j
    q = p + n + 1
    triangles = np.concatenate([np.stack([p, q, q + 1], -1), np.stack([p, q + 1, p + 1], -1)])
    return point(a, b), triangles, np.stack([u, v], -1), per_u, per_v


def test_tangents_and_normals_converge_on_a_curved_surface(load: Any) -> None:
    """Inside the grid the error falls with the square of the spacing; a per-triangle value would fall linearly."""
    errors = []
    for n in (8, 16):
        points, triangles, uv, per_u, per_v = torus_grid(n)
        mesh = load("obj", obj(points, triangles, uv))
        inner = np.all((mesh.uv > 1e-9) & (mesh.uv < 1 - 1e-9), axis=1)
        order = np.array([int(np.argmin(np.sum((uv - x) ** 2, axis=1))) for x in mesh.uv])
        normal = np.cross(per_u, per_v)
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        errors.append(
            [
                np.abs(got - want[order])[inner].max()
                for got, want in ((mesh.dpdu, per_u), (mesh.dpdv, per_v), (mesh.normals, normal))
            ]
        )
    assert np.all(np.array(errors[1]) < 0.01)
    assert np.all(np.array(errors[0]) / errors[1] > 3.3)  # 4 in the limit


def test_derivatives_of_normals_converge_to_those_of_a_sphere(load: Any) -> None:
    """On a sphere of radius 2 dn/du is dp/du / 2; inside the grid the error falls with the square of the spacing, with
    the file's normals and with means of the triangles'."""
    for given in (True, False):
        errors = []
        for n in (8, 16):
            _, triangles, uv, *_ = torus_grid(n)
            longitude, latitude = 2 * np.pi * (0.4 + 0.2 * uv[:, 0] - 0.5), np.pi * (0.4 + 0.3 * uv[:, 1] - 0.5)
            across = np.cos(latitude)
            normals = np.stack([across * np.sin(longitude), np.sin(latitude), across * np.cos(longitude)], axis=-1)
            extra = "".join("vn {} {} {}\n".format(*row) for row in normals) if given else ""
            text = obj(2 * normals, triangles, uv, extra)
            if given:
                text = re.sub(rb"(\d+)/(\d+)(?= |\n|$)", rb"\1/\2/\1", text)
            mesh = load("obj", text)
            inner = np.all(np.abs(mesh.uv - 0.5) < 0.3, axis=1)  # means at the border have one side
            at, n_at = mesh.positions[inner], mesh.normals[inner]
            want = 0.2 * mapping.sphere_dndu(at, 2.0), 0.3 * mapping.sphere_dndv(at, 2.0)
            got = mesh.dndu[inner], mesh.dndv[inner]
            # The cross product leaves out what lies along n, which does not count.
            errors.append([np.linalg.norm(np.cross(g - w, n_at), axis=1).max() for g, w in zip(got, want, strict=True)])
        assert np.max(errors[1]) < 0.01
        assert np.all(np.array(errors[0]) / errors[1] > 3.3)  # 4 in the limit


def test_no_mean_across_mirrored_uv(load: Any) -> None:
    """Two squares share an edge and its uv; on the other side u runs back, as artists mirror half a body."""
    points = [[-1, 0, 0], [0, 0, 0], [1, 0, 0], [-1, 1, 0], [0, 1, 0], [1, 1, 0]]
    uv = [[1, 0], [0, 0], [1, 0], [1, 1], [0, 1], [1, 1]]
    mesh = load("obj", obj(points, [[0, 1, 4], [0, 4, 3], [1, 2, 5], [1, 5, 4]], uv))
    assert len(mesh.positions) == 8  # the two vertices of the shared edge, once for each side
    side = np.sign(mesh.positions[mesh.triangles].mean(axis=1)[:, 0])
    for k in range(3):
        np.testing.assert_allclose(mesh.dpdu[mesh.triangles[:, k]][:, 0], side, atol=1e-15)
    np.testing.assert_array_equal(mesh.normals, np.tile([0.0, 0, 1], (8, 1)))
    assert mesh.notes == ()


def test_a_seam_in_uv_splits_vertices_but_not_normals(load: Any) -> None:
    text = b"""v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 1
vt 0 0\nvt 1 0\nvt 1 1\nvt 5 5\nvt 6 6\nvt 5 6
f 1/1 2/2 3/3\nf 1/4 3/5 4/6\n"""
    mesh = load("obj", text)
    assert len(mesh.positions) == 6
    at_origin = np.all(mesh.positions == 0, axis=1)
    assert np.count_nonzero(at_origin) == 2
    assert len(np.unique(mesh.normals[at_origin], axis=0)) == 1
    assert len(np.unique(mesh.dpdu[at_origin], axis=0)) == 2


# Normals


def test_normals_are_weighted_by_angle(load: Any) -> None:
    """A cube's corners, however its sides are cut: the diagonals. Weighted by area, or by count, they lean."""
    cube = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    mesh = load("obj", obj(cube, [t for q in quads for t in (q[:3], [q[0], *q[2:]])], None))
    np.testing.assert_allclose(mesh.normals, mesh.positions / np.sqrt(3), atol=1e-15)


def test_normals_of_the_file_are_kept(load: Any) -> None:
    text = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 3 4\nvn 1 0 0\nf 1//1 2//1 3//2\n"
    mesh = load("obj", text)
    np.testing.assert_allclose(np.unique(mesh.normals, axis=0), [[0, 0.6, 0.8], [1, 0, 0]], atol=1e-15)
    odd = load("obj", text.replace(b"vn 1 0 0", b"vn 0 nan 0"))
    assert any("1 of 2 normals have no direction" in note for note in odd.notes)
    np.testing.assert_allclose(np.unique(odd.normals, axis=0), [[0, 0, 1], [0, 0.6, 0.8]], atol=1e-15)


# What OBJ allows


def test_obj_as_it_is_written(load: Any) -> None:
    """Comments, continued lines, tabs, polygons, colours, indices from the end of what was read so far."""
    text = b"""# caf\xe9
mtllib ../../up.mtl
v\t0 0 0 1.0 0.5 0.5
v 2 0 0 1 1 1 # here
  v 2.5 1.5 \\
 0
v .25 1 .5
vt 0.1 0.2 0\nvt 0.8 0.25\r
vt 0.9 0.7\nvt 0.15 0.6
o thing\ng side\ns 1\nusemtl none
f -4/-4 -3/-3 -2/-2 -1/-1 # round
v 9 9 9
"""
    np.testing.assert_array_equal(corners(load("obj", text)), PATCH)


def test_obj_indices_from_the_end_are_those_of_their_time(load: Any) -> None:
    text = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 -1\nv 5 0 0\nv 6 0 0\nv 5 1 0\nf -3 -2 -1\n"
    mesh = load("obj", text)
    assert mesh.positions[:, 0].max() == 6
    assert len(mesh.positions) == 6


def test_polygons_are_cut_inside(load: Any) -> None:
    """An arrowhead, not convex, wherever it begins; a pentagon; both with the area they have."""
    arrow = np.array([[0, 0, 0], [2, 1, 0], [0, 2, 0], [0.5, 1, 0]])
    for first in range(4):
        mesh = load("obj", obj(arrow, [np.roll(np.arange(4), first)], None))
        p = mesh.positions[mesh.triangles]
        area = np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])[:, 2] / 2
        assert np.all(area > 0)
        assert area.sum() == pytest.approx(1.5)
    angle = np.arange(5) * 2 * np.pi / 5
    pentagon = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    assert load("ply", ply(points=pentagon, faces=[[0, 1, 2, 3, 4]], uv=None)).notes == ()
    bent = np.insert(arrow, 1, [1, 0.5, 0], axis=0)[[3, 4, 0, 1, 2]]
    notes = load("obj", obj(bent, [[0, 1, 2, 3, 4]], None)).notes
    assert "1 faces of five or more corners are not convex" in notes[0]


@pytest.mark.parametrize("order", ["ascii", "binary_little_endian", "binary_big_endian"])
def test_ply_of_mixed_polygons(load: Any, order: str) -> None:
    mesh = load("ply", ply(order, faces=[[0, 1, 2, 3], [0, 1, 2], [1, 2, 3]]))
    assert len(mesh.triangles) == 4
    np.testing.assert_array_equal(
        corners(mesh), corners(load("obj", obj(triangles=[[0, 1, 2], [0, 2, 3], [0, 1, 2], [1, 2, 3]])))
    )


def test_ply_uv_of_corners_and_normals_of_vertices(load: Any) -> None:
    text = b"""ply\nformat ascii 1.0\nelement vertex 4
property float x\nproperty float y\nproperty float z\nproperty float nx\nproperty float ny\nproperty float nz
property uchar red\nelement camera 1\nproperty list uchar float thing\nelement face 2
property uchar flag\nproperty list uchar uint vertex_index\nproperty list uchar float texcoord\nend_header
0 0 0 0 0 2 255\n2 0 0 0 0 2 255\n2 2 0 0 0 2 255\n0 2 0 0 0 2 255\n2 7 8
7 3 0 1 2 6 0 0 1 0 1 1\n7 3 0 2 3 6 0 0 .5 .5 0 .5\n"""
    mesh = load("ply", text)
    assert len(mesh.positions) == 5  # the corner at (2, 2) has two uv
    np.testing.assert_array_equal(mesh.normals, np.tile([0.0, 0, 1], (5, 1)))
    np.testing.assert_array_equal(np.unique(mesh.uv, axis=0), [[0, 0], [0, 0.5], [0.5, 0.5], [1, 0], [1, 1]])


# glTF


def test_gltf_v_points_down(load: Any) -> None:
    """The upper left texel of the file's picture, uv (0, 0) in glTF, is (0, 1) here."""
    made = Glb()
    uv = made.accessor([[0, 0], [0, 1], [1, 1]], "f4")
    at = made.accessor([[0, 1, 0], [0, 0, 0], [1, 0, 0]], "f4")
    made.tree["meshes"] = [{"primitives": [{"attributes": {"POSITION": at, "TEXCOORD_0": uv}}]}]
    mesh = load("glb", made.nodes({"mesh": 0}).bytes())
    np.testing.assert_array_equal(mesh.uv, mesh.positions[:, :2])
    np.testing.assert_array_equal(mesh.dpdv, np.tile([0.0, 1, 0], (3, 1)))


def test_gltf_nodes_move_their_meshes(load: Any) -> None:
    """Child after parent; scale, then rotation, then translation; a matrix by columns; one mesh twice."""
    made = Glb()
    patch = made.patch()
    half = np.sqrt(0.5)
    turn = {"rotation": [0, 0, half, half], "scale": [2, 3, 1], "translation": [10, 0, 0], "children": [1]}
    shift = {"matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 5, 6, 7, 1], "mesh": patch}
    mesh = load("glb", made.nodes(turn, shift, {"mesh": patch}, roots=[0, 2]).bytes())
    inner = (POINTS + [5, 6, 7]) * [2, 3, 1]
    moved = np.stack([10 - inner[:, 1], inner[:, 0], inner[:, 2]], axis=1)  # a quarter turn about z
    expected = np.concatenate([moved[TRIANGLES], POINTS[TRIANGLES]])
    got = corners(Mesh(mesh.positions, mesh.triangles))
    want = corners(Mesh(expected.reshape(-1, 3), np.arange(12, dtype=np.int32).reshape(-1, 3)))
    np.testing.assert_allclose(got, want, atol=1e-5)  # 32 bits, at 40


def test_gltf_mirrored_nodes_stay_outward(load: Any) -> None:
    made = Glb()
    normals = made.accessor(np.tile([0, 0, 1], (4, 1)), "f4")
    patch = made.patch()
    made.tree["meshes"][patch]["primitives"][0]["attributes"]["NORMAL"] = normals
    mesh = load("glb", made.nodes({"mesh": patch, "scale": [-1, 2, 0.5]}).bytes())
    p = mesh.positions[mesh.triangles]
    face = np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])
    assert np.all(np.sum(face * mesh.normals[mesh.triangles[:, 0]], axis=1) > 0)
    np.testing.assert_allclose(mesh.normals, np.tile([0.0, 0, 1], (len(mesh.normals), 1)), atol=1e-15)


@pytest.mark.parametrize(("mode", "order"), [(4, TRIANGLES), (6, [0, 1, 2, 3]), (5, [1, 2, 0, 3])])
def test_gltf_modes(load: Any, mode: int, order: Any) -> None:
    np.testing.assert_allclose(corners(load("glb", glb(triangles=order, mode=mode))), PATCH, atol=1e-7)


def test_gltf_without_normals_is_faceted(load: Any) -> None:
    mesh = load("glb", glb())
    assert len(mesh.positions) == 6
    assert len(np.unique(mesh.normals, axis=0)) == 2


def test_gltf_packed_values(load: Any) -> None:
    """Normalised bytes, interleaved rows, sparse rows, and a buffer inside the JSON."""
    made = Glb()
    rows = np.zeros(4, [("p", "<f4", 3), ("uv", "u1", 2), ("gap", "u1", 2)])
    rows["p"], rows["uv"] = POINTS, [[0, 255], [255, 255], [255, 0], [0, 0]]
    view = made.view(rows.tobytes(), byteStride=16)
    more = made.view(np.array([3], "<u2").tobytes()), made.view(np.array([[0.25, 1, 7]], "<f4").tobytes())
    sparse = {"count": 1, "indices": {"bufferView": more[0], "componentType": 5123}, "values": {"bufferView": more[1]}}
    made.tree["accessors"] += [
        {"bufferView": view, "componentType": 5126, "count": 4, "type": "VEC3", "sparse": sparse},
        {"bufferView": view, "byteOffset": 12, "componentType": 5121, "count": 4, "type": "VEC2", "normalized": True},
    ]
    primitive = {"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "indices": made.accessor(TRIANGLES.ravel(), "u1")}
    made.tree["meshes"] = [{"primitives": [primitive]}]
    uri = "data:application/octet-stream;base64," + base64.b64encode(made.binary).decode()
    made.tree["buffers"] = [{"byteLength": len(made.binary), "uri": uri}]
    made.binary = b""
    mesh = load("glb", made.nodes({"mesh": 0}).bytes())
    points = POINTS.copy()
    points[3, 2] = 7
    expected = np.hstack([points, [[0, 0], [1, 0], [1, 1], [0, 1]]])[TRIANGLES]
    np.testing.assert_allclose(corners(mesh), expected, atol=1e-7)


def test_gltf_says_what_it_leaves_out(load: Any) -> None:
    made = Glb()
    parts = [made.patch(), made.patch(uv=False), made.patch(mode=1)]
    made.tree["skins"] = [{}]
    mesh = load("glb", made.nodes(*({"mesh": p} for p in parts), roots=[0, 1, 2]).bytes())
    assert mesh.uv is None
    assert len(mesh.triangles) == 4
    notes = " | ".join(mesh.notes)
    for text in ("only 1 of 2 primitives have them", "points or lines are not drawn", "a skin is not posed"):
        assert text in notes


def draco_glb(data: bytes) -> bytes:
    made = Glb()
    view = made.view(data)
    plain = [{"componentType": 5126, "count": 4, "type": "VEC3"}, {"componentType": 5126, "count": 4, "type": "VEC2"}]
    made.tree["accessors"] = [*plain, {"componentType": 5123, "count": 6, "type": "SCALAR"}]
    extension = {"bufferView": view, "attributes": {"POSITION": 1, "TEXCOORD_0": 0}}
    made.tree["meshes"] = [
        {
            "primitives": [
                {
                    "attributes": {"POSITION": 0, "TEXCOORD_0": 1},
                    "indices": 2,
                    "extensions": {"KHR_draco_mesh_compression": extension},
                }
            ]
        }
    ]
    made.tree["extensionsRequired"] = made.tree["extensionsUsed"] = ["KHR_draco_mesh_compression"]
    return made.nodes({"mesh": 0}).bytes()


def test_draco(load: Any) -> None:
    draco = pytest.importorskip("DracoPy", reason="the extra `draco` is not installed")
    uv = np.ascontiguousarray(np.column_stack([UV[:, 0], 1 - UV[:, 1]]))
    data = draco.encode(
        POINTS.astype(np.float32), TRIANGLES.astype(np.uint32), tex_coord=uv, quantization_bits=20
    )  # 2.5 in 2^20 steps
    mesh = load("glb", draco_glb(data))
    np.testing.assert_allclose(corners(mesh)[..., :3], PATCH[..., :3], atol=1e-5)
    np.testing.assert_allclose(corners(mesh)[..., 3:], PATCH[..., 3:], atol=2e-3)  # uv: DracoPy's 10 bits
    with pytest.raises(MeshError, match="its Draco data cannot be decoded"):
        load("glb", draco_glb(data[:40]))


def test_draco_without_its_decoder(load: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "DracoPy", None)
    with pytest.raises(MeshError, match=r"pip install glbump\[draco\]"):
        load("glb", draco_glb(b"whatever"))


# Odd, but drawn: reported.


def test_triangles_without_area_are_reported(load: Any) -> None:
    triangles = [*TRIANGLES, [0, 0, 1], [0, 1, 4], [4, 1, 5]]
    points = np.vstack([POINTS, [[1, 0, 0], [3, 0, 0]]])  # on the line from 0 to 1
    mesh = load("obj", obj(points, triangles, None))
    assert len(mesh.triangles) == 2
    assert mesh.notes == ("3 of 5 triangles have no area; they are left out",)
    # A thin sliver of 1e-6 is a triangle.
    assert load("obj", obj([[0, 0, 0], [1, 0, 0], [0.5, 1e-6, 0]], [[0, 1, 2]], None)).notes == ()


def test_uv_without_area_are_reported(load: Any) -> None:
    uv = UV.copy()
    uv[1] = uv[0]
    mesh = load("obj", obj(uv=uv))
    assert mesh.notes == ("1 of 2 triangles have no area in uv; bumps do not show on them",)
    flat = np.all(mesh.dpdu == 0, axis=1) & np.all(mesh.dpdv == 0, axis=1)
    assert np.array_equal(np.unique(mesh.triangles[0]), np.flatnonzero(flat))


@pytest.mark.parametrize(
    ("text", "note"),
    [
        (b"vt 0 0\nf 1/1 2/1 3/1\nf 1 2 4\n", "every texture coordinate is ignored: only 3 of 6 corners have one"),
        (b"vn 0 0 1\nf 1//1 2//1 3//1\nf 1 2 4\n", "every normal is ignored: only 3 of 6 corners have one"),
        (b"f 1 2 3\nl 1 2\np 4\n", "2 statements other than faces are not drawn"),
    ],
)
def test_obj_says_what_it_leaves_out(load: Any, text: bytes, note: str) -> None:
    mesh = load("obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n" + text)
    assert mesh.notes == (note,)
    assert mesh.uv is None


# Wrong: refused, in one line, naming the file.

V3 = b"v 0 0 0\nv 1 0 0\nv 0 1 0\n"


def changed_glb(change: Callable[[dict[str, Any]], Any]) -> bytes:
    made = Glb()
    made.nodes({"mesh": made.patch()})
    change(made.tree)
    return made.bytes()


def primitive(tree: dict[str, Any]) -> dict[str, Any]:
    result: dict[str, Any] = tree["meshes"][0]["primitives"][0]
    return result


@pytest.mark.parametrize(
    ("kind", "data", "said"),
    [
        ("obj", b"", r"is empty$"),
        ("obj", b"\n", r"has no triangles"),
        ("obj", V3, r"has no triangles"),
        ("obj", b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR", r"is not text, which OBJ is"),
        ("obj", b"<html>\n</html>\n", r"line 1, '<html>', is no OBJ"),
        ("obj", V3 + b"f 1 2 4\n", r"1 corners name a vertex that is not there, such as number 3; there are 3"),
        ("obj", V3 + b"f 1 2 -4\n", r"names number 0, or one before the first; OBJ counts from 1"),
        ("obj", V3 + b"f 0 1 2\n", r"names number 0"),
        ("obj", V3 + b"f 1 2 -9\n", r"names number 0"),
        ("obj", V3 + b"f 1 2 3\nf 1 2", r"face number 2 has fewer than 3 corners"),
        ("obj", V3 + b"f 1 2 3\nf\n", r"face number 2 has fewer than 3 corners"),
        ("obj", V3 + b"f 1 2 x\n", r"'x' is no corner of a face"),
        ("obj", V3 + b"f 1 2 3.5\n", r"'3.5' is no corner of a face"),
        ("obj", V3 + b"f 1/ 2/ 3/\n", r"'1/' is no corner of a face"),
        ("obj", V3 + b"f 1 2 99999999999999999999\n", r"'99999999999999999999' is no corner of a face"),
        ("obj", V3 + b"vt 0 0\nf 1/1 2/1 3/2\n", r"1 corners name a texture coordinate that is not there"),
        ("obj", b"v 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", r"has a vertex that is not 3 numbers: '0 0'"),
        ("obj", b"v a b c\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", r"has a vertex that is not 3 numbers: 'a b c'"),
        ("obj", b"v nan 0 0\nv 1 inf 0\nv 0 1 0\nf 1 2 3\n", r"2 of 3 vertices are not finite.*\(nan, 0, 0\)"),
        ("obj", b"v 1e30 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", r"1 of 3 vertices are not finite, or beyond 1e\+18"),
        ("obj", V3 + b"vt nan 0\nf 1/1 2/1 3/1\n", r"1 of 1 texture coordinates are not finite"),
        ("obj", V3 + b"f 1 1 2\n", r"has 1 triangles, and none of them has an area"),
        ("ply", ply()[:150], r"breaks off within|header does not end"),
        ("ply", ply()[:-8], r"breaks off within its 2 face elements"),
        ("ply", ply("binary_little_endian")[:-1], r"breaks off within its 2 face elements"),
        ("ply", ply("binary_big_endian")[:-40], r"breaks off within its 4 vertex elements"),
        ("ply", ply().replace(b"vertex 4", b"vertex 4000000000"), r"breaks off within its 4,000,000,000 vertex"),
        ("ply", ply().replace(b"vertex 4", b"vertex -4"), r"breaks off within"),
        ("ply", ply().replace(b"double x", b"quad x"), r"line that cannot be understood: 'property quad x'"),
        ("ply", ply().replace(b"format", b"formal"), r"line that cannot be understood: 'formal ascii 1.0'"),
        ("ply", ply().replace(b"double x", b"double w"), r"has no vertices with x, y and z"),
        ("ply", ply().replace(b"2.5", b"2.x"), r"something other than numbers after its header"),
        ("ply", ply(faces=[[0, 1, 4]]), r"corners name a vertex that is not there, such as number 4"),
        ("ply", ply(faces=[[0, 1]]), r"face number 1 has fewer than 3 corners"),
        ("ply", ply(faces=[]), r"has no faces"),
        ("ply", ply().replace(b"3 0 1 2", b"3 0 1 .5"), r"by something other than a whole number"),
        ("ply", b"solid\n", r"is no PLY"),
        ("stl", stl()[:-1], r"is no whole STL: its header announces 2 triangles, which is 184 bytes; it has 183"),
        ("stl", stl() + b"x", r"is no whole STL"),
        ("stl", stl_text()[:-50], r"is no whole STL: it breaks off before endsolid"),
        ("stl", stl_text().replace(b"endloop\nendfacet", b"endloop", 1), r"is no whole STL"),
        ("stl", stl_text().replace(b"\n vertex", b"\n corner", 1), r"has 2 facets but 5 vertices"),
        ("stl", stl(triangles=[]), r"has no triangles"),
        ("stl", b"PK\3\4", r"is no whole STL"),
        ("stl", stl(points=POINTS * np.nan), r"6 of 6 vertices are not finite"),
        ("glb", b"glTF", r"is glTF 0"),
        ("glb", obj(), r"is no GLB: it does not begin with 'glTF'"),
        ("glb", glb()[:-4], r"is no whole GLB: its header announces"),
        ("glb", glb().replace(b'{"asset"', b'["asset"'), r"its JSON cannot be read"),
        ("glb", changed_glb(lambda t: primitive(t).update(indices=99)), r"names number 99 of its accessors; there"),
        ("glb", changed_glb(lambda t: primitive(t).update(indices=-1)), r"names number -1 of its accessors"),
        ("glb", changed_glb(lambda t: primitive(t).update(indices=0)), r"indices that are no unsigned integers"),
        ("glb", changed_glb(lambda t: primitive(t).pop("attributes")), r"is no sound glTF: KeyError 'attributes'"),
        ("glb", changed_glb(lambda t: primitive(t).update(mode=0)), r"has no triangles in its scene"),
        ("glb", changed_glb(lambda t: primitive(t)["attributes"].update(POSITION=1)), r"positions of other than 3"),
        ("glb", changed_glb(lambda t: t["accessors"][0].update(count=5)), r"an accessor ends at byte 60 of 48"),
        ("glb", changed_glb(lambda t: t["accessors"][0].update(count=3)), r"not there, such as number 3; there are 3"),
        ("glb", changed_glb(lambda t: t["accessors"][1].update(count=3)), r"3 texture coordinates of 2 numbers for 4"),
        ("glb", changed_glb(lambda t: t["accessors"][0].pop("bufferView")), r"has an accessor without data"),
        ("glb", changed_glb(lambda t: t["bufferViews"][0].update(byteLength=9999)), r"a buffer view ends at byte"),
        ("glb", changed_glb(lambda t: t["bufferViews"][0].update(byteOffset=-8)), r"a buffer view ends at"),
        ("glb", changed_glb(lambda t: t["scenes"][0].update(nodes=[3])), r"names number 3 of its nodes"),
        ("glb", changed_glb(lambda t: t["nodes"][0].update(children=[0])), r"node 0 has two parents, or is inside"),
        ("glb", changed_glb(lambda t: t["nodes"][0].update(rotation=[0, 0, 0, 0])), r"rotation is no quaternion"),
        ("glb", changed_glb(lambda t: t["nodes"][0].update(scale=[1e300, 1e300, 1])), r"vertices are not finite"),
        ("glb", changed_glb(lambda t: t["nodes"][0].update(scale=[0, 1, 0])), r"none of them has an area"),
        ("glb", changed_glb(lambda t: t.update(buffers=[{"uri": "../../etc/passwd"}])), r"in another file, '../../"),
        ("glb", changed_glb(lambda t: t.update(buffers=[{"uri": "/etc/passwd"}])), r"in another file, '/etc/passwd'"),
        ("glb", changed_glb(lambda t: t.update(extensionsRequired=["EXT_x"])), r"needs the glTF extension EXT_x"),
        ("gltf", b"{}", r"is glTF in several files; export it as one .glb"),
        ("fbx", b"x", r"unknown kind of mesh file '.fbx'; .*: .obj, .ply, .stl, .glb"),
    ],
    ids=lambda value: value if isinstance(value, str) and len(value) < 5 else '',
)  # fmt: skip
def test_refusals(tmp_path: Path, kind: str, data: bytes, said: str) -> None:
    file = tmp_path / f"mesh.{kind}"
    file.write_bytes(data)
    with pytest.raises(MeshError) as caught:
        load_mesh(file)
    message = str(caught.value)
    assert message.startswith(f"{file}: ")
    assert "\n" not in message
    assert re.search(said, message)


def test_files_that_are_none(tmp_path: Path) -> None:
    with pytest.raises(MeshError, match=r"none.obj: there is no such mesh file$"):
        load_mesh(tmp_path / "none.obj")
    (tmp_path / "folder.obj").mkdir()
    with pytest.raises(MeshError, match=r"is a folder; name the mesh file in it"):
        load_mesh(tmp_path / "folder.obj")


def test_limits(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "mesh.glb"
    made = Glb()
    patch = made.patch()
    file.write_bytes(made.nodes(*({"mesh": patch} for _ in range(9)), roots=list(range(9))).bytes())
    monkeypatch.setattr("glbump.meshformats.glb.MOST_TRIANGLES", 17)
    with pytest.raises(LimitError, match="has more than 17 triangles"):
        load_mesh(file)
    monkeypatch.setattr("glbump.meshfile.MOST_BYTES", 100)
    with pytest.raises(LimitError, match="at most 100 are read"):
        load_mesh(file)


@pytest.mark.parametrize(
    ("kind", "data"),
    [
        ("obj", obj()),
        ("ply", ply()),
        ("ply", ply("binary_little_endian")),
        ("stl", stl()),
        ("stl", stl_text()),
        ("glb", glb()),
    ],
)
def test_damaged_files_are_refused_or_right(tmp_path: Path, kind: str, data: bytes) -> None:
    """Cut anywhere, or with bytes changed anywhere: a sound mesh or a one-line error, nothing else."""
    rng = np.random.default_rng(11)
    file = tmp_path / f"mesh.{kind}"
    refused = 0
    for trial in range(250):
        damaged = bytearray(data)
        if trial % 5 == 0:
            del damaged[rng.integers(len(data)) :]
        for _ in range(rng.integers(1, 4)):
            if damaged:
                damaged[rng.integers(len(damaged))] = rng.choice([0, 9, 32, 45, 48, 57, 255, rng.integers(256)])
        file.write_bytes(bytes(damaged))
        try:
            check(load_mesh(file))
        except GlbumpError as why:
            refused += "\n" not in str(why)
    assert refused > 50


@pytest.mark.parametrize("kind", ["obj", "ply", "stl", "glb"])
def test_reads_what_another_library_writes(load: Any, kind: str) -> None:
    trimesh = pytest.importorskip("trimesh", reason="trimesh, the outside reader and writer, is not installed")
    torus = tessellate(Torus(), 12)
    uv = np.random.default_rng(1).uniform(size=(len(torus.positions), 2))
    theirs = trimesh.Trimesh(torus.positions, torus.triangles, process=False)
    if kind != "stl":
        theirs.visual = trimesh.visual.TextureVisuals(uv=uv)
    written = theirs.export(file_type=kind, **({"include_normals": False} if kind == "obj" else {}))
    mesh = load(kind, written.encode() if isinstance(written, str) else written)
    table = torus.positions if kind == "stl" else np.hstack([torus.positions, uv])
    want = np.sort(table[torus.triangles].reshape(len(torus.triangles), -1), axis=1)
    mine = mesh.positions if mesh.uv is None else np.hstack([mesh.positions, mesh.uv])
    got = np.sort(mine[mesh.triangles].reshape(len(mesh.triangles), -1), axis=1)
    # Text with 8 digits, or 32-bit floats. The order of triangles is kept.
    np.testing.assert_allclose(got, want, atol=2e-7)
