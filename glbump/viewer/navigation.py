"""Where the camera goes: each movement takes a Camera and gives another. No window, no state.

The camera's target is the pivot. Movements are in shares of the window's height (drags) or in steps (wheel, keys), so
that neither the window's size nor its pixel ratio changes how they feel. What one knows from Blender's turntable and
from three.js's OrbitControls holds: a drag over the whole height turns by a full turn, a wheel's step is a factor of
0.95, and the point under the cursor stays there.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from glbump.camera import Camera
from glbump.shapes import Vec3

F64 = npt.NDArray[np.float64]

WHEEL = 0.95
"""What one step of the wheel multiplies the distance by, as in OrbitControls."""
POLE = math.radians(0.5)
"""How near the view may come to looking straight along `up`."""
NEAREST, FARTHEST = 1e-6, 1e9
"""Distances between eye and target, and heights of an orthographic picture, in world units."""
LEAST_FOV, MOST_FOV = 1.0, 150.0
SIDES = {"front": (0.0, 0.0, 1.0), "right": (1.0, 0.0, 0.0), "top": (0.0, 1.0, 0.0)}
"""From where Blender's keys 1, 3 and 7 look."""


def distance(camera: Camera) -> float:
    """From the eye to the target."""
    return float(np.linalg.norm(np.subtract(camera.eye, camera.target)))


def orbit(camera: Camera, across: float, down: float) -> Camera:
    """Turned about the target after a drag by shares of the window's height: what is in front follows the cursor."""
    turned = _turned(np.subtract(camera.eye, camera.target), _up(camera), across, down)
    return replace(camera, eye=_point(camera.target + turned))


def look(camera: Camera, across: float, down: float) -> Camera:
    """Turned about the eye: the view goes where the cursor goes."""
    back = _turned(np.subtract(camera.eye, camera.target), _up(camera), across, down)
    return replace(camera, target=_point(camera.eye - back))


def pan(camera: Camera, across: float, down: float) -> Camera:
    """Moved sideways, so that what lies at the target's depth follows the cursor. Shares of the window's height."""
    right, up, _ = axes(camera)
    return _moved(camera, (down * up - across * right) * height_at_target(camera))


def zoom(camera: Camera, steps: float, at: tuple[float, float] = (0.0, 0.0)) -> Camera:
    """Nearer by `steps` of the wheel (farther where negative), towards the place `at`: shares of the window's height,
    right and up of its middle. What is seen there, at the target's depth, stays there."""
    wide = camera.projection == "orthographic"
    now = camera.height if wide else distance(camera)
    factor = min(max(now * WHEEL**steps, NEAREST), FARTHEST) / now
    right, up, _ = axes(camera)
    under = camera.target + (at[0] * right + at[1] * up) * height_at_target(camera)
    target = under + (camera.target - under) * factor
    if wide:
        moved = _moved(camera, target - camera.target)
        return replace(moved, height=camera.height * factor)
    return replace(camera, eye=_point(under + (camera.eye - under) * factor), target=_point(target))


def fly(camera: Camera, right: float, up: float, forward: float) -> Camera:
    """Eye and target moved along the view's own axes, in distances between them."""
    x, y, back = axes(camera)
    return _moved(camera, (right * x + up * y - forward * back) * distance(camera))


def centred(camera: Camera, point: npt.ArrayLike) -> Camera:
    """With `point` for its pivot, and in the middle of the picture: the eye moves sideways alone, so that nothing
    changes its size. Unchanged where the point is behind the eye."""
    _, _, back = axes(camera)
    pivot = np.asarray(point, np.float64)
    away = float((camera.eye - pivot) @ back)
    if not away > 0:
        return camera
    return replace(camera, eye=_point(pivot + away * back), target=_point(pivot))


