"""Scenes by number: shapes, bumps, environments, cameras and roughness by chance, the same again for a number."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import numpy as np

from benchmarks.scenes import DATA
from glbump.camera import Camera
from glbump.demo import panorama
from glbump.environment import Chrome, CubeMap, Environment, Fractal, LatLong, Sky
from glbump.maps import patterns
from glbump.scene import Bump, Material, Scene, Surface
from glbump.shapes import Cube, Plane, Shape, Sphere, Torus, Transform, Vec3

_PHOTOGRAPHED = ("cc0/venice.exr", "cc0/workshop.exr", "openexr/KernerEnvLatLong.exr", "openexr/KernerEnvCube.exr")


@cache
def _environments() -> tuple[Environment, ...]:
    """Photographed where they are at hand, and the package's own."""
    found = [DATA / name for name in _PHOTOGRAPHED if (DATA / name).is_file()]
    pictures = [CubeMap(path) if "Cube" in path.name else LatLong(path) for path in found]
    return (*pictures, LatLong(np.minimum(panorama.evening(512), 8)), Sky(), Chrome(), Fractal())


@cache
def _heights() -> tuple[np.ndarray, ...]:
    return patterns.bricks((256, 256)), patterns.dimples((256, 256)), patterns.fbm((256, 256))


def scene(number: int) -> Scene:
    """The scene of a number: one surface or two, seen whole, from near enough to matter."""
    chance = np.random.default_rng(1000 + number)
    environments = _environments()
    environment = environments[int(chance.integers(len(environments)))]
    surfaces = [_surface(chance, (0.0, 0.0, 0.0))]
    if chance.random() < 0.4:
        surfaces.append(_surface(chance, (1.6, 0.3, -1.0)))
    away, turn, rise = chance.uniform(3.2, 7), chance.uniform(0, 2 * math.pi), chance.uniform(-0.1, 0.9)
    eye = (away * math.sin(turn) * math.cos(rise), away * math.sin(rise), away * math.cos(turn) * math.cos(rise))
    camera = Camera(eye=eye, target=(0, 0, 0), fov=float(chance.uniform(25, 50)))
    rotated = replace(environment, rotation=float(chance.uniform(0, 360)))
    return Scene(surfaces, rotated, camera)


def _surface(chance: np.random.Generator, place: Vec3) -> Surface:
    shapes: Sequence[Shape] = (Sphere(1), Torus(0.9, 0.35), Cube(), Plane((2.4, 2.4)))
    shape = shapes[int(chance.integers(len(shapes)))]
    roughness = float(chance.choice([0, 0, 0, chance.uniform(0.1, 0.8)]))
    colour = tuple(chance.uniform(0.5, 1, 3).tolist())
    material = Material(colour, metallic=float(chance.choice([1, 1, 0])), roughness=roughness)
    heights = _heights()
    which, repeats = int(chance.integers(len(heights) + 1)), float(chance.integers(1, 9))
    bump = None
    if which < len(heights):
        flat = chance.uniform(0.005, 0.05) / repeats**0.5
        bump = Bump(heights[which], float(flat), repeat=(repeats, max(1.0, repeats // 2)))
    turned = Transform(translate=place, rotate=tuple(chance.uniform(-30, 30, 3).tolist()))
    return Surface(shape, material, bump, transform=turned)
