"""For each function of shaders/lib: the rows it is tried on, how near its twin it must come, and why so near.

eps is half a unit in the last place of 1: one rounding of a float32. Bounds that depend on the row are functions
of the arguments and of the twin's answer, in float64.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from glbump.glsltest import inputs, ulp
from glbump.reference import bump, footprint, ggx
from glbump.reference import filter as filters
from glbump.reference import spread as spreads
from glbump.reference.direction import axes_across

F64 = npt.NDArray[np.float64]
Rows = tuple[Any, ...]
EPS = 2.0**-24
# Mesa's atan is within 3.5e-6 rad everywhere (STACK); its sin and cos within 1.5 ULP of 1.
ATAN = 3.5e-6
FOLDED = 1.1e-4  # of the mean and the deviation that folded_share gives


@dataclass(frozen=True)
class Case:
    """How one function is compared with its twin.

    rows: its arguments. ulps, abs: the bounds; abs may be a function of (arguments, wanted), with one bound for all
    that is given back, or a tuple of one for each. reason: why these.
    period: what one may add to a component without changing what it means (0: nothing). where: rows to compare,
    as a function of the arguments, where the formula has no one answer.
    """

    rows: Callable[[], Rows]
    reason: str
    ulps: float = 0
    abs: float | Callable[..., Any] = 0.0
    period: tuple[float, ...] = ()
    where: Callable[..., Any] | None = None


def dot(a: npt.ArrayLike, b: npt.ArrayLike) -> F64:
    """Sum of products over the last axis."""
    return np.einsum("...i,...i->...", np.asarray(a, np.float64), np.asarray(b, np.float64))


def length(a: npt.ArrayLike) -> F64:
    return np.sqrt(dot(a, a))


def _scaled(directions: npt.NDArray[np.float32], low: float, high: float, seed: int = 9) -> npt.NDArray[np.float32]:
    """Directions at lengths from low to high, as many in each octave."""
    return directions * inputs.log_uniform(len(directions), low, high, (1,), seed)


def _around(count: int, radius: npt.NDArray[np.float32], seed: int) -> npt.NDArray[np.float32]:
    """Points within a hundredth of `radius` of spheres of that radius: all over, and at axes and edges."""
    made = np.resize(inputs.directions(count, seed), (count, 3))
    return made * (radius * inputs.uniform(count, 0.99, 1.01, seed=seed))[:, None]


# ---- bump


def _frames() -> Rows:
    """n, dp/du, dp/dv at all angles but the flattest, of all lengths, tilted out of the tangent plane; slopes.

    Then rows without area, one length zero or both derivatives along one line; and rows along the axes, where no
    rounding blurs the limits: on both sides of the least area and of the least lengths.
    """
    count = 4000
    n = inputs.directions(count, 1)[-count:]
    u, v = inputs.unit_vectors(count, 2), inputs.unit_vectors(count, 3)
    keep = np.abs(dot(n, np.cross(u, v))) > 0.05
    n, u, v = n[keep], u[keep], v[keep]
    u, v = _scaled(u, 1e-10, 1e10, 4), _scaled(v, 1e-10, 1e10, 5)
    slope = inputs.uniform(len(n), -1, 1, (2,), 6) * inputs.log_uniform(len(n), 1e-6, 1e6, (1,), 7)
    u[-30:-20], v[-20:-10], v[-10:] = 0.0, 0.0, 2 * u[-10:]
    x, y = np.array([1, 0, 0]), np.array([0, 1, 0])
    exact = [(x, x + j * y) for j in (0.95e-6, 1.05e-6, -1.05e-6)]
    exact += [(short * x, y) for short in _AT_LEAST_LENGTH] + [(x, short * y) for short in _AT_LEAST_LENGTH]
    more_u, more_v = (np.array(part, np.float32) for part in zip(*exact, strict=True))
    up = np.resize(np.float32([0, 0, 1]), (len(exact), 3))
    flat = np.resize(np.float32([0.5, 0.25]), (len(exact), 2))
    return tuple(np.concatenate(pair) for pair in ((n, up), (u, more_u), (v, more_v), (slope, flat)))


def _quads_of_pixels() -> Rows:
    """Quads of 2x2 pixels of planes at all angles but the flattest, and heights that rise evenly: drivers may take the
    differences of one row for both. In steps that cancel without rounding; the last see one line, or one point."""
    n = inputs.unit_vectors(1000, 1)
    corner, along, up = (np.random.default_rng(i).integers(-256, 257, (1000, 1, 1, 4)) / 512 for i in (2, 3, 4))
    sides = along[:, 0, 0, :3], up[:, 0, 0, :3]
    keep = np.abs(dot(n, np.cross(*sides))) > 0.05 * length(sides[0]) * length(sides[1])
    n, corner, along, up = (a[keep] for a in (n, corner, along, up))
    up[-10:, ..., :3], along[-20:, ..., :3] = 0.0, 0.0
    x, y = np.arange(2)[:, None], np.arange(2)[:, None, None]
    at = (corner + x * along + y * up).astype(np.float32)
    return np.broadcast_to(n[:, None, None], at[..., :3].shape), at[..., :3], at[..., 3]


def _screen_bound(n: Any, p: Any, height: Any, want: F64) -> F64:
    at = np.concatenate([p, np.asarray(height)[..., None]], axis=-1).astype(np.float64)
    x, y = (np.broadcast_to(d, at.shape) for d in (at[:, :, 1:] - at[:, :, :1], at[:, 1:] - at[:, :1]))
    slope = np.stack([x[..., 3], y[..., 3]], axis=-1).reshape(-1, 2)
    rows = (np.reshape(a, (-1, 3)) for a in (n, x[..., :3], y[..., :3]))
    return _gradient_bound(*rows, slope, want.reshape(-1, 3)).reshape(want.shape[:-1])


def _curved_frames() -> Rows:
    """As _frames, on surfaces bent both ways, with heights up to 0.9 of a radius of curvature, on either side, and past
    it, where the surface is inside out. The last rows lie at a centre of curvature to the bit: no area, no gradient."""
    n, u, v, slope = _frames()
    count = len(n)
    bend = inputs.uniform(count, -0.9, 0.9, (2,), 8)
    bend[::7] += np.sign(bend[::7])
    height = inputs.log_uniform(count, 1e-3, 1e3, seed=9)
    nu, nv = (np.float32(d * k[:, None] / height[:, None]) for d, k in zip((u, v), bend.T, strict=True))
    height[-5:], nu[-5:], nv[-5:] = 1.0, -u[-5:], 0.0
    return n, u, v, nu, nv, height, slope


def _full_bound(n: Any, dpdu: Any, dpdv: Any, dndu: Any, dndv: Any, height: Any, slope: Any, want: F64) -> F64:
    b = np.asarray(height, float)[:, None]
    moved = [np.asarray(p, float) + b * np.asarray(d, float) for p, d in ((dpdu, dndu), (dpdv, dndv))]
    # A difference of two vectors is off by roundings of the longer, and so is its direction by as much over its length.
    lost = [length(p) / np.maximum(length(m), 1e-30) for p, m in zip((dpdu, dpdv), moved, strict=True)]
    return 2 * np.maximum(1.0, np.maximum(*lost)) * _gradient_bound(n, *moved, slope, want)


def _frames_and_extremes() -> Rows:
    """_frames; then slopes of 0, 1e-30 and 1e30 of either sign on axes 1e-15 to 1e15 long, turned so that each of x, y
    and z is the longest; and where the gradient is 1e24 long: on the shortest axes at the least angle."""
    n, u, v, slope = _frames()
    axes = np.eye(3)
    sizes = np.array([0.0, 1e-30, -1e-30, 1.0, 1e30, -1e30])
    pairs = np.stack(np.meshgrid(sizes, sizes), axis=-1).reshape(-1, 2)
    rows = [(axes[2], a * axes[0], b * axes[1], s) for a in (1e-15, 1, 1e15) for b in (1e-15, 1, 1e15) for s in pairs]
    short = 1.05e-18 * axes[0], 1.05e-18 * (axes[0] + 2e-6 * axes[1])
    rows += [(axes[2], *short, np.array(s)) for s in ((1, 0.5), (-0.25, 1e20))]
    more = [np.array(part) for part in zip(*rows, strict=True)]
    turned = [np.concatenate([np.roll(part, k, axis=1) for k in range(3)]) for part in more[:3]]
    every = [*turned, np.tile(more[3], (3, 1))]
    return tuple(np.concatenate([a, np.float32(b)]) for a, b in zip((n, u, v, slope), every, strict=True))


def _invariant_bound(n: Any, dpdu: Any, dpdv: Any, slope: Any, want: F64) -> F64:
    """The direction is off by what surface_gradient's is, over its length; along axes the shader is all but exact."""
    steep = np.abs(slope).max(axis=-1, keepdims=True)
    steep = np.where(steep == 0, 1.0, steep)
    unit = np.asarray(slope, float) / steep
    gradient = bump.surface_gradient(n, dpdu, dpdv, unit)
    size = np.where(length(gradient) > 0, length(gradient), 1.0)
    turned = np.where(np.abs(n).max(axis=-1) == 1, 2.0**-13, _gradient_bound(n, dpdu, dpdv, unit, gradient) / size)
    return length(slope) * (8 * EPS + turned)


_AT_LEAST_LENGTH = (0.95e-18, 1.02e-18, 1.05e-18)
_AT_LEAST_SQUARED = (0.95e-12, 1.02e-12, 1.05e-12)


def _gradient_bound(n: Any, dpdu: Any, dpdv: Any, slope: Any, want: F64) -> F64:
    lu, lv = length(dpdu), length(dpdv)
    full = (lu > 0) & (lv > 0)
    lu, lv = np.where(full, lu, 1.0), np.where(full, lv, 1.0)
    j = np.abs(dot(n, np.cross(np.asarray(dpdu, float) / lu[:, None], np.asarray(dpdv, float) / lv[:, None])))
    each = np.abs(slope[:, 0]) / lu + np.abs(slope[:, 1]) / lv
    oblique = np.where(full & (j > 1e-3), 16 * EPS * each / np.maximum(j, 1e-3) ** 2, 0.0)
    # Near the least area the twin's own determinant, a difference of ones, is good to 2^-53 / j^2.
    return np.where(np.asarray(n)[:, 2] == 1, 2.0**-13 * length(want), oblique)


