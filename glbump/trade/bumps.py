"""Is bump mapping good enough here? Flat, small-B, full and truly displaced, measured side by side.

Normals are compared in float64, pictures as they are drawn. All four have the same heights: the cubic B-splines
through the maps.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from glbump import validate as check
from glbump.camera import near_far, pixel_rays, projection_matrix, view_matrix
from glbump.contents import Contents
from glbump.displace import Heights, bent, cells_for, displaced, in_world, points_at
from glbump.errors import SceneError
from glbump.gl.renderer import Renderer
from glbump.maps.angles import degrees_between
from glbump.maps.colour import eight_bit
from glbump.quality import Quality, quality_of
from glbump.reference import bump as bumps
from glbump.reference.cast import Grid, Hits, cast
from glbump.reference.shade import places_of
from glbump.scene import Bump, Scene, Surface, check_size
from glbump.shapes import MESHES, MeshData
from glbump.trade.metrics import compare, difference_picture

F64 = npt.NDArray[np.float64]
F32 = npt.NDArray[np.float32]
Mask = npt.NDArray[np.bool_]

FORMS = ("flat", "small", "full")
"""What stands in for the displaced surface: no bump, Blinn's form without the terms in B, and with them."""

MOST_PIXELS = 1.0
"""What bump mapping may leave in its place, and still be called good enough: seen side by side, no more is noticed."""


@dataclass(frozen=True)
class Comparison:
    """What `compare_bump` finds of one surface of a scene.

    pictures: (H, W, 4) linear, of "flat", "small", "full" and "displaced". angles: (H, W) degrees from a form's normal
    to that of the displaced surface seen in the same pixel; NaN where one of them is not there. covered: (H, W) where
    the undisplaced and where the displaced surface is seen, were it alone. moved: (H, W) pixels that what is seen of
    the undisplaced surface is displaced by; NaN beside it.
    figures: ready for JSON (docs/bump.md says what each is). advice: one sentence.
    """

    pictures: dict[str, F32]
    angles: dict[str, F64]
    covered: tuple[Mask, Mask]
    moved: F64
    figures: dict[str, Any]
    advice: str


def compare_bump(
    scene: Scene,
    surface: int = 0,
    size: tuple[int, int] = (512, 512),
    *,
    quality: str | Quality = "balanced",
    backend: str = "auto",
) -> Comparison:
    """One surface of a scene, flat, bumped by either form and displaced, against each other.

    quality: of the pictures; heights are read in the shader, so that all forms have the same.
    Raises SceneError where the surface has no heights, LimitError where the displaced one is too large to make, and
    what `Renderer` raises.
    """
    check.instance("scene", scene, Scene)
    size = check_size(size)
    index = _checked_index(scene, surface)
    with Renderer(backend=backend) as renderer:
        contents, bumped = renderer.contents, scene.surfaces[index]
        heights = Heights(bumped, contents)
        moved = displaced(bumped, cells_for(bumped, scene.camera, size, contents), contents=contents)
        pictures = _pictures(renderer, scene, index, moved, size, quality)
        # Normal maps lie on top of what is compared, and are left out.
        hits, other = (_seen(scene, index, s, size, contents) for s in (bumped, replace(moved, bump=None)))
        normals, height = _normals(bumped, hits, heights)
        truth = _image(_true_normals(bumped, other, heights), other, size)
    angles = {form: degrees_between(_image(normal, hits, size), truth) for form, normal in normals.items()}
    covered = _mask(hits, size), _mask(other, size)
    apart = _image(_moved(scene, bumped, hits, height, size)[:, None], hits, size)[..., 0]
    figures: dict[str, Any] = {
        "surface": index,
        "size": list(size),
        "triangles": len(np.asarray(moved.shape.triangles)) if isinstance(moved.shape, MeshData) else 0,
        "height": {"least": float(height.min(initial=0)), "most": float(height.max(initial=0))},
        "normals": {form: _spread(angle) for form, angle in angles.items()},
        "formula": {form: _spread(degrees_between(normals[form], normals["full"])) for form in ("flat", "small")},
        "pictures": {form: compare(pictures[form], pictures["displaced"]) for form in FORMS},
        "moved": _spread(apart),
        "silhouette": _silhouette(*covered),
    }
    angle = max(figures["normals"][form]["p99"] or 0.0 for form in FORMS)
    figures["sheet"] = {"degrees": angle, "pixels": figures["moved"]["max"] or 0.0, "gain": GAIN}
    return Comparison(pictures, angles, covered, apart, figures, _advice(bumped, figures))


def _checked_index(scene: Scene, surface: int) -> int:
    if not scene.surfaces:
        raise SceneError("the scene has no surface to compare bumps of")
    return check.integer("surface", surface, least=0, most=len(scene.surfaces) - 1)


def _with_surface(scene: Scene, index: int, surface: Surface) -> Scene:
    return replace(scene, surfaces=[*scene.surfaces[:index], surface, *scene.surfaces[index + 1 :]])


