"""GLSL functions called with arrays: every type, three ways to run, the same bits."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from glbump.errors import LimitError, ShaderError
from glbump.gl.context import Context
from glbump.glsltest import Glsl, Sampler, inputs
from glbump.glsltest import runners as runners_module
from glbump.glsltest.arguments import empty_results
from glbump.glsltest.wrapper import BACKENDS

TYPES = """
struct Part { float a; vec2 b[2]; };
struct Whole { vec3 p; float t[4]; mat2x3 m; Part q[2]; bool ok; uvec2 u; int i; };
Whole turn(Whole w) {
    Whole r = w;
    r.p = w.p.yxz; r.t[1] = 7.0; r.m = w.m * 2.0; r.q[1].b[0].y = 5.0; r.ok = !w.ok; r.u = w.u.yx; r.i = -w.i;
    return r;
}
vec3 times(mat3 m, vec3 v) { return m * v; }
vec2 wide(mat3x2 m, vec3 v) { return m * v; }
mat2x3 flat_matrix(vec3 a, vec3 b) { return mat2x3(a, b); }
float[3] back(float a[3]) { return float[3](a[2], a[1], a[0]); }
mat2 several(mat2 m[2], const in ivec2 i) { return m[i.x] * float(i.y); }
float outs(float x, out vec2 twice, inout ivec3 k, out bool big) {
    twice = vec2(x, x) * 2.0; k = -k; big = x > 1.0;
    return x + 1.0;
}
void only(in highp float x, out float y) { y = x * x; }
bool not_(bool b) { return !b; }
uint bits(float x) { return floatBitsToUint(x); }
float same(float x) { return x; }
float three() { return 3.0; }
"""
rng = np.random.default_rng(1)


@pytest.fixture(params=BACKENDS)
def backend(request: pytest.FixtureRequest, context: Context) -> str:
    if request.param == "compute" and context.gl.version_code < 430:
        pytest.skip("compute shaders need OpenGL 4.3")
    return str(request.param)


def test_matrices_are_row_column(glsl: Glsl, backend: str) -> None:
    """The products of NumPy's @; a transposed matrix fails on the second row already."""
    m, v = rng.normal(size=(5, 3, 3)), rng.normal(size=(5, 3))
    got = glsl(TYPES).times(m, v, backend=backend)
    np.testing.assert_allclose(got, (m @ v[..., None])[..., 0], rtol=1e-5, atol=1e-6)  # three products in float32
    assert np.abs(got - (np.swapaxes(m, 1, 2) @ v[..., None])[..., 0]).max() > 0.1
    w = rng.normal(size=(5, 2, 3))
    np.testing.assert_allclose(
        glsl(TYPES).wide(w, v, backend=backend), (w @ v[..., None])[..., 0], rtol=1e-5, atol=1e-6
    )
    a, b = v.astype(np.float32), v[::-1].astype(np.float32)
    assert np.array_equal(glsl(TYPES).flat_matrix(a, b, backend=backend), np.stack([a, b], -1))


def test_structs_arrays_and_their_nesting(glsl: Glsl, backend: str) -> None:
    whole = {
        "p": np.arange(6.0).reshape(2, 3),
        "t": np.zeros((2, 4)),
        "m": np.arange(6.0).reshape(3, 2),
        "q": {"a": np.array([1.0, 2.0]), "b": np.arange(16.0).reshape(2, 2, 2, 2)},
        "ok": np.array([True, False]),
        "u": np.array([1, 2]),
        "i": 4,
    }
    got = glsl(TYPES).turn(whole, backend=backend)
    assert np.array_equal(got["p"], [[1, 0, 2], [4, 3, 5]])
    assert np.array_equal(got["t"], [[0, 7, 0, 0]] * 2)
    assert np.array_equal(got["m"], [2 * np.arange(6.0).reshape(3, 2)] * 2)
    wanted = np.arange(16.0).reshape(2, 2, 2, 2)
    wanted[:, 1, 0, 1] = 5
    assert np.array_equal(got["q"]["b"], wanted)
    assert np.array_equal(got["q"]["a"], [[1, 2]] * 2)
    assert got["ok"].tolist() == [False, True]
    assert got["u"].tolist() == [[2, 1]] * 2
    assert got["u"].dtype == np.uint32
    assert got["i"].tolist() == [-4, -4]


