"""Environments that are computed: what is where in them, that they do not sparkle, and that they cost no texture."""

from __future__ import annotations

from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from glbump import reference
from glbump.camera import Camera, pixel_rays
from glbump.contents import TABLE, Contents
from glbump.environment import Chrome, Fractal, Procedural, Sky
from glbump.gl.renderer import Renderer
from glbump.maps.layout import LATLONG, latlong_dir
from glbump.plan import Plan, make_plan
from glbump.quality import Quality
from glbump.reference import procedural
from glbump.reference.computed import radiance, table
from glbump.scene import Material, Scene, Surface
from glbump.scenefile import load_scene, save_scene
from glbump.shapes import Sphere, Torus

F64 = npt.NDArray[np.float64]
MIRROR = Material(metallic=1, roughness=0)
KINDS = (Sky(), Chrome(), Fractal())
every_kind = pytest.mark.parametrize("environment", KINDS, ids=lambda e: e.kind)


def _directions(count: int, seed: int = 1) -> F64:
    made = np.random.default_rng(seed).normal(size=(count, 3))
    return made / np.linalg.norm(made, axis=-1, keepdims=True)


def _at(elevation: float, azimuth: float = 0.0) -> F64:
    """Unit direction; degrees."""
    e, a = np.radians([elevation, azimuth])
    return np.array([np.cos(e) * np.sin(a), np.sin(e), -np.cos(e) * np.cos(a)])


# ------------------------------------------------------------------------------------------------------ the simple one


def test_up_is_blue_and_down_is_brown() -> None:
    up, down = radiance(Sky(), _at(90)), radiance(Sky(), _at(-90))
    assert up == pytest.approx(Sky().up)
    assert up[2] > 2 * up[0]
    assert down == pytest.approx(Sky().down)
    assert down[0] > 2 * down[2]


def test_colours_are_settable() -> None:
    red, green = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)
    sky = Sky(up=red, down=green)
    assert radiance(sky, _at(90)) == pytest.approx(red)
    assert radiance(sky, _at(-90)) == pytest.approx(green)
    assert radiance(sky, _at(0, 77)) == pytest.approx((0.5, 0.5, 0))


def test_the_horizon_is_soft_and_rises_one_way() -> None:
    sky = Sky(up=(1, 1, 1), down=(0, 0, 0))
    heights = np.array([radiance(sky, _at(e))[0] for e in np.linspace(-90, 90, 361)])
    assert (np.diff(heights) > 0).all()
    assert heights == pytest.approx(1 - heights[::-1])
    # As the docstring says: some 85 % at `softness` degrees.
    assert [radiance(replace(sky, softness=e), _at(e))[0] for e in (0.1, 6, 15)] == pytest.approx([0.85] * 3, abs=0.02)
    hard = replace(sky, softness=0)
    assert [radiance(hard, _at(e))[0] for e in (-0.001, 0, 0.001)] == [0, 0.5, 1]


@pytest.mark.parametrize("softness", [0, 2, 30])
def test_a_footprint_is_averaged_exactly(softness: float) -> None:
    """Over an upright footprint, against the mean of many samples of the function itself."""
    sky = Sky(up=(1, 1, 1), down=(0, 0, 0), softness=softness)
    for y, reach in ((0.0, 0.1), (0.05, 0.1), (-0.2, 0.03)):
        heights = y + reach * np.linspace(-1, 1, 20001)
        each = np.stack([np.sqrt(1 - heights**2), heights, np.zeros_like(heights)], axis=-1)
        mean = radiance(sky, each)[:, 0].mean()
        got = radiance(sky, np.array([np.sqrt(1 - y * y), y, 0]), np.array([0, 2 * reach, 0]))[0]
        assert got == pytest.approx(mean, abs=1e-4)


# ------------------------------------------------------------------------------------------------------ the medium one


def test_chrome_lies_between_its_greys_and_reaches_both() -> None:
    chrome = Chrome()
    light = radiance(chrome, _directions(20000))
    assert (light >= np.array(chrome.grey) - 1e-12).all()
    assert (light <= np.array(chrome.silver) + 1e-12).all()
    share = (light[:, 0] - chrome.grey[0]) / (chrome.silver[0] - chrome.grey[0])
    assert share.min() < 0.01
    assert share.max() > 0.99


