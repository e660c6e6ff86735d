"""Bump mapping against true displacement: the small-B normal errs as A^2, the lecture's printed sign as A, and the full
form not at all."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt
import pytest

from glbump.maps.angles import degrees_between
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


def _waves(u: F64, v: F64) -> tuple[F64, F64]:
    """(N,) a height of amplitude 1, and (N, 2) its derivatives."""
    height = np.sin(7 * u + 1.3) * np.cos(5 * v + 0.4)
    along_u, along_v = 7 * np.cos(7 * u + 1.3) * np.cos(5 * v + 0.4), -5 * np.sin(7 * u + 1.3) * np.sin(5 * v + 0.4)
    return height, np.stack([along_u, along_v], axis=-1)


def _displaced(u: F64, v: F64, amplitude: float) -> F64:
    """Normals of O' = O + A B n by differences of its points alone: fourth order, error 1e-9 at this step."""
    step = 1e-3

    def point(u: F64, v: F64) -> F64:
        out = np.stack([np.cos(v) * np.sin(u), np.sin(v), np.cos(v) * np.cos(u)], axis=-1)
        ring = RADIUS * np.stack([np.sin(u), 0 * u, np.cos(u)], axis=-1)
        return ring + (TUBE + amplitude * _waves(u, v)[0])[:, None] * out

    def along(du: float, dv: float) -> F64:
        steps = [point(u + k * du, v + k * dv) for k in (1, -1, 2, -2)]
        return (8 * (steps[0] - steps[1]) - (steps[2] - steps[3])) / (12 * step)

    normal = np.cross(along(step, 0), along(0, step))
    return normal / np.linalg.norm(normal, axis=-1, keepdims=True)


def _small(n: F64, pu: F64, pv: F64, nu: F64, nv: F64, height: F64, slope: F64) -> F64:
    return bump.bump_normal(n, bump.surface_gradient(n, pu, pv, slope))


def _full(n: F64, pu: F64, pv: F64, nu: F64, nv: F64, height: F64, slope: F64) -> F64:
    return bump.bump_normal(n, bump.full_gradient(n, pu, pv, nu, nv, height, slope))


def _printed(n: F64, pu: F64, pv: F64, nu: F64, nv: F64, height: F64, slope: F64) -> F64:
    """The lecture's D = Bu (n x Ov) + Bv (n x Ou), as its slide has it."""
    bent = np.cross(pu, pv) + slope[:, :1] * np.cross(n, pv) + slope[:, 1:] * np.cross(n, pu)
    return bent / np.linalg.norm(bent, axis=-1, keepdims=True)


def _errors(form: Callable[..., F64]) -> F64:
    """Mean and worst angle to the normal of the displaced surface, for each amplitude."""
    u, v, *frame = _torus()
    height, slope = _waves(u, v)
    angles = [degrees_between(form(*frame, a * height, a * slope), _displaced(u, v, a)) for a in AMPLITUDES]
    return np.array([(angle.mean(), angle.max()) for angle in angles])


def _order(errors: F64) -> float:
    """Slope of the log-log line through the errors."""
    return float(np.polyfit(np.log(AMPLITUDES), np.log(errors), 1)[0])


def test_the_small_b_normal_errs_as_the_square_of_the_amplitude() -> None:
    assert _order(_errors(_small)[:, 0]) == pytest.approx(2.0, abs=0.1)


def test_the_full_form_is_the_normal_of_the_displaced_surface() -> None:
    # What is left is that of the differences; the small form fails by 1e-4 at the least amplitude but one.
    assert _errors(_full)[:, 1].max() < 1e-5
    assert _errors(_small)[1:, 1].min() > 1e-5


def test_the_lectures_printed_sign_errs_as_the_amplitude_itself() -> None:
    # D = Bu (n x Ov) + Bv (n x Ou) as printed; the second term needs Ou x n. The test above would reject it.
    # Its errors bend over near 90 degrees, which takes 0.05 off the slope.
    assert _order(_errors(_printed)[:, 0]) == pytest.approx(1.0, abs=0.1)


