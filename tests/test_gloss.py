"""Glossy light: split-sum factors, the white furnace, scattering between facets, lobes sampled facet by facet."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import pytest

from glbump import reference
from glbump.camera import Camera, sample_number, sample_offsets
from glbump.contents import Contents
from glbump.environment import (
    BoxBounds,
    Chrome,
    CubeMap,
    Environment,
    HemiCube,
    Hemisphere,
    LatLong,
    Octahedral,
    Sky,
)
from glbump.errors import SceneError
from glbump.gl.renderer import Renderer
from glbump.maps import dfg
from glbump.maps.layout import CUBE, LATLONG, EnvironmentMap, texel_dirs
from glbump.maps.pyramid import chain as box_levels
from glbump.plan import make_plan
from glbump.quality import Quality
from glbump.reference import ggx
from glbump.reference.direction import axes_across
from glbump.reference.lobe import Facets, lobe_factors
from glbump.scene import Bump, Material, Scene, Surface
from glbump.shapes import Plane, Sphere, Torus, Transform

WHITE = LatLong(np.ones((8, 16, 3), np.float32))
DIRS = texel_dirs(LATLONG, (128, 64))[0]
# Waves half a radian long, with all directions alike on average.
RADIANCE = (1.5 + np.sin(6 * DIRS) * np.cos(4 * DIRS[..., [1, 2, 0]])).astype(np.float32)
WAVES = LatLong(RADIANCE)


# ---- split-sum factors


def test_the_factors_meet_their_anchors() -> None:
    """NUMERICS 2.6: the closed form at alpha 1, seen face on, and height-correlated Smith elsewhere."""
    assert sum(dfg.factors(1, 1)) == pytest.approx(1 - np.log(2), abs=1e-4)
    anchors = {(1, 0.5): (0.9158, 0.00003), (0.5, 0.5): (0.83491, 0.02235), (0.1, 0.5): (0.75208, 0.13969)}
    for (n_dot_v, roughness), wanted in anchors.items():
        # Printed to 1e-5; 2e-4 of quadrature on either side.
        assert dfg.factors(n_dot_v, roughness) == pytest.approx(wanted, abs=4e-4)
    # Uncorrelated shadows are another function.
    assert dfg.factors(0.5, 1)[0] == pytest.approx(0.44770, abs=4e-4) != pytest.approx(0.40668, abs=4e-3)


def test_the_table_is_what_the_command_computes() -> None:
    table = dfg.table()
    assert table.shape == (dfg.SIZE, dfg.SIZE, 2)
    assert table.nbytes <= 4096
    for row, column in ((0, 31), (31, 31), (31, 0), (7, 3), (15, 20)):
        n_dot_v, roughness = (column / 31) ** 2, row / 31
        wanted = dfg.factors(max(n_dot_v, dfg.SMALLEST[0]), max(roughness, dfg.SMALLEST[1]))
        assert table[row, column] == pytest.approx(wanted, abs=2.0**-11)


def test_the_table_between_its_texels() -> None:
    """The bounds that stand at it; a table without the root of n.v would be off by 0.07."""
    rng = np.random.default_rng(2)
    at = np.concatenate([rng.uniform(0.02, 1, (60, 2)), rng.uniform(0.02, 1, (40, 2)) * [0.1, 1]])
    wanted = np.array([dfg.factors(*pair) for pair in at.tolist()])
    error = np.abs(lobe_factors(*at.T, "table") - wanted)
    assert (error.max(axis=0) < [0.004, 0.012]).all()
    shares = [ggx.glossy_share(np.full(3, 0.3), factors) for factors in (lobe_factors(*at.T, "table"), wanted)]
    assert np.abs(shares[0] - shares[1]).max() < 0.005
    assert np.abs(lobe_factors(*at.T, "fit") - wanted).max() > 0.1


# ---- energy


@pytest.mark.parametrize("how", ["table", "fit", "sampled"])
@pytest.mark.parametrize("roughness", [1e-6, 0.045, 0.2, 0.6, 1.0])
def test_white_furnace(renderer: Renderer, roughness: float, how: str) -> None:
    """In white light a material that absorbs nothing is white at every angle: 0.1 % is promised."""
    chosen = {"gloss": "sampled", "lobe_samples": 3} if how == "sampled" else {"gloss": "chain", "dfg": how}
    quality = Quality("exact", samples=1, gloss_size=8, gloss_samples=4, diffuse="sh9", **chosen)  # type: ignore[arg-type]
    materials = [Material(metallic=m, transmission=t, roughness=roughness) for m in (0, 0.5, 1) for t in (0, 0.5, 1)]
    for eye in ((0, 0, 4), (0.3, 0, 0.2)):
        for material in materials[: 9 if eye[2] == 4 else 3]:
            scene = Scene([Surface(Sphere(), material)], WHITE, Camera(eye=eye, target=(0, 0, -3)))
            pixels = renderer.render(scene, (24, 24), quality).pixels[..., :3]
            # Sums of shares of 1, some roundings each.
            assert np.abs(pixels - 1).max() < 1e-5


def _walked(n_dot_v: float, roughness: float, f0: Any, count: int = 40_000) -> Any:
    """Share of the light that leaves Smith's surface of GGX facets, by random walks (Heitz, Hanika, d'Eon and
    Dachsbacher, "Multiple-scattering microfacet BSDFs with the Smith model", 2016, algorithm 1)."""
    rng = np.random.default_rng(1)
    alpha = roughness**2
    w = np.tile([-np.sqrt(1 - n_dot_v**2), 0, -n_dot_v], (count, 1))
    below, weight, left = np.ones(count), np.ones((count, len(f0))), np.zeros(len(f0))
    for bounce in range(60):
        z = np.clip(w[:, 2], -0.999999, 0.999999)
        slope = np.sqrt(1 - z * z) / z * alpha
        shadow = 0.5 * (np.sign(slope) * np.sqrt(1 + slope * slope) - 1)
        free = np.where(shadow > 0, below ** np.maximum(shadow, 0), 0)
        chance = rng.random(len(w))
        out = (chance > 1 - free) & (w[:, 2] > 0)
        if bounce:
            left += weight[out].sum(axis=0)
        w, below, weight, shadow, chance = (a[~out] for a in (w, below, weight, shadow, chance))
        if not len(w):
            break
        below = np.clip(below / (1 - chance) ** (1 / shadow), 0, 1)
        h = ggx.visible_normal(-w, alpha, rng.random((len(w), 2)))
        cosine = -np.einsum("ki,ki->k", w, h)
        weight = weight * (f0 + (1 - f0) * (1 - np.clip(cosine, 0, 1))[:, None] ** 5)
        w = w + 2 * cosine[:, None] * h
    return left / count


def test_scattering_between_facets_is_that_of_random_walks() -> None:
    """ggx.glsl: at most 0.056 off, 0.016 rms; light lost at the second facet, or all of it as the first, is not."""
    f0 = np.array([0.04, 0.2, 0.5, 0.8, 1.0])
    errors: dict[str, list[Any]] = {"once": [], "scaled": [], "ours": []}
    for roughness in (0.4, 0.7, 1.0):
        for n_dot_v in (0.3, 0.6, 1.0):
            walked = _walked(n_dot_v, roughness, f0)
            a, b = dfg.factors(n_dot_v, roughness)
            single = f0 * a + b
            ours = ggx.glossy_share(f0[:, None], np.array([a, b]))[:, 0]
            for name, share in (("once", single), ("scaled", single / (a + b)), ("ours", ours)):
                errors[name].append(share - walked)
    rms = {name: float(np.sqrt(np.mean(np.square(e)))) for name, e in errors.items()}
    # A walk of 40,000 is off by 0.0025.
    assert np.abs(errors["ours"]).max() < 0.06
    assert rms["ours"] < 0.02
    assert rms["scaled"] > 3 * rms["ours"]
    assert rms["once"] > 10 * rms["ours"]


# ---- facets one by one


def _truth(v: Any, n: Any, roughness: float, f0: float) -> Any:
    """The integral over the lobe of each row, by every texel of a picture twice as fine: no n = v = r."""
    dirs = texel_dirs(LATLONG, (512, 256)).reshape(-1, 3)
    radiance = 1.5 + np.sin(6 * dirs) * np.cos(4 * dirs[:, [1, 2, 0]])
    area = np.hypot(dirs[:, 0], dirs[:, 2])
    alpha, result = roughness**2, []
    for eye, normal in zip(v, n):
        h = dirs + eye
        h /= np.linalg.norm(h, axis=1, keepdims=True)
        n_dot_l, n_dot_v = dirs @ normal, float(eye @ normal)
        tail = np.sum(np.cross(h, normal) ** 2, axis=1) + (alpha * (h @ normal)) ** 2
        lit = ggx.unshadowed(n_dot_v, n_dot_l, alpha) * 2 / (n_dot_v + np.hypot(alpha, n_dot_v * np.sqrt(1 - alpha**2)))
        weight = lit / tail**2 * (f0 + (1 - f0) * (1 - np.clip(h @ eye, 0, 1)) ** 5) * area
        result.append(weight @ radiance / weight.sum())
    return np.array(result)


def _pairs(count: int) -> tuple[Any, Any]:
    rng = np.random.default_rng(4)
    n = rng.normal(size=(count, 3))
    n /= np.linalg.norm(n, axis=1, keepdims=True)
    x, y = axes_across(n)
    cosine, turn = rng.uniform(0.15, 1, count)[:, None], rng.uniform(0, 6, count)[:, None]
    return cosine * n + np.sqrt(1 - cosine**2) * (np.cos(turn) * x + np.sin(turn) * y), n


def _averaged(dirs: Any, angle: Any) -> Any:
    """The waves' light, from the mip levels of their picture."""
    from glbump.maps.layout import sample
    from glbump.reference.filter import through_levels

    levels = [EnvironmentMap(LATLONG, level[None]) for level in box_levels(RADIANCE)]
    level = 0.5 * np.log2(np.maximum(angle * levels[0].texels_per_radian ** 2, 1e-30))
    return through_levels(lambda i, chosen: sample(levels[i], dirs[chosen]), level, len(levels), "trilinear")


