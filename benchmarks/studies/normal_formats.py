"""What each way to store normals shows on a mirror, in degrees, and in memory."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from benchmarks.figures import Cell, Section, Table
from benchmarks.kernels import normals
from benchmarks.normal_formats import errors, there_and_back
from benchmarks.studies.settings import GAIN, few, table
from benchmarks.studies.waves import SLOPE, mirror, of_waves
from glbump.maps.encodings import ENCODINGS
from glbump.quality import KNOBS, Quality
from glbump.scene import NormalMap

TEXELS = 16
"""Of the shortest wave."""


def _angles(count: int) -> Table:
    rows: list[list[Cell]] = []
    for name in ("rgb8, 2 c - 1", *ENCODINGS):
        all_tilts = round(ENCODINGS[name].reach) if name in ENCODINGS else 180
        near, far = (errors(name, reach, count) for reach in (min(45, all_tilts), all_tilts))
        rows.append([name, there_and_back(name)[1], *near, all_tilts, *far])
    head = ("format", "bytes", "to 45 degrees: mean", "largest", "holds tilts to", "mean", "largest")
    return Table(head, rows)


def study(folder: Path, quick: bool = False) -> Section:
    """A normal map of gentle waves on a mirror, 160x160 (quick: 12x12)."""
    size, turns, count = ((12, 12), 1, 500) if quick else ((160, 160), 15, 100_000)
    scene = mirror(NormalMap(normals(of_waves(TEXELS)[1]).astype(np.float32)[::-1]), 0.5)
    formats = KNOBS["bump_format"].values
    rows = {name: (scene, Quality("balanced", bump_format=name)) for name in reversed(formats)}
    return Section(
        "How normals are stored",
        "A mirror turns an angle of its normal into twice that angle of what it shows, so it tells formats apart that "
        f"plaster does not. A normal map of gentle waves (rms slope {SLOPE:g}, {TEXELS} texels the shortest) in each "
        f"`bump_format`, against itself in floats: errors are of the format alone, their pictures {GAIN} times. "
        "`slopes8` and `slopes16` spread their codes over the slopes that the map has, so a gentle map loses less; "
        "`rg8` spends its codes on tilts that are not there; octahedral formats cannot be filtered by the driver and "
        "cost four reads. MiB is of all textures and vertices, the environment's included. The second table has "
        f"the angles by themselves, in degrees, over {count} chance directions each: of tilts to 45 degrees, then of "
        "all that the format holds; `python -m benchmarks normal_formats` takes a million, beside what others found.",
        (table(folder, "normal_formats", rows["float"], few(rows, quick), size, turns), _angles(count)),
    )
