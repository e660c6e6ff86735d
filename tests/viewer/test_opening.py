"""What files are recognised as, and the scenes that are made of them; without a window."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import glbump as gb
from glbump.contents import Contents
from glbump.maps.files import write_display, write_picture
from glbump.viewer import exports, opening
from glbump.viewer.actions import ACTIONS, help_rows

RNG = np.random.default_rng(5)
COLOURS = RNG.uniform(0, 1, (16, 32, 3)).astype(np.float32)
PLANE = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n"


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A quick evening, in a cache of the test's own."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setattr("glbump.demo.write_maps", lambda folder, names: _write(folder, names))


def _write(folder: Path, names: list[str]) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    for name in names:
        write_picture(folder / name, COLOURS)


def files(folder: Path) -> dict[str, Path]:
    """One file of each kind."""
    normals = np.full((8, 8, 3), (128, 128, 255), np.uint8)
    grey = RNG.integers(0, 256, (8, 8, 1), np.uint8)
    write_picture(folder / "place.exr", COLOURS)
    write_display(folder / "grey.png", grey)
    write_display(folder / "flat.png", normals, srgb=False)
    write_picture(folder / "cross.exr", np.pad(RNG.uniform(0.5, 1, (8, 8, 3)), ((8, 8), (8, 16), (0, 0))).astype("f4"))
    (folder / "tri.obj").write_text(PLANE)
    (folder / "a.toml").write_text('[environment]\nkind = "sky"\n')
    return {path.name: path for path in folder.iterdir() if path.is_file()}


def test_each_kind_is_recognised_and_makes_its_scene(tmp_path: Path) -> None:
    found = files(tmp_path)
    contents = Contents()
    kinds = {name: opening.kind_of(path)[0] for name, path in found.items()}
    assert kinds == {
        "place.exr": opening.PANORAMA,
        "cross.exr": opening.PANORAMA,
        "grey.png": opening.HEIGHTS,
        "flat.png": opening.NORMALS,
        "tri.obj": opening.MESH,
        "a.toml": opening.SCENE,
    }
    made = {name: opening.opened(path, contents) for name, path in found.items()}
    ball = made["place.exr"].scene
    assert isinstance(ball.environment, gb.LatLong)
    assert isinstance(ball.surfaces[0].shape, gb.Sphere)
    assert ball.surfaces[0].material.metallic == 1
    assert ball.surfaces[0].material.roughness == 0
    assert isinstance(made["cross.exr"].scene.environment, gb.CubeMap)
    for name, kind in (("grey.png", gb.Bump), ("flat.png", gb.NormalMap)):
        shapes = [type(s.shape) for s in made[name].scene.surfaces]
        assert shapes == [gb.Torus, gb.Plane]
        assert all(isinstance(s.bump, kind) for s in made[name].scene.surfaces)
    assert isinstance(made["tri.obj"].scene.surfaces[0].shape, gb.MeshFile)
    assert made["a.toml"].file == tmp_path / "a.toml"
    assert made["a.toml"].scene == gb.load_scene(tmp_path / "a.toml")


def test_heights_in_floats_are_as_steep_as_others(tmp_path: Path) -> None:
    """Metres, of which no file says so: their whole range is a twentieth of the tile."""
    metres = RNG.uniform(100, 900, (8, 8)).astype(np.float32)
    write_picture(tmp_path / "height.exr", metres[..., None])
    bump = opening.bump_in(tmp_path / "height.exr", opening.HEIGHTS, width=2.0)
    assert isinstance(bump, gb.Bump)
    assert bump.amplitude * np.ptp(metres) == pytest.approx(0.05 * 2.0)
    write_picture(tmp_path / "height.exr", np.ones((8, 8, 1), np.float32))
    assert opening.bump_in(tmp_path / "height.exr", opening.HEIGHTS, width=2.0).amplitude == pytest.approx(0.1)


def test_what_is_dropped_becomes_a_part_of_the_scene(tmp_path: Path) -> None:
    found, contents = files(tmp_path), Contents()
    balls = [gb.Surface(gb.Sphere(), bump=gb.Bump(found["grey.png"], 0.1, (4, 2))), gb.Surface(gb.Sphere(2))]
    before = gb.Scene(balls)
    after = opening.dropped(found["place.exr"], before, 1, contents)
    assert after.environment == gb.LatLong(found["place.exr"])
    assert after.surfaces == before.surfaces
    after = opening.dropped(found["grey.png"], before, 1, contents)
    assert after.surfaces[0] == before.surfaces[0]
    bump = after.surfaces[1].bump
    assert bump == gb.Bump(found["grey.png"], bump.amplitude)
    assert bump.amplitude == pytest.approx(0.05 * 2.0)
    after = opening.dropped(found["flat.png"], before, 0, contents)
    assert after.surfaces[0].bump == gb.NormalMap(found["flat.png"], repeat=(4, 2))
    after = opening.dropped(found["tri.obj"], before, 0, contents)
    assert [s.shape for s in after.surfaces] == [gb.MeshFile(found["tri.obj"])]
    assert after.environment == before.environment


def test_a_mesh_without_u_and_v_takes_heights_from_three_sides(tmp_path: Path) -> None:
    found, contents = files(tmp_path), Contents()
    (tmp_path / "bare.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    bare = gb.Scene([gb.Surface(gb.MeshFile(tmp_path / "bare.obj"))])
    bump = opening.dropped(found["grey.png"], bare, 0, contents).surfaces[0].bump
    assert bump.mapping == "triplanar"
    with pytest.raises(gb.MeshError, match="normal maps need u and v"):
        opening.dropped(found["flat.png"], bare, 0, contents)
    with pytest.raises(gb.SceneError, match="no surface here"):
        opening.dropped(found["grey.png"], gb.Scene([]), 0, contents)


@pytest.mark.parametrize(
    ("name", "content", "says"),
    [
        ("notes.txt", b"hello", "scenes are .toml, meshes .obj .ply .stl .glb, all others pictures"),
        ("broken.exr", b"v/1\x01\0", "broken.exr"),
        ("empty.png", b"", "empty.png"),
        ("broken.obj", b"f 1 2 3\n", "broken.obj"),
        ("broken.toml", b"= = =", "is not TOML"),
        ("gone.png", None, "gone.png"),
        ("gone.obj", None, "gone.obj"),
        ("folder", {}, "six faces"),
    ],
)
def test_files_that_are_none_of_the_kinds(tmp_path: Path, name: str, content: bytes | dict | None, says: str) -> None:
    path = tmp_path / name
    if isinstance(content, bytes):
        path.write_bytes(content)
    elif content is not None:
        path.mkdir()
    with pytest.raises(gb.GlbumpError) as raised:
        opening.opened(path, Contents())
    assert says in str(raised.value)
    assert "\n" not in str(raised.value)


def test_a_photograph_is_no_kind_and_what_would_make_it_one_is_said(tmp_path: Path) -> None:
    write_display(tmp_path / "photo.png", RNG.integers(0, 256, (30, 40, 3), np.uint8))
    with pytest.raises(gb.ImageError, match="env, height or normal"):
        opening.opened(tmp_path / "photo.png", Contents())


def test_the_gallery_is_that_of_the_demo() -> None:
    from glbump.demo import EXHIBITS

    subjects = [show(Contents()) for show in opening.gallery()[:2]]
    assert [s.name for s in subjects] == [e.name for e in EXHIBITS[:2]]
    assert len(opening.gallery()) == len(EXHIBITS)


def test_saved_scenes_are_whole(tmp_path: Path) -> None:
    """What lies elsewhere is copied, each file once, under names of its own."""
    for folder in ("one", "two", "out"):
        (tmp_path / folder).mkdir()
    for i, folder in enumerate(("one", "two")):
        write_display(tmp_path / folder / "h.png", np.full((4, 4, 1), 100 * i, np.uint8))
    bumps = [gb.Bump(tmp_path / folder / "h.png", 0.1) for folder in ("one", "two", "one")]
    content = gb.Scene([gb.Surface(gb.Sphere(), bump=bump) for bump in bumps])
    path = exports.save_with_files(content, tmp_path / "out" / "a.toml")
    again = gb.load_scene(path)
    names = [surface.bump.height for surface in again.surfaces]
    assert names[0] == names[2] != names[1]
    for name, folder in zip(names, ("one", "two")):
        assert name.read_bytes() == (tmp_path / folder / "h.png").read_bytes()
    assert exports.free_name(tmp_path / "out", "a", ".toml").name == "a-2.toml"


def test_the_table_of_keys_is_whole() -> None:
    import glfw

    keys = [key for action in ACTIONS for key in action.keys]
    assert len(set(keys)) == len(keys), "one key, one deed"
    for key in keys:
        assert hasattr(glfw, f"KEY_{key.removeprefix('ctrl+').upper()}"), key
    rows = help_rows()
    assert all(pressed and says for pressed, says in rows)
    text = " ".join(pressed for pressed, _ in rows)
    assert "Page Down / N,  Page Up / P" in text
    assert "_" not in text


def test_quads_hold_their_pixel() -> None:
    """Whole quads from the lower left corner, cut off by the picture's other sides."""
    from glbump.viewer.inspecting import quad

    for size in ((4, 4), (5, 3), (1, 1), (2, 7)):
        for x in range(size[0]):
            for y in range(size[1]):
                left, top, width, height = quad(x, y, size)
                assert left <= x < left + width <= size[0]
                assert top <= y < top + height <= size[1]
                assert left % 2 == 0
                assert (size[1] - top - height) % 2 == 0
