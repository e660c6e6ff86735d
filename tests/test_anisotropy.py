"""Footprints that are longer than wide: several look-ups along them come near to the elliptical average."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt
import pytest

import glbump as gb
from glbump import reference
from glbump.contents import Contents
from glbump.gl import probe
from glbump.gl.context import Context
from glbump.gl.renderer import Renderer
from glbump.glsltest import inputs
from glbump.maps import patterns
from glbump.maps.heights import slopes
from glbump.maps.layout import CUBE, texel_dirs
from glbump.plan import Capabilities, make_plan
from glbump.reference.ewa import elliptical_average
from glbump.reference.filter import footprint_axes, footprint_taps
from glbump.reference.reflect import reflect_dir
from glbump.reference.surroundings import Surroundings
from glbump.reference.varied import Varied

F64 = npt.NDArray[np.float64]
RNG = np.random.default_rng(9)
NOISE = RNG.random((64, 128, 3)).astype(np.float32)
PANORAMA = gb.LatLong(NOISE)
MIRROR = gb.Material(metallic=1, roughness=0)
TORUS = gb.Scene([gb.Surface(gb.Torus(), MIRROR, transform=gb.Transform(rotate=(40, 10, 0)))], PANORAMA)


def footprints(count: int, thin: float) -> tuple[F64, F64, F64]:
    """Directions off the poles, and sides 0.15 to 0.6 radians long and `thin` of that wide, sheared."""
    d = inputs.unit_vectors(4 * count, 1).astype(float)
    d = d[np.abs(d[:, 1]) < 0.7][:count]
    d /= np.linalg.norm(d, axis=-1, keepdims=True)
    across = np.cross(d, inputs.unit_vectors(len(d), 2))
    across /= np.linalg.norm(across, axis=-1, keepdims=True)
    size = RNG.uniform(0.15, 0.6, (len(d), 1))
    x, y = across * size, np.cross(d, across) * size * thin
    return d, x + 0.7 * y, y - 0.2 * x * thin


def looked_up(d: F64, x: F64, y: F64, **knobs: object) -> F64:
    quality = gb.Quality("balanced", samples=1, texture_format="float", **knobs)  # type: ignore[arg-type]
    return Surroundings(PANORAMA, quality, Contents(), 1).light(Varied(d, x, y))


def test_the_average_of_a_round_footprint_is_that_of_its_disc() -> None:
    """Of y: the direction's own, to the second order of the width."""
    heights = np.cos((np.arange(64) + 0.5) / 64 * np.pi)[:, None, None].repeat(128, axis=1)
    d, x, y = footprints(30, 1.0)
    got = elliptical_average(heights, d, 0.3 * x, 0.3 * y)[:, 0]
    assert got == pytest.approx(d[:, 1], abs=0.01)
    assert elliptical_average(np.ones((64, 128, 2)), d, x, y) == pytest.approx(1.0)


@pytest.mark.parametrize("thin", [0.1, 0.25])
def test_look_ups_along_it_come_nearer_to_the_elliptical_average(thin: float) -> None:
    d, x, y = footprints(150, thin)
    truth = elliptical_average(NOISE, d, x, y)
    error = {n: float(np.sqrt(((looked_up(d, x, y, anisotropy=n) - truth) ** 2).mean())) for n in (1, 2, 4, 8)}
    # Of noise with a deviation of 0.29; what is left is the levels' own shape, a box and a tent for a Gaussian.
    assert error[4] < 0.7 * error[1]
    assert error[8] < 1.1 * error[4]
    # Across it blurs what lies beside, by its longer side.
    longest = looked_up(d, x, y, environment_level="longest")
    assert error[4] < float(np.sqrt(((longest - truth) ** 2).mean()))


