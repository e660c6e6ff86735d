"""`glbump demo`: the gallery."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from glbump.commands.options import Session, backend_option, checked, common, quality_option
from glbump.progress import progress

if TYPE_CHECKING:
    from glbump.demo import Exhibit
    from glbump.quality import Quality


def _exhibits(names: tuple[str, ...]) -> tuple[Exhibit, ...]:
    from glbump.demo import chosen

    return chosen(names)


@click.command()
@click.option("-o", "--output", type=click.Path(path_type=Path), default=Path("out"), help="Folder; default out.")
@click.option(
    "--only",
    metavar="NAME",
    multiple=True,
    callback=checked(_exhibits),
    help="This picture alone; may be given again.",
)
@quality_option
@backend_option
@common
def demo(
    session: Session, output: Path, only: tuple[Exhibit, ...], quality: str | Quality, backend: str | None
) -> None:
    """Draw the gallery: pictures, and the scene files they are drawn from, to start one's own.

    \b
    glbump demo
    glbump demo -o gallery --only brick-ball
    glbump render gallery/scenes/brick-ball.toml -o larger.png --size 1024x1024
    """
    from glbump.demo import write_gallery
    from glbump.gl.renderer import Renderer

    with (
        progress("drawing the gallery", len(only), shown=not session.quiet) as step,
        Renderer(backend=backend or "auto") as renderer,
    ):
        for picture, exhibit in write_gallery(output, only, renderer.render, quality):
            step()
            session.say(f"{picture}  {exhibit.title}")
