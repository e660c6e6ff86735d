"""True displacement O' = O + B N/|N|: places and normals against what mathematics says they are."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import glbump as gb
from glbump import displace
from glbump.contents import Contents
from glbump.displace import Heights, cells_for, cells_of_maps, displaced
from glbump.errors import LimitError, SceneError
from glbump.maps.angles import degrees_between
from glbump.shapes import MESHES

F64 = npt.NDArray[np.float64]
EVEN = np.full((2, 2), 0.5, np.float32)


def waves(width: int = 32, height: int = 32, u: int = 1, v: int = 1) -> npt.NDArray[np.float32]:
    """0..1: whole waves over a map, which the spline follows to 1e-4 of the amplitude at 8 texels a wave."""
    x, y = np.meshgrid((np.arange(width) + 0.5) / width, (np.arange(height)[::-1] + 0.5) / height)
    return (0.5 + 0.5 * np.sin(2 * np.pi * u * x) * np.cos(2 * np.pi * v * y)).astype(np.float32)


def arrays(surface: gb.Surface) -> tuple[F64, F64, F64, npt.NDArray[np.int64]]:
    """Positions, normals, uv and triangles."""
    assert isinstance(surface.shape, gb.MeshData)
    data = surface.shape
    return tuple(np.asarray(a) for a in (data.positions, data.normals, data.uv, data.triangles))  # type: ignore[return-value]


def facets(positions: F64, triangles: Any) -> F64:
    a, b, c = (positions[triangles[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    return normal / np.linalg.norm(normal, axis=1, keepdims=True)


def test_an_even_height_makes_a_larger_ball_and_a_thicker_ring() -> None:
    p, n, _, _ = arrays(displaced(gb.Surface(gb.Sphere(2.0), bump=gb.Bump(EVEN, 0.5)), (40, 20)))
    assert np.linalg.norm(p, axis=1) == pytest.approx(2.25, abs=1e-12)
    assert degrees_between(n, p / 2.25).max() < 1e-12
    p, n, _, _ = arrays(displaced(gb.Surface(gb.Torus(1.0, 0.3), bump=gb.Bump(EVEN, -0.2)), (40, 20)))
    ring = p[:, [0, 2]] / np.linalg.norm(p[:, [0, 2]], axis=1, keepdims=True)
    from_ring = p - np.stack([ring[:, 0], 0 * ring[:, 0], ring[:, 1]], axis=1)
    assert np.linalg.norm(from_ring, axis=1) == pytest.approx(0.2, abs=1e-12)
    assert degrees_between(n, from_ring / 0.2).max() < 1e-12


def test_a_plane_becomes_its_height_map() -> None:
    surface = gb.Surface(gb.Plane((4.0, 2.0)), bump=gb.Bump(waves(u=2, v=1), 0.3))
    p, n, uv, triangles = arrays(displaced(surface, (50, 70)))
    assert p[:, 0] == pytest.approx(4 * (uv[:, 0] - 0.5))
    assert p[:, 2] == pytest.approx(-2 * (uv[:, 1] - 0.5))
    x, y = 4 * np.pi * uv[:, 0], 2 * np.pi * uv[:, 1]
    # 16 texels a wave: the spline is off by (2 pi / 16)^4 / 120 of its amplitude of 0.15.
    assert p[:, 1] == pytest.approx(0.15 + 0.15 * np.sin(x) * np.cos(y), abs=4e-5)
    slope_x = 0.15 * np.cos(x) * np.cos(y) * 4 * np.pi / 4
    slope_z = -0.15 * np.sin(x) * np.sin(y) * 2 * np.pi / -2
    want = np.stack([-slope_x, np.ones_like(x), -slope_z], axis=1)
    assert degrees_between(n, want / np.linalg.norm(want, axis=1, keepdims=True)).max() < 0.05
    assert (facets(p, triangles)[:, 1] > 0).all()


@pytest.mark.parametrize(
    "shape", [gb.Torus(1.0, 0.4), gb.Sphere(0.7), gb.Quad(((0, 0, 0), (2, 0, 0), (3, 2, 0), (0, 1, 0)))]
)
def test_normals_are_those_of_the_triangles_in_the_limit(shape: Any) -> None:
    """The triangles know nothing of derivatives: their normals come nearer as they get smaller."""
    surface = gb.Surface(shape, bump=gb.Bump(waves(), 0.3, repeat=(3, 2)))
    errors = []
    for cells in (100, 200):
        p, n, uv, triangles = arrays(displaced(surface, (cells, cells)))
        mean = n[triangles].mean(axis=1)
        # Next to the poles the map is pinched.
        inner = (np.abs(uv[triangles][..., 1] - 0.5) < 0.4).all(axis=1)
        angle = degrees_between(facets(p, triangles), mean / np.linalg.norm(mean, axis=1, keepdims=True))
        errors.append(angle[inner].max())
    assert errors[1] < 5.0
    assert errors[0] / errors[1] > 1.8  # a triangle's own normal is that of its middle to first order


@pytest.mark.parametrize("form", ["small", "flat"])
def test_the_limit_is_not_that_of_another_normal(form: str) -> None:
    """What the test above would reject: without B n_u the normals stay apart however small the triangles."""
    from glbump.reference import bump as bumps

    surface, contents = gb.Surface(gb.Torus(1.0, 0.4), bump=gb.Bump(waves(), 0.3, repeat=(3, 2))), Contents()
    points = displace.points_of(surface.shape, (200, 200), contents)
    _, slope = Heights(surface, contents).at(points.uv)
    gradient = bumps.surface_gradient(points.n, points.dpdu, points.dpdv, slope if form == "small" else 0 * slope)
    p, _, _, triangles = arrays(displaced(surface, (200, 200)))
    mean = bumps.bump_normal(points.n, gradient)[triangles].mean(axis=1)
    assert degrees_between(facets(p, triangles), mean / np.linalg.norm(mean, axis=1, keepdims=True)).max() > 8.0


TRANSFORMS = [
    gb.Transform(translate=(1, 2, 3), rotate=(20, 30, 40), scale=2.5),
    gb.Transform(translate=(-1, 0, 0), scale=(1, 2, 0.5)),
    gb.Transform(rotate=(0, 45, 0), scale=(-1, 1, 1)),
]


@pytest.mark.parametrize("transform", TRANSFORMS)
def test_heights_are_world_lengths_along_the_worlds_normal(transform: gb.Transform) -> None:
    surface = gb.Surface(gb.Torus(1.0, 0.4), bump=gb.Bump(EVEN, 0.1), transform=transform)
    moved = displaced(surface, (60, 40))
    points = displace.points_of(surface.shape, (60, 40), Contents())
    matrix, own = transform.matrix(), moved.transform.matrix()
    before = points.p @ matrix[:3, :3].T + matrix[:3, 3]
    p, n, _, triangles = arrays(moved)
    after = p @ own[:3, :3].T + own[:3, 3]
    normal = points.n @ np.linalg.inv(matrix[:3, :3])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    assert after - before == pytest.approx(0.05 * normal, abs=1e-12)
    # The triangles face outwards, mirrored or not, and an even height leaves the normals as they were.
    mean = n[triangles].mean(axis=1)
    assert (np.einsum("nk,nk->n", facets(p, triangles), mean) > 0).all()
    assert degrees_between(n, normal).max() < 1e-9


def test_a_cube_parts_at_its_edges_and_each_face_goes_out() -> None:
    p, n, _, triangles = arrays(displaced(gb.Surface(gb.Cube((2, 2, 2)), bump=gb.Bump(EVEN, 0.2)), (3, 4)))
    assert len(triangles) == 6 * 2 * 3 * 4
    assert np.abs(p).max(axis=1) == pytest.approx(1.1)
    assert np.einsum("nk,nk->n", p, n) == pytest.approx(1.1)
    assert (np.einsum("nk,nk->n", facets(p, triangles), n[triangles[:, 0]]) > 0).all()


def ball_file(folder: Path, rows: int) -> gb.MeshFile:
    """A ball of radius 1 as an OBJ with normals and the sphere's own u, v."""
    points = displace.points_of(gb.Sphere(), (2 * rows, rows), Contents())
    lines = [f"v {x!r} {y!r} {z!r}\nvn {x!r} {y!r} {z!r}" for x, y, z in points.p.tolist()]
    lines += [f"vt {u!r} {v!r}" for u, v in points.uv.tolist()]
    lines += ["f " + " ".join(f"{i}/{i}/{i}" for i in row) for row in (points.triangles + 1).tolist()]
    path = folder / f"ball{rows}.obj"
    path.write_text("\n".join(lines))
    return gb.MeshFile(path)


