"""The real window, driven as GLFW drives it: what it shows, what moves it, and that nothing ends it."""

from __future__ import annotations

import shutil
import time
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from .driving import drag, in_window, press, scene, settle, shot, tell, viewing

LEFT, RIGHT, MIDDLE = 0, 1, 2
SHIFT, CONTROL = 1, 2


@in_window
def test_the_window_shows_what_is_rendered_without_one(folder: Path) -> None:
    """To 1/255, for each tone curve, where a surface covers a part of a pixel too."""
    import glbump as gb

    for quality in ("fast", "balanced", gb.Quality("exact", samples=9)):
        with viewing(scene(), quality=quality) as viewer:
            frame = viewer.stage.renderer.render(viewer.shown.scene, viewer.stage.size, quality)
            for tone in ("clip", "reinhard", "filmic"):
                viewer.shown.show_as(tone=tone, exposure=0.7)
                settle(viewer)
                wanted = frame.display(tone, 0.7)[..., :3].astype(int)
                assert np.abs(shot(viewer) - wanted).max() <= 1, (quality, tone)
                assert np.ptp(wanted) > 100, "there is something to see"


@in_window
def test_clear_parts_lie_on_a_chequered_ground(folder: Path) -> None:
    content = scene()
    content = replace(content, environment=replace(content.environment, background=False))
    with viewing(content) as viewer:
        frame = viewer.stage.renderer.render(content, viewer.stage.size)
        seen, alpha = shot(viewer), np.asarray(frame)[..., 3]
        assert set(np.unique(seen[alpha == 0])) == {round(255 * grey) for grey in (0.30, 0.36)}
        wanted = frame.display()[..., :3].astype(int)
        assert np.abs(seen - wanted)[alpha == 1].max() <= 1


@in_window
def test_values_that_are_no_number_are_magenta(folder: Path) -> None:
    with viewing() as viewer:
        stage = viewer.stage
        pixels = np.ones((4, 4, 4), np.float16)
        pixels[0, 0, 1] = np.nan
        framebuffer = stage.context.gl.framebuffer([stage.context.gl.texture((4, 4), 4, pixels.tobytes(), dtype="f2")])
        stage.screen.show(framebuffer, (4, 4))
        seen = stage.screen.read((4, 4))
        assert seen[3, 0].tolist() == [255, 0, 255]
        assert (seen.reshape(-1, 3) == 255).all(axis=1).sum() == 15


@in_window
def test_every_movement_of_the_mouse(folder: Path) -> None:
    """Each does what the table says, and the picture changes with it."""
    with viewing() as viewer:
        shown = viewer.shown

        def state() -> dict[str, Any]:
            camera = shown.scene.camera
            arm = np.subtract(camera.eye, camera.target)
            return {
                "pivot": camera.target,
                "distance": round(float(np.linalg.norm(arm)), 6),
                "way": tuple(np.round(arm / np.linalg.norm(arm), 6).tolist()),
                "fov": camera.fov,
                "rotation": shown.scene.environment.rotation,
            }

        def changes(action: Any) -> set[str]:
            before, picture = state(), shot(viewer)
            action()
            settle(viewer)
            assert (shot(viewer) != picture).any()
            after = state()
            return {name for name in before if before[name] != after[name]}

        a, b = (60.0, 60.0), (75.0, 52.0)
        assert changes(lambda: drag(viewer, a, b, LEFT)) == {"way"}
        assert changes(lambda: drag(viewer, a, b, MIDDLE)) == {"way"}
        assert changes(lambda: drag(viewer, a, b, RIGHT)) == {"pivot"}
        assert changes(lambda: drag(viewer, a, b, LEFT, CONTROL)) == {"pivot"}
        assert changes(lambda: drag(viewer, a, b, MIDDLE, SHIFT)) == {"pivot"}
        assert changes(lambda: drag(viewer, a, b, MIDDLE, CONTROL)) == {"distance"}
        assert changes(lambda: drag(viewer, a, b, LEFT, SHIFT)) == {"rotation"}
        assert changes(lambda: drag(viewer, a, b, LEFT, 4)) == {"rotation"}
        tell(viewer, "cursor_pos", 80.0, 60.0)
        assert changes(lambda: tell(viewer, "scroll", 0.0, 1.0)) == {"distance"}
        tell(viewer, "cursor_pos", 20.0, 30.0)
        assert changes(lambda: tell(viewer, "scroll", 0.0, -0.25)) == {"distance", "pivot"}
        assert changes(lambda: tell(viewer, "scroll", 1.5, 0.0)) == {"way"}
        tell(viewer, "key", 340, 0, 1, 0)
        assert changes(lambda: tell(viewer, "scroll", 0.5, 0.5)) == {"pivot"}
        tell(viewer, "key", 340, 0, 0, 0)
        tell(viewer, "key", 341, 0, 1, 0)
        assert changes(lambda: tell(viewer, "scroll", 0.0, 2.0)) == {"fov"}
        tell(viewer, "key", 341, 0, 0, 0)
        press(viewer, "r")
        settle(viewer)
        assert shown.scene.camera == shown.subject.scene.camera


