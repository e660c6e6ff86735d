"""Where frames are drawn: colour, depth and, for several samples a pixel, their sum."""

from __future__ import annotations

import ctypes
from typing import Any

import moderngl
import numpy as np
import numpy.typing as npt

from glbump.errors import LimitError
from glbump.gl.context import Context
from glbump.plan import Plan

_COLOR, _DEPTH = 0x1800, 0x1801
DTYPES = {"half": "f2", "float": "f4"}


class Targets:
    """Framebuffers for one size and format: `one` is drawn in, and has all samples at once where the plan has them so;
    `sum` and `straight` are there only where the plan needs them."""

    def __init__(self, context: Context, plan: Plan) -> None:
        limit = min(context.info["max_texture_size"], context.info["max_renderbuffer_size"])
        if max(plan.size) > limit:
            raise LimitError(
                f"a frame of {plan.size[0]}x{plan.size[1]} is larger than this driver draws; "
                f"it takes at most {limit} a side; render parts, or a smaller size"
            )
        self._context, self._gl = context, context.gl
        self._sky = plan.sky
        self.dtype = DTYPES[plan.frame_format]
        self._frames: list[moderngl.Framebuffer] = []
        try:
            self.one = self._multisampled(plan) if plan.is_multisampled else self._framebuffer(plan.size, depth=True)
            self.sum = self._framebuffer(plan.size) if plan.samples > 1 else None
            self.straight = self._framebuffer(plan.size) if self.sum is not None and not plan.sky else None
        except LimitError:
            self.release()
            raise
        self._clear_one = context.native.entry("glClearBufferfv", ctypes.c_uint, ctypes.c_int, ctypes.c_void_p)

    def begin_sample(self) -> None:
        """Draw to `one`, with nothing in it. Colours that the sky will cover are left as they are: to clear eight
        bytes a pixel takes llvmpipe as long as to draw the sky."""
        self.one.use()
        if not self._sky:
            self._clear_one(_COLOR, 0, (ctypes.c_float * 4)())
        self._clear_one(_DEPTH, 0, (ctypes.c_float * 1)(1.0))

    @staticmethod
    def key(plan: Plan) -> tuple[object, ...]:
        """Plans with the same key can share targets."""
        return plan.size, plan.frame_format, plan.samples > 1, plan.is_multisampled, plan.sky

    def _framebuffer(self, size: tuple[int, int], depth: bool = False) -> moderngl.Framebuffer:
        texture = self._gl.texture(size, 4, dtype=self.dtype)
        texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
        return self._framebuffer_of(texture, self._gl.depth_renderbuffer(size) if depth else None)

    def _multisampled(self, plan: Plan) -> moderngl.Framebuffer:
        colour = self._gl.renderbuffer(plan.size, 4, samples=plan.samples, dtype=self.dtype)
        return self._framebuffer_of(colour, self._gl.depth_renderbuffer(plan.size, samples=plan.samples))

    def _framebuffer_of(
        self, colour: moderngl.Texture | moderngl.Renderbuffer, behind: moderngl.Renderbuffer | None
    ) -> moderngl.Framebuffer:
        size = colour.size
        try:
            frame = self._gl.framebuffer([colour], behind)
        except moderngl.Error:
            # Where memory ran out, textures are made all the same, with an error set and nothing in them.
            for part in (colour, behind):
                if part is not None:
                    part.release()
            said = self._gl.error
            raise LimitError(
                f"a frame of {size[0]}x{size[1]} does not fit in the driver's memory ({said}); render a smaller size"
            ) from None
        self._frames.append(frame)
        return frame

    @staticmethod
    def texture_of(frame: moderngl.Framebuffer) -> moderngl.Texture:
        """The colour texture of a framebuffer."""
        texture = frame.color_attachments[0]
        assert isinstance(texture, moderngl.Texture)
        return texture

    def release(self) -> None:
        """Free everything."""
        # moderngl would bind a freed framebuffer's name again.
        self._context.unbind()
        for frame in self._frames:
            for attachment in (*frame.color_attachments, frame.depth_attachment):
                if attachment is not None:
                    attachment.release()
            frame.release()
        self._frames.clear()


def read(frame: moderngl.Framebuffer) -> npt.NDArray[Any]:
    """The pixels as the GPU has them: (H, W, 4) float16 or float32, bottom row first."""
    dtype = Targets.texture_of(frame).dtype
    pixels = np.empty((frame.height, frame.width, 4), dtype)
    frame.read_into(pixels, components=4, dtype=dtype)
    return pixels
