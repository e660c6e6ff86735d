"""Bumps from bad input: a picture with a number in every pixel, or one line that says what is wrong with which."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from glbump import reference
from glbump.camera import Camera
from glbump.environment import LatLong
from glbump.errors import GlbumpError, ImageError, LimitError
from glbump.gl.renderer import Renderer
from glbump.maps.layout import LATLONG, texel_dirs
from glbump.quality import KNOBS, Quality
from glbump.scene import Bump, Material, NormalMap, Scene, Surface
from glbump.shapes import MeshFile, Plane, Quad, Sphere, Torus

MIRROR = Material(metallic=1, roughness=0)
COMPASS = LatLong((0.5 + 0.5 * texel_dirs(LATLONG, (32, 16))[0]).astype(np.float32))
CAMERA = Camera(eye=(0.3, 1.2, 2.6), target=(0, 0, 0))
RNG = np.random.default_rng(5)
NOISE = RNG.random((16, 16)).astype(np.float32)
STEP = np.where(np.arange(16) < 8, 0.0, 1.0) * np.ones((16, 1))


def heights(values: Any, amplitude: float = 0.05, **more: Any) -> Bump:
    return Bump(np.asarray(values, np.float32), amplitude, **more)


def normal_map(values: Any, shape: tuple[int, int] = (4, 4)) -> NormalMap:
    picture = np.broadcast_to(np.asarray(values, np.float32), (*shape, 3))
    return NormalMap(np.ascontiguousarray(0.5 + 0.5 * picture))


# Each is drawn.
SOUND: dict[str, Any] = {
    "1x1": heights(NOISE[:1, :1]),
    "1xN": heights(NOISE[:1]),
    "Nx1": heights(NOISE[:, :1]),
    "2x2": heights(NOISE[:2, :2]),
    "odd": heights(NOISE[:3, :7]),
    "mirrored 1x1": heights(NOISE[:1, :1], border="mirror"),
    "clamped 1xN": heights(NOISE[:1], border="clamp"),
    "constant": heights(np.full((8, 8), 0.3)),
    "zero": heights(np.zeros((8, 8))),
    "denormals": heights(1e-40 * NOISE),
    "denormals, raised": heights(1e-40 * NOISE, 1e30),
    "steps of 1e30, lowered": heights(1e30 * STEP, 1e-30),
    "negative": heights(NOISE, -0.05),
    "1e-30": heights(NOISE, 1e-30),
    "-1e-30": heights(NOISE, -1e-30),
    "0": heights(NOISE, 0.0),
    "by parameter, 1e-30": heights(NOISE, 1e-30, scaling="parameter"),
    "by parameter, 1e6": heights(NOISE, 1e6, scaling="parameter"),
    "steepest drawn": heights(STEP, 1e10),
    "repeats of 1e6": heights(NOISE, 1e-9, repeat=1e6),
    "triplanar": heights(NOISE, mapping="triplanar"),
    "triplanar, 1x1": heights(NOISE[:1, :1], mapping="triplanar"),
    "triplanar, ends": heights(NOISE[:3, :7], mapping="triplanar", border="clamp"),
    "triplanar, -1e-30": heights(NOISE, -1e-30, mapping="triplanar"),
    "triplanar, steepest drawn": heights(STEP, 1e10, mapping="triplanar"),
    "normals as steep as any": normal_map((0.99996, 0, 0.0085)),
    "normals, 1x1": normal_map((0.1, 0.2, 0.97), (1, 1)),
    "normals scaled by 1e6": NormalMap(normal_map((0.1, 0.2, 0.97)).normal_map, scale=1e6),
    "normals scaled by 1e-30": NormalMap(normal_map((0.1, 0.2, 0.97)).normal_map, scale=1e-30),
}


def with_bad(value: float, *places: tuple[int, int]) -> Any:
    result = NOISE.copy()
    for place in places:
        result[place] = value
    return result


ONE_IN = np.full((16, 16, 3), (0.1, 0.0, 0.99))
ONE_IN[2, 1] = 0.0, 0.6, -0.8
REFUSED: dict[str, tuple[Any, type[GlbumpError], str]] = {
    "NaN": (heights(with_bad(np.nan, (3, 5), (4, 6))), ImageError, r"2 .*row 3, column 5"),
    "Inf": (heights(with_bad(np.inf, (0, 1))), ImageError, r"1 .*row 0, column 1"),
    "-Inf": (heights(with_bad(-np.inf, (15, 15))), ImageError, r"1 .*row 15, column 15"),
    "past 1e30": (heights(with_bad(2e30, (2, 2)), 1e-30), ImageError, r"must lie within -1e\+30 and 1e\+30; 1 of"),
    "steps of 1e30": (heights(1e30 * STEP), LimitError, r"lower bump\.amplitude or bump\.repeat"),
    "1e30": (heights(NOISE, 1e30), LimitError, r"lower bump\.amplitude or bump\.repeat"),
    "-1e30": (heights(NOISE, -1e30), LimitError, r"lower bump\.amplitude or bump\.repeat"),
    "1e30 by parameter": (heights(NOISE, 1e30, scaling="parameter"), LimitError, r"lower bump\.amplitude"),
    "triplanar 1e30": (heights(NOISE, 1e30, mapping="triplanar"), LimitError, r"lower bump\.amplitude or bump\.repeat"),
    "black normals": (normal_map((-1, -1, -1)), ImageError, r"a grey picture is no normal map; if it holds heights"),
    "grey normals": (normal_map((0, 0, 0)), ImageError, r"a grey picture is no normal map"),
    "normals that look in": (normal_map((0.6, 0, -0.8)), ImageError, r"100% of its vectors point into the surface"),
    "normals that lie flat": (normal_map((1, 0, 0)), ImageError, r"100% of its vectors point into the surface"),
    "one that looks in": (
        normal_map(ONE_IN, (16, 16)),
        ImageError,
        r"1 of 256 normals do not, the first in row 2, column 1: \(.*mend the map",
    ),
    "NaN in normals": (normal_map((np.nan, 0, 1)), ImageError, r"16 "),
}


def pixels_of(renderer: Renderer, bump: Any, shape: Any, quality: Quality) -> Any:
    scene = Scene([Surface(shape, MIRROR, bump)], COMPASS, CAMERA)
    return renderer.render(scene, (16, 16), quality).pixels


def assert_drawn(renderer: Renderer, bump: Any, shape: Any, quality: Quality, what: str) -> None:
    pixels = pixels_of(renderer, bump, shape, quality)
    assert np.isfinite(pixels).all(), what
    # The compass is all between 0 and 1.
    assert 0 <= pixels.min() <= pixels.max() <= 1.001, what


def assert_refused(renderer: Renderer, what: str, shape: Any, quality: Quality) -> None:
    bump, kind, why = REFUSED[what]
    with pytest.raises(kind, match=why) as caught:
        pixels_of(renderer, bump, shape, quality)
    assert "\n" not in str(caught.value), what


@pytest.mark.parametrize("kernel", KNOBS["bump_kernel"].values)
@pytest.mark.parametrize("read", ["baked", "shader", "screen"])
def test_every_kernel_and_read(renderer: Renderer, kernel: str, read: str) -> None:
    quality = Quality("exact", samples=1, bump_kernel=kernel, bump_read=read)
    # Each bump on one of both shapes, and on the other with the next kernel.
    shapes = (Sphere(), Plane())
    for i, (what, bump) in enumerate(SOUND.items()):
        assert_drawn(renderer, bump, shapes[(i + KNOBS["bump_kernel"].values.index(kernel)) % 2], quality, what)
    for what in REFUSED:
        assert_refused(renderer, what, Plane(), quality)


@pytest.mark.parametrize("name", KNOBS["bump_format"].values)
@pytest.mark.parametrize("preset", ["exact", "balanced"])
def test_every_format(renderer: Renderer, name: str, preset: str) -> None:
    # What spreads is kept in a texture of its own, whatever the format; it is tried with one.
    spread = "lean" if (preset, name) == ("balanced", "half") else "none"
    for terms in ("small", "full"):
        quality = Quality(preset, samples=1, bump_format=name, bump_terms=terms, bump_spread=spread)
        for what, bump in SOUND.items():
            assert_drawn(renderer, bump, Torus(), quality, what)
    for what in REFUSED:
        assert_refused(renderer, what, Torus(), quality)


def test_the_reference_agrees() -> None:
    for what, bump in SOUND.items():
        for shape in (Sphere(), Plane()):
            scene = Scene([Surface(shape, MIRROR, bump)], COMPASS, CAMERA)
            assert np.isfinite(reference.render(scene, (16, 16), 1).pixels).all(), what
    for what, (bump, kind, why) in REFUSED.items():
        if kind is ImageError:  # What is steep is no trouble in float64.
            with pytest.raises(kind, match=why):
                reference.render(Scene([Surface(Plane(), MIRROR, bump)], COMPASS, CAMERA), (16, 16), 1)
            assert what


@pytest.mark.parametrize("amplitude", [0.0, 1e-30, -1e-30])
def test_next_to_no_bump_is_no_bump(renderer: Renderer, amplitude: float) -> None:
    """And so for constant and single texels, whatever their height."""
    quality = Quality("exact", samples=1)
    for shape in (Sphere(), Plane(), Torus()):
        none = pixels_of(renderer, None, shape, quality)
        # Directions have their last digits otherwise.
        assert np.abs(pixels_of(renderer, heights(NOISE, amplitude), shape, quality) - none).max() < 1e-5
        for flat in (NOISE[:1, :1], np.full((5, 3), 0.9)):
            small = Quality("exact", samples=1, bump_terms="small")
            assert np.abs(pixels_of(renderer, heights(flat, 0.3), shape, small) - none).max() < 1e-5
    assert (
        np.abs(
            pixels_of(renderer, heights(NOISE), Plane(), quality) - pixels_of(renderer, None, Plane(), quality)
        ).max()
        > 0.05
    )


DEGENERATE: dict[str, list[tuple[float, float]]] = {
    # v vt vn of a square in the plane z = 0, two triangles.
    "uv all in one point": [(0.5, 0.5)] * 4,
    "uv along one line": [(0, 0), (1, 1), (2, 2), (3, 3)],
    "one triangle's uv have no area": [(0, 0), (1, 0), (1, 1), (1, 1)],
    "uv of 1e-30": [(0, 0), (1e-30, 0), (1e-30, 1e-30), (0, 1e-30)],
    "uv of 1e6": [(0, 0), (1e6, 0), (1e6, 1e6), (0, 1e6)],
}


@pytest.mark.parametrize("what", DEGENERATE)
def test_uv_without_area(renderer: Renderer, tmp_path: Any, what: str) -> None:
    """Where u and v have no area there is no bump; elsewhere it is drawn."""
    corners = ["v -1 -1 0", "v 1 -1 0", "v 1 1 0", "v -1 1 0"]
    places = [f"vt {u:.9g} {v:.9g}" for u, v in DEGENERATE[what]]
    path = tmp_path / "square.obj"
    path.write_text("\n".join([*corners, *places, "vn 0 0 1", "f 1/1/1 2/2/1 3/3/1", "f 1/1/1 3/3/1 4/4/1"]))
    camera = Camera(eye=(0.2, 0.3, 3), target=(0, 0, 0), fov=30)
    for bump in (heights(NOISE, 0.01), normal_map((0.3, 0.1, 0.9)), heights(NOISE, 0.01, scaling="parameter")):
        for read in ("baked", "shader", "screen"):
            scene = Scene([Surface(MeshFile(path), MIRROR, bump)], COMPASS, camera)
            quality = Quality("exact", samples=1, bump_read=read)
            assert np.isfinite(renderer.render(scene, (16, 16), quality).pixels).all()
            assert np.isfinite(reference.render(scene, (16, 16), 1, quality=quality).pixels).all()


def test_quads_next_to_triangles(renderer: Renderer) -> None:
    """dp/du is 0 at a corner that two nearly share."""
    quad = Quad(((-1, -1, 0), (1, -1, 0), (1e-6, 1, 0), (-1e-6, 1, 0)))
    for read in ("baked", "shader", "screen"):
        for quality in (Quality("exact", samples=1, bump_read=read), Quality("balanced", bump_read=read)):
            assert_drawn(renderer, heights(NOISE, 0.02), quad, quality, "quad")
