"""What OpenGL allows a texture look-up to return: laws of the intervals, and the wrong neighbours outside them."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import numpy.typing as npt
import pytest

from glbump.glsltest import inputs
from glbump.maps import cube
from glbump.maps.pyramid import chain
from glbump.reference.filter import isotropic_level, through_levels
from glbump.reference.texturing.detail import detail_2d, detail_anisotropic, detail_cube, given_detail
from glbump.reference.texturing.interval import EXACT, HIGH_2D, HIGH_CUBE, LOW_2D, LOW_CUBE, Interval, Precision
from glbump.reference.texturing.look_up import Filter, anisotropic_2d, texture_2d, texture_cube, wrapped

F64 = npt.NDArray[np.float64]
RANDOM = np.random.default_rng(11)
NOISE = RANDOM.random((16, 32, 2))
LEVELS = [np.asarray(level, np.float64) for level in chain(NOISE)]
FACES = [np.asarray(level, np.float64) for level in chain(RANDOM.random((6, 16, 16, 1)))]
UV = RANDOM.uniform(-1.5, 2.5, (400, 2))
DIRS = inputs.unit_vectors(400, 5).astype(float)
DETAIL = RANDOM.uniform(-1, 6, 400)
PRECISIONS = (HIGH_2D, LOW_2D, HIGH_CUBE, LOW_CUBE, replace(LOW_2D, mip=6), Precision(8, 8, 8, 8, 8))
FILTERS = [
    Filter(texels, levels, magnify)
    for texels in ("nearest", "linear")
    for levels in ("none", "nearest", "linear")
    for magnify in ("nearest", "linear")
]
NEAREST = Filter("nearest", "nearest", "nearest")
BESIDE = np.array([[1 + 1e-9, 1, 1], [1, 1, 1 + 1e-9]])
# Sums of a few products in another order.
ROUNDING = 1e-14


def exact(level: npt.ArrayLike) -> Interval:
    return given_detail(level, EXACT)


def one_texel(level: F64, x: int, y: int, wrap: str, border: float) -> F64:
    """The texel of 8.14.2, table 8.20, in so many words."""
    found = []
    for at, size in ((x, level.shape[1]), (y, level.shape[0])):
        match wrap:
            case "repeat":
                at = int(math.fmod(math.fmod(at, size) + size, size))
            case "mirror":
                a = (at % (2 * size)) - size
                at = (size - 1) - (a if a >= 0 else -(1 + a))
            case "clamp":
                at = max(0, min(at, size - 1))
            case "mirror-once":
                at = max(0, min(at if at >= 0 else -(1 + at), size - 1))
        if not 0 <= at < size:
            return np.full(level.shape[-1], border)
        found.append(at)
    return level[found[1], found[0]]


def in_level(level: F64, uv: F64, how: str, wrap: str, border: float) -> F64:
    x, y = uv[0] * level.shape[1], uv[1] * level.shape[0]
    if how == "nearest":
        return one_texel(level, math.floor(x), math.floor(y), wrap, border)
    i, j = math.floor(x - 0.5), math.floor(y - 0.5)
    a, b = x - 0.5 - i, y - 0.5 - j
    t = [[one_texel(level, i + k, j + m, wrap, border) for k in (0, 1)] for m in (0, 1)]
    return (1 - a) * (1 - b) * t[0][0] + a * (1 - b) * t[0][1] + (1 - a) * b * t[1][0] + a * b * t[1][1]


def ideal(levels: list[F64], uv: F64, detail: float, filter: Filter, wrap: str = "repeat", border: float = 0.0) -> F64:
    """One look-up by 8.14.2 to 8.15, a pixel at a time."""
    c = 0.5 if filter.magnify == "linear" and filter.texels == "nearest" and filter.levels != "none" else 0.0
    if detail <= c:
        return in_level(levels[0], uv, filter.magnify, wrap, border)
    if filter.levels == "none":
        return in_level(levels[0], uv, filter.texels, wrap, border)
    top = len(levels) - 1
    if filter.levels == "nearest":
        number = 0 if detail <= 0.5 else min(math.ceil(detail + 0.5) - 1, top)
        return in_level(levels[number], uv, filter.texels, wrap, border)
    fine = min(math.floor(detail), top)
    coarse = min(fine + 1, top)
    share = detail - math.floor(detail) if coarse > fine else 0.0
    one, other = (in_level(levels[k], uv, filter.texels, wrap, border) for k in (fine, coarse))
    return (1 - share) * one + share * other


# ---- values


@pytest.mark.parametrize("filter", FILTERS, ids=str)
def test_without_errors_the_interval_is_the_specifications_value(filter: Filter) -> None:
    for wrap in ("repeat", "mirror", "clamp", "border", "mirror-once"):
        got = texture_2d(LEVELS, UV[:100], exact(DETAIL[:100]), EXACT, filter=filter, wrap=(wrap, wrap), border=0.25)
        want = [ideal(LEVELS, uv, lod, filter, wrap, 0.25) for uv, lod in zip(UV[:100], DETAIL)]
        assert np.abs(got.low - want).max() < ROUNDING
        assert (got.low == got.high).all()


@pytest.mark.parametrize("precision", PRECISIONS, ids=str)
@pytest.mark.parametrize("filter", FILTERS, ids=str)
def test_the_ideal_value_lies_inside(filter: Filter, precision: Precision) -> None:
    got = texture_2d(LEVELS, UV, given_detail(DETAIL, precision), precision, filter=filter)
    want = texture_2d(LEVELS, UV, exact(DETAIL), EXACT, filter=filter)
    assert got.excess(want.low).max() == 0
    assert (got.low >= NOISE.min()).all()
    assert (got.high <= NOISE.max()).all()
    faces = texture_cube(FACES, DIRS, given_detail(DETAIL, precision), precision, filter=filter)
    assert faces.excess(texture_cube(FACES, DIRS, exact(DETAIL), EXACT, filter=filter).middle).max() == 0


def test_the_cube_is_that_of_the_maps() -> None:
    got = texture_cube(FACES, DIRS, exact(DETAIL), EXACT)
    want = cube.sample_levels([np.asarray(f, np.float32) for f in FACES], DIRS, DETAIL)
    # Its texels are float32.
    assert np.abs(got.middle - want).max() < 1e-7
    assert got.reach.max() < 1e-15


def test_any_errors_within_the_bounds_stay_inside_and_some_reach_the_ends() -> None:
    """Places moved by as much as is allowed, levels too, each of the two levels by itself."""
    precision, random = replace(LOW_2D, subtexel=2), np.random.default_rng(12)
    uv, lod = UV[:40], np.abs(DETAIL[:40])
    got = texture_2d(LEVELS, uv, given_detail(lod, precision), precision)
    sizes = np.array([level.shape[1::-1] for level in LEVELS])
    seen = Interval(np.full((40, 2), np.inf), np.full((40, 2), -np.inf))
    for _ in range(150):
        # The ends of the allowed more often than what lies between.
        errors = np.clip(random.uniform(-2, 2, (len(LEVELS), 40, 2)), -1, 1) * 2.0**-precision.subtexel
        level = lod + np.clip(random.uniform(-2, 2, 40), -1, 1) * 2.0**-precision.lod

        def look(i: int, chosen: npt.NDArray[np.bool_], errors: F64 = errors) -> F64:
            places = uv[chosen] + errors[i, chosen] / sizes[i]
            return texture_2d([LEVELS[i]], places, exact(np.zeros(len(places))), EXACT).low

        value = through_levels(look, level, len(LEVELS), "trilinear")
        assert got.excess(value).max() < ROUNDING
        seen = Interval(np.minimum(seen.low, value), np.maximum(seen.high, value))
    # All five errors at their worst ends at once are rarely met by chance; nine tenths of the way there are.
    is_open = got.reach > 0
    assert np.median(seen.reach[is_open] / got.reach[is_open]) > 0.9


@pytest.mark.parametrize("bit", ["coordinate", "subtexel", "lod", "mip"])
def test_intervals_shrink_to_the_ideal_as_bits_grow(bit: str) -> None:
    want = texture_2d(LEVELS, UV, exact(DETAIL), EXACT).low
    reaches, last = [], Interval(np.full_like(want, -np.inf), np.full_like(want, np.inf))
    for bits in (4, 8, 16, 32, 48):
        precision = replace(EXACT, **{bit: bits})  # type: ignore[arg-type]
        got = texture_2d(LEVELS, UV, given_detail(DETAIL, precision), precision)
        assert got.excess(want).max() == 0
        assert last.excess(got.low).max() == last.excess(got.high).max() == 0, "each lies in the one before"
        reaches.append(got.reach.max())
        last = got
    # Linear in the error: 32 coordinates (of up to 2.5) wide, values of one size.
    assert reaches[-1] < 100 * 2.0**-48
    assert reaches[1] > 100 * reaches[2] > 0
    footprint = detail_2d([[0.7, 0.1]], [[-0.2, 3.0]], Precision(derivative=40, lod=40, ideal_rho=True))
    assert footprint.reach[0] < 4 * 2.0**-40


@pytest.mark.parametrize("filter", FILTERS, ids=str)
def test_a_constant_texture_gives_a_point(filter: Filter) -> None:
    """Whatever is open; so does a cube, its edges and corners."""
    value = np.array([0.1, 1e5, -3e-7])
    flat = [np.broadcast_to(value, level.shape[:2] + (3,)) for level in LEVELS]
    got = texture_2d(flat, UV, given_detail(DETAIL, LOW_2D), LOW_2D, filter=filter)
    assert (got.low == value).all()
    assert (got.high == value).all()
    faces = [np.broadcast_to(np.float32(value), level.shape[:3] + (3,)) for level in FACES]
    dirs = np.concatenate([inputs.axes(), inputs.corners(), DIRS[:100]]).astype(float)
    cubes = texture_cube(faces, dirs, given_detail(np.linspace(-1, 6, len(dirs)), LOW_CUBE), LOW_CUBE, filter=filter)
    assert (cubes.low == np.float32(value)).all()
    assert (cubes.high == np.float32(value)).all()


def test_nearest_at_texel_centres_is_exact() -> None:
    """And linear is, without errors; with them nearest stays exact as long as they are below half a texel."""
    for number, level in enumerate(LEVELS):
        height, width = level.shape[:2]
        u, v = np.meshgrid((np.arange(width) + 0.5) / width, (np.arange(height) + 0.5) / height)
        detail = np.full(u.shape, float(number))
        for filter, precision in ((Filter("nearest", "nearest", "nearest"), LOW_2D), (Filter(), EXACT)):
            got = texture_2d(LEVELS, np.stack([u, v], -1), given_detail(detail, precision), precision, filter=filter)
            assert np.array_equal(got.low, level)
            assert np.array_equal(got.high, level)


def test_a_cubes_corner_is_the_mean_of_three_and_its_edge_of_two() -> None:
    for level in range(len(FACES)):
        detail = exact(np.full(8, float(level)))
        signs = inputs.corners().astype(float)
        got = texture_cube(FACES, signs, detail, EXACT)
        for direction, value in zip(signs, got.middle):
            three = [
                texture_cube(FACES, [direction * (1 + 1e-9 * np.eye(3)[k])], exact([level]), EXACT, filter=NEAREST)
                for k in range(3)
            ]
            # Corners are float32 means.
            assert value == pytest.approx(np.mean([t.middle for t in three]), abs=1e-7)
    # 4x4 texels a face: on the edge of +X and +Z, at the height of texel centres.
    edge = np.array([[1.0, y, 1.0] for y in (-0.75, -0.25, 0.25, 0.75)])
    sides = [texture_cube(FACES, edge * side, exact(np.full(4, 2.0)), EXACT, filter=NEAREST) for side in BESIDE]
    got = texture_cube(FACES, edge, exact(np.full(4, 2.0)), EXACT)
    assert got.middle == pytest.approx((sides[0].middle + sides[1].middle) / 2, abs=1e-7)


def test_a_cubes_look_up_is_continuous_across_edges_and_corners() -> None:
    """Without a seam: the same value from both sides of every edge."""
    corners = inputs.corners().astype(float)
    along = np.linspace(-0.999, 0.999, 41)
    for axis in range(3):
        for sign in corners[:4, :2]:
            edge = np.insert(np.broadcast_to(sign, (41, 2)), axis, along, axis=1)
            others = [k for k in range(3) if k != axis]
            for level in (0.0, 1.5, 4.0):
                pair = [
                    texture_cube(FACES, edge * (1 + 1e-9 * np.eye(3)[k]), exact(np.full(41, level)), EXACT).middle
                    for k in others
                ]
                assert np.abs(pair[0] - pair[1]).max() < 1e-7


def test_each_bit_opens_what_it_says() -> None:
    """On a ramp a value is its place in texels, so the interval is the box of places."""
    ramp = np.broadcast_to(np.arange(64.0), (4, 64))[..., None]
    uv, flat = [[0.3, 0.5], [0.7, 0.2]], exact([0.0, 0.0])
    for precision, want in (
        (Precision(coordinate=8), np.array([0.3, 0.7]) * 64 / 256),
        (Precision(subtexel=4), np.array([1, 1]) / 16),
        (Precision(coordinate=8, subtexel=4, colour=0.5), np.array([0.3, 0.7]) / 4 + 1 / 16 + 0.5),
    ):
        got = texture_2d([ramp], uv, flat, precision, wrap=("clamp", "clamp"))
        assert got.reach[:, 0] == pytest.approx(want)
        assert got.middle[:, 0] == pytest.approx(np.array([0.3, 0.7]) * 64 - 0.5)
    faces = np.broadcast_to(ramp[:, :16].reshape(1, 4, 16, 1)[:, :1], (6, 16, 16, 1))
    got = texture_cube([faces], [[0.2, 0.1, 1.0]], exact([0.0]), Precision(coordinate=8, subtexel=4))
    assert got.reach[0, 0] == pytest.approx(16 / 256 + 1 / 16)
    # The whole footprint: half of both sides, either way.
    side = np.array([[6.0, 0.0]]) / 64, np.array([[2.0, 0.0]]) / 64
    got = anisotropic_2d([ramp], [[0.5, 0.5]], *side, exact([0.0]), EXACT, limit=4, wrap=("clamp", "clamp"))
    assert got.reach[0, 0] == pytest.approx(4)


def test_on_an_edge_either_faces_texel_is_nearest() -> None:
    faces = np.broadcast_to(np.arange(6.0)[:, None, None, None], (6, 8, 8, 1))
    got = texture_cube([faces], [[1.0, 0.3, 1.0], [-1.0, -1.0, 0.3]], exact([0.0, 0.0]), EXACT, filter=NEAREST)
    assert got.low[:, 0].tolist() == [0, 1]
    assert got.high[:, 0].tolist() == [4, 3]
    got = texture_cube([faces], [[1.0, 0.3, -1.0]], exact([0.0]), EXACT, filter=NEAREST)
    assert (got.low[0, 0], got.high[0, 0]) == (0, 5)


def test_wraps_by_the_table() -> None:
    at = np.arange(-9, 12)
    assert wrapped(at, 4, "repeat").tolist() == [3, 0, 1, 2] * 4 + [3, 0, 1, 2, 3]
    assert wrapped(np.arange(-4, 8), 4, "mirror").tolist() == [3, 2, 1, 0, 0, 1, 2, 3, 3, 2, 1, 0]
    assert wrapped(np.arange(-6, 7), 4, "mirror-once").tolist() == [3, 3, 3, 2, 1, 0, 0, 1, 2, 3, 3, 3, 3]
    assert wrapped(np.arange(-2, 6), 4, "clamp").tolist() == [0, 0, 0, 1, 2, 3, 3, 3]
    assert wrapped(np.arange(-2, 6), 4, "border").tolist() == [-1, -1, 0, 1, 2, 3, -1, -1]


# ---- levels of detail


def test_the_ideal_footprint_lies_within_what_is_allowed() -> None:
    random = np.random.default_rng(13)
    ddx, ddy = (random.normal(size=(1000, 2)) * 2.0 ** random.uniform(-4, 8, (1000, 1)) for _ in range(2))
    best = detail_2d(ddx, ddy, EXACT)
    assert best.middle == pytest.approx(isotropic_level(ddx, ddy), abs=1e-12)
    freedom = detail_2d(ddx, ddy, Precision())
    assert freedom.excess(best.middle).max() < 1e-12
    # Half a level less, and one level more, at the worst: a square turned by 45 degrees.
    assert (best.middle - freedom.low).max() <= 0.5 + 1e-12
    assert (freedom.high - best.middle).max() <= 1 + 1e-12
    turned = detail_2d([[3, 3]], [[-3, 3]], Precision())
    assert (turned.high - turned.low)[0] == pytest.approx(1)
    # A square that is not turned leaves a level open as well: mu + mv against the larger; a thin one along u does not.
    thin = detail_2d([[8, 0]], [[0, 0]], Precision())
    assert (thin.low[0], thin.high[0]) == (3, 3)
    assert detail_2d([[0, 0]], [[0, 0]], LOW_2D).high[0] < -100


def test_levels_on_a_cubes_faces_are_those_of_differences() -> None:
    ddx, ddy = (0.01 * inputs.unit_vectors(len(DIRS), seed) for seed in (6, 7))
    step = 1e-6
    got = detail_cube(3 * DIRS, 3 * ddx, 3 * ddy, 64, EXACT)
    sides = []
    for change in (ddx, ddy):
        _, s, t = cube.face_of(DIRS + step * change)
        _, s0, t0 = cube.face_of(DIRS - step * change)
        sides.append(np.stack([s - s0, t - t0], axis=-1) * 64 / (2 * step))
    away = np.sort(np.abs(DIRS), axis=-1)
    away_from_edges = away[:, 2] > away[:, 1] * 1.001
    assert got.middle[away_from_edges] == pytest.approx(isotropic_level(*sides)[away_from_edges], abs=1e-5)
    # On an edge either face's: they jump by up to 0.69 there (NUMERICS 2.3).
    corner, side = np.array([[1.0, 1.0, 0.999]]), np.array([[0.0, 0.01, 0.0]])
    both = detail_cube(corner, side, 0 * side, 64, EXACT)
    assert 0.2 < (both.high - both.low)[0] < 0.7
    beside = detail_cube(corner * [1.01, 1, 1], side, 0 * side, 64, EXACT)
    assert beside.reach[0] == 0
    assert both.excess(beside.middle)[0] < 0.03


def test_bits_of_derivatives_and_of_directions() -> None:
    thin = detail_2d([[8.0, 0.0]], [[0.0, 0.0]], Precision(derivative=4))
    assert thin.low[0] == pytest.approx(math.log2(8 * 15 / 16))
    assert thin.high[0] == pytest.approx(math.log2(8 * 17 / 16))
    # 1/1000 from the edge, with directions of 8 bits it may be either face's.
    near, side = np.array([[1.0, 0.999, 0.9]]), np.array([[0.0, 0.01, 0.0]])
    assert detail_cube(near, side, 0 * side, 64, EXACT).reach[0] == 0
    assert detail_cube(near, side, 0 * side, 64, replace(EXACT, coordinate=8)).reach[0] > 0.1
    assert detail_cube(near, side, 0 * side, 64, replace(EXACT, coordinate=20)).reach[0] == 0
    for ratio, limit, count in ((3, 16, 3), (2.5, 16, 3), (8, 2, 2), (1, 4, 1)):
        found = detail_anisotropic([[8.0, 0.0]], [[0.0, 8.0 / ratio]], limit, EXACT)
        assert found.low[0] == pytest.approx(math.log2(8 / count))
        assert found.high[0] == pytest.approx(3)


def test_a_level_coded_texture_tells_the_interval_of_the_level() -> None:
    coded = [np.full(level.shape[:2] + (1,), float(i)) for i, level in enumerate(LEVELS)]
    ddx, ddy = np.array([[3.0, 0.2]] * 20), np.array([[0.1, 1.0]] * 20)
    ddx *= np.linspace(0.05, 20, 20)[:, None]
    allowed = detail_2d(ddx, ddy, HIGH_2D)
    got = texture_2d(coded, UV[:20], allowed, HIGH_2D)
    assert got.low[:, 0] == pytest.approx(np.clip(allowed.low, 0, 5), abs=1e-12)
    assert got.high[:, 0] == pytest.approx(np.clip(allowed.high, 0, 5), abs=1e-12)
    rounded = texture_2d(coded, UV[:20], exact(np.arange(20) / 4), EXACT, filter=Filter(levels="nearest"))
    # Half-way either level will do.
    assert rounded.low[:8, 0].tolist() == [0, 0, 0, 1, 1, 1, 1, 2]
    assert rounded.high[:8, 0].tolist() == [0, 0, 1, 1, 1, 1, 2, 2]


# ---- anisotropy


def test_the_extensions_own_samples_are_allowed() -> None:
    """N samples on the longer side at i / (N + 1) - 1/2, level log2(Pmax / N) (EXT_texture_filter_anisotropic)."""
    sizes, random = np.array([32, 16]), np.random.default_rng(14)
    for limit in (2, 4, 16):
        turn, along, across = random.uniform(0, 2 * np.pi, 30), random.uniform(0.5, 14, 30), random.uniform(0.5, 3, 30)
        axis = np.stack([np.cos(turn), np.sin(turn)], axis=-1)
        ddx, ddy = along[:, None] * axis, across[:, None] * axis[:, ::-1] * [-1, 1]
        detail = detail_anisotropic(ddx, ddy, limit, HIGH_2D)
        got = anisotropic_2d(LEVELS, UV[:30], ddx / sizes, ddy / sizes, detail, HIGH_2D, limit=limit)
        for k in range(30):
            longer, shorter = max(along[k], across[k]), min(along[k], across[k])
            count = min(math.ceil(longer / shorter), limit)
            level = math.log2(longer / count)
            assert detail.low[k] <= level <= detail.high[k]
            side = (ddx if along[k] >= across[k] else ddy)[k] / sizes
            places = UV[k] + side * (np.arange(1, count + 1)[:, None] / (count + 1) - 0.5)
            samples = texture_2d(LEVELS, places, exact(np.full(count, level)), EXACT).middle.mean(axis=0)
            assert Interval(got.low[k], got.high[k]).excess(samples).max() < ROUNDING
    # Along stripes nothing is lost, which isotropic filtering blurs to grey.
    stripes = [np.asarray(v, float) for v in chain(np.tile([[[0.0], [1.0]]], (64, 32, 1)).astype(np.float32))]
    ddx, ddy = np.array([[0.0, 16.0]]), np.array([[1.0, 0.0]])
    got = anisotropic_2d(
        stripes, [[0.5 / 64, 0.5]], ddx / 64, ddy / 64, detail_anisotropic(ddx, ddy, 16, EXACT), EXACT, limit=16
    )
    assert got.low[0, 0] == 0
    assert detail_2d(ddx, ddy, EXACT).low[0] == 4


# ---- wrong neighbours


def outside(got: Interval, wrong: npt.ArrayLike) -> float:
    """The share of look-ups that are not allowed: 0 of a right driver's."""
    return float((got.excess(wrong) > 1e-6).any(axis=-1).mean())


