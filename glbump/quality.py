"""Every knob of the trade between speed and accuracy, and the presets."""

from __future__ import annotations

from functools import lru_cache
from typing import Any, NamedTuple

from glbump import validate as check
from glbump.errors import SceneError
from glbump.frozen import Frozen


class Knob(NamedTuple):
    """What a knob can be: one of some words, or a number within bounds, `whole` or not.

    values: the words, or the numbers that a sweep tries; from what costs least to what is nearest to the truth.
    unit: of numbers. bounds: least and most of a number, None for words. effect: what it decides, in a few words.
    """

    effect: str
    values: tuple[Any, ...]
    unit: str = ""
    bounds: tuple[float, float] | None = None
    whole: bool = False


KNOBS: dict[str, Knob] = {
    "samples": Knob("samples a pixel, a square number", (1, 4, 9, 16, 64), "", (1, 4096), True),
    "silhouette": Knob("how far a round outline may lie from the true one", (0.5, 0.25, 0.1, 0.02), "px", (0.001, 64)),
    "environment_layout": Knob(
        "the layout that pictures are resampled to", ("given", "cube", "lat-long", "octahedral", "dual-paraboloid")
    ),
    "environment_filter": Knob("mip levels of environments", ("bilinear", "nearest-level", "trilinear")),
    "environment_level": Knob("the level of a footprint: by its longer side, or by its area", ("longest", "area")),
    "anisotropy": Knob("most look-ups along a footprint, of light and of bumps", (1, 2, 4, 8, 16), "", (1, 16), True),
    "pyramid": Knob("who makes mip levels, and by which kernel", ("hardware", "box", "kaiser")),
    "bump_kernel": Knob(
        "how heights become slopes",
        ("forward", "central", "half", "sobel", "scharr", "fourth", "bspline", "spectral"),
    ),
    "bump_read": Knob("where slopes are taken", ("baked", "shader", "screen")),
    "bump_terms": Knob("terms of the bent normal", ("small", "auto", "full")),
    "bump_format": Knob(
        "how textures keep slopes",
        ("rg8", "slopes8", "rgb8", "rgb10", "oct24", "rg16", "slopes16", "half", "oct32", "float"),
    ),
    "bump_filter": Knob("mip levels of bumps", ("bilinear", "nearest-level", "trilinear")),
    "bump_spread": Knob("what is kept of bumps that levels average", ("none", "toksvig", "lean")),
    "diffuse": Knob("light that surfaces scatter: by nine harmonics, or a small map", ("sh9", "map")),
    "suns": Knob("small bright lights: blurred with the rest, or shaded apart", ("kept", "apart")),
    "gloss": Knob("how the lobes of rough surfaces are summed", ("chain", "sampled")),
    "lobe_samples": Knob("facets that a sample sums, where lobes are sampled", (4, 16, 64, 256), "", (1, 4096), True),
    "gloss_chain": Knob("who blurs the roughness chain", ("drawn", "tree")),
    "dfg": Knob("a rough surface's share of the light", ("fit", "table")),
    "gloss_size": Knob("pixels along a face of the roughness chain", (16, 32, 64, 128, 256), "px", (8, 1024), True),
    "gloss_samples": Knob("texels that each texel of the chain reads", (8, 32, 64, 256), "", (1, 4096), True),
    "direction_error": Knob("how far mirrored directions may be off", (180.0, 1.0, 0.25, 0.0), "degrees", (0, 180)),
    "texture_format": Knob("how textures keep environments, at least", ("srgb8", "rgb10", "half", "float")),
    "frame_format": Knob("how the picture is kept while it is drawn", ("half", "float")),
}
"""Each field of Quality but `preset`."""

PRESETS: dict[str, dict[str, Any]] = {
    # One look-up a pixel: a cube's face is found without the two arc tangents of a lat-long picture.
    "fast": {
        "samples": 1,
        "environment_layout": "cube",
        "environment_filter": "bilinear",
        "environment_level": "area",
        "anisotropy": 1,
        "pyramid": "box",
        "bump_filter": "nearest-level",
        "bump_spread": "none",
        "bump_kernel": "central",
        "bump_read": "baked",
        "bump_terms": "auto",
        "bump_format": "half",
        "texture_format": "half",
        "frame_format": "half",
        "silhouette": 0.25,
        "diffuse": "sh9",
        "suns": "apart",
        "gloss": "chain",
        "lobe_samples": 16,
        "gloss_chain": "drawn",
        "dfg": "fit",
        "gloss_size": 64,
        "gloss_samples": 32,
        "direction_error": 1.0,
    },
    # Four samples, levels by their footprints' areas: long thin footprints stay sharp across.
    "balanced": {
        "samples": 4,
        "environment_layout": "given",
        "environment_filter": "trilinear",
        "environment_level": "area",
        "anisotropy": 1,
        "pyramid": "box",
        "bump_filter": "trilinear",
        "bump_spread": "lean",
        "bump_kernel": "central",
        "bump_read": "baked",
        "bump_terms": "auto",
        "bump_format": "half",
        "texture_format": "half",
        "frame_format": "half",
        "silhouette": 0.25,
        "diffuse": "sh9",
        "suns": "apart",
        "gloss": "chain",
        "lobe_samples": 16,
        "gloss_chain": "drawn",
        "dfg": "table",
        "gloss_size": 128,
        "gloss_samples": 64,
        "direction_error": 0.25,
    },
    # No mip levels: the samples alone average, so more of them converge to the truth.
    "exact": {
        "samples": 16,
        "environment_layout": "given",
        "environment_filter": "bilinear",
        "environment_level": "area",
        "anisotropy": 1,
        "pyramid": "box",
        "bump_filter": "bilinear",
        "bump_spread": "none",
        "bump_kernel": "central",
        "bump_read": "baked",
        "bump_terms": "auto",
        "bump_format": "float",
        "texture_format": "float",
        "frame_format": "float",
        "silhouette": 0.02,
        "diffuse": "map",
        "suns": "apart",
        "gloss": "sampled",
        "lobe_samples": 16,
        "gloss_chain": "tree",
        "dfg": "table",
        "gloss_size": 128,
        "gloss_samples": 256,
        "direction_error": 0.0,
    },
}