@in_window
def test_views_are_those_of_the_renderer(folder: Path) -> None:
    """V goes through them, and back to light; each is what Frame.display makes of it, to the byte."""
    from glbump.shown import SHOWN

    with viewing() as viewer:
        light = shot(viewer)
        for name in SHOWN:
            press(viewer, "v")
            settle(viewer)
            assert viewer.shown.view == name
            frame = viewer.stage.renderer.render(viewer.shown.scene, viewer.stage.room, "balanced", show=name)
            viewer._present()
            assert np.array_equal(viewer.stage.view, frame.display())
        while viewer.shown.view != "normal":
            press(viewer, "v", control=True)
        settle(viewer)
        before = viewer.stage.view
        drag(viewer, (50, 50), (60, 55))
        settle(viewer)
        assert (viewer.stage.view != before).any(), "it follows the camera"
        press(viewer, "r")
        while viewer.shown.view is not None:
            press(viewer, "v")
        settle(viewer)
        assert viewer.shown.view is None
        assert np.array_equal(shot(viewer), light)


@in_window
def test_a_pixel_tells_what_it_is_made_of(folder: Path) -> None:
    """As the renderer, the shape and the reference have it: here the ball's point (0, 0, 1)."""
    with viewing(size=(161, 121)) as viewer:
        tell(viewer, "cursor_pos", 80.5, 60.5)
        press(viewer, "i")
        settle(viewer)
        rows = dict(line.split("\t") for line in viewer.shown.told.splitlines())
        assert rows["pixel"].startswith("80, 60")
        assert np.allclose([float(x) for x in rows["normal"].split()], (0, 0, 1), atol=1e-3)
        assert np.allclose([float(x) for x in rows["uv"].split()][:2], 0.5, atol=1e-3)
        assert np.allclose([float(x) for x in rows["reflection"].split()], (0, 0, 1), atol=1e-3)
        frame = viewer.stage.renderer.render(viewer.shown.scene, (161, 121))
        assert np.allclose([float(x) for x in rows["light"].split()], frame.pixels[60, 80, :3], rtol=1e-3)
        truth = [float(x) for x in rows["reference, 64 samples"].split()]
        assert np.allclose(truth, frame.pixels[60, 80, :3], atol=0.02)
        assert int(rows["off on the screen"].split()[0]) <= 4
        drag(viewer, (50, 50), (60, 55))
        assert viewer.shown.told == "", "it was of another picture"


@in_window
def test_a_double_click_sets_the_pivot(folder: Path) -> None:
    with viewing() as viewer:
        for _ in range(2):
            tell(viewer, "cursor_pos", 80.0, 60.0)
            for action in (1, 0):
                tell(viewer, "mouse_button", LEFT, action, 0)
        # The middle of the picture is the point of the ball that is nearest to the camera, at (0, 0, 1).
        assert np.allclose(viewer.shown.scene.camera.target, (0, 0, 1), atol=1e-9)
        assert viewer.shown.scene.camera.eye == (0, 0, 4)
        # The cube to the right, at the same depth in the picture.
        for _ in range(2):
            tell(viewer, "cursor_pos", 142.0, 60.0)
            for action in (1, 0):
                tell(viewer, "mouse_button", LEFT, action, 0)
        x, _, z = viewer.shown.scene.camera.target
        assert 1.2 < x < 2.0
        assert abs(z - 0.4) < 1e-9
        before = viewer.shown.scene.camera
        for _ in range(2):
            tell(viewer, "cursor_pos", 5.0, 5.0)
            for action in (1, 0):
                tell(viewer, "mouse_button", LEFT, action, 0)
        assert viewer.shown.scene.camera == before, "the environment is no pivot"


