"""Programs that turn a lat-long picture into the six faces of a cube, each as its users would call it.

`python -m benchmarks.converters NAME PICTURE.npy SIZE` makes the call once, in a process of its own, and prints as JSON
what it took.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

F32 = npt.NDArray[np.float32]
Converter = Callable[[F32, int], F32]
"""(picture (H, W, 3), size) -> six faces that lie one above another or in an array of six."""


def glbump(filter: Any) -> Converter:
    """`glbump.maps.convert.convert`."""
    from glbump.maps.convert import convert
    from glbump.maps.layout import CUBE, LATLONG, EnvironmentMap

    return lambda picture, size: convert(EnvironmentMap(LATLONG, picture[None]), CUBE, size, filter).pixels


def places(size: int, width: int, height: int) -> tuple[F32, F32]:
    """x and y (6 size, size) of the faces' texel centres in a lat-long picture, in texels from its first: NumPy in
    single precision, as a careful user of remap would write it."""
    a = ((2 * np.arange(size, dtype=np.float32) + 1) / size - 1)[None, :]
    b, one = a.T, np.ones((size, size), np.float32)
    a, b = np.broadcast_arrays(a, b)
    x = np.concatenate([one, -one, a, a, a, -a])
    y = np.concatenate([-b, -b, one, -one, -b, -b])
    z = np.concatenate([-a, a, b, -b, one, -one])
    right = (np.arctan2(x, -z) / np.float32(2 * np.pi) + np.float32(0.5)) * np.float32(width) - np.float32(0.5)
    down = np.arctan2(np.hypot(x, z), y) / np.float32(np.pi) * np.float32(height) - np.float32(0.5)
    return right, np.clip(down, 0, height - 1)


def opencv(keep: bool) -> Converter:
    """`cv2.remap`; keep: with the maps of the first call."""
    import cv2

    kept: list[tuple[F32, F32]] = []

    def call(picture: F32, size: int) -> F32:
        maps = kept[0] if kept else places(size, picture.shape[1], picture.shape[0])
        if keep and not kept:
            kept.append(maps)
        return np.asarray(cv2.remap(picture, *maps, cv2.INTER_LINEAR, borderMode=cv2.BORDER_WRAP))

    return call


def py360convert() -> Converter:
    """`py360convert.e2c`, which keeps its maps."""
    from py360convert import e2c

    return lambda picture, size: np.stack(e2c(picture, size, mode="bilinear", cube_format="list"))


def openimageio() -> Converter:
    """`ImageBufAlgo.st_warp` with its bilinear filter; keeps the places."""
    import OpenImageIO as oiio

    kept: list[Any] = []

    def call(picture: F32, size: int) -> F32:
        if not kept:
            height, width, _ = picture.shape
            x, y = places(size, width, height)
            kept.append(oiio.ImageBuf(np.stack([(x + 0.5) / width, (y + 0.5) / height], axis=-1)))
        where = oiio.ROI(0, size, 0, 6 * size, 0, 1, 0, 3)
        warped = oiio.ImageBufAlgo.st_warp(oiio.ImageBuf(picture), kept[0], "triangle", 2.0, roi=where)
        return np.asarray(warped.get_pixels(oiio.FLOAT))

    return call


CONVERTERS: dict[str, tuple[str, Callable[[], Converter]]] = {
    "glbump, bilinear": ("glbump", lambda: glbump("bilinear")),
    "glbump, area": ("glbump", lambda: glbump("area")),
    "OpenCV remap, maps kept": ("opencv-python-headless", lambda: opencv(True)),
    "OpenCV remap, maps made": ("opencv-python-headless", lambda: opencv(False)),
    "py360convert": ("py360convert", py360convert),
    "OpenImageIO st_warp": ("OpenImageIO", openimageio),
}
"""By name: the package, and what imports it."""


def there() -> dict[str, str]:
    """Version of each converter's package that is installed."""
    found = {}
    for name, (package, _) in CONVERTERS.items():
        try:
            found[name] = version(package)
        except PackageNotFoundError:
            continue
    return found


def _memory(what: str) -> float:
    """MiB that this process holds (VmRSS) or held at most (VmHWM)."""
    lines = Path("/proc/self/status").read_text().splitlines()
    return next(int(line.split()[1]) / 2**10 for line in lines if line.startswith(what))


def main(name: str, path: str, size: str) -> None:
    """Seconds of the first call, and MiB held at its peak beyond what was held before it, the picture included."""
    picture = np.load(path)
    call = CONVERTERS[name][1]()
    call(picture[:8, :16].copy(), 4)  # what is imported late, and threads
    call = CONVERTERS[name][1]()
    Path("/proc/self/clear_refs").write_text("5")  # begins VmHWM anew
    before = _memory("VmRSS")
    cpu, started = time.process_time(), time.perf_counter()
    call(picture, int(size))
    wall, cpu = time.perf_counter() - started, time.process_time() - cpu
    print(json.dumps({"wall": wall, "cpu": cpu, "MiB": _memory("VmHWM") - before}))


if __name__ == "__main__":
    main(*sys.argv[1:])
