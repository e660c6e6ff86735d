"""What a file's header says about the meaning of its values, beyond what reading a picture needs."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

from glbump.maps.containers import is_texture

SRGB_GAMMA = 2.2


@dataclass(frozen=True)
class Tags:
    """gamma: that the file says, None where it says none; 1 is linear. says_srgb: whether it says sRGB by itself, not
    by its kind. has_profile, profile_is_srgb: of an ICC profile."""

    gamma: float | None = None
    says_srgb: bool = False
    has_profile: bool = False
    profile_is_srgb: bool = False


def tags_of(path: Path) -> Tags:
    """The tags of a picture file that has been read before; none for texture files."""
    with path.open("rb") as file:
        begin = file.read(12)
    if begin[:4] in (b"\xabKTX", b"DDS ") and is_texture(path):
        return Tags()
    import OpenImageIO as oiio

    picture = oiio.ImageInput.open(str(path))
    if picture is None:
        oiio.geterror()  # An error that nobody asks for is printed when the process ends.
        return Tags()
    try:
        spec = picture.spec()
        # PNG's gamma is exact; of others the name of the colour space tells it, as "g22_rec709_scene".
        space = spec.get_string_attribute("oiio:ColorSpace").lower()
        gamma = spec.get_float_attribute("oiio:Gamma") or None
        named = re.match(r"g(\d)(\d)_", space)
        if gamma is None and named:
            gamma = int(named[1]) + int(named[2]) / 10
        if space.startswith("lin") and begin.startswith(b"\x89PNG"):
            gamma = 1.0
        profile = spec.get_string_attribute("ICCProfile:profile_description")
        has_profile = bool(profile) or spec.getattribute("ICCProfile") is not None
    finally:
        picture.close()
    says_srgb = gamma is not None and abs(gamma - SRGB_GAMMA) < 0.05
    return Tags(gamma, says_srgb or _png_says_srgb(path), has_profile, "srgb" in profile.lower())


def _png_says_srgb(path: Path) -> bool:
    """Whether a PNG has the chunk sRGB, which OpenImageIO does not tell from no chunk at all."""
    with path.open("rb") as file:
        if file.read(8) != b"\x89PNG\r\n\x1a\n":
            return False
        while len(head := file.read(8)) == 8 and head[4:] != b"IDAT":
            if head[4:] == b"sRGB":
                return True
            file.seek(int.from_bytes(head[:4], "big") + 4, 1)
    return False
