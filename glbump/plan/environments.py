"""How each environment is kept and looked up."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from glbump.captures import count, gain
from glbump.contents import BRIGHTEST
from glbump.environment import MIRRORED, BoxBounds, Captured, Environment, HemiCube, Hemisphere, Pictured, Procedural
from glbump.errors import LimitError
from glbump.maps.layout import CUBE, LATLONG, LAYOUTS, Layout
from glbump.maps.levels import fitting_pyramid
from glbump.maps.light_formats import LIGHT_FORMATS
from glbump.plan.choices import (
    BOX,
    COLOURED_BELOW,
    COMPUTED,
    DRAWN_LAYOUTS,
    GLOSSY,
    LEVELS,
    MIRRORED_BELOW,
    NO_PARALLAX,
    SPHERICAL,
    WHOLE,
    Draft,
    EnvironmentPlan,
)
from glbump.plan.materials import gloss_chain, light_of
from glbump.plan.room import require_room
from glbump.reference.suns import suns_apart
from glbump.scene import Material, Scene

F64 = npt.NDArray[np.float64]

LARGEST_MAGNIFIED = 0.25
"""In texels of the sky, a pixel that one sample in its middle stands for."""

LARGEST_RESAMPLED = 2048
"""Most texels along 90 degrees that a picture is resampled to."""


def environment_plan(draft: Draft, number: int, environment: Environment) -> EnvironmentPlan:
    """How one of the scene's environments is kept and looked up. number: 0 for the scene's own."""
    scene, quality = draft.scene, draft.quality
    name = "environment" if number == 0 else f"environment {number}"
    materials = [s.material for s in scene.surfaces if scene.environment_of(s) == environment]
    glossy = any(light_of(m) == GLOSSY for m in materials)
    layout, resampled, texture_format, pre_exposure = None, None, quality.texture_format, 0
    sampled = glossy and quality.gloss == "sampled"
    if isinstance(environment, Pictured):
        layout, resampled = _layout(draft, name, environment)
        defines = _look_up(draft, name, environment, layout, resampled)
    else:
        assert isinstance(environment, Procedural)
        defines = _computed(draft, name, environment)
    # A computed environment has texels for its roughness chain alone.
    if layout is not None or glossy:
        what = "texture format" if number == 0 else f"texture format {number}"
        texture_format, pre_exposure = _texture_format(draft, what, name, environment)
    # Facets are looked up by the solid angles that they stand for, whatever mirrors read.
    filter = "trilinear" if sampled and quality.environment_filter == "bilinear" else quality.environment_filter
    pyramid = quality.pyramid
    if layout is not None and filter != "bilinear":
        pyramid = _pyramid(draft, name, environment, layout, resampled, texture_format)
    gloss = gloss_chain(draft, number, glossy)
    return EnvironmentPlan(
        environment=environment,
        defines=tuple((defines | {"EXPOSURE": int(environment.exposure + pre_exposure != 0.0)}).items()),
        layout=layout,
        size=resampled,
        filter=filter,
        pyramid=pyramid,
        texture_format=texture_format,
        pre_exposure=pre_exposure,
        gloss=gloss,
        diffuse=_diffuse(draft, number, materials),
        suns=_suns(draft, number, environment),
    )


def _texture_format(draft: Draft, what: str, name: str, environment: Environment) -> tuple[str, int]:
    """How texels are kept, and their pre-exposure."""
    wanted = draft.quality.texture_format
    if isinstance(environment, Captured):
        # Copied from frames as they stand, which are floats of either kind.
        peak = brightest(draft) / 2.0 ** max(environment.exposure, 0.0)
        return draft.fitting_format(what, "float" if wanted == "float" else "half", name, peak), 0
    fit = draft.contents.light_format(environment, wanted)
    draft.note(what, fit.format.name, fit.why)
    return fit.format.name, fit.exponent


def _pyramid(
    draft: Draft, name: str, environment: Environment, layout: Layout, resampled: int | None, texture_format: str
) -> str:
    """Who makes an environment's levels."""
    if isinstance(environment, Captured):
        how = "hardware" if layout is CUBE else "box"
        why = "frames are drawn, and their levels where they lie" if layout is CUBE else "tiles are read back"
    else:
        own_grid = resampled is None and draft.contents.environment(environment).has_own_grid
        peak, is_light = draft.contents.peak(environment), LIGHT_FORMATS[texture_format].signed
        how, why = fitting_pyramid(draft.quality.pyramid, layout, peak, own_grid=own_grid, is_light=is_light)
    draft.note(f"{name} pyramid", how, why)
    return how


