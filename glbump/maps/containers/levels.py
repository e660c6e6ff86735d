"""A texture with its mip levels, as texture files hold it: values as stored, not decoded.

Cube faces lie +X -X +Y -Y +Z -Z, each s right and t down by the OpenGL table (`maps.cube`), in both kinds of file. KTX
2.0 ("faceCount": left-handed, +Y up, +Z ahead, +X on the right) and Direct3D (the views that its documentation renders
faces with, "Cubic Environment Mapping") call the axes left-handed, and their faces are the same pictures: each face of
the OpenGL table shows what lies around the origin mirrored, which is what a left-handed system sees unmirrored.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from glbump.errors import ImageError, unknown
from glbump.maps.colour import alpha_bytes, display_bytes
from glbump.maps.stored import count_and_first

Level = npt.NDArray[Any]

DTYPES = ("uint8", "float16", "float32")

HALF_MOST = 65504.0
"""The largest half float."""


@dataclass(frozen=True, eq=False)
class TextureLevels:
    """levels: (faces, H, W, C) arrays, finest first, each half of the one before (rounded down, at least 1).

    faces: 6 of a cube map, which are square, or 1. C: 3 (RGB) or 4 (RGBA, straight alpha). All of one type: float16 and
    float32 hold linear light, uint8 255ths. srgb: of uint8, whether the colours are sRGB-encoded, not linear.
    ImageError where the arrays are no such thing.
    """

    levels: tuple[Level, ...]
    srgb: bool = False

    def __post_init__(self) -> None:
        if not self.levels:
            raise ImageError("a texture must have at least one level; got none")
        first = self.levels[0]
        if first.ndim != 4 or first.shape[0] not in (1, 6) or first.shape[3] not in (3, 4) or first.size == 0:
            raise ImageError(f"a texture's levels must be (1 or 6, H, W, 3 or 4) arrays, not empty; got {first.shape}")
        if first.dtype.name not in DTYPES:
            raise ImageError(f"a texture's values must be {', '.join(DTYPES)}; got {first.dtype}; convert them")
        if self.srgb and first.dtype != np.uint8:
            raise ImageError(f"{first.dtype} values are linear light; only uint8 is sRGB-encoded")
        faces, height, width, channels = first.shape
        if faces == 6 and height != width:
            raise ImageError(f"the faces of a cube map must be square; got {width}x{height}")
        sizes = level_sizes(width, height)
        if len(self.levels) > len(sizes):
            raise ImageError(f"a {width}x{height} texture has at most {len(sizes)} levels; got {len(self.levels)}")
        for number, (level, (w, h)) in enumerate(zip(self.levels, sizes)):
            if level.shape != (faces, h, w, channels) or level.dtype != first.dtype:
                raise ImageError(
                    f"level {number} of a {width}x{height} texture must be {(faces, h, w, channels)} of {first.dtype}, "
                    f"since each level halves the one before; got {level.shape} of {level.dtype}"
                )

    @property
    def is_cube(self) -> bool:
        return self.levels[0].shape[0] == 6

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of level 0."""
        return self.levels[0].shape[2], self.levels[0].shape[1]


def level_sizes(width: int, height: int) -> list[tuple[int, int]]:
    """Width and height of every level down to 1x1: floor(size / 2^level), at least 1."""
    return [(max(1, width >> p), max(1, height >> p)) for p in range(max(width, height).bit_length())]


def texture_from_light(
    levels: Sequence[npt.NDArray[np.floating[Any]]], values: str = "half", *, name: str = "texture"
) -> TextureLevels:
    """Levels (faces, H, W, 3 or 4) of linear light with straight alpha, as they are to be stored.

    values: "half" (rounded to 11 bits, at most 65504), "float" (float32) or "srgb" (8 bits, 0..1).
    name: what messages call it. ImageError for what the values cannot hold; nothing is clamped.
    """
    store = {"half": _halves, "float": _floats, "srgb": _bytes}.get(values)
    if store is None:
        raise ImageError(unknown("values of a texture", values, ("half", "float", "srgb")))
    stored = tuple(store(np.asarray(level), f"{name}: level {p}") for p, level in enumerate(levels))
    return TextureLevels(stored, srgb=values == "srgb")


def _floats(level: Level, name: str) -> Level:
    return np.ascontiguousarray(level, np.float32)


def _halves(level: Level, name: str) -> Level:
    with np.errstate(over="ignore", invalid="ignore"):
        stored = level.astype(np.float16)
    over = np.isinf(stored) & np.isfinite(level)
    if over.any():
        raise ImageError(
            f"{name}: {_count(over)} are past {HALF_MOST:g}, the largest half float (up to "
            f"{np.abs(level[over]).max():g}); store it as float, or scale it down"
        )
    return stored


def _bytes(level: Level, name: str) -> Level:
    outside = ~((level >= 0) & (level <= 1))
    if outside.any():
        raise ImageError(f"{name}: {_count(outside)} are outside 0..1, which 8 bits hold; store it as half or float")
    colour, alpha = level[..., :3], level[..., 3:]
    return np.concatenate([display_bytes(colour), alpha_bytes(alpha)], axis=-1)


def column(level: Level) -> Level:
    """A level (faces, H, W, C) as one picture: the faces below one another, (faces H, W, C)."""
    return level.reshape(-1, *level.shape[2:])


def _count(bad: npt.NDArray[np.bool_]) -> str:
    return count_and_first(column(bad))


@dataclass(frozen=True)
class TextureFile:
    """What the header of a file says, checked against its size: where each image lies.

    dtype, channels: of the stored texels. order: which of them are R, G, B and, if there is one, A. offsets: of level p
    and face f, in bytes from the file's start. flip_rows, flip_columns: what makes s run right and t down.
    """

    path: Path
    dtype: str
    channels: int
    order: tuple[int, ...]
    srgb: bool
    size: tuple[int, int]
    offsets: tuple[tuple[int, ...], ...]
    flip_rows: bool = False
    flip_columns: bool = False

    @property
    def faces(self) -> int:
        return len(self.offsets[0])

    def read(self, count: int) -> TextureLevels:
        """The first `count` levels."""
        sizes = level_sizes(*self.size)
        with self.path.open("rb") as file:
            levels = tuple(self._level(file, offsets, size) for offsets, size in zip(self.offsets[:count], sizes))
        return TextureLevels(levels, self.srgb)

    def _level(self, file: Any, offsets: tuple[int, ...], size: tuple[int, int]) -> Level:
        width, height = size
        dtype = np.dtype(self.dtype).newbyteorder("<")
        level = np.empty((self.faces, height, width, self.channels), dtype)
        for face, offset in zip(level, offsets):
            file.seek(offset)
            if file.readinto(face.data.cast("B")) != face.nbytes:
                raise truncated(self.path, f"it ends before byte {offset + face.nbytes}")
        rows, columns = (slice(None, None, -1 if flip else 1) for flip in (self.flip_rows, self.flip_columns))
        turned = level[:, rows, columns]
        if self.order != tuple(range(self.channels)):
            turned = turned[..., list(self.order)]
        return np.ascontiguousarray(turned, self.dtype)


def truncated(path: Path, why: str) -> ImageError:
    return ImageError(f"{path}: is damaged or truncated ({why}); get a whole copy of it")
