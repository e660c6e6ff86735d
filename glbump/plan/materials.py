"""The least that a material's light takes."""

from __future__ import annotations

from collections.abc import Callable

from glbump.environment import Environment, Pictured
from glbump.maps.layout import CUBE, LATLONG
from glbump.plan.choices import (
    DRAWN_LAYOUTS,
    FACTORS,
    GLOSSES,
    GLOSSY,
    SMOOTH,
    TINTED_MIRROR,
    WHITE_MIRROR,
    ChainPlan,
    Defines,
    Draft,
)
from glbump.scene import Material


def light_of(material: Material) -> int:
    """The least that a material's mirrored light takes."""
    if material.roughness > 0.0:
        return GLOSSY
    if material.metallic < 1.0:
        return SMOOTH
    return WHITE_MIRROR if material.base_color == (1.0, 1.0, 1.0) else TINTED_MIRROR


_WHY: dict[int, Callable[[Material], tuple[str, str]]] = {
    GLOSSY: lambda material: ("glossy", f"roughness {material.roughness:g}"),
    SMOOTH: lambda _: ("smooth", "smooth and not all metal: Fresnel's share is mirrored"),
    WHITE_MIRROR: lambda _: ("mirror", "a mirror of base colour 1 is the environment itself: no BRDF"),
    TINTED_MIRROR: lambda _: ("tinted mirror", "a coloured mirror: Fresnel, no BRDF"),
}


def gloss_chain(draft: Draft, number: int, glossy: bool) -> ChainPlan | None:
    """The roughness chain of the scene's environment `number`, if a surface reads it."""
    quality, what = draft.quality, "roughness chain" if number == 0 else f"roughness chain {number}"
    if not glossy:
        draft.note(what, "none", "nothing is rough")
        return None
    if quality.gloss == "sampled":
        draft.note(what, "none", f"rough surfaces sum {quality.lobe_samples} facets for each sample")
        return None
    chain = ChainPlan(quality.gloss_size, quality.gloss_samples, quality.gloss_chain == "drawn")
    how, error = ("drawn", _DRAWN_ERROR) if chain.drawn else ("summed over a tree", _TREE_ERROR)
    draft.note(what, f"{how}, faces of {chain.size}", f"a surface is rough; {chain.samples} samples: {error}")
    return chain


_DRAWN_ERROR = "off by 1 to 2 % rms at 64, and lobes are taken as if seen along the normal"
_TREE_ERROR = "off by 0.2 to 0.7 % rms at 64, and lobes are taken as if seen along the normal"


def gloss_defines(draft: Draft, name: str, environment: Environment, defines: Defines) -> dict[str, int]:
    """What a glossy surface's program is compiled with beside, or instead of, the defines of its environment."""
    quality = draft.quality
    fit = "A within 0.37, B within 0.09 of quadrature" if quality.dfg == "fit" else "a table within 0.012 of quadrature"
    draft.note(f"{name} reflectance", quality.dfg, f"{fit}; scattering between facets is counted in")
    chosen = {"GLOSS": GLOSSES[quality.gloss], "DFG": FACTORS[quality.dfg]}
    if quality.gloss == "chain":
        # The chain carries all of its light; the environment itself is not looked up here.
        return chosen | {"ENVIRONMENT_FOOTPRINT": 0}
    draft.note(f"{name} lobe", f"{quality.lobe_samples} facets", "each in the level of the solid angle it stands for")
    tiles = dict(defines)["ENVIRONMENT"] not in (DRAWN_LAYOUTS.index(LATLONG), DRAWN_LAYOUTS.index(CUBE))
    mixed = tiles and isinstance(environment, Pictured) and quality.environment_filter != "nearest-level"
    return chosen | {"ENVIRONMENT_FOOTPRINT": 1, "ENVIRONMENT_MIX": int(mixed)}


def why_light(material: Material) -> tuple[str, str]:
    """The name of light_of(material), and its reason."""
    return _WHY[light_of(material)](material)
