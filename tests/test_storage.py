"""How light is stored in textures: every format errs by what it says, and the GPU reads what was stored."""

from __future__ import annotations

import re
from itertools import product
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from glbump import reference
from glbump.contents import Contents
from glbump.environment import Captured, Chrome, CubeMap, Environment, Fractal, HemiCube, LatLong, Octahedral
from glbump.errors import LimitError
from glbump.gl import memory
from glbump.gl.context import Context
from glbump.gl.renderer import Renderer
from glbump.maps.colour import linear_from_srgb, srgb_from_linear
from glbump.maps.light_formats import DISPLAY_ERROR, LIGHT_FORMATS, LightFormat, display_error, fitting
from glbump.plan import Capabilities, EnvironmentPlan, Plan, make_plan
from glbump.plan.room import texture_bytes
from glbump.quality import Quality
from glbump.scene import Material, Scene, Surface
from glbump.shapes import Sphere

F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]
CODED = ("srgb8", "rgb10")
SIZE = (48, 48)
RANDOM = np.random.default_rng(20)
# Brighter than middle grey, as formats of codes like it.
BRIGHT = RANDOM.uniform(0.25, 1.0, (16, 32, 3)).astype(np.float32)
CUBE = RANDOM.uniform(0.25, 1.0, (6, 16, 16, 3)).astype(np.float32)
PICTURES: dict[str, Environment] = {
    "lat-long": LatLong(BRIGHT),
    "cube": CubeMap(CUBE),
    "octahedral": Octahedral(BRIGHT[:, :16]),
    "hemicube": HemiCube(RANDOM.uniform(0.25, 1.0, (48, 16, 3)).astype(np.float32), below=(0.5, 0.4, 0.3)),
}
DECODED = 0.0013
"""Most that llvmpipe's sRGB decoding, a polynomial, is off by: 0.00119 over all 256 codes, times what 1 stands for."""


def ball(environment: Environment, roughness: float = 0.0, metallic: float = 1.0) -> Scene:
    return Scene([Surface(Sphere(), Material(metallic=metallic, roughness=roughness))], environment)


def drawn(renderer: Renderer, scene: Scene, format: str, **how: Any) -> F64:
    """At level 0 of the picture as it is given, with one sample, unless told."""
    quality = Quality("exact", **{"samples": 1, "texture_format": format, **how})
    return renderer.render(scene, SIZE, quality).pixels[..., :3].astype(np.float64)


def planned(renderer: Renderer, scene: Scene, format: str, preset: str = "exact") -> tuple[EnvironmentPlan, str]:
    """Of the scene's environment, and why it is kept so."""
    plan: Plan = renderer.plan(scene, SIZE, Quality(preset, texture_format=format))
    why = next(c.why for c in plan.choices if c.what == "texture format")
    return plan.environments[0], why


# ---- formats by themselves


@pytest.mark.parametrize("exponent", [-20, 0, 7])
@pytest.mark.parametrize("how", LIGHT_FORMATS.values(), ids=lambda f: f.name)
def test_every_format_errs_by_what_it_says(how: LightFormat, exponent: int) -> None:
    values = np.concatenate([[0.0], np.geomspace(2.0**-26, 1.0, 200_000)]) * 2.0**exponent
    light = values.astype(np.float32)[:, None].repeat(3, axis=1)
    off = np.abs(how.as_read(light, exponent)[:, 0] - light[:, 0].astype(np.float64))
    most = how.error(light[:, 0].astype(np.float64) / 2.0**exponent) * 2.0**exponent
    assert np.all(off <= most * (1 + 1e-6))
    # And no format says more than it must: somewhere it is nearly as far off, at the top and in the dark.
    for part in (values > 0.5 * 2.0**exponent, values < 1e-3 * 2.0**exponent):
        assert how.name == "float" or (off[part] / most[part]).max() >= 0.85


def test_bytes_of_a_texel_are_those_that_are_stored() -> None:
    for how in LIGHT_FORMATS.values():
        assert how.stored(BRIGHT).nbytes == how.bytes * BRIGHT.size // 3


