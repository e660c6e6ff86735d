"""KTX2 files: uncompressed pictures and cube maps with their levels.

Source: Khronos, KTX File Format Specification, version 2.0, revision 3 ("KTX 2.0"), and Khronos Data Format
Specification 1.3 ("KDF"), section 5, for the descriptor of the texels. All numbers are little-endian.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from math import lcm
from pathlib import Path

import numpy as np

from glbump.errors import ImageError
from glbump.maps.containers.levels import TextureFile, TextureLevels, level_sizes, truncated

IDENTIFIER = b"\xabKTX 20\xbb\r\n\x1a\n"

# (values, channels, sRGB) -> VkFormat: R8G8B8_UNORM, R8G8B8_SRGB, R8G8B8A8_UNORM, ..., R32G32B32A32_SFLOAT.
_VK_FORMATS = {
    ("uint8", 3, False): 23,
    ("uint8", 3, True): 29,
    ("uint8", 4, False): 37,
    ("uint8", 4, True): 43,
    ("float16", 3, False): 90,
    ("float16", 4, False): 97,
    ("float32", 3, False): 106,
    ("float32", 4, False): 109,
}
_TEXELS = {number: texel for texel, number in _VK_FORMATS.items()}

_SCHEMES = {1: "BasisLZ", 2: "Zstandard", 3: "zlib"}

# KDF 5.5 and 5.8: the colour model RGBSDA, the primaries of BT.709, transfer functions.
_RGBSDA, _BT709 = 1, 1
_UNSPECIFIED, _LINEAR, _SRGB = 0, 1, 2

# Keys that say the texels are not what they look like.
_CHANGING_KEYS = ("KTXcubemapIncomplete", "KTXmapRange", "KTXswizzle", "KTXanimData")

_HEADER = struct.Struct("<12s9I4I2Q")
_LEVEL = struct.Struct("<3Q")


@dataclass(frozen=True)
class _Header:
    """The fields of the header and the index, in the file's order."""

    identifier: bytes
    vk_format: int
    type_size: int
    width: int
    height: int
    depth: int
    layers: int
    faces: int
    levels: int
    supercompression: int
    dfd_offset: int
    dfd_length: int
    kvd_offset: int
    kvd_length: int
    sgd_offset: int
    sgd_length: int


def parse(path: Path) -> TextureFile:
    """What a KTX2 file's header says. ImageError for one that is damaged, or holds what is not read."""
    size = path.stat().st_size
    with path.open("rb") as file:
        content = file.read(_HEADER.size)
        if len(content) < _HEADER.size:
            raise truncated(path, f"{size} bytes; a KTX2 header has {_HEADER.size}")
        header = _Header(*_HEADER.unpack(content))
        dtype, channels, srgb = _texel(header, path)
        _check_shape(header, path)
        index = _index(file.read(_LEVEL.size * max(1, header.levels)), header, path)
        texel = np.dtype(dtype).itemsize * channels
        _check_levels(index, header, texel, size, path)
        _check_sections(header, index[-1][0], path)
        file.seek(header.dfd_offset)
        transfer = _transfer(file.read(header.dfd_length), texel, path)
        file.seek(header.kvd_offset)
        entries = dict(_entries(file.read(header.kvd_length), path))
    if (dtype != "uint8" and transfer == _SRGB) or (srgb and transfer != _SRGB):
        raise ImageError(f"{path}: its format and its transfer function contradict each other; write it again")
    flips = _flips(entries, header, path)
    face = [w * h * texel for w, h in level_sizes(header.width, header.height)]
    offsets = tuple(tuple(start + f * face[p] for f in range(header.faces)) for p, (start, _) in enumerate(index))
    # 8-bit colour of which nothing is said is sRGB, as in every other kind of picture.
    is_srgb = dtype == "uint8" and transfer != _LINEAR
    return TextureFile(
        path, dtype, channels, tuple(range(channels)), is_srgb, (header.width, header.height), offsets, *flips
    )


def _end(header: _Header) -> int:
    """The first byte after the level index."""
    return _HEADER.size + _LEVEL.size * max(1, header.levels)


