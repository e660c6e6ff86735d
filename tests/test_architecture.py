"""Who may import whom (docs: DESIGN, "The house"), read from the source, and what a bare import may load."""

from __future__ import annotations

import ast
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[1] / "glbump"

# Top to bottom: a module imports from its own row and from the rows below it. A name stands for itself and
# for all that lies under it.
ROWS = (
    ("__init__", "__main__", "cli", "commands"),
    ("viewer", "glsltest"),
    ("trade",),
    ("gl",),
    ("plan",),
    ("reference", "relief", "contents", "displace", "scenefile", "qualityfile", "demo"),
    (
        "scene",
        "captures",
        "environment",
        "image",
        "shapes",
        "camera",
        "quality",
        "mesh",
        "meshfile",
        "meshformats",
        "mikktspace",
        "frame",
        "maps",
    ),
    ("shown",),
    ("validate", "progress", "frozen"),
    ("errors",),
)
ROW_OF = {name: i for i, row in enumerate(ROWS) for name in row}

# Beside the rows: pictures and meshes are read without knowing what a scene is.
NEVER = (("maps", "scene"), ("maps", "frame"), ("maps", "reference"), ("reference", "scenefile"))
ALLOWED_UPWARD = {
    # The lazy public names are fetched when they are asked for.
    ("__init__", "gl"),
}

# Who alone may import these: the context lives in gl, a window in viewer, parsing of commands in cli.
ONLY_IN = {
    # Shader tests run compute and transform feedback, which no picture needs; their context is gl's all the same.
    "moderngl": ("gl", "glsltest"),
    "glcontext": ("gl",),
    "glfw": ("gl", "viewer"),
    "imgui_bundle": ("viewer",),
    "pyrr": ("camera",),
    "OpenImageIO": ("maps", "trade"),
    # In the window PIL writes text.
    "PIL": ("maps", "frame", "viewer"),
    "trimesh": ("meshfile", "meshformats"),
    "DracoPy": ("meshfile", "meshformats"),
    "click": ("cli", "commands"),
    "rich": ("cli", "commands", "progress"),
    "pytest": ("glsltest",),
    "hypothesis": ("glsltest",),
}

# A file of more lines is asking to be two things; each exception with its reason.
MOST_LINES = 450
LONG_FILES: dict[str, str] = {}


def sources(package: Path) -> Iterator[tuple[str, Path]]:
    """(dotted name below the package, file) of every module."""
    for path in sorted(package.rglob("*.py")):
        names = path.relative_to(package).with_suffix("").parts
        yield ".".join(names if names == ("__init__",) else [n for n in names if n != "__init__"]), path


