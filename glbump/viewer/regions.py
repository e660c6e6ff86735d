"""The float64 reference of a part of the picture: made by a process of its own, while the window goes on."""

from __future__ import annotations

import os
from collections.abc import Hashable
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from glbump.contents import Contents, content_keys
from glbump.errors import GlbumpError
from glbump.gl.targets import read
from glbump.maps.colour import alpha_bytes, display_bytes
from glbump.scene import Scene
from glbump.viewer.comparing import SAMPLES, apart, on_screen
from glbump.viewer.showing import told

if TYPE_CHECKING:
    from multiprocessing.connection import Connection
    from multiprocessing.process import BaseProcess

    from glbump.reference.shade import Region
    from glbump.viewer.showing import Showing
    from glbump.viewer.stage import Stage

SIDE = 64
"""Pixels of the part's width and height."""
EDGE = 2
"""Pixels of the frame round it: white, and dark outside."""
GROUND = 84
"""What is clear is shown on, the mean of the window's chequered ground."""

Bytes = npt.NDArray[np.uint8]


def around(x: int, y: int, size: tuple[int, int]) -> Region:
    """(left, top, width, height) of SIDE x SIDE pixels about pixel (x, y), row 0 on top, as far as there are so many:
    whole quads of 2x2 pixels counted from the lower left corner, as the reference wants them."""
    left, below = (
        min(max(at - SIDE // 2, 0), max(0, most - SIDE + 1)) // 2 * 2 for at, most in zip((x, size[1] - 1 - y), size)
    )
    height = min(SIDE, size[1] - below)
    return left, size[1] - below - height, min(SIDE, size[0] - left), height


def compute(sender: Connection, scene: Scene, size: tuple[int, int], region: Region) -> None:
    """What the process does: send (samples, (H, W, 4) light) for each of SAMPLES, or (0, what went wrong)."""
    from glbump import reference

    if hasattr(os, "nice"):
        os.nice(10)  # The window goes first.
    contents = Contents()
    try:
        for samples in SAMPLES:
            sender.send((samples, reference.render(scene, size, samples, region=region, contents=contents).pixels))
    except Exception as error:
        sender.send((0, told(error)))


class RegionReference:
    """At most one part of the picture, and the reference there.

    region: where, or None; samples: of what there is, 0 before there is any; figures: how far the picture is off
    there, in words, "" until that is measured.
    """

    def __init__(self) -> None:
        self.region: Region | None = None
        self._key: Hashable = None
        self._scene: Scene | None = None
        self._version = -1
        self._process: BaseProcess | None = None
        self._receiver: Connection | None = None
        self._forget()

    def _forget(self) -> None:
        self.samples, self.figures = 0, ""
        self._pixels: npt.NDArray[np.float32] | None = None
        self._measured: Hashable = None
        self._box: tuple[Hashable, Bytes] = (None, np.zeros((1, 1, 4), np.uint8))

    def begin(self, shown: Showing, size: tuple[int, int], x: int, y: int) -> None:
        """Have the reference made about pixel (x, y) of a picture of `size`. Errors where the scene cannot be sent."""
        # What few ask for is imported when they do.
        import multiprocessing

        self.cancel()
        region, scene = around(x, y, size), shown.scene
        spawn: Any = multiprocessing.get_context("spawn")  # What is forked would have the window's OpenGL.
        receiver, sender = spawn.Pipe(duplex=False)
        process = spawn.Process(target=compute, args=(sender, scene, size, region), daemon=True)
        try:
            process.start()
        except BaseException:
            receiver.close()
            raise
        finally:
            sender.close()
        self._process, self._receiver = process, receiver
        self.region, self._scene, self._key = region, scene, (size, content_keys(scene))
        self._version = shown.version

    def follow(self, shown: Showing, size: tuple[int, int]) -> None:
        """Cancel what is of another scene, camera or size, or of files that have changed. Another quality is measured
        against it when it has been drawn."""
        if self.region is None or shown.version == self._version:
            return
        self._version, self.figures = shown.version, ""
        if shown.scene is not self._scene or (size, content_keys(shown.scene)) != self._key:
            self.cancel()

    def poll(self) -> bool:
        """Take up what the process has sent, and whether it has. GlbumpError where it has failed."""
        if self._receiver is None or not self._receiver.poll():
            return False
        try:
            samples, what = self._receiver.recv()
        except (EOFError, OSError):
            samples, what = 0, "its process has ended; there may be too little memory"
        if samples == 0:
            self.cancel()
            raise GlbumpError(f"the reference of this part: {what}")
        self._forget()
        self.samples, self._pixels = samples, what
        if samples == SAMPLES[-1]:
            self._end()
        return True

    @property
    def is_running(self) -> bool:
        """Whether there is more to come."""
        return self._process is not None

    def cancel(self) -> None:
        """No part any more; what is being made is given up."""
        self._end()
        self.region = self._scene = self._key = None
        self._forget()

    def _end(self) -> None:
        if self._process is not None:
            self._process.kill()
            self._process.join()
            self._process.close()
        if self._receiver is not None:
            self._receiver.close()
        self._process = self._receiver = None

    # ------------------------------------------------------------ figures, pixels

    def is_due(self, shown: Showing) -> bool:
        """Whether the picture has not been held against it yet."""
        return self._pixels is not None and self._measured != (shown.version, shown.tone, shown.exposure)

    def measure(self, shown: Showing, stage: Stage) -> None:
        """Hold the picture against it. ImageError where a pixel is not a number."""
        assert stage.picture is not None
        assert self.region is not None
        assert self._pixels is not None
        self._measured = shown.version, shown.tone, shown.exposure
        left, top, width, height = self.region
        ours = read(stage.picture.frame)[::-1][top : top + height, left : left + width]
        ours, true = (on_screen(light, shown.tone, shown.exposure) for light in (ours, self._pixels))
        self.figures = f"{shown.quality.preset} and it {apart(ours, true)}"

    def box(self, tone: str, exposure: float, *, filled: bool) -> Bytes:
        """(H + 2 EDGE, W + 2 EDGE, 4) bytes: a frame, with the reference in it if `filled` and there is one; the same
        array for the same picture."""
        assert self.region is not None
        key = tone, exposure, filled
        if self._box[0] != key:
            _, _, width, height = self.region
            framed = np.full((height + 2 * EDGE, width + 2 * EDGE, 4), (16, 16, 16, 255), np.uint8)
            framed[1:-1, 1:-1] = 255
            inside = framed[EDGE:-EDGE, EDGE:-EDGE]
            inside[...] = 0
            if filled and self._pixels is not None:
                light = np.nan_to_num(self._pixels)
                cover = alpha_bytes(light[..., 3:]) / 255
                inside[..., :3] = GROUND + cover * (display_bytes(light[..., :3], tone, exposure) - float(GROUND)) + 0.5
                inside[..., 3] = 255
            self._box = key, framed
        return self._box[1]

    @property
    def says(self) -> str:
        """A line about it."""
        if not self.samples:
            return "framed: the float64 reference, being computed; Escape stops it"
        more = f" of {SAMPLES[-1]}" if self.is_running else ""
        return f"framed: the float64 reference, {self.samples}{more} samples; {self.figures or 'no figures yet'}"
