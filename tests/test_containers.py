"""Texture files: what a texture is, what its files give back, and what pictures are made of them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from test_damage import damage
from texture_files import message

from glbump.errors import GlbumpError, ImageError
from glbump.maps.containers import TextureLevels, is_texture, read_texture, texture_from_light, write_texture
from glbump.maps.containers.levels import level_sizes
from glbump.maps.cube import face_dir
from glbump.maps.images import linear_from_srgb, read_colour, read_height, read_picture

SUFFIXES = ("ktx2", "dds")
SHAPES = [(6, 8, 8), (6, 5, 5), (6, 1, 1), (1, 7, 5), (1, 1, 9), (1, 16, 8)]


def texture(faces: int, width: int, height: int, values: str = "half", channels: int = 4) -> TextureLevels:
    """Different at every texel of every level, so that a swap or a shift is seen. Alpha is 1."""
    rng = np.random.default_rng(0)
    levels = [rng.random((faces, h, w, channels)) for w, h in level_sizes(width, height)]
    for level in levels:
        level[..., 3:] = 1
    return texture_from_light(levels, values)


# Round trips ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("suffix", SUFFIXES)
@pytest.mark.parametrize("values", ["half", "float", "srgb"])
@pytest.mark.parametrize("channels", [3, 4])
def test_what_is_written_is_read_bit_for_bit(tmp_path: Path, suffix: str, values: str, channels: int) -> None:
    for shape in SHAPES:
        whole = texture(*shape, values, channels)
        for count in range(1, len(whole.levels) + 1):
            written = TextureLevels(whole.levels[:count], whole.srgb)
            path = tmp_path / f"a.{suffix}"
            write_texture(path, written)
            got = read_texture(path)
            assert (len(got.levels), got.srgb, got.is_cube) == (count, values == "srgb", shape[0] == 6)
            for level, want in zip(got.levels, written.levels):
                assert level.dtype == want.dtype
                assert level.flags.c_contiguous
                assert level[..., :channels].tobytes() == want.tobytes()
                # A DDS file has halves and bytes with alpha alone.
                assert level.shape[3] == (4 if suffix == "dds" and values != "float" else channels)
                assert (level[..., 3:] == (255 if values == "srgb" else 1)).all()
    assert [path.name for path in tmp_path.iterdir()] == [f"a.{suffix}"]


def test_every_bit_of_a_half_comes_back(tmp_path: Path) -> None:
    halves = np.arange(65536, dtype=np.uint16).view(np.float16)
    halves = np.append(halves[np.isfinite(halves)], np.zeros(2048, np.float16)).reshape(1, 128, 128, 4)
    for suffix in SUFFIXES:
        write_texture(tmp_path / f"a.{suffix}", TextureLevels((halves,)))
        assert read_texture(tmp_path / f"a.{suffix}").levels[0].tobytes() == halves.tobytes()


def test_linear_bytes(tmp_path: Path) -> None:
    """KTX2 says so of bytes; DDS cannot, and its readers would take them as sRGB."""
    linear = TextureLevels(texture(6, 4, 4, "srgb").levels, srgb=False)
    write_texture(tmp_path / "a.ktx2", linear)
    got = read_texture(tmp_path / "a.ktx2")
    assert not got.srgb
    assert all((a == b).all() for a, b in zip(got.levels, linear.levels))
    assert read_colour(tmp_path / "a.ktx2").pixels.max() == linear.levels[0][..., :3].max() / np.float32(255)
    with pytest.raises(ImageError, match=r"cannot say that 8-bit values are linear; write \.ktx2"):
        write_texture(tmp_path / "a.dds", linear)
    assert not (tmp_path / "a.dds").exists()


def test_faces_are_those_of_direct3d_and_of_opengl() -> None:
    """Direct3D's documentation ("Cubic Environment Mapping") renders the faces with these views, +X to -Z, in a
    left-handed system, where cross(up, ahead) points right in the picture."""
    ahead = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], float)
    up = np.array([[0, 1, 0], [0, 1, 0], [0, 0, -1], [0, 0, 1], [0, 1, 0], [0, 1, 0]], float)
    faces = np.arange(6)
    assert np.array_equal(face_dir(faces, 0.5, 0.5), ahead)
    assert np.array_equal(face_dir(faces, 1, 0.5) - ahead, np.cross(up, ahead))
    assert np.array_equal(face_dir(faces, 0.5, 0) - ahead, up)


# What a texture is ---------------------------------------------------------------------------------------------


def halves(*shapes: tuple[int, ...]) -> tuple[np.ndarray, ...]:
    return tuple(np.zeros(shape, np.float16) for shape in shapes)


@pytest.mark.parametrize(
    ("levels", "words"),
    [
        ((), "at least one level"),
        (halves((5, 4, 4, 3)), r"must be \(1 or 6, H, W, 3 or 4\) arrays, not empty; got \(5, 4, 4, 3\)"),
        (halves((4, 4, 3)), "must be .1 or 6"),
        (halves((1, 4, 4, 2)), "must be .1 or 6"),
        (halves((1, 0, 4, 3)), "not empty"),
        (halves((6, 4, 8, 3)), "faces of a cube map must be square; got 8x4"),
        (halves((6, 4, 4, 3), (6, 2, 2, 3), (6, 2, 2, 3)), "level 2 of a 4x4 texture must be .6, 1, 1, 3."),
        (halves((6, 4, 4, 3), (6, 1, 1, 3)), "level 1 of a 4x4 texture must be .6, 2, 2, 3."),
        (halves((6, 4, 4, 3), (5, 2, 2, 3)), "since each level halves the one before; got .5, 2, 2, 3."),
        (halves((1, 1, 1, 3), (1, 1, 1, 3)), "a 1x1 texture has at most 1 levels; got 2"),
        ((np.zeros((1, 2, 2, 3)),), "must be uint8, float16, float32; got float64"),
        ((np.zeros((1, 2, 2, 3), np.float32), np.zeros((1, 1, 1, 3), np.float16)), "level 1 .* of float16"),
    ],
)
def test_what_is_no_texture(levels: tuple[np.ndarray, ...], words: str) -> None:
    with pytest.raises(ImageError, match=words):
        TextureLevels(levels)


def test_srgb_is_of_bytes_alone() -> None:
    with pytest.raises(ImageError, match="float16 values are linear light"):
        TextureLevels(halves((1, 2, 2, 3)), srgb=True)


def test_level_sizes() -> None:
    assert level_sizes(7, 3) == [(7, 3), (3, 1), (1, 1)]
    assert level_sizes(1, 1) == [(1, 1)]
    assert len(level_sizes(2048, 1)) == 12


# Values --------------------------------------------------------------------------------------------------------


def test_halves_that_overflow_are_reported() -> None:
    light = np.ones((6, 2, 2, 3))
    light[4, 1, 0] = 1e5
    with pytest.raises(
        ImageError, match=r"level 0: 1 of 24 pixels \(first at row 9, column 0\) are past 65504.*100000"
    ):
        texture_from_light([light])
    with pytest.raises(ImageError, match="store it as float"):
        texture_from_light([-light])
    assert texture_from_light([light], "float").levels[0].max() == np.float32(1e5)
    light[4, 1, 0] = 65504
    assert texture_from_light([light]).levels[0].max() == 65504


@pytest.mark.parametrize("value", [-1e-3, 1.001, np.nan])
def test_bytes_hold_0_to_1(value: float) -> None:
    with pytest.raises(ImageError, match=r"1 of 4 pixels .* outside 0..1, which 8 bits hold; store it as half"):
        texture_from_light([np.array([[[[0, 1, 0.5], [0, 1, value]], [[0, 0, 0], [0, 0, 0]]]])], "srgb")


def test_bytes_are_srgb_and_alpha_is_not() -> None:
    made = texture_from_light([np.full((1, 1, 1, 4), 0.5)], "srgb")
    assert made.levels[0].tolist() == [[[[188, 188, 188, 128]]]]


def test_unknown_values() -> None:
    with pytest.raises(ImageError, match="unknown values of a texture 'halff'; did you mean 'half'"):
        texture_from_light([np.zeros((1, 1, 1, 3))], "halff")


@pytest.mark.parametrize("suffix", SUFFIXES)
@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_what_is_not_finite(tmp_path: Path, suffix: str, value: float) -> None:
    for values in ("half", "float"):
        broken = texture(6, 4, 4, values)
        path = tmp_path / f"a.{suffix}"
        write_texture(path, broken)
        content = path.read_bytes()
        broken.levels[1][2, 1, 0, 1] = value
        with pytest.raises(ImageError, match=r"level 1: 1 of 24 pixels \(first at row 5, column 0\) are not finite"):
            write_texture(path, broken)
        assert path.read_bytes() == content
        place = content.index(texture(6, 4, 4, values).levels[1][2, 1, 0].tobytes())
        item = broken.levels[0].itemsize
        path.write_bytes(
            content[: place + item] + broken.levels[1][2, 1, 0, 1:2].tobytes() + content[place + 2 * item :]
        )
        assert "level 1: 1 of 24 pixels (first at row 5, column 0) are not finite" in message(path)
        read_texture(path, base_only=True)


# Pictures ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("suffix", SUFFIXES)
@pytest.mark.parametrize("values", ["half", "float", "srgb"])
def test_a_cube_map_is_a_column_of_faces(tmp_path: Path, suffix: str, values: str) -> None:
    made, path = texture(6, 4, 4, values), tmp_path / "without a suffix"
    write_texture(tmp_path / f"a.{suffix}", made)
    (tmp_path / f"a.{suffix}").rename(path)
    picture = read_colour(path)
    want = made.levels[0].reshape(24, 4, 4)[..., :3]
    want = linear_from_srgb(want / 255) if values == "srgb" else want
    assert picture.pixels == pytest.approx(want.astype(np.float32), abs=1e-7 if values == "srgb" else 0)
    assert picture.envmap == "faces"  # Not "cube", OpenEXR's, which lies otherwise.
    assert (picture.bits, picture.is_float) == ({"half": 16, "float": 32, "srgb": 8}[values], values != "srgb")
    assert picture.name == str(path)


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_a_picture_in_a_texture_file(tmp_path: Path, suffix: str) -> None:
    grey = np.repeat(np.random.default_rng(1).random((1, 3, 5, 1)), 3, axis=3)
    write_texture(tmp_path / f"a.{suffix}", texture_from_light([grey], "float"))
    path = tmp_path / f"a.{suffix}"
    assert (read_height(path).pixels[..., 0] == grey[0, ..., 0].astype(np.float32)).all()
    assert read_picture(path).envmap is None
    assert read_picture(path).pixels.shape == (3, 5, 3)


def test_an_alpha_of_halves(tmp_path: Path) -> None:
    clear = np.full((1, 2, 2, 4), 0.25)
    write_texture(tmp_path / "a.ktx2", texture_from_light([clear]))
    assert (read_picture(tmp_path / "a.ktx2").pixels == 0.25).all()  # Straight: not divided.
    with pytest.raises(ImageError, match="must be opaque"):
        read_colour(tmp_path / "a.ktx2")


# Bad files and targets -----------------------------------------------------------------------------------------


def test_what_is_no_texture_file(tmp_path: Path) -> None:
    (tmp_path / "a.ktx2").write_bytes(b"A text, and no texture.\n" * 40)
    assert "is no texture file; allowed: KTX2 and DDS" in message(tmp_path / "a.ktx2")
    assert not is_texture(tmp_path / "a.ktx2")
    (tmp_path / "a.ktx").write_bytes(b"\xabKTX 11\xbb\r\n\x1a\n" + bytes(200))
    assert "is a KTX file of version 1; allowed: KTX2" in message(tmp_path / "a.ktx")
    with pytest.raises(ImageError, match="KTX file of version 1"):
        read_colour(tmp_path / "a.ktx")
    assert "no such file" in message(tmp_path / "none.dds")


def test_wrong_targets(tmp_path: Path) -> None:
    made = texture(1, 2, 2)
    with pytest.raises(ImageError, match=r"unknown suffix '\.ktx'; did you mean '\.ktx2'"):
        write_texture(tmp_path / "a.ktx", made)
    with pytest.raises(ImageError, match="there is no directory"):
        write_texture(tmp_path / "none" / "a.ktx2", made)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_limits(tmp_path: Path, suffix: str, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / f"a.{suffix}"
    write_texture(path, texture(6, 4, 4))
    monkeypatch.setenv("GLBUMP_MAX_PIXELS", "95")
    assert "is 4x24 = 96 pixels; at most 95: shrink it" in message(path)
    monkeypatch.setenv("GLBUMP_MAX_PIXELS", "96")
    # 6 x (16 + 4 + 1) texels of four floats.
    monkeypatch.setenv("GLBUMP_MAX_BYTES", "2015")
    assert "takes 2016 bytes decoded (4x24); at most 2015" in message(path)
    read_texture(path, base_only=True)
    monkeypatch.setenv("GLBUMP_MAX_BYTES", "2016")
    read_texture(path)


@pytest.mark.parametrize("suffix", SUFFIXES)
@pytest.mark.parametrize("kept", [0.01, 0.1, 0.3, 0.9, 0.999])
def test_truncated_files(tmp_path: Path, suffix: str, kept: float) -> None:
    path = tmp_path / f"a.{suffix}"
    write_texture(path, texture(6, 8, 8))
    content = path.read_bytes()
    path.write_bytes(content[: int(len(content) * kept)])
    assert "damaged or truncated" in message(path)
    path.write_bytes(content + bytes(8))
    assert "write it again" in message(path)


@pytest.mark.parametrize("suffix", SUFFIXES)
@pytest.mark.parametrize("values", ["half", "srgb"])
def test_seeded_damage(tmp_path: Path, suffix: str, values: str) -> None:
    """One line, or a texture of the same size with other texels; a lie about the size never fits the file."""
    path = tmp_path / f"a.{suffix}"
    whole = texture(6, 4, 4, values)
    write_texture(path, whole)
    content = path.read_bytes()
    rng = np.random.default_rng(5)
    refused: list[str] = []
    for case in range(400):
        # Every second one in the header, which is a small part of the file.
        broken = damage(content[:272], rng) + content[272:] if case % 2 else damage(content, rng)
        path.write_bytes(broken)
        try:
            got = read_texture(path)
        except GlbumpError as error:
            refused.append(str(error))
        else:
            assert sum(level.nbytes for level in got.levels) <= len(broken)
    assert len(refused) > 200
    assert [text for text in refused if "\n" in text] == []
