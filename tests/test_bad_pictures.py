"""Bad pictures and targets: one line that says what, got, allowed, what to do; and nothing is written."""

from __future__ import annotations

import json
import os
import struct
import subprocess
import sys
import zlib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest
from PIL import Image

from glbump.errors import GlbumpError, ImageError
from glbump.image import ArrayImage
from glbump.maps.images import (
    read_colour,
    read_height,
    read_normals,
    read_picture,
    write_atomically,
    write_display,
    write_picture,
)

READERS = (read_colour, read_height, read_normals, read_picture)
NOISE = np.random.default_rng(0).integers(0, 256, (48, 64, 3), dtype=np.uint8)


def message(call: Callable[..., object], *arguments: object, **options: object) -> str:
    """The one line that `call` fails with."""
    with pytest.raises(ImageError) as raised:
        call(*arguments, **options)
    text = str(raised.value)
    assert "\n" not in text
    assert len(text) < 500
    return text


def png(width: int, height: int, kind: int = 2, bits: int = 8, rows: bytes = b"") -> bytes:
    """A PNG that claims a size, with the pixels it is given."""

    def chunk(name: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))

    header = struct.pack(">IIBBBBB", width, height, bits, kind, 0, 0, 0)
    parts = chunk(b"IHDR", header), chunk(b"IDAT", zlib.compress(rows)), chunk(b"IEND", b"")
    return b"\x89PNG\r\n\x1a\n" + b"".join(parts)


def exr(path: Path, pixels: np.ndarray, **window: int) -> Path:
    spec = oiio.ImageSpec(pixels.shape[1], pixels.shape[0], pixels.shape[2], "float")
    for name, value in window.items():
        setattr(spec, name, value)
    file = oiio.ImageOutput.create(str(path))
    assert file.open(str(path), spec)
    assert file.write_image(np.ascontiguousarray(pixels, np.float32))
    file.close()
    return path


# No picture ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("reader", READERS)
def test_missing_empty_directory_and_pipe(tmp_path: Path, reader: Callable[..., object]) -> None:
    assert "no such file; check the path" in message(reader, tmp_path / "none.png")
    (tmp_path / "empty.png").touch()
    assert "is empty (0 bytes)" in message(reader, tmp_path / "empty.png")
    assert "is a directory; give a picture file" in message(reader, tmp_path)
    os.mkfifo(tmp_path / "pipe.png")
    assert "is no regular file" in message(reader, tmp_path / "pipe.png")
    assert "cannot be read" in message(reader, tmp_path / ("x" * 300 + ".png"))
    assert "no such file" in message(reader, Path("a\0b.png"))


@pytest.mark.parametrize("suffix", ["png", "jpg", "exr", "hdr", "tif", "webp", "tga", "bmp", "dds", "psd", "null", "x"])
@pytest.mark.parametrize("content", [b"A text, and no picture.\n" * 40, bytes(range(256)) * 8, b"\0" * 100])
def test_files_that_are_no_pictures(tmp_path: Path, suffix: str, content: bytes) -> None:
    path = tmp_path / f"a.{suffix}"
    path.write_bytes(content)
    text = message(read_colour, path)
    assert str(path) in text
    assert "formats: bmp, dds" in text or "damaged" in text


def test_formats_that_are_not_read_are_named(tmp_path: Path) -> None:
    Image.fromarray(NOISE).save(tmp_path / "a.gif")
    assert "is a gif file; formats: bmp, dds" in message(read_colour, tmp_path / "a.gif")


# Damaged -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("suffix", ["png", "jpg", "webp", "tif", "bmp", "tga", "exr", "hdr"])
@pytest.mark.parametrize("kept", [0.1, 0.5, 0.9])
def test_truncated_files(tmp_path: Path, capfd: pytest.CaptureFixture[str], suffix: str, kept: float) -> None:
    whole, path = tmp_path / f"whole.{suffix}", tmp_path / f"cut.{suffix}"
    if suffix in ("exr", "hdr"):
        write_picture(whole, NOISE / np.float32(255))
    else:
        Image.fromarray(NOISE).save(whole)
    content = whole.read_bytes()
    path.write_bytes(content[: int(len(content) * kept)])
    read_colour(whole)
    text = message(read_colour, path)
    assert "damaged or truncated" in text or "truncated" in text or "is no picture that can be read" in text
    assert capfd.readouterr().err == ""  # No library says a word beside the one line.


