"""Scene + plan -> the values of uniforms, computed in float64 and relative to the eye."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import moderngl
import numpy as np
import numpy.typing as npt

from glbump.camera import pixel_steps, projection_matrix, sample_number, sample_offsets, view_matrix
from glbump.contents import Contents
from glbump.environment import BoxBounds, Environment, Pictured, Procedural
from glbump.frozen import Frozen
from glbump.gl.textures import MeshBuffers
from glbump.maps.bump_formats import code_range
from glbump.maps.layout import EnvironmentMap, sheet_corners
from glbump.maps.levels import level_sizes
from glbump.maps.moments import moment_scale
from glbump.mesh import outline_matrix
from glbump.plan import EnvironmentPlan, Plan, SurfacePlan
from glbump.plan.choices import BY_PIXEL, DIFFUSES, GENERAL, MESH
from glbump.reference.reflect import f0_from_ior
from glbump.relief import LEVEL_WIDTH, Layer
from glbump.scene import MOST_BUMPS, Bump, Material, Scene, Surface
from glbump.shapes import Quad, Sphere, Torus

F64 = npt.NDArray[np.float64]

MOST_LEVELS = 15
"""Of an environment in tiles: as many as 16384 texels have, and as environment_input.glsl has places for."""


class Uniforms:
    """A program and the uniforms it kept. Values it does not use are passed over, so that callers need not know
    what the driver's compiler dropped."""

    def __init__(self, gl: moderngl.Context, program: moderngl.Program) -> None:
        self.program = program
        members = {name: program[name] for name in program}
        self._uniforms = {n: u for n, u in members.items() if isinstance(u, moderngl.Uniform)}
        self._written: dict[str, Any] = {}
        self._gl = gl
        self._empty: moderngl.VertexArray | None = None

    def write(self, values: Mapping[str, Any]) -> None:
        """Set what is there. Matrices (n, n) and rows of vectors are float64 arrays; the rest plain values."""
        for name, value in values.items():
            uniform = self._uniforms.get(name)
            # The very object that was written last is there still.
            if uniform is not None and self._written.get(name) is not value:
                self._written[name] = value
                if isinstance(value, np.ndarray):
                    # OpenGL wants columns one after another; rows of vectors stand so already, and a compiler may
                    # have cut an array to those that are read.
                    is_matrix = value.ndim == 2 and uniform.dimension == value.size
                    columns = value.T if is_matrix else value[: uniform.array_length]
                    uniform.write(np.ascontiguousarray(columns, np.float32).tobytes())
                else:
                    uniform.value = value

    @property
    def vertices(self) -> moderngl.VertexArray:
        """A vertex array without attributes, for passes over the whole target."""
        if self._empty is None:
            self._empty = self._gl.vertex_array(self.program, [])
        return self._empty

    def vertex_array(self, mesh: MeshBuffers) -> moderngl.VertexArray:
        """The mesh as this program reads it."""
        return mesh.vertex_array(self._gl, self.program)

    def release(self) -> None:
        """Free the program; the vertex arrays of meshes go with the meshes."""
        if self._empty is not None:
            self._empty.release()
        self.program.release()


class Sample(Frozen):
    """Uniforms that change with the sample's place within the pixels: of each surface, and of the sky."""

    surfaces: tuple[dict[str, Any], ...]
    sky: dict[str, Any]


class Still:
    """A planned scene's uniforms that stay as they are wherever the camera stands."""

    def __init__(self, scene: Scene, plan: Plan, contents: Contents) -> None:
        self.environments = [environment_uniforms(e, plan.footprint, contents) for e in plan.environments]
        self.sky = self.environments[0] | ({} if plan.sky_each else {"footprint": 1.0})
        self.surfaces = [surface_uniforms(scene, plan, i, contents) for i in range(len(scene.surfaces))]
        self.mirrored = [surface.transform.mirrors for surface in scene.surfaces]
        self.frames = [contents.frame(surface.shape) for surface in scene.surfaces]
        self.world_from_object = [world_from_object(surface, contents) for surface in scene.surfaces]
        self.object_from_world = [np.linalg.inv(matrix[:3, :3]) for matrix in self.world_from_object]


