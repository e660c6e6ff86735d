"""Triangles of the analytic shapes: closed, outward, as exact as promised and no more of them than that."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest

from glbump.errors import MeshError, SceneError
from glbump.mesh import Mesh, bounds, outline, outline_matrix, segments_for, tessellate
from glbump.shapes import Cube, MeshFile, Plane, Quad, Shape, Sphere, Torus

ROUND = [Sphere(), Sphere(3.5), Torus(), Torus(1, 0.9), Torus(2, 0.01)]
SKEW = Quad(((-1, -1, 0), (2, -1.5, 0), (1, 1, 0), (-1, 0.5, 0)))
FLAT = [Quad(), SKEW, Quad(((0, 0, 0), (0, 1, 0), (0, 1, 1), (0, 0, 2))), Plane((3, 5)), Cube((1, 2, 3))]


def points(mesh: Mesh) -> npt.NDArray[np.float64]:
    return mesh.positions[mesh.triangles]


def area_normals(mesh: Mesh) -> npt.NDArray[np.float64]:
    p = points(mesh)
    return np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]) / 2


def directed_edges(mesh: Mesh) -> npt.NDArray[np.int64]:
    t = mesh.triangles.astype(np.int64)
    return np.concatenate([t[:, [0, 1]], t[:, [1, 2]], t[:, [2, 0]]])


def outer_radius(shape: Shape) -> float:
    return shape.radius + (shape.tube if isinstance(shape, Torus) else 0)


def allowed(shape: Shape, segments: int) -> float:
    """The promise of tessellate: the regular polygon's distance from its circle."""
    return outer_radius(shape) * (1 - np.cos(np.pi / segments))


