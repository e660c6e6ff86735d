"""Every knob of the trade between speed and accuracy, and the presets."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from glbump import validate as check
from glbump.errors import SceneError

ENVIRONMENT_LAYOUTS = ("given", "cube", "lat-long", "octahedral", "dual-paraboloid")
BUMP_KERNELS = ("forward", "central", "half", "sobel", "scharr", "fourth", "bspline", "spectral")
BUMP_FORMATS = ("float", "half", "slopes8", "slopes16", "rg8", "rg16", "rgb8", "rgb10", "oct24", "oct32")
FILTERS = ("bilinear", "nearest-level", "trilinear")

PRESETS: dict[str, dict[str, Any]] = {
    # One look-up a pixel: a cube's face is found without the two arc tangents of a lat-long picture.
    "fast": {
        "samples": 1,
        "environment_layout": "cube",
        "environment_filter": "bilinear",
        "bump_filter": "nearest-level",
        "bump_kernel": "central",
        "bump_read": "baked",
        "bump_terms": "auto",
        "bump_format": "half",
        "texture_format": "half",
        "frame_format": "half",
        "silhouette": 0.25,
        "gloss_size": 64,
        "gloss_samples": 32,
        "direction_error": 1.0,
    },
    "balanced": {
        "samples": 4,
        "environment_layout": "given",
        "environment_filter": "trilinear",
        "bump_filter": "trilinear",
        "bump_kernel": "central",
        "bump_read": "baked",
        "bump_terms": "auto",
        "bump_format": "half",
        "texture_format": "half",
        "frame_format": "half",
        "silhouette": 0.1,
        "gloss_size": 128,
        "gloss_samples": 64,
        "direction_error": 0.25,
    },
    # No mip levels: the samples alone average, so more of them converge to the truth.
    "exact": {
        "samples": 16,
        "environment_layout": "given",
        "environment_filter": "bilinear",
        "bump_filter": "bilinear",
        "bump_kernel": "central",
        "bump_read": "baked",
        "bump_terms": "auto",
        "bump_format": "float",
        "texture_format": "float",
        "frame_format": "float",
        "silhouette": 0.02,
        "gloss_size": 128,
        "gloss_samples": 256,
        "direction_error": 0.0,
    },
}


_FROM_PRESET: Any = None


@dataclass(frozen=True)
class Quality(check.Frozen):
    """Every knob of the trade between speed and accuracy; what is None takes the preset's value.

    samples: samples a pixel, a square number. environment_layout: as "given", or resampled to "cube", "lat-long",
    "octahedral" or "dual-paraboloid" (pictures of the upper half of the world stay as they are).
    environment_filter, bump_filter: "bilinear" (level 0 alone), "nearest-level" or "trilinear" (mip levels by
    the sample's footprint). bump_kernel: how heights become slopes, one of BUMP_KERNELS (docs/bump.md has what each
    loses). bump_read: slopes are "baked" once; or heights are read in the "shader", and their slopes
    taken there; or on the "screen", from pixel to pixel, which is off by as much as a pixel is large (docs/bump.md).
    bump_terms: "small" drops B (N/|N|)_u and _v, "full" keeps them, "auto" keeps them where they matter
    (direction_error). bump_format: how textures keep the slopes of bumps, one of BUMP_FORMATS: as floats, in codes of
    slopes, or, of normal maps, in codes of normals; the plan says what it costs. texture_format, frame_format: of
    environments and of the picture itself, "half" or "float".
    silhouette: how far, in pixels, a curved shape's outline may lie from the true one.
    gloss_size: pixels along a face of the roughness chain's first level. gloss_samples: source texels that
    a texel of its second level reads where its lobe is high; each further level reads twice as many.
    direction_error: degrees that mirrored directions may be off by what a plan leaves out (the parallax of a room).
    """

    preset: str = "balanced"
    samples: int = _FROM_PRESET
    environment_layout: str = _FROM_PRESET
    environment_filter: str = _FROM_PRESET
    bump_filter: str = _FROM_PRESET
    bump_kernel: str = _FROM_PRESET
    bump_read: str = _FROM_PRESET
    bump_terms: str = _FROM_PRESET
    bump_format: str = _FROM_PRESET
    texture_format: str = _FROM_PRESET
    frame_format: str = _FROM_PRESET
    silhouette: float = _FROM_PRESET
    gloss_size: int = _FROM_PRESET
    gloss_samples: int = _FROM_PRESET
    direction_error: float = _FROM_PRESET

    def __post_init__(self) -> None:
        check.choice("quality", self.preset, PRESETS)
        values = {k: v if getattr(self, k) is None else getattr(self, k) for k, v in PRESETS[self.preset].items()}
        samples = check.integer("quality.samples", values["samples"], least=1, most=4096)
        if round(samples**0.5) ** 2 != samples:
            raise SceneError(f"quality.samples must be a square number (1, 4, 9, 16 ...); got {samples}")
        for name in ("environment_filter", "bump_filter"):
            check.choice(f"quality.{name}", values[name], FILTERS)
        check.choice("quality.environment_layout", values["environment_layout"], ENVIRONMENT_LAYOUTS)
        check.choice("quality.bump_kernel", values["bump_kernel"], BUMP_KERNELS)
        check.choice("quality.bump_read", values["bump_read"], ("baked", "shader", "screen"))
        check.choice("quality.bump_terms", values["bump_terms"], ("auto", "small", "full"))
        check.choice("quality.bump_format", values["bump_format"], BUMP_FORMATS)
        for name in ("texture_format", "frame_format"):
            check.choice(f"quality.{name}", values[name], ("half", "float"))
        size = check.integer("quality.gloss_size", values["gloss_size"], least=8, most=1024)
        if size & (size - 1):
            raise SceneError(f"quality.gloss_size must be a power of two; got {size}")
        values.update(
            samples=samples,
            silhouette=check.number("quality.silhouette", values["silhouette"], least=0.001, most=64),
            gloss_size=size,
            gloss_samples=check.integer("quality.gloss_samples", values["gloss_samples"], least=1, most=4096),
            direction_error=check.number("quality.direction_error", values["direction_error"], least=0, most=180),
        )
        self._store(**values)


def quality_of(value: str | Quality) -> Quality:
    """A Quality, given one or the name of a preset."""
    return value if isinstance(value, Quality) else _preset(value)


@lru_cache(maxsize=8)
def _preset(name: str) -> Quality:
    return Quality(name)
