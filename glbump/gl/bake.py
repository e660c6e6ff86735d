"""Map work that the GPU does."""

from __future__ import annotations

import math

import moderngl

from glbump.gl.context import Context
from glbump.gl.levels import texture_2d
from glbump.gl.program import build_program
from glbump.gl.source import resolve
from glbump.maps.panorama import Panorama
from glbump.maps.pyramid import chain
from glbump.plan import LATLONG, Plan


def cube_of_panorama(context: Context, panorama: Panorama, plan: Plan) -> moderngl.TextureCube:
    """The panorama resampled to a cube of plan.cube_size.

    One bilinear read for each texel, in the level whose texels are nearest in size to the cube's: at most the square
    root of 2 apart, so none is passed over.
    """
    assert plan.cube_size is not None
    size, gl = plan.cube_size, context.gl
    border = panorama.uv_scale != (1.0, 1.0)
    defines = {"ENVIRONMENT": LATLONG, "ENVIRONMENT_BORDER": int(border), "ENVIRONMENT_FOOTPRINT": 0, "EXPOSURE": 0}
    program = build_program(gl, resolve("fullscreen.vert"), resolve("bake_cube.frag", defines=defines))
    program["environment"] = 0
    program["face_size"] = size
    # A texel at the middle of a face spans 2 / size radians, one of the picture 2 pi / width.
    level = max(0, round(math.log2(panorama.pixels.shape[1] / (math.pi * size))))
    if border:
        program["border"] = (*panorama.uv_scale, *panorama.uv_offset)
    dtype = "f2" if plan.texture_format == "half" else "f4"
    source = texture_2d(context, chain(panorama.pixels, level)[-1:], dtype)
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
