"""Parallax of near environments: the point on the wall itself, its limits, and directions along walls."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from glbump.glsltest import Glsl, inputs
from glbump.maps.angles import angle_between
from glbump.reference.direction import unit_dir
from glbump.reference.parallax import box_parallax, sphere_parallax

F64 = npt.NDArray[np.float64]
LOW, HIGH = np.array([-2.0, -1.0, -3.0]), np.array([1.5, 2.5, 4.0])
CENTRE, RADIUS = np.array([0.5, -0.3, 0.2]), 2.0
ROUNDING = 1e-13  # some roundings of float64, of rooms a few units wide


@pytest.fixture(scope="module")
def inside() -> tuple[F64, F64]:
    """Points in the box, and directions of all lengths, the axes among them."""
    d = inputs.directions(3000, 2).astype(float)
    share = inputs.uniform(len(d), 0, 1, (3,), 3)
    return LOW + share * (HIGH - LOW), d * inputs.log_uniform(len(d), 1e-9, 1e9, (1,), 4)


def out_of_box(q: F64) -> F64:
    """From the origin, in the box, along q (K, 3): the walls' points, by trying all six walls."""
    best = np.full(len(q), np.inf)
    for i in range(3):
        for wall in (LOW[i], HIGH[i]):
            t = np.divide(wall, q[:, i], out=np.full(len(q), np.inf), where=q[:, i] != 0)
            best = np.where((t > 0) & (t < best), t, best)
    return q * best[:, None]


def test_in_a_box_the_answer_leads_to_the_wall_that_the_ray_meets(inside: tuple[F64, F64]) -> None:
    p, d = inside
    q = box_parallax(p, d, LOW, HIGH)
    point = out_of_box(q)
    # The wall's point, seen from p, lies along dir; and dir alone misses it.
    assert angle_between(unit_dir(point - p), unit_dir(d)).max() < ROUNDING * 10
    assert np.median(angle_between(q, unit_dir(d))) > 0.1
    assert np.abs(np.linalg.norm(q, axis=-1) - 1).max() < ROUNDING


def test_in_a_sphere_the_answer_leads_to_the_wall_that_the_ray_meets() -> None:
    d = inputs.directions(3000, 2).astype(float)
    p = CENTRE + inputs.unit_vectors(len(d), 3) * RADIUS * inputs.uniform(len(d), 0, 0.99, (1,), 4)
    q = sphere_parallax(p, 7 * d, CENTRE, RADIUS)
    # From the origin, which is in the sphere, to its wall: the larger root.
    b, c = q @ CENTRE, CENTRE @ CENTRE - RADIUS**2
    point = q * (b + np.sqrt(b * b - c))[:, None]
    assert np.abs(np.linalg.norm(point - CENTRE, axis=-1) - RADIUS).max() < ROUNDING
    # A hundredth of the radius from the wall.
    assert angle_between(unit_dir(point - p), unit_dir(d)).max() < 100 * ROUNDING
    assert np.median(angle_between(q, unit_dir(d))) > 0.1


def test_where_it_was_taken_nothing_changes(inside: tuple[F64, F64]) -> None:
    _, d = inside
    for q in (box_parallax(np.zeros(3), d, LOW, HIGH), sphere_parallax(np.zeros(3), d, CENTRE, RADIUS)):
        assert angle_between(q, unit_dir(d)).max() < ROUNDING


@pytest.mark.parametrize("shape", ["box", "sphere"])
def test_far_walls_change_directions_by_p_over_their_distance(inside: tuple[F64, F64], shape: str) -> None:
    p, d = inside
    errors = []
    for size in (1e3, 1e6, 1e9):
        if shape == "box":
            q = box_parallax(p, d, size * LOW, size * HIGH)
            # Nowhere is the wall nearer than 1 time the size, less where p is.
            nearest = size * 1.0 - 5
        else:
            q = sphere_parallax(p, d, size * CENTRE, np.full(len(p), size * RADIUS))
            nearest = size * (RADIUS - np.linalg.norm(CENTRE)) - 5
        off = angle_between(q, unit_dir(d))
        assert (off <= np.linalg.norm(p, axis=-1) / nearest + ROUNDING).all()
        errors.append(np.median(off))
    assert errors[0] / errors[1] == pytest.approx(1e3, rel=0.02)
    assert errors[1] / errors[2] == pytest.approx(1e3, rel=0.02)


