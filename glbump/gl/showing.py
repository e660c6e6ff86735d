"""Pictures of something else than light: levels, normals, costs, as glbump.shown names them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from glbump import validate as check
from glbump.frame import Frame
from glbump.gl.targets import read
from glbump.plan import make_plan
from glbump.quality import Quality, quality_of
from glbump.scene import Scene, check_size
from glbump.shown import SHOWN

if TYPE_CHECKING:
    from glbump.gl.renderer import Renderer


def render_shown(
    renderer: Renderer, scene: Scene, show: str, size: tuple[int, int] = (512, 512), quality: str | Quality = "balanced"
) -> Frame:
    """As Renderer.render, of `show`: raw values of one sample, in the middle of each pixel; footprints are those of the
    samples that the quality has. SceneError for another name."""
    check.choice("show", show, SHOWN)
    check.instance("scene", scene, Scene)
    chosen = quality_of(quality)
    plan = make_plan(scene, chosen, check_size(size), renderer.contents, renderer.capabilities, show)
    frame, stats = renderer.drawn_once(scene, plan, chosen)
    return Frame(read(frame), stats, bottom_up=True, show=show)
