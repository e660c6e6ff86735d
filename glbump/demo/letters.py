"""The demo's cube map for finding one's way: six coloured faces, each with its axis written on it."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

# Five by seven dots each.
_GLYPHS = {
    "+": ("     ", "  X  ", "  X  ", "XXXXX", "  X  ", "  X  ", "     "),
    "-": ("     ", "     ", "     ", "XXXXX", "     ", "     ", "     "),
    "X": ("X   X", "X   X", " X X ", "  X  ", " X X ", "X   X", "X   X"),
    "Y": ("X   X", "X   X", " X X ", "  X  ", "  X  ", "  X  ", "  X  "),
    "Z": ("XXXXX", "    X", "   X ", "  X  ", " X   ", "X    ", "XXXXX"),
}

# As one sees them from inside, in the order of the faces: name, linear colour.
_FACES = (
    ("+X", (0.75, 0.10, 0.07)),
    ("-X", (0.30, 0.06, 0.22)),
    ("+Y", (0.28, 0.62, 0.13)),
    ("-Y", (0.07, 0.20, 0.16)),
    ("+Z", (0.10, 0.28, 0.80)),
    ("-Z", (0.85, 0.52, 0.06)),
)


def axes(size: int = 256) -> npt.NDArray[np.float32]:
    """A column of six faces (6 size, size, 3), linear light, each as seen from inside (orientation = "inside")."""
    return np.concatenate([_face(name, colour, size) for name, colour in _FACES]).astype(np.float32)


def _face(name: str, colour: tuple[float, float, float], size: int) -> npt.NDArray[np.float64]:
    fine = 4 * size  # averaged below, for smooth edges
    down, right = (np.mgrid[0:fine, 0:fine] + 0.5) / fine
    face = np.ones((fine, fine, 3)) * colour
    # A grid of eighths, and a light frame round the face.
    line = (np.abs(8 * right - np.round(8 * right)) < 0.03) | (np.abs(8 * down - np.round(8 * down)) < 0.03)
    face[line] *= 0.55
    border = np.minimum(np.minimum(right, 1 - right), np.minimum(down, 1 - down)) < 0.02
    face[border] = 0.9
    marks = dots(name)
    # Eleven by seven dots above the middle of the face, each 1/32 of it wide.
    column, row = np.floor((right - 0.5) * 32 + 5.5), np.floor((down - 0.27) * 32 + 3.5)
    inside = (column >= 0) & (column < 11) & (row >= 0) & (row < 7)
    ink = np.zeros((fine, fine), bool)
    ink[inside] = marks[row[inside].astype(int), column[inside].astype(int)]
    face[ink] = 0.95
    return face.reshape(size, 4, size, 4, 3).mean(axis=(1, 3))


def dots(text: str) -> npt.NDArray[np.bool_]:
    """(7, 6 n - 1): where the n letters of a text have ink."""
    letters = [np.array([[dot == "X" for dot in line] for line in _GLYPHS[letter]]) for letter in text]
    return np.concatenate([np.pad(letter, ((0, 0), (0, 1))) for letter in letters], axis=1)[:, :-1]
