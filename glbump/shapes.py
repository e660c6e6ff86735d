"""The shapes a scene can hold, and where they stand: plain data; `mesh.py` makes triangles of them."""

from __future__ import annotations

import os
from functools import lru_cache
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from glbump import validate as check
from glbump.errors import SceneError, shown
from glbump.frozen import Frozen

Vec2 = tuple[float, float]
Vec3 = tuple[float, float, float]


class Quad(Frozen):
    """A flat convex quadrilateral; u,v by inverse bilinear interpolation of its corners.

    corners: lower left, lower right, upper right, upper left, seen from its front,
    with uv (0,0) (1,0) (1,1) (0,1).
    """

    kind: ClassVar[str] = "quad"
    corners: tuple[Vec3, Vec3, Vec3, Vec3] = ((-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0))

    def __post_init__(self) -> None:
        given = check.sequence(self.corners)
        if given is None or len(given) != 4:
            raise SceneError(f"quad.corners must be 4 points of 3 numbers; got {shown(self.corners)}")
        corners = tuple(check.point(f"quad.corners[{i}]", c) for i, c in enumerate(given))
        self._store(corners=corners)
        p = np.array(corners, dtype=np.float64)
        edges = np.roll(p, -1, axis=0) - p
        turns = np.cross(edges, np.roll(edges, -1, axis=0))
        normal = np.cross(p[2] - p[0], p[3] - p[1])
        size = float(np.abs(p - p.mean(axis=0)).max())
        area = float(np.linalg.norm(normal))
        if area <= 1e-12 * size * size or not np.all(turns @ normal > 0):
            raise SceneError(
                "quad.corners must go counter-clockwise round a convex quadrilateral with four corners; "
                f'got {corners}; use kind = "mesh" for other outlines'
            )
        height = float(np.abs((p - p[0]) @ normal).max()) / area
        if height > 1e-5 * size:
            raise SceneError(
                f"quad.corners must lie in one plane, to 1e-5 of its size; got {height / size:.2g}; "
                'use kind = "mesh" for a bent patch'
            )


class Plane(Frozen):
    """A rectangle of `size` (x, z) about the origin, facing +Y; u along +X, v along -Z."""

    kind: ClassVar[str] = "plane"
    size: Vec2 = (2.0, 2.0)

    def __post_init__(self) -> None:
        self._store(size=check.vector("plane.size", self.size, 2, least=check.SHORTEST, most=check.LONGEST))


class Cube(Frozen):
    """A box of `size` (x, y, z) about the origin; every face has uv 0..1, seen upright from outside."""

    kind: ClassVar[str] = "cube"
    size: Vec3 = (2.0, 2.0, 2.0)

    def __post_init__(self) -> None:
        self._store(size=check.vector("cube.size", self.size, 3, least=check.SHORTEST, most=check.LONGEST))


class Sphere(Frozen):
    """A sphere of `radius` about the origin with latitude-longitude uv; u = 1/2 faces +Z."""

    kind: ClassVar[str] = "sphere"
    radius: float = 1.0

    def __post_init__(self) -> None:
        self._store(radius=check.length("sphere.radius", self.radius))


class Torus(Frozen):
    """A ring of `radius` around +Y with a `tube` of its own radius; v = 1/2 on the outer equator, rising."""

    kind: ClassVar[str] = "torus"
    radius: float = 1.0
    tube: float = 0.35

    def __post_init__(self) -> None:
        radius = check.length("torus.radius", self.radius)
        self._store(radius=radius, tube=check.length("torus.tube", self.tube))
        if self.tube >= radius:
            raise SceneError(
                f"torus.tube must be smaller than torus.radius (the ring would cut itself); "
                f"got tube {self.tube:g} and radius {radius:g}"
            )


class MeshFile(Frozen):
    """A mesh from an OBJ, PLY, STL or GLB file."""

    kind: ClassVar[str] = "mesh"
    path: Path

    def __post_init__(self) -> None:
        if not isinstance(self.path, str | os.PathLike) or not str(self.path):
            raise SceneError(f"mesh.path must be the path of a mesh file; got {shown(self.path)}")
        self._store(path=Path(self.path))

    @property
    def name(self) -> str:
        """What notes and errors call it."""
        return str(self.path)


class MeshData(Frozen, eq=False):
    """A mesh from arrays, copied and kept read-only; equal to itself alone.

    positions: (V, 3). triangles: (T, 3) whole numbers, rows of it, counter-clockwise seen from outside.
    normals: (V, 3) of any length; where there are none, means of the triangles' round each vertex, weighted by angle.
    uv: (V, 2), v up; bumps need them. A scene file holds no arrays: write them to a mesh file for that.
    """

    kind: ClassVar[str] = "mesh-data"
    positions: npt.ArrayLike
    triangles: npt.ArrayLike
    normals: npt.ArrayLike | None = None
    uv: npt.ArrayLike | None = None

    def __post_init__(self) -> None:
        positions = _rows("mesh_data.positions", self.positions, 3)
        try:
            given = np.array(self.triangles)
        except ValueError:  # rows of different lengths
            given = np.array(None)
        if given.ndim != 2 or given.shape[1] != 3 or not len(given) or given.dtype.kind not in "iu":
            raise SceneError(
                "mesh_data.triangles must be an array (T, 3) of whole numbers, rows of positions; "
                f"got shape {given.shape} and type {given.dtype}"
            )
        if given.min() < 0 or given.max() >= len(positions):
            raise SceneError(
                f"mesh_data.triangles must be rows of positions, 0 to {len(positions) - 1}; "
                f"got {given.min()} to {given.max()}"
            )
        self._store(positions=positions, triangles=_read_only(given.astype(np.int64)))
        for name, width in (("normals", 3), ("uv", 2)):
            if getattr(self, name) is not None:
                self._store(**{name: _rows(f"mesh_data.{name}", getattr(self, name), width, len(positions))})

    @property
    def name(self) -> str:
        """What notes and errors call it."""
        return f"a mesh of {len(np.asarray(self.triangles)):,} triangles"