def test_chrome_is_periodic() -> None:
    """Bands repeat along y where the other sinusoid has the same phase: along 0.3 x' = 0.5 z' it does."""
    chrome = Chrome(bands=4)
    across = np.array([0.3, 0.0, -0.5]) / np.hypot(0.3, 0.5)
    heights = np.linspace(-0.95, 0.4, 50)
    one, next_one, half = (
        radiance(chrome, np.sqrt(1 - y**2)[:, None] * across + y[:, None] * [0.0, 1.0, 0.0])
        for y in (heights, heights + 2 / chrome.bands, heights + 1 / chrome.bands)
    )
    assert one == pytest.approx(next_one, abs=1e-12)
    assert np.abs(one - half).max() > 0.5


def test_no_bands_and_no_sway_is_one_grey() -> None:
    flat = radiance(Chrome(bands=0, sway=0), _directions(100))
    assert np.ptp(flat, axis=0).max() == 0


def test_chrome_fades_as_the_mean_of_what_a_footprint_covers() -> None:
    chrome, d = Chrome(bands=12), _at(12, 30)
    right, top = np.cross(d, [0, 1, 0]), np.cross(np.cross(d, [0, 1, 0]), d)
    ddx, ddy = 0.05 * (right + top), 0.04 * (top - right)
    s, t = np.meshgrid(np.linspace(-0.5, 0.5, 201), np.linspace(-0.5, 0.5, 201))
    each = d + s[..., None] * ddx + t[..., None] * ddy
    mean = radiance(chrome, each / np.linalg.norm(each, axis=-1, keepdims=True)).mean(axis=(0, 1))
    # The phase bends a little over 0.06 rad; the function itself is 0.17 away.
    assert radiance(chrome, d, ddx, ddy) == pytest.approx(mean, abs=0.003)
    assert np.abs(radiance(chrome, d) - mean).max() > 0.15


# ------------------------------------------------------------------------------------------------------ the complex one


def test_a_landscape_is_its_seeds() -> None:
    d = np.array([_at(e, a) for e in (-20, -5, 5) for a in range(0, 360, 2)])
    first = radiance(Fractal(seed=1), d)
    assert np.array_equal(first, radiance(Fractal(seed=1), d))
    assert (np.abs(first - radiance(Fractal(seed=2), d)).max(axis=-1) > 0.02).mean() > 0.5
    assert np.isfinite(radiance(Fractal(seed=2**31 - 1), d)).all()


def test_it_is_never_brighter_than_sky_and_ground() -> None:
    """By channel: the sky is red, the ground green."""
    fractal = Fractal(sky=(3, 0, 0), haze=(2, 0, 0.5), rock=(0, 1, 0), snow=(0, 1.5, 0))
    d = _directions(6000)
    ddx = np.cross(d, _directions(6000, 2)) * 0.05
    for light in (radiance(fractal, d), radiance(fractal, d, ddx)):
        assert (light >= 0).all()
        assert (light <= np.array([3, 1.5, 0.5]) + 1e-12).all()
    top = max(max(colour) for colour in fractal.colours())
    assert Contents().peak(fractal) == top == 3


def test_sky_above_mountains_above_ground() -> None:
    fractal = Fractal(sky=(0, 0, 1), haze=(0, 0, 1), rock=(1, 0, 0), snow=(0, 1, 0))
    azimuths = np.arange(0, 360, 5)
    blue, red, green = (lambda light, i=i: light[:, i] for i in (2, 0, 1))
    high, low = (radiance(fractal, np.array([_at(e, a) for a in azimuths])) for e in (45, -30))
    assert blue(high) == pytest.approx(1)
    assert (blue(low) < 0.1).all()
    assert (green(low) == 0).all()
    skyline = radiance(fractal, np.array([_at(8, a) for a in azimuths]))
    assert 0.1 < (blue(skyline) < 1).mean() < 1
    assert green(skyline).max() > 0.1
    assert red(low).min() > 0


