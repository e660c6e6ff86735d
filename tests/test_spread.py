"""Bumps too fine to be seen one by one: what levels keep of them, and what mirrors and rough surfaces make of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from glbump import reference, relief
from glbump.camera import Camera
from glbump.contents import Contents
from glbump.environment import CubeMap, Sky
from glbump.gl.renderer import Renderer
from glbump.glsltest import Glsl, inputs
from glbump.maps import patterns
from glbump.maps.heights import slopes
from glbump.maps.layout import CUBE, texel_dirs
from glbump.maps.moments import FLAT, flats, lean_levels, toksvig_levels
from glbump.plan import make_plan
from glbump.quality import Quality
from glbump.reference import spread
from glbump.reference.computed import radiance
from glbump.reference.direction import axes_across
from glbump.reference.reflect import reflect_dir
from glbump.scene import Bump, Material, NormalMap, Scene, Surface
from glbump.shapes import Cube, Plane, Quad, Shape, Sphere, Torus, Transform

F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]
CHROME = Material(metallic=1, roughness=0)
SPREADS = ("toksvig", "lean")


@pytest.fixture(scope="module")
def waves() -> F32:
    return patterns.waves((64, 64))


# ---- what levels leave out


def test_the_last_level_has_the_moments_of_all_slopes(waves: F32) -> None:
    s = slopes(waves, "central", "wrap").reshape(-1, 2).astype(float)
    uu, uv, vv = lean_levels(slopes(waves, "central", "wrap"), 3.0)[-1].ravel()
    # float32 slopes, and moments rounded once.
    assert np.array([[uu, uv], [uv, vv]]) * 9 == pytest.approx(np.cov(s.T, bias=True), rel=1e-5, abs=1e-5 * s.var())


def test_one_variance_is_the_mean_of_both_or_toksvigs() -> None:
    tilt = 0.3
    two = np.zeros((2, 2, 2), np.float32)
    two[:, 0, 0], two[:, 1, 0] = tilt, -tilt
    gentle = toksvig_levels(two, 1.0, are_lengths=False)[-1].item()
    assert gentle == pytest.approx(tilt**2 / 2, rel=1e-6)
    # Normals 2 atan(tilt) apart: their mean is the cosine of half of that long.
    length = 1 / np.hypot(1, tilt)
    steep = toksvig_levels(two, 1.0, are_lengths=True)[-1].item()
    assert steep == pytest.approx((1 - length) / length, rel=1e-6)
    assert steep < gentle


def test_a_map_of_one_texel_has_no_spread() -> None:
    one = np.ones((1, 1, 2), np.float32)
    assert [level.shape for level in lean_levels(one, 1.0)] == [(1, 1, 3)]
    assert toksvig_levels(one, 1.0, are_lengths=True)[0].item() == 0


def test_flat_places_are_told_from_steep_ones(waves: F32) -> None:
    s = np.zeros((8, 8, 2), np.float32)
    s[2:4, :, 0], s[6, 6] = 1, (0.02, -0.01)
    apart = flats(s)
    # 16 texels of 1: 0.5 rms, of which a tenth is more than 0.0224.
    assert apart.share == 48 / 64
    assert apart.moments == pytest.approx(np.array([4e-4, -2e-4, 1e-4]) / 48, rel=1e-6)
    assert [level.shape for level in lean_levels(s, 1.0, apart)] == [(4, 4, 4), (2, 2, 4), (1, 1, 4)]
    # Rounded once.
    assert lean_levels(s, 1.0, apart)[-1][0, 0, 3] == pytest.approx(16 / 64, abs=1e-7)
    # Of Gaussian slopes 1 - exp(-FLAT^2) are as flat, twice as many of these at most.
    assert flats(slopes(waves, "central", "wrap")).share < 2 * FLAT**2
    assert flats(np.ones((4, 4, 2), np.float32)).moments.tolist() == [0, 0, 0]


# ---- how directions spread


def _across(n: F64, v: F64) -> F64:
    result: F64 = v - n * np.einsum("ki,ki->k", n, v)[:, None]
    return result


def _covariance(*vectors: F64) -> F64:
    """(K, 3, 3): the sum of w w^T of vectors (K, 3)."""
    return sum((w[:, :, None] * w[:, None, :] for w in vectors), np.zeros((len(vectors[0]), 3, 3)))


def _units(seed: int, count: int = 500) -> F64:
    n = inputs.unit_vectors(count, seed).astype(float)
    return n / np.linalg.norm(n, axis=-1, keepdims=True)


def test_a_spread_is_the_covariance_of_the_slopes_that_it_is_made_from() -> None:
    slopes = np.random.default_rng(1).normal(size=(500, 8, 2)) @ np.array([[1.0, 0.4], [0.0, 0.6]])
    n = _units(1)
    x, y = axes_across(n)
    # Partial derivatives' directions, neither at right angles nor of one length.
    u, v = (_across(n, _units(seed)) * seed for seed in (2, 3))
    moments = np.einsum("ksi,ksj->kij", slopes, slopes)[:, (0, 0, 1), (0, 1, 1)]
    changes = [slopes[:, i, :1] * u + slopes[:, i, 1:] * v for i in range(8)]
    got = _covariance(*spread.spread_along(x, y, spread.moments_across(x, y, u, v, moments)))
    assert np.abs(got - _covariance(*changes)).max() < 1e-12 * np.abs(got).max()
    wrong = _covariance(*spread.spread_along(x, y, spread.moments_across(x, y, v, u, moments)))
    assert np.abs(wrong - got).max() > 0.1 * np.abs(got).max()


@pytest.mark.parametrize("who", ["GLSL", "reference"])
@pytest.mark.parametrize("trace", [0.0, 1e-30, 1e-20, 1e-6, 1.0, 1e12, 1e32, 3e38])
def test_moments_that_rounding_made_of_no_slopes_are_the_nearest_of_some(glsl: Glsl, who: str, trace: float) -> None:
    """Halves of moments of one line: a determinant of 2e-3 below 0."""
    turns = np.linspace(0, np.pi, 64)
    line = np.stack([np.cos(turns) ** 2, 1.001 * np.cos(turns) * np.sin(turns), np.sin(turns) ** 2], axis=-1)
    x, y = (np.tile(np.float32(axis), (64, 1)) for axis in ((1, 0, 0), (0, 1, 0)))
    along = glsl("lib/spread.glsl").spread_along if who == "GLSL" else spread.spread_along
    a, b = (np.asarray(w, np.float64) for w in along(x, y, np.float32(trace * line)))
    got = _covariance(a, b)
    most = min(trace, spread.MOST_SPREAD)
    assert np.isfinite(got).all()
    assert np.einsum("kii->k", got) == pytest.approx(most, rel=2e-3, abs=1e-30)
    if trace < spread.MOST_SPREAD:
        # The eigenvalue below 0, and as much of the other one.
        assert np.abs(got[:, (0, 0, 1), (0, 1, 1)] - trace * line).max() <= 2e-3 * trace + 1e-30


def _of(s: F64) -> tuple[F64, F64]:
    """Means (K, 2) of slopes (K, N, 2), and their moments (K, 3) about these."""
    mean = s.mean(axis=1)
    off = s - mean[:, None]
    return mean, np.einsum("kni,knj->kij", off, off)[:, (0, 0, 1), (0, 1, 1)] / s.shape[1]


@pytest.mark.parametrize("steep", [1, 7, 63, 64])
def test_steep_slopes_are_found_among_flat_ones(steep: int) -> None:
    chance = np.random.default_rng(steep)
    s = chance.normal(size=(200, 64, 2)) @ np.array([[1.0, 0.4], [0.0, 0.6]]) + 2 * chance.normal(size=(200, 1, 2))
    s[:, steep:] = 0
    mean, moments = _of(s)
    share, theirs, left = spread.steep_part(np.full(200, steep / 64), mean, moments)
    want, about = _of(s[:, :steep])
    assert share == pytest.approx(steep / 64, rel=1e-12)
    assert np.abs(theirs - want).max() < 1e-12
    # A difference of what is 64 times as large, squared.
    assert np.abs(left - about).max() < 1e-9
    # Less than there are: what is left varies less than not at all, were they as few.
    few, *_ = spread.steep_part(np.full(200, 0.5 * steep / 64), mean, moments)
    assert (few >= 0.5 * steep / 64 - 1e-12).all()
    if steep == 1:
        assert few == pytest.approx(1 / 64, rel=1e-9)


def test_slopes_that_do_not_vary_have_no_flats() -> None:
    share, mean, moments = spread.steep_part(0.1, np.array([3.0, 1.0]), np.zeros(3))
    assert share == 1
    assert mean.tolist() == [3, 1]
    assert moments.tolist() == [0, 0, 0]


def test_what_is_folded_is_what_falls_on_both_sides() -> None:
    chance = np.random.default_rng(1).normal(size=400_000)
    for y in (0.0, 0.3, 1.0, 2.5):
        # Of as many draws the variance is off by 1 / sqrt(200000), four times at most.
        assert 1 - spread.folded_share(np.array(y)) == pytest.approx(np.abs(chance + y).var(), abs=9e-3)
    up, low = np.array([[0.0, 1.0, 0.0]]), np.array([[np.cos(0.1), np.sin(0.1), 0.0]])
    a, b = (0.2 * axis for axis in axes_across(low))
    height = low[0, 1] + np.hypot(a[0, 1], b[0, 1]) * chance
    mean, *left = spread.folded(low, up, a, b)
    assert mean[0, 1] == pytest.approx(np.abs(height).mean(), rel=0.03)
    assert _covariance(*left)[0, 1, 1] == pytest.approx(np.abs(height).var(), rel=0.03)


def test_a_widened_footprint_holds_both() -> None:
    d = _units(1)
    sides = [_across(d, 0.1 * _units(seed)) for seed in (2, 3, 4, 5)]
    longer, shorter, squares = spread.widened_footprint(d, *sides)
    wide = np.sqrt(squares[:, :1]) * longer, np.sqrt(squares[:, 1:]) * shorter
    assert np.abs(_covariance(*wide) - _covariance(*sides)).max() < 1e-14
    assert np.abs(np.einsum("ki,ki->k", longer, shorter)).max() < 1e-14
    step, side = spread.spread_taps(squares, 1e3).T
    places = np.arange(spread.SPREAD_TAPS) - (spread.SPREAD_TAPS - 1) / 2
    assert side**2 / 4 + step**2 * places.var() == pytest.approx(squares[:, 0] / 4, rel=1e-12)


# ---- a mirror of which no bump is seen

FACING = Quad(corners=((-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)))
AHEAD = Camera(eye=(0, 0, 4), target=(0, 0, 0), projection="orthographic", height=1)
TILED = 256
"""Repeats along FACING: each of four pixels sees 32 of them."""
AMPLITUDE = 1.2e-4
"""Of the waves: their slopes are 0.064 and 0.042 rms along u and v."""
Light = Callable[[F64], F64]


def _tiled(heights: F32, amplitude: float) -> Bump:
    return Bump(heights, amplitude=amplitude, repeat=(TILED, TILED))


def _slopes(heights: F32, amplitude: float) -> F64:
    """(N, 2): of all texels, on FACING."""
    return slopes(heights, "central", "wrap").reshape(-1, 2).astype(float) * amplitude * TILED / 2


def _mirrored(heights: F32, amplitude: float, dir: F64, light: Light) -> float:
    """The mean of what all texels of a map on FACING mirror along the unit `dir`."""
    s = _slopes(heights, amplitude)
    n = np.concatenate([-s, np.ones_like(s[:, :1])], axis=-1)
    n /= np.linalg.norm(n, axis=-1, keepdims=True)
    return float(light(reflect_dir(dir, n)).mean())


def _draw(renderer: Renderer, who: str, scene: Scene, how: str) -> float:
    quality = Quality("balanced", samples=1, bump_spread=how)
    if who == "GPU":
        return float(renderer.render(scene, (4, 4), quality).pixels[..., 0].mean())
    return float(reference.render(scene, (4, 4), 1, quality=quality).pixels[..., 0].mean())


def _lobe(middle: F64, narrow: float) -> CubeMap:
    """Light that falls off from the unit `middle` as exp(narrow (cos - 1)), smooth where it is looked at."""
    light = np.exp(narrow * (texel_dirs(CUBE, (64, 64)) @ middle - 1)).astype(np.float32)
    return CubeMap(np.repeat(light[..., None], 3, axis=-1), background=False)


def _lost(renderer: Renderer, who: str, how: str, heights: F32, amplitude: float = AMPLITUDE) -> float:
    """The light at a lobe's top that the spread takes away, over what bumps of AMPLITUDE take: the mean of eight places
    of the environment, as a level's texel is averaged over more at its corners than in its middle."""
    shares = []
    for aside in np.random.default_rng(0).uniform(-0.3, 0.3, (8, 2)):
        middle = np.array([*aside, 1.0]) / np.linalg.norm([*aside, 1.0])
        towards = middle * (1, 1, -1)
        want = _mirrored(heights, AMPLITUDE, towards, lambda d, top=middle: np.exp(4 * (d @ top - 1)))  # type: ignore[misc]
        camera = replace(AHEAD, eye=tuple(-4 * towards))
        surface = Surface(FACING, CHROME, _tiled(heights, amplitude))
        scene = Scene([surface], _lobe(middle, 4.0), camera)
        plain = _draw(renderer, who, scene, "none")
        assert plain - want > 0.03
        shares.append((plain - _draw(renderer, who, scene, how)) / (plain - want))
    return float(np.mean(shares))


