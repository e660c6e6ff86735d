"""Scene files: what is written is what is read, and what is wrong is named with its place."""

from __future__ import annotations

import os
import re
import tempfile
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from glbump.camera import Camera
from glbump.environment import Chrome, CubeMap, Fractal, LatLong, Sky
from glbump.errors import SceneError
from glbump.scene import Bump, Material, NormalMap, Scene, Surface
from glbump.scenefile import load_scene, save_scene, set_from_text
from glbump.shapes import Cube, MeshData, MeshFile, Plane, Quad, Sphere, Torus, Transform

DESIGN = """
[camera]
eye = [0, 0, 4]
target = [0, 0, 0]
fov = 40

[environment]
kind = "lat-long"
image = "venice.exr"
rotation = 0

[[surface]]
shape = { kind = "sphere", radius = 1 }
material = { metallic = 1, roughness = 0 }
bump = { height = "brick.png", amplitude = 0.02, repeat = [8, 4] }
"""
ENVIRONMENT = '[environment]\nkind = "lat-long"\nimage = "a.exr"\n'


def write(folder: Path, text: str) -> Path:
    file = folder / "scene.toml"
    file.write_text(text, encoding="utf-8")
    return file


def refusal(folder: Path, text: str, **options: Any) -> str:
    with pytest.raises(SceneError) as caught:
        load_scene(write(folder, text), **options)
    message = str(caught.value)
    assert "\n" not in message
    assert message.startswith(f"{folder / 'scene.toml'}: ")
    return message.removeprefix(f"{folder / 'scene.toml'}: ")


def test_the_scene_of_the_readme(tmp_path: Path) -> None:
    scene = load_scene(write(tmp_path, DESIGN))
    assert scene == Scene(
        surfaces=(
            Surface(
                Sphere(1),
                Material(metallic=1, roughness=0),
                Bump(tmp_path / "brick.png", amplitude=0.02, repeat=(8, 4)),
            ),
        ),
        environment=LatLong(tmp_path / "venice.exr"),
    )


def test_saved_text_is_short_and_readable(tmp_path: Path) -> None:
    """Defaults are left out; a surface is a few lines, as one would write it by hand."""
    save_scene(load_scene(write(tmp_path, DESIGN)), tmp_path / "again.toml")
    assert (tmp_path / "again.toml").read_text(encoding="utf-8") == (
        '[environment]\nkind = "lat-long"\nimage = "venice.exr"\n\n'
        '[[surface]]\nshape = { kind = "sphere" }\nmaterial = { metallic = 1, roughness = 0 }\n'
        'bump = { height = "brick.png", amplitude = 0.02, repeat = [8, 4] }\n'
    )


def test_without_an_environment_there_is_a_sky(tmp_path: Path) -> None:
    text = '[[surface]]\nshape = { kind = "sphere" }\n'
    assert load_scene(write(tmp_path, text)) == Scene([Surface(Sphere())], Sky()) == Scene([Surface(Sphere())])
    save_scene(Scene([]), tmp_path / "empty.toml")
    assert (tmp_path / "empty.toml").read_text(encoding="utf-8") == '[environment]\nkind = "sky"\n'
    assert load_scene(tmp_path / "empty.toml") == Scene([])


def test_a_file_of_an_editor_that_marks_utf8(tmp_path: Path) -> None:
    (tmp_path / "scene.toml").write_bytes(b"\xef\xbb\xbf" + ENVIRONMENT.encode())
    assert load_scene(tmp_path / "scene.toml").surfaces == ()


# Round trip. Names hold whatever a file's name may hold.

