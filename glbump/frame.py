"""Frame: what a renderer hands back."""

from __future__ import annotations

import os
from typing import Any

import numpy as np
import numpy.typing as npt

from glbump import validate as check
from glbump.errors import ImageError
from glbump.maps.colour import alpha_bytes, display_bytes
from glbump.maps.files import (
    DISPLAY_SUFFIXES,
    png_bytes,
    require_no_nan,
    without_opaque_alpha,
    write_display,
    write_picture,
)
from glbump.shown import colours


class Frame:
    """A rendered picture: linear light, straight alpha, with the statistics of its making.

    It keeps what it is given, half floats and bottom row first as a GPU hands them over, and converts what is
    asked for when it is asked for; PNG and `display` come straight from the halves, through a table.

    stats: backend, renderer string, plan, times, textures and bytes.
    """

    __slots__ = ("_pixels", "_raw", "show", "stats")

    def __init__(
        self,
        raw: npt.NDArray[np.floating[Any]],
        stats: dict[str, Any] | None = None,
        *,
        bottom_up: bool = False,
        show: str | None = None,
    ) -> None:
        """raw: (H, W, 4) float16 or float32, kept, not copied. bottom_up: whether its row 0 is the lowest. show: what
        it holds in place of light, a name of glbump.shown; on screens it has the colours said there."""
        if raw.ndim != 3 or raw.shape[2] != 4 or raw.size == 0 or raw.dtype not in (np.float16, np.float32):
            raise ImageError(
                f"a frame must be (H, W, 4) of float16 or float32, not empty; got {raw.shape} of {raw.dtype}"
            )
        self._raw = raw[::-1] if bottom_up else raw
        self._pixels: npt.NDArray[np.float32] | None = None
        self.show = show
        self.stats: dict[str, Any] = {} if stats is None else stats

    @property
    def size(self) -> tuple[int, int]:
        """(width, height) in pixels."""
        return (self._raw.shape[1], self._raw.shape[0])

    @property
    def pixels(self) -> npt.NDArray[np.float32]:
        """(H, W, 4) float32, linear light and straight alpha, row 0 on top; read-only."""
        if self._pixels is None:
            self._pixels = np.ascontiguousarray(self._raw, dtype=np.float32).view()
            self._pixels.flags.writeable = False
        return self._pixels

    def display(self, tone: str = "clip", exposure: float = 0.0) -> npt.NDArray[np.uint8]:
        """(H, W, 4) bytes as a screen shows them: tone map, sRGB, straight alpha, row 0 on top.

        tone: one of glbump.maps.images.TONES. exposure: stops, before the tone map.
        ImageError where pixels are NaN.
        """
        return self._display(tone, exposure, "frame")

    def _display(self, tone: str, exposure: float, name: str) -> npt.NDArray[np.uint8]:
        require_no_nan(self._raw, name)
        if self.show is not None:
            return colours(self.show, self.pixels)
        # All four channels at once, for the sake of contiguous memory, then the alpha set right.
        shown = display_bytes(self._raw, tone, exposure)
        shown[..., 3] = alpha_bytes(self._raw[..., 3])
        return shown

    def save(self, path: str | os.PathLike[str], *, tone: str = "clip", exposure: float = 0.0) -> None:
        """Write .png, .jpg or .webp (tone map, sRGB, 8 bits) or .exr, .hdr or .tif (linear floats).

        Written whole or not at all. ImageError where pixels are NaN, and as `write_picture` says.
        """
        path = check.path("the target", path)
        if path.suffix.lower() in DISPLAY_SUFFIXES:
            write_display(path, self._display(tone, exposure, str(path)))
        else:
            write_picture(path, self.pixels, tone=tone, exposure=exposure)

    def _repr_png_(self) -> bytes | None:
        """For notebooks; None, so that they show the text, where the frame holds NaN."""
        try:
            return png_bytes(without_opaque_alpha(self.display()))
        except ImageError:
            return None

    def __array__(self, dtype: npt.DTypeLike | None = None, copy: bool | None = None) -> npt.NDArray[np.floating[Any]]:
        if dtype is None or np.dtype(dtype) == np.float32:
            return self.pixels.copy() if copy else self.pixels
        if copy is False:
            raise ValueError(f"a frame holds float32; as {np.dtype(dtype)} it has to be copied")
        return self.pixels.astype(dtype)

    def __repr__(self) -> str:
        width, height = self.size
        return f"Frame({width}x{height})"
