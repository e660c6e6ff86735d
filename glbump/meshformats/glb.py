"""GLB: glTF 2.0 in one file (Khronos, glTF 2.0 specification, 2021); its triangles, in their nodes' places."""

from __future__ import annotations

import base64
import json
from typing import Any

import numpy as np
import numpy.typing as npt

from glbump.errors import LimitError, MeshError
from glbump.meshformats.raw import Floats, Indices, Raw, check_rows, facet_normals

MOST_TRIANGLES = 20_000_000

_TYPES = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}
_MODES = {4: "triangles", 5: "strip", 6: "fan"}
_WANTED = ("POSITION", "NORMAL", "TEXCOORD_0", "TANGENT")
_DRACO = "KHR_draco_mesh_compression"

# Required extensions that leave triangles as they are, or that are obeyed here.
_HARMLESS = ("KHR_materials_", "KHR_texture_", "KHR_lights_", "EXT_texture_", "KHR_xmp")
_OBEYED = (_DRACO, "KHR_mesh_quantization")


def read_glb(data: bytes) -> Raw:
    """All triangles of the file's scene in one, moved by their nodes; v is turned to point up.

    A primitive without normals is faceted, as the specification has it.
    """
    tree, binary = _chunks(data)
    try:
        with np.errstate(over="ignore", invalid="ignore"):  # positions are judged later, all of them together
            return _Glb(tree, binary).read()
    except (KeyError, TypeError, ValueError, AttributeError, OverflowError) as why:
        raise MeshError(f"is no sound glTF: {type(why).__name__} {' '.join(str(why).split())[:100]}") from None


def _chunks(data: bytes) -> tuple[dict[str, Any], bytes]:
    """The JSON and the binary chunk."""
    if data[:4] != b"glTF":
        raise MeshError("is no GLB: it does not begin with 'glTF'")
    version, length = (int.from_bytes(data[k : k + 4], "little") for k in (4, 8))
    if version != 2:
        raise MeshError(f"is glTF {version}; glTF 2 is needed")
    if length != len(data):
        raise MeshError(f"is no whole GLB: its header announces {length:,} bytes; it has {len(data):,}")
    chunks: dict[bytes, bytes] = {}
    at = 12
    while at + 8 <= length:
        size = int.from_bytes(data[at : at + 4], "little")
        if at + 8 + size > length:
            raise MeshError("is no whole GLB: a chunk reaches past its end")
        chunks.setdefault(data[at + 4 : at + 8], data[at + 8 : at + 8 + size])
        at += 8 + size
    try:
        tree = json.loads(chunks.get(b"JSON", b"").decode())
    except (ValueError, RecursionError):
        tree = None
    if not isinstance(tree, dict):
        raise MeshError("is no GLB: its JSON cannot be read")
    return tree, chunks.get(b"BIN\0", b"")


def _triangles(mode: str, order: Indices) -> Indices:
    """(T, 3) of a list of corners."""
    if mode == "triangles":
        if len(order) % 3:
            raise MeshError(f"a primitive has {len(order):,} corners, which is no multiple of 3")
        return order.reshape(-1, 3)
    k = np.arange(max(len(order) - 2, 0))
    if mode == "fan":
        return order[np.stack([k + 1, k + 2, np.zeros_like(k)], axis=1)]
    return order[np.stack([k, k + 1 + k % 2, k + 2 - k % 2], axis=1)]


