"""How maps of bumps are stored: every format costs what the plan says, and the GPU reads what was stored."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest

from glbump import quality as quality_module
from glbump import reference
from glbump.camera import Camera
from glbump.environment import LatLong
from glbump.gl.renderer import Renderer
from glbump.maps.angles import degrees_between
from glbump.maps.bump_formats import BUMP_FORMATS
from glbump.maps.layout import LATLONG, texel_dirs
from glbump.quality import Quality
from glbump.scene import Bump, Material, NormalMap, Scene, Surface
from glbump.shapes import Plane, Sphere

MIRROR = Material(metallic=1, roughness=0)
DIRS = texel_dirs(LATLONG, (256, 128))[0]
# Looked up by the normal, the colour is the normal.
NORMAL = LatLong((0.5 + 0.5 * DIRS).astype(np.float32), lookup="normal", background=False)
SIZE = 64
X, Y = np.meshgrid((np.arange(SIZE) + 0.5) / SIZE, 1 - (np.arange(SIZE) + 0.5) / SIZE)
WAVES = (0.5 + 0.25 * np.sin(2 * np.pi * X) + 0.25 * np.cos(2 * np.pi * (X + Y))).astype(np.float32)
SLANTED = np.stack([0.3 * np.sin(2 * np.pi * X), 0.25 * np.cos(2 * np.pi * Y), np.ones_like(X)], axis=-1)
NORMALS = (SLANTED / np.linalg.norm(SLANTED, axis=-1, keepdims=True) * 0.5 + 0.5).astype(np.float32)
BUMPS: dict[str, Any] = {"heights": Bump(WAVES, 0.1), "normals": NormalMap(NORMALS)}
# Pixels lie on the texels of a map that covers the plane.
ON_TEXELS = Camera(eye=(0, 3, 0), target=(0, 0, 0), up=(0, 0, -1), projection="orthographic", height=2)
# So that of the sphere only what is near its equator is seen: at the poles u gets short, and slopes by it steep.
BALL = Camera(eye=(0, 0, 4), target=(0, 0, 0), fov=10)
FLOAT_ANGLE = 0.02
"""Degrees that the GPU may be off by at float formats: the issue's figure."""


def normals(frame: Any) -> Any:
    n = 2 * frame.pixels[..., :3].astype(np.float64) - 1
    return n / np.linalg.norm(n, axis=-1, keepdims=True)


def look(renderer: Renderer, scene: Scene, name: str, how: str = "exact", **knobs: str) -> tuple[Any, Any, str]:
    """Normals as the GPU draws them, and as the reference does, of a format; and what the plan says of it."""
    quality = Quality(how, samples=1, bump_format=name, **knobs)  # type: ignore[arg-type]
    got, twin = renderer.render(scene, (SIZE, SIZE), quality), reference.render(scene, (SIZE, SIZE), 1, quality=quality)
    said = {c.what: f"{c.value}: {c.why}" for c in renderer.plan(scene, (SIZE, SIZE), quality).choices}
    return normals(got), normals(twin), said["surface 0 bump format"]


def told(said: str) -> tuple[float | None, float]:
    """Mean and worst that a plan names, in degrees."""
    mean, worst = re.search(r"([\d.e-]+) degrees on average", said), re.search(r"([\d.e-]+)(?: degrees)? at most", said)
    assert worst is not None
    return float(mean[1]) if mean else None, float(worst[1])


@pytest.mark.parametrize("what", BUMPS)
@pytest.mark.parametrize("name", quality_module.KNOBS["bump_format"].values)
def test_it_costs_what_the_plan_says(renderer: Renderer, name: str, what: str) -> None:
    """Against the reference at floats: at texels of a plane, and on a sphere between them."""
    flat = Scene([Surface(Plane(), MIRROR, BUMPS[what])], NORMAL, ON_TEXELS)
    truth = normals(reference.render(flat, (SIZE, SIZE), 1))
    got, twin, said = look(renderer, flat, name)
    mean, worst = told(said)
    off = degrees_between(got, truth)
    # 2e-4: 32-bit floats, and the compass's own.
    assert off.max() < min(worst * 1.01 + 2e-4, worst + FLOAT_ANGLE)
    assert mean is None or off.mean() < 1.3 * mean + 1e-4
    assert degrees_between(got, twin).max() < 2e-4
    # The error is the format's: it is there.
    assert off.max() > worst / 6 or worst < 1e-3
    ball = Scene([Surface(Sphere(), MIRROR, BUMPS[what])], NORMAL, BALL)
    got, twin, said = look(renderer, ball, name)
    rounds = 3 if " 8 bits" in said else 1
    _, worst = told(said)
    # 2e-3: between texels components of normals are averaged, not slopes: the square of their steps of 2 degrees.
    assert degrees_between(got, normals(reference.render(ball, (SIZE, SIZE), 1))).max() < 1.1 * rounds * worst + 2e-3
    assert degrees_between(got, twin).max() < (rounds * worst if rounds > 1 else 3e-4)