def test_round_footprints_and_magnified_ones_take_one() -> None:
    d, x, y = footprints(50, 1.0)
    axes = footprint_axes(x - 0.7 * y, y)
    assert (footprint_taps(*axes, 20.0, 16) <= 2).all()
    assert (footprint_taps(np.array([[1e-3, 0, 0]]), np.array([[0, 1e-6, 0]]), 20.0, 16) == 1).all()
    assert footprint_taps(np.array([[0.5, 0, 0]]), np.array([[0, 0.1, 0]]), 20.0, 16) == 5
    assert footprint_taps(np.array([[0.5, 0, 0]]), np.array([[0, 0.0, 0]]), 20.0, 4) == 4
    one, many = (looked_up(d, 1e-4 * x, 1e-4 * y, anisotropy=n) for n in (1, 8))
    assert many == pytest.approx(one, abs=1e-12)


def test_axes_keep_what_a_footprint_covers() -> None:
    _, x, y = footprints(200, 0.2)
    major, minor = footprint_axes(x, y)
    assert np.einsum("ki,ki->k", major, minor) == pytest.approx(0, abs=1e-15)
    assert (np.linalg.norm(major, axis=-1) >= np.linalg.norm(minor, axis=-1)).all()
    # The same ellipse: the sum of the sides' products with themselves.
    before, after = (
        np.einsum("ki,kj->kij", *2 * (a,)) + np.einsum("ki,kj->kij", *2 * (b,)) for a, b in ((x, y), (major, minor))
    )
    assert after == pytest.approx(before, abs=1e-15)


@pytest.mark.parametrize("layout", ["given", "cube", "octahedral"])
def test_the_gpu_does_as_the_reference(renderer: Renderer, layout: str) -> None:
    quality = gb.Quality("balanced", samples=1, anisotropy=4, environment_layout=layout)
    got = renderer.render(TORUS, (96, 96), quality).pixels
    if layout == "given":
        want = reference.render(TORUS, (96, 96), 1, quality=quality).pixels
        # In halves; outlines apart, where one of both sees the sky.
        assert np.percentile(np.abs(got - want), 97) < 3e-3
        assert (
            np.percentile(np.abs(renderer.render(TORUS, (96, 96), gb.Quality("balanced", samples=1)).pixels - want), 97)
            > 0.02
        )
    reads = renderer.render(TORUS, (96, 96), quality, show="cost").pixels[..., 0]
    each = 2 if layout == "octahedral" else 1
    assert set(np.unique(reads)) == {1 * each, 2 * each, 3 * each, 4 * each}


def test_pictures_come_nearer_to_the_truth(renderer: Renderer) -> None:
    truth = renderer.render(TORUS, (96, 96), gb.Quality("exact", samples=256)).pixels

    def error(**knobs: int) -> float:
        quality = gb.Quality("balanced", samples=1, **knobs)  # type: ignore[arg-type]
        return float(np.sqrt(((renderer.render(TORUS, (96, 96), quality).pixels - truth) ** 2).mean()))

    assert error(anisotropy=8) < 0.8 * error(anisotropy=1)


# ---- bumps

DENTS = patterns.dimples((32, 32), wobble=0.5)
TILTS = np.random.default_rng(4).normal(size=(32, 32, 3)).astype(np.float32) * (0.2, 0.2, 0) + (0, 0, 1)
LIGHT = gb.CubeMap(np.random.default_rng(3).uniform(0.2, 1, (6, 16, 16, 3)).astype(np.float32), background=False)
FLOOR = gb.Plane(size=(4, 4))
BUMPED: dict[str, tuple[gb.Shape, gb.Bump | gb.NormalMap, dict[str, str]]] = {
    "plane": (FLOOR, gb.Bump(DENTS, amplitude=0.02, repeat=(16, 16)), {}),
    "once": (FLOOR, gb.Bump(DENTS, amplitude=0.1, border="clamp"), {}),
    "codes": (FLOOR, gb.NormalMap(TILTS, repeat=(16, 16)), {"bump_format": "rg16"}),
    "triplanar": (gb.Cube(), gb.Bump(DENTS, amplitude=0.004, repeat=(8, 8), mapping="triplanar"), {}),
    "screen": (FLOOR, gb.Bump(DENTS, amplitude=0.02, repeat=(16, 16)), {"bump_read": "screen"}),
}


