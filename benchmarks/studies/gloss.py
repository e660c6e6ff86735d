"""Glossy balls of metal and plastic by every method: blurred chains of every size, facets, and two tables of shares."""

from __future__ import annotations

from pathlib import Path

from benchmarks.figures import Section
from benchmarks.scenes import DATA
from benchmarks.studies.settings import GAIN, few, table
from glbump.camera import Camera
from glbump.demo import panorama
from glbump.environment import LatLong
from glbump.quality import Quality
from glbump.scene import Material, Scene, Surface
from glbump.shapes import Sphere, Transform

ROUGHNESS = (0.2, 0.5, 0.8)


def scene() -> Scene:
    """Six balls: metal above, plastic below, rougher from left to right."""
    venice = DATA / "cc0" / "venice.exr"
    rows: list[tuple[float, tuple[float, float, float], float]] = [
        (1, (0.95, 0.8, 0.55), 1),
        (-1, (0.5, 0.05, 0.05), 0),
    ]
    balls = [
        Surface(Sphere(0.95), Material(colour, metallic, r), transform=Transform(translate=(2 * i - 2, y, 0)))
        for y, colour, metallic in rows
        for i, r in enumerate(ROUGHNESS)
    ]
    light = LatLong(venice) if venice.is_file() else LatLong(panorama.evening(256))
    return Scene(balls, light, Camera(eye=(0, 0, 12), fov=20))


SETTINGS = {
    "balanced: chain, drawn, 128, 64 texels": Quality("balanced"),
    "chain, 32 pixels": Quality("balanced", gloss_size=32),
    "chain, 256 pixels": Quality("balanced", gloss_size=256),
    "chain, 8 texels": Quality("balanced", gloss_samples=8),
    "chain, summed over a tree": Quality("balanced", gloss_chain="tree"),
    "chain, share by the fit": Quality("balanced", dfg="fit"),
    "chain, suns kept in it": Quality("balanced", suns="kept"),
    "sampled, 4 facets": Quality("balanced", gloss="sampled", lobe_samples=4),
    "sampled, 16 facets": Quality("balanced", gloss="sampled", lobe_samples=16),
    "sampled, 64 facets": Quality("balanced", gloss="sampled", lobe_samples=64),
    "exact": Quality("exact"),
}
TRUTH = Quality("exact", samples=64, lobe_samples=64)


def study(folder: Path, quick: bool = False) -> Section:
    """Six balls, 192x128 (quick: 12x8)."""
    size, turns = ((12, 8), 1) if quick else ((192, 128), 9)
    shown = scene()
    truth = Quality("exact", samples=4, lobe_samples=4) if quick else TRUTH
    rows = {what: (shown, quality) for what, quality in few(SETTINGS, quick).items()}
    return Section(
        "Glossy methods",
        "Balls of metal (above) and of plastic, of roughness 0.2, 0.5 and 0.8. A chain is the environment blurred once "
        "for each of a few roughnesses, seen as if along the normal: one look-up a sample, wrong where lobes "
        "are seen at a slant, towards the balls' rims, whatever its size or who makes it. Facets are summed anew at "
        "every sample of a pixel, as the eye sees them: their error falls with their number, and their cost rises with "
        f"it. The truth is {TRUTH.samples} samples of {TRUTH.lobe_samples} facets a pixel; errors are "
        f"display-referred, over the whole picture, their pictures {GAIN} times; times are over the first row's, of "
        "frames whose chain is made. A row says what it changes of `balanced`. Lobes and chains by themselves, "
        "against quadrature: [benchmarks](../benchmarks.md#glossy-light); the formulas: [gloss](../gloss.md).",
        (table(folder, "gloss", (shown, truth), rows, size, turns),),
    )
