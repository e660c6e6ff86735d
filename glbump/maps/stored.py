"""A picture as its file, or an array, holds it: decoded, upright, within limits, finite; not yet interpreted.

OpenImageIO reads every format but texture files: Pillow has no 16-bit RGB and no float, and a second reader would be
a second set of rules. It is imported at the first file, not before (30 to 70 ms). KTX2 it does not know; of DDS it
knows no floats, and calls a cube map OpenEXR's, whose faces lie otherwise (`maps.containers`).
"""

from __future__ import annotations

import math
import os
import zlib
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, runtime_checkable

import numpy as np
import numpy.typing as npt

from glbump.errors import ImageError
from glbump.frozen import Frozen

if TYPE_CHECKING:
    from glbump.maps.containers.levels import TextureLevels

MAX_PIXELS = 2**28
"""Most pixels of a picture (16384 x 16384); the environment variable GLBUMP_MAX_PIXELS replaces it."""

MAX_BYTES = 2**31
"""Most bytes of a picture decoded to float32 (2 GiB); the variable GLBUMP_MAX_BYTES replaces it."""

FORMATS = ("bmp", "dds", "hdr", "jpeg", "jpegxl", "ktx2", "openexr", "png", "psd", "targa", "tiff", "webp")
"""The formats that are read, by OpenImageIO's names. Not all it knows: some make pixels out of any file."""

_ENVMAPS = {"LatLong Environment": "latlong", "CubeFace Environment": "cube"}

# Scalar types: OpenImageIO's name -> bits, float or not. Signed integers have no agreed meaning as colour.
SCALARS = {
    "uint8": (8, False),
    "uint16": (16, False),
    "uint": (32, False),
    "half": (16, True),
    "float": (32, True),
    "double": (64, True),
}

# What the TIFF and EXIF tag asks of the stored rows: to be transposed, then turned upside down, mirrored.
_ORIENTATIONS = {
    1: (False, False, False),
    2: (False, False, True),
    3: (False, True, True),
    4: (False, True, False),
    5: (True, False, False),
    6: (True, False, True),
    7: (True, True, True),
    8: (True, True, False),
}


@runtime_checkable
class ArraySource(Protocol):
    """A picture given as an array: `pixels` is (H, W), (H, W, C) or six faces (6, N, N, C): linear floats,
    or uint8 or uint16 as files hold them."""

    @property
    def pixels(self) -> npt.NDArray[Any]: ...


Source = Path | ArraySource


class Stored(Frozen, eq=False):
    """pixels: (H, W, C) of the stored type; channels: their names, of "Y", "R", "G", "B", "A".

    Alpha is straight, except where `premultiplied`: OpenEXR keeps colour times alpha.
    """

    pixels: npt.NDArray[Any]
    channels: tuple[str, ...]
    bits: int
    is_float: bool
    name: str
    envmap: str | None = None
    says_linear: bool = False
    premultiplied: bool = False

    def colours(self) -> tuple[int, int, int]:
        """Indices of red, green and blue; three times the one of a grey picture."""
        if "Y" in self.channels:
            y = self.channels.index("Y")
            return (y, y, y)
        return (self.channels.index("R"), self.channels.index("G"), self.channels.index("B"))

    def channel(self, letter: str) -> int:
        """Index of the channel "r", "g", "b" or "a"."""
        name = letter.upper()
        if name in ("R", "G", "B") and "Y" in self.channels:
            return self.channels.index("Y")
        if name not in self.channels:
            held = ", ".join(c.lower() for c in self.channels).replace("y", "grey")
            raise ImageError(f"{self.name}: no channel {letter!r}; it has {held}")
        return self.channels.index(name)


def read_stored(source: Source, *, finite: bool = True) -> Stored:
    """The picture as stored. finite: ImageError where a value is not; without it NaN and infinities are handed on."""
    stored = _read_file(source) if isinstance(source, str | os.PathLike) else _from_array(source)
    if stored.is_float and finite:
        require_finite(stored.pixels, stored.name)
    return stored


