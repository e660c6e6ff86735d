"""What a window system must offer so that moderngl can draw through it."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any


class RouteError(Exception):
    """One way to a context that failed: what the library said, and what would mend it."""

    def __init__(self, error: str, mend: str) -> None:
        super().__init__(error)
        self.mend = mend


class Native(ABC):
    """A current OpenGL context; `moderngl.create_context(context=native)` takes it as it is.

    route: which of the ways was taken, in words; library: the file it came from; device: EGL's index, or None.
    """

    backend: str

    def __init__(self, route: str, library: str, device: int | None = None) -> None:
        self.route = route
        self.library = library
        self.device = device
        self._outer: list[Any] = []

    @abstractmethod
    def load_opengl_function(self, name: str) -> int:
        """The address of a GL function, 0 where there is none."""

    @abstractmethod
    def is_current(self) -> bool:
        """Whether GL calls of this thread reach this context."""

    @abstractmethod
    def make_current(self) -> None:
        """Let GL calls of this thread reach this context; RouteError where the driver refuses."""

    @abstractmethod
    def current(self) -> Any:
        """What is current on this thread, for `restore`."""

    @abstractmethod
    def restore(self, current: Any) -> None:
        """Make current again what `current` returned."""

    @abstractmethod
    def destroy(self) -> None:
        """Give the context back to the driver, with every GL object in it."""

    def __enter__(self) -> Native:
        self._outer.append(self.current())
        self.make_current()
        return self

    def __exit__(self, *_: object) -> None:
        self.restore(self._outer.pop())

    def release(self) -> None:
        """moderngl calls this from `Context.release`; ours calls `destroy` itself, exactly once."""
