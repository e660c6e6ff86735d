"""GLSL files, includes and defines -> one text with a line table. Pure text: no OpenGL here.

This room alone writes `#version` and defines. Drivers mangle the file ids of `#line`, so the table is kept
here, and `Source.explain` turns a driver's log into the real file, line and the source around it.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Mapping
from functools import lru_cache
from itertools import repeat
from pathlib import Path

from glbump.errors import ShaderError, nearest
from glbump.frozen import Frozen

Define = bool | int | float | str
SUFFIXES = {".vert": "vertex", ".frag": "fragment", ".comp": "compute", ".geom": "geometry"}

_COMMENT = re.compile(r"//.*|/\*(?s:.*?)(?:\*/|\Z)")
_DIRECTIVE = re.compile(
    r"\s*#\s*(?:include\s*[\"<](?P<include>[^\">]*)[\">]|version\s+(?P<version>\d+)\s*(?P<profile>\w*)"
    r"|(?P<branch>if|ifdef|ifndef|elif|else|endif)\b)"
)
# What the drivers write. Mesa: 0:12(5): error: ...; NVIDIA: 0(12) : error C1008: ...;
# Intel, AMD, Apple: ERROR: 0:12: ... Text: few runs need it compiled.
_LOG_LINE = (
    r"(?i)^\s*(?:(?P<kind1>ERROR|WARNING):\s*)?\d+(?::(?P<colon>\d+)(?:\(\d+\))?|\((?P<paren>\d+)\))\s*:\s*"
    r"(?:(?:preprocessor )?(?P<kind2>error|warning|note)\b\s*(?P<code>[A-Z]\d+)?\s*:\s*)?(?P<what>.*)$"
)


def find_shaders() -> Path:
    """The folder of glbump's shaders: GLBUMP_SHADERS, beside the package, or the repository's top folder.

    Raises ShaderError when none of them is a folder.
    """
    package = Path(__file__).parent.parent
    told = os.environ.get("GLBUMP_SHADERS")
    places = [Path(told)] if told else [package / "shaders", package.parent / "shaders"]
    for place in places:
        if place.is_dir():
            return place
    raise ShaderError(
        f"no shaders folder; looked for {' and '.join(map(str, places))}; "
        + ("correct GLBUMP_SHADERS" if told else "reinstall glbump, or set GLBUMP_SHADERS to the folder")
    )


class SourceFile(Frozen):
    """One file that went into a source: where it lies (None for an inline text) and its lines."""

    path: Path | None
    lines: tuple[str, ...]


class Source(Frozen):
    """GLSL as the driver gets it; `lines[i]` is the (file, line) that line i + 1 of `text` came from."""

    text: str
    lines: tuple[tuple[str, int], ...]
    files: Mapping[str, SourceFile]
    name: str
    stage: str = ""

    def origin(self, line: int) -> tuple[str, int]:
        """The (file, line) of line `line` (1-based) of `text`; the last one for a line past the end."""
        return self.lines[min(max(line, 1), len(self.lines)) - 1]

    def around(self, file: str, line: int, margin: int = 2) -> str:
        """Numbered lines of `file` round `line`, which is marked with `>`; empty for a generated line."""
        lines = self.files[file].lines if file in self.files else ()
        shown = range(max(1, line - margin), min(len(lines), line + margin) + 1)
        return "\n".join(f"{'>' if i == line else ' '} {i:4} | {lines[i - 1]}" for i in shown)

    def explain(self, driver_log: str) -> str:
        """A driver's compile or link log as a message: the first line says it all, the source follows."""
        stage = f" ({self.stage} shader)" if self.stage else ""
        found: list[tuple[bool, str, int, str]] = []
        for entry in driver_log.splitlines():
            if match := re.match(_LOG_LINE, entry):
                kind = (match["kind1"] or match["kind2"] or "error").lower()
                file, line = self.origin(int(match["colon"] or match["paren"]))
                found.append((kind == "error", file, line, match["what"].strip()))
        errors = [f for f in found if f[0]] or found
        if not errors:
            # moderngl puts a heading, underlined with =, before what the driver said.
            said = [entry.strip() for entry in re.split(r"^=+$", driver_log, flags=re.M)[-1].splitlines()]
            told = "; ".join(filter(None, said)) or "the driver gave no reason"
            return f"{self.name}: GLSL does not build{stage}: {told}"
        _, file, line, what = errors[0]
        rest = [f"{f}:{n}: {w}" for _, f, n, w in errors[1:]]
        return "\n".join(filter(None, [f"{file}:{line}: {what}{stage}", self.around(file, line), *rest]))


