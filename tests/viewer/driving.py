"""Driving a real window: opening one, telling it what GLFW would tell it, looking at its pixels."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

Check = Callable[[Path], None]


def begin(display: str, path: list[str]) -> None:
    """Once, in the process that opens windows."""
    os.environ["DISPLAY"] = display
    for name in ("WAYLAND_DISPLAY", "GLBUMP_BACKEND", "GLBUMP_DEVICE"):
        os.environ.pop(name, None)
    sys.path[:] = path


def carry_out(module: str, name: str, folder: Path) -> None:
    """One check, in that process."""
    getattr(import_module(module), name).check(folder)


def in_window(check: Check) -> Callable[..., None]:
    """A test that is carried out in the process that opens windows; it is given a folder."""

    def test(windowed: Callable[[str, str, Path], None], tmp_path: Path) -> None:
        windowed(check.__module__, check.__name__, tmp_path)

    test.__name__, test.__doc__, test.__module__ = check.__name__, check.__doc__, check.__module__
    test.check = check  # type: ignore[attr-defined]
    return test


def scene(**changes: Any) -> Any:
    """A ball and a cube before a sky of three colours that differ from side to side, all of arrays."""
    import glbump as gb

    down, right = np.mgrid[0:32, 0:64] / 64
    sky = np.stack([right, 2 * down, 1 - right], axis=-1).astype(np.float32)
    mirror = gb.Material((1, 0.9, 0.8), metallic=1, roughness=0)
    surfaces = [
        gb.Surface(gb.Sphere(), mirror),
        gb.Surface(gb.Cube(), mirror, transform=gb.Transform(translate=(1.6, 0, 0), scale=0.4)),
    ]
    return gb.Scene(**({"surfaces": surfaces, "environment": gb.LatLong(sky)} | changes))


@contextmanager
def viewing(*shown: Any, size: tuple[int, int] = (160, 120), **options: Any) -> Iterator[Any]:
    """A window that shows scenes, or what Subject functions make."""
    from glbump.scene import Scene
    from glbump.viewer.opening import Subject
    from glbump.viewer.window import Viewer

    opens = [
        (lambda _, i=i, what=what: Subject(f"scene-{i}", what)) if isinstance(what, Scene) else what
        for i, what in enumerate(shown or (scene(),))
    ]
    viewer = Viewer(opens, size=size, **options)
    try:
        settle(viewer)
        yield viewer
    finally:
        viewer.release()


def settle(viewer: Any, seconds: float = 20.0) -> None:
    """Until nothing is left to be drawn."""
    end = time.perf_counter() + seconds
    viewer.step(0)
    while not viewer.is_settled:
        assert time.perf_counter() < end, f"it does not come to rest: {viewer.shown.trouble}"
        viewer.step(0.01)


def tell(viewer: Any, what: str, *arguments: Any) -> None:
    """Call what the viewer has registered with GLFW, as GLFW does."""
    import glfw

    register = getattr(glfw, f"set_{what}_callback")
    heard = register(viewer.stage.window, None)
    assert heard is not None, f"nobody listens to {what}"
    viewer.hands.listen()
    if what == "drop":
        import ctypes

        names = [name.encode() for name in arguments[0]]
        arguments = (len(names), (ctypes.c_char_p * max(len(names), 1))(*names))
    heard(viewer.stage.window, *arguments)


def press(viewer: Any, name: str, *, control: bool = False) -> None:
    """A key goes down and up again."""
    import glfw

    held = [glfw.KEY_LEFT_CONTROL] if control else []
    codes = [*held, getattr(glfw, f"KEY_{name.upper()}")]
    for action, keys in ((glfw.PRESS, codes), (glfw.RELEASE, codes[::-1])):
        for key in keys:
            tell(viewer, "key", key, 0, action, 0)


def drag(viewer: Any, start: tuple[float, float], end: tuple[float, float], button: int = 0, mods: int = 0) -> None:
    """A button goes down, the cursor moves, the button goes up. Pixels from the window's upper left corner."""
    tell(viewer, "cursor_pos", *start)
    tell(viewer, "mouse_button", button, 1, mods)
    for share in (0.5, 1.0):
        tell(viewer, "cursor_pos", *(a + share * (b - a) for a, b in zip(start, end)))
    tell(viewer, "mouse_button", button, 0, mods)


def shot(viewer: Any, *, plates: bool = False) -> npt.NDArray[np.uint8]:
    """(H, W, 3): all that the window shows, or the picture alone."""
    from glbump.viewer.plates import plates as plates_of

    stage, shown = viewer.stage, viewer.shown
    how = stage.size, shown.tone, shown.exposure
    stage.screen.show(stage.picture and stage.picture.frame, *how, left=stage.left)
    if plates:
        if viewer.beside is not None:
            picture, column = viewer.beside
            stage.screen.show(picture.frame, *how, left=stage.left, begin=column)
        stage.screen.lay(plates_of(viewer, stage.size, stage.ratio), stage.size)
        if viewer.panel is not None and viewer.panel.is_shown:
            viewer.panel.draw()
    result: npt.NDArray[np.uint8] = stage.screen.read(stage.size)
    return result if plates else result[:, stage.left :]
