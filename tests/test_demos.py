"""The scripts of demos/ run, small; and what the package's own demo is made of."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import glbump as gb
from glbump.demo import EXHIBITS, chosen, gallery, letters, panorama, relief, room, write_maps
from glbump.demo.knot import knot
from glbump.errors import SceneError
from glbump.maps.images import read_colour, read_height, read_normals
from glbump.maps.layout import latlong_dir, sample
from glbump.maps.noise import fractal, value_noise
from glbump.quality import KNOBS

DEMOS = Path(__file__).parents[1] / "demos"


@pytest.mark.parametrize(
    ("script", "arguments", "made"),
    [
        ("ball.py", ("48",), ["ball.png"]),
        ("turntable.py", ("32", "3"), ["frame-000.png", "frame-001.png", "frame-002.png"]),
        ("how_far_off.py", ("24",), []),
    ],
)
def test_script_runs(script: str, arguments: tuple[str, ...], made: list[str], tmp_path: Path) -> None:
    # The panorama takes seconds to compute and nothing here looks at it: a small one stands in.
    code = (
        "import sys, runpy; from glbump.demo import panorama; small = panorama.evening(32)\n"
        "panorama.evening = lambda: small\n"
        "sys.argv = sys.argv[1:]; runpy.run_path(sys.argv[0], run_name='__main__')"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, str(DEMOS / script), str(tmp_path), *arguments],
        capture_output=True,
        text=True,
        check=False,
        stdin=subprocess.DEVNULL,
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout
    frames = [read_colour(tmp_path / name).pixels for name in made]
    assert all(np.ptp(frame) > 0.1 for frame in frames)
    # A turntable turns.
    assert len({frame.tobytes() for frame in frames}) == len(frames)


def test_every_script_is_run_here() -> None:
    marks = test_script_runs.pytestmark  # type: ignore[attr-defined]
    assert {p.name for p in DEMOS.glob("*.py")} == {case[0] for case in marks[0].args[1]}


# -------------------------------------------------------------------------------------------------- the gallery


def test_gallery_has_enough_and_names_are_files() -> None:
    names = [exhibit.name for exhibit in EXHIBITS]
    assert len(set(names)) == len(names) >= 10
    assert all(name == name.lower() and name.replace("-", "").isalnum() for name in names)
    assert chosen() == EXHIBITS
    assert [e.name for e in chosen(["axes", "lake"])] == ["axes", "lake"]
    with pytest.raises(SceneError, match="did you mean 'lake'"):
        chosen(["lak"])


@pytest.mark.parametrize("exhibit", EXHIBITS, ids=lambda e: e.name)
def test_scene_can_be_saved_and_needs_what_is_made(exhibit: gallery.Exhibit, tmp_path: Path) -> None:
    scene = exhibit.scene(tmp_path / "maps")
    gb.save_scene(scene, tmp_path / "scene.toml")
    assert gb.load_scene(tmp_path / "scene.toml") == scene
    assert gallery.maps_of(scene) <= set(gallery.MAPS)


def test_panels_are_side_by_side(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each row of panels is a row of the picture, drawn with its own quality; together they are as large as it is."""
    monkeypatch.setattr(gallery, "write_maps", lambda *_: None)
    exhibit = next(e for e in EXHIBITS if e.name == "kernels")
    asked: list[str] = []

    def draw(scene: gb.Scene, size: tuple[int, int], quality: gb.Quality) -> gb.Frame:
        asked.append(quality.bump_kernel)
        grey = len(asked) / 8
        return gb.Frame(np.full((size[1], size[0], 4), (grey, grey, grey, 1), np.float32))

    (tmp_path / "scenes").mkdir()
    ((path, _),) = gallery.write_gallery(tmp_path, [exhibit], draw, "fast")
    assert sorted(asked) == sorted(KNOBS["bump_kernel"].values)
    pixels = read_colour(path).pixels
    assert pixels.shape[1::-1] == exhibit.size
    steps = pixels[::280, ::280, 0].reshape(-1)
    assert (np.diff(steps) > 0).all()


def test_every_map_is_used(tmp_path: Path) -> None:
    used = set().union(*(gallery.maps_of(e.scene(tmp_path)) for e in EXHIBITS))
    assert used == set(gallery.MAPS)


# -------------------------------------------------------------------------------------------------- its maps


def test_written_maps_pass_glbumps_own_checks(tmp_path: Path) -> None:
    heights = ["bricks.exr", "dimples.exr", "waves.exr", "stone.exr", "weave.exr"]
    write_maps(tmp_path, [*heights, "quilt.png", "axes.png", "knot.obj"])
    for name in heights:
        pixels = read_height(tmp_path / name).pixels
        assert (pixels.min(), pixels.max()) == (pytest.approx(0, abs=1e-6), pytest.approx(1, abs=1e-6))
    lengths = np.linalg.norm(read_normals(tmp_path / "quilt.png").pixels, axis=-1)
    assert np.abs(lengths - 1).max() < 0.01  # half a step of 8 bits in each of three channels: sqrt(3) / 254
    assert read_colour(tmp_path / "axes.png").pixels.shape == (6 * 256, 256, 3)
    assert gb.MeshFile(tmp_path / "knot.obj").path.read_text() == knot()


