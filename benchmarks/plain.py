"""`fast` against the program one would write first."""

from __future__ import annotations

from typing import Any

import moderngl
import numpy as np
import numpy.typing as npt

from benchmarks.figures import Cell, Section, Table, Target
from benchmarks.scenes import DATA, bricks, bumped_ball, evening, mirror_ball
from glbump.camera import projection_matrix, view_matrix
from glbump.demo.relief import normals
from glbump.environment import LatLong
from glbump.gl.renderer import Renderer
from glbump.maps.layout import LATLONG, EnvironmentMap
from glbump.scene import Scene
from glbump.trade.timing import in_turns, ratios, spread

LIMITS = {"mirror ball": 0.7, "bumped chrome": 0.85}

_VERTEX = """#version 330
uniform mat4 view_projection;
in vec3 position;
in vec2 texcoord;
out vec3 world;
out vec3 normal;
out vec2 uv;
void main() {
    world = position;
    normal = position;
    uv = texcoord;
    gl_Position = view_projection * vec4(position, 1.0);
}"""

_LOOK_UP = """
uniform sampler2D environment;
out vec4 color;
vec4 look_up(vec3 r) {
    vec2 at = vec2(0.5 + atan(r.x, -r.z) / 6.2831853, acos(clamp(r.y, -1.0, 1.0)) / 3.14159265);
    return vec4(pow(clamp(texture(environment, at).rgb, 0.0, 1.0), vec3(1.0 / 2.2)), 1.0);
}"""

_FRAGMENT = f"""#version 330
{_LOOK_UP}
uniform sampler2D normal_map;
uniform vec3 eye;
in vec3 world;
in vec3 normal;
in vec2 uv;
void main() {{
    vec3 n = normalize(normal);
#ifdef BUMPED
    vec3 t = normalize(vec3(n.z, 0.0, -n.x));
    vec3 b = cross(n, t);
    vec3 m = texture(normal_map, uv * vec2(8.0, 4.0)).xyz * 2.0 - 1.0;
    n = normalize(m.x * t + m.y * b + m.z * n);
#endif
    color = look_up(reflect(normalize(world - eye), n));
}}"""

_SKY_VERTEX = """#version 330
uniform mat4 world_from_clip;
uniform vec3 eye;
out vec3 direction;
void main() {
    vec2 corner = vec2((gl_VertexID << 1) & 2, gl_VertexID & 2) * 2.0 - 1.0;
    gl_Position = vec4(corner, 1.0, 1.0);
    vec4 far = world_from_clip * gl_Position;
    direction = far.xyz / far.w - eye;
}"""

_SKY_FRAGMENT = f"""#version 330
{_LOOK_UP}
in vec3 direction;
void main() {{ color = look_up(normalize(direction)); }}"""


class PlainBall:
    """A mirror ball of 65,536 triangles, with a normal map if told so, and the sky behind it.

    One texture() for each map; the environment bilinear in halves, the normal map trilinear in bytes; a tone curve
    of 1/2.2; a target of bytes, read back.
    """

    def __init__(
        self, gl: moderngl.Context, scene: Scene, picture: EnvironmentMap, size: tuple[int, int], bumped: bool
    ) -> None:
        self._gl = gl
        width, height = picture.size
        opaque = np.ones((height, width, 4), np.float16)
        opaque[..., :3] = picture.pixels[0]
        self._environment = gl.texture((width, height), 4, opaque.tobytes(), dtype="f2")
        self._environment.filter = moderngl.LINEAR, moderngl.LINEAR
        self._environment.repeat_y = False
        # 0.02 world units deep, on tiles a 24th of the circumference wide and high in the middle of the ball.
        map_ = np.full((512, 512, 4), 255, np.uint8)
        map_[..., :3] = normals(bricks(), 0.02 / (2 * np.pi / 8))[::-1]
        self._normals = gl.texture((512, 512), 4, map_.tobytes())
        self._normals.build_mipmaps()
        self._normals.filter = moderngl.LINEAR_MIPMAP_LINEAR, moderngl.LINEAR
        self._target = gl.framebuffer([gl.texture(size, 4)], gl.depth_renderbuffer(size))
        clip = projection_matrix(scene.camera, size, 0.1, 10.0) @ view_matrix(scene.camera)
        ball = gl.program(
            _VERTEX, _FRAGMENT.replace("#version 330", "#version 330\n#define BUMPED" if bumped else "#version 330", 1)
        )
        sky = gl.program(_SKY_VERTEX, _SKY_FRAGMENT)
        self._set(ball, view_projection=clip, eye=scene.camera.eye, environment=0, normal_map=1)
        self._set(sky, world_from_clip=np.linalg.inv(clip), eye=scene.camera.eye, environment=0)
        points, uv, triangles = _ball(256, 128)
        buffers: list[Any] = [(gl.buffer(points.tobytes()), "3f", "position")]
        if bumped:
            buffers.append((gl.buffer(uv.tobytes()), "2f", "texcoord"))
        self._ball = gl.vertex_array(ball, buffers, gl.buffer(triangles.tobytes()))
        self._sky = gl.vertex_array(sky, [])

    @staticmethod
    def _set(program: moderngl.Program, **values: Any) -> None:
        for name, value in values.items():
            if name in program:
                uniform = program[name]
                assert isinstance(uniform, moderngl.Uniform)
                if isinstance(value, np.ndarray):
                    uniform.write(np.ascontiguousarray(value.T, np.float32).tobytes())
                else:
                    uniform.value = value

    def draw(self) -> npt.NDArray[np.uint8]:
        """One frame, (H, W, 4) bytes, bottom row first."""
        self._target.use()
        self._target.clear()
        self._gl.enable_only(moderngl.DEPTH_TEST | moderngl.CULL_FACE)
        self._gl.depth_func = "<="
        self._environment.use(0)
        self._normals.use(1)
        self._ball.render()
        self._gl.disable(moderngl.CULL_FACE)
        self._sky.render(vertices=3)
        width, height = self._target.size
        return np.frombuffer(self._target.read(components=4), np.uint8).reshape(height, width, 4)


