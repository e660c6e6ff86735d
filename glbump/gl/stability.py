"""Where whole pictures break: the naive way, what glbump does instead, and what is left of the error on this driver.

Of single formulas glsltest/stability.py tells the same; `glbump doctor --stability` prints both. docs/extremes.md
says which form is used, and why.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from glbump import reference
from glbump.camera import Camera
from glbump.contents import Contents
from glbump.environment import LatLong
from glbump.gl.context import Context
from glbump.gl.probe import odd_mips
from glbump.gl.renderer import Renderer
from glbump.maps.layout import LATLONG, texel_dirs
from glbump.maps.pyramid import chain
from glbump.mesh import Mesh, in_repeats
from glbump.quality import Quality
from glbump.scene import Bump, Material, Scene, Surface
from glbump.shapes import Plane, Quad, Shape, Sphere, Transform

Floats = npt.NDArray[np.floating[Any]]
Errors = tuple[float, float]


@dataclass(frozen=True)
class Row:
    """One extreme on one driver: the largest error of the naive form and of glbump's, in `unit`; infinite where what
    came out is no number."""

    name: str
    naive: float
    used: float
    bound: float
    unit: str

    @property
    def holds(self) -> bool:
        return self.used <= self.bound


def stability_report(context: Context) -> list[Row]:
    """The extremes of whole pictures, drawn in `context`."""
    with Renderer(context=context) as renderer:
        return [Row(name, *measure(renderer), bound, unit) for name, measure, bound, unit in PICTURES]


def stability_text(rows: list[Row]) -> str:
    """A table for people, its columns aligned."""
    table = [("extreme", "naive", "glbump", "bound", "")]
    for row in rows:
        errors = f"{row.naive:.2g}", f"{row.used:.2g}", f"{row.bound:.2g} {row.unit}"
        table.append((row.name, *errors, "holds" if row.holds else "BROKEN"))
    widths = [max(len(line[i]) for line in table) for i in range(5)]
    return "\n".join("  ".join(f"{cell:{w}}" for cell, w in zip(line, widths)).rstrip() for line in table)


# ---- what is drawn

MIRROR = Material(metallic=1, roughness=0)
SHARP = Quality("exact", samples=1)
"""One sample and nothing but floats: what is left is the arithmetic."""
SIZE = (32, 32)


def smooth(height: int = 32) -> LatLong:
    """Radiance 1/2 + d/2 in every direction d: changes slowly, differs everywhere."""
    return LatLong((0.5 + 0.5 * texel_dirs(LATLONG, (2 * height, height))[0]).astype(np.float32))


def even(value: float) -> LatLong:
    """The same grey everywhere."""
    return LatLong(np.full((4, 8, 3), value, np.float32))


def waves(n: int = 32) -> npt.NDArray[np.float32]:
    """(n, n) heights 0..1: two waves along u."""
    return (0.5 + 0.5 * np.sin(np.linspace(0, 4 * np.pi, n, endpoint=False))).astype(np.float32) * np.ones((n, 1), "f4")


def _quad(size: float, away: float = 0.0) -> Quad:
    """No parallelogram, and tilted, `away` from its own origin along x, y and z."""
    # Binary fractions, so that scaling and moving are exact in float64, and no edge may round to its other side.
    corners = np.array([[-1, -1, 0.5], [1, -1, 0.5], [0.75, 0.875, -0.4375], [-0.75, 0.875, -0.4375]]) * size + away
    a, b, c, d = (_three(corner) for corner in corners)
    return Quad((a, b, c, d))


def _bumpy(shape: Shape, size: float = 1.0, away: float = 0.0, heights: float = 1.0) -> Scene:
    """A bumped mirror `size` wide at (away, away, away), seen from three sizes off."""
    bump = Bump(waves() * np.float32(heights), amplitude=0.05 * size / heights, repeat=(3, 2))
    eye = (away + 0.5 * size, away + size, away + 3 * size)
    return Scene([Surface(shape, MIRROR, bump)], smooth(), Camera(eye=eye, target=(away, away, away)))


def _difference(a: Floats, b: Floats) -> float:
    """Largest of |a - b|; infinite where either is no number."""
    off = np.abs(a.astype(np.float64) - b)
    return float(np.where(np.isfinite(off), off, np.inf).max())


def _drawn(renderer: Renderer, scene: Scene, quality: Quality = SHARP, size: tuple[int, int] = SIZE) -> Floats:
    return renderer.render(scene, size, quality).pixels


# ---- the extremes: naive error, glbump's


def _sizes(renderer: Renderer) -> Errors:
    """Naive: the product N . (e x f) of a quad's inverse bilinear mapping, in its own coordinates and 32 bits."""
    plain = _drawn(renderer, _bumpy(_quad(1.0)))
    naive, used = [], []
    for size in (2.0**-40, 2.0**-20, 2.0**20, 2.0**40):
        corners = np.array(_quad(size).corners)
        with np.errstate(over="ignore", invalid="ignore", under="ignore"):
            naive.append(abs(_volume(corners.astype(np.float32)) / _volume(corners) - 1))
        used.append(_difference(_drawn(renderer, _bumpy(_quad(size), size)), plain))
    return max(naive), max(used)