def _square_frames() -> Rows:
    """dp/du and dp/dv at right angles, of lengths 1e-15 to 1e15; the last rows have none along one of them."""
    n, other = inputs.unit_vectors(2000, 1).astype(float), inputs.unit_vectors(2000, 2).astype(float)
    u = np.cross(n, other)
    u /= length(u)[:, None]
    v = np.cross(n, u)
    u, v = _scaled(u.astype(np.float32), 1e-15, 1e15, 3), _scaled(v.astype(np.float32), 1e-15, 1e15, 4)
    slope = inputs.uniform(2000, -1, 1, (2,), 5) * inputs.log_uniform(2000, 1e-3, 1e3, (1,), 6)
    u[-40:-20], v[-20:] = 0.0, 0.0
    # On both sides of the least length, along the axes and alone, so that nothing covers what they give.
    least = np.float32(_AT_LEAST_SQUARED)[:, None]
    x, y, none = np.float32([[1, 0, 0]]) * least, np.float32([[0, 1, 0]]) * least, np.zeros((3, 3), np.float32)
    short = np.float32(0.95e-12) * np.float32([[0, 1, 0]] * 3)
    more = np.full((9, 2), 0.5, np.float32)
    return np.concatenate([u, x, none, x]), np.concatenate([v, none, y, short]), np.concatenate([slope, more])


def _orthogonal_bound(dpdu: Any, dpdv: Any, slope: Any, want: F64) -> F64:
    lengths = [np.where(length(d) > 1e-12, length(d), np.inf) for d in (dpdu, dpdv)]
    return 8 * EPS * sum(np.abs(slope[:, i]) / lengths[i] for i in (0, 1))


def _normals_and_gradients() -> Rows:
    """Gradients in the tangent plane, from nothing to 1e30: past 1e18 their squares overflow."""
    n, other = inputs.directions(2000, 1), inputs.directions(2000, 2)
    flat = other - n * dot(n, other)[:, None]
    steep = np.concatenate([[0.0], inputs.log_uniform(len(n) - 1, 1e-30, 1e30, seed=3)])
    return n, (flat * steep[:, None]).astype(np.float32)


def _normals_and_volumes() -> Rows:
    """Gradients in all directions, of all lengths; along the normal nothing is left of them."""
    n = inputs.directions(2000, 1)
    g = _scaled(inputs.unit_vectors(len(n), 2), 1e-9, 1e9, 3)
    g[:20] = 3 * n[:20]
    return n, g


def _tilted_frames() -> Rows:
    """As _frames; dp/dv along the bitangent, against it, and none at all, where it is cross(n, t) by rule."""
    n, u, v, _ = _frames()
    v[::17] = 0.0
    return n, u, v


def _frame_bound(n: Any, dpdu: Any, dpdv: Any, want: Any) -> F64:
    along = length(np.asarray(dpdu, float) - np.asarray(n, float) * dot(n, dpdu)[:, None])
    return 8 * EPS * np.where(along > 0, length(dpdu) / np.where(along > 0, along, 1.0), 1.0)


def _has_a_side(n: Any, dpdu: Any, dpdv: Any) -> Any:
    """b's sign is that of b . dp/dv: not where the two are within rounding of a right angle, unless b is zero."""
    side = np.abs(dot(np.cross(np.asarray(n, float), dpdu), dpdv))
    return (side > 1e-4 * length(dpdu) * length(dpdv)) | (length(dpdu) == 0) | (length(dpdv) == 0)


# ---- mapping


def _rays_near_a_sphere() -> Rows:
    """Points within 1 % of spheres of radius 1e-5 to 1e5, rays in all directions, through and past the sphere."""
    radius = inputs.log_uniform(4000, 1e-5, 1e5, seed=2)
    return _around(4000, radius, 1), inputs.unit_vectors(4000, 3), radius


def _sphere_step_bound(p: Any, d: Any, radius: Any, want: F64) -> F64:
    root = np.abs(want + dot(p, d))  # sqrt(b^2 - c); its argument is off by some roundings of radius^2
    r = np.asarray(radius, np.float64)
    return 8 * EPS * r + 8 * EPS * r * r / np.maximum(root, np.sqrt(8 * EPS) * r)


def _sphere_points() -> Rows:
    return (_scaled(inputs.directions(3000, 4), 1e-12, 1e12),)


def _has_a_longitude(p: Any, radius: Any = None) -> Any:
    across = np.hypot(p[:, 0], p[:, 2])
    return (across > 1e-18) | (across == 0)


def _on_spheres() -> Rows:
    radius = inputs.log_uniform(2000, 1e-5, 1e5, seed=2)
    return _around(2000, radius, 4), radius


def _on_sphere_bound(p: Any, radius: Any, want: F64) -> F64:
    return 10 * np.pi * EPS * length(p) / radius


def _torus(count: int = 4000) -> tuple[Any, Any, Any, Any]:
    """Points on tori of radius 1, their angles, and the tube; poles of the tube and the seam among them."""
    turns = np.concatenate([np.array([-1, -0.5, 0, 0.5, 1]), inputs.uniform(count - 5, -1, 1, seed=1)]) * np.pi
    psi = np.concatenate([np.array([0, 0.5, -0.5, 1, 0]), inputs.uniform(count - 5, -1, 1, seed=2)]) * np.pi
    tube = inputs.uniform(count, 0.05, 0.9, seed=3).astype(np.float64)
    ring = 1 + tube * np.cos(psi)
    p = np.stack([ring * np.sin(turns), tube * np.sin(psi), ring * np.cos(turns)], axis=-1)
    outwards = np.stack([np.cos(psi) * np.sin(turns), np.sin(psi), np.cos(psi) * np.cos(turns)], axis=-1)
    return p, outwards, tube, inputs.unit_vectors(count, 5).astype(np.float64)


def _torus_points() -> Rows:
    """Points within 5 % of the tube from the torus; in the planes x = 0, z = 0; and on its axis, u = 1/2 by rule."""
    p, outwards, tube, _ = _torus()
    off = inputs.uniform(len(p), -0.05, 0.05, seed=4)
    p = p + (off * tube)[:, None] * outwards
    p[-5:, [0, 2]] = 0.0
    p[-20:-10, 0], p[-10:-5, 2] = 0.0, 0.0
    p[-20:-15, 2], p[-15:-10, 2], p[-10:-5, 0] = 1.1, -1.1, 0.9
    return p.astype(np.float32), np.float32(1.0)


def _torus_rays() -> Rows:
    """Points within 2 % of the tube from the torus, as its mesh's are; rays in all directions."""
    p, outwards, tube, dirs = _torus()
    p = p + (inputs.uniform(len(p), -0.02, 0.02, seed=6) * tube)[:, None] * outwards
    # Straight in from half a tube outside, and out from half inside: three steps of a tenth, and no farther.
    # On the outer half, where the way does not lead through the hole.
    rows = np.flatnonzero(np.hypot(p[:, 0], p[:, 2]) > 1)[:800]
    side = np.where(np.arange(len(rows)) < 400, 1.0, -1.0)[:, None]
    p[rows] += side * 0.5 * tube[rows, None] * outwards[rows]
    dirs[rows] = -side * outwards[rows]
    dirs[-10:], p[-10:], tube[-10:] = (
        [0, 1, 0],
        [1.3, 0, 0],
        0.3,
    )  # along the tube's side: no step is the right one, all must be finite
    return p.astype(np.float32), dirs.astype(np.float32), np.float32(1.0), tube.astype(np.float32)


def _meets_the_torus(p: Any, d: Any, radius: Any, tube: Any) -> Any:
    """Rays at more than 20 degrees to the surface: flatter ones need more than three steps, or pass outside."""
    ring = np.hypot(p[:, 0], p[:, 2])[:, None]
    centre = np.stack([p[:, 0], 0 * p[:, 0], p[:, 2]], axis=-1) / ring
    outwards = p - centre
    return np.abs(dot(outwards / length(outwards)[:, None], d)) > np.sin(np.radians(20))


def _tube_bound(p: Any, radius: Any, want: F64) -> F64:
    across = np.hypot(np.hypot(p[:, 0], p[:, 2]) - 1.0, p[:, 1])
    return 6 * EPS / across


def _tube_uv_bound(p: Any, radius: Any, want: F64) -> F64:
    return (_tube_bound(p, radius, want) + ATAN) / (2 * np.pi) + EPS


def _quads() -> Rows:
    """Flat convex quads in any plane, parallelograms among them, of sizes 1e-3 to 1e3, and points in and on them."""
    count = 4000
    rng = np.random.default_rng(1)
    plane = np.stack([inputs.unit_vectors(count, 2), inputs.unit_vectors(count, 3)], axis=1).astype(float)
    plane[:, 1] = np.cross(plane[:, 0], plane[:, 1])
    plane[:, 1] /= length(plane[:, 1])[:, None]
    flat = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) + rng.uniform(-0.35, 0.35, (count, 4, 2))
    flat[:500, 2] = flat[:500, 1] + flat[:500, 3] - flat[:500, 0]
    size = inputs.log_uniform(count, 1e-3, 1e3, (1, 1), 4)
    corners = (np.einsum("nki,nij->nkj", flat, plane) * size).astype(np.float32)
    u, v = inputs.uniform(count, 0, 1, seed=5)[:, None], inputs.uniform(count, 0, 1, seed=6)[:, None]
    u[:4], v[:4] = [[0], [1], [1], [0]], [[0], [0], [1], [1]]
    a, b, c, d = (corners[:, i].astype(float) for i in range(4))
    p = (1 - u) * (1 - v) * a + u * (1 - v) * b + u * v * c + (1 - u) * v * d
    return (p.astype(np.float32), *(corners[:, i] for i in range(4)))


def _quad_uv() -> Rows:
    uv = np.concatenate([inputs.uniform(len(_quads()[0]) - 4, shape=(2,)), [[0, 0], [1, 0], [1, 1], [0, 1]]])
    return (uv.astype(np.float32), *_quads()[1:])


def _edge_bound(uv: Any, a: Any, b: Any, c: Any, d: Any, want: F64) -> F64:
    return 6 * EPS * np.maximum.reduce([length(x) for x in (a, b, c, d)])


def _triangles() -> Rows:
    """Triangles with angles of all sizes down to some degrees, points in and round them; the last have no area."""
    a, b, c = (inputs.uniform(3000, -1, 1, (3,), seed) for seed in (1, 2, 3))
    w = inputs.uniform(3000, -0.5, 1.0, (2,), 4)
    p = (a + w[:, :1] * (b - a) + w[:, 1:] * (c - a)).astype(np.float32)
    keep = _area(a, b, c) > 0.05
    p, a, b, c = p[keep], a[keep], b[keep], c[keep]
    b[-5:], c[-3:] = a[-5:], a[-3:]
    return p, a, b, c


