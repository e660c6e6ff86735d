"""A part of the reference's picture, and how much its samples leave open."""

from __future__ import annotations

import numpy as np
import pytest

from glbump import patterns, reference
from glbump.camera import Camera
from glbump.environment import Sky
from glbump.errors import SceneError
from glbump.scene import Bump, Material, Scene, Surface
from glbump.shapes import Cube, Sphere, Transform
from glbump.trade.metrics import compare

BALL = Surface(
    Sphere(), Material(metallic=1, roughness=0), bump=Bump(patterns.dimples((32, 32), seed=1), amplitude=0.1)
)
SCENE = Scene([BALL, Surface(Cube(), transform=Transform(translate=(1, 0.5, -1)))], Sky(), Camera(eye=(0, 0, 4)))


@pytest.mark.parametrize("quality", ["exact", "balanced"])
@pytest.mark.parametrize(
    ("size", "region"), [((26, 23), (4, 0, 22, 9)), ((26, 23), (8, 5, 6, 8)), ((9, 9), (6, 1, 3, 8))]
)
def test_a_region_is_that_part_of_the_whole(quality: str, size: tuple[int, int], region: tuple[int, ...]) -> None:
    left, top, width, height = region
    whole = reference.render(SCENE, size, 4, quality=quality)
    part = reference.render(SCENE, size, 4, quality=quality, region=(left, top, width, height))
    here = np.s_[top : top + height, left : left + width]
    np.testing.assert_array_equal(part.pixels, whole.pixels[here])
    np.testing.assert_array_equal(part.stats["surface"], whole.stats["surface"][here])
    # A neighbour is none.
    assert (part.pixels != np.roll(whole.pixels, 2, axis=1)[here]).any()


@pytest.mark.parametrize(
    "region", [(1, 0, 4, 4), (0, 1, 4, 4), (0, 0, 3, 4), (0, 0, 20, 4), (-2, 0, 4, 4), (0, 0, 0, 4)]
)
def test_a_region_that_cuts_quads_or_leaves_the_picture_is_refused(region: tuple[int, int, int, int]) -> None:
    with pytest.raises(SceneError, match="region must be"):
        reference.render(SCENE, (16, 16), 1, region=region)


def test_halves_are_the_picture_and_say_what_it_lacks() -> None:
    some = reference.render(SCENE, (32, 32), 16)
    one, other = some.stats["halves"]
    np.testing.assert_allclose((one + other) / 2, some.pixels, atol=1e-6)
    said = compare(one, other, perceptual=False)["rmse"] / 2
    true = compare(some, reference.render(SCENE, (32, 32), 400), perceptual=False)["rmse"]
    # Samples on a grid are not independent: the estimate is of the size, not the value.
    assert 0.4 * true < said < 2.5 * true, (said, true)
    assert len(reference.render(SCENE, (8, 8), 1).stats["halves"]) == 0
