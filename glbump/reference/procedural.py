"""Environments that are computed. Twin of shaders/lib/procedural.glsl; float64.

dir_env: (..., 3) unit length. ddx, ddy: (..., 3) its changes across the footprint of a sample, along both of its
sides; zero for the function itself. Colours are linear rgb (3,).
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

F64 = npt.NDArray[np.float64]
Index = npt.NDArray[np.intp]

OCTAVES = 9
WIDEST = 4.0
RIDGE_MEAN, RIDGE_SLOPE = 0.44, 2.9
GROUND = -0.5
NEAREST, FARTHEST = 0.25, 40.0


def _float(x: npt.ArrayLike) -> F64:
    return np.asarray(x, np.float64)


def _dot(a: npt.ArrayLike, b: npt.ArrayLike) -> F64:
    return np.einsum("...i,...i->...", _float(a), _float(b))


def _mix(a: npt.ArrayLike, b: npt.ArrayLike, t: F64) -> F64:
    """(..., 3) from a at t (...) = 0 to b at 1."""
    share = _float(t)[..., None]
    return _float(a) * (1 - share) + _float(b) * share


def _smooth(low: float, high: float, x: F64) -> F64:
    """Hermite's cubic from 0 at `low` to 1 at `high`."""
    t = np.clip((x - low) / (high - low), 0, 1)
    return t * t * (3 - 2 * t)


def soft_sign(y: npt.ArrayLike, reach: npt.ArrayLike, softness: npt.ArrayLike) -> F64:
    """(...) the mean of t / hypot(t, softness) for t from y - reach to y + reach: -1..1.

    The integral is hypot(y + reach, softness) - hypot(y - reach, softness); divided by 2 reach and multiplied above
    and below by the sum of the two, it is 2 y over that sum.
    """
    y, reach, softness = _float(y), _float(reach), _float(softness)
    both = np.hypot(y + reach, softness) + np.hypot(y - reach, softness)
    return np.divide(2 * y, both, out=np.zeros_like(both), where=both > 0)


def footprint_reach(ddx: npt.ArrayLike, ddy: npt.ArrayLike) -> F64:
    """(...) half the side of the interval whose variance is that of the parallelogram's heights."""
    return 0.5 * np.hypot(_float(ddx)[..., 1], _float(ddy)[..., 1])


def sky_radiance(
    dir_env: npt.ArrayLike,
    ddx: npt.ArrayLike,
    ddy: npt.ArrayLike,
    up: npt.ArrayLike,
    down: npt.ArrayLike,
    softness: npt.ArrayLike,
) -> F64:
    """(..., 3): `up` straight up, `down` straight down, the mean of both at the horizon."""
    side = soft_sign(_float(dir_env)[..., 1], footprint_reach(ddx, ddy), softness) * np.hypot(1.0, softness)
    return _mix(down, up, (1 + np.clip(side, -1, 1)) / 2)


def sinc(x: npt.ArrayLike) -> F64:
    """(...) sin(x) / x."""
    return np.sinc(_float(x) / np.pi)


def chrome_radiance(
    dir_env: npt.ArrayLike,
    ddx: npt.ArrayLike,
    ddy: npt.ArrayLike,
    grey: npt.ArrayLike,
    silver: npt.ArrayLike,
    bands: npt.ArrayLike,
    sway: npt.ArrayLike,
) -> F64:
    """(..., 3): the square of a sinusoid of the height between the two colours, moved up and down by a slower one.

    ((1 + sin)/2)^2 = 3/8 + sin/2 - cos(2)/8; the mean of each over a parallelogram across which the phase is linear.
    """
    d, bands, sway = _float(dir_env), _float(bands), _float(sway)
    swing = 2 * np.pi * (0.5 * d[..., 0] + 0.3 * d[..., 2])
    turns = bands * d[..., 1] / 2 + sway * np.sin(swing)
    # Turns of the phase across the footprint's two sides.
    sides = [
        bands * side[..., 1] / 2 + sway * np.cos(swing) * 2 * np.pi * (0.5 * side[..., 0] + 0.3 * side[..., 2])
        for side in (_float(ddx), _float(ddy))
    ]
    first = np.sinc(sides[0]) * np.sinc(sides[1]) * np.sin(2 * np.pi * turns)
    second = np.sinc(2 * sides[0]) * np.sinc(2 * sides[1]) * np.cos(4 * np.pi * turns)
    return _mix(grey, silver, 3 / 8 + first / 2 - second / 8)


def lattice_value(cell: npt.ArrayLike, seed: npt.ArrayLike) -> F64:
    """(...) in -1..1 for whole numbers cell (..., 2): bits mixed as Wellons' "Prospecting for Hash Functions", 2018."""
    # Unsigned numbers wrap at 2^32 as the GPU's do; as an array even a single one does so silently.
    x, y = np.moveaxis(np.atleast_2d(np.asarray(cell)).astype(np.int64).astype(np.uint32), -1, 0)
    h = x * np.uint32(0x9E3779B1) + y * np.uint32(0x85EBCA77)
    h = h + np.atleast_1d(np.asarray(seed, np.int64)).astype(np.uint32) * np.uint32(0xC2B2AE3D)
    h = (h ^ (h >> np.uint32(16))) * np.uint32(0x7FEB352D)
    h = (h ^ (h >> np.uint32(15))) * np.uint32(0x846CA68B)
    h = h ^ (h >> np.uint32(16))
    return ((h >> np.uint32(8)) / 2.0**23 - 1).reshape(np.broadcast_shapes(np.shape(cell)[:-1], np.shape(seed)))