def test_arrays_of_numbers_and_of_matrices(glsl: Glsl, backend: str) -> None:
    module = glsl(TYPES)
    assert module.back((1, 2, 3), backend=backend).tolist() == [3, 2, 1]
    m = rng.normal(size=(2, 2, 2)).astype(np.float32)
    got = module.several(m, np.array([[0, 2], [1, 3]]), backend=backend)
    assert np.array_equal(got, np.stack([m[0] * 2, m[1] * 3]))


def test_out_and_inout_follow_the_returned_value(glsl: Glsl, backend: str) -> None:
    value, twice, k, big = glsl(TYPES).outs([0.5, 2.0], (1, -2, 3), backend=backend)
    assert value.tolist() == [1.5, 3.0]
    assert twice.tolist() == [[1, 1], [4, 4]]
    assert k.tolist() == [[-1, 2, -3]] * 2
    assert big.tolist() == [False, True]
    assert glsl(TYPES).only(3.0, backend=backend) == 9.0


def test_bits_come_back_as_they_went(glsl: Glsl, backend: str) -> None:
    """NaN payloads, infinities, both zeros and denormals pass through, as bits and as values."""
    x = np.concatenate([inputs.floats(nonfinite=True), np.array([0x7F800001, 0xFFC12345], np.uint32).view(np.float32)])
    got = glsl(TYPES).bits(x, backend=backend)
    assert np.array_equal(got, x.view(np.uint32))
    same = glsl(TYPES).same(x, backend=backend).view(np.uint32)
    quiet = np.isnan(x)  # a driver may make a signalling NaN quiet when it moves it
    assert np.array_equal(same[~quiet], x.view(np.uint32)[~quiet])


def test_three_ways_give_the_same_bits(glsl: Glsl, context: Context) -> None:
    """20,000 rows of sines, roots, divisions and products, huge, tiny and infinite ones among them.

    Denormals aside: llvmpipe has them in compute shaders, and takes them for zero in all others.
    """
    text = "vec3 f(vec3 a, float b) { return sin(a) * sqrt(abs(b)) / (a.yzx + b) - inversesqrt(abs(a.zxy)) * b; }"
    a = rng.normal(size=(20_000, 3)).astype(np.float32)
    b = inputs.floats(nonfinite=True)
    b = np.resize(b[(b == 0) | ~(np.abs(b) < 2.0**-126)], 20_000)
    ways = [w for w in BACKENDS if w != "compute" or context.gl.version_code >= 430]
    first, *others = [glsl(text).f(a, b, backend=way) for way in ways]
    for other in others:
        assert np.array_equal(np.isnan(first), np.isnan(other))
        normal = ~np.isnan(first) & (np.maximum(np.abs(first), np.abs(other)) >= 2.0**-126)
        assert normal.mean() > 0.9
        assert np.array_equal(first.view(np.uint32)[normal], other.view(np.uint32)[normal])


def test_rows_broadcast_and_keep_their_shape(glsl: Glsl, backend: str) -> None:
    text = "float f(vec3 a, float b) { return dot(a, vec3(1.0, 10.0, 100.0)) + b; }"
    a = np.arange(12.0).reshape(2, 2, 3)
    got = glsl(text).f(a, np.array([[1000.0], [2000.0]]), backend=backend)
    assert np.array_equal(got, a @ [1, 10, 100] + np.array([[1000.0], [2000.0]]))
    assert glsl(text).f((1, 2, 3), 4.0, backend=backend) == 325.0
    assert glsl(text).f(np.zeros((0, 3)), 1.0, backend=backend).shape == (0,)
    assert glsl(TYPES).three(backend=backend) == 3.0
    assert np.array_equal(glsl(text).f(a[:, ::-1], 0.0, backend=backend), a[:, ::-1] @ [1, 10, 100])


