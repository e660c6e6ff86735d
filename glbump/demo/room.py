"""The demo's room: a box with a tiled floor, a lamp, a window, and on each wall the name of its axis."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from glbump.demo.letters import dots
from glbump.maps.layout import CUBE, EnvironmentMap, texel_dirs

F64 = npt.NDArray[np.float64]

HALF = (3.0, 1.5, 4.0)
"""Half of the room's width, height and depth, in metres; it was seen from its middle."""

_WALLS = {"+X": (0.45, 0.13, 0.10), "-X": (0.16, 0.24, 0.42), "+Z": (0.20, 0.34, 0.16), "-Z": (0.52, 0.37, 0.12)}
_LAMP = 7.0
_DAY = np.array([3.0, 3.4, 4.0])


def room(size: int = 256) -> EnvironmentMap:
    """The room as a cube map, linear light: 3x3 rays from its middle for each texel."""
    dirs = texel_dirs(CUBE, (3 * size, 3 * size))
    seen = np.empty((*dirs.shape[:3], 3), np.float32)
    for face, one in enumerate(dirs):
        seen[face] = _seen(one)
    pixels = seen.reshape(6, size, 3, size, 3, 3).mean(axis=(2, 4))
    return EnvironmentMap(CUBE, pixels)


def _seen(dirs: F64) -> F64:
    """Radiance (..., 3) along directions (..., 3) from the middle."""
    with np.errstate(divide="ignore"):
        reach = np.asarray(HALF) / np.abs(dirs)
    axis = reach.argmin(axis=-1)
    at = dirs * reach.min(axis=-1, keepdims=True)
    x, y, z = np.moveaxis(at, -1, 0)
    colour, light = np.full(at.shape, 0.72), _lit(at, axis)
    floor, ceiling = (axis == 1) & (y < 0), (axis == 1) & (y > 0)
    dark = ((np.floor(2 * x) + np.floor(2 * z)) % 2 > 0)[..., None]
    colour[floor] = np.where(dark, (0.10, 0.07, 0.05), (0.62, 0.52, 0.38))[floor]
    glows = np.zeros(at.shape)
    glows[ceiling & (np.abs(x) < 0.7) & (np.abs(z) < 1.1)] = _LAMP
    # From inside, what lies to the right of a wall's middle.
    sides = {"+X": ((axis == 0) & (x > 0), z), "-X": ((axis == 0) & (x < 0), -z)}
    sides |= {"+Z": ((axis == 2) & (z > 0), -x), "-Z": ((axis == 2) & (z < 0), x)}
    for name, (where, right) in sides.items():
        colour[where] = _WALLS[name]
        colour[where & (y < -1.3)] = 0.08
        colour[where & _written(name, right, y)] = 0.9
        if name == "-X":
            pane = where & (np.abs(np.abs(right - 2.2) - 0.4) < 0.36) & (np.abs(y - 0.3) < 0.7)
            glows[pane] = _DAY
    return np.asarray(colour * light[..., None] + glows)


def _lit(at: F64, axis: npt.NDArray[np.intp]) -> F64:
    """What comes from the lamp, taken for a point, and from all sides."""
    to_lamp = np.array([0.0, HALF[1] - 0.05, 0.0]) - at
    square = (to_lamp**2).sum(axis=-1)
    onto = np.abs(np.take_along_axis(to_lamp, axis[..., None], axis=-1)[..., 0])
    return 0.25 + 2.2 * onto * np.maximum(to_lamp[..., 1], 0.02) / (square**2 + 0.05)


def _written(name: str, right: F64, up: F64) -> npt.NDArray[np.bool_]:
    """Where the letters are: dots 8 cm wide, about the middle of the wall."""
    marks = dots(name)
    rows, columns = marks.shape
    column, row = np.floor(right / 0.08 + columns / 2), np.floor(-(up - 0.2) / 0.08 + rows / 2)
    inside = (column >= 0) & (column < columns) & (row >= 0) & (row < rows)
    ink = np.zeros(right.shape, bool)
    ink[inside] = marks[row[inside].astype(int), column[inside].astype(int)]
    return ink
