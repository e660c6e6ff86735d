"""What is right: float64 twins of every function of shaders/lib, and `render`, whole pictures by ray casting."""

from glbump.reference.shade import render

__all__ = ["render"]
