"""What a frame costs beyond its draw: `Renderer.render` against the same GL calls with nothing round them."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
from pyrr import matrix44

from benchmarks.figures import Cell, Section, Table, Target
from benchmarks.recording import listening
from benchmarks.scenes import DATA, bumped_ball, evening, mirror_ball
from glbump.camera import Camera
from glbump.environment import LatLong
from glbump.gl.renderer import Renderer
from glbump.scene import Scene
from glbump.trade.timing import Times, differences, in_turns, ratios, spread

RATIO, MILLISECONDS = 1.03, 0.3
"""A frame may cost this many times its draw, or this much more, whichever is more."""

Draw = Callable[[], object]


def bare_draw(size: tuple[int, int], quality: str, scene: Scene) -> tuple[Renderer, Draw]:
    """A renderer, and the scene's one frame as a script would draw it that has nothing else to do.

    The script makes the renderer's own OpenGL calls once more, with the same program, textures, vertices and targets,
    all ready, and reads back into a new array.
    """
    with listening() as recording:
        renderer = Renderer()
        renderer.render(scene, size, quality)
        recording.is_on = True
        renderer.render(scene, size, quality)
        recording.is_on = False
    return renderer, recording.replay()


def orbit(scene: Scene, frames: int = 16) -> Iterator[Scene]:
    """The scene from a little farther round each time, so that no two frames in a row are the same; for ever."""
    angles = np.linspace(-0.1, 0.1, frames)
    return itertools.cycle([replace(scene, camera=Camera(eye=(4 * np.sin(a), 0, 4 * np.cos(a)))) for a in angles])


def camera_work(camera: Camera, size: tuple[int, int]) -> list[bytes]:
    """What a bare script has to compute when the camera moves: its matrices for ball and sky, ready to be written."""
    view = matrix44.create_look_at(camera.eye, camera.target, camera.up)
    projection = matrix44.create_perspective_projection(camera.fov, size[0] / size[1], 0.1, 10.0)
    matrices = matrix44.multiply(view, projection), matrix44.inverse(matrix44.multiply(view, projection))
    return [*(m.astype(np.float32).tobytes() for m in matrices), np.array(camera.eye, np.float32).tobytes()]


def measure(quick: bool = False) -> Section:
    """1024x1024 (quick: 64x64), fast and balanced, standing still and moving."""
    size, turns = ((64, 64), 3) if quick else ((1024, 1024), 31)
    path = DATA / "openexr" / "KernerEnvLatLong.exr"
    environment = LatLong(path) if path.is_file() else evening()
    rows: list[list[Cell]] = []
    targets = []
    for name, make in (("mirror ball", mirror_ball), ("bumped chrome", bumped_ball)):
        for quality in ("fast", "balanced"):
            scene = make(environment)
            renderer, bare = bare_draw(size, quality, scene)
            seen, looked = orbit(scene), orbit(scene)

            def bare_moving(bare: Draw = bare, looked: Iterator[Scene] = looked) -> object:
                camera_work(next(looked).camera, size)
                return bare()

            # Apart: a frame that stands still is made ready once, which one that moves in between would undo.
            pairs: dict[str, tuple[Draw, Draw]] = {
                "same": (bare, lambda r=renderer, s=scene, q=quality: r.render(s, size, q)),  # type: ignore[misc]
                "moving": (
                    bare_moving,
                    lambda r=renderer, i=seen, q=quality: r.render(next(i), size, q),  # type: ignore[misc]
                ),
            }
            times: dict[str, Times] = {}
            with renderer:
                for kind, (plain, ours) in pairs.items():
                    times |= in_turns({f"bare, {kind}": plain, kind: ours}, turns)
            for kind in ("same", "moving"):
                base = times[f"bare, {kind}"]
                milliseconds = 1e3 * spread(base.wall).median
                wall, cpu = ratios(times[kind].wall, base.wall), ratios(times[kind].cpu, base.cpu)
                more, more_cpu = (
                    1e3 * differences(a, b).median
                    for a, b in ((times[kind].wall, base.wall), (times[kind].cpu, base.cpu))
                )
                rows.append([name, quality, kind, str(wall), str(cpu), more, more_cpu, milliseconds])
                kept = wall.median <= RATIO or more <= MILLISECONDS
                got = f"{wall.median:.3f} times, {more:+.2f} ms"
                targets.append(Target(f"{name}, {quality}, {kind}", got, f"{RATIO} times or +{MILLISECONDS} ms", kept))
    return Section(
        "A frame costs what its draw costs",
        f"`Renderer.render` at {size[0]}x{size[1]} against a bare moderngl script that makes the very same calls, "
        "recorded: the same program, textures and targets, uniforms set beforehand but for those that change, and "
        "reads back into a new array. Same: one scene again and again. Moving: another camera in every "
        "frame, for which the script computes its matrices with pyrr.",
        (
            Table(
                ("scene", "quality", "frames", "wall clock", "CPU time", "more, ms", "more CPU, ms", "bare, ms"), rows
            ),
        ),
        targets,
    )


if __name__ == "__main__":
    from benchmarks.command import alone

    alone(measure)
