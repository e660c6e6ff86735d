"""The level that a pixel's environment is read at is that of its exact footprint: outlines, seam and poles too."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest

from glbump.camera import Camera, pixel_rays
from glbump.environment import CubeMap, LatLong
from glbump.gl.renderer import Renderer
from glbump.mesh import Mesh
from glbump.quality import Quality
from glbump.reference.cast import Grid, cast
from glbump.reference.filter import direction_level, footprint_axes, quad_differences
from glbump.reference.reflect import reflect_dir, refract_dir
from glbump.scene import Bump, Material, Scene, Surface
from glbump.shapes import Plane, Quad, Sphere, Torus, Transform

F64 = npt.NDArray[np.float64]
SIZE = (128, 128)
MIRROR, GLASS = Material(metallic=1, roughness=0), Material(transmission=1, roughness=0)
PANORAMA = LatLong(np.zeros((256, 512, 3), np.float32))
NEAR = Camera(eye=(0, 1, 10))
SURFACES = {
    "sphere": (Surface(Sphere(), MIRROR), Camera()),
    "sphere, its pole in front": (Surface(Sphere(), MIRROR, transform=Transform(rotate=(80, 0, 0))), Camera()),
    "sphere, stretched": (
        Surface(Sphere(), MIRROR, transform=Transform(rotate=(10, 20, 30), scale=(1, 0.6, 1.3))),
        Camera(),
    ),
    "sphere, seen in parallel": (Surface(Sphere(), MIRROR), Camera(projection="orthographic")),
    "torus": (Surface(Torus(), MIRROR, transform=Transform(rotate=(40, 10, 0))), Camera()),
    "plane to the horizon": (Surface(Plane((400, 400)), MIRROR), NEAR),
    "quad": (Surface(Quad(((-3, -3, 0), (3, -3, 0), (3, 3, 0), (-3, 3, 0))), MIRROR), Camera()),
}
# Of 1e-5 of a pixel, by central differences: their square, times third derivatives, and 1e-16 over it.
STEP = 1e-5


def directions(surface: Surface, camera: Camera, x: float, y: float) -> F64:
    """(H, W, 3) of what rays through (x, y) of each pixel mirror; NaN beside the surface."""
    origins, dirs = (a.reshape(-1, 3) for a in pixel_rays(camera, SIZE, (x, y)))
    matrix = np.linalg.inv(surface.transform.matrix())
    o, d = origins @ matrix[:3, :3].T + matrix[:3, 3], dirs @ matrix[:3, :3].T
    out = np.full(dirs.shape, np.nan)
    if isinstance(surface.shape, Plane | Quad):
        axis = 1 if isinstance(surface.shape, Plane) else 2
        t = -o[:, axis] / d[:, axis]
        half = 200 if axis == 1 else 3
        ray = np.flatnonzero((t > 0) & (np.abs(np.delete(o + t[:, None] * d, axis, 1)).max(axis=1) < half))
        n = np.broadcast_to(np.eye(3)[axis], (len(ray), 3))
    else:
        none = Mesh(np.zeros((0, 3)), np.zeros((0, 3), np.int64))
        hits = cast(surface.shape, none, Grid(np.zeros((0, 3)), *SIZE), o, d)
        ray, n = hits.ray, hits.n @ matrix[:3, :3]
        n /= np.linalg.norm(n, axis=-1, keepdims=True)
    if surface.material is GLASS:
        out[ray] = refract_dir(dirs[ray], n, np.full(len(ray), 1 / GLASS.ior))
    else:
        out[ray] = reflect_dir(dirs[ray], n)
    return out.reshape(*SIZE, 3)


def exact_sides(surface: Surface, camera: Camera) -> tuple[F64, F64]:
    """Changes of those with a pixel to the right and with one up, as they are at its middle."""
    right = directions(surface, camera, 0.5 + STEP, 0.5) - directions(surface, camera, 0.5 - STEP, 0.5)
    up = directions(surface, camera, 0.5, 0.5 - STEP) - directions(surface, camera, 0.5, 0.5 + STEP)
    return right / (2 * STEP), up / (2 * STEP)


def off(level: npt.ArrayLike, exact: F64) -> tuple[float, float]:
    """The 50th and the 99th percentile of how far levels are off; none counts as far."""
    there = np.isfinite(exact)
    assert there.sum() > 1000
    error = np.nan_to_num(np.abs(np.asarray(level) - exact)[there], nan=9.0)
    return float(np.percentile(error, 50)), float(np.percentile(error, 99))


@pytest.mark.parametrize("name", SURFACES)
@pytest.mark.parametrize("samples", [1, 4])
def test_levels_are_those_of_the_exact_footprint(renderer: Renderer, name: str, samples: int) -> None:
    surface, camera = SURFACES[name]
    frame = renderer.render(
        Scene([surface], PANORAMA, camera), SIZE, Quality("balanced", samples=samples), show="level"
    )
    x, y = (side / samples**0.5 for side in exact_sides(surface, camera))
    per_radian = 512 / (2 * np.pi)
    exact = direction_level(x, y, per_radian)
    middle, most = off(frame.pixels[..., 0], exact)
    # The figure is 0.25 at the 99th percentile. llvmpipe is within some 1e-5 but at outlines, where from half
    # a pixel on footprints are kept from growing without bound.
    assert middle < 1e-3
    assert most < 0.25
    # Told apart: levels of footprints that are a tenth longer.
    assert off(frame.pixels[..., 0], direction_level(1.1 * x, 1.1 * y, per_radian))[0] > 0.1


def test_differences_between_pixels_are_not_that_near() -> None:
    """What dFdx gives, one difference for two pixels: what ray differentials are for."""
    for name in ("sphere", "torus"):
        surface, camera = SURFACES[name]
        ddx, ddy = quad_differences(directions(surface, camera, 0.5, 0.5))
        exact = direction_level(*exact_sides(surface, camera), 512 / (2 * np.pi))
        assert off(direction_level(ddx, ddy, 512 / (2 * np.pi)), exact)[1] > 0.3


@pytest.mark.parametrize("name", ["sphere", "torus"])
def test_lengths_of_footprints(renderer: Renderer, name: str) -> None:
    surface, camera = SURFACES[name]
    got = renderer.render(
        Scene([surface], PANORAMA, camera), SIZE, Quality("balanced", samples=1), show="footprint"
    ).pixels
    long, short = (np.linalg.norm(axis, axis=-1) for axis in footprint_axes(*exact_sides(surface, camera)))
    there = np.isfinite(long)
    for channel, want in ((0, long), (1, short)):
        error = np.abs(got[..., channel] / want - 1)[there]
        assert np.percentile(error, 97) < 0.02


def test_glass(renderer: Renderer) -> None:
    """The first look-up is the mirrored one; by the normal alone it would be another."""
    scene = Scene([Surface(Sphere(), GLASS)], PANORAMA)
    level = renderer.render(scene, SIZE, Quality("balanced", samples=1), show="level").pixels[..., 0]
    exact = direction_level(*exact_sides(Surface(Sphere(), MIRROR), Camera()), 512 / (2 * np.pi))
    assert off(level, exact)[1] < 0.25


def test_a_cube_has_no_jump_at_its_edges(renderer: Renderer) -> None:
    surface, camera = SURFACES["sphere"]
    scene = Scene([surface], CubeMap(np.zeros((6, 128, 128, 3), np.float32)), camera)
    level = renderer.render(scene, SIZE, Quality("balanced", samples=1), show="level").pixels[..., 0]
    x, y = exact_sides(surface, camera)
    assert off(level, direction_level(x, y, 64))[1] < 0.25


def bump_level(renderer: Renderer, surface: Surface, camera: Camera) -> F64:
    quality = Quality("balanced", samples=1, bump_spread="none")
    pixels = renderer.render(Scene([surface], PANORAMA, camera), SIZE, quality, show="level").pixels
    return pixels[..., 1].astype(np.float64)


def test_bumps_have_no_jump_at_the_seam_nor_at_poles(renderer: Renderer) -> None:
    """The same all round a ball seen from above a pole, by the footprint of a point in u and v."""
    bump = Bump(np.zeros((64, 64), np.float32) + np.float32(np.linspace(0, 1, 64)), amplitude=1e-4)
    surface = Surface(Sphere(), MIRROR, bump, Transform(rotate=(90, 0, 0)))
    camera = Camera(eye=(0, 0, 4))
    level = bump_level(renderer, surface, camera)
    # Pixels at one distance of the middle, all round: the pole is there, and the seam leads to it.
    y, x = np.mgrid[: SIZE[1], : SIZE[0]] - 63.5
    for radius in (3, 10, 30):
        ring = np.abs(np.hypot(x, y) - radius) < 0.3
        assert np.ptp(level[ring]) < 0.5, radius
    # u goes round once in 2 pi r: a pixel near the pole is more of it.
    rings = [np.median(level[np.abs(np.hypot(x, y) - r) < 0.3]) for r in (3, 10, 30)]
    assert rings[0] - rings[1] == pytest.approx(np.log2(10 / 3), abs=0.3)
