"""Light, maps and formats at their extremes: suns and dim skies, pictures of every size, roughness, steep bumps."""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest

from glbump import reference
from glbump.camera import Camera
from glbump.contents import BRIGHTEST
from glbump.environment import CubeMap, LatLong
from glbump.errors import ImageError, LimitError
from glbump.gl.renderer import Renderer
from glbump.gl.stability import MIRROR, SHARP, SIZE, even, smooth, waves
from glbump.glsltest import Glsl, Sampler, inputs
from glbump.maps.encodings import HALF_MAX
from glbump.maps.layout import CUBE, EnvironmentMap, sample
from glbump.plan.surfaces import STEEPEST
from glbump.quality import Quality
from glbump.scene import Bump, Material, Scene, Surface
from glbump.shapes import MeshFile, Plane, Shape, Sphere, Torus

F32 = npt.NDArray[np.float32]
CHOICES = ("fast", "balanced", "exact")
INSIDE, AT_EDGES = 1e-4, 0.01  # as in test_places.py


def sun(value: float, height: int = 16) -> LatLong:
    """One texel of `value`, a quarter from the top, straight behind the default camera's scene; 0.1 elsewhere."""
    picture = np.full((height, 2 * height, 3), 0.1, np.float32)
    picture[height // 4, height] = value
    return LatLong(picture)


def against_reference(renderer: Renderer, scene: Scene, size: tuple[int, int] = SIZE) -> bool:
    got, want = renderer.render(scene, size, SHARP).pixels, reference.render(scene, size, 1).pixels
    assert np.isfinite(got).all()
    return float(np.mean(np.abs(got - want).max(axis=-1) > INSIDE)) <= AT_EDGES


# ---- formats


@pytest.mark.parametrize(
    ("peak", "exposure", "texture", "frame"),
    [
        (0.0, 0, "half", "half"),
        (0.5, 0, "half", "half"),
        (HALF_MAX, 0, "half", "half"),
        (65505.0, 0, "half", "float"),
        (-1e9, 0, "half", "float"),
        (1e9, -20, "half", "half"),
        (1.0, 17, "half", "float"),
        (1e-3, 0, "half", "float"),
        (1e-3, 5, "half", "half"),
        (1.0, -30, "half", "float"),
    ],
)
def test_halves_where_they_reach(renderer: Renderer, peak: float, exposure: float, texture: str, frame: str) -> None:
    picture = np.zeros((4, 8, 3), np.float32)
    picture[1, 2] = peak
    plan = renderer.plan(Scene([], LatLong(picture, exposure=exposure)), SIZE, "balanced")
    assert (plan.environments[0].texture_format, plan.frame_format) == (texture, frame)


@pytest.mark.parametrize("samples", [1, 4, 16, 1024])
@pytest.mark.parametrize("value", [1e-6, 1e-3, 0.18, 1.0, 6e4])
def test_the_mean_of_many_samples_is_what_each_is(renderer: Renderer, value: float, samples: int) -> None:
    pixels = renderer.render(Scene([], even(value)), (2, 2), Quality("balanced", samples=samples)).pixels
    # A half holds 11 bits, and up to 4 of them are added up.
    assert np.abs(pixels[..., :3] / value - 1).max() < 2.0**-10
    assert np.all(pixels[..., 3] == 1)


# Kept, so that each is gathered into a roughness chain once.
SUNS = {value: sun(value) for value in (65504.0, 65505.0, 1e9, 1e36)}


@pytest.mark.parametrize("value", SUNS)
@pytest.mark.parametrize("quality", ["fast", "balanced"])
@pytest.mark.parametrize("roughness", [0.0, 1e-9, 0.3, 1.0])
def test_suns(renderer: Renderer, roughness: float, quality: str, value: float) -> None:
    """Finite, nowhere darker than the sky, and as bright as the sun is."""
    for metallic in (0.0, 1.0):
        surface = Surface(Sphere(), Material(metallic=metallic, roughness=roughness))
        pixels = renderer.render(Scene([surface], SUNS[value]), (17, 17), quality).pixels
        assert np.isfinite(pixels).all()
        # A dielectric ball mirrors 4 % of the sky; SH9 of a sun undershoots, and is cut off at 0.
        assert pixels.min() > (0.09 if metallic else 0.003)
        # One sample a pixel may miss a sun that is no wider than it.
        assert quality == "fast" or pixels[..., :3].max() > 1e-4 * value


@pytest.mark.parametrize("exposure", [-64, -30, 30, 64])
@pytest.mark.parametrize("quality", CHOICES)
def test_exposures(renderer: Renderer, quality: str, exposure: float) -> None:
    scenes = (Scene([Surface(Sphere(), MIRROR)], replace(SUNS[1e9], exposure=e)) for e in (0, exposure))
    plain, exposed = (renderer.render(scene, (17, 17), quality) for scene in scenes)
    want = plain.pixels[..., :3] * 2.0**exposure
    # A frame whose brightest light is 1 has halves: 11 bits, a last step of 2**-24, and 4 of them are added.
    halves = exposed.stats["plan"]["frame format"] == "half"
    assert np.all(np.abs(exposed.pixels[..., :3] - want) <= (2.0**-9 if halves else 1e-6) * want + 2.0**-21 * halves)


@pytest.mark.parametrize(("value", "exposure"), [(3e38, 0), (-3e38, 0), (1e30, 30), (2e36, -64)])
def test_light_that_would_overflow_is_refused(renderer: Renderer, value: float, exposure: float) -> None:
    with pytest.raises(LimitError, match=f"the environment reaches .* at most {BRIGHTEST:g}".replace("+", r"\+")):
        renderer.render(Scene([], replace(sun(value), exposure=exposure)), SIZE)


def test_what_float32_cannot_hold_is_refused_in_one_line(renderer: Renderer) -> None:
    picture = np.ones((4, 8, 3))
    picture[2, 3] = 1e300
    with pytest.raises(ImageError, match=r"1 of 32 pixels \(first at row 2, column 3\) are not finite"):
        renderer.render(Scene([], LatLong(picture)), SIZE)


# ---- bumps


@pytest.mark.parametrize("heights", [1e-40, 1e-9, 1e6, 1e20])
@pytest.mark.parametrize("quality", CHOICES)
def test_heights_of_any_range(renderer: Renderer, quality: str, heights: float) -> None:
    """What counts is height times amplitude; halves are given up where slopes leave their range."""
    share = float(np.float32(heights)) if heights > 1e-30 else 1e-30
    pictures = [
        renderer.render(Scene([Surface(Sphere(), MIRROR, bump)], smooth()), SIZE, quality).pixels
        for bump in (Bump(waves(), 0.05, (3, 2)), Bump(waves() * np.float32(share), 0.05 / share, (3, 2)))
    ]
    # Slopes as halves or as floats: 2**-11 of a slope, and of light.
    assert np.mean(np.abs(pictures[0] - pictures[1]).max(axis=-1) > 2.0**-8) <= AT_EDGES


def test_heights_past_the_range_are_refused(renderer: Renderer) -> None:
    for value in (2e30, -2e30):
        bump = Bump(np.array([[0.0, value]], np.float32), amplitude=1e-30)
        with pytest.raises(ImageError, match="heights must lie within"):
            renderer.render(Scene([Surface(Plane(), MIRROR, bump)], smooth()), SIZE)


@pytest.mark.parametrize("amplitude", [1e2, 1e6, 1e9, -1e9])
@pytest.mark.parametrize("shape", [Sphere(), Torus(), Plane()])
def test_slopes_towards_infinity(renderer: Renderer, shape: Shape, amplitude: float) -> None:
    """The normal lies down; straight above the poles of the ball, too."""
    heights = (np.arange(8, dtype=np.float32) % 4 / 4) * np.ones((8, 1), np.float32)
    bump = Bump(heights, amplitude=amplitude, repeat=(3, 2))
    for eye in ((1, 3, 2), (0, 4, 0)):
        scene = Scene([Surface(shape, MIRROR, bump)], smooth(), Camera(eye=eye, up=(0, 0.6, -1)))
        pixels, want = renderer.render(scene, (33, 33), SHARP).pixels, reference.render(scene, (33, 33), 1).pixels
        assert np.isfinite(pixels).all()
        # Where the slope crosses 0 the normal turns over within a hair: those pixels may show either side.
        assert np.mean(np.abs(pixels - want).max(axis=-1) > 0.01) < 0.05


def test_bumps_past_the_range_are_refused(renderer: Renderer) -> None:
    for bump in (Bump(waves(), 1e12, (3, 2)), Bump(waves(), 1e30, (1e6, 1e6))):
        with pytest.raises(LimitError, match=f"bumps rise by .* at most {STEEPEST:g}".replace("+", r"\+")):
            renderer.render(Scene([Surface(Sphere(), MIRROR, bump)], smooth()), SIZE)


@pytest.mark.parametrize("material", [MIRROR, Material(roughness=0.5), Material(metallic=0.5, roughness=0)])
def test_between_opposite_normals_no_pixel_is_lost(renderer: Renderer, tmp_path: Path, material: Material) -> None:
    """Half way between (0, 0, 1) and (0, 0, -1) there is no normal; normalize(0) is NaN."""
    path = tmp_path / "folded.obj"
    corners = "".join(f"v {x} {y} 0\n" for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1)))
    path.write_text(corners + "vn 0 0 1\nvn 0 0 -1\nf 1//1 2//2 3//2\nf 1//1 3//2 4//1\n")
    scene = Scene([Surface(MeshFile(path), material)], smooth(), Camera(eye=(0, 0, 3)))
    assert np.isfinite(renderer.render(scene, (33, 33), SHARP).pixels).all()