def _read_only(values: npt.NDArray[Any]) -> npt.NDArray[Any]:
    values.flags.writeable = False
    return values


def _rows(what: str, value: Any, width: int, count: int | None = None) -> npt.NDArray[Any]:
    """A read-only copy (N, width), float64, of what lies within LONGEST; SceneError otherwise."""
    try:
        values = np.array(value, np.float64)
    except (TypeError, ValueError, OverflowError):
        raise SceneError(f"{what} must be an array (N, {width}) of numbers; got {shown(value)}") from None
    if values.ndim != 2 or values.shape[1] != width or not len(values) or count not in (None, len(values)):
        rows = "N" if count is None else f"{count:,}, one for each position"
        raise SceneError(f"{what} must be an array ({rows}, {width}) of numbers; got shape {values.shape}")
    wrong = ~(np.abs(values) <= check.LONGEST).all(axis=1)  # NaN compares false
    if wrong.any():
        row = int(wrong.argmax())
        raise SceneError(
            f"{what} must be finite, and at most {check.LONGEST:g}; {np.count_nonzero(wrong):,} of {len(values):,} "
            f"rows are not, the first is number {row:,}, {tuple(values[row].tolist())}"
        )
    return _read_only(values)


Shape = Quad | Plane | Cube | Sphere | Torus | MeshFile | MeshData
SHAPES: tuple[type[Any], ...] = (Quad, Plane, Cube, Sphere, Torus, MeshFile, MeshData)
FILE_SHAPES = SHAPES[:-1]
"""Those that a scene file can hold: no arrays."""
MESHES = (MeshFile, MeshData)
"""Shapes whose triangles are their own, whatever the segments."""


STRETCH = 1e6
"""Most that a transform may stretch one axis over another."""


class Transform(Frozen):
    """Where a shape stands in the world: first scaled, then rotated, then moved.

    translate: world units. rotate: degrees about the fixed world axes x, then y, then z.
    scale: one factor, or one for each axis; none may be 0; a negative one mirrors.
    """

    translate: Vec3 = (0.0, 0.0, 0.0)
    rotate: Vec3 = (0.0, 0.0, 0.0)
    scale: Vec3 | float = (1.0, 1.0, 1.0)

    def __post_init__(self) -> None:
        checked = check.point("transform.scale", check.sequence(self.scale) or (self.scale,) * 3)
        if min(map(abs, checked)) < check.SHORTEST:
            raise SceneError(
                f"transform.scale must be at least {check.SHORTEST:g} or at most -{check.SHORTEST:g} "
                f"on each axis (the surface would vanish); got {checked}"
            )
        if max(map(abs, checked)) > STRETCH * min(map(abs, checked)):
            raise SceneError(
                f"transform.scale must not differ by more than {STRETCH:g} between axes (seen from the shape itself, "
                f"directions would be rounding); got {checked}"
            )
        self._store(
            translate=check.point("transform.translate", self.translate),
            rotate=check.vector("transform.rotate", self.rotate, 3),
            scale=checked,
        )

    def matrix(self) -> npt.NDArray[np.float64]:
        """(4, 4) float64: world_from_object for column vectors; read-only."""
        return _matrix(self)

    def inverse(self) -> npt.NDArray[np.float64]:
        """(3, 3) float64: object_from_world for directions; read-only."""
        return _inverse(self)

    def to_object(self, point_world: Vec3) -> npt.NDArray[np.float64]:
        """(3,): a point of the world, as the shape has it; the difference first, so that far places cancel rightly."""
        return self.inverse() @ np.subtract(point_world, self.translate)

    @property
    def mirrors(self) -> bool:
        """Whether left and right change places."""
        sx, sy, sz = np.asarray(self.scale).tolist()
        return (sx < 0) ^ (sy < 0) ^ (sz < 0)

    @property
    def uniform_scale(self) -> float | None:
        """The size of the scale where it is the same along all axes (mirroring or not), else None."""
        sizes = {abs(s) for s in np.asarray(self.scale).tolist()}
        return sizes.pop() if len(sizes) == 1 else None


# Each frame asks for the same few again and again, and NumPy is slow with such small things.
@lru_cache(maxsize=256)
def _matrix(transform: Transform) -> npt.NDArray[np.float64]:
    rx, ry, rz = np.radians(transform.rotate)
    cx, sx, cy, sy, cz, sz = np.cos(rx), np.sin(rx), np.cos(ry), np.sin(ry), np.cos(rz), np.sin(rz)
    about_x = np.array([[1, 0, 0], [0, cx, -sx], [0, sx, cx]])
    about_y = np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
    about_z = np.array([[cz, -sz, 0], [sz, cz, 0], [0, 0, 1]])
    result = np.eye(4)
    result[:3, :3] = about_z @ about_y @ about_x @ np.diag(np.asarray(transform.scale, dtype=np.float64))
    result[:3, 3] = transform.translate
    result.flags.writeable = False
    return result


@lru_cache(maxsize=256)
def _inverse(transform: Transform) -> npt.NDArray[np.float64]:
    scale = np.asarray(transform.scale, dtype=np.float64)
    # A rotation's inverse is its transpose, whatever the scale.
    result: npt.NDArray[np.float64] = (_matrix(transform)[:3, :3] / scale).T / scale[:, None]
    result.flags.writeable = False
    return result
