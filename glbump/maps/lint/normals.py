"""Checks of tangent-space normal maps."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from glbump.maps.colour import linear_from_srgb
from glbump.maps.gradients import KERNELS, differences
from glbump.maps.images import NORMAL_BEHIND, NORMAL_LENGTH_ERROR, length_error, unit_range, vectors_of
from glbump.maps.lint.finding import DOUBTFUL, NOTE, WRONG, Finding
from glbump.maps.lint.tags import Tags
from glbump.maps.lint.values import alpha, data_tags, not_finite, not_tiling, too_large
from glbump.maps.stored import Stored, count_and_first

F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]

NOT_UNIT = 0.1
"""Mean distance of lengths from 1 past which normals are not normalised. 8 bits leave 0.004, lossy files 0.09."""

TILTED, TILTED_FAR = 2.0, 8.0
"""Degrees that the mean slope of a map may lean: of what repeats 0, and 8 bits leave 0.3; real maps: up to 7."""

INVERTED = -0.2
"""Correlation of the two mixed second derivatives below which green is inverted; of heights it is 1, of noise 0."""

STEEPEST = 10.0
"""Slopes past this are left out of the sum over the curl: a normal on its side tells rounding, not heights."""

ENCODED_FLAT = (160, 210)
"""Of 255: where flat (128) lies once it is sRGB-encoded (188), with room for maps that lean."""


def check_normals(stored: Stored, tags: Tags) -> list[Finding]:
    """All that is found in a picture that is to be a normal map."""
    raw = unit_range(stored.pixels, stored)
    bad = not_finite(raw) or too_large(raw)
    if bad:
        return bad
    vectors = vectors_of(stored).pixels
    grey = no_normals(vectors)
    if grey:
        return grey
    encoded = srgb_encoded(raw[:, :, list(stored.colours())])
    if encoded:
        # All else follows from it.
        return [*encoded, *alpha(stored, is_read=False)]
    return [
        *not_unit(vectors),
        *behind(vectors),
        *tilted(vectors),
        *inverted_green(vectors),
        *alpha(stored, is_read=False),
        *data_tags(tags, "normals"),
        *not_tiling(vectors),
    ]


def no_normals(vectors: F32) -> list[Finding]:
    x, y, z = np.moveaxis(vectors, -1, 0)
    if not (np.array_equal(x, y) and np.array_equal(y, z)):
        return []
    why = "all three channels are equal"
    return [Finding("a grey picture is no normal map", why, "if it holds heights, use bump.height", WRONG)]


def srgb_encoded(raw: F32) -> list[Finding]:
    """Values (H, W, 3) in 0..1 whose middle is not at one half, but is once the sRGB curve is taken away."""
    if raw.min() < 0 or raw.max() > 1:
        return []
    low, high = (bound / 255 for bound in ENCODED_FLAT)
    red, green = (float(raw[..., i].mean(dtype=np.float64)) for i in (0, 1))
    if not (low < red < high and low < green < high):
        return []
    decoded = 2 * linear_from_srgb(raw) - 1
    as_is, then = length_error(2 * raw - 1), length_error(decoded)
    if then >= as_is:
        return []
    return [
        Finding(
            "sRGB-encoded normals",
            f"red and green are {255 * red:.0f} and {255 * green:.0f} of 255 on average, where flat is 128 and encoded "
            f"188; lengths are off 1 by {as_is:.3g}, decoded by {then:.3g}",
            "save the map as linear data, without colour management",
            WRONG,
        )
    ]


def not_unit(vectors: F32) -> list[Finding]:
    off = length_error(vectors)
    if off <= NOT_UNIT:
        return []
    shortest = float(np.sqrt(np.einsum("...i,...i", vectors, vectors)).min())
    return [
        Finding(
            "normals not of length 1",
            f"lengths are off 1 by {off:.3g} on average, the shortest is {shortest:.3g}",
            "normalise the map; averaging or resizing shortens normals, and so does lossy compression",
            WRONG if off > NORMAL_LENGTH_ERROR else DOUBTFUL,
        )
    ]


def behind(vectors: F32) -> list[Finding]:
    """Normals that point into the surface: they have no slope."""
    bad = vectors[..., 2] <= 0
    if not bad.any():
        return []
    share = float(bad.mean())
    likely = "; so many make it an object-space map, or a photograph" if share > NORMAL_BEHIND else ""
    why = f"{count_and_first(bad)} have z <= 0{likely}"
    return [Finding("normals that point into the surface", why, "give a tangent-space map; mend these texels", WRONG)]


def _slopes(vectors: F32) -> tuple[F64, F64]:
    """dh/du and dh/dv (v up) per unit of length, 0 where a normal has none or one past STEEPEST."""
    x, y, z = np.moveaxis(vectors.astype(np.float64), -1, 0)
    good = (z > 0) & (np.maximum(np.abs(x), np.abs(y)) <= STEEPEST * z)
    z = np.where(good, z, 1.0)
    return np.where(good, -x / z, 0.0), np.where(good, -y / z, 0.0)


def tilted(vectors: F32) -> list[Finding]:
    along_u, along_v = (float(slope.mean()) for slope in _slopes(vectors))
    angle = float(np.degrees(np.arctan(np.hypot(along_u, along_v))))
    if angle <= TILTED:
        return []
    return [
        Finding(
            "the whole map leans",
            f"its mean slope is ({along_u:.3g}, {along_v:.3g}), {angle:.3g} degrees; of what repeats it is 0",
            "take the mean of red and of green off, or look for a shift of the channels where the map was made",
            DOUBTFUL if angle > TILTED_FAR else NOTE,
        )
    ]


def inverted_green(vectors: F32) -> list[Finding]:
    """Slopes p, q of heights have no curl: dp/dv = dq/du. With green inverted it is dp/dv = -dq/du."""
    agreement = curl_agreement(vectors)
    if agreement >= INVERTED:
        return []
    return [
        Finding(
            "inverted green",
            f"the slopes' mixed derivatives agree by {agreement:.2f} (1: green up, as OpenGL; -1: green down, as "
            "DirectX; 0: no heights have these normals)",
            "flip_y = true; where it is red that is inverted, flip_y and scale = -1",
            DOUBTFUL,
        )
    ]


def curl_agreement(vectors: F32) -> float:
    """Correlation of dp/dv and dq/du of (H, W, 3) normals' slopes: 1 of a height's, -1 with green inverted."""
    p, q = _slopes(vectors[::-1])  # Rows upwards, as v.
    kernel = KERNELS["sobel"]
    p_v, q_u = differences(p, 0, kernel, "clamp"), differences(q, 1, kernel, "clamp")
    norm = float(np.sqrt((p_v**2).sum() * (q_u**2).sum()))
    return float((p_v * q_u).sum()) / norm if norm else 0.0
