"""`glbump normals`: heights to a normal map."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

import click

from glbump.commands.options import Session, checked, common, json_option, print_json, word
from glbump.progress import progress

if TYPE_CHECKING:
    from glbump.maps.normals import Tilts

AMPLITUDE = 0.05
"""Of integers, in widths of the tile, unless told: what no file says is said to be assumed."""


def _lengths(text: str) -> tuple[float, float | None]:
    """ "2" or "2,1": lengths above 0."""
    words = text.split(",")
    try:
        lengths = [float(word) for word in words]
    except ValueError:
        lengths = []
    if not (1 <= len(lengths) <= 2 and all(0 < length < float("inf") for length in lengths)):
        raise ValueError(f"a length above 0, or two as 2,1; got {text!r}")
    return lengths[0], lengths[1] if len(lengths) > 1 else None


def _finite(value: float) -> float:
    if not abs(value) < float("inf"):
        raise ValueError(f"an amplitude is a finite length; got {value:g}")
    return value


@click.command()
@click.argument("height", metavar="HEIGHT", type=click.Path(path_type=Path))
@click.option(
    "-o", "--output", required=True, type=click.Path(path_type=Path), help=".png, .tif or .exr: the normal map."
)
@click.option(
    "--amplitude",
    type=float,
    metavar="A",
    callback=checked(_finite),
    help="Length of the whole range of integers (default 0.05 of the tile's width), or of 1 of floats (default 1).",
)
@click.option(
    "--tile-size",
    metavar="SX[,SY]",
    callback=checked(_lengths),
    help="Width and height of the picture in the amplitude's unit; default 1, and square texels.",
)
@click.option(
    "--pixel-size",
    metavar="P[,PY]",
    callback=checked(_lengths),
    help="Instead: size of a pixel in that unit, as of elevations in metres.",
)
@click.option(
    "--kernel",
    default="central",
    metavar="K",
    callback=word("gradient kernel", "glbump.maps.gradients", "METHODS"),
    help="forward, central (default), sobel, scharr, fourth, bspline or spectral.",
)
@click.option(
    "--wrap",
    default="wrap",
    metavar="B",
    callback=word("border", "glbump.maps.bspline", "BORDERS"),
    help="What lies beyond the picture: wrap (default: it repeats), clamp or mirror.",
)
@click.option(
    "--format",
    metavar="F",
    help="rgb8, rgb16, oct24 (.png); these, rg8, rg16, oct16, oct32 and float (.tif); half and float (.exr). "
    "Default: rgb8, rgb16 and half.",
)
@click.option("--flip-y", is_flag=True, help="+Y points down, as DirectX has it.")
@click.option(
    "--channel", type=click.Choice(["r", "g", "b", "a"]), help="That holds the heights of a coloured picture."
)
@json_option
@common
def normals(
    session: Session,
    height: Path,
    output: Path,
    amplitude: float | None,
    tile_size: tuple[float, float | None] | None,
    pixel_size: tuple[float, float | None] | None,
    kernel: str,
    wrap: str,
    format: str | None,
    flip_y: bool,
    channel: str | None,
    as_json: bool,
) -> None:
    """Turn heights into a normal map, in world units, and say how it tilts and what its format costs.

    \b
    glbump normals bricks.png -o bricks-normal.png --amplitude 0.02 --tile-size 1.5
    glbump normals bricks.png -o bricks-normal.exr --kernel bspline
    glbump normals elevation.tif -o elevation-normal.png --pixel-size 30 --wrap clamp

    Bands of the picture are worked on by every core, so .png and .tif of any size take little memory; bspline and
    spectral take the whole. +Y points up, as in OpenGL and glTF; flat is (128, 128, 255), exactly.
    """
    from glbump.maps.normals import Ways, bands, format_for, write_normals
    from glbump.maps.rows import open_heights

    if tile_size is not None and pixel_size is not None:
        raise click.UsageError("--tile-size and --pixel-size say one thing; give one of them")
    format = format_for(output, format)
    with open_heights(height, channel) as heights:
        size = heights.width, heights.height
        texel = _texel(size, tile_size, pixel_size)
        if amplitude is None:
            amplitude = 1.0 if heights.full == 1 else AMPLITUDE * texel[0] * size[0]
            meant = "a height of 1" if heights.full == 1 else f"the whole range of {heights.full:g}"
            session.note(
                f"no --amplitude: {meant} is taken as {amplitude:g}, where the tile is {texel[0] * size[0]:g} wide"
            )
        ways = Ways(amplitude, texel, kernel, wrap, format, flip_y)
        with progress("normals", bands(heights), shown=not session.quiet) as step:
            tilts = write_normals(heights, ways, output, step, [height])
    for note in _notes(tilts):
        session.note(note)
    figures = _figures(ways.format, tilts)
    if as_json:
        print_json({"file": output, "size": size, **asdict(ways), **figures, "notes": _notes(tilts)})
    else:
        mean, worst, cost, cost_worst = figures.values()
        session.say(
            f"{output}  {size[0]}x{size[1]} {format}, {kernel}, {wrap}: tilts by {mean:.3g} degrees on average, "
            f"at most {worst:.3g}; {format} costs {cost:.2g} on average, at most {cost_worst:.2g}"
        )


def _texel(
    size: tuple[int, int], tile: tuple[float, float | None] | None, pixel: tuple[float, float | None] | None
) -> tuple[float, float]:
    """Width and height of a texel; square ones where one length is given."""
    if pixel is not None:
        return pixel[0], pixel[1] or pixel[0]
    width, height = tile or (1.0, None)
    return width / size[0], width / size[0] if height is None else height / size[1]


def _figures(format: str, tilts: Tilts) -> dict[str, float]:
    """Degrees: how the map tilts, and what its format costs such tilts."""
    from glbump.maps.encodings import ENCODINGS

    encoding = ENCODINGS[format]
    near = tilts.worst <= 45
    return {
        "tilt_mean": tilts.mean,
        "tilt_worst": tilts.worst,
        "cost_mean": encoding.mean_45 if near else encoding.mean,
        "cost_worst": encoding.worst_45 if near else encoding.worst,
    }


def _notes(tilts: Tilts) -> list[str]:
    if tilts.worst == 0:
        return ["the map is flat: the heights are the same everywhere, or the amplitude is nothing beside the texels"]
    if tilts.first_steep is not None:
        row, column = tilts.first_steep
        return [
            f"{tilts.steep} of {tilts.count} normals (first at row {row}, column {column}) were steeper than 89.43 "
            "degrees, and are written as steep as that; are --amplitude and --tile-size in one unit?"
        ]
    return []
