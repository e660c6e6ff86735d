"""What a picture is for: by its header, its name and its content."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from glbump.maps.detect import detect
from glbump.maps.heights import HIGHEST
from glbump.maps.images import NORMAL_BEHIND, colour_of, length_error, vectors_of
from glbump.maps.stored import Stored

ENVIRONMENT, HEIGHT, NORMAL_MAP, COLOUR = "environment", "height", "normal-map", "colour"
USES = (ENVIRONMENT, HEIGHT, NORMAL_MAP, COLOUR)

WORDS = {
    NORMAL_MAP: {"normal", "normals", "normalmap", "nrm", "nor"},
    HEIGHT: {"height", "heights", "heightmap", "disp", "displacement", "bump", "bumps", "dem", "elevation"},
    COLOUR: {"albedo", "basecolor", "basecolour", "diffuse", "color", "colour"},
    ENVIRONMENT: {"env", "environment", "hdri", "sky", "skybox", "panorama", "pano", "latlong", "equirectangular"},
}
"""Words in names of files, whole or as CamelCase has them."""

NORMAL_LENGTH = 0.25
"""Most that vectors differ from length 1, on average, for a picture to be a normal map by its content: those that are
sRGB-encoded by mistake too, photographs not."""


def use_of(stored: Stored) -> tuple[str, str]:
    """One of USES, and why."""
    if stored.envmap is not None:
        return ENVIRONMENT, "its header says so"
    by_name = _by_name(stored.name)
    if by_name:
        return by_name, "its name says so"
    return _by_content(stored)


def _by_name(name: str) -> str | None:
    apart = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", Path(name).stem)
    words = set(re.findall(r"[a-z]+", apart.lower()))
    return next((use for use, known in WORDS.items() if words & known), None)


def _by_content(stored: Stored) -> tuple[str, str]:
    r, g, b = (stored.pixels[:, :, i] for i in stored.colours())
    if r is g or (np.array_equal(r, g) and np.array_equal(r, b)):
        return HEIGHT, "it is grey"
    # What is not finite, or beyond all measure, is found later; here it must not decide.
    if stored.is_float and not (np.abs(stored.pixels) <= HIGHEST).all():
        return ENVIRONMENT, "it holds floats"
    vectors = vectors_of(stored).pixels
    if length_error(vectors) < NORMAL_LENGTH and float((vectors[..., 2] <= 0).mean()) <= NORMAL_BEHIND:
        return NORMAL_MAP, "its colours are vectors of length 1 that point out of the surface"
    if stored.is_float:
        return ENVIRONMENT, "it holds floats, in colour"
    found = detect(colour_of(stored))
    if found.is_sure or 2 * min(stored.pixels.shape[:2]) == max(stored.pixels.shape[:2]):
        return ENVIRONMENT, f"{found.why}, in colour"
    return COLOUR, "it is in colour, and of no environment's shape"
