"""Which settings are tried: what a knob does not change is skipped, fronts, what promises most together."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from glbump import patterns
from glbump.camera import Camera
from glbump.environment import LatLong, Sky
from glbump.gl.renderer import Renderer
from glbump.quality import KNOBS, Quality
from glbump.scene import Bump, Material, Scene, Surface
from glbump.shapes import Sphere
from glbump.trade.features import FEATURES, left_out
from glbump.trade.settings import BASE, KNOB, PRESET, Setting, combinations, front, one_at_a_time, presets, work

MIRROR = Material(metallic=1, roughness=0)
BRICKS = Bump(patterns.bricks((32, 32), seed=1), amplitude=0.02)
CAMERA = Camera(eye=(0, 0, 4))
PLAIN = Scene([Surface(Sphere(), MIRROR)], Sky(), CAMERA)
BUMPED = Scene([Surface(Sphere(), MIRROR, bump=BRICKS)], LatLong(patterns.fbm((16, 32), seed=1)), CAMERA)
SIZE = (64, 64)


def planned(renderer: Renderer, scene: Scene) -> list[Setting]:
    return one_at_a_time(Quality(), lambda quality: renderer.plan(scene, SIZE, quality))


def test_every_value_of_every_knob_is_tried_or_said_to_do_nothing(renderer: Renderer) -> None:
    base = Quality()
    tried = {(knob, value) for s in planned(renderer, BUMPED) for knob, value in s.changes.items()}
    assert tried == {(name, v) for name, knob in KNOBS.items() for v in knob.values if v != getattr(base, name)}


def test_knobs_of_what_a_scene_has_not_are_skipped(renderer: Renderer) -> None:
    why = {s.name: s.skipped for s in planned(renderer, PLAIN)}
    for name, value in (("bump_kernel", "bspline"), ("gloss_size", 64), ("environment_layout", "cube")):
        assert why[f"{name}={value}"] == "nothing here depends on it"
    assert why["samples=1"] == ""
    why = {s.name: s.skipped for s in planned(renderer, BUMPED)}
    assert why["bump_kernel=bspline"] == why["environment_layout=cube"] == why["bump_filter=bilinear"] == ""
    assert why["gloss_size=64"] == "nothing here depends on it"


def test_what_is_skipped_draws_the_same_picture(renderer: Renderer) -> None:
    # The claim itself, of each skipped setting of a scene with bumps and a picture.
    base = renderer.render(BUMPED, SIZE, Quality()).pixels
    skipped = [s for s in planned(renderer, BUMPED) if s.skipped == "nothing here depends on it"]
    assert len(skipped) > 5
    for setting in skipped:
        quality = replace(Quality(), **setting.changes)
        assert (renderer.render(BUMPED, SIZE, quality).pixels == base).all(), setting.name
    # And what is not may not.
    assert (renderer.render(BUMPED, SIZE, Quality(bump_kernel="forward")).pixels != base).any()


def test_work_is_the_plan_without_its_reasons(renderer: Renderer) -> None:
    plan = renderer.plan(BUMPED, SIZE)
    reworded = replace(plan, choices=tuple(replace(c, why="because") for c in plan.choices))
    assert work(plan) == work(reworded)
    assert hash(work(plan)) == hash(work(reworded))
    assert work(plan) != work(renderer.plan(BUMPED, SIZE, Quality(bump_kernel="sobel")))


def test_presets_come_with_the_base_first() -> None:
    assert [(s.name, s.kind) for s in presets(Quality())] == [("balanced", BASE), ("fast", PRESET), ("exact", PRESET)]
    own = presets(Quality(samples=9))
    assert [(s.name, s.kind) for s in own][:2] == [("base", BASE), ("fast", PRESET)]
    assert "balanced" in [s.name for s in own]


def test_the_front_is_what_none_beats() -> None:
    points = [(3.0, 3.0), (1.0, 5.0), (2.0, 3.0), (2.0, 4.0), (4.0, 1.0), (1.0, 5.0), (5.0, 0.999)]
    assert front(points) == [1, 2, 4, 6]
    # A dearer one has to win something.
    assert front(points, alike=0.02) == [1, 2, 4]
    assert front([]) == []
    assert front([(1.0, 0.0), (2.0, 0.0)]) == [0]


def row(kind: str, error: float, times: float, spread: float = 0.0, **changes: Any) -> dict[str, Any]:
    cost = {"times": {"median": times, "low": times - spread, "high": times + spread}}
    return {"kind": kind, "error": {"rmse": error}, "cost": cost, "changes": changes, "name": str(changes)}


def test_combinations_are_of_what_helps(renderer: Renderer) -> None:
    rows = [
        row(BASE, 0.02, 1.0),
        row(KNOB, 0.02, 0.5, bump_format="slopes8"),
        row(KNOB, 0.01, 1.5, samples=9),
        row(KNOB, 0.04, 2.0, bump_kernel="forward"),  # worse at both
        row(KNOB, 0.02, 0.9, 0.2, frame_format="float"),  # by chance
    ]

    def plan(quality: Quality) -> Any:
        return renderer.plan(BUMPED, SIZE, quality)

    found = combinations(Quality(), rows, "rmse", 8, plan)
    assert [s.changes for s in found] == [{"samples": 9, "bump_format": "slopes8"}] or [s.changes for s in found] == [
        {"bump_format": "slopes8", "samples": 9}
    ]
    assert found[0].quality == Quality(bump_format="slopes8", samples=9)
    assert combinations(Quality(), rows[:2], "rmse", 8, plan) == []


def test_knobs_that_do_nothing_beside_others_are_left_alone(renderer: Renderer) -> None:
    # Heights read in the shader are kept as heights, whatever the format of slopes.
    rows = [
        row(BASE, 0.02, 1.0),
        row(KNOB, 0.015, 1.0, bump_read="shader"),
        row(KNOB, 0.02, 0.5, bump_format="oct32"),
        row(KNOB, 0.01, 1.5, samples=9),
    ]
    found = combinations(Quality(), rows, "rmse", 8, lambda quality: renderer.plan(BUMPED, SIZE, quality))
    together = [set(s.changes) for s in found]
    assert {"bump_read", "samples"} in together
    assert not [knobs for knobs in together if {"bump_read", "bump_format"} <= knobs]


def test_features_that_a_plan_leaves_out_are_forced(renderer: Renderer) -> None:
    found = left_out(PLAIN, Quality(), lambda scene, quality: renderer.plan(scene, SIZE, quality))
    names = [s.name for s in found]
    assert names[-1] == "all of these"
    assert {"bumps", "tint", "roughness", "diffuse light", "rotation"} <= set(names)
    assert set(names[:-1]) <= {feature.name for feature in FEATURES}
    own = renderer.plan(PLAIN, SIZE)
    for setting in found:
        assert work(renderer.plan(setting.scene or PLAIN, SIZE, setting.quality)) != work(own)
    bumped = left_out(BUMPED, Quality(), lambda scene, quality: renderer.plan(scene, SIZE, quality))
    assert "bumps" not in [s.name for s in bumped]


@pytest.mark.parametrize("name", ["bumps", "tint", "diffuse light", "rotation"])
def test_a_forced_feature_leaves_the_picture_as_it_is(renderer: Renderer, name: str) -> None:
    found = left_out(PLAIN, Quality(), lambda scene, quality: renderer.plan(scene, SIZE, quality))
    setting = next(s for s in found if s.name == name)
    base = renderer.render(PLAIN, SIZE).pixels
    got = renderer.render(setting.scene or PLAIN, SIZE, setting.quality).pixels
    # Two steps of a half near 1: other code rounds otherwise.
    assert abs(got - base).max() < 2e-3
