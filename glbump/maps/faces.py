"""Cubes and hemicubes from pictures: one picture that holds them unfolded, six faces, or the top and four sides."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from glbump.errors import ImageError
from glbump.maps.continuity import edge_steps, orientation_steps, turned_faces
from glbump.maps.cube import FACES
from glbump.maps.detect import candidate, holes_are_empty
from glbump.maps.facefiles import STYLES, WORDS, faces_by_name
from glbump.maps.images import Picture, require_opaque
from glbump.maps.layout import CUBE, HEMICUBE, EnvironmentMap, Layout, on_border
from glbump.maps.unfolding import UNFOLDINGS, VSTRIP, oriented, parts_of, tiles_of

F32 = npt.NDArray[np.float32]

CLEAR = 0.6
"""The edges tell the orientation where the steps across them in one are at most this share of those in the other."""

SCATTERED = 4.0
"""Faces whose edges differ on average by more than this, times the differences beside them, may be no cube."""

HEMICUBE_FACES = ("top", "+X", "-X", "+Z", "-Z")


def of_one_cube(picture: Picture, layout: str, orientation: str) -> EnvironmentMap:
    """The cube or hemicube in a picture, (H, W, 3) or (6, N, N, 3). layout: "cube", "hemicube", "faces", or one of
    UNFOLDINGS. orientation: "opengl", "inside" or "auto"."""
    pixels, name = picture.pixels, picture.name
    if pixels.shape == (6, *pixels.shape[1:2] * 2, 3) and layout in ("cube", "faces"):
        return _checked(CUBE, pixels, orientation, [name] * 6)
    height, width = pixels.shape[:2]
    unfolding = candidate(layout, width, height) if pixels.ndim == 3 else None
    if unfolding is None or (picture.envmap == "cube" and unfolding is not VSTRIP):
        got = f"{width}x{height}" if pixels.ndim == 3 else f"an array {' x '.join(map(str, pixels.shape))}"
        raise ImageError(f"{name}: {_shapes(layout)}; got {got}; give one of these, or {_files(layout)}")
    if picture.clear is not None:
        require_opaque(name, picture.clear & ~unfolding.holes(height // unfolding.rows))
    if picture.envmap == "cube":
        if width < 2:
            raise ImageError(f"{name}: an OpenEXR cube must have faces of at least 2x2 samples; got 1x1")
        faces = oriented(CUBE, unfolding.read(pixels, "opengl"), "inside")
        return EnvironmentMap(CUBE, faces, *on_border((width, width)))
    if picture.envmap == "faces" and orientation == "auto":
        orientation = "opengl"
    if not unfolding.has_front:
        return _checked(unfolding.layout, unfolding.read(pixels, "opengl"), orientation, [name] * 6)
    notes = []
    if unfolding.holes(1).any() and not holes_are_empty(unfolding, pixels):
        notes.append(f"{name}: the corners of this {unfolding.name} are not empty; what they hold is not used")
    if orientation == "auto":
        orientation = unfolding.orientation
        notes.append(_front_note(name))
    tiles = unfolding.read(pixels, orientation)
    return EnvironmentMap(unfolding.layout, tiles, notes=(*notes, *_fault_notes(tiles, orientation, [name] * 6)))


def _front_note(name: str) -> str:
    return f'{name}: taken as seen from inside, its front at -Z; orientation = "opengl" puts it at +Z and mirrors all'


def _shapes(layout: str) -> str:
    if layout in UNFOLDINGS:
        u = UNFOLDINGS[layout]
        return f"a {layout} must be {u.columns}:{u.rows}, in whole cells"
    if layout == "hemicube":
        return "a hemicube in one picture must be a column N x 3N of the top and four half sides, or a cross 2N x 2N"
    return (
        f"a cube map in one picture must be a column of six square faces, {' '.join(FACES)} from "
        "the top, so six times as high as wide, or a row of them, or a cross, 4:3 or 3:4, or an array 6 x N x N x 3"
    )


def _files(layout: str) -> str:
    return "five pictures" if layout.startswith("hemicube") else "six pictures"


def _checked(layout: Layout, tiles: npt.NDArray[Any], orientation: str, names: Sequence[str]) -> EnvironmentMap:
    """Tiles that are known by their axes, in the orientation given, or the one in which their edges meet."""
    tiles, notes = np.ascontiguousarray(tiles, np.float32), []
    if orientation == "auto":
        orientation, note = _orientation_by_edges(layout, tiles)
        notes += [f"{names[0]}: {note}"] * bool(note)
    tiles = oriented(layout, tiles, orientation)
    return EnvironmentMap(layout, tiles, notes=(*notes, *_fault_notes(tiles, orientation, names)))


def _whole_cube(layout: Layout, tiles: F32) -> F32:
    """The tiles as six faces, the upper half of a hemicube mirrored below."""
    if layout is CUBE:
        return tiles
    *sides, top = parts_of(layout, tiles)
    both = [np.concatenate([side, side[::-1]]) for side in sides]
    return np.stack([*both[:2], top, top[::-1], *both[2:]])


def _orientation_by_edges(layout: Layout, tiles: F32) -> tuple[str, str]:
    """The orientation in which the edges meet, and what to say about it."""
    if tiles.shape[2] < 2:
        return "opengl", ""
    opengl, inside = orientation_steps(_whole_cube(layout, tiles))
    if inside < CLEAR * opengl:
        return "inside", "its faces are as seen from inside, since so their edges meet"
    if opengl > CLEAR * inside:
        return "opengl", 'the edges of its faces do not tell the orientation; taken as "opengl", or say "inside"'
    return "opengl", ""


def _fault_notes(tiles: F32, orientation: str, names: Sequence[str]) -> list[str]:
    """What the edges of a cube's faces say against them. names: of each face's file."""
    if len(tiles) != len(FACES) or tiles.shape[1] != tiles.shape[2] or tiles.shape[1] < 2:
        return []
    faults, notes = turned_faces(EnvironmentMap(CUBE, tiles)), []
    for fault in faults:
        name = names[FACES.index(fault.faces[0])]
        other = "inside" if orientation == "opengl" else "opengl"
        mend = f'; orientation = "{other}" mends it' if len(fault.faces) == len(FACES) else ""
        notes.append(
            f"{name}: it seems that {fault}: the steps across the edges are {fault.before:.2g} times those inside, and "
            f"would be {fault.after:.2g}{mend}"
        )
    if not faults and (apart := float(np.mean(list(edge_steps(tiles).values())))) > SCATTERED:
        notes.append(
            f"{names[0]}: the edges of its faces do not meet (steps of {apart:.2g} times those inside); is it a cube?"
        )
    return notes


def of_several(pictures: Sequence[Picture], layout: str, orientation: str) -> EnvironmentMap:
    """The cube of six pictures, or the hemicube of five."""
    for picture in pictures:
        if picture.clear is not None:
            require_opaque(picture.name, picture.clear)
    if layout == "hemicube" or (layout == "auto" and len(pictures) == 5 and _are_halves(pictures)):
        return _of_five(pictures, orientation)
    if layout not in ("auto", "cube", "faces"):
        raise ImageError(f"a picture of layout {layout} is one picture; got {len(pictures)}")
    names = [picture.name for picture in pictures]
    style = next((style for style in STYLES if faces_by_name(names, style)), None)
    order = faces_by_name(names, style) if style else None
    if len(pictures) != 6:
        missing = f"; {' '.join(FACES[face] for face in range(6) if face not in order)} is missing" if order else ""
        raise ImageError(f"a cube map needs six pictures, {' '.join(FACES)}; got {len(pictures)}{missing}")
    notes: list[str] = []
    if order and layout != "faces":
        ordered = [pictures[order[face]] for face in range(6)]
        if any(a is not b for a, b in zip(ordered, pictures)):
            notes.append(f"{names[0]} and others: put in order by their names")
        pictures = ordered
    _require_alike(pictures)
    if style is WORDS and layout != "faces":
        # The orientation says where the front is.
        if orientation == "auto":
            orientation = "inside"
            notes.append(_front_note(pictures[0].name))
        if orientation == "inside":
            pictures = [*pictures[:4], pictures[5], pictures[4]]
    faces = np.stack([picture.pixels for picture in pictures])
    environment = _checked(CUBE, faces, orientation, [picture.name for picture in pictures])
    return replace(environment, notes=(*notes, *environment.notes))


def _require_alike(pictures: Sequence[Picture]) -> None:
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


def _are_halves(pictures: Sequence[Picture]) -> bool:
    shapes = [picture.pixels.shape for picture in pictures[1:]]
    return all(shape[1] == 2 * shape[0] for shape in shapes)


def _of_five(pictures: Sequence[Picture], orientation: str) -> EnvironmentMap:
    """The top and the sides +X -X +Z -Z, each the upper half, or whole, of which the lower half is not used."""
    if len(pictures) != 5:
        raise ImageError(f"a hemicube needs five pictures, {' '.join(HEMICUBE_FACES)}; got {len(pictures)}")
    n = pictures[0].pixels.shape[1]
    parts, notes = [], []
    for face, picture in zip(HEMICUBE_FACES, pictures, strict=True):
        height, width = picture.pixels.shape[:2]
        if width != n or height not in ((n,) if face == "top" else (n, n // 2)) or n % 2:
            raise ImageError(
                f"{picture.name}: of a hemicube the top must be N x N, N even, and the sides N x N/2 or N x N; "
                f"got {width}x{height} for {face}, and a top {n} wide"
            )
        if face != "top" and height == n:
            notes.append(f"{picture.name}: of side {face} the upper half is used")
        parts.append(picture.pixels if face == "top" else picture.pixels[: n // 2])
    environment = _checked(HEMICUBE, tiles_of(HEMICUBE, [*parts[1:], parts[0]]), orientation, [pictures[0].name])
    return replace(environment, notes=(*notes, *environment.notes))
