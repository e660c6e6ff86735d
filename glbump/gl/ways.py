"""The ways to an OpenGL context on this machine, in the order they are tried, and why each failed."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import Any

from glbump.frozen import Frozen
from glbump.gl import egl
from glbump.gl.native import Native, RouteError

_GL_VERSION = 0x1F02


class Way(Frozen):
    """One way to a context: its name in words, the library it needs, and how to go it."""

    route: str
    library: str
    start: Callable[[int], Native]

    def open(self, require: int) -> Native:
        """A context of version `require` or newer; RouteError, naming both versions where it is too old."""
        try:
            return self.start(require)
        except RouteError as error:
            offered = self._offered() if error.refused else None
            if offered is None:
                raise
        raise RouteError(
            f"OpenGL is too old: got {offered}, needed {require // 100}.{require // 10 % 10} core",
            "update the graphics driver, or try another device or backend",
        )

    def _offered(self) -> str | None:
        """The version a driver offers that refused the one asked for; None where it offers none."""
        try:
            native = self.start(0)
        except RouteError:
            return None
        address = native.load_opengl_function("glGetString")
        text = ctypes.CFUNCTYPE(ctypes.c_char_p, ctypes.c_uint)(address)(_GL_VERSION) if address else None
        native.destroy()
        return text.decode().replace("(Compatibility Profile) ", "") if text else None


class Attempt(Frozen):
    """One way that failed: what was said, and what would mend it."""

    route: str
    library: str
    error: str
    mend: str


def ways(backend: str = "auto", device: int | None = None) -> Iterator[Way | Attempt]:
    """Every way of `backend` ("auto": EGL, then OSMesa); an Attempt where one ends before it begins."""
    if backend in ("auto", "egl"):
        yield from _egl_ways(device)
    if backend == "osmesa" or (backend == "auto" and device is None):
        from glbump.gl import osmesa

        yield Way("osmesa", osmesa.LIBRARIES[0], osmesa.OsmesaContext)
    if backend == "window":
        yield Way("window", "glfw", window)


def _egl_ways(device: int | None) -> Iterator[Way | Attempt]:
    try:
        library = egl.library(egl.LIBRARY)
    except RouteError as error:
        yield Attempt("egl", egl.LIBRARY, str(error), error.mend)
        return
    try:
        found = egl.devices(library)
    except RouteError as error:
        yield Attempt("egl devices", library.name, str(error), error.mend)
        found = []
    for one in found:
        if device in (None, one.index):
            yield Way(one.route, library.name, partial(egl.EglContext, library, one))
    if device is None:
        yield Way("egl surfaceless", library.name, partial(egl.EglContext, library, None))
    elif found and device >= len(found):
        missing = f"no such device; there are {len(found)}, counted from 0"
        yield Attempt(f"egl device {device}", library.name, missing, "leave the device out, or name one of those")


def window(require: int, **options: Any) -> Native:
    """The context of a window; options: of WindowContext."""
    try:
        from glbump.gl.window import WindowContext
    except ImportError as error:
        raise RouteError(str(error), "install it: pip install glfw") from None
    return WindowContext(require, **options)


def table(attempts: Sequence[Attempt]) -> str:
    """One line per attempt in aligned columns, then each mend once."""
    rows = [("route", "library", "error"), *((a.route, a.library, a.error) for a in attempts)]
    wide = [max(len(row[column]) for row in rows) for column in (0, 1)]
    lines = [f"  {route:<{wide[0]}}  {library:<{wide[1]}}  {error}" for route, library, error in rows]
    return "\n".join(lines + [f"  -> {mend}" for mend in dict.fromkeys(a.mend for a in attempts)])
