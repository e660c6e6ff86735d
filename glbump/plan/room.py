"""Whether the driver, and the memory, have room for an environment; said before anything is allocated."""

from __future__ import annotations

import math
from collections.abc import Sequence

from glbump.contents import Contents
from glbump.environment import Captured
from glbump.errors import LimitError
from glbump.maps.layout import CUBE, LATLONG, Layout
from glbump.maps.light_formats import LIGHT_FORMATS
from glbump.plan.choices import Capabilities, Draft, EnvironmentPlan

HOST_BYTES = {"hardware": 12, "box": 40, "kaiser": 112}
"""Of main memory that a texel's levels take while they are made, by Quality.pyramid: float32 with all of them, sums and
solid angles in float64."""


def require_room(name: str, layout: Layout, size: tuple[int, int], capabilities: Capabilities) -> None:
    """LimitError where the driver takes no tiles of `size`."""
    width, height = size
    limit = capabilities.max_texture_size
    if layout is CUBE:
        limit = capabilities.max_cube_size
    elif layout is not LATLONG:
        # Kept in tiles that have a border of one texel, all levels on one picture.
        width, height = width + 32, layout.tiles * (height * 3 // 2 + 4)
    if max(width, height) <= limit:
        return
    fits = math.floor(min(size) * limit / max(width, height))
    raise LimitError(
        f"the {name} is {size[0]}x{size[1]} pixels and this driver takes at most {limit} a side; "
        f"shrink it to {fits * size[0] // min(size)}x{fits * size[1] // min(size)} first"
    )


def texture_bytes(plan: EnvironmentPlan, contents: Contents) -> int:
    """Of an environment's texture, with its levels where the filter reads them."""
    how, channels, of = LIGHT_FORMATS[plan.texture_format], 3, plan.environment
    by_driver = plan.filter == "bilinear" or plan.pyramid == "hardware"
    if plan.layout is CUBE and plan.size is not None and how.signed and by_driver:
        # Frames are copied as they are drawn, with four channels.
        channels = 4 if isinstance(of, Captured) or contents.environment(of).layout is LATLONG else 3
    return _texels(plan, contents) * how.bytes * channels // 3 * (3 if plan.filter == "bilinear" else 4) // 3


def _size(plan: EnvironmentPlan, contents: Contents) -> tuple[int, int]:
    """Width and height of a tile."""
    if plan.size is None or plan.layout is None:
        return contents.environment(plan.environment).size
    _, height, width = plan.layout.shape(plan.size)
    return width, height


def _texels(plan: EnvironmentPlan, contents: Contents) -> int:
    """Of level 0; none where there is no texture."""
    width, height = _size(plan, contents)
    return plan.layout.tiles * width * height if plan.layout is not None else 0


def require_memory(draft: Draft, plans: Sequence[EnvironmentPlan]) -> None:
    """LimitError where the textures of all environments, or the making of one, take more memory than there was."""
    contents, capabilities = draft.contents, draft.capabilities
    plans = [plan for plan in plans if plan.layout is not None]
    stored = sum(texture_bytes(plan, contents) for plan in plans)
    levels = (p for p in plans if p.filter != "bilinear" and not isinstance(p.environment, Captured))
    made = max((_texels(plan, contents) * HOST_BYTES[plan.pyramid] for plan in levels), default=0)
    if stored:
        draft.note("environment memory", in_words(stored), "of textures, levels and all")
    host = made + (stored if capabilities.is_software else 0)
    for needed, there, what in (
        (stored, capabilities.texture_memory, "its textures"),
        (host, capabilities.memory, "making its textures"),
    ):
        if there is not None and needed > there:
            width, height = _size(max(plans, key=lambda plan: _texels(plan, contents)), contents)
            fits = 2 ** math.floor(math.log2(math.sqrt(there / needed)))
            raise LimitError(
                f"the environment's largest picture has {width}x{height} pixels, and {what} take "
                f"{in_words(needed)}, of which {in_words(there)} are free; shrink it to "
                f"{max(1, int(width * fits))}x{max(1, int(height * fits))}, or lower quality.texture_format"
            )


def in_words(count: int) -> str:
    """Bytes, as people read them."""
    return f"{count / 2**30:.3g} GiB" if count >= 2**30 else f"{count / 2**20:.3g} MiB"