def resolve(
    name_or_path: str | Path | None = None,
    *,
    text: str | None = None,
    name: str = "inline",
    defines: Mapping[str, Define] | None = None,
    version: int | str | None = None,
    stage: str | None = None,
    folders: Iterable[Path] = (),
) -> Source:
    """One GLSL text from a file (or from `text`, shown as `name`), with every include put in once.

    `#include "lib/bump.glsl"` is looked for beside the file that includes it, then in `folders`, then in
    `find_shaders()`. Inside `#if` the text is guarded, so that an include in a branch not taken does not
    hide a later one. `version` is 330 unless given or written on the source's own `#version` line.

    Raises ShaderError: a missing file (with the nearest name), a cycle (with its chain), a second #version.
    """
    resolver = _Resolver([*folders, find_shaders()], stage)
    if (name_or_path is None) == (text is None):
        raise ShaderError("resolve wants either a file or text=; got both or neither")
    if text is not None:
        label, body = name, text
        resolver.files[label] = SourceFile(None, tuple(body.splitlines()))
    else:
        path = resolver.find(str(name_or_path), None, "")
        label = resolver.read(path)
    resolver.put(label, ())
    told = version if version is not None else resolver.version or 330
    head = [f"#version {told} core" if isinstance(told, int) and told >= 150 else f"#version {told}"]
    head += [f"#define {key} {_define(key, value)}" for key, value in (defines or {}).items()]
    table = [(_GENERATED, i + 1) for i in range(len(head))]
    return Source(
        text="\n".join([*head, *resolver.out, ""]),
        lines=(*table, *resolver.table),
        files={**resolver.files, _GENERATED: SourceFile(None, tuple(head))},
        name=label,
        stage=stage if stage is not None else SUFFIXES.get(Path(label).suffix, ""),
    )


_GENERATED = "<glbump>"


def _define(key: str, value: Define) -> str:
    if not re.fullmatch(r"[A-Za-z_]\w*", key) or "\n" in str(value):
        raise ShaderError(f"a define is a GLSL name and a value on one line; got {key!r} = {value!r}")
    if isinstance(value, bool):
        return str(int(value))
    if isinstance(value, float):
        return repr(value)
    return str(value)


