"""Map work that the GPU does."""

from __future__ import annotations

import math
from typing import Any

import moderngl
import numpy as np
import numpy.typing as npt

from glbump.gl.context import Context
from glbump.gl.levels import texture_2d
from glbump.gl.program import build_program
from glbump.gl.source import resolve
from glbump.maps.layout import LATLONG, EnvironmentMap
from glbump.maps.pyramid import chain
from glbump.plan.choices import DRAWN_LAYOUTS


def faces_of_panorama(
    context: Context, panorama: EnvironmentMap, size: int, dtype: str, exponent: int = 0
) -> npt.NDArray[np.floating[Any]]:
    """A lat-long picture / 2**exponent resampled to six faces, (6, size, size, 4) of dtype "f2" or "f4".

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
    light = chain(panorama.pixels[0], level)[-1]
    source = texture_2d(context, [np.ldexp(light, -exponent) if exponent else light], dtype)
    source.repeat_y = False
    target = gl.texture((size, 6 * size), 4, dtype=dtype)
    frame = gl.framebuffer([target])
    empty = gl.vertex_array(program, [])
    frame.use()
    gl.disable(moderngl.DEPTH_TEST | moderngl.CULL_FACE | moderngl.BLEND)
    source.use(0)
    empty.render(vertices=3)
    faces = np.frombuffer(target.read(), dtype).reshape(6, size, size, 4)
    context.unbind()
    for thing in (empty, program, frame, target, source):
        thing.release()
    return faces
