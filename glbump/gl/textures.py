"""Maps -> textures and vertex buffers: format, filter, levels. Kept while scenes use them."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Hashable, Sequence
from dataclasses import field
from typing import Any, NamedTuple

import moderngl
import numpy as np
import numpy.typing as npt

from glbump.contents import Contents, bump_key, environment_key, shape_key
from glbump.environment import Environment
from glbump.frozen import Frozen
from glbump.gl.context import Context
from glbump.gl.levels import cube_texture, generate_levels, texture_2d
from glbump.maps.layout import CUBE, LATLONG, EnvironmentMap, Layout, resampled, sheet
from glbump.maps.levels import environment_levels
from glbump.maps.light_formats import LIGHT_FORMATS
from glbump.maps.pyramid import chain_by
from glbump.mesh import in_frame, in_repeats, outline
from glbump.plan import EnvironmentPlan, Plan
from glbump.relief import Layer
from glbump.shapes import Shape

F32 = npt.NDArray[np.float32]

FILTERS = {
    "bilinear": (moderngl.LINEAR, moderngl.LINEAR),
    "nearest-level": (moderngl.LINEAR_MIPMAP_NEAREST, moderngl.LINEAR),
    "trilinear": (moderngl.LINEAR_MIPMAP_LINEAR, moderngl.LINEAR),
}


class MeshBuffers(Frozen):
    """A mesh on the GPU: one buffer for each attribute it has, and its indices; and how programs read them."""

    attributes: dict[str, moderngl.Buffer]
    indices: moderngl.Buffer
    _arrays: dict[int, moderngl.VertexArray] = field(default_factory=dict)

    def vertex_array(self, gl: moderngl.Context, program: moderngl.Program) -> moderngl.VertexArray:
        """The mesh as `program` reads it."""
        if program.glo not in self._arrays:
            content = [
                (buffer, "2f" if name == "texcoord" else "3f", name)
                for name, buffer in self.attributes.items()
                if name in program
            ]
            self._arrays[program.glo] = gl.vertex_array(program, content, self.indices)
        return self._arrays[program.glo]

    def part(self, program: moderngl.Program) -> None:
        """Free what `program` reads it by: another program may get its number."""
        array = self._arrays.pop(program.glo, None)
        if array is not None:
            array.release()

    def release(self) -> None:
        """Free everything."""
        for array in self._arrays.values():
            array.release()
        for buffer in (*self.attributes.values(), self.indices):
            buffer.release()

    @property
    def size(self) -> int:
        """Bytes on the GPU."""
        return sum(b.size for b in (*self.attributes.values(), self.indices))


class Held(NamedTuple):
    """What lies on the GPU: what for, how it is kept, and its bytes with all levels."""

    what: str
    form: str
    bytes: int


def _form(thing: Any) -> str:
    if isinstance(thing, MeshBuffers):
        return f"{thing.indices.size // 12:,} triangles with {', '.join(thing.attributes)}"
    width, height = thing.size
    faces = "six faces of " if isinstance(thing, moderngl.TextureCube) else ""
    levels = "one level" if thing.filter == FILTERS["bilinear"] else "all levels"
    return f"{faces}{width}x{height}, {thing.components} channels, {levels}"


class Store:
    """GL objects made from maps, kept by what they hold; the oldest go when they pass `most_bytes`, or are more than
    `most`: shapes that change from frame to frame leave a mesh behind each time.

    bytes: of all textures and buffers held. freed: how many have been let go; as long as it stays, all handed out live.
    """

    def __init__(self, context: Context, contents: Contents, most_bytes: int = 1 << 30, most: int = 64) -> None:
        self._context = context
        self._contents = contents
        self._most_bytes, self._most = most_bytes, most
        self._kept: OrderedDict[Hashable, tuple[Any, int]] = OrderedDict()
        self._in_use: set[Hashable] = set()
        self.bytes = 0
        self.freed = 0

    def held(self) -> list[Held]:
        """All there is, what was used last at the end."""
        named = ((key[0] if isinstance(key, tuple) else key, *made) for key, made in self._kept.items())
        return [Held(str(what), _form(thing), size) for what, thing, size in named]

    def begin(self) -> None:
        """A new frame: nothing is in use yet."""
        self._in_use.clear()

    def trim(self) -> None:
        """Free what this frame does not use, oldest first, while there is too much."""
        if self.bytes <= self._most_bytes and len(self._kept) <= self._most:
            return
        for key in [key for key in self._kept if key not in self._in_use]:
            self._free(key)
            if self.bytes <= self._most_bytes and len(self._kept) <= self._most:
                break

    def forget(self, environment: Environment) -> None:
        """Free all that was made of an environment, and let go of its contents."""
        mine = environment_key(environment)
        for key in [key for key in self._kept if isinstance(key, tuple) and mine in key]:
            self._free(key)
        self._contents.forget(environment)

    def part(self, program: moderngl.Program) -> None:
        """Free what a program that goes reads meshes by."""
        for thing, _ in self._kept.values():
            if isinstance(thing, MeshBuffers):
                thing.part(program)
        self.freed += 1

    def release(self) -> None:
        """Free everything."""
        for key in list(self._kept):
            self._free(key)

    def _free(self, key: Hashable) -> None:
        thing, size = self._kept.pop(key)
        thing.release()
        self.bytes -= size
        self.freed += 1

    def _get(self, key: Hashable, make: Callable[[], tuple[Any, int]]) -> Any:
        if key not in self._kept:
            self._kept[key] = made = make()
            self.bytes += made[1]
        self._kept.move_to_end(key)
        self._in_use.add(key)
        return self._kept[key][0]

    def environment(self, plan: EnvironmentPlan) -> moderngl.Texture | moderngl.TextureCube:
        """An environment's texels as its plan wants them."""
        key = (
            "environment",
            environment_key(plan.environment),
            plan.layout,
            plan.size,
            plan.texture_format,
            plan.pre_exposure,
            plan.filter,
            plan.pyramid,
        )
        texture: moderngl.Texture | moderngl.TextureCube = self._get(key, lambda: self._make_environment(plan))
        most = dict(plan.defines).get("ENVIRONMENT_GRADIENTS", 0)
        if most:  # Who reads given levels is not touched by it.
            texture.anisotropy = most
        return texture

    def _make_environment(self, plan: EnvironmentPlan) -> tuple[Any, int]:
        picture, stored = self._contents.environment(plan.environment), LIGHT_FORMATS[plan.texture_format]
        exponent = plan.pre_exposure
        if plan.size is not None and picture.layout is LATLONG and plan.layout is CUBE:
            from glbump.gl.bake import cube_of_panorama, faces_of_panorama

            # Codes are made of what is drawn, and those of 10 bits are finer than halves are below 1.
            drawn = "f2" if stored.dtype in ("f2", "srgb8") else "f4"
            if stored.dtype == drawn and (plan.filter == "bilinear" or plan.pyramid == "hardware"):
                return self._drawn_cube(cube_of_panorama(self._context, picture, plan.size, drawn, exponent), plan)
            faces = faces_of_panorama(self._context, picture, plan.size, drawn, exponent)
            picture, exponent = EnvironmentMap(CUBE, faces[..., :3].astype(np.float32)), 0
        elif plan.size is not None and plan.layout is not None:
            picture = resampled(picture, plan.layout, plan.size)
        is_one = plan.filter == "bilinear" or plan.pyramid == "hardware"
        levels = [picture.pixels] if is_one else environment_levels(picture, plan.pyramid)
        texture, size = self.panorama(picture.layout, levels, plan.texture_format, exponent)
        if plan.filter != "bilinear" and plan.pyramid == "hardware":
            generate_levels(self._context, texture)
            size = size * 4 // 3
        texture.filter = FILTERS[plan.filter if plan.layout in (LATLONG, CUBE) else "bilinear"]
        return texture, size

    def _drawn_cube(self, texture: moderngl.TextureCube, plan: EnvironmentPlan) -> tuple[Any, int]:
        """With the driver's own levels where the filter reads them."""
        if plan.filter != "bilinear":
            generate_levels(self._context, texture)
        texture.filter = FILTERS[plan.filter]
        size = 6 * texture.size[0] ** 2 * 4 * int(texture.dtype[1])
        return texture, size * (4 if plan.filter != "bilinear" else 3) // 3

    def panorama(self, layout: Layout, levels: Sequence[F32], format: str, exponent: int = 0) -> tuple[Any, int]:
        """A texture of an environment's levels (tiles, h, w, 3) / 2**exponent, in a format of LIGHT_FORMATS, and its
        bytes: a cube, a picture that repeats in u, or a column of tiles, each in a border of its neighbours' texels."""
        how = LIGHT_FORMATS[format]
        if layout not in (CUBE, LATLONG):
            levels = [sheet(layout, levels)[None]]
        stored = [how.stored(level, exponent) for level in levels]
        size = sum(level.nbytes for level in stored)
        if layout is CUBE:
            return cube_texture(self._context, stored, how.dtype), size
        texture = texture_2d(self._context, [level[0] for level in stored], how.dtype)
        texture.repeat_y = False
        texture.repeat_x = layout is LATLONG
        return texture, size

    def relief(self, layer: Layer, plan: Plan, *, full: bool) -> moderngl.Texture:
        """A bump's map as a texture, turned so that t = 0 is the picture's lower edge, v up: slopes, slopes and heights
        (`full`), heights, or the coefficients of their spline."""
        how = layer.filter(plan.bump_filter)

        def make() -> tuple[Any, int]:
            texels = layer.texels(self._contents, heights=full)[::-1]
            most = layer.most(self._contents)
            by_driver = how != "bilinear" and layer.pyramid == "hardware"
            is_one = how == "bilinear" or by_driver
            made = [texels] if is_one else chain_by(layer.pyramid, texels, wraps=not layer.ends)
            levels = [layer.stored.stored(t, most) for t in made]
            texture = texture_2d(self._context, levels, layer.stored.dtype)
            if by_driver:
                generate_levels(self._context, texture)
            texture.filter = FILTERS[how]
            texture.repeat_x = texture.repeat_y = not layer.ends
            return texture, sum(level.nbytes for level in levels) * (4 if by_driver else 3) // 3

        key = ("relief", layer.kind, layer.kernel, full, bump_key(layer.bump), layer.stored.name, how, layer.pyramid)
        result: moderngl.Texture = self._get(key, make)
        return result

    def spread(self, layer: Layer, plan: Plan, apart: bool) -> moderngl.Texture:
        """What levels of a bump's map leave out, turned as the map is: its level 0 is the map's level 1. apart:
        with the share of its steep places."""
        dtype = "f4" if layer.stored.name == "float" else "f2"

        def make() -> tuple[Any, int]:
            levels = [level[::-1] for level in layer.spread(self._contents, plan.bump_spread, apart=apart)]
            texture = texture_2d(self._context, levels, dtype)
            texture.filter = FILTERS[layer.filter(plan.bump_filter)]
            texture.repeat_x = texture.repeat_y = not layer.ends
            return texture, sum(level.size for level in levels) * int(dtype[1])

        how = plan.bump_spread, apart, dtype, plan.bump_filter
        key = ("spread", layer.kind, layer.kernel, bump_key(layer.bump), *how)
        result: moderngl.Texture = self._get(key, make)
        return result

    def gloss(self, plan: EnvironmentPlan) -> moderngl.TextureCube:
        """An environment's roughness chain."""
        assert plan.gloss is not None
        size, samples, drawn = plan.gloss
        apart = plan.suns > 0

        def make() -> tuple[Any, int]:
            if drawn:
                from glbump.gl.bake import gloss_chain

                picture = self._contents.blurred(plan.environment, apart=apart)
                chain = gloss_chain(self._context, picture, size, samples)
            else:
                chain = self._contents.gloss(plan.environment, size, samples, apart=apart)
            return self.panorama(CUBE, chain, plan.texture_format, plan.pre_exposure)

        key = ("gloss", environment_key(plan.environment), plan.gloss, apart, plan.texture_format, plan.pre_exposure)
        result: moderngl.TextureCube = self._get(key, make)
        return result

    def irradiance(self, plan: EnvironmentPlan) -> moderngl.TextureCube:
        """An environment's irradiance / pi by normal. In floats: it is small."""
        apart = plan.suns > 0

        def make() -> tuple[Any, int]:
            from glbump.maps.diffuse import MAP_SIZE, irradiance_map

            picture = self._contents.blurred(plan.environment, apart=apart)
            return self.panorama(CUBE, [irradiance_map(picture, MAP_SIZE)], "float", plan.pre_exposure)

        key = ("irradiance", environment_key(plan.environment), apart, plan.pre_exposure)
        result: moderngl.TextureCube = self._get(key, make)
        return result

    def lobe_factors(self) -> moderngl.Texture:
        """The table of split-sum factors."""

        def make() -> tuple[Any, int]:
            from glbump.maps.dfg import table

            texels = table()
            texture = texture_2d(self._context, [texels], "f2")
            texture.repeat_x = texture.repeat_y = False
            return texture, texels.nbytes

        result: moderngl.Texture = self._get(("lobe factors",), make)
        return result

    def mesh(
        self,
        shape: Shape | None,
        segments: int,
        attributes: dict[str, str],
        repeat: tuple[float, float] = (1.0, 1.0),
        *,
        normal_map: bool = False,
    ) -> MeshBuffers:
        """Vertex buffers, of a sphere's outline for None. attributes: name in the shader -> field of Mesh; repeat: what
        uv are multiplied by; normal_map: with the axes of normal maps."""
        gl = self._context.gl

        def make() -> tuple[Any, int]:
            mesh = outline(segments) if shape is None else self._contents.mesh(shape, segments, normal_map=normal_map)
            if shape is not None:
                mesh = in_repeats(in_frame(mesh, *self._contents.frame(shape)), repeat)
            made = {
                name: gl.buffer(np.ascontiguousarray(getattr(mesh, field), np.float32).tobytes())
                for name, field in attributes.items()
            }
            buffers = MeshBuffers(made, gl.buffer(np.ascontiguousarray(mesh.triangles, np.int32).tobytes()))
            return buffers, buffers.size

        key = ("mesh", shape and shape_key(shape), segments, tuple(attributes), repeat, normal_map)
        result: MeshBuffers = self._get(key, make)
        return result
