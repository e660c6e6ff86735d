"""The window's own side of OpenGL: its context, the renderer, and what is presented. Made anew when the GPU is lost."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import NamedTuple

import glfw
import numpy as np
import numpy.typing as npt

from glbump.contents import Contents
from glbump.gl.context import Context, open_window
from glbump.gl.prepared import Drawn
from glbump.gl.renderer import Renderer
from glbump.gl.screen import Box, Screen
from glbump.quality import Quality
from glbump.scene import Scene
from glbump.viewer.pace import Step, scaled

Bytes = npt.NDArray[np.uint8]


class Timing(NamedTuple):
    """Milliseconds of one frame: planning and uploading, drawing until the GPU was done, and bringing it to the screen.
    Nothing is read back."""

    plan: float
    draw: float
    present: float


class Stage:
    """A visible window with a renderer in it. Raises ContextError where none can be opened.

    left: pixels of its left side that are not the picture's. view: what is shown in place of light, in colours.
    """

    def __init__(self, size: tuple[int, int], title: str, contents: Contents) -> None:
        """contents: maps already read."""
        self.context: Context = open_window(size, title)
        self.window = self.context.native.window  # type: ignore[attr-defined]
        glfw.swap_interval(1)
        self.renderer = Renderer(context=self.context, contents=contents)
        self.screen = Screen(self.context)
        self.picture: Drawn | None = None
        self.view: Bytes | None = None
        self.left = 0

    @property
    def size(self) -> tuple[int, int]:
        """(width, height) in pixels; 0 while the window is minimised."""
        width, height = glfw.get_framebuffer_size(self.window)
        return width, height

    @property
    def room(self) -> tuple[int, int]:
        """(width, height) in pixels of the picture, 1 at least."""
        width, height = self.size
        return max(1, width - self.left), max(1, height)

    @property
    def ratio(self) -> float:
        """Pixels to a point, for text."""
        return float(max(1.0, glfw.get_window_content_scale(self.window)[0]))

    def draw(self, scene: Scene, quality: Quality, step: Step, stop: Callable[[], bool] | None = None) -> Timing | None:
        """A new `picture`; None where `stop` gave it up, and the last one stays. Errors as of Renderer.draw, after
        which it stays too."""
        whole = step == Step(quality.samples, 1.0)
        started = time.perf_counter()
        drawn = self.renderer.draw(
            scene,
            scaled(self.room, step.scale),
            replace(quality, samples=step.samples),
            use="window" if whole else "drafts",
            stop=stop,
        )
        self.context.gl.finish()
        if drawn is None:
            return None
        self.picture = drawn
        planned = float(drawn.stats["ms"]["plan and upload"])
        return Timing(planned, 1e3 * (time.perf_counter() - started) - planned, 0.0)

    def draw_view(self, scene: Scene, quality: Quality, view: str, step: Step) -> Timing:
        """A new `view`: raw values read back, and coloured by the CPU."""
        started = time.perf_counter()
        self.view = self.renderer.render(scene, scaled(self.room, step.scale), quality, show=view).display()
        return Timing(0.0, 1e3 * (time.perf_counter() - started), 0.0)

    def present(
        self,
        tone: str,
        exposure: float,
        boxes: Iterable[Box],
        over: Callable[[], None] | None = None,
        beside: tuple[Drawn, int] | None = None,
    ) -> float:
        """Bring the picture to the screen with boxes, then what `over` draws, over it; milliseconds. beside: another
        picture, and the column of the window from which on that is seen."""
        started = time.perf_counter()
        size = self.size
        self.screen.show(self.picture and self.picture.frame, size, tone, exposure, left=self.left)
        view = [] if self.view is None else [Box(self.view, self.left, 0, self.room)]
        if beside is not None:
            self.screen.show(beside[0].frame, size, tone, exposure, left=self.left, begin=beside[1])
        self.screen.lay([*view, *boxes], size)
        if over is not None:
            over()
        glfw.swap_buffers(self.window)
        return 1e3 * (time.perf_counter() - started)

    def renew(self) -> None:
        """Compile all shaders anew: their files have changed. ShaderError where one of the screen's does not."""
        self.renderer.renew()
        self.screen.renew()

    def release(self) -> None:
        """Close the window and free everything."""
        if not self.context.is_open:
            return
        self.picture = None
        self.screen.release()
        self.renderer.release()
        self.context.release()
