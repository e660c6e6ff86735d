"""What a scene does not need is not in the plan, and not in the compiled program."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from glbump.camera import Camera
from glbump.contents import Contents
from glbump.environment import CubeMap, LatLong
from glbump.errors import LimitError, SceneError
from glbump.gl.renderer import Renderer
from glbump.gl.source import resolve
from glbump.plan import Capabilities, Plan, make_plan
from glbump.quality import Quality
from glbump.scene import Bump, Material, NormalMap, Scene, Surface
from glbump.shapes import MeshFile, Plane, Quad, Sphere, Torus, Transform

MIRROR = Material(metallic=1, roughness=0)
HEIGHTS = np.linspace(0, 1, 64, dtype=np.float32).reshape(8, 8)
NORMALS = np.broadcast_to(np.float32([0.1, 0.2, 0.974]), (4, 4, 3)).copy()
GREY = LatLong(np.full((4, 8, 3), 0.5, np.float32))


def _scene(*surfaces: Surface, environment: LatLong | CubeMap = GREY, camera: Camera | None = None) -> Scene:
    return Scene(surfaces, environment, camera or Camera())


def _plan(scene: Scene, quality: str | Quality = "exact", size: tuple[int, int] = (64, 64)) -> Plan:
    return make_plan(scene, quality if isinstance(quality, Quality) else Quality(quality), size, Contents())


def _uniforms(renderer: Renderer, scene: Scene, quality: str = "exact") -> set[str]:
    """What the linked program of the first surface still has."""
    plan = renderer.plan(scene, (64, 64), quality)
    program = renderer._programs.get("surface.vert", "surface.frag", plan.surfaces[0].defines).program
    return set(program)


def test_a_plain_mirror_has_nothing_but_its_environment(renderer: Renderer) -> None:
    names = _uniforms(renderer, _scene(Surface(Sphere(), MIRROR)))
    assert names == {
        "clip_from_object",
        "object_from_outline",
        "position",
        "environment",
        "eye_object",
        "radius",
    }


def test_no_bump_no_sampler(renderer: Renderer) -> None:
    bumped = Surface(Sphere(), MIRROR, Bump(HEIGHTS, amplitude=0.1))
    assert {"bump_0", "slope_scale", "repeat"} <= _uniforms(renderer, _scene(bumped))
    # An amplitude or a scale of 0 is no bump either.
    for bump in (None, Bump(HEIGHTS, amplitude=0), NormalMap(NORMALS, scale=0)):
        names = _uniforms(renderer, _scene(Surface(Sphere(), MIRROR, bump)))
        assert not names & {"bump_0", "slope_scale", "repeat"}


def test_no_bump_no_code_of_it() -> None:
    plain, bumped = (
        resolve("surface.frag", defines=dict(_plan(_scene(Surface(Sphere(), MIRROR, b))).surfaces[0].defines))
        for b in (None, Bump(HEIGHTS, amplitude=0.1))
    )
    assert "#define BUMP 0" in plain.text
    assert "#define BUMP 1" in bumped.text


def test_a_mesh_without_bumps_uploads_no_texture_coordinates(renderer: Renderer) -> None:
    assert "texcoord" in _uniforms(renderer, _scene(Surface(Plane(), MIRROR, Bump(HEIGHTS, amplitude=0.1))))
    assert "texcoord" not in _uniforms(renderer, _scene(Surface(Plane(), MIRROR)))


@pytest.mark.parametrize(
    ("material", "there", "absent"),
    [
        (MIRROR, set(), {"f0", "gloss", "sh", "roughness"}),
        (Material((1, 0.5, 0.2), 1, 0), {"f0"}, {"gloss", "sh"}),
        (Material(metallic=0, roughness=0), {"f0", "sh"}, {"gloss"}),
        (Material(metallic=1, roughness=0.4), {"gloss", "base_color", "dfg_table"}, {"sh", "environment"}),
        (Material(metallic=0, roughness=0.4), {"gloss", "dielectric_f0", "sh"}, {"environment"}),
        (Material(base_color=(0, 0, 0), roughness=0.4), {"gloss", "dielectric_f0"}, {"sh"}),
    ],
)
def test_light_is_what_the_material_needs(
    renderer: Renderer, material: Material, there: set[str], absent: set[str]
) -> None:
    names = {n.removesuffix("[0]") for n in _uniforms(renderer, _scene(Surface(Sphere(), material)), "balanced")}
    assert there <= names
    assert not absent & names


def test_diffuse_light_of_a_map_takes_no_harmonics(renderer: Renderer) -> None:
    names = {n.removesuffix("[0]") for n in _uniforms(renderer, _scene(Surface(Sphere(), Material(roughness=0))))}
    assert "irradiance_map" in names
    assert not names & {"sh", "sun_dir"}


def test_nothing_glossy_no_chain() -> None:
    assert _plan(_scene(Surface(Sphere(), MIRROR)), "balanced").environments[0].gloss is None
    rough = Surface(Torus(), Material(roughness=0.3))
    assert _plan(_scene(Surface(Sphere(), MIRROR), rough), "balanced").environments[0].gloss is not None


def test_transforms_cost_only_what_they_need() -> None:
    def kind(transform: Transform, rotation: float = 0) -> int:
        surface = Surface(Sphere(), MIRROR, transform=transform)
        return _plan(_scene(surface, environment=replace(GREY, rotation=rotation))).surfaces[0].has("TRANSFORM")

    assert kind(Transform()) == kind(Transform(translate=(1, 2, 3), scale=2)) == 0
    assert kind(Transform(rotate=(0, 10, 0))) == kind(Transform(), rotation=10) == kind(Transform(scale=-1)) == 1
    assert kind(Transform(scale=(1, 2, 1))) == 2


def test_triangles_go_with_the_size_of_the_picture() -> None:
    scene = _scene(Surface(Sphere(), MIRROR))
    counts = [_plan(scene, "fast", (size, size)).surfaces[0].segments for size in (64, 256, 1024, 4096)]
    # Sagitta goes with the square of a segment's length: four times the size, twice the segments.
    assert counts[1:] == pytest.approx([2 * c for c in counts[:-1]], rel=0.1)
    far = _scene(Surface(Sphere(), MIRROR), camera=Camera(eye=(0, 0, 400)))
    assert _plan(far, "fast", (1024, 1024)).surfaces[0].segments < counts[2] / 5


def test_a_moving_camera_asks_for_few_meshes_none_of_them_too_coarse() -> None:
    segments = []
    for distance in np.geomspace(1.5, 50, 200):
        plan = _plan(_scene(Surface(Torus(), MIRROR), camera=Camera(eye=(0, 0, distance + 1.35))), "fast", (512, 512))
        segments.append(plan.surfaces[0].segments)
    radius_px = 1.35 / np.geomspace(1.5, 50, 200) / np.tan(np.radians(20)) * 256
    needed = np.pi / np.arccos(1 - 0.25 / radius_px)
    assert len(set(segments)) <= 12
    assert (np.array(segments) >= needed).all()
    assert (np.array(segments) <= 1.25 * needed + 1).all()  # a step of 19 %, and whole numbers


def test_a_ball_that_nothing_can_cut_is_drawn_as_its_outline() -> None:
    def outlined(*others: Surface, camera: Camera | None = None) -> int:
        return _plan(_scene(Surface(Sphere(), MIRROR), *others, camera=camera)).surfaces[0].has("OUTLINE")

    assert outlined()
    assert outlined(Surface(Sphere(), MIRROR, transform=Transform(translate=(2.1, 0, 0))))
    assert not outlined(Surface(Sphere(), MIRROR, transform=Transform(translate=(1.9, 0, 0))))
    assert not outlined(Surface(Plane((9, 9)), MIRROR))
    assert not outlined(camera=Camera(eye=(0, 0, 0.5), target=(0, 0, -1)))
    assert not _plan(_scene(Surface(Torus(), MIRROR))).surfaces[0].has("OUTLINE")


def test_closed_shapes_are_culled_unless_the_eye_is_in_them() -> None:
    inside = Camera(eye=(0, 0, 0.5), target=(0, 0, -1))
    assert _plan(_scene(Surface(Sphere(), MIRROR))).surfaces[0].cull
    assert not _plan(_scene(Surface(Sphere(), MIRROR), camera=inside)).surfaces[0].cull
    assert not _plan(_scene(Surface(Quad(), MIRROR))).surfaces[0].cull


def test_light_too_bright_for_halves_is_pre_exposed_and_its_frame_has_floats() -> None:
    sun = LatLong(np.full((4, 8, 3), 1e5, np.float32))
    plan = _plan(_scene(Surface(Sphere(), MIRROR), environment=sun), "fast")
    assert (plan.environments[0].texture_format, plan.environments[0].pre_exposure) == ("half", 1)
    assert plan.frame_format == "float"
    dim = LatLong(np.full((4, 8, 3), 1e3, np.float32), exposure=10)
    plan = _plan(_scene(Surface(Sphere(), MIRROR), environment=dim), "fast")
    assert (plan.environments[0].texture_format, plan.frame_format) == ("half", "float")
    assert "65504" in plan.explain()


def test_fast_looks_up_a_cube_no_larger_than_what_is_seen() -> None:
    big = LatLong(np.full((512, 1024, 3), 0.5, np.float32))
    scene = _scene(Surface(Sphere(), MIRROR), environment=big)
    assert _plan(scene, "fast", (1024, 1024)).environments[0].size == 256  # the picture's own resolution
    assert _plan(scene, "fast", (16, 16)).environments[0].size == 64  # the frame's
    assert _plan(scene, "balanced", (1024, 1024)).environments[0].size is None


def test_every_choice_is_explained() -> None:
    plan = _plan(_scene(Surface(Sphere(), MIRROR), Surface(Plane(), bump=Bump(HEIGHTS, amplitude=0.1))), "fast")
    lines = plan.explain().splitlines()
    assert len(lines) == len(plan.choices)
    assert all(choice.why for choice in plan.choices)
    for what in ("samples", "environment", "surface 0 light", "surface 1 bump", "roughness chain", "sky"):
        assert any(line.startswith(what) for line in lines)


def test_a_picture_past_the_drivers_limit_says_the_limit() -> None:
    with pytest.raises(LimitError, match=r"8x4 pixels .* at most 4 a side; shrink it to 4x2"):
        make_plan(_scene(), Quality("exact"), (8, 8), Contents(), Capabilities(max_texture_size=4))


def test_bumps_on_a_mesh_without_texture_coordinates(tmp_path: Path) -> None:
    path = tmp_path / "bare.obj"
    path.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    surface = Surface(MeshFile(path), MIRROR, Bump(HEIGHTS, amplitude=0.1))
    with pytest.raises(SceneError, match=r"bare\.obj has no texture coordinates, and bumps need them"):
        _plan(_scene(surface))
    assert _plan(_scene(replace(surface, bump=None)))
