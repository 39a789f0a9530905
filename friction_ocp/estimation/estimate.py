"""Identification on one page: problem -> model -> fit -> uncertainty -> free run -> estimate."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import chain

import numpy as np

from friction_ocp.drive.units import signal_unit, unit_of
from friction_ocp.drive.values import drive_leaves
from friction_ocp.estimation.curves import FrictionCurve, friction_curves
from friction_ocp.estimation.drive_noise import joining, made_by_inputs, within
from friction_ocp.estimation.first_nodes import suggested_point
from friction_ocp.estimation.fit import settled
from friction_ocp.estimation.gauss_newton import Solution
from friction_ocp.estimation.horizon import horizon, longest_recording
from friction_ocp.estimation.identifiability import Verdict, beyond_the_log, named_in_trades, verdicts
from friction_ocp.estimation.influence import influence
from friction_ocp.estimation.innovations import innovations
from friction_ocp.estimation.model import Model, prepare
from friction_ocp.estimation.noise import NoiseFloor, NoiseLevel, step_of
from friction_ocp.estimation.preparation import prepare_identification
from friction_ocp.estimation.problem import Problem
from friction_ocp.estimation.progress import Progress, Report, silent
from friction_ocp.estimation.rounds import Fitted, program_builder
from friction_ocp.estimation.sampling_limit import beyond_sampling
from friction_ocp.estimation.score import Errors, FreeRun, channel_errors, simulate_recordings
from friction_ocp.estimation.static_points import StaticFit, misses_points, static_fit
from friction_ocp.estimation.uncertainty import Uncertainty, uncertainty
from friction_ocp.estimation.unknown_noise import MOST_SAMPLES
from friction_ocp.estimation.warnings import LOST_FREE_RUN, warnings_of
from friction_ocp.estimation.whiteness import Whiteness, told_by_rounding, whiteness
from friction_ocp.execution.linear_algebra import with_one_thread
from friction_ocp.simulation.grid import FloatArray
from friction_ocp.simulation.losses import Squares

LOUDER = 1.1
"""Residuals over their noise floor, root mean square, from which intervals that trust it are off by a tenth."""

ChannelErrors = Mapping[str, tuple[Errors, Mapping[str, Errors]]]


@dataclass(frozen=True)
class ParameterEstimate:
    """One fitted parameter."""

    name: str
    value: float
    unit: str
    std_error: float
    interval95: tuple[float, float]
    guess: float
    verdict: Verdict


@dataclass(frozen=True)
class SolverFacts:
    """What the solver did."""

    name: str
    iterations: int
    seconds: float
    build_seconds: float
    objective: float
    starts: int


@dataclass(frozen=True)
class Simulation:
    """Free runs of a problem and their errors; also the part of an `Estimate` that a reader can check by eye."""

    problem: Problem
    train: tuple[FreeRun, ...]
    validation: tuple[FreeRun, ...]
    train_errors: ChannelErrors
    validation_errors: ChannelErrors
    floors: Mapping[str, NoiseFloor]
    units: Mapping[str, str]
    """By output channel."""
    state_names: tuple[str, ...]
    horizon_s: float | None
    max_step: float
    """Longest integrator step that was used, s."""
    static: tuple[StaticFit, ...] = ()
    """Static points, those that were fitted first."""


@dataclass(frozen=True)
class Estimate:
    """The answer of an identification."""

    problem: Problem
    converged: bool
    message: str
    parameters: tuple[ParameterEstimate, ...]
    uncertainty: Uncertainty
    simulation: Simulation
    residuals: Mapping[str, Mapping[str, Whiteness]]
    """By recording and channel."""
    curves: tuple[FrictionCurve, ...]
    warnings: tuple[str, ...]
    solver: SolverFacts
    noise_levels: tuple[NoiseLevel, ...] = ()
    """Torque noise that was estimated, by shaft."""

    @property
    def values(self) -> Mapping[str, float]:
        """Value by parameter name."""
        return {item.name: item.value for item in self.parameters}


class Interrupted(Exception):
    """A fit was stopped by the user; `estimate` is its last iterate."""

    def __init__(self, estimate: Estimate) -> None:
        super().__init__(estimate.message)
        self.estimate = estimate


@with_one_thread
def identify(problem: Problem, progress: Progress = silent) -> Estimate:
    """Fit every parameter of a problem that has a guess.

    Raises FrictionOcpError where the recordings do not fit the drive, and Interrupted, which carries the last
    iterate, on Ctrl-C. A fit that did not converge is returned with `converged` False, says why in `message`, and has
    NaN for standard errors and intervals.
    """
    began = time.perf_counter()
    model = prepare_identification(problem)
    built = time.perf_counter()
    reports: list[Report] = []

    def remember(report: Report) -> None:
        if report.point.theta.size == model.space.guess.size:
            reports[:] = [report]
        progress(report)

    try:
        model, fitted = settled(model, remember)
    except KeyboardInterrupt:
        stopped = _last_iterate(model, reports)
        raise Interrupted(conclude(model, stopped, built - began, time.perf_counter() - built)) from None
    return conclude(model, fitted, built - began, time.perf_counter() - built)


def _last_iterate(model: Model, reports: list[Report]) -> Fitted:
    program = program_builder(model)(model, 0.0, Squares())
    theta = reports[0].point.theta if reports else model.space.guess
    point = suggested_point(program, theta)
    where = f"in phase '{reports[0].phase}', iteration {reports[0].iteration}" if reports else "before the first step"
    return Fitted(Solution(point, program.objective(point), 0, False, f"interrupted {where}"), program)


def conclude(model: Model, fitted: Fitted, build_seconds: float, seconds: float) -> Estimate:
    """Turn a fit into an estimate: covariance, verdicts, free runs, warnings."""
    problem, solution = model.problem, fitted.solution
    theta = solution.point.theta
    found = influence(fitted.program, solution.point)
    asked = _asked_residuals(model, fitted)
    residuals = {
        name: {channel: whiteness(item.time, item.tested) for channel, item in found_in.items()}
        for name, found_in in asked.items()
    }
    simulation = simulate_model(model, theta)
    missed = [fit for fit in simulation.static if fit.split == "train" and misses_points(fit)]
    white = all(test.white for tests in residuals.values() for test in tests.values()) and not missed
    louder = _louder(asked) if white and problem.estimation.loss == "squares" else {}
    doubt = uncertainty(model.space, theta, found, white and not louder, problem.estimation.loss)
    judged = verdicts(model.space, theta, doubt)
    too_fast = beyond_sampling(model, theta, named_in_trades(model.space, judged))
    judged = beyond_the_log(model.space, judged, too_fast)
    if not solution.converged:
        doubt = doubt.withheld()
    parameters = _parameter_estimates(model, theta, doubt, judged)
    return Estimate(
        problem=problem,
        converged=solution.converged,
        message=solution.message,
        parameters=parameters,
        uncertainty=doubt,
        simulation=simulation,
        residuals=residuals,
        curves=friction_curves(model, theta, doubt.covariance, doubt.reach, simulation.train),
        warnings=(
            *([LOST_FREE_RUN] if model.lost_free_run else []),
            *warnings_of(solution, parameters, doubt, residuals, simulation, _drifts(model, simulation, white)),
            *(_missed_warning(fit) for fit in missed),
            *(_loud_warning(name, ratio) for name, ratio in louder.items()),
        ),
        solver=SolverFacts(
            problem.estimation.solver,
            solution.iterations,
            seconds,
            build_seconds,
            solution.objective,
            problem.estimation.starts,
        ),
        noise_levels=model.noise_levels,
    )


def _louder(asked: Mapping[str, Mapping[str, _Asked]]) -> dict[str, float]:
    """Return the channels whose residuals are larger than their noise floor, and how many times."""
    errors: dict[str, list[FloatArray]] = {}
    for channel, item in chain.from_iterable(found.items() for found in asked.values()):
        errors.setdefault(channel, []).append(item.left[np.isfinite(item.left)])
    ratios = {name: float(np.sqrt(np.mean(np.concatenate(parts) ** 2))) for name, parts in errors.items()}
    return {name: ratio for name, ratio in ratios.items() if ratio > LOUDER}


def _drifts(model: Model, simulation: Simulation, white: bool) -> dict[str, float]:
    """Return by channel how far torque noise, or that of noisy inputs, moves a free run, over the noise floor.

    As far as it went where that noise leaves nothing else.
    """
    if not model.noisy_inputs and not model.process_noise:
        return {}
    if (model.tells_noise or model.process_noise) and white:
        return dict.fromkeys(model.drive.output_names, float("inf"))
    seconds = longest_recording(model) if simulation.horizon_s is None else simulation.horizon_s
    noise = joining(model) if model.process_noise else made_by_inputs(model)
    moved = np.sqrt(within(model, noise, model.train[0], seconds)) / model.noise
    return dict(zip(model.drive.output_names, map(float, moved), strict=True))


def _loud_warning(name: str, ratio: float) -> str:
    return (
        f"Residuals of {name} are {ratio:.3g} times its noise floor, and white: the floor is stated too low, or "
        "samples are spoilt (a robust loss lets these be). The standard errors are the robust (sandwich) ones."
    )


def _missed_warning(fit: StaticFit) -> str:
    return (
        f"The static points {fit.name} are missed by {fit.noise_ratio:.3g} times their standard errors: the model "
        "misses something at constant speed, and the standard errors are the robust (sandwich) ones."
    )


@with_one_thread
def simulate(problem: Problem) -> Simulation:
    """Simulate all recordings freely with the guesses of a problem.

    A number of `scope: recording` that is not set for one is fitted to it, as the state is in which it begins.
    """
    model = prepare(problem)
    return simulate_model(model, model.space.guess, fitted=False)


def simulate_model(model: Model, theta: FloatArray, fitted: bool = True) -> Simulation:
    """Simulate all recordings freely with given parameters, to which those of training were `fitted`."""
    train = simulate_recordings(model, model.train, theta, fitted=fitted)
    validation = simulate_recordings(model, model.validation, theta, fitted=fitted)
    return Simulation(
        problem=model.problem,
        train=train,
        validation=validation,
        train_errors=channel_errors(model, train),
        validation_errors=channel_errors(model, validation),
        floors=model.floors,
        units={item.name: signal_unit(model.problem.drive, item.measures) for item in model.problem.drive.outputs},
        state_names=model.drive.state_names,
        horizon_s=horizon(model),
        max_step=model.max_step,
        static=(
            *(static_fit(term, model.space, theta, "train") for term in model.static),
            *(static_fit(term, model.space, theta, "validation") for term in model.static_validation),
        ),
    )


def _parameter_estimates(
    model: Model, theta: FloatArray, doubt: Uncertainty, judged: tuple[Verdict, ...]
) -> tuple[ParameterEstimate, ...]:
    units = {leaf.path: unit_of(leaf, model.problem.drive) for leaf in drive_leaves(model.problem.drive)}
    intervals = doubt.interval(theta)
    return tuple(
        ParameterEstimate(
            name=name,
            value=float(theta[k]),
            unit=units[name.partition("@")[0]],
            std_error=float(doubt.std_error[k]),
            interval95=(float(intervals[k, 0]), float(intervals[k, 1])),
            guess=float(model.space.guess[k]),
            verdict=judged[k],
        )
        for k, name in enumerate(model.space.names)
    )


@dataclass(frozen=True)
class _Asked:
    """Residuals of a channel of a recording over its noise floor, (n,), NaN where they are missing or tell nothing."""

    time: FloatArray
    left: FloatArray
    tested: FloatArray


def _asked_residuals(model: Model, fitted: Fitted) -> dict[str, dict[str, _Asked]]:
    """Return by recording and channel what is left, and what of it is tested for being white.

    Where noise joins nodes, which then are drawn to samples, that is what was not to be expected. Samples of counters
    that tell nothing but their rounding are not asked.
    """
    program, point = fitted.program, fitted.solution.point
    is_short = sum(item.grid.time.size for item in program.experiments) <= MOST_SAMPLES
    by_noise = program.drive.noisy_inputs or (model.process_noise and is_short)
    found: dict[str, dict[str, _Asked]] = {}
    for index, item in enumerate(program.experiments):
        cut, predicted = program.segments[index], program.simulate(index, point).y
        residuals = left = program.residuals(index, predicted)
        if by_noise and cut.gap_weight is not None and not cut.measured and isinstance(program.loss, Squares):
            residuals = innovations(program, point, index)
        found[item.name] = {}
        for column, channel in enumerate(model.problem.drive.outputs):
            seen = np.isfinite(residuals[:, column])
            step = step_of(channel, item.measured[np.isfinite(item.measured[:, column]), column])
            if step is not None:
                rounding = told_by_rounding(predicted[:, column], left[:, column] * program.noise[column], step)
                seen &= ~rounding
            if seen.sum() > 10:
                tested, over_floor = (np.where(seen, errors[:, column], np.nan) for errors in (residuals, left))
                found[item.name][channel.name] = _Asked(item.grid.time, over_floor, tested)
    return found