@pytest.mark.parametrize("who", ["GPU", "reference"])
def test_a_mirror_blurs_by_exactly_the_variance_of_its_bumps(renderer: Renderer, waves: F32, who: str) -> None:
    """The loss of light at the lobe's top is its curvature times the variance, to the first order."""
    # Between two levels the variance is up to a quarter more than a texel's says; that of one tap goes up and down by
    # half with its place, which eight places halve and four taps each nearly even out.
    assert _lost(renderer, who, "lean", waves) == pytest.approx(1, abs=0.05)
    assert _lost(renderer, who, "toksvig", waves) == pytest.approx(1, abs=0.15)


@pytest.mark.parametrize("wrong", [0.5, 2.0])
@pytest.mark.parametrize("how", SPREADS)
def test_half_or_twice_the_variance_is_told_apart(renderer: Renderer, waves: F32, how: str, wrong: float) -> None:
    lost = _lost(renderer, "GPU", how, waves, AMPLITUDE * wrong**0.5)
    assert lost == pytest.approx(wrong, rel=0.2)
    assert lost != pytest.approx(1, abs=0.15)


@pytest.mark.parametrize("who", ["GPU", "reference"])
@pytest.mark.parametrize("width", [8, 32])
def test_flat_places_mirror_sharply_through_a_haze(
    renderer: Renderer, monkeypatch: pytest.MonkeyPatch, who: str, width: int
) -> None:
    """Roofs on half of a map: one bell curve for flat and steep places is as wide as neither."""
    heights = np.zeros((64, 64), np.float32)
    heights[:, :32] = np.tile(1 - np.abs(np.linspace(-1, 1, width)), 32 // width)
    amplitude = 0.15 / (TILED / 2) * (width / 2 / 64)
    towards = np.array([0.0, 0.0, -1.0])
    want = _mirrored(heights, amplitude, towards, lambda d: np.exp(200 * (d[:, 2] - 1)))

    def seen() -> float:
        scene = Scene([Surface(FACING, CHROME, _tiled(heights, amplitude))], _lobe(-towards, 200.0), AHEAD)
        return _draw(renderer, who, scene, "lean")

    # A level's texel at the lobe's top, which flat places see: a tenth of the lobe's width squared.
    assert seen() == pytest.approx(want, rel=0.1)
    monkeypatch.setattr(relief, "LEAST_FLATS", 2.0)
    assert seen() < 0.4 * want


@pytest.mark.parametrize("who", ["GPU", "reference"])
def test_what_is_computed_is_averaged_over_it(renderer: Renderer, waves: F32, who: str) -> None:
    """The lecture's sky, just below its horizon, where bumps see some of what is above."""
    sky = Sky(up=(1, 1, 1), down=(0, 0, 0), softness=0.05, background=False)
    camera = replace(AHEAD, eye=(0, 0.5, 4))
    towards = np.array([0, -0.5, -4]) / np.hypot(0.5, 4)
    scene = Scene([Surface(FACING, CHROME, _tiled(waves, 2 * AMPLITUDE))], sky, camera)
    want = _mirrored(waves, 2 * AMPLITUDE, towards, lambda d: radiance(sky, d)[:, 0])
    plain, ours = (_draw(renderer, who, scene, how) for how in ("none", "lean"))
    # An interval in place of a bell curve of the same variance, at what is all but a step: 17 %.
    assert ours - plain == pytest.approx(want - plain, rel=0.2)
    assert want - plain > 0.02


def test_grooves_blur_across_them_alone(renderer: Renderer) -> None:
    """Three moments tell the directions apart, one variance does not."""
    grooves = np.tile(0.5 + 0.5 * np.sin(2 * np.pi * np.arange(16) / 16), (16, 1)).astype(np.float32)
    seen = {}
    for axis in (0, 1):
        light = (texel_dirs(CUBE, (64, 64))[..., axis : axis + 1] ** 2).astype(np.float32)
        environment = CubeMap(np.repeat(light, 3, axis=-1), background=False)
        scene = Scene([Surface(FACING, CHROME, _tiled(grooves, AMPLITUDE))], environment, AHEAD)
        for how in SPREADS:
            seen[axis, how] = _draw(renderer, "GPU", scene, how)
    # The mean of x^2 over the blur is its variance along x; taps lie along it, and are 0.4 of it wide across.
    assert seen[1, "lean"] < 0.35 * seen[0, "lean"]
    assert seen[1, "toksvig"] == pytest.approx(seen[0, "toksvig"], rel=0.05)


def test_layers_add_their_variances(renderer: Renderer, waves: F32) -> None:
    """Twice the same map, turned by a quarter of its repeat, blurs as one with twice the variance."""
    light = (texel_dirs(CUBE, (64, 64))[..., :1] ** 2 + texel_dirs(CUBE, (64, 64))[..., 1:2] ** 2).astype(np.float32)
    environment = CubeMap(np.repeat(light, 3, axis=-1), background=False)
    one, steeper = _tiled(waves, AMPLITUDE), _tiled(waves, AMPLITUDE * 2**0.5)
    two, same = (
        _draw(renderer, "GPU", Scene([Surface(FACING, CHROME, bumps)], environment, AHEAD), "lean")
        for bumps in ((one, one), steeper)
    )
    # Halves of the moments.
    assert two == pytest.approx(same, rel=2e-3)


def test_what_is_rough_becomes_rougher(renderer: Renderer, waves: F32) -> None:
    """As a flat surface with the sum of both variances of slopes; not with half or twice as much of the bumps'."""
    roughness, trace = 0.2, float(np.trace(np.cov(_slopes(waves, AMPLITUDE).T)))
    environment = _lobe(np.array([0.0, 0.0, 1.0]), 8.0)
    quality = Quality("balanced", samples=1, gloss_size=32, gloss_samples=32)

    def seen(roughness: float, *bumps: Bump) -> float:
        material = Material(metallic=1, roughness=roughness)
        scene = Scene([Surface(FACING, material, bumps or None)], environment, AHEAD)
        return float(renderer.render(scene, (4, 4), quality).pixels[..., 0].mean())

    bumped = seen(roughness, _tiled(waves, AMPLITUDE))
    same, less, more = (seen((roughness**4 + k * trace) ** 0.25) for k in (1.0, 0.5, 2.0))
    # Halves of the moments, and of the picture.
    assert bumped == pytest.approx(same, rel=2e-3)
    assert less > 1.02 * bumped > 1.02 * 1.02 * more


# ---- both sides

LIGHT = CubeMap(np.random.default_rng(3).uniform(0.2, 1, (6, 16, 16, 3)).astype(np.float32), background=False)
DENTS = patterns.dimples((64, 64), wobble=0.5)
TILTS = np.random.default_rng(4).normal(size=(32, 32, 3)).astype(np.float32) * (0.2, 0.2, 0) + (0, 0, 1)
TURNED = Transform(rotate=(10, 40, 0), scale=(1, 1.4, 0.8))
KINDS: dict[str, tuple[Shape, Material, Any, Transform]] = {
    "ball": (Sphere(), CHROME, Bump(DENTS, amplitude=0.008, repeat=(16, 8)), Transform()),
    "stretched ball": (Sphere(), CHROME, Bump(DENTS, amplitude=0.008, repeat=(16, 8)), TURNED),
    "plane": (Plane(size=(4, 4)), CHROME, Bump(DENTS, amplitude=0.02, repeat=(16, 16)), Transform()),
    "once": (Plane(size=(4, 4)), CHROME, Bump(DENTS, amplitude=0.1, border="clamp"), Transform()),
    "normal map": (Torus(), CHROME, NormalMap(TILTS, repeat=(16, 8)), Transform()),
    "parameter": (Torus(), CHROME, Bump(DENTS, amplitude=0.01, repeat=(8, 4), scaling="parameter"), TURNED),
    "triplanar": (Cube(), CHROME, Bump(DENTS, amplitude=0.004, repeat=(8, 8), mapping="triplanar"), TURNED),
    "glass": (Sphere(), Material(roughness=0, transmission=1), Bump(DENTS, amplitude=0.004, repeat=(16, 8)), TURNED),
    "layers": (
        Sphere(),
        CHROME,
        (Bump(DENTS, amplitude=0.004, repeat=(8, 4)), NormalMap(TILTS, scale=0.5, repeat=(16, 8))),
        Transform(),
    ),
}


@pytest.mark.parametrize("how", SPREADS)
@pytest.mark.parametrize("kind", KINDS)
def test_the_reference_models_it(renderer: Renderer, kind: str, how: str) -> None:
    shape, material, bump, transform = KINDS[kind]
    camera = Camera(eye=(0, 1.2, 5), target=(0, 0, 0), fov=40)
    scene = Scene([Surface(shape, material, bump, transform)], LIGHT, camera)
    quality = Quality(
        "balanced", samples=1, bump_spread=how, texture_format="float", bump_format="float", frame_format="float"
    )
    drawn, modelled = renderer.render(scene, (32, 32), quality), reference.render(scene, (32, 32), 1, quality=quality)
    assert drawn.stats["plan"]["surface 0 bump spread"] == how
    both = (drawn.pixels[..., 3] > 0.99) & (modelled.pixels[..., 3] > 0.99)
    off = np.abs(drawn.pixels - modelled.pixels)[both][:, :3].max(axis=-1)
    # Logarithms of 32-bit floats; beside edges of flat faces quads of pixels are the driver's, spread or not.
    assert np.percentile(off, 75) < 2e-4
    plain = reference.render(scene, (32, 32), 1, quality=replace(quality, bump_spread="none"))
    assert np.percentile(np.abs(plain.pixels - modelled.pixels)[both][:, :3].max(axis=-1), 75) > 1e-2


# ---- when it is left out


def _choice(scene: Scene, quality: Quality) -> tuple[str, str, int]:
    plan = make_plan(scene, quality, (64, 64), Contents())
    made = next(c for c in plan.choices if c.what == "surface 0 bump spread")
    return made.value, made.why, plan.surfaces[0].has("SPREAD")


@pytest.mark.parametrize(
    ("changes", "why"),
    [
        ({"bump_spread": "none"}, "as the quality has it"),
        ({"bump_filter": "bilinear"}, "no level averages slopes"),
        ({"bump_read": "shader"}, "no level averages slopes"),
        ({"environment_filter": "bilinear"}, "no levels"),
    ],
)
def test_what_has_no_levels_has_no_spread(waves: F32, changes: dict[str, Any], why: str) -> None:
    scene = Scene([Surface(Sphere(), CHROME, Bump(waves, amplitude=0.01))], LIGHT)
    assert _choice(scene, Quality("balanced"))[::2] == ("lean", 2)
    value, said, define = _choice(scene, Quality("balanced", **changes))
    assert (value, define) == ("none", 0)
    assert why in said


def test_flat_places_are_kept_apart_where_there_are_some_in_all_layers(waves: F32) -> None:
    dents, some = Bump(patterns.bricks((64, 64)), amplitude=0.01), Bump(waves, amplitude=0.01)

    def has_flats(*bumps: Bump, show: str | None = None, **changes: Any) -> bool:
        scene = Scene([Surface(Sphere(), CHROME, bumps)], LIGHT)
        plan = make_plan(scene, Quality("balanced", **changes), (64, 64), Contents(), show=show)
        said = [c.what for c in plan.choices if c.what.endswith("flat places")]
        assert bool(said) == plan.surfaces[0].has("FLATS")
        return bool(said)

    assert has_flats(dents)
    assert has_flats(dents, dents)
    assert has_flats(dents, show="level")
    assert not has_flats(some)
    assert not has_flats(dents, some)
    assert not has_flats(dents, bump_spread="toksvig")
    assert not has_flats(dents, bump_filter="bilinear")
    # What is shown is the mean of all.
    assert not has_flats(dents, show="normal")


def test_what_is_near_has_no_spread(waves: F32) -> None:
    """64 texels across 2 units: a pixel of one sample is as large as a texel where the picture is 2 units high."""
    scene = Scene([Surface(FACING, CHROME, Bump(waves, amplitude=0.01))], LIGHT, replace(AHEAD, height=1.9))
    assert _choice(scene, Quality("balanced", samples=1))[0] == "none"
    farther = replace(scene, camera=replace(AHEAD, height=2.1))
    assert _choice(farther, Quality("balanced", samples=1))[0] == "lean"
    # Four samples see half as far each.
    assert _choice(farther, Quality("balanced"))[0] == "none"


def test_four_samples_see_a_far_plane_as_four_passes_do(renderer: Renderer, waves: F32) -> None:
    """llvmpipe's perspective is the pixel's, not the sample's: a large plane's u and v were off by some repeats."""
    plane = Surface(Plane(size=(400, 400)), CHROME, Bump(waves, amplitude=0.03, repeat=(400, 400)))
    scene = Scene([plane], Sky(background=False), Camera(eye=(0, 0.5, 0), target=(0, -0.1, -2), fov=40))
    able, pictures = renderer.capabilities, []
    with Renderer(context=renderer.context) as other:
        for multisamples in (able.multisamples, 0):
            other.capabilities = replace(able, multisamples=multisamples)
            pictures.append(other.render(scene, (64, 64), "balanced").pixels)
    assert np.abs(pictures[0] - pictures[1]).max() < 0.01
