"""How much of a large foreign library runs under the shader tests as it is: functions of lygia, drawn at random.

npm pack lygia && tar xzf lygia-*.tgz      # anywhere outside of this repository
python -m benchmarks.lygia package [--count 200] [--seed 0]
"""

from __future__ import annotations

import argparse
import random
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np

from glbump.errors import GlbumpError
from glbump.gl.source import resolve
from glbump.glsltest import Glsl
from glbump.glsltest.columns import DTYPES
from glbump.glsltest.declarations import Signature, Type, declarations

ROWS = 64


def functions(folder: Path) -> tuple[list[tuple[Path, Signature]], Counter[str]]:
    """Every function that a file itself defines, and why files gave none."""
    found: list[tuple[Path, Signature]] = []
    lost: Counter[str] = Counter()
    for path in sorted(folder.rglob("*.glsl")):
        try:
            source = resolve(path, folders=[folder])
            seen = declarations(source.text)
        except GlbumpError as error:
            lost[reason(str(error))] += 1
            continue
        for f in seen.functions:
            if source.origin(source.text.count("\n", 0, f.start) + 1)[0] == source.name:
                found.append((path, f))
    return found, lost


def value(kind: Type, rng: np.random.Generator) -> Any:
    """Random rows of a type: numbers from 0 to 1, small integers, pictures of 8x8."""
    if kind.is_sampler:
        return rng.random((6, 8, 8, 4) if "Cube" in kind.name else (8, 8, 4)).astype(np.float32)
    if kind.fields:
        return {name: value(Type(t.name, (*kind.dims, *t.dims), t.fields), rng) for name, t in kind.fields}
    shape = (ROWS, *kind.dims, *kind.tail)
    dtype = DTYPES.get(kind.scalar, np.float32)
    if np.dtype(dtype).kind == "f":
        return rng.random(shape).astype(dtype)
    return rng.integers(0, 2 if kind.scalar == "bool" else 4, shape).astype(dtype)


def reason(error: str) -> str:
    """The first line of an error, without what is particular to one function."""
    first = error.splitlines()[0]
    for word, told in (
        ("no shader file", "an include that is not in the package"),
        ("only numbers", "a parameter that is no plain value"),
        ("arrays can be", "a kind of sampler that cannot be made"),
        ("circle", "includes in a circle"),
        ("screen derivatives", "rows must be quads"),
        ("undeclared", "a name that the file leaves to its user: " + first.split("`")[-1].split("'")[0]),
        ("no function with name", "a function that the file leaves to its user"),
        ("no matching function", "a call that GLSL does not allow"),
    ):
        if word in first:
            return told
    return first.split(": ", 1)[-1][:70]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--seed", type=int, default=0)
    told = parser.parse_args()
    found, lost = functions(told.folder)
    chosen = random.Random(told.seed).sample(found, min(told.count, len(found)))
    stopped: Counter[str] = Counter()
    ran = 0
    with Glsl() as glsl:
        for path, signature in chosen:
            rng = np.random.default_rng(told.seed)
            try:
                f = glsl.load(path, folders=[told.folder])[signature.key]
                arguments = [value(p.type, rng) for p in signature.params if p.direction != "out"]
                if f.overloads[0].derives:
                    arguments = [a.reshape(-1, 2, 2, *a.shape[1:]) if a.shape[0] == ROWS else a for a in arguments]
                f(*arguments)
                ran += 1
            except GlbumpError as error:
                stopped[reason(str(error))] += 1
                if reason(str(error)).startswith("a name"):
                    continue
                print(f"{path.relative_to(told.folder)}: {signature.name}: {str(error).splitlines()[0]}")
    print(f"{ran} of {len(chosen)} functions ran as they are: {100 * ran / len(chosen):.1f} %")
    for why, count in stopped.most_common():
        print(f"{count:5}  {why}")
    print(f"files without functions, of {len(list(told.folder.rglob('*.glsl')))}: {dict(lost)}")


if __name__ == "__main__":
    main()
