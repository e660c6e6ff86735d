"""Seeded faults: a shader with one thing wrong, to see whether the tests notice.

The kinds are the slips people make: a sign, swapped operands, sine for cosine, another component, a dropped
normalize, one more or less, a wrong constant, a turned condition. A fault stands on one line and keeps it there.
"""

from __future__ import annotations

import random
import tomllib
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from glbump.errors import ShaderError
from glbump.gl.source import Source, resolve
from glbump.glsltest.declarations import declarations
from glbump.glsltest.grammar import Node

_OPERATORS = {
    "+": "-", "-": "+", "*": "/", "/": "*", "<": "<=", "<=": "<", ">": ">=", ">=": ">", "==": "!=", "!=": "==",
    "&&": "||", "||": "&&", "+=": "-=", "-=": "+=", "*=": "/=", "/=": "*=", "++": "--", "--": "++",
    "&": "|", "|": "&", "<<": ">>", ">>": "<<",
}  # fmt: skip
_TURNED = {"<": ">", ">": "<", "<=": ">=", ">=": "<="}
_FUNCTIONS = {
    "sin": "cos", "cos": "sin", "asin": "acos", "acos": "asin", "min": "max", "max": "min", "floor": "ceil",
    "ceil": "floor", "round": "floor", "exp": "exp2", "exp2": "exp", "log": "log2", "log2": "log",
    "sqrt": "inversesqrt", "inversesqrt": "sqrt", "any": "all", "all": "any", "dFdx": "dFdy", "dFdy": "dFdx",
    "greaterThan": "lessThan", "lessThan": "greaterThan",
}  # fmt: skip
# Functions of one value that one may forget, and of several whose first argument is the value.
_DROPPED = frozenset(["normalize", "abs", "clamp", "fract", "sign", "radians", "degrees"])
_ORDERED = frozenset(["atan", "cross", "pow", "step", "mod", "mix", "reflect", "smoothstep", "distance"])
_AXES = ("xyzw", "rgba", "stpq")


@dataclass(frozen=True)
class Mutant:
    """One fault: `old` at this place of a file, inside `function`, becomes `new`."""

    file: str
    line: int
    column: int
    function: str
    old: str
    new: str

    def __str__(self) -> str:
        return f"{self.file}:{self.line}:{self.column}: {self.function}: {self.old} -> {self.new}"

    def in_source(self, source: Source) -> Source:
        """`source` with the fault in it; as it was where it does not hold the place."""
        if self.file not in source.files:
            return source
        lines = source.text.split("\n")
        for i, origin in enumerate(source.lines):
            begin = self.column - 1
            if origin == (self.file, self.line) and lines[i][begin : begin + len(self.old)] == self.old:
                lines[i] = lines[i][:begin] + self.new + lines[i][begin + len(self.old) :]
        return replace(source, text="\n".join(lines))


def mutants_of(path: Path) -> list[Mutant]:
    """All faults of the functions that a file itself defines."""
    source = resolve(path)
    found = declarations(source.text)
    made: dict[Mutant, None] = {}
    for f in found.functions:
        try:
            body = found.body(f)
        except ShaderError:
            continue
        # The order of components does not matter to a length.
        lengths = {id(n.kids[0]) for n in body.walk() if n.kind == "call" and n.word == "length" and n.kids}
        for node in body.walk():
            if node.kind == "member" and id(node) in lengths:
                continue
            for start, end, new in _faults(source.text, node):
                old = source.text[start:end]
                line = source.text.count("\n", 0, start)
                file, number = source.origin(line + 1)
                if file == source.name and "\n" not in old and new != old:
                    column = start - (source.text.rfind("\n", 0, start) + 1) + 1
                    made[Mutant(file, number, column, f.name, old, new)] = None
    return list(made)


Fault = tuple[int, int, str]


def _faults(text: str, node: Node) -> Iterator[Fault]:
    def said(part: Node) -> str:
        return text[part.start : part.end]

    if node.kind in ("binary", "assign"):
        yield from _operator_faults(text, node)
    elif node.kind in ("unary", "postfix"):
        if node.word in ("-", "!"):
            yield node.start, node.end, said(node.kids[0])
        elif node.word in ("++", "--") and node.kind == "postfix":
            yield node.end - 2, node.end, _OPERATORS[node.word]
    elif node.kind == "call":
        yield from _call_faults(text, node)
    elif node.kind == "member":
        yield from _swizzle_faults(node)
    elif node.kind == "ternary":
        condition, yes, no = node.kids
        yield node.start, node.end, f"{said(condition)} ? ({said(no)}) : ({said(yes)})"
    elif node.kind in ("if", "while"):
        condition = node.kids[0]
        yield condition.start, condition.end, f"(!{said(condition)})"
    elif node.kind == "number":
        yield node.start, node.end, _wrong_number(node.word)