@pytest.mark.parametrize("roughness", [0.3, 0.6, 1.0])
def test_sampled_lobes_converge_to_the_integral(roughness: float) -> None:
    v, n = _pairs(24)
    wanted = _truth(v, n, roughness, 0.5)
    errors = []
    for count in (4, 16, 64, 256):
        got = Facets(v, n, roughness, count).light(_averaged, v, 0.5)
        errors.append(np.sqrt(np.mean((got - wanted) ** 2) / np.mean(wanted**2)))
    # Measured: an order of 0.7 to 0.9 in the number of facets, down to what the picture's texels leave (0.1 %).
    assert errors[3] < 0.006
    assert errors[0] / errors[3] > 64**0.5
    assert errors[2] < 0.02
    # A lobe of another shape is further off than 64 facets are.
    other = Facets(v, n, 0.8 * roughness, 256).light(_averaged, v, 0.5)
    assert np.sqrt(np.mean((other - wanted) ** 2) / np.mean(wanted**2)) > 2 * errors[2]


def test_the_samples_of_a_pixel_make_one_finer_set() -> None:
    """Sixteen times sixteen facets are about as good as 256 at once; each sample has another number."""
    v, n = _pairs(24)
    wanted = _truth(v, n, 0.5, 0.5)
    sets = [Facets(v, n, 0.5, 16, number, 16).light(_averaged, v, 0.5) for number in range(16)]

    for samples in (1, 4, 9, 16):
        numbers = [sample_number(x, y, samples) for x, y in sample_offsets(samples).tolist()]
        assert sorted(numbers) == list(range(samples))

    def error(got: Any) -> float:
        return float(np.sqrt(np.mean((got - wanted) ** 2) / np.mean(wanted**2)))

    assert error(np.mean(sets, axis=0)) < 0.3 * np.mean([error(one) for one in sets])
    assert error(np.mean(sets, axis=0)) < 3 * error(Facets(v, n, 0.5, 256).light(_averaged, v, 0.5)) + 0.002


