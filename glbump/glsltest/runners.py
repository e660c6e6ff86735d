"""Words in, words out: the three ways to run a wrapped function over rows."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any

import moderngl
import numpy as np
import numpy.typing as npt

from glbump.errors import LimitError, ShaderError
from glbump.gl.context import Context
from glbump.gl.program import build_compute, build_program
from glbump.gl.source import Source, resolve
from glbump.glsltest.arguments import Array, words
from glbump.glsltest.wrapper import DATA_WIDTH, HEADER, LOCAL_SIZE, SCREEN_TRIANGLE, Plan

Words = npt.NDArray[np.uint32]
# Bytes of one buffer, and rows of one dispatch, at most: larger calls go in parts.
MOST_BYTES = 1 << 25
MOST_ROWS = 1 << 21
# A signalling NaN that arithmetic never makes: where four stand in a row, nothing was written.
UNWRITTEN = 0x7FA5A5A5
_UNWRITTEN = UNWRITTEN.to_bytes(4, "little")
_DATA_UNIT = 0
_SMALL = 1 << 16


class Runner:
    """A compiled function. `run` fills `results`, an array (rows, words) for each output column."""

    def __init__(self, context: Context, arena: Arena, plan: Plan, prefix: str, program: Any) -> None:
        self.context, self.gl, self.arena = context, context.gl, arena
        self.plan, self.prefix, self.program = plan, prefix, program
        self.released = False
        self.token = 0

    def release(self) -> None:
        """Give the program back to the driver."""
        self.released = True
        self.program.release()

    def set_uniforms(self, values: Mapping[str, bytes], textures: Sequence[Any]) -> None:
        """Set the source's own uniforms and bind the samplers; what the compiler dropped is passed over."""
        for name, data in values.items():
            if name in self.program:
                self.program[name].write(data)
        for i, texture in enumerate(textures):
            name = f"{self.prefix}s{i}"
            if name in self.program:
                texture.use(1 + i)
                self.program[name].value = 1 + i

    @cached_property
    def part(self) -> int:
        """Rows that go in one part: whole quads, because a 2x2 quad must not be torn."""
        most = max(sum(c.words for c in self.plan.in_columns), self.plan.out_words, 1)
        return max(4, min(MOST_ROWS, MOST_BYTES // (4 * most)) // 4 * 4)

    def run(self, columns: Sequence[Array], count: int, results: Sequence[Words]) -> None:
        """Call for `count` rows, in parts where they are many."""
        data = [words(c) for c in columns]
        shared = [len(d) == c.words for d, c in zip(data, self.plan.in_columns, strict=True)]
        for first in range(0, count, self.part):
            last = min(first + self.part, count)
            pieces = data
            if first or last < count:
                pieces = [
                    d if s else d[first * c.words : last * c.words]
                    for d, s, c in zip(data, shared, self.plan.in_columns, strict=True)
                ]
            self.run_part(self._header(pieces, shared, last - first), pieces, first, last, results)
        self.check_errors()

    def run_part(self, head: Words, pieces: Sequence[Words], first: int, last: int, results: Sequence[Words]) -> None:
        """Rows first..last: `head` and `pieces` are the block of words."""
        raise NotImplementedError

    def _header(self, pieces: Sequence[Words], shared: Sequence[bool], rows: int) -> Words:
        """The block's first words: rows, then offset and stride of each column."""
        head = [rows, self.next_token()]
        at = HEADER + 2 * len(pieces)
        for piece, same, column in zip(pieces, shared, self.plan.in_columns, strict=True):
            head += [at, 0 if same else column.words]
            at += len(piece)
        return np.array(head, np.uint32)

    def next_token(self) -> int:
        """What tells this call's results from those of the calls before."""
        self.token = self.token % 0xFFFFFF + 1
        return self.token

    def check_errors(self) -> None:
        """ShaderError where OpenGL reports one."""
        if (error := self.gl.error) != "GL_NO_ERROR":
            raise ShaderError(f"{self.plan.signature}: the driver reports {error} after the call")

    def unwritten(self) -> ShaderError:
        renderer = self.gl.info["GL_RENDERER"]
        return ShaderError(f"{self.plan.signature}: the driver ({renderer}) ran nothing, and reported no error")


class Arena:
    """Buffers and targets that calls share; they grow, and are given back together."""

    def __init__(self, context: Context) -> None:
        self.gl = context.gl
        self._kept: dict[str, Any] = {}
        self._sizes: dict[str, int] = {}

    def buffer(self, name: str, size: int) -> moderngl.Buffer:
        """A buffer of at least `size` bytes."""
        if self._sizes.get(name, 0) < size:
            self._free(name)
            self._sizes[name] = max(1 << 12, 1 << (size - 1).bit_length())
            self._kept[name] = self.gl.buffer(reserve=self._sizes[name])
        made: moderngl.Buffer = self._kept[name]
        return made

    def data_texture(self, rows: int) -> moderngl.Texture:
        """A texture of words, DATA_WIDTH wide and at least `rows` high."""
        kept = self._kept.get("data")
        if kept is None or kept.height < rows:
            if kept is not None:
                kept.release()
            size = (DATA_WIDTH, 1 << (rows - 1).bit_length())
            if size[1] > (most := self.gl.info["GL_MAX_TEXTURE_SIZE"]):
                raise LimitError(f"arguments of {rows * DATA_WIDTH} words; this driver takes {most * DATA_WIDTH}")
            kept = self._kept["data"] = self.gl.texture(size, 1, dtype="u4")
            kept.filter = (moderngl.NEAREST, moderngl.NEAREST)
        return kept

    def target(self, width: int, height: int, groups: int) -> moderngl.Framebuffer:
        """A target of `groups` uvec4, `width` wide and at least `height` high."""
        name = f"target {width} {groups}"
        kept = self._kept.get(name)
        if kept is None or kept.height < height:
            self._free(name)
            size = (width, 1 << (height - 1).bit_length())
            kept = self._kept[name] = self.gl.framebuffer([self.gl.texture(size, 4, dtype="u4") for _ in range(groups)])
        return kept

    def _free(self, name: str) -> None:
        kept = self._kept.pop(name, None)
        self._sizes.pop(name, None)
        if isinstance(kept, moderngl.Framebuffer):
            self.gl.detect_framebuffer(0).use()  # moderngl binds the last one again later, and this one will be gone
            for texture in kept.color_attachments:
                texture.release()
        if kept is not None:
            kept.release()

    def release(self) -> None:
        for name in list(self._kept):
            self._free(name)

    @property
    def objects(self) -> Counter[str]:
        """How many GL objects of each kind are held."""
        found: Counter[str] = Counter()
        for kept in self._kept.values():
            found[type(kept).__name__.lower()] += 1
            if isinstance(kept, moderngl.Framebuffer):
                found["texture"] += len(kept.color_attachments)
        return found


class ComputeRunner(Runner):
    """Compute shader with storage buffers (OpenGL 4.3)."""

    def __init__(self, context: Context, arena: Arena, plan: Plan, prefix: str, source: Source) -> None:
        super().__init__(context, arena, plan, prefix, build_compute(context.gl, source))

    def run_part(self, head: Words, pieces: Sequence[Words], first: int, last: int, results: Sequence[Words]) -> None:
        rows = last - first
        size = 4 * (len(head) + sum(map(len, pieces)))
        block = self.arena.buffer("in", size)
        out = self.arena.buffer("out", 4 * rows * self.plan.out_words + 4)
        if size <= _SMALL:  # one write costs less than several
            block.write(np.concatenate([head, *pieces]))
        else:
            at = 0
            for piece in (head, *pieces):
                block.write(piece, at)
                at += piece.nbytes
        block.bind_to_storage_buffer(0)
        out.bind_to_storage_buffer(1)
        self.program.run(-(-rows // LOCAL_SIZE))
        self.gl.memory_barrier(moderngl.BUFFER_UPDATE_BARRIER_BIT)
        at = 0
        for column, result in zip(self.plan.out_columns, results, strict=True):
            size = 4 * rows * column.words
            out.read_into(result[first:last], size, at)
            at += size
        # The last row puts the token of this call behind the results: they are not those of another.
        if int.from_bytes(out.read(4, offset=at), "little") != self.token:
            raise self.unwritten()


class DrawingRunner(Runner):
    """A program that draws: its arguments are in a texture, its results come in passes."""

    def __init__(self, context: Context, arena: Arena, plan: Plan, prefix: str, program: Any) -> None:
        super().__init__(context, arena, plan, prefix, program)
        self.vertices = self.gl.vertex_array(program, [])

    def release(self) -> None:
        self.vertices.release()
        super().release()

    def upload(self, pieces: Sequence[Words]) -> None:
        """Put the block of words into the data texture, and bind it."""
        block = np.concatenate(pieces)
        rows = -(-len(block) // DATA_WIDTH)
        padded = np.zeros(rows * DATA_WIDTH, np.uint32)
        padded[: len(block)] = block
        texture = self.arena.data_texture(rows)
        texture.write(padded, viewport=(0, 0, DATA_WIDTH, rows), alignment=1)
        texture.use(_DATA_UNIT)
        self.set_number("data", _DATA_UNIT)

    def set_number(self, name: str, value: int) -> None:
        """A uniform of the harness's own, where the compiler has kept it."""
        if (name := f"{self.prefix}{name}") in self.program:
            self.program[name].value = value


class FeedbackRunner(DrawingRunner):
    """Vertex shader with transform feedback (OpenGL 3.3)."""

    def __init__(self, context: Context, arena: Arena, plan: Plan, prefix: str, source: Source) -> None:
        names = [f"{prefix}o{g}" for g in range(plan.groups)]
        super().__init__(context, arena, plan, prefix, build_program(context.gl, source, varyings=names))

    def run_part(self, head: Words, pieces: Sequence[Words], first: int, last: int, results: Sequence[Words]) -> None:
        self.upload([head, *pieces])
        rows, groups = last - first, self.plan.groups
        out = self.arena.buffer("out", 16 * rows * groups)
        # Without a target bound, feedback writes nothing and says nothing.
        self.arena.target(2, 2, 1).use()
        made = np.empty((self.plan.passes, rows, 4 * groups), np.uint32)
        for number in range(self.plan.passes):
            self.set_number("pass", number)
            out.write(4 * _UNWRITTEN, 16 * rows * groups - 16)
            self.vertices.transform(out, moderngl.POINTS, vertices=rows)
            out.read_into(made[number], 16 * rows * groups)
            if (made[number, -1, -4:] == UNWRITTEN).all():
                raise self.unwritten()
        _split(made.transpose(1, 0, 2).reshape(rows, -1), results, first, last)


class FragmentRunner(DrawingRunner):
    """Fragment shader that draws into integer targets: 2x2 quads, so screen derivatives work."""

    def __init__(self, context: Context, arena: Arena, plan: Plan, prefix: str, source: Source) -> None:
        vertex = resolve(text=SCREEN_TRIANGLE, name="<glbump>", stage="vertex")
        super().__init__(context, arena, plan, prefix, build_program(context.gl, vertex, source))

    def run_part(self, head: Words, pieces: Sequence[Words], first: int, last: int, results: Sequence[Words]) -> None:
        self.upload([head, *pieces])
        rows, groups = last - first, self.plan.groups
        width = 64 if rows <= 4096 else 2048
        height = 2 * -(-rows // (2 * width))
        target = self.arena.target(width, height, groups)
        target.use()
        first_texture: Any = target.color_attachments[0]
        target.viewport = (0, 0, width, height)
        self.set_number("width", width)
        made = np.empty((self.plan.passes, groups, height, width, 4), np.uint32)
        for number in range(self.plan.passes):
            self.set_number("pass", number)
            first_texture.write(4 * _UNWRITTEN, viewport=(0, 0, 1, 1))
            self.vertices.render(moderngl.TRIANGLES, vertices=3)
            for group in range(groups):
                target.read_into(
                    made[number, group],
                    viewport=(0, 0, width, height),
                    components=4,
                    attachment=group,
                    alignment=1,
                    dtype="u4",
                )
            if (made[number, 0, 0, 0] == UNWRITTEN).all():
                raise self.unwritten()
        # (pass, group, quad row, y, quad column, x, word) -> (quad row, quad column, y, x, pass, group, word)
        quads = made.reshape(self.plan.passes, groups, height // 2, 2, width // 2, 2, 4)
        flat = quads.transpose(2, 4, 3, 5, 0, 1, 6).reshape(height * width, -1)
        _split(flat[:rows], results, first, last)


def _split(flat: Words, results: Sequence[Words], first: int, last: int) -> None:
    """Rows of all words -> each column's."""
    at = 0
    for result in results:
        width = result.shape[1]
        result[first:last] = flat[:, at : at + width]
        at += width


RUNNERS = {"compute": ComputeRunner, "feedback": FeedbackRunner, "fragment": FragmentRunner}
