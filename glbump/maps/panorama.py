"""Latitude-longitude pictures: directions <-> texture coordinates, and float64 look-ups.

glbump's lat-long: u = 1/2 + atan2(x, -z) / 2 pi, v = angle from +Y / pi, v down; the centre is -Z, seen from
inside, unmirrored, texel centres at half texels. OpenEXR's lat-long has its centre at +Z and its outermost
samples on the border of the picture; both differences are one scale and one offset of the coordinate.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from glbump.errors import ImageError
from glbump.maps import pyramid
from glbump.maps.cube import bilinear, by_pieces

if TYPE_CHECKING:
    from glbump.maps.images import Picture

F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Panorama:
    """A lat-long picture as a texture.

    pixels: (H, W, 3) float32, linear light, row 0 on top; repeats in u, clamps in v.
    The texture coordinate of a direction is latlong_uv(dir) * uv_scale + uv_offset.
    """

    pixels: F32
    uv_scale: tuple[float, float] = (1.0, 1.0)
    uv_offset: tuple[float, float] = (0.0, 0.0)


def panorama_from_picture(picture: Picture) -> Panorama:
    """The picture as a Panorama; ImageError when it is not 2:1 or its header says it is a cube.

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
        return Panorama(
            np.ascontiguousarray(pixels),
            uv_scale=(1.0, (height - 1) / height),
            # +Z, u = 0 and 1 in glbump, lies half a turn along their picture.
            uv_offset=(0.5 / period - 0.5, 0.5 / height),
        )
    if width != 2 * height:
        raise ImageError(
            f"{picture.name}: a lat-long environment must be twice as wide as high; {got}; "
            'crop or pad it to 2:1, or use kind = "cube" if it holds six faces'
        )
    return Panorama(np.ascontiguousarray(pixels, np.float32))


def latlong_uv(dir: npt.ArrayLike) -> F64:
    """Directions (..., 3), any length, as (..., 2) float64 coordinates u, v in 0..1.

    At the poles atan2(0, 0) counts as 0: u = 1/2. Both angles by atan2, which is exact where acos is not.
    """
    d = np.asarray(dir, np.float64)
    x, y, z = d[..., 0], d[..., 1], d[..., 2]
    across = np.hypot(x, z)
    longitude = np.where(across > 0, np.arctan2(x, -z), 0.0)
    return np.stack([0.5 + longitude / (2 * np.pi), np.arctan2(across, y) / np.pi], axis=-1)


def latlong_dir(uv: npt.ArrayLike) -> F64:
    """The unit direction (..., 3) float64 at coordinates (..., 2); inverse of latlong_uv."""
    t = np.asarray(uv, np.float64)
    longitude, colatitude = (t[..., 0] - 0.5) * (2 * np.pi), t[..., 1] * np.pi
    across = np.sin(colatitude)
    return np.stack([across * np.sin(longitude), np.cos(colatitude), -across * np.cos(longitude)], axis=-1)


def texture_uv(panorama: Panorama, dir: npt.ArrayLike) -> F64:
    """Texture coordinates (..., 2) float64 of directions (..., 3) in this panorama's own pixels."""
    uv = latlong_uv(dir)
    uv *= panorama.uv_scale
    uv += panorama.uv_offset
    return uv


def sample(panorama: Panorama, dir: npt.ArrayLike) -> F64:
    """Radiance (..., 3) float64 in directions (..., 3): bilinear, level 0, repeating in u, clamping in v."""
    height, width = panorama.pixels.shape[:2]
    texels = panorama.pixels.reshape(-1, panorama.pixels.shape[-1])

    def look_up(d: F64) -> F64:
        u, v = texture_uv(panorama, d).T
        x, y = u * width - 0.5, v * height - 0.5
        left, top = np.floor(x), np.floor(y)
        columns = [(left.astype(np.intp) + i) % width for i in (0, 1)]
        rows = [np.clip(top.astype(np.intp) + i, 0, height - 1) * width for i in (0, 1)]
        return bilinear(texels, [row + column for row in rows for column in columns], x - left, y - top)

    return by_pieces(look_up, dir)


def levels(pixels: F32) -> list[F32]:
    """The mip levels that the GL driver is given: `pixels` itself down to 1x1, by box averages."""
    return pyramid.chain(pixels)