def test_a_mesh_file_is_divided_and_comes_near_the_true_shape(tmp_path: Path) -> None:
    bump = gb.Bump(waves(), 0.2, repeat=(4, 2))
    errors = []
    for rows in (16, 32):
        p, n, uv, triangles = arrays(displaced(gb.Surface(ball_file(tmp_path, rows), bump=bump), (64, 64)))
        height, _ = Heights(gb.Surface(gb.Sphere(), bump=bump), Contents()).at(uv)
        inner = np.abs(uv[:, 1] - 0.5) < 0.35
        angle = 2 * np.pi * (uv[:, :1] - 0.5)
        rise = np.pi * (uv[:, 1:] - 0.5)
        out = np.concatenate([np.cos(rise) * np.sin(angle), np.sin(rise), np.cos(rise) * np.cos(angle)], axis=1)
        errors.append(np.linalg.norm(p - (1 + height)[:, None] * out, axis=1)[inner].max())
        assert (np.einsum("nk,nk->n", facets(p, triangles), n[triangles[:, 0]]) > 0)[inner[triangles].all(axis=1)].all()
    assert errors[1] < 0.01  # chords of the mesh's own triangles
    assert errors[0] / errors[1] > 3.3  # 4 in the limit


def test_edges_of_divided_triangles_still_meet(tmp_path: Path) -> None:
    """Each edge that two triangles share is cut at the same points: but for the poles nothing is open."""
    p, _, uv, triangles = arrays(displaced(gb.Surface(ball_file(tmp_path, 6), bump=gb.Bump(waves(), 0.1)), (24, 24)))
    _, same = np.unique(np.round(p, 9), axis=0, return_inverse=True)
    corners = same.reshape(-1)[triangles]
    edges = np.stack([corners, np.roll(corners, -1, axis=1)], axis=-1).reshape(-1, 2)
    inner = np.repeat((np.abs(uv[triangles][..., 1] - 0.5) < 0.3).all(axis=1), 3)
    there = set(map(tuple, edges.tolist()))
    assert inner.sum() > 5000
    assert all((b, a) in there for a, b in edges[inner].tolist())


