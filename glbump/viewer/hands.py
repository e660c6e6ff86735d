"""Mouse, keys, wheel, touchpad and dropped files, as the window system reports them, and what they do."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import glfw

from glbump.errors import GlbumpError
from glbump.viewer import navigation
from glbump.viewer.actions import ACTIONS, FLIGHT, Action

if TYPE_CHECKING:
    from glbump.viewer.picking import Picked
    from glbump.viewer.window import Viewer

ACTION = "action"
"""What somebody did that went wrong: said until he does something else."""
DOUBLE = 0.35
"""Seconds within which two clicks are one double click."""
STILL = 0.006
"""How far the cursor may move between them, in shares of the window's height."""
SPEED = 0.8
"""Of flying: distances between eye and target a second; three times that with shift."""
TURN = 180.0
"""Degrees that the environment turns for a drag over the window's height."""

LEFT, RIGHT, MIDDLE = glfw.MOUSE_BUTTON_LEFT, glfw.MOUSE_BUTTON_RIGHT, glfw.MOUSE_BUTTON_MIDDLE
_SHIFT, _CTRL, _ALT = glfw.MOD_SHIFT, glfw.MOD_CONTROL, glfw.MOD_ALT
_MODIFIERS = {
    code: bit
    for bit, codes in (
        (_SHIFT, (glfw.KEY_LEFT_SHIFT, glfw.KEY_RIGHT_SHIFT)),
        (_CTRL, (glfw.KEY_LEFT_CONTROL, glfw.KEY_RIGHT_CONTROL)),
        (_ALT, (glfw.KEY_LEFT_ALT, glfw.KEY_RIGHT_ALT)),
    )
    for code in codes
}
_FLIGHT = {getattr(glfw, f"KEY_{name.upper()}"): way for name, way in FLIGHT.items()}


def _bindings() -> dict[tuple[int, bool], Action]:
    """(key, whether control is held) -> what it does."""
    found: dict[tuple[int, bool], Action] = {}
    for action in ACTIONS:
        for key in action.keys:
            name = key.removeprefix("ctrl+")
            found[getattr(glfw, f"KEY_{name.upper()}"), name != key] = action
    return found