def test_more_words_than_one_draw_gives_back(glsl: Glsl, backend: str) -> None:
    text = "float[100] f(float x) { float r[100]; for (int i = 0; i < 100; ++i) r[i] = x * float(i); return r; }"
    assert np.array_equal(glsl(text).f([1.0, 2.0, 3.0], backend=backend), np.outer([1, 2, 3], np.arange(100.0)))


def test_long_calls_go_in_parts(glsl: Glsl, backend: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(runners_module, "MOST_ROWS", 64)
    x = np.arange(1000.0)
    got = glsl("float f(float x, float y) { return x * 2.0 + y; } // parts").f(x, 1.0, backend=backend)
    assert np.array_equal(got, 2 * x + 1)


def test_screen_derivatives_in_quads(glsl: Glsl) -> None:
    """The last two axes of the rows are [y, x] in a quad, y up; another order gives other derivatives."""
    text = "vec2 slope_screen(float h) { return vec2(dFdx(h), dFdy(h)); } float plain(float h) { return h; }"
    h = np.array([[[0.0, 1.0], [5.0, 6.0]], [[0.0, -2.0], [3.0, 1.0]]])
    got = glsl(text).slope_screen(h)
    assert got.shape == (2, 2, 2, 2)
    assert np.array_equal(got[..., 0], [[[1, 1]] * 2, [[-2, -2]] * 2])
    assert np.array_equal(got[..., 1], [[[5, 5]] * 2, [[3, 3]] * 2])
    with pytest.raises(ShaderError, match=r"slope_screen.*rows of shape \(\.\.\., 2, 2\).*got \(4,\)"):
        glsl(text).slope_screen([1.0, 2.0, 3.0, 4.0])
    with pytest.raises(ShaderError, match="has none; use 'fragment'"):
        glsl(text).slope_screen(h, backend="feedback")
    assert glsl(text).plain(2.0, backend="feedback") == 2.0  # its neighbour does not keep it out of other stages


def test_samplers(glsl: Glsl, backend: str) -> None:
    """Row 0 at t = 0; filter and wrap; one, two, four channels; integers; 8 bits are 0..1."""
    module = glsl("vec4 f(sampler2D s, vec2 uv) { return textureLod(s, uv, 0.0); }")
    picture = np.array([[0.0, 1.0], [2.0, 3.0]], np.float32)
    centres = [[0.25, 0.25], [0.75, 0.25], [0.25, 0.75]]
    assert module.f(picture, centres, backend=backend)[:, 0].tolist() == [0, 1, 2]
    assert module.f(picture, (0.5, 0.5), backend=backend)[0] == 1.5
    assert module.f(picture, (1.25, 0.25), backend=backend)[0] == 0
    assert module.f(picture, (1.25, 0.25), wrap="clamp", backend=backend)[0] == 1
    assert module.f(picture, (1.25, 1.25), wrap=("clamp", "repeat"), backend=backend)[0] == 1
    assert module.f(Sampler(picture, filter="nearest"), (0.4, 0.6), backend=backend)[0] == 2
    eight = np.full((3, 5, 2), 255, np.uint8)
    assert module.f(eight, (0.5, 0.5), backend=backend).tolist() == [1, 1, 0, 1]
    whole = glsl("ivec4 g(isampler2D s, ivec2 at) { return texelFetch(s, at, 0); }")
    assert whole.g(np.array([[1, -2], [3, 4]]), (1, 0), filter="nearest", backend=backend)[0] == -2


def test_levels_cubes_and_arrays(glsl: Glsl, backend: str) -> None:
    lod = glsl("float f(sampler2D s, vec2 uv, float level) { return textureLod(s, uv, level).r; }")
    chain = [np.full((4, 8), 1.0), np.full((2, 4), 10.0), np.full((1, 2), 100.0)]
    got = lod.f([c.astype(np.float32) for c in chain], (0.5, 0.5), [0.0, 1.0, 2.0], filter="trilinear", backend=backend)
    assert got.tolist() == [1, 10, 100]
    made = lod.f(np.arange(4.0).reshape(2, 2), (0.5, 0.5), 1.0, filter="trilinear", levels="all", backend=backend)
    assert made == 1.5
    cube = glsl("float f(samplerCube s, vec3 d, float level) { return textureLod(s, d, level).r; }")
    faces = np.arange(6.0)[:, None, None] * np.ones((6, 4, 4))
    assert np.array_equal(cube.f(faces, inputs.axes(), 0.0, backend=backend), np.arange(6.0))
    own = [np.full((6, n, n, 3), float(n), np.float32) for n in (4, 2)]
    assert cube.f(own, (0, 0, 1), [0.0, 1.0], filter="trilinear", backend=backend).tolist() == [4, 2]
    layers = glsl("float f(sampler2DArray s, vec3 uv) { return texture(s, uv).r; }")
    assert layers.f(np.arange(3.0)[:, None, None] * np.ones((3, 2, 2)), (0.5, 0.5, 2.0), backend=backend) == 2


def test_implicit_levels_need_quads(glsl: Glsl) -> None:
    """texture() with levels reads what derivatives choose: 2 texels a pixel is level 1."""
    module = glsl("float f(sampler2D s, vec2 uv) { return texture(s, uv).r; }")
    chain = [np.full((8 >> i, 8 >> i), float(i), np.float32) for i in range(4)]
    step = 2 / 8
    uv = 0.5 + step * np.stack(np.meshgrid([0, 1], [0, 1]), -1)
    # llvmpipe's level is 0.043 low at most: fast log2, fewer bits.
    np.testing.assert_allclose(module.f(chain, uv, filter="trilinear"), 1.0, atol=0.05)
    with pytest.raises(ShaderError, match="takes screen derivatives"):
        module.f(chain, (0.5, 0.5), filter="trilinear")
    assert module.f(chain, (0.5, 0.5)) == 0


def test_defines_constants_uniforms(glsl: Glsl) -> None:
    text = """
    #ifndef GAIN
    #define GAIN 2.0
    #endif
    const int N = 2, M = N + 1;
    const float PI = 3.0;
    uniform vec3 shift;
    uniform mat2x3 m;
    float f(float x) { return x * GAIN * PI + shift.y; }
    float sum(float a[M]) { float s = 0.0; for (int i = 0; i < M; ++i) s += a[i]; return s; }
    vec3 g(vec2 v) { return m * v; }
    """
    assert glsl(text).f(1.0) == 6.0
    assert glsl(text, defines={"GAIN": 5.0}, constants={"PI": 4}).f(1.0) == 20.0
    assert glsl(text, uniforms={"shift": (1, 100, 2)}).f(1.0) == 106.0
    assert glsl(text).f(1.0) == 6.0  # the other values stayed where they were given
    assert glsl(text).sum((1, 2, 3)) == 6.0
    m = np.arange(6.0).reshape(3, 2)
    assert np.array_equal(glsl(text, uniforms={"m": m}).g((1, 2)), m @ [1, 2])
    for bad in ({"constants": {"PIE": 3}}, {"uniforms": {"shaft": 1}}):
        with pytest.raises(ShaderError, match=r"did you mean '(PI|shift)'"):
            glsl(text, **bad)


def test_overloads(glsl: Glsl) -> None:
    text = """
    float f(float x) { return x; }  vec2 f(vec2 x) { return 10.0 * x; }  int f(int x) { return 2 * x; }
    float g(vec3 a) { return 1.0; }  float g(ivec3 a) { return 2.0; }
    float h(mat2 m) { return 1.0; }  float h(vec2 v[2]) { return 2.0; }
    """
    module = glsl(text)
    assert module.f([1.0, 2.0, 3.0]).tolist() == [1, 2, 3]
    assert module.f((1.0, 2.0)).tolist() == [10, 20]
    assert module["f(float)"]((1.0, 2.0)).tolist() == [1, 2]
    assert module.f(3) == 6
    assert module.g((1.0, 2.0, 3.0)) == 1
    assert module.g((1, 2, 3)) == 2
    with pytest.raises(ShaderError, match=r"several overloads fit; choose module\['h\(mat2\)'\] or"):
        module.h(np.eye(2))
    with pytest.raises(ShaderError, match=r"no overload fits: float f\(float x\): x is float"):
        module.f("a")


def test_a_whole_shader_with_main_inputs_and_version(glsl: Glsl, backend: str) -> None:
    text = """#version 330
    in vec3 normal; layout(location = 1) flat in int kind;
    out vec4 colour; uniform sampler2D picture;
    float lambert(vec3 n, vec3 l) { return max(dot(n, l), 0.0); }
    void main() { colour = vec4(lambert(normal, vec3(0, 0, 1))) * texture(picture, normal.xy); if (kind > 0) discard; }
    """
    assert glsl(text).lambert((0, 0, 1), (0, 0.6, 0.8), backend=backend) == np.float32(0.8)


def test_names_that_the_wrapper_might_use(glsl: Glsl, backend: str) -> None:
    """Functions, macros and globals called like the wrapper's own, or like what it reads with."""
    text = """
    float gbt_call(float gbt_row) { return gbt_row + 1.0; }  float r(float x) { return x; }
    float gbt1_put(float x) { return x; } float i, row, data;
    #define x 3
    #define a0 nonsense
    vec4 word(vec4 v) { return v; }
    """
    assert glsl(text).gbt_call([1.0, 2.0], backend=backend).tolist() == [2, 3]
    assert glsl(text).word((1, 2, 3, 4), backend=backend).tolist() == [1, 2, 3, 4]


def test_includes_and_files(glsl: Glsl, tmp_path: Any) -> None:
    (tmp_path / "a.glsl").write_text("float a(float x) { return x + 1.0; }\n")
    (tmp_path / "b.glsl").write_text(
        '#include "a.glsl"\n#include "lib/reflect.glsl"\nfloat b(float x) { return a(a(x)); }\n'
    )
    module = glsl(tmp_path / "b.glsl")
    assert module.b(1.0) == 3.0
    assert module.f0_from_ior(1.0) == 0.0
    assert glsl('#include "a.glsl"\n', folders=[tmp_path]).a(1.0) == 2.0


def test_doubles(glsl: Glsl, context: Context) -> None:
    if context.gl.version_code < 420:
        pytest.skip("doubles need OpenGL 4.0")
    text = "#version 420\ndvec2 f(dvec2 x) { return x / 3.0LF; }"
    x = np.array([1.0, 1e300])
    assert np.array_equal(glsl(text).f(x), x / 3)


def test_two_contexts(glsl: Glsl) -> None:
    text = "float f(float x) { return x * 3.0; } // two contexts"
    with Glsl() as other:
        assert other.load(text).f(2.0) == 6.0
        assert glsl(text).f(2.0) == 6.0
        assert other.load(text).f(3.0) == 9.0
    assert glsl(text).f(3.0) == 9.0


def test_one_after_the_other_in_one_context(context: Context) -> None:
    """Targets are given back with nothing of them bound: moderngl binds what was bound last again."""
    for way in ("feedback", "fragment", "fragment"):
        with Glsl(context, backend=way) as made:
            assert made.load("float f(float x) { return x; }").f(2.0) == 2.0


def test_a_moderngl_context_of_the_callers(context: Context) -> None:
    with Glsl(context.gl) as made:
        assert made.load("float f(float x) { return x; }").f(2.0) == 2.0


def test_what_no_memory_holds(glsl: Glsl) -> None:
    """10^10 rows over four floats in memory: refused before the memory is asked for, going in and coming out."""
    four = np.lib.stride_tricks.as_strided(np.zeros(4, np.float32), (10**10, 4), (0, 4))
    with pytest.raises(LimitError, match=r"so many rows take 149\.0 GiB"):
        glsl("vec4 f(vec4 y) { return y; }").f(four)
    with pytest.raises(LimitError, match=r"so many rows give back 596\.0 GiB"):
        empty_results(glsl("mat4 f(float x) { return mat4(x); }").f.overloads[0].plan, 10**10)


def test_an_out_parameter_left_alone_is_no_failure(glsl: Glsl, backend: str) -> None:
    """Its value is undefined; the call is not."""
    assert glsl("float f(float x, out float y) { return x; }").f([1.0, 2.0], backend=backend)[0].tolist() == [1, 2]


def test_a_driver_that_runs_nothing_is_noticed(glsl: Glsl, monkeypatch: pytest.MonkeyPatch) -> None:
    """Else the results of the call before would pass for those of this one."""
    f = glsl("float f(float x) { return x + 0.5; }").f
    assert f(1.0, backend="compute") == 1.5
    assert f(1.0, backend="compute") == 1.5
    runner = f.overloads[0]._programs["compute"].runner
    real = runner.program
    monkeypatch.setattr(
        runner, "program", type("Idle", (), {"run": lambda *_: None, "__contains__": lambda *_: False})()
    )
    with pytest.raises(ShaderError, match="ran nothing, and reported no error"):
        f(1.0, backend="compute")
    monkeypatch.setattr(runner, "program", real)
    assert f(1.0, backend="compute") == 1.5


def test_calls_like_the_last_one_see_their_own_numbers(glsl: Glsl) -> None:
    """The short way of small calls: same shapes and types. Others take the long way, and come back."""
    text = """
    vec2 f(vec3 a, float b, out bool big) { big = b > 1.0; return a.xy * b; }
    float one(float x) { return -x; }
    bool turned(bool b) { return !b; }
    """
    module = glsl(text)
    for _ in range(3):
        for shape in ((5,), (5,), (7,), (2, 3), ()):
            a = rng.normal(size=(*shape, 3)).astype(np.float32)
            b = rng.normal(size=shape).astype(np.float32) if shape else np.float32(2).reshape(())
            value, big = module.f(a, b, backend="compute")
            again, _ = module.f(a[..., ::-1], b, backend="compute")  # not contiguous
            assert np.array_equal(value, a[..., :2] * np.asarray(b)[..., None])
            assert np.array_equal(again, a[..., :0:-1] * np.asarray(b)[..., None])
            assert np.array_equal(big, b > 1)
            shared, _ = module.f(a, np.float32(3).reshape(()), backend="compute")
            assert np.array_equal(shared, a[..., :2] * np.float32(3))
    kept = [module.one(np.float32([i])) for i in range(4)]
    assert [float(k[0]) for k in kept] == [0, -1, -2, -3]  # each call its own array
    for flag in (True, False, True):
        assert module.turned(np.array([flag])).tolist() == [not flag]
    assert module.one([1, 2]).tolist() == [-1, -2]
    assert module.one(np.float64([1, 2])).tolist() == [-1, -2]


def test_functions_with_derivatives_run_whatever_way_is_preferred(context: Context) -> None:
    """--glsl-backend is for what can run in any way; only a call that names another way is refused."""
    for way in BACKENDS:
        with Glsl(context, backend=way) as made:
            f = made.load("float f_screen(float x) { return dFdx(x); }").f_screen
            assert f([[1.0, 3.0], [1.0, 3.0]]).tolist() == [[2, 2], [2, 2]]
