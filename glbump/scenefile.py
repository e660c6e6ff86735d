"""TOML <-> Scene, strict. The tables are the dataclasses' own fields; README.md, "Scene files", shows one.

A scene file may come from anywhere, so what it names must lie in its own folder or below, links followed.
`load_scene(path, root=DIR)` widens that to another folder, which is the caller's to trust.
"""

from __future__ import annotations

import json
import os
import re
from collections.abc import Callable
from dataclasses import MISSING, Field, fields
from pathlib import Path
from typing import Any

from glbump import validate as check
from glbump.camera import Camera
from glbump.environment import ENVIRONMENTS, BoxBounds, SphereBounds
from glbump.errors import SceneError, shown, unknown
from glbump.image import ArrayImage
from glbump.maps.files import write_atomically
from glbump.scene import Bump, Material, NormalMap, Scene, Surface
from glbump.shapes import FILE_SHAPES, MeshData, Transform

MOST_BYTES = 4_000_000
"""A scene file larger than this is none: pictures and meshes stand beside it, not in it."""

_TABLES: dict[str, type[Any]] = {"camera": Camera, "material": Material, "transform": Transform}
_KINDS: dict[str, tuple[type[Any], ...]] = {"shape": FILE_SHAPES, "environment": ENVIRONMENTS}
# Told apart by a key that each must have.
_BY_KEY: dict[str, dict[str, type[Any]]] = {
    "bump": {"height": Bump, "normal_map": NormalMap},
    "bounds": {"low": BoxBounds, "radius": SphereBounds},
}

ReadPath = Callable[[str, Any], Any]


def load_scene(path: str | os.PathLike[str], *, root: str | os.PathLike[str] | None = None) -> Scene:
    """The scene in a TOML file; paths in it are relative to its folder, and absolute in the result.

    root: the folder that every picture and mesh must lie in, links followed; the scene file's own unless given.
    Raises SceneError, naming the file and the place in it, for anything that is not a scene.
    """
    file = check.path("the scene file", path)
    try:
        tables = toml_tables(file, "scene")
        folder = file.resolve().parent
        return scene_from_dict(tables, _inside(folder, Path(root).resolve() if root is not None else folder))
    except SceneError as why:
        raise SceneError(_one_line(f"{file}: {why}")) from None


def save_scene(scene: Scene, path: str | os.PathLike[str]) -> None:
    """Write a scene as a TOML file, whole or not at all: what differs from the defaults, and nothing else.

    Paths are written relative to the file's folder where they lie in it, absolute otherwise; `load_scene`
    then asks for a `root`. Raises SceneError for a scene that holds arrays, and for an unwritable target.
    """
    folder = check.path("the scene file", path).resolve().parent

    def write_path(where: str, value: Path | ArrayImage | MeshData) -> str:
        if isinstance(value, ArrayImage | MeshData):
            what, file = ("an array", "picture") if isinstance(value, ArrayImage) else ("a mesh of arrays", "mesh")
            raise SceneError(
                f"{where} holds {what}, which a scene file cannot; write it to a {file} file "
                "and make the scene with that path"
            )
        full = value.resolve()
        return (full.relative_to(folder) if full.is_relative_to(folder) else full).as_posix()

    text = _toml(scene_to_dict(scene, write_path))
    try:
        content = text.encode()
    except UnicodeEncodeError:
        raise SceneError(f"{path}: a path in this scene is no UTF-8 text; rename that file") from None
    write_atomically(path, content, error=SceneError)


def files_of(scene: Scene) -> list[Path]:
    """The pictures and meshes that a scene names."""
    found: list[Path] = []

    def collect(_where: str, value: Path | ArrayImage | MeshData) -> None:
        if isinstance(value, Path):
            found.append(value)

    scene_to_dict(scene, collect)
    return found


def set_from_text(scene: Scene, *assignments: str) -> Scene:
    """A copy of `scene` with values set, named as in a scene file: "surface.0.bump.amplitude=0.1".

    A value is TOML; a word or a path may stand without quotes. Paths are taken as they are. Only the whole has to
    be a scene: a camera's eye may go where its target was, if the target is moved too.
    """
    if not assignments:
        return scene
    tables = scene_to_dict(scene, lambda where, value: value, defaults=True)
    for assignment in assignments:
        _put(tables, *_assigned(assignment))
    return scene_from_dict(tables, lambda where, value: value)


def _assigned(assignment: str) -> tuple[str, Any]:
    """The dotted name and the value of "name=value"."""
    import tomllib

    dotted, equals, text = (part.strip() for part in assignment.partition("="))
    if not equals or not dotted or not text:
        raise SceneError(f"cannot set {shown(assignment)}; write NAME=VALUE, such as surface.0.bump.amplitude=0.1")
    try:
        parsed = tomllib.loads(f"value = {text}")
    except (ValueError, RecursionError):
        parsed = {}
    if list(parsed) != ["value"]:
        if not re.fullmatch(r"[\w./~-][\w./ ~:\\-]*", text):
            raise SceneError(f"cannot set {dotted}: {shown(text)} is no TOML value, word or path")
        parsed = {"value": text}
    return dotted, parsed["value"]


