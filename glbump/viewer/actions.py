"""What keys do, one row each: the table that the window, its help and docs/viewer.md are made from."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

from glbump.maps.images import TONES
from glbump.quality import PRESETS
from glbump.viewer import exports, navigation
from glbump.viewer.comparing import OFF, SECONDS, WAYS, WIPE

if TYPE_CHECKING:
    from glbump.viewer.window import Viewer


class Action(NamedTuple):
    """keys: as `glfw` names them, "ctrl+" before those that want it held; says: in a few words; does it."""

    keys: tuple[str, ...]
    says: str
    does: Callable[[Viewer], None]


def _camera(move: Callable[..., object], *arguments: object, **named: object) -> Callable[[Viewer], None]:
    return lambda viewer: viewer.shown.move(lambda camera: move(camera, *arguments, **named))  # type: ignore[arg-type,return-value]


def _brighter(viewer: Viewer, stops: float) -> None:
    viewer.shown.show_as(exposure=viewer.shown.exposure + stops)


def _tone(viewer: Viewer) -> None:
    viewer.shown.show_as(tone=TONES[(TONES.index(viewer.shown.tone) + 1) % len(TONES)])


def _next_way(viewer: Viewer) -> None:
    viewer.compare(WAYS[(WAYS.index(viewer.comparison.way) + 1) % len(WAYS)])


def _next_second(viewer: Viewer) -> None:
    comparison = viewer.comparison
    second = SECONDS[(SECONDS.index(comparison.second) + 1) % len(SECONDS)]
    viewer.compare(WIPE if comparison.way == OFF else comparison.way, second)


ACTIONS: tuple[Action, ...] = (
    Action(("f1", "h"), "this help, on and off", lambda viewer: viewer.shown.toggle_help()),
    Action(("f2", "tab"), "the panel, on and off", lambda viewer: viewer.toggle_panel()),
    Action(("page_down", "n"), "the next scene, the one before", lambda viewer: viewer.shown.go(1)),
    Action(("page_up", "p"), "", lambda viewer: viewer.shown.go(-1)),
    Action(("f", "home"), "fit everything into the picture", lambda viewer: viewer.shown.fit(viewer.stage.room)),
    Action(("r",), "the camera as the scene has it", lambda viewer: viewer.shown.reset_camera()),
    Action(("kp_1",), "from the front, the right, above", _camera(navigation.from_side, "front")),
    Action(("kp_3",), "", _camera(navigation.from_side, "right")),
    Action(("kp_7",), "", _camera(navigation.from_side, "top")),
    Action(("ctrl+kp_1",), "from behind, the left, below", _camera(navigation.from_side, "front", other=True)),
    Action(("ctrl+kp_3",), "", _camera(navigation.from_side, "right", other=True)),
    Action(("ctrl+kp_7",), "", _camera(navigation.from_side, "top", other=True)),
    Action(("kp_5", "o"), "perspective or orthographic", _camera(navigation.other_projection)),
    Action(("left",), "turn by 7.5 degrees", _camera(navigation.orbit, 1 / 48, 0)),
    Action(("right",), "", _camera(navigation.orbit, -1 / 48, 0)),
    Action(("up",), "", _camera(navigation.orbit, 0, 1 / 48)),
    Action(("down",), "", _camera(navigation.orbit, 0, -1 / 48)),
    Action(("kp_add", "period"), "nearer, farther", _camera(navigation.zoom, 2)),
    Action(("kp_subtract", "comma"), "", _camera(navigation.zoom, -2)),
    Action(("left_bracket",), "field of view: narrower, wider", _camera(navigation.with_fov, 1 / 1.1)),
    Action(("right_bracket",), "", _camera(navigation.with_fov, 1.1)),
    Action(("minus",), "a third of a stop darker, brighter", lambda viewer: _brighter(viewer, -1 / 3)),
    Action(("equal",), "", lambda viewer: _brighter(viewer, 1 / 3)),
    Action(("t",), "the next tone curve", _tone),
    Action(("v",), "in place of light: level, normal, slope ...", lambda viewer: viewer.shown.show_view(1)),
    Action(("ctrl+v",), "", lambda viewer: viewer.shown.show_view(-1)),
    Action(("x",), f"beside another quality: {', '.join(WAYS[1:])}", _next_way),
    Action(("ctrl+x",), f"which: {', '.join(SECONDS)}", _next_second),
    Action(("i",), "what the pixel under the cursor is made of", lambda viewer: viewer.inspect()),
    Action(("ctrl+i",), "the float64 reference round the cursor", lambda viewer: viewer.refer()),
    Action(("1",), f"quality: {', '.join(PRESETS)}", lambda viewer: viewer.shown.set_quality("fast")),
    Action(("2",), "", lambda viewer: viewer.shown.set_quality("balanced")),
    Action(("3",), "", lambda viewer: viewer.shown.set_quality("exact")),
    Action(("f5",), "read all files anew", lambda viewer: viewer.reload()),
    Action(("f9",), "a turntable: a folder of PNGs, a GIF", lambda viewer: exports.turntable(viewer, ".png")),
    Action(("ctrl+f9",), "", lambda viewer: exports.turntable(viewer, ".gif")),
    Action(("f11",), "the whole screen, or a window", lambda viewer: viewer.toggle_screen()),
    Action(("f12",), "a picture, as glbump render draws it", exports.picture),
    Action(("ctrl+s",), "save the scene, with what it needs", exports.scene),
    Action(("escape",), "stop what goes on; put messages away", lambda viewer: viewer.stop()),
    Action(("ctrl+q", "ctrl+w"), "close", lambda viewer: viewer.close()),
)
"""A row that says nothing is explained by the one above it."""

MOUSE: tuple[tuple[str, str], ...] = (
    ("left or middle drag", "turn about the pivot"),
    ("right drag, ctrl+left, shift+middle", "move sideways"),
    ("wheel, two fingers, ctrl+middle", "nearer or farther, to the cursor"),
    ("shift+wheel", "move sideways"),
    ("ctrl+wheel", "field of view"),
    ("shift+left or alt+left drag", "turn the environment"),
    ("double click", "set the pivot"),
    ("w a s d q e", "fly (shift: faster); a left drag looks round"),
    ("files dropped", "open a scene; put a picture or a mesh into it"),
)
"""What is done without keys of one stroke."""

FLIGHT = {"w": (0, 0, 1), "s": (0, 0, -1), "a": (-1, 0, 0), "d": (1, 0, 0), "e": (0, 1, 0), "q": (0, -1, 0)}
"""Right, up and forward of each key that flies while it is held."""

SIGNS = {
    "left_bracket": "[",
    "right_bracket": "]",
    "equal": "=",
    "minus": "-",
    "period": ".",
    "comma": ",",
    "kp_add": "Keypad +",
    "kp_subtract": "Keypad -",
}


def named(key: str) -> str:
    """A key as people name it."""
    control, _, bare = key.rpartition("+")
    name = SIGNS.get(bare, bare.replace("kp_", "keypad ").replace("_", " ").title())
    return f"Ctrl+{name}" if control else name


def help_rows() -> list[tuple[str, str]]:
    """(what is pressed, what it does), for all there is."""
    rows: list[tuple[list[str], str]] = []
    for action in ACTIONS:
        if action.says:
            rows.append(([], action.says))
        rows[-1][0].append(" / ".join(map(named, action.keys)))
    return [*MOUSE, *((",  ".join(keys), says) for keys, says in rows)]
