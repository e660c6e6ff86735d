"""`glbump prefilter`: what it writes, that it reads back, and what it refuses."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import glbump as gb
from glbump.cli import run
from glbump.errors import ImageError, SceneError
from glbump.maps import chains, conversion
from glbump.maps.chains import read_chain, write_chain
from glbump.maps.containers import TextureLevels, read_texture, texture_from_light, write_texture
from glbump.maps.diffuse import sh9
from glbump.maps.files import write_picture
from glbump.maps.gloss import gloss_chain
from glbump.maps.layout import LATLONG, texel_dirs
from glbump.maps.suns import part


@pytest.fixture(autouse=True)
def _panorama(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """sky.exr, 128x64: a gradient with a small sun."""
    monkeypatch.chdir(tmp_path)
    dirs = texel_dirs(LATLONG, (128, 64))[0]
    sky = (0.5 + 0.3 * dirs).astype(np.float32)
    sky[dirs @ np.array([0.48, 0.64, 0.6]) > np.cos(np.radians(3))] = (900, 800, 700)
    write_picture("sky.exr", sky)


def chain() -> Any:
    environment = conversion.read_environment([Path("sky.exr")]).environment
    return gloss_chain(environment, 32, 16)


@pytest.mark.parametrize("name", ["out.ktx2", "out.dds", "out.exr"])
def test_chain_is_read_back_bit_for_bit(name: str) -> None:
    assert run(["prefilter", "sky.exr", "-o", name, "--size", "32", "--samples", "16", "-q"]) == 0
    levels = read_chain(name)
    assert [level.shape for level in levels] == [(6, n, n, 3) for n in (32, 16, 8, 4)]
    for got, wanted in zip(levels, chain(), strict=True):
        assert np.array_equal(got, wanted)


def test_the_files_are_environments() -> None:
    """Of a chain in one file level 0; each .exr of the others is a cube by itself."""
    assert run(["prefilter", "sky.exr", "-o", "out.ktx2", "--size", "32", "-q"]) == 0
    assert run(["prefilter", "sky.exr", "-o", "out.exr", "--size", "32", "-q"]) == 0
    for name, level in (("out.ktx2", 0), ("out_0.exr", 0), ("out_2.exr", 2)):
        read = conversion.read_environment([Path(name)]).environment
        assert read.layout.name == "cube"
        assert np.array_equal(read.pixels, read_chain("out.ktx2")[level])
    assert len(read_texture("out.ktx2").levels) == 4
    scene = gb.Scene([gb.Surface(gb.Sphere(), gb.Material(metallic=1, roughness=0))], gb.CubeMap("out.ktx2"))
    assert gb.reference.render(scene, (8, 8), 1).pixels.max() > 0


def test_all_light_is_in_every_level(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["prefilter", "sky.exr", "-o", "out.ktx2", "--size", "32", "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["files"] == ["out.ktx2"]
    assert [level["roughness"] for level in said["levels"]] == pytest.approx([0, 1 / 3, 2 / 3, 1])
    means = np.array([level["mean"] for level in said["levels"]])
    # Level 0 is read by up to 3x3 bilinear samples a texel, which meet a sun of 8 texels as they may.
    assert means[0] == pytest.approx(np.array(said["harmonics"]["irradiance_over_pi"][0]), rel=5e-3)
    # A level's texels are a quadrature of their own.
    assert np.abs(means[:-1] / means[0] - 1).max() < 0.01
    assert means[-1] == pytest.approx(means[0], rel=0.03)


@pytest.mark.parametrize("suns", ["kept", "apart"])
def test_harmonics_say_how_they_are_meant(suns: str) -> None:
    """The two sums in the file, followed to the letter, and its suns, are the light of the picture."""
    assert run(["prefilter", "sky.exr", "--sh", "sky.json", "--suns", suns, "-q"]) == 0
    said = json.loads(Path("sky.json").read_text())
    environment = conversion.read_environment([Path("sky.exr")]).environment
    parted = part(environment)
    assert np.array(said["irradiance_over_pi"]) == pytest.approx(
        sh9(parted.rest if suns == "apart" else environment), rel=1e-12
    )
    assert said["suns"] == suns
    assert len(said["apart"]) == (suns == "apart")
    if suns == "apart":
        (sun,) = said["apart"]
        assert sun["direction"] == pytest.approx([0.48, 0.64, 0.6], abs=0.02)
        assert sun["radius_degrees"] == pytest.approx(3, abs=0.5)
        whole = np.array(said["irradiance_over_pi"][0]) + np.array(sun["irradiance"]) / (4 * np.pi)
        assert whole == pytest.approx(sh9(environment)[0], rel=1e-6)
    # Norms make the polynomials orthonormal: by the file's own words, over a fine grid of directions.
    dirs = texel_dirs(LATLONG, (256, 128))[0].reshape(-1, 3)
    rows = -np.diff(np.cos(np.linspace(0, np.pi, 129))) * 2 * np.pi / 256
    x, y, z = dirs.T
    words = {"x": x, "y": y, "z": z, "z^2": z * z, "x^2": x * x, "y^2": y * y}
    basis = []
    for text in said["basis"]:
        terms = text.replace("- ", "+ -").split(" + ")
        total = np.zeros_like(x)
        for term in terms:
            value = np.ones_like(x)
            for factor in term.split():
                sign = -1.0 if factor.startswith("-") else 1.0
                factor = factor.lstrip("-")
                value = value * sign * (words[factor] if factor in words else float(factor))
            total = total + value
        basis.append(total)
    harmonics = np.array(basis) * np.array(said["norms"])[:, None]
    products = (harmonics * np.repeat(rows, 256)) @ harmonics.T
    assert np.abs(products - np.eye(9)).max() < 5e-4
    # Both sums are of one environment: the cosine's bands apart.
    light = np.array(said["radiance"]) * np.array(said["norms"])[:, None]
    bands = np.array([1, *[2 / 3] * 3, *[1 / 4] * 5])[:, None]
    assert light * bands == pytest.approx(np.array(said["irradiance_over_pi"]), rel=1e-12)


def test_people_are_told(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["prefilter", "sky.exr", "-o", "out.exr", "--size", "16", "--sh", "sky.json", "--suns", "apart"]) == 0
    out, err = capsys.readouterr()
    assert out.startswith("out_0.exr, out_1.exr, out_2.exr, sky.json\n")
    assert "roughness" in out
    assert "sun apart: towards 0.4" in out
    assert "read as lat-long" in err


def refused(arguments: list[str], capsys: pytest.CaptureFixture[str], code: int = 1) -> str:
    """The one line of what goes wrong; nothing is left behind."""
    before = set(Path().iterdir())
    assert run(["prefilter", *arguments]) == code
    out, err = capsys.readouterr()
    assert out == ""
    assert set(Path().iterdir()) == before
    lines = [line for line in err.splitlines() if "note:" not in line]
    assert len(lines) == 1
    return lines[0]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["sky.exr"], "-o for the roughness chain, --sh for the harmonics"),
        (["sky.exr", "-o", "a.ktx2", "--size", "100"], "power of two from 8 to 4096; got 100"),
        (["sky.exr", "-o", "a.ktx2", "--size", "4"], "got 4"),
        (["sky.exr", "-o", "a.ktx2", "--samples", "0"], "samples"),
        (["sky.exr", "-o", "a.ktx2", "--suns", "gone"], "suns"),
        (["sky.exr", "-o", "a.ktx2", "--from", "cub"], "choose"),
    ],
)
def test_wrong_calls(arguments: list[str], words: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert words in refused(arguments, capsys, 2)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["sky.exr", "-o", "a.png"], ".png"),
        (["sky.exr", "-o", "there/a.ktx2"], "no directory"),
        (["sky.exr", "--sh", "there/a.json"], "no directory"),
        (["sky.exr", "--sh", "sky.exr"], "one of the files"),
        (["none.exr", "-o", "a.ktx2"], "none.exr"),
    ],
)
def test_what_cannot_be_done(arguments: list[str], words: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert words in refused(arguments, capsys)


@pytest.mark.parametrize("value", [np.inf, -np.inf, np.nan])
def test_light_that_is_none_is_refused(value: float, capsys: pytest.CaptureFixture[str]) -> None:
    """One rule for all pictures: what is not finite is not mended, since what it hides is not known."""
    texture = np.ones((1, 8, 16, 4), np.float32)
    texture[0, 3, 5, 1] = value
    broken = TextureLevels((texture,))
    data = Path("bad.dds")
    write_texture(data, TextureLevels((np.ones((1, 8, 16, 4), np.float32),)))
    raw = bytearray(data.read_bytes())
    raw[-texture.nbytes :] = broken.levels[0].tobytes()
    data.write_bytes(bytes(raw))
    line = refused(["bad.dds", "--from", "lat-long", "-o", "a.ktx2"], capsys)
    assert "finite" in line
    assert "5" in line  # where
    scene = gb.Scene([gb.Surface(gb.Sphere())], gb.LatLong("bad.dds"))
    with pytest.raises(ImageError, match="finite"):
        gb.reference.render(scene, (8, 8), 1)


def levels_of(*sizes: int) -> list[Any]:
    return [np.full((6, n, n, 3), 0.5, np.float32) for n in sizes]


def test_chains_that_are_none(tmp_path: Path) -> None:
    with pytest.raises(ImageError, match=r"level 1 .* each level halves"):
        write_chain(Path("bad.ktx2"), levels_of(16, 4))
    write_chain(Path("bad.exr"), levels_of(16, 4))
    with pytest.raises(ImageError, match=r"level 1 has faces of 4, and level 0 of 16; each must be half"):
        read_chain("bad.exr")
    write_chain(Path("gap.exr"), levels_of(16, 8, 4))
    Path("gap_1.exr").unlink()
    with pytest.raises(ImageError, match=r"level 1 is missing, and there are some up to 2"):
        read_chain("gap.exr")
    Path("gap_0.exr").unlink()
    with pytest.raises(ImageError, match="level 0 is missing"):
        read_chain("gap.exr")
    with pytest.raises(ImageError, match=r"none_0\.exr"):
        read_chain("none.exr")
    with pytest.raises(ImageError, match="suffix"):
        read_chain("none.png")
    write_picture("flat_0.exr", np.ones((4, 8, 3), np.float32))
    with pytest.raises(ImageError, match="column of six square faces; got 8x4"):
        read_chain("flat.exr")
    write_texture("one.ktx2", texture_from_light(levels_of(16), "float"))
    with pytest.raises(ImageError, match="one level"):
        read_chain("one.ktx2")
    write_texture("flat.dds", texture_from_light([np.ones((1, 8, 8, 3), np.float32)] * 1, "float"))
    with pytest.raises(ImageError, match="no cube map"):
        read_chain("flat.dds")


def test_a_file_that_is_cut_off_is_no_chain() -> None:
    write_chain(Path("cut.ktx2"), levels_of(16, 8, 4))
    data = Path("cut.ktx2").read_bytes()
    Path("cut.ktx2").write_bytes(data[:-100])
    with pytest.raises(ImageError, match="damaged or truncated"):
        read_chain("cut.ktx2")


@pytest.mark.parametrize("roughness", [-0.1, 1.1, float("nan"), float("inf")])
def test_roughness_past_the_chain(roughness: float) -> None:
    with pytest.raises(SceneError, match=r"material\.roughness"):
        gb.Material(roughness=roughness)


def test_norms_are_the_customary_ones() -> None:
    wanted = [0.282095, *[0.488603] * 3, 1.092548, 1.092548, 0.315392, 1.092548, 0.546274]
    assert pytest.approx(wanted, abs=5e-7) == chains.NORMS
