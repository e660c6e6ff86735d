"""`glbump convert`: what it writes, reads back, accounts for and refuses."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from glbump.cli import run
from glbump.maps.containers import read_texture
from glbump.maps.conversion import TARGETS, read_environment, same_detail
from glbump.maps.files import write_picture
from glbump.maps.images import read_colour
from glbump.maps.layout import LAYOUTS, latlong_dir

F32 = npt.NDArray[np.float32]
DATA = Path(__file__).parents[2] / "shared" / "data"
needs_data = pytest.mark.skipif(not DATA.is_dir(), reason="the shared real pictures are not here")

FACES = ("px", "nx", "py", "ny", "pz", "nz")
HALVES = ("hemicube", "hemisphere")


def latlong(rows: int = 64) -> F32:
    """Light without symmetry, which the layouts' texels resolve: (rows, 2 rows, 3), 0.25 to 2."""
    v, u = ((np.arange(n) + 0.5) / n for n in (rows, 2 * rows))
    dir = latlong_dir(np.stack(np.broadcast_arrays(u, v[:, None]), axis=-1))
    x, y, z = np.moveaxis(dir, -1, 0)
    red, green = 1 + 0.5 * x + 0.25 * y * z, 1 - 0.5 * z + 0.25 * x * y
    return np.stack([red, green, 1 + 0.7 * y + 0.2 * x * z], axis=-1).astype(np.float32)


@pytest.fixture(autouse=True)
def _folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    write_picture("sky.exr", latlong())


def convert(*arguments: str) -> None:
    assert run(["convert", *arguments, "-q"]) == 0


def figures(capsys: pytest.CaptureFixture[str], *arguments: str) -> dict[str, Any]:
    capsys.readouterr()
    assert run(["convert", *arguments, "--json", "-q"]) == 0
    said: dict[str, Any] = json.loads(capsys.readouterr().out)
    return said


# ------------------------------------------------------------ there and back


@pytest.mark.parametrize("to", TARGETS)
@pytest.mark.parametrize("filter", ["area", "bilinear"])
def test_there_and_back(to: str, filter: str) -> None:
    convert("sky.exr", "-o", "there.exr", "--to", to, "--filter", filter)
    # A disc does not say which of the discs it is.
    source = {"hemisphere": "equal-area", "mirror-ball": "mirror-ball"}.get(to, "auto")
    name = "there_{face}.exr" if to == "faces" else "there.exr"
    convert(name, "-o", "back.exr", "--to", "lat-long", "--from", source, "--filter", filter, "--size", "64")
    was, back = latlong(), read_colour(Path("back.exr")).pixels
    shown = np.s_[:31] if to in HALVES else np.s_[:]
    error = np.abs(back - was)[shown]
    # Texels of 1.4 to 2.8 degrees, averaged twice, take up to 0.0031 off light that changes by up to 1.2 a radian;
    # their centres 0.0005. The worst, 0.018, is at a cube's corners; at a mirror ball's rim, where one texel spans
    # tens of degrees, 0.10.
    assert np.sqrt((error**2).mean()) < 0.005, to
    assert error.max() < (0.15 if to == "mirror-ball" else 0.03), to
    # The test can fail: mirrored, turned or upside down it is off by a hundred times as much.
    for wrong in (was[:, ::-1], np.roll(was, 32, axis=1), was[::-1]):
        assert np.sqrt(((back - wrong)[shown] ** 2).mean()) > 0.1


def test_faces_are_named_and_lie_by_the_opengl_table() -> None:
    convert("sky.exr", "-o", "made.exr", "--to", "faces")
    assert sorted(p.name for p in Path().glob("made*")) == sorted(f"made_{face}.exr" for face in FACES)
    convert("sky.exr", "-o", "column.exr", "--to", "cube")
    column = read_colour(Path("column.exr")).pixels
    size = column.shape[1]
    assert column.shape == (6 * size, size, 3)
    for i, face in enumerate(FACES):
        assert np.array_equal(read_colour(Path(f"made_{face}.exr")).pixels, column[i * size : (i + 1) * size])
    # Red grows with x, blue with y; the picture's middle is -Z, where green is largest.
    mean = {face: read_colour(Path(f"made_{face}.exr")).pixels.mean(axis=(0, 1)) for face in FACES}
    assert max(mean, key=lambda face: mean[face][0]) == "px"
    assert max(mean, key=lambda face: mean[face][1]) == "nz"
    assert max(mean, key=lambda face: mean[face][2]) == "py"


