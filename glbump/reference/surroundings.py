"""What surfaces mirror and what lies behind them, in float64: environments looked up as environment_input.glsl does."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
import numpy.typing as npt

from glbump.contents import Contents
from glbump.environment import BoxBounds, Environment, Pictured, Procedural
from glbump.maps.layout import EnvironmentMap, sample
from glbump.maps.levels import environment_levels, fitting_pyramid
from glbump.maps.light_formats import Fit
from glbump.quality import Quality
from glbump.reference import filter as filters
from glbump.reference import parallax
from glbump.reference import spread as spreads
from glbump.reference.computed import is_averaged, radiance
from glbump.reference.direction import axes_across
from glbump.reference.varied import Varied

F64 = npt.NDArray[np.float64]
F32 = npt.NDArray[np.float32]
_LookUp = Callable[[F64, F64, F64], F64]


def _picture(picture: EnvironmentMap, stored: Fit, quality: Quality, below: object) -> Callable[[F64, F64, F64], F64]:
    """Light (K, 3) of a picture, stored so, in directions (K, 3) that change by ddx and ddy (K, 3) across a sample."""
    how = quality.environment_filter
    level_of = {"area": filters.direction_level, "longest": filters.longest_level}[quality.environment_level]
    levels = [picture.pixels] if how == "bilinear" else _levels(picture, stored, quality.pyramid)
    chain = [replace(picture, pixels=stored.as_read(pixels)) for pixels in levels]

    def look_along(dir_env: F64, ddx: F64, ddy: F64) -> F64:
        major, minor = filters.footprint_axes(ddx, ddy)
        taps = filters.footprint_taps(major, minor, picture.texels_per_radian, quality.anisotropy)[:, None]
        step, light = major / taps, np.zeros_like(dir_env)
        for i in range(int(taps.max(initial=0))):
            some = np.flatnonzero(i < taps[:, 0])
            moved = dir_env[some] + (i + 0.5 - 0.5 * taps[some]) * step[some]
            moved /= np.linalg.norm(moved, axis=-1, keepdims=True)
            light[some] += look_up(moved, step[some], minor[some]) / taps[some]
        return light

    def look_up(dir_env: F64, ddx: F64, ddy: F64) -> F64:
        light = filters.through_levels(
            lambda i, chosen: sample(chain[i], dir_env[chosen]),
            level_of(ddx, ddy, picture.texels_per_radian),
            len(chain),
            how,
        )
        if picture.layout.whole or not isinstance(below, tuple):
            return light
        share = filters.share_above(dir_env[:, 1], ddx[:, 1], ddy[:, 1])[:, None]
        return share * light + (1 - share) * np.array(below)

    return look_along if quality.anisotropy > 1 and how != "bilinear" else look_up


def _levels(picture: EnvironmentMap, stored: Fit, wanted: str) -> list[F32]:
    how, _ = fitting_pyramid(
        wanted,
        picture.layout,
        float(np.abs(picture.pixels).max()),
        own_grid=picture.has_own_grid,
        is_light=stored.format.signed,
    )
    return environment_levels(picture, how)


class Surroundings:
    """One environment, and its light."""

    def __init__(self, environment: Environment, quality: Quality, contents: Contents, samples: int) -> None:
        self.environment = environment
        self.footprint = samples**-0.5
        self.exposure = 2.0**environment.exposure
        self.stored = contents.light_format(environment, quality.texture_format)
        self.env_from_world = environment.env_from_world()
        how = quality.environment_filter
        self.has_footprint = how != "bilinear"
        self.texels_per_radian: float | None = None
        self.look_up_averaged: _LookUp | None = None
        if isinstance(environment, Procedural):
            self.has_footprint = is_averaged(how, samples)
            self.look_up: _LookUp = partial(radiance, environment)
        else:
            picture, below = contents.environment(environment), getattr(environment, "below", None)
            self.look_up = _picture(picture, self.stored, quality, below)
            self.texels_per_radian = picture.texels_per_radian
            if quality.gloss == "sampled" and how == "bilinear":
                averaged = replace(quality, environment_filter="trilinear")
                self.look_up_averaged = _picture(picture, self.stored, averaged, below)

    def seen_from(self, p_world: Varied, look: Varied) -> Varied:
        """seen_at, with its changes across a sample over its size; look: in the environment's frame."""
        if not isinstance(self.environment, Pictured) or self.environment.bounds is None:
            return look
        seen = self.seen_at(p_world.at, look.at)
        changed = (
            self.seen_at(p_world.at + dp * self.footprint, look.at + d * self.footprint) - seen
            for dp, d in zip(p_world[1:], look[1:], strict=True)
        )
        return Varied(seen, *(change / self.footprint for change in changed))

    def seen_at(self, p_world: F64, dir_env: F64) -> F64:
        """Unit directions (K, 3), from where the environment was taken, of what is seen from points (K, 3)."""
        if not isinstance(self.environment, Pictured) or self.environment.bounds is None:
            return dir_env
        room, position = self.environment.bounds, np.asarray(self.environment.position)
        p = (p_world - position) @ self.env_from_world.T
        if isinstance(room, BoxBounds):
            return parallax.box_parallax(p, dir_env, np.subtract(room.low, position), np.subtract(room.high, position))
        centre = self.env_from_world @ np.subtract(room.centre, position)
        return parallax.sphere_parallax(p, dir_env, centre, room.radius)

    def light(self, look: Varied, around: Varied | None = None, *, tapped: bool = False) -> F64:
        """Radiance (K, 3) in unit directions, or about them, with the spread that `around` has. tapped: by more than
        one look-up, where a picture is looked up."""
        size = self.footprint if self.has_footprint else 0.0
        dir_env, ddx, ddy = look.at, look.dx * size, look.dy * size
        if around is None:
            return self.exposure * self.look_up(dir_env, ddx, ddy)
        # Levels average over a variance of 1/4 of their texels' squares, what is computed over 1/12 of a footprint's.
        side = 12**0.5 if self.texels_per_radian is None else 2.0
        longer, shorter, squares = spreads.widened_footprint(dir_env, ddx, ddy, side * around.dx, side * around.dy)
        if self.texels_per_radian is None or not tapped:
            axes = (np.sqrt(squares[:, i : i + 1]) * axis for i, axis in enumerate((longer, shorter)))
            return self.exposure * self.look_up(dir_env, *axes)
        apart, tap = np.split(spreads.spread_taps(squares, self.texels_per_radian), 2, axis=-1)
        places = np.arange(spreads.SPREAD_TAPS) - (spreads.SPREAD_TAPS - 1) / 2
        looks = [self.look_up(dir_env + i * apart * longer, tap * longer, tap * shorter) for i in places]
        result: F64 = self.exposure * np.mean(looks, axis=0)
        return result

    def averaged(self, dir_env: F64, angle: F64) -> F64:
        """Radiance (K, 3) in unit directions, each the mean over a solid angle (K,)."""
        side = np.sqrt(angle)[:, None]
        look_up = self.look_up_averaged or self.look_up
        return self.exposure * look_up(dir_env, *(side * axis for axis in axes_across(dir_env)))