def boxes_and_spheres(glsl: Glsl) -> list[tuple[Any, Any]]:
    """(function of p and dir, what) in GLSL and in float64."""
    shader = glsl("lib/parallax.glsl")
    return [(shader.box_parallax, shader.sphere_parallax), (box_parallax, sphere_parallax)]


def test_along_a_wall_and_on_it(glsl: Glsl) -> None:
    """In the plane of a wall, and parallel to others: no 0 / 0, and the wall ahead is the one that is met."""
    on_wall = np.array([HIGH[0], 0.5, 0.25])
    for box, sphere in boxes_and_spheres(glsl):
        for dir, hit in (
            ([0, 1, 0], [HIGH[0], HIGH[1], 0.25]),
            ([0, 0, -1], [HIGH[0], 0.5, LOW[2]]),
            ([-0.0, 0, 1], [HIGH[0], 0.5, HIGH[2]]),
            ([1, 0, 0], on_wall),
            ([1, 1, 0], on_wall),
            ([-1, 0, 0], [LOW[0], 0.5, 0.25]),
        ):
            assert box(on_wall, dir, LOW, HIGH) == pytest.approx(unit_dir(hit), abs=1e-6)
        top = CENTRE + [0, RADIUS, 0]
        for dir, hit in (([0, 1, 0], top), ([1, 0, 0], top), ([0, 0, -1], top), ([0, -1, 0], CENTRE - [0, RADIUS, 0])):
            # Along the wall the half chord is the root of a rounding.
            assert sphere(top, dir, CENTRE, RADIUS) == pytest.approx(unit_dir(hit), abs=1e-3)


def test_from_outside(glsl: Glsl) -> None:
    """The far side; past it and away from it, some point ahead on the ray, p at the least."""
    left, above = np.array([-5.0, 0.5, 0.25]), np.array([0.5, 6.0, 0.2])
    for box, sphere in boxes_and_spheres(glsl):
        assert box(left, [1, 0, 0], LOW, HIGH) == pytest.approx(unit_dir([HIGH[0], 0.5, 0.25]), abs=1e-6)
        assert box(left, [-1, 0, 0], LOW, HIGH) == pytest.approx(unit_dir(left), abs=1e-6)
        # y leaves 2.5 after 2 of the way, before x reaches -2.
        assert box(left, [1, 1, 0], LOW, HIGH) == pytest.approx(unit_dir([-3, 2.5, 0.25]), abs=1e-6)
        assert sphere(above, [0, -1, 0], CENTRE, RADIUS) == pytest.approx(unit_dir([0.5, -2.3, 0.2]), abs=1e-6)
        assert sphere(above, [0, 1, 0], CENTRE, RADIUS) == pytest.approx(unit_dir(above), abs=1e-6)
        past = above + [3, 0, 0]
        assert sphere(past, [0, -1, 0], CENTRE, RADIUS) == pytest.approx(unit_dir([3.5, -0.3, 0.2]), abs=1e-6)


@pytest.mark.filterwarnings("error")
def test_walls_without_end_and_no_direction_are_harmless(glsl: Glsl) -> None:
    big = np.float32(np.finfo(np.float32).max)
    for box, sphere in boxes_and_spheres(glsl):
        for far in (1e30, float(big), np.inf):
            got = box([1, 2, 3], [[0, 0, 1], [1, 2, -3]], np.full(3, -far), np.full(3, far))
            assert got == pytest.approx(unit_dir([[0, 0, 1], [1, 2, -3]]), abs=1e-6)
            got = sphere([1, 2, 3], [[0, 0, 1], [1, 2, -3]], CENTRE, far)
            assert got == pytest.approx(unit_dir([[0, 0, 1], [1, 2, -3]]), abs=1e-6)
        up = box([0.5, 1, 0.5], [0, 1, 0], LOW, HIGH)
        assert (box([0.5, 1, 0.5], [0, 0, 0], LOW, HIGH) == up).all()
        assert (box([0.5, 1, 0.5], [0, np.inf, 0], LOW, HIGH) == up).all()
        assert (
            sphere([0.5, 1, 0.5], [0, 0, 0], CENTRE, RADIUS) == sphere([0.5, 1, 0.5], [0, 1, 0], CENTRE, RADIUS)
        ).all()
        # At the origin, on a wall that goes through it: no direction at all.
        assert np.isfinite(box([0, 0, 0], [1, 0, 0], LOW, np.zeros(3))).all()
