"""How this driver reads textures, against what OpenGL allows: small pictures, judged look-up by look-up.

Right is what glbump/reference/texturing allows with the bits that the conformance tests ask for; the middle of that
interval is where a driver stands that uses none of its freedom.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import moderngl
import numpy as np
import numpy.typing as npt

from glbump.gl.context import Context
from glbump.gl.levels import cube_texture, texture_2d
from glbump.gl.probe import draw
from glbump.maps.pyramid import chain
from glbump.reference.texturing import look_up
from glbump.reference.texturing.detail import detail_2d, detail_anisotropic, detail_cube, given_detail
from glbump.reference.texturing.interval import (
    EXACT,
    F64,
    HIGH_2D,
    HIGH_CUBE,
    LOW_2D,
    LOW_CUBE,
    Interval,
)
from glbump.reference.texturing.look_up import Filter

F32 = npt.NDArray[np.float32]
Look = dict[str, Any]

# One step of a value near 1, where OpenGL itself promises nothing: of 8 bits, of a half; of floats some of 23 bits,
# as weights are kept in no more than 8 on most hardware.
_FORMATS = {"rgba8": ("f1", 1 / 255), "half": ("f2", 2.0**-10), "float": ("f4", 2.0**-16)}
_SIZE_2D, _FACE = (20, 12), 16
_MAPPED = "ivec2 pixel = ivec2(gl_FragCoord.xy);\nvec3 at = texelFetch(coordinates, pixel, 0).xyz;\n"


@dataclass(frozen=True)
class Verdict:
    """Of one way to read a texture.

    grade: "high" or "low", by the precision of the conformance tests that all looks lie within (low passes with a
    warning), or "outside". from_middle: of the look farthest from the middle of what is allowed at high precision, in
    half-widths: 1 is the end of the interval. least, most: of the errors against the ideal look.
    """

    name: str
    grade: str
    from_middle: float
    least: float
    most: float
    looks: int


def texturing(context: Context) -> Look:
    """verdicts: of each way to read a texture, as plain data; inside: whether all are; meaning: a line."""
    context.check("probe")
    verdicts = [*_flat(context), *_cubes(context)]
    wrong = [v.name for v in verdicts if v.grade == "outside"]
    coarse = [v.name for v in verdicts if v.grade == "low"]
    inside = f"{len(verdicts) - len(wrong)} of {len(verdicts)} look-ups are as OpenGL allows"
    meaning = inside + (f", {len(coarse)} of them at the lower precision" if coarse else "")
    meaning += f"; these are not: {'; '.join(wrong)}" if wrong else ""
    return {"verdicts": [asdict(v) for v in verdicts], "inside": not wrong, "meaning": meaning}


# ------------------------------------------------------------ pictures of look-ups


@dataclass(frozen=True)
class _Quads:
    """Coordinates (H, W, C) of pixels in quads of 2x2, and how they change from pixel to pixel; float64 of float32."""

    at: F64
    ddx: F64
    ddy: F64

    @classmethod
    def of(cls, base: F64, ddx: F64, ddy: F64) -> _Quads:
        """From the lower left pixel of each quad (h, w, C)."""
        pixels = [[base + x * ddx + y * ddy for x in (0, 1)] for y in (0, 1)]
        at = np.stack([np.stack(row, axis=2) for row in pixels], axis=1)
        height, width, channels = base.shape
        at = at.reshape(2 * height, 2 * width, channels).astype(np.float32).astype(np.float64)
        return cls(at, *(np.repeat(np.repeat(d, 2, axis=0), 2, axis=1) for d in (ddx, ddy)))

    def drawn(self, context: Context, texture: Any, body: str, version: int = 330) -> F64:
        """The red of each pixel, where `body` looks `at` the texture `map`."""
        height, width, channels = self.at.shape
        data = np.zeros((height, width, 4), np.float32)
        data[..., :channels] = self.at
        coordinates = context.gl.texture((width, height), 4, data, dtype="f4")
        coordinates.filter = (moderngl.NEAREST, moderngl.NEAREST)
        read = draw(context, (width, height), _MAPPED + body, texture, coordinates, version)[..., :1]
        coordinates.release()
        # What is no number is far outside, and still JSON.
        return np.nan_to_num(read.astype(np.float64), nan=1e30, posinf=1e30, neginf=-1e30)


def _judged(name: str, read: F64, allowed: Sequence[Interval], where: Any = ...) -> Verdict:
    """allowed: at high and at low precision, and ideally; as `read`, (H, W, 1) or, of levels of detail, (H, W)."""
    read, (high, low, ideal) = read[where], (Interval(i.low[where], i.high[where]) for i in allowed)
    error = read - ideal.middle
    grade = "outside" if low.excess(read).any() else "low" if high.excess(read).any() else "high"
    # Where nothing is open, float32 is.
    from_middle = np.abs(read - high.middle) / np.maximum(high.reach, 1e-6)
    return Verdict(name, grade, float(from_middle.max()), float(error.min()), float(error.max()), error.size)


def _noise(shape: tuple[int, ...], dtype: str) -> tuple[list[F64], list[F32]]:
    """Levels of noise, 0..1 (..., h, w, 3): as they are read, and as they are given to OpenGL."""
    levels = chain(np.random.default_rng(4).random(shape, np.float32))
    if dtype == "f1":
        codes = [np.rint(level * 255).astype(np.float32) for level in levels]
        return [code.astype(np.float64) / 255 for code in codes], codes
    kept = [level.astype(np.float16 if dtype == "f2" else np.float32).astype(np.float32) for level in levels]
    return [level.astype(np.float64) for level in kept], kept


def _red(levels: Sequence[F64]) -> list[F64]:
    return [level[..., :1] for level in levels]


def _coded(levels: Sequence[npt.NDArray[Any]]) -> list[F32]:
    """Levels that hold their own number."""
    return [np.full(level.shape, number, np.float32) for number, level in enumerate(levels)]


# ------------------------------------------------------------ flat textures

_WAYS = {
    "trilinear": (Filter(), (moderngl.LINEAR_MIPMAP_LINEAR, moderngl.LINEAR)),
    "nearest level": (Filter(levels="nearest"), (moderngl.LINEAR_MIPMAP_NEAREST, moderngl.LINEAR)),
    "nearest texel": (Filter("nearest", "nearest", "nearest"), (moderngl.NEAREST_MIPMAP_NEAREST, moderngl.NEAREST)),
}


def _flat_quads() -> _Quads:
    """Footprints of 1/8 to 24 texels: straight, turned, long, mirrored, and thin, which leaves no freedom; within and
    beyond the texture."""
    random = np.random.default_rng(5)
    scale = 2.0 ** np.linspace(-3, np.log2(24), 48)
    sides = np.array(
        [
            [[1, 0], [0, 1]],
            [[0.7, 0.7], [-0.7, 0.7]],
            [[0.3, 0.1], [0.4, 1]],
            [[-1, 0.2], [0.2, -0.25]],
            [[0.02, 0], [0, 1]],
        ]
    )
    base = random.uniform(-1, 2, (len(sides), len(scale), 2))
    ddx, ddy = (sides[:, None, k] * scale[None, :, None] / _SIZE_2D for k in (0, 1))
    return _Quads.of(base, ddx, ddy)


def _flat(context: Context) -> Iterator[Verdict]:
    quads, size = _flat_quads(), np.array(_SIZE_2D)
    sides = quads.ddx * size, quads.ddy * size
    precisions = HIGH_2D, LOW_2D, EXACT
    details = [detail_2d(*sides, precision) for precision in precisions]
    enlarged = details[1].high <= 0
    for name, (dtype, step) in _FORMATS.items():
        levels, given = _noise((*_SIZE_2D[::-1], 3), dtype)
        texture = texture_2d(context, given, dtype)
        red = _red(levels)
        for way, (filter, gl_filter) in _WAYS.items():
            if way != "trilinear" and name != "half":
                continue
            texture.filter = gl_filter
            read = quads.drawn(context, texture, "result = texture(map, at.xy);")
            allowed = [
                look_up.texture_2d(red, quads.at, found, replace(p, colour=step), filter=filter)
                for p, found in zip(precisions, details)
            ]
            if way == "trilinear":
                yield _judged(f"2d {name} enlarged", read, allowed, enlarged)
            yield _judged(f"2d {name} {way}", read, allowed, ~enlarged)
        if name == "half" and context.gl.max_anisotropy >= 4:
            yield _anisotropic(context, texture, red, quads, step)
        texture.release()
    coded = texture_2d(context, _coded(levels), "f4")
    yield _judged("2d level of detail", *_levels_read(context, coded, quads, details, len(levels)))
    if context.gl.max_anisotropy >= 2:
        coded.anisotropy = 2.0
        details = [detail_anisotropic(*sides, 2, precision) for precision in precisions]
        details[2] = Interval(details[2].low, details[2].low)
        yield _judged("2d level of detail, anisotropy 2", *_levels_read(context, coded, quads, details, len(levels)))
    coded.release()


def _levels_read(
    context: Context, coded: Any, quads: _Quads, details: Sequence[Interval], count: int
) -> tuple[F64, list[Interval]]:
    """What a level-coded texture shows, and what it may."""
    read = quads.drawn(context, coded, f"result = texture(map, at.{'xyz' if quads.at.shape[-1] == 3 else 'xy'});")
    return read[..., 0], [Interval(*(np.clip(end, 0, count - 1) for end in found)) for found in details]


def _anisotropic(context: Context, texture: Any, red: list[F64], quads: _Quads, step: float) -> Verdict:
    size = np.array(_SIZE_2D)
    texture.filter, texture.anisotropy = _WAYS["trilinear"][1], 4.0
    read = quads.drawn(context, texture, "result = texture(map, at.xy);")
    texture.anisotropy = 1.0
    allowed = []
    for p in (replace(HIGH_2D, colour=step), replace(LOW_2D, colour=step)):
        found = detail_anisotropic(quads.ddx * size, quads.ddy * size, 4, p)
        allowed.append(look_up.anisotropic_2d(red, quads.at, quads.ddx, quads.ddy, found, p, limit=4))
    return _judged("2d half, anisotropy 4", read, [*allowed, allowed[0]])


# ------------------------------------------------------------ cubes


def _cube_quads() -> _Quads:
    """On all faces, in their middles, along edges and in corners; footprints of 1/4 to 8 texels in the middle."""
    random = np.random.default_rng(6)
    places = np.array([-0.999, -0.95, -0.4, 0.1, 0.97, 0.9999])
    s, t = (a.ravel() for a in np.meshgrid(places, places))
    base = np.zeros((6, len(s), 3))
    for face, axis in enumerate((0, 0, 1, 1, 2, 2)):
        base[face, :, axis] = 1 - 2 * (face % 2)
        base[face, :, (axis + 1) % 3], base[face, :, (axis + 2) % 3] = s, t
    scale = 2.0 ** random.uniform(-2, 3, (6, len(s), 1)) * 2 / _FACE
    across = random.normal(size=(2, 6, len(s), 3))
    across /= np.linalg.norm(across, axis=-1, keepdims=True)
    return _Quads.of(base, across[0] * scale, across[1] * scale)


def _cubes(context: Context) -> Iterator[Verdict]:
    quads = _cube_quads()
    precisions = HIGH_CUBE, LOW_CUBE, EXACT
    details = [detail_cube(quads.at, quads.ddx, quads.ddy, _FACE, precision) for precision in precisions]
    given_levels = np.broadcast_to(np.linspace(-0.5, 4.5, quads.at.shape[1]), quads.at.shape[:2])
    for name, (dtype, step) in _FORMATS.items():
        levels, given = _noise((6, _FACE, _FACE, 3), dtype)
        texture = cube_texture(context, given, dtype)
        red = _red(levels)
        looks = {
            "enlarged": ("textureLod(map, at, 0.0)", [Interval(0 * d.low, 0 * d.low) for d in details]),
            "trilinear": ("texture(map, at)", details),
        }
        if name == "half":
            level = f"mix(-0.5, 4.5, float(pixel.x) / {quads.at.shape[1] - 1}.0)"
            looks["level given"] = (
                f"textureLod(map, at, {level})",
                [given_detail(given_levels, precision) for precision in precisions],
            )
        for what, (call, found) in looks.items():
            read = quads.drawn(context, texture, f"result = {call};")
            allowed = [
                look_up.texture_cube(red, quads.at, d, replace(p, colour=step)) for p, d in zip(precisions, found)
            ]
            yield _judged(f"cube {name} {what}", read, allowed)
        texture.release()
    coded = cube_texture(context, _coded(levels), "f4")
    yield _judged("cube level of detail", *_levels_read(context, coded, quads, details, len(levels)))
    if context.info["version_code"] >= 400:
        read = quads.drawn(context, coded, "result = vec4(textureQueryLod(map, at).y);", 400)[..., 0]
        yield _judged("cube textureQueryLod", read, details)
    coded.release()
