"""Frame: the same picture whatever form the GPU hands it over in."""

from __future__ import annotations

import io
import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from glbump.errors import ImageError
from glbump.frame import Frame
from glbump.maps import colour
from glbump.maps.images import read_picture


def light(alpha: bool = False) -> np.ndarray:
    """(5, 7, 4) half floats below 0, between and far above 1; different at every pixel."""
    rng = np.random.default_rng(5)
    pixels = rng.uniform(-0.2, 3, (5, 7, 4))
    pixels[..., 3] = rng.uniform(0, 1, (5, 7)) if alpha else 1
    return pixels.astype(np.float16)


@pytest.mark.parametrize("dtype", [np.float16, np.float32])
@pytest.mark.parametrize("bottom_up", [True, False])
@pytest.mark.parametrize("alpha", [True, False])
def test_every_form_is_the_same_picture(dtype: type, bottom_up: bool, alpha: bool) -> None:
    top_down = light(alpha)
    raw = top_down[::-1] if bottom_up else top_down
    frame = Frame(np.ascontiguousarray(raw, dtype=dtype), bottom_up=bottom_up)
    assert frame.size == (7, 5)
    assert frame.pixels.dtype == np.float32
    assert frame.pixels.flags.c_contiguous
    assert np.array_equal(frame.pixels, top_down.astype(np.float32))
    wanted = colour.display_bytes(top_down.astype(np.float32), "reinhard", 0.5)
    wanted[..., 3] = np.round(top_down[..., 3].astype(np.float64) * 255)
    assert np.array_equal(frame.display("reinhard", 0.5), wanted)


def test_pixels_are_made_once_and_cannot_be_changed() -> None:
    frame = Frame(light())
    assert frame.pixels is frame.pixels
    with pytest.raises(ValueError, match="read-only"):
        frame.pixels[0, 0] = 0
    raw = light().astype(np.float32)
    assert np.shares_memory(Frame(raw).pixels, raw)
    assert raw.flags.writeable


def test_is_an_array() -> None:
    frame = Frame(light(), bottom_up=True)
    assert np.asarray(frame) is frame.pixels
    assert np.array_equal(np.array(frame, dtype=np.float64), frame.pixels)
    copied = np.array(frame, copy=True)
    copied[:] = 0
    assert frame.pixels.any()
    assert np.asarray(frame, copy=False) is frame.pixels
    with pytest.raises(ValueError, match="copied"):
        np.asarray(frame, dtype=np.float16, copy=False)


@pytest.mark.parametrize("suffix", ["png", "webp", "exr", "tif"])
@pytest.mark.parametrize("alpha", [True, False])
def test_saved_frames_read_back(tmp_path: Path, suffix: str, alpha: bool) -> None:
    frame = Frame(np.abs(light(alpha)), bottom_up=True)
    frame.save(tmp_path / f"a.{suffix}")
    got = read_picture(tmp_path / f"a.{suffix}").pixels
    wanted = frame.pixels if alpha else frame.pixels[..., :3]
    assert got.shape == wanted.shape
    if suffix in ("png", "webp"):
        wanted = np.clip(wanted, 0, 1)
        assert np.abs(got - wanted).max() < 0.0045  # Half a step of 8-bit sRGB where it is steepest.
    else:
        assert np.abs(got - wanted).max() <= 1e-6  # A product with alpha, divided again.


def test_tone_and_exposure_are_for_display_formats(tmp_path: Path) -> None:
    frame = Frame(light())
    frame.save(tmp_path / "a.png", tone="filmic", exposure=1)
    with Image.open(tmp_path / "a.png") as picture:
        assert np.array_equal(np.asarray(picture), frame.display("filmic", 1)[..., :3])
    for wrong in ({"tone": "filmic"}, {"exposure": 1.0}):
        with pytest.raises(ImageError, match="holds linear light"):
            frame.save(tmp_path / "a.exr", **wrong)
    assert not (tmp_path / "a.exr").exists()


def test_notebooks_get_a_png_and_text() -> None:
    frame = Frame(light())
    with Image.open(io.BytesIO(frame._repr_png_() or b"")) as picture:
        assert np.array_equal(np.asarray(picture), frame.display()[..., :3])
    assert repr(frame) == "Frame(7x5)"
    broken = light()
    broken[1, 1] = np.nan
    assert Frame(broken)._repr_png_() is None


@pytest.mark.parametrize("dtype", [np.float16, np.float32])
@pytest.mark.parametrize("name", ["a.png", "a.jpg", "a.exr", "a.hdr"])
def test_nan_is_never_a_colour(tmp_path: Path, dtype: type, name: str) -> None:
    pixels = np.abs(light()).astype(dtype)
    pixels[3, 2, 1] = pixels[3, 4, 0] = np.nan
    frame = Frame(pixels[::-1].copy(), bottom_up=True)
    with pytest.raises(ImageError, match=r"2 of 35 pixels are NaN \(first at row 3, column 2\)"):
        frame.save(tmp_path / name)
    assert list(tmp_path.iterdir()) == []


def test_infinite_light_is_white_on_a_display_and_an_error_in_a_float_file(tmp_path: Path) -> None:
    pixels = np.abs(light())
    pixels[0, 0, :3] = np.inf
    frame = Frame(pixels)
    assert frame.display("filmic")[0, 0].tolist() == [255, 255, 255, 255]
    with pytest.raises(ImageError, match="1 of 35 pixels are infinite"):
        frame.save(tmp_path / "a.exr")


@pytest.mark.parametrize(
    "wrong",
    [
        np.zeros((4, 4, 3), np.float32),
        np.zeros((4, 4), np.float32),
        np.zeros((0, 4, 4), np.float32),
        np.zeros((4, 4, 4), np.uint8),
        np.zeros((4, 4, 4), np.float64),
    ],
)
def test_a_frame_is_four_float_channels(wrong: np.ndarray) -> None:
    with pytest.raises(ImageError, match=r"a frame must be \(H, W, 4\)"):
        Frame(wrong)


def test_stats_are_kept() -> None:
    stats = {"backend": "egl", "ms": 1.5}
    assert Frame(light(), stats).stats is stats
    assert json.dumps(Frame(light()).stats) == "{}"
