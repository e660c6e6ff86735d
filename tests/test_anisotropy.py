"""Footprints that are longer than wide: several look-ups along them come near to the elliptical average."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest

import glbump as gb
from glbump import reference
from glbump.contents import Contents
from glbump.gl.renderer import Renderer
from glbump.glsltest import inputs
from glbump.reference.ewa import elliptical_average
from glbump.reference.filter import footprint_axes, footprint_taps
from glbump.reference.surroundings import Surroundings
from glbump.reference.varied import Varied

F64 = npt.NDArray[np.float64]
RNG = np.random.default_rng(9)
NOISE = RNG.random((64, 128, 3)).astype(np.float32)
PANORAMA = gb.LatLong(NOISE)
MIRROR = gb.Material(metallic=1, roughness=0)
TORUS = gb.Scene([gb.Surface(gb.Torus(), MIRROR, transform=gb.Transform(rotate=(40, 10, 0)))], PANORAMA)


def footprints(count: int, thin: float) -> tuple[F64, F64, F64]:
    """Directions off the poles, and sides 0.15 to 0.6 radians long and `thin` of that wide, sheared."""
    d = inputs.unit_vectors(4 * count, 1).astype(float)
    d = d[np.abs(d[:, 1]) < 0.7][:count]
    d /= np.linalg.norm(d, axis=-1, keepdims=True)
    across = np.cross(d, inputs.unit_vectors(len(d), 2))
    across /= np.linalg.norm(across, axis=-1, keepdims=True)
    size = RNG.uniform(0.15, 0.6, (len(d), 1))
    x, y = across * size, np.cross(d, across) * size * thin
    return d, x + 0.7 * y, y - 0.2 * x * thin


def looked_up(d: F64, x: F64, y: F64, **knobs: object) -> F64:
    quality = gb.Quality("balanced", samples=1, texture_format="float", **knobs)  # type: ignore[arg-type]
    return Surroundings(PANORAMA, quality, Contents(), 1).light(Varied(d, x, y))


def test_the_average_of_a_round_footprint_is_that_of_its_disc() -> None:
    """Of y: the direction's own, to the second order of the width."""
    heights = np.cos((np.arange(64) + 0.5) / 64 * np.pi)[:, None, None].repeat(128, axis=1)
    d, x, y = footprints(30, 1.0)
    got = elliptical_average(heights, d, 0.3 * x, 0.3 * y)[:, 0]
    assert got == pytest.approx(d[:, 1], abs=0.01)
    assert elliptical_average(np.ones((64, 128, 2)), d, x, y) == pytest.approx(1.0)


@pytest.mark.parametrize("thin", [0.1, 0.25])
def test_look_ups_along_it_come_nearer_to_the_elliptical_average(thin: float) -> None:
    d, x, y = footprints(150, thin)
    truth = elliptical_average(NOISE, d, x, y)
    error = {n: float(np.sqrt(((looked_up(d, x, y, anisotropy=n) - truth) ** 2).mean())) for n in (1, 2, 4, 8)}
    # Of noise with a deviation of 0.29; what is left is the levels' own shape, a box and a tent for a Gaussian.
    assert error[4] < 0.7 * error[1]
    assert error[8] < 1.1 * error[4]
    # Across it blurs what lies beside, by its longer side.
    longest = looked_up(d, x, y, environment_level="longest")
    assert error[4] < float(np.sqrt(((longest - truth) ** 2).mean()))


def test_round_footprints_and_magnified_ones_take_one() -> None:
    d, x, y = footprints(50, 1.0)
    axes = footprint_axes(x - 0.7 * y, y)
    assert (footprint_taps(*axes, 20.0, 16) <= 2).all()
    assert (footprint_taps(np.array([[1e-3, 0, 0]]), np.array([[0, 1e-6, 0]]), 20.0, 16) == 1).all()
    assert footprint_taps(np.array([[0.5, 0, 0]]), np.array([[0, 0.1, 0]]), 20.0, 16) == 5
    assert footprint_taps(np.array([[0.5, 0, 0]]), np.array([[0, 0.0, 0]]), 20.0, 4) == 4
    one, many = (looked_up(d, 1e-4 * x, 1e-4 * y, anisotropy=n) for n in (1, 8))
    assert many == pytest.approx(one, abs=1e-12)


def test_axes_keep_what_a_footprint_covers() -> None:
    _, x, y = footprints(200, 0.2)
    major, minor = footprint_axes(x, y)
    assert np.einsum("ki,ki->k", major, minor) == pytest.approx(0, abs=1e-15)
    assert (np.linalg.norm(major, axis=-1) >= np.linalg.norm(minor, axis=-1)).all()
    # The same ellipse: the sum of the sides' products with themselves.
    before, after = (
        np.einsum("ki,kj->kij", *2 * (a,)) + np.einsum("ki,kj->kij", *2 * (b,)) for a, b in ((x, y), (major, minor))
    )
    assert after == pytest.approx(before, abs=1e-15)


@pytest.mark.parametrize("layout", ["given", "cube", "octahedral"])
def test_the_gpu_does_as_the_reference(renderer: Renderer, layout: str) -> None:
    quality = gb.Quality("balanced", samples=1, anisotropy=4, environment_layout=layout)
    got = renderer.render(TORUS, (96, 96), quality).pixels
    if layout == "given":
        want = reference.render(TORUS, (96, 96), 1, quality=quality).pixels
        # In halves; outlines apart, where one of both sees the sky.
        assert np.percentile(np.abs(got - want), 97) < 3e-3
        assert (
            np.percentile(np.abs(renderer.render(TORUS, (96, 96), gb.Quality("balanced", samples=1)).pixels - want), 97)
            > 0.02
        )
    reads = renderer.render(TORUS, (96, 96), quality, show="cost").pixels[..., 0]
    each = 2 if layout == "octahedral" else 1
    assert set(np.unique(reads)) == {1 * each, 2 * each, 3 * each, 4 * each}


def test_pictures_come_nearer_to_the_truth(renderer: Renderer) -> None:
    truth = renderer.render(TORUS, (96, 96), gb.Quality("exact", samples=256)).pixels

    def error(**knobs: int) -> float:
        quality = gb.Quality("balanced", samples=1, **knobs)  # type: ignore[arg-type]
        return float(np.sqrt(((renderer.render(TORUS, (96, 96), quality).pixels - truth) ** 2).mean()))

    assert error(anisotropy=8) < 0.8 * error(anisotropy=1)
