"""Reflections of near walls: an environment with bounds shows them where a ray meets them."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from glbump import reference
from glbump.camera import Camera, pixel_rays
from glbump.environment import BoxBounds, Captured, CubeMap, SphereBounds
from glbump.gl.renderer import Renderer
from glbump.maps.layout import CUBE, texel_dirs
from glbump.quality import Quality
from glbump.scene import Material, Scene, Surface
from glbump.shapes import Plane, Sphere, Torus, Transform

F64 = npt.NDArray[np.float64]
MIRROR = Material(metallic=1, roughness=0)
TAKEN = np.array([0.3, 0.2, -0.4])
BOX = BoxBounds((-2, -1.5, -2), (2, 1.5, 2))
BALL = SphereBounds((0.1, 0, 0), 2.4)
CAMERA = Camera(eye=(1.2, 0.8, 1.4), target=(-0.8, -0.4, 0.3), fov=60)


def box_wall(p: F64, dir: F64) -> F64:
    """Where rays from inside the box meet its wall, by slabs."""
    with np.errstate(divide="ignore"):
        t = np.where(dir > 0, (np.array(BOX.high) - p) / dir, (np.array(BOX.low) - p) / dir).min(axis=-1)
    result: F64 = p + t[..., None] * dir
    return result


def ball_wall(p: F64, dir: F64) -> F64:
    """Where rays from inside the sphere meet its wall: the larger root."""
    q = p - np.array(BALL.centre)
    b, c = (q * dir).sum(axis=-1), (q * q).sum(axis=-1) - BALL.radius**2
    result: F64 = p + (-b + np.sqrt(b * b - c))[..., None] * dir
    return result


WALLS: dict[str, Any] = {"box": (BOX, box_wall), "sphere": (BALL, ball_wall)}


def paint(place: F64) -> F64:
    """Light of a wall at a place in the world: smooth, and everywhere else another."""
    return 0.5 + 0.5 * np.sin(2 * place)


def room(kind: str) -> CubeMap:
    bounds, wall = WALLS[kind]
    picture = paint(wall(TAKEN, texel_dirs(CUBE, (128, 128)))).astype(np.float32)
    return CubeMap(picture, bounds=bounds, position=tuple(TAKEN))


@pytest.mark.parametrize("kind", WALLS)
def test_a_flat_mirror_and_the_background_show_the_walls_themselves(renderer: Renderer, kind: str) -> None:
    surface = Surface(Plane((1.5, 1.5)), MIRROR, transform=Transform(translate=(-0.8, -0.4, 0.5)))
    scene = Scene([surface], room(kind), CAMERA)
    got = renderer.render(scene, (96, 96), Quality("exact", samples=1)).pixels[..., :3]
    origin, dir = pixel_rays(CAMERA, (96, 96), np.array([0.5, 0.5]))
    t = (-0.4 - origin[..., 1]) / dir[..., 1]
    hit = origin + t[..., None] * dir
    inside = (t > 0) & (np.abs(hit[..., 0] + 0.8) < 0.74) & (np.abs(hit[..., 2] - 0.5) < 0.74)
    outside = (t < 0) | (np.abs(hit[..., 0] + 0.8) > 0.76) | (np.abs(hit[..., 2] - 0.5) > 0.76)
    wall = WALLS[kind][1]
    want = np.where(inside[..., None], paint(wall(hit, dir * (1, -1, 1))), paint(wall(origin, dir)))
    assert inside.mean() > 0.1 < outside.mean()
    error = np.abs(got - want)[inside | outside]
    # Bilinear reads of 128 texels a face lose at most h^2 / 8 of the second derivative; a box has edges besides, where
    # the paint's slope turns: half a texel of a slope of 2.5.
    assert np.percentile(error, 99) < 0.004
    assert error.max() < 0.03
    # As if the walls were infinitely far: another picture altogether.
    far = renderer.render(replace(scene, environment=replace(scene.environment, bounds=None)), (96, 96), "exact")
    assert np.abs(far.pixels[..., :3] - want)[inside].mean() > 0.1


@pytest.mark.parametrize("shape", [Sphere(0.6), Torus(0.5, 0.2)], ids=["sphere", "torus"])
@pytest.mark.parametrize("kind", WALLS)
def test_room_is_the_reference(renderer: Renderer, kind: str, shape: Any) -> None:
    environment = room(kind) if kind == "box" else replace(room(kind), rotation=30)
    turned = Transform(translate=(-0.8, -0.4, 0.5), rotate=(20, 30, 0), scale=(1.1, 1.1, 1.1))
    scene = Scene([Surface(shape, MIRROR, transform=turned)], environment, CAMERA)
    got, want = renderer.render(scene, (64, 64), "exact"), reference.render(scene, (64, 64), 16)
    # The limits of tests/test_accuracy.py, in linear light; outlines apart.
    error = np.abs(got.pixels - want.pixels)
    assert error.mean() < 1e-4
    assert np.percentile(error, 99) < 1e-3


def test_rough_and_clear_surfaces_are_in_the_room_too(renderer: Renderer) -> None:
    quality = Quality("exact", gloss_size=32, gloss_samples=16)
    for material in (Material(roughness=0.3, metallic=1), Material(roughness=0, transmission=1)):
        surface = Surface(Sphere(0.6), material, transform=Transform(translate=(-0.8, -0.4, 0.5)))
        scene = Scene([surface], room("box"), CAMERA)
        got = renderer.render(scene, (48, 48), quality)
        want = reference.render(scene, (48, 48), 16, quality=quality)
        assert np.abs(got.pixels - want.pixels).mean() < 2e-4
        far = replace(scene, environment=replace(scene.environment, bounds=None))
        assert np.abs(renderer.render(far, (48, 48), quality).pixels - want.pixels).mean() > 0.01


def test_a_room_so_large_that_it_does_not_matter_is_left_out(renderer: Renderer) -> None:
    surface = Surface(Sphere(1), MIRROR)
    for size, there in ((4, True), (1e4, False)):
        bounds = BoxBounds((-size, -size, -size), (size, size, size))
        environment = CubeMap(np.full((6, 4, 4, 3), 0.5, np.float32), bounds=bounds)
        plan = renderer.plan(Scene([surface], environment), (64, 64), "balanced")
        assert bool(plan.surfaces[0].has("PARALLAX")) == bool(plan.sky_parallax) == there
        assert any("degrees" in choice.why for choice in plan.choices if "parallax" in choice.what)
    # "exact" allows no error at all.
    assert renderer.plan(Scene([surface], environment), (64, 64), "exact").surfaces[0].has("PARALLAX")
    # Nothing is said, compiled or computed where there are no walls.
    plain = renderer.plan(Scene([surface], replace(environment, bounds=None)), (64, 64), "exact")
    assert not any("parallax" in choice.what for choice in plain.choices)


def test_bounds_belong_to_captures_too() -> None:
    assert Captured(bounds=BOX, position=(0, 0, 0)).bounds == BOX
