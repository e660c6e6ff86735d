"""Random input, seeded: the window neither ends nor grows. Seconds of it, or as many as GLBUMP_SOAK says: an hour, with
GLBUMP_SOAK=3600. GLBUMP_SEED: another seed."""

from __future__ import annotations

import io
import os
import random
import time
from contextlib import redirect_stderr
from pathlib import Path
from typing import Any

import numpy as np

from .driving import in_window, scene, settle, tell, viewing

SECONDS = float(os.environ.get("GLBUMP_SOAK", "3"))
SEED = int(os.environ.get("GLBUMP_SEED", "7"))


def _anything(chance: random.Random, viewer: Any, files: list[Path], keys: list[int]) -> None:
    """One thing that somebody may do."""
    import glfw

    width, height = glfw.get_window_size(viewer.stage.window)
    at = chance.uniform(-20, width + 20), chance.uniform(-20, height + 20)
    what = chance.random()
    if what < 0.35:
        tell(viewer, "cursor_pos", *at)
    elif what < 0.55:
        tell(viewer, "mouse_button", chance.randrange(5), chance.randrange(2), chance.choice([0, 0, 1, 2, 4, 7]))
    elif what < 0.70:
        tell(viewer, "scroll", chance.gauss(0, 2), chance.choice([-1, 1, chance.gauss(0, 30)]))
    elif what < 0.92:
        tell(viewer, "key", chance.choice(keys), 0, chance.randrange(3), 0)
    elif what < 0.94:
        # 600 is room for the panel's values.
        glfw.set_window_size(viewer.stage.window, chance.choice([1, 50, 200, 600]), chance.choice([1, 40, 150, 400]))
    elif what < 0.96:
        tell(viewer, "window_focus", chance.randrange(2))
    elif what < 0.98:
        tell(viewer, "drop", [str(file) for file in chance.sample(files, chance.randrange(3))])
    elif what < 0.985:
        _on_disk(chance, files)
    elif what < 0.986:
        _lost(viewer)
    else:
        tell(viewer, "char", chance.randrange(32, 300))


def _on_disk(chance: random.Random, files: list[Path]) -> None:
    """A file changes, goes, or comes back."""
    file = chance.choice(files)
    aside = file.with_suffix(".aside")
    if aside.exists():
        aside.replace(file)
    elif file.exists():
        if chance.random() < 0.3:
            file.replace(aside)
        else:
            file.write_bytes(file.read_bytes()[: chance.choice([20, None, None, None])])


def _lost(viewer: Any) -> None:
    """The GPU is reset, says the driver."""
    context = type(viewer.stage.context)
    told, window = context.is_lost, viewer.stage.window
    context.is_lost = True
    try:
        viewer.step(0)
    finally:
        context.is_lost = told
    assert viewer.stage.window != window


def _memory() -> int:
    """Bytes of this process."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGESIZE")


@in_window
def test_random_input_neither_ends_it_nor_makes_it_grow(folder: Path) -> None:
    import glfw

    from glbump.maps.files import write_display, write_picture
    from glbump.viewer import exports
    from glbump.viewer.actions import ACTIONS

    chance = random.Random(SEED)
    grey = np.random.default_rng(2).integers(0, 256, (16, 16, 1), np.uint8)
    write_display(folder / "height.png", grey)
    write_picture(folder / "sky.exr", np.ones((8, 16, 3), np.float32))
    (folder / "notes.txt").write_text("none of the kinds")
    (folder / "a.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    files = [*folder.iterdir(), folder / "gone.exr"]
    # All keys, but those that close the window, fill the screen or write files by the dozen.
    left_out = ("q", "w", "f9", "f11", "f12", "s")
    names = sorted({key.removeprefix("ctrl+") for action in ACTIONS for key in action.keys})
    keys = [getattr(glfw, f"KEY_{name.upper()}") for name in names if name not in left_out]
    keys += [glfw.KEY_A, glfw.KEY_D, glfw.KEY_E, glfw.KEY_UNKNOWN, 999]
    keys += [glfw.KEY_LEFT_SHIFT, glfw.KEY_LEFT_ALT, *[glfw.KEY_LEFT_CONTROL] * 3]
    exports.STEPS = 2
    terminal, events = io.StringIO(), 0
    with viewing(scene(), scene(surfaces=[]), size=(160, 120), folder=folder) as viewer, redirect_stderr(terminal):
        held: list[tuple[int, int]] = []
        for part in range(3):
            end = time.perf_counter() + SECONDS / 3
            while time.perf_counter() < end:
                for _ in range(chance.randrange(1, 6)):
                    _anything(chance, viewer, files, keys)
                    events += 1
                viewer.step(0)
                assert not terminal.getvalue(), terminal.getvalue()
                assert not viewer.is_closing
            tell(viewer, "window_focus", 0)
            viewer.shown.stop()
            glfw.set_window_size(viewer.stage.window, 160, 120)
            settle(viewer, 60)
            objects = sum(viewer.stage.context.live_objects().values())
            held.append((objects, _memory()))
            print(f"{events} events, {objects} objects of the GPU, {held[-1][1] >> 20} MiB")
            assert part == 0 or objects <= held[0][0] + 200, (
                "objects of the GPU are kept for scenes, 64 of them at most"
            )
        # What the driver compiles of a quality that comes up late is some 80 MB; a frame of pictures kept is 2 MB each.
        assert held[2][1] - held[1][1] < 160 << 20, held
