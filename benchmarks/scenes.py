"""The scenes that accuracy is measured on; tests/test_accuracy.py measures the same ones, smaller."""

from __future__ import annotations

import json
import struct
import tempfile
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np
import numpy.typing as npt

from glbump.camera import Camera
from glbump.demo import panorama, relief
from glbump.environment import CubeMap, Environment, LatLong
from glbump.maps.images import read_colour
from glbump.maps.layout import EnvironmentMap
from glbump.maps.pictured import environment_of
from glbump.scene import Bump, Material, NormalMap, Scene, Surface
from glbump.shapes import Cube, MeshFile, Plane, Quad, Sphere, Torus, Transform

DATA = Path(__file__).resolve().parents[2] / "shared" / "data"
"""Photographed environments; they lie beside the project, not in it."""

PANORAMAS = {
    "venice": DATA / "cc0" / "venice.exr",
    "workshop": DATA / "cc0" / "workshop.exr",
    "KernerEnv": DATA / "openexr" / "KernerEnvLatLong.exr",
}


def panoramas() -> dict[str, EnvironmentMap]:
    """The photographed panoramas that there are."""
    there = {name: path for name, path in PANORAMAS.items() if path.is_file()}
    return {name: environment_of(read_colour(path), "lat-long") for name, path in there.items()}


CHROME = Material(metallic=1, roughness=0)


@dataclass(frozen=True)
class Case:
    """A scene by name. environment: its file below DATA. scene: made from what that file, or the demo, shows."""

    name: str
    environment: str
    scene: Callable[[Environment], Scene]

    def photographed(self) -> Scene:
        """In its photographed environment."""
        path = DATA / self.environment
        return self.scene(CubeMap(path) if "Cube" in path.name else LatLong(path))

    def computed(self) -> Scene:
        """In the demo's environment, which needs no file."""
        return self.scene(evening())

    @property
    def is_there(self) -> bool:
        """Whether the photographed environment is."""
        return (DATA / self.environment).is_file()


@cache
def evening() -> LatLong:
    """The demo's panorama, small, its sun of 2,000 dimmed: seen in steep bumps, so bright a light is moved by the last
    bits of 32-bit floats."""
    return LatLong(np.minimum(panorama.evening(256), 4))


@cache
def bricks() -> npt.NDArray[np.float32]:
    """Heights (512, 512)."""
    return relief.bricks()


@cache
def quilt() -> npt.NDArray[np.float32]:
    """A normal map (256, 256, 3), -1..1 in steps of 1/127."""
    return np.asarray((relief.normals(relief.quilt(256), 0.1).astype(np.float32) - 128) / 127, np.float32)


def brick_bump(u: float, v: float) -> Bump:
    """Bricks 0.02 deep."""
    return Bump(bricks(), amplitude=0.02, repeat=(u, v))


def mirror_ball(environment: Environment) -> Scene:
    return Scene([Surface(Sphere(), CHROME)], environment)


def bumped_ball(environment: Environment) -> Scene:
    return Scene([Surface(Sphere(), CHROME, brick_bump(8, 4))], environment)


def brick_torus(environment: Environment) -> Scene:
    turned = Transform(rotate=(50, 0, 0))
    return Scene([Surface(Torus(), CHROME, brick_bump(8, 4), turned)], environment)


def normal_mapped_cube(environment: Environment) -> Scene:
    """With a real normal map in real light, and with the demo's in the demo's."""
    real = isinstance(environment, LatLong) and isinstance(environment.image, Path)
    normals = NormalMap(DATA / "cc0" / "normal_0003.webp" if real else quilt())
    gold = Material(base_color=(1, 0.8, 0.4), metallic=1, roughness=0)
    cube = Surface(Cube(), gold, normals, Transform(rotate=(20, 35, 0)))
    return Scene([cube], environment, Camera(eye=(0, 0, 6)))


def grazed_plane(environment: Environment) -> Scene:
    plane = Surface(Plane((20, 20)), CHROME, brick_bump(10, 10))
    return Scene([plane], environment, Camera(eye=(0, 0.6, 8)))


def gltf_mesh(environment: Environment) -> Scene:
    lacquer = Material(base_color=(0.1, 0.3, 0.7), roughness=0)
    mesh = Surface(MeshFile(cushion_file()), lacquer, brick_bump(6, 3), Transform(rotate=(0, 30, 10)))
    return Scene([mesh], environment)


def two_surfaces(environment: Environment) -> Scene:
    """One through the other: a bumped dielectric ball, and a stretched chrome ring that cuts it; the light turned."""
    red = Material(base_color=(0.8, 0.1, 0.1), roughness=0)
    ball = Surface(Sphere(), red, brick_bump(8, 4), Transform(translate=(-0.6, 0, 0)))
    place = Transform(translate=(0.6, 0, 0.3), rotate=(70, 20, 0), scale=(1, 1.3, 1))
    turned = replace(environment, rotation=70, exposure=0.5)
    return Scene([ball, Surface(Torus(), CHROME, transform=place)], turned)


