"""Contexts of a GLFW window, hidden unless asked otherwise. Imports glfw, which the other ways do without."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from typing import Any

import glfw

from glbump.gl.native import Native, RouteError

MEND = 'set DISPLAY or WAYLAND_DISPLAY, run under xvfb-run, or take backend="egl", which needs no display'


@contextlib.contextmanager
def _quiet() -> Iterator[None]:
    """Keeps GLFW from printing its errors as warnings; `_failure` asks for them."""
    before, glfw.ERROR_REPORTING = glfw.ERROR_REPORTING, "ignore"
    try:
        yield
    finally:
        glfw.ERROR_REPORTING = before


def _failure(what: str, *, refused: bool = False) -> RouteError:
    code, text = glfw.get_error()
    reason = (text.decode() if isinstance(text, bytes) else text or "no reason given").strip()
    return RouteError(f"{what} failed: {reason} ({code:#x})", MEND, refused=refused)


class WindowContext(Native):
    """The GL core context of one GLFW window; `.window` is GLFW's handle. To be made on the main thread."""

    backend = "window"
    library = "glfw"

    def __init__(
        self, require: int, *, size: tuple[int, int] = (16, 16), title: str = "glbump", visible: bool = False
    ) -> None:
        # A reset of the GPU is to be told, not to end the process; drivers that cannot ignore the wish.
        hints: dict[int, int] = {glfw.VISIBLE: visible, glfw.CONTEXT_ROBUSTNESS: glfw.LOSE_CONTEXT_ON_RESET}
        # Frames come with samples and depth of their own: the window needs neither.
        hints |= {glfw.DEPTH_BITS: 0, glfw.STENCIL_BITS: 0, glfw.SAMPLES: 0, glfw.SCALE_TO_MONITOR: True}
        if require:
            hints |= {
                glfw.CONTEXT_VERSION_MAJOR: require // 100,
                glfw.CONTEXT_VERSION_MINOR: require // 10 % 10,
                glfw.OPENGL_PROFILE: glfw.OPENGL_CORE_PROFILE,
                glfw.OPENGL_FORWARD_COMPAT: True,
            }
        with _quiet():
            if not glfw.init():
                raise _failure("glfwInit")
            glfw.default_window_hints()
            for hint, value in hints.items():
                glfw.window_hint(hint, value)
            self.window: Any = glfw.create_window(*size, title, None, None)
            if not self.window:
                raise _failure("glfwCreateWindow", refused=bool(require))
        self.make_current()

    def _address(self, name: str) -> int:
        address: Any = glfw.get_proc_address(name)
        return address or 0

    def is_current(self) -> bool:
        return bool(glfw.get_current_context() == self.window)

    def make_current(self) -> None:
        glfw.make_context_current(self.window)

    def destroy(self) -> None:
        # glfw stays initialised: it belongs to the process, which may have windows of its own.
        if self.is_current():
            glfw.make_context_current(None)  # type: ignore[arg-type]
        glfw.destroy_window(self.window)