def test_the_ground_is_as_flat_as_it_is_told() -> None:
    """Without relief the ray meets a plane half a unit below the eye, wherever it goes down."""
    d = _directions(2000)
    light = radiance(Fractal(relief=0, rock=(1, 1, 1), haze=(0, 0, 0), sky=(0, 0, 0)), d)
    below = d[:, 1] < procedural.GROUND / procedural.FARTHEST
    away = procedural.GROUND / d[below, 1] / procedural.FARTHEST
    # In sunlight at 21 degrees and under the whole sky, behind as much air as that is away.
    sunlit = np.array([0.86, 0.80, 0.70]) * 0.36 + np.array([0.14, 0.20, 0.30])
    assert light[below] == pytest.approx((2.0**-away * (1 - away**2))[:, None] * sunlit)
    assert (light[~below] == 0).all()


@pytest.mark.parametrize("steps", [8, 31, 96])
def test_the_march_keeps_to_its_bound(monkeypatch: pytest.MonkeyPatch, steps: int) -> None:
    looks: list[int] = []
    landscape = procedural.landscape

    def counted(place: Any, *rest: Any) -> F64:
        looks.append(len(place))
        return landscape(place, *rest)

    monkeypatch.setattr(procedural, "landscape", counted)
    for footprint in (0.0, 0.01, 1.0):
        d = _directions(300)
        looks.clear()
        radiance(Fractal(steps=steps), d, np.cross(d, [0, 1, 0]) * footprint)
        assert 0 < sum(looks) <= 3 * steps * len(d)
        assert len(looks) <= 3 * steps


def test_more_steps_come_to_the_same_picture() -> None:
    # A pixel of 1 degree; thin ridges between two steps are what differs.
    d = latlong_dir(np.random.default_rng(3).random((1500, 2)) * [1, 0.2] + [0, 0.4])
    ddx, ddy = np.cross(d, [0, 1, 0]) * 0.017, np.cross(np.cross(d, [0, 1, 0]), d) * 0.017
    many, some, few = (radiance(Fractal(steps=n), d, ddx, ddy) for n in (384, 96, 8))
    assert np.abs(some - many).mean() < 0.02
    assert np.abs(few - many).mean() > 3 * np.abs(some - many).mean()


def test_derivatives_are_those_of_the_heights() -> None:
    place = np.random.default_rng(4).uniform(-12, 12, (500, 2))
    for function, arguments in ((procedural.value_noise, (7,)), (procedural.landscape, (0.05, 3.0, 7))):
        step = 1e-6
        there = function(place, *arguments)
        for axis in (0, 1):
            beside = [function(place + sign * step * np.eye(2)[axis], *arguments)[:, 0] for sign in (1, -1)]
            assert (beside[0] - beside[1]) / (2 * step) == pytest.approx(there[:, 1 + axis], abs=1e-3)


def test_what_is_finer_than_the_footprint_gives_way_to_its_mean() -> None:
    """Whatever the footprint, the ground stays where it is; and it is the mean that was measured."""
    place = np.random.default_rng(5).uniform(-30, 30, (20000, 2))
    heights = [procedural.landscape(place, width, 3.0, 3)[:, 0] for width in (0.0, 0.1, 1.0, 9.0)]
    # Of heights up to 3. A rounded crest is lower than a sharp one, and one seed's mean is its own.
    assert [h.mean() for h in heights] == pytest.approx([heights[0].mean()] * 4, abs=0.15)
    assert heights[0].std() > heights[2].std() > heights[3].std()


def test_lattice_values_are_spread_evenly_and_unlike_their_neighbours() -> None:
    x, y = np.meshgrid(np.arange(-128, 128), np.arange(-128, 128))
    values = procedural.lattice_value(np.stack([x, y], axis=-1), 5)
    count, _ = np.histogram(values, bins=16, range=(-1, 1))
    # 4096 in each of 16: a standard deviation of 62.
    assert np.abs(count - 4096).max() < 5 * 62
    beside = (values[:-1] * values[1:], values[:, :-1] * values[:, 1:], values * procedural.lattice_value(
        np.stack([x, y], axis=-1), 6))  # fmt: skip
    # The mean product of two independent values is 0, within 1/3 over the root of 65,000.
    assert max(abs(product.mean()) for product in beside) < 5 / 3 / 256


