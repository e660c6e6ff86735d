"""Heights whose pixels have a length, as of terrain: the map is as large as it is, whatever the shape's u and v."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from glbump import reference
from glbump.camera import Camera
from glbump.contents import Contents
from glbump.displace import Heights
from glbump.environment import LatLong
from glbump.errors import SceneError
from glbump.gl.renderer import Renderer
from glbump.maps.layout import LATLONG, texel_dirs
from glbump.quality import Quality
from glbump.relief import sized
from glbump.scene import Bump, Material, Scene, Surface
from glbump.shapes import Cube, Plane, Quad, Sphere, Transform

MIRROR = Material(metallic=1, roughness=0)
DIRS = texel_dirs(LATLONG, (256, 128))[0]
# Looked up by the normal, the colour is the normal.
NORMAL = LatLong((0.5 + 0.5 * DIRS).astype(np.float32), lookup="normal", background=False)
ONE = Quality("exact", samples=1)
COLUMNS, ROWS, PIXEL = 200, 120, 30.0
"""A terrain of 6000 by 3600 metres."""
EAST = (np.arange(COLUMNS) + 0.5) * PIXEL
NORTH = (ROWS - np.arange(ROWS) - 0.5) * PIXEL
METRES = (1000 + 200 * np.sin(2 * np.pi * EAST / 3000)[None, :] + 0 * NORTH[:, None]).astype(np.float32)
TERRAIN = Bump(METRES, 1.0, pixel_size=PIXEL)


def tilt_to_the_east(frame: Any) -> Any:
    n = 2 * frame.pixels[..., :3].astype(np.float64) - 1
    return np.degrees(np.arctan2(-n[..., 0], n[..., 1]))


@pytest.mark.parametrize("size", [(6000, 3600), (12000, 3600), (3000, 7200)])
def test_slopes_are_metres_by_metres(renderer: Renderer, size: tuple[float, float]) -> None:
    """On a plane of any size, straight from above: the tilt that 200 m over waves of 3000 m have."""
    camera = Camera(eye=(0, 5000, 0), target=(0, 0, 0), up=(0, 0, -1), projection="orthographic", height=2000)
    scene = Scene([Surface(Plane(size), MIRROR, TERRAIN)], NORMAL, camera)
    east = ((np.arange(64) + 0.5) / 64 - 0.5) * 2000 + size[0] / 2
    slope = 200 * 2 * np.pi / 3000 * np.cos(2 * np.pi * east / 3000)
    want = np.broadcast_to(np.degrees(np.arctan(slope)), (64, 64))
    for frame in (renderer.render(scene, (64, 64), ONE), reference.render(scene, (64, 64), 1)):
        # Central differences of 100 pixels a wave fall short by 0.07 %; 0.01 degrees of the compass.
        assert np.abs(tilt_to_the_east(frame) - want).max() < 0.03
    assert want.max() > 10


def test_it_is_the_repeat_that_fits() -> None:
    contents = Contents()

    def repeat(shape: Any, **more: Any) -> Any:
        bump = sized(replace(TERRAIN, **more.pop("bump", {})), Surface(shape, **more), contents)
        assert isinstance(bump, Bump)
        assert bump.pixel_size is None
        return pytest.approx(bump.repeat)

    assert repeat(Plane((6000, 3600))) == (1, 1)
    assert repeat(Plane((2, 1)), transform=Transform(scale=(3000, 1, 1800))) == (1, 0.5)
    assert repeat(Plane((2, 1)), bump={"border": "mirror"}) == (2 / 6000, 1 / 3600)
    assert repeat(Quad(((0, 0, 0), (3000, 0, 0), (4000, 3600, 0), (1000, 3600, 0)))) == (
        0.5,
        np.hypot(1000, 3600) / 3600,
    )
    assert repeat(Sphere(), bump={"mapping": "triplanar"}, transform=Transform(scale=3)) == (3 / 6000, 3 / 3600)
    # Moved by it, a surface rises by metres.
    heights = Heights(Surface(Plane((6000, 3600)), MIRROR, TERRAIN), contents)
    assert heights.at(np.array([[0.125, 0.5]]))[0] == pytest.approx(1200, abs=0.1)


def test_what_has_no_such_size_says_so(renderer: Renderer) -> None:
    trapezium = Quad(((-1, -1, 0), (1, -1, 0), (0.5, 1, 0), (-0.5, 1, 0)))
    for shape in (Sphere(), Cube(), trapezium):
        with pytest.raises(
            SceneError, match=r"pixel_size needs u and v of one length.*this is a \w+: give bump\.repeat"
        ):
            renderer.render(Scene([Surface(shape, MIRROR, TERRAIN)], NORMAL), (16, 16))
    stretched = Surface(Sphere(), MIRROR, replace(TERRAIN, mapping="triplanar"), Transform(scale=(1, 2, 1)))
    with pytest.raises(SceneError, match=r"pixel_size needs a surface that is not stretched"):
        renderer.render(Scene([stretched], NORMAL), (16, 16))
    with pytest.raises(SceneError, match=r"bump\.pixel_size says how large the picture is, and so does bump\.repeat"):
        replace(TERRAIN, repeat=(2, 2))
    for bad in (0, -1, float("nan"), "30 m"):
        with pytest.raises(SceneError, match=r"bump\.pixel_size must be"):
            replace(TERRAIN, pixel_size=bad)  # type: ignore[arg-type]
