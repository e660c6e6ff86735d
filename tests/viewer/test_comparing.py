"""The picture beside a second one: split, flicker, heat map, figures; and the float64 reference of a part of it."""

from __future__ import annotations

import time
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from .driving import drag, in_window, press, scene, settle, shot, tell, viewing

SIZE = (320, 240)


def _until(viewer: Any, what: Callable[[], bool], seconds: float = 60.0) -> None:
    end = time.perf_counter() + seconds
    while not what():
        assert time.perf_counter() < end, viewer.shown.trouble
        viewer.step(0.02)


def _figure(words: str) -> float:
    """The rms in words, in 1/255."""
    return float(words.split(" of 255 apart")[0].split()[-1])


@in_window
def test_the_picture_is_held_against_the_truth(folder: Path) -> None:
    """Side by side at the cursor, and as a map of the difference; with figures that are those of glbump.trade."""
    import glbump as gb
    from glbump.trade.metrics import compare

    with viewing(size=SIZE, quality="fast") as viewer:
        ours = shot(viewer)
        press(viewer, "x")
        tell(viewer, "cursor_pos", 200.0, 100.0)
        settle(viewer, 60)
        exact = gb.Quality("exact", samples=64)
        frame = viewer.stage.renderer.render(viewer.shown.scene, viewer.stage.room, exact)
        figures = compare(viewer.stage.renderer.render(viewer.shown.scene, viewer.stage.room, "fast"), frame)
        assert viewer.split == 200
        assert f"{255 * figures['rmse']:.2g} of 255 apart" in viewer.comparison.figures
        assert "64 samples" in viewer.comparison.figures
        stage = viewer.stage
        stage.screen.show(stage.picture.frame, stage.size)
        stage.screen.show(viewer.comparison.picture.frame, stage.size, begin=200)
        seen, truth = stage.screen.read(stage.size).astype(int), frame.display()[..., :3]
        assert np.array_equal(seen[:, :200], ours[:, :200])
        assert np.abs(seen[:, 200:] - truth[:, 200:]).max() <= 1
        assert (truth != ours).any()
        viewer.compare("heat map")
        settle(viewer)
        heat = viewer.comparison.heat
        worst = np.unravel_index(np.abs(ours.astype(int) - truth).max(axis=2).argmax(), heat.shape[:2])
        assert heat[worst][:3].astype(int).sum() >= 0.95 * heat[..., :3].astype(int).sum(axis=2).max()
        drag(viewer, (150, 100), (170, 110))
        viewer.step(0)
        assert viewer.comparison.heat is None, "it was of another picture"
        press(viewer, "x")
        settle(viewer)
        assert viewer.comparison.way == ""


@in_window
def test_any_preset_is_the_second_picture(folder: Path) -> None:
    """What is drawn for it is that preset's picture; equal qualities are 0 apart."""
    from glbump.quality import PRESETS

    with viewing(size=SIZE, quality="fast") as viewer:
        tell(viewer, "cursor_pos", 100.0, 100.0)
        press(viewer, "x")
        for name in PRESETS:
            press(viewer, "x", control=True)
            settle(viewer)
            assert viewer.comparison.second == name
            seen = shot(viewer, plates=True)[:100].astype(int)
            wanted = viewer.stage.renderer.render(viewer.shown.scene, viewer.stage.room, name).display()[:100, :, :3]
            assert np.abs(seen[:, 102:] - wanted[:, 102:]).max() <= 1
            assert (_figure(viewer.comparison.figures) == 0) == (name == "fast")
        press(viewer, "x", control=True)
        assert viewer.comparison.second == "the truth"


@in_window
def test_it_flickers_twice_a_second_and_draws_for_nothing_else(folder: Path) -> None:
    """Each flip shows the other picture to the byte, and costs one frame; nothing is drawn anew for it."""
    with viewing(size=SIZE, quality="fast") as viewer:
        ours = shot(viewer)
        viewer.compare("flicker", "exact")
        settle(viewer)
        drawn, presented = [], []
        viewer.stage.draw, draw = lambda *a: (drawn.append(1), draw(*a))[1], viewer.stage.draw
        viewer.stage.present, present = (
            lambda *a: (presented.append(viewer.beside), present(*a))[1],
            viewer.stage.present,
        )
        started, spent = time.perf_counter(), time.process_time()
        seen = set()
        while time.perf_counter() < started + 2.2:
            viewer.step()
            other = viewer.comparison.flipped
            at = shot(viewer, plates=True)[:100]
            assert np.array_equal(at, ours[:100]) == (not other)
            seen.add(other)
        assert seen == {True, False}
        assert drawn == []
        # Late where the machine is busy, never early.
        assert 2 <= len(presented) <= 5
        assert all((a is None) != (b is None) for a, b in pairwise(presented))
        assert time.process_time() - spent < 1.0, "it waits"
        viewer.compare("")
        settle(viewer)
        presented.clear()
        time.sleep(0.6)
        viewer.step(0)
        assert presented == []


