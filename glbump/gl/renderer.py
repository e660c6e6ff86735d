"""Plan + Scene -> Frame: the one path that a picture takes, in a window or without any display."""

from __future__ import annotations

import ctypes
import time
from collections.abc import Callable, Hashable, Iterable, Iterator
from dataclasses import replace
from functools import partial
from typing import Any

import moderngl

from glbump import validate as check
from glbump.camera import Camera
from glbump.contents import Contents, content_keys
from glbump.environment import Captured
from glbump.errors import ContextError, LimitError
from glbump.frame import Frame
from glbump.gl import memory
from glbump.gl.capture import Captures, Shown, filled
from glbump.gl.context import Context, open_context
from glbump.gl.prepared import Draw, Drawn, Prepared
from glbump.gl.programs import Programs
from glbump.gl.showing import render_shown
from glbump.gl.targets import Targets, read
from glbump.gl.textures import Held, Store
from glbump.gl.uniforms import Sample, Still, View, mesh_repeat
from glbump.plan import Capabilities, EnvironmentPlan, Plan, Planner, make_plan
from glbump.plan.choices import DIFFUSES, FACTORS, GLOSSY, MESH
from glbump.quality import Quality, quality_of
from glbump.relief import is_normal_mapped
from glbump.scene import MOST_BUMPS, Scene, check_size

_MESH_ATTRIBUTES = {"position": "positions", "normal": "normals"}
_BUMP_ATTRIBUTES = {"texcoord": "uv", "tangent_u": "dpdu", "tangent_v": "dpdv"}
_FULL_ATTRIBUTES = {"normal_u": "dndu", "normal_v": "dndv"}
_SAMPLE_SHADING = 0x8C36
# Texture units.
_ENVIRONMENT, _GLOSS, _FRAME, _BUMP_0 = range(4)
_SPREAD_0 = _BUMP_0 + MOST_BUMPS
_DFG = _SPREAD_0 + MOST_BUMPS
_IRRADIANCE = _DFG + 1
_SAMPLERS = {"environment": _ENVIRONMENT, "gloss": _GLOSS, "dfg_table": _DFG, "irradiance_map": _IRRADIANCE}
_SAMPLERS |= {f"bump_{i}": _BUMP_0 + i for i in range(MOST_BUMPS)}
_SAMPLERS |= {f"spread_{i}": _SPREAD_0 + i for i in range(MOST_BUMPS)}


class _Stopped(Exception):
    """A picture that is given up."""


