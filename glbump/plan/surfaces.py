"""How each surface is drawn."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from glbump import relief
from glbump.contents import Contents
from glbump.errors import LimitError, SceneError
from glbump.maps.bump_formats import PLAIN
from glbump.maps.gradients import IN_SHADERS
from glbump.plan.choices import (
    BY_PIXEL,
    BY_POINT,
    CLAMPED,
    DIFFUSES,
    GENERAL,
    GLOSSY,
    HEIGHTS,
    LOOKUPS,
    MESH,
    NONE,
    NORMALS,
    ORTHOGONAL,
    PARAMETER,
    QUAD,
    SCREEN,
    SLOPES,
    SPHERE,
    TORUS,
    TRIPLANAR,
    Defines,
    Draft,
    SurfacePlan,
)
from glbump.plan.environments import parallax
from glbump.plan.materials import gloss_defines, light_of, why_light
from glbump.plan.spread import has_flats, spread
from glbump.quality import Quality
from glbump.relief import Layer
from glbump.scene import Bump, Scene, Surface
from glbump.shapes import MESHES, Cube, MeshData, MeshFile, Plane, Quad, Sphere, Torus

F64 = npt.NDArray[np.float64]

STEEPEST = 1e12
"""Most that bumps may rise per unit of u or v, in sizes of their surface: past it, gradients leave 32-bit floats."""
_SHAPES = {Sphere: SPHERE, Torus: TORUS, Quad: QUAD, Plane: MESH, Cube: MESH, MeshFile: MESH, MeshData: MESH}


def require_uv(index: int, surface: Surface, contents: Contents) -> None:
    """SceneError where a surface has bumps and no texture coordinates for them."""
    shape = surface.shape
    need = any(not (isinstance(bump, Bump) and bump.mapping == "triplanar") for bump in surface.bumps)
    if need and isinstance(shape, MESHES) and contents.mesh(shape).uv is None:
        raise SceneError(
            f"surface {index}: {shape.name} has no texture coordinates, and bumps need them; "
            'unwrap the mesh, give heights mapping = "triplanar", or leave out bump'
        )


def require_drawable(index: int, scene: Scene, layers: tuple[Layer, ...], contents: Contents, most_pixels: int) -> None:
    """LimitError where a map of a surface's bumps is too large, or too steep."""
    for layer in layers:
        _require_drawable(index, scene.surfaces[index], layer, contents, most_pixels)


def _require_drawable(index: int, surface: Surface, layer: Layer, contents: Contents, limit: int) -> None:
    bump = layer.bump
    height, width = contents.slopes(bump).shape[:2]
    if width > limit or height > limit:
        raise LimitError(
            f"surface {index}: its bump picture is {width}x{height} pixels and this driver takes at most {limit} "
            "a side; shrink it first"
        )
    if isinstance(bump, Bump):
        extent = 1.0
        if bump.scaling == "world":
            extent = float(np.abs(np.asarray(surface.transform.scale)).min())
            if bump.mapping == "uv":
                extent *= float(np.ptp(contents.bounds(surface.shape), axis=0).max())
        rise = contents.steepest(bump, layer.kernel) * max(map(abs, bump.slope_scale)) / extent
        if not rise <= STEEPEST:
            raise LimitError(
                f"surface {index}: its bumps rise by {rise:.3g} times its size per unit of u or v; "
                f"at most {STEEPEST:g}: lower bump.amplitude or bump.repeat"
            )


def is_outline(draft: Draft, index: int, apart: bool) -> bool:
    """Whether surface `index` is a ball that is drawn as the disc of its outline: nothing comes near to cut it, and the
    eye is outside. apart: whether its box meets no other's."""
    return apart and isinstance(draft.scene.surfaces[index].shape, Sphere) and not draft.seen.surfaces[index].inside


def has_small_triangles(draft: Draft, index: int, apart: bool) -> bool:
    """Whether surface `index` is drawn as many small triangles."""
    shape = draft.scene.surfaces[index].shape
    return not isinstance(shape, Cube | Plane | Quad) and not is_outline(draft, index, apart)


