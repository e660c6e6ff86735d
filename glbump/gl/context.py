"""Opening an OpenGL context: which way, on which device, and if none, why not. The one place that opens them."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import moderngl

from glbump.errors import ContextError, unknown
from glbump.gl import egl
from glbump.gl.native import Native, RouteError

BACKENDS = ("auto", "egl", "osmesa", "window")
SOFTWARE = ("llvmpipe", "softpipe", "swrast", "software rasterizer")


class Context:
    """One open OpenGL core context, usable on the thread that opened it until `release`.

    gl: the moderngl.Context; backend: "egl", "osmesa" or "window"; route: the way taken, in words; library: the
    file it came from; device: EGL's device index, or None.
    """

    def __init__(self, native: Native, require: int) -> None:
        self._native = native
        self._thread = threading.get_ident()
        self._process = os.getpid()
        self._released = False
        self.backend, self.route, self.library = native.backend, native.route, native.library
        self.device = native.device
        self.gl = moderngl.create_context(require=require, standalone=True, context=native)

    @cached_property
    def info(self) -> dict[str, Any]:
        """Renderer, vendor, version and limits, as plain values."""
        limits = self.gl.info
        return {
            "renderer": limits["GL_RENDERER"],
            "vendor": limits["GL_VENDOR"],
            "version": limits["GL_VERSION"],
            "version_code": self.gl.version_code,
            "max_texture_size": limits["GL_MAX_TEXTURE_SIZE"],
            "max_cube_size": limits["GL_MAX_CUBE_MAP_TEXTURE_SIZE"],
            "max_renderbuffer_size": limits["GL_MAX_RENDERBUFFER_SIZE"],
            "max_samples": self.gl.max_samples,
            "max_anisotropy": self.gl.max_anisotropy,
            "max_texture_units": limits["GL_MAX_TEXTURE_IMAGE_UNITS"],
        }

    @property
    def is_software(self) -> bool:
        """Whether the CPU does the drawing (llvmpipe and its kin)."""
        return any(name in str(self.info["renderer"]).lower() for name in SOFTWARE)

    def make_current(self) -> None:
        """Let this thread's GL calls reach this context."""
        if not self._native.is_current():
            self._native.make_current()

    def check(self, what: str = "draw") -> None:
        """Make current, or ContextError: released, on a thread other than the opener's, or in a forked process."""
        if self._released:
            raise ContextError(f"cannot {what}: this OpenGL context is released; open a new one")
        if os.getpid() != self._process:
            raise ContextError(
                f"cannot {what}: this OpenGL context belongs to the process this one was forked from; "
                'start processes with multiprocessing.get_context("spawn") and open one in each'
            )
        if threading.get_ident() != self._thread:
            raise ContextError(
                f"cannot {what}: this OpenGL context belongs to the thread that opened it; "
                "open one per thread, or draw on that thread"
            )
        self.make_current()

    def release(self) -> None:
        """Give the context back, with every GL object in it. A second call does nothing."""
        if self._released:
            return
        self.check("release")
        self._released = True
        self.gl.release()
        self._native.destroy()

    def __enter__(self) -> Context:
        self.check("enter")
        return self

    def __exit__(self, *_: object) -> None:
        self.release()


@dataclass(frozen=True)
class Attempt:
    """One way that was tried and failed."""

    route: str
    library: str
    error: str
    mend: str


Opener = Callable[[], Native]


def _egl_ways(device: int | None, require: int) -> Iterator[tuple[str, str, Opener]]:
    library = egl.library(egl.LIBRARY)
    found = egl.devices(library)
    for one in found:
        if device is None or one.index == device:
            yield one.route, library.name, lambda one=one: egl.EglContext(library, one.route, one, require)
    if device is None:
        yield "egl surfaceless", library.name, lambda: egl.EglContext(library, "egl surfaceless", None, require)


def open_context(backend: str = "auto", device: int | None = None, require: int = 330) -> Context:
    """An OpenGL core context of version `require` (330 is 3.3) or newer, with no display unless backend = "window".

    "auto" tries EGL's hardware devices, its software device, EGL without a surface, then OSMesa; GLBUMP_BACKEND and
    GLBUMP_DEVICE stand in for arguments not given. ContextError says what was tried, what failed and what mends it.
    """
    if backend not in BACKENDS:
        raise ContextError(unknown("backend", backend, BACKENDS))
    failed = []
    for route, library, opener in _egl_ways(device, require):
        try:
            return Context(opener(), require)
        except RouteError as error:
            failed.append(Attempt(route, library, str(error), error.mend))
    raise ContextError(f"no OpenGL: {failed}")
