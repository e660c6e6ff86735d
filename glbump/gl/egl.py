"""EGL contexts with no display, through ctypes: every device in turn, and errors by their names.

Sources: EGL 1.5; EXT_platform_device, EXT_device_enumeration, MESA_platform_surfaceless.
"""

from __future__ import annotations

import ctypes
import functools
from ctypes import POINTER, byref, c_char_p, c_int, c_void_p
from typing import Any

from glbump.gl.native import Native, RouteError

LIBRARY = "libEGL.so.1"
APT = "apt-get install -y --no-install-recommends libegl1 libgl1 libgl1-mesa-dri"
NO_LIBRARY = f"install it: {APT}"
NO_DRIVER = f"install a driver: {APT}; NVIDIA in a container: NVIDIA_DRIVER_CAPABILITIES=graphics,utility"
BUSY = "another library's OpenGL context is current on this thread: use another thread, or another process"
NO_RIGHT = "give the container the device (docker run --gpus all, or --device /dev/dri and its group)"

# fmt: off
_NAMES = (  # from 0x3000 on
    "SUCCESS", "NOT_INITIALIZED", "BAD_ACCESS", "BAD_ALLOC", "BAD_ATTRIBUTE", "BAD_CONFIG", "BAD_CONTEXT",
    "BAD_CURRENT_SURFACE", "BAD_DISPLAY", "BAD_MATCH", "BAD_NATIVE_PIXMAP", "BAD_NATIVE_WINDOW",
    "BAD_PARAMETER", "BAD_SURFACE", "CONTEXT_LOST",
)
# fmt: on
_EXTENSIONS, _OPENGL_API = 0x3055, 0x30A2
_PLATFORM_DEVICE, _PLATFORM_SURFACELESS = 0x313F, 0x31DD
# SURFACE_TYPE = PBUFFER_BIT, RENDERABLE_TYPE = OPENGL_BIT, NONE
_CONFIG = (c_int * 5)(0x3033, 0x0001, 0x3040, 0x0008, 0x3038)
_MAJOR, _MINOR, _PROFILE, _CORE, _NONE = 0x3098, 0x30FB, 0x30FD, 0x1, 0x3038
_PBUFFER = (c_int * 5)(0x3057, 1, 0x3056, 1, _NONE)

_SIGNATURES = {
    "eglGetError": (c_int, ()),
    "eglQueryString": (c_char_p, (c_void_p, c_int)),
    "eglGetProcAddress": (c_void_p, (c_char_p,)),
    "eglInitialize": (c_int, (c_void_p, POINTER(c_int), POINTER(c_int))),
    "eglBindAPI": (c_int, (c_int,)),
    "eglChooseConfig": (c_int, (c_void_p, POINTER(c_int), POINTER(c_void_p), c_int, POINTER(c_int))),
    "eglCreateContext": (c_void_p, (c_void_p, c_void_p, c_void_p, POINTER(c_int))),
    "eglCreatePbufferSurface": (c_void_p, (c_void_p, c_void_p, POINTER(c_int))),
    "eglMakeCurrent": (c_int, (c_void_p, c_void_p, c_void_p, c_void_p)),
    "eglGetCurrentContext": (c_void_p, ()),
    "eglDestroyContext": (c_int, (c_void_p, c_void_p)),
    "eglDestroySurface": (c_int, (c_void_p, c_void_p)),
}
_EXTENSION_SIGNATURES = {
    "eglQueryDevicesEXT": (c_int, (c_int, POINTER(c_void_p), POINTER(c_int))),
    "eglQueryDeviceStringEXT": (c_char_p, (c_void_p, c_int)),
    "eglGetPlatformDisplayEXT": (c_void_p, (c_int, c_void_p, POINTER(c_int))),
}


def error_name(code: int) -> str:
    """`EGL_BAD_MATCH (0x3009)` for 0x3009."""
    known = 0 <= code - 0x3000 < len(_NAMES)
    return f"EGL_{_NAMES[code - 0x3000]} ({code:#06x})" if known else f"EGL error {code:#06x}"


