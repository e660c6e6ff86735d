"""What the figures were measured on, by its kind."""

from __future__ import annotations

import os
import platform
from importlib.metadata import version
from pathlib import Path
from typing import Any


def machine(renderer: dict[str, Any]) -> dict[str, str | int | float]:
    """Kind of machine and driver. renderer: the `info` of an open context."""
    return {
        "kind": f"{processor()}, {platform.machine()}, {'no GPU used' if renderer['software'] else 'GPU'}",
        "CPUs": len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1,
        "renderer": renderer["renderer"],
        "OpenGL": renderer["version"],
        "system": f"{platform.system()} {platform.release().split('-')[0]}",
        "software": ", ".join(
            [f"Python {platform.python_version()}", *(f"{name} {version(name)}" for name in ("numpy", "moderngl"))]
        ),
        "load before": round(os.getloadavg()[0], 2),
    }


def processor() -> str:
    """The processor's model, as it names itself."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor() or "unknown processor"
    return next((line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")), "unknown processor")
