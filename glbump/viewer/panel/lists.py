"""imgui's lists of triangles, handed to the window's Screen; imgui's textures, kept there."""

from __future__ import annotations

import ctypes
from typing import Any

import numpy as np
import numpy.typing as npt
from imgui_bundle import imgui

from glbump.gl.screen import VERTEX, Batch, Screen


class Lists:
    """The drawing side of imgui. Its vertices are laid out as VERTEX: place, texture coordinates, colour."""

    def __init__(self, screen: Screen) -> None:
        self._screen = screen
        imgui.get_io().backend_flags |= imgui.BackendFlags_.renderer_has_textures

    def draw(self, data: Any, size: tuple[int, int]) -> None:
        """All lists of a frame, over what the window shows."""
        for texture in imgui.get_platform_io().textures:
            self._keep(texture)
        vertices, indices, batches, before, done = [], [], [], 0, 0
        for one in data.cmd_lists:
            vertices.append(_array(one.vtx_buffer, VERTEX))
            mine = _array(one.idx_buffer, np.dtype(f"<u{imgui.INDEX_SIZE}")).astype(np.uint32)
            for command in one.cmd_buffer:
                part = slice(command.idx_offset, command.idx_offset + command.elem_count)
                mine[part] += before + command.vtx_offset
                rectangle = command.clip_rect
                clip = (rectangle.x, rectangle.y, rectangle.z, rectangle.w)
                batches.append(
                    Batch(("imgui", command.get_tex_id()), done + command.idx_offset, command.elem_count, clip)
                )
            indices.append(mine)
            before, done = before + len(vertices[-1]), done + len(mine)
        if batches:
            self._screen.triangles(np.concatenate(vertices), np.concatenate(indices), batches, size)

    def _keep(self, texture: Any) -> None:
        """A texture as imgui wants it now: made, changed or let go."""
        name = ("imgui", texture.unique_id)
        if texture.status in (imgui.ImTextureStatus.want_create, imgui.ImTextureStatus.want_updates):
            pixels = texture.get_pixels_array().reshape(texture.height, texture.width, 4)
            self._screen.keep(name, pixels)
            texture.set_tex_id(texture.unique_id)
            texture.set_status(imgui.ImTextureStatus.ok)
        elif texture.status == imgui.ImTextureStatus.want_destroy and texture.unused_frames > 0:
            self._screen.forget(name)
            texture.set_tex_id(0)
            texture.set_status(imgui.ImTextureStatus.destroyed)

    def release(self) -> None:
        """Let go of all textures."""
        for texture in imgui.get_platform_io().textures:
            if texture.ref_count == 1:
                self._screen.forget(("imgui", texture.unique_id))
                texture.set_tex_id(0)
                texture.set_status(imgui.ImTextureStatus.destroyed)


def _array(buffer: Any, dtype: np.dtype[Any]) -> npt.NDArray[Any]:
    """The entries of one of imgui's vectors, in place."""
    count = buffer.size()
    if not count:
        return np.zeros(0, dtype)
    memory = (ctypes.c_uint8 * (count * dtype.itemsize)).from_address(buffer.data_address())
    return np.frombuffer(memory, dtype)
