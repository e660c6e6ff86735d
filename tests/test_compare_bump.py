"""`compare_bump` and its command: against scenes whose figures are known beforehand."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import glbump as gb
from glbump.cli import run
from glbump.errors import GlbumpError, SceneError
from glbump.maps.images import read_picture
from glbump.trade import bumps
from glbump.trade.bumps import FORMS, Comparison, compare_bump, sheet

EVEN = np.full((2, 2), 0.5, np.float32)
MIRROR = gb.Material(metallic=1, roughness=0)
SIZE = (96, 96)
# 40 pixels a unit.
PARALLEL = gb.Camera(eye=(0, 0, 5), projection="orthographic", height=2.4)


def waves(texels: int = 64, count: int = 4) -> npt.NDArray[np.float32]:
    x = (np.arange(texels) + 0.5) / texels
    return (0.5 + 0.5 * np.sin(2 * np.pi * count * x) * np.cos(2 * np.pi * count * x)[:, None]).astype(np.float32)


def compared(shape: Any, bump: gb.Bump, camera: gb.Camera = PARALLEL, **more: Any) -> Comparison:
    return compare_bump(gb.Scene([gb.Surface(shape, MIRROR, bump, **more)], camera=camera), size=SIZE)


@pytest.fixture(scope="module")
def ring() -> Comparison:
    camera = gb.Camera(eye=(0, 1.6, 3), fov=45)
    return compared(gb.Torus(), gb.Bump(waves(), 0.06), camera)


def test_an_even_height_moves_the_outline_by_itself() -> None:
    """0.1 units of a ball's outline are 4 pixels; nothing is bent, but what is seen in a pixel is another place."""
    found = compared(gb.Sphere(), gb.Bump(EVEN, 0.2))
    outline = found.figures["silhouette"]
    assert outline["max"] == pytest.approx(4, abs=0.5)
    assert outline["mean"] == pytest.approx(4 * (1 + 0.05), rel=0.05)  # pixels between, over the inner outline
    assert outline["share"] == pytest.approx(1 - 1 / 1.1**2, rel=0.02)
    assert found.figures["moved"]["max"] == pytest.approx(4, abs=0.1)
    assert found.figures["formula"]["small"]["max"] < 1e-9
    # asin(d) - asin(d / 1.1) in the ball's angle, which the normals turn by.
    at = np.hypot(*(np.argwhere(np.isfinite(found.angles["flat"])) - 47.5).T) / 40
    want = np.degrees(np.arcsin(at) - np.arcsin(at / 1.1))
    got = found.angles["flat"][np.isfinite(found.angles["flat"])]
    assert np.abs(got - want)[at < 0.95].max() < 0.2  # the mesh's cells
    assert re.fullmatch(
        r"the silhouette moves by (3\.[5-9]|4\.\d) pixels: displace, or lower bump\.amplitude to 0\.05", found.advice
    )


def test_seen_from_above_heights_of_a_plane_move_nothing() -> None:
    """Along the direction of view: the outline stays, and with it what each pixel shows; bump mapping is the truth."""
    quad = gb.Quad(((-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)))
    found = compared(quad, gb.Bump(waves(), 0.1))
    assert found.figures["moved"]["max"] < 1e-9
    assert found.figures["silhouette"] == {"share": 0.0, "mean": 0.0, "max": 0.0}
    assert found.figures["formula"]["small"]["max"] < 1e-9  # a plane has no curvature
    for form in ("small", "full"):
        assert found.figures["normals"][form]["max"] < 1e-6
        assert found.figures["pictures"][form]["mean"] < 4e-3  # normals between the mesh's vertices
    assert found.figures["normals"]["flat"]["mean"] > 10
    assert found.figures["pictures"]["flat"]["mean"] > 1e-2
    assert found.advice.startswith("bump mapping is good enough here: nothing moves by more than 0.0 pixels")


def test_the_formulas_error_falls_with_the_square_of_the_amplitude(ring: Comparison) -> None:
    half = compared(gb.Torus(), gb.Bump(waves(), 0.03), gb.Camera(eye=(0, 1.6, 3), fov=45))
    errors = [found.figures["formula"]["small"]["mean"] for found in (ring, half)]
    assert errors[0] / errors[1] == pytest.approx(4, rel=0.2)  # slopes of 30 degrees bend the line a little
    flat = [found.figures["formula"]["flat"]["mean"] for found in (ring, half)]
    assert flat[0] / flat[1] == pytest.approx(2, rel=0.15)


