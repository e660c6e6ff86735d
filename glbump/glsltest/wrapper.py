"""The GLSL that calls one function for every row: three ways, the same words in and out.

Inputs are one block of 32-bit words: the number of rows, a token, then (offset, stride) of each column, then the
columns. A stride of 0 is a value that all rows share. Outputs are words too, so that a NaN's bits, a denormal
and a negative zero come back as the function left them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

from glbump.gl.source import Source
from glbump.glsltest.columns import Column, columns_of, reading, writing
from glbump.glsltest.declarations import Signature, Type

STAGES = {"compute": "compute", "feedback": "vertex", "fragment": "fragment"}
BACKENDS = tuple(STAGES)
LOCAL_SIZE = 64
DATA_WIDTH = 1024  # texels in a row of the data texture: what every OpenGL 3.3 driver has
GROUPS = 8  # uvec4 that one draw gives back for each row: what every driver has as draw buffers
RETURN = -1
HEADER = 2  # words before the columns' offsets: rows, token

# Before the caller: where a word is read, where one is put. Then main.
_DATA_TEXTURE = """\
uniform highp usampler2D {p}data;
uint {p}word(int {p}i) {{ return texelFetch({p}data, ivec2({p}i % {width}, {p}i / {width}), 0)[0]; }}
uniform int {p}pass;
uint {p}out[{padded}];
void {p}put(int {p}i, uint {p}v) {{ {p}out[{p}i] = {p}v; }}
int {p}start(int {p}before, int {p}words, int {p}row) {{ return {p}before; }}"""
_BEFORE = {
    "compute": """\
layout(local_size_x = {local}) in;
layout(std430, binding = 0) restrict readonly buffer {p}In {{ uint {p}data[]; }};
layout(std430, binding = 1) restrict writeonly buffer {p}Out {{ uint {p}out[]; }};
uint {p}word(int {p}i) {{ return {p}data[{p}i]; }}
void {p}put(int {p}i, uint {p}v) {{ {p}out[{p}i] = {p}v; }}
int {p}start(int {p}before, int {p}words, int {p}row) {{ return {p}before * int({p}data[0]) + {p}row * {p}words; }}""",
    "feedback": _DATA_TEXTURE,
    "fragment": _DATA_TEXTURE,
}
_MAIN = {
    "compute": """\
void main() {{
    int {p}row = int(gl_GlobalInvocationID[0]);
    int {p}rows = int({p}data[0]);
    if ({p}row < {p}rows) {p}call({p}row);
    if ({p}row == {p}rows - 1) {p}put({p}rows * {words}, {p}data[1]);
}}""",
    "feedback": """\
{outputs}
void main() {{
    {p}call(gl_VertexID);
    {stores}
    gl_Position = vec4(0.0);
}}""",
    # Rows 4k .. 4k+3 are one 2x2 quad: left and right below, left and right above. Pixels past the last row
    # repeat it, so that no derivative meets garbage.
    "fragment": """\