def _operator_faults(text: str, node: Node) -> Iterator[Fault]:
    left, right = node.kids
    op = node.word
    at = text.index(op, left.end)
    if op in _OPERATORS:
        yield at, at + len(op), _OPERATORS[op]
    if op in _TURNED:
        yield at, at + len(op), _TURNED[op]
    if node.kind == "binary" and op in ("-", "/"):
        one, other = text[left.start : left.end], text[right.start : right.end]
        yield node.start, node.end, f"({other}) {op} ({one})"


def _call_faults(text: str, node: Node) -> Iterator[Fault]:
    name_end = node.start + len(node.word)
    if node.word in _FUNCTIONS:
        yield node.start, name_end, _FUNCTIONS[node.word]
    if node.word in _DROPPED and node.kids:
        first = node.kids[0]
        yield node.start, node.end, f"({text[first.start : first.end]})"
    if node.word in _ORDERED and len(node.kids) >= 2:
        a, b = node.kids[:2]
        between = text[a.end : b.start]
        yield a.start, b.end, f"{text[b.start : b.end]}{between}{text[a.start : a.end]}"
    if node.word == "length" and node.kids:
        inner = text[node.kids[0].start : node.kids[0].end]
        yield node.start, node.end, f"dot({inner}, {inner})"


def _swizzle_faults(node: Node) -> Iterator[Fault]:
    start = node.end - len(node.word)
    axes = next((a for a in _AXES if set(node.word) <= set(a)), None)
    if axes is None:
        return
    if len(node.word) > 1:
        yield start, node.end, node.word[1:] + node.word[0]
    else:
        # x and y are in every vector: always compiles.
        yield start, node.end, axes[1] if node.word == axes[0] else axes[0]


def _wrong_number(word: str) -> str:
    if not word.lower().startswith("0x") and ("." in word or "e" in word.lower()):
        value = float(word.rstrip("fF"))
        return repr(value * 1.1 if value else 0.1)
    suffix = word[len(word.rstrip("uU")) :]
    return f"{int(word.rstrip('uU'), 0) + 1}{suffix}"


@dataclass(frozen=True)
class Known:
    """A survivor that somebody explained: which fault (file, function, old -> new, maybe line), and the reason."""

    file: str
    function: str
    change: str
    reason: str

    def explains(self, mutant: Mutant) -> bool:
        return (
            mutant.file == self.file
            and mutant.function == self.function
            and self.change in (f"{mutant.old} -> {mutant.new}", f"{mutant.old} -> *")
        )


def read_known(path: Path) -> list[Known]:
    """Explained survivors from a TOML file of [[survivor]] tables: file, function, change, reason."""
    with path.open("rb") as file:
        tables = tomllib.load(file).get("survivor", [])
    try:
        return [Known(**table) for table in tables]
    except TypeError as error:
        raise ShaderError(f"{path}: a [[survivor]] has file, function, change, reason: {error}") from None


@dataclass
class Outcome:
    """What became of the faults."""

    killed: list[Mutant]
    survived: list[Mutant]
    untested: list[Mutant]
    stillborn: list[Mutant]

    @property
    def share(self) -> float:
        """Killed, of all that compile."""
        tried = len(self.killed) + len(self.survived) + len(self.untested)
        return len(self.killed) / tried if tried else 1.0

    def report(self, known: Iterable[Known]) -> list[str]:
        """The lines of the report: the share, then each survivor with its explanation or without."""
        tried = len(self.killed) + len(self.survived) + len(self.untested)
        lines = [
            f"{len(self.killed)} of {tried} seeded faults killed: {100 * self.share:.1f} %"
            f" ({len(self.stillborn)} more did not compile)"
        ]
        notes = list(known)
        for mutant in self.survived:
            reason = next((k.reason for k in notes if k.explains(mutant)), None)
            lines.append(f"survived: {mutant}" + (f" [{reason}]" if reason else " [not explained]"))
        lines += [f"survived: {mutant} [no test calls it]" for mutant in self.untested]
        alive = self.survived + self.untested
        seeded = {mutant.file for mutant in [*self.killed, *alive]}
        lines += [
            f"explained, but killed or gone: {k.file}: {k.function}: {k.change}"
            for k in notes
            if k.file in seeded and not any(k.explains(m) for m in alive)
        ]
        return lines


def chosen(mutants: list[Mutant], count: int | None, seed: int) -> list[Mutant]:
    """`count` of the faults, drawn by `seed`; all where count is None."""
    if count is None or count >= len(mutants):
        return mutants
    return random.Random(seed).sample(mutants, count)