@in_window
def test_keys_that_are_held_fly_until_they_are_let_go(folder: Path) -> None:
    with viewing() as viewer:
        eye = viewer.shown.scene.camera.eye
        tell(viewer, "key", ord("W"), 0, 1, 0)
        for _ in range(5):
            viewer.step(0)
            time.sleep(0.01)
        ahead = viewer.shown.scene.camera.eye
        assert ahead[2] < eye[2]
        assert ahead[:2] == eye[:2]
        tell(viewer, "window_focus", 0)
        settle(viewer)
        assert viewer.shown.scene.camera.eye == viewer.shown.scene.camera.eye
        rest = viewer.shown.scene.camera
        viewer.step(0)
        assert viewer.shown.scene.camera == rest, "keys let go elsewhere are let go"


@in_window
def test_every_key_of_the_table_does_something_and_none_ends_it(folder: Path) -> None:
    from glbump.viewer import navigation
    from glbump.viewer.actions import ACTIONS

    with viewing(scene(), scene(), folder=folder) as viewer:
        for action in ACTIONS:
            for key in action.keys:
                name = key.removeprefix("ctrl+")
                if name in ("f9", "f11", "q", "w"):
                    continue
                viewer.shown.move(lambda camera: navigation.fly(navigation.orbit(camera, 0.1, 0.01), 0.1, 0, 0))
                settle(viewer)
                before = (viewer.shown.version, viewer.shown.exposed)
                viewer.shown.exposed = 0
                press(viewer, name, control=name != key)
                assert (viewer.shown.version, viewer.shown.exposed) != (before[0], 0), key
                settle(viewer)
                viewer.shown.stop()
        assert not viewer.is_closing
        press(viewer, "q", control=True)
        assert viewer.is_closing


@in_window
def test_the_gallery_goes_round(folder: Path) -> None:
    with viewing(scene(), scene(surfaces=[])) as viewer:
        names = [viewer.shown.subject.name]
        for key in ("page_down", "page_down", "page_up"):
            press(viewer, key)
            settle(viewer)
            names.append(viewer.shown.subject.name)
        assert names == ["scene-0", "scene-1", "scene-0", "scene-1"]
    with viewing() as viewer:
        press(viewer, "n")
        assert "this is all there is" in viewer.shown.note


@in_window
def test_a_rest_costs_no_frames(folder: Path) -> None:
    with viewing() as viewer:
        drawn, presented = [], []
        viewer.stage.draw, draw = lambda *a: (drawn.append(1), draw(*a))[1], viewer.stage.draw
        viewer.stage.present, present = lambda *a: (presented.append(1), present(*a))[1], viewer.stage.present
        started, spent = time.perf_counter(), time.process_time()
        while time.perf_counter() < started + 1.0:
            viewer.step()
        assert drawn == []
        assert presented == []
        # 2 % of a core is the promise, measured in the benchmarks; a loop that spins takes all of it.
        assert time.process_time() - spent < 0.3
        viewer.shown.show_as(exposure=1.0)
        settle(viewer)
        assert (drawn, presented) == ([], [1]), "tone and exposure are the screen's"
        viewer.shown.turn_environment(10)
        settle(viewer)
        assert drawn
        tell(viewer, "window_refresh")
        assert not viewer.is_settled


@in_window
def test_a_slow_picture_is_drafted_while_it_moves_and_drawn_out_at_rest(folder: Path) -> None:
    from glbump.viewer.pace import Pace, Step

    with viewing(quality="balanced") as viewer:
        sharp = shot(viewer)
        # As if this machine were a hundred times slower.
        viewer._pace = Pace(one=20_000.0, many=20_000.0)
        viewer.shown.turn_environment(90)
        viewer.step(0)
        assert viewer.drawn.samples == 1
        assert viewer.drawn.scale < 1
        from glbump.viewer.plates import status

        assert "to stay near 33 ms" in status(viewer)
        draft = shot(viewer)
        viewer.shown.turn_environment(-90)
        settle(viewer)
        assert viewer.drawn == Step(4, 1.0)
        assert "balanced, 4 samples" in status(viewer)
        assert np.array_equal(shot(viewer), sharp), "the same picture as before"
        assert (draft != sharp).any()


