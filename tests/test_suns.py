"""Suns: found, taken out without losing light, and shaded as discs."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import glbump as gb
from glbump.contents import Contents
from glbump.maps.cube import solid_angles
from glbump.maps.images import read_colour
from glbump.maps.layout import CUBE, LATLONG, OCTAHEDRAL, EnvironmentMap, texel_dirs
from glbump.maps.pictured import environment_of
from glbump.maps.suns import MOST_SUNS, part
from glbump.plan import make_plan
from glbump.reference.reflect import reflect_dir
from glbump.reference.sun import sun_reflected

DATA = Path(__file__).parents[2] / "shared" / "data"

TOWARDS = np.array([0.48, 0.6, -0.64])
"""A sun's direction, on no edge of any layout."""


def panorama_areas(height: int) -> Any:
    rows = -np.diff(np.cos(np.linspace(0, np.pi, height + 1))) * np.pi / height
    return np.repeat(rows[:, None], 2 * height, axis=1)[None]


def lit(dirs: Any, discs: Any, sky: float = 0.2) -> Any:
    """Even discs (direction, degrees, radiance rgb) in a sky of a gradient, so that no two texels agree."""
    pixels = np.repeat((sky * (1 + 0.3 * dirs[..., :1])).astype(np.float32), 3, axis=-1)
    for towards, degrees, radiance in discs:
        inside = dirs @ (np.asarray(towards) / np.linalg.norm(towards)) > np.cos(np.radians(degrees))
        pixels[inside] = radiance
    return pixels


def panorama(discs: Any, height: int = 256) -> EnvironmentMap:
    return EnvironmentMap(LATLONG, lit(texel_dirs(LATLONG, (2 * height, height)), discs))


def cube(discs: Any, n: int = 128) -> EnvironmentMap:
    return EnvironmentMap(CUBE, lit(texel_dirs(CUBE, (n, n)), discs))


KINDS: dict[str, Any] = {"lat-long": panorama, "cube": cube}


def total(environment: EnvironmentMap) -> Any:
    """All light of a picture, rgb, by its texels' solid angles, in float64."""
    areas = (
        panorama_areas(environment.size[1])
        if environment.layout is LATLONG
        else np.broadcast_to(solid_angles(environment.size[0]), environment.pixels.shape[:3])
    )
    return np.einsum("thw,thwc->c", areas, environment.pixels.astype(np.float64))


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(
    "towards",
    [TOWARDS, (0, 0, 1), (0, 1, 0), (1, 1, 1), (1e-3, 1e-3, -1), (0.3, -1, 1)],
    ids=["anywhere", "on the seam", "at the pole", "at a corner", "ahead", "on an edge"],
)
def test_a_disc_is_found_wherever_it_stands(kind: str, towards: Any) -> None:
    source = KINDS[kind]([(towards, 2.0, (900.0, 800.0, 700.0))])
    (sun,) = part(source).suns
    towards = np.asarray(towards) / np.linalg.norm(towards)
    # Whole texels make the disc. One is 0.7 degrees here; round the pole they are rows, whose steps do not even out.
    assert np.degrees(np.linalg.norm(sun.direction - towards)) < 0.1
    assert np.degrees(sun.radius) == pytest.approx(2.0, abs=0.12)
    assert sun.irradiance == pytest.approx(np.array([900, 800, 700]) * sun.solid_angle, rel=2e-3)


@pytest.mark.parametrize("kind", KINDS)
def test_no_light_is_lost(kind: str) -> None:
    """The rest and the suns are the picture, each channel by itself; and what no sun is stays bit for bit."""
    source = KINDS[kind]([(TOWARDS, 1.5, (3e4, 100.0, 0.1)), ((-1, 0.2, 0.3), 3.0, (50.0, 60.0, 40.0))])
    parted = part(source)
    assert len(parted.suns) == 2
    got = total(parted.rest) + np.sum([sun.irradiance for sun in parted.suns], axis=0)
    assert got == pytest.approx(total(source), rel=1e-12)  # sums of float64
    # The red sun has less blue than what is round it: that stays.
    assert parted.suns[0].irradiance[2] == 0
    changed = (parted.rest.pixels != source.pixels).any(axis=-1)
    assert 0 < changed.sum() < 500
    assert np.array_equal(changed, source.pixels[..., 0] > 1)
    assert parted.rest.pixels.max() < 0.3


