"""`glbump normals` against pipelines that write the same file: time, memory, size of the file; and a huge map."""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from collections.abc import Callable
from functools import partial
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import numpy.typing as npt

from benchmarks.figures import Cell, Section, Table, Target
from glbump.maps.normals import Ways, write_normals
from glbump.maps.patterns import fbm
from glbump.maps.rows import open_heights
from glbump.trade.timing import Call, in_turns, ratios

AMPLITUDE = 0.05  # of the tile's width: tilts of 13 degrees on average
MIB = 2**20


def ours(source: Path, output: Path) -> None:
    with open_heights(source) as heights:
        texel = 1 / heights.width
        write_normals(heights, Ways(AMPLITUDE, (texel, texel)), output)


def _scale(width: int) -> float:
    """World slope of a difference of one code over two texels."""
    return AMPLITUDE / 65535 * width / 2


def opencv(source: Path, output: Path) -> None:
    """Nothing but OpenCV, whose threads are on, and whose PNGs are written at its own setting, for speed."""
    import cv2

    x, y = _opencv_slopes(source)
    z = cv2.pow(cv2.add(cv2.multiply(x, x), cv2.add(cv2.multiply(y, y), 1.0)), -0.5)
    bgr = cv2.merge([z, cv2.multiply(y, z), cv2.multiply(x, z)])
    cv2.imwrite(str(output), cv2.convertScaleAbs(bgr, alpha=127, beta=128))


def opencv_numpy(source: Path, output: Path) -> None:
    """As it is mostly written: OpenCV's gradient and files, NumPy between."""
    import cv2

    x, y = _opencv_slopes(source)
    n = np.dstack([np.ones_like(x), y, x])
    n /= np.linalg.norm(n, axis=2, keepdims=True)
    cv2.imwrite(str(output), np.rint(128 + 127 * n).astype(np.uint8))


def _opencv_slopes(source: Path) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.float32]]:
    import cv2

    h = cv2.imread(str(source), cv2.IMREAD_UNCHANGED).astype(np.float32)
    scale = _scale(h.shape[1])
    h = cv2.copyMakeBorder(h, 1, 1, 1, 1, cv2.BORDER_WRAP)
    x = cv2.Sobel(h, cv2.CV_32F, 1, 0, ksize=1, scale=-scale)[1:-1, 1:-1]
    y = cv2.Sobel(h, cv2.CV_32F, 0, 1, ksize=1, scale=scale)[1:-1, 1:-1]
    return x, y


def scipy(source: Path, output: Path) -> None:
    """scipy.ndimage, with Pillow at its quickest setting but none."""
    from PIL import Image
    from scipy import ndimage

    h = np.asarray(Image.open(source)).astype(np.float32)
    scale = _scale(h.shape[1])
    x = ndimage.correlate1d(h, [scale, 0, -scale], axis=1, mode="wrap")
    y = ndimage.correlate1d(h, [-scale, 0, scale], axis=0, mode="wrap")
    _write(output, x, y)


def numpy(source: Path, output: Path) -> None:
    """Plain NumPy, with Pillow as above."""
    from PIL import Image

    h = np.asarray(Image.open(source)).astype(np.float32)
    scale = np.float32(_scale(h.shape[1]))
    x = (np.roll(h, 1, 1) - np.roll(h, -1, 1)) * scale
    y = (np.roll(h, -1, 0) - np.roll(h, 1, 0)) * scale
    _write(output, x, y)


def _write(output: Path, x: npt.NDArray[np.float32], y: npt.NDArray[np.float32]) -> None:
    from PIL import Image

    z = 1 / np.sqrt(x * x + y * y + 1)
    n = np.stack([x * z, y * z, z], axis=-1)
    Image.fromarray(np.rint(128 + 127 * n).astype(np.uint8)).save(output, compress_level=1)


WRITERS: dict[str, tuple[Callable[[Path, Path], None], str]] = {
    "glbump": (ours, "glbump"),
    "OpenCV": (opencv, "cv2"),
    "OpenCV, NumPy": (opencv_numpy, "cv2"),
    "scipy.ndimage, NumPy, Pillow": (scipy, "scipy"),
    "NumPy, Pillow": (numpy, "PIL"),
}
"""Name -> function, and the module that it needs."""


def _in_process(name: str, source: Path, output: Path) -> dict[str, float]:
    """Seconds and peak resident MiB of one run in a process of its own."""
    code = (
        "import json, sys, time; from pathlib import Path; from benchmarks.normals import WRITERS\n"
        "started = time.perf_counter(); WRITERS[sys.argv[1]][0](*map(Path, sys.argv[2:]))\n"
        "peak = Path('/proc/self/status').read_text().split('VmHWM:')[1].split()[0]\n"
        "print(json.dumps({'seconds': time.perf_counter() - started, 'MiB': int(peak) / 1024}))"
    )
    root = Path(__file__).resolve().parents[1]
    command = [sys.executable, "-c", code, name, str(source), str(output)]
    done = subprocess.run(command, cwd=root, check=True, capture_output=True, text=True)
    figures: dict[str, float] = json.loads(done.stdout)
    return figures