# ------------------------------------------------------------------------------------------------------ pictures


SCENES = {
    "nothing else": lambda e: Scene([], e, Camera(eye=(0, 0, 0), target=(0.2, 0.1, -1), fov=60)),
    "mirror ball": lambda e: Scene([Surface(Sphere(), MIRROR)], e),
    "turned, brighter, by the normal": lambda e: Scene(
        [Surface(Torus(), MIRROR)], replace(e, rotation=70, exposure=0.5, lookup="normal", background=False)
    ),
}


@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize(
    ("environment", "width"), [(Sky(), 96), (Chrome(), 96), (Fractal(steps=32), 32)], ids=["sky", "chrome", "fractal"]
)
def test_exact_is_the_reference(renderer: Renderer, environment: Procedural, width: int, name: str) -> None:
    scene, size = SCENES[name](environment), (width, width)
    got = renderer.render(scene, size, "exact").pixels
    want = reference.render(scene, size, 16).pixels
    error = np.abs(got - want).max(axis=-1)
    assert np.percentile(error, 99) <= 1 / 255
    # A neighbour that must be told apart: turned by a degree. A sky alone looks the same from all sides.
    if environment.kind != "sky":
        turned = replace(scene.environment, rotation=scene.environment.rotation + 1)
        other = renderer.render(replace(scene, environment=turned), size, "exact").pixels
        assert np.percentile(np.abs(other - want).max(axis=-1), 99) > 1 / 255


@pytest.mark.parametrize("quality", ["fast", "balanced"])
@every_kind
def test_footprints_are_the_references(renderer: Renderer, environment: Procedural, quality: str) -> None:
    scene = SCENES["nothing else"](environment)
    got = renderer.render(scene, (48, 48), quality).pixels
    want = reference.render(scene, (48, 48), Quality(quality).samples, quality=quality).pixels
    # Half floats of up to 1 end in steps of 1/2048; four of them are added up.
    assert np.percentile(np.abs(got - want).max(axis=-1), 99) < 4 / 2048


def test_mountains_do_not_sparkle(renderer: Renderer) -> None:
    """One sample a pixel, as the frame moves by half a pixel: hardly livelier than the mean over each pixel."""
    size, fov = 48, 60.0
    half = np.tan(np.radians(fov / 2)) / size
    views = [Camera(eye=(0, 0, 0), target=(shift, 0.12, -1), fov=fov) for shift in (0.0, half)]

    def liveliness(frames: list[F64]) -> float:
        return float((frames[1] - frames[0]).std())

    def drawn(quality: Quality) -> list[F64]:
        scenes = [Scene([], Fractal(seed=3), view) for view in views]
        return [renderer.render(scene, (size, size), quality).pixels[..., :3].astype(float) for scene in scenes]

    truth = liveliness(drawn(Quality("exact", samples=144)))
    assert liveliness(drawn(Quality("fast"))) < 1.25 * truth
    # Without footprints it sparkles.
    points = [radiance(Fractal(seed=3), pixel_rays(view, (size, size))[1]) for view in views]
    assert liveliness(points) > 2 * truth


# ------------------------------------------------------------------------------------------------------ the plan


def _plan(scene: Scene, quality: str = "balanced") -> Plan:
    return make_plan(scene, Quality(quality), (64, 64), Contents())


