"""Pictures in every layout as environments: each drawn here by its own formula, read, and held against the function."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from PIL import Image

from glbump.contents import Contents
from glbump.environment import CubeMap, HemiCube, LatLong
from glbump.errors import ImageError
from glbump.maps.images import read_colour, read_environment, write_picture
from glbump.maps.layout import CUBE, HEMICUBE, LATLONG, LAYOUTS, EnvironmentMap, completed, inside, sample, texel_dirs
from glbump.maps.pictured import environment_of, picture_of
from glbump.maps.unfolding import UNFOLDINGS, oriented
from glbump.scene import Scene

DATA = Path(__file__).parents[2] / "shared" / "data" / "openexr"
N = 12
TURN = np.random.default_rng(1).normal(size=(3, 3)) * 1.5


def radiance(dirs: Any) -> Any:
    """A smooth function of the direction without any symmetry, (..., 3)."""
    d = np.asarray(dirs, np.float64)
    d = d / np.linalg.norm(d, axis=-1, keepdims=True)
    return 1.5 + np.sin(d @ TURN + (0.3, 1.1, 2.0)) + 0.3 * d


def picture(pixels: Any, name: str = "test.exr", envmap: str | None = None) -> Any:
    return SimpleNamespace(pixels=np.asarray(pixels, np.float32), envmap=envmap, name=name, clear=None)


def steps(count: int, low: float = -1, high: float = 1) -> Any:
    """Texel centres between low and high."""
    return low + (np.arange(count) + 0.5) * (high - low) / count


def drawn(a: Any, b: Any, dir: Any) -> Any:
    """radiance of dir(a, b) with a to the right and b down: (len(b), len(a), 3)."""
    across, down = np.meshgrid(a, b)
    return radiance(np.stack(np.broadcast_arrays(*dir(across, down)), axis=-1))


FULL, HALF = steps(N), steps(N // 2, 0, 1)
# What one sees from inside, the front at -Z; a runs right, b down.
SEEN: dict[str, Any] = {
    "right": lambda a, b: (1, -b, a),
    "left": lambda a, b: (-1, -b, -a),
    "top": lambda a, b: (a, 1, -b),
    "bottom": lambda a, b: (a, -1, b),
    "front": lambda a, b: (a, -b, -1),
    "back": lambda a, b: (-a, -b, 1),
}
# OpenGL 4.6 core, table 8.19, and OpenEXR's faces.
TABLE = [
    lambda a, b: (1, -b, -a), lambda a, b: (-1, -b, a), lambda a, b: (a, 1, b),
    lambda a, b: (a, -1, -b), lambda a, b: (a, -b, 1), lambda a, b: (-a, -b, -1),
]  # fmt: skip
INSIDE = [SEEN[face] for face in ("right", "left", "top", "bottom", "back", "front")]


def mirrored_in_z(dir: Any) -> Any:
    def other(a: Any, b: Any) -> Any:
        x, y, z = dir(a, b)
        return x, y, -z

    return other


def word(name: str, orientation: str) -> Any:
    """A face by its word; "opengl" puts the front at +Z, and mirrors all by that."""
    return SEEN[name] if orientation == "inside" else mirrored_in_z(SEEN[name])


def axes(orientation: str) -> Any:
    return TABLE if orientation == "opengl" else INSIDE


def hcross(o: str) -> Any:
    out = np.zeros((3 * N, 4 * N, 3))
    cells = {(0, 1): "top", (2, 1): "bottom", (1, 0): "left", (1, 1): "front", (1, 2): "right", (1, 3): "back"}
    for (i, j), name in cells.items():
        out[i * N : (i + 1) * N, j * N : (j + 1) * N] = drawn(FULL, FULL, word(name, o))
    return out


def vcross(o: str) -> Any:
    out = np.zeros((4 * N, 3 * N, 3))
    cells = {(0, 1): "top", (2, 1): "bottom", (1, 0): "left", (1, 1): "front", (1, 2): "right"}
    for (i, j), name in cells.items():
        out[i * N : (i + 1) * N, j * N : (j + 1) * N] = drawn(FULL, FULL, word(name, o))
    # Below the bottom the picture goes on up the back wall.
    back = 1 if o == "inside" else -1
    out[3 * N :, N : 2 * N] = drawn(FULL, FULL, lambda a, b: (a, b, back))
    return out


def hemicube_column(o: str) -> Any:
    sides = [drawn(FULL, steps(N // 2, -1, 0), axes(o)[i]) for i in (0, 1, 4, 5)]
    return np.concatenate([drawn(FULL, FULL, axes(o)[2]), *sides])


def hemicube_cross(o: str) -> Any:
    h = N // 2

    def flip(dir: Any) -> Any:
        return dir if o == "inside" else mirrored_in_z(dir)

    out = np.zeros((2 * N, 2 * N, 3))
    middle = slice(h, h + N)
    out[middle, middle] = drawn(FULL, FULL, flip(SEEN["top"]))
    out[h + N :, middle] = drawn(FULL, HALF, flip(lambda a, w: (a, 1 - w, -1)))
    out[:h, middle] = drawn(FULL, HALF[::-1], flip(lambda a, w: (a, 1 - w, 1)))
    out[middle, h + N :] = drawn(HALF, FULL, flip(lambda w, b: (1, 1 - w, -b)))
    out[middle, :h] = drawn(HALF[::-1], FULL, flip(lambda w, b: (-1, 1 - w, -b)))
    return out


UNFOLDED: dict[str, Any] = {
    "hcross": hcross,
    "vcross": vcross,
    "hstrip": lambda o: np.concatenate([drawn(FULL, FULL, dir) for dir in axes(o)], axis=1),
    "vstrip": lambda o: np.concatenate([drawn(FULL, FULL, dir) for dir in axes(o)]),
    "faces": lambda o: np.stack([drawn(FULL, FULL, dir) for dir in axes(o)]),
    "hemicube-column": hemicube_column,
    "hemicube-cross": hemicube_cross,
}


def disc(angle_of: Any, looking_up: bool) -> Any:
    """A disc about +Y with -Z at the top and +X left, or about -Z with +Y at the top; corners black."""
    a, b = np.meshgrid(steps(2 * N), steps(2 * N))
    r = np.hypot(a, b)
    theta = angle_of(np.minimum(r, 1))
    across = np.sin(theta) / r
    dirs = (-a * across, np.cos(theta), b * across) if looking_up else (a * across, -b * across, -np.cos(theta))
    return np.where((r <= 1)[..., None], radiance(np.stack(dirs, axis=-1)), 0)


def octahedral(_: str) -> Any:
    a, b = np.meshgrid(steps(2 * N), steps(2 * N))
    y = 1 - abs(a) - abs(b)
    x = np.where(y < 0, np.sign(a) * (1 - abs(b)), a)
    z = np.where(y < 0, np.sign(b) * (1 - abs(a)), b)
    return radiance(np.stack([x, y, z], axis=-1))


def paraboloid(_: str) -> Any:
    up = disc(lambda r: 2 * np.arctan(r), True)
    a, b = np.meshgrid(steps(2 * N), steps(2 * N))
    r = np.hypot(a, b)
    theta = np.pi - 2 * np.arctan(np.minimum(r, 1))
    across = np.sin(theta) / r
    down = np.where((r <= 1)[..., None], radiance(np.stack([a * across, np.cos(theta), b * across], axis=-1)), 0)
    return np.concatenate([up, down], axis=1)


def latlong(_: str) -> Any:
    u, v = np.meshgrid(steps(4 * N, -np.pi, np.pi), steps(2 * N, 0, np.pi))
    return radiance(np.stack([np.sin(v) * np.sin(u), np.cos(v), -np.sin(v) * np.cos(u)], axis=-1))


WHOLE_PICTURES: dict[str, Any] = {
    "lat-long": latlong,
    "octahedral": octahedral,
    "dual-paraboloid": paraboloid,
    "equal-area": lambda _: disc(lambda r: 2 * np.arcsin(r / np.sqrt(2)), True),
    "equidistant": lambda _: disc(lambda r: r * np.pi / 2, True),
    "orthographic": lambda _: disc(np.arcsin, True),
    "angular": lambda _: disc(lambda r: r * np.pi, False),
    # Its middle mirrors +Z, where the camera stands; the rim -Z.
    "mirror-ball": lambda _: disc(lambda r: np.pi - 2 * np.arcsin(r), False),
}


def error(environment: EnvironmentMap) -> float:
    """The largest difference of a texel that is a part of the picture from the function in its own direction."""
    part = inside(environment.layout, environment.size)
    return float(np.abs(environment.pixels - radiance(environment.texel_dirs()))[:, part].max())


# float32 of values up to 3, and of the directions of the drawing.
EXACT = 1e-6


@pytest.mark.parametrize("orientation", ["opengl", "inside"])
@pytest.mark.parametrize("layout", UNFOLDED)
def test_faces_come_to_lie_where_they_look(layout: str, orientation: str) -> None:
    pixels = UNFOLDED[layout](orientation)
    environment = environment_of(picture(pixels), layout, orientation)
    assert error(environment) < EXACT
    assert environment.notes == ()
    other = "inside" if orientation == "opengl" else "opengl"
    assert error(environment_of(picture(pixels), layout, other)) > 0.5
    for turned in (pixels[..., ::-1, :, :], pixels[..., :, ::-1, :]):
        assert error(environment_of(picture(turned), layout, orientation)) > 0.5


@pytest.mark.parametrize("layout", WHOLE_PICTURES)
def test_pictures_of_one_or_two_tiles(layout: str) -> None:
    pixels = WHOLE_PICTURES[layout]("")
    assert error(environment_of(picture(pixels), layout)) < EXACT
    for turned in (pixels[::-1], pixels[:, ::-1]):
        assert error(environment_of(picture(turned), layout)) > 0.5


@pytest.mark.parametrize("layout", [*UNFOLDED, *WHOLE_PICTURES])
def test_the_layout_is_found_without_being_told(layout: str) -> None:
    """Of discs a light probe is the likeliest; the others are named."""
    taken = "angular" if layout in ("equal-area", "equidistant", "orthographic", "mirror-ball") else layout
    orientation = "inside" if UNFOLDINGS.get(layout) and UNFOLDINGS[layout].has_front else "opengl"
    pixels = {**UNFOLDED, **WHOLE_PICTURES}[layout](orientation)
    got, wanted = environment_of(picture(pixels)), environment_of(picture(pixels), taken, orientation)
    assert got.layout is wanted.layout
    assert np.array_equal(got.pixels, wanted.pixels)
    if taken == "angular":
        assert "taken as angular" in got.notes[0]
        assert layout in got.notes[0]
    else:
        assert not any("taken as" in note and "-Z" not in note for note in got.notes)


@pytest.mark.parametrize("orientation", ["auto", "opengl", "inside"])
@pytest.mark.parametrize("layout", [*UNFOLDED, *WHOLE_PICTURES, "cube", "hemicube"])
def test_round_trips(layout: str, orientation: str) -> None:
    """Nothing is resampled, so nothing changes."""
    kind = UNFOLDINGS[layout].layout if layout in UNFOLDINGS else LAYOUTS["cube" if layout == "faces" else layout]
    _, height, width = kind.shape(N)
    pixels = completed(kind, radiance(texel_dirs(kind, (width, height))).astype(np.float32))
    drawn_so = picture_of(EnvironmentMap(kind, pixels), layout, orientation)
    again = environment_of(picture(drawn_so), layout, orientation)
    assert again.layout is kind
    assert np.array_equal(again.pixels, pixels)


def test_a_cross_is_drawn_as_one_sees_it() -> None:
    environment = EnvironmentMap(CUBE, radiance(texel_dirs(CUBE, (N, N))).astype(np.float32))
    for layout, formula in UNFOLDED.items():
        if "hemicube" not in layout:
            auto = "inside" if "cross" in layout else "opengl"
            assert np.abs(picture_of(environment, layout) - formula(auto)).max() < EXACT


def test_other_layouts_must_be_converted_first() -> None:
    environment = EnvironmentMap(CUBE, np.zeros((6, 4, 4, 3), np.float32))
    with pytest.raises(ImageError, match="convert it first"):
        picture_of(environment, "lat-long")
    with pytest.raises(ImageError, match="orientation"):
        picture_of(environment, "hcross", "outside")
    bordered = environment_of(picture(np.zeros((24, 4, 3)), envmap="cube"))
    with pytest.raises(ImageError, match="border"):
        picture_of(bordered, "vstrip")


# ------------------------------------------------------------ panoramas that are not 2:1


def band(width: int, height: int) -> Any:
    """360 degrees wide, about the horizon, square pixels: the middle rows of a lat-long picture."""
    v = np.pi / 2 + steps(height, -np.pi * height / width, np.pi * height / width)
    u, v = np.meshgrid(steps(width, -np.pi, np.pi), v)
    return radiance(np.stack([np.sin(v) * np.sin(u), np.cos(v), -np.sin(v) * np.cos(u)], axis=-1))


@pytest.mark.parametrize("size", [(48, 10), (49, 24), (64, 1), (90, 15)])
def test_a_wide_panorama_lies_about_the_horizon(size: tuple[int, int]) -> None:
    width, height = size
    pixels = band(width, height)
    environment = environment_of(picture(pixels), "lat-long")
    assert error(environment) < EXACT
    (note,) = environment.notes
    assert f"got {width}x{height}: taken as 360 degrees wide and {360 * height / width:.3g} high" in note
    # Beyond the first and last row these rows go on, to the poles.
    longitude = steps(width, -np.pi, np.pi)
    for row, latitude in ((0, 1.5), (-1, -1.5)):
        across = np.cos(latitude)
        dirs = np.stack(
            [across * np.sin(longitude), np.full(width, np.sin(latitude)), -across * np.cos(longitude)], axis=-1
        )
        assert np.abs(sample(environment, dirs) - pixels[row]).max() < 1e-5


@pytest.mark.parametrize(("size", "hint"), [((20, 16), ""), ((36, 48), "; its shape is that of layout vcross")])
def test_a_narrow_panorama_is_stretched(size: tuple[int, int], hint: str) -> None:
    width, height = size
    u, v = np.meshgrid(steps(width, -np.pi, np.pi), steps(height, 0, np.pi))
    pixels = radiance(np.stack([np.sin(v) * np.sin(u), np.cos(v), -np.sin(v) * np.cos(u)], axis=-1))
    environment = environment_of(picture(pixels), "lat-long")
    assert error(environment) < EXACT
    assert not environment.has_own_grid
    (note,) = environment.notes
    assert note.endswith(f"got {width}x{height}: stretched over the whole sphere{hint}")


def test_a_probe_taken_for_a_panorama_is_doubted() -> None:
    (note,) = environment_of(picture(WHOLE_PICTURES["angular"]("")), "lat-long").notes
    assert "its shape is that of layout angular" in note


# ------------------------------------------------------------ six files, and five


def six(orientation: str = "opengl", style: str = "posx negx posy negy posz negz") -> list[Any]:
    return [
        picture(drawn(FULL, FULL, dir), f"sky_{word}.png")
        for word, dir in zip(style.split(), axes(orientation), strict=True)
    ]


@pytest.mark.parametrize("style", ["posx negx posy negy posz negz", "px nx py ny pz nz", "+x -x +y -y +z -z"])
def test_six_files_are_put_in_order_by_their_names(style: str) -> None:
    faces = six(style=style)
    wanted = environment_of(faces)
    assert error(wanted) < EXACT
    assert wanted.notes == ()
    shuffled = sorted(faces, key=lambda face: str(face.name))
    got = environment_of(shuffled, "cube")
    assert np.array_equal(got.pixels, wanted.pixels)
    assert "put in order by their names" in got.notes[0]
    # Told that they are faces in order, their names do not count, and the edges show that they should.
    kept = environment_of(shuffled, "faces", "opengl")
    assert np.array_equal(kept.pixels, np.stack([face.pixels for face in shuffled]))
    assert kept.notes != ()


def test_six_files_without_names_are_in_order() -> None:
    faces = six()
    for number, face in enumerate(faces):
        face.name = f"{5 - number}.png"
    assert error(environment_of(faces)) < EXACT


@pytest.mark.parametrize("orientation", ["auto", "inside", "opengl"])
def test_files_named_as_one_sees_them(orientation: str) -> None:
    """Their front is at -Z, unmirrored; OpenGL's reading has it at +Z, and mirrors all."""
    drawn_so = "inside" if orientation == "auto" else orientation
    faces = [picture(drawn(FULL, FULL, word(name, drawn_so)), f"{name}.jpg") for name in sorted(SEEN)]
    environment = environment_of(faces, "cube", orientation)
    assert error(environment) < EXACT
    assert any("front at -Z" in note for note in environment.notes) == (orientation == "auto")