def test_the_rest_has_its_surroundings_where_the_sun_was() -> None:
    source, sky = panorama([(TOWARDS, 2.0, (900.0, 900.0, 900.0))]), panorama([])
    rest = part(source).rest.pixels
    # The sky's gradient over 3 degrees: 0.06 sin(3 degrees).
    assert np.abs(rest - sky.pixels).max() < 0.004


@pytest.mark.parametrize(
    ("discs", "why"),
    [
        ([], "there is nothing"),
        ([(TOWARDS, 2.0, (8.0,) * 3)], "not BRIGHT times brighter"),
        ([(TOWARDS, 8.0, (900.0,) * 3)], "wider than WIDEST"),
        ([(TOWARDS, 0.5, (15.0,) * 3)], "brings less than LEAST"),
    ],
)
def test_what_is_no_sun_stays(discs: Any, why: str) -> None:
    source = panorama(discs)
    parted = part(source)
    assert parted.suns == (), why
    assert parted.rest is source


def test_a_window_is_not_taken_in_pieces() -> None:
    """A bright band across the sky is larger than what is looked at round one texel."""
    source = panorama([])
    source.pixels[0, 60:70, 50:300] = 500
    source.pixels[0, 65, 120] = 900
    assert part(source).suns == ()


def test_the_brightest_are_taken() -> None:
    towards = np.random.default_rng(1).normal(size=(7, 3))
    towards[np.abs(towards).max(axis=1).argmin()] = TOWARDS
    power = np.arange(1, 8) * 3000.0
    found = part(panorama([(d, 1.5, (p,) * 3) for d, p in zip(towards, power)])).suns
    assert len(found) == MOST_SUNS
    brightness = [sum(sun.irradiance) for sun in found]
    assert brightness == sorted(brightness, reverse=True)
    wanted = towards[::-1][:MOST_SUNS] / np.linalg.norm(towards[::-1][:MOST_SUNS], axis=1, keepdims=True)
    assert np.einsum("ni,ni->n", [sun.direction for sun in found], wanted).min() > 0.9999


def test_two_suns_that_touch_are_one() -> None:
    near = TOWARDS + np.array([0.0, 0.0, 0.05])
    assert len(part(panorama([(TOWARDS, 1.5, (900.0,) * 3), (near, 1.5, (900.0,) * 3)])).suns) == 1


def test_one_texel_in_the_dark() -> None:
    """As a test picture has it: black but for one texel."""
    faces = np.zeros((6, 64, 64, 3), np.float32)
    faces[4, 20, 40] = 1e5
    parted = part(EnvironmentMap(CUBE, faces))
    (sun,) = parted.suns
    assert sun.direction == pytest.approx(texel_dirs(CUBE, (64, 64))[4, 20, 40])
    assert sun.irradiance == pytest.approx((1e5 * solid_angles(64)[20, 40],) * 3)
    assert sun.solid_angle == pytest.approx(solid_angles(64)[20, 40])
    assert not parted.rest.pixels.any()


def test_other_layouts_come_back_as_cubes() -> None:
    pixels = lit(texel_dirs(OCTAHEDRAL, (256, 256)), [(TOWARDS, 2.0, (900.0,) * 3)])
    parted = part(EnvironmentMap(OCTAHEDRAL, pixels))
    assert parted.rest.layout is CUBE
    # Half a texel of the octahedron.
    assert np.degrees(np.linalg.norm(parted.suns[0].direction - TOWARDS)) < 0.4


def test_negative_light_is_no_sun() -> None:
    """Some photographs have values below 0, from sharpening."""
    source = panorama([(TOWARDS, 2.0, (-900.0,) * 3)])
    assert part(source).suns == ()


