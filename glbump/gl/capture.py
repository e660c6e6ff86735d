"""Captures: ordinary draws of the rest of the scene, copied into the faces of a cube.

What mirrors alone show stays on the GPU. A rough or a diffuse surface needs sums over all directions, which
`Contents` makes of pictures, and a hemicube's tiles need borders: for these the faces are read back, once a capture,
and are a CubeMap or a HemiCube from there on.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Hashable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial

import moderngl
import numpy as np

from glbump.camera import Camera
from glbump.captures import cameras, in_rounds, pictured
from glbump.environment import Captured, CubeMap, Environment, HemiCube
from glbump.gl.context import Context
from glbump.gl.levels import CUBE_POSITIVE_X, UPLOAD_UNIT
from glbump.gl.targets import DTYPES, read
from glbump.gl.textures import FILTERS
from glbump.maps.layout import CUBE
from glbump.plan import EnvironmentPlan, Plan
from glbump.quality import Quality
from glbump.scene import Scene

Taken = moderngl.TextureCube | CubeMap | HemiCube
Shown = Mapping[Captured, Taken]
Draw = Callable[[Scene, Sequence[Camera], tuple[int, int], Quality, Shown], Iterator[moderngl.Framebuffer]]
"""Draws a scene whose captured environments are shown as given, by one camera after another."""


class Captures:
    """What was captured last, for one scene; kept as long as nothing of it but the camera changes."""

    def __init__(self, context: Context, draw: Draw, forget: Callable[[Environment], None]) -> None:
        """forget: what is to be done with pictures that are shown no more."""
        self._context, self._draw, self._forget = context, draw, forget
        i, u = ctypes.c_int, ctypes.c_uint
        self._copy = context.native.entry("glCopyTexSubImage2D", u, i, i, i, i, i, i, i)
        self._key: Hashable = None
        self._shown: dict[Captured, Taken] = {}
        self._kinds: dict[Captured, Hashable] = {}
        # All textures; those that may be filled again; and of these the ones that this capture had no use for.
        self._held: list[moderngl.TextureCube] = []
        self._idle: list[moderngl.TextureCube] = []
        self._stale: list[moderngl.TextureCube] = []

    @property
    def bytes(self) -> int:
        """Of all textures held, levels and all."""
        return sum(6 * t.size[0] ** 2 * 4 * int(t.dtype[1]) * 4 // 3 for t in self._held)

    def fit(self, scene: Scene, plan: Plan, key: Hashable, recapture: bool) -> bool:
        """Whether what there is can be shown. key: what it depends on beside the scene itself."""
        wanted = _plans(plan)
        if any(self._kinds.get(environment) != _kind(how) for environment, how in wanted.items()):
            return False
        return not (wanted and recapture) or self._key == _key(scene, key)

    def shown(self, scene: Scene, plan: Plan, quality: Quality, key: Hashable, recapture: bool) -> Shown:
        """What the scene's surfaces show of it, captured anew unless it fits. Raises as `Renderer.render`."""
        if not self.fit(scene, plan, key, recapture):
            plans = _plans(plan)
            self._begin()
            try:
                self._shown = in_rounds(scene, partial(self._take, plans, quality), self._let_go)
            except BaseException:
                self.release()
                raise
            self._trim()
            self._kinds = {environment: _kind(how) for environment, how in plans.items()}
            self._key = _key(scene, key)
        return self._shown

    def release(self) -> None:
        """Free everything."""
        self._begin()
        self._trim()

    def _begin(self) -> None:
        """Nothing is shown any more."""
        for taken in self._shown.values():
            self._let_go(taken)
        self._key = None
        self._shown, self._kinds = {}, {}
        self._idle, self._stale = list(self._held), list(self._held)

    def _trim(self) -> None:
        for texture in self._stale:
            texture.release()
        self._held, self._idle = ([t for t in kept if t not in self._stale] for kept in (self._held, self._idle))
        self._stale = []

    def _take(
        self,
        plans: Mapping[Captured, EnvironmentPlan],
        quality: Quality,
        environment: Captured,
        seen: Scene,
        shown: Shown,
    ) -> Taken:
        """One capture of what is seen."""
        size, how = (environment.size, environment.size), plans[environment]
        faces = self._draw(seen, cameras(environment), size, quality, shown)
        if _is_read_back(how):
            return pictured(environment, [read(face)[..., :3].astype(np.float32) for face in faces])
        texture = self._texture(environment.size, DTYPES[how.texture_format])
        for number, face in enumerate(faces):
            face.use()
            texture.use(UPLOAD_UNIT)
            self._copy(CUBE_POSITIVE_X + number, 0, 0, 0, 0, 0, *size)
        if how.filter != "bilinear":
            texture.build_mipmaps()
        texture.filter = FILTERS[how.filter]
        return texture

    def _texture(self, size: int, dtype: str) -> moderngl.TextureCube:
        for texture in self._idle:
            if texture.size == (size, size) and texture.dtype == dtype:
                self._idle.remove(texture)
                if texture in self._stale:
                    self._stale.remove(texture)
                return texture
        # Of four channels, as the frames it is copied from.
        texture = self._context.gl.texture_cube((size, size), 4, dtype=dtype)
        self._held.append(texture)
        return texture

    def _let_go(self, taken: Taken) -> None:
        if isinstance(taken, moderngl.TextureCube):
            self._idle.append(taken)
        else:
            self._forget(taken)


def filled(plan: Plan, shown: Shown) -> Plan:
    """The plan, with the pictures that were read back in place of what they were captured for."""
    pictures = {e: taken for e, taken in shown.items() if not isinstance(taken, moderngl.TextureCube)}
    environments = tuple(
        replace(how, environment=pictures[how.environment], size=None)
        if isinstance(how.environment, Captured) and how.environment in pictures
        else how
        for how in plan.environments
    )
    return replace(plan, environments=environments)


def _plans(plan: Plan) -> dict[Captured, EnvironmentPlan]:
    return {how.environment: how for how in plan.environments if isinstance(how.environment, Captured)}


def _is_read_back(how: EnvironmentPlan) -> bool:
    return how.gloss is not None or how.diffuse or how.layout is not CUBE


def _kind(how: EnvironmentPlan) -> Hashable:
    """What must stay for a capture to be shown again."""
    return how.filter, _is_read_back(how)


def _key(scene: Scene, key: Hashable) -> Hashable:
    return scene.surfaces, scene.environment, key
