"""Pictures as environments, and environments as pictures: the one place where a layout of files becomes a map.

OpenEXR's lat-long has its centre at +Z and its outermost samples on the border of the picture; both differences are one
scale and one offset of the coordinate. Its cubes have their outermost samples on the border of each face.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from glbump.errors import ImageError, unknown
from glbump.maps import detect
from glbump.maps.images import Picture, require_opaque
from glbump.maps.layout import (
    CUBE,
    HEMICUBE,
    LATLONG,
    LAYOUTS,
    PARABOLOID,
    EnvironmentMap,
    Layout,
    completed,
)
from glbump.maps.unfolding import ORIENTATIONS, UNFOLDINGS, Unfolding, oriented

F32 = npt.NDArray[np.float32]

LAYOUT_NAMES = ("auto", *LAYOUTS, *UNFOLDINGS, "faces")
"""What environment_of may be told: "cube" and "hemicube" are any picture of one, by its shape."""

READINGS = ("auto", *ORIENTATIONS)


def environment_of(
    pictures: Picture | Sequence[Picture], layout: str = "auto", orientation: str = "auto"
) -> EnvironmentMap:
    """One picture, the six of a cube or the five of a hemicube, as an environment.

    pictures: (H, W, 3), or (6, N, N, 3) as cube files hold them. Six are taken in the order +X -X +Y -Y +Z -Z or, where
    all their names name faces (glbump.maps.facefiles.STYLES), by their names; layout "faces" keeps the order given.
    Five are the top and the half sides +X -X +Z -Z.
    layout: "auto" (glbump.maps.detect), or one of LAYOUT_NAMES. orientation: "opengl", "inside", or "auto": crosses and
    files named front, back, ... are seen from inside, their front at -Z; of strips and other faces the edges tell.
    A header that says `envmap` decides by itself. All that was assumed is in the result's notes.
    Raises ImageError for pictures of another shape.
    """
    if layout not in LAYOUT_NAMES:
        raise ImageError(unknown("layout", layout, LAYOUT_NAMES))
    _require_reading(orientation)
    if isinstance(pictures, Sequence):
        if len(pictures) != 1:
            from glbump.maps.faces import of_several  # a panorama needs none of it

            return of_several(pictures, layout, orientation)
        (pictures,) = pictures
    if layout == "auto":
        return _detected(pictures, orientation)
    _require_header(pictures, layout)
    if layout == "lat-long":
        return _latlong(pictures)
    if layout in ("cube", "hemicube", "faces", *UNFOLDINGS):
        from glbump.maps.faces import of_one_cube  # a panorama needs none of it

        return of_one_cube(pictures, layout, orientation)
    return _plain(pictures, LAYOUTS[layout])


def _detected(picture: Picture, orientation: str) -> EnvironmentMap:
    found = detect.detect(picture)
    environment = environment_of(picture, found.layout, orientation)
    if found.is_sure:
        return environment
    note = f"{picture.name}: taken as {found.layout}: {found.why}; say which layout if it is another"
    return replace(environment, notes=(note, *environment.notes))


def _require_reading(orientation: str) -> None:
    if orientation not in READINGS:
        raise ImageError(unknown("orientation of cube faces", orientation, READINGS))


def _require_header(picture: Picture, layout: str) -> None:
    """ImageError where the header says that it is something else."""
    if picture.envmap is None:
        return
    is_cube = picture.envmap != "latlong"
    if layout not in (("cube", "faces", *UNFOLDINGS) if is_cube else ("lat-long",)):
        says, kind = ("a cube map", "cube") if is_cube else ("a lat-long picture", "lat-long")
        wanted = {"lat-long": "a lat-long picture", "cube": "a cube"}.get(layout, layout)
        raise ImageError(f'{picture.name}: the header says it is {says}, not {wanted}; use kind = "{kind}"')


# ------------------------------------------------------------ one picture, one tile or two


def _latlong(picture: Picture) -> EnvironmentMap:
    """A lat-long picture. Where it is not 2:1, what is assumed is noted.

    With OpenEXR's header `envmap = latlong`, W samples span the W - 1 steps from longitude +pi to -pi, so the
    first and the last column are one: their mean is kept once (files differ there by rounding only), and the
    rest is a texture of W - 1 columns that repeats. H samples span the H - 1 steps from pole to pole.
    """
    pixels, name = picture.pixels, picture.name
    height, width = pixels.shape[:2]
    if picture.clear is not None:
        require_opaque(name, picture.clear)
    if picture.envmap == "latlong":
        # Some writers make 2N + 1 columns and N + 1 rows, so that steps in u and v are equal.
        if height < 2 or width not in (2 * height, 2 * height - 1):
            raise ImageError(
                f"{name}: the header says lat-long, which is twice as wide as high, at least 4x2; "
                f"got {width}x{height}; write it again as 2:1, or without the envmap attribute"
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
    whole = EnvironmentMap(LATLONG, np.ascontiguousarray(pixels, np.float32)[None])
    if width == 2 * height:
        return whole
    got = f"{name}: a lat-long picture is twice as wide as high; got {width}x{height}: "
    looks = detect.detect(picture).layout
    hint = "" if looks == "lat-long" else f"; its shape is that of layout {looks}"
    if width < 2 * height:
        return replace(whole, notes=(f"{got}stretched over the whole sphere{hint}",))
    scale = width / (2 * height)
    assumed = (
        f"taken as 360 degrees wide and {360 * height / width:.3g} high about the horizon, its first and last row "
        "going on to the poles; pad it to 2:1 if the horizon is elsewhere"
    )
    return replace(whole, scale=(1.0, scale), offset=(0.0, 0.5 - 0.5 * scale), notes=(got + assumed + hint,))


def _plain(picture: Picture, layout: Layout) -> EnvironmentMap:
    """A square picture, or the two discs of a dual paraboloid, side by side or one above the other."""
    shape = picture.pixels.shape[:2]
    beside = layout is PARABOLOID and shape[1] == 2 * shape[0]
    if not beside and shape[0] != layout.tiles * shape[1]:
        allowed = "two discs, side by side or one above the other, so 2:1 or 1:2" if layout is PARABOLOID else "square"
        raise ImageError(
            f"{picture.name}: a picture of layout {layout.name} must be {allowed}; got {shape[1]}x{shape[0]}; crop it"
        )

    axis, size = 1 if beside else 0, min(shape)
    if picture.clear is not None:
        # What the rim cuts may be half transparent.
        part = detect.radius(size) < (1 - 2 / size if layout.disc else np.inf)
        require_opaque(picture.name, picture.clear & np.concatenate([part] * layout.tiles, axis=axis))
    tiles = np.stack(np.split(picture.pixels, layout.tiles, axis=axis))
    return EnvironmentMap(layout, completed(layout, np.ascontiguousarray(tiles, np.float32)))


# ------------------------------------------------------------ environments as pictures


def picture_of(environment: EnvironmentMap, layout: str, orientation: str = "auto") -> F32:
    """The environment's texels as a picture (H, W, 3), as `layout` lays them out; "faces" and "cube" (6, N, N, 3).

    layout: the environment's own, or, of a cube and a hemicube, one of UNFOLDINGS or "faces": nothing is resampled.
    orientation: of cubes; "auto" is "inside" for crosses, else "opengl". environment_of reads it back. A dual
    paraboloid is two discs side by side. ImageError where the environment has another layout, or samples on the border.
    """
    _require_reading(orientation)
    own, tiles = environment.layout, environment.pixels
    unfolding = _unfolding_of(own, layout)
    if unfolding is None and layout != own.name and not (own is CUBE and layout == "faces"):
        raise ImageError(f"an environment of layout {own.name} is no picture of layout {layout}; convert it first")
    if environment.has_own_grid:
        raise ImageError(f"an environment with samples on its border is no plain {layout} picture; convert it first")
    if unfolding is not None:
        return unfolding.write(tiles, unfolding.orientation if orientation == "auto" else orientation)
    if own is CUBE:
        return oriented(CUBE, tiles, "opengl" if orientation == "auto" else orientation)
    return np.concatenate(list(tiles), axis=1)


def _unfolding_of(own: Layout, layout: str) -> Unfolding | None:
    if own is HEMICUBE and layout == "hemicube":
        return UNFOLDINGS["hemicube-column"]
    unfolding = UNFOLDINGS.get(layout)
    return unfolding if unfolding and unfolding.layout is own else None