def test_published_errors_of_both_signs() -> None:
    # Mean degrees at A = 1e-2, measured independently of this code with finite differences: 9.4e-3 and 3.54.
    # They depend on where the points lie, so a tenth is left.
    assert _errors(_small)[2, 0] == pytest.approx(9.4e-3, rel=0.1)
    assert _errors(_printed)[2, 0] == pytest.approx(3.54, rel=0.1)


def test_surface_gradient_is_blinns_small_b_form() -> None:
    u, v, n, pu, pv, *_ = _torus()
    slope = 0.3 * np.stack([np.sin(3 * u), np.cos(2 * v)], axis=-1)
    blinn = np.cross(pu, pv) + slope[:, :1] * np.cross(n, pv) + slope[:, 1:] * np.cross(pu, n)
    blinn /= np.linalg.norm(blinn, axis=-1, keepdims=True)
    assert degrees_between(bump.bump_normal(n, bump.surface_gradient(n, pu, pv, slope)), blinn).max() < 1e-12


def test_a_flat_map_leaves_every_normal_as_it_was() -> None:
    # But for the last bit of its length.
    _, _, n, pu, pv, *_ = _torus()
    assert degrees_between(bump.bump_normal(n, bump.surface_gradient(n, pu, pv, np.zeros(2))), n).max() < 1e-13


@pytest.mark.parametrize("tilt", [1e-6, 0.1, 1.0, 40.0])
def test_a_slope_tilts_by_its_arc_tangent(tilt: float) -> None:
    # Along u, which is 3 world units long: a height that rises by 3 tilt per u climbs with slope `tilt`.
    n = bump.bump_normal((0, 0, 1), bump.surface_gradient((0, 0, 1), (3, 0, 0), (0, 2, 0), (3 * tilt, 0)))
    assert degrees_between(n, np.array([-tilt, 0, 1]) / np.hypot(1, tilt)) < 1e-12


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


def _mapped_torus() -> tuple[F64, ...]:
    """The torus as shaders map it: points, n, dp/du, dp/dv, dn/du, dn/dv per unit of u and v."""
    _, _, n, *_ = _torus()
    ring = n[:, [0, 2]] / np.maximum(np.hypot(n[:, 0], n[:, 2]), 1e-30)[:, None]
    p = TUBE * n + RADIUS * np.stack([ring[:, 0], 0 * ring[:, 0], ring[:, 1]], axis=-1)
    derivatives = mapping.torus_dpdu(p), mapping.torus_dpdv(p, RADIUS)
    return (
        p,
        mapping.torus_normal(p, RADIUS),
        *derivatives,
        mapping.torus_dndu(p, RADIUS),
        mapping.torus_dndv(p, RADIUS),
    )


def test_derivatives_of_normals_are_derivatives() -> None:
    # One-sided differences of step 1e-6: their error is the step times second derivatives of (2 pi)^2.
    step = 1e-6
    p, n, *firsts, dndu, dndv = _mapped_torus()
    for along, change in zip(firsts, (dndu, dndv), strict=True):
        moved = mapping.torus_normal(p + step * along, RADIUS)
        assert (moved - n) / step == pytest.approx(change, abs=1e-3)
    ball = 2.5 * n
    for along, change in (
        (mapping.sphere_dpdu(ball), mapping.sphere_dndu(ball, 2.5)),
        (mapping.sphere_dpdv(ball), mapping.sphere_dndv(ball, 2.5)),
    ):
        moved = ball + step * along
        moved /= np.linalg.norm(moved, axis=-1, keepdims=True)
        assert (moved - n) / step == pytest.approx(change, abs=1e-3)


def test_the_full_form_does_not_know_the_parametrisation() -> None:
    """The same surface and height in other u, v, mirrored ones among them."""
    _, n, pu, pv, nu, nv = _mapped_torus()
    height, slope = np.full(len(n), 0.2), np.tile([0.4, -1.1], (len(n), 1))
    want = bump.full_gradient(n, pu, pv, nu, nv, height, slope)
    for m in ([[2.0, 0.3], [-0.5, 1.0]], [[-1.0, 0.0], [0.4, 3.0]]):
        other = [a * along_u + b * along_v for along_u, along_v in ((pu, pv), (nu, nv)) for a, b in m]
        got = bump.full_gradient(n, other[0], other[1], other[2], other[3], height, slope @ np.transpose(m))
        assert got == pytest.approx(want)


