"""DDS files against Microsoft's documents, with numbers worked out by hand, and against OpenImageIO and Pillow."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest
from PIL import Image
from texture_files import changed, message, ramp, words, write_cube

from glbump.errors import ImageError
from glbump.maps.containers import TextureLevels, is_texture, read_texture, texture_from_light, write_texture
from glbump.maps.containers.levels import level_sizes
from glbump.maps.images import read_colour

# Byte offsets, "DDS_HEADER" behind the four bytes "DDS ", and "DDS_HEADER_DXT10".
SIZE, FLAGS, HEIGHT, WIDTH, PITCH, DEPTH, MIPS = range(4, 32, 4)
FORMAT, CAPS, CAPS2 = 76, 108, 112
DXGI, DIMENSION, MISC, ARRAY, ALPHA_MODE = range(128, 148, 4)


@pytest.fixture
def cube(tmp_path: Path) -> Path:
    return write_cube(tmp_path / "cube.dds")


# The bytes -----------------------------------------------------------------------------------------------------


def test_header_of_a_cube_of_halves(cube: Path) -> None:
    content = cube.read_bytes()
    assert content[:4] == b"DDS "
    # Size; CAPS, HEIGHT, WIDTH, PITCH, PIXELFORMAT, MIPMAPCOUNT; height, width; 2 x 8 bytes a row; depth; levels.
    assert words(content, SIZE, 7) == [124, 0x2100F, 2, 2, 16, 0, 2]
    assert content[32:FORMAT] == bytes(44)
    # Size 32, DDPF_FOURCC, "DX10"; no masks.
    assert words(content, FORMAT, 8) == [32, 4, 0x30315844, 0, 0, 0, 0, 0]
    # COMPLEX, TEXTURE, MIPMAP; CUBEMAP and all six faces.
    assert words(content, CAPS, 5) == [0x401008, 0xFE00, 0, 0, 0]
    # DXGI_FORMAT_R16G16B16A16_FLOAT, D3D10_RESOURCE_DIMENSION_TEXTURE2D, TEXTURECUBE, one cube, alpha mode unknown.
    assert words(content, DXGI, 5) == [10, 3, 4, 1, 0]
    # Each face with all its levels: 4 x 8 and 8 bytes. Half floats: 1.0 is 0x3C00, 1000 0x63D0, 1004 0x63D8, 16 0x4C00.
    assert len(content) == 148 + 6 * 40
    assert content[148:152] == bytes([0x00, 0x00, 0x00, 0x3C])
    assert content[148 + 32 : 148 + 34] == bytes([0xD0, 0x63])
    assert content[148 + 40 : 148 + 42] == bytes([0x00, 0x4C])
    assert content[148 + 72 : 148 + 74] == bytes([0xD8, 0x63])


def test_header_of_a_single_picture(tmp_path: Path) -> None:
    write_texture(tmp_path / "a.dds", texture_from_light([np.ones((1, 2, 3, 4))], "srgb"))
    content = (tmp_path / "a.dds").read_bytes()
    assert words(content, SIZE, 7) == [124, 0x100F, 2, 3, 12, 0, 1]
    assert words(content, CAPS, 2) == [0x1000, 0]
    assert words(content, DXGI, 5) == [29, 3, 0, 1, 0]  # DXGI_FORMAT_R8G8B8A8_UNORM_SRGB


def test_header_of_a_cube_with_one_level(tmp_path: Path) -> None:
    write_texture(tmp_path / "a.dds", texture_from_light([np.ones((6, 2, 2, 4))]))
    # COMPLEX as well: more than one surface.
    assert words((tmp_path / "a.dds").read_bytes(), CAPS, 2) == [0x1008, 0xFE00]


@pytest.mark.parametrize(("channels", "number"), [(3, 6), (4, 2)])
def test_the_numbers_of_floats(tmp_path: Path, channels: int, number: int) -> None:
    """DXGI_FORMAT_R32G32B32_FLOAT and DXGI_FORMAT_R32G32B32A32_FLOAT."""
    write_texture(tmp_path / "a.dds", texture_from_light([np.ones((1, 1, 1, channels))], "float"))
    assert words((tmp_path / "a.dds").read_bytes(), DXGI, 1) == [number]


# Other programs read it ----------------------------------------------------------------------------------------


def bytes_of(faces: int, width: int, height: int) -> TextureLevels:
    rng = np.random.default_rng(7)
    levels = [rng.integers(0, 256, (faces, h, w, 4), dtype=np.uint8) for w, h in level_sizes(width, height)]
    return TextureLevels(tuple(levels), srgb=True)


def test_openimageio_reads_every_level_of_a_picture(tmp_path: Path) -> None:
    """OpenImageIO 3.2 reads no floats in DDS; the texels lie alike."""
    made, path = bytes_of(1, 13, 6), tmp_path / "a.dds"
    write_texture(path, made)
    file = oiio.ImageInput.open(str(path))
    assert file.spec().get_string_attribute("oiio:ColorSpace").startswith("srgb")
    for number, level in enumerate(made.levels):
        got = file.read_image(0, number, 0, 4, oiio.UINT8)
        assert np.array_equal(got.reshape(level[0].shape), level[0]), number
    assert not file.seek_subimage(0, len(made.levels))


def test_openimageio_reads_the_faces_of_a_cube(tmp_path: Path) -> None:
    made, path = bytes_of(6, 8, 8), tmp_path / "a.dds"
    write_texture(path, made)
    file = oiio.ImageInput.open(str(path))
    assert file.spec().get_string_attribute("textureformat") == "CubeFace Environment"
    assert file.spec().get_string_attribute("dds:CubeMapSides") == "+x -x +y -y +z -z"
    assert np.array_equal(file.read_image(0, 0, 0, 4, oiio.UINT8), made.levels[0].reshape(48, 8, 4))


def test_pillow_reads_it(tmp_path: Path) -> None:
    made, path = bytes_of(1, 13, 6), tmp_path / "a.dds"
    write_texture(path, made)
    assert np.array_equal(np.asarray(Image.open(path)), made.levels[0][0])


# What other programs write -------------------------------------------------------------------------------------


@pytest.mark.parametrize("mode", ["RGB", "RGBA"])
def test_pillow_writes_it(tmp_path: Path, mode: str) -> None:
    texels = bytes_of(1, 5, 3).levels[0][0, ..., : len(mode)].copy()
    Image.fromarray(texels, mode).save(tmp_path / "a.dds")
    got = read_texture(tmp_path / "a.dds")
    assert np.array_equal(got.levels[0][0], texels)
    assert got.srgb


@pytest.mark.parametrize("form", ["DXT1", "DXT5"])
def test_block_compressed_pictures_are_openimageio_s(tmp_path: Path, form: str) -> None:
    Image.new("RGBA", (8, 4), (255, 0, 0, 255)).save(tmp_path / "a.dds", pixel_format=form)
    assert not is_texture(tmp_path / "a.dds")
    assert (read_colour(tmp_path / "a.dds").pixels == [1, 0, 0]).all()
    assert f"its texels are FourCC {form}, block-compressed or another" in message(tmp_path / "a.dds")


def old(path: Path, format_words: list[int], texels: bytes, *, faces: int = 0, flags: int = 0x1007) -> Path:
    """A file of Direct3D 9 of 2x2 texels: no extension, and as few flags as such writers set."""
    head = struct.pack("<4s7I44x", b"DDS ", 124, flags, 2, 2, 0, 0, 0)
    head += struct.pack("<8I", 32, *format_words) + struct.pack("<5I", 0x1008, 0x200 | faces if faces else 0, 0, 0, 0)
    path.write_bytes(head + texels)
    return path


FOURCC_HALF = [4, 113, 0, 0, 0, 0, 0]
FOURCC_FLOAT = [4, 116, 0, 0, 0, 0, 0]


@pytest.mark.parametrize(("numbers", "dtype"), [(FOURCC_HALF, np.float16), (FOURCC_FLOAT, np.float32)])
def test_floats_of_direct3d_9(tmp_path: Path, numbers: list[int], dtype: type) -> None:
    """D3DFMT_A16B16G16R16F (113) and D3DFMT_A32B32G32R32F (116) in a cube map, red first in memory."""
    texels = ramp(6, 2, 2, 4).astype(dtype)
    texels[..., 3] = 1
    path = old(tmp_path / "a.dds", numbers, texels.tobytes(), faces=0xFC00)
    got = read_texture(path)
    assert got.is_cube
    assert got.levels[0].dtype == dtype
    assert np.array_equal(got.levels[0], texels)
    assert np.array_equal(read_colour(path).pixels, texels.reshape(12, 2, 4)[..., :3])


@pytest.mark.parametrize(
    ("numbers", "texel", "rgba"),
    [
        ([0x41, 0, 32, 0xFF, 0xFF00, 0xFF0000, 0xFF000000], [1, 2, 3, 4], [1, 2, 3, 4]),
        ([0x41, 0, 32, 0xFF0000, 0xFF00, 0xFF, 0xFF000000], [3, 2, 1, 4], [1, 2, 3, 4]),
        ([0x40, 0, 32, 0xFF0000, 0xFF00, 0xFF, 0], [3, 2, 1, 77], [1, 2, 3]),
        ([0x40, 0, 24, 0xFF0000, 0xFF00, 0xFF, 0], [3, 2, 1], [1, 2, 3]),
        ([0x40, 0, 24, 0xFF, 0xFF00, 0xFF0000, 0], [1, 2, 3], [1, 2, 3]),
    ],
)
def test_masks(tmp_path: Path, numbers: list[int], texel: list[int], rgba: list[int]) -> None:
    got = read_texture(old(tmp_path / "a.dds", numbers, bytes(texel) * 4))
    assert got.levels[0].reshape(4, -1).tolist() == [rgba] * 4
    assert got.srgb


@pytest.mark.parametrize(
    ("number", "texel", "rgba"),
    [
        (28, [1, 2, 3, 4], [1, 2, 3, 4]),  # DXGI_FORMAT_R8G8B8A8_UNORM
        (29, [1, 2, 3, 4], [1, 2, 3, 4]),  # _SRGB
        (87, [3, 2, 1, 4], [1, 2, 3, 4]),  # DXGI_FORMAT_B8G8R8A8_UNORM
        (88, [3, 2, 1, 99], [1, 2, 3]),  # DXGI_FORMAT_B8G8R8X8_UNORM
        (91, [3, 2, 1, 4], [1, 2, 3, 4]),  # DXGI_FORMAT_B8G8R8A8_UNORM_SRGB
        (93, [3, 2, 1, 99], [1, 2, 3]),  # DXGI_FORMAT_B8G8R8X8_UNORM_SRGB
    ],
)
def test_bytes_of_dxgi(tmp_path: Path, number: int, texel: list[int], rgba: list[int]) -> None:
    path = old(
        tmp_path / "a.dds", [4, 0x30315844, 0, 0, 0, 0, 0], struct.pack("<5I", number, 3, 0, 1, 0) + bytes(texel) * 4
    )
    got = read_texture(path)
    assert got.levels[0].reshape(4, -1).tolist() == [rgba] * 4
    # UNORM says nothing of what the values mean: sRGB, as 8-bit colour in every kind of picture. OpenImageIO's too.
    assert got.srgb
    texels = oiio.ImageInput.open(str(path)).read_image(0, 0, 0, len(rgba), oiio.UINT8)
    assert texels.reshape(4, -1).tolist() == [rgba] * 4


def test_bytes_are_decoded(tmp_path: Path) -> None:
    write_texture(tmp_path / "a.dds", TextureLevels((np.full((6, 2, 2, 3), 188, np.uint8),), srgb=True))
    assert read_colour(tmp_path / "a.dds").pixels == pytest.approx(0.50289, abs=1e-5)


def test_a_cube_that_only_the_extension_names(cube: Path) -> None:
    whole = read_texture(cube)
    changed(cube, CAPS2, 0)
    assert all(np.array_equal(a, b) for a, b in zip(read_texture(cube).levels, whole.levels))


def test_other_uncompressed_pictures_are_openimageio_s(tmp_path: Path) -> None:
    """DXGI_FORMAT_R10G10B10A2_UNORM: red 1023 of 1023, alpha 3 of 3."""
    extension = struct.pack("<5I", 24, 3, 0, 1, 0)
    path = old(tmp_path / "a.dds", [4, 0x30315844, 0, 0, 0, 0, 0], extension + struct.pack("<4I", *[0xC00003FF] * 4))
    assert not is_texture(path)
    assert (read_colour(path).pixels == [1, 0, 0]).all()


# What is refused -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("at", "value", "said"),
    [
        (SIZE, 123, "its header's sizes are not those of a DDS file"),
        (FORMAT, 24, "its header's sizes are not those"),
        (HEIGHT, 0, "its header's sizes are not those"),
        (HEIGHT, 4, "faces of a cube map must be square; got 2x4"),
        (WIDTH, 2**32 - 1, "must be square"),
        (MIPS, 3, "2x2 with 3 levels; at most 2"),
        (MIPS, 1, "has 388 bytes; 6 x 2x2 with 1 level of DXGI format 10 take 340: its header leaves something out"),
        (CAPS2, 0x7E00, "has 5 of a cube map's 6 faces; write it with all six"),
        (CAPS2, 0x20FE00, "is no two-dimensional texture"),
        (DXGI, 2, "388 bytes; 6 x 2x2 with 2 levels of DXGI format 2 take 628"),
        (DXGI, 95, "its texels are DXGI format 95, block-compressed or another"),  # BC6H
        (DIMENSION, 4, "is no two-dimensional texture"),
        (ARRAY, 2, "is an array of 2"),
        (ALPHA_MODE, 2, "its colours are multiplied by alpha"),
        (FORMAT + 8, 113, "has 388 bytes; 6 x 2x2 with 2 levels of FourCC 113 take 368"),
        (FORMAT + 8, int.from_bytes(b"DXT5", "little"), "its texels are FourCC DXT5"),
    ],
)
def test_fields_that_are_wrong(cube: Path, at: int, value: int, said: str) -> None:
    read_texture(cube)
    text = message(changed(cube, at, value))
    assert said in text
    with pytest.raises(ImageError) as raised:
        read_colour(cube)  # A cube map never goes to OpenImageIO, which takes it for OpenEXR's.
    assert str(raised.value) == text


def test_pictures_without_the_cube_flags(cube: Path) -> None:
    changed(changed(cube, CAPS2, 0), MISC, 0)
    assert "has 388 bytes; 1 x 2x2 with 2 levels of DXGI format 10 take 188" in message(cube)


def test_five_faces_of_six(tmp_path: Path) -> None:
    path = old(tmp_path / "a.dds", FOURCC_HALF, bytes(5 * 32), faces=0xFC00 & ~0x2000)
    assert "has 5 of a cube map's 6 faces; write it with all six" in message(path)
    old(path, FOURCC_HALF, bytes(5 * 32), faces=0xFC00)
    assert "is damaged or truncated (288 bytes; 6 x 2x2 with 1 level of FourCC 113 take 320)" in message(path)


def test_a_volume_of_direct3d_9(tmp_path: Path) -> None:
    path = old(tmp_path / "a.dds", FOURCC_HALF, bytes(64), flags=0x801007)
    assert "is no two-dimensional texture" in message(changed(path, DEPTH, 2))


def test_odd_masks(tmp_path: Path) -> None:
    path = old(tmp_path / "a.dds", [0x41, 0, 32, 0x3FF, 0xFFC00, 0x3FF00000, 0xC0000000], bytes(24 * 16), faces=0xFC00)
    assert "its texels are 32-bit with the masks 0x3ff, 0xffc00, 0x3ff00000, 0xc0000000, block" in message(path)


@pytest.mark.parametrize("length", [4, 100, 127, 130])
def test_headers_that_are_cut_off(cube: Path, length: int) -> None:
    cube.write_bytes(cube.read_bytes()[:length])
    assert "is damaged or truncated" in message(cube)
    with pytest.raises(ImageError, match="damaged or truncated"):
        read_colour(cube)
