"""What a window system must offer so that moderngl can draw through it."""

from __future__ import annotations

import ctypes
from abc import ABC, abstractmethod
from typing import Any


class RouteError(Exception):
    """One way to a context that failed: what the library said, and what would mend it.

    refused: the driver is there, but refused the version asked for.
    """

    def __init__(self, error: str, mend: str, *, refused: bool = False) -> None:
        super().__init__(error)
        self.mend = mend
        self.refused = refused


# A library's addresses serve all its contexts. moderngl 5.13 never frees the numbers it is given: new ones
# for each context would leak 21 kB.
_addresses: dict[tuple[str, str], int] = {}


class Native(ABC):
    """An OpenGL core context, current when made; `moderngl.create_context(context=native)` takes it as it is.

    backend: "egl", "osmesa" or "window"; library: the file it came from; device: EGL's index of it, or None.
    Constructors raise RouteError, and take `require` (330 is 3.3), where 0 is whatever the driver likes best.
    """

    backend: str
    library: str
    device: int | None = None

    def load_opengl_function(self, name: str) -> int:
        """The address of a GL function, 0 where there is none."""
        key = self.library, name
        if key not in _addresses:
            _addresses[key] = self._address(name)
        return _addresses[key]

    def entry(self, name: str, *argument_types: Any) -> Any:
        """A GL function by its name, to be called for what moderngl does not offer; it returns nothing."""
        return ctypes.CFUNCTYPE(None, *argument_types)(self.load_opengl_function(name))

    @abstractmethod
    def _address(self, name: str) -> int:
        """What the library answers."""

    @abstractmethod
    def is_current(self) -> bool:
        """Whether GL calls of this thread reach this context."""

    @abstractmethod
    def make_current(self) -> None:
        """Let GL calls of this thread reach this context; RouteError where the driver refuses."""

    @abstractmethod
    def destroy(self) -> None:
        """Give the context back to the driver with every GL object in it; it need not be current."""

    def __enter__(self) -> Native:
        self.make_current()
        return self

    def __exit__(self, *_: object) -> None:  # noqa: B027
        """Nothing: whoever draws next makes his own context current."""

    def release(self) -> None:  # noqa: B027
        """Nothing: moderngl calls this from its own release, and ours calls `destroy`, exactly once."""
