"""A model as a semi-explicit differential-algebraic system whose every variable has a name and a unit.

.. math:: \\dot x = f(x, z, u, p), \\qquad 0 = g(x, z, u, p), \\qquad y = h(x, z, u, p)
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np
import numpy.typing as npt

from friction_ocp.errors import Finding, FrictionOcpError

FloatArray = npt.NDArray[np.float64]

SINGULAR = 1e-12
"""Singular value of dg/dz below which it counts as singular; each equation is scaled by its largest derivative."""


@dataclass(frozen=True)
class Variable:
    """A scalar of a model."""

    name: str
    unit: str
    expression: ca.SX
    """Its symbol; for an output, its value."""


@dataclass(frozen=True)
class Linearisation:
    """Matrices of dx/dt = A x + B u, y = C x + D u about a point, the algebraic variables eliminated."""

    a: FloatArray
    b: FloatArray
    c: FloatArray
    d: FloatArray


@dataclass(frozen=True)
class Dae:
    """States x, algebraic variables z, inputs u, parameters p, outputs y, and the equations between them."""

    states: tuple[Variable, ...]
    algebraic: tuple[Variable, ...]
    inputs: tuple[Variable, ...]
    parameters: tuple[Variable, ...]
    outputs: tuple[Variable, ...]
    ode: ca.SX
    """(states,) time derivatives."""
    alg: ca.SX
    """(algebraic,) residuals that vanish."""

    @property
    def x(self) -> ca.SX:
        """(states,) symbols."""
        return _column(self.states)

    @property
    def z(self) -> ca.SX:
        """(algebraic,) symbols."""
        return _column(self.algebraic)

    @property
    def u(self) -> ca.SX:
        """(inputs,) symbols."""
        return _column(self.inputs)

    @property
    def p(self) -> ca.SX:
        """(parameters,) symbols."""
        return _column(self.parameters)

    @property
    def y(self) -> ca.SX:
        """(outputs,) expressions."""
        return _column(self.outputs)

    def function(self) -> ca.Function:
        """Return (x, z, u, p) -> (ode, alg, y)."""
        names_in, names_out = ["x", "z", "u", "p"], ["ode", "alg", "y"]
        return ca.Function("dae", [self.x, self.z, self.u, self.p], [self.ode, self.alg, self.y], names_in, names_out)

    def problem(self) -> dict[str, ca.SX]:
        """Return what `casadi.integrator` takes: idas for any model, cvodes where there are no algebraic variables."""
        parts = {"x": self.x, "u": self.u, "p": self.p, "ode": self.ode}
        return parts | {"z": self.z, "alg": self.alg} if self.algebraic else parts

    def stack(self, variables: tuple[Variable, ...], values: Mapping[str, float]) -> FloatArray:
        """Return the values of variables in their order; raises FrictionOcpError for those that are missing."""
        missing = [variable for variable in variables if variable.name not in values]
        if missing:
            raise FrictionOcpError([Finding(item.name, f"no value given, in {item.unit}") for item in missing])
        return np.array([float(values[variable.name]) for variable in variables])

    def check_index1(self, values: Mapping[str, float]) -> None:
        """Raise FrictionOcpError unless the algebraic variables follow from the others, in form and at `values`.

        `values` holds states, algebraic variables, inputs and parameters by name.
        """
        if not self.algebraic:
            return
        slope = ca.jacobian(self.alg, self.z)
        names = ", ".join(variable.name for variable in self.algebraic)
        remedy = "look at the equations of the parts that they connect"
        rank, count = ca.sprank(slope), len(self.algebraic)
        if self.alg.numel() != count or rank < count:
            what = f"{count} algebraic variables, but equations for {min(rank, self.alg.numel())} of them"
            raise FrictionOcpError(
                Finding(f"algebraic variables {names}", what, "as many equations as variables", remedy)
            )
        everything = self._at(values, ca.jacobian(self.alg, ca.vertcat(self.z, self.x, self.u)))
        size = np.maximum(np.abs(everything).max(axis=1, keepdims=True), np.finfo(float).tiny)
        matrix = everything[:, :count]
        scaled = matrix / size
        _, sizes, directions = np.linalg.svd(scaled)
        if not np.all(np.isfinite(matrix)) or sizes[-1] <= SINGULAR:
            loosest = self.algebraic[int(np.argmax(np.abs(directions[-1])))]
            what = f"not determined by the other variables: dg/dz has rank {int(np.sum(sizes > SINGULAR))}"
            raise FrictionOcpError(Finding(loosest.name, f"{what} of {count}", "index 1", remedy))

    def linearise(self, values: Mapping[str, float]) -> Linearisation:
        """Return the linear model about `values`; raises FrictionOcpError where the index is not 1."""
        self.check_index1(values)
        rows, columns = (self.ode, self.y), (self.x, self.u)
        elimination = ca.solve(ca.jacobian(self.alg, self.z), ca.horzcat(*[ca.jacobian(self.alg, c) for c in columns]))
        blocks: list[FloatArray] = []
        for row in rows:
            direct = ca.horzcat(*[ca.jacobian(row, c) for c in columns])
            blocks.append(self._at(values, direct - ca.mtimes(ca.jacobian(row, self.z), elimination)))
        states = len(self.states)
        (a, b), (c, d) = (np.split(block, [states], axis=1) for block in blocks)
        return Linearisation(a, b, c, d)

    def _at(self, values: Mapping[str, float], expression: ca.SX) -> FloatArray:
        groups = (self.states, self.algebraic, self.inputs, self.parameters)
        function = ca.Function("at", [_column(group) for group in groups], [ca.densify(expression)])
        return np.asarray(function(*(self.stack(group, values) for group in groups)), dtype=float)


def _column(variables: tuple[Variable, ...]) -> Any:
    return ca.vertcat(*[variable.expression for variable in variables]) if variables else ca.SX(0, 1)