def imports(name: str, path: Path) -> Iterator[tuple[int, str]]:
    """(line, absolute dotted module) of every import, late ones inside functions too."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from ((node.lineno, alias.name) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = node.module or ""
            if node.level:
                # A package's own __init__ counts as inside it, so it loses one level less.
                parts = ["glbump", *name.split(".")]
                keep = len(parts) - node.level + (path.name == "__init__.py")
                base = ".".join([*parts[:keep], *filter(None, [node.module])])
            # `from glbump import validate` names a module; `from glbump import Scene` the package itself.
            yield from ((node.lineno, f"{base}.{alias.name}") for alias in node.names)


def complaint(name: str, module: str) -> str | None:
    """Why the module `name` of glbump must not import `module`; None where it may."""
    room = name.split(".")[0]
    top, _, rest = module.partition(".")
    if top != "glbump":
        allowed = ONLY_IN.get(top)
        return None if allowed is None or room in allowed else f"{top} belongs to {', '.join(allowed)}"
    other = rest.split(".")[0] if rest else "__init__"
    if other not in ROW_OF:
        other = "__init__"
    if other == room or (room, other) in ALLOWED_UPWARD:
        return None
    if other == "__init__":
        return "inside the package, import the module that defines the name"
    if other in ("cli", "commands") and room not in ROWS[0]:
        return "nothing imports the commands"
    if ROW_OF[other] < ROW_OF[room] or (room, other) in NEVER:
        return f"{room} stands below {other}"
    return None


def complaints(package: Path) -> list[str]:
    """Every breach in the tree `package`, one line each."""
    found = []
    for name, path in sources(package):
        if name.split(".")[0] not in ROW_OF:
            found.append(f"{name}: not in the table of rows; give it a place in {Path(__file__).name}")
            continue
        for line, module in imports(name, path):
            why = complaint(name, module)
            if why:
                found.append(f"{name}:{line} imports {module}: {why}")
        lines = path.read_text(encoding="utf-8").count("\n")
        if lines > MOST_LINES and name not in LONG_FILES:
            found.append(f"{name}: {lines} lines; {MOST_LINES} are allowed")
    return found


def test_house_is_in_order() -> None:
    assert complaints(PACKAGE) == []


def test_exceptions_are_used() -> None:
    lengths = {name: path.read_text(encoding="utf-8").count("\n") for name, path in sources(PACKAGE)}
    assert [name for name in LONG_FILES if lengths.get(name, 0) <= MOST_LINES] == []


@pytest.mark.parametrize(
    ("file", "text", "why"),
    [
        ("maps/cube.py", "import moderngl", "moderngl belongs to gl, glsltest"),
        ("maps/cube.py", "def f():\n    import moderngl", "moderngl belongs to gl, glsltest"),
        ("maps/cube.py", "from glbump.scene import Scene", "maps stands below scene"),
        ("maps/cube.py", "from ..scene import Scene", "maps stands below scene"),
        ("maps/__init__.py", "from ..gl import context", "maps stands below gl"),
        ("reference/bump.py", "from glbump.gl.context import open_context", "reference stands below gl"),
        ("reference/bump.py", "from glbump import gl", "reference stands below gl"),
        ("reference/bump.py", "import glbump.gl.context as c", "reference stands below gl"),
        ("scene.py", "import glbump", "import the module that defines the name"),
        ("scene.py", "from glbump import Renderer", "import the module that defines the name"),
        ("gl/renderer.py", "def f():\n    from glbump.cli import main", "nothing imports the commands"),
        ("errors.py", "from glbump import validate", "errors stands below validate"),
        ("trade/metrics.py", "from PIL import Image", "PIL belongs to maps, frame, viewer"),
        ("plan.py", "x = 1\n" * (MOST_LINES + 1), "lines"),
        ("helpers.py", "", "not in the table of rows"),
    ],
)
def test_checker_rejects_a_wrong_import(tmp_path: Path, file: str, text: str, why: str) -> None:
    path = tmp_path / file
    path.parent.mkdir(exist_ok=True)
    path.write_text(text)
    found = complaints(tmp_path)
    assert len(found) == 1, found
    assert why in found[0]


@pytest.mark.parametrize(
    ("file", "text"),
    [
        ("gl/renderer.py", "import moderngl\nfrom glbump.plan import Plan\nfrom . import context"),
        ("gl/__init__.py", "from .context import open_context"),
        ("maps/cube.py", "from glbump import validate as check\nfrom glbump.errors import ImageError"),
        ("maps/cube.py", "from .images import Picture"),
        ("trade/measure.py", "def f():\n    from glbump.gl.renderer import Renderer"),
    ],
)
def test_checker_accepts_a_right_import(tmp_path: Path, file: str, text: str) -> None:
    path = tmp_path / file
    path.parent.mkdir(exist_ok=True)
    path.write_text(text)
    assert complaints(tmp_path) == []


def loaded_by(code: str) -> set[str]:
    """Top-level modules and glbump modules in a fresh interpreter after `code`."""
    script = f"import sys\n{code}\nprint(*sys.modules)"
    run = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True, stdin=subprocess.DEVNULL
    )
    return set(run.stdout.split())


HEAVY = {"moderngl", "glcontext", "glfw", "OpenImageIO", "PIL", "trimesh", "rich", "click", "pyrr", "scipy"}


def test_importing_glbump_loads_nothing_heavy() -> None:
    loaded = loaded_by("import glbump")
    assert loaded & (HEAVY | {"numpy"}) == set()
    # The check itself sees what is loaded.
    assert "click" in loaded_by("import glbump.cli")


def test_commands_load_only_what_parsing_needs() -> None:
    assert loaded_by("import glbump.cli") & (HEAVY - {"click"} | {"numpy"}) == set()


def test_a_window_loads_late_what_its_first_picture_does_without() -> None:
    loaded = loaded_by("import glbump.viewer.opening, glbump.viewer.window")
    assert "glfw" in loaded
    assert loaded & {"PIL", "imgui_bundle", "OpenImageIO", "trimesh", "rich", "click", "pyrr", "hashlib"} == set()
    late = {"demo", "trade.metrics", "maps.containers", "maps.lint", "maps.detect", "maps.gloss", "maps.suns"}
    late |= {"maps.animation", "reference.shade", "viewer.plates", "viewer.text", "viewer.panel", "viewer.picking"}
    assert loaded & {f"glbump.{name}" for name in late} == set()


def test_frozen_classes_on_the_way_to_a_picture_are_not_generated() -> None:
    """glbump.frozen says why; Session is not frozen."""
    code = (
        "import glbump.commands.render, glbump.scenefile, glbump.gl.renderer, glbump.viewer.window\n"
        "made = {v for m in list(sys.modules.values()) for v in vars(m).values() if isinstance(v, type)}\n"
        "made = [v.__name__ for v in made if v.__module__.startswith('glbump.') and '__dataclass_params__' in vars(v)"
        " and v.__dataclass_params__.init]\n"
        "print('generated:', ','.join(made), end=' ')"
    )
    assert "Session" in loaded_by(code)
    assert not any("," in word for word in loaded_by(code)), loaded_by(code)


def test_scene_reference_and_maps_load_no_opengl() -> None:
    modules = [
        f"glbump.{name}"
        for name, _ in sources(PACKAGE)
        if name.split(".")[0] in ("scene", "scenefile", "camera", "mesh", "meshfile", "frame", "maps", "reference")
    ]
    loaded = loaded_by("import " + ", ".join(modules))
    assert loaded & {"moderngl", "glcontext", "glfw", "OpenGL"} == set()
    assert loaded & {"OpenImageIO", "trimesh", "rich", "click", "scipy"} == set()