# ---- pictures of every size


@pytest.mark.parametrize("shape", [(1, 1), (1, 2), (2, 1), (1, 3), (3, 1), (1, 7), (5, 3), (17, 31), (1, 999)])
@pytest.mark.parametrize("filter", ["bilinear", "trilinear"])
def test_heights_of_any_size(renderer: Renderer, shape: tuple[int, int], filter: str) -> None:
    heights = np.random.default_rng(1).random(shape, dtype=np.float32)
    scene = Scene([Surface(Sphere(), MIRROR, Bump(heights, 0.5 / max(shape)))], smooth())
    quality = Quality("exact", samples=1, bump_filter=filter)
    got = renderer.render(scene, SIZE, quality).pixels
    want = reference.render(scene, SIZE, 1, quality=quality).pixels
    # A level differs by up to 0.05 on llvmpipe (doctor: level of detail); of that the light changes by little.
    assert np.mean(np.abs(got - want).max(axis=-1) > (INSIDE if filter == "bilinear" else 0.02)) <= 0.03


@pytest.mark.parametrize("kind", ["lat-long", "cube"])
@pytest.mark.parametrize("n", [1, 2, 3, 5, 7])
def test_environments_of_any_size(renderer: Renderer, kind: str, n: int) -> None:
    texels = np.random.default_rng(n).random((6, n, n, 3) if kind == "cube" else (n, 2 * n, 3), dtype=np.float32)
    environment = CubeMap(texels) if kind == "cube" else LatLong(texels)
    assert against_reference(renderer, Scene([Surface(Sphere(), MIRROR)], environment))
    for quality in ("fast", "balanced"):
        pixels = renderer.render(Scene([Surface(Sphere(), Material())], environment), SIZE, quality).pixels
        assert np.isfinite(pixels).all()
        assert pixels[..., :3].max() <= 1.001


