"""The arithmetic of ties and constraints: values, names with hyphens, errors, and the order of ties."""

from __future__ import annotations

import math
import re

import casadi as ca
import pytest
from hypothesis import given
from hypothesis import strategies as st

from friction_ocp.errors import FrictionOcpError
from friction_ocp.expressions import parse, resolve_ties

ROUNDING = 1e-12
VALUES = {
    "load.inertia": 3.0,
    "load": 100.0,
    "motor-load.stiffness": 7.0,
    "motor-load.stiffness@stop": 5.0,
    "motor.friction.slopes.0": 2.0,
    "motor": 1000.0,
}
CLOSED_FORMS = {
    "2 * load.inertia": 6.0,
    "motor-load.stiffness - load.inertia": 4.0,
    "motor-load.stiffness@stop": 5.0,
    "motor - load.inertia": 997.0,
    "motor-load": 900.0,
    "-load.inertia ** 2": -9.0,
    "2 ** 3 ** 2": 512.0,
    "2 ** -1": 0.5,
    "8 / 2 / 2": 2.0,
    "1 - 2 - 3": -4.0,
    "(1 + 2) * (3 - -4)": 21.0,
    "1e3 + 2.5E-1 + .5": 1000.75,
    "sqrt(9) + abs(-2) + exp(0) + log(1)": 6.0,
    "min(4, 2, 3) + max (1, motor.friction.slopes.0)": 4.0,
    "load.inertia >= 1": 2.0,
    "load.inertia <= 1": -2.0,
}


@pytest.mark.parametrize("text", CLOSED_FORMS)
def test_floats_and_symbols_give_the_closed_form(text: str) -> None:
    """An expression has the same value on floats and on CasADi symbols."""
    expression = parse(text, tuple(VALUES))
    symbols = {name: ca.SX.sym(name) for name in VALUES}
    function = ca.Function("f", list(symbols.values()), [ca.SX(expression.evaluate(symbols))])
    assert expression.evaluate(VALUES) == pytest.approx(CLOSED_FORMS[text], abs=ROUNDING)
    assert float(function(*VALUES.values())) == pytest.approx(CLOSED_FORMS[text], abs=ROUNDING)


def test_names_are_those_that_appear_once_each() -> None:
    """The names of an expression are its paths in their order, hyphens included."""
    expression = parse("motor-load.stiffness * load.inertia - load.inertia >= 0", tuple(VALUES))
    assert expression.names == ("motor-load.stiffness", "load.inertia")
    assert expression.comparison


_NUMBERS = st.floats(min_value=0.1, max_value=10.0).map(lambda value: f"{value:.6f}")
_EXPRESSIONS = st.recursive(
    _NUMBERS | st.sampled_from(["load.inertia", "motor-load.stiffness"]),
    lambda inner: st.tuples(inner, st.sampled_from(["+", "-", "*"]), inner).map(lambda parts: f"({' '.join(parts)})"),
    max_leaves=12,
)


@given(text=_EXPRESSIONS)
def test_arithmetic_agrees_with_python(text: str) -> None:
    """Sums and products have the value that Python gives them."""
    plain = text.replace("load.inertia", "3.0").replace("motor-load.stiffness", "7.0")
    assert parse(text, tuple(VALUES)).evaluate(VALUES) == pytest.approx(eval(plain), rel=1e-9, abs=1e-9)


ERRORS = {
    "load.inertai * 2": "unknown name 'load.inertai' at position 1 of 'load.inertai * 2'; paths of parameters and abs, "
    "sqrt, exp, log, min, max; did you mean 'load.inertia'",
    "1 + motor-load.stifness": "did you mean 'motor-load.stiffness'",
    "2 *": "the expression ends at position 4",
    "2 3": "unexpected '3' at position 3",
    "(2": "a closing parenthesis is missing at position 3",
    "sqrt(1, 2)": "sqrt has 2 arguments",
    "min(1)": "min has 1 arguments",
    "__import__('os')": "unknown name '__import__'",
    "load.inertia.real": "unknown name 'load.inertia.real'",
    "1 < 2": "unexpected '< 2'",
    "1 <= 2 <= 3": "unexpected '<= 3'",
    "$": "unexpected '$' at position 1",
    "": "the expression ends at position 1",
    "(" * 100: "the expression is nested too deeply",
    "-" * 100 + "1": "the expression is nested too deeply",
    "1+" * 400 + "1": "the expression has 801 characters",
}


@pytest.mark.parametrize("text", ERRORS)
def test_text_that_is_no_expression_is_refused(text: str) -> None:
    """What cannot be read is refused with its position, and nothing is ever run."""
    with pytest.raises(FrictionOcpError, match=re.escape(ERRORS[text])) as caught:
        parse(text, tuple(VALUES), "constraints[0]")
    assert str(caught.value).startswith("constraints[0]: ")


@pytest.mark.parametrize("text", ["1 / (load.inertia - 3)", "log(0)", "sqrt(-1)", "(0 - 1) ** 0.5", "exp(1e9)"])
def test_expression_without_a_value_is_refused(text: str) -> None:
    """A division by zero or a root of a negative number is an error that names the text."""
    with pytest.raises(FrictionOcpError, match="has no value"):
        parse(text, tuple(VALUES)).evaluate(VALUES)


def test_longest_sum_is_evaluated() -> None:
    """The longest text that is accepted does not exhaust the stack."""
    text = "+".join(["1"] * 250)
    assert parse(text, ()).evaluate({}) == pytest.approx(250.0, abs=ROUNDING)


def test_ties_follow_one_another() -> None:
    """A tie on a tie gets its value after the other one, whatever the order of the file."""
    table = resolve_ties({"a.x": "2 * b.x", "b.x": "c.x + 1"}, {"c.x": 1.0})
    assert table == {"c.x": 1.0, "b.x": 2.0, "a.x": 4.0}


def test_ties_in_a_circle_are_refused() -> None:
    """Ties that need each other are refused with the circle."""
    with pytest.raises(FrictionOcpError, match=re.escape("a.x -> b.x -> a.x")):
        resolve_ties({"a.x": "b.x", "b.x": "a.x"}, {})


def test_tie_that_compares_is_refused() -> None:
    """An inequality is no value."""
    with pytest.raises(FrictionOcpError, match="is an inequality"):
        resolve_ties({"a.x": "b.x >= 1"}, {"b.x": math.pi})