def test_the_room_is_where_its_bounds_are() -> None:
    seen = room.room(128)
    x, y, z = room.HALF
    # The middles of two tiles of the floor, dark and light, and the lamp.
    dark, light = sample(seen, [(0.75, -y, 1.25), (1.25, -y, 1.25)])
    assert light.min() > 3 * dark.max()
    assert sample(seen, (0.3, y, 0.3)).min() > 5
    # Each wall has its own colour, the window is in the one on the left.
    red, blue = sample(seen, [(x, 0.9, 0), (-x, 0.9, 0)])
    assert red.argmax() == 0
    assert blue.argmax() == 2
    assert sample(seen, (-x, 0.3, -1.8)).min() > 2
    assert sample(seen, (-x, 0.3, 1.8)).max() < 1
    # "-Z" begins with the minus: nothing is mirrored.
    right, up = np.meshgrid(np.linspace(-0.5, 0.5, 100), np.linspace(-0.1, 0.5, 60))
    written = sample(seen, np.stack([right, up, np.full_like(up, -z)], axis=-1))[..., 2] > 0.15
    assert written[:, :50].any(axis=1).sum() < written[:, 50:].any(axis=1).sum()


@pytest.mark.parametrize("name", ["bricks", "dimples", "waves", "stone", "weave", "quilt"])
def test_heights_repeat_without_a_seam(name: str) -> None:
    height = getattr(relief, name)(128)
    for axis in (0, 1):
        across = np.abs(np.diff(height, axis=axis)).mean(axis=1 - axis)
        seam = np.abs(np.take(height, 0, axis) - np.take(height, -1, axis)).mean()
        # The step over the seam is like the steps inside; cut a row off and it is not.
        assert seam <= 1.5 * across.max()


def test_noise_is_seeded_smooth_and_periodic() -> None:
    x = np.linspace(0, 8, 801, dtype=np.float32)
    y = np.full_like(x, 0.3)
    noise = value_noise(x, y, 8, 1)
    assert np.array_equal(noise, value_noise(x, y, 8, 1))
    assert not np.array_equal(noise, value_noise(x, y, 8, 2))
    assert noise[0] == noise[-1]
    # The steepest a quintic fade gets is 15/8 of the step between neighbours, at most 2, over 0.01.
    assert np.abs(np.diff(noise)).max() <= 15 / 8 * 2 * 0.01 * 1.01
    assert np.abs(fractal(x, y, 8, 6, 1)).max() <= 1


def test_quilt_normals_are_of_the_heights() -> None:
    ramp = np.tile(np.linspace(0, 1, 64, endpoint=False, dtype=np.float32), (64, 1))
    n = relief.normals(ramp, depth=0.5).astype(float)[:, 10:50]
    # Rising to the right by 0.5 per tile leans the normal to the left by atan(0.5).
    assert np.abs(np.arctan2(128 - n[..., 0], n[..., 2] - 128) - np.arctan(0.5)).max() < 0.01
    assert (n[..., 1] == 128).all()


# -------------------------------------------------------------------------------------------------- its panorama


@pytest.fixture(scope="module")
def evening() -> np.ndarray:
    return panorama.evening(128)


def test_panorama_is_light(evening: np.ndarray) -> None:
    assert evening.shape == (128, 256, 3)
    assert evening.dtype == np.float32
    assert np.isfinite(evening).all()
    assert (evening > 0).all()
    assert evening.max() < 65504  # fits half floats
    assert np.array_equal(evening, panorama.evening(128))


def test_sun_is_where_it_says(evening: np.ndarray) -> None:
    row, column = np.unravel_index(evening.sum(axis=-1).argmax(), evening.shape[:2])
    seen = latlong_dir(np.array([(column + 0.5) / 256, (row + 0.5) / 128]))
    sun = panorama.direction(panorama.SUN_AZIMUTH, panorama.SUN_ELEVATION)
    assert np.degrees(np.arccos(min(float(seen @ sun), 1.0))) < 2  # a texel is 1.4 degrees


def test_panorama_has_no_seam(evening: np.ndarray) -> None:
    log = np.log(evening.mean(axis=-1))
    steps = np.abs(np.diff(log, axis=1)).mean(axis=0)
    assert np.abs(log[:, 0] - log[:, -1]).mean() <= 2 * np.median(steps)


# -------------------------------------------------------------------------------------------------- its mesh and cube


def test_knot_is_a_closed_tube_seen_from_outside() -> None:
    lines = [line.split() for line in knot(48, 8).splitlines()]
    points = np.array([line[1:] for line in lines if line[0] == "v"], dtype=float)
    normals = np.array([line[1:] for line in lines if line[0] == "vn"], dtype=float)
    faces = np.array([[int(c.split("/")[0]) - 1 for c in line[1:]] for line in lines if line[0] == "f"])
    a, b, c = np.moveaxis(points[faces], 1, 0)
    across = np.cross(b - a, c - a)
    assert (np.linalg.norm(across, axis=1) > 1e-6).all()
    assert ((across * normals[faces].mean(axis=1)).sum(axis=1) > 0).all()
    # Closed: every edge of the welded mesh has a partner in the other direction.
    _, welded = np.unique(points.round(5), axis=0, return_inverse=True)
    edges = [(f[i], f[(i + 1) % 3]) for f in welded.ravel()[faces].tolist() for i in range(3)]
    assert len(set(edges)) == len(edges)
    assert {(q, p) for p, q in edges} == set(edges)


def test_axes_are_six_different_faces() -> None:
    faces = letters.axes(32).reshape(6, 32, 32, 3)
    assert len({tuple(face[4, 6].round(3)) for face in faces}) == 6
    # "-X" is written unmirrored: the long stroke on the left, the crossing of the X on the right.
    face = letters.axes(128).reshape(6, 128, 128, 3)[1]
    ink = (face[round(0.27 * 128)] > 0.9).all(axis=-1)
    assert ink[8:64].sum() > 3 * ink[64:120].sum() > 0
