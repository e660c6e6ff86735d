"""Wavefront OBJ."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from glbump.errors import MeshError
from glbump.meshformats.raw import Floats, Indices, Raw, check_rows, fan, table

_IGNORED = "o g s mg usemtl mtllib usemap maplib lod bevel c_interp d_interp shadow_obj trace_obj"
_NOT_DRAWN = "p l vp deg bmat step cstype curv curv2 surf parm trim hole scrv sp end con ctech stech call csh"
_WORDS = {word: word in _NOT_DRAWN.split() for word in f"{_IGNORED} {_NOT_DRAWN}".split()}


def read_obj(data: bytes) -> Raw:
    """Wavefront OBJ: polygons with any mixture of v, v/vt, v//vn and v/vt/vn; indices may count from the end."""
    if b"\0" in data[:4096]:
        raise MeshError("is not text, which OBJ is")
    text = data.decode("utf-8", errors="replace").replace("\\\r\n", " ").replace("\\\n", " ").replace("\t", " ")
    lines: dict[str, list[str]] = {"v": [], "vt": [], "vn": [], "f": []}
    undrawn = 0
    for number, line in enumerate(text.splitlines(), 1):
        word = line.split(" ", 1)[0]
        if word == "":
            line = line.lstrip()
            word = line.split(" ", 1)[0]
        if word in lines:
            if "#" in line:
                line = line.split("#", 1)[0]
            if word == "f" and "-" in line:
                line = _from_start(line, len(lines["v"]), len(lines["vt"]), len(lines["vn"]))
            lines[word].append(line)
        elif word in _WORDS:
            undrawn += _WORDS[word]
        elif word and word[0] != "#":
            raise MeshError(f"line {number:,}, {line.strip()!r:.60}, is no OBJ")
    notes = [f"{undrawn:,} statements other than faces are not drawn"] if undrawn else []
    positions, normals = table(lines["v"], 3, "vertex"), table(lines["vn"], 3, "normal")
    uv = table(lines["vt"], 2, "texture coordinate")
    counts, rows = _corners(lines["f"])
    picks = fan(counts, positions[check_rows(rows[:, 0], len(positions), "vertex")], notes)

    def optional(column: int, values: Floats, what: str) -> tuple[Floats | None, Indices | None]:
        given = np.count_nonzero(rows[:, column] >= 0)
        if given == len(rows):
            return values, check_rows(rows[:, column], len(values), what)[picks]
        if given:
            notes.append(f"every {what} is ignored: only {given:,} of {len(rows):,} corners have one")
        return None, None

    uv_and_corners = optional(1, uv, "texture coordinate")
    return Raw(positions, rows[:, 0][picks], *uv_and_corners, *optional(2, normals, "normal"), notes)


def _from_start(line: str, *counts: int) -> str:
    """A face line whose negative indices, which count from the last line read so far, count from the start."""

    def corner(token: str) -> str:
        parts = token.split("/")
        try:
            # One before the first becomes 0 or less, which is refused with the others.
            return "/".join(p if not p.startswith("-") else str(n + 1 + int(p)) for p, n in zip(parts, counts))
        except ValueError:
            raise MeshError(f"{line.strip()!r:.60} is no face") from None

    return " ".join(["f", *map(corner, line.split()[1:])])


def _corners(lines: Sequence[str]) -> tuple[Indices, Indices]:
    """Corners of each face, and (C, 3) rows of v, vt, vn of each corner, -1 where there is none."""
    faces = [line.split() for line in lines]
    counts = np.array([len(face) - 1 for face in faces], dtype=np.int64)
    tokens = [token for face in faces for token in face[1:]]
    rows = np.full((len(tokens), 3), -1, dtype=np.int64)
    for (slashes, gap), which in _alike(tokens).items():
        columns = [0, 2] if gap else [0, 1, 2][: slashes + 1]
        part = tokens if len(which) == len(tokens) else [tokens[i] for i in which]
        text = " ".join(part).replace("//", "/").replace("/", " ")
        try:
            # More slashes than v/vt/vn has are no columns: 0 of them, and the numbers do not fit.
            shape = len(which), len(columns) if slashes <= 2 else 0
            values = np.loadtxt([text], dtype=np.int64, comments=None, ndmin=1).reshape(shape)
        except ValueError:
            bad = next((t for t in part if not re.fullmatch(r"\d{1,18}(/\d{1,18}|/\d{0,18}/\d{1,18})?", t)), part[0])
            raise MeshError(f"{bad!r:.60} is no corner of a face; v, v/vt, v//vn or v/vt/vn is") from None
        if np.any(values < 1):
            raise MeshError("a face names number 0, or one before the first; OBJ counts from 1")
        rows[which[:, None], columns] = values - 1
    return counts, rows


def _alike(tokens: list[str]) -> dict[tuple[int, bool], npt.NDArray[np.int64]]:
    """Which of the corners are written alike, by the number of slashes and whether two stand together."""
    text = " ".join(tokens).encode()
    marks, gaps = text.translate(None, b"0123456789").split(), text.count(b"//")
    if len(marks) in (0, len(tokens)) and len(set(marks)) < 2 and gaps in (0, len(tokens)):
        # All of them, as nearly always, found without a step of Python for each.
        return {(tokens[0].count("/"), gaps > 0): np.arange(len(tokens))} if tokens else {}
    kinds: dict[tuple[int, bool], list[int]] = {}
    for i, token in enumerate(tokens):
        kinds.setdefault((token.count("/"), "//" in token), []).append(i)
    return {kind: np.array(which) for kind, which in kinds.items()}
