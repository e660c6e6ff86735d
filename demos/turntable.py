"""Many frames, one context: the camera goes round a golden ring.

Usage: python demos/turntable.py [FOLDER] [PIXELS] [FRAMES]
"""

import math
import sys
from pathlib import Path

import glbump as gb
from glbump.demo import write_maps

folder = Path(sys.argv[1] if len(sys.argv) > 1 else "out/turntable")
pixels = int(sys.argv[2]) if len(sys.argv) > 2 else 384
frames = int(sys.argv[3]) if len(sys.argv) > 3 else 36
write_maps(folder / "maps", ["evening.exr", "stone.exr"])

scene = gb.Scene(
    surfaces=[
        gb.Surface(
            gb.Torus(1, 0.42),
            material=gb.Material(base_color=(1, 0.71, 0.29), metallic=1, roughness=0.05),
            bump=gb.Bump(folder / "maps/stone.exr", amplitude=0.05, repeat=(6, 2)),
            transform=gb.Transform(rotate=(60, 0, 0)),
        )
    ],
    environment=gb.LatLong(folder / "maps/evening.exr"),
)
# The maps are read and uploaded once: after the first frame only the camera changes.
with gb.Renderer() as renderer:
    for i in range(frames):
        angle = 2 * math.pi * i / frames
        turned = gb.with_value(scene, "camera.eye", (4 * math.sin(angle), 0.6, 4 * math.cos(angle)))
        frame = renderer.render(turned, size=(pixels, pixels))
        frame.save(folder / f"frame-{i:03}.png", tone="filmic")
print(f"{frames} frames in {folder}, the last in {sum(frame.stats['ms'].values()):.1f} ms")
