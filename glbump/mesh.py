"""Triangles of the shapes, no more of them than the silhouette's error asks for.

Normals, dp/du and dp/dv of spheres and tori come per pixel from the mathematics, so their meshes carry
positions alone. All triangles are counter-clockwise seen from outside.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from glbump.errors import SceneError
from glbump.frozen import Frozen
from glbump.shapes import Cube, MeshData, MeshFile, Plane, Quad, Shape, Sphere, Torus

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int32]

SEGMENTS = (8, 1024)
"""The fewest and the most segments round a circle that `segments_for` asks for."""


class Mesh(Frozen, eq=False):
    """Triangles in object space.

    positions: (V, 3). triangles: (T, 3) int32 into them, counter-clockwise seen from outside.
    normals: (V, 3) unit length; uv: (V, 2), v up; dpdu, dpdv: (V, 3), change of position per unit of u and v.
    dndu, dndv: (V, 3), change of the unit normal; None on flat shapes, where there is none. Only their parts in the
    tangent plane mean anything.
    tangents: (T, 3, 4) float32, the file's own at the triangles' corners, unit x, y, z and w as in glTF; 0 where it has
    none. Only normal maps go by them: see mikktspace.normal_mapped.
    notes: what was found and mended while reading a file, one sentence each.
    """

    positions: Floats
    triangles: Ints
    normals: Floats | None = None
    uv: Floats | None = None
    dpdu: Floats | None = None
    dpdv: Floats | None = None
    dndu: Floats | None = None
    dndv: Floats | None = None
    tangents: npt.NDArray[np.float32] | None = None
    notes: tuple[str, ...] = ()

    def lengths(self, taken: Callable[[Floats], Any]) -> tuple[float, float]:
        """Of dp/du and of dp/dv, what `taken` gives of those at all vertices, and never 0: 1 without u and v."""
        if self.dpdu is None or self.dpdv is None:
            return 1.0, 1.0
        u, v = (max(float(taken(np.linalg.norm(d, axis=-1))), 1e-30) for d in (self.dpdu, self.dpdv))
        return u, v


def tessellate(shape: Shape, segments: int) -> Mesh:
    """The triangles of `shape`, every vertex on its surface.

    segments: how good a sphere or torus is. No point of its mesh lies farther from the true surface than the
    regular polygon with so many sides lies from its circle, r (1 - cos(pi / segments)), r the outermost
    radius. A sphere's mesh lies inside it, so a ray that meets the mesh meets the sphere; a torus's mesh
    stands out by up to that much on the inner side. Flat shapes and mesh files ignore it.
    Quad, plane and cube carry exact attributes at their vertices (a quad's are not linear in between).
    Raises SceneError for segments below 3, MeshError for a mesh file that cannot be used.
    """
    if segments < 3:
        raise SceneError(f"segments must be at least 3; got {segments}")
    match shape:
        case Sphere(radius=radius):
            return _sphere(radius, segments)
        case Torus(radius=radius, tube=tube):
            return _torus(radius, tube, segments)
        case Quad(corners=corners):
            return _quad(np.array(corners, dtype=np.float64))
        case Plane(size=(x, z)):
            return _faces(np.array([[0.0, 0, 0]]), np.array([[x, 0.0, 0]]), np.array([[0, 0.0, -z]]))
        case Cube(size=size):
            across, up = _CUBE_ACROSS * size, _CUBE_UP * size
            return _faces(np.cross(_CUBE_ACROSS, _CUBE_UP) * size / 2, across, up)
        case MeshFile(path=path):
            from glbump.meshfile import load_mesh

            return load_mesh(path)
        case MeshData():
            from glbump.meshfile import mesh_of

            return mesh_of(shape)


def in_frame(mesh: Mesh, origin: Floats, unit: float) -> Mesh:
    """The mesh in coordinates counted from `origin` (3,), in `unit`s."""
    dpdu, dpdv = (None if t is None else t / unit for t in (mesh.dpdu, mesh.dpdv))
    return replace(mesh, positions=(mesh.positions - origin) / unit, dpdu=dpdu, dpdv=dpdv)


def steepest_turn(mesh: Mesh) -> float:
    """The largest angle between normals along an edge, in radians per unit of the edge's length."""
    if mesh.normals is None:
        return 0.0
    a, b = mesh.triangles.T[[0, 1, 2]], mesh.triangles.T[[1, 2, 0]]
    turn = 2 * np.arcsin(np.minimum(np.linalg.norm(mesh.normals[a] - mesh.normals[b], axis=-1) / 2, 1.0))
    length = np.linalg.norm(mesh.positions[a] - mesh.positions[b], axis=-1)
    result: float = np.divide(turn, length, out=np.zeros_like(turn), where=length > 0).max(initial=0.0)
    return float(result)


WHOLE_REPEATS = 32
"""Repeats from 0 up to which 32-bit floats keep a place in a picture to 1/256 texel of 1024."""


def in_repeats(mesh: Mesh, repeat: tuple[float, float]) -> Mesh:
    """The mesh with uv counted in repeats of a picture. Where 32 bits would lose the fraction, whole repeats are taken
    from each triangle, which then has its vertices for itself."""
    if mesh.uv is None:
        return mesh
    places = mesh.uv * repeat
    if np.abs(places).max() <= WHOLE_REPEATS:
        return replace(mesh, uv=places)
    corners = places[mesh.triangles]
    corners -= np.rint(corners.mean(axis=1, keepdims=True))
    rows = mesh.triangles.reshape(-1)
    carried = ("normals", "dpdu", "dpdv", "dndu", "dndv")
    own = {name: values[rows] for name in carried if (values := getattr(mesh, name)) is not None}
    triangles = np.arange(len(rows), dtype=np.int32).reshape(-1, 3)
    return replace(mesh, positions=mesh.positions[rows], triangles=triangles, uv=corners.reshape(-1, 2), **own)


def outline(segments: int) -> Mesh:
    """The unit disc in the plane z = 0, facing +z: a polygon of `segments` sides, for `outline_matrix` to place.

    Cut into triangles by halving: each takes two sides off what is left, so that few are thin.
    """
    angle = 2 * np.pi / segments * np.arange(segments)
    points = np.stack([np.cos(angle), np.sin(angle), np.zeros(segments)], axis=-1)
    left = np.arange(segments, dtype=np.int32)
    ears = []
    while len(left) > 3:
        pairs = len(left) // 2
        ears.append(np.stack([left[: 2 * pairs : 2], left[1::2], np.roll(left, -2)[: 2 * pairs : 2]], axis=-1))
        left = left[::2]
    return Mesh(points, np.concatenate([*ears, left[None]] if len(left) == 3 else ears))


def outline_matrix(radius: float, eye: Sequence[float]) -> Floats:
    """(4, 4) that places `outline` where the sphere about the origin is seen to end; every ray from the eye to the
    sphere crosses the disc, between the points where it enters and leaves the sphere.

    eye: (x, y, z, 1) outside the sphere, or (x, y, z, 0), the unit direction of view.
    """
    *towards, w = eye
    distance = math.hypot(*towards)
    # Sine of half the angle that the sphere fills, seen from the eye: 0 from infinitely far.
    sine = radius / distance if w else 0.0
    x, y, z = (c / (distance if w else -distance) for c in towards)
    rim = radius * math.sqrt(1 - sine * sine)
    # The disc's x: y cross facing, or x cross facing where that is too short.
    if abs(y) < 0.9:
        across = math.hypot(x, z)
        right = z / across, 0.0, -x / across
    else:
        across = math.hypot(y, z)
        right = 0.0, -z / across, y / across
    a, b, c = right
    up = y * c - z * b, z * a - x * c, x * b - y * a
    columns = [[rim * v for v in right], [rim * v for v in up], (x, y, z), [radius * sine * v for v in (x, y, z)]]
    matrix = np.eye(4)
    matrix[:3] = np.array(columns).T
    return matrix


def segments_for(shape: Shape, radius_px: float, silhouette_px: float) -> int:
    """The fewest segments that keep the outline within `silhouette_px` of the true one, within SEGMENTS.

    radius_px: the shape's outermost radius (torus: radius + tube) as seen, in pixels.
    """
    if not isinstance(shape, Sphere | Torus) or silhouette_px >= radius_px:
        return SEGMENTS[0]
    # Half the angle of a side: 1 - cos(a) = 2 sin(a/2)^2, which does not cancel where a is small.
    half = 2 * math.asin(math.sqrt(silhouette_px / (2 * radius_px)))
    return min(max(math.ceil(math.pi / half), SEGMENTS[0]), SEGMENTS[1])


def bounds(mesh: Mesh | Shape) -> Floats:
    """(2, 3): lowest and highest corner of the axis-aligned box round a mesh, or round a true shape."""
    match mesh:
        case Sphere(radius=r):
            reach = np.array([r, r, r])
        case Torus(radius=r, tube=t):
            reach = np.array([r + t, t, r + t])
        case Mesh(positions=p):
            return np.stack([p.min(axis=0), p.max(axis=0)])
        case _:
            return bounds(tessellate(mesh, 3))
    return np.stack([-reach, reach])


# Sphere: an icosahedron's 20 faces divided f times along each edge. Its circles are the most even of all
# regular divisions, so it needs the fewest triangles: 1.08 n^2, where rows and columns need 2 n^2, and where
# the thinnest covering of a plane by circles (Kershner 1939) would need 0.98 n^2.

_STRETCH = 1.1
"""Points on a face are weighted by sin(_STRETCH a b), a the edge's angle, b the barycentric coordinate. 1
would be the spherical interpolation of both edges; 1.1 was measured to give the most even triangles."""

_CIRCUMRADIUS = 0.731
"""Angular circumradius of the largest triangle, times f: at most this for every f from 1 to 240 (test)."""


def _sphere(radius: float, segments: int) -> Mesh:
    f = math.ceil(_CIRCUMRADIUS * segments / math.pi)
    return Mesh(radius * _icosphere_points(f), _icosphere_triangles(f))


def _icosahedron() -> Floats:
    """(10, 4, 3): unit corners of ten rhombi, each two faces: five hang from +Y, five stand on -Y."""
    longitude = np.arange(5) * 2 * np.pi / 5
    ring = 2 / math.sqrt(5) * np.stack([np.sin(longitude), np.full(5, 0.5), np.cos(longitude)], axis=-1)
    pole = np.broadcast_to([0.0, 1, 0], (5, 3))
    upper, lower = ring, np.roll(-ring, 2, axis=0)  # lower[k] lies between upper[k] and upper[k + 1]
    after = np.roll(upper, -1, axis=0)
    hanging = np.stack([pole, upper, lower, after], axis=1)
    standing = np.stack([after, lower, -pole, np.roll(lower, -1, axis=0)], axis=1)
    return np.concatenate([hanging, standing])


def _icosphere_points(f: int) -> Floats:
    """(2 + 10 f^2, 3) unit vectors: both poles, then f x f points of each rhombus (i = 1..f, j = 0..f-1)."""
    rhombi = _icosahedron()
    edge = math.acos(float(rhombi[0, 0] @ rhombi[0, 1]))
    weight = np.sin(np.arange(f + 1) / f * edge * _STRETCH)
    i, j = np.arange(1, f + 1)[:, None], np.arange(f)[None, :]
    far = i + j - f
    share = np.stack([np.maximum(-far, 0), np.minimum(i, f - j), np.maximum(far, 0), np.minimum(j, f - i)], -1)
    w = weight[share].reshape(f * f, 4)
    # All rhombi are congruent: the length of one's points is that of all.
    w /= np.linalg.norm(w @ rhombi[0], axis=1, keepdims=True)
    return np.concatenate([[[0.0, 1, 0], [0, -1, 0]], (w @ rhombi).reshape(-1, 3)])


def _icosphere_triangles(f: int) -> Ints:
    """(20 f^2, 3): each rhombus borrows the two borders it does not own from its neighbours."""
    index = np.empty((2, 5, f + 1, f + 1), dtype=np.int32)
    index[..., 1:, :-1] = np.arange(2, 2 + 10 * f * f, dtype=np.int32).reshape(2, 5, f, f)
    hanging, standing = index
    hanging[:, 0, 0], standing[:, f, f] = 0, 1
    hanging[:, 0, 1:] = np.roll(hanging[:, 1:, 0], -1, axis=0)
    hanging[:, 1:, f] = standing[:, 1:, 0]
    standing[:, 0, :f] = np.roll(hanging[:, f, :f], -1, axis=0)
    standing[:, :f, f] = np.roll(standing[:, f, :f], -1, axis=0)
    a, b, c, d = index[..., :-1, :-1], index[..., 1:, :-1], index[..., 1:, 1:], index[..., :-1, 1:]
    return np.stack([a, b, d, b, c, d], axis=-1).reshape(-1, 3)


def _torus(radius: float, tube: float, segments: int) -> Mesh:
    """Rings of points round the axis, every other one turned by half a step: isosceles triangles.

    Measured in curvature, angle round the axis against angle round the tube times
    sqrt(tube / (radius + tube)), the worst place (the outer equator) is flat, and the error is that of the
    triangle's circumcircle, as on the sphere: equilateral triangles of circumradius pi / segments are the
    fewest.
    """
    columns = math.ceil(2 * segments / math.sqrt(3))
    across = math.pi / columns  # half a triangle's base, then its height for the circumradius allowed
    rho = math.pi / segments
    height = rho + math.sqrt(rho * rho - across * across)
    rows = 2 * math.ceil(max(math.pi * math.sqrt(tube / (radius + tube)) / height, 1.5))
    row, column = np.arange(rows)[:, None], np.arange(columns)[None, :]
    around = 2 * np.pi / columns * (column + row % 2 / 2)
    phi = 2 * np.pi / rows * row
    ring = radius + tube * np.cos(phi)
    rise = np.broadcast_to(tube * np.sin(phi), around.shape)
    points = np.stack([ring * np.sin(around), rise, ring * np.cos(around)], axis=-1).reshape(-1, 3)

    here = (row * columns + column).astype(np.int32)
    right = np.roll(here, -1, axis=1)
    above, above_right = np.roll(here, -1, axis=0), np.roll(right, -1, axis=0)
    even = here, right, above, right, above_right, above
    odd = here, right, above_right, here, above_right, above
    triangles = np.empty((rows, columns, 6), dtype=np.int32)
    for k in range(6):
        triangles[::2, :, k], triangles[1::2, :, k] = even[k][::2], odd[k][1::2]
    return Mesh(points, triangles.reshape(-1, 3))


_CORNER_UV = np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]])
_CORNER_TRIANGLES = np.array([[0, 1, 2], [0, 2, 3]], dtype=np.int32)