def test_edges_tell_the_orientation() -> None:
    environment = environment_of(six("inside"), "cube", "auto")
    assert error(environment) < EXACT
    assert "as seen from inside, since so their edges meet" in environment.notes[0]
    told = environment_of(six("inside"), "cube", "opengl")
    assert error(told) > 0.5
    assert "they are of the other orientation" in told.notes[0]
    noise = np.random.default_rng(2).uniform(size=(6, 8, 8, 3))
    assert "do not tell the orientation" in environment_of(picture(noise)).notes[0]
    # Of one colour, they are the same cube.
    assert environment_of(picture(np.ones((6, 8, 8, 3)))).notes == ()


def test_a_texture_file_says_its_orientation() -> None:
    """A cube in KTX2 or DDS is the OpenGL table's, whatever its edges say; unless one is told otherwise."""
    column = picture(UNFOLDED["vstrip"]("inside"), envmap="faces")
    for layout in ("auto", "cube"):
        environment = environment_of(column, layout)
        assert np.array_equal(environment.pixels, environment_of(column, "cube", "opengl").pixels)
        assert "other orientation" in environment.notes[0]
    assert error(environment_of(column, "cube", "inside")) < EXACT


def test_a_turned_face_is_said() -> None:
    faces = six()
    faces[2].pixels = np.rot90(faces[2].pixels, -1)
    (note,) = environment_of(faces).notes
    assert "face +Y is turned by 90 degrees clockwise" in note


