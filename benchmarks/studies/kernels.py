"""How heights become slopes: each kernel in pictures of a mirror, in degrees, and in what it costs."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from benchmarks.figures import Cell, Section, Table
from benchmarks.kernels import METHODS, baked, normals, wave_errors
from benchmarks.studies.settings import GAIN, few, table
from benchmarks.studies.waves import FINE, SIDE, SLOPE, TRUTH, in_bump, mirror, of_waves
from glbump.maps.angles import degrees_between
from glbump.maps.gradients import KERNELS
from glbump.quality import Quality

WAVES = (16, 8, 4)
SETTINGS = {
    "central, baked": ("central", "baked"),
    "forward, baked": ("forward", "baked"),
    "sobel, baked": ("sobel", "baked"),
    "scharr, baked": ("scharr", "baked"),
    "fourth, baked": ("fourth", "baked"),
    "bspline, baked": ("bspline", "baked"),
    "spectral, baked": ("spectral", "baked"),
    "half, in the shader": ("half", "shader"),
    "bspline, in the shader": ("bspline", "shader"),
    "pixel to pixel, on the screen": ("central", "screen"),
}


def _angles(places: int) -> Table:
    """Rms degrees of normals at places of chance, slopes as on the mirror."""
    methods = {name: baked(name) for name in (*KERNELS, "bspline", "spectral")}
    methods |= {f"{name}, in the shader": METHODS[f"slope_{name}"][0] for name in ("half", "bspline")}
    rows: list[list[Cell]] = [[name] for name in methods]
    for texels in WAVES:
        heights, exact = of_waves(texels)
        at = np.random.default_rng(7).uniform(size=(places, 2))
        fine = methods["bspline, in the shader"](*of_waves(FINE), at)
        wanted = normals(fine / SIDE)
        for row, method in zip(rows, methods.values()):
            off = degrees_between(normals(method(heights, SIDE * exact, at) / SIDE), wanted)
            row.append(float(np.sqrt((off**2).mean())))
    return Table(("kernel", *(f"rms degrees, {texels} texels a wave" for texels in WAVES)), rows)


def _plane_waves(angles: int) -> Table:
    rows: list[list[Cell]] = []
    for name in (*KERNELS, "bspline", "spectral"):
        found = [wave_errors(name, texels, angles) for texels in WAVES]
        rows.append([name, *(f[0] for f in found), *(f"{f[1]:.2f} .. {f[2]:.2f}" for f in found)])
    heads = [f"{what}, {texels}" for what in ("direction, deg", "length, %") for texels in WAVES]
    return Table(("kernel", *heads), rows)


def study(folder: Path, quick: bool = False) -> Section:
    """A mirror with waves of 16, 8 and 4 texels, 96x96 each (quick: 12x12)."""
    size, turns, places, angles = ((12, 12), 1, 50, 3) if quick else ((96, 96), 9, 4000, 46)
    wanted = mirror(in_bump(of_waves(FINE)[0])), TRUTH
    tables = []
    for texels in WAVES[-1:] if quick else WAVES:
        scene = mirror(in_bump(of_waves(texels)[0]))
        rows = {
            f"{what}, {texels} texels a wave": (scene, Quality("exact", samples=4, bump_kernel=kernel, bump_read=read))
            for what, (kernel, read) in few(SETTINGS, quick).items()
        }
        tables.append(table(folder, f"kernels-{texels}", wanted, rows, size, turns))
    return Section(
        "How heights become slopes",
        "A kernel that reads few texels flattens short waves and turns their slopes; what shows depends on how many "
        "texels a wave has. One mirror, 98 waves of chance and an rms slope of "
        f"{SLOPE:g}, its map in three sizes: the shortest wave is 16, 8 and 4 texels long. The truth is the same "
        f"waves at {FINE} texels a wave. Level 0 and four samples throughout, so that what differs is the slopes; "
        f"errors are display-referred, their pictures {GAIN} times, times over each table's first row.\n\n"
        "`baked` slopes are known at texels and filtered between, which for waves of few texels costs more than "
        "the kernel: `bspline` and `spectral`, right at texels, show it. In the shader a kernel is taken where the "
        "map is seen. `screen` is off by as much as a pixel is large, whatever the texels. The degrees below are "
        "of the kernels alone, in float64: of normals at 4000 places of chance on this mirror, then of plane waves "
        "at texels, the worst direction and the range of lengths. More methods: "
        "[benchmarks](../benchmarks.md#gradients-of-heights).",
        (*tables, _angles(places), _plane_waves(angles)),
    )
