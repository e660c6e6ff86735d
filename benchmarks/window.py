"""The window against a bare script that shows the same, and against the picture without one; what it costs at rest."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from dataclasses import replace
from functools import partial
from pathlib import Path

from benchmarks.figures import Cell, Section, Table, Target
from benchmarks.first_picture import children_cpu, commands, run
from glbump.quality import Quality
from glbump.qualityfile import save_quality
from glbump.trade.timing import in_turns, ratios

BARE, VIEW = (Path(__file__).with_name(f"{name}_window.py") for name in ("bare", "view"))
FIRST, FRAME, IDLE, INPUT = 1.3, 1.1, 0.02, 2.0


def measure(quick: bool = False) -> Section:
    """A mirror ball of 512x512 (quick: 64x64); without a display, on one of xvfb-run's."""
    size, turns, frames = (64, 1, 3) if quick else (512, 11, 40)
    display = [] if os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY") else ["xvfb-run", "-a"]
    if display and not shutil.which("xvfb-run"):
        return Section("The window", "Not measured: no display, and no xvfb-run to make one.", ())
    with tempfile.TemporaryDirectory(prefix="glbump-") as name:
        folder = Path(name)
        commands(folder, size)  # the scene and its environment
        ours = [*display, sys.executable, "-m", "benchmarks.window"]
        bare = [*display, sys.executable, str(BARE), str(folder / "environment.exr"), str(size)]
        here = {"PYTHONPATH": str(Path(__file__).parents[1])}
        save_quality(Quality("fast", environment_layout="given"), folder / "given.toml")
        first = [*display, sys.executable, str(VIEW), str(folder / "ball.toml"), str(size), str(folder / "given.toml")]
        os.environ |= here
        times = in_turns(
            {"bare": partial(run, bare, folder), "view": partial(run, first, folder)}, turns, 1, children_cpu
        )
        told = subprocess.run(
            [*ours, "frames", str(folder / "ball.toml"), str(size), str(frames)], check=True, stdout=subprocess.PIPE
        )
    found = json.loads(told.stdout)
    wall, cpu = (ratios(getattr(times["view"], k), getattr(times["bare"], k)) for k in ("wall", "cpu"))
    rows: list[list[Cell]] = [
        [
            "first frame, from the start of the process to its end",
            str(wall),
            str(cpu),
            "a bare glfw and moderngl script",
        ],
    ]
    targets = [
        Target.at_most("first frame, wall clock", wall.median, FIRST, " times"),
        Target.at_most("first frame, CPU time", cpu.median, FIRST, " times"),
    ]
    for quality, one in found["frames"].items():
        shown = ratios(one["window"], one["display"])
        rows.append([f"a frame, {quality}", str(shown), "", "the headless frame, as bytes"])
        rows.append(
            [f"a frame, {quality}", str(ratios(one["window"], one["render"])), "", "the headless frame, as floats"]
        )
        rows.append([f"from input to picture, {quality}", f"{one['late']} frames", "", ""])
        targets.append(Target.at_most(f"a frame, {quality}", shown.median, FRAME, " times"))
        targets.append(Target.at_most(f"input to picture, {quality}", float(one["late"]), INPUT, " frames"))
    rows.append(["at rest, of a core", f"{100 * found['idle']:.2g} %", "", ""])
    targets.append(Target.at_most("at rest, of a core", found["idle"], IDLE))
    return Section(
        "The window",
        f"`glbump view` of a mirror ball in a lat-long EXR, {size}x{size}, {'Xvfb' if display else 'the display'}. "
        "First frame: the whole command, one sample a pixel, bilinear, until the picture is on the screen (words over "
        "it come a frame later) and the window closed again, against benchmarks/bare_window.py, which parses no "
        "arguments and draws ball, sky and sRGB in one pass. A frame: the camera moved, drawn, "
        "brought to the screen and finished, against the renderer alone in the same context: read back, and for the "
        "first of the rows taken through the tone curve. At rest: CPU time of the process over wall clock.",
        (Table(("what", "ratio, wall clock", "CPU time", "against"), rows),),
        targets,
    )


def _frames(scene: Path, size: int, turns: int) -> None:
    """Frames in turns, and the share of a core that a second at rest takes; printed as JSON."""
    from glbump.viewer.navigation import orbit
    from glbump.viewer.opening import opened
    from glbump.viewer.pace import Pace, Step
    from glbump.viewer.window import Viewer

    viewer = Viewer([partial(opened, scene)], size=(size, size))
    found: dict[str, dict[str, object]] = {}
    for quality in ("fast", "balanced"):
        viewer.shown.set_quality(quality)
        while not viewer.is_settled:
            viewer.step(0)
        whole = Step(viewer.shown.quality.samples, 1.0)

        def moved() -> None:
            viewer.shown.move(lambda camera: orbit(camera, 0.003, 0.001))

        def window(whole: Step = whole) -> None:
            moved()
            viewer.stage.draw(viewer.shown.scene, viewer.shown.quality, whole)
            viewer._present()
            viewer.stage.context.gl.finish()

        def render() -> None:
            moved()
            viewer.render(viewer.shown.scene, viewer.stage.room, viewer.shown.quality)

        def display() -> None:
            moved()
            viewer.render(viewer.shown.scene, viewer.stage.room, viewer.shown.quality).display()

        times = in_turns({"window": window, "render": render, "display": display}, turns, 2)
        found[quality] = {name: of.wall for name, of in times.items()}
        viewer._pace = replace(Pace(), one=1.0, many=1.0)
        moved()
        steps = 0
        while viewer._drawn.version != viewer.shown.version:
            viewer.step(0)
            steps += 1
        found[quality]["late"] = steps
    while not viewer.is_settled:
        viewer.step(0)
    started, spent = time.perf_counter(), time.process_time()
    while time.perf_counter() < started + 0.1 * turns:
        viewer.step()
    idle = (time.process_time() - spent) / (time.perf_counter() - started)
    viewer.release()
    print(json.dumps({"frames": found, "idle": idle}))


if __name__ == "__main__":
    if sys.argv[1:2] == ["frames"]:
        _frames(Path(sys.argv[2]), int(sys.argv[3]), int(sys.argv[4]))
    else:
        from benchmarks.command import alone

        alone(measure)
