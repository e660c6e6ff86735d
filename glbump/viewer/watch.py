"""Which files have changed since one last asked."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

Stamp = tuple[int, int] | None


def _stamp(path: Path) -> Stamp:
    """Date and size; None for a file that is not there, or cannot be asked about."""
    try:
        stat = path.stat()
    except OSError:
        return None
    return stat.st_mtime_ns, stat.st_size


class Watch:
    """The files that a picture is made of."""

    def __init__(self) -> None:
        self._stamps: dict[Path, Stamp] = {}

    def follow(self, files: Iterable[Path]) -> None:
        """These, and no others. What is followed already keeps the date it was known by."""
        self._stamps = {path: self._stamps[path] if path in self._stamps else _stamp(path) for path in files}

    def changed(self) -> set[Path]:
        """Those that have changed, come or gone since the last call."""
        now = {path: _stamp(path) for path in self._stamps}
        different = {path for path, stamp in now.items() if stamp != self._stamps[path]}
        self._stamps = now
        return different
