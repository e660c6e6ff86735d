"""What one pixel is made of: its light, what led to it, and the float64 reference's value."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from glbump import reference
from glbump.maps.colour import display_bytes
from glbump.shown import SHOWN
from glbump.viewer.text import COLUMN

if TYPE_CHECKING:
    from glbump.viewer.window import Viewer

SAMPLES = 64
"""Of the reference, a pixel: off by some 1/64 of a pixel's contrast."""

Region = tuple[int, int, int, int]


def quad(x: int, y: int, size: tuple[int, int]) -> Region:
    """(left, top, width, height) of the quad of 2x2 pixels that pixel (x, y) is in, row 0 on top.

    Quads are counted from the lower left corner.
    """
    left, above = x // 2 * 2, (size[1] - 1 - y) // 2 * 2
    top = max(0, size[1] - above - 2)
    return left, top, min(2, size[0] - left), size[1] - above - top


def inspect(viewer: Viewer, x: int, y: int, size: tuple[int, int]) -> Iterator[str]:
    """A job that tells of pixel (x, y) of the picture of `size`, row 0 on top, as the renderer draws it at the chosen
    quality. It says nothing where another picture is shown before it is done."""
    version = viewer.shown.version

    def job() -> Iterator[str]:
        for says in _pieces(viewer, x, y, size):
            yield says
            if viewer.shown.version != version:
                return

    return job()


def _pieces(viewer: Viewer, x: int, y: int, size: tuple[int, int]) -> Iterator[str]:
    shown, renderer = viewer.shown, viewer.stage.renderer
    yield "inspecting ..."
    light = renderer.render(shown.scene, size, shown.quality).pixels[y, x]
    rows = [("pixel", f"{x}, {y}, from the upper left corner"), ("light", _numbers(light[:3]))]
    for name in SHOWN:
        yield f"inspecting: {name} ..."
        values = renderer.render(shown.scene, size, shown.quality, show=name).pixels[y, x]
        rows.append((name, _numbers(values[:3]) if values[3] else "none here"))
    yield "inspecting: the reference ..."
    region = quad(x, y, size)
    truth = reference.render(shown.scene, size, SAMPLES, region=region, contents=shown.contents)
    true = truth.pixels[y - region[1], x - region[0]]
    rows.append((f"reference, {SAMPLES} samples", _numbers(true[:3])))
    a, b = (display_bytes(np.asarray(v[:3]), shown.tone, shown.exposure).astype(int) for v in (light, true))
    rows.append(("off on the screen", f"{np.abs(a - b).max()} of 255"))
    shown.tell("\n".join(COLUMN.join(row) for row in rows))


def _numbers(values: npt.NDArray[np.floating]) -> str:
    return "   ".join(f"{value:.4g}" for value in values)
