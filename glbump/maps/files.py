"""Writing: whole files or none, and pictures by suffix.

PNG is written here, with zlib and nothing else, because it is what a cold `glbump render` ends with: 512x512
takes 12 to 20 ms. Pillow needs 15 to 20 ms to be imported and 50 to 60 to write at the same level,
OpenImageIO 30 and 110. JPEG and WebP are Pillow's, the float formats OpenImageIO's.
"""

from __future__ import annotations

import io
import os
import struct
import zlib
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from glbump.errors import GlbumpError, ImageError, unknown
from glbump.maps.colour import Floats, alpha_bytes, display_bytes, tone_map

DISPLAY_SUFFIXES = (".png", ".jpg", ".jpeg", ".webp")
"""8 bits a channel, tone-mapped, sRGB."""

LINEAR_SUFFIXES = (".exr", ".hdr", ".tif", ".tiff")
"""Linear light in floats, of any range."""

_WITH_ALPHA = (".png", ".webp", ".exr", ".tif", ".tiff")

# OpenEXR's zip at level 1: half the time of its default level for 5 % more bytes. TIFF's takes a second.
_COMPRESSION = {".exr": "zip:1"}


def cache_folder() -> Path:
    """Where this user's glbump keeps what can be made again (XDG Base Directory Specification); need not be there."""
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "glbump"


def write_atomically(
    path: str | os.PathLike[str],
    content: bytes | Callable[[Path], None],
    *,
    error: type[GlbumpError] = ImageError,
) -> None:
    """Write a file whole or not at all: beside the target, fsync, then renamed over it.

    content: the bytes, or a function that writes the file whose path it is given (same suffix).
    Raises `error`, one line, where the target cannot be written; nothing is left behind then.
    """
    path = Path(path)
    try:
        target = path.resolve()  # A link keeps pointing at the file, which is the one to be replaced.
        _check_target(path, target, error)
        beside = target.with_name(f".{target.stem[:100]}.{os.urandom(4).hex()}{target.suffix}")
        try:
            _fill(beside, content)
            if target.exists():
                beside.chmod(target.stat().st_mode)
            beside.replace(target)
        finally:
            beside.unlink(missing_ok=True)
    except (OSError, ValueError) as why:
        raise error(_unwritable(path, why)) from None


def check_target(
    path: str | os.PathLike[str], *, tone: str = "clip", exposure: float = 0.0, inputs: Iterable[Path] = ()
) -> None:
    """The errors of `write_picture` that do not depend on the pixels: to be had before they are drawn.

    inputs: files that the pixels are made from, which are not to be written over.
    """
    path = Path(path)
    _check_tone(path, _suffix(path, DISPLAY_SUFFIXES + LINEAR_SUFFIXES), tone, exposure)
    check_writable(path, inputs)


def check_writable(path: Path, inputs: Iterable[Path] = ()) -> None:
    """ImageError where `write_atomically` could not write a file, or would write over one of `inputs`."""
    try:
        target = path.resolve()
        _check_target(path, target, ImageError)
        if any(target == file.resolve() for file in inputs):
            raise ImageError(f"{path}: is one of the files that this picture is made from; choose another name")
    except (OSError, ValueError) as why:
        raise ImageError(_unwritable(path, why)) from None


def _unwritable(path: Path, why: Exception) -> str:
    reason = (getattr(why, "strerror", None) or str(why)).lower()
    return f"{path}: cannot be written: {reason}; free or choose another place"


def _check_target(path: Path, target: Path, error: type[GlbumpError]) -> None:
    if target.is_dir():
        raise error(f"{path}: is a directory; give the name of a file in it")
    if not target.parent.is_dir():
        raise error(f"{path}: there is no directory {path.parent}; make it first")
    if target.exists() and not target.is_file():
        raise error(f"{path}: is no regular file; give the name of a file")
    if target.exists() and not os.access(target, os.W_OK):
        raise error(f"{path}: is write-protected; choose another name or allow writing")


