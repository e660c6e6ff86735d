"""The camera: where the picture is taken from, and its matrices and rays.

pyrr stays in this file (10 ms to import, so only where a matrix is made). Its matrices are for row vectors;
glbump's are for column vectors: clip = projection @ view @ world.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Any

import numpy as np
import numpy.typing as npt

from glbump import validate as check
from glbump.errors import SceneError
from glbump.frozen import Frozen
from glbump.shapes import Vec3

Floats = npt.NDArray[np.float64]


class Camera(Frozen):
    """Where the picture is taken from. fov: vertical, degrees. near, far: derived from the scene when None.

    projection: "perspective" or "orthographic"; `height` is what an orthographic picture shows, in world
    units from its lower to its upper border.
    """

    eye: Vec3 = (0.0, 0.0, 4.0)
    target: Vec3 = (0.0, 0.0, 0.0)
    up: Vec3 = (0.0, 1.0, 0.0)
    fov: float = 40.0
    projection: str = "perspective"
    height: float = 3.0
    near: float | None = None
    far: float | None = None

    def __post_init__(self) -> None:
        self._store(
            eye=check.point("camera.eye", self.eye),
            target=check.point("camera.target", self.target),
            up=check.point("camera.up", self.up),
            fov=check.number("camera.fov", self.fov, least=1e-6, most=179),
            height=check.length("camera.height", self.height),
        )
        check.choice("camera.projection", self.projection, ("perspective", "orthographic"))
        for name in ("near", "far"):
            value = getattr(self, name)
            if value is not None:
                self._store(**{name: check.length(f"camera.{name}", value)})
        if self.near is not None and self.far is not None and self.far <= self.near:
            raise SceneError(f"camera.far must be greater than camera.near; got near {self.near:g}, far {self.far:g}")
        look = np.subtract(self.target, self.eye)
        if not np.any(look):
            raise SceneError(f"camera.target must differ from camera.eye; got {self.eye} for both")
        across = np.cross(look / np.abs(look).max(), np.divide(self.up, max(np.abs(self.up).max(), 1e-300)))
        if np.linalg.norm(across) < 1e-9:
            raise SceneError(
                f"camera.up must not be parallel to the view direction; got up {self.up}, "
                f"eye {self.eye}, target {self.target}"
            )


@lru_cache(maxsize=16)
def _axes(camera: Camera) -> Floats:
    """(3, 3): the camera's right, up and back in the world, one a row; read-only."""
    from pyrr import matrix44

    look = np.subtract(camera.target, camera.eye)
    up = np.array(camera.up)
    turn = matrix44.create_look_at(np.zeros(3), look / np.abs(look).max(), up / np.abs(up).max(), dtype=np.float64)
    axes = np.asarray(turn[:3, :3].T, dtype=np.float64)
    axes.flags.writeable = False
    return axes


def view_matrix(camera: Camera) -> Floats:
    """(4, 4): camera space from world space; the camera looks along -Z, +Y up."""
    view = np.eye(4)
    view[:3, :3] = _axes(camera)
    view[:3, 3] = -view[:3, :3] @ camera.eye
    return view


def _half_extent(camera: Camera, size: tuple[int, int]) -> tuple[float, float]:
    """Half of the width and height seen: at distance 1, or of the whole box of an orthographic camera."""
    half = camera.height / 2
    if camera.projection == "perspective":
        half = math.tan(math.radians(camera.fov) / 2)
    return half * size[0] / size[1], half


def projection_matrix(camera: Camera, size: tuple[int, int], near: float, far: float) -> Floats:
    """(4, 4): OpenGL's clip space (-1..1 on all axes) from camera space. size: (width, height) in pixels."""
    from pyrr import matrix44

    if camera.projection == "perspective":
        result: Any = matrix44.create_perspective_projection(camera.fov, size[0] / size[1], near, far, dtype=np.float64)
    else:
        x, y = _half_extent(camera, size)
        result = matrix44.create_orthogonal_projection(-x, x, -y, y, near, far, dtype=np.float64)
    return np.asarray(result.T, dtype=np.float64)


_MARGIN = 1e-3
"""Share by which derived near and far lie outside what is there, so that rounding clips nothing."""


def near_far(camera: Camera, bounds_world: npt.ArrayLike, size: tuple[int, int] | None = None) -> tuple[float, float]:
    """Distances of the clip planes along the view, near < far: the camera's own, or derived from the scene.

    bounds_world: (N, 2, 3) boxes, lowest and highest corner. near is above 0 for a perspective camera.
    Where the eye is inside a box, near is 1/10,000 of the farthest distance in it. size: (width, height) of
    the picture; with it, a wide floor under the eye gives the distance at which it comes into view.
    """
    low, high = _depths(camera, bounds_world, size)
    near = (1 - _MARGIN) * low if camera.near is None else camera.near
    far = (1 + _MARGIN) * high if camera.far is None else camera.far
    if near >= far:  # all there is lies before the given near plane, or behind the given far plane
        near, far = (near, 2 * near) if camera.far is None else (far / 2, far)
    return near, far


