"""Environments that are computed: their light in any direction, and as a table."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from glbump.environment import Chrome, Fractal, Procedural, Sky
from glbump.maps.layout import latlong_dir
from glbump.reference.procedural import chrome_radiance, fractal_radiance, sky_radiance

F64 = npt.NDArray[np.float64]

_FUNCTIONS: dict[type[Procedural], Callable[..., F64]] = {
    Sky: sky_radiance,
    Chrome: chrome_radiance,
    Fractal: fractal_radiance,
}


def radiance(environment: Procedural, dir_env: F64, ddx: npt.ArrayLike = 0.0, ddy: npt.ArrayLike = 0.0) -> F64:
    """(..., 3) before exposure, in unit directions (..., 3) of the environment's frame.

    ddx, ddy: (..., 3) changes of the direction across the footprint of a sample.
    """
    sides = (np.broadcast_to(np.asarray(side, np.float64), dir_env.shape) for side in (ddx, ddy))
    return _FUNCTIONS[type(environment)](dir_env, *sides, **environment.arguments())


def table(environment: Procedural, size: tuple[int, int]) -> F64:
    """(height, width, 3) lat-long picture of `size` (width, height): each texel the mean over its own footprint."""
    width, height = size
    u, v = np.meshgrid((np.arange(width) + 0.5) / width, (np.arange(height) + 0.5) / height)
    middle = np.stack([u, v], axis=-1)
    ddx, ddy = (
        latlong_dir(middle + half) - latlong_dir(middle - half)
        for half in (np.array([0.5 / width, 0.0]), np.array([0.0, 0.5 / height]))
    )
    return radiance(environment, latlong_dir(middle), ddx, ddy)


def is_averaged(environment_filter: str, samples: int) -> bool:
    """Whether the function is averaged over each sample's footprint: unless many samples do so by themselves."""
    return environment_filter != "bilinear" or samples == 1