def test_maps_that_end_and_maps_that_mirror() -> None:
    ramp = np.tile(np.linspace(0, 1, 16, dtype=np.float32), (4, 1))
    uv = np.array([[0.5, 0.5], [-0.4, 0.5], [1.6, 0.5], [0.25, 2.0]])
    height, slope = Heights(gb.Surface(gb.Plane(), bump=gb.Bump(ramp, 2.0, border="clamp")), Contents()).at(uv)
    # Beyond the edge heights stay what they are there, half a texel past the last centre, where the spline swings over.
    assert height == pytest.approx([1.0, 0.0, 2.0, 2 * (0.25 * 16 - 0.5) / 15], abs=0.03)
    assert slope[0] == pytest.approx([2 * 16 / 15, 0], abs=1e-4)
    assert slope[1:3] == pytest.approx(np.zeros((2, 2)), abs=1e-12)
    height, _ = Heights(gb.Surface(gb.Plane(), bump=gb.Bump(ramp, 2.0, border="mirror")), Contents()).at(uv + [1, 0])
    want, _ = Heights(gb.Surface(gb.Plane(), bump=gb.Bump(ramp, 2.0, border="mirror")), Contents()).at((1, 1) - uv)
    assert height == pytest.approx(want, abs=1e-6)


def test_layers_add_up_and_normal_maps_stay() -> None:
    first, second = gb.Bump(waves(), 0.2), gb.Bump(waves(u=3), -0.05, repeat=(2, 2))
    flat = gb.NormalMap(np.full((2, 2, 3), (128, 128, 255), np.uint8))
    uv = np.random.default_rng(1).uniform(size=(50, 2))
    each = [Heights(gb.Surface(gb.Plane(), bump=b), Contents()).at(uv) for b in (first, second)]
    both = Heights(gb.Surface(gb.Plane(), bump=[first, flat, second]), Contents()).at(uv)
    for k in (0, 1):
        assert both[k] == pytest.approx(each[0][k] + each[1][k])
    assert displaced(gb.Surface(gb.Plane(), bump=[first, flat]), (4, 4)).bump == (flat,)
    assert displaced(gb.Surface(gb.Plane(), bump=first), (4, 4)).bump is None