def _from_array(source: ArraySource) -> Stored:
    pixels = np.asarray(source.pixels)
    is_float = pixels.dtype not in (np.uint8, np.uint16)
    if is_float:
        pixels = pixels.astype(np.float32, copy=False)
    name = f"array{pixels.shape}"
    if pixels.ndim == 4 and pixels.shape[0] == 6:
        pixels = pixels.reshape(-1, *pixels.shape[2:])
    if pixels.ndim == 2:
        pixels = pixels[..., None]
    if pixels.ndim != 3 or pixels.size == 0 or pixels.shape[2] > 4:
        raise ImageError(f"{name}: must be (H, W), (H, W, 1 to 4) or six faces (6, N, N, 1 to 4), not empty")
    channels = (("Y",), ("Y", "A"), ("R", "G", "B"), ("R", "G", "B", "A"))[pixels.shape[2] - 1]
    return Stored(pixels, channels, 8 * pixels.dtype.itemsize, is_float, name)


def _limit(name: str, default: int) -> int:
    text = os.environ.get(name, "")
    if not text:
        return default
    if not text.isdecimal() or int(text) < 1:
        raise ImageError(f"environment variable {name} must be a whole number above 0; got {text!r}")
    return int(text)


def check_file(path: Path) -> None:
    """ImageError unless `path` is a file with something in it (and no pipe, which would wait for ever)."""
    try:
        if path.is_dir():
            raise ImageError(f"{path}: is a directory; give a picture file")
        if not path.exists():
            raise ImageError(f"{path}: no such file; check the path (relative to {Path.cwd()})")
        if not path.is_file():
            raise ImageError(f"{path}: is no regular file; give a picture file")
        with path.open("rb") as file:
            if not file.read(1):
                raise ImageError(f"{path}: is empty (0 bytes); give a picture file")
    except (OSError, ValueError) as error:
        raise ImageError(f"{path}: cannot be read: {getattr(error, 'strerror', None) or error}") from None


def _check_name(path: Path) -> None:
    """ImageError for a name that OpenImageIO cannot be given."""
    try:
        str(path).encode()
    except UnicodeEncodeError:
        raise ImageError(f"{path}: its name is no UTF-8 text; rename the file") from None


def _require_whole_png(path: Path) -> None:
    """ImageError for a PNG whose chunks do not add up: libpng would say so on stderr, beside our one line."""
    with path.open("rb") as file:
        if file.read(8) != b"\x89PNG\r\n\x1a\n":
            return
        size, kind = path.stat().st_size, b""
        while kind != b"IEND":
            head = file.read(8)
            length, kind = int.from_bytes(head[:4], "big"), head[4:]
            if len(head) < 8 or file.tell() + length + 4 > size:
                raise ImageError(f"{path}: is damaged or truncated (no end of the PNG); get a whole copy of it")
            check = zlib.crc32(file.read(length), zlib.crc32(kind))
            if check != int.from_bytes(file.read(4), "big"):
                raise ImageError(f"{path}: is damaged (a PNG checksum is wrong); get a whole copy of it")


def _one_line(text: str) -> str:
    line = " / ".join(part.strip() for part in text.splitlines() if part.strip())
    return (line[:160] + " ...") if len(line) > 160 else line


def _reason(library: Any) -> str:
    """The pending error of an open file, or of OpenImageIO, which may quote bytes that are no text."""
    try:
        return str(library.geterror())
    except UnicodeDecodeError:
        return "damaged names"


def _read_file(path: Path | str | os.PathLike[str]) -> Stored:
    path = Path(path)
    check_file(path)
    if _may_be_texture(path):
        from glbump.maps.containers import is_texture, read_texture

        if is_texture(path):
            return _base_of_texture(read_texture(path, base_only=True), path)
    file = open_image(path, _limit("GLBUMP_MAX_BYTES", MAX_BYTES))
    try:
        stored, orientation = _decode(file, path)
    except UnicodeDecodeError:
        raise ImageError(f"{path}: is damaged (names in it are no text); get a whole copy of it") from None
    finally:
        file.close()
    return replace(stored, pixels=_upright(stored.pixels, orientation, str(path)))


