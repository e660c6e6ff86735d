"""Settings of one scene side by side: picture, amplified error, figures, cost."""

from __future__ import annotations

import io
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TypeVar

import numpy as np
import numpy.typing as npt
from PIL import Image

from benchmarks.figures import Cell, Table
from glbump.frame import Frame
from glbump.gl.renderer import Renderer
from glbump.maps.colour import display_bytes, eight_bit
from glbump.maps.files import write_atomically
from glbump.quality import Quality
from glbump.scene import Scene
from glbump.trade.metrics import compare, difference_picture
from glbump.trade.timing import in_turns, ratios

GAIN = 8
"""Of the pictures of errors."""
COLOURS = 128
HEAD = ("picture", f"error, {GAIN} times", "RMSE, /255", "p99, /255", "frame time", "MiB")

Drawn = tuple[Scene, Quality]
"""What is drawn, and how."""


T = TypeVar("T")


def few(rows: Mapping[str, T], quick: bool) -> dict[str, T]:
    """All, or where it is to be quick the first and the last."""
    return {what: row for i, (what, row) in enumerate(rows.items()) if not quick or i in (0, len(rows) - 1)}


def save(path: Path, display: npt.NDArray[np.uint8]) -> str:
    """Write a small picture (H, W, 3) of display codes, in COLOURS: to look at, not to measure. What Markdown shows it
    by."""
    data = io.BytesIO()
    Image.fromarray(display).quantize(COLOURS, dither=Image.Dither.NONE).save(data, "PNG", optimize=True)
    write_atomically(path, data.getvalue())
    return f"![]({path.name})"


def save_error(path: Path, picture: npt.ArrayLike, truth: npt.ArrayLike, gain: float = GAIN) -> str:
    """As `save`: `gain` times the difference of two pictures."""
    return save(path, eight_bit(difference_picture(picture, truth, gain)))


def table(folder: Path, name: str, truth: Drawn, rows: Mapping[str, Drawn], size: tuple[int, int], turns: int) -> Table:
    """A row for each of `rows`: its picture, its error against the truth's, and its time over the first row's, all in
    turns."""
    cells: list[list[Cell]] = []
    with Renderer() as renderer, ExitStack() as stack:
        wanted = renderer.render(truth[0], size, truth[1]).pixels
        calls = {what: stack.enter_context(beside(renderer, size, drawn)) for what, drawn in rows.items()}
        frames = {what: call() for what, call in calls.items()}
        times = in_turns(calls, turns)
    first = times[next(iter(rows))].wall
    for number, (what, frame) in enumerate(frames.items()):
        off = compare(frame.pixels, wanted, perceptual=False)
        shown = save(folder / f"{name}-{number}.png", display_bytes(frame.pixels[..., :3]))
        wrong = save_error(folder / f"{name}-{number}-error.png", frame.pixels, wanted)
        time, mib = str(ratios(times[what].wall, first)), frame.stats["bytes"] / 2**20
        cells.append([what, shown, wrong, 255 * off["rmse"], 255 * off["p99"], time, mib])
    return Table(("setting", *HEAD), cells)


@contextmanager
def beside(renderer: Renderer, size: tuple[int, int], drawn: Drawn) -> Iterator[Callable[[], Frame]]:
    """What draws it, by a renderer of its own beside another: none takes the other's place."""
    scene, quality = drawn
    with Renderer(context=renderer.context, contents=renderer.contents) as own:
        yield lambda: own.render(scene, size, quality)
