"""`glbump view`: the window."""

from __future__ import annotations

import signal
from functools import partial
from pathlib import Path

import click

from glbump.commands.options import Session, checked, common, quality_option, word


def _size(text: str) -> tuple[int, int]:
    from glbump.commands.options import _size as size_of
    from glbump.scene import check_size

    return check_size(size_of(text))


def _stops(value: float) -> float:
    from glbump.validate import number

    return number("exposure", value, least=-64, most=64)


@click.command()
@click.argument("file", required=False, metavar="[FILE]", type=click.Path(path_type=Path))
@click.option(
    "--size", default="1024x768", metavar="WxH", callback=checked(_size), help="Of the window; default 1024x768."
)
@quality_option
@click.option(
    "--tone",
    metavar="T",
    callback=word("tone", "glbump.maps.images", "TONES"),
    help="Tone curve: clip, reinhard or filmic; as glbump render has it, unless told.",
)
@click.option(
    "--exposure", type=float, metavar="E", callback=checked(_stops), help="Stops; as glbump render, unless told."
)
@click.option("-o", "--output", type=click.Path(path_type=Path), default=Path(), help="Folder for what is saved.")
@common
def view(
    session: Session,
    file: Path | None,
    size: tuple[int, int],
    quality: str,
    tone: str | None,
    exposure: float | None,
    output: Path,
) -> None:
    """Look at a scene in a window: turn it, fly through it, drop files on it, change its files.

    FILE is a scene, a mesh, a panorama or another environment picture, a height map or a normal map; what it is, is
    found out. Without one the gallery's scenes are shown. F1 in the window shows what keys and mouse do.

    \b
    glbump view scene.toml
    glbump view venice.exr
    glbump view bricks-height.png --quality exact
    """
    from glbump.errors import SceneError
    from glbump.viewer.opening import gallery, opened, require_there
    from glbump.viewer.window import Viewer

    if not output.is_dir():
        raise SceneError(f"{output}: there is no such folder to save in; make it first")
    if file is not None:
        require_there(file)
    opens = gallery() if file is None else (partial(opened, file),)
    viewer = Viewer(opens, size=size, quality=quality, tone=tone, exposure=exposure, folder=output)
    # An interrupt closes the window as its button does; amid a call of the driver it would end the process otherwise.
    interrupts: list[int] = []

    def close(number: int, _frame: object) -> None:
        interrupts.append(number)
        viewer.close()

    before = signal.signal(signal.SIGINT, close)
    try:
        viewer.run()
    finally:
        viewer.release()
        signal.signal(signal.SIGINT, before)
    if interrupts:
        raise KeyboardInterrupt
