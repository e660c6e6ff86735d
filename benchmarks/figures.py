"""What a measurement hands back, and how it is printed, written as Markdown and as JSON."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

Cell = str | int | float | None


@dataclass(frozen=True)
class Target:
    """One promise: what, what was measured, what is allowed, and whether it is kept."""

    what: str
    got: str
    allowed: str
    kept: bool

    @staticmethod
    def at_most(what: str, value: float, limit: float, unit: str = "") -> Target:
        """`value` must not pass `limit`. NaN passes nothing."""
        return Target(what, _number(value) + unit, f"at most {_number(limit)}{unit}", value <= limit)


@dataclass(frozen=True)
class Table:
    """Rows under their headings; numbers are shown with as many digits as they deserve."""

    head: Sequence[str]
    rows: Sequence[Sequence[Cell]]

    def __post_init__(self) -> None:
        for row in self.rows:
            if len(row) != len(self.head):
                raise ValueError(f"a row of {len(row)} under {len(self.head)} headings: {row}")


@dataclass(frozen=True)
class Section:
    """One measurement. text: how it was made, so that the figures can be judged."""

    title: str
    text: str
    tables: Sequence[Table]
    targets: Sequence[Target] = field(default_factory=tuple)


def _number(value: float) -> str:
    """Three digits, no exponent for what is read as money is."""
    if value != value:
        return "NaN"
    return f"{value:.0f}" if abs(value) >= 1000 else f"{value:.3g}"


def _text(cell: Cell) -> str:
    if cell is None:
        return ""
    return _number(cell) if isinstance(cell, float) else str(cell)


def markdown(section: Section, measured_on: str = "") -> str:
    """The section as a piece of a Markdown page. measured_on: where, if not where the rest of the page was."""
    parts = [f"## {section.title}", *([f"Measured on: {measured_on}."] if measured_on else []), section.text]
    for table in section.tables:
        parts.append(grid(table))
    if section.targets:
        rows = [[t.what, t.got, t.allowed, "yes" if t.kept else "**no**"] for t in section.targets]
        parts.append(grid(Table(("promised", "measured", "allowed", "kept"), rows)))
    return "\n\n".join(parts)


def grid(table: Table) -> str:
    """A table as Markdown."""
    cells = [[_text(c) for c in row] for row in (table.head, *table.rows)]
    widths = [max(len(row[i]) for row in cells) for i in range(len(table.head))]
    # Numbers stand right, so that they can be compared.
    right = [
        bool(table.rows) and all(isinstance(row[i], int | float) for row in table.rows) for i in range(len(widths))
    ]
    lines = [
        "| " + " | ".join(c.rjust(w) if r else c.ljust(w) for c, w, r in zip(row, widths, right)) + " |"
        for row in cells
    ]
    rule = "|" + "|".join("-" * (w + 1) + (":" if r else "-") for w, r in zip(widths, right)) + "|"
    return "\n".join([lines[0], rule, *lines[1:]])


def write(
    folder: Path, intro: str, machine: dict[str, Any], sections: Sequence[Section], *, keep: bool = False
) -> list[Path]:
    """benchmarks.md and benchmarks.json into `folder`. keep: what stands there of other sections stays."""
    from glbump.maps.files import write_atomically

    path = folder / "benchmarks.json"
    old = json.loads(path.read_text()) if keep and path.is_file() else {"machine": machine, "sections": []}
    titles = [section.title for section in sections]
    entries = {entry["title"]: entry for entry in old["sections"] if entry["title"] not in titles}
    # A section keeps its place.
    order = list(dict.fromkeys([entry["title"] for entry in old["sections"]] + titles))
    elsewhere = {} if old["machine"] == machine else {"machine": machine}
    entries |= {section.title: asdict(section) | elsewhere for section in sections}
    content = {"machine": old["machine"], "sections": [entries[title] for title in order]}
    table = Table(("machine", ""), [[k, str(v)] for k, v in content["machine"].items()])
    page = "\n\n".join(["# Benchmarks", intro, grid(table), *map(_kept, content["sections"])]) + "\n"
    written = []
    for name, text in (("benchmarks.md", page), ("benchmarks.json", json.dumps(content, indent=1) + "\n")):
        write_atomically(folder / name, text.encode())
        written.append(folder / name)
    return written


def _kept(entry: dict[str, Any]) -> str:
    """A section of benchmarks.json as a piece of a Markdown page."""
    tables, targets = [Table(**table) for table in entry["tables"]], [Target(**target) for target in entry["targets"]]
    measured_on = ", ".join(f"{what} {value}" for what, value in entry.get("machine", {}).items())
    return markdown(Section(entry["title"], entry["text"], tables, targets), measured_on)
