"""Height fields to normal maps in files: in world units, band by band, on every core."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from glbump.errors import ImageError, LimitError, unknown
from glbump.maps.bspline import BORDERS
from glbump.maps.encodings import ENCODINGS
from glbump.maps.files import check_writable, write_atomically, write_rows
from glbump.maps.gradients import KERNELS, METHODS, Kernel
from glbump.maps.heights import slopes
from glbump.maps.png import PngLayout
from glbump.maps.rows import Heights, cuts, late_rows, rows_for, windows

Floats = npt.NDArray[np.floating[Any]]
Codes = npt.NDArray[Any]
Directions = tuple[Floats, Floats]
"""x / z and y / z of normals, (n, W) each."""

_TIFF = ("rgb16", "rgb8", "rg8", "rg16", "oct16", "oct24", "oct32", "float")
FORMATS = {".png": ("rgb8", "rgb16", "oct24"), ".tif": _TIFF, ".tiff": _TIFF, ".exr": ("half", "float")}
"""What each suffix holds, names of `encodings.ENCODINGS`; the first unless told."""

WHOLE_BYTES = 64
"""Bytes a pixel that a kernel takes which needs the whole map."""
MOST_WHOLE = 2**32
"""Most bytes that such a kernel may take."""

STEEPEST = 100.0
"""Steepest slope that is written, 89.43 degrees: less than is read (`heights.STEEPEST`), since formats round."""

STEEPEST_SCALE = 1e37
"""Most that an amplitude may be times the side of a texel, so that slopes of no height are NaN."""

_READ = 2**19
"""Pixels that are read, and packed, at a time."""
_BLOCK = 2**15
"""Pixels that are worked on at a time: their arrays stay in a core's cache."""


@dataclass(frozen=True)
class Ways:
    """How normals are taken of heights.

    amplitude: world length of the whole range of integers, or of 1 of floats. texel: (width, height) of one in the
    same unit. kernel: of gradients.METHODS. border: of BORDERS. format: of FORMATS. flip_y: +Y points down.
    """

    amplitude: float
    texel: tuple[float, float]
    kernel: str = "central"
    border: str = "wrap"
    format: str = "rgb8"
    flip_y: bool = False

    def __post_init__(self) -> None:
        formats = {name for names in FORMATS.values() for name in names}
        for what, got, allowed in (
            ("gradient kernel", self.kernel, METHODS),
            ("border", self.border, tuple(BORDERS)),
            ("format of normals", self.format, tuple(sorted(formats))),
        ):
            if got not in allowed:
                raise ImageError(unknown(what, got, allowed))
        if self.kernel == "spectral" and self.border != "wrap":
            raise ImageError(f"a spectral gradient wants a map that wraps; got border {self.border!r}; use bspline")
        sides = all(0 < side < np.inf for side in self.texel)
        if not (sides and all(abs(self.amplitude) <= STEEPEST_SCALE * side for side in self.texel)):
            raise ImageError(
                "an amplitude must be finite, the sides of a texel above 0, and the amplitude at most "
                f"{STEEPEST_SCALE:g} times as long; got {self.amplitude:g} and {self.texel[0]:g} x {self.texel[1]:g}"
            )


@dataclass(frozen=True)
class Tilts:
    """Degrees from straight out over `count` normals: their sum and the largest; how many were steeper than a normal
    map may be, and were made as steep as that, and the first of these: row, column."""

    count: int = 0
    total: float = 0.0
    worst: float = 0.0
    steep: int = 0
    first_steep: tuple[int, int] | None = None

    @property
    def mean(self) -> float:
        return self.total / self.count

    def __add__(self, other: Tilts) -> Tilts:
        first = min((f for f in (self.first_steep, other.first_steep) if f is not None), default=None)
        return Tilts(
            self.count + other.count,
            self.total + other.total,
            max(self.worst, other.worst),
            self.steep + other.steep,
            first,
        )


def format_for(path: Path, format: str | None = None) -> str:
    """The format that a file of this suffix is written in; ImageError where it cannot hold the one asked for."""
    suffix = path.suffix.lower()
    if suffix not in FORMATS:
        raise ImageError(f"{path}: {unknown('suffix', path.suffix, FORMATS)}")
    if format is not None and format not in FORMATS[suffix]:
        raise ImageError(f"{path}: {unknown(f'format of normals in {suffix}', format, FORMATS[suffix])}")
    return format or FORMATS[suffix][0]


