"""The demo's environment: an evening in the mountains, computed, since the package carries no photographs.

The sky is single scattering in air, haze and ozone; the mountains are a terrain seen from a point; the ground is
a paved square with lamps round it. Everything is seeded and in linear light.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from glbump.maps.layout import latlong_dir
from glbump.maps.noise import fractal, smooth_step, value_noise

F32 = npt.NDArray[np.float32]

SUN_AZIMUTH, SUN_ELEVATION = np.radians(-128.0), np.radians(9.0)
"""Behind the default camera, to its left. Azimuth from -Z towards +X."""

SUN_RADIUS = np.radians(0.9)
SUN_RADIANCE = 2200.0
"""A wider and dimmer disc than the real one: its irradiance, 1.7 of display white, is what counts."""

EYE_HEIGHT = 1.7  # metres above the square


def direction(azimuth: float, elevation: float) -> F32:
    """Unit vector; radians, azimuth from -Z towards +X."""
    across = np.cos(elevation)
    vector = (across * np.sin(azimuth), np.sin(elevation), -across * np.cos(azimuth))
    return np.array(vector, dtype=np.float32)


def evening(height: int = 1024) -> F32:
    """The panorama: (height, 2 height, 3) float32, linear light, lat-long with its centre at -Z. A multiple of 4."""
    dirs = _directions(height)
    half = height // 2
    # Clouds have no edges: half the resolution does.
    sky = _doubled(_sky(_directions(half)[: half // 2]))
    picture = np.concatenate([sky, _ground(dirs[half:])])
    _add_sun(picture[:half], dirs[:half])
    _add_mountains(picture)
    _add_lamps(picture, dirs)
    return picture


def _directions(height: int) -> F32:
    """(height, 2 height, 3) unit vectors of the texels' centres."""
    rows, columns = np.mgrid[0:height, 0 : 2 * height] + 0.5
    return np.asarray(latlong_dir(np.stack([columns / (2 * height), rows / height], axis=-1)), np.float32)


def _doubled(picture: F32) -> F32:
    """(H, W, C) at twice the resolution, bilinear; repeats sideways, clamps above and below."""
    near, far = np.float32(0.75), np.float32(0.25)
    before, after = np.roll(picture, 1, axis=1), np.roll(picture, -1, axis=1)
    wide = np.stack([near * picture + far * before, near * picture + far * after], axis=2)
    wide = wide.reshape(picture.shape[0], -1, picture.shape[2])
    above, below = wide[[0, *range(len(wide) - 1)]], wide[[*range(1, len(wide)), -1]]
    high = np.stack([near * wide + far * above, near * wide + far * below], axis=1)
    return np.asarray(high, np.float32).reshape(-1, *wide.shape[1:])


# ------------------------------------------------------------------------------------------------------------ sky

# Scattering and absorption per metre at sea level, for red, green, blue, and the heights over which they fall.
# Sources: Nishita et al., Display of the Earth Taking into Account Atmospheric Scattering, 1993;
# Bruneton and Neyret, Precomputed Atmospheric Scattering, 2008; ozone after Hillaire, 2020.
_AIR = np.array([5.8e-6, 13.6e-6, 33.1e-6])
_HAZE = np.array([10e-6, 14e-6, 21e-6])
_OZONE = np.array([0.65e-6, 1.88e-6, 0.085e-6])
_EARTH, _TOP = 6.36e6, 6.42e6
_AIR_HEIGHT, _HAZE_HEIGHT, _HAZE_FORWARD = 8000.0, 1200.0, 0.76
_SKY_GAIN = 13.0


