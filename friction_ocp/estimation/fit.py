"""A fit from start to end: predictions, nested model, candidates, free run or relaxed segments."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from friction_ocp.estimation.gauss_newton import Solution, Tolerances, solve_gauss_newton
from friction_ocp.estimation.losses import AbstractLoss, Squares
from friction_ocp.estimation.model import Model
from friction_ocp.estimation.parameter_space import ParameterSpace, nested_space
from friction_ocp.estimation.program import Point, Program
from friction_ocp.estimation.horizon import fits_free_run, horizon, is_held
from friction_ocp.estimation.progress import Phases, Progress, silent
from friction_ocp.estimation.stages import WIDTHS, free_run, losses, predictions, relaxed
from friction_ocp.simulation.grid import FloatArray

COARSE = Tolerances(decrease=1e-4, progress=1e-3, max_iterations=25)
FINE = Tolerances()
EXPECTED_PHASES = 10
GROWTH = (0.1, 0.3, 1.0)
"""Windows of a free run over its horizon, one after another, for a drive that drifts."""
LAST_WIDTHS = (0.0,)
RELEASES = (0.02, 0.1, 0.5, 1.0)
"""Stribeck and break speeds, over the typical speed of the drive, from which the released parameters start."""


@dataclass(frozen=True)
class Fitted:
    """The solution and the program that it solves: exact friction, the loss asked for."""

    solution: Solution
    program: Program


def fit(model: Model, progress: Progress = silent) -> Fitted:
    """Fit the parameters of a problem from its guesses.

    A drive that something holds is fitted on its free run at once. One that drifts is fitted on relaxed segments
    first, and on free runs over growing windows after that, where free runs are asked for.
    """
    phases, span = Phases(progress, EXPECTED_PHASES), horizon(model)
    held = is_held(model.problem.drive)
    first = windowed(span) if held and fits_free_run(model) else joined
    fitted = _staged(model, first, phases)
    if held or not fits_free_run(model):
        return fitted
    for share in GROWTH:
        grown = windowed(_longest(model, span) * share)
        fitted = _finish(model, grown, _carried(model, fitted, grown), phases, LAST_WIDTHS)
    return fitted


Builder = Callable[[Model, float, AbstractLoss], Program]


def joined(model: Model, width: float, loss: AbstractLoss) -> Program:
    """Return the program of relaxed segments."""
    return relaxed(model, model.train, width, loss)


def windowed(span: float | None) -> Builder:
    """Return what makes the program of free runs over windows of `span` s; None is the whole recording."""
    return lambda model, width, loss: free_run(model, model.train, width, loss, span)


def program_builder(model: Model) -> Builder:
    """Return what makes the program that a fit ends with."""
    return windowed(horizon(model)) if fits_free_run(model) else joined


def _longest(model: Model, span: float | None) -> float:
    if span is not None:
        return span
    return max(float(item.grid.time[-1] - item.grid.time[0]) for item in model.train)


def _carried(model: Model, fitted: Fitted, builder: Builder) -> Point:
    """Start windows from the states that the program before them went through."""
    program = builder(model, 0.0, Squares())
    nodes: list[FloatArray] = []
    for index, cut in enumerate(program.segments):
        track = fitted.program.simulate(index, fitted.solution.point, with_states=True).states
        assert track is not None
        nodes.append(track[cut.first[:-1]])
    return Point(fitted.solution.point.theta, tuple(nodes))


def _staged(model: Model, builder: Builder, phases: Phases) -> Fitted:
    candidates = _candidates(model, builder, phases)
    best = _tournament(model, builder, candidates, "candidate", phases)
    return _finish(model, builder, best, phases, WIDTHS)


def _solve(program: Program, point: Point, tolerances: Tolerances, phase: str, phases: Phases) -> Solution:
    return solve_gauss_newton(program, point, tolerances, phases.begin(phase))


def _predicted(model: Model, phases: Phases) -> FloatArray:
    """Return the parameters that best predict the smoothed motion over short times."""
    program = predictions(model, model.train, WIDTHS[0])
    start = Point(model.space.guess, program.suggested_nodes(model.space.guess))
    return _solve(program, start, COARSE, "short predictions", phases).point.theta


def _tournament(
    model: Model, builder: Builder, starts: Sequence[FloatArray], phase: str, phases: Phases
) -> Point:
    """Solve the first stage from every start and return the best end."""
    program = builder(model, WIDTHS[0], Squares())
    points = [Point(theta, program.suggested_nodes(theta)) for theta in starts]
    loss = min((next(losses(model, program, point, 1)) for point in points), key=lambda item: getattr(item, "rounding", 0))
    program = replace(program, loss=loss)
    ends = [
        _solve(program, point, COARSE, f"{phase} {k + 1} of {len(points)}", phases) for k, point in enumerate(points)
    ]
    return min(ends, key=lambda end: end.objective).point


def _candidates(model: Model, builder: Builder, phases: Phases) -> list[FloatArray]:
    """Return starts for the full model: the guess, the predictions, and what the nested model leads to."""
    simple = nested_space(model.problem, model.space)
    if simple is model.space:
        return [model.space.guess, _predicted(model, phases)]
    inner = replace(model, space=simple)
    starts = [simple.guess, _predicted(inner, phases)]
    best = _tournament(inner, builder, starts, "simpler friction", phases)
    return released(model, simple, best.theta)


def released(model: Model, simple: ParameterSpace, theta: FloatArray) -> list[FloatArray]:
    """Return starts of the full model around the answer of the nested one.

    What the nested model does not have starts from the guess, and from several places in the range of speeds.
    """
    known = dict(zip(simple.names, theta, strict=True))
    speed = float(np.max(model.speed_scale[:-1]))
    starts = [np.array([known.get(name, model.space.guess[k]) for k, name in enumerate(model.space.names)])]
    for share in RELEASES:
        start = starts[0].copy()
        for k, name in enumerate(model.space.names):
            start[k] = _released_value(model.space, name, known, share * speed, start[k])
        starts.append(start)
    return [model.space.clip(start) for start in starts]


def _released_value(
    space: ParameterSpace, name: str, known: dict[str, float], speed: float, default: float
) -> float:
    stem, _, last = name.partition("@")[0].rpartition(".")
    if name in known:
        return known[name]
    if ".omega_s" in name:
        return speed
    if stem.endswith(".breaks"):
        breaks = sum(other.startswith(f"{stem}.") for other in space.names)
        return 2.0 * speed * (int(last) + 1) / (breaks + 1)
    if stem.endswith(".slopes"):
        return known.get(f"{stem}.0", default)
    if ".tau_s" in name:
        return 1.2 * known.get(name.replace(".tau_s", ".tau_c"), default)
    return default


def _finish(model: Model, builder: Builder, point: Point, phases: Phases, widths: Sequence[float]) -> Fitted:
    """Sharpen width and loss down to the exact problem."""
    program = builder(model, widths[0], Squares())
    stages = list(losses(model, program, point, len(widths)))
    iterations, solution = 0, None
    for k, loss in enumerate(stages):
        last = k == len(stages) - 1
        program = builder(model, widths[min(k, len(widths) - 1)], loss)
        solution = _solve(program, point, FINE if last else COARSE, f"stage {k + 1} of {len(stages)}", phases)
        point, iterations = solution.point, iterations + solution.iterations
    assert solution is not None
    return Fitted(replace(solution, iterations=iterations), program)