@in_window
def test_what_is_drawn_out_is_given_up_for_what_happens(folder: Path) -> None:
    import glbump as gb

    with viewing(quality=gb.Quality("exact", samples=64)) as viewer:
        shown = viewer.shown
        passes = []
        program = viewer.stage.renderer._draw_sample
        viewer.stage.renderer._draw_sample = lambda *a: (passes.append(1), program(*a))[1]
        from glbump.viewer.pace import Pace

        viewer._pace = Pace(one=50_000.0, many=50_000.0)
        shown.turn_environment(30)
        viewer.step(0)
        assert len(passes) == 1, "a draft"
        viewer._is_disturbed, told = lambda: len(passes) > 5 and shown.touch() is None, viewer._is_disturbed
        time.sleep(0.2)
        viewer.step(0)
        viewer.step(0)
        assert 5 < len(passes) < 20
        viewer._is_disturbed = told
        settle(viewer, 60)
        assert viewer.drawn.samples == 64


@in_window
def test_windows_of_all_sizes(folder: Path) -> None:
    """Two pixels across, wide, high: the picture has the window's size and its sides."""
    import glfw

    with viewing() as viewer:
        for size in ((1, 1), (640, 40), (30, 500), (160, 120)):
            glfw.set_window_size(viewer.stage.window, *size)
            end = time.perf_counter() + 5
            while viewer.stage.size != size and time.perf_counter() < end:
                viewer.step(0.01)
            settle(viewer)
            assert viewer.stage.size == size
            assert not viewer.shown.trouble
            frame = viewer.stage.renderer.render(viewer.shown.scene, size)
            assert np.abs(shot(viewer) - frame.display()[..., :3].astype(int)).max() <= 1


@in_window
def test_a_window_of_8k(folder: Path) -> None:
    with viewing(scene(), size=(7680, 4320), quality="fast") as viewer:
        assert viewer.stage.size == (7680, 4320)
        assert viewer.shown.trouble == ""
        frame = viewer.stage.renderer.render(viewer.shown.scene, viewer.stage.size, "fast")
        seen = shot(viewer)[::16, ::16].astype(int)
        assert np.abs(seen - frame.display()[::16, ::16, :3]).max() <= 1


@in_window
def test_the_cursor_counts_in_units_of_the_window_not_in_pixels(folder: Path) -> None:
    """As on a screen with two pixels to a unit."""
    import glfw

    with viewing() as viewer:
        middle = viewer.hands.place(80, 60)
        edge = viewer.hands.place(160, 0)
        assert middle == (0, 0)
        assert np.allclose(edge, (160 / 120 / 2, 0.5))
        told = glfw.get_framebuffer_size
        glfw.get_framebuffer_size = lambda window: (320, 240)
        try:
            assert viewer.stage.size == (320, 240)
            assert viewer.hands.place(160, 0) == edge
            viewer.shown.touch()
            settle(viewer)
            assert viewer.stage.picture.plan.size == (320, 240)
        finally:
            glfw.get_framebuffer_size = told


@in_window
def test_closing_releases_everything(folder: Path) -> None:
    import glfw

    with viewing(scene(), quality="exact") as viewer:
        viewer.shown.toggle_help()
        settle(viewer)
        stage = viewer.stage
        stage.picture = None
        stage.screen.release()
        stage.renderer.release()
        left = stage.context.live_objects()
        # The program in use is the driver's to keep, until its context goes.
        assert sum(left.values()) == left["program"] <= 1, left
    assert not viewer.stage.context.is_open
    assert not glfw.get_current_context()
    viewer.release()


@in_window
def test_a_lost_gpu_is_got_again(folder: Path) -> None:
    """Everything on it is made anew: the same picture, in a window of the same size, as soon as there is one."""
    from glbump.errors import ContextError

    with viewing() as viewer:
        drag(viewer, (50, 50), (70, 60))
        settle(viewer)
        before, window = shot(viewer), viewer.stage.window
        viewer.stage.context.check = lambda what="": None
        # A reset cannot be had here: the driver is made to say so; and then that there is no new window either.
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(type(viewer.stage.context), "is_lost", True)
            with pytest.MonkeyPatch.context() as patch_too:

                def none(*_: object) -> None:
                    raise ContextError("no window can be opened")

                patch_too.setattr("glbump.viewer.stage.open_window", none)
                viewer.step(0)
                assert "no window can be opened" in viewer.shown.trouble
                assert viewer.stage.window == window
                assert not viewer.is_closing
            viewer.step(0)
        assert viewer.stage.window != window
        settle(viewer)
        assert "the GPU was reset" in viewer.shown.note
        assert viewer.shown.trouble == ""
        assert np.array_equal(shot(viewer), before)
        drag(viewer, (50, 50), (70, 60))
        settle(viewer)
        assert (shot(viewer) != before).any(), "the new window is listened to"


