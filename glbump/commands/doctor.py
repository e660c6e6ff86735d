"""`glbump doctor`: what OpenGL there is here."""

from __future__ import annotations

import click

from glbump.commands.options import Session, common, json_option, print_json
from glbump.progress import progress


@click.command()
@click.option("--stability", is_flag=True, help="Try the formulas at their extremes on this driver instead.")
@json_option
@common
def doctor(session: Session, stability: bool, as_json: bool) -> None:
    """Say what OpenGL there is here, what it really does, and what to do where it is missing.

    \b
    glbump doctor
    glbump doctor --json
    glbump doctor --stability
    """
    if stability:
        _stability(session, as_json)
        return
    from glbump.gl.doctor import healthy, report, text

    with progress("trying every route to OpenGL", shown=not session.quiet):
        findings = report()
    if as_json:
        print_json(findings)
    else:
        click.echo(text(findings))
    if not healthy(findings):
        click.get_current_context().exit(1)


def _stability(session: Session, as_json: bool) -> None:
    from glbump.gl.context import open_context
    from glbump.gl.stability import stability_report, stability_text
    from glbump.glsltest.stability import report

    with open_context() as context, progress("trying the extremes", shown=not session.quiet):
        rows = report(context) + stability_report(context)
    if as_json:
        # An infinite error is no JSON number: null.
        print_json(
            [
                {"name": r.name, "naive": r.naive, "glbump": r.used, "bound": r.bound, "unit": r.unit, "holds": r.holds}
                for r in rows
            ]
        )
    else:
        click.echo(stability_text(rows))
    if not all(row.holds for row in rows):
        click.get_current_context().exit(1)
