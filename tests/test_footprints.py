"""Footprints of directions: derivatives without the seam's jump, levels by solid angles without the edges'."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest

from glbump.glsltest import inputs
from glbump.maps.cube import face_of, solid_angles, texel_directions
from glbump.maps.layout import LATLONG, texel_dirs
from glbump.reference.direction import turning, unit_dir
from glbump.reference.environment import (
    cube_level,
    footprint_angle,
    latlong_gradient,
    latlong_gradients,
    latlong_level,
    latlong_uv,
)
from glbump.reference.filter import MOST_THIN, direction_level, longest_level

F64 = npt.NDArray[np.float64]
STEP = 1e-5
STEPPED = 1e-8  # of central differences over it: its square, times third derivatives, and 1e-16 over it


def differences(dirs: F64, change: F64, step: float = STEP) -> F64:
    """Central differences of latlong_uv, as they are: u may have jumped."""
    return (latlong_uv(dirs + step * change) - latlong_uv(dirs - step * change)) / (2 * step)


def changes(dirs: F64, seed: int = 3) -> F64:
    """Of a tenth of a radian, in all directions; not across the direction alone."""
    return 0.1 * inputs.unit_vectors(len(dirs), seed) * np.linalg.norm(dirs, axis=-1, keepdims=True)


@pytest.fixture(scope="module")
def dirs() -> F64:
    """At all lengths, and farther from the poles than third derivatives grow."""
    d = inputs.unit_vectors(4000, 1).astype(float)
    d = d[np.hypot(d[:, 0], d[:, 2]) > 0.3]
    return d * inputs.log_uniform(len(d), 1e-6, 1e6, (1,), 2)


# ---- derivatives


def test_turning_is_the_change_of_the_unit_direction(dirs: F64) -> None:
    c = changes(dirs)
    want = (unit_dir(dirs + STEP * c) - unit_dir(dirs - STEP * c)) / (2 * STEP)
    assert np.abs(turning(dirs, c) - want).max() < STEPPED
    assert np.abs(turning(dirs, dirs)).max() < 1e-15, "longer is no other direction"


def test_gradients_are_the_differences_of_the_place(dirs: F64) -> None:
    ddx, ddy = changes(dirs, 3), changes(dirs, 4)
    away = np.abs(latlong_uv(dirs)[:, 0] - 0.5) < 0.49
    want = np.concatenate([differences(dirs, ddx), differences(dirs, ddy)], axis=-1)
    got = latlong_gradients(dirs, ddx, ddy)
    assert np.abs(got - want)[away].max() < STEPPED
    for wrong in (got[:, [2, 3, 0, 1]], got * [-1, 1, -1, 1], got * [1, -1, 1, -1]):
        assert np.abs(wrong - want)[away].max() > 0.01


def test_no_jump_where_u_jumps() -> None:
    """About +Z: the differences across the seam are those of the whole picture's width, the derivatives are not."""
    angle = np.linspace(-0.4 * STEP, 0.4 * STEP, 21)
    dirs = np.stack([0.1 * np.sin(angle), 0 * angle + 0.3, 0.1 * np.cos(angle)], axis=-1)
    east = np.broadcast_to([0.1, 0.0, 0.0], dirs.shape)
    naive = differences(dirs, east)
    # Once round in two steps; east of +Z, u falls from 1 to 0 on the way.
    assert np.abs(naive[:, 0]).min() > 0.4 / STEP
    turned = dirs * [-1, 1, -1]  # the same about -Z, where u has no jump
    assert np.abs(latlong_gradient(dirs, east) - differences(turned, -east)).max() < STEPPED


