"""What tuning found on this machine before: a file for each scene, size, metric and driver, in the user's cache."""

from __future__ import annotations

import json
import os
from dataclasses import asdict
from pathlib import Path
from typing import Any

from glbump.errors import GlbumpError
from glbump.maps.files import cache_folder, write_atomically
from glbump.quality import KNOBS, Quality
from glbump.scene import Scene
from glbump.trade.results import digest, scene_key


class Remembered:
    """Settings measured before. What cannot be read or written is measured anew, and not remembered.

    directory: the user's own unless given.
    """

    def __init__(self, directory: str | os.PathLike[str] | None = None) -> None:
        self._directory = Path(directory) if directory is not None else cache_folder() / "tune"

    def key(self, scene: Scene, size: tuple[int, int], metric: str, driver: str) -> str:
        """What results hold for: the scene with all that its files hold, and who draws. Another version of glbump, or
        of the driver, finds nothing."""
        from importlib.metadata import version

        knobs = {name: list(knob.values) for name, knob in KNOBS.items()}
        return digest([scene_key(scene), list(size), metric, driver, version("glbump"), knobs])

    def read(self, key: str) -> dict[str, Any]:
        """{"rows": [{"quality", "error", "ms"}], "noise": of the truth, "chosen": by promise}; empty for none."""
        try:
            found = json.loads((self._directory / f"{key}.json").read_text())
            rows = [{**row, "quality": Quality(**row["quality"])} for row in found["rows"]]
            return {"rows": rows, "noise": float(found["noise"]), "chosen": dict(found["chosen"])}
        except (OSError, ValueError, TypeError, KeyError, GlbumpError):
            return {}

    def write(self, key: str, rows: list[dict[str, Any]], noise: float, chosen: dict[str, Any]) -> None:
        """As `read` gives it back."""
        plain = [{**row, "quality": asdict(row["quality"])} for row in rows]
        content = json.dumps({"rows": plain, "noise": noise, "chosen": chosen}, indent=1)
        try:
            self._directory.mkdir(parents=True, exist_ok=True)
            write_atomically(self._directory / f"{key}.json", content.encode())
        except (OSError, GlbumpError):
            return