def test_wrong_neighbours_are_outside() -> None:
    """At the precision of the lower grade: slips of half a texel, other wraps, other filters, the next level."""
    clamped = np.abs(DETAIL) % 2
    got = texture_2d(LEVELS, UV, given_detail(clamped, LOW_2D), LOW_2D)

    def other(uv: F64 = UV, lod: F64 = clamped, **more: object) -> F64:
        return texture_2d(LEVELS, uv, exact(lod), EXACT, **more).middle  # type: ignore[arg-type]

    assert outside(got, other()) == 0
    # Half a texel of level 0 is a quarter of one of level 1, whose noise is fainter too: not every look-up can tell.
    for wrong in (other(UV + [0.5 / 32, 0]), other(UV - [0, 0.5 / 16]), other(UV[:, ::-1]), other(lod=clamped + 1)):
        assert outside(got, wrong) > 0.6
    assert outside(got, other(filter=Filter(levels="none"))) > 0.6
    assert outside(got, other(filter=Filter("nearest", "linear", "nearest"))) > 0.6
    beyond = ((UV < 0) | (UV > 1)).any(axis=-1)
    for wrap in ("clamp", "mirror"):
        mine = Interval(got.low[beyond], got.high[beyond])
        assert outside(mine, other(wrap=(wrap, wrap))[beyond]) > 0.6