def surface_plan(draft: Draft, index: int, environment: tuple[int, Defines], suns: int, apart: bool) -> SurfacePlan:
    """How surface `index` is drawn. environment: the number and the defines of what it mirrors; suns: how many of its
    are shaded apart; apart: whether the surface's box meets no other's."""
    scene, contents, note = draft.scene, draft.contents, draft.note
    name, surface = f"surface {index}", scene.surfaces[index]
    shape = surface.shape
    inside, near, segments = draft.seen.surfaces[index]
    closed = isinstance(shape, Sphere | Torus | Cube) and not inside
    outline = is_outline(draft, index, apart)
    if isinstance(shape, Sphere | Torus):
        value = f"disc of {segments} sides" if outline else f"{segments} segments"
        why = f"outline within {draft.quality.silhouette:g} pixels"
        note(f"{name} mesh", value, why + (", and nothing comes near to cut it" if outline else ""))
    if near:
        note(f"{name} direction", "by pixel", "the eye is so near that points on it less the eye are mostly rounding")
    layers, bumps = _bumps(draft, name, surface)
    light = light_of(surface.material)
    note(f"{name} light", *why_light(surface.material))
    box = world_bounds(surface, contents)
    footprint = bool(dict(environment[1])["ENVIRONMENT_FOOTPRINT"])
    kept = spread(draft, name, surface, layers, light, footprint, box) if layers else 0
    defines = {
        "SHAPE": _SHAPES[type(shape)],
        "OUTLINE": int(outline),
        "TRANSFORM": _transform(surface, scene),
        "DIRECTION": BY_PIXEL if near else BY_POINT,
        **bumps,
        **_bump_look_ups(draft, name, bool(bumps["BUMP_MIP"]), kept),
        "SPREAD": kept,
        "FLATS": has_flats(draft, name, layers, kept),
        "LOOKUP": LOOKUPS[scene.environment_of(surface).lookup],
        "LIGHT": light,
        "DIFFUSE": DIFFUSES[draft.quality.diffuse] if surface.material.is_diffuse else 0,
        "SUNS": suns if surface.material.is_diffuse or (light == GLOSSY and draft.quality.gloss == "chain") else 0,
        "TRANSMISSION": int(surface.material.is_transmissive),
        "PARALLAX": parallax(draft, name, scene.environment_of(surface), box),
        "TWO_SIDED": int(not closed),
        **dict(environment[1]),
    }
    if light == GLOSSY:
        defines |= gloss_defines(draft, name, scene.environment_of(surface), environment[1])
    return SurfacePlan(tuple(defines.items()), segments, closed, environment[0], layers)


_PYRAMIDS = {
    "hardware": "the driver's: of odd sizes it drops texels, and 8 bits grow by a third of a code a level",
    "box": "means of slopes",
    "kaiser": "sharper than means of slopes, and no second moments go with them",
}


def _bumps(draft: Draft, name: str, surface: Surface) -> tuple[tuple[Layer, ...], dict[str, int]]:
    """How a surface's bumps are read, and the defines of that."""
    quality, contents, note = draft.quality, draft.contents, draft.note
    if draft.show == "uv":
        has_uv = not isinstance(surface.shape, MESHES) or contents.mesh(surface.shape).uv is not None
        note(f"{name} bump", "none", "u and v are shown")
        return (), {"BUMP": 0, "BUMP_FULL": 0, "BUMP_MIP": 0, "HAS_UV": int(has_uv), "HAS_TRIPLANAR": 0}
    layers = relief.layers(surface, quality, contents)
    if not layers:
        note(f"{name} bump", "none", "it has no bump" if surface.bump is None else "its amplitude or scale is 0")
        return (), {"BUMP": 0, "BUMP_FULL": 0, "BUMP_MIP": 0, "HAS_UV": 0, "HAS_TRIPLANAR": 0}
    for i, layer in enumerate(layers):
        number = f" {i}" if len(layers) > 1 else ""
        what = layer.kind if layer.kind == relief.NORMALS else f"{layer.kind} ({layer.kernel})"
        where = ", triplanar" if layer.is_triplanar else ""
        note(f"{name} bump{number}", f"{what}{where}, {layer.filter(quality.bump_filter)}", layer.why)
        note(f"{name} bump{number} format", layer.stored.name, layer.stored_why)
        if layer.filter(quality.bump_filter) != "bilinear":
            note(f"{name} bump{number} pyramid", layer.pyramid, _PYRAMIDS[layer.pyramid])
        if layer.is_triplanar and layer.kind != relief.SCREEN:
            off = relief.mixing(surface, layer, contents)
            why = f"normals are off by {off:.2g} degrees at most where its three maps meet"
            note(f"{name} bump{number} shares", "as if constant", why)
    terms = relief.terms(surface, layers, quality, contents)
    if any(layer.is_raised for layer in layers):
        why = f"without B (N/|N|)_u and _v normals are off by {terms.error:.2g} degrees at most"
        if quality.bump_terms == "auto":
            why += f", and {quality.direction_error:g} are allowed"
        note(f"{name} bump terms", "full" if terms.full else "small", why)
    return layers, _bump_defines(layers, quality, terms.full)


