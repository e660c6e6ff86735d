"""Opening an OpenGL context, and keeping it from misuse. The one place that opens them."""

from __future__ import annotations

import ctypes
import os
import sys
import threading
import weakref
from functools import cached_property, partial
from typing import Any

import moderngl

from glbump.errors import ContextError, unknown
from glbump.gl.native import Native, RouteError
from glbump.gl.ways import Attempt, Way, table, ways, window

BACKENDS = ("auto", "egl", "osmesa", "window")
SOFTWARE = ("llvmpipe", "softpipe", "swrast", "software rasterizer")
SPAWN = 'start processes with multiprocessing.get_context("spawn") and open a context in each'

_FEW = 2048
"""Objects that are asked for one by one, whatever names the driver gives."""


class Context:
    """One open OpenGL core context, usable on the thread that opened it until `release`.

    gl: the moderngl.Context; native: the window system's side of it; route: the way taken, in words; backend:
    "egl", "osmesa" or "window"; library: the file it came from; device: EGL's index, or None.
    """

    def __init__(self, native: Native, route: str, require: int = 330) -> None:
        self._thread = threading.current_thread()
        self._process = os.getpid()
        self._released = False
        self.native = native
        self.route, self.backend, self.library, self.device = (
            route,
            native.backend,
            native.library,
            native.device,
        )
        try:
            self.gl = moderngl.create_context(require=require, standalone=True, context=native)  # type: ignore[arg-type]
        except Exception as error:  # moderngl raises ValueError, its own Error, and bare Exception
            self._released = True
            native.destroy()
            raise RouteError(f"moderngl: {error}", "update the graphics driver, or try another backend") from None

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
            "max_texture_units": limits["GL_MAX_TEXTURE_IMAGE_UNITS"],
            "max_samples": self.gl.max_samples,
            "max_anisotropy": self.gl.max_anisotropy,
        }

    @property
    def driver(self) -> str:
        """Who draws: the renderer's and the version's string."""
        return f"{self.info['renderer']}, {self.info['version']}"

    @cached_property
    def multisamples(self) -> int:
        """Most samples a pixel that one pass draws and shades one by one; 0 where the driver cannot shade so."""
        can = self.gl.version_code >= 400 or "GL_ARB_sample_shading" in self.gl.extensions
        return int(self.gl.max_samples) if can else 0

    @cached_property
    def honours_anisotropy(self) -> bool:
        """Whether look-ups along footprints are as many as they are told to be; by drawing some."""
        from glbump.gl.probe import anisotropy  # next to no picture needs it

        return bool(anisotropy(self)["honoured"])

    @cached_property
    def is_software(self) -> bool:
        """Whether the CPU does the drawing (llvmpipe and its kin)."""
        return any(name in str(self.info["renderer"]).lower() for name in SOFTWARE)

    @property
    def is_open(self) -> bool:
        """Whether it is not released yet."""
        return not self._released

    def make_current(self) -> None:
        """Let this thread's GL calls reach this context; ContextError where the driver refuses."""
        if not self.native.is_current():
            try:
                self.native.make_current()
            except RouteError as error:
                raise ContextError(f"the OpenGL context is lost: {error}; open a new one") from None

    def check(self, what: str = "draw") -> None:
        """Make current, or ContextError: released, not on the opener's thread, or in a forked process."""
        if self._released:
            raise ContextError(f"cannot {what}: this OpenGL context is released; open a new one")
        if os.getpid() != self._process:
            raise ContextError(f"cannot {what}: this OpenGL context stayed behind in the process forked from; {SPAWN}")
        if threading.current_thread() is not self._thread:
            raise ContextError(
                f"cannot {what}: this OpenGL context belongs to the thread that opened it; "
                "draw on that thread, or open one for this"
            )
        self.make_current()

    @property
    def is_lost(self) -> bool:
        """Whether the driver has reset the GPU, and all that was on it is gone."""
        name = "glGetGraphicsResetStatus"
        if self.gl.version_code < 450:
            if "GL_ARB_robustness" not in self.gl.extensions:
                return False
            name += "ARB"
        return bool(ctypes.CFUNCTYPE(ctypes.c_uint)(self.native.load_opengl_function(name))())

    def unbind(self) -> None:
        """Leave the framebuffer in use. Due before that one is released: moderngl 5.13 goes on to bind its name,
        which is an OpenGL error when the next framebuffer is made."""
        self.gl.detect_framebuffer(0).use()

    def live_objects(self) -> dict[str, int]:
        """How many objects of each kind live in this context, by asking OpenGL for every name up to a new one."""
        self.check("count objects")
        count = {}
        for kind in ("Texture", "Buffer", "Framebuffer", "Renderbuffer", "VertexArray", "Program"):
            address = self.native.load_opengl_function(f"glIs{kind}")
            is_one = ctypes.CFUNCTYPE(ctypes.c_ubyte, ctypes.c_uint)(address)
            count[kind.lower()] = sum(is_one(name) for name in range(1, max(self._new_name(kind), _FEW)))
        return count

    def _new_name(self, kind: str) -> int:
        """A name of no object. Mesa counts on and gives none twice; drivers that fill gaps stay among the first."""
        name = ctypes.c_uint()
        if kind == "Program":
            name.value = ctypes.CFUNCTYPE(ctypes.c_uint)(self.native.load_opengl_function("glCreateProgram"))()
            self.native.entry("glDeleteProgram", ctypes.c_uint)(name)
        else:
            for call in (f"glGen{kind}s", f"glDelete{kind}s"):
                self.native.entry(call, ctypes.c_int, ctypes.c_void_p)(1, ctypes.addressof(name))
        return name.value

    def release(self) -> None:
        """Give the context back with every GL object in it; a second call does nothing."""
        if self._released:
            return
        self.check("release")
        self._destroy()

    def _destroy(self) -> None:
        self._released = True
        self.gl.release()
        self.native.destroy()

    def __del__(self) -> None:
        # Forgotten, not released: its megabytes go all the same, without touching what is current.
        mine = os.getpid() == self._process and threading.current_thread() is self._thread
        if not self._released and mine and not sys.is_finalizing():
            self._destroy()

    def __enter__(self) -> Context:
        self.check("enter")
        return self

    def __exit__(self, *_: object) -> None:
        self.release()


