"""Environments from files to files: read, converted, written in another layout (`glbump convert`)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from glbump.errors import ImageError, unknown
from glbump.maps.containers import TEXTURE_SUFFIXES, texture_from_light, write_texture
from glbump.maps.convert import Filter, clamped, convert, texels_per_steradian
from glbump.maps.detect import detect
from glbump.maps.facefiles import STYLES, face_files
from glbump.maps.files import DISPLAY_SUFFIXES, LINEAR_SUFFIXES, check_target, check_writable, write_picture
from glbump.maps.images import read_colour
from glbump.maps.layout import CUBE, HEMICUBE, LAYOUTS, EnvironmentMap, Layout, inside
from glbump.maps.levels import environment_levels
from glbump.maps.overlap import Grid
from glbump.maps.pictured import environment_of, picture_of
from glbump.maps.stored import require_size

TARGETS = {
    "cube": "vstrip",
    **{name: name for name in ("hcross", "vcross", "hstrip", "vstrip", "faces")},
    **{name: name for name in ("lat-long", "hemicube", "hemisphere", "octahedral", "angular", "mirror-ball")},
}
"""What an environment may be converted to: name -> the layout of its picture, as picture_of takes it."""

PROJECTIONS = ("equal-area", "equidistant", "orthographic", "dual-paraboloid")
"""Of a hemisphere; the last, two discs, shows the whole sphere."""

FACE_NAMES = STYLES[1]

SUFFIXES = LINEAR_SUFFIXES + TEXTURE_SUFFIXES + DISPLAY_SUFFIXES


@dataclass(frozen=True, eq=False)
class Source:
    """An environment, and whether 32 bits a value are needed to hold what its files held."""

    environment: EnvironmentMap
    is_wide: bool


def input_files(files: Sequence[Path]) -> tuple[Path, ...]:
    """The files, or the six faces that a folder or a pattern "NAME_{face}.png" stands for."""
    return (face_files(files[0]) if len(files) == 1 else None) or tuple(files)


def read_environment(files: Sequence[Path], layout: str = "auto", orientation: str = "auto") -> Source:
    """One picture, or the six faces of a cube or five of a hemicube.

    layout, orientation: as environment_of takes them. How it was read is in the environment's notes.
    """
    pictures = [read_colour(file) for file in files]
    environment = environment_of(pictures, layout, orientation)
    notes = environment.notes
    if len(pictures) == 1 and layout == "auto" and (found := detect(pictures[0])).is_sure:
        notes = (f"{files[0]}: read as {found.layout}, as {found.why}", *notes)
    if orientation != "auto" and environment.layout.name not in ("cube", "hemicube"):
        raise ImageError(f"{files[0]}: is read as {environment.layout.name}; an orientation is of cubes: leave it out")
    is_wide = any(picture.is_float and picture.bits > 16 for picture in pictures)
    return Source(replace(environment, notes=notes), is_wide)


def target_layout(to: str, projection: str) -> Layout:
    """The layout that one of TARGETS is."""
    if to not in TARGETS:
        raise ImageError(unknown("layout", to, TARGETS))
    if projection not in PROJECTIONS:
        raise ImageError(unknown("projection of a hemisphere", projection, PROJECTIONS))
    return LAYOUTS[projection] if to == "hemisphere" else LAYOUTS.get(to, CUBE)


def same_detail(environment: EnvironmentMap, layout: Layout) -> int:
    """The size, as `convert` takes it, that keeps the number of texels along 90 degrees."""
    per_quarter = environment.size[1] * 90 / environment.layout.span
    if layout is HEMICUBE:
        return max(4, 2 * round(per_quarter / 2))
    return max(2, round(per_quarter * layout.span / 90))


def same_or_converted(
    environment: EnvironmentMap, layout: Layout, size: int, filter: Filter | None = None, clamp: float | None = None
) -> tuple[EnvironmentMap, str]:
    """The environment in another layout, and how: "area", "bilinear", or "as it is" where its texels already lie so."""
    if layout is HEMICUBE and (size % 2 or size < 4):
        raise ImageError(f"the side of a hemicube must be even and at least 4, since its sides are halves; got {size}")
    _, height, width = layout.shape(size)
    if environment.layout is layout and environment.size == (width, height) and not environment.has_own_grid:
        return environment if clamp is None else clamped(environment, clamp), "as it is"
    require_size(f"{layout.name} of size {size}", width, height * layout.tiles, 3)
    if filter is None:
        shrinks = texels_per_steradian(Grid.of(environment)) > texels_per_steradian(Grid.by_size(layout, size))
        filter = "area" if shrinks else "bilinear"
    return convert(environment, layout, size, filter, clamp=clamp), filter


def half_notes(before: EnvironmentMap, after: EnvironmentMap) -> list[str]:
    """What became of the half below the horizon where only one of two layouts shows it."""
    if before.layout.whole and not after.layout.whole:
        return [f"{after.layout.name} shows the upper half alone; what lay below the horizon is left out"]
    if after.layout.whole and not before.layout.whole:
        return [f"{before.layout.name} shows the upper half alone; below the horizon it is mirrored"]
    return []


def written_files(path: Path, to: str) -> tuple[Path, ...]:
    """The files that an environment is written to: of "faces" NAME_px, _nx, _py, _ny, _pz, _nz."""
    if to != "faces":
        return (path,)
    return tuple(path.with_name(f"{path.stem}_{name}{path.suffix}") for name in FACE_NAMES)


def check_written(path: Path, to: str, layout: Layout, inputs: Sequence[Path]) -> None:
    """The errors of `write_environment` that do not depend on the light: to be had before it is converted."""
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        raise ImageError(f"{path}: {unknown('suffix', path.suffix, SUFFIXES)}")
    for file in written_files(path, to):
        if suffix not in TEXTURE_SUFFIXES:
            check_target(file, inputs=inputs)
        elif not (layout is CUBE and to == "cube") and (layout is CUBE or layout.tiles > 1):
            raise ImageError(
                f"{path}: {suffix} holds a cube as such, or one picture; got {to}; say cube, or write .exr"
            )
        else:
            check_writable(file, inputs)


def write_environment(
    path: Path,
    environment: EnvironmentMap,
    to: str,
    *,
    orientation: str = "auto",
    levels: bool = True,
    wide: bool = True,
) -> list[str]:
    """Write an environment to the files of `written_files`; notes of what these could not hold.

    to: one of TARGETS that is the environment's own layout. orientation: of a cube in pictures, as picture_of takes it.
    levels: of .ktx2 and .dds, which hold a cube as such, all of them. wide: floats of 32 bits in these, not 16.
    """
    if path.suffix.lower() in TEXTURE_SUFFIXES:
        chain = environment_levels(environment) if levels else [environment.pixels]
        write_texture(path, texture_from_light(chain, "float" if wide else "half", name=str(path)))
        return []
    name = environment.layout.name if to == "hemisphere" else TARGETS[to]
    if environment.layout.disc:
        # Black as in photographs, so that the disc is seen to be one.
        outside = ~inside(environment.layout, environment.size)
        environment = replace(environment, pixels=np.where(outside[..., None], np.float32(0), environment.pixels))
    picture = picture_of(environment, name, orientation)
    notes = _clip_notes(path, picture) if path.suffix.lower() in DISPLAY_SUFFIXES else []
    for file, part in zip(written_files(path, to), picture if to == "faces" else [picture]):
        write_picture(file, part)
    return notes


def _clip_notes(path: Path, picture: np.ndarray[tuple[int, ...], np.dtype[np.float32]]) -> list[str]:
    outside = ((picture < 0) | (picture > 1)).any(axis=-1)
    if not outside.any():
        return []
    return [
        f"{path}: {path.suffix} holds 0 to 1 in 8 bits: {outside.sum()} of {outside.size} pixels were clipped, values "
        f"from {float(picture.min()):.4g} to {float(picture.max()):.4g}; .exr holds all"
    ]
