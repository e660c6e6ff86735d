"""The presets stay in order: each step nearer to the truth, and for more work. Nothing here is timed."""

from __future__ import annotations

import numpy as np
import pytest

from glbump import patterns
from glbump.camera import Camera
from glbump.environment import LatLong
from glbump.gl.renderer import Renderer
from glbump.quality import KNOBS, PRESETS, Quality
from glbump.scene import Bump, Material, Scene, Surface
from glbump.shapes import Plane, Shape, Sphere, Torus, Transform
from glbump.trade.metrics import compare

ORDER = ("fast", "balanced", "exact")
SIZE = (64, 48)
ONE = Quality("balanced", samples=1)
"""Balanced as it must not become."""
TRUTH = Quality("exact", samples=256, lobe_samples=4)
WORK = ("samples", "texture_format", "frame_format", "bump_format", "dfg", "gloss", "gloss_size", "gloss_samples")
"""Knobs that cost more, or as much, from preset to preset."""


def _light() -> LatLong:
    """Blocks of chance light: edges of every direction, as rooms and windows have them."""
    blocks = np.random.default_rng(4).uniform(0, 1, (8, 16, 3)) ** 2
    return LatLong(np.kron(blocks, np.ones((8, 8, 1))).astype(np.float32))


def _scene(shape: Shape, roughness: float, bumped: bool) -> Scene:
    bump = Bump(patterns.waves((64, 64), seed=2), amplitude=0.05, repeat=(2, 1)) if bumped else None
    surface = Surface(shape, Material(metallic=1, roughness=roughness), bump, Transform(rotate=(25, 30, 0)))
    return Scene([surface], _light(), Camera(eye=(0, 0, 4), fov=40))


SCENES = {
    "mirror ball": _scene(Sphere(), 0, False),
    "bumped ball": _scene(Sphere(), 0, True),
    "bumped ring": _scene(Torus(), 0, True),
    "bumped floor": _scene(Plane((3, 3)), 0, True),
    "rough ball": _scene(Sphere(), 0.3, False),
}


def test_presets_are_those_in_order() -> None:
    assert tuple(PRESETS) == ORDER


@pytest.fixture(scope="module")
def errors() -> dict[str, list[float]]:
    """Of each scene, RMSE by preset, and of `balanced` with one sample."""
    found = {}
    with Renderer() as renderer:
        for name, scene in SCENES.items():
            truth = renderer.render(scene, SIZE, TRUTH).pixels
            pictures = [renderer.render(scene, SIZE, preset).pixels for preset in (*ORDER, ONE)]
            found[name] = [float(compare(p, truth, perceptual=False)["rmse"]) for p in pictures]
    return found


@pytest.mark.parametrize("name", SCENES)
def test_each_preset_is_nearer_than_the_one_before(name: str, errors: dict[str, list[float]]) -> None:
    fast, balanced, exact, _ = errors[name]
    assert fast > balanced > exact > 0


def test_balanced_has_at_most_half_of_the_error_of_fast_on_the_median_scene(errors: dict[str, list[float]]) -> None:
    assert np.median([balanced / fast for fast, balanced, *_ in errors.values()]) <= 0.5
    assert np.median([one / fast for fast, *_, one in errors.values()]) > 0.5  # else the test could not fail


@pytest.mark.parametrize("knob", WORK)
def test_no_preset_does_less_than_the_one_before(knob: str) -> None:
    values = [getattr(Quality(preset), knob) for preset in ORDER]
    words = KNOBS[knob].values
    ranks = [words.index(value) if isinstance(value, str) else value for value in values]
    assert ranks == sorted(ranks)


def test_the_outline_is_no_coarser_from_preset_to_preset() -> None:
    pixels = [Quality(preset).silhouette for preset in ORDER]
    assert pixels == sorted(pixels, reverse=True)


def test_exact_shades_more_than_three_times_as_often_as_balanced() -> None:
    """What its time over `balanced` comes from; benchmarks/studies/presets.py times it."""
    fast, balanced, exact = (Quality(preset).samples for preset in ORDER)
    assert fast < balanced
    assert exact > 3 * balanced