def _density(points: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """(..., 3): how much air, haze and ozone there is at points (..., 3), relative to its most."""
    up = np.sqrt((points**2).sum(axis=-1)) - _EARTH
    return np.stack(
        [np.exp(-up / _AIR_HEIGHT), np.exp(-up / _HAZE_HEIGHT), np.maximum(0, 1 - np.abs(up - 25e3) / 15e3)],
        axis=-1,
    )


def _extinction(depth: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """What share of light is left after these metres (..., 3) of air, haze and ozone: (..., rgb)."""
    return np.exp(-depth @ np.stack([_AIR, 1.1 * _HAZE, _OZONE]))


def _to_space(points: npt.NDArray[np.float64], dirs: npt.NDArray[np.float64], steps: int) -> npt.NDArray[np.float64]:
    """Metres of air, haze and ozone from points out of the atmosphere along dirs, by the midpoint rule."""
    b = (points * dirs).sum(axis=-1)
    reach = -b + np.sqrt(b * b - (points**2).sum(axis=-1) + _TOP**2)
    total = np.zeros(points.shape)
    for i in range(steps):
        # Shorter steps near the ground, where most of it is.
        near, far = (reach * ((i + k) / steps) ** 2 for k in (0, 1))
        middle = points + dirs * (0.5 * (near + far))[..., None]
        total += _density(middle) * (far - near)[..., None]
    return total


def _sun_tint() -> npt.NDArray[np.float64]:
    """Colour of sunlight on the ground, its brightest channel 1."""
    sun = direction(SUN_AZIMUTH, SUN_ELEVATION).astype(np.float64)
    light = _extinction(_to_space(np.array([0, _EARTH + 1.0, 0]), sun, 32))
    return np.asarray(light / light.max())


def _scattered(dirs: npt.NDArray[np.float64], steps: int = 20) -> npt.NDArray[np.float64]:
    """Sunlight scattered once into directions (..., 3) above the horizon."""
    sun = direction(SUN_AZIMUTH, SUN_ELEVATION).astype(np.float64)
    start = np.array([0, _EARTH + 1.0, 0])
    reach = -start[1] * dirs[..., 1] + np.sqrt((start[1] * dirs[..., 1]) ** 2 - start[1] ** 2 + _TOP**2)
    cosine = dirs @ sun
    air_phase = 3 / (16 * np.pi) * (1 + cosine**2)
    g = _HAZE_FORWARD
    haze_phase = (1 - g * g) / (4 * np.pi * (1 + g * g - 2 * g * cosine) ** 1.5)
    total, depth = np.zeros(dirs.shape), np.zeros(dirs.shape)
    for i in range(steps):
        near, far = (reach * ((i + k) / steps) ** 2 for k in (0, 1))
        length = (far - near)[..., None]
        point = start + dirs * (0.5 * (near + far))[..., None]
        density = _density(point)
        left = _extinction(depth + 0.5 * density * length + _to_space(point, np.broadcast_to(sun, point.shape), 8))
        total += (
            left
            * length
            * (density[..., :1] * _AIR * air_phase[..., None] + density[..., 1:2] * _HAZE * haze_phase[..., None])
        )
        depth += density * length
    return total


def _sky(dirs: F32) -> F32:
    """Radiance of sky and clouds in directions (H, W, 3) above the horizon."""
    # The sky is smooth: computed on a coarse grid, its rows closer near the horizon, and interpolated.
    azimuths, heights = 96, 40
    azimuth = (np.arange(azimuths) + 0.5) / azimuths * 2 * np.pi - np.pi
    elevation = (np.arange(heights) / (heights - 1)) ** 2 * (np.pi / 2)
    across = np.cos(elevation)[:, None]
    grid = np.stack(
        [
            across * np.sin(azimuth),
            np.broadcast_to(np.sin(elevation)[:, None], (heights, azimuths)),
            -across * np.cos(azimuth),
        ],
        axis=-1,
    )
    coarse = _scattered(grid) * _SKY_GAIN
    # Light scattered more than once: dimmer, without a direction, a little bluer.
    coarse += coarse.mean(axis=1, keepdims=True) * np.array([0.25, 0.3, 0.4])
    x = (np.arctan2(dirs[..., 0], -dirs[..., 2]) / (2 * np.pi) + 0.5) * azimuths - 0.5
    y = np.sqrt(np.arcsin(np.clip(dirs[..., 1], 0, 1)) / np.float32(np.pi / 2)) * (heights - 1)
    left, low = np.floor(x).astype(np.int32), np.minimum(y.astype(np.int32), heights - 2)
    a, b = (x - left)[..., None], (y - low)[..., None]
    texels = coarse.astype(np.float32).reshape(-1, 3)
    here, there = left % azimuths, (left + 1) % azimuths
    lower = texels.take(low * azimuths + here, axis=0) * (1 - a) + texels.take(low * azimuths + there, axis=0) * a
    low = low + 1
    upper = texels.take(low * azimuths + here, axis=0) * (1 - a) + texels.take(low * azimuths + there, axis=0) * a
    sky = lower * (1 - b) + upper * b

    cosine = dirs @ direction(SUN_AZIMUTH, SUN_ELEVATION)
    tint = _sun_tint().astype(np.float32)
    return _with_clouds(sky, dirs, cosine, tint)


def _add_sun(sky: F32, dirs: F32) -> None:
    angle = np.arccos(np.clip(dirs @ direction(SUN_AZIMUTH, SUN_ELEVATION), -1, 1))
    disc = 1 - smooth_step(0.85, 1.15, angle / np.float32(SUN_RADIUS))
    sky += disc[..., None] * (_sun_tint() * SUN_RADIANCE).astype(np.float32)


def _with_clouds(sky: F32, dirs: F32, cosine: F32, tint: F32) -> F32:
    """Bands of cloud on a flat layer, lit from the side of the sun."""
    reach = np.float32(1.1) / (dirs[..., 1] + np.float32(0.06))
    x, y = dirs[..., 0] * reach, dirs[..., 2] * reach
    warp = value_noise(x * np.float32(0.7), y * np.float32(0.7), 64, 5)
    x, y = x + warp, y * np.float32(1.6) - warp
    body = fractal(x, y, 64, 6, 11, gain=0.52)
    sun_x, _, sun_z = direction(SUN_AZIMUTH, SUN_ELEVATION) * np.float32(0.22)
    towards = fractal(x + sun_x, y + sun_z, 64, 4, 11, gain=0.52)
    cover = smooth_step(0.02, 0.42, body) * smooth_step(0.0, 0.16, dirs[..., 1])
    lit = np.clip(np.float32(0.55) + np.float32(1.3) * (body - towards), 0.12, 1.3)
    forward = np.float32(0.55) + np.float32(1.8) * np.clip(cosine, 0, 1) ** 6
    light = (lit * forward)[..., None] * (tint * np.float32(1.15)) + sky * np.float32(0.5)
    amount = (cover * np.float32(0.88))[..., None]
    return sky * (1 - amount) + light * amount


# ------------------------------------------------------------------------------------------------ mountains, ground

_GREEN = np.array([0.135, 0.135, 0.051], np.float32)
_ROCK = np.array([0.16, 0.14, 0.13], np.float32)
_SNOW = np.array([0.85, 0.87, 0.92], np.float32)
_AIR_LIGHT = np.array([0.46, 0.44, 0.52], np.float32)  # radiance of so much air that nothing is seen through it
_SUNLIGHT = 2.6  # irradiance of what faces the sun, in its strongest channel
_FROM_WHITE = np.float32(1.6 / np.pi)  # radiance per irradiance of white; 1.6 for what the ground lights itself
_SKYLIGHT = np.array([0.50, 0.56, 0.72], np.float32)


def _terrain(x: F32, z: F32) -> F32:
    """Metres above the square at (x, z) in kilometres."""
    distance = np.hypot(x, z)
    ridges = fractal(x * np.float32(0.17) + 40, z * np.float32(0.17) + 40, 128, 7, 29, gain=0.45, ridged=True)
    hills = fractal(x * np.float32(0.6), z * np.float32(0.6), 128, 5, 51)
    # A valley towards the sun, or it would have set.
    sun_x, _, sun_z = direction(SUN_AZIMUTH, 0)
    valley = smooth_step(0.80, 0.985, (x * sun_x + z * sun_z) / distance)
    rise = smooth_step(2.5, 11, distance) * (1 - np.float32(0.8) * valley)
    return rise * (np.float32(900) + np.float32(2300) * ridges) + smooth_step(0.5, 3, distance) * (60 + 150 * hills)


def _add_mountains(picture: F32) -> None:
    """Terrain over sky: each column of the picture marches outwards and fills what rises above all before it."""
    height, width = picture.shape[:2]
    azimuth = ((np.arange(width) + 0.5) / width - 0.5) * (2 * np.pi)
    distance = np.geomspace(0.6, 30, 280).astype(np.float32)
    x = np.sin(azimuth).astype(np.float32)[:, None] * distance
    z = -np.cos(azimuth).astype(np.float32)[:, None] * distance
    ground = _terrain(x, z)
    shade = _lit_terrain(ground, azimuth.astype(np.float32), distance, x, z)

    tangent = (ground * np.float32(1e-3)) / distance
    highest = np.maximum.accumulate(tangent, axis=1)
    every = np.arange(width)
    edge = np.pi / height
    for row in range(height // 2 - height // 6, height // 2 + height // 64):
        # The skyline by how much of the texel lies below it, what is in front by two samples.
        middle = np.tan(0.5 * np.pi - (row + 0.5) * edge)
        cover = np.clip((highest[:, -1] - middle) / edge + 0.5, 0, 1).astype(np.float32)[:, None]
        if not cover.any():
            continue
        seen = np.zeros((width, 3), np.float32)
        for part in (0.25, 0.75):
            level = np.float32(np.tan(0.5 * np.pi - (row + part) * edge))
            first = np.clip((highest < level).sum(axis=1), 1, distance.size - 1)
            nearer, farther = highest[every, first - 1], highest[every, first]
            along = np.clip((level - nearer) / np.maximum(farther - nearer, 1e-6), 0, 1)[:, None]
            seen += np.float32(0.5) * (shade[every, first - 1] * (1 - along) + shade[every, first] * along)
        picture[row] += cover * (seen - picture[row])


def _lit_terrain(ground: F32, azimuth: F32, distance: F32, x: F32, z: F32) -> F32:
    """Radiance of the terrain (columns, distances, 3): sunlight, skylight and the air between."""
    metres = distance * np.float32(1000)
    along = np.gradient(ground, metres, axis=1)
    padded = np.concatenate([ground[-1:], ground, ground[:1]])
    across = (padded[2:] - padded[:-2]) / (2 * (azimuth[1] - azimuth[0]) * metres)
    sine, cosine = np.sin(azimuth)[:, None], np.cos(azimuth)[:, None]
    # Gradient in world axes: outwards is (sin, -cos), along growing azimuth (cos, sin).
    slope_x, slope_z = along * sine + across * cosine, -along * cosine + across * sine
    up = 1 / np.sqrt(1 + slope_x**2 + slope_z**2)
    sun = direction(SUN_AZIMUTH, SUN_ELEVATION)
    facing = np.clip((sun[1] - slope_x * sun[0] - slope_z * sun[2]) * up, 0, 1)[..., None]

    patches = fractal(x * np.float32(1.7), z * np.float32(1.7), 128, 3, 77)
    snow = smooth_step(1150, 1750, ground + 320 * patches) * smooth_step(0.5, 0.72, up)
    grass = 1 - smooth_step(350, 950, ground + 260 * patches)
    albedo = _ROCK * (1 + np.float32(0.35) * patches[..., None])
    albedo = albedo + (_GREEN * (1 + np.float32(0.5) * patches[..., None]) - albedo) * grass[..., None]
    albedo = albedo + (_SNOW - albedo) * snow[..., None]

    tint = _sun_tint().astype(np.float32)
    light = facing * (tint * np.float32(_SUNLIGHT)) + (0.5 + 0.5 * up)[..., None] * _SKYLIGHT
    left = np.exp(-distance[:, None] * np.array([0.012, 0.017, 0.027], np.float32))
    return albedo * light * _FROM_WHITE * left + _AIR_LIGHT * (1 - left)


def _ground(dirs: F32) -> F32:
    """The square's pavement, then grass, in directions (H, W, 3) below the horizon."""
    reach = np.float32(EYE_HEIGHT) / -dirs[..., 1]
    x, z = dirs[..., 0] * reach, dirs[..., 2] * reach
    distance = reach[:, 0] * np.hypot(dirs[:, 0, 0], dirs[:, 0, 2])  # the same along a row
    # Width of a texel on the ground: patterns finer than that are averaged, not sampled.
    texel = np.float32(np.pi / (2 * dirs.shape[0])) * reach * np.hypot(1, distance / EYE_HEIGHT)[:, None]

    edge = 1 - smooth_step(9.0, 9.25, distance)
    near, far = edge > 0, edge < 1
    albedo = np.zeros_like(dirs)
    albedo[far] = _grass(x[far], z[far], texel[far])
    paved = edge[near, None, None]
    albedo[near] = albedo[near] * (1 - paved) + _pavement(x[near], z[near], texel[near]) * paved

    light = _sun_tint().astype(np.float32) * np.float32(_SUNLIGHT * np.sin(SUN_ELEVATION)) + _SKYLIGHT
    left = np.exp(-distance * np.float32(1.5e-5))[:, None, None]
    return albedo * light * _FROM_WHITE * left + _AIR_LIGHT * (1 - left)


def _grass(x: F32, z: F32, texel: F32) -> F32:
    """Albedo."""
    tufts = fractal(x * np.float32(0.6), z * np.float32(0.6), 256, 5, 91) / (1 + texel)
    return _GREEN * (1 + np.float32(0.8) * tufts[..., None])


def _pavement(x: F32, z: F32, texel: F32) -> F32:
    """Albedo of slabs of two stones and their joints; edges are as wide as a texel, texel (H, W) in metres."""
    size = np.float32(0.9)
    width = np.maximum(texel / size, np.float32(1e-3))

    def joint(t: F32) -> F32:
        """How much of a texel the joint takes, t being in slabs."""
        half = np.float32(0.016)
        near = np.abs(t - np.round(t))
        return np.clip((half - near) / width + np.float32(0.5), 0, np.minimum(2 * half / width, 1))

    def alternate(t: F32) -> F32:
        """-1 and 1 by turns."""
        wave = 2 * np.abs((t + np.float32(0.5)) % 2 - 1) - 1
        return np.clip(wave / width, -1, 1)

    s, t = x / size + np.float32(0.5), z / size + np.float32(0.5)
    near = np.clip(np.float32(1.3) - width, 0, 1)
    checker = np.float32(0.5) + np.float32(0.5) * alternate(s) * alternate(t) * near
    each = value_noise(np.floor(s), np.floor(t), 64, 3) * np.float32(0.18) * near
    grain = fractal(x * 5, z * 5, 256, 3, 17) * np.float32(0.1) * near
    light, dark = np.array([0.52, 0.47, 0.40], np.float32), np.array([0.16, 0.13, 0.12], np.float32)
    stone = (dark + (light - dark) * checker[..., None]) * (1 + each + grain)[..., None]
    return stone * (1 - np.float32(0.75) * np.maximum(joint(s), joint(t))[..., None])


# ----------------------------------------------------------------------------------------------------------- lamps

# Azimuth and elevation of each lamp, degrees; its radius, degrees; its colour times its radiance.
_LAMPS = (
    (-165.0, 15.0, 1.15, (75, 40, 14)),
    (-88.0, 15.0, 1.15, (75, 40, 14)),
    (-38.0, 15.0, 1.15, (75, 40, 14)),
    (38.0, 15.0, 1.15, (75, 40, 14)),
    (88.0, 15.0, 1.15, (75, 40, 14)),
    (165.0, 15.0, 1.15, (75, 40, 14)),
    (112.0, 12.0, 1.4, (50, 4.0, 5.0)),
    (123.0, 10.6, 1.4, (5.0, 28, 38)),
    (134.0, 10.2, 1.4, (44, 28, 3.0)),
    (145.0, 11.1, 1.4, (6.0, 38, 8.0)),
)
GLOW_REACH = 14.0  # degrees
_POST = np.array([0.012, 0.012, 0.014], np.float32)


def _add_lamps(picture: F32, dirs: F32) -> None:
    """Round lamps on dark posts; four of them coloured."""
    height, width = picture.shape[:2]
    pixel = np.float32(np.pi / height)
    reach = round(height * GLOW_REACH / 180)
    foot = round(height * (0.5 + np.degrees(np.arctan(EYE_HEIGHT / 8.6)) / 180))
    for degrees, up, radius, colour in _LAMPS:
        row, column = round(height * (0.5 - up / 180)), round(width * (0.5 + degrees / 360))
        size = np.float32(np.radians(radius))
        beside = np.abs(np.arange(width) + 0.5 - column) * pixel
        post = np.clip((np.radians(0.4) - beside) / pixel + 0.5, 0, 1)[:, None].astype(np.float32)
        picture[row:foot] += post * (_POST - picture[row:foot])
        window = np.s_[row - reach : row + reach, column - reach : column + reach]
        angle = np.arccos(np.clip(dirs[window] @ direction(np.radians(degrees), np.radians(up)), -1, 1))
        disc = np.clip((size - angle) / pixel + np.float32(0.5), 0, 1)
        # Brighter in the middle, with a glow in the haze around it that ends within the window.
        bright = disc * (np.float32(0.4) + np.float32(0.6) * np.cos(np.minimum(angle / size, 1) * (np.pi / 2)))
        fall = np.maximum(1 - angle / np.float32(np.radians(GLOW_REACH)), 0)
        glow = np.float32(0.006) * fall**6
        picture[window] *= 1 - disc[..., None]
        picture[window] += (bright + glow)[..., None].astype(np.float32) * np.array(colour, np.float32)