def test_cells_follow_the_map_and_the_frame() -> None:
    contents = Contents()
    surface = gb.Surface(gb.Plane((2, 2)), bump=gb.Bump(waves(64, 16), 0.1, repeat=(4, 3)))
    assert cells_of_maps(surface, contents) == (2 * 64 * 4, 2 * 16 * 3)
    camera = gb.Camera(eye=(0, 5, 0.001), target=(0, 0, 0), fov=40)
    per_unit = 100 / (2 * np.tan(np.radians(20)) * 5)
    near, _ = cells_for(surface, camera, (100, 100), contents)
    assert near == pytest.approx(2 * per_unit, abs=2)  # a cell a pixel
    assert cells_for(surface, camera, (4000, 4000), contents) == cells_of_maps(surface, contents)
    within = gb.Camera(eye=(0, 0, 0.5), target=(0, 0, 0))
    assert cells_for(surface, within, (100, 100), contents) == cells_of_maps(surface, contents)


REFUSED = [
    (gb.Surface(gb.Plane()), None, SceneError, "no heights to be displaced by"),
    (gb.Surface(gb.Plane(), bump=gb.NormalMap(np.full((2, 2, 3), 0.5))), None, SceneError, "no heights"),
    (gb.Surface(gb.Plane(), bump=gb.Bump(EVEN, 1, scaling="parameter")), None, SceneError, "are no lengths"),
    (
        gb.Surface(gb.Plane(), bump=gb.Bump(EVEN, 1, mapping="triplanar")),
        None,
        SceneError,
        "are displaced by u and v; use mapping",
    ),
    (gb.Surface(gb.Plane(), bump=gb.Bump(EVEN, 1)), (2000, 2000), LimitError, "8,000,000 triangles; at most 2,000,000"),
    (gb.Surface(gb.Sphere(), bump=gb.Bump(waves(), 1, repeat=(64, 64))), None, LimitError, "4,096 x 4,096 cells"),
    (gb.Surface(gb.Plane(), bump=gb.Bump(EVEN, 1e30)), (3, 3), LimitError, r"heights reach 5e\+29, .*lower bump.ampl"),
    (gb.Surface(gb.Plane(), bump=gb.Bump(EVEN, 1)), (0, 3), SceneError, r"cells\[0\] must be .*; got 0"),
    (gb.Surface(gb.Plane(), bump=gb.Bump(EVEN, 1)), 3, SceneError, "cells must be 2 numbers; got 3"),
    (
        gb.Surface(gb.MeshData(np.eye(3), [[0, 1, 2]]), bump=gb.Bump(EVEN, 1)),
        (3, 3),
        SceneError,
        "a mesh of 1 triangles has no texture coordinates",
    ),
]


@pytest.mark.parametrize(("surface", "cells", "kind", "said"), REFUSED)
def test_refusals(surface: gb.Surface, cells: Any, kind: Any, said: str) -> None:
    with pytest.raises(kind, match=said):
        displaced(surface, cells)


@pytest.mark.parametrize("amplitude", [1e-30, -1.0, 1e6, 1e17])
def test_amplitudes_of_any_size_make_finite_meshes(amplitude: float) -> None:
    p, n, _, _ = arrays(displaced(gb.Surface(gb.Torus(), bump=gb.Bump(waves(), amplitude)), (30, 30)))
    assert np.isfinite(p).all()
    assert np.linalg.norm(n, axis=1) == pytest.approx(1)


def test_both_renderers_draw_the_same_displaced_surface() -> None:
    bump = gb.Bump(waves(), 0.3, repeat=(6, 3))
    surface = gb.Surface(gb.Torus(), gb.Material(metallic=1, roughness=0), bump)
    moved = displaced(surface, (180, 120))
    assert isinstance(moved.shape, MESHES)
    scene = gb.Scene([moved], camera=gb.Camera(eye=(0, 2, 3), fov=40))
    drawn = gb.render(scene, size=(96, 96), quality="exact")
    cast = gb.reference.render(scene, size=(96, 96), samples=16)
    # Mean over the frame: pixels at edges of triangles differ by the samples' places.
    assert np.abs(np.asarray(drawn)[..., :3] - np.asarray(cast)[..., :3]).mean() < 2e-3
    # The bumped, undisplaced ring is another picture.
    other = gb.reference.render(gb.Scene([surface], camera=scene.camera), size=(96, 96), samples=4)
    assert np.abs(np.asarray(other)[..., :3] - np.asarray(cast)[..., :3]).mean() > 0.02
