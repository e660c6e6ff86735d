"""Mip chains: neutral elements, means, and the weights of odd sizes."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from glbump.maps.pyramid import chain, halve, slope_moments


@pytest.mark.parametrize("shape", [(1, 1), (1, 7), (5, 1), (2, 2), (7, 7), (16, 8), (13, 6), (31, 33)])
def test_sizes_halve_down_to_one_and_a_constant_stays(shape: tuple[int, int]) -> None:
    levels = chain(np.full((*shape, 3), 0.3, np.float32))
    assert levels[0].shape == (*shape, 3)
    for fine, coarse in pairwise(levels):
        assert coarse.shape[:2] == tuple(max(1, n // 2) for n in fine.shape[:2])
        assert coarse.dtype == np.float32
        # One rounding to float32.
        assert np.abs(coarse - np.float32(0.3)).max() < 3e-8
    assert levels[-1].shape[:2] == (1, 1)


def test_even_sizes_are_plain_averages() -> None:
    # Small integers: every sum and every quarter is exact in float32.
    pixels = np.random.default_rng(0).integers(0, 1000, size=(8, 12, 2)).astype(np.float32)
    blocks = pixels.reshape(4, 2, 6, 2, 2).mean(axis=(1, 3))
    assert np.array_equal(halve(pixels), blocks)
    assert halve(pixels).mean(dtype=np.float64) == pixels.mean(dtype=np.float64)


def test_odd_sizes_weigh_each_texel_by_the_length_it_covers() -> None:
    got = np.stack([halve(np.eye(7)[k].reshape(1, 7, 1))[0, :, 0] for k in range(7)], axis=1)
    # Three texels of length 7/3 over seven of length 1.
    wanted = np.array([[3, 3, 1, 0, 0, 0, 0], [0, 0, 2, 3, 2, 0, 0], [0, 0, 0, 0, 1, 3, 3]]) / 7
    assert np.abs(got - wanted).max() < 1e-7
    # All the way down every texel of the seven counts alike; drivers read the middle one alone.
    last = [chain(np.eye(7, dtype=np.float32)[k].reshape(1, 7, 1))[-1].item() for k in range(7)]
    assert last == pytest.approx([1 / 7] * 7, rel=1e-6)


@pytest.mark.parametrize("shape", [(7, 5), (11, 3), (64, 1), (127, 255)])
def test_the_mean_is_kept(shape: tuple[int, int]) -> None:
    pixels = np.random.default_rng(1).uniform(size=(*shape, 3)).astype(np.float32)
    mean = pixels.mean(axis=(0, 1), dtype=np.float64)
    for level in chain(pixels):
        assert np.abs(level.mean(axis=(0, 1), dtype=np.float64) - mean).max() < 3e-8  # rounding of the level


def test_rounding_does_not_pile_up_from_level_to_level() -> None:
    """Sums run in float64 through the whole chain: the last level of a bright picture is its rounded mean."""
    pixels = np.random.default_rng(2).uniform(900, 1000, size=(256, 256, 1)).astype(np.float32)
    assert chain(pixels)[-1].item() == np.float32(pixels.mean(dtype=np.float64))


def test_leading_axes_are_faces() -> None:
    faces = np.random.default_rng(3).uniform(size=(6, 8, 8, 3)).astype(np.float32)
    assert np.array_equal(halve(faces), np.stack([halve(face) for face in faces]))


# ------------------------------------------------------------ second moments of slopes


def _covariance(slopes: np.ndarray) -> np.ndarray:
    """uu, uv, vv of (H, W, 2), in float64, about their mean."""
    off = slopes.astype(np.float64) - slopes.mean(axis=(0, 1), dtype=np.float64)
    u, v = off[..., 0], off[..., 1]
    return np.array([(u * u).mean(), (u * v).mean(), (v * v).mean()])


@pytest.mark.parametrize("shape", [(1, 1), (64, 64), (7, 7), (13, 6), (1, 31), (33, 127)])
def test_the_last_level_has_the_moments_of_all_slopes(shape: tuple[int, int]) -> None:
    slopes = np.random.default_rng(4).normal(size=(*shape, 2)) * [1.0, 0.3] + [0.2, -0.1]
    slopes[..., 1] += 0.5 * slopes[..., 0]
    levels = slope_moments(slopes)
    means, moments = levels[-1]
    # Each rounded once, to float32.
    assert means.reshape(2) == pytest.approx(slopes.mean(axis=(0, 1)), rel=1e-6, abs=1e-7)
    assert moments.reshape(3) == pytest.approx(_covariance(slopes), rel=1e-6, abs=1e-7)
    assert [m.shape for m, _ in levels] == [m.shape for m in chain(slopes)]
    assert all(np.array_equal(m, level) for (m, _), level in zip(levels, chain(slopes), strict=True))
    assert not levels[0][1].any()


def test_moments_of_a_level_are_those_of_its_blocks() -> None:
    slopes = np.random.default_rng(5).normal(size=(24, 40, 2))
    _, moments = slope_moments(slopes)[3]
    blocks = slopes.reshape(3, 8, 5, 8, 2).swapaxes(1, 2)
    wanted = np.array([[_covariance(block) for block in row] for row in blocks])
    assert np.abs(moments - wanted).max() < 1e-6
    # Where blocks overlap, a mean of neighbours' squares is another thing.
    assert np.abs(np.roll(moments, 1, axis=0) - wanted).max() > 0.05


@pytest.mark.parametrize("shape", [(16, 16), (7, 9)])
def test_the_moments_of_a_linear_slope_are_those_of_its_steps(shape: tuple[int, int]) -> None:
    """Slopes 0, 1 .. n - 1 have the variance (n^2 - 1) / 12, at any offset: nothing cancels."""
    for offset in (0.0, 1e6):
        v, u = np.mgrid[: shape[0], : shape[1]] + offset
        _, moments = slope_moments(np.dstack([u, v]))[-1]
        n = np.array(shape[::-1])
        assert moments[0, 0, [0, 2]] == pytest.approx((n * n - 1) / 12, rel=1e-6)
        assert abs(moments[0, 0, 1]) < 1e-6
        # A mean of squares kept in float32 has lost it.
        squares = np.float32(np.mean(u * u)) - np.float32(np.mean(u)) ** 2
        assert offset == 0 or abs(squares - moments[0, 0, 0]) > 0.5 * moments[0, 0, 0]


def test_moments_are_covariances_and_even_slopes_have_none() -> None:
    slopes = np.random.default_rng(6).normal(size=(37, 53, 2)).astype(np.float32) * 1e-3 + 2
    for _, m in slope_moments(slopes)[1:]:
        # Each of three is rounded to float32.
        assert (m[..., 0] * m[..., 2] >= m[..., 1] ** 2 * (1 - 4e-7)).all()
        assert (m[..., [0, 2]] >= 0).all()
    for _, m in slope_moments(np.full((16, 16, 2), 0.3)):
        assert not m.any()
    # Thirds are not floats: at odd sizes the mean itself is rounded, to 2^-53.
    assert max(m.max() for _, m in slope_moments(np.full((7, 5, 2), 0.3))) < 1e-30


def test_levels_end_where_told() -> None:
    assert len(slope_moments(np.zeros((64, 32, 2)), 2)) == len(chain(np.zeros((64, 32, 2)), 2)) == 3
