"""Bad input from end to end: a scene file and `glbump render`, and the same scene through Python.

What each reader says in which words is tested where the reader is (test_bad_pictures.py, test_meshfile.py,
test_scenefile.py). Here: exit 1, one line that names the thing, and nothing written.
"""

from __future__ import annotations

import os
import shutil
import struct
import subprocess
import sys
import weakref
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio
import pytest
from PIL import Image

import glbump as gb
from glbump.cli import run
from glbump.gl import context as context_module
from glbump.gl import egl, osmesa
from glbump.gl.source import find_shaders

SCENE = """
[environment]
kind = "lat-long"
image = "sky.png"

[[surface]]
shape = { kind = "mesh", path = "quad.obj" }
material = { metallic = 1, roughness = 0 }
bump = { height = "bumps.png", amplitude = 0.05 }
"""

CORNERS = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\n"
UV = "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n"
FACE = "f 1/1 2/2 3/3\nf 1/1 3/3 4/4\n"

NOISE = np.random.default_rng(0).integers(0, 256, (16, 32, 3), dtype=np.uint8)
SMALL = ["--size", "16x16", "--quality", "fast"]


@pytest.fixture(autouse=True)
def _folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The working folder holds a small scene that can be drawn; each test breaks one thing of it."""
    monkeypatch.chdir(tmp_path)
    Image.fromarray(NOISE).save("sky.png")
    Image.fromarray(NOISE[..., 0]).save("bumps.png")
    Path("quad.obj").write_text(CORNERS + UV + FACE)
    Path("scene.toml").write_text(SCENE)


def everything() -> dict[str, bytes | None]:
    """Each path below the working folder, and what a file holds."""
    return {str(p): p.read_bytes() if p.is_file() else None for p in Path().rglob("*")}


def refused(capsys: pytest.CaptureFixture[str], *arguments: str, status: int = 1) -> str:
    """The one line that `glbump render scene.toml -o out.png` fails with; it leaves every file as it was."""
    before = everything()
    assert run(["render", "scene.toml", "-o", "out.png", *SMALL, *arguments]) == status
    said = capsys.readouterr()
    assert everything() == before
    assert said.out == ""
    assert said.err.startswith("glbump: error: ")
    assert said.err.endswith("\n")
    assert said.err.count("\n") == 1
    assert len(said.err) < 500
    assert "Traceback" not in said.err
    assert "defect" not in said.err
    return said.err


# Ways to break the scene -----------------------------------------------------------------------------------------

Change = Callable[[], object]


def edit(old: str, new: str, file: str = "scene.toml") -> Change:
    """Put one text in place of another."""

    def change() -> None:
        text = Path(file).read_text()
        assert old in text
        Path(file).write_text(text.replace(old, new, 1))

    return change


def steps(*changes: Change) -> Change:
    return lambda: [change() for change in changes]


def content(file: str, data: bytes | str) -> Change:
    return lambda: Path(file).write_bytes(data if isinstance(data, bytes) else data.encode())


def remove(file: str) -> Change:
    return lambda: Path(file).unlink()


def cut(file: str, share: float) -> Change:
    return lambda: Path(file).write_bytes(Path(file).read_bytes()[: int(share * Path(file).stat().st_size)])


def picture(file: str, pixels: Any) -> Change:
    return lambda: Image.fromarray(pixels).save(file)


def sky(file: str, pixels: Any) -> Change:
    """A picture, and the scene with it for an environment."""
    return steps(picture(file, pixels), edit("sky.png", file))


def floats(file: str, instead: str, shape: tuple[int, ...], one: object = 0.5, rest: object = 0.5) -> Change:
    """A picture that is the same all over but for the pixel in row 3, column 5, in place of another of the scene."""

    def write() -> None:
        pixels = np.full(shape, rest, np.float32)
        pixels[3 % shape[0], 5] = one
        # OpenImageIO itself: write_picture would refuse to write NaN.
        output = oiio.ImageOutput.create(file)
        assert output.open(file, oiio.ImageSpec(shape[1], shape[0], shape[2], "float"))
        assert output.write_image(pixels)
        output.close()

    return steps(write, edit(instead, file))


def bomb() -> bytes:
    """A PNG of some 100 bytes that unpacks to 20,000 x 20,000 pixels."""
    header = struct.pack(">IIBBBBB", 20_000, 20_000, 8, 0, 0, 0, 0)
    parts = (b"IHDR", header), (b"IDAT", zlib.compress(bytes(1000))), (b"IEND", b"")
    chunks = (struct.pack(">I", len(d)) + n + d + struct.pack(">I", zlib.crc32(n + d)) for n, d in parts)
    return b"\x89PNG\r\n\x1a\n" + b"".join(chunks)


def cube(*names: str) -> Change:
    listed = ", ".join(f'"{name}"' for name in names)
    return edit('kind = "lat-long"\nimage = "sky.png"', f'kind = "cube"\nimage = [{listed}]')


def normal_map(file: str) -> Change:
    return edit('height = "bumps.png", amplitude = 0.05', f'normal_map = "{file}"')


@dataclass(frozen=True)
class Case:
    """What is broken, the error's kind, and words that its line holds."""

    name: str
    change: Change
    kind: type[gb.GlbumpError]
    words: tuple[str, ...]