def _put(tables: dict[str, Any], dotted: str, value: Any) -> None:
    """Set one value in nested tables and lists; a table that is not there is made."""

    def slot(owner: Any, name: str) -> Any:
        if isinstance(owner, dict):
            return name
        if not isinstance(owner, list):
            raise SceneError(f"{dotted}: there is no {shown(name)} inside a single value, {shown(owner)}")
        if not name.isdecimal() or len(name) > 9 or int(name) >= len(owner):
            raise SceneError(f"{dotted}: no item {shown(name)}; there are {len(owner)}, counted from 0")
        return int(name)

    owner: Any = tables
    *way, last = dotted.split(".")
    for name in way:
        key = slot(owner, name)
        owner = owner.setdefault(key, {}) if isinstance(owner, dict) else owner[key]
    if last == "kind" and way and way[-1] in _KINDS and isinstance(owner, dict):
        # What the new kind has no use for goes with the old one.
        kinds = {cls.kind: {field.name for field in fields(cls)} for cls in _KINDS[way[-1]]}
        for key in [key for key in owner if key not in kinds.get(value, owner)]:
            del owner[key]
    owner[slot(owner, last)] = value


def toml_tables(file: Path, what: str) -> dict[str, Any]:
    """What a TOML file says that is a `what`; SceneError, without the file's name, when it is none."""
    import tomllib

    try:
        return tomllib.loads(_text(file, what))
    except RecursionError:
        raise SceneError(f"is nested too deeply to be a {what}") from None
    except ValueError as why:  # tomllib.TOMLDecodeError, and integers of thousands of digits
        raise SceneError(f"is not TOML: {why}") from None


def _text(file: Path, what: str) -> str:
    """The file's text; SceneError when there is none to read."""
    try:
        if file.is_dir():
            raise SceneError(f"is a folder; name the {what} file in it")
        if not file.exists():
            raise SceneError(f"there is no such {what} file")
        if not file.is_file():
            raise SceneError(f"is no ordinary file; a {what} is a TOML file")
        with file.open("rb") as stream:
            content = stream.read(MOST_BYTES + 1)
    except (OSError, ValueError) as why:
        raise SceneError(f"cannot be read: {getattr(why, 'strerror', None) or why}") from None
    if len(content) > MOST_BYTES:
        raise SceneError(f"is larger than {MOST_BYTES:,} bytes, the most a {what} file may be")
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as why:
        line = content.count(b"\n", 0, why.start) + 1
        raise SceneError(f"line {line} is not UTF-8 text; save the file as UTF-8") from None
    if not text.strip():
        needs = "a [[surface]] or an [environment]" if what == "scene" else "a value"
        raise SceneError(f"is empty; a {what} needs at least {needs}")
    return text


def _one_line(text: object) -> str:
    return " ".join(str(text).split())


def _inside(folder: Path, root: Path) -> ReadPath:
    """Reads a path relative to `folder` into an absolute one; SceneError when it leads out of `root`."""

    def read(where: str, value: Any) -> Any:
        if isinstance(value, list):
            return [read(f"{where}[{i}]", v) for i, v in enumerate(value)]
        if not isinstance(value, str) or not value:
            raise SceneError(f"{where} must be a path; got {shown(value)}")
        try:
            full = (folder / value).resolve()
        except (OSError, ValueError, RuntimeError) as why:  # links in a circle, NUL characters
            raise SceneError(f"{where}: {shown(value)} is no usable path: {_one_line(why)}") from None
        if not full.is_relative_to(root):
            raise SceneError(
                f"{where}: {value!r} lies outside {root}, and a scene file may name only what is in its folder; "
                "move the file there, or allow a wider folder with load_scene(..., root=DIR)"
            )
        return full

    return read


def scene_from_dict(tables: dict[str, Any], read_path: ReadPath) -> Scene:
    """A Scene from nested dicts and lists, as TOML has them. read_path(where, value) -> path or picture.

    Raises SceneError that names the place, such as surface.0.material.metallic.
    """
    try:
        result: Scene = _build(Scene, tables, "", read_path)
    except RecursionError:
        raise SceneError("is nested too deeply to be a scene") from None
    return result


def _join(where: str, name: object) -> str:
    return f"{where}.{name}" if where else str(name)


def _key(field: Field[Any]) -> str:
    return "surface" if field.name == "surfaces" else field.name


def _is_path(field: Field[Any]) -> bool:
    return any(kind in str(field.type) for kind in ("Path", "Image"))