def test_a_picture_of_8_bits_is_kept_exactly() -> None:
    codes = np.arange(256, dtype=np.uint8)
    light = linear_from_srgb(codes / 255.0).astype(np.float32)[:, None].repeat(3, axis=1)
    how = LIGHT_FORMATS["srgb8"]
    np.testing.assert_array_equal(how.stored(light), codes[:, None].repeat(3, axis=1))
    np.testing.assert_array_equal(how.as_read(light), light)
    # However dark it is: no pre-exposure would leave the codes as they are.
    dark = np.tile(light[:40], (20, 1))
    fit = fitting("srgb8", dark, float(dark.max()))
    assert (fit.format.name, fit.exponent) == ("srgb8", 0)


def test_what_does_not_fit_is_raised_and_it_is_said_why() -> None:
    def fit(wanted: str, light: F32) -> tuple[str, int, str]:
        found = fitting(wanted, light, float(np.abs(light).max()))
        return found.format.name, found.exponent, found.why

    sky = np.full((16, 32, 3), 0.3, np.float32)
    sun, negative, dim = sky.copy(), sky.copy(), sky * np.float32(1e-9)
    sun[3, 4], negative[2, 2, 1] = 1e5, -0.5
    assert fit("srgb8", sky)[0] == "srgb8"
    assert fit("rgb10", negative)[::2] == ("half", "rgb10 holds no light below 0, and this goes down to -0.5")
    name, exponent, why = fit("rgb10", sun)
    assert (name, exponent) == ("half", 1)
    assert why.startswith("in rgb10, 1 % of it would be off by")
    assert "times 2^-1" in why
    # Nine stops lie between its darkest and its brightest: 10 linear bits do not hold that.
    assert fit("rgb10", (sky * np.geomspace(0.002, 1, 32)[:, None]).astype(np.float32))[0] == "half"
    assert fit("half", dim)[:2] == ("half", -32)
    sun[3, 4] = 1e11
    name, _, why = fit("half", sun)
    assert name == "float"
    assert why.startswith("in half, 1 % of it would be off by")
    assert fit("half", np.zeros_like(sky))[:2] == ("half", 0)
    assert fit("float", sun)[0] == "float"


# ---- on the GPU


@pytest.mark.parametrize("format", LIGHT_FORMATS)
@pytest.mark.parametrize("layout", PICTURES)
def test_the_gpu_reads_what_was_stored(renderer: Renderer, layout: str, format: str) -> None:
    """As the reference does of the same format; and of none other."""
    scene = ball(PICTURES[layout])
    got = drawn(renderer, scene, format)
    want, exact = (
        reference.render(scene, SIZE, 1, quality=Quality("exact", texture_format=f)).pixels[..., :3]
        for f in (format, "float")
    )
    # Edges aside, where one sample falls on the other side.
    assert np.percentile(np.abs(got - want), 99) <= (DECODED if format == "srgb8" else 2e-5)
    if format in CODED:
        off = np.abs(want - exact).max()
        how = LIGHT_FORMATS[format]
        assert 0.5 * how.error(np.ones(1)) < off <= how.error(np.ones(1))
        if format == "rgb10":  # whose steps are larger than the driver's errors
            assert np.percentile(np.abs(got - exact), 99) > 2e-4


@pytest.mark.parametrize("format", LIGHT_FORMATS)
@pytest.mark.parametrize("how", ["nearest-level", "trilinear"])
@pytest.mark.parametrize("preset", ["fast", "balanced"])
def test_levels_and_resampled_cubes_in_every_format(renderer: Renderer, preset: str, how: str, format: str) -> None:
    """Against floats: what the format costs, and a share of halves' own error where a cube was drawn in them."""
    scene = ball(PICTURES["lat-long"])
    got, want = (
        renderer.render(
            scene, SIZE, Quality(preset, samples=1, environment_filter=how, texture_format=f, frame_format="float")
        )
        for f in (format, "float")
    )
    most = {"srgb8": 0.5 * 0.0089 + DECODED, "rgb10": 0.5 / 1023, "half": 2.0**-11, "float": 0.0}[format]
    assert np.abs(got.pixels - want.pixels).max() <= most + 2.0**-11 * (preset == "fast") + 1e-6