lengths = st.floats(1e-18, 1e18)
signed = st.floats(-1e18, 1e18)
shares = st.floats(0, 1)
points = st.tuples(signed, signed, signed)
names = st.text(st.characters(blacklist_categories=["Cs"], blacklist_characters="/\0"), min_size=1, max_size=20)
paths = st.lists(names.filter(lambda n: n not in (".", "..")), min_size=1, max_size=3)
repeats = st.tuples(st.floats(1e-6, 1e6), st.floats(1e-6, 1e6))
shapes = st.one_of(
    st.builds(Sphere, lengths),
    st.builds(lambda r, s: Torus(r, r * s), st.floats(1e-9, 1e18), st.floats(1e-6, 0.99)),
    st.builds(Plane, st.tuples(lengths, lengths)),
    st.builds(Cube, st.tuples(lengths, lengths, lengths)),
    st.builds(lambda x: Quad(((0, 0, x), (1, 0, x), (2, 2, x), (0, 1, x))), st.floats(-9, 9)),
    st.builds(MeshFile, paths.map(lambda p: "/".join(p))),
)
bumps = st.one_of(
    st.none(),
    st.builds(Bump, paths.map("/".join), st.floats(-9, 9), repeats, st.sampled_from([None, "r", "a"])),
    st.builds(NormalMap, paths.map("/".join), st.floats(-9, 9), repeats, st.booleans()),
)
common = {
    "rotation": st.floats(-720, 720),
    "exposure": st.floats(-64, 64),
    "lookup": st.sampled_from(["reflection", "normal"]),
    "background": st.booleans(),
}
colours = st.tuples(*[st.floats(0, 65504)] * 3)
environments = st.one_of(
    st.builds(Sky, colours, colours, st.floats(0, 90), **common),
    st.builds(Chrome, colours, colours, st.floats(0, 64), st.floats(-16, 16), **common),
    st.builds(
        Fractal,
        st.integers(0, 2**31 - 1),
        st.floats(0, 4),
        *[colours] * 4,
        steps=st.integers(8, 1024),
        **common,
    ),
    st.builds(LatLong, paths.map("/".join), **common),
    st.builds(
        CubeMap,
        st.one_of(paths.map("/".join), st.lists(paths.map("/".join), min_size=6, max_size=6).map(tuple)),
        st.sampled_from(["opengl", "inside"]),
        **common,
    ),
)
scales = st.floats(1e-18, 1e18) | st.floats(-1e18, -1e-18)
factors = st.floats(1e-3, 1e3) | st.floats(-1e3, -1e-3)
stretched = st.tuples(st.floats(1e-12, 1e12), factors, factors).map(lambda t: (t[0], t[0] * t[1], t[0] * t[2]))
surfaces = st.builds(
    Surface,
    shapes,
    st.builds(Material, st.tuples(shares, shares, shares), shares, shares, st.floats(1, 10)),
    bumps,
    st.builds(Transform, points, points, scales | stretched),
)
cameras = st.builds(
    Camera,
    eye=st.tuples(st.floats(1, 1e9), st.just(0), signed),
    fov=st.floats(1e-6, 179),
    projection=st.sampled_from(["perspective", "orthographic"]),
    height=lengths,
    near=st.none() | st.floats(0.1, 1),
    far=st.none() | st.floats(2, 1e18),
)
scenes = st.builds(Scene, st.lists(surfaces, max_size=2).map(tuple), environments, cameras)


def placed(value: Any, folder: Path) -> Any:
    """The scene with every path absolute in `folder`, as loading makes it."""
    if isinstance(value, Path):
        return folder / value
    if isinstance(value, tuple):
        return tuple(placed(v, folder) for v in value)
    if not hasattr(value, "__dataclass_fields__"):
        return value
    names = [field.name for field in fields(value)]
    return type(value)(**{name: placed(getattr(value, name), folder) for name in names})


@settings(deadline=None, max_examples=150)
@given(scenes)
def test_round_trip(scene: Scene) -> None:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name).resolve()
        scene = placed(scene, folder)
        save_scene(scene, folder / "s.toml")
        assert load_scene(folder / "s.toml") == scene


# What is wrong in a file.


