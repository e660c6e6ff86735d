"""What each way to make mip levels gets wrong, and what it costs."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from benchmarks.figures import Cell, Section, Table, Target
from glbump.gl.context import Context, open_context
from glbump.gl.levels import generate_levels, texture_2d
from glbump.maps.layout import CUBE, HEMICUBE, LATLONG, OCTAHEDRAL, EnvironmentMap, Layout
from glbump.maps.levels import environment_levels, level_sizes, texel_angles
from glbump.maps.pyramid import chain, chain_by
from glbump.trade.timing import Call, in_turns, ratios, spread

F32 = npt.NDArray[np.float32]
Levels = Callable[[F32, str], list[F32]]

NAMES = {"hardware": "driver", "alike": "means, texels alike", "box": "box", "kaiser": "kaiser"}
SLOWER = 1.5
"""Most that environment levels by solid angle may cost of means of texels alike."""


def _driver(context: Context) -> Levels:
    """The levels of (H, W, C) as the driver of `context` makes them; how: "f1", "f2" or "f4"."""

    def levels(pixels: F32, how: str) -> list[F32]:
        stored = np.rint(pixels * 255).astype(np.uint8) if how == "f1" else pixels
        texture = texture_2d(context, [stored], how)
        generate_levels(context, texture)
        kind = {"f1": np.uint8, "f2": np.float16, "f4": np.float32}[how]
        count = max(pixels.shape[:2]).bit_length()
        made = [
            np.frombuffer(texture.read(level=i, alignment=1), kind).reshape(h, w, -1)
            for i, (w, h) in enumerate((max(texture.width >> i, 1), max(texture.height >> i, 1)) for i in range(count))
        ]
        texture.release()
        return [level.astype(np.float32) / np.float32(255 if how == "f1" else 1) for level in made]

    return levels


def _lost_light(layout: Layout, size: int, how: str, driver: Levels) -> float:
    """The worst level's light over that of level 0, less 1, in percent: of noise with a sun at 60 degrees of height."""
    chance = np.random.default_rng(1)
    tiles, height, width = layout.shape(size)
    pixels = chance.random((tiles, height, width, 3), dtype=np.float32)
    pixels[:, height // 6, width // 3] = 0.05 * height * width
    environment = EnvironmentMap(layout, pixels)
    if how == "hardware":
        levels = [level[None] for level in driver(pixels[0], "f4")]
    else:
        levels = environment_levels(environment, {"alike": "hardware"}.get(how, how))
    light = [
        float((level * texel_angles(environment, at)[..., None]).sum(dtype=float))
        for level, at in zip(levels, level_sizes(environment), strict=True)
    ]
    return 100 * max(abs(one / light[0] - 1) for one in light)


def _of_a_picture(how: str, driver: Levels) -> list[Cell]:
    """Of the last level of 127 texels in a line the share that is read; what 8 bits gain in ten levels, in codes; what
    of waves of 8 texels, and of 2.7, which would be others, the next level keeps."""
    if how == "hardware":

        def levels(pixels: F32, kind: str = "f4") -> list[F32]:
            return driver(pixels, kind)
    else:

        def levels(pixels: F32, kind: str = "f4") -> list[F32]:
            return chain_by(how, pixels, wraps=True)

    line: F32 = np.eye(127, dtype=np.float32)
    used = sum(abs(float(levels(at.reshape(1, 127, 1).repeat(3, axis=2))[-1][0, 0, 0])) > 1e-4 for at in line)
    noise = np.random.default_rng(2).integers(0, 256, (1024, 1024, 3)).astype(np.float32) / np.float32(255)
    bias = 255 * float(levels(noise, "f1")[-1].mean() - noise.mean(dtype=float)) if how == "hardware" else 0.0
    x = (np.arange(64) + 0.5) / 64

    def kept(waves: int) -> float:
        picture = 0.5 + 0.5 * np.cos(2 * np.pi * waves * x)[None, :, None].repeat(3, axis=2)
        return float(np.std(levels(picture.repeat(64, axis=0).astype(np.float32))[1]) * np.sqrt(8))

    return [100 * used / 127, bias, kept(8), kept(24)]


def _errors(driver: Levels, quick: bool) -> list[list[Cell]]:
    sizes = [(LATLONG, 64), (LATLONG, 50), (CUBE, 64), (CUBE, 50), (OCTAHEDRAL, 64)]
    rows: list[list[Cell]] = []
    for how, name in NAMES.items():
        lost: list[Cell] = [
            _lost_light(layout, size, how, driver) if how != "hardware" or layout is LATLONG else None
            for layout, size in (sizes[:1] if quick else sizes)
        ]
        lost += [None] * (len(sizes) - len(lost))
        if how == "alike":
            rows.append([name, *lost, None, None, None, None])
        else:
            rows.append([name, *lost, *_of_a_picture(how, driver)])
    return rows


def _calls(layout: Layout, size: int, context: Context) -> dict[str, Call]:
    pixels = np.random.default_rng(3).random((*layout.shape(size), 3), dtype=np.float32)
    environment = EnvironmentMap(layout, pixels)
    calls: dict[str, Call] = {
        "alike": lambda: chain(pixels),
        "box": lambda: environment_levels(environment),
        "kaiser": lambda: environment_levels(environment, "kaiser"),
    }
    if layout is LATLONG:
        texture: Any = texture_2d(context, [pixels[0]], "f2")

        def generate() -> None:
            generate_levels(context, texture)
            context.gl.finish()

        calls["hardware"] = generate
    return calls


def measure(quick: bool = False) -> Section:
    """Lat-long 2048x1024, cube and hemicube of 512, octahedron of 1024 (quick: 64 high)."""
    rows, targets = [], []
    with open_context() as context:
        driver = _driver(context)
        errors = _errors(driver, quick)
        first = np.random.default_rng(4).random((64, 64, 3), dtype=np.float32)
        driver(first, "f2")
        for layout, size in ((LATLONG, 1024), (CUBE, 512), (HEMICUBE, 512), (OCTAHEDRAL, 1024)):
            times = in_turns(_calls(layout, 64 if quick else size, context), 3 if quick else 9)
            base = times["alike"].cpu
            row: list[Cell] = [layout.name, 64 if quick else size, 1e3 * spread(base).median]
            for how in ("hardware", "box", "kaiser"):
                row.append(str(ratios(times[how].cpu, base)) if how in times else None)
            rows.append(row)
            if layout is LATLONG:
                cost = ratios(times["box"].cpu, base).median
                targets.append(Target.at_most("levels by solid angle, lat-long", cost, SLOWER, " times"))
    worst = max(float(cell) for cell in errors[2][1:6] if isinstance(cell, float))
    targets.append(Target.at_most("light lost by the box", worst, 1e-4, " %"))
    return Section(
        "Pyramids",
        TEXT,
        (
            Table(
                (
                    "levels",
                    "lat-long 128x64",
                    "100x50",
                    "cube 64",
                    "cube 50",
                    "octahedron 64",
                    "of 127 texels read, %",
                    "8 bits gain, codes",
                    "waves of 8",
                    "of 2.7",
                ),
                errors,
            ),
            Table(("layout", "size", "means, texels alike: CPU ms", "driver", "box", "kaiser"), rows),
        ),
        targets,
    )


TEXT = (
    "`python -m benchmarks pyramids`: mip levels as `Quality.pyramid` has them: by this driver (hardware; its last "
    "levels read back), as means by solid angle (box), by the Kaiser kernel (alpha 4, width 3), and beside them as "
    "means that count all texels alike, as drivers do at even sizes. Columns 2 to 6: by how many percent the light of "
    "the worst level, the sum of radiance times solid angle, is off; noise with a small sun. Then: how many of 127 "
    "texels in a line the last level reads; how many codes of 255 the last level of 1024x1024 chance bytes lies above "
    "their mean; and which share of the contrast of waves 8 and 2.7 texels long is left in level 1, which can hold "
    "the first, and shows the others as waves that are not there. Second table: CPU time of a picture's levels, as a "
    "ratio to the means of texels alike; the driver's with its program compiled, which takes as long again, once."
)

if __name__ == "__main__":
    from benchmarks.command import alone

    alone(measure)