@pytest.mark.parametrize(("name", "count"), [("cc0/venice.exr", 0), ("openexr/KernerEnvLatLong.exr", 1)])
def test_photographs(name: str, count: int) -> None:
    if not (DATA / name).exists():
        pytest.skip(f"needs ../shared/data/{name} beside the repository")
    found = part(environment_of(read_colour(DATA / name), "lat-long")).suns
    assert len(found) == count
    if count:
        faces = environment_of(read_colour(DATA / "openexr" / "KernerEnvCube.exr"), "cube")
        (other,) = part(faces).suns
        # Two files of one place: half a texel of the coarser, 0.18 degrees.
        assert np.degrees(np.linalg.norm(np.subtract(found[0].direction, other.direction))) < 0.18
        assert found[0].irradiance == pytest.approx(other.irradiance, rel=2e-3)


# ------------------------------------------------------------------------------------------------ shading


def disc(towards: Any, radius: float, count: int = 3000) -> Any:
    """Directions spread evenly over a disc."""
    i = np.arange(count) + 0.5
    away, turn = radius * np.sqrt(i / count), i * np.pi * (1 + 5**0.5)
    x = np.cross(towards, [0.3, 0.9, 0.1])
    x /= np.linalg.norm(x)
    across = np.cos(turn)[:, None] * x + np.sin(turn)[:, None] * np.cross(towards, x)
    return np.cos(away)[:, None] * towards + np.sin(away)[:, None] * across


def highlight(roughness: float, degrees: float, n_dot_v: float) -> Any:
    """(2, N): the sun's light as it is shaded, and integrated over its disc, as the sun passes the mirror direction."""
    n, v, radius = np.array([0.0, 0, 1]), np.array([np.sqrt(1 - n_dot_v**2), 0, n_dot_v]), np.radians(degrees)
    reach = 6 * roughness**2 + 2 * radius
    found = []
    for ahead, aside in [(x, 0) for x in np.linspace(-1, 1, 11)] + [(0, y) for y in np.linspace(0, 1, 6)]:
        to_sun = reflect_dir(-v, n) + reach * (ahead * np.array([n_dot_v, 0, v[0]]) + aside * np.array([0, 1, 0]))
        to_sun /= np.linalg.norm(to_sun)
        if to_sun[2] < np.sin(radius):
            continue
        points = disc(to_sun, radius)
        # A radius so small that each point is one: GGX itself.
        exact = sun_reflected(n, v, points, 1e-9, roughness, np.ones(3))[:, 0].mean()
        found.append((sun_reflected(n, v, to_sun, radius, roughness, np.ones(3))[0], exact))
    return np.array(found).T


@pytest.mark.parametrize("n_dot_v", [1.0, 0.5, 0.2])
@pytest.mark.parametrize(
    ("roughness", "degrees", "most"),
    # Radii of a half, one and two alpha: the sun's own, a photographed one's, a lamp's.
    [(0.1, 0.27, 0.06), (0.13, 0.93, 0.12), (0.3, 5.0, 0.12), (0.2, 4.5, 0.2), (1.0, 5.0, 0.02)],
)
def test_a_disc_against_its_integral(roughness: float, degrees: float, most: float, n_dot_v: float) -> None:
    """Errors of the highlight's peak, as stated in lib/sun.glsl; a point in the sun's place would be off by more."""
    got, exact = highlight(roughness, degrees, n_dot_v)
    assert np.abs(got - exact).max() < most * exact.max()


def test_a_point_in_the_place_of_a_disc_is_rejected() -> None:
    n = v = np.array([0.0, 0, 1])
    radius = np.radians(4.5)
    exact = sun_reflected(n, v, disc(n, radius), 1e-9, 0.2, np.ones(3))[:, 0].mean()
    assert sun_reflected(n, v, n, radius, 0.2, np.ones(3))[0] == pytest.approx(exact, rel=0.02)
    assert sun_reflected(n, v, n, 1e-9, 0.2, np.ones(3))[0] > 1.9 * exact


