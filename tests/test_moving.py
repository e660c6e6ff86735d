"""A camera that moves: what it decides is decided anew, all else is kept, and the picture is that from scratch."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import glbump.plan
from glbump.camera import Camera
from glbump.contents import Contents, content_keys
from glbump.environment import BoxBounds, Environment, LatLong, Sky
from glbump.gl.context import Context
from glbump.gl.renderer import Renderer
from glbump.maps.images import write_picture
from glbump.plan import Capabilities, Planner, make_plan
from glbump.quality import Quality
from glbump.scene import Bump, Material, Scene, Surface
from glbump.shapes import Cube, Plane, Sphere, Torus, Transform

RANDOM = np.random.default_rng(31)
NOISE = RANDOM.random((16, 32, 3), np.float32)
MIRROR = Material(metallic=1, roughness=0)
BUMP = Bump(NOISE[..., 0], amplitude=0.02)
ROOM = LatLong(NOISE, bounds=BoxBounds((-9, -9, -9), (9, 9, 9)))
SCENES: dict[str, tuple[list[Surface], Environment]] = {
    "ball": ([Surface(Sphere(), MIRROR)], LatLong(NOISE)),
    "several": (
        [
            Surface(Torus(), MIRROR, BUMP),
            Surface(Cube(), MIRROR, transform=Transform(translate=(3, 0, 0))),
            Surface(Sphere(0.3), Material(metallic=0, roughness=0), transform=Transform(scale=(1, 2, 1))),
        ],
        LatLong(NOISE, exposure=1),
    ),
    "bumped floor": ([Surface(Plane((20, 20)), MIRROR, BUMP)], LatLong(NOISE)),
    "room": ([Surface(Sphere(), MIRROR)], ROOM),
    "nothing": ([], Sky()),
}


def cameras(count: int) -> list[Camera]:
    """Near and far, inside and outside of things; of several lenses."""
    away = 10.0 ** RANDOM.uniform(-2, 2, count)
    eyes = RANDOM.normal(size=(count, 3))
    eyes *= (away / np.linalg.norm(eyes, axis=-1))[:, None]
    fovs = RANDOM.choice([20.0, 40.0], count)
    lenses: list[dict[str, Any]] = [{"fov": fov} for fov in fovs]
    lenses[count // 2] = {"projection": "orthographic", "height": 3.0}
    return [Camera(eye=tuple(eye), **lens) for eye, lens in zip(np.clip(eyes, -8, 8), lenses)]


@pytest.mark.parametrize("preset", ["fast", "balanced"])
@pytest.mark.parametrize("name", SCENES)
def test_plans_of_a_moving_camera_are_plans_from_scratch(name: str, preset: str) -> None:
    surfaces, environment = SCENES[name]
    contents, quality, able = Contents(), Quality(preset), Capabilities(multisamples=4)
    planner, scene = Planner(contents), Scene(surfaces, environment)
    kept, last = 0, None
    for camera in cameras(30):
        for nudge in (0.0, 1e-9):
            seen = replace(scene, camera=replace(camera, eye=tuple(np.add(camera.eye, nudge))))
            plan = planner.plan(seen, quality, (64, 64), able, content_keys(seen))
            assert plan == make_plan(seen, quality, (64, 64), contents, able)
            kept += last is not None and plan.choices is last.choices
            last = plan
    # Every nudge, unless all of the camera counts.
    assert kept >= 30 or name == "room" or (name, preset) == ("bumped floor", "balanced")


def test_what_the_camera_does_not_decide_is_decided_once(context: Context, monkeypatch: pytest.MonkeyPatch) -> None:
    planned: list[Scene] = []
    real = make_plan

    def counted(scene: Scene, *rest: Any) -> Any:
        planned.append(scene)
        return real(scene, *rest)

    monkeypatch.setattr(glbump.plan, "make_plan", counted)
    scene = Scene(*SCENES["ball"])
    with Renderer(context=context) as fresh:
        for angle in np.linspace(0, 0.3, 20):
            fresh.render(replace(scene, camera=Camera(eye=(4 * np.sin(angle), 0, 4 * np.cos(angle)))), (16, 16), "fast")
        assert len(planned) == 1
        # A new size, quality or surface is a new plan; and so is a camera within the ball.
        fresh.render(scene, (17, 16), "fast")
        fresh.render(scene, (17, 16), "balanced")
        fresh.render(replace(scene, surfaces=[*scene.surfaces, *scene.surfaces]), (17, 16), "balanced")
        fresh.render(replace(scene, camera=Camera(eye=(0, 0, 0.5), target=(0, 0, -1))), (17, 16), "balanced")
        assert len(planned) == 5


@pytest.mark.parametrize(("name", "preset"), [("several", "fast"), ("bumped floor", "fast"), ("room", "balanced")])
def test_pictures_of_a_moving_camera_are_those_from_scratch(context: Context, name: str, preset: str) -> None:
    scene = Scene(*SCENES[name])
    with Renderer(context=context) as moving:
        for camera in cameras(3):
            for nudge in (0.0, 1e-3):
                seen = replace(scene, camera=replace(camera, eye=tuple(np.add(camera.eye, nudge))))
                got = moving.render(seen, (24, 24), preset)
                with Renderer(context=context) as fresh:
                    want = fresh.render(seen, (24, 24), preset)
                np.testing.assert_array_equal(got.pixels, want.pixels)
                assert {k: v for k, v in got.stats.items() if k != "ms"} == {
                    k: v for k, v in want.stats.items() if k != "ms"
                } | {"bytes": got.stats["bytes"]}


def test_a_file_that_changes_under_a_moving_camera_is_noticed(context: Context, tmp_path: Path) -> None:
    path = tmp_path / "sky.exr"
    with Renderer(context=context) as renderer:
        for value in (0.25, 0.5):
            write_picture(path, np.full((8 if value < 0.5 else 16, 16 if value < 0.5 else 32, 3), value, np.float32))
            for turn in range(3):
                camera = Camera(eye=(turn / 10, 0, 4))
                frame = renderer.render(Scene([], LatLong(path), camera), (4, 4), "fast")
                np.testing.assert_allclose(frame.pixels[..., :3], value, rtol=1e-3)