class View:
    """What a camera sees of a planned scene: `sample` by sample, the uniforms that its place decides."""

    def __init__(self, scene: Scene, plan: Plan, still: Still) -> None:
        self._scene, self._plan, self.still = scene, plan, still
        self._sky = room_uniforms(scene.environment, np.eye(3), np.asarray(scene.camera.eye))
        self._surfaces = [_seen_uniforms(scene, plan, i, still) for i in range(len(scene.surfaces))]
        self._view = view_matrix(scene.camera)
        self._projection = projection_matrix(scene.camera, plan.size, *plan.near_far)
        if plan.log_depth:
            # z = w - 2 near: clipped where w < near, and nowhere else. The depth itself comes from the fragments.
            self._projection[2] = self._projection[3] - (0, 0, 0, 2 * plan.near_far[0])
        self._view_from_object = [self._view @ matrix for matrix in still.world_from_object]
        self._samples: list[Sample] = []

    def sample(self, number: int) -> Sample:
        """Of one sample, 0, 1 and so on; made when it is asked for, and kept."""
        while len(self._samples) <= number:
            self._samples.append(self._at(*sample_offsets(self._plan.passes)[len(self._samples)].tolist()))
        return self._samples[number]

    def _at(self, x: float, y: float) -> Sample:
        """With the sample at x from the left and y from the top of each pixel, 0..1."""
        width, height = self._plan.size
        # The picture moves against the sample: what lay at the offset comes to lie at the pixel's centre.
        shift = 2.0 * (0.5 - x) / width, 2.0 * (y - 0.5) / height
        projection = self._projection.copy()
        projection[:2] += np.outer(shift, projection[3])
        world_from_ndc = self._world_from_ndc(*shift)
        surfaces: list[dict[str, Any]] = []
        drawn = zip(self._plan.surfaces, self._scene.surfaces, self._surfaces, self._view_from_object)
        for how, surface, seen, view_from_object in drawn:
            surfaces.append(seen | {"clip_from_object": projection @ view_from_object})
            surfaces[-1]["sample_number"] = sample_number(x, y, self._plan.passes)
            if how.has("DIRECTION") == BY_PIXEL:
                # Columns: the changes of the view direction, as the surface has it, with a pixel to the right and
                # with one up, and the direction at the middle of the picture; of any length.
                matrix = surface.transform.inverse() @ world_from_ndc * (2 / width, 2 / height, 1.0)
                surfaces[-1]["object_from_pixel"] = matrix / np.abs(matrix).max()
        sky = self._sky | {"env_from_ndc": self._scene.environment.env_from_world() @ world_from_ndc}
        return Sample(tuple(surfaces), sky)

    def _world_from_ndc(self, shift_x: float, shift_y: float) -> F64:
        """(3, 3): columns are the changes of a pixel's view direction with ndc x and y, and the direction ahead."""
        world_from_view = self._view[:3, :3].T
        right, up, ahead = world_from_view[:, 0], world_from_view[:, 1], -world_from_view[:, 2]
        if self._scene.camera.projection == "orthographic":
            return np.stack([0 * right, 0 * up, ahead], axis=1)
        right, up = right / self._projection[0, 0], up / self._projection[1, 1]
        return np.stack([right, up, ahead - right * shift_x - up * shift_y], axis=1)


def world_from_object(surface: Surface, contents: Contents) -> F64:
    """(4, 4): from a surface's coordinates as the GPU has them (`Contents.frame`)."""
    origin, unit = contents.frame(surface.shape)
    result = surface.transform.matrix().copy()
    result[:3, 3] += result[:3, :3] @ origin
    result[:3, :3] *= unit
    return result


def environment_uniforms(plan: EnvironmentPlan, footprint: float, contents: Contents) -> dict[str, Any]:
    """Of environment_input.glsl, all but the sampler. Its exposure takes back the texels' pre-exposure."""
    environment = plan.environment
    values: dict[str, Any] = {
        "footprint": footprint,
        "exposure_factor": 2.0 ** (environment.exposure + plan.pre_exposure),
        "world_from_env": environment.env_from_world().T,
    }
    if isinstance(environment, Procedural):
        return values | environment.arguments()
    if plan.size is not None and plan.layout is not None:
        _, height, width = plan.layout.shape(plan.size)
        picture = EnvironmentMap(plan.layout, np.empty((plan.layout.tiles, height, width, 0), np.float32))
    else:
        picture = contents.environment(environment)
    width, height = picture.size
    values["texels_per_radian"] = picture.texels_per_radian
    sizes = level_sizes(picture)
    corners = sheet_corners(picture.layout.tiles, sizes)
    places = [(*corner, *size) for corner, size in zip(corners, sizes)]
    values["level_place"] = np.array(places + places[-1:] * (MOST_LEVELS - len(places)), np.float64)
    values["last_level"] = len(sizes) - 1
    values["border"] = (*picture.scale, *picture.offset)
    below = getattr(environment, "below", None)
    if isinstance(below, tuple):
        values["below"] = tuple(value / 2.0**plan.pre_exposure for value in below)
    return values


