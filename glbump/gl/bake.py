"""Map work that the GPU does."""

from __future__ import annotations

import math

import moderngl

from glbump.gl.context import Context
from glbump.gl.levels import texture_2d
from glbump.gl.program import build_program
from glbump.gl.source import resolve
from glbump.maps.layout import LATLONG, EnvironmentMap
from glbump.maps.pyramid import chain
from glbump.plan.choices import DRAWN_LAYOUTS


def cube_of_panorama(context: Context, panorama: EnvironmentMap, size: int, dtype: str) -> moderngl.TextureCube:
    """A lat-long picture resampled to a cube whose faces are `size` wide; dtype: "f2" or "f4".

    One bilinear read for each texel, in the level whose texels are nearest in size to the cube's: at most the square
    root of 2 apart, so none is passed over.
    """
    gl = context.gl
    defines = {
        "ENVIRONMENT": DRAWN_LAYOUTS.index(LATLONG),
        "ENVIRONMENT_BORDER": int(panorama.has_own_grid),
        "ENVIRONMENT_FOOTPRINT": 0,
        "ENVIRONMENT_BELOW": 0,
        "ENVIRONMENT_MIX": 0,
        "EXPOSURE": 0,
    }
    program = build_program(gl, resolve("fullscreen.vert"), resolve("bake_cube.frag", defines=defines))
    program["environment"] = 0
    program["face_size"] = size
    # A texel at the middle of a face spans 2 / size radians, one of the picture 2 pi / width.
    level = max(0, round(math.log2(panorama.size[0] / (math.pi * size))))
    if panorama.has_own_grid:
        program["border"] = (*panorama.scale, *panorama.offset)
    source = texture_2d(context, chain(panorama.pixels[0], level)[-1:], dtype)
    source.repeat_y = False
    target = gl.texture((size, 6 * size), 4, dtype=dtype)
    frame = gl.framebuffer([target])
    empty = gl.vertex_array(program, [])
    frame.use()
    gl.disable(moderngl.DEPTH_TEST | moderngl.CULL_FACE | moderngl.BLEND)
    source.use(0)
    empty.render(vertices=3)
    cube = gl.texture_cube((size, size), 4, target.read(), dtype=dtype)
    context.unbind()
    for thing in (empty, program, frame, target, source):
        thing.release()
    return cube