class _Glb:
    """One file: its JSON, its binary chunk, and what was found on the way."""

    def __init__(self, tree: dict[str, Any], binary: bytes) -> None:
        self.tree = tree
        self.binary = binary
        self.notes: dict[str, int] = {}
        self.parts: list[Raw] = []
        self.count = 0

    def note(self, text: str) -> None:
        self.notes[text] = self.notes.get(text, 0) + 1

    def item(self, kind: str, index: Any) -> Any:
        """Entry `index` of a top-level list; MeshError where there is none."""
        entries = self.tree.get(kind, [])
        if not isinstance(index, int) or isinstance(index, bool) or not 0 <= index < len(entries):
            raise MeshError(f"names number {index!r:.20} of its {kind}; there are {len(entries)}, counted from 0")
        return entries[index]

    def read(self) -> Raw:
        for name in self.tree.get("extensionsRequired", []):
            if name not in _OBEYED and not str(name).startswith(_HARMLESS):
                raise MeshError(f"needs the glTF extension {name}, which glbump does not read; export without it")
        for kind, text in (
            ("skins", "a skin is not posed: the mesh is in its own pose"),
            ("animations", "an animation is not played"),
        ):
            self.notes.update({text: len(self.tree[kind])} if self.tree.get(kind) else {})
        if "scenes" in self.tree:
            roots = self.item("scenes", self.tree.get("scene", 0)).get("nodes", [])
        else:
            children = {c for node in self.tree.get("nodes", []) for c in node.get("children", [])}
            roots = [i for i in range(len(self.tree.get("nodes", []))) if i not in children]
        self.walk(roots)
        return self.joined()

    def walk(self, roots: list[int]) -> None:
        """Every node below `roots`, once, with the product of the matrices above it."""
        ahead = [(index, np.eye(4)) for index in roots]
        seen: set[int] = set()
        while ahead:
            index, above = ahead.pop()
            node = self.item("nodes", index)
            if index in seen:
                raise MeshError(f"node {index} has two parents, or is inside itself")
            seen.add(index)
            world = above @ _matrix(node)
            ahead += [(child, world) for child in node.get("children", [])]
            if "EXT_mesh_gpu_instancing" in node.get("extensions", {}):
                self.note("instances of EXT_mesh_gpu_instancing are not drawn")
            if "mesh" in node:
                # The place of a skinned mesh is its skeleton's (glTF 2.0, 3.7.3.3), not its node's.
                self.mesh(self.item("meshes", node["mesh"]), np.eye(4) if "skin" in node else world)

    def mesh(self, mesh: dict[str, Any], world: Floats) -> None:
        if mesh.get("weights"):
            self.note("morph targets are not blended")
        for primitive in mesh["primitives"]:
            mode = primitive.get("mode", 4)
            if mode not in _MODES:
                self.note("points or lines are not drawn")
                continue
            part = self.primitive(primitive, _MODES[mode])
            self.count += len(part.corners)
            if self.count > MOST_TRIANGLES:
                raise LimitError(f"has more than {MOST_TRIANGLES:,} triangles, the most a mesh file may have")
            self.parts.append(_moved(part, world))

    def primitive(self, primitive: dict[str, Any], mode: str) -> Raw:
        names: dict[str, Any] = primitive["attributes"]
        indices: Indices | None = None
        compressed = primitive.get("extensions", {}).get(_DRACO)
        if compressed and "bufferView" not in self.item("accessors", names["POSITION"]):
            found, indices = self.draco(compressed)
            mode = "triangles"
        else:
            found = {name: self.accessor(names[name]) for name in _WANTED if name in names}
            if "indices" in primitive:
                indices = self.accessor(primitive["indices"], whole=True).reshape(-1).astype(np.int64)
        positions = found["POSITION"]
        if positions.shape[1] != 3:
            raise MeshError("has positions of other than 3 numbers")
        if indices is None:
            indices = np.arange(len(positions))
        corners = _triangles(mode, check_rows(indices, len(positions), "vertex"))
        normals, normal_corners = found.get("NORMAL"), corners
        if normals is None:
            normals, normal_corners = facet_normals(positions, corners)
        uv = found.get("TEXCOORD_0")
        # Without normals, tangents are to be ignored (glTF 2.0, 3.7.2.1).
        tangents = found.get("TANGENT") if "NORMAL" in found else None
        for what, values, width in (
            ("texture coordinates", uv, 2),
            ("normals", found.get("NORMAL"), 3),
            ("tangents", tangents, 4),
        ):
            if values is not None and values.shape != (len(positions), width):
                count, numbers = values.shape
                raise MeshError(
                    f"has {count:,} {what} of {numbers} numbers for {len(positions):,} vertices, not {width}"
                )
        if uv is not None:
            uv = np.column_stack([uv[:, 0], 1 - uv[:, 1]])  # glTF's v points down
        uv_corners = None if uv is None else corners
        return Raw(positions, corners, uv, uv_corners, normals, normal_corners, tangents=tangents)

    def draco(self, extension: dict[str, Any]) -> tuple[dict[str, Floats], Indices]:
        """Attributes and triangles of a Draco-compressed primitive."""
        try:
            import DracoPy
        except ImportError:
            raise MeshError(
                "is compressed with Draco, which needs DracoPy: pip install glbump[draco], or export without it"
            ) from None
        try:
            decoded = DracoPy.decode(bytes(self.view(extension["bufferView"])))
            faces = np.asarray(decoded.faces, dtype=np.int64).reshape(-1)
            of_id = {a["unique_id"]: np.asarray(a["data"], dtype=np.float64) for a in decoded.attributes}
        except MeshError:
            raise
        except Exception as why:  # the decoder's own kinds
            raise MeshError(f"its Draco data cannot be decoded: {' '.join(str(why).split())[:100]}") from None
        return {
            name: of_id[i].reshape(len(of_id[i]), -1) for name, i in extension["attributes"].items() if name in _WANTED
        }, faces

    def view(self, index: Any) -> memoryview:
        view = self.item("bufferViews", index)
        if "EXT_meshopt_compression" in view.get("extensions", {}):
            raise MeshError("is compressed with EXT_meshopt_compression, which glbump does not read")
        buffer = self.item("buffers", view["buffer"])
        uri = buffer.get("uri")
        if uri is None:
            content = self.binary
        elif uri.startswith("data:") and ";base64," in uri[:200]:
            content = base64.b64decode(uri.split(";base64,", 1)[1], validate=True)
        else:
            raise MeshError(f"keeps its triangles in another file, {uri!r:.80}; export it as one self-contained GLB")
        start, length = view.get("byteOffset", 0), view["byteLength"]
        if not 0 <= start <= start + length <= len(content):
            raise MeshError(f"is no whole GLB: a buffer view ends at byte {start + length:,} of {len(content):,}")
        return memoryview(content)[start : start + length]

    def array(self, source: dict[str, Any], kind: str, count: int, width: int) -> npt.NDArray[Any]:
        """(count, width) of a component type, from where `source` says."""
        view, start, size = self.view(source["bufferView"]), source.get("byteOffset", 0), np.dtype(kind).itemsize
        stride = self.item("bufferViews", source["bufferView"]).get("byteStride", width * size)
        end = start + (count - 1) * stride + width * size
        if start < 0 or count < 1 or stride < size or end > len(view):
            raise MeshError(f"is no whole GLB: an accessor ends at byte {end:,} of {len(view):,} in its view")
        return np.ndarray((count, width), kind, view, start, (stride, size))

    def accessor(self, index: Any, *, whole: bool = False) -> npt.NDArray[Any]:
        """(count, width) float64, or integers as they are where `whole`."""
        accessor = self.item("accessors", index)
        kind, count, width = _TYPES[accessor["componentType"]], accessor["count"], _WIDTHS[accessor["type"]]
        if whole and (kind not in ("<u1", "<u2", "<u4") or width != 1):
            raise MeshError("has indices that are no unsigned integers")
        if "bufferView" in accessor:
            values = self.array(accessor, kind, count, width)
        elif "sparse" in accessor and 0 <= count <= 3 * MOST_TRIANGLES:
            values = np.zeros((count, width), kind)
        else:
            raise MeshError("has an accessor without data")
        if "sparse" in accessor:
            values = values.copy()
            sparse = accessor["sparse"]
            rows = self.array(sparse["indices"], _TYPES[sparse["indices"]["componentType"]], sparse["count"], 1)
            values[check_rows(rows[:, 0].astype(np.int64), count, "sparse row")] = self.array(
                sparse["values"], kind, sparse["count"], width
            )
        if whole:
            return values
        result = values.astype(np.float64)
        if accessor.get("normalized") and kind != "<f4":
            result = np.maximum(result / np.iinfo(np.dtype(kind)).max, -1)
        return result

    def joined(self) -> Raw:
        """All parts one after the other; uv only where every part has them."""
        if not self.parts:
            raise MeshError("has no triangles in its scene")
        notes = [text if count == 1 else f"{text} ({count} times)" for text, count in self.notes.items()]
        with_uv = sum(part.uv is not None for part in self.parts)
        if 0 < with_uv < len(self.parts):
            notes.append(f"texture coordinates are ignored: only {with_uv} of {len(self.parts)} primitives have them")

        def join(values: str, corners: str) -> tuple[Floats, Indices]:
            tables = [getattr(part, values) for part in self.parts]
            first = np.cumsum([0, *map(len, tables[:-1])])
            rows = [getattr(part, corners) + k for part, k in zip(self.parts, first)]
            return np.concatenate(tables), np.concatenate(rows)

        positions, normals = join("positions", "corners"), join("normals", "normal_corners")
        uv = join("uv", "uv_corners") if with_uv == len(self.parts) else (None, None)
        tangents = None
        if any(part.tangents is not None for part in self.parts):
            none = np.zeros((1, 4))
            tangents = np.concatenate(
                [none.repeat(len(p.positions), 0) if p.tangents is None else p.tangents for p in self.parts]
            )
        return Raw(positions[0], positions[1], uv[0], uv[1], normals[0], normals[1], notes, tangents)


