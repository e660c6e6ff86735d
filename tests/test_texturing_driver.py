"""This driver's look-ups against what OpenGL allows, faults that the doctor must see, and level-coded environments."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from glbump.contents import Contents
from glbump.environment import CubeMap, HemiCube, Hemisphere, LatLong, Octahedral
from glbump.gl import texturing as driver
from glbump.gl.context import Context
from glbump.gl.levels import cube_texture
from glbump.gl.program import build_program
from glbump.gl.source import resolve
from glbump.gl.textures import Store
from glbump.gl.uniforms import Uniforms, environment_uniforms
from glbump.glsltest import inputs
from glbump.maps.layout import LAYOUTS, EnvironmentMap, Layout, sample
from glbump.maps.pyramid import chain
from glbump.plan import EnvironmentPlan, make_plan
from glbump.quality import Quality
from glbump.reference.filter import through_levels
from glbump.reference.texturing.look_up import Filter
from glbump.scene import Scene

F64 = npt.NDArray[np.float64]


# ---- this driver


@pytest.fixture(scope="module")
def verdicts(context: Context) -> dict[str, dict[str, Any]]:
    """What the doctor says of look-ups."""
    return {found["name"]: found for found in driver.texturing(context)["verdicts"]}


def test_what_glbump_draws_with_is_inside(verdicts: dict[str, dict[str, Any]]) -> None:
    """On any driver: neither anisotropy nor textureQueryLod is used."""
    unused = [name for name in verdicts if "anisotropy" in name or "QueryLod" in name]
    wrong = [name for name, found in verdicts.items() if found["grade"] == "outside"]
    assert set(wrong) <= set(unused)
    assert len(verdicts) >= 16
    assert all(found["looks"] > 100 for found in verdicts.values())


def test_what_is_known_of_llvmpipe(context: Context, verdicts: dict[str, dict[str, Any]]) -> None:
    if "llvmpipe" not in context.info["renderer"]:
        pytest.skip(f"figures are known for llvmpipe; this is {context.info['renderer']}")
    # The logarithm by straight lines: never above, at most 0.043 below, which is the lower precision's.
    for name in ("2d level of detail", "cube level of detail"):
        assert verdicts[name]["least"] == pytest.approx(-0.043, abs=1e-3)
        assert verdicts[name]["most"] < 1e-5
        assert verdicts[name]["grade"] == "low"
    # Eight bits of weight in flat rgba8, exact in all else.
    # After each of the two mixtures of texels one step at most.
    assert 0.5 / 256 < verdicts["2d rgba8 enlarged"]["most"] <= 2 / 255
    for name in ("2d half", "2d float", "cube rgba8", "cube half", "cube float"):
        assert max(abs(verdicts[f"{name} enlarged"][end]) for end in ("least", "most")) < 1e-5
    # The limit of anisotropy is ignored, and levels of cubes are told wrongly.
    assert verdicts["2d level of detail, anisotropy 2"]["least"] < -1
    assert verdicts["cube textureQueryLod"]["grade"] == "outside"
    assert verdicts["cube textureQueryLod"]["most"] > 1


def judged(context: Context, probes: Callable[[Context], Iterator[driver.Verdict]]) -> dict[str, str]:
    return {verdict.name: verdict.grade for verdict in probes(context)}


def test_faults_of_cubes_are_seen(context: Context, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of the driver, or of what it is given."""
    context.gl.disable_direct(0x884F)  # GL_TEXTURE_CUBE_MAP_SEAMLESS
    try:
        assert judged(context, driver._cubes)["cube half enlarged"] == "outside", "a seam"
    finally:
        context.gl.enable_direct(0x884F)

    def swapped(context: Context, levels: list[Any], dtype: str) -> Any:
        return cube_texture(context, [level[[0, 1, 2, 3, 5, 4]] for level in levels], dtype)

    monkeypatch.setattr(driver, "cube_texture", swapped)
    found = judged(context, driver._cubes)
    assert found["cube half enlarged"] == found["cube float trilinear"] == "outside", "two faces swapped"


