"""`glbump normals`: exact planes, metric tilts, bands against the whole, what is written, read back and refused."""

from __future__ import annotations

import json
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import OpenImageIO as oiio
import pytest
from PIL import Image

from glbump.cli import run
from glbump.maps import normals as maps_normals
from glbump.maps import rows as maps_rows
from glbump.maps.angles import degrees_between
from glbump.maps.bspline import REACH
from glbump.maps.encodings import ENCODINGS
from glbump.maps.gradients import KERNELS, METHODS
from glbump.maps.heights import slopes, slopes_of_normals
from glbump.maps.images import read_normals
from glbump.maps.normals import FORMATS, Tilts, Ways, write_normals
from glbump.maps.png import joined_adler, paeth
from glbump.maps.rows import FiledHeights, HeldHeights, open_heights, windows

F64 = npt.NDArray[np.float64]
CASES = [(suffix, format) for suffix, formats in FORMATS.items() for format in formats if suffix != ".tiff"]


@pytest.fixture(autouse=True)
def _folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def write(name: str, pixels: npt.NDArray[Any], tile: int = 0) -> str:
    """Pixels as they are, (H, W) or (H, W, C); tile: side of the tiles of a TIFF."""
    pixels = pixels if pixels.ndim == 3 else pixels[..., None]
    spec = oiio.ImageSpec(pixels.shape[1], pixels.shape[0], pixels.shape[2], str(pixels.dtype).replace("32", ""))
    spec.tile_width = spec.tile_height = tile
    file = oiio.ImageOutput.create(name)
    assert file.open(name, spec)
    assert file.write_image(np.ascontiguousarray(pixels))
    assert file.close()
    return name


def stored(name: str) -> npt.NDArray[Any]:
    """A written map, (H, W, C), as OpenImageIO reads it."""
    file = oiio.ImageInput.open(name)
    pixels: npt.NDArray[Any] = file.read_image(0, file.spec().nchannels, file.spec().format)
    assert not file.geterror()
    return pixels


def waves(height: int, width: int, full: float = 65535) -> F64:
    """A height field that repeats, in codes: sums of waves of at least an eighth of the picture."""
    v, u = np.meshgrid((np.arange(height) + 0.5) / height, (np.arange(width) + 0.5) / width, indexing="ij")
    h = np.sin(2 * np.pi * (3 * u + v)) + 0.5 * np.cos(2 * np.pi * (5 * v - 2 * u) + 1) + 0.3 * np.sin(14 * np.pi * v)
    return (h + 1.8) / 3.6 * full


def noise(height: int, width: int) -> npt.NDArray[np.uint16]:
    return np.random.default_rng(7).integers(0, 65536, (height, width), dtype=np.uint16)


def normals_of(slope: npt.NDArray[Any]) -> F64:
    n = np.concatenate([-slope.astype(np.float64), np.ones((*slope.shape[:2], 1))], axis=-1)
    return n / np.linalg.norm(n, axis=-1, keepdims=True)


def normals(*arguments: str) -> None:
    assert run(["normals", *arguments, "-q"]) == 0


def figures(capsys: pytest.CaptureFixture[str], *arguments: str) -> dict[str, Any]:
    capsys.readouterr()
    assert run(["normals", *arguments, "--json", "-q"]) == 0
    said: dict[str, Any] = json.loads(capsys.readouterr().out)
    return said


# ------------------------------------------------------------ what the normals are


@pytest.mark.parametrize("kernel", [k for k in METHODS if k != "spectral"])
@pytest.mark.parametrize("size", [(5, 6), (33, 65), (600, 700)])
def test_a_tilted_plane_has_one_normal(kernel: str, size: tuple[int, int]) -> None:
    """Where no border is read, that of the plane itself, at every size: 3 codes a texel to the right, 2 up."""
    margin = KERNELS[kernel].reach if kernel in KERNELS else REACH + 1
    height, width = (n + 2 * margin for n in size)
    y, x = np.mgrid[height:0:-1, 0:width]
    write("plane.png", (3 * x + 2 * y).astype(np.uint16))
    texel = ("--pixel-size", "0.5,0.25", "--amplitude", "6553.5")  # 0.1 a code: slopes 0.6 and 0.8
    normals("plane.png", "-o", "n.exr", "--kernel", kernel, "--wrap", "clamp", "--format", "float", *texel)
    inside = stored("n.exr")[margin:-margin, margin:-margin]
    assert inside.shape[:2] == size
    wanted = np.array([-0.6, -0.8, 1]) / np.sqrt(2)
    assert np.abs(inside - wanted).max() < 3e-7  # float32: differences of codes are exact, then a few roundings


