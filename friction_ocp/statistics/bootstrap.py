"""Block bootstrap: the scatter of the estimate over recordings that might have been made as well."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from friction_ocp.errors import Finding, FrictionOcpError
from friction_ocp.estimation.estimate import Estimate
from friction_ocp.estimation.experiment import Experiment
from friction_ocp.estimation.horizon import fits_free_run
from friction_ocp.estimation.influence import Influence, influence
from friction_ocp.estimation.problem import Problem
from friction_ocp.estimation.program import Point, Program
from friction_ocp.estimation.quadratic import bounded_step
from friction_ocp.estimation.static_points import StaticTerm
from friction_ocp.execution.linear_algebra import with_one_thread
from friction_ocp.execution.task import Json, Task
from friction_ocp.simulation.grid import FloatArray
from friction_ocp.statistics.answer import Answer, answer
from friction_ocp.statistics.block_length import block_length
from friction_ocp.statistics.execution import Execution
from friction_ocp.statistics.resolve import resolve
from friction_ocp.statistics.workshop import Workshop

DEFAULT_DRAWS = 200
FEWEST_DRAWS = 20
FEWEST_BLOCKS = 24
"""Of all recordings: the signs of fewer have too few combinations. What is wanted beyond is told."""
PERCENTILES = (2.5, 50.0, 97.5)
SIGNS = (-1.0, 1.0)

Method = Literal["refit", "one_step"]


@dataclass(frozen=True)
class Blocks:
    """How the residuals of one recording were cut."""

    recording: str
    length_s: float
    wanted_s: float
    """What the autocorrelation of the residuals asks for; longer than `length_s` where the recording is too short."""
    count: int


@dataclass(frozen=True)
class Bootstrap:
    """Draws of the estimate."""

    estimate: Estimate
    method: Method
    blocks: tuple[Blocks, ...]
    draws: FloatArray
    """(draws, parameters), those that converged."""
    failed: int
    warnings: tuple[str, ...]

    @property
    def std_error(self) -> FloatArray:
        """(parameters,)."""
        return np.std(self.draws, axis=0, ddof=1)

    @property
    def percentiles(self) -> FloatArray:
        """(parameters, 3) at 2.5, 50 and 97.5 %."""
        return np.percentile(self.draws, PERCENTILES, axis=0).T


@with_one_thread
def bootstrap(problem: Problem, draws: int = DEFAULT_DRAWS, execution: Execution = Execution()) -> Bootstrap:
    """Fit a problem and draw its estimate again and again from resampled residuals.

    Blocks of neighbouring residuals, of all channels at once, keep their place and get a random sign: the blockwise
    wild bootstrap (Liu 1988; Shao 2010 for dependent data). It keeps correlation within blocks and noise that changes
    along the recording, holds under misfit as the sandwich does, and for the absolute loss, where signs are the valid
    multipliers (Feng, He & Hu 2011). Every static point has a sign of its own. A prior is drawn again about the
    estimate.

    Free runs are refitted from the optimum (`refit`). Relaxed segments, where gaps are noise too, get the Gauss-Newton
    step of the resampled scores within the bounds (`one_step`; Kline & Santos 2012): they are nearly linear there.
    """
    if draws < FEWEST_DRAWS:
        raise FrictionOcpError(Finding("bootstrap", f"{draws} draws are too few", f"at least {FEWEST_DRAWS}"))
    found = answer(problem, execution)
    blocks = residual_blocks(found.workshop)
    lengths = tuple(item.length_s for item in blocks)
    method: Method = "refit" if fits_free_run(found.workshop.model) else "one_step"
    if method == "refit":
        tasks = [Task(f"draw-{k:04d}", refit, (k, lengths)) for k in range(draws)]
        outcomes = execution.run("draws", tasks, found.workshop).values()
        drawn = [outcome.value["theta"] for outcome in outcomes if outcome.value and outcome.value["converged"]]
    else:
        drawn = one_steps(found, lengths, draws)
    if len(drawn) < 2:
        raise FrictionOcpError(
            Finding("bootstrap", "no draw converged", remedy="see profile for the shape of the optimum")
        )
    kept = np.array(drawn, dtype=np.float64)
    return Bootstrap(found.estimate, method, blocks, kept, draws - len(kept), _warnings(blocks, draws, len(kept)))


def residual_blocks(workshop: Workshop) -> tuple[Blocks, ...]:
    """Return the blocks of every recording: as long as its most correlated channel asks for, if enough are left."""
    program, point = workshop.fitted.program, workshop.fitted.solution.point
    fewest = int(np.ceil(FEWEST_BLOCKS / max(len(program.experiments), 1)))
    blocks: list[Blocks] = []
    for index, item in enumerate(program.experiments):
        errors = program.residuals(index, program.simulate(index, point).y)
        lengths = [_seconds(item, errors[:, column]) for column in range(errors.shape[1])]
        wanted, whole = max(lengths), float(item.grid.time[-1] - item.grid.time[0])
        length = min(wanted, whole / max(fewest, 2))
        blocks.append(Blocks(item.name, length, wanted, max(1, round(whole / length))))
    return tuple(blocks)


def _seconds(item: Experiment, errors: FloatArray) -> float:
    seen = np.isfinite(errors)
    if seen.sum() < 2:
        return 0.0
    return block_length(errors[seen]) * float(np.median(np.diff(item.grid.time[seen])))


def signs(time: FloatArray, length: float, rng: np.random.Generator) -> FloatArray:
    """Return (n,) signs that change only from block to block; the first block begins at a random phase."""
    block = np.floor((time - time[0]) / length + rng.uniform()).astype(np.int64)
    return rng.choice(SIGNS, int(block[-1]) + 1)[block]


def refit(workshop: Workshop, number: int, lengths: Sequence[float]) -> Json:
    """Fit the simulation with resampled residuals, from the optimum."""
    model, (program, best) = workshop.model, (workshop.fitted.program, workshop.fitted.solution.point)
    rng = np.random.default_rng([model.problem.estimation.seed, number])
    drawn = resampled(program, best, lengths, rng)
    end = resolve(model, drawn, best)
    return {"theta": end.point.theta.tolist(), "converged": bool(end.converged and np.isfinite(end.objective))}


def resampled(program: Program, best: Point, lengths: Sequence[float], rng: np.random.Generator) -> Program:
    """Return the program with samples and points model + sign x residual, and priors drawn about the estimate."""
    experiments: list[Experiment] = []
    for index, (item, length) in enumerate(zip(program.experiments, lengths, strict=True)):
        simulated = program.simulate(index, best).y
        error = simulated - item.measured
        experiments.append(replace(item, measured=simulated - signs(item.grid.time, length, rng)[:, None] * error))
    space = program.space
    static: list[StaticTerm] = []
    for term in program.static:
        predicted = term.predict(space, best.theta)
        flipped = rng.choice(SIGNS, predicted.size) * (predicted - term.measured)
        static.append(replace(term, measured=predicted - flipped))
    about = best.theta + np.where(np.isfinite(space.prior_std), space.prior_std, 0.0) * rng.standard_normal(
        best.theta.size
    )
    mean = np.where(np.isfinite(space.prior_std), about, space.prior_mean)
    drawn = replace(space, prior_mean=mean)
    return replace(program, experiments=tuple(experiments), static=tuple(static), space=drawn)


def one_steps(found: Answer, lengths: Sequence[float], draws: int) -> list[FloatArray]:
    """Return the optimum moved by the Gauss-Newton step of resampled scores, for every draw."""
    model, fitted = found.workshop.model, found.workshop.fitted
    space, theta = model.space, fitted.solution.point.theta
    seen = influence(fitted.program, fitted.solution.point)
    information = found.estimate.uncertainty.information
    pull = np.sqrt(np.diag(seen.prior))
    rows, margins = np.zeros((0, theta.size)), np.zeros(0)
    if space.constraints is not None:
        margins, rows = (np.asarray(part) for part in space.constraints(theta))
    moved: list[FloatArray] = []
    for number in range(draws):
        rng = np.random.default_rng([model.problem.estimation.seed, number])
        gradient = resampled_score(seen, lengths, rng) + pull * rng.standard_normal(theta.size)
        step = bounded_step(
            information,
            gradient,
            space.lower - theta,
            space.upper - theta,
            rows.reshape(-1, theta.size),
            margins.ravel(),
        )
        moved.append(space.clip(theta + step))
    return moved


def resampled_score(seen: Influence, lengths: Sequence[float], rng: np.random.Generator) -> FloatArray:
    """Return (parameters,) the score of residuals with random signs, block by block and point by point."""
    total = np.zeros(seen.jacobian.shape[1])
    for index, length in enumerate(lengths):
        own = seen.recording == index
        weight = signs(seen.time[own], length, rng) * seen.score_weight[own]
        total += seen.jacobian[own].T @ weight
    points = seen.recording >= len(lengths)
    return total + seen.jacobian[points].T @ (rng.choice(SIGNS, int(points.sum())) * seen.score_weight[points])


def _warnings(blocks: Sequence[Blocks], draws: int, kept: int) -> tuple[str, ...]:
    texts: list[str] = []
    if kept < draws:
        texts.append(f"{draws - kept} of {draws} draws did not converge and are left out.")
    short = [item.recording for item in blocks if item.wanted_s > 1.0001 * item.length_s]
    if short:
        texts.append(
            f"Residuals stay correlated for longer than blocks can be in {len(short)} of {len(blocks)} recordings "
            f"({', '.join(short[:3])}{', ...' if len(short) > 3 else ''}): the scatter may be too small."
        )
    return tuple(texts)
