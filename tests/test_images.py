"""Pictures: what a file's numbers mean, the sRGB curve, tone maps, and writing them back."""

from __future__ import annotations

import io
import subprocess
import sys
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

from glbump.image import ArrayImage
from glbump.maps import colour, files
from glbump.maps.images import (
    TONES,
    linear_from_srgb,
    read_colour,
    read_height,
    read_normals,
    read_picture,
    srgb_from_linear,
    tone_map,
    write_atomically,
    write_display,
    write_picture,
)

DATA = Path(__file__).parents[2] / "shared" / "data"

# Different at every pixel and in every channel, so that a swap, a flip or a shift is seen.
RGB = (np.arange(6 * 8 * 3, dtype=np.uint8) * 7 % 251).reshape(6, 8, 3)
GREY = RGB[..., 0].copy()


def shared(name: str) -> Path:
    path = DATA / name
    if not path.exists():
        pytest.skip(f"needs ../shared/data/{name} beside the repository")
    return path


def write_oiio(path: Path, pixels: np.ndarray, kind: str, **attributes: object) -> Path:
    """A file made by OpenImageIO as another program would make it."""
    spec = oiio.ImageSpec(pixels.shape[1], pixels.shape[0], pixels.shape[2], kind)
    for name, value in attributes.items():
        spec.attribute(name.replace("__", ":"), value)
    file = oiio.ImageOutput.create(str(path))
    assert file.open(str(path), spec), file.geterror()
    assert file.write_image(np.ascontiguousarray(pixels)), file.geterror()
    file.close()
    return path


# The sRGB curve ------------------------------------------------------------------------------------------------


def test_srgb_known_values() -> None:
    # sRGB 188 is linear one half; IEC 61966-2-1's own constants join to 1e-7.
    assert linear_from_srgb(188 / 255) == pytest.approx(0.5029, abs=1e-4)
    assert srgb_from_linear(0.5) * 255 == pytest.approx(187.5, abs=0.1)
    assert linear_from_srgb([0.0, 1.0]) == pytest.approx([0, 1], abs=1e-15)
    assert abs(linear_from_srgb(0.04045 + 1e-12) - linear_from_srgb(0.04045)) < 1e-7


def test_srgb_is_no_plain_power() -> None:
    assert abs(linear_from_srgb(0.02) - 0.02**2.2) > 1e-3


@given(st.floats(-0.5, 8))
@settings(max_examples=200)
def test_srgb_round_trip(value: float) -> None:
    # 5e-8 is what the constants of the standard, rounded as they are, miss each other by at the joint.
    assert linear_from_srgb(srgb_from_linear(value)) == pytest.approx(value, abs=5e-8)


def test_srgb_keeps_float32() -> None:
    assert srgb_from_linear(np.float32([0.5])).dtype == np.float32
    assert linear_from_srgb(np.float16([0.5])).dtype == np.float32
    assert linear_from_srgb(np.array([0, 1])).dtype == np.float64


# Tone maps -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("tone", TONES)
def test_tone_maps_rise_from_black_to_white(tone: str) -> None:
    ramp = np.linspace(0, 100, 5001)
    shown = tone_map(ramp, tone)
    assert shown[0] == pytest.approx(0, abs=1e-12)
    assert (np.diff(shown) >= 0).all()
    assert shown.max() == 1
    assert tone_map(np.array([np.inf, -np.inf, -1.0]), tone) == pytest.approx([1, 0, 0], abs=1e-12)


@pytest.mark.parametrize("tone", TONES)
def test_exposure_is_stops_before_the_curve(tone: str) -> None:
    light = np.linspace(0, 1, 65)
    assert tone_map(light, tone, exposure=2) == pytest.approx(tone_map(light * 4, tone))
    assert not np.allclose(tone_map(light, tone, exposure=2), tone_map(light * 2, tone))


def test_tone_map_known_values() -> None:
    assert tone_map([0.25, 0.5, 1.5]) == pytest.approx([0.25, 0.5, 1])
    # x (1 + x/16) / (1 + x) at 1 and at the white point.
    assert tone_map([1.0, colour.REINHARD_WHITE], "reinhard") == pytest.approx([(1 + 1 / 16) / 2, 1])
    # Narkowicz's fit: (2.51 + 0.03) / (2.43 + 0.59 + 0.14).
    assert tone_map([1.0], "filmic") == pytest.approx([2.54 / 3.16])


def test_tone_map_keeps_nan_a_nan() -> None:
    assert np.isnan(tone_map(np.array([np.nan]), "reinhard")).all()


