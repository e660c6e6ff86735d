"""Contexts: every way that exists here, why the others failed, and misuse as errors instead of wrong pictures."""

from __future__ import annotations

import gc
import os
import subprocess
import sys
import threading
import weakref
from pathlib import Path
from typing import Any

import moderngl
import pytest
from test_backends import need

from glbump.errors import ContextError
from glbump.gl import context as context_module
from glbump.gl import egl, osmesa
from glbump.gl.context import Context, open_context
from glbump.gl.native import RouteError
from glbump.gl.ways import Attempt, Way, ways

# Opens a backend, draws a picture by a formula, and prints what it got and a hash of the pixels.
DRAW = """
import hashlib, sys
from glbump.gl.context import open_context
with open_context(sys.argv[1]) as context:
    gl = context.gl
    program = gl.program(
        vertex_shader='''#version 330
        void main() { gl_Position = vec4(4 * (gl_VertexID & 1) - 1, 2 * (gl_VertexID & 2) - 1, 0, 1); }''',
        fragment_shader='''#version 330
        out vec4 colour; void main() { colour = vec4(sin(gl_FragCoord.xy), fract(gl_FragCoord.x / 7), 1); }''')
    framebuffer = gl.framebuffer([gl.texture((16, 16), 4, dtype="f4")])
    framebuffer.use()
    gl.vertex_array(program, []).render(vertices=3)
    pixels = framebuffer.read(components=4, dtype="f4")
    assert gl.error == "GL_NO_ERROR"
    print(context.backend, hashlib.sha256(pixels).hexdigest(), "glfw" in sys.modules, context.info["renderer"],
          sep="|")
"""


