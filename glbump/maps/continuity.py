"""Whether an environment goes on across its edges: how large the steps are, which face of a cube is to blame."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from itertools import combinations, product

import numpy as np
import numpy.typing as npt

from glbump.maps.angles import angle_between
from glbump.maps.cube import FACES, face_dir, face_of
from glbump.maps.layout import CUBE, LATLONG, EnvironmentMap, Layout, sample

F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]
Index = npt.NDArray[np.intp]
Line = list[tuple[F64, F64]]

# ------------------------------------------------------------ the step across an edge, in any layout


def seam_step(environment: EnvironmentMap) -> float:
    """The step across the worst edge of the tiles, over the typical one at like places inside. 1: no seam.

    A step is the change between two look-ups a quarter of a texel before and behind a line, on the great circle square
    to it, per angle. Lines are the edges of the tiles (of a disc its rim; of a lat-long picture its sides and its
    poles) and those one texel off on both sides; along them there is a place at the middle of each texel. Of each edge
    the root mean square of the steps across it is divided by that of the steps inside; the worst quotient is returned.

    Of a smooth function it is 1 up to the square of a texel's angle. A tile continued by its own last texels gives 2, a
    wrong neighbour the contrast of the picture in texels. A picture with more contrast just along an edge than beside
    it has more than 1 without any fault: judge a conversion by a smooth environment. Where the layout mirrors what lies
    above the horizon below it, the step across the horizon is 0. Tiles of one texel have no inside and do not count.
    """
    return max((_quotient(environment, lines) for lines in edge_lines(environment)), default=0.0)


def _quotient(environment: EnvironmentMap, lines: Line) -> float:
    """Across the first line, over the others; 1 where nothing changes at all."""
    across, *inside = (_mean_square_step(environment, *pair) for pair in lines)
    typical = float(np.mean(inside))
    if typical == 0:
        return 1.0 if across == 0 else np.inf
    return float(np.sqrt(across / typical))


def _mean_square_step(environment: EnvironmentMap, before: F64, behind: F64) -> float:
    change = (sample(environment, before) - sample(environment, behind)) / angle_between(before, behind)[:, None]
    return float(np.mean(np.square(change)))


def edge_lines(environment: EnvironmentMap) -> list[Line]:
    """For each edge of each tile, pairs of directions (K, 3): across the edge, across the line inside, and across that
    line mirrored to the other side of the edge."""
    layout, (width, height) = environment.layout, environment.size
    # Samples on the border span one step less than there are.
    steps = 1 / (width * environment.scale[0]), 1 / (height * environment.scale[1])
    edges: list[Line] = []
    for tile in range(layout.tiles):
        if layout.disc:
            turn = (np.arange(4 * height) + 0.5) * (np.pi / (2 * height))
            if width > 1:
                edges.append(_lines(layout, tile, (np.cos(turn), np.sin(turn)), (0.0, 0.0), steps[0]))
            continue
        for axis, side in product((0, 1), (-1.0, 1.0)):
            if layout is LATLONG and (axis, side) == (0, 1.0):
                continue  # The left side is the same edge.
            count = (height, width)[axis]
            along, out = (np.arange(count) + 0.5) / count - 0.5, np.full(count, 0.5 * side)
            at, way = ((out, along), (side, 0.0)) if axis == 0 else ((along, out), (0.0, side))
            if (width, height)[axis] > 1:
                edges.append(_lines(layout, tile, at, way, steps[axis]))
    return edges


def _lines(layout: Layout, tile: int, at: tuple[F64, F64], way: tuple[float, float], step: float) -> Line:
    """Pairs across the edge at `at` (from the tile's middle; of a disc the unit vector to its rim), and inside.

    way: the outward direction, in s and t. step: of one texel.
    """

    def place(inwards: float, aside: float = 0.0) -> F64:
        if layout.disc:
            angle, r = np.arctan2(at[1], at[0]) + aside, 0.5 - inwards
            return layout.dir(tile, 0.5 + r * np.cos(angle), 0.5 + r * np.sin(angle))
        s, t = (0.5 + at[i] - inwards * way[i] + aside * way[1 - i] for i in (0, 1))
        return layout.dir(tile, s, t)

    def normal(inwards: float) -> F64:
        tangent = place(inwards, 1e-4) - place(inwards, -1e-4)
        return _square_to(tangent, place(inwards), place(inwards + step / 4))

    edge, line = normal(0.0), normal(step)
    across = place(step / 4), _mirrored(place(step / 4), edge)
    inside = place(step * 1.25), _mirrored(place(step * 1.25), line)
    return [across, inside, (_mirrored(inside[0], edge), _mirrored(inside[1], edge))]


def _square_to(tangent: F64, on: F64, before: F64) -> F64:
    """Unit normals (K, 3) of the planes through the centre along a line; where the line is but one direction (a pole),
    of the plane that a step through it is square to."""
    normal = np.cross(on, tangent)
    through = before - np.einsum("ki,ki->k", before, on)[:, None] * on
    length = np.linalg.norm(normal, axis=-1, keepdims=True)
    normal = np.where(length > 1e-7, normal, through)
    result: F64 = normal / np.linalg.norm(normal, axis=-1, keepdims=True)
    return result


def _mirrored(dir: F64, normal: F64) -> F64:
    return dir - 2 * np.einsum("ki,ki->k", dir, normal)[:, None] * normal


# ------------------------------------------------------------ which face of a cube is turned

SYMMETRIES = (
    "as it should be",
    "turned by 90 degrees counter-clockwise",
    "turned by 180 degrees",
    "turned by 90 degrees clockwise",
    "mirrored left to right",
    "mirrored about the diagonal from its upper left corner",
    "mirrored top to bottom",
    "mirrored about the diagonal from its upper right corner",
)
"""What may have happened to a face: k is k % 4 quarter turns counter-clockwise, after a mirroring where k >= 4."""

MENDED = 0.6
"""A face is blamed where laying it another way leaves at most this share of the steps at its edges,"""

GAIN = 1.0
"""and makes them smaller, on average, by at least this much of the typical step inside."""

_SIMPLER = 1.05
"""A fault of two faces must explain the steps better than one of one face by this factor."""

_MIRRORED = (4, 4, 6, 6, 4, 4)
"""What makes of each face of one orientation that of the other."""


@dataclass(frozen=True)
class Fault:
    """faces: what is wrong with: one, the two that are swapped, all six when the orientation is. what: is wrong.
    sources, symmetries: the tile that belongs in each place, and what to do with it. before, after: the mean step
    across the edges of these faces over the typical one inside, as it is and mended."""

    faces: tuple[str, ...]
    what: str
    sources: tuple[int, ...]
    symmetries: tuple[int, ...]
    before: float
    after: float

    def __str__(self) -> str:
        who = "the faces are" if len(self.faces) == 6 else f"face {self.faces[0]} is"
        return f"{f'faces {self.faces[0]} and {self.faces[1]} are' if len(self.faces) == 2 else who} {self.what}"

    def mend(self, faces: F32) -> F32:
        """The faces (6, N, N, C) with this fault set right."""
        laid = (changed(faces[i], how) for i, how in zip(self.sources, self.symmetries, strict=True))
        return np.stack(list(laid))


def changed(face: F32, symmetry: int) -> F32:
    """A face (N, N, C) after one of SYMMETRIES happened to it."""
    return np.rot90(face[:, ::-1] if symmetry >= 4 else face, symmetry % 4)


def undone(symmetry: int) -> int:
    """The symmetry that undoes one: each mirroring undoes itself."""
    return symmetry if symmetry >= 4 else -symmetry % 4


def turned_faces(environment: EnvironmentMap) -> list[Fault]:
    """The faces of a cube that are turned, mirrored or swapped, as the twelve edges betray them; none of other layouts.

    All ways of laying one face (7), of swapping two, each laid any way (15 * 64), and of mirroring all six are tried;
    the one that makes the edges meet best is reported, and the search goes on from there until none makes them better.
    What the edges do not show is not found: a face that is the same all along its rim, a cube mirrored as a whole.
    """
    if environment.layout is not CUBE or environment.size[0] < 2:
        return []
    differences = _line_differences(environment.pixels)
    sources, symmetries = np.arange(6), np.zeros(6, np.intp)
    faults: list[Fault] = []
    while len(faults) < 6:
        found = _best_fault(differences, sources, symmetries)
        if found is None:
            break
        fault, sources, symmetries = found
        faults.append(fault)
    return faults


def edge_steps(faces: F32) -> dict[str, float]:
    """Of each of the twelve edges of faces (6, N, N, C), N >= 2, by the names of its faces ("+X+Y"): the mean
    difference of the texels across it over the mean difference inside beside it."""
    steps = _steps(_line_differences(faces), np.arange(6)[None], np.zeros((1, 6), np.intp))[0]
    return {FACES[a] + FACES[b]: float(step) for (a, _, b, _), step in zip(_edges(), steps, strict=True)}


def orientation_steps(faces: F32) -> tuple[float, float]:
    """The mean of edge_steps, and what it would be were the faces of the other orientation."""
    sources, symmetries = np.tile(np.arange(6), (2, 1)), np.array([[0] * 6, _MIRRORED])
    as_is, other = _steps(_line_differences(faces), sources, symmetries).mean(axis=1)
    return float(as_is), float(other)


@cache
def _edges() -> tuple[tuple[int, int, int, int], ...]:
    """The twelve edges: face and line of _face_lines, and those of the neighbour that run along the same way."""
    found = []
    at = np.array([0.25, 0.75])
    # Just outside, a quarter and three quarters along each line.
    outside = [(at, 0 * at - 0.01), (at, 0 * at + 1.01), (0 * at - 0.01, at), (0 * at + 1.01, at)]
    for face in range(6):
        for line, (s, t) in enumerate(outside):
            other, u, v = face_of(face_dir(face, s, t))
            if other[0] < face:
                continue
            along = u if abs(u[1] - u[0]) > 0.1 else v
            side = (v[0] > 0.5) if along is u else 2 + (u[0] > 0.5)
            found.append((face, line, int(other[0]), int(side) + 4 * bool(along[1] < along[0])))
    return tuple(found)


def _face_lines(face: F32) -> tuple[F32, F32]:
    """(8, N, C) the outermost texels along the edges: top, bottom, left, right, and these backwards; and (8, N, C) the
    texels next to them."""
    rim = np.stack([face[0], face[-1], face[:, 0], face[:, -1]])
    inner = np.stack([face[1], face[-2], face[:, 1], face[:, -2]])
    return np.concatenate([rim, rim[:, ::-1]]), np.concatenate([inner, inner[:, ::-1]])


@cache
def _lines_after() -> Index:
    """(8, 8): which of a face's lines lies where each line was, after each of SYMMETRIES."""
    face = np.arange(9.0, dtype=np.float32).reshape(3, 3, 1)
    before = _face_lines(face)[0]
    after = [_face_lines(changed(face, symmetry))[0] for symmetry in range(8)]
    match = (np.stack(after)[:, :, None] == before).all(axis=(3, 4))
    return match.argmax(axis=2)


def _line_differences(faces: F32) -> F64:
    """(48, 48): mean difference of any two lines of any two faces over the mean difference inside beside them."""
    lines = [_face_lines(face) for face in faces]
    rim, inner = (np.concatenate([line[i] for line in lines]).astype(np.float64) for i in (0, 1))
    # A sun is one texel among many: brightness is compressed about its mean, so that it does not decide alone.
    mean = float(np.abs(rim).mean()) or 1.0
    rim, inner = (x / (np.abs(x) + mean) for x in (rim, inner))
    inside = np.abs(rim - inner).mean(axis=(1, 2))
    # Where all is alike, rounding decides nothing.
    typical = (inside[:, None] + inside) / 2 + 0.1 * inside.mean() + 1e-4
    result: F64 = np.stack([np.abs(line - rim).mean(axis=(1, 2)) for line in rim]) / typical
    return result


def _steps(differences: F64, sources: Index, symmetries: Index) -> F64:
    """(K, 12): the steps across the edges of K ways (K, 6) of laying the faces."""
    first, line, second, other = np.array(_edges()).T
    after = _lines_after()
    a = 8 * sources[:, first] + after[symmetries[:, first], line]
    b = 8 * sources[:, second] + after[symmetries[:, second], other]
    return differences[a, b]


@cache
def _ways() -> tuple[Index, Index]:
    """(K, 6) each: of every fault that is looked for, the tile that belongs in each place, and what to do with it."""
    ways: list[tuple[list[int], list[int]]] = []
    for face, symmetry in product(range(6), range(1, 8)):
        ways.append((list(range(6)), [symmetry * (i == face) for i in range(6)]))
    ways.append((list(range(6)), list(_MIRRORED)))
    for (a, b), how_a, how_b in product(combinations(range(6), 2), range(8), range(8)):
        sources, symmetries = list(range(6)), [0] * 6
        sources[a], sources[b], symmetries[a], symmetries[b] = b, a, how_a, how_b
        ways.append((sources, symmetries))
    return np.array([way[0] for way in ways]), np.array([way[1] for way in ways])


def _best_fault(differences: F64, sources: Index, symmetries: Index) -> tuple[Fault, Index, Index] | None:
    """The way of laying the faces anew that makes the edges meet best, where any does, and how they lie then."""
    moved, done = _ways()
    new_sources = sources[moved]
    # The symmetry is done to what lies there after those that were done to it before.
    new_symmetries = _composed()[symmetries[moved], done]
    now = _steps(differences, sources[None], symmetries[None])[0]
    then = _steps(differences, new_sources, new_symmetries)
    first, _, second, _ = np.array(_edges()).T
    touched = (moved != np.arange(6)) | (done != 0)
    at_them = touched[:, first] | touched[:, second]
    before, after = ((steps * at_them).sum(axis=1) / at_them.sum(axis=1) for steps in (now[None], then))
    good = (after <= MENDED * before) & (before - after >= GAIN)
    if not good.any():
        return None
    total = then.sum(axis=1) * np.where(touched.sum(axis=1) == 2, _SIMPLER, 1.0)
    best = int(np.where(good, total, np.inf).argmin())
    fault = _named(moved[best], done[best], float(before[best]), float(after[best]))
    return fault, new_sources[best], new_symmetries[best]


@cache
def _composed() -> Index:
    """(8, 8): the symmetry that is a first and then b."""
    face = np.arange(4.0, dtype=np.float32).reshape(2, 2, 1)
    each = np.stack([changed(face, i) for i in range(8)])
    both = np.stack([[changed(one, j) for j in range(8)] for one in each])
    return (both[:, :, None] == each).all(axis=(3, 4, 5)).argmax(axis=2)


def _named(sources: Index, symmetries: Index, before: float, after: float) -> Fault:
    touched = [i for i in range(6) if sources[i] != i or symmetries[i]]
    names = tuple(FACES[i] for i in touched)
    if len(touched) == 6:
        what = "mirrored, each by itself: they are of the other orientation (or +Z and -Z are swapped)"
    elif len(touched) == 1:
        what = SYMMETRIES[undone(int(symmetries[touched[0]]))]
    else:
        happened = ((FACES[sources[i]], undone(int(symmetries[i]))) for i in touched)
        turned = [f"{face} holds the other {SYMMETRIES[how]}" for face, how in happened if how]
        what = ", and ".join(["swapped", *turned])
    return Fault(names, what, tuple(map(int, sources)), tuple(map(int, symmetries)), before, after)