def _ball(columns: int, rows: int) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.float32], npt.NDArray[np.int32]]:
    """Points, u,v and triangles of a unit ball in rows and columns."""
    u, v = np.meshgrid(np.linspace(0, 1, columns + 1), np.linspace(0, 1, rows + 1))
    longitude, latitude = 2 * np.pi * (u - 0.5), np.pi * (v - 0.5)
    across = np.cos(latitude)
    points = np.stack([across * np.sin(longitude), np.sin(latitude), across * np.cos(longitude)], axis=-1)
    first = (np.arange(rows)[:, None] * (columns + 1) + np.arange(columns)).reshape(-1, 1)
    triangles = first + np.array([0, 1, columns + 2, 0, columns + 2, columns + 1])
    return (
        points.reshape(-1, 3).astype(np.float32),
        np.stack([u, v], axis=-1).reshape(-1, 2).astype(np.float32),
        triangles.reshape(-1, 3).astype(np.int32),
    )


def measure(quick: bool = False) -> Section:
    """1024x1024 (quick: 64x64), mirror ball and bumped chrome."""
    size, turns = ((64, 64), 3) if quick else ((1024, 1024), 31)
    path = DATA / "openexr" / "KernerEnvLatLong.exr"
    environment = LatLong(path) if path.is_file() else evening()
    scenes = {"mirror ball": mirror_ball(environment), "bumped chrome": bumped_ball(environment)}
    rows: list[list[Cell]] = []
    targets = []
    with Renderer() as renderer:
        picture = renderer.contents.environment(environment)
        assert picture.layout is LATLONG
        for name, scene in scenes.items():
            plain = PlainBall(renderer.context.gl, scene, picture, size, bumped=name == "bumped chrome")
            times = in_turns(
                {
                    "plain": plain.draw,
                    "fast": lambda s=scene: renderer.render(s, size, "fast"),  # type: ignore[misc]
                    "fast, to bytes": lambda s=scene: renderer.render(s, size, "fast").display(),  # type: ignore[misc]
                    "balanced": lambda s=scene: renderer.render(s, size, "balanced"),  # type: ignore[misc]
                },
                turns,
            )
            base = times["plain"]
            for kind in ("fast", "fast, to bytes", "balanced"):
                wall, cpu = ratios(times[kind].wall, base.wall), ratios(times[kind].cpu, base.cpu)
                rows.append([name, kind, str(wall), str(cpu), 1e3 * spread(base.wall).median])
                if kind == "fast":
                    targets.append(Target.at_most(f"{name}, wall clock", wall.median, LIMITS[name], " times"))
                    targets.append(Target.at_most(f"{name}, CPU time", cpu.median, LIMITS[name], " times"))
    return Section(
        "Against the program one would write first",
        f"`Renderer.render` at {size[0]}x{size[1]}, in shares of a plain moderngl program's time "
        "(benchmarks/plain.py): a ball of 65,536 triangles, one texture() for each map, the environment as a bilinear "
        "half-float lat-long, a tone curve, a target of bytes, the sky drawn as well, read-back included. glbump reads "
        "back half floats; `to bytes` adds its sRGB encoding. `balanced` takes four samples a pixel.",
        (Table(("scene", "quality", "wall clock", "CPU time", "plain, ms"), rows),),
        targets,
    )


if __name__ == "__main__":
    from benchmarks.command import alone

    alone(measure)
