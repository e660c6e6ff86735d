"""Matrices, clip distances and rays of the camera, against known points and against each other."""

from __future__ import annotations

import math
import subprocess
import sys
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from glbump.camera import Camera, near_far, pixel_rays, projection_matrix, sample_offsets, view_matrix
from glbump.errors import SceneError

CAMERAS = [
    Camera(),
    Camera(projection="orthographic"),
    Camera(eye=(3, 2, -5), target=(-1, 0.5, 2), up=(0.2, 1, 0.1), fov=75),
    Camera(eye=(3, 2, -5), target=(-1, 0.5, 2), up=(1, 0, 0), projection="orthographic", height=7),
    Camera(eye=(0, 9, 0), target=(0, 0, 0), up=(0, 0, -1), fov=10),
]
SIZE = (12, 8)


def project(camera: Camera, size: tuple[int, int], p: npt.ArrayLike, near: float = 0.5, far: float = 50.0) -> Any:
    """Normalised device coordinates of world points (..., 3)."""
    homogeneous = np.concatenate([np.asarray(p, float), np.ones((*np.shape(p)[:-1], 1))], axis=-1)
    clip = homogeneous @ (projection_matrix(camera, size, near, far) @ view_matrix(camera)).T
    return clip[..., :3] / clip[..., 3:]


def test_known_points() -> None:
    """The default camera: at z = 4 looking along -Z, 40 degrees high."""
    np.testing.assert_allclose(view_matrix(Camera()) @ [0, 0, 0, 1], [0, 0, -4, 1], atol=1e-15)
    np.testing.assert_allclose(view_matrix(Camera()) @ [1, 2, 3, 1], [1, 2, -1, 1], atol=1e-15)
    top = 4 * math.tan(math.radians(20))
    ndc = project(Camera(), (200, 100), [[0, top, 0], [2 * top, 0, 0], [0, 0, 3.5], [0, 0, -46]])
    np.testing.assert_allclose(ndc[:2, :2], [[0, 1], [1, 0]], atol=1e-14)
    np.testing.assert_allclose(ndc[2:, 2], [-1, 1], atol=1e-13)  # the near plane at -1, the far plane at 1
    flat = Camera(projection="orthographic", height=3)
    ndc = project(flat, (200, 100), [[0, 1.5, 0], [-3, 0, -7], [0, 0, 3.5], [0, 0, -46]])
    np.testing.assert_allclose(ndc[:2, :2], [[0, 1], [-1, 0]], atol=1e-14)
    np.testing.assert_allclose(ndc[2:, 2], [-1, 1], atol=1e-13)


@pytest.mark.parametrize("camera", CAMERAS, ids=range(len(CAMERAS)))
def test_view_is_a_rigid_motion(camera: Camera) -> None:
    view = view_matrix(camera)
    assert view.dtype == np.float64
    np.testing.assert_allclose(view[:3, :3] @ view[:3, :3].T, np.eye(3), atol=1e-15)
    assert np.linalg.det(view) > 0.999
    np.testing.assert_allclose(view @ [*camera.eye, 1], [0, 0, 0, 1], atol=1e-14)
    distance = math.dist(camera.eye, camera.target)
    np.testing.assert_allclose(view @ [*camera.target, 1], [0, 0, -distance, 1], atol=1e-14)
    assert (view[:3, :3] @ camera.up)[1] > 0
    assert abs((view[:3, :3] @ camera.up)[0]) < 1e-15


@pytest.mark.parametrize("camera", CAMERAS, ids=range(len(CAMERAS)))
@pytest.mark.parametrize("offset", [(0.5, 0.5), (0.0, 0.0), (0.25, 0.875)])
def test_rays_agree_with_matrices(camera: Camera, offset: tuple[float, float]) -> None:
    """A point anywhere along a pixel's ray projects into that pixel, at that offset."""
    origins, dirs = pixel_rays(camera, SIZE, offset)
    assert origins.shape == dirs.shape == (SIZE[1], SIZE[0], 3)
    np.testing.assert_allclose(np.linalg.norm(dirs, axis=-1), 1, rtol=1e-15)
    for distance in (1.0, 20.0):
        ndc = project(camera, SIZE, origins + distance * dirs)
        x = (ndc[..., 0] + 1) / 2 * SIZE[0]
        y = (1 - ndc[..., 1]) / 2 * SIZE[1]  # row 0 on top
        np.testing.assert_allclose(x, np.broadcast_to(np.arange(SIZE[0]) + offset[0], x.shape), atol=1e-12)
        np.testing.assert_allclose(y, np.broadcast_to(np.arange(SIZE[1])[:, None] + offset[1], y.shape), atol=1e-12)


