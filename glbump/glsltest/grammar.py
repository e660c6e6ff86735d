"""A parser for GLSL: signatures, structs and globals at once, function bodies when asked.

Written for the task: every node knows its offsets in the text, so that coverage and seeded faults can be put
in at the right character, and a macro that is no GLSL inside a body costs that body only. Its input is what
`preprocess.active` leaves: no comments, no directives. GLSL 4.60, section 9, is the grammar; GLSL is C without
pointers, and what differs from C (array types, precision, layout, `const in`) is in the declarations.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

from glbump.errors import ShaderError

QUALIFIERS = frozenset(
    [
        "const",
        "in",
        "out",
        "inout",
        "highp",
        "mediump",
        "lowp",
        "flat",
        "smooth",
        "noperspective",
        "centroid",
        "sample",
        "patch",
        "uniform",
        "varying",
        "attribute",
        "invariant",
        "precise",
        "buffer",
        "shared",
        "coherent",
        "volatile",
        "restrict",
        "readonly",
        "writeonly",
    ]
)
_SCALARS = "void bool int uint float double"
_VECTORS = " ".join(f"{p}vec{n}" for p in ("", "b", "i", "u", "d") for n in (2, 3, 4))
_MATRICES = " ".join(
    f"{p}mat{n}"
    for p in ("", "d")
    for n in ["2", "3", "4", "2x2", "2x3", "2x4", "3x2", "3x3", "3x4", "4x2", "4x3", "4x4"]
)
_SHAPES = ["1D", "2D", "3D", "Cube", "2DRect", "1DArray", "2DArray", "CubeArray", "Buffer", "2DMS", "2DMSArray"]
_SHADOWS = ["1DShadow", "2DShadow", "CubeShadow", "2DRectShadow", "1DArrayShadow", "2DArrayShadow", "CubeArrayShadow"]
SAMPLERS = frozenset([f"{p}sampler{s}" for p in ("", "i", "u") for s in _SHAPES] + [f"sampler{s}" for s in _SHADOWS])
_IMAGES = frozenset(f"{p}image{s}" for p in ("", "i", "u") for s in _SHAPES)
TYPES = frozenset(f"{_SCALARS} {_VECTORS} {_MATRICES}".split()) | SAMPLERS | _IMAGES

_TOKEN = re.compile(
    r"(?P<number>(?:\d+\.\d*|\.\d+|\d+(?=[eE]))(?:[eE][+-]?\d+)?(?:lf|LF|[fF])?|0[xX][0-9a-fA-F]+[uU]?|\d+[uU]?[fF]?)"
    r"|(?P<name>[A-Za-z_]\w*)"
    r"|(?P<op><<=|>>=|\+\+|--|<=|>=|==|!=|&&|\|\||\^\^|<<|>>|[-+*/%&|^]=|[-+*/%<>=!~&|^?:;,.(){}\[\]])"
)
_SPACE = re.compile(r"\s*")
_BINARY = {
    op: level
    for level, ops in enumerate(["||", "^^", "&&", "|", "^", "&", "==,!=", "<,>,<=,>=", "<<,>>", "+,-", "*,/,%"])
    for op in ops.split(",")
}
_ASSIGN = frozenset(["=", "+=", "-=", "*=", "/=", "%=", "<<=", ">>=", "&=", "|=", "^="])


@dataclass(frozen=True, slots=True)
class Token:
    """One word of GLSL; `kind` is number, name, op or end."""

    kind: str
    text: str
    start: int
    end: int


@dataclass(slots=True)
class Node:
    """A piece of a function body: its kind, where it stands, its parts, and its word (operator, name, number)."""

    kind: str
    start: int
    end: int
    kids: list[Node] = field(default_factory=list)
    word: str = ""

    def walk(self) -> Iterator[Node]:
        """This node and all below it, in the order of the text."""
        yield self
        for kid in self.kids:
            yield from kid.walk()


def tokenize(text: str, start: int = 0, end: int | None = None) -> list[Token]:
    """The tokens of text[start:end], with an end token after them."""
    stop = len(text) if end is None else end
    found: list[Token] = []
    at = start
    while True:
        gap = _SPACE.match(text, at, stop)
        at = gap.end() if gap else at
        if at >= stop:
            break
        match = _TOKEN.match(text, at, stop)
        if match is None:
            raise ShaderError(f"line {line_of(text, at)}: {text[at]!r} is no GLSL")
        found.append(Token(str(match.lastgroup), match[0], at, match.end()))
        at = match.end()
    found.append(Token("end", "", stop, stop))
    return found


def line_of(text: str, offset: int) -> int:
    """The 1-based line that `offset` stands on."""
    return text.count("\n", 0, offset) + 1


def parse_expression(text: str) -> Node:
    """The tree of one expression."""
    parser = Parser(text, tokenize(text))
    node = parser.expression()
    parser.expect("end")
    return node


def parse_body(text: str, start: int, end: int, types: frozenset[str] = frozenset()) -> Node:
    """The block at text[start:end], braces included; `types` are the names of structs."""
    return Parser(text, tokenize(text, start, end), types).block()


class Parser:
    """Recursive descent over tokens; raises ShaderError where the text is no GLSL."""

    def __init__(self, text: str, tokens: list[Token], types: frozenset[str] = frozenset()) -> None:
        self.text, self.tokens, self.types, self.at = text, tokens, TYPES | types, 0

    @property
    def now(self) -> Token:
        return self.tokens[self.at]

    def peek(self, ahead: int = 1) -> Token:
        return self.tokens[min(self.at + ahead, len(self.tokens) - 1)]

    def take(self) -> Token:
        token = self.now
        self.at = min(self.at + 1, len(self.tokens) - 1)
        return token

    def accept(self, text: str) -> Token | None:
        return self.take() if self.now.text == text and self.now.kind != "end" else None

    def expect(self, text: str) -> Token:
        if self.now.text == text or (text == "end" and self.now.kind == "end"):
            return self.take()
        got = repr(self.now.text) if self.now.kind != "end" else "the end"
        raise ShaderError(f"line {line_of(self.text, self.now.start)}: expected {text!r}, got {got}")

    # ---- expressions

    def expression(self) -> Node:
        first = self.assignment()
        while self.accept(","):
            second = self.assignment()
            first = Node("comma", first.start, second.end, [first, second], ",")
        return first

    def assignment(self) -> Node:
        left = self.ternary()
        if self.now.text in _ASSIGN:
            op = self.take().text
            right = self.assignment()
            return Node("assign", left.start, right.end, [left, right], op)
        return left

    def ternary(self) -> Node:
        condition = self.binary(0)
        if not self.accept("?"):
            return condition
        yes = self.expression()
        self.expect(":")
        no = self.assignment()
        return Node("ternary", condition.start, no.end, [condition, yes, no], "?")

    def binary(self, least: int) -> Node:
        left = self.unary()
        while (level := _BINARY.get(self.now.text, -1)) >= least:
            op = self.take().text
            right = self.binary(level + 1)
            left = Node("binary", left.start, right.end, [left, right], op)
        return left

    def unary(self) -> Node:
        if self.now.text in ("+", "-", "!", "~", "++", "--"):
            op = self.take()
            operand = self.unary()
            return Node("unary", op.start, operand.end, [operand], op.text)
        return self.postfix()

    def postfix(self) -> Node:
        node = self.primary()
        while True:
            if self.accept("."):
                name = self.take()
                node = Node("member", node.start, name.end, [node], name.text)
            elif self.accept("["):
                kids = [node] if self.now.text == "]" else [node, self.expression()]
                node = Node("index", node.start, self.expect("]").end, kids)
            elif self.now.text == "(" and node.kind in ("name", "index", "member"):
                self.take()
                node = self.arguments(node)
            elif self.now.text in ("++", "--"):
                op = self.take()
                node = Node("postfix", node.start, op.end, [node], op.text)
            else:
                return node

    def arguments(self, callee: Node) -> Node:
        args: list[Node] = []
        if self.now.text == "void" and self.peek().text == ")":
            self.take()
        while self.now.text != ")":
            args.append(self.assignment())
            if not self.accept(","):
                break
        word = callee.word if callee.kind == "name" else self.text[callee.start : callee.end]
        return Node("call", callee.start, self.expect(")").end, args, word)

    def primary(self) -> Node:
        token = self.take()
        if token.kind in ("number", "name"):
            return Node(token.kind, token.start, token.end, [], token.text)
        if token.text == "(":
            inner = self.expression()
            return Node("group", token.start, self.expect(")").end, [inner])
        if token.text == "{":  # an initialiser list (GLSL 4.20)
            kids = [self.assignment()]
            while self.accept(",") and self.now.text != "}":
                kids.append(self.assignment())
            return Node("list", token.start, self.expect("}").end, kids)
        got = repr(token.text) if token.kind != "end" else "the end"
        raise ShaderError(f"line {line_of(self.text, token.start)}: expected an expression, got {got}")

    # ---- statements

    def block(self) -> Node:
        start = self.expect("{").start
        kids: list[Node] = []
        while self.now.text != "}":
            kids.append(self.statement())
        return Node("block", start, self.expect("}").end, kids)

    def statement(self) -> Node:
        start, word = self.now.start, self.now.text
        if word == "{":
            return self.block()
        special = getattr(self, f"_{word}", None) if word in _STATEMENTS else None
        if special is not None:
            self.take()
            node: Node = special(start)
            return node
        if self.is_declaration():
            return self.declaration()
        if self.accept(";"):
            return Node("empty", start, self.tokens[self.at - 1].end)
        inner = self.expression()
        return Node("expression", start, self.expect(";").end, [inner])

    def _if(self, start: int) -> Node:
        kids = [self.condition(), self.statement()]
        if self.accept("else"):
            kids.append(self.statement())
        return Node("if", start, kids[-1].end, kids)

    def _while(self, start: int) -> Node:
        kids = [self.condition(), self.statement()]
        return Node("while", start, kids[-1].end, kids)

    def _do(self, start: int) -> Node:
        body = self.statement()
        self.expect("while")
        condition = self.condition()
        return Node("do", start, self.expect(";").end, [body, condition])

    def _for(self, start: int) -> Node:
        self.expect("(")
        first = self.statement()
        empty = Node("empty", self.now.start, self.now.start)
        condition = empty if self.now.text == ";" else self.expression()
        self.expect(";")
        step = Node("empty", self.now.start, self.now.start) if self.now.text == ")" else self.expression()
        self.expect(")")
        body = self.statement()
        return Node("for", start, body.end, [first, condition, step, body])

    def _switch(self, start: int) -> Node:
        condition = self.condition()
        body = self.block()
        return Node("switch", start, body.end, [condition, body])

    def _case(self, start: int) -> Node:
        value = self.expression()
        return Node("case", start, self.expect(":").end, [value], "case")

    def _default(self, start: int) -> Node:
        return Node("case", start, self.expect(":").end, [], "default")

    def _return(self, start: int) -> Node:
        kids = [] if self.now.text == ";" else [self.expression()]
        return Node("return", start, self.expect(";").end, kids)

    def _jump(self, start: int) -> Node:
        word = self.tokens[self.at - 1].text
        return Node("jump", start, self.expect(";").end, [], word)

    _break = _continue = _discard = _jump

    def condition(self) -> Node:
        start = self.expect("(").start
        inner = self.expression()
        return Node("group", start, self.expect(")").end, [inner])

    def is_declaration(self) -> bool:
        token = self.now
        if token.kind != "name":
            return False
        if token.text in QUALIFIERS or token.text in ("struct", "layout", "precision"):
            return True
        ahead = 1
        while self.peek(ahead).text == "[":
            while self.peek(ahead).text not in ("]", ";") and self.peek(ahead).kind != "end":
                ahead += 1
            ahead += 1
        return self.peek(ahead).kind == "name"

    def declaration(self) -> Node:
        """A local declaration; its kids are the initialisers, its word "const" where they must stay constant."""
        start, const = self.now.start, False
        while self.now.text in QUALIFIERS:
            const |= self.take().text == "const"
        self.take()
        kids: list[Node] = []
        while self.now.text != ";":
            if self.now.text == "{":  # the body of a local struct
                self.skip_braces()
            elif self.accept("="):
                kids.append(self.assignment())
            elif self.accept("["):
                if self.now.text != "]":
                    self.expression()
                self.expect("]")
            elif self.now.kind == "name" or self.now.text == ",":
                self.take()
            else:
                self.expect(";")
        return Node("declaration", start, self.expect(";").end, kids, "const" if const else "")

    def skip_braces(self) -> int:
        """Take a balanced { ... }; returns the offset after it."""
        depth = 0
        while True:
            token = self.take()
            depth += (token.text == "{") - (token.text == "}")
            if token.kind == "end":
                raise ShaderError(f"line {line_of(self.text, token.start)}: a {{ is not closed")
            if depth == 0:
                return token.end


_STATEMENTS = frozenset(
    ["if", "while", "do", "for", "switch", "case", "default", "return", "break", "continue", "discard"]
)


def evaluate(node: Node, value_of: Callable[[str], int]) -> int:
    """The value of a constant integer expression; `value_of` gives that of a name."""
    if node.kind == "group":
        return evaluate(node.kids[0], value_of)
    if node.kind == "number":
        text = node.word.rstrip("uUfF") if not node.word.lower().startswith("0x") else node.word.rstrip("uU")
        return int(float(text)) if "." in text else int(text, 8 if re.fullmatch(r"0\d+", text) else 0)
    if node.kind == "name":
        return int(node.word == "true") if node.word in ("true", "false") else value_of(node.word)
    if node.kind == "call" and node.word in ("int", "uint") and len(node.kids) == 1:
        return evaluate(node.kids[0], value_of)
    values = [evaluate(kid, value_of) for kid in node.kids]
    if node.kind == "ternary":
        return values[1] if values[0] else values[2]
    if node.kind == "unary" and node.word in _UNARY_VALUE:
        return _UNARY_VALUE[node.word](values[0])
    if node.kind == "binary":
        return int(_BINARY_VALUE[node.word](*values))
    raise ShaderError(f"not a constant integer: {node.kind} {node.word}".rstrip())


_UNARY_VALUE: dict[str, Callable[[int], int]] = {
    "-": lambda a: -a,
    "+": lambda a: a,
    "!": lambda a: int(not a),
    "~": lambda a: ~a,
}
_BINARY_VALUE: dict[str, Callable[[int, int], int]] = {
    "||": lambda a, b: bool(a or b),
    "&&": lambda a, b: bool(a and b),
    "^^": lambda a, b: bool(a) != bool(b),
    "|": lambda a, b: a | b,
    "^": lambda a, b: a ^ b,
    "&": lambda a, b: a & b,
    "==": lambda a, b: a == b,
    "!=": lambda a, b: a != b,
    "<": lambda a, b: a < b,
    ">": lambda a, b: a > b,
    "<=": lambda a, b: a <= b,
    ">=": lambda a, b: a >= b,
    "<<": lambda a, b: a << b,
    ">>": lambda a, b: a >> b,
    "+": lambda a, b: a + b,
    "-": lambda a, b: a - b,
    "*": lambda a, b: a * b,
    "/": lambda a, b: int(a / b),  # GLSL truncates
    "%": lambda a, b: a - b * int(a / b),
}
