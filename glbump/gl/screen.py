"""What a window shows: a finished frame through the tone curve, and text and panels over it. Nothing is read back."""

from __future__ import annotations

from collections.abc import Hashable, Iterable
from typing import Any, NamedTuple

import moderngl
import numpy as np
import numpy.typing as npt

from glbump import validate as check
from glbump.errors import ShaderError
from glbump.gl.context import Context
from glbump.gl.program import build_program
from glbump.gl.source import resolve
from glbump.gl.targets import Targets
from glbump.gl.uniforms import Uniforms
from glbump.maps.colour import TONES

VERTEX = np.dtype([("place", "<f4", 2), ("texcoord", "<f4", 2), ("tint", "u1", 4)])
"""Of the interface: pixels from the window's upper left corner, texture coordinates from the picture's upper left
corner, straight sRGB and alpha."""
_FORMAT = "2f 2f 4f1"
_PICTURE = 0


class Box(NamedTuple):
    """A picture laid on the window. pixels: (H, W, 4) bytes, straight sRGB and alpha, row 0 on top; the same array is
    uploaded once. x, y: of its upper left corner, in pixels from the window's. size: (width, height) on the window, the
    picture's own unless given."""

    pixels: npt.NDArray[np.uint8]
    x: int
    y: int
    size: tuple[int, int] | None = None


class Batch(NamedTuple):
    """Triangles of one texture. first, number: of indices; clip: x0, y0, x1, y1, in pixels from the window's upper left
    corner."""

    texture: Hashable
    first: int
    number: int
    clip: tuple[float, float, float, float]


