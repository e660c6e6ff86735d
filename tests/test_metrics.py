"""Figures for differences: laws, known offsets, and an outside program's FLIP."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from glbump.errors import ImageError
from glbump.frame import Frame
from glbump.maps.images import linear_from_srgb, srgb_from_linear
from glbump.trade.metrics import compare, difference_picture, side_by_side, write_comparison

FIGURES = ("max", "mean", "p99", "p999", "rmse", "psnr", "flip", "ssim")


def picture(seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).uniform(0, 1, (16, 24, 3)).astype(np.float32)


def waves() -> tuple[np.ndarray, np.ndarray]:
    y, x = np.mgrid[0:64, 0:96].astype(np.float64)
    a = np.stack([0.5 + 0.4 * np.sin(x / 5), 0.5 + 0.4 * np.cos(y / 7), (x + y) / 160], axis=-1)
    return a, np.roll(a, 1, axis=1) * 0.95


def test_equal_pictures_differ_by_nothing() -> None:
    figures = compare(picture(), picture())
    assert [figures[name] for name in ("max", "mean", "p99", "rmse", "flip")] == [0, 0, 0, 0, 0]
    assert figures["ssim"] in (None, pytest.approx(1))
    assert figures["psnr"] is None
    assert "equal" in figures["notes"]["psnr"]


def test_a_known_offset_gives_known_figures() -> None:
    base = np.full((20, 20, 3), 0.5)
    other = base + np.array([0.0, 0.1, -0.04])
    figures = compare(linear_from_srgb(base), linear_from_srgb(other))
    assert figures["max"] == pytest.approx(0.1)
    assert figures["mean"] == pytest.approx(0.1)  # Of each pixel's largest channel difference.
    assert figures["p99"] == pytest.approx(0.1)
    rmse = np.sqrt((0.1**2 + 0.04**2) / 3)
    assert figures["rmse"] == pytest.approx(rmse)
    assert figures["psnr"] == pytest.approx(-20 * np.log10(rmse))


def test_p99_and_worst_see_single_pixels() -> None:
    a = np.zeros((10, 20, 3))
    b = a.copy()
    b[7, 3, 2] = 1
    figures = compare(a, b, perceptual=False)
    assert (figures["max"], figures["worst"]) == (pytest.approx(1), [7, 3])
    assert figures["p99"] == 0
    assert figures["mean"] == pytest.approx(1 / 200)
    b[7, 3:7] = 1  # 2 % of the pixels.
    assert compare(a, b, perceptual=False)["p99"] == pytest.approx(1)


def test_figures_are_symmetric() -> None:
    one, other = compare(*waves()), compare(*reversed(waves()))
    for name in FIGURES:
        assert one[name] == pytest.approx(other[name], abs=1e-6), name


def test_more_noise_is_worse() -> None:
    a = linear_from_srgb(np.full((32, 32, 3), 0.5))
    noise = np.random.default_rng(0).normal(0, 0.02, a.shape)
    little, much = compare(a, a + noise), compare(a, a + 4 * noise)
    for name in ("max", "mean", "p99", "rmse", "flip"):
        assert little[name] < much[name], name
    assert little["psnr"] > much["psnr"]
    if little["ssim"] is not None:
        assert little["ssim"] > much["ssim"]


def test_flip_equals_the_authors_program() -> None:
    # The means flip_evaluator 1.7 (NVIDIA) gives for the same pairs, LDR, at its 67.02 pixels per degree.
    # 2e-4: OpenImageIO's fast cube root, and its table of the sRGB curve.
    black, white = np.zeros((64, 96, 3)), np.ones((64, 96, 3))
    assert compare(black, white)["flip"] == pytest.approx(0.967325, abs=2e-4)
    assert compare(*waves())["flip"] == pytest.approx(0.195801, abs=2e-4)
    # The wrong neighbour: linear values taken for encoded ones.
    as_linear = compare(*(linear_from_srgb(x) for x in waves()))
    assert abs(as_linear["flip"] - 0.195801) > 2e-3


def test_pictures_are_compared_as_displayed() -> None:
    bright = np.full((12, 12, 3), 3.0)
    assert compare(bright, bright * 2, perceptual=False)["max"] == 0  # Both white.
    assert compare(bright, bright * 2, display=False)["max"] == pytest.approx(3)
    assert compare(bright, bright * 2, display=False)["flip"] is None
    dark = np.full((12, 12, 3), 0.001)
    encoded = srgb_from_linear(0.002) - srgb_from_linear(0.001)
    assert compare(dark, dark * 2, perceptual=False)["max"] == pytest.approx(encoded)


def test_alpha_counts_where_a_picture_is_transparent() -> None:
    opaque = np.ones((12, 12, 4), np.float32)
    assert compare(opaque, opaque[..., :3])["max"] == 0
    clear = opaque.copy()
    clear[2, 3, 3] = 0.25
    figures = compare(opaque, clear, perceptual=False)
    assert figures["worst"] == [2, 3]
    assert figures["max"] == pytest.approx(0.75)
    # What lies behind alpha 0 is not seen.
    hidden = opaque.copy()
    hidden[..., 3] = 0
    assert compare(hidden, hidden * [0.5, 0.2, 1, 1], perceptual=False)["max"] == 0


def test_a_mask_leaves_pixels_out() -> None:
    a = picture()
    b = a.copy()
    b[:4] = 1 - b[:4]
    rest = np.ones((16, 24), bool)
    rest[:4] = False
    figures = compare(a, b, where=rest)
    assert figures["max"] == figures["mean"] == figures["rmse"] == 0
    assert figures["flip"] < compare(a, b)["flip"]  # FLIP filters, so that neighbours of the mask still count.
    with pytest.raises(ImageError, match="at least one true"):
        compare(a, b, where=np.zeros((16, 24), bool))
    with pytest.raises(ImageError, match="where must be"):
        compare(a, b, where=rest[1:])


def test_figures_are_json() -> None:
    for pair in ((picture(), picture()), (picture(), picture(1))):
        figures = json.loads(json.dumps(compare(*pair), allow_nan=False))
        assert set(figures) == {*FIGURES, "worst", "notes"}
        # Whatever is missing says why.
        assert {name for name in FIGURES if figures[name] is None} == set(figures["notes"])


def test_ssim_says_why_it_is_missing() -> None:
    figures = compare(picture()[:8], picture(1)[:8])
    assert figures["ssim"] is None
    assert "11x11" in figures["notes"]["ssim"] or "scikit-image" in figures["notes"]["ssim"]


def test_frames_and_grey_pictures_are_compared() -> None:
    rgba = np.dstack([picture(), np.ones((16, 24), np.float32)])
    assert compare(Frame(rgba), picture())["max"] == 0
    grey = picture()[..., :1]
    assert compare(grey, np.repeat(grey, 3, axis=2))["max"] == 0


def test_difference_picture_is_the_amplified_difference() -> None:
    a, b = np.full((2, 3, 3), 0.5), np.full((2, 3, 3), 0.5)
    b[0, 1] = [0.52, 0.4, 1.0]
    shown = difference_picture(linear_from_srgb(a), linear_from_srgb(b), gain=4)
    assert shown[0, 1] == pytest.approx([0.08, 0.4, 1.0])
    assert shown[1] == pytest.approx(0, abs=1e-12)


def test_comparison_shows_both_and_the_difference(tmp_path: Path) -> None:
    a, b = picture(), picture(1)
    beside = side_by_side(a, b, gain=2)
    assert beside.shape == (16, 72, 3)
    assert np.array_equal(beside[:, :24], srgb_from_linear(a))
    assert np.array_equal(beside[:, 48:], difference_picture(a, b, gain=2))
    write_comparison(tmp_path / "a.png", a, b, gain=2)
    with Image.open(tmp_path / "a.png") as written:
        assert np.abs(np.asarray(written) / 255 - beside).max() < 0.51 / 255
    with pytest.raises(ImageError, match="unknown suffix"):
        write_comparison(tmp_path / "a.exr", a, b)


def test_different_sizes_and_odd_arrays_are_errors() -> None:
    with pytest.raises(ImageError, match="24x16 and 24x15; draw both at the same size"):
        compare(picture(), picture()[1:])
    for wrong in (picture()[..., 0], picture().astype(np.uint8), np.zeros((0, 4, 3), np.float32)):
        with pytest.raises(ImageError, match="first picture: must be linear floats"):
            compare(wrong, picture())
    broken = picture()
    broken[4, 5, 0] = np.nan
    with pytest.raises(ImageError, match=r"second picture: 1 of 384 pixels are NaN \(first at row 4, column 5\)"):
        compare(picture(), broken)
