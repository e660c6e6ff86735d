"""How the number of pixels follows what frames cost, without a clock."""

from __future__ import annotations

import pytest

from glbump.viewer.pace import BUDGET, SCALES, Pace, Step, scaled

SIZE = (1600, 900)


def run(one: float, many: float, samples: int, *, beside: float = 4.0, frames: int = 40) -> tuple[list[Step], float]:
    """The steps of a drag on a machine that takes nanoseconds a pixel and sample, after a frame at rest; and what the
    last frame takes, in milliseconds."""
    pace, steps, ms = Pace(), [], 0.0
    for _ in range(frames):
        step = pace.moving(SIZE, samples)
        width, height = size = scaled(SIZE, step.scale)
        draw = 1e-6 * width * height * step.samples * (one if step.samples == 1 else many)
        pace = pace.after(step, size, draw, beside)
        steps.append(step)
        ms = draw + beside
    return steps, ms


def test_a_fast_machine_draws_all_of_it() -> None:
    steps, ms = run(2.0, 2.0, 4)
    assert set(steps) == {Step(4, 1.0)}
    assert ms < BUDGET


@pytest.mark.parametrize("one", [15.0, 40.0, 90.0, 400.0, 1200.0])
@pytest.mark.parametrize("samples", [1, 4, 16])
def test_a_slow_machine_keeps_the_budget(one: float, samples: int) -> None:
    steps, ms = run(one, 0.8 * one, samples)
    assert ms <= BUDGET
    # A step to more pixels would pass the limit, or come within its margin.
    if steps[-1] != Step(samples, 1.0):
        more = [s for s in SCALES if s > steps[-1].scale]
        assert not more or 1e-6 * SIZE[0] * SIZE[1] * min(more) ** 2 * one > 0.8 * (BUDGET - 4.0)
    assert len(set(steps[-10:])) == 1, "it does not step to and fro"


def test_pixels_come_back_when_frames_get_cheap() -> None:
    pace = Pace(one=500.0, many=500.0, scale=0.25)
    for _ in range(20):
        step = pace.moving(SIZE, 4)
        pace = pace.after(step, scaled(SIZE, step.scale), 1e-6 * 5.0 * SIZE[0] * SIZE[1] * step.scale**2 * step.samples)
    assert pace.moving(SIZE, 1) == Step(1, 1.0)


def test_there_is_always_a_pixel() -> None:
    assert scaled((1, 1), SCALES[-1]) == (1, 1)
    assert Pace(one=1e9).moving((1, 1), 1).scale in SCALES
