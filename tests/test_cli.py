"""The command line: what it accepts, prints and leaves behind."""

from __future__ import annotations

import errno
import io
import json
import os
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from glbump import cli
from glbump.cli import run
from glbump.demo import EXHIBITS
from glbump.errors import ContextError
from glbump.gl import doctor
from glbump.maps.files import write_picture
from glbump.maps.images import TONES, read_colour
from glbump.progress import progress
from glbump.quality import PRESETS
from glbump.scenefile import load_scene

COMMANDS = tuple(cli.cli.commands)

SCENE = """
[environment]
kind = "lat-long"
image = "sky.png"
[[surface]]
shape = { kind = "sphere" }
material = { metallic = 1, roughness = 0 }
bump = { height = "bumps.png", amplitude = 0.05, repeat = [2, 1] }
"""


@pytest.fixture(autouse=True)
def _folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """An empty working folder with a small scene in it."""
    monkeypatch.chdir(tmp_path)
    down, right = np.mgrid[0:16, 0:32] / 32
    write_picture("sky.png", np.stack([right, down, 1 - right], axis=-1).astype(np.float32))
    write_picture("bumps.png", (0.5 + 0.5 * np.sin(right * 2 * np.pi)).astype(np.float32))
    Path("scene.toml").write_text(SCENE)


def words(text: str) -> list[str]:
    return text.replace(",", " ").replace("(", " ").replace(")", " ").replace(".", " ").split()


def strict_json(text: str) -> Any:
    """Python writes NaN and Infinity, which are no JSON; here they fail."""

    def refuse(constant: str) -> None:
        raise AssertionError(f"{constant} is no JSON")

    return json.loads(text, parse_constant=refuse)


# ------------------------------------------------------------------------------------------------ help, wrong calls


@pytest.mark.parametrize("command", COMMANDS)
def test_help_has_an_example(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run([command, "--help"]) == 0
    out = capsys.readouterr().out
    assert f"  glbump {command}" in out
    assert "--debug" in out
    assert "--quiet" in out


def test_help_names_every_quality_and_tone(capsys: pytest.CaptureFixture[str]) -> None:
    run(["render", "--help"])
    said = words(capsys.readouterr().out)
    assert {*PRESETS, *TONES} <= set(said)


def test_version_is_the_installed_one(capsys: pytest.CaptureFixture[str]) -> None:
    import glbump

    assert run(["--version"]) == 0
    assert capsys.readouterr().out == f"glbump {glbump.__version__}\n"


def test_no_command_shows_help_and_is_a_wrong_call(capsys: pytest.CaptureFixture[str]) -> None:
    assert run([]) == 2
    assert "Commands:" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["rendr"], "render"),
        (["render"], "SCENE"),
        (["render", "scene.toml"], "--output"),
        (["render", "scene.toml", "-o", "a.png", "--size", "12by3"], "WIDTHxHEIGHT"),
        (["render", "scene.toml", "-o", "a.png", "--quality", "balancd"], "did you mean 'balanced'"),
        (["render", "scene.toml", "-o", "a.png", "--tone", "filmik"], "did you mean 'filmic'"),
        (["render", "scene.toml", "-o", "a.png", "--exposure", "bright"], "--exposure"),
        (["render", "scene.toml", "-o", "a.png", "--samples", "4"], "--reference"),
        (["render", "scene.toml", "-o", "a.png", "--sise", "3x3"], "--size"),
        (["diff", "a.png", "b.png", "--max", "2/0"], "--max"),
        (["diff", "a.png", "b.png", "--max", "two"], "2/255"),
        (["diff", "a.png", "b.png", "--max", "300"], "within 0 and 1"),
        (["demo", "--only", "brick-bal"], "did you mean 'brick-ball'"),
    ],
)
def test_wrong_calls(arguments: list[str], said: str, capsys: pytest.CaptureFixture[str]) -> None:
    before = set(Path().iterdir())
    assert run(arguments) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.startswith("glbump: error: ")
    assert captured.err.count("\n") == 1
    assert said in captured.err
    assert set(Path().iterdir()) == before


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["render", "nothere.toml", "-o", "a.png"], "nothere.toml"),
        (["render", "sky.png", "-o", "a.png"], "sky.png"),
        (["render", "scene.toml", "-o", "a.png", "--size", "0x8"], "at least 1"),
        (["render", "scene.toml", "-o", "a.png", "--size", "-1x8"], "at least 1"),
        (["render", "scene.toml", "-o", "a.png", "--size", "1000000x8"], "at most"),
        (["render", "scene.toml", "-o", "a.png", "--set", "surface.0.bumb.amplitude=1"], "bump"),
        (["render", "scene.toml", "-o", "a.png", "--set", "surface.1.bump.amplitude=1"], "surface.1"),
        (["render", "scene.toml", "-o", "a.png", "--set", "camera.fov=wide"], "camera.fov"),
        (["render", "scene.toml", "-o", "a.png", "--backend", "metal"], "metal"),
        (["render", "scene.toml", "-o", "a.gif", "--size", "8x8"], ".gif"),
        (["render", "scene.toml", "-o", "no/such/a.png", "--size", "8x8"], "no/such"),
        (["render", "scene.toml", "-o", "a.png", "--reference", "--samples", "3"], "square"),
        (["diff", "sky.png", "nothere.png"], "nothere.png"),
        (["diff", "sky.png", "scene.toml"], "scene.toml"),
    ],
)
def test_bad_input(arguments: list[str], said: str, capsys: pytest.CaptureFixture[str]) -> None:
    before = set(Path().iterdir())
    assert run(arguments) == 1
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.startswith("glbump: error: ")
    assert captured.err.count("\n") == 1
    assert said in captured.err
    assert "Traceback" not in captured.err
    assert set(Path().iterdir()) == before