def _texel(header: _Header, path: Path) -> tuple[str, int, bool]:
    if header.supercompression:
        scheme = _SCHEMES.get(header.supercompression, f"scheme {header.supercompression}")
        raise ImageError(
            f"{path}: is supercompressed ({scheme}), which is not read; write it without, as R16G16B16A16_SFLOAT"
        )
    if header.vk_format not in _TEXELS:
        raise ImageError(
            f"{path}: its texels are VkFormat {header.vk_format}, block-compressed or another that is not read; "
            "allowed: RGB and RGBA in 8 bits, half or float; convert it, to R16G16B16A16_SFLOAT for example"
        )
    texel = _TEXELS[header.vk_format]
    if header.type_size != np.dtype(texel[0]).itemsize:
        raise truncated(path, f"typeSize {header.type_size} does not fit VkFormat {header.vk_format}")
    return texel


def _check_shape(header: _Header, path: Path) -> None:
    width, height = header.width, header.height
    if header.depth or header.layers > 1 or not height:
        kind = "a volume" if header.depth else f"an array of {header.layers}" if height else "a line"
        raise ImageError(f"{path}: is {kind}; only pictures and cube maps are read: save the one you mean by itself")
    if header.faces not in (1, 6):
        raise ImageError(f"{path}: has {header.faces} faces; a cube map has 6, a picture 1; write it with all six")
    if header.faces == 6 and width != height:
        raise ImageError(f"{path}: the faces of a cube map must be square; got {width}x{height}")
    most = len(level_sizes(width, height))
    if not width or header.levels > most:
        raise truncated(path, f"{width}x{height} with {header.levels} levels; at most {most}")


def _index(content: bytes, header: _Header, path: Path) -> list[tuple[int, int]]:
    """(offset, length) of each level."""
    if len(content) < _end(header) - _HEADER.size:
        raise truncated(path, f"the index of its {header.levels} levels is cut off")
    levels = list(_LEVEL.iter_unpack(content))
    for p, (_, length, uncompressed) in enumerate(levels):
        if length != uncompressed:
            raise truncated(path, f"level {p} has {length} bytes and, uncompressed, {uncompressed}")
    return [(offset, length) for offset, length, _ in levels]


def _check_levels(index: list[tuple[int, int]], header: _Header, texel: int, size: int, path: Path) -> None:
    """ImageError unless each level has the bytes of its size, and they fill the file, smallest first."""
    sizes = level_sizes(header.width, header.height)
    for p, ((offset, length), (w, h)) in enumerate(zip(index, sizes)):
        if length != header.faces * w * h * texel:
            raise truncated(path, f"level {p} has {length} bytes; {w}x{h} needs {header.faces * w * h * texel}")
        if offset < _end(header) or offset + length > size:
            raise truncated(path, f"level {p} lies at bytes {offset} to {offset + length} of {size}")
    at = index[-1][0]
    for p, (offset, length) in reversed(list(enumerate(index))):
        at += -at % lcm(texel, 4)
        if offset != at:
            raise truncated(path, f"level {p} lies at byte {offset}; the levels before it end at {at}")
        at += length
    if at != size:
        raise ImageError(f"{path}: has {size - at} bytes after its level 0; write it again")


def _check_sections(header: _Header, first: int, path: Path) -> None:
    """ImageError unless index, descriptor, key/value data and texels, from byte `first`, follow one another."""
    end = header.dfd_offset + header.dfd_length
    follows = header.dfd_offset == _end(header) and header.kvd_offset == (end if header.kvd_length else 0)
    # Some writers fill up to a multiple of 8 or 16 before the texels. More may be a level that the header conceals.
    if not follows or not 0 <= first - end - header.kvd_length < 16:
        raise truncated(path, "its descriptor, key/value data and texels do not follow one another")


def _transfer(dfd: bytes, texel: int, path: Path) -> int:
    """The transfer function that the data format descriptor (KTX 2.0, 3.12) names."""
    if len(dfd) < 28 or len(dfd) % 4:
        raise truncated(path, f"its data format descriptor has {len(dfd)} bytes")
    total, kind, version, model, _, planes, more_planes = struct.unpack_from("<7I", dfd)
    colour_model, transfer, flags = model & 255, model >> 16 & 255, model >> 24
    if total != len(dfd) or kind != 0 or not 24 < version >> 16 <= len(dfd) - 4:
        raise truncated(path, "its data format descriptor does not add up")
    if colour_model != _RGBSDA or (planes, more_planes) != (texel, 0):
        raise truncated(path, "its data format descriptor is of another format than its header")
    if flags & 1:
        raise ImageError(f"{path}: its colours are multiplied by alpha; save it with straight alpha")
    if transfer not in (_UNSPECIFIED, _LINEAR, _SRGB):
        raise ImageError(f"{path}: its transfer function is number {transfer}; allowed: linear (1) and sRGB (2)")
    return transfer


