"""Laws of whole pictures: what is where, what equals what, what vanishes into the background."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt
import pytest

from glbump import reference
from glbump.camera import Camera
from glbump.environment import CubeMap, LatLong
from glbump.gl.renderer import Renderer
from glbump.maps.layout import LATLONG, texel_dirs
from glbump.scene import Bump, Material, NormalMap, Scene, Surface
from glbump.shapes import Cube, Plane, Quad, Sphere, Torus, Transform

F32 = npt.NDArray[np.float32]
MIRROR = Material(metallic=1, roughness=0)
CHOICES = ("fast", "balanced", "exact")


# Radiance is the direction itself, as 1/2 + d/2: every pixel tells where it looked.
COMPASS = LatLong((0.5 + 0.5 * texel_dirs(LATLONG, (256, 128))[0]).astype(np.float32))
WAVES = (0.5 + 0.5 * np.sin(np.linspace(0, 4 * np.pi, 64, endpoint=False))).astype(np.float32) * np.ones((64, 1), "f4")


def _looks(pixels: F32) -> F32:
    return 2 * pixels[..., :3] - 1


@pytest.mark.parametrize("quality", CHOICES)
def test_the_default_camera_looks_along_minus_z_with_x_to_the_right(renderer: Renderer, quality: str) -> None:
    # An even number of pixels: the middle one looks half a pixel right and down.
    looks = _looks(renderer.render(Scene([], COMPASS), (64, 64), quality).pixels)
    assert looks[32, 32] == pytest.approx([0, 0, -1], abs=0.02)
    assert looks[32, 63, 0] > 0.3 > -0.3 > looks[32, 0, 0]
    assert looks[0, 32, 1] > 0.3 > -0.3 > looks[63, 32, 1]


@pytest.mark.parametrize("quality", CHOICES)
def test_rotation_turns_the_picture_counter_clockwise_seen_from_above(renderer: Renderer, quality: str) -> None:
    # What lay at -Z comes to lie towards -X: looking at -X one sees what the picture has at its centre.
    scene = Scene([], replace(COMPASS, rotation=90), Camera(eye=(0, 0, 0), target=(-1, 0, 0)))
    looks = _looks(renderer.render(scene, (64, 64), quality).pixels)
    assert looks[32, 32] == pytest.approx([0, 0, -1], abs=0.02)


@pytest.mark.parametrize("quality", CHOICES)
def test_a_mirror_ball_shows_what_is_behind_the_eye(renderer: Renderer, quality: str) -> None:
    looks = _looks(renderer.render(Scene([Surface(Sphere(), MIRROR)], COMPASS), (128, 128), quality).pixels)
    assert looks[64, 64] == pytest.approx([0, 0, 1], abs=0.03)
    # Right of the middle it reflects what lies to the right, above it what lies above.
    assert looks[64, 84, 0] > 0.5
    assert looks[44, 64, 1] > 0.5


@pytest.mark.parametrize(
    ("transform", "camera"),
    [
        (Transform(), Camera()),
        (Transform(rotate=(20, 30, 40), scale=(1, -0.4, 0.8)), Camera(eye=(1.5, 1.5, 2))),
        (Transform(translate=(0.4, 0, 0), scale=0.3), Camera(projection="orthographic")),
        (Transform(), Camera(eye=(0.9, 0.2, 1.05), target=(3, 0, 0), fov=120)),  # partly behind the eye
    ],
)
def test_a_ball_drawn_as_its_outline_is_the_ball_drawn_as_its_mesh(
    renderer: Renderer, transform: Transform, camera: Camera
) -> None:
    ball = Surface(Sphere(), MIRROR, Bump(WAVES, amplitude=0.02, repeat=(4, 2)), transform)
    hidden = Surface(Plane((0.1, 0.1)), MIRROR, transform=transform)
    outlined, meshed = Scene([ball], COMPASS, camera), Scene([ball, hidden], COMPASS, camera)
    assert [renderer.plan(s).surfaces[0].has("OUTLINE") for s in (outlined, meshed)] == [1, 0]
    a, b = (renderer.render(s, (128, 128), "exact").pixels for s in (outlined, meshed))
    difference = np.abs(a - b).max(axis=-1)
    # The two polygons differ by 0.02 pixels along the outline; inside, the same point is found from another start:
    # float32's error in it, times the bump's bending of the normal.
    assert np.percentile(difference, 95) < 1e-5
    assert np.count_nonzero(difference > 1e-3) < 0.005 * difference.size


def test_the_normal_can_be_looked_up_instead(renderer: Renderer) -> None:
    scene = Scene([Surface(Sphere(), MIRROR)], replace(COMPASS, lookup="normal"), Camera(projection="orthographic"))
    looks = _looks(renderer.render(scene, (90, 90), "exact").pixels)
    # 30 pixels to the unit: the normal at x = 15 pixels is 1/2 there.
    x, y = (np.arange(90) - 44.5) / 30, (44.5 - np.arange(90)) / 30
    normal = np.stack(np.broadcast_arrays(x[None], y[:, None], np.sqrt(np.maximum(1 - x**2 - y[:, None] ** 2, 0))), -1)
    inner = x[None] ** 2 + y[:, None] ** 2 < 0.8
    # A pixel's mean of a curved function: second order in its size, and the table is 128 rows high.
    assert np.abs(looks - normal)[inner].max() < 2e-3


@pytest.mark.parametrize("quality", CHOICES)
@pytest.mark.parametrize("look", [(0, 0, 1), (0.3, 1, 0.01), (0, -1, 1e-3)])
def test_no_line_at_the_seam_nor_at_the_poles(
    renderer: Renderer, quality: str, look: tuple[float, float, float]
) -> None:
    # +Z is the seam of the picture, +-Y its poles. The background must be as smooth there as anywhere.
    scene = Scene([], COMPASS, Camera(eye=(0, 0, 0), target=look, up=(0.1, 0.2, 1), fov=60))
    got = renderer.render(scene, (96, 96), quality).pixels[..., :3]
    want = reference.render(scene, (96, 96), 16).pixels[..., :3]
    # Half-float textures keep 2^-12 of a value below 1, mip levels blur a gradient of 1/40 a pixel by little.
    assert np.abs(got - want).max() < (1e-5 if quality == "exact" else 4e-3)


def test_the_seam_test_sees_a_line() -> None:
    # The last column doubled, as files with samples on the border are when their header is not obeyed.
    doubled = COMPASS.image.pixels.copy()  # type: ignore[union-attr]
    doubled[:, -1] = doubled[:, -8]
    scene = Scene([], LatLong(doubled), Camera(eye=(0, 0, 0), target=(0, 0, 1), fov=60))
    whole = reference.render(replace(scene, environment=COMPASS), (96, 96), 4).pixels
    assert np.abs(reference.render(scene, (96, 96), 4).pixels - whole).max() > 4e-3


# ------------------------------------------------------------------ white furnace

MATERIALS = [
    Material((1, 1, 1), metallic, roughness, ior)
    for metallic in (0, 0.5, 1)
    for roughness in (0, 0.15, 0.6, 1)
    for ior in (1, 1.5, 3)
]
SHAPES = [Sphere(), Torus(), Cube(), Plane()]


@pytest.mark.parametrize("environment", ["lat-long", "cube"])
@pytest.mark.parametrize("quality", CHOICES)
def test_base_colour_1_vanishes_in_a_constant_environment(renderer: Renderer, quality: str, environment: str) -> None:
    grey = np.full((8, 16, 3), 0.5, np.float32) if environment == "lat-long" else np.full((6, 8, 8, 3), 0.5, "f4")
    where = LatLong(grey) if environment == "lat-long" else CubeMap(grey)
    for i, material in enumerate(MATERIALS):
        bump = (None, Bump(WAVES, amplitude=0.05, repeat=3))[i % 2]
        surface = Surface(SHAPES[i % 4], material, bump, Transform(rotate=(30 + i, 20, 0)))
        frame = renderer.render(Scene([surface], where), (20, 20), quality)
        # Half floats keep 2^-11 of a value, and several operations add up; SH9's constants are float32.
        assert np.abs(frame.pixels[..., :3] - 0.5).max() < 1e-3, material
        assert np.all(frame.pixels[..., 3] == 1)


def test_a_darker_colour_is_seen_in_the_furnace(renderer: Renderer) -> None:
    grey = LatLong(np.full((8, 16, 3), 0.5, np.float32))
    frame = renderer.render(Scene([Surface(Sphere(), Material((0.98, 1, 1)))], grey), (48, 48))
    assert frame.pixels[..., 0].min() < 0.5 - 5e-3


# ------------------------------------------------------------------ neutral elements, transforms, coverage


def test_a_flat_bump_changes_no_pixel(renderer: Renderer) -> None:
    plain = Scene([Surface(Sphere(), MIRROR)], COMPASS)
    flat = Scene([Surface(Sphere(), MIRROR, Bump(np.full((4, 4), 0.3, np.float32), amplitude=5))], COMPASS)
    a, b = (renderer.render(scene, (64, 64), "exact").pixels for scene in (plain, flat))
    assert np.abs(a - b).max() < 1e-6


def test_a_height_in_world_units_ignores_the_pictures_size_and_repeats(renderer: Renderer) -> None:
    # One wave of 4 along u; the picture holds 1, 2 or 4 of them, at 64 or 256 pixels.
    def picture(waves: int, width: int) -> F32:
        u = (np.arange(width) + 0.5) / width
        return (0.5 + 0.5 * np.sin(2 * np.pi * waves * u)).astype(np.float32) * np.ones((8, 1), np.float32)

    frames = []
    for waves, width in ((1, 64), (2, 128), (4, 256), (1, 256), (4, 1024)):
        bump = Bump(picture(waves, width), amplitude=0.02, repeat=(4 / waves, 1))
        scene = Scene([Surface(Quad(), MIRROR, bump)], COMPASS)
        frames.append(renderer.render(scene, (64, 64), "exact").pixels)
    # Central differences at 64 samples a wave are 0.16 % short in slope (sinc(2 pi / 64)).
    assert all(np.abs(f - frames[0]).max() < 2e-3 for f in frames[1:])
    flat = renderer.render(Scene([Surface(Quad(), MIRROR)], COMPASS), (64, 64), "exact").pixels
    assert np.abs(flat - frames[0]).max() > 0.05


def test_scaling_scene_and_heights_together_changes_nothing(renderer: Renderer) -> None:
    def frame(k: float) -> F32:
        bump = Bump(WAVES, amplitude=0.05 * k, repeat=3)
        surface = Surface(Torus(), MIRROR, bump, Transform(rotate=(40, 0, 10), scale=k, translate=(0.1 * k, 0, 0)))
        return renderer.render(Scene([surface], COMPASS, Camera(eye=(0, 0, 4 * k))), (64, 64), "exact").pixels

    one = frame(1)
    for k in (1e-6, 1e-3, 1e3, 1e6):
        assert np.abs(frame(k) - one).max() < 2e-3, k


def test_far_from_the_origin_is_as_good_as_near(renderer: Renderer) -> None:
    def frame(at: float) -> F32:
        surface = Surface(Sphere(), MIRROR, transform=Transform(translate=(at, 0, 0)))
        return renderer.render(Scene([surface], COMPASS, Camera(eye=(at, 0, 4), target=(at, 0, 0))), (64, 64)).pixels

    assert np.abs(frame(2.0**23) - frame(0)).max() < 1e-3


@pytest.mark.parametrize("scale", [(-1, 1, 1), (1, 1, -1), (-1, -1, -1), (1, -2, 1)])
def test_mirrored_surfaces_agree_with_the_reference(renderer: Renderer, scale: tuple[float, float, float]) -> None:
    surface = Surface(
        Torus(), MIRROR, Bump(WAVES, amplitude=0.03, repeat=(6, 2)), Transform(rotate=(50, 20, 0), scale=scale)
    )
    scene = Scene([surface], COMPASS)
    got, want = renderer.render(scene, (64, 64), "exact").pixels, reference.render(scene, (64, 64), 16).pixels
    assert np.percentile(np.abs(got - want), 98) < 1e-3


def test_the_back_of_a_bumped_plane_is_the_other_side_of_the_same_bumps(renderer: Renderer) -> None:
    for eye in ((0.5, 2, 3), (0.5, -2, 3)):
        scene = Scene([Surface(Plane(), MIRROR, Bump(WAVES, amplitude=0.05, repeat=2))], COMPASS, Camera(eye=eye))
        got, want = renderer.render(scene, (64, 64), "exact").pixels, reference.render(scene, (64, 64), 16).pixels
        assert np.percentile(np.abs(got - want), 98) < 1e-3


def test_alpha_is_the_share_of_the_pixel_that_surfaces_cover(renderer: Renderer) -> None:
    # A square of 20.5 x 20.5 pixels: 20 whole columns, half a column on one side.
    side = 20.5 / 32
    quad = Quad(((0, 0, 0), (side, 0, 0), (side, side, 0), (0, side, 0)))
    camera = Camera(projection="orthographic", height=2)
    scene = Scene([Surface(quad, MIRROR)], replace(COMPASS, background=False), camera)
    pixels = renderer.render(scene, (64, 64), "exact").pixels
    assert pixels[..., 3].sum() == pytest.approx(20.5**2, rel=1e-3)
    # Straight alpha: where there is any coverage the colour is the surface's own.
    covered = pixels[..., 3] > 0
    assert np.abs(pixels[covered][:, :3] - pixels[25, 40, :3]).max() < 1e-3
    assert not pixels[~covered].any()


def test_exposure_multiplies_all_light(renderer: Renderer) -> None:
    for material in (MIRROR, Material(), Material(roughness=0)):
        scene = Scene([Surface(Sphere(), material)], COMPASS)
        plain = renderer.render(scene, (48, 48), "exact").pixels
        lifted = renderer.render(replace(scene, environment=replace(COMPASS, exposure=2)), (48, 48), "exact").pixels
        assert lifted[..., :3] == pytest.approx(4 * plain[..., :3], rel=1e-5)


def test_the_nearer_surface_hides_the_farther_in_any_order(renderer: Renderer) -> None:
    near = Surface(Sphere(0.5), MIRROR, transform=Transform(translate=(0.2, 0, 1)))
    far = Surface(Cube(), Material((1, 0.2, 0.1), 1, 0))
    a, b = (renderer.render(Scene(s, COMPASS), (64, 64), "exact").pixels for s in ([near, far], [far, near]))
    assert np.array_equal(a, b)
    want = reference.render(Scene([near, far], COMPASS), (64, 64), 16).pixels
    assert np.percentile(np.abs(a - want), 97) < 1e-3


def test_normal_maps_have_green_up_unless_told(renderer: Renderer) -> None:
    # Normals lean towards +v. On a wall seen from +Z the reflection then goes up.
    lean = np.broadcast_to(np.float32([0.0, 0.2, np.sqrt(0.96)]), (4, 4, 3)).copy()

    def up(flip_y: bool) -> float:
        scene = Scene([Surface(Quad(), MIRROR, NormalMap(lean, flip_y=flip_y))], COMPASS)
        return float(_looks(renderer.render(scene, (33, 33), "exact").pixels)[16, 16, 1])

    # Twice the angle of the normal.
    assert up(False) == pytest.approx(np.sin(2 * np.arcsin(0.2)), abs=2e-3)
    assert up(True) == pytest.approx(-np.sin(2 * np.arcsin(0.2)), abs=2e-3)


def test_heights_rise_towards_the_eye(renderer: Renderer) -> None:
    # A ramp rising to the right leans the normal to the left; its jump back at the border is out of sight.
    ramp = np.broadcast_to(np.linspace(0, 1, 256, dtype=np.float32), (4, 256)).copy()
    scene = Scene([Surface(Quad(), MIRROR, Bump(ramp, amplitude=0.2))], COMPASS)
    looks = _looks(renderer.render(scene, (33, 33), "exact").pixels)
    # Slope 0.2 over 2 world units, times 256/255 for the picture's last step: the reflection turns by twice its angle.
    angle = 2 * np.arctan(0.1 * 256 / 255)
    assert looks[16, 16, 0] == pytest.approx(-np.sin(angle), abs=2e-3)


def test_bytes_mean_what_a_file_of_bytes_means(renderer: Renderer) -> None:
    grey = np.full((4, 8, 3), 188, np.uint8)  # sRGB 188 is linear 0.5
    pixels = renderer.render(Scene([], LatLong(grey)), (8, 8), "exact").pixels
    assert pixels[..., :3] == pytest.approx(0.5, abs=3e-3)
    heights = (255 * WAVES).round().astype(np.uint8)
    a, b = (
        renderer.render(Scene([Surface(Quad(), MIRROR, Bump(h, amplitude=0.02))], COMPASS), (32, 32), "exact").pixels
        for h in (heights, heights / np.float32(255))
    )
    assert np.array_equal(a, b)