def test_pixel_centres_are_at_half_pixels() -> None:
    """In an odd picture the middle pixel looks straight ahead; in an even one no pixel does."""
    _, dirs = pixel_rays(Camera(), (5, 3))
    np.testing.assert_array_equal(dirs[1, 2], [0, 0, -1])
    _, dirs = pixel_rays(Camera(), (4, 2))
    np.testing.assert_allclose(dirs[0, 1], [-dirs[0, 2, 0], dirs[0, 2, 1], dirs[0, 2, 2]], atol=1e-16)
    assert dirs[0, 0, 1] > 0 > dirs[1, 0, 1]
    assert dirs[0, 0, 0] < 0 < dirs[0, 3, 0]


def test_orthographic_rays_are_parallel_and_start_at_the_eye_plane() -> None:
    camera = CAMERAS[3]
    origins, dirs = pixel_rays(camera, SIZE)
    assert np.ptp(dirs.reshape(-1, 3), axis=0).max() == 0
    np.testing.assert_allclose((origins - camera.eye) @ dirs[0, 0], 0, atol=1e-14)
    np.testing.assert_allclose(origins.mean(axis=(0, 1)), camera.eye, atol=1e-14)
    row = np.linalg.norm(origins[0, 0] - origins[-1, 0])
    np.testing.assert_allclose(row, camera.height * (SIZE[1] - 1) / SIZE[1], rtol=1e-14)


@pytest.mark.parametrize("projection", ["perspective", "orthographic"])
def test_far_away_cameras(projection: str) -> None:
    """At 1e7, ulp(1e7) = 2e-9 is all that is lost; and lengths of 1e18 and 1e-18 stay finite."""
    near_by = Camera(eye=(1, 2, 3), target=(0, 0, 0), projection=projection)
    there = np.array([1e7, -3e7, 2e7])
    far_off = replace(near_by, eye=tuple(there + near_by.eye), target=tuple(there))
    p = np.random.default_rng(1).uniform(-1, 1, size=(50, 3))
    np.testing.assert_allclose(project(far_off, SIZE, p + there), project(near_by, SIZE, p), atol=2e-8)
    a, b = pixel_rays(near_by, SIZE), pixel_rays(far_off, SIZE)
    np.testing.assert_allclose(b[0] - there, a[0], atol=1e-8)
    np.testing.assert_allclose(b[1], a[1], atol=1e-14)
    for scale in (1e18, 1e-18):
        camera = Camera(eye=(0, 0, scale), up=(0, scale, 0), height=scale, projection=projection)
        assert np.all(np.isfinite(view_matrix(camera)))
        np.testing.assert_allclose(np.linalg.norm(pixel_rays(camera, SIZE)[1], axis=-1), 1)


def box(low: float, high: float) -> list[list[float]]:
    """A unit-wide box that the default camera, at z = 4 looking along -Z, sees from depth low to high."""
    return [[-0.5, -0.5, 4 - high], [0.5, 0.5, 4 - low]]


def test_near_far_encloses_what_is_there() -> None:
    near, far = near_far(Camera(), [box(3, 5), box(2, 2.5)])
    assert 1.99 < near < 2 < 5 < far < 5.01
    # A flat thing square to the view still has a range; boxes behind the eye do not count.
    near, far = near_far(Camera(), [box(3, 3), box(-9, -8)])
    assert 2.99 < near < 3 < far < 3.01
    # Scenes of every size.
    near, far = near_far(Camera(), [box(1e-6, 2e-6), box(1e8, 1e9)])
    assert 0.99e-6 < near < 1e-6
    assert 1e9 < far < 1.01e9


def test_near_far_takes_the_corners_of_a_box() -> None:
    """Seen along the diagonal, the range is that of the corners, not of the faces."""
    camera = Camera(eye=(3, 3, 3), target=(0, 0, 0))
    near, far = near_far(camera, [[[-1, -1, -1], [1, 1, 1]]])
    assert near == pytest.approx(2 * math.sqrt(3), rel=2e-3)
    assert far == pytest.approx(4 * math.sqrt(3), rel=2e-3)


