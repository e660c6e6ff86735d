"""Map work that the GPU does."""

from __future__ import annotations

import ctypes
import math
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

import moderngl
import numpy as np
import numpy.typing as npt

from glbump.gl.context import Context
from glbump.gl.levels import CUBE_POSITIVE_X, cube_texture, texture_2d
from glbump.gl.program import build_program
from glbump.gl.source import resolve
from glbump.maps.layout import CUBE, LATLONG, EnvironmentMap
from glbump.maps.levels import environment_levels
from glbump.maps.pyramid import chain
from glbump.plan.choices import DRAWN_LAYOUTS

F32 = npt.NDArray[np.float32]
BRIGHT = 64
"""Texels of the environment whose light a drawn chain does not leave to its samples."""

Texture = moderngl.Texture | moderngl.TextureCube
_FRAMEBUFFER, _COLOR = 0x8D40, 0x8CE0


def faces_of_panorama(
    context: Context, panorama: EnvironmentMap, size: int, dtype: str, exponent: int = 0
) -> npt.NDArray[np.floating[Any]]:
    """A lat-long picture / 2**exponent resampled to six faces, (6, size, size, 4) of dtype "f2" or "f4"."""
    with _panorama_program(context, _fitting(panorama, size, exponent), 1) as (program, textures):
        return _drawn(context, program, textures, {}, size, dtype)


def cube_of_panorama(
    context: Context, panorama: EnvironmentMap, size: int, dtype: str, exponent: int = 0
) -> moderngl.TextureCube:
    """The same as a texture without levels: drawn where it is needed, and nobody waits for it."""
    cube = context.gl.texture_cube((size, size), 4, dtype=dtype)
    # moderngl attaches no faces: one is put in place of a texture of their size.
    target = context.gl.texture((size, size), 4, dtype=dtype)
    frame = context.gl.framebuffer([target])
    u, i = ctypes.c_uint, ctypes.c_int
    attach = context.native.entry("glFramebufferTexture2D", u, u, u, u, i)
    with _panorama_program(context, _fitting(panorama, size, exponent), 1) as (program, textures):
        empty = _begin(context, program, textures, size)
        frame.use()
        for face in range(6):
            attach(_FRAMEBUFFER, _COLOR, CUBE_POSITIVE_X + face, cube.glo, 0)
            program["first_face"] = face
            empty.render(vertices=3)
        context.unbind()
        for thing in (empty, frame, target):
            thing.release()
    return cube


def _fitting(panorama: EnvironmentMap, size: int, exponent: int) -> EnvironmentMap:
    """What the texels of a cube's faces are read from, / 2**exponent.

    One bilinear read for each texel, in the level whose texels are nearest in size to the cube's: at most the square
    root of 2 apart, so none is passed over.
    """
    # A texel at the middle of a face spans 2 / size radians, one of the picture 2 pi / width.
    level = max(0, round(math.log2(panorama.size[0] / (math.pi * size))))
    light = chain(panorama.pixels[0], level)[-1]
    return EnvironmentMap(
        LATLONG, (np.ldexp(light, -exponent) if exponent else light)[None], panorama.scale, panorama.offset
    )


def gloss_chain(context: Context, environment: EnvironmentMap, size: int, samples: int) -> list[F32]:
    """What maps.gloss.gloss_chain computes, each lobe as `samples` samples, twice as many in each further level.

    Measured against quadrature: docs/gloss.md.
    """
    from glbump.maps.gloss import area_faces, area_reads, chain_lobes, without_bright  # a cube alone needs none of it

    if environment.layout is LATLONG:
        source, across = area_reads(environment, size)
        with _panorama_program(context, source, across) as (panorama, read):
            faces = np.ascontiguousarray(_drawn(context, panorama, read, {}, size, "f4")[..., :3])
    else:
        faces = area_faces(environment, size)
    dull, *bright = without_bright(faces, BRIGHT)
    # A texture has at least one texel; of no light, here.
    dirs, light = (rows if len(rows) else np.zeros((1, 3), np.float32) for rows in bright)
    cube = cube_texture(context, environment_levels(EnvironmentMap(CUBE, dull)), "f4")
    program = build_program(context.gl, resolve("fullscreen.vert"), resolve("bake_gloss.frag"))
    levels = [faces]
    for number, lobe in enumerate(chain_lobes(size, samples), 1):
        # In the middle of a face a texel has (2 / size)^2.
        level = 0.5 * np.log2(lobe.samples[:, 3:] * size**2 / 4)
        textures: dict[str, Texture] = {
            "environment": cube,
            "lobe": _table(context, np.concatenate([lobe.samples[:, :3], level], axis=1)[None]),
            "bright": _table(context, np.stack([dirs, light / lobe.integral])),
        }
        drawn = _drawn(context, program, textures, {"alpha": lobe.alpha}, size >> number, "f4")
        levels.append(drawn[..., :3].copy())
        textures["lobe"].release()
        textures["bright"].release()
    context.unbind()
    for thing in (program, cube):
        thing.release()
    return levels


def _table(context: Context, rows: npt.NDArray[Any]) -> moderngl.Texture:
    """Numbers (H, W, C) that shaders read one by one."""
    height, width, channels = rows.shape
    return context.gl.texture((width, height), channels, rows.astype(np.float32), dtype="f4")


@contextmanager
def _panorama_program(
    context: Context, panorama: EnvironmentMap, across: int
) -> Iterator[tuple[moderngl.Program, dict[str, Texture]]]:
    """What draws a panorama's faces, each texel the mean of across x across bilinear reads; and what it reads."""
    defines = {
        "ENVIRONMENT": DRAWN_LAYOUTS.index(LATLONG),
        "ENVIRONMENT_BORDER": int(panorama.has_own_grid),
        "ENVIRONMENT_FOOTPRINT": 0,
        "ENVIRONMENT_BELOW": 0,
        "ENVIRONMENT_MIX": 0,
        "EXPOSURE": 0,
    }
    program = build_program(context.gl, resolve("fullscreen.vert"), resolve("bake_cube.frag", defines=defines))
    program["across"] = across
    if panorama.has_own_grid:
        program["border"] = (*panorama.scale, *panorama.offset)
    # As the picture is: to make halves of it would take half as long as drawing the faces.
    source = texture_2d(context, [panorama.pixels[0]], "f4")
    source.repeat_y = False
    try:
        yield program, {"environment": source}
    finally:
        for thing in (program, source):
            thing.release()


def _begin(
    context: Context, program: moderngl.Program, textures: Mapping[str, Texture], size: int
) -> moderngl.VertexArray:
    """All set for drawing faces."""
    program["face_size"] = size
    for unit, (name, texture) in enumerate(textures.items()):
        program[name] = unit
        texture.use(unit)
    context.gl.disable(moderngl.DEPTH_TEST | moderngl.CULL_FACE | moderngl.BLEND)
    return context.gl.vertex_array(program, [])


def _drawn(
    context: Context,
    program: moderngl.Program,
    textures: Mapping[str, Texture],
    values: Mapping[str, Any],
    size: int,
    dtype: str,
) -> npt.NDArray[np.floating[Any]]:
    """(6, size, size, 4): faces that a program draws one above the other."""
    for name, value in values.items():
        program[name] = value
    target = context.gl.texture((size, 6 * size), 4, dtype=dtype)
    frame, empty = context.gl.framebuffer([target]), _begin(context, program, textures, size)
    frame.use()
    empty.render(vertices=3)
    faces = np.frombuffer(target.read(), dtype).reshape(6, size, size, 4)
    context.unbind()
    for thing in (empty, frame, target):
        thing.release()
    return faces