def test_a_smooth_surface_shows_the_sun_itself() -> None:
    """As roughness falls, the highlight's radiance goes to the sun's own, and is never brighter, at any angle."""
    n, radius = np.array([0.0, 0, 1]), 0.01
    for n_dot_v in (1.0, 0.3, 0.01):
        v = np.array([np.sqrt(1 - n_dot_v**2), 0, n_dot_v])
        peaks = [
            sun_reflected(n, v, reflect_dir(-v, n), radius, r, np.ones(3))[0] * np.pi * radius**2
            for r in (0.3, 0.1, 0.03, 0.01)
        ]
        assert peaks == sorted(peaks)
        assert peaks[-1] <= 1
    assert peaks[-1] > 0.99


def test_suns_all_over_the_sky_are_the_albedo() -> None:
    """Many small suns are an even sky: at normal incidence GGX of roughness 1 reflects 1 - ln 2 of it, once."""
    n = np.array([0.0, 0, 1])
    count = 40_000
    z = (np.arange(count) + 0.5) / count
    turn = np.arange(count) * np.pi * (1 + 5**0.5)
    dirs = np.stack([np.sqrt(1 - z * z) * np.cos(turn), np.sqrt(1 - z * z) * np.sin(turn), z], axis=-1)
    light = sun_reflected(n, n, dirs, 1e-6, 1.0, np.ones(3))[:, 0].mean() * 2 * np.pi
    assert light == pytest.approx(1 - np.log(2), rel=1e-3)


# ------------------------------------------------------------------------------------------------ plans and pictures

SUNNY = panorama([(TOWARDS, 2.0, (900.0, 800.0, 700.0))], 64).pixels[0]
WHITE = gb.Material(roughness=0)
MIRROR = gb.Material(metallic=1, roughness=0)
SATIN = gb.Material(metallic=1, roughness=0.3, base_color=(0.9, 0.6, 0.3))
PLASTIC = gb.Material(roughness=0.25, base_color=(0.8, 0.5, 0.2))
GLASS = gb.Material(transmission=1, roughness=0.3)


def ball(material: gb.Material, **settings: Any) -> gb.Scene:
    return gb.Scene(
        [gb.Surface(gb.Sphere(), material)], gb.LatLong(SUNNY, **settings), gb.Camera(eye=(0.5, 1, 3.5), fov=40)
    )


@pytest.mark.parametrize(
    ("scene", "quality", "suns", "why"),
    [
        (ball(WHITE), gb.Quality("balanced"), "1 apart", "% of its light"),
        (ball(SATIN), gb.Quality("balanced"), "1 apart", "% of its light"),
        (ball(SATIN), gb.Quality("exact"), "kept", "nothing blurs"),
        (ball(PLASTIC), gb.Quality("exact"), "1 apart", "% of its light"),
        (ball(MIRROR), gb.Quality("balanced"), "kept", "nothing blurs"),
        (ball(WHITE), gb.Quality("balanced", suns="kept"), "kept", "as the quality asks"),
        (ball(WHITE, lookup="normal"), gb.Quality("balanced"), "kept", "by the normal"),
        (ball(WHITE, bounds=gb.SphereBounds((0, 0, 0), 9)), gb.Quality("balanced"), "kept", "room"),
        (ball(GLASS), gb.Quality("balanced"), "kept", "glass"),
        (gb.Scene([gb.Surface(gb.Sphere(), WHITE)], gb.Sky()), gb.Quality("balanced"), "kept", "computed"),
        (
            gb.Scene([gb.Surface(gb.Sphere(), WHITE)], gb.LatLong(panorama([], 32).pixels[0])),
            gb.Quality("balanced"),
            "kept",
            "no light of it is small",
        ),
    ],
)
def test_the_plan_says_what_becomes_of_suns(scene: gb.Scene, quality: gb.Quality, suns: str, why: str) -> None:
    plan = make_plan(scene, quality, (64, 64), Contents())
    (choice,) = [choice for choice in plan.choices if choice.what == "suns"]
    assert choice.value == suns
    assert why in choice.why
    assert plan.surfaces[0].has("SUNS") == plan.environments[0].suns == int(suns != "kept")


