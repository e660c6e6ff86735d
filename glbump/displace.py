"""Surfaces moved by their heights: the lecture's O' = O + B N/|N| carried out, as a mesh, float64.

What bump mapping stands in for, and is measured against (docs/bump.md).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from glbump import validate as check
from glbump.camera import Camera, view_matrix
from glbump.contents import Contents
from glbump.errors import LimitError, SceneError
from glbump.maps import bspline
from glbump.mesh import Mesh, tessellate
from glbump.reference import bump as bumps
from glbump.reference import gradients, mapping
from glbump.reference.cast import Hits
from glbump.relief import sized
from glbump.scene import Bump, NormalMap, Surface
from glbump.shapes import MESHES, Cube, MeshData, Plane, Quad, Shape, Sphere, Torus, Transform

F64 = npt.NDArray[np.float64]
Index = npt.NDArray[np.int64]

MOST_TRIANGLES = 2_000_000
"""Of a displaced surface: some 600 MB while it is made."""

ENOUGH = 800_000
"""Triangles that a frame is not given more of where cells larger than a pixel do: 10 seconds' work."""

CELL_PIXELS = 4.0
"""The largest cell, in pixels. Of what waves of 20 pixels do to a mirror, cells of 1 and 2 lose 2 and 5 %."""

PER_TEXEL = 2
"""Cells along a texel: the spline bends within one."""

FEWEST = 96
"""Cells round a sphere or a torus, whatever the map: their own outline is as good as that."""


@dataclass(frozen=True)
class Points:
    """Points of a surface in its object space, (N, 3) each, and what its bumps need of it there.

    n: unit normals. uv: (N, 2). dpdu, dpdv: change of p per unit of u and v. dndu, dndv: of n; their parts along n do
    not count. triangles: (T, 3), counter-clockwise seen from outside.
    """

    p: F64
    n: F64
    uv: F64
    dpdu: F64
    dpdv: F64
    dndu: F64
    dndv: F64
    triangles: Index


class Heights:
    """The heights of a surface, smooth between the texels: the cubic B-splines through its maps, added up.

    SceneError where it has none, or heights that are no lengths.
    """

    def __init__(self, surface: Surface, contents: Contents) -> None:
        own = (sized(bump, surface, contents) for bump in surface.bumps)
        self.bumps = tuple(bump for bump in own if isinstance(bump, Bump))
        if not self.bumps:
            raise SceneError("the surface has no heights to be displaced by; give it a bump with heights")
        if any(bump.mapping != "uv" for bump in self.bumps):
            raise SceneError('heights are displaced by u and v; use mapping "uv" to displace a surface by them')
        if any(bump.scaling != "world" for bump in self.bumps):
            raise SceneError(
                'heights of scaling "parameter" are no lengths, and move no surface; use scaling "world" to displace it'
            )
        self._splines = [_spline(bump, contents) for bump in self.bumps]

    def at(self, uv: F64) -> tuple[F64, F64]:
        """(N,) heights in world units, and (N, 2) their slopes per unit of u and of v."""
        height, slope = np.zeros(len(uv)), np.zeros((len(uv), 2))
        for first in range(0, len(uv), _AT_ONCE):
            rows = slice(first, first + _AT_ONCE)
            for bump, spline in zip(self.bumps, self._splines, strict=True):
                value, rate = _read(bump, spline, uv[rows] * bump.map_repeat)
                height[rows] += bump.amplitude * value
                slope[rows] += rate * bump.slope_scale
        return height, slope


_AT_ONCE = 1 << 16
"""Places that heights are taken at together; bounds the memory."""
_EDGE = 2
"""Coefficients drawn out beyond the edge of a map that ends: the spline reads two to either side."""


def _spline(bump: Bump, contents: Contents) -> F64:
    """Coefficients, row 0 at v = 0; of a map that ends with _EDGE more of them round it."""
    heights = contents.heights(bump)[::-1]
    if bump.border != "clamp":
        return bspline.coefficients(heights)  # one that mirrors is here with its mirror images
    return np.pad(bspline.coefficients(heights, "clamp"), _EDGE, mode="edge")


