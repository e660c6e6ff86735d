"""What is right: float64 twins of every function of shaders/lib, and `render`, whole pictures by ray casting."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from glbump.reference.shade import render

__all__ = ["render"]


def __getattr__(name: str) -> Any:
    # The ray caster is imported when it is asked for: drawing with OpenGL needs a few of the twins alone.
    if name == "render":
        from glbump.reference.shade import render

        return render
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
