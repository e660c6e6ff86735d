"""The demo's mesh: a tube along a trefoil knot, as the text of an OBJ file."""

from __future__ import annotations

import numpy as np


def knot(around: int = 320, across: int = 32, tube: float = 0.26) -> str:
    """A closed tube with positions, uv (u along the knot, v round the tube) and normals; about 2 wide."""
    t = np.linspace(0, 2 * np.pi, around + 1)
    centre = np.stack([np.sin(t) + 2 * np.sin(2 * t), np.cos(t) - 2 * np.cos(2 * t), -np.sin(3 * t)], axis=-1) / 2.6
    along = np.stack([np.cos(t) + 4 * np.cos(2 * t), -np.sin(t) + 4 * np.sin(2 * t), -3 * np.cos(3 * t)], axis=-1)
    along /= np.linalg.norm(along, axis=-1, keepdims=True)
    # The knot winds round +Z and never runs through its axis: outwards from it is a frame that closes.
    outwards = centre - (centre * along).sum(axis=-1, keepdims=True) * along
    outwards /= np.linalg.norm(outwards, axis=-1, keepdims=True)
    sideways = np.cross(outwards, along)

    angle = np.linspace(0, 2 * np.pi, across + 1)
    normals = (
        outwards[:, None] * np.cos(angle)[None, :, None] + sideways[:, None] * np.sin(angle)[None, :, None]
    ).reshape(-1, 3)
    points = np.repeat(centre, across + 1, axis=0) + tube * normals
    u, v = np.repeat(t / (2 * np.pi), across + 1), np.tile(angle / (2 * np.pi), around + 1)

    lines = ["# A trefoil knot, made by glbump demo."]
    lines += [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in points.tolist()]
    lines += [f"vt {a:.6f} {b:.6f}" for a, b in zip(u.tolist(), v.tolist())]
    lines += [f"vn {x:.5f} {y:.5f} {z:.5f}" for x, y, z in normals.tolist()]
    # OBJ counts from 1. Seen from outside, u runs to one side and v to the next counter-clockwise.
    first = (np.arange(around)[:, None] * (across + 1) + np.arange(across) + 1).ravel()
    for a in first.tolist():
        b, c, d = a + across + 1, a + across + 2, a + 1
        lines.append(f"f {a}/{a}/{a} {b}/{b}/{b} {c}/{c}/{c}")
        lines.append(f"f {a}/{a}/{a} {c}/{c}/{c} {d}/{d}/{d}")
    return "\n".join(lines) + "\n"