def _read(bump: Bump, spline: F64, place: F64) -> tuple[F64, F64]:
    """Height and slopes of a map at places in it, 0..1 over it."""
    if bump.border != "clamp":
        return gradients.height_bspline(spline, place), gradients.slope_bspline(spline, place)
    whole = np.array(spline.shape[::-1], np.float64)
    share = (whole - 2 * _EDGE) / whole
    inside = (place >= 0) & (place <= 1)
    at = np.clip(place, 0, 1) * share + _EDGE / whole
    return gradients.height_bspline(spline, at), gradients.slope_bspline(spline, at) * share * inside


def displaced(surface: Surface, cells: tuple[int, int] | None = None, *, contents: Contents | None = None) -> Surface:
    """The surface with its heights carried out: a mesh, and no heights any more.

    cells: how finely it is divided, per unit of u and of v; PER_TEXEL for each texel of its maps unless given. Normals
    are those of the displaced surface, from its derivatives (Blinn's full form); on a mesh file, of the smooth surface
    its own normals stand for. Normal maps stay, on the displaced surface. Faces of a cube part at its edges, as far
    as heights there are not 0, and so do the sides of a hard edge of a mesh file.
    Raises SceneError where there are no heights or no u and v, and LimitError past MOST_TRIANGLES and where
    points leave the range of lengths.
    """
    contents = contents or Contents()
    heights = Heights(surface, contents)
    points = points_of(surface.shape, checked_cells(cells) if cells else cells_of_maps(surface, contents), contents)
    height, slope = heights.at(points.uv)
    p = points.p @ surface.transform.matrix()[:3, :3].T
    n, normals = bent(surface.transform, points, height, slope)
    p += height[:, None] * n
    if np.abs(p).max() > check.LONGEST:
        raise LimitError(
            f"heights reach {np.abs(height).max():.3g}, and displaced points must lie within {check.LONGEST:g}; "
            "lower bump.amplitude"
        )
    triangles = points.triangles[:, ::-1] if surface.transform.mirrors else points.triangles
    normal_maps = tuple(bump for bump in surface.bumps if isinstance(bump, NormalMap))
    return replace(
        surface,
        shape=MeshData(p, triangles, normals, points.uv),
        bump=normal_maps or None,
        transform=Transform(translate=surface.transform.translate),
    )


def bent(transform: Transform, at: Points | Hits, height: F64, slope: F64) -> tuple[F64, F64]:
    """Unit normals (N, 3) in the world: the surface's own, and those of the displaced surface."""
    n, dpdu, dpdv, dndu, dndv = in_world(transform, at)
    return n, bumps.bump_normal(n, bumps.full_gradient(n, dpdu, dpdv, dndu, dndv, height, slope))


def in_world(transform: Transform, at: Points | Hits) -> tuple[F64, F64, F64, F64, F64]:
    """n, dp/du, dp/dv, dn/du and dn/dv (N, 3) of points of a surface, as the world has them."""
    linear = transform.matrix()[:3, :3]
    inverse = np.linalg.inv(linear)
    assert at.dpdu is not None
    assert at.dpdv is not None
    n, flat = at.n @ inverse, np.zeros_like(at.n)
    length = np.linalg.norm(n, axis=1, keepdims=True)
    # A unit normal's derivative but for what it has along the normal.
    dndu, dndv = ((flat if d is None else d @ inverse) / length for d in (at.dndu, at.dndv))
    return n / length, at.dpdu @ linear.T, at.dpdv @ linear.T, dndu, dndv


def checked_cells(cells: Any) -> tuple[int, int]:
    """Two whole numbers from 1 up."""
    values = check.vector("cells", cells, 2)
    u, v = (check.integer(f"cells[{i}]", value, least=1, most=1 << 24) for i, value in enumerate(values))
    return u, v


def cells_of_maps(surface: Surface, contents: Contents) -> tuple[int, int]:
    """PER_TEXEL cells for each texel of the finest of a surface's height maps, per unit of u and of v."""
    most = [_fewest(surface.shape)] * 2
    for bump in (sized(bump, surface, contents) for bump in surface.bumps):
        if isinstance(bump, Bump):
            rows, columns = contents.heights(bump).shape
            for axis, texels in enumerate((columns, rows)):
                if texels > 1:  # along one texel heights are the same everywhere
                    most[axis] = max(most[axis], math.ceil(PER_TEXEL * texels * bump.map_repeat[axis]))
    return most[0], most[1]


