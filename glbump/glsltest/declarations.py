"""What a GLSL text declares: structs, functions with their signatures, constants, interface variables."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property

from glbump.errors import ShaderError
from glbump.glsltest.grammar import (
    QUALIFIERS,
    SAMPLERS,
    TYPES,
    Node,
    Parser,
    Token,
    evaluate,
    line_of,
    parse_body,
    tokenize,
)
from glbump.glsltest.preprocess import Active, Macro, active

_NUMERIC = re.compile(r"(?P<kind>[biud]?)(?:vec(?P<n>[234])|mat(?P<c>[234])(?:x(?P<r>[234]))?)$")
_KINDS = {"": "float", "b": "bool", "i": "int", "u": "uint", "d": "double"}


@dataclass(frozen=True)
class Type:
    """A GLSL type: its word, array sizes (outermost first), and the fields where it is a struct."""

    name: str
    dims: tuple[int, ...] = ()
    fields: tuple[tuple[str, Type], ...] = ()

    @cached_property
    def _numeric(self) -> re.Match[str] | None:
        return _NUMERIC.match(self.name)

    @property
    def scalar(self) -> str:
        """float, int, uint, bool or double; the word itself where it is none of these."""
        return _KINDS[self._numeric["kind"]] if self._numeric else self.name

    @property
    def tail(self) -> tuple[int, ...]:
        """NumPy shape of one element: () scalar, (n,) vector, (rows, columns) matrix."""
        if self._numeric is None:
            return ()
        if self._numeric["n"]:
            return (int(self._numeric["n"]),)
        columns = int(self._numeric["c"])
        return (int(self._numeric["r"] or columns), columns)

    @property
    def element(self) -> Type:
        """The type without its array sizes."""
        return Type(self.name, (), self.fields)

    @property
    def is_sampler(self) -> bool:
        return self.name in SAMPLERS

    @property
    def is_image(self) -> bool:
        return "image" in self.name and self.name in TYPES

    def __str__(self) -> str:
        return self.name + "".join(f"[{n}]" for n in self.dims)


@dataclass(frozen=True)
class Parameter:
    """One parameter: `direction` is in, out or inout."""

    type: Type
    name: str
    direction: str = "in"

    def __str__(self) -> str:
        return f"{'' if self.direction == 'in' else self.direction + ' '}{self.type} {self.name}".rstrip()


@dataclass(frozen=True)
class Signature:
    """A function definition: what it takes and returns, and the offsets of the whole and of its body."""

    name: str
    returns: Type
    params: tuple[Parameter, ...]
    start: int
    body: int
    end: int

    def __str__(self) -> str:
        return f"{self.returns} {self.name}({', '.join(map(str, self.params))})"

    @cached_property
    def key(self) -> str:
        """name(type, type): what tells overloads apart."""
        return f"{self.name}({', '.join(str(p.type) for p in self.params)})"


@dataclass(frozen=True)
class Variable:
    """A global: its qualifiers, type, and the offsets of its declaration, its type and its initialiser."""

    name: str
    type: Type
    qualifiers: tuple[str, ...]
    start: int
    type_start: int
    end: int
    value: tuple[int, int] | None


@dataclass
class Declarations:
    """All that one text declares; `skipped` says what the parser did not understand, and where."""

    active: Active
    structs: dict[str, Type] = field(default_factory=dict)
    functions: list[Signature] = field(default_factory=list)
    variables: dict[str, Variable] = field(default_factory=dict)
    skipped: list[str] = field(default_factory=list)
    _bodies: dict[int, Node] = field(default_factory=dict)

    def body(self, signature: Signature) -> Node:
        """The tree of a function's body; ShaderError where it is no GLSL that this parser knows."""
        if signature.start not in self._bodies:
            self._bodies[signature.start] = parse_body(
                self.active.text, signature.body, signature.end, frozenset(self.structs)
            )
        return self._bodies[signature.start]

    @cached_property
    def _words(self) -> dict[int, frozenset[str]]:
        """The names that each body mentions, with those that macros bring in."""
        told: dict[int, frozenset[str]] = {}
        for f in self.functions:
            seen: set[str] = set()
            left = set(re.findall(r"[A-Za-z_]\w*", self.active.text[f.body : f.end]))
            while left:
                seen |= left
                macros = (self.active.macros[word] for word in left if word in self.active.macros)
                left = {word for m in macros for word in re.findall(r"[A-Za-z_]\w*", m.body)} - seen
            told[f.start] = frozenset(seen)
        return told

    def words(self, signature: Signature) -> frozenset[str]:
        """The names in the function's body, macros expanded."""
        return self._words[signature.start]

    def reached(self, signature: Signature) -> list[Signature]:
        """The function and all that it calls, directly or not (by name: overloads all count)."""
        found, left = [signature], [signature]
        while left:
            words = self.words(left.pop())
            for f in self.functions:
                if f.name in words and f not in found:
                    found.append(f)
                    left.append(f)
        return found


