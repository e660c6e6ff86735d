"""Cube maps: the face table, solid angles texel by texel, seamless look-ups, and layouts that are refused."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from glbump.errors import ImageError
from glbump.maps import cube
from glbump.maps.cube import face_dir, face_of, solid_angles
from glbump.maps.layout import CUBE, EnvironmentMap, sample, texel_dirs
from glbump.maps.pictured import environment_of

# OpenGL 4.6 core, table 8.19: the vector along s and along t.
TABLE = {
    "+X": ((0, 0, -1), (0, -1, 0)),
    "-X": ((0, 0, 1), (0, -1, 0)),
    "+Y": ((1, 0, 0), (0, 0, 1)),
    "-Y": ((1, 0, 0), (0, 0, -1)),
    "+Z": ((1, 0, 0), (0, -1, 0)),
    "-Z": ((-1, 0, 0), (0, -1, 0)),
}
# OpenEXR's faces, as one sees them from inside.
INSIDE = {
    "+X": ((0, 0, 1), (0, -1, 0)),
    "-X": ((0, 0, -1), (0, -1, 0)),
    "+Y": ((1, 0, 0), (0, 0, -1)),
    "-Y": ((1, 0, 0), (0, 0, 1)),
    "+Z": ((-1, 0, 0), (0, -1, 0)),
    "-Z": ((1, 0, 0), (0, -1, 0)),
}


def axis(name: str) -> Any:
    v = np.zeros(3)
    v["XYZ".index(name[1])] = 1 if name[0] == "+" else -1
    return v


def picture(pixels: Any, envmap: str | None = None, name: str = "test.png") -> Any:
    return SimpleNamespace(pixels=np.asarray(pixels, np.float32), envmap=envmap, name=name, clear=None)


def directions(count: int, seed: int = 7) -> Any:
    d = np.random.default_rng(seed).normal(size=(count, 3))
    return d / np.linalg.norm(d, axis=1, keepdims=True)


def painted(table: dict[str, Any], n: int, border: bool) -> Any:
    """Six faces that hold at each sample its own direction, laid by `table`: (6, n, n, 3)."""
    at = np.linspace(-1, 1, n) if border else 2 * (np.arange(n) + 0.5) / n - 1
    faces = [
        axis(name) + at[None, :, None] * np.array(s) + at[:, None, None] * np.array(t) for name, (s, t) in table.items()
    ]
    return np.stack(faces).astype(np.float32)


@pytest.mark.parametrize("name", cube.FACES)
def test_face_table(name: str) -> None:
    number, (along_s, along_t) = cube.FACES.index(name), TABLE[name]
    assert np.array_equal(face_dir(number, 0.5, 0.5), axis(name))
    assert np.allclose(face_dir(number, 0.75, 0.5) - axis(name), 0.5 * np.array(along_s))
    assert np.allclose(face_dir(number, 0.5, 0.75) - axis(name), 0.5 * np.array(along_t))


def test_face_of_and_face_dir_are_inverse() -> None:
    dirs = directions(20_000)
    face, s, t = face_of(dirs)
    assert np.abs(face_dir(face, s, t) * np.abs(dirs).max(axis=1, keepdims=True) - dirs).max() < 1e-15
    assert set(face) == set(range(6))
    for scale in (1e-300, 1e300):
        scaled = face_of(dirs * scale)
        assert np.array_equal(scaled[0], face)
        assert np.abs(scaled[1] - s).max() < 1e-15


def test_ties_go_to_x_before_y_before_z() -> None:
    dirs = [(1, 1, 1), (-1, 1, 1), (0, 1, 1), (0, -1, 1), (0, 0, -1), (1, 0, -1), (0, 0, 0)]
    assert face_of(dirs)[0].tolist() == [0, 1, 2, 3, 5, 0, 0]


def test_texel_directions_are_unit_and_symmetric() -> None:
    dirs = texel_dirs(CUBE, (8, 8))
    assert dirs.shape == (6, 8, 8, 3)
    assert np.abs(np.linalg.norm(dirs, axis=-1) - 1).max() < 1e-15
    assert np.abs(dirs.sum(axis=(0, 1, 2))).max() < 1e-12
    face, s, t = face_of(dirs)
    assert (face == np.arange(6)[:, None, None]).all()
    assert np.allclose(s, (np.arange(8) + 0.5) / 8)
    assert np.allclose(t, ((np.arange(8) + 0.5) / 8)[:, None])


# Limits: what the second-order midpoint form itself leaves out, 1.2 / n^4 as measured, or rounding.
@pytest.mark.parametrize(("n", "most"), [(64, 1e-7), (256, 4e-10), (1024, 2e-12)])
def test_solid_angles_texel_by_texel(n: int, most: float) -> None:
    """Against the midpoint rule with its second-order term, both in float64: a sum alone sees no bug here."""
    c = 2 * (np.arange(n) + 0.5) / n - 1
    r2 = c[None, :] ** 2 + c[:, None] ** 2
    d, h = 1 + r2, 1 / n
    midpoint = 4 * h * h / d**1.5 * (1 + h * h / 6 * (-6 / d + 15 * r2 / d**2))
    got = solid_angles(n)
    assert np.abs(got / midpoint - 1).max() < most
    assert got.sum() * 6 == pytest.approx(4 * np.pi, rel=1e-12)
    assert np.allclose(got, got.T, rtol=1e-14, atol=0)
    assert np.allclose(got, got[::-1, ::-1], rtol=1e-13, atol=0)


def test_samples_on_the_border_count_by_what_is_theirs() -> None:
    """In the middle of each side half a sample, in the corners a quarter; the face in all."""
    n = 65
    got, fine = solid_angles(n, border=True), solid_angles(n - 1)
    assert got.sum() * 6 == pytest.approx(4 * np.pi, rel=1e-12)
    # Cells between samples against cells around them: equal in size up to their shift by half a cell.
    assert got[0, n // 2] / got[1, n // 2] == pytest.approx(0.5, rel=0.05)
    assert got[0, 0] / got[1, 1] == pytest.approx(0.25, rel=0.1)
    assert got[n // 2, n // 2] == pytest.approx(fine.max(), rel=1e-3)


def test_solid_angle_ratio_tends_to_three_root_three() -> None:
    # Measured 5.0307, 5.1554, 5.1860 at n = 64, 256, 1024.
    ratios = [solid_angles(n).max() / solid_angles(n).min() for n in (64, 256, 1024)]
    assert ratios == pytest.approx([5.0307, 5.1554, 5.1860], abs=1e-4)
    # The gap to the limit falls as 1 / n, so this is the limit to second order.
    assert 2 * solid_angles(512).max() / solid_angles(512).min() - ratios[1] == pytest.approx(27**0.5, abs=2e-3)


def test_one_texel_is_a_whole_face() -> None:
    assert solid_angles(1) == pytest.approx(np.array([[4 * np.pi / 6]]), rel=1e-15)


@pytest.mark.parametrize(
    ("table", "orientation", "envmap"),
    [(TABLE, "opengl", None), (INSIDE, "inside", None), (INSIDE, "opengl", "cube"), (INSIDE, "inside", "cube")],
)
def test_faces_come_to_lie_where_they_look(table: Any, orientation: str, envmap: str | None) -> None:
    """Faces that hold their own direction give it back, from a column and from six pictures."""
    n, border = 9, envmap == "cube"
    faces = painted(table, n, border)
    made = [environment_of(picture(faces.reshape(6 * n, n, 3), envmap), "cube", orientation)]
    if not border:
        made.append(environment_of(picture(faces), "cube", orientation))
        made.append(environment_of([picture(face) for face in faces], "cube", orientation))
    dirs = directions(5000)
    dirs /= np.abs(dirs).max(axis=1, keepdims=True)
    # Away from the edges, where a bilinear look-up of a linear function is exact but for float32.
    inside = (np.sort(np.abs(dirs), axis=1)[:, 1] < 1 - 1 / n) | border
    for faces_made in made:
        assert faces_made.has_own_grid == border
        assert np.abs(sample(faces_made, dirs) - dirs)[inside].max() < 1e-6
    wrong = painted(TABLE if table is INSIDE else INSIDE, n, border)
    mirrored = environment_of(picture(wrong.reshape(-1, n, 3), envmap), "cube", orientation)
    assert np.abs(sample(mirrored, dirs) - dirs)[inside].max() > 1


def test_look_ups_are_continuous_across_every_edge_and_corner() -> None:
    faces = EnvironmentMap(CUBE, np.random.default_rng(2).uniform(size=(6, 4, 4, 3)).astype(np.float32))
    rng = np.random.default_rng(4)
    edge = rng.uniform(-1, 1, size=(4000, 3))
    rows, (one, other) = np.arange(4000), rng.permuted(np.tile([0, 1, 2], (4000, 1)), axis=1)[:, :2].T
    edge[rows, one], edge[rows, other] = np.sign(edge[rows, one]), np.sign(edge[rows, other])
    edge[:8] = np.sign(edge[:8])
    nudge = 1e-9
    this, that = edge.copy(), edge.copy()
    this[rows, one] *= 1 + nudge
    that[rows, other] *= 1 + nudge
    across = face_of(this)[0] != face_of(that)[0]
    assert across[8:].mean() > 0.99
    # The look-up changes by at most 4 texels x the nudge between the two, so any step is the edge's own.
    assert np.abs(sample(faces, this) - sample(faces, that)).max() < 1e-7
    # A look-up that clamps at the edge of each face jumps there.
    clamped = EnvironmentMap(CUBE, faces.pixels)
    clamped.__dict__["padded"] = np.pad(faces.pixels, ((0, 0), (1, 1), (1, 1), (0, 0)), mode="edge")
    assert np.abs(sample(clamped, this) - sample(clamped, that)).max() > 0.1


def test_a_corner_is_the_mean_of_the_three_texels_that_meet() -> None:
    # As the driver has it: with faces 1, 2, 3, ... the direction (1, 1, 1) reads (1 + 3 + 5) / 3.
    faces = np.broadcast_to(np.arange(1, 7, dtype=np.float32)[:, None, None, None], (6, 2, 2, 3))
    assert sample(EnvironmentMap(CUBE, np.ascontiguousarray(faces)), (1, 1, 1)) == pytest.approx([3, 3, 3], abs=1e-6)
    assert sample(EnvironmentMap(CUBE, np.ascontiguousarray(faces)), (1, 1, 0)) == pytest.approx([2, 2, 2], abs=1e-6)


def test_texels_read_back_at_their_own_centres() -> None:
    pixels = np.random.default_rng(6).uniform(size=(6, 5, 5, 3)).astype(np.float32)
    assert np.abs(sample(EnvironmentMap(CUBE, pixels), texel_dirs(CUBE, (5, 5))) - pixels).max() < 1e-6


def test_padding_meets_its_neighbours_in_order() -> None:
    """The texel beyond an edge is the one that lies next to it, at every place along every edge."""
    n = 4
    own = texel_dirs(CUBE, (n, n)).astype(np.float32)
    padded = cube.pad(own)
    # Neighbours across an edge are as near as neighbours are: at most one texel's angle, 2 / n.
    for inner, outer in (
        (padded[:, 1, 1:-1], padded[:, 0, 1:-1]),
        (padded[:, -2, 1:-1], padded[:, -1, 1:-1]),
        (padded[:, 1:-1, 1], padded[:, 1:-1, 0]),
        (padded[:, 1:-1, -2], padded[:, 1:-1, -1]),
    ):
        assert np.linalg.norm(inner - outer, axis=-1).max() < 1 / n + 0.1
        assert np.linalg.norm(inner - outer[:, ::-1], axis=-1).max() > 2 / n


def test_levels_read_by_level_of_detail() -> None:
    """A cube that holds its level's number gives the level of detail back, clamped at both ends."""
    levels = [np.full((6, n, n, 3), i, np.float32) for i, n in enumerate((8, 4, 2, 1))]
    dirs = directions(1000)
    lod = np.linspace(-1, 4, 1000)
    got = cube.sample_levels(levels, dirs, lod)
    assert np.abs(got - np.clip(lod, 0, 3)[:, None]).max() < 1e-12
    assert np.abs(cube.sample_levels(levels, dirs, 1.25) - 1.25).max() < 1e-12


