"""Light from all round: diffuse as nine spherical harmonics, glossy as a chain of cubes blurred by the GGX lobe."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from glbump.errors import LimitError
from glbump.maps import cube, pyramid
from glbump.maps.layout import CUBE, LATLONG, EnvironmentMap, sample

F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]

_WIDTH = 2.0
"""Width of the lobe per alpha, radians: D (n.l) = (1 + (angle / 2 alpha)^2)^-2 of its peak, near the peak."""

_WIDEST = 0.5
"""Width beyond which cells do not grow any more, so that broad lobes, cheap as they are, see no facets."""

_COARSEST = 4
"""Smallest faces of the chain, and of the tree its levels are read from."""

_BLOCK = 64
"""Texels that share one list of cells: 8x8 of them."""

_PRODUCTS = 50_000
"""Weights computed at a time: few enough for the cache, and for OpenBLAS to stay on one thread (its threads wait
for each other in busy loops, five times slower on a machine that has other work)."""


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

    edges = _row_edges(source)
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


def _row_edges(source: EnvironmentMap) -> F64:
    """Colatitudes between the rows, and of the poles: (H + 1,), radians."""
    height = source.size[1]
    v = (np.arange(height + 1) / height - source.offset[1]) / source.scale[1]
    return np.clip(v, 0, 1) * np.pi


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


def gloss_chain(environment: EnvironmentMap, size: int, samples: int) -> list[F32]:
    """The environment seen through GGX lobes: (6, n, n, 3) float32 for n = size, size / 2, ... 4.

    Level i is for roughness i / (levels - 1), alpha its square; level 0 is the environment itself, averaged over
    texels. Each texel is the mean of radiance l, weighted by D(h) (n.l) with n = v = its own direction: what a
    split sum takes for granted. A constant environment stays that constant, to rounding.

    size: a power of two from 8. samples: of the environment, within 4 alpha of the lobe's axis (80 % of its
    light), for the texels of level 1; beyond, they grow with the distance. Each next level, with a quarter of
    the texels, takes twice as many.

    Not sampled at random: the lobe depends on one angle alone, so each texel is a sum over the environment as a
    tree of texels (Barnes and Hut 1986), near ones fine, far ones coarse, each where its light is.
    """
    if size < 2 * _COARSEST or size & (size - 1):
        raise LimitError(f"the size of a gloss chain must be a power of two from {2 * _COARSEST}; got {size}")
    if samples < 1:
        raise LimitError(f"a gloss chain needs at least 1 sample; got {samples}")
    faces = area_faces(environment, size)
    tree = _tree(faces)
    last = (size // _COARSEST).bit_length() - 1
    return [faces] + [_blurred(tree, size >> i, (i / last) ** 2, samples << (i - 1)) for i in range(1, last + 1)]


def area_faces(environment: EnvironmentMap, size: int) -> F32:
    """The environment as (6, size, size, 3) float32 by the OpenGL table, each texel averaged over its area.

    A plain cube of 2^k times the size: by solid angles, so that no light is lost. Otherwise by up to 3x3 bilinear
    samples a texel, from the level of the source whose texels are no smaller than theirs.
    """
    if environment.layout is CUBE and not environment.has_own_grid:
        ratio = environment.pixels.shape[1] / size
        if ratio >= 1 and math.log2(ratio).is_integer():
            faces = environment.pixels
            while faces.shape[1] > size:
                weight = cube.solid_angles(faces.shape[1])[None, :, :, None]
                faces = pyramid.halve(faces * weight) / pyramid.halve(weight)
            return faces
    # A texel at the middle of a face spans 2 / size radians, one of the source this much.
    span = 2 * np.pi if environment.layout is LATLONG else 2.0
    across = math.ceil(environment.size[0] / span * 2 / size)
    if across > 3:
        if environment.layout is LATLONG:
            return area_faces(_halved(environment), size)
        return area_faces(EnvironmentMap(CUBE, area_faces(environment, 2 * size)), size)
    at = (np.arange(size * across) + 0.5) / (size * across)
    result = np.empty((6, size, size, 3), np.float32)
    for face in range(6):
        values = sample(environment, cube.face_dir(face, at[None, :], at[:, None]))
        result[face] = values.reshape(size, across, size, across, 3).mean(axis=(1, 3))
    return result


def _halved(source: EnvironmentMap) -> EnvironmentMap:
    """The next smaller level, rows by their solid angles, so that no light is lost."""
    bands = -np.diff(np.cos(_row_edges(source)))[:, None, None]
    pixels = pyramid.halve(source.pixels[0] * bands) / pyramid.halve(bands)
    return EnvironmentMap(LATLONG, pixels[None], source.scale, source.offset)


@dataclass(frozen=True)
class _Cells:
    """One level of the tree: (M, 3) unit directions, and (M, 4) radiance times solid angle, solid angle.

    In Z order: the children of cell k in the next finer level are 4 k to 4 k + 3. size: texels along a face.
    """

    dirs: F32
    light: F32
    size: int


def _z_order(n: int) -> npt.NDArray[np.intp]:
    """The n * n places of a face, as rows of a flat array, in Z order; n a power of two."""
    bits = n.bit_length() - 1
    axes = [axis for bit in range(bits) for axis in (bit, bits + bit)]
    return np.arange(n * n).reshape((2,) * (2 * bits)).transpose(axes).ravel()


def _in_z_order(faces: npt.NDArray[Any]) -> npt.NDArray[Any]:
    n, channels = faces.shape[1], faces.shape[-1]
    return faces.reshape(6, n * n, channels)[:, _z_order(n)].reshape(-1, channels)


def _tree(faces: F32) -> list[_Cells]:
    """Cells of the faces' own size first, 4x4 on each face last. Each lies where its light has its middle."""
    n = faces.shape[1]
    area = np.tile(cube.solid_angles(n).ravel()[_z_order(n)], 6)[:, None]
    radiance = _in_z_order(faces)
    light = np.concatenate([radiance * area, area], axis=1)
    # The share of the mean keeps dark texels where they are.
    bright = np.abs(radiance).sum(axis=1, keepdims=True, dtype=np.float64)
    weight = (bright + 1e-6 * bright.mean() + np.finfo(np.float32).tiny) * area
    middle = _in_z_order(cube.texel_directions(n)) * weight
    levels = []
    while True:
        dirs = middle / np.linalg.norm(middle, axis=1, keepdims=True)
        levels.append(_Cells(dirs.astype(np.float32), light.astype(np.float32), n))
        if n == _COARSEST:
            return levels
        n //= 2
        light, middle = (a.reshape(len(a) // 4, 4, -1).sum(axis=1) for a in (light, middle))


def _blurred(tree: list[_Cells], n: int, alpha: float, samples: int) -> F32:
    """(6, n, n, 3) float32: for each texel the tree's light weighted by the lobe round its direction."""
    targets = _in_z_order(cube.texel_directions(n)).astype(np.float32)
    values = np.empty((len(targets), 3), np.float32)
    # Within twice the width, `samples` cells of fineness * width.
    width, fineness = min(_WIDTH * alpha, _WIDEST), math.sqrt(4 * math.pi / samples)
    block = min(_BLOCK, n * n)
    for start in range(0, len(targets), block):
        dirs, light = _cells_seen(tree, targets[start : start + block], width, fineness)
        rows = max(1, _PRODUCTS // len(dirs))
        for at in range(start, start + block, rows):
            here = slice(at, min(at + rows, start + block))
            sums = _lobe(targets[here] @ dirs.T, alpha) @ light
            values[here] = sums[:, :3] / sums[:, 3:]
    result = np.empty((6, n * n, 3), np.float32)
    result[:, _z_order(n)] = values.reshape(6, n * n, 3)
    return result.reshape(6, n, n, 3)


def _cells_seen(tree: list[_Cells], at: F32, width: float, fineness: float) -> tuple[F32, F32]:
    """The cells that directions `at`, close together, sum over: each at most fineness * hypot(width, distance)."""
    middle = at.mean(axis=0)
    middle /= np.linalg.norm(middle)
    radius = math.acos(min(1.0, float((at @ middle).min())))
    cells = np.arange(len(tree[-1].dirs))
    dirs, light = [], []
    for level in reversed(tree):
        size = 2 / level.size
        here = level.dirs.take(cells, axis=0)
        cosine = here @ middle
        # Past the horizon of every one of the directions the lobe is 0.
        seen = cosine > math.cos(min(math.pi, math.pi / 2 + radius + size))
        # size <= fineness * hypot(width, distance), solved for the distance.
        enough = math.sqrt(max(0.0, (size / fineness) ** 2 - width**2))
        fine = seen & (cosine <= math.cos(min(math.pi, enough + radius))) if enough and level is not tree[0] else seen
        dirs.append(here.compress(fine, axis=0))
        light.append(level.light.take(cells.compress(fine), axis=0))
        cells = (4 * cells.compress(seen & ~fine)[:, None] + np.arange(4)).ravel()
    return np.concatenate(dirs), np.concatenate(light)


def _lobe(cosine: F32, alpha: float) -> F32:
    """D(h) (n.l) for n = v, 1 at its peak, of the cosine between n and l; float32 in place. (n.h)^2 = (1 + n.l) / 2.

    Relative error in float32 at the peak 1e-7 / alpha^2.
    """
    square = alpha * alpha
    d = cosine * np.float32((square - 1) / (2 * square))
    d += np.float32((square + 1) / (2 * square))
    d *= d
    np.maximum(cosine, 0, out=cosine)
    cosine /= d
    return cosine
