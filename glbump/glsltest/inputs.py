"""Rows that find bugs: directions where formulas change, floats where arithmetic does.

All are float32, so that a float64 reference sees exactly what the shader sees. Random ones come from a seed.
"""

from __future__ import annotations

from itertools import product

import numpy as np
import numpy.typing as npt

F32 = npt.NDArray[np.float32]


def unit_vectors(count: int, seed: int = 0) -> F32:
    """(count, 3) directions, evenly over the sphere; unit length to float32."""
    made = np.random.default_rng(seed).normal(size=(count, 3))
    made /= np.linalg.norm(made, axis=-1, keepdims=True)
    return made.astype(np.float32)


def axes() -> F32:
    """(6, 3): +x -x +y -y +z -z, the centres of a cube's faces; +-y are the poles of a latitude-longitude picture."""
    return np.array([sign * np.eye(3)[i] for i in range(3) for sign in (1, -1)], np.float32)


def poles() -> F32:
    """(2, 3): up and down."""
    return axes()[2:4]


def edges() -> F32:
    """(12, 3) directions through the middles of a cube's edges, not normalised: two components are equal."""
    return np.array([v for v in product((-1, 0, 1), repeat=3) if v.count(0) == 1], np.float32)


def corners() -> F32:
    """(8, 3) directions through a cube's corners, not normalised: all components are equal."""
    return np.array(list(product((-1, 1), repeat=3)), np.float32)


def nudged(values: npt.ArrayLike, steps: int = 1) -> F32:
    """Each row with each of its components `steps` floats lower and higher, one at a time: the far side of an edge."""
    base = np.atleast_2d(np.asarray(values, np.float32))
    made = []
    for i in range(base.shape[-1]):
        for towards in (-np.inf, np.inf):
            row = base.copy()
            for _ in range(steps):
                row[:, i] = np.nextafter(row[:, i], np.float32(towards))
            made.append(row)
    return np.concatenate(made)


def directions(count: int = 1000, seed: int = 0) -> F32:
    """Unit directions: axes, edges and corners of a cube, what lies one float beside them, and `count` others."""
    special = np.concatenate([axes(), edges(), corners()])
    special = np.concatenate([special, nudged(special)]).astype(np.float64)
    special /= np.linalg.norm(special, axis=-1, keepdims=True)
    return np.concatenate([special.astype(np.float32), unit_vectors(count, seed)])


def floats(low: float = -np.inf, high: float = np.inf, *, nonfinite: bool = False) -> F32:
    """Floats where arithmetic changes, within low..high: zeros, denormals, powers of two with their neighbours, huge.

    nonfinite: the infinities and NaN as well, whatever low and high are.
    """
    powers = np.ldexp(np.float32(1), np.arange(-126, 128)).astype(np.float32)
    beside = [np.nextafter(powers, np.float32(0)), np.nextafter(powers, np.float32(np.inf))]
    denormal = np.array([2.0**-149, 2.0**-140, 2.0**-127], np.float32)
    other = np.array([1 / 3, np.pi, 1e10, np.finfo(np.float32).max], np.float32)
    half = np.concatenate([powers, *beside, denormal, other])
    made = np.unique(np.concatenate([half, -half]))
    made = made[(made >= low) & (made <= high) & (made != 0)]
    zeros = [0.0, -0.0] if low <= 0 <= high else []
    odd = np.array([np.inf, -np.inf, np.nan] if nonfinite else [], np.float32)
    return np.concatenate([np.array(zeros, np.float32), made, odd])


def uniform(count: int, low: float = 0.0, high: float = 1.0, shape: tuple[int, ...] = (), seed: int = 0) -> F32:
    """(count, *shape) values, evenly between low and high."""
    return np.random.default_rng(seed).uniform(low, high, (count, *shape)).astype(np.float32)


def log_uniform(count: int, low: float, high: float, shape: tuple[int, ...] = (), seed: int = 0) -> F32:
    """(count, *shape) positive values, as many in each octave between low and high."""
    made = np.random.default_rng(seed).uniform(np.log2(low), np.log2(high), (count, *shape))
    return np.exp2(made).astype(np.float32)


def every(*arrays: npt.ArrayLike) -> tuple[F32, ...]:
    """Every combination of the rows of the arrays (their first axes), as one array of rows for each."""
    made = [np.atleast_1d(np.asarray(a, np.float32)) for a in arrays]
    picks = np.meshgrid(*(np.arange(len(a)) for a in made), indexing="ij")
    return tuple(a[pick.ravel()] for a, pick in zip(made, picks, strict=True))
