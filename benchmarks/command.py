"""The command: chooses sections, measures, prints, writes."""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable
from importlib import import_module
from pathlib import Path

from benchmarks.figures import Section, markdown, write
from benchmarks.machine import machine

SECTIONS = (
    "accuracy",
    "frame_cost",
    "capture",
    "plain",
    "first_picture",
    "bench_glsltest",
    "soak",
    "kernels",
    "afar",
    "normal_formats",
    "normals",
    "layouts",
    "pyramids",
    "diffuse",
    "gloss",
    "conversion",
    "promise",
    "tuning",
    "model",
    "window",
)
DOCS = Path(__file__).resolve().parents[1] / "docs"
INTRO = (
    "Written by `make bench`; do not edit. Times are ratios of things done in turns in one run, as median (lower to "
    "upper quartile): seconds differ between machines and between minutes, ratios much less. CPU time counts every "
    "thread of the process, the driver's too, so it hardly notices what else the machine does; wall clock does."
)


def alone(measure: Callable[[bool], Section]) -> None:
    """One section by itself, printed."""
    parser = argparse.ArgumentParser(description=measure.__doc__)
    parser.add_argument("--quick", action="store_true", help="tiny: to see that it runs; its figures mean nothing")
    print(markdown(measure(parser.parse_args().quick)))


def main(arguments: list[str] | None = None) -> int:
    """Measure and write; the exit status is 1 where a promise is not kept."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=INTRO)
    parser.add_argument("sections", nargs="*", metavar="SECTION", help=f"of {', '.join(SECTIONS)}; default all")
    parser.add_argument("--quick", action="store_true", help="tiny: to see that it runs; its figures mean nothing")
    parser.add_argument(
        "-o",
        "--output",
        type=Path,
        help="folder for benchmarks.md and .json, whose other sections stay where some are named; "
        "default docs, when all ran in full",
    )
    options = parser.parse_args(arguments)
    unknown = set(options.sections) - set(SECTIONS)
    if unknown:
        parser.error(f"no section {', '.join(sorted(unknown))}; there are {', '.join(SECTIONS)}")
    kind = machine(_renderer_info())
    print("\n".join(f"{name:12} {value}" for name, value in kind.items()), flush=True)
    sections = []
    for name in options.sections or SECTIONS:
        started = time.perf_counter()
        sections.append(import_module(f"benchmarks.{name}").measure(options.quick))
        print(f"\n{markdown(sections[-1])}\n\n({time.perf_counter() - started:.0f} s)", flush=True)
    complete = not options.sections and not options.quick
    folder = options.output or (DOCS if complete else None)
    if folder is not None:
        folder.mkdir(parents=True, exist_ok=True)
        written = write(folder, INTRO, kind, sections, keep=bool(options.sections))
        print("\n" + "\n".join(f"written: {path}" for path in written))
    broken = [target for section in sections for target in section.targets if not target.kept]
    for target in broken:
        print(f"not kept: {target.what}: {target.got}, allowed {target.allowed}", file=sys.stderr)
    return 1 if broken else 0


def _renderer_info() -> dict[str, object]:
    from glbump.gl.context import open_context

    with open_context() as context:
        return {**context.info, "software": context.is_software}