def test_a_decoder_that_returns_pixels_and_reports_an_error(tmp_path: Path) -> None:
    Image.fromarray(NOISE).save(tmp_path / "whole.jpg")
    content = (tmp_path / "whole.jpg").read_bytes()
    (tmp_path / "cut.jpg").write_bytes(content[:-200])
    file = oiio.ImageInput.open(str(tmp_path / "cut.jpg"))
    assert file.read_image(oiio.UINT8) is not None  # What makes it dangerous.
    assert file.geterror()
    assert "damaged or truncated (JPEG error: Premature end" in message(read_colour, tmp_path / "cut.jpg")


@pytest.mark.parametrize("suffix", ["png", "jpg", "webp", "tif", "exr", "hdr"])
def test_damage_anywhere_is_an_error_or_finite_pixels(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], suffix: str
) -> None:
    whole = tmp_path / f"whole.{suffix}"
    if suffix in ("exr", "hdr"):
        write_picture(whole, NOISE[:16, :16] / np.float32(255))
    else:
        Image.fromarray(NOISE[:16, :16]).save(whole)
    content = whole.read_bytes()
    rng = np.random.default_rng(7)
    errors = []
    for _ in range(40):
        damaged = bytearray(content)
        for place in rng.integers(0, len(content), 4):
            damaged[place] = rng.integers(0, 256)
        path = tmp_path / f"damaged.{suffix}"
        path.write_bytes(bytes(damaged))
        try:
            assert np.isfinite(read_colour(path).pixels).all()
        except GlbumpError as error:
            errors.append(str(error))
    assert not any("\n" in error for error in errors)
    assert capfd.readouterr().err == ""


# Too large -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("side", [20_000, 1_000_000])
def test_decompression_bombs_are_not_decoded(tmp_path: Path, side: int) -> None:
    (tmp_path / "bomb.png").write_bytes(png(side, side, kind=0, rows=b"\0" * 1000))
    text = message(read_height, tmp_path / "bomb.png")
    if side == 20_000:
        assert "is 20000x20000 = 400000000 pixels; at most 268435456" in text
        assert "GLBUMP_MAX_PIXELS" in text


def test_limits_of_pixels_and_bytes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "a.png"
    Image.fromarray(NOISE).save(path)
    monkeypatch.setenv("GLBUMP_MAX_PIXELS", "3071")
    assert "is 64x48 = 3072 pixels; at most 3071" in message(read_colour, path)
    monkeypatch.setenv("GLBUMP_MAX_PIXELS", "3072")
    read_colour(path)
    monkeypatch.setenv("GLBUMP_MAX_BYTES", "36863")
    assert "takes 36864 bytes decoded (64x48); at most 36863" in message(read_colour, path)
    monkeypatch.setenv("GLBUMP_MAX_BYTES", "36864")
    read_colour(path)
    for wrong in ("many", "-1", "0", "1e9"):
        monkeypatch.setenv("GLBUMP_MAX_PIXELS", wrong)
        assert f"must be a whole number above 0; got {wrong!r}" in message(read_colour, path)


# Not for this use ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("reader", READERS)
@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_nan_and_infinity(tmp_path: Path, reader: Callable[..., object], value: float) -> None:
    pixels = np.ones((5, 6, 3), np.float32)
    pixels[2, 3] = pixels[4, 0] = value
    nan = 2 if np.isnan(value) else 0
    wanted = f"2 of 30 pixels (first at row 2, column 3) are not finite ({nan} NaN, the others infinite)"
    assert wanted in message(reader, exr(tmp_path / "a.exr", pixels))
    assert wanted in message(reader, ArrayImage(pixels))


def test_coloured_heights_ask_for_a_channel(tmp_path: Path) -> None:
    coloured = np.full((5, 6, 3), 90, np.uint8)
    coloured[3, 1, 2] = 91
    Image.fromarray(coloured).save(tmp_path / "a.png")
    text = message(read_height, tmp_path / "a.png")
    assert "must be grey; 1 of 30 pixels (first at row 3, column 1) are coloured" in text
    assert 'channel = "r", "g", "b" or "a"' in text
    assert "no channel 'a'; it has r, g, b" in message(read_height, tmp_path / "a.png", channel="a")
    assert "no channel 'x'; it has grey" in message(read_height, ArrayImage(np.ones((2, 2))), channel="x")