@pytest.mark.parametrize("kernel", METHODS)
def test_normals_are_those_of_the_slopes(kernel: str) -> None:
    """Against `slopes`, which is float64 and knows neither bands nor units."""
    h = noise(96, 120) >> 4
    write("h.png", h)
    border = "wrap" if kernel == "spectral" else "mirror"
    more = ("--amplitude", "0.5", "--tile-size", "3,2", "--wrap", border)
    normals("h.png", "-o", "n.tif", "--format", "float", "--kernel", kernel, *more)
    wanted = slopes(h / 65535, kernel, border) * 0.5 / np.array([3, 2])
    # float32 against float64: some units in the last place of a sum of eighteen terms.
    assert np.abs(stored("n.tif") - normals_of(wanted)).max() < 2e-6
    assert np.abs(stored("n.tif") - normals_of(wanted * [1, -1])).max() > 0.1


def test_flat_is_flat() -> None:
    write("h.png", np.full((40, 30), 12345, np.uint16))
    for format, code in (("rgb8", (128, 128, 255)), ("rgb16", (32768, 32768, 65535))):
        normals("h.png", "-o", "n.png", "--format", format)
        assert (stored("n.png") == code).all()


def test_bumps_are_lit_from_above() -> None:
    """A hill: red rises to the right of it, green above it; with --flip-y below it."""
    v, u = np.mgrid[-1:1:64j, -1:1:64j]
    write("hill.png", (60000 * np.exp(-4 * (u * u + v * v))).astype(np.uint16))
    normals("hill.png", "-o", "n.png", "--amplitude", "0.3")
    n = stored("n.png").astype(int)
    assert n[32, 48, 0] > 140 > 116 > n[32, 16, 0]
    assert n[16, 32, 1] > 140 > 116 > n[48, 32, 1]
    normals("hill.png", "-o", "flipped.png", "--amplitude", "0.3", "--flip-y")
    assert np.abs(stored("flipped.png") - n * [1, -1, 1] - [0, 256, 0]).max() <= 1  # a half is rounded up
    normals("hill.png", "-o", "dent.png", "--amplitude", "-0.3")
    assert np.abs(stored("dent.png") - n * [-1, -1, 1] - [256, 256, 0]).max() <= 1


