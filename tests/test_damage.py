"""Damaged files of every kind: each becomes a picture, or one line of GlbumpError; nothing else, ever.

One process for each kind of file, with a time limit, so that a crash or an endless loop in a decoder fails its
test and not the test run.
"""

from __future__ import annotations

import json
import struct
import subprocess
import sys
import zlib
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import glbump as gb
from glbump.maps.containers import texture_from_light, write_texture
from glbump.maps.images import write_picture

CASES = 40
SECONDS = 60

SCENE = """
[environment]
kind = "lat-long"
image = "sky.exr"
[camera]
eye = [0.5, 1, 4]
[[surface]]
shape = { kind = "mesh", path = "quad.obj" }
material = { base_color = [0.9, 0.8, 0.7], metallic = 1, roughness = 0 }
bump = { height = "bumps.hdr", amplitude = 0.05, repeat = [2, 3] }
transform = { rotate = [10, 20, 30] }
"""

OBJ = """v -1 -1 0
v 1 -1 0
v 1 1 0.5
v -1 1 0
vt 0 0
vt 1 0
vt 1 1
vt 0 1
vn 0 0 1
f 1/1/1 2/2/1 3/3/1
f 1/1/1 3/3/1 4/4/1
"""

# Draws every damaged file through the scene that names it, and prints a line of JSON for each.
DRAW = """
import json, sys, warnings
import numpy as np
import glbump as gb
from glbump.maps.images import read_picture
warnings.simplefilter("error", RuntimeWarning)
scene, damaged = sys.argv[1:3]
with gb.Renderer() as renderer:
    for case, content in enumerate(json.load(sys.stdin)):
        with open(damaged, "wb") as file:
            file.write(bytes.fromhex(content))
        print(case, end=" ", flush=True)
        try:
            frame = renderer.render(gb.load_scene(scene), (8, 8), "fast")
            frame.save("out.exr")
            frame.save("out.png")
        except gb.GlbumpError as error:
            print(json.dumps(str(error)))
        else:
            assert np.isfinite(frame.pixels).all()
            print(json.dumps(None))
"""


def make_whole(folder: Path) -> None:
    """A scene, and a picture or a mesh of every kind."""
    rng = np.random.default_rng(0)
    noise = rng.integers(0, 256, (8, 16, 3), dtype=np.uint8)
    for suffix in ("png", "jpg", "tif"):
        Image.fromarray(noise).save(folder / f"sky.{suffix}")
    write_picture(folder / "sky.exr", rng.random((8, 16, 3), np.float32))
    write_picture(folder / "sky.hdr", rng.random((8, 16, 3), np.float32))
    levels = [rng.random((1, 8 >> p, 16 >> p, 3), np.float32) for p in range(3)]
    for suffix in ("dds", "ktx2"):
        write_texture(folder / f"sky.{suffix}", texture_from_light(levels))
    write_picture(folder / "bumps.hdr", rng.random((8, 8), np.float32))
    (folder / "quad.obj").write_text(OBJ)
    corners = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0.5], [-1, 1, 0]], "<f4")
    uv = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], "<f4")
    triangles = np.array([[0, 1, 2], [0, 2, 3]])
    (folder / "quad.ply").write_bytes(ply(corners, uv, triangles))
    (folder / "quad.stl").write_bytes(stl(corners[triangles]))
    (folder / "quad.glb").write_bytes(glb(corners, uv, triangles))
    (folder / "scene.toml").write_text(SCENE)


def ply(corners: np.ndarray, uv: np.ndarray, triangles: np.ndarray) -> bytes:
    names = ("x", "y", "z", "s", "t")
    head = ["ply", "format binary_little_endian 1.0", f"element vertex {len(corners)}"]
    head += [f"property float {name}" for name in names]
    head += [f"element face {len(triangles)}", "property list uchar int vertex_indices", "end_header", ""]
    faces = b"".join(b"\3" + row.astype("<i4").tobytes() for row in triangles)
    return "\n".join(head).encode() + np.hstack([corners, uv]).astype("<f4").tobytes() + faces


def stl(triangles: np.ndarray) -> bytes:
    facets = b"".join(bytes(12) + t.astype("<f4").tobytes() + bytes(2) for t in triangles)
    return bytes(80) + struct.pack("<I", len(triangles)) + facets


