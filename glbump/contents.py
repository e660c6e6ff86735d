"""What a scene's files and arrays hold, as maps: read once, kept while they are in use."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Hashable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from glbump.environment import Captured, Environment, Pictured, Procedural
from glbump.errors import ImageError, LimitError
from glbump.image import ArrayImage, picture_of
from glbump.maps.facefiles import face_files
from glbump.maps.layout import LATLONG, EnvironmentMap
from glbump.maps.light_formats import Fit, fitting
from glbump.maps.moments import Flats, flats
from glbump.mesh import SEGMENTS, Mesh, bounds, steepest_turn, tessellate
from glbump.scene import Bump, NormalMap, Scene
from glbump.shapes import MESHES, MeshData, MeshFile, Shape

if TYPE_CHECKING:
    from glbump.maps.suns import Parted
    from glbump.reference.irradiance import Quadrature

F32 = npt.NDArray[np.float32]

BRIGHTEST = 1e36
"""Most that an environment may reach, its exposure counted in: differences and sums of it stay 32-bit floats."""

TABLE = (256, 128)
"""Width and height of the table of a computed environment: what is gathered from it is smooth."""


def source_key(source: Path | ArrayImage) -> Hashable:
    """What a picture is known by in a cache: the array itself, or the file's path, date and size."""
    if isinstance(source, ArrayImage):
        return _Same(source)
    try:
        stat = source.stat()
    except OSError:
        return source
    return source, stat.st_mtime_ns, stat.st_size


class _Same:
    """Compares by identity, and keeps its object alive so that the identity stays its own."""

    __slots__ = ("it",)

    def __init__(self, it: object) -> None:
        self.it = it

    def __hash__(self) -> int:
        return id(self.it)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Same) and other.it is self.it


def pictures_of(environment: Pictured) -> tuple[Path | ArrayImage, ...]:
    """The files and arrays that an environment is made of: of a folder or a pattern the six faces in it."""
    images = tuple(picture_of(image) for image in environment.images)
    if len(images) == 1 and isinstance(images[0], Path) and environment.layout == "cube":
        return face_files(images[0]) or images
    return images


def environment_key(environment: Environment) -> Hashable:
    """What an environment's texture is known by: rotation, exposure and the like do not change it."""
    if isinstance(environment, Procedural):
        return environment.kind, *environment.arguments().values()
    assert isinstance(environment, Pictured)
    orientation = getattr(environment, "orientation", None)
    return environment.layout, orientation, tuple(source_key(i) for i in pictures_of(environment))


def bump_key(bump: Bump | NormalMap) -> Hashable:
    """What a bump's slopes are known by: amplitude, scale and repeat do not change them."""
    if isinstance(bump, Bump):
        return "heights", source_key(picture_of(bump.height)), bump.channel, bump.border
    return "normals", source_key(picture_of(bump.normal_map)), bump.flip_y


def shape_key(shape: Shape) -> Hashable:
    """What a shape's mesh is known by."""
    return ("mesh", source_key(shape.path)) if isinstance(shape, MeshFile) else shape  # arrays: by identity


def content_keys(scene: Scene) -> Hashable:
    """What all that a scene names is known by: the same again as long as no file of it has changed."""
    surfaces = ((shape_key(s.shape), *map(bump_key, s.bumps)) for s in scene.surfaces)
    environments = (environment_key(e) for e in scene.environments)
    return (*environments, *surfaces)