@pytest.mark.parametrize("format", LIGHT_FORMATS)
@pytest.mark.parametrize("scale", [1.0, 300.0, 2.0**-20])
def test_pre_exposure_is_taken_back_everywhere(renderer: Renderer, scale: float, format: str) -> None:
    """Behind, mirrored, rough, diffuse, below the horizon: as many times brighter as the picture is."""
    picture = PICTURES["hemicube"]
    assert isinstance(picture, HemiCube)
    assert not isinstance(picture.below, str)
    scaled = HemiCube(
        np.asarray(picture.image.pixels) * np.float32(scale),  # type: ignore[union-attr]
        below=tuple(scale * v for v in picture.below),  # type: ignore[arg-type]
        exposure=1.0,
    )
    plan, _ = planned(renderer, ball(scaled), format)
    how = LIGHT_FORMATS[format]
    assert plan.pre_exposure == (
        0 if scale == 1 or (format == "half" and scale > 1) or format == "float" else plan.pre_exposure
    )
    assert dict(plan.defines)["EXPOSURE"] == 1
    for roughness, metallic in ((0.0, 1.0), (0.0, 0.0), (0.5, 0.3)):
        chain = {"gloss": "chain", "gloss_chain": "tree", "gloss_size": 16, "gloss_samples": 8}
        got = drawn(renderer, ball(scaled, roughness, metallic), format, **chain) / scale
        want = drawn(renderer, ball(picture, roughness, metallic), "float", **chain) * 2
        most = 2 * (4 * float(how.error(np.ones(1))[0]) + (DECODED if format == "srgb8" else 0)) + 1e-5
        assert np.abs(got - want).max() <= most


def test_no_exposure_no_code_of_it(renderer: Renderer) -> None:
    for value, exposure, code in ((1.0, 0, 0), (1e5, 0, 1), (1.0, 1, 1), (1e5, -1, 0)):
        plan, _ = planned(renderer, ball(LatLong(BRIGHT * np.float32(value), exposure=exposure)), "half")
        assert (plan.pre_exposure, dict(plan.defines)["EXPOSURE"]) == (int(value > 1), code)


@pytest.mark.parametrize("preset", ["fast", "balanced"])
def test_a_sun_of_1e5_is_neither_infinite_nor_black(renderer: Renderer, preset: str) -> None:
    picture = np.full((64, 128, 3), 0.1, np.float32)
    picture[30:34, 62:66] = 1e5  # straight ahead
    frame = renderer.render(Scene([], LatLong(picture)), (128, 128), preset)
    assert np.isfinite(frame.pixels).all()
    # The 11 bits of a half, at either end.
    assert frame.pixels.max() == pytest.approx(1e5, rel=2.0**-11)
    assert frame.pixels[..., :3].min() == pytest.approx(0.1, rel=2.0**-11)
    assert frame.stats["plan"]["texture format"] == "half"


@pytest.mark.parametrize("format", CODED)
def test_the_plan_names_the_error_that_is_measured(renderer: Renderer, format: str) -> None:
    scene = Scene([], LatLong(BRIGHT))
    _, why = planned(renderer, scene, format)
    told = float(re.search(r"99 % by ([\d.e-]+) of 255", why).group(1))  # type: ignore[union-attr]
    gain = 0.18 / float(np.median(BRIGHT))
    got, want = (drawn(renderer, scene, f) for f in (format, "float"))
    off = 255 * np.abs(srgb_from_linear(got * gain) - srgb_from_linear(want * gain))
    # Between texels errors average, and a driver's own come on top of 8 bits.
    assert 0.3 * told <= np.percentile(off, 99) <= 1.1 * told + 255 * 1.2 * DECODED * gain * (format == "srgb8")
    assert told <= DISPLAY_ERROR
    assert told == pytest.approx(display_error(LIGHT_FORMATS[format], BRIGHT, 0), rel=0.02)
    assert not 0.3 * told <= np.percentile(255 * np.abs(got - got), 99)


