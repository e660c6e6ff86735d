"""The command: measures the studies asked for, and writes their pages."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from importlib import import_module
from pathlib import Path

from benchmarks.command import DOCS
from benchmarks.figures import Section, Table, grid, markdown
from benchmarks.machine import machine
from glbump.gl.context import open_context
from glbump.maps.files import write_atomically

STUDIES = ("displacement", "layouts", "kernels", "normal_formats", "levels", "heights8", "gloss", "presets")
"""Each a module here with `study(folder, quick) -> Section`, which writes its pictures into the folder."""

PAGES = DOCS / "studies"

Study = Callable[[Path, bool], Section]


def page(name: str, section: Section, where: str) -> str:
    """The study as a Markdown page of its own."""
    text = markdown(section).removeprefix("#")
    return f"{text}\n\nMade by `python -m benchmarks.studies {name}` on {where}; do not edit.\n"


def with_table(text: str, name: str, table: Table) -> str:
    """A text whose lines from `<!-- NAME` to `<!-- end of NAME -->` hold a study's table, with this one in its place;
    without such lines as it was."""
    begins, ends = f"<!-- {name}: made by `make studies`, do not edit -->", f"<!-- end of {name} -->"
    before, found, rest = text.partition(begins)
    if not found:
        return text
    return f"{before}{begins}\n{grid(table)}\n{ends}{rest.partition(ends)[2]}"


def main(arguments: list[str] | None = None) -> int:
    """Write a page for each study; the exit status is 1 where a promise is not kept."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.studies", description=main.__doc__)
    parser.add_argument("studies", nargs="*", metavar="NAME", help=f"of {', '.join(STUDIES)}; default all")
    parser.add_argument("--quick", action="store_true", help="tiny: to see that it runs; its figures mean nothing")
    parser.add_argument("-o", "--output", type=Path, default=PAGES, help="folder; default docs/studies")
    options = parser.parse_args(arguments)
    unknown = set(options.studies) - set(STUDIES)
    if unknown:
        parser.error(f"no study {', '.join(sorted(unknown))}; there are {', '.join(STUDIES)}")
    options.output.mkdir(parents=True, exist_ok=True)
    with open_context() as context:
        kind = machine({**context.info, "software": context.is_software})
    where = ", ".join(f"{what} {value}" for what, value in kind.items())
    broken = 0
    for name in options.studies or STUDIES:
        study: Study = import_module(f"benchmarks.studies.{name}").study
        section = study(options.output, options.quick)
        write_atomically(options.output / f"{name}.md", page(name, section, where).encode())
        print(options.output / f"{name}.md", flush=True)
        if options.output == PAGES and not options.quick:
            readme = DOCS.parent / "README.md"
            write_atomically(readme, with_table(readme.read_text(), name, section.tables[0]).encode())
        broken += sum(not target.kept for target in section.targets)
    return 1 if broken else 0
