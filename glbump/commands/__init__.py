"""The commands of `glbump`, each in a module that is imported when the command is called."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import click

# The module here that holds each command, as a function of the command's name.
MODULES = {
    "compare-bump": "compare_bump",
    "convert": "convert",
    "demo": "demo",
    "diff": "diff",
    "doctor": "doctor",
    "lint": "lint",
    "normals": "normals",
    "prefilter": "prefilter",
    "render": "render",
    "tune": "tune",
    "trade": "trade",
    "view": "view",
}


class Commands(Mapping[str, "click.Command"]):
    """Name -> command; a command's module is imported when the command is looked up."""

    def __getitem__(self, name: str) -> click.Command:
        return getattr(import_module(f"{__name__}.{MODULES[name]}"), name.replace("-", "_"))

    def __iter__(self) -> Iterator[str]:
        return iter(MODULES)

    def __len__(self) -> int:
        return len(MODULES)
