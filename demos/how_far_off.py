"""What each quality costs and how far it is from the float64 truth.

Usage: python demos/how_far_off.py [FOLDER] [PIXELS]
"""

import sys
from pathlib import Path

import glbump as gb
from glbump.demo import write_maps
from glbump.trade.metrics import compare

folder = Path(sys.argv[1] if len(sys.argv) > 1 else "out")
pixels = int(sys.argv[2]) if len(sys.argv) > 2 else 192
size = (pixels, pixels)
maps = folder / "maps"
write_maps(maps, ["evening.exr", "dimples.exr"])

ball = gb.Surface(
    gb.Sphere(),
    material=gb.Material(metallic=1, roughness=0),
    bump=gb.Bump(maps / "dimples.exr", amplitude=0.03, repeat=(3, 1.5)),
)
scene = gb.Scene(surfaces=[ball], environment=gb.LatLong(maps / "evening.exr"))
truth = gb.reference.render(scene, size=size, samples=64)

print("quality   samples      ms    mean     p99  of display white")
with gb.Renderer() as renderer:
    for quality in ("fast", "balanced", "exact"):
        renderer.render(scene, size, quality)  # the first one compiles
        frame = renderer.render(scene, size, quality)
        off = compare(frame.pixels, truth.pixels, perceptual=False)
        took = sum(frame.stats["ms"].values())
        print(f"{quality:9} {frame.stats['plan']['samples']:>7} {took:7.1f} {off['mean']:7.4f} {off['p99']:7.4f}")