@pytest.mark.parametrize("spread", ["none", "toksvig", "lean"])
@pytest.mark.parametrize("kind", BUMPED)
def test_bumps_on_the_gpu_are_the_references(renderer: Renderer, kind: str, spread: str) -> None:
    shape, bump, knobs = BUMPED[kind]
    scene = gb.Scene([gb.Surface(shape, MIRROR, bump)], LIGHT, gb.Camera(eye=(0, 1.2, 5), target=(0, 0, 0), fov=40))
    floats = {"texture_format": "float", "bump_format": "float", "frame_format": "float"} | knobs
    quality = gb.Quality("balanced", samples=1, anisotropy=4, bump_spread=spread, **floats)  # type: ignore[arg-type]
    drawn, modelled = renderer.render(scene, (32, 32), quality), reference.render(scene, (32, 32), 1, quality=quality)
    both = (drawn.pixels[..., 3] > 0.99) & (modelled.pixels[..., 3] > 0.99)

    def off(other: gb.Frame) -> float:
        # Beside edges, and where a count of look-ups is next to a whole number, both may take another.
        return float(np.percentile(np.abs(other.pixels - modelled.pixels)[both][:, :3].max(axis=-1), 75))

    assert off(drawn) < 3e-4
    # One look-up for all of the footprint, as wide as long.
    assert off(reference.render(scene, (32, 32), 1, quality=replace(quality, anisotropy=1))) > 0.001


GROOVES = np.tile(0.5 + 0.5 * np.sin(2 * np.pi * np.arange(16) / 16), (16, 1)).astype(np.float32)


def test_the_spread_of_look_ups_and_between_them_is_that_of_all_bumps(renderer: Renderer) -> None:
    """Of grooves across footprints, 2.5 of them along each and a quarter of one wide: the mean square of what is
    mirrored aside is the mean's square and the spread, whoever sees how much of it."""
    aside = np.repeat((texel_dirs(CUBE, (64, 64))[..., :1] ** 2).astype(np.float32), 3, axis=-1)
    quad = gb.Quad(corners=((-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)))
    bump = gb.Bump(GROOVES, amplitude=1.5e-3, repeat=(20, 2))
    slope = slopes(GROOVES, "central", "wrap")[0, :, 0].astype(float) * 1.5e-3 * 20 / 2
    n = np.stack([-slope, 0 * slope, np.ones_like(slope)], axis=-1) / np.hypot(1, slope)[:, None]
    ways = [("none", 16), ("lean", 1), ("lean", 4), ("lean", 16)]
    gained: dict[tuple[str, int], list[float]] = {way: [] for way in ways}
    # As a level's texel is averaged over more at its corners than in its middle, eight places of the environment.
    for x, y in np.random.default_rng(0).uniform(-0.3, 0.3, (8, 2)):
        eye = np.array([x, y, 1]) / np.linalg.norm([x, y, 1])
        camera = gb.Camera(eye=tuple(4 * eye), target=(0, 0, 0), projection="orthographic", height=1)
        surface = gb.Surface(quad, MIRROR, bump)
        scene = gb.Scene([surface], gb.CubeMap(aside, background=False), camera)

        def seen(scene: gb.Scene, **knobs: object) -> float:
            quality = gb.Quality("balanced", samples=1, **knobs)  # type: ignore[arg-type]
            return float(renderer.render(scene, (4, 4), quality).pixels[..., 0].mean())

        flat = seen(replace(scene, surfaces=(replace(surface, bump=None),)))
        want = float((reflect_dir(-eye, n)[:, 0] ** 2).mean()) - x**2 / (x**2 + y**2 + 1)
        for how, taps in ways:
            gained[how, taps].append((seen(scene, bump_spread=how, anisotropy=taps) - flat) / want)
    means = {way: float(np.mean(shares)) for way, shares in gained.items()}
    # A long blur of three look-ups loses a fifteenth. And what the tent between texels takes away beside their boxes no
    # moments have: next to nothing of fine look-ups, a fifth where texels are a third of a groove.
    assert means["lean", 1] == pytest.approx(0.93, abs=0.05)
    assert means["lean", 16] == pytest.approx(means["lean", 1], rel=0.1)
    assert means["lean", 4] == pytest.approx(means["lean", 1], rel=0.25)
    # Ten look-ups each see less than a tenth of it themselves, and their mean nothing.
    assert means["none", 16] < 0.05