def in_process(code: str, *arguments: str, before: tuple[str, ...] = (), **environment: str) -> str:
    """What a fresh Python prints."""
    done = subprocess.run(
        [*before, sys.executable, "-c", code, *arguments],
        env={name: value for name, value in os.environ.items() if not name.startswith("GLBUMP_")} | environment,
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


@pytest.fixture
def alone(monkeypatch: pytest.MonkeyPatch) -> pytest.MonkeyPatch:
    """As in a process and an environment where nothing is open and nothing is asked for."""
    monkeypatch.setattr(context_module, "_open", weakref.WeakSet())
    monkeypatch.delenv("GLBUMP_BACKEND", raising=False)
    monkeypatch.delenv("GLBUMP_DEVICE", raising=False)
    return monkeypatch


def red(context: Context, value: float) -> moderngl.Framebuffer:
    """A 4x4 framebuffer of `context` filled with `value`."""
    context.check()
    framebuffer = context.gl.simple_framebuffer((4, 4))
    framebuffer.use()
    framebuffer.clear(value, 0, 0, 1)
    return framebuffer


def resident_mb() -> float:
    """Memory of this process, MB."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6


# The ways


@pytest.mark.parametrize("backend", ["egl", "osmesa", "window"])
def test_backend_draws(backend: str) -> None:
    took, picture, imports_glfw, renderer = in_process(DRAW, backend, before=need(backend)).split("|")
    assert took == backend
    assert imports_glfw == str(backend == "window"), "only a window may cost the import of glfw"
    if "llvmpipe" in renderer:
        assert picture == in_process(DRAW, "auto").split("|")[1], "llvmpipe draws the same bits by every way"


def test_auto_takes_the_first_way_that_works(alone: pytest.MonkeyPatch) -> None:
    library = egl.library(egl.LIBRARY)
    real = egl.devices(library)
    broken = egl.Device(7, 1, [])
    alone.setattr(egl, "devices", lambda _: [broken, *real])
    first, second, *_ = ways("auto")
    assert isinstance(first, Way)
    assert isinstance(second, Way)
    assert (first.route, second.route) == (broken.route, real[0].route)
    with pytest.raises(RouteError, match="EGL_BAD_"):
        first.open(330)
    with open_context() as opened:
        assert opened.route != broken.route


def test_hardware_comes_before_software() -> None:
    class Listing:
        """An EGL with a software device between two hardware ones."""

        def call(self, name: str, room: object, handles: list[int] | None, count: Any) -> int:
            count._obj.value = 3
            if handles is not None:
                handles[:3] = [1, 2, 3]
            return 1

        def eglQueryDeviceStringEXT(self, handle: int, _: int) -> bytes:
            return b"EGL_MESA_device_software EGL_X" if handle == 2 else b"EGL_EXT_device_drm"

    found = egl.devices(Listing())  # type: ignore[arg-type]
    assert [(device.index, device.is_software) for device in found] == [(0, False), (2, False), (1, True)]


def test_the_environment_chooses_where_the_caller_does_not(alone: pytest.MonkeyPatch) -> None:
    alone.setenv("GLBUMP_BACKEND", "osmesa")
    assert context_module._chosen("auto", None) == ("osmesa", None)
    assert context_module._chosen("egl", None) == ("egl", None)
    alone.setenv("GLBUMP_BACKEND", "egl")
    alone.setenv("GLBUMP_DEVICE", "2")
    assert context_module._chosen("auto", None) == ("egl", 2)
    assert context_module._chosen("auto", 1) == ("egl", 1)
    assert context_module._chosen("osmesa", None) == ("osmesa", None)


def test_info_names_driver_and_limits(context: Context) -> None:
    info = context.info
    assert info["version_code"] >= 330
    assert info["max_texture_size"] >= 1024  # the least OpenGL 3.3 allows, as the next two
    assert info["max_cube_size"] >= 1024
    assert info["max_texture_units"] >= 16
    assert info["renderer"]
    assert context.is_software == any(name in info["renderer"].lower() for name in ("llvmpipe", "softpipe"))


# Why not


def test_a_failure_prints_what_was_tried_and_what_mends_it(alone: pytest.MonkeyPatch) -> None:
    alone.setattr(egl, "LIBRARY", "libNoEGL.so.1")
    alone.setattr(osmesa, "LIBRARIES", ("libNoOSMesa.so.8",))
    with pytest.raises(ContextError) as caught:
        open_context()
    head, columns, *rows = str(caught.value).splitlines()
    assert head == "no OpenGL context (OpenGL 3.3 core, backend auto); tried:"
    assert columns.split() == ["route", "library", "error"]
    assert rows[0].split()[:2] == ["egl", "libNoEGL.so.1"]
    assert rows[1].split()[:2] == ["osmesa", "libNoOSMesa.so.8"]
    assert rows[2] == f"  -> {egl.NO_LIBRARY}"
    assert "libegl1 libgl1 libgl1-mesa-dri" in rows[2]
    assert rows[3] == f"  -> {osmesa.MEND}"


def test_a_window_without_a_display_says_so(alone: pytest.MonkeyPatch) -> None:
    code = "from glbump.gl.context import open_context\ntry: open_context('window')\nexcept Exception as e: print(e)"
    said = in_process(code, DISPLAY="", WAYLAND_DISPLAY="")
    assert "glfwInit failed" in said
    assert "xvfb-run" in said


def test_too_old_names_what_there_is_and_what_is_needed(alone: pytest.MonkeyPatch) -> None:
    with pytest.raises(ContextError, match=r"OpenGL is too old: got \d\.\d.*, needed 9\.9 core"):
        open_context("egl", require=990)


def test_egl_errors_have_names() -> None:
    assert egl.error_name(0x3001) == "EGL_NOT_INITIALIZED (0x3001)"
    assert egl.error_name(0x300E) == "EGL_CONTEXT_LOST (0x300e)"
    assert egl.error_name(0x300F) == "EGL error 0x300f"


@pytest.mark.parametrize(
    ("arguments", "environment", "said"),
    [
        ({"backend": "eggl"}, {}, "unknown backend 'eggl'; did you mean 'egl'?"),
        ({}, {"GLBUMP_BACKEND": "osmsa"}, "GLBUMP_BACKEND.* 'osmsa'; did you mean 'osmesa'?"),
        ({}, {"GLBUMP_DEVICE": "first"}, "GLBUMP_DEVICE must be a device index, 0 or more; got 'first'"),
        ({"device": -1}, {}, "device must be an index, 0 or more; got -1"),
        ({"device": True}, {}, "device must be an index, 0 or more; got True"),
        ({"device": 0, "backend": "osmesa"}, {}, "device=0 goes with backend egl; osmesa has no devices"),
    ],
)
def test_wrong_arguments_are_one_line(
    alone: pytest.MonkeyPatch, arguments: dict[str, object], environment: dict[str, str], said: str
) -> None:
    for name, value in environment.items():
        alone.setenv(name, value)
    with pytest.raises(ContextError, match=said) as caught:
        open_context(**arguments)  # type: ignore[arg-type]
    assert "\n" not in str(caught.value)


def test_a_device_that_is_not_there() -> None:
    (attempt,) = ways("egl", 99)
    assert isinstance(attempt, Attempt)
    assert "no such device; there are" in attempt.error


# Misuse


def test_each_context_keeps_its_own_objects(context: Context) -> None:
    with open_context(context.backend) as other:
        ones, halves = red(context, 1.0), red(other, 0.2)
        context.check()
        assert ones.read()[0] == 255
        # Without the check the first context's framebuffer reads the second's pixels, and no error tells.
        other.make_current()
        assert ones.read()[0] == 51
        context.check()
        assert ones.read()[0] == 255
        other.check()
        assert halves.read()[0] == 51


def test_another_thread_is_an_error(context: Context) -> None:
    said = []

    def misuse() -> None:
        for call in (context.check, context.release):
            try:
                call()
            except ContextError as error:
                said.append(str(error))

    thread = threading.Thread(target=misuse)
    thread.start()
    thread.join()
    assert len(said) == 2
    assert all("belongs to the thread that opened it" in text for text in said)
    context.check()


def test_a_thread_may_open_its_own(context: Context) -> None:
    read = []

    def draw() -> None:
        with open_context(context.backend) as own:
            read.append(red(own, 1.0).read()[0])

    thread = threading.Thread(target=draw)
    thread.start()
    thread.join()
    assert read == [255]


def test_after_release_is_an_error(context: Context) -> None:
    with open_context(context.backend) as other:
        pass
    other.release()
    for use in (other.check, other.live_objects, other.__enter__):
        with pytest.raises(ContextError, match="this OpenGL context is released; open a new one"):
            use()


def test_two_backends_at_once_are_an_error(context: Context) -> None:
    other = "osmesa" if context.backend == "egl" else "egl"
    with pytest.raises(ContextError, match=f"cannot open {other} while {context.backend} is open"):
        open_context(other)


def test_a_forked_process_is_an_error() -> None:
    code = """
import os
from glbump.errors import ContextError
from glbump.gl.context import open_context
context = open_context()
read, write = os.pipe()
if os.fork() == 0:
    for call in (context.check, open_context):
        try:
            call()
        except ContextError as error:
            os.write(write, f"{error}|".encode())
    os._exit(0)
os.wait()
print(os.read(read, 9999).decode())
"""
    check, opening, _ = in_process(code).split("|")
    assert "stayed behind in the process forked from" in check
    assert "cannot open OpenGL in a process forked" in opening
    assert 'get_context("spawn")' in check
    assert 'get_context("spawn")' in opening


# Nothing is left behind


def test_opening_and_releasing_leaves_nothing_behind(context: Context) -> None:
    def once() -> dict[str, int]:
        with open_context(context.backend) as opened:
            counts = opened.live_objects()
            pixels = opened.gl.texture((256, 256), 4, dtype="f4")
            framebuffer = opened.gl.framebuffer([pixels])
            framebuffer.use()
            framebuffer.clear()
            assert opened.live_objects()["texture"] == counts["texture"] + 1, "the count sees what lives"
        return counts

    before = context.live_objects()
    first = once()
    for _ in range(4):
        once()
    start = resident_mb()
    for _ in range(30):
        assert once() == first
    # Not released, each would keep 3 MB on llvmpipe; released, 0.02 MB (names that moderngl keeps).
    assert resident_mb() - start < 10
    context.check()
    assert context.live_objects() == before


def test_what_lives_is_counted_however_many_names_came_before(context: Context) -> None:
    with open_context(context.backend) as opened:
        before = opened.live_objects()["buffer"]
        # Mesa gives no name twice, so this one's is past 5,000.
        for _ in range(5000):
            opened.gl.buffer(b"1234").release()
        kept = opened.gl.buffer(b"1234")
        assert opened.live_objects()["buffer"] == before + 1
        kept.release()
        assert opened.live_objects()["buffer"] == before


def test_a_forgotten_context_is_released(context: Context, monkeypatch: pytest.MonkeyPatch) -> None:
    destroyed = []
    opened = open_context(context.backend)
    destroy = opened.native.destroy

    def counted() -> None:
        destroyed.append(True)
        destroy()

    monkeypatch.setattr(opened.native, "destroy", counted)
    context.check()
    del opened
    gc.collect()
    assert destroyed == [True]
    assert context.native.is_current(), "releasing a forgotten context leaves the current one current"


def test_a_framebuffer_can_be_released_while_in_use(context: Context) -> None:
    for _ in range(2):
        framebuffer = context.gl.simple_framebuffer((4, 4))
        framebuffer.use()
        context.unbind()
        framebuffer.release()
    assert context.gl.error == "GL_NO_ERROR"


def test_function_addresses_are_asked_for_once(context: Context) -> None:
    # moderngl keeps every number it is given: equal but new ones would add up.
    asked = [context.native.load_opengl_function("glGetTexLevelParameterfv") for _ in range(2)]
    assert asked[0] is asked[1]
    assert asked[0] != 0