uniform int {p}width;
{outputs}
void main() {{
    ivec2 {p}at = ivec2(int(gl_FragCoord[0]), int(gl_FragCoord[1]));
    int {p}quad = ({p}at[1] / 2) * ({p}width / 2) + {p}at[0] / 2;
    {p}call(min(4 * {p}quad + 2 * ({p}at[1] % 2) + {p}at[0] % 2, int({p}word(0)) - 1));
    {stores}
}}""",
}
SCREEN_TRIANGLE = """\
void main() {
    gl_Position = vec4(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0, 0.0, 1.0);
}"""


@dataclass(frozen=True)
class Plan:
    """What a call moves. inputs and samplers name parameters by index, outputs too (RETURN for the returned value).

    extra: words that come back beside the function's own (variable in GLSL, column). setup: GLSL that runs first.
    """

    signature: Signature
    inputs: tuple[tuple[int, tuple[Column, ...]], ...]
    outputs: tuple[tuple[int, Type, tuple[Column, ...]], ...]
    samplers: tuple[int, ...]
    extra: tuple[tuple[str, Column], ...] = ()
    setup: str = ""

    @cached_property
    def in_columns(self) -> tuple[Column, ...]:
        return tuple(column for _, columns in self.inputs for column in columns)

    @cached_property
    def in_names(self) -> tuple[str, ...]:
        """What each input column is called: parameter.field.field"""
        names = [p.name or f"argument {i + 1}" for i, p in enumerate(self.signature.params)]
        return tuple(".".join([names[i], *c.path]) for i, columns in self.inputs for c in columns)

    @cached_property
    def out_columns(self) -> tuple[Column, ...]:
        """Columns of all outputs, then of `extra`."""
        return (*(c for _, _, columns in self.outputs for c in columns), *(c for _, c in self.extra))

    @cached_property
    def out_words(self) -> int:
        """Words that one row gives back."""
        return sum(column.words for column in self.out_columns)

    @cached_property
    def groups(self) -> int:
        """uvec4 that hold one row's words, as many as a draw gives back at most."""
        return min(GROUPS, max(1, -(-self.out_words // 4)))

    @cached_property
    def passes(self) -> int:
        """Draws that one call takes."""
        return max(1, -(-self.out_words // (4 * GROUPS)))


def plan_call(signature: Signature) -> Plan:
    """The plan of a call; ShaderError where a parameter cannot come from NumPy."""
    inputs, samplers = [], []
    outputs: list[tuple[int, Type, tuple[Column, ...]]] = []
    if signature.returns.name != "void":
        columns = columns_of(signature.returns, f"{signature}: the returned value")
        outputs.append((RETURN, signature.returns, tuple(columns)))
    for i, p in enumerate(signature.params):
        if p.type.is_sampler and not p.type.dims:
            samplers.append(i)
            continue
        columns = columns_of(p.type, f"{signature}: {p.name or f'argument {i + 1}'}")
        if p.direction != "out":
            inputs.append((i, tuple(columns)))
        if p.direction != "in":
            outputs.append((i, p.type, tuple(columns)))
    return Plan(signature, tuple(inputs), tuple(outputs), tuple(samplers))


def wrapped(source: Source, plan: Plan, backend: str, prefix: str) -> Source:
    """`source` with a main that calls the function; `prefix` begins every name this adds."""
    groups = range(plan.groups)
    words = {
        "p": prefix,
        "local": LOCAL_SIZE,
        "width": DATA_WIDTH,
        "words": plan.out_words,
        "padded": 4 * plan.groups * plan.passes,
        "outputs": "\n".join(_output(g, prefix, backend) for g in groups),
        "stores": "\n    ".join(_store(g, plan, prefix) for g in groups),
    }
    parts = [_BEFORE[backend].format(**words), *_caller(plan, prefix), _MAIN[backend].format(**words)]
    return extended(source, "\n".join(parts), STAGES[backend])


def _output(group: int, p: str, backend: str) -> str:
    where = "flat" if backend == "feedback" else f"layout(location = {group})"
    return f"{where} out highp uvec4 {p}o{group};"


def _store(group: int, plan: Plan, p: str) -> str:
    base = f"{4 * plan.groups} * {p}pass + " if plan.passes > 1 else ""
    return f"{p}o{group} = uvec4({', '.join(f'{p}out[{base}{4 * group + k}]' for k in range(4))});"


def extended(source: Source, footer: str, stage: str) -> Source:
    """`source` with generated lines after it."""
    made = tuple(("<glbump>", i + 1) for i in range(footer.count("\n") + 1))
    return replace(source, text=source.text + footer + "\n", lines=source.lines + made, stage=stage)


def _declared(kind: Type, name: str) -> str:
    return f"{kind.name} {name}{''.join(f'[{n}]' for n in kind.dims)}"


def _caller(plan: Plan, p: str) -> list[str]:
    """GLSL of call(row): read the arguments, call, put the results."""
    params = plan.signature.params
    samplers = {i: f"{p}s{k}" for k, i in enumerate(plan.samplers)}
    variables = [samplers.get(i, f"{p}a{i}") for i in range(len(params))]
    lines = [f"uniform highp {params[i].type.name} {name};" for i, name in samplers.items()]
    lines.append(f"void {p}call(int {p}row) {{ {plan.setup}")
    lines += [f"    {_declared(q.type, variables[i])};" for i, q in enumerate(params) if i not in samplers]
    number = 0
    for i, columns in plan.inputs:
        for column in columns:
            at, head = f"{p}at{number}", HEADER + 2 * number
            lines.append(f"    int {at} = int({p}word({head})) + int({p}word({head + 1})) * {p}row;")
            lines.append("    " + reading(column, p, variables[i], at))
            number += 1
    call = f"{plan.signature.name}({', '.join(variables)})"
    returns = plan.signature.returns
    lines.append(f"    {call};" if returns.name == "void" else f"    {_declared(returns, p + 'r')} = {call};")
    results = [(f"{p}r" if i == RETURN else variables[i], c) for i, _, columns in plan.outputs for c in columns]
    start = 0
    for variable, column in [*results, *plan.extra]:
        lines.append("    " + writing(column, p, variable, f"{p}start({start}, {column.words}, {p}row)"))
        start += column.words
    return [*lines, "}"]
