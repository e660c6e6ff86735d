"""What the gallery shows of bumps themselves: layers, gradients side by side, terms, a mesh without u and v."""

from __future__ import annotations

from pathlib import Path

from glbump.camera import Camera
from glbump.environment import LatLong
from glbump.scene import Bump, Material, Scene, Surface
from glbump.shapes import MeshFile, Sphere, Torus, Transform

_CHROME = Material(metallic=1, roughness=0)
_CAMERA = Camera(eye=(0, 0.25, 3.5), fov=45)

KERNELS = tuple(
    tuple({"bump_kernel": kernel, "bump_read": "shader"} for kernel in row)
    for row in (("forward", "central", "half", "sobel"), ("scharr", "fourth", "bspline", "spectral"))
)
TERMS = (({"bump_terms": "small"}, {"bump_terms": "full"}),)
READS = (({"bump_read": "baked"}, {"bump_read": "screen"}),)


def _evening(maps: Path) -> LatLong:
    return LatLong(maps / "evening.exr")


def layers(maps: Path) -> Scene:
    """Detail over a base."""
    base = Bump(maps / "dimples.exr", amplitude=0.06, repeat=(1.5, 0.75))
    detail = Bump(maps / "stone.exr", amplitude=0.012, repeat=(8, 4))
    return Scene([Surface(Sphere(), _CHROME, [base, detail])], _evening(maps), _CAMERA)


def kernels(maps: Path) -> Scene:
    """A map of few texels, so that it shows what is made of them."""
    bump = Bump(maps / "coarse.exr", amplitude=0.06, repeat=(8, 4))
    return Scene([Surface(Sphere(), _CHROME, bump)], _evening(maps), Camera(eye=(0, 0.25, 3.5), fov=36))


def terms(maps: Path) -> Scene:
    """High bumps on a thin tube."""
    bump = Bump(maps / "dimples.exr", amplitude=-0.25, repeat=(4, 1.5))
    turned = Transform(rotate=(58, 0, 14))
    return Scene([Surface(Torus(1.0, 0.42), _CHROME, bump, turned)], _evening(maps), Camera(eye=(0, 0.2, 4.2), fov=45))


def triplanar(maps: Path) -> Scene:
    """The knot, by its coordinates in space instead of its u and v."""
    bump = Bump(maps / "dimples.exr", amplitude=0.05, repeat=(0.8, 0.8), mapping="triplanar")
    surface = Surface(MeshFile(maps / "knot.obj"), _CHROME, bump, Transform(rotate=(0, -18, 0)))
    return Scene([surface], _evening(maps), Camera(eye=(0, 0.2, 4.0), fov=45))
