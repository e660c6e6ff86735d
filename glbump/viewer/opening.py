"""What is shown: a scene file, or the obvious scene for a mesh or a picture; and what a dropped file changes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from glbump.camera import Camera
from glbump.contents import Contents
from glbump.environment import CubeMap, Environment, HemiCube, Hemisphere, LatLong, LightProbe, Octahedral
from glbump.errors import GlbumpError, ImageError, MeshError, SceneError
from glbump.frozen import Frozen
from glbump.maps.files import cache_folder
from glbump.plan.surfaces import world_bounds
from glbump.scene import Bump, NormalMap, Scene, Surface
from glbump.scenefile import load_scene
from glbump.shapes import MESHES, MeshFile, Plane, Torus, Transform
from glbump.viewer.navigation import fitted

if TYPE_CHECKING:
    from glbump.demo import Exhibit

# What a scene file does not need is imported where it is: its first frame is the sooner there.

MESH_SUFFIXES = (".obj", ".ply", ".stl", ".glb")
STEEP = 0.05
"""Amplitude of heights that come with none: a share of their tile's width, as `glbump normals` has it."""
SCENE, MESH, PANORAMA, HEIGHTS, NORMALS = "scene", "mesh", "environment", "heights", "normal map"


class Subject(Frozen):
    """What the window shows. name: in few words, also of files that are written; title: in more; file: of the scene, to
    be read again when it changes; tone, exposure: how the screen shows it until somebody turns them, as Frame.save."""

    name: str
    scene: Scene
    title: str = ""
    file: Path | None = None
    tone: str = "clip"
    exposure: float = 0.0


def kind_of(path: Path) -> tuple[str, str]:
    """What a file is, and why: one of the kinds above. GlbumpError where it is none of them, or cannot be read."""
    suffix = path.suffix.lower()
    if suffix == ".toml":
        return SCENE, "its name ends in .toml"
    from glbump.maps.containers import TEXTURE_SUFFIXES
    from glbump.maps.facefiles import face_files
    from glbump.maps.lint.use import COLOUR, ENVIRONMENT, HEIGHT, use_of
    from glbump.maps.stored import check_file, read_stored

    if suffix in MESH_SUFFIXES:
        check_file(path)
        return MESH, f"its name ends in {suffix}"
    if face_files(path) is not None:
        return PANORAMA, "it holds the six faces of a cube"
    if suffix in TEXTURE_SUFFIXES:
        return PANORAMA, f"{suffix} files hold cubes here"
    try:
        use, why = use_of(read_stored(path, finite=False))
    except ImageError as error:
        raise ImageError(f"{error} (scenes are .toml, meshes {' '.join(MESH_SUFFIXES)}, all others pictures)") from None
    if use == COLOUR:
        raise ImageError(
            f"{path}: {why}; an environment is 2:1, a cross, a strip or a disc, heights are grey, and normal maps are "
            "vectors of length 1; where the name has one of the words env, height or normal, that decides"
        )
    return {ENVIRONMENT: PANORAMA, HEIGHT: HEIGHTS}.get(use, NORMALS), why


def require_there(path: Path) -> None:
    """GlbumpError where a file is not there at all, before a window opens for it."""
    if not path.exists() and "{face}" not in path.name:
        raise SceneError(
            f"{path}: there is no such file; give a scene, a mesh or a picture, or nothing for the gallery"
        )


def opened(path: Path, contents: Contents) -> Subject:
    """A scene file as it is; for the others the obvious scene: a mesh in the demo's evening, a chrome ball in a
    panorama, heights and normals on a torus over a plane. Raises GlbumpError kinds."""
    kind, why = kind_of(path)
    name = path.name.encode(errors="replace").decode()  # Bytes that are no letters cannot be shown.
    if kind == SCENE:
        return Subject(name, load_scene(path), name, path)
    from glbump import demo
    from glbump.demo.gallery import GOLD

    title = f"{name} ({kind}, since {why})"
    if kind == PANORAMA:
        ball = demo.chosen(["mirror-ball"])[0].scene(path)
        return Subject(name, replace(ball, environment=environment_in(path)), title)
    evening = LatLong(_demo_maps(["evening.exr"]) / "evening.exr")
    lit = Subject(name, Scene([], evening), title, tone="filmic", exposure=0.4)
    if kind == MESH:
        return replace(lit, scene=with_mesh(lit.scene, path, contents))
    bumped = bump_in(path, kind, width=1.0)
    # A mirror: a chain for rough ones takes seconds to make. Tiles of the torus are a little over a unit wide, and so
    # are the plane's.
    gold = replace(GOLD, roughness=0)
    surfaces = (
        Surface(Torus(1.0, 0.42), gold, replace(bumped, repeat=(6, 2)), Transform(rotate=(58, 0, 14))),
        Surface(Plane((6, 6)), gold, replace(bumped, repeat=(6, 6)), Transform(translate=(0, -1.35, 0))),
    )
    camera = Camera(eye=(0, 1.1, 4.6), target=(0, -0.25, 0), fov=42)
    return replace(lit, scene=Scene(surfaces, evening, camera))