def test_levels_are_seamless_too() -> None:
    rng = np.random.default_rng(8)
    levels = [rng.uniform(size=(6, n, n, 3)).astype(np.float32) for n in (4, 2, 1)]
    dirs = directions(500)
    for i, level in enumerate(levels):
        assert np.abs(cube.sample_levels(levels, dirs, i) - sample(EnvironmentMap(CUBE, level), dirs)).max() < 1e-12


SQUARE = np.zeros((4, 4, 3))


@pytest.mark.parametrize(
    ("given", "words"),
    [
        (picture(np.zeros((4, 20, 3))), "got 20x4"),
        (picture(np.zeros((6, 4, 5, 3))), "an array 6 x 4 x 5 x 3"),
        (picture(np.zeros((8, 16, 3)), "latlong"), 'use kind = "lat-long"'),
        (picture(np.zeros((6, 1, 3)), "cube"), "at least 2x2"),
        ([picture(SQUARE)] * 5, "got 5"),
        ([picture(SQUARE)] * 5 + [picture(np.zeros((4, 5, 3)), name="odd.png")], "odd.png: face -Z"),
        ([picture(SQUARE)] * 5 + [picture(np.zeros((8, 8, 3)), name="big.png")], "8x8 but face +X, test.png, is 4x4"),
    ],
)
def test_pictures_that_are_no_cube(given: Any, words: str) -> None:
    with pytest.raises(ImageError) as caught:
        environment_of(given, "cube")
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)
