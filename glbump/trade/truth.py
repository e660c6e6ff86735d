"""What the pictures of a scene are measured against, and how far it may itself be off."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from glbump.contents import Contents
from glbump.environment import Sky
from glbump.gl.renderer import Renderer
from glbump.quality import Quality
from glbump.reference.shade import SEVERAL
from glbump.reference.shade import render as reference
from glbump.scene import Material, Scene
from glbump.trade.errors import Bounds, mean_squares, rmse_bounds

F32 = npt.NDArray[np.float32]
Mask = npt.NDArray[np.bool_]
Region = tuple[int, int, int, int]

REFERENCE, DRIVER = "reference", "driver"
TILE = 16
"""Pixels along a tile of those that a driver's truth is checked on."""
LEAST_TILES, MOST_TILES = 8, 64
_TRIED = 1 << 13
"""Rays that the time of all is reckoned from."""
MOST_PIXELS = 1 << 21
"""Of pictures that the reference casts whole: it takes 100 bytes a pixel, and minutes of more."""
UNSURE = 0.25 / 255
"""A truth that may itself be off by more is said not to have converged."""


@dataclass(frozen=True)
class Truth:
    """A scene's true picture.

    pixels: (H, W, 4) linear. source: REFERENCE, float64; or DRIVER, drawn by the driver at "exact" with as many
    samples and checked on tiles. samples: a pixel. noise: RMSE, display-referred, that it may be off by for want of
    samples, from two halves of them. several: (H, W) where samples see several surfaces. normals: (H, W, 4) bent unit
    normals in the world, in the middle of each pixel, and 1; 0 where nothing is seen; None, as several, of more than
    MOST_PIXELS. checked: a driver's RMSE to the
    reference, with its bounds, from `tiles` tiles. notes: what is to be known of it, in sentences.
    """

    pixels: F32
    source: str
    samples: int
    noise: float
    several: Mask | None
    normals: F32 | None
    checked: Bounds | None = None
    tiles: int = 0
    notes: tuple[str, ...] = ()


def find_truth(
    scene: Scene,
    size: tuple[int, int],
    samples: int,
    renderer: Renderer,
    *,
    seconds: float = 60.0,
    step: Callable[[], None] = lambda: None,
) -> Truth:
    """The truth of a scene at `size`: the float64 reference, or, where that would take more than `seconds`, the
    driver's own "exact" with as many samples, checked against the reference on tiles of the picture.

    step: called now and then. Raises what `Renderer.render` and `reference.render` raise.
    """
    contents = renderer.contents
    expected = _seconds_a_ray(scene, size, contents) * size[0] * size[1] * samples
    several, normals, said = None, None, []
    if size[0] * size[1] <= MOST_PIXELS:
        several = _several(scene, size, contents)
        normals = reference(scene, size, 1, contents=contents, show="normal").pixels
    else:
        said = [f"silhouettes and normals are looked for in up to {MOST_PIXELS:,} pixels, not {size[0]}x{size[1]}"]
    step()
    if expected <= seconds and several is not None:
        frame = reference(scene, size, samples, contents=contents)
        noise = _noise([frame.stats["halves"]])
        return Truth(frame.pixels, REFERENCE, samples, noise, several, normals, notes=(*said, *_said(noise, samples)))
    pixels = renderer.render(scene, size, Quality("exact", samples=samples)).pixels
    step()
    squares, halves = _checked(scene, size, samples, contents, pixels, seconds, step)
    noise, checked = _noise(halves), rmse_bounds(squares)
    why = (
        f"the float64 reference of {size[0]}x{size[1]} pixels and {samples} samples would take some {expected:.0f} s; "
        f"the truth is drawn by this driver at exact, {samples} samples a pixel. Beside the reference on "
        f"{len(squares)} tiles of the picture its RMSE is {255 * checked.value:.3g}/255, at most "
        f"{255 * checked.high:.3g}/255 at 95 %; settings nearer than that cannot be told apart"
    )
    notes = (why, *said, *_said(noise, samples))
    return Truth(pixels, DRIVER, samples, noise, several, normals, checked, len(squares), notes)