def _bump_defines(layers: tuple[Layer, ...], quality: Quality, full: bool) -> dict[str, int]:
    kinds = [_kind(layer) for layer in layers]
    of_texels = [layer for layer in layers if layer.kind == relief.HEIGHTS]
    on_screen = [layer for layer in layers if layer.kind == relief.SCREEN]
    defines = {
        "BUMP": len(layers),
        **{f"BUMP_{i}": kind for i, kind in enumerate(kinds)},
        **{f"STORED_{i}": layer.stored.family for i, layer in enumerate(layers)},
        **{f"MIDDLE_{i}": layer.stored.middle for i, layer in enumerate(layers)},
        "BUMP_FULL": int(full),
        "BUMP_MIP": int(any(layer.filter(quality.bump_filter) != "bilinear" for layer in layers)),
        "HAS_CODES": int(any(layer.stored.family != PLAIN for layer in layers)),
        "HAS_FOLDED": int(any(not layer.stored.is_filtered for layer in layers)),
        "HAS_UV": int(not all(layer.is_triplanar for layer in layers)),
        "HAS_TRIPLANAR": int(any(layer.is_triplanar for layer in layers)),
        "HAS_NORMALS": int(any(layer.kind == relief.NORMALS for layer in layers)),
        "HAS_PARAMETER": int(any(kind & PARAMETER for kind in kinds)),
        "HAS_WORLD": int(any(layer.is_raised for layer in layers)),
        "HAS_HEIGHTS": int(bool(of_texels)),
        "HAS_SCREEN": int(bool(on_screen)),
    }
    if of_texels or on_screen:
        # All come by one quality.
        defines["KERNEL"] = IN_SHADERS.index((of_texels or on_screen)[0].kernel)
    return defines


def _bump_look_ups(draft: Draft, name: str, has_levels: bool, spread: int) -> dict[str, int]:
    """Who looks bumps up along footprints. spread: what is kept of those that this averages."""
    most = draft.quality.anisotropy if has_levels else 1
    # Texture units do not say how what they have averaged varies.
    by_driver = most > 1 and not spread and draft.has_gradients
    if most > 1:
        why = "along footprints that are longer than wide, at levels of their width"
        draft.note(f"{name} bump look-ups", f"up to {most}", why + (", the texture unit's own" if by_driver else ""))
    return {"BUMP_TAPS": 1 if by_driver else most, "BUMP_GRADIENTS": most if by_driver else 0}


def _kind(layer: Layer) -> int:
    kind = _KINDS[layer.kind] + CLAMPED * layer.ends + TRIPLANAR * layer.is_triplanar
    return kind + PARAMETER * (isinstance(layer.bump, Bump) and layer.bump.scaling == "parameter")


_KINDS = {
    relief.SLOPES: SLOPES,
    relief.NORMALS: NORMALS,
    relief.HEIGHTS: HEIGHTS,
    relief.SCREEN: HEIGHTS + SCREEN,
}


def _transform(surface: Surface, scene: Scene) -> int:
    """How object directions become the environment's: not at all, by an orthogonal matrix, or by any."""
    scale = surface.transform.uniform_scale
    if scale is None:
        return GENERAL
    linear = scene.environment_of(surface).env_from_world() @ surface.transform.matrix()[:3, :3]
    return NONE if np.array_equal(linear, scale * np.eye(3)) else ORTHOGONAL


def world_bounds(surface: Surface, contents: Contents) -> F64:
    """(2, 3): lowest and highest corner of the box round a surface, in the world."""
    low, high = contents.bounds(surface.shape)
    matrix = surface.transform.matrix()
    centre = matrix[:3, :3] @ ((low + high) / 2) + matrix[:3, 3]
    reach = np.abs(matrix[:3, :3]) @ ((high - low) / 2)
    return np.stack([centre - reach, centre + reach])


def apart(boxes: F64) -> npt.NDArray[np.bool_]:
    """(N,) whether the box (N, 2, 3) of each surface meets no other's. Then any points of it along the rays, not
    just the nearest, are hidden or seen rightly."""
    if len(boxes) < 2:
        return np.ones(len(boxes), bool)
    low, high = boxes[:, 0], boxes[:, 1]
    meet = (low[:, None] <= high[None]).all(axis=-1) & (low[None] <= high[:, None]).all(axis=-1)
    result: npt.NDArray[np.bool_] = meet.sum(axis=1) == 1
    return result
