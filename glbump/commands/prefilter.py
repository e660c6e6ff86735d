"""`glbump prefilter`: an environment blurred for rough and for diffuse surfaces."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import click

from glbump.commands.options import Session, checked, common, json_option, print_json, read_options
from glbump.progress import progress


def _power_of_two(size: int) -> int:
    if size < 8 or size > 4096 or size & (size - 1):
        raise ValueError(f"the size of a chain is a power of two from 8 to 4096; got {size}")
    return size


@click.command()
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path),
    help="The roughness chain: .ktx2 or .dds, a cube map with levels; .exr, a file NAME_0, NAME_1, ... a level.",
)
@click.option("--sh", type=click.Path(path_type=Path), help="Nine harmonics of diffuse light, as JSON.")
@read_options
@click.option(
    "--size",
    type=int,
    default=256,
    metavar="N",
    callback=checked(_power_of_two),
    help="Pixels along a face of level 0, a power of two; default 256. The last level's are 4.",
)
@click.option(
    "--samples",
    type=click.IntRange(1, 4096),
    default=64,
    metavar="N",
    help="Texels that a texel of level 1 reads where its lobe is high; each further level twice as many; default 64.",
)
@click.option(
    "--suns",
    type=click.Choice(["kept", "apart"]),
    default="kept",
    help="Small, very bright lights: blurred with the rest (default), or taken out and listed.",
)
@json_option
@common
def prefilter(
    session: Session,
    files: tuple[Path, ...],
    output: Path | None,
    sh: Path | None,
    source: str,
    orientation: str,
    size: int,
    samples: int,
    suns: str,
    as_json: bool,
) -> None:
    """Blur an environment for rough surfaces, and sum it for diffuse ones.

    \b
    glbump prefilter panorama.exr -o sky.ktx2
    glbump prefilter panorama.exr -o sky.dds --size 128 --sh sky.json --suns apart
    glbump prefilter sky_{face}.png -o sky.exr

    Level i is what a surface of roughness i / (levels - 1) mirrors, GGX with alpha its square, looked up by the mirror
    direction; level 0 is the environment itself.
    """
    if output is None and sh is None:
        raise click.UsageError("say what to write: -o for the roughness chain, --sh for the harmonics")
    from glbump.maps import chains, conversion
    from glbump.maps.diffuse import sh9
    from glbump.maps.files import check_writable
    from glbump.maps.gloss import gloss_chain
    from glbump.maps.suns import Parted, part

    inputs = conversion.input_files(files)
    if output is not None:
        chains.check_chain(output, size.bit_length() - 2, inputs)
    if sh is not None:
        check_writable(sh, inputs)
    with progress("prefiltering", shown=not session.quiet):
        read = conversion.read_environment(inputs, source, orientation)
        parted = part(read.environment) if suns == "apart" else Parted(read.environment, ())
        levels = gloss_chain(parted.rest, size, samples) if output is not None else []
        content = chains.harmonics(sh9(parted.rest), parted.suns, apart=suns == "apart")
        if output is not None:
            chains.write_chain(output, levels, wide=read.is_wide)
        if sh is not None:
            chains.write_harmonics(sh, content)
    written = [*(chains.chain_files(output, len(levels)) if output else ()), *([sh] if sh else ())]
    table = [_row(level, number, len(levels)) for number, level in enumerate(levels)]
    if as_json:
        print_json({"files": written, "levels": table, "harmonics": content, "notes": read.environment.notes})
    else:
        _print(session, written, table, content)
    for note in read.environment.notes:
        session.note(note)


def _row(level: Any, number: int, count: int) -> dict[str, Any]:
    """What a level is for, and its light: the mean over all directions is every level's alike."""
    from glbump.maps.cube import solid_angles

    n = level.shape[1]
    mean = (level * solid_angles(n)[None, :, :, None]).sum(axis=(0, 1, 2)) / (4 * math.pi)
    return {"size": n, "roughness": number / (count - 1), "mean": mean.tolist(), "largest": float(level.max())}


def _print(session: Session, written: list[Path], table: list[dict[str, Any]], content: dict[str, Any]) -> None:
    session.say(", ".join(map(str, written)))
    if table:
        session.say(f"{'level':>5}{'faces':>7}{'roughness':>11}{'red':>12}{'green':>12}{'blue':>12}{'largest':>12}")
    for number, row in enumerate(table):
        light = "".join(f"{x:12.6g}" for x in [*row["mean"], row["largest"]])
        session.say(f"{number:5}{row['size']:7}{row['roughness']:11.4g}{light}")
    for sun in content["apart"]:
        x, y, z = sun["direction"]
        light = " ".join(f"{value:.5g}" for value in sun["irradiance"])
        session.say(
            f"sun apart: towards {x:.4f} {y:.4f} {z:.4f}, irradiance {light}, {sun['radius_degrees']:.2g} degrees"
        )
