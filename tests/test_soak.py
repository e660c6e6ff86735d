"""Many frames and many renderers leave nothing behind: benchmarks/soak.py, shorter."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

import glbump as gb
from benchmarks.soak import CYCLE, open_and_close, resident, soak
from glbump.gl.context import Context
from glbump.gl.renderer import Renderer

# MiB. One texture that is never freed, of each of the shapes drawn here, would be more.
FRAMES = 6.0
# A context that is not given back keeps 3 MiB of llvmpipe; one that is, some 20 kB of names that moderngl keeps.
RENDERERS = 12.0


@pytest.fixture
def own(context: Context) -> Iterator[Renderer]:
    """A renderer of its own, which keeps few meshes: it is full after as many frames."""
    with Renderer(context.backend) as renderer:
        renderer._store._most = 40
        yield renderer
    context.check()


def test_frames_leave_nothing_behind(own: Renderer) -> None:
    counts = soak(own, 5 * CYCLE, 8 * CYCLE)
    grown = {name: after - before for name, (before, after) in counts.items()}
    memory = grown.pop("MiB")
    # Meshes come and go with the shapes; all kinds of objects are as many as before.
    assert {name: n for name, n in grown.items() if n} == {}
    assert memory < FRAMES


def test_programs_are_let_go_and_made_again(own: Renderer) -> None:
    """However many qualities take turns; each picture is the same as the first time. More surfaces than programs that
    are kept have theirs all the same."""
    surfaces = [
        gb.Surface(shape, gb.Material(metallic=metallic), transform=gb.Transform(translate=(x, 0, 0), scale=0.4))
        for shape in (gb.Sphere(), gb.Cube())
        for x, metallic in ((-1.0, 1.0), (1.0, 0.0))
    ]
    scene = gb.Scene(surfaces, gb.Chrome())
    qualities = [gb.Quality(preset, samples=1) for preset in ("fast", "balanced", "exact")]
    first = [np.array(own.render(scene, (64, 48), quality)) for quality in qualities]
    before = own.context.live_objects()
    for most in (5, 2):
        own._programs._most = most
        for quality, picture in [*zip(qualities, first)] * 2:
            assert np.array_equal(own.render(scene, (64, 48), quality), picture)
            assert len(own._programs._kept) <= max(most, len(surfaces) + 1)
    after = own.context.live_objects()
    assert after["program"] < before["program"]
    assert after["vertexarray"] < before["vertexarray"]


def test_a_leak_would_be_seen(own: Renderer) -> None:
    own._store._most = 10**6
    counts = soak(own, CYCLE, CYCLE)
    assert counts["buffer"][1] > counts["buffer"][0]
    assert counts["vertexarray"][1] > counts["vertexarray"][0]


def test_renderers_leave_nothing_behind(context: Context) -> None:
    before = context.live_objects()
    open_and_close(2)
    start = resident()
    open_and_close(12)
    assert resident() - start < RENDERERS
    context.check()
    assert context.live_objects() == before
