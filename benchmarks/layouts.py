"""What each layout costs a panorama: there and back again in equal memory, and the step across its edges."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from benchmarks.figures import Cell, Section, Table, Target
from benchmarks.scenes import PANORAMAS, panoramas
from glbump.demo.panorama import evening
from glbump.maps.continuity import seam_step
from glbump.maps.convert import FILTERS, Filter, convert
from glbump.maps.layout import (
    LATLONG,
    LAYOUTS,
    EnvironmentMap,
    Layout,
    above,
    completed,
    texel_dirs,
)
from glbump.maps.levels import environment_levels

F64 = npt.NDArray[np.float64]

CLIP = 4.0
"""Radiance counts from 0 up to here."""

SEAM = 1.05
"""Most that the step across an edge may be of the one beside it, of a smooth environment."""

LEAST = 16
"""Texels along a tile that SEAM is promised from. Smaller tiles' texels are so long that beside an edge is no place
like it: the function's own values have such steps there too."""


def resized_panoramas(quick: bool) -> dict[str, EnvironmentMap]:
    """The photographed panoramas that there are, as lat-long pictures on texel centres; else the demo's."""
    height = {name: 32 if quick else 512 if name == "KernerEnv" else 256 for name in PANORAMAS}
    found = {name: convert(picture, LATLONG, height[name], "area") for name, picture in panoramas().items()}
    return found or {"evening": EnvironmentMap(LATLONG, evening(32 if quick else 256)[None])}


def equal_size(layout: Layout, texels: int) -> int:
    """The even size at which the layout's picture has nearest to so many texels: of a layout of the upper half nearest
    to half of them, and of a disc only those inside count."""
    wanted = texels if layout.whole else texels / 2
    tiles, rows, columns = layout.shape(1000)
    per_square = tiles * rows * columns / 1e6 * (np.pi / 4 if layout.disc else 1)
    return 2 * round(np.sqrt(wanted / per_square) / 2)


def differences(before: EnvironmentMap, after: EnvironmentMap, upper: bool) -> dict[str, float]:
    """RMSE by solid angle and the largest, of radiance clipped to 0..CLIP; upper: above the horizon."""
    a, b = (np.clip(e.pixels[0], 0, CLIP).astype(np.float64) for e in (before, after))
    rows = len(a) // 2 if upper else len(a)
    square = np.square(a - b)[:rows]
    edges = np.cos(np.arange(len(a) + 1) * (np.pi / len(a)))
    weight = -np.diff(edges)[:rows]
    rmse = np.sqrt((square.mean(axis=(1, 2)) * weight).sum() / weight.sum())
    return {"RMSE": round(float(rmse), 9), "largest": round(float(np.sqrt(square.max())), 9)}


def round_trip(environment: EnvironmentMap, layout: Layout, filter: Filter) -> tuple[EnvironmentMap, dict[str, float]]:
    """In the layout, and what of the lat-long picture did not come back."""
    _, height = environment.size
    there = convert(environment, layout, equal_size(layout, 2 * height * height), filter)
    back = convert(there, LATLONG, height, filter)
    return there, differences(environment, back, not layout.whole) | {"seam": _step(there)}


def _step(environment: EnvironmentMap) -> float:
    """The seam step, without the noise of rounding."""
    return round(seam_step(environment), 3)


def smooth(layout: Layout, size: int) -> EnvironmentMap:
    """A function of the second degree of the direction, at the texels' centres."""
    _, height, width = layout.shape(size)
    d = above(layout, texel_dirs(layout, (width, height)))
    x, y, z = np.moveaxis(d, -1, 0)
    values = np.stack([1 + 0.5 * x + 0.3 * y * z, 1 + 0.4 * y - 0.2 * x * z, 1 + 0.5 * z + 0.3 * x * y], axis=-1)
    return EnvironmentMap(layout, completed(layout, values.astype(np.float32)))


def level_steps(layout: Layout, size: int) -> dict[int, tuple[float, float]]:
    """By the texels along a tile: the seam step of each level, and of the function's own values at that size."""
    steps = {}
    for level in environment_levels(smooth(layout, size)):
        texels = level.shape[2] // layout.aspect if layout.name != "hemicube" else level.shape[2]
        if texels >= 4:
            steps[texels] = _step(EnvironmentMap(layout, level)), _step(smooth(layout, texels))
    return steps


def _worst(steps: dict[int, tuple[float, float]], first: int = 0) -> float:
    """Of the levels from `first` on."""
    return max(pair[0] for size, pair in list(steps.items())[first:] if size >= LEAST)


def measure(quick: bool = False) -> Section:
    """Photographed panoramas of 512x256 and 1024x512 (quick: 64x32)."""
    environments = resized_panoramas(quick)
    rows: list[list[Cell]] = []
    for layout in LAYOUTS.values():
        sizes = [equal_size(layout, e.size[0] * e.size[1]) for e in environments.values()]
        memory = " ".join(f"{np.prod(layout.shape(size)) * 12 / 2**20:.3g}" for size in dict.fromkeys(sizes))
        for filter in FILTERS:
            found = [round_trip(e, layout, filter)[1] for e in environments.values()]
            figures: list[Cell] = [one[kind] for kind in ("RMSE", "largest", "seam") for one in found]
            rows.append([layout.name, " ".join(map(str, dict.fromkeys(sizes))), memory, filter, *figures])
    steps = {layout: level_steps(layout, 64 if quick else 256) for layout in LAYOUTS.values()}
    level_rows: list[list[Cell]] = [
        [layout.name, what, *(pair[i] for pair in found.values())]
        for layout, found in steps.items()
        for i, what in enumerate(("level", "values"))
    ]
    heads = [f"{name}, {kind}" for kind in ("RMSE", "largest", "seam") for name in environments]
    return Section(
        "Layouts: there and back in equal memory",
        TEXT,
        (
            Table(("layout", "size", "MiB", "filter", *heads), rows),
            Table(("layout", "of", *map(str, next(iter(steps.values())))), level_rows),
        ),
        [
            *(
                Target.at_most(f"{layout.name}: seam step of levels, {LEAST} texels and more", _worst(found), SEAM)
                for layout, found in steps.items()
            ),
            Target.at_most("lat-long: the same, but for the picture itself", _worst(steps[LATLONG], 1), SEAM),
        ],
    )


TEXT = (
    "From lat-long to the layout and back by the same filter. Size: of the layout's tile, at which its picture has "
    "about as many texels as the lat-long's (of a disc those inside count; a layout of the upper half has half as "
    "many, and only what lies above the horizon is compared); MiB: as stored, three floats a texel, corners of "
    "discs included; two figures where the panoramas are of two sizes. RMSE by solid angle and largest difference, "
    f"radiance clipped to 0..{CLIP:g}. Seam: the step across the worst edge of the layout over the typical one beside "
    "it (`glbump.maps.continuity.seam_step`), here of the photograph in the layout: contrast that happens to lie on "
    "an edge counts, and so do the stairs that `area` makes where the layout is finer than the picture. Steps of 0 "
    "are those of layouts that mirror the upper half below the horizon. What the layouts themselves do is in the "
    "second table: steps of a smooth environment, of each mip level and of the function's own values at its size. The "
    "2 of a lat-long's values, and of its level 0, which are these, is at its poles, where textures repeat the last "
    "row, half a texel long, instead of going on beyond; across its sides it is 1. Levels that are made from it are "
    "mended there (`glbump.maps.poles`)."
)

if __name__ == "__main__":
    from benchmarks.command import alone

    alone(measure)