@in_window
def test_no_error_ends_it(folder: Path) -> None:
    """Errors of glbump, of the system and of the program: each is said, and the window goes on."""
    from glbump.viewer import navigation

    with viewing(size=(480, 320)) as viewer:
        before = shot(viewer)
        for error, says in (
            (MemoryError(), "out of memory"),
            (
                ZeroDivisionError("by nothing"),
                "a defect of glbump, please report it with what the terminal shows: ZeroDivisionError",
            ),
            (FileNotFoundError(2, "No such file", "a.png"), "No such file: a.png"),
        ):
            move = navigation.orbit
            try:

                def broken(*_: object, error: Exception = error) -> None:
                    raise error

                navigation.orbit = broken
                drag(viewer, (50, 50), (70, 60))
            finally:
                navigation.orbit = move
            assert viewer.shown.trouble.startswith(says)
            settle(viewer)
            assert np.array_equal(shot(viewer), before)
            assert (shot(viewer, plates=True) != before).any(), "the error is seen"
        drag(viewer, (50, 50), (70, 60))
        settle(viewer)
        assert viewer.shown.trouble == "", "what goes well puts it away"


@in_window
def test_pictures_scenes_and_turntables_are_written(folder: Path) -> None:
    from PIL import Image

    import glbump as gb
    from glbump.viewer import exports

    sky = folder / "elsewhere" / "sky.exr"
    sky.parent.mkdir()
    gb.render(gb.Scene([]), (64, 32)).save(sky)
    out = folder / "out"
    out.mkdir()
    content = scene(environment=gb.LatLong(sky))
    with viewing(content, folder=out) as viewer:
        drag(viewer, (50, 50), (70, 60))
        settle(viewer)
        for name in ("scene-0.png", "scene-0-2.png"):
            press(viewer, "f12")
            settle(viewer)
            with Image.open(out / name) as picture:
                assert np.abs(np.asarray(picture).astype(int) - shot(viewer)).max() <= 1
        press(viewer, "s", control=True)
        again = gb.load_scene(out / "scene-0.toml")
        assert again.camera == viewer.shown.scene.camera
        assert (out / "scene-0-files" / "sky.exr").read_bytes() == sky.read_bytes()
        exports.STEPS = 4
        press(viewer, "f9")
        settle(viewer)
        pictures = sorted((out / "scene-0-turntable").glob("*.png"))
        assert [p.name for p in pictures] == ["000.png", "001.png", "002.png", "003.png"]
        with Image.open(pictures[0]) as first:
            assert np.abs(np.asarray(first).astype(int) - shot(viewer)).max() <= 1
        assert len({p.read_bytes() for p in pictures}) == 4
        press(viewer, "f9", control=True)
        settle(viewer)
        with Image.open(out / "scene-0-turntable.gif") as gif:
            assert gif.n_frames == 4
            assert gif.size == viewer.stage.size
        # Half-way, Escape stops it.
        press(viewer, "f9")
        viewer.step(0)
        press(viewer, "escape")
        assert not viewer.shown.is_busy
        settle(viewer)
        assert len(list((out / "scene-0-turntable-2").glob("*.png"))) < 4


