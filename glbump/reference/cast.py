"""Rays against surfaces in float64: the exact sphere, torus and quad, and the triangles of the rest."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from glbump.mesh import Mesh
from glbump.reference import mapping
from glbump.shapes import Quad, Shape, Sphere, Torus

F64 = npt.NDArray[np.float64]
Index = npt.NDArray[np.intp]


@dataclass(frozen=True)
class Hits:
    """Where rays meet a surface, in its object space.

    ray: (K,) which of the rays. t: (K,) ray parameter. piece: (K,) which of the shape's pieces, 0 for round ones.
    p, n: (K, 3) point and outward unit normal.
    uv: (K, 2), dpdu, dpdv: (K, 3); None where the surface has no u, v. dndu, dndv: (K, 3) derivatives of n; None where
    it has none, or is flat.
    """

    ray: Index
    t: F64
    piece: Index
    p: F64
    n: F64
    uv: F64 | None
    dpdu: F64 | None
    dpdv: F64 | None
    dndu: F64 | None = None
    dndv: F64 | None = None


@dataclass(frozen=True)
class Grid:
    """Where a mesh's vertices appear among the rays, so that few rays are tried against each triangle.

    places: (V, 3) column times w, row times w, and w of each vertex; ray (row, column) is at those whole numbers, and w
    is above 0 ahead of the eye. width, height: of the grid.
    """

    places: F64
    width: int
    height: int


def cast(shape: Shape, mesh: Mesh, grid: Grid, origins: F64, dirs: F64) -> Hits:
    """First hits of rays origins (N, 3) + t dirs (N, 3), t > 0, in object space; dirs of any length.

    mesh: the triangles of shapes that have no formula, with their places on the grid of the N rays.
    """
    if isinstance(shape, Sphere):
        return _sphere(shape, origins, dirs)
    if isinstance(shape, Torus):
        return _torus(shape, origins, dirs)
    hits = _triangles(mesh, grid, origins, dirs)
    return _on_quad(shape, hits) if isinstance(shape, Quad) else hits


def _sphere(shape: Sphere, origins: F64, dirs: F64) -> Hits:
    a = np.einsum("ni,ni->n", dirs, dirs)
    b = np.einsum("ni,ni->n", origins, dirs)
    c = np.einsum("ni,ni->n", origins, origins) - shape.radius**2
    inner = b * b - a * c
    root = np.sqrt(np.maximum(inner, 0))
    # The smaller root, or from inside the larger; each without cancellation.
    q = np.where(b < 0, root - b, -root - b)
    near, far = np.where(b < 0, c / q, q / a), np.where(b < 0, q / a, c / q)
    t = np.where(near > 0, near, far)
    ray = np.flatnonzero((inner >= 0) & (t > 0))
    p = origins[ray] + t[ray, None] * dirs[ray]
    p *= shape.radius / np.linalg.norm(p, axis=-1, keepdims=True)
    n = p / shape.radius
    uv, dpdu, dpdv = mapping.sphere_uv(p), mapping.sphere_dpdu(p), mapping.sphere_dpdv(p)
    return Hits(ray, t[ray], np.zeros_like(ray), p, n, uv, dpdu, dpdv, dpdu / shape.radius, dpdv / shape.radius)


def _torus(shape: Torus, origins: F64, dirs: F64) -> Hits:
    """The first root of the torus' quartic along each ray: its extremes, roots of a cubic, part the ray into
    stretches with at most one root each; in the first that changes sign the root is bisected and polished."""
    big, small = shape.radius, shape.tube
    length = np.linalg.norm(dirs, axis=-1)
    d = dirs / length[:, None]
    # From the closest point to the centre, so that the coefficients do not cancel for far eyes.
    middle = -np.einsum("ni,ni->n", origins, d)
    o = origins + middle[:, None] * d
    reach = np.sqrt(np.maximum((big + small) ** 2 - np.einsum("ni,ni->n", o, o), 0))
    ray = np.flatnonzero((reach > 0) & (middle + reach > 0))
    o, d, middle, reach = o[ray], d[ray], middle[ray], reach[ray]
    # (|o|^2 + t^2 + R^2 - r^2)^2 = 4 R^2 (h0 + 2 h1 t + h2 t^2), with o . d = 0.
    k = np.einsum("ni,ni->n", o, o) + big * big - small * small
    h0, h1, h2 = (x[:, 0] * y[:, 0] + x[:, 2] * y[:, 2] for x, y in ((o, o), (o, d), (d, d)))
    c2, c1, c0 = 2 * k - 4 * big**2 * h2, -8 * big**2 * h1, k * k - 4 * big**2 * h0

    def f(t: F64) -> F64:
        return ((t * t + c2) * t + c1) * t + c0

    start = np.maximum(-reach, -middle)
    turns = np.sort(np.clip(_depressed_cubic_roots(c2 / 2, c1 / 4), start[:, None], reach[:, None]), axis=1)
    stops = np.column_stack([start, turns, reach])
    values = np.stack([f(stops[:, i]) for i in range(5)], axis=1)
    change = (values[:, :-1] > 0) != (values[:, 1:] > 0)
    first = change.argmax(axis=1)
    kept = np.flatnonzero(change.any(axis=1))
    rows = np.arange(len(ray))
    low, high = stops[rows, first], stops[rows, first + 1]
    rising = values[rows, first] <= 0
    for _ in range(60):
        t = 0.5 * (low + high)
        below = (f(t) > 0) == rising
        low, high = np.where(below, low, t), np.where(below, t, high)
    t = 0.5 * (low + high)
    p = (o + t[:, None] * d)[kept]
    ray, t = ray[kept], (t + middle)[kept] / length[ray[kept]]
    uv, n = mapping.torus_uv(p, big), mapping.torus_normal(p, big)
    dpdu, dpdv = mapping.torus_dpdu(p), mapping.torus_dpdv(p, big)
    dndu, dndv = mapping.torus_dndu(p, big), mapping.torus_dndv(p, big)
    return Hits(ray, t, np.zeros_like(ray), p, n, uv, dpdu, dpdv, dndu, dndv)


def _depressed_cubic_roots(p: F64, q: F64) -> F64:
    """Real roots (N, 3) of t^3 + p t + q; where there is one, it stands three times."""
    inner = (q / 2) ** 2 + (p / 3) ** 3
    three = inner <= 0
    m = 2 * np.sqrt(np.maximum(-p / 3, 0))
    cosine = np.clip(np.divide(3 * q, p * m, out=np.zeros_like(q), where=three & (p * m != 0)), -1, 1)
    angle = np.arccos(cosine)[:, None] / 3 - np.array([0, 2, 4]) * np.pi / 3
    many = m[:, None] * np.cos(angle)
    root = np.sqrt(np.maximum(inner, 0))
    one = np.cbrt(-q / 2 + root) + np.cbrt(-q / 2 - root)
    t = np.where(three[:, None], many, one[:, None])
    for _ in range(2):
        slope = 3 * t * t + p[:, None]
        value = (t * t + p[:, None]) * t + q[:, None]
        t = t - np.divide(value, slope, out=np.zeros_like(t), where=np.abs(slope) > 1e-12)
    return t


_PAIRS = 1_000_000
"""Ray and triangle pairs tried at once."""


def _triangles(mesh: Mesh, grid: Grid, origins: F64, dirs: F64) -> Hits:
    """Nearest hits by Moeller and Trumbore 1997."""
    a, b, c = (mesh.positions[mesh.triangles[:, i]] for i in range(3))
    best_t = np.full(len(origins), np.inf)
    best = np.full(len(origins), -1)
    for triangle, ray in _pairs(mesh, grid):
        e1, e2 = b[triangle] - a[triangle], c[triangle] - a[triangle]
        d, from_a = dirs[ray], origins[ray] - a[triangle]
        across = np.cross(d, e2)
        det = np.einsum("ni,ni->n", e1, across)
        inverse = np.divide(1.0, det, out=np.zeros_like(det), where=det != 0)
        u = np.einsum("ni,ni->n", from_a, across) * inverse
        q = np.cross(from_a, e1)
        v = np.einsum("ni,ni->n", d, q) * inverse
        t = np.einsum("ni,ni->n", e2, q) * inverse
        # A hair of slack, so that no ray slips between two triangles.
        hit = (det != 0) & (u >= -1e-12) & (v >= -1e-12) & (u + v <= 1 + 1e-12) & (t > 0) & (t < best_t[ray])
        # Farthest first, so that the nearest is written last.
        order = np.flatnonzero(hit)[np.argsort(-t[hit], kind="stable")]
        best_t[ray[order]], best[ray[order]] = t[order], triangle[order]
    ray = np.flatnonzero(best >= 0)
    corners = mesh.triangles[best[ray]]
    p = origins[ray] + best_t[ray, None] * dirs[ray]
    weights = mapping.barycentric(p, *(mesh.positions[corners[:, i]] for i in range(3)))

    def at(values: F64 | None) -> F64 | None:
        return None if values is None else np.einsum("nk,nkc->nc", weights, values[corners])

    n = at(mesh.normals)
    if n is None:
        n = np.cross(*(mesh.positions[corners[:, i]] - mesh.positions[corners[:, 0]] for i in (1, 2)))
    length = np.linalg.norm(n, axis=-1, keepdims=True)
    by_uv = at(mesh.uv), at(mesh.dpdu), at(mesh.dpdv), at(mesh.dndu), at(mesh.dndv)
    return Hits(ray, best_t[ray], pieces(mesh)[best[ray]], p, n / length, *by_uv)


def pieces(mesh: Mesh) -> Index:
    """(T,) number of the piece each triangle belongs to: triangles that share vertices are one; a hard edge, where
    vertices are doubled, parts two."""
    label = np.arange(len(mesh.positions))
    while True:
        lowest = label[mesh.triangles].min(axis=1)
        spread = label.copy()
        for corner in range(3):
            np.minimum.at(spread, mesh.triangles[:, corner], lowest)
        spread = spread[spread]
        if np.array_equal(spread, label):
            return np.unique(label[mesh.triangles[:, 0]], return_inverse=True)[1]
        label = spread


def _pairs(mesh: Mesh, grid: Grid) -> Iterator[tuple[Index, Index]]:
    """(triangle, ray) to try: each triangle with the rays in the box round it on the grid."""
    x, y, w = np.moveaxis(grid.places[mesh.triangles], -1, 0)
    # These are linear in the place: what is below 0 at the corners is so all over the triangle, and where w is above 0
    # that means beside the grid.
    sides = x + w, y + w, grid.width * w - x, grid.height * w - y, w
    apart = np.any([(side < 0).all(axis=1) for side in sides], axis=0)
    # Another that reaches past the eye may be seen anywhere.
    beside = (w <= 1e-9 * np.abs(grid.places).max() / max(grid.width, grid.height)).any(axis=1)
    corners = np.stack([x, y], axis=-1)[~beside] / w[~beside, :, None]
    # Far beside the grid is as good as anywhere beside it, and fits an integer.
    corners = np.clip(corners, -1e6, 1e6)
    low = np.zeros((len(w), 2), np.intp)
    high = np.tile(np.array([grid.width, grid.height], np.intp), (len(w), 1))
    low[~beside] = np.maximum(np.floor(corners.min(axis=1)), 0)
    high[~beside] = np.minimum(np.ceil(corners.max(axis=1)) + 1, (grid.width, grid.height))
    high[apart] = 0
    wide, tall = np.maximum(high - low, 0).T
    seen = np.flatnonzero(wide * tall)
    ends = np.cumsum((wide * tall)[seen])
    for group in np.split(seen, np.searchsorted(ends, np.arange(_PAIRS, ends[-1] if len(ends) else 0, _PAIRS))):
        count = (wide * tall)[group]
        triangle = np.repeat(group, count)
        within = np.arange(len(triangle)) - np.repeat(np.cumsum(count) - count, count)
        row, column = np.divmod(within, wide[triangle])
        yield triangle, (low[triangle, 1] + row) * grid.width + low[triangle, 0] + column


def _on_quad(shape: Quad, hits: Hits) -> Hits:
    corners = np.array(shape.corners, np.float64)
    uv = mapping.inverse_bilinear(hits.p, *corners)
    dpdu, dpdv = mapping.bilinear_dpdu(uv, *corners), mapping.bilinear_dpdv(uv, *corners)
    return Hits(hits.ray, hits.t, hits.piece, hits.p, hits.n, uv, dpdu, dpdv)