def cells_for(surface: Surface, camera: Camera, size: tuple[int, int], contents: Contents) -> tuple[int, int]:
    """As cells_of_maps, but where a frame of `size` pixels shows less, a cell a pixel where the surface is nearest; up
    to CELL_PIXELS each way where that would be past ENOUGH triangles. LimitError past MOST_TRIANGLES."""
    points = points_of(surface.shape, (24, 24) if not isinstance(surface.shape, MESHES) else (1, 1), contents)
    matrix = surface.transform.matrix()
    along = [float(np.linalg.norm(a @ matrix[:3, :3].T, axis=1).max()) for a in (points.dpdu, points.dpdv)]
    view = view_matrix(camera)
    depth = -((points.p @ matrix[:3, :3].T + matrix[:3, 3]) @ view[2, :3] + view[2, 3])
    if camera.projection == "orthographic":
        per_unit = size[1] / camera.height
    elif depth.min() > 0:
        per_unit = size[1] / (2 * math.tan(math.radians(camera.fov) / 2) * float(depth.min()))
    else:
        per_unit = math.inf  # beside or behind the eye
    fewest = _fewest(surface.shape)
    wanted = cells_of_maps(surface, contents)
    for pixels in np.geomspace(1, CELL_PIXELS, 7):
        shown = [min(a * per_unit / pixels, 2.0**24) for a in along]
        u, v = (min(texels, max(fewest, math.ceil(seen))) for texels, seen in zip(wanted, shown, strict=True))
        if _count(surface.shape, (u, v), contents) <= ENOUGH:
            break
    _check_count(surface.shape, (u, v), contents)
    return u, v


def _fewest(shape: Shape) -> int:
    return FEWEST if isinstance(shape, Sphere | Torus) else 1


def _count(shape: Shape, cells: tuple[int, int], contents: Contents) -> int:
    """Triangles of a shape in so many cells per unit of u and v."""
    if isinstance(shape, MESHES):
        mesh = contents.mesh(shape)
        return len(mesh.triangles) * _parts(mesh, cells) ** 2
    return 2 * cells[0] * cells[1] * (6 if isinstance(shape, Cube) else 1)


def _parts(mesh: Mesh, cells: tuple[int, int]) -> int:
    """Into how many parts a mesh's edges are cut, so that none is longer than a cell."""
    assert mesh.uv is not None
    corners = mesh.uv[mesh.triangles]
    return max(1, math.ceil((np.abs(corners - np.roll(corners, 1, axis=1)) * cells).max()))


def _check_count(shape: Shape, cells: tuple[int, int], contents: Contents) -> None:
    count = _count(shape, cells, contents)
    if count > MOST_TRIANGLES:
        raise LimitError(
            f"displaced in {cells[0]:,} x {cells[1]:,} cells per unit of u and v the surface has {count:,} triangles; "
            f"at most {MOST_TRIANGLES:,}: ask for fewer cells, or lower bump.repeat or the map's size"
        )


def points_of(shape: Shape, cells: tuple[int, int], contents: Contents) -> Points:
    """Points all over a shape, `cells` of them per unit of u and v; LimitError past MOST_TRIANGLES."""
    if isinstance(shape, MESHES) and (contents.mesh(shape).uv is None or contents.mesh(shape).normals is None):
        raise SceneError(
            f"{shape.name} has no texture coordinates, and heights need them; unwrap the mesh, or leave out bump"
        )
    _check_count(shape, cells, contents)
    if isinstance(shape, MESHES):
        mesh = contents.mesh(shape)
        return _divided(mesh, _parts(mesh, cells))
    faces = 6 if isinstance(shape, Cube) else 1
    uv, triangles = _grid(cells)
    if isinstance(shape, Sphere):
        # At a pole two corners of each second triangle are one point.
        pole = (uv[:, 1] == 0) | (uv[:, 1] == 1)
        triangles = triangles[pole[triangles].sum(axis=1) < 2]
    every = triangles + len(uv) * np.arange(faces)[:, None, None]
    at = points_at(shape, np.tile(uv, (faces, 1)), np.repeat(np.arange(faces), len(uv)))
    return replace(at, triangles=every.reshape(-1, 3))


