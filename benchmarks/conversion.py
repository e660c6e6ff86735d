"""A lat-long picture to a cube, beside what other programs take and how far off they are."""

from __future__ import annotations

import json
import random
import subprocess
import sys
import tempfile
from functools import partial
from pathlib import Path

import numpy as np
import numpy.typing as npt

from benchmarks.converters import CONVERTERS, there
from benchmarks.figures import Cell, Section, Table, Target
from benchmarks.scenes import DATA
from glbump.maps.continuity import changed
from glbump.maps.convert import convert
from glbump.maps.layout import CUBE, LATLONG, EnvironmentMap, sample, texel_dirs
from glbump.trade.timing import Call, Times, in_turns, ratios, spread

F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]

OURS, AREA = "glbump, bilinear", "glbump, area"
CLIP = 4.0
"""Radiance counts up to here, so that a lamp does not decide alone."""

ROOT = Path(__file__).resolve().parents[1]


def waves(height: int) -> EnvironmentMap:
    """A smooth environment with fine detail: plane waves of the direction, the shortest 8 texels long."""
    dirs = texel_dirs(LATLONG, (2 * height, height))[0]
    picture = np.full(dirs.shape, 0.5)
    chance = np.random.default_rng(7)
    for count, share in ((3.0, 0.3), (0.06 * height, 0.1), (0.25 * height, 0.1)):
        for channel in range(3):
            way = chance.normal(size=3)
            way *= count / np.linalg.norm(way)
            picture[..., channel] += share * np.sin(dirs @ way + chance.uniform(0, 6))
    return EnvironmentMap(LATLONG, picture[None].astype(np.float32))


def photographed(height: int) -> tuple[str, EnvironmentMap]:
    """The largest photographed panorama that there is, resized; the demo's own where there is none."""
    path = DATA / "openexr" / "KernerEnvLatLong.exr"
    if not path.is_file():
        from glbump.demo.panorama import evening

        return "the demo's evening", EnvironmentMap(LATLONG, evening(height)[None])
    from glbump.maps.images import read_colour
    from glbump.maps.pictured import environment_of

    return "KernerEnv", convert(environment_of(read_colour(path)), LATLONG, height)


class Truth:
    """What some texels of a cube should hold, chosen at random: the mean of 16x16 look-ups (bilinear, float64) that are
    spread over the texel, and that at its centre alone."""

    def __init__(self, environment: EnvironmentMap, size: int, count: int) -> None:
        chance = np.random.default_rng(3)
        self._at = tuple(chance.integers(0, n, count) for n in (6, size, size))
        face, row, column = self._at
        inside = (np.arange(16) + 0.5) / 16
        s = (column[:, None, None] + inside[None, None, :]) / size
        t = (row[:, None, None] + inside[None, :, None]) / size
        values = [
            np.minimum(
                sample(environment, CUBE.dir(face[i : i + 512, None, None], s[i : i + 512], t[i : i + 512])), CLIP
            )
            for i in range(0, count, 512)
        ]
        self._mean = np.concatenate(values).mean(axis=(1, 2))
        centre = CUBE.dir(face, (column + 0.5) / size, (row + 0.5) / size)
        self._centre = np.minimum(sample(environment, centre), CLIP)

    def errors(self, faces: F32) -> dict[str, float]:
        """RMSE from the means, and the largest difference from the centres' values."""
        got = np.minimum(faces[self._at], CLIP)
        rmse = float(np.sqrt(np.square(got - self._mean).mean()))
        return {"rmse": rmse, "centre": float(np.abs(got - self._centre).max())}


