"""What each gradient of a height map gets wrong: plane waves, random places, and differences between pixels."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from benchmarks.figures import Cell, Section, Table
from benchmarks.noted import deviation, largest
from glbump.maps.angles import degrees_between
from glbump.maps.bspline import coefficients
from glbump.maps.gradients import KERNELS, Kernel, derivative, differences
from glbump.reference import bump
from glbump.reference.gradients import height_at, slope_bspline, slope_central, slope_forward, slope_half

F64 = npt.NDArray[np.float64]

# ------------------------------------------------------------ plane waves

_CENTRAL = KERNELS["central"].pairs
# What glbump does not offer, and why not: Prewitt is Sobel with a worse direction; the sixth order gains what a spline
# gains, for less; Farid and Simoncelli's (IEEE Trans. Image Processing 13(4), 2004) are slopes of a blurred map.
_OTHERS = {
    "Prewitt": Kernel(_CENTRAL, 2, (1 / 3, 1 / 3, 1 / 3)),
    "6th order": Kernel(((1, -1, 3 / 4), (2, -2, -3 / 20), (3, -3, 1 / 60)), 6),
    "Farid-Simoncelli 5": Kernel(
        ((1, -1, 0.276691), (2, -2, 0.109604)), 2, (0.037659, 0.249153, 0.426375, 0.249153, 0.037659)
    ),
}
# For waves of 16, 8 and 4 texels: largest error of direction in degrees; least and largest error of length in percent.
_WAVES = {
    "forward": (("0.372", "-0.6", "-0.3"), ("1.54", "-2.6", "-1.3"), ("7.22", "-10", "-5")),
    "central": (("0.372", "-2.6", "-1.3"), ("1.54", "-10", "-5"), ("7.22", "-36", "-19")),
    "Prewitt": (("0.373", "-3.8", "-2.6"), ("1.56", "-14.6", "-10"), ("7.64", "-49", "-36")),
    "sobel": (("0.185", "-3.2", "-2.6"), ("0.754", "-12.2", "-10"), ("3.24", "-42", "-36")),
    "scharr": (("0.045", "-2.7", "-2.6"), ("0.162", "-10.4", "-10"), ("0.289", "-36.3", "-36.2")),
    "fourth": (("0.011", "-0.08", "-0.02"), ("0.172", "-1.2", "-0.3"), ("2.49", "-15", "-4")),
    "6th order": (("0.000", "0", "0"), ("0.019", "-0.15", "-0.02"), ("0.929", "-6.6", "-1.1")),
    "Farid-Simoncelli 5": (("0.026", "-6.7", "-6.7"), ("0.092", "-22", "-22"), ("0.170", "-64", "-64")),
    "bspline": (("0.002", "-0.01", "0"), ("0.032", "-0.23", "-0.05"), ("0.642", "-4.5", "-1.0")),
    "spectral": (("0", "0", "0"), ("0", "0", "0"), ("0", "0", "0")),
}


def _response(name: str, wave: F64, size: int) -> F64:
    """(2,): lengths of the slopes that a method sees of a wave of unit height; wave: radians per texel along u and v.

    From a sine and a cosine in the middle of `size` x `size` texels: where the slopes lie does not count.
    """
    x, y = np.meshgrid(np.arange(size), np.arange(size))
    phase = wave[0] * x + wave[1] * y
    middle = size // 2, size // 2

    def slope(h: F64, axis: int) -> float:
        if name in _OTHERS:
            return float(differences(h, axis, _OTHERS[name], "wrap")[middle])
        return float(derivative(h, axis, name, "wrap")[middle])

    return np.array([np.hypot(slope(np.sin(phase), axis), slope(np.cos(phase), axis)) for axis in (1, 0)])


def wave_errors(name: str, texels: int, angles: int) -> tuple[float, float, float]:
    """Largest error of direction, degrees; least and largest error of length, percent."""
    if name == "spectral":
        # Waves that fit the map: whole numbers of them both ways, on circles of 25 and its multiples.
        whole = np.array([(25, 0), (24, 7), (20, 15), (15, 20), (7, 24), (0, 25)]) * 16 / texels
        waves, size = 2 * np.pi / 400 * whole, 400
    else:
        turn = np.linspace(0, np.pi / 2, angles)
        waves, size = 2 * np.pi / texels * np.stack([np.cos(turn), np.sin(turn)], axis=-1), 65
    seen = np.array([_response(name, w, size) for w in waves])
    turned = np.degrees(np.arctan2(seen[:, 1], seen[:, 0]) - np.arctan2(waves[:, 1], waves[:, 0]))
    gain = 100 * (np.hypot(*seen.T) / np.hypot(*waves.T) - 1)
    return float(np.abs(turned).max()), float(gain.min()), float(gain.max())


def _plane_waves(angles: int) -> tuple[Table, list[float]]:
    rows: list[list[Cell]] = []
    off = []
    for name, expected in _WAVES.items():
        for texels, figures in zip((16, 8, 4), expected, strict=True):
            ours = wave_errors(name, texels, angles)
            compared = zip(ours[name == "forward" :], figures[name == "forward" :], strict=True)
            off.append(max(deviation(o, f) for o, f in compared))
            rows.append(
                [name, texels, ours[0], float(figures[0]), f"{ours[1]:.2f} .. {ours[2]:.2f}", " .. ".join(figures[1:])]
            )
            rows[-1].append(off[-1])
    head = ("kernel", "texels a wave", "direction, deg", "noted", "length, %", "noted", "off by, %")
    return Table(head, rows), off


# ------------------------------------------------------------ random places

Slopes = Callable[[F64, F64, F64], F64]
"""(heights (N, N), slopes there (N, N, 2), places) -> slopes at the places, all per unit of u and v."""


def baked(name: str) -> Slopes:
    def slopes(h: F64, exact: F64, at: F64) -> F64:
        return _between(np.stack([derivative(h, axis, name, "wrap") * len(h) for axis in (1, 0)], axis=-1), at)

    return slopes


def _between(slopes: F64, at: F64) -> F64:
    return np.stack([height_at(slopes[..., i], at) for i in (0, 1)], axis=-1)


def _one_sided(step: float) -> Slopes:
    def slopes(h: F64, exact: F64, at: F64) -> F64:
        off = step / len(h)
        here = height_at(h, at)
        return np.stack([(height_at(h, at + off * np.eye(2)[i]) - here) / off for i in (0, 1)], axis=-1)

    return slopes


def _rounded(steps: int, slopes: Slopes) -> Slopes:
    """`slopes` of heights stored in so many steps over their own range."""

    def of_rounded(h: F64, exact: F64, at: F64) -> F64:
        step = np.ptp(h) / steps
        return slopes(np.rint((h - h.min()) / step) * step, exact, at)

    return of_rounded


def _spline(h: F64, exact: F64, at: F64) -> F64:
    return slope_bspline(coefficients(h), at)


# rms and largest error in degrees, for waves of at least 32, 8 and 4 texels. The largest of a chance draw is chance.
METHODS: dict[str, tuple[Slopes, tuple[str, str, str]]] = {
    "exact gradient, baked": (lambda h, exact, at: _between(exact, at), ("0.046", "0.65", "2.4")),
    "central, baked": (baked("central"), ("0.110", "1.55", "5.3")),
    "sobel, baked": (baked("sobel"), ("0.139", "1.94", "6.4")),
    "slope_forward": (lambda h, exact, at: slope_forward(h, at), ("1.58", "5.7", "10.5")),
    "slope_central": (lambda h, exact, at: slope_central(h, at), ("0.110", "1.55", "5.3")),
    "slope_half": (lambda h, exact, at: slope_half(h, at), ("0.061", "0.87", "3.1")),
    "bilinear's own slope": (_one_sided(1e-6), ("0.91", "3.3", "6.3")),
    "a step of 1/8 texel": (_one_sided(1 / 8), ("0.82", "3.0", "5.8")),
    "slope_bspline": (_spline, ("0.0004", "0.027", "0.28")),
    "slope_bspline of heights": (lambda h, exact, at: slope_bspline(h, at), ("0.085", "1.2", "4.1")),
    "8 bits, central": (_rounded(255, baked("central")), ("1.32", "1.63", "5.3")),
    "8 bits, slope_bspline": (_rounded(255, _spline), ("4.1", "1.5", "0.72")),
    "16 bits, central": (_rounded(65535, baked("central")), ("0.11", "1.55", "5.3")),
    "16 bits, slope_bspline": (_rounded(65535, _spline), ("0.016", "0.028", "0.28")),
    "half floats about 0, central": (
        lambda h, exact, at: baked("central")(h.astype(np.float16).astype(np.float64), exact, at),
        ("0.117", "1.55", "5.3"),
    ),
}


class Waves:
    """A map of 98 waves, all that repeat on it and are no shorter than `texels`, each of about the same slope.

    The rms slope is 1/2 where a texel is 1 long. One seed gives the same waves at every length.
    """

    def __init__(self, texels: int, seed: int) -> None:
        most = 8
        self.size = most * texels
        chance = np.random.default_rng(seed)
        k = np.array([(i, j) for i in range(most + 1) for j in range(-most, most + 1) if 0 < i * i + j * j <= most**2])
        self._k = k[(k[:, 0] > 0) | (k[:, 1] > 0)]
        self._phase = chance.uniform(0, 2 * np.pi, len(self._k))
        slope = chance.normal(size=len(self._k))
        slope *= 0.5 * self.size / np.sqrt((slope**2).sum() / 2)
        self._height = slope / (2 * np.pi * np.hypot(*self._k.T))

    def at(self, place: F64) -> tuple[F64, F64]:
        """Heights (...) and slopes (..., 2), per unit of u and v, at (..., 2)."""
        phase = 2 * np.pi * (place @ self._k.T) + self._phase
        return np.sin(phase) @ self._height, np.cos(phase) @ (2 * np.pi * self._k * self._height[:, None])


def normals(slopes: F64) -> F64:
    n = np.concatenate([-slopes, np.ones_like(slopes[..., :1])], axis=-1)
    return n / np.linalg.norm(n, axis=-1, keepdims=True)


def _random_places(draws: int, count: int) -> tuple[Table, list[float]]:
    errors: dict[tuple[str, int], list[tuple[float, float]]] = {}
    for texels in (32, 8, 4):
        for seed in range(draws):
            waves = Waves(texels, seed)
            centres = (np.arange(waves.size) + 0.5) / waves.size
            h, exact = waves.at(np.stack(np.meshgrid(centres, centres), axis=-1))
            at = np.random.default_rng(100 + seed).uniform(size=(count, 2))
            wanted = normals(waves.at(at)[1] / waves.size)
            for name, (method, _) in METHODS.items():
                off = degrees_between(normals(method(h, exact, at) / waves.size), wanted)
                errors.setdefault((name, texels), []).append((float(np.sqrt((off**2).mean())), float(off.max())))
    rows: list[list[Cell]] = []
    away = []
    for name, (_, expected) in METHODS.items():
        for texels, figure in zip((32, 8, 4), expected, strict=True):
            rms, most = np.array(errors[name, texels]).T
            nearest = float(np.clip(float(figure), rms.min(), rms.max()))
            if name != "8 bits, slope_bspline":
                away.append(deviation(nearest, figure))
            spread = f"{rms.min():.3g} .. {rms.max():.3g}"
            middle = float(np.median(rms))
            rows.append(
                [name, texels, middle, spread, float(figure), deviation(middle, figure), float(np.median(most))]
            )
    head = ("method", "shortest wave", "rms, deg", "of the draws", "noted", "off by, %", "largest, deg")
    return Table(head, rows), away


# ------------------------------------------------------------ the screen

_SCREEN = {
    ("dFdx of the height", 8): ("1.85", "0.92", "0.46", "0.23"),
    ("dFdx of the height", 32): ("7.19", "3.68", "1.86", "0.93"),
    ("height one pixel on", 8): ("1.81", "0.91", "0.45", "0.23"),
    ("heights a pixel to either side", 8): ("0.134", "0.047", "0.021", "0.010"),
    ("heights a pixel to either side", 32): ("1.67", "0.43", "0.11", "0.029"),
    ("the texture's gradient", 8): ("0.079", "0.039", "0.020", "0.010"),
    ("the texture's gradient", 32): ("0.079", "0.039", "0.020", "0.010"),
}
_SIZES = (128, 256, 512, 1024)


def _quads(size: int) -> F64:
    """(Q, 2, 2, 3): points of a unit ball that fills a picture, seen from afar, in quads of pixels no more than 60
    degrees from facing the eye."""
    x = (np.arange(size) + 0.5) / size * 2 - 1
    xy = np.stack(np.meshgrid(x, x), axis=-1)
    quads = xy.reshape(size // 2, 2, size // 2, 2, 2).swapaxes(1, 2).reshape(-1, 2, 2, 2)
    quads = quads[((quads**2).sum(axis=-1) < 1 - 0.5**2).all(axis=(1, 2))]
    return np.concatenate([quads, np.sqrt(1 - (quads**2).sum(axis=-1, keepdims=True))], axis=-1)


def _screen(size: int, k: int) -> dict[str, float]:
    """rms error, degrees, of waves sin(k longitude) cos(k latitude) / 2k on the ball."""
    p = _quads(size)
    around = np.hypot(p[..., 0], p[..., 2])
    s = np.stack([np.arctan2(p[..., 0], p[..., 2]), np.arctan2(p[..., 1], around)], axis=-1)

    def height(s: F64) -> F64:
        return 0.5 / k * np.sin(k * s[..., 0]) * np.cos(k * s[..., 1])

    sines, cosines = np.moveaxis(np.sin(k * s), -1, 0), np.moveaxis(np.cos(k * s), -1, 0)
    slope = 0.5 * np.stack([cosines[0] * cosines[1], -sines[0] * sines[1]], axis=-1)
    # Unit vectors along longitude and latitude.
    east = np.stack([p[..., 2], 0 * around, -p[..., 0]], axis=-1) / around[..., None]
    north = np.cross(p, east)
    exact = slope[..., :1] / around[..., None] * east + slope[..., 1:] * north
    truth = bump.bump_normal(p, exact)

    x, y = (np.broadcast_to(a, (*p.shape[:3], a.shape[-1])) for a in _quad_differences(np.concatenate([p, s], axis=-1)))
    gradients: dict[str, Any] = {"dFdx of the height": bump.surface_gradient_screen(p, p, height(s))}
    for name, difference in (
        ("height one pixel on", lambda d: height(s + d) - height(s)),
        ("heights a pixel to either side", lambda d: (height(s + d) - height(s - d)) / 2),
        ("the texture's gradient", lambda d: (slope * d).sum(axis=-1)),
    ):
        rise = np.stack([difference(x[..., 3:]), difference(y[..., 3:])], axis=-1)
        gradients[name] = bump.surface_gradient(p, x[..., :3], y[..., :3], rise)
    return {
        name: float(np.sqrt((degrees_between(bump.bump_normal(p, g), truth) ** 2).mean()))
        for name, g in gradients.items()
    }


def _quad_differences(a: F64) -> tuple[F64, F64]:
    return a[:, :, 1:] - a[:, :, :1], a[:, 1:] - a[:, :1]


def _screens(sizes: tuple[int, ...]) -> tuple[Table, list[float]]:
    ours = {k: [_screen(size, k) for size in sizes] for k in (8, 32)}
    rows: list[list[Cell]] = []
    off = []
    for (name, k), expected in _SCREEN.items():
        got = [o[name] for o in ours[k]]
        off.append(max(deviation(g, e) for g, e in zip(got, expected, strict=False)))
        rows.append([name, k, *got, *[None] * (len(_SIZES) - len(got)), " / ".join(expected), off[-1]])
    return Table(("slope from", "k", *(f"{s} px" for s in _SIZES), "noted", "off by, %"), rows), off


_TEXT = (
    "`python -m benchmarks kernels`: three ways in which a gradient of a height map is off, each beside the figure "
    "that was noted when glbump was designed, by another program.\n\n"
    "Plane waves: direction and length of what each kernel sees of a wave, where that slope lies left aside: the "
    "worst direction, the range of lengths. `forward` is held to its lengths alone: the directions noted for it are "
    "those of `central`. Being the central difference of half a texel it is a quarter as far off, as its lengths are. "
    "What it does get wrong is the place: see below.\n\n"
    "Random places: maps of 98 waves of chance, rms slope 1/2; angles between the normal found and the true one; the "
    "median of the draws, and their range. What was noted came from one draw for each wavelength, of waves that "
    "nobody wrote down: draws lie 10 % up and down, all rows of one wavelength together, so what was noted is held to "
    "the draws' range. How much a step of 8 bits is depends on how far the highest wave of a draw stands out, and a "
    "spline through the steps shows nothing else where waves are short: those two figures are 16 and 6 % beyond all "
    "draws.\n\n"
    "The screen: waves of k radians in a radian and slopes of at most 1/2, on a unit ball that fills a picture, where "
    "it is within 60 degrees of facing the eye; rms angle. Slopes from differences of the height are as noted. What "
    "is left of the error when the height's slope is exact comes from differences of places on the ball, most towards "
    "its outline, and is 20 % above what was noted, at every size and k. How much of the ball was counted there is "
    "not known: within 57 degrees it is what was noted, but differences of the height are 7 % less."
)


def measure(quick: bool = False) -> Section:
    """All of it; quick: few angles, draws and pixels."""
    waves, off_waves = _plane_waves(5 if quick else 91)
    places, off_places = _random_places(1 if quick else 9, 200 if quick else 4000)
    screens, off_screens = _screens(_SIZES[:1] if quick else _SIZES)
    return Section(
        "Gradients of heights",
        _TEXT,
        (waves, places, screens),
        [
            largest("plane waves: the farthest from what was noted", off_waves),
            largest(
                "random places: the farthest of what was noted from all draws, splines of 8 bits aside", off_places
            ),
            largest("the screen: slopes from one-sided differences, from what was noted", off_screens[:3]),
        ],
    )


if __name__ == "__main__":
    from benchmarks.command import alone

    alone(measure)