def test_debug_shows_the_traceback() -> None:
    with pytest.raises(Exception, match=r"nothere\.toml"):
        run(["render", "nothere.toml", "-o", "a.png", "--debug"])


@pytest.mark.parametrize(
    ("raised", "status", "said"),
    [
        (KeyboardInterrupt(), 130, "glbump: interrupted\n"),
        (ContextError("no driver"), 1, "glbump: error: no driver\n"),
        (
            OSError(errno.ENOSPC, "No space left on device", "a.png"),
            1,
            "glbump: error: No space left on device: a.png\n",
        ),
        (MemoryError(), 1, "glbump: error: out of memory; choose a smaller --size\n"),
        (TypeError("two\nlines"), 1, "a defect of glbump"),
    ],
)
def test_whatever_happens_is_one_line(
    raised: BaseException,
    status: int,
    said: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    def fail(*_: object) -> None:
        raise raised

    monkeypatch.setattr("glbump.scenefile.load_scene", fail)
    assert run(["render", "scene.toml", "-o", "a.png"]) == status
    captured = capsys.readouterr()
    assert captured.out == ""
    assert said in captured.err
    assert captured.err.count("\n") == 1


# ----------------------------------------------------------------------------------------------------- the commands


def test_render_writes_the_picture_and_says_so(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["render", "scene.toml", "-o", "a.png", "--size", "24x16"]) == 0
    assert read_colour(Path("a.png")).pixels.shape == (16, 24, 3)
    assert capsys.readouterr().out == "a.png  24x16\n"


def test_one_number_is_a_square() -> None:
    assert run(["render", "scene.toml", "-o", "a.png", "--size", "24"]) == 0
    assert read_colour(Path("a.png")).pixels.shape == (24, 24, 3)


def test_quiet_prints_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["render", "scene.toml", "-o", "a.png", "--size", "8x8", "-q"]) == 0
    assert capsys.readouterr() == ("", "")


