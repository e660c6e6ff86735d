"""Area conversion: laws of light kept, constants kept, places right, for every layout, both ways."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from glbump.errors import ImageError
from glbump.maps import arcs, area
from glbump.maps.arcs import Arcs, Cells
from glbump.maps.area import Shares, area_means, from_latlong, latlong_to_latlong, solid_angles, to_latlong
from glbump.maps.cube import solid_angles as cube_solid_angles
from glbump.maps.layout import CUBE, HEMICUBE, LATLONG, LAYOUTS, OCTAHEDRAL, ORTHOGRAPHIC, Layout, inside, latlong_uv
from glbump.maps.overlap import Grid

OTHERS = [layout for layout in LAYOUTS.values() if layout is not LATLONG]
BLACK = (0.0, 0.0, 0.0)

# Pictures come out as float32: each value is off by 6e-8 of itself at most, and so is their sum.
ROUNDING = 1.2e-7


def total(pixels: Any, grid: Grid) -> float:
    """Radiance over directions, all channels."""
    return float((pixels.reshape(*grid.shape, -1).astype(np.float64) * solid_angles(grid)[..., None]).sum())


def upper(pixels: Any) -> Any:
    """A lat-long picture with what lies below the horizon black; of an even number of rows."""
    result = pixels.copy()
    result[len(pixels) // 2 :] = 0
    return result


def suns(height: int) -> Iterator[tuple[int, int]]:
    """Row and column of a bright texel: poles, seam, a cube's edge and corner, the horizon, and anywhere."""
    width = 2 * height
    rng = np.random.default_rng(height)
    yield from ((0, 0), (0, width // 3), (height - 1, width - 1), (height // 2, 0), (height // 2 - 1, width - 1))
    yield from (
        (height // 4, width // 2),
        (int(0.304 * height), width // 8),
        (height // 2, width // 8),
        (height // 2, 0),
    )
    yield from ((int(rng.integers(height)), int(rng.integers(width))) for _ in range(3))


def random_latlong(height: int, seed: int = 7) -> Any:
    return np.random.default_rng(seed).random((height, 2 * height, 3)).astype(np.float32)


@pytest.mark.parametrize("border", [False, True])
@pytest.mark.parametrize("size", [2, 3, 16, 33, 64])
@pytest.mark.parametrize("layout", OTHERS, ids=str)
def test_cells_cover_the_sphere_once(layout: Layout, size: int, border: bool) -> None:
    if layout is HEMICUBE and size < 4:
        pytest.skip("its tiles would be one texel high")
    angles = solid_angles(Grid.by_size(layout, size, border=border))
    assert angles.sum() == pytest.approx(4 * np.pi if layout.whole else 2 * np.pi, rel=1e-12)
    assert angles.min() > -1e-14


def test_a_cubes_solid_angles_are_the_known_ones() -> None:
    for border in (False, True):
        angles = solid_angles(Grid.by_size(CUBE, 33, border=border))
        assert np.abs(angles / cube_solid_angles(33, border=border) - 1).max() < 1e-11


def test_texels_of_discs_have_their_solid_angles() -> None:
    """On the orthographic disc a texel's solid angle is its area over the cosine, to the second order."""
    grid = Grid.by_size(ORTHOGRAPHIC, 256)
    s = (np.arange(256) + 0.5) / 128 - 1
    square = s[None, :] ** 2 + s[:, None] ** 2
    known = (2 / 256) ** 2 / np.sqrt(np.maximum(1 - square, 1e-9))
    middle = square < 0.5
    assert np.abs(solid_angles(grid)[0] / known - 1)[middle].max() < 1e-3


@pytest.mark.parametrize("layout", OTHERS, ids=str)
@pytest.mark.parametrize(
    ("height", "size", "border"), [(16, 16, False), (15, 9, True), (128, 8, False), (8, 128, False)]
)
def test_a_constant_stays_one(layout: Layout, height: int, size: int, border: bool) -> None:
    source, target = Grid.by_size(LATLONG, height), Grid.by_size(layout, size, border=border)
    ones = np.ones((height, 2 * height, 3), np.float32)
    assert np.abs(from_latlong(ones, source, target) - 1).max() < 1e-6
    back = to_latlong(np.ones((*target.shape, 3), np.float32), target, source)
    assert np.abs(back - 1).max() < 1e-6


@pytest.mark.parametrize("layout", OTHERS, ids=str)
@pytest.mark.parametrize(("height", "size"), [(128, 8), (64, 16), (30, 31), (16, 64), (8, 128)])
def test_the_light_of_one_bright_texel_is_kept_and_stays_near(layout: Layout, height: int, size: int) -> None:
    """Ratios 1/16 to 16; also that no light gets away along the sun's meridian or around a pole."""
    source, target = Grid.by_size(LATLONG, height), Grid.by_size(layout, size)
    dirs = target_dirs(target)
    for row, column in suns(height):
        pixels = np.zeros((height, 2 * height, 1), np.float32)
        pixels[row, column] = 1e5
        found = from_latlong(pixels, source, target)
        held = total(pixels if layout.whole else upper(pixels), source)
        assert total(found, target) == pytest.approx(held, rel=ROUNDING, abs=1e-9)
        sun = (2 * np.pi * ((column + 0.5) / (2 * height) - 0.5), np.pi * ((row + 0.5) / height))
        to_sun = np.array([np.sin(sun[1]) * np.sin(sun[0]), np.cos(sun[1]), -np.sin(sun[1]) * np.cos(sun[0])])
        angle = np.arccos(np.clip(dirs @ to_sun, -1, 1))
        # Half the diagonals of a source texel and of a target cell, which the layouts stretch to five times their mean.
        reach = np.pi / height + 5 * np.sqrt(4 * np.pi / np.prod(target.shape))
        far = (angle > reach) & inside(layout, target.size)
        # Rounding: 1e-16 of the sun over slivers of cells at the rims of discs, measured 1.3e-10 of it.
        assert np.abs(found[far]).max(initial=0.0) < 1e-9 * 1e5


def target_dirs(grid: Grid) -> Any:
    return np.stack(
        [grid.centres(tile, slice(0, grid.size[1]), slice(0, grid.size[0])) for tile in range(grid.shape[0])]
    )


@pytest.mark.parametrize("layout", OTHERS, ids=str)
@pytest.mark.parametrize(("size", "height"), [(64, 4), (32, 16), (15, 20), (8, 64)])
def test_the_light_of_one_bright_texel_is_kept_on_the_way_back(layout: Layout, size: int, height: int) -> None:
    source, target = Grid.by_size(layout, size), Grid.by_size(LATLONG, height)
    rng = np.random.default_rng(size)
    rows, columns = np.nonzero(inside(layout, source.size))
    for k in rng.integers(len(rows), size=6):
        pixels = np.zeros((*source.shape, 1), np.float32)
        pixels[rng.integers(layout.tiles), rows[k], columns[k]] = 1e5
        found = to_latlong(pixels, source, target, (0.0,))
        assert total(found, target) == pytest.approx(total(pixels, source), rel=ROUNDING)


@pytest.mark.parametrize("layout", OTHERS, ids=str)
@pytest.mark.parametrize("border", [False, True])
def test_back_is_the_adjoint_of_there(layout: Layout, border: bool) -> None:
    """<there(x), y> = <x, back(y)>, each with its solid angles; samples of one direction count together."""
    latlong, other = Grid.by_size(LATLONG, 24), Grid.by_size(layout, 12, border=border)
    x = upper(random_latlong(24)) if not layout.whole else random_latlong(24)
    y = np.random.default_rng(3).random((*other.shape, 3)).astype(np.float32)
    if border:
        area.weld(y, solid_angles(other), other)
    there = from_latlong(x, latlong, other)
    back = to_latlong(y, other, latlong, BLACK)
    assert total(there * y, other) == pytest.approx(total(x * back, latlong), rel=1e-6)


def supersampled(pixels: Any, target: Grid, k: int = 16) -> tuple[Any, Any]:
    """Means over target texels of the nearest source texel in k x k directions of each, weighted by their solid angle;
    and which texels lie inside the disc as a whole. Independent of arcs: Jacobians by differences."""
    fine = Grid(target.layout, (target.size[0] * k, target.size[1] * k))
    tiles, height, width = fine.shape
    s, t = (np.arange(width) + 0.5) / width, (np.arange(height) + 0.5) / height
    tile = np.arange(tiles)[:, None, None] + np.zeros((1, height, width), np.intp)
    h = 1e-6
    dirs, right, left, down, up = (
        target.layout.dir(tile, s[None, None, :] + ds + 0.0 * tile, t[None, :, None] + dt + 0.0 * tile)
        for ds, dt in ((0, 0), (h, 0), (-h, 0), (0, h), (0, -h))
    )
    weight = np.linalg.norm(np.cross(right - left, down - up), axis=-1)
    uv = latlong_uv(dirs)
    i = np.minimum((uv[..., 1] * pixels.shape[0]).astype(int), pixels.shape[0] - 1)
    j = (uv[..., 0] * pixels.shape[1]).astype(int) % pixels.shape[1]
    box = (tiles, target.size[1], k, target.size[0], k)
    shown = np.broadcast_to(inside(target.layout, fine.size), fine.shape).reshape(box).all((2, 4))
    # Past a mirror ball's rim are no solid angles.
    whole = np.where(shown, weight.reshape(box).sum((2, 4)), np.inf)
    return (pixels[i, j] * weight[..., None]).reshape(*box, 3).sum((2, 4)) / whole[..., None], shown


def off(pixels: Any, target: Grid, found: Any) -> float:
    mean, shown = supersampled(pixels, target)
    return float(np.sqrt(np.mean((found - mean)[shown] ** 2)))


# 16 x 16 samples of values 0..1: the rms of what they miss at the texels' edges, measured 0.002 to 0.006.
SUPERSAMPLED = 0.012


@pytest.mark.parametrize("layout", OTHERS, ids=str)
@pytest.mark.parametrize(("height", "size"), [(32, 16), (16, 32)])
def test_agrees_with_supersampling(layout: Layout, height: int, size: int) -> None:
    pixels = random_latlong(height)
    source, target = Grid.by_size(LATLONG, height), Grid.by_size(layout, size)
    assert off(pixels, target, from_latlong(pixels, source, target)) < SUPERSAMPLED
    slipped = Grid(LATLONG, source.size, (1.0, 1.0), (0.5 / source.size[0], 0.0))
    assert off(pixels, target, from_latlong(pixels, slipped, target)) > 2 * SUPERSAMPLED


def test_arcs_that_are_not_cut_at_meridians_are_found_out(monkeypatch: pytest.MonkeyPatch) -> None:
    def uncut(part: Arcs, cells: Cells) -> Any:
        column = np.floor(part.x0).astype(np.intp)
        return arcs._Spans(np.arange(len(column)), column, part.x0, part.x1, part.half0, part.half1)

    monkeypatch.setattr(arcs, "_by_columns", uncut)
    pixels, source, target = random_latlong(32), Grid.by_size(LATLONG, 32), Grid.by_size(CUBE, 16)
    assert off(pixels, target, from_latlong(pixels, source, target)) > 2 * SUPERSAMPLED


def test_a_pole_inside_a_cell_needs_its_term(monkeypatch: pytest.MonkeyPatch) -> None:
    """An odd cube has the poles inside cells."""
    monkeypatch.setattr(np, "rint", lambda x: np.zeros_like(x))
    assert solid_angles(Grid.by_size(CUBE, 3)).sum() != pytest.approx(4 * np.pi, rel=1e-3)


@pytest.mark.parametrize("size", [4, 8, 15])
@pytest.mark.parametrize("layout", [layout for layout in OTHERS if not layout.disc], ids=str)
def test_samples_of_one_direction_are_equal(layout: Layout, size: int) -> None:
    source, target = Grid.by_size(LATLONG, 32), Grid.by_size(layout, size, border=True)
    pixels = random_latlong(32)
    found = from_latlong(pixels, source, target)
    dirs = target_dirs(target)
    flat, values = dirs.reshape(-1, 3), found.reshape(-1, 3)
    same = np.abs(flat[:, None] - flat[None]).max(axis=-1) < 1e-9
    assert same.sum() > len(flat)
    assert np.abs(values[:, None] - values[None])[same].max() == 0
    held = total(pixels if layout.whole else upper(pixels), source)
    assert total(found, target) == pytest.approx(held, rel=ROUNDING)


@pytest.mark.parametrize("source", [CUBE, LATLONG], ids=str)
def test_latlong_on_the_border_has_one_value_on_a_pole_and_at_the_seam(source: Layout) -> None:
    grid, target = Grid.by_size(source, 16), Grid.by_size(LATLONG, 9, border=True)
    pixels = np.random.default_rng(2).random((*grid.shape, 3)).astype(np.float32)
    found = area_means(pixels, grid, target)
    assert found.shape == (1, 9, 18, 3)
    assert (found[0, 0] == found[0, 0, 0]).all()
    assert (found[0, -1] == found[0, -1, 0]).all()
    assert (found[0, :, 0] == found[0, :, -1]).all()
    assert total(found, target) == pytest.approx(total(pixels, grid), rel=ROUNDING)


@pytest.mark.parametrize("layout", [layout for layout in OTHERS if layout.disc], ids=str)
def test_texels_outside_a_disc_show_what_lies_next_to_them(layout: Layout) -> None:
    source, target = Grid.by_size(LATLONG, 32), Grid.by_size(layout, 16)
    found = from_latlong(random_latlong(32) + 1, source, target)
    assert found.min() >= 1
    assert (solid_angles(target) == 0).any()


def test_blocks_of_cells_outside_a_disc_hold_no_light() -> None:
    """Discs of 448 and more have blocks in their corners that the rim does not reach."""
    picture = np.ones((1, 448, 448, 1), np.float32)
    back = to_latlong(picture, Grid.by_size(ORTHOGRAPHIC, 448), Grid.by_size(LATLONG, 8))
    assert np.abs(back - 1).max() < 2 * ROUNDING


@pytest.mark.parametrize(
    ("old", "new"), [((16, 16), (16, 16)), ((32, 64), (8, 5)), ((7, 9), (40, 64)), ((64, 128), (4, 8))]
)
def test_latlong_to_latlong_is_exact(old: tuple[int, int], new: tuple[int, int]) -> None:
    source, target = Grid(LATLONG, old[::-1]), Grid(LATLONG, new[::-1])
    pixels = np.random.default_rng(4).random((*old, 3)).astype(np.float32)
    found = latlong_to_latlong(pixels, source, target)
    if old == new:
        assert np.array_equal(found, pixels)
    assert total(found, target) == pytest.approx(total(pixels, source), rel=ROUNDING)
    # A quarter of a turn is a quarter of a turn at any size that four divides.
    if old[1] % 4 == 0 and new[1] % 4 == 0:
        turned = latlong_to_latlong(np.roll(pixels, old[1] // 4, axis=1), source, target)
        assert np.abs(turned - np.roll(found, new[1] // 4, axis=1)).max() < 1e-6
    offset = Grid(LATLONG, old[::-1], offset=(0.25, 0.0))
    if old[1] % 4 == 0:
        rolled = latlong_to_latlong(np.roll(pixels, old[1] // 4, axis=1), offset, target)
        assert np.abs(rolled - found).max() < 1e-6


@pytest.mark.parametrize("layout", OTHERS, ids=str)
def test_a_band_about_the_horizon_goes_on_to_the_poles(layout: Layout) -> None:
    """A lat-long picture wider than 2:1: 32 x 8 texels, whose first and last row reach the poles."""
    source, target = Grid(LATLONG, (32, 8), (1.0, 2.0), (0.0, -0.5)), Grid.by_size(layout, 16)
    pixels = np.random.default_rng(8).random((8, 32, 3)).astype(np.float32)
    assert solid_angles(source).sum() == pytest.approx(4 * np.pi)
    found = from_latlong(pixels, source, target)
    assert total(found, target) == pytest.approx(total(pixels if layout.whole else upper(pixels), source), rel=ROUNDING)
    rows = np.repeat(pixels, [5, 1, 1, 1, 1, 1, 1, 5], axis=0)
    assert np.abs(found - from_latlong(rows, Grid(LATLONG, (32, 16)), target)).max() < 1e-6


def test_shares_of_a_line() -> None:
    shares = Shares(np.array([0.0, 1.0, 2.0]), np.array([0.5, 1.5, 2.0]))
    assert shares.means(np.array([2.0, 4.0]), 0, slice(0, 2)).tolist() == [3.0, 4.0]


@pytest.mark.parametrize("layout", [CUBE, HEMICUBE, OCTAHEDRAL], ids=str)
def test_within_a_layout_whole_ratios_are_exact(layout: Layout) -> None:
    fine, coarse = Grid.by_size(layout, 24), Grid.by_size(layout, 8)
    pixels = np.random.default_rng(5).random((*fine.shape, 3)).astype(np.float32)
    found = area_means(pixels, fine, coarse)
    assert total(found, coarse) == pytest.approx(total(pixels, fine), rel=ROUNDING)
    assert np.abs(area_means(found, coarse, fine)[:, ::3, ::3] - found).max() == 0
    assert total(area_means(found, coarse, fine), fine) == pytest.approx(total(found, coarse), rel=ROUNDING)
    assert np.array_equal(area_means(pixels, fine, fine), pixels)


@pytest.mark.parametrize("source", OTHERS, ids=str)
@pytest.mark.parametrize("target", [CUBE, OCTAHEDRAL, ORTHOGRAPHIC], ids=str)
def test_between_two_others_light_and_constants_are_kept(source: Layout, target: Layout) -> None:
    old, new = Grid.by_size(source, 20), Grid.by_size(target, 12)
    assert np.abs(area_means(np.ones((*old.shape, 3), np.float32), old, new) - 1).max() < 1e-6
    pixels = np.zeros((*old.shape, 3), np.float32)
    pixels[0, 5, 9] = 1e5
    found = area_means(pixels, old, new, BLACK)
    if target.whole or source is not CUBE:
        wanted = total(pixels, old)
        assert total(found, new) == pytest.approx(wanted, rel=4 * ROUNDING)


def test_below_the_horizon_is_the_mirrored_side_or_a_colour() -> None:
    source, target = Grid.by_size(HEMICUBE, 8), Grid.by_size(LATLONG, 9)
    pixels = np.random.default_rng(6).random((*source.shape, 3)).astype(np.float32)
    mirrored = to_latlong(pixels, source, target)
    assert np.abs(mirrored - mirrored[::-1]).max() < 1e-6
    coloured = to_latlong(pixels, source, target, (1.0, 2.0, 3.0))
    assert np.abs(coloured[5:] - [1, 2, 3]).max() < 1e-6
    assert np.abs(coloured[:4] - mirrored[:4]).max() < 1e-6
    # The row on the horizon has half of each.
    assert np.abs(coloured[4] - (mirrored[4] + [1, 2, 3]) / 2).max() < 1e-6


def test_one_texel_is_no_tile() -> None:
    with pytest.raises(ImageError, match=r"a tile of a octahedral.*at least 2x2 texels; got 1x1"):
        Grid.by_size(OCTAHEDRAL, 1)
