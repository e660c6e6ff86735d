"""A scene made ready to be drawn, and what has been drawn of it."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import replace
from typing import Any, NamedTuple

import moderngl

from glbump.frozen import Frozen
from glbump.gl.uniforms import Uniforms, View
from glbump.plan import Plan
from glbump.scene import Scene


class Draw(Frozen):
    """One surface, or the sky: its program with the values of uniforms, its vertices, its textures with their units."""

    uniforms: Uniforms
    values: dict[str, Any]
    vertices: moderngl.VertexArray
    textures: list[tuple[moderngl.Texture | moderngl.TextureCube, int]]


class Drawn(NamedTuple):
    """A picture on the GPU: (H, W) linear light, straight alpha, lowest row first; its plan and the figures of its
    making, as Frame.stats has them."""

    frame: moderngl.Framebuffer
    plan: Plan
    stats: dict[str, Any]


class Prepared(Frozen):
    """A scene made ready to be drawn: its plan, and all that follows from it.

    key: of the size, the quality and the contents that it was made for; freed: of the store, then.
    """

    scene: Scene
    key: Hashable
    plan: Plan
    view: View
    draws: list[Draw]
    sky: Draw | None
    stats: dict[str, Any]
    freed: int

    def moved(self, scene: Scene, plan: Plan) -> Prepared:
        """The same scene, of which at most the camera has moved, and nothing is decided otherwise for that."""
        view = self.view if scene is self.scene else View(scene, plan, self.view.still)
        return replace(self, scene=scene, plan=plan, view=view)