def gallery() -> tuple[Callable[[Contents], Subject], ...]:
    """The demo's scenes, each made when it is asked for."""
    from glbump import demo
    from glbump.demo.gallery import maps_of

    def show(exhibit: Exhibit, _: Contents) -> Subject:
        names = sorted(maps_of(exhibit.scene(Path())))
        scene = exhibit.scene(_demo_maps(names))
        return Subject(exhibit.name, scene, exhibit.title, tone="filmic", exposure=exhibit.exposure)

    return tuple(partial(show, exhibit) for exhibit in demo.EXHIBITS)


def dropped(path: Path, scene: Scene, surface: int, contents: Contents) -> Scene:
    """`scene` with a file in it: an environment in place of its own; a mesh in place of its surfaces; heights or
    normals on `surface`. Raises GlbumpError kinds, for a scene file too: that is opened."""
    kind, _ = kind_of(path)
    if kind == PANORAMA:
        return replace(scene, environment=environment_in(path))
    if kind == MESH:
        return with_mesh(scene, path, contents)
    if kind == SCENE:
        raise SceneError(f"{path} is a scene, and no part of one")
    if not scene.surfaces:
        raise SceneError(f"{path} holds {kind}, and there is no surface here to put them on; drop a mesh first")
    old = scene.surfaces[surface]
    known = next((bump for bump in old.bumps), None)
    size = np.ptp(world_bounds(old, contents), axis=0).max()
    repeat = known.repeat if known is not None else (1.0, 1.0)
    bump = bump_in(path, kind, width=float(size) / 2 / max(repeat))
    bump = replace(bump, repeat=repeat)
    if isinstance(old.shape, MESHES) and contents.mesh(old.shape).uv is None:
        if not isinstance(bump, Bump):
            raise MeshError(f"{path}: normal maps need u and v, and {old.shape.name} has none; drop heights instead")
        bump = replace(bump, mapping="triplanar", repeat=(2 / float(size), 2 / float(size)))
    surfaces = list(scene.surfaces)
    surfaces[surface] = replace(old, bump=bump)
    return replace(scene, surfaces=surfaces)


def environment_in(path: Path) -> Environment:
    """The environment that a picture, a texture file or a folder of six holds. ImageError where it cannot be read."""
    from glbump.maps.containers import TEXTURE_SUFFIXES
    from glbump.maps.facefiles import face_files

    if path.suffix.lower() in TEXTURE_SUFFIXES or face_files(path) is not None:
        return CubeMap(path)
    from glbump.maps.detect import detect
    from glbump.maps.images import colour_of
    from glbump.maps.stored import read_stored
    from glbump.maps.unfolding import UNFOLDINGS

    layout = detect(colour_of(read_stored(path))).layout
    if layout in UNFOLDINGS:
        layout = UNFOLDINGS[layout].layout.name
    kinds: dict[str, Callable[[Path], Environment]] = {
        "cube": CubeMap,
        "hemicube": HemiCube,
        "octahedral": Octahedral,
        "angular": LightProbe,
        "dual-paraboloid": lambda picture: Hemisphere(picture, projection="dual-paraboloid"),
    }
    return kinds.get(layout, LatLong)(path)


def bump_in(path: Path, kind: str, *, width: float) -> Bump | NormalMap:
    """Heights or normals as a bump whose tile is `width` wide, in world units."""
    if kind == NORMALS:
        return NormalMap(path)
    from glbump.maps.rows import open_heights

    with open_heights(path, None) as heights:
        # Whole numbers span 0..1; floats are lengths in who knows what unit.
        span = 1.0 if heights.full != 1 else float(np.ptp(heights.read(0, heights.height)))
    return Bump(path, amplitude=STEEP * width / (span or 1.0))


def with_mesh(scene: Scene, path: Path, contents: Contents) -> Scene:
    """A mesh in place of the surfaces, all of it in the picture, from a little above."""
    from glbump.demo.gallery import CHROME

    surface = Surface(MeshFile(path), CHROME)
    box = world_bounds(surface, contents)
    camera = fitted(Camera(eye=(0.35, 0.3, 1.0), fov=40), box, 1.0)
    return replace(scene, surfaces=[surface], camera=camera)


def bounds(scene: Scene, contents: Contents) -> npt.NDArray[np.float64] | None:
    """(2, 3): lowest and highest corner of the box round all surfaces; None where there is none."""
    boxes = np.array([world_bounds(surface, contents) for surface in scene.surfaces]).reshape(-1, 2, 3)
    return np.stack([boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)]) if len(boxes) else None


def _demo_maps(names: list[str]) -> Path:
    """The folder of the demo's maps, with these in it. They are computed once for each version of the package, and
    kept among the user's caches; where there is no writing, for this time alone."""
    import hashlib
    import tempfile

    from glbump import demo

    recipe = hashlib.sha256(b"".join(f.read_bytes() for f in sorted(Path(demo.__file__).parent.glob("*.py"))))
    folder = cache_folder() / f"demo-{recipe.hexdigest()[:12]}"
    missing = [name for name in names if not (folder / name).is_file()]
    try:
        demo.write_maps(folder, missing)
    except (OSError, GlbumpError):
        folder = Path(tempfile.mkdtemp(prefix="glbump-"))
        demo.write_maps(folder, names)
    return folder
