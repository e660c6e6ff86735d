"""What errors are predicted: laws of their sums, what was measured before, and predictions beside measured pictures."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from glbump import patterns
from glbump.camera import Camera
from glbump.contents import Contents
from glbump.environment import Captured, LatLong, Sky
from glbump.errors import SceneError
from glbump.gl.renderer import Renderer
from glbump.maps.encodings import ENCODINGS
from glbump.plan import make_plan
from glbump.quality import KNOBS, Quality
from glbump.reference.shade import render as reference
from glbump.reference.shade import render_regions
from glbump.scene import Bump, Material, Scene, Surface
from glbump.shapes import Sphere, Torus
from glbump.trade.metrics import compare
from glbump.trade.model import (
    APART,
    FACTOR,
    MISSING,
    TOGETHER,
    Model,
    Part,
    combined,
    factor,
    saturated,
    unsaturated,
)

SIZE = (32, 32)
MIRROR = Material(metallic=1, roughness=0)
BALL = Scene([Surface(Sphere(), MIRROR, bump=Bump(patterns.fbm((64, 64)), 0.02))], Sky(), Camera(eye=(0, 0, 4)))


def part(variance: float, bias: float = 0.0) -> Part:
    return Part((), variance, bias, "")


def test_every_knob_has_its_place_once() -> None:
    assert sorted([*TOGETHER, *(knob for knobs in APART for knob in knobs), *MISSING]) == sorted(KNOBS)


def test_small_errors_add_as_squares_and_large_ones_saturate() -> None:
    assert combined([], 0.1) == 0
    assert combined([part(1e-8), part(3e-8)], 0.1) == pytest.approx(4e-8, rel=1e-6)
    assert combined([part(4e-8)], 0.1) == pytest.approx(4 * combined([part(1e-8)], 0.1))  # an amplitude, doubled
    # Of one part alone nothing is assumed; two that know nothing of the truth are no worse than one.
    assert combined([part(0.2)], 0.1) == pytest.approx(0.2)
    assert combined([part(0.19), part(0.19)], 0.1) == pytest.approx(0.2, rel=0.01)
    assert combined([part(0.1), part(0.1)], 0.1) < 0.17
    assert saturated(1e9, 0.1) == pytest.approx(0.2)
    assert saturated(1.0, 0.0) == 0


@pytest.mark.parametrize("square", [1e-12, 1e-4, 0.05, 0.15])
def test_saturating_goes_both_ways(square: float) -> None:
    assert saturated(unsaturated(square, 0.1), 0.1) == pytest.approx(square, rel=1e-9)


def test_biases_add_as_they_are() -> None:
    assert combined([part(0, 0.01), part(0, 0.02)], 0.1) == pytest.approx(0.03**2)
    assert combined([part(1e-4, 0.01)], 0.1) == pytest.approx(2e-4)
    assert part(9e-4, 0.04).rmse == pytest.approx(0.05)


def test_independent_errors_of_a_signal_add_as_predicted() -> None:
    """Noise of two kinds on one picture, of 40,000 values: their squares' sum is known to root(2 / 40,000), 0.7 %."""
    chance = np.random.default_rng(3)
    one, other = (s * chance.standard_normal(40_000) for s in (0.01, 0.03))
    got = np.mean((one + other) ** 2)
    assert combined([part(float(np.mean(one**2))), part(float(np.mean(other**2)))], 100.0) == pytest.approx(
        got, rel=0.03
    )
    # The same error twice is not independent, and the law does not hold.
    assert combined([part(float(np.mean(one**2)))] * 2, 100.0) < 0.6 * np.mean((2 * one) ** 2)


WAVES = 300


def _light(dirs: np.ndarray, waves: np.ndarray, phase: np.ndarray) -> np.ndarray:
    """A band-limited environment: cosines of directions (N, 3), of a deviation of 1."""
    return math.sqrt(2 / len(waves)) * np.cos(dirs @ waves.T + phase).sum(axis=-1)


@pytest.mark.parametrize(("band", "within"), [(10, 0.06), (200, 0.09)])
def test_mirrors_with_rounded_normals_are_off_as_was_measured(band: int, within: float) -> None:
    """x = 1/2 E|grad L|^2 2 eps^2 (1 + E cos^2) of normals in three bytes: NUMERICS 6 has 4 % below half of the light's
    deviation, 7 % where it saturates; 2 % more for chance, of 8000 directions and 300 waves."""
    chance = np.random.default_rng(band)
    waves = chance.standard_normal((WAVES, 3))
    waves *= band / np.linalg.norm(waves, axis=1, keepdims=True)
    phase = chance.uniform(0, 2 * np.pi, WAVES)
    normals = chance.standard_normal((8000, 3))
    normals[:, 2] = np.abs(normals[:, 2])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    kept = ENCODINGS["rgb8"].decode(ENCODINGS["rgb8"].encode(normals))
    look = np.array([0.0, 0.0, -1.0])

    def mirrored(n: np.ndarray) -> np.ndarray:
        return look - 2 * (n @ look)[:, None] * n

    dirs = mirrored(normals)
    off = _light(mirrored(kept), waves, phase) - _light(dirs, waves, phase)
    eps = np.mean(np.sum((kept - normals) ** 2, axis=1))
    slopes = -math.sqrt(2 / WAVES) * np.sin(dirs @ waves.T + phase) @ waves
    slopes -= np.sum(slopes * dirs, axis=1, keepdims=True) * dirs
    x = 0.5 * np.mean(np.sum(slopes**2, axis=1)) * 2 * eps * (1 + np.mean(normals[:, 2] ** 2))
    variance = float(_light(dirs, waves, phase).var())
    got, said = math.sqrt(np.mean(off**2)), math.sqrt(saturated(float(x), variance))
    assert said == pytest.approx(got, rel=within), (band, got, said)


