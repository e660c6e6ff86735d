"""The demo's heights and normals: pictures that repeat, computed. Heights are 0..1, rows from the top."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from glbump.maps import patterns
from glbump.maps.heights import slopes
from glbump.maps.noise import F32, fractal
from glbump.maps.patterns import spread, texel_uv


def bricks(size: int = 512) -> F32:
    """Old bricks in a running bond."""
    return patterns.bricks((size, size))


def dimples(size: int = 512) -> F32:
    """Round dents in a triangular lattice, as on a golf ball."""
    return patterns.dimples((size, size))


def coarse(size: int = 12) -> F32:
    """Smooth waves, known at so few places that it shows what is made of them."""
    u, v = (np.float32(2 * np.pi) * at for at in texel_uv((size, size)))
    return spread(np.sin(u) + np.sin(v) + np.float32(0.5) * np.sin(2 * u + v))


def waves(size: int = 512) -> F32:
    """Wind waves on water."""
    return patterns.waves((size, size))


def stone(size: int = 512) -> F32:
    """Weathered rock: creases and grains of all sizes."""
    u, v = texel_uv((size, size))
    bend = np.float32(0.35)
    x = u * 4 + bend * fractal(u * 4, v * 4, 4, 4, 61)
    y = v * 4 + bend * fractal(u * 4, v * 4, 4, 4, 62)
    return spread(
        fractal(x, y, 4, 7, 63, gain=0.5, ridged=True) + np.float32(0.5) * fractal(u * 8, v * 8, 8, 6, 71, gain=0.55)
    )


def weave(size: int = 512, threads: int = 12) -> F32:
    """Plain weave: `threads` each way, every one over and under its neighbours. An even number."""
    u, v = texel_uv((size, size))
    x, y = u * threads, v * threads

    def strand(across: F32, along: F32) -> F32:
        """Height of threads that lie side by side along `across` and run along `along`."""
        index = np.floor(across)
        offset = 2 * (across - index) - 1
        round_top = np.sqrt(np.maximum(1 - (offset * np.float32(1.06)) ** 2, 0))
        swing = np.cos(np.float32(np.pi) * (along - np.float32(0.5) + index))
        return round_top * np.float32(0.55) + np.float32(0.45) * swing

    twist = np.float32(0.03)
    first = strand(x, y) + twist * np.sin(np.float32(2 * np.pi) * (3 * y + x))
    second = strand(y, x + 1) + twist * np.sin(np.float32(2 * np.pi) * (3 * x + y))
    return spread(np.maximum(first, second))


def quilt(size: int = 512, diamonds: int = 3) -> F32:
    """Padded leather, stitched in diamonds, with a button where the seams cross."""
    u, v = texel_uv((size, size))
    a, b = np.float32(np.pi * diamonds) * (u + v), np.float32(np.pi * diamonds) * (u - v)
    padding = (np.abs(np.sin(a)) * np.abs(np.sin(b))) ** np.float32(0.42)
    # Distance to the nearest crossing, in widths of a diamond.
    turn = np.float32(1 / np.pi)
    da, db = a * turn - np.round(a * turn), b * turn - np.round(b * turn)
    reach = np.sqrt((da * da + db * db) * np.float32(0.5))
    button = np.sqrt(np.clip(1 - (reach / np.float32(0.085)) ** 2, 0, 1))
    dent = np.exp(-((reach / np.float32(0.16)) ** 2))
    grain = np.float32(0.003) * fractal(u * 48, v * 48, 48, 3, 81)
    return spread(padding * (1 - np.float32(0.5) * dent) + np.float32(0.5) * button + grain)


def normals(height: F32, depth: float) -> npt.NDArray[np.uint8]:
    """Heights as a tangent-space normal map: (H, W, 3) bytes, +Y, 128 is 0.

    depth: the length of the full range of heights, in widths of the tile.
    """
    slope = slopes(height) * np.float32(depth)
    vectors = np.concatenate([-slope, np.ones_like(slope[..., :1])], axis=-1)
    vectors /= np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.round(128 + 127 * vectors).astype(np.uint8)