def test_transparent_colour_and_heights(tmp_path: Path) -> None:
    clear = np.full((5, 6, 4), 255, np.uint8)
    clear[1, 2, 3] = 254
    Image.fromarray(clear).save(tmp_path / "a.png")
    for reader in (read_colour, read_height):
        text = message(reader, tmp_path / "a.png")
        assert "must be opaque; 1 of 30 pixels (first at row 1, column 2) have an alpha other than 1" in text
        assert "flatten it" in text


def test_normal_maps_that_are_none(tmp_path: Path) -> None:
    grey, photo = tmp_path / "grey.png", tmp_path / "photo.png"
    Image.fromarray(NOISE[..., 0]).save(grey)
    assert "a grey picture is no normal map" in message(read_normals, grey)
    assert "bump.height" in message(read_normals, grey)
    Image.fromarray(NOISE // 2).save(photo)
    assert "is no tangent-space normal map" in message(read_normals, photo)
    # Object space: unit vectors, all right but for pointing everywhere.
    ball = np.random.default_rng(0).normal(size=(32, 32, 3))
    ball /= np.linalg.norm(ball, axis=-1, keepdims=True)
    text = message(read_normals, ArrayImage(ball))
    assert "of its vectors point into the surface (blue below the middle)" in text
    assert read_normals(ArrayImage(ball * [1, 1, 0] + [0, 0, 0.7])) is not None


@pytest.mark.parametrize("mode", ["jpg", "tif"])
def test_cmyk_pictures(tmp_path: Path, mode: str) -> None:
    Image.fromarray(NOISE).convert("CMYK").save(tmp_path / f"a.{mode}")
    assert "is a CMYK picture" in message(read_colour, tmp_path / f"a.{mode}")


def test_cmyk_photoshop_files(tmp_path: Path) -> None:
    header = b"8BPS" + struct.pack(">H6xHIIHH", 1, 4, 6, 8, 8, 4)
    (tmp_path / "a.psd").write_bytes(header + bytes(12) + struct.pack(">H", 0) + bytes(192))
    assert "is a CMYK picture" in message(read_colour, tmp_path / "a.psd")


def test_channels_that_are_no_colour(tmp_path: Path) -> None:
    path = exr(tmp_path / "a.exr", np.ones((4, 4, 2)))
    assert "its channels are R, G; allowed: one, or R, G, B" in message(read_colour, path)


def test_several_pictures_in_one_file(tmp_path: Path) -> None:
    frames = [Image.fromarray(np.roll(NOISE, i, axis=0)) for i in range(3)]
    for name in ("a.tif", "a.webp"):
        frames[0].save(tmp_path / name, save_all=True, append_images=frames[1:])
        assert "holds several pictures" in message(read_colour, tmp_path / name)


def test_signed_integers(tmp_path: Path) -> None:
    spec = oiio.ImageSpec(4, 4, 1, "int16")
    file = oiio.ImageOutput.create(str(tmp_path / "a.tif"))
    assert file.open(str(tmp_path / "a.tif"), spec)
    assert file.write_image(np.zeros((4, 4, 1), np.int16))
    file.close()
    assert "holds int16 values; save it as unsigned" in message(read_height, tmp_path / "a.tif")


def test_exr_cut_out_of_a_larger_picture(tmp_path: Path) -> None:
    path = exr(tmp_path / "a.exr", np.ones((4, 4, 3)), x=2, y=1, full_width=16, full_height=8)
    assert "its data window (2, 1, 4, 4) differs from its display window (0, 0, 16, 8)" in message(read_colour, path)


@pytest.mark.parametrize("shape", [(4, 4, 5), (2, 3, 4, 3), (0, 4, 3), (4,)])
def test_arrays_of_wrong_shape(shape: tuple[int, ...]) -> None:
    assert "must be (H, W), (H, W, 1 to 4) or six faces" in message(read_colour, ArrayImage(np.zeros(shape)))


# Writing -------------------------------------------------------------------------------------------------------

LIGHT = NOISE / np.float32(255)


def test_wrong_targets(tmp_path: Path) -> None:
    assert "unknown suffix '.gfi'" in message(write_picture, tmp_path / "a.gfi", LIGHT)
    assert "did you mean '.png'?" in message(write_picture, tmp_path / "a.pngg", LIGHT)
    assert "choose one of: .png, .jpg, .jpeg, .webp, .exr" in message(write_picture, tmp_path / "a", LIGHT)
    assert "there is no directory" in message(write_picture, tmp_path / "none" / "a.png", LIGHT)
    (tmp_path / "a.png").mkdir()
    assert "is a directory" in message(write_picture, tmp_path / "a.png", LIGHT)
    os.mkfifo(tmp_path / "pipe.png")
    assert "is no regular file" in message(write_picture, tmp_path / "pipe.png", LIGHT)
    assert "cannot be written: file name too long" in message(write_picture, tmp_path / f"{'x' * 300}.png", LIGHT)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.png", "pipe.png"]


def test_write_protected_targets(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    target = tmp_path / "a.png"
    target.write_bytes(b"precious")
    # The superuser may write everywhere, so the answer of the system is put in its place.
    monkeypatch.setattr(os, "access", lambda path, mode: False)
    assert "is write-protected" in message(write_picture, target, LIGHT)
    assert target.read_bytes() == b"precious"


FULL_DISK = """
import json, resource, signal, sys
from pathlib import Path
import numpy as np
from glbump.errors import ImageError
from glbump.maps.images import write_picture

signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
limit = int(sys.argv[2])
resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))
for target in sorted(Path(sys.argv[1]).iterdir()):
    for side in (128, 16):
        try:
            write_picture(target, np.random.default_rng(0).random((side, side, 3)))
        except ImageError as error:
            print(json.dumps([target.name, side, str(error)]))
"""


@pytest.mark.parametrize("left", [0, 100, 1000, 20_000])
def test_full_disk(tmp_path: Path, left: int) -> None:
    """No file may grow past `left` bytes: the system refuses as on a full disk.

    Two sizes: one is refused while the library writes, one not before its last buffer, as it closes the file.
    """
    names = ["a.exr", "a.hdr", "a.jpg", "a.png", "a.tif", "a.webp"]
    for name in names:
        (tmp_path / name).write_bytes(b"before")
    command = [sys.executable, "-c", FULL_DISK, str(tmp_path), str(left)]
    # Writers that end the process, or never end, on a full disk exist; hence the process and the time.
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=True)
    assert done.stderr == ""
    failed = {(name, side): text for name, side, text in map(json.loads, done.stdout.splitlines())}
    assert all("cannot be written: " in text and "\n" not in text for text in failed.values())
    assert sorted(path.name for path in tmp_path.iterdir()) == names
    for name in names:
        assert (name, 128) in failed
        if (name, 16) in failed:
            assert (tmp_path / name).read_bytes() == b"before"
        else:
            assert read_picture(tmp_path / name).pixels.shape == (16, 16, 3)
    # A small .hdr has 1037 bytes, all of them in the library's buffer when it closes the file.
    assert (("a.hdr", 16) in failed) == (left <= 1000)


def test_a_failing_disk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def no_space(descriptor: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", no_space)
    assert "cannot be written: no space left on device" in message(write_atomically, tmp_path / "a", b"x")
    assert list(tmp_path.iterdir()) == []


def test_alpha_that_does_not_fit(tmp_path: Path) -> None:
    clear = np.full((4, 4, 4), 0.5, np.float32)
    for name in ("a.jpg", "a.hdr"):
        text = message(write_picture, tmp_path / name, clear)
        assert "holds no alpha" in text
        assert "write one of .png, .webp, .exr" in text
    assert list(tmp_path.iterdir()) == []


def test_values_that_do_not_fit(tmp_path: Path) -> None:
    dark = LIGHT - 1
    assert ".hdr holds no negative values; got -1; write .exr instead" in message(
        write_picture, tmp_path / "a.hdr", dark
    )
    broken = LIGHT.copy()
    broken[5, 6, 0] = np.nan
    for name in ("a.png", "a.exr", "a.tif"):
        assert "1 of 3072 pixels are NaN (first at row 5, column 6)" in message(write_picture, tmp_path / name, broken)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("wrong", [NOISE, np.zeros((0, 4, 3)), np.zeros((4, 4, 5)), np.zeros(4)])
def test_arrays_that_are_no_picture(tmp_path: Path, wrong: np.ndarray) -> None:
    assert "pixels must be" in message(write_picture, tmp_path / "a.png", wrong)


def test_display_values_go_to_display_formats(tmp_path: Path) -> None:
    assert "choose one of: .png, .jpg, .jpeg, .webp" in message(write_display, tmp_path / "a.exr", NOISE)
    too_wide = np.zeros((1, 20_000, 3), np.uint8)
    assert "cannot be written: " in message(write_display, tmp_path / "a.webp", too_wide)
    assert list(tmp_path.iterdir()) == []
