"""How far pictures lie from the float64 reference."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from benchmarks.figures import Cell, Section, Table, Target
from benchmarks.scenes import CASES, HARD, Case
from glbump import reference
from glbump.frame import Frame
from glbump.gl.renderer import Renderer
from glbump.quality import Quality
from glbump.scene import Scene
from glbump.trade.metrics import compare

LIMITS: Mapping[str, float] = {"mean": 0.3, "p99": 1.0, "max": 8.0}
"""Of 255, display-referred, of each pixel's largest channel, over `interior`."""


def interior(surface: npt.NDArray[Any]) -> npt.NDArray[np.bool_]:
    """(H, W): pixels that with their eight neighbours see one piece of one surface, or only the background.

    surface: the reference's stats["surface"], negative where a pixel sees several; see `glbump.reference.render`.
    """
    from glbump.reference.shade import BACKGROUND

    height, width = surface.shape
    padded = np.pad(surface, 1, mode="edge")
    near = np.stack([padded[i : i + height, j : j + width] for i in range(3) for j in range(3)])
    same: npt.NDArray[np.bool_] = (near.min(axis=0) == near.max(axis=0)) & (surface >= BACKGROUND)
    return same


def against_reference(drawn: Frame, truth: Frame) -> dict[str, float]:
    """mean, p99 and max over the interior, of 255, and the interior's share of the picture."""
    where = interior(truth.stats["surface"])
    figures = compare(drawn, truth, perceptual=False, where=where)
    return {name: 255 * figures[name] for name in LIMITS} | {"share": float(where.mean())}


def exact_error(
    renderer: Renderer, scene: Scene, size: tuple[int, int], quality: Quality, truth: Frame | None = None
) -> dict[str, float]:
    """`against_reference` of a quality, with as many samples on both sides. truth: the reference, if it is there."""
    drawn = renderer.render(scene, size, quality)
    return against_reference(drawn, truth or exact_truth(renderer, scene, size, quality))


def exact_truth(renderer: Renderer, scene: Scene, size: tuple[int, int], quality: Quality) -> Frame:
    """The reference with as many samples as `quality` takes, from the same maps."""
    return reference.render(scene, size, quality.samples, quality=quality, contents=renderer.contents)


def _converged(
    renderer: Renderer, case: Case, size: tuple[int, int], samples: int, qualities: Mapping[str, Quality]
) -> list[list[Cell]]:
    """Rows of each quality's error against `samples` samples a pixel, over the whole frame."""
    scene = case.photographed()
    truth = reference.render(scene, size, samples, quality=qualities["exact"], contents=renderer.contents)
    rows: list[list[Cell]] = []
    for name, quality in qualities.items():
        figures = compare(renderer.render(scene, size, quality), truth, perceptual=False)
        rows.append([case.name, name, 255 * figures["rmse"], 255 * figures["mean"], 255 * figures["p99"]])
    return rows


def measure(quick: bool = False) -> Section:
    """All scenes at 256x256 (quick: three at 16x16)."""
    size, samples = ((16, 16), 4) if quick else ((256, 256), 64)
    # Quick, the roughness chain is tiny too; it takes longest.
    qualities = {name: Quality(name) for name in ("fast", "balanced", "exact")}
    if quick:
        qualities = {n: replace(q, gloss_size=16, gloss_samples=8) for n, q in qualities.items()}
    exact: list[list[Cell]] = []
    converged: list[list[Cell]] = []
    targets: list[Target] = []
    with Renderer() as renderer:
        for case in CASES[:3] if quick else (*CASES, HARD):
            if not case.is_there:
                continue
            figures = exact_error(renderer, case.photographed(), size, qualities["exact"])
            environment = case.environment.split("/")[1].removesuffix(".exr")
            exact.append([case.name, environment, *(figures[k] for k in ("mean", "p99", "max", "share"))])
            if case is HARD:
                continue
            targets.extend(Target.at_most(f"{case.name}: {k}", figures[k], LIMITS[k], "/255") for k in LIMITS)
            converged.extend(_converged(renderer, case, size, samples, qualities))
    count = qualities["exact"].samples
    return Section(
        "Accuracy",
        f'`quality="exact"` against `glbump.reference.render` with the same {count} samples a pixel, '
        f"{size[0]}x{size[1]}: sRGB after clipping, in steps of 1/255, the largest of a pixel's three channels, over "
        "the share of the pixels whose 3x3 neighbourhood sees one piece of one surface. The last row promises nothing: "
        "lamps of 943 times display white, seen in slopes of up to 7.8, are moved by the last bits of 32-bit floats. "
        f"Below, every quality against {samples} samples a pixel, over the whole frame, edges and all.",
        (
            Table(("scene", "environment", "mean", "p99", "max", "share"), exact),
            Table(("scene", "quality", "RMSE", "mean", "p99"), converged),
        ),
        targets,
    )


if __name__ == "__main__":
    from benchmarks.command import alone

    alone(measure)
