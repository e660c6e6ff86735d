"""Bumps that are seen from farther and farther away, against many samples a pixel."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import dataclass, replace
from pathlib import Path
from unittest.mock import patch

import numpy as np
import numpy.typing as npt

from benchmarks.figures import Cell, Section, Table, Target
from benchmarks.scenes import CHROME, evening
from glbump.camera import Camera
from glbump.frame import Frame
from glbump.gl import uniforms
from glbump.gl.renderer import Renderer
from glbump.maps import patterns
from glbump.maps.colour import srgb_from_linear
from glbump.quality import Quality
from glbump.reference.shade import render
from glbump.scene import Bump, Scene, Surface
from glbump.shapes import Plane, Sphere

F64 = npt.NDArray[np.float64]
F32 = npt.NDArray[np.float32]

SIZE = (96, 96)
FRAMES, SAMPLES = 64, 1024
WAYS = {
    "trilinear": Quality("balanced", samples=1, bump_spread="none", environment_level="longest"),
    "4 samples": Quality("balanced", bump_spread="none"),
    "toksvig": Quality("balanced", bump_spread="toksvig"),
    "balanced": Quality("balanced"),
}


@dataclass(frozen=True)
class Journey:
    """A scene that is left behind: at 0 its bumps are seen one by one, at 1 none is."""

    name: str
    scene: Callable[[float], Scene]


def _ball(heights: F32, amplitude: float) -> Callable[[float], Scene]:
    """Shrinks from three quarters of the picture to a sixteenth of that."""

    def scene(far: float) -> Scene:
        away = 3.2 * 2 ** (4 * far)
        bump = Bump(heights, amplitude=amplitude, repeat=(8, 4))
        camera = Camera(eye=(0, 0.3 * away, 0.954 * away), target=(0, 0, 0), fov=40)
        return Scene([Surface(Sphere(), CHROME, bump)], replace(evening(), background=False), camera)

    return scene


def _plane(heights: F32, amplitude: float) -> Callable[[float], Scene]:
    """Sinks away below the eye, from half a repeat to sixteen."""

    def scene(far: float) -> Scene:
        above = 0.5 * 2 ** (5 * far)
        bump = Bump(heights, amplitude=amplitude, repeat=(400, 400))
        camera = Camera(eye=(0, above, 0), target=(0, above - 0.6, -2), fov=40)
        return Scene([Surface(Plane(size=(400, 400)), CHROME, bump)], replace(evening(), background=False), camera)

    return scene


def journeys() -> tuple[Journey, ...]:
    """Rough stone and wind waves, whose slopes are about as a bell curve has them; dents and bricks, flat here and
    steep there."""
    shape = (256, 256)
    return (
        Journey("ball of stone", _ball(patterns.fbm(shape), 0.03)),
        Journey("plane of waves", _plane(patterns.waves(shape), 0.03)),
        Journey("hammered ball", _ball(patterns.dimples(shape, wobble=0.5), 0.008)),
        Journey("plane of bricks", _plane(patterns.bricks(shape), 0.03)),
    )


def _shown(frame: Frame) -> F64:
    """(H, W, 4): as a display shows it, 0..255, and coverage."""
    pixels = frame.pixels.astype(np.float64)
    return np.concatenate([255 * srgb_from_linear(np.clip(pixels[..., :3], 0, 1)), pixels[..., 3:]], axis=-1)


def _rms(a: F64, b: F64, inside: npt.NDArray[np.bool_]) -> float:
    return float(np.sqrt(np.mean((a - b)[inside][:, :3] ** 2)))


def _is_inside(truth: F64) -> npt.NDArray[np.bool_]:
    result: npt.NDArray[np.bool_] = truth[..., 3] > 0.9999
    return result


def _measured(renderer: Renderer, journey: Journey, frames: int, samples: int) -> dict[str, tuple[float, float]]:
    """RMSE over all frames, and the largest change from a frame to the next over the truth's, of each way."""
    exact = Quality("exact", samples=samples)
    errors: dict[str, list[float]] = {name: [] for name in WAYS}
    changes: dict[str, list[float]] = {name: [] for name in (*WAYS, "truth")}
    before: dict[str, F64] = {}
    for far in np.linspace(0, 1, frames):
        scene = journey.scene(float(far))
        now = {"truth": _shown(renderer.render(scene, SIZE, exact))}
        for name, how in WAYS.items():
            # A texture unit's level is the one whose texel is as wide as the sample.
            with patch.object(uniforms, "LEVEL_WIDTH", 1.0) if name == "trilinear" else nullcontext():
                now[name] = _shown(renderer.render(scene, SIZE, how))
        inside = _is_inside(now["truth"])
        for name in WAYS:
            errors[name].append(_rms(now[name], now["truth"], inside))
        if before:
            both = inside & _is_inside(before["truth"])
            for name, picture in now.items():
                changes[name].append(_rms(picture, before[name], both))
        before = now
    largest = max(changes["truth"])
    return {name: (float(np.sqrt(np.mean(np.square(e)))), max(changes[name]) / largest) for name, e in errors.items()}


