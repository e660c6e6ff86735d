"""Captured environments: the rest of the scene, projected onto the faces of a cube."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import moderngl
import numpy as np
import numpy.typing as npt
import pytest

from benchmarks import capture as benchmark
from benchmarks.accuracy import LIMITS, exact_error, exact_truth
from benchmarks.scenes import two_surfaces
from glbump.camera import Camera, pixel_rays
from glbump.captures import FACES, cameras, count, rounds, seen_by
from glbump.contents import Contents
from glbump.environment import BoxBounds, Captured, CubeMap, Environment, HemiCube, LatLong, Sky
from glbump.errors import LimitError, SceneError
from glbump.gl.context import Context
from glbump.gl.renderer import Renderer
from glbump.maps.cube import face_dir
from glbump.maps.files import write_picture
from glbump.maps.layout import CUBE, HEMICUBE, LATLONG, EnvironmentMap, sample, texel_dirs
from glbump.plan import Capabilities, Plan, make_plan
from glbump.quality import Quality
from glbump.reference.capture import with_captures
from glbump.reference.shade import render as reference_render
from glbump.scene import Material, Scene, Surface
from glbump.scenefile import load_scene, save_scene
from glbump.shapes import Cube, Quad, Shape, Sphere, Torus, Transform, Vec3

F32 = npt.NDArray[np.float32]

N = 16
MIRROR = Material(metallic=1, roughness=0)
EXACT = Quality("exact", gloss_size=32, gloss_samples=16)
ONE = replace(EXACT, samples=1)

ROUNDING = 1e-4
"""Of radiance about 1, a look-up in 32-bit floats against float64: from texel to texel it changes by 1.6 at most, and a
coordinate of 64 texels is off by some 64 * 2**-22 texels."""


def _latlong() -> F32:
    """No direction looks like another: mirrored or turned, it is another picture."""
    return np.random.default_rng(5).uniform(0.2, 1.8, (32, 64, 3)).astype(np.float32)


def _ball(at: Vec3 = (0, 0, 0), environment: Environment | None = None, material: Material = MIRROR) -> Surface:
    return Surface(Sphere(0.8), material, transform=Transform(translate=at), environment=environment)


def _pair(bounces: int, faces: str = "cube", materials: tuple[Material, Material] = (MIRROR, MIRROR)) -> Scene:
    """Two balls side by side that show each other."""
    places: tuple[Vec3, Vec3] = ((-0.9, 0, 0), (0.9, 0, 0))
    balls = [
        _ball(at, Captured(size=24, faces=faces, bounces=bounces, position=at), material)
        for at, material in zip(places, materials, strict=True)
    ]
    return Scene(balls, Sky(), Camera(eye=(0, 0.6, 5)))


def _drawn_faces(renderer: Renderer, scene: Scene, quality: Quality = ONE) -> F32:
    """(6, n, n, 3): what the GPU holds of the one capture of the scene."""
    renderer.render(scene, (8, 8), quality)
    (taken,) = renderer._captures._shown.values()
    assert isinstance(taken, moderngl.TextureCube)
    n = taken.size[0]
    assert taken.dtype == "f4"
    faces = [np.frombuffer(taken.read(face), np.float32).reshape(n, n, 4) for face in range(6)]
    return np.stack(faces)[..., :3]


def _true_faces(scene: Scene, quality: Quality = ONE) -> F32:
    """The same, by ray casting."""
    contents = Contents()

    def draw(scene: Scene, size: tuple[int, int]) -> Any:
        return reference_render(scene, size, quality.samples, quality=quality, contents=contents)

    environments = (s.environment for s in with_captures(scene, draw).surfaces)
    (cube,) = (e for e in environments if isinstance(e, CubeMap) and isinstance(e.orientation, str))
    return contents.environment(cube).pixels


Draws = Callable[[Scene], F32]


@pytest.fixture(params=["GPU", "reference"])
def faces_of(request: pytest.FixtureRequest) -> Iterator[Draws]:
    """The faces of a scene's one capture, with one sample a texel, drawn in both ways."""
    if request.param == "reference":
        yield _true_faces
    else:
        renderer: Renderer = request.getfixturevalue("renderer")
        yield lambda scene: _drawn_faces(renderer, scene)


# -------------------------------------------------------------------------------------------------- the table


