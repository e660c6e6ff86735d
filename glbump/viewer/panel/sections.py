"""The panel's sections, top to bottom: each shows values of the state and sets them; errors stay in the window."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import fields, replace
from typing import TYPE_CHECKING, Any

from imgui_bundle import imgui

from glbump.environment import Environment, Pictured
from glbump.maps.images import TONES
from glbump.plan import Choice
from glbump.quality import KNOBS, PRESETS, Knob, Quality
from glbump.scene import Bump, NormalMap, Surface
from glbump.viewer import exports
from glbump.viewer.comparing import OFF, SECONDS, WAYS
from glbump.viewer.pace import BUDGET

if TYPE_CHECKING:
    from glbump.viewer.window import Viewer

SAID_BY = {
    "silhouette": "mesh",
    "environment_layout": "environment",
    "environment_level": "environment filter",
    "bump_kernel": "bump",
    "bump_read": "bump",
    "bump_filter": "bump",
    "direction_error": "bump terms",
    "gloss_size": "roughness chain",
    "gloss_samples": "roughness chain",
    "gloss_chain": "roughness chain",
}
"""Knob -> the choice of a plan that follows from it; the others are called as the knob is."""
_BRIGHT, _FAINT = (1.0, 0.80, 0.45, 1.0), (0.66, 0.69, 0.73, 1.0)
_COLOURS = {"plan": (0.45, 0.62, 0.95, 1.0), "draw": (0.40, 0.80, 0.45, 1.0), "present": (0.95, 0.70, 0.30, 1.0)}
_KIB = 1024


class Choosing:
    """What the panel shows of the state: the surface that is chosen."""

    def __init__(self, viewer: Viewer) -> None:
        self.viewer = viewer
        self._surface = 0

    @property
    def surface(self) -> int:
        """The chosen surface's number; 0 where there is none."""
        return min(self._surface, max(len(self.viewer.shown.scene.surfaces) - 1, 0))

    @surface.setter
    def surface(self, number: int) -> None:
        self._surface = number

    def put(self, dotted: str, value: Any) -> None:
        """Set a value of the scene, named as in a scene file."""
        shown = self.viewer.shown
        shown.attempt("value", lambda: shown.put(dotted, value))

    def choices(self) -> tuple[Choice, ...]:
        """Of the plan that the picture was drawn by."""
        picture = self.viewer.stage.picture
        return () if picture is None else picture.plan.choices


# ------------------------------------------------------------ rows


def _number(
    label: str, value: float, least: float, most: float, unit: str = "", *, log: bool = False, whole: bool = False
) -> float | None:
    """A slider, and what it was moved to. Values beyond its ends may be typed (ctrl+click)."""
    flags = imgui.SliderFlags_.logarithmic if log else 0
    percent = unit.replace("%", "%%")
    if whole:
        moved, now = imgui.slider_int(label, int(value), int(least), int(most), f"%d {percent}".strip(), flags)
        return now if moved else None
    moved, got = imgui.slider_float(label, float(value), least, most, f"%.4g {percent}".strip(), flags)
    return got if moved else None


def _word(label: str, value: str, words: tuple[str, ...]) -> str | None:
    """A list of words, and the one that was taken."""
    number = words.index(value) if value in words else -1
    moved, now = imgui.combo(label, number, list(words))
    return words[now] if moved else None


def _faint(text: str, *, indent: bool = False) -> None:
    imgui.push_style_color(imgui.Col_.text, _FAINT)
    if indent:
        imgui.indent()
    imgui.text_wrapped(text)
    if indent:
        imgui.unindent()
    imgui.pop_style_color()


def _head(label: str, *, opened: bool = False) -> bool:
    return bool(imgui.collapsing_header(label, imgui.TreeNodeFlags_.default_open if opened else 0))


# ------------------------------------------------------------ sections


def subject(choosing: Choosing) -> None:
    """What is shown, and what can be done with it."""
    viewer = choosing.viewer
    imgui.push_style_color(imgui.Col_.text, _BRIGHT)
    imgui.text_wrapped(viewer.shown.subject.name or "nothing opened")
    imgui.pop_style_color()
    if viewer.shown.subject.title not in ("", viewer.shown.subject.name):
        _faint(viewer.shown.subject.title)
    for i, (label, says, act) in enumerate(_DEEDS):
        if i % 4:
            imgui.same_line()
        if imgui.button(label):
            viewer.shown.attempt("action", lambda act=act: act(viewer))  # type: ignore[misc]
        imgui.set_item_tooltip(says)


