"""Texture files for tests: one that is known to the texel, one field of it changed, and what reading it says."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest

from glbump.errors import ImageError
from glbump.maps.containers import read_texture, texture_from_light, write_texture


def words(content: bytes, at: int, count: int) -> list[int]:
    """So many little-endian words of 32 bits from byte `at` on."""
    return list(struct.unpack_from(f"<{count}I", content, at))


def ramp(*shape: int) -> np.ndarray:
    """0, 1, 2, ... in the order in which a file has them."""
    return np.arange(np.prod(shape), dtype=np.float64).reshape(shape)


def write_cube(path: Path) -> Path:
    """Six faces of 2x2 and 1x1, RGBA in halves; texel i of level 0 is 4i, 4i + 1, ..., level 1 goes on from 1000."""
    write_texture(path, texture_from_light([ramp(6, 2, 2, 4), 1000 + ramp(6, 1, 1, 4)]))
    return path


def changed(path: Path, at: int, value: int, size: int = 4) -> Path:
    """The file, with another number at byte `at`."""
    content = bytearray(path.read_bytes())
    content[at : at + size] = value.to_bytes(size, "little")
    path.write_bytes(content)
    return path


def message(path: Path) -> str:
    """The one line that reading a file fails with."""
    with pytest.raises(ImageError) as raised:
        read_texture(path)
    text = str(raised.value)
    assert text.startswith(f"{path}: ")
    assert "\n" not in text
    assert len(text) - len(str(path)) < 320
    return text