def declarations(text: str, predefined: Mapping[str, str] | None = None) -> Declarations:
    """Read the declarations of a resolved GLSL text, as the driver's preprocessor leaves it."""
    seen = active(text, predefined)
    found = Declarations(seen)
    tokens = _expanded(seen, found)
    reader = _Reader(seen.text, tokens, found)
    while reader.now.kind != "end":
        at = reader.at
        try:
            reader.item()
        except ShaderError as error:
            found.skipped.append(str(error))
            reader.recover(at)
    return found


def _expanded(seen: Active, found: Declarations) -> list[Token]:
    """Tokens of the text; outside of braces, macros without parentheses are put in (keeping their offsets)."""
    out: list[Token] = []
    depth, start = 0, 0
    text = seen.text
    while True:
        try:
            tokens = tokenize(text)
            break
        except ShaderError as error:  # an odd character: blank it, and say so
            found.skipped.append(str(error))
            start = _offending(text, start)
            text = text[:start] + " " + text[start + 1 :]
    for token in tokens:
        depth += (token.text == "{") - (token.text == "}")
        out += _macro_tokens(token, seen.macros, ()) if depth == 0 and token.kind == "name" else [token]
    return out


def _offending(text: str, start: int) -> int:
    for i in range(start, len(text)):
        if not text[i].isspace() and not re.match(r"[\w+\-*/%<>=!&|^~?:;,.(){}\[\]]", text[i]):
            return i
    return len(text) - 1


def _macro_tokens(token: Token, macros: Mapping[str, Macro], seen: tuple[str, ...]) -> list[Token]:
    macro = macros.get(token.text)
    if macro is None or macro.params is not None or token.text in seen:
        return [token]
    made: list[Token] = []
    for t in tokenize(macro.body)[:-1]:
        placed = Token(t.kind, t.text, token.start, token.end)
        made += _macro_tokens(placed, macros, (*seen, token.text)) if t.kind == "name" else [placed]
    return made