_DEEDS: tuple[tuple[str, str, Callable[[Viewer], None]], ...] = (
    ("Fit", "all surfaces in the picture (F)", lambda viewer: viewer.shown.fit(viewer.stage.room)),
    ("Reset", "the camera as the scene has it (R)", lambda viewer: viewer.shown.reset_camera()),
    ("Before", "the scene before (page up)", lambda viewer: viewer.shown.go(-1)),
    ("Next", "the next scene (page down)", lambda viewer: viewer.shown.go(1)),
    ("Picture", "as glbump render draws it (F12)", exports.picture),
    ("Scene", "save it with what it needs (ctrl+S)", exports.scene),
    ("Turn", "a turntable of PNGs (F9)", lambda viewer: exports.turntable(viewer, ".png")),
    ("Help", "mouse and keys (F1)", lambda viewer: viewer.shown.toggle_help()),
)


def surfaces(choosing: Choosing) -> None:
    """The scene's tree: which surface the rows below are of."""
    scene = choosing.viewer.shown.scene
    count = len(scene.surfaces)
    if not _head(f"Scene: {count} surface{'s' if count != 1 else ''}###scene", opened=True):
        return
    for i, one in enumerate(scene.surfaces):
        metal = "metal" if one.material.metallic > 0.5 else "dielectric"
        bumps = ", ".join("normal map" if isinstance(b, NormalMap) else "heights" for b in one.bumps)
        text = f"{i}  {one.shape.kind}, {metal}{f', {bumps}' if bumps else ''}"
        if imgui.selectable(text, i == choosing.surface)[0]:
            choosing.surface = i
    camera = scene.camera
    _faint(
        f"{camera.projection}, {camera.fov:.3g} degrees, from ({', '.join(f'{x:.3g}' for x in camera.eye)}) "
        f"to ({', '.join(f'{x:.3g}' for x in camera.target)})"
    )


def material(choosing: Choosing) -> None:
    """Of the chosen surface."""
    scene, number = choosing.viewer.shown.scene, choosing.surface
    if not scene.surfaces or not _head(f"Material of {number}###material", opened=True):
        return
    here, value = f"surface.{number}.material", scene.surfaces[number].material
    moved, colour = imgui.color_edit3("base color", list(value.base_color), imgui.ColorEditFlags_.float)
    imgui.set_item_tooltip("linear light, 0 to 1")
    if moved:
        choosing.put(f"{here}.base_color", tuple(min(max(c, 0.0), 1.0) for c in colour))
    for name, most in (("metallic", 1.0), ("roughness", 1.0), ("transmission", 1.0)):
        now = _number(name, getattr(value, name), 0.0, most)
        if now is not None:
            choosing.put(f"{here}.{name}", now)
    now = _number("ior", value.ior, 1.0, 3.0)
    imgui.set_item_tooltip("index of refraction, of what is no metal")
    if now is not None:
        choosing.put(f"{here}.ior", now)


def bump(choosing: Choosing) -> None:
    """The chosen surface's heights and normal maps."""
    scene, number = choosing.viewer.shown.scene, choosing.surface
    if not scene.surfaces or not _head(f"Bumps of {number}###bump", opened=True):
        return
    surface: Surface = scene.surfaces[number]
    layers = surface.bump if isinstance(surface.bump, tuple) else (surface.bump,)
    if layers == (None,):
        _faint("none; drop heights or a normal map on the surface")
        return
    for i, layer in enumerate(layers):
        here = f"surface.{number}.bump" + (f".{i}" if isinstance(surface.bump, tuple) else "")
        imgui.push_id(i)
        if isinstance(layer, Bump):
            _heights(choosing, here, layer)
        elif isinstance(layer, NormalMap):
            _normals(choosing, here, layer)
        imgui.pop_id()


