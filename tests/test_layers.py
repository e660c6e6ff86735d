"""Several bumps on one surface, how they are read, where their maps end, and which terms are kept."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from glbump import reference
from glbump.camera import Camera
from glbump.environment import LatLong
from glbump.errors import SceneError
from glbump.gl.renderer import Renderer
from glbump.maps.gradients import IN_SHADERS
from glbump.maps.layout import LATLONG, texel_dirs
from glbump.quality import KNOBS, Quality
from glbump.scene import MOST_BUMPS, Bump, Material, NormalMap, Scene, Surface
from glbump.shapes import Plane, Quad, Sphere, Torus, Transform

MIRROR = Material(metallic=1, roughness=0)
COMPASS = LatLong((0.5 + 0.5 * texel_dirs(LATLONG, (128, 64))[0]).astype(np.float32))
X, Y = np.meshgrid((np.arange(48) + 0.5) / 48, 1 - (np.arange(32) + 0.5) / 32)
WAVES = (0.5 + 0.25 * np.sin(2 * np.pi * X) + 0.25 * np.cos(2 * np.pi * (X + 2 * Y))).astype(np.float32)
FINE = (0.5 + 0.5 * np.sin(6 * np.pi * Y)).astype(np.float32)
SLANTED = np.stack([0.2 * np.sin(2 * np.pi * X), 0.1 * np.cos(2 * np.pi * Y), np.ones_like(X)], axis=-1)
NORMALS = (SLANTED / np.linalg.norm(SLANTED, axis=-1, keepdims=True) * 0.5 + 0.5).astype(np.float32)
ONE = Quality("exact", samples=1)
SHAPES: dict[str, Any] = {
    "sphere": Sphere(1),
    "torus": Torus(0.8, 0.3),
    "quad": Quad(((-1, -1, 0), (1, -1.2, 0), (0.9, 1, 0), (-0.8, 0.8, 0))),
    "plane": Plane((2, 1.5)),
}
CAMERA = Camera(eye=(0.5, 1.4, 2.6), target=(0, 0, 0))


def picture(renderer: Renderer, bump: Any, shape: Any = SHAPES["plane"], quality: Quality = ONE, **more: Any) -> Any:
    scene = Scene([Surface(shape, MIRROR, bump, **more)], COMPASS, CAMERA)
    return renderer.render(scene, (64, 64), quality).pixels[..., :3]


def agrees(renderer: Renderer, bump: Any, shape: Any, quality: Quality = ONE, **more: Any) -> bool:
    """Whether the GPU draws what the reference does: the compass in tenths of a grey level, outlines apart."""
    scene = Scene([Surface(shape, MIRROR, bump, **more)], COMPASS, CAMERA)
    got = renderer.render(scene, (64, 64), quality).pixels
    want = reference.render(scene, (64, 64), quality.samples, quality=quality).pixels
    error = np.abs(got - want)
    # Float32 coordinates and slopes: 1e-5 of a direction; where it bends most (the poles of u, v) some 100 times that.
    # In halves: 2^-11 of each of slopes, texels and frame.
    limit = 2e-3 if quality.texture_format == "half" else 1e-4
    return bool(np.percentile(error, 95) < limit and error.mean() < max(limit / 2, 2e-4))


@pytest.mark.parametrize("name", SHAPES)
def test_layers_are_the_reference_on_every_shape(renderer: Renderer, name: str) -> None:
    layers = [Bump(WAVES, 0.05, repeat=(3, 2)), NormalMap(NORMALS, repeat=(2, 1)), Bump(FINE, 0.01)]
    turned = Transform(rotate=(20, 30, 0), scale=(1.2, 0.8, 1))
    assert agrees(renderer, layers, SHAPES[name])
    assert agrees(renderer, layers, SHAPES[name], transform=turned)
    assert agrees(renderer, layers, SHAPES[name], Quality("balanced"))
    # Without one of them it is another picture.
    assert np.abs(picture(renderer, layers, SHAPES[name]) - picture(renderer, layers[:2], SHAPES[name])).max() > 0.02


def test_gradients_add_up(renderer: Renderer) -> None:
    """Two bumps are the bump of their sum, in whatever order; halves of one are the whole."""
    a, b = Bump(WAVES, 0.06), Bump(FINE, 0.02)
    together = Bump(3 * WAVES + FINE, 0.02)
    small = replace(ONE, bump_terms="small")
    want = picture(renderer, together, quality=small)
    # Sums of float32 slopes in another order.
    assert np.abs(picture(renderer, [a, b], quality=small) - want).max() < 2e-5
    assert np.abs(picture(renderer, [b, a], quality=small) - want).max() < 2e-5
    halves = [replace(together, amplitude=0.01)] * 2
    assert np.abs(picture(renderer, halves, quality=small) - want).max() < 2e-5
    assert np.abs(picture(renderer, [a, replace(b, amplitude=-0.02)], quality=small) - want).max() > 0.05


def test_one_that_does_nothing_is_left_out(renderer: Renderer) -> None:
    a = Bump(WAVES, 0.05)
    assert np.array_equal(
        picture(renderer, [a, replace(a, amplitude=0), NormalMap(NORMALS, scale=0)]), picture(renderer, a)
    )
    plan = renderer.plan(Scene([Surface(Plane(), MIRROR, [a, replace(a, amplitude=0)])], COMPASS), (64, 64))
    assert plan.surfaces[0].has("BUMP") == 1


def test_too_many_or_none_are_refused() -> None:
    for layers in ([], [Bump(WAVES, 1)] * (MOST_BUMPS + 1)):
        with pytest.raises(SceneError, match=r"surface\.bump must be one bump or 1 to 4 of them; got"):
            Surface(Plane(), bump=layers)
    with pytest.raises(SceneError, match=r"surface\.bump\[1\] must be one of Bump, NormalMap"):
        Surface(Plane(), bump=[Bump(WAVES, 1), "a.png"])  # type: ignore[list-item]


@pytest.mark.parametrize("kernel", KNOBS["bump_kernel"].values)
@pytest.mark.parametrize("read", ["baked", "shader"])
def test_kernels_are_the_reference(renderer: Renderer, kernel: str, read: str) -> None:
    quality = Quality("exact", samples=1, bump_kernel=kernel, bump_read=read)
    for shape in (Torus(0.8, 0.3), Plane((2, 1.5))):
        assert agrees(renderer, Bump(WAVES, 0.08, repeat=(2, 1)), shape, quality)
    layer = renderer.plan(Scene([Surface(Plane(), MIRROR, Bump(WAVES, 1))]), (64, 64), quality).surfaces[0].layers[0]
    assert (layer.kind == "heights") == (read == "shader" and kernel in IN_SHADERS)


def test_kernels_differ_as_they_should(renderer: Renderer) -> None:
    """Of short waves, against the exact slope: forward is worst, the spline best."""
    waves = (0.5 + 0.5 * np.sin(2 * np.pi * 6 * X)).astype(np.float32)
    bump = Bump(waves, 0.02)
    exact = picture(renderer, bump, quality=Quality("exact", samples=1, bump_kernel="spectral"))
    fine = np.repeat(0.5 + 0.5 * np.sin(2 * np.pi * 6 * (np.arange(960) + 0.5) / 960)[None, :], 32, axis=0)
    truth = picture(renderer, Bump(fine.astype(np.float32), 0.02), quality=Quality("exact", samples=1))

    def error(kernel: str, read: str = "shader") -> float:
        got = picture(renderer, bump, quality=Quality("exact", samples=1, bump_kernel=kernel, bump_read=read))
        return float(np.abs(got - truth).mean())

    assert error("bspline") < error("half") < error("central") < error("sobel") + 1e-6
    assert error("central") < error("forward")
    assert np.abs(exact - truth).mean() < error("central")


@pytest.mark.parametrize("border", ["wrap", "mirror", "clamp"])
def test_borders_are_the_reference(renderer: Renderer, border: str) -> None:
    bump = Bump(WAVES, 0.08, repeat=(2.5, 1.5), border=border)
    for shape in (Torus(0.8, 0.3), Plane((2, 1.5))):
        assert agrees(renderer, bump, shape)
        assert agrees(renderer, bump, shape, Quality("balanced"))
    assert agrees(renderer, bump, Plane((2, 1.5)), Quality("exact", samples=1, bump_read="shader", bump_kernel="half"))


def test_a_mirrored_map_has_no_seam_and_a_clamped_one_ends(renderer: Renderer) -> None:
    ramp = np.repeat(X[:1], 32, axis=0).astype(np.float32)
    plane = Plane((2, 2))
    camera = Camera(eye=(0, 3, 0.001), target=(0, 0, 0), fov=30)

    def looks(border: str) -> Any:
        bump = Bump(ramp, 0.2, repeat=(2, 2), border=border)
        scene = Scene([Surface(plane, MIRROR, bump)], COMPASS, camera)
        return renderer.render(scene, (64, 64), ONE).pixels[32, :, 0]

    # u from -1 to 1: the map covers the left half of each repeat; mirrored, the slope turns round in the right one.
    mirrored = looks("mirror") - 0.5
    assert mirrored[12:28].mean() == pytest.approx(-mirrored[36:52].mean(), abs=1e-3)
    assert abs(mirrored[12:28].mean()) > 0.05
    clamped = looks("clamp") - 0.5
    flat = picture(renderer, None, plane)
    assert abs(clamped[12:28].mean()) > 0.05
    # Beyond its edge the height stays: the mirror is flat, and looks straight up, as with no bump.
    assert np.abs(clamped[36:52]).max() < 0.5 * abs(clamped[12:28].mean())
    assert flat.shape == (64, 64, 3)


def test_in_units_of_uv_the_look_does_not_change_with_size(renderer: Renderer) -> None:
    """Blinn 1978: in world units wrinkles flatten as the object grows, by parameter they stay."""
    for shape in (Sphere(1), Torus(0.8, 0.3)):
        bump = Bump(WAVES, 0.05, repeat=(3, 2), scaling="parameter")
        small = picture(renderer, bump, shape)
        factor = 100.0
        scene = Scene(
            [Surface(shape, MIRROR, bump, transform=Transform(scale=factor))],
            COMPASS,
            Camera(eye=tuple(factor * np.array(CAMERA.eye)), target=(0, 0, 0)),
        )
        large = renderer.render(scene, (64, 64), ONE).pixels[..., :3]
        # Eyes and sizes of other float32 values: the last digits.
        assert np.percentile(np.abs(large - small), 99) < 1e-4
        world = replace(scene, surfaces=[replace(scene.surfaces[0], bump=replace(bump, scaling="world"))])
        assert np.abs(renderer.render(world, (64, 64), ONE).pixels[..., :3] - small).mean() > 0.01
        assert agrees(renderer, bump, shape)


@pytest.mark.parametrize("terms", ["small", "full"])
def test_terms_are_the_reference(renderer: Renderer, terms: str) -> None:
    quality = Quality("exact", samples=1, bump_terms=terms)
    bump = Bump(WAVES, 0.2, repeat=(3, 2))
    for shape in (Sphere(1), Torus(0.8, 0.3)):
        for transform in (Transform(), Transform(rotate=(0, 40, 10), scale=(1.3, 0.7, 1))):
            assert agrees(renderer, bump, shape, quality, transform=transform)
    other = Quality("exact", samples=1, bump_terms="full" if terms == "small" else "small")
    assert (
        np.abs(picture(renderer, bump, Sphere(1), quality) - picture(renderer, bump, Sphere(1), other)).mean() > 0.005
    )


def test_the_plan_keeps_terms_where_they_matter(renderer: Renderer) -> None:
    def full(amplitude: float, shape: Any, quality: str = "balanced") -> int:
        scene = Scene([Surface(shape, MIRROR, Bump(WAVES, amplitude))], COMPASS)
        return renderer.plan(scene, (64, 64), quality).surfaces[0].has("BUMP_FULL")

    assert full(0.5, Sphere(1)) == 1
    # 0.25 degrees are allowed: B times the slope, 1e-3 times 1e-2, is 6e-4.
    assert full(1e-3, Sphere(1)) == 0
    # Without curvature there is no such term, whatever the height.
    assert full(0.5, Plane()) == 0
    # "exact" allows nothing.
    assert full(1e-3, Sphere(1), "exact") == 1
    said = renderer.plan(Scene([Surface(Sphere(), MIRROR, Bump(WAVES, 0.5))], COMPASS), (64, 64), "balanced")
    assert any("degrees" in choice.why for choice in said.choices if choice.what == "surface 0 bump terms")


def test_no_bent_normal_looks_away_or_into_the_surface(renderer: Renderer) -> None:
    """At grazing angles steep bumps turn away from the eye, and send reflections under the floor: there it is black."""
    V, _ = np.mgrid[0:64, 0:128]
    above = LatLong(np.where((V < 32)[..., None], 1.0, 0.0).astype(np.float32) * np.ones(3, np.float32))
    floor = Surface(Plane((20, 20)), MIRROR, Bump(FINE, 0.8, repeat=(20, 20)))
    scene = Scene([floor], above, Camera(eye=(0, 0.5, 6), target=(0, 0, 0), fov=20))
    pixels = renderer.render(scene, (64, 64), ONE).pixels[40:, :, 0]
    # Bilinear across the horizon's step, half a texel: no darker than that.
    assert pixels.min() > 0.4
    assert (pixels > 0.99).mean() > 0.95