# What is open now, and the process that first opened something: both bar the way to silently wrong pictures.
_open: weakref.WeakSet[Context] = weakref.WeakSet()
_first_process: int | None = None


def open_context(backend: str = "auto", device: int | None = None, require: int = 330) -> Context:
    """An OpenGL core context of version `require` (330 is 3.3) or newer, current on this thread.

    "auto" tries EGL's hardware devices, its software device, EGL on no device, then OSMesa; "window" is a
    hidden window and needs a display. `device` is an index in EGL's own order. GLBUMP_BACKEND and
    GLBUMP_DEVICE in the environment stand for arguments left at "auto" and None. A process has one backend
    open at a time, and "auto" keeps to it.

    ContextError: a wrong argument (one line), or no way led to a context (a table of what was tried, what
    each library said, and what mends it).
    """
    backend, device = _chosen(backend, device)
    opened = _require_one_backend(backend)
    failed: list[Attempt] = []
    for way in ways(opened if backend == "auto" else backend, device):
        if isinstance(way, Attempt):
            failed.append(way)
            continue
        try:
            context = Context(way.open(require), way.route, require)
        except RouteError as error:
            failed.append(Attempt(way.route, way.library, str(error), error.mend))
        else:
            _open.add(context)
            return context
    wanted = f"OpenGL {require // 100}.{require // 10 % 10} core, backend {backend}"
    raise ContextError(f"no OpenGL context ({wanted}); tried:\n{table(failed)}")


def open_window(size: tuple[int, int], title: str) -> Context:
    """The context of a window that is seen, with OpenGL 3.3 or newer. size: wanted, in the window system's units.

    ContextError, one line: there is no display, or no such OpenGL in its windows.
    """
    _require_one_backend("window")
    way = Way("window", "glfw", partial(window, size=size, title=title, visible=True))
    try:
        context = Context(way.open(330), way.route)
    except RouteError as error:
        raise ContextError(f"no window can be opened: {error}; glbump render draws without one") from None
    _open.add(context)
    return context


def _require_one_backend(wanted: str) -> str:
    """The backend that is open in this process, "auto" for none; ContextError where `wanted` is another, or where the
    process was forked from one that had opened any."""
    global _first_process
    if _first_process not in (None, os.getpid()):
        raise ContextError(f"cannot open OpenGL in a process forked from one that had opened it; {SPAWN}")
    opened = next((context.backend for context in _open), "auto")
    if opened != "auto" and wanted not in ("auto", opened):
        # Mesa's libraries share one dispatch table: the one's calls would draw into the other's textures.
        raise ContextError(f"cannot open {wanted} while {opened} is open: use it, or release it, or another process")
    _first_process = os.getpid()
    return opened


def _chosen(backend: str, device: int | None) -> tuple[str, int | None]:
    """The arguments, checked, with the environment's word where they leave the choice open."""
    if backend not in BACKENDS:
        raise ContextError(unknown("backend", backend, BACKENDS))
    named = os.environ.get("GLBUMP_BACKEND")
    if backend == "auto" and named:
        if named not in BACKENDS:
            raise ContextError(unknown("backend in GLBUMP_BACKEND,", named, BACKENDS))
        backend = named
    if backend in ("osmesa", "window"):
        if device is not None:
            raise ContextError(f"device={device!r} goes with backend egl; {backend} has no devices, leave it out")
        return backend, None
    indexed = os.environ.get("GLBUMP_DEVICE")
    if device is None and indexed:
        if not indexed.isdecimal():
            raise ContextError(f"GLBUMP_DEVICE must be a device index, 0 or more; got {indexed!r}")
        return backend, int(indexed)
    if device is not None and (isinstance(device, bool) or not isinstance(device, int) or device < 0):
        raise ContextError(f"device must be an index, 0 or more; got {device!r}")
    return backend, device
