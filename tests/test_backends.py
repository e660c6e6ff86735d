"""The same renderer draws in every backend, and keeps to its context and its thread."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import threading
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest

import glbump as gb
from glbump.gl import osmesa
from glbump.gl.context import open_context
from glbump.gl.native import RouteError

down, right = np.mgrid[0:32, 0:64] / 64
SKY = np.stack([right, 2 * down, 1 - right], axis=-1).astype(np.float32)
WAVES = (0.5 + 0.25 * (np.sin(8 * np.pi * right) + np.sin(12 * np.pi * down))).astype(np.float32)
RING = gb.Surface(
    gb.Torus(),
    gb.Material((1, 0.9, 0.8), metallic=1, roughness=0),
    gb.Bump(WAVES, 0.05, (4, 2)),
    gb.Transform(rotate=(50, 10, 0)),
)
SCENE = gb.Scene([RING], gb.LatLong(SKY))
SIZE = (64, 64)

# Draws SCENE, asking for a backend by argument or by the environment, and keeps the pixels.
DRAW = """
import sys
import numpy as np
sys.path.insert(0, sys.argv[1])
import glbump as gb
from test_backends import SCENE, SIZE
asked, quality, target = sys.argv[2:]
frame = gb.render(SCENE, SIZE, quality, **({"backend": asked} if asked else {}))
np.save(target, frame.pixels)
print(frame.stats["backend"], frame.stats["renderer"], sep="|")
"""


def draw(
    backend: str, quality: str, target: Path, *before: str, **environment: str
) -> tuple[str, str, npt.NDArray[np.float32]]:
    """The backend taken, the driver's name and the pixels, from a process of its own: one cannot hold two backends."""
    done = subprocess.run(
        [*before, sys.executable, "-c", DRAW, str(Path(__file__).parent), backend, quality, str(target)],
        env={name: value for name, value in os.environ.items() if not name.startswith("GLBUMP_")} | environment,
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert done.returncode == 0, done.stderr
    took, driver = done.stdout.strip().split("|")
    return took, driver, np.load(target)


def need(backend: str) -> tuple[str, ...]:
    """The command that a backend's process is started with; skips the test where it cannot be had."""
    if backend == "osmesa":
        try:
            osmesa._load()
        except RouteError as error:
            pytest.skip(str(error))
    if backend == "window":
        if not shutil.which("xvfb-run"):
            pytest.skip("no xvfb-run, which gives a display")
        return ("xvfb-run", "-a")
    return ()


@pytest.mark.parametrize("backend", ["egl", "osmesa", "window"])
@pytest.mark.parametrize("quality", ["fast", "balanced", "exact"])
def test_every_backend_draws_the_same(backend: str, quality: str, renderer: gb.Renderer, tmp_path: Path) -> None:
    took, driver, pixels = draw(backend, quality, tmp_path / "a.npy", *need(backend))
    assert took == backend
    here = renderer.render(SCENE, SIZE, quality)
    if driver == here.stats["renderer"]:
        assert np.array_equal(pixels, here.pixels), "one driver draws the same bits by every way to it"
    else:
        # Another driver rounds otherwise; along outlines and in steep bumps that shows.
        assert np.percentile(np.abs(pixels - here.pixels), 95) < 2e-3
    assert np.ptp(pixels[..., :3]) > 0.5, "there is something to see"


@pytest.mark.parametrize("backend", ["egl", "osmesa"])
def test_the_environment_variable_chooses(backend: str, tmp_path: Path) -> None:
    need(backend)
    assert draw("", "fast", tmp_path / "a.npy", GLBUMP_BACKEND=backend)[0] == backend
    # What the caller says counts for more.
    assert draw("egl", "fast", tmp_path / "a.npy", GLBUMP_BACKEND=backend)[0] == "egl"


def test_a_wrong_backend_names_the_right_one(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(gb.ContextError, match=r"unknown backend 'elg'; did you mean 'egl'\?"):
        gb.render(SCENE, SIZE, backend="elg")
    monkeypatch.setenv("GLBUMP_BACKEND", "osmessa")
    with pytest.raises(gb.ContextError, match=r"GLBUMP_BACKEND, 'osmessa'; did you mean 'osmesa'\?"):
        gb.render(SCENE, SIZE)


# Misuse ----------------------------------------------------------------------------------------------------------


def test_a_renderer_after_release_is_an_error() -> None:
    renderer = gb.Renderer()
    renderer.render(SCENE, SIZE)
    renderer.release()
    renderer.release()
    for _ in range(2):
        with pytest.raises(gb.ContextError, match=r"^cannot render: this renderer is released; make a new one$"):
            renderer.render(SCENE, SIZE)
    with gb.Renderer() as again:
        again.render(SCENE, SIZE)
    with pytest.raises(gb.ContextError, match="released"):
        again.render(SCENE, SIZE)


def test_a_renderer_whose_context_is_gone(renderer: gb.Renderer) -> None:
    with open_context(renderer.context.backend) as opened:
        guest = gb.Renderer(context=opened)
        guest.render(SCENE, SIZE)
    with pytest.raises(gb.ContextError, match="this OpenGL context is released"):
        guest.render(SCENE, SIZE)
    guest.release()
    # And a guest that leaves first leaves nothing behind.
    renderer.render(SCENE, SIZE)
    before = renderer.context.live_objects()
    with gb.Renderer(context=renderer.context) as guest:
        guest.render(SCENE, SIZE)
    renderer.render(SCENE, SIZE)  # A program lives on while it is the one in use.
    assert renderer.context.live_objects() == before
    with pytest.raises(gb.ContextError, match="this renderer is released"):
        guest.render(SCENE, SIZE)


def test_a_renderer_on_another_thread_is_an_error(renderer: gb.Renderer) -> None:
    before = renderer.render(SCENE, SIZE).pixels
    said = []

    def misuse() -> None:
        for call in (lambda: renderer.render(SCENE, SIZE), renderer.release):
            try:
                call()
            except gb.ContextError as error:
                said.append(str(error))

    thread = threading.Thread(target=misuse)
    thread.start()
    thread.join()
    assert len(said) == 2
    assert all("belongs to the thread that opened it" in text and "\n" not in text for text in said)
    assert np.array_equal(renderer.render(SCENE, SIZE).pixels, before), "its own thread draws on"


def test_an_error_leaves_the_renderer_as_it_was(renderer: gb.Renderer, tmp_path: Path) -> None:
    before = renderer.render(SCENE, SIZE).pixels
    objects = renderer.context.live_objects()
    wrong = [
        replace(SCENE, environment=gb.LatLong(tmp_path / "none.png")),
        replace(SCENE, environment=gb.LatLong(np.full_like(SKY, np.nan))),
        replace(SCENE, surfaces=[replace(RING, bump=gb.Bump(tmp_path / "none.png", 1))]),
        replace(SCENE, surfaces=[RING, replace(RING, shape=gb.MeshFile(tmp_path / "none.obj"))]),
    ]
    for scene in wrong:
        with pytest.raises(gb.GlbumpError):
            renderer.render(scene, SIZE)
        assert np.array_equal(renderer.render(SCENE, SIZE).pixels, before)
    assert renderer.context.live_objects() == objects


# Several at once -------------------------------------------------------------------------------------------------


def test_two_renderers_take_turns(renderer: gb.Renderer) -> None:
    other_scene = replace(SCENE, surfaces=[gb.Surface(gb.Cube(), gb.Material(metallic=1, roughness=0))])
    ring, cube = (renderer.render(scene, SIZE).pixels for scene in (SCENE, other_scene))
    with gb.Renderer() as other:
        for scene, wanted in ((SCENE, ring), (other_scene, cube)) * 2:
            for one in (renderer, other, renderer):
                assert np.array_equal(one.render(scene, SIZE).pixels, wanted)
    assert np.array_equal(renderer.render(SCENE, SIZE).pixels, ring), "the one outlives the other"


def test_releasing_one_renderer_leaves_the_other_its_objects() -> None:
    """Two that have done the same have given the same names to their objects."""
    with gb.Renderer() as kept, gb.Renderer() as other:
        before = kept.render(SCENE, SIZE).pixels
        other.render(SCENE, SIZE)
        objects = kept.context.live_objects()  # and makes this context the current one
        other.release()
        assert kept.context.live_objects() == objects
        assert np.array_equal(kept.render(SCENE, SIZE).pixels, before)


def test_threads_with_a_renderer_each(renderer: gb.Renderer) -> None:
    turns = [0, 90, 180, 270]
    scenes = [replace(SCENE, environment=replace(SCENE.environment, rotation=turn)) for turn in turns]
    wanted = [renderer.render(scene, SIZE, "fast").pixels for scene in scenes]
    both = threading.Barrier(2)

    def work(mine: list[gb.Scene]) -> list[npt.NDArray[np.float32]]:
        with gb.Renderer() as own:
            both.wait(60)  # both contexts are open while either draws
            return [own.render(scene, SIZE, "fast").pixels for scene in mine * 3]

    with ThreadPoolExecutor(2) as pool:
        first, second = pool.map(work, [scenes[:2], scenes[2:]])
    assert all(np.array_equal(a, b) for a, b in zip(first, wanted[:2] * 3, strict=True))
    assert all(np.array_equal(a, b) for a, b in zip(second, wanted[2:] * 3, strict=True))
    assert np.array_equal(renderer.render(SCENE, SIZE, "fast").pixels, wanted[0])
