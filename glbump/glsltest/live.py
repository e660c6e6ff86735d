"""How many OpenGL objects are alive, by kind: what a test leaves behind is a leak."""

from __future__ import annotations

import ctypes
from collections.abc import Mapping
from typing import Any

KINDS = ("Texture", "Buffer", "Framebuffer", "Program", "VertexArray", "Renderbuffer", "Query", "Sampler")
# Drivers give the lowest free names first: past so many free ones in a row there are no more.
GAP = 256


def live_objects(context: Any) -> dict[str, int]:
    """Living objects of each kind in `context` (a glbump Context), asked of the driver name by name."""
    context.check("count GL objects")
    found = {}
    for kind in KINDS:
        address = context.native.load_opengl_function(f"glIs{kind}")
        is_one = ctypes.CFUNCTYPE(ctypes.c_ubyte, ctypes.c_uint)(address)
        name, free, count = 1, 0, 0
        while free < GAP:
            alive = bool(is_one(name))
            count += alive
            free = 0 if alive else free + 1
            name += 1
        found[kind] = count
    return found


def more(before: Mapping[str, int], after: Mapping[str, int], kept: Mapping[str, int]) -> str:
    """Text for what `after` has over `before` beyond `kept`, the growth that is meant to stay; "" for nothing."""
    left = {kind: after[kind] - before[kind] - kept.get(kind, 0) for kind in KINDS}
    return ", ".join(f"{count} {kind}" for kind, count in left.items() if count > 0)
