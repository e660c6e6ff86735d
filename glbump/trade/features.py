"""What a plan leaves out of a scene, forced on: by changes of the scene that leave its picture as it is."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from glbump.environment import Captured, Pictured, SphereBounds
from glbump.errors import GlbumpError
from glbump.plan import Plan
from glbump.plan.choices import GLOSSY, NONE, WHITE_MIRROR
from glbump.quality import Quality
from glbump.scene import Bump, Material, Scene, Surface
from glbump.trade.settings import FEATURE, Setting, work

LITTLE = 1e-6
"""What is added so that a plan cannot leave a feature out; far below what any display shows."""


@dataclass(frozen=True)
class Feature:
    """What a plan may leave out, and how it is forced.

    changed: the scene with the feature, None where it does not go. quality: the knobs that force it as well.
    """

    name: str
    what: str
    is_left_out: Callable[[Plan], bool]
    changed: Callable[[Scene], Scene]
    quality: Callable[[Quality], Quality] = lambda quality: quality


def _surfaces(change: Callable[[Surface], Surface]) -> Callable[[Scene], Scene]:
    return lambda scene: replace(scene, surfaces=[change(s) for s in scene.surfaces])


def _materials(change: Callable[[Material], Material]) -> Callable[[Scene], Scene]:
    return _surfaces(lambda surface: replace(surface, material=change(surface.material)))


def _any(name: str, value: int) -> Callable[[Plan], bool]:
    return lambda plan: any(surface.has(name) == value for surface in plan.surfaces)


def _flat(surface: Surface) -> Surface:
    """With heights that are level, and still read."""
    if surface.bumps:
        return surface
    return replace(surface, bump=Bump(np.zeros((256, 256), np.float32), amplitude=0.01))


def _tinted(material: Material) -> Material:
    red, green, blue = (min(c, 1 - LITTLE) for c in material.base_color)
    return replace(material, base_color=(red, green, blue))


def _around(scene: Scene) -> Scene:
    """In a room whose walls are far off."""
    environment = scene.environment
    if not isinstance(environment, Pictured) or isinstance(environment, Captured) or environment.bounds is not None:
        return scene
    return replace(scene, environment=replace(environment, bounds=SphereBounds(environment.position, 1 / LITTLE)))


def _turned(scene: Scene) -> Scene:
    environment = scene.environment
    return replace(scene, environment=replace(environment, rotation=environment.rotation + LITTLE))


FEATURES: tuple[Feature, ...] = (
    Feature(
        "bumps",
        "level heights on surfaces that have none: slopes, normals bent by nothing",
        _any("BUMP", 0),
        _surfaces(_flat),
    ),
    Feature(
        "tint",
        "Fresnel's share of a mirror's colour, where white mirrors are the environment itself",
        _any("LIGHT", WHITE_MIRROR),
        _materials(_tinted),
    ),
    Feature(
        "roughness",
        "the roughness chain and its light, where surfaces are smooth",
        lambda plan: any(surface.has("LIGHT") != GLOSSY for surface in plan.surfaces),
        _materials(lambda m: m if m.roughness > 0 else replace(m, roughness=LITTLE)),
    ),
    Feature(
        "diffuse light",
        "light from all sides, where metal scatters none",
        _any("DIFFUSE", 0),
        _materials(lambda m: replace(m, metallic=min(m.metallic, 1 - LITTLE))),
    ),
    Feature(
        "refraction",
        "light through surfaces that let none through",
        _any("TRANSMISSION", 0),
        _materials(
            lambda m: replace(m, metallic=min(m.metallic, 1 - LITTLE), transmission=max(m.transmission, LITTLE))
        ),
    ),
    Feature(
        "parallax",
        "the place from which each reflection is seen, in a room whose walls are too far off for it",
        _any("PARALLAX", 0),
        _around,
        lambda quality: replace(quality, direction_error=0.0),
    ),
    Feature(
        "rotation",
        "directions turned into the environment's own space, where both are the same",
        _any("TRANSFORM", NONE),
        _turned,
    ),
)
"""Those that no knob forces; the knobs' own rows show the others."""


def left_out(scene: Scene, base: Quality, plan: Callable[[Scene, Quality], Plan]) -> list[Setting]:
    """Each feature that the plan of a scene leaves out, forced; and all of them together, as a renderer would draw that
    does not look at the scene first."""
    own = plan(scene, base)
    settings = []
    everything = scene, base
    for feature in FEATURES:
        if not feature.is_left_out(own):
            continue
        try:
            changed, quality = feature.changed(scene), feature.quality(base)
            if changed == scene or work(plan(changed, quality)) == work(own):
                continue
            together = feature.changed(everything[0]), feature.quality(everything[1])
            plan(*together)
        except GlbumpError:
            continue  # A mesh without texture coordinates takes no bumps, say.
        everything = together
        settings.append(Setting(feature.name, FEATURE, quality, scene=changed))
    if len(settings) > 1:
        settings.append(Setting("all of these", FEATURE, everything[1], scene=everything[0]))
    return settings


def explained(name: str) -> str:
    """What a feature is, in a few words."""
    return next((f.what for f in FEATURES if f.name == name), "as a renderer draws that has one way for every scene")
