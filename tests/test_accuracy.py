"""Pictures of quality "exact" against the float64 reference: benchmarks/accuracy.py, smaller."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.accuracy import LIMITS, against_reference, exact_error, exact_truth, interior
from benchmarks.scenes import CASES, DATA, Case
from glbump.camera import Camera
from glbump.frame import Frame
from glbump.gl.renderer import Renderer
from glbump.quality import Quality
from glbump.reference.shade import BACKGROUND, PIECES, SEVERAL
from glbump.scene import Bump, Scene, Surface, with_value

SIZE = (96, 96)
# A short roughness chain, read by both sides: how well it is made is tested elsewhere, and it takes seconds.
EXACT = Quality("exact", gloss_size=32, gloss_samples=16)

by_name = pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)


def _check(figures: dict[str, float]) -> None:
    # Pixels of one surface, not a few odd ones, are what is compared.
    assert figures["share"] > 0.6
    assert {k: v for k, v in figures.items() if k in LIMITS and not v <= LIMITS[k]} == {}


@by_name
def test_exact_is_the_reference_in_photographed_light(renderer: Renderer, case: Case) -> None:
    if not case.is_there:
        pytest.skip(f"needs the photograph {DATA / case.environment}, which lies beside the project")
    _check(exact_error(renderer, case.photographed(), SIZE, EXACT))


@by_name
def test_exact_is_the_reference_in_computed_light(renderer: Renderer, case: Case) -> None:
    _check(exact_error(renderer, case.computed(), SIZE, EXACT))


@pytest.fixture(scope="module")
def torus(renderer: Renderer) -> tuple[Scene, Frame]:
    """The brick torus in the demo's light, and its reference."""
    scene = next(case for case in CASES if case.name == "brick torus").computed()
    return scene, exact_truth(renderer, scene, SIZE, EXACT)


def _shifted_bricks(scene: Scene) -> Scene:
    surface: Surface = scene.surfaces[0]
    bump = surface.bump
    assert isinstance(bump, Bump)
    heights = np.asarray(bump.height.pixels)  # type: ignore[union-attr]
    # Half a texel to the right, to first order: the mean of a texel and its neighbour, less the blur of that.
    blurred = (heights + 2 * np.roll(heights, 1, axis=1) + np.roll(heights, 2, axis=1)) / 4
    shifted = heights + np.roll(heights, 1, axis=1) - blurred
    return replace(scene, surfaces=[replace(surface, bump=replace(bump, height=shifted))])


@pytest.mark.parametrize(
    "wrong",
    [
        lambda scene: with_value(scene, "environment.rotation", 0.5),
        lambda scene: with_value(scene, "environment.rotation", 360 / 512 / 2),  # half a texel of the panorama
        lambda scene: with_value(scene, "surface.0.transform.rotate", (50.5, 0, 0)),
        lambda scene: with_value(scene, "surface.0.bump.amplitude", 0.0196),
        lambda scene: with_value(scene, "surface.0.bump.amplitude", -0.02),
        lambda scene: with_value(scene, "environment.exposure", 0.05),
        lambda scene: replace(scene, camera=Camera(fov=40.2)),
        _shifted_bricks,
    ],
    ids=["turned by half a degree", "half a texel", "tilted by half a degree", "2 % flatter", "dents", "brighter by "
         "a 20th of a stop", "a wider view", "bricks half a texel aside"],
)  # fmt: skip
def test_a_wrong_neighbour_is_told_apart(renderer: Renderer, torus: tuple[Scene, Frame], wrong: object) -> None:
    scene, truth = torus
    assert callable(wrong)
    figures = exact_error(renderer, wrong(scene), SIZE, EXACT, truth)
    assert any(figures[k] > LIMITS[k] for k in LIMITS)


def test_more_samples_come_nearer(renderer: Renderer, torus: tuple[Scene, Frame]) -> None:
    scene, truth = torus
    errors = [
        against_reference(renderer.render(scene, SIZE, replace(EXACT, samples=n)), truth)["mean"] for n in (1, 4, 16)
    ]
    # With the reference's own samples nothing is left but rounding.
    assert errors[0] > 1.5 * errors[1] > 20 * errors[2]


def test_interior_is_what_one_piece_fills() -> None:
    seen = np.full((5, 6), BACKGROUND)
    seen[:, 3:] = 0
    seen[:, 5] = 1  # another piece of the same surface
    seen[0, 0] = SEVERAL
    expected = np.zeros((5, 6), bool)
    expected[2:, 0:2] = expected[0:2, 1] = True
    expected[0:2, 1] = False  # a neighbour of the pixel that sees several
    expected[2:, 1] = True
    expected[:, 2:6] = False
    assert np.array_equal(interior(seen), expected)
    assert not interior(np.full((3, 3), SEVERAL)).any()
    assert interior(np.full((3, 3), PIECES)).all()