def test_the_orientation_of_what_is_written() -> None:
    convert("sky.exr", "-o", "a.exr", "--to", "cube")
    convert("sky.exr", "-o", "b.exr", "--to", "cube", "--to-orientation", "inside")
    a, b = (read_colour(Path(name)).pixels for name in ("a.exr", "b.exr"))
    size = a.shape[1]
    assert np.array_equal(b[:size], a[:size, ::-1])
    convert("b.exr", "-o", "c.exr", "--to", "cube", "--orientation", "inside")
    assert np.array_equal(read_colour(Path("c.exr")).pixels, a)


def test_laying_faces_out_anew_resamples_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    convert("sky.exr", "-o", "a.exr", "--to", "vcross")
    assert figures(capsys, "a.exr", "-o", "b.exr", "--to", "faces")["filter"] == "as it is"
    assert figures(capsys, "b_{face}.exr", "-o", "c.exr", "--to", "vcross")["filter"] == "as it is"
    assert np.array_equal(read_colour(Path("c.exr")).pixels, read_colour(Path("a.exr")).pixels)


def test_detail_is_kept() -> None:
    environment = read_environment([Path("sky.exr")]).environment
    # 64 rows are 180 degrees: 32 texels to 90.
    want = {"cube": 32, "hemicube": 32, "lat-long": 64, "octahedral": 64, "equal-area": 64, "angular": 128}
    assert {name: same_detail(environment, LAYOUTS[name]) for name in want} == want


