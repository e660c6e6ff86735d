"""Which suns are counted by themselves: the one rule, for the plan and for whole pictures in float64."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from glbump.contents import Contents
from glbump.environment import Captured, Environment, Pictured
from glbump.quality import Quality
from glbump.scene import Scene

if TYPE_CHECKING:
    from glbump.maps.suns import Sun


def suns_apart(
    scene: Scene, environment: Environment, quality: Quality, contents: Contents, *, drawn: bool = False
) -> tuple[tuple[Sun, ...], str]:
    """The suns that are taken out of what is blurred of an environment, and shaded each by itself; and why these.

    drawn: whether its picture was captured of the scene. Such suns stay: a plan is made before there is a picture.
    """
    materials = [s.material for s in scene.surfaces if scene.environment_of(s) == environment]
    rough = [material for material in materials if material.roughness > 0.0 and quality.gloss == "chain"]
    if not rough and not any(material.is_diffuse for material in materials):
        return (), "nothing blurs this environment"
    if quality.suns == "kept":
        return (), "as the quality asks"
    if drawn or isinstance(environment, Captured):
        return (), "it is captured of the scene"
    if not isinstance(environment, Pictured):
        return (), "it is computed"
    if environment.lookup == "normal":
        return (), "it is looked up by the normal, and a sun shines from where it is"
    if environment.bounds is not None:
        return (), "its lamps hang in a room, and suns are far off"
    if any(material.metallic < 1.0 and material.transmission > 0.0 for material in rough):
        return (), "it is seen through rough glass, which reads the chain"
    suns = contents.parted(environment).suns
    if not suns:
        return (), "no light of it is small, and 50 times brighter than the rest"
    light = 4 * np.pi * contents.irradiance(environment, apart=True)[0].sum()
    share = 1 / (1 + light / sum(sum(sun.irradiance) for sun in suns))
    return suns, f"{share:.0%} of its light, taken out of what is blurred, shines from discs"