CASES = [
    # Pictures that are none.
    Case("missing picture", remove("sky.png"), gb.ImageError, ("sky.png", "no such file", "check the path")),
    Case("missing heights", remove("bumps.png"), gb.ImageError, ("bumps.png", "no such file")),
    Case("empty picture", content("sky.png", b""), gb.ImageError, ("sky.png", "empty (0 bytes)", "give a picture")),
    Case("text for a picture", content("sky.png", "hello " * 99), gb.ImageError, ("sky.png", "formats: bmp")),
    Case("folder for a picture", edit("sky.png", "."), gb.ImageError, ("is a directory", "give a picture file")),
    Case("truncated PNG", cut("sky.png", 0.6), gb.ImageError, ("sky.png", "truncated", "get a whole copy")),
    Case("truncated EXR", steps(floats("a.exr", "sky.png", (16, 32, 3)), cut("a.exr", 0.9)), gb.ImageError,
         ("a.exr", "damaged or truncated")),
    # The decoder hands out the pixels of this one, and reports the error besides.
    Case("truncated JPEG", steps(sky("a.jpg", NOISE), cut("a.jpg", 0.9)), gb.ImageError,
         ("a.jpg", "Premature end", "get a whole copy")),
    Case("decompression bomb", content("bumps.png", bomb()), gb.ImageError,
         ("bumps.png", "20000x20000", "at most 268435456", "GLBUMP_MAX_PIXELS")),
    # Pictures for another purpose.
    Case("cube not 1:6", edit("lat-long", "cube"), gb.ImageError, ("sky.png", "six", "got 32x16")),
    Case("five faces", cube(*["sky.png"] * 5), gb.SceneError, ("environment.image", "six", "got 5")),
    Case("faces not square", cube(*["sky.png"] * 6), gb.ImageError, ("sky.png", "square", "got 32x16")),
    Case("faces of two sizes",
         steps(picture("b.png", NOISE[:5, :5]), picture("a.png", NOISE[:4, :4]), cube(*["a.png"] * 5, "b.png")),
         gb.ImageError, ("b.png", "5x5", "4x4", "one size")),
    Case("NaN in heights", floats("a.exr", "bumps.png", (16, 16, 1), np.nan), gb.ImageError,
         ("a.exr", "1 of 256 pixels", "row 3, column 5", "1 NaN", "repair")),
    Case("infinity in an environment", floats("a.exr", "sky.png", (16, 32, 3), np.inf), gb.ImageError,
         ("a.exr", "1 of 512 pixels", "row 3, column 5", "not finite")),
    Case("brighter than all floats", floats("a.exr", "sky.png", (16, 32, 3), -3e38), gb.LimitError,
         ("3e+38", "at most 1e+36", "environment.exposure")),
    Case("higher than all floats", floats("a.exr", "bumps.png", (16, 16, 1), 3e38), gb.ImageError,
         ("a.exr", "3e+38", "1e+30", "scale the picture")),
    Case("coloured heights", edit("bumps.png", "sky.png"), gb.ImageError, ("sky.png", "grey", "channel =")),
    Case("no such channel", edit("0.05", '0.05, channel = "a"'), gb.ImageError, ("no channel 'a'", "it has grey")),
    Case("photograph for a normal map", normal_map("sky.png"), gb.ImageError, ("sky.png", "no tangent-space")),
    Case("heights for a normal map", normal_map("bumps.png"), gb.ImageError, ("bumps.png", "use bump.height")),
    Case("a normal into the surface",
         steps(normal_map("bumps.png"), floats("a.exr", "bumps.png", (16, 16, 3), (0, 0, -1), (0, 0, 1))),
         gb.ImageError, ("a.exr", "out of the surface", "row 3, column 5", "mend the map")),
    Case("larger than a texture", floats("a.exr", "bumps.png", (1, 99_999, 1)), gb.LimitError,
         ("surface 0", "99999x1", "at most", "shrink")),
    Case("steeper than all floats", edit("0.05", "1e30"), gb.LimitError, ("surface 0", "amplitude", "at most 1e+12")),
    # Scene files.
    Case("no scene file", remove("scene.toml"), gb.SceneError, ("scene.toml", "no such scene file")),
    Case("empty scene file", content("scene.toml", "\n"), gb.SceneError, ("scene.toml", "is empty")),
    Case("no TOML", edit("[environment]", "[environment"), gb.SceneError, ("scene.toml", "line 2")),
    Case("no UTF-8", content("scene.toml", b"# \xff\n"), gb.SceneError, ("scene.toml", "line 1", "UTF-8")),
    Case("unknown key", edit("metallic", "metalic"), gb.SceneError, ("metalic", "did you mean 'metallic'?")),
    Case("unknown table", edit("[environment]", "[enviroment]"), gb.SceneError, ("did you mean 'environment'?",)),
    Case("unknown shape", edit('"mesh", path = "quad.obj"', '"spere"'), gb.SceneError, ("did you mean 'sphere'?",)),
    Case("unknown environment", edit("lat-long", "latlong"), gb.SceneError, ("did you mean 'lat-long'?", "cube")),
    Case("out of range", edit("roughness = 0", "roughness = 1.5"), gb.SceneError,
         ("surface.0.material.roughness", "at most 1", "got 1.5")),
    Case("NaN in a scene", edit("0.05", "nan"), gb.SceneError, ("surface.0.bump.amplitude", "finite", "got nan")),
    Case("path that climbs", edit("sky.png", "../sky.png"), gb.SceneError,
         ("environment.image", "'../sky.png'", "outside", "move the file there")),
    Case("absolute path", edit("quad.obj", "/etc/quad.obj"), gb.SceneError, ("surface.0.shape.path", "outside")),
    Case("link that climbs",
         steps(lambda: Path("link.png").symlink_to(oiio.__file__), edit("sky.png", "link.png")),
         gb.SceneError, ("environment.image", "'link.png'", "outside")),
    Case("terminal codes in a path", edit("sky.png", "\\u001b[31m.png"), gb.ImageError, ("31m.png",)),
    # Meshes.
    Case("missing mesh", remove("quad.obj"), gb.MeshError, ("quad.obj", "no such mesh file")),
    Case("empty mesh", content("quad.obj", ""), gb.MeshError, ("quad.obj", "is empty")),
    Case("another kind of mesh", edit("quad.obj", "quad.fbx"), gb.MeshError, ("'.fbx'", ".obj, .ply, .stl, .glb")),
    Case("truncated mesh",
         steps(content("a.stl", bytes(80) + struct.pack("<I", 9) + bytes(120)), edit("quad.obj", "a.stl")),
         gb.MeshError, ("a.stl", "9 triangles", "534 bytes", "it has 204")),
    Case("bumps without uv", content("quad.obj", CORNERS + "f 1 2 3\n"), gb.SceneError,
         ("surface 0", "quad.obj", "no texture coordinates", "unwrap")),
    Case("NaN in a mesh", edit("v 1 1 0", "v 1 nan 0", "quad.obj"), gb.MeshError, ("quad.obj", "1 of 4 vertices")),
    Case("infinity in uv", edit("vt 1 1", "vt 1 inf", "quad.obj"), gb.MeshError, ("quad.obj", "texture coordinates")),
    Case("no triangle with an area", content("quad.obj", CORNERS + UV + "f 1/1 1/1 2/2\n"), gb.MeshError,
         ("quad.obj", "none of them has an area")),
    Case("a corner of four numbers", edit("3/3", "3/3//1/1", "quad.obj"), gb.MeshError, ("'3/3//1/1' is no corner",)),
    Case("indices out of range", edit("3/3", "9/3", "quad.obj"), gb.MeshError, ("quad.obj", "there are 4")),
]  # fmt: skip


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_bad_scenes(case: Case, renderer: gb.Renderer, capsys: pytest.CaptureFixture[str]) -> None:
    case.change()
    line = refused(capsys)
    assert [word for word in case.words if word not in line] == []
    with pytest.raises(case.kind) as raised:
        renderer.render(gb.load_scene("scene.toml"), (16, 16), "fast").save("out.png")
    assert type(raised.value) is case.kind
    printable = "".join(c if c.isprintable() else f"\\x{ord(c):02x}" for c in str(raised.value))
    assert line == f"glbump: error: {printable}\n"


