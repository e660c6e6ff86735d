"""Errors of glbump: one line that names the thing, what it got, what is allowed, and what to do."""

from __future__ import annotations

from collections.abc import Iterable


class GlbumpError(Exception):
    """Base of every error that glbump raises for bad input; its text is one line."""


class SceneError(GlbumpError):
    """A scene, or a scene file, that says something glbump cannot draw."""


class ImageError(GlbumpError):
    """A picture that cannot be read, written or used for its purpose."""


class MeshError(GlbumpError):
    """A mesh that cannot be read or used."""


class ContextError(GlbumpError):
    """No OpenGL context here, or one used after release or from another thread."""


class ShaderError(GlbumpError):
    """GLSL that does not resolve, compile or link; names the real file and line."""


class LimitError(GlbumpError):
    """A request past what this driver, this machine or glbump allows."""


def nearest(word: str, allowed: Iterable[str]) -> str | None:
    """The word of `allowed` closest to `word`, or None when nothing is close."""
    import difflib

    close = difflib.get_close_matches(word, list(allowed), n=1, cutoff=0.5)
    return close[0] if close else None


def shown(value: object) -> str:
    """What was got, in one line of at most 60 characters."""
    text = " ".join(repr(value).split())
    return text if len(text) <= 60 else text[:57] + "..."


def unknown(what: str, got: object, allowed: Iterable[str]) -> str:
    """Text for an unknown name: what, what it got, the nearest right word, and what is allowed."""
    names = list(allowed)
    hint = nearest(str(got), names)
    guess = f"did you mean {hint!r}? " if hint else ""
    return f"unknown {what} {shown(got)}; {guess}choose one of: {', '.join(names)}"
