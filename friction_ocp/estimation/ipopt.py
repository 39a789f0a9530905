"""The same program solved by Ipopt with the Gauss-Newton Hessian: an independent check of `solve_gauss_newton`.

Source: Waechter & Biegler 2006, through CasADi's `nlpsol`.
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Generator, Sequence
from contextlib import contextmanager
from typing import Any

import casadi as ca
import numpy as np

from friction_ocp.estimation.gauss_newton import Solution, Tolerances, Watch, trial_step
from friction_ocp.estimation.nlp_layout import NlpLayout
from friction_ocp.estimation.parameter_space import ParameterSpace
from friction_ocp.estimation.program import Linearisation, Point, Program
from friction_ocp.simulation.grid import FloatArray

OPTIONS: dict[str, Any] = {
    "print_time": False,
    "show_eval_warnings": False,
    "no_nlp_grad": True,
    "ipopt.print_level": 0,
    "ipopt.sb": "yes",
    "ipopt.tol": 1e-10,
    "ipopt.acceptable_iter": 0,
    "ipopt.nlp_scaling_method": "none",
    "ipopt.mu_strategy": "adaptive",
    "ipopt.bound_relax_factor": 0.0,
    "ipopt.bound_push": 1e-4,
    "ipopt.bound_frac": 1e-4,
}
"""Objective and variables are scaled here, and here it is decided when to stop (`_Evaluations.report`)."""

ON_BOUND = 1e-7
"""Ipopt stays inside the bounds; what is closer, in typical sizes of the parameter, is on the bound."""

DEFAULT = Tolerances()
SETTLED = "the predicted decrease is below the tolerance"
SLOW = "three steps in a row gained next to nothing"
FAILED = {
    "Infeasible_Problem_Detected": "no values within the bounds meet the constraints; widen the bounds or drop one",
    "Diverging_Iterates": "the iterates diverge; give bounds to the parameters",
    "Invalid_Number_Detected": "the simulation breaks down; start from other guesses or narrow the bounds",
}


def solve_ipopt(
    program: Program, start: Point, tolerances: Tolerances = DEFAULT, watch: Watch | None = None
) -> Solution:
    """Minimise a program from a start; the contract is that of `solve_gauss_newton`.

    A KeyboardInterrupt, from the keyboard or from `watch`, ends Ipopt after the present evaluation and is raised then.
    """
    point = Point(program.space.clip(start.theta), start.nodes)
    system = program.linearise(point)
    if not np.isfinite(system.objective):
        return Solution(point, system.objective, 0, False, "the simulation breaks down at the start values")
    layout = NlpLayout.of(program, point)
    evaluations = _Evaluations(program, layout, point, tolerances, watch)
    with _deferred_interrupt(evaluations):
        status, iterations, x = _run(program.space, layout, evaluations)
    if evaluations.stop is not None:
        raise evaluations.stop
    end = layout.point(x, point)
    end = Point(_on_bounds(program.space, end.theta), end.nodes)
    return _solution(program, end, evaluations.settled or status, iterations, tolerances)


def _on_bounds(space: ParameterSpace, theta: FloatArray) -> FloatArray:
    near = ON_BOUND * space.scale
    theta = np.where(theta - space.lower < near, space.lower, theta)
    return np.where(space.upper - theta < near, space.upper, theta)


def _solution(program: Program, end: Point, status: str, iterations: int, tolerances: Tolerances) -> Solution:
    system = program.linearise(end)
    step, predicted = trial_step(program.space, end, system, 1e-6)
    relative = predicted / max(system.objective, 1e-300)
    small = relative <= tolerances.stalled or predicted <= tolerances.negligible
    if small and status != "Maximum_Iterations_Exceeded":
        text = status if status in (SETTLED, SLOW) else "no step decreases the objective further"
        return Solution(end, system.objective, iterations, True, text)
    if status == "Maximum_Iterations_Exceeded":
        worst = int(np.argmax(np.abs(step.theta - end.theta) / program.space.scale))
        text = (
            f"iteration limit reached; {program.space.names[worst]} would move from {end.theta[worst]:.3g} to "
            f"{step.theta[worst]:.3g} next; raise max_iterations or start from better guesses"
        )
    else:
        text = f"no step decreases the objective, yet the model predicts {relative:.1e} of it"
        text = FAILED.get(status, f"{text} (Ipopt: {status})")
    return Solution(end, system.objective, iterations, False, text)


class _Evaluations:
    """What Ipopt asks for; the program is linearised once a point.

    An exception must not cross Ipopt: it is kept in `stop`, and Ipopt is told at the end of its iteration.
    """

    def __init__(
        self, program: Program, layout: NlpLayout, start: Point, tolerances: Tolerances, watch: Watch | None
    ) -> None:
        self.program, self.layout, self.start = program, layout, start
        self.tolerances, self.watch = tolerances, watch
        self.stop: BaseException | None = None
        self.settled = ""
        self._system = program.linearise(start)
        self._at = b""
        self.factor = 1.0 / max(self._system.objective, 1e-300)
        self._history: list[float] = []

    def objective(self, x: FloatArray) -> float:
        """Return the scaled objective; not a number where the simulation breaks down."""
        value = self._linearised(x).objective
        return value * self.factor if np.isfinite(value) else np.nan

    def gradient(self, x: FloatArray) -> FloatArray:
        """Return the gradient of the scaled objective by the scaled variables."""
        system = self._linearised(x)
        packed = self.layout.pack(system.theta_gradient, [item.node_gradient for item in system.blocks])
        return packed * self.layout.scale * self.factor

    def hessian(self, x: FloatArray, weight: float) -> FloatArray:
        """Return the Gauss-Newton Hessian of `weight` times the scaled objective."""
        return self.layout.hessian_values(self._linearised(x)) * self.factor * weight

    def margins(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the constraints, which must be >= 0, and their Jacobian by the scaled parameters."""
        theta = self.layout.point(x, self.start).theta
        values, rows = constraint_rows(self.program.space, theta)
        return values, rows * self.layout.scale[self.layout.theta]

    def report(self, x: FloatArray) -> bool:
        """Tell `watch` of an iterate; return whether Ipopt must stop."""
        system, point = self._linearised(x), self.layout.point(x, self.start)
        if self.stop is None:
            try:
                self._history.append(system.objective)
                self.settled = self._judged(point, system)
                if self.watch is not None and len(self._history) > 1:
                    self.watch(len(self._history) - 1, system.objective, point)
            except BaseException as error:
                self.stop = error
        return bool(self.settled) or self.stop is not None

    def _judged(self, point: Point, system: Linearisation) -> str:
        """Return why an iterate is the answer, by the criteria of `solve_gauss_newton`; empty where it is not."""
        _, predicted = trial_step(self.program.space, point, system, 1e-6)
        margins = constraint_rows(self.program.space, point.theta)[0]
        if np.any(margins < -1e-8):
            return ""
        if predicted <= max(self.tolerances.decrease * system.objective, self.tolerances.negligible):
            return SETTLED
        latest = np.array(self._history[-4:])
        slow = latest.size == 4 and bool(np.all(np.abs(np.diff(latest)) <= self.tolerances.progress * latest[-1]))
        return SLOW if slow and predicted <= self.tolerances.stalled * system.objective else ""

    def _linearised(self, x: FloatArray) -> Linearisation:
        key = x.tobytes()
        if key != self._at and self.stop is None:
            try:
                self._system = self.program.linearise(self.layout.point(x, self.start))
                self._at = key
            except BaseException as error:
                self.stop = self.stop or error
        return self._system


