"""Prefiltered environments as files: roughness chains in KTX2, DDS or one OpenEXR a level, nine harmonics as JSON."""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from glbump.errors import ImageError, unknown
from glbump.maps.containers import TEXTURE_SUFFIXES, is_texture, read_texture, texture_from_light, write_texture
from glbump.maps.files import check_target, check_writable, write_atomically, write_picture
from glbump.maps.images import read_colour
from glbump.maps.suns import Sun

F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]

SUFFIXES = (*TEXTURE_SUFFIXES, ".exr")

BASIS = ("1", "y", "z", "x", "x y", "y z", "3 z^2 - 1", "x z", "x^2 - y^2")
"""Polynomials of a unit direction, in the order of maps.diffuse.sh9: bands 0, 1, 2, m from -l to l."""

NORMS = tuple(float(np.sqrt(square / (4 * np.pi))) for square in (1, 3, 3, 3, 15, 15, 5 / 4, 15, 15 / 4))
"""What each of BASIS is multiplied by to be a real spherical harmonic of norm 1: 0.282095, 0.488603, ..."""

_BANDS = (np.pi, *[2 * np.pi / 3] * 3, *[np.pi / 4] * 5)


def chain_files(path: Path, count: int) -> tuple[Path, ...]:
    """The files of a chain of `count` levels: of an .exr NAME_0.exr, NAME_1.exr and so on."""
    if path.suffix.lower() != ".exr":
        return (path,)
    return tuple(path.with_name(f"{path.stem}_{level}{path.suffix}") for level in range(count))


def check_chain(path: Path, count: int, inputs: Sequence[Path] = ()) -> None:
    """The errors of `write_chain` that do not depend on the light: to be had before it is blurred."""
    if path.suffix.lower() not in SUFFIXES:
        raise ImageError(f"{path}: {unknown('suffix', path.suffix, SUFFIXES)}")
    for file in chain_files(path, count):
        if path.suffix.lower() == ".exr":
            check_target(file, inputs=inputs)
        else:
            check_writable(file, inputs)


def write_chain(path: Path, levels: Sequence[F32], *, wide: bool = True) -> None:
    """Write levels (6, n, n, 3) of a roughness chain: .ktx2 and .dds as a cube map with levels, .exr as a file a level,
    each a column of its six faces +X -X +Y -Y +Z -Z, s right and t down by the OpenGL table.

    wide: floats of 32 bits in .ktx2 and .dds, not of 16. ImageError for what cannot be written or held.
    """
    if path.suffix.lower() in TEXTURE_SUFFIXES:
        write_texture(path, texture_from_light(levels, "float" if wide else "half", name=str(path)))
        return
    for file, level in zip(chain_files(path, len(levels)), levels, strict=True):
        write_picture(file, level.reshape(-1, level.shape[2], 3))


def read_chain(path: str | Path) -> list[F32]:
    """The levels (6, n, n, 3) float32 of a chain that `write_chain` wrote to this name, linear light.

    Level i is for roughness i / (levels - 1). ImageError for one with a level missing, levels that do not halve, or no
    cube; and as every picture for damaged files and values that are not finite.
    """
    path = Path(path)
    if path.suffix.lower() == ".exr":
        levels = [_column(file) for file in _level_files(path)]
    elif path.suffix.lower() in TEXTURE_SUFFIXES and (not path.exists() or is_texture(path)):
        texture = read_texture(path)
        if not texture.is_cube or texture.levels[0].dtype == np.uint8:
            kind = "a cube map in 8 bits" if texture.is_cube else "a picture, no cube map"
            raise ImageError(f"{path}: is {kind}; a roughness chain is a cube map in floats: write one")
        levels = [level[..., :3].astype(np.float32) for level in texture.levels]
    else:
        raise ImageError(f"{path}: {unknown('suffix of a roughness chain', path.suffix, SUFFIXES)}")
    if len(levels) < 2:
        raise ImageError(f"{path}: has one level; a roughness chain has one for each of several: write it anew")
    for number, level in enumerate(levels[1:], 1):
        size, before = level.shape[1], levels[number - 1].shape[1]
        if 2 * size != before:
            raise ImageError(
                f"{path}: level {number} has faces of {size}, and level {number - 1} of {before}; each must be half of "
                "the one before: write the chain anew"
            )
    return levels


def _level_files(path: Path) -> list[Path]:
    """NAME_0.exr and on; ImageError where one is missing."""
    pattern = re.compile(re.escape(path.stem) + r"_(\d+)" + re.escape(path.suffix))
    numbers = {int(m[1]) for file in path.parent.glob("*") if (m := pattern.fullmatch(file.name))}
    if not numbers:
        raise ImageError(f"{path}: there is no {chain_files(path, 1)[0]}, the first level of a roughness chain")
    for number, file in enumerate(chain_files(path, max(numbers) + 1)):
        if number not in numbers:
            raise ImageError(f"{path}: level {number} is missing, and there are some up to {max(numbers)}: no {file}")
    return list(chain_files(path, max(numbers) + 1))


def _column(file: Path) -> F32:
    pixels = read_colour(file).pixels
    height, width = pixels.shape[:2]
    if height != 6 * width:
        raise ImageError(f"{file}: must be a column of six square faces; got {width}x{height}")
    return pixels.reshape(6, width, width, 3)


def harmonics(coefficients: F64, suns: Sequence[Sun], *, apart: bool) -> dict[str, Any]:
    """Nine harmonics (9, 3), as maps.diffuse.sh9 has them, for JSON: with all that is needed to use them right."""
    bands = np.array(_BANDS)[:, None] / np.pi
    radiance = coefficients / bands / np.array(NORMS)[:, None]
    return {
        "kind": "nine real spherical harmonics of an environment, linear rgb",
        "axes": "right-handed, +Y up; directions as the environment's cube faces have them (+Z is the face +Z)",
        "order": [[band, m] for band in range(3) for m in range(-band, band + 1)],
        "basis": list(BASIS),
        "norms": list(NORMS),
        "irradiance_over_pi": coefficients.tolist(),
        "irradiance_over_pi_is": "sum of irradiance_over_pi[i] * basis[i] of the unit normal: times an albedo, the "
        "radiance that leaves a diffuse surface; an even environment of radiance 1 gives 1",
        "radiance": radiance.tolist(),
        "radiance_is": "sum of radiance[i] * norms[i] * basis[i] of the unit direction",
        "suns": "apart" if apart else "kept",
        "suns_are": "apart: taken out of both sums, and to be added as irradiance / pi * max(n . direction, 0)"
        if apart
        else "kept: part of both sums",
        "apart": [
            {"direction": sun.direction, "irradiance": sun.irradiance, "radius_degrees": float(np.degrees(sun.radius))}
            for sun in suns
        ],
    }


def write_harmonics(path: Path, content: dict[str, Any]) -> None:
    """Write `harmonics` as JSON, whole or not at all."""
    write_atomically(path, (json.dumps(content, indent=1, allow_nan=False) + "\n").encode())
