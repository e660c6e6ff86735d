"""Texels beside poles: light and constants kept, nothing beyond what there is, and no step across."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from benchmarks.layouts import smooth
from glbump.maps import pyramid
from glbump.maps.continuity import seam_step
from glbump.maps.layout import (
    ANGULAR,
    LATLONG,
    MIRROR_BALL,
    EnvironmentMap,
    Layout,
    beside_rim,
    completed,
    inside,
    texel_dirs,
)
from glbump.maps.levels import environment_levels, texel_angles
from glbump.maps.poles import rows_at_poles, texels_at_rim

NOISE = np.random.default_rng(5)
ROUND = (ANGULAR, MIRROR_BALL)


def rim(layout: Layout, size: int, texels: Any) -> tuple[Any, Any, Any]:
    """Of texels of twice the size plain means, the same mended, and their steradians."""
    both = np.concatenate([texels, texel_dirs(layout, (2 * size, 2 * size))], axis=-1)
    angle = np.broadcast_to(texel_angles(EnvironmentMap(layout, texels), (2 * size, 2 * size)), texels.shape[:3])
    parts = angle.reshape(1, size, 2, size, 2)
    means = pyramid.merge(both, parts)
    steradians = parts.sum(axis=(2, 4))
    return means, texels_at_rim(means[..., :3], layout, steradians, means[..., 3:]), steradians


def noise(shape: Any) -> Any:
    """With suns of 1e4 here and there."""
    return (NOISE.random(shape) + 1e4 * (NOISE.random(shape) > 0.99)).astype(np.float32)


@pytest.mark.parametrize("size", [2, 3, 16, 27, 64])
@pytest.mark.parametrize("layout", ROUND, ids=str)
def test_a_rim_keeps_its_light_its_range_and_what_is_within(layout: Layout, size: int) -> None:
    means, mended, steradians = rim(layout, size, noise((1, 2 * size, 2 * size, 3)))
    light = [(steradians[..., None] * level).sum(axis=(0, 1, 2), dtype=float) for level in (means[..., :3], mended)]
    # The rounding of float32, of suns.
    assert light[1] == pytest.approx(light[0], rel=1e-6)
    at = beside_rim(size)
    assert np.array_equal(mended[0, ~at], means[0, ~at, :3].astype(np.float32))
    most = means[0, at, :3].max(axis=0)
    assert (mended[0, at] <= most * (1 + 1e-6)).all()
    assert mended.min() >= 0
    assert size == 2 or np.abs(mended[0, at] - means[0, at, :3]).max() > 0.01
    alike = rim(layout, size, np.full((1, 2 * size, 2 * size, 3), 0.3, np.float32))[1]
    assert (alike == np.float32(0.3)).all()


@pytest.mark.parametrize("size", [16, 27, 64])
def test_a_rims_texel_holds_what_an_even_change_has_in_its_middle(size: int) -> None:
    """Light that is the direction itself: the means are of texels' outer parts, up to a quarter of a texel off."""
    means, mended, _ = rim(ANGULAR, size, texel_dirs(ANGULAR, (2 * size, 2 * size)).astype(np.float32))
    at, middle = beside_rim(size), texel_dirs(ANGULAR, (size, size))
    texel = 2 * np.pi / size
    plain, got = (np.abs(level - middle)[0, at, :2].max() / texel for level in (means[..., :3], mended))
    assert plain > 0.1
    # What is left are texels' widths around the pole, and what is not even.
    assert got < 0.02


def test_rows_keep_their_light_and_their_range() -> None:
    for shape in ((1, 2, 5, 3), (1, 16, 32, 3), (1, 33, 40, 1)):
        pixels = noise(shape)
        got = rows_at_poles(pixels)
        assert got.sum(axis=2, dtype=float) == pytest.approx(pixels.sum(axis=2, dtype=float), rel=1e-6)
        assert np.array_equal(got[:, 1:-1], pixels[:, 1:-1])
        assert got.min() >= 0
        assert got.max() <= pixels.max()
        assert np.abs(got[:, 0] - pixels[:, 0]).max() > 0.01
    one = noise((1, 1, 8, 3))
    assert np.array_equal(rows_at_poles(one), one)
    assert (rows_at_poles(np.full((1, 4, 8, 3), 0.3, np.float32)) == np.float32(0.3)).all()


def worst_step(environment: EnvironmentMap) -> float:
    """Across the edges of levels of 16 texels and more that are made from level 0."""
    levels = [level for level in environment_levels(environment)[1:] if level.shape[1] >= 16]
    return max(seam_step(EnvironmentMap(environment.layout, level)) for level in levels)


# Of plain means, measured: 3.08 and 3.13, 1.51 and 1.57, 1.16 and 1.17.
PLAIN = {LATLONG: 2.9, ANGULAR: 1.45, MIRROR_BALL: 1.12}


@pytest.mark.parametrize("layout", PLAIN, ids=str)
@pytest.mark.parametrize("size", [256, 150])
def test_no_level_has_a_step_across_a_pole_and_plain_means_have(
    layout: Layout, size: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    environment = smooth(layout, size)
    assert worst_step(environment) < 1.05
    monkeypatch.setattr("glbump.maps.levels.rows_at_poles", lambda level: level)
    monkeypatch.setattr("glbump.maps.levels.texels_at_rim", lambda level, *_: level.astype(np.float32))
    assert worst_step(environment) > PLAIN[layout]


@pytest.mark.parametrize("size", [1, 2, 5, 16, 63])
def test_past_a_mirror_balls_rim_is_the_mean_of_all_round_it(size: int) -> None:
    pixels = noise((1, size, size, 3))
    got, shown = completed(MIRROR_BALL, pixels), inside(MIRROR_BALL, (size, size))
    assert np.array_equal(got[0, shown], pixels[0, shown])
    want = pixels[0, shown & beside_rim(size)].mean(axis=0, dtype=float)
    assert got[0, ~shown] == pytest.approx(np.broadcast_to(want, got[0, ~shown].shape), rel=1e-6)
    # Exactly one direction: no rounding's way to some texel of the rim.
    past = texel_dirs(MIRROR_BALL, (size, size))[0, ~shown]
    assert (past[:, :2] == 0).all()
    assert (past[:, 2] == -1).all()
