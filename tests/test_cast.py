"""Rays against triangles: few pairs are tried, and none that would have met."""

from __future__ import annotations

import numpy as np
import pytest

from glbump.camera import Camera, pixel_rays
from glbump.mesh import Mesh
from glbump.reference.cast import Grid, _pairs, cast
from glbump.reference.shade import places_of
from glbump.scene import Scene, Surface
from glbump.shapes import MeshData

SIZE = (40, 24)


def grids(mesh: Mesh, camera: Camera) -> tuple[Grid, Grid]:
    """Where the vertices are; and where nothing is known of them, so that every pair is tried."""
    shape = MeshData(mesh.positions, mesh.triangles)
    places = places_of(Scene([Surface(shape)], camera=camera), 0, mesh, SIZE, np.full(2, 0.5))
    return Grid(places, *SIZE), Grid(np.zeros_like(places), *SIZE)


@pytest.mark.parametrize("fov", [20, 60, 120])
@pytest.mark.parametrize("size", [0.1, 1.0, 10.0])
@pytest.mark.parametrize("projection", ["perspective", "orthographic"])
def test_no_hit_is_missed_about_the_eye(projection: str, size: float, fov: float) -> None:
    """Triangles before, behind, beside and across the eye, small and large."""
    rng = np.random.default_rng(1)
    corners = rng.uniform(-2, 2, (400, 1, 3)) + size * rng.uniform(-1, 1, (400, 3, 3))
    mesh = Mesh(corners.reshape(-1, 3), np.arange(1200, dtype=np.int32).reshape(-1, 3))
    camera = Camera(eye=(0.1, 0, 0.2), target=(1, 0.3, -1), fov=fov, projection=projection)
    origins, dirs = (a.reshape(-1, 3) for a in pixel_rays(camera, SIZE))
    known, unknown = grids(mesh, camera)
    few, all_pairs = (cast(MeshData(mesh.positions, mesh.triangles), mesh, g, origins, dirs) for g in (known, unknown))
    assert len(all_pairs.ray) > 20
    assert np.array_equal(few.ray, all_pairs.ray)
    assert np.array_equal(few.t, all_pairs.t)


def test_what_lies_under_and_behind_the_eye_costs_nothing() -> None:
    """A ground of 3200 triangles with the eye above its middle: few of them reach past the eye and into the picture."""
    u, v = (a.reshape(-1) for a in np.meshgrid(np.arange(41), np.arange(41)))
    here = (np.arange(40)[:, None] * 41 + np.arange(40)).reshape(-1)
    triangles = np.concatenate([np.stack([here, here + 1, here + 42], -1), np.stack([here, here + 42, here + 41], -1)])
    ground = Mesh(np.stack([u - 20.0, 0 * u, 20.0 - v], axis=-1), triangles.astype(np.int32))
    tried = sum(len(ray) for _, ray in _pairs(ground, grids(ground, Camera(eye=(0, 2, 0), target=(0, 1.5, -4)))[0]))
    assert tried < 20 * SIZE[0] * SIZE[1]