def test_alike_slopes_have_no_spread_however_steep(renderer: Renderer) -> None:
    """About the mean: of squares less the mean's square 1e-3 would be left in 32 bits, and 0.06 radians of blur."""
    steep = np.broadcast_to(np.array([1, 0, 0.01], np.float32), (8, 8, 3))
    bump = gb.NormalMap(steep, repeat=(4000, 4000))
    scene = gb.Scene([gb.Surface(FLOOR, MIRROR, bump)], LIGHT, gb.Camera(eye=(0, 0.3, 5), target=(0, 0, 0), fov=40))
    pictures = [
        renderer.render(
            scene, (32, 32), gb.Quality("balanced", samples=1, anisotropy=16, bump_spread=how, bump_format="float")
        ).pixels
        for how in ("none", "lean")
    ]
    assert np.abs(pictures[0] - pictures[1]).max() < 1e-3


def test_a_plane_that_recedes_comes_nearer_to_the_truth(renderer: Renderer) -> None:
    """Dents next to the size of pixels, which a footprint as wide as long would average across their rims."""
    bump = gb.Bump(patterns.dimples((64, 64)), amplitude=0.01, repeat=(12, 12))
    camera = gb.Camera(eye=(0, 0.6, 0), target=(0, 0, -2), fov=40)
    scene = gb.Scene([gb.Surface(gb.Plane(size=(20, 20)), MIRROR, bump)], LIGHT, camera)
    truth = renderer.render(scene, (32, 32), gb.Quality("exact", samples=256)).pixels
    inside = truth[..., 3] > 0.999

    def error(anisotropy: int) -> float:
        quality = gb.Quality("balanced", samples=1, anisotropy=anisotropy)
        return float(np.sqrt(((renderer.render(scene, (32, 32), quality).pixels - truth)[inside] ** 2).mean()))

    assert error(4) < 0.85 * error(1)


# ---- by the texture unit


def forced(renderer: Renderer, scene: gb.Scene, quality: gb.Quality, *, honoured: bool) -> gb.Frame:
    """Of a driver that honours the limit of anisotropy, or does not."""
    before = renderer.capabilities
    renderer.capabilities = replace(before, honours_anisotropy=lambda: honoured)
    try:
        # The renderer keeps what it prepared for a scene: a new scene has none.
        return renderer.render(replace(scene), (64, 64), quality)
    finally:
        renderer.capabilities = before


FROM_ABOVE = gb.Camera(eye=(0, 1.2, 4), target=(0, 0, 0), fov=40)
SMOOTH = gb.LatLong(patterns.fbm((64, 128))[..., None].repeat(3, axis=-1))
BY_UNIT: dict[str, tuple[gb.Scene, str]] = {
    "panorama": (replace(TORUS, environment=SMOOTH), "given"),
    "cube": (replace(TORUS, environment=SMOOTH), "cube"),
    "bumps": (gb.Scene([gb.Surface(FLOOR, MIRROR, BUMPED["plane"][1])], LIGHT, FROM_ABOVE), "given"),
    "codes": (gb.Scene([gb.Surface(FLOOR, MIRROR, BUMPED["codes"][1])], LIGHT, FROM_ABOVE), "given"),
}


