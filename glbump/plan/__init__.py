"""Scene + quality + driver -> Plan: the only place that decides what is compiled, uploaded and computed."""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from glbump import validate as check
from glbump.captures import require_outside
from glbump.contents import Contents
from glbump.plan.choices import (
    NO_PARALLAX,
    Capabilities,
    Choice,
    Draft,
    EnvironmentPlan,
    Plan,
    SurfacePlan,
)
from glbump.plan.environments import brightest, environment_plan, parallax, sky_needs_each
from glbump.plan.room import require_memory
from glbump.plan.seen import FAR_OVER_NEAR, Seen, look
from glbump.plan.surfaces import apart, has_small_triangles, require_drawable, require_uv, surface_plan, world_bounds
from glbump.quality import Quality
from glbump.scene import Scene

__all__ = ["Capabilities", "Choice", "EnvironmentPlan", "Plan", "Planner", "SurfacePlan", "make_plan"]

HALF_SUM = 4
"""Most samples that are added up in halves: each addition costs up to 2**-11, and 4096 lose half of the light."""
MOST_MULTISAMPLED = 1 << 30
"""Most bytes of a multisampled frame; larger ones take a pass for each sample."""
_BYTES = {"half": 8, "float": 16}


def make_plan(
    scene: Scene,
    quality: Quality,
    size: tuple[int, int],
    contents: Contents,
    capabilities: Capabilities | None = None,
    show: str | None = None,
) -> Plan:
    """The plan of one frame of `size` (width, height), of light or of what glbump.shown has under the name `show`.
    Raises SceneError, ImageError, MeshError, LimitError."""
    check.instance("scene", scene, Scene)
    boxes = _boxes(scene, contents)
    seen, near_and_far = look(scene, quality, size, contents, boxes)
    draft = Draft(scene, quality, size, contents, capabilities or Capabilities(), seen, show)
    note = draft.note
    require_outside(scene)
    frame_format = _frame_format(draft)
    alone = [bool(is_apart) for is_apart in apart(boxes)]
    multisampled = _is_multisampled(draft, frame_format, alone)
    environments = tuple(environment_plan(draft, i, e) for i, e in enumerate(scene.environments))
    require_memory(draft, environments)
    for i, surface in enumerate(scene.surfaces):
        require_uv(i, surface, contents)
    if seen.log_depth:
        why = f"far is more than {FAR_OVER_NEAR:g} times near; 24 bits would not tell what is far apart"
        note("depth", "logarithm", why)
    drawn = ("LOG_DEPTH", int(seen.log_depth)), ("MULTISAMPLED", int(multisampled)), ("SHOW", draft.shown)
    defines = [(*e.defines, *drawn) for e in environments]
    number = [scene.environments.index(scene.environment_of(s)) for s in scene.surfaces]
    surfaces = tuple(
        surface_plan(draft, i, (number[i], defines[number[i]]), environments[number[i]].suns, is_apart)
        for i, is_apart in enumerate(alone)
    )
    for i, how in enumerate(surfaces):
        require_drawable(i, scene, how.layers, contents, draft.capabilities.max_texture_size)
    sky_parallax, sky_each = NO_PARALLAX, True
    if scene.environment.background:
        if scene.camera.projection == "perspective":
            sky_parallax = parallax(draft, "sky", scene.environment, np.array([scene.camera.eye] * 2))
        note("sky", "drawn", "the environment is shown behind the surfaces")
        sky_each = not multisampled or sky_needs_each(draft, environments[0], sky_parallax)
    else:
        note("sky", "none", "the scene switches the background off")
    return Plan(
        size=size,
        samples=1 if show else quality.samples,
        footprint=quality.samples**-0.5,
        show=draft.shown,
        is_multisampled=multisampled,
        environments=environments,
        bump_filter=quality.bump_filter,
        bump_spread=quality.bump_spread,
        lobe_samples=quality.lobe_samples,
        frame_format=frame_format,
        sky=scene.environment.background,
        sky_each=sky_each,
        sky_parallax=sky_parallax,
        near_far=near_and_far,
        log_depth=seen.log_depth,
        surfaces=surfaces,
        choices=tuple(draft.choices),
    )


class Planner:
    """Plans frame after frame. Where a camera has moved, and nothing is decided otherwise for that, the last plan
    serves, with other clip planes; its choices are the very same object then."""

    def __init__(self, contents: Contents) -> None:
        self._contents = contents
        self._last: tuple[Hashable, Seen, Plan] | None = None
        self._boxes = np.zeros((0, 2, 3))

    def plan(
        self, scene: Scene, quality: Quality, size: tuple[int, int], capabilities: Capabilities, known: Hashable
    ) -> Plan:
        """As make_plan. known: what all contents of the scene are known by."""
        key = scene.surfaces, scene.environment, quality, size, capabilities, known
        last, contents = self._last, self._contents
        if last is not None and last[0] == key:
            seen, near_and_far = look(scene, quality, size, contents, self._boxes)
            if last[1] == seen:
                return replace(last[2], near_far=near_and_far)
        plan = make_plan(scene, quality, size, contents, capabilities)
        self._boxes = _boxes(scene, contents)
        self._last = key, look(scene, quality, size, contents, self._boxes)[0], plan
        return plan


def _boxes(scene: Scene, contents: Contents) -> npt.NDArray[np.float64]:
    """(N, 2, 3) round the surfaces, in the world."""
    return np.array([world_bounds(surface, contents) for surface in scene.surfaces]).reshape(-1, 2, 3)


def _is_multisampled(draft: Draft, frame_format: str, alone: Sequence[bool]) -> bool:
    """Whether one pass has all samples of each pixel. alone: the surfaces whose boxes meet no other's."""
    samples, (width, height) = draft.quality.samples, draft.size
    why = f"{samples} a pixel, as quality {draft.quality.preset} has it"
    if draft.show is not None:
        draft.note("samples", 1, f"{draft.show} is of one sample, in the middle of each pixel; {why}, small as those")
        return False
    size = width * height * samples * (_BYTES[frame_format] + 4)
    # Where drivers put more than four is theirs to choose.
    one = samples == 4 <= draft.capabilities.multisamples and size <= MOST_MULTISAMPLED
    each = ", a pass for each"
    if one and draft.capabilities.is_software and any(has_small_triangles(draft, i, a) for i, a in enumerate(alone)):
        # Of 4x4 pixels that a triangle touches, Mesa's llvmpipe (22.3) shades all samples, covered or not.
        one, each = False, f"{each}: this driver shades small triangles sooner so"
    draft.note("samples", samples, why + ("" if samples == 1 else ", in one pass" if one else each))
    return one


def _frame_format(draft: Draft) -> str:
    quality, bright = draft.quality, brightest(draft)
    if draft.show is not None:
        draft.note("frame format", "float", f"{draft.show} is shown as it is")
        return "float"
    if quality.frame_format == "half" and quality.samples > HALF_SUM:
        draft.note("frame format", "float", f"{quality.samples} samples a pixel add up in it; halves would lose them")
        return "float"
    return draft.fitting_format("frame format", quality.frame_format, "environment", bright)
