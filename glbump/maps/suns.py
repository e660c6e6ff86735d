"""Suns: the small, very bright lights of an environment, taken out of it and counted by themselves.

What blurs an environment suffers from them: nine spherical harmonics are off by 3/32 of a sun, and a roughness chain
keeps it in texels as large as the lobe. Debevec, "A Median Cut Algorithm for Light Probe Sampling", 2005, makes lights
of all of a picture; here only what stands out becomes one, and the rest stays a picture.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from glbump.frozen import Frozen
from glbump.maps import cube
from glbump.maps.diffuse import as_cube
from glbump.maps.layout import CUBE, LATLONG, EnvironmentMap, row_edges, sample

F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]

MOST_SUNS = 4

BRIGHT = 50.0
"""How much brighter a sun's texels are than the rest of the picture is on average."""

WIDEST = np.radians(5.0)
"""Largest radius of a sun. What is wider, as a window, nine harmonics and a chain's texels have well enough."""

LEAST = 0.01
"""Least share of all light that a sun brings: without it harmonics are off by less than 3/32 of four times that."""

_TRIES = 16
"""Bright places that are looked at, the brightest first."""


class Sun(Frozen):
    """direction: unit, in the frame of the map, to the middle of its light. irradiance: rgb, of a surface that faces it
    (the integral of its radiance over its solid angle). radius: radians, of the even disc that is as concentrated."""

    direction: tuple[float, float, float]
    irradiance: tuple[float, float, float]
    radius: float

    @property
    def solid_angle(self) -> float:
        """Of its disc, steradians."""
        return float(4 * np.pi * np.sin(self.radius / 2) ** 2)


class Parted(Frozen, eq=False):
    """An environment without its suns, and these: at most MOST_SUNS, the brightest first."""

    rest: EnvironmentMap
    suns: tuple[Sun, ...]


class _Texels(Frozen, eq=False):
    """Texels of a map: their places in its pixels, unit directions (N, 3), solid angles (N,), mean radiance (N,)."""

    at: tuple[npt.NDArray[np.intp], ...]
    dirs: F64
    areas: F64
    values: F64

    def only(self, which: npt.NDArray[np.intp]) -> _Texels:
        return _Texels(tuple(i[which] for i in self.at), self.dirs[which], self.areas[which], self.values[which])


def part(environment: EnvironmentMap) -> Parted:
    """The suns of an environment, and what is left of it with their surroundings in their place.

    A sun is a group of texels that touch, each BRIGHT times as bright as the mean of what is not, within WIDEST of
    its middle, and brings at least LEAST of all light. What its texels have above the median of what is round them is
    its light, in each channel by itself; where one has less it keeps it. So no light is lost: that of the rest and of
    the suns is the picture's, to rounding. Layouts other than lat-long and cube come back as a cube.
    """
    source = environment if environment.layout is LATLONG else as_cube(environment)
    values, areas = source.pixels.mean(axis=-1, dtype=np.float64), _areas(source)
    bright = _texels(source, values > _threshold(values, areas), values, areas)
    least = LEAST * float((np.maximum(values, 0) * areas).sum())
    left = np.ones(len(bright.values), bool)
    found = []
    for _ in range(_TRIES):
        if not left.any():
            break
        peak = int(np.where(left, bright.values, -np.inf).argmax())
        group = _group(bright.dirs, peak, 1.1 / source.texels_per_radian)
        left[group] = False
        if (sun := _sun(source, bright.only(group))) and sum(sun[0].irradiance) / 3 >= least:
            found.append(sun)
    if not found:
        return Parted(environment, ())
    found = sorted(found, key=lambda sun: -sum(sun[0].irradiance))[:MOST_SUNS]
    pixels = source.pixels.copy()
    for _, at, rest in found:
        pixels[at] = rest
    return Parted(replace(source, pixels=pixels), tuple(sun for sun, _, _ in found))


def _areas(source: EnvironmentMap) -> F64:
    """(tiles, H, W) solid angles of the texels of a lat-long picture or a cube."""
    width, height = source.size
    if source.layout is CUBE:
        return np.broadcast_to(cube.solid_angles(width, border=source.has_own_grid), (6, height, width))
    rows = -np.diff(np.cos(row_edges(source))) * (2 * np.pi / width)
    return np.broadcast_to(rows[None, :, None], (1, height, width))