@pytest.mark.parametrize("position", [(0, 0, 0), (3, -2, 1e6), (1e17, 0, 0)])
@pytest.mark.parametrize("faces", ["cube", "hemicube"])
def test_cameras_look_along_opengls_table(faces: str, position: Vec3) -> None:
    dirs = texel_dirs(CUBE, (5, 5))
    for face, camera in zip(FACES[faces], cameras(Captured(faces=faces, position=position)), strict=True):
        origins, rays = pixel_rays(camera, (5, 5))
        # The lowest row first; rounding of a unit vector.
        assert np.abs(rays[::-1] - dirs[face]).max() < 1e-12
        assert np.array_equal(origins[0, 0], position)
        for wrong in (rays, rays[::-1, ::-1], rays[::-1].swapaxes(0, 1)):
            assert np.abs(wrong - dirs[face]).max() > 0.1


def test_with_nothing_else_it_is_the_environment(faces_of: Draws) -> None:
    environment = LatLong(_latlong(), rotation=40, exposure=-0.5, background=False)
    faces = faces_of(Scene([_ball(environment=Captured(size=N))], environment))
    picture = EnvironmentMap(LATLONG, _latlong()[None])
    expected = 2**-0.5 * sample(picture, texel_dirs(CUBE, (N, N)) @ environment.env_from_world().T)
    assert np.abs(faces - expected).max() < ROUNDING
    for wrong in (
        faces[:, ::-1],
        faces[:, :, ::-1],
        faces.swapaxes(1, 2),
        np.rot90(faces, 1, (1, 2)),
        faces[[1, 0, 2, 3, 4, 5]],
    ):
        assert np.abs(wrong - expected).mean() > 500 * ROUNDING


def test_what_stands_about_lies_on_its_face(faces_of: Draws) -> None:
    """A sheet before each face, of a colour of its own, beside the middle and wider than high."""
    colours = np.random.default_rng(2).uniform(0.5, 1.5, (6, 3)).astype(np.float32)
    left, right, top, bottom = 0.55, 0.95, 0.1, 0.3
    sheets = []
    for face, colour in enumerate(colours):
        corners = [3 * face_dir(face, s, t) for s, t in ((left, bottom), (right, bottom), (right, top), (left, top))]
        light = LatLong(np.broadcast_to(colour, (2, 4, 3)).copy())
        # As seen from outside the cube the table is right-handed; a sheet shows its back like its front.
        quad = Quad(tuple((float(x), float(y), float(z)) for x, y, z in corners))  # type: ignore[arg-type]
        sheets.append(Surface(quad, MIRROR, environment=light))
    faces = faces_of(Scene([*sheets, _ball(environment=Captured(size=N))], Sky((0, 0, 0), (0, 0, 0))))
    s = (np.arange(N) + 0.5) / N
    inside = ((s > top) & (s < bottom))[:, None] & ((s > left) & (s < right))[None, :]
    expected = inside[None, ..., None] * colours[:, None, None]
    assert inside.sum() == 3 * 6
    # A constant, through a texture unit.
    assert np.abs(faces - expected).max() < 1e-5


def test_it_is_taken_from_its_position(faces_of: Draws) -> None:
    light = LatLong(np.ones((2, 4, 3), np.float32))
    sheet = Surface(Quad(((1, -1, 2), (-1, -1, 2), (-1, 1, 2), (1, 1, 2))), MIRROR, environment=light)

    def share(position: Vec3) -> float:
        surface = _ball((0, 0, -9), Captured(size=N, position=position))
        faces = faces_of(Scene([sheet, surface], Sky((0, 0, 0), (0, 0, 0))))
        assert faces[[0, 1, 2, 3, 5]].max() == 0
        return float(faces[4].mean())

    # Half as wide as the face from 2 away; twice as far off, a quarter.
    assert share((0, 0, 0)) == 1 / 4
    assert share((0, 0, -2)) == 1 / 16