_FROM_PRESET: Any = None


class Quality(Frozen):
    """Every knob of the trade between speed and accuracy; what is None takes the preset's value.

    KNOBS has what each may be, and its unit. Some more of it:

    samples: one pass draws as many at once as the driver has for multisampling (4), shading what needs it for each.
    environment_layout: as "given", or resampled (pictures of the upper half of the world stay as they are).
    environment_filter, bump_filter: "bilinear" (level 0 alone), "nearest-level" or "trilinear" (mip levels by
    the sample's footprint). environment_level: "longest" blurs across thin footprints, "area" counts the longer side
    as eight times the shorter at most. pyramid: mip levels are made by the driver ("hardware": it counts texels alike,
    and drops some of odd sizes), as means by solid angle ("box"), or by a sharper kernel ("kaiser") where nothing is so
    bright that it would ring.
    bump_read: slopes are "baked" once; or heights are read in the "shader", and their slopes taken there; or on the
    "screen", from pixel to pixel, which is off by as much as a pixel is large. bump_terms: "small" drops B (N/|N|)_u
    and _v, "full" keeps them, "auto" keeps them where they matter (direction_error). bump_format: as floats, in codes
    of slopes, or, of normal maps, in codes of normals; the plan says what it costs. bump_spread: bumps finer than a
    pixel flatten out ("none"), or blur what is mirrored, and make rough what is glossy, by their variance, one for all
    directions ("toksvig"), or by their second moments ("lean"). docs/bump.md has all of bumps.
    diffuse: "sh9" is off by 1 % on average, a "map" by 0.02. suns: what is 50 times brighter than the rest and within 5
    degrees is "apart", a disc that shines on rough and diffuse surfaces; docs/environments.md has both.
    gloss: "chain" reads an environment that was blurred for a few roughnesses, as if seen along the normal; "sampled"
    sums lobe_samples facets a sample, as the eye sees them. gloss_chain: "drawn" by the GPU, or summed over a "tree" by
    the CPU. gloss_size: of the chain's first level. gloss_samples: source texels that a texel of its second level reads
    where its lobe is high; each further level reads twice as many. dfg: docs/gloss.md has all of gloss.
    direction_error: by what a plan leaves out (the parallax of a room, small terms of bumps).
    """

    preset: str = "balanced"
    samples: int = _FROM_PRESET
    environment_layout: str = _FROM_PRESET
    environment_filter: str = _FROM_PRESET
    environment_level: str = _FROM_PRESET
    anisotropy: int = _FROM_PRESET
    pyramid: str = _FROM_PRESET
    bump_filter: str = _FROM_PRESET
    bump_spread: str = _FROM_PRESET
    bump_kernel: str = _FROM_PRESET
    bump_read: str = _FROM_PRESET
    bump_terms: str = _FROM_PRESET
    bump_format: str = _FROM_PRESET
    texture_format: str = _FROM_PRESET
    frame_format: str = _FROM_PRESET
    silhouette: float = _FROM_PRESET
    diffuse: str = _FROM_PRESET
    suns: str = _FROM_PRESET
    gloss: str = _FROM_PRESET
    lobe_samples: int = _FROM_PRESET
    gloss_chain: str = _FROM_PRESET
    dfg: str = _FROM_PRESET
    gloss_size: int = _FROM_PRESET
    gloss_samples: int = _FROM_PRESET
    direction_error: float = _FROM_PRESET

    def __post_init__(self) -> None:
        check.choice("quality", self.preset, PRESETS)
        values = {
            name: _checked(name, own if (own := getattr(self, name)) is not None else value)
            for name, value in PRESETS[self.preset].items()
        }
        if round(values["samples"] ** 0.5) ** 2 != values["samples"]:
            raise SceneError(f"quality.samples must be a square number (1, 4, 9, 16 ...); got {values['samples']}")
        if values["gloss_size"] & (values["gloss_size"] - 1):
            raise SceneError(f"quality.gloss_size must be a power of two; got {values['gloss_size']}")
        self._store(**values)


def _checked(name: str, value: Any) -> Any:
    knob = KNOBS[name]
    if knob.bounds is None:
        return check.choice(f"quality.{name}", value, knob.values)
    least, most = knob.bounds
    if knob.whole:
        return check.integer(f"quality.{name}", value, least=int(least), most=int(most))
    return check.number(f"quality.{name}", value, least=least, most=most)


def quality_of(value: str | Quality) -> Quality:
    """A Quality, given one or the name of a preset."""
    return value if isinstance(value, Quality) else _preset(value)


@lru_cache(maxsize=8)
def _preset(name: str) -> Quality:
    return Quality(name)