def test_one_relief_at_every_resolution() -> None:
    """The same metres at 256, 512 and 1024 pixels: the same normals, but for the kernel's error, which is second order.

    The steepest wave has 7 periods: at 256 pixels central differences see it 0.5 % flatter.
    """
    means, tilts = [], []
    for n in (256, 512, 1024):
        write("h.png", np.rint(waves(n, n)).astype(np.uint16))
        normals("h.png", "-o", "n.exr", "--amplitude", "0.3", "--tile-size", "2.5", "--format", "float")
        # Blocks' means lie at the same places at every size.
        blocks = stored("n.exr").reshape(64, n // 64, 64, n // 64, 3).mean(axis=(1, 3))
        means.append(blocks)
        tilts.append(np.degrees(np.arccos(stored("n.exr")[..., 2].astype(np.float64))).mean())
    assert np.abs(means[1] - means[2]).max() < 1e-3 < np.abs(means[2]).max()
    assert np.abs(means[0] - means[2]).max() < 4e-3
    assert tilts == pytest.approx([tilts[2]] * 3, rel=0.005)


def test_pixel_size_is_tile_size_by_pixels() -> None:
    write("dem.tif", waves(40, 60, full=300).astype(np.float32))
    normals("dem.tif", "-o", "a.png", "--pixel-size", "30")
    normals("dem.tif", "-o", "b.png", "--tile-size", "1800,1200")
    normals("dem.tif", "-o", "c.png", "--tile-size", "1800")
    normals("dem.tif", "-o", "d.png", "--pixel-size", "30,15")
    a, b, c, d = (stored(f"{x}.png") for x in "abcd")
    assert np.array_equal(a, b)
    assert np.array_equal(a, c)
    assert not np.array_equal(a, d)


@pytest.mark.parametrize(("dtype", "tolerance"), [("uint8", 0), ("uint16", 0), ("uint32", 1e-6), ("float", 1e-6)])
def test_every_depth_is_one_relief(dtype: str, tolerance: float) -> None:
    """Codes that are 0..255 in each: tilts differ by rounding only."""
    eighth = np.random.default_rng(1).integers(0, 256, (20, 24))
    full = {"uint8": 255, "uint16": 65535, "uint32": 2**32 - 1, "float": 1}[dtype]
    pixels = eighth / 255 if dtype == "float" else eighth * (full // 255)
    write("a.tif", pixels.astype(dtype.replace("float", "float32")))
    normals("a.tif", "-o", "n.exr", "--format", "float", "--amplitude", "0.1")
    wanted = normals_of(slopes(eighth / 255) * 0.1 * [1, 24 / 20])
    assert np.abs(stored("n.exr") - wanted).max() < 1e-6 + tolerance


def test_small_bumps_on_a_high_plateau_keep_their_digits() -> None:
    """32-bit integers hold them; 32-bit floats of the same heights would not."""
    steps = np.random.default_rng(2).integers(0, 16, (16, 16))
    write("a.tif", (4_000_000_000 + steps).astype(np.uint32))
    normals("a.tif", "-o", "n.exr", "--format", "float", "--amplitude", "1e7")
    wanted = normals_of(slopes(steps.astype(float)) * 1e7 / (2**32 - 1))
    assert np.abs(stored("n.exr") - wanted).max() < 1e-6


# ------------------------------------------------------------ bands


@pytest.mark.parametrize("kernel", KERNELS)
@pytest.mark.parametrize("border", ["wrap", "clamp", "mirror"])
@pytest.mark.parametrize("tile", [0, 64])
def test_bands_are_the_whole(kernel: str, border: str, tile: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """To the last bit, in PNG (whose first rows come last where it wraps) and in TIFF, read in rows and in tiles."""
    write("h.tif", noise(333, 200) >> 5, tile)
    ways = Ways(0.3, (1 / 200, 1 / 333), kernel, border)
    with open_heights(Path("h.tif")) as held:
        assert isinstance(held, HeldHeights)
        write_normals(held, ways, Path("whole.png"))
    monkeypatch.setattr(maps_rows, "HELD_PIXELS", 0)
    monkeypatch.setattr(maps_normals, "_READ", 200 * 40)
    monkeypatch.setattr(maps_normals, "_BLOCK", 200 * 7)
    for name in ("bands.png", "bands.tif"):
        with open_heights(Path("h.tif")) as filed:
            assert isinstance(filed, FiledHeights)
            write_normals(filed, ways, Path(name))
        assert np.array_equal(stored(name), stored("whole.png"))
    # Rows one off, and another border, are not the same.
    assert not np.array_equal(stored("whole.png"), np.roll(stored("whole.png"), 1, axis=0))


@pytest.mark.parametrize("border", ["wrap", "clamp", "mirror"])
@pytest.mark.parametrize("late", [0, 2])
@pytest.mark.parametrize(("tall", "step"), [(4, 4), (5, 1), (13, 4), (13, 5), (12, 4), (9, 100)])
def test_windows_are_the_rows_and_their_neighbours(border: str, late: int, tall: int, step: int) -> None:
    reach = 2
    write("h.tif", np.arange(tall, dtype=np.uint16)[:, None] * np.ones(3, np.uint16))
    file = oiio.ImageInput.open("h.tif")
    filed = FiledHeights(file, Path("h.tif"), 0, oiio.UINT16, 65535.0)
    held = HeldHeights(filed.read(0, tall), 65535.0, "held")
    mode: Any = {"wrap": "wrap", "clamp": "edge", "mirror": "symmetric"}[border]
    order = np.pad(np.arange(tall), reach, mode=mode)
    for heights, last in ((filed, late if border == "wrap" else 0), (held, 0)):
        seen = []
        for row, window in windows(heights, reach, border, step, last):
            end = row + len(window) - 2 * reach
            assert np.array_equal(window[:, 0], order[row : end + 2 * reach])
            seen += range(row, end)
        assert seen == [*range(last, tall), *range(last)]


@pytest.mark.parametrize("shape", [(1, 1), (1, 9), (9, 1), (2, 2), (3, 2)])
@pytest.mark.parametrize("kernel", METHODS)
def test_small_pictures_are_defined(shape: tuple[int, int], kernel: str) -> None:
    h = noise(*shape)
    write("h.png", h)
    normals(
        "h.png", "-o", "n.exr", "--format", "float", "--amplitude", "0.01", "--tile-size", "1,1", "--kernel", kernel
    )
    assert np.abs(stored("n.exr") - normals_of(slopes(h / 65535, kernel) * 0.01)).max() < 2e-6


# ------------------------------------------------------------ what is written


@pytest.mark.parametrize(("suffix", "format"), CASES)
def test_there_and_back(suffix: str, format: str) -> None:
    """What is read of each format is off by no more than that format states."""
    write("h.png", noise(48, 64))
    normals("h.png", "-o", f"n{suffix}", "--format", format, "--amplitude", "0.01")
    e = ENCODINGS[format]
    codes = stored(f"n{suffix}")
    read = e.decode(codes.astype(np.float16) if format == "half" else codes)
    wanted = normals_of(slopes(noise(48, 64) / 65535) * 0.01 * [1, 64 / 48])
    # float32 adds 1e-5 degrees to what is stored in more than 8 bits.
    assert degrees_between(read, wanted).max() <= e.worst_45 * 1.001 + 1e-5
    assert degrees_between(read, wanted).max() > e.worst_45 / 8


@pytest.mark.parametrize(
    ("suffix", "format"), [(".png", "rgb8"), (".png", "rgb16"), (".tif", "rgb16"), (".exr", "half"), (".tif", "float")]
)
def test_glbump_reads_it_back_as_slopes(suffix: str, format: str) -> None:
    write("h.png", noise(48, 64))
    normals("h.png", "-o", f"n{suffix}", "--format", format, "--amplitude", "0.01")
    read = slopes_of_normals(read_normals(Path(f"n{suffix}")).pixels)
    wanted = slopes(noise(48, 64) / 65535) * 0.01 * [1, 64 / 48]
    assert degrees_between(normals_of(read), normals_of(wanted)).max() <= ENCODINGS[format].worst_45 * 1.001 + 1e-5


@pytest.mark.parametrize("format", FORMATS[".png"])
@pytest.mark.parametrize("late", [True, False])
def test_a_png_is_one_for_every_reader(format: str, late: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """Pieces, room and all: Pillow, OpenImageIO and zlib itself, which checks the sum over all pieces."""
    if late:
        monkeypatch.setattr(maps_rows, "HELD_PIXELS", 0)
    monkeypatch.setattr(maps_normals, "_READ", 300 * 50)
    write("h.png", noise(220, 300))
    normals("h.png", "-o", "n.png", "--format", format)
    data, at, kinds, packed = Path("n.png").read_bytes(), 8, [], b""
    while at < len(data):
        length, kind = int.from_bytes(data[at : at + 4], "big"), data[at + 4 : at + 8]
        kinds.append(kind)
        packed += data[at + 8 : at + 8 + length] if kind == b"IDAT" else b""
        assert zlib.crc32(data[at + 4 : at + 8 + length]) == int.from_bytes(
            data[at + 8 + length : at + 12 + length], "big"
        )
        at += length + 12
    assert kinds[0] == b"IHDR"
    assert kinds[-1] == b"IEND"
    assert kinds.count(b"IDAT") > 5
    bytes_a_row = 1 + 300 * (6 if format == "rgb16" else 3)
    assert len(zlib.decompress(packed)) == 220 * bytes_a_row
    if format != "rgb16":  # Pillow has no colours of 16 bits.
        assert np.array_equal(np.asarray(Image.open("n.png")), stored("n.png"))


def test_sums_of_pieces_are_joined() -> None:
    data = np.random.default_rng(3).integers(0, 256, 200_000, dtype=np.uint8).tobytes()
    for cut in (0, 1, 65521, 131042, 200_000):
        assert joined_adler(zlib.adler32(data[:cut]), zlib.adler32(data[cut:]), len(data) - cut) == zlib.adler32(data)


def test_paeth_is_pngs() -> None:
    """Every three bytes of a kind: the predictor as the PNG specification words it, in whole numbers."""
    values = np.array([0, 1, 2, 3, 63, 64, 126, 127, 128, 129, 200, 253, 254, 255])
    a, b, c = np.meshgrid(values, values, values)
    p = a + b - c
    pa, pb, pc = np.abs(p - a), np.abs(p - b), np.abs(p - c)
    wanted = np.where((pa <= pb) & (pa <= pc), a, np.where(pb <= pc, b, c))
    assert np.array_equal(paeth(*(x.astype(np.uint8) for x in (a, b, c))), wanted)
    assert len({*np.unique(pa <= pb), *np.unique(wanted == c)}) == 2


def test_nothing_is_left_of_a_file_that_failed_half_way(monkeypatch: pytest.MonkeyPatch) -> None:
    write("h.png", noise(300, 200))
    Path("n.png").write_bytes(b"old")
    encoded, calls = maps_normals._encoded, iter(range(99))

    def failing(*arguments: Any) -> Any:
        if next(calls) == 3:
            raise OSError(28, "No space left on device")
        return encoded(*arguments)

    monkeypatch.setattr(maps_normals, "_encoded", failing)
    monkeypatch.setattr(maps_normals, "_READ", 200 * 20)
    for name in ("n.png", "n.tif", "n.exr"):
        calls = iter(range(99))
        assert run(["normals", "h.png", "-o", name, "-q"]) == 1
    assert sorted(p.name for p in Path().iterdir()) == ["h.png", "n.png"]
    assert Path("n.png").read_bytes() == b"old"


# ------------------------------------------------------------ what is said


def test_what_is_said(capsys: pytest.CaptureFixture[str]) -> None:
    write("h.png", noise(48, 64))
    said = figures(capsys, "h.png", "-o", "n.png", "--amplitude", "0.01", "--tile-size", "2")
    n = normals_of(slopes(noise(48, 64) / 65535) * 0.01 / [2, 1.5])
    tilt = np.degrees(np.arccos(n[..., 2]))
    assert said["tilt_mean"] == pytest.approx(tilt.mean(), rel=1e-5)
    assert said["tilt_worst"] == pytest.approx(tilt.max(), rel=1e-5)
    assert said["cost_worst"] == pytest.approx(ENCODINGS["rgb8"].worst_45)
    assert said["size"] == [64, 48]
    assert said["notes"] == []
    assert run(["normals", "h.png", "-o", "n.png"]) == 0
    out, err = capsys.readouterr()
    assert out.startswith("n.png  64x48 rgb8, central, wrap: tilts by ")
    assert out.count("\n") == 1
    assert "no --amplitude: the whole range of 65535 is taken as 0.05, where the tile is 1 wide" in err


@pytest.mark.parametrize(("amplitude", "note"), [("1e30", "steeper than 89.43"), ("1e-30", "flat"), ("0", "flat")])
@pytest.mark.parametrize("format", ["rgb8", "rgb16", "oct24"])
def test_any_amplitude_is_a_map(amplitude: str, note: str, format: str, capsys: pytest.CaptureFixture[str]) -> None:
    write("h.png", noise(48, 64))
    said = figures(capsys, "h.png", "-o", "n.png", "--amplitude", amplitude, "--format", format)
    assert len(said["notes"]) == 1
    assert note in said["notes"][0]
    read = ENCODINGS[format].decode(stored("n.png"))
    assert slopes_of_normals(read).shape == (48, 64, 2)  # none points into the surface
    if amplitude == "1e30":
        steep = slopes(noise(48, 64) / 65535).any(axis=-1).sum()
        assert said["notes"][0].startswith(f"{steep} of {48 * 64} normals (first at row 0, column 0)")
        # They lean as the slopes do.
        across = normals_of(slopes(noise(48, 64) / 65535) * 1e6 * [1, 64 / 48])[..., :2]
        assert np.abs(read[..., :2] - across)[across.any(axis=-1)].max() < 0.02


def test_steps_of_1e30_are_a_map(capsys: pytest.CaptureFixture[str]) -> None:
    h = np.zeros((8, 9), np.float32)
    h[3, 4], h[5, 6], h[6, 1] = 1e30, -1e30, 1e-44  # the last is denormal
    write("h.tif", h)
    for kernel in METHODS:
        said = figures(capsys, "h.tif", "-o", "n.exr", "--amplitude", "1e6", "--kernel", kernel, "--format", "float")
        n = stored("n.exr")
        assert np.isfinite(n).all()
        assert (n[..., 2] > 0).all()
        assert "steeper" in said["notes"][0]


# ------------------------------------------------------------ what is refused


@pytest.mark.parametrize("held", [True, False])
def test_heights_that_are_none_are_counted_and_placed(
    held: bool, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    h = np.zeros((50, 40), np.float32)
    h[31, 7], h[40, 2], h[49, 39] = np.nan, np.inf, 2e30
    write("h.tif", h)
    if not held:
        monkeypatch.setattr(maps_rows, "HELD_PIXELS", 0)
        monkeypatch.setattr(maps_normals, "_READ", 40 * 8)
    assert run(["normals", "h.tif", "-o", "n.png"]) == 1
    line = capsys.readouterr().err.strip().splitlines()[-1]
    assert "3 of 2000 are not (1 NaN), the first in row 31, column 7: nan; repair or scale the picture" in line
    assert not Path("n.png").exists()


def test_what_cannot_be_done_is_refused_in_a_line(capsys: pytest.CaptureFixture[str]) -> None:
    write("h.png", noise(8, 8))
    write("colour.png", np.dstack([noise(8, 8), noise(8, 8) // 2, noise(8, 8)]))
    Path("empty.png").write_bytes(b"")
    Path("cut.png").write_bytes(Path("h.png").read_bytes()[:90])
    for arguments, code, text in (
        (("h.png", "-o", "n.jpg"), 1, "unknown suffix '.jpg'"),
        (("h.png", "-o", "n.png", "--format", "half"), 1, "choose one of: rgb8, rgb16, oct24"),
        (("h.png", "-o", "h.png"), 1, "is one of the files that this picture is made from"),
        (("h.png", "-o", "no/n.png"), 1, "there is no directory no"),
        (("h.png", "-o", "n.png", "--kernel", "sobl"), 2, "did you mean 'sobel'?"),
        (("h.png", "-o", "n.png", "--wrap", "repeat"), 2, "choose one of: wrap, clamp, mirror"),
        (("h.png", "-o", "n.png", "--kernel", "spectral", "--wrap", "clamp"), 1, "use bspline"),
        (("h.png", "-o", "n.png", "--tile-size", "0"), 2, "a length above 0"),
        (("h.png", "-o", "n.png", "--tile-size", "1,2,3"), 2, "a length above 0, or two"),
        (("h.png", "-o", "n.png", "--tile-size", "1", "--pixel-size", "1"), 2, "give one of them"),
        (("h.png", "-o", "n.png", "--amplitude", "nan"), 2, "a finite length"),
        (("h.png", "-o", "n.png", "--amplitude", "1e30", "--tile-size", "1e-9"), 1, "at most 1e+37 times as long"),
        (("colour.png", "-o", "n.png"), 1, "must be grey; 64 of 64 pixels"),
        (("empty.png", "-o", "n.png"), 1, "is empty"),
        (("cut.png", "-o", "n.png"), 1, "is damaged or truncated"),
        (("none.png", "-o", "n.png"), 1, "no such file"),
    ):
        capsys.readouterr()
        assert run(["normals", *arguments]) == code, arguments
        err = capsys.readouterr().err
        assert text in err, arguments
        assert len(err.splitlines()) <= 2, arguments  # a note may stand before the error
        assert not Path("n.png").exists()
    normals("colour.png", "-o", "n.png", "--channel", "g")


def test_a_kernel_of_the_whole_map_says_its_limit_before_it_takes_it() -> None:
    class Huge(HeldHeights):
        def read(self, first: int, end: int) -> Any:
            raise AssertionError("read before it was refused")

    huge = Huge(np.zeros((1, 1), np.uint8), 255.0, "huge.tif")
    huge.width = huge.height = 32768
    from glbump.errors import LimitError

    for kernel in ("bspline", "spectral"):
        with pytest.raises(LimitError, match=r"huge.tif: the kernel .* takes 68719476736 bytes .* use --kernel fourth"):
            write_normals(huge, Ways(1.0, (1.0, 1.0), kernel), Path("n.png"))


def test_what_is_damaged_further_down_leaves_no_file(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(maps_rows, "HELD_PIXELS", 0)
    write("h.tif", noise(300, 200))
    data = bytearray(Path("h.tif").read_bytes())
    data[len(data) // 2 : len(data) // 2 + 2000] = b"\xff" * 2000
    Path("h.tif").write_bytes(data)
    assert run(["normals", "h.tif", "-o", "n.png", "-q"]) == 1
    assert not Path("n.png").exists()


def test_tilts_add_up() -> None:
    a, b = Tilts(2, 10.0, 7.0, 1, (5, 5)), Tilts(3, 5.0, 2.0, 2, (4, 9))
    assert a + b == b + a == Tilts(5, 15.0, 7.0, 3, (4, 9))
    assert (a + b).mean == 3.0
    assert a + Tilts() == a