def _build(cls: type[Any], table: Any, where: str, read_path: ReadPath) -> Any:
    """An instance of a dataclass from its table; every field by its own name."""
    if not isinstance(table, dict):
        raise SceneError(f"{where} must be a table, such as {{ name = value }}; got {shown(table)}")
    known = {_key(f): f for f in fields(cls)}
    for key in table:
        if key not in known:
            raise SceneError(f"{_join(where, key)}: {unknown('key', key, known)}")
    values = {}
    for key, field in known.items():
        at = _join(where, key)
        if key in table:
            values[field.name] = _value(field, table[key], at, read_path)
        elif field.name == "surfaces":
            values[field.name] = ()
        elif field.default is MISSING:
            raise SceneError(f"{at} is missing; {cls.__name__} needs it")
    try:
        return cls(**values)
    except SceneError as why:
        # "material.metallic must ..." becomes "surface.0.material.metallic must ..."
        raise SceneError(re.sub(r"^(unknown )?\w+(?=\.)", rf"\g<1>{where}", str(why))) from None


def _value(field: Field[Any], value: Any, where: str, read_path: ReadPath) -> Any:
    name = field.name
    if name == "surfaces":
        if not isinstance(value, list):
            raise SceneError(f"{where} must be a list of tables, each headed [[surface]]; got {shown(value)}")
        return tuple(_build(Surface, item, _join(where, i), read_path) for i, item in enumerate(value))
    if name in _KINDS and not isinstance(value, MeshData):
        cls, rest = _of_kind(_KINDS[name], value, where)
        return _build(cls, rest, where, read_path)
    if name == "bump" and isinstance(value, list):
        kinds = _BY_KEY[name]
        places = [_join(where, i) for i in range(len(value))]
        return [_build(_kind_by_key(kinds, v, at), v, at, read_path) for v, at in zip(value, places)]
    if name in _BY_KEY:
        return _build(_kind_by_key(_BY_KEY[name], value, where), value, where, read_path)
    if name in _TABLES:
        return _build(_TABLES[name], value, where, read_path)
    return read_path(where, value) if _is_path(field) else value


def _of_kind(classes: tuple[type[Any], ...], value: Any, where: str) -> tuple[type[Any], dict[str, Any]]:
    kinds = {cls.kind: cls for cls in classes}
    names = ", ".join(kinds)
    if not isinstance(value, dict):
        raise SceneError(
            f'{where} must be a table with a kind, such as {{ kind = "{next(iter(kinds))}" }}; got {shown(value)}'
        )
    if "kind" not in value:
        raise SceneError(f"{where}.kind is missing; choose one of: {names}")
    kind = value["kind"]
    if not isinstance(kind, str) or kind not in kinds:
        raise SceneError(f"{where}.kind: {unknown('kind', kind, kinds)}")
    return kinds[kind], {k: v for k, v in value.items() if k != "kind"}


def _kind_by_key(kinds: dict[str, type[Any]], value: Any, where: str) -> type[Any]:
    given = [key for key in kinds if isinstance(value, dict) and key in value]
    if len(given) == 1:
        return kinds[given[0]]
    if given:
        raise SceneError(f"{where} has both {' and '.join(given)}; keep one of them")
    raise SceneError(f"{where} needs a {' or a '.join(kinds)}; got {shown(value)}")


def scene_to_dict(scene: Scene, write_path: ReadPath, *, defaults: bool = False) -> dict[str, Any]:
    """Nested dicts and lists of a scene, as `scene_from_dict` reads them: what differs from the defaults.

    write_path(where, path or picture) -> value. defaults: write those too, but for what is None.
    """
    result: dict[str, Any] = _plain(scene, "", write_path, defaults)
    return result


def _plain(value: Any, where: str, write_path: ReadPath, defaults: bool) -> Any:
    if isinstance(value, Path | ArrayImage | MeshData):
        return write_path(where, value)
    if isinstance(value, tuple):
        return [_plain(v, _join(where, i), write_path, defaults) for i, v in enumerate(value)]
    if not hasattr(value, "__dataclass_fields__"):
        return value
    table = {"kind": value.kind} if hasattr(value, "kind") else {}
    for field in fields(value):
        content = getattr(value, field.name)
        # A scene of nothing but defaults is written too: as its environment.
        said = defaults or content != field.default or field.name == "environment"
        if content is not None and said:
            table[_key(field)] = _plain(content, _join(where, _key(field)), write_path, defaults)
    return table


def _toml(tables: dict[str, Any]) -> str:
    """The scene as a person would write it: a table each for what stands alone, one line for the rest."""
    parts = []
    for name, table in sorted(tables.items()):  # camera, environment, surface
        for item in table if isinstance(table, list) else [table]:
            head = f"[[{name}]]" if isinstance(table, list) else f"[{name}]"
            parts.append("\n".join([head, *(f"{key} = {toml_value(value)}" for key, value in item.items())]))
    return "\n\n".join(parts) + "\n"


def toml_value(value: Any) -> str:
    """A value as TOML has it, in one line."""
    match value:
        case bool():
            return "true" if value else "false"
        case str():
            # JSON's escapes are TOML's, but for the one character JSON lets stand.
            return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
        case list():
            return f"[{', '.join(map(toml_value, value))}]"
        case dict():
            return f"{{ {', '.join(f'{k} = {toml_value(v)}' for k, v in value.items())} }}"
        case _:
            return repr(value).removesuffix(".0")
