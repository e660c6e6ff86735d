"""Unit normals and slopes as textures store them, and how many degrees each way costs.

Directions are of tangent space: x along u, y along v, z straight out of the surface. Integer codes have their middle
at exactly 0, so that a flat normal is read back flat: code c of b bits is (c - 2^(b-1)) / (2^(b-1) - 1), 0 not used.
The shaders' side is shaders/lib/encodings.glsl.

Where a figure is a formula below, it is geometry: `half` is half a step of the codes, in radians, and a step's corner
is off by its diagonal as seen from where it is seen largest. Means were measured, and fall as the step does.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from glbump.errors import ImageError
from glbump.frozen import Frozen
from glbump.maps.projections import octahedral_dir, octahedral_place
from glbump.maps.stored import count_and_first

F64 = npt.NDArray[np.float64]
Stored = npt.NDArray[Any]

HALF_MAX = 65504.0
HALF_DIM = 2.0**-8
"""Least peak of what is kept in halves: they end in steps of 2**-24, so 1/256 of it still has 8 bits."""

_UP_LAST = [0, 2, 1]
"""Tangent space <-> the frame of `octahedral_place`, whose +Y is up."""


class Encoding(Frozen):
    """One way to store unit normals, and the angle between what was stored and what is read, in degrees.

    size: bytes a texel. reach: tilts from +Z up to which it holds every normal, degrees. mean: over directions spread
    evenly within that reach; worst: none is farther off. mean_45, worst_45: the same over tilts up to 45 degrees.
    holds: (..., 3) unit vectors -> (...) which of them it can store. pack: those as stored.
    decode: (..., n) as stored -> (..., 3) float64, unit length.
    """

    name: str
    size: int
    reach: float
    mean: float
    worst: float
    mean_45: float
    worst_45: float
    holds: Callable[[F64], npt.NDArray[np.bool_]]
    pack: Callable[[F64], Stored]
    decode: Callable[[Stored], F64]

    def encode(self, normals: npt.ArrayLike) -> Stored:
        """(..., 3) normals of any length -> (..., n) of the type that goes to a texture.

        ImageError where one has no direction, or cannot be held: how many, and the first.
        """
        n = np.asarray(normals, np.float64)
        longest = np.abs(n).max(axis=-1, keepdims=True)
        sound = (longest > 0) & (longest < np.inf)
        n = _unit(np.where(sound, n / np.where(sound, longest, 1.0), (0.0, 0.0, -1.0)))
        bad = ~sound[..., 0] | ~self.holds(n)
        if bad.any():
            raise ImageError(
                f"{self.name} holds all normals of up to {self.reach:.4g} degrees from straight out; "
                f"{count_and_first(np.atleast_2d(bad))} are none; mend them, or choose an encoding that reaches farther"
            )
        return self.pack(n)


def _unit(v: F64) -> F64:
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


def _any(n: F64) -> npt.NDArray[np.bool_]:
    return np.ones(n.shape[:-1], bool)


def _half_step(bits: int) -> float:
    return float(0.5 / (2 ** (bits - 1) - 1))


def codes(values: F64, bits: int) -> Stored:
    """-1..1 -> the nearest codes of so many bits."""
    middle = 2 ** (bits - 1)
    return np.rint(middle + (middle - 1) * values).astype(np.uint8 if bits <= 8 else np.uint16)


def _values(codes: Stored, bits: int) -> F64:
    middle = 2.0 ** (bits - 1)
    return (codes - middle) / (middle - 1)


# ------------------------------------------------------------ three components


def _rgb(bits: int) -> Encoding:
    half, step = np.degrees(_half_step(bits)), 1 / (2 ** (bits - 1) - 1)
    pack, unpack = (packed_10, unpacked_10) if bits == 10 else (lambda c: c, lambda c: c)
    return Encoding(
        f"rgb{bits}",
        4 if bits == 10 else 3 * bits // 8,
        180.0,
        21.62 * step,
        np.sqrt(3) * half,
        21.65 * step,
        np.sqrt(3) * half,
        _any,
        lambda n: pack(codes(n, bits)),
        lambda stored: _unit(_values(unpack(stored), bits)),
    )


def packed_10(codes: Stored) -> Stored:
    """Three codes of 10 bits in one integer, the first lowest, above them 3: OpenGL's UNSIGNED_INT_2_10_10_10_REV."""
    wide = codes.astype(np.uint32)
    return wide[..., :1] | wide[..., 1:2] << 10 | wide[..., 2:] << 20 | np.uint32(3 << 30)


def unpacked_10(packed: Stored) -> Stored:
    """(..., 1) as `packed_10` has them -> (..., 3) codes of 10 bits."""
    return (packed >> np.arange(0, 30, 10, dtype=np.uint32) & 1023).astype(np.uint16)


def _floats(name: str, kind: type[np.floating[Any]], mean: float, mean_45: float) -> Encoding:
    # Half a unit in the last place below 1.
    worst = np.degrees(np.sqrt(3) * np.finfo(kind).epsneg / 2)
    return Encoding(
        name,
        3 * np.dtype(kind).itemsize,
        180.0,
        mean,
        worst,
        mean_45,
        worst,
        _any,
        lambda n: n.astype(kind),
        lambda stored: _unit(stored.astype(np.float64)),
    )


# ------------------------------------------------------------ two components