@in_window
def test_files_are_dropped(folder: Path) -> None:
    """On the surface under the cursor, or into the scene; what is none of the kinds is said, and nothing changes."""
    import glbump as gb
    from glbump.maps.files import write_display

    write_display(folder / "height.png", np.random.default_rng(3).integers(0, 256, (16, 16, 1), np.uint8))
    gb.render(gb.Scene([]), (64, 32)).save(folder / "sky.exr")
    (folder / "a.toml").write_text('[environment]\nkind = "chrome"\n')
    (folder / "notes.txt").write_text("hello")
    with viewing(size=(320, 240)) as viewer:
        pictures = [shot(viewer)]

        def dropped(*names: str, at: tuple[float, float] = (160, 120)) -> None:
            tell(viewer, "cursor_pos", *at)
            tell(viewer, "drop", [str(folder / name) for name in names])
            assert viewer.shown.work.startswith("opening")
            settle(viewer)
            pictures.append(shot(viewer))

        dropped("height.png", at=(284, 120))
        assert [len(s.bumps) for s in viewer.shown.scene.surfaces] == [0, 1], "the cube is to the right"
        dropped("height.png")
        assert [len(s.bumps) for s in viewer.shown.scene.surfaces] == [1, 1]
        dropped("sky.exr")
        assert viewer.shown.scene.environment == gb.LatLong(folder / "sky.exr")
        for before, after in pairwise(pictures):
            assert (before != after).any()
        dropped("notes.txt")
        assert "all others pictures" in viewer.shown.trouble
        assert np.array_equal(pictures[-1], pictures[-2])
        dropped("a.toml")
        assert not viewer.shown.trouble
        assert viewer.shown.subject.name == "a.toml"
        assert viewer.shown.scene.surfaces == ()


@in_window
def test_a_scene_of_arrays_cannot_be_saved_and_the_window_says_why(folder: Path) -> None:
    with viewing(folder=folder) as viewer:
        press(viewer, "s", control=True)
        assert "holds an array, which a scene file cannot" in viewer.shown.trouble
        assert list(folder.iterdir()) == []


@in_window
def test_files_are_watched(folder: Path) -> None:
    """A scene, its pictures and the shaders: what changes is drawn; what breaks leaves the last good picture."""
    import os

    import glbump as gb
    from glbump.gl.source import find_shaders
    from glbump.viewer.opening import opened

    shaders = folder / "shaders"
    shutil.copytree(find_shaders(), shaders)
    os.environ["GLBUMP_SHADERS"] = str(shaders)
    sky, file = folder / "sky.exr", folder / "scene.toml"
    text = (
        '[environment]\nkind = "lat-long"\nimage = "sky.exr"\n[[surface]]\nshape = {{ kind = "sphere", radius = {} }}\n'
    )
    gb.render(gb.Scene([]), (64, 32)).save(sky)
    file.write_text(text.format(1.0))

    def wait(viewer: Any, until: Any) -> None:
        end = time.perf_counter() + 10
        while not until():
            assert time.perf_counter() < end, viewer.shown.trouble
            viewer.step(0.02)
        settle(viewer)

    def written(path: Path, content: str) -> None:
        path.write_text(content)
        os.utime(path, ns=(time.time_ns(), time.time_ns()))

    try:
        with viewing(lambda contents: opened(file, contents)) as viewer:
            pictures = [shot(viewer)]

            def differs() -> bool:
                return bool((shot(viewer) != pictures[-1]).any())

            written(file, text.format(0.5))
            wait(viewer, differs)
            pictures.append(shot(viewer))
            viewer.stage.renderer.render(gb.Scene([], gb.Chrome()), (64, 32)).save(sky)
            wait(viewer, differs)
            pictures.append(shot(viewer))
            # Each breaks and is mended: the picture stays as it was, and the reason is said.
            shader = shaders / "surface.frag"
            sound, content = shader.read_text(), sky.read_bytes()
            for broken, mended, says in (
                (lambda: written(shader, sound + "\nnonsense"), lambda: written(shader, sound), "surface.frag:"),
                (lambda: written(file, "nonsense"), lambda: written(file, text.format(0.5)), "is not TOML"),
                (lambda: sky.unlink(), lambda: sky.write_bytes(content), "sky.exr"),
                (lambda: sky.write_bytes(content[:200]), lambda: sky.write_bytes(content), "sky.exr"),
                (lambda: file.unlink(), lambda: written(file, text.format(0.5)), "there is no such scene file"),
            ):
                broken()
                wait(viewer, lambda: viewer.shown.trouble)
                assert says in viewer.shown.trouble
                assert np.array_equal(shot(viewer), pictures[-1])
                mended()
                wait(viewer, lambda: not viewer.shown.trouble)
                assert np.array_equal(shot(viewer), pictures[-1])
            written(shaders / "present.frag", "nonsense")
            wait(viewer, lambda: viewer.shown.trouble)
            assert "present.frag:" in viewer.shown.trouble
            assert np.array_equal(shot(viewer), pictures[-1])
    finally:
        del os.environ["GLBUMP_SHADERS"]
