"""glbump: surfaces that mirror an environment and carry bumps, with OpenGL and with a NumPy twin.

    import glbump as gb
    gb.render(gb.load_scene("scene.toml"), size=(512, 512)).save("out.png")

Importing this package opens no OpenGL context and imports nothing but the standard library: each public
name is fetched from its module at first use.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from glbump import reference as reference
    from glbump.camera import Camera as Camera
    from glbump.displace import displaced as displaced
    from glbump.environment import BoxBounds as BoxBounds
    from glbump.environment import Captured as Captured
    from glbump.environment import Chrome as Chrome
    from glbump.environment import CubeMap as CubeMap
    from glbump.environment import Fractal as Fractal
    from glbump.environment import HemiCube as HemiCube
    from glbump.environment import Hemisphere as Hemisphere
    from glbump.environment import LatLong as LatLong
    from glbump.environment import LightProbe as LightProbe
    from glbump.environment import Octahedral as Octahedral
    from glbump.environment import Sky as Sky
    from glbump.environment import SphereBounds as SphereBounds
    from glbump.errors import ContextError as ContextError
    from glbump.errors import GlbumpError as GlbumpError
    from glbump.errors import ImageError as ImageError
    from glbump.errors import LimitError as LimitError
    from glbump.errors import MeshError as MeshError
    from glbump.errors import SceneError as SceneError
    from glbump.errors import ShaderError as ShaderError
    from glbump.frame import Frame as Frame
    from glbump.gl.renderer import Renderer as Renderer
    from glbump.gl.renderer import render as render
    from glbump.maps import patterns as patterns
    from glbump.quality import Quality as Quality
    from glbump.qualityfile import load_quality as load_quality
    from glbump.qualityfile import save_quality as save_quality
    from glbump.scene import Bump as Bump
    from glbump.scene import Material as Material
    from glbump.scene import NormalMap as NormalMap
    from glbump.scene import Scene as Scene
    from glbump.scene import Surface as Surface
    from glbump.scene import with_value as with_value
    from glbump.scenefile import load_scene as load_scene
    from glbump.scenefile import save_scene as save_scene
    from glbump.shapes import Cube as Cube
    from glbump.shapes import MeshData as MeshData
    from glbump.shapes import MeshFile as MeshFile
    from glbump.shapes import Plane as Plane
    from glbump.shapes import Quad as Quad
    from glbump.shapes import Sphere as Sphere
    from glbump.shapes import Torus as Torus
    from glbump.shapes import Transform as Transform
    from glbump.trade.tune import tune as tune

    __version__: str

# Module -> its public names; tests/test_setup.py holds it against the imports above.
_PUBLIC = {
    "camera": ("Camera",),
    "displace": ("displaced",),
    "environment": (
        "BoxBounds",
        "Captured",
        "Chrome",
        "CubeMap",
        "Fractal",
        "HemiCube",
        "Hemisphere",
        "LatLong",
        "LightProbe",
        "Octahedral",
        "Sky",
        "SphereBounds",
    ),
    "errors": (
        "ContextError",
        "GlbumpError",
        "ImageError",
        "LimitError",
        "MeshError",
        "SceneError",
        "ShaderError",
    ),
    "frame": ("Frame",),
    "gl.renderer": ("Renderer", "render"),
    "quality": ("Quality",),
    "qualityfile": ("load_quality", "save_quality"),
    "scene": ("Bump", "Material", "NormalMap", "Scene", "Surface", "with_value"),
    "scenefile": ("load_scene", "save_scene"),
    "shapes": ("Cube", "MeshData", "MeshFile", "Plane", "Quad", "Sphere", "Torus", "Transform"),
    "trade.tune": ("tune",),
}
_MODULE_OF = {name: module for module, names in _PUBLIC.items() for name in names}

# Modules that are public as a whole.
_MODULES = {"patterns": "glbump.maps.patterns", "reference": "glbump.reference"}

__all__ = sorted([*_MODULE_OF, *_MODULES])


def __getattr__(name: str) -> Any:
    if name in _MODULE_OF:
        value = getattr(import_module(f"glbump.{_MODULE_OF[name]}"), name)
    elif name in _MODULES:
        value = import_module(_MODULES[name])
    elif name == "__version__":
        from importlib.metadata import version

        value = version("glbump")
    else:
        raise AttributeError(f"module 'glbump' has no attribute {name!r}")
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted([*globals(), *__all__, "__version__"])
