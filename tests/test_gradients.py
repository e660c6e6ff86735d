"""Every way to take a gradient of a height map, by law; and those of the shaders, where samplers matter."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from glbump.errors import ImageError
from glbump.glsltest import Glsl
from glbump.maps.bspline import coefficients
from glbump.maps.gradients import BORDERS, KERNELS, METHODS
from glbump.maps.heights import slopes
from glbump.reference import gradients as twin

ORDERS = {**{name: kernel.order for name, kernel in KERNELS.items()}, "bspline": 4}
IN_SHADER = [name for name in vars(twin) if name.startswith("slope_")]
# float32 of slopes: what `slopes` gives is rounded once.
ROUNDED = 2.0**-24
RNG = np.random.default_rng(5)


def borders(method: str) -> list[str]:
    return ["wrap"] if method == "spectral" else list(BORDERS)


METHODS_AND_BORDERS = [(m, b) for m in METHODS for b in borders(m)]


def centres(height: int, width: int) -> Any:
    """u, v of the texel centres: u right, v up, row 0 on top."""
    return np.meshgrid((np.arange(width) + 0.5) / width, 1 - (np.arange(height) + 0.5) / height)


def hill(u: Any, v: Any) -> tuple[Any, Any]:
    """A height that repeats, of all frequencies, and its slopes (..., 2)."""
    a, b = 2 * np.pi * u, 2 * np.pi * v
    h = np.exp(0.5 * np.sin(a + 0.4) + 0.3 * np.cos(b - a))
    du = np.pi * np.cos(a + 0.4) + 0.6 * np.pi * np.sin(b - a)
    return h, h[..., None] * np.stack([du, -0.6 * np.pi * np.sin(b - a)], axis=-1)


# Laws


@pytest.mark.parametrize(("method", "border"), METHODS_AND_BORDERS)
@pytest.mark.parametrize("value", [0.0, 0.37, -1e30])
def test_a_constant_map_has_no_slope_at_all(method: str, border: str, value: float) -> None:
    for shape in ((6, 9), (5, 4), (1, 1), (1, 7), (2, 1), (2, 2)):
        assert not slopes(np.full(shape, value), method, border).any()


@pytest.mark.parametrize(("method", "border"), METHODS_AND_BORDERS)
def test_along_one_texel_there_is_no_slope(method: str, border: str) -> None:
    for n in (1, 2, 9):
        got = slopes(RNG.uniform(size=(1, n)), method, border)
        assert got.shape == (1, n, 2)
        assert not got[..., 1].any()
        assert np.isfinite(got).all()
        assert got[..., 0].any() == (n == 9 or (n == 2 and (border != "wrap" or method == "forward")))


@pytest.mark.parametrize("method", [m for m in METHODS if m != "spectral"])
def test_a_tilted_plane_is_exact_inside(method: str) -> None:
    """All differences of a plane are exact; what a border does has died out of a spline after 28 texels."""
    height, width = 71, 90
    u, v = centres(height, width)
    for border in BORDERS:
        got = slopes(3 + 0.5 * u - 0.25 * v, method, border)
        inside = got[30:-30, 30:-30]
        assert np.abs(inside - (0.5, -0.25)).max() < 1e-7
        # Clamped, the difference that leaves the map sees half of the slope, or none.
        assert np.abs(got[:, -1, 0] - 0.5).min() > 0.1


@pytest.mark.parametrize(("method", "border"), METHODS_AND_BORDERS)
def test_slopes_add_and_scale(method: str, border: str) -> None:
    a, b = RNG.uniform(size=(2, 15, 24))
    tolerance = 24 * 8 * ROUNDED  # slopes up to the size times the largest weights
    assert (
        np.abs(slopes(a + b, method, border) - slopes(a, method, border) - slopes(b, method, border)).max() < tolerance
    )
    assert np.abs(slopes(-2 * a + 7, method, border) + 2 * slopes(a, method, border)).max() < 2 * tolerance


@pytest.mark.parametrize(("method", "border"), METHODS_AND_BORDERS)
def test_u_and_v_are_alike(method: str, border: str) -> None:
    """A map turned about its diagonal from lower left has its slopes exchanged; wrapping, a shift shifts them."""
    a = RNG.uniform(size=(8, 13))
    turned = slopes(a[::-1].T[::-1], method, border)
    assert np.abs(turned - slopes(a, method, border)[::-1].swapaxes(0, 1)[::-1, :, ::-1]).max() < 1e-5
    if border == "wrap":
        shifted = slopes(np.roll(a, (3, 5), (0, 1)), method)
        assert np.abs(shifted - np.roll(slopes(a, method), (3, 5), (0, 1))).max() < 1e-5


@pytest.mark.parametrize("method", METHODS)
def test_the_slope_does_not_change_with_the_resolution(method: str) -> None:
    """One hill at 64 to 512 texels: every resolution within its own error of the analytic slopes, errors falling."""
    errors = []
    for n in (64, 128, 256, 512):
        h, wanted = hill(*centres(n, n * 3 // 4))
        errors.append(np.abs(slopes(h, method) - wanted).max())
    steepest = np.abs(wanted).max()
    assert errors[-1] < {1: 0.03, 2: 2e-4, 4: 1e-6}.get(ORDERS.get(method, 4), 1e-6) * steepest
    assert errors[0] < {1: 0.25, 2: 0.02, 4: 3e-4}.get(ORDERS.get(method, 4), 1e-6) * steepest


@pytest.mark.parametrize("method", list(ORDERS))
def test_order_of_convergence(method: str) -> None:
    """The slope of the error, log over log, between sizes where it is well above float32's rounding."""
    sizes = np.array([16, 24, 32, 48, 64]) * (4 if ORDERS[method] < 4 else 1)
    errors = []
    for n in sizes:
        h, wanted = hill(*centres(n, n))
        errors.append(np.sqrt(np.mean((slopes(h, method) - wanted) ** 2)))
    order = -np.polyfit(np.log(sizes), np.log(errors), 1)[0]
    assert order == pytest.approx(ORDERS[method], abs=0.1)