def test_names_are_those_of_the_quality() -> None:
    assert sorted(BUMP_FORMATS) == sorted(quality_module.KNOBS["bump_format"].values)


@pytest.mark.parametrize("name", quality_module.KNOBS["bump_format"].values)
def test_flat_is_exactly_flat(renderer: Renderer, name: str) -> None:
    level = np.full((8, 8, 3), (0.0, 0.0, 1.0)) * 0.5 + 0.5
    up = None
    for bump in (None, NormalMap(level.astype(np.float32)), Bump(np.full((8, 8), 0.7, np.float32), 0.1)):
        scene = Scene([Surface(Plane(), MIRROR, bump)], NORMAL, ON_TEXELS)
        pixels = renderer.render(scene, (8, 8), Quality("exact", samples=1, bump_format=name)).pixels
        up = pixels if up is None else up
        # 16 bits have steps of 1.5e-5, and 32-bit floats find the middle one to 1e-2 of a step.
        assert np.abs(pixels - up).max() < 2e-7


def test_heights_go_beside_slopes_in_codes(renderer: Renderer) -> None:
    """With the full terms, where the height itself counts: on a sphere a bump that is no slope at all."""
    bump = Bump(1 + WAVES, 0.2)
    ball = Scene([Surface(Sphere(), MIRROR, bump)], NORMAL, BALL)
    for name, limit in (("slopes16", 2e-3), ("half", 0.05)):
        full = Quality("exact", samples=1, bump_format=name, bump_terms="full")
        want = normals(reference.render(ball, (SIZE, SIZE), 1, quality=Quality("exact", bump_terms="full")))
        small = normals(reference.render(ball, (SIZE, SIZE), 1, quality=Quality("exact", bump_terms="small")))
        assert degrees_between(normals(renderer.render(ball, (SIZE, SIZE), full)), want).max() < limit
        assert degrees_between(small, want).max() > 1


def test_levels_are_of_slopes(renderer: Renderer) -> None:
    """Far off, bumps average to their mean slope in every format that has levels; no format of level 0 does."""
    tilted = np.stack([0.3 * np.sin(2 * np.pi * X) - 0.2, 0 * X, np.ones_like(X)], axis=-1)
    picture = (tilted / np.linalg.norm(tilted, axis=-1, keepdims=True) * 0.5 + 0.5).astype(np.float32)
    scene = Scene([Surface(Plane(), MIRROR, NormalMap(picture, repeat=(110.3, 110.3)))], NORMAL, ON_TEXELS)
    mean = np.array([-0.2, 1, 0]) / np.hypot(0.2, 1)
    for name, kind in BUMP_FORMATS.items():
        # Directions in colours have a mean of their own: blurred by what slopes vary, it is a degree off.
        got, twin, said = look(renderer, scene, name, "balanced", bump_spread="none")
        # Half of the pixels, so that a step of 8 bits counts.
        off = float(np.median(degrees_between(got, mean)))
        if kind.is_filtered:
            assert off < 0.25, name  # 0.07 of 8 bits, 0.04 of the others: the frame is of halves
        else:
            assert off > 3.0, name
            assert "level 0" in said
        # Of halves a frame is good to 0.05 degrees; of 8 bits texels are, to what the plan says.
        assert np.median(degrees_between(got, twin)) < 0.1 + (3 * told(said)[1] if kind.bits == 8 else 0)


def test_what_does_not_fit_is_said(renderer: Renderer) -> None:
    heights = Scene([Surface(Plane(), MIRROR, BUMPS["heights"])], NORMAL)
    for name in ("rg8", "rgb10", "oct24"):
        said = look(renderer, heights, name)[2]
        assert said.startswith(
            f"slopes16: {name} holds normals, and heights have slopes by u and v; normals are off by "
        )
    steep = Scene([Surface(Plane(), MIRROR, Bump(1e5 * WAVES, 1e-6))], NORMAL)
    assert look(renderer, steep, "half")[2].startswith("float: values up to ")
    assert look(renderer, steep, "slopes16")[2].startswith("slopes16: normals are off by ")
    read = Quality("balanced", bump_read="shader")
    choice = {c.what: c for c in renderer.plan(heights, (64, 64), read).choices}["surface 0 bump format"]
    assert (choice.value, choice.why) == ("float", "differences of what has fewer bits would be mostly rounding")