@pytest.mark.parametrize("kind", BY_UNIT)
def test_the_texture_units_own_look_ups_are_like_ours(renderer: Renderer, kind: str) -> None:
    """As far as llvmpipe shows it: under any limit it takes sixteen along how the place changes from pixel to pixel,
    whatever footprint it is given. Of three quarters of the pixels that is about the same."""
    scene, layout = BY_UNIT[kind]
    quality = gb.Quality("balanced", samples=1, anisotropy=16, bump_spread="none", environment_layout=layout)
    unit, ours = (forced(renderer, scene, quality, honoured=honoured) for honoured in (True, False))
    assert "texture unit's own" in unit.stats["explain"]
    assert "texture unit's own" not in ours.stats["explain"]
    finest = replace(quality, environment_filter="bilinear", bump_filter="bilinear")
    covered = forced(
        renderer, replace(scene, environment=replace(scene.environment, background=False)), finest, honoured=True
    )

    def apart(other: gb.Frame) -> float:
        off = np.abs(other.pixels - ours.pixels)[covered.pixels[..., 3] > 0.5]
        return float(np.percentile(off[:, :3].max(axis=-1), 75))

    assert 0 < apart(unit) < 0.1
    # Not level 0, which is neither's.
    assert apart(unit) < 0.75 * apart(forced(renderer, scene, finest, honoured=True))


def test_this_driver_looks_up_as_it_likes(renderer: Renderer) -> None:
    if not renderer.context.is_software:
        pytest.skip("of Mesa's llvmpipe and softpipe")
    assert not renderer.context.honours_anisotropy
    quality = gb.Quality("balanced", anisotropy=4, bump_spread="none")
    assert "texture unit's own" not in renderer.render(TORUS, (16, 16), quality).stats["explain"]


@pytest.mark.parametrize(("changes", "bumps"), [({"bump_spread": "lean"}, False), ({"bump_spread": "none"}, True)])
def test_what_texture_units_average_has_no_spread(changes: dict[str, str], bumps: bool) -> None:
    bumped = gb.Surface(FLOOR, MIRROR, BUMPED["plane"][1])
    quality = gb.Quality("balanced", anisotropy=4, **changes)  # type: ignore[arg-type]
    able = Capabilities(honours_anisotropy=lambda: True)
    plan = make_plan(gb.Scene([bumped], PANORAMA), quality, (64, 64), Contents(), able)
    defines = dict(plan.surfaces[0].defines)
    assert (defines["ENVIRONMENT_GRADIENTS"], defines["ANISOTROPY"]) == (4, 1)
    assert (defines["BUMP_GRADIENTS"], defines["BUMP_TAPS"]) == ((4, 1) if bumps else (0, 4))


def test_drivers_are_asked_where_a_plan_needs_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """Once a context, and not by pictures that have one look-up."""
    asked = []

    def told(context: Context) -> dict[str, bool]:
        asked.append(context)
        return {"honoured": True}

    monkeypatch.setattr(probe, "anisotropy", told)
    with Renderer() as fresh:
        fresh.render(TORUS, (16, 16), "balanced")
        fresh.render(TORUS, (16, 16), gb.Quality("balanced", anisotropy=4), show="level")
        assert asked == []
        for samples in (1, 4):
            fresh.render(TORUS, (16, 16), gb.Quality("balanced", samples=samples, anisotropy=4))
        assert asked == [fresh.context]


def test_asking_leaves_the_picture_alone() -> None:
    quality = gb.Quality("balanced", samples=1, anisotropy=4)
    pictures = []
    for order in ((quality,), ("balanced", quality)):
        with Renderer() as fresh:
            for how in order:
                frame = fresh.render(TORUS, (32, 32), how)
            pictures.append(frame.pixels)
            assert fresh.context.honours_anisotropy is probe.anisotropy(fresh.context)["honoured"]
    assert np.array_equal(pictures[0], pictures[1])