def _area(a: Any, b: Any, c: Any) -> F64:
    return length(np.cross(np.asarray(b, float) - a, np.asarray(c, float) - a))


def _barycentric_bound(p: Any, a: Any, b: Any, c: Any, want: F64) -> F64:
    longest = np.maximum.reduce([length(x - a) for x in (b, c, p)])
    area = _area(a, b, c)
    return np.where(area > 0, 16 * EPS * longest**2 / np.where(area > 0, area, 1.0), 0.0)


# ---- environment, filter, reflection


def _directions_of_all_lengths() -> Rows:
    return (_scaled(inputs.directions(4000, 1), 1e-15, 1e15),)


def _picture_places() -> Rows:
    ends = np.array([[0, 0], [1, 1], [0.5, 0], [0.5, 1], [0, 0.5], [1, 0.5], [0.25, 0.25]], np.float32)
    return (np.concatenate([ends, inputs.uniform(4000, shape=(2,))]),)


def _faces_and_places() -> Rows:
    st = np.concatenate([[[0, 0], [1, 1], [0.5, 0.5], [0, 1]], inputs.uniform(500, shape=(2,))]).astype(np.float32)
    face, row = np.meshgrid(np.arange(6), np.arange(len(st)))
    return face.ravel(), st[row.ravel()]


def _irradiance() -> Rows:
    n = inputs.directions(2000, 1)
    return n, inputs.uniform(len(n), -1, 1, (9, 3), 2)


def _footprints(size: int) -> Callable[[], Rows]:
    def made() -> Rows:
        pair = [
            inputs.uniform(3000, -1, 1, (size,), s) * inputs.log_uniform(3000, 1e-17, 1e17, (1,), 4) for s in (2, 3)
        ]
        pair[0][:3], pair[1][1:4] = 0.0, 0.0
        return (*pair,)

    return made


def _direction_footprints() -> Rows:
    ddx, ddy = (inputs.unit_vectors(3000, s) * inputs.log_uniform(3000, 1e-8, 1.0, (1,), s) for s in (1, 2))
    ddx[:2], ddy[1:3] = 0.0, 0.0
    return ddx, ddy, inputs.log_uniform(3000, 1.0, 1e5, seed=3)


def _angles_and_roughness() -> Rows:
    """Cosines past both ends too: of normals that are bent away from the eye, and by rounding."""
    ends = np.array([0, 1, 0.5, 1e-4], np.float32)
    angles = np.concatenate([ends, np.array([-0.5, -1e-7, 1 + 2.0**-23, 1.5], np.float32), inputs.uniform(60, seed=1)])
    return inputs.every(angles, np.append(ends, inputs.uniform(60, seed=2)))


def _shares() -> Rows:
    """Of factors that a fit or a table may have: A + B from 0.25 to a little over 1."""
    a = np.float32([0.9, 1, 0.3, 0.75])[np.arange(3000) % 4] * inputs.uniform(3000, 0.9, 1, seed=1)
    b = inputs.uniform(3000, 0, 0.2, seed=2)
    b[::5], a[::13], b[::13] = 0.0, 0.0, 1.0
    f0 = inputs.uniform(3000, shape=(3,), seed=3)
    f0[::7], f0[::11] = 1.0, 0.0
    return f0, np.stack([a, b], axis=-1)


def _seen_facets() -> Rows:
    """Unit v and places for facets of every roughness; the eye from above to grazing."""
    count = 3000
    alpha = np.square(np.clip(inputs.log_uniform(count, 0.03, 1, seed=4), 0.03, 1)).astype(np.float32)
    z = np.square(inputs.uniform(count, 0.01, 1, seed=5))
    z[::17], alpha[::19] = 1.0, 1.0
    turn = inputs.uniform(count, 0, 6.28, seed=6)
    across = np.sqrt(1 - z * z)
    v = np.stack([across * np.cos(turn), across * np.sin(turn), z], axis=-1)
    return v, alpha, inputs.uniform(count, 0, 1, (2,), 7)


def _facets_and_eyes() -> Rows:
    """As they are seen; and upright ones from the horizon."""
    v, alpha, place = _seen_facets()
    count = np.resize(np.float32([1, 16, 4096]), len(v))
    h = ggx.visible_normal(v, alpha, place)
    h[:10], v[:10] = [0, 0, 1], [1, 0, 0]
    return h, v, alpha, count


def _cosines_and_alpha() -> Rows:
    _, alpha, place = _seen_facets()
    return place[:, 0] * 0.999 + 0.001, place[:, 1] * 1.2 - 0.2, alpha


def _extreme_directions() -> Rows:
    """Directions of all lengths; on the axes, the horizon, edges and corners; with infinities, and none at all."""
    each = np.float32([0, -0.0, 1, -1, 2.0**-149, -1e-40, np.finfo(np.float32).max, -1e38, np.inf, -np.inf])
    made = np.stack(inputs.every(each, each, each), axis=-1)
    short = np.float32([[0, 1.6e-23, 0], [1.7e-23, 0, 0], [-1.7e-23, -1.6e-23, 0], [1e-30, -1e-30, 1e-30]])
    level = _directions_of_all_lengths()[0][:500] * np.float32([1, 0, 1])
    return (np.concatenate([_directions_of_all_lengths()[0], made, short, level]),)


def off_seams(dir: Any) -> Any:
    """Where no component is so small that float32 loses it, and with it the side of a seam that the direction is on:
    the place on either side is right (test_layout_functions.py)."""
    d = np.abs(np.asarray(dir, float))
    return ((d == 0) | (d > 2.0**-20 * d.max(axis=-1, keepdims=True))).all(axis=-1)


def _turns() -> Rows:
    """Directions of all lengths, and changes of them in all directions, from 1e-8 to 10 radians; and without end."""
    (d,) = _extreme_directions()
    size = np.clip(np.abs(np.nan_to_num(d)).max(axis=-1, keepdims=True), 1e-22, 1e37)
    change = inputs.unit_vectors(len(d), 4) * size * inputs.log_uniform(len(d), 1e-8, 10, (1,), 5)
    change[::13], change[1::97], change[2::97, 0], change[3::97] = 0.0, 3e38, -np.inf, -1e-42
    return d, change.astype(np.float32)


def _reach(dir: Any, change: Any) -> F64:
    """The change's length for a direction of length 1, as far as it is counted."""
    big, small = (np.clip(np.asarray(a, float), -3.4e38, 3.4e38) for a in (change, dir))
    none = length(small / 2**24) < 1e-30
    each = np.minimum(np.abs(big), 1e18 * np.where(none, 2**24, np.abs(small).max(axis=-1))[:, None])
    return length(each / np.where(none, 2**24, np.maximum(length(small), 1e-300))[:, None]) * np.sqrt(3)


def _turn_bound(dir: Any, change: Any, want: F64) -> F64:
    """Some roundings of the change, and what of it is denormal at 2^-24 of its length, or a direction's."""
    longest = np.maximum(np.abs(np.asarray(dir, float)).max(axis=-1), 1e-23)
    return 12 * EPS * _reach(dir, change) + 2.0**-100 / longest + 2.0**-124


def _places_in_a_room() -> tuple[Any, Any, Any]:
    """Points in and round rooms of sizes 1e-9 to 1e9 about the origin, directions of all lengths, and the sizes."""
    d = _scaled(inputs.directions(4000, 1), 1e-15, 1e15)
    size = inputs.log_uniform(len(d), 1e-9, 1e9, (1,), 2)
    p = inputs.uniform(len(d), -1, 1, (3,), 3)
    p[::5] *= 3
    p[1::50] = 0.0
    # Components that a driver may flush would tell a wall that is never met from one that is.
    d[~off_seams(d)] = [0.0, 2.0, 0.0]
    return p * size, d, size


def _parallax_boxes() -> Rows:
    """Points in boxes, on their walls, outside; the origin is at least a fifth of the size inside."""
    p, d, size = _places_in_a_room()
    low, high = (-size * inputs.uniform(len(p), 0.2, 1, (3,), 4), size * inputs.uniform(len(p), 0.2, 1, (3,), 5))
    p[2::40], p[3::40, 1] = low[2::40], high[3::40, 1]
    return p, d, low, high


def _box_bound(p: Any, dir: Any, low: Any, high: Any, want: F64) -> F64:
    """Where the ray ends is off by some roundings of p and of the way, and no nearer to the origin than the walls."""
    p, low, high = (np.asarray(a, float) for a in (p, low, high))
    d = np.asarray(dir, float) / np.abs(dir).max(axis=-1, keepdims=True)
    to = (np.where(d > 0, high, low) - p) / np.where(d == 0, 1e-30, np.abs(d)) * np.sign(d)
    way = np.clip(np.where(d == 0, np.inf, to).min(axis=-1), 0, None)
    room = np.minimum(np.abs(low), np.abs(high)).min(axis=-1)
    return 6 * EPS + 4 * EPS * (np.abs(p).max(axis=-1) + way) / room


def _parallax_spheres() -> Rows:
    """Points in spheres and outside; the origin is at least half of the radius inside."""
    p, d, size = _places_in_a_room()
    return p, d, size * inputs.uniform(len(p), -0.28, 0.28, (3,), 4), size[:, 0]


def _sphere_parallax_bound(p: Any, dir: Any, centre: Any, radius: Any, want: F64) -> F64:
    """Roundings of the offset in radii; the half chord's square is off by as many, and its root where it is small."""
    o = (np.asarray(p, float) - centre) / np.asarray(radius, float)[:, None]
    d = np.asarray(dir, float) / length(np.asarray(dir, float))[:, None]
    chord = np.sqrt(np.maximum(1 - dot(o, o) + dot(o, d) ** 2, 0))
    off = 2 * EPS * (1 + length(o)) ** 2
    return 6 * EPS + (off + np.minimum(off / np.maximum(chord, 1e-150), np.sqrt(2 * off))) / 0.5


