"""Diffuse light from all round: nine spherical harmonics, or a small cube of the cosine integral itself."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from glbump.maps import cube, pyramid
from glbump.maps.layout import CUBE, LATLONG, EnvironmentMap, row_edges
from glbump.maps.prefilter import area_faces

F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]


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
        total, first, second = _cube_moments(_as_cube(environment))
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


def _as_cube(environment: EnvironmentMap) -> EnvironmentMap:
    """Environments of any other layout are gathered from a cube of about their size."""
    if environment.layout is CUBE:
        return environment
    return EnvironmentMap(CUBE, area_faces(environment, max(environment.size)))


def _panorama_moments(source: EnvironmentMap) -> tuple[F64, F64, F64]:
    """Integrals of radiance times 1, d, d d^T over all directions d: (3,), (3, 3), (3, 3, 3), channel last."""
    width = source.size[0]
    longitude = 2 * np.pi * (((np.arange(width) + 0.5) / width - source.offset[0]) / source.scale[0] - 0.5)
    step = 2 * np.pi / width
    # Means over a texel: those of its middle, times what the sine or cosine loses over its width.
    once, twice = np.sinc(step / (2 * np.pi)) * step, np.sinc(step / np.pi) * step
    waves = np.stack(
        [
            np.full(width, step),
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
