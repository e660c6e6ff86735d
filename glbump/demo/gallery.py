"""What the gallery shows, and writing it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from glbump.camera import Camera
from glbump.demo import bumps, knot, letters, panorama, relief, room
from glbump.environment import (
    BoxBounds,
    Captured,
    Chrome,
    CubeMap,
    Environment,
    Fractal,
    HemiCube,
    Hemisphere,
    LatLong,
    LightProbe,
    Octahedral,
)
from glbump.errors import SceneError, unknown
from glbump.frame import Frame
from glbump.frozen import Frozen
from glbump.maps.convert import convert
from glbump.maps.files import write_atomically, write_display, write_picture
from glbump.maps.layout import (
    CUBE,
    EQUIDISTANT,
    HEMICUBE,
    LATLONG,
    MIRROR_BALL,
    OCTAHEDRAL,
    EnvironmentMap,
    Layout,
)
from glbump.maps.pictured import picture_of
from glbump.quality import Quality, quality_of
from glbump.scene import Bump, Material, NormalMap, Scene, Surface
from glbump.shapes import Cube, MeshFile, Plane, Sphere, Torus, Transform

CHROME = Material(metallic=1, roughness=0)
GOLD = Material(base_color=(1.0, 0.71, 0.29), metallic=1, roughness=0.12)
COPPER = Material(base_color=(0.95, 0.49, 0.32), metallic=1, roughness=0.15)

ROW_CAMERA = Camera(eye=(0, -0.25, 7.0), target=(0, 0.12, 0), fov=19)


class Exhibit(Frozen):
    """One picture of the gallery. scene: made when the folder of its maps is known. panels: rows of what the quality is
    changed by, for a picture that shows the scene as often side by side."""

    name: str
    title: str
    scene: Callable[[Path], Scene]
    size: tuple[int, int] = (640, 640)
    exposure: float = 0.4
    panels: tuple[tuple[dict[str, Any], ...], ...] = (({},),)


def _evening(maps: Path, **options: object) -> LatLong:
    return replace(LatLong(maps / "evening.exr"), **options)  # type: ignore[arg-type]


def _mirror_ball(maps: Path) -> Scene:
    return Scene([Surface(Sphere(), CHROME)], _evening(maps), Camera(eye=(0, 0.25, 3.5), fov=45))


def _normal_lookup(maps: Path) -> Scene:
    return replace(_mirror_ball(maps), environment=_evening(maps, lookup="normal"))


def _brick_ball(maps: Path) -> Scene:
    bump = Bump(maps / "bricks.exr", amplitude=0.045, repeat=(4, 2))
    return Scene([Surface(Sphere(), CHROME, bump)], _evening(maps), Camera(eye=(0, 0.25, 3.5), fov=45))


def _golf_ball(maps: Path) -> Scene:
    material = Material(base_color=(0.86, 0.86, 0.84), roughness=0.25)
    bump = Bump(maps / "dimples.exr", amplitude=0.035, repeat=(3.0, 1.5))
    return Scene([Surface(Sphere(), material, bump)], _evening(maps), Camera(eye=(0, 0.25, 3.5), fov=45))


def _simple(maps: Path) -> Scene:
    surface = Surface(MeshFile(maps / "knot.obj"), CHROME, transform=Transform(rotate=(0, -18, 0)))
    return Scene([surface], camera=Camera(eye=(0, 0.3, 4.0), fov=45))


def _medium(maps: Path) -> Scene:
    turned = Transform(rotate=(58, 0, 14))
    return Scene([Surface(Torus(1.0, 0.42), CHROME, None, turned)], Chrome(), Camera(eye=(0, 0.2, 4.2), fov=45))


def _complex(maps: Path) -> Scene:
    camera = Camera(eye=(0, 0.15, 5.2), target=(0, 0.45, 0), fov=38)
    return Scene([Surface(Sphere(), CHROME)], Fractal(seed=3), camera)


def _brick_torus(maps: Path) -> Scene:
    bump = Bump(maps / "bricks.exr", amplitude=0.024, repeat=(6, 2))
    turned = Transform(rotate=(58, 0, 14))
    return Scene([Surface(Torus(1.0, 0.42), GOLD, bump, turned)], _evening(maps), Camera(eye=(0, 0.2, 3.9), fov=45))


def _quilted_cube(maps: Path) -> Scene:
    bump = NormalMap(maps / "quilt.png", repeat=(1, 1))
    material = Material(base_color=(0.30, 0.42, 0.68), metallic=1, roughness=0.3)
    turned = Transform(rotate=(0, -36, 0), scale=0.8)
    return Scene(
        [Surface(Cube(), material, bump, turned)],
        _evening(maps),
        Camera(eye=(0, 1.35, 3.9), target=(0, 0.12, 0), fov=45),
    )


def _lake(maps: Path) -> Scene:
    water = Material(base_color=(0.006, 0.016, 0.020), roughness=0.0, ior=1.33)
    bump = Bump(maps / "waves.exr", amplitude=0.05, repeat=(14, 14))
    surface = Surface(Plane((60, 60)), water, bump, Transform(translate=(0, -0.55, -22)))
    camera = Camera(eye=(0, 0.15, 4), target=(0, 0.12, -4), fov=42)
    return Scene([surface], _evening(maps), camera)


def _trefoil(maps: Path) -> Scene:
    bump = Bump(maps / "weave.exr", amplitude=0.03, repeat=(5, 0.5))
    surface = Surface(MeshFile(maps / "knot.obj"), COPPER, bump, Transform(rotate=(0, -18, 0)))
    return Scene([surface], _evening(maps), Camera(eye=(0, 0.2, 4.0), fov=45))


def _row(materials: Iterable[Material], spacing: float = 1.12) -> list[Surface]:
    """Balls side by side."""
    row = list(materials)
    return [
        Surface(Sphere(0.5), m, transform=Transform(translate=(spacing * (i - (len(row) - 1) / 2), 0, 0)))
        for i, m in enumerate(row)
    ]


def _metals(maps: Path) -> Scene:
    row = _row(replace(GOLD, roughness=i / 6) for i in range(7))
    return Scene(row, _evening(maps), ROW_CAMERA)


def _dielectrics(maps: Path) -> Scene:
    colours = (
        (0.70, 0.04, 0.03),
        (0.80, 0.33, 0.02),
        (0.55, 0.55, 0.04),
        (0.04, 0.36, 0.10),
        (0.02, 0.22, 0.45),
        (0.10, 0.06, 0.40),
        (0.02, 0.02, 0.02),
    )
    row = _row(Material(base_color=c, roughness=0.6 * (1 - i / 6)) for i, c in enumerate(colours))
    return Scene(row, _evening(maps), ROW_CAMERA)


def _ringed(maps: Path) -> Scene:
    rock = Bump(maps / "stone.exr", amplitude=0.06, repeat=(4, 2))
    planet = Surface(Sphere(0.8), Material(base_color=(0.48, 0.26, 0.16), roughness=0.55), rock)
    ring = Surface(Torus(1.35, 0.09), CHROME, transform=Transform(rotate=(20, 0, -16)))
    return Scene([planet, ring], _evening(maps), Camera(eye=(0, 0.6, 3.9), fov=45))


def _orthographic(maps: Path) -> Scene:
    chrome = replace(CHROME, roughness=0.05)
    leather = NormalMap(maps / "quilt.png", scale=0.7)
    red = Material(base_color=(0.42, 0.03, 0.03), roughness=0.3)
    blue = Material(base_color=(0.05, 0.14, 0.40), roughness=0.2)
    dimpled = Bump(maps / "dimples.exr", amplitude=0.03, repeat=(2.5, 1.25))
    surfaces = [
        Surface(Cube((1.2, 1.2, 1.2)), red, leather, Transform(translate=(-0.92, 0, 0.92))),
        Surface(Sphere(0.66), chrome, transform=Transform(translate=(0.95, 0.06, 1.0))),
        Surface(Sphere(0.66), blue, dimpled, Transform(translate=(-1.0, 0.06, -0.95))),
        Surface(Torus(0.5, 0.2), GOLD, transform=Transform(translate=(0.95, 0, -0.95), rotate=(0, 0, 0))),
    ]
    camera = Camera(eye=(5, 4.2, 5), target=(0, -0.1, 0), projection="orthographic", height=3.9)
    return Scene(surfaces, _evening(maps), camera)


def _axes(maps: Path) -> Scene:
    environment = CubeMap(maps / "axes.png", orientation="inside")
    return Scene([Surface(Sphere(1.3), CHROME)], environment, Camera(eye=(0.9, 0.5, 3.0), target=(0.1, 0.1, 0), fov=95))


def _captured(maps: Path) -> Scene:
    silver, gold, red = (
        replace(CHROME, base_color=c) for c in ((1.0, 1.0, 1.0), (1.0, 0.71, 0.29), (0.85, 0.10, 0.08))
    )
    balls = ((silver, (-0.98, 0.0, -0.15), 0.9), (gold, (0.95, -0.1, 0.1), 0.8), (red, (0.03, -0.62, 0.8), 0.42))
    surfaces = [
        Surface(Sphere(radius), metal, None, Transform(translate=at), Captured(position=at, bounces=3))
        for metal, at, radius in balls
    ]
    return Scene(surfaces, _evening(maps), Camera(eye=(0.2, 0.7, 5.2), target=(0, -0.12, 0), fov=31))


def _knot_in(environment: Environment, maps: Path, material: Material = CHROME) -> Scene:
    surface = Surface(MeshFile(maps / "knot.obj"), material, transform=Transform(rotate=(0, -18, 0)))
    return Scene([surface], environment, Camera(eye=(0, 0.25, 4.0), fov=45))


def _cross(maps: Path) -> Scene:
    return _knot_in(CubeMap(maps / "cross.exr"), maps)


def _hemicube(maps: Path) -> Scene:
    return _knot_in(HemiCube(maps / "dome.exr"), maps)


def _hemisphere(maps: Path) -> Scene:
    sky = Hemisphere(maps / "sky.exr", projection="equidistant", below=(0.02, 0.035, 0.05))
    return _knot_in(sky, maps, replace(GOLD, roughness=0))


def _octahedral(maps: Path) -> Scene:
    return _knot_in(Octahedral(maps / "octahedral.exr"), maps)


def _probe(maps: Path) -> Scene:
    return replace(_mirror_ball(maps), environment=LightProbe(maps / "probe.exr", projection="mirror-ball"))


def _room(maps: Path) -> Scene:
    x, y, z = room.HALF
    walls = BoxBounds((-x, -y, -z), (x, y, z))
    places = ((-1.2, -1.0, -0.9), (0.15, -0.85, 0.3), (1.25, -1.1, -0.3))
    balls = [Surface(Sphere(y + 1.5), CHROME, transform=Transform(translate=(x, y, z))) for x, y, z in places]
    return Scene(
        balls, CubeMap(maps / "room.exr", bounds=walls), Camera(eye=(0.2, 0.1, 3.6), target=(0, -0.6, 0), fov=52)
    )


def _glass(maps: Path) -> Scene:
    glass = Material(roughness=0, ior=1.5, transmission=1)
    return Scene([Surface(Sphere(), glass)], _evening(maps), Camera(eye=(0, 0.25, 3.5), fov=45))


# The lecture's order: looking up, formulas, tables, how tables are made, then bumps.
EXHIBITS = (
    Exhibit("mirror-ball", "A mirror: each pixel is the environment along the reflection vector", _mirror_ball),
    Exhibit("normal-lookup", "The same ball, looked up by its normal instead", _normal_lookup),
    Exhibit("simple", "An environment that is computed: up is blue, down is brown", _simple),
    Exhibit("medium", "Computed: sinusoids between grey and silver make chrome", _medium),
    Exhibit("complex", "Computed: each reflected ray is intersected with a fractal landscape", _complex, (960, 540)),
    Exhibit("axes", "A cube map with its axes written on it, and what a mirror shows of them", _axes, exposure=0.0),
    Exhibit("hemicube", "The upper half of a cube map, in half the memory; below, its mirror image", _hemicube),
    Exhibit("hemisphere", "A fisheye picture of the sky, and one colour below the horizon", _hemisphere),
    Exhibit(
        "octahedral",
        "The sphere unfolded to one square: few texels lost, no texel far from its neighbours",
        _octahedral,
    ),
    Exhibit(
        "captured",
        "Table construction by projection: each ball shows the rest of the scene, in three bounces",
        _captured,
        (960, 600),
    ),
    Exhibit("cross", "A cube map from a cross, as environment packs have them", _cross),
    Exhibit("probe", "The photograph of a mirror ball, on a mirror ball", _probe),
    Exhibit("room", "A room with walls: each ball mirrors the floor it stands on", _room, (960, 600), exposure=0.0),
    Exhibit("glass", "Glass: one refraction, and Fresnel's share of reflection", _glass),
    Exhibit("brick-ball", "Heights of bricks on a chrome ball: the normals are bent, the outline stays", _brick_ball),
    Exhibit("brick-torus", "A ring of gold bricks", _brick_torus),
    Exhibit("quilted-cube", "A normal map on a cube of anodised metal", _quilted_cube),
    Exhibit("trefoil", "A mesh file: a knot of woven copper", _trefoil),
    Exhibit("golf-ball", "Dimples in glossy white lacquer", _golf_ball),
    Exhibit("layers", "Two bumps on one surface: the gradients of detail and base add up", bumps.layers),
    Exhibit(
        "kernels",
        "Few texels, eight gradients: forward, central, half, Sobel; Scharr, 4th order, B-spline, spectral",
        bumps.kernels,
        (1120, 560),
        panels=bumps.KERNELS,
    ),
    Exhibit("terms", "High bumps: the small form, and the full form", bumps.terms, (1120, 560), panels=bumps.TERMS),
    Exhibit(
        "triplanar",
        "No u and v: heights by the place in space, their gradients taken there, and from pixel to pixel",
        bumps.triplanar,
        (1120, 560),
        panels=bumps.READS,
    ),
    Exhibit("ringed-stone", "Two surfaces: rough stone in a chrome ring", _ringed),
    Exhibit("lake", "A bumped plane at a grazing angle: ripples on water", _lake, (960, 540)),
    Exhibit("metals", "Gold, roughness 0 to 1", _metals, (1120, 300)),
    Exhibit("dielectrics", "Lacquer, roughness 0.6 to 0", _dielectrics, (1120, 300)),
    Exhibit("orthographic", "An orthographic camera: parallel edges stay parallel", _orthographic, (720, 540)),
)


def chosen(names: Iterable[str] = ()) -> tuple[Exhibit, ...]:
    """The exhibits of these names; all of them for none. SceneError for a name that is not there."""
    by_name = {exhibit.name: exhibit for exhibit in EXHIBITS}
    for name in names:
        if name not in by_name:
            raise SceneError(unknown("picture of the gallery", name, by_name))
    return tuple(by_name[name] for name in names) or EXHIBITS


@cache
def _evening_map() -> EnvironmentMap:
    return EnvironmentMap(LATLONG, panorama.evening()[None])


def _write_evening(path: Path, layout: Layout, size: int, laid: str) -> None:
    """The evening in another layout, as a picture."""
    environment = convert(_evening_map(), layout, size, "bilinear")
    write_picture(path, picture_of(environment, laid).astype(np.float16))


MAPS: dict[str, Callable[[Path], None]] = {
    "evening.exr": lambda path: write_picture(path, _evening_map().pixels[0].astype(np.float16)),
    "cross.exr": lambda path: _write_evening(path, CUBE, 512, "hcross"),
    "dome.exr": lambda path: _write_evening(path, HEMICUBE, 512, "hemicube-cross"),
    "sky.exr": lambda path: _write_evening(path, EQUIDISTANT, 1024, "equidistant"),
    "octahedral.exr": lambda path: _write_evening(path, OCTAHEDRAL, 1024, "octahedral"),
    "probe.exr": lambda path: _write_evening(path, MIRROR_BALL, 1024, "mirror-ball"),
    "room.exr": lambda path: write_picture(path, picture_of(room.room(), "hcross").astype(np.float16)),
    "bricks.exr": lambda path: write_picture(path, relief.bricks()),
    "coarse.exr": lambda path: write_picture(path, relief.coarse()),
    "dimples.exr": lambda path: write_picture(path, relief.dimples()),
    "waves.exr": lambda path: write_picture(path, relief.waves()),
    "stone.exr": lambda path: write_picture(path, relief.stone()),
    "weave.exr": lambda path: write_picture(path, relief.weave()),
    "quilt.png": lambda path: write_display(path, relief.normals(relief.quilt(), 0.075), srgb=False),
    "axes.png": lambda path: write_picture(path, letters.axes()),
    "knot.obj": lambda path: write_atomically(path, knot.knot().encode()),
}


def maps_of(scene: Scene) -> set[str]:
    """Names of the files that a scene reads."""
    pictures: list[object] = [getattr(scene.environment, "image", None)]
    for surface in scene.surfaces:
        pictures += [bump.height if isinstance(bump, Bump) else bump.normal_map for bump in surface.bumps]
        pictures.append(getattr(surface.shape, "path", None))
    return {picture.name for picture in pictures if isinstance(picture, Path)}


def write_maps(folder: Path, names: Iterable[str] = tuple(MAPS)) -> None:
    """Compute maps of these names and write them into `folder`, which is made where it is missing."""
    folder.mkdir(parents=True, exist_ok=True)
    for name in names:
        MAPS[name](folder / name)


class Draw(Protocol):
    """`Renderer.render`."""

    def __call__(self, scene: Scene, size: tuple[int, int], quality: Quality, /) -> Frame: ...


def _drawn(exhibit: Exhibit, scene: Scene, draw: Draw, quality: Quality) -> Frame:
    """The exhibit's picture, all of its panels."""
    size = exhibit.size[0] // len(exhibit.panels[0]), exhibit.size[1] // len(exhibit.panels)
    rows = [[draw(scene, size, replace(quality, **change)).pixels for change in row] for row in exhibit.panels]
    return Frame(np.concatenate([np.concatenate(row, axis=1) for row in rows]))


def write_gallery(
    folder: Path, exhibits: Iterable[Exhibit], draw: Draw, quality: str | Quality = "balanced"
) -> Iterator[tuple[Path, Exhibit]]:
    """Draw exhibits into `folder` as NAME.png, each also as scenes/NAME.toml with its maps beside it.

    Yields (path of the picture, exhibit) after each. Raises GlbumpError kinds, and OSError where the folder cannot
    be made.
    """
    from glbump.scenefile import save_scene

    scenes = folder / "scenes"
    written: set[str] = set()
    for exhibit in exhibits:
        scene = exhibit.scene(scenes / "maps")
        needed = maps_of(scene) - written
        write_maps(scenes / "maps", sorted(needed))
        written |= needed
        save_scene(scene, scenes / f"{exhibit.name}.toml")
        picture = folder / f"{exhibit.name}.png"
        frame = _drawn(exhibit, scene, draw, quality_of(quality))
        frame.save(picture, tone="filmic", exposure=exhibit.exposure)
        yield picture, exhibit