def surface_uniforms(scene: Scene, plan: Plan, index: int, contents: Contents) -> dict[str, Any]:
    """Of surface.frag, all but the samplers and what the camera decides; more than a plan may use."""
    surface, how = scene.surfaces[index], plan.surfaces[index]
    origin, unit = contents.frame(surface.shape)
    matrix = world_from_object(surface, contents)
    # Of the lengths that `env_from_object` leaves; an orthogonal matrix leaves them all alike.
    world_unit = unit * float(np.abs(np.asarray(surface.transform.scale)).max())
    environment = plan.environments[how.environment]
    linear = environment.environment.env_from_world() @ matrix[:3, :3] / world_unit
    values: dict[str, Any] = {
        "env_from_object": linear,
        "picture_centre": (plan.size[0] / 2, plan.size[1] / 2),
    }
    if how.has("TRANSFORM") == GENERAL:
        normal = np.linalg.inv(linear).T
        values["env_from_object_normal"] = normal / np.abs(normal).max()
        values["env_from_object_gradient"] = normal
    match surface.shape:
        case Sphere(radius=radius):
            values["radius"] = radius / unit
        case Torus(radius=radius, tube=tube):
            values.update(radius=radius / unit, tube=tube / unit)
        case Quad(corners=corners):
            values["corners"] = (np.array([*corners], np.float64) - origin) / unit
    if how.has("PARALLAX"):
        values |= room_uniforms(environment.environment, matrix[:3, :3], matrix[:3, 3])
    if how.layers:
        values |= _layer_uniforms(how, contents, origin, unit, world_unit)
        values["bump_footprint"] = plan.footprint * LEVEL_WIDTH
    values |= _material_uniforms(surface.material) | _light_uniforms(how, environment, contents)
    return values | {"lobe_samples": plan.lobe_samples, "pixel_samples": plan.samples}


def _layer_uniforms(
    how: SurfacePlan, contents: Contents, origin: F64, unit: float, world_unit: float
) -> dict[str, Any]:
    """Of bump_input.glsl. origin, unit: of the surface's coordinates; world_unit: its unit in the world's."""
    bumps = [layer.bump for layer in how.layers]
    # The u,v of a mesh are counted in repeats already.
    per_mesh = mesh_repeat(how)
    counted = [np.full(2, unit) if layer.is_triplanar else np.divide(1, per_mesh) for layer in how.layers]
    slope_scale = [_slope_scale(layer, unit, world_unit) for layer in how.layers]
    values: dict[str, Sequence[npt.ArrayLike]] = {
        "repeat": [bump.map_repeat * per for bump, per in zip(bumps, counted)],
        "slope_scale": slope_scale,
        "height_scale": [getattr(bump, "amplitude", 0.0) / world_unit for bump in bumps],
        "code_range": [code_range(layer.most(contents)) for layer in how.layers],
        "spread_scale": [_spread_scale(s, layer, contents) for s, layer in zip(slope_scale, how.layers)],
    }
    if how.has("FLATS"):
        flats = [contents.flats(layer.bump, layer.kernel).moments for layer in how.layers]
        values["flat_moments"] = [m * moment_scale(s) for m, s in zip(flats, slope_scale)]
    for axis, name in enumerate(("origin_u", "origin_v")):
        values[name] = [_origin_in_repeats(layer, axis, origin) for layer in how.layers]
    return {name: _of_layers(rows) for name, rows in values.items()}


def _material_uniforms(material: Material) -> dict[str, Any]:
    """What a material makes of light: mirrored, scattered and let through."""
    f0 = f0_from_ior(material.ior)
    color, opaque, through = np.array(material.base_color), 1 - material.metallic, material.transmission
    return {
        "f0": tuple(opaque * f0 + material.metallic * color),
        "dielectric_f0": (float(f0),) * 3,
        "diffuse_color": tuple(opaque * (1 - through) * color),
        "transmitted_color": tuple(opaque * through * color),
        "base_color": material.base_color,
        "metallic": material.metallic,
        "ior": material.ior,
        "roughness": material.roughness,
    }


def _light_uniforms(how: SurfacePlan, plan: EnvironmentPlan, contents: Contents) -> dict[str, Any]:
    """Of what is made of an environment for a surface: irradiance, suns and the roughness chain."""
    values: dict[str, Any] = {}
    stored = 2.0**plan.pre_exposure
    if how.has("DIFFUSE") == DIFFUSES["sh9"]:
        values["sh"] = contents.irradiance(plan.environment, apart=plan.suns > 0) / stored
    if how.has("SUNS"):
        suns = contents.parted(plan.environment).suns
        values["sun_dir"] = np.array([sun.direction for sun in suns])
        values["sun_irradiance"] = np.array([sun.irradiance for sun in suns]) / stored
        values["sun_radius"] = np.array([sun.radius for sun in suns])
    if plan.gloss is not None:
        values["last_gloss_level"] = plan.gloss.last_level
    return values