def constraint_rows(space: ParameterSpace, theta: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the values of the constraints and (constraints, parameters) their Jacobian."""
    if space.constraints is None:
        return np.zeros(0), np.zeros((0, theta.size))
    values, rows = space.constraints(theta)
    return np.asarray(values).ravel(), np.asarray(rows).reshape(-1, theta.size)


@contextmanager
def _deferred_interrupt(evaluations: _Evaluations) -> Generator[None]:
    """Let Ctrl-C set `stop` instead of raising inside Ipopt."""
    ours = threading.current_thread() is threading.main_thread()
    if not ours or signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        yield
        return

    def remember(*_: object) -> None:
        evaluations.stop = evaluations.stop or KeyboardInterrupt()

    signal.signal(signal.SIGINT, remember)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)


Evaluate = Callable[[Sequence[ca.DM]], list[Any]]


class _Callback(ca.Callback):
    """A Python function with named inputs and outputs as a CasADi function."""

    def __init__(
        self, name: str, inputs: dict[str, ca.Sparsity], outputs: dict[str, ca.Sparsity], evaluate: Evaluate
    ) -> None:
        ca.Callback.__init__(self)
        self._inputs, self._outputs, self._evaluate = inputs, outputs, evaluate
        self.construct(name, {})

    def get_n_in(self) -> int:
        return len(self._inputs)

    def get_n_out(self) -> int:
        return len(self._outputs)

    def get_name_in(self, i: int) -> str:
        return list(self._inputs)[i]

    def get_name_out(self, i: int) -> str:
        return list(self._outputs)[i]

    def get_sparsity_in(self, i: int) -> ca.Sparsity:
        return list(self._inputs.values())[i]

    def get_sparsity_out(self, i: int) -> ca.Sparsity:
        return list(self._outputs.values())[i]

    def eval(self, arg: Sequence[ca.DM]) -> list[Any]:
        return self._evaluate(arg)


def _column(argument: ca.DM) -> FloatArray:
    return np.asarray(argument).ravel()


def _run(space: ParameterSpace, layout: NlpLayout, evaluations: _Evaluations) -> tuple[str, int, FloatArray]:
    """Return Ipopt's status, its number of iterations and its last iterate in scaled variables."""
    functions = _functions(layout, evaluations)
    options = OPTIONS | {
        "ipopt.max_iter": evaluations.tolerances.max_iterations,
        **{key: functions[key] for key in ("grad_f", "jac_g", "hess_lag", "iteration_callback")},
    }
    solver = ca.nlpsol("identify", "ipopt", functions["nlp"], options)
    start = evaluations.start
    limits = {name: np.full(layout.scale.size, bound) for name, bound in (("lbx", -np.inf), ("ubx", np.inf))}
    limits["lbx"][layout.theta], limits["ubx"][layout.theta] = space.lower, space.upper
    found = solver(
        x0=layout.pack(start.theta, start.nodes) / layout.scale,
        lbg=0.0,
        ubg=np.inf,
        **{name: bound / layout.scale for name, bound in limits.items()},
    )
    stats = solver.stats()
    return stats["return_status"], int(stats["iter_count"]), _column(found["x"])


def _functions(layout: NlpLayout, evaluations: _Evaluations) -> dict[str, _Callback]:
    x, rows = ca.Sparsity.dense(layout.scale.size, 1), len(evaluations.margins(np.ones(layout.scale.size))[0])
    scalar, none, g = ca.Sparsity.dense(1, 1), ca.Sparsity.dense(0, 1), ca.Sparsity.dense(rows, 1)
    jacobian = ca.Sparsity.dense(rows, len(layout.theta))
    jacobian = ca.horzcat(ca.Sparsity(rows, layout.scale.size - len(layout.theta)), jacobian)
    at, results = {"x": x, "p": none}, {"x": x, "f": scalar, "g": g, "lam_x": x, "lam_g": g, "lam_p": none}

    def values(arg: Sequence[ca.DM]) -> list[Any]:
        return [evaluations.objective(_column(arg[0])), evaluations.margins(_column(arg[0]))[0]]

    def gradient(arg: Sequence[ca.DM]) -> list[Any]:
        return [evaluations.objective(_column(arg[0])), evaluations.gradient(_column(arg[0]))]

    def slopes(arg: Sequence[ca.DM]) -> list[Any]:
        margins, by_theta = evaluations.margins(_column(arg[0]))
        return [margins, ca.DM(jacobian, by_theta.ravel(order="F"))]

    def hessian(arg: Sequence[ca.DM]) -> list[Any]:
        return [ca.DM(layout.hessian, evaluations.hessian(_column(arg[0]), float(arg[2])))]

    def report(arg: Sequence[ca.DM]) -> list[Any]:
        return [evaluations.report(_column(arg[0]))]

    return {
        "nlp": _Callback("nlp", at, {"f": scalar, "g": g}, values),
        "grad_f": _Callback("nlp_grad_f", at, {"f": scalar, "grad_f_x": x}, gradient),
        "jac_g": _Callback("nlp_jac_g", at, {"g": g, "jac_g_x": jacobian}, slopes),
        "hess_lag": _Callback("nlp_hess_l", at | {"lam_f": scalar, "lam_g": g}, {"hess": layout.hessian}, hessian),
        "iteration_callback": _Callback("report", results, {"stop": scalar}, report),
    }