_DIFFUSE_ERROR = {
    "sh9": "off by 1 % of the brightest on average, by 3/32 of a point of light at most",
    "map": "the cosine integral itself in faces of 32, off by 0.02 % on average",
}


def _diffuse(draft: Draft, number: int, materials: list[Material]) -> bool:
    """Whether a surface scatters the light of the scene's environment `number`."""
    needed = any(material.is_diffuse for material in materials)
    how = draft.quality.diffuse
    what = "diffuse light" if number == 0 else f"diffuse light {number}"
    draft.note(what, how if needed else "none", _DIFFUSE_ERROR[how] if needed else "no surface scatters any")
    return needed


def _suns(draft: Draft, number: int, environment: Environment) -> int:
    """How many of its suns are shaded apart."""
    suns, why = suns_apart(draft.scene, environment, draft.quality, draft.contents)
    draft.note("suns" if number == 0 else f"suns {number}", f"{len(suns)} apart" if suns else "kept", why)
    return len(suns)


def brightest(draft: Draft) -> float:
    """The most that a picture of the scene may reach; LimitError where it is past BRIGHTEST."""
    scene = draft.scene
    bright = max(draft.contents.brightest(e) for e in scene.environments if not isinstance(e, Captured)) * gain(scene)
    if not bright <= BRIGHTEST:
        raise LimitError(
            f"captured light may grow to {bright:.3g}, by each bounce's exposure; at most {BRIGHTEST:g}: lower "
            "environment.exposure or environment.bounces"
        )
    return bright


def _layout(draft: Draft, name: str, environment: Pictured) -> tuple[Layout, int | None]:
    """The layout that an environment's texels have on the GPU, and what it is resampled to, if it is."""
    quality, capabilities = draft.quality, draft.capabilities
    if isinstance(environment, Captured):
        layout = LAYOUTS[environment.layout]
        _, height, width = layout.shape(environment.size)
        require_room(f"{name} (environment.size {environment.size})", layout, (width, height), capabilities)
        draft.note(
            name,
            f"captured {layout.name} of {environment.size}",
            f"{count(draft.scene, environment)} pictures drawn from {environment.position}, without what shows it; "
            "anew when the scene changes, not when the camera moves",
        )
        return layout, environment.size
    picture = draft.contents.environment(environment)
    given = picture.layout
    width, height = picture.size
    require_room(name, given, (width, height), capabilities)
    wanted = given if quality.environment_layout == "given" else LAYOUTS[quality.environment_layout]
    if given not in DRAWN_LAYOUTS and wanted is given:
        wanted = CUBE
    if wanted is given or (not given.whole and given in DRAWN_LAYOUTS):
        border = ", samples on the border" if picture.has_own_grid else ""
        draft.note(name, given.name, f"{width}x{height} as given" + border)
        return given, None
    # Texels along 90 degrees: of the picture, and as many as the frame can tell apart.
    native = 2 ** math.ceil(math.log2(max(90 / given.span * height, 4)))
    seen = 2 ** math.ceil(math.log2(max(2.0 / _pixel_angle(draft.scene, draft.size), 16)))
    per_quarter = min(native, seen, LARGEST_RESAMPLED)
    limit = capabilities.max_cube_size if wanted is CUBE else capabilities.max_texture_size // wanted.tiles
    side = min(round(per_quarter * wanted.span / 90), limit)
    draft.note(
        name,
        f"{wanted.name} of {side}",
        f"resampled once from {given.name}, {width}x{height}; a texel is no larger than "
        + ("a texel of the picture" if per_quarter == native else "a pixel of the frame"),
    )
    return wanted, side