@every_kind
def test_nothing_of_a_picture_is_compiled_or_uploaded(renderer: Renderer, environment: Procedural) -> None:
    scene = Scene([Surface(Sphere(), MIRROR)], environment)
    for quality in ("fast", "balanced", "exact"):
        plan = renderer.plan(scene, (64, 64), quality)
        for vertex, fragment, defines in (
            ("surface.vert", "surface.frag", plan.surfaces[0].defines),
            ("sky.vert", "sky.frag", plan.environments[0].defines),
        ):
            names = set(renderer._programs.get(vertex, fragment, defines).program)
            assert not names & {"environment", "texels_per_radian", "border", "gloss", "sh"}
            assert names & set(environment.arguments())
        assert plan.environments[0].size is None
        assert "ENVIRONMENT_BORDER" not in dict(plan.environments[0].defines)
        assert "texture format" not in {c.what for c in plan.choices}
        assert f"environment         {environment.kind}: computed" in plan.explain()
    with Renderer(context=renderer.context) as fresh:
        # The ball's outline, and nothing else.
        assert fresh.render(scene, (32, 32), "fast").stats["bytes"] < 10_000


def test_levels_are_footprints_unless_the_samples_average() -> None:
    scene = Scene([], Fractal())
    footprints = [
        dict(_plan(scene, q).environments[0].defines)["ENVIRONMENT_FOOTPRINT"] for q in ("fast", "balanced", "exact")
    ]
    assert footprints == [1, 1, 0]


@every_kind
def test_rough_and_matte_surfaces_are_lit(renderer: Renderer, environment: Procedural) -> None:
    """Diffuse and glossy light come from a table of the function, made once."""
    table_of = renderer.contents.environment(environment)
    assert table_of.layout is LATLONG
    assert table_of.size == TABLE
    assert table_of is renderer.contents.environment(replace(environment, rotation=20, exposure=3))
    scene = Scene([Surface(Sphere(), Material(roughness=0.6))], environment, Camera(eye=(0, 0, 4)))
    small = Quality("exact", gloss_size=32, gloss_samples=32)
    got = renderer.render(scene, (32, 32), small).pixels[10:22, 10:22, :3]
    # All of the light is kept, so the ball is as bright as what is about it, more or less.
    around = table_of.pixels.mean(axis=(0, 1, 2))
    assert (got.mean(axis=(0, 1)) > 0.3 * around).all()
    assert (got.mean(axis=(0, 1)) < 3 * around).all()


@every_kind
def test_the_table_is_the_mean_of_the_function(environment: Procedural) -> None:
    """Each texel is the mean over its footprint, so a coarse table is a fine one averaged."""
    coarse, fine = (table(environment, size) for size in ((32, 16), (128, 64)))
    averaged = fine.reshape(16, 4, 32, 4, 3).mean(axis=(1, 3))
    # Ridges of mountains within texels of 11 degrees are what is furthest off.
    assert np.abs(coarse - averaged).mean() < 0.015
    assert coarse.mean(axis=(0, 1)) == pytest.approx(fine.mean(axis=(0, 1)), abs=0.01)


def test_a_scene_of_nothing_but_surfaces(renderer: Renderer) -> None:
    frame = renderer.render(Scene([Surface(Sphere())]), (24, 24), "fast")
    assert np.isfinite(frame.pixels).all()
    top, bottom = frame.pixels[0, 12, :3], frame.pixels[-1, 12, :3]
    assert top[2] > top[0]
    assert bottom[0] > bottom[2]


def test_seeds_of_all_31_bits_reach_the_gpu(renderer: Renderer) -> None:
    a, b = (renderer.render(Scene([], Fractal(seed=s)), (32, 32), "fast").pixels for s in (2**31 - 1, 2**31 - 2))
    assert not np.array_equal(a, b)


# ------------------------------------------------------------------------------------------------------ scene files


@pytest.mark.parametrize(
    "environment",
    [*KINDS, Sky(up=(1, 0, 0), softness=0), Chrome(bands=5, sway=-1, rotation=10), Fractal(seed=9, steps=8, relief=0)],
    ids=repr,
)
def test_round_trip(environment: Procedural, tmp_path: Path) -> None:
    scene = Scene([], environment)
    save_scene(scene, tmp_path / "scene.toml")
    assert load_scene(tmp_path / "scene.toml") == scene
    text = (tmp_path / "scene.toml").read_text(encoding="utf-8")
    assert f'kind = "{environment.kind}"' in text
    assert all(f"\n{f.name} = " not in text for f in fields(environment) if getattr(environment, f.name) == f.default)