def test_the_full_form_is_nearer_in_the_same_pixel_too(ring: Comparison) -> None:
    means = [ring.figures["normals"][form]["mean"] for form in FORMS]
    assert means[0] > means[1] > means[2]
    assert ring.figures["silhouette"]["max"] > 1
    assert ring.advice.startswith("the silhouette moves by ")


def test_what_it_advises_is_enough(ring: Comparison) -> None:
    amplitude = float(ring.advice.split()[-1])
    lower = compared(gb.Torus(), gb.Bump(waves(), amplitude), gb.Camera(eye=(0, 1.6, 3), fov=45))
    assert lower.advice.startswith("bump mapping is good enough here")
    # Little more would have been too much: the advice is given in two digits.
    more = compared(gb.Torus(), gb.Bump(waves(), 1.2 * amplitude), gb.Camera(eye=(0, 1.6, 3), fov=45))
    assert not more.advice.startswith("bump mapping is good enough")


def test_transforms_and_mesh_files_are_compared_alike(tmp_path: Path) -> None:
    """A plane of twice the size, as a mesh of half the size that is scaled by 4 and turned."""
    (tmp_path / "sheet.obj").write_text(
        "v -.25 0 .25\nv .25 0 .25\nv .25 0 -.25\nv -.25 0 -.25\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n"
        "f 1/1 2/2 3/3\nf 1/1 3/3 4/4\n"
    )
    camera = gb.Camera(eye=(0, 2, 3), fov=40)
    bump = gb.Bump(waves(), 0.05)
    first = compared(gb.Plane((2, 2)), bump, camera).figures
    second = compared(gb.MeshFile(tmp_path / "sheet.obj"), bump, camera, transform=gb.Transform(scale=4)).figures
    for name in ("moved", "silhouette"):
        assert second[name] == pytest.approx(first[name], rel=0.02), name
    for form in FORMS:
        assert second["normals"][form] == pytest.approx(first["normals"][form], rel=0.02), form


def test_other_surfaces_and_normal_maps_stay_in_the_pictures() -> None:
    lean = gb.NormalMap(np.full((2, 2, 3), (160, 128, 250), np.uint8))
    ball = gb.Surface(gb.Sphere(0.5), MIRROR, [gb.Bump(waves(), 0.02), lean], gb.Transform(translate=(0.6, 0, 0)))
    other = gb.Surface(gb.Sphere(0.4), gb.Material((1, 0, 0)), transform=gb.Transform(translate=(-0.6, 0, 0)))
    found = compare_bump(gb.Scene([other, ball], camera=PARALLEL), 1, SIZE)
    left = [p[:, :40, :3] for p in found.pictures.values()]
    # The displaced one is a mesh, whose samples software drivers draw pass by pass: four sums of halves, each below 1.
    for picture in left[1:]:
        assert np.abs(picture - left[0]).max() <= 2.0**-10
    without = compare_bump(gb.Scene([other, gb.Surface(ball.shape, MIRROR, gb.Bump(waves(), 0.02))]), 1, SIZE)
    assert np.abs(without.pictures["displaced"] - found.pictures["displaced"]).mean() > 1e-3


def test_a_surface_that_is_not_seen() -> None:
    away = gb.Camera(eye=(0, 0, 5), target=(0, 0, 9))
    found = compared(gb.Sphere(), gb.Bump(waves(), 0.1), away)
    assert found.advice.startswith("the surface is not seen in this frame")
    assert found.figures["moved"] == {"mean": None, "p99": None, "max": None}
    assert sheet(found).shape == (3 * 96, 4 * 96, 3)


BAD: list[tuple[gb.Scene, int, str]] = [
    (gb.Scene([]), 0, "no surface to compare"),
    (gb.Scene([gb.Surface(gb.Sphere())]), 0, "no heights"),
    (gb.Scene([gb.Surface(gb.Sphere(), bump=gb.Bump(waves(), 0.0))]), 0, "no heights"),
    (gb.Scene([gb.Surface(gb.Sphere(), bump=gb.Bump(waves(), 0.1))]), 1, "surface must be .*at most 0; got 1"),
]


@pytest.mark.parametrize(("scene", "surface", "said"), BAD)
def test_refusals(scene: gb.Scene, surface: int, said: str) -> None:
    with pytest.raises(SceneError, match=said):
        compare_bump(scene, surface, SIZE)