def test_faults_of_flat_textures_are_seen(context: Context, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of places, levels and filters."""
    for moved, names in {
        "at.x += 0.5 / 20;\n": ("2d half enlarged", "2d float trilinear"),
        "at *= 1.2;\n": ("2d level of detail",),  # log2(1.2) = 0.26 of a level
    }.items():
        with monkeypatch.context() as patch:
            patch.setattr(driver, "_MAPPED", driver._MAPPED + moved)
            found = judged(context, driver._flat)
        assert all(found[name] == "outside" for name in names)
    monkeypatch.setitem(driver._WAYS, "trilinear", (Filter(), driver._WAYS["nearest level"][1]))
    found = judged(context, driver._flat)
    assert found["2d half trilinear"] == found["2d rgba8 trilinear"] == "outside", "levels that are not mixed"


def test_nothing_is_left_behind(context: Context) -> None:
    before = context.live_objects()
    found = driver.texturing(context)
    assert context.live_objects() == before
    right = sum(verdict["grade"] != "outside" for verdict in found["verdicts"])
    assert found["meaning"].startswith(f"{right} of {len(found['verdicts'])} look-ups are as OpenGL allows")
    assert found["inside"] == (right == len(found["verdicts"]))


# ---- environments

LEVEL_LOOK = """
#include "environment_input.glsl"
uniform sampler2D coordinates;
out vec4 color;
void main() {
    vec4 at = texelFetch(coordinates, ivec2(gl_FragCoord.xy), 0);
    color = vec4(picture_radiance(at.xyz, at.w), 1.0);
}
"""
ENVIRONMENTS = {
    "lat-long": LatLong(np.zeros((16, 32, 3), np.float32)),
    "cube": CubeMap(np.zeros((6, 16, 16, 3), np.float32)),
    "octahedral": Octahedral(np.zeros((16, 16, 3), np.float32)),
    "hemicube": HemiCube(np.zeros((48, 16, 3), np.float32)),
    "equal-area": Hemisphere(np.zeros((16, 16, 3), np.float32), "equal-area"),
    "dual-paraboloid": Hemisphere(np.zeros((16, 32, 3), np.float32), "dual-paraboloid"),
}


def coded_levels(picture: EnvironmentMap, how: str = "box") -> list[npt.NDArray[np.float32]]:
    """Every level holds its number, and every tile its own."""
    levels = []
    for number, level in enumerate(chain(picture.pixels)):
        level = np.full_like(level, number)
        level[..., 1] = np.arange(len(level))[:, None, None]
        levels.append(level)
    return levels


def codes_read(context: Context, name: str, how: str) -> tuple[F64, F64, F64]:
    """Levels wanted (L,), and in directions everywhere, edges and corners too, what the renderer's own look-up and what
    the reference reads (K, L, 3)."""
    quality = Quality("exact", samples=1, environment_filter=how, texture_format="float", environment_layout="given")
    contents, layout = Contents(), LAYOUTS[name]
    plan = make_plan(Scene([], ENVIRONMENTS[name]), quality, (64, 64), contents).environments[0]
    picture = contents.environment(ENVIRONMENTS[name])
    levels = coded_levels(picture)
    edges = np.array([[x, y, z] for x in (-1, 0, 1) for y in (-1, 0, 1) for z in (-1, 0, 1) if x or y or z], float)
    beside = (edges[:, None] + 1e-3 * inputs.unit_vectors(8, 9)).reshape(-1, 3)
    seam = inputs.unit_vectors(100, 10) * [1, 1, 0] + [0, 0, 1e-7]
    dirs = np.concatenate([edges, beside, seam, inputs.unit_vectors(200, 11), picture.texel_dirs().reshape(-1, 3)])
    wanted = np.arange(-1, len(levels) + 1, 0.25)
    shape = len(dirs), len(wanted)
    at = np.dstack([np.broadcast_to(dirs[:, None], (*shape, 3)), np.broadcast_to(wanted, shape)])
    maps = [EnvironmentMap(layout, level) for level in levels]
    flat = at[..., :3].reshape(-1, 3)
    want = through_levels(lambda i, here: sample(maps[i], flat[here]), at[..., 3].ravel(), len(levels), how)
    return wanted, looked_up(context, plan, contents, at), want.reshape(*shape, 3)


@pytest.mark.parametrize("how", ["trilinear", "nearest-level"])
@pytest.mark.parametrize("name", ENVIRONMENTS)
def test_a_level_coded_environment_is_read_back(
    context: Context, monkeypatch: pytest.MonkeyPatch, name: str, how: str
) -> None:
    """At every level, in every direction, on edges and in corners: exactly."""
    monkeypatch.setattr("glbump.gl.textures.environment_levels", coded_levels)
    wanted, read, want = codes_read(context, name, how)
    # Where levels are not mixed, and none is half-way: the number itself, but on cubes, where llvmpipe adds up four
    # weighted texels near edges, for the last two bits.
    sure = (wanted % 1 == 0) if how == "trilinear" else (wanted % 1 != 0.5)
    numbers = np.clip(np.rint(wanted[sure]), 0, want[..., 0].max().round())
    assert np.abs(read[:, sure, 0] - numbers).max() <= (2.0**-20 if name == "cube" else 0)
    assert np.abs(want[:, sure, 0] - numbers).max() < 1e-14
    # Weights between two levels of as many bits as drivers have; half-way either level is the nearest.
    assert np.abs(read[..., 0] - want[..., 0]).max() <= (1 / 256 if how == "trilinear" else 1.000001)
    # The tiles' numbers, up to 5, mix alike across edges: weights of float32 places on 16 texels.
    assert np.abs(read[:, sure, 1] - want[:, sure, 1]).max() < 1e-4


def test_borders_that_leak_are_seen(context: Context, monkeypatch: pytest.MonkeyPatch) -> None:
    """Tiles whose borders hold nothing, in each layout that has borders: levels are darker along the edges."""

    def bare(layout: Layout, pixels: npt.NDArray[np.float32], *grid: Any) -> npt.NDArray[np.float32]:
        return np.pad(pixels, ((0, 0), (1, 1), (1, 1), (0, 0)))

    monkeypatch.setattr("glbump.gl.textures.environment_levels", coded_levels)
    for name in ("octahedral", "hemicube", "dual-paraboloid"):
        with monkeypatch.context() as patch:
            patch.setattr("glbump.maps.layout.padded", bare)
            wanted, read, _ = codes_read(context, name, "trilinear")
        whole = (wanted % 1 == 0) & (wanted > 0)
        assert (read[:, whole, 0] < np.minimum(wanted[whole], 4) - 0.1).mean() > 0.1


def looked_up(context: Context, plan: EnvironmentPlan, contents: Contents, at: npt.ArrayLike) -> F64:
    """picture_radiance in directions and at levels (H, W, 4), as the renderer sets it up."""
    data = np.asarray(at, np.float32)
    gl, (height, width) = context.gl, data.shape[:2]
    store = Store(context, contents)
    source = resolve(text=LEVEL_LOOK, name="level look", stage="fragment", defines=dict(plan.defines))
    uniforms = Uniforms(gl, build_program(gl, resolve("fullscreen.vert"), source))
    uniforms.write(environment_uniforms(plan, 1, contents) | {"environment": 0, "coordinates": 1})
    coordinates, target = (gl.texture((width, height), 4, values, dtype="f4") for values in (data.tobytes(), None))
    frame = gl.framebuffer([target])
    frame.use()
    store.environment(plan).use(0)
    coordinates.use(1)
    uniforms.vertices.render(vertices=3)
    read = np.frombuffer(frame.read(components=3, dtype="f4"), np.float32).reshape(height, width, 3)
    context.unbind()
    for thing in (store, uniforms, frame, target, coordinates):
        thing.release()
    return read.astype(np.float64)
