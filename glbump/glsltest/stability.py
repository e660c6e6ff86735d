"""Where formulas break: what one would write first, what glbump does, and what is left of the error, measured here.

Each case is one of the extremes that numbers meet in environment and bump mapping; `measure` runs them on the
driver at hand.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from glbump.gl.context import Context
from glbump.gl.stability import Row
from glbump.glsltest import inputs
from glbump.glsltest.glsl import Glsl
from glbump.glsltest.samplers import Sampler
from glbump.reference import bump, environment, filter, ggx, mapping, reflect

F64 = npt.NDArray[np.float64]
Rows = tuple[Any, ...]
EPS = 2.0**-24
ATAN = 3.5e-6  # rad; the coarsest atan that was measured, Mesa's


@dataclass(frozen=True)
class Extreme:
    """One case. naive and used are GLSL with a function `f`; used is glbump's own where it has one.

    rows: the arguments of `used`; naive_rows: those of `naive` where they differ. truth: float64 answers from the
    arguments of `used`. bound: the largest error of `used`, in `unit`. fails: whether naive must miss the bound on
    every driver, by the arithmetic of float32 alone.
    """

    name: str
    naive: str
    used: str
    rows: Callable[[], Rows]
    truth: Callable[..., npt.ArrayLike]
    bound: float
    unit: str
    naive_rows: Callable[[], Rows] | None = None
    relative: bool = False
    fails: bool = True


def report(context: Context) -> list[Row]:
    """All cases on one context: what `glbump doctor --stability` prints."""
    with Glsl(context) as glsl:
        return [measure(glsl, extreme) for extreme in EXTREMES]


def measure(glsl: Glsl, extreme: Extreme) -> Row:
    """One case on one driver; infinite where NaN or an infinity came out of finite rows."""
    rows = tuple(_seen(a) for a in extreme.rows())
    want = np.asarray(extreme.truth(*rows), np.float64)
    naive_rows = extreme.naive_rows() if extreme.naive_rows else rows
    naive = glsl.load(text=extreme.naive).f(*(_seen(a) for a in naive_rows))
    used = glsl.load(text=extreme.used).f(*rows)
    missed, left = (_error(got, want, extreme.relative) for got in (naive, used))
    return Row(extreme.name, missed, left, extreme.bound, extreme.unit)


def _seen(argument: Any) -> Any:
    """What the shader sees: float32."""
    if isinstance(argument, Sampler) or np.asarray(argument).dtype.kind != "f":
        return argument
    return np.asarray(argument, np.float32)


def _error(got: Any, want: F64, relative: bool) -> float:
    value = np.asarray(got, np.float64)
    with np.errstate(invalid="ignore"):
        off = np.abs(value - want)
    if relative:
        off = off / np.abs(want)
    return float(np.where(np.isfinite(off), off, np.inf).max())


# ---- rows


def _cube_rows() -> Rows:
    """A cube whose texels say which they are; directions of 1e-38 to 3e38 through the middle parts of texels."""
    texels = Sampler(np.arange(6 * 16.0).reshape(6, 4, 4), filter="nearest")
    face, place, length = (a.astype(int) for a in inputs.every(np.arange(6), np.arange(16), np.arange(5)))
    st = (np.stack([place % 4, place // 4], -1) + 0.5) / 4
    return texels, environment.cube_dir(face, st) * np.array([1e-38, 1e-30, 1.0, 1e30, 3e38])[length, None]


def _any_length() -> Rows:
    made = inputs.unit_vectors(2000)
    return (made * inputs.log_uniform(2000, 1e-37, 1e37, (1,)),)


def _unit(v: npt.ArrayLike) -> F64:
    a = np.asarray(v, np.float64)
    made: F64 = a / np.linalg.norm(a, axis=-1, keepdims=True)
    return made


def _steep() -> Rows:
    return (inputs.log_uniform(2000, 1.0, 1e37),)


def _no_area() -> Rows:
    """dp/du of no length, of too little, and along dp/dv."""
    up, x = np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0])
    n = np.resize(up, (4, 3))
    return n, np.array([0 * x, 1e-30 * x, x, x]), np.array([x, x, x, 0 * x]), np.full((4, 2), 0.5)


def _mirrored() -> Rows:
    n = np.resize([0.0, 0.0, 1.0], (100, 3))
    u = inputs.unit_vectors(100) * [1, 1, 0]
    v = np.cross(u, n)  # the other way round: cross(n, u) is what is not mirrored
    return n, u, v, inputs.uniform(100, -1, 1, (2,))


def _near_poles() -> Rows:
    angle = np.concatenate([[0.0], inputs.log_uniform(500, 1e-7, 1e-1)])
    turn = inputs.uniform(501, 0, 6.28)
    flat = np.sin(angle.astype(float))
    made = np.stack([flat * np.cos(turn), np.cos(angle.astype(float)), flat * np.sin(turn)], -1)
    return (np.concatenate([made, made * [1, -1, 1]]),)


def _sun_lobe() -> Rows:
    """SH9 of a light from one direction, as a share of its irradiance there."""
    sh = np.zeros((9, 3))
    sh[0], sh[2], sh[6] = 1 / 4, 1 / 2, 5 / 32
    return inputs.unit_vectors(2000), sh


def _sun_truth(n: Any, sh: Any) -> F64:
    z = np.asarray(n, np.float64)[:, 2:]
    return np.repeat(np.maximum(1 / 4 + z / 2 + 5 / 32 * (3 * z * z - 1), 0), 3, axis=-1)


def _sun(dtype: npt.DTypeLike) -> Rows:
    """A sun of 1e9 in a picture of ones, looked up beside it and between."""
    with np.errstate(over="ignore"):
        picture = np.array([[1.0, 1e9, 1.0, 1.0]]).astype(dtype)
    return Sampler(picture), np.array([[2.5 / 4, 0.5], [1.25 / 4, 0.5], [3.5 / 4, 0.5]])


def _through_a_sphere(distance: float) -> Rows:
    """Rays from `distance` radii away that meet the unit sphere well inside its outline."""
    ahead = inputs.unit_vectors(1000)
    n = inputs.unit_vectors(1000, 1).astype(np.float64)
    n -= (np.einsum("ni,ni->n", n, ahead) + 0.8)[:, None] * ahead  # towards the eye
    p = _unit(n)
    return (p - distance * ahead.astype(np.float64)).astype(np.float32), ahead, np.float32(1.0)


def _near_the_sphere() -> Rows:
    start, ahead, radius = _through_a_sphere(1e4)
    near = start.astype(np.float64) + (1e4 - 0.01) * ahead.astype(np.float64)
    return near.astype(np.float32), ahead, radius


def _parallelograms() -> Rows:
    a = inputs.uniform(200, -1, 1, (3,), 1)
    u, v = inputs.unit_vectors(200, 2), inputs.unit_vectors(200, 3)
    p = a + 0.25 * u + 0.75 * v
    return p, a, a + u, (a + u) + v, a + v


def _depths() -> Rows:
    return inputs.uniform(1000, 0.9, 1.1), np.float32(0.89), np.float32(1.12)


def _far_away() -> F64:
    return np.array([1e7, -1e7, 1e7]) + inputs.uniform(1000, -1, 1, (3,)).astype(np.float64)


def _relative() -> Rows:
    return (_far_away() - [1e7, -1e7, 1e7],)


_INCLUDE = '#include "lib/{0}.glsl"\n'
_DEPTH = """
float f(float z, float near, float far) {
    float depth = far / (far - near) * (1.0 - near / z);
    float kept = floor(depth * 16777215.0 + 0.5) / 16777215.0;
    return near * far / (far - kept * (far - near));
}"""

EXTREMES: tuple[Extreme, ...] = (
    Extreme(
        "cube direction 1e-38 to 3e38",
        "float f(samplerCube s, vec3 d) { return textureLod(s, d, 0.0).r; }",
        _INCLUDE.format("environment")
        + "float f(samplerCube s, vec3 d) { return textureLod(s, cube_border_dir(d, 1.0), 0.0).r; }",
        _cube_rows,
        lambda s, d: np.repeat(np.arange(6 * 16.0), 5),
        0.0,
        "texels",
        fails=False,  # hardware may take any length; llvmpipe does not
    ),
    Extreme(
        "normalise 1e-37 to 1e37",
        "vec3 f(vec3 v) { return normalize(v); }",
        _INCLUDE.format("bump") + "vec3 f(vec3 v) { return bump_normal(v, vec3(0.0)); }",
        _any_length,
        _unit,
        6 * EPS,
        "of unit length",
    ),
    Extreme(
        "slope to 1e37",
        "vec3 f(float s) { return normalize(vec3(-s, 0.0, 1.0)); }",
        _INCLUDE.format("bump") + "vec3 f(float s) { return bump_normal(vec3(0.0, 0.0, 1.0), vec3(s, 0.0, 0.0)); }",
        _steep,
        lambda s: _unit(np.stack([-s.astype(np.float64), 0 * s, np.ones_like(s, np.float64)], -1)),
        6 * EPS,
        "of unit length",
    ),
    Extreme(
        "u, v without area",
        "vec3 f(vec3 n, vec3 u, vec3 v, vec2 s) {"
        " return (s.x * cross(v, n) + s.y * cross(n, u)) / dot(n, cross(u, v)); }",
        _INCLUDE.format("bump") + "vec3 f(vec3 n, vec3 u, vec3 v, vec2 s) { return surface_gradient(n, u, v, s); }",
        _no_area,
        bump.surface_gradient,
        0.0,
        "of slope",
    ),
    Extreme(
        "mirrored u, v",
        "vec3 f(vec3 n, vec3 u, vec3 v, vec2 s) {"
        " return (s.x * cross(v, n) + s.y * cross(n, u)) / length(cross(u, v)); }",
        _INCLUDE.format("bump") + "vec3 f(vec3 n, vec3 u, vec3 v, vec2 s) { return surface_gradient(n, u, v, s); }",
        _mirrored,
        bump.surface_gradient,
        2.0**-12,
        "of slope",
    ),
    Extreme(
        "lat-long pole, v",
        "float f(vec3 d) { return acos(clamp(d.y, -1.0, 1.0)) / 3.14159265; }",
        _INCLUDE.format("environment") + "float f(vec3 d) { return latlong_uv(d).y; }",
        _near_poles,
        lambda d: environment.latlong_uv(d)[..., 1],
        ATAN / np.pi + 2 * EPS,
        "of v",
    ),
    Extreme(
        "lat-long pole, u",
        "float f(vec3 d) { return 0.5 + atan(d.x, -d.z) / 6.2831853; }",
        _INCLUDE.format("environment") + "float f(vec3 d) { return latlong_uv(d).x; }",
        lambda: (inputs.poles(),),
        lambda d: environment.latlong_uv(d)[..., 0],
        0.0,
        "of u",
        fails=False,  # GLSL leaves atan(0, 0) to the driver
    ),
    Extreme(
        "lat-long seam, footprint",
        "float f(vec2 a, vec2 b) { vec2 d = (b - a) * 1024.0; return 0.5 * log2(dot(d, d)); }",
        _INCLUDE.format("filter")
        + "float f(vec2 a, vec2 b) { return isotropic_level(wrapped_difference(b - a) * 1024.0, vec2(0.0)); }",
        lambda: (np.array([[0.9995, 0.5]]), np.array([[0.0005, 0.5]])),
        lambda a, b: [np.log2(1024 * (float(b[0, 0]) - float(a[0, 0]) + 1))],
        1e-4,
        "levels",
    ),
    Extreme(
        "no footprint",
        "float f(vec2 d) { return 0.5 * log2(dot(d, d)); }",
        _INCLUDE.format("filter") + "float f(vec2 d) { return isotropic_level(d, d); }",
        lambda: (np.zeros((1, 2)),),
        lambda d: filter.isotropic_level(d, d),
        0.0,
        "levels",
    ),
    Extreme(
        "a sun in SH9",
        "vec3 f(vec3 n, vec3 sh[9]) { return sh[0] + sh[2] * n.z + sh[6] * (3.0 * n.z * n.z - 1.0); }",
        _INCLUDE.format("environment") + "vec3 f(vec3 n, vec3 sh[9]) { return sh9_irradiance(n, sh); }",
        _sun_lobe,
        _sun_truth,
        8 * EPS,
        "of its irradiance",
    ),
    Extreme(
        "a sun of 1e9, stored",
        "float f(sampler2D s, vec2 uv) { return textureLod(s, uv, 0.0).r; }",
        "float f(sampler2D s, vec2 uv) { return textureLod(s, uv, 0.0).r; }",
        lambda: _sun(np.float32),
        lambda s, uv: [1.0, (0.25 * 1.0 + 0.75 * 1e9), 1.0],
        2.0**-8,  # of the weight: hardware has 8 bits
        "relative",
        naive_rows=lambda: _sun(np.float16),
        relative=True,
    ),
    Extreme(
        "cosine past 1 in Schlick's Fresnel",
        "vec3 f(vec3 f0, float c) { return f0 + (1.0 - f0) * pow(1.0 - c, 5.0); }",
        _INCLUDE.format("reflect") + "vec3 f(vec3 f0, float c) { return fresnel_schlick(f0, c); }",
        lambda: (np.full((3, 3), 0.04), np.array([1.0 + 2.0**-23, 1.0001, 1.0])),
        reflect.fresnel_schlick,
        12 * EPS,
        "of the light",
        fails=False,  # pow of a negative base is the driver's
    ),
    Extreme(
        "a normal turned away, glossy",
        _INCLUDE.format("ggx") + "vec3 f(vec3 f0, float c, float r) { vec4 s = r * vec4(-1.0, -0.0275, -0.572, 0.022)"
        " + vec4(1.0, 0.0425, 1.04, -0.04); float a = min(s.x * s.x, exp2(-9.28 * c)) * s.x + s.y;"
        " vec2 d = vec2(-1.04, 1.04) * a + s.zw;"
        " return (f0 * d.x + d.y) / (d.x + d.y); }",
        _INCLUDE.format("ggx") + "vec3 f(vec3 f0, float c, float r) { return glossy_share(f0, dfg_fit(c, r)); }",
        lambda: (np.full((5, 3), 0.04), np.array([-1, -0.5, 0, 1e-6, 1]), np.array([0, 0.3, 1, 0, 1])),
        lambda f0, c, r: ggx.glossy_share(f0, ggx.dfg_fit(c, r)),
        2 * 16 / 0.3 * EPS,
        "of the light",
    ),
    Extreme(
        "sphere from 1e4 radii away",
        _INCLUDE.format("mapping") + "vec3 f(vec3 o, vec3 d, float r) {"
        " float b = dot(o, d), c = dot(o, o) - r * r; return o + (-b - sqrt(max(b * b - c, 0.0))) * d; }",
        _INCLUDE.format("mapping") + "vec3 f(vec3 p, vec3 d, float r) { return p + sphere_step(p, d, r) * d; }",
        _near_the_sphere,
        lambda p, d, r: p.astype(np.float64) + mapping.sphere_step(p, d, r)[:, None] * d.astype(np.float64),
        16 * EPS,
        "radii",
        naive_rows=lambda: _through_a_sphere(1e4),
    ),
    Extreme(
        "a quad that is a parallelogram",
        """
        vec2 f(vec3 p, vec3 a, vec3 b, vec3 c, vec3 d) {
            vec3 e = b - a, g = (a - b) + (c - d), h = a - p, s = d - a, n = cross(c - a, d - b);
            float k2 = dot(n, cross(g, s)), k1 = dot(n, cross(e, s)) + dot(n, cross(g, h)), k0 = dot(n, cross(e, h));
            float v = (-k1 + sqrt(k1 * k1 - 4.0 * k2 * k0)) / (2.0 * k2);
            return vec2(-dot(h + v * s, e + v * g) / dot(e + v * g, e + v * g), v);
        }""",
        _INCLUDE.format("mapping")
        + "vec2 f(vec3 p, vec3 a, vec3 b, vec3 c, vec3 d) { return inverse_bilinear(p, a, b, c, d); }",
        _parallelograms,
        mapping.inverse_bilinear,
        2.0**-10,  # slivers of some degrees among them
        "of u, v",
    ),
    Extreme(
        "a triangle without area",
        "vec3 f(vec3 p, vec3 a, vec3 b, vec3 c) { vec3 n = cross(b - a, c - a); float k = dot(n, n);"
        " return vec3(0.0, dot(n, cross(p - a, c - a)) / k, dot(n, cross(b - a, p - a)) / k); }",
        _INCLUDE.format("mapping") + "vec3 f(vec3 p, vec3 a, vec3 b, vec3 c) { return barycentric(p, a, b, c); }",
        lambda: (np.ones((1, 3)), np.ones((1, 3)), np.ones((1, 3)), np.zeros((1, 3))),
        mapping.barycentric,
        0.0,
        "of weight",
    ),
    Extreme(
        "near 1e-6, far 1e9 in 24 bits of depth",
        _DEPTH,
        _DEPTH,
        _depths,
        lambda z, near, far: z,
        1e-5,  # the near and far planes that camera.near_far derives from the scene
        "relative",
        naive_rows=lambda: (_depths()[0], np.float32(1e-6), np.float32(1e9)),
        relative=True,
    ),
    Extreme(
        "coordinates of 1e7",
        "vec3 f(vec3 p) { return p - vec3(1e7, -1e7, 1e7); }",
        "vec3 f(vec3 p_from_eye) { return p_from_eye; }",
        _relative,
        lambda p: _far_away() - [1e7, -1e7, 1e7],
        EPS,
        "of unit length",
        naive_rows=lambda: (_far_away(),),
    ),
)