def _fill(beside: Path, content: bytes | Callable[[Path], None]) -> None:
    # os.open, not tempfile: the file gets the rights any new file would get here.
    descriptor = os.open(beside, os.O_RDWR | os.O_CREAT | os.O_EXCL, 0o666)
    try:
        if callable(content):
            content(beside)
            # A library may have made the file anew; the descriptor to sync is the one at that path now.
            os.close(descriptor)
            descriptor = os.open(beside, os.O_RDWR)
        else:
            view = memoryview(content)
            while view:
                view = view[os.write(descriptor, view) :]
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def png_bytes(pixels: npt.NDArray[np.uint8], *, srgb: bool = True) -> bytes:
    """A PNG file of (H, W, C) bytes: grey, grey and alpha, RGB or RGBA for C of 1, 2, 3 or 4.

    srgb: say in the file that the values are sRGB-encoded. Straight alpha, as PNG wants it.
    """
    height, width, channels = pixels.shape
    colour_type = {1: 0, 2: 4, 3: 2, 4: 6}[channels]
    # Filter 1, differences to the left neighbour, at level 1: of all filters and levels the smallest file
    # for its time (measured on renders: level 6 takes five times as long for 10 % less).
    rows = pixels.reshape(height, width * channels)
    filtered = np.empty((height, 1 + width * channels), np.uint8)
    filtered[:, 0] = 1
    filtered[:, 1 : 1 + channels] = rows[:, :channels]
    np.subtract(rows[:, channels:], rows[:, :-channels], out=filtered[:, 1 + channels :])
    parts = [
        (b"IHDR", struct.pack(">IIBBBBB", width, height, 8, colour_type, 0, 0, 0)),
        *([(b"sRGB", b"\0")] if srgb else []),
        (b"IDAT", zlib.compress(filtered.data, 1)),
        (b"IEND", b""),
    ]
    chunks = (
        struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(data, zlib.crc32(kind)))
        for kind, data in parts
    )
    return b"\x89PNG\r\n\x1a\n" + b"".join(chunks)


def write_display(path: str | os.PathLike[str], pixels: npt.NDArray[np.uint8], *, srgb: bool = True) -> None:
    """Write bytes (H, W, 1 to 4) as they are to .png, .jpg or .webp; alpha of 255 everywhere is left out.

    srgb: whether a PNG says that its values are sRGB-encoded.
    """
    path = Path(path)
    suffix = _suffix(path, DISPLAY_SUFFIXES)
    pixels = without_opaque_alpha(pixels)
    _require_alpha_fits(path, pixels.shape[2])
    content = png_bytes(pixels, srgb=srgb) if suffix == ".png" else _photo_bytes(pixels, suffix, path)
    write_atomically(path, content)


def without_opaque_alpha(pixels: npt.NDArray[np.uint8]) -> npt.NDArray[np.uint8]:
    """Bytes (H, W, C) without their alpha where it is 255 everywhere, contiguous."""
    opaque = pixels.shape[2] in (2, 4) and bool((pixels[..., -1] == 255).all())
    return np.ascontiguousarray(pixels[..., :-1] if opaque else pixels)


