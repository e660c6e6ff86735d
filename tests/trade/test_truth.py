"""The truth of a scene: the reference, or the driver's own picture, checked on tiles."""

from __future__ import annotations

import numpy as np
import pytest

from glbump import patterns, reference
from glbump.camera import Camera
from glbump.environment import Chrome, Sky
from glbump.gl.renderer import Renderer
from glbump.scene import Bump, Material, Scene, Surface
from glbump.shapes import Sphere
from glbump.trade import truth as finding
from glbump.trade.truth import DRIVER, REFERENCE, UNSURE, find_truth, tiles

MIRROR = Material(metallic=1, roughness=0)
BALL = Scene([Surface(Sphere(), MIRROR)], Sky(), Camera(eye=(0, 0, 4)))
SIZE = (48, 40)


def test_the_truth_is_the_reference(renderer: Renderer) -> None:
    truth = find_truth(BALL, SIZE, 16, renderer)
    whole = reference.render(BALL, SIZE, 16)
    assert truth.source == REFERENCE
    np.testing.assert_array_equal(truth.pixels, whole.pixels)
    assert truth.checked is None
    # A ring round the ball, of its outline's pixels.
    outline = np.pi * 2 * 40 / 2 * 0.71
    assert 0.5 * outline < truth.several.sum() < 2 * outline


def test_without_time_for_it_the_driver_draws_the_truth_and_tiles_check_it(renderer: Renderer) -> None:
    truth = find_truth(BALL, SIZE, 16, renderer, seconds=0)
    assert truth.source == DRIVER
    assert truth.checked is not None
    assert truth.tiles >= 8
    whole = reference.render(BALL, SIZE, 16)
    off = np.sqrt(np.mean((truth.pixels - whole.pixels) ** 2))
    assert off < 2 / 255
    assert truth.checked.low <= truth.checked.value <= truth.checked.high < 2 / 255
    assert "tiles" in truth.notes[0]
    assert "at 95 %" in truth.notes[0]


def test_of_a_picture_too_large_for_the_reference_tiles_are_cast_and_that_is_said(
    renderer: Renderer, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(finding, "MOST_PIXELS", 1000)
    truth = find_truth(BALL, SIZE, 4, renderer)
    assert truth.source == DRIVER
    assert truth.several is None
    assert truth.normals is None
    assert "tiles" in truth.notes[0]
    assert "up to 1,000 pixels, not 48x40" in truth.notes[1]


def test_a_truth_that_does_not_converge_is_said_with_what_remains(renderer: Renderer) -> None:
    # Bumps of less than a pixel on a ball that mirrors bands.
    fine = Bump(patterns.dimples((32, 32), seed=1), amplitude=0.02, repeat=(40, 20))
    rough = Scene([Surface(Sphere(), MIRROR, bump=fine)], Chrome(bands=9), Camera(eye=(0, 0, 4)))
    truth = find_truth(rough, SIZE, 4, renderer)
    assert truth.noise > UNSURE
    assert any("has not converged at 4 samples" in note for note in truth.notes)
    true = reference.render(rough, SIZE, 144).pixels
    from glbump.trade.metrics import compare

    off = compare(truth.pixels, true, perceptual=False)["rmse"]
    assert 0.3 * off < truth.noise < 3 * off
    # The smooth ball has, but for its outline.
    assert find_truth(BALL, SIZE, 64, renderer).noise < truth.noise / 4


@pytest.mark.parametrize("size", [(256, 256), (1024, 300), (31, 47), (16, 16), (8, 9)])
def test_tiles_lie_apart_within_the_picture_on_whole_quads(size: tuple[int, int]) -> None:
    width, height = size
    found = tiles(size, 64)
    assert len(found) >= 4
    covered = np.zeros((height, width), int)
    for left, top, across, down in found:
        assert left >= 0
        assert top >= 0
        assert left + across <= width
        assert top + down <= height
        assert left % 2 == across % 2 == down % 2 == (height - top - down) % 2 == 0
        covered[top : top + down, left : left + across] += 1
    assert covered.max() == 1
    assert tiles(size, 64) == found
    if size == (256, 256):
        assert len(found) == 64
        # The first of them are spread over the picture as well.
        assert len({(left // 128, top // 128) for left, top, _, _ in found[:16]}) == 4
