"""Pictures that move, written as GIF."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt

from glbump.errors import ImageError
from glbump.maps.files import write_atomically


def write_gif(path: str | os.PathLike[str], frames: Sequence[npt.NDArray[np.uint8]], per_second: float) -> None:
    """Write frames (H, W, 3 or 4), bytes as a screen shows them, as a GIF that goes round for ever: 256 colours of each
    frame's own, dithered; alpha is left out. Times are whole hundredths of a second.

    Written whole or not at all. ImageError where there is nothing to write, or nowhere.
    """
    from PIL import Image

    if not frames:
        raise ImageError(f"{path}: no frames to write")
    pictures = [Image.fromarray(np.ascontiguousarray(frame[..., :3])).quantize(256) for frame in frames]

    def write(beside: Path) -> None:
        pictures[0].save(
            beside,
            format="GIF",
            save_all=True,
            append_images=pictures[1:],
            duration=10 * max(2, round(100 / per_second)),
            loop=0,
        )

    write_atomically(path, write)
