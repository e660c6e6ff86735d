"""Which lines of a GLSL text the driver compiles: directives obeyed, everything else blanked in place.

Blanked means overwritten with spaces: every character that stays keeps its offset and its line, so that what
the parser finds in the blanked text can be pointed at, or changed, in the original.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field

from glbump.errors import ShaderError
from glbump.glsltest.grammar import evaluate, parse_expression

_COMMENT = re.compile(r"//[^\n]*(?:\\\n[^\n]*)*|/\*.*?(?:\*/|\Z)", re.DOTALL)
_DIRECTIVE = re.compile(r"[ \t]*#[ \t]*(\w*)(.*)", re.DOTALL)
_DEFINE = re.compile(r"\s*(\w+)(\(([^)]*)\))?(.*)", re.DOTALL)
_NAME = re.compile(r"(?<![\w.])[A-Za-z_]\w*")


@dataclass(frozen=True)
class Macro:
    """A `#define`: `params` is None for one without parentheses."""

    params: tuple[str, ...] | None
    body: str


@dataclass
class Active:
    """What of a text is compiled: `text` blanked elsewhere, the macros at its end, and each #if's fate.

    branches: (line of the directive, 1-based; whether the lines under it are compiled).
    """

    text: str
    macros: dict[str, Macro] = field(default_factory=dict)
    branches: list[tuple[int, bool]] = field(default_factory=list)


def blank(text: str) -> str:
    """Spaces in place of everything but newlines."""
    return re.sub(r"[^\n]", " ", text)


def active(text: str, predefined: Mapping[str, str] | None = None) -> Active:
    """The part of `text` that is compiled; `predefined` are the driver's macros.

    Raises ShaderError for an #if expression that cannot be evaluated, with its line.
    """
    found = Active("", {name: Macro(None, body) for name, body in (predefined or {}).items()})
    bare = _COMMENT.sub(lambda m: blank(m[0]), text)
    kept: list[str] = []
    # One entry for each open #if: (this branch is compiled, one of its branches was, all around it is).
    stack: list[tuple[bool, bool, bool]] = []
    lines = bare.split("\n")
    i = 0
    while i < len(lines):
        first = i
        while lines[i].endswith("\\") and i + 1 < len(lines):
            i += 1
        i += 1
        whole = "\n".join(lines[first:i])
        on = all(s[0] for s in stack)
        match = _DIRECTIVE.match(whole)
        if match is None:
            kept.append(whole if on else blank(whole))
            continue
        kept.append(blank(whole))
        word, rest = match[1], match[2].replace("\\\n", " ")
        if word in ("if", "ifdef", "ifndef", "elif", "else", "endif"):
            _conditional(word, rest, stack, found, first + 1)
        elif on and word == "define" and (define := _DEFINE.match(rest)):
            params = tuple(p.strip() for p in define[3].split(",")) if define[2] else None
            found.macros[define[1]] = Macro(params, define[4].strip())
        elif on and word == "undef":
            found.macros.pop(rest.strip(), None)
    found.text = "\n".join(kept)
    return found


def _conditional(word: str, rest: str, stack: list[tuple[bool, bool, bool]], found: Active, line: int) -> None:
    if word == "endif":
        if stack:
            stack.pop()
        return
    if word in ("elif", "else"):
        if not stack:
            return
        _, taken, around = stack.pop()
    else:
        taken, around = False, all(s[0] for s in stack)
    now = around and not taken and _holds(word, rest, found.macros, line)
    stack.append((now, taken or now, around))
    if around:
        found.branches.append((line, now))


def _holds(word: str, rest: str, macros: Mapping[str, Macro], line: int) -> bool:
    if word == "else":
        return True
    if word in ("ifdef", "ifndef"):
        return (rest.strip() in macros) == (word == "ifdef")
    asked = re.sub(r"\bdefined\s*(?:\(\s*(\w+)\s*\)|(\w+))", lambda m: str(int((m[1] or m[2]) in macros)), rest)
    try:
        value = evaluate(parse_expression(expand(asked, macros)), lambda name: 0)
    except (ShaderError, ZeroDivisionError) as error:
        raise ShaderError(f"line {line}: cannot evaluate #{word} {rest.strip()}: {error}") from None
    return bool(value)


def expand(text: str, macros: Mapping[str, Macro]) -> str:
    """`text` with the macros without parentheses put in, as often as it takes."""
    for _ in range(20):
        grown = _NAME.sub(lambda m: _body(m[0], macros), text)
        if grown == text:
            break
        text = grown
    return text


def _body(name: str, macros: Mapping[str, Macro]) -> str:
    macro = macros.get(name)
    return name if macro is None or macro.params is not None else f" {macro.body} "