def _threshold(values: F64, areas: F64) -> float:
    """BRIGHT times the mean of all that is not above it."""
    most = np.inf
    while True:
        rest = values <= most
        mean = BRIGHT * max(float((values * areas)[rest].sum() / areas[rest].sum()), 0.0)
        if mean >= most:
            return float(most)
        most = mean


def _texels(source: EnvironmentMap, which: Mask, values: F64, areas: F64) -> _Texels:
    tile, row, column = at = np.nonzero(which)
    width, height = source.size
    s = ((column + 0.5) / width - source.offset[0]) / source.scale[0]
    t = ((row + 0.5) / height - source.offset[1]) / source.scale[1]
    return _Texels(at, source.layout.dir(tile, s, t), areas[at], values[at])


def _group(dirs: F64, peak: int, step: float) -> npt.NDArray[np.intp]:
    """Which of the directions are joined to that of `peak` by others, each within `step` or two of the next; none is
    looked at that is more than 3 WIDEST away."""
    centre = dirs[peak]
    near = np.flatnonzero(dirs @ centre > np.cos(3 * WIDEST))
    # On a plane that touches the sphere there, in squares of `step`: what is in neighbouring squares touches.
    across = np.cross(centre, np.eye(3)[np.abs(centre).argmin()])
    axes = np.stack([across, np.cross(centre, across)], axis=1) / np.linalg.norm(across)
    squares = np.floor(dirs[near] @ axes / (dirs[near] @ centre)[:, None] / step).astype(np.intp)
    squares -= squares.min(axis=0) - 1
    taken = np.zeros(squares.max(axis=0) + 2, bool)
    taken[squares[:, 0], squares[:, 1]] = True
    reached = np.zeros_like(taken)
    reached[tuple(squares[near == peak][0])] = True
    while True:
        wider = reached.copy()
        for axis in (0, 1):
            wider |= np.roll(wider, 1, axis) | np.roll(wider, -1, axis)
        wider &= taken
        if np.array_equal(wider, reached):
            result: npt.NDArray[np.intp] = near[reached[squares[:, 0], squares[:, 1]]]
            return result
        reached = wider


def _sun(source: EnvironmentMap, group: _Texels) -> tuple[Sun, tuple[npt.NDArray[np.intp], ...], F32] | None:
    """The sun that a group of texels is, where they are, and what is to be left there; None where it is too wide."""
    middle = group.dirs.T @ (group.values * group.areas)
    middle /= np.linalg.norm(middle)
    reach = float(2 * np.arcsin(np.linalg.norm(group.dirs - middle, axis=1).max() / 2))
    if reach > WIDEST:
        return None
    pixels = source.pixels[group.at]
    rest = np.minimum(pixels, _around(source, middle, reach + 2 / source.texels_per_radian)).astype(np.float32)
    excess = pixels.astype(np.float64) - rest
    light = excess.mean(axis=1) * group.areas
    if not light.sum() > 0:
        return None
    direction = group.dirs.T @ light
    solid_angle = light.sum() ** 2 / (light**2 / group.areas).sum()
    sun = Sun(
        tuple((direction / np.linalg.norm(direction)).tolist()),
        tuple((group.areas @ excess).tolist()),
        float(2 * np.arcsin(np.sqrt(min(solid_angle / (4 * np.pi), 1.0)))),
    )
    return sun, group.at, rest


def _around(source: EnvironmentMap, middle: F64, away: float) -> F64:
    """(3,) median radiance on the circle `away` from `middle`."""
    across = np.cross(middle, np.eye(3)[np.abs(middle).argmin()])
    across /= np.linalg.norm(across)
    turn = np.linspace(0, 2 * np.pi, 64, endpoint=False)[:, None]
    ring = np.cos(turn) * across + np.sin(turn) * np.cross(middle, across)
    result: F64 = np.median(sample(source, np.cos(away) * middle + np.sin(away) * ring), axis=0)
    return result