def test_formulas_and_captures_have_no_pre_exposure(renderer: Renderer) -> None:
    """What is computed, or drawn, is not divided, and its exposure is the same as its roughness chain's."""
    for environment, wanted, name in (
        (Chrome(), "srgb8", "srgb8"),
        (Chrome(silver=(3.0, 3.0, 3.0)), "srgb8", "half"),
        (Fractal(), "float", "float"),
    ):
        plan, why = planned(renderer, ball(environment, 0.5), wanted)
        assert (plan.texture_format, plan.pre_exposure) == (name, 0), why
    scene = Scene([Surface(Sphere(), environment=Captured(size=8))], LatLong(BRIGHT))
    captured = renderer.plan(scene, SIZE, Quality("fast", texture_format="srgb8")).environments[1]
    assert (captured.texture_format, captured.pre_exposure) == ("half", 0)


def test_half_formats_that_need_no_care_are_not_measured(monkeypatch: pytest.MonkeyPatch) -> None:
    """A first picture pays for nothing that its format does not ask for."""

    def never(*_: object) -> float:
        raise AssertionError("measured")

    monkeypatch.setattr("glbump.maps.light_formats.display_error", never)
    assert Contents().light_format(LatLong(BRIGHT), "half").exponent == 0
    with pytest.raises(AssertionError, match="measured"):
        Contents().light_format(LatLong(BRIGHT), "srgb8")


# ---- room


def test_the_bytes_are_said_and_are_those_that_are_kept(context: Context) -> None:
    for preset, format, name, levels in product(
        ("fast", "exact"), LIGHT_FORMATS, ("lat-long", "cube", "octahedral"), ("bilinear", "trilinear")
    ):
        quality = Quality(preset, texture_format=format, environment_filter=levels)
        with Renderer(context=context) as fresh:
            plan = fresh.plan(Scene([], PICTURES[name]), SIZE, quality).environments[0]
            told = texture_bytes(plan, fresh.contents)
            fresh.render(Scene([], PICTURES[name]), SIZE, quality)
            kept = fresh._store.bytes
        # Borders of tiles are much of a picture as small as this; the smallest levels are rounded.
        most = 2.0 if preset == "exact" and name == "octahedral" else 1.01
        assert 0.99 * told <= kept <= most * told, (preset, format, name, levels)


@pytest.mark.parametrize(
    ("able", "words"),
    [
        (Capabilities(texture_memory=8_000), r"32x16 pixels, and its textures take 0\.00781 MiB, .* to 16x8, or"),
        (Capabilities(memory=20_000), r"making its textures take 0\.0195 MiB, of which 0\.0191 MiB are free; .*16x8"),
        (Capabilities(memory=28_000, is_software=True), r"making its textures take 0\.0273 MiB"),
    ],
)
def test_what_there_is_no_room_for_is_refused_and_what_fits_is_offered(able: Capabilities, words: str) -> None:
    scene, quality = Scene([], LatLong(BRIGHT)), Quality("balanced", texture_format="float")
    with pytest.raises(LimitError, match=words):
        make_plan(scene, quality, SIZE, Contents(), able)
    # What it offers does fit.
    make_plan(Scene([], LatLong(BRIGHT[::2, ::2])), quality, SIZE, Contents(), able)


def test_the_largest_pictures_say_their_bytes_before_anything_is_made() -> None:
    """A captured cube of 16384: four halves a texel, with levels."""
    captured = Scene([Surface(Sphere(), environment=Captured(size=16384))], LatLong(BRIGHT))
    with pytest.raises(LimitError, match=r"16384x16384 pixels, and its textures take 16 GiB, of which 4 GiB are free"):
        make_plan(captured, Quality("balanced"), SIZE, Contents(), Capabilities(texture_memory=2**32))


@pytest.mark.parametrize("format", LIGHT_FORMATS)
@pytest.mark.parametrize("preset", ["fast", "balanced", "exact"])
def test_one_texel_in_every_format(renderer: Renderer, preset: str, format: str) -> None:
    for environment in (LatLong(BRIGHT[:1, :2]), LatLong(BRIGHT[:1, :1]), CubeMap(CUBE[:, :1, :1])):
        pixels = renderer.render(ball(environment), (16, 16), Quality(preset, texture_format=format)).pixels
        assert np.isfinite(pixels).all()
        assert pixels.min() >= 0.2
        assert pixels.max() <= 1.0 + DECODED


def test_memory_is_what_the_machine_has(context: Context) -> None:
    free = memory.host_bytes()
    assert free is None or 2**20 < free < 2**50
    assert memory.texture_bytes(context) is None or not context.is_software
