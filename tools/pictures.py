"""The pictures of docs/environments.md: exhibits of the gallery, small, and how each layout lies in a picture.
And those of docs/filtering.md.

Usage: python tools/pictures.py [FOLDER], by default docs/pictures; `make pictures`.
"""

from __future__ import annotations

import io
import sys
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import numpy.typing as npt
from PIL import Image

from glbump.demo import chosen, letters, write_maps
from glbump.demo.gallery import maps_of
from glbump.gl.renderer import Renderer
from glbump.maps.colour import display_bytes
from glbump.maps.convert import convert
from glbump.maps.files import write_atomically
from glbump.maps.images import Picture
from glbump.maps.layout import LAYOUTS, inside
from glbump.maps.pictured import environment_of, picture_of
from glbump.shown import ramp

EXHIBITS = (
    "simple",
    "medium",
    "complex",
    "mirror-ball",
    "normal-lookup",
    "axes",
    "hemicube",
    "hemisphere",
    "octahedral",
    "captured",
    "cross",
    "probe",
    "room",
    "glass",
)
WIDTH = 320
"""Pixels of a picture of the gallery."""

LAID = {
    "lat-long": ("lat-long", 160),
    "hcross": ("cube", 80),
    "vcross": ("cube", 80),
    "hemicube-cross": ("hemicube", 120),
    "equal-area": ("equal-area", 240),
    "equidistant": ("equidistant", 240),
    "orthographic": ("orthographic", 240),
    "dual-paraboloid": ("dual-paraboloid", 200),
    "octahedral": ("octahedral", 240),
    "angular": ("angular", 240),
    "mirror-ball": ("mirror-ball", 240),
}
"""How a picture is laid out: the layout, and its size."""


def write(path: Path, pixels: npt.NDArray[np.uint8]) -> None:
    """A PNG of 256 colours, which is a third as large."""
    buffer = io.BytesIO()
    Image.fromarray(pixels).quantize(256).save(buffer, "png", optimize=True)
    write_atomically(path, buffer.getvalue())


def gallery(folder: Path) -> None:
    """The exhibits as gallery-NAME.png."""
    with tempfile.TemporaryDirectory() as temporary, Renderer() as renderer:
        for exhibit in chosen(EXHIBITS):
            scene = exhibit.scene(Path(temporary))
            write_maps(Path(temporary), [name for name in maps_of(scene) if not (Path(temporary) / name).exists()])
            width, height = exhibit.size
            frame = renderer.render(scene, (WIDTH, WIDTH * height // width), "exact")
            drawn = Path(temporary) / "drawn.png"
            frame.save(drawn, tone="filmic", exposure=exhibit.exposure)
            write(folder / f"gallery-{exhibit.name}.png", np.asarray(Image.open(drawn).convert("RGB")))


def layouts(folder: Path) -> None:
    """The cube with its axes written on it as layout-NAME.png."""
    axes = environment_of(Picture(letters.axes(512), 32, True, None, "axes"), "vstrip", "inside")
    for laid, (name, size) in LAID.items():
        environment = convert(axes, LAYOUTS[name], size, "area")
        shown = inside(environment.layout, environment.size)[None, :, :, None]
        picture = picture_of(replace(environment, pixels=environment.pixels * shown), laid)
        write(folder / f"layout-{laid}.png", display_bytes(picture))


def shown(folder: Path) -> None:
    """What docs/filtering.md shows in place of light as show-NAME.png, and the ramp of its colours."""
    (exhibit,) = chosen(("brick-ball",))
    with tempfile.TemporaryDirectory() as temporary, Renderer() as renderer:
        scene = exhibit.scene(Path(temporary))
        write_maps(Path(temporary), maps_of(scene))
        for name in ("level", "normal", "footprint", "cost"):
            frame = renderer.render(scene, (200, 200), "balanced", show=name)
            write(folder / f"show-{name}.png", frame.display()[..., :3])
    codes = np.rint(255 * ramp(np.linspace(0, 1, 200))).astype(np.uint8)
    write(folder / "ramp.png", np.repeat(codes[None], 12, axis=0))


if __name__ == "__main__":
    target = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).resolve().parents[1] / "docs" / "pictures"
    layouts(target)
    gallery(target)
    shown(target)