def _seen(scene: Scene, index: int, surface: Surface, size: tuple[int, int], contents: Contents) -> Hits:
    """Where the rays through pixels' centres meet a surface, were it alone; in its object space."""
    mesh = contents.mesh(surface.shape)
    places = places_of(_with_surface(scene, index, surface), index, mesh, size, np.full(2, 0.5))
    inverse = np.linalg.inv(surface.transform.matrix())
    origins, dirs = (a.reshape(-1, 3) for a in pixel_rays(scene.camera, size))
    from_object = origins @ inverse[:3, :3].T + inverse[:3, 3]
    return cast(surface.shape, mesh, Grid(places, *size), from_object, dirs @ inverse[:3, :3].T)


def _normals(surface: Surface, hits: Hits, heights: Heights) -> tuple[dict[str, F64], F64]:
    """Unit normals (K, 3) of each of FORMS in the world, and the heights there."""
    if hits.uv is None:
        raise SceneError("the surface has no texture coordinates, and heights need them")
    height, slope = heights.at(hits.uv)
    n, dpdu, dpdv, *_ = in_world(surface.transform, hits)
    small = bumps.bump_normal(n, bumps.surface_gradient(n, dpdu, dpdv, slope))
    return {"flat": n, "small": small, "full": bent(surface.transform, hits, height, slope)[1]}, height


def _true_normals(surface: Surface, hits: Hits, heights: Heights) -> F64:
    """Unit normals (K, 3) in the world where rays meet the displaced surface: of its own derivatives there, not between
    the corners of triangles; but of mesh files, which have no others."""
    if isinstance(surface.shape, MESHES):
        return hits.n
    assert hits.uv is not None
    # The faces of a displaced cube share no corners, so that they are its pieces, in their order.
    points = points_at(surface.shape, hits.uv, hits.piece)
    return bent(surface.transform, points, *heights.at(hits.uv))[1]


def _moved(scene: Scene, surface: Surface, hits: Hits, height: F64, size: tuple[int, int]) -> F64:
    """(K,) pixels from where hits are seen to where they are displaced to."""
    matrix = surface.transform.matrix()
    p = hits.p @ matrix[:3, :3].T + matrix[:3, 3]
    n = in_world(surface.transform, hits)[0]
    camera = scene.camera
    to_clip = projection_matrix(camera, size, *near_far(camera, np.zeros((0, 2, 3)))) @ view_matrix(camera)

    def pixels(points: F64) -> F64:
        clip = points @ to_clip[:, :3].T + to_clip[:, 3]
        ahead = clip[:, 3:] > 0  # what is displaced past the eye is not seen at all
        return np.divide(clip[:, :2], clip[:, 3:], out=np.full((len(clip), 2), np.nan), where=ahead) * size / 2

    result: F64 = np.linalg.norm(pixels(p + height[:, None] * n) - pixels(p), axis=1)
    return result


def _pictures(
    renderer: Renderer, scene: Scene, index: int, moved: Surface, size: tuple[int, int], quality: str | Quality
) -> dict[str, F32]:
    surface = scene.surfaces[index]
    flat = tuple(bump for bump in surface.bumps if not isinstance(bump, Bump)) or None
    shown = {"flat": replace(surface, bump=flat), "small": surface, "full": surface, "displaced": moved}
    pictures = {}
    for name, drawn in shown.items():
        terms = name if name in ("small", "full") else "auto"
        how = replace(quality_of(quality), bump_kernel="bspline", bump_read="shader", bump_terms=terms)
        pictures[name] = renderer.render(_with_surface(scene, index, drawn), size=size, quality=how).pixels
    return pictures


def _image(values: F64, hits: Hits, size: tuple[int, int]) -> F64:
    """(H, W, C) of values (K, C) of hits, NaN elsewhere."""
    image = np.full((size[0] * size[1], values.shape[1]), np.nan)
    image[hits.ray] = values
    return image.reshape(size[1], size[0], -1)


def _mask(hits: Hits, size: tuple[int, int]) -> Mask:
    mask = np.zeros(size[0] * size[1], bool)
    mask[hits.ray] = True
    return mask.reshape(size[1], size[0])


def _spread(values: F64) -> dict[str, float | None]:
    """Mean, 99th percentile and maximum of what is there."""
    there = values[np.isfinite(values)]
    if not there.size:
        return {"mean": None, "p99": None, "max": None}
    return {"mean": float(there.mean()), "p99": float(np.percentile(there, 99)), "max": float(there.max())}


def _silhouette(before: Mask, after: Mask) -> dict[str, float | None]:
    """How the outline changes, in pixels. share: of the pixels that either covers, those that one alone does.
    mean: their number over the outline's length; max: the farthest of them from the other outline, to half a pixel."""
    either, both = before | after, before & after
    changed = int(either.sum() - both.sum())
    result: dict[str, float | None] = {"share": changed / int(either.sum()) if either.any() else None}
    if not both.any():
        return result | {"mean": None, "max": None}
    farthest = [_farthest(a & ~b, b) for a, b in ((before, after), (after, before))]
    return result | {"mean": changed / _outline_length(before), "max": max(farthest)}


