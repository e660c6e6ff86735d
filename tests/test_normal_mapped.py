"""The axes of normal maps on mesh files: MikkTSpace's, or the tangents of a GLB, w as given."""

from __future__ import annotations

import json
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from glbump import reference
from glbump.environment import LatLong
from glbump.errors import MeshError
from glbump.gl.renderer import Renderer
from glbump.maps.layout import LATLONG, texel_dirs
from glbump.mesh import Mesh, in_frame, in_repeats
from glbump.meshfile import load_mesh
from glbump.mikktspace import corner_tangents, normal_mapped
from glbump.scene import Material, NormalMap, Scene, Surface
from glbump.shapes import MeshFile

F64 = npt.NDArray[np.float64]

# A roof of two sloping squares, u towards the ridge from both sides: their uv are mirrored to each other.
POINTS = np.array([[-1, -1, 0], [0, -1, 0.5], [1, -1, 0], [-1, 1, 0], [0, 1, 0.5], [1, 1, 0]])
NORMALS = np.array([[-0.6, 0, 0.8], [0, 0, 1], [0.6, 0, 0.8]] * 2)
UV = np.array([[0, 0.25], [1, 0.25], [0, 0.25], [0, 0.75], [1, 0.75], [0, 0.75]])
TRIANGLES = np.array([[0, 1, 4], [0, 4, 3], [1, 2, 5], [1, 5, 4]])
TANGENTS = np.array([[0.8, 0, 0.6, 1], [0, 1, 0, 1], [0, 1, 0, -1]] * 2)  # no MikkTSpace, but at right angles

EXACT = 1e-6
"""Numbers in a GLB are 32-bit floats."""


def obj() -> bytes:
    lines = [f"v {x} {y} {z}" for x, y, z in POINTS.tolist()]
    lines += [f"vt {u} {v}" for u, v in UV.tolist()] + [f"vn {x} {y} {z}" for x, y, z in NORMALS.tolist()]
    lines += ["f " + " ".join(f"{i}/{i}/{i}" for i in t) for t in (TRIANGLES + 1).tolist()]
    return "\n".join(lines).encode()


def glb(*primitives: dict[str, Any], matrix: list[float] | None = None) -> bytes:
    """The roof, once for each of `primitives`: attributes to set, or with None to leave out."""
    binary, views, accessors, parts = b"", [], [], []

    def accessor(values: F64, kind: str) -> int:
        nonlocal binary
        data = values.astype({5126: "<f4", 5123: "<u2"}[5126 if kind != "SCALAR" else 5123]).tobytes()
        views.append({"buffer": 0, "byteOffset": len(binary), "byteLength": len(data)})
        binary += data + b"\0" * (-len(data) % 4)
        component = 5123 if kind == "SCALAR" else 5126
        accessors.append({"bufferView": len(views) - 1, "componentType": component, "count": len(values), "type": kind})
        return len(accessors) - 1

    down = np.column_stack([UV[:, 0], 1 - UV[:, 1]])
    for changes in primitives:
        values = {"POSITION": POINTS, "NORMAL": NORMALS, "TEXCOORD_0": down, "TANGENT": TANGENTS} | changes
        attributes = {k: accessor(v, f"VEC{v.shape[1]}") for k, v in values.items() if v is not None}
        parts.append({"attributes": attributes, "indices": accessor(TRIANGLES.reshape(-1), "SCALAR")})
    tree = {
        "asset": {"version": "2.0"},
        "buffers": [{"byteLength": len(binary)}],
        "bufferViews": views,
        "accessors": accessors,
        "meshes": [{"primitives": parts}],
        "nodes": [{"mesh": 0} | ({"matrix": matrix} if matrix else {})],
        "scenes": [{"nodes": [0]}],
    }
    text = json.dumps(tree).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(binary), b"BIN\0") + binary
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


@pytest.fixture
def load(tmp_path: Path) -> Callable[[bytes], Mesh]:
    def loaded(data: bytes) -> Mesh:
        file = tmp_path / ("mesh.glb" if data[:4] == b"glTF" else "mesh.obj")
        file.write_bytes(data)
        return load_mesh(file)

    return loaded