@pytest.mark.parametrize("size", [(1, 1), (1, 3), (2, 2)])
def test_the_smallest_frames(renderer: Renderer, size: tuple[int, int]) -> None:
    assert against_reference(renderer, Scene([Surface(Sphere(), MIRROR)], smooth(), Camera(fov=60)), size)


@pytest.mark.parametrize("long", [0, 1])
def test_the_longest_frames_and_pictures(renderer: Renderer, long: int) -> None:
    """A frame and a bump as long as the driver takes, and one past it."""
    most = min(renderer.capabilities.max_texture_size, 16384)
    size = (most, 1) if long else (1, most)
    assert renderer.render(Scene([], smooth()), size, "fast").size == size
    heights = np.zeros(size[::-1], np.float32)
    for shape, refused in ((heights, False), (np.zeros(tuple(s + (s > 1) for s in heights.shape)), True)):
        scene = Scene([Surface(Plane(), MIRROR, Bump(shape, 0.1))], smooth())
        if refused and most == renderer.capabilities.max_texture_size:
            with pytest.raises(LimitError, match=rf"this driver takes at most {most} a side; shrink it"):
                renderer.render(scene, SIZE)
        else:
            assert np.isfinite(renderer.render(scene, SIZE).pixels).all()


def test_a_panorama_past_the_driver_is_refused_before_it_is_drawn(renderer: Renderer) -> None:
    most = renderer.capabilities.max_texture_size
    # Broadcast: one texel in memory, and checked before anything is copied.
    wide = np.broadcast_to(np.float32(0.5), (1, 2, 3))
    small = replace(renderer.capabilities, max_texture_size=1)
    try:
        renderer.capabilities = small
        with pytest.raises(LimitError, match="takes at most 1 a side"):
            renderer.render(Scene([], LatLong(np.array(wide))), SIZE, "balanced")
    finally:
        renderer.capabilities = replace(small, max_texture_size=most)