FLOATS = {"texture_format": "float", "frame_format": "float", "bump_format": "float"}
FACES = [np.ascontiguousarray(f) for f in (1 + 0.5 * np.sin(5 * texel_dirs(CUBE, (32, 32)))).astype(np.float32)]
SQUARE = (1 + 0.5 * np.sin(np.mgrid[0:64, 0:64][0] / 9.0)[..., None] * np.ones(3)).astype(np.float32)
ENVIRONMENTS: dict[str, Environment] = {
    "lat-long": WAVES,
    "in a room": replace(WAVES, exposure=1, bounds=BoxBounds((-4, -3, -5), (5, 3, 4))),
    "turned": replace(WAVES, rotation=40),
    "by normal": replace(WAVES, lookup="normal"),
    "cube": CubeMap(FACES),
    "hemicube": HemiCube([FACES[2], *(FACES[i][:16] for i in (0, 1, 4, 5))], below=(0.1, 0.2, 0.3)),
    "hemisphere": Hemisphere(SQUARE),
    "octahedral": Octahedral(SQUARE),
    "sky": Sky(),
    "chrome": Chrome(),
}


@pytest.mark.parametrize(
    ("preset", "samples", "name"),
    [("exact", 1, name) for name in ENVIRONMENTS] + [("exact", 9, "lat-long"), ("balanced", 4, "cube")],
)
def test_sampled_lobes_are_the_references(renderer: Renderer, preset: str, samples: int, name: str) -> None:
    """All layouts, glass and bumps: the same facets on both sides."""
    material = Material(base_color=(0.9, 0.6, 0.3), metallic=0.3, roughness=0.4, transmission=0.5, ior=1.4)
    bumps = Bump(0.5 + 0.5 * np.sin(np.linspace(0, 12.5, 32, dtype=np.float32)) * np.ones((32, 1), "f4"), 0.05, (4, 2))
    scene = Scene(
        [
            Surface(Sphere(), material, bumps),
            Surface(Torus(), replace(material, roughness=0.8), transform=Transform((0, -1, -2), (60, 0, 0))),
        ],
        ENVIRONMENTS[name],
        Camera(eye=(0, 1, 4), target=(0, 0, -3)),
    )
    quality = Quality(
        preset, samples=samples, gloss="sampled", lobe_samples=5, diffuse="sh9", bump_spread="none", **FLOATS
    )  # type: ignore[arg-type]
    got = renderer.render(scene, (32, 32), quality)
    want = reference.render(scene, (32, 32), quality.samples, quality=quality)
    error = np.abs(got.pixels - want.pixels)
    # Where outlines and the slopes of bumps fall on other sides of a pixel, in one or two of a hundred.
    assert np.median(error) < 1e-4
    assert np.percentile(error, 95) < 4e-3
    assert error.mean() < 3e-3
    other = reference.render(scene, (32, 32), 1, quality=replace(quality, lobe_samples=6))
    assert np.abs(got.pixels - other.pixels).mean() > 2 * error.mean()


