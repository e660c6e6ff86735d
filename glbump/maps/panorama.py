"""Pictures as environments: lat-long pictures and cubes, as their shape or their OpenEXR header says.

OpenEXR's lat-long has its centre at +Z and its outermost samples on the border of the picture; both differences are one
scale and one offset of the coordinate. Its cubes have their outermost samples on the border of each face.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from glbump.errors import ImageError, unknown
from glbump.maps.cube import FACES
from glbump.maps.layout import CUBE, LATLONG, EnvironmentMap, on_border

if TYPE_CHECKING:
    from glbump.maps.images import Picture

F32 = npt.NDArray[np.float32]


def panorama_from_picture(picture: Picture) -> EnvironmentMap:
    """The picture as an EnvironmentMap; ImageError when it is not 2:1 or its header says it is a cube.

    With OpenEXR's header `envmap = latlong`, W samples span the W - 1 steps from longitude +pi to -pi, so the
    first and the last column are one: their mean is kept once (files differ there by rounding only), and the
    rest is a texture of W - 1 columns that repeats. H samples span the H - 1 steps from pole to pole.
    """
    pixels = picture.pixels
    height, width = pixels.shape[:2]
    got = f"got {width}x{height}"
    if picture.envmap == "cube":
        raise ImageError(f'{picture.name}: the header says it is a cube map, not a lat-long picture; use kind = "cube"')
    if picture.envmap == "latlong":
        # Some writers make 2N + 1 columns and N + 1 rows, so that steps in u and v are equal.
        if height < 2 or width not in (2 * height, 2 * height - 1):
            raise ImageError(
                f"{picture.name}: the header says lat-long, which is twice as wide as high, at least 4x2; "
                f"{got}; write it again as 2:1, or without the envmap attribute"
            )
        seam = 0.5 * (pixels[:, :1].astype(np.float64) + pixels[:, -1:])
        pixels = np.concatenate([seam.astype(np.float32), pixels[:, 1:-1]], axis=1)
        period = width - 1
        return EnvironmentMap(
            LATLONG,
            np.ascontiguousarray(pixels)[None],
            scale=(1.0, (height - 1) / height),
            # +Z, u = 0 and 1 in glbump, lies half a turn along their picture.
            offset=(0.5 / period - 0.5, 0.5 / height),
        )
    if width != 2 * height:
        raise ImageError(
            f"{picture.name}: a lat-long environment must be twice as wide as high; {got}; "
            'crop or pad it to 2:1, or use kind = "cube" if it holds six faces'
        )
    return EnvironmentMap(LATLONG, np.ascontiguousarray(pixels, np.float32)[None])


def cube_from_picture(picture: Picture | Sequence[Picture], orientation: str = "opengl") -> EnvironmentMap:
    """Six square pictures, one column of six faces, or a picture that is an array (6, N, N, 3), as an EnvironmentMap.

    orientation: "opengl", or "inside" for pictures of what one sees from inside, as OpenEXR lays its cubes; a
    picture whose header says `envmap = cube` decides by itself. ImageError for any other layout.
    """
    if isinstance(picture, Sequence):
        return _cube_from_six(picture, orientation)
    pixels, name = picture.pixels, picture.name
    shape = pixels.shape
    if picture.envmap == "latlong":
        raise ImageError(f'{name}: the header says it is a lat-long picture, not a cube; use kind = "lat-long"')
    if len(shape) == 3 and shape[0] == 6 * shape[1]:
        pixels = pixels.reshape(6, shape[1], shape[1], shape[2])
    if pixels.shape != (6, pixels.shape[1], pixels.shape[1], 3):
        got = f"{shape[1]}x{shape[0]}" if len(shape) == 3 else "an array " + " x ".join(map(str, shape))
        raise ImageError(
            f"{name}: a cube map in one picture must be a column of six square faces, {' '.join(FACES)} from "
            f"the top, so six times as high as wide, or an array 6 x N x N x 3; got {got}; "
            "give one of these, or six pictures"
        )
    border = picture.envmap == "cube"
    if border and pixels.shape[1] < 2:
        raise ImageError(f"{name}: an OpenEXR cube must have faces of at least 2x2 samples; got 1x1")
    faces = _oriented(pixels, "inside" if border else orientation)
    return EnvironmentMap(CUBE, faces, *on_border((faces.shape[1],) * 2)) if border else EnvironmentMap(CUBE, faces)


def _cube_from_six(pictures: Sequence[Picture], orientation: str) -> EnvironmentMap:
    if len(pictures) != 6:
        raise ImageError(f"a cube map needs six pictures, {' '.join(FACES)}; got {len(pictures)}")
    first = pictures[0]
    for face, picture in zip(FACES, pictures, strict=True):
        height, width = picture.pixels.shape[:2]
        if height != width:
            raise ImageError(f"{picture.name}: face {face} of a cube map must be square; got {width}x{height}; crop it")
        if picture.pixels.shape != first.pixels.shape:
            raise ImageError(
                f"{picture.name}: face {face} is {width}x{width} but face +X, {first.name}, is "
                f"{first.pixels.shape[1]}x{first.pixels.shape[0]}; all six must have one size"
            )
    return EnvironmentMap(CUBE, _oriented(np.stack([picture.pixels for picture in pictures]), orientation))


def _oriented(faces: npt.NDArray[Any], orientation: str) -> F32:
    """Faces as the OpenGL table has them; seen from inside, sides are mirrored in s, top and bottom in t."""
    if orientation == "inside":
        faces = np.stack([face[::-1] if 2 <= i < 4 else face[:, ::-1] for i, face in enumerate(faces)])
    elif orientation != "opengl":
        raise ImageError(unknown("orientation of cube faces", orientation, ("opengl", "inside")))
    return np.ascontiguousarray(faces, np.float32)
