"""`glbump tune`: the cheapest setting that keeps a promise."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from glbump.commands.options import (
    Session,
    backend_option,
    common,
    error_of_word,
    json_option,
    print_json,
    scene_options,
    size_option,
    word,
)

if TYPE_CHECKING:
    from glbump.trade.tune import Tuned


@click.command()
@click.option("--max-error", metavar="E", callback=error_of_word, help="As 0.5/255: the cheapest that is as near.")
@click.option("--max-ms", type=float, metavar="T", help="Milliseconds a frame: the nearest that is as fast.")
@click.option(
    "--metric",
    default="rmse",
    metavar="M",
    callback=word("metric", "glbump.trade.tune", "METRICS"),
    help="rmse (default), p99, max or flip.",
)
@click.option("-o", "--output", type=click.Path(path_type=Path), metavar="FILE", help="The quality file to write.")
@size_option
@backend_option
@scene_options
@json_option
@common
def tune(
    session: Session,
    scene: Path,
    max_error: float | None,
    max_ms: float | None,
    metric: str,
    output: Path | None,
    size: tuple[int, int],
    backend: str | None,
    settings: tuple[str, ...],
    as_json: bool,
) -> None:
    """Find the fastest setting within an error, or the nearest to the truth within a time.

    \b
    glbump tune scene.toml --max-error 0.5/255 --size 1024x1024 -o quality.toml
    glbump tune scene.toml --max-ms 4
    glbump render scene.toml -o ball.png --quality quality.toml

    Settings are drawn, timed and compared with the scene's truth here and now; what was measured is remembered for
    this scene, size and driver.
    """
    from glbump.maps.files import check_writable
    from glbump.progress import progress
    from glbump.qualityfile import save_quality
    from glbump.scene import check_size
    from glbump.scenefile import load_scene, set_from_text
    from glbump.trade.tune import tuned

    if (max_error is None) == (max_ms is None):
        raise click.UsageError("give one of --max-error and --max-ms")
    content = set_from_text(load_scene(scene), *settings)
    size = check_size(size)
    if output is not None:
        check_writable(output)
    with progress("tuning", shown=not session.quiet):
        found = tuned(content, max_error=max_error, max_ms=max_ms, size=size, metric=metric, backend=backend or "auto")
    if output is not None:
        save_quality(found.quality, output, _said(found, size))
    if as_json:
        print_json(found)
        return
    for line in _said(found, size):
        session.say(line)
    for note in found.notes:
        session.note(note)


def _said(found: Tuned, size: tuple[int, int]) -> list[str]:
    """What was found, in lines."""

    def shown(error: float) -> str:
        return f"{error:.3g}" if found.metric == "flip" else f"{255 * error:.3g}/255"

    changes = ", ".join(f"{name} = {value}" for name, value in found.changes.items())
    return [
        f"{found.quality.preset}{' with ' + changes if changes else ''}",
        f"{found.metric} {shown(found.error)} (the truth may itself be off by {shown(found.noise)}), "
        f"{found.ms:.3g} ms a frame of {size[0]}x{size[1]}",
        f"from views that it was not tuned on: {', '.join(map(shown, found.views))}",
        f"{found.driver}; " + ("remembered from before" if found.remembered else f"{len(found.tried)} settings tried"),
    ]
