"""Levels of environments: light kept, constants, edges, and the Kaiser kernel."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from glbump import reference
from glbump.environment import CubeMap, LatLong, Octahedral
from glbump.errors import LimitError
from glbump.gl.context import Context
from glbump.gl.levels import generate_levels, texture_2d
from glbump.gl.renderer import Renderer
from glbump.maps import area, cube
from glbump.maps.continuity import seam_step
from glbump.maps.layout import (
    CUBE,
    HEMICUBE,
    LATLONG,
    LAYOUTS,
    OCTAHEDRAL,
    EnvironmentMap,
    Layout,
    completed,
    on_border,
    sample,
    texel_dirs,
)
from glbump.maps.levels import angles, environment_levels, level_sizes, texel_angles
from glbump.maps.overlap import Grid
from glbump.maps.pyramid import chain, chain_by, kaiser
from glbump.quality import KNOBS, Quality
from glbump.scene import Bump, Material, Scene, Surface
from glbump.shapes import Torus, Transform

NOISE = np.random.default_rng(11)
MIRROR = Material(metallic=1, roughness=0)


def noisy(layout: Layout, size: int, *, border: bool = False) -> EnvironmentMap:
    """Noise with a sun of 1e4 where a texel's solid angle is far from the mean."""
    tiles, height, width = layout.shape(size)
    pixels = NOISE.random((tiles, height, width, 3), dtype=np.float32)
    pixels[0, height // 8, width // 8] = 1e4
    grid: Any = on_border((width, height)) if border else ()
    return EnvironmentMap(layout, completed(layout, pixels), *grid)


def light(environment: EnvironmentMap, levels: list[Any]) -> Any:
    """(L, 3): radiance times solid angle, summed, of each level."""
    angle = [texel_angles(environment, size) for size in level_sizes(environment)]
    return np.array([(level * a[..., None]).sum(axis=(0, 1, 2), dtype=float) for level, a in zip(levels, angle)])


def full(environment: EnvironmentMap, size: tuple[int, int]) -> Any:
    return np.broadcast_to(texel_angles(environment, size), (environment.layout.tiles, size[1], size[0]))


# ------------------------------------------------------------ solid angles


@pytest.mark.parametrize("layout", LAYOUTS.values(), ids=str)
def test_solid_angles_are_those_of_the_cells(layout: Layout) -> None:
    size = layout.shape(32)[:0:-1]
    environment = EnvironmentMap(layout, np.ones((*layout.shape(32), 3), np.float32))
    got, want = full(environment, size), area.solid_angles(Grid(layout, size))
    if layout.disc:
        # Cells end at the rim, texels do not: those well inside.
        s, t = np.meshgrid(*((np.arange(n) + 0.5) / n - 0.5 for n in size))
        got, want = (a[:, np.hypot(s, t) < 0.45] for a in (got, want))
    # Arcs in place of bent edges: some (1/64)^2 of a texel.
    assert np.abs(got / want - 1).max() < 1e-3
    if layout in (CUBE, HEMICUBE, LATLONG, OCTAHEDRAL):
        assert np.abs(got / want - 1).max() < 1e-9
        assert got.sum() == pytest.approx(4 * np.pi if layout.whole else 2 * np.pi, rel=1e-12)


def test_solid_angles_of_a_cube_are_the_closed_form_to_rounding_and_span_5_196() -> None:
    for n in (1, 2, 7, 64, 1024):
        edges = np.arange(n + 1) / n
        got = angles(CUBE, edges, edges)[0]
        assert np.abs(got / cube.solid_angles(n) - 1).max() < 3e-10  # 2^-53 n^2 of a triple product
    assert got.max() / got.min() == pytest.approx(3 * np.sqrt(3), rel=2e-3)


# ------------------------------------------------------------ light kept


@pytest.mark.parametrize("size", [16, 14, 18, 50, 96])
@pytest.mark.parametrize("layout", [LATLONG, CUBE, HEMICUBE, OCTAHEDRAL], ids=str)
def test_every_level_has_the_same_light(layout: Layout, size: int) -> None:
    environment = noisy(layout, size)
    got = light(environment, environment_levels(environment))
    # The rounding of float32, of a sun that is most of the light; an octahedron's texels of odd sizes are bent at the
    # folds: parts of 1e-4 of them.
    assert np.abs(got / got[0] - 1).max() < (2e-4 if layout is OCTAHEDRAL and size != 16 else 2e-7)
    alike = light(environment, chain(environment.pixels))
    assert np.abs(alike / alike[0] - 1).max() > 0.05


@pytest.mark.parametrize("size", [7, 9, 33, 45])
@pytest.mark.parametrize("layout", [LATLONG, CUBE], ids=str)
def test_odd_sizes_keep_it_too(layout: Layout, size: int) -> None:
    environment = noisy(layout, size)
    got = light(environment, environment_levels(environment))
    assert np.abs(got / got[0] - 1).max() < 2e-7
    assert np.abs(light(environment, chain(environment.pixels)) / got[0] - 1).max() > 0.05


@pytest.mark.parametrize("size", [2, 8, 17, 32, 33])
@pytest.mark.parametrize("layout", [LATLONG, CUBE], ids=str)
def test_samples_on_borders_keep_it_and_are_one(layout: Layout, size: int) -> None:
    """OpenEXR's: the outermost cover half of what the others do; those on one edge are alike at all levels."""
    environment = noisy(layout, size, border=True)
    levels = environment_levels(environment)
    got = light(environment, levels)
    assert np.abs(got / got[0] - 1).max() < 2e-7
    for level, (w, h) in zip(levels[1:], level_sizes(environment)[1:]):
        if min(w, h) < 2:
            continue
        if layout is LATLONG:
            assert np.array_equal(level[:, :, 0], level[:, :, -1])
            assert (level[0, 0] == level[0, 0, :1]).all()
        else:
            # +X's left column, from the top, lies on +Z's right one; +Y's lowest row on +Z's top row.
            assert np.array_equal(level[0, :, 0], level[4, :, -1])
            assert np.array_equal(level[2, -1], level[4, 0])


@pytest.mark.parametrize("layout", [LATLONG, CUBE], ids=str)
def test_samples_on_borders_are_read_without_a_step(layout: Layout) -> None:
    """Just before and behind each edge, at every level, as shaders read them: with the grid of level 0."""
    environment = noisy(layout, 33, border=True)
    edges = np.linspace(-0.97, 0.97, 50)
    eps = 1e-9
    if layout is CUBE:
        behind = np.stack([np.full(50, 1.0), edges, np.full(50, 1 - eps)], axis=-1)
        before = behind[:, ::-1]
    else:
        behind, before = (np.stack([np.full(50, x), edges, np.ones(50)], axis=-1) for x in (-eps, eps))
    for level in environment_levels(environment)[1:]:
        read = EnvironmentMap(layout, level, environment.scale, environment.offset)
        step = np.abs(sample(read, before) - sample(read, behind)).max()
        plain = EnvironmentMap(layout, NOISE.random(level.shape, dtype=np.float32) * level.max())
        other = EnvironmentMap(layout, plain.pixels, environment.scale, environment.offset)
        if level.shape[1] > 1:
            assert step < 1e-5 * level.max()
            assert np.abs(sample(other, before) - sample(other, behind)).max() > 1e-3 * level.max()


@pytest.mark.parametrize("how", ["box", "kaiser", "hardware"])
@pytest.mark.parametrize("layout", LAYOUTS.values(), ids=str)
def test_a_constant_stays_exactly(layout: Layout, how: str) -> None:
    for size in (2, 24, 27 if layout is not HEMICUBE else 26):
        environment = EnvironmentMap(layout, np.full((*layout.shape(size), 3), 0.3, np.float32))
        for level in environment_levels(environment, how):
            assert (level == np.float32(0.3)).all()


@pytest.mark.parametrize("layout", LAYOUTS.values(), ids=str)
@pytest.mark.parametrize("size", [2, 6, 30])
def test_sizes(layout: Layout, size: int) -> None:
    environment = noisy(layout, size)
    for how in ("box", "kaiser", "hardware"):
        levels = environment_levels(environment, how)
        assert [level.shape[2:0:-1] for level in levels] == level_sizes(environment)
        assert levels[0] is environment.pixels or how == "hardware"
        assert all(level.dtype == np.float32 for level in levels)


def test_one_texel_is_its_own_only_level() -> None:
    for layout, shape in ((LATLONG, (1, 1, 1, 3)), (CUBE, (6, 1, 1, 3)), (OCTAHEDRAL, (1, 1, 1, 3))):
        for grid in ((), on_border((1, 1))):
            environment = EnvironmentMap(layout, NOISE.random(shape, dtype=np.float32), *grid)
            assert [level.shape for level in environment_levels(environment)] == [shape]


def test_thin_pictures() -> None:
    for shape in ((1, 1, 9, 3), (1, 9, 1, 3), (1, 2, 64, 3)):
        environment = EnvironmentMap(LATLONG, NOISE.random(shape, dtype=np.float32))
        got = light(environment, environment_levels(environment))
        assert np.abs(got / got[0] - 1).max() < 2e-7
        assert environment_levels(environment, "kaiser")[-1].shape == (1, 1, 1, 3)


def test_a_lat_longs_mean_is_that_of_the_sphere() -> None:
    """White above the 45th parallel: (1 - sin 45) / 2 of the sphere, and a quarter of the rows."""
    pixels = np.zeros((1, 256, 512, 3), np.float32)
    pixels[:, :64] = 1
    environment = EnvironmentMap(LATLONG, pixels)
    assert environment_levels(environment)[-1][0, 0, 0, 0] == pytest.approx((1 - np.sqrt(0.5)) / 2, rel=1e-6)
    assert environment_levels(environment, "hardware")[-1][0, 0, 0, 0] == 0.25


# ------------------------------------------------------------ Kaiser


def _waves(layout: Layout, size: int, frequency: float = 9) -> Any:
    _, height, width = layout.shape(size)
    return EnvironmentMap(layout, waves(texel_dirs(layout, (width, height)), frequency))


def waves(dirs: Any, frequency: float = 9) -> Any:
    return (0.5 + 0.4 * np.sin(frequency * dirs + [0, 1, 2])).astype(np.float32)


@pytest.mark.parametrize("layout", [LATLONG, CUBE, HEMICUBE, OCTAHEDRAL], ids=str)
def test_kaiser_keeps_waves_better_than_the_box_and_has_no_seam(layout: Layout) -> None:
    error = {}
    for how in ("box", "kaiser"):
        level = environment_levels(_waves(layout, 64), how)[2]
        error[how] = float(np.sqrt(np.mean((level - waves(texel_dirs(layout, level.shape[2:0:-1]))) ** 2)))
    # At a lat-long's poles texels are so narrow that both are off by as much.
    assert error["kaiser"] < (0.95 if layout is LATLONG else 0.9) * error["box"]
    level = EnvironmentMap(layout, environment_levels(_waves(layout, 64, 3), "kaiser")[1])
    # The function's own values have steps of 1. An octahedron's folds bend within the kernel; a lat-long's last row is
    # mended as a mean is (`glbump.maps.poles`), which it is not quite.
    assert seam_step(level) < {LATLONG: 1.1, OCTAHEDRAL: 1.1}.get(layout, 1.05)


def test_kaiser_stays_within_what_the_picture_holds() -> None:
    for layout in (LATLONG, CUBE, OCTAHEDRAL):
        pixels = (NOISE.random((*layout.shape(64), 3)) > 0.5).astype(np.float32)
        levels = environment_levels(EnvironmentMap(layout, pixels), "kaiser")
        assert all(level.min() >= 0 and level.max() <= 1 for level in levels)
    # It would ring: a step's other side goes below 0.
    step = np.zeros((64, 64, 1))
    step[:, 32:] = 1
    assert kaiser(step, wraps=False).min() < -0.01


def test_kaiser_wraps_or_ends() -> None:
    pixels = NOISE.random((24, 40, 2))
    wrapped, ended = kaiser(pixels, wraps=True), kaiser(pixels, wraps=False)
    assert np.abs(kaiser(np.roll(pixels, (2, 4), (0, 1)), wraps=True) - np.roll(wrapped, (1, 2), (0, 1))).max() < 1e-14
    assert np.abs(wrapped[3:-3, 3:-3] - ended[3:-3, 3:-3]).max() < 1e-14
    assert np.abs(wrapped[0] - ended[0]).max() > 0.01
    # Its sum is the picture's, where sizes are even and it repeats.
    assert wrapped.mean(axis=(0, 1)) == pytest.approx(pixels.mean(axis=(0, 1)), rel=1e-12)


@pytest.mark.parametrize("n", [2, 3, 7, 8, 13, 64])
def test_kaiser_of_any_size(n: int) -> None:
    pixels = NOISE.random((n, n, 1))
    assert kaiser(pixels, wraps=True).shape == (n // 2, n // 2, 1)
    assert np.abs(kaiser(np.full((n, n, 1), 0.7), wraps=True) - 0.7).max() < 1e-15
    # Symmetric: a mirrored picture gives the mirrored level.
    assert np.abs(kaiser(pixels[::-1], wraps=True)[::-1] - kaiser(pixels, wraps=True)).max() < 1e-14


def test_kaiser_keeps_what_a_level_can_hold_and_stops_what_it_cannot() -> None:
    """Waves of 8 texels keep 0.97 of their contrast where the box keeps 0.92; of 2.7, which would be others."""
    x = np.arange(64)

    def kept(waves: int) -> tuple[float, float]:
        picture = np.broadcast_to(np.cos(2 * np.pi * waves * (x + 0.5) / 64)[None, :, None], (64, 64, 1))
        return tuple(
            float(np.sqrt(2 * np.mean(level**2))) for level in (kaiser(picture, wraps=True), chain(picture)[1])
        )

    assert kept(8)[0] > 0.97 > 0.93 > kept(8)[1]
    assert kept(24)[0] < 0.12 < 0.35 < kept(24)[1]


# ------------------------------------------------------------ who makes them, on the GPU


def texture_levels(texture: Any, count: int) -> list[Any]:
    """(h, w, components) float32 of a 2D texture of half or of 32-bit floats."""
    kind = {"f2": np.float16, "f4": np.float32}[texture.dtype]
    sizes = [(max(texture.width >> i, 1), max(texture.height >> i, 1)) for i in range(count)]
    return [
        np.frombuffer(texture.read(level=i, alignment=1), kind).reshape(h, w, -1).astype(np.float32)
        for i, (w, h) in enumerate(sizes)
    ]


@pytest.mark.parametrize(("dtype", "rounding"), [("f4", 3e-7), ("f2", 3e-3)])
def test_hardware_levels_of_powers_of_two_are_the_box(context: Context, dtype: str, rounding: float) -> None:
    pixels = NOISE.random((32, 64, 3), dtype=np.float32)
    texture = texture_2d(context, [pixels], dtype)
    generate_levels(context, texture)
    got = texture_levels(texture, 7)
    texture.release()
    for level, want in zip(got, chain(pixels), strict=True):
        # Each of six levels is rounded, halves down by up to 2^-11.
        assert np.abs(level - want).max() < rounding
    assert np.abs(got[1] - chain(np.roll(pixels, 1, axis=1))[1]).max() > 0.1


def test_hardware_levels_of_odd_sizes_drop_texels(context: Context) -> None:
    """What llvmpipe leaves of each of seven texels in the last level; others may do better, none is asked to."""
    left = []
    for k in range(7):
        texture = texture_2d(context, [np.eye(7, dtype=np.float32)[k].reshape(1, 7, 1).repeat(3, axis=2)], "f4")
        generate_levels(context, texture)
        left.append(float(texture_levels(texture, 3)[2][0, 0, 0]))
        texture.release()
    # Each counts for a seventh in a mean; the shares of a driver's add up to 1, too.
    assert sum(left) == pytest.approx(1, abs=1e-6)
    if context.is_software:
        assert left[3] == pytest.approx(1, abs=1e-6)


def test_levels_that_a_driver_does_not_make_are_refused_in_one_line(context: Context) -> None:
    texture = context.gl.texture((16, 16), 3, dtype="u4")
    with pytest.raises(LimitError, match=r"^this driver makes no mip levels of 3 channels of 'u4' .*\"box\"") as caught:
        generate_levels(context, texture)
    texture.release()
    assert "\n" not in str(caught.value)
    assert context.gl.error == "GL_NO_ERROR"


PICTURES: dict[str, Any] = {
    "lat-long": LatLong(NOISE.random((32, 64, 3), dtype=np.float32)),
    "cube": CubeMap(NOISE.random((6, 32, 32, 3), dtype=np.float32)),
    "octahedral": Octahedral(NOISE.random((64, 64, 3), dtype=np.float32)),
    "an HDR picture": LatLong(10 * NOISE.random((32, 64, 3), dtype=np.float32)),
}


@pytest.mark.parametrize("how", KNOBS["pyramid"].values)
@pytest.mark.parametrize("name", PICTURES)
def test_levels_on_the_gpu_are_the_references(renderer: Renderer, name: str, how: str) -> None:
    scene = Scene([Surface(Torus(0.8, 0.35), MIRROR)], PICTURES[name])
    quality = Quality("exact", samples=1, environment_filter="trilinear", pyramid=how)
    got = renderer.render(scene, (48, 48), quality)
    want = reference.render(scene, (48, 48), 1, quality=quality).pixels
    error = np.abs(got.pixels - want).max(axis=-1) / want.max()
    # Coordinates of 32 bits; along outlines the GPU goes on past the surface where the reference has no footprint.
    assert np.median(error) < 2e-5
    assert (error > 5e-3).mean() < 0.06
    said = got.stats["plan"]["environment pyramid"]
    falls_back = {"hardware": name == "octahedral", "box": False, "kaiser": name == "an HDR picture"}[how]
    assert said.startswith("box" if falls_back else how)
    other = Quality("exact", samples=1, environment_filter="trilinear", pyramid="box" if how != "box" else "kaiser")
    if not falls_back and name != "an HDR picture":
        different = renderer.render(scene, (48, 48), other).pixels
        assert np.abs(different - want).max(axis=-1).mean() > 20 * np.median(error * want.max())


@pytest.mark.parametrize("how", KNOBS["pyramid"].values)
def test_a_resampled_cube_has_these_levels_too(renderer: Renderer, how: str) -> None:
    scene = Scene([Surface(Torus(0.8, 0.35), MIRROR)], _panorama())
    quality = Quality("balanced", samples=1, pyramid=how, texture_format="float")
    cube_kept = renderer.render(scene, (48, 48), replace(quality, environment_layout="cube"))
    given = renderer.render(scene, (48, 48), quality)
    # Other texels, a level of which is never more than 1.5 times as large.
    assert np.abs(cube_kept.pixels - given.pixels).mean() < 0.02
    assert cube_kept.stats["plan"]["environment pyramid"].startswith(how)


def _panorama() -> Any:
    return LatLong(waves(texel_dirs(LATLONG, (128, 64)), 3)[0])


def test_codes_are_not_left_to_the_driver(renderer: Renderer) -> None:
    """8 bits by the sRGB curve: drivers average codes."""
    scene = Scene([], LatLong(NOISE.random((32, 64, 3), dtype=np.float32)))
    quality = Quality("balanced", pyramid="hardware", texture_format="srgb8")
    plan = renderer.render(scene, (16, 16), quality).stats["plan"]
    assert (plan["texture format"], plan["environment pyramid"]) == ("srgb8", "box")


@pytest.mark.parametrize("how", KNOBS["pyramid"].values)
def test_levels_of_bumps_are_the_references(renderer: Renderer, how: str) -> None:
    heights = NOISE.random((32, 32)).astype(np.float32)
    far = Transform(rotate=(20, 0, 0))
    scene = Scene([Surface(Torus(0.8, 0.35), MIRROR, Bump(heights, amplitude=0.01, repeat=(12, 6)), far)], _panorama())
    quality = Quality("exact", samples=1, bump_filter="trilinear", pyramid=how)
    got = renderer.render(scene, (64, 64), quality)
    want = reference.render(scene, (64, 64), 1, quality=quality).pixels
    error = np.abs(got.pixels - want).max(axis=-1)
    assert (error > 0.03).mean() < 0.06  # outlines, and a driver's levels (0.043)
    assert got.stats["plan"]["surface 0 bump pyramid"] == how
    other = replace(quality, pyramid="kaiser" if how != "kaiser" else "box")
    assert np.abs(renderer.render(scene, (64, 64), other).pixels - got.pixels).max() > 0.01
    moments = replace(quality, bump_spread="lean", pyramid="kaiser")
    assert renderer.render(scene, (64, 64), moments).stats["plan"]["surface 0 bump pyramid"] == "box"


def test_a_chain_by_kaiser_keeps_its_range_and_its_sizes() -> None:
    slopes = NOISE.normal(size=(45, 30, 2)).astype(np.float32)
    levels = chain_by("kaiser", slopes, wraps=True)
    assert [level.shape for level in levels] == [level.shape for level in chain(slopes)]
    assert all(level.min() >= slopes.min() and level.max() <= slopes.max() for level in levels)
    assert np.abs(levels[2] - chain(slopes)[2]).max() > 0.01
    assert all(np.array_equal(a, b) for a, b in zip(chain_by("box", slopes, wraps=True), chain(slopes), strict=True))