def test_factors_go_both_ways() -> None:
    assert factor(2.0, 3.0) == factor(3.0, 2.0) == pytest.approx(1.5)
    assert factor(0.0, 0.0) == 1
    assert factor(0.0, 1e-9) == math.inf


def test_regions_are_rendered_as_one_by_one() -> None:
    regions = [(0, 0, 8, 8), (16, 8, 8, 16)]
    for region, frame in zip(regions, render_regions(BALL, SIZE, regions, 4, quality="balanced")):
        alone = reference(BALL, SIZE, 4, quality="balanced", region=region)
        np.testing.assert_array_equal(frame.pixels, alone.pixels)


def test_the_truth_itself_is_not_off() -> None:
    contents = Contents()
    truth = reference(BALL, SIZE, 16, contents=contents).pixels
    exact = Quality("exact", silhouette=0.001)

    def plan(quality: Quality) -> object:
        return make_plan(BALL, quality, SIZE, contents)

    model = Model(BALL, SIZE, truth, exact, plan, contents)  # type: ignore[arg-type]
    said = model.predict(exact)
    assert said.rmse.value < 0.05 / 255, said  # a polygon's outline, by the formula, and 32 bits
    assert {p.knobs for p in said.parts} <= {("silhouette",), TOGETHER}
    coarse = model.predict(Quality("exact", samples=1, silhouette=0.001))
    assert coarse.rmse.low <= coarse.rmse.value <= coarse.rmse.high
    assert coarse.rmse.value > 20 * said.rmse.value


def test_captured_surroundings_are_refused() -> None:
    scene = Scene([Surface(Sphere(), MIRROR, environment=Captured(size=16))], Sky(), Camera(eye=(0, 0, 4)))
    with pytest.raises(SceneError, match="not predicted"):
        Model(scene, SIZE, np.zeros((32, 32, 4), np.float32), Quality(), lambda _: None, Contents())  # type: ignore[arg-type,return-value]


LIGHTS = LatLong(patterns.fbm((64, 128), seed=4)[..., None].repeat(3, axis=-1).astype(np.float32))
DIMPLES = Bump(patterns.dimples((64, 64), seed=2), 0.03, repeat=(4, 2))
SCENES = {
    "mirror": Scene([Surface(Sphere(), MIRROR, DIMPLES)], LIGHTS, Camera(eye=(0, 0, 4))),
    "rough": Scene([Surface(Torus(), Material(roughness=0.4), DIMPLES)], LIGHTS, Camera(eye=(0, 2, 4))),
}
SWEPT: dict[str, tuple[Any, ...]] = {
    "samples": (1,),
    "silhouette": (1.0,),
    "environment_filter": ("bilinear",),
    "environment_layout": ("octahedral",),
    "environment_level": ("longest",),
    "bump_kernel": ("sobel",),
    "bump_read": ("screen",),
    "bump_format": ("slopes8",),
    "bump_filter": ("bilinear",),
    "texture_format": ("srgb8",),
    "gloss_size": (16,),
    "preset": ("balanced", "fast"),
}


@pytest.mark.parametrize("name", SCENES)
def test_nine_of_ten_settings_are_predicted_within_the_factor(name: str) -> None:
    """Settings swept one at a time, and the presets; what the plan does not distinguish counts once."""
    scene = SCENES[name]
    found = {}
    with Renderer() as renderer:
        contents = renderer.contents

        def plan(quality: Quality):  # type: ignore[no-untyped-def]
            return renderer.plan(scene, SIZE, quality)

        truth = reference(scene, SIZE, 16, contents=contents).pixels
        model = Model(scene, SIZE, truth, Quality("balanced"), plan, contents)
        for knob, values in SWEPT.items():
            for value in values:
                quality = replace(Quality(), **{knob: value}) if knob != "preset" else Quality(str(value))
                said = model.predict(quality)
                drawn = renderer.render(scene, SIZE, quality).pixels
                measured = compare(drawn, truth, perceptual=False)["rmse"]
                found[f"{knob}={value}"] = factor(measured, said.rmse.value), 255 * measured, 255 * said.rmse.value
    near = np.mean([off <= FACTOR for off, *_ in found.values()])
    assert near >= 0.9, found
    # It tells settings apart: one error for all would not do.
    measured = np.array([m for _, m, _ in found.values()])
    assert np.mean(np.maximum(measured / np.median(measured), np.median(measured) / measured) <= FACTOR) < near
