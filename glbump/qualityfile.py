"""TOML <-> Quality, strict: the preset, and the knobs that differ from it."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import asdict

from glbump import validate as check
from glbump.errors import SceneError, unknown
from glbump.maps.files import write_atomically
from glbump.quality import KNOBS, PRESETS, Quality
from glbump.scenefile import toml_tables, toml_value


def load_quality(path: str | os.PathLike[str]) -> Quality:
    """The Quality in a TOML file: `preset` and any of KNOBS by their names.

    Raises SceneError, naming the file and the knob, for anything that is not a quality.
    """
    file = check.path("the quality file", path)
    try:
        values = toml_tables(file, "quality")
        for name in values:
            if name not in KNOBS and name != "preset":
                raise SceneError(unknown("knob", name, ("preset", *KNOBS)))
        return Quality(**values)
    except SceneError as why:
        raise SceneError(f"{file}: {' '.join(str(why).split())}") from None


def save_quality(quality: Quality, path: str | os.PathLike[str], notes: Sequence[str] = ()) -> None:
    """Write a Quality as a TOML file, whole or not at all: its preset, and what differs from that.

    notes: lines of comment above it. Raises SceneError for an unwritable target.
    """
    own = {name: value for name, value in asdict(quality).items() if value != PRESETS[quality.preset].get(name)}
    lines = [*(f"# {' '.join(note.split())}" for note in notes), *(f"{k} = {toml_value(v)}" for k, v in own.items())]
    write_atomically(path, ("\n".join(lines) + "\n").encode(), error=SceneError)
