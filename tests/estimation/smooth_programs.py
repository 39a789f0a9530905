"""Small programs with known answers, in the form in which the solvers take them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import casadi as ca
import numpy as np

from friction_ocp.estimation.program import Linearisation, Point

Residuals = Callable[[ca.SX], ca.SX]


@dataclass(frozen=True)
class ToySpace:
    """The part of a parameter space that solvers use."""

    guess: np.ndarray
    lower: np.ndarray
    upper: np.ndarray
    constraints: ca.Function | None = None

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(f"theta{k}" for k in range(self.guess.size))

    @property
    def scale(self) -> np.ndarray:
        return np.maximum(np.abs(self.guess), 0.1)

    def clip(self, theta: np.ndarray) -> np.ndarray:
        return np.clip(theta, self.lower, self.upper)


@dataclass(frozen=True)
class ToyProgram:
    """Residuals of parameters alone as a least-squares program."""

    space: ToySpace
    residuals: Residuals
    segments: tuple[()] = ()
    _function: ca.Function = field(init=False)

    def __post_init__(self) -> None:
        theta = ca.SX.sym("theta", self.space.guess.size)
        values = self.residuals(theta)
        function = ca.Function("residuals", [theta], [values, ca.densify(ca.jacobian(values, theta))])
        object.__setattr__(self, "_function", function)

    def linearise(self, point: Point) -> Linearisation:
        """Return objective, gradient and Gauss-Newton Hessian."""
        values, jacobian = (np.asarray(item) for item in self._function(point.theta))
        objective = 0.5 * float(np.sum(values**2))
        finite = objective if np.isfinite(objective) else np.inf
        return Linearisation(finite, jacobian.T @ jacobian, (jacobian.T @ values).ravel(), ())

    def objective(self, point: Point) -> float:
        """Return the cost of a point."""
        return self.linearise(point).objective

    @property
    def start(self) -> Point:
        """The guess."""
        return Point(self.space.guess, ())


def rosenbrock(theta: ca.SX) -> ca.SX:
    """Residuals that vanish at (1, 1) at the end of a bent valley."""
    return ca.vertcat(1 - theta[0], 10 * (theta[1] - theta[0] ** 2))


def offset_rosenbrock(theta: ca.SX) -> ca.SX:
    """The same with a residual that stays."""
    return ca.vertcat(rosenbrock(theta), 0.5 + 0.1 * theta[0])


def toy(
    residuals: Residuals,
    guess: tuple[float, ...],
    lower: float = -np.inf,
    upper: float = np.inf,
    constraint: Residuals | None = None,
) -> ToyProgram:
    """Return a program with equal bounds for all parameters and a constraint >= 0."""
    start = np.array(guess)
    function = None
    if constraint is not None:
        theta = ca.SX.sym("theta", start.size)
        value = constraint(theta)
        function = ca.Function("constraints", [theta], [value, ca.densify(ca.jacobian(value, theta))])
    bounds = (np.full(start.size, bound) for bound in (lower, upper))
    return ToyProgram(ToySpace(start, *bounds, function), residuals)
