"""What a model is worth: likelihood of the free run, AICc, BIC, and the likelihood of what was held out."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from friction_ocp.estimation.estimate import Estimate, Simulation
from friction_ocp.estimation.score import FreeRun
from friction_ocp.simulation.grid import FloatArray
from friction_ocp.statistics.block_length import effective_size


@dataclass(frozen=True)
class Scores:
    """Criteria of one model; differences between models of the same samples mean something, values do not."""

    parameters: int
    """Fitted ones, and one error size a channel."""
    log_likelihood: float
    aicc: float
    """Infinite where there are no more independent samples than parameters."""
    bic: float
    held_out: float | None
    """Log-likelihood of the validation recordings with the error sizes of training; None where there are none."""


def effective_samples(simulation: Simulation) -> Mapping[str, float]:
    """Return for each channel how many independent errors the training recordings hold.

    Taken from the model with most parameters, whose errors are the nearest to noise, and used for all models (as the
    variance inflation of QAICc is: Burnham & Anderson 2002, section 2.5).
    """
    return {
        name: max(1.0, sum(effective_size(run.simulated[:, k] - run.measured[:, k]) for run in simulation.train))
        for k, name in enumerate(simulation.units)
    }


def scores_of(estimate: Estimate, sizes: Mapping[str, float]) -> Scores:
    """Score a fitted model.

    The errors of a channel are normal, or Laplace where the loss is not that of squares, of a size that is estimated
    too (concentrated likelihood): a noise floor that a model never reaches would make every difference decisive.
    """
    laplace = estimate.problem.estimation.loss != "squares"
    simulation = estimate.simulation
    train = dict(zip(simulation.units, _errors(simulation, simulation.train), strict=True))
    spread = {name: _spread(errors, laplace) for name, errors in train.items()}
    told = {name: errors for name, errors in train.items() if errors.size}
    log_likelihood = sum(_log_likelihood(train[name], spread[name], sizes[name], laplace) for name in told)
    held_out = None
    if simulation.validation:
        unseen = dict(zip(simulation.units, _errors(simulation, simulation.validation), strict=True))
        held_out = sum(
            _log_likelihood(unseen[name], spread[name], sizes[name] * unseen[name].size / train[name].size, laplace)
            for name in told
            if unseen[name].size
        )
    count, total = len(estimate.parameters) + len(told), sum(sizes[name] for name in told)
    spare = total - count - 1
    return Scores(
        parameters=count,
        log_likelihood=log_likelihood,
        aicc=-2.0 * log_likelihood + 2.0 * count * total / spare if spare > 0 else np.inf,
        bic=-2.0 * log_likelihood + count * float(np.log(total)),
        held_out=held_out,
    )


def _errors(simulation: Simulation, runs: Sequence[FreeRun]) -> Iterator[FloatArray]:
    """Yield the errors of each channel over all recordings."""
    for column in range(len(simulation.units)):
        errors = np.concatenate([run.simulated[:, column] - run.measured[:, column] for run in runs])
        yield errors[np.isfinite(errors)]


def _spread(errors: FloatArray, laplace: bool) -> float:
    if not errors.size:
        return 1.0
    size = float(np.mean(np.abs(errors))) if laplace else float(np.sqrt(np.mean(errors**2)))
    return max(size, 1e-300)


def _log_likelihood(errors: FloatArray, spread: float, independent: float, laplace: bool) -> float:
    """Return the mean log density of errors times the number of independent ones."""
    if laplace:
        return -independent * float(np.log(2.0 * spread) + np.mean(np.abs(errors)) / spread)
    return -independent * float(0.5 * np.log(2.0 * np.pi) + np.log(spread) + 0.5 * np.mean(errors**2) / spread**2)
