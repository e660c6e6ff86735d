"""Bump mapping against displacement: where bent normals are enough, over amplitudes and shapes."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import numpy.typing as npt

from benchmarks.figures import Cell, Section, Table
from benchmarks.scenes import CHROME, evening
from benchmarks.studies.settings import save
from glbump.camera import Camera
from glbump.maps import patterns
from glbump.scene import Bump, Scene, Surface
from glbump.shapes import Plane, Shape, Sphere, Torus, Vec3
from glbump.trade.bumps import FORMS, MOST_PIXELS, compare_bump, sheet

F32 = npt.NDArray[np.float32]

MIRRORS = ("ball of bricks", "ring of waves", "floor of dimples")
AMPLITUDES = (0.003, 0.01, 0.03, 0.1)


def scene(mirror: str, amplitude: float) -> Scene:
    """One of MIRRORS: whole, from above, and at a slant."""
    mirrors: dict[str, tuple[Shape, Callable[[tuple[int, int]], F32], tuple[float, float], Vec3]] = {
        "ball of bricks": (Sphere(), patterns.bricks, (2, 1), (0, 0, 4)),
        "ring of waves": (Torus(), patterns.waves, (4, 1), (0, 2.6, 2.6)),
        "floor of dimples": (Plane((4, 4)), patterns.dimples, (1, 1), (0, 1, 5)),
    }
    shape, pattern, repeat, eye = mirrors[mirror]
    bump = Bump(pattern((256, 256)), amplitude, repeat=repeat)
    return Scene([Surface(shape, CHROME, bump)], evening(), Camera(eye=eye))


def _halved(picture: npt.NDArray[np.uint8]) -> npt.NDArray[np.uint8]:
    rows, columns, channels = picture.shape
    return picture.reshape(rows // 2, 2, columns // 2, 2, channels).mean(axis=(1, 3)).astype(np.uint8)


def study(folder: Path, quick: bool = False) -> Section:
    """Three mirrors of four amplitudes, 192x144 (quick: one, 16x12)."""
    size = (16, 12) if quick else (192, 144)
    rows: list[list[Cell]] = []
    enough = dict.fromkeys(MIRRORS, 0.0)
    for mirror in MIRRORS[:1] if quick else MIRRORS:
        for amplitude in AMPLITUDES[:1] if quick else AMPLITUDES:
            found = compare_bump(scene(mirror, amplitude), 0, size, quality="exact")
            picture = save(folder / f"displacement-{len(rows)}.png", _halved(sheet(found)))
            f = found.figures
            angles = [f["normals"][form]["mean"] for form in FORMS]
            errors = [255 * f["pictures"][form]["rmse"] for form in FORMS]
            moved, outline = f["moved"]["max"], f["silhouette"]["max"]
            rows.append([mirror, amplitude, picture, *angles, *errors, f["formula"]["small"]["max"], moved, outline])
            if max(moved, outline) <= MOST_PIXELS:
                enough[mirror] = amplitude
    said = "; ".join(f"{what}: {f'{most:g}' if most else 'none'}" for what, most in enough.items())
    forms = [f"{what}: {form}" for what in ("degrees", "RMSE, /255") for form in FORMS]
    return Section(
        "Bump mapping against displacement",
        f"Bump mapping bends the light and moves nothing. At {size[0]}x{size[1]}, nothing moves "
        f"by more than {MOST_PIXELS:g} pixel up to these of the amplitudes: {said}. A picture twice as wide "
        "allows half as much. Past that, both forms of the formula are as wrong as each other: what is missing is the "
        "place, not a term.\n\n"
        "Each picture, of half the size, has in columns the surface flat, bumped by the small and by the full form, "
        "and displaced; below, degrees to the displaced surface's normal in the same pixel, and the outlines (red: "
        "only the displaced one's); then four times the difference from the displaced picture, and how far points "
        "move. Amplitude is the world length of the heights' whole range; degrees are means. `small, formula` is the "
        "largest angle between the small form and the full one at the same point, `moved` the farthest that a point "
        "moves, in pixels, `outline` the same of the silhouette. All heights are the cubic B-spline through their "
        "maps. `glbump compare-bump SCENE` does this for a scene of yours; the formulas: [bump](../bump.md).",
        (
            Table(
                ("mirror", "amplitude", "flat, small, full, displaced", *forms, "small, formula", "moved", "outline"),
                rows,
            ),
        ),
    )
