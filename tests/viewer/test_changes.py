"""What changes while something goes on: a job, a picture or a comparison is of one state, never of two."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from .driving import in_window, press, scene, settle, tell, viewing


def _resize(viewer: Any, size: tuple[int, int]) -> None:
    """Another size, until the window has been told of it."""
    import glfw

    if viewer.stage.size == size:
        return
    version, end = viewer.shown.version, time.perf_counter() + 10
    glfw.set_window_size(viewer.stage.window, *size)
    while viewer.stage.size != size or viewer.shown.version == version:
        assert time.perf_counter() < end
        glfw.wait_events_timeout(0.01)


def _until(viewer: Any, what: Callable[[], bool]) -> None:
    end = time.perf_counter() + 10
    while not what():
        assert time.perf_counter() < end, viewer.shown.trouble
        viewer.step(0.02)


def _on_call(number: int, action: Callable[[], object]) -> Callable[..., bool]:
    """For `_is_disturbed`: does something when it is asked for that time, and sees nothing of it."""
    calls = []

    def told(*_: object) -> bool:
        calls.append(1)
        if len(calls) == number:
            action()
        return False

    return told


@in_window
def test_a_pixel_is_of_the_picture_that_was_pointed_at(folder: Path) -> None:
    """Nothing is told of it when another picture has taken its place; the pixel may be outside that."""

    def work() -> Iterator[str]:
        yield "work"
        yield "more work"

    with viewing() as viewer:
        for change in (lambda: _resize(viewer, (50, 40)), lambda: viewer.shown.turn_environment(10)):
            for pieces in range(4):
                _resize(viewer, (161, 121))
                settle(viewer)
                viewer.shown.begin(work())
                tell(viewer, "cursor_pos", 150.0, 110.0)
                press(viewer, "i")
                for _ in range(pieces):
                    viewer.step(0)
                change()
                settle(viewer)
                assert (viewer.shown.trouble, viewer.shown.told) == ("", ""), pieces
                viewer.shown.stop()
        press(viewer, "i")
        settle(viewer)
        assert viewer.shown.told, "it is told where nothing changes"


@in_window
def test_heights_are_dropped_on_what_is_there_when_it_is_their_turn(folder: Path) -> None:
    """On the surface that was pointed at; on the first where a mesh or a scene has come in its place."""
    from glbump.maps.files import write_display

    heights, mesh, other = folder / "height.png", folder / "a.obj", folder / "other.toml"
    write_display(heights, np.random.default_rng(2).integers(0, 256, (16, 16, 1), np.uint8))
    mesh.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    other.write_text('[[surface]]\nshape = { kind = "cube" }\n')
    with viewing() as viewer:
        for files, bumps in (
            ([heights], [0, 1]),
            ([mesh, heights], [1]),
            ([other, heights], [1]),
        ):
            viewer.shown.go(0)
            settle(viewer)
            tell(viewer, "cursor_pos", 142.0, 60.0)
            tell(viewer, "drop", [str(file) for file in files])
            settle(viewer)
            assert not viewer.shown.trouble
            assert [len(surface.bumps) for surface in viewer.shown.scene.surfaces] == bumps


@in_window
def test_a_mesh_that_is_gone_keeps_nothing_out(folder: Path) -> None:
    """What is dropped takes its place."""
    from glbump.viewer.opening import opened

    file, mesh, other = (folder / name for name in ("scene.toml", "a.obj", "b.obj"))
    for one in (mesh, other):
        one.write_text("v -1 -1 0\nv 1 -1 0\nv 0 1 0\nf 1 2 3\n")
    file.write_text('[[surface]]\nshape = { kind = "mesh", path = "a.obj" }\n[environment]\nkind = "chrome"\n')
    with viewing(lambda contents: opened(file, contents)) as viewer:
        mesh.unlink()
        _until(viewer, lambda: "a.obj" in viewer.shown.trouble)
        tell(viewer, "cursor_pos", 80.0, 60.0)
        tell(viewer, "drop", [str(other)])
        settle(viewer)
        assert viewer.shown.trouble == ""
        assert viewer.shown.scene.surfaces[0].shape.path == other


@in_window
def test_a_turntable_is_of_the_size_and_the_quality_it_was_begun_with(folder: Path) -> None:
    from PIL import Image

    from glbump.viewer import exports

    with pytest.MonkeyPatch.context() as patch, viewing(folder=folder) as viewer:
        patch.setattr(exports, "STEPS", 3)
        exports.turntable(viewer, ".gif")
        viewer.step(0)
        _resize(viewer, (200, 90))
        settle(viewer)
        assert not viewer.shown.trouble
        with Image.open(folder / "scene-0-turntable.gif") as gif:
            assert (gif.size, gif.n_frames) == ((160, 120), 3)


@in_window
def test_the_second_picture_is_what_it_is_called(folder: Path) -> None:
    """Where another is chosen, or none, while it is being drawn, it is given up."""
    with viewing(quality="fast") as viewer:
        disturbed = viewer._is_disturbed
        viewer._is_disturbed = _on_call(2, lambda: viewer.compare(second="fast"))
        viewer.compare("heat map", "the truth")
        settle(viewer)
        assert viewer.comparison.figures.startswith("0 of 255 apart")
        assert viewer.comparison.figures.endswith("fast, 1 sample")
        viewer._is_disturbed = _on_call(2, lambda: viewer.compare(way=""))
        viewer.compare(second="the truth")
        settle(viewer)
        assert viewer.comparison.picture is None
        viewer._is_disturbed = disturbed
        viewer.compare(way="split")
        settle(viewer)
        assert "exact, 64 samples" in viewer.comparison.figures


@in_window
def test_two_pictures_that_are_compared_have_one_size(folder: Path) -> None:
    """Also where the window has another already, and nobody has been told yet."""
    from glbump.viewer.stage import Stage

    with pytest.MonkeyPatch.context() as patch, viewing(quality="fast") as viewer:
        viewer.comparison.choose("heat map", "balanced")
        patch.setattr(Stage, "room", property(lambda _: (50, 40)))
        assert viewer.comparison.carry_on(viewer.shown, viewer.stage, lambda: False)
        assert viewer.comparison.heat.shape == (120, 160, 4)


@in_window
def test_a_picture_that_failed_is_compared_with_nothing(folder: Path) -> None:
    """Nor when the error has been put away: what is seen is another picture than the one that failed."""
    from glbump.errors import LimitError

    def fails(*_: object) -> None:
        raise LimitError("too much")

    with viewing(quality="fast") as viewer:
        draw, viewer.stage.draw = viewer.stage.draw, fails
        viewer.compare("heat map", "balanced")
        _resize(viewer, (200, 90))
        settle(viewer)
        assert viewer.shown.trouble == "too much"
        press(viewer, "escape")
        settle(viewer)
        assert viewer.comparison.heat is None
        assert not viewer.shown.trouble
        viewer.stage.draw = draw
        viewer.shown.touch()
        settle(viewer)
        assert viewer.comparison.heat.shape == (90, 200, 4)


@in_window
def test_a_picture_that_opengl_refuses_is_said(folder: Path) -> None:
    """As without a window: out of memory, say, OpenGL goes on with black textures."""
    with viewing(quality="fast") as viewer:
        renderer = viewer.stage.renderer
        sample = renderer._draw_sample
        renderer._draw_sample = lambda *a: (sample(*a), renderer.context.gl.enable_direct(0xFFFF))
        viewer.shown.touch()
        settle(viewer)
        assert viewer.shown.trouble.startswith("OpenGL refused a part of this frame (GL_INVALID_ENUM)")
        renderer._draw_sample = sample
        viewer.shown.touch()
        settle(viewer)
        assert viewer.shown.trouble == ""


@in_window
def test_a_second_picture_that_failed_is_not_shown(folder: Path) -> None:
    """What it was drawn in may be gone. It is tried again with another picture, or another second one."""
    from glbump.errors import LimitError

    with viewing(quality="fast") as viewer:
        viewer.compare("split", "the truth")
        while viewer.comparison.picture is None:
            viewer.step(0.01)
        draw = viewer.stage.renderer.draw

        def fails(*_: object, **__: object) -> None:
            raise LimitError("too much")

        viewer.stage.renderer.draw = fails
        settle(viewer)
        assert viewer.shown.trouble == "too much"
        assert viewer.beside is None
        viewer.stage.renderer.draw = draw
        settle(viewer)
        assert viewer.beside is None
        viewer.compare(second="balanced")
        settle(viewer)
        assert "balanced" in viewer.comparison.figures
        viewer.comparison.begin(-1)
        viewer.stage.renderer.draw = lambda *a, use, **named: fails() if use == "second" else draw(*a, use=use, **named)
        settle(viewer)
        assert viewer.shown.trouble == "too much"
        viewer.stage.renderer.draw = draw
        _resize(viewer, (200, 90))
        settle(viewer)
        assert viewer.shown.trouble == ""
        assert "balanced" in viewer.comparison.figures


@in_window
def test_what_is_wrong_with_a_subject_goes_with_it(folder: Path) -> None:
    import os

    from glbump.viewer.opening import opened

    file = folder / "scene.toml"
    file.write_text("[environment]\nkind = 'chrome'\n")
    with viewing(lambda contents: opened(file, contents), scene()) as viewer:
        file.write_text("nonsense")
        os.utime(file, ns=(1, 1))
        _until(viewer, lambda: "is not TOML" in viewer.shown.trouble)
        press(viewer, "n")
        settle(viewer)
        assert viewer.shown.trouble == ""


@in_window
def test_a_defect_is_written_to_the_terminal(folder: Path) -> None:
    """Once, with where it came from."""
    import io
    from contextlib import redirect_stderr

    from glbump.viewer.showing import Showing

    shown = Showing([scene])

    def broken() -> None:
        raise KeyError("nowhere")

    terminal = io.StringIO()
    with redirect_stderr(terminal):
        for _ in range(3):
            shown.attempt("this", broken)
    assert "in broken" in terminal.getvalue()
    assert terminal.getvalue().count("Traceback") == 1
    assert shown.trouble.endswith("the terminal shows: KeyError: 'nowhere'")


@in_window
def test_the_last_picture_stays_where_the_next_finds_no_room(folder: Path) -> None:
    """On the GPU too: it is let go when there is another."""
    from glbump.errors import LimitError
    from glbump.gl import renderer
    from glbump.gl.targets import read
    from glbump.viewer.pace import Pace

    class NoRoom(renderer.Targets):
        def __init__(self, *_: object) -> None:
            raise LimitError("a frame does not fit")

    with pytest.MonkeyPatch.context() as patch, viewing(quality="fast") as viewer:
        picture = viewer.stage.picture
        pixels = read(picture.frame)
        viewer._pace = Pace()  # Not drafted: the next picture is drawn where this one was.
        patch.setattr(renderer, "Targets", NoRoom)
        _resize(viewer, (200, 90))
        settle(viewer)
        assert viewer.shown.trouble == "a frame does not fit"
        assert viewer.stage.picture is picture
        assert np.array_equal(read(picture.frame), pixels)
        patch.undo()
        viewer.shown.touch()
        settle(viewer)
        assert viewer.shown.trouble == ""
        assert viewer.stage.picture.frame.size == (200, 90)
