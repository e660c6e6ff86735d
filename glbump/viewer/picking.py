"""What lies under the cursor: one ray cast against the scene, with the reference's float64 shapes."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from glbump.contents import Contents
from glbump.reference.cast import Grid, cast
from glbump.reference.shade import places_of
from glbump.scene import Scene
from glbump.viewer.navigation import ray


class Picked(NamedTuple):
    """The surface that is seen, and where on it: a point of the world."""

    surface: int
    point: npt.NDArray[np.float64]


def pick(scene: Scene, contents: Contents, at: tuple[float, float], size: tuple[int, int]) -> Picked | None:
    """What the camera sees at a place: shares of the window's height, right and up of its middle; None where that is
    the environment. size: (width, height) in pixels. Raises MeshError where a mesh can no longer be read."""
    origin, direction = ray(scene.camera, at)
    # The ray is the only one of its grid.
    offset = np.array([at[0] * size[1] + size[0] / 2, (0.5 - at[1]) * size[1]])
    found: tuple[float, Picked] | None = None
    for i, surface in enumerate(scene.surfaces):
        mesh = contents.mesh(surface.shape)
        grid = Grid(places_of(scene, i, mesh, size, offset - 0.5), 1, 1)
        placed = surface.transform
        start, along = placed.to_object(tuple(origin.tolist())), placed.inverse() @ direction
        hits = cast(surface.shape, mesh, grid, start[None], along[None])
        if len(hits.t) and (found is None or hits.t[0] < found[0]):
            found = float(hits.t[0]), Picked(i, origin + hits.t[0] * direction)
    return None if found is None else found[1]
