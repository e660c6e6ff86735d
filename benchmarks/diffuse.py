"""What nine harmonics and a small cube make of diffuse light, against the sum over every texel."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from benchmarks.figures import Cell, Section, Table, Target
from benchmarks.scenes import panoramas
from glbump.maps.cube import sample_levels
from glbump.maps.diffuse import MAP_SIZE, irradiance_map, sh9
from glbump.maps.layout import LATLONG, EnvironmentMap, row_edges, texel_dirs
from glbump.maps.suns import Sun, part
from glbump.reference.environment import sh9_irradiance
from glbump.reference.irradiance import Quadrature

F64 = npt.NDArray[np.float64]


def _made() -> EnvironmentMap:
    """A sky with a sun of the true one's size, for where there are no photographs."""
    dirs = texel_dirs(LATLONG, (512, 256))
    pixels = (0.4 + 0.3 * dirs[..., 1:2] * np.array([0.5, 0.8, 1.2])).astype(np.float32)
    pixels[dirs @ np.array([0.48, 0.64, 0.6]) > np.cos(np.radians(0.6))] = (3000, 2800, 2500)
    return EnvironmentMap(LATLONG, pixels)


def _sum(environment: EnvironmentMap, normals: F64) -> F64:
    """Irradiance / pi, texel by texel in float64."""
    width = environment.size[0]
    rows = -np.diff(np.cos(row_edges(environment))) * 2 * np.pi / width
    light = environment.pixels[0] * rows[:, None, None]
    dirs, flat = environment.texel_dirs().reshape(-1, 3), light.reshape(-1, 3)
    return np.stack([np.maximum(dirs @ n, 0) @ flat for n in normals]) / np.pi


def _of_suns(suns: tuple[Sun, ...], normals: F64) -> F64:
    light = np.zeros((len(normals), 3))
    for sun in suns:
        light += np.maximum(normals @ sun.direction, 0)[:, None] * np.array(sun.irradiance) / np.pi
    return light


def _percent(got: Any, exact: F64) -> list[Cell]:
    error = 100 * np.abs(got - exact) / exact.max(axis=0)
    return [float(error.mean()), float(np.quantile(error, 0.99)), float(error.max())]


def measure(quick: bool = False) -> Section:
    """A thousand normals (quick: ten)."""
    normals = np.random.default_rng(3).normal(size=(10 if quick else 1000, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    rows: list[list[Cell]] = []
    kept: list[list[Cell]] = []
    targets = []
    for name, picture in (panoramas() or {"a made sky": _made()}).items():
        exact, parted = _sum(picture, normals), part(picture)
        for suns, source, found in (("kept", picture, ()), ("apart", parted.rest, parted.suns)):
            if suns == "apart" and not found:
                continue
            light = _of_suns(found, normals)
            figures = {
                "nine harmonics": sh9_irradiance(normals, sh9(source)) + light,
                f"a cube of {MAP_SIZE}": sample_levels([irradiance_map(source, MAP_SIZE)], normals, 0) + light,
                "the reference": Quadrature(source)(normals) + light,
            }
            for how, got in figures.items():
                rows.append([name, suns, how, *_percent(got, exact)])
                if how == "nine harmonics":
                    targets += _targets(f"{name}, suns {suns}", *rows[-1][3:])
        whole = 4 * np.pi * sh9(picture)[0]
        rest = 4 * np.pi * sh9(parted.rest)[0]
        lit = np.sum([sun.irradiance for sun in parted.suns], axis=0) if parted.suns else np.zeros(3)
        kept.append(
            [
                name,
                len(parted.suns),
                100 * float(lit.sum() / whole.sum()),
                float(np.degrees(max((sun.radius for sun in parted.suns), default=0.0))),
                float(np.abs(rest + lit - whole).max() / whole.max()),
            ]
        )
    return Section(
        "Diffuse light",
        f"`python -m benchmarks diffuse`: irradiance of {len(normals)} chance normals against the sum over every texel "
        "in float64; errors in percent of the brightest. Published of nine harmonics: on average about 1, and 9.375 "
        "(3/32) at most, of a point of light (Ramamoorthi and Hanrahan 2001). `apart`: the suns of the picture taken "
        "out first, and their light, max(n . l, 0), added to each. `the reference` is what `gb.reference.render` takes "
        "for the truth. The second table: what became of the light.",
        (
            Table(("picture", "suns", "by", "mean", "99 %", "largest"), rows),
            Table(("picture", "suns", "of its light, %", "widest, degrees", "light lost"), kept),
        ),
        targets,
    )


def _targets(what: str, mean: Cell, _: Cell, largest: Cell) -> list[Target]:
    assert isinstance(mean, float)
    assert isinstance(largest, float)
    return [
        Target.at_most(f"nine harmonics, {what}: mean, about 1", mean, 2.0, " %"),
        Target.at_most(f"nine harmonics, {what}: largest", largest, 9.375, " %"),
    ]


if __name__ == "__main__":
    from benchmarks.command import alone

    alone(measure)
