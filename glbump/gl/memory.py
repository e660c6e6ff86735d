"""How much memory there is for pictures: the machine's, and the graphics card's where its driver tells."""

from __future__ import annotations

import ctypes
from pathlib import Path

from glbump.gl.context import Context

# GL_NVX_gpu_memory_info and GL_ATI_meminfo, in KiB; the latter fills four integers.
_QUERIES = {"GL_NVX_gpu_memory_info": 0x9049, "GL_ATI_meminfo": 0x87FC}


def host_bytes() -> int | None:
    """Free main memory: what the kernel says, and what a container's limit leaves; None where neither is told."""
    known = [free for free in (_kernel(), _container()) if free is not None]
    return min(known, default=None)


def texture_bytes(context: Context) -> int | None:
    """Free memory of the graphics card; None where the driver does not tell, or has none of its own."""
    for name, query in _QUERIES.items():
        if not context.is_software and name in context.gl.extensions:
            free = (ctypes.c_int * 4)()
            context.native.entry("glGetIntegerv", ctypes.c_uint, ctypes.c_void_p)(query, ctypes.addressof(free))
            return 1024 * int(free[0])
    return None


def _kernel() -> int | None:
    for line in _text("/proc/meminfo").splitlines():
        if line.startswith("MemAvailable:"):
            return 1024 * int(line.split()[1])
    return None


def _container() -> int | None:
    limit, used = (_text(f"/sys/fs/cgroup/memory.{name}").strip() for name in ("max", "current"))
    return int(limit) - int(used) if limit.isdecimal() and used.isdecimal() else None


def _text(path: str) -> str:
    try:
        return Path(path).read_text(encoding="ascii")
    except OSError:
        return ""
