"""The OpenGL calls of one frame, to be made again with nothing round them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import moderngl
import numpy as np

from glbump.gl.native import Native

_METHODS: dict[type[Any], tuple[str, ...]] = {
    moderngl.VertexArray: ("render",),
    moderngl.Framebuffer: ("use", "clear", "read_into"),
    moderngl.Texture: ("use",),
    moderngl.TextureCube: ("use",),
    moderngl.Context: ("enable", "disable", "enable_only", "enable_direct", "disable_direct", "copy_framebuffer"),
    moderngl.Uniform: ("write",),
}
_SETTERS: dict[type[Any], tuple[str, ...]] = {
    moderngl.Context: ("depth_func", "front_face", "blend_func"),
    moderngl.Uniform: ("value",),
}


class Recording:
    """What `listening` heard, in order: each call with the object it was made on and what it was given."""

    def __init__(self) -> None:
        self.calls: list[tuple[Callable[..., Any], tuple[Any, ...], dict[str, Any]]] = []
        self.is_on = False

    def replay(self) -> Callable[[], object]:
        """A function that makes the calls again, and returns the array that it read back into, a new one each time.

        Uniforms that had one value throughout are not set again: a script would have set them beforehand.
        """
        steps = [_reading(f, a, k) if _reads(a) else (f, a, k) for f, a, k in self.calls if not self._is_settled(f, a)]

        def run() -> object:
            result = None
            for function, arguments, options in steps:
                result = function(*arguments, **options)
            return result

        return run

    def _is_settled(self, function: Callable[..., Any], arguments: tuple[Any, ...]) -> bool:
        mine = arguments[0] if arguments else None
        if not isinstance(mine, moderngl.Uniform):
            return False
        given = [repr(a[1:]) for _, a, _ in self.calls if a and a[0] is mine]
        return len(set(given)) == 1


def _reads(arguments: tuple[Any, ...]) -> bool:
    return (
        len(arguments) > 1 and isinstance(arguments[0], moderngl.Framebuffer) and isinstance(arguments[1], np.ndarray)
    )


def _reading(function: Callable[..., Any], arguments: tuple[Any, ...], options: dict[str, Any]) -> Any:
    """The same read-back, into a new array each time."""
    frame, old, *rest = arguments
    shape, kind = old.shape, old.dtype

    def read() -> object:
        pixels = np.empty(shape, kind)
        function(frame, pixels, *rest, **options)
        return pixels

    return read, (), {}


@contextmanager
def listening() -> Iterator[Recording]:
    """Records into what it yields while that `is_on`; renderers must be opened within, to be heard."""
    recording = Recording()
    depth = 0

    def heard(function: Callable[..., Any]) -> Callable[..., Any]:
        def call(*arguments: Any, **options: Any) -> Any:
            nonlocal depth
            if recording.is_on and depth == 0:
                recording.calls.append((function, arguments, options))
            depth += 1
            try:
                return function(*arguments, **options)
            finally:
                depth -= 1

        return call

    before: list[tuple[type[Any], str, Any]] = [(Native, "entry", Native.entry)]
    for owner, names in (*_METHODS.items(), *_SETTERS.items()):
        before.extend((owner, name, owner.__dict__[name]) for name in names)
    entry = Native.entry
    try:
        for owner, name, old in before[1:]:
            if isinstance(old, property) and old.fset is not None:
                setattr(owner, name, property(old.fget, heard(old.fset)))
            else:
                setattr(owner, name, heard(old))
        Native.entry = lambda self, name, *types: heard(entry(self, name, *types))  # type: ignore[method-assign]
        yield recording
    finally:
        for owner, name, old in before:
            setattr(owner, name, old)
