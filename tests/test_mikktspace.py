"""MikkTSpace tangents: as the reference program has them (data/mikktspace/make.py), and by their laws."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest

from glbump.errors import MeshError
from glbump.mikktspace import corner_tangents

with np.load(Path(__file__).parent / "data" / "mikktspace" / "reference.npz") as _stored:
    REFERENCE = dict(_stored)
NAMES = sorted({name.split("/")[0] for name in REFERENCE})
SOUND = [n for n in NAMES if not n.startswith(("soup", "unsorted soup", "degenerate", "sphere with one pole"))]

LIKE_REFERENCE = 1e-5
"""Most that a tangent may differ from the reference program's. Here they are the same to the last bit; libraries of
mathematics that round an arc cosine otherwise may move one by an ulp of its weight."""

ROUNDING = 1e-5
"""Of tangents in 32-bit floats, where sums are made in another order, or of turned points, on edges no shorter than
1/30 of the mesh: some 100 ulps of 6e-8."""

Array = npt.NDArray[np.float32]
Mesh = tuple[Array, Array, Array]


def stored(name: str) -> Mesh:
    return REFERENCE[f"{name}/positions"], REFERENCE[f"{name}/normals"], REFERENCE[f"{name}/uv"]


def partition(groups: npt.ArrayLike) -> list[int]:
    """For each corner the first with the same number, so that only who goes with whom counts; -1 stays."""
    numbers = np.asarray(groups).reshape(-1)
    _, first, which = np.unique(numbers, return_index=True, return_inverse=True)
    return np.where(numbers < 0, -1, first[which]).tolist()


def turn() -> npt.NDArray[np.float64]:
    """A rotation about no axis in particular."""
    q, _ = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))
    return q * np.linalg.det(q)


@pytest.mark.parametrize("name", NAMES)
def test_tangents_and_groups_are_the_reference_programs(name: str) -> None:
    tangents, groups = corner_tangents(*stored(name))
    assert partition(groups) == partition(REFERENCE[f"{name}/groups"])
    np.testing.assert_allclose(tangents, REFERENCE[f"{name}/tangents"], rtol=0, atol=LIKE_REFERENCE)
    assert tangents.dtype == np.float32


def test_the_comparison_rejects_neighbours() -> None:
    """Other rules give other answers on these meshes: a tangent for each triangle, and one for each vertex."""
    for name, part in (("mirrored", 0.1), ("degenerate", 0.1), ("sphere with one pole", 0.01)):
        p, n, uv = stored(name)
        want, groups = REFERENCE[f"{name}/tangents"], partition(REFERENCE[f"{name}/groups"])
        alone = np.concatenate([corner_tangents(p[k : k + 1], n[k : k + 1], uv[k : k + 1])[0] for k in range(len(p))])
        assert np.mean(np.abs(alone - want).max(axis=-1) > 100 * LIKE_REFERENCE) > part
        corners = np.concatenate([p, n, uv], axis=2).reshape(-1, 8)
        assert partition(np.unique(corners, axis=0, return_inverse=True)[1]) != groups


def test_the_program_leaves_its_last_edges_unsorted_and_we_do_not() -> None:
    """The meshes named so differ from the program as it stands, in a few corners; with its order of triangles undone
    its answers change, and ours do not (`test_the_order_of_triangles_does_not_matter`)."""
    names = [name for name in NAMES if name.startswith("unsorted")]
    assert names
    for name in names:
        ours = np.array(partition(corner_tangents(*stored(name)).groups))
        program = np.array(partition(REFERENCE[f"{name}/program's groups"]))
        assert 0 < np.mean(ours != program) < 0.1


@pytest.mark.parametrize("name", SOUND)
def test_tangents_are_unit_and_at_right_angles_to_the_normal(name: str) -> None:
    p, n, uv = stored(name)
    tangents = corner_tangents(p, n, uv).tangents.astype(np.float64)
    # Each of a few operations rounds by 6e-8; normals are unit to as much.
    np.testing.assert_allclose(np.linalg.norm(tangents[..., :3], axis=-1), 1, atol=1e-6)
    np.testing.assert_allclose(np.sum(tangents[..., :3] * n, axis=-1), 0, atol=1e-6)
    assert set(np.unique(tangents[..., 3])) <= {-1.0, 1.0}


@pytest.mark.parametrize("name", SOUND)
def test_the_order_of_triangles_does_not_matter(name: str) -> None:
    p, n, uv = stored(name)
    want, groups = corner_tangents(p, n, uv)
    order = np.random.default_rng(0).permutation(len(p))
    got, mixed = corner_tangents(p[order], n[order], uv[order])
    undone = np.argsort(order)
    assert partition(mixed[undone]) == partition(groups)
    np.testing.assert_allclose(got[undone], want, atol=ROUNDING)
    got, mixed = corner_tangents(*(np.roll(a, 1, axis=1) for a in (p, n, uv)))
    assert partition(np.roll(mixed, -1, axis=1)) == partition(groups)
    np.testing.assert_allclose(np.roll(got, -1, axis=1), want, atol=ROUNDING)


@pytest.mark.parametrize("name", [n for n in SOUND if not n.startswith(("folded", "unsorted"))])
def test_turning_a_mesh_turns_its_tangents(name: str) -> None:
    p, n, uv = stored(name)
    want, groups = corner_tangents(p, n, uv)
    # Corners in one place must stay so: each place is turned once.
    places, at = np.unique(p.reshape(-1, 3), axis=0, return_inverse=True)
    turned = (places.astype(np.float64) @ turn().T)[at].reshape(p.shape)
    got, others = corner_tangents(turned, n.astype(np.float64) @ turn().T, uv)
    assert partition(others) == partition(groups)
    some = groups >= 0
    np.testing.assert_allclose(got[some, :3], want[some, :3] @ turn().T, atol=ROUNDING)
    assert np.array_equal(got[..., 3], want[..., 3])


@pytest.mark.parametrize("name", SOUND)
def test_mirrored_uv_turn_tangent_and_w_round(name: str) -> None:
    p, n, uv = stored(name)
    want, groups = corner_tangents(p, n, uv)
    some = groups >= 0
    # v the other way round leaves dp/du, and turns the bitangent.
    for flip, change in (([-1, 1], [-1, -1, -1, -1]), ([1, -1], [1, 1, 1, -1])):
        got, others = corner_tangents(p, n, uv * np.array(flip))
        assert partition(others) == partition(groups)
        assert np.array_equal(got[some], want[some] * np.array(change))


@pytest.mark.parametrize("scale", [1e-17, 1 / 1024, 3.0, 1e17])
def test_the_size_of_mesh_and_uv_does_not_matter(scale: float) -> None:
    p, n, uv = stored("mirrored")
    want, groups = corner_tangents(p, n, uv)
    exact = np.log2(scale) % 1 == 0
    for got, others in (
        corner_tangents(p.astype(np.float64) * scale, n, uv),
        corner_tangents(p, n, uv.astype(np.float64) * scale),
    ):
        assert partition(others) == partition(groups)
        assert np.array_equal(got, want) if exact else np.allclose(got, want, atol=ROUNDING)


def test_a_sheet_has_dp_du_and_dp_dv() -> None:
    """Tangent along u, and w cross(n, t) along v, whichever way uv lie on a flat sheet."""
    u, v = np.meshgrid(np.arange(4.0), np.arange(3.0))
    at = np.arange(12).reshape(3, 4)
    square = [at[:-1, :-1], at[:-1, 1:], at[1:, 1:], at[1:, :-1]]
    rows = np.concatenate([np.stack([square[i].ravel() for i in t], 1) for t in ((0, 1, 2), (0, 2, 3))])
    points = np.stack([u.ravel(), v.ravel(), np.zeros(12)], 1)
    normals = np.broadcast_to([0.0, 0, 1], points.shape)
    for angle in (0.0, 0.5, 2.0, 4.0):
        for side in (1, -1):
            t = np.array([np.cos(angle), np.sin(angle), 0])
            b = side * np.array([-np.sin(angle), np.cos(angle), 0])
            uv = points @ np.stack([t, b], 1)
            tangents = corner_tangents(points[rows], normals[rows], uv[rows]).tangents.reshape(-1, 4)
            np.testing.assert_allclose(tangents, np.tile([*t, side], (len(tangents), 1)), atol=1e-6)
            np.testing.assert_allclose(side * np.cross([0, 0, 1], t), b, atol=1e-12)


def test_corners_are_joined_by_value_and_parted_by_any() -> None:
    """Two triangles along an edge share tangents there, unless position, normal or uv differ, or uv are mirrored."""
    points = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.5]])
    rows = np.array([[0, 1, 2], [0, 2, 3]])
    p, n, uv = points[rows], np.broadcast_to([0.0, 0, 1], (2, 3, 3)), points[rows][..., :2]

    def shared(p: npt.ArrayLike, n: npt.ArrayLike, uv: npt.ArrayLike) -> int:
        groups = corner_tangents(p, n, uv).groups
        return len(set(groups[0]) & set(groups[1]))

    assert shared(p, n, uv) == 2
    assert shared(np.where(p == 0, -0.0, p), n, uv) == 2
    assert shared(*(a[:, ::-1] for a in (p, n, uv))) == 2
    # One end alone: no edge is left, so that nothing joins the other end either.
    for changed in (0, 1, 2):
        arrays = [p.copy(), n.copy(), uv.copy()]
        arrays[changed][1, 0] += 1e-6
        assert shared(*arrays) == 0
    mirrored = uv.copy()
    mirrored[1, 2] = [1, 0.5]
    assert shared(p, n, mirrored) == 0
    # The second triangle the other way round: its edge runs alongside, which is no neighbour.
    assert shared(*(np.stack([a[0], a[1, ::-1]]) for a in (p, n, uv))) == 0


def test_triangles_without_area_in_uv_go_with_the_first_that_meets_them() -> None:
    points = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [2, 0, 0]])
    rows = np.array([[0, 1, 2], [1, 4, 2], [0, 2, 3]])
    uv = np.array([[0, 0], [1, 0], [1, 1], [0, 1], [1, 0.5]])  # the second triangle is a line in uv
    normals = np.broadcast_to([0.0, 0, 1], points.shape)
    tangents, groups = corner_tangents(points[rows], normals[rows], uv[rows])
    assert groups[1, 0] == groups[0, 1]
    assert groups[1, 2] == groups[0, 2]
    assert groups[1, 1] == -1
    assert np.array_equal(tangents[1, 1], [1, 0, 0, -1])
    # Alone it has none at all.
    tangents, groups = corner_tangents(points[rows[1:2]], normals[rows[1:2]], uv[rows[1:2]])
    assert np.all(groups == -1)
    # Between neighbours that are turned differently, the one that comes first in the file takes it.
    rows = np.array([[0, 1, 2], [1, 4, 2], [1, 5, 4]])
    points = np.concatenate([points, [[2, -1, 0]]])
    normals = np.broadcast_to([0.0, 0, 1], points.shape)
    uv = np.concatenate([uv, [[0, 0.5]]])
    for order, side in (([0, 1, 2], 1), ([2, 1, 0], -1)):
        tangents = corner_tangents(points[rows][order], normals[rows][order], uv[rows][order]).tangents
        assert tangents[0, 0, 3] == side
        assert tangents[2, 0, 3] == -side
        assert tangents[1, 0, 3] == side


def test_triangles_with_corners_in_one_place_take_another_ones_tangents() -> None:
    p, n, uv = stored("mirrored")
    doubled = p[:1, [0, 1, 1]], n[:1, [0, 1, 1]], uv[:1, [0, 1, 1]]
    for first in (True, False):  # before or after the triangle it takes them from
        parts = ((a, b) if first else (b, a) for a, b in zip(doubled, (p, n, uv)))
        tangents, groups = corner_tangents(*(np.concatenate(part) for part in parts))
        taker, giver = (0, 1) if first else (-1, 0)
        assert np.array_equal(tangents[taker], tangents[giver][[0, 1, 1]])
        assert np.array_equal(groups[taker], groups[giver][[0, 1, 1]])
        assert np.array_equal(np.delete(tangents, taker % len(tangents), axis=0), corner_tangents(p, n, uv).tangents)
    tangents, groups = corner_tangents(*doubled)
    assert np.all(groups == -1)
    assert np.array_equal(tangents[0], np.tile([1, 0, 0, -1], (3, 1)))


def test_no_triangles() -> None:
    tangents, groups = corner_tangents(np.zeros((0, 3, 3)), np.zeros((0, 3, 3)), np.zeros((0, 3, 2)))
    assert tangents.shape == (0, 3, 4)
    assert groups.shape == (0, 3)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf, 2e18])
@pytest.mark.parametrize("which", [0, 1, 2])
def test_numbers_that_are_not_finite_are_refused(which: int, bad: float) -> None:
    arrays = [a.astype(np.float64) for a in stored("cube")]
    arrays[which][7, 2, 1] = bad
    what = ("positions", "normals", "texture coordinates")[which]
    with pytest.raises(MeshError, match=rf"finite {what}, none beyond 1e\+18; corner 2 of triangle 7 has \("):
        corner_tangents(*arrays)


def test_shapes_that_are_no_triangles_are_refused() -> None:
    p, n, uv = stored("cube")
    for wrong in ((p[0], n, uv), (p, n[:-1], uv), (p, n, p), (p[:, :2], n[:, :2], uv[:, :2]), (1.0, n, uv)):
        with pytest.raises(MeshError, match=r"of shape \(triangles, 3, [23]\); got \("):
            corner_tangents(*wrong)