class Contents:
    """Reads what scenes name, and keeps the last `most` results.

    Raises ImageError or MeshError for files that cannot be read or used.
    """

    def __init__(self, most: int = 32) -> None:
        self._kept: OrderedDict[Hashable, Any] = OrderedDict()
        self._most = most

    def _get(self, key: Hashable, make: Callable[[], Any]) -> Any:
        if key not in self._kept:
            self._kept[key] = make()
            while len(self._kept) > self._most:
                self._kept.popitem(last=False)
        self._kept.move_to_end(key)
        return self._kept[key]

    def forget(self, environment: Environment) -> None:
        """Let go of an environment's picture and all that was made of it."""
        mine = environment_key(environment)
        for key in [key for key in self._kept if key == mine or (isinstance(key, tuple) and mine in key)]:
            del self._kept[key]

    def environment(self, environment: Environment) -> EnvironmentMap:
        """The environment's picture, with the layout and the sample grid its header names.

        A computed environment's is a table, for light that is gathered from all directions.
        """
        result: EnvironmentMap = self._get(environment_key(environment), lambda: _read(environment))
        return result

    def notes(self, scene: Scene) -> list[str]:
        """What was assumed, or found and mended, while the scene's files were read."""
        meshes = (s.shape for s in scene.surfaces if isinstance(s.shape, MESHES))
        pictured = (e for e in scene.environments if isinstance(e, Pictured) and not isinstance(e, Captured))
        found = [f"{shape.name}: {note}" for shape in meshes for note in self.mesh(shape).notes]
        return [*found, *(note for environment in pictured for note in self.environment(environment).notes)]

    def peak(self, environment: Environment) -> float:
        """The largest value in the environment's picture, of either sign, before its exposure; a bound of it where the
        environment is computed."""
        if isinstance(environment, Procedural):
            return max(map(max, environment.colours()))
        result: float = self._get(
            ("peak", environment_key(environment)), lambda: _largest(self.environment(environment).pixels)
        )
        return result

    def brightest(self, environment: Environment) -> float:
        """`peak` times the exposure; LimitError where either is past BRIGHTEST."""
        peak = self.peak(environment)
        bright = peak * 2.0**environment.exposure
        if not max(peak, bright) <= BRIGHTEST:
            raise LimitError(
                f"the environment reaches {max(peak, bright):.3g} at exposure {environment.exposure:g}; "
                f"at most {BRIGHTEST:g}: lower environment.exposure, or scale the picture"
            )
        return bright

    def light_format(self, environment: Environment, wanted: str) -> Fit:
        """The format, of LIGHT_FORMATS, that keeps an environment's texels where `wanted` is asked for. What is
        computed without texels is never divided by a pre-exposure, so its roughness chain is not either."""
        result: Fit = self._get(
            ("light format", environment_key(environment), wanted),
            lambda: fitting(
                wanted,
                self.environment(environment).pixels,
                self.peak(environment),
                scales=not isinstance(environment, Procedural),
            ),
        )
        return result

    def parted(self, environment: Environment) -> Parted:
        """The environment's suns, and its picture without them."""
        from glbump.maps.suns import part

        result: Parted = self._get(
            ("parted", environment_key(environment)), lambda: part(self.environment(environment))
        )
        return result

    def blurred(self, environment: Environment, *, apart: bool) -> EnvironmentMap:
        """What is summed over directions: the environment's picture, or what its suns leave of it."""
        return self.parted(environment).rest if apart else self.environment(environment)

    def irradiance(self, environment: Environment, *, apart: bool = False) -> npt.NDArray[np.float64]:
        """(9, 3) coefficients for sh9_irradiance, before exposure. apart: without the environment's suns."""
        from glbump.maps.diffuse import sh9

        result: npt.NDArray[np.float64] = self._get(
            ("sh9", environment_key(environment), apart), lambda: sh9(self.blurred(environment, apart=apart))
        )
        return result

    def quadrature(self, environment: Environment, *, apart: bool) -> Quadrature:
        """The truth of diffuse light, before exposure. apart: as above."""
        from glbump.reference.irradiance import Quadrature

        result: Quadrature = self._get(
            ("quadrature", environment_key(environment), apart),
            lambda: Quadrature(self.blurred(environment, apart=apart)),
        )
        return result

    def gloss(self, environment: Environment, size: int, samples: int, *, apart: bool = False) -> list[F32]:
        """The roughness chain: (6, n, n, 3) for each level, level i for roughness i / (levels - 1). apart: as above."""
        from glbump.maps.gloss import gloss_chain

        result: list[F32] = self._get(
            ("gloss", environment_key(environment), size, samples, apart),
            lambda: gloss_chain(self.blurred(environment, apart=apart), size, samples),
        )
        return result

    def heights(self, bump: Bump) -> F32:
        """(H, W) float32, row 0 on top: 0..1 is the full range. One that mirrors comes with its mirror images."""
        result: F32 = self._get(bump_key(bump), lambda: _heights(bump))
        return result

    def highest(self, bump: Bump) -> float:
        """The largest of `heights`, of either sign."""
        result: float = self._get(("highest", bump_key(bump)), lambda: _largest(self.heights(bump)))
        return result

    def spline(self, bump: Bump) -> F32:
        """(H, W) float32, row 0 on top: coefficients of the cubic B-spline through the heights."""
        from glbump.maps.bspline import coefficients

        result: F32 = self._get(("spline", bump_key(bump)), lambda: coefficients(self.heights(bump)).astype(np.float32))
        return result

    def slopes(self, bump: Bump | NormalMap, kernel: str = "central") -> F32:
        """(H, W, 2) float32, row 0 on top: slopes of a height of 1 per unit of the map's own u, v (v up), by `kernel`;
        of a normal map, per unit of length along tangent and bitangent."""
        if isinstance(bump, NormalMap):
            result: F32 = self._get(bump_key(bump), lambda: _normal_slopes(bump))
        else:
            result = self._get(("slopes", kernel, bump_key(bump)), lambda: _slopes(bump, self.heights(bump), kernel))
        return result

    def steepest(self, bump: Bump | NormalMap, kernel: str = "central") -> float:
        """The largest of `slopes`, of either sign."""
        result: float = self._get(("steepest", kernel, bump_key(bump)), lambda: _largest(self.slopes(bump, kernel)))
        return result

    def flats(self, bump: Bump | NormalMap, kernel: str = "central") -> Flats:
        """The flat places among `slopes`."""
        result: Flats = self._get(("flats", kernel, bump_key(bump)), lambda: flats(self.slopes(bump, kernel)))
        return result

    def curvature(self, shape: MeshFile | MeshData) -> float:
        """The largest turn of the normal along an edge of the mesh, in radians per unit of its length."""
        result: float = self._get(("curvature", shape_key(shape)), lambda: steepest_turn(self.mesh(shape)))
        return result

    def mesh(self, shape: Shape, segments: int = SEGMENTS[0], *, normal_map: bool = False) -> Mesh:
        """The shape's triangles; a mesh file's are its own, whatever the segments. normal_map: with the axes of normal
        maps for dp/du and dp/dv, which on other shapes are the same."""
        if normal_map and isinstance(shape, MESHES):
            from glbump.mikktspace import normal_mapped

            mapped: Mesh = self._get(("axes", shape_key(shape)), lambda: normal_mapped(self.mesh(shape)))
            return mapped
        key = ("mesh", shape_key(shape), None if isinstance(shape, MESHES) else segments)
        result: Mesh = self._get(key, lambda: tessellate(shape, segments))
        return result

    def bounds(self, shape: Shape) -> npt.NDArray[np.float64]:
        """(2, 3): lowest and highest corner of the box round the shape, in its own space."""
        result: npt.NDArray[np.float64] = self._get(
            ("bounds", shape_key(shape)), lambda: bounds(self.mesh(shape) if isinstance(shape, MESHES) else shape)
        )
        return result

    def frame(self, shape: Shape) -> tuple[npt.NDArray[np.float64], float]:
        """Origin (3,) and unit, in the shape's own space, of the coordinates that the GPU has of it.

        In 32-bit floats a quad 1e7 from its origin moves by whole units, and the products of one 1e6 wide overflow:
        coordinates are counted from the middle of the shape's box, in some half of its width. A power of two, so
        that a shape about its origin loses nothing.
        """
        result: tuple[npt.NDArray[np.float64], float] = self._get(
            ("frame", shape_key(shape)), lambda: _frame(*self.bounds(shape))
        )
        return result


