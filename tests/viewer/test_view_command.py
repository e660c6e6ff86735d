"""`glbump view` as a command: with no display, an old OpenGL, wrong files; and by a real mouse and keyboard."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from .driving import in_window, scene, settle, viewing


def view(*arguments: str, **environment: str) -> tuple[int, str]:
    """The exit status and what was said, of a command that is expected to end by itself."""
    done = subprocess.run(
        [sys.executable, "-m", "glbump", "view", *arguments],
        env={k: v for k, v in os.environ.items() if k not in ("DISPLAY", "WAYLAND_DISPLAY")} | environment,
        capture_output=True,
        text=True,
        timeout=60,
    )
    return done.returncode, done.stderr.strip()


def test_no_display() -> None:
    code, said = view()
    assert code == 1
    assert len(said.splitlines()) == 1
    assert said.startswith("glbump: error: no window can be opened: ")
    assert said.endswith("; glbump render draws without one")


def test_an_opengl_that_is_too_old(display: str) -> None:
    code, said = view(DISPLAY=display, MESA_GL_VERSION_OVERRIDE="2.1", MESA_GLSL_VERSION_OVERRIDE="120")
    assert code == 1
    assert len(said.splitlines()) == 1
    assert "no window can be opened" in said


def test_wrong_arguments(tmp_path: Path) -> None:
    assert view(str(tmp_path / "no.exr"))[0] == 1
    assert "there is no such file" in view(str(tmp_path / "no.exr"))[1]
    assert "no such folder" in view("-o", str(tmp_path / "no"))[1]
    for wrong in (("--size", "0x5"), ("--tone", "film"), ("--quality", "best"), ("--exposure", "nan")):
        assert view(*wrong)[0] == 2, wrong


def test_an_interrupt_closes_the_window(display: str, tmp_path: Path) -> None:
    (tmp_path / "a.toml").write_text('[environment]\nkind = "sky"\n')
    running = subprocess.Popen(
        [sys.executable, "-m", "glbump", "view", str(tmp_path / "a.toml"), "--size", "64x64"],
        env=os.environ | {"DISPLAY": display},
        stderr=subprocess.PIPE,
        text=True,
    )
    time.sleep(5)
    assert running.poll() is None, running.stderr.read() if running.stderr else ""
    running.send_signal(2)
    _, said = running.communicate(timeout=20)
    assert running.returncode == 130
    assert said.strip() == "glbump: interrupted"


@in_window
def test_a_real_mouse_and_a_real_keyboard(folder: Path) -> None:
    """Through the X server, by its test extension: the wiring is right, down to the buttons."""
    import ctypes
    import ctypes.util

    names = [ctypes.util.find_library(name) for name in ("X11", "Xtst")]
    if None in names:
        pytest.skip("no libXtst, which moves the mouse")
    x11, xtst = (ctypes.CDLL(name) for name in names)
    x11.XOpenDisplay.restype = ctypes.c_void_p
    server = ctypes.c_void_p(x11.XOpenDisplay(None))
    import glfw

    with viewing(scene()) as viewer:
        x, y = glfw.get_window_pos(viewer.stage.window)

        def send() -> None:
            x11.XSync(server, 0)
            for _ in range(5):
                viewer.step(0.02)
            settle(viewer)

        camera = viewer.shown.scene.camera
        xtst.XTestFakeMotionEvent(server, -1, x + 60, y + 60, 0)
        xtst.XTestFakeButtonEvent(server, 1, 1, 0)
        send()
        xtst.XTestFakeMotionEvent(server, -1, x + 90, y + 70, 0)
        send()
        xtst.XTestFakeButtonEvent(server, 1, 0, 0)
        send()
        turned = viewer.shown.scene.camera
        assert turned.eye != camera.eye
        assert turned.target == camera.target
        for button in (4, 5):  # The wheel, as X has it.
            before = viewer.shown.scene.camera
            xtst.XTestFakeButtonEvent(server, button, 1, 0)
            xtst.XTestFakeButtonEvent(server, button, 0, 0)
            send()
            assert viewer.shown.scene.camera != before
        code = x11.XKeysymToKeycode(server, ctypes.c_ulong(ord("r")))
        glfw.focus_window(viewer.stage.window)
        xtst.XTestFakeKeyEvent(server, code, 1, 0)
        xtst.XTestFakeKeyEvent(server, code, 0, 0)
        send()
        assert viewer.shown.scene.camera == camera
    x11.XCloseDisplay(server)
