"""Computed heights repeat without a seam, are the same at every size, and a seed decides."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from glbump.errors import ImageError
from glbump.maps.heights import slopes
from glbump.maps.patterns import PATTERNS

MAKERS: dict[str, Callable[..., Any]] = {**PATTERNS, "hammered": partial(PATTERNS["dimples"], wobble=0.4)}
SHAPES = [(128, 128), (96, 160), (135, 77)]


@pytest.mark.parametrize("name", list(MAKERS))
@pytest.mark.parametrize("shape", SHAPES)
def test_it_repeats_without_a_seam(name: str, shape: tuple[int, int]) -> None:
    """Steps over the border are among those inside; where a third of the tile is cut off they are not."""
    h = MAKERS[name](shape)
    assert h.shape == shape
    assert h.dtype == np.float32
    assert (h.min(), h.max()) == (0, 1)
    for axis in (0, 1):
        steps = np.abs(np.diff(h, axis=axis)).mean(axis=1 - axis)
        seam = np.abs(h.take(0, axis) - h.take(-1, axis)).mean()
        assert seam <= 1.2 * steps.max()
        cut = h.take(range(shape[axis] * 65 // 100), axis)
        assert np.abs(cut.take(0, axis) - cut.take(-1, axis)).mean() > 1.3 * np.median(steps)


@pytest.mark.parametrize("name", list(MAKERS))
def test_the_seed_decides_and_nothing_else(name: str) -> None:
    make = MAKERS[name]
    assert np.array_equal(make((64, 48)), make((64, 48)))
    assert np.array_equal(make((64, 48), 3), make((64, 48), seed=3))
    seeds = [make((64, 48), seed) for seed in range(3)]
    differ = [np.abs(a - b).max() for a, b in pairwise(seeds)]
    # A golf ball leaves nothing to chance.
    assert all(d == 0 if name == "dimples" else d > 0.1 for d in differ)


@pytest.mark.parametrize("name", list(MAKERS))
def test_it_is_the_same_at_every_size(name: str) -> None:
    """Centres of texels are centres of the middle ones of nine times as many: the same heights, but for the spread."""
    small, large = MAKERS[name]((40, 60)), MAKERS[name]((120, 180))[1::3, 1::3]
    line = np.polyfit(small.ravel(), large.ravel(), 1)
    assert np.abs(np.polyval(line, small) - large).max() < 1e-4
    assert line[0] == pytest.approx(1, abs=0.2)


def test_it_is_right_way_up() -> None:
    """The lower course begins at u = 0, the upper one half a brick on: row 0 is on top."""
    h = MAKERS["bricks"]((256, 256), columns=2, rows=2)
    for row, joint, face in ((192, 128, 64), (64, 64, 128)):
        assert h[row, joint - 3 : joint + 3].max() < 0.4 < h[row, face - 3 : face + 3].min()


def test_fbm_is_rougher_with_more_gain_and_octaves() -> None:
    def steepness(**options: Any) -> float:
        return float(np.sqrt((slopes(MAKERS["fbm"]((256, 256), **options)) ** 2).mean()))

    assert steepness(gain=0.6) > 1.3 * steepness(gain=0.5) > 1.6 * steepness(gain=0.4)
    assert steepness(octaves=8) > steepness(octaves=3)
    # Counts of cells that are no powers of two repeat as well.
    h = MAKERS["fbm"]((256, 256), cells=48)
    assert np.abs(h[:, 0] - h[:, -1]).mean() <= 1.2 * np.abs(np.diff(h, axis=1)).mean(axis=0).max()


@pytest.mark.parametrize("name", list(MAKERS))
@pytest.mark.parametrize("shape", [(1, 1), (1, 9), (9, 1)])
def test_small_maps_are_defined(name: str, shape: tuple[int, int]) -> None:
    h = MAKERS[name](shape)
    assert h.shape == shape
    assert np.isfinite(h).all()


@pytest.mark.parametrize(
    ("name", "options", "said"),
    [
        ("waves", {"shape": (0, 4)}, r"1 to 32768 texels.*\(0, 4\)"),
        ("waves", {"shape": (4, 40000)}, "1 to 32768 texels"),
        ("fbm", {"seed": -1}, "0 or more; got -1"),
        ("bricks", {"rows": 3}, "rows are 2, 4, 6.*got 3 rows"),
        ("dimples", {"columns": 0}, "0 columns"),
        ("fbm", {"cells": 0}, "1 to 128 cells.*0 cells"),
        ("fbm", {"octaves": 40}, "40 octaves"),
    ],
)
def test_wrong_calls_are_explained(name: str, options: dict[str, Any], said: str) -> None:
    with pytest.raises(ImageError, match=said):
        MAKERS[name](**options)