# Faces +X -X +Y -Y +Z -Z, seen from outside: u to the right, v up; on +Y and -Y as when tipped from +Z.
_CUBE_ACROSS = np.array([[0.0, 0, -1], [0, 0, 1], [1, 0, 0], [1, 0, 0], [1, 0, 0], [-1, 0, 0]])
_CUBE_UP = np.array([[0.0, 1, 0], [0, 1, 0], [0, 0, -1], [0, 0, 1], [0, 1, 0], [0, 1, 0]])


def _faces(centre: Floats, across: Floats, up: Floats) -> Mesh:
    """Rectangles (F, 3) about `centre`, u along `across`, v along `up`, four vertices each."""
    s, t = (_CORNER_UV - 0.5).T[:, None, :, None]
    positions = centre[:, None] + s * across[:, None] + t * up[:, None]
    normal = np.cross(across, up)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    count = len(centre)
    first = 4 * np.arange(count, dtype=np.int32)[:, None, None]
    return Mesh(
        positions.reshape(-1, 3),
        (first + _CORNER_TRIANGLES).reshape(-1, 3),
        np.repeat(normal, 4, axis=0),
        np.tile(_CORNER_UV, (count, 1)),
        np.repeat(across, 4, axis=0),
        np.repeat(up, 4, axis=0),
    )


def _quad(corners: Floats) -> Mesh:
    """Two triangles; dp/du and dp/dv are those of the bilinear patch at its corners."""
    lower_left, lower_right, upper_right, upper_left = corners
    bottom, top = lower_right - lower_left, upper_right - upper_left
    left, right = upper_left - lower_left, upper_right - lower_right
    normal = np.cross(upper_right - lower_left, upper_left - lower_right)
    normal /= np.linalg.norm(normal)
    return Mesh(
        corners,
        _CORNER_TRIANGLES.copy(),
        np.tile(normal, (4, 1)),
        _CORNER_UV.copy(),
        np.stack([bottom, bottom, top, top]),
        np.stack([left, right, right, left]),
    )
