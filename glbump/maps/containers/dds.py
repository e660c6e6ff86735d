"""DDS files: uncompressed pictures and cube maps with their levels.

Source: Microsoft, "Programming Guide for DDS", "DDS_HEADER", "DDS_HEADER_DXT10" and "DDS File Layout for Cubic
Environment Maps": faces +X -X +Y -Y +Z -Z, each with all its levels, rows and images without gaps.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from glbump.errors import ImageError
from glbump.maps.containers.levels import TextureFile, TextureLevels, level_sizes, truncated

MAGIC = b"DDS "

_CAPS, _HEIGHT, _WIDTH, _PITCH, _PIXELFORMAT, _MIPMAPCOUNT, _DEPTH = 1, 2, 4, 8, 0x1000, 0x20000, 0x800000
_ALPHAPIXELS, _FOURCC, _RGB = 1, 4, 0x40
_COMPLEX, _TEXTURE, _MIPMAP = 8, 0x1000, 0x400000
_CUBEMAP, _ALL_FACES, _VOLUME = 0x200, 0xFC00, 0x200000
_TEXTURE2D, _TEXTURECUBE = 3, 4
_PREMULTIPLIED = 2
_DX10 = int.from_bytes(b"DX10", "little")

_HEADER = struct.Struct("<4s7I44x8I3I8x")
_EXTENSION = struct.Struct("<5I")


@dataclass(frozen=True)
class _Texel:
    """Texels as stored; order: which of their channels are R, G, B and A."""

    dtype: str
    channels: int
    order: tuple[int, ...]
    srgb: bool = False


_RGBA, _BGRA, _BGRX = (0, 1, 2, 3), (2, 1, 0, 3), (2, 1, 0)

# DXGI_FORMAT. _UNORM does not say what its values mean: 8-bit colour is then sRGB, as in every other kind of picture.
_DXGI = {
    2: _Texel("float32", 4, _RGBA),  # R32G32B32A32_FLOAT
    6: _Texel("float32", 3, (0, 1, 2)),  # R32G32B32_FLOAT
    10: _Texel("float16", 4, _RGBA),  # R16G16B16A16_FLOAT
    28: _Texel("uint8", 4, _RGBA, True),  # R8G8B8A8_UNORM
    29: _Texel("uint8", 4, _RGBA, True),  # R8G8B8A8_UNORM_SRGB
    87: _Texel("uint8", 4, _BGRA, True),  # B8G8R8A8_UNORM
    88: _Texel("uint8", 4, _BGRX, True),  # B8G8R8X8_UNORM
    91: _Texel("uint8", 4, _BGRA, True),  # B8G8R8A8_UNORM_SRGB
    93: _Texel("uint8", 4, _BGRX, True),  # B8G8R8X8_UNORM_SRGB
}
_WRITTEN = {("float32", 4): 2, ("float32", 3): 6, ("float16", 4): 10, ("uint8", 4): 29}

# Direct3D 9's numbers in the place of a FourCC: A16B16G16R16F and A32B32G32R32F, which lie in memory as RGBA.
_FOURCCS = {113: _DXGI[10], 116: _DXGI[2]}

# (bits of a texel, masks of R, G and B) -> bytes of a texel, which of them are R, G, B.
_MASKS = {
    (24, 0xFF, 0xFF00, 0xFF0000): (3, (0, 1, 2)),
    (24, 0xFF0000, 0xFF00, 0xFF): (3, (2, 1, 0)),
    (32, 0xFF, 0xFF00, 0xFF0000): (4, (0, 1, 2)),
    (32, 0xFF0000, 0xFF00, 0xFF): (4, (2, 1, 0)),
}


@dataclass(frozen=True)
class _Header:
    """The fields of DDS_HEADER, and of DDS_HEADER_DXT10 where there is one, in the file's order."""

    magic: bytes
    size: int
    flags: int
    height: int
    width: int
    pitch: int
    depth: int
    levels: int
    format_size: int
    format_flags: int
    fourcc: int
    bits: int
    red: int
    green: int
    blue: int
    alpha: int
    caps: int
    caps2: int
    caps3: int
    dxgi: int = 0
    dimension: int = _TEXTURE2D
    misc: int = 0
    array_size: int = 1
    alpha_mode: int = 0

    @property
    def is_dx10(self) -> bool:
        return bool(self.format_flags & _FOURCC) and self.fourcc == _DX10

    @property
    def is_cube(self) -> bool:
        return bool(self.caps2 & _CUBEMAP) or (self.is_dx10 and bool(self.misc & _TEXTURECUBE))

    @property
    def texel(self) -> _Texel | None:
        """None for formats that are not read here."""
        if self.is_dx10:
            return _DXGI.get(self.dxgi)
        if self.format_flags & _FOURCC:
            return _FOURCCS.get(self.fourcc)
        known = _MASKS.get((self.bits, self.red, self.green, self.blue))
        if not self.format_flags & _RGB or known is None:
            return None
        channels, order = known
        if not self.format_flags & _ALPHAPIXELS:
            return _Texel("uint8", channels, order, True)
        return _Texel("uint8", channels, (*order, 3), True) if self.alpha == 0xFF000000 else None

    @property
    def form(self) -> str:
        """What the file calls its texels."""
        if self.is_dx10:
            return f"DXGI format {self.dxgi}"
        if self.format_flags & _FOURCC:
            text = self.fourcc.to_bytes(4, "little")
            return f"FourCC {text.decode()}" if text.isalnum() else f"FourCC {self.fourcc}"
        return f"{self.bits}-bit with the masks {self.red:#x}, {self.green:#x}, {self.blue:#x}, {self.alpha:#x}"


