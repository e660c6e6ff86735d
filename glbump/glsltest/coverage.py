"""Which blocks and branches of the shaders the tests ran, ternaries and preprocessor branches among them.

A flag is raised at the beginning of every block and in both arms of every ternary, on the line where it stands,
and comes back with the results of each row. The functions' own results keep their bits.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import numpy.typing as npt

from glbump.errors import ShaderError
from glbump.gl.source import Source, resolve
from glbump.glsltest.declarations import Declarations, Signature, declarations
from glbump.glsltest.edits import Edit
from glbump.glsltest.grammar import Node


@dataclass(frozen=True)
class Point:
    """One place whose running is counted: where it begins, and what it is."""

    file: str
    line: int
    column: int
    what: str


@dataclass(frozen=True)
class Mark:
    """A point with the edits that raise its flag, and the lines of the statements that run with it."""

    point: Point
    lines: tuple[int, ...]


class Marker:
    """Finds the points of a text's functions, and the edits that raise flag after flag."""

    def __init__(self, source: Source, prefix: str) -> None:
        self.source, self.prefix = source, prefix
        self.marks: list[Mark] = []
        self.edits: list[Edit] = []
        text = source.text
        self._starts = [0, *(i + 1 for i, c in enumerate(text) if c == "\n")]

    def place(self, offset: int) -> tuple[str, int, int]:
        """File, line and column of an offset."""
        line = int(np.searchsorted(self._starts, offset, side="right"))
        file, number = self.source.origin(line)
        return file, number, offset - self._starts[line - 1] + 1

    def mark(self, offset: int, what: str, inside: Iterable[Node] = ()) -> str:
        """A new point; returns the GLSL that raises its flag."""
        lines = tuple(self.place(node.start)[1] for node in inside if node.kind != "block")
        self.marks.append(Mark(Point(*self.place(offset), what), lines))
        return f"{self.prefix}hit({len(self.marks) - 1})"

    def insert(self, offset: int, text: str) -> None:
        self.edits.append(Edit(offset, offset, text))

    def function(self, signature: Signature, body: Node) -> None:
        """All points of one function."""
        hit = self.mark(signature.start, f"function {signature.name}", body.kids)
        self.insert(body.start + 1, f" {hit}; ")
        for kid in body.kids:
            self.visit(kid)

    def visit(self, node: Node) -> None:
        """All points in a statement or an expression; edits go in the order of the text."""
        if node.kind == "if":
            self.visit(node.kids[0])
            self.branch(node.kids[1], "if true")
            if len(node.kids) > 2:
                self.branch(node.kids[2], "if false")
            else:
                self.insert(node.end, f" else {{ {self.mark(node.start, 'if false, no else')}; }}")
        elif node.kind in ("for", "while", "do"):
            body = node.kids[{"for": 3, "while": 1, "do": 0}[node.kind]]
            for kid in node.kids:
                if kid is body:
                    self.branch(kid, f"{node.kind} body")
                else:
                    self.visit(kid)
        elif node.kind == "case":
            self.insert(node.end, f" {self.mark(node.start, node.word)}; ")
        elif node.kind == "ternary":
            self.visit(node.kids[0])
            for arm, word in ((node.kids[1], "true"), (node.kids[2], "false")):
                self.insert(arm.start, f"({self.mark(arm.start, f'? {word}')}, ")
                self.visit(arm)
                self.insert(arm.end, ")")
        elif not (node.kind == "declaration" and node.word == "const"):  # a constant's value takes no call
            for kid in node.kids:
                self.visit(kid)

    def branch(self, node: Node, what: str) -> None:
        """A statement that runs or does not: in braces, with its flag."""
        inside = node.kids if node.kind == "block" else [node]
        self.insert(node.start, f"{{ {self.mark(node.start, what, inside)}; ")
        self.visit(node)
        self.insert(node.end, " }")


def header(prefix: str, count: int) -> str:
    """GLSL that the flags need, on one line."""
    p, n = prefix, words(count)
    return (
        f"uint {p}flags[{n}]; bool {p}hit(int {p}i) {{ {p}flags[{p}i / 32] |= 1u << uint({p}i % 32); return true; }} "
    )


def setup(prefix: str, count: int) -> str:
    """GLSL that lowers all flags before a call."""
    return " ".join(f"{prefix}flags[{i}] = 0u;" for i in range(words(count)))