def fitted(camera: Camera, bounds: npt.ArrayLike, aspect: float) -> Camera:
    """With all of the box `bounds` (2, 3) in the picture, seen from the same side. aspect: width over height."""
    low, high = np.asarray(bounds, np.float64).reshape(2, 3)
    centre, radius = (low + high) / 2, max(float(np.linalg.norm(high - low)) / 2, NEAREST)
    _, _, back = axes(camera)
    narrow = min(aspect, 1.0)
    away = max(distance(camera), 2 * radius)
    if camera.projection == "perspective":
        away = radius / math.sin(math.atan(math.tan(math.radians(camera.fov) / 2) * narrow))
    return replace(
        camera, eye=_point(centre + away * back), target=_point(centre), height=2 * radius / narrow, near=None, far=None
    )


def with_fov(camera: Camera, factor: float) -> Camera:
    """Another field of view; an orthographic camera's height."""
    if camera.projection == "orthographic":
        return zoom(camera, math.log(factor) / math.log(WHEEL))
    return replace(camera, fov=min(max(camera.fov * factor, LEAST_FOV), MOST_FOV))


def from_side(camera: Camera, side: str, *, other: bool = False) -> Camera:
    """Seen from one of SIDES, or from the `other` side of it."""
    towards: F64 = np.array(SIDES[side]) * (-1 if other else 1) * distance(camera)
    if side == "top":  # Straight down `up` is nowhere; a hair beside it, the front below.
        towards = towards + (0.0, 0.0, math.tan(POLE) * distance(camera))
    return replace(camera, eye=_point(camera.target + towards), up=(0.0, 1.0, 0.0))


def other_projection(camera: Camera) -> Camera:
    """Perspective for orthographic, or the other way round; the target's plane keeps its size."""
    if camera.projection == "perspective":
        return replace(camera, projection="orthographic", height=height_at_target(camera))
    _, _, back = axes(camera)
    away = camera.height / 2 / math.tan(math.radians(camera.fov) / 2)
    return replace(camera, projection="perspective", eye=_point(camera.target + away * back))


def height_at_target(camera: Camera) -> float:
    """What the picture shows from its lower to its upper edge at the target's depth, in world units."""
    if camera.projection == "orthographic":
        return camera.height
    return 2 * distance(camera) * math.tan(math.radians(camera.fov) / 2)


def axes(camera: Camera) -> tuple[F64, F64, F64]:
    """The camera's right, up and back in the world, of length 1."""
    back = np.subtract(camera.eye, camera.target)
    back = back / np.linalg.norm(back)
    right = np.cross(_up(camera), back)
    right /= np.linalg.norm(right)
    return right, np.cross(back, right), back


def ray(camera: Camera, at: tuple[float, float]) -> tuple[F64, F64]:
    """Origin and direction, in the world, of what is seen at a place: shares of the window's height, right and up of
    its middle."""
    right, up, back = axes(camera)
    if camera.projection == "orthographic":
        return camera.eye + (at[0] * right + at[1] * up) * camera.height, -back
    high = 2 * math.tan(math.radians(camera.fov) / 2)
    return np.array(camera.eye), (at[0] * right + at[1] * up) * high - back


def _up(camera: Camera) -> F64:
    up = np.asarray(camera.up, np.float64)
    return up / np.linalg.norm(up)


def _turned(arm: F64, up: F64, across: float, down: float) -> F64:
    """An arm turned about `up` and tilted towards it, a full turn for a share of 1; it stays POLE away from `up`."""
    along = float(arm @ up)
    level = arm - along * up
    length, flat = float(np.linalg.norm(arm)), float(np.linalg.norm(level))
    tilt = math.atan2(along, flat)
    most = max(math.pi / 2 - POLE, abs(tilt))
    tilt = min(max(tilt + 2 * math.pi * down, -most), most)
    ahead = level / flat
    side = np.cross(up, ahead)
    angle = -2 * math.pi * across
    ahead = math.cos(angle) * ahead + math.sin(angle) * side
    return length * (math.cos(tilt) * ahead + math.sin(tilt) * up)


def _moved(camera: Camera, by: F64) -> Camera:
    return replace(camera, eye=_point(camera.eye + by), target=_point(camera.target + by))


def _point(values: npt.ArrayLike) -> Vec3:
    x, y, z = np.asarray(values, np.float64).tolist()
    return (x, y, z)