def _frame(low: npt.NDArray[np.float64], high: npt.NDArray[np.float64]) -> tuple[npt.NDArray[np.float64], float]:
    return (low + high) / 2, 2.0 ** float(np.rint(np.log2((high - low).max() / 2)))


def _largest(values: F32) -> float:
    return max(float(values.max()), -float(values.min()))


def _read(environment: Environment) -> EnvironmentMap:
    if isinstance(environment, Procedural):
        from glbump.reference.computed import table

        return EnvironmentMap(LATLONG, table(environment, TABLE).astype(np.float32)[None])
    from glbump.maps.images import read_environment
    from glbump.maps.pictured import environment_of

    assert isinstance(environment, Pictured)
    images = pictures_of(environment)
    result = environment_of(
        [read_environment(image) for image in images], environment.layout, getattr(environment, "orientation", "auto")
    )
    if len(images) == len(environment.images):
        return result
    names = ", ".join(image.name for image in images if isinstance(image, Path))
    return replace(result, notes=(f"{environment.images[0]}: its faces +X -X +Y -Y +Z -Z are {names}", *result.notes))


def _heights(bump: Bump) -> F32:
    from glbump.maps.images import read_height

    heights = read_height(picture_of(bump.height), bump.channel).pixels[..., 0]
    if bump.border == "mirror":
        heights = np.concatenate([heights, heights[:, ::-1]], axis=1)
        # Of what is below the picture's last row, v going up.
        heights = np.concatenate([heights[::-1], heights], axis=0)
    return heights


def _slopes(bump: Bump, heights: F32, kernel: str) -> F32:
    from glbump.maps.heights import slopes

    # What mirrors is in the map already.
    border = "clamp" if bump.border == "clamp" else "wrap"
    try:
        return slopes(heights, "central" if kernel == "half" else kernel, border)
    except ImageError as why:
        raise ImageError(f"{_name(bump.height)}: {why}") from None


def _normal_slopes(bump: NormalMap) -> F32:
    from glbump.maps.heights import slopes_of_normals
    from glbump.maps.images import read_normals

    picture = read_normals(picture_of(bump.normal_map))
    try:
        return slopes_of_normals(picture.pixels, bump.flip_y)
    except ImageError as why:
        raise ImageError(f"{picture.name}: {why}") from None


def _name(image: Any) -> str:
    return str(image) if isinstance(image, Path) else "the array"
