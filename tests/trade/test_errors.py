"""Figures of error: laws, known values, and how often bounds from a sample hold."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from glbump.errors import ImageError
from glbump.maps.angles import degrees_between
from glbump.maps.colour import linear_from_srgb
from glbump.trade.errors import FIGURES, errors, mean_squares, rmse_bounds

GREY = np.full((20, 30, 3), 0.5)


def shown(display: np.ndarray) -> np.ndarray:
    return np.asarray(linear_from_srgb(display))


def test_each_figure_has_its_text_and_what_it_cannot_see() -> None:
    got = errors(shown(GREY), shown(GREY), several=np.zeros((20, 30), bool))
    assert list(got) == list(FIGURES)
    for figure in FIGURES.values():
        assert figure.what
        assert figure.unit
        assert figure.blind


def test_equal_pictures_have_no_error() -> None:
    got = errors(shown(GREY), shown(GREY), several=np.ones((20, 30), bool))
    assert {name: value for name, value in got.items() if value} == {}
    assert got["psnr"] is None


def test_p999_sees_one_pixel_of_three_hundred_where_p99_does_not() -> None:
    other = GREY.copy()
    other[3, 4:6, 1] += 0.2  # of 600
    got = errors(shown(other), shown(GREY), perceptual=False)
    assert got["p99"] == 0
    assert got["p999"] == pytest.approx(0.2)
    assert got["max"] == pytest.approx(0.2)


def test_linear_figures_see_light_above_display_white() -> None:
    one, other = np.full((8, 8, 3), 4.0), np.full((8, 8, 3), 6.0)
    got = errors(one, other)
    assert got["rmse"] == got["flip"] == 0
    assert got["linear_rmse"] == got["linear_max"] == pytest.approx(2.0)


def test_the_silhouette_has_its_share_of_the_squares() -> None:
    several = np.zeros((20, 30), bool)
    several[:, 0] = True
    other = GREY.copy()
    other[several] += 0.2
    assert errors(shown(other), shown(GREY), several=several)["silhouette"] == pytest.approx(1)
    # One pixel beside it, off by twice as much: 4 squares of 20 + 4.
    other[5, 7] += 0.4
    assert errors(shown(other), shown(GREY), several=several)["silhouette"] == pytest.approx(20 / 24, abs=1e-6)
    assert errors(shown(other), shown(GREY))["silhouette"] is None


def test_angles_of_normals_leave_out_silhouettes_and_nothing() -> None:
    truth = np.zeros((10, 10, 3))
    truth[..., 2] = 1
    tilt = np.radians(0.001)
    got = truth.copy()
    got[:] = (np.sin(tilt), 0, np.cos(tilt))
    got[0], truth[1] = np.nan, np.nan
    got[2] = (1, 0, 0)
    several = np.zeros((10, 10), bool)
    several[2] = True
    figures = errors(GREY[:10, :10], GREY[:10, :10], several=several, normals=(got, truth))
    # A thousandth of a degree, which an arc cosine would lose.
    assert figures["normal"] == figures["normal_p99"] == pytest.approx(0.001, rel=1e-6)
    assert errors(GREY[:10, :10], GREY[:10, :10], normals=(got, truth))["normal_p99"] > 80
    assert degrees_between((1, 0, 0), (-1, 0, 0)) == pytest.approx(180)


DRAWS: dict[str, tuple[Callable[[np.random.Generator, int], np.ndarray], float]] = {
    "exponential": (lambda chance, n: chance.exponential(1, n), 1.0),
    "log-normal": (lambda chance, n: chance.lognormal(0, 1, n), float(np.exp(0.5))),
}


@pytest.mark.parametrize(("spread", "least"), [("exponential", 0.91), ("log-normal", 0.87)])
def test_bounds_hold_as_often_as_they_say(spread: str, least: float) -> None:
    draw, mean = DRAWS[spread]
    chance = np.random.default_rng(3)
    bounds = [rmse_bounds(draw(chance, 16)) for _ in range(2000)]
    held = np.mean([b.low <= mean**0.5 <= b.high for b in bounds])
    # 2,000 trials: the share is known to 0.007 (one sigma).
    assert least < held <= 0.97
    # Half as wide they would not.
    narrow = np.mean(
        [b.value * (b.low / b.value) ** 0.5 <= mean**0.5 <= b.value * (b.high / b.value) ** 0.5 for b in bounds]
    )
    assert narrow < 0.8


def test_bounds_are_wider_of_fewer_and_of_none_but_equal_ones_nothing() -> None:
    values = np.random.default_rng(1).exponential(1, 64)
    few, many = rmse_bounds(values[:8]), rmse_bounds(values)
    assert few.high / few.low > 1.5 * many.high / many.low
    assert rmse_bounds(np.zeros(8)) == (0, 0, 0)
    equal = rmse_bounds(np.full(8, 0.04))
    assert equal.low == equal.value == equal.high == pytest.approx(0.2)
    assert rmse_bounds(values, 0.99).high > many.high


@pytest.mark.parametrize("squares", [[1.0, 2, 3], [[1.0] * 4], [1.0, 2, 3, -1], [1.0, 2, 3, np.nan]])
def test_bounds_refuse_what_is_no_sample(squares: list[float]) -> None:
    with pytest.raises(ImageError, match="at least 4 numbers"):
        rmse_bounds(squares)


def test_mean_squares_are_those_of_rmse() -> None:
    assert mean_squares(shown(GREY + 0.1), shown(GREY)) == pytest.approx(0.01)
