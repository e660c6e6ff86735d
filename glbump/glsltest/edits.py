"""Changes to a resolved text that keep every line where it is, so that the line table stays true."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass

from glbump.errors import ShaderError, unknown
from glbump.glsltest.declarations import Declarations, Signature, Variable
from glbump.glsltest.grammar import Node
from glbump.glsltest.preprocess import blank

# What only a fragment shader may say.
FRAGMENT_WORDS = frozenset(
    [f"{f}{k}" for f in ("dFdx", "dFdy", "fwidth") for k in ("", "Coarse", "Fine")]
    + ["discard", "gl_FragCoord", "gl_FrontFacing", "gl_PointCoord", "textureQueryLod"]
    + ["interpolateAtCentroid", "interpolateAtOffset", "interpolateAtSample"]
)
# Look-ups whose level follows from derivatives.
IMPLICIT_LEVEL = frozenset(["texture", "textureProj", "textureOffset", "textureProjOffset", "texture2D", "textureCube"])
_INTERFACE = frozenset(["in", "out", "varying", "attribute"])


@dataclass(frozen=True)
class Edit:
    """text[start:end] becomes `text`, which holds as many newlines as what it replaces."""

    start: int
    end: int
    text: str


def apply(text: str, edits: Iterable[Edit]) -> str:
    """All edits made; those that insert at one place go in in the order given."""
    out, at = [], 0
    for edit in sorted(edits, key=lambda e: (e.start, e.end)):
        out += [text[at : edit.start], edit.text]
        at = edit.end
    return "".join([*out, text[at:]])


def bare(text: str, found: Declarations) -> list[Edit]:
    """What every wrapper needs out of the way: main, and in and out variables (plain globals instead)."""
    edits = [_blanked(text, f.start, f.end) for f in found.functions if f.name == "main"]
    starts = {(v.start, v.type_start) for v in found.variables.values() if _INTERFACE & set(v.qualifiers)}
    return edits + [_blanked(text, *span) for span in sorted(starts)]


def _blanked(text: str, start: int, end: int) -> Edit:
    return Edit(start, end, blank(text[start:end]))


def needs_fragment(found: Declarations, signature: Signature) -> bool:
    """Whether the function, or one that it calls, only compiles in a fragment shader."""
    return any(FRAGMENT_WORDS & found.words(f) for f in found.reached(signature))


def without_fragment_functions(text: str, found: Declarations) -> list[Edit]:
    """Functions that only compile in a fragment shader, blanked, so that the others run in any stage."""
    return [_blanked(text, f.start, f.end) for f in found.functions if f.name != "main" and needs_fragment(found, f)]


def with_constants(found: Declarations, constants: Mapping[str, object]) -> list[Edit]:
    """New values for global constants, as GLSL expressions."""
    edits = []
    for name, value in constants.items():
        variable = found.variables.get(name)
        if variable is None or variable.value is None:
            allowed = [v.name for v in found.variables.values() if v.value is not None]
            raise ShaderError(unknown("constant", name, allowed))
        edits.append(Edit(*variable.value, _literal(variable, value)))
    return edits


def _literal(variable: Variable, value: object) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, float) or (isinstance(value, int) and variable.type.scalar == "float"):
        return f"{variable.type.name}({float(value)!r})"
    return str(value).replace("\n", " ")


def first_function(found: Declarations) -> int:
    """The offset before the first function, where what functions need can be declared."""
    return min((f.start for f in found.functions), default=len(found.active.text))


def loop_guards(found: Declarations, functions: Collection[Signature], prefix: str) -> tuple[list[Edit], list[int]]:
    """A count in the condition of every loop without a fixed bound, and the offsets of those loops.

    GLSL has no way to stop a shader from outside: a loop that never ends takes the driver with it.
    """
    edits: list[Edit] = []
    loops: list[int] = []
    for f in functions:
        try:
            body = found.body(f)
        except ShaderError:
            continue  # macros that are no GLSL by themselves; the driver's watchdog is left
        for node in body.walk():
            if node.kind not in ("while", "do", "for") or _bounded(found, node):
                continue
            loops.append(node.start)
            go = f"{prefix}go({len(loops)}) && "
            condition = node.kids[1] if node.kind in ("for", "do") else node.kids[0]
            if condition.kind == "empty":
                edits.append(Edit(condition.start, condition.start, go.removesuffix(" && ")))
            elif condition.kind == "group":
                edits.append(Edit(condition.start + 1, condition.start + 1, go + "("))
                edits.append(Edit(condition.end - 1, condition.end - 1, ")"))
            else:
                edits.append(Edit(condition.start, condition.start, go + "("))
                edits.append(Edit(condition.end, condition.end, ")"))
    return edits, loops


def guard_header(prefix: str, limit: int) -> str:
    """GLSL that loop guards call, on one line."""
    p = prefix
    return (
        f"int {p}loops = 0; uint {p}status = 0u; bool {p}go(int {p}i) "
        f"{{ if (++{p}loops > {limit}) {p}status = uint({p}i); return {p}status == 0u; }} "
    )


def _bounded(found: Declarations, loop: Node) -> bool:
    """for (int i = a; i < constant; ++i) that does not touch i: it ends."""
    if loop.kind != "for" or loop.kids[1].kind != "binary" or loop.kids[2].kind not in ("unary", "postfix", "assign"):
        return False
    left, right = loop.kids[1].kids
    name = left.word
    constant = right.kind == "number" or (
        right.kind == "name"
        and (right.word in found.active.macros or "const" in getattr(found.variables.get(right.word), "qualifiers", ()))
    )
    step = loop.kids[2]
    steps = step.word in ("++", "--") or (step.word in ("+=", "-=") and step.kids[1].kind == "number")
    touched = any(
        n.kind in ("assign", "unary", "postfix", "call")
        and n.word not in ("-", "+", "!", "~")
        and any(k.kind == "name" and k.word == name for k in _written(n))
        for n in loop.kids[3].walk()
    )
    return left.kind == "name" and constant and steps and step.kids[0].word == name and not touched


def _written(node: Node) -> list[Node]:
    """What a node may change: a call, any argument (it may be an out parameter)."""
    return node.kids if node.kind == "call" else node.kids[:1]