def write_normals(
    heights: Heights, ways: Ways, output: Path, step: Callable[[], None] = lambda: None, inputs: Iterable[Path] = ()
) -> Tilts:
    """Write the normal map of a height field, and say how its normals tilt. step: called after each of `bands`.

    ImageError for a target that cannot be written or is one of `inputs`, and for heights that are none; LimitError
    where a kernel needs the whole map and that is too large. No file is left behind then.
    """
    format_for(output, ways.format)
    check_writable(output, inputs)
    if ways.kernel not in KERNELS:
        _require_room(heights, ways.kernel)
    is_png = output.suffix.lower() == ".png"
    late = late_rows(heights, KERNELS[ways.kernel].reach, ways.border) if is_png and ways.kernel in KERNELS else 0
    encoding = ENCODINGS[ways.format]
    sample = encoding.encode([[0.0, 0.0, 1.0]])
    size = heights.width, heights.height
    png = PngLayout(*size, sample.dtype, late)
    tilts = Tilts()

    def work(row: int, blocks: Iterable[Directions]) -> tuple[int, Any, Tilts]:
        with np.errstate(over="ignore"):  # What becomes infinite is too steep, and mended with the others.
            codes, tilts = _encoded(row, blocks, ways)
        return row, png.packed(row, codes) if is_png else codes, tilts

    def done() -> Iterator[tuple[int, Any]]:
        nonlocal tilts
        for row, piece, some in _in_order(work, _bands(heights, ways, late)):
            tilts += some
            yield row, piece
            step()

    def write(beside: Path) -> None:
        if is_png:
            png.write(beside, done())
        else:
            attributes = _attributes(output.suffix.lower(), size[0] * size[1] * sample.nbytes)
            codes = (codes for _, codes in done())
            write_rows(beside, output, size, ("R", "G", "B")[: sample.shape[-1]], sample.dtype, codes, attributes)

    write_atomically(output, write)
    return tilts


