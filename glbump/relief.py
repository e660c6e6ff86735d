"""How a surface's bumps are read, and which of their terms matter: one answer for the plan and for the reference."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from glbump.contents import Contents
from glbump.maps.gradients import IN_SHADERS
from glbump.quality import Quality
from glbump.scene import Bump, NormalMap, Surface
from glbump.shapes import MeshData, MeshFile, Sphere, Torus

SLOPES, NORMALS, HEIGHTS = "slopes", "normals", "heights"


@dataclass(frozen=True)
class Layer:
    """One bump as it is read: from a map of slopes, of a normal map's slopes, or of heights, whose gradient is taken
    where they are seen. why: of heights, the reason for the one or the other."""

    bump: Bump | NormalMap
    kind: str
    kernel: str
    why: str = ""


def layers(surface: Surface, quality: Quality) -> tuple[Layer, ...]:
    """How each of a surface's bumps is read."""
    return tuple(_layer(bump, quality) for bump in surface.bumps)


def _layer(bump: Bump | NormalMap, quality: Quality) -> Layer:
    kernel = quality.bump_kernel
    if isinstance(bump, NormalMap):
        return Layer(bump, NORMALS, kernel, "a normal map is slopes already")
    if kernel == "spectral" and bump.border == "clamp":
        return Layer(bump, SLOPES, "central", "a map that ends has no spectrum")
    if quality.bump_read == "baked":
        return Layer(bump, SLOPES, kernel, "slopes are made once")
    if kernel not in IN_SHADERS:
        return Layer(bump, SLOPES, kernel, f"{kernel} gradients need the whole map")
    if bump.border == "clamp":
        return Layer(bump, SLOPES, kernel, "beyond the edge of a map that ends there is nothing to take differences of")
    return Layer(bump, HEIGHTS, kernel, "heights are read where they are seen")


def is_normal_mapped(layers: tuple[Layer, ...]) -> bool:
    """Whether a mesh's own tangents are the axes: of normal maps, and where heights need dp/du and dp/dv, of none."""
    return bool(layers) and all(layer.kind == NORMALS for layer in layers)


@dataclass(frozen=True)
class Terms:
    """Whether B (N/|N|)_u and _v are kept. error: degrees that normals are off by, at most, without."""

    full: bool
    error: float


def terms(surface: Surface, quality: Quality, contents: Contents) -> Terms:
    """Whether a surface's bumps need the lecture's full form: where max |B| times the curvature times the slope is more
    than quality.direction_error. A normal map has no heights, and none of these terms."""
    heights = [bump for bump in surface.bumps if isinstance(bump, Bump) and bump.scaling == "world"]
    curvature = _curvature(surface, contents) if heights else 0.0
    height = sum(abs(bump.amplitude) * contents.highest(bump) for bump in heights)
    # Of a normal tilted by t, the term turns sin(t) cos(t) B k: at most half of B k.
    slope = sum(_slope(surface, bump, contents) for bump in heights)
    error = math.degrees(height * curvature * min(slope, 0.5))
    if quality.bump_terms != "auto":
        return Terms(quality.bump_terms == "full" and curvature > 0.0, error)
    return Terms(error > quality.direction_error, error)


def _scales(surface: Surface) -> tuple[float, float]:
    """The least and the largest that the surface's place in the world stretches it."""
    scale = np.abs(np.asarray(surface.transform.scale))
    return float(scale.min()), float(scale.max())


def _curvature(surface: Surface, contents: Contents) -> float:
    """The largest curvature in the world, per world unit."""
    least, most = _scales(surface)
    match surface.shape:
        case Sphere(radius=radius):
            own = 1 / radius
        case Torus(radius=radius, tube=tube):
            own = max(1 / tube, 1 / (radius - tube))
        case MeshFile() | MeshData():
            own = contents.curvature(surface.shape)
        case _:
            own = 0.0
    return own * most / least**2


def _slope(surface: Surface, bump: Bump, contents: Contents) -> float:
    """The steepest that a bump is about the middle of its surface."""
    least, _ = _scales(surface)
    match surface.shape:
        case Sphere(radius=radius):
            lengths = 2 * math.pi * radius, math.pi * radius
        case Torus(radius=radius, tube=tube):
            lengths = 2 * math.pi * (radius - tube), 2 * math.pi * tube
        case _:
            size = float(np.ptp(contents.bounds(surface.shape), axis=0).max())
            lengths = size, size
    steepest = contents.steepest(bump)
    return max(steepest * abs(scale) / (length * least) for scale, length in zip(bump.slope_scale, lengths))