def skew_quad(environment: Environment) -> Scene:
    corners = ((-1, -1, 0), (1.4, -0.8, 0), (0.6, 1.1, 0), (-0.7, 0.6, 0))
    quad = Surface(Quad(corners), CHROME, brick_bump(3, 3), Transform(rotate=(-30, 20, 0)))
    return Scene([quad], environment, Camera(eye=(0, 0, 5), projection="orthographic", height=3))


def rough_balls(environment: Environment) -> Scene:
    """Glossy metal, and glossy lacquer with bumps."""
    copper = Material(base_color=(0.95, 0.6, 0.4), metallic=1, roughness=0.3)
    lacquer = Material(base_color=(0.2, 0.5, 0.2), roughness=0.5)
    left = Surface(Sphere(0.7), copper, transform=Transform(translate=(-0.75, 0, 0)))
    right = Surface(Sphere(0.7), lacquer, brick_bump(6, 3), Transform(translate=(0.75, 0, 0)))
    return Scene([left, right], environment)


CASES = (
    Case("mirror ball", "openexr/KernerEnvLatLong.exr", mirror_ball),
    Case("brick torus", "cc0/venice.exr", brick_torus),
    Case("normal-mapped cube", "cc0/venice.exr", normal_mapped_cube),
    Case("plane at a grazing angle", "cc0/venice.exr", grazed_plane),
    Case("glTF mesh", "cc0/venice.exr", gltf_mesh),
    Case("two surfaces", "cc0/venice.exr", two_surfaces),
    Case("skew quad, orthographic", "openexr/KernerEnvCube.exr", skew_quad),
    Case("rough balls", "cc0/workshop.exr", rough_balls),
)

HARD = Case("normal-mapped cube", "cc0/workshop.exr", normal_mapped_cube)
"""Lamps of 943, seen in slopes of up to 7.8: the last bit of a 32-bit float is a step of display light there."""


@cache
def cushion_file() -> Path:
    """A GLB file of a cushion, in a folder that goes when the process ends."""
    folder = tempfile.TemporaryDirectory(prefix="glbump-")
    _folders.append(folder)
    path = Path(folder.name) / "cushion.glb"
    path.write_bytes(cushion())
    return path


_folders: list[tempfile.TemporaryDirectory[str]] = []


def cushion(columns: int = 48, rows: int = 24) -> bytes:
    """A superellipsoid, |x|^3 + |y|^3 + |z|^3 = 1, as a GLB with positions, normals and texture coordinates."""
    u, v = np.meshgrid(np.linspace(0, 1, columns + 1), np.linspace(0, 1, rows + 1))
    longitude, latitude = 2 * np.pi * u, np.pi * (v - 0.5)
    ball = np.stack([np.cos(latitude) * np.sin(longitude), np.sin(latitude), np.cos(latitude) * np.cos(longitude)], -1)
    points = ball / (np.abs(ball) ** 3).sum(axis=-1, keepdims=True) ** (1 / 3)
    points[np.abs(points) < 1e-9] = 0.0  # of both poles and of the seam, exactly
    normals = np.sign(points) * points**2
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    # glTF's v points down.
    uv = np.stack([u, 1 - v], axis=-1)
    first = (np.arange(rows)[:, None] * (columns + 1) + np.arange(columns)).reshape(-1, 1)
    corners = np.array([[0, 1, columns + 2], [0, columns + 2, columns + 1]])
    # At the poles one of the two triangles has no area.
    indices = np.concatenate([first[columns:] + corners[0], first[:-columns] + corners[1]])
    arrays = [
        (a.reshape(-1, a.shape[-1]).astype("<f4"), 5126, kind)
        for a, kind in zip((points, normals, uv), ("VEC3", "VEC3", "VEC2"))
    ]
    return _glb([*arrays, (indices.reshape(-1).astype("<u4"), 5125, "SCALAR")])


def _glb(arrays: list[tuple[npt.NDArray[np.generic], int, str]]) -> bytes:
    """A GLB of one primitive: POSITION, NORMAL, TEXCOORD_0 and indices, each (array, component type, type)."""
    views, accessors, binary = [], [], b""
    for number, (array, component, kind) in enumerate(arrays):
        data = array.tobytes()
        views.append({"buffer": 0, "byteOffset": len(binary), "byteLength": len(data)})
        accessors.append({"bufferView": number, "componentType": component, "count": len(array), "type": kind})
        binary += data
    points = arrays[0][0]
    accessors[0].update(min=points.min(axis=0).tolist(), max=points.max(axis=0).tolist())
    attributes = {"POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2}
    tree = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": attributes, "indices": 3}]}],
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"byteLength": len(binary)}],
    }
    text = json.dumps(tree).encode()
    text += b" " * (-len(text) % 4)
    chunks = [struct.pack("<I4s", len(data), kind) + data for data, kind in ((text, b"JSON"), (binary, b"BIN\0"))]
    body = b"".join(chunks)
    return struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body
