"""Textures with levels of our own making.

moderngl's TextureCube reads and writes level 0 alone, and its Texture gets levels from glGenerateMipmap alone, which
llvmpipe compiles anew in every process (a third of the time of a first picture), so these go to OpenGL itself.
"""

from __future__ import annotations

import ctypes
from collections.abc import Iterable, Sequence
from typing import Any

import moderngl
import numpy as np
import numpy.typing as npt

from glbump.errors import LimitError
from glbump.gl.context import Context

F32 = npt.NDArray[np.float32]

UPLOAD_UNIT = 15
"""Textures are bound here while they are filled: the last unit that OpenGL 3.3 promises, and none draws from it."""

_TEXTURE_2D, _TEXTURE_CUBE, CUBE_POSITIVE_X = 0x0DE1, 0x8513, 0x8515
_MAX_LEVEL, _UNPACK_ALIGNMENT = 0x813D, 0x0CF5
_RED, _RG, _RGB, _RGBA = 0x1903, 0x8227, 0x1907, 0x1908
_TYPES: dict[str, tuple[int, type[np.generic]]] = {
    "f2": (0x140B, np.float16),
    "f4": (0x1406, np.float32),
    "f1": (0x1401, np.uint8),
    "nu2": (0x1403, np.uint16),
    # Three codes in one integer, UNSIGNED_INT_2_10_10_10_REV; and 8 bits that are decoded before they are filtered.
    "rgb10": (0x8368, np.uint32),
    "srgb8": (0x1401, np.uint8),
}
_UNNAMED = ("rgb10", "srgb8")
"""What moderngl has no name for."""
# What OpenGL keeps, and what it is given.
_FORMATS = {
    ("f2", 1): (0x822D, _RED),
    ("f2", 2): (0x822F, _RG),
    ("f2", 3): (0x881B, _RGB),
    ("f2", 4): (0x881A, _RGBA),
    ("f4", 1): (0x822E, _RED),
    ("f4", 2): (0x8230, _RG),
    ("f4", 3): (0x8815, _RGB),
    ("f4", 4): (0x8814, _RGBA),
    ("f1", 2): (0x822B, _RG),
    ("f1", 3): (0x8051, _RGB),
    ("nu2", 2): (0x822C, _RG),
    ("nu2", 3): (0x8054, _RGB),
    ("rgb10", 1): (0x8059, _RGBA),
    ("srgb8", 3): (0x8C41, _RGB),
}


def texture_2d(context: Context, levels: Sequence[npt.NDArray[Any]], dtype: str) -> moderngl.Texture:
    """A texture with given levels, each (h, w, channels), every one half the size of the last, rounded down.

    dtype: "f2", "f4"; "f1", "nu2": 8 and 16 bits, read as 0..1; "srgb8": 8 bits, read as
    linear light; "rgb10": (h, w, 1), three codes in each integer.
    The levels need not go down to 1x1: look-ups past the last read the last.
    """
    height, width, channels = levels[0].shape
    pictures = [[(_TEXTURE_2D, level)] for level in levels]
    if dtype in _UNNAMED:
        texture = context.gl.texture((width, height), 4, dtype="f1")
        _fill(context, texture, _TEXTURE_2D, dtype, pictures, first=0)
        return texture
    data = np.ascontiguousarray(levels[0], _TYPES[dtype][1])
    texture = context.gl.texture((width, height), channels, data, dtype=dtype)
    _fill(context, texture, _TEXTURE_2D, dtype, pictures[1:])
    return texture


def cube_texture(context: Context, levels: Sequence[npt.NDArray[Any]], dtype: str) -> moderngl.TextureCube:
    """A cube texture with given levels, each (6, n, n, 3), every one half the size of the last; as `texture_2d`."""
    size = levels[0].shape[1]
    faces = [[(CUBE_POSITIVE_X + face, pixels) for face, pixels in enumerate(level)] for level in levels]
    if dtype in _UNNAMED:
        texture = context.gl.texture_cube((size, size), 4, dtype="f1")
        _fill(context, texture, _TEXTURE_CUBE, dtype, faces, first=0)
        return texture
    first = levels[0].astype(_TYPES[dtype][1], copy=False)
    texture = context.gl.texture_cube((size, size), 3, first.tobytes(), dtype=dtype)
    _fill(context, texture, _TEXTURE_CUBE, dtype, faces[1:])
    return texture


def generate_levels(context: Context, texture: moderngl.Texture | moderngl.TextureCube) -> None:
    """All levels of a texture from its first, by the driver; LimitError where it makes none of that format."""
    texture.build_mipmaps()
    if (error := context.gl.error) != "GL_NO_ERROR":
        raise LimitError(
            f"this driver makes no mip levels of {texture.components} channels of {texture.dtype!r} ({error}); "
            'say quality.pyramid "box", or a quality.texture_format of floats'
        )


def _fill(
    context: Context,
    texture: moderngl.Texture | moderngl.TextureCube,
    kind: int,
    dtype: str,
    levels: Iterable[Sequence[tuple[int, npt.NDArray[Any]]]],
    first: int = 1,
) -> None:
    """Levels `first` and on, each a list of (OpenGL's name of the picture, its pixels)."""
    i, u, p = ctypes.c_int, ctypes.c_uint, ctypes.c_void_p
    entry: Any = context.native.entry
    gl_type, numpy_type = _TYPES[dtype]
    texture.use(UPLOAD_UNIT)
    entry("glPixelStorei", u, i)(_UNPACK_ALIGNMENT, 1)
    write = entry("glTexImage2D", u, i, i, i, i, i, u, u, p)
    last = 0
    for last, pictures in enumerate(levels, first):
        for name, pixels in pictures:
            data = np.ascontiguousarray(pixels, numpy_type)
            height, width, channels = data.shape
            internal, given = _FORMATS[dtype, channels]
            write(name, last, internal, width, height, 0, given, gl_type, data.ctypes.data)
    entry("glTexParameteri", u, u, i)(kind, _MAX_LEVEL, last)
    texture.filter = (moderngl.LINEAR_MIPMAP_LINEAR if last else moderngl.LINEAR, moderngl.LINEAR)