def axes(mesh: Mesh) -> tuple[F64, F64]:
    """Tangent and bitangent (T, 3, 3) at the corners, as unit vectors; 0 where there are none."""
    mapped = normal_mapped(mesh)
    assert np.array_equal(mapped.positions[mapped.triangles], mesh.positions[mesh.triangles])
    assert mapped.uv is not None
    assert mesh.uv is not None
    assert np.array_equal(mapped.uv[mapped.triangles], mesh.uv[mesh.triangles])
    found = []
    for values in (mapped.dpdu, mapped.dpdv):
        assert values is not None
        lengths = np.linalg.norm(values, axis=1, keepdims=True)
        found.append((values / np.where(lengths > 0, lengths, 1))[mapped.triangles])
    return found[0], found[1]


def of_mikktspace(mesh: Mesh) -> tuple[F64, F64]:
    assert mesh.uv is not None
    assert mesh.normals is not None
    n = mesh.normals[mesh.triangles]
    tangents = corner_tangents(mesh.positions[mesh.triangles], n, mesh.uv[mesh.triangles]).tangents.astype(np.float64)
    return tangents[..., :3], tangents[..., 3:] * np.cross(n, tangents[..., :3])


@pytest.mark.parametrize("data", [obj(), glb({"TANGENT": None})])
def test_meshes_without_tangents_have_mikktspace(load: Callable[[bytes], Mesh], data: bytes) -> None:
    mesh = load(data)
    assert mesh.tangents is None
    for got, want in zip(axes(mesh), of_mikktspace(mesh)):
        np.testing.assert_allclose(got, want, atol=EXACT)
    # Up the roof on both sides, and v the same way: the second side is mirrored.
    t, b = axes(mesh)
    np.testing.assert_allclose(t[0, 0], [0.8, 0, 0.6], atol=EXACT)
    np.testing.assert_allclose(t[2, 1], [-0.8, 0, 0.6], atol=EXACT)
    np.testing.assert_allclose(b, np.broadcast_to([0.0, 1, 0], b.shape), atol=EXACT)


def test_a_glbs_tangents_are_used_as_given(load: Callable[[bytes], Mesh]) -> None:
    mesh = load(glb({}))
    assert mesh.notes == ()
    t, b = axes(mesh)
    given = TANGENTS[TRIANGLES]
    np.testing.assert_allclose(t, given[..., :3], atol=EXACT)
    np.testing.assert_allclose(b, given[..., 3:] * np.cross(NORMALS[TRIANGLES], given[..., :3]), atol=EXACT)
    # w as given, though uv say otherwise.
    _, turned = axes(load(glb({"TANGENT": TANGENTS * [1, 1, 1, -1]})))
    np.testing.assert_allclose(turned, -b, atol=EXACT)
    # Heights go by dp/du and dp/dv all the same.
    plain = load(glb({"TANGENT": None}))
    for name in ("positions", "triangles", "dpdu", "dpdv"):
        assert np.array_equal(getattr(mesh, name), getattr(plain, name))


def test_tangents_move_with_their_node(load: Callable[[bytes], Mesh]) -> None:
    """Stretched along x and turned; mirrored, the bitangent stays where the picture has it."""
    turn = np.array([[0, 0, 1], [1, 0, 0], [0, 1, 0]])
    t, b = axes(load(glb({})))
    for stretch in (2.0, -2.0):
        linear = turn @ np.diag([stretch, 1, 1])
        matrix = np.eye(4)
        matrix[:3, :3] = linear
        mesh = load(glb({}, matrix=matrix.T.reshape(-1).tolist()))
        got_t, got_b = axes(mesh)
        if stretch < 0:  # its corners are in the other order
            got_t, got_b = got_t[:, ::-1], got_b[:, ::-1]
        moved = t @ linear.T
        np.testing.assert_allclose(got_t, moved / np.linalg.norm(moved, axis=-1, keepdims=True), atol=EXACT)
        assert np.all(np.sum(got_b * (b @ linear.T), axis=-1) > 0.5)


def test_tangents_need_normals(load: Callable[[bytes], Mesh]) -> None:
    assert load(glb({"NORMAL": None})).tangents is None


def test_where_a_glb_has_no_tangents_mikktspace_fills_in(load: Callable[[bytes], Mesh]) -> None:
    mesh = load(glb({"TANGENT": None}, {}))
    assert mesh.notes == ()
    t, b = axes(mesh)
    wanted = of_mikktspace(load(glb({"TANGENT": None})))
    for got, want, given in zip((t, b), wanted, axes(load(glb({})))):
        np.testing.assert_allclose(got[:4], want, atol=EXACT)
        np.testing.assert_allclose(got[4:], given, atol=EXACT)


