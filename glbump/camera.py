"""The camera: where the picture is taken from, and its matrices and rays. pyrr stays in this file."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from glbump import validate as check
from glbump.errors import SceneError
from glbump.shapes import Vec3


@dataclass(frozen=True)
class Camera(check.Frozen):
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
            eye=check.vector("camera.eye", self.eye, 3),
            target=check.vector("camera.target", self.target, 3),
            up=check.vector("camera.up", self.up, 3),
            fov=check.number("camera.fov", self.fov, above=0, most=179),
            height=check.number("camera.height", self.height, above=0),
        )
        check.choice("camera.projection", self.projection, ("perspective", "orthographic"))
        for name in ("near", "far"):
            value = getattr(self, name)
            if value is not None:
                self._store(**{name: check.number(f"camera.{name}", value, above=0)})
        if self.near is not None and self.far is not None and self.far <= self.near:
            raise SceneError(
                f"camera.far must be greater than camera.near; got near {self.near:g}, far {self.far:g}"
            )
        look = np.subtract(self.target, self.eye)
        if not np.any(look):
            raise SceneError(f"camera.target must differ from camera.eye; got {self.eye} for both")
        across = np.cross(look / np.abs(look).max(), np.divide(self.up, max(np.abs(self.up).max(), 1e-300)))
        if np.linalg.norm(across) < 1e-9:
            raise SceneError(
                f"camera.up must not be parallel to the view direction; got up {self.up}, "
                f"eye {self.eye}, target {self.target}"
            )
