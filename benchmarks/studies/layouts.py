"""Layouts of environments in equal memory: what each keeps of a panorama, and what a mirror ball shows of it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.figures import Cell, Section, Table
from benchmarks.layouts import CLIP, equal_size, resized_panoramas, round_trip
from benchmarks.scenes import mirror_ball
from benchmarks.studies.settings import GAIN, few, save, table
from glbump.environment import CubeMap, Environment, Hemisphere, LatLong, LightProbe, Octahedral
from glbump.maps.colour import display_bytes
from glbump.maps.convert import convert
from glbump.maps.layout import LATLONG, LAYOUTS, EnvironmentMap
from glbump.maps.pictured import picture_of
from glbump.quality import Quality

SHRUNK = 4
"""Layouts hold one texel of so many of the panorama."""

WHOLE: dict[str, Callable[[Any], Environment]] = {
    "lat-long": LatLong,
    "cube": lambda faces: CubeMap(faces, orientation="opengl"),
    "octahedral": Octahedral,
    "dual-paraboloid": lambda discs: Hemisphere(discs, "dual-paraboloid"),
    "angular": LightProbe,
    "mirror-ball": lambda disc: LightProbe(disc, "mirror-ball"),
}
"""Layouts of the whole sphere, as environments of a scene."""


def _environment(light: EnvironmentMap) -> Environment:
    name = light.layout.name
    return WHOLE[name](light.pixels if name == "cube" else picture_of(light, name))


def _picture(folder: Path, light: EnvironmentMap) -> str:
    """The layout as it lies in memory, about 100 pixels high."""
    name = light.layout.name
    laid = picture_of(light, "hcross" if name == "cube" else name)
    step = max(1, len(laid) // 100)
    rows, columns = (n // step * step for n in laid.shape[:2])
    small = laid[:rows, :columns].reshape(rows // step, step, columns // step, step, -1).mean(axis=(1, 3))
    return save(folder / f"layouts-{name}.png", display_bytes(small[..., :3].astype(np.float32)))


def study(folder: Path, quick: bool = False) -> Section:
    """A mirror ball, 160x160 (quick: 12x12), in panoramas of 1/4 of the texels."""
    size, turns = ((12, 12), 1) if quick else ((160, 160), 15)
    name, panorama = list(resized_panoramas(quick).items())[-1]
    texels = panorama.size[0] * panorama.size[1] // SHRUNK
    lights = {n: convert(panorama, LAYOUTS[n], equal_size(LAYOUTS[n], texels), "area") for n in WHOLE}
    rows = {n: (mirror_ball(_environment(light)), Quality("balanced")) for n, light in few(lights, quick).items()}
    truth = mirror_ball(LatLong(panorama.pixels[0])), Quality("exact", samples=64)
    height = round((texels / 2) ** 0.5)
    small = convert(panorama, LATLONG, height, "area")
    kept: list[list[Cell]] = []
    for layout in few(LAYOUTS, quick).values():
        laid, off = round_trip(small, layout, "area")
        shown = _picture(folder, lights[layout.name]) if layout.name in WHOLE else ""
        shape = "x".join(map(str, reversed(laid.pixels.shape[:3])))
        kept.append([layout.name, shown, shape, laid.pixels.nbytes / 2**20, off["RMSE"], off["largest"], off["seam"]])
    return Section(
        "Environment layouts in equal memory",
        "Which layout to keep an environment in. The panorama "
        f"`{name}`, {panorama.size[0]}x{panorama.size[1]}, is resampled to each layout of the whole sphere with a "
        f"quarter of its texels ({texels}; of discs those inside count), and a mirror ball is drawn in it by "
        "`balanced`; the truth is the ball in the whole panorama, 64 samples a pixel. So the error is what fewer "
        "texels leave out, and where the layout has spent them: a lat-long's crowd at the poles, a mirror ball's rim "
        "is one direction, a cube's and an octahedron's are spread evenly within 5.2 times. Times are of frames over "
        "the lat-long's: a lat-long takes two arc tangents a look-up, a cube none. MiB counts levels and the ball, "
        "which mostly shows what lies behind the eye (+Z): another scene asks for other places. "
        f"Error pictures are {GAIN} times.\n\n"
        f"Second, all layouts at {2 * height}x{height} texels' worth: there and back again by area; RMSE by solid "
        f"angle, of radiance clipped to {CLIP:g}; seam, the step across the layout's worst edge over a typical one "
        "beside it. Of layouts of the upper half only that is compared, in half the memory. More, and what mip levels "
        "do at seams: [benchmarks](../benchmarks.md#layouts-there-and-back-in-equal-memory).",
        (
            table(folder, "layouts", truth, rows, size, turns),
            Table(("layout", "as it lies", "texels", "MiB, floats", "RMSE", "largest", "seam"), kept),
        ),
    )