def _entries(content: bytes, path: Path) -> Iterator[tuple[str, bytes]]:
    """The key/value pairs."""
    at = 0
    while at < len(content):
        length = int.from_bytes(content[at : at + 4], "little")
        pair = content[at + 4 : at + 4 + length]
        key, end, value = pair.partition(b"\0")
        if len(pair) < length or not key or not end:
            raise truncated(path, "its key/value data do not add up")
        yield key.decode("utf-8", "replace"), value
        at += 4 + length + -length % 4


def _flips(entries: dict[str, bytes], header: _Header, path: Path) -> tuple[bool, bool]:
    """Whether rows and columns are to be turned round, by KTXorientation."""
    for key in _CHANGING_KEYS:
        if key in entries:
            raise ImageError(f"{path}: its texels are changed by {key}, which is not read; write it without")
    text = entries.get("KTXorientation", b"rd").rstrip(b"\0")
    if text not in (b"rd", b"ru", b"ld", b"lu"):
        raise truncated(path, f"KTXorientation is {text[:8]!r}")
    if header.faces == 6 and text != b"rd":
        raise ImageError(f"{path}: the faces of a cube map must have KTXorientation rd; got {text.decode()}")
    return text[1:] == b"u", text[:1] == b"l"


def header(texture: TextureLevels) -> tuple[bytes, list[tuple[int, int]]]:
    """All that comes before the texels, and (level, zero bytes before it) in the order they are stored.

    KTXorientation rd is written for pictures and cubes: row 0 is the top.
    """
    first = texture.levels[0]
    faces, height, width, channels = first.shape
    texel, count = first.dtype.itemsize * channels, len(texture.levels)
    dfd = _descriptor(texture)
    pairs = b"".join(_pair(key, value) for key, value in (("KTXorientation", "rd"), ("KTXwriter", "glbump")))
    start = _HEADER.size + _LEVEL.size * count
    at = start + len(dfd) + len(pairs)
    index, order = [(0, 0, 0)] * count, []
    for p in reversed(range(count)):
        padding, length = -at % lcm(texel, 4), texture.levels[p].nbytes
        index[p] = (at + padding, length, length)
        order.append((p, padding))
        at += padding + length
    vk_format = _VK_FORMATS[first.dtype.name, channels, texture.srgb]
    shape = (vk_format, first.dtype.itemsize, width, height, 0, 0, faces, count, 0)
    sections = (start, len(dfd), start + len(dfd), len(pairs), 0, 0)
    head = _HEADER.pack(IDENTIFIER, *shape, *sections) + b"".join(_LEVEL.pack(*level) for level in index)
    return head + dfd + pairs, order


def _pair(key: str, value: str) -> bytes:
    pair = f"{key}\0{value}\0".encode()
    return struct.pack("<I", len(pair)) + pair + bytes(-len(pair) % 4)


def _descriptor(texture: TextureLevels) -> bytes:
    """The basic data format descriptor (KDF 5): one sample a channel, alpha linear always."""
    first = texture.levels[0]
    channels, bits, is_float = first.shape[3], 8 * first.dtype.itemsize, first.dtype != np.uint8
    # Of floats, the range is that of signed values: -1 and 1 as floats of 32 bits, whatever the texel has.
    low, high = struct.unpack("<2I", struct.pack("<2f", -1, 1)) if is_float else (0, 255)
    transfer = _SRGB if texture.srgb else _LINEAR
    block = 24 + 16 * channels
    words = [4 + block, 0, block << 16 | 2, transfer << 16 | _BT709 << 8 | _RGBSDA, 0, channels * bits // 8, 0]
    for c in range(channels):
        is_alpha = c == 3
        qualifiers = (0b1100 if is_float else 0) | (texture.srgb and is_alpha)  # float and signed; linear
        words += [qualifiers << 28 | (15 if is_alpha else c) << 24 | (bits - 1) << 16 | c * bits, 0, low, high]
    return struct.pack(f"<{len(words)}I", *words)
