"""Every way to store normals: what it costs is what it says, and the shader reads what was stored."""

from __future__ import annotations

from functools import cache

import numpy as np
import numpy.typing as npt
import pytest

from glbump.errors import ImageError
from glbump.glsltest import Glsl, Sampler, inputs
from glbump.maps.angles import degrees_between
from glbump.maps.encodings import ENCODINGS, Encoding, slope_map
from glbump.maps.heights import slopes_of_normals
from glbump.reference import encodings as twin

F64 = npt.NDArray[np.float64]

# NUMERICS 1.6: mean and largest angle over 2e6 directions, degrees; with the tilt up to which they are spread.
PUBLISHED = {
    "oct16": (0.33686, 0.953, 180),
    "oct16-precise": (0.31471, 0.63567, 180),
    "oct24": (0.02089, 0.0589, 180),
    "oct24-precise": (0.01952, 0.0394, 180),
    "oct32": (0.00131, 0.00367, 180),
    "oct32-precise": (0.00122, 0.00246, 180),
    "rgb8": (0.1701, 0.3875, 180),
    "rgb10": (0.0422, 0.0965, 180),
    "rgb16": (0.00066, 0.00150, 180),
    "half": (0.0061, 0.0230, 180),
    "rg8": (0.467, 5.86, 90),
    "rg16": (0.0030, 0.362, 90),
    "slopes8": (0.137, 0.315, 45),
    "slopes16": (0.00053, 0.0012, 45),
}


def spread(count: int, reach: float) -> F64:
    """Directions spread evenly over tilts up to `reach` degrees; without chance, so that all tests see the same."""
    i = np.arange(count)
    z = 1 - (1 - np.cos(np.radians(reach))) * (i + 0.5) / count
    turn = i * np.pi * (3 - np.sqrt(5))
    across = np.sqrt(1 - z * z)
    return np.stack([across * np.cos(turn), across * np.sin(turn), z], axis=-1)


def extremes(reach: float) -> F64:
    """As far as `reach`: axes, edges, corners; directions about the middles of the octahedron's faces; a quarter of the
    rim, 6 degrees wide: z from x and y of 8 bits is as far off where they pass 1."""
    middle = np.sign(inputs.corners())[:, None] + np.random.default_rng(1).uniform(-0.02, 0.02, (8, 500, 3))
    n = np.concatenate([inputs.directions(500).astype(float), middle.reshape(-1, 3)])
    n /= np.linalg.norm(n, axis=-1, keepdims=True)
    turn = np.linspace(0, np.pi / 2, 1000)[:, None]
    tilt = np.radians(reach - np.linspace(0, 6.1, 50))
    rim = np.stack(np.broadcast_arrays(np.cos(turn) * np.sin(tilt), np.sin(turn) * np.sin(tilt), np.cos(tilt)), axis=-1)
    n = np.concatenate([n, rim.reshape(-1, 3)])
    return n[np.degrees(np.arctan2(np.hypot(n[:, 0], n[:, 1]), n[:, 2])) <= reach]


@cache
def measured(e: Encoding, reach: float) -> tuple[float, float]:
    n, more = spread(200_000 if reach == e.reach else 50_000, reach), extremes(reach)
    off = degrees_between(e.decode(e.encode(n)), n)
    return float(off.mean()), float(max(off.max(), degrees_between(e.decode(e.encode(more)), more).max()))


@pytest.mark.parametrize("name", list(ENCODINGS))
def test_it_costs_what_it_says(name: str) -> None:
    """Over 2e5 directions and extremes. The worst is a bound: reached to 7 %, and never passed."""
    e = ENCODINGS[name]
    for reach, mean, worst in ((e.reach, e.mean, e.worst), (min(e.reach, 45.0), e.mean_45, e.worst_45)):
        got_mean, got_worst = measured(e, reach)
        assert got_mean == pytest.approx(mean, rel=0.01)
        # Floats of -1..1 have finer steps where they are small: which directions are worst is rare.
        least = 0.8 if name in ("half", "float") else 0.93
        assert least * worst < got_worst <= worst


@pytest.mark.parametrize("name", list(PUBLISHED))
def test_the_published_table(name: str) -> None:
    """Means within 2 %; the largest within 5 % (which of 2e6 directions is worst is chance)."""
    mean, worst, reach = PUBLISHED[name]
    got_mean, got_worst = measured(ENCODINGS[name], reach)
    assert got_mean == pytest.approx(mean, rel=0.02)
    assert got_worst == pytest.approx(worst, rel=0.05)


@pytest.mark.parametrize("steepest", [0.1, 0.5, 2.0, 8.0])
def test_slopes_of_any_range(steepest: float) -> None:
    for bits in (8, 16):
        e = slope_map(bits, steepest)
        mean, worst = measured(e, e.reach)
        assert mean == pytest.approx(e.mean, rel=0.02)
        assert 0.9 * e.worst < worst <= e.worst
        with pytest.raises(ImageError, match="1 of 1 pixels"):
            e.encode([[1.01 * steepest, 0.0, 1.0]])


@pytest.mark.parametrize("name", list(ENCODINGS))
def test_flat_is_exactly_flat_and_axes_are_exact(name: str) -> None:
    e = ENCODINGS[name]
    axes = [a for a in inputs.axes().astype(float) if a[2] > 0 or e.reach == 180 or (a[2] == 0 and e.reach == 90)]
    assert len(axes) == {180: 6, 90: 5, 45: 1}[round(e.reach)]
    for axis in axes:
        assert np.array_equal(e.decode(e.encode([axis]))[0], axis)


