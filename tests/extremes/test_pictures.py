"""The extremes of whole pictures (NUMERICS, section 5): laws that hold whatever the numbers.

In an environment of one colour a white mirror of any shape, bump and angle is that colour: nothing may show.
Moving and scaling a scene with its camera changes no pixel.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from glbump.camera import Camera
from glbump.environment import CubeMap, LatLong
from glbump.errors import ImageError, LimitError, SceneError
from glbump.gl.context import Context
from glbump.gl.renderer import Renderer
from glbump.gl.stability import MIRROR, even, smooth
from glbump.scene import Bump, Material, NormalMap, Scene, Surface
from glbump.shapes import Plane, Quad, Sphere, Torus, Transform

SIZE = (48, 48)
GREY = even(0.5)
CHOICES = ("fast", "balanced", "exact")
# A mirror takes the environment's colour as it is stored: half floats hold 0.5; sums of samples round some times.
FURNACE = 2.0**-9


def heights(n: int = 32) -> np.ndarray:
    wave = 0.5 + 0.5 * np.sin(np.linspace(0, 4 * np.pi, n, endpoint=False))
    return (wave[:, None] * wave[None, :]).astype(np.float32)


def drawn(renderer: Renderer, scene: Scene, quality: str = "balanced") -> np.ndarray:
    pixels = renderer.render(scene, SIZE, quality).pixels
    assert np.isfinite(pixels).all()
    return pixels


@pytest.mark.parametrize("quality", CHOICES)
@pytest.mark.parametrize(
    ("shape", "bump"),
    [
        (Sphere(), Bump(heights(), amplitude=1e-12)),
        (Sphere(), Bump(heights(), amplitude=10.0)),
        (Torus(), Bump(heights(), amplitude=0.05, repeat=(1e5, 1e5))),
        (Plane(), Bump(heights(), amplitude=1e-6, repeat=(1e6, 1e6))),
        (Plane(), NormalMap(np.broadcast_to(np.float32([-1.0, 0.0, 0.01]), (4, 4, 3)).copy())),
        (Plane(), Bump(heights(1), amplitude=1.0)),
    ],
    ids=["tiny-slope", "steep", "1e5-repeats", "1e6-repeats", "slope-of-100", "1x1"],
)
def test_no_bump_shows_in_one_colour(renderer: Renderer, quality: str, shape: object, bump: object) -> None:
    scene = Scene([Surface(shape, MIRROR, bump)], GREY, Camera(eye=(0.3, 1.5, 2.5)))  # type: ignore[arg-type]
    assert np.abs(drawn(renderer, scene, quality)[..., :3] - 0.5).max() < FURNACE


@pytest.mark.parametrize("roughness", [0.0, 1e-4, 1e-3, 0.5, 1.0])
@pytest.mark.parametrize("metallic", [0.0, 1.0])
def test_roughness_from_0_to_1_loses_no_light(renderer: Renderer, roughness: float, metallic: float) -> None:
    material = Material(metallic=metallic, roughness=roughness)
    scene = Scene([Surface(Sphere(), material)], GREY)
    assert np.abs(drawn(renderer, scene)[..., :3] - 0.5).max() < 2 * FURNACE


def test_the_least_roughness_is_nearly_a_mirror(renderer: Renderer) -> None:
    """No jump between the mirror's path and the first levels of the chain."""
    still = replace(smooth(), background=False)
    mirror, glossy = (
        drawn(renderer, Scene([Surface(Sphere(), Material(metallic=1, roughness=r))], still)) for r in (0.0, 1e-3)
    )
    inside = mirror[..., 3] == 1
    # The chain's first level is a cube of 256 texels a side or fewer: a change of 1/100 across a texel here.
    assert np.abs(mirror - glossy)[inside].max() < 0.02


@pytest.mark.parametrize("angle", [89.0, 89.9, 89.99])
def test_grazing_views(renderer: Renderer, angle: float) -> None:
    """Fresnel, glossy share and the bend of normals away from the eye: all light comes back, none is made."""
    a = np.radians(angle)
    camera = Camera(eye=(0, 3 * np.cos(a), 3 * np.sin(a)))
    for material in (MIRROR, Material(metallic=0, roughness=0), Material(metallic=0.5, roughness=0.4)):
        scene = Scene([Surface(Plane((8, 8)), material, Bump(heights(), amplitude=0.05))], GREY, camera)
        assert np.abs(drawn(renderer, scene)[..., :3] - 0.5).max() < 2 * FURNACE


