"""Environments in every layout: what is drawn is what the float64 reference looks up, at every level and edge."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from glbump import reference
from glbump.camera import Camera
from glbump.contents import Contents
from glbump.environment import CubeMap, HemiCube, Hemisphere, LatLong, LightProbe, Octahedral
from glbump.errors import LimitError
from glbump.gl.renderer import Renderer
from glbump.maps.layout import (
    EQUAL_AREA,
    EQUIDISTANT,
    HEMICUBE,
    LAYOUTS,
    OCTAHEDRAL,
    ORTHOGRAPHIC,
    PARABOLOID,
    EnvironmentMap,
    completed,
    sheet,
    sheet_corners,
    texel_dirs,
)
from glbump.maps.levels import environment_levels, level_sizes
from glbump.plan import Capabilities, make_plan
from glbump.quality import KNOBS, Quality
from glbump.scene import Material, Scene, Surface
from glbump.shapes import Sphere, Torus

MIRROR = Material(metallic=1, roughness=0)
NOISE = np.random.default_rng(1)


def smooth(dirs: Any) -> Any:
    """Radiance that tells directions apart, and is no multiple of one."""
    return (0.5 + 0.4 * np.sin(3 * dirs + [0, 1, 2])).astype(np.float32)


def pixels(layout: Any, size: int, light: Any = smooth) -> Any:
    """(tiles, H, W, 3) of a layout, as a user's file has it."""
    _, height, width = layout.shape(size)
    return completed(layout, light(texel_dirs(layout, (width, height))))


def noise(dirs: Any) -> Any:
    return NOISE.random(dirs.shape).astype(np.float32)


def hemicube(light: Any = smooth, size: int = 64, **more: Any) -> HemiCube:
    east, west, south, north, upper, lower = pixels(HEMICUBE, size, light)
    return HemiCube([np.concatenate([upper, lower]), east, west, south, north], orientation="opengl", **more)


def side_by_side(tiles: Any) -> Any:
    return np.concatenate(list(tiles), axis=1)


# Those that the GPU keeps as tiles of a texture of their own.
TILED: dict[str, Any] = {
    "hemicube": hemicube,
    "octahedral": lambda light=smooth, size=64: Octahedral(pixels(OCTAHEDRAL, size, light)[0]),
    "equal-area": lambda light=smooth, size=64: Hemisphere(pixels(EQUAL_AREA, size, light)[0], "equal-area"),
    "equidistant": lambda light=smooth, size=64: Hemisphere(pixels(EQUIDISTANT, size, light)[0]),
    "orthographic": lambda light=smooth, size=64: Hemisphere(pixels(ORTHOGRAPHIC, size, light)[0], "orthographic"),
    "dual-paraboloid": lambda light=smooth, size=64: Hemisphere(
        side_by_side(pixels(PARABOLOID, size, light)), "dual-paraboloid"
    ),
}


def scene(environment: Any, shape: Any = None) -> Scene:
    return Scene([Surface(shape or Torus(0.8, 0.35), MIRROR)], environment, Camera(eye=(0.3, 1.6, 2.4), fov=50))


@pytest.mark.parametrize("how", KNOBS["environment_filter"].values)
@pytest.mark.parametrize("name", TILED)
def test_tiles_are_the_reference_at_every_level(renderer: Renderer, name: str, how: str) -> None:
    """Of noise, where a texel's slip or another level shows at once."""
    environment = TILED[name](noise, 66)
    quality = Quality("exact", samples=1, environment_filter=how)
    # A small picture, so that levels are used.
    got = renderer.render(scene(environment), (48, 48), quality).pixels
    want = reference.render(scene(environment), (48, 48), 1, quality=quality).pixels
    error = np.abs(got - want).max(axis=-1)
    # Coordinates of 32 bits: 1e-5 of a texel. A level near a half goes either way; along outlines, a pixel in 25, the
    # GPU goes on past the surface where the reference has no footprint.
    assert (error > 1e-3).mean() < (0.05 if how != "bilinear" else 0.02)
    assert np.median(error) < 2e-5
    other = Quality("exact", samples=1, environment_filter="trilinear" if how == "bilinear" else "bilinear")
    assert np.abs(renderer.render(scene(environment), (48, 48), other).pixels - got).mean() > 0.01


@pytest.mark.parametrize("name", TILED)
def test_every_layout_shows_the_same_world(renderer: Renderer, name: str) -> None:
    """A smooth environment drawn in each layout by formula: the upper half of what any other layout shows."""
    u, v = np.meshgrid((np.arange(256) + 0.5) / 256, (np.arange(128) + 0.5) / 128)
    panorama = LatLong(smooth(LAYOUTS["lat-long"].dir(0, u, v)))
    up = Camera(eye=(0, 0, 0), target=(0.2, 1, -0.3), fov=100)
    got, want = (
        renderer.render(Scene([], e, up), (64, 64), Quality("exact", samples=1)).pixels
        for e in (TILED[name](size=128), panorama)
    )
    # Bilinear in texels of up to 0.05 radians (a disc's rim): h^2 / 8 times the second derivative, 3.6. Along the folds
    # of an octahedron, where directions turn as they cross, a quarter of a texel of a slope of 1.2.
    assert np.abs(got - want).max() < (0.01 if name == "octahedral" else 2e-3)
    mirrored = LatLong(np.ascontiguousarray(smooth(LAYOUTS["lat-long"].dir(0, u, v))[:, ::-1]))
    assert np.abs(renderer.render(Scene([], mirrored, up), (64, 64), "exact").pixels - got).max() > 0.1


