"""Light that goes through: one refraction at the surface, and Fresnel's share of what is mirrored."""

from __future__ import annotations

import numpy as np
import pytest

from glbump import reference
from glbump.camera import Camera
from glbump.environment import LatLong
from glbump.gl.renderer import Renderer
from glbump.maps.layout import LATLONG, texel_dirs
from glbump.quality import Quality
from glbump.scene import Bump, Material, Scene, Surface
from glbump.shapes import Plane, Sphere, Torus, Transform

WHITE = LatLong(np.ones((8, 16, 3), np.float32))
COMPASS = LatLong((0.5 + 0.5 * texel_dirs(LATLONG, (128, 64))[0]).astype(np.float32))
WAVES = (0.5 + 0.5 * np.sin(np.linspace(0, 4 * np.pi, 32, endpoint=False))).astype(np.float32) * np.ones((32, 1), "f4")
GLASS = Material(roughness=0, transmission=1)


@pytest.mark.parametrize("roughness", [0, 0.4])
@pytest.mark.parametrize("transmission", [0.0, 0.3, 1.0])
@pytest.mark.parametrize("metallic", [0, 0.5])
def test_white_furnace(renderer: Renderer, metallic: float, transmission: float, roughness: float) -> None:
    """In white light all that is not absorbed is white: nothing is lost or made at any angle, inside or outside."""
    material = Material(metallic=metallic, transmission=transmission, roughness=roughness)
    quality = Quality("exact", gloss_size=8, gloss_samples=4)
    for eye in ((0, 0, 4), (0.3, 0, 0.2)):
        scene = Scene([Surface(Sphere(), material)], WHITE, Camera(eye=eye, target=(0, 0, -3)))
        pixels = renderer.render(scene, (32, 32), quality).pixels[..., :3]
        # Sums of shares of 1, a few roundings each; irradiance by quadrature loses h^2 / 12 of its cells' width h.
        assert np.abs(pixels - 1).max() < 1e-5 + (2 / 32) ** 2 / 12


def test_a_flat_pane_bends_light_as_snell_says(renderer: Renderer) -> None:
    """From above, one sees through a plane towards a direction whose sine is the ior-th part."""
    camera = Camera(eye=(0, 2, 2), target=(0, 0, 0), fov=20)
    for ior in (1.0, 1.33, 2.0):
        pane = Surface(Plane((4, 4)), Material(roughness=0, transmission=1, ior=ior))
        pixels = renderer.render(Scene([pane], COMPASS, camera), (65, 65), "exact").pixels[32, 32, :3]
        sine = np.sqrt(0.5) / ior
        down = np.array([0, -np.sqrt(1 - sine**2), -sine])
        mirrored = np.array([0, np.sqrt(0.5), -np.sqrt(0.5)])
        # Fresnel at 45 degrees, by Snell's two angles.
        i, t = np.pi / 4, np.arcsin(sine)
        share = (
            0.0
            if ior == 1
            else (np.sin(i - t) ** 2 / np.sin(i + t) ** 2 * (1 + np.cos(i + t) ** 2 / np.cos(i - t) ** 2)) / 2
        )
        want = 0.5 + 0.5 * (share * mirrored + (1 - share) * down)
        # The compass is read bilinearly from texels 0.05 radians wide: their chord leaves 0.05^2 / 8 of it.
        assert pixels == pytest.approx(want, abs=1e-3)


def test_from_inside_all_is_mirrored_past_the_critical_angle(renderer: Renderer) -> None:
    """In a flat pool seen from below, Snell's window: outside of 48.6 degrees the bottom is mirrored."""
    camera = Camera(eye=(0, -1, 0), target=(0, 0, -0.001), fov=140)
    pool = Surface(Plane((100, 100)), Material(roughness=0, transmission=1, ior=1.33))
    looks = 2 * renderer.render(Scene([pool], COMPASS, camera), (129, 129), "exact").pixels[..., :3] - 1
    column, centre = looks[:, 64], 64
    # Height of what is seen, by the angle from the vertical.
    angle = np.arctan(np.abs(np.arange(129) - centre) / 64.5 * np.tan(np.radians(70)))
    critical = np.arcsin(1 / 1.33)
    assert (column[angle < critical - 0.1, 1] > 0.2).all()
    assert (column[angle > critical + 0.03, 1] < -0.2).all()


@pytest.mark.parametrize("eye", [(0, 1, 4), (0.2, 0.1, 0.5)], ids=["outside", "inside"])
@pytest.mark.parametrize("roughness", [0, 0.3])
def test_glass_is_the_reference(renderer: Renderer, roughness: float, eye: tuple[float, float, float]) -> None:
    material = Material(base_color=(0.9, 0.6, 0.3), metallic=0.2, roughness=roughness, transmission=0.7, ior=1.4)
    quality = Quality("exact", gloss_size=32, gloss_samples=16)
    bumps = Bump(WAVES, amplitude=0.05, repeat=(4, 2))
    surfaces = [
        Surface(Sphere(), material, bumps),
        Surface(Torus(), material, transform=Transform(translate=(0, -1, -2), rotate=(60, 0, 0))),
    ]
    scene = Scene(surfaces, COMPASS, Camera(eye=eye, target=(0, 0, -3)))
    got = renderer.render(scene, (48, 48), quality)
    want = reference.render(scene, (48, 48), 16, quality=quality)
    error = np.abs(got.pixels - want.pixels)
    assert error.mean() < 2e-4
    assert np.percentile(error, 98) < 2e-3
    # Air in place of glass is another picture.
    air = Scene([Surface(Sphere(), Material(roughness=roughness, transmission=1, ior=1), bumps)], COMPASS, scene.camera)
    assert np.abs(renderer.render(air, (48, 48), quality).pixels - want.pixels).mean() > 0.01


def test_what_lets_no_light_through_costs_nothing(renderer: Renderer) -> None:
    def defines(**values: float) -> dict[str, int]:
        scene = Scene([Surface(Sphere(), Material(**values))], WHITE)  # type: ignore[arg-type]
        return dict(renderer.plan(scene, (64, 64), "exact").surfaces[0].defines)

    assert defines(roughness=0, transmission=1)["TRANSMISSION"] == 1
    assert defines(roughness=0, transmission=1)["DIFFUSE"] == 0
    assert defines(roughness=0, metallic=1, transmission=1)["TRANSMISSION"] == 0
    assert defines(roughness=0)["TRANSMISSION"] == 0