def _heights(choosing: Choosing, here: str, layer: Bump) -> None:
    _faint(f"heights of {getattr(layer.height, 'name', 'an array')}")
    reach = max(0.05, 4 * abs(layer.amplitude))
    moved, amplitude = imgui.drag_float(
        "amplitude",
        layer.amplitude,
        reach / 400,
        -1e30,
        1e30,
        "%.4g world units",
        imgui.SliderFlags_.no_round_to_format,
    )
    imgui.set_item_tooltip("the world length of the full range of heights; negative turns bumps into dents")
    if moved:
        choosing.put(f"{here}.amplitude", amplitude)
    if layer.pixel_size is None:
        _repeat(choosing, here, layer)
    for name, words in (("border", ("wrap", "mirror", "clamp")), ("scaling", ("world", "parameter"))):
        now = _word(name, getattr(layer, name), words)
        if now is not None:
            choosing.put(f"{here}.{name}", now)


def _normals(choosing: Choosing, here: str, layer: NormalMap) -> None:
    _faint(f"normals of {getattr(layer.normal_map, 'name', 'an array')}")
    now = _number("scale", layer.scale, -2.0, 2.0)
    imgui.set_item_tooltip("of the slopes; negative turns bumps into dents")
    if now is not None:
        choosing.put(f"{here}.scale", now)
    _repeat(choosing, here, layer)
    moved, flipped = imgui.checkbox("flip y", layer.flip_y)
    if moved:
        choosing.put(f"{here}.flip_y", flipped)


def _repeat(choosing: Choosing, here: str, layer: Bump | NormalMap) -> None:
    moved, repeat = imgui.drag_float2("repeat u, v", list(layer.repeat), 0.02, 0.01, 1e6, "%.4g")
    imgui.set_item_tooltip("how often the picture repeats per unit of u and of v")
    if moved:
        choosing.put(f"{here}.repeat", tuple(max(r, 1e-3) for r in repeat))


def environment(choosing: Choosing) -> None:
    """What is mirrored, and how the screen shows all of it."""
    shown = choosing.viewer.shown
    value: Environment = shown.scene.environment
    if not _head("Environment", opened=True):
        return
    source = getattr(value.images[0], "name", "an array") if isinstance(value, Pictured) else "computed"
    _faint(f"{value.kind}: {source}")
    now = _number("rotation", value.rotation, 0.0, 360.0, "degrees")
    if now is not None:
        choosing.put("environment.rotation", now)
    now = _number("exposure", value.exposure, -8.0, 8.0, "stops")
    imgui.set_item_tooltip("of the environment's light, before anything mirrors it")
    if now is not None:
        choosing.put("environment.exposure", now)
    word = _word("look-up", value.lookup, ("reflection", "normal"))
    if word is not None:
        choosing.put("environment.lookup", word)
    moved, seen = imgui.checkbox("seen behind the surfaces", value.background)
    if moved:
        choosing.put("environment.background", seen)
    tone = _word("tone curve", shown.tone, TONES)
    if tone is not None:
        shown.show_as(tone=tone)
    now = _number("screen", shown.exposure, -8.0, 8.0, "stops")
    imgui.set_item_tooltip("exposure of the picture on the screen; nothing is drawn anew for it")
    if now is not None:
        shown.show_as(exposure=now)


def quality(choosing: Choosing) -> None:
    """Presets and every knob, with what the plan made of it and why."""
    shown = choosing.viewer.shown
    if not _head("Quality", opened=True):
        return
    value = shown.quality
    for i, name in enumerate(PRESETS):
        if i:
            imgui.same_line()
        if imgui.radio_button(name, value == Quality(name)):
            shown.set_quality(name)
    changes: dict[str, Any] = {}
    for field in fields(Quality):
        if field.name in KNOBS:
            now = _knob(field.name, getattr(value, field.name), KNOBS[field.name])
            if now is not None:
                changes[field.name] = now
            for choice in said_of(field.name, choosing.choices(), choosing.surface):
                _faint(f"{choice.value}: {choice.why}", indent=True)
    if changes:
        shown.attempt("value", lambda: shown.set_quality(replace(value, **changes)))


def _knob(name: str, value: Any, knob: Knob) -> Any:
    """One knob's row, and what it was turned to: words by a list, numbers by a slider over what a sweep tries."""
    label = name.replace("_", " ")
    if knob.bounds is None:
        now: Any = _word(label, value, knob.values)
    elif name == "samples":
        word = _word(label, f"{value}", tuple(str(v) for v in knob.values))
        now = None if word is None else int(word)
    else:
        tried = [*(float(v) for v in knob.values), float(value)]
        low, high = min(tried), max(tried)
        now = _number(label, value, low, high, knob.unit, log=low > 0 and high / low > 20, whole=knob.whole)
        if now is not None and name == "gloss_size":
            now = 2 ** round(math.log2(max(now, 1)))
    imgui.set_item_tooltip(knob.effect)
    return now