def glb(corners: np.ndarray, uv: np.ndarray, triangles: np.ndarray) -> bytes:
    parts = [corners.tobytes(), uv.tobytes(), triangles.astype("<u2").tobytes()]
    starts = np.cumsum([0, *map(len, parts)]).tolist()
    tree = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "scale": [1, 1, 2]}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "indices": 2}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5126, "count": 4, "type": "VEC2"},
            {"bufferView": 2, "componentType": 5123, "count": 6, "type": "SCALAR"},
        ],
        "bufferViews": [{"buffer": 0, "byteOffset": s, "byteLength": len(p)} for s, p in zip(starts, parts)],
        "buffers": [{"byteLength": starts[-1]}],
    }
    text = json.dumps(tree).encode()
    text += b" " * (-len(text) % 4)
    binary = b"".join(parts)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(binary), b"BIN\0") + binary
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def damage(content: bytes, rng: np.random.Generator) -> bytes:
    """One of: some bytes changed; one bit flipped; the end cut off; a piece twice, left out, zeroed or swapped."""
    data = bytearray(content)
    a, b, c = sorted(int(place) for place in rng.integers(0, len(data), 3))
    match int(rng.integers(7)):
        case 0:
            for place in rng.integers(0, len(data), 1 + a % 4):
                data[place] = rng.integers(256)
        case 1:
            data[b] ^= 1 << int(rng.integers(8))
        case 2:
            del data[b:]
        case 3:
            data[b:b] = data[a:b]
        case 4:
            del data[a:b]
        case 5:
            data[a:b] = bytes(b - a)
        case _:
            data[a:c] = data[b:c] + data[a:b]
    return bytes(data)


def with_checksums(data: bytes) -> bytes:
    """A PNG whose chunks' checksums are right, so that what is damaged reaches the decoder."""
    out, at = data[:8], 8
    while at + 8 <= len(data):
        length = int.from_bytes(data[at : at + 4], "big")
        body = data[at + 4 : at + 8 + length]
        out += data[at : at + 4] + body + struct.pack(">I", zlib.crc32(body))
        at += 12 + length
    return out


@pytest.mark.parametrize(
    "suffix", ["exr", "hdr", "png", "jpg", "tif", "dds", "ktx2", "obj", "ply", "stl", "glb", "toml"]
)
def test_damaged_files(suffix: str, tmp_path: Path) -> None:
    make_whole(tmp_path)
    target = "scene" if suffix == "toml" else "quad" if suffix in ("obj", "ply", "stl", "glb") else "sky"
    scene = SCENE.replace(f"{target}.exr" if target == "sky" else "quad.obj", f"{target}.{suffix}")
    if suffix == "stl":  # has no uv, which bumps would need
        scene = "\n".join(line for line in scene.splitlines() if not line.startswith("bump"))
    if suffix != "toml":
        (tmp_path / "scene.toml").write_text(scene)
    whole = (tmp_path / f"{target}.{suffix}").read_bytes()
    rng = np.random.default_rng(list(suffix.encode()))
    damaged = [damage(whole, rng) for _ in range(CASES)]
    if suffix == "png":
        damaged[::2] = map(with_checksums, damaged[::2])
    done = subprocess.run(
        [sys.executable, "-c", DRAW, "scene.toml", f"{target}.{suffix}"],
        input=json.dumps([content.hex() for content in [whole, *damaged]]),
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=SECONDS,
    )
    lines = done.stdout.splitlines()
    # libpng writes a line of its own where the data inside chunks with right checksums is wrong, which no accident
    # makes; to know beforehand would take as long as to read the picture.
    errors = [line for line in done.stderr.splitlines() if not line.startswith("libpng error: ")]
    # A crash or another exception ends the process: the last line begins with the case.
    assert (done.returncode, errors) == (0, []), lines[-1:]
    said = [json.loads(line.partition(" ")[2]) for line in lines]
    assert len(said) == CASES + 1
    assert said[0] is None, "the whole file is drawn"
    refused = [text for text in said if text is not None]
    assert [text for text in refused if "\n" in text or len(text) > 400] == []
    assert len(refused) > CASES // 4, "damage is noticed"
    assert not [path for path in tmp_path.iterdir() if path.name.startswith(".")]


def test_damage_does_damage() -> None:
    """And the same each time, or a failure could not be looked at again."""
    data = bytes(range(256))
    made = [damage(data, np.random.default_rng(seed)) for seed in range(200)]
    assert made == [damage(data, np.random.default_rng(seed)) for seed in range(200)]
    assert sum(other != data for other in made) > 190
    assert {len(other) < 256 for other in made} == {True, False}
    assert issubclass(gb.ImageError, gb.GlbumpError)
