"""The laws behind the table of layouts: what does not come back from a layout falls with its size as it should.

A smooth environment, lat-long to the layout and back in equal memory. The table is `python -m benchmarks layouts`.
"""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.layouts import differences, equal_size, smooth
from glbump.maps import continuity
from glbump.maps.continuity import edge_lines, seam_step
from glbump.maps.convert import FILTERS, Filter, convert
from glbump.maps.layout import CUBE, LATLONG, LAYOUTS, EnvironmentMap, Layout
from glbump.maps.levels import environment_levels

OTHERS = [layout for layout in LAYOUTS.values() if layout is not LATLONG]
HEIGHTS = (32, 64, 128)

# By how much the error falls when the picture is twice as wide, measured for heights of 32, 64 and 128, and the least
# that is asked for.
# Bilinear: order 2. On discs of the upper half a ring of texels at the horizon is of order 1, which makes 3/2 of all;
# the orthographic disc has its infinite stretch there, the mirror ball at its rim: 3.47 to 4.24, 2.60 to 3.41,
# 1.53 to 1.78, 1.62 to 2.56.
# Area: order 1, since a texel that is larger than a cell gives it the mean of both: 2.03 to 2.44; 1.65 to 1.80 and 1.82
# to 2.05 of the latter two.
FALLS: dict[str, dict[str, float]] = {
    "bilinear": {"equal-area": 2.5, "equidistant": 2.8, "orthographic": 1.45, "mirror-ball": 1.55},
    "area": {"orthographic": 1.6, "mirror-ball": 1.75},
}
ORDER = {"bilinear": 3.4, "area": 1.95}


def lost(layout: Layout, height: int, filter: Filter) -> float:
    """RMSE of a round trip."""
    before = smooth(LATLONG, height)
    there = convert(before, layout, equal_size(layout, 2 * height * height), filter)
    return differences(before, convert(there, LATLONG, height, filter), not layout.whole)["RMSE"]


@pytest.mark.parametrize("filter", FILTERS)
@pytest.mark.parametrize("layout", OTHERS, ids=str)
def test_what_is_lost_falls_with_the_size(layout: Layout, filter: Filter) -> None:
    errors = [lost(layout, height, filter) for height in HEIGHTS]
    falls = [a / b for a, b in itertools.pairwise(errors)]
    assert min(falls) > FALLS[filter].get(layout.name, ORDER[filter]), (errors, falls)


@pytest.mark.parametrize("filter", FILTERS)
def test_nothing_is_lost_in_the_same_layout_and_size(filter: Filter) -> None:
    before = smooth(LATLONG, 32)
    after = convert(before, LATLONG, 32, filter)
    assert np.abs(after.pixels - before.pixels).max() < 3e-7  # rounding of values up to 2


def test_a_slip_of_half_a_texel_falls_too_slowly() -> None:
    errors = []
    for height in HEIGHTS:
        before = smooth(LATLONG, height)
        there = convert(before, CUBE, equal_size(CUBE, 2 * height * height), "bilinear")
        slipped = replace(there, offset=(0.5 / there.size[0], 0.0))
        errors.append(differences(before, convert(slipped, LATLONG, height, "bilinear"), False)["RMSE"])
    assert max(a / b for a, b in itertools.pairwise(errors)) < 2.2
    assert errors[0] > 5 * lost(CUBE, HEIGHTS[0], "bilinear")


@pytest.mark.parametrize("layout", LAYOUTS.values(), ids=str)
def test_memory_is_equal(layout: Layout) -> None:
    size = equal_size(layout, 2 * 256 * 256)
    tiles, height, width = layout.shape(size)
    shown = tiles * height * width * (np.pi / 4 if layout.disc else 1) * (1 if layout.whole else 2)
    assert size % 2 == 0
    assert abs(shown / (2 * 256 * 256) - 1) < 0.02  # the next even size


# ------------------------------------------------------------ the step across edges, after a conversion, in all levels


@pytest.mark.parametrize("layout", LAYOUTS.values(), ids=str)
def test_levels_have_no_seams(layout: Layout) -> None:
    """From 16 texels on: see benchmarks.layouts.LEAST. A lat-long's level 0 has one at its poles: below."""
    source = smooth(LATLONG, 256)
    for level in environment_levels(convert(source, layout, 64, "bilinear"))[layout is LATLONG :]:
        if level.shape[2] >= 16 * (layout.aspect if layout is LATLONG else 1):
            assert seam_step(EnvironmentMap(layout, level)) < 1.05, level.shape


def test_a_lat_long_pictures_sides_have_no_seam_and_its_poles_do() -> None:
    """Textures repeat the last row beyond a pole: half a texel does not change, and the change comes all at once."""
    sides, *poles = (continuity._quotient(smooth(LATLONG, 64), lines) for lines in edge_lines(smooth(LATLONG, 64)))
    assert sides < 1.05
    assert [round(pole, 1) for pole in poles] == [2.0, 2.0]