def test_render_json(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["render", "scene.toml", "-o", "a.exr", "--size", "8x8", "--quality", "fast", "--json"]) == 0
    said = strict_json(capsys.readouterr().out)
    assert said["path"] == "a.exr"
    assert said["size"] == [8, 8]
    assert {"backend", "renderer", "plan", "ms"} <= said["stats"].keys()
    assert said["stats"]["plan"]["samples"] == "1"


def test_set_tone_and_exposure_change_the_picture() -> None:
    def pixels(*options: str) -> Any:
        assert run(["render", "scene.toml", "-o", "a.png", "--size", "16x16", "-q", *options]) == 0
        return read_colour(Path("a.png")).pixels

    plain = pixels()
    assert np.array_equal(plain, pixels("--set", "surface.0.bump.amplitude=0.05"))
    for options in (
        ("--set", "surface.0.bump.amplitude=0"),
        ("--set", "environment.rotation=90", "--set", "camera.fov=20"),
        ("--tone", "filmic"),
        ("--exposure", "-1"),
    ):
        assert np.abs(plain - pixels(*options)).max() > 0.05, options


def test_reference_draws_the_same_picture(capsys: pytest.CaptureFixture[str]) -> None:
    size = ["--size", "32x32", "-q"]
    assert run(["render", "scene.toml", "-o", "drawn.exr", "--quality", "exact", *size]) == 0
    assert run(["render", "scene.toml", "-o", "truth.exr", "--reference", "--samples", "16", *size]) == 0
    assert run(["diff", "drawn.exr", "truth.exr", "--json"]) == 0
    # Along the outline a sample may fall on the other side; the agreement itself is tested in test_render.py.
    assert strict_json(capsys.readouterr().out)["mean"] < 1 / 255


def test_diff_of_equal_pictures(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["diff", "sky.png", "sky.png", "--max", "0", "--json"]) == 0
    said = strict_json(capsys.readouterr().out)
    assert (said["max"], said["psnr"]) == (0, None)


def test_diff_is_a_gate_and_draws(capsys: pytest.CaptureFixture[str]) -> None:
    pixels = read_colour(Path("sky.png")).pixels
    write_picture("other.png", np.where(pixels > 0.5, pixels * 0.9, pixels))
    assert run(["diff", "sky.png", "other.png", "-o", "d.png", "--max", "1"]) == 0
    captured = capsys.readouterr()
    assert captured.out.startswith("max    0.0")
    shown = read_colour(Path("d.png")).pixels
    assert shown.shape == pixels.shape
    assert ((shown > 0) <= (pixels > 0.5)).all()
    assert shown.max() > 0.05

    assert run(["diff", "sky.png", "other.png", "--max", "2/255", "-q"]) == 1
    captured = capsys.readouterr()
    assert captured.out == ""
    assert "--max allows 0.007843" in captured.err


def test_diff_sees_transparency(capsys: pytest.CaptureFixture[str]) -> None:
    opaque = np.full((4, 4, 4), 0.5, np.float32)
    opaque[..., 3] = 1
    clear = opaque.copy()
    clear[0, 0, 3] = 0
    write_picture("a.png", opaque)
    write_picture("b.png", clear)
    assert run(["diff", "a.png", "b.png", "--max", "0.5", "-q"]) == 1


def test_demo_writes_pictures_and_scenes_that_draw_them(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["demo", "-o", "gallery", "--only", "axes", "--quality", "fast"]) == 0
    assert capsys.readouterr().out.startswith("gallery/axes.png  ")
    exhibit = next(e for e in EXHIBITS if e.name == "axes")
    width, height = exhibit.size
    assert read_colour(Path("gallery/axes.png")).pixels.shape == (height, width, 3)
    assert load_scene("gallery/scenes/axes.toml")
    render = ["render", "gallery/scenes/axes.toml", "-o", "again.png", "--size", f"{width}x{height}"]
    assert run([*render, "--quality", "fast", "--tone", "filmic", "--exposure", str(exhibit.exposure), "-q"]) == 0
    assert Path("again.png").read_bytes() == Path("gallery/axes.png").read_bytes()


