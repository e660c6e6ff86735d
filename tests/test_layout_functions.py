"""The layouts' look-ups in GLSL: places lead back to their directions, and a padded picture shows no edge."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from glbump.glsltest import Glsl, Sampler, inputs
from glbump.maps import layout as maps
from glbump.maps.angles import angle_between
from glbump.maps.layout import EnvironmentMap, Layout
from glbump.reference import layout as twins
from glbump.reference.direction import turned_up, unit_dir
from tests.twins.cases import CASES, off_seams

F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]

FUNCTIONS = {
    "octahedral_place": maps.OCTAHEDRAL,
    "hemicube_place": maps.HEMICUBE,
    "equal_area_place": maps.EQUAL_AREA,
    "equidistant_place": maps.EQUIDISTANT,
    "orthographic_place": maps.ORTHOGRAPHIC,
    "paraboloid_place": maps.PARABOLOID,
}
layouts = pytest.mark.parametrize(("name", "layout"), FUNCTIONS.items(), ids=FUNCTIONS.keys())
# atan is off by 3.5e-6 rad, all else by some 1e-7 of the tile, half of the disc being a right angle; a disc seen from
# the side keeps the root of its rounding at the horizon.
ANGLE = {"equidistant_place": 5e-6, "orthographic_place": 2e-3}


def shown(layout: Layout, dir: npt.ArrayLike) -> F64:
    """The unit direction that the layout shows for `dir`."""
    return unit_dir(dir) if layout.whole else turned_up(unit_dir(dir))


def dirs_of(layout: Layout, place: npt.ArrayLike) -> F64:
    p = np.asarray(place, float)
    return layout.dir(p[..., 0].astype(int), p[..., 1], p[..., 2])


@layouts
def test_places_lead_back_to_their_directions(glsl: Glsl, name: str, layout: Layout) -> None:
    """Every extreme direction too: on seams, where two places are right, one float beside them, denormal and huge."""
    (dirs,) = CASES[f"layout.{name}"].rows()
    place = glsl("lib/layout.glsl")[name](dirs)
    want = shown(layout, dirs)
    bound = ANGLE.get(name, 1.5e-6)
    assert angle_between(dirs_of(layout, place), want).max() < bound
    assert ((place[:, 1:] >= 0) & (place[:, 1:] <= 1)).all(), "a place on a tile"
    assert np.isin(place[:, 0], np.arange(layout.tiles)).all()
    for wrong in (place[:, [0, 2, 1]], place * [1, -1, 1] + [0, 1, 0], place * [1, 1, -1] + [0, 0, 1]):
        assert np.median(angle_between(dirs_of(layout, wrong), want)) > 100 * bound, "turned or mirrored"


@layouts
def test_the_twins_are_the_maps_own_places(name: str, layout: Layout) -> None:
    dirs = inputs.unit_vectors(2000)
    want = np.stack(layout.place(maps.above(layout, dirs.astype(float))), axis=-1)
    # Another length first: a rounding or two.
    assert getattr(twins, name)(dirs) == pytest.approx(want, abs=1e-15)


@layouts
def test_no_direction_at_all_is_up(glsl: Glsl, name: str, layout: Layout) -> None:
    place = glsl("lib/layout.glsl")[name](np.float32([[0, 0, 0], [0, 1, 0], [0, np.inf, 0], [1e-40, 0, 0]]))
    assert (place == place[1]).all()


def test_texels_of_a_column_of_tiles() -> None:
    """Texel i, j of tile k lies at column j + 1, row k (h + 2) + i + 1 of what is stored; centres at halves."""
    size, tiles = np.array([5, 3]), 4
    k, i, j = np.meshgrid(np.arange(tiles), np.arange(-1, 4), np.arange(-1, 6), indexing="ij")
    place = np.stack([k, (j + 0.5) / 5, (i + 0.5) / 3], axis=-1)
    texel = twins.tile_texel(place, size)
    assert texel == pytest.approx(np.stack([j + 1.5, k * 5 + i + 1.5], axis=-1))


def smooth(layout: Layout, size: int) -> EnvironmentMap:
    """A picture of the directions themselves: what is read can be told to a fraction of a texel."""
    dirs = maps.texel_dirs(layout, layout.shape(size)[:0:-1])
    return EnvironmentMap(layout, maps.completed(layout, np.float32(0.5 + 0.5 * shown(layout, dirs))))


@pytest.fixture(scope="module")
def look_up() -> Callable[..., Any]:
    def made(glsl: Glsl, name: str, environment: EnvironmentMap, dirs: F32) -> Any:
        """Through GLSL, from the padded tiles in one column."""
        width = environment.padded.shape[2]
        source = f"""
        #include "lib/layout.glsl"
        vec3 look(sampler2D picture, vec3 dir, vec2 size) {{
            return texture(picture, tile_texel({name}(dir), size) / textureSize(picture, 0)).rgb;
        }}
        """
        stored = Sampler(environment.padded.reshape(-1, width, 3), filter="linear", wrap="clamp")
        return glsl(source).look(stored, dirs, np.float32(environment.size))

    return made


@layouts
def test_a_picture_is_read_as_the_maps_read_it(
    glsl: Glsl, look_up: Callable[..., Any], name: str, layout: Layout
) -> None:
    """Across every edge of a tile: the border holds what lies beyond."""
    environment = smooth(layout, 16)
    dirs = inputs.directions(4000, 5)
    # At 16 texels two tiles differ by more than this where they meet.
    dirs = dirs[off_seams(dirs)]
    got, want = look_up(glsl, name, environment, dirs), maps.sample(environment, dirs)
    # Weights of 8 bits, between texels that differ by at most a third; the place, off by 2e-6 of 16 texels, is less.
    assert np.abs(got - want).max() < 2 / 256 / 3
    bare = EnvironmentMap(layout, environment.pixels)
    object.__setattr__(bare, "padded", np.pad(environment.pixels, ((0, 0), (1, 1), (1, 1), (0, 0))))
    assert np.abs(look_up(glsl, name, bare, dirs) - want).max() > 0.1, "a black border shows"