@pytest.mark.parametrize(("column", "value"), [(slice(0, 3), 0.0), (3, 0.0), (3, 0.5)])
def test_tangents_that_mean_nothing_are_told_and_replaced(
    load: Callable[[bytes], Mesh], column: Any, value: float
) -> None:
    spoilt = TANGENTS.copy()
    spoilt[2, column] = value
    mesh = load(glb({"TANGENT": spoilt}))
    assert mesh.notes == (
        "1 of 6 tangents have no direction, or another w than 1 and -1; MikkTSpace's are taken there",
    )
    t, _ = axes(mesh)
    np.testing.assert_allclose(t[2, 1], of_mikktspace(mesh)[0][2, 1], atol=EXACT)
    np.testing.assert_allclose(t[2, 0], TANGENTS[1, :3], atol=EXACT)


def test_tangents_that_are_not_finite_are_refused(load: Callable[[bytes], Mesh]) -> None:
    spoilt = TANGENTS.copy()
    spoilt[3, 1] = np.nan
    with pytest.raises(MeshError, match="1 of 6 tangents are not finite"):
        load(glb({"TANGENT": spoilt}))
    with pytest.raises(MeshError, match="has 6 tangents of 3 numbers for 6 vertices, not 4"):
        load(glb({"TANGENT": TANGENTS[:, :3]}))


def test_where_uv_have_no_area_there_are_no_axes(load: Callable[[bytes], Mesh]) -> None:
    """As with dp/du: a normal map does not show on such triangles, neighbours or not."""
    uv = UV.copy()
    uv[[2, 5]] = uv[[1, 4]]
    t, b = axes(load(glb({"TANGENT": None, "TEXCOORD_0": uv})))
    assert np.all(t[2:] == 0)
    assert np.all(b[2:] == 0)
    assert np.all(np.linalg.norm(t[:2], axis=-1) > 0.99)


def test_axes_survive_any_unit_and_repeat(load: Callable[[bytes], Mesh]) -> None:
    """Of a mesh 1e17 wide, counted from its middle in its own size, with uv past what 32 bits hold."""
    huge = load(glb({"POSITION": POINTS * 1e17}))
    small = normal_mapped(load(glb({})))
    mapped = in_repeats(in_frame(normal_mapped(huge), np.zeros(3), 1e17), (1000.0, 1000.0))
    assert mapped.dpdu is not None
    assert small.dpdu is not None
    np.testing.assert_allclose(mapped.dpdu[mapped.triangles], small.dpdu[small.triangles], rtol=1e-6, atol=1e-6)


def test_pictures_show_them(renderer: Renderer, tmp_path: Path) -> None:
    """A mirror that tells where it looks: the GPU agrees with the reference, and w turned round is the map's green
    turned round."""
    directions = texel_dirs(LATLONG, (128, 64))[0]
    compass = LatLong((0.5 + 0.5 * directions).astype(np.float32))
    lean = np.broadcast_to(np.float32([0.3, 0.4, np.sqrt(0.75)]), (4, 4, 3)).copy()

    def seen(data: bytes, *, by: Any = renderer.render, flip_y: bool = False) -> npt.NDArray[np.float32]:
        (tmp_path / "roof.glb").write_bytes(data)
        surface = Surface(
            MeshFile(tmp_path / "roof.glb"), Material(metallic=1, roughness=0), NormalMap(lean, flip_y=flip_y)
        )
        return by(Scene([surface], compass), size=(48, 48), quality="exact").pixels

    given, turned = (glb({"TANGENT": np.column_stack([TANGENTS[:, :3], np.full(6, w)])}) for w in (1, -1))
    for data in (given, turned, glb({"TANGENT": None})):
        difference = np.abs(seen(data) - seen(data, by=reference.render)).max(axis=2)
        # Measured 2e-5. Not at the outline, and where the reflection crosses the picture's pole, between its texels.
        assert np.quantile(difference, 0.9) < 1e-4
    np.testing.assert_allclose(seen(turned, flip_y=True), seen(given), atol=1e-5)
    assert np.abs(seen(turned) - seen(given)).max() > 0.1