def _look_up(draft: Draft, name: str, environment: Pictured, layout: Layout, resampled: int | None) -> dict[str, int]:
    quality = draft.quality
    levels = quality.environment_filter != "bilinear"
    by = {"longest": "the longer side of", "area": "the area of"}[quality.environment_level]
    why = f"levels by {by} the sample's footprint" if levels else "level 0 alone; the samples average"
    own_grid = (
        resampled is None
        and not isinstance(environment, Captured)
        and draft.contents.environment(environment).has_own_grid
    )
    by_driver = levels and layout in (LATLONG, CUBE) and not own_grid and not isinstance(environment, Captured)
    by_driver = by_driver and draft.has_gradients
    if levels and quality.anisotropy > 1:
        why += f", at up to {quality.anisotropy} places along it where it is longer than wide"
        why += ", the texture unit's own" if by_driver else ""
    draft.note(f"{name} filter", quality.environment_filter, why)
    below = WHOLE
    if not layout.whole:
        mirrored = not isinstance(environment, HemiCube | Hemisphere) or environment.below == MIRRORED
        below = MIRRORED_BELOW if mirrored else COLOURED_BELOW
    return {
        "ENVIRONMENT": DRAWN_LAYOUTS.index(layout),
        "ENVIRONMENT_BORDER": int(own_grid),
        "ENVIRONMENT_FOOTPRINT": int(levels or draft.show == "footprint"),
        # Facets that are summed have footprints as wide as long, for which both are the same.
        "ENVIRONMENT_LEVEL": LEVELS[quality.environment_level] if levels else 0,
        "ANISOTROPY": quality.anisotropy if levels and not by_driver else 1,
        "ENVIRONMENT_GRADIENTS": quality.anisotropy if by_driver else 0,
        "ENVIRONMENT_BELOW": below,
        # Levels of tiles in a column are not a texture unit's to mix: their borders differ.
        "ENVIRONMENT_MIX": int(quality.environment_filter == "trilinear" and layout not in (LATLONG, CUBE)),
    }


def parallax(draft: Draft, name: str, environment: Environment, box: F64) -> int:
    """Whether, and with which walls, places in the box (2, 3) are told from where the environment was taken."""
    if not isinstance(environment, Pictured) or environment.bounds is None:
        return NO_PARALLAX
    room, allowed = environment.bounds, draft.quality.direction_error
    offset = float(np.linalg.norm(np.abs(box - np.asarray(environment.position)).max(axis=0)))
    error = math.degrees(math.atan2(offset, room.least_distance(environment.position)))
    if error <= allowed:
        why = f"directions are off by {error:.2g} degrees at most without it, and {allowed:g} are allowed"
        draft.note(f"{name} parallax", "none", why)
        return NO_PARALLAX
    kind = BOX if isinstance(room, BoxBounds) else SPHERICAL
    why = f"without it, directions would be off by up to {error:.2g} degrees"
    draft.note(f"{name} parallax", "box" if kind == BOX else "sphere", why)
    return kind


def sky_needs_each(draft: Draft, environment: EnvironmentPlan, parallax: int) -> bool:
    """Whether each of a pixel's samples must look the sky up: not where pixels are much smaller than its texels."""
    if environment.layout is None or parallax != NO_PARALLAX:
        return True
    of = environment.environment
    assert isinstance(of, Pictured)
    if environment.size is None:
        texels = draft.contents.environment(of).texels_per_radian
    else:
        _, height, width = environment.layout.shape(environment.size)
        texels = environment.layout.texels_per_radian((width, height))
    pixel = _pixel_angle(draft.scene, draft.size) * texels
    if pixel > LARGEST_MAGNIFIED or draft.scene.camera.projection == "orthographic":
        return True
    draft.note("sky samples", "one a pixel", f"a pixel is {pixel:.2g} of a texel of it")
    return False


def _computed(draft: Draft, name: str, environment: Procedural) -> dict[str, int]:
    """The defines of an environment that is a function of the direction."""
    quality = draft.quality
    draft.note(name, environment.kind, "computed for each sample; no picture, no texture, no sampler")
    from glbump.reference.computed import is_averaged  # pictures need none of it

    averaged = is_averaged(quality.environment_filter, quality.samples)
    why = "averaged over each sample's footprint" if averaged else "the function itself; the samples average"
    draft.note(f"{name} filter", "analytic" if averaged else "none", why)
    has_footprint = averaged or draft.show == "footprint"
    return {"ENVIRONMENT": COMPUTED[type(environment)], "ENVIRONMENT_FOOTPRINT": int(has_footprint)}


def _pixel_angle(scene: Scene, size: tuple[int, int]) -> float:
    """Radians a pixel of the frame spans (of a reflection in a flat mirror, too)."""
    camera = scene.camera
    if camera.projection == "perspective":
        return 2 * math.tan(math.radians(camera.fov) / 2) / size[1]
    # Parallel rays: a curved mirror of the picture's height spreads them over half a turn.
    return math.pi / size[1]