def _tiles() -> Rows:
    place = np.concatenate(
        [inputs.uniform(2000, 0, 6, (1,), 1) // 1, inputs.uniform(2000, shape=(2,), seed=2)], axis=-1
    )
    place[:2, 1:], place[2:4, 1:] = 0.0, 1.0
    return place, inputs.uniform(2000, 1, 4096, (2,), 3) // 1


def _dielectrics() -> Rows:
    """Angles and indices from 1/100 to 100, 1e4 too: at grazing and normal incidence, beside no change of index at all
    and beside the critical angle."""
    ends = np.float32([-0.5, 0, 2.0**-149, 1e-30, 1e-10, 1e-4, 1 - 2.0**-24, 1, 1.5])
    beside = np.float32([1, 1 - 2.0**-24, 1 + 2.0**-23, 1 + 1e-4, 1.5, 1 / 1.5, 2.4, 1 / 2.4, 1e4, 1e-4])
    angles = np.append(ends, inputs.uniform(60, seed=1))
    cos, eta = inputs.every(angles, np.append(beside, inputs.log_uniform(60, 0.01, 100, seed=2)))
    dense = inputs.log_uniform(500, 1 + 1e-6, 10, seed=3)
    critical = np.sqrt((1 - 1 / dense) * (1 + 1 / dense)).astype(np.float32)
    near = (critical * inputs.uniform(500, 0.999, 1.001, seed=4)).astype(np.float32)
    return np.concatenate([cos, near]), np.concatenate([eta, dense])


def _fresnel_bound(cos_i: Any, eta: Any, want: F64) -> F64:
    """The refracted cosine's square is off by some roundings of its two terms; each unit of that cosine changes the
    share by at most 4 / (eta c + cos_t) of itself through one factor, by twice the other's slope through the other."""
    c, e = np.clip(np.asarray(cos_i, float), 0, 1), np.asarray(eta, float)
    square = (1 - e) * (1 + e) + (e * c) ** 2
    off = 4 * EPS * np.where(c < 0.7, np.abs((1 - e) * (1 + e)) + (e * c) ** 2, 1 + e * e * (1 - c) * (1 + c))
    cos_t, sines = np.sqrt(np.maximum(square, 1e-300)), e * (1 - c * c)
    error = np.where(square < -off, 0.0, np.minimum(np.sqrt(off), off / cos_t))
    slope = 4 / (e * c + cos_t) + np.minimum(1 / cos_t, 4 * c / np.maximum(sines, 1e-150))
    return want * (24 * EPS + error * slope)


def _refractions() -> Rows:
    """All angles, on either side of the surface; along the normal, grazing, indices to both sides of 1 and 1 itself."""
    d, n = inputs.directions(4000, 1), inputs.directions(4000, 2)
    eta = inputs.log_uniform(len(d), 0.25, 4, seed=3)
    eta[::7], n[::50] = 1.0, d[::50]
    # Along the surface to the last float.
    n[:6], eta[:6] = np.roll(d[:6], 2, axis=0), 0.5
    return d, n, eta


def _sine_behind(dir: Any, n: Any, eta: Any) -> F64:
    d, n = np.asarray(dir, float), np.asarray(n, float)
    return np.asarray(eta, float) * length(d - dot(d, n)[:, None] * n)


def _refraction_bound(dir: Any, n: Any, eta: Any, want: F64) -> F64:
    """Sines are off by some roundings of eta; the root makes their share over the cosine of it."""
    off = 4 * EPS * np.maximum(np.asarray(eta, float), 1)
    cos_t = np.sqrt(np.maximum(1 - _sine_behind(dir, n, eta) ** 2, 0))
    return off + np.minimum(off / np.maximum(cos_t, 1e-150), np.sqrt(2 * off))


# ---- footprints


def _hits() -> Rows:
    """Changes of all sizes, rays that meet surfaces at all angles, to 1e-7 of grazing; normals of all lengths."""
    n, d = inputs.directions(4000, 1), inputs.directions(4000, 2)
    # Along the surface but for a little, on either side of the least cosine.
    flat = np.cross(n[:400].astype(float), inputs.unit_vectors(400, 3))
    flat /= length(flat)[:, None]
    tilt = inputs.log_uniform(400, 1e-7, 1e-2, (1,), 4) * np.where(np.arange(400) % 2, 1, -1)[:, None]
    d[:400] = flat + tilt * n[:400]
    # Along it to the last float: that counts as leaving.
    d[400:406], n[400:406] = np.roll(inputs.axes(), 1, axis=1), inputs.axes()
    dp = _scaled(inputs.unit_vectors(len(n), 5), 1e-8, 10, 6)
    return dp, d, _scaled(n, 1e-6, 1e6, 7), np.float32(_LEAST)


_LEAST = 1e-5


def _hit_bound(dp: Any, dir: Any, n: Any, least: Any, want: F64) -> F64:
    """A cosine is off by some four roundings, and the step along the ray by as much of it."""
    cosine = np.maximum(np.abs(dot(dir, n)) / length(n), _LEAST)
    return 8 * EPS * length(dp) * (1 + 1 / cosine + 1 / cosine**2)


def _on_torus() -> Rows:
    """Points on a torus, but for those beside its axis, and changes along it; and on the axis, where the tube is as
    wide as the torus."""
    p, outwards, _, turn = _torus()
    p[-50:], outwards[-50:] = [0, 0, 0], [0, 0, 1]
    p[-40:, 1] = inputs.uniform(40, -1, 1, seed=8)
    dp = turn - dot(turn, outwards)[:, None] * outwards
    return p.astype(np.float32), (dp * inputs.log_uniform(len(p), 1e-6, 1, (1,), 7)).astype(np.float32), np.float32(1.0)


def _torus_turn_bound(p: Any, dp: Any, radius: Any, want: F64) -> F64:
    """hypot(x, z) - radius is off by some roundings of 2, over the tube, or over the distance to the axis; twice."""
    h = np.hypot(p[:, 0], p[:, 2])
    ring = np.maximum(np.hypot(h - 1, p[:, 1]), 1e-3)
    return 16 * EPS * length(dp) * (1 / ring**2 + 1 / np.maximum(h, 1e-3) / ring)


def _uv_bound(dp: Any, dpdu: Any, dpdv: Any, want: F64) -> F64:
    """Each product of two lengths squared is off by some roundings; so is their difference, the area's square."""
    u, v = np.asarray(dpdu, float), np.asarray(dpdv, float)
    sine2 = length(np.cross(u, v)) ** 2 / np.maximum(length(u) * length(v), 1e-30) ** 2
    shortest = np.maximum(np.minimum(length(u), length(v)), 1e-30)
    return (
        24 * EPS * length(dp) / shortest / np.maximum(sine2, 1e-30) ** 2 * np.maximum(length(u), length(v)) / shortest
    )


def _uv_sides() -> Rows:
    """Derivatives at all angles but the flattest, one up to ten times the other."""
    count = 3000
    u, v = inputs.unit_vectors(count, 1), inputs.unit_vectors(count, 2)
    flat = length(np.cross(u, v)) < 0.1
    v[flat] = np.roll(u[flat], 1, axis=1)
    size = inputs.log_uniform(count, 1e-3, 1e3, (1,), 3)
    u, v = u * size, v * size * inputs.log_uniform(count, 0.3, 3, (1,), 4)
    # On either side of the least area, and without any.
    for row, side in enumerate((3.12e-8, 3.2e-8, 0.0)):
        u[row], v[row] = [side, 0, 0], [0, side, 0]
    return u, v


def _bent_changes() -> Rows:
    """Normals, gradients up to 1e6 long, and changes of both."""
    n = inputs.directions(3000, 1)
    g = _scaled(inputs.unit_vectors(len(n), 2), 1e-6, 1e6, 3)
    changes = (_scaled(inputs.unit_vectors(len(n), seed), 1e-8, 1, seed) for seed in (4, 5))
    keep = length(n - np.float64(g)) > 0.05  # next to none at all the change is without bound
    return tuple(a[keep] for a in (n, g, *changes))


def _reflections() -> Rows:
    """Directions, normals, and changes of both across them."""
    d, n = inputs.directions(3000, 1), inputs.directions(3000, 2)
    changes = (_scaled(inputs.unit_vectors(len(d), seed), 1e-8, 10, seed) for seed in (3, 4))
    return d, n, *changes


def _refracted_footprints() -> Rows:
    d, n, eta = _refractions()
    changes = (_scaled(inputs.unit_vectors(len(d), seed), 1e-6, 1, seed) for seed in (4, 5))
    return d, n, eta, *changes


def _refract_change_bound(d: Any, n: Any, eta: Any, ddir: Any, dn: Any, want: F64) -> F64:
    """The cosine behind is off by some roundings of eta over itself, and its reciprocal by as much of its square."""
    most = np.maximum(np.asarray(eta, float), 1)
    cosine = np.maximum(np.sqrt(np.maximum(1 - _sine_behind(d, n, eta) ** 2, 0)), footprint.LEAST_COSINE)
    return 32 * EPS * most**3 * (length(ddir) + length(dn)) * (1 + 1 / cosine**3)


def _axes_rows() -> Rows:
    """Two sides of all lengths, one up to 1e4 times the other, at all angles; one of them none, both along one line."""
    x = _scaled(inputs.unit_vectors(3000, 1), 1e-8, 10, 2)
    y = inputs.unit_vectors(3000, 3) * length(x)[:, None] * inputs.log_uniform(3000, 1e-4, 1e4, (1,), 4)
    y[:50], x[50:100], y[100:150] = 0.0, 0.0, -2 * x[100:150]
    return x.astype(np.float32), y.astype(np.float32)


def _ramps() -> Rows:
    """Heights within the ramp and past both its ends, of changes either way; none at all, and on both sides of what
    counts as none."""
    height = inputs.uniform(3000, -2, 2, seed=1)
    change = inputs.uniform(3000, -1, 1, (2,), 2) * inputs.log_uniform(3000, 1e-3, 10, (1,), 3)
    change[:300, 0], change[300:600, 1], change[600:620], height[590:610] = 0.0, 0.0, 0.0, 0.0
    least = np.array([[0.95e-30, 0], [1.05e-30, 0], [0, -0.95e-30], [0, -1.05e-30]], np.float32)
    return np.append(height, np.full(4, 1e-31, np.float32)), *np.concatenate([change, least]).T


def _between_whole_taps(major: Any, minor: Any, texels_per_radian: Any, most: Any) -> Any:
    wanted = np.minimum(length(major) / np.maximum(length(minor), 1e-30), length(major) * texels_per_radian)
    over = wanted - 0.01
    return (np.abs(over - np.rint(over)) > 8 * EPS * wanted) | (wanted > most + 1)


def _axes_differ(x: Any, y: Any) -> Any:
    """Where there is a longer one: about a circle any axes will do."""
    long, short = (length(a) for a in filters.footprint_axes(x, y))
    return short < 0.9 * long


def _axes_bound(x: Any, y: Any, want: Any) -> F64:
    """Sines and cosines of half an angle that is off by some roundings, over how uneven the sides are."""
    long, short = (length(a) for a in filters.footprint_axes(x, y))
    return 32 * EPS * long / (1 - (short / long) ** 2)


# ---- procedural

UP, DOWN = np.float32([0.2, 0.4, 0.9]), np.float32([0.25, 0.15, 0.05])


def _looks(count: int = 3000, low: float = 1e-4, high: float = 0.3) -> Rows:
    """Directions, and footprints from `low` to `high` radians, their sides at any angle to each other."""
    d = inputs.directions(count, 1)
    sides = (
        np.cross(d, inputs.unit_vectors(len(d), seed)) * inputs.log_uniform(len(d), low, high, (1,), seed)
        for seed in (2, 3)
    )
    return d, *(side.astype(np.float32) for side in sides)


def _marches() -> Rows:
    """As most are; footprints up to a sphere's before the highest mountains, in the fewest steps, so that the ground
    covers some of the nearest ones; hills below the eye and just above it, which level rays see part of; a plain."""
    sets = [
        (_looks(count, low, high), relief, seed, steps)
        for count, low, high, relief, seed, steps in (
            (1500, 0.02, 0.2, 3, 5, 48),
            (700, 0.2, 4, 4, 2**32 - 3, 8),
            (300, 0.02, 1, 0.3, 6, 8),
            (300, 0.02, 1, 0.8, 7, 12),
            (100, 0.02, 1, 0, 8, 8),
        )
    ]
    looks = (np.concatenate(parts) for parts in zip(*(s[0] for s in sets), strict=True))
    each = (np.repeat([s[i] for s in sets], [len(s[0][0]) for s in sets]) for i in (1, 2, 3))
    relief, seed, steps = (a.astype(kind) for a, kind in zip(each, (np.float32, np.uint32, np.int32), strict=True))
    return *looks, UP, np.float32([0.6, 0.7, 0.9]), DOWN, np.float32([1, 1, 1]), relief, seed, steps


def _places(count: int = 3000) -> Rows:
    """Ground about the eye, and footprints from none to wider than all octaves."""
    place = inputs.uniform(count, -10, 10, (2,), 1)
    width = np.concatenate([[0.0], inputs.log_uniform(count - 1, 1e-3, 10, seed=2)]).astype(np.float32)
    return place, width, inputs.uniform(count, 0, 4, seed=3), np.arange(count, dtype=np.uint32) * np.uint32(0x10001)


def _landscape_bound(place: Any, width: Any, relief: Any, seed: Any, want: F64) -> F64:
    """Places are off by three roundings; times the steepest slope and the sharpest bend that nine octaves can have."""
    off = 3 * EPS * length(place) + 1e-7
    octaves = 2.0 ** np.arange(9)
    slope, bend = 2 * 15 / 8 * 2 / 4 * 0.5 * 9, (0.5 * octaves / 16 * 2 * (5.8 * 4 + 3.75**2 / 0.05)).sum()
    each = np.stack([slope * off, bend * off, bend * off, 100 * EPS + 0 * off], axis=-1)
    return each * np.asarray(relief, float)[:, None] + 4 * EPS


def _grounds() -> Rows:
    parts = (
        inputs.uniform(2000, low, high, (columns,), seed)
        for low, high, columns, seed in ((-0.5, 2.5, 1, 1), (-3, 3, 2, 2), (0, 2, 1, 3))
    )
    ground, relief = np.concatenate([*parts], axis=-1), np.full(2000, 3, np.float32)
    # Without relief, but for what rounding leaves of it.
    ground[:50, 0], ground[:50, 1:3], relief[:50] = -0.5 + np.arange(50) * 2.0**-25, 0.1, 0.0
    return ground, relief, UP, DOWN


# ---- gradients


def _map_places(*more: Any) -> Callable[[], Rows]:
    """Heights of 8 x 16 texels, and places within three turns of them in 256ths of a texel: centres, edges, between.

    All sums of places and all weights are exact then, also where a GPU's filter has 8 bits for them.
    """
    heights = inputs.uniform(8 * 16, seed=1).reshape(8, 16)
    texels = np.random.default_rng(2).integers(-256 * 16, 2 * 256 * 16, (2000, 2)) // np.array([1, 2])
    texels[:500] = texels[:500] // 128 * 128
    return lambda: (heights, (texels / (256 * np.array([16, 8]))).astype(np.float32), *more)


def _odd_places() -> Rows:
    """6 x 10 texels, which are no powers of two: places within four turns of them, between texels and beside their
    edges."""
    uv = inputs.uniform(2000, -4, 5, (2,), 2)
    uv[:200] = np.rint(uv[:200] * [10, 6]) / [10, 6] + inputs.uniform(200, -1e-6, 1e-6, (1,), 3)
    return inputs.uniform(6 * 10, seed=1).reshape(6, 10), uv.astype(np.float32)


def _slope_case(terms: int, *more: Any) -> Case:
    """Slopes up to 16 from heights below 1: each read has three roundings, each term as many, all times the size."""
    return Case(
        _map_places(*more),
        f"{terms} reads of heights below 1, of three roundings each and of as many when added, times 16 texels",
        abs=6 * terms * 16 * EPS,
    )


def _height_case() -> Case:
    """Heights below 1: sixteen products of two weights of some six roundings, added up."""
    return Case(_odd_places, "16 reads of heights below 1, of eight roundings each", abs=8 * 16 * EPS)


# ---- encodings

_MIDDLES = np.float32([128, 512, 2048, 32768])


def _coded(values: Any) -> Rows:
    """-1..1 (count, n) as codes of 8, 10, 12 and 16 bits, 0..1, and their middles."""
    middle = np.resize(_MIDDLES, len(values)).astype(float)
    codes = np.rint(middle[:, None] + (middle[:, None] - 1) * np.asarray(values, float))
    return codes / (2 * middle[:, None] - 1), middle


_AXES_UNFOLDED = np.array([(0, 0), (1, 0), (0, 1), (-1, 0), (0, -1), (1, 1), (-1, 1), (0.5, -0.5)] * 4)


def _outwards(count: int = 4000) -> Any:
    n = inputs.directions(count)
    return np.where(n[:, 2:] < 0, -n, n)


def _xy_bound(c: Any, middle: Any, want: F64) -> F64:
    """x^2 + y^2 is off by some roundings of 1; its root is off by those over z, and at the rim by their root."""
    return 8 * EPS + 24 * EPS / np.maximum(want[:, 2], np.sqrt(24 * EPS))


def _normals_of_all_lengths() -> Rows:
    """All directions, flat and inward ones among them, on both sides of the steepest slope, and no direction."""
    n = inputs.directions(3000, 1).astype(float)
    steep = np.array([[1, 0, z] for z in (0.9 / 128, 1.1 / 128, 1e-9, -1e-9)])
    n = np.concatenate([n, steep, steep[:, [1, 0, 2]], -steep[:2] * [1, 1, -1], np.zeros((1, 3))])
    # Straight in there is no steepest way out: the smallest numbers decide, which drivers may flush.
    n[np.abs(n) < 1e-20] = 0.0
    return (n * inputs.log_uniform(len(n), 1e-6, 1e6, (1,), 3)).astype(np.float32)


def _lights() -> Rows:
    """Colours of linear light from the least to far beyond white, 0, 1 and the joints of the curves among them."""
    light = inputs.log_uniform(4000, 1e-6, 1e5, (3,), 12)
    light[:6] = np.array([0, 1, 0.0031308, 1e4, 4, 0.18])[:, None]
    return (light,)


def _suns() -> Rows:
    """n, v and suns all over, most of them near where the surface mirrors them; some at the very peak, some below."""
    count = 3000
    n, v = inputs.unit_vectors(count, 71), inputs.unit_vectors(count, 72)
    v = np.where(dot(n, v)[:, None] < 0, -v, v).astype(np.float32)
    roughness, radius = inputs.log_uniform(count, 0.05, 1, seed=73), inputs.log_uniform(count, 1e-3, 0.09, seed=74)
    facet = n + inputs.unit_vectors(count, 75) * (roughness**2 * inputs.log_uniform(count, 1e-2, 10, seed=76))[:, None]
    facet /= length(facet)[:, None]
    sun = 2 * dot(v, facet)[:, None] * facet - v
    sun[:100], v[100:200] = inputs.unit_vectors(100, 77), sun[100:200]
    # From behind the surface and along it; and where the lobe would be brighter than a mirror.
    v[200:300] -= (dot(n, v)[200:300, None] - inputs.uniform(100, -1e-4, 2e-4, (1,), 79)) * n[200:300]
    v[200:210] = -v[200:210]
    v /= length(v)[:, None]
    low = np.cross(n[300:400], inputs.unit_vectors(100, 80))
    low /= length(low)[:, None]
    v[300:400], sun[300:400] = low + 0.015 * n[300:400], -low + 0.025 * n[300:400]
    v[300:400] /= length(v[300:400])[:, None]
    roughness[300:400], radius[300:400] = 0.05, 0.09
    sun = (sun / length(sun)[:, None]).astype(np.float32)
    return n, v, sun, radius, roughness, inputs.uniform(count, 0, 1, (3,), 78)


def _sun_bound(n: Any, v: Any, sun: Any, radius: Any, roughness: Any, f0: Any, want: Any) -> Any:
    """h is off by two roundings over the length of v + sun, and where the lobe is steep, by that over its width; the
    share shown by one of n.l."""
    width = np.sqrt(np.asarray(roughness, np.float64) ** 4 + np.asarray(radius, np.float64) ** 2 / 4)
    both = length(np.asarray(v, np.float64) + np.asarray(sun, np.float64))
    relative = 40 + 16 / (width * np.maximum(both, 1e-6)) + 4 / np.maximum(np.abs(dot(n, sun)), 1e-6)
    return EPS * relative[..., None] * want + 1e-30


# ---- spread


def _pairs(count: int, low: float, high: float, seed: int) -> tuple[Any, Any]:
    """Two changes (count, 3) each, of all lengths from low to high."""
    a, b = (_scaled(inputs.unit_vectors(count, seed + i), low, high, seed + i + 2) for i in (0, 1))
    return a, b


def _moments() -> npt.NDArray[np.float64]:
    """Of two gradients each, (3000, 3): of any ratio, and of one line."""
    uv = inputs.uniform(3000, -1, 1, (2, 2), 3).astype(np.float64)
    uv[-200:, 1] = 0
    return np.stack([(uv[:, 0] ** 2).sum(-1), (uv[:, 0] * uv[:, 1]).sum(-1), (uv[:, 1] ** 2).sum(-1)], axis=-1)


def _across() -> Rows:
    u, v = (_scaled(inputs.unit_vectors(3000, i), 1e-3, 1e3, i + 5) for i in (1, 2))
    return inputs.unit_vectors(3000, 3), inputs.unit_vectors(3000, 4), u, v, _moments()


def _along() -> Rows:
    """All sizes from 1e-20 to what is past telling apart, past 32-bit floats, and none."""
    moments = _moments() * inputs.log_uniform(3000, 1e-20, 1e15, seed=9).astype(np.float64)[:, None]
    moments[:50], moments[50:60], moments[60:100] = 1e17 * moments[:50] + (1e17, 0, 1e17), 0, (3e38, 0, 3e38)
    # On both sides of that limit, and just above the least.
    moments[100:103] = [(0.95e16, 0, 0), (1.05e16, 0, 0), (1.05e-30, 0, 0)]
    return inputs.unit_vectors(3000, 1), inputs.unit_vectors(3000, 2), moments


def _parted() -> Rows:
    """Of any share, with the mean small or large against the spread, some of both 0; past floats; some of one line."""
    moments = _moments()
    size = inputs.log_uniform(3000, 1e-12, 1e7, seed=3).astype(np.float64)
    mean = (inputs.uniform(3000, -1, 1, (2,), 4) * inputs.log_uniform(3000, 1e-3, 1e3, seed=5)[:, None]).astype(
        np.float64
    )
    mean[:50], moments[50:100] = 0, 0
    mean[100:110], moments[100:110] = 0, 0
    moments, mean = moments * size[:, None] ** 2, mean * size[:, None]
    moments[110:150] = (3e38, 0, 3e38)
    share = inputs.uniform(3000, seed=6)
    share[150:200], share[200:250] = 0, 1
    # On both sides of the most, by either; all but one line, and one part alone, of which the fourth power is no float.
    moments[250:254] = [(0.95e16, 0, 0), (1.05e16, 0, 0), (1, 0, 2e16), (2e16, 0, 1)]
    mean[250:254], mean[254:258] = (1e7, 1e7), [(1e6, 0), (-1e6, 0), (0, 1e6), (0, -1e6)]
    moments[254:258] = (1e-8, 0, 1e-8)
    # Nothing along the mean, which is just long enough to tell.
    mean[258], moments[258] = (3.2e-8, 0), (0, 0, 1)
    share[250:259] = 0.3
    return share, mean.astype(np.float32), moments.astype(np.float32)


def _parted_bound(share: Any, mean: Any, moments: Any, want: Any) -> tuple[F64, F64, F64]:
    steep, _, _ = want
    trace = moments.astype(np.float64)[:, ::2].sum(-1)
    square = (mean.astype(np.float64) ** 2).sum(-1)
    times = 1 / np.maximum(steep, 1e-3)
    parts = times * trace + times**2 * square
    # Below 1e-18 the largest counts as that large.
    off = 60 * EPS + np.where(np.sqrt(np.maximum(trace, square)) < 1e-15, 1.0, 0.0)
    return off * steep, off[:, None] * times[:, None] * np.abs(mean), 200 * EPS * (times * parts)[:, None]


def _along_bound(x: Any, y: Any, moments: Any, want: Any) -> F64:
    trace = np.minimum(moments[:, 0].astype(np.float64) + moments[:, 2], 1e16)
    # The root of a determinant is off by the root of its roundings, where it is about 0.
    return 2 * np.sqrt(8 * EPS * trace + 1e-38)[:, None]


def _folded() -> Rows:
    count = 3000
    return inputs.unit_vectors(count, 1), inputs.unit_vectors(count, 2), *_pairs(count, 1e-5, 0.7, 3)


def _folded_bound(dir: Any, n: Any, a: Any, b: Any, want: Any) -> F64:
    n = np.asarray(n, np.float64)
    s = np.hypot(dot(a, n), dot(b, n))
    height = dot(np.asarray(dir, np.float64), n)
    mean = np.sqrt(height**2 + s**2 * spreads.folded_share(np.abs(height) / np.maximum(s, 1e-10)))
    moved = length(np.asarray(dir, np.float64) + (mean - height)[:, None] * n)
    return (np.maximum(FOLDED * s / moved, FOLDED * s) + 20 * EPS / moved)[:, None]


def _widened() -> Rows:
    count = 3000
    d = inputs.unit_vectors(count, 1).astype(np.float64)
    across = np.eye(3) - d[:, :, None] * d[:, None, :]
    x, y = (_scaled(inputs.unit_vectors(count, i), 1e-3, 1, i + 5) for i in (2, 3))
    ddx, ddy = (np.einsum("kij,kj->ki", across, side) for side in (x, y))
    a, b = _pairs(count, 2e-3, 1, 10)
    # No footprint, and a round one to the last float.
    for side in (ddx, ddy, a, b):
        side[:20] = 0
    d[10:20], ddx[10:20], ddy[10:20] = (0, 0, 1), (0.5, 0, 0), (0, 0.5, 0)
    return d, ddx, ddy, a, b


def _widened_bound(dir: Any, ddx: Any, ddy: Any, a: Any, b: Any, want: Any) -> F64:
    squares = want[2]
    apart = 1 - squares[:, 1] / np.where(squares[:, 0] > 0, squares[:, 0], 1.0)
    # Axes are off as squares are over how far these lie apart; squares are by some roundings of the larger one.
    return (40 * EPS * np.maximum(1.0 / np.maximum(apart, EPS), squares[:, 0]))[:, None]


def _widened_where(dir: Any, ddx: Any, ddy: Any, a: Any, b: Any) -> Any:
    """Where the axes differ, and the longer one is told from its opposite; and where there is none, by rule."""
    d, *rest = (np.asarray(v, np.float64) for v in (dir, ddx, ddy, a, b))
    longer, _, squares = spreads.widened_footprint(d, *rest)
    told = np.abs(dot(longer, axes_across(d)[0])) > 1e-3
    return (squares[:, 1] < 0.9 * squares[:, 0]) & told | (squares[:, 0] == 0)


def _taps() -> Rows:
    longer = inputs.log_uniform(3000, 1e-8, 4, seed=1)
    squares = np.stack([longer, longer * inputs.uniform(3000, 0, 1, seed=2)], axis=-1)
    squares[-10:, 1], squares[-5:] = 0.0, 0.0
    return squares, 100.0


CASES: dict[str, Case] = {
    "color.srgb_from_linear": Case(
        _lights,
        "pow(x, 1/2.4) is within 19 ULP, times 1.055, less 0.055; at the joint the two pieces differ by 3e-8",
        ulps=24,
        abs=1e-7,
    ),
    "color.reinhard": Case(
        lambda: (*_lights(), np.float32(inputs.uniform(4000, 0.5, 16))),
        "a square, three products, two sums and two divisions of 2.5 ULP",
        ulps=12,
    ),
    "color.filmic": Case(_lights, "five products and three sums of positive terms, and a division", ulps=10),
    "encodings.signed_codes": Case(
        lambda: _coded(inputs.uniform(4000, -1, 1, (3,))),
        "a product of at most twice the middle is rounded, a difference, and a division by the middle",
        abs=8 * EPS,
    ),
    "encodings.normal_from_rgb": Case(
        lambda: _coded(inputs.directions(4000)), "codes within 8 EPS, and an inverse root of 1.5 ULP", abs=12 * EPS
    ),
    "encodings.normal_from_rg": Case(
        lambda: _coded(_outwards()[:, :2]), "codes within 8 EPS through the root of 1 - x^2 - y^2", abs=_xy_bound
    ),
    "encodings.normal_from_octahedral": Case(
        lambda: _coded(np.concatenate([inputs.uniform(4000, -1, 1, (2,)), _AXES_UNFOLDED])),
        "places within 8 EPS, three times as far in the middle of a face, where they are nearest",
        abs=32 * EPS,
    ),
    "encodings.codes_from_bytes": Case(
        lambda: (np.random.default_rng(1).integers(0, 256, (3000, 3)) / 255,), "a division of 2.5 ULP", ulps=3
    ),
    "encodings.slope_from_rg": Case(
        lambda: (*_coded(inputs.uniform(4000, -1, 1, (2,))), inputs.log_uniform(4000, 1e-3, 128)),
        "codes within 8 EPS, times the steepest slope",
        abs=lambda c, middle, steepest, want: 10 * EPS * np.asarray(steepest, float),
    ),
    "encodings.slope_from_normal": Case(
        lambda: (_normals_of_all_lengths(),), "two divisions of 2.5 ULP; 128 divides exactly", ulps=4
    ),
    "gradients.height_at": Case(_map_places(), "two products and two sums each way, below 1", abs=6 * EPS),
    "gradients.slope_forward": _slope_case(2),
    "gradients.slope_across": _slope_case(2, np.float32(1.5)),
    "gradients.slope_central": _slope_case(2),
    "gradients.slope_half": _slope_case(2),
    "gradients.slope_fourth": _slope_case(4),
    "gradients.slope_smoothed": _slope_case(6, np.float32(0.1)),
    "gradients.slope_sobel": _slope_case(6),
    "gradients.slope_scharr": _slope_case(6),
    "gradients.slope_bspline": replace(_slope_case(16), rows=_odd_places),
    "gradients.height_bspline": _height_case(),
    "gradients.cubic_weights": Case(
        lambda: (np.concatenate([[0, 1, 0.5], inputs.uniform(1000)]).astype(np.float32),),
        "terms up to 4 of some six roundings, over 6",
        abs=4 * EPS,
    ),
    "gradients.quadratic_weights": Case(
        lambda: (np.concatenate([[0, 1, 0.5], inputs.uniform(1000)]).astype(np.float32),),
        "1 - t is rounded once, two products and a sum, of at most 3/4",
        abs=3 * EPS,
    ),
    "procedural.soft_sign": Case(
        lambda: tuple(
            np.append(a, 0)  # nothing at all, where there is no side
            for a in (
                inputs.uniform(3000, -1, 1),
                inputs.log_uniform(3000, 1e-6, 1, seed=1),
                inputs.uniform(3000, seed=2),
            )
        ),
        "two sums, two lengths of 2 ULP, a sum and a division of 2.5 ULP; y + reach may cancel to EPS of either",
        ulps=8,
        abs=4 * EPS,
    ),
    "procedural.footprint_reach": Case(lambda: _looks()[1:], "a length of 2 ULP, halved", ulps=4),
    "procedural.sky_radiance": Case(
        lambda: (*_looks(), UP, DOWN, inputs.uniform(1, 0, 1)[0]),
        "soft_sign within 8 EPS, times a length of at most 1.5, between colours of at most 1",
        abs=16 * EPS,
    ),
    "procedural.sinc": Case(
        lambda: (
            np.concatenate([inputs.floats(-0.2, 0.2), inputs.uniform(500, -0.1, 0.1), inputs.uniform(2000, -60, 60)]),
        ),
        "sin within 1.5 ULP of 1, over 0.1 at least; its argument's rounding is divided by the argument. The series "
        "below that is 1 less what is small: two roundings",
        abs=lambda x, want: np.where(np.abs(x) < 0.1, 2, 16) * EPS,
    ),
    "procedural.chrome_radiance": Case(
        lambda: (*_looks(high=0.1), UP, DOWN, np.float32(3), np.float32(0.3)),
        "a phase of at most 12, doubled, of some roundings, and footprints' phases of as many, each with a sinc",
        abs=100 * EPS,
    ),
    "procedural.lattice_value": Case(
        lambda: (
            np.random.default_rng(1).integers(-(2**31), 2**31, (3000, 2), dtype=np.int64).astype(np.int32),
            np.random.default_rng(2).integers(0, 2**32, 3000, dtype=np.int64).astype(np.uint32),
        ),
        "integers, and 24 bits of them as a float: the same number",
        abs=2.0**-60,
    ),
    "procedural.value_noise": Case(
        lambda: (inputs.uniform(3000, -1000, 1000, (2,)), np.arange(3000, dtype=np.uint32)),
        "the place within its cell is exact; quintics of some ten roundings, between values of at most 4 apart",
        abs=64 * EPS,
    ),
    "procedural.valley": Case(
        lambda: (inputs.uniform(3000, 0, 12),), "a cubic of values below 1 and of some eight roundings", abs=8 * EPS
    ),
    "procedural.landscape": Case(
        _places, "places of some roundings, times slopes and bends of all octaves", abs=_landscape_bound
    ),
    "procedural.mean_normal": Case(
        lambda: _grounds()[:1], "three products, three sums, an inverse root of 1.5 ULP and a product", ulps=8
    ),
    "procedural.lit_ground": Case(
        _grounds,
        "a height and a normal's y of some four roundings, through steps of slope 8 and 5, between colours below 1",
        abs=80 * EPS,
    ),
    "procedural.clearance": Case(
        lambda: (inputs.directions(2000), np.float32(7.3), _grounds()[0][0]),
        "a division of 2.5 ULP of a height below 3, and a difference",
        abs=4 * EPS,
    ),
    "procedural.march_distance": Case(
        lambda: (np.arange(96, dtype=np.int32), np.int32(96)), "a division of 2.5 ULP, squared, and two sums", ulps=8
    ),
    "procedural.fractal_radiance": Case(
        _marches,
        "what a footprint of 0.02 leaves of the landscape bends by less than 100 a radius; places are off by 3e-6",
        abs=3e-4,
    ),
    "bump.surface_gradient": Case(
        _frames,
        "cross products and j are off by some roundings of unit vectors, and j divides the sum of both terms; along "
        "the axes the shader is exact, and the twin good to 2^-13 where the area is least",
        abs=_gradient_bound,
    ),
    "bump.surface_gradient_screen": Case(
        _quads_of_pixels,
        "as surface_gradient, of differences without rounding",
        abs=_screen_bound,
    ),
    "bump.full_gradient": Case(
        _curved_frames,
        "as surface_gradient, of derivatives that lost what their sums cancelled",
        abs=_full_bound,
    ),
    "bump.invariant_gradient": Case(
        _frames_and_extremes,
        "surface_gradient's direction, times a length of 4 ULP",
        abs=_invariant_bound,
    ),
    "bump.volume_gradient": Case(
        _normals_and_volumes,
        "three products and two sums for what is taken away, a product and a difference, each of |g| at most",
        abs=lambda n, g, want: 8 * EPS * length(g),
    ),
    "bump.triplanar_shares": Case(
        lambda: (np.concatenate([inputs.directions(3000, 5), np.zeros((2, 3), np.float32)]),),
        "an eighth power of a component that is off by half a unit, and its share of their sum: 16 roundings",
        abs=16 * EPS,
    ),
    "bump.orthogonal_gradient": Case(
        _square_frames,
        "two squared lengths, two divisions, two products and a sum: 8 roundings of each term's length",
        abs=_orthogonal_bound,
    ),
    "bump.bump_normal": Case(
        _normals_and_gradients,
        "a difference, a division, an inverse root of 1.5 ULP and two products, of components below 1",
        abs=6 * EPS,
    ),
    "bump.tangent_frame": Case(
        _tilted_frames,
        "dp/du less its part along n cancels as much as dp/du is longer than what is left",
        abs=_frame_bound,
        where=_has_a_side,
    ),
    "direction.largest_part": Case(lambda: (inputs.directions(1000),), "a choice is exact", abs=ulp.TINY),
    "direction.turning": Case(
        _turns,
        "two divisions, two dot products, a difference and a length: some 12 roundings of the change's length",
        abs=_turn_bound,
    ),
    "direction.finite_dir": Case(
        _extreme_directions, "a power of two is exact, but for what it makes denormal", abs=ulp.TINY
    ),
    "direction.unit_dir": Case(
        _extreme_directions,
        "a division of 2.5 ULP, an inverse root of 1.5 and a product, of components below 1",
        abs=6 * EPS,
    ),
    "direction.axes_across": Case(
        lambda: (inputs.directions(3000, 5),),
        "products over 1 + |z|, at least 1: some six roundings of at most 2",
        abs=16 * EPS,
    ),
    "direction.turned_up": Case(lambda: (inputs.directions(1000),), "signs are exact", abs=ulp.TINY),
    "layout.octahedral_place": Case(
        _extreme_directions,
        "two sums, a division of 2.5 ULP and a difference, halved; and one rounding",
        abs=4 * EPS,
        where=off_seams,
    ),
    "layout.hemicube_place": Case(_extreme_directions, "a division of 2.5 ULP and a sum", abs=4 * EPS, where=off_seams),
    "layout.equal_area_place": Case(
        _extreme_directions, "unit_dir's 6 roundings, a root and a division of 2.5 ULP each, halved; a sum", abs=8 * EPS
    ),
    "layout.equidistant_place": Case(
        _extreme_directions,
        "an atan of 3.5e-6 rad, over pi; unit_dir's 6 roundings, a length, a division and a product, halved",
        abs=ATAN / np.pi + 8 * EPS,
    ),
    "layout.orthographic_place": Case(_extreme_directions, "unit_dir's 6 roundings, halved, and a sum", abs=4 * EPS),
    "layout.paraboloid_place": Case(
        _extreme_directions,
        "unit_dir's 6 roundings of both terms, a sum and a division of 2.5 ULP, halved; a sum",
        abs=8 * EPS,
        where=off_seams,
    ),
    "layout.tile_texel": Case(
        _tiles, "two products and two sums, of at most 6 tiles of 4098 texels", abs=4 * 6 * 4098 * EPS
    ),
    "parallax.box_parallax": Case(
        _parallax_boxes,
        "a difference and a division of 2.5 ULP for the way, a product and a sum, of p and of the way; over the "
        "distance of what is met",
        abs=_box_bound,
    ),
    "parallax.sphere_parallax": Case(
        _parallax_spheres,
        "some four roundings of the offset, squared, and of the root of what it leaves of the radius",
        abs=_sphere_parallax_bound,
    ),
    "reflect.refract_dir": Case(
        _refractions,
        "sines of some roundings, and the root of what they leave; at the critical angle either answer is right",
        abs=_refraction_bound,
        where=lambda d, n, eta: np.abs(_sine_behind(d, n, eta) - 1) > 8 * EPS * eta,
    ),
    "reflect.fresnel_dielectric": Case(
        _dielectrics,
        "the refracted cosine is off by some roundings of its terms; exact where eta is 1",
        abs=_fresnel_bound,
    ),
    "environment.latlong_uv": Case(
        _directions_of_all_lengths,
        "two atan of 3.5e-6 rad, divided by 2 pi and pi; the ends of u are one meridian",
        abs=ATAN / np.pi + 2 * EPS,
        period=(1.0, 0.0),
    ),
    "environment.latlong_dir": Case(
        _picture_places,
        "angles up to pi rounded three times, sine and cosine of 1.5 ULP",
        abs=3 * np.pi * EPS + 4 * EPS,
    ),
    "environment.cube_dir": Case(_faces_and_places, "2 st is exact, and one rounding takes 1 away", abs=EPS),
    "environment.cube_border_dir": Case(
        lambda: (_directions_of_all_lengths()[0], np.float32(511 / 512)),
        "a division (2.5 ULP where it is a reciprocal) and a product",
        ulps=4,
    ),
    "environment.sh9_irradiance": Case(
        _irradiance,
        "nine terms, the largest 2, of four roundings each, and eight sums of up to 9",
        abs=(9 * 2 * 4 + 8 * 9) * EPS,
    ),
    "footprint.hit_change": Case(
        _hits,
        "dot products of some four roundings, a quotient by the cosine of incidence",
        abs=_hit_bound,
        where=lambda dp, d, n, least: np.abs(np.abs(dot(d, n)) / length(n) / _LEAST - 1) > 0.05,
    ),
    "footprint.torus_normal_change": Case(
        _on_torus,
        "hypot(x, z) - radius is off by some roundings of 2, over the tube",
        abs=_torus_turn_bound,
        where=lambda p, dp, radius: np.hypot(p[:, 0], p[:, 2]) > 0.05,
    ),
    "footprint.uv_change": Case(
        lambda: (_scaled(inputs.unit_vectors(len(_uv_sides()[0]), 8), 1e-6, 1, 9), *_uv_sides()),
        "products of two squared lengths, and their difference, which the sine of the angle between them makes smaller",
        abs=_uv_bound,
    ),
    "footprint.bump_normal_change": Case(
        _bent_changes,
        "a difference each, and turning's 12 roundings; twice the change's length over what is left of the normal",
        abs=lambda n, g, dn, dg, want: (
            (16 + 8 * (1 + length(g))) * EPS * (length(dn) + length(dg)) / length(n - np.float64(g))
        ),
    ),
    "footprint.reflect_dir_change": Case(
        _reflections,
        "three dot products and four products of unit vectors with changes: some 16 roundings of those",
        abs=lambda d, n, ddir, dn, want: 16 * EPS * (length(ddir) + length(dn)),
    ),
    "footprint.refract_dir_change": Case(
        _refracted_footprints,
        "the cosine behind the surface, and its reciprocal; at the critical angle either answer is right",
        abs=_refract_change_bound,
        where=lambda d, n, eta, ddir, dn: np.abs(_sine_behind(d, n, eta) - 1) > 8 * EPS * eta,
    ),
    "filter.footprint_taps": Case(
        lambda: (*_axes_rows(), np.float32(100), np.float32(16)),
        "a whole number; a quotient may be a rounding to either side of one",
        abs=1e-6,
        where=_between_whole_taps,
    ),
    "filter.footprint_axes": Case(
        _axes_rows,
        "an angle from squared lengths, its sine and its cosine: of the longer side, which may hide the shorter",
        abs=_axes_bound,
        where=_axes_differ,
    ),
    "filter.wrapped_difference": Case(
        lambda: (inputs.floats(-1e6, 1e6)[:, None] + inputs.uniform(2, -2, 2)[None, :] * [[1, 0.5]],),
        "x - round(x) is exact; a half may go either way",
        period=(1.0, 1.0),
    ),
    "filter.isotropic_level": Case(
        _footprints(2),
        "log2 of 3 ULP at up to 126, halved; 1e-6 where the logarithm is near 0",
        ulps=3,
        abs=1e-6,
    ),
    "filter.longest_level": Case(
        _direction_footprints, "log2 of 3 ULP at up to 126, halved; 1e-6 near 0", ulps=3, abs=1e-6
    ),
    "filter.direction_level": Case(
        _direction_footprints, "log2 of 3 ULP at up to 126, halved; 1e-6 near 0", ulps=3, abs=1e-6
    ),
    "filter.share_above": Case(
        _ramps,
        "a quotient of at most 1/2 where it is not clamped, three roundings",
        abs=4 * EPS,
    ),
    "sun.sun_reflected": Case(
        _suns,
        "a lobe of three products' roundings, steep as it is narrow, of half vectors that cancel towards grazing",
        abs=_sun_bound,
    ),
    "ggx.dfg_fit": Case(
        _angles_and_roughness,
        "some ten roundings of terms near 1, and exp2 of 3 ULP",
        abs=16 * EPS,
    ),
    "ggx.dfg_place": Case(
        lambda: (*_angles_and_roughness(), np.float32(32)), "a root, and three roundings near 1", abs=8 * EPS
    ),
    "ggx.glossy_share": Case(
        _shares,
        "F E + F^2 (1 - E), F a quotient of sums above 0.25: some six roundings each, of terms of at most 1",
        abs=(6 / 0.25 + 12) * EPS,
    ),
    "ggx.lobe_shape": Case(
        lambda: (_cosines_and_alpha()[1], _cosines_and_alpha()[2]),
        "1 - cosine is exact to half an EPS, over alpha^2; its quotient squared",
        abs=lambda cosine, alpha, want: 8 * EPS + 2 * EPS / alpha**2,
    ),
    "ggx.lobe_place": Case(
        lambda: (np.arange(3000) % 257, np.resize([257, 300, 4096], 3000)),
        "up to 256 steps of the golden ratio, each rounded, and their product; only 0 comes so near to a whole number",
        abs=512 * EPS,
    ),
    "ggx.visible_normal": Case(
        _seen_facets,
        "a cap's normal of a dozen roundings, sine and cosine of 1.5 ULP; near the rim its height is the root of a "
        "difference, and where cap and eye cancel at grazing angles their sum is as short as the eye is low",
        abs=lambda v, alpha, place, want: 40 * EPS + 16 * EPS / np.maximum(want[..., 2], 1e-3)[..., None],
    ),
    "ggx.normal_angle": Case(
        _facets_and_eyes,
        "squares of h over alpha, h rounded to EPS: twice 2 EPS / alpha of the whole, and v.h of some roundings",
        abs=lambda h, v, alpha, count, want: want * (32 + 8 / alpha + 8 / np.maximum(dot(h, v), 1e-3)) * EPS,
    ),
    "ggx.unshadowed": Case(
        _cosines_and_alpha, "two roots and a quotient of positive sums; 1 - alpha^2 is off by EPS", abs=24 * EPS
    ),
    "ggx.lobe_dir": Case(
        lambda: (
            inputs.directions(2000, 1),
            inputs.directions(2000, 2),
            inputs.uniform(len(inputs.directions(2000)), seed=3),
        ),
        "a share of some eight roundings, of a difference of 2 at most",
        abs=2 * 8 * EPS,
    ),
    "mapping.sphere_step": Case(
        _rays_near_a_sphere,
        "b^2 - c is off by some roundings of radius^2; near the outline the root makes its square root of it",
        abs=_sphere_step_bound,
    ),
    "mapping.sphere_uv": Case(
        _sphere_points,
        "two atan of 3.5e-6 rad, divided by 2 pi and pi; the ends of u are one meridian",
        abs=ATAN / np.pi + 2 * EPS,
        period=(1.0, 0.0),
    ),
    "mapping.sphere_dpdu": Case(_sphere_points, "2 pi rounded, and a product", ulps=2),
    "mapping.sphere_dpdv": Case(
        _sphere_points,
        "a length (2 ULP), a division (2.5 ULP), pi rounded and two products; a point nearer the axis than 1e-18 of "
        "the unit counts as a pole, because its square underflows",
        abs=lambda p, want: 8 * np.pi * EPS * length(p),
        where=_has_a_longitude,
    ),
    "mapping.sphere_dndu": Case(_on_spheres, "sphere_dpdu, and a division", abs=_on_sphere_bound),
    "mapping.sphere_dndv": Case(
        _on_spheres, "sphere_dpdv, and a division", abs=_on_sphere_bound, where=_has_a_longitude
    ),
    "mapping.torus_step": Case(
        _torus_rays,
        "the distance is off by some roundings of the radius, over the sine of 20 degrees; Newton's rest is below it",
        abs=16 * EPS / np.sin(np.radians(20)),
        where=_meets_the_torus,
    ),
    "mapping.torus_normal": Case(
        _torus_points, "hypot(x, z) - radius is off by some roundings of 2, over the tube", abs=_tube_bound
    ),
    "mapping.torus_uv": Case(
        _torus_points,
        "as torus_normal, and an atan of 3.5e-6 rad, over 2 pi; both coordinates go round",
        abs=_tube_uv_bound,
        period=(1.0, 1.0),
    ),
    "mapping.torus_dpdu": Case(lambda: _torus_points()[:1], "2 pi rounded, and a product", ulps=2),
    "mapping.torus_dpdv": Case(
        _torus_points, "hypot(x, z) - radius is off by some roundings of 2, times 2 pi", abs=2 * np.pi * 6 * EPS
    ),
    "mapping.torus_dndu": Case(
        _torus_points,
        "as torus_normal, times 2 pi",
        abs=lambda p, radius, want: 2 * np.pi * (_tube_bound(p, radius, want) + 6 * EPS),
    ),
    "mapping.torus_dndv": Case(
        _torus_points,
        "as torus_normal, times 2 pi",
        abs=lambda p, radius, want: 2 * np.pi * (_tube_bound(p, radius, want) + 6 * EPS),
    ),
    "mapping.inverse_bilinear": Case(
        _quads,
        "three products of differences that each lost some roundings, over areas of a third of the quad at least",
        abs=64 * EPS,
    ),
    "mapping.bilinear_dpdu": Case(
        _quad_uv, "mix of two differences: six roundings of the longest corner", abs=_edge_bound
    ),
    "mapping.bilinear_dpdv": Case(
        _quad_uv, "mix of two differences: six roundings of the longest corner", abs=_edge_bound
    ),
    "mapping.barycentric": Case(
        _triangles,
        "products of edges off by some roundings, over the area; zero area is told from none exactly",
        abs=_barycentric_bound,
    ),
    "reflect.reflect_dir": Case(
        lambda: (inputs.directions(4000, 1), inputs.directions(4000, 2)),
        "a dot product of three roundings, doubled, times n, and a difference, all of at most 2",
        abs=10 * EPS,
    ),
    "reflect.facing": Case(
        lambda: (inputs.directions(4000, 1), inputs.directions(4000, 2)),
        "as reflect_dir; where the cosine is 0 nothing is added",
        abs=10 * EPS,
    ),
    "reflect.above_surface": Case(
        lambda: (inputs.directions(4000, 1), inputs.directions(4000, 2)),
        "as reflect_dir",
        abs=10 * EPS,
    ),
    "reflect.f0_from_ior": Case(
        lambda: (np.concatenate([[1.0], inputs.uniform(1000, 1, 4)]),),
        "a quotient squared: 2 (0.5 + 0.5 + 2.5) + 0.5 ULP; near ior 1 the difference is exact",
        ulps=8,
    ),
    "reflect.fresnel_schlick": Case(
        lambda: (inputs.uniform(3000, shape=(3,)), inputs.uniform(3000, -0.5, 1.5, seed=2)),
        "1 - cos is rounded once and taken to the fifth power: 5 + 6 roundings of what is at most 1",
        abs=12 * EPS,
    ),
    "spread.moments_across": Case(
        _across,
        "four dot products, twice in three products of which the sums may cancel",
        abs=lambda x, y, u, v, moments, want: (
            30 * EPS * ((length(u) + length(v)) ** 2 * np.abs(moments).max(-1))[:, None]
        ),
    ),
    "spread.spread_along": Case(
        _along, "two roots, one of a determinant in which all but roundings may cancel", abs=_along_bound
    ),
    "spread.steep_part": Case(
        _parted,
        "a share of some products; by it the mean is divided, and twice what is taken from the moments",
        abs=_parted_bound,
    ),
    "spread.unit_share": Case(lambda: _pairs(2000, 1e-4, 1e8, 1), "a sum of squares, and its root", ulps=8),
    "spread.folded_share": Case(
        lambda: (np.concatenate([np.linspace(0, 8, 2001), inputs.log_uniform(1000, 8, 1e10, seed=1)]),),
        "a curve fitted to it, and exp of some roundings of 0.6",
        abs=1.6e-4,
    ),
    "spread.folded": Case(
        _folded, "the deviation times folded_share's error, for directions in units of what is left", abs=_folded_bound
    ),
    "spread.widened_footprint": Case(
        _widened,
        "products of at most the longer axis' square, and their eigenvectors where these are apart",
        abs=_widened_bound,
        where=_widened_where,
    ),
    "spread.spread_taps": Case(
        _taps,
        "roots; that of the difference of what is alike",
        abs=lambda squares, per, want: np.sqrt(4 * EPS * squares[:, :1]) + 2 * EPS * want,
    ),
    "spread.spread_roughness": Case(
        lambda: (inputs.uniform(2000, seed=1), *_pairs(2000, 1e-4, 1, 2)), "a sum, and two roots", ulps=6
    ),
}