def as_ours(faces: F32, ours: F32) -> F32:
    """Another program's six faces in our order, each laid as ours: whichever way makes them most alike."""
    ways = [(face, how) for face in range(6) for how in range(8)]
    few = slice(None, None, max(1, faces.shape[1] // 64))
    found = []
    for wanted in ours:
        unlike = [np.abs(changed(faces[face], how)[few, few] - wanted[few, few]).mean() for face, how in ways]
        face, how = ways[int(np.argmin(unlike))]
        found.append(changed(faces[face], how))
    return np.stack(found)


def first_calls(names: list[str], picture: F32, size: int, rounds: int) -> dict[str, dict[str, list[float]]]:
    """Wall and CPU seconds and MiB of each program's first call, in new processes, taking turns."""
    took: dict[str, dict[str, list[float]]] = {name: {"wall": [], "cpu": [], "MiB": []} for name in names}
    chance, order = random.Random(1), list(names)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "picture.npy"
        np.save(path, picture)
        for _ in range(rounds):
            chance.shuffle(order)
            for name in order:
                line = [sys.executable, "-m", "benchmarks.converters", name, str(path), str(size)]
                out = subprocess.run(line, check=True, capture_output=True, text=True, cwd=ROOT).stdout
                for kind, value in json.loads(out).items():
                    took[name][kind].append(value)
    return took


def repeated_calls(calls: dict[str, Call], turns: int) -> dict[str, Times]:
    """Of all but ours by area, `turns`; of that, which takes long, a few."""
    times = in_turns({name: call for name, call in calls.items() if name != AREA}, turns, warm_up=1)
    slow = in_turns({name: calls[name] for name in (OURS, AREA)}, max(2, turns // 7), warm_up=0)
    return times | {AREA: slow[AREA]}


def measure(quick: bool = False) -> Section:
    """2048x1024 to six faces of 512 (quick: 64x32 to 16)."""
    height, size, turns, rounds, count = (32, 16, 3, 1, 200) if quick else (1024, 512, 15, 5, 20000)
    versions = there()
    name_of, photo = photographed(height)
    environments = {"waves": waves(height), name_of: photo}
    converters = {name: CONVERTERS[name][1]() for name in versions}
    errors: dict[str, dict[str, dict[str, float]]] = {name: {} for name in converters}
    for pano, environment in environments.items():
        truth = Truth(environment, size, count)
        ours = converters[OURS](environment.pixels[0], size)
        for name, call in converters.items():
            faces = np.reshape(call(environment.pixels[0], size), (6, size, size, 3))
            errors[name][pano] = truth.errors(as_ours(faces, ours))
    picture = photo.pixels[0]
    repeated = repeated_calls({name: partial(call, picture, size) for name, call in converters.items()}, turns)
    first = first_calls(list(converters), picture, size, rounds)
    rows: list[list[Cell]] = []
    for name in converters:
        seconds: list[Cell] = [
            *(f"{spread([1e3 * t for t in first[name][kind]])}" for kind in ("wall", "cpu")),
            *(f"{spread([1e3 * t for t in took])}" for took in (repeated[name].wall, repeated[name].cpu)),
        ]
        figures = [errors[name][pano][kind] for pano in environments for kind in ("rmse", "centre")]
        rows.append([name, versions[name], *seconds, float(np.median(first[name]["MiB"])), *figures])
    columns = [f"{pano}: {kind}" for pano in environments for kind in ("RMSE", "largest")]
    head = ("program", "version", "first, ms", "CPU", "again, ms", "CPU", "MiB", *columns)
    return Section(
        "A lat-long picture to a cube",
        _text(height, size, count),
        (Table(head, rows),),
        _targets(repeated, first, errors, picture, size),
    )


def _text(height: int, size: int, count: int) -> str:
    absent = sorted(set(CONVERTERS) - set(there()))
    missing = f" Not there: {', '.join(absent)}." if absent else ""
    return (
        f"{2 * height}x{height} to 6 x {size}x{size}, floats in and out, programs taking turns. First: the first call "
        "in a process of its own, after the imports, with whatever it makes for itself; again: later calls. OpenCV's "
        "maps are NumPy's in single precision; `kept` uses those of its first call again, as py360convert and "
        "OpenImageIO's row do theirs; `made` makes them anew. Milliseconds of wall clock and of CPU; MiB: most that "
        "the first call holds besides the picture, its result included. RMSE: from the mean of 16x16 look-ups "
        f"(bilinear, float64) spread over the texel, over {count:,} texels chosen at random, radiance clipped at "
        f"{CLIP:g}; largest: difference from the look-up at the texel's centre, which is what bilinear reading is. "
        "Waves: smooth, with detail 8 texels long." + missing
    )


def _targets(
    repeated: dict[str, Times],
    first: dict[str, dict[str, list[float]]],
    errors: dict[str, dict[str, dict[str, float]]],
    picture: F32,
    size: int,
) -> list[Target]:
    """Ours against each of the others, and the memory."""
    targets = []
    for name in first:
        if name in (OURS, AREA):
            continue
        pairs = (
            ("first", first[OURS]["wall"], first[name]["wall"]),
            ("again", repeated[OURS].wall, repeated[name].wall),
        )
        targets += [
            Target.at_most(f"{kind}, against {name}", ratios(ours, theirs).median, 1.0, " times")
            for kind, ours, theirs in pairs
        ]
        targets += [
            Target.at_most(
                f"RMSE of {pano}, against {name}",
                errors[OURS][pano]["rmse"] / errors[name][pano]["rmse"],
                1.001,
                " times",
            )
            for pano in errors[OURS]
        ]
    source, result = picture.nbytes / 2**20, 6 * size * size * 12 / 2**20
    for name in (OURS, AREA):
        peak = float(np.median(first[name]["MiB"])) + source
        targets.append(Target.at_most(f"{name}: memory, the picture included", peak, 2 * source + result, " MiB"))
    return targets


if __name__ == "__main__":
    from benchmarks.command import alone

    alone(measure)