def _seconds_a_ray(scene: Scene, size: tuple[int, int], contents: Contents) -> float:
    """Of the reference, from one sample a pixel of the picture's middle; the second time, when maps are read."""
    width, height = size
    rows = min(height, max(2, _TRIED // width // 2 * 2))
    below = (height - rows) // 2 // 2 * 2
    region = (0, height - below - rows, width, rows) if rows < height else None
    reference(scene, (min(width, 4), min(height, 4)), 1, contents=contents)
    started = time.perf_counter()
    reference(scene, size, 1, contents=contents, region=region)
    return (time.perf_counter() - started) / (width * rows)


def _several(scene: Scene, size: tuple[int, int], contents: Contents) -> Mask:
    """Where samples see several surfaces, of which light and bumps are no part."""
    plain = Material(metallic=1, roughness=0)
    bare = [replace(s, bump=None, material=plain, environment=None) for s in scene.surfaces]
    samples = 16 if size[0] * size[1] <= 1 << 17 else 4
    frame = reference(replace(scene, surfaces=bare, environment=Sky()), size, samples, contents=contents)
    several: Mask = frame.stats["surface"] == SEVERAL
    return several


def _checked(
    scene: Scene,
    size: tuple[int, int],
    samples: int,
    contents: Contents,
    pixels: F32,
    seconds: float,
    step: Callable[[], None],
) -> tuple[list[float], list[F32]]:
    """The mean square differences of `pixels` from the reference on tiles, as many as `seconds` allow; the halves of
    the reference's samples there."""
    squares: list[float] = []
    halves: list[F32] = []
    until = time.perf_counter() + seconds
    for left, top, width, height in tiles(size, MOST_TILES):
        if len(squares) >= LEAST_TILES and time.perf_counter() > until:
            break
        frame = reference(scene, size, samples, contents=contents, region=(left, top, width, height))
        squares.append(mean_squares(pixels[top : top + height, left : left + width], frame.pixels))
        halves.append(frame.stats["halves"])
        step()
    return squares, halves


def tiles(size: tuple[int, int], count: int, seed: int = 1) -> list[Region]:
    """`count` regions of TILE pixels, or fewer where the picture holds fewer: one at a place of chance in each of as
    many parts of it, in an order of chance, so that the first of them are spread as well."""
    width, height = size
    side = max(2, min(TILE, min(width, height) // 8 * 2))
    across = max(1, min(round((count * width / height) ** 0.5), width // side))
    down = max(1, min(count // across, height // side))
    chance = np.random.default_rng(seed)
    places = []
    for row in range(down):
        for column in range(across):
            # Quads are counted from the lower left corner.
            left = _place(column * width // across, (column + 1) * width // across, side, chance)
            below = _place(row * height // down, (row + 1) * height // down, side, chance)
            places.append((left, height - below - side, side, side))
    return [places[i] for i in chance.permutation(len(places))]


def _place(low: int, high: int, side: int, chance: np.random.Generator) -> int:
    """An even number from which `side` pixels stay below `high`, from `low` on."""
    first, last = (low + 1) // 2, (high - side) // 2
    return 2 * int(chance.integers(first, last + 1)) if last >= first else low // 2 * 2


def _noise(halves: list[F32]) -> float:
    """Half the RMSE between the two halves of the samples, over all that were drawn."""
    squares = [mean_squares(pair[0], pair[1]) for pair in halves if len(pair) == 2]
    return float(np.sqrt(np.mean(squares)) / 2) if squares else float("nan")


def _said(noise: float, samples: int) -> tuple[str, ...]:
    if noise <= UNSURE:
        return ()
    return (
        f"the reference has not converged at {samples} samples a pixel: its two halves differ so much that it may be "
        f"off by {255 * noise:.2g}/255 RMSE, and settings nearer than that cannot be told apart; take more samples",
    )