def value_noise(place: npt.ArrayLike, seed: npt.ArrayLike) -> F64:
    """(..., 3) value and derivatives along x and y at place (..., 2): lattice values, joined by quintics."""
    p = _float(place)
    cell = np.floor(p)
    f = p - cell
    squared = f * f
    sx, sy = np.moveaxis(squared * f * (f * (f * 6 - 15) + 10), -1, 0)
    dx, dy = np.moveaxis(30 * squared * (squared - 2 * f + 1), -1, 0)
    whole = cell.astype(np.int64)
    corner = [[lattice_value(whole + (i, j), seed) for j in (0, 1)] for i in (0, 1)]
    near, far = (corner[i][0] + (corner[i][1] - corner[i][0]) * sy for i in (0, 1))
    low, high = (corner[0][j] + (corner[1][j] - corner[0][j]) * sx for j in (0, 1))
    return np.stack([near + (far - near) * sx, (far - near) * dx, (high - low) * dy], axis=-1)


def _octave(place: F64, cell: float, turned: complex, reach: F64, seed: Any) -> F64:
    """(..., 3) ridges in 0..1 and their derivatives: noise with cells of one size, turned, its zeros made crests.

    A crest is (1 - |noise|)^2, with |noise| averaged from noise - reach to noise + reach where that spans 0.
    """
    z = (place[..., 0] + 1j * place[..., 1]) * turned / cell
    noise = value_noise(np.stack([z.real, z.imag], axis=-1), seed)
    value = noise[..., 0]
    height = np.maximum(1 - np.where(np.abs(value) < reach, (value**2 + reach**2) / (2 * reach), np.abs(value)), 0)
    slope = (noise[..., 1] + 1j * noise[..., 2]) * np.conj(turned) / cell
    slope = slope * (-2 * height * np.clip(value / reach, -1, 1))
    return np.stack([height**2, slope.real, slope.imag], axis=-1)


def valley(away: npt.ArrayLike) -> F64:
    """(..., 2) how much of their height mountains have at a distance from the eye, and its derivative."""
    x = np.clip((_float(away) - 1) / 8, 0, 1)
    return np.stack([0.04 + 0.96 * x * x * (3 - 2 * x), 0.96 * 6 * x * (1 - x) / 8], axis=-1)


def landscape(place: npt.ArrayLike, width: npt.ArrayLike, relief: npt.ArrayLike, seed: npt.ArrayLike) -> F64:
    """(..., 4) height of the ground at place (..., 2) = (x, z), its derivatives, the mean square of slopes left out.

    Heights lie in GROUND..GROUND + relief. width: (...) of the footprint on the ground; what is finer gives way to
    its mean.
    """
    p = _float(place)
    width = np.broadcast_to(_float(width), p.shape[:-1])
    seeds = np.broadcast_to(np.asarray(seed, np.int64), p.shape[:-1])
    mean = np.array([RIDGE_MEAN, 0.0, 0.0])
    total = np.zeros((*p.shape[:-1], 3))
    lost = np.full(p.shape[:-1], float(OCTAVES))
    for octave in range(OCTAVES):
        cell, weight = WIDEST / 2**octave, 0.5 / 2**octave
        total += weight * mean
        seen = width < cell
        if seen.any():
            cells = width[seen] / cell
            ridge = _octave(p[seen], cell, (0.8 + 0.6j) ** octave, 0.05 + cells, (seeds[seen] + octave) % 2**32)
            share = 1 - _smooth(0.3, 1.0, cells)
            total[seen] += (weight * share)[:, None] * (ridge - mean)
            lost[seen] -= share**2
    away = np.linalg.norm(p, axis=-1)
    rise, rising = np.moveaxis(valley(away), -1, 0)
    outwards = p / np.maximum(away, 1e-6)[..., None]
    slope = rise[..., None] * total[..., 1:] + (total[..., 0] * rising)[..., None] * outwards
    relief = _float(relief)
    return np.stack(
        [
            GROUND + relief * rise * total[..., 0],
            relief * slope[..., 0],
            relief * slope[..., 1],
            RIDGE_SLOPE * (relief * rise * 0.5 / WIDEST) ** 2 * lost,
        ],
        axis=-1,
    )


def mean_normal(ground: npt.ArrayLike) -> F64:
    """(..., 3) mean of the normals of ground (..., 4) as `landscape` has it: the shorter, the more is left out.

    With slopes g and others of mean square s that are left out, sqrt(1 + g^2 + s) is the mean length of the normals.
    """
    _, x, z, rest = np.moveaxis(_float(ground), -1, 0)
    return np.stack([-x, np.ones_like(x), -z], axis=-1) / np.sqrt(1 + x * x + z * z + rest)[..., None]