@pytest.mark.parametrize("projection", ["equal-area", "equidistant", "orthographic", "dual-paraboloid"])
def test_projections_of_a_hemisphere(projection: str) -> None:
    convert("sky.exr", "-o", "disc.exr", "--to", "hemisphere", "--projection", projection)
    disc = read_colour(Path("disc.exr")).pixels
    height, width = disc.shape[:2]
    assert width == height * (2 if projection == "dual-paraboloid" else 1)
    # Corners are black, so that it is seen to be a disc.
    assert (disc[0, 0] == 0).all()
    assert (disc[height // 2, height // 2] > 0).all()
    convert("disc.exr", "-o", "back.exr", "--to", "lat-long", "--from", projection, "--size", "64")
    assert np.abs(read_colour(Path("back.exr")).pixels - latlong())[:28].max() < 0.05


# ------------------------------------------------------------ textures


@pytest.mark.parametrize("suffix", [".ktx2", ".dds"])
def test_texture_files_hold_all_levels(suffix: str) -> None:
    convert("sky.exr", "-o", f"cube{suffix}", "--to", "cube", "--size", "16")
    texture = read_texture(f"cube{suffix}")
    assert texture.is_cube
    assert [level.shape[:3] for level in texture.levels] == [(6, n, n) for n in (16, 8, 4, 2, 1)]
    # A float picture of 32 bits is kept in 32.
    assert texture.levels[0].dtype == np.float32
    convert("sky.exr", "-o", f"one{suffix}", "--to", "cube", "--size", "16", "--no-levels")
    assert len(read_texture(f"one{suffix}").levels) == 1
    convert(f"cube{suffix}", "-o", "back.exr", "--to", "lat-long", "--size", "64")
    # Enlarged from 16 texels to 90 degrees, of which the lowest light is off by a texel's curve.
    assert np.abs(read_colour(Path("back.exr")).pixels - latlong()).max() < 0.02
    convert("sky.exr", "-o", f"flat{suffix}", "--to", "lat-long", "--size", "8")
    flat = read_texture(f"flat{suffix}").levels
    assert [level.shape[1:3] for level in flat] == [(8, 16), (4, 8), (2, 4), (1, 2), (1, 1)]


@pytest.mark.parametrize(("dtype", "kept"), [("float16", "float16"), ("float32", "float32")])
def test_textures_keep_the_bits_of_the_source(dtype: str, kept: str) -> None:
    bright = latlong().astype(dtype)
    bright[10:30, 10:30] = 65504  # Resampled, it may not round to infinity.
    write_picture("bright.exr", bright)
    convert("bright.exr", "-o", "a.ktx2", "--to", "cube", "--size", "64", "--filter", "bilinear")
    level = read_texture("a.ktx2").levels[0]
    assert level.dtype == kept
    assert level.max() == pytest.approx(65504, rel=2**-22)


# ------------------------------------------------------------ the account


def test_ledger(capsys: pytest.CaptureFixture[str]) -> None:
    said = figures(capsys, "sky.exr", "-o", "a.exr", "--to", "cube", "--size", "24")
    assert set(said) == {"from", "to", "layout", "files", "size", "filter", "ledger", "notes"}
    assert (said["from"], said["to"], said["files"], said["size"], said["filter"]) == (
        "lat-long", "cube", ["a.exr"], [24, 24], "area",
    )  # fmt: skip
    account = said["ledger"]
    # Red is 1 + odd terms, which add up to nothing: 4 pi.
    assert account["before"][0] == pytest.approx(4 * np.pi, rel=1e-5)
    assert max(map(abs, account["error"])) < 1e-5
    assert account["clamped"] == [0, 0, 0]
    assert account["largest_before"] == pytest.approx(float(latlong().max()))
    # Centres of larger texels do not carry all light.
    loose = figures(capsys, "sky.exr", "-o", "b.exr", "--to", "cube", "--size", "5", "--filter", "bilinear")
    assert max(map(abs, loose["ledger"]["error"])) > 1e-5


def test_clamp_is_accounted_for(capsys: pytest.CaptureFixture[str]) -> None:
    said = figures(capsys, "sky.exr", "-o", "a.exr", "--to", "octahedral", "--clamp", "1.25")
    account = said["ledger"]
    assert all(0 < lost < 1 for lost in account["clamped"])
    assert account["largest_after"] <= 1.25 < account["largest_before"]
    assert max(map(abs, account["error"])) < 1e-5
    assert read_colour(Path("a.exr")).pixels.max() <= 1.25


def test_the_half_that_is_left_out_is_said(capsys: pytest.CaptureFixture[str]) -> None:
    out = figures(capsys, "sky.exr", "-o", "a.exr", "--to", "hemicube", "--filter", "area")
    # Half of 4 pi, in red, which is as bright below as above.
    assert out["ledger"]["left_out"][0] == pytest.approx(2 * np.pi, rel=1e-3)
    assert any("left out" in note for note in out["notes"])
    back = figures(capsys, "a.exr", "-o", "b.exr", "--to", "lat-long", "--filter", "area")
    assert back["ledger"]["filled"][0] == pytest.approx(2 * np.pi, rel=1e-3)
    assert any("mirrored" in note for note in back["notes"])


def test_text(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["convert", "sky.exr", "-o", "a.exr", "--to", "cube", "--clamp", "1.5"]) == 0
    said = capsys.readouterr()
    lines = said.out.splitlines()
    assert lines[0] == "a.exr  cube 6 x 32x32, area"
    assert [line.split()[0] for line in lines[1:]] == ["radiance", "before", "clamped", "after", "error"]
    assert said.err == "glbump: note: sky.exr: read as lat-long, as it is 2:1\n"


def test_bytes_clip_with_a_notice(capsys: pytest.CaptureFixture[str]) -> None:
    said = figures(capsys, "sky.exr", "-o", "a.png", "--to", "hcross")
    assert any("were clipped" in note for note in said["notes"])
    write_picture("dark.exr", latlong() / 4)
    said = figures(capsys, "dark.exr", "-o", "b.png", "--to", "hcross")
    assert not any("clipped" in note for note in said["notes"])
    convert("b.png", "-o", "back.exr", "--to", "lat-long", "--size", "64")
    # 8 bits of sRGB are off by up to 1/255 where it is steepest, at white.
    assert np.abs(read_colour(Path("back.exr")).pixels - latlong() / 4).max() < 0.015


@needs_data
def test_the_real_pair(capsys: pytest.CaptureFixture[str]) -> None:
    """OpenEXR's own lat-long, converted, against its own cube, values clipped at 4: a wrong mirror gives 0.2, half a
    texel 0.012."""
    pair = [DATA / "openexr" / f"KernerEnv{kind}.exr" for kind in ("LatLong", "Cube")]
    for file, name in zip(pair, "ab"):
        convert(str(file), "-o", f"{name}.exr", "--to", "cube", "--size", "256", "--filter", "bilinear")
    a, b = (np.minimum(read_colour(Path(f"{name}.exr")).pixels, 4) for name in "ab")
    assert np.sqrt(((a - b) ** 2).mean()) < 0.010


# ------------------------------------------------------------ wrong calls, bad input


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--to", "cub"], "did you mean 'cube'"),
        (["--to", "latlong"], "did you mean 'lat-long'"),
        ([], "--to"),
        (["--to", "cube", "--from", "hcros"], "did you mean 'hcross'"),
        (["--to", "cube", "--filter", "aera"], "did you mean 'area'"),
        (["--to", "cube", "--orientation", "outside"], "did you mean 'inside'"),
        (["--to", "cube", "--projection", "equidistant"], "--to hemisphere"),
        (["--to", "hemisphere", "--projection", "equal-aria"], "did you mean 'equal-area'"),
        (["--to", "cube", "--size", "1"], "--size"),
        (["--to", "cube", "--clamp", "0"], "above 0"),
        (["--to", "cube", "--clamp", "nan"], "above 0"),
        (["--to", "cube", "--levels"], ".ktx2"),
        (["--to", "lat-long", "--to-orientation", "inside"], "--to-orientation"),
    ],
)
def test_wrong_calls(arguments: list[str], said: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["convert", "sky.exr", "-o", "a.exr", *arguments]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.count("\n") == 1
    assert said in captured.err
    assert not Path("a.exr").exists()


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["nothere.exr", "-o", "a.exr", "--to", "cube"], "no such file"),
        (["sky.exr", "-o", "sky.exr", "--to", "cube"], "is one of the files"),
        (["sky.exr", "-o", "a.gif", "--to", "cube"], "unknown suffix '.gif'"),
        (["sky.exr", "-o", "no/a.exr", "--to", "cube"], "there is no directory no"),
        (["sky.exr", "-o", "no/a.ktx2", "--to", "cube"], "there is no directory no"),
        (["sky.exr", "-o", "a.ktx2", "--to", "hcross"], "say cube"),
        (["sky.exr", "-o", "a.dds", "--to", "hemicube"], "say cube"),
        (["sky.exr", "-o", "a.exr", "--to", "hemicube", "--size", "5"], "must be even"),
        (["sky.exr", "-o", "a.exr", "--to", "cube", "--size", "100000"], "at most 268435456"),
        (["sky.exr", "-o", "a.exr", "--to", "cube", "--orientation", "inside"], "an orientation is of cubes"),
        (["sky.exr", "-o", "a.exr", "--to", "cube", "--from", "hcross"], "4:3"),
        (["sky_px.exr", "sky_nx.exr", "sky_py.exr", "-o", "a.exr", "--to", "cube"], "no such file"),
        (["cut.exr", "-o", "a.exr", "--to", "cube"], "cut.exr"),
        (["cut.ktx2", "-o", "a.exr", "--to", "lat-long"], "cut.ktx2"),
        (["nan.exr", "-o", "a.exr", "--to", "cube"], "not finite"),
    ],
)
def test_bad_input(arguments: list[str], said: str, capsys: pytest.CaptureFixture[str]) -> None:
    Path("cut.exr").write_bytes(Path("sky.exr").read_bytes()[:3000])
    convert("sky.exr", "-o", "whole.ktx2", "--to", "cube", "--size", "8")
    Path("cut.ktx2").write_bytes(Path("whole.ktx2").read_bytes()[:-100])
    _write_nan("nan.exr")
    before = {path: path.read_bytes() for path in Path().iterdir()}
    assert run(["convert", *arguments]) == 1
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.startswith("glbump: error: ")
    assert captured.err.count("\n") == 1
    assert said in captured.err
    assert {path: path.read_bytes() for path in Path().iterdir()} == before