def points_at(shape: Quad | Plane | Cube | Sphere | Torus, uv: F64, face: Index) -> Points:
    """Points of a shape at uv (N, 2), exact; face: (N,) which of a cube's, else 0. Without triangles."""
    none = np.zeros((0, 3), np.int64)
    if not isinstance(shape, Sphere | Torus):
        corners = np.array(shape.corners)[None] if isinstance(shape, Quad) else tessellate(shape, 3).positions
        a, b, c, d = (corners.reshape(-1, 4, 3)[face, i] for i in range(4))
        u, v = uv[:, :1], uv[:, 1:]
        p = (1 - v) * ((1 - u) * a + u * b) + v * ((1 - u) * d + u * c)
        n = np.cross(c - a, d - b)
        n /= np.linalg.norm(n, axis=1, keepdims=True)
        dpdu, dpdv = mapping.bilinear_dpdu(uv, a, b, c, d), mapping.bilinear_dpdv(uv, a, b, c, d)
        return Points(p, n, uv, dpdu, dpdv, np.zeros_like(p), np.zeros_like(p), none)
    # At u = 1 it is u = 0 again, to the bit.
    longitude = 2 * np.pi * (uv[:, 0] % 1 - 0.5)
    out = np.stack([np.sin(longitude), np.zeros(len(uv)), np.cos(longitude)], axis=-1)
    up = np.array([0.0, 1.0, 0.0])
    if isinstance(shape, Torus):
        angle = (2 * np.pi * (uv[:, 1] % 1 - 0.5))[:, None]
        n = np.cos(angle) * out + np.sin(angle) * up
        p, radius = shape.radius * out + shape.tube * n, shape.radius
        by_u, by_v = mapping.torus_dpdu(p), mapping.torus_dpdv(p, radius)
        return Points(p, n, uv, by_u, by_v, mapping.torus_dndu(p, radius), mapping.torus_dndv(p, radius), none)
    angle = (np.pi * (uv[:, 1] - 0.5))[:, None]
    n = np.cos(angle) * out + np.sin(angle) * up
    pole = (uv[:, 1] == 0) | (uv[:, 1] == 1)
    n[pole] = np.sign(uv[pole, 1:] - 0.5) * up
    p, r = shape.radius * n, shape.radius
    by_u, by_v = mapping.sphere_dpdu(p), mapping.sphere_dpdv(p)
    return Points(p, n, uv, by_u, by_v, by_u / r, by_v / r, none)


def _grid(cells: tuple[int, int]) -> tuple[F64, Index]:
    """uv (N, 2) of a grid over 0..1, column after column in each row; and its triangles."""
    columns, rows = cells
    u, v = np.meshgrid(np.arange(columns + 1) / columns, np.arange(rows + 1) / rows)
    here = (np.arange(rows)[:, None] * (columns + 1) + np.arange(columns)).reshape(-1)
    right, above = here + 1, here + columns + 1
    triangles = np.stack([here, right, above + 1, here, above + 1, above], axis=-1).reshape(-1, 3)
    return np.stack([u.reshape(-1), v.reshape(-1)], axis=-1), triangles


def _divided(mesh: Mesh, parts: int) -> Points:
    """Each triangle cut into parts^2, its edges into `parts`, so that neighbours still meet."""
    i, j = (a.reshape(-1) for a in np.meshgrid(np.arange(parts + 1), np.arange(parts + 1), indexing="ij"))
    kept = i + j <= parts
    i, j = i[kept], j[kept]
    number = np.full((parts + 1, parts + 1), -1)
    number[i, j] = np.arange(len(i))
    upright = [number[:-1, :-1], number[1:, :-1], number[:-1, 1:]]
    turned = [number[1:, :-1], number[1:, 1:], number[:-1, 1:]]
    few = np.concatenate([np.stack(three, axis=-1).reshape(-1, 3) for three in (upright, turned)])
    few = few[(few >= 0).all(axis=1)]
    weights = np.stack([parts - i - j, i, j], axis=-1) / parts

    def spread(values: F64 | None) -> F64:
        assert values is not None
        return np.einsum("wk,tkc->twc", weights, values[mesh.triangles]).reshape(-1, values.shape[1])

    normals = spread(mesh.normals)
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    # Between vertices whose normals are opposite there is none.
    n = normals / np.where(length > 0, length, 1.0)
    uv, dpdu, dpdv, dndu, dndv = map(spread, (mesh.uv, mesh.dpdu, mesh.dpdv, mesh.dndu, mesh.dndv))
    triangles = (few + len(i) * np.arange(len(mesh.triangles))[:, None, None]).reshape(-1, 3)
    return Points(spread(mesh.positions), n, uv, dpdu, dpdv, dndu, dndv, triangles)
