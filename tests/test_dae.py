"""Named DAEs: their functions, the check of index 1, and linear models."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

from friction_ocp.dae import Dae, Variable
from friction_ocp.errors import FrictionOcpError

ROUNDING = 1e-14
VALUES = {"x": 0.5, "z": 0.25, "s": 0.0, "u": 2.0, "p": 3.0}


def variable(name: str, unit: str = "1") -> Variable:
    """A named symbol."""
    return Variable(name, unit, ca.SX.sym(name))


def model(alg: str) -> Dae:
    """x' = -p x + z, with one of several equations for z; y = x + 2 z."""
    x, z, u, p = variable("x", "rad"), variable("z", "N m"), variable("u", "A"), variable("p")
    residual = {
        "linear": 4.0 * z.expression - u.expression * x.expression,
        "vanishing": z.expression * x.expression - u.expression,
        "missing": x.expression - u.expression,
        "none": ca.SX(0, 1),
    }[alg]
    y = Variable("y", "rad", x.expression + 2.0 * z.expression)
    ode = -p.expression * x.expression + z.expression
    return Dae((x,), (z,), (u,), (p,), (y,), ode, residual)


def test_the_function_takes_and_gives_named_vectors() -> None:
    """function() maps (x, z, u, p) to (ode, alg, y) under those names."""
    found = model("linear").function()(x=0.5, z=0.25, u=2.0, p=3.0)
    assert [float(found[name]) for name in ("ode", "alg", "y")] == pytest.approx([-1.25, 0.0, 1.0], abs=ROUNDING)


def test_index_1_passes() -> None:
    """An equation that determines the algebraic variable is accepted, and so is a model without any."""
    model("linear").check_index1(VALUES)
    x = variable("x")
    Dae((x,), (), (), (), (), -x.expression, ca.SX(0, 1)).check_index1({})


@pytest.mark.parametrize("alg", ["missing", "none"])
def test_a_structurally_singular_model_is_refused(alg: str) -> None:
    """Where no equation can determine an algebraic variable the error counts equations and names the variable."""
    with pytest.raises(FrictionOcpError, match="algebraic variables z: 1 algebraic variables, but equations for 0"):
        model(alg).check_index1(VALUES)


def test_a_numerically_singular_model_is_refused() -> None:
    """Where dg/dz vanishes at the given values the error names the variable that nothing determines there."""
    model("vanishing").check_index1(VALUES)
    with pytest.raises(FrictionOcpError, match=r"z: not determined .* rank 0 of 1; index 1"):
        model("vanishing").check_index1(VALUES | {"x": 0.0})


def test_two_equations_that_say_the_same_are_refused() -> None:
    """Equations of full structural but deficient numerical rank are found whatever their scale."""
    z, s = variable("z"), variable("s")
    same = z.expression + s.expression - 1.0
    dae = Dae((), (z, s), (), (), (), ca.SX(0, 1), ca.vertcat(same, 1e6 * same))
    with pytest.raises(FrictionOcpError, match="rank 1 of 2"):
        dae.check_index1(VALUES)
    scaled = Dae((), (z, s), (), (), (), ca.SX(0, 1), ca.vertcat(same, 1e-9 * (z.expression - s.expression)))
    scaled.check_index1(VALUES)


def test_the_linear_model_eliminates_algebraic_variables() -> None:
    """z = u x / 4 turns x' = -p x + z and y = x + 2 z into matrices of their total derivatives."""
    found = model("linear").linearise(VALUES)
    matrices = [found.a, found.b, found.c, found.d]
    assert [matrix.shape for matrix in matrices] == [(1, 1)] * 4
    assert [matrix.item() for matrix in matrices] == pytest.approx([-3.0 + 0.5, 0.125, 1.0 + 1.0, 0.25], rel=ROUNDING)


def test_a_model_without_algebraic_variables_is_linearised() -> None:
    """Without algebraic variables the matrices are the plain Jacobians."""
    x, u = variable("x"), variable("u")
    y = Variable("y", "1", ca.vertcat(x.expression))
    dae = Dae((x,), (), (u,), (), (y,), -3.0 * x.expression + u.expression, ca.SX(0, 1))
    found = dae.linearise({"x": 1.0, "u": 0.0})
    assert np.array_equal(np.block([[found.a, found.b], [found.c, found.d]]), [[-3.0, 1.0], [1.0, 0.0]])


def test_missing_values_are_all_named() -> None:
    """Every value that is not given is found at once, with its unit."""
    with pytest.raises(FrictionOcpError) as caught:
        model("linear").stack(model("linear").states + model("linear").inputs, {})
    assert [finding.where for finding in caught.value.findings] == ["x", "u"] and "in rad" in str(caught.value)