def is_read_here(path: Path) -> bool:
    """Whether a DDS file is for `parse`: a cube map, or texels that it knows. Other pictures are OpenImageIO's."""
    header = _header(path)
    return header.is_cube or header.texel is not None


def _header(path: Path) -> _Header:
    with path.open("rb") as file:
        content = file.read(_HEADER.size)
        if len(content) < _HEADER.size:
            raise truncated(path, f"{len(content)} bytes; a DDS header has {_HEADER.size}")
        header = _Header(*_HEADER.unpack(content))
        if not header.is_dx10:
            return header
        more = file.read(_EXTENSION.size)
    if len(more) < _EXTENSION.size:
        raise truncated(path, "its DX10 header is cut off")
    return _Header(*_HEADER.unpack(content), *_EXTENSION.unpack(more))


def parse(path: Path) -> TextureFile:
    """What a DDS file's header says. ImageError for one that is damaged, or holds what is not read."""
    header = _header(path)
    if header.size != 124 or header.format_size != 32 or not header.width or not header.height:
        raise truncated(path, "its header's sizes are not those of a DDS file")
    texel = header.texel
    if texel is None:
        raise ImageError(
            f"{path}: its texels are {header.form}, block-compressed or another that is not read with its faces and "
            "levels; allowed: RGBA in 8 bits, half or float; convert it, to R16G16B16A16_FLOAT for example"
        )
    _check_kind(header, path)
    faces = 6 if header.is_cube else 1
    sizes = level_sizes(header.width, header.height)
    # Some writers leave out the flag that says the count is there.
    count = max(1, header.levels)
    if count > len(sizes):
        raise truncated(path, f"{header.width}x{header.height} with {count} levels; at most {len(sizes)}")
    start = _HEADER.size + (_EXTENSION.size if header.is_dx10 else 0)
    lengths = [w * h * np.dtype(texel.dtype).itemsize * texel.channels for w, h in sizes[:count]]
    size, needed = path.stat().st_size, start + faces * sum(lengths)
    if size < needed:
        raise truncated(path, f"{size} bytes; {_contents(header, faces, count)} take {needed}")
    if size > needed:
        raise ImageError(
            f"{path}: has {size} bytes; {_contents(header, faces, count)} take {needed}: its header "
            "leaves something out; write it again"
        )
    offsets = tuple(tuple(start + f * sum(lengths) + sum(lengths[:p]) for f in range(faces)) for p in range(count))
    return TextureFile(
        path, texel.dtype, texel.channels, texel.order, texel.srgb, (header.width, header.height), offsets
    )


def _contents(header: _Header, faces: int, levels: int) -> str:
    return f"{faces} x {header.width}x{header.height} with {levels} level{'s' * (levels > 1)} of {header.form}"


def _check_kind(header: _Header, path: Path) -> None:
    if header.caps2 & _VOLUME or (header.flags & _DEPTH and header.depth > 1) or header.dimension != _TEXTURE2D:
        raise ImageError(f"{path}: is no two-dimensional texture; only pictures and cube maps are read")
    if header.array_size != 1:
        raise ImageError(f"{path}: is an array of {header.array_size}; save the one you mean by itself")
    if header.alpha_mode & 7 == _PREMULTIPLIED:
        raise ImageError(f"{path}: its colours are multiplied by alpha; save it with straight alpha")
    if header.is_cube and header.width != header.height:
        raise ImageError(f"{path}: the faces of a cube map must be square; got {header.width}x{header.height}")
    faces = (header.caps2 & _ALL_FACES).bit_count()
    if header.caps2 & _CUBEMAP and faces != 6:
        raise ImageError(f"{path}: has {faces} of a cube map's 6 faces; write it with all six")


def stored(texture: TextureLevels) -> TextureLevels:
    """The texture as a DDS file holds it: an opaque alpha is added where there is no format without it.

    ImageError for 8-bit values that are linear: a DDS file cannot say so, and readers decode them as sRGB.
    """
    first = texture.levels[0]
    if first.dtype == np.uint8 and not texture.srgb:
        raise ImageError("a DDS file cannot say that 8-bit values are linear; write .ktx2, or store half floats")
    if (first.dtype.name, first.shape[3]) in _WRITTEN:
        return texture
    one = 255 if first.dtype == np.uint8 else 1
    opaque = ((0, 0), (0, 0), (0, 0), (0, 1))
    return TextureLevels(tuple(np.pad(level, opaque, constant_values=one) for level in texture.levels), texture.srgb)


def header(texture: TextureLevels) -> bytes:
    """DDS_HEADER with its extension, of a texture as `stored` returns it."""
    first = texture.levels[0]
    faces, height, width, channels = first.shape
    count = len(texture.levels)
    is_cube, has_levels = faces == 6, count > 1
    flags = _CAPS | _HEIGHT | _WIDTH | _PIXELFORMAT | _PITCH | (_MIPMAPCOUNT * has_levels)
    pitch = width * channels * first.dtype.itemsize
    caps = _TEXTURE | (_COMPLEX * (is_cube or has_levels)) | (_MIPMAP * has_levels)
    caps2 = (_CUBEMAP | _ALL_FACES) * is_cube
    texel_format = (32, _FOURCC, _DX10, 0, 0, 0, 0, 0)
    head = _HEADER.pack(MAGIC, 124, flags, height, width, pitch, 0, count, *texel_format, caps, caps2, 0)
    # The alpha mode stays 0, unknown: old readers refuse any other.
    misc = _TEXTURECUBE * is_cube
    return head + _EXTENSION.pack(_WRITTEN[first.dtype.name, channels], _TEXTURE2D, misc, 1, 0)