def _seen_uniforms(scene: Scene, plan: Plan, index: int, still: Still) -> dict[str, Any]:
    """Of a surface's shaders, those that the camera's place decides."""
    surface, how, frame = scene.surfaces[index], plan.surfaces[index], still.frames[index]
    right, up, ahead = pixel_steps(scene.camera, plan.size)
    object_from_world, world_from_object = still.object_from_world[index], still.world_from_object[index]
    values: dict[str, Any] = {
        "eye_object": _eye(scene, surface, *frame),
        "pixel_x": tuple(object_from_world @ right),
        "pixel_y": tuple(object_from_world @ up),
        "depth_change": tuple(ahead @ world_from_object[:3, :3]),
    }
    if plan.log_depth:
        values["log_depth"] = _log_depth(*plan.near_far)
    if how.has("OUTLINE"):
        assert isinstance(surface.shape, Sphere)
        values["object_from_outline"] = outline_matrix(surface.shape.radius / frame[1], values["eye_object"])
    return values


def _of_layers(values: Sequence[npt.ArrayLike]) -> F64:
    """As many rows as bump_input.glsl has places for."""
    rows = np.array(values, np.float64)
    return np.concatenate([rows, np.zeros((MOST_BUMPS - len(rows), *rows.shape[1:]))])


def mesh_repeat(how: SurfacePlan) -> tuple[float, float]:
    """What the u,v of a surface's mesh are multiplied by: the repeat that all its bumps have, so that nothing is lost
    of large ones in 32 bits."""
    repeats = {layer.bump.map_repeat for layer in how.layers if not layer.is_triplanar}
    return repeats.pop() if how.has("SHAPE") == MESH and len(repeats) == 1 else (1.0, 1.0)


def _slope_scale(layer: Layer, unit: float, world_unit: float) -> F64:
    bump = layer.bump
    in_lengths = isinstance(bump, Bump) and bump.scaling == "world"
    return np.array(bump.slope_scale) * (unit if layer.is_triplanar else 1.0) / (world_unit if in_lengths else 1.0)


def _spread_scale(slope_scale: F64, layer: Layer, contents: Contents) -> F64:
    return moment_scale(slope_scale * (contents.steepest(layer.bump, layer.kernel) or 1.0))


def _origin_in_repeats(layer: Layer, axis: int, origin: F64) -> F64:
    """(3,) where a shape's coordinates count from, in repeats along u (axis 0) or v; whole ones are none."""
    repeats = origin * layer.bump.map_repeat[axis]
    return repeats if layer.ends else repeats - np.rint(repeats)


def room_uniforms(environment: Environment, world_from_object: F64, origin: F64) -> dict[str, Any]:
    """Of room.glsl, for points world_from_object (3, 3) @ p + origin (3,): relative to where the environment was taken,
    in its frame, in units of the room."""
    if not isinstance(environment, Pictured) or environment.bounds is None:
        return {}
    room, position = environment.bounds, np.asarray(environment.position)
    turn = environment.env_from_world()
    unit = float(np.ptp([room.low, room.high], axis=0).max()) if isinstance(room, BoxBounds) else room.radius
    place = turn @ (origin - position) / unit
    values = {
        "room_from_object": turn @ world_from_object / unit,
        "origin_room": tuple(place),
        "eye_room": tuple(place),
    }
    if isinstance(room, BoxBounds):
        # A box lies along the axes of the world, so nothing turns it.
        low, high = ((np.asarray(corner) - position) / unit for corner in (room.low, room.high))
        return values | {"low_room": tuple(low), "high_room": tuple(high)}
    return values | {"centre_room": tuple(turn @ (np.asarray(room.centre) - position) / unit), "radius_room": 1.0}


def _log_depth(near: float, far: float) -> tuple[float, float]:
    """Factor and summand that bring log2(1 / w) to a depth: 0 at `near`, 1 at `far`."""
    octaves = math.log2(far / near)
    return -1 / octaves, -math.log2(near) / octaves


def _eye(scene: Scene, surface: Surface, origin: F64, unit: float) -> tuple[float, ...]:
    """Where a surface has the eye: (x, y, z, 1), or (x, y, z, 0), the unit direction of an orthographic view."""
    if scene.camera.projection == "orthographic":
        ahead = surface.transform.inverse() @ -view_matrix(scene.camera)[2, :3]
        return (*(ahead / np.linalg.norm(ahead)), 0.0)
    return (*((surface.transform.to_object(scene.camera.eye) - origin) / unit), 1.0)