def _volume(corners: Floats) -> float:
    a, b, c, d = corners
    return float(np.dot(np.cross(c - a, d - b), np.cross(b - a, d - a)))


def _far_corners(renderer: Renderer) -> Errors:
    """Naive: corners 1e7 from a quad's own origin as 32-bit floats."""
    corners = np.array(_quad(1.0).corners)
    naive = np.abs((corners + 1e7).astype(np.float32).astype(np.float64) - 1e7 - corners).max()
    used = _difference(_drawn(renderer, _bumpy(_quad(1.0, 1e7), away=1e7)), _drawn(renderer, _bumpy(_quad(1.0))))
    return float(naive), used


def _low_eye(renderer: Renderer) -> Errors:
    """Naive: a point of the floor less the eye, in 32 bits. In radians; light changes by 1/2 a radian."""
    eye = np.array([0.31234567e6, 1.7, 0.22345678e6])
    points = eye + np.column_stack([np.linspace(1.0, 3.0, 50), np.full(50, -1.7), np.linspace(3.0, 5.0, 50)])
    naive = _directions(points.astype(np.float32) - eye.astype(np.float32)) - _directions(points - eye)
    camera = Camera(eye=_three(eye), target=_three(points[25]))
    scene = Scene([Surface(Plane((1e6, 1e6)), MIRROR)], smooth(), camera)
    used = _difference(_drawn(renderer, scene), reference.render(scene, SIZE, 1).pixels)
    return float(np.linalg.norm(naive, axis=-1).max()), 2 * used


def _directions(v: Floats) -> Floats:
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


def _three(v: Floats) -> tuple[float, float, float]:
    return (float(v[0]), float(v[1]), float(v[2]))


def _depth(renderer: Renderer) -> Errors:
    """Share of pixels that show the farther of two mirrors 1e-4 of their distance apart, with a ball 1e-9 of that
    distance from the eye. Naive: 24 bits of near / z."""
    far, gap = 1e9, 1e-4
    black = replace(MIRROR, base_color=(0.0, 0.0, 0.0))
    front = Transform(rotate=(60, 0, 0), translate=(0, 0, -far))
    behind = replace(front, translate=_three(np.array(front.translate) - gap * far * front.matrix()[:3, 1]))
    mirrors = [Surface(Plane((far, far)), m, transform=t) for m, t in ((black, front), (MIRROR, behind))]
    ball = Surface(Sphere(0.1), MIRROR, transform=Transform(translate=(0.5, 0, -1)))
    scene = Scene([*mirrors, ball], even(1.0), Camera(eye=(0, 0, 0), target=(0, 0, -1), fov=20))
    z = np.linspace(0.9, 1.1, 1000) * far
    near, farther = (np.rint((1 - 0.9 / distance) * 2**24) for distance in (z, z * (1 + gap)))
    return float((near >= farther).mean()), float((_drawn(renderer, scene)[..., 0] > 0.5).mean())


def _samples(renderer: Renderer) -> Errors:
    """Naive: 1024 samples of 0.18 added up in a half float."""
    total = np.float16(0)
    for _ in range(1024):
        total += np.float16(0.18 / 1024)
    pixels = _drawn(renderer, Scene([], even(0.18)), Quality("balanced", samples=1024), (2, 2))[..., :3]
    return abs(float(total) / 0.18 - 1), _difference(pixels / 0.18, np.ones_like(pixels))


