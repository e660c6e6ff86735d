"""Unit tests for shaders: GLSL functions called with NumPy arrays, in pytest or without it. See docs/shader-tests.md.

from glbump.glsltest import Glsl
Glsl().load("shaders/lib/reflect.glsl").reflect_dir(directions, (0, 0, 1))
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from glbump.glsltest.glsl import Glsl as Glsl
    from glbump.glsltest.module import Function as Function
    from glbump.glsltest.module import Module as Module
    from glbump.glsltest.samplers import Sampler as Sampler

_PUBLIC = {"Function": "module", "Glsl": "glsl", "Module": "module", "Sampler": "samplers"}
__all__ = ["Function", "Glsl", "Module", "Sampler"]


def __getattr__(name: str) -> Any:
    """Fetched at first use: pytest loads this package in every run, also where no shader is tested."""
    if name not in _PUBLIC:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_PUBLIC[name]}"), name)