def test_wrong_cubes_are_outside() -> None:
    """Faces swapped, turned, mirrored; a seam; the level of one face taken on another."""
    got = texture_cube(FACES, DIRS, given_detail(np.zeros(len(DIRS)), LOW_CUBE), LOW_CUBE)

    def other(levels: list[F64], dirs: F64 = DIRS) -> F64:
        return texture_cube(levels, dirs, exact(np.zeros(len(dirs))), EXACT).middle

    assert outside(got, other(FACES)) == 0
    assert outside(got, other([FACES[0][[1, 0, 3, 2, 5, 4]]])) > 0.8
    assert outside(got, other([FACES[0][[0, 1, 2, 3, 5, 4]]])) > 0.25
    assert outside(got, other([FACES[0][:, :, ::-1]])) > 0.8
    assert outside(got, other([FACES[0].transpose(0, 2, 1, 3)])) > 0.8
    # A tenth of a texel inside the edge, where half of the neighbour's texel is mixed in: not by a face alone.
    near = np.stack(np.broadcast_arrays(1.0, np.linspace(-0.9, 0.9, 200), 1 - 0.1 / 8), axis=-1)
    got = texture_cube(FACES, near, given_detail(np.zeros(200), LOW_CUBE), LOW_CUBE)
    face, s, t = cube.face_of(near)
    assert (face == 0).all()
    alone = texture_2d([FACES[0][0]], np.stack([s, t], -1), exact(np.zeros(200)), EXACT, wrap=("clamp", "clamp"))
    assert outside(got, alone.middle) > 0.6
    assert outside(got, other(FACES, near)) == 0


def test_not_a_number_is_never_inside() -> None:
    got = texture_2d(LEVELS, UV[:2], exact([0.0, 1.0]), LOW_2D)
    assert np.isinf(got.excess(np.full((2, 2), np.nan))).all()