def test_faces_that_are_no_cube_are_doubted() -> None:
    """Six unrelated smooth pictures."""
    a, b = np.meshgrid(FULL, FULL)
    faces = [picture(np.stack([np.full_like(a, k % 3 * 9), 9 * (k // 2) + a, 3 * k + b], axis=-1)) for k in range(6)]
    assert any("is it a cube?" in note for note in environment_of(faces).notes)


SQUARE = np.zeros((4, 4, 3))


@pytest.mark.parametrize(
    ("pictures", "layout", "words"),
    [
        (lambda: [face for i, face in enumerate(six()) if i != 3], "cube", ("six pictures", "got 5", "-Y is missing")),
        (lambda: six()[:4], "auto", ("got 4", "+Z -Z is missing")),
        (lambda: [picture(SQUARE)] * 5, "auto", ("got 5",)),
        (lambda: [*six()[:5], picture(np.zeros((4, 5, 3)), "sky_negz.png")], "cube", ("sky_negz.png", "square", "5x4")),
        (lambda: [*six()[:5], picture(SQUARE, "sky_negz.png")], "cube", ("sky_negz.png", "4x4", "12x12")),
        (lambda: six(), "octahedral", ("octahedral is one picture", "got 6")),
        (lambda: [picture(SQUARE)] * 6, "hemicube", ("five pictures", "top +X -X +Z -Z", "got 6")),
        (lambda: [picture(SQUARE)] * 4 + [picture(SQUARE[:3], "odd.png")], "hemicube", ("odd.png", "4x3", "-Z")),
        (lambda: picture(SQUARE), "octahedron", ("layout 'octahedron'", "did you mean 'octahedral'", "lat-long")),
        (lambda: picture(np.zeros((4, 5, 3))), "octahedral", ("octahedral must be square", "5x4")),
        (lambda: picture(np.zeros((4, 5, 3))), "dual-paraboloid", ("2:1 or 1:2", "5x4")),
        (lambda: picture(np.zeros((4, 5, 3))), "hcross", ("hcross must be 4:3", "5x4")),
        (lambda: picture(np.zeros((4, 5, 3))), "hemicube", ("N x 3N", "5x4", "five pictures")),
        (lambda: picture(SQUARE, envmap="cube"), "octahedral", ("header says it is a cube map", 'kind = "cube"')),
        (lambda: picture(SQUARE, envmap="latlong"), "hcross", ("header says it is a lat-long", 'kind = "lat-long"')),
        (lambda: picture(np.zeros((3, 4, 3)), envmap="cube"), "cube", ("column of six", "4x3")),
    ],
)  # fmt: skip
def test_what_is_refused(pictures: Any, layout: str, words: tuple[str, ...]) -> None:
    with pytest.raises(ImageError) as caught:
        environment_of(pictures(), layout)
    assert [w for w in words if w not in str(caught.value)] == []
    assert "\n" not in str(caught.value)


def test_five_pictures_of_a_hemicube() -> None:
    """Sides of half the height, or whole ones, of which the lower half is not used."""
    faces = [drawn(FULL, FULL, axes("opengl")[i]) for i in (2, 0, 1, 4, 5)]
    halves = [faces[0], *(side[: N // 2] for side in faces[1:])]
    for layout in ("auto", "hemicube"):
        environment = environment_of([picture(face) for face in halves], layout)
        assert environment.layout is HEMICUBE
        assert error(environment) < EXACT
        assert environment.notes == ()
    whole = environment_of([picture(face) for face in faces], "hemicube")
    assert np.array_equal(whole.pixels, environment.pixels)
    assert len(whole.notes) == 4
    mirrored = oriented(HEMICUBE, environment.pixels, "inside")
    column = picture_of(EnvironmentMap(HEMICUBE, mirrored), "hemicube-column", "opengl")
    assert np.array_equal(environment_of(picture(column)).pixels, environment.pixels)


def test_discs_one_above_the_other() -> None:
    beside = WHOLE_PICTURES["dual-paraboloid"]("")
    above = np.concatenate(np.split(beside, 2, axis=1))
    for layout in ("auto", "dual-paraboloid"):
        got = environment_of(picture(above), layout)
        assert np.array_equal(got.pixels, environment_of(picture(beside)).pixels)


def test_the_corners_of_a_disc_are_filled() -> None:
    """So that what is black there is nowhere mixed in."""
    for layout in ("equidistant", "angular", "dual-paraboloid"):
        assert environment_of(picture(WHOLE_PICTURES[layout]("")), layout).pixels.min() > 0


# ------------------------------------------------------------ transparent pixels


def saved(path: Path, pixels: Any, alpha: Any) -> Any:
    """Light and alpha as an 8-bit PNG, read again."""
    light = np.clip(np.asarray(pixels) / 3, 0, 1)
    Image.fromarray(np.round(np.dstack([light, alpha]) * 255).astype(np.uint8)).save(path)
    return read_environment(path)


def test_crosses_may_be_transparent_where_they_hold_nothing(tmp_path: Path) -> None:
    cross = hcross("inside")
    alpha = (cross[..., 0] > 0).astype(float)
    coloured = np.where(alpha[..., None] > 0, cross, np.random.default_rng(3).uniform(size=cross.shape) * 3)
    got = environment_of(saved(tmp_path / "a.png", coloured, alpha))
    assert np.array_equal(got.pixels, environment_of(saved(tmp_path / "b.png", cross, 1 + 0 * alpha), "hcross").pixels)
    assert not any("corners" in note or "taken as hcross" in note for note in got.notes)
    alpha[N + 3, 5] = 0.5
    with pytest.raises(ImageError, match=rf"opaque; 1 of {12 * N * N} pixels \(first at row {N + 3}, column 5\)"):
        environment_of(saved(tmp_path / "a.png", cross, alpha))


@pytest.mark.parametrize("layout", ["angular", "dual-paraboloid"])
def test_discs_may_be_cut_out(layout: str, tmp_path: Path) -> None:
    """The rim is half transparent, as programs cut."""
    pixels = WHOLE_PICTURES[layout]("")
    n = pixels.shape[0]
    c = np.arange(n) + 0.5 - n / 2
    alpha = np.clip(n / 2 - np.hypot(c[:, None], c), 0, 1)
    alpha = np.tile(alpha, (1, pixels.shape[1] // n))
    assert environment_of(saved(tmp_path / "a.png", pixels, alpha)).layout.name == layout
    alpha[n // 2, n // 3] = 0
    with pytest.raises(ImageError, match="opaque; 1 of"):
        environment_of(saved(tmp_path / "a.png", pixels, alpha), layout)


def test_all_other_pictures_must_be_opaque(tmp_path: Path) -> None:
    alpha = np.ones((2 * N, 4 * N))
    opaque = saved(tmp_path / "a.png", latlong(""), alpha)
    assert opaque.clear is None
    alpha[0, 0] = 0
    clear = saved(tmp_path / "a.png", latlong(""), alpha)
    with pytest.raises(ImageError, match="opaque"):
        environment_of(clear)
    face = saved(tmp_path / "a.png", latlong("")[:N, :N], alpha[:N, :N])
    with pytest.raises(ImageError, match="opaque"):
        environment_of([face] * 6)


# ------------------------------------------------------------ scenes


def test_a_scene_reads_a_folder_and_says_so(tmp_path: Path) -> None:
    folder = tmp_path / "sky"
    folder.mkdir()
    for face in six():
        write_picture(folder / face.name.replace(".png", ".exr"), face.pixels)
    contents = Contents()
    for image in (folder, folder / "sky_{face}.exr"):
        scene = Scene(surfaces=[], environment=CubeMap(str(image)))
        assert error(contents.environment(scene.environment)) < 1e-3  # half floats
        (note,) = contents.notes(scene)
        assert "its faces +X -X +Y -Y +Z -Z are sky_posx.exr, sky_negx.exr" in note
    with pytest.raises(ImageError, match="is a directory"):
        contents.environment(LatLong(str(folder)))


def test_scenes_with_every_kind_of_picture() -> None:
    contents = Contents()
    for name, kind in {"hcross": CubeMap, "vcross": CubeMap, "hstrip": CubeMap, "hemicube-cross": HemiCube}.items():
        unfolding = UNFOLDINGS[name]
        environment = kind(UNFOLDED[name](unfolding.orientation).astype(np.float32))
        assert error(contents.environment(environment)) < EXACT
    wide = LatLong(band(48, 10).astype(np.float32))
    assert "taken as 360 degrees wide" in contents.notes(Scene(surfaces=[], environment=wide))[0]


@pytest.mark.parametrize("name", ["KernerEnv", "Orientation"])
def test_shipped_cubes_in_every_unfolding(name: str) -> None:
    """Every fourth sample of OpenEXR's cubes, which are seen from inside, laid by hand as words name the faces."""
    path = DATA / f"{name}Cube.exr"
    if not path.exists():
        pytest.skip(f"needs ../shared/data/openexr/{name}Cube.exr beside the repository")
    cube = environment_of(read_colour(path))
    n = cube.size[0] // 4
    faces = read_colour(path).pixels.reshape(6, 4 * n, 4 * n, 3)[:, 1::4, 1::4]
    seen = dict(zip(("right", "left", "top", "bottom", "back", "front"), faces, strict=True))
    cross = np.zeros((3 * n, 4 * n, 3), np.float32)
    cells = {(0, 1): "top", (2, 1): "bottom", (1, 0): "left", (1, 1): "front", (1, 2): "right", (1, 3): "back"}
    for (i, j), face in cells.items():
        cross[i * n : (i + 1) * n, j * n : (j + 1) * n] = seen[face]
    got = environment_of(picture(cross), "hcross")
    assert np.array_equal(got.pixels, oriented(CUBE, faces, "inside"))
    panorama = environment_of(read_colour(DATA / f"{name}LatLong.exr"))
    assert panorama.layout is LATLONG
    dirs = got.texel_dirs()
    right, wrong = sample(panorama, dirs), sample(panorama, dirs * (1, 1, -1))
    clip = 1.0 if name == "Orientation" else 4.0
    rmse = [np.sqrt(np.mean((np.minimum(x, clip) - np.minimum(got.pixels, clip)) ** 2)) for x in (right, wrong)]
    # Every fourth sample lies up to two samples off the texel's centre; a mirror is far more.
    assert rmse[0] < 0.5 * rmse[1]