def _depths(camera: Camera, bounds_world: npt.ArrayLike, size: tuple[int, int] | None) -> tuple[float, float]:
    """Least and greatest depth of what lies before the camera; the target's depth where nothing does."""
    forward = -_axes(camera)[2]
    low, high = np.asarray(bounds_world, dtype=np.float64).reshape(-1, 2, 3).swapaxes(0, 1) - camera.eye
    # The extreme corners along `forward`, without building all eight.
    one, other = low * forward, high * forward
    first, last = np.minimum(one, other).sum(axis=1), np.maximum(one, other).sum(axis=1)
    outside = np.linalg.norm(np.maximum(np.maximum(low, -high), 0), axis=1)
    if camera.projection == "perspective":
        if size is not None:
            corner = math.hypot(1, *_half_extent(camera, size))  # distance over depth at the picture's corner
            first = np.maximum(first, outside / corner)
        first = np.maximum(first, np.where(outside > 0, 1e-7, 1e-4) * last)
    ahead = last > 0
    if not np.any(ahead):
        distance = float(np.linalg.norm(np.subtract(camera.target, camera.eye)))
        return distance / 2, distance * 2
    return max(float(first[ahead].min()), 0.0), float(last[ahead].max())


@lru_cache(maxsize=16)
def sample_offsets(samples: int) -> Floats:
    """(samples, 2): x from the left and y from the top of a pixel, in pixels: the centres of a k x k grid; read-only.

    Four stand where drivers that multisample put them: turned, each with a row and a column of its own, which on nearly
    level or upright edges counts as four steps, not two.
    Raises SceneError unless `samples` is a square number.
    """
    k = math.isqrt(max(samples, 0))
    if k * k != samples or k == 0:
        raise SceneError(f"samples must be a square number (1, 4, 9, 16 ...); got {samples}")
    y, x = np.divmod(np.arange(samples), k)
    offsets = (np.stack([x, y], axis=-1) + 0.5) / k
    if samples == 4:
        offsets = np.array([[0.375, 0.875], [0.875, 0.625], [0.125, 0.375], [0.625, 0.125]])
    offsets.flags.writeable = False
    return offsets


def sample_number(x: float, y: float, samples: int) -> int:
    """Of a pixel's `samples` (sample_offsets) the number of that at x from the left and y from the top: by rows
    from the lowest; each of four has a row of its own."""
    rows, columns = (4, 1) if samples == 4 else (math.isqrt(samples),) * 2
    return int((1 - y) * rows) * columns + int(x * columns)


def pixel_steps(camera: Camera, size: tuple[int, int]) -> Floats:
    """(3, 3): the way in the world that a pixel to the right spans at depth 1 (at any, of an orthographic camera), the
    way that one up spans, and how the depth changes with the place: the unit vector ahead, or 0 of an orthographic
    camera, for which all is as at depth 1."""
    right, up, back = _axes(camera)
    half_x, half_y = _half_extent(camera, size)
    ahead = 0 * back if camera.projection == "orthographic" else -back
    return np.stack([right * (2 * half_x / size[0]), up * (2 * half_y / size[1]), ahead])


def pixel_rays(
    camera: Camera,
    size: tuple[int, int],
    offset: tuple[float, float] | Floats = (0.5, 0.5),
    count: tuple[int, int] | None = None,
) -> tuple[Floats, Floats]:
    """Origins and unit directions (H, W, 3) in the world of one ray a pixel, row 0 on top.

    size: (width, height) of the picture. offset: where in the pixel, as in `sample_offsets`; its centre unless given.
    count: how many rays (W, H) from there on; one a pixel of the picture unless given.
    A perspective camera's rays start at its eye, an orthographic camera's in the plane through its eye.
    """
    right, up, back = _axes(camera)
    half_x, half_y = _half_extent(camera, size)
    columns, rows = count or size
    x = (2 * (np.arange(columns) + offset[0]) / size[0] - 1) * half_x
    y = (1 - 2 * (np.arange(rows) + offset[1]) / size[1]) * half_y
    across = y[:, None, None] * up + x[:, None] * right
    if camera.projection == "orthographic":
        return camera.eye + across, np.broadcast_to(-back, across.shape)
    across -= back
    across /= np.linalg.norm(across, axis=-1, keepdims=True)
    return np.broadcast_to(np.array(camera.eye), across.shape), across
