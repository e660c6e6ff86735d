"""Arrays -> textures for sampler parameters. Row 0 of an array is at t = 0."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import moderngl
import numpy as np
import numpy.typing as npt

from glbump.errors import LimitError, ShaderError, unknown
from glbump.gl.context import Context
from glbump.gl.levels import cube_texture

# NumPy type -> moderngl's: 8 and 16 bits are 0..1 for a sampler, and integers for isampler and usampler.
_FLOATS = {"float32": "f4", "float16": "f2", "uint8": "f1", "uint16": "nu2"}
_INTS = {"int32": "i4", "int16": "i2", "int8": "i1"}
_UINTS = {"uint32": "u4", "uint16": "u2", "uint8": "u1"}
_DTYPES = {"": _FLOATS, "i": _INTS, "u": _UINTS}
# What follows "sampler" -> axes before the channels, as messages name them.
_AXES = {
    "2D": "height, width",
    "Cube": "6, size, size",
    "2DArray": "layers, height, width",
    "3D": "depth, height, width",
}
FILTERS = {
    "nearest": (moderngl.NEAREST, moderngl.NEAREST),
    "linear": (moderngl.LINEAR, moderngl.LINEAR),
    "nearest-level": (moderngl.LINEAR_MIPMAP_NEAREST, moderngl.LINEAR),
    "trilinear": (moderngl.LINEAR_MIPMAP_LINEAR, moderngl.LINEAR),
    "nearest-trilinear": (moderngl.NEAREST_MIPMAP_LINEAR, moderngl.NEAREST),
}
WRAPS = ("repeat", "clamp")


@dataclass(frozen=True)
class Sampler:
    """An array as a texture, with how it is looked up.

    pixels: (height, width[, channels]), cube (6, size, size[, channels]) in the order +X -X +Y -Y +Z -Z, or
    with a first axis of layers or depth; or a list of such arrays, one for each level. Row 0 is at t = 0.
    filter: one of FILTERS; wrap: "repeat" or "clamp", or one for each axis; levels: how many, made by the
    driver from the first ("all": down to 1x1).
    """

    pixels: Any
    filter: str = "linear"
    wrap: str | tuple[str, ...] = "repeat"
    levels: int | str = 1

    @property
    def has_levels(self) -> bool:
        """Whether which level is read depends on derivatives."""
        return self.filter in ("nearest-level", "trilinear", "nearest-trilinear")


def texture(context: Context, sampler: Sampler, kind: str, what: str) -> Any:
    """The moderngl texture of `sampler` for a GLSL type `kind`; `what` names the argument in errors."""
    prefix, _, shape = kind.partition("sampler")
    if shape not in _AXES:
        raise ShaderError(f"{what} is a {kind}; arrays can be sampler2D, samplerCube, sampler2DArray, sampler3D")
    if sampler.filter not in FILTERS:
        raise ShaderError(f"{what}: {unknown('filter', sampler.filter, FILTERS)}")
    chain = [_pixels(p, shape, kind, what) for p in _chain(sampler.pixels)]
    dtype = _dtype(chain[0], prefix, kind, what)
    count = _level_count(sampler, chain, what)
    _check_size(context, chain[0], shape, what)
    if len(chain) > 1 and shape == "Cube":
        if dtype not in ("f2", "f4") or chain[0].shape[-1] != 3:
            raise ShaderError(f"{what}: cube levels of one's own are 3 channels of float16 or float32")
        made: Any = cube_texture(context, chain, dtype)
        made.filter = FILTERS[sampler.filter]
        return made
    made = _create(context, chain[0], shape, dtype)
    try:
        if count > 1:
            made.build_mipmaps(0, count - 1)
        for number, level in enumerate(chain[1:], 1):
            _write_level(made, level, number, shape, what)
        made.filter = FILTERS[sampler.filter]
        _wrap(made, sampler, shape, what)
    except ShaderError:
        made.release()
        raise
    return made


def _chain(pixels: Any) -> list[Any]:
    return list(pixels) if isinstance(pixels, list | tuple) and hasattr(pixels[0], "ndim") else [pixels]


def _pixels(pixels: Any, shape: str, kind: str, what: str) -> npt.NDArray[Any]:
    array = np.asarray(pixels)
    if array.dtype == np.float64:
        array = array.astype(np.float32)
    elif array.dtype == np.int64:
        array = array.astype(np.int32)
    axes = _AXES[shape].count(",") + 1
    if array.ndim == axes:
        array = array[..., None]
    fits = array.ndim == axes + 1 and 1 <= array.shape[-1] <= 4 and array.size > 0
    if fits and shape == "Cube":
        fits = array.shape[0] == 6 and array.shape[1] == array.shape[2]
    if not fits:
        got = np.asarray(pixels).shape
        raise ShaderError(f"{what} is a {kind}: wants shape ({_AXES[shape]}[, 1..4]); got {got}")
    return np.ascontiguousarray(array)


def _dtype(array: npt.NDArray[Any], prefix: str, kind: str, what: str) -> str:
    allowed = _DTYPES[prefix]
    if str(array.dtype) not in allowed:
        raise ShaderError(f"{what} is a {kind}: wants one of {', '.join(allowed)}; got {array.dtype}")
    return allowed[str(array.dtype)]


def _level_count(sampler: Sampler, chain: Sequence[npt.NDArray[Any]], what: str) -> int:
    full = int(max(chain[0].shape[1 if chain[0].ndim == 4 else 0 : -1])).bit_length()
    if len(chain) > 1:
        return len(chain)
    if sampler.levels == "all":
        return full
    if not isinstance(sampler.levels, int) or not 1 <= sampler.levels <= full:
        raise ShaderError(f"{what}: levels is 1..{full} or 'all' here; got {sampler.levels!r}")
    return sampler.levels


def _check_size(context: Context, array: npt.NDArray[Any], shape: str, what: str) -> None:
    limits = context.gl.info
    most = limits["GL_MAX_CUBE_MAP_TEXTURE_SIZE" if shape == "Cube" else "GL_MAX_TEXTURE_SIZE"]
    if shape == "3D":
        most = limits["GL_MAX_3D_TEXTURE_SIZE"]
    sides = array.shape[1:-1] if shape in ("Cube", "2DArray") else array.shape[:-1]
    layers = array.shape[0] if shape == "2DArray" else 0
    if max(sides) > most or layers > limits["GL_MAX_ARRAY_TEXTURE_LAYERS"]:
        raise LimitError(f"{what}: {array.shape[:-1]} is past this driver's limit of {most} texels a side")


def _create(context: Context, array: npt.NDArray[Any], shape: str, dtype: str) -> Any:
    gl, channels = context.gl, array.shape[-1]
    if shape == "2D":
        return gl.texture((array.shape[1], array.shape[0]), channels, array, alignment=1, dtype=dtype)
    if shape == "Cube":
        return gl.texture_cube((array.shape[1], array.shape[1]), channels, array, alignment=1, dtype=dtype)
    size = (array.shape[2], array.shape[1], array.shape[0])
    make = gl.texture_array if shape == "2DArray" else gl.texture3d
    return make(size, channels, array, alignment=1, dtype=dtype)


def _write_level(made: Any, level: npt.NDArray[Any], number: int, shape: str, what: str) -> None:
    if shape != "2D":
        raise ShaderError(f"{what}: levels of one's own are for sampler2D and samplerCube; give levels= a number")
    size, want = (level.shape[1], level.shape[0]), tuple(max(1, side >> number) for side in made.size)
    if size != want or level.shape[-1] != made.components:
        raise ShaderError(f"{what}: level {number} must be {want} texels of {made.components}; got {level.shape}")
    made.write(level, level=number, alignment=1)


def _wrap(made: Any, sampler: Sampler, shape: str, what: str) -> None:
    if shape == "Cube":
        return
    axes = ("repeat_x", "repeat_y", "repeat_z")[: 3 if shape == "3D" else 2]
    told = sampler.wrap if isinstance(sampler.wrap, tuple) else (sampler.wrap,) * len(axes)
    for axis, word in zip(axes, told, strict=True):
        if word not in WRAPS:
            raise ShaderError(f"{what}: {unknown('wrap', word, WRAPS)}")
        setattr(made, axis, word == "repeat")
