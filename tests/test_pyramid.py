"""Mip chains: neutral elements, means, and the weights of odd sizes."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from glbump.maps.pyramid import chain, halve


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