def said_of(knob: str, choices: tuple[Choice, ...], surface: int) -> list[Choice]:
    """The plan's choices that follow from a knob: of the whole picture, and of one surface."""
    wanted = SAID_BY.get(knob, knob.replace("_", " "))
    found = []
    for choice in choices:
        what = re.sub(rf"^surface {surface} ", "", choice.what)
        if re.sub(r" \d+", "", what) == wanted:
            found.append(choice)
    return found


def beside(choosing: Choosing) -> None:
    """What the picture is held against, and how."""
    viewer = choosing.viewer
    comparison = viewer.comparison
    if not _head("Beside another quality", opened=True):
        return
    off = "not"
    way = _word("shown", comparison.way or off, (off, *WAYS[1:]))
    if way is not None:
        viewer.compare(way=OFF if way == off else way)
    second = _word("against", comparison.second, SECONDS)
    if second is not None:
        viewer.compare(second=second)
    if comparison.way and comparison.figures:
        _faint(comparison.figures)
    if viewer.reference.region is not None:
        _faint(viewer.reference.says)


def plan(choosing: Choosing) -> None:
    """All that the plan decided."""
    if not _head("Plan"):
        return
    for choice in choosing.choices():
        imgui.text_wrapped(f"{choice.what}: {choice.value}")
        _faint(choice.why, indent=True)


def frames(choosing: Choosing) -> None:
    """The last frames: planning and uploading, drawing, bringing to the screen, one bar each."""
    viewer = choosing.viewer
    if not _head("Frames", opened=True):
        return
    timings = list(viewer.timings)
    top = max([BUDGET * 1.25, *(sum(t) for t in timings[-60:])])
    wide, high = imgui.get_content_region_avail().x, 5 * imgui.get_text_line_height()
    corner, lists = imgui.get_cursor_screen_pos(), imgui.get_window_draw_list()
    lists.add_rect_filled(corner, (corner.x + wide, corner.y + high), _colour((0.0, 0.0, 0.0, 0.5)))
    bar = wide / 60
    for i, timing in enumerate(timings[-60:]):
        floor = corner.y + high
        for name, ms in zip(timing._fields, timing):
            ceiling = floor - high * ms / top
            left = corner.x + i * bar
            lists.add_rect_filled((left, ceiling), (left + max(bar - 1, 1), floor), _colour(_COLOURS[name]))
            floor = ceiling
    line = corner.y + high - high * BUDGET / top
    lists.add_line((corner.x, line), (corner.x + wide, line), _colour((1.0, 1.0, 1.0, 0.7)))
    imgui.dummy((wide, high))
    if timings:
        for name, words in (("plan", "plan, upload"), ("draw", "draw"), ("present", "to the screen")):
            imgui.text_colored(_COLOURS[name], f"{words} {getattr(timings[-1], name):.3g} ms")
    back = viewer.read_back
    _faint(
        f"line: {BUDGET:.0f} ms. Frames are not read back"
        + (f"; the last picture (F12) was, in {back:.3g} ms" if back is not None else "; pictures (F12) are")
    )


def textures(choosing: Choosing) -> None:
    """What lies on the GPU for the scene."""
    held = choosing.viewer.stage.renderer.held()
    total = sum(one.bytes for one in held)
    if not _head(f"On the GPU: {_bytes(total)}###gpu"):
        return
    for one in held:
        imgui.text_wrapped(f"{one.what}: {_bytes(one.bytes)}")
        _faint(one.form, indent=True)


def _bytes(count: int) -> str:
    if count < 10 * _KIB:
        return f"{count} bytes"
    return f"{count / _KIB:.0f} KiB" if count < 10 * _KIB**2 else f"{count / _KIB**2:.0f} MiB"


def _colour(rgba: tuple[float, float, float, float]) -> int:
    return int(imgui.get_color_u32(rgba))


SECTIONS: tuple[Callable[[Choosing], None], ...] = (
    subject,
    surfaces,
    material,
    bump,
    environment,
    quality,
    beside,
    frames,
    plan,
    textures,
)
