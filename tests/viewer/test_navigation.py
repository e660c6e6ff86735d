"""Where the camera goes, without a window."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import numpy.typing as npt
import pytest

from glbump.camera import Camera, projection_matrix, view_matrix
from glbump.viewer import navigation

CAMERA = Camera(eye=(1.0, 2.0, 4.0), target=(0.2, -0.1, 0.3), fov=40)
SIDEWAYS = Camera(eye=(1.0, 2.0, 4.0), up=(1, 1, 0), fov=70)
FLAT = replace(CAMERA, projection="orthographic", height=3.0)
CAMERAS = [CAMERA, SIDEWAYS, FLAT]
each = pytest.mark.parametrize("camera", CAMERAS)


def seen(camera: Camera, point: npt.ArrayLike, aspect: float = 1.5) -> npt.NDArray[np.float64]:
    """Where a point is in the picture: shares of its height, right and up of its middle. By the renderer's matrices."""
    size = round(1000 * aspect), 1000
    x, y, _, w = projection_matrix(camera, size, 0.1, 100.0) @ view_matrix(camera) @ [*np.asarray(point), 1]
    return np.array([x / w * aspect / 2, y / w / 2])


@each
def test_movements_are_undone_by_their_opposites(camera: Camera) -> None:
    for there, back in (
        (lambda c: navigation.orbit(c, 0.07, 0.03), lambda c: navigation.orbit(c, -0.07, -0.03)),
        (lambda c: navigation.look(c, 0.07, 0.03), lambda c: navigation.look(c, -0.07, -0.03)),
        (lambda c: navigation.pan(c, 0.3, 0.2), lambda c: navigation.pan(c, -0.3, -0.2)),
        (lambda c: navigation.zoom(c, 3, (0.2, -0.1)), lambda c: navigation.zoom(c, -3, (0.2, -0.1))),
        (lambda c: navigation.fly(c, 0.1, 0.2, 0.3), lambda c: navigation.fly(c, -0.1, -0.2, -0.3)),
        (lambda c: navigation.with_fov(c, 1.2), lambda c: navigation.with_fov(c, 1 / 1.2)),
    ):
        moved = there(camera)
        again = back(moved)
        assert moved != camera
        for name in ("eye", "target", "fov", "height"):
            assert getattr(again, name) == pytest.approx(getattr(camera, name), abs=1e-12), name


@each
def test_a_drag_over_the_height_turns_once_round(camera: Camera) -> None:
    quarter = camera
    for _ in range(4):
        quarter = navigation.orbit(quarter, 0.25, 0)
    assert quarter.eye == pytest.approx(camera.eye)
    turned = navigation.orbit(camera, 0.25, 0)
    up = np.array(camera.up) / np.linalg.norm(camera.up)
    before, after = (np.subtract(c.eye, c.target) for c in (camera, turned))
    assert after @ up == pytest.approx(before @ up), "the height over the pivot stays"
    assert np.linalg.norm(after) == pytest.approx(np.linalg.norm(before))
    flat = [arm - (arm @ up) * up for arm in (before, after)]
    assert flat[0] @ flat[1] == pytest.approx(0, abs=1e-12), "a quarter of the height is a right angle"


@each
def test_what_is_in_front_follows_the_cursor(camera: Camera) -> None:
    """A point between eye and target moves right for a drag to the right, down for one down."""
    point = 0.7 * np.array(camera.target) + 0.3 * np.array(camera.eye)
    for across, down in ((0.01, 0), (0, 0.01)):
        moved = seen(navigation.orbit(camera, across, down), point) - seen(camera, point)
        assert moved @ (across, -down) > 0
        assert abs(moved @ (down, across)) < abs(moved @ (across, -down))


@each
def test_a_pan_keeps_the_pivots_depth_under_the_cursor(camera: Camera) -> None:
    moved = navigation.pan(camera, 0.2, 0.1)
    assert seen(moved, camera.target) == pytest.approx([0.2, -0.1])


@each
@pytest.mark.parametrize("steps", [-5, 2.5, 30])
def test_zoom_goes_to_the_cursor(camera: Camera, steps: float) -> None:
    at = 0.3, -0.2
    origin, direction = navigation.ray(camera, at)
    _, _, back = navigation.axes(camera)
    under = origin + direction * ((np.array(camera.target) - origin) @ back) / (direction @ back)
    nearer = navigation.zoom(camera, steps, at)
    assert seen(nearer, under) == pytest.approx(at, abs=1e-9)
    size = navigation.height_at_target(nearer) / navigation.height_at_target(camera)
    assert size == pytest.approx(0.95**steps)


def test_zoom_ends_somewhere() -> None:
    camera = CAMERA
    for steps in (1e3, -1e4, 1e5):
        camera = navigation.zoom(camera, steps, (0.4, 0.1))
        assert 0.99e-6 <= navigation.distance(camera) <= 1.01e9


@each
def test_the_ray_is_the_renderers_own(camera: Camera) -> None:
    for at in ((0.0, 0.0), (0.6, -0.4), (-0.1, 0.45)):
        origin, direction = navigation.ray(camera, at)
        assert seen(camera, origin + 2.5 * direction) == pytest.approx(at, abs=1e-12)


@each
def test_no_orbit_reaches_the_pole(camera: Camera) -> None:
    for down in (0.3, -0.6):
        over = navigation.orbit(camera, 0.0, down)
        for _ in range(5):
            over = navigation.orbit(over, 0.013, down)
        up = np.array(camera.up) / np.linalg.norm(camera.up)
        _, _, back = navigation.axes(over)
        assert math.degrees(math.acos(abs(back @ up))) == pytest.approx(0.5, rel=1e-3)


def test_fit_shows_all_and_wastes_little() -> None:
    box = np.array([(-1.0, -2.0, 0.5), (3.0, 1.0, 1.5)])
    corners = np.array([[x, y, z] for x in box[:, 0] for y in box[:, 1] for z in box[:, 2]])
    for camera in CAMERAS:
        for aspect in (0.5, 1.0, 2.2):
            fitted = navigation.fitted(camera, box, aspect)
            places = np.array([seen(fitted, corner, aspect) for corner in corners])
            assert (np.abs(places) <= (aspect / 2, 0.5)).all()
            assert (np.abs(places) / (aspect / 2, 0.5)).max() > 0.5
            assert np.subtract(fitted.eye, fitted.target) @ np.subtract(camera.eye, camera.target) > 0


@each
def test_a_pivot_comes_to_the_middle_and_keeps_its_size(camera: Camera) -> None:
    point = (0.4, 0.3, 0.9)
    _, _, back = navigation.axes(camera)
    moved = navigation.centred(camera, point)
    assert seen(moved, point) == pytest.approx([0, 0], abs=1e-12)
    assert np.subtract(moved.eye, point) @ back == pytest.approx(np.subtract(camera.eye, point) @ back)
    behind = np.array(camera.eye) + back
    assert navigation.centred(camera, behind) is camera


def test_sides_are_blenders() -> None:
    for side, axis in (("front", (0, 0, 1)), ("right", (1, 0, 0)), ("top", (0, 1, 0))):
        for sign in (1, -1):
            _, _, back = navigation.axes(navigation.from_side(SIDEWAYS, side, other=sign < 0))
            assert back == pytest.approx(sign * np.array(axis), abs=0.01)


def test_projections_change_and_the_pivot_keeps_its_size() -> None:
    flat = navigation.other_projection(CAMERA)
    assert flat.projection == "orthographic"
    assert flat.height == pytest.approx(navigation.height_at_target(CAMERA))
    assert navigation.other_projection(flat).eye == pytest.approx(CAMERA.eye)
