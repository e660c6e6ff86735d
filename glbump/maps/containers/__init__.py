"""Texture files: pictures and cube maps with all their levels, in KTX2 and DDS.

Read and written here, without compression, since what is read has to be what was written, bit for bit, and no library
that this project uses writes either; block-compressed DDS pictures (not cubes) are OpenImageIO's (`maps.stored`).
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import BinaryIO

from glbump.errors import ImageError, unknown
from glbump.maps.containers import dds, ktx2
from glbump.maps.containers.levels import Level, TextureLevels, column, level_sizes, texture_from_light
from glbump.maps.files import write_atomically
from glbump.maps.stored import check_file, require_finite, require_size

__all__ = ["TEXTURE_SUFFIXES", "TextureLevels", "is_texture", "read_texture", "texture_from_light", "write_texture"]

TEXTURE_SUFFIXES = (".ktx2", ".dds")

_KTX1 = b"\xabKTX 11\xbb\r\n\x1a\n"


def is_texture(path: Path) -> bool:
    """Whether `read_texture` is for this file: KTX2, or a DDS file that is no picture for OpenImageIO."""
    with path.open("rb") as file:
        begin = file.read(len(ktx2.IDENTIFIER))
    return begin in (ktx2.IDENTIFIER, _KTX1) or (begin[:4] == dds.MAGIC and dds.is_read_here(path))


def read_texture(path: str | os.PathLike[str], *, base_only: bool = False) -> TextureLevels:
    """The texture in a KTX2 or DDS file, known by its first bytes: values as stored, s right and t down.

    base_only: only level 0; the header is checked all the same. ImageError, before anything large is allocated, for a
    damaged file, one past the limits of pictures, and what is not read: supercompressed or block-compressed texels,
    arrays, volumes, incomplete cubes; and for values that are not finite.
    """
    path = Path(path)
    check_file(path)
    with path.open("rb") as opened:
        begin = opened.read(len(ktx2.IDENTIFIER))
    if begin == ktx2.IDENTIFIER:
        file = ktx2.parse(path)
    elif begin[:4] == dds.MAGIC:
        file = dds.parse(path)
    else:
        found = "a KTX file of version 1" if begin == _KTX1 else "no texture file"
        raise ImageError(f"{path}: is {found}; allowed: KTX2 and DDS; convert it to one of these")
    count = 1 if base_only else len(file.offsets)
    width, height = file.size
    share = sum(w * h for w, h in level_sizes(width, height)[:count]) / (width * height)
    require_size(str(path), width, file.faces * height, file.channels * share)
    texture = file.read(count)
    _require_finite(texture, str(path))
    return texture


def write_texture(path: str | os.PathLike[str], texture: TextureLevels) -> None:
    """Write a texture with all its levels to .ktx2 or .dds, whole or not at all.

    A .dds holds three channels only in floats: to halves and bytes an opaque alpha is added. Values are written as they
    are. ImageError for values that are not finite, an unknown suffix, a target that cannot be written.
    """
    path = Path(path)
    suffix = path.suffix.lower()
    if suffix not in TEXTURE_SUFFIXES:
        raise ImageError(f"{path}: {unknown('suffix', path.suffix, TEXTURE_SUFFIXES)}")
    _require_finite(texture, str(path))
    write = _write_ktx2 if suffix == ".ktx2" else _write_dds

    def content(beside: Path) -> None:
        with beside.open("wb") as file:
            write(file, texture)

    write_atomically(path, content)


def _write_ktx2(file: BinaryIO, texture: TextureLevels) -> None:
    head, order = ktx2.header(texture)
    file.write(head)
    for p, padding in order:
        file.write(bytes(padding))
        file.write(_little(texture.levels[p]))


def _write_dds(file: BinaryIO, texture: TextureLevels) -> None:
    texture = dds.stored(texture)
    file.write(dds.header(texture))
    for face in range(texture.levels[0].shape[0]):
        for level in texture.levels:
            file.write(_little(level[face]))


def _little(texels: Level) -> memoryview:
    """The texels' bytes, lowest first."""
    return texels.astype(texels.dtype.newbyteorder("<"), order="C", copy=False).data.cast("B")


def _require_finite(texture: TextureLevels, name: str) -> None:
    if texture.levels[0].dtype.kind == "f":
        for p, level in enumerate(texture.levels):
            require_finite(column(level), f"{name}: level {p}" if p else name)