def distance(shape: Shape, p: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Signed distance from the true surface, positive outside."""
    if isinstance(shape, Sphere):
        return np.linalg.norm(p, axis=-1) - shape.radius
    ring = np.hypot(p[..., 0], p[..., 2]) - shape.radius
    return np.hypot(ring, p[..., 1]) - shape.tube


@pytest.mark.parametrize("segments", [3, 4, 7, 8, 33, 128])
@pytest.mark.parametrize("shape", ROUND, ids=repr)
def test_closed_surface(shape: Shape, segments: int) -> None:
    """Watertight and consistently turned: every directed edge once, and once the other way round."""
    mesh = tessellate(shape, segments)
    edges = directed_edges(mesh)
    code = edges[:, 0] * len(mesh.positions) + edges[:, 1]
    back = edges[:, 1] * len(mesh.positions) + edges[:, 0]
    assert len(np.unique(code)) == len(code)
    assert np.array_equal(np.sort(code), np.sort(back))
    assert np.array_equal(np.unique(mesh.triangles), np.arange(len(mesh.positions)))
    euler = len(mesh.positions) - len(edges) // 2 + len(mesh.triangles)
    assert euler == (2 if isinstance(shape, Sphere) else 0)
    assert mesh.triangles.dtype == np.int32
    assert mesh.triangles.flags.c_contiguous
    # Shared vertices are shared by index: no two positions coincide.
    assert len(np.unique(np.round(mesh.positions / outer_radius(shape), 9), axis=0)) == len(mesh.positions)


@pytest.mark.parametrize("segments", [3, 8, 33, 128])
@pytest.mark.parametrize("shape", ROUND, ids=repr)
def test_outward_and_not_degenerate(shape: Shape, segments: int) -> None:
    mesh = tessellate(shape, segments)
    normals = area_normals(mesh)
    area = np.linalg.norm(normals, axis=1)
    assert area.min() > 1e-2 * area.mean() * (1 - shape.tube / shape.radius if isinstance(shape, Torus) else 1)
    if isinstance(shape, Sphere):
        assert np.all(np.sum(normals * points(mesh).mean(axis=1), axis=1) > 0)
    # The divergence theorem: a closed surface turned outward holds a volume above 0, here one near the true.
    volume = np.sum(points(mesh)[:, 0] * normals) / 3
    r = shape.radius
    true = 4 / 3 * np.pi * r**3 if isinstance(shape, Sphere) else 2 * np.pi**2 * r * shape.tube**2
    assert 0 < volume < true
    if segments == 128 and not (isinstance(shape, Torus) and shape.tube < 0.1):
        assert volume > 0.997 * true


@pytest.mark.parametrize("segments", [3, 4, 5, 6, 8, 11, 16, 40, 100])
@pytest.mark.parametrize("shape", [*ROUND, Torus(1, 0.999)], ids=repr)
def test_distance_bound(shape: Shape, segments: int) -> None:
    """Every vertex on the surface; no point of the mesh farther from it than promised."""
    mesh = tessellate(shape, segments)
    r = outer_radius(shape)
    assert np.abs(distance(shape, mesh.positions)).max() < 4e-16 * r  # two roundings
    weights = np.random.default_rng(5).dirichlet([1, 1, 1], size=60)
    weights = np.concatenate([weights, [[1 / 3] * 3, [0.5, 0.5, 0], [0.5, 0, 0.5], [0, 0.5, 0.5]]])
    off = distance(shape, np.einsum("kc,tcd->tkd", weights, points(mesh)))
    assert np.abs(off).max() < allowed(shape, segments)
    if isinstance(shape, Sphere):
        assert off.max() < 4e-16 * r  # inscribed


def silhouette_gap(mesh: Mesh, directions: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """How far a unit ball's mesh shows its outline inside the true circle, the worst place of each view."""
    edges = directed_edges(mesh)
    faces = np.tile(np.arange(len(mesh.triangles)), 3)
    by = np.lexsort((edges.min(axis=1), edges.max(axis=1)))
    left, right = faces[by[::2]], faces[by[1::2]]
    a, b = mesh.positions[edges[by[::2]]].swapaxes(0, 1)
    facing = area_normals(mesh) @ directions.T > 0
    gaps = []
    for d, seen in zip(directions, facing.T):
        outline = seen[left] != seen[right]
        p, q = (v[outline] - np.outer(v[outline] @ d, d) for v in (a, b))
        t = np.clip(np.sum(-p * (q - p), axis=1) / np.sum((q - p) ** 2, axis=1), 0, 1)
        gaps.append(1 - np.linalg.norm(p + t[:, None] * (q - p), axis=1).min())
    return np.array(gaps)


@pytest.mark.parametrize("segments", [8, 20, 64])
def test_sphere_silhouette_of_random_views(segments: int) -> None:
    """The outline keeps the promise in every view, and in the worst of them nearly uses it up."""
    directions = np.random.default_rng(2).normal(size=(400, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    gaps = silhouette_gap(tessellate(Sphere(), segments), directions)
    assert gaps.max() <= allowed(Sphere(), segments)
    # f is a whole number, at best 1/f too fine: (f/(f+1))^2 of the bound, and 400 views miss the very worst.
    f = np.sqrt(len(tessellate(Sphere(), segments).triangles) / 20)
    assert gaps.max() > 0.85 * ((f - 1) / f) ** 2 * allowed(Sphere(), segments)


def test_sphere_needs_few_triangles() -> None:
    """The largest circumradius is what the constant says, for every division; rows and columns need 2 n^2."""
    from glbump import mesh as module

    worst = 0.0
    for f in [*range(1, 40), 57, 100, 240]:
        p = module._icosphere_points(f)[module._icosphere_triangles(f)]
        normal = np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])
        across = np.linalg.norm(np.cross(normal, p[:, 0]), axis=1)
        worst = max(worst, f * float(np.arctan2(across, np.sum(normal * p[:, 0], axis=1)).max()))
    assert 0.99 * module._CIRCUMRADIUS < worst <= module._CIRCUMRADIUS
    for n in (64, 200, 1024):
        assert len(tessellate(Sphere(), n).triangles) <= 1.083 * (n + 4.3) ** 2  # 4.3: one more f
        assert len(tessellate(Torus(), n).triangles) <= 1.57 * (n + 4) ** 2


def test_segments_for() -> None:
    """The fewest that keep the bound: one less breaks it; limits hold; flat shapes need none."""
    for radius in (20.0, 300.0, 2000.0):
        for error in (0.02, 0.25):
            n = segments_for(Sphere(), radius, error)
            assert radius * (1 - np.cos(np.pi / n)) <= error * (1 + 1e-6)
            assert radius * (1 - np.cos(np.pi / (n - 1))) > error
    assert segments_for(Sphere(), 1e9, 0.02) == 1024
    assert segments_for(Torus(), 1e-3, 0.02) == 8
    assert segments_for(Plane(), 1e9, 0.02) == 8


@pytest.mark.parametrize("shape", FLAT, ids=repr)
def test_flat_shapes_attributes(shape: Shape) -> None:
    mesh = tessellate(shape, 8)
    assert mesh.normals is not None
    assert mesh.uv is not None
    assert mesh.dpdu is not None
    assert mesh.dpdv is not None
    np.testing.assert_allclose(np.linalg.norm(mesh.normals, axis=1), 1, rtol=1e-15)
    outward = np.cross(mesh.dpdu, mesh.dpdv)
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    np.testing.assert_allclose(outward, mesh.normals, atol=1e-15)
    face = area_normals(mesh)
    face /= np.linalg.norm(face, axis=1, keepdims=True)
    np.testing.assert_allclose(face, mesh.normals[mesh.triangles[:, 0]], atol=1e-15)


def test_quad_attributes_against_finite_differences() -> None:
    """dp/du and dp/dv of the bilinear patch at its corners; a parallelogram's would differ here."""
    mesh = tessellate(SKEW, 8)
    c = np.array(SKEW.corners)

    def patch(u: float, v: float) -> npt.NDArray[np.float64]:
        return (1 - v) * ((1 - u) * c[0] + u * c[1]) + v * (u * c[2] + (1 - u) * c[3])

    h = 2.0**-20  # bilinear: central differences are exact but for rounding, eps / h = 2e-10
    for i, (u, v) in enumerate(mesh.uv):  # type: ignore[arg-type]
        np.testing.assert_array_equal(mesh.positions[i], c[i])
        np.testing.assert_array_equal(patch(u, v), c[i])
        np.testing.assert_allclose(mesh.dpdu[i], (patch(u + h, v) - patch(u - h, v)) / (2 * h), atol=1e-9)  # type: ignore[index]
        np.testing.assert_allclose(mesh.dpdv[i], (patch(u, v + h) - patch(u, v - h)) / (2 * h), atol=1e-9)  # type: ignore[index]
    assert not np.allclose(mesh.dpdu[0], mesh.dpdu[2])  # type: ignore[index]


@pytest.mark.parametrize("shape", [Plane((3, 5)), Cube((1, 2, 3))], ids=repr)
def test_flat_positions_are_linear_in_uv(shape: Shape) -> None:
    mesh = tessellate(shape, 8)
    for first in range(0, len(mesh.positions), 4):
        for k in range(first, first + 4):
            step = mesh.uv[k] - mesh.uv[first]  # type: ignore[index]
            moved = mesh.positions[first] + step[0] * mesh.dpdu[k] + step[1] * mesh.dpdv[k]  # type: ignore[index]
            np.testing.assert_allclose(mesh.positions[k], moved, atol=1e-15)


def test_plane_and_cube_conventions() -> None:
    plane = tessellate(Plane((3, 5)), 8)
    np.testing.assert_array_equal(plane.positions[0], [-1.5, 0, 2.5])  # uv (0, 0): left and near
    np.testing.assert_array_equal(plane.normals[0], [0, 1, 0])  # type: ignore[index]
    cube = tessellate(Cube((1, 2, 3)), 8)
    assert cube.positions.shape == (24, 3)
    for face, axis in enumerate([0, 0, 1, 1, 2, 2]):
        sign = 1 - 2 * (face % 2)
        expected = sign * np.eye(3)[axis]
        np.testing.assert_array_equal(cube.normals[4 * face], expected)  # type: ignore[index]
        np.testing.assert_array_equal(
            cube.positions[4 * face : 4 * face + 4, axis], sign * [1, 2, 3][axis] / 2 * np.ones(4)
        )
        if axis != 1:
            np.testing.assert_array_equal(cube.dpdv[4 * face], [0, 2, 0])  # type: ignore[index]
    # A box is closed once its corners are joined by position.
    corner = np.unique(cube.positions, axis=0, return_inverse=True)[1].reshape(-1)
    edges = directed_edges(Mesh(np.zeros((8, 3)), corner[cube.triangles].astype(np.int32)))
    assert len(np.unique(edges, axis=0)) == len(edges) == 36
    assert {tuple(e) for e in edges} == {tuple(e[::-1]) for e in edges}


@pytest.mark.parametrize("shape", [*ROUND, *FLAT], ids=repr)
def test_bounds(shape: Shape) -> None:
    """A shape's box holds its mesh's, and no point of it is farther away than the mesh's error."""
    true, mesh = bounds(shape), bounds(tessellate(shape, 64))
    assert true.shape == (2, 3)
    slack = 1e-12 if shape in FLAT else allowed(shape, 64)
    assert np.all(true[0] <= mesh[0] + 1e-15)
    assert np.all(true[1] >= mesh[1] - 1e-15)
    np.testing.assert_allclose(mesh, true, atol=2 * slack)


def test_refusals(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match="segments must be at least 3; got 2"):
        tessellate(Sphere(), 2)
    with pytest.raises(MeshError):
        tessellate(MeshFile(tmp_path / "none.obj"), 8)


@pytest.mark.parametrize("segments", [3, 4, 5, 8, 31, 97, 1024])
def test_an_outline_fills_its_polygon_once(segments: int) -> None:
    mesh = outline(segments)
    areas = area_normals(mesh)
    assert len(mesh.triangles) == segments - 2
    assert (areas[:, 2] > 0).all()
    # No overlap and no hole: the areas add up to the polygon's.
    assert areas.sum(axis=0) == pytest.approx([0, 0, segments / 2 * np.sin(2 * np.pi / segments)], abs=1e-12)


@pytest.mark.parametrize("eye", [(0, 0, 4, 1), (1, 2.5, -0.1, 1), (0, 1.5 + 1e-9, 0, 1), (2e9, -1e9, 3e8, 1)])
def test_an_outline_stands_where_the_sphere_is_seen_to_end(eye: tuple[float, ...]) -> None:
    radius, e = 1.5, np.array(eye[:3])
    matrix = outline_matrix(radius, eye)
    rim = outline(64).positions @ matrix[:3, :3].T + matrix[:3, 3]
    assert np.linalg.norm(rim, axis=1) == pytest.approx(radius)
    # Rays through the rim touch the sphere: at right angles to the radius there. Scaled by both lengths.
    along = (rim - e) / np.linalg.norm(e)
    assert np.einsum("ni,ni->n", along, rim) == pytest.approx(0, abs=1e-9)
    assert np.linalg.det(matrix[:3, :3]) > 0  # still facing the way it did: at the eye
    assert matrix[:3, 2] @ e > 0


def test_an_outline_seen_in_parallel_is_the_sphere_s_great_circle() -> None:
    matrix = outline_matrix(2.0, (0, -1, 0, 0))
    assert matrix[:3, 3] == pytest.approx(0)
    assert matrix[:3, 2] == pytest.approx([0, 1, 0])
    assert np.linalg.norm(matrix[:3, :2], axis=0) == pytest.approx(2)
