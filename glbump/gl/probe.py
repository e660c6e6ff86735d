"""What a driver really does, where OpenGL leaves it room: each probe is one tiny draw with a known right answer.

A probe takes an open Context and returns plain numbers with a line, `meaning`, for the one who reads them.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import moderngl
import numpy as np
import numpy.typing as npt

from glbump.gl.context import Context

Floats = npt.NDArray[np.floating[Any]]
Finding = dict[str, Any]

_VERTEX = """#version 330
void main() { gl_Position = vec4(4 * (gl_VertexID & 1) - 1, 2 * (gl_VertexID & 2) - 1, 0, 1); }
"""
_LEVEL_SIZE, _TOP_LEVEL = 256, 8


def draw(
    context: Context,
    size: tuple[int, int],
    body: str,
    texture: moderngl.Texture | moderngl.TextureCube | None = None,
    coordinates: moderngl.Texture | None = None,
    version: int = 330,
    **uniforms: float,
) -> Floats:
    """What `body` (GLSL that sets vec4 `result`) yields for each pixel: (height, width, 4) float32, row 0 below.

    It has `texture` as sampler `map`, and `coordinates` as sampler2D of that name.
    """
    gl = context.gl
    kind = "samplerCube" if isinstance(texture, moderngl.TextureCube) else "sampler2D"
    declared = "".join(f"uniform float {name};\n" for name in uniforms)
    declared += f"uniform {kind} map;\n" if texture else ""
    declared += "uniform sampler2D coordinates;\n" if coordinates else ""
    program = gl.program(
        vertex_shader=_VERTEX,
        fragment_shader=f"#version {version}\n{declared}out vec4 result;\nvoid main() {{\n{body}\n}}\n",
    )
    if coordinates:
        program["coordinates"] = 1
        coordinates.use(1)
    for name, value in uniforms.items():
        program[name] = value
    target = gl.texture(size, 4, dtype="f4")
    framebuffer = gl.framebuffer([target])
    vertices = gl.vertex_array(program, [])
    framebuffer.use()
    gl.enable_only(moderngl.NOTHING)
    if texture:
        texture.use(0)
    vertices.render(gl.TRIANGLES, vertices=3)
    pixels = np.frombuffer(framebuffer.read(components=4, dtype="f4"), np.float32)
    context.unbind()
    for thing in (vertices, framebuffer, target, program):
        thing.release()
    return pixels.reshape(size[1], size[0], 4)


def _levels_texture(gl: moderngl.Context) -> moderngl.Texture:
    """A texture whose level l holds the number l everywhere: what is read is the level that was taken."""
    texture = gl.texture((_LEVEL_SIZE, _LEVEL_SIZE), 1, dtype="f4")
    texture.build_mipmaps()
    for level in range(_TOP_LEVEL + 1):
        side = _LEVEL_SIZE >> level
        texture.write(np.full((side, side), level, "f4"), level=level)
    texture.filter = (gl.LINEAR_MIPMAP_LINEAR, gl.LINEAR)
    return texture


def filter_weights(context: Context) -> Finding:
    """Bilinear weights per format: distinct values between two texels 0 and 1, over 4096 places, and the error."""
    count = 4096
    exact = np.arange(count) / count
    found: Finding = {}
    for name, dtype, texels in (("rgba8", "f1", "u1"), ("half", "f2", "f2"), ("float", "f4", "f4")):
        ends = np.array([0, 255 if texels == "u1" else 1], texels)
        texture = context.gl.texture((2, 1), 4, np.repeat(ends, 4), dtype=dtype)
        texture.filter = (context.gl.LINEAR, context.gl.LINEAR)
        # 64 x 64 pixels in reading order; between the centres of the two texels u runs from 1/4 to 3/4.
        body = "float i = floor(gl_FragCoord.y) * 64 + floor(gl_FragCoord.x);\n"
        body += "result = textureLod(map, vec2(0.25 + 0.5 * i / count, 0.5), 0);"
        read = draw(context, (64, 64), body, texture, count=count)[..., 0].ravel()
        found[name] = {"levels": len(np.unique(read)), "max_error": float(np.abs(read - exact).max())}
        texture.release()
    coarse = [name for name in found if found[name]["levels"] <= 257]
    found["meaning"] = (
        f"only 8 bits of weight between texels of {' and '.join(coarse)}: steps show where a map is magnified"
        if coarse
        else "weights between texels are as fine as the format"
    )
    return found


def level_of_detail(context: Context) -> Finding:
    """Level taken less the exact log2 of the footprint, for isotropic footprints of 1 to 128 texels."""
    steps = 512
    texture = _levels_texture(context.gl)
    # A scale for each 2x2 block, within which the driver takes its derivatives.
    body = """
    vec2 block = floor(gl_FragCoord.xy / 2);
    float wanted = 7 * block.x / count;
    result = texture(map, (gl_FragCoord.xy - 2 * block) * exp2(wanted) / 256);"""
    read = draw(context, (2 * steps, 2), body, texture, count=steps)[0, ::2, 0]
    texture.release()
    wanted = 7 * np.arange(steps) / steps
    error = read - wanted
    worst = float(np.abs(error).max())
    return {
        "min_error": float(error.min()),
        "max_error": float(error.max()),
        "mean_error": float(error.mean()),
        "distinct": len(np.unique(read)),
        "curve": [[round(float(wanted[i]), 4), round(float(error[i]), 5)] for i in range(0, steps, 16)],
        "meaning": f"mip levels are off by up to {worst:.3f}: "
        + ("exact enough" if worst < 0.01 else "a trilinear look-up mixes levels that much too sharp or soft"),
    }


def anisotropy(context: Context) -> Finding:
    """Level taken for a footprint of 16 x 1 texels under limits 1 to 16: right is log2(16 / limit). And given to
    textureGrad, under a limit of 2, where the place itself changes by 1 x 1."""
    texture = _levels_texture(context.gl)
    limits = [limit for limit in (1, 2, 4, 8, 16) if limit <= max(1.0, context.gl.max_anisotropy)]
    levels = {}
    for limit in limits:
        texture.anisotropy = float(limit)
        body = "result = texture(map, gl_FragCoord.xy * vec2(16, 1) / 256);"
        levels[str(limit)] = float(draw(context, (16, 16), body, texture)[8, 8, 0])
    texture.anisotropy = 2.0
    body = "result = textureGrad(map, gl_FragCoord.xy / 256, vec2(16, 0) / 256, vec2(0, 1) / 256);"
    given = float(draw(context, (16, 16), body, texture)[8, 8, 0])
    texture.release()
    if len(levels) == 1:
        honoured, meaning = False, "this driver has no anisotropic filtering"
    else:
        # Right is 3: 0 where 2 does what 16 does, 4 where footprints that are given are as wide as long.
        limited = levels["2"] > 1.5
        honoured = limited and 1.5 < given < 3.5
        meaning = (
            "the limit is honoured: sharp at grazing angles, for as many taps as the limit says"
            if honoured
            else "the limit is honoured, but not of footprints that are given; glbump looks up along these itself"
            if limited
            else "the limit is ignored: any above 1 costs the most; glbump looks up along footprints itself"
        )
    return {"limits": limits, "levels": levels, "given": given, "honoured": honoured, "meaning": meaning}


def odd_mips(context: Context) -> Finding:
    """Share of each of 7 texels in the 1x1 level that glGenerateMipmap makes by 7 -> 3 -> 1: right is 1/7."""
    shares, middle = [], []
    for texel in range(7):
        row = np.zeros(7, "f4")
        row[texel] = 1
        texture = context.gl.texture((7, 1), 1, row, dtype="f4", alignment=4)
        texture.build_mipmaps()
        middle.append(np.frombuffer(texture.read(level=1), "f4").tolist())
        shares.append(float(np.frombuffer(texture.read(level=2), "f4")[0]))
        texture.release()
    worst = max(abs(share - 1 / 7) for share in shares)
    return {
        "weights": shares,
        "weights_7_to_3": np.transpose(middle).tolist(),
        "max_error": worst,
        "meaning": "the driver's mip chains of odd sizes are the average"
        if worst < 0.001
        else "the driver's mip chains of odd sizes skip or overweigh texels; glbump's own do not",
    }


def nan_in_mips(context: Context) -> Finding:
    """NaNs in each level that glGenerateMipmap makes of 8x8 ones with one NaN; and beside it, at weight 0."""
    ones = np.ones((8, 8), "f4")
    ones[2, 2] = np.nan
    texture = context.gl.texture((8, 8), 1, ones, dtype="f4")
    texture.build_mipmaps()
    counts = [int(np.isnan(np.frombuffer(texture.read(level=level), "f4")).sum()) for level in range(4)]
    texture.filter = (context.gl.LINEAR, context.gl.LINEAR)
    beside = draw(context, (1, 1), "result = textureLod(map, vec2(1.5, 2.5) / 8, 0);", texture)[0, 0, 0]
    texture.release()
    return {
        "nan_per_level": counts,
        "poisons_1x1": counts[-1] > 0,
        "leaks_at_weight_0": bool(np.isnan(beside)),
        "meaning": "one NaN spoils every level above it; glbump refuses NaN when it reads a picture"
        if counts[-1]
        else "NaN does not climb the mip chain here; glbump refuses it all the same",
    }


def cube_edges(context: Context) -> Finding:
    """Filtering across the edge of faces 0 and 1 (right: 1/2) and the corner of faces 0, 1 and 1 (right: 2/3)."""
    texture = context.gl.texture_cube((4, 4), 1, dtype="f4")
    for face in range(6):
        texture.write(face, np.full((4, 4), face != 0, "f4"))
    texture.filter = (context.gl.LINEAR, context.gl.LINEAR)
    bodies = {"edge": "vec3(1, 0, 1)", "corner": "vec3(1, 1, 1)"}
    read = {
        name: float(draw(context, (1, 1), f"result = texture(map, {at});", texture)[0, 0, 0])
        for name, at in bodies.items()
    }
    texture.release()
    # Corners are the mean of three texels by the specification; hardware may weigh them otherwise.
    seamless = abs(read["edge"] - 1 / 2) < 0.01
    return {
        **read,
        "seamless": seamless,
        "meaning": "cube maps filter across their edges"
        if seamless
        else "cube maps show their edges: the reference filters across them, this driver does not",
    }


def denormals(context: Context) -> Finding:
    """Whether 1e-40 survives arithmetic, and whether half textures keep 2^-24."""
    body = "float tiny = a * b;\nresult = vec4(tiny * c * d, 0, 0, 0);"
    kept = float(draw(context, (1, 1), body, a=1e-30, b=1e-10, c=1e30, d=1e10)[0, 0, 0])
    texture = context.gl.texture((1, 1), 1, np.array([2.0**-24], "f2"), dtype="f2")
    texture.filter = (context.gl.NEAREST, context.gl.NEAREST)
    half = float(draw(context, (1, 1), "result = textureLod(map, vec2(0.5), 0) * 16777216;", texture)[0, 0, 0])
    texture.release()
    float_kept, half_kept = abs(kept - 1) < 0.01, abs(half - 1) < 0.01
    words = ("flushed to 0", "kept")
    return {
        "float_kept": float_kept,
        "half_texture_kept": half_kept,
        "meaning": f"floats below 1e-38 are {words[float_kept]}; halves below 6e-5 are {words[half_kept]}",
    }


PROBES: Sequence[Callable[[Context], Finding]] = (
    filter_weights,
    level_of_detail,
    anisotropy,
    odd_mips,
    nan_in_mips,
    cube_edges,
    denormals,
)


def probe(context: Context) -> dict[str, Finding]:
    """Every finding by its probe's name."""
    context.check("probe")
    return {one.__name__: one(context) for one in PROBES}