class Renderer:
    """Draws scenes, one context for all of them. Use it in a `with`, or call `release`.

    backend: "auto", "egl", "osmesa" or "window"; device: which EGL device. Raises ContextError when no OpenGL 3.3
    can be had. Programs, textures and targets are kept between frames and freed when other scenes need the room.
    """

    def __init__(
        self,
        backend: str = "auto",
        device: int | None = None,
        *,
        context: Context | None = None,
        contents: Contents | None = None,
    ) -> None:
        """context: one that is open already, and stays its owner's to release. contents: maps already read."""
        self.context = context or open_context(backend, device)
        self._owns_context = context is None
        self._released = False
        self.contents = contents or Contents()
        self._store = Store(self.context, self.contents)
        self._programs = Programs(self.context.gl)
        self._captures = Captures(self.context, self._captured_faces, self._store.forget)
        # By what is drawn in them: frames, or faces of captures.
        self._targets: dict[str, tuple[Hashable, Targets]] = {}
        self._last: Prepared | None = None
        self._flush = self.context.native.entry("glFlush")
        self._shade_each = self.context.native.entry("glMinSampleShading", ctypes.c_float)
        info = self.context.info
        self.capabilities = Capabilities(
            max_texture_size=info["max_texture_size"],
            max_cube_size=info["max_cube_size"],
            is_software=self.context.is_software,
            multisamples=self.context.multisamples,
            memory=memory.host_bytes(),
            texture_memory=memory.texture_bytes(self.context),
            honours_anisotropy=partial(getattr, self.context, "honours_anisotropy"),
        )
        self._planner = Planner(self.contents)

    def __enter__(self) -> Renderer:
        return self

    def __exit__(self, *_: object) -> None:
        self.release()

    def release(self) -> None:
        """Free everything on the GPU, the context included if it is its own. A second call does nothing.

        ContextError on another thread than the context's.
        """
        if self._released:
            return
        if self.context.is_open:  # Closed before, it took everything with it.
            self.context.check("release")  # Names of objects mean others in another context.
            self._release()
        self._released = True

    def _release(self) -> None:
        for _, targets in self._targets.values():
            targets.release()
        self._targets.clear()
        self.renew()
        if self._owns_context:
            self.context.release()

    def plan(self, scene: Scene, size: tuple[int, int] = (512, 512), quality: str | Quality = "balanced") -> Plan:
        """What `render` would draw, and why so."""
        return make_plan(scene, quality_of(quality), check_size(size), self.contents, self.capabilities)

    def render(
        self,
        scene: Scene,
        size: tuple[int, int] = (512, 512),
        quality: str | Quality = "balanced",
        *,
        recapture: bool = True,
        show: str | None = None,
    ) -> Frame:
        """A picture of the scene, `size` (width, height) pixels; of what glbump.shown names `show`, in place of light.

        recapture: surfaces with a Captured environment capture the scene anew where anything but the camera has
        changed since the last time; False shows what was captured last, whatever has changed, as long as all of these
        environments were captured then.
        Raises SceneError, ImageError, MeshError, LimitError for what cannot be drawn; ContextError after release or
        on another thread; ShaderError where a shader does not compile.
        """
        if show is not None:
            return render_shown(self, scene, show, size, quality)
        drawn = self.draw(scene, size, quality, recapture=recapture)
        assert drawn is not None, "nothing stops it"
        submitted = time.perf_counter()
        pixels = read(drawn.frame)
        self._require_no_error()
        # The GPU works while Python goes on, so its time shows up in the read-back.
        drawn.stats["ms"]["finish and read back"] = 1e3 * (time.perf_counter() - submitted)
        return Frame(pixels, drawn.stats, bottom_up=True)

    def draw(
        self,
        scene: Scene,
        size: tuple[int, int] = (512, 512),
        quality: str | Quality = "balanced",
        *,
        recapture: bool = True,
        use: str = "frames",
        stop: Callable[[], bool] | None = None,
    ) -> Drawn | None:
        """A picture that stays on the GPU, until the next one of the same `use` is drawn; all else as in `render`.

        stop: asked before each pass but the first; where it says True, the picture is given up, and None returned.
        """
        self._require_usable()
        started = time.perf_counter()
        _ = self.context.gl.error  # what others left behind is theirs
        ready = self._prepared(scene, check_size(size), quality_of(quality), check.flag("recapture", recapture))
        targets = self._targets_for(use, ready.plan)
        prepared = time.perf_counter()
        try:
            frame = self._draw(ready, targets, stop)
        except _Stopped:
            return None
        self._flush()
        self._require_no_error()
        stats = ready.stats | {"plan": dict(ready.stats["plan"])}
        stats["ms"] = {
            "plan and upload": 1e3 * (prepared - started),
            "submit": 1e3 * (time.perf_counter() - prepared),
        }
        return Drawn(frame, ready.plan, stats)

    def held(self) -> list[Held]:
        """What lies on the GPU for the last scenes: textures and meshes, with their bytes."""
        return self._store.held()

    def renew(self) -> None:
        """Make all programs, textures and meshes anew for the next picture: the shaders' files have changed, say.
        Pictures that were drawn stay."""
        self.context.check("renew")
        self._last = None
        self._captures.release()
        self._store.release()
        self._programs.release()

    def _prepared(self, scene: Scene, size: tuple[int, int], quality: Quality, recapture: bool) -> Prepared:
        """The scene made ready to be drawn, or what the last frame left so, where nothing has changed since."""
        check.instance("scene", scene, Scene)
        contents = quality, content_keys(scene)
        key, last = (size, contents), self._last
        self._last = None
        if last is not None and (last.key != key or last.freed != self._store.freed):
            last = None
        if last is not None and last.scene is scene:
            plan = last.plan
        else:
            plan = self._planner.plan(scene, quality, size, self.capabilities, contents)
        if (
            last is not None
            and last.plan.choices is plan.choices
            and self._captures.fit(scene, plan, contents, recapture)
        ):
            self._last = last.moved(scene, plan)
        else:
            shown = self._captures.shown(scene, plan, quality, contents, recapture)
            self._last = self._ready(scene, plan, shown, key)
        return self._last

    def _ready(self, scene: Scene, planned: Plan, shown: Shown, key: Hashable) -> Prepared:
        """shown: what captured environments show."""
        plan = filled(planned, shown)
        still = Still(scene, plan, self.contents)
        self._store.begin()
        draws = [self._surface(scene, plan, still, i, shown) for i in range(len(plan.surfaces))]
        sky = self._sky(plan, still) if plan.sky else None
        self._store.trim()
        for uniforms in self._programs.surplus(len(draws) + 1):
            self._store.part(uniforms.program)
            uniforms.release()
        stats = self._stats(scene, plan, draws)
        return Prepared(scene, key, planned, View(scene, plan, still), draws, sky, stats, self._store.freed)

    def drawn_once(self, scene: Scene, plan: Plan, quality: Quality) -> tuple[moderngl.Framebuffer, dict[str, Any]]:
        """A plan's picture, and its statistics, of which nothing is kept."""
        self._require_usable()
        shown = self._captures.shown(scene, plan, quality, (quality, content_keys(scene)), True)
        ready = self._ready(scene, plan, shown, None)
        return self._draw(ready, self._targets_for("frames", plan)), ready.stats

    def _captured_faces(
        self, scene: Scene, cameras: Iterable[Camera], size: tuple[int, int], quality: Quality, shown: Shown
    ) -> Iterator[moderngl.Framebuffer]:
        """The pictures that a capture takes, one by one: of one scene, by a camera that turns."""
        planner = Planner(self.contents)
        ready: Prepared | None = None
        for camera in cameras:
            turned = replace(scene, camera=camera)
            plan = planner.plan(turned, quality, size, self.capabilities, None)
            try:
                targets = self._targets_for("faces", plan)
            except LimitError as why:
                raise LimitError(f"environment.size {size[0]}, of what a surface captures: {why}") from None
            if ready is not None and ready.plan.choices is plan.choices:
                ready = ready.moved(turned, plan)
            else:
                ready = self._ready(turned, plan, shown, None)
            yield self._draw(ready, targets)

    def _stats(self, scene: Scene, plan: Plan, draws: list[Draw]) -> dict[str, Any]:
        """All that is known before the frame is drawn."""
        return {
            "backend": self.context.backend,
            "renderer": self.context.info["renderer"],
            "version": self.context.info["version"],
            "plan": {choice.what: choice.value for choice in plan.choices},
            "explain": plan.explain(),
            "bytes": self._store.bytes + self._captures.bytes,
            "notes": self.contents.notes(scene),
            "triangles": sum(draw.vertices.vertices for draw in draws) // 3,
        }

    def _require_usable(self) -> None:
        if self._released:
            raise ContextError("cannot render: this renderer is released; make a new one")
        self.context.check("render")

    def _require_no_error(self) -> None:
        """OpenGL goes on after an error, with black textures and the like; such a frame is none."""
        error = self.context.gl.error
        if error == "GL_NO_ERROR":
            return
        self._captures.release()
        self._store.release()
        if error == "GL_OUT_OF_MEMORY":
            raise LimitError("the driver's memory does not hold this scene; give smaller pictures, or a smaller size")
        raise ContextError(f"OpenGL refused a part of this frame ({error}); please report it with the scene")

    # ------------------------------------------------------------ drawing

    def _draw(self, ready: Prepared, targets: Targets, stop: Callable[[], bool] | None = None) -> moderngl.Framebuffer:
        """All samples of the frame; the framebuffer that holds the result. Raises _Stopped where `stop` says so."""
        plan, samples = ready.plan, ready.plan.samples
        for number in range(plan.passes):
            if number and stop is not None and stop():
                raise _Stopped
            self._draw_sample(ready, ready.view.sample(number), targets)
            if targets.sum is not None and plan.is_multisampled:
                self.context.gl.copy_framebuffer(targets.sum, targets.one)
            elif targets.sum is not None:
                self._fullscreen("accumulate.frag", targets.one, targets.sum, 1.0 / samples, add=number > 0)
        if targets.straight is not None and targets.sum is not None:
            self._fullscreen("straight.frag", targets.sum, targets.straight)
            return targets.straight
        return targets.sum or targets.one

    def _draw_sample(self, ready: Prepared, sample: Sample, targets: Targets) -> None:
        gl = self.context.gl
        targets.begin_sample()
        if ready.plan.is_multisampled:
            gl.enable_direct(_SAMPLE_SHADING)
            self._shade_each(1.0)
        gl.enable_only(moderngl.DEPTH_TEST)
        gl.depth_func = "<="
        for i, draw in enumerate(ready.draws):
            for texture, unit in draw.textures:
                texture.use(unit)
            if ready.plan.surfaces[i].cull:
                gl.enable(moderngl.CULL_FACE)
            else:
                gl.disable(moderngl.CULL_FACE)
            gl.front_face = "cw" if ready.view.still.mirrored[i] else "ccw"
            draw.uniforms.write(draw.values)
            draw.uniforms.write(sample.surfaces[i])
            draw.vertices.render()
        gl.front_face = "ccw"
        if ready.sky is not None:
            if not ready.plan.sky_each:
                gl.disable_direct(_SAMPLE_SHADING)
            gl.disable(moderngl.CULL_FACE)
            for texture, unit in ready.sky.textures:
                texture.use(unit)
            ready.sky.uniforms.write(ready.sky.values)
            ready.sky.uniforms.write(sample.sky)
            ready.sky.vertices.render(vertices=3)
        if ready.plan.is_multisampled:
            gl.disable_direct(_SAMPLE_SHADING)

    def _fullscreen(
        self,
        fragment: str,
        source: moderngl.Framebuffer,
        target: moderngl.Framebuffer,
        weight: float = 1.0,
        add: bool = False,
    ) -> None:
        """One pass over all pixels from `source` to `target`: in place of what is there, or added to it."""
        gl = self.context.gl
        uniforms = self._programs.get("fullscreen.vert", fragment)
        target.use()
        gl.enable_only(moderngl.BLEND if add else moderngl.NOTHING)
        gl.blend_func = moderngl.ONE, moderngl.ONE
        Targets.texture_of(source).use(_FRAME)
        uniforms.write({"sample_picture": _FRAME, "premultiplied": _FRAME, "weight": weight})
        uniforms.vertices.render(vertices=3)

    def _surface(self, scene: Scene, plan: Plan, still: Still, index: int, shown: Shown) -> Draw:
        how = plan.surfaces[index]
        environment = plan.environments[how.environment]
        uniforms = self._programs.get("surface.vert", "surface.frag", how.defines)
        values = _SAMPLERS | still.environments[how.environment] | still.surfaces[index]
        textures: list[tuple[moderngl.Texture | moderngl.TextureCube, int]] = []
        glossy = how.has("LIGHT") == GLOSSY
        if glossy and how.has("DFG") == FACTORS["table"]:
            textures.append((self._store.lobe_factors(), _DFG))
        if how.has("DIFFUSE") == DIFFUSES["map"]:
            textures.append((self._store.irradiance(environment), _IRRADIANCE))
        if glossy and environment.gloss is not None:
            textures.append((self._store.gloss(environment), _GLOSS))
        elif environment.layout is not None:
            textures.append((self._environment(environment, shown), _ENVIRONMENT))
        for i, layer in enumerate(how.layers):
            texture = self._store.relief(layer, plan, full=bool(how.has("BUMP_FULL")))
            if how.has("BUMP_GRADIENTS"):
                texture.anisotropy = how.has("BUMP_GRADIENTS")
            textures.append((texture, _BUMP_0 + i))
            if how.has("SPREAD") and layer.has_spread(plan.bump_filter):
                textures.append((self._store.spread(layer, plan, how.has("FLATS") > 0), _SPREAD_0 + i))
        return Draw(uniforms, values, uniforms.vertex_array(self._mesh(scene, plan, index)), textures)

    def _environment(self, how: EnvironmentPlan, shown: Shown) -> moderngl.Texture | moderngl.TextureCube:
        taken = shown.get(how.environment) if isinstance(how.environment, Captured) else None
        return taken if isinstance(taken, moderngl.TextureCube) else self._store.environment(how)

    def _mesh(self, scene: Scene, plan: Plan, index: int) -> Any:
        how = plan.surfaces[index]
        attributes = {"position": "positions"}
        if how.has("SHAPE") == MESH:
            attributes = _MESH_ATTRIBUTES | (_BUMP_ATTRIBUTES if how.has("HAS_UV") else {})
            attributes |= _FULL_ATTRIBUTES if how.has("BUMP_FULL") else {}
        shape = None if how.has("OUTLINE") else scene.surfaces[index].shape
        return self._store.mesh(
            shape, how.segments, attributes, mesh_repeat(how), normal_map=is_normal_mapped(how.layers)
        )

    def _sky(self, plan: Plan, still: Still) -> Draw:
        environment = plan.environments[0]
        defines = (*environment.defines, ("PARALLAX", plan.sky_parallax), ("SHOW", plan.show))
        uniforms = self._programs.get("sky.vert", "sky.frag", defines)
        textures = [] if environment.layout is None else [(self._store.environment(environment), _ENVIRONMENT)]
        return Draw(uniforms, _SAMPLERS | still.sky, uniforms.vertices, textures)

    # ------------------------------------------------------------ what is kept between frames

    def _targets_for(self, use: str, plan: Plan) -> Targets:
        key = Targets.key(plan)
        before = self._targets.get(use)
        if before is None or before[0] != key:
            # Made first: where there is no room for them, the last picture stays.
            self._targets[use] = (key, Targets(self.context, plan))
            if before is not None:
                before[1].release()
        return self._targets[use][1]


def render(
    scene: Scene,
    size: tuple[int, int] = (512, 512),
    quality: str | Quality = "balanced",
    backend: str = "auto",
    device: int | None = None,
    *,
    show: str | None = None,
) -> Frame:
    """One picture; `Renderer` for many. Arguments and errors as in `Renderer` and `Renderer.render`."""
    with Renderer(backend, device) as renderer:
        return renderer.render(scene, size, quality, show=show)
