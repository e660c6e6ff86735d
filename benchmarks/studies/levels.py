"""Which level of detail a reflection should read, and how often: each filter's picture, error and cost."""

from __future__ import annotations

from pathlib import Path

from benchmarks.figures import Section
from benchmarks.scenes import CHROME, evening
from benchmarks.studies.settings import GAIN, few, table
from glbump.camera import Camera
from glbump.maps import patterns
from glbump.quality import Quality
from glbump.scene import Bump, Scene, Surface
from glbump.shapes import Plane, Sphere, Transform


def scene() -> Scene:
    """A mirror ball on a bumped mirror that goes off to the horizon: footprints long, thin, and of unresolved bumps."""
    bricks = Bump(patterns.bricks((256, 256)), 0.015, repeat=(24, 24))
    return Scene(
        [
            Surface(Sphere(1), CHROME),
            Surface(Plane((40, 40)), CHROME, bricks, transform=Transform(translate=(0, -1, 0))),
        ],
        evening(),
        Camera(eye=(0, 0.6, 4), target=(0, -0.2, 0), fov=45),
    )


SETTINGS = {
    "one trilinear sample, by the longer side": Quality(
        "balanced", samples=1, environment_level="longest", bump_spread="none"
    ),
    "level 0 alone": Quality("balanced", samples=1, environment_filter="bilinear", bump_filter="bilinear"),
    "nearest level": Quality("balanced", samples=1, environment_filter="nearest-level", bump_filter="nearest-level"),
    "trilinear, by area": Quality("balanced", samples=1, bump_spread="none"),
    "trilinear, by area, LEAN": Quality("balanced", samples=1),
    "4 samples, by the longer side": Quality("balanced", environment_level="longest", bump_spread="none"),
    "4 samples, level 0": Quality("balanced", environment_filter="bilinear", bump_filter="bilinear"),
    "4 samples, by area": Quality("balanced", bump_spread="none"),
    "4 samples, by area, LEAN (balanced)": Quality("balanced"),
    "16 samples, level 0 (exact)": Quality("exact"),
}


def study(folder: Path, quick: bool = False) -> Section:
    """A mirror ball on a bumped mirror, 240x180 (quick: 24x18)."""
    size, turns, samples = ((24, 18), 2, 16) if quick else ((240, 180), 15, 1024)
    shown = scene()
    rows = {what: (shown, quality) for what, quality in few(SETTINGS, quick).items()}
    return Section(
        "Which level a reflection reads",
        "Samples buy more than any choice of level; a level by the footprint's area keeps curved mirrors sharper than "
        "one by its longer side; and LEAN turns bumps finer than a pixel into blur, where the others sparkle as the "
        "picture moves, which the error of one that stands still does not see.\n\n"
        "A mirror ball on a bumped mirror that goes off to the horizon, in the demo's evening. Errors are against "
        f"{samples} samples a pixel, display-referred, over the whole picture; the picture of the error is {GAIN} "
        "times the difference. Times are over the first row's, all rows in turns; a row says what it changes of "
        "`balanced` or `exact`.",
        (table(folder, "levels", (shown, Quality("exact", samples=samples)), rows, size, turns),),
    )