@pytest.mark.parametrize("name", list(ENCODINGS))
def test_what_is_read_is_stored_as_it_was(name: str) -> None:
    """Decoding and encoding again stays near, and the texel has the size that it says."""
    e = ENCODINGS[name]
    stored = e.encode(spread(20_000, min(e.reach, 80)))
    assert stored[0].nbytes == e.size
    again = e.decode(e.encode(e.decode(stored)))
    # What is read has been normalised, and may lie nearer to another code. Never by more than a step.
    moved = degrees_between(again, e.decode(stored))
    assert moved.max() <= 2 * e.worst
    assert np.mean(moved > 0) < 0.5
    # Any length, and a map's shape.
    assert np.array_equal(e.encode(3 * spread(6, 40).reshape(2, 3, 3)), e.encode(spread(6, 40)).reshape(2, 3, -1))


def test_precise_is_never_farther_off_than_plain() -> None:
    n = np.concatenate([spread(20_000, 180), extremes(180)])
    for plain in ("oct16", "oct24", "oct32"):
        a, b = ENCODINGS[plain], ENCODINGS[plain + "-precise"]
        off_a, off_b = degrees_between(a.decode(a.encode(n)), n), degrees_between(b.decode(b.encode(n)), n)
        assert (off_b <= off_a + 1e-12).all()
        assert np.mean(off_b < off_a) > 0.05


def test_two_c_minus_one_would_lean() -> None:
    """Why the middle code is 0: the customary decoding of (128, 128, 255) leans by 0.32 degrees."""
    stored = ENCODINGS["rgb8"].encode([[0.0, 0.0, 1.0]])
    assert stored.tolist() == [[128, 128, 255]]
    customary = stored / 127.5 - 1
    customary /= np.linalg.norm(customary)
    assert degrees_between(customary, np.array([[0.0, 0.0, 1.0]]))[0] == pytest.approx(0.318, abs=0.001)


@pytest.mark.parametrize(
    ("name", "bad", "said"),
    [
        ("rgb8", (0, 0, 0), "up to 180 degrees.*2 of 30 pixels.*first at row 2, column 3"),
        ("oct32", (0, np.nan, 1), "2 of 30 pixels"),
        ("half", (0, np.inf, 1), "2 of 30 pixels"),
        ("rg8", (1, 0, -0.01), "up to 90 degrees.*2 of 30 pixels.*reaches farther"),
        ("slopes16", (0, -1.01, 1), "up to 45 degrees.*2 of 30 pixels"),
    ],
)
def test_what_does_not_fit_is_counted_and_placed(name: str, bad: tuple[float, ...], said: str) -> None:
    normals = np.tile(np.array([0.0, 0.0, 1.0]), (6, 5, 1))
    normals[2, 3] = normals[4, 1] = bad
    with pytest.raises(ImageError, match=said) as caught:
        ENCODINGS[name].encode(normals)
    assert "\n" not in str(caught.value)


def test_normals_of_any_scale() -> None:
    n = spread(1000, 80)
    wanted = ENCODINGS["oct32"].encode(n)
    for scale in (1e-300, 1e300):
        assert np.array_equal(ENCODINGS["oct32"].encode(n * scale), wanted)


def test_slopes_of_a_normal_agree_with_those_of_the_map() -> None:
    n = spread(1000, 89)
    assert np.abs(twin.slope_from_normal(n) - slopes_of_normals(n[None])[0]).max() < 1e-5
    assert twin.slope_from_normal([[0, 0, 0], [0, 0, -1], [-1, 0, 0], [0, 3, -1]]).tolist() == [
        [0, 0], [0, 0], [128, 0], [0, -128],
    ]  # fmt: skip


# In shaders: through textures of the very types

READERS = {
    "rgb8": "normal_from_rgb(c.rgb, 128.0)",
    "rgb16": "normal_from_rgb(c.rgb, 32768.0)",
    "rg8": "normal_from_rg(c.rg, 128.0)",
    "rg16": "normal_from_rg(c.rg, 32768.0)",
    "oct16": "normal_from_octahedral(c.rg, 128.0)",
    "oct24-precise": "normal_from_octahedral(codes_from_bytes(c.rgb), 2048.0)",
    "oct32": "normal_from_octahedral(c.rg, 32768.0)",
    "half": "normalize(c.rgb)",
    "float": "normalize(c.rgb)",
    "slopes8": "normalize(vec3(-slope_from_rg(c.rg, 128.0, 1.0), 1.0))",
    "slopes16": "normalize(vec3(-slope_from_rg(c.rg, 32768.0, 1.0), 1.0))",
}


@pytest.mark.parametrize("name", list(READERS))
def test_the_shader_reads_what_was_stored(name: str, glsl: Glsl) -> None:
    e = ENCODINGS[name]
    n = np.concatenate([[[0.0, 0.0, 1.0]], spread(2047, min(e.reach, 89))])
    stored = e.encode(n)
    f = glsl(
        f'#include "lib/encodings.glsl"\nvec3 f(sampler2D s, int i) {{'
        f" vec4 c = texelFetch(s, ivec2(i, 0), 0); return {READERS[name]}; }}"
    ).f
    got = f(Sampler(stored[None], filter="nearest"), np.arange(len(n), dtype=np.int32)).astype(np.float64)
    got /= np.linalg.norm(got, axis=-1, keepdims=True)
    # Against what NumPy reads: some roundings of float32, which at the rim of x, y go through a root.
    assert degrees_between(got, e.decode(stored)).max() < (0.003 if name.startswith("rg1") or name == "rg8" else 5e-5)
    # Against what was stored: within what the encoding says, and float32.
    assert degrees_between(got, n).max() <= e.worst + 5e-5
    assert degrees_between(got[:1], n[:1])[0] < 1e-5
