"""Whether errors are predicted before anything is drawn: the model beside what was measured, setting by setting."""

from __future__ import annotations

from collections import defaultdict

import numpy as np

from benchmarks.figures import Cell, Section, Table, Target
from benchmarks.generated import scene
from glbump.errors import GlbumpError
from glbump.gl.renderer import Renderer
from glbump.plan import Plan
from glbump.quality import KNOBS, Quality
from glbump.reference.shade import render as reference
from glbump.scene import Scene
from glbump.trade.metrics import compare
from glbump.trade.model import FACTOR, Model, factor
from glbump.trade.settings import Setting, one_at_a_time, presets

NEAR = 0.9
"""Share of the settings that is to be predicted within FACTOR."""
NUMBERS = (0, 2, 3, 4, 5, 8)
"""Of benchmarks.generated; a fractal sky takes the reference ten times as long."""
MOST_SAMPLES = 16
"""A pixel, of what is swept."""
TRUTH_SAMPLES = 36
WORST = 12

Found = tuple[str, float, float, str]


def predicted(content: Scene, size: tuple[int, int], *, knobs: bool = True) -> list[Found]:
    """(setting, measured, predicted, largest part) of the presets, and of every knob's first and last value."""
    base, found = Quality(), []
    with Renderer() as renderer:

        def plan(quality: Quality) -> Plan:
            return renderer.plan(content, size, quality)

        truth = reference(content, size, TRUTH_SAMPLES, contents=renderer.contents).pixels
        model = Model(content, size, truth, base, plan, renderer.contents)
        for setting in [*presets(base), *(filter(_is_an_end, one_at_a_time(base, plan)) if knobs else [])]:
            if setting.skipped:
                continue
            try:
                said = model.predict(setting.quality)
                drawn = renderer.render(content, size, setting.quality).pixels
            except GlbumpError:
                continue
            measured = float(compare(drawn, truth, perceptual=False)["rmse"])
            part = said.parts[0].knobs[0] if said.parts else ""
            found.append((setting.name, measured, said.rmse.value, part))
    return found


def _is_an_end(setting: Setting) -> bool:
    """Whether it is the cheapest or the nearest to the truth of a knob's values."""
    ((knob, value),) = setting.changes.items()
    values = [v for v in KNOBS[knob].values if knob != "samples" or v <= MOST_SAMPLES]
    return value in (values[0], values[-1])


def measure(quick: bool = False) -> Section:
    """Six scenes at 96x96 (quick: the presets of one at 16x16)."""
    numbers, size = ((4,), (16, 16)) if quick else (NUMBERS, (96, 96))
    found = [(number, row) for number in numbers for row in predicted(scene(number), size, knobs=not quick)]
    off = [factor(measured, said) for _, (_, measured, said, _) in found]
    near = float(np.mean([f <= FACTOR for f in off]))
    by_knob: dict[str, list[float]] = defaultdict(list)
    for f, (_, (name, *_)) in zip(off, found):
        by_knob[name.partition("=")[0]].append(f)
    order = np.argsort(off)[::-1][:WORST]
    worst: list[list[Cell]] = [
        [found[i][0], found[i][1][0], 255 * found[i][1][1], 255 * found[i][1][2], off[i], found[i][1][3]] for i in order
    ]
    return Section(
        "Errors, predicted",
        f"{len(numbers)} scenes drawn by chance (benchmarks/generated.py), {size[0]}x{size[1]}: the presets, and "
        f"balanced with each knob turned to its first and to its last value, up to {MOST_SAMPLES} samples. The RMSE "
        "that the model predicts without OpenGL from 16 tiles, beside that of what the driver draws; both against the "
        f"float64 reference with {TRUTH_SAMPLES} samples a pixel. Factors are the larger over the smaller. "
        "docs/trade.md says what the model knows.",
        (
            Table(
                ("knob", "settings", "median factor", "largest", f"within {FACTOR:g}"),
                [
                    [name, len(fs), float(np.median(fs)), max(fs), f"{np.mean([f <= FACTOR for f in fs]):.0%}"]
                    for name, fs in by_knob.items()
                ],
            ),
            Table(("scene", "setting", "measured, /255", "predicted, /255", "factor", "largest part"), worst),
        ),
        (
            Target(
                f"{len(off)} settings predicted within {FACTOR:g} times",
                f"{near:.1%}",
                f"at least {NEAR:.0%}",
                near >= NEAR,
            ),
        ),
    )


if __name__ == "__main__":
    from benchmarks.command import alone

    alone(measure)
