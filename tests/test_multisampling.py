"""Four samples a pixel in one pass: the same picture as four passes, and the sky looked up as often as it needs."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

import glbump as gb
from glbump import Quality
from glbump.camera import sample_offsets
from glbump.contents import Contents
from glbump.gl.renderer import Renderer
from glbump.plan import Capabilities, make_plan

SIZE = (96, 96)
ABLE = Capabilities(multisamples=4)


def ball(*, background: bool = True, width: int = 64, **camera: float) -> gb.Scene:
    """A mirror ball in noise."""
    noise = np.random.default_rng(5).random((width // 2, width, 3)).astype(np.float32)
    return gb.Scene(
        [gb.Surface(gb.Sphere(), material=gb.Material(metallic=1, roughness=0))],
        gb.LatLong(noise, background=background),
        gb.Camera(eye=(0, 0, 4), target=(0, 0, 0), **camera),
    )


@pytest.fixture(scope="module")
def renderer() -> Iterator[Renderer]:
    with Renderer() as it:
        if not it.context.multisamples:
            pytest.skip("this driver cannot shade samples one by one (ARB_sample_shading)")
        yield it


def both(renderer: Renderer, scene: gb.Scene, quality: Quality) -> tuple[gb.Frame, gb.Frame]:
    """Drawn in one pass, and in four."""
    able = renderer.capabilities
    frames = []
    for multisamples in (4, 0):
        renderer.capabilities = replace(able, multisamples=multisamples)
        # The renderer keeps what it prepared for a scene: a new scene has none.
        frames.append(renderer.render(replace(scene), SIZE, quality))
    renderer.capabilities = able
    return frames[0], frames[1]


def test_one_pass_shows_what_four_passes_do(renderer: Renderer) -> None:
    """Samples stand at the same places, and have the same levels. The resolve rounds once where four additions round
    four times: 1e-3 of values below 1, half floats 5e-4 apart."""
    for filter in ("bilinear", "trilinear"):
        quality = Quality("balanced", environment_filter=filter)
        # Without a sky, which has its own test.
        one, four = both(renderer, ball(background=False), quality)
        assert one.stats["plan"]["samples"] == four.stats["plan"]["samples"] == "4"
        apart = np.abs(one.pixels - four.pixels)
        # At the outline a sample may fall to either side of an edge that passes through it.
        assert np.percentile(apart, 99.5) < 1e-3, filter
        assert (apart > 0.05).mean() < 2e-3, filter


def test_samples_are_shaded_one_by_one(renderer: Renderer) -> None:
    """Shaded once a pixel, a mirror's picture would differ from four passes' by far more than the test above allows."""
    scene = ball(background=False)
    one, _ = both(renderer, scene, Quality("balanced", environment_filter="bilinear"))
    single = renderer.render(scene, SIZE, Quality("balanced", samples=1, environment_filter="bilinear"))
    inside = one.pixels[..., 3] * single.pixels[..., 3] == 1
    assert np.percentile(np.abs(one.pixels - single.pixels)[inside], 90) > 0.02


def test_the_places_are_the_driver_s(renderer: Renderer) -> None:
    """A half plane of light, its edge moved across a pixel: as many steps as samples have columns, at their places."""
    edges = np.sort(sample_offsets(4)[:, 0])
    wall = gb.Quad(((0, -9, 0), (9, -9, 0), (9, 9, 0), (0, 9, 0)))
    covered = []
    for x in (edges[:-1] + edges[1:]) / 2:
        scene = gb.Scene(
            [
                gb.Surface(
                    wall, transform=gb.Transform(translate=(x, 0, 0)), material=gb.Material(metallic=1, roughness=0)
                )
            ],
            gb.Sky(background=False),
            gb.Camera(eye=(0.5, 0, 5), target=(0.5, 0, 0), projection="orthographic", height=1),
        )
        covered.append(float(renderer.render(scene, (1, 1), "balanced").pixels[0, 0, 3]))
    assert covered == [0.75, 0.5, 0.25]


@pytest.mark.parametrize(("width", "each"), [(64, False), (4096, True)])
def test_the_sky_is_looked_up_as_often_as_its_texels_need(width: int, each: bool) -> None:
    scene = ball(width=width)
    plan = make_plan(scene, Quality("balanced"), (256, 256), Contents(), ABLE)
    assert plan.is_multisampled
    assert plan.passes == 1
    assert plan.sky_each is each
    assert ("sky samples" in plan.explain()) is not each


def test_a_sky_of_one_sample_is_near_four(renderer: Renderer) -> None:
    """A bilinear picture is straight between texels, so the middle is the mean but where a texel's centre bends it: by
    an eighth of a pixel times the change of slope at most, 2 a texel here, in u and in v; and samples stand for a mean
    to as much again."""
    scene = replace(ball(width=64, fov=60), surfaces=())
    one, four = both(renderer, scene, Quality("balanced"))
    assert "sky samples" in one.stats["plan"]
    assert "sky samples" not in four.stats["plan"]
    pixel = 2 * np.tan(np.radians(30)) / SIZE[1] * 32 / np.pi
    assert np.abs(one.pixels - four.pixels).max() < 2 * 2 * pixel / 4


def test_who_does_not_multisample_has_passes() -> None:
    scene, contents = ball(), Contents()
    for quality, able, size in (
        (Quality("balanced"), Capabilities(), (64, 64)),
        (Quality("exact"), ABLE, (64, 64)),  # sixteen places are no driver's own
        (Quality("fast"), ABLE, (64, 64)),
        (Quality("balanced"), ABLE, (8192, 8192)),  # 3 GiB of samples
    ):
        plan = make_plan(scene, quality, size, contents, able)
        assert not plan.is_multisampled
        assert plan.sky_each
        assert plan.passes == plan.samples


def test_drivers_in_software_have_passes_for_small_triangles() -> None:
    """Tori, meshes, and balls that something cuts; a ball alone is one disc. GPUs have one pass for all."""
    mirror = gb.Material(metallic=1, roughness=0)
    torus, cut = gb.Surface(gb.Torus(), material=mirror), gb.Surface(gb.Cube(), material=mirror)
    plain, one = ball(), Quality("balanced")
    software = replace(ABLE, is_software=True)
    for surfaces, many in (
        (plain.surfaces, False),
        ([cut], False),
        ([torus], True),
        ([cut, torus], True),
        ([*plain.surfaces, cut], True),
    ):
        scene = replace(plain, surfaces=surfaces)
        assert make_plan(scene, one, SIZE, Contents(), software).is_multisampled is not many
        assert make_plan(scene, one, SIZE, Contents(), replace(ABLE, is_software=False)).is_multisampled
