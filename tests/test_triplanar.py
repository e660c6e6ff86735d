"""Bumps without u and v: laid along the object's axes; and gradients that are taken from pixel to pixel."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from glbump import reference
from glbump.camera import Camera
from glbump.environment import LatLong
from glbump.errors import SceneError
from glbump.gl.renderer import Renderer
from glbump.maps.angles import degrees_between
from glbump.maps.layout import LATLONG, texel_dirs
from glbump.quality import KNOBS, Quality
from glbump.reference.bump import triplanar_shares, volume_gradient
from glbump.relief import MOST_MIXING
from glbump.scene import Bump, Material, NormalMap, Scene, Surface
from glbump.shapes import Cube, MeshFile, Plane, Quad, Sphere, Torus, Transform

MIRROR = Material(metallic=1, roughness=0)
DIRS = texel_dirs(LATLONG, (256, 128))[0]
# Looked up by the normal, the colour is the normal.
NORMAL = LatLong((0.5 + 0.5 * DIRS).astype(np.float32), lookup="normal", background=False)
X, Y = np.meshgrid((np.arange(64) + 0.5) / 64, 1 - (np.arange(64) + 0.5) / 64)
WAVES = (0.5 + 0.25 * np.sin(2 * np.pi * X) + 0.25 * np.cos(2 * np.pi * (X + 2 * Y))).astype(np.float32)
ONE = Quality("exact", samples=1)
CAMERA = Camera(eye=(1.1, 1.3, 3.2), target=(0, 0, 0), fov=40)
TRIPLANAR = Bump(WAVES, 0.06, repeat=(0.7, 0.9), mapping="triplanar")


def shapes(folder: Path) -> dict[str, Any]:
    return {
        "sphere": Sphere(1.1),
        "torus": Torus(0.8, 0.35),
        "cube": Cube((1.2, 1.6, 1.0)),
        "plane": Plane((2, 1.5)),
        "quad": Quad(((-1, -1, 0), (1, -1.2, 0.0), (0.9, 1, 0), (-0.8, 0.8, 0))),
        "mesh": MeshFile(octahedron(folder)),
    }


def octahedron(folder: Path) -> Path:
    """A mesh file with no texture coordinates."""
    corners = [(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)]
    faces = [(1, 3, 5), (3, 2, 5), (2, 4, 5), (4, 1, 5), (3, 1, 6), (2, 3, 6), (4, 2, 6), (1, 4, 6)]
    lines = [*("v {} {} {}".format(*c) for c in corners), *("f {} {} {}".format(*f) for f in faces)]
    path = folder / "octahedron.obj"
    path.write_text("\n".join(lines))
    return path


def normals(frame: Any) -> Any:
    n = 2 * frame.pixels[..., :3].astype(np.float64) - 1
    return n / np.maximum(np.linalg.norm(n, axis=-1, keepdims=True), 1e-9)


def scene_of(shape: Any, bump: Any, **more: Any) -> Scene:
    return Scene([Surface(shape, MIRROR, bump, **more)], NORMAL, CAMERA)


def apart(renderer: Renderer, scene: Scene, quality: Quality = ONE, size: int = 64) -> float:
    """Degrees between the GPU and the reference, outlines apart.

    Differences from pixel to pixel are others where a quad of pixels sees two parts of a surface: the reference takes
    them across, the GPU on each part's own plane. That is up to a tenth of these pixels.
    """
    got = renderer.render(scene, (size, size), quality)
    want = reference.render(scene, (size, size), quality.samples, quality=quality)
    both = (got.pixels[..., 3] == 1) & (want.pixels[..., 3] == 1)
    # A quad of pixels that an outline cuts has no neighbours in the reference.
    inner = both[1:-1, 1:-1] & both[2:, 1:-1] & both[:-2, 1:-1] & both[1:-1, 2:] & both[1:-1, :-2]
    share = 88 if quality.bump_filter != "bilinear" or quality.bump_read == "screen" else 99
    return float(np.percentile(degrees_between(normals(got), normals(want))[1:-1, 1:-1][inner], share))


@pytest.mark.parametrize("name", ["sphere", "torus", "cube", "plane", "quad", "mesh"])
def test_it_is_the_reference_on_every_shape(renderer: Renderer, name: str, tmp_path: Path) -> None:
    shape = shapes(tmp_path)[name]
    for transform in (
        Transform(),
        Transform(rotate=(20, 30, 0), scale=2.0, translate=(0.1, 0.2, -3)),
        Transform(rotate=(10, 40, 5), scale=(1.3, 0.7, 1.1)),
    ):
        scene = scene_of(shape, TRIPLANAR, transform=transform)
        assert apart(renderer, scene) < 0.02
        assert apart(renderer, scene, Quality("exact", samples=1, bump_filter="trilinear")) < 0.02
        flat = scene_of(shape, None, transform=transform)
        assert (
            np.abs(renderer.render(scene, (64, 64), ONE).pixels - renderer.render(flat, (64, 64), ONE).pixels).max()
            > 0.03
        )


@pytest.mark.parametrize("kernel", KNOBS["bump_kernel"].values)
def test_every_kernel_and_read(renderer: Renderer, kernel: str) -> None:
    for read in ("baked", "shader", "screen"):
        quality = Quality("exact", samples=1, bump_kernel=kernel, bump_read=read)
        limit = 0.02 if read != "screen" else 0.1  # differences of 32-bit floats, over a pixel
        for bump in (TRIPLANAR, Bump(WAVES, 0.06, repeat=(3, 2)), [TRIPLANAR, Bump(WAVES, 0.03)]):
            assert apart(renderer, scene_of(Torus(0.8, 0.35), bump), quality) < limit
            assert apart(renderer, scene_of(Plane((2, 1.5)), bump), quality) < limit


def test_borders(renderer: Renderer) -> None:
    for border in ("mirror", "clamp"):
        for read in ("baked", "screen"):
            bump = replace(TRIPLANAR, border=border)
            quality = Quality("exact", samples=1, bump_read=read, bump_filter="trilinear")
            assert apart(renderer, scene_of(Cube((1.2, 1.6, 1.0)), bump), quality) < 0.1


def test_on_a_cube_it_is_its_uv(renderer: Renderer) -> None:
    """Faces of a cube have u and v upright from outside, from one corner; the axes count from its middle."""
    by_uv = Bump(WAVES, 0.06)
    middle = np.roll(WAVES, (32, 32), (0, 1))
    by_axes = Bump(middle, 0.06, repeat=(0.5, 0.5), mapping="triplanar")
    for eye in ((2.5, 2, 3), (-2.5, -2, 3), (2, -3, -2.5), (-1, 4, -2)):
        camera = Camera(eye=eye, target=(0, 0, 0), fov=50)
        scenes = [Scene([Surface(Cube(), MIRROR, b)], NORMAL, camera) for b in (by_uv, by_axes)]
        want, got = (renderer.render(scene, (64, 64), ONE) for scene in scenes)
        assert degrees_between(normals(got), normals(want))[want.pixels[..., 3] == 1].max() < 0.02
        off = Scene([Surface(Cube(), MIRROR, replace(by_axes, height=WAVES))], NORMAL, camera)
        assert degrees_between(normals(renderer.render(off, (64, 64), ONE)), normals(want)).max() > 1


def test_lengths_are_of_the_world(renderer: Renderer) -> None:
    """A surface twice as large in the world, with the map as often per length of it, has the same tilts."""
    small = scene_of(Cube(), TRIPLANAR)
    large = Scene(
        [Surface(Cube(), MIRROR, replace(TRIPLANAR, amplitude=0.12), Transform(scale=2))],
        NORMAL,
        replace(CAMERA, eye=tuple(2 * np.array(CAMERA.eye))),
    )
    a, b = (renderer.render(scene, (64, 64), ONE).pixels for scene in (small, large))
    assert np.abs(a - b).max() < 1e-4


def test_far_from_the_origin(renderer: Renderer) -> None:
    """Coordinates of 1e6 lose no digits of the place on the map."""
    corners = np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], float)
    bump = replace(TRIPLANAR, repeat=(0.5, 0.5))
    looks = []
    for at in (0.0, 1e6):
        quad = Quad(tuple(map(tuple, corners + at * np.array([1, 1, 0]))))  # type: ignore[arg-type]
        camera = Camera(eye=(at + 0.3, at + 0.2, 4), target=(at, at, 0), fov=30)
        looks.append(renderer.render(Scene([Surface(quad, MIRROR, bump)], NORMAL, camera), (64, 64), ONE).pixels)
    assert np.abs(looks[0] - looks[1]).max() < 1e-3


def test_only_what_needs_uv_asks_for_it(renderer: Renderer, tmp_path: Path) -> None:
    mesh = MeshFile(octahedron(tmp_path))
    for bump in (
        Bump(WAVES, 0.1),
        NormalMap(np.full((4, 4, 3), (0.5, 0.5, 1.0), np.float32)),
        [TRIPLANAR, Bump(WAVES, 1)],
    ):
        with pytest.raises(SceneError, match=r'no texture coordinates.*mapping = "triplanar"'):
            renderer.render(scene_of(mesh, bump), (16, 16))
    with pytest.raises(SceneError, match=r'bump\.scaling "parameter" is in units of u and v'):
        Bump(WAVES, 1, mapping="triplanar", scaling="parameter")
    plan = renderer.plan(scene_of(mesh, TRIPLANAR), (16, 16))
    assert any("triplanar" in choice.value for choice in plan.choices)
    assert plan.surfaces[0].has("HAS_UV") == 0


def test_shares_and_gradients() -> None:
    """One map alone along an axis, two alike between two axes; a gradient along the normal is none."""
    assert triplanar_shares([0.0, -1.0, 0.0]).tolist() == [0, 1, 0]
    assert triplanar_shares(np.array([1, 0, 1]) / np.sqrt(2)) == pytest.approx([0.5, 0, 0.5])
    turned = np.radians([30.0, 60.0])
    n = np.stack([np.cos(turned), np.sin(turned), 0 * turned], axis=-1)
    assert triplanar_shares(n).max() > 0.98
    assert volume_gradient([0.0, 0, 1], [0.3, -0.2, 5]).tolist() == [0.3, -0.2, 0]


def test_what_shares_leave_out_is_known(renderer: Renderer) -> None:
    """On the screen heights differ with their shares; the gradient in space takes those as constant, and the plan says
    by how much that is off."""
    fine = Quality("exact", samples=1, bump_kernel="bspline", bump_read="shader")
    off, told = {}, {}
    for amplitude in (0.0, 0.01, 0.04):
        size = 512
        # Two maps meet in the middle of the picture, where they differ by almost all of the height.
        bump = replace(TRIPLANAR, amplitude=amplitude or 1e-30, repeat=(0.3, 0.4))
        camera = Camera(eye=(2, 0, 2), target=(0, 0, 0), fov=20)
        scene = Scene([Surface(Sphere(), MIRROR, bump)], NORMAL, camera)
        want = normals(renderer.render(scene, (size, size), replace(fine, bump_read="screen")))
        got = normals(renderer.render(scene, (size, size), fine))
        off[amplitude] = float(np.percentile(degrees_between(got, want)[64:-64, 64:-64], 99))
        said = {c.what: c.why for c in renderer.plan(scene, (size, size), fine).choices}["surface 0 bump shares"]
        told[amplitude] = float(said.split()[4])
    assert off[0.0] < 0.02
    for amplitude in (0.01, 0.04):
        assert 0.2 * told[amplitude] < off[amplitude] < told[amplitude]


def test_shares_change_by_so_much_at_most() -> None:
    """Along the sphere, in steps of 1e-5 radians, of one of the maps or, its negative, of the two others."""
    n = np.random.default_rng(1).normal(size=(100_000, 3))
    n /= np.linalg.norm(n, axis=-1, keepdims=True)
    across = np.cross(n, [0.3, 0.5, 0.7])
    across /= np.linalg.norm(across, axis=-1, keepdims=True)
    changes = [
        (triplanar_shares(n + 1e-5 * d) - triplanar_shares(n - 1e-5 * d)) / 2e-5 for d in (across, np.cross(n, across))
    ]
    assert 0.99 * MOST_MIXING < np.hypot(*changes).max() < MOST_MIXING


@pytest.mark.parametrize("bump", [TRIPLANAR, Bump(WAVES, 0.06, repeat=(3, 2))], ids=["triplanar", "uv"])
def test_from_pixel_to_pixel_the_error_is_a_pixels(renderer: Renderer, bump: Bump) -> None:
    """One-sided differences are off by as much as the pixel is large. Of smooth heights, so that it is that error
    which is seen."""

    def error(size: int) -> float:
        fine = Quality("exact", samples=1, bump_kernel="bspline", bump_read="shader", bump_terms="small")
        scene = scene_of(Sphere(1.1), bump)
        want = normals(renderer.render(scene, (size, size), fine))
        got = renderer.render(scene, (size, size), replace(fine, bump_read="screen"))
        inside = np.hypot(*(np.mgrid[0:size, 0:size] - size / 2)) < 0.3 * size
        return float(np.median(degrees_between(normals(got), want)[inside]))

    errors = [error(size) for size in (64, 128, 256)]
    assert 0.1 < errors[1] < 3
    assert errors[0] / errors[1] == pytest.approx(2, rel=0.2)
    assert errors[1] / errors[2] == pytest.approx(2, rel=0.2)
