"""Odd input that is right: drawn, finite, and as the same scene said in an even way."""

from __future__ import annotations

import io
import subprocess
import sys
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
from test_bad_input import CORNERS, FACE, UV

import glbump as gb
from glbump.cli import run
from glbump.maps.images import read_picture, write_picture

NOISE = np.random.default_rng(0).random((16, 32, 3), np.float32)
HEIGHTS = NOISE[..., 0]
MIRROR = gb.Material(metallic=1, roughness=0)
BALL = gb.Scene([gb.Surface(gb.Sphere(), MIRROR, gb.Bump(HEIGHTS, 0.05))], gb.LatLong(NOISE))

SCENE = """
[environment]
kind = "lat-long"
image = "sky.exr"
[[surface]]
shape = { kind = "mesh", path = "quad.obj" }
material = { metallic = 1, roughness = 0 }
bump = { height = "bumps.exr", amplitude = 0.05 }
"""


@pytest.fixture(autouse=True)
def _folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The working folder is an empty one."""
    monkeypatch.chdir(tmp_path)


def make_scene(folder: Path = Path()) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    write_picture(folder / "sky.exr", NOISE)
    write_picture(folder / "bumps.exr", HEIGHTS)
    (folder / "quad.obj").write_text(CORNERS + UV + FACE)
    (folder / "scene.toml").write_text(SCENE)


def drawn(*arguments: str, scene: str = "scene.toml", target: str = "out.exr") -> npt.NDArray[np.float32]:
    """The picture that `glbump render` makes, linear light."""
    assert run(["render", scene, "-o", target, "--size", "48x48", "--quality", "fast", "-q", *arguments]) == 0
    return read_picture(Path(target)).pixels


def pixels(renderer: gb.Renderer, scene: gb.Scene, quality: str = "fast") -> npt.NDArray[np.float32]:
    got = renderer.render(scene, (48, 48), quality).pixels
    assert np.isfinite(got).all()
    return got


# Files and names -------------------------------------------------------------------------------------------------


def test_paths_are_relative_to_the_scene_whatever_its_name() -> None:
    make_scene()
    plain = drawn()
    folder = Path("a folder/mit Umlaut ü/図")
    make_scene(folder)
    assert np.array_equal(drawn(scene=f"{folder}/scene.toml", target="ünï 図.exr"), plain)
    (folder / "deeper").mkdir()
    (folder / "sky.exr").rename(folder / "deeper/- sky #1.exr")
    (folder / "scene.toml").write_text(SCENE.replace("sky.exr", "./deeper/../deeper/- sky #1.exr"))
    assert np.array_equal(drawn(scene=f"{folder}/scene.toml", target=f"{folder}/.hidden.exr"), plain)


def test_the_content_says_what_a_picture_is_not_its_name() -> None:
    make_scene()
    plain = drawn()
    Path("sky.exr").rename("sky.png")
    Path("scene.toml").write_text("\ufeff" + SCENE.replace("sky.exr", "sky.png").replace("\n", "\r\n"))
    assert np.array_equal(drawn(), plain)


@pytest.mark.skipif(sys.platform != "linux", reason="names of files are text elsewhere")
def test_names_that_are_no_text() -> None:
    make_scene()
    odd = b"odd \xff.".decode(errors="surrogateescape")
    command = [sys.executable, "-m", "glbump", "render", "scene.toml", "--size", "8x8", "-o"]
    for suffix, status in (("png", 0), ("exr", 1)):  # OpenImageIO, which writes .exr, takes names in UTF-8
        done = subprocess.run([*command, odd + suffix], capture_output=True, text=True, errors="surrogateescape")
        assert done.returncode == status, done.stderr
        assert Path(odd + suffix).exists() == (status == 0)
        assert done.stderr.count("\n") == status
    assert r"odd \udcff.exr: is no name in UTF-8" in done.stderr
    with pytest.raises(gb.ImageError, match="no UTF-8 text; rename"):
        read_picture(Path(odd + "png"))


def test_an_earlier_picture_is_replaced() -> None:
    make_scene()
    Path("elsewhere").mkdir()
    Path("elsewhere/real.exr").write_bytes(b"before")
    Path("out.exr").symlink_to("elsewhere/real.exr")
    drawn()
    assert Path("out.exr").is_symlink()
    assert read_picture(Path("elsewhere/real.exr")).pixels.shape == (48, 48, 3)
    assert sorted(path.name for path in Path("elsewhere").iterdir()) == ["real.exr"]


# Meshes and pictures ---------------------------------------------------------------------------------------------


def test_mirrored_uv_are_drawn() -> None:
    make_scene()
    plain = drawn()
    # The picture turned over, on coordinates turned over, is the picture.
    Path("quad.obj").write_text(CORNERS + UV + "f 1/2 2/1 3/4\nf 1/2 3/4 4/3\n")
    write_picture("bumps.exr", HEIGHTS[:, ::-1])
    turned = drawn()
    assert np.abs(turned - plain).max() < 0.02
    write_picture("bumps.exr", HEIGHTS)
    assert np.abs(drawn() - plain).max() > 0.1


def test_triangles_without_area_are_left_out_and_noted(capsys: pytest.CaptureFixture[str]) -> None:
    make_scene()
    plain = drawn()
    Path("quad.obj").write_text(CORNERS + UV + FACE + "f 1/1 1/1 3/3\n")
    assert run(["render", "scene.toml", "-o", "again.exr", "--size", "48x48", "--quality", "fast"]) == 0
    assert np.array_equal(read_picture(Path("again.exr")).pixels, plain)
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert "quad.obj: 1 of 3 triangles have no area; they are left out" in said


def test_equal_channels_are_grey_and_one_may_be_chosen() -> None:
    make_scene()
    plain = drawn()
    write_picture("bumps.exr", np.repeat(HEIGHTS[..., None], 3, axis=2))
    assert np.array_equal(drawn(), plain)
    write_picture("bumps.exr", NOISE)
    assert np.array_equal(drawn("--set", "surface.0.bump.channel=r"), plain)
    assert not np.array_equal(drawn("--set", "surface.0.bump.channel=g"), plain)


def test_values_that_are_right_only_together() -> None:
    make_scene()
    # Eye and target trade places: after the first of the two they are the same point.
    drawn("--set", "camera.eye=[0,0,0]", "--set", "camera.target=[0,0,4]")
    assert run(["render", "scene.toml", "-o", "out.png", "--set", "camera.eye=[0,0,0]"]) == 1


@pytest.mark.parametrize("shape", [(1, 1), (1, 2), (2, 1), (1, 50), (50, 1), (3, 3)])
@pytest.mark.parametrize("quality", ["fast", "balanced", "exact"])
def test_tiny_heights(renderer: gb.Renderer, shape: tuple[int, int], quality: str) -> None:
    ball = replace(BALL.surfaces[0], bump=gb.Bump(np.resize(HEIGHTS, shape), 0.05))
    bumped = pixels(renderer, replace(BALL, surfaces=[ball]), quality)
    flat = pixels(renderer, replace(BALL, surfaces=[replace(ball, bump=None)]), quality)
    # Central differences of one or two texels that repeat are 0.
    assert (np.abs(bumped - flat).max() < 1e-3) == (max(shape) <= 2)


@pytest.mark.parametrize("quality", ["fast", "balanced", "exact"])
def test_tiny_environments(renderer: gb.Renderer, quality: str) -> None:
    for environment in (gb.LatLong(NOISE[:1, :2]), gb.CubeMap(NOISE[:6, :1]), gb.CubeMap(NOISE[:12, :2])):
        for material in (MIRROR, gb.Material()):
            got = pixels(renderer, gb.Scene([gb.Surface(gb.Sphere(), material)], environment), quality)
            assert got[..., :3].min() > 0.9 * NOISE.min()
            assert got[..., :3].max() < 1.001


# Numbers ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("quality", ["fast", "balanced", "exact"])
def test_heights_in_any_unit(renderer: gb.Renderer, quality: str) -> None:
    """Slopes of heights in millimetres pass the largest half float; the picture is that of the same in metres."""
    mountains = [
        replace(BALL, surfaces=[replace(BALL.surfaces[0], bump=gb.Bump(HEIGHTS * 1e6 * unit, 5e-8 / unit))])
        for unit in (1.0, 2.0**-20)
    ]
    large, small = (pixels(renderer, scene, quality) for scene in mountains)
    # Half floats are right to 2^-11 of a slope.
    assert np.percentile(np.abs(large - small), 99) < 5e-3
    flat = pixels(renderer, replace(BALL, surfaces=[gb.Surface(gb.Sphere(), MIRROR)]), quality)
    assert np.abs(large - flat).max() > 0.1


def test_light_below_the_lowest_half_float(renderer: gb.Renderer) -> None:
    for value in (-7e4, 7e4, 1e35, -1e35):
        scene = replace(BALL, environment=gb.LatLong(np.full((8, 16, 3), value, np.float32)))
        for quality in ("fast", "balanced", "exact"):
            assert pixels(renderer, scene, quality)[..., :3] == pytest.approx(value, rel=1e-3)


EYES = [(0, 0, 0.5), (0, 0, 1), (0, 0, 1 + 1e-7), (1e-18, 0, 0), (0, 0, 1e9), (0, 0, 1e18)]
SHAPES = [gb.Sphere(), gb.Torus(), gb.Cube(), gb.Plane(), gb.Quad(), gb.Torus(1, 1e-12), gb.Torus(1, 1 - 1e-9)]


@pytest.mark.parametrize("shape", SHAPES, ids=str)
def test_the_eye_anywhere(renderer: gb.Renderer, shape: gb.Sphere) -> None:
    """Inside, exactly on a surface, and as far away as there is."""
    surface = replace(BALL.surfaces[0], shape=shape)
    for eye in EYES:
        pixels(renderer, replace(BALL, surfaces=[surface], camera=gb.Camera(eye, (0, 0.3, -1))))


@pytest.mark.parametrize("scale", [1e-18, 1e-12, 1e12, 1e18, -1, (1e-3, 1e3, 1), (1, -2, 3)])
def test_any_scale(renderer: gb.Renderer, scale: float) -> None:
    transform = gb.Transform(scale=scale)
    for shape in (gb.Sphere(), gb.Torus(), gb.Quad()):
        # Bumps that high on a surface that small are refused.
        plain = gb.Surface(shape, MIRROR, transform=transform)
        for surface in (plain, replace(plain, bump=gb.Bump(HEIGHTS, 1e-20)), replace(plain, material=gb.Material())):
            pixels(renderer, replace(BALL, surfaces=[surface]))


CAMERAS = [
    {"fov": 179},
    {"fov": 1e-6},
    {"near": 10},
    {"far": 0.1},
    {"near": 1e-18, "far": 1e18},
    {"eye": (-0.0, -0.0, 4.0)},
    {"projection": "orthographic", "height": 1e-18},
    {"projection": "orthographic", "height": 1e18},
]
REPEATS = [1e6, 1e-6, (1e6, 1e-300)]
MATERIALS = [gb.Material(metallic=1, roughness=r) for r in (1e-9, 1e-30, 1)] + [
    gb.Material((0, 0, 0), ior=1, roughness=0),
    gb.Material(ior=10, roughness=1),
    gb.Material((-0.0, 1, 1e-30), metallic=-0.0, roughness=-0.0),
]


def test_numbers_at_their_ends(renderer: gb.Renderer) -> None:
    for values in CAMERAS:
        pixels(renderer, replace(BALL, camera=gb.Camera(**values)))  # type: ignore[arg-type]
    for repeat in REPEATS:
        bump = gb.Bump(HEIGHTS, 0.05, repeat)  # type: ignore[arg-type]
        pixels(renderer, replace(BALL, surfaces=[replace(BALL.surfaces[0], bump=bump)]))
    for material in MATERIALS:
        pixels(renderer, replace(BALL, surfaces=[replace(BALL.surfaces[0], material=material)]))
    for environment in ({"rotation": 1e300}, {"rotation": -0.0}, {"exposure": 64}, {"exposure": -64}):
        pixels(renderer, replace(BALL, environment=replace(BALL.environment, **environment)))


def test_the_largest_frames_a_side(renderer: gb.Renderer) -> None:
    for size in ((16384, 1), (1, 16384), (1, 1)):
        frame = renderer.render(BALL, size, "fast")
        assert frame.size == size
        assert np.isfinite(frame.pixels).all()


# How many --------------------------------------------------------------------------------------------------------


def test_two_hundred_bumped_surfaces(renderer: gb.Renderer) -> None:
    """More of them than a driver has texture units, each with its own bumps."""
    surfaces = [
        gb.Surface(
            gb.Sphere(0.1),
            MIRROR,
            gb.Bump(np.roll(HEIGHTS, i, axis=1), 0.01),
            gb.Transform((i % 20 / 10 - 0.95, i // 20 / 5 - 0.9, 0)),
        )
        for i in range(200)
    ]
    scene = gb.Scene(surfaces, gb.LatLong(NOISE), gb.Camera(projection="orthographic", height=2))
    # The last row of balls alone is the same as among the others, bump for bump.
    whole, last, none = (
        renderer.render(replace(scene, surfaces=s), (200, 200), "fast").pixels[:19]
        for s in (surfaces, surfaces[-20:], ())
    )
    assert np.array_equal(whole, last)
    assert not np.array_equal(whole, none)


def test_no_surface_is_the_sky(renderer: gb.Renderer) -> None:
    with_none = pixels(renderer, replace(BALL, surfaces=()))
    behind = gb.Surface(gb.Sphere(), MIRROR, transform=gb.Transform((0, 0, 9)))
    assert np.array_equal(with_none, pixels(renderer, replace(BALL, surfaces=[behind])))
    dark = replace(BALL, surfaces=(), environment=replace(BALL.environment, background=False))
    assert not pixels(renderer, dark).any()


# Calls from Python -----------------------------------------------------------------------------------------------

NO_SCENES = (None, "scene.toml", {}, [BALL], gb.Scene)
NO_PATHS = (None, 3, b"a.png", io.BytesIO())


def test_whatever_is_passed_is_refused_in_one_line(renderer: gb.Renderer) -> None:
    frame = renderer.render(BALL, (8, 8), "fast")
    calls = [
        *(partial(renderer.render, scene) for scene in NO_SCENES),
        *(partial(gb.reference.render, scene, (8, 8), 1) for scene in NO_SCENES),
        *(partial(renderer.render, BALL, size) for size in (None, "8x8", 8, (8,), (8, 8, 8), ("8", "8"), (np.nan, 8))),
        *(partial(renderer.render, BALL, (8, 8), quality) for quality in (None, 3, "", b"fast", gb.Quality)),
        *(partial(gb.reference.render, BALL, (8, 8), samples) for samples in (None, 0, -4, 3, "4", 2.5, 1 << 30)),
        *(partial(gb.render, BALL, (8, 8), backend=backend) for backend in (None, 3, "EGL", b"egl")),
        *(partial(frame.save, path) for path in (*NO_PATHS, "", "a.bmp")),
        *(partial(frame.save, "a.png", exposure=stops) for stops in (None, "1", np.nan, 65)),
        *(partial(frame.save, "a.png", tone=tone) for tone in (None, "films")),
        *(partial(gb.load_scene, path) for path in (*NO_PATHS, "", "none.toml")),
        *(partial(gb.save_scene, gb.Scene(()), path) for path in (*NO_PATHS, "")),
    ]
    for call in calls:
        with pytest.raises(gb.GlbumpError) as raised:
            call()
        assert "\n" not in str(raised.value), call
        assert len(str(raised.value)) < 300, call
    assert not list(Path().iterdir())


def test_light_past_floats_is_refused_by_the_reference_too() -> None:
    bright = replace(BALL, environment=gb.LatLong(NOISE * 1e35, exposure=9))
    with pytest.raises(gb.LimitError, match=r"the environment reaches 5\.\d+e\+37 at exposure 9; at most 1e\+36"):
        gb.reference.render(bright, (8, 8), 1)
