"""How long tuning takes, in frames of exact; and how long the second time."""

from __future__ import annotations

import tempfile
import time

from benchmarks.figures import Cell, Section, Table, Target
from benchmarks.generated import scene
from benchmarks.promise import promised
from glbump.gl.renderer import Renderer
from glbump.trade.remembered import Remembered

FRAMES, AGAIN = 60, 1 / 6
"""Of exact, at most, the first time; of the first time, at most, the second."""
SCENES = (3, 7, 19)
"""By number: a bumped ball beside a cube, a ball, a bumped ball; of rough ones a frame of exact takes half a minute."""
BUDGET = 4 / 255


def _row(number: int, size: tuple[int, int]) -> list[Cell]:
    content = scene(number)
    with tempfile.TemporaryDirectory() as folder:
        memory = Remembered(folder)
        started = time.perf_counter()
        found, budget = promised(content, BUDGET, size, memory)
        took = time.perf_counter() - started
        started = time.perf_counter()
        promised(content, budget, size, memory)
        again = (time.perf_counter() - started) / took
    with Renderer() as renderer:
        frames = []
        for _ in range(3):
            started = time.perf_counter()
            renderer.render(content, size, "exact")
            frames.append(time.perf_counter() - started)
    return [number, 255 * budget, 255 * found.error, len(found.tried), took / sorted(frames)[1], again]


def measure(quick: bool = False) -> Section:
    """Three scenes at 1024x1024 (quick: one at 32x32)."""
    numbers, size = (SCENES[:1], (32, 32)) if quick else (SCENES, (1024, 1024))
    rows = [_row(number, size) for number in numbers]
    longest, second = (max(float(row[i] or 0) for row in rows) for i in (4, 5))
    return Section(
        "What tuning takes",
        f"{len(rows)} scenes drawn by chance (benchmarks/generated.py), {size[0]}x{size[1]}, compiling, truth and "
        "other views counted in; a frame of exact is the median of three. The second time asks for the same again.",
        (
            Table(
                ("scene", "promised, /255", "RMSE, /255", "settings tried", "in frames of exact", "the second time"),
                rows,
            ),
        ),
        (
            Target.at_most("the first time, in frames of exact", longest, FRAMES),
            Target.at_most("the second time, of the first", second, AGAIN),
        ),
    )


if __name__ == "__main__":
    from benchmarks.command import alone

    alone(measure)