def _rg(bits: int, mean: float) -> Encoding:
    """x and y; z from the unit length: what lies flat is far off, where a step of x and y is a long way down."""
    half, step = _half_step(bits), 1 / (2 ** (bits - 1) - 1)
    return Encoding(
        f"rg{bits}",
        2 * bits // 8,
        90.0,
        mean,
        np.degrees(np.arccos(1 - np.sqrt(2) * half)),
        23.99 * step,
        np.degrees(np.arcsin(np.sqrt(0.5) + np.sqrt(2) * half)) - 45,
        lambda n: n[..., 2] >= -1e-9,  # rounding puts none out of reach that is not
        lambda n: codes(n[..., :2], bits),
        lambda stored: _with_z(_values(stored, bits)),
    )


def _with_z(xy: F64) -> F64:
    z = np.sqrt(np.maximum(1 - (xy**2).sum(axis=-1, keepdims=True), 0))
    return _unit(np.concatenate([xy, z], axis=-1))


def slope_map(bits: int, steepest: float = 1.0) -> Encoding:
    """Slopes (-x / z, -y / z) within +-steepest, which average as slopes do; normals of up to that slope."""
    half = _half_step(bits) * steepest
    reach = float(np.degrees(np.arctan(steepest)))
    mean, mean_45 = (_mean_of_slopes(half, min(limit, reach)) for limit in (90.0, 45.0))
    worst = np.degrees(np.sqrt(2) * half)
    return Encoding(
        f"slopes{bits}",
        2 * bits // 8,
        reach,
        mean,
        worst,
        mean_45,
        worst,
        lambda n: np.abs(n[..., :2]).max(axis=-1) <= n[..., 2] * steepest * (1 + 1e-9),
        lambda n: codes(-n[..., :2] / n[..., 2:] / steepest, bits),
        lambda stored: _of_slopes(_values(stored, bits) * steepest),
    )


def _of_slopes(slopes: F64) -> F64:
    return _unit(np.concatenate([-slopes, np.ones_like(slopes[..., :1])], axis=-1))


def _mean_of_slopes(half: float, reach: float) -> float:
    """Mean angle for slopes off by up to +-half each way, over tilts up to `reach` degrees, even per solid angle.

    0.765 half is the mean length of such an error; seen along the tilt it shrinks as cos^2, across it as cos.
    """
    cosine = np.linspace(np.cos(np.radians(reach)), 1, 65)[:, None]
    turn = np.linspace(0, np.pi, 65)[:-1]
    seen = cosine * np.hypot(cosine * np.cos(turn), np.sin(turn))
    return float(np.degrees(0.765196 * half * seen.mean()))


def _octahedral(bits: int, precise: bool) -> Encoding:
    """The sphere as an octahedron unfolded to a square: Cigolle et al., A Survey of Efficient Representations for
    Independent Unit Vectors, JCGT 3(2), 2014. precise: of the four codes around the place, the nearest by angle
    (their listing 4); read in the same way."""
    half, step = np.degrees(_half_step(bits)), 1 / (2 ** (bits - 1) - 1)
    pack, unpack = (_pack_12, _unpack_12) if bits == 12 else (lambda c: c, lambda c: c)
    nearest = _nearest_of_four if precise else lambda n, b: codes(_place(n), b)
    return Encoding(
        f"oct{2 * bits}" + ("-precise" if precise else ""),
        2 * bits // 8,
        180.0,
        (39.98 if precise else 42.78) * step,
        # Largest in the middle of each face of the octahedron, where steps make a lattice of triangles.
        (np.sqrt(8) if precise else np.sqrt(18)) * half,
        (38.95 if precise else 40.97) * step,
        np.sqrt(8) * half if precise else (1 + np.sqrt(2)) ** 2 / np.sqrt(2) * half,
        _any,
        lambda n: pack(nearest(n, bits)),
        lambda stored: _unfolded(_values(unpack(stored), bits)),
    )


def _place(n: F64) -> F64:
    _, s, t = octahedral_place(n[..., _UP_LAST])
    return 2 * np.stack([s, t], axis=-1) - 1


def _unfolded(place: F64) -> F64:
    return octahedral_dir(0, *np.moveaxis(0.5 + 0.5 * place, -1, 0))[..., _UP_LAST]


def _nearest_of_four(n: F64, bits: int) -> Stored:
    most = 2 ** (bits - 1) - 1
    low = np.minimum(np.floor(_place(n) * most), most - 1)
    best, least = codes(low / most, bits), np.full(n.shape[:-1], np.inf)
    for corner in ((0, 0), (1, 0), (0, 1), (1, 1)):
        place = (low + corner) / most
        off = np.linalg.norm(_unfolded(place) - n, axis=-1)
        nearer = off < least
        best[nearer], least = codes(place, bits)[nearer], np.minimum(off, least)
    return best


def _pack_12(codes: Stored) -> Stored:
    """Two codes of 12 bits in three bytes, highest bits first. Not to be filtered as it stands."""
    a, b = codes[..., 0], codes[..., 1]
    return np.stack([a >> 4, (a & 15) << 4 | b >> 8, b & 255], axis=-1).astype(np.uint8)


def _unpack_12(packed: Stored) -> Stored:
    r, g, b = np.moveaxis(packed.astype(np.uint16), -1, 0)
    return np.stack([r << 4 | g >> 4, (g & 15) << 8 | b], axis=-1)


ENCODINGS = {
    e.name: e
    for e in (
        _rg(8, 0.472),
        _rg(16, 0.002992),
        _rgb(8),
        _rgb(10),
        _rgb(16),
        _floats("half", np.float16, 0.006057, 0.00568),
        _floats("float", np.float32, 7.4e-7, 6.93e-7),
        *(_octahedral(bits, precise) for bits in (8, 12, 16) for precise in (False, True)),
        slope_map(8),
        slope_map(16),
    )
}
