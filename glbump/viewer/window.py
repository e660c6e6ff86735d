"""The window: the loop between what is done to it and what it shows.

A frame is drawn when something has changed, and at no other time.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import glfw

from glbump.errors import ContextError, SceneError
from glbump.frame import Frame
from glbump.quality import Quality
from glbump.scene import Scene
from glbump.viewer.comparing import FLICKER, WIPE, Comparison
from glbump.viewer.hands import ACTION, Hands
from glbump.viewer.pace import Pace, Step, scaled
from glbump.viewer.regions import RegionReference
from glbump.viewer.showing import Open, Showing
from glbump.viewer.stage import Stage, Timing

if TYPE_CHECKING:
    from glbump.gl import prepared
    from glbump.gl.screen import Box
    from glbump.viewer.panel import Panel

LOOK = 0.25
"""Seconds between two looks at the files."""
REST = 0.15
"""Seconds without a change after which a draft is drawn out."""
NO_PANEL = "the panel needs imgui-bundle: pip install 'glbump[view]'; F1 shows what keys do"


class Drawn(NamedTuple):
    """What the picture on the screen is of: a version of what is shown, and how finely it was drawn. fails: whether
    that went wrong, and the picture is the one before."""

    version: int
    step: Step
    fails: bool = False


class Viewer:
    """One window. `run` until it is closed, or `step` by step as tests do; then `release`.

    opens: what to show. folder: where pictures and scenes are written. tone, exposure: in place of the subjects' own.
    timings: of the last frames drawn; read_back: milliseconds of the last picture that was, None before.
    Raises ContextError where no window can be opened.
    """

    def __init__(
        self,
        opens: Sequence[Open],
        *,
        size: tuple[int, int] = (1024, 768),
        quality: str | Quality = "balanced",
        tone: str | None = None,
        exposure: float | None = None,
        folder: Path | None = None,
    ) -> None:
        self.folder = folder or Path()
        self.shown: Showing = Showing(opens, quality, tone=tone, exposure=exposure)
        self.stage: Stage = Stage(size, "opening ... - glbump", self.shown.contents)
        self.hands: Hands = Hands(self)
        self.panel: Panel | None = None
        self.timings: deque[Timing] = deque(maxlen=120)
        self.read_back: float | None = None
        self.comparison = Comparison()
        self.reference = RegionReference()
        self._pace = Pace()
        self._drawn = Drawn(-1, Step(1, 1.0))
        self._looked, self._title = 0.0, ""
        # The line at the bottom, and since when: figures that change with every frame are not read.
        self._told, self._line, self._rests = 0.0, "", False
        self._is_seen = False
        self._before: tuple[int, int, int, int] | None = None
        self.hands.listen()
        self.shown.go(0)

    # ------------------------------------------------------------ the loop

    def run(self) -> None:
        """Until the window is closed."""
        while not self.is_closing:
            self.step()

    @property
    def is_closing(self) -> bool:
        """Whether somebody has closed it."""
        return bool(glfw.window_should_close(self.stage.window))

    def step(self, patience: float = LOOK) -> None:
        """Do what is due, then wait for something to happen, `patience` seconds at most."""
        try:
            self._due()
        except Exception as error:
            self.shown.complain(ACTION, error)
        wait = min(patience, self._patience())
        if wait > 0:
            glfw.wait_events_timeout(wait)
        else:
            glfw.poll_events()

    def _due(self) -> None:
        now = time.perf_counter()
        if self.stage.context.is_lost:
            self.rebuild()
        self.hands.fly(now)
        self.shown.fade(now)
        if now - self._looked > LOOK:
            self._looked = now
            if self.shown.look_at_files():
                self.shown.attempt("shaders", self.stage.renew)
        self.reference.follow(self.shown, self.stage.room)
        if self.reference.poll():
            self.shown.expose()
        if self.is_hidden:
            return
        if self.shown.is_busy:
            # What is going to be done is said before it is done.
            if self.shown.exposed:
                self._present()
            self.shown.go_on()
        step = self._next_step(now)
        if step is not None:
            self._draw(step)
        elif now >= self.shown.changed + REST:
            self._compare()
        if self.comparison.flip(now):
            self.shown.expose()
        if self.shown.exposed:
            self._present()

    def _patience(self) -> float:
        """Seconds in which nothing will be due."""
        shown = self.shown
        if self.is_hidden or self.stage.context.is_lost:
            return LOOK
        if shown.is_busy or shown.exposed or self.hands.is_flying or self._drawn.version != shown.version:
            return 0.0
        now = time.perf_counter()
        if self._drawn.step != self._whole or self._compares:
            return max(0.0, shown.changed + REST - now)
        return min(LOOK, self.comparison.until_flip(now))

    @property
    def is_hidden(self) -> bool:
        """Whether there is not a pixel to draw, as while it is minimised."""
        return min(self.stage.size) == 0

    @property
    def is_seen(self) -> bool:
        """Whether the first picture has come to the screen, or the lack of one. Words over it come with the next frame:
        what writes them takes as long to load as the picture takes to draw."""
        return self._is_seen

    @property
    def is_settled(self) -> bool:
        """Whether nothing is left to be drawn until something changes."""
        done = self._drawn[:2] == (self.shown.version, self._whole)
        return done and not self.shown.is_busy and not self.shown.exposed and not self._compares

    # ------------------------------------------------------------ drawing

    @property
    def drawn(self) -> Step:
        """How the picture on the screen was drawn."""
        return self._drawn.step

    @property
    def _whole(self) -> Step:
        # Views have one sample in the middle of each pixel.
        return Step(1 if self.shown.view else self.shown.quality.samples, 1.0)

    def _next_step(self, now: float) -> Step | None:
        """How the next frame is drawn: fast at first, finer where nothing changes any more; None where none is due."""
        if self._drawn.version != self.shown.version:
            return self._pace.moving(self.stage.room, self._whole.samples)
        if self._drawn.step == self._whole or now < self.shown.changed + REST:
            return None
        return Step(1, 1.0) if self._drawn.step.scale < 1 else self._whole

    def _draw(self, step: Step) -> None:
        shown, version = self.shown, self.shown.version
        # What is drawn out at rest is given up for the first thing that happens.
        self._rests = self._drawn.version == version
        stop = self._is_disturbed if self._rests else None
        try:
            if shown.view is not None:
                timing: Timing | None = self.stage.draw_view(shown.scene, shown.quality, shown.view, step)
            else:
                self.stage.view = None
                timing = self.stage.draw(shown.scene, shown.quality, step, stop)
        except Exception as error:
            if isinstance(error, ContextError) and self.stage.context.is_lost:
                self.rebuild()
                return
            # Said once for each version; the last good picture stays.
            self._drawn = Drawn(version, self._whole, fails=True)
            shown.complain("picture", error)
            return
        if timing is not None:
            self._drawn = Drawn(version, step)
            beside = timing.plan + (self.timings[-1].present if self.timings else 0.0)
            self._pace = self._pace.after(step, scaled(self.stage.room, step.scale), timing.draw, beside)
            self.timings.append(timing)
            shown.forgive("picture")
            shown.forgive("comparison")  # One that failed is tried again, with another picture.
            shown.expose()

    @property
    def _compares(self) -> bool:
        """Whether there is something that the picture has not been held against."""
        shown = self.shown
        self.comparison.begin(shown.version)
        due = self.comparison.is_due(shown.tone, shown.exposure) or self.reference.is_due(shown)
        return due and not (self._drawn.fails or shown.view or shown.trouble)

    def _compare(self) -> None:
        shown = self.shown
        if not self._compares:
            return
        if self.reference.is_due(shown):
            shown.attempt("comparison", lambda: self.reference.measure(shown, self.stage))
        else:
            shown.attempt("comparison", lambda: self.comparison.carry_on(shown, self.stage, self._is_disturbed))
        shown.expose()

    def compare(self, way: str | None = None, second: str | None = None) -> None:
        """Hold the picture against a second one, as glbump.viewer.comparing has it: another way, or another one."""
        comparison = self.comparison
        comparison.choose(comparison.way if way is None else way, second or comparison.second)
        self.shown.forgive("comparison")
        self.shown.expose()

    @property
    def beside(self) -> tuple[prepared.Drawn, int] | None:
        """The second picture, and the column of the window from which on it is seen: the cursor's, or the first; None
        while it is not."""
        comparison = self.comparison
        if comparison.picture is None:
            return None
        if comparison.way == FLICKER:
            return (comparison.picture, self.stage.left) if comparison.flipped else None
        return (comparison.picture, self.split) if comparison.way == WIPE else None

    @property
    def split(self) -> int:
        """The column of the window at which the second picture begins: the cursor's."""
        width, height = self.stage.room
        column = int(self.hands.at[0] * height + width / 2)
        return self.stage.left + min(max(column, 1), width - 1)

    def _is_disturbed(self) -> bool:
        version = self.shown.version
        glfw.poll_events()
        return self.shown.version != version or self.is_closing

    def _present(self) -> None:
        shown = self.shown
        shown.exposed -= 1
        if shown.subject.title != self._title:
            self._title = shown.subject.title
            glfw.set_window_title(self.stage.window, f"{self._title} - glbump")
        self.comparison.begin(shown.version)
        boxes = self._words() if self._is_seen else []
        over = self.panel.draw if self.panel is not None and self.panel.is_shown else None
        ms = self.stage.present(shown.tone, shown.exposure, boxes, over, self.beside)
        if self.timings:
            self.timings[-1] = self.timings[-1]._replace(present=ms)
        if not self._is_seen and not shown.is_busy:
            self._is_seen = True
            shown.expose()

    def _words(self) -> list[Box]:
        from glbump.viewer.plates import plates, status

        now = time.perf_counter()
        if now - self._told > LOOK or self._rests:
            self._told, self._line = now, status(self)
        return plates(self, self.stage.size, self.stage.ratio, self._line)

    def render(self, scene: Scene, size: tuple[int, int], quality: Quality) -> Frame:
        """A picture, read back."""
        frame = self.stage.renderer.render(scene, size, quality)
        self.read_back = frame.stats["ms"]["finish and read back"]
        return frame

    # ------------------------------------------------------------ the window itself

    def rebuild(self) -> None:
        """A new window in place of one whose GPU is lost; all that was on it is made again. ContextError where there is
        no new one yet: the old one stays until there is, so that it can be closed."""
        size, place = glfw.get_window_size(self.stage.window), glfw.get_window_pos(self.stage.window)
        stage = Stage(size, "glbump", self.shown.contents)
        panel, self.panel, self._title, self._before = self.panel, None, "", None
        with suppress(Exception):
            if panel is not None:
                panel.release()
        with suppress(Exception):
            self.stage.release()
        self.stage = stage
        glfw.set_window_pos(self.stage.window, *place)
        self.hands.listen()
        self.hands.on_focus(0)  # What is let go now, nobody is told of.
        if panel is not None and panel.is_shown:
            self.toggle_panel()
        self.shown.forgive(ACTION)
        self.shown.say("the GPU was reset; all that was on it has been made again")
        self.shown.touch()

    def _pointed(self, size: tuple[int, int]) -> tuple[int, int] | None:
        """The pixel under the cursor of a picture of `size`, row 0 on top."""
        width, height = size
        across, up = self.hands.at
        x, y = int(across * height + width / 2), int((0.5 - up) * height)
        return (x, y) if 0 <= x < width and 0 <= y < height else None

    def inspect(self) -> None:
        """Tell of the pixel under the cursor."""
        size = self.stage.room
        pixel = self._pointed(size)
        if pixel is not None:
            from glbump.viewer.inspecting import inspect

            self.shown.begin(inspect(self, *pixel, size))

    def refer(self) -> None:
        """Have the float64 reference made round the cursor, in the background."""
        size = self.stage.room
        pixel = self._pointed(size)
        if pixel is not None:
            self.reference.begin(self.shown, size, *pixel)
            self.shown.expose()

    def stop(self) -> None:
        """Give up what goes on, and put all plates away."""
        self.reference.cancel()
        self.shown.stop()

    def reload(self) -> None:
        """Read the scene and the shaders anew, and whatever else has changed."""
        self.shown.touch()
        self.shown.attempt("shaders", self.stage.renew)
        self.shown.attempt("scene file", self.shown.read_scene)

    def toggle_panel(self) -> None:
        """The panel, on and off; SceneError where it is not installed."""
        if self.panel is not None:
            self.panel.is_shown = not self.panel.is_shown
        else:
            try:
                from glbump.viewer.panel import Panel
            except ImportError:
                raise SceneError(NO_PANEL) from None
            self.panel = Panel(self)
        self.make_room()

    def make_room(self) -> None:
        """The picture beside the panel, or in all of the window."""
        self.stage.left = self.panel.width if self.panel is not None and self.panel.is_shown else 0
        self.shown.touch()
        self.shown.expose(3)

    def toggle_screen(self) -> None:
        """The whole screen, or the window it was before."""
        window: Any = self.stage.window
        nowhere: Any = None
        if self._before is not None:
            glfw.set_window_monitor(window, nowhere, *self._before, glfw.DONT_CARE)
            self._before = None
            return
        monitor = glfw.get_primary_monitor()
        if not monitor:
            raise SceneError("there is no monitor to fill")
        mode: Any = glfw.get_video_mode(monitor)
        self._before = (*glfw.get_window_pos(window), *glfw.get_window_size(window))
        glfw.set_window_monitor(window, monitor, 0, 0, mode.size.width, mode.size.height, mode.refresh_rate)

    def close(self) -> None:
        """Let `run` end."""
        glfw.set_window_should_close(self.stage.window, True)

    def release(self) -> None:
        """Close the window and free everything."""
        self.reference.cancel()
        if self.panel is not None:
            self.panel.release()
            self.panel = None
        self.stage.release()