class Hands:
    """What is held and where the cursor is, between one report and the next."""

    def __init__(self, viewer: Viewer) -> None:
        self._viewer = viewer
        self._bindings = _bindings()
        self._held: set[int] = set()
        self._drag = ""
        self._at = (0.0, 0.0)
        self._clicked = (-1.0, (0.0, 0.0))
        self._flown = 0.0

    def listen(self) -> None:
        """Be told of what happens to the window."""
        window = self._viewer.stage.window
        for register, heard in (
            (glfw.set_key_callback, self.on_key),
            (glfw.set_char_callback, self.on_character),
            (glfw.set_mouse_button_callback, self.on_button),
            (glfw.set_cursor_pos_callback, self.on_cursor),
            (glfw.set_scroll_callback, self.on_scroll),
            (glfw.set_drop_callback, self.on_drop),
            (glfw.set_framebuffer_size_callback, self.on_resize),
            (glfw.set_window_refresh_callback, self.on_refresh),
            (glfw.set_window_focus_callback, self.on_focus),
        ):
            register(window, self._guarded(heard))

    def _guarded(self, heard: Callable[..., None]) -> Callable[..., None]:
        def told(_window: Any, *what: Any) -> None:
            try:
                heard(*what)
            except Exception as error:
                self._viewer.shown.complain(ACTION, error)

        return told

    # ------------------------------------------------------------ keys

    @property
    def at(self) -> tuple[float, float]:
        """Where the cursor is, as `place` says."""
        return self._at

    @property
    def mods(self) -> int:
        """Modifiers that are held."""
        return sum({_MODIFIERS[key] for key in self._held if key in _MODIFIERS})

    def on_key(self, key: int, _code: int, action: int, _mods: int = 0) -> None:
        """A key goes down, repeats or goes up."""
        if action == glfw.RELEASE:
            self._held.discard(key)
        elif action == glfw.PRESS:
            if not self.is_flying:
                self._flown = time.perf_counter()
            self._held.add(key)
            self._viewer.shown.forgive(ACTION)
        panel = self._viewer.panel
        if panel is not None and panel.on_key(key, action, self.mods):
            self._held -= _FLIGHT.keys()
            return
        bound = self._bindings.get((key, bool(self.mods & _CTRL)))
        if bound is not None and action != glfw.RELEASE:
            bound.does(self._viewer)

    def on_character(self, code: int) -> None:
        """A character is typed; only the panel has a use for it."""
        if self._viewer.panel is not None:
            self._viewer.panel.on_character(code)

    @property
    def is_flying(self) -> bool:
        """Whether a key of flight is held."""
        return bool(self._held & _FLIGHT.keys()) and not self.mods & _CTRL

    def fly(self, now: float) -> None:
        """As far as the time since the last frame goes."""
        if not self.is_flying:
            return
        ways = [_FLIGHT[key] for key in self._held & _FLIGHT.keys()]
        far = SPEED * min(now - self._flown, 0.1) * (3 if self.mods & _SHIFT else 1)
        self._flown = now
        right, up, forward = (far * sum(way[i] for way in ways) for i in range(3))
        self._viewer.shown.move(lambda camera: navigation.fly(camera, right, up, forward))

    # ------------------------------------------------------------ mouse

    def on_button(self, button: int, action: int, mods: int) -> None:
        """A mouse button goes down or up."""
        panel = self._viewer.panel
        if panel is not None and panel.on_button(button, action) and action == glfw.PRESS:
            return
        if action == glfw.RELEASE:
            self._drag = ""
            return
        self._viewer.shown.forgive(ACTION)
        self._drag = self._dragging(button, mods)
        if button == LEFT and not mods:
            now, (then, where) = time.perf_counter(), self._clicked
            self._clicked = (now, self._at)
            if now - then < DOUBLE and math.dist(where, self._at) < STILL:
                self._clicked = (-1.0, self._at)
                self._pivot()

    def _dragging(self, button: int, mods: int) -> str:
        """What a drag with a button does."""
        if button == LEFT:
            if mods & (_SHIFT | _ALT):
                return "environment"
            return "pan" if mods & _CTRL else "look" if self.is_flying else "orbit"
        if button == MIDDLE:
            return "pan" if mods & _SHIFT else "zoom" if mods & _CTRL else "orbit"
        return "pan" if button == RIGHT else ""

    def place(self, x: float, y: float) -> tuple[float, float]:
        """A cursor position in the window system's units, as shares of the picture's height right and up of its middle:
        these are the same whatever a pixel is."""
        stage = self._viewer.stage
        width, height = glfw.get_window_size(stage.window)
        middle = (width + stage.left * width / max(stage.size[0], 1)) / 2
        return (x - middle) / max(height, 1), (height / 2 - y) / max(height, 1)

    def on_cursor(self, x: float, y: float) -> None:
        """The cursor moves."""
        before, self._at = self._at, self.place(x, y)
        viewer = self._viewer
        if viewer.panel is not None:
            viewer.panel.on_cursor(x, y)
        if viewer.comparison.way:
            viewer.shown.expose()
        across, down = self._at[0] - before[0], before[1] - self._at[1]
        if not self._drag or not (across or down):
            return
        if self._drag == "environment":
            viewer.shown.turn_environment(TURN * across)
        elif self._drag == "zoom":
            viewer.shown.move(lambda camera: navigation.zoom(camera, -40 * down))
        else:
            movement = getattr(navigation, self._drag)
            viewer.shown.move(lambda camera: movement(camera, across, down))

    def on_scroll(self, across: float, up: float) -> None:
        """The wheel turns, or two fingers move; touchpads report shares of a step, and both directions."""
        viewer, at = self._viewer, self._at
        if viewer.panel is not None and viewer.panel.on_scroll(across, up):
            return
        if self.mods & _SHIFT:
            viewer.shown.move(lambda camera: navigation.pan(camera, 0.05 * across, 0.05 * up))
        elif self.mods & _CTRL:
            viewer.shown.move(lambda camera: navigation.with_fov(camera, navigation.WHEEL**up))
        elif self.mods & _ALT:
            viewer.shown.turn_environment(5 * (across + up))
        else:
            viewer.shown.move(lambda camera: navigation.orbit(navigation.zoom(camera, up, at), across / 48, 0))

    def _under(self) -> Picked | None:
        from glbump.viewer.picking import pick

        return pick(self._viewer.shown.scene, self._viewer.shown.contents, self._at, self._viewer.stage.room)

    def _pivot(self) -> None:
        picked = self._under()
        if picked is not None:
            self._viewer.shown.move(lambda camera: navigation.centred(camera, picked.point))

    # ------------------------------------------------------------ the window

    def on_drop(self, names: Sequence[str]) -> None:
        """Files are let go over the window."""
        self._viewer.shown.forgive(ACTION)
        try:
            picked = self._under()
        except GlbumpError:
            picked = None  # A mesh that cannot be read any more keeps nothing out.
        self._viewer.shown.drop([Path(name) for name in names], 0 if picked is None else picked.surface)

    def on_resize(self, _width: int, _height: int) -> None:
        """The window has another size, in pixels."""
        self._viewer.make_room()

    def on_refresh(self) -> None:
        """The window system has lost a part of the picture."""
        self._viewer.shown.expose()

    def on_focus(self, focused: int) -> None:
        """Keys that are let go elsewhere are not reported."""
        if not focused:
            self._held.clear()
            self._drag = ""