def test_hemicube_is_the_upper_half_of_the_cube(renderer: Renderer) -> None:
    scene = Scene([_ball((0, 0, 3)), _ball(environment=Captured(size=N))], LatLong(_latlong()))
    cube = _drawn_faces(renderer, scene, EXACT)
    half = replace(scene, surfaces=[scene.surfaces[0], _ball(environment=Captured(size=N, faces="hemicube"))])
    renderer.render(half, (8, 8), EXACT)
    (taken,) = renderer._captures._shown.values()
    assert isinstance(taken, HemiCube)
    picture = renderer.contents.environment(taken)
    assert picture.layout is HEMICUBE
    top = cube[2]
    expected = [cube[face, : N // 2] for face in (0, 1, 4, 5)] + [top[: N // 2], top[N // 2 :]]
    assert np.array_equal(picture.pixels, np.stack(expected))


# -------------------------------------------------------------------------------------------------- what it shows


def test_a_ball_in_it_is_the_ball_in_the_environment_resampled(renderer: Renderer) -> None:
    environment = LatLong(_latlong(), exposure=0.5)
    captured = Captured(size=N, rotation=30, exposure=-1)
    camera = Camera(eye=(1, 1, 3))
    drawn = renderer.render(Scene([_ball(environment=captured)], environment, camera), (64, 64), ONE)
    faces = 2**0.5 * sample(EnvironmentMap(LATLONG, _latlong()[None]), texel_dirs(CUBE, (N, N)))
    cube = CubeMap(faces.astype(np.float32), orientation="opengl", rotation=30, exposure=-1)
    expected = renderer.render(Scene([_ball(environment=cube)], environment, camera), (64, 64), ONE)
    assert np.abs(drawn.pixels - expected.pixels).max() < ROUNDING
    wrong = replace(cube, rotation=31)
    other = renderer.render(Scene([_ball(environment=wrong)], environment, camera), (64, 64), ONE)
    assert np.abs(other.pixels - expected.pixels).max() > 20 * ROUNDING


def test_a_room_is_reckoned_with(renderer: Renderer) -> None:
    room = BoxBounds((-2, -1, -3), (2, 3, 2))
    environment = LatLong(_latlong())
    captured = Captured(size=N, position=(0.5, 0, 0), bounds=room)
    scene = Scene([_ball((1, 0, 0), captured)], environment)
    faces = _drawn_faces(renderer, scene)
    drawn = renderer.render(scene, (48, 48), ONE)
    cube = CubeMap(faces, orientation="opengl", position=(0.5, 0, 0), bounds=room)
    expected = renderer.render(replace(scene, surfaces=[_ball((1, 0, 0), cube)]), (48, 48), ONE)
    assert np.array_equal(drawn.pixels, expected.pixels)
    far = renderer.render(replace(scene, surfaces=[_ball((1, 0, 0), replace(cube, bounds=None))]), (48, 48), ONE)
    assert np.abs(far.pixels - expected.pixels).max() > 100 * ROUNDING


ROUGH, LACQUER = replace(MIRROR, roughness=0.3), Material(base_color=(0.8, 0.2, 0.1), roughness=0)


UNEVEN = Scene([*_pair(3).surfaces[:1], *_pair(1).surfaces[1:]], Sky(), Camera(eye=(0, 0.6, 5)))


@pytest.mark.parametrize(
    "scene",
    [UNEVEN, _pair(1), _pair(2), _pair(3), _pair(2, "hemicube"), _pair(2, materials=(ROUGH, LACQUER))],
    ids=["3 bounces and 1", "1 bounce", "2 bounces", "3 bounces", "hemicubes", "rough and diffuse"],
)
def test_exact_is_the_reference(renderer: Renderer, scene: Scene) -> None:
    figures = exact_error(renderer, scene, (64, 64), EXACT)
    assert figures["share"] > 0.6
    assert {k: v for k, v in figures.items() if k in LIMITS and not v <= LIMITS[k]} == {}


def test_levels_are_the_references(renderer: Renderer) -> None:
    quality = replace(EXACT, environment_filter="trilinear")
    figures = exact_error(renderer, _pair(2), (64, 64), quality)
    assert {k: v for k, v in figures.items() if k in LIMITS and not v <= LIMITS[k]} == {}
    # Level 0 alone is another picture, if not by much: only towards the balls' outlines a pixel holds many texels.
    bilinear = exact_truth(renderer, _pair(2), (64, 64), EXACT)
    assert np.abs(renderer.render(_pair(2), (64, 64), quality).pixels - bilinear.pixels).max() > 0.005


def test_each_bounce_adds_less(renderer: Renderer) -> None:
    pictures = [renderer.render(_pair(bounces), (64, 64), EXACT).pixels for bounces in (1, 2, 3)]
    steps = [float(np.abs(a - b).mean()) for a, b in pairwise(pictures)]
    # A ball in a ball in a ball is small; rounding is some 1e-7 a pixel.
    assert steps[0] > 3 * steps[1] > 3 * 1e-6


def test_bounces_in_the_order_of_what_needs_them() -> None:
    one, two, three = (Captured(position=(i, 0, 0), bounces=i + 1) for i in range(3))

    def scene(*captured: Captured) -> Scene:
        return Scene([_ball(environment=e) for e in captured])

    assert rounds(scene()) == []
    # Nothing that it could show comes nearer with more bounces.
    assert rounds(scene(three)) == [(), (), (three,)]
    assert rounds(scene(one, two)) == [(one,), (two,)]
    assert rounds(scene(one, three)) == [(one, three), (one,), (three,)]
    other = replace(three, position=(9, 0, 0))
    assert rounds(scene(three, other)) == [(three, other)] * 3
    assert count(scene(three, other), other) == 18
    assert count(scene(replace(three, faces="hemicube")), replace(three, faces="hemicube")) == 5


def test_what_has_it_is_not_in_it() -> None:
    mine, other = Captured(), Captured(position=(5, 0, 0))
    surfaces = [_ball(environment=mine), _ball((1, 0, 0)), _ball((2, 0, 0), mine), _ball((3, 0, 0), other)]
    scene = Scene(surfaces, Sky(background=False))
    first, later = seen_by(scene, mine, 1), seen_by(scene, mine, 2)
    assert first.surfaces == (surfaces[1], replace(surfaces[3], environment=None))
    assert later.surfaces == (surfaces[1], surfaces[3])
    assert first.environment == later.environment == Sky()


# -------------------------------------------------------------------------------------------------- when


@pytest.fixture
def counted(renderer: Renderer, monkeypatch: pytest.MonkeyPatch) -> list[Scene]:
    """Every scene that is drawn for a capture."""
    drawn: list[Scene] = []
    draw = renderer._captures._draw

    def noted(scene: Scene, cameras: list[Camera], *rest: Any) -> Iterator[moderngl.Framebuffer]:
        for camera, face in zip(cameras, draw(scene, cameras, *rest), strict=True):
            drawn.append(replace(scene, camera=camera))
            yield face

    monkeypatch.setattr(renderer._captures, "_draw", noted)
    renderer._captures.release()
    return drawn


def test_drawn_anew_when_the_scene_changes_and_not_when_the_camera_moves(
    renderer: Renderer, counted: list[Scene]
) -> None:
    def drawn(scene: Scene, quality: str | Quality = "fast", **options: bool) -> int:
        before = len(counted)
        renderer.render(scene, (16, 16), quality, **options)
        return len(counted) - before

    scene = _pair(2)
    assert drawn(scene) == 24
    assert drawn(scene) == 0
    moved = replace(scene, camera=Camera(eye=(1, 2, 3)))
    assert drawn(moved) == 0
    assert drawn(moved, "balanced") == 24
    assert drawn(moved) == 24
    brighter = replace(scene, environment=Sky(exposure=1))
    shifted = replace(scene, surfaces=[*scene.surfaces, _ball((0, 3, 0))])
    for changed in (brighter, shifted):
        assert drawn(changed) == 24
        assert drawn(replace(changed, camera=moved.camera)) == 0
    # Of one scene at a time.
    assert drawn(scene) == 24
    assert drawn(Scene([_ball()])) == 0
    assert drawn(scene) == 0


def test_not_drawn_anew_when_told(renderer: Renderer, counted: list[Scene]) -> None:
    scene = _pair(1)
    ball = replace(scene, surfaces=[*scene.surfaces, _ball((0, 0, -1.5))])
    # What was never captured is, whatever one is told.
    first = renderer.render(scene, (32, 32), "fast", recapture=False)
    assert len(counted) == 12
    kept = renderer.render(ball, (32, 32), "fast", recapture=False)
    assert len(counted) == 12
    anew = renderer.render(ball, (32, 32), "fast")
    assert len(counted) == 24
    again = renderer.render(ball, (32, 32), "fast", recapture=False)
    assert len(counted) == 24
    assert np.array_equal(anew.pixels, again.pixels)
    assert not np.array_equal(anew.pixels, kept.pixels)
    assert not np.array_equal(first.pixels, kept.pixels)
    # Another environment was not captured; nor can a mirror's capture serve a rough ball.
    rough = replace(scene, surfaces=[replace(s, material=ROUGH) for s in scene.surfaces])
    for other in (_pair(2), rough):
        before = len(counted)
        renderer.render(other, (32, 32), "fast", recapture=False)
        assert len(counted) > before
    with pytest.raises(SceneError, match="recapture must be true or false; got 1"):
        renderer.render(scene, (32, 32), recapture=1)  # type: ignore[arg-type]


def test_the_benchmark_captures_anew(renderer: Renderer, counted: list[Scene]) -> None:
    calls = benchmark.calls(renderer, two_surfaces(Sky()), 8, "fast")
    for name, drawn in (("capture", 6), ("none", 0), ("six", 0), ("capture", 6)):
        before = len(counted)
        calls[name]()
        assert len(counted) - before == drawn
    assert all(len(scene.surfaces) == 2 for scene in counted)


@pytest.mark.parametrize("far", [False, True])
def test_faces_are_plain_pictures_of_what_is_made_ready_once(
    renderer: Renderer, counted: list[Scene], monkeypatch: pytest.MonkeyPatch, far: bool
) -> None:
    """But for what another direction decides otherwise: ahead of one face, something lies so far behind what is near
    that its depth is a logarithm."""
    made: list[Plan] = []
    ready = renderer._ready

    def noted(scene: Scene, plan: Plan, *rest: Any) -> Any:
        made.append(plan)
        return ready(scene, plan, *rest)

    balls = [_ball((0, 0, -1.5)), _ball((3, 0, 0.4)), _ball((0, 2, -5000 if far else -5))]
    scene = Scene([*balls, _ball(environment=Captured(size=N))], LatLong(_latlong()))
    monkeypatch.setattr(renderer, "_ready", noted)
    faces = _drawn_faces(renderer, scene)
    assert [plan.log_depth for plan in made[:-1]] == ([False, True] if far else [False])
    assert len(counted) == 6
    for face, seen in zip(faces, counted):
        plain = renderer.render(seen, (N, N), ONE).pixels
        assert np.array_equal(face, plain[::-1, :, :3])


def test_a_changed_file_is_seen(renderer: Renderer, tmp_path: Path) -> None:
    write_picture(tmp_path / "light.exr", np.ones((2, 4, 3), np.float32))
    lamp = _ball((0, 0, 2), LatLong(tmp_path / "light.exr"))
    scene = Scene([lamp, _ball(environment=Captured(size=N))], Sky((0, 0, 0), (0, 0, 0)))
    assert _drawn_faces(renderer, scene)[4].max() == pytest.approx(1)
    write_picture(tmp_path / "light.exr", np.full((4, 8, 3), 2, np.float32))
    assert _drawn_faces(renderer, scene)[4].max() == pytest.approx(2)


def test_nothing_is_left_behind(context: Context) -> None:
    with Renderer(context.backend) as renderer:
        scenes = [
            replace(_pair(bounces, faces), environment=Sky(exposure=exposure))
            for exposure in (0.0, 1.0)
            for bounces in (1, 3)
            for faces in ("hemicube", "cube")
        ]
        counts = []
        for _ in range(3):
            for scene in scenes:
                renderer.render(scene, (16, 16), "balanced")
            # Pictures read back are kept as other pictures are, until there are too many.
            renderer._store.release()
            counts.append(renderer.context.live_objects())
        assert counts[1] == counts[2]
        renderer._captures.release()
        # Of two cubes with several bounces, what is shown and what it was drawn with.
        assert counts[2]["texture"] - renderer.context.live_objects()["texture"] == 4
        assert renderer._captures.bytes == 0
    context.check()


def test_pictures_are_kept_no_longer_than_shown(context: Context) -> None:
    with Renderer(context=context) as renderer:
        kept = []
        for exposure in range(4):
            scene = _pair(2, materials=(ROUGH, LACQUER))
            renderer.render(replace(scene, environment=Sky(exposure=exposure)), (8, 8), "fast")
            kept.append((len(renderer.contents._kept), len(renderer._store._kept)))
        # The first bounce's are gone too.
        assert kept == [kept[0]] * 4


def test_a_failed_capture_leaves_nothing(context: Context, monkeypatch: pytest.MonkeyPatch, renderer: Renderer) -> None:
    renderer.render(_pair(1), (16, 16), "fast")
    captures, draw, calls = renderer._captures, renderer._captures._draw, 0

    def failing(*arguments: Any) -> Iterator[moderngl.Framebuffer]:
        nonlocal calls
        for face in draw(*arguments):
            calls += 1
            if calls == 9:
                raise LimitError("full")
            yield face

    with monkeypatch.context() as patch:
        patch.setattr(captures, "_draw", failing)
        with pytest.raises(LimitError, match="full"):
            renderer.render(_pair(3), (16, 16), "fast")
    assert captures.bytes == 0
    right = renderer.render(_pair(3), (16, 16), "fast")
    assert captures.bytes > 0
    with Renderer(context=context) as fresh:
        assert np.array_equal(fresh.render(_pair(3), (16, 16), "fast").pixels, right.pixels)


# -------------------------------------------------------------------------------------------------- words


def test_the_plan_says_it(renderer: Renderer) -> None:
    frame = renderer.render(_pair(2), (16, 16), "fast")
    assert frame.stats["plan"]["environment 1"] == "captured cube of 24"
    assert "12 pictures drawn from (-0.9, 0.0, 0.0), without what shows it; anew when" in frame.stats["explain"]
    assert frame.stats["bytes"] >= renderer._captures.bytes > 0


def test_scene_files_hold_it(tmp_path: Path) -> None:
    save_scene(_pair(3, "hemicube"), tmp_path / "pair.toml")
    assert load_scene(tmp_path / "pair.toml") == _pair(3, "hemicube")


TURNED = Transform(translate=(0.5, 0, 0), rotate=(90, 0, 0), scale=2)


@pytest.mark.parametrize(
    ("shape", "transform", "inside", "outside"),
    [
        (Sphere(0.5), Transform(translate=(1, 2, 3)), (1, 2, 3.4), (1, 2, 3.6)),
        (Torus(1, 0.2), TURNED, (0.5, 2.3, 0), (0.5, 0, 0)),
        (Cube((1, 2, 3)), TURNED, (0.5, 2.9, 1.9), (0.5, 1.9, 2.9)),
    ],
    ids=["sphere", "torus", "cube"],
)
def test_from_inside_a_surface_nothing_is_captured(
    renderer: Renderer, shape: Shape, transform: Transform, inside: Vec3, outside: Vec3
) -> None:
    def scene(position: Vec3, environment: Environment | None = None) -> Scene:
        captured = Captured(size=4, position=position)
        return Scene([_ball(environment=captured), Surface(shape, MIRROR, None, transform, environment or None)])

    said = rf"surface 1 \({shape.kind}\) encloses \(.*from where the scene is captured.*; move it, or give"
    for draw in (renderer.plan, renderer.render, reference_render):
        with pytest.raises(SceneError, match=said):
            draw(scene(inside), (4, 4))
    renderer.plan(scene(outside), (4, 4))
    # A surface is not hidden by itself.
    renderer.plan(scene(inside, Captured(size=4, position=inside)), (4, 4))


def test_sizes_that_do_not_fit() -> None:
    scene = Scene([_ball(environment=Captured(size=512))])
    with pytest.raises(
        LimitError, match=r"size 512\) is 512x512 pixels and this driver takes at most 256 a side; .* 256x256"
    ):
        make_plan(scene, EXACT, (8, 8), Contents(), Capabilities(max_cube_size=256))
    half = Scene([_ball(environment=Captured(size=512, faces="hemicube"))])
    with pytest.raises(LimitError, match="takes at most 1024 a side"):
        make_plan(half, EXACT, (8, 8), Contents(), Capabilities(max_texture_size=1024))
    with pytest.raises(SceneError, match=r"must be even.*got 33"):
        Captured(size=33, faces="hemicube")
    bright = Scene([_ball(environment=Captured(exposure=20, bounces=7))])
    with pytest.raises(LimitError, match=r"may grow to .*lower environment\.exposure or environment\.bounces"):
        make_plan(bright, EXACT, (8, 8), Contents())


def test_formats_hold_what_bounces_make_of_it(renderer: Renderer) -> None:
    """Ten stops each time: past halves at the second bounce."""
    dim = Scene([_ball((-1, 0, 0), Captured(size=8, exposure=10, bounces=1, position=(-1, 0, 0)))])
    assert renderer.plan(dim).environments[1].texture_format == "half"
    bounced = replace(
        dim,
        surfaces=[
            _ball(at, Captured(size=8, exposure=10, bounces=2, position=at)) for at in ((-1.0, 0, 0), (1.0, 0.0, 0.0))
        ],
    )
    plan = renderer.plan(bounced, quality="fast")
    assert plan.frame_format == "float"
    assert np.isfinite(renderer.render(bounced, (16, 16), "fast").pixels).all()
