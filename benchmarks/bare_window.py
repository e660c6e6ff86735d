"""The bare script that `glbump view`'s first frame is timed against: one mirror ball in a GLFW window, nothing else.

python benchmarks/bare_window.py ENVIRONMENT.exr SIZE

Written for this one picture: one pass, ball, sky and sRGB in one shader, straight to the window.
"""

import sys
from typing import Any

import glfw
import moderngl
import OpenImageIO as oiio

VERTEX = """#version 330
out vec3 ray;
void main() {
    vec2 corner = vec2(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0);
    gl_Position = vec4(corner, 0.0, 1.0);
    ray = vec3(corner * tan(radians(20.0)), -1.0);
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
    vec3 c = clamp(texture(environment, (uv * (size - 1.0) + 0.5) / size).rgb, 0.0, 1.0);
    color = vec4(mix(12.92 * c, 1.055 * pow(c, vec3(1.0 / 2.4)) - 0.055, greaterThan(c, vec3(0.0031308))), 1.0);
}"""


def main() -> None:
    size = int(sys.argv[2])
    file: Any = oiio.ImageInput.open(sys.argv[1])
    pixels = file.read_image(0, 0, 0, 3, oiio.HALF)
    file.close()
    glfw.init()
    for hint, value in (
        (glfw.CONTEXT_VERSION_MAJOR, 3),
        (glfw.CONTEXT_VERSION_MINOR, 3),
        (glfw.OPENGL_PROFILE, glfw.OPENGL_CORE_PROFILE),
    ):
        glfw.window_hint(hint, value)
    window = glfw.create_window(size, size, "bare", None, None)
    glfw.make_context_current(window)
    gl = moderngl.create_context()
    environment = gl.texture((pixels.shape[1], pixels.shape[0]), 3, pixels.tobytes(), dtype="f2")
    environment.use()
    gl.vertex_array(gl.program(VERTEX, FRAGMENT), []).render(vertices=3)
    glfw.swap_buffers(window)
    gl.finish()


main()
