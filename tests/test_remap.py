"""Lat-long pictures in other layouts by their symmetries: the same radiance as look-ups one by one."""

from __future__ import annotations

import numpy as np
import pytest

from glbump.maps import remap
from glbump.maps.convert import convert
from glbump.maps.layout import CUBE, LATLONG, LAYOUTS, ORTHOGRAPHIC, EnvironmentMap, Layout, sample, texel_dirs
from glbump.maps.overlap import Grid

ROUNDING = 4e-7
"""Weights and sums of four values up to 1 in float32, against float64: four roundings of 6e-8, and their like."""


def noise(width: int, height: int) -> EnvironmentMap:
    return EnvironmentMap(LATLONG, np.random.default_rng(4).random((1, height, width, 3), np.float32))


def one_by_one(environment: EnvironmentMap, target: Grid) -> np.ndarray:
    return sample(environment, texel_dirs(target.layout, target.size, target.scale, target.offset))


@pytest.mark.parametrize("layout", LAYOUTS.values(), ids=str)
@pytest.mark.parametrize("size", [(64, 32), (92, 50), (516, 40)], ids=str)
def test_it_is_what_look_ups_give(layout: Layout, size: tuple[int, int]) -> None:
    environment, target = noise(*size), Grid.by_size(layout, 36)
    got = remap.from_latlong(environment.pixels[0], target)
    assert np.abs(got - one_by_one(environment, target)).max() < ROUNDING


def test_blocks_meet() -> None:
    environment, target = noise(256, 128), Grid.by_size(CUBE, 2 * remap.BLOCK + 62)
    got = remap.from_latlong(environment.pixels[0], target)
    assert np.abs(got - one_by_one(environment, target)).max() < ROUNDING


def test_samples_on_the_border_are_where_they_are() -> None:
    environment, target = noise(64, 32), Grid.by_size(CUBE, 16, border=True)
    got = remap.from_latlong(environment.pixels[0], target)
    assert np.abs(got - one_by_one(environment, target)).max() < ROUNDING
    # Half a texel off is another picture.
    assert np.abs(got - one_by_one(environment, Grid.by_size(CUBE, 16))).max() > 0.1


def test_a_cubes_quadrants_are_of_two_kinds() -> None:
    assert sorted(map(len, remap.kinds(CUBE, True))) == [8, 16]
    assert [len(kind) for kind in remap.kinds(ORTHOGRAPHIC, True)] == [4]


@pytest.mark.parametrize("layout", LAYOUTS.values(), ids=str)
def test_every_quadrant_is_of_one_kind(layout: Layout) -> None:
    quadrants = [(i.quadrant.tile, i.quadrant.right, i.quadrant.down) for k in remap.kinds(layout, False) for i in k]
    assert len(quadrants) == len(set(quadrants)) == 4 * layout.tiles


def test_what_has_no_quadrants_or_no_symmetries_is_left_to_others() -> None:
    source = Grid.by_size(LATLONG, 32)
    assert remap.serves(source, Grid.by_size(CUBE, 16))
    assert not remap.serves(source, Grid.by_size(CUBE, 15))
    assert not remap.serves(Grid(LATLONG, (66, 32)), Grid.by_size(CUBE, 16))
    assert not remap.serves(Grid(LATLONG, (64, 31)), Grid.by_size(CUBE, 16))
    assert not remap.serves(Grid.by_size(LATLONG, 32, border=True), Grid.by_size(CUBE, 16))
    assert not remap.serves(Grid.by_size(CUBE, 16), Grid.by_size(CUBE, 16))
    # So small that most of the picture would be gathered for nothing.
    assert not remap.serves(Grid.by_size(LATLONG, 512), Grid.by_size(CUBE, 16))


def test_immense_light_is_finite() -> None:
    """Its square is not; what decides whether all is finite must not take it for infinite, nor warn."""
    light = EnvironmentMap(LATLONG, np.full((1, 8, 16, 3), 1e30, np.float32))
    assert np.allclose(convert(light, CUBE, 8, "bilinear").pixels, 1e30, rtol=ROUNDING)
