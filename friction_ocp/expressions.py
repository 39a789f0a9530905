"""The arithmetic of ties and constraints: parsed, never run as code.

    comparison: sum [("<=" | ">=") sum]        sum: product (("+" | "-") product)*
    product: unary (("*" | "/") unary)*        unary: "-" unary | power
    power: atom ["**" unary]                   atom: number | path | function "(" sum, ... ")" | "(" sum ")"

A path such as `motor-load.stiffness` is recognised by the known paths, longest first, so that its hyphen is no minus.
"""

from __future__ import annotations

import difflib
import math
import operator
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import reduce
from typing import Any

import casadi as ca

from friction_ocp.errors import Finding, FrictionOcpError

MAX_LENGTH = 500
MAX_DEPTH = 60
_NUMBER = re.compile(r"(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
_WORD = re.compile(r"[A-Za-z_][\w.@]*(?:-[A-Za-z_][\w.@]*)*")
_OPERATOR = re.compile(r"\*\*|<=|>=|[-+*/(),]")
_WORD_GOES_ON = re.compile(r"[\w@]|\.\w")


def _casadi(of_floats: Callable[..., float], of_symbols: Callable[..., Any]) -> Callable[..., Any]:
    def either(*arguments: Any) -> Any:
        symbolic = any(isinstance(argument, (ca.SX, ca.MX, ca.DM)) for argument in arguments)
        return of_symbols(*arguments) if symbolic else of_floats(*arguments)

    return either


def _fold(function: Callable[[Any, Any], Any]) -> Callable[..., Any]:
    return lambda *arguments: reduce(function, arguments)


def _divide(dividend: Any, divisor: Any) -> Any:
    return dividend / divisor


def _raise(base: Any, exponent: Any) -> Any:
    return base**exponent


_FUNCTIONS: Mapping[str, Callable[..., Any]] = {
    "abs": _casadi(math.fabs, ca.fabs),
    "sqrt": _casadi(math.sqrt, ca.sqrt),
    "exp": _casadi(math.exp, ca.exp),
    "log": _casadi(math.log, ca.log),
    "min": _casadi(min, _fold(ca.fmin)),
    "max": _casadi(max, _fold(ca.fmax)),
}
_OPERATORS: Mapping[str, Callable[..., Any]] = {
    "+": operator.add,
    "-": operator.sub,
    "*": operator.mul,
    "/": _divide,
    "**": _casadi(math.pow, _raise),
    "neg": operator.neg,
}


@dataclass(frozen=True)
class _Call:
    function: Callable[..., Any]
    arguments: tuple[_Node, ...]


_Node = _Call | str | float
"""A call, the name of a parameter, or a number."""


@dataclass(frozen=True)
class Expression:
    """A parsed expression over parameter paths; a comparison stands for the margin that must be >= 0."""

    text: str
    names: tuple[str, ...]
    """Paths it depends on, in the order in which they appear."""
    comparison: bool
    """Whether it is an inequality, a constraint, rather than a value."""
    where: str
    tree: _Node = field(repr=False)

    def evaluate(self, values: Mapping[str, Any]) -> Any:
        """Return the value, or the margin of an inequality, for floats or CasADi symbols by path.

        Raises FrictionOcpError where floats have no result, as in a division by zero.
        """
        try:
            return _evaluate(self.tree, values)
        except (ArithmeticError, ValueError) as error:
            used = ", ".join(f"{name} = {values[name]}" for name in self.names)
            what = f"'{self.text}' has no value" + (f" at {used}" if used else "")
            raise FrictionOcpError(Finding(self.where, f"{what} ({error})")) from error


def parse(text: str, names: Sequence[str], where: str = "expression") -> Expression:
    """Parse an expression over the parameter paths `names`.

    Raises FrictionOcpError, at `where`, with the position and the closest existing names.
    """
    if len(text) > MAX_LENGTH:
        raise FrictionOcpError(Finding(where, f"the expression has {len(text)} characters", f"at most {MAX_LENGTH}"))
    parser = _Parser(text, sorted(names, key=len, reverse=True), where)
    tree, comparison = parser.whole()
    return Expression(text, tuple(dict.fromkeys(_names_of(tree))), comparison, where, tree)


def resolve_ties(ties: Mapping[str, str], values: Mapping[str, Any]) -> dict[str, Any]:
    """Return `values` with every tied path added, ties that depend on ties in their order.

    Raises FrictionOcpError for ties that cannot be read, that compare, or that depend on each other in a circle.
    """
    known = [*values, *ties]
    parsed = {path: _value_expression(text, known, path) for path, text in ties.items()}
    table = dict(values)
    for path in _in_order({path: expression.names for path, expression in parsed.items()}):
        table[path] = parsed[path].evaluate(table)
    return table


def closest(name: str, names: Sequence[str]) -> str:
    """Return "did you mean 'x'?" for the existing names nearest to a wrong one, "" where none is near."""
    near = difflib.get_close_matches(name, names, n=3, cutoff=0.6)
    return f"did you mean {' or '.join(repr(item) for item in near)}?" if near else ""


def _value_expression(text: str, names: Sequence[str], path: str) -> Expression:
    expression = parse(text, names, path)
    if expression.comparison:
        what = f"'{text}' is an inequality"
        raise FrictionOcpError(Finding(path, what, "a tie computes a value", "move it to constraints"))
    return expression


def _in_order(depends_on: Mapping[str, Sequence[str]]) -> list[str]:
    """Return the tied paths so that each comes after those it needs."""
    done: list[str] = []
    under_way: list[str] = []

    def visit(path: str) -> None:
        if path in done or path not in depends_on:
            return
        if path in under_way:
            circle = " -> ".join([*under_way[under_way.index(path) :], path])
            what = f"the ties depend on each other in a circle: {circle}"
            raise FrictionOcpError(Finding(path, what, remedy="give one of them a number or a guess"))
        under_way.append(path)
        for needed in depends_on[path]:
            visit(needed)
        done.append(under_way.pop())

    for path in depends_on:
        visit(path)
    return done


def _evaluate(node: _Node, values: Mapping[str, Any]) -> Any:
    if isinstance(node, _Call):
        return node.function(*[_evaluate(argument, values) for argument in node.arguments])
    return values[node] if isinstance(node, str) else node


def _names_of(node: _Node) -> Iterator[str]:
    if isinstance(node, _Call):
        for argument in node.arguments:
            yield from _names_of(argument)
    elif isinstance(node, str):
        yield node


@dataclass
class _Parser:
    """Recursive descent over the text; `at` is the position of the next character."""

    text: str
    names: Sequence[str]
    """Longest first."""
    where: str
    at: int = 0
    depth: int = 0

    def fail(self, what: str, allowed: str = "", remedy: str = "") -> FrictionOcpError:
        place = f"at position {self.at + 1} of '{self.text}'"
        return FrictionOcpError(Finding(self.where, f"{what} {place}", allowed, remedy))

    def peek(self) -> str:
        """Return the operator that comes next, "" where there is none."""
        while self.at < len(self.text) and self.text[self.at].isspace():
            self.at += 1
        match = _OPERATOR.match(self.text, self.at)
        return match[0] if match else ""

    def take(self, *operators: str) -> str:
        """Consume and return the next operator if it is one of these."""
        found = self.peek()
        if found not in operators:
            return ""
        self.at += len(found)
        return found

    def whole(self) -> tuple[_Node, bool]:
        left = self.sum()
        relation = self.take("<=", ">=")
        if relation:
            right = self.sum()
            left = _Call(operator.sub, (left, right) if relation == ">=" else (right, left))
        self.peek()
        if self.at < len(self.text):
            raise self.fail(f"unexpected '{self.text[self.at :][:20]}'", "one value, or two joined by <= or >=")
        return left, bool(relation)

    def chain(self, part: Callable[[], _Node], *operators: str) -> _Node:
        left = part()
        while found := self.take(*operators):
            left = _Call(_OPERATORS[found], (left, part()))
        return left

    def sum(self) -> _Node:
        return self.chain(self.product, "+", "-")

    def product(self) -> _Node:
        return self.chain(self.unary, "*", "/")

    def unary(self) -> _Node:
        self.depth += 1
        if self.depth > MAX_DEPTH:
            raise self.fail("the expression is nested too deeply", f"at most {MAX_DEPTH} levels")
        node = _Call(_OPERATORS["neg"], (self.unary(),)) if self.take("-") else self.power()
        self.depth -= 1
        return node

    def power(self) -> _Node:
        base = self.atom()
        return _Call(_OPERATORS["**"], (base, self.unary())) if self.take("**") else base

    def atom(self) -> _Node:
        if self.take("("):
            return self.closed(self.sum())
        for name in self.names:
            end = self.at + len(name)
            if self.text.startswith(name, self.at) and not _WORD_GOES_ON.match(self.text, end):
                self.at = end
                return name
        if number := _NUMBER.match(self.text, self.at):
            self.at = number.end()
            return float(number[0])
        return self.call()

    def call(self) -> _Node:
        word = _WORD.match(self.text, self.at)
        if word is None:
            found = f"unexpected '{self.text[self.at]}'" if self.at < len(self.text) else "the expression ends"
            raise self.fail(found, "a number, a parameter path, a function or a parenthesis")
        name = next((known for known in _FUNCTIONS if re.match(rf"{known}\s*\(", self.text[self.at :])), None)
        if name is None:
            raise self.unknown(word[0])
        self.at += len(name)
        self.take("(")
        arguments = [self.sum()]
        while self.take(","):
            arguments.append(self.sum())
        if (len(arguments) > 1) != (name in ("min", "max")):
            raise self.fail(f"{name} has {len(arguments)} arguments", "min and max take two or more, the others one")
        return self.closed(_Call(_FUNCTIONS[name], tuple(arguments)))

    def closed(self, node: _Node) -> _Node:
        if not self.take(")"):
            raise self.fail("a closing parenthesis is missing")
        return node

    def unknown(self, word: str) -> FrictionOcpError:
        """Name the word that is no path, up to a hyphen where only that part resembles one."""
        candidates = [*self.names, *_FUNCTIONS]
        remedy = closest(word, candidates) or closest(word.split("-")[0], candidates)
        return self.fail(f"unknown name '{word}'", f"paths of parameters and {', '.join(_FUNCTIONS)}", remedy)
