"""How far a picture is from the truth of its scene: every figure, what it cannot see, and what samples leave open."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from glbump.errors import ImageError
from glbump.maps.angles import degrees_between
from glbump.trade.metrics import compare

F64 = npt.NDArray[np.float64]


class Figure(NamedTuple):
    """One figure of error. what: it is; unit; blind: what it cannot see. scale: what it is shown times, as in 1/255."""

    what: str
    unit: str
    blind: str
    scale: float = 1.0


_DISPLAY, _LINEAR = "of 255 grey levels", "of linear light"
FIGURES: dict[str, Figure] = {
    "rmse": Figure(
        "root of the mean square difference over all pixels and channels, as a display shows them",
        _DISPLAY,
        "where the error lies: one wrong pixel in ten thousand hardly moves it; nor light above display white",
        255,
    ),
    "p99": Figure(
        "one pixel of a hundred is off by more", _DISPLAY, "the worst hundredth, and how often below it errors are", 255
    ),
    "p999": Figure(
        "one pixel of a thousand is off by more",
        _DISPLAY,
        "the worst thousandth; of pictures under 64x64 it is the worst few pixels",
        255,
    ),
    "max": Figure(
        "the largest difference of a channel of a pixel",
        _DISPLAY,
        "everything but one pixel; it grows with the number of pixels, and says little of the picture",
        255,
    ),
    "psnr": Figure("20 log10(1 / rmse)", "dB", "what rmse cannot; infinite for equal pictures, given as none"),
    "flip": Figure(
        "mean FLIP, as seen by people who flip between the two (Andersson et al. 2020), at 67 pixels a degree",
        "0 to 1",
        "light above display white; other distances from the screen; motion: sparkling is seen long before",
    ),
    "linear_rmse": Figure(
        "root of the mean square difference of linear light, unclipped",
        _LINEAR,
        "dark errors beside bright ones: a sun's edge outweighs all the rest of the picture",
    ),
    "linear_p99": Figure(
        "one pixel of a hundred is off by more", _LINEAR, "the worst hundredth, where suns and their reflections are"
    ),
    "linear_p999": Figure("one pixel of a thousand is off by more", _LINEAR, "the worst thousandth"),
    "linear_max": Figure("the largest difference of a channel of a pixel", _LINEAR, "everything but one pixel"),
    "silhouette": Figure(
        "share of the squared error (rmse) on pixels where samples see several surfaces, or parts of one",
        "0 to 1",
        "how large the error is, and which of shape, bump or light made the rest",
    ),
    "normal": Figure(
        "mean angle between the normal drawn and the true one in the middle of each pixel that sees one surface",
        "degrees",
        "what the light makes of it: a degree shows in a mirror, not on plaster; that means over a pixel are no error",
    ),
    "normal_p99": Figure("one such pixel of a hundred is off by more", "degrees", "the worst hundredth"),
}
"""Each figure that `errors` gives, by its name."""


def errors(
    got: npt.ArrayLike,
    truth: npt.ArrayLike,
    *,
    several: npt.NDArray[np.bool_] | None = None,
    normals: tuple[npt.ArrayLike, npt.ArrayLike] | None = None,
    perceptual: bool = True,
) -> dict[str, float | None]:
    """Every figure of FIGURES for a picture against the truth, both linear (H, W, 3 or 4); None where it cannot be had.

    several: (H, W) where samples see several surfaces; without it there is no silhouette. normals: drawn and true, unit
    length, (H, W, 3), NaN where there is none; without them there is no normal. perceptual: as for `compare`.
    ImageError as for `compare`.
    """
    shown = compare(got, truth, perceptual=perceptual)
    linear = compare(got, truth, display=False)
    result = {name: shown[name] for name in ("rmse", "p99", "p999", "max", "psnr", "flip")}
    result |= {f"linear_{name}": linear[name] for name in ("rmse", "p99", "p999", "max")}
    result |= {"silhouette": None, "normal": None, "normal_p99": None}
    if several is not None:
        result["silhouette"] = _share(got, truth, several, shown["rmse"])
    if normals is not None:
        angles = degrees_between(*normals)
        seen = np.isfinite(angles) if several is None else np.isfinite(angles) & ~several
        if seen.any():
            result["normal"] = float(angles[seen].mean())
            result["normal_p99"] = float(np.percentile(angles[seen], 99))
    return result


def _share(got: npt.ArrayLike, truth: npt.ArrayLike, several: npt.NDArray[np.bool_], rmse: float) -> float:
    """The share of the squared error that lies on `several`."""
    if rmse == 0 or not several.any():
        return 0.0
    on_them = compare(got, truth, where=several, perceptual=False)["rmse"]
    return float(on_them**2 * several.mean() / rmse**2)


class Bounds(NamedTuple):
    """An estimate, and between what the truth lies, at the confidence asked for."""

    value: float
    low: float
    high: float


def rmse_bounds(squares: npt.ArrayLike, confidence: float = 0.95) -> Bounds:
    """The RMSE of a whole, from a sample of it: squares are mean square errors (N,) of N pixels or tiles, picked by
    chance independently of one another, at least 4.

    The logarithm of their mean is taken for normal, with Student's widths (Cornish and Fisher's expansion of them). Of
    16 tiles whose errors are spread like an exponential's the bounds hold in 92 %, log-normal with a sigma of 1 in 89 %
    (tests/trade/test_errors.py). What no tile has met no bound knows: of what lies on less than
    3 / n of the picture n tiles see nothing, once in twenty times.
    """
    values = np.asarray(squares, np.float64)
    if values.ndim != 1 or len(values) < 4 or not np.isfinite(values).all() or (values < 0).any():
        raise ImageError(f"squares must be at least 4 numbers of 0 and above; got an array of shape {values.shape}")
    mean = float(values.mean())
    if mean == 0:
        return Bounds(0.0, 0.0, 0.0)
    freedom = len(values) - 1
    z = _normal_quantile(0.5 + confidence / 2)
    width = z + (z**3 + z) / (4 * freedom) + (5 * z**5 + 16 * z**3 + 3 * z) / (96 * freedom**2)
    spread = width * float(values.std(ddof=1)) / math.sqrt(len(values)) / mean
    return Bounds(*(math.sqrt(mean * math.exp(s)) for s in (0.0, -spread, spread)))


def _normal_quantile(p: float) -> float:
    from statistics import NormalDist

    return NormalDist().inv_cdf(p)


def mean_squares(got: npt.ArrayLike, truth: npt.ArrayLike) -> float:
    """The mean square of the differences, as a display shows both: of one tile, for `rmse_bounds`."""
    rmse: Any = compare(got, truth, perceptual=False)["rmse"]
    return float(rmse) ** 2
