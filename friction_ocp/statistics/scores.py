"""What a model is worth: likelihood of free run and static points, AICc, BIC, and that of what was held out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from friction_ocp.estimation.estimate import Estimate, Simulation
from friction_ocp.simulation.grid import FloatArray
from friction_ocp.statistics.block_length import effective_size


@dataclass(frozen=True)
class Scores:
    """Criteria of one model; differences between models of the same samples mean something, values do not."""

    parameters: int
    """Fitted ones, and one error size a channel or kind of static points."""
    log_likelihood: float
    aicc: float
    """Infinite where there are no more independent samples than parameters."""
    bic: float
    held_out: float | None
    """Log-likelihood of what was held out with the error sizes of training; None where nothing was."""


@dataclass(frozen=True)
class Errors:
    """Errors that have one size: those of a channel, or of static points of one kind over their standard errors."""

    series: tuple[FloatArray, ...]
    """Of training, each in the order of time where there is one; NaN where a sample is missing."""
    unseen_series: tuple[FloatArray, ...]
    """Of validation recordings or points, likewise."""
    correlated: bool = True
    """Whether neighbours within a series may be."""

    @cached_property
    def train(self) -> FloatArray:
        """All errors of training."""
        return _told(self.series)

    @cached_property
    def unseen(self) -> FloatArray:
        """All errors of validation."""
        return _told(self.unseen_series)

    @property
    def independent(self) -> float:
        """How many of the training errors are."""
        return sum(map(effective_size, self.series)) if self.correlated else float(self.train.size)


def errors_of(simulation: Simulation) -> Mapping[str, Errors]:
    """Return errors by channel, and by what static points hold."""
    found = dict[str, Errors]()
    for column, name in enumerate(simulation.units):
        train, unseen = (
            tuple(run.simulated[:, column] - run.measured[:, column] for run in runs)
            for runs in (simulation.train, simulation.validation)
        )
        found[name] = Errors(train, unseen)
    for effort in dict.fromkeys(item.effort for item in simulation.static):
        sets = [item for item in simulation.static if item.effort == effort]
        scaled = {item.name: (item.predicted - item.measured) / item.std_error for item in sets}
        train, unseen = (
            tuple(scaled[item.name] for item in sets if item.split == split) for split in ("train", "validation")
        )
        found[f"{effort} of static points"] = Errors(train, unseen, correlated=False)
    return {name: item for name, item in found.items() if item.train.size}


def _told(series: Sequence[FloatArray]) -> FloatArray:
    errors = np.concatenate([np.zeros(0), *series])
    return errors[np.isfinite(errors)]


def effective_samples(simulation: Simulation) -> Mapping[str, float]:
    """Return how many independent errors the training recordings hold by channel, and static points by kind.

    Taken from the model with most parameters, whose errors are the nearest to noise, and used for all models (as the
    variance inflation of QAICc is: Burnham & Anderson 2002, section 2.5).
    """
    return {name: max(1.0, item.independent) for name, item in errors_of(simulation).items()}


def scores_of(estimate: Estimate, sizes: Mapping[str, float]) -> Scores:
    """Score a fitted model.

    The errors of a channel are normal, or Laplace where the loss is not that of squares, of a size that is estimated
    too (concentrated likelihood): a noise floor that a model never reaches would make every difference decisive.
    """
    laplace = estimate.problem.estimation.loss != "squares"
    told = {name: item for name, item in errors_of(estimate.simulation).items() if name in sizes}
    spread = {name: _spread(item.train, laplace) for name, item in told.items()}
    log_likelihood = sum(_log_likelihood(item.train, spread[name], sizes[name], laplace) for name, item in told.items())
    unseen = {name: item.unseen for name, item in told.items() if item.unseen.size}
    held_out = sum(
        _log_likelihood(errors, spread[name], sizes[name] * errors.size / told[name].train.size, laplace)
        for name, errors in unseen.items()
    )
    count, total = len(estimate.parameters) + len(told), sum(sizes[name] for name in told)
    spare = total - count - 1
    return Scores(
        parameters=count,
        log_likelihood=log_likelihood,
        aicc=-2.0 * log_likelihood + 2.0 * count * total / spare if spare > 0 else np.inf,
        bic=-2.0 * log_likelihood + count * float(np.log(total)),
        held_out=held_out if unseen else None,
    )


@dataclass(frozen=True)
class Densities:
    """Log densities of samples that were held out; their sum is the held-out log-likelihood."""

    values: FloatArray
    """(samples,) each times the share of a sample that is independent; 0 where a sample is missing."""
    correlated: bool


def held_out_densities(estimate: Estimate, sizes: Mapping[str, float]) -> tuple[Densities, ...]:
    """Return the log densities of recordings, summed over channels, and of static points by kind."""
    laplace = estimate.problem.estimation.loss != "squares"
    found: list[Densities] = []
    for name, item in errors_of(estimate.simulation).items():
        if name not in sizes or not item.unseen.size:
            continue
        density = _log_density(np.concatenate(item.unseen_series), _spread(item.train, laplace), laplace)
        values = np.where(np.isfinite(density), density, 0.0) * sizes[name] / item.train.size
        found.append(Densities(values, item.correlated))
    channels = [item.values for item in found if item.correlated]
    points = [item for item in found if not item.correlated]
    return (*([Densities(np.sum(channels, axis=0), True)] if channels else []), *points)


def _spread(errors: FloatArray, laplace: bool) -> float:
    size = float(np.mean(np.abs(errors))) if laplace else float(np.sqrt(np.mean(errors**2)))
    return max(size, 1e-300)


def _log_likelihood(errors: FloatArray, spread: float, independent: float, laplace: bool) -> float:
    """Return the mean log density of errors times the number of independent ones."""
    return independent * float(np.mean(_log_density(errors, spread, laplace)))


def _log_density(errors: FloatArray, spread: float, laplace: bool) -> FloatArray:
    if laplace:
        return -np.log(2.0 * spread) - np.abs(errors) / spread
    return -0.5 * np.log(2.0 * np.pi) - np.log(spread) - 0.5 * (errors / spread) ** 2