class _Reader(Parser):
    """Top-level declarations, in the order of the text."""

    def __init__(self, text: str, tokens: list[Token], found: Declarations) -> None:
        super().__init__(text, tokens)
        self.found = found

    def item(self) -> None:
        """One top-level declaration."""
        start = self.now.start
        if self.accept(";"):
            return
        if self.accept("precision"):
            while not self.accept(";"):
                self.take()
            return
        words = self.qualifiers()
        if self.accept(";"):  # layout(local_size_x = 64) in;
            return
        if self.now.kind == "name" and self.peek().text == "{" and self.now.text != "struct":
            self.interface_block()
            return
        type_start = self.now.start
        kind = self.type()
        if self.accept(";"):
            return
        name = self.name()
        if self.now.text == "(":
            self.function(kind, name, start)
        else:
            self.globals(kind, name, words, (start, type_start))

    def name(self) -> str:
        if self.now.kind != "name":
            self.expect("a name")
        return self.take().text

    def qualifiers(self) -> tuple[str, ...]:
        words: list[str] = []
        while True:
            if self.now.text in QUALIFIERS:
                words.append(self.take().text)
            elif self.now.text == "layout":
                self.take()
                self.expect("(")
                while not self.accept(")"):
                    if self.take().kind == "end":
                        self.expect(")")
            else:
                return tuple(words)

    def interface_block(self) -> None:
        self.take()
        self.skip_braces()
        while not self.accept(";"):
            if self.take().kind == "end":
                self.expect(";")

    def type(self) -> Type:
        """A type with its array sizes; a struct is remembered."""
        if self.accept("struct"):
            name = self.name() if self.now.text != "{" else ""
            made = Type(name, (), self.fields())
            self.found.structs[name] = made
            self.types |= {name}
        else:
            word = self.name()
            if word not in self.types:
                raise self.error(f"unknown type {word!r}")
            made = self.found.structs.get(word, Type(word))
        return self.sized(made, self.sizes())

    def error(self, said: str) -> ShaderError:
        return ShaderError(f"line {line_of(self.text, self.tokens[max(self.at - 1, 0)].start)}: {said}")

    def fields(self) -> tuple[tuple[str, Type], ...]:
        self.expect("{")
        made: list[tuple[str, Type]] = []
        while not self.accept("}"):
            self.qualifiers()
            kind = self.type()
            while True:
                name = self.name()
                made.append((name, self.sized(kind, self.sizes())))
                if not self.accept(","):
                    break
            self.expect(";")
        return tuple(made)

    def sizes(self) -> tuple[int, ...]:
        found: list[int] = []
        while self.accept("["):
            if self.accept("]"):
                found.append(0)  # unsized: allowed for globals only
                continue
            node = self.expression()
            found.append(evaluate(node, self.constant))
            self.expect("]")
        return tuple(found)

    def constant(self, name: str) -> int:
        """A global const int used as an array size."""
        known = self.found.variables.get(name)
        if known is None or known.value is None or "const" not in known.qualifiers:
            raise self.error(f"{name!r} is no constant integer")
        return evaluate(Parser(self.text, tokenize(self.text, *known.value)).expression(), self.constant)

    @staticmethod
    def sized(kind: Type, sizes: tuple[int, ...]) -> Type:
        return Type(kind.name, (*sizes, *kind.dims), kind.fields)

    def function(self, returns: Type, name: str, start: int) -> None:
        self.expect("(")
        params = tuple(self.parameters())
        self.expect(")")
        if self.accept(";"):
            return
        body = self.now.start
        end = self.skip_braces()
        self.found.functions.append(Signature(name, returns, params, start, body, end))

    def parameters(self) -> Iterator[Parameter]:
        if self.now.text == "void" and self.peek().text == ")":
            self.take()
        while self.now.text != ")":
            words = self.qualifiers()
            kind = self.type()
            name = self.take().text if self.now.kind == "name" else ""
            direction = next((w for w in words if w in ("out", "inout")), "in")
            yield Parameter(self.sized(kind, self.sizes()), name, direction)
            if not self.accept(","):
                break

    def globals(self, kind: Type, name: str, words: tuple[str, ...], starts: tuple[int, int]) -> None:
        while True:
            whole = self.sized(kind, self.sizes())
            value = None
            if self.accept("="):
                node = self.assignment()
                value = (node.start, node.end)
            known = Variable(name, whole, words, *starts, self.tokens[self.at - 1].end, value)
            self.found.variables[name] = known
            if not self.accept(","):
                break
            name = self.name()
        self.expect(";")

    def recover(self, at: int) -> None:
        """After something not understood: go on past its `;`, or past its balanced braces."""
        self.at = at
        while self.now.kind != "end" and self.now.text not in (";", "{"):
            self.take()
        if self.now.text == "{":
            try:
                self.skip_braces()
            except ShaderError:
                self.at = len(self.tokens) - 1
        else:
            self.take()
