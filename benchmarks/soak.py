"""Whether anything is left behind by many frames and many renderers."""

from __future__ import annotations

import gc
import itertools
import os
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks.figures import Cell, Section, Table, Target
from benchmarks.scenes import CHROME, bumped_ball, evening, mirror_ball, normal_mapped_cube, two_surfaces
from glbump.camera import Camera
from glbump.gl.renderer import Renderer
from glbump.scene import Scene, Surface
from glbump.shapes import Torus

FRAME_GROWTH, RENDERER_GROWTH = 8.0, 16.0
"""MiB that the process may grow by. moderngl and the driver keep some 20 kB for each context that there ever was."""


def resident() -> float:
    """MiB of memory that this process holds now."""
    gc.collect()
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 2**20


CYCLE = 40
"""Frames after which every scene has been drawn in every size and quality."""


def frames() -> Iterator[tuple[Scene, tuple[int, int], str]]:
    """For ever: with and without bumps, mirrors and not, one surface and two; sizes and qualities in turn; the camera
    moving, and one shape never twice the same."""
    still = [make(evening()) for make in (mirror_ball, bumped_ball, normal_mapped_cube, two_surfaces)]
    sizes, qualities = ((32, 32), (48, 24), (17, 40), (64, 16)), ("fast", "balanced")
    for number in itertools.count():
        ring = Surface(Torus(tube=0.4 + 0.2 * np.sin(number)), CHROME)
        scene = [*still, Scene([ring], evening())][number % 5]
        angle = 2 * np.pi * number / CYCLE
        camera = Camera(eye=(4 * np.sin(angle), 0.5, 4 * np.cos(angle)))
        yield replace(scene, camera=camera), sizes[number // 5 % 4], qualities[number // 20 % 2]


def soak(renderer: Renderer, count: int, warm_up: int) -> dict[str, tuple[float, float]]:
    """Live GL objects and MiB after `warm_up` frames, and after `count` more."""
    stream = frames()

    def draw(number: int) -> dict[str, float]:
        for scene, size, quality in itertools.islice(stream, number):
            renderer.render(scene, size, quality)
        return {**renderer.context.live_objects(), "MiB": resident()}

    before, after = draw(warm_up), draw(count)
    return {name: (before[name], after[name]) for name in before}


def open_and_close(count: int) -> None:
    """Renderers, each drawing once."""
    scene = bumped_ball(evening())
    for _ in range(count):
        with Renderer() as renderer:
            renderer.render(scene, (32, 32), "fast")


def measure(quick: bool = False) -> Section:
    """10,000 frames and 200 renderers (quick: 200 and 5)."""
    # The warm-up draws every combination, and fills what is kept between frames with rings that do not come back.
    count, renderers, warm_up = (200, 5, 480) if quick else (10_000, 200, 480)
    with Renderer() as renderer:
        drawn = soak(renderer, count, warm_up)
    open_and_close(3)
    before = resident()
    open_and_close(renderers)
    after = resident()
    rows: list[list[Cell]] = [[f"{count:,} frames: {name}", *pair] for name, pair in drawn.items()]
    rows.append([f"{renderers} renderers: MiB", before, after])
    objects = sum(abs(b - a) for name, (a, b) in drawn.items() if name != "MiB")
    return Section(
        "Soak",
        f"{count:,} frames of five scenes in four sizes and two qualities, camera and shape moving, then {renderers} "
        "renderers opened, drawn with and closed: OpenGL objects alive, and memory the process holds, before and "
        f"after. Before is after {warm_up} frames: every combination drawn, and what is kept between frames full.",
        (Table(("what", "before", "after"), rows),),
        (
            Target.at_most(f"{count:,} frames: more or fewer GL objects", float(objects), 0.0),
            Target.at_most(f"{count:,} frames: growth", drawn["MiB"][1] - drawn["MiB"][0], FRAME_GROWTH, " MiB"),
            Target.at_most(f"{renderers} renderers: growth", after - before, RENDERER_GROWTH, " MiB"),
        ),
    )


if __name__ == "__main__":
    from benchmarks.command import alone

    alone(measure)
