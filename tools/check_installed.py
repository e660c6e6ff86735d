"""What a fresh install must do, away from the checkout: compile every shader, and draw a picture of the gallery.

Usage: python -I tools/check_installed.py FOLDER
"""

from __future__ import annotations

import itertools
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

import glbump as gb
from glbump.demo import write_maps
from glbump.gl import source
from glbump.gl.program import build_program
from glbump.gl.renderer import Renderer
from glbump.gl.screen import Screen
from glbump.maps.colour import TONES


def scenes(folder: Path) -> list[gb.Scene]:
    """Scenes that between them ask for every piece of every shader."""
    write_maps(folder, ["knot.obj"])
    grey = np.linspace(0.1, 1, 128, dtype=np.float32).reshape(8, 16)
    colour = np.stack([grey, grey[::-1], grey], axis=-1)
    up = np.zeros((4, 4, 3), np.float32) + (0, 0, 1)
    shapes = [gb.Quad(), gb.Plane(), gb.Cube(), gb.Sphere(), gb.Torus(), gb.MeshFile(folder / "knot.obj")]
    bumps = [None, gb.Bump(grey, amplitude=0.1), gb.NormalMap(up)]
    materials = [
        gb.Material(metallic=1, roughness=0),
        gb.Material(base_color=(0.9, 0.6, 0.3), metallic=1, roughness=0),
        gb.Material(roughness=0),
        gb.Material(roughness=0.4),
    ]
    places = [gb.Transform(), gb.Transform(rotate=(30, 40, 0)), gb.Transform(scale=(1, 0.5, 1), rotate=(0, 0, 20))]
    environments = [
        gb.LatLong(colour),
        gb.LatLong(colour, lookup="normal", background=False),
        gb.CubeMap(np.broadcast_to(colour[:, :8], (6, 8, 8, 3)).copy(), rotation=30),
        gb.Sky(),
        gb.Chrome(exposure=1),
        gb.Fractal(steps=8),
    ]
    turn = itertools.cycle(itertools.product(places, environments))
    made = []
    for shape, bump, material in itertools.product(shapes, bumps, materials):
        place, environment = next(turn)
        made.append(gb.Scene([gb.Surface(shape, material, bump, place)], environment))
    return made


def main() -> None:
    folder = Path(sys.argv[1])
    assert Path(gb.__file__).is_relative_to(sys.prefix), f"{gb.__file__} is not the installed package"
    shaders = source.find_shaders()
    assert shaders.is_relative_to(sys.prefix), f"{shaders} is not the installed folder"
    stages = {p.name for p in shaders.iterdir() if p.suffix in (".vert", ".frag")}
    seen: set[str] = set()
    read = source._Resolver.read

    def note(self: source._Resolver, path: Path) -> str:
        seen.add(path.name)
        return read(self, path)

    source._Resolver.read = note  # type: ignore[method-assign]
    cubes = gb.Quality("fast", environment_filter="trilinear")
    with Renderer() as renderer:
        drawn = scenes(folder)
        for scene, quality in zip(drawn, itertools.cycle(("fast", "balanced", cubes, "exact", cubes))):
            pixels = renderer.render(scene, (16, 16), quality).pixels
            assert np.isfinite(pixels).all(), scene
        renderer.render(replace(drawn[0], camera=gb.Camera(projection="orthographic")), (16, 16))
        gl = renderer.context.gl
        # Of windows; without one they compile all the same.
        window = Screen(renderer.context)
        for tone in ("", *TONES):
            window._program(tone)
        window.release()
        screen = source.resolve(text="void main() { gl_Position = vec4(0.0); }", stage="vertex")
        libraries = sorted(p.name for p in (shaders / "lib").glob("*.glsl"))
        for name in libraries:
            alone = source.resolve(text=f'#include "lib/{name}"\nvoid main() {{}}\n', stage="fragment")
            build_program(gl, screen, alone).release()
        renderer_name = renderer.context.info["renderer"]
    assert stages <= seen, f"no scene here compiles {sorted(stages - seen)}"
    print(
        f"{len(drawn)} scenes, {len(stages)} stages and {len(libraries)} libraries compiled by {renderer_name}",
        flush=True,
    )

    command = Path(sys.executable).with_name("glbump")
    subprocess.run([command, "demo", "-o", folder, "--only", "brick-ball"], check=True, stdin=subprocess.DEVNULL)
    assert (folder / "brick-ball.png").stat().st_size > 100_000


if __name__ == "__main__":
    main()
