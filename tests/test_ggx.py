"""The split-sum fit against quadrature, within the bounds that stand at the function."""

from __future__ import annotations

import re

import numpy as np
import pytest

from glbump.gl.source import find_shaders
from glbump.reference.ggx import dfg_fit, glossy_share

GRID = np.linspace(0.05, 1, 20)


def _dfg(n_dot_v: float, roughness: float, n: int = 128) -> tuple[float, float]:
    """A, B by quadrature over half vectors distributed as GGX, Smith height-correlated (Heitz 2014)."""
    a = roughness**2
    u, w = np.meshgrid((np.arange(n) + 0.5) / n, (np.arange(n) + 0.5) / n)
    cos = np.sqrt((1 - w) / (1 + (a * a - 1) * w))
    h = np.stack([np.sqrt(1 - cos**2) * np.cos(2 * np.pi * u), np.sqrt(1 - cos**2) * np.sin(2 * np.pi * u), cos], -1)
    v = np.array([np.sqrt(1 - n_dot_v**2), 0, n_dot_v])
    v_dot_h = h @ v
    n_dot_l = 2 * v_dot_h * h[..., 2] - n_dot_v
    lit = (n_dot_l > 0) & (v_dot_h > 0)
    n_dot_l, v_dot_h = np.where(lit, n_dot_l, 1), np.where(lit, v_dot_h, 0)
    smith = n_dot_l * np.sqrt(n_dot_v**2 * (1 - a * a) + a * a) + n_dot_v * np.sqrt(n_dot_l**2 * (1 - a * a) + a * a)
    weight = np.where(lit, 2 * n_dot_l * n_dot_v / smith * v_dot_h / (h[..., 2] * n_dot_v), 0)
    fresnel = (1 - v_dot_h) ** 5
    return float((weight * (1 - fresnel)).mean()), float((weight * fresnel).mean())


@pytest.fixture(scope="module")
def truth() -> np.ndarray:
    return np.array([[_dfg(n, r) for r in GRID] for n in GRID])


def _stated(name: str) -> float:
    text = (find_shaders() / "lib/ggx.glsl").read_text()
    found = re.search(rf"\b{name} at most (\d\.\d+)", text)
    assert found, f"ggx.glsl states no bound for {name}"
    return float(found[1])


def test_quadrature_meets_the_closed_form() -> None:
    # NUMERICS: alpha 1, NoV 1, F0 1: 1 - ln 2.
    assert sum(_dfg(1.0, 1.0, 512)) == pytest.approx(1 - np.log(2), abs=2e-4)


def test_the_fit_keeps_its_stated_bounds(truth: np.ndarray) -> None:
    got = dfg_fit(*np.meshgrid(GRID, GRID, indexing="ij"))
    for k, name in enumerate("AB"):
        worst = np.abs(got - truth)[..., k].max()
        # Within, and not idly wide.
        assert 0.7 * _stated(name) < worst <= _stated(name)


@pytest.mark.parametrize("f0", [0.02, 0.04, 0.2, 0.5, 0.7, 1.0])
def test_the_share_keeps_its_stated_bound(truth: np.ndarray, f0: float) -> None:
    fitted = dfg_fit(*np.meshgrid(GRID, GRID, indexing="ij"))
    got, want = (glossy_share(np.full(3, f0), factors) for factors in (fitted, truth))
    assert np.abs(got - want).max() <= _stated("glossy_share") * (f0 < 1) + 1e-12


def test_the_share_of_a_perfect_metal_is_all() -> None:
    factors = dfg_fit(*np.meshgrid(np.linspace(0, 1, 50), GRID))
    assert glossy_share((1, 1, 1), factors) == pytest.approx(1.0)