def _matrix(node: dict[str, Any]) -> Floats:
    """(4, 4): the node's own transform: its matrix, or scale, then rotation (quaternion xyzw), then translation."""
    if "matrix" in node:
        return np.array(node["matrix"], dtype=np.float64).reshape(4, 4).T  # by columns in the file
    x, y, z, w = np.array(node.get("rotation", (0, 0, 0, 1)), dtype=np.float64).reshape(4)
    length = x * x + y * y + z * z + w * w
    if not 0 < length < np.inf:
        raise MeshError("has a node whose rotation is no quaternion")
    s = 2 / length
    turn = np.array(
        [
            [1 - s * (y * y + z * z), s * (x * y - w * z), s * (x * z + w * y)],
            [s * (x * y + w * z), 1 - s * (x * x + z * z), s * (y * z - w * x)],
            [s * (x * z - w * y), s * (y * z + w * x), 1 - s * (x * x + y * y)],
        ]
    )
    result = np.eye(4)
    result[:3, :3] = turn * np.array(node.get("scale", (1, 1, 1)), dtype=np.float64).reshape(3)
    result[:3, 3] = np.array(node.get("translation", (0, 0, 0)), dtype=np.float64).reshape(3)
    return result


def _moved(part: Raw, world: Floats) -> Raw:
    """A part in the scene's space; a transform that mirrors turns its triangles round again."""
    linear = world[:3, :3]
    # Normals go by the cofactors, which exist even where a scale is 0; for a mirror they point inwards.
    columns = linear.T
    cofactors = np.stack([np.cross(columns[k - 2], columns[k - 1]) for k in range(3)], axis=1)
    mirrored = np.linalg.det(linear) < 0
    step = -1 if mirrored else 1
    assert part.normals is not None
    assert part.normal_corners is not None
    tangents = part.tangents
    if tangents is not None:
        # A mirror turns the cross product of normal and tangent round, and not the bitangent.
        tangents = np.column_stack([tangents[:, :3] @ linear.T, tangents[:, 3] * step])
    return Raw(
        part.positions @ linear.T + world[:3, 3],
        part.corners[:, ::step],
        part.uv,
        None if part.uv_corners is None else part.uv_corners[:, ::step],
        part.normals @ cofactors.T * step,
        part.normal_corners[:, ::step],
        tangents=tangents,
    )
