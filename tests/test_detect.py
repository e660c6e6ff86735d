"""What a picture holds, by its header, its shape and its content; and which files hold which face."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from glbump.errors import ImageError
from glbump.maps.detect import detect
from glbump.maps.facefiles import STYLES, face_files, face_named, faces_by_name
from glbump.maps.images import read_colour
from glbump.maps.layout import CUBE, LAYOUTS, EnvironmentMap, inside, texel_dirs
from glbump.maps.pictured import environment_of, picture_of
from glbump.maps.unfolding import UNFOLDINGS

DATA = Path(__file__).parents[2] / "shared" / "data"
RNG = np.random.default_rng(9)
TURN = RNG.normal(size=(3, 3)) * 2


def radiance(dirs: Any) -> Any:
    return (1.5 + np.sin(dirs @ TURN + (0.3, 1.1, 2.0)) + 0.3 * dirs).astype(np.float32)


def picture(pixels: Any, envmap: str | None = None) -> Any:
    return SimpleNamespace(pixels=np.asarray(pixels, np.float32), envmap=envmap, name="test.png", clear=None)


def drawn(name: str, size: int = 32) -> Any:
    """A picture in this layout; what is no part of it is black."""
    layout = UNFOLDINGS[name].layout if name in UNFOLDINGS else LAYOUTS[name]
    _, height, width = layout.shape(size)
    pixels = radiance(texel_dirs(layout, (width, height)))
    pixels[:, ~inside(layout, (width, height))] = 0
    return picture_of(EnvironmentMap(layout, pixels), name)


@pytest.mark.parametrize("name", ["lat-long", "octahedral", "dual-paraboloid", *UNFOLDINGS])
def test_what_is_sure(name: str) -> None:
    found = detect(picture(drawn(name)))
    assert (found.layout, found.is_sure) == (name, True)


def test_headers_come_first() -> None:
    column = drawn("vstrip")
    assert detect(picture(column, "cube"))[:2] == ("vstrip", "inside")
    assert detect(picture(column, "faces"))[:2] == ("vstrip", "opengl")
    assert detect(picture(np.zeros((8, 16, 3)), "latlong"))[0] == "lat-long"
    assert detect(picture(np.zeros((6, 4, 4, 3))))[0] == "faces"


@pytest.mark.parametrize("name", ["equal-area", "equidistant", "orthographic", "angular", "mirror-ball"])
def test_a_disc_is_taken_for_a_light_probe(name: str) -> None:
    found = detect(picture(drawn(name)))
    assert (found.layout, found.is_sure) == ("angular", False)
    assert name == "angular" or name in found.why


def test_corners_of_any_one_colour_are_empty() -> None:
    """White, and black with the noise of a JPEG."""
    disc = drawn("angular", 64)
    outside = np.hypot(*np.mgrid[-31.5:32, -31.5:32]) > 32
    for corners in (1.0, np.abs(RNG.normal(size=(outside.sum(), 3))) * 0.005):
        disc[outside] = corners
        assert detect(picture(disc)).layout == "angular"
    disc[outside] = RNG.uniform(size=(outside.sum(), 3))
    assert detect(picture(disc)).layout != "angular"
    noise = RNG.uniform(size=(64, 64, 3))
    assert detect(picture(noise))[::3] == ("lat-long", False)


def test_a_cross_with_something_in_its_corners_is_doubted() -> None:
    cross = drawn("hcross")
    cross[:32, :32] = RNG.uniform(size=(32, 32, 3))
    assert detect(picture(cross))[::3] == ("hcross", False)
    environment = environment_of(picture(cross))
    assert any("corners of this hcross are not empty" in note for note in environment.notes)
    assert np.array_equal(environment.pixels, environment_of(picture(drawn("hcross"))).pixels)


def test_a_photograph_that_is_no_environment_is_doubted() -> None:
    """4:3, as cameras have it."""
    noise = RNG.uniform(size=(48, 64, 3))
    environment = environment_of(picture(noise))
    assert any("taken as hcross" in note for note in environment.notes)
    assert any("is it a cube?" in note for note in environment.notes) or environment.layout is CUBE


def test_plain_pictures() -> None:
    """A constant shows no corners, no rim and no edges."""
    assert detect(picture(np.ones((8, 8, 3)))).layout == "octahedral"
    assert detect(picture(np.zeros((8, 16, 3)))).layout == "lat-long"
    assert detect(picture(np.ones((1, 1, 3)))).layout == "octahedral"
    assert detect(picture(np.ones((2, 1, 3))))[::3] == ("lat-long", False)
    assert detect(picture(np.ones((5, 7, 3))))[::3] == ("lat-long", False)


@pytest.mark.parametrize(
    ("file", "layout"),
    [
        ("openexr/KernerEnvCube", "vstrip"),
        ("openexr/KernerEnvLatLong", "lat-long"),
        ("openexr/OrientationCube", "vstrip"),
        ("openexr/OrientationLatLong", "lat-long"),
        ("cc0/venice", "lat-long"),
        ("cc0/workshop", "lat-long"),
    ],
)
def test_shipped_files(file: str, layout: str) -> None:
    path = DATA / f"{file}.exr"
    if not path.exists():
        pytest.skip(f"needs ../shared/data/{file}.exr beside the repository")
    found = detect(read_colour(path))
    assert (found.layout, found.is_sure) == (layout, True)
    assert environment_of(read_colour(path)).notes == ()


# ------------------------------------------------------------ files of one face each


@pytest.mark.parametrize(
    ("name", "style", "face"),
    [
        ("posx.jpg", 0, 0),
        ("Sky_NegZ.PNG", 0, 5),
        ("a.b/venice-py.exr", 1, 2),
        ("apx.png", 1, None),
        ("px.png", 1, 0),
        ("sky+y.png", 2, 2),
        ("sky_-z.png", 2, 5),
        ("front.png", 3, 4),
        ("Church Left.tga", 3, 1),
        ("upright.png", 3, None),
        ("venice.exr", 3, None),
    ],
)
def test_names_name_faces(name: str, style: int, face: int | None) -> None:
    assert face_named(name, STYLES[style]) == face


def test_faces_by_name_want_each_face_once() -> None:
    names = ["a_nx.png", "a_px.png"]
    assert faces_by_name(names, STYLES[1]) == {1: 0, 0: 1}
    assert faces_by_name([*names, "b_px.png"], STYLES[1]) is None
    assert faces_by_name([*names, "other.png"], STYLES[1]) is None
    assert faces_by_name(names, STYLES[0]) is None


@pytest.mark.parametrize("style", STYLES)
def test_a_folder_and_a_pattern(style: tuple[str, ...], tmp_path: Path) -> None:
    wanted = tuple(tmp_path / f"sky_{word}.png" for word in style)
    for file in wanted:
        file.touch()
    for other in ("readme.txt", "preview.png"):
        (tmp_path / other).touch()
    assert face_files(tmp_path) == wanted
    assert face_files(tmp_path / "sky_{face}.png") == wanted
    assert face_files(tmp_path / "preview.png") is None
    wanted[3].unlink()
    with pytest.raises(ImageError, match=r"-Y is missing"):
        face_files(tmp_path)
    with pytest.raises(ImageError, match=f"no sky_{wanted[3].stem[4:]}".replace("+", r"\+")):
        face_files(tmp_path / "sky_{face}.png")


def test_folders_that_cannot_be_meant(tmp_path: Path) -> None:
    with pytest.raises(ImageError, match="without the six faces"):
        face_files(tmp_path)
    with pytest.raises(ImageError, match="none of its files"):
        face_files(tmp_path / "sky_{face}.png")
    for word in STYLES[1]:
        (tmp_path / f"a_{word}.png").touch()
        (tmp_path / f"b_{word}.png").touch()
    with pytest.raises(ImageError, match="several cubes"):
        face_files(tmp_path)
    files = face_files(tmp_path / "b_{face}.png")
    assert files is not None
    assert files[0].name == "b_px.png"
