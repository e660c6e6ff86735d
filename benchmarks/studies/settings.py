"""Settings of one scene side by side: picture, amplified error, figures, cost."""

from __future__ import annotations

import io
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import numpy.typing as npt
from PIL import Image

from benchmarks.figures import Cell, Table
from glbump.gl.renderer import Renderer
from glbump.maps.colour import display_bytes
from glbump.maps.files import write_atomically
from glbump.quality import Quality
from glbump.scene import Scene
from glbump.trade.metrics import compare, difference_picture
from glbump.trade.timing import in_turns, ratios

GAIN = 8
"""Of the pictures of errors."""
HEAD = ("setting", "picture", f"error, {GAIN} times", "RMSE, /255", "p99, /255", "frame time", "MiB")


def save(path: Path, display: npt.NDArray[np.uint8]) -> str:
    """Write a small picture (H, W, 3) of display codes; what Markdown shows it by."""
    data = io.BytesIO()
    Image.fromarray(display).save(data, "PNG", optimize=True)
    write_atomically(path, data.getvalue())
    return f"![]({path.name})"


def table(
    folder: Path,
    name: str,
    scene: Scene,
    settings: Mapping[str, Quality],
    size: tuple[int, int],
    turns: int,
    truth_samples: int = 256,
) -> Table:
    """A row a setting; times are over the first one's, in turns. truth: the driver's exact, with so many samples."""
    rows: list[list[Cell]] = []
    with Renderer() as renderer:
        truth = renderer.render(scene, size, Quality("exact", samples=truth_samples)).pixels
        renderers = {what: Renderer(context=renderer.context, contents=renderer.contents) for what in settings}
        try:
            pictures = {w: r.render(scene, size, settings[w]) for w, r in renderers.items()}
            times = in_turns({w: _frame(r, scene, size, settings[w]) for w, r in renderers.items()}, turns)
        finally:
            for r in renderers.values():
                r.release()
    first = times[next(iter(settings))].wall
    for number, (what, frame) in enumerate(pictures.items()):
        off = compare(frame.pixels, truth, perceptual=False)
        shown = save(folder / f"{name}-{number}.png", display_bytes(frame.pixels[..., :3]))
        error = (255 * difference_picture(frame.pixels, truth, GAIN)).astype(np.uint8)
        wrong = save(folder / f"{name}-{number}-error.png", error)
        time, mib = str(ratios(times[what].wall, first)), frame.stats["bytes"] / 2**20
        rows.append([what, shown, wrong, 255 * off["rmse"], 255 * off["p99"], time, mib])
    return Table(HEAD, rows)


def _frame(renderer: Renderer, scene: Scene, size: tuple[int, int], quality: Quality) -> Callable[[], object]:
    return lambda: renderer.render(scene, size, quality)