class Library:
    """libEGL's entry points as attributes; `call` raises RouteError with EGL's own error name."""

    def __init__(self, name: str) -> None:
        try:
            dll = ctypes.CDLL(name)
        except OSError as error:
            raise RouteError(str(error), NO_LIBRARY) from None
        for function, (result, arguments) in _SIGNATURES.items():
            entry = getattr(dll, function)
            entry.restype, entry.argtypes = result, arguments
            setattr(self, function, entry)
        for function, (result, arguments) in _EXTENSION_SIGNATURES.items():
            address = self.eglGetProcAddress(function.encode())
            setattr(self, function, ctypes.CFUNCTYPE(result, *arguments)(address) if address else None)
        self.name = name
        self.extensions = (self.eglQueryString(None, _EXTENSIONS) or b"").decode().split()

    def __getattr__(self, name: str) -> Any:  # for the type checker: __init__ sets them
        raise AttributeError(name)

    def call(self, function: str, *arguments: object, mend: str = NO_DRIVER) -> int:
        """The result of `function`, never 0: that is a RouteError naming the function and EGL's error."""
        entry = getattr(self, function)
        if entry is None:
            raise RouteError(f"{self.name} is too old: it has no {function}", mend)
        result: int | None = entry(*arguments)
        if not result:
            raise RouteError(f"{function} failed: {error_name(self.eglGetError())}", mend)
        return result


@functools.cache
def library(name: str) -> Library:
    """The loaded library; a failure is not remembered, so that a driver installed meanwhile is found."""
    return Library(name)


class Device:
    """One EGL device: its index in EGL's own order, its handle, and whether it computes on the CPU."""

    def __init__(self, index: int, handle: int, extensions: list[str]) -> None:
        self.index = index
        self.handle = handle
        self.is_software = "EGL_MESA_device_software" in extensions
        self.route = f"egl device {index} ({'software' if self.is_software else 'hardware'})"


def devices(egl: Library) -> list[Device]:
    """Every device EGL lists, hardware first; RouteError where it cannot list them or there is none."""
    count = c_int()
    egl.call("eglQueryDevicesEXT", 0, None, byref(count))
    handles = (c_void_p * max(count.value, 1))()
    egl.call("eglQueryDevicesEXT", count, handles, byref(count))
    found = []
    for index in range(count.value):
        handle = handles[index] or 0
        extensions = (egl.eglQueryDeviceStringEXT(handle, _EXTENSIONS) or b"").decode().split()
        found.append(Device(index, handle, extensions))
    return sorted(found, key=lambda device: device.is_software)


class EglContext(Native):
    """A GL core context on one EGL device, or on none (surfaceless); it has no picture of its own."""

    backend = "egl"

    def __init__(self, egl: Library, device: Device | None, require: int) -> None:
        self._egl, self.library = egl, egl.name
        self.device = device.index if device else None
        platform, handle = (_PLATFORM_DEVICE, device.handle) if device else (_PLATFORM_SURFACELESS, None)
        self._display = egl.call("eglGetPlatformDisplayEXT", platform, handle, None)
        # A display is the process's: initialising it again is free, terminating it ends others' contexts.
        egl.call("eglInitialize", self._display, None, None, mend=NO_RIGHT if device else NO_DRIVER)
        egl.call("eglBindAPI", _OPENGL_API)
        config, count = c_void_p(), c_int()
        egl.call("eglChooseConfig", self._display, _CONFIG, byref(config), 1, byref(count))
        self._config = config if count.value else None
        version = (_MAJOR, require // 100, _MINOR, require // 10 % 10, _PROFILE, _CORE) if require else ()
        attributes = (c_int * (len(version) + 1))(*version, _NONE)
        self._surface: int | None = None
        self._context: int | None = egl.eglCreateContext(self._display, self._config, None, attributes)
        if not self._context:
            error = f"eglCreateContext failed: {error_name(egl.eglGetError())}"
            raise RouteError(error, NO_DRIVER, refused=bool(require))
        try:
            self._bind_surface()
        except RouteError:
            self.destroy()
            raise

    def _bind_surface(self) -> None:
        if not self._egl.eglMakeCurrent(self._display, None, None, self._context):
            # No EGL_KHR_surfaceless_context: a 1x1 surface, never drawn to.
            self._surface = self._egl.call("eglCreatePbufferSurface", self._display, self._config, _PBUFFER)
            self.make_current()

    def _address(self, name: str) -> int:
        return self._egl.eglGetProcAddress(name.encode()) or 0

    def is_current(self) -> bool:
        return bool(self._egl.eglGetCurrentContext() == self._context)

    def make_current(self) -> None:
        surface = self._surface
        self._egl.call("eglMakeCurrent", self._display, surface, surface, self._context, mend=BUSY)

    def destroy(self) -> None:
        if self.is_current():
            self._egl.eglMakeCurrent(self._display, None, None, None)
        if self._surface:
            self._egl.eglDestroySurface(self._display, self._surface)
        self._egl.eglDestroyContext(self._display, self._context)
