"""Glossy light from all round: a chain of cubes blurred by the GGX lobe."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from glbump.errors import LimitError
from glbump.frozen import Frozen
from glbump.maps import cube, pyramid
from glbump.maps.layout import CUBE, LATLONG, EnvironmentMap, row_edges, sample, texel_dirs

F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]

_WIDTH = 2.0
"""Width of the lobe per alpha, radians: D (n.l) = (1 + (angle / 2 alpha)^2)^-2 of its peak, near the peak."""

_WIDEST = 0.5
"""Width beyond which cells do not grow any more, so that broad lobes, cheap as they are, see no facets."""

SMALLEST_FACES = 4
"""Smallest faces of the chain, and of the tree its levels are read from."""

_BLOCK = 64
"""Texels that share one list of cells: 8x8 of them."""

_PRODUCTS = 50_000
"""Weights computed at a time: few enough for the cache, and for OpenBLAS to stay on one thread (its threads wait
for each other in busy loops, five times slower on a machine that has other work)."""


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
    alphas = chain_alphas(size, samples)
    faces = area_faces(environment, size)
    tree = _tree(faces)
    return [faces] + [_blurred(tree, size >> i, alpha, samples << (i - 1)) for i, alpha in enumerate(alphas, 1)]


def chain_lobes(size: int, samples: int) -> list[Lobe]:
    """The lobe of each level from 1, as samples: of the next root of 2 times as many, with a quarter of the texels.
    Raises LimitError where there is no such chain."""
    alphas = enumerate(chain_alphas(size, samples))
    return [sampled_lobe(alpha, round(samples * 2 ** (i / 2))) for i, alpha in alphas]


def chain_alphas(size: int, samples: int) -> list[float]:
    """alpha of each level from 1 of a chain. Raises LimitError where there is no such chain."""
    if size < 2 * SMALLEST_FACES or size & (size - 1):
        raise LimitError(f"the size of a gloss chain must be a power of two from {2 * SMALLEST_FACES}; got {size}")
    if samples < 1:
        raise LimitError(f"a gloss chain needs at least 1 sample; got {samples}")
    last = (size // SMALLEST_FACES).bit_length() - 1
    return [(i / last) ** 2 for i in range(1, last + 1)]


class Lobe(Frozen):
    """D(h) (n.l) of n = v as samples, for the GPU. samples: (N, 4), directions as even in the lobe as can be, z along
    its axis, by golden-ratio steps round it; and of each the solid angle that it stands for. integral: of the lobe over
    its peak."""

    alpha: float
    samples: F64
    integral: float


def sampled_lobe(alpha: float, count: int) -> Lobe:
    """A lobe as `count` samples."""
    # Fine where the lobe is.
    angle = alpha * np.sinh(np.linspace(0, np.arcsinh(np.pi / 2 / alpha), 20_001))
    angle[-1] = np.pi / 2
    # 1 - cosine = 2 sin^2 (angle / 2): nothing cancels.
    height = np.cos(angle) / (1 + (1 / alpha**2 - 1) * np.sin(angle / 2) ** 2) ** 2
    ring = height * np.sin(angle)
    within = np.concatenate([[0], np.cumsum((ring[1:] + ring[:-1]) / 2 * np.diff(angle))])
    at = np.interp((np.arange(count) + 0.5) / count * within[-1], within, angle)
    turn = np.arange(count) * (np.pi * (math.sqrt(5) - 1))
    integral = 2 * np.pi * within[-1]
    stands_for = integral / (count * np.interp(at, angle, height))
    dirs = np.stack([np.sin(at) * np.cos(turn), np.sin(at) * np.sin(turn), np.cos(at)], axis=-1)
    return Lobe(alpha, np.concatenate([dirs, stands_for[:, None]], axis=-1), float(integral))


SUN = 16.0
"""Times the mean: from there on texels are bright enough to be missed, or met too often, by samples of a lobe."""


def without_bright(faces: F32, most: int) -> tuple[F32, F32, F32]:
    """Faces (6, n, n, 3) with their brightest texels dimmed, to SUN times the mean, or to as bright as the next after
    `most` of them; and of these the directions (K, 3) and the light taken away, radiance times solid angle (K, 3)."""
    n = faces.shape[1]
    flat = faces.reshape(-1, 3)
    height = np.maximum(np.maximum(flat[:, 0], flat[:, 1]), flat[:, 2])
    limit = np.float32(SUN * max(height.mean(dtype=np.float64), 0.0))
    bright = np.flatnonzero(height > limit)
    if len(bright) > most:
        order = bright[np.argsort(height[bright])[-most - 1 :]]
        limit, bright = height[order[0]], order[1:]
    kept = flat.copy()
    kept[bright] *= (limit / height[bright])[:, None]
    face, t, s = np.unravel_index(bright, (6, n, n))
    dirs = cube.face_dir(face, (s + 0.5) / n, (t + 0.5) / n)
    length = np.linalg.norm(dirs, axis=-1, keepdims=True)
    # Solid angles to 2e-4 at n = 64, as if each texel were a point.
    light = (flat[bright] - kept[bright]) * (4 / (n**2 * length**3))
    return kept.reshape(faces.shape), (dirs / length).astype(np.float32), light.astype(np.float32)


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
    source, across = area_reads(environment, size)
    if across > 3:
        return area_faces(EnvironmentMap(CUBE, area_faces(source, 2 * size)), size)
    at = (np.arange(size * across) + 0.5) / (size * across)
    result = np.empty((6, size, size, 3), np.float32)
    for face in range(6):
        values = sample(source, cube.face_dir(face, at[None, :], at[:, None]))
        result[face] = values.reshape(size, across, size, across, 3).mean(axis=(1, 3))
    return result


def area_reads(environment: EnvironmentMap, size: int) -> tuple[EnvironmentMap, int]:
    """The environment, of a panorama the first level, of which across x across bilinear reads make a texel of faces
    `size` wide; and across, for panoramas at most 3."""
    # A texel at the middle of a face spans 2 / size radians, one of the source this much.
    span = 2 * np.pi if environment.layout is LATLONG else 2.0
    across = math.ceil(environment.size[0] / span * 2 / size)
    if across > 3 and environment.layout is LATLONG:
        return area_reads(_halved(environment), size)
    return environment, across


def _halved(source: EnvironmentMap) -> EnvironmentMap:
    """The next smaller level, rows by their solid angles, so that no light is lost."""
    bands = -np.diff(np.cos(row_edges(source)))[:, None, None]
    pixels = pyramid.halve(source.pixels[0] * bands) / pyramid.halve(bands)
    return EnvironmentMap(LATLONG, pixels[None], source.scale, source.offset)


class _Cells(Frozen):
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
    middle = _in_z_order(texel_dirs(CUBE, (n, n))) * weight
    levels = []
    while True:
        dirs = middle / np.linalg.norm(middle, axis=1, keepdims=True)
        levels.append(_Cells(dirs.astype(np.float32), light.astype(np.float32), n))
        if n == SMALLEST_FACES:
            return levels
        n //= 2
        light, middle = (a.reshape(len(a) // 4, 4, -1).sum(axis=1) for a in (light, middle))


def _blurred(tree: list[_Cells], n: int, alpha: float, samples: int) -> F32:
    """(6, n, n, 3) float32: for each texel the tree's light weighted by the lobe round its direction."""
    targets = _in_z_order(texel_dirs(CUBE, (n, n))).astype(np.float32)
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
