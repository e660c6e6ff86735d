"""`glbump convert`: an environment in another layout."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from glbump.commands.options import Session, checked, common, json_option, print_json, read_options, word
from glbump.progress import progress

if TYPE_CHECKING:
    from glbump.maps.convert import Filter, Ledger
    from glbump.maps.layout import Layout


def _positive(value: float) -> float:
    if not value > 0:
        raise ValueError(f"a clamp is a radiance above 0; got {value:g}")
    return value


@click.command()
@click.option(
    "-o", "--output", required=True, type=click.Path(path_type=Path), help=".exr .hdr .tif .ktx2 .dds; .png .jpg clip."
)
@click.option(
    "--to",
    required=True,
    metavar="LAYOUT",
    callback=word("layout", "glbump.maps.conversion", "TARGETS"),
    help="cube, hcross, vcross, hstrip, vstrip, faces, lat-long, hemicube, hemisphere, octahedral, angular or "
    "mirror-ball.",
)
@read_options
@click.option(
    "--to-orientation",
    default="auto",
    metavar="O",
    callback=word("orientation of cube faces", "glbump.maps.pictured", "READINGS"),
    help="Of the cube that is written: opengl, inside or auto: inside for crosses, else opengl.",
)
@click.option(
    "--size",
    type=click.IntRange(min=2),
    metavar="N",
    help="Pixels: of a face's or a disc's side, a panorama's height; default: as many along 90 degrees as IN has.",
)
@click.option(
    "--filter",
    "filter",
    metavar="F",
    callback=word("filter", "glbump.maps.convert", "FILTERS"),
    help="area keeps all light, bilinear is quick; default: area when shrinking, bilinear when enlarging.",
)
@click.option(
    "--projection",
    metavar="P",
    callback=word("projection of a hemisphere", "glbump.maps.conversion", "PROJECTIONS"),
    help="Of --to hemisphere: equal-area (default), equidistant, orthographic or dual-paraboloid.",
)
@click.option(
    "--clamp", type=float, metavar="X", callback=checked(_positive), help="Cut radiance above X off, and say how much."
)
@click.option("--levels/--no-levels", default=None, help="All mip levels in .ktx2 and .dds, or the largest alone.")
@json_option
@common
def convert(
    session: Session,
    files: tuple[Path, ...],
    output: Path,
    to: str,
    source: str,
    orientation: str,
    to_orientation: str,
    size: int | None,
    filter: Filter | None,
    projection: str | None,
    clamp: float | None,
    levels: bool | None,
    as_json: bool,
) -> None:
    """Lay an environment out another way, and account for its light.

    \b
    glbump convert panorama.exr -o sky.ktx2 --to cube
    glbump convert panorama.exr -o sky.exr --to faces --size 512
    glbump convert cross.png -o panorama.exr --to lat-long --from hcross
    glbump convert sky_{face}.png -o disc.exr --to hemisphere --projection orthographic

    faces writes NAME_px, _nx, _py, _ny, _pz and _nz. What was detected and assumed is said on standard error.
    """
    from glbump.maps import conversion
    from glbump.maps.convert import ledger

    layout = _target(output, to, to_orientation, projection, levels)
    inputs = conversion.input_files(files)
    conversion.check_written(output, to, layout, inputs)
    with progress("converting", shown=not session.quiet):
        read = conversion.read_environment(inputs, source, orientation)
        before = read.environment
        after, how = conversion.same_or_converted(
            before, layout, size or conversion.same_detail(before, layout), filter, clamp
        )
        account = ledger(before, after, clamp)
        notes = conversion.write_environment(
            output, after, to, orientation=to_orientation, levels=levels is not False, wide=read.is_wide
        )
    notes = [*before.notes, *conversion.half_notes(before, after), *notes]
    written = conversion.written_files(output, to)
    if as_json:
        print_json(
            {
                "from": before.layout.name,
                "to": to,
                "layout": after.layout.name,
                "files": written,
                "size": after.size,
                "filter": how,
                "ledger": {**asdict(account), "error": account.error},
                "notes": notes,
            }
        )
    else:
        width, height = after.size
        tiles = f"{layout.tiles} x " if layout.tiles > 1 else ""
        session.say(f"{', '.join(map(str, written))}  {to} {tiles}{width}x{height}, {how}")
        _print_ledger(session, account)
    for note in notes:
        session.note(note)


def _target(output: Path, to: str, orientation: str, projection: str | None, levels: bool | None) -> Layout:
    """The layout that is written; UsageError for options that say nothing of it."""
    from glbump.maps.containers import TEXTURE_SUFFIXES
    from glbump.maps.conversion import target_layout

    if projection is not None and to != "hemisphere":
        raise click.UsageError("--projection is of --to hemisphere")
    is_texture = output.suffix.lower() in TEXTURE_SUFFIXES
    if levels is not None and not is_texture:
        raise click.UsageError(f"--levels and --no-levels are of {' and '.join(TEXTURE_SUFFIXES)}")
    layout = target_layout(to, projection or "equal-area")
    if orientation != "auto" and (is_texture or layout.name not in ("cube", "hemicube")):
        raise click.UsageError("--to-orientation is of cubes in pictures")
    return layout


def _print_ledger(session: Session, account: Ledger) -> None:
    """The light before and after, summed over directions, and what became of the rest."""
    session.say(f"{'radiance':12}{'red':>14}{'green':>14}{'blue':>14}{'largest':>14}")

    def row(name: str, light: Any, largest: float | None = None) -> None:
        session.say(f"{name:12}" + "".join(f"{x:14.6g}" for x in [*light, *([] if largest is None else [largest])]))

    row("before", account.before, account.largest_before)
    for name, light in (("clamped", account.clamped), ("left out", account.left_out), ("filled", account.filled)):
        if light.any():
            row(name, light)
    row("after", account.after, account.largest_after)
    session.say(f"{'error':12}" + "".join(f"{x:14.2g}" for x in account.error))