@pytest.mark.parametrize("polar_angle", [1e-2, 1e-4, 1e-7, 1e-12])
@pytest.mark.parametrize("up", [1, -1])
def test_near_the_poles(polar_angle: float, up: int) -> None:
    """Differences over a thousandth of the way to the pole; footprints that long, so that nothing is capped."""
    turn = np.linspace(0.1, 2 * np.pi, 40, endpoint=False)
    turn = turn[np.abs(turn - np.pi) > 0.1]  # +Z is where u jumps
    across = np.sin(polar_angle)
    dirs = np.stack([across * np.sin(turn), 0 * turn + up * np.cos(polar_angle), -across * np.cos(turn)], axis=-1)
    change = polar_angle * inputs.unit_vectors(len(dirs), 5)
    got, want = latlong_gradient(dirs, change), differences(dirs, change, 1e-3)
    # Squares of the step; and v's own rounding over it, 1e-16 of 1 where v is near 1.
    assert got[:, 0] == pytest.approx(want[:, 0], abs=1e-6)
    assert got[:, 1] == pytest.approx(want[:, 1], abs=1e-6 * polar_angle + 2e-13)


def test_at_the_poles_all_is_finite_and_u_changes_by_half_at_most() -> None:
    near = np.stack(inputs.every([0, 1e-30, -1e-18, 1e-9, 1e-3, 0.5], [1, -1], [0, 1e-18, -1e-9, 1e-3]), axis=-1)
    for size in (0.0, 1e-9, 1e-3, 1.0, 1e30, np.inf):
        for way in (*inputs.axes().astype(float), [1, 1, 1]):
            change = np.broadcast_to(np.multiply(way, size, where=np.not_equal(way, 0), out=np.zeros(3)), near.shape)
            got = latlong_gradient(near, change)
            assert np.abs(got).max() <= 0.5
            # dphi sin(theta) is no more than the direction turns.
            d = unit_dir(near)
            reach = np.linalg.norm(turning(near, change), axis=-1)
            assert (2 * np.pi * np.abs(got[:, 0]) * np.hypot(d[:, 0], d[:, 2]) <= reach * (1 + 1e-12)).all()
    # By the rule of latlong_uv one looks along -Z there: v changes along z, u is half a turn away along x.
    assert latlong_gradient([0, 1, 0], [1e-3, 0, 0]) == pytest.approx([0.5, 0], abs=1e-15)
    assert latlong_gradient([0, 1, 0], [0, 0, -1e-3]) == pytest.approx([0, 1e-3 / np.pi], abs=1e-15)
    assert latlong_gradient([0, -1, 0], [0, 0, -1e-3]) == pytest.approx([0, -1e-3 / np.pi], abs=1e-15)


# ---- levels


def sides(dirs: F64, long: float, thin: float = 1.0) -> tuple[F64, F64]:
    """Two sides at right angles, across the direction, `long` radians and `thin` of that."""
    u = unit_dir(dirs)
    x = np.cross(u, np.roll(inputs.unit_vectors(1, 8), 1)[0])
    x /= np.linalg.norm(x, axis=-1, keepdims=True)
    size = np.linalg.norm(dirs, axis=-1, keepdims=True) * long
    return x * size, np.cross(u, x) * size * thin


@pytest.mark.parametrize("n", [16, 128])
def test_a_cubes_level_counts_texels_by_their_solid_angles(n: int) -> None:
    dirs = texel_directions(n)[::2].reshape(-1, 3)
    texel = np.tile(solid_angles(n).ravel(), 3)
    level = cube_level(3 * dirs, *sides(3 * dirs, 0.2), n)
    # The middle of a texel stands for all of it: to 0.6 of its width squared (NUMERICS 2.1).
    assert 4**level == pytest.approx(0.04 / texel, rel=1 / n**2)
    face = 0.04 / (4 * np.pi / 6 / n**2)
    assert np.abs(4**level / face - 1).max() > 1, "one angle for all texels is wrong by more than twice"


@pytest.mark.parametrize("size", [(32, 16), (256, 128), (64, 128)])
def test_a_lat_long_level_counts_texels_by_their_solid_angles(size: tuple[int, int]) -> None:
    width, height = size
    dirs = texel_dirs(LATLONG, size)[0]
    edges = np.cos(np.arange(height + 1) * np.pi / height)
    texel = np.broadcast_to((2 * np.pi / width * (edges[:-1] - edges[1:]))[:, None], (height, width))
    level = latlong_level(dirs, *sides(dirs, 0.2), size)
    # As above; sin(x) / x - 1 for half a texel's height. The uppermost row too, which the cap is for.
    assert 4**level == pytest.approx(0.04 / texel, rel=0.5 / height**2 * np.pi**2 / 6)
    poles = latlong_level([[0, 1, 0], [0, -1, 0]], *sides(np.array([[0.0, 1, 0], [0, -1, 0]]), 0.2), size)
    assert poles == pytest.approx(level[0, 0], abs=1e-2)