def write_picture(
    path: str | os.PathLike[str], pixels: npt.ArrayLike, *, tone: str = "clip", exposure: float = 0.0
) -> None:
    """Write linear light, by suffix: .png .jpg .webp tone-mapped 8-bit sRGB, .exr .hdr .tif linear floats.

    pixels: floats (H, W) or (H, W, C), row 0 on top: grey, grey and alpha, RGB or RGBA, with straight alpha.
    A float16 array makes a half-float .exr, every other type float32. An .exr holds colour times alpha, as
    OpenEXR wants it. Alpha of 1 everywhere is left out; .jpg and .hdr take no other.
    ImageError for NaN, for infinities and negative values the format cannot hold, for an unwritable target.
    """
    path = Path(path)
    suffix = _suffix(path, DISPLAY_SUFFIXES + LINEAR_SUFFIXES)
    array = _picture_array(path, pixels)
    require_no_nan(array, str(path))
    colours = array.shape[2] - 1 + array.shape[2] % 2
    colour, alpha = array[..., :colours], array[..., colours:]
    if suffix in DISPLAY_SUFFIXES:
        shown = [display_bytes(colour, tone, exposure), alpha_bytes(alpha)]
        write_display(path, np.concatenate(shown, axis=2))
        return
    _check_tone(path, suffix, tone, exposure)
    if alpha.size and (alpha == 1).all():
        array = colour
    elif alpha.size and suffix == ".exr":
        array = np.concatenate([colour * alpha, alpha], axis=2)
    _require_alpha_fits(path, array.shape[2])
    _require_range(path, suffix, array)
    dtype = np.float16 if suffix == ".exr" and array.dtype == np.float16 else np.float32
    stored = np.ascontiguousarray(array, dtype=dtype)
    write_atomically(path, lambda beside: _write_floats(beside, stored, path))


def require_no_nan(pixels: npt.NDArray[Any], name: str) -> None:
    """ImageError that counts the pixels of (H, W, C) that hold NaN; no colour stands for it."""
    if pixels.dtype == np.float16:
        # A half is NaN when its bits, less the sign, are above infinity's; ten times faster than isnan.
        nan = int((pixels.view(np.uint16) & 0x7FFF).max()) > 0x7C00
    else:
        nan = bool(np.isnan(pixels.min()))
    if nan:
        bad = np.isnan(pixels).any(axis=2)
        row, column = np.unravel_index(int(bad.argmax()), bad.shape)
        raise ImageError(
            f"{name}: {int(bad.sum())} of {bad.size} pixels are NaN (first at row {row}, column {column}); "
            "not written, since no colour stands for NaN"
        )


def _suffix(path: Path, allowed: tuple[str, ...]) -> str:
    suffix = path.suffix.lower()
    if suffix not in allowed:
        raise ImageError(f"{path}: {unknown('suffix', path.suffix, allowed)}")
    return suffix


def _check_tone(path: Path, suffix: str, tone: str, exposure: float) -> None:
    if suffix in DISPLAY_SUFFIXES:
        tone_map(0.0, tone, exposure)  # raises what it would raise for pixels
    elif tone != "clip" or exposure != 0:
        raise ImageError(
            f"{path}: {suffix} holds linear light, with no tone map or exposure; leave both out, "
            f"or write one of {', '.join(DISPLAY_SUFFIXES)}"
        )


def _picture_array(path: Path, pixels: npt.ArrayLike) -> Floats:
    array = np.asarray(pixels)
    if array.dtype.kind != "f":
        raise ImageError(f"{path}: pixels must be floats in linear light; got {array.dtype}")
    if array.ndim == 2:
        array = array[..., None]
    if array.ndim != 3 or array.size == 0 or array.shape[2] > 4:
        raise ImageError(f"{path}: pixels must be (H, W) or (H, W, 1 to 4), not empty; got {array.shape}")
    return array


def _require_alpha_fits(path: Path, channels: int) -> None:
    if channels in (2, 4) and path.suffix.lower() not in _WITH_ALPHA:
        raise ImageError(
            f"{path}: {path.suffix} holds no alpha, and the picture is transparent in places; "
            f"write one of {', '.join(_WITH_ALPHA)}, or show a background"
        )


def _require_range(path: Path, suffix: str, array: Floats) -> None:
    low, high = float(array.min()), float(array.max())
    if suffix == ".hdr" and low < 0:
        raise ImageError(f"{path}: .hdr holds no negative values; got {low:g}; write .exr instead")
    if not (np.isfinite(low) and np.isfinite(high)):
        count = int((~np.isfinite(array)).any(axis=2).sum())
        raise ImageError(f"{path}: {count} of {array[..., 0].size} pixels are infinite; nothing could read them")


