"""C code of CasADi's functions that computes several segments at once (lanes.h), where CasADi's own computes one."""

from __future__ import annotations

from dataclasses import dataclass, field

import casadi as ca

ARITHMETIC = {
    ca.OP_ASSIGN: "{0}",
    ca.OP_ADD: "{0} + {1}",
    ca.OP_SUB: "{0} - {1}",
    ca.OP_MUL: "{0} * {1}",
    ca.OP_DIV: "{0} / {1}",
    ca.OP_NEG: "-{0}",
    ca.OP_SQ: "{0} * {0}",
    ca.OP_TWICE: "{0} + {0}",
    ca.OP_INV: "1.0 / {0}",
}
AT_ONCE = {
    getattr(ca, f"OP_{name.upper()}"): name
    for name in ("fabs", "fmin", "fmax", "sign", "sqrt", "exp", "expm1", "log", "tanh")
}
ONE_BY_ONE = {
    getattr(ca, f"OP_{name.upper()}"): name
    for name in (
        *("log1p", "sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh"),
        *("asinh", "acosh", "atanh", "erf", "floor", "ceil", "pow", "fmod", "remainder", "atan2", "hypot", "copysign"),
    )
} | {ca.OP_CONSTPOW: "pow"}
COMPARISONS = {ca.OP_LT: "<", ca.OP_LE: "<=", ca.OP_EQ: "==", ca.OP_NE: "!="}
CONNECTIVES = {ca.OP_AND: "&", ca.OP_OR: "|"}


@dataclass
class _Writer:
    """Code of one function; every instruction defines a variable of its own, a number `v` or a truth `m`."""

    lines: list[str] = field(default_factory=list[str])
    held: dict[int, str] = field(default_factory=dict[int, str])
    """By register of CasADi's: the variable that it holds."""

    def number(self, register: int) -> str:
        """Return an expression for a register as a number."""
        name = self.held[register]
        return f"number({name})" if name[0] == "m" else name

    def truth(self, register: int) -> str:
        """Return an expression for whether a register is not 0."""
        name = self.held[register]
        return name if name[0] == "m" else f"(mask)({name} != 0.0)"

    def set(self, register: int, kind: str, value: str) -> None:
        """Define the next variable."""
        name = f"{kind}{len(self.lines)}"
        self.lines.append(f"const {'mask' if kind == 'm' else 'lanes'} {name} = {value};")
        self.held[register] = name

    def compute(self, operation: int, register: int, inputs: list[int]) -> None:
        """Add an operation; raises RuntimeError where it has no code."""
        if operation in COMPARISONS:
            one, other = map(self.number, inputs)
            self.set(register, "m", f"(mask)({one} {COMPARISONS[operation]} {other})")
        elif operation in CONNECTIVES:
            one, other = map(self.truth, inputs)
            self.set(register, "m", f"{one} {CONNECTIVES[operation]} {other}")
        elif operation == ca.OP_NOT:
            self.set(register, "m", f"~{self.truth(inputs[0])}")
        elif operation == ca.OP_IF_ELSE_ZERO:
            self.set(register, "v", f"pick({self.truth(inputs[0])}, {self.number(inputs[1])})")
        else:
            self.set(register, "v", _numeric(operation, [self.number(item) for item in inputs]))


def _numeric(operation: int, inputs: list[str]) -> str:
    if operation in ARITHMETIC:
        return ARITHMETIC[operation].format(*inputs)
    if operation in AT_ONCE:
        return f"lanes_{AT_ONCE[operation]}({', '.join(inputs)})"
    if operation in ONE_BY_ONE:
        return f"lanes_{ONE_BY_ONE[operation]}({', '.join(inputs)}, live)"
    raise RuntimeError(f"CasADi's operation {operation} has no code for lanes")


def lane_code(function: ca.Function) -> str:
    """Return the C code of a function: `static void NAME(arg, res, live)`, of vectors or the nonzeros of matrices.

    Raises RuntimeError, as CasADi's own generator does, for an operation that has no code; such models are interpreted.
    """
    writer = _Writer()
    for k in range(function.n_instructions()):
        operation, inputs = function.instruction_id(k), function.instruction_input(k)
        outputs = function.instruction_output(k)
        if operation == ca.OP_CONST:
            writer.set(outputs[0], "v", f"splat({_literal(function.instruction_constant(k))})")
        elif operation == ca.OP_INPUT:
            writer.set(outputs[0], "v", f"arg[{inputs[0]}][{inputs[1]}]")
        elif operation == ca.OP_OUTPUT:
            writer.lines.append(f"res[{outputs[0]}][{outputs[1]}] = {writer.number(inputs[0])};")
        else:
            writer.compute(operation, outputs[0], inputs)
    head = f"static void {function.name()}(const lanes *const *arg, lanes *const *res, int live) {{"
    return "\n".join((head, *writer.lines, "(void)live;", "}", ""))


def chain_code(name: str, derivative: ca.Function) -> str:
    """Return the C code of the chain rule, out = by_state s + [0, by_active], of a map's derivative (maps.py).

    `static void NAME_s(by_state, by_active, s, out, columns)`: the nonzeros of both Jacobians, then matrices of that
    many columns, s with NX and out with the rows of the map, column major. NX, which is defined elsewhere, is how many
    there are where the active parameters are left out.
    """
    by_state, by_active = derivative.sparsity_out(1), derivative.sparsity_out(2)
    count, terms = by_state.size1(), [list[str]() for _ in range(by_state.size1())]
    for k, (row, column) in enumerate(zip(*by_state.get_triplet(), strict=True)):
        terms[row].append(f"by_state[{k}] * v[{column}]")
    sums = [f"o[{row}] = {' + '.join(found) or 'splat(0.0)'};" for row, found in enumerate(terms)]
    added = [
        f"out[(NX + {column}) * {count} + {row}] += by_active[{k}];"
        for k, (row, column) in enumerate(zip(*by_active.get_triplet(), strict=True))
    ]
    matrices = ("by_state", "by_active", "s")
    given = ", ".join(f"const lanes *restrict {matrix}" for matrix in matrices)
    return "\n".join(
        (
            f"static void {name}_s({given}, lanes *restrict out, int columns) {{",
            "for (int c = 0; c < columns; ++c) {",
            f"const lanes *restrict v = s + c * NX;\nlanes *restrict o = out + c * {count};\n(void)v;",
            *sums,
            "}",
            "if (columns > NX) {",
            *added,
            "}",
            "(void)by_state;\n(void)by_active;",
            "}",
            "",
        )
    )


def _literal(value: float) -> str:
    if value != value:
        return "NAN"
    if value in (float("inf"), -float("inf")):
        return "INFINITY" if value > 0 else "-INFINITY"
    return repr(float(value))
