"""How far two pictures are apart, as a display would show them.

Display-referred: colour over black (times alpha), clipped to 0..1 and sRGB-encoded, over the whole frame.
"""

from __future__ import annotations

import os
from typing import Any

import numpy as np
import numpy.typing as npt

from glbump import validate as check
from glbump.errors import ImageError
from glbump.maps.colour import Floats, eight_bit, srgb_from_linear
from glbump.maps.files import require_no_nan, write_display

FLIP_PPD = 67.02
"""Pixels per degree that FLIP assumes: a 0.7 m wide 3840-pixel screen seen from 0.7 m, the authors' default."""

_SSIM_WINDOW = 11


def compare(
    a: npt.ArrayLike,
    b: npt.ArrayLike,
    *,
    display: bool = True,
    perceptual: bool = True,
    where: npt.NDArray[np.bool_] | None = None,
) -> dict[str, Any]:
    """Figures for the difference of two pictures of the same size, ready for JSON.

    a, b: frames, or linear floats (H, W, C): grey, grey and alpha, RGB or RGBA, straight alpha. Where a pixel
    of either is not opaque, alpha counts as a fourth channel. where: the pixels to count, (H, W); without it all.
    display: sRGB-encoded values, 0..1 after clipping; otherwise linear values as they are, with no flip and ssim.

    - max, mean, p99, p999: of each pixel's largest channel difference
    - worst: [row, column] of that maximum, row 0 on top
    - rmse: over all channels; psnr: in dB for a peak of 1, None for equal pictures
    - flip: mean FLIP (Andersson et al. 2020, low dynamic range, 67.02 pixels per degree), 0 is equal
    - ssim: mean structural similarity (Wang et al. 2004), 1 is equal; None without scikit-image
    - notes: why a figure is None, by its name

    perceptual: False leaves out flip and ssim, which take nearly all the time.
    ImageError for different sizes and for NaN.
    """
    first, second = _pair(a, b, display)
    difference = np.abs(first - second)
    counted = _counted(where, difference.shape[:2])
    largest = np.where(counted, difference.max(axis=2), -1)
    row, column = np.unravel_index(int(largest.argmax()), largest.shape)
    of_pixels, of_channels = largest[counted], difference[counted]
    # float64, so that a million small squares add up.
    rmse = float(np.sqrt(np.mean(np.square(of_channels, dtype=np.float64))))
    figures: dict[str, Any] = {
        "max": float(of_pixels.max()),
        "mean": float(of_pixels.mean(dtype=np.float64)),
        "p99": float(np.percentile(of_pixels, 99)),
        "p999": float(np.percentile(of_pixels, 99.9)),
        "worst": [int(row), int(column)],
        "rmse": rmse,
        "psnr": float(-20 * np.log10(rmse)) if rmse > 0 else None,
        "flip": None,
        "ssim": None,
        "notes": {} if rmse > 0 else {"psnr": "the pictures are equal"},
    }
    for name, measure in (("flip", _flip), ("ssim", _ssim)):
        if not (display and perceptual):
            figures["notes"][name] = "not asked for" if display else "is defined for display values only"
            continue
        result = measure(first[..., :3], second[..., :3])
        if isinstance(result, str):
            figures["notes"][name] = result
        else:
            figures[name] = float(result[counted].mean(dtype=np.float64))
    return figures


def difference_picture(a: npt.ArrayLike, b: npt.ArrayLike, gain: float = 8.0) -> Floats:
    """`gain` times the absolute difference of the display values, (H, W, 3), clipped to 0..1 for showing.

    a, b: as for `compare`. The values are display values: write them with `write_display`, not as linear light.
    """
    gain = check.number("gain", gain, least=0, most=1e6)
    first, second = _pair(a, b, display=True)
    return np.clip(np.abs(first[..., :3] - second[..., :3]) * gain, 0, 1)


def side_by_side(a: npt.ArrayLike, b: npt.ArrayLike, gain: float = 8.0) -> Floats:
    """a, b and their amplified difference next to each other: display values (H, 3 W, 3), 0..1."""
    first, second = _pair(a, b, display=True)
    return np.concatenate([first[..., :3], second[..., :3], difference_picture(a, b, gain)], axis=1)


def write_comparison(path: str | os.PathLike[str], a: npt.ArrayLike, b: npt.ArrayLike, gain: float = 8.0) -> None:
    """Write `side_by_side` as .png, .jpg or .webp, whole or not at all."""
    write_display(path, eight_bit(side_by_side(a, b, gain)))


