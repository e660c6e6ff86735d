"""Map work that the GPU does."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import moderngl
import numpy as np
import numpy.typing as npt

from glbump.gl.context import Context
from glbump.gl.levels import cube_texture, texture_2d
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


def faces_of_panorama(
    context: Context, panorama: EnvironmentMap, size: int, dtype: str, exponent: int = 0
) -> npt.NDArray[np.floating[Any]]:
    """A lat-long picture / 2**exponent resampled to six faces, (6, size, size, 4) of dtype "f2" or "f4".

    One bilinear read for each texel, in the level whose texels are nearest in size to the cube's: at most the square
    root of 2 apart, so none is passed over.
    """
    # A texel at the middle of a face spans 2 / size radians, one of the picture 2 pi / width.
    level = max(0, round(math.log2(panorama.size[0] / (math.pi * size))))
    light = chain(panorama.pixels[0], level)[-1]
    source = EnvironmentMap(
        LATLONG, (np.ldexp(light, -exponent) if exponent else light)[None], panorama.scale, panorama.offset
    )
    return _faces_of(context, source, size, 1, dtype)


def gloss_chain(context: Context, environment: EnvironmentMap, size: int, samples: int) -> list[F32]:
    """What maps.gloss.gloss_chain computes, each lobe as `samples` samples, twice as many in each further level.

    Measured against quadrature: docs/gloss.md.
    """
    from glbump.maps.gloss import area_faces, area_reads, chain_lobes, without_bright  # a cube alone needs none of it

    if environment.layout is LATLONG:
        source, across = area_reads(environment, size)
        faces = np.ascontiguousarray(_faces_of(context, source, size, across, "f4")[..., :3])
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


def _faces_of(
    context: Context, panorama: EnvironmentMap, size: int, across: int, dtype: str
) -> npt.NDArray[np.floating[Any]]:
    """(6, size, size, 4), each texel the mean of across x across bilinear reads."""
    defines = {
        "ENVIRONMENT": DRAWN_LAYOUTS.index(LATLONG),
        "ENVIRONMENT_BORDER": int(panorama.has_own_grid),
        "ENVIRONMENT_FOOTPRINT": 0,
        "ENVIRONMENT_BELOW": 0,
        "ENVIRONMENT_MIX": 0,
        "EXPOSURE": 0,
    }
    program = build_program(context.gl, resolve("fullscreen.vert"), resolve("bake_cube.frag", defines=defines))
    values: dict[str, Any] = {"across": across}
    if panorama.has_own_grid:
        values["border"] = (*panorama.scale, *panorama.offset)
    source = texture_2d(context, [panorama.pixels[0]], dtype)
    source.repeat_y = False
    faces = _drawn(context, program, {"environment": source}, values, size, dtype)
    context.unbind()
    for thing in (program, source):
        thing.release()
    return faces


def _drawn(
    context: Context,
    program: moderngl.Program,
    textures: Mapping[str, Texture],
    values: Mapping[str, Any],
    size: int,
    dtype: str,
) -> npt.NDArray[np.floating[Any]]:
    """(6, size, size, 4): faces that a program draws one above the other."""
    gl = context.gl
    program["face_size"] = size
    for name, value in values.items():
        program[name] = value
    for unit, (name, texture) in enumerate(textures.items()):
        program[name] = unit
        texture.use(unit)
    target = gl.texture((size, 6 * size), 4, dtype=dtype)
    frame, empty = gl.framebuffer([target]), gl.vertex_array(program, [])
    frame.use()
    gl.disable(moderngl.DEPTH_TEST | moderngl.CULL_FACE | moderngl.BLEND)
    empty.render(vertices=3)
    faces = np.frombuffer(target.read(), dtype).reshape(6, size, size, 4)
    context.unbind()
    for thing in (empty, frame, target):
        thing.release()
    return faces