def measure(quick: bool = False) -> Section:
    """64 frames of each journey (quick: three, and little truth)."""
    frames, samples = (3, 16) if quick else (FRAMES, SAMPLES)
    rows: list[list[Cell]] = []
    targets: list[Target] = []
    with Renderer() as renderer:
        for journey in journeys():
            figures = _measured(renderer, journey, frames, samples)
            plain = figures["trilinear"][0]
            rows += [[journey.name, way, error, error / plain, jump] for way, (error, jump) in figures.items()]
            ours, jump = figures["balanced"]
            targets.append(Target.at_most(f"{journey.name}: error over trilinear's", ours / plain, 0.5))
            targets.append(Target.at_most(f"{journey.name}: largest jump over the truth's", jump, 2.0))
        scene = journeys()[0].scene(0.4)
        few = 4 if quick else 256
        fast = _shown(renderer.render(scene, SIZE, Quality("exact", samples=few)))
        slow = _shown(render(scene, SIZE, few))
    off = _rms(fast, slow, _is_inside(slow))
    return Section(
        "Bumps seen from afar",
        f"`python -m benchmarks afar`: chrome with bumps, {FRAMES} frames of {SIZE[0]}x{SIZE[1]} pixels each, "
        "from where bumps are seen one by one to where none is; a ball "
        "that shrinks, a plane that sinks away. Root mean square errors, in steps of 255 as a display shows them, "
        f"over the pixels that the surface fills, against {SAMPLES} samples a pixel of level 0; and the largest "
        "change from one frame to the next, over the truth's. trilinear: one sample a pixel, levels of slopes and "
        "of the environment by the longer side, as texture units read them; 4 samples: `balanced` without spread; "
        "toksvig: with one variance, and one look-up; balanced: with three moments, and three look-ups along the "
        "blur. Stone and waves have slopes about as a bell curve has them, which is what a variance tells of; dents "
        "and bricks are flat where they are not steep, and mirror sharply through a haze: balanced keeps the share of "
        "their flat places, and looks these up for themselves. The truth is the GPU's: on one frame it is "
        f"{off:.2g} steps from the float64 reference's (256 samples each).",
        (Table(("journey", "by", "error, steps", "over trilinear's", "jump over the truth's"), rows),),
        targets,
    )


def strip(path: Path, frames: int = 5) -> None:
    """A picture of the journeys, from near to far, each frame as large as its surface: the truth above,
    trilinear, balanced."""
    from PIL import Image

    rows: list[list[npt.NDArray[np.uint8]]] = []
    with Renderer() as renderer:
        for journey in journeys():
            scenes = [journey.scene(float(far)) for far in np.linspace(0, 0.75, frames)]
            for how in (Quality("exact", samples=256), WAYS["trilinear"], WAYS["balanced"]):
                shown = [_shown(renderer.render(scene, (96, 96), how)) for scene in scenes]
                rows.append([_enlarged(picture) for picture in shown])
    Image.fromarray(np.concatenate([np.concatenate(row, axis=1) for row in rows])).save(path)


def _enlarged(picture: F64) -> npt.NDArray[np.uint8]:
    """(192, 192, 3) of the square round what is covered, pixel by pixel."""
    from PIL import Image

    reach = np.abs(np.argwhere(picture[..., 3] > 0) - 47.5).max()
    inside = slice(round(47.5 - reach), round(48.5 + reach))
    square = np.rint(picture[inside, inside, :3]).astype(np.uint8)
    return np.asarray(Image.fromarray(square).resize((192, 192), Image.Resampling.NEAREST))


if __name__ == "__main__":
    from benchmarks.command import alone

    alone(measure)
