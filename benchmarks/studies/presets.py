"""Where fast, balanced and exact lie among other settings, over many scenes: error against time, and the front."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from contextlib import ExitStack
from pathlib import Path

import numpy as np
import numpy.typing as npt

from benchmarks.figures import Cell, Section, Table, Target
from benchmarks.generated import scene
from benchmarks.scenes import CASES
from benchmarks.studies.settings import beside, few
from glbump.environment import Fractal
from glbump.gl.renderer import Renderer
from glbump.maps.files import write_atomically
from glbump.quality import PRESETS, Quality
from glbump.scene import Scene
from glbump.trade.metrics import compare
from glbump.trade.plots import Point, front_svg
from glbump.trade.settings import front
from glbump.trade.timing import in_turns, ratios, spread

F64 = npt.NDArray[np.float64]

FASTER, NEARER = 3.0, 0.5
"""How many times faster than `exact` `balanced` is to be, and how much of the error of `fast` it may have."""

OTHERS = {
    "fast, trilinear": Quality("fast", environment_filter="trilinear", bump_filter="trilinear"),
    "fast, 4 samples": Quality("fast", samples=4),
    "balanced, 1 sample": Quality("balanced", samples=1),
    "balanced, level 0": Quality("balanced", environment_filter="bilinear", bump_filter="bilinear", bump_spread="none"),
    "balanced, Toksvig": Quality("balanced", bump_spread="toksvig"),
    "balanced, no spread": Quality("balanced", bump_spread="none"),
    "balanced, 9 samples": Quality("balanced", samples=9),
    "exact, 4 samples": Quality("exact", samples=4),
    "exact, 64 samples, 4 facets": Quality("exact", samples=64, lobe_samples=4),
}
"""What stands round the presets: each with something of its neighbours."""

TRUTH = Quality("exact", samples=256, lobe_samples=4)
"""What errors are against; rough surfaces get 1024 facets a pixel."""


def scenes(by_chance: int) -> dict[str, Scene]:
    """The cases of the accuracy benchmark, and so many by chance. Without fractals, whose truth would take minutes."""
    cases = {c.name: c.photographed() if c.is_there else c.computed() for c in CASES}
    drawn = ((f"by chance, {number}", scene(number)) for number in itertools.count())
    kept = ((name, content) for name, content in drawn if not isinstance(content.environment, Fractal))
    return cases | dict(itertools.islice(kept, by_chance))


def measured(
    contents: Mapping[str, Scene], settings: Mapping[str, Quality], size: tuple[int, int], turns: int
) -> tuple[F64, F64]:
    """RMSE in 1/255 and times over `balanced` in the same turn: each (scenes, settings)."""
    errors, times = [], []
    with Renderer() as first:
        for content in contents.values():
            truth = first.render(content, size, TRUTH).pixels
            with ExitStack() as stack:
                calls = {w: stack.enter_context(beside(first, size, (content, q))) for w, q in settings.items()}
                pictures = [call().pixels for call in calls.values()]
                took = in_turns(calls, turns, warm_up=1)
            errors.append([255 * compare(picture, truth, perceptual=False)["rmse"] for picture in pictures])
            times.append([ratios(took[w].wall, took["balanced"].wall).median for w in settings])
    return np.array(errors), np.array(times)


def study(folder: Path, quick: bool = False) -> Section:
    """Fourteen scenes at 128x128 (quick: the presets alone, two scenes at 16x16)."""
    size, turns = ((16, 16), 1) if quick else ((128, 128), 3)
    contents = few(scenes(6), quick)
    settings = {name: Quality(name) for name in PRESETS} | ({} if quick else OTHERS)
    errors, times = measured(contents, settings, size, turns)
    names, of = list(settings), {name: i for i, name in enumerate(settings)}
    error, cost = np.median(errors, axis=0), np.median(times, axis=0)
    best = set(front(list(zip(cost.tolist(), error.tolist()))))
    _plot(folder / "presets.svg", names, cost, error, best)
    fast, balanced, exact = (of[name] for name in ("fast", "balanced", "exact"))
    slower = float(np.median(times[:, exact] / times[:, balanced]))
    share = float(np.median(errors[:, balanced] / np.maximum(errors[:, fast], 1e-9)))
    ordered = [float(np.mean((a[:, [fast, balanced]] < a[:, [balanced, exact]]).all(axis=1))) for a in (times, -errors)]

    presets = [(name, settings[name]) for name in PRESETS]

    def spreads(i: int) -> list[str]:
        return [str(spread(figures[:, i].tolist())) for figures in (errors, times)]

    return Section(
        "Presets, and what lies round them",
        f"{len(contents)} scenes at {size[0]}x{size[1]}: those of the accuracy benchmark, and scenes by chance "
        "(benchmarks/generated.py, fractals aside). Errors are display-referred, against 256 samples a pixel. Times "
        "are of whole frames, read-back included, all settings in turns, over that of `balanced` in the same turn; "
        "brackets hold the quartiles of the scenes. A row of the second table says what it changes of a preset; on the "
        "front is what no other row beats in both medians. "
        f"Slower from `fast` to `balanced` to `exact` in {ordered[0]:.0%} of the scenes, nearer to the truth in "
        f"{ordered[1]:.0%}.\n\n![The settings, by median time and error](presets.svg)",
        (
            Table(
                ("preset", "RMSE, /255", "time", "samples a pixel", "levels", "rough surfaces"),
                [[f"`{p}`", *spreads(of[p]), q.samples, q.environment_filter, q.gloss] for p, q in presets],
            ),
            Table(
                ("setting", "RMSE, /255", "time", "on the front"),
                [[names[i], *spreads(i), "yes" if i in best else ""] for i in np.argsort(cost)],
            ),
            Table(
                ("scene", *(f"{name}, {what}" for what in ("RMSE, /255", "time") for name in PRESETS)),
                [_of_scene(name, e, t, [of[p] for p in PRESETS]) for name, e, t in zip(contents, errors, times)],
            ),
        ),
        (
            Target("`exact` over `balanced`, time", f"{slower:.3g} times", f"at least {FASTER:g}", slower >= FASTER),
            Target.at_most("`balanced` over `fast`, error", share, NEARER, " times"),
        ),
    )


def _plot(file: Path, names: list[str], cost: F64, error: F64, best: set[int]) -> None:
    points = [
        Point(name, "preset" if name in PRESETS else name.split(",")[0], float(cost[i]), float(error[i]), i in best)
        for i, name in enumerate(names)
    ]
    svg = front_svg(points, "times the time of balanced, median scene", "RMSE, /255, median scene")
    write_atomically(file, svg.encode())


def _of_scene(name: str, errors: F64, times: F64, presets: list[int]) -> list[Cell]:
    return [name, *errors[presets].tolist(), *times[presets].tolist()]