def open_image(path: Path, most_bytes: int) -> Any:
    """The file, opened by OpenImageIO as it is stored; ImageError where it is no picture. most_bytes: decoded."""
    _check_name(path)
    _require_whole_png(path)
    import OpenImageIO as oiio

    # Some readers decode while they open, before the header can be judged: this stops them.
    oiio.attribute("limits:imagesize_MB", max(1, most_bytes // 2**20))
    as_stored = oiio.ImageSpec()
    as_stored.attribute("oiio:UnassociatedAlpha", 1)
    file = oiio.ImageInput.open(str(path), as_stored)
    if file is None:
        raise ImageError(
            f"{path}: is no picture that can be read ({_one_line(_reason(oiio))}); formats: {', '.join(FORMATS)}"
        )
    return file


def _may_be_texture(path: Path) -> bool:
    with path.open("rb") as file:
        return file.read(4) in (b"\xabKTX", b"DDS ")


def _base_of_texture(texture: TextureLevels, path: Path) -> Stored:
    """Level 0 of a texture file; the faces of a cube map as a column."""
    level = texture.levels[0]
    pixels = level.reshape(-1, *level.shape[2:])
    is_float = pixels.dtype != np.uint8
    return Stored(
        pixels.astype(np.float32, copy=False) if is_float else pixels,
        ("R", "G", "B", "A")[: pixels.shape[2]],
        8 * pixels.dtype.itemsize,
        is_float,
        str(path),
        envmap="faces" if texture.is_cube else None,
        says_linear=not is_float and not texture.srgb,
    )


def _decode(file: Any, path: Path) -> tuple[Stored, int]:
    """Pixels of an open file, and the value of its orientation tag."""
    import OpenImageIO as oiio

    spec, form = file.spec(), file.format_name()
    channels = check_header(spec, form, path)
    require_size(str(path), spec.width, spec.height, min(spec.nchannels, 4))
    bits, is_float = SCALARS[str(spec.format)]
    wanted = {8: oiio.UINT8, 16: oiio.UINT16, 32: oiio.UINT32}[bits] if not is_float else oiio.FLOAT
    pixels = file.read_image(0, 0, 0, len(channels), wanted)
    require_decoded(pixels, file, path)
    if pixels.ndim == 2:
        pixels = pixels[..., None]
    # Asked last: the WebP reader cannot go back. A PSD's first picture is the whole, the others its layers.
    if form != "psd" and file.seek_subimage(1, 0):
        raise ImageError(f"{path}: holds several pictures; save the one you mean by itself")
    stored = Stored(
        pixels,
        channels,
        bits,
        is_float,
        str(path),
        envmap=_ENVMAPS.get(spec.get_string_attribute("textureformat")),
        says_linear=spec.get_string_attribute("oiio:ColorSpace").lower().startswith(("lin", "scene_lin")),
        premultiplied=form == "openexr",
    )
    return stored, spec.get_int_attribute("Orientation", 1)


def require_decoded(pixels: Any, file: Any, path: Path) -> None:
    """ImageError unless an open file gave pixels and no complaint: a truncated JPEG gives both."""
    import OpenImageIO as oiio

    error = _reason(file) or _reason(oiio)
    if pixels is None or error:
        raise ImageError(f"{path}: is damaged or truncated ({_one_line(error) or 'no pixels'}); get a whole copy of it")


def check_header(spec: Any, form: str, path: Path) -> tuple[str, ...]:
    """Names of the leading channels, which are to be read; ImageError where the header rules them out."""
    if form not in FORMATS:
        raise ImageError(f"{path}: is a {form} file; formats: {', '.join(FORMATS)}")
    if spec.deep or spec.depth > 1:
        raise ImageError(f"{path}: is a {'deep' if spec.deep else 'volume'} picture; save it as a flat one")
    if str(spec.format) not in SCALARS:
        raise ImageError(f"{path}: holds {spec.format} values; save it as unsigned integers or floats")
    if _is_cmyk(spec, form, path):
        raise ImageError(f"{path}: is a CMYK picture, whose colours depend on a printer; save it as RGB")
    if form == "openexr":
        _check_windows(spec, path)
    return _channels(spec, path)


def require_size(name: str, width: int, height: int, channels: float) -> None:
    """ImageError for a picture past the limits, to be had before it is decoded. channels: floats of a pixel."""
    pixels, most = width * height, _limit("GLBUMP_MAX_PIXELS", MAX_PIXELS)
    if pixels > most:
        raise ImageError(
            f"{name}: is {width}x{height} = {pixels} pixels; at most {most}: shrink it, "
            "or set the environment variable GLBUMP_MAX_PIXELS higher"
        )
    size, most = math.ceil(pixels * channels * 4), _limit("GLBUMP_MAX_BYTES", MAX_BYTES)
    if size > most:
        raise ImageError(
            f"{name}: takes {size} bytes decoded ({width}x{height}); at most {most}: shrink it, "
            "or set the environment variable GLBUMP_MAX_BYTES higher"
        )


def _is_cmyk(spec: Any, form: str, path: Path) -> bool:
    if form == "psd":  # OpenImageIO converts it and says nothing; the header's colour mode is 4.
        with path.open("rb") as file:
            return file.read(26)[24:] == b"\0\4"
    return "CMYK" in (spec.get_string_attribute("jpeg:ColorSpace"), spec.get_string_attribute("tiff:ColorSpace"))


def _check_windows(spec: Any, path: Path) -> None:
    if spec.get_string_attribute("textureformat") in _ENVMAPS:
        return  # OpenImageIO shows one face as the display window of a cube.
    data = (spec.x, spec.y, spec.width, spec.height)
    display = (spec.full_x, spec.full_y, spec.full_width, spec.full_height)
    if data != display:
        raise ImageError(
            f"{path}: its data window {data} differs from its display window {display} "
            "(x, y, width, height); save it with both alike"
        )


def _channels(spec: Any, path: Path) -> tuple[str, ...]:
    """Names of the channels up to the last one of use: Y or RGB, then A; what follows is not read."""
    names = tuple(str(name).upper() for name in spec.channelnames)
    if names[:3] == ("R", "G", "B"):
        return names[: 4 if names[3:4] == ("A",) else 3]
    if len(names) == 1 or (len(names) == 2 and names[1] == "A"):
        return ("Y", *names[1:])
    held = ", ".join(spec.channelnames[:6]) or "none"
    raise ImageError(f"{path}: its channels are {held}; allowed: one, or R, G, B, each with or without A")


def _upright(pixels: npt.NDArray[Any], orientation: int, name: str) -> npt.NDArray[Any]:
    """Pixels as the file's orientation tag wants them shown."""
    if orientation not in _ORIENTATIONS:
        raise ImageError(f"{name}: its orientation tag is {orientation}; allowed: 1 to 8; save it upright")
    if orientation == 1:
        return pixels
    transposed, down, right = _ORIENTATIONS[orientation]
    turned = pixels.swapaxes(0, 1) if transposed else pixels
    turned = turned[::-1] if down else turned
    return np.ascontiguousarray(turned[:, ::-1] if right else turned)


def count_and_first(bad: npt.NDArray[np.bool_]) -> str:
    """'3 of 64 pixels (first at row 1, column 2)' for a mask (H, W) or (H, W, C)."""
    mask = bad if bad.ndim == 2 else bad.any(axis=2)
    row, column = np.unravel_index(int(mask.argmax()), mask.shape)
    return f"{int(mask.sum())} of {mask.size} pixels (first at row {row}, column {column})"


def require_finite(pixels: npt.NDArray[Any], name: str) -> None:
    # NaN and infinities survive min and max, which cost a tenth of isfinite and its array; of halves, five times of it.
    if pixels.dtype == np.float16:
        if np.isfinite(pixels).all():
            return
    elif np.isfinite(pixels.min()) and np.isfinite(pixels.max()):
        return
    bad = ~np.isfinite(pixels)
    nan = int(np.isnan(pixels).any(axis=2).sum())
    raise ImageError(
        f"{name}: {count_and_first(bad)} are not finite ({nan} NaN, the others infinite); "
        "repair the picture: no value can be drawn for them"
    )