@pytest.mark.parametrize("projection", ["angular", "mirror-ball"])
def test_light_probes_show_the_same_world(renderer: Renderer, projection: str) -> None:
    probe = LightProbe(pixels(LAYOUTS[projection], 512)[0], projection)
    cube = CubeMap(smooth(texel_dirs(LAYOUTS["cube"], (128, 128))), orientation="opengl")
    for target in ((1, 0.2, 0.1), (-0.3, -1, 0.4), (0.3, 0.1, 1)):
        camera = Camera(eye=(0, 0, 0), target=target, fov=90)
        got, want = (renderer.render(Scene([], e, camera), (48, 48), "exact").pixels for e in (probe, cube))
        # The ball's rim, towards -Z, has few texels, and is not looked at here; else two bilinear reads.
        assert np.abs(got - want).max() < 4e-3


def test_what_lies_below_is_the_colour_or_the_mirrored_side(renderer: Renderer) -> None:
    red = (1.0, 0.1, 0.0)
    for make in (lambda **more: hemicube(**more), lambda **more: Hemisphere(pixels(EQUIDISTANT, 64)[0], **more)):
        down = Camera(eye=(0, 0, 0), target=(0.3, -1, 0.2), fov=60)
        up = Camera(eye=(0, 0, 0), target=(0.3, 1, 0.2), up=(0, 0, -1), fov=60)
        below = renderer.render(Scene([], make(below=red), down), (32, 32), "exact").pixels
        assert np.abs(below[..., :3] - red).max() < 1e-6
        mirrored = renderer.render(Scene([], make(), down), (33, 33), Quality("exact", samples=1)).pixels
        above = renderer.render(Scene([], make(), up), (33, 33), Quality("exact", samples=1)).pixels
        # The same direction but for its height: the middle of both pictures.
        assert mirrored[16, 16] == pytest.approx(above[16, 16], abs=1e-5)
        for quality in ("exact", "balanced"):
            level = Scene([], make(below=red), Camera(eye=(0, 0, 0), target=(1, 0, 0.2)))
            got = renderer.render(level, (32, 32), quality).pixels
            want = reference.render(level, (32, 32), Quality(quality).samples, quality=quality).pixels
            assert np.abs(got - want).max() < (1e-4 if quality == "exact" else 4e-3)


@pytest.mark.parametrize("layout", [name for name in KNOBS["environment_layout"].values if name != "given"])
def test_a_panorama_may_be_kept_in_any_layout(renderer: Renderer, layout: str) -> None:
    u, v = np.meshgrid((np.arange(256) + 0.5) / 256, (np.arange(128) + 0.5) / 128)
    seen = scene(LatLong(smooth(LAYOUTS["lat-long"].dir(0, u, v))), Sphere())
    given, kept = (
        renderer.render(seen, (64, 64), Quality("exact", samples=1, environment_layout=name))
        for name in ("given", layout)
    )
    # Two bilinear reads; the octahedron's folds as above.
    assert np.abs(kept.pixels - given.pixels).max() < 0.012
    assert np.abs(kept.pixels - given.pixels).mean() < 1e-3
    assert kept.stats["plan"]["environment"].startswith(layout)


def test_a_hemicube_takes_half_the_memory_of_a_cube(renderer: Renderer) -> None:
    cube = CubeMap(smooth(texel_dirs(LAYOUTS["cube"], (256, 256))), orientation="opengl")
    with Renderer(context=renderer.context) as own:
        sizes = []
        for environment in (cube, hemicube(size=256)):
            own._store.release()
            sizes.append(own.render(Scene([], environment), (16, 16), Quality("exact", samples=1)).stats["bytes"])
    # And the borders of its tiles, 2 texels of 256 and of 128.
    assert sizes[1] / sizes[0] == pytest.approx(0.5, rel=0.03)


def test_levels_lie_apart_on_their_sheet() -> None:
    """Every texel of every level and its border has a place of its own, where the shader looks for it."""
    for layout, size in ((HEMICUBE, 37 * 2), (OCTAHEDRAL, 33), (PARABOLOID, 20)):
        environment = EnvironmentMap(layout, pixels(layout, size, noise))
        levels = environment_levels(environment)
        sizes = level_sizes(environment)
        assert [(level.shape[2], level.shape[1]) for level in levels] == sizes
        assert sizes[-1] == (1, 1)
        ones = [np.ones_like(level) for level in levels]
        corners = sheet_corners(layout.tiles, sizes)
        whole = sheet(layout, ones)[..., 0]
        assert whole.sum() == sum(layout.tiles * (w + 2) * (h + 2) for w, h in sizes)
        for (x, y), (w, h) in zip(corners, sizes):
            assert (whole[y : y + layout.tiles * (h + 2), x : x + w + 2] == 1).all()


def test_one_too_large_for_the_driver_is_refused_with_what_fits() -> None:
    small = Capabilities(max_texture_size=64, max_cube_size=32)
    for environment in (TILED["octahedral"](size=64), hemicube(size=64)):
        with pytest.raises(LimitError, match=r"this driver takes at most 64 a side; shrink it to \d+x\d+ first"):
            make_plan(Scene([], environment), Quality("exact"), (16, 16), Contents(), small)