class Screen:
    """Draws to the framebuffer of a context's own window."""

    def __init__(self, context: Context) -> None:
        self._context, self._gl = context, context.gl
        self._programs: dict[str, Uniforms] = {}
        self._textures: dict[Hashable, moderngl.Texture] = {}
        self._boxes: dict[int, npt.NDArray[np.uint8]] = {}
        self._window: Any = self._gl.detect_framebuffer(0)

    def show(
        self,
        frame: moderngl.Framebuffer | None,
        size: tuple[int, int],
        tone: str = "clip",
        exposure: float = 0.0,
        *,
        left: int = 0,
        begin: int = 0,
    ) -> None:
        """Fill the window, `size` (width, height) pixels, with a frame of any size; with grey for none.

        left: pixels of the window that something else covers on its left, beside which the frame is. begin: the column
        of the window from which on it is drawn.
        tone, exposure: as in Frame.save, whose bytes these are to 1/255 where the sizes are the same; NaN is magenta.
        """
        self._begin(size)
        if frame is None:
            self._gl.clear(0.2, 0.2, 0.2, 1.0)
            return
        texture = Targets.texture_of(frame)
        # Texels as they are, unless there are fewer of them than pixels.
        room = max(1, size[0] - left), size[1]
        same = texture.size == room
        texture.filter = (moderngl.NEAREST, moderngl.NEAREST) if same else (moderngl.LINEAR, moderngl.LINEAR)
        texture.repeat_x = texture.repeat_y = False
        texture.use(_PICTURE)
        uniforms = self._program(check.choice("tone", tone, TONES))
        place = {"corner": (float(left), 0.0), "shown_size": tuple(map(float, room))}
        uniforms.write(place | {"picture": _PICTURE, "gain": 2.0**exposure})
        self._window.viewport = (left, 0, *room)
        self._window.scissor = (begin, 0, size[0], size[1]) if begin else None
        uniforms.vertices.render(vertices=3)
        self._window.scissor = None

    def lay(self, boxes: Iterable[Box], size: tuple[int, int]) -> None:
        """Pictures over what is shown, the last on top. Those of other calls are forgotten."""
        boxes = list(boxes)
        kept = {id(box.pixels): box.pixels for box in boxes}
        for key in self._boxes.keys() - kept.keys():
            self.forget(key)
        for key in kept.keys() - self._boxes.keys():
            self.keep(key, kept[key], smooth=False)
        self._boxes = kept
        if not boxes:
            return
        vertices = np.zeros((len(boxes), 4), VERTEX)
        corners = np.array([(0, 0), (1, 0), (1, 1), (0, 1)])
        vertices["texcoord"], vertices["tint"] = corners, 255
        for quad, (pixels, x, y, wanted) in zip(vertices, boxes):
            quad["place"] = (x, y) + corners * (wanted or pixels.shape[1::-1])
        indices = 4 * np.arange(len(boxes))[:, None] + [0, 1, 2, 0, 2, 3]
        whole = (0.0, 0.0, float(size[0]), float(size[1]))
        batches = [Batch(id(box.pixels), 6 * i, 6, whole) for i, box in enumerate(boxes)]
        self.triangles(vertices.reshape(-1), indices.reshape(-1), batches, size)

    def keep(self, name: Hashable, pixels: npt.NDArray[np.uint8], *, smooth: bool = True) -> None:
        """A texture for `triangles`: (H, W, 4) bytes. One of that name goes."""
        self.forget(name)
        texture = self._gl.texture(pixels.shape[1::-1], 4, np.ascontiguousarray(pixels).tobytes())
        how = moderngl.LINEAR if smooth else moderngl.NEAREST
        texture.filter = (how, how)
        self._textures[name] = texture

    def forget(self, name: Hashable) -> None:
        """Free a texture that was kept, if it was."""
        if name in self._textures:
            self._textures.pop(name).release()

    def triangles(
        self,
        vertices: npt.NDArray[np.void],
        indices: npt.ArrayLike,
        batches: Iterable[Batch],
        size: tuple[int, int],
    ) -> None:
        """Triangles over what is shown, in order. vertices: (V,) VERTEX; indices: (I,) rows of them."""
        self._begin(size)
        self._gl.enable_only(moderngl.BLEND)
        self._gl.blend_func = moderngl.SRC_ALPHA, moderngl.ONE_MINUS_SRC_ALPHA
        uniforms = self._program("")
        uniforms.write({"picture": _PICTURE, "window_size": tuple(map(float, size))})
        buffers = [self._gl.buffer(vertices.tobytes()), self._gl.buffer(np.asarray(indices, np.uint32).tobytes())]
        content = [(buffers[0], _FORMAT, *(VERTEX.names or ()))]
        array = self._gl.vertex_array(uniforms.program, content, buffers[1])
        for batch in batches:
            x0, y0, x1, y1 = (int(edge) for edge in np.clip(np.rint(batch.clip), 0, (*size, *size)))
            if x1 > x0 and y1 > y0 and batch.texture in self._textures:
                self._window.scissor = x0, size[1] - y1, x1 - x0, y1 - y0
                self._textures[batch.texture].use(_PICTURE)
                array.render(vertices=batch.number, first=batch.first)
        self._window.scissor = None
        array.release()
        for buffer in buffers:
            buffer.release()

    def read(self, size: tuple[int, int]) -> npt.NDArray[np.uint8]:
        """(H, W, 3) bytes, row 0 on top: what has been drawn to the window and not been swapped yet."""
        self._context.check("read the window")
        pixels = self._window.read(viewport=(0, 0, *size), components=3, alignment=1)
        return np.frombuffer(pixels, np.uint8).reshape(size[1], size[0], 3)[::-1]

    def renew(self) -> None:
        """Compile the programs anew: their files have changed. ShaderError where one does not compile; then those there
        are stay."""
        before, self._programs = self._programs, {}
        try:
            for name in before:
                self._program(name)
        except ShaderError:
            self._programs, before = before, self._programs
            raise
        finally:
            for uniforms in before.values():
                uniforms.release()

    def release(self) -> None:
        """Free everything."""
        for uniforms in self._programs.values():
            uniforms.release()
        for texture in self._textures.values():
            texture.release()
        self._programs.clear()
        self._textures.clear()
        self._boxes.clear()

    def _begin(self, size: tuple[int, int]) -> None:
        self._context.check("show")
        self._window.use()
        self._window.viewport = (0, 0, *size)
        self._window.scissor = None
        self._gl.enable_only(moderngl.NOTHING)

    def _program(self, tone: str) -> Uniforms:
        """Of a tone curve; of the interface for ""."""
        if tone not in self._programs:
            defines = {"TONE": TONES.index(tone)} if tone else {}
            vertex, fragment = ("fullscreen.vert", "present.frag") if tone else ("interface.vert", "interface.frag")
            program = build_program(self._gl, resolve(vertex), resolve(fragment, defines=defines))
            self._programs[tone] = Uniforms(self._gl, program)
        return self._programs[tone]
