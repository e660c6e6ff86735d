"""Maps of slopes as textures keep them: as floats, or in the codes of an encoding of normals or of slopes.

The shaders' side is shaders/bump_input.glsl.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from glbump.frozen import Frozen
from glbump.maps.encodings import ENCODINGS, Stored, codes, unpacked_10

F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]

PLAIN, CODED, XY, XYZ, FOLDED, FOLDED_BYTES = range(6)
"""What texels hold: slopes; slopes in codes; x and y of normals; all of normals; their place on the octahedron, which
no filter may average, in two codes or across three bytes."""


class BumpFormat(Frozen):
    """One way to keep slopes. family: one of the above. bits: of a code, 0 for floats. dtype: of the texture, as
    glbump/gl/levels.py names it. is_normals: it keeps directions, not slopes, and no heights beside them.
    """

    name: str
    family: int
    bits: int
    dtype: str

    @property
    def is_normals(self) -> bool:
        """Whether it keeps directions."""
        return self.family > CODED

    @property
    def is_filtered(self) -> bool:
        """Whether the texture unit may average its texels, and read levels."""
        return self.family < FOLDED

    @property
    def middle(self) -> int:
        """The code of 0; 0 for floats."""
        return 1 << self.bits >> 1

    @property
    def encoding(self) -> str:
        """Of ENCODINGS, the one that a format of normals is stored by: octahedral ones by the nearest of four codes."""
        return self.name + ("-precise" if self.family >= FOLDED else "")

    def stored(self, slopes: F32, most: Sequence[float]) -> Stored:
        """(H, W, 2) slopes, or (H, W, 3) with heights -> (H, W, n) of the type that goes to the texture.

        most: the largest of each, of either sign, over the map: what the last code of CODED stands for.
        """
        if self.family == PLAIN:
            return slopes.astype(np.float16 if self.name == "half" else np.float32)
        if self.family == CODED:
            return codes(slopes / code_range(most)[: slopes.shape[-1]], self.bits)
        normals = np.concatenate([-slopes.astype(np.float64), np.ones_like(slopes[..., :1])], axis=-1)
        return ENCODINGS[self.encoding].encode(normals)

    def as_read(self, stored: Stored) -> F64:
        """(H, W, n): as shaders read texels: floats as they are, codes as shares of the last, 0..1."""
        if self.family == PLAIN:
            return stored.astype(np.float64)
        if self.dtype == "rgb10":
            return unpacked_10(stored) / 1023.0
        result: F64 = stored / float(np.iinfo(stored.dtype).max)
        return result


def code_range(most: Sequence[float]) -> F64:
    """What the last code of CODED stands for; 1 where all is 0."""
    return np.array([value or 1.0 for value in most])


_FORMATS: tuple[tuple[Any, ...], ...] = (
    ("float", PLAIN, 0, "f4"),
    ("half", PLAIN, 0, "f2"),
    ("slopes8", CODED, 8, "f1"),
    ("slopes16", CODED, 16, "nu2"),
    ("rg8", XY, 8, "f1"),
    ("rg16", XY, 16, "nu2"),
    ("rgb8", XYZ, 8, "f1"),
    ("rgb10", XYZ, 10, "rgb10"),
    ("oct24", FOLDED_BYTES, 12, "f1"),
    ("oct32", FOLDED, 16, "nu2"),
)
BUMP_FORMATS = {name: BumpFormat(name, *rest) for name, *rest in _FORMATS}
