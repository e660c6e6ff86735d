"""Where frames are drawn: colour, depth and, for several samples a pixel, their sum."""

from __future__ import annotations

import moderngl

from glbump.errors import LimitError
from glbump.gl.context import Context
from glbump.plan import Plan

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
        self.dtype = DTYPES[plan.frame_format]
        self.one = self._framebuffer(plan.size, depth=True)
        self.sum = self._framebuffer(plan.size) if plan.samples > 1 else None
        self.straight = self._framebuffer(plan.size) if self.sum is not None and not plan.sky else None

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
