"""What the texels of levels hold beside a pole: one direction that many texels share.

Poles are a lat-long picture's first and last row, and the rim of a disc that shows the whole sphere (+Z of an angular
map, -Z of a mirror ball). Solid angles vanish there, so that a texel's mean is that of its outer part: of 2/3 of a
texel off, where a look-up takes it for 1/2. Off on both sides, it makes a step across the pole, which is mended by
drawing texels towards the pole's own light. All light together stays, so does a constant, and no texel goes beyond what
its neighbours hold.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from glbump.maps.layout import Layout, beside_rim, texel_dirs

F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]

LAST_ROW = 7 / 15
"""What is left of how a lat-long level's last row differs from its mean.

Of light that changes evenly, the row's means are those of 2/3 of a texel from the pole, the next row's of 14/9. Beyond
its middle a texture repeats the row, so what it holds changes twice across half a texel, and what it differs from the
next row by across a whole one. These steps are alike where the row holds what is 1/5 of 14/9 off, which is 7/15 of 2/3.
"""


def rows_at_poles(pixels: npt.NDArray[np.floating]) -> F32:
    """A level's means (1, H, W, C) of a lat-long picture, with a first and a last row that texture look-ups read
    without more of a step across the pole than beside it."""
    result = np.array(pixels, np.float32)
    if pixels.shape[1] > 1:
        for row in (0, -1):
            result[0, row] = _drawn(pixels[0, row], np.full(pixels.shape[2], LAST_ROW), np.ones(pixels.shape[2]))
    return result


def texels_at_rim(level: F64, layout: Layout, steradians: F64, centroids: F64) -> F32:
    """A level (1, n, n, 3) of a disc whose rim is one direction, where each texel less than one from the rim holds what
    light that changes evenly has in the texel's middle.

    steradians (1, n, n): of the texels. centroids (1, n, n, 3): means of the unit direction, by the level's weights.
    """
    result, size = level.astype(np.float32), level.shape[1]
    at = beside_rim(size)
    # Across the axis, Z: what is even about it needs no mending.
    middle, centroid = texel_dirs(layout, (size, size))[0, at, :2], centroids[0, at, :2]
    along, square = (middle * centroid).sum(axis=-1), (centroid * centroid).sum(axis=-1)
    share = np.clip(np.divide(along, square, out=np.zeros_like(along), where=square > 0), 0.0, 1.0)
    result[0, at] = _drawn(level[0, at], share, steradians[0, at])
    return result


def _drawn(texels: npt.NDArray[np.floating], share: F64, steradians: F64) -> F64:
    """Texels (K, C) of which a share (K,) is left of what they differ from the pole, whose light is what they lose."""
    lost = steradians * (1 - share)
    light = lost @ texels.astype(np.float64)
    pole = np.divide(light, lost.sum(), out=np.zeros_like(light), where=lost.sum() > 0)
    result: F64 = pole + share[:, None] * (texels - pole)
    return result