def test_a_thin_footprint_has_the_level_of_its_longer_side() -> None:
    ahead = np.array([[0.0, 0.0, -1.0]])
    for thin in (1.0, 0.1, 1e-6, 0.0):
        pair = sides(ahead, 0.02, thin)
        for ddx, ddy in (pair, pair[::-1]):
            # In the middle of a face there are n / 2 texels to a radian.
            assert cube_level(ahead, ddx, ddy, 512) == pytest.approx(longest_level(ddx, ddy, 256))
            # And by area it would be sharper without bound.
            assert footprint_angle(ahead, ddx, ddy) == pytest.approx(4e-4)


def test_a_direction_s_level_is_by_area_down_to_the_thinnest_that_counts() -> None:
    ahead = np.array([[0.0, 0.0, -1.0]])
    for thin in (1.0, 0.5, 0.125, 0.1, 1e-6, 0.0):
        ddx, ddy = sides(ahead, 0.02, thin)
        # A parallelogram of 0.02 by thin * 0.02, no thinner than one of eight.
        texels = 0.02**2 * max(thin, 1 / MOST_THIN) * 256**2
        assert direction_level(ddx, ddy, 256) == pytest.approx(0.5 * np.log2(texels))
        # Sheared along itself it covers as much.
        assert direction_level(ddx, ddy + 0.1 * ddx, 256) == pytest.approx(0.5 * np.log2(texels))


def test_a_cubes_level_has_no_jump_at_the_edges() -> None:
    """The largest derivative on the face, as OpenGL has it, jumps by 0.69 towards the corners."""
    beside = 1 + np.array([[-1e-7], [1e-7]])
    along = np.linspace(-0.999, 0.999, 201)[None, :]
    dirs = np.stack(np.broadcast_arrays(beside, along, 1.0), axis=-1)
    faces, _, _ = face_of(dirs)
    assert (faces[0] != faces[1]).all()
    jumps = {"solid angle": 0.0, "face": 0.0}
    for way in inputs.unit_vectors(100).astype(float):
        # The same footprint on both sides, small enough not to reach the other one.
        ddx = np.broadcast_to(1e-9 * way, dirs.shape)
        levels = cube_level(dirs, ddx, 0 * ddx, 512)
        before, after = (np.stack(face_of(dirs + sign * ddx)[1:], axis=-1) for sign in (-1, 1))
        by_face = np.log2(np.linalg.norm(after - before, axis=-1) / 2 * 512)
        for name, found in (("solid angle", levels), ("face", by_face)):
            jumps[name] = max(jumps[name], float(np.abs(found[0] - found[1]).max()))
    # The directions are 2e-7 apart, and some ways lead a hundred times more along them than across.
    assert jumps["solid angle"] < 1e-4
    assert 0.6 < jumps["face"] < 0.7


def test_levels_are_finite_whatever_the_footprint() -> None:
    dirs = np.concatenate([inputs.axes(), inputs.corners(), np.zeros((1, 3), np.float32)]).astype(float)
    for size in (0.0, 1e-30, 1.0, 1e30, np.inf):
        side = np.full(dirs.shape, size) * np.array([1, -1, 1])
        levels = [cube_level(dirs, side, 0 * dirs, 16384), latlong_level(dirs, side, 0 * dirs, (16384, 8192))]
        assert np.isfinite(levels).all()
        if size > 1:
            # The whole sphere is as many texels as there are, give or take the texels' own differences.
            assert np.max(levels) < np.log2(6 * 16384**2) / 2 + 1.2 + 0.5 * np.log2(2 * 8192 / np.pi)
