"""The least that a material's light takes."""

from __future__ import annotations

from collections.abc import Callable

from glbump.plan.choices import GLOSSY, SMOOTH, TINTED_MIRROR, WHITE_MIRROR
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


def is_transmissive(material: Material) -> bool:
    """Whether light goes through it."""
    return material.metallic < 1.0 and material.transmission > 0.0


def is_diffuse(material: Material) -> bool:
    """Whether it scatters light that comes from all sides."""
    return material.metallic < 1.0 and material.transmission < 1.0 and any(material.base_color)


def why_light(material: Material) -> tuple[str, str]:
    """The name of light_of(material), and its reason."""
    return _WHY[light_of(material)](material)
