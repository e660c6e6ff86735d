"""Directions to places in environments that lie otherwise. Twin of shaders/lib/layout.glsl; float64.

A place is (..., 3): the number of a tile, and s (right), t (down) on it, 0..1. Directions: (..., 3), any length.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from glbump.maps import projections
from glbump.reference.direction import finite_dir, turned_up

F64 = npt.NDArray[np.float64]


def _stacked(place: projections.Place) -> F64:
    return np.stack(place, axis=-1)


def octahedral_place(dir_env: npt.ArrayLike) -> F64:
    """The sphere as an octahedron, unfolded to a square about +Y."""
    return _stacked(projections.octahedral_place(finite_dir(dir_env)))


def hemicube_place(dir_env: npt.ArrayLike) -> F64:
    """Upper halves of the sides +X -X +Z -Z of a cube, then its top in two; the lower half mirrored."""
    return _stacked(projections.hemicube_place(turned_up(finite_dir(dir_env))))


def equal_area_place(dir_env: npt.ArrayLike) -> F64:
    """The disc of the upper half with r = sqrt(2) sin(theta / 2); the lower half mirrored."""
    return _stacked(projections.equal_area_place(turned_up(finite_dir(dir_env))))


def equidistant_place(dir_env: npt.ArrayLike) -> F64:
    """The disc of the upper half with r = theta / 90 degrees; the lower half mirrored."""
    return _stacked(projections.equidistant_place(turned_up(finite_dir(dir_env))))


def orthographic_place(dir_env: npt.ArrayLike) -> F64:
    """The disc of the upper half with r = sin(theta); the lower half mirrored."""
    return _stacked(projections.orthographic_place(finite_dir(dir_env)))


def paraboloid_place(dir_env: npt.ArrayLike) -> F64:
    """Two discs, up and down, with r = tan(theta / 2)."""
    return _stacked(projections.paraboloid_place(finite_dir(dir_env)))


def tile_texel(place: npt.ArrayLike, tile: npt.ArrayLike) -> F64:
    """Where places (..., 3) are, x, y (..., 2) in texels, in a column of tiles of (width, height) texels.

    Each tile has a border of one texel all round.
    """
    p, (width, height) = np.asarray(place, np.float64), np.moveaxis(np.asarray(tile, np.float64), -1, 0)
    return np.stack([1 + p[..., 1] * width, p[..., 0] * (height + 2) + 1 + p[..., 2] * height], axis=-1)