def test_a_mirror_beside_has_no_code_of_suns() -> None:
    scene = ball(WHITE)
    scene = gb.Scene([*scene.surfaces, gb.Surface(gb.Torus(), MIRROR)], scene.environment)
    assert [how.has("SUNS") for how in make_plan(scene, gb.Quality(), (64, 64), Contents()).surfaces] == [1, 0]


@pytest.fixture(scope="module")
def renderer() -> Iterator[gb.Renderer]:
    with gb.Renderer() as made:
        yield made


@pytest.mark.parametrize("suns", ["kept", "apart"])
@pytest.mark.parametrize(
    ("material", "diffuse"),
    [(WHITE, "sh9"), (WHITE, "map"), (SATIN, "sh9"), (PLASTIC, "sh9")],
    ids=["white", "white, map", "satin", "plastic"],
)
def test_drawn_as_in_float64(renderer: gb.Renderer, material: gb.Material, diffuse: str, suns: str) -> None:
    """Turned and exposed; without the background, whose edges are a matter of samples."""
    quality = gb.Quality("balanced", samples=1, diffuse=diffuse, suns=suns, gloss_chain="tree", texture_format="float")
    scene = ball(material, rotation=70, exposure=-1, background=False)
    got = np.asarray(renderer.render(scene, (48, 48), quality), np.float64)
    wanted = np.asarray(gb.reference.render(scene, (48, 48), 1, quality=quality), np.float64)
    both = (got[..., 3] == 1) & (wanted[..., 3] == 1)
    error = np.abs(got - wanted)[both][:, :3]
    # Measured: at most 3.6e-4; where a map is read between the texels that a sun sets in, 7.4e-4, of at most 5.
    assert np.median(error) < 1e-4
    assert np.quantile(error, 0.98) < (2e-3 if diffuse == "map" and suns == "kept" else 8e-4)


def test_a_mirror_shows_the_picture_itself(renderer: gb.Renderer) -> None:
    for quality in ("fast", "balanced", "exact"):
        kept, apart = (
            np.asarray(renderer.render(ball(MIRROR), (48, 48), gb.Quality(quality, suns=suns)))
            for suns in ("kept", "apart")
        )
        assert np.array_equal(kept, apart)


def test_apart_is_nearer_to_the_truth() -> None:
    """A white ball in float64: nine harmonics with its sun apart, and with it, against the sum over all texels."""
    contents, scene = Contents(), ball(WHITE, background=False)

    def picture(diffuse: str, suns: str) -> Any:
        quality = gb.Quality("exact", diffuse=diffuse, suns=suns)
        return np.asarray(gb.reference.render(scene, (32, 32), 1, quality=quality, contents=contents), np.float64)

    truth = picture(diffuse="map", suns="kept")
    apart, kept = (np.abs(picture(diffuse="sh9", suns=suns) - truth).max() for suns in ("apart", "kept"))
    assert apart < kept / 5


def test_all_light_of_a_rough_white_ball_is_there(renderer: gb.Renderer) -> None:
    """A metal that keeps nothing, rough and turned every way: the mean over many suns is that of the picture. Seen from
    all round, what a chain and a sun send back is what comes in, within what they are off by."""
    material = gb.Material(metallic=1, roughness=0.5)
    scene = gb.Scene(
        [gb.Surface(gb.Sphere(), material)],
        gb.LatLong(SUNNY, background=False),
        gb.Camera(eye=tuple(3.5 * TOWARDS), projection="orthographic", height=2),
    )
    pictures = [
        np.asarray(renderer.render(scene, (64, 64), gb.Quality("balanced", suns=suns)), np.float64)
        for suns in ("kept", "apart")
    ]
    light = [(p[..., :3] * p[..., 3:]).sum() for p in pictures]
    # The lobe of a chain is that along the normal, 10 % too wide or narrow at other angles.
    assert light[1] == pytest.approx(light[0], rel=0.1)
