"""Where frames are drawn: colour, depth and, for several samples a pixel, their sum."""

from __future__ import annotations

import ctypes

import moderngl

from glbump.errors import LimitError
from glbump.gl.context import Context
from glbump.plan import Plan

_COLOR, _DEPTH = 0x1800, 0x1801
DTYPES = {"half": "f2", "float": "f4"}


class Targets:
    """Framebuffers for one size and format. `sum` and `straight` are there only where the plan needs them."""

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
        self.one = self._framebuffer(plan.size, depth=True)
        self.sum = self._framebuffer(plan.size) if plan.samples > 1 else None
        self.straight = self._framebuffer(plan.size) if self.sum is not None and not plan.sky else None

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
        return plan.size, plan.frame_format, plan.samples > 1, plan.sky

    def _framebuffer(self, size: tuple[int, int], depth: bool = False) -> moderngl.Framebuffer:
        texture = self._gl.texture(size, 4, dtype=self.dtype)
        texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
        return self._gl.framebuffer([texture], self._gl.depth_renderbuffer(size) if depth else None)

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
        for frame in (self.one, self.sum, self.straight):
            if frame is not None:
                for attachment in (*frame.color_attachments, frame.depth_attachment):
                    if attachment is not None:
                        attachment.release()
                frame.release()
