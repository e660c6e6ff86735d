"""OSMesa contexts: Mesa drawing into plain memory, with neither display nor device. Mesa 25.1 removed it."""

from __future__ import annotations

import ctypes
from ctypes import POINTER, c_int, c_ubyte, c_void_p

from glbump.gl.native import Native, RouteError

LIBRARIES = ("libOSMesa.so.8", "libOSMesa.so.6", "libOSMesa.so")
MEND = "apt-get install -y --no-install-recommends libosmesa6 (until Debian 12; newer Mesa has none)"

_UNSIGNED_BYTE, _FORMAT, _RGBA = 0x1401, 0x22, 0x1908
_PROFILE, _CORE, _MAJOR, _MINOR = 0x33, 0x34, 0x36, 0x37


def _load() -> tuple[str, ctypes.CDLL]:
    for name in LIBRARIES:
        try:
            library = ctypes.CDLL(name)
        except OSError:
            continue
        if hasattr(library, "OSMesaCreateContextAttribs"):
            return name, library
    raise RouteError(f"no OSMesa library: {', '.join(LIBRARIES)}", MEND)


class OsmesaContext(Native):
    """A GL core context in memory; its own 1x1 picture is never drawn to."""

    backend = "osmesa"

    def __init__(self, require: int) -> None:
        self.library, osmesa = _load()
        osmesa.OSMesaCreateContextAttribs.restype = c_void_p
        osmesa.OSMesaCreateContextAttribs.argtypes = (POINTER(c_int), c_void_p)
        osmesa.OSMesaMakeCurrent.argtypes = (c_void_p, c_void_p, c_int, c_int, c_int)
        osmesa.OSMesaGetProcAddress.restype = c_void_p
        osmesa.OSMesaGetCurrentContext.restype = c_void_p
        osmesa.OSMesaDestroyContext.argtypes = (c_void_p,)
        self._osmesa = osmesa
        self._pixel = (c_ubyte * 4)()
        version = (_PROFILE, _CORE, _MAJOR, require // 100, _MINOR, require // 10 % 10) if require else ()
        attributes = (_FORMAT, _RGBA, *version, 0, 0)
        self._context = osmesa.OSMesaCreateContextAttribs((c_int * len(attributes))(*attributes), None)
        if not self._context:
            raise RouteError("OSMesaCreateContextAttribs returned nothing", MEND, refused=bool(require))
        self.make_current()

    def _address(self, name: str) -> int:
        return self._osmesa.OSMesaGetProcAddress(name.encode()) or 0

    def is_current(self) -> bool:
        return bool(self._osmesa.OSMesaGetCurrentContext() == self._context)

    def make_current(self) -> None:
        if not self._osmesa.OSMesaMakeCurrent(self._context, self._pixel, _UNSIGNED_BYTE, 1, 1):
            raise RouteError("OSMesaMakeCurrent failed", MEND)

    def destroy(self) -> None:
        if self.is_current():
            self._osmesa.OSMesaMakeCurrent(None, None, 0, 0, 0)
        self._osmesa.OSMesaDestroyContext(self._context)