def _photo_bytes(pixels: npt.NDArray[np.uint8], suffix: str, path: Path) -> bytes:
    """A JPEG or WebP file, made in memory: on a full disk OpenImageIO's writers end the process or never end."""
    from PIL import Image

    # Quality 95 without chroma subsampling shows no blocks.
    options = {"lossless": True} if suffix == ".webp" else {"quality": 95, "subsampling": 0}
    file = io.BytesIO()
    try:
        picture = Image.fromarray(pixels[..., 0] if pixels.shape[2] == 1 else pixels)
        picture.save(file, "WEBP" if suffix == ".webp" else "JPEG", **options)
    except (OSError, ValueError) as why:
        raise ImageError(f"{path}: cannot be written: {why}; write .png instead") from None
    return file.getvalue()


def _write_floats(beside: Path, pixels: npt.NDArray[Any], path: Path) -> None:
    """Write .exr, .hdr or .tif through OpenImageIO to `beside`; messages name `path`."""
    suffix = path.suffix.lower()
    if pixels.shape[2] == 1 and suffix == ".hdr":  # It has no grey.
        pixels = np.repeat(pixels, 3, axis=2)
    height, width, channels = pixels.shape
    attributes: dict[str, Any] = {"compression": _COMPRESSION.get(suffix, "none")}
    if channels in (2, 4):
        attributes["oiio:UnassociatedAlpha"] = 0 if suffix == ".exr" else 1
    names = ("R", "G", "B", "A")[:channels] if channels > 2 else ("Y", "A")[:channels]
    write_rows(beside, path, (width, height), names, pixels.dtype, [pixels], attributes)


def write_rows(
    beside: Path,
    path: Path,
    size: tuple[int, int],
    names: tuple[str, ...],
    dtype: np.dtype[Any],
    rows: Iterable[npt.NDArray[Any]],
    attributes: dict[str, Any],
) -> None:
    """Write .exr, .hdr or .tif through OpenImageIO to `beside`, some rows (n, W, C) after others; messages name `path`.

    size: width, height. names: of the channels. attributes: for the file, by OpenImageIO's names.
    """
    import OpenImageIO as oiio

    try:
        str(beside).encode()
    except UnicodeEncodeError:
        raise ImageError(f"{path}: is no name in UTF-8, which {path.suffix} needs; choose another name") from None
    spec = oiio.ImageSpec(*size, len(names), {"float16": "half", "float32": "float"}.get(dtype.name, dtype.name))
    spec.channelnames = names
    if "A" in names:
        spec.alpha_channel = names.index("A")
    for name, value in attributes.items():
        spec.attribute(name, value)
    file = oiio.ImageOutput.create(str(beside))
    if file is None:
        raise ImageError(f"{path}: cannot be written: {_one_line(oiio.geterror())}")
    written, row = file.open(str(beside), spec), 0
    for some in rows if written else ():
        written = written and file.write_scanlines(row, row + len(some), 0, some)
        row += len(some)
    error = file.geterror()
    if written and not error and file.close():
        # The last buffer is written by close(), which reports nothing; a full disk shows in the last row.
        error = "" if _has_row(beside, size[1] - 1) else "the file is cut off; is the disk full?"
    elif not error:
        error = "the library gives no reason"
    if error:
        raise ImageError(f"{path}: cannot be written: {_one_line(error.replace(str(beside), str(path)))}")


def _has_row(path: Path, row: int) -> bool:
    import OpenImageIO as oiio

    file = oiio.ImageInput.open(str(path))
    if file is None:
        oiio.geterror()  # An error that nobody asks for is printed when the process ends.
        return False
    read = file.read_scanlines(row, row + 1, 0, 0, 1, oiio.FLOAT) is not None
    return read and not file.geterror()


def _one_line(text: str) -> str:
    return " / ".join(part.strip() for part in text.splitlines() if part.strip())
