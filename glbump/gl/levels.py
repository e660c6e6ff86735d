"""Levels of cube textures: moderngl's TextureCube reads and writes level 0 alone, so these go to OpenGL itself."""

from __future__ import annotations

import ctypes
from collections.abc import Sequence

import moderngl
import numpy as np
import numpy.typing as npt

from glbump.gl.context import Context

_CUBE_POSITIVE_X = 0x8515
_RGB = 0x1907
_TYPES = {"f2": (0x140B, np.float16), "f4": (0x1406, np.float32)}
_UNPACK_ALIGNMENT = 0x0CF5


def cube_texture(context: Context, levels: Sequence[npt.NDArray[np.float32]], dtype: str) -> moderngl.TextureCube:
    """A cube texture with given levels, each (6, n, n, 3), every one half the size of the last.

    dtype: "f2" or "f4". The levels need not go down to 1x1: look-ups past the last read the last.
    """
    size = levels[0].shape[1]
    gl_type, np_type = _TYPES[dtype]
    texture = context.gl.texture_cube((size, size), 3, levels[0].astype(np_type).tobytes(), dtype=dtype)
    if len(levels) == 1:
        texture.filter = (moderngl.LINEAR, moderngl.LINEAR)
        return texture
    # Allocates the levels, and sets how far they go; their contents follow.
    texture.build_mipmaps(0, len(levels) - 1)
    texture.filter = (moderngl.LINEAR_MIPMAP_LINEAR, moderngl.LINEAR)
    texture.use(0)
    i, u, p = ctypes.c_int, ctypes.c_uint, ctypes.c_void_p
    context.native.entry("glPixelStorei", u, i)(_UNPACK_ALIGNMENT, 1)
    write = context.native.entry("glTexSubImage2D", u, i, i, i, i, i, u, u, p)
    for number, level in enumerate(levels[1:], 1):
        for face in range(6):
            data = np.ascontiguousarray(level[face], np_type)
            n = data.shape[0]
            write(_CUBE_POSITIVE_X + face, number, 0, 0, n, n, _RGB, gl_type, data.ctypes.data)
    return texture
