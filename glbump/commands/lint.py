"""`glbump lint`: what is wrong with pictures for their use."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from glbump.commands.options import Session, common, json_option, print_json, word
from glbump.progress import progress

if TYPE_CHECKING:
    from glbump.maps.lint import Report


def _texture_side() -> int:
    """The longest side of a texture on the driver here, or on most where there is none."""
    from glbump.errors import ContextError
    from glbump.gl.context import open_context
    from glbump.maps.lint.values import TEXTURE_SIDE

    try:
        with open_context() as context:
            side: int = context.info["max_texture_size"]
            return side
    except ContextError:
        return TEXTURE_SIDE


@click.command()
@click.argument("files", nargs=-1, required=True, metavar="FILE...", type=click.Path(path_type=Path))
@click.option(
    "--as",
    "use",
    metavar="USE",
    callback=word("use of a picture", "glbump.maps.lint", "USES"),
    help="environment, height, normal-map or colour; without it found out by header, name and content.",
)
@json_option
@common
def lint(session: Session, files: tuple[Path, ...], use: str | None, as_json: bool) -> None:
    """Say what is wrong with pictures for their use: what, why it is believed, what mends it.

    \b
    glbump lint panorama.exr bricks-height.png bricks-normal.png
    glbump lint sky_px.png sky_nx.png sky_py.png sky_ny.png sky_pz.png sky_nz.png
    glbump lint panorama.exr cube.exr     do both show one place, and alike
    glbump lint scan.png --as height

    The exit status is 1 where a finding is wrong or doubtful, 0 where all are notes or nothing is found.
    With -q notes are not printed.
    """
    from glbump.maps.lint import lint as reports_of
    from glbump.maps.stored import check_file

    for file in files:
        if not (file.is_dir() or "{face}" in file.name):
            check_file(file)
    reports = []
    with progress("looking", len(files), shown=not session.quiet) as step:
        for report in reports_of(files, use, _texture_side):
            reports.append(report)
            step()
    if as_json:
        print_json(reports)
    else:
        for report in reports:
            _print(report, session.quiet)
    if any(report.is_wrong for report in reports):
        click.get_current_context().exit(1)


def _print(report: Report, quiet: bool) -> None:
    findings = [finding for finding in report.findings if not quiet or finding.severity != "note"]
    if quiet and not findings:
        return
    names = str(report.files[0]) if len(report.files) == 1 else f"{report.files[0]} and {len(report.files) - 1} more"
    click.echo(f"{names}: {report.use}, since {report.why}{'' if findings else ': nothing found'}")
    for finding in findings:
        click.echo(f"  {finding.severity}: {finding.what}\n    why:  {finding.why}\n    mend: {finding.mend}")
