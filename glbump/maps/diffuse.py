"""Diffuse light from all round: nine spherical harmonics, or a small cube of the cosine integral itself."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from glbump.frozen import Frozen
from glbump.maps import cube, pyramid
from glbump.maps.gloss import area_faces
from glbump.maps.layout import CUBE, LATLONG, EnvironmentMap, row_edges, texel_dirs

F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]

MAP_SIZE = 32
"""Texels along a face of an irradiance map that is drawn from: off by 0.02 % of the brightest on average."""

_ROWS = 256
"""Normals at a time."""


def sh9(environment: EnvironmentMap) -> F64:
    """Irradiance / pi as nine coefficients (9, 3) float64, so that a constant environment c gives c everywhere.

    For a unit normal n the value is the sum of coefficient times
        1,  y,  z,  x,  xy,  yz,  3 z^2 - 1,  xz,  x^2 - y^2.
    They hold (A_l / pi) K^2 (integral of radiance times that polynomial), A_l = pi, 2 pi / 3, pi / 4 and K^2 =
    1 / 4 pi, 3 / 4 pi, 15 / 4 pi (xy, yz, xz), 5 / 16 pi, 15 / 16 pi (Ramamoorthi and Hanrahan 2001). What three
    bands leave out: on average about 1 %, for a point light at most 3/32 of its peak, which can be negative.

    Texels count by their solid angle; faces above 256 are halved first. The projection differs from that of the
    continuous radiance by the second order in a texel's size, and by float32 sums.
    """
    if environment.layout is LATLONG:
        total, first, second = _panorama_moments(environment)
    else:
        total, first, second = _cube_moments(as_cube(environment))
    (x, y, z), (xx, yy, zz) = first, np.einsum("iic->ic", second)
    band_0, band_1, band_2 = 1 / (4 * np.pi), 2 / (4 * np.pi), 15 / (16 * np.pi)
    return np.stack(
        [
            band_0 * total,
            band_1 * y,
            band_1 * z,
            band_1 * x,
            band_2 * second[0, 1],
            band_2 * second[1, 2],
            band_2 / 12 * (3 * zz - total),
            band_2 * second[0, 2],
            band_2 / 4 * (xx - yy),
        ]
    )


def as_cube(environment: EnvironmentMap) -> EnvironmentMap:
    """The environment as a cube, where it is none: of about its size. What gathers light knows cubes and lat-long."""
    if environment.layout is CUBE:
        return environment
    return EnvironmentMap(CUBE, area_faces(environment, max(environment.size)))


def _panorama_moments(source: EnvironmentMap) -> tuple[F64, F64, F64]:
    """Integrals of radiance times 1, d, d d^T over all directions d: (3,), (3, 3), (3, 3, 3), channel last."""
    step, longitude = _longitudes(source.size[0], source)
    # Means over a texel: those of its middle, times what the sine or cosine loses over its width.
    once, twice = np.sinc(step / (2 * np.pi)) * step, np.sinc(step / np.pi) * step
    waves = np.stack(
        [
            np.full(len(longitude), step),
            once * np.sin(longitude),
            once * np.cos(longitude),
            twice * np.sin(2 * longitude),
            twice * np.cos(2 * longitude),
        ]
    )
    rows = np.matmul(waves.astype(np.float32), source.pixels[0]).astype(np.float64)

    edges = row_edges(source)
    cos, sin = np.cos(edges), np.sin(edges)
    # Antiderivatives of sin, sin cos, sin^2, sin^2 cos, sin^3, sin cos^2 over the colatitude.
    whole = [-cos, sin**2 / 2, (edges - sin * cos) / 2, sin**3 / 3, cos**3 / 3 - cos, -(cos**3) / 3]
    zonal, y, across, y_across, across2, y2 = np.diff(whole, axis=1)

    def integral(weight: F64, wave: int) -> F64:
        result: F64 = weight @ rows[:, wave]
        return result

    xy, yz, xz = integral(y_across, 1), -integral(y_across, 2), -integral(across2, 3) / 2
    half, swing = integral(across2, 0) / 2, integral(across2, 4) / 2
    first = np.stack([integral(across, 1), integral(y, 0), -integral(across, 2)])
    second = np.stack(
        [
            np.stack([half - swing, xy, xz]),
            np.stack([xy, integral(y2, 0), yz]),
            np.stack([xz, yz, half + swing]),
        ]
    )
    return integral(zonal, 0), first, second


def _longitudes(width: int, source: EnvironmentMap) -> tuple[float, F64]:
    """Of `width` columns over a lat-long picture: how wide each is, radians; and their middles (width,)."""
    return 2 * np.pi / width, 2 * np.pi * (
        ((np.arange(width) + 0.5) / width - source.offset[0]) / source.scale[0] - 0.5
    )


def _cube_moments(source: EnvironmentMap) -> tuple[F64, F64, F64]:
    """As _panorama_moments."""
    faces, border = source.pixels, source.has_own_grid
    while faces.shape[1] > 256 and faces.shape[1] % 2 == 0 and not border:
        faces = pyramid.halve(faces)
    n = faces.shape[1]
    at = np.linspace(-1, 1, n) if border else (2 * np.arange(n) + 1) / n - 1
    # On every face a direction is (1, a, b) / |(1, a, b)| along major axis, s and t.
    along = 1 / np.sqrt(1 + at[None, :] ** 2 + at[:, None] ** 2)
    local = (along, along * at[None, :], along * at[:, None])
    weights = np.empty((13, n, n), np.float32)
    weights[0] = area = cube.solid_angles(n, border=border)
    for i, one in enumerate(local):
        weights[1 + i] = weighted = area * one
        for j, other in enumerate(local):
            weights[4 + 3 * i + j] = weighted * other
    moments = np.matmul(weights.reshape(13, n * n), faces.reshape(6, n * n, 3)).astype(np.float64)
    axes = cube.face_axes()
    first = np.einsum("fki,fkc->ic", axes, moments[:, 1:4])
    second = np.einsum("fki,fmj,fkmc->ijc", axes, axes, moments[:, 4:].reshape(6, 3, 3, 3))
    return moments[:, 0].sum(axis=0), first, second


class Cells(Frozen, eq=False):
    """An environment in small cells. dirs: (M, 3) float32, the middle of each one's light. light: (M, 3, 3) float32
    integrals of direction times radiance over each, channel last."""

    dirs: F32
    light: F32


def cells(environment: EnvironmentMap, fineness: int = 64) -> Cells:
    """The environment in cells of at most 90 / fineness degrees a side, none smaller than half of that but texels.

    Of all texels, by exact integrals over their solid angles: n . light is a cell's part of the irradiance on a surface
    of normal n that sees all of it, to rounding.
    """
    if environment.layout is LATLONG:
        geometry, light = _panorama_cells(environment, 2 * fineness)
    else:
        geometry, light = _cube_cells(as_cube(environment), fineness)
    # A cell counts as seen where its light's middle is; where its channels disagree in sign, or all is dark, its own.
    middle = light.sum(axis=-1)
    middle *= np.sign(np.einsum("mi,mi->m", middle, geometry))[:, None]
    middle += (
        np.abs(middle).mean() * 1e-6 * geometry / np.linalg.norm(geometry, axis=-1, keepdims=True) + 1e-30 * geometry
    )
    dirs = middle / np.linalg.norm(middle, axis=-1, keepdims=True)
    return Cells(dirs.astype(np.float32), light.astype(np.float32))


def _panorama_cells(source: EnvironmentMap, rows: int) -> tuple[F64, F64]:
    """(M, 3) and (M, 3, 3): of `rows` rows at least, the integrals of direction, and of direction times radiance."""
    pixels = _at_least(source.pixels, rows)[0]
    height, width = pixels.shape[:2]
    step, longitude = _longitudes(width, source)
    once = np.sinc(step / (2 * np.pi)) * step
    waves = np.stack([once * np.sin(longitude), np.full(width, step), -once * np.cos(longitude)])
    edges = row_edges(replace(source, pixels=pixels[None]))
    across = np.diff(edges - np.sin(edges) * np.cos(edges)) / 2
    zonal = np.stack([across, np.diff(np.sin(edges) ** 2) / 2, across])
    starts = np.arange(0, width, max(1, width // (2 * rows)))
    geometry, light = [], []
    for top in range(0, height, block := max(1, height // rows)):
        weight = zonal[:, top : top + block]
        summed = np.einsum("ir,rwc->iwc", weight.astype(np.float32), pixels[top : top + block], optimize=True)
        light.append(np.add.reduceat(waves[..., None] * summed, starts, axis=1))
        geometry.append(np.add.reduceat(waves * weight.sum(axis=1)[:, None], starts, axis=1))
    return np.concatenate(geometry, axis=1).T, np.concatenate(light, axis=1).transpose(1, 0, 2)


def _cube_cells(source: EnvironmentMap, size: int) -> tuple[F64, F64]:
    """As _panorama_cells, with faces of `size` cells at least."""
    faces = _at_least(source.pixels, size)
    n = faces.shape[1]
    places = (np.arange(n + 1) / n - source.offset[0]) / source.scale[0]
    areas = cube.vector_areas(np.clip(2 * places - 1, -1, 1))
    starts = np.arange(0, n, max(1, n // size))

    def in_cells(texels: F64) -> F64:
        return np.add.reduceat(np.add.reduceat(texels, starts, axis=0), starts, axis=1)

    local = in_cells(areas).reshape(-1, 3)
    geometry, light = [], []
    for face, axes in zip(faces, cube.face_axes()):
        seen = np.stack([in_cells(areas[..., i, None] * face) for i in range(3)], axis=2)
        geometry.append(local @ axes)
        light.append(np.einsum("mkc,ki->mic", seen.reshape(-1, 3, 3), axes))
    return np.concatenate(geometry), np.concatenate(light)


def _at_least(pixels: F32, rows: int) -> F32:
    """Pixels (tiles, H, W, C) of `rows` rows at least: texels repeated, as each stands for its whole area."""
    times = math.ceil(rows / pixels.shape[1])
    return pixels if times == 1 else pixels.repeat(times, axis=1).repeat(times, axis=2)


def light_vectors(of: Cells, normals: npt.ArrayLike) -> F64:
    """(K, 3, 3) float64, channel last: the sum of the light of all cells before surfaces of normals (K, 3), any length.

    Unit n . result is the irradiance by quadrature, and the result itself how that changes with n. Cells count whole or
    not at all: of cells h radians wide, a share of h^2 / 12 is lost of even light (8e-5 at a fineness of 64).
    """
    n = np.asarray(normals, np.float32)
    light = of.light.reshape(len(of.light), 9)
    result = np.empty((len(n), 9))
    for start in range(0, len(n), _ROWS):
        seen = (n[start : start + _ROWS] @ of.dirs.T > 0).astype(np.float32)
        result[start : start + _ROWS] = seen @ light
    return result.reshape(-1, 3, 3)


def light_over_faces(of: Cells, at: F64) -> F64:
    """(6, n, n, 3, 3): light_vectors of the normals through the places `at` (n,) along s and t of a cube's faces, 0..1
    and as many on either side of the middle."""
    dirs = cube.face_dir(np.arange(0, 6, 2)[:, None, None], at[None, None, :], at[None, :, None])
    front = light_vectors(of, dirs.reshape(-1, 3)).reshape(*dirs.shape, 3)
    result = np.empty((6, *front.shape[1:]))
    result[::2] = front
    # What is not before a surface is behind it. The face opposite to +X or +Z has its t the other way round, that to +Y
    # its s.
    result[1::2] = of.light.sum(axis=0, dtype=np.float64) - front
    result[1], result[3], result[5] = result[1, ::-1].copy(), result[3, :, ::-1].copy(), result[5, ::-1].copy()
    return result


def irradiance_map(environment: EnvironmentMap, size: int) -> F32:
    """Irradiance / pi by quadrature over the whole picture, as a cube (6, size, size, 3) float32, looked up by normal.

    Read bilinearly, it is off by up to (2 / size)^2 / 8 of its second derivative, and where a point light sets by as
    much as 1 / (2 size) of it.
    """
    light = light_over_faces(cells(environment, 32), (np.arange(size) + 0.5) / size)
    result: F64 = np.einsum("ftsi,ftsic->ftsc", texel_dirs(CUBE, (size, size)), light) / np.pi
    return result.astype(np.float32)
