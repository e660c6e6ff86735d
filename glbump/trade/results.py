"""The folder that a trade is kept in: a line a setting, appended whole, so that a run that was cut off goes on."""

from __future__ import annotations

import hashlib
import json
import math
import os
from collections.abc import Callable
from dataclasses import fields
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np
import numpy.typing as npt

from glbump import validate as check
from glbump.errors import GlbumpError, ImageError
from glbump.image import ArrayImage
from glbump.maps.files import check_writable, write_atomically
from glbump.scene import Scene
from glbump.scenefile import scene_to_dict
from glbump.shapes import MeshData
from glbump.trade.errors import Bounds
from glbump.trade.truth import Truth

Row = dict[str, Any]

ROWS = "rows.jsonl"


def plain(value: Any) -> Any:
    """`value` as JSON has it: NumPy's numbers as Python's, and null for what is not finite."""
    if isinstance(value, np.generic | np.ndarray):
        value = value.tolist()
    if isinstance(value, dict):
        return {str(k): plain(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [plain(v) for v in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def digest(value: Any) -> str:
    """Sixteen letters that stand for a value of JSON."""
    text = json.dumps(plain(value), sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def scene_key(scene: Scene) -> str:
    """What a scene is known by, wherever its files lie: all that it says, and what its pictures and meshes hold."""

    def write(_where: str, value: Path | ArrayImage | MeshData) -> str:
        return _content_key(value)

    return digest(scene_to_dict(scene, write, defaults=True))


def _content_key(value: Path | ArrayImage | MeshData) -> str:
    found = hashlib.sha256()
    if isinstance(value, Path):
        # Six faces may be a folder, or a pattern of names.
        files = sorted(value.iterdir()) if value.is_dir() else [value] if value.is_file() else []
        found.update(b"" if files else str(value).encode())
        for file in files:
            if file.is_file():
                with file.open("rb") as opened:
                    found.update(hashlib.file_digest(opened, "sha256").digest())
    elif isinstance(value, ArrayImage):
        found.update(_bytes_of(value.pixels))
    else:
        for field in fields(value):
            array = getattr(value, field.name)
            found.update(b"" if array is None else _bytes_of(np.asarray(array)))
    return found.hexdigest()[:16]


def _bytes_of(array: npt.NDArray[Any]) -> bytes:
    return f"{array.shape} {array.dtype}".encode() + np.ascontiguousarray(array).tobytes()


class Results:
    """A trade's folder. Rows are looked up by their key; those of other sizes and drivers stay beside one another.

    GlbumpError where the folder cannot be written, or holds another scene's results.
    """

    def __init__(self, directory: str | os.PathLike[str], scene: str) -> None:
        """scene: the scene's key."""
        self.directory = check.path("the folder", directory)
        self.scene = scene
        try:
            (self.directory / "pictures").mkdir(parents=True, exist_ok=True)
        except OSError as why:
            raise GlbumpError(
                f"{self.directory}: cannot be made: {(why.strerror or str(why)).lower()}; give another folder"
            ) from None
        self._file = self.directory / ROWS
        if not os.access(self.directory, os.W_OK):
            raise GlbumpError(f"{self.directory}: is write-protected; give another folder or allow writing")
        check_writable(self._file)
        self._rows = {row["key"]: row for row in self._read()}

    def _read(self) -> list[Row]:
        """The rows that are whole; what a run that was cut off left of a last one is taken away."""
        try:
            content = self._file.read_bytes()
        except FileNotFoundError:
            return []
        whole = content[: content.rfind(b"\n") + 1]
        rows: list[Row] = []
        for number, line in enumerate(whole.splitlines(), 1):
            try:
                row = json.loads(line)
                scene, _ = row["scene"], row["key"]
            except (ValueError, TypeError, KeyError):
                raise GlbumpError(
                    f"{self._file}: line {number} is no row of a trade; give another folder, or remove that file"
                ) from None
            if scene != self.scene:
                raise GlbumpError(
                    f"{self.directory}: holds the results of another scene, or of this one before it or its files "
                    f"changed; give another folder, or remove {self._file}"
                )
            rows.append(row)
        if len(whole) < len(content):
            write_atomically(self._file, whole, error=GlbumpError)
        return rows

    def get(self, key: str) -> Row | None:
        """The row of a key, if it has been measured."""
        return self._rows.get(key)

    def add(self, row: Row) -> Row:
        """Keep a row that has a key: on the disk when this returns."""
        row = plain(row | {"scene": self.scene})
        line = (json.dumps(row) + "\n").encode()
        try:
            with self._file.open("ab") as opened:
                opened.write(line)
                opened.flush()
                os.fsync(opened.fileno())
        except OSError as why:
            raise GlbumpError(
                f"{self._file}: cannot be written: {(why.strerror or str(why)).lower()}; free some room, run it again"
            ) from None
        self._rows[row["key"]] = row
        return row

    def truth(self, key: str, find: Callable[[], Truth]) -> Truth:
        """The truth of a key, kept in the folder once `find` has found it."""
        path = self.directory / f"truth-{key}.npz"
        if path.is_file():
            try:
                return _load(path)
            except (OSError, ValueError, KeyError, EOFError, BadZipFile):
                path.unlink(missing_ok=True)  # Not ours, or damaged: found anew.
        truth = find()
        write_atomically(path, lambda beside: _save(beside, truth), error=ImageError)
        return truth


def _save(path: Path, truth: Truth) -> None:
    said = {
        "source": truth.source,
        "samples": truth.samples,
        "noise": truth.noise,
        "checked": truth.checked,
        "tiles": truth.tiles,
        "notes": truth.notes,
    }
    there = {name: array for name in ("several", "normals") if (array := getattr(truth, name)) is not None}
    with path.open("wb") as opened:
        np.savez_compressed(opened, pixels=truth.pixels, said=json.dumps(plain(said)), **there)


def _load(path: Path) -> Truth:
    with np.load(path, allow_pickle=False) as kept:
        said = json.loads(str(kept["said"]))
        noise, checked = said.pop("noise"), said.pop("checked")
        return Truth(
            pixels=kept["pixels"],
            several=kept.get("several"),
            normals=kept.get("normals"),
            noise=float("nan") if noise is None else noise,
            checked=Bounds(*checked) if checked else None,
            source=said["source"],
            samples=said["samples"],
            tiles=said["tiles"],
            notes=tuple(said["notes"]),
        )
