"""Heights and normals as slopes: waves with known derivatives, neutral elements, signs, and what is refused."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from glbump.errors import ImageError
from glbump.maps.heights import STEEPEST, slopes, slopes_of_normals


def centres(height: int, width: int) -> Any:
    """u, v of the texel centres: u right, v up, row 0 on top."""
    return np.meshgrid((np.arange(width) + 0.5) / width, 1 - (np.arange(height) + 0.5) / height)


@pytest.mark.parametrize(("k", "m"), [(1, 0), (0, 1), (3, 2), (4, -1)])
def test_plane_wave(k: int, m: int) -> None:
    """The slope of a wave is the wave a quarter on, times the known gain of central differences."""
    height, width = 48, 64
    u, v = centres(height, width)
    phase = 2 * np.pi * (k * u + m * v) + 0.3
    got = slopes(np.sin(phase))
    gain = np.sinc(2 * k / width), np.sinc(2 * m / height)
    wanted = np.stack([2 * np.pi * f * g * np.cos(phase) for f, g in zip((k, m), gain, strict=True)], axis=-1)
    assert np.abs(got - wanted).max() < 2e-6  # float32 of values up to 25
    # The sign of v and a picture read upside down are both seen.
    if m:
        assert np.abs(got[..., 1] + wanted[..., 1]).max() > 1
        assert np.abs(slopes(np.sin(phase)[::-1])[..., 1] - wanted[..., 1]).max() > 1


def test_slopes_are_second_order() -> None:
    errors = []
    for n in (32, 64):
        u, v = centres(n, n)
        got = slopes(np.sin(2 * np.pi * u) * np.cos(2 * np.pi * v))
        wanted = 2 * np.pi * np.cos(2 * np.pi * u) * np.cos(2 * np.pi * v)
        errors.append(np.abs(got[..., 0] - wanted).max())
    assert errors[0] / errors[1] == pytest.approx(4, rel=0.02)


def test_v_is_up() -> None:
    """Higher towards the top of the picture: dv > 0."""
    height = np.repeat(np.array([3.0, 2.0, 1.0, 0.0])[:, None], 4, axis=1)
    assert (slopes(height)[1:-1, :, 1] == 4).all()
    assert (slopes(height)[..., 0] == 0).all()
    assert (slopes(height.T)[:, 1:-1, 0] == -4).all()


def test_a_flat_field_has_no_slope() -> None:
    assert not slopes(np.full((5, 7), 0.37)).any()


@pytest.mark.parametrize("shape", [(1, 1), (1, 9), (9, 1), (2, 2)])
def test_small_pictures_are_defined(shape: tuple[int, int]) -> None:
    got = slopes(np.random.default_rng(0).uniform(size=shape))
    assert got.shape == (*shape, 2)
    for axis, n in ((0, shape[1]), (1, shape[0])):
        if n <= 2:
            assert not got[..., axis].any()
        else:
            assert got[..., axis].any()


def test_slopes_add_and_scale() -> None:
    rng = np.random.default_rng(1)
    a, b = rng.uniform(size=(2, 16, 24))
    assert np.allclose(slopes(a + b), slopes(a) + slopes(b), atol=1e-5)
    assert np.allclose(slopes(3 * a + 7), 3 * slopes(a), atol=1e-5)
    # Wrapping: a turned picture has turned slopes.
    assert np.array_equal(slopes(np.roll(a, (5, 7), (0, 1))), np.roll(slopes(a), (5, 7), (0, 1)))


def test_small_bumps_on_a_high_plateau_keep_their_digits() -> None:
    """In float32 differences of heights about 1000 would carry an error of 64 x 6e-5."""
    u, _ = centres(4, 64)
    height = np.sin(2 * np.pi * u)
    assert np.abs(slopes(1000 + height) - slopes(height)).max() < 1e-5


def test_normals_of_a_tilted_plane() -> None:
    for angle in (0.0, 0.3, -1.2):
        normals = np.broadcast_to([np.sin(angle), 0, np.cos(angle)], (3, 4, 3))
        assert slopes_of_normals(normals) == pytest.approx(np.broadcast_to([-np.tan(angle), 0], (3, 4, 2)), abs=1e-6)
        # Any length: filtering shortens normals.
        assert np.array_equal(slopes_of_normals(normals), slopes_of_normals(0.5 * normals))


def test_normals_made_from_slopes_give_them_back() -> None:
    given = slopes(np.random.default_rng(2).uniform(size=(8, 8)) * 0.1).astype(np.float64)
    normals = np.concatenate([-given, np.ones((8, 8, 1))], axis=-1)
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    assert slopes_of_normals(normals) == pytest.approx(given, abs=1e-6)
    flipped = normals * (1, -1, 1)
    assert np.array_equal(slopes_of_normals(flipped, flip_y=True), slopes_of_normals(normals))
    assert not np.allclose(slopes_of_normals(flipped), slopes_of_normals(normals))


@pytest.mark.parametrize(
    "normal", [(0, 0, 0), (0, 0, -1), (1, 0, 0), (0.1, 0, np.nan), (np.inf, 0, 1), (STEEPEST * 1.01, 0, 1)]
)
def test_normals_without_a_slope_are_counted_and_placed(normal: tuple[float, float, float]) -> None:
    normals = np.tile(np.array([0.0, 0.0, 1.0]), (6, 5, 1))
    normals[2, 3] = normals[4, 1] = normal
    with pytest.raises(ImageError, match="2 of 30 normals do not, the first in row 2, column 3") as caught:
        slopes_of_normals(normals)
    assert "\n" not in str(caught.value)


def test_the_steepest_slope_is_allowed() -> None:
    assert slopes_of_normals(np.array([[[-STEEPEST, STEEPEST, 1.0]]]))[0, 0].tolist() == [STEEPEST, -STEEPEST]
