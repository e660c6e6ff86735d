"""`glbump render`: one picture of a scene file."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from glbump.commands.options import (
    Session,
    backend_option,
    common,
    exposure_option,
    json_option,
    print_json,
    quality_option,
    scene_options,
    size_option,
    tone_option,
)
from glbump.progress import progress
from glbump.shown import SHOWN

if TYPE_CHECKING:
    from glbump.frame import Frame
    from glbump.quality import Quality


def _explained(frame: Frame, facts: dict[str, Any] | None) -> Iterator[str]:
    """The plan's choices, each with what was measured of the other ways."""
    from glbump.trade.report import evidence

    known = evidence(facts, frame.stats["plan"]) if facts is not None else {}
    if facts is not None:
        size = "x".join(map(str, facts["size"]))
        yield f"measured at {size} by {facts['driver']}, beside {facts['rows'][0]['name']}:"
    for line in frame.stats["explain"].splitlines():
        yield line
        yield from (f"    {found}" for found in known.get(line.split("  ")[0], ()))


@click.command()
@click.option("-o", "--output", required=True, type=click.Path(path_type=Path), help=".png .jpg .exr .hdr .tif")
@size_option
@quality_option
@backend_option
@scene_options
@tone_option
@exposure_option
@click.option("--reference", is_flag=True, help="Ray-cast in float64 NumPy, without OpenGL: slow and exact.")
@click.option("--samples", type=click.IntRange(min=1), metavar="N", help="Samples a pixel of --reference.")
@click.option("--show", type=click.Choice(list(SHOWN)), help="Show this in place of light (docs/filtering.md).")
@click.option("--explain", is_flag=True, help="Print what the plan chose, and why.")
@click.option(
    "--measured",
    type=click.Path(path_type=Path),
    metavar="DIR",
    help="With --explain: what glbump trade found.",
)
@json_option
@common
def render(
    session: Session,
    scene: Path,
    output: Path,
    size: tuple[int, int],
    quality: str | Quality,
    backend: str | None,
    settings: tuple[str, ...],
    tone: str,
    exposure: float,
    reference: bool,
    samples: int | None,
    show: str | None,
    explain: bool,
    measured: Path | None,
    as_json: bool,
) -> None:
    """Draw one picture of a scene file.

    \b
    glbump render scene.toml -o ball.png --size 1024x1024
    glbump render scene.toml -o ball.exr --set surface.0.bump.amplitude=0.1
    glbump render scene.toml -o truth.png --reference --samples 64
    glbump render scene.toml -o levels.png --show level
    glbump render scene.toml -o ball.png --explain --measured out/trade
    """
    from glbump.maps.files import check_target
    from glbump.scene import check_size
    from glbump.scenefile import files_of, load_scene, set_from_text

    if samples is not None and not reference:
        raise click.UsageError("--samples is of --reference; choose --quality otherwise")
    if explain and reference:
        raise click.UsageError("--explain is of the plan, and --reference has none")
    if measured is not None and not explain:
        raise click.UsageError("--measured is of --explain; give both")
    size = check_size(size)
    content = set_from_text(load_scene(scene), *settings)
    check_target(output, tone=tone, exposure=exposure, inputs=files_of(content))
    facts = None
    if measured is not None:
        from glbump.trade.report import read_facts

        facts = read_facts(measured, content)
    with progress("casting rays" if reference else "drawing", shown=not session.quiet):
        if reference:
            from glbump.reference import render as render_reference

            frame = render_reference(content, size=size, samples=samples or 16, show=show)
        else:
            from glbump.gl.renderer import render as render_gl

            frame = render_gl(content, size=size, quality=quality, backend=backend or "auto", show=show)
    frame.save(output, tone=tone, exposure=exposure)
    if as_json:
        # What the reference says of each pixel is not for people to read.
        stats = {k: v for k, v in frame.stats.items() if not hasattr(v, "shape")}
        print_json({"path": output, "size": frame.size, "stats": stats})
    else:
        session.say(f"{output}  {frame.size[0]}x{frame.size[1]}")
        for line in _explained(frame, facts) if explain else ():
            session.say(line)
    for note in frame.stats.get("notes", ()):
        session.note(note)
