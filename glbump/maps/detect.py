"""What environment a picture holds: by its header, then by its shape, then by its content.

What cannot be known is assumed and said, with the word that overrides it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import numpy.typing as npt

from glbump.maps.unfolding import HCROSS, HEMICUBE_COLUMN, HEMICUBE_CROSS, HSTRIP, UNFOLDINGS, VCROSS, VSTRIP, Unfolding

if TYPE_CHECKING:
    from glbump.maps.images import Picture

F32 = npt.NDArray[np.float32]

EMPTY = 0.02
"""What is no part of a picture differs from one colour by at most this share of the picture's brightness, in 19 of 20
texels: JPEG leaves some noise there."""

FOLD = 0.6
"""The halves of an octahedral picture's edges are alike: they differ by at most this share of what unlike places do."""


DISCS = (
    "as light probes have it; no content tells it from the photograph of a mirror ball (mirror-ball) or from a fisheye "
    "picture of the sky (equidistant, equal-area, orthographic)"
)


class Detected(NamedTuple):
    """layout: a name that environment_of takes. orientation: "opengl", "inside", or "auto" where the edges of the faces
    must tell. why: the reason, in words. is_sure: whether nothing was assumed."""

    layout: str
    orientation: str
    why: str
    is_sure: bool


def detect(picture: Picture) -> Detected:
    """How the environment lies in a picture (H, W, C), or six faces (6, N, N, C)."""
    pixels = picture.pixels
    if picture.envmap == "latlong":
        return Detected("lat-long", "inside", "the header says so", True)
    if picture.envmap == "cube":
        return Detected("vstrip", "inside", "the header says it is a cube", True)
    if picture.envmap == "faces":
        return Detected("vstrip", "opengl", "the file says it is a cube", True)
    if pixels.ndim == 4:
        return Detected("faces", "auto", "an array of six faces", True)
    height, width = pixels.shape[:2]
    for unfolding in (HCROSS, VCROSS):
        if unfolding.fits(width, height):
            return _cross(unfolding, pixels)
    for unfolding in (HSTRIP, VSTRIP, HEMICUBE_COLUMN):
        if unfolding.fits(width, height):
            aspect = f"{unfolding.columns}:{unfolding.rows}" if unfolding is not HEMICUBE_COLUMN else "1:3"
            return Detected(unfolding.name, "auto", f"it is {aspect}", True)
    if width == 2 * height or height == 2 * width:
        return _two_squares(pixels)
    if width == height:
        return _square(pixels)
    return Detected("lat-long", "inside", "no other layout has its shape", False)


def candidate(layout: str, width: int, height: int) -> Unfolding | None:
    """The unfolding that has this name and this shape; of a "cube" or a "hemicube" the one that has this shape."""
    fitting = (u for u in UNFOLDINGS.values() if layout in (u.name, u.layout.name) and u.fits(width, height))
    return next(fitting, None)


def holes_are_empty(unfolding: Unfolding, pixels: F32) -> bool:
    """Whether the cells without a face hold nothing."""
    every = _every(pixels)
    holes = unfolding.holes(pixels.shape[0] // unfolding.rows)[every]
    return bool(holes.any()) and _is_empty(pixels[every], holes, ~holes)


def _every(pixels: F32) -> tuple[slice, slice]:
    """So many rows and columns of a picture that its emptiness shows: some 256 each."""
    height, width = pixels.shape[:2]
    return slice(None, None, max(1, height // 256)), slice(None, None, max(1, width // 256))


def _is_empty(pixels: F32, where: npt.NDArray[np.bool_], other: npt.NDArray[np.bool_]) -> bool:
    """Whether the texels `where` are of one colour, and the others are not."""
    there, rest = pixels[where], pixels[other]
    if not len(there) or not len(rest):
        return False
    middle = np.median(there, axis=0)
    most = EMPTY * float(np.quantile(np.abs(rest - middle), 0.9))
    return most > 0 and float(np.quantile(np.abs(there - middle), 0.95)) <= most


def radius(n: int) -> npt.NDArray[np.float64]:
    """(n, n) of each texel's centre from the middle; 1 at the rim of the disc."""
    c = 2 * (np.arange(n) + 0.5) / n - 1
    result: npt.NDArray[np.float64] = np.hypot(c[:, None], c[None, :])
    return result


def is_disc(pixels: F32) -> bool:
    """Whether all of a square picture (N, N, C) outside the disc in it is empty."""
    n = pixels.shape[0]
    every = _every(pixels)
    r = radius(n)[every]
    # Texels that the rim may cut count on neither side.
    return _is_empty(pixels[every], r > 1 + 2 / n, r < 1 - 2 / n)


def _cross(unfolding: Unfolding, pixels: F32) -> Detected:
    which = "horizontal" if unfolding is HCROSS else "vertical"
    empty = holes_are_empty(unfolding, pixels)
    why = f"it is {unfolding.columns}:{unfolding.rows}" + (" with empty corners" if empty else "")
    return Detected(unfolding.name, "inside", f"{why}, a {which} cross", empty)


def _two_squares(pixels: F32) -> Detected:
    n = min(pixels.shape[:2])
    tall = pixels.shape[0] > n
    halves = (pixels[:n], pixels[n:]) if tall else (pixels[:, :n], pixels[:, n:])
    if all(is_disc(half) for half in halves):
        return Detected("dual-paraboloid", "inside", "it holds two discs with empty corners", True)
    if tall:
        return Detected("lat-long", "inside", "it holds no two discs with empty corners", False)
    return Detected("lat-long", "inside", "it is 2:1", True)


def _square(pixels: F32) -> Detected:
    if HEMICUBE_CROSS.fits(*pixels.shape[1::-1]) and holes_are_empty(HEMICUBE_CROSS, pixels):
        return Detected("hemicube-cross", "inside", "it is 1:1 with four empty corners, a box folded open", True)
    if is_disc(pixels):
        return Detected("angular", "inside", f"it is a disc with empty corners, {DISCS}", False)
    if _folds(pixels):
        return Detected("octahedral", "inside", "it is 1:1 and the halves of its edges are alike", True)
    return Detected("lat-long", "inside", "it is 1:1, without empty corners, and the halves of its edges differ", False)


def _folds(pixels: F32) -> bool:
    """Whether the halves of each edge are alike: unlike places a quarter of the edge apart."""
    edges = np.stack([pixels[0], pixels[-1], pixels[:, 0], pixels[:, -1]])
    apart = np.abs(edges - edges[:, ::-1]).mean()
    unlike = np.abs(edges - np.roll(edges, edges.shape[1] // 4, axis=1)).mean()
    return bool(apart <= FOLD * unlike)