def _dim(renderer: Renderer) -> Errors:
    """Naive: light of 1e-6 in half floats, as the picture and the frame are otherwise kept."""
    light = np.linspace(1, 2, 32)[:, None, None] * np.full((1, 64, 3), 1e-6)
    half = _difference(light.astype(np.float16) / light, np.ones_like(light))
    scene, bright = (Scene([], LatLong((light * f).astype(np.float32))) for f in (1.0, 1e6))
    quality = Quality("balanced", texture_format="half")
    pixels, right = _drawn(renderer, scene, quality), _drawn(renderer, bright, SHARP)
    return half, _difference(pixels[..., :3] * 1e6, right[..., :3])


def _steep_heights(renderer: Renderer) -> Errors:
    """Naive: slopes of heights from 0 to 1e6 in half floats."""
    with np.errstate(over="ignore"):
        half = Contents().slopes(Bump(waves() * np.float32(1e6), amplitude=1.0)).astype(np.float16)
    quality = Quality("balanced", samples=1, bump_filter="bilinear")
    plain, steep = (_drawn(renderer, _bumpy(Sphere(), heights=h), quality) for h in (1.0, 1e6))
    return float(np.abs(half).max()), _difference(plain, steep)


def _repeats(renderer: Renderer) -> Errors:
    """Places in a mesh 1e6 repeats wide, in repeats. Naive: u,v times repeat as 32-bit floats."""
    n = 1000
    uv = np.array([[x, 0.0] for x in range(n)] + [[x, 1.0] for x in range(n)]) + (1 / 3, 0)
    first = np.arange(n - 1)
    triangles = np.stack([first, first + 1, first + n], axis=-1).astype(np.int32)
    mesh = Mesh(np.zeros((2 * n, 3)), triangles, uv=uv)
    right = uv[triangles] * 1000.0
    tiled = in_repeats(mesh, (1000.0, 1000.0))
    assert tiled.uv is not None
    got = tiled.uv.astype(np.float32).astype(np.float64)[tiled.triangles]
    naive, used = np.abs(right.astype(np.float32) - right).max(), np.abs((got - right) - np.rint(got - right)).max()
    return float(naive), float(used)


def _odd_levels(renderer: Renderer) -> Errors:
    """Weights of 7 texels in the 1x1 level. Naive: the driver's own levels."""
    weights = [chain(np.eye(7, dtype=np.float32)[i].reshape(1, 7, 1))[-1].item() for i in range(7)]
    return float(odd_mips(renderer.context)["max_error"]), float(np.abs(np.array(weights) - 1 / 7).max())


def _roughness(renderer: Renderer) -> Errors:
    """A roughness of 1e-9 against a mirror. Naive: GGX at its peak, a^2 / (n.h^2 (a^2 - 1) + 1)^2, in 32 bits."""
    alpha2, one = np.float32(1e-9) ** 4, np.float32(1)
    with np.errstate(divide="ignore", invalid="ignore", under="ignore"):
        peak = float(alpha2 / (alpha2 - one + one) ** 2)
    balls = (Scene([Surface(Sphere(), Material(metallic=1, roughness=r))], smooth()) for r in (0.0, 1e-9))
    mirror, rough = (_drawn(renderer, scene) for scene in balls)
    return peak if np.isfinite(peak) else np.inf, _difference(mirror, rough)


_LIGHT = "of full light"
PICTURES: tuple[tuple[str, Callable[[Renderer], Errors], float, str], ...] = (
    ("a quad 1e-12 to 1e12 wide", _sizes, 1e-5, _LIGHT),
    ("corners 1e7 from their origin", _far_corners, 1e-5, _LIGHT),
    ("an eye 1.7 above a floor 1e6 wide", _low_eye, 1e-5, "radians"),
    ("near 1, far 1e9, mirrors 1e-4 apart", _depth, 0.0, "of the pixels"),
    ("1024 samples a pixel", _samples, 2.0**-10, "relative"),
    ("an environment of 1e-6", _dim, 2.0**-10, "relative"),
    ("heights from 0 to 1e6", _steep_heights, 2.0**-8, _LIGHT),
    ("a mesh 1e6 repeats wide", _repeats, 2.0**-13, "repeats"),
    ("levels of 7 texels", _odd_levels, 2.0**-24, "of the whole"),
    ("roughness 1e-9", _roughness, 2.0**-8, _LIGHT),
)