def _pair(a: npt.ArrayLike, b: npt.ArrayLike, display: bool) -> tuple[Floats, Floats]:
    """Both pictures as (H, W, 3), or (H, W, 4) where one is transparent somewhere; checked."""
    first, second = _checked("first picture", a), _checked("second picture", b)
    if first.shape[:2] != second.shape[:2]:
        sizes = [f"{x.shape[1]}x{x.shape[0]}" for x in (first, second)]
        raise ImageError(f"pictures differ in size: {sizes[0]} and {sizes[1]}; draw both at the same size")
    transparent = any(bool((x[..., 3:] != 1).any()) for x in (first, second))
    dtype = np.result_type(first, second, np.float32)
    one, other = (_shown(x.astype(dtype, copy=False), transparent, display) for x in (first, second))
    return one, other


def _checked(name: str, picture: npt.ArrayLike) -> Floats:
    array = np.asarray(picture)
    if array.ndim != 3 or array.shape[2] > 4 or array.size == 0 or array.dtype.kind != "f":
        raise ImageError(
            f"{name}: must be linear floats (H, W, 1 to 4), not empty; "
            f"got {array.shape} of {array.dtype}; read files with read_picture"
        )
    require_no_nan(array, name)
    return array if array.shape[2] > 2 else np.concatenate([array[..., :1]] * 3 + [array[..., 1:]], axis=2)


def _shown(array: Floats, transparent: bool, display: bool) -> Floats:
    colour = np.clip(array[..., :3], 0, 1) if display else array[..., :3]
    if array.shape[2] == 4 and transparent:
        colour = colour * array[..., 3:]
    if display:
        colour = srgb_from_linear(colour)
    if not transparent:
        return colour
    alpha = array[..., 3:] if array.shape[2] == 4 else np.ones_like(array[..., :1])
    return np.concatenate([colour, alpha], axis=2)


def _counted(where: npt.NDArray[np.bool_] | None, shape: tuple[int, ...]) -> npt.NDArray[np.bool_]:
    if where is None:
        return np.ones(shape, bool)
    mask = np.asarray(where)
    if mask.shape != shape or mask.dtype != np.bool_ or not mask.any():
        raise ImageError(
            f"where must be booleans {shape}, at least one true; got {mask.shape} of {mask.dtype}, "
            f"{int(mask.sum())} true"
        )
    return mask


def _flip(a: Floats, b: Floats) -> npt.NDArray[np.floating[Any]] | str:
    """FLIP of every pixel, or why there is none. a, b: sRGB-encoded 0..1."""
    import OpenImageIO as oiio

    measure = getattr(oiio.ImageBufAlgo, "FLIP_diff", None)
    if measure is None:
        return "this OpenImageIO has no FLIP; it came with 3.2"
    # The attribute makes FLIP_diff decode the values to the linear light it works on. Without high dynamic
    # range (hdr) it equals the authors' own program to 1e-4.
    buffers = []
    for values in (a, b):
        buffer = oiio.ImageBuf(np.ascontiguousarray(values, dtype=np.float32))
        buffer.specmod().attribute("oiio:ColorSpace", "srgb_rec709_scene")
        buffers.append(buffer)
    result = measure(*buffers, hdr=0, ppd=FLIP_PPD)
    if result.has_error:
        return str(result.geterror()).strip()
    errors: npt.NDArray[np.floating[Any]] = result.get_pixels(oiio.FLOAT)[..., 0]
    return errors


def _ssim(a: Floats, b: Floats) -> npt.NDArray[np.floating[Any]] | str:
    """Structural similarity of every pixel, mean of the channels, or why there is none."""
    if min(a.shape[:2]) < _SSIM_WINDOW:
        return f"needs at least {_SSIM_WINDOW}x{_SSIM_WINDOW} pixels"
    try:
        from skimage import metrics
    except ImportError:
        return "scikit-image is not installed; pip install scikit-image"
    # The settings of Wang et al.: Gaussian of sigma 1.5, population covariance.
    similarity: Any = metrics.structural_similarity
    settings = {"gaussian_weights": True, "sigma": 1.5, "use_sample_covariance": False, "data_range": 1}
    errors = similarity(a, b, channel_axis=2, full=True, **settings)[1]
    means: npt.NDArray[np.floating[Any]] = errors.mean(axis=2)
    return means
