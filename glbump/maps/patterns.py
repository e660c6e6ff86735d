"""Heights that are computed: they repeat without a seam, and a seed decides what in them is chance.

Each is (H, W) float32 over the whole of 0..1, row 0 on top, for shape = (height, width) in texels: the same pattern at
every size, over one tile.
"""

from __future__ import annotations

import numpy as np

from glbump.errors import ImageError
from glbump.maps.noise import F32, fractal, smooth_step

Shape = tuple[int, int]

LARGEST = 32768
"""Most texels a side."""


def texel_uv(shape: Shape) -> tuple[F32, F32]:
    """u to the right and v up at the centres of (height, width) texels, 0..1."""
    height, width = shape
    if not (1 <= height <= LARGEST and 1 <= width <= LARGEST):
        raise ImageError(f"a pattern has 1 to {LARGEST} texels each way, (height, width); got {shape}")
    across, up = (((np.arange(n) + 0.5) / n).astype(np.float32) for n in (width, height))
    u, v = np.meshgrid(across, up[::-1])
    return u, v


def spread(height: F32) -> F32:
    """The same heights over the whole of 0..1; 0 where there is but one."""
    low, high = height.min(), height.max()
    return (height - low) / (high - low) if high > low else np.zeros_like(height)


def _first_seed(seed: int) -> int:
    """Of all that one pattern draws: none needs a hundred."""
    if seed < 0:
        raise ImageError(f"a pattern's seed is 0 or more; got {seed}")
    return 100 * seed


def _check_rows(rows: int, columns: int) -> None:
    if rows < 2 or rows % 2 or columns < 1:
        raise ImageError(
            f"every other row is half a column on, so rows are 2, 4, 6 ..., and columns at least 1; got {rows} rows, "
            f"{columns} columns"
        )


def bricks(shape: Shape = (512, 512), seed: int = 0, columns: int = 4, rows: int = 8) -> F32:
    """Old bricks in a running bond, `columns` x `rows` of them, their joints deep."""
    _check_rows(rows, columns)
    u, v = texel_uv(shape)
    s = _first_seed(seed)
    # Hand-made edges: what is straight gets a small wobble.
    wobble = np.float32(0.05)
    y = v * rows + wobble * fractal(u * 16, v * 16, 16, 3, s + 7)
    course = np.floor(y)
    x = u * columns + np.float32(0.5) * (course % 2) + wobble * np.float32(0.5) * fractal(u * 16, v * 16, 16, 3, s + 8)
    brick = (np.floor(x) % columns + columns * (course % rows)).astype(np.int32)
    across, up = x - np.floor(x) - np.float32(0.5), y - course - np.float32(0.5)

    # Distance to the joint in heights of a course, so that the rim is as wide everywhere.
    aspect = np.float32(rows / columns)
    rim = np.minimum((np.float32(0.5) - np.abs(across)) * aspect, np.float32(0.5) - np.abs(up))
    body = smooth_step(0.055, 0.17, rim)
    random = np.random.default_rng(s + 1)
    lift, tilt_x, tilt_y = random.uniform(-1, 1, (3, columns * rows)).astype(np.float32)
    face = np.float32(0.8) + np.float32(0.06) * lift[brick]
    face += np.float32(0.07) * (tilt_x[brick] * across + tilt_y[brick] * up)
    face += np.float32(0.045) * fractal(u * 16, v * 16, 16, 5, s + 21, gain=0.55)
    pits = smooth_step(0.2, 0.7, fractal(u * 32, v * 32, 32, 3, s + 31))
    face -= np.float32(0.05) * pits
    mortar = np.float32(0.12) + np.float32(0.08) * fractal(u * 32, v * 32, 32, 4, s + 41)
    return spread(mortar + (face - mortar) * body)


def dimples(shape: Shape = (512, 512), seed: int = 0, columns: int = 7, rows: int = 8, wobble: float = 0.0) -> F32:
    """Round dents in a triangular lattice, as on a golf ball.

    wobble: how far chance moves what is there, in widths of a column, as in hammered metal; 0 leaves nothing to it.
    """
    _check_rows(rows, columns)
    u, v = texel_uv(shape)
    s = _first_seed(seed)
    x, y = u * columns, v * columns
    if wobble:
        x, y = (a + np.float32(wobble) * fractal(u * 16, v * 16, 16, 2, s + i) for i, a in ((1, x), (11, y)))
    nearest = np.full(u.shape, np.inf, np.float32)
    # Rows past both edges, as far as a wobble takes the place.
    more = 1 + int(np.ceil(abs(wobble) * rows / columns))
    for row in range(-more, rows + more):
        dy = y - np.float32((row + 0.5) * columns / rows)
        dx = (x - np.float32(0.5 * (row % 2)) + np.float32(0.5)) % 1 - np.float32(0.5)
        nearest = np.minimum(nearest, dx * dx + dy * dy)
    radius = np.float32(0.44)
    inside = np.clip(1 - nearest / radius**2, 0, 1)
    # A bowl; the power rounds its lip.
    return spread(-(inside ** np.float32(1.3)))


def waves(shape: Shape = (512, 512), seed: int = 0) -> F32:
    """Wind waves on water: many sines, whole numbers of them across the tile, sharper on top than below."""
    u, v = texel_uv(shape)
    random = np.random.default_rng(_first_seed(seed) + 4)
    height: F32 = np.zeros_like(u)
    for _ in range(28):
        length = random.uniform(2, 15)
        heading = random.normal(0.5, 0.55)
        x, y = round(length * np.cos(heading)), round(length * np.sin(heading))
        phase = np.float32(2 * np.pi) * (x * u + y * v + np.float32(random.uniform()))
        height += np.exp(np.sin(phase) - 1) / np.float32(max(np.hypot(x, y), 1) ** 1.25)
    return spread(height)


def fbm(shape: Shape = (512, 512), seed: int = 0, cells: int = 4, octaves: int = 8, gain: float = 0.5) -> F32:
    """Fractal Brownian motion: noise of `cells` cells across the tile, then of twice as many `gain` times as high, and
    so on. gain 1/2 is rock that is as rough at every size; less is smoother."""
    if not (1 <= cells <= 128 and 1 <= octaves <= 16):
        raise ImageError(f"fbm has 1 to 128 cells and 1 to 16 octaves; got {cells} cells, {octaves} octaves")
    u, v = texel_uv(shape)
    return spread(fractal(u * cells, v * cells, cells, octaves, _first_seed(seed) + 1, gain))


PATTERNS = {"bricks": bricks, "dimples": dimples, "waves": waves, "fbm": fbm}
