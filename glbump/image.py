"""A picture as a scene names it: the path of a file, or an array."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from glbump.errors import SceneError, shown

BYTES = (np.uint8, np.uint16)
"""Array types that mean what files of such integers mean: colour is sRGB, heights are parts of the full range."""


class ArrayImage:
    """A picture given as an array, kept read-only so that a frozen scene stays frozen.

    Arrays of BYTES stay so, all else becomes float32, linear. Two are equal when their pixels are; the hash is the
    shape's.
    """

    __slots__ = ("pixels",)

    def __init__(self, pixels: npt.ArrayLike) -> None:
        array = np.array(pixels)
        if array.dtype not in BYTES:
            # What float32 cannot hold becomes infinite, and is refused with its place when the picture is read.
            with np.errstate(over="ignore"):
                array = array.astype(np.float32)
        array.flags.writeable = False
        self.pixels: npt.NDArray[Any] = array

    def __eq__(self, other: object) -> bool:
        return isinstance(other, ArrayImage) and (
            self is other or np.array_equal(self.pixels, other.pixels, equal_nan=True)
        )

    def __hash__(self) -> int:
        return hash(self.pixels.shape)

    def __repr__(self) -> str:
        return f"array{self.pixels.shape}"


Image = str | Path | npt.NDArray[Any] | ArrayImage
"""A picture: a path, or an array (H, W) or (H, W, C), row 0 on top: floats of linear light, or uint8 or uint16."""


def picture_of(image: Any) -> Path | ArrayImage:
    """A checked scene's picture, as its dataclass stored it."""
    assert isinstance(image, Path | ArrayImage)
    return image


def checked_image(what: str, value: Any) -> Path | ArrayImage:
    """The path or the array that `value` is; SceneError otherwise."""
    if isinstance(value, ArrayImage | Path):
        return value
    if isinstance(value, str | os.PathLike) and str(value):
        return Path(value)
    if isinstance(value, np.ndarray):
        # Other integers have no full range to be parts of.
        known = value.dtype.kind == "f" or value.dtype in BYTES
        if value.ndim not in (2, 3, 4) or value.size == 0 or not known:
            raise SceneError(
                f"{what} must be a path or a non-empty array (H, W) or (H, W, C) of floats, uint8 or uint16; "
                f"got an array of shape {value.shape} and type {value.dtype}"
            )
        return ArrayImage(value)
    raise SceneError(f"{what} must be a path or an array; got {type(value).__name__} {shown(value)}")