@pytest.mark.parametrize("chosen", ["egl", None])
def test_doctor_fails_where_there_is_no_opengl(
    chosen: str | None, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    # What the report holds is tested in test_doctor.py.
    monkeypatch.setattr(doctor, "report", lambda: {"chosen": chosen, "limit": float("inf")})
    monkeypatch.setattr(doctor, "text", lambda report: f"chosen: {report['chosen']}")
    status = 0 if chosen else 1
    assert run(["doctor"]) == status
    assert capsys.readouterr().out == f"chosen: {chosen}\n"
    assert run(["doctor", "--json"]) == status
    assert strict_json(capsys.readouterr().out) == {"chosen": chosen, "limit": None}


# ---------------------------------------------------------------------------------------------------- the surroundings


def glbump(*arguments: str, **options: Any) -> subprocess.Popen[str]:
    """The command as a shell starts it."""
    return subprocess.Popen(
        [sys.executable, "-m", "glbump", *arguments],
        stdin=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        **options,
    )


def test_broken_pipe_is_silent() -> None:
    reader, writer = os.pipe()
    os.close(reader)
    with glbump("--help", stdout=writer) as process:
        os.close(writer)
        _, errors = process.communicate()
    assert (process.returncode, errors) == (1, "")


@pytest.mark.skipif(not Path("/dev/full").is_char_device(), reason="no /dev/full here")
def test_full_disk_is_an_error() -> None:
    with Path("/dev/full").open("w") as full, glbump("--help", stdout=full) as process:
        _, errors = process.communicate()
    assert process.returncode == 1
    assert errors == "glbump: error: No space left on device\n"


_NOT_FOR_A_MIRROR = {
    f"glbump.{name}"
    for name in (
        *("maps.suns", "maps.diffuse", "maps.gloss", "maps.dfg", "maps.normals", "maps.faces"),
        *("maps.convert", "maps.remap", "maps.containers", "maps.lint", "maps.animation", "meshfile", "mikktspace"),
        *(
            "reference.lobe",
            "reference.ggx",
            "reference.shade",
            "reference.cast",
            "displace",
            "demo",
            "trade",
            "viewer",
        ),
    )
}


def test_render_imports_only_what_it_uses() -> None:
    code = (
        "import sys; from glbump.cli import run\n"
        "assert run(['render', 'scene.toml', '-o', 'a.png', '--size', '8x8', '-q']) == 0\n"
        "print(*sys.modules)"
    )
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    assert {"trimesh", "rich", "PIL", "glfw", "scipy", "skimage", "pytest"} & set(loaded) == set()
    # Nor of glbump itself: a mirror in a picture mirrors, and that is all.
    assert _NOT_FOR_A_MIRROR & set(loaded) == set()
    # OpenGL is not imported where none is used.
    code = code.replace("'-q'", "'-q', '--reference', '--samples', '1'")
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    assert {"moderngl", "glcontext", "trimesh", "rich", "PIL"} & set(loaded) == set()


class Terminal(io.StringIO):
    """A stream that says it is a terminal."""

    def isatty(self) -> bool:
        return True


def test_progress_is_for_terminals_and_for_what_lasts(monkeypatch: pytest.MonkeyPatch) -> None:
    def shown(stream: io.StringIO, patience: float, **options: Any) -> str:
        monkeypatch.setattr(sys, "stderr", stream)
        monkeypatch.setattr("glbump.progress.PATIENCE", patience)
        with progress("baking", 2, **options) as step:
            for _ in range(2):
                step()
                # Long enough for the thread to start drawing where it is to.
                for _ in range(200):
                    if "baking" in stream.getvalue() or patience > 1 or not stream.isatty() or options:
                        break
                    time.sleep(0.02)
        return stream.getvalue()

    monkeypatch.setenv("TERM", "xterm")
    assert "baking" in shown(Terminal(), 0)
    assert shown(Terminal(), 1000) == ""
    assert shown(Terminal(), 0, shown=False) == ""
    assert shown(io.StringIO(), 0) == ""
