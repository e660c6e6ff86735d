"""KTX2 files against the specification: numbers worked out by hand from KTX 2.0 and the Khronos Data Format 1.3."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest
from texture_files import changed, message, ramp, words, write_cube

from glbump.maps.containers import TextureLevels, read_texture, texture_from_light, write_texture
from glbump.maps.images import read_colour

# KTX 2.0, section 3.1.
IDENTIFIER = bytes([0xAB, 0x4B, 0x54, 0x58, 0x20, 0x32, 0x30, 0xBB, 0x0D, 0x0A, 0x1A, 0x0A])

# Byte offsets of header fields, section 2.
VK_FORMAT, TYPE_SIZE, WIDTH, HEIGHT, DEPTH, LAYERS, FACES, LEVELS, SCHEME = range(12, 48, 4)
DFD, KVD, SGD, INDEX = 48, 56, 64, 80


@pytest.fixture
def cube(tmp_path: Path) -> Path:
    return write_cube(tmp_path / "cube.ktx2")


# The bytes -----------------------------------------------------------------------------------------------------


def test_header_of_a_cube_of_halves(cube: Path) -> None:
    content = cube.read_bytes()
    assert content[:12] == IDENTIFIER
    # VK_FORMAT_R16G16B16A16_SFLOAT, typeSize, width, height, depth, layers, faces, levels, scheme.
    assert words(content, 12, 9) == [97, 2, 2, 2, 0, 0, 6, 2, 0]
    # Header 80, index 2 x 24: descriptor at 128 of 4 + 24 + 4 x 16 = 92 bytes; key/value data at 220 of 48 bytes.
    assert words(content, DFD, 4) == [128, 92, 220, 48]
    assert content[SGD:INDEX] == bytes(16)
    # 268 is rounded up to a multiple of lcm(8, 4): the smaller level comes first, 6 x 8 bytes, then 6 x 4 x 8.
    assert struct.unpack_from("<6Q", content, INDEX) == (320, 192, 192, 272, 48, 48)
    assert content[268:272] == bytes(4)
    assert len(content) == 512
    # Half floats: 1000 is 0x63D0, 1001 0x63D2 (steps of 1/2: 2^9 (1 + 488/512)); 1.0 is 0x3C00, 2.0 0x4000.
    assert content[272:276] == bytes([0xD0, 0x63, 0xD2, 0x63])
    assert content[320:326] == bytes([0x00, 0x00, 0x00, 0x3C, 0x00, 0x40])


def test_descriptor_of_halves(cube: Path) -> None:
    # KDF 1.3, section 5: total size; vendor and type 0; version 2 and block size 88; RGBSDA, BT.709, linear, straight;
    # texel block 1x1x1x1; 8 bytes in plane 0. Then the samples: bit offset, length - 1, channel (alpha is 15) with the
    # bits F and S; position; -1.0 and 1.0 as floats of 32 bits.
    low, high = 0xBF800000, 0x3F800000
    assert words(cube.read_bytes(), 128, 23) == [
        *(92, 0, 88 << 16 | 2, 0x00010101, 0, 8, 0),
        *(0xC00F0000, 0, low, high),
        *(0xC10F0010, 0, low, high),
        *(0xC20F0020, 0, low, high),
        *(0xCF0F0030, 0, low, high),
    ]


def test_descriptor_of_floats_and_of_bytes(tmp_path: Path) -> None:
    path = tmp_path / "a.ktx2"
    write_texture(path, texture_from_light([np.ones((1, 1, 1, 3))], "float"))
    # One level: header and index have 104 bytes. VK_FORMAT_R32G32B32_SFLOAT, 12 bytes a texel.
    assert words(path.read_bytes(), VK_FORMAT, 2) == [106, 4]
    assert words(path.read_bytes(), 104, 11) == [
        *(76, 0, 72 << 16 | 2, 0x00010101, 0, 12, 0),
        *(0xC01F0000, 0, 0xBF800000, 0x3F800000),
    ]
    write_texture(path, texture_from_light([np.ones((1, 1, 1, 4))], "srgb"))
    # VK_FORMAT_R8G8B8A8_SRGB: transfer sRGB (2); alpha has the bit L, for linear.
    assert words(path.read_bytes(), VK_FORMAT, 2) == [43, 1]
    assert words(path.read_bytes(), 104, 23) == [
        *(92, 0, 88 << 16 | 2, 0x00020101, 0, 4, 0),
        *(0x00070000, 0, 0, 255),
        *(0x01070008, 0, 0, 255),
        *(0x02070010, 0, 0, 255),
        *(0x1F070018, 0, 0, 255),
    ]
    write_texture(path, TextureLevels((np.zeros((1, 1, 1, 3), np.uint8),)))
    # VK_FORMAT_R8G8B8_UNORM.
    assert words(path.read_bytes(), VK_FORMAT, 2) == [23, 1]
    assert words(path.read_bytes(), 104, 4) == [76, 0, 72 << 16 | 2, 0x00010101]


@pytest.mark.parametrize(
    ("values", "channels", "srgb", "number"),
    [
        ("uint8", 3, True, 29),  # VK_FORMAT_R8G8B8_SRGB
        ("uint8", 4, False, 37),  # VK_FORMAT_R8G8B8A8_UNORM
        ("float16", 3, False, 90),  # VK_FORMAT_R16G16B16_SFLOAT
        ("float32", 4, False, 109),  # VK_FORMAT_R32G32B32A32_SFLOAT
    ],
)
def test_the_other_numbers_of_vulkan(tmp_path: Path, values: str, channels: int, srgb: bool, number: int) -> None:
    write_texture(tmp_path / "a.ktx2", TextureLevels((np.zeros((1, 1, 1, channels), values),), srgb))
    assert words((tmp_path / "a.ktx2").read_bytes(), VK_FORMAT, 1) == [number]


def test_key_value_data(cube: Path) -> None:
    # Sorted by key; length, key, NUL, value, NUL, and zeros to a multiple of 4. The first is the specification's own.
    orientation = bytes.fromhex("12000000 4b54586f7269656e746174696f6e00 726400 0000")
    writer = struct.pack("<I", 17) + b"KTXwriter\0glbump\0" + bytes(3)
    assert cube.read_bytes()[220:268] == orientation + writer


def test_levels_of_texels_whose_size_is_no_multiple_of_4(tmp_path: Path) -> None:
    """Six bytes a texel: levels begin at multiples of lcm(6, 4) = 12."""
    path = tmp_path / "a.ktx2"
    write_texture(path, texture_from_light([ramp(1, 3, 3, 3), ramp(1, 1, 1, 3)]))
    # Header and index 128, descriptor 76, key/value data 48: 252 = 21 x 12. Level 1: 6 bytes; 258 becomes 264.
    assert struct.unpack_from("<6Q", path.read_bytes(), INDEX) == (264, 54, 54, 252, 6, 6)
    assert path.stat().st_size == 318


# Reading what others write -------------------------------------------------------------------------------------


def test_the_example_of_the_specification_is_refused_in_one_line(tmp_path: Path) -> None:
    """The header and index of KTX 2.0, section 6: 8x8 ETC1S texels in BasisLZ."""
    header = IDENTIFIER + struct.pack("<9I", 0, 1, 8, 8, 0, 0, 1, 1, 1)
    index = struct.pack("<4I2Q3Q", 0x68, 0x3C, 0xA4, 0x58, 0x100, 0x8C, 0x18C, 3, 0)
    (tmp_path / "a.ktx2").write_bytes(header + index + bytes(0x18F - 104))
    assert "is supercompressed (BasisLZ), which is not read; write it without" in message(tmp_path / "a.ktx2")


def other_writer(
    path: Path, orientation: bytes = b"", *, levels: int = 1, transfer: int = 1, more: bytes = b""
) -> Path:
    """A 2x2 picture of bytes RGBA as another program would write it: with what key/value data is told, no more."""
    pairs = b""
    if orientation:
        pair = b"KTXorientation\0" + orientation
        pairs = struct.pack("<I", len(pair)) + pair + bytes(-len(pair) % 4)
    pairs += more
    dfd = struct.pack("<7I", 92, 0, 88 << 16 | 2, transfer << 16 | 0x0101, 0, 4, 0)
    dfd += b"".join(struct.pack("<4I", c << 24 | 7 << 16 | 8 * i, 0, 0, 255) for i, c in enumerate((0, 1, 2, 15)))
    start = 104 + 92 + len(pairs)
    start += -start % 4
    header = IDENTIFIER + struct.pack("<9I", 37, 1, 2, 2, 0, 0, 1, levels, 0)
    header += struct.pack("<4I2Q3Q", 104, 92, 196 if pairs else 0, len(pairs), 0, 0, start, 16, 16)
    content = header + dfd + pairs
    texels = bytes([10, 20, 30, 255, 40, 50, 60, 255, 70, 80, 90, 255, 100, 110, 120, 255])
    path.write_bytes(content + bytes(start - len(content)) + texels)
    return path


def test_without_key_value_data_and_with_levels_to_be_made(tmp_path: Path) -> None:
    got = read_texture(other_writer(tmp_path / "a.ktx2", levels=0))
    assert got.levels[0][0, :, :, 0].tolist() == [[10, 40], [70, 100]]
    assert len(got.levels) == 1


@pytest.mark.parametrize(
    ("orientation", "red"),
    [
        (b"rd\0", [[10, 40], [70, 100]]),
        (b"rd", [[10, 40], [70, 100]]),
        (b"ru\0", [[70, 100], [10, 40]]),
        (b"ld\0", [[40, 10], [100, 70]]),
        (b"lu\0", [[100, 70], [40, 10]]),
    ],
)
def test_orientation_is_obeyed(tmp_path: Path, orientation: bytes, red: list[list[int]]) -> None:
    assert read_texture(other_writer(tmp_path / "a.ktx2", orientation)).levels[0][0, :, :, 0].tolist() == red


@pytest.mark.parametrize(("transfer", "linear"), [(0, False), (1, True), (2, False)])
def test_transfer_functions_of_bytes(tmp_path: Path, transfer: int, linear: bool) -> None:
    """Unspecified and sRGB are decoded, linear is not."""
    path = other_writer(tmp_path / "a.ktx2", transfer=transfer)
    assert read_texture(path).srgb is not linear
    assert read_colour(path).pixels[1, 1, 0] == pytest.approx(100 / 255 if linear else 0.127438, abs=1e-6)


def pair(key: str, value: bytes) -> bytes:
    content = key.encode() + b"\0" + value
    return struct.pack("<I", len(content)) + content + bytes(-len(content) % 4)


@pytest.mark.parametrize("key", ["KTXcubemapIncomplete", "KTXmapRange", "KTXswizzle", "KTXanimData"])
def test_keys_that_change_the_texels(tmp_path: Path, key: str) -> None:
    path = other_writer(tmp_path / "a.ktx2", more=pair(key, b"\x1f"))
    assert f"its texels are changed by {key}, which is not read" in message(path)
    read_texture(other_writer(tmp_path / "a.ktx2", more=pair("other", b"\x1f")))


@pytest.mark.parametrize("more", [b"\xff\0\0\0KTX\0", b"\3\0\0\0abc\0", b"\2\0\0\0\0a\0\0"])
def test_damaged_key_value_data(tmp_path: Path, more: bytes) -> None:
    assert "its key/value data do not add up" in message(other_writer(tmp_path / "a.ktx2", more=more))


def test_unknown_orientation(tmp_path: Path) -> None:
    assert "KTXorientation is b'dr'" in message(other_writer(tmp_path / "a.ktx2", b"dr\0"))


# What is refused -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("at", "value", "said"),
    [
        (VK_FORMAT, 131, "VkFormat 131, block-compressed or another that is not read; allowed: RGB and RGBA"),  # BC1
        (VK_FORMAT, 109, "typeSize 2 does not fit VkFormat 109"),
        (VK_FORMAT, 90, "level 0 has 192 bytes; 2x2 needs 144"),
        (TYPE_SIZE, 1, "typeSize 1 does not fit"),
        (WIDTH, 3, "faces of a cube map must be square; got 3x2"),
        (WIDTH, 0, "must be square; got 0x2"),
        (HEIGHT, 0, "is a line; only pictures and cube maps are read"),
        (DEPTH, 2, "is a volume"),
        (LAYERS, 3, "is an array of 3"),
        (FACES, 5, "has 5 faces; a cube map has 6, a picture 1; write it with all six"),
        (FACES, 1, "level 0 has 192 bytes; 2x2 needs 32"),
        (LEVELS, 3, "2x2 with 3 levels; at most 2"),
        (LEVELS, 1, "do not follow one another"),
        (LEVELS, 2**32 - 1, "at most 2"),
        (SCHEME, 2, "is supercompressed (Zstandard), which is not read"),
        (SCHEME, 9, "is supercompressed (scheme 9)"),
        (DFD, 40, "do not follow one another"),
        (DFD + 4, 2**32 - 1, "do not follow one another"),
        (DFD + 4, 24, "do not follow one another"),
        (DFD + 4, 88, "do not follow one another"),
        (128, 88, "its data format descriptor does not add up"),
        (128 + 4, 1, "its data format descriptor does not add up"),
        (128 + 8, 93 << 16 | 2, "its data format descriptor does not add up"),
        (KVD, 2**32 - 1, "do not follow one another"),
        (KVD + 4, 44, "its key/value data do not add up"),
        (INDEX, 328, "level 0 lies at bytes 328 to 520 of 512"),
        (INDEX, 312, "level 0 lies at byte 312; the levels before it end at 320"),
        (INDEX + 8, 184, "level 0 has 184 bytes and, uncompressed, 192"),
        (INDEX + 24, 264, "level 0 lies at byte 320; the levels before it end at 312"),
        (INDEX + 24, 64, "level 1 lies at bytes 64 to 112"),
        (128 + 12, 0x00010102, "its data format descriptor is of another format"),
        (128 + 12, 0x00050101, "its transfer function is number 5"),
        (128 + 12, 0x00020101, "its format and its transfer function contradict each other"),
        (128 + 12, 0x01010101, "its colours are multiplied by alpha"),
        (128 + 20, 16, "its data format descriptor is of another format"),
    ],
)
def test_fields_that_are_wrong(cube: Path, at: int, value: int, said: str) -> None:
    read_texture(cube)
    assert said in message(changed(cube, at, value))


def test_levels_that_do_not_halve(cube: Path) -> None:
    changed(changed(cube, INDEX + 32, 96, 8), INDEX + 40, 96, 8)
    assert "level 1 has 96 bytes; 1x1 needs 48" in message(cube)


def test_a_level_that_the_header_conceals(tmp_path: Path) -> None:
    """One level of two: the header of a file with one, and the texels of both."""
    path = tmp_path / "a.ktx2"
    write_texture(path, texture_from_light([ramp(6, 2, 2, 4)]))
    content = path.read_bytes()
    path.write_bytes(content[:248] + bytes(48) + content[248:])
    assert struct.unpack_from("<Q", content, INDEX) == (248,)
    assert "do not follow one another" in message(changed(path, INDEX, 248 + 48))


def test_cubes_of_another_orientation(cube: Path) -> None:
    content = cube.read_bytes().replace(b"orientation\0rd", b"orientation\0ru")
    cube.write_bytes(content)
    assert "faces of a cube map must have KTXorientation rd; got ru" in message(cube)
