"""What the place of the camera decides of a plan; all the rest is the same wherever it stands."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from glbump.camera import Camera, near_far
from glbump.contents import Contents
from glbump.environment import Pictured
from glbump.mesh import bounds, segments_for
from glbump.quality import Quality
from glbump.scene import Scene, Surface
from glbump.shapes import Cube, Plane, Quad, Sphere, Torus

F64 = npt.NDArray[np.float64]

FAR_OVER_NEAR = 1e3
"""Largest far / near for which depth is kept as OpenGL has it: far off, its 24 bits tell two surfaces apart by
far / near * 2**-24 of their distance. A logarithm tells them apart by log(far / near) * 2**-23 at any distance."""

NEAR = 0.01
"""In widths of a surface's box: how near the eye may come before directions are taken by pixel. At this distance
32-bit floats leave a point less the eye an error of 1e-5 radians."""


class SurfaceSeen(NamedTuple):
    """One surface, as it is seen. inside: the eye may be within it, so that its back sides are seen; near: the eye is
    so near that points less the eye are mostly rounding; segments: of its mesh."""

    inside: bool
    near: bool
    segments: int


class Seen(NamedTuple):
    """A scene, as it is seen. lens: of the camera, all but its place; log_depth: whether depth is a logarithm; camera:
    where all of it counts, for a background that has walls, or for how far off flat bumps are."""

    lens: tuple[object, ...]
    log_depth: bool
    surfaces: tuple[SurfaceSeen, ...]
    camera: Camera | None


def look(
    scene: Scene, quality: Quality, size: tuple[int, int], contents: Contents, boxes: F64
) -> tuple[Seen, tuple[float, float]]:
    """What is decided, and the distances of the clip planes, which decide nothing more. boxes: (N, 2, 3) `world_bounds`
    of the surfaces."""
    camera = scene.camera
    near, far = near_far(camera, boxes, size)
    has_walls = isinstance(scene.environment, Pictured) and scene.environment.bounds is not None
    is_measured = quality.bump_spread != "none" and any(
        isinstance(s.shape, Plane | Quad) and s.bumps for s in scene.surfaces
    )
    seen = Seen(
        lens=(camera.projection, camera.fov, camera.height),
        log_depth=camera.projection == "perspective" and far > FAR_OVER_NEAR * near,
        surfaces=tuple(_seen(surface, scene, quality, size, contents) for surface in scene.surfaces),
        camera=camera if has_walls or is_measured else None,
    )
    return seen, (near, far)


def _seen(surface: Surface, scene: Scene, quality: Quality, size: tuple[int, int], contents: Contents) -> SurfaceSeen:
    shape, eye = surface.shape, surface.transform.to_object(scene.camera.eye)
    low, high = contents.bounds(shape)
    # A plane is as large as the eye of an orthographic camera is: nearer surfaces may lie behind it.
    is_near = scene.camera.projection == "perspective" and _distance(eye, low, high) < NEAR * (high - low).max()
    segments = segments_for(shape, _radius_in_pixels(surface, scene, size), quality.silhouette)
    return SurfaceSeen(_is_inside(surface, scene, eye), bool(is_near), _stepped(segments))


def _distance(point: F64, low: F64, high: F64) -> float:
    """From a box, along the axis where it is farthest; 0 inside."""
    return float(np.maximum(low - point, point - high).max())


def _is_inside(surface: Surface, scene: Scene, eye: F64) -> bool:
    """Whether the eye may be within a closed shape, so that its back sides are seen: box test, never too strict."""
    if not isinstance(surface.shape, Sphere | Torus | Cube):
        return False
    low, high = bounds(surface.shape)
    if scene.camera.projection == "orthographic":
        # Its eye is a plane; nearer surfaces may lie behind it.
        return bool(np.linalg.norm(eye) <= np.linalg.norm(high))
    return _distance(eye, low, high) <= 0


def _radius_in_pixels(surface: Surface, scene: Scene, size: tuple[int, int]) -> float:
    """The outermost radius of a round surface as it is seen, in pixels: never too small."""
    shape = surface.shape
    if not isinstance(shape, Sphere | Torus):
        return 0.0
    radius = shape.radius + (shape.tube if isinstance(shape, Torus) else 0.0)
    radius *= float(np.abs(np.asarray(surface.transform.scale)).max())
    camera = scene.camera
    if camera.projection == "orthographic":
        return radius / camera.height * size[1]
    nearest = max(math.dist(surface.transform.translate, camera.eye) - radius, 1e-3 * radius)
    return radius / nearest / math.tan(math.radians(camera.fov) / 2) * size[1] / 2


def _stepped(segments: int) -> int:
    """The next of four steps an octave, so that a moving camera asks for few meshes, not for a new one each time."""
    return math.ceil(2.0 ** (math.ceil(4 * math.log2(segments)) / 4))
