"""Sizes, places, eyes and depths at their extremes: whole pictures against the same scene at its ordinary size, or
against the float64 reference."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest

from glbump import reference
from glbump.camera import Camera
from glbump.errors import SceneError
from glbump.gl.renderer import Renderer
from glbump.gl.stability import MIRROR, SHARP, SIZE, even, smooth, waves
from glbump.mesh import Mesh, in_repeats
from glbump.quality import Quality
from glbump.scene import Bump, Scene, Surface
from glbump.shapes import Cube, MeshFile, Plane, Quad, Shape, Sphere, Torus, Transform

F32 = npt.NDArray[np.float32]
Vec3 = tuple[float, float, float]

# Interior pixels agree to some float32 roundings; where a triangle or an outline ends, they may fall to either side.
INSIDE = 1e-4
AT_EDGES = 0.01


def agree(a: F32, b: F32) -> bool:
    assert np.isfinite(a).all()
    return float(np.mean(np.abs(a - b).max(axis=-1) > INSIDE)) <= AT_EDGES


def against_reference(renderer: Renderer, scene: Scene, size: tuple[int, int] = SIZE) -> bool:
    return agree(renderer.render(scene, size, SHARP).pixels, reference.render(scene, size, 1).pixels)


# ---- sizes and places

SHAPES: dict[str, Callable[[float], Shape]] = {
    "sphere": Sphere,
    "torus": lambda s: Torus(s, 0.35 * s),
    "cube": lambda s: Cube((2 * s, 2 * s, 2 * s)),
    "plane": lambda s: Plane((2 * s, 2 * s)),
    "quad": lambda s: Quad(((-s, -s, 0.5 * s), (s, -s, 0.5 * s), (0.7 * s, s, -0.5 * s), (-s, 0.8 * s, -0.4 * s))),
}


def _sized(make: Callable[[float], Shape], size: float, by: str) -> Scene:
    shape, scale = (make(size), 1.0) if by == "shape" else (make(1.0), size)
    bump = Bump(waves(), amplitude=0.05 * size, repeat=(3, 2))
    surface = Surface(shape, MIRROR, bump, Transform(rotate=(30, 20, 0), scale=scale))
    return Scene([surface], smooth(), Camera(eye=(0, 0.5 * size, 4 * size)))


@pytest.mark.parametrize("size", [1e-17, 1e-12, 1e-6, 1e6, 1e12, 1e17])
@pytest.mark.parametrize("by", ["shape", "transform"])
@pytest.mark.parametrize("name", SHAPES)
def test_a_size_changes_nothing(renderer: Renderer, name: str, by: str, size: float) -> None:
    plain, sized = (renderer.render(_sized(SHAPES[name], s, by), SIZE, SHARP).pixels for s in (1.0, size))
    assert agree(sized, plain)


def test_the_law_of_sizes_sees_a_bump_of_another_height(renderer: Renderer) -> None:
    scene = _sized(SHAPES["quad"], 1e6, "shape")
    lower = replace(scene.surfaces[0], bump=Bump(waves(), amplitude=0.04e6, repeat=(3, 2)))
    pictures = [renderer.render(s, SIZE, SHARP).pixels for s in (scene, replace(scene, surfaces=[lower]))]
    assert not agree(*pictures)


def _obj(folder: Path, *, at: float = 0.0, size: float = 1.0, uv_at: float = 0.0, uv_size: float = 1.0) -> MeshFile:
    """Two triangles with uv, as a file."""
    corners = np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
    positions = np.column_stack([2 * corners - 1, np.zeros(4)]) * size + at
    lines = ["v " + " ".join(repr(float(x)) for x in p) for p in positions]
    lines += ["vt " + " ".join(repr(float(x)) for x in t) for t in corners * uv_size + uv_at]
    path = folder / "mesh.obj"
    path.write_text("\n".join([*lines, "vn 0 0 1", "f 1/1/1 2/2/1 3/3/1", "f 1/1/1 3/3/1 4/4/1"]))
    return MeshFile(path)


@pytest.mark.parametrize(
    ("at", "size", "uv_at", "uv_size"),
    [
        (0, 1e-12, 0, 1),
        (0, 1e12, 0, 1),
        (1e7, 1, 0, 1),
        (1e10, 1, 0, 1),
        (0, 1, 1e6, 1),
        (0, 1, -1e9, 1),
        (0, 1, 0, 1e-5),
        (0, 1, 0, 1e6),
    ],
)
def test_a_mesh_anywhere_of_any_size(
    renderer: Renderer, tmp_path: Path, at: float, size: float, uv_at: float, uv_size: float
) -> None:
    def drawn(at: float, size: float, **uv: float) -> F32:
        repeat = (3 / uv.get("uv_size", 1.0), 2 / uv.get("uv_size", 1.0))
        bump = Bump(waves(), amplitude=0.05 * size, repeat=repeat)
        camera = Camera(eye=(at + 0.5 * size, at + size, at + 3 * size), target=(at, at, at))
        mesh = _obj(tmp_path, at=at, size=size, **uv)
        return renderer.render(Scene([Surface(mesh, MIRROR, bump)], smooth(), camera), SIZE, SHARP).pixels

    assert agree(drawn(at, size, uv_at=uv_at, uv_size=uv_size), drawn(0.0, 1.0))


def test_whole_repeats_are_taken_only_where_they_cost_precision() -> None:
    uv = np.array([[0.0, 0], [1, 0], [0, 1]])
    mesh = Mesh(np.zeros((3, 3)), np.array([[0, 1, 2]], np.int32), uv=uv)
    few, many = in_repeats(mesh, (32.0, 1.0)), in_repeats(replace(mesh, uv=uv + 1e6), (1.0, 1.0))
    assert few.triangles is mesh.triangles
    assert many.uv is not None
    assert np.abs(many.uv).max() <= 1
    # Their differences, which the shader takes its levels from, are what they were.
    assert np.array_equal(np.diff(many.uv, axis=0), np.diff(uv, axis=0))


@pytest.mark.parametrize("repeat", [1e2, 1e4, 1e5, 1e6])
@pytest.mark.parametrize(
    ("shape", "target"), [(Sphere(), (0, 0, 1)), (Torus(), (0, 0, 1.35)), (Plane(), (0.1, 0, 0)), (Quad(), (0.1, 0, 0))]
)
def test_what_is_left_of_many_repeats(renderer: Renderer, shape: Shape, target: Vec3, repeat: float) -> None:
    """A place on a shape is known to 1e-6 of it at worst (Mesa's atan), to some 1e-8 where it is looked at here. Each
    repeat adds that much; light changes by 8 a repeat."""
    bump = Bump(waves(), amplitude=0.05 / repeat, repeat=(repeat, repeat))
    camera = Camera(eye=(0.5, 1.2, 4), target=target, fov=80 / repeat)
    scene = Scene([Surface(shape, MIRROR, bump)], smooth(), camera)
    off = np.abs(renderer.render(scene, SIZE, SHARP).pixels - reference.render(scene, SIZE, 1).pixels)
    # Where triangles 1e5 pictures wide meet, single pixels may fall between them.
    assert np.quantile(off, 1 - AT_EDGES) < 1e-5 + 2e-7 * repeat


@pytest.mark.parametrize("scale", [(1e-6, 1, 1), (1, 1e-6, 1), (1e3, 1, 1), (1, -1e-3, 1)])
@pytest.mark.parametrize("name", SHAPES)
def test_stretched(renderer: Renderer, name: str, scale: Vec3) -> None:
    bump = Bump(waves(), amplitude=0.05, repeat=(3, 2))
    surface = Surface(SHAPES[name](1.0), MIRROR, bump, Transform(rotate=(30, 20, 0), scale=scale))
    # Seen edge on, a disc is all edge.
    scene = Scene([surface], smooth(), Camera(eye=(0.5, 1, 4 * max(map(abs, scale))), fov=60))
    got, want = renderer.render(scene, SIZE, SHARP).pixels, reference.render(scene, SIZE, 1).pixels
    assert np.mean(np.abs(got - want).max(axis=-1) > 0.02) < 0.03


def test_stretched_too_far_is_refused() -> None:
    Transform(scale=(1e6, 1, 1))
    with pytest.raises(SceneError, match=r"transform.scale .* 1e\+06 between axes"):
        Transform(scale=(1.1e6, 1, 1))


# ---- eyes


@pytest.mark.parametrize("width", [1e2, 1e4, 1e6, 1e8])
def test_an_eye_low_above_a_wide_floor(renderer: Renderer, width: float) -> None:
    eye = (0.31234567 * width, 1.7, 0.22345678 * width)
    camera = Camera(eye=eye, target=(eye[0] + 2, 0, eye[2] + 3))
    assert against_reference(renderer, Scene([Surface(Plane((width, width)), MIRROR)], smooth(), camera))


@pytest.mark.parametrize("bump", [None, Bump(waves(), amplitude=0.02, repeat=(3, 2))])
@pytest.mark.parametrize("height", [1e-6, 1e-5, 1e-3, 0.1])
def test_an_eye_close_to_a_ball(renderer: Renderer, height: float, bump: Bump | None) -> None:
    camera = Camera(eye=(0, 0, 1 + height), target=(0.1, 0.05, 0))
    assert against_reference(renderer, Scene([Surface(Sphere(), MIRROR, bump)], smooth(), camera))


@pytest.mark.parametrize("eye", [(0, 0, 0), (1e-30, 0, 0), (0.3, -0.2, 0.5), (0, 0.99, 0), (0, 0, 1.0)])
@pytest.mark.parametrize("shape", [Sphere(), Torus(), Cube()])
def test_an_eye_inside(renderer: Renderer, shape: Shape, eye: Vec3) -> None:
    """The far side of the ball, not the one behind the eye."""
    bump = Bump(waves(), amplitude=0.02, repeat=(3, 2))
    scene = Scene([Surface(shape, MIRROR, bump)], smooth(), Camera(eye=eye, target=(0.1, 0.05, -1.5)))
    assert against_reference(renderer, scene)


@pytest.mark.parametrize("fov", [1e-4, 1e-2, 1, 170, 179])
@pytest.mark.parametrize("name", SHAPES)
def test_fields_of_view(renderer: Renderer, name: str, fov: float) -> None:
    bump = Bump(waves(), amplitude=0.05, repeat=(3, 2))
    surface = Surface(SHAPES[name](1.0), MIRROR, bump, Transform(rotate=(30, 20, 0)))
    target = (0, 0, 1.35) if name == "torus" else (0.01, 0.02, 0.03)
    assert against_reference(renderer, Scene([surface], smooth(), Camera(eye=(0.5, 1, 4), target=target, fov=fov)))


@pytest.mark.parametrize("up", [(0, 0, 1), (1, 0, 0)])
@pytest.mark.parametrize("eye", [(0, 4, 0), (0, -4, 0)])
def test_straight_down_on_a_pole(renderer: Renderer, eye: Vec3, up: Vec3) -> None:
    """The middle pixel meets the pole, where dp/du is 0: waves along v show, those along u have no slope there."""
    for heights in (waves(), waves().T):
        scene = Scene([Surface(Sphere(), MIRROR, Bump(heights, 0.02, (3, 2)))], smooth(), Camera(eye=eye, up=up))
        assert against_reference(renderer, scene, (33, 33))


# ---- depth


def _two_mirrors(distance: float, near: float | None, gap: float) -> Scene:
    """A black mirror, a white one `gap` of the distance behind it, both aslant; a ball as near as `near` distances."""
    black = replace(MIRROR, base_color=(0.0, 0.0, 0.0))
    front = Transform(rotate=(60, 0, 0), translate=(0, 0, -distance))
    back = np.array(front.translate) - gap * distance * front.matrix()[:3, 1]
    behind = replace(front, translate=tuple(map(float, back)))
    surfaces = [Surface(Plane((distance, distance)), m, transform=t) for m, t in ((black, front), (MIRROR, behind))]
    if near is not None:
        at = near * distance
        surfaces.append(Surface(Sphere(0.1 * at), MIRROR, transform=Transform((0.5 * at, 0, -at))))
    return Scene(surfaces, even(1.0), Camera(eye=(0, 0, 0), target=(0, 0, -1), fov=20))


@pytest.mark.parametrize(
    ("distance", "near"),
    [(d, n) for d in (1e-6, 1.0, 1e9) for n in (None, 1e-3, 1e-6, 1e-9)] + [(1e9, 1e-15)],
)
def test_depth_keeps_apart_what_is_1e_5_of_its_distance_apart(
    renderer: Renderer, distance: float, near: float | None
) -> None:
    shown = renderer.render(_two_mirrors(distance, near, 1e-5), SIZE, SHARP).pixels[..., 0]
    assert not np.any(shown > 0.5)
    # Without a gap the later one is seen: the picture could show it.
    assert np.any(renderer.render(_two_mirrors(distance, near, 0.0), SIZE, SHARP).pixels[..., 0] > 0.5)


def test_depth_is_a_logarithm_only_where_24_bits_do_not_reach(renderer: Renderer) -> None:
    near, far = (renderer.plan(_two_mirrors(1.0, n, 0.1), SIZE, "fast") for n in (None, 1e-6))
    assert not near.log_depth
    assert far.log_depth
    flat = replace(_two_mirrors(1.0, 1e-6, 0.1), camera=Camera(projection="orthographic"))
    assert not renderer.plan(flat, SIZE, Quality("fast")).log_depth