def clearance(dir_env: npt.ArrayLike, far: npt.ArrayLike, ground: npt.ArrayLike) -> F64:
    """(...) the sine of the angle from the ground (..., 4) up to the ray, as seen from the eye, `far` along the ray."""
    return _float(dir_env)[..., 1] - _float(ground)[..., 0] / _float(far)


def lit_ground(ground: npt.ArrayLike, relief: npt.ArrayLike, rock: npt.ArrayLike, snow: npt.ArrayLike) -> F64:
    """(..., 3) colour of ground (..., 4) as `landscape` has it, in sunlight and skylight; never above rock and snow."""
    ground = _float(ground)
    n = mean_normal(ground)
    sun, sunlight = np.array([-0.80, 0.36, 0.48]), np.array([0.86, 0.80, 0.70])
    high = (ground[..., 0] - GROUND) / np.maximum(_float(relief), 1e-6)
    white = _smooth(0.28, 0.46, high) * _smooth(0.4, 0.9, n[..., 1])
    shine = np.maximum(_dot(n, sun), 0)[..., None]
    return _mix(rock, snow, white) * (sunlight * shine + (1 - sunlight) * (0.5 + 0.5 * n[..., 1:2]))


def march_distance(number: npt.ArrayLike, steps: npt.ArrayLike) -> F64:
    """(...) distance of step 0..steps - 1: NEAREST to FARTHEST, steps that grow evenly."""
    return NEAREST + (FARTHEST - NEAREST) * (_float(number) / (_float(steps) - 1)) ** 2


def fractal_radiance(
    dir_env: npt.ArrayLike,
    ddx: npt.ArrayLike,
    ddy: npt.ArrayLike,
    sky: npt.ArrayLike,
    haze: npt.ArrayLike,
    rock: npt.ArrayLike,
    snow: npt.ArrayLike,
    relief: npt.ArrayLike,
    seed: npt.ArrayLike,
    steps: npt.ArrayLike,
) -> F64:
    """(..., 3): the landscape where the ray meets it, under a sky. relief, seed, steps: (...).

    The ground is looked at where the ray passes `steps` distances, and is straight between them.
    What rises into a part of the footprint covers that part; for each such event it is looked at twice more.
    """
    shape = np.broadcast_shapes(np.shape(dir_env), np.shape(ddx), np.shape(ddy))
    d, ddx, ddy = (np.broadcast_to(_float(a), shape).reshape(-1, 3) for a in (dir_env, ddx, ddy))
    relief, seed, steps = (np.broadcast_to(np.asarray(a), shape[:-1]).ravel() for a in (relief, seed, steps))
    width = np.maximum(np.linalg.norm(ddx, axis=-1), np.linalg.norm(ddy, axis=-1))
    air = _mix(haze, sky, np.maximum(soft_sign(d[:, 1], footprint_reach(ddx, ddy), 0.35), 0))
    light = np.zeros_like(d)
    free = np.ones(len(d))
    before = np.zeros(len(d))  # 0 where the ray was not above the ground

    def look(ray: Index, at: F64, facing: npt.ArrayLike = 1.0) -> F64:
        return landscape(at[:, None] * d[ray][:, ::2], at * width[ray] / facing, relief[ray], seed[ray])

    on = np.arange(len(d))
    for number in range(steps.max(initial=0)):
        far = march_distance(number, steps)
        on = on[(number < steps[on]) & (free[on] > 0)]
        on = on[(d[on, 1] <= 0) | (far[on] * d[on, 1] <= GROUND + relief[on])]
        if not len(on):
            break
        bound = GROUND + relief[on] * valley(far[on] * np.hypot(d[on, 0], d[on, 2]))[:, 0]
        above = d[on, 1] - bound / far[on]
        near = above <= width[on]
        above[near] = clearance(d[on[near]], far[on[near]], look(on[near], far[on[near]]))
        covered = np.clip(0.5 - above / np.maximum(width[on], 1e-6), 0, 1)
        before[on], nearer = np.where(above > 0, far[on], 0.0), before[on]
        more = 1 - covered < free[on]
        if not more.any():
            continue
        ray, now, nearer, here = on[more], above[more], nearer[more], far[on[more]]
        crossed = (nearer > 0) & (now <= 0)
        at = np.where(crossed, nearer, here)
        ground = look(ray, at)
        was = at * clearance(d[ray], at, ground)
        at = at + (here - at) * np.divide(was, was - here * now, out=np.zeros_like(at), where=crossed)
        # Seen at a grazing angle, the footprint is longer on the ground than across the ray.
        facing = np.maximum(np.abs(_dot(mean_normal(ground), d[ray])), 0.1)
        clear = 2.0 ** (-at / FARTHEST) * (1 - (at / FARTHEST) ** 2)
        colour = _mix(air[ray], lit_ground(look(ray, at, facing), relief[ray], rock, snow), clear)
        light[ray] += (free[ray] + covered[more] - 1)[:, None] * colour
        free[ray] = 1 - covered[more]
    return (light + free[:, None] * air).reshape(shape)