class _Resolver:
    def __init__(self, folders: list[Path], stage: str | None) -> None:
        self.folders, self.stage = folders, stage
        self.version: str | None = None
        self.out: list[str] = []
        self.table: list[tuple[str, int]] = []
        self.files: dict[str, SourceFile] = {}
        # Files known to be in, one set for the top level and one for each open #if branch.
        self.scopes: list[set[str]] = [set()]
        self._root = os.path.realpath(folders[-1])

    def put(self, label: str, chain: tuple[str, ...]) -> None:
        """Append the text of file `label`, its includes in place; `chain` is who included it."""
        self.scopes[-1].add(label)
        lines = self.files[label].lines
        depth, done = len(self.scopes), 0
        for number, match in _directives(lines):
            if match["branch"]:
                self._branch(match["branch"], depth, label, number)
                continue
            self._copy(label, lines, done, number - 1)
            done = number
            if match["version"]:
                self._set_version(" ".join(filter(None, match.group("version", "profile"))), label, number, chain)
                self._emit("", label, number)
            else:
                self._include(match["include"], label, number, (*chain, label))
        self._copy(label, lines, done, len(lines))
        if len(self.scopes) != depth:
            raise ShaderError(f"{label}: {len(self.scopes) - depth} #if without #endif")

    def _include(self, wanted: str, label: str, number: int, chain: tuple[str, ...]) -> None:
        place = f"{label}:{number}"
        target = self.read(self.find(wanted, self.files[label].path, place))
        if target in chain:
            shown = " -> ".join([*chain[chain.index(target) :], target])
            raise ShaderError(f"{place}: includes go in a circle: {shown}; move what they share to a file of its own")
        if any(target in scope for scope in self.scopes):
            return
        # In the text already (in another branch), or in a branch now: the preprocessor decides.
        guard = "glbump_once_" + re.sub(r"[\W_]+", "_", target).lstrip("_")  # GLSL reserves names with two underscores
        for made in (f"#ifndef {guard}", f"#define {guard}"):
            self._emit(made, label, number)
        self.put(target, chain)
        self._emit("#endif", label, number)

    def _branch(self, word: str, depth: int, label: str, number: int) -> None:
        if word in ("if", "ifdef", "ifndef"):
            self.scopes.append(set())
        elif len(self.scopes) == depth:
            raise ShaderError(f"{label}:{number}: #{word} without #if")
        elif word == "endif":
            self.scopes.pop()
        else:
            self.scopes[-1] = set()

    def _set_version(self, told: str, label: str, number: int, chain: tuple[str, ...]) -> None:
        if chain:
            raise ShaderError(f"{label}:{number}: #version in an included file; remove it, glbump writes #version")
        self.version = told

    def _emit(self, line: str, label: str, number: int) -> None:
        self.out.append(line)
        self.table.append((label, number))

    def _copy(self, label: str, lines: tuple[str, ...], begin: int, end: int) -> None:
        """Lines begin + 1 to end, as they stand."""
        self.out += lines[begin:end]
        self.table += zip(repeat(label), range(begin + 1, end + 1))

    def find(self, wanted: str, includer: Path | None, place: str) -> Path:
        """The file that `wanted` names; `place` is the file:line that asks, empty for the caller."""
        beside = [includer.parent] if includer else [] if place else [Path()]
        for folder in [*beside, *self.folders]:
            if (path := folder / wanted).is_file():
                return path
        # shaders/lib/bump.glsl is how one names it in the repository; the package carries the same folder.
        if not place and (root := self.folders[-1]) and wanted.startswith("shaders/"):
            inside = root / wanted.removeprefix("shaders/")
            if inside.is_file():
                return inside
        names = sorted(str(p.relative_to(self.folders[-1])) for p in self.folders[-1].rglob("*.*") if p.is_file())
        close = nearest(wanted, names) or next((n for n in names if Path(n).name == Path(wanted).name), None)
        hint = f"; did you mean {close!r}?" if close else ""
        tried = ", ".join(str(f) for f in [*beside, *self.folders])
        raise ShaderError(f"{place + ': ' if place else ''}no shader file {wanted!r}; looked in {tried}{hint}")

    def read(self, path: Path) -> str:
        """Read `path` once; returns the name that messages show for it."""
        full = os.path.realpath(path)
        inside = full.startswith(self._root + os.sep)
        label = self.folders[-1].name + full[len(self._root) :] if inside else os.path.relpath(full)
        if label not in self.files:
            try:
                content = path.read_text(encoding="utf-8")
            except (OSError, UnicodeDecodeError) as error:
                raise ShaderError(f"cannot read shader {label}: {error}; GLSL files are UTF-8 text") from None
            self.files[label] = SourceFile(path, tuple(content.splitlines()))
        return label


@lru_cache(maxsize=256)
def _directives(lines: tuple[str, ...]) -> tuple[tuple[int, re.Match[str]], ...]:
    """What a file says to this room, by line number; nothing in comments, nor on the rest of a line that was continued.
    Kept: programs share most of their files."""
    found = []
    bare = _COMMENT.sub(lambda comment: " " + "\n" * comment[0].count("\n"), "\n".join(lines)).split("\n")
    for number, line in enumerate(bare, 1):
        if "#" in line and not (number > 1 and lines[number - 2].endswith("\\")):
            match = _DIRECTIVE.match(line)
            if match:
                found.append((number, match))
    return tuple(found)
