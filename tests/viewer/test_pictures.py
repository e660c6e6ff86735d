"""The pictures of docs/viewer.md, taken of the real window; and that what is written in it can be read.

GLBUMP_PICTURES=docs/pictures pytest tests/viewer/test_pictures.py writes them.
"""

from __future__ import annotations

import os
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from .driving import in_window, press, scene, settle, shot, tell, viewing


def _write(name: str, pixels: npt.NDArray[np.uint8]) -> None:
    folder = os.environ.get("GLBUMP_PICTURES")
    if folder:
        from glbump.maps.files import write_display

        write_display(Path(folder) / name, np.ascontiguousarray(pixels))


@in_window
def test_pictures_of_the_window(folder: Path) -> None:
    """The gallery's bricks with the panel, and its help; as they stand in the docs."""
    pytest.importorskip("imgui_bundle")
    from glbump.demo import EXHIBITS
    from glbump.viewer.opening import gallery

    number = [exhibit.name for exhibit in EXHIBITS].index("brick-ball")
    with viewing(gallery()[number], size=(1200, 800)) as viewer:
        press(viewer, "f2")
        for _ in range(3):
            viewer.shown.expose(3)
            settle(viewer)
        whole = shot(viewer, plates=True)
        _write("view-panel.jpg", whole)
        assert np.ptp(whole[:, : viewer.stage.left]) > 150
        press(viewer, "f2")
        press(viewer, "f1")
        settle(viewer)
        _write("view-help.jpg", shot(viewer, plates=True))
        press(viewer, "f1")
        press(viewer, "1")
        press(viewer, "x")
        tell(viewer, "cursor_pos", 600.0, 300.0)
        settle(viewer, 100)
        _write("view-truth.jpg", shot(viewer, plates=True))
        viewer.compare("heat map")
        settle(viewer)
        _write("view-heat.jpg", shot(viewer, plates=True)[300:, :900])
        viewer.compare("")
        viewer.shown.complain("scene file", ValueError("a line that says what is wrong"))
        settle(viewer)
        assert (shot(viewer, plates=True) != shot(viewer)).any()


def _boxes(viewer: Any) -> list[tuple[int, int, int, int]]:
    from glbump.viewer.plates import plates

    found = plates(viewer, viewer.stage.size, viewer.stage.ratio)
    return [(box.x, box.y, box.x + box.pixels.shape[1], box.y + box.pixels.shape[0]) for box in found]


@in_window
def test_nothing_is_cut_off_and_nothing_overlaps(folder: Path) -> None:
    """Everything at once: trouble, work, a note, the help and the line at the bottom, in windows of many sizes."""
    with viewing(size=(320, 240), quality="fast") as viewer:
        shown = viewer.shown
        shown.complain("one", MemoryError())
        shown.complain("two", OSError(2, "No such file or directory", "/somewhere/far/away/" + "long" * 30 + ".exr"))
        shown.work, shown.note, shown.shows_help = "opening something ...", "a note", True
        seen = set()
        size = viewer.stage.size
        for size in ((1, 1), (60, 40), (150, 120), (320, 240), (640, 480), (1024, 768), (3840, 2160)):
            viewer.stage.__class__ = type("Stage", (type(viewer.stage),), {"size": size})  # No screen here is as large.
            boxes = _boxes(viewer)
            seen.add(len(boxes))
            for x0, y0, x1, y1 in boxes:
                assert 0 <= x0 < x1 <= size[0], (size, boxes)
                assert 0 <= y0 < y1 <= size[1], (size, boxes)
            for a, b in combinations(boxes, 2):
                apart = a[2] <= b[0] or b[2] <= a[0] or a[3] <= b[1] or b[3] <= a[1]
                assert apart, (size, a, b)
        assert {0, 5} <= seen, "none where there is no room, all where there is"


@in_window
def test_plates_are_read_on_white_and_on_black(folder: Path) -> None:
    """By WCAG's contrast of luminances: 4.5 to 1 for text."""
    import glbump as gb

    for light in (0.0, 1.0, 50.0):
        sky = np.full((4, 8, 3), light, np.float32)
        with viewing(scene(surfaces=[], environment=gb.LatLong(sky)), size=(640, 480), quality="fast") as viewer:
            viewer.shown.complain("one", MemoryError())
            viewer.shown.say("a note")
            settle(viewer)
            seen = shot(viewer, plates=True)
            for x0, y0, x1, y1 in _boxes(viewer):
                linear = (seen[y0:y1, x0:x1] / 255.0) ** 2.2 @ (0.2126, 0.7152, 0.0722)
                ink, ground = np.max(linear), np.median(linear)
                assert (ink + 0.05) / (ground + 0.05) > 4.5, (light, ink, ground)


def test_the_page_has_the_table_of_keys() -> None:
    from glbump.viewer.actions import help_rows

    page = (Path(__file__).parents[2] / "docs" / "viewer.md").read_text()
    for pressed, says in help_rows():
        assert f"| {pressed} | {says} |" in page, (pressed, says)
