"""Refraction and Fresnel's share by their laws: Snell's, reversal, Brewster's and the critical angle, energy."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest

from glbump.glsltest import Glsl, inputs
from glbump.reference.reflect import f0_from_ior, fresnel_dielectric, fresnel_schlick, reflect_dir, refract_dir

F64 = npt.NDArray[np.float64]
ROUNDING = 1e-14  # some roundings of float64, of what is near 1
ETAS = (0.25, 1 / 1.5, 0.99, 1.0, 1.01, 1.33, 2.4)


def unit(v: npt.NDArray[np.float32]) -> F64:
    return v.astype(float) / np.linalg.norm(v.astype(float), axis=-1, keepdims=True)


def dot(a: F64, b: F64) -> F64:
    return np.einsum("...i,...i->...", a, b)


@pytest.fixture(scope="module")
def rays() -> tuple[F64, F64]:
    return unit(inputs.directions(3000, 1)), unit(inputs.directions(3000, 2))


def passes(d: F64, n: F64, eta: float) -> npt.NDArray[np.bool_]:
    """Less than the critical angle, by more than rounding."""
    return eta * np.linalg.norm(np.cross(d, n), axis=-1) < 1 - 1e-9


# ---- direction


@pytest.mark.parametrize("eta", ETAS)
def test_refraction_obeys_snell_in_one_plane(rays: tuple[F64, F64], eta: float) -> None:
    d, n = (r[passes(*rays, eta)] for r in rays)
    t = refract_dir(d, n, eta)
    # cross(n, .) holds the sine and the plane at once. Near the critical angle a root makes 1e-5 of 1e-10.
    assert np.abs(np.cross(n, t) - eta * np.cross(n, d)).max() < ROUNDING
    assert np.abs(np.linalg.norm(t, axis=-1) - 1).max() < ROUNDING
    assert (dot(t, n) * dot(d, n) >= 0).all(), "it goes on to where it was going"
    if abs(eta - 1) > 0.1:
        assert np.abs(np.cross(n, refract_dir(d, n, 1 / eta)) - eta * np.cross(n, d)).max() > 0.1, "eta upside down"


@pytest.mark.parametrize("eta", ETAS)
def test_the_way_back_is_the_way_in(rays: tuple[F64, F64], eta: float) -> None:
    d, n = (r[passes(*rays, eta)] for r in rays)
    for side in (n, -n):
        back = refract_dir(-refract_dir(d, n, eta), side, 1 / eta)
        # At the critical angle the refracted ray is along the surface, where its cosine is the root of a rounding.
        assert np.abs(back + d).max() < 1e-7


def test_no_change_of_index_changes_nothing(rays: tuple[F64, F64]) -> None:
    d, n = rays
    assert np.abs(refract_dir(d, n, 1.0) - d).max() < 1e-7  # grazing rays: the root of a rounding
    for straight in (n, -n):
        assert np.abs(refract_dir(straight, n, 1.5) - straight).max() < ROUNDING


@pytest.mark.parametrize("eta", [1.01, 1.33, 2.4])
def test_total_reflection_is_the_mirror(rays: tuple[F64, F64], eta: float) -> None:
    d, n = rays
    beyond = eta * np.linalg.norm(np.cross(d, n), axis=-1) > 1 + 1e-9
    assert beyond.sum() > 100
    assert np.array_equal(refract_dir(d, n, eta)[beyond], reflect_dir(d, n)[beyond])


@pytest.mark.parametrize("kind", [np.float32, np.float64])
def test_the_critical_angle_to_one_float(glsl: Glsl, kind: type[np.floating]) -> None:
    """eta = 2: the critical sine is 1/2, a float; one float to either side tells the two cases apart."""
    refract = glsl("lib/reflect.glsl").refract_dir if kind is np.float32 else refract_dir
    n = np.array([0, 1, 0], kind)
    for sine, sign in ((np.nextafter(kind(0.5), kind(0)), -1), (kind(0.5), 0), (np.nextafter(kind(0.5), kind(1)), 1)):
        got = refract(np.array([sine, -np.sqrt(1 - float(sine) ** 2), 0], kind), n, 2.0)
        assert np.sign(got[1]) == sign
        assert got[0] == pytest.approx(0.5 if sign > 0 else 1.0, abs=4 * float(np.finfo(kind).eps))


# ---- share


def cosines(eta: float) -> F64:
    """Cosines of all angles that are refracted, and of grazing ones the more."""
    c = np.concatenate([np.linspace(0, 1, 201), np.geomspace(1e-12, 1, 101)])
    return c[1 - eta * eta * (1 - c * c) > 0] if eta > 1 else c


def behind(c: F64, eta: float) -> F64:
    """The refracted cosine, without cancellation: c and eta may be near 0 and near 1."""
    return np.sqrt((1 - eta) * (1 + eta) + (eta * c) ** 2)


def textbook(c: F64, eta: float) -> tuple[F64, F64]:
    """The two amplitudes squared (Born and Wolf 1.5.2, equation 21): s, p."""
    t = behind(c, eta)
    return ((eta * c - t) / (eta * c + t)) ** 2, ((c - eta * t) / (c + eta * t)) ** 2


@pytest.mark.parametrize("eta", [e for e in ETAS if e != 1])
def test_the_share_is_the_textbooks(eta: float) -> None:
    c = cosines(eta)
    s, p = textbook(c, eta)
    # The textbook's differences lose 1e-16 of what is as large as eta.
    assert np.abs(fresnel_dielectric(c, eta) - (s + p) / 2).max() < 1e-13
    assert np.abs(fresnel_dielectric(c, 1 / eta) - (s + p) / 2).max() > 1e-3 * abs(eta - 1), "eta upside down"


@pytest.mark.parametrize("ior", [1.0001, 1.33, 1.5, 2.4, 4.0])
def test_straight_on_it_is_f0(ior: float) -> None:
    for eta in (ior, 1 / ior):
        assert fresnel_dielectric(1.0, eta) == pytest.approx(f0_from_ior(ior), rel=1e-11)


@pytest.mark.parametrize("eta", [e for e in ETAS if e != 1])
def test_the_share_is_the_same_both_ways(eta: float) -> None:
    c = cosines(eta)
    t = behind(c, eta)
    there, back = fresnel_dielectric(c, eta), fresnel_dielectric(t, 1 / eta)
    # At the critical angle c is the root of what rounding t leaves: some 1e-16 / eta^2, times a slope of 8.
    assert np.abs(there - back).max() < 1e-6
    assert np.median(np.abs(there - back)) < ROUNDING
    f0 = np.full(3, f0_from_ior(eta))
    schlick = np.abs(fresnel_schlick(f0, c) - fresnel_schlick(f0, t)).max()
    assert schlick > 1e-3, "Schlick's approximation is not reversible"


@pytest.mark.parametrize("eta", [0.25, 1 / 1.5, 1.33, 2.4])
def test_nothing_is_lost(eta: float) -> None:
    """1 = F + T, T from the amplitudes that pass: T = n_t cos_t / (n_i cos_i) |t|^2."""
    c = cosines(eta)
    c = c[c > 0]
    t = behind(c, eta)
    passed = sum(t / (eta * c) * (2 * eta * c / below) ** 2 for below in (eta * c + t, c + eta * t)) / 2
    assert np.abs(fresnel_dielectric(c, eta) + passed - 1).max() < ROUNDING


@pytest.mark.parametrize("ior", [1.33, 1.5, 2.4])
def test_diffuse_light_leaves_as_little_as_radiance_allows(ior: float) -> None:
    """1 - F inside = (1 - F outside) / ior^2, each averaged over a hemisphere (Egan and Hilgeman 1979)."""
    x, w = np.polynomial.legendre.leggauss(200)
    c, w = (x + 1) / 2, w / 2
    outside = (w * 2 * c * fresnel_dielectric(c, 1 / ior)).sum()
    edge = np.sqrt(1 - 1 / ior**2)
    lit = edge + (1 - edge) * c**2  # smooth across the root at the critical angle
    inside = edge**2 + (w * 2 * lit * fresnel_dielectric(lit, ior) * 2 * c * (1 - edge)).sum()
    assert 1 - inside == pytest.approx((1 - outside) / ior**2, rel=1e-9)


@pytest.mark.parametrize("ior", [1.1, 1.5, 2.4])
def test_at_brewsters_angle_one_polarisation_is_left(ior: float) -> None:
    for eta in (ior, 1 / ior):
        c = 1 / np.hypot(1, 1 / eta)  # tan = index behind over before
        s, p = textbook(np.array(c), eta)
        assert p < ROUNDING**2
        assert fresnel_dielectric(c, eta) == pytest.approx(s / 2, rel=1e-12)
        assert s == pytest.approx(((ior**2 - 1) / (ior**2 + 1)) ** 2, rel=1e-12)


def test_all_is_reflected_past_the_critical_angle_and_at_grazing() -> None:
    critical = np.sqrt(0.75)  # eta = 2
    assert fresnel_dielectric(critical * (1 - 1e-15), 2.0) == 1
    assert fresnel_dielectric(0.0, 2.0) == 1
    assert fresnel_dielectric(0.0, 0.5) == pytest.approx(1, abs=ROUNDING)
    # Towards it as the root: 1 - F = k sqrt(c - critical), and the same from within float64's reach.
    off = np.array([1e-6, 1e-8, 1e-10])
    left = 1 - fresnel_dielectric(critical + off, 2.0)
    assert left[:-1] / left[1:] == pytest.approx(10, rel=0.02)


def test_no_more_than_all_is_reflected(glsl: Glsl) -> None:
    """Also where both terms are 1 but for rounding: what is let through is 1 less this, and never negative."""
    c, eta = inputs.every(np.append(0, inputs.log_uniform(300, 1e-9, 1)), inputs.log_uniform(300, 1e-3, 10, seed=1))
    got = glsl("lib/reflect.glsl").fresnel_dielectric(c, eta)
    assert 0 <= got.min() < got.max() == 1


def test_no_change_of_index_reflects_nothing_at_all(glsl: Glsl) -> None:
    c = np.concatenate([inputs.floats(0, 1), inputs.uniform(1000)])
    assert not fresnel_dielectric(c, 1.0).any()
    assert not glsl("lib/reflect.glsl").fresnel_dielectric(c, 1.0).any()
    naive = glsl(
        """
        float naive(float c, float eta) {
            float t = sqrt(max(1.0 - eta * eta * (1.0 - c * c), 0.0));
            float s = (eta * c - t) / (eta * c + t);
            return s * s;
        }
        """
    ).naive
    assert naive(np.float32(1e-4), 1.0) > 0.5, "the form that one writes first is a mirror at grazing angles"


def test_one_float_from_1_it_is_as_little_as_it_should_be(glsl: Glsl) -> None:
    c, eta = inputs.every(inputs.uniform(500, 0.01, 1), np.float32([1 - 2.0**-24, 1 + 2.0**-23]))
    got = glsl("lib/reflect.glsl").fresnel_dielectric(c, eta)
    # Below 1e-10 all of it: relative, where the textbook's differences would leave nothing.
    assert got == pytest.approx(fresnel_dielectric(c, eta), rel=1e-5)
    assert 0 < got.min() < got.max() < 1e-5
