"""Whether bumps that are seen from too far away spread what is mirrored in them."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from glbump import relief
from glbump.contents import Contents
from glbump.plan.choices import GLOSSY, SPREADS, Draft
from glbump.relief import Layer
from glbump.scene import Scene, Surface
from glbump.shapes import Plane, Quad

F64 = npt.NDArray[np.float64]


def spread(
    draft: Draft, name: str, surface: Surface, layers: tuple[Layer, ...], light: int, footprint: bool, box: F64
) -> int:
    """The number of what is kept of bumps that levels average. light: as the plan has it; footprint: whether what is
    mirrored has levels, or can be averaged; box: round the surface, in the world."""
    quality = draft.quality

    def none(why: str) -> int:
        draft.note(f"{name} bump spread", "none", why)
        return 0

    if quality.bump_spread == "none":
        return none("bumps finer than a pixel flatten out, as the quality has it")
    if not any(layer.has_spread(quality.bump_filter) for layer in layers):
        return none("no level averages slopes; the samples do")
    if light != GLOSSY and not footprint:
        return none("what is mirrored has no levels that it could be blurred by")
    finest = max(_minified(surface, layer, draft, box) for layer in layers if layer.has_spread(quality.bump_filter))
    if finest <= 1:
        return none(f"nowhere does a sample see more than {finest:.2g} texels of it")
    why = "normals that are not seen one by one blur what is mirrored, and make rough what is glossy"
    if quality.bump_spread == "toksvig":
        why += ", alike in all directions"
    draft.note(f"{name} bump spread", quality.bump_spread, why)
    return SPREADS[quality.bump_spread]


def has_flats(draft: Draft, name: str, layers: tuple[Layer, ...], kept: int) -> int:
    """Whether flat places are kept apart from steep ones where levels average both. kept: what `spread` said."""
    # Normals and directions that are shown are means of both.
    is_one = not kept or draft.show in ("normal", "reflection")
    share = 0.0 if is_one else relief.flat_share(layers, draft.quality, draft.contents)
    if share:
        why = "that do not blur what is mirrored: bumps make it sharp and hazy at once"
        draft.note(f"{name} flat places", f"{100 * share:.3g} %", why)
    return int(share > 0)


def _minified(surface: Surface, layer: Layer, draft: Draft, box: F64) -> float:
    """Texels of a bump's map along a sample's footprint, at most; curved surfaces have some that is seen edge on."""
    flat, scene, contents = _normal(surface), draft.scene, draft.contents
    if contents.steepest(layer.bump, layer.kernel) == 0:
        return 0.0
    if flat is None or layer.is_triplanar:
        return math.inf
    across = _texels_per_length(surface, layer, contents) * draft.quality.samples**-0.5
    return across * _footprint(scene, draft.size, flat, box)


def _normal(surface: Surface) -> F64 | None:
    """The unit normal, in the world, of a flat surface."""
    match surface.shape:
        case Plane():
            normal = np.array([0.0, 1.0, 0.0])
        case Quad(corners=corners):
            a, b, c, d = np.array(corners, np.float64)
            normal = np.cross(c - a, d - b)
        case _:
            return None
    normal = np.linalg.inv(surface.transform.matrix()[:3, :3]).T @ normal
    result: F64 = normal / np.linalg.norm(normal)
    return result


def _texels_per_length(surface: Surface, layer: Layer, contents: Contents) -> float:
    """Texels of a map on a flat surface per world length, where there are most."""
    height, width = contents.slopes(layer.bump, layer.kernel).shape[:2]
    least, _ = relief.scales(surface)
    lengths = contents.mesh(surface.shape).lengths(np.min)
    u, v = layer.bump.map_repeat
    return max(abs(u) * width / lengths[0], abs(v) * height / lengths[1]) / least


def _footprint(scene: Scene, size: tuple[int, int], normal: F64, box: F64) -> float:
    """The longest, in the world, that a pixel covers of a flat surface: of its farthest corner, seen as flatly."""
    camera = scene.camera
    if camera.projection == "orthographic":
        ahead = np.subtract(camera.target, camera.eye)
        cosine = abs(float(normal @ ahead)) / float(np.linalg.norm(ahead))
        return camera.height / size[1] / max(cosine, 1e-9)
    corners = np.stack(np.meshgrid(*box.T), axis=-1).reshape(-1, 3) - np.asarray(camera.eye)
    away = float(np.linalg.norm(corners, axis=-1).max())
    # The height over the surface's plane: of the box's middle, which is in it.
    above = abs(float(normal @ (box.mean(axis=0) - np.asarray(camera.eye))))
    pixel = 2 * math.tan(math.radians(camera.fov) / 2) / size[1]
    return away * pixel * away / max(above, 1e-9 * away)
