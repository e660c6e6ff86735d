"""Captures in float64: the faces of a cube as ray-cast pictures."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np

from glbump.captures import cameras, in_rounds, pictured, require_outside, with_pictures
from glbump.environment import Captured, CubeMap, HemiCube
from glbump.frame import Frame
from glbump.scene import Scene

Taken = CubeMap | HemiCube


def with_captures(scene: Scene, draw: Callable[[Scene, tuple[int, int]], Frame]) -> Scene:
    """The scene with the pictures that its surfaces capture of it as their environments.

    draw: `glbump.reference.render` of a scene without captured environments. Raises SceneError as require_outside.
    """
    require_outside(scene)

    def take(environment: Captured, seen: Scene, shown: Mapping[Captured, Taken]) -> Taken:
        seen = with_pictures(seen, shown)
        frames = [draw(replace(seen, camera=camera), (environment.size,) * 2) for camera in cameras(environment)]
        # A frame's lowest row is the face's first.
        return pictured(environment, [np.asarray(frame)[::-1, :, :3] for frame in frames])

    return with_pictures(scene, in_rounds(scene, take))
