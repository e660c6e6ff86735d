"""Ways to take the gradient of a height known at texel centres: weights as data, one axis at a time.

Each slope is a difference along its axis, then for some kernels a mean across it. A constant map has gradients of
exactly 0, since only differences are added up.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from glbump.errors import ImageError, unknown
from glbump.frozen import Frozen
from glbump.maps.bspline import BORDERS, continued, prefiltered

F64 = npt.NDArray[np.float64]
Shifted = Callable[[int], F64]


class Kernel(Frozen):
    """Weights of a gradient, in slopes per texel.

    pairs: (ahead, behind, weight): weight * (height `ahead` texels on - height `behind` texels on), added up.
    across: weights of a mean over texels -r..r the other way; 1.0 alone for none.
    order: the error of a smooth map falls as this power of the texel's size.
    """

    pairs: tuple[tuple[int, int, float], ...]
    order: int
    across: tuple[float, ...] = (1.0,)

    @property
    def reach(self) -> int:
        """Texels that are read on either side, along the difference."""
        return max(max(abs(ahead), abs(behind)) for ahead, behind, _ in self.pairs)


_CENTRAL = ((1, -1, 0.5),)
KERNELS = {
    # Slopes half a texel up and to the right of where they are stored.
    "forward": Kernel(((1, 0, 1.0),), 1),
    "central": Kernel(_CENTRAL, 2),
    "sobel": Kernel(_CENTRAL, 2, (1 / 4, 2 / 4, 1 / 4)),
    # Scharr, "Optimale Operatoren in der digitalen Bildverarbeitung", 2000: the direction of waves at its best.
    "scharr": Kernel(_CENTRAL, 2, (3 / 16, 10 / 16, 3 / 16)),
    "fourth": Kernel(((1, -1, 2 / 3), (2, -2, -1 / 12)), 4),
}
"""The kernels that read a few texels. Central differences half a texel to each side are, at texel centres, those of a
whole texel: they differ only between centres, in a shader (shaders/lib/gradients.glsl slope_half)."""

METHODS = (*KERNELS, "bspline", "spectral")

IN_SHADERS = ("forward", "central", "half", "sobel", "scharr", "fourth", "bspline")
"""Those that shaders/lib/gradients.glsl takes where a map is seen, in the order of their numbers there."""


def derivative(values: F64, axis: int, method: str, border: str) -> F64:
    """d values / d index along `axis` of an (H, W) array, at its samples. method: one of METHODS; border: of BORDERS.

    "bspline": of the cubic B-spline through the samples, whose coefficients go on past the border as the map does;
    at the samples that is the central difference of the coefficients along the axis alone. "spectral": of the
    trigonometric polynomial through the samples, so wrapping only; exact up to the map's last frequency, whose
    own derivative is 0 at its samples. A map that does not repeat rings at its border.
    ImageError for an unknown name, and for a spectral derivative of a map that does not wrap.
    """
    if border not in BORDERS:
        raise ImageError(unknown("border", border, BORDERS))
    if method == "spectral":
        if border != "wrap":
            raise ImageError(f"a spectral gradient wants a map that wraps; got border {border!r}; use bspline")
        return _spectral(values, axis)
    if method == "bspline":
        return differences(prefiltered(values, axis, border), axis, KERNELS["central"], border)
    if method not in KERNELS:
        raise ImageError(unknown("gradient kernel", method, METHODS))
    return differences(values, axis, KERNELS[method], border)


def differences(values: F64, axis: int, kernel: Kernel, border: str) -> F64:
    """The kernel's weighted differences along `axis`, and its mean across."""
    along = _shifted(values, axis, kernel.reach, border)
    result = np.zeros_like(values)
    for ahead, behind, weight in kernel.pairs:
        result += weight * (along(ahead) - along(behind))
    reach = len(kernel.across) // 2
    if not reach:
        return result
    across = _shifted(result, 1 - axis, reach, border)
    mean = np.zeros_like(values)
    for i, weight in enumerate(kernel.across):
        mean += weight * across(i - reach)
    return mean


def _shifted(values: F64, axis: int, reach: int, border: str) -> Shifted:
    """A function of i: the array as seen i texels on, |i| <= reach."""
    padded = continued(values, axis, reach, border)
    count = values.shape[axis]

    def at(i: int) -> F64:
        return padded[:, reach + i : reach + i + count] if axis else padded[reach + i : reach + i + count]

    return at


def _spectral(values: F64, axis: int) -> F64:
    count = values.shape[axis]
    # Less one sample, so that what is constant along the axis stays exactly 0.
    waves = np.fft.rfft(values - values.take([0], axis), axis=axis)
    turn = 2j * np.pi / count * np.arange(waves.shape[axis])
    if count % 2 == 0:
        turn[-1] = 0
    return np.fft.irfft(waves * (turn if axis else turn[:, None]), count, axis=axis)