def test_scharr_is_best_at_directions_and_fourth_at_lengths() -> None:
    """A wave of 8 texels, 22.5 degrees off the axis: what each kernel is for (NUMERICS 1.4)."""
    u, v = centres(96, 96)
    phase = 2 * np.pi * 12 * (np.cos(np.pi / 8) * u + np.sin(np.pi / 8) * v)
    inner = np.s_[40:56, 40:56]
    turned, short = {}, {}
    for name in (*KERNELS, "bspline"):
        # The wave's own derivative is largest where its sine is 0: fit its length and direction.
        got = slopes(np.sin(phase), name)[inner].reshape(-1, 2).astype(float)
        basis = np.stack([np.cos(phase[inner]), np.sin(phase[inner])], axis=-1).reshape(-1, 2)
        fitted = np.linalg.lstsq(basis, got, rcond=None)[0]
        gain = np.hypot(*fitted) / (2 * np.pi * 12)  # of u and of v, whatever their phase
        turned[name] = abs(np.arctan2(gain[1], gain[0]) - np.pi / 8)
        short[name] = 1 - np.hypot(*gain)
    assert turned["scharr"] < 0.3 * turned["sobel"] < 0.3 * turned["central"]
    assert short["sobel"] > short["central"] > 5 * short["fourth"] > 5 * short["bspline"] > 0


# Borders


def outside(i: int, n: int, border: str) -> int:
    """The index that stands for i outside 0..n - 1."""
    if border == "clamp":
        return min(max(i, 0), n - 1)
    if border == "wrap":
        return i % n
    i %= 2 * n
    return i if i < n else 2 * n - 1 - i


@pytest.mark.parametrize("border", list(BORDERS))
@pytest.mark.parametrize("name", list(KERNELS))
def test_borders_texel_by_texel(name: str, border: str) -> None:
    """Against the sum as it is written on paper, on maps smaller than the kernel too."""
    kernel = KERNELS[name]
    for shape in ((5, 7), (2, 3), (1, 4)):
        h = RNG.uniform(size=shape)[::-1]
        rows, columns = shape
        wanted = np.zeros((*shape, 2))
        for r in range(rows):
            for c in range(columns):
                for k, share in enumerate(kernel.across):
                    s = k - len(kernel.across) // 2
                    for ahead, behind, weight in kernel.pairs:
                        for sign, i in ((1, ahead), (-1, behind)):
                            u = h[outside(r + s, rows, border), outside(c + i, columns, border)]
                            v = h[outside(r + i, rows, border), outside(c + s, columns, border)]
                            wanted[r, c] += sign * share * weight * np.array([columns * u, rows * v])
        assert np.abs(slopes(h[::-1], name, border)[::-1] - wanted).max() < 1e-6