def bands(heights: Heights) -> int:
    """About how many bands a map is written in."""
    return -(-heights.height // rows_for(heights, _READ))


def _require_room(heights: Heights, kernel: str) -> None:
    needed = heights.width * heights.height * WHOLE_BYTES
    if needed > MOST_WHOLE:
        raise LimitError(
            f"{heights.name}: the kernel {kernel!r} needs the whole map at once, which takes {needed} bytes "
            f"({heights.width}x{heights.height}); at most {MOST_WHOLE}; use --kernel fourth, which takes none of that"
        )


def _attributes(suffix: str, size: int) -> dict[str, Any]:
    """For OpenImageIO: compression that costs little time, and in a TIFF of many bytes offsets that reach so far."""
    if suffix == ".exr":
        return {"compression": "zip:1"}
    return {"compression": "zip", "tiff:zipquality": 1, "tiff:bigtiff": int(size > 2**31)}


def _in_order(
    work: Callable[..., tuple[int, Any, Tilts]], jobs: Iterable[tuple[Any, ...]]
) -> Iterator[tuple[int, Any, Tilts]]:
    """What `work` makes of each job, on every core, in the order of the jobs; few of them are there at a time."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    with ThreadPoolExecutor(cores) as pool:
        pending: deque[Future[tuple[int, Any, Tilts]]] = deque()
        for job in jobs:
            pending.append(pool.submit(work, *job))
            if len(pending) > cores + 2:
                yield pending.popleft().result()
        while pending:
            yield pending.popleft().result()


def _bands(heights: Heights, ways: Ways, late: int) -> Iterator[tuple[int, Iterator[Directions]]]:
    """(row, the directions of the normals from that row on, to be had block by block)."""
    per_unit = ways.amplitude / heights.full
    # The rows of a picture go down, v goes up, and normals lean away from where it rises.
    scale = -per_unit / ways.texel[0], (per_unit if ways.flip_y else -per_unit) / ways.texel[1]
    rows = max(1, _READ // heights.width)
    if ways.kernel in KERNELS:
        kernel = KERNELS[ways.kernel]
        for first, window in windows(heights, kernel.reach, ways.border, rows_for(heights, _READ), late):
            for row, end in cuts(len(window) - 2 * kernel.reach, rows):
                part = window[row : end + 2 * kernel.reach]
                yield first + row, _directions(part, kernel, ways.border, scale)
        return
    whole = slopes(heights.read(0, heights.height), ways.kernel, ways.border)
    du, dv = scale[0] / heights.width, scale[1] / heights.height
    for row, end in cuts(heights.height, rows):
        yield row, iter([(whole[row:end, :, 0] * np.float32(du), whole[row:end, :, 1] * np.float32(dv))])


def _directions(window: Codes, kernel: Kernel, border: str, scale: tuple[float, float]) -> Iterator[Directions]:
    """Of the rows of a window but `reach` at either end, some at a time.

    In float32, which keeps the differences of heights to the last bit or nearly so, and whole numbers of 16 bits
    exactly; in float64 for those of 32 bits.
    """
    reach, width = kernel.reach, window.shape[1]
    columns = np.pad(np.arange(width), reach, mode=BORDERS[border])  # type: ignore[call-overload]
    dtype = np.float64 if window.dtype.itemsize == 4 and window.dtype.kind == "u" else np.float32
    weight = kernel.pairs[0][2]
    for first, end in cuts(len(window) - 2 * reach, max(1, _BLOCK // width)):
        rows = window[first : end + 2 * reach]
        f = np.empty((len(rows), width + 2 * reach), dtype)
        f[:, reach : reach + width] = rows
        f[:, :reach], f[:, reach + width :] = rows[:, columns[:reach]], rows[:, columns[reach + width :]]
        x, y = _difference(f, kernel), _difference(f[::-1].T, kernel).T[::-1]
        x *= dtype(weight * scale[0])
        y *= dtype(weight * scale[1])
        yield x, y


def _difference(f: Floats, kernel: Kernel) -> Floats:
    """The kernel's differences of f along its rows, over the weight of the first; `reach` less on every side."""
    reach, across = kernel.reach, len(kernel.across) // 2
    near = f[reach - across : len(f) - reach + across]
    count = f.shape[1] - 2 * reach

    def at(i: int) -> Floats:
        return near[:, reach + i : reach + i + count]

    (ahead, behind, first), *others = kernel.pairs
    total = at(ahead) - at(behind)
    for ahead, behind, weight in others:
        total += f.dtype.type(weight / first) * (at(ahead) - at(behind))
    if not across:
        return total
    rows = len(total) - 2 * across
    mean = f.dtype.type(kernel.across[0]) * total[:rows]
    for i, weight in enumerate(kernel.across[1:], 1):
        mean += f.dtype.type(weight) * total[i : i + rows]
    return mean


def _encoded(first_row: int, blocks: Iterable[Directions], ways: Ways) -> tuple[Codes, Tilts]:
    """A band as the format has it, (n, W, channels), and how it tilts."""
    parts, tilts, row = [], Tilts(), first_row
    for x, y in blocks:
        squares = x * x + y * y
        steep = Tilts()
        if not squares.max() <= STEEPEST**2:
            x, y, steep = _mended(x, y, row)
            squares = x * x + y * y
        worst = float(np.degrees(np.arctan(np.sqrt(squares.max()))))
        angles = np.sqrt(squares)
        np.arctan(angles, out=angles)
        tilts += Tilts(x.size, float(np.degrees(angles.sum(dtype=np.float64))), worst) + steep
        if ways.format == "rgb8":
            parts.append(_bytes(x, y, squares))
        else:
            n = np.stack(np.broadcast_arrays(x, y, np.float64(1)), axis=-1) + 0.0  # no -0
            parts.append(ENCODINGS[ways.format].encode(n))
        row += len(x)
    return np.concatenate(parts), tilts


def _bytes(x: Floats, y: Floats, squares: Floats) -> npt.NDArray[np.uint8]:
    """`ENCODINGS["rgb8"]` in float32, in a tenth of its time: the nearest codes of 128 + 127 n. Takes its arguments'
    room."""
    codes = np.empty((*x.shape, 3), np.uint8)
    squares += 1
    np.sqrt(squares, out=squares)
    np.divide(127, squares, out=squares)
    for i, values in enumerate((x, y)):
        values *= squares
        values += 128.5
        codes[..., i] = values
    squares += 128.5
    codes[..., 2] = squares
    return codes


def _mended(x: Floats, y: Floats, row: int) -> tuple[Floats, Floats, Tilts]:
    """Directions with none steeper than STEEPEST, and how many were; row: that of the first."""
    most = float(np.finfo(np.float32).max)
    x, y = (np.clip(a.astype(np.float64), -most, most) for a in (x, y))
    slope = np.hypot(x, y)
    too_steep = slope > STEEPEST
    shorter = np.where(too_steep, STEEPEST / np.where(too_steep, slope, 1), 1)
    at = np.argwhere(too_steep)
    first = (row + int(at[0, 0]), int(at[0, 1])) if len(at) else None
    return x * shorter, y * shorter, Tilts(steep=len(at), first_steep=first)
