"""`glbump diff`: two pictures compared."""

from __future__ import annotations

from pathlib import Path

import click

from glbump.commands.options import Session, common, error_of_word, json_option, print_json
from glbump.errors import GlbumpError
from glbump.progress import progress


@click.command()
@click.argument("a", type=click.Path(path_type=Path))
@click.argument("b", type=click.Path(path_type=Path))
@click.option("-o", "--output", type=click.Path(path_type=Path), help="A picture of the difference.")
@click.option("--gain", type=float, default=8.0, metavar="G", help="How much -o magnifies; default 8.")
@click.option(
    "--max", "most", metavar="E", callback=error_of_word, help="Fail where a pixel differs by more, as 2/255."
)
@json_option
@common
def diff(
    session: Session, a: Path, b: Path, output: Path | None, gain: float, most: float | None, as_json: bool
) -> None:
    """Compare two pictures as a display shows them: sRGB, 0 to 1.

    \b
    glbump diff got.png wanted.png
    glbump diff got.exr wanted.exr -o difference.png --max 2/255
    """
    from glbump.maps.files import check_target
    from glbump.maps.images import read_picture
    from glbump.trade.metrics import compare, difference_picture

    if output is not None:
        check_target(output, inputs=(a, b))
    first, second = read_picture(a).pixels, read_picture(b).pixels
    with progress("comparing", shown=not session.quiet):
        figures = compare(first, second)
    if output is not None:
        from glbump.maps.colour import eight_bit
        from glbump.maps.files import write_display

        write_display(output, eight_bit(difference_picture(first, second, gain)))
    if as_json:
        print_json(figures)
    else:
        notes = figures.pop("notes")
        for name, value in figures.items():
            shown = notes.get(name, "-") if value is None else f"{value:.6g}" if name != "worst" else value
            session.say(f"{name:5}  {shown}")
    if most is not None and figures["max"] > most:
        raise GlbumpError(f"{a} and {b} differ by up to {figures['max']:.4g} of display white; --max allows {most:.4g}")
