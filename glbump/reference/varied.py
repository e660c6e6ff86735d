"""Vectors with their changes from pixel to pixel: what shaders/footprint_input.glsl does, in float64."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from glbump.reference import filter as filters
from glbump.reference import footprint, reflect
from glbump.reference.cast import Hits
from glbump.shapes import Quad, Shape, Sphere, Torus

F64 = npt.NDArray[np.float64]
Index = npt.NDArray[np.intp]


class Varied(NamedTuple):
    """Vectors (K, 3), and their changes with a pixel to the right and with one up; or, where they are the middle of
    many, a spread of these."""

    at: F64
    dx: F64
    dy: F64

    def times(self, factor: npt.ArrayLike) -> Varied:
        """Each vector and its changes times a factor (K, 1)."""
        return Varied(*(np.asarray(factor) * v for v in self))


class Place:
    """Where in a grid of rays some of them are."""

    def __init__(self, ray: Index, shape: tuple[int, int]) -> None:
        self.ray, self.shape = ray, shape

    def differences(self, values: F64) -> tuple[F64, F64]:
        """dFdx and dFdy (K, C) of values (K, C) of these rays; 0 beside rays that are not among them."""
        grid = np.full((self.shape[0] * self.shape[1], values.shape[1]), np.nan)
        grid[self.ray] = values
        both = filters.quad_differences(grid.reshape(*self.shape, -1))
        ddx, ddy = (np.nan_to_num(d).reshape(len(grid), -1)[self.ray] for d in both)
        return ddx, ddy

    def varied(self, values: F64) -> Varied:
        """Values (K, 3) with those differences."""
        return Varied(values, *self.differences(values))


class Rays(NamedTuple):
    """Unit directions (K, 3) in the world, the distances (K,) of what they meet, and the camera's pixel_steps."""

    dirs: F64
    t: F64
    steps: F64

    @property
    def depth(self) -> F64:
        """(K, 1) of what they meet; 1 for an orthographic camera."""
        result: F64 = np.where(self.steps[2].any(), self.t * (self.dirs @ self.steps[2]), 1.0)[:, None]
        return result

    def directions(self, turn: F64) -> Varied:
        """In a frame that the matrix `turn` (3, 3), a rotation, leads to from the world."""
        d, per_depth = self.dirs @ turn.T, self.dirs @ self.steps[2]
        changes = [step @ turn.T for step in self.steps[:2]]
        return Varied(d, *((c - d * (d @ c)[:, None]) * per_depth[:, None] for c in changes))


def point_met(shape: Shape, hit: Hits, front: Index, rays: Rays, linear: F64, at: Place) -> Varied:
    """The points of the hits `front`, in the object's frame; linear: (3, 3) from there to the world."""
    p, n = hit.p[front], hit.n[front]
    if not isinstance(shape, Sphere | Torus | Quad):
        return at.varied(p)
    inverse = np.linalg.inv(linear)
    d = rays.dirs @ inverse.T
    d /= np.linalg.norm(d, axis=-1, keepdims=True)
    x, y = (rays.depth * (inverse @ step) for step in rays.steps[:2])
    least = np.full(len(p), footprint.LEAST_COSINE)
    if isinstance(shape, Sphere | Torus):
        # Half a pixel inside a round outline the cosine is the root of a pixel in radii.
        pixel = np.maximum(np.linalg.norm(x, axis=-1), np.linalg.norm(y, axis=-1))
        least = np.sqrt(0.25 * pixel / (shape.radius if isinstance(shape, Sphere) else shape.tube))
    return Varied(p, footprint.hit_change(x, d, n, least), footprint.hit_change(y, d, n, least))


def normal_met(shape: Shape, n_object: F64, p_object: Varied, n_env: F64, linear: F64, at: Place) -> Varied:
    """Unit normals n_env of those points in the frame that `linear` leads to from the object's, where they are
    n_object."""
    if isinstance(shape, Sphere):
        changes = [dp / shape.radius for dp in p_object[1:]]
    elif isinstance(shape, Torus):
        changes = [footprint.torus_normal_change(p_object.at, dp, shape.radius) for dp in p_object[1:]]
    elif isinstance(shape, Quad):
        changes = [np.zeros_like(n_env)] * 2
    else:
        return at.varied(n_env)
    return Varied(n_env, *(turned_change(dn, n_object, linear) for dn in changes))


def turned_change(change: F64, n: F64, linear: F64) -> F64:
    """Changes (K, 3) of the unit normal in the frame that `linear` leads to, from those of the object's own, n."""
    inverse = np.linalg.inv(linear)
    normal, change = n @ inverse, change @ inverse
    square = np.einsum("ni,ni->n", normal, normal)[:, None]
    across = change - normal * np.einsum("ni,ni->n", normal, change)[:, None] / square
    result: F64 = across / np.sqrt(square)
    return result


def reflection(dir: Varied, n: Varied) -> Varied:
    """dir, mirrored at n."""
    changes = (footprint.reflect_dir_change(dir.at, n.at, d, m) for d, m in zip(dir[1:], n[1:], strict=True))
    return Varied(reflect.reflect_dir(dir.at, n.at), *changes)


def refraction(dir: Varied, n: Varied, eta: F64) -> Varied:
    """dir behind a surface."""
    changes = (footprint.refract_dir_change(dir.at, n.at, eta, d, m) for d, m in zip(dir[1:], n[1:], strict=True))
    return Varied(reflect.refract_dir(dir.at, n.at, eta), *changes)


def kept_above(dir: Varied, n: Varied) -> Varied:
    """dir, mirrored where it lies under the plane whose normal is n."""
    return _where(np.einsum("ni,ni->n", dir.at, n.at) < 0, reflection(dir, n), dir)


def kept_facing(n: Varied, dir: Varied) -> Varied:
    """n, mirrored to the eye's side where dir, which points away from the eye, sees it from behind."""
    return _where(np.einsum("ni,ni->n", n.at, dir.at) > 0, reflection(n, dir), n)


def _where(chosen: npt.NDArray[np.bool_], these: Varied, others: Varied) -> Varied:
    return Varied(*(np.where(chosen[:, None], a, b) for a, b in zip(these, others, strict=True)))
