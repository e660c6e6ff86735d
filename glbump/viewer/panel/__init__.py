"""The panel, drawn with imgui-bundle (the extra `view`): every value at hand, with its unit and what came of it."""

from __future__ import annotations

import time
from functools import partial
from typing import TYPE_CHECKING

import glfw
from imgui_bundle import imgui

from glbump.viewer.panel.lists import Lists
from glbump.viewer.panel.sections import SECTIONS, Choosing

if TYPE_CHECKING:
    from glbump.viewer.window import Viewer

WIDE = 400
"""Width in points; at most half of the window."""
LETTERS = 15
LABELS = 165
"""Room for the names of values, in points."""
SETTLE = 3
"""Frames after which what imgui shows follows from what was done: it answers in the next."""

_BUTTONS = {glfw.MOUSE_BUTTON_LEFT: 0, glfw.MOUSE_BUTTON_RIGHT: 1, glfw.MOUSE_BUTTON_MIDDLE: 2}
_KEYS = {
    glfw.KEY_TAB: imgui.Key.tab,
    glfw.KEY_ENTER: imgui.Key.enter,
    glfw.KEY_KP_ENTER: imgui.Key.keypad_enter,
    glfw.KEY_ESCAPE: imgui.Key.escape,
    glfw.KEY_BACKSPACE: imgui.Key.backspace,
    glfw.KEY_DELETE: imgui.Key.delete,
    glfw.KEY_LEFT: imgui.Key.left_arrow,
    glfw.KEY_RIGHT: imgui.Key.right_arrow,
    glfw.KEY_HOME: imgui.Key.home,
    glfw.KEY_END: imgui.Key.end,
    glfw.KEY_A: imgui.Key.a,
    glfw.KEY_LEFT_CONTROL: imgui.Key.mod_ctrl,
    glfw.KEY_LEFT_SHIFT: imgui.Key.mod_shift,
}


class Panel:
    """One panel over one window. It draws through the window's own Screen, so that there is no second way to OpenGL."""

    def __init__(self, viewer: Viewer) -> None:
        self._viewer = viewer
        self._context = imgui.create_context()
        self._lists = Lists(viewer.stage.screen)
        self._choosing = Choosing(viewer)
        self._then = time.perf_counter()
        self._typed = False
        self.is_shown = True
        io = imgui.get_io()
        io.set_ini_filename("")
        io.set_log_filename("")
        # What an error leaves open is closed by imgui; the error itself is said in the window.
        io.config_error_recovery_enable_assert = io.config_error_recovery_enable_debug_log = False
        imgui.style_colors_dark()
        style = imgui.get_style()
        style.window_rounding, style.window_border_size = 0.0, 0.0
        style.set_color_(imgui.Col_.window_bg, (0.10, 0.11, 0.12, 1.0))
        style.set_color_(imgui.Col_.frame_bg, (0.22, 0.24, 0.27, 1.0))
        style.set_color_(imgui.Col_.frame_bg_hovered, (0.28, 0.31, 0.36, 1.0))

    @property
    def width(self) -> int:
        """Pixels of the window's left side that it covers."""
        stage = self._viewer.stage
        return int(min(WIDE * stage.ratio, stage.size[0] / 2))

    # ------------------------------------------------------------ what is done to it

    def _expose(self) -> None:
        self._viewer.shown.expose(SETTLE)

    def _holds(self) -> bool:
        """Whether the mouse is the panel's: over it or a list that hangs out of it, or pulling a slider."""
        return self.is_shown and bool(imgui.get_io().want_capture_mouse)

    def on_cursor(self, x: float, y: float) -> None:
        """The cursor moves; in the window system's units."""
        if self.is_shown:
            stage = self._viewer.stage
            wide, high = glfw.get_window_size(stage.window)
            imgui.get_io().add_mouse_pos_event(x * stage.size[0] / max(wide, 1), y * stage.size[1] / max(high, 1))
            if self._holds() or self._over(x * stage.size[0] / max(wide, 1)):
                self._expose()

    def _over(self, x: float) -> bool:
        return self.is_shown and x < self.width

    def on_button(self, button: int, action: int) -> bool:
        """A mouse button; whether it is the panel's."""
        if not self.is_shown or button not in _BUTTONS:
            return False
        io = imgui.get_io()
        holds = self._holds() or self._over(io.mouse_pos.x)
        io.add_mouse_button_event(_BUTTONS[button], action == glfw.PRESS)
        self._expose()
        return holds

    def on_scroll(self, across: float, up: float) -> bool:
        """The wheel; whether it is the panel's."""
        io = imgui.get_io()
        if not (self._holds() or self._over(io.mouse_pos.x)):
            return False
        io.add_mouse_wheel_event(across, up)
        self._expose()
        return True

    def on_key(self, key: int, action: int, _mods: int) -> bool:
        """A key; whether it is the panel's: while somebody types into it."""
        io = imgui.get_io()
        if key in _KEYS:
            io.add_key_event(_KEYS[key], action != glfw.RELEASE)
        if self.is_shown and io.want_text_input:
            self._expose()
            return action != glfw.RELEASE
        return False

    def on_character(self, code: int) -> None:
        """A character is typed."""
        io = imgui.get_io()
        if self.is_shown and io.want_text_input:
            io.add_input_character(code)
            self._expose()

    # ------------------------------------------------------------ what it shows

    def draw(self) -> None:
        """Over what the window shows."""
        stage, now = self._viewer.stage, time.perf_counter()
        size = stage.size
        io = imgui.get_io()
        io.display_size = imgui.ImVec2(*size)
        io.delta_time = min(max(now - self._then, 1e-4), 0.1)
        self._then = now
        imgui.get_style().font_size_base = LETTERS * stage.ratio
        imgui.new_frame()
        self._build(size)
        imgui.render()
        self._lists.draw(imgui.get_draw_data(), size)

    def _build(self, size: tuple[int, int]) -> None:
        imgui.set_next_window_pos((0, 0))
        imgui.set_next_window_size((self.width, size[1]))
        fixed = imgui.WindowFlags_.no_move | imgui.WindowFlags_.no_resize | imgui.WindowFlags_.no_title_bar
        imgui.begin("glbump", None, fixed | imgui.WindowFlags_.no_saved_settings)
        imgui.push_item_width(-LABELS * self._viewer.stage.ratio)
        for section in SECTIONS:
            self._viewer.shown.attempt(f"panel: {section.__name__}", partial(section, self._choosing))
        imgui.end()

    def release(self) -> None:
        """Free everything."""
        self._lists.release()
        imgui.destroy_context(self._context)