@pytest.mark.parametrize(
    ("surface", "said"),
    [
        ("material = { metalic = 1 }", r"surface.0.material.metalic: unknown key 'metalic'; did you mean 'metallic'"),
        ("materal = {}", r"surface.0.materal: unknown key 'materal'; did you mean 'material'"),
        ("material = { metallic = 2 }", r"surface.0.material.metallic must be .* at most 1; got 2"),
        ("material = { metallic = '1' }", r"surface.0.material.metallic must be .*; got '1'"),
        ("material = { metallic = true }", r"surface.0.material.metallic must be .*; got True"),
        ("material = { metallic = nan }", r"surface.0.material.metallic must be a finite number .*; got nan"),
        ("material = { roughness = 1979-05-27 }", r"surface.0.material.roughness must be .*; got datetime"),
        ("material = { base_color = [1, 1] }", r"surface.0.material.base_color must be 3 numbers; got \[1, 1\]"),
        ("material = { base_color = [1, 1, []] }", r"surface.0.material.base_color\[2\] must be a finite number"),
        ("material = 3", r"surface.0.material must be a table, .*; got 3"),
        ("transform = { scale = 0 }", r"surface.0.transform.scale must be at least 1e-18 .*; got \(0.0, 0.0, 0.0\)"),
        ("bump = { height = 'a.png' }", r"surface.0.bump.amplitude is missing"),
        ("bump = { hight = 'a.png' }", r"surface.0.bump needs a height or a normal_map"),
        ("bump = 'a.png'", r"surface.0.bump needs a height or a normal_map; got 'a.png'"),
        ("environment = { kind = 'captured', bounds = { low = [0, 0, 0] } }", r"surface.0.environment.bounds.high is"),
        ("environment = { kind = 'captured', bounds = 3 }", r"surface.0.environment.bounds needs a low or a radius; "),
        ("bump = { height = 'a', normal_map = 'b' }", r"surface.0.bump has both height and normal_map"),
        ("bump = { height = 3, amplitude = 1 }", r"surface.0.bump.height must be a path; got 3"),
        ("bump = { height = '', amplitude = 1 }", r"surface.0.bump.height must be a path; got ''"),
        ("bump = { height = 'a', amplitude = 1, channel = 'x' }", r"unknown surface.0.bump.channel 'x'; .*r, g, b"),
        ("bump = { normal_map = 'a', flip_y = 1 }", r"surface.0.bump.flip_y must be true or false; got 1"),
        ("bump = { height = 'a\\u0000', amplitude = 1 }".replace("'", '"'), r"surface.0.bump.height: .* no usable"),
    ],
)  # fmt: skip
def test_wrong_surfaces(tmp_path: Path, surface: str, said: str) -> None:
    text = f'{ENVIRONMENT}[[surface]]\nshape = {{ kind = "sphere" }}\n{surface}\n'
    assert re.match(said, refusal(tmp_path, text))


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", r'is empty; a scene needs at least a \[\[surface\]\]'),
        ("\n\n", r"is empty"),
        ("[environment]\n", r"environment.kind is missing; choose one of: sky, chrome, fractal, lat-long, cube"),
        ('environment = "a.exr"\n', r"environment must be a table with a kind, .*; got 'a.exr'"),
        ('[environment]\nkind = "latlong"\n', r"environment.kind: unknown kind 'latlong'; did you mean 'lat-long'"),
        ("[environment]\nkind = 3\n", r"environment.kind: unknown kind 3"),
        ('[environment]\nkind = "lat-long"\n', r"environment.image is missing; LatLong needs it"),
        ('[environment]\nkind = "cube"\nimage = ["a", "b"]\n', r"environment.image must be one picture or six"),
        ('[environment]\nkind = "cube"\nimage = ["a", 1]\n', r"environment.image\[1\] must be a path; got 1"),
        (ENVIRONMENT + "[enviroment]\n", r"enviroment: unknown key 'enviroment'; did you mean 'environment'"),
        (ENVIRONMENT + "[camera]\nfov = 180\n", r"camera.fov must be .* at most 179; got 180"),
        (ENVIRONMENT + "[camera]\nfov = 1e400\n", r"camera.fov must be a finite number .*; got inf"),
        (ENVIRONMENT + f"[camera]\nfov = {10**400}\n", r"camera.fov must be a finite number .*; got 1000"),
        (ENVIRONMENT + "[camera]\nprojection = 'ortho'\n", r"unknown camera.projection 'ortho'; did you mean 'orth"),
        (ENVIRONMENT + "[surface]\n", r"surface must be a list of tables, each headed \[\[surface\]\]"),
        (ENVIRONMENT + "[[surface]]\n", r"surface.0.shape is missing; Surface needs it"),
        (ENVIRONMENT + "[[surface]]\nshape = 'sphere'\n", r"surface.0.shape must be a table with a kind"),
        (ENVIRONMENT + "[[surface]]\nshape = {kind = 'spher'}\n", r"surface.0.shape.kind: .*did you mean 'sphere'"),
        (ENVIRONMENT + "[[surface]]\nshape = {kind = 'sphere', size = 1}\n", r"surface.0.shape.size: unknown key"),
        (ENVIRONMENT + "[[surface]]\nshape = {kind = 'sphere', radius = 0}\n", r"surface.0.shape.radius must be"),
        (ENVIRONMENT + '"a\\nb" = 1\n', r"environment.a b: unknown key"),
        (ENVIRONMENT + "rotation = \n", r"is not TOML: .*line 4"),
        (ENVIRONMENT + "[environment]\n", r"is not TOML: .*line 4"),
        (ENVIRONMENT + f"rotation = {'1' * 5000}\n", r"is not TOML: "),
        (ENVIRONMENT + f"rotation = {'[' * 5000}{']' * 5000}\n", r"is nested too deeply"),
        ("a = 1 # " + "x" * 4_000_000, r"is larger than 4,000,000 bytes"),
    ],
    ids=range(26),
)  # fmt: skip
def test_wrong_files(tmp_path: Path, text: str, said: str) -> None:
    assert re.match(said, refusal(tmp_path, text))


