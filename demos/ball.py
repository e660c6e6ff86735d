"""Ten lines: a chrome ball of bricks.

Usage: python demos/ball.py [FOLDER] [PIXELS]
"""

import sys
from pathlib import Path

import glbump as gb
from glbump.demo import write_maps

folder = Path(sys.argv[1] if len(sys.argv) > 1 else "out")
pixels = int(sys.argv[2]) if len(sys.argv) > 2 else 512
maps = folder / "maps"
write_maps(maps, ["evening.exr", "bricks.exr"])  # any pictures of yours do as well

scene = gb.Scene(
    surfaces=[
        gb.Surface(
            gb.Sphere(),
            material=gb.Material(metallic=1, roughness=0),
            bump=gb.Bump(maps / "bricks.exr", amplitude=0.045, repeat=(4, 2)),
        )
    ],
    environment=gb.LatLong(maps / "evening.exr"),
    camera=gb.Camera(eye=(0, 0.25, 3.5), fov=45),
)
frame = gb.render(scene, size=(pixels, pixels))
frame.save(folder / "ball.png", tone="filmic")
print(frame.stats["renderer"], frame.stats["ms"])
