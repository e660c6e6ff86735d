"""PLY, text and binary."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from glbump.errors import MeshError
from glbump.meshformats.raw import Floats, Raw, check_rows, fan

_TYPES = {
    **dict.fromkeys(("char", "int8"), "i1"),
    **dict.fromkeys(("uchar", "uint8"), "u1"),
    **dict.fromkeys(("short", "int16"), "i2"),
    **dict.fromkeys(("ushort", "uint16"), "u2"),
    **dict.fromkeys(("int", "int32"), "i4"),
    **dict.fromkeys(("uint", "uint32"), "u4"),
    **dict.fromkeys(("float", "float32"), "f4"),
    **dict.fromkeys(("double", "float64"), "f8"),
}
_ORDERS = {"ascii": "ascii", "binary_little_endian": "<", "binary_big_endian": ">"}
_UV = (("s", "t"), ("u", "v"), ("texture_u", "texture_v"), ("texture_s", "texture_t"))


Columns = dict[str, Any]
"""Per property an array (N,), or for a list property the pair (lengths (N,), all items in one array)."""


@dataclass
class _Element:
    """An element of the header; per property the NumPy types of its list's length, "" for none, and its items."""

    name: str
    count: int
    properties: dict[str, tuple[str, str]] = field(default_factory=dict)


def read_ply(data: bytes) -> Raw:
    """PLY, text or binary of either byte order: polygons, with normals and uv of vertices, uv of corners."""
    elements, body = _header(data)
    at = 0
    columns: dict[str, Columns] = {}
    for element in elements:
        columns[element.name], at = _element(body, at, element)
    notes = ["what follows its last element is ignored"] if body[at:].strip() else []
    vertex, face = columns.get("vertex", {}), columns.get("face", {})

    def stack(*names: str) -> Floats | None:
        if not all(isinstance(vertex.get(name), np.ndarray) for name in names):
            return None
        return np.column_stack([vertex[name] for name in names]).astype(np.float64)

    positions = stack("x", "y", "z")
    if positions is None:
        raise MeshError("has no vertices with x, y and z")
    polygons = face.get("vertex_indices", face.get("vertex_index"))
    if not isinstance(polygons, tuple):
        raise MeshError("has no faces; a cloud of points cannot be drawn")
    counts, items = polygons
    if not np.array_equal(items, np.floor(items)):
        raise MeshError("a face names a vertex by something other than a whole number")
    rows = check_rows(items.astype(np.int64), len(positions), "vertex")
    picks = fan(counts, positions[rows], notes)
    normals = stack("nx", "ny", "nz")
    uv = next((pair for pair in (stack(*names) for names in _UV) if pair is not None), None)
    uv_corners = rows[picks]
    if isinstance(face.get("texcoord"), tuple):  # of corners, which is finer than of vertices
        lengths, numbers = face["texcoord"]
        if np.array_equal(lengths, 2 * counts):
            uv, uv_corners = numbers.reshape(-1, 2).astype(np.float64), picks
        else:
            notes.append("texcoord is ignored: not every face has two numbers a corner")
    return Raw(
        positions,
        rows[picks],
        uv,
        None if uv is None else uv_corners,
        normals,
        None if normals is None else rows[picks],
        notes,
    )


def _header(data: bytes) -> tuple[list[_Element], bytes]:
    """The elements, and their values one after the other; text is turned into binary of 64-bit floats."""
    head = re.match(rb"ply\s*\n(.*?\n)?end_header[^\n]*\n", data[:1_000_000], re.DOTALL)
    if not head:
        raise MeshError("is no PLY: it does not begin with 'ply', or its header does not end")
    order, elements = None, []
    for line in head[0].decode("utf-8", errors="replace").splitlines():
        try:
            match line.split():
                case ["format", name, _]:
                    order = _ORDERS[name]
                case ["element", name, count]:
                    elements.append(_Element(name, int(count)))
                case ["property", "list", counter, kind, name] if name not in elements[-1].properties:
                    elements[-1].properties[name] = (_TYPES[counter], _TYPES[kind])
                case ["property", kind, name] if name not in elements[-1].properties:
                    elements[-1].properties[name] = ("", _TYPES[kind])
                case [] | ["ply" | "comment" | "obj_info" | "end_header", *_]:
                    pass
                case _:
                    raise ValueError
        except (KeyError, IndexError, ValueError):
            raise MeshError(f"its PLY header has a line that cannot be understood: {line.strip()!r:.60}") from None
    if order is None:
        raise MeshError("its PLY header names no format")
    body = data[head.end() :]
    if order == "ascii":
        try:
            body = np.array(body.decode("ascii", errors="replace").split(), dtype=np.float64).tobytes()
        except ValueError as why:
            raise MeshError(f"has something other than numbers after its header: {why}") from None
    for element in elements:
        for name, types in element.properties.items():
            length_type, item_type = (t and ("f8" if order == "ascii" else order + t) for t in types)
            element.properties[name] = (length_type, item_type)
    return elements, body


def _element(body: bytes, at: int, element: _Element) -> tuple[Columns, int]:
    """The columns of one element, and where the next one starts."""
    if element.count == 0 or not element.properties:
        return {}, at
    if 0 < element.count <= len(body) - at:  # each takes a byte at least
        try:
            return _even(body, at, element) or _uneven(body, at, element)
        except (ValueError, OverflowError):
            pass
    raise MeshError(f"breaks off within its {element.count:,} {element.name} elements, or is damaged there")


def _even(body: bytes, at: int, element: _Element) -> tuple[Columns, int] | None:
    """As `_element`, at once, where every list is as long as the first of its property; None elsewhere."""
    fields: list[Any] = []
    first, place = {}, at
    for name, (counter, kind) in element.properties.items():
        if counter:
            first[name] = int(np.frombuffer(body, counter, 1, place)[0])
            fields.append((f"{name} length", counter))
        fields.append((name, kind, (first[name],) if counter else ()))
        place = at + np.dtype(fields).itemsize
    end = at + element.count * (place - at)
    if end > len(body):
        return None
    rows = np.frombuffer(body, np.dtype(fields), element.count, at)
    columns: Columns = {}
    for name, (counter, _) in element.properties.items():
        columns[name] = rows[name]
        if counter:
            lengths = rows[f"{name} length"]
            if np.any(lengths != first[name]):
                return None
            columns[name] = (lengths.astype(np.int64), rows[name].reshape(-1))
    return columns, end


def _uneven(body: bytes, at: int, element: _Element) -> tuple[Columns, int]:
    """As `_element`, one after the other."""
    found: dict[str, list[Any]] = {name: [] for name in element.properties}
    for _ in range(element.count):
        for name, (counter, kind) in element.properties.items():
            length = 1
            if counter:
                (number,) = np.frombuffer(body, counter, 1, at)
                length, at = int(number), at + np.dtype(counter).itemsize
                if length != number or length < 0:
                    raise ValueError
            found[name].append(np.frombuffer(body, kind, length, at))
            at += length * np.dtype(kind).itemsize
    columns: Columns = {}
    for name, (counter, _) in element.properties.items():
        items = np.concatenate(found[name])
        columns[name] = (np.array([len(x) for x in found[name]]), items) if counter else items
    return columns, at