def test_files_that_are_none(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match=r"none.toml: there is no such scene file$"):
        load_scene(tmp_path / "none.toml")
    with pytest.raises(SceneError, match=r": is a folder; name the scene file in it$"):
        load_scene(tmp_path)
    (tmp_path / "latin.toml").write_bytes(b"# ok\n# caf\xe9\n")
    with pytest.raises(SceneError, match=r"latin.toml: line 2 is not UTF-8 text"):
        load_scene(tmp_path / "latin.toml")
    with pytest.raises(SceneError, match=r"there is no such scene file|cannot be read"):
        load_scene("a\0b")


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no named pipes on this system")
def test_a_pipe_is_not_waited_for(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.toml")
    with pytest.raises(SceneError, match="is no ordinary file"):
        load_scene(tmp_path / "pipe.toml")


def test_paths_stay_in_the_folder(tmp_path: Path) -> None:
    """Up, absolute, and through a link: each refused, and each allowed within `root`."""
    inner = tmp_path / "inner"
    inner.mkdir()
    (inner / "link").symlink_to(tmp_path)
    for name in ("../a.exr", str(tmp_path / "a.exr"), "link/a.exr", "x/../../a.exr"):
        text = ENVIRONMENT.replace("a.exr", name)
        said = refusal(inner, text)
        assert said.startswith(f"environment.image: {name!r} lies outside {inner}")
        assert "root=DIR" in said
        scene = load_scene(inner / "scene.toml", root=tmp_path)
        assert isinstance(scene.environment, LatLong)
        assert scene.environment.image == tmp_path / "a.exr"
        assert "lies outside" in refusal(inner, text, root=tmp_path / "other")
    # A folder whose name begins with the scene's folder's name is another folder.
    assert "lies outside" in refusal(inner, ENVIRONMENT.replace("a.exr", "../inner2/a.exr"))
    # Out and back in is in; so is an absolute path of its own.
    for name in ("../inner/a.exr", str(inner / "a.exr")):
        load_scene(write(inner, ENVIRONMENT.replace("a.exr", name)))
    mesh = ENVIRONMENT + '[[surface]]\nshape = { kind = "mesh", path = "../m.obj" }\n'
    assert refusal(inner, mesh).startswith("surface.0.shape.path: '../m.obj' lies outside")
    (inner / "round").symlink_to("round")
    load = "is no usable path|lies outside" if os.name == "nt" else "no usable path"
    assert re.search(load, refusal(inner, ENVIRONMENT.replace("a.exr", "round/a.exr")))


def test_relative_to_the_file_not_to_the_working_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    inner = tmp_path / "inner"
    inner.mkdir()
    write(inner, ENVIRONMENT)
    monkeypatch.chdir(tmp_path)
    environment = load_scene("inner/scene.toml").environment
    assert isinstance(environment, LatLong)
    assert environment.image == inner / "a.exr"


def test_saving_far_paths(tmp_path: Path) -> None:
    """What lies elsewhere is written absolute, and read back where the caller allows it."""
    (tmp_path / "inner").mkdir()
    scene = Scene([], LatLong(tmp_path / "a.exr"))
    save_scene(scene, tmp_path / "inner" / "s.toml")
    with pytest.raises(SceneError, match="lies outside"):
        load_scene(tmp_path / "inner" / "s.toml")
    assert load_scene(tmp_path / "inner" / "s.toml", root=tmp_path) == scene


def test_saving_refuses_and_leaves_nothing(tmp_path: Path) -> None:
    scene = Scene([Surface(Sphere(), bump=Bump(np.zeros((4, 4)), 1))], LatLong("a.exr"))
    with pytest.raises(SceneError, match=r"^surface\.0\.bump\.height holds an array, .*write it to a picture file"):
        save_scene(scene, tmp_path / "s.toml")
    with pytest.raises(SceneError, match="no UTF-8 text"):
        save_scene(Scene([], LatLong("a\udcff.exr")), tmp_path / "s.toml")
    assert list(tmp_path.iterdir()) == []
    with pytest.raises(SceneError, match="there is no directory"):
        save_scene(Scene([], LatLong("a.exr")), tmp_path / "no" / "s.toml")


def test_a_mesh_of_arrays_is_for_python_alone(tmp_path: Path) -> None:
    scene = Scene([Surface(MeshData(np.eye(3), [(0, 1, 2)]))])
    with pytest.raises(SceneError, match=r"^surface\.0\.shape holds a mesh of arrays, .*write it to a mesh file"):
        save_scene(scene, tmp_path / "scene.toml")
    assert not (tmp_path / "scene.toml").exists()
    # Other values of such a scene can be set all the same.
    changed = set_from_text(scene, "surface.0.material.metallic=0.5")
    assert changed.surfaces[0].shape is scene.surfaces[0].shape
    with pytest.raises(SceneError, match=r"unknown kind 'mesh-data'"):
        set_from_text(scene, 'surface.0.shape={ kind = "mesh-data" }')


# One value from text.

BASE = Scene([Surface(Sphere(), bump=Bump("b.png", 0.1)), Surface(Plane())], LatLong("a.exr"))


@pytest.mark.parametrize(
    ("text", "read"),
    [
        ("surface.0.bump.amplitude=0.5", lambda s: s.surfaces[0].bump.amplitude == 0.5),
        ("surface.0.bump.repeat = [8, 4]", lambda s: s.surfaces[0].bump.repeat == (8, 4)),
        ("surface.0.bump.repeat=3", lambda s: s.surfaces[0].bump.repeat == (3, 3)),
        ("surface.0.bump.height=other brick.png", lambda s: s.surfaces[0].bump.height == Path("other brick.png")),
        ("surface.0.bump.height=../up/x=1.png", None),
        ('surface.0.bump.height="../up/x=1.png"', lambda s: s.surfaces[0].bump.height == Path("../up/x=1.png")),
        ("surface.1.shape.size.0=7", lambda s: s.surfaces[1].shape == Plane((7, 2))),
        ("surface.1.shape={ kind = 'torus' }", lambda s: s.surfaces[1].shape == Torus()),
        ("surface.0.shape.kind=torus", lambda s: s.surfaces[0].shape == Torus(1)),
        ("surface.1.bump={ normal_map = 'n.png' }", lambda s: s.surfaces[1].bump == NormalMap("n.png")),
        ("environment.lookup=normal", lambda s: s.environment.lookup == "normal"),
        ("environment.background=false", lambda s: s.environment.background is False),
        ("camera.near=0.5", lambda s: s.camera.near == 0.5),
        ("camera.eye.2=9", lambda s: s.camera.eye == (0, 0, 9)),
    ],
)  # fmt: skip
def test_set_from_text(text: str, read: Any) -> None:
    if read is None:
        with pytest.raises(SceneError, match="is no TOML value, word or path"):
            set_from_text(BASE, text)
        return
    scene = set_from_text(BASE, text)
    assert read(scene)
    assert not read(BASE)


def test_set_keeps_all_else() -> None:
    scene = Scene([Surface(Sphere(), bump=Bump(np.eye(4), 0.1))], CubeMap(["1", "2", "3", "4", "5", "6"]))
    assert set_from_text(scene, "camera.fov=40") == scene


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("surface.0.bump.amplitude", r"cannot set .*; write NAME=VALUE, such as"),
        ("=1", r"write NAME=VALUE"),
        ("camera.fov=", r"write NAME=VALUE"),
        ("camera.fov=1\ncamera.near=2", r"is no TOML value"),
        ("camera.fov=wide", r"camera.fov must be .*; got 'wide'"),
        ("camera.fow=3", r"camera.fow: unknown key 'fow'; did you mean 'fov'"),
        ("surface.0.materal.metallic=1", r"surface.0.materal: unknown key 'materal'; did you mean 'material'"),
        ("surface.2.material.metallic=1", r"surface.2.material.metallic: no item '2'; there are 2, counted from 0"),
        ("surface.x=1", r"no item 'x'"),
        ("camera.fov.x=1", r"camera.fov.x: there is no 'x' inside a single value, 40.0"),
        ("surface.1.bump.amplitude=1", r"surface.1.bump needs a height or a normal_map"),
        ("surface.0.bump.normal_map=n.png", r"surface.0.bump has both"),
        ("camera.fov=" + "[" * 5000, r"cannot set camera.fov"),
        ("", r"write NAME=VALUE"),
    ],
    ids=range(14),
)  # fmt: skip
def test_set_from_text_refuses(text: str, said: str) -> None:
    with pytest.raises(SceneError) as caught:
        set_from_text(BASE, text)
    assert re.search(said, str(caught.value))
    assert "\n" not in str(caught.value)


def test_another_kind_leaves_the_settings_of_the_old_one_behind() -> None:
    scene = Scene([Surface(Sphere(radius=2))], LatLong("a.exr", rotation=30))
    changed = set_from_text(scene, "environment.kind=chrome", "environment.bands=5", "surface.0.shape.kind=cube")
    # What both have stays.
    assert changed.environment == Chrome(bands=5, rotation=30)
    assert changed.surfaces[0].shape == Cube()
    with pytest.raises(SceneError, match=r"environment\.kind: unknown kind 'chrom'; did you mean 'chrome'"):
        set_from_text(scene, "environment.kind=chrom")
