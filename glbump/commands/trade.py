"""`glbump trade`: what every knob of the quality buys on a scene, and what it costs."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from glbump.commands.options import (
    Session,
    backend_option,
    common,
    json_option,
    print_json,
    quality_of_word,
    scene_options,
    sized,
    word,
)
from glbump.progress import progress

if TYPE_CHECKING:
    from glbump.quality import Quality


@click.command()
@click.option(
    "-o", "--output", required=True, type=click.Path(path_type=Path), metavar="DIR", help="Where all of it goes."
)
@sized("256x256")
@click.option(
    "--base",
    default="balanced",
    metavar="Q",
    callback=quality_of_word,
    help="What each knob is turned from: fast, balanced (default), exact or a quality file.",
)
@click.option(
    "--samples", type=click.IntRange(min=4), default=64, metavar="N", help="A pixel of the truth; default 64."
)
@click.option(
    "--minutes", type=click.FloatRange(min=0), default=10.0, metavar="M", help="Begin nothing after; default 10."
)
@click.option(
    "--metric",
    default="rmse",
    metavar="F",
    callback=word("metric", "glbump.trade.sweep", "METRICS"),
    help="The error that the front is of; default rmse.",
)
@backend_option
@scene_options
@json_option
@common
def trade(
    session: Session,
    scene: Path,
    output: Path,
    size: tuple[int, int],
    base: str | Quality,
    samples: int,
    minutes: float,
    metric: str,
    backend: str | None,
    settings: tuple[str, ...],
    as_json: bool,
) -> None:
    """Measure what every knob of the quality buys on a scene, and what it costs.

    \b
    glbump trade scene.toml -o out/trade
    glbump trade scene.toml -o out/trade --size 512x512 --samples 256 --minutes 30
    glbump trade scene.toml -o out/flip --base fast --metric flip

    DIR gets trade.html, a page that needs no other file; trade.csv, trade.json, front.svg and the pictures. A run
    that was stopped, or ran out of minutes, goes on where it was when it is started again.
    """
    from glbump.scenefile import load_scene, set_from_text
    from glbump.trade.report import write_report
    from glbump.trade.sweep import Sweep

    content = set_from_text(load_scene(scene), *settings)
    with (
        Sweep(
            content,
            output,
            size=size,
            base=base,
            samples=samples,
            minutes=minutes,
            metric=metric,
            backend=backend or "auto",
        ) as sweep,
        progress("measuring", sweep.total, shown=not session.quiet) as step,
    ):
        found = sweep.run(step)
    written = write_report(found, output, scene.stem)
    if as_json:
        print_json(found.facts())
    else:
        for line in found.lines():
            session.say(line)
        session.say(f"{written[-1]}  {len(found.rows)} settings")
    for note in found.notes():
        session.note(note)