@in_window
def test_figures_go_by_the_tone_curve_and_the_exposure(folder: Path) -> None:
    """Those of the bytes on the screen, which nothing is drawn anew for."""
    with viewing(size=SIZE, quality="fast") as viewer:
        viewer.compare("heat map", "balanced")
        settle(viewer)
        found = set()
        for tone, exposure in (("clip", 0.0), ("filmic", 0.0), ("filmic", 1.5), ("clip", -6.0)):
            viewer.shown.show_as(tone=tone, exposure=exposure)
            settle(viewer)
            frames = [viewer.stage.renderer.render(viewer.shown.scene, SIZE, q) for q in ("fast", "balanced")]
            a, b = (frame.display(tone, exposure)[..., :3].astype(float) for frame in frames)
            rms = np.sqrt(np.mean((a - b) ** 2))
            # Bytes are rounded: each is off by 0.29 rms at most; and two digits are said.
            assert abs(_figure(viewer.comparison.figures) - rms) < 0.4
            found.add(viewer.comparison.figures)
        assert len(found) == 4


@in_window
def test_the_panel_has_what_it_is_held_against(folder: Path) -> None:
    pytest.importorskip("imgui_bundle")
    with viewing(size=(640, 480), quality="fast") as viewer:
        press(viewer, "f2")
        viewer.compare("flicker", "balanced")
        press(viewer, "i", control=True)
        settle(viewer)
        assert "balanced, " in viewer.comparison.figures
        assert not viewer.shown.trouble


def test_parts_are_whole_quads_round_the_cursor() -> None:
    """For every pixel of pictures of many sizes: the reference takes it, and the pixel is in it."""
    from glbump.reference.shade import _checked_region
    from glbump.viewer.regions import SIDE, around

    for size in ((1, 1), (63, 65), (64, 64), (161, 121), (200, 70)):
        for x in range(0, size[0], 3):
            for y in range(size[1]):
                left, top, width, height = _checked_region(around(x, y, size), size)
                assert left <= x < left + width
                assert top <= y < top + height
                assert SIDE - 2 < width <= SIDE or width == size[0]


@in_window
def test_the_reference_is_made_in_the_background(folder: Path) -> None:
    """It is the reference's picture, in its place, with a frame and figures; another quality is measured against it;
    another camera makes it go, and its process too."""
    from glbump import reference
    from glbump.viewer import regions
    from glbump.viewer.plates import plates

    with pytest.MonkeyPatch.context() as patch, viewing(size=SIZE, quality="fast") as viewer:
        patch.setattr(regions, "SIDE", 24)  # For the sake of time.
        tell(viewer, "cursor_pos", 130.0, 90.0)
        press(viewer, "i", control=True)
        held = viewer.reference
        assert held.region == regions.around(130, 90, SIZE)
        assert held.is_running
        settle(viewer)
        frames = 0
        while held.samples < 64:
            viewer.shown.expose()
            viewer.step(0.02)
            frames += 1
        assert frames > 5, "the window went on"
        assert not held.is_running
        _until(viewer, lambda: bool(held.figures) and viewer.is_settled)
        left, top, width, height = held.region
        true = reference.render(viewer.shown.scene, SIZE, 64, region=held.region).display()[..., :3].astype(int)
        here = slice(top, top + height), slice(left, left + width)
        seen, ours = shot(viewer, plates=True), shot(viewer)[here].astype(int)
        assert np.abs(seen[here].astype(int) - true).max() <= 1
        assert (seen[top - 1, left : left + width] == 255).all(), "the frame"
        fast = _figure(held.figures)
        assert abs(fast - np.sqrt(np.mean((ours - true) ** 2))) < 0.4
        press(viewer, "3")
        _until(viewer, lambda: bool(held.figures) and viewer.is_settled)
        assert _figure(held.figures) < fast, "exact is nearer"
        assert any(box.pixels.shape[:2] == (height + 4, width + 4) for box in plates(viewer, SIZE, 1.0))
        drag(viewer, (150, 100), (170, 110))
        settle(viewer)
        assert held.region is None


@in_window
def test_a_reference_that_is_not_wanted_any_more_is_given_up(folder: Path) -> None:
    """By the camera, by Escape, by closing; and one that fails says why."""
    import multiprocessing

    import glbump as gb
    from glbump.maps.files import write_picture

    with viewing(size=SIZE, quality="fast") as viewer:
        tell(viewer, "cursor_pos", 130.0, 90.0)
        for give_up in (
            lambda: drag(viewer, (150, 100), (170, 110)),
            lambda: press(viewer, "escape"),
            lambda: press(viewer, "i", control=True),
        ):
            press(viewer, "i", control=True)
            (process,) = multiprocessing.active_children()
            give_up()
            settle(viewer)
            assert process not in multiprocessing.active_children()
    assert multiprocessing.active_children() == [], "closed"
    sky = folder / "sky.exr"
    write_picture(sky, np.ones((8, 16, 3), np.float32))
    with viewing(scene(environment=gb.LatLong(sky)), size=SIZE, quality="fast") as viewer:
        tell(viewer, "cursor_pos", 130.0, 90.0)
        sky.write_bytes(b"none of the kinds")
        viewer.reference.begin(viewer.shown, viewer.stage.room, 130, 90)
        _until(viewer, lambda: viewer.reference.region is None)
        assert "sky.exr" in viewer.shown.trouble
