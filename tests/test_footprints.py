"""Footprints of directions: their derivatives, and levels by their areas."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt
import pytest

from glbump.glsltest import inputs
from glbump.reference import mapping
from glbump.reference.bump import bump_normal
from glbump.reference.direction import turning, unit_dir
from glbump.reference.filter import MOST_THIN, direction_level
from glbump.reference.footprint import (
    bump_normal_change,
    hit_change,
    reflect_dir_change,
    refract_dir_change,
    torus_normal_change,
    uv_change,
)
from glbump.reference.reflect import reflect_dir, refract_dir

F64 = npt.NDArray[np.float64]
RNG = np.random.default_rng(3)
STEP = 1e-5
STEPPED = 1e-8  # of central differences over it: its square, times third derivatives, and 1e-16 over it


def changes(dirs: F64, seed: int = 3) -> F64:
    """Of a tenth of a radian, in all directions; not across the direction alone."""
    return 0.1 * inputs.unit_vectors(len(dirs), seed) * np.linalg.norm(dirs, axis=-1, keepdims=True)


@pytest.fixture(scope="module")
def dirs() -> F64:
    """At all lengths, and farther from the poles than third derivatives grow."""
    d = inputs.unit_vectors(4000, 1).astype(float)
    d = d[np.hypot(d[:, 0], d[:, 2]) > 0.3]
    return d * inputs.log_uniform(len(d), 1e-6, 1e6, (1,), 2)


# ---- derivatives


def test_turning_is_the_change_of_the_unit_direction(dirs: F64) -> None:
    c = changes(dirs)
    want = (unit_dir(dirs + STEP * c) - unit_dir(dirs - STEP * c)) / (2 * STEP)
    assert np.abs(turning(dirs, c) - want).max() < STEPPED
    assert np.abs(turning(dirs, dirs)).max() < 1e-15, "longer is no other direction"


# ---- levels


def sides(dirs: F64, long: float, thin: float = 1.0) -> tuple[F64, F64]:
    """Two sides at right angles, across the direction, `long` radians and `thin` of that."""
    u = unit_dir(dirs)
    x = np.cross(u, np.roll(inputs.unit_vectors(1, 8), 1)[0])
    x /= np.linalg.norm(x, axis=-1, keepdims=True)
    size = np.linalg.norm(dirs, axis=-1, keepdims=True) * long
    return x * size, np.cross(u, x) * size * thin


def test_a_direction_s_level_is_by_area_down_to_the_thinnest_that_counts() -> None:
    ahead = np.array([[0.0, 0.0, -1.0]])
    for thin in (1.0, 0.5, 0.125, 0.1, 1e-6, 0.0):
        ddx, ddy = sides(ahead, 0.02, thin)
        # A parallelogram of 0.02 by thin * 0.02, no thinner than one of eight.
        texels = 0.02**2 * max(thin, 1 / MOST_THIN) * 256**2
        assert direction_level(ddx, ddy, 256) == pytest.approx(0.5 * np.log2(texels))
        # Whichever two of its ellipse's conjugate radii span it.
        for turn in (0.3, 1.0, 2.0):
            c, r = np.cos(turn), np.sin(turn)
            level = direction_level(c * ddx + r * ddy, c * ddy - r * ddx, 256)
            assert level == pytest.approx(0.5 * np.log2(texels))


# ---- ray differentials


def unit(v: F64) -> F64:
    result: F64 = v / np.linalg.norm(v, axis=-1, keepdims=True)
    return result


def stepped(f: Callable[..., F64], at: tuple[F64, ...], by: tuple[F64, ...]) -> F64:
    """Central differences of f, where its arguments change by `by`."""
    ahead, behind = (f(*(a + sign * STEP * b for a, b in zip(at, by, strict=True))) for sign in (1, -1))
    return (ahead - behind) / (2 * STEP)


def test_mirrored_refracted_and_bent_change_as_they_do_from_place_to_place() -> None:
    d, n, ddir, dn = (inputs.unit_vectors(2000, seed).astype(float) for seed in range(4))
    d, n = unit(d), unit(n)
    assert np.abs(reflect_dir_change(d, n, ddir, dn) - stepped(reflect_dir, (d, n), (ddir, dn))).max() < STEPPED
    for eta in (1 / 1.5, 1.5):
        inside = np.abs(1 - (eta * np.linalg.norm(np.cross(d, n), axis=-1)) ** 2) > 0.05  # off the critical angle
        ratio = np.full(inside.sum(), eta)
        # dn along the normal: a longer one is no other surface.
        across = (dn - n * np.einsum("ki,ki->k", n, dn)[:, None])[inside]

        def refracted(dir: F64, normal: F64, ratio: F64 = ratio) -> F64:
            return refract_dir(unit(dir), unit(normal), ratio)

        # Rays of any length: the derivative is of unit ones.
        turn = (ddir - d * np.einsum("ki,ki->k", d, ddir)[:, None])[inside]
        got = refract_dir_change(d[inside], n[inside], ratio, turn, across)
        want = stepped(refracted, (d[inside], n[inside]), (turn, across))
        assert np.abs(got - want).max() < 1e-5
        assert np.abs(refract_dir_change(d[inside], n[inside], ratio, 0 * turn, across) - want).max() > 0.1
    g, dg = 0.7 * inputs.unit_vectors(2000, 6).astype(float), inputs.unit_vectors(2000, 7).astype(float)
    assert np.abs(bump_normal_change(n, g, dn, dg) - stepped(bump_normal, (n, g), (dn, dg))).max() < 1e-6


def test_a_point_met_stays_on_its_plane_and_on_its_ray() -> None:
    dp, d, n = (inputs.unit_vectors(1000, seed).astype(float) for seed in range(3))
    got = hit_change(dp, d, n, np.full(1000, 1e-5))
    steep = np.abs(np.einsum("ki,ki->k", d, n)) > 1e-3
    assert np.abs(np.einsum("ki,ki->k", got, n))[steep].max() < 1e-11
    assert np.abs(np.cross(got - dp, d)).max() < 1e-9 * np.abs(got).max()
    # Along the surface the cosine counts as the least.
    flat = hit_change([[0.0, 0, 1]], [[1.0, 0, 0]], [[0.0, 0, 1]], [0.25])
    assert np.abs(flat) == pytest.approx(np.array([[4.0, 0, 1]]))


def test_normals_of_a_torus_and_u_v_change_along_it() -> None:
    turns, psi = (RNG.uniform(-3, 3, 500) for _ in range(2))

    def place(turns: F64, psi: F64) -> F64:
        ring = 1 + 0.4 * np.cos(psi)
        return np.stack([ring * np.sin(turns), 0.4 * np.sin(psi), ring * np.cos(turns)], axis=-1)

    by = RNG.uniform(-1, 1, (2, 500))
    p, dp = place(turns, psi), stepped(place, (turns, psi), (by[0], by[1]))
    want = stepped(lambda a, b: mapping.torus_normal(place(a, b), 1.0), (turns, psi), (by[0], by[1]))
    assert np.abs(torus_normal_change(p, dp, 1.0) - want).max() < 1e-8
    assert np.abs(dp / 0.4 - want).max() > 0.1, "a sphere's is another"
    got = uv_change(dp, mapping.torus_dpdu(p), mapping.torus_dpdv(p, 1.0))
    assert got == pytest.approx(by.T / (2 * np.pi), abs=1e-8)
