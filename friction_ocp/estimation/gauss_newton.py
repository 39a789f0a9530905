"""Gauss-Newton with Levenberg-Marquardt damping over parameters and nodes together."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from friction_ocp.estimation.elimination import reduce_system
from friction_ocp.estimation.nodes import solve_nodes
from friction_ocp.estimation.parameter_space import ParameterSpace
from friction_ocp.estimation.program import Linearisation, Point, Program
from friction_ocp.estimation.quadratic import bounded_step, linear_constraints
from friction_ocp.simulation.grid import BoolArray, FloatArray

FIRST_DAMPING, SMALLEST_DAMPING, LARGEST_DAMPING = 1e-3, 1e-12, 1e12
TRUSTED = 1e-2
"""Damping up to which a small predicted decrease is taken for the end rather than for a short step."""
UNDAMPED = 1e-9
"""Damping of the step whose predicted decrease decides about the end: it sees directions that damping hides."""
VALLEY, WIDEST = 1e-4, 1e-1
"""Damping of the first step behind which the nodes are solved for on their own, and the most; that of the next one is
a tenth of what led on."""
PATIENCE = 3
"""Steps in a row that gain next to nothing before those without damping are tried. Where these led nowhere they are
tried again when the objective has fallen by more than next to nothing, and before the end."""
FLAT = 1e-6
"""Curvature of a parameter over the largest on the way below which an end has left where the data see it."""
LOST, BLIND = 1e-8, 1e3
"""The same, below which a step is refused, up to that damping: the model behind the step knew of no such place. The
iterates may still creep there, and come to rest above it but below `FLAT`."""
VANISHED = (1000.0 * float(np.finfo(np.float64).eps)) ** 2
"""Objective over that at the start where residuals are rounding errors."""


@dataclass(frozen=True)
class Solution:
    """Where a solver ended."""

    point: Point
    objective: float
    iterations: int
    converged: bool
    message: str
    smooth: bool = True
    """Whether it ended where the quadratic model expects nothing more, not at a kink."""


Watch = Callable[[int, float, Point], None]
"""Called after each accepted step with iteration, objective and point."""


@dataclass(frozen=True)
class Tolerances:
    """When to stop."""

    decrease: float = 1e-8
    """Predicted decrease of the objective, relative to the objective."""
    negligible: float = 1e-4
    """Predicted decrease that is too small to matter whatever the objective: residuals are in noise floors, so that
    it moves no combination of parameters by more than sqrt(2e-4) of its standard error."""
    progress: float = 1e-6
    """Actual decrease of a step, relative to the objective, below which steps without damping are due."""
    idle: float | None = None
    """The same, with which it ends where those lead nowhere; None is as much."""
    stalled: float = 1e-4
    """The same, where no damped step decreases the objective any more (kinks of the friction law)."""
    max_iterations: int = 100
    first_damping: float = FIRST_DAMPING
    """Of the first step: small at the end of another fit, where kinks stop small steps and not large ones."""
    inner: int = 0
    """Steps of the nodes alone behind a step without damping that gains nothing by itself; 0 does without."""

    @property
    def least(self) -> float:
        """Relative decrease that counts as none."""
        return self.progress if self.idle is None else min(self.idle, self.progress)


USUAL = Tolerances()


@dataclass(frozen=True)
class Trust:
    """How far the quadratic model is believed: the damping and the scale of the parameters that it acts on."""

    damping: float
    scale: FloatArray
    """(parameters,) the largest diagonal of the Hessian so far. Damping then stays strong for a parameter whose
    influence fades, so that it does not run off where nothing depends on it. Source: More 1978."""

    def after(self, ratio: float, system: Linearisation) -> Trust:
        """Return the trust after a step that gained `ratio` times what was predicted.

        Nielsen's cubic, between a tenth and twice. Source: Nielsen 1999, Damping parameter in Marquardt's method.
        """
        factor = 1.0 - (2.0 * min(ratio, 1.0) - 1.0) ** 3
        scale = np.maximum(self.scale, np.diag(system.theta_theta))
        return Trust(max(self.damping * max(factor, 0.1), SMALLEST_DAMPING), scale)


@dataclass(frozen=True)
class _Iterate:
    point: Point
    system: Linearisation
    trust: Trust
    bold: bool = True
    """Whether the first trial of the step before was taken: the next one is then linearised at once."""
    along: float | None = None
    """Damping of the step along a valley that led here, if one did."""


# derivatives outgrow all numbers where a simulation breaks down; the objective there is infinite
@np.errstate(over="ignore", invalid="ignore")
def solve_gauss_newton(
    program: Program, start: Point, tolerances: Tolerances = USUAL, watch: Watch | None = None
) -> Solution:
    """Minimise a program from a start; the start is moved inside the bounds first."""
    point = Point(program.space.clip(start.theta), start.nodes)
    system = program.linearise(point)
    if not np.isfinite(system.objective):
        return Solution(point, system.objective, 0, False, "the simulation breaks down at the start values")
    now = _Iterate(point, system, Trust(tolerances.first_damping, np.diag(system.theta_theta)))
    vanished, slow, idle, valley = VANISHED * system.objective, 0, 0, VALLEY
    for iteration in range(1, tolerances.max_iterations + 1):
        following = _descend(program, now, tolerances) or _undamped(program, now, tolerances, valley)
        if following is None:
            return _stuck(program, now, iteration, tolerances, vanished)
        if following is now:
            return _ended(program, now, iteration, "the predicted decrease is below the tolerance")
        gained = now.system.objective - following.system.objective
        now = following
        slow = slow + 1 if gained <= tolerances.progress * now.system.objective else 0
        idle = idle + 1 if gained <= tolerances.least * now.system.objective else 0
        if slow >= PATIENCE or idle >= PATIENCE:
            further = _undamped(program, now, tolerances, valley)
            if further is None and idle >= PATIENCE:
                return _ended(program, now, iteration, "three steps in a row gained next to nothing", smooth=False)
            if further is None:
                slow = 0
            else:
                valley = further.along or valley
                slow, idle, now = PATIENCE - 1 if further.along else 0, 0, further
        if watch is not None:
            watch(iteration, now.system.objective, now.point)
    return Solution(now.point, now.system.objective, tolerances.max_iterations, False, "iteration limit reached")


def _descend(program: Program, now: _Iterate, tolerances: Tolerances) -> _Iterate | None:
    """Return what follows the first damped step that decreases the objective.

    The iterate itself where hardly any decrease is predicted, None where no step decreases the objective.
    """
    damping, grow, system = now.trust.damping, 4.0, now.system
    enough = max(tolerances.decrease * system.objective, tolerances.negligible)
    while damping <= LARGEST_DAMPING:
        trial, predicted = trial_step(program.space, now.point, system, damping, now.trust.scale)
        if predicted <= enough and damping <= TRUSTED and _remaining(program, now) <= enough:
            return now
        first = damping == now.trust.damping
        after = program.linearise(trial) if first and now.bold else None
        gained = system.objective - (after.objective if after else program.objective(trial))
        if gained > 1e-4 * max(predicted, 0.0) and gained > 0:
            after = after or program.linearise(trial)
            if damping > BLIND or not np.any(_faded(after, now.trust.scale, LOST)):
                trust = Trust(damping, now.trust.scale).after(gained / max(predicted, 1e-300), after)
                return _Iterate(trial, after, trust, first)
        damping, grow = damping * grow, grow * 2.0
    return None


def _undamped(program: Program, now: _Iterate, tolerances: Tolerances, valley: float) -> _Iterate | None:
    """Return what follows a step without damping where that gains more than next to nothing.

    Parameters that are well seen one by one and hardly seen together, such as a torque constant and all that it is
    traded for, have a long way to go along which damping, which looks at each, lets them creep. Nodes that rest at
    kinks have steps of their own that lead nowhere: in a second trial nodes do no more than follow the parameters.
    Along a curved valley of parameters and nodes every straight step loses: in further trials, if they are asked for,
    the nodes come back to it on their own. How far the valley is followed at once is a matter of trial; `valley` is the
    damping that led on the last time.
    """
    trials = [(UNDAMPED, False, 0), (UNDAMPED, True, 0)]
    if tolerances.inner and not program.without_nodes:
        trials += [(damping, False, tolerances.inner) for damping in _dampings(0.1 * valley)]
    enough = max(tolerances.least * now.system.objective, tolerances.negligible)
    for damping, follow, inner in trials:
        trial, predicted = trial_step(program.space, now.point, now.system, damping, now.trust.scale, follow)
        if predicted <= enough:
            continue
        trial = solve_nodes(program, trial, inner) if inner else trial
        if not now.system.objective - program.objective(trial) > enough:
            continue
        after = program.linearise(trial)
        if not np.any(_faded(after, now.trust.scale, LOST)):
            gained = now.system.objective - after.objective
            trust = Trust(damping, now.trust.scale).after(gained / predicted, after)
            return _Iterate(trial, after, trust, along=damping if inner else None)
    return None


def _dampings(first: float) -> Iterator[float]:
    damping = max(first, UNDAMPED)
    while damping < 0.999 * WIDEST:
        yield damping
        damping *= 100.0
    yield WIDEST


def _remaining(program: Program, now: _Iterate) -> float:
    """Return the decrease that the quadratic model predicts without damping."""
    return trial_step(program.space, now.point, now.system, UNDAMPED)[1]


def _faded(system: Linearisation, scale: FloatArray, share: float) -> BoolArray:
    """Return of which parameters less than a share of their curvature is left."""
    return np.diag(system.theta_theta) < share * scale


def _ended(program: Program, now: _Iterate, iteration: int, message: str, smooth: bool = True) -> Solution:
    """Return an end at a stationary point; no answer where it is one because a parameter lost its influence."""
    theta, space = now.point.theta, program.space
    faded = _faded(now.system, now.trust.scale, FLAT) & (theta > space.lower) & (theta < space.upper)
    if not np.any(faded):
        return Solution(now.point, now.system.objective, iteration, True, message, smooth)
    names = ", ".join(name for name, lost in zip(space.names, faded, strict=True) if lost)
    text = f"the iterates ran to where nothing depends on {names} any more; start elsewhere or bound it"
    return Solution(now.point, now.system.objective, iteration, False, text)


def _stuck(program: Program, now: _Iterate, iteration: int, tolerances: Tolerances, vanished: float) -> Solution:
    objective, predicted = now.system.objective, _remaining(program, now)
    relative = predicted / max(objective, 1e-300)
    if relative <= tolerances.stalled or predicted <= tolerances.negligible or objective <= vanished:
        return _ended(program, now, iteration, "no step decreases the objective further", smooth=False)
    text = f"no step decreases the objective, yet the model predicts {relative:.1e} of it"
    return Solution(now.point, objective, iteration, False, text)


def trial_step(
    space: ParameterSpace,
    point: Point,
    system: Linearisation,
    damping: float,
    scale: FloatArray | None = None,
    follow: bool = False,
) -> tuple[Point, float]:
    """Return the damped Gauss-Newton point and the decrease that the quadratic model predicts.

    `scale` (parameters,) is what damping of the parameters is relative to; None takes the diagonal of the Hessian.
    Nodes that only `follow` the parameters do not move of their own.
    """
    reduced = reduce_system(system, damping, scale)
    rows, margins = linear_constraints(space.constraints, point.theta)
    step = bounded_step(
        reduced.hessian, reduced.gradient, space.lower - point.theta, space.upper - point.theta, rows, margins
    )
    theta = space.clip(point.theta + step)
    step = theta - point.theta
    moves = reduced.node_steps(step, follow)
    nodes = tuple(old + move for old, move in zip(point.nodes, moves, strict=True))
    return Point(theta, nodes), _predicted(system, step, moves)


def _predicted(system: Linearisation, step: FloatArray, node_steps: tuple[FloatArray, ...]) -> float:
    """Return the decrease of the undamped quadratic model."""
    decrease = -system.theta_gradient @ step - 0.5 * step @ system.theta_theta @ step
    for blocks, move in zip(system.blocks, node_steps, strict=True):
        pulled = np.einsum("kij,kj->ki", blocks.node_node, move)
        decrease -= np.sum(move * blocks.node_gradient) + 0.5 * np.sum(move * pulled)
        decrease -= np.einsum("ki,kip,p->", move, blocks.node_theta, step)
        decrease -= np.einsum("ki,kij,kj->", move[:-1], blocks.node_next, move[1:])
    return float(decrease)