def _write_nan(name: str) -> None:
    import OpenImageIO as oiio

    pixels = latlong(8)
    pixels[3, 4] = np.nan
    file = oiio.ImageOutput.create(name)
    file.open(name, oiio.ImageSpec(16, 8, 3, "float"))
    file.write_image(pixels)
    file.close()


def test_faces_that_do_not_fit(capsys: pytest.CaptureFixture[str]) -> None:
    convert("sky.exr", "-o", "f.exr", "--to", "faces", "--size", "8")
    files = [f"f_{face}.exr" for face in FACES]
    assert run(["convert", *files[:5], "-o", "a.exr", "--to", "lat-long"]) == 1
    assert "got 5; -Z is missing" in capsys.readouterr().err
    assert run(["convert", "f_{face}.exr", "-o", "f_px.exr", "--to", "lat-long"]) == 1
    assert "is one of the files" in capsys.readouterr().err
    write_picture("f_ny.exr", np.ones((8, 9, 3), np.float32))
    assert run(["convert", *files, "-o", "a.exr", "--to", "lat-long"]) == 1
    assert "must be square; got 9x8" in capsys.readouterr().err
    write_picture("f_ny.exr", np.ones((9, 9, 3), np.float32))
    assert run(["convert", *files, "-o", "a.exr", "--to", "lat-long"]) == 1
    assert "all six must have one size" in capsys.readouterr().err
    Path("f_ny.exr").unlink()
    assert run(["convert", "f_{face}.exr", "-o", "a.exr", "--to", "lat-long"]) == 1
    assert "f_ny.exr" in capsys.readouterr().err
    assert not Path("a.exr").exists()


def test_a_panorama_that_is_not_two_to_one_is_said(capsys: pytest.CaptureFixture[str]) -> None:
    write_picture("wide.exr", latlong()[16:-16])
    said = figures(capsys, "wide.exr", "-o", "a.exr", "--to", "cube", "--from", "lat-long")
    assert any("twice as wide as high" in note for note in said["notes"])