def test_near_far_of_awkward_scenes() -> None:
    inside = near_far(Camera(), [box(-1, 10)])
    assert inside == pytest.approx((1e-3, 10), rel=2e-3)
    behind = near_far(Camera(), [box(-9, -8)])
    nothing = near_far(Camera(), np.zeros((0, 2, 3)))
    flat = near_far(Camera(projection="orthographic"), [box(-1, 10)])
    assert flat[0] == 0
    for near, far in (inside, behind, nothing, flat):
        assert np.all(np.isfinite([near, far]))
        assert near < far


def test_near_far_of_a_wide_floor() -> None:
    """The floor's box reaches behind the eye; with the picture's size, near is where it comes into view."""
    camera = Camera(eye=(0, 1, 0), target=(0, 1, -1), fov=90)
    floor = [[[-1e3, 0, -1e3], [1e3, 0, 1e3]]]
    assert near_far(camera, floor)[0] == pytest.approx(1e-7 * 1e3, rel=2e-3)
    near, _ = near_far(camera, floor, (100, 100))
    # True: straight down in the picture's lower border, at depth 1. The bound: distance 1 over sqrt(3).
    assert near == pytest.approx(1 / math.sqrt(3), rel=2e-3)


def test_near_far_the_camera_decides() -> None:
    assert near_far(Camera(near=0.1, far=0.2), [box(3, 5)]) == (0.1, 0.2)
    assert near_far(Camera(near=4), [box(3, 5)])[0] == 4
    assert near_far(Camera(far=4), [box(3, 5)])[1] == 4
    assert near_far(Camera(near=40), [box(3, 5)]) == (40, 80)
    assert near_far(Camera(far=2), [box(3, 5)]) == (1, 2)


@pytest.mark.parametrize("projection", ["perspective", "orthographic"])
def test_derived_range_clips_no_corner(projection: str) -> None:
    rng = np.random.default_rng(7)
    for _ in range(200):
        eye = rng.normal(size=3) * 10.0 ** rng.uniform(-6, 9)
        camera = Camera(eye=tuple(eye), target=(0, 0, 0), up=tuple(rng.normal(size=3)), projection=projection)
        boxes = np.sort(rng.normal(size=(3, 2, 3)) * 10.0 ** rng.uniform(-6, 6), axis=1)
        near, far = near_far(camera, boxes, SIZE)
        assert 0 <= near < far
        corners = np.array([[b[i, 0], b[j, 1], b[k, 2]] for b in boxes for i in (0, 1) for j in (0, 1) for k in (0, 1)])
        depth = -(corners - eye) @ view_matrix(camera)[2, :3]
        assert np.all(depth <= far)
        if projection == "perspective":
            ndc = project(camera, SIZE, corners, near, far)
            seen = (np.abs(ndc[:, 0]) < 1) & (np.abs(ndc[:, 1]) < 1) & (depth > 1e-4 * far)
            assert np.all(depth[seen] >= near)


def test_sample_offsets() -> None:
    np.testing.assert_array_equal(sample_offsets(1), [[0.5, 0.5]])
    # Four: one in each quarter, and in each of four rows and columns.
    assert {tuple(cell) for cell in np.floor(2 * sample_offsets(4)).astype(int).tolist()} == {
        (0, 0),
        (0, 1),
        (1, 0),
        (1, 1),
    }
    for axis in (0, 1):
        np.testing.assert_array_equal(np.sort(sample_offsets(4)[:, axis]), [0.125, 0.375, 0.625, 0.875])
    for k in (3, 4, 7):
        offsets = sample_offsets(k * k)
        np.testing.assert_allclose(offsets.mean(axis=0), 0.5, atol=1e-15)
        cells = np.floor(offsets * k).astype(int)
        assert len({tuple(c) for c in cells}) == k * k
    for bad in (0, -4, 3, 15):
        with pytest.raises(SceneError, match=r"square number.*; got"):
            sample_offsets(bad)


def test_pyrr_is_imported_late() -> None:
    code = "import sys, glbump.camera; assert 'pyrr' not in sys.modules"
    subprocess.run([sys.executable, "-c", code], check=True)
