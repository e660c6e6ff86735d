"""Glossy light: roughness chains and sampled lobes against quadrature over every texel, and what they cost."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from benchmarks.figures import Cell, Section, Table, Target
from benchmarks.scenes import PANORAMAS, panoramas
from glbump.camera import Camera
from glbump.environment import LatLong
from glbump.gl import bake
from glbump.gl.context import Context
from glbump.gl.renderer import Renderer
from glbump.maps import gloss
from glbump.maps.cube import sample_levels
from glbump.maps.layout import CUBE, EnvironmentMap, row_edges, sample, texel_dirs
from glbump.maps.levels import environment_levels
from glbump.quality import Quality
from glbump.reference import direction, ggx, reflect
from glbump.reference.filter import through_levels
from glbump.reference.lobe import Facets
from glbump.scene import Material, Scene, Surface
from glbump.shapes import Sphere
from glbump.trade.timing import in_turns, ratios, spread

F64 = npt.NDArray[np.float64]

PROMISED = ("venice", "KernerEnv")
THREE_MS, VTK_MS = 275.0, 15_000.0
"""Noted before: three.js's PMREM, warm, and VTK's, faces of 256x256 on the same driver."""


def _texels(environment: EnvironmentMap) -> tuple[F64, F64, F64]:
    """Directions, solid angles and radiance of all texels, in rows."""
    width = environment.size[0]
    area = np.repeat(-np.diff(np.cos(row_edges(environment))) * 2 * np.pi / width, width)
    return environment.texel_dirs().reshape(-1, 3), area, environment.pixels.reshape(-1, 3).astype(np.float64)


def _rms(got: F64, wanted: F64) -> float:
    return 100 * float(np.sqrt(np.mean((got - wanted) ** 2) / np.mean(wanted**2)))


def _chain_error(chain: list[npt.NDArray[np.float32]], truth: list[tuple[Any, F64]]) -> float:
    """Of the worst level, percent."""
    return max(_rms(level.reshape(-1, 3)[pick], wanted) for level, (pick, wanted) in zip(chain[1:], truth))


def _chain_truth(environment: EnvironmentMap, size: int, count: int) -> list[tuple[Any, F64]]:
    dirs, area, radiance = _texels(environment)
    rng, result = np.random.default_rng(5), []
    for i, alpha in enumerate(gloss.chain_alphas(size, 1), 1):
        n = size >> i
        pick = rng.choice(6 * n * n, min(count, 6 * n * n), replace=False)
        weight = ggx.lobe_shape(texel_dirs(CUBE, (n, n)).reshape(-1, 3)[pick] @ dirs.T, alpha) * area
        result.append((pick, (weight @ radiance) / weight.sum(axis=1, keepdims=True)))
    return result


def _chains(
    context: Context, pictures: dict[str, EnvironmentMap], quick: bool
) -> tuple[list[list[Cell]], list[Target]]:
    rows: list[list[Cell]] = []
    targets: list[Target] = []
    ways = [
        ("drawn", 128, 64),
        ("drawn", 128, 256),
        ("tree", 128, 64),
        ("tree", 128, 256),
        ("drawn", 256, 32),
        ("drawn", 256, 64),
    ]
    for name, environment in pictures.items():
        for how, size, samples in ways[:1] if quick else ways:

            def make(how: str = how, size: int = size, samples: int = samples, of: EnvironmentMap = environment) -> Any:
                if how == "drawn":
                    return bake.gloss_chain(context, of, size, samples)
                return gloss.gloss_chain(of, size, samples)

            times = in_turns({"it": make}, 1 if quick else 3, warm_up=1)["it"]
            error = _chain_error(make(), _chain_truth(environment, size, 4 if quick else 40))
            wall, cpu = 1e3 * min(times.wall), 1e3 * min(times.cpu)
            rows.append([name, how, size, samples, error, wall, cpu])
            if name not in PROMISED or quick:
                continue
            what = f"{name}, {how}, faces of {size}, {samples} samples"
            if size == 128:
                targets.append(Target.at_most(f"{what}: error", error, 2.0 if samples == 64 else 0.5, " %"))
            elif samples == 32:
                # One core's work is nearly half of the wall clock's on two.
                targets.append(
                    Target.at_most(f"{what}: CPU time on both cores, three.js 275 ms each", cpu, 2 * THREE_MS, " ms")
                )
                targets.append(Target.at_most(f"{what}: a twentieth of VTK's time", cpu, VTK_MS / 20, " ms"))
                targets.append(Target.at_most(f"{what}: error", error, 2.0, " %"))
    return rows, targets


def _pairs(count: int, cosine: float) -> tuple[F64, F64]:
    """Directions to the eye and normals, at one angle."""
    rng = np.random.default_rng(3)
    n = rng.normal(size=(count, 3))
    n /= np.linalg.norm(n, axis=1, keepdims=True)
    x, y = direction.axes_across(n)
    turn = rng.uniform(0, 2 * np.pi, count)[:, None]
    return cosine * n + np.sqrt(1 - cosine**2) * (np.cos(turn) * x + np.sin(turn) * y), n


def _lobe_truth(environment: EnvironmentMap, v: F64, n: F64, roughness: float) -> F64:
    dirs, area, radiance = _texels(environment)
    alpha, result = roughness**2, []
    for eye, normal in zip(v, n):
        h = dirs + eye
        h /= np.linalg.norm(h, axis=1, keepdims=True)
        tail = np.sum(np.cross(h, normal) ** 2, axis=1) + (alpha * (h @ normal)) ** 2
        weight = ggx.unshadowed(float(eye @ normal), dirs @ normal, alpha) / tail**2 * area
        result.append(weight @ radiance / weight.sum())
    return np.array(result)


def _lobes(pictures: dict[str, EnvironmentMap], quick: bool) -> list[list[Cell]]:
    """Percent, over roughnesses and angles: what pixels show by the chain, and by facets."""
    rows: list[list[Cell]] = []
    count = 4 if quick else 16
    for name, environment in pictures.items():
        chain = gloss.gloss_chain(environment, 128, 64)
        levels = [
            EnvironmentMap(environment.layout, pixels, environment.scale, environment.offset)
            for pixels in environment_levels(environment)
        ]

        def averaged(dirs: F64, angle: F64, levels: list[EnvironmentMap] = levels) -> F64:
            level = 0.5 * np.log2(np.maximum(angle * levels[0].texels_per_radian ** 2, 1e-30))
            return through_levels(lambda i, at: sample(levels[i], dirs[at]), level, len(levels), "trilinear")

        for roughness in (0.2, 0.5, 0.8):
            for cosine in (1.0, 0.6, 0.2):
                v, n = _pairs(count, cosine)
                wanted = _lobe_truth(environment, v, n, roughness)
                look = ggx.lobe_dir(n, reflect.reflect_dir(-v, n), roughness)
                row: list[Cell] = [name, roughness, cosine, _rms(sample_levels(chain, look, roughness * 5), wanted)]
                row += [_rms(Facets(v, n, roughness, k).light(averaged, v, 1.0), wanted) for k in (16, 64, 256)]
                rows.append(row)
    return rows


def _costs(pictures: dict[str, EnvironmentMap], quick: bool) -> list[list[Cell]]:
    """Of frames, against the chain's, in turns."""
    size = (32, 32) if quick else (256, 256)
    environment = LatLong(PANORAMAS["venice"]) if "venice" in pictures else LatLong(np.ones((8, 16, 3), np.float32))
    scene = Scene([Surface(Sphere(), Material(metallic=1, roughness=0.4))], environment, Camera(eye=(0, 0, 2.4)))
    base = {"gloss_size": 16, "gloss_samples": 8}
    ways = {"chain": {"gloss": "chain"}} | {f"{n} facets": {"gloss": "sampled", "lobe_samples": n} for n in (4, 16, 64)}
    with Renderer() as renderer:
        qualities = {name: Quality("balanced", **base, **way) for name, way in ways.items()}  # type: ignore[arg-type]
        qualities["exact: 16 facets, 16 samples"] = Quality("exact")
        calls = {name: (lambda q=q: renderer.render(scene, size, q)) for name, q in qualities.items()}
        times = in_turns(calls, 1 if quick else 5)
    return [
        [name, str(ratios(t.cpu, times["chain"].cpu)), str(spread([1e3 * s for s in t.wall]))]
        for name, t in times.items()
    ]


def measure(quick: bool = False) -> Section:
    """Chains of faces of 128 and 256, and lobes at three angles and roughnesses."""
    pictures = panoramas()
    if quick:
        pictures = dict(list(pictures.items())[:1])
    with Renderer() as renderer:
        chains, targets = _chains(renderer.context, pictures, quick)
    return Section(
        "Glossy light",
        "Relative RMSE in percent, against quadrature over every texel. First the chain's levels, each for "
        "the lobe of n = v, the worst of them; then what a pixel shows, the lobe as the eye sees it at three angles "
        "(n.v): read from a chain of the tree, and summed over facets, the number that all samples of a pixel have "
        "together. Suns are left in. Last, frames of a rough ball, against the chain's.",
        (
            Table(("picture", "chain", "faces", "samples", "error, %", "wall, ms", "CPU, ms"), chains),
            Table(("picture", "roughness", "n.v", "chain", "16 facets", "64", "256"), _lobes(pictures, quick)),
            Table(("frame of 256x256, balanced", "CPU time to the chain's", "wall, ms"), _costs(pictures, quick)),
        ),
        targets,
    )


if __name__ == "__main__":
    from benchmarks.command import alone

    alone(measure)
