"""The folder of a trade: rows are kept whole, runs go on, and other scenes' folders are left alone."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from glbump.environment import LatLong, Sky
from glbump.errors import GlbumpError
from glbump.scene import Material, Scene, Surface
from glbump.shapes import MeshData, Sphere
from glbump.trade.errors import Bounds
from glbump.trade.results import ROWS, Results, digest, scene_key
from glbump.trade.truth import DRIVER, Truth

SCENE = Scene([Surface(Sphere())], Sky())


def test_rows_come_back(tmp_path: Path) -> None:
    with_nan = Results(tmp_path / "a" / "b", "s").add({"key": "k", "value": np.float32(2), "none": float("nan")})
    assert with_nan == {"key": "k", "value": 2.0, "none": None, "scene": "s"}
    assert Results(tmp_path / "a" / "b", "s").get("k") == with_nan
    assert Results(tmp_path / "a" / "b", "s").get("other") is None


def test_half_a_line_is_taken_away_and_the_rest_kept(tmp_path: Path) -> None:
    Results(tmp_path, "s").add({"key": "k"})
    file = tmp_path / ROWS
    file.write_bytes(file.read_bytes() + b'{"key": "half", "sce')
    results = Results(tmp_path, "s")
    assert results.get("k") is not None
    results.add({"key": "next"})
    assert len(file.read_bytes().splitlines()) == 2
    assert Results(tmp_path, "s").get("next") is not None


def test_another_scenes_folder_is_refused(tmp_path: Path) -> None:
    Results(tmp_path, "s").add({"key": "k"})
    before = (tmp_path / ROWS).read_bytes()
    with pytest.raises(GlbumpError, match=r"another scene.*another folder"):
        Results(tmp_path, "other")
    assert (tmp_path / ROWS).read_bytes() == before


@pytest.mark.parametrize("line", ["no JSON", "[]", '{"key": "k"}', "null"])
def test_what_is_no_row_is_said(tmp_path: Path, line: str) -> None:
    (tmp_path / ROWS).write_text(line + "\n")
    with pytest.raises(GlbumpError, match="line 1 is no row of a trade"):
        Results(tmp_path, "s")


def test_a_folder_that_cannot_be_is_said(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(GlbumpError, match="cannot be made"):
        Results(tmp_path / "file" / "below", "s")
    (tmp_path / "taken" / ROWS).mkdir(parents=True)
    with pytest.raises(GlbumpError, match="is a directory"):
        Results(tmp_path / "taken", "s")


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write anywhere")
def test_an_unwritable_folder_is_said(tmp_path: Path) -> None:
    tmp_path.chmod(0o500)
    with pytest.raises(GlbumpError):
        Results(tmp_path, "s")


def test_the_truth_is_kept_and_a_damaged_one_found_anew(tmp_path: Path) -> None:
    pixels = np.random.default_rng(1).uniform(0, 2, (4, 6, 4)).astype(np.float32)
    truth = Truth(pixels, DRIVER, 16, 0.001, pixels[..., 0] > 1, pixels / 2, Bounds(0.1, 0.05, 0.2), 9, ("a note",))
    results = Results(tmp_path, "s")
    asked = []

    def find() -> Truth:
        asked.append(1)
        return truth

    for _ in range(2):
        got = results.truth("k", find)
        np.testing.assert_array_equal(got.pixels, truth.pixels)
        np.testing.assert_array_equal(got.several, truth.several)
        np.testing.assert_array_equal(got.normals, truth.normals)
        assert replace(got, pixels=pixels, several=truth.several, normals=truth.normals) == truth
    assert len(asked) == 1
    bare = replace(truth, several=None, normals=None)
    for find_bare in (lambda: bare, find):
        got = results.truth("bare", find_bare)
        assert got.several is got.normals is None
    assert len(asked) == 1
    file = tmp_path / "truth-k.npz"
    file.write_bytes(file.read_bytes()[:100])
    results.truth("k", find)
    assert len(asked) == 2


def test_a_scene_is_known_by_what_it_says_and_what_its_files_hold(tmp_path: Path) -> None:
    assert scene_key(SCENE) == scene_key(Scene([Surface(Sphere())], Sky()))
    assert scene_key(SCENE) != scene_key(Scene([Surface(Sphere(radius=1.1))], Sky()))
    assert scene_key(SCENE) != scene_key(Scene([Surface(Sphere(), Material(roughness=0.1))], Sky()))
    picture = np.zeros((4, 8, 3), np.float32)
    assert scene_key(Scene([], LatLong(picture))) == scene_key(Scene([], LatLong(picture.copy())))
    assert scene_key(Scene([], LatLong(picture))) != scene_key(Scene([], LatLong(picture + 1)))
    corners = np.eye(3)
    mesh = [MeshData(corners * size, [[0, 1, 2]]) for size in (1, 1, 2)]
    keys = [scene_key(Scene([Surface(m)])) for m in mesh]
    assert keys[0] == keys[1] != keys[2]
    for name in ("here.exr", "there.exr"):
        (tmp_path / name).write_bytes(b"one")
    here, there = (Scene([], LatLong(tmp_path / name)) for name in ("here.exr", "there.exr"))
    assert scene_key(here) == scene_key(there)
    (tmp_path / "there.exr").write_bytes(b"two")
    assert scene_key(here) != scene_key(there)


def test_digests_do_not_hang_on_order() -> None:
    assert digest({"a": 1, "b": (2, np.float64(3))}) == digest({"b": [2, 3.0], "a": 1})
    assert digest({"a": 1}) != digest({"a": 2})
