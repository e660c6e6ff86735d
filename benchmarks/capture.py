"""What a capture costs: six faces against six plain pictures of their size."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import replace

from benchmarks.figures import Cell, Section, Table, Target
from benchmarks.scenes import CHROME, DATA, bumped_ball, evening, mirror_ball, two_surfaces
from glbump.captures import cameras, seen_by
from glbump.environment import Captured, LatLong
from glbump.gl.renderer import Renderer
from glbump.scene import Scene, Surface
from glbump.shapes import Sphere, Transform, Vec3
from glbump.trade.timing import in_turns, ratios, spread

RATIO = 1.2
"""Most that a capture may cost, in plain pictures of its faces' size."""

_SMALL = (8, 8)
_PLACE: Vec3 = (0, 2.5, 0)


def with_mirror(scene: Scene, size: int) -> Scene:
    """The scene with a small mirror ball over it that captures it."""
    captured = Captured(size=size, position=_PLACE)
    ball = Surface(Sphere(0.3), CHROME, transform=Transform(translate=_PLACE), environment=captured)
    return replace(scene, surfaces=[*scene.surfaces, ball])


def calls(renderer: Renderer, scene: Scene, size: int, quality: str) -> dict[str, Callable[[], object]]:
    """A picture of a few pixels that captures anew, one that does not, and six plain pictures of what is captured, read
    back. Each draws another scene than the last time, so that nothing is kept from it."""
    scenes = [with_mirror(replace(scene, environment=replace(scene.environment, exposure=e)), size) for e in (0.0, 0.1)]
    (captured,) = (s.environment for s in scenes[0].surfaces if isinstance(s.environment, Captured))
    views = [[replace(seen_by(scene, captured, 1), camera=camera) for camera in cameras(captured)] for scene in scenes]
    next_scene, next_plain, next_views = itertools.cycle(scenes), itertools.cycle(scenes), itertools.cycle(views)
    return {
        "capture": lambda: renderer.render(next(next_scene), _SMALL, quality),
        "none": lambda: renderer.render(next(next_plain), _SMALL, quality, recapture=False),
        "six": lambda: [renderer.render(view, (size, size), quality) for view in next(next_views)],
    }


def measure(quick: bool = False) -> Section:
    """Faces of 256x256, three scenes (quick: 32x32, one), fast and balanced."""
    size, turns = (32, 3) if quick else (256, 31)
    path = DATA / "openexr" / "KernerEnvLatLong.exr"
    environment = LatLong(path) if path.is_file() else evening()
    light = path.name if path.is_file() else "the demo's evening"
    rows: list[list[Cell]] = []
    targets = []
    kinds = (("mirror ball", mirror_ball), ("bumped chrome", bumped_ball), ("two surfaces", two_surfaces))
    for name, make in kinds[:1] if quick else kinds:
        for quality in ("fast", "balanced"):
            with Renderer() as renderer:
                times = in_turns(calls(renderer, make(environment), size, quality), turns)
            # What a picture of a few pixels costs by itself is no part of the capture.
            capture, cpu = (
                [a - b for a, b in zip(getattr(times["capture"], kind), getattr(times["none"], kind), strict=True)]
                for kind in ("wall", "cpu")
            )
            wall, cpu_ratio = ratios(capture, times["six"].wall), ratios(cpu, times["six"].cpu)
            six = 1e3 * spread(times["six"].wall).median
            rows.append([name, quality, str(wall), str(cpu_ratio), 1e3 * spread(capture).median, six])
            targets.append(Target.at_most(f"capture, {name}, {quality}", wall.median, RATIO, " times"))
    return Section(
        "A capture costs what its six pictures cost",
        f"A frame whose mirror ball captures {light} and what stands in it onto six faces of {size}x{size}, "
        "less the same frame when it does not, against six plain pictures of that size along the same axes, read back. "
        "The scene changes every time.",
        (Table(("scene", "quality", "wall clock", "CPU time", "capture, ms", "six, ms"), rows),),
        targets,
    )


if __name__ == "__main__":
    from benchmarks.command import alone

    alone(measure)