def _picture(folder: Path, side: int) -> Path:
    """16-bit rock as a PNG."""
    import OpenImageIO as oiio

    path = folder / "heights.png"
    file = oiio.ImageOutput.create(str(path))
    file.open(str(path), oiio.ImageSpec(side, side, 1, "uint16"))
    file.write_image(np.rint(fbm((side, side))[..., None] * 65535).astype(np.uint16))
    file.close()
    return path


def _huge(folder: Path, side: int) -> Path:
    """16-bit terraces as a tiled TIFF, which deflate well, written a row of tiles at a time."""
    import OpenImageIO as oiio

    path = folder / "huge.tif"
    spec = oiio.ImageSpec(side, side, 1, "uint16")
    spec.tile_width = spec.tile_height = 256
    spec.attribute("compression", "zip")
    spec.attribute("tiff:zipquality", 1)
    file = oiio.ImageOutput.create(str(path))
    file.open(str(path), spec)
    chance = np.random.default_rng(5)
    for row in range(0, side, 256):
        terraces = chance.integers(0, 65536, (8, side // 32), dtype=np.uint16)
        band = np.repeat(np.repeat(terraces, 32, axis=0), 32, axis=1)[..., None]
        file.write_tiles(0, side, row, min(row + 256, side), 0, 1, np.ascontiguousarray(band))
    file.close()
    return path


def _differing(a: Path, b: Path) -> float:
    """Percent of the bytes that differ; more than rounding is an error."""
    from PIL import Image

    one, other = (np.asarray(Image.open(path)).astype(np.int16) for path in (a, b))
    apart = np.abs(one - other)
    assert apart.max() <= 1, f"{b.name} is another map"
    return 100 * float((apart > 0).mean())


def _compared(folder: Path, source: Path, turns: int) -> tuple[Table, list[Target], list[str]]:
    files = {name: folder / f"{name}.png" for name, (_, module) in WRITERS.items() if find_spec(module)}
    calls: dict[str, Call] = {name: partial(WRITERS[name][0], source, file) for name, file in files.items()}
    times = in_turns(calls, turns, warm_up=1)
    base = times["glbump"]
    decoded = 2 * _side(source) ** 2 / MIB
    rows: list[list[Cell]] = []
    targets = []
    for name, file in files.items():
        wall, cpu = ratios(base.wall, times[name].wall), ratios(base.cpu, times[name].cpu)
        peak = _in_process(name, source, file)["MiB"]
        is_ours = name == "glbump"
        rows.append(
            [
                name,
                None if is_ours else str(wall),
                None if is_ours else str(cpu),
                float(np.median(times[name].wall)),
                file.stat().st_size / MIB,
                peak,
                peak / decoded,
                None if is_ours else _differing(files["glbump"], file),
            ]
        )
        if is_ours:
            targets.append(Target.at_most("peak memory, times the decoded input", peak / decoded, 6))
        else:
            targets.append(Target.at_most(f"time, of {name}'s", wall.median, 0.5))
    head = ("by", "glbump's time of it", "CPU time", "s", "file, MiB", "peak, MiB", "of the input", "bytes off by 1, %")
    return Table(head, rows), targets, [name for name in WRITERS if name not in files]


def _side(source: Path) -> int:
    with open_heights(source) as heights:
        return heights.width


def measure(quick: bool = False) -> Section:
    """4096x4096 in turns, then 32768x32768 once (quick: 64 and 1024)."""
    side, huge_side, turns = (64, 1024, 2) if quick else (4096, 32768, 5)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        source = _picture(folder, side)
        compared, targets, absent = _compared(folder, source, turns)
        picture_size = source.stat().st_size / MIB
        huge = _huge(folder, huge_side)
        stream = _in_process("glbump", huge, folder / "huge.png")
        targets.append(Target.at_most("peak memory of the huge map", stream["MiB"], 1024, " MiB"))
        streamed = [huge_side, 2 * huge_side**2 / MIB, huge.stat().st_size / MIB, stream["MiB"], stream["seconds"]]
    missing = f" Not measured, since not installed: {', '.join(absent)}." if absent else ""
    return Section(
        "Normals of heights",
        f"`python -m benchmarks normals`: a {side}x{side} 16-bit PNG of rock (`fbm`, {picture_size:.1f} MiB) to "
        f"an RGB8 normal map, central differences, wrapping, {turns} turns in one process, imports not counted; peak "
        "memory of a process of its own, the interpreter and its libraries included. All write the same pixels but for "
        "halves rounded otherwise. OpenCV writes by its default (level 1, runs only), Pillow at level 1: its default "
        "takes several times as long. Half of glbump's gain in wall clock is that reading, arithmetic and encoding go "
        f"on at once on every core: where others keep the cores busy, only the CPU time is left.{missing} Below, a "
        "tiled 16-bit TIFF of terraces to a PNG, in bands.",
        (
            compared,
            Table(("pixels a side", "decoded, MiB", "file, MiB", "peak, MiB", "s"), [streamed]),
        ),
        targets,
    )


if __name__ == "__main__":
    from benchmarks.command import alone

    alone(measure)
