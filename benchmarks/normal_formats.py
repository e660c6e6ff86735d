"""What each way to store a normal costs, in degrees."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from benchmarks.figures import Cell, Section, Table
from benchmarks.noted import deviation, largest
from glbump.maps.angles import degrees_between
from glbump.maps.encodings import ENCODINGS

F64 = npt.NDArray[np.float64]
Through = Callable[[F64], F64]


def _unit(v: F64) -> F64:
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


def _customary(n: F64) -> F64:
    """Bytes c as 2 c / 255 - 1, which has no code for 0."""
    return _unit(np.rint((n + 1) * 127.5) / 127.5 - 1)


def _spherical(n: F64) -> F64:
    """A byte for the longitude, which goes round, and one for the polar angle."""
    longitude = np.rint(np.arctan2(n[:, 1], n[:, 0]) * (256 / (2 * np.pi))) * (2 * np.pi / 256)
    polar = np.rint(np.arccos(n[:, 2]) * (255 / np.pi)) * (np.pi / 255)
    return np.stack([np.sin(polar) * np.cos(longitude), np.sin(polar) * np.sin(longitude), np.cos(polar)], axis=-1)


# What glbump does not use: name -> (there and back, bytes).
_OTHERS: dict[str, tuple[Through, int]] = {"rgb8, 2 c - 1": (_customary, 3), "spherical 8 + 8": (_spherical, 2)}
# Directions over tilts up to so many degrees: mean and largest error.
_NOTED = {
    ("oct16", 180): ("0.33686", "0.953"),
    ("oct16-precise", 180): ("0.31471", "0.63567"),
    ("oct24", 180): ("0.02089", "0.0589"),
    ("oct24-precise", 180): ("0.01952", "0.0394"),
    ("oct32", 180): ("0.00131", "0.00367"),
    ("oct32-precise", 180): ("0.00122", "0.00246"),
    ("rgb8, 2 c - 1", 180): ("0.1696", "0.3846"),
    ("rgb8", 180): ("0.1701", "0.3875"),
    ("rgb10", 180): ("0.0422", "0.0965"),
    ("rgb16", 180): ("0.00066", "0.00150"),
    ("half", 180): ("0.0061", "0.0230"),
    ("float", 180): None,
    ("rg8", 90): ("0.467", "5.86"),
    ("rg8", 45): ("0.188", "0.443"),
    ("rg16", 90): ("0.0030", "0.362"),
    ("rg16", 45): ("0.00073", "0.0017"),
    ("slopes8", 45): ("0.137", "0.315"),
    ("slopes16", 45): ("0.00053", "0.0012"),
    ("spherical 8 + 8", 180): ("0.355", "0.788"),
}


def _directions(count: int, reach: int) -> F64:
    """Chance directions, evenly spread over tilts up to `reach` degrees."""
    chance = np.random.default_rng(3)
    z = chance.uniform(np.cos(np.radians(reach)), 1, count)
    turn = chance.uniform(0, 2 * np.pi, count)
    across = np.sqrt(1 - z * z)
    return np.stack([across * np.cos(turn), across * np.sin(turn), z], axis=-1)


def there_and_back(name: str) -> tuple[Through, int]:
    """What is read of normals (N, 3), and the bytes of one."""
    if name in _OTHERS:
        return _OTHERS[name]
    e = ENCODINGS[name]
    return lambda n: e.decode(e.encode(n)), e.size


def errors(name: str, reach: int, count: int) -> tuple[float, float]:
    """Mean and largest degrees over so many chance directions."""
    through, _ = there_and_back(name)
    off = np.concatenate(
        [degrees_between(through(part), part) for part in np.array_split(_directions(count, reach), 8)]
    )
    return float(off.mean()), float(off.max())


def measure(quick: bool = False) -> Section:
    """A million directions each (quick: two thousand)."""
    rows: list[list[Cell]] = []
    off = []
    for (name, reach), noted in _NOTED.items():
        _, size = there_and_back(name)
        ours = errors(name, reach, 2_000 if quick else 1_000_000)
        e = ENCODINGS.get(name)
        promised = None if e is None else e.worst if reach == round(e.reach) else e.worst_45
        apart = max(deviation(o, f) for o, f in zip(ours, noted, strict=True)) if noted else None
        if apart is not None:
            off.append(apart)
        shown = [float(f) for f in noted] if noted else [None, None]
        rows.append([name, size, reach, ours[0], shown[0], ours[1], shown[1], apart, promised])
    flat = float(degrees_between(_customary(np.array([[0.0, 0.0, 1.0]])), np.array([[0.0, 0.0, 1.0]]))[0])
    return Section(
        "Normals as they are stored",
        "`python -m benchmarks normal_formats`: the angle in degrees between a normal and what is read of it, over "
        "a million chance directions within so many degrees of straight out, beside what was noted when glbump was "
        "designed (two million, by another program; the means of oct16 and oct32 are those of Cigolle et al., JCGT "
        "3(2), 2014, to 1e-3). The largest of chance directions is chance; `never more than` is what "
        "glbump/maps/encodings.py states, and tests hold. Read as 2 c - 1, the flattest normal of bytes, (128, "
        f"128, 255), leans by {flat:.3f} degrees (0.318 noted); in all of glbump's the flat normal is flat.",
        (
            Table(
                ("format", "bytes", "within", "mean", "noted", "largest", "noted", "off by, %", "never more than"), rows
            ),
        ),
        [largest("the farthest from what was noted", off)],
    )


if __name__ == "__main__":
    from benchmarks.command import alone

    alone(measure)
