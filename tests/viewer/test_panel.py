"""The panel: every value is there, what is done to it changes what is shown, and its errors end nothing."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from .driving import drag, in_window, press, scene, settle, shot, tell, viewing

pytest.importorskip("imgui_bundle", reason="the panel's library is not installed")

SIZE = (640, 480)


def shown(viewer: Any) -> None:
    """The panel opened, and laid out."""
    press(viewer, "f2")
    for _ in range(3):
        viewer.shown.expose(3)
        settle(viewer)


@in_window
def test_the_panel_leaves_the_picture_its_room(folder: Path) -> None:
    with viewing(size=SIZE, quality="fast") as viewer:
        bare = shot(viewer, plates=True)
        shown(viewer)
        with_panel = shot(viewer, plates=True)
        width = viewer.stage.left
        assert 300 < width <= SIZE[0] // 2
        frame = viewer.stage.renderer.render(viewer.shown.scene, viewer.stage.room, "fast")
        assert np.abs(shot(viewer) - frame.display()[..., :3].astype(int)).max() <= 1
        ground = with_panel[:, :width]
        assert (ground != bare[:, :width]).any(axis=2).mean() > 0.95
        # Letters, on their ground: readable is 4.5 to 1, by WCAG's contrast of luminances.
        luminance = (ground / 255.0) ** 2.2 @ (0.2126, 0.7152, 0.0722)
        assert (luminance.max() + 0.05) / (np.median(luminance) + 0.05) > 10
        press(viewer, "f2")
        settle(viewer)
        assert viewer.stage.left == 0
        assert shot(viewer).shape == bare.shape


@in_window
def test_what_the_panel_sets_is_drawn(folder: Path) -> None:
    """Through the same ways as its rows: with values that are right and wrong."""
    from dataclasses import replace

    from glbump.viewer.panel.sections import Choosing

    with viewing(size=SIZE, quality="fast") as viewer:
        shown(viewer)
        choosing = Choosing(viewer)
        for dotted, value in (
            ("surface.0.material.roughness", 0.4),
            ("surface.0.material.base_color", (0.2, 0.9, 0.1)),
            ("environment.rotation", 120.0),
            ("environment.exposure", -1.0),
            ("environment.background", False),
        ):
            before = shot(viewer)
            choosing.put(dotted, value)
            settle(viewer)
            assert (shot(viewer) != before).any(), dotted
            assert not viewer.shown.trouble
        before, content = shot(viewer), viewer.shown.scene
        choosing.put("surface.0.material.roughness", 3.0)
        settle(viewer)
        assert "material.roughness must be" in viewer.shown.trouble
        assert viewer.shown.scene is content
        assert np.array_equal(shot(viewer), before)
        viewer.shown.set_quality(replace(viewer.shown.quality, samples=9))
        settle(viewer)
        assert viewer.drawn.samples == 9


@in_window
def test_sliders_are_pulled_and_the_camera_stays(folder: Path) -> None:
    """By the mouse, over all of the panel: something changes, and none of it is the camera."""
    with viewing(size=SIZE, quality="fast") as viewer:
        shown(viewer)
        camera, content = viewer.shown.scene.camera, viewer.shown.scene
        for y in range(100, SIZE[1] - 20, 24):
            tell(viewer, "cursor_pos", 60.0, float(y))
            settle(viewer)
            tell(viewer, "mouse_button", 0, 1, 0)
            viewer.step(0)
            tell(viewer, "cursor_pos", 90.0, float(y))
            viewer.step(0)
            viewer.step(0)
            tell(viewer, "mouse_button", 0, 0, 0)
            tell(viewer, "scroll", 0.0, 0.0)
            viewer.step(0)
            viewer.shown.stop()
        settle(viewer)
        assert viewer.shown.scene.camera in (camera, viewer.shown.subject.scene.camera)
        assert viewer.shown.scene != content
        # Beside it, the mouse is the picture's.
        tell(viewer, "cursor_pos", 500.0, 200.0)
        settle(viewer)
        before = viewer.shown.scene.camera
        drag(viewer, (500, 200), (540, 210))
        assert viewer.shown.scene.camera != before


def test_each_knob_finds_what_the_plan_made_of_it() -> None:
    """Of a scene that needs everything: no knob is without its reason."""
    import glbump as gb
    from glbump.contents import Contents
    from glbump.plan import make_plan
    from glbump.quality import KNOBS, quality_of
    from glbump.viewer.panel.sections import SAID_BY, said_of

    assert set(SAID_BY) <= set(KNOBS)
    heights = np.random.default_rng(1).uniform(0, 1, (16, 16)).astype(np.float32)
    rough = gb.Material(metallic=1, roughness=0.4)
    content = scene(surfaces=[gb.Surface(gb.Sphere(), rough, gb.Bump(heights, 0.1))])
    choices = make_plan(content, quality_of("balanced"), (64, 64), Contents()).choices
    told = {knob for knob in KNOBS if said_of(knob, choices, 0)}
    assert {"samples", "silhouette", "environment_layout", "environment_filter", "environment_level"} <= told
    assert {"bump_kernel", "bump_read", "bump_terms", "bump_format", "bump_filter"} <= told
    assert {"gloss_size", "gloss_samples", "texture_format", "frame_format", "direction_error"} <= told


@in_window
def test_an_error_in_a_section_is_said_and_the_others_stand(folder: Path) -> None:
    from glbump.viewer import panel

    with viewing(size=SIZE, quality="fast") as viewer:
        shown(viewer)

        def broken(_: object) -> None:
            from imgui_bundle import imgui

            imgui.begin_group()
            raise ZeroDivisionError("in a section")

        before, panel.SECTIONS = panel.SECTIONS, (broken, *panel.SECTIONS)
        try:
            for _ in range(3):
                viewer.shown.expose(2)
                viewer.step(0)
            assert "in a section" in viewer.shown.trouble
        finally:
            panel.SECTIONS = before
        viewer.shown.stop()
        for _ in range(3):
            viewer.shown.expose(2)
            viewer.step(0)
        assert not viewer.shown.trouble


@in_window
def test_without_the_library_the_window_says_how_to_get_it(folder: Path) -> None:
    import sys

    with viewing(size=SIZE, quality="fast") as viewer:
        hidden = {name: sys.modules.pop(name) for name in list(sys.modules) if "viewer.panel" in name}
        library, sys.modules["imgui_bundle"] = sys.modules.get("imgui_bundle"), None
        try:
            press(viewer, "f2")
            settle(viewer)
            assert "pip install 'glbump[view]'" in viewer.shown.trouble
            assert viewer.stage.left == 0
        finally:
            sys.modules |= hidden
            del sys.modules["imgui_bundle"]
            if library is not None:
                sys.modules["imgui_bundle"] = library