@pytest.mark.parametrize("border", list(BORDERS))
@pytest.mark.parametrize("shape", [(6, 9), (5, 4), (2, 3), (1, 7), (1, 1)])
def test_the_spline_meets_its_samples(shape: tuple[int, int], border: str) -> None:
    h = 1000 + RNG.uniform(size=shape)
    c = coefficients(h, border)
    for axis in (0, 1):
        widths = [(1, 1) if a == axis else (0, 0) for a in (0, 1)]
        p = np.moveaxis(np.pad(c, widths, mode=BORDERS[border]), axis, 0)
        c = np.moveaxis((p[:-2] + 4 * p[1:-1] + p[2:]) / 6, 0, axis)
    assert np.abs(c - h).max() < 1e-12  # 8 roundings of 1000 in float64


@pytest.mark.parametrize("border", list(BORDERS))
def test_the_slope_of_the_spline_is_that_of_its_coefficients(border: str) -> None:
    """`slopes` inverts along one axis alone; here both, then the derivative of the spline at the texel centres."""
    h = RNG.uniform(size=(7, 10))
    p = np.pad(coefficients(h, border), 1, mode=BORDERS[border])[::-1]
    smooth_v, smooth_u = (p[:-2] + 4 * p[1:-1] + p[2:]) / 6, (p[:, :-2] + 4 * p[:, 1:-1] + p[:, 2:]) / 6
    du, dv = (smooth_v[:, 2:] - smooth_v[:, :-2]) * 10 / 2, (smooth_u[2:] - smooth_u[:-2]) * 7 / 2
    assert np.abs(slopes(h, "bspline", border)[::-1] - np.stack([du, dv], axis=-1)).max() < 1e-6


@pytest.mark.parametrize("shape", [(16, 24), (15, 21), (2, 3)])
def test_spectral_is_exact_below_the_last_frequency(shape: tuple[int, int]) -> None:
    height, width = shape
    u, v = centres(height, width)
    h, wanted = np.zeros(shape), np.zeros((*shape, 2))
    for k in range((width + 1) // 2):
        for m in range(-((height - 1) // 2), (height + 1) // 2):
            amplitude, phase = RNG.uniform(-1, 1), 2 * np.pi * (k * u + m * v + RNG.uniform())
            h += amplitude * np.sin(phase)
            wanted += 2 * np.pi * amplitude * np.cos(phase)[..., None] * (k, m)
    assert np.abs(slopes(h, "spectral") - wanted).max() < 4 * ROUNDED * max(np.abs(wanted).max(), 1)
    # The last frequency of an even map: its sine is 0 at all samples.
    last = np.resize([1.0, -1.0], (1, 8))
    assert np.abs(slopes(last, "spectral")).max() < 1e-12


# Refusals


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 2e30])
def test_heights_without_a_slope_are_counted_and_placed(value: float) -> None:
    h = np.zeros((6, 5))
    h[2, 3] = h[4, 1] = value
    with pytest.raises(ImageError, match=r"2 of 30 pixels \(first at row 2, column 3\) do not") as caught:
        slopes(h)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ((np.zeros((4, 4)), "centrl"), "did you mean 'central'"),
        ((np.zeros((4, 4)), "central", "repeat"), "unknown border 'repeat'.*wrap, clamp, mirror"),
        ((np.zeros((4, 4)), "spectral", "mirror"), "wants a map that wraps.*'mirror'.*bspline"),
        ((np.zeros((4, 4, 3)),), r"\(height, width\).*\(4, 4, 3\)"),
        ((np.zeros((0, 4)),), r"at least \(1, 1\)"),
    ],
)
def test_wrong_calls_are_explained(arguments: tuple[Any, ...], said: str) -> None:
    with pytest.raises(ImageError, match=said):
        slopes(*arguments)


def test_steps_of_1e30_and_denormals_stay_finite() -> None:
    for value in (1e30, 1e-310):
        h = np.where(np.arange(64) % 16 < 8, value, -value) * np.ones((64, 1))
        for method in METHODS:
            got = slopes(h, method)
            assert np.isfinite(got).all()
            assert not got[..., 1].any()


# In shaders


@pytest.mark.parametrize("name", IN_SHADER)
@pytest.mark.parametrize("shape", [(13, 7), (1, 9), (9, 1), (1, 1), (3, 2)])
def test_shaders_on_odd_maps(name: str, shape: tuple[int, int], glsl: Glsl) -> None:
    """The twin's slopes at any place, also where sizes are no powers of two, and 0 along a single texel."""
    heights = RNG.uniform(size=shape).astype(np.float32)
    uv = RNG.uniform(-6, 7, (500, 2)).astype(np.float32)
    more = {"slope_across": (np.float32(0.7),), "slope_smoothed": (np.float32(0.15),)}.get(name, ())
    got = glsl("lib/gradients.glsl")[name](heights, uv, *more)
    # Places are off by some roundings of 7 maps; slopes change by less than 4 sizes a texel. GPU filters, which
    # round places to 1/256 texel, move what is read of both ends alike.
    off = 7 * max(shape) * 4 * ROUNDED + 2.0**-9
    assert np.abs(got - getattr(twin, name)(heights, uv, *more)).max() < 4 * max(shape) * off
    for axis in (0, 1):
        if shape[1 - axis] == 1:
            assert np.abs(got[:, axis]).max() < 1e-5


