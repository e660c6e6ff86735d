"""Bump mapping against true displacement: the small-B normal errs as A^2, the lecture's printed sign as A."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest

from glbump.reference import bump, mapping

F64 = npt.NDArray[np.float64]
RADIUS, TUBE = 2.0, 0.7
AMPLITUDES = np.array([1e-4, 1e-3, 1e-2, 1e-1])


def _torus(rows: int = 40) -> tuple[F64, ...]:
    """Points, normals and first derivatives of points and normals by the angles, on a grid."""
    u, v = (a.ravel() for a in np.meshgrid(np.linspace(0, 2 * np.pi, rows), np.linspace(0, 2 * np.pi, rows)))
    cu, su, cv, sv, zero = np.cos(u), np.sin(u), np.cos(v), np.sin(v), np.zeros_like(u)
    ring = RADIUS + TUBE * cv
    n = np.stack([cv * su, sv, cv * cu], axis=-1)
    pu = np.stack([ring * cu, zero, -ring * su], axis=-1)
    pv = TUBE * np.stack([-sv * su, cv, -sv * cu], axis=-1)
    nu = np.stack([cv * cu, zero, -cv * su], axis=-1)
    nv = np.stack([-sv * su, cv, -sv * cu], axis=-1)
    return u, v, n, pu, pv, nu, nv


def _angle(a: F64, b: F64) -> F64:
    """Degrees; 2 atan2(|a - b|, |a + b|) has no noise floor."""
    norm = np.linalg.norm
    return np.degrees(2 * np.arctan2(norm(a - b, axis=-1), norm(a + b, axis=-1)))


def _errors(lecture_sign: bool) -> F64:
    """Mean angle to the normal of the displaced surface, for each amplitude."""
    u, v, n, pu, pv, nu, nv = _torus()
    errors = []
    for a in AMPLITUDES:
        b = a * np.sin(7 * u + 1.3) * np.cos(5 * v + 0.4)
        bu = 7 * a * np.cos(7 * u + 1.3) * np.cos(5 * v + 0.4)
        bv = -5 * a * np.sin(7 * u + 1.3) * np.sin(5 * v + 0.4)
        # O' = O + B n has these derivatives exactly, with the terms in n_u and n_v that small B leaves out.
        du = pu + bu[:, None] * n + b[:, None] * nu
        dv = pv + bv[:, None] * n + b[:, None] * nv
        truth = np.cross(du, dv)
        truth /= np.linalg.norm(truth, axis=-1, keepdims=True)
        if lecture_sign:
            bent = np.cross(pu, pv) + bu[:, None] * np.cross(n, pv) + bv[:, None] * np.cross(n, pu)
            bent /= np.linalg.norm(bent, axis=-1, keepdims=True)
        else:
            bent = bump.bump_normal(n, bump.surface_gradient(n, pu, pv, np.stack([bu, bv], axis=-1)))
        errors.append(_angle(bent, truth).mean())
    return np.array(errors)


def _order(errors: F64) -> float:
    """Slope of the log-log line through the errors."""
    return float(np.polyfit(np.log(AMPLITUDES), np.log(errors), 1)[0])


def test_the_small_b_normal_errs_as_the_square_of_the_amplitude() -> None:
    assert _order(_errors(lecture_sign=False)) == pytest.approx(2.0, abs=0.1)


def test_the_lectures_printed_sign_errs_as_the_amplitude_itself() -> None:
    # D = Bu (n x Ov) + Bv (n x Ou) as printed; the second term needs Ou x n. The test above would reject it.
    # Its errors bend over near 90 degrees, which takes 0.1 off the slope.
    assert _order(_errors(lecture_sign=True)) == pytest.approx(0.95, abs=0.1)


def test_published_errors_of_both_signs() -> None:
    # Mean degrees at A = 1e-2, measured independently of this code with finite differences: 9.4e-3 and 3.54.
    # They depend on where the points lie, so a tenth is left.
    assert _errors(lecture_sign=False)[2] == pytest.approx(9.4e-3, rel=0.1)
    assert _errors(lecture_sign=True)[2] == pytest.approx(3.54, rel=0.1)


def test_surface_gradient_is_blinns_small_b_form() -> None:
    u, v, n, pu, pv, *_ = _torus()
    slope = 0.3 * np.stack([np.sin(3 * u), np.cos(2 * v)], axis=-1)
    blinn = np.cross(pu, pv) + slope[:, :1] * np.cross(n, pv) + slope[:, 1:] * np.cross(pu, n)
    blinn /= np.linalg.norm(blinn, axis=-1, keepdims=True)
    assert _angle(bump.bump_normal(n, bump.surface_gradient(n, pu, pv, slope)), blinn).max() < 1e-12


def test_a_flat_map_leaves_every_normal_as_it_was() -> None:
    # But for the last bit of its length.
    _, _, n, pu, pv, *_ = _torus()
    assert _angle(bump.bump_normal(n, bump.surface_gradient(n, pu, pv, np.zeros(2))), n).max() < 1e-13


@pytest.mark.parametrize("tilt", [1e-6, 0.1, 1.0, 40.0])
def test_a_slope_tilts_by_its_arc_tangent(tilt: float) -> None:
    # Along u, which is 3 world units long: a height that rises by 3 tilt per u climbs with slope `tilt`.
    n = bump.bump_normal((0, 0, 1), bump.surface_gradient((0, 0, 1), (3, 0, 0), (0, 2, 0), (3 * tilt, 0)))
    assert _angle(n, np.array([-tilt, 0, 1]) / np.hypot(1, tilt)) < 1e-12


def test_orthogonal_gradient_agrees_where_it_may_be_used() -> None:
    rng = np.random.default_rng(1)
    u, _, n, pu, pv, *_ = _torus()
    slope = rng.normal(size=(len(u), 2))
    expected = bump.surface_gradient(n, pu, pv, slope)
    assert np.abs(bump.orthogonal_gradient(pu, pv, slope) - expected).max() < 1e-12
    # A neighbour it must not be used for: a sheared frame.
    sheared = bump.surface_gradient(n, pu, pv + pu, slope)
    assert np.abs(bump.orthogonal_gradient(pu, pv + pu, slope) - sheared).max() > 0.1


def test_mirrored_texture_coordinates_bend_the_same_way() -> None:
    # u runs the other way and the slope with it: the bump in space is the same.
    n, pu, pv, slope = (0, 0, 1), np.array([1.0, 0.2, 0]), np.array([0.1, 1.0, 0]), np.array([0.3, -0.2])
    plain = bump.surface_gradient(n, pu, pv, slope)
    assert bump.surface_gradient(n, -pu, pv, slope * (-1, 1)) == pytest.approx(plain)


def test_sphere_and_torus_derivatives_are_derivatives() -> None:
    rng = np.random.default_rng(2)
    p = rng.normal(size=(50, 3))
    p /= np.linalg.norm(p, axis=-1, keepdims=True)
    step = 1e-6
    for derivative, k in ((mapping.sphere_dpdu, 0), (mapping.sphere_dpdv, 1)):
        moved = p + step * derivative(p)
        change = (mapping.sphere_uv(moved) - mapping.sphere_uv(p)) / step
        assert change == pytest.approx(np.broadcast_to(np.eye(2)[k], change.shape), abs=1e-4)