def words(count: int) -> int:
    """Words that hold so many flags."""
    return max(1, -(-count // 32))


def raised(flags: npt.NDArray[np.uint32], count: int) -> npt.NDArray[np.bool_]:
    """Which flags any row raised; flags: (rows, words)."""
    joined = np.bitwise_or.reduce(flags, axis=0)
    return np.unpackbits(joined.astype("<u4").view(np.uint8), bitorder="little")[:count].astype(bool)


@dataclass
class Coverage:
    """What has been seen in all calls. `folder`: only files below it count; None counts all."""

    folder: Path | None = None
    hits: dict[Point, bool] = field(default_factory=dict)
    lines: dict[str, dict[int, bool]] = field(default_factory=lambda: defaultdict(dict))
    files: dict[str, Path | None] = field(default_factory=dict)

    def counts(self, source: Source, file: str) -> bool:
        known = source.files.get(file)
        if known is None or file.startswith("<"):
            return False
        return self.folder is None or (known.path is not None and known.path.resolve().is_relative_to(self.folder))

    def see(self, source: Source, found: Declarations) -> None:
        """Learn the points of a source: what is never called counts against it."""
        marker = Marker(source, "")
        for f in found.functions:
            if f.name != "main":
                try:
                    marker.function(f, found.body(f))
                except ShaderError:
                    marker.mark(f.start, f"function {f.name}")
        self.add(source, marker.marks, np.zeros(len(marker.marks), bool))
        for line, taken in found.active.branches:
            file, number = source.origin(line)
            if self.counts(source, file) and source.files[file].lines[number - 1].lstrip().startswith("#"):
                written = source.files[file].lines[number - 1].split()
                if "".join(written[:1]) != "#include":  # the guard of an include is ours
                    point = Point(file, number, 1, "branch " + " ".join(written))
                    self.hits[point] = self.hits.get(point, False) or taken
                    self.files[file] = source.files[file].path

    def see_folder(self) -> None:
        """Learn the points of every GLSL file below the folder that no test loaded."""
        known = {path.resolve() for path in self.files.values() if path}
        for path in sorted(self.folder.rglob("*.glsl")) if self.folder else []:
            if path.resolve() not in known:
                source = resolve(path)
                self.see(source, declarations(source.text))

    def add(self, source: Source, marks: Sequence[Mark], seen: npt.NDArray[np.bool_]) -> None:
        """Count what one call ran."""
        for mark, hit in zip(marks, seen.tolist(), strict=True):
            point = mark.point
            if not self.counts(source, point.file):
                continue
            self.files[point.file] = source.files[point.file].path
            self.hits[point] = self.hits.get(point, False) or hit
            for line in mark.lines:
                self.lines[point.file][line] = self.lines[point.file].get(line, False) or hit

    def missing(self) -> list[Point]:
        """What no test ran."""
        return sorted((p for p, hit in self.hits.items() if not hit), key=lambda p: (p.file, p.line, p.column))

    @property
    def share(self) -> float:
        """Points that ran, of all; 1 where there are none."""
        return sum(self.hits.values()) / len(self.hits) if self.hits else 1.0

    def table(self) -> list[str]:
        """The report, line by line: each file's functions and branches, and what is missing."""
        rows = []
        for file in sorted(self.files):
            points = {p: hit for p, hit in self.hits.items() if p.file == file}
            functions = [hit for p, hit in points.items() if p.what.startswith("function ")]
            branches = [hit for p, hit in points.items() if not p.what.startswith("function ")]
            share = f"{100 * sum(points.values()) / max(len(points), 1):.1f} %"
            rows.append((file, _of(functions), _of(branches), share))
        width = max([len(r[0]) for r in rows], default=4)
        made = [f"{'file':{width}}  functions  branches   share"]
        made += [f"{f:{width}}  {a:>9}  {b:>8} {s:>7}" for f, a, b, s in rows]
        return made + [f"never ran: {p.file}:{p.line}:{p.column}: {p.what}" for p in self.missing()]

    def lcov(self) -> str:
        """The report in lcov's format (geninfo(1))."""
        out = []
        for file, path in sorted(self.files.items()):
            out += ["TN:", f"SF:{path.resolve() if path else file}"]
            points = sorted((p for p in self.hits if p.file == file), key=lambda p: (p.line, p.column, p.what))
            for p in points:
                if p.what.startswith("function "):
                    name = p.what.removeprefix("function ")
                    out += [f"FN:{p.line},{name}", f"FNDA:{int(self.hits[p])},{name}"]
            numbers: dict[int, int] = defaultdict(int)
            for p in points:
                if not p.what.startswith("function "):
                    out.append(f"BRDA:{p.line},0,{numbers[p.line]},{int(self.hits[p])}")
                    numbers[p.line] += 1
            out += [f"DA:{line},{int(hit)}" for line, hit in sorted(self.lines[file].items())]
            out.append("end_of_record")
        return "\n".join(out) + "\n"


def _of(hits: list[bool]) -> str:
    return f"{sum(hits)}/{len(hits)}"