def test_distances_of_outlines() -> None:
    before, after = np.zeros((2, 40, 40), bool)
    before[10:30, 10:30] = True
    after[10:30, 10:37] = True  # seven columns more
    found = bumps._silhouette(before, after)
    assert found["share"] == pytest.approx(7 / 27)
    assert found["max"] == pytest.approx(6.5)  # the middle of the last column, from the edge
    assert bumps._silhouette(after, before)["max"] == pytest.approx(6.5)
    assert bumps._silhouette(before, before) == {"share": 0.0, "mean": 0.0, "max": 0.0}
    rows, columns = np.mgrid[:200, :200]
    disc = np.hypot(rows - 99.5, columns - 99.5) < 80
    assert bumps._outline_length(disc) == pytest.approx(2 * np.pi * 80, rel=0.01)


def test_the_sheet_shows_what_it_says(ring: Comparison) -> None:
    height, width = SIZE[::-1]
    picture = sheet(ring)
    assert picture.shape == (3 * height, 4 * width, 3)
    panel = picture.reshape(3, height, 4, width, 3).swapaxes(1, 2)
    before, after = ring.covered
    assert (panel[1, 3][before & after] == (110, 110, 110)).all()
    assert (panel[1, 3][after & ~before] == (255, 96, 64)).all()
    assert (panel[1, 3][~after & ~before] == 0).all()
    # White is what figures["sheet"] says; next to it nothing is.
    assert (panel[2, 3][ring.moved >= ring.figures["sheet"]["pixels"]] == 255).all()
    assert (panel[1, 1][~np.isfinite(ring.angles["small"])] == 0).all()
    # The displaced picture differs from itself nowhere: the differences are those of the other three.
    assert panel[2, 0].mean() > panel[2, 1].mean() > 0


def scene_file(folder: Path) -> Path:
    from glbump.maps.files import write_picture

    write_picture(folder / "waves.exr", waves())
    path = folder / "scene.toml"
    path.write_text(
        '[[surface]]\nshape = { kind = "torus" }\nmaterial = { metallic = 1, roughness = 0 }\n'
        'bump = { height = "waves.exr", amplitude = 0.2 }\n'
    )
    return path


def test_the_command_writes_pictures_figures_and_advice(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scene, out = scene_file(tmp_path), tmp_path / "a" / "b"
    assert run(["compare-bump", str(scene), "-o", str(out), "--size", "64x48"]) == 0
    said = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in said[2:5]] == list(FORMS)
    assert "pixels: displace, or lower bump.amplitude to " in said[-1]
    assert sorted(p.name for p in out.iterdir()) == sorted(f"{n}.png" for n in (*FORMS, "displaced", "sheet"))
    assert read_picture(out / "sheet.png").pixels.shape[:2] == (3 * 48, 4 * 64)
    assert read_picture(out / "full.png").pixels.shape[:2] == (48, 64)


def test_the_command_in_figures_for_machines(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scene = scene_file(tmp_path)
    settings = ["--set", "surface.0.bump.amplitude=0.001", "--size", "64", "--json", "-q"]
    assert run(["compare-bump", str(scene), *settings]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["advice"].startswith("bump mapping is good enough here")
    assert found["height"]["most"] == pytest.approx(0.001, rel=0.05)
    assert set(found["normals"]) == set(FORMS)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["scene.toml", "waves.exr"]


@pytest.mark.parametrize(
    ("arguments", "code", "said"),
    [
        (["--surface", "3"], 1, "surface must be a finite number at least 0 and at most 0; got 3"),
        (["--surface", "-1"], 2, "--surface"),
        (["--set", "surface.0.bump.amplitude=0"], 1, "no heights to be displaced by"),
        (["--set", "surface.0.bump.repeat=4000", "--size", "4096x4096"], 1, "triangles; at most 2,000,000"),
        (["-o", "scene.toml"], 1, "File exists"),
        (["--quality", "best"], 2, "best"),
    ],
)
def test_the_command_refuses_in_one_line(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    arguments: list[str],
    code: int,
    said: str,
) -> None:
    scene_file(tmp_path)
    monkeypatch.chdir(tmp_path)
    assert run(["compare-bump", "scene.toml", "--size", "64", *arguments]) == code
    error = capsys.readouterr().err
    assert said in error
    assert len(error.splitlines()) == 1


def test_errors_are_glbumps_own() -> None:
    with pytest.raises(GlbumpError, match="scene must be a Scene"):
        compare_bump("scene.toml")  # type: ignore[arg-type]
