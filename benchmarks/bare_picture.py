"""The bare script that `glbump render` is timed against: one mirror ball, from an EXR to a PNG, nothing else.

python benchmarks/bare_picture.py ENVIRONMENT.exr OUT.png SIZE SAMPLES LEVELS

Written for this one picture: it checks nothing, knows nothing but a unit ball in an OpenEXR lat-long, and says its
libraries' names outright. LEVELS is 1 for mip levels, 0 for none.
"""

import math
import sys
from typing import Any

import moderngl
import numpy as np
import OpenImageIO as oiio

VERTEX = """#version 330
uniform vec2 shift;
out vec3 ray;
void main() {
    vec2 corner = vec2(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0);
    gl_Position = vec4(corner, 0.0, 1.0);
    ray = vec3((corner + shift) * tan(radians(20.0)), -1.0);
}"""
FRAGMENT = """#version 330
uniform sampler2D environment;
in vec3 ray;
out vec4 color;
void main() {
    vec3 d = normalize(ray), eye = vec3(0.0, 0.0, 4.0);
    float b = dot(eye, d), inner = b * b - 15.0;
    vec3 r = d;
    if (inner > 0.0) r = reflect(d, eye + (-b - sqrt(inner)) * d);
    vec2 size = vec2(textureSize(environment, 0));
    vec2 uv = vec2(0.5 - atan(r.x, r.z) / 6.28318531, 0.5 - atan(r.y, length(r.xz)) / 3.14159265);
    color = vec4(texture(environment, (uv * (size - 1.0) + 0.5) / size).rgb, 1.0);
}"""
SUM = """#version 330
uniform sampler2D picture;
uniform float weight;
out vec4 color;
void main() { color = weight * texelFetch(picture, ivec2(gl_FragCoord.xy), 0); }"""
ENCODE = """#version 330
uniform sampler2D picture;
out vec4 color;
void main() {
    vec3 c = clamp(texelFetch(picture, ivec2(gl_FragCoord.xy), 0).rgb, 0.0, 1.0);
    color = vec4(mix(12.92 * c, 1.055 * pow(c, vec3(1.0 / 2.4)) - 0.055, greaterThan(c, vec3(0.0031308))), 1.0);
}"""


def main() -> None:
    path, out, (size, samples, levels) = sys.argv[1], sys.argv[2], map(int, sys.argv[3:])
    file: Any = oiio.ImageInput.open(path)
    pixels = file.read_image(0, 0, 0, 3, oiio.HALF)
    file.close()
    driver: Any = {"backend": "egl", "libgl": "libGL.so.1", "libegl": "libEGL.so.1"}
    gl = moderngl.create_context(standalone=True, **driver)
    environment = gl.texture((pixels.shape[1], pixels.shape[0]), 3, pixels.tobytes(), dtype="f2")
    if levels:
        environment.build_mipmaps()
    environment.filter = moderngl.LINEAR_MIPMAP_LINEAR if levels else moderngl.LINEAR, moderngl.LINEAR
    one, total = (gl.texture((size, size), 4, dtype="f2") for _ in range(2))
    shown = gl.texture((size, size), 4)
    targets = [gl.framebuffer([texture]) for texture in (one, total, shown)]
    draw, add, encode = (gl.program(VERTEX, fragment) for fragment in (FRAGMENT, SUM, ENCODE))
    vertices = [gl.vertex_array(program, []) for program in (draw, add, encode)]
    per_side = math.isqrt(samples)
    for number in range(samples):
        x, y = number % per_side, number // per_side
        draw["shift"] = ((2 * x + 1) / per_side - 1) / size, (1 - (2 * y + 1) / per_side) / size
        targets[0].use()
        gl.disable(moderngl.BLEND)
        environment.use()
        vertices[0].render(vertices=3)
        if samples > 1:
            targets[1].use()
            if number:
                gl.enable(moderngl.BLEND)
                gl.blend_func = moderngl.ONE, moderngl.ONE
            one.use()
            add["weight"] = 1 / samples
            vertices[1].render(vertices=3)
    targets[2].use()
    gl.disable(moderngl.BLEND)
    (total if samples > 1 else one).use()
    vertices[2].render(vertices=3)
    picture = np.frombuffer(targets[2].read(components=3), np.uint8).reshape(size, size, 3)[::-1]
    written: Any = oiio.ImageOutput.create(out)
    spec = oiio.ImageSpec(size, size, 3, oiio.UINT8)
    spec.attribute("png:compressionLevel", 1)
    written.open(out, spec)
    written.write_image(np.ascontiguousarray(picture))
    written.close()


main()
