"""Pictures in every layout as environments: each drawn here by its own formula, read, and held against the function."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from glbump.errors import ImageError
from glbump.maps import facefiles
from glbump.maps.images import read_colour
from glbump.maps.layout import CUBE, LAYOUTS, EnvironmentMap, completed, inside, sample, texel_dirs
from glbump.maps.pictured import environment_of, picture_of
from glbump.maps.unfolding import UNFOLDINGS

N = 12
TURN = np.random.default_rng(1).normal(size=(3, 3)) * 1.5


def radiance(dirs: Any) -> Any:
    """A smooth function of the direction without any symmetry, (..., 3)."""
    d = np.asarray(dirs, np.float64)
    d = d / np.linalg.norm(d, axis=-1, keepdims=True)
    return 1.5 + np.sin(d @ TURN + (0.3, 1.1, 2.0)) + 0.3 * d


def picture(pixels: Any, name: str = "test.exr", envmap: str | None = None) -> Any:
    return SimpleNamespace(pixels=np.asarray(pixels, np.float32), envmap=envmap, name=name)


def steps(count: int, low: float = -1, high: float = 1) -> Any:
    """Texel centres between low and high."""
    return low + (np.arange(count) + 0.5) * (high - low) / count


def drawn(a: Any, b: Any, dir: Any) -> Any:
    """radiance of dir(a, b) with a to the right and b down: (len(b), len(a), 3)."""
    across, down = np.meshgrid(a, b)
    return radiance(np.stack(np.broadcast_arrays(*dir(across, down)), axis=-1))


FULL, HALF = steps(N), steps(N // 2, 0, 1)
# What one sees from inside, the front at -Z; a runs right, b down.
SEEN = {
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
    up_the_back = (lambda a, b: (a, b, 1)) if o == "inside" else (lambda a, b: (a, b, -1))
    out[3 * N :, N : 2 * N] = drawn(FULL, FULL, up_the_back)
    return out


def hemicube_column(o: str) -> Any:
    sides = [drawn(FULL, steps(N // 2, -1, 0), axes(o)[i]) for i in (0, 1, 4, 5)]
    return np.concatenate([drawn(FULL, FULL, axes(o)[2]), *sides])


def hemicube_cross(o: str) -> Any:
    h, flip = N // 2, (lambda dir: dir) if o == "inside" else mirrored_in_z
    out = np.zeros((2 * N, 2 * N, 3))
    middle = slice(h, h + N)
    out[middle, middle] = drawn(FULL, FULL, flip(SEEN["top"]))
    out[h + N :, middle] = drawn(FULL, HALF, flip(lambda a, w: (a, 1 - w, -1)))
    out[:h, middle] = drawn(FULL, HALF[::-1], flip(lambda a, w: (a, 1 - w, 1)))
    out[middle, h + N :] = drawn(HALF, FULL, flip(lambda w, b: (1, 1 - w, -b)))
    out[middle, :h] = drawn(HALF[::-1], FULL, flip(lambda w, b: (-1, 1 - w, -b)))
    return out


UNFOLDED = {
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


WHOLE_PICTURES = {
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