# ---- exact edges and corners

LOOK = "vec3 f(samplerCube s, vec3 d) { return textureLod(s, d, 0.0).rgb; }"


def test_cube_edges_and_corners(glsl: Glsl) -> None:
    """On edges the mean of both faces' texels, on corners of three; a look-up that stays on its face is far off."""
    faces = np.random.default_rng(5).random((6, 4, 4, 3)).astype(np.float32)
    special = np.concatenate([inputs.axes(), inputs.edges(), inputs.corners()])
    rows = np.concatenate([special, inputs.nudged(special), inputs.nudged(special, 1000)])
    got = glsl.load(text=LOOK).f(Sampler(faces, filter="linear"), rows)
    want = sample(EnvironmentMap(CUBE, faces), rows)
    # Weights of 8 bits are what hardware has.
    assert np.abs(got - want).max() < 2.0**-7
    alone = faces[0][:2, -2:].mean(axis=(0, 1))
    corner = sample(EnvironmentMap(CUBE, faces), (1.0, 1.0, -1.0))
    assert np.abs(alone - corner).max() > 2.0**-7


# ---- roughness


def test_no_more_light_comes_back_than_came(glsl: Glsl) -> None:
    """The fit as published dips below 0, where a surface is smooth at grazing angles: 1.04 of the light would come
    back, and -0.04 be left to the diffuse part."""
    grid = [0.0, 1e-9, 1e-4, 0.01, 0.1, 0.3, 0.5, 0.7, 1.0]
    n_dot_v, roughness = (np.array(v) for v in zip(*product([-1.0, *grid], grid)))
    ggx = glsl.load("shaders/lib/ggx.glsl")
    for f0 in (0.0, 0.04, 0.5, 1.0):
        share = ggx.glossy_share(np.full(3, f0), ggx.dfg_fit(n_dot_v, roughness))
        assert np.all((share >= 0) & (share <= 1 + 2.0**-22))
    assert (ggx.dfg_fit(n_dot_v, roughness).min(axis=0) == 0).all()


@pytest.mark.parametrize("quality", CHOICES)
def test_roughness_just_above_0_is_nearly_a_mirror(renderer: Renderer, quality: str) -> None:
    environment = replace(smooth(64), background=False)
    mirror, *rough = (
        renderer.render(
            Scene([Surface(Sphere(), Material(metallic=1, roughness=r))], environment), SIZE, quality
        ).pixels
        for r in (0.0, 1e-9, 1e-6)
    )
    inside = mirror[..., 3] == 1
    for pixels in rough:
        # Near the outline a pixel spans much of the environment, which samples of a chain's first level do not.
        assert np.abs(pixels - mirror)[inside].max() < 0.02
