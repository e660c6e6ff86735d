"""What a call of a GLSL function costs against a bare moderngl compute script that does the same, and what
collecting shader tests costs against plain ones."""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from benchmarks.figures import Section, Table, Target
from glbump.gl.context import Context, open_context
from glbump.gl.source import find_shaders
from glbump.glsltest import Glsl
from glbump.trade.timing import Times, in_turns, ratios, spread

RATIO = 1.5
BARE = """#version 430
layout(local_size_x = 64) in;
layout(std430, binding = 0) restrict readonly buffer A { float a[]; };
layout(std430, binding = 1) restrict readonly buffer B { float b[]; };
layout(std430, binding = 2) restrict writeonly buffer C { float o[]; };
uniform int rows;
vec3 reflect_dir(vec3 dir, vec3 n) { return dir - 2.0 * dot(dir, n) * n; }
void main() {
    int i = int(gl_GlobalInvocationID.x);
    if (i >= rows) return;
    vec3 r = reflect_dir(vec3(a[3 * i], a[3 * i + 1], a[3 * i + 2]), vec3(b[3 * i], b[3 * i + 1], b[3 * i + 2]));
    o[3 * i] = r.x; o[3 * i + 1] = r.y; o[3 * i + 2] = r.z;
}
"""


class Bare:
    """The script one would write: buffers ready, two writes, a dispatch, a read into a new array."""

    def __init__(self, context: Context, rows: int) -> None:
        self.gl = context.gl
        self.program = self.gl.compute_shader(BARE)
        self.buffers = [self.gl.buffer(reserve=12 * rows) for _ in range(3)]

    def __call__(self, a: npt.ArrayLike, b: npt.ArrayLike) -> npt.NDArray[np.float32]:
        first, second = (np.ascontiguousarray(v, np.float32) for v in (a, b))
        for i, (buffer, data) in enumerate(zip(self.buffers, (first, second, None), strict=True)):
            if data is not None:
                buffer.write(data)
            buffer.bind_to_storage_buffer(i)
        self.program["rows"] = len(first)
        self.program.run(-(-len(first) // 64))
        self.gl.memory_barrier()
        result = np.empty((len(first), 3), np.float32)
        self.buffers[2].read_into(result, result.nbytes)
        return result


def _calls(context: Context, glsl: Glsl, rows: int, turns: int, repeat: int) -> dict[str, Times]:
    rng = np.random.default_rng(0)
    a, b = (rng.normal(size=(rows, 3)).astype(np.float32) for _ in range(2))
    bare, f = Bare(context, rows), glsl.load(find_shaders() / "lib" / "reflect.glsl").reflect_dir

    def often(call: Any) -> Any:
        def run() -> None:
            for _ in range(repeat):
                call(a, b)

        return run

    ways = {way: often(lambda a, b, way=way: f(a, b, backend=way)) for way in ("compute", "feedback", "fragment")}
    assert np.array_equal(bare(a, b), f(a, b))
    return in_turns({"bare": often(bare), **ways}, turns)


def _collect(tests: int, shader: bool) -> float:
    """Seconds that pytest takes to collect and run so many empty tests, with `glsl` or without."""
    argument = "glsl" if shader else ""
    with tempfile.TemporaryDirectory() as folder:
        body = "".join(f"def test_{i}({argument}): pass\n" for i in range(tests))
        (Path(folder) / "test_it.py").write_text(body)
        command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-p", "no:hypothesispytest", folder]
        started = time.perf_counter()
        subprocess.run([*command, "--collect-only"], check=True, capture_output=True)
        return time.perf_counter() - started


def _context() -> float:
    started = time.perf_counter()
    code = "from glbump.gl.context import open_context\nopen_context().release()"
    subprocess.run([sys.executable, "-c", code], check=True)
    return time.perf_counter() - started


def measure(quick: bool = False) -> Section:
    """A million rows and 64 rows; 200 tests."""
    rows: list[list[str | float | int | None]] = []
    targets = []
    sizes = ((10_000, 3, 1), (64, 3, 5)) if quick else ((1_000_000, 15, 1), (64, 31, 100))
    with open_context() as context, Glsl(context) as glsl:
        for count, turns, repeat in sizes:
            times = _calls(context, glsl, count, turns, repeat)
            base = times["bare"].wall
            for way in ("compute", "feedback", "fragment"):
                ratio = ratios(times[way].wall, base)
                rows.append([f"{count}", way, str(ratio), 1e3 * spread(times[way].wall).median / repeat])
                if way == "compute":
                    targets.append(Target.at_most(f"{count} rows, times the bare script", ratio.median, RATIO))
    turns = 1 if quick else 5
    plain, shader = (min(_collect(200, kind) for _ in range(turns)) for kind in (False, True))
    opened = min(_context() for _ in range(turns))
    targets.append(Target.at_most("collecting 200 shader tests, seconds", shader, plain + opened))
    return Section(
        "A call of a GLSL function costs what its dispatch costs",
        "`reflect_dir` of two (N, 3) float32 arrays: glbump.glsltest against a bare moderngl compute script with its "
        "buffers ready, which writes, dispatches and reads into a new array. Collecting: pytest on a file of 200 empty "
        f"tests that take `glsl` ({shader:.2f} s) and of 200 that take nothing ({plain:.2f} s); opening a context in a "
        f"process of its own takes {opened:.2f} s.",
        (Table(("rows", "way", "times the bare script", "ms a call"), rows),),
        targets,
    )


if __name__ == "__main__":
    from benchmarks.command import alone

    alone(measure)
