"""What surfaces capture of their scene: which scenes are drawn for it, from where, and in which order.

The table of an enclosing volume is constructed by projecting the rest of the scene onto its faces (Blinn and Newell
1976 for the table, Greene 1986 for the cube). A surface never shows itself: all that have an environment are left out
of its pictures.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields, replace
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from glbump.camera import Camera
from glbump.environment import Captured, CubeMap, HemiCube, Pictured
from glbump.errors import SceneError
from glbump.maps.cube import face_axes
from glbump.scene import Scene
from glbump.shapes import Cube, Shape, Sphere, Torus, Vec3

F32 = npt.NDArray[np.float32]
Taken = TypeVar("Taken")

FACES = {"cube": (0, 1, 2, 3, 4, 5), "hemicube": (2, 0, 1, 4, 5)}
"""What is drawn, as numbers of a cube's faces, in the order in which CubeMap and HemiCube take pictures."""


def captured(scene: Scene) -> tuple[Captured, ...]:
    """All that a scene's surfaces capture, each once."""
    return tuple(e for e in scene.environments if isinstance(e, Captured))


def cameras(environment: Captured) -> list[Camera]:
    """One for each face drawn. Its picture is the face of OpenGL's table with t up: the lowest row is t = 0."""
    eye = np.array(environment.position)
    # As far off as the eye is from 0: a target 1 beside an eye at 1e17 would be the eye.
    reach = max(1.0, float(np.abs(eye).max()))
    return [
        Camera(eye=environment.position, target=_vec3(eye + reach * major), up=_vec3(along_t), fov=90)
        for major, _, along_t in face_axes()[list(FACES[environment.faces])]
    ]


def _vec3(values: npt.NDArray[np.float64]) -> Vec3:
    x, y, z = values.tolist()
    return x, y, z


def rounds(scene: Scene) -> list[tuple[Captured, ...]]:
    """What is captured for the first bounce, the second and so on: what has as many bounces, and what others need for
    theirs."""
    every = captured(scene)
    result: list[tuple[Captured, ...]] = []
    needed: tuple[Captured, ...] = ()
    for bounce in range(max((e.bounces for e in every), default=0), 0, -1):
        needed = tuple(e for e in every if e.bounces == bounce or any(other != e for other in needed))
        result.insert(0, needed)
    return result


def seen_by(scene: Scene, environment: Captured, bounce: int) -> Scene:
    """What is drawn for `environment`, by any camera: all surfaces but those that have it, before the scene's own
    environment; at the first bounce other captured environments are the scene's own too."""
    surfaces = [
        replace(surface, environment=None) if bounce == 1 and isinstance(surface.environment, Captured) else surface
        for surface in scene.surfaces
        if surface.environment != environment
    ]
    return replace(scene, surfaces=surfaces, environment=replace(scene.environment, background=True))


def in_rounds(
    scene: Scene,
    take: Callable[[Captured, Scene, Mapping[Captured, Taken]], Taken],
    let_go: Callable[[Taken], None] = lambda _: None,
) -> dict[Captured, Taken]:
    """All captures of a scene. take(environment, what it sees, the captures that it sees it with) makes one; let_go
    is given each that is needed no more."""
    done: dict[Captured, Taken] = {}
    before: dict[Captured, Taken] = {}
    for bounce, wanted in enumerate(rounds(scene), 1):
        now = {e: take(e, seen_by(scene, e, bounce), before) for e in wanted}
        done |= {e: taken for e, taken in now.items() if e.bounces == bounce}
        for e, taken in before.items():
            if done.get(e) is not taken:
                let_go(taken)
        before = now
    return done


def pictured(environment: Captured, pictures: Sequence[F32]) -> CubeMap | HemiCube:
    """What was captured, as the environment of its pictures (N, N, 3), row 0 at t = 0, in the order of FACES."""
    common = {f.name: getattr(environment, f.name) for f in fields(Pictured)}
    if environment.faces == "cube":
        return CubeMap(np.stack(pictures), orientation="opengl", **common)
    top, *sides = pictures
    return HemiCube([top, *(side[: environment.size // 2] for side in sides)], orientation="opengl", **common)


def with_pictures(scene: Scene, pictures: Mapping[Captured, CubeMap | HemiCube]) -> Scene:
    """The scene with pictures in place of what they were captured for."""

    surfaces = [
        replace(surface, environment=pictures[surface.environment])
        if isinstance(surface.environment, Captured)
        else surface
        for surface in scene.surfaces
    ]
    return replace(scene, surfaces=surfaces)


def gain(scene: Scene) -> float:
    """Most that captures brighten a scene by: the largest exposure, as often as light goes on between them."""
    every = captured(scene)
    stops = max((e.exposure for e in every), default=0.0) * max((e.bounces for e in every), default=0)
    return float(2.0 ** min(max(stops, 0.0), 1000.0))


def count(scene: Scene, environment: Captured) -> int:
    """How many pictures are drawn for `environment`, those for other surfaces' bounces included."""
    return len(FACES[environment.faces]) * sum(environment in wanted for wanted in rounds(scene))


def require_outside(scene: Scene) -> None:
    """SceneError where something is captured from inside another surface. Mesh files are not looked at."""
    for environment in captured(scene):
        for i, surface in enumerate(scene.surfaces):
            inside = _holds(surface.shape, surface.transform.to_object(environment.position))
            if inside and surface.environment != environment:
                raise SceneError(
                    f"surface {i} ({surface.shape.kind}) encloses {environment.position}, from where the scene is "
                    "captured, and hides all the rest; move it, or give environment.position another place"
                )


def _holds(shape: Shape, p: npt.NDArray[np.float64]) -> bool:
    """Whether a point in the shape's own space is inside it."""
    x, y, z = p.tolist()
    match shape:
        case Sphere(radius=radius):
            return bool(np.linalg.norm(p) < radius)
        case Torus(radius=radius, tube=tube):
            return bool(np.hypot(np.hypot(x, z) - radius, y) < tube)
        case Cube(size=size):
            return all(2 * abs(c) < length for c, length in zip((x, y, z), size))
    return False