@pytest.mark.parametrize("tone", TONES)
@pytest.mark.parametrize("exposure", [0.0, -3.0, 1.5])
def test_half_table_equals_the_float_formula(tone: str, exposure: float) -> None:
    halves = np.arange(65536, dtype=np.uint16).view(np.float16)
    halves = np.random.default_rng(3).permutation(halves[~np.isnan(halves)]).reshape(-1, 2)
    as_table = colour.display_bytes(halves, tone, exposure)
    as_formula = colour.display_bytes(halves.astype(np.float32), tone, exposure)
    assert np.array_equal(as_table, as_formula)
    assert np.array_equal(colour.alpha_bytes(halves), colour.alpha_bytes(halves.astype(np.float32)))


def test_eight_bit_rounds_to_nearest_and_back() -> None:
    every = np.arange(256)
    assert np.array_equal(colour.eight_bit(every / 255), every)
    assert np.array_equal(colour.eight_bit((every[:-1] + 0.501) / 255), every[1:])
    assert np.array_equal(colour.display_bytes(linear_from_srgb(every / 255)), every)


# Reading: integers ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("suffix", ["png", "bmp", "tga", "tif"])
def test_eight_bit_colour_is_srgb(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"a.{suffix}"
    Image.fromarray(RGB).save(path)
    picture = read_colour(path)
    assert picture.pixels.dtype == np.float32
    assert picture.pixels.flags.c_contiguous
    assert (picture.bits, picture.is_float, picture.envmap, picture.name) == (8, False, None, str(path))
    assert picture.pixels == pytest.approx(linear_from_srgb(RGB / 255), abs=1e-7)


def test_lossless_webp_and_jpeg(tmp_path: Path) -> None:
    Image.fromarray(RGB).save(tmp_path / "a.webp", lossless=True)
    assert read_colour(tmp_path / "a.webp").pixels == pytest.approx(linear_from_srgb(RGB / 255), abs=1e-7)
    smooth = np.repeat(np.linspace(0, 255, 64).astype(np.uint8)[None, :, None], 16, axis=0).repeat(3, axis=2)
    Image.fromarray(smooth).save(tmp_path / "a.jpg", quality=95)
    # JPEG keeps a ramp to a few 255ths.
    got = srgb_from_linear(read_colour(tmp_path / "a.jpg").pixels) * 255
    assert np.abs(got - smooth).max() < 4


@pytest.mark.parametrize("suffix", ["png", "tif"])
def test_sixteen_bit_colour_is_srgb_unless_the_file_says_linear(tmp_path: Path, suffix: str) -> None:
    wide = RGB.astype(np.uint16) * 257
    path = write_oiio(tmp_path / f"a.{suffix}", wide, "uint16")
    picture = read_colour(path)
    assert picture.bits == 16
    assert picture.pixels == pytest.approx(linear_from_srgb(wide / 65535), abs=1e-7)
    if suffix == "png":
        path = write_oiio(tmp_path / "linear.png", wide, "uint16", oiio__ColorSpace="lin_rec709_scene")
        assert read_colour(path).pixels == pytest.approx(wide / 65535, abs=1e-7)


def test_heights_are_never_srgb_decoded(tmp_path: Path) -> None:
    Image.fromarray(GREY).save(tmp_path / "a.png")
    picture = read_height(tmp_path / "a.png")
    assert picture.pixels.shape == (6, 8, 1)
    assert np.array_equal(picture.pixels[..., 0], (GREY / 255).astype(np.float32))
    wide = (GREY.astype(np.uint16) * 251)[..., None]
    assert np.array_equal(
        read_height(write_oiio(tmp_path / "b.png", wide, "uint16")).pixels, (wide / 65535).astype(np.float32)
    )


def test_grey_as_colour_and_equal_channels_as_height(tmp_path: Path) -> None:
    Image.fromarray(GREY).save(tmp_path / "a.png")
    grey = read_colour(tmp_path / "a.png").pixels
    assert grey.shape == (6, 8, 3)
    assert np.array_equal(grey[..., 0], grey[..., 2])
    Image.fromarray(np.dstack([GREY] * 3)).save(tmp_path / "b.png")
    assert np.array_equal(read_height(tmp_path / "b.png").pixels, read_height(tmp_path / "a.png").pixels)


@pytest.mark.parametrize(("letter", "index"), [("r", 0), ("g", 1), ("b", 2), ("a", 3)])
def test_height_from_a_channel(tmp_path: Path, letter: str, index: int) -> None:
    rgba = np.dstack([RGB, 255 - GREY])
    Image.fromarray(rgba).save(tmp_path / "a.png")
    # Alpha stays straight: colour is not multiplied by it.
    got = read_height(tmp_path / "a.png", channel=letter).pixels[..., 0]
    assert np.array_equal(got, (rgba[..., index] / 255).astype(np.float32))


def test_palette_and_one_bit_pictures(tmp_path: Path) -> None:
    palette = Image.fromarray(RGB).convert("P", palette=Image.Palette.ADAPTIVE, colors=200)
    for name in ("a.png", "a.bmp"):
        palette.save(tmp_path / name)
        wanted = linear_from_srgb(np.asarray(palette.convert("RGB")) / 255)
        assert read_colour(tmp_path / name).pixels == pytest.approx(wanted, abs=1e-7)
    Image.fromarray(GREY > 100).save(tmp_path / "b.png")
    assert np.array_equal(read_height(tmp_path / "b.png").pixels[..., 0], np.float32(GREY > 100))


def test_a_png_called_jpg_is_read(tmp_path: Path) -> None:
    Image.fromarray(RGB).save(tmp_path / "a.jpg", format="PNG")
    assert read_colour(tmp_path / "a.jpg").pixels == pytest.approx(linear_from_srgb(RGB / 255), abs=1e-7)


@pytest.mark.parametrize("tag", range(1, 9))
def test_orientation_tag_is_obeyed(tmp_path: Path, tag: int) -> None:
    from PIL import ImageOps

    picture = Image.fromarray(RGB)
    exif = picture.getexif()
    exif[274] = tag
    picture.save(tmp_path / "a.png", exif=exif)
    with Image.open(tmp_path / "a.png") as stored:
        upright = np.asarray(ImageOps.exif_transpose(stored))
    got = read_colour(tmp_path / "a.png").pixels
    assert got == pytest.approx(linear_from_srgb(upright / 255), abs=1e-7)
    assert (got.shape == (6, 8, 3)) == (tag < 5)


def test_opaque_alpha_is_dropped(tmp_path: Path) -> None:
    Image.fromarray(np.dstack([RGB, np.full_like(GREY, 255)])).save(tmp_path / "a.png")
    assert read_colour(tmp_path / "a.png").pixels == pytest.approx(linear_from_srgb(RGB / 255), abs=1e-7)


# Reading: floats -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("kind", "bits"), [("half", 16), ("float", 32)])
def test_float_colour_is_linear(tmp_path: Path, kind: str, bits: int) -> None:
    light = (RGB.astype(np.float32) - 3) / 8  # Exact in half floats, below 0 and far above 1.
    picture = read_colour(write_oiio(tmp_path / "a.exr", light, kind))
    assert (picture.bits, picture.is_float) == (bits, True)
    assert np.array_equal(picture.pixels, light)
    assert np.array_equal(read_height(tmp_path / "a.exr", channel="g").pixels[..., 0], light[..., 1])


def test_float_tiff_and_radiance(tmp_path: Path) -> None:
    light = RGB.astype(np.float32) / 8
    assert np.array_equal(read_colour(write_oiio(tmp_path / "a.tif", light, "float")).pixels, light)
    got = read_colour(write_oiio(tmp_path / "a.hdr", light, "float")).pixels
    # Radiance keeps 8 bits for the largest channel of a pixel: half a step of 1/128 at worst.
    assert (np.abs(got - light) <= light.max(axis=2, keepdims=True) / 128).all()


def test_first_three_channels_of_many(tmp_path: Path) -> None:
    light = np.dstack([RGB, np.full_like(GREY, 1), RGB]).astype(np.float32)
    assert np.array_equal(read_colour(write_oiio(tmp_path / "a.exr", light, "float")).pixels, light[..., :3])


def test_environment_headers_and_mip_levels() -> None:
    lat_long = read_colour(shared("openexr/KernerEnvLatLong.exr"))
    assert lat_long.envmap == "latlong"
    assert lat_long.pixels.shape == (512, 1024, 3)
    assert lat_long.pixels.max() == 1678  # The sun, as OpenImageIO's own iinfo --stats says.
    cube = read_colour(shared("openexr/KernerEnvCube.exr"))
    assert (cube.envmap, cube.pixels.shape) == ("cube", (1536, 256, 3))
    assert read_colour(shared("cc0/venice.exr")).envmap is None


def test_arrays_are_pictures() -> None:
    light = np.random.default_rng(0).random((4, 5, 3), np.float32)
    assert np.array_equal(read_colour(ArrayImage(light)).pixels, light)
    assert np.array_equal(read_height(ArrayImage(light[..., 0])).pixels, light[..., :1])
    faces = np.random.default_rng(0).random((6, 3, 3, 3), np.float32)
    assert np.array_equal(read_colour(ArrayImage(faces)).pixels, faces.reshape(18, 3, 3))


# Normal maps ---------------------------------------------------------------------------------------------------


def bumpy_normals() -> np.ndarray:
    y, x = np.mgrid[0:16, 0:16] / 16
    slopes = np.stack([np.sin(6.28 * x), 0.5 * np.cos(6.28 * y), np.ones_like(x) * 2], axis=-1)
    return slopes / np.linalg.norm(slopes, axis=-1, keepdims=True)


def test_normals_of_every_depth(tmp_path: Path) -> None:
    n = bumpy_normals()
    bytes_ = np.round(n * 127 + 128).astype(np.uint8)
    Image.fromarray(bytes_).save(tmp_path / "a.png")
    got = read_normals(tmp_path / "a.png").pixels
    assert np.array_equal(got, ((bytes_.astype(np.float32) - 128) / np.float32(127)))
    assert np.abs(got - n).max() < 0.5 / 127 + 1e-6
    wide = np.round(n * 32767 + 32768).astype(np.uint16)
    got = read_normals(write_oiio(tmp_path / "b.png", wide, "uint16")).pixels
    assert np.abs(got - n).max() < 0.5 / 32767 + 1e-7  # Half a step, and the rounding to float32.
    for stored in (n, (n + 1) / 2):
        got = read_normals(write_oiio(tmp_path / "c.exr", stored.astype(np.float32), "float")).pixels
        assert np.abs(got - n).max() < 1e-6


def test_flat_normal_maps_are_exactly_flat(tmp_path: Path) -> None:
    Image.new("RGB", (4, 4), (128, 128, 255)).save(tmp_path / "a.png")
    assert np.array_equal(read_normals(tmp_path / "a.png").pixels, np.tile(np.float32([0, 0, 1]), (4, 4, 1)))
    flat = np.tile(np.float32([0, 0, 1]), (4, 4, 1))
    assert np.array_equal(read_normals(ArrayImage(np.full((4, 4, 3), (32768, 32768, 65535), np.uint16))).pixels, flat)
    assert np.array_equal(read_normals(ArrayImage(flat)).pixels, flat)
    assert np.array_equal(read_normals(ArrayImage(flat / 2 + 0.5)).pixels, flat)


def test_alpha_of_a_normal_map_is_not_read(tmp_path: Path) -> None:
    bytes_ = np.round(bumpy_normals() * 127 + 128).astype(np.uint8)
    Image.fromarray(np.dstack([bytes_, bytes_[..., 0]])).save(tmp_path / "a.png")
    assert np.array_equal(read_normals(tmp_path / "a.png").pixels, (bytes_.astype(np.float32) - 128) / np.float32(127))


def test_a_real_normal_map() -> None:
    normals = read_normals(shared("cc0/normal_0003.webp")).pixels
    assert normals.shape == (512, 512, 3)
    assert normals[..., 2].min() > 0


# Writing -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("channels", [1, 2, 3, 4])
@pytest.mark.parametrize("suffix", ["exr", "tif", "hdr", "png", "webp"])
@pytest.mark.parametrize("dtype", [np.float32, np.float16])
def test_written_pictures_read_back(tmp_path: Path, channels: int, suffix: str, dtype: type) -> None:
    light = np.random.default_rng(1).random((7, 9, channels)).astype(dtype)
    if suffix == "hdr" and channels in (2, 4):
        light[..., -1] = 1
    write_picture(tmp_path / f"a.{suffix}", light)
    got = read_picture(tmp_path / f"a.{suffix}").pixels
    wanted = light.astype(np.float32)
    if suffix == "hdr":
        wanted = wanted[..., :1] if channels == 2 else wanted[..., :3]
        wanted = np.repeat(wanted, 3 // wanted.shape[2], axis=2)
    elif suffix == "webp" and channels < 3:
        wanted = np.concatenate([wanted[..., :1]] * 3 + [wanted[..., 1:]], axis=2)
    # Exact; a division by premultiplied alpha; Radiance's 8 bits; half a step of 8-bit sRGB at its steepest.
    lossless = 0.0 if channels in (1, 3) else {np.float32: 1e-6, np.float16: 2e-3}[dtype]
    tolerance = {"exr": lossless, "tif": 0, "hdr": 1 / 128, "png": 0.0045, "webp": 0.0045}[suffix]
    assert got.shape == wanted.shape
    assert np.abs(got - wanted).max() <= tolerance


def test_half_arrays_make_half_exr(tmp_path: Path) -> None:
    light = np.random.default_rng(1).random((5, 4, 3)).astype(np.float16)
    write_picture(tmp_path / "a.exr", light)
    assert read_picture(tmp_path / "a.exr").bits == 16
    write_picture(tmp_path / "a.exr", light.astype(np.float64))
    assert read_picture(tmp_path / "a.exr").bits == 32


def test_exr_holds_colour_times_alpha(tmp_path: Path) -> None:
    write_picture(tmp_path / "a.exr", np.full((2, 2, 4), 0.5, np.float32))
    file = oiio.ImageInput.open(str(tmp_path / "a.exr"))
    assert file.read_image(oiio.FLOAT)[0, 0] == pytest.approx([0.25, 0.25, 0.25, 0.5])


def test_png_is_what_other_readers_read(tmp_path: Path) -> None:
    for channels, mode in ((1, "L"), (2, "LA"), (3, "RGB"), (4, "RGBA")):
        pixels = np.random.default_rng(channels).integers(0, 256, (9, 13, channels), dtype=np.uint8)
        with Image.open(io.BytesIO(files.png_bytes(pixels))) as picture:
            assert picture.mode == mode
            assert np.array_equal(np.asarray(picture).reshape(pixels.shape), pixels)


def test_opaque_alpha_is_left_out(tmp_path: Path) -> None:
    light = np.ones((3, 3, 4), np.float32)
    write_picture(tmp_path / "a.png", light)
    write_picture(tmp_path / "a.jpg", light)
    light[0, 0, 3] = 0.5
    write_picture(tmp_path / "b.png", light)
    with Image.open(tmp_path / "a.png") as opaque, Image.open(tmp_path / "b.png") as clear:
        assert (opaque.mode, clear.mode) == ("RGB", "RGBA")
        assert clear.getpixel((0, 0)) == (255, 255, 255, 128)


def test_tone_and_exposure_reach_the_file(tmp_path: Path) -> None:
    light = np.random.default_rng(2).random((8, 8, 3)) * 8
    write_picture(tmp_path / "a.png", light, tone="filmic", exposure=-1)
    with Image.open(tmp_path / "a.png") as picture:
        assert np.array_equal(np.asarray(picture), colour.display_bytes(light, "filmic", -1))


def test_jpeg_is_close(tmp_path: Path) -> None:
    ramp = np.linspace(0, 255, 64).astype(np.uint8)
    pixels = np.stack(np.broadcast_arrays(ramp[None, :], ramp[:, None], np.uint8(90)), axis=-1)
    write_display(tmp_path / "a.jpg", pixels)
    with Image.open(tmp_path / "a.jpg") as picture:
        # Quality 95 without chroma subsampling keeps a colour ramp to a few 255ths.
        assert np.abs(np.asarray(picture).astype(int) - pixels).max() < 8


def test_written_whole_or_not_at_all(tmp_path: Path) -> None:
    target = tmp_path / "a.txt"
    write_atomically(target, b"first")
    target.chmod(0o640)

    def stops_half_way(beside: Path) -> None:
        beside.write_bytes(b"half")
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_atomically(target, stops_half_way)
    assert target.read_bytes() == b"first"
    assert list(tmp_path.iterdir()) == [target]
    write_atomically(target, lambda beside: beside.write_bytes(b"second") and None)
    assert target.read_bytes() == b"second"
    assert target.stat().st_mode & 0o777 == 0o640


def test_a_link_stays_a_link(tmp_path: Path) -> None:
    (tmp_path / "there").mkdir()
    real, link = tmp_path / "there" / "a.bin", tmp_path / "a.bin"
    real.write_bytes(b"old")
    link.symlink_to(real)
    write_atomically(link, b"new")
    assert link.is_symlink()
    assert real.read_bytes() == b"new"


def test_saving_a_png_imports_no_image_library(tmp_path: Path) -> None:
    code = (
        "import sys, numpy as np; from glbump.frame import Frame; import glbump.maps.images;"
        "Frame(np.ones((2, 2, 4), np.float16)).save(sys.argv[1]);"
        "print([m for m in ('PIL', 'OpenImageIO', 'moderngl', 'skimage', 'rich') if m in sys.modules])"
    )
    command = [sys.executable, "-c", code, str(tmp_path / "a.png")]
    assert subprocess.run(command, capture_output=True, text=True, check=True).stdout == "[]\n"
    assert (tmp_path / "a.png").exists()