def test_even_heights_bend_nothing_and_flat_surfaces_know_no_height() -> None:
    _, n, pu, pv, nu, nv = _mapped_torus()
    none = np.zeros((len(n), 2))
    assert bump.full_gradient(n, pu, pv, nu, nv, np.full(len(n), 0.3), none) == pytest.approx(np.zeros_like(n))
    flat = (0, 0, 1), (3, 0, 0), (0, 2, 0), (0, 0, 0), (0, 0, 0)
    assert bump.full_gradient(*flat, 1e6, (0.3, 0.2)) == pytest.approx(bump.surface_gradient(*flat[:3], (0.3, 0.2)))


@pytest.mark.parametrize("height", [-0.6999, -0.7, -0.7001, -3.0, 1e18, -1e18])
def test_heights_past_the_centres_of_curvature_have_a_normal_on_the_outer_side(height: float) -> None:
    """-0.7 is the middle of the tube, where the normal lies flat. Past it the surface is inside out."""
    _, n, pu, pv, nu, nv = _mapped_torus()
    slope = np.tile([1.0, 1.0], (len(n), 1))
    gradient = bump.full_gradient(n, pu, pv, nu, nv, np.full(len(n), height), slope)
    assert np.isfinite(gradient).all()
    bent = bump.bump_normal(n, gradient)
    assert np.linalg.norm(bent, axis=-1) == pytest.approx(1)
    # Next to the middle slopes reach 1e15, and the sines of what is left are rounding.
    assert np.einsum("ni,ni->n", bent, n).min() > -1e-12


def test_a_centre_of_curvature_met_to_the_bit_has_no_bump() -> None:
    # A ball of radius 2 pushed in by 2: the surface is a point.
    n, pu, pv = (1.0, 0, 0), np.array([0, 2.0, 0]), np.array([0, 0, 2.0])
    assert (bump.full_gradient(n, pu, pv, pu / 2, pv / 2, -2.0, (1.0, 1.0)) == 0).all()
    assert (bump.full_gradient(n, pu, pv, pu / 2, pv / 2, -1.999, (1.0, 1.0)) != 0).any()


@pytest.mark.parametrize("size", [1e-6, 1.0, 1e6])
def test_the_invariant_bump_does_not_know_the_size(size: float) -> None:
    """Blinn's thesis, p. 140: N turned by acos(1 / sqrt(1 + Fu^2 + Fv^2)), whatever the lengths of Pu and Pv."""
    _, n, pu, pv, *_ = _mapped_torus()
    slope = np.tile([0.3, -0.4], (len(n), 1))
    bent = bump.bump_normal(n, bump.invariant_gradient(n, size * pu, size * pv, slope))
    # cosines lose half of the digits.
    assert np.einsum("ni,ni->n", bent, n) == pytest.approx(1 / np.sqrt(1.25), abs=1e-12)
    metric = bump.bump_normal(n, bump.surface_gradient(n, pu, pv, slope))
    assert np.einsum("ni,ni->n", np.cross(bent, metric), n) == pytest.approx(0, abs=1e-12)  # the same direction
    assert (np.einsum("ni,ni->n", np.cross(n, bent), np.cross(n, metric)) > 0).all()
    # The metric one flattens as the surface grows: a neighbour that this test would reject.
    larger = bump.bump_normal(n, bump.surface_gradient(n, 2 * pu, 2 * pv, slope))
    assert degrees_between(larger, metric).min() > 0.1


def test_the_invariant_bump_goes_with_mirrored_coordinates() -> None:
    _, n, pu, pv, *_ = _mapped_torus()
    slope = np.tile([0.3, -0.4], (len(n), 1))
    plain = bump.invariant_gradient(n, pu, pv, slope)
    assert bump.invariant_gradient(n, -pu, pv, slope * (-1, 1)) == pytest.approx(plain)
    assert bump.invariant_gradient(n, pu, 0 * pv, slope) == pytest.approx(0 * n)  # no area: no bump
    assert bump.invariant_gradient(n, pu, pv, 0 * slope) == pytest.approx(0 * n)
    assert np.isfinite(bump.invariant_gradient(n, pu, pv, 1e30 * slope)).all()