def test_highlights_are_stretched_at_slanting_angles(renderer: Renderer) -> None:
    """A lamp over a floor: true lobes are longer along the view than across it; the chain's are round."""
    picture = np.full((64, 128, 3), 0.01, np.float32)
    picture[26:29, 63:66] = 200.0
    floor = Scene(
        [Surface(Plane((400, 400)), Material(metallic=1, roughness=0.35))],
        LatLong(picture, background=False),
        Camera(eye=(0, 1, 0), target=(0, 0.75, -1), fov=80),
    )

    def spread(gloss: str) -> float:
        quality = Quality("exact", gloss=gloss, samples=1, lobe_samples=256, suns="kept")
        light = renderer.render(floor, (128, 128), quality).pixels[..., 0].astype(np.float64)
        light[light < 0.3 * light.max()] = 0
        y, x = np.mgrid[0:128, 0:128]
        mean_x, mean_y = (light * x).sum() / light.sum(), (light * y).sum() / light.sum()
        return float((light * (y - mean_y) ** 2).sum() / (light * (x - mean_x) ** 2).sum())

    assert spread("sampled") > 1.5 * spread("chain")


# ---- roughness


@pytest.mark.parametrize("roughness", [-0.01, 1.01, float("nan"), float("inf"), -float("inf")])
def test_roughness_that_cannot_be(roughness: float) -> None:
    with pytest.raises(SceneError, match=r"material\.roughness"):
        Material(roughness=roughness)


@pytest.mark.parametrize("roughness", [1e-30, 1e-9, 1e-3])
def test_a_tiny_roughness_is_a_mirror(renderer: Renderer, roughness: float) -> None:
    scene = Scene([Surface(Sphere(), Material(metallic=1, roughness=0))], WAVES)
    rough = replace(scene, surfaces=[Surface(Sphere(), Material(metallic=1, roughness=roughness))])
    mirror, glossy = (renderer.render(s, (48, 48), Quality("exact", samples=1)).pixels for s in (scene, rough))
    assert np.isfinite(glossy).all()
    assert np.abs(mirror - glossy).max() < 2e-3


def test_the_plan_says_what_it_does() -> None:
    rough = Scene([Surface(Sphere(), Material(roughness=0.5))], WAVES)
    plan = partial(make_plan, rough, size=(64, 64), contents=Contents())
    exact = plan(quality=Quality("exact"))
    assert exact.environments[0].gloss is None
    assert exact.environments[0].filter == "trilinear"
    assert "facets" in exact.explain()
    fast = plan(quality=Quality("fast"))
    assert fast.environments[0].gloss is not None
    assert fast.environments[0].gloss.drawn
    assert "drawn, faces of 64" in fast.explain()
    mirror = make_plan(
        Scene([Surface(Sphere(), Material(roughness=0, metallic=1))], WAVES), Quality("exact"), (64, 64), Contents()
    )
    assert mirror.environments[0].filter == "bilinear"
    assert mirror.environments[0].gloss is None