@pytest.mark.parametrize("method", ["forward", "central", "sobel", "scharr", "fourth", "bspline"])
def test_shaders_meet_the_baked_slopes_at_texel_centres(method: str, glsl: Glsl) -> None:
    heights = RNG.uniform(size=(8, 16))
    read = coefficients(heights) if method == "bspline" else heights
    u, v = centres(8, 16)
    got = glsl("lib/gradients.glsl")[f"slope_{method}"](
        np.ascontiguousarray(read[::-1], np.float32), np.stack([u, v], axis=-1).reshape(-1, 2)
    )
    assert np.abs(got.reshape(8, 16, 2) - slopes(heights, method)).max() < 16 * 16 * 4 * ROUNDED


def test_half_steps_are_central_differences_at_texel_centres_and_better_between(glsl: Glsl) -> None:
    heights, wanted = hill(*centres(32, 32))
    f = glsl("lib/gradients.glsl")
    texels = np.ascontiguousarray(heights[::-1], np.float32)
    u, v = centres(32, 32)
    at = np.stack([u, v], axis=-1).reshape(-1, 2)
    assert np.abs(f.slope_half(texels, at) - f.slope_central(texels, at)).max() < 1e-4
    errors = {}
    at = RNG.uniform(size=(4000, 2))
    wanted = hill(at[:, 0], at[:, 1])[1]
    coded = np.ascontiguousarray(coefficients(heights)[::-1], np.float32)
    for name in ("forward", "central", "half"):
        errors[name] = np.sqrt(np.mean((f[f"slope_{name}"](texels, at) - wanted) ** 2))
    errors["bspline"] = np.sqrt(np.mean((f.slope_bspline(coded, at) - wanted) ** 2))
    assert errors["half"] < 0.65 * errors["central"]
    assert errors["central"] < 0.3 * errors["forward"]
    assert errors["bspline"] < 0.05 * errors["half"]


def test_past_the_border_reads_go_on_as_the_sampler_wraps(glsl: Glsl) -> None:
    heights = RNG.uniform(size=(4, 8)).astype(np.float32)
    uv = np.array([[0.5 / 8, 0.5 / 4], [7.5 / 8, 3.5 / 4]])
    got = {w: glsl("lib/gradients.glsl").slope_central(heights, uv, wrap=w) for w in ("repeat", "clamp")}
    for word, border in (("repeat", "wrap"), ("clamp", "clamp")):
        wanted = slopes(heights[::-1], "central", border)[::-1]
        assert np.abs(got[word] - wanted[[0, 3], [0, 7]]).max() < 1e-5


def test_screen_differences_are_as_good_as_the_pixel_is_small(glsl: Glsl) -> None:
    """A height on a ball, no u,v: the error of the normal falls with the pixel, to the first order."""
    f = glsl("lib/bump.glsl").surface_gradient_screen
    place = RNG.uniform(-0.6, 0.6, (500, 2))
    y, x = np.mgrid[0:2, 0:2]
    errors = []
    for pixel in (1 / 64, 1 / 128, 1 / 256):
        xy = place[:, None, None] + np.stack([x, y], axis=-1) * pixel
        p = np.concatenate([xy, np.sqrt(1 - (xy**2).sum(axis=-1, keepdims=True))], axis=-1)
        height = 0.1 * np.sin(3 * p[..., 0]) * np.cos(4 * p[..., 1])
        got = f(p, p, height)
        grad = 0.1 * np.stack(
            [
                3 * np.cos(3 * p[..., 0]) * np.cos(4 * p[..., 1]),
                -4 * np.sin(3 * p[..., 0]) * np.sin(4 * p[..., 1]),
                0 * height,
            ],
            axis=-1,
        )
        wanted = grad - p * (p * grad).sum(axis=-1, keepdims=True)
        errors.append(np.sqrt(np.mean((got - wanted) ** 2)))
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert orders == pytest.approx([1, 1], abs=0.1)