def _rim(mask: Mask) -> Mask:
    """Pixels of a mask that have a neighbour, of four, which is not in it; none beyond the frame."""
    padded = np.pad(mask, 1, mode="edge")
    inner = padded[:-2, 1:-1] & padded[2:, 1:-1] & padded[1:-1, :-2] & padded[1:-1, 2:]
    return mask & ~inner


def _outline_length(mask: Mask) -> float:
    """Length of a mask's outline in pixels: sides of pixels, times pi / 4, which is right on the mean of directions."""
    sides = np.count_nonzero(mask[1:] != mask[:-1]) + np.count_nonzero(mask[:, 1:] != mask[:, :-1])
    return max(1.0, math.pi / 4 * float(sides))


def _farthest(alone: Mask, mask: Mask) -> float:
    """The largest distance of a pixel in `alone` from the edge of the nearest of `mask`."""
    here, there = (np.argwhere(m).astype(np.float32) for m in (alone, _rim(mask)))
    if not len(here):
        return 0.0
    nearest = [
        np.min((part[:, None, 0] - there[:, 0]) ** 2 + (part[:, None, 1] - there[:, 1]) ** 2, axis=1).max()
        for part in np.array_split(here, 1 + len(here) * len(there) // 10_000_000)
        if len(part)
    ]
    return float(np.sqrt(max(nearest))) - 0.5


def _advice(surface: Surface, figures: dict[str, Any]) -> str:
    """One sentence: whether bump mapping is good enough here, and what to do where it is not."""
    moved, outline = figures["moved"]["max"], figures["silhouette"]["max"] or 0.0
    if moved is None:
        return "the surface is not seen in this frame: move the camera, and compare again"
    small = figures["formula"]["small"]["max"]
    worst = max(moved, outline)
    if worst > MOST_PIXELS:
        shown = (
            f"the silhouette moves by {outline:.1f}" if outline > MOST_PIXELS else f"points on it move by {moved:.1f}"
        )
        return f"{shown} pixels: displace, or lower {_amplitude(surface, MOST_PIXELS / worst)}"
    enough = f"bump mapping is good enough here: nothing moves by more than {worst:.1f} pixels, and the small form's "
    if small > Quality("balanced").direction_error:
        return f'{enough}normals are off by up to {small:.2g} degrees: leave bump_terms at "auto", or choose "full"'
    return f"{enough}normals are off by {small:.2g} degrees at most"


def _amplitude(surface: Surface, share: float) -> str:
    amplitudes = [bump.amplitude for bump in surface.bumps if isinstance(bump, Bump)]
    if len(amplitudes) == 1:
        return f"bump.amplitude to {_below(amplitudes[0] * share):g}"
    return f"the amplitudes to {_below(share):g} of what they are"


def _below(value: float) -> float:
    """In two digits, towards 0: what is advised is enough."""
    step = 10.0 ** (math.floor(math.log10(abs(value))) - 1)
    return float(f"{math.trunc(value / step + math.copysign(1e-9, value)) * step:.2g}")


GAIN = 4.0
"""How much the sheet magnifies differences of pictures."""
_HEAT = np.array([(0, 0, 0), (88, 16, 112), (200, 48, 72), (252, 160, 40), (255, 255, 255)], np.float64)
_BOTH, _BEFORE, _AFTER = (110, 110, 110), (64, 120, 255), (255, 96, 64)


def sheet(comparison: Comparison) -> npt.NDArray[np.uint8]:
    """All of it in one picture (3 H, 4 W, 3), bytes as a display shows them; what white is stands in figures["sheet"].

    Columns: flat, small, full, displaced. First row: the pictures. Second: degrees from the displaced surface's normal;
    then the silhouettes, grey where both are, blue where only the undisplaced one is, red where only the displaced.
    Third: GAIN times the difference from the displaced picture; then pixels that points move by.
    """
    white = comparison.figures["sheet"]
    truth = comparison.pictures["displaced"]
    before, after = comparison.covered
    outlines = np.zeros((*before.shape, 3), np.uint8)
    for where, colour in ((before & after, _BOTH), (before & ~after, _BEFORE), (after & ~before, _AFTER)):
        outlines[where] = colour
    rows = (
        [eight_bit(difference_picture(p, np.zeros_like(p), 1.0)) for p in comparison.pictures.values()],
        [*(_heat(comparison.angles[form], white["degrees"]) for form in FORMS), outlines],
        [
            *(eight_bit(difference_picture(comparison.pictures[form], truth, GAIN)) for form in FORMS),
            _heat(comparison.moved, white["pixels"]),
        ],
    )
    return np.concatenate([np.concatenate(row, axis=1) for row in rows])


def _heat(values: F64, white: float) -> npt.NDArray[np.uint8]:
    """(H, W, 3): black for 0 and for nothing, then purple, red and orange, to white."""
    place = np.clip(np.nan_to_num(values) / max(white, 1e-30), 0, 1)
    channels = [np.interp(place, np.linspace(0, 1, len(_HEAT)), _HEAT[:, k]) for k in range(3)]
    return np.stack(channels, axis=-1).astype(np.uint8)
