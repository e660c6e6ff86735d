"""`glbump compare-bump`: is bump mapping good enough here?"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from glbump.commands.options import (
    Session,
    backend_option,
    common,
    json_option,
    print_json,
    quality_option,
    scene_options,
    size_option,
)
from glbump.progress import progress

if TYPE_CHECKING:
    from glbump.quality import Quality


@click.command()
@click.option(
    "-o", "--output", type=click.Path(path_type=Path), metavar="DIR", help="Where the pictures go; else none."
)
@click.option("--surface", type=click.IntRange(min=0), default=0, metavar="N", help="Which surface; default 0.")
@size_option
@quality_option
@backend_option
@scene_options
@json_option
@common
def compare_bump(
    session: Session,
    scene: Path,
    output: Path | None,
    surface: int,
    size: tuple[int, int],
    quality: str | Quality,
    backend: str | None,
    settings: tuple[str, ...],
    as_json: bool,
) -> None:
    """Compare a surface flat, bumped and truly displaced, and say whether bump mapping is good enough.

    \b
    glbump compare-bump scene.toml
    glbump compare-bump scene.toml -o out/compare --surface 1 --set surface.1.bump.amplitude=0.1

    DIR gets a picture of each, and sheet.png: below the pictures the angles to the displaced surface's normals and
    the silhouettes (blue is lost, red is won), below these the differences and how far points move.
    """
    from glbump.maps.files import check_target, write_display, write_picture
    from glbump.scenefile import files_of, load_scene, set_from_text
    from glbump.trade.bumps import FORMS, sheet
    from glbump.trade.bumps import compare_bump as compare

    content = set_from_text(load_scene(scene), *settings)
    if output is not None:
        output.mkdir(parents=True, exist_ok=True)
        for name in (*FORMS, "displaced", "sheet"):
            check_target(output / f"{name}.png", inputs=files_of(content))
    with progress("displacing and drawing", shown=not session.quiet):
        found = compare(content, surface, size, quality=quality, backend=backend or "auto")
    if output is not None:
        for name, pixels in found.pictures.items():
            write_picture(output / f"{name}.png", pixels)
        write_display(output / "sheet.png", sheet(found))
    if as_json:
        print_json(found.figures | {"advice": found.advice})
        return
    for line in _table(found.figures):
        session.say(line)
    session.say(found.advice)


def _table(figures: dict[str, Any]) -> list[str]:
    """The figures as lines for people; the displaced surface is what all are compared with."""

    def spread(values: dict[str, float | None]) -> str:
        return "".join("        -" if v is None else f"{v:9.3g}" for v in values.values())

    lines = [
        f"{'':12}{'normals, degrees':>27}   {'pictures, of display white':>27}",
        f"{'':12}{'mean':>9}{'p99':>9}{'max':>9}   {'mean':>9}{'rmse':>9}{'flip':>9}",
    ]
    for form, angles in figures["normals"].items():
        picture = {name: figures["pictures"][form][name] for name in ("mean", "rmse", "flip")}
        lines.append(f"{form:12}{spread(angles)}   {spread(picture)}")
    small, outline = figures["formula"]["small"], figures["silhouette"]
    return [
        *lines,
        f"small for full, at the same points:{spread(small)} degrees",
        f"points move by:                    {spread(figures['moved'])} pixels",
        f"the silhouette moves by:           {spread({k: outline[k] for k in ('mean', 'max')})} pixels, mean and max; "
        + (f"{outline['share']:.2%} of what is covered" if outline["share"] is not None else "it is not seen"),
    ]