@pytest.mark.parametrize("scale", [1e-6, 1e-3, 1e3, 1e6])
def test_scaling_the_world_changes_nothing(renderer: Renderer, scale: float) -> None:
    """Near and far planes follow the scene: no depth is lost from 1e-6 to 1e6."""
    camera = Camera(eye=(1, 1.5, 3))
    far = replace(camera, eye=tuple(scale * x for x in camera.eye))
    bump = Bump(heights(), amplitude=0.05, repeat=(3, 2))

    def scene(size: float, view: Camera) -> Scene:
        ball = Surface(Sphere(), MIRROR, replace(bump, amplitude=0.05 * size), Transform(scale=size))
        floor = Surface(Plane((4, 4)), Material(roughness=0.5), transform=Transform((0, -0.5 * size, 0), scale=size))
        return Scene([ball, floor], smooth(), view)

    plain, scaled = drawn(renderer, scene(1.0, camera)), drawn(renderer, scene(scale, far))
    assert np.mean(np.abs(plain - scaled).max(axis=-1) > 0.01) < 0.01  # edges of triangles may round to either side


@pytest.mark.parametrize("away", [1e4, 1e6, 1e7])
def test_moving_the_world_changes_nothing(renderer: Renderer, away: float) -> None:
    """In world coordinates float32 would step by 1 at 1e7; the eye is the origin, in float64."""

    def scene(offset: float) -> Scene:
        ball = Surface(
            Sphere(), MIRROR, Bump(heights(), amplitude=0.05, repeat=(3, 2)), Transform((offset, 0, -offset))
        )
        return Scene([ball], smooth(), Camera(eye=(offset, 0.5, 4 - offset), target=(offset, 0, -offset)))

    here, there = drawn(renderer, scene(0.0)), drawn(renderer, scene(away))
    assert np.mean(np.abs(here - there).max(axis=-1) > 0.01) < 0.01


@pytest.mark.parametrize("quality", CHOICES)
def test_small_heights_with_a_large_amplitude_are_the_same_bump(renderer: Renderer, quality: str) -> None:
    """Heights of 1e-9 and 1e-30 of the range: what a half float cannot hold must not be lost."""
    pictures = []
    for share in (1.0, 1e-9, 1e-30):
        bump = Bump(heights() * np.float32(share), amplitude=0.05 / share, repeat=(4, 2))
        pictures.append(drawn(renderer, Scene([Surface(Sphere(), MIRROR, bump)], smooth()), quality))
    for other in pictures[1:]:
        assert np.abs(pictures[0] - other).max() < 0.01


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_heights_that_are_no_numbers_are_refused(renderer: Renderer, bad: float) -> None:
    """One NaN would poison the whole of the smallest level."""
    picture = heights()
    picture[3, 5] = bad
    with pytest.raises(ImageError, match=r"1 of 1024 .*not finite"):
        renderer.render(Scene([Surface(Sphere(), MIRROR, Bump(picture, amplitude=0.1))], GREY), SIZE)


@pytest.mark.parametrize("quality", CHOICES)
def test_a_sun_of_1e9(renderer: Renderer, quality: str) -> None:
    """In the mirror it is as bright as it is; beside it nothing is NaN, infinite or negative."""
    picture = np.ones((32, 64, 3), np.float32)
    picture[16, 32] = 1e9
    scene = Scene([Surface(Sphere(), MIRROR)], LatLong(picture, rotation=180), Camera(eye=(0, 0, 3)))
    pixels = drawn(renderer, scene, quality)
    assert pixels[..., :3].max() > 1e7
    assert pixels.min() >= 0
    matte = Scene([Surface(Sphere(), Material(roughness=1))], scene.environment)
    assert drawn(renderer, matte, quality).min() >= 0


def test_an_environment_of_one_texel_to_a_face(renderer: Renderer) -> None:
    faces = np.full((6, 1, 1, 3), 0.25, np.float32)
    scene = Scene([Surface(Sphere(), MIRROR)], CubeMap(faces))
    assert np.abs(drawn(renderer, scene)[..., :3] - 0.25).max() < FURNACE


def test_the_largest_picture_and_one_past_it(renderer: Renderer, context: Context) -> None:
    """A strip as long as the driver takes; its last texel is there. One more is refused before it is tried."""
    most = context.info["max_texture_size"]
    strip = np.zeros((2, most), np.float32)
    strip[:, -1] = 1.0
    quad = Surface(Quad(), MIRROR, Bump(strip, amplitude=1e-4))
    renderer.render(Scene([quad], GREY), SIZE)
    wide = Surface(Quad(), MIRROR, Bump(np.zeros((1, most + 1), np.float32), amplitude=1e-4))
    with pytest.raises((LimitError, ImageError), match=rf"{most}"):
        renderer.render(Scene([wide], GREY), SIZE)


def test_normals_that_point_nowhere_are_refused(renderer: Renderer, tmp_path: Path) -> None:
    zero = np.full((8, 8, 3), 0.5, np.float32)
    with pytest.raises(ImageError):
        renderer.render(Scene([Surface(Plane(), MIRROR, NormalMap(zero))], GREY), SIZE)


def test_a_camera_at_its_own_target_is_refused() -> None:
    with pytest.raises(SceneError):
        Camera(eye=(1, 2, 3), target=(1, 2, 3))
