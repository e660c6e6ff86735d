"""STL, binary and text."""

from __future__ import annotations

import re

import numpy as np

from glbump.errors import MeshError
from glbump.meshformats.raw import Floats, Raw, facet_normals, table

_STL_TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


def read_stl(data: bytes) -> Raw:
    """STL, binary or text: triangles that share nothing, so a faceted surface; its normals are computed anew."""
    count = int.from_bytes(data[80:84], "little")
    if len(data) >= 84 and len(data) == 84 + 50 * count:
        points = np.frombuffer(data, _STL_TRIANGLE, offset=84)["corners"].astype(np.float64)
    elif data[:512].lstrip().lower().startswith(b"solid") and b"facet" in data[:4096].lower():
        points = _stl_text(data.decode("utf-8", errors="replace").lower())
    else:
        raise MeshError(
            f"is no whole STL: its header announces {count:,} triangles, which is {84 + 50 * count:,} bytes; "
            f"it has {len(data):,}"
        )
    positions = points.reshape(-1, 3)
    corners = np.arange(len(positions)).reshape(-1, 3)
    normals, rows = facet_normals(positions, corners)
    return Raw(positions, corners, normals=normals, normal_corners=rows)


def _stl_text(text: str) -> Floats:
    facets, ends = (len(re.findall(rf"^\s*{word}\b", text, re.MULTILINE)) for word in ("facet", "endfacet"))
    lines = re.findall(r"^\s*vertex\b[^\n]*", text, re.MULTILINE)
    if not re.search(r"^\s*endsolid[^\n]*\s*\Z", text, re.MULTILINE) or facets != ends:
        raise MeshError("is no whole STL: it breaks off before endsolid, or within a facet")
    if len(lines) != 3 * facets:
        raise MeshError(f"has {facets:,} facets but {len(lines):,} vertices; each facet has 3")
    return table(lines, 3, "vertex").reshape(-1, 3, 3)