def test_the_scene_itself_is_drawn(capsys: pytest.CaptureFixture[str]) -> None:
    """Or every case above could pass for another reason."""
    assert run(["render", "scene.toml", "-o", "out.png", *SMALL]) == 0
    assert Path("out.png").exists()
    assert capsys.readouterr().err == ""


# Sizes and targets -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("size", ["0x16", "16x0", "0", "-1x16", "16x-1", "1000000", "16x1000000", "9" * 30])
def test_sizes(size: str, renderer: gb.Renderer, capsys: pytest.CaptureFixture[str]) -> None:
    line = refused(capsys, "--size", size)
    assert "size" in line
    assert "at least 1 and at most 16384" in line
    width, _, height = size.partition("x")
    with pytest.raises(gb.SceneError) as raised:
        renderer.render(gb.load_scene("scene.toml"), (int(width), int(height or width)))
    assert line == f"glbump: error: {raised.value}\n"


@pytest.mark.parametrize("wrong", [["--size", "12by3"], ["--quality", "balancd"], ["--colour", "red"], ["another"]])
def test_wrong_calls(wrong: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert "glbump render --help" in refused(capsys, *wrong, status=2)


@pytest.mark.parametrize(
    ("target", "words"),
    [
        ("folder.png", ("is a directory", "give the name of a file")),
        ("none/out.png", ("no directory none", "make it first")),
        ("sky.png/out.png", ("no directory sky.png",)),
        ("pipe.png", ("no regular file",)),
        ("out.gif", ("unknown suffix '.gif'", ".png, .jpg")),
        ("out", ("unknown suffix ''", ".png, .jpg")),
        ("/proc/out.png", ("cannot be written", "choose another place")),
        ("x" * 300 + ".png", ("file name too long",)),
        ("sky.png", ("files that this picture is made from", "choose another name")),
        ("folder.png/../bumps.png", ("files that this picture is made from",)),
    ],
)
def test_targets(target: str, words: tuple[str, ...], capsys: pytest.CaptureFixture[str]) -> None:
    Path("folder.png").mkdir()
    os.mkfifo("pipe.png")
    before = {path: path.stat().st_mtime_ns for path in Path().iterdir()}
    assert run(["render", "scene.toml", "-o", target, *SMALL]) == 1
    said = capsys.readouterr()
    assert said.err.startswith(f"glbump: error: {target}")
    assert said.err.count("\n") == 1
    assert [word for word in words if word not in said.err] == []
    assert {path: path.stat().st_mtime_ns for path in Path().iterdir()} == before


FULL = """
import resource, signal, sys
from glbump.cli import run
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (300, 300))
sys.exit(run(sys.argv[1:]))
"""


@pytest.mark.parametrize("target", ["out.png", "out.exr"])
def test_full_disk(target: str) -> None:
    """No file may grow past 300 bytes: the system refuses, as it does on a full disk."""
    Path(target).write_bytes(b"before")
    before = everything()
    # Without Mesa's cache on disk, which the limit would hit first.
    done = subprocess.run(
        [sys.executable, "-c", FULL, "render", "scene.toml", "-o", target, "--size", "64x64"],
        env=os.environ | {"MESA_SHADER_CACHE_DISABLE": "true", "MESA_GLSL_CACHE_DISABLE": "true"},
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert done.stderr.startswith(f"glbump: error: {target}: cannot be written: ")
    assert (done.returncode, done.stdout, done.stderr.count("\n")) == (1, "", 1)
    assert everything() == before


# Drivers and shaders ---------------------------------------------------------------------------------------------


def test_no_driver(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(context_module, "_open", weakref.WeakSet())
    monkeypatch.delenv("GLBUMP_BACKEND", raising=False)
    monkeypatch.setattr(egl, "LIBRARY", "libNoEGL.so.1")
    monkeypatch.setattr(osmesa, "LIBRARIES", ("libNoOSMesa.so.8",))
    before = everything()
    assert run(["render", "scene.toml", "-o", "out.png", *SMALL]) == 1
    assert everything() == before
    head, columns, *rows = capsys.readouterr().err.splitlines()
    assert head == "glbump: error: no OpenGL context (OpenGL 3.3 core, backend auto); tried:"
    assert columns.split() == ["route", "library", "error"]
    assert [row.split()[:2] for row in rows[:2]] == [["egl", "libNoEGL.so.1"], ["osmesa", "libNoOSMesa.so.8"]]
    assert all(row.startswith("  -> ") for row in rows[2:])
    with pytest.raises(gb.ContextError, match="libNoEGL"):
        gb.render(gb.load_scene("scene.toml"), (16, 16))


def test_opengl_too_old(renderer: gb.Renderer) -> None:
    if "Mesa" not in renderer.context.info["version"]:
        pytest.skip("only Mesa can be asked to offer an old version")
    done = subprocess.run(
        [sys.executable, "-m", "glbump", "render", "scene.toml", "-o", "out.png", *SMALL],
        env=os.environ | {"MESA_GL_VERSION_OVERRIDE": "2.1"},
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert (done.returncode, done.stdout) == (1, "")
    assert "OpenGL is too old: got 2.1 Mesa" in done.stderr
    assert "needed 3.3 core" in done.stderr
    assert "update the graphics driver" in done.stderr
    assert not Path("out.png").exists()


@pytest.mark.parametrize(
    ("change", "at", "words"),
    [
        (edit("normalize(bent", "normalise(bent", "broken/lib/bump.glsl"), "normalise(bent", ("normalise",)),
        (edit("vec3 bent", "vec3 bend", "broken/lib/bump.glsl"), "abs(bent)", ("bent", "--debug")),
        (edit("lib/bump.glsl", "lib/bumb.glsl", "broken/bump_input.glsl"), "", ("did you mean 'lib/bump.glsl'?",)),
        (remove("broken/surface.vert"), "", ("no shader file 'surface.vert'",)),
    ],
)
def test_broken_shaders(
    change: Change,
    at: str,
    words: tuple[str, ...],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    shutil.copytree(find_shaders(), "broken")
    change()
    monkeypatch.setenv("GLBUMP_SHADERS", "broken")
    line = refused(capsys)
    assert [word for word in words if word not in line] == []
    if at:
        lines = Path("broken/lib/bump.glsl").read_text().splitlines()
        number = next(n for n, text in enumerate(lines, 1) if at in text)
        assert f" broken/lib/bump.glsl:{number}: " in line
    with pytest.raises(gb.ShaderError):
        gb.render(gb.load_scene("scene.toml"), (16, 16), "fast")
