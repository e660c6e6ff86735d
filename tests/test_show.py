"""What is shown in place of light: raw values, the same as the reference's; colours on screens."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

import glbump as gb
from glbump import reference
from glbump.cli import run
from glbump.gl.renderer import Renderer
from glbump.gl.source import find_shaders
from glbump.maps.images import read_picture
from glbump.reference import shade
from glbump.reference.bump import bump_normal
from glbump.shown import SHOWN, colours, ramp

RNG = np.random.default_rng(5)
PANORAMA = gb.LatLong(RNG.random((32, 64, 3)).astype(np.float32), rotation=70)
HEIGHTS = np.sin(np.linspace(0, 2 * np.pi, 32, endpoint=False))[None, :].repeat(32, axis=0).astype(np.float32)
MIRROR = gb.Material(metallic=1, roughness=0)
BUMPED = gb.Surface(
    gb.Torus(), MIRROR, gb.Bump(HEIGHTS, amplitude=0.02, repeat=(6, 3)), gb.Transform(rotate=(40, 10, 0), scale=1.2)
)
SCENE = gb.Scene(
    [BUMPED, gb.Surface(gb.Plane((4, 4)), MIRROR, transform=gb.Transform(translate=(0, -1.5, 0)))], PANORAMA
)
SIZE = (96, 80)
QUALITY = gb.Quality("exact", samples=4)  # no levels, so that no spread of bumps bends what is mirrored


@pytest.mark.parametrize("show", shade.SHOWN)
def test_values_are_the_references(renderer: Renderer, show: str) -> None:
    got = renderer.render(SCENE, SIZE, QUALITY, show=show).pixels
    want = reference.render(SCENE, SIZE, quality=QUALITY, show=show).pixels
    # Outlines apart, where one of the two sees something else: 1 % of these pixels.
    same = (got[..., 3] == want[..., 3]) & (np.abs(got - want).max(axis=-1) < 0.5)
    assert same.mean() > 0.98
    # 32-bit points and slopes: some roundings of them, over the cosine of incidence.
    assert np.percentile(np.abs(got - want)[same], 99) < 1e-5
    other = reference.render(SCENE, SIZE, quality=QUALITY, show="normal" if show == "uv" else "uv").pixels
    assert np.percentile(np.abs(got - other)[same], 90) > 0.1, "another quantity is told apart"


def test_values_are_of_the_middle_of_each_pixel_whatever_the_samples(renderer: Renderer) -> None:
    one, four = (renderer.render(SCENE, SIZE, gb.Quality("exact", samples=n), show="uv").pixels for n in (1, 4))
    assert np.array_equal(one, four)
    # But footprints are of the samples: half as long, of four.
    flat = gb.Scene([gb.Surface(gb.Sphere(), MIRROR)], PANORAMA)
    long = [renderer.render(flat, SIZE, gb.Quality("balanced", samples=n), show="footprint").pixels for n in (1, 4)]
    assert long[1][..., :2] / long[0][..., :2] == pytest.approx(0.5, rel=1e-4)


def test_unit_vectors_and_where_there_are_none(renderer: Renderer) -> None:
    shown = {name: renderer.render(SCENE, SIZE, QUALITY, show=name).pixels for name in SHOWN}
    there = shown["normal"][..., 3] == 1
    assert 0.2 < there.mean() < 0.8
    for name in ("normal", "reflection"):
        assert np.linalg.norm(shown[name][there, :3], axis=-1) == pytest.approx(1, abs=1e-5)
    for name in ("normal", "slope", "uv"):
        assert not shown[name][~there].any(), "nothing of the sky"
    assert (shown["reflection"][..., 3] == 1).all()
    assert not shown["level"][there, 0].any(), "level 0 alone is read"


def test_a_slope_is_what_bends_the_normal(renderer: Renderer) -> None:
    slope = renderer.render(SCENE, SIZE, QUALITY, show="slope").pixels[..., :3].astype(float)
    bent = renderer.render(SCENE, SIZE, QUALITY, show="normal").pixels[..., :3].astype(float)
    flat = gb.Scene([gb.Surface(BUMPED.shape, MIRROR, transform=BUMPED.transform), SCENE.surfaces[1]], PANORAMA)
    plain = renderer.render(flat, SIZE, QUALITY, show="normal").pixels[..., :3].astype(float)
    facing = np.linalg.norm(slope, axis=-1) > 0.05
    want = bump_normal(plain[facing], slope[facing])
    # Next to outlines bent normals are turned to the eye.
    assert np.percentile(np.abs(bent[facing] - want).max(axis=-1), 90) < 1e-4
    assert np.abs(bent[facing] - plain[facing]).max(axis=-1).min() > 1e-3


def test_costs_are_counted(renderer: Renderer) -> None:
    def reads(quality: gb.Quality, surface: gb.Surface = BUMPED) -> set[float]:
        scene = gb.Scene([surface], PANORAMA)
        pixels = renderer.render(scene, (64, 64), quality, show="cost").pixels
        assert (pixels[..., 3] == 1).all()
        return set(np.unique(pixels[..., 0]))

    none: dict[str, Any] = {"bump_spread": "none"}
    assert reads(gb.Quality("exact", **none)) == {1.0, 2.0}  # the sky; an environment and slopes
    assert reads(gb.Quality("exact", bump_read="shader", bump_kernel="half", bump_terms="small", **none)) == {1.0, 5.0}
    assert reads(gb.Quality("exact"), gb.Surface(gb.Sphere(), MIRROR)) == {1.0}
    sky = gb.Scene([gb.Surface(gb.Sphere(), MIRROR)], gb.Sky())
    assert not renderer.render(sky, (32, 32), show="cost").pixels.any(), "a formula reads nothing"


def test_nothing_of_it_is_there_otherwise(renderer: Renderer) -> None:
    plan = renderer.plan(SCENE, SIZE)
    assert plan.show == 0
    assert all(surface.has("SHOW") == 0 for surface in plan.surfaces)


def test_names_and_numbers_are_the_shaders() -> None:
    text = (find_shaders() / "show_input.glsl").read_text()
    for name, shown in SHOWN.items():
        assert f"#define SHOW_{name.upper()} {shown.number}\n" in text
    assert sorted(shown.number for shown in SHOWN.values()) == list(range(1, len(SHOWN) + 1))


def test_the_ramp_is_even_to_the_eye() -> None:
    """Luminance alone, as a grey picture keeps it: CIE lightness rises evenly."""
    codes = ramp(np.linspace(0, 1, 65))
    linear = np.where(codes <= 0.04045, codes / 12.92, ((codes + 0.055) / 1.055) ** 2.4)
    luminance = linear @ [0.2126, 0.7152, 0.0722]
    lightness = 116 * np.cbrt(luminance) - 16
    steps = np.diff(lightness)
    assert steps.min() > 0.5 * steps.mean()
    assert steps.max() < 1.7 * steps.mean()
    assert lightness[0] < 20
    assert lightness[-1] > 90
    assert ramp([-1.0, 2.0]) == pytest.approx(ramp([0.0, 1.0]))


def test_on_screens_it_has_colours(renderer: Renderer, tmp_path: Path) -> None:
    frame = renderer.render(SCENE, SIZE, QUALITY, show="normal")
    frame.save(tmp_path / "normal.png", tone="filmic", exposure=3)
    shown = np.asarray(Image.open(tmp_path / "normal.png").convert("RGB"))
    there = frame.pixels[..., 3] == 1
    assert np.array_equal(shown[there], np.rint(255 * (0.5 + 0.5 * frame.pixels[there, :3].astype(float))))
    assert not shown[~there].any()
    frame.save(tmp_path / "normal.exr")
    assert np.array_equal(read_picture(tmp_path / "normal.exr").pixels[..., :3], frame.pixels[..., :3])
    for name in SHOWN:
        assert colours(name, np.ones((2, 3, 4), np.float32)).shape == (2, 3, 4)


def test_the_command(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    def shown(picture: str, *more: str) -> int:
        call = ["render", str(tmp_path / "scene.toml"), "--size", "32x32", "-q", "-o", str(tmp_path / picture), *more]
        return run(call)

    gb.save_scene(gb.Scene([gb.Surface(gb.Sphere(), MIRROR)]), tmp_path / "scene.toml")
    assert shown("uv.png", "--show", "uv") == 0
    assert shown("n.png", "--show", "normal", "--reference") == 0
    assert shown("x.png", "--show", "depth") == 2
    assert "level" in capsys.readouterr().err
    assert shown("x.png", "--show", "level", "--reference") == 1
    assert "normal, uv, reflection" in capsys.readouterr().err
    assert not (tmp_path / "x.png").exists()


def test_a_wrong_name_is_told(renderer: Renderer) -> None:
    with pytest.raises(gb.SceneError, match="unknown show 'depth'; choose one of: level, normal"):
        renderer.render(SCENE, SIZE, show="depth")
