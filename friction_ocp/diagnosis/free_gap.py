"""How far: the gap of free runs before and after, in units, in noise floors and by regime."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from friction_ocp.diagnosis.excess import DOUBTED
from friction_ocp.diagnosis.fitted_model import FittedModel
from friction_ocp.diagnosis.held_out import fitted_without, folds
from friction_ocp.diagnosis.regimes import REGIMES, regimes
from friction_ocp.estimation.drive_noise import within
from friction_ocp.estimation.horizon import horizon
from friction_ocp.estimation.score import FreeRun, simulate_recordings
from friction_ocp.simulation.grid import BoolArray, FloatArray, IntArray

BLOCKS = 24
RESAMPLES = 1000
OUTGROWN = 1e100
"""Error of an unstable simulation over the noise floor, beyond which it is only this: its square is still a number."""


@dataclass(frozen=True)
class FreeErrors:
    """Squared errors of free runs over their noise floors, in blocks of time."""

    runs: tuple[FreeRun, ...]
    channels: tuple[str, ...]
    floors: FloatArray
    """(channels,)."""
    power: FloatArray
    """(blocks, channels) sum of squared errors over the squared floor."""
    count: FloatArray
    """(blocks, channels) samples."""
    drift: FloatArray
    """(channels,) mean square over the squared floor that torque noise alone may make of free runs, however far."""

    def ratios(self, weight: FloatArray | None = None) -> FloatArray:
        """Return (channels,) mean square error over the squared floor, blocks weighted."""
        drawn = np.ones(len(self.power)) if weight is None else weight
        return (drawn @ self.power) / np.maximum(drawn @ self.count, 1e-300)

    @property
    def lost(self) -> bool:
        """Whether the simulation of some channel is farther from the recordings than their mean value is."""
        return bool(np.any(self.ratios() > np.maximum(self._spread, 1.0)))

    @property
    def drowned(self) -> bool:
        """Whether they are no farther from the recordings than torque noise alone may take them, or than these vary."""
        return self.excess() <= float(np.mean(np.fmin(self.drift, self._spread)))

    @property
    def _spread(self) -> FloatArray:
        """(channels,) variance of the recordings over the squared floor."""
        return np.nanvar(np.concatenate([run.measured for run in self.runs]), axis=0) / self.floors**2

    def excess(self, weight: FloatArray | None = None) -> float:
        """Return E, the mean over channels of max(0, rms^2 / floor^2 - 1)."""
        return excess_of(self.ratios(weight))


def excess_of(ratios: FloatArray) -> float:
    """Return E of (channels,) mean square errors over the squared floor."""
    return float(np.mean(np.maximum(ratios - 1.0, 0.0)))


def free_errors(fitted: FittedModel, held_out: bool) -> FreeErrors:
    """Simulate training recordings freely, or `held_out` ones: of validation, or training without a part in the fit."""
    model = fitted.model
    if held_out and not model.validation:
        return left_out_errors(fitted)
    items = model.validation if held_out else model.train
    return _errors(fitted, simulate_recordings(model, items, fitted.theta))


def left_out_errors(fitted: FittedModel, known: Sequence[FloatArray] | None = None) -> FreeErrors:
    """Simulate training recordings, or pieces of the only one, freely with parameters that they took no part in.

    These may be `known`, by fold.
    """
    groups, items = folds(fitted), fitted.footing.training_items(fitted.model)
    runs = list[FreeRun]()
    thetas = [fitted_without(fitted, group) for group in groups] if known is None else known
    for group, theta in zip(groups, thetas, strict=True):
        runs += simulate_recordings(fitted.model, tuple(items[k] for k in group), theta)
    return _errors(fitted, tuple(runs))


def _errors(fitted: FittedModel, runs: tuple[FreeRun, ...]) -> FreeErrors:
    model, floors = fitted.model, fitted.model.noise
    power: list[FloatArray] = []
    count: list[FloatArray] = []
    for run in runs:
        scaled = np.clip((run.simulated - run.measured) / floors, -OUTGROWN, OUTGROWN) ** 2
        seen = np.isfinite(scaled)
        edges = np.linspace(0, run.time.size, BLOCKS + 1).astype(int)[:-1]
        power.append(np.add.reduceat(np.where(seen, scaled, 0.0), edges, axis=0))
        count.append(np.add.reduceat(seen.astype(float), edges, axis=0))
    drift = _drift(fitted, runs)
    return FreeErrors(runs, model.drive.output_names, floors, np.concatenate(power), np.concatenate(count), drift)


def _drift(fitted: FittedModel, runs: tuple[FreeRun, ...]) -> FloatArray:
    """Return (channels,) the mean variance that torque noise adds to free runs, over the squared floors.

    About a typical motion, where nothing but drag takes it away again.
    """
    model, foot, span = fitted.model, fitted.footing, horizon(fitted.model)
    if not any(foot.density.values()):
        return np.zeros(model.noise.size)
    length = float(np.mean([run.time[-1] - run.time[0] for run in runs]))
    with np.errstate(over="ignore"):  # what is unstable outgrows all numbers
        return within(model, foot, model.train[0], length if span is None else min(span, length)) / model.noise**2


@dataclass(frozen=True)
class Shrink:
    """Share of the excess error that is closed."""

    overall: float
    interval95: tuple[float, float]
    by_channel: Mapping[str, float]


def shrink(before: FreeErrors, after: FreeErrors, seed: int) -> Shrink:
    """Compare errors over the same windows; the interval is that of a bootstrap over blocks."""
    rng = np.random.default_rng(seed)
    draws = rng.multinomial(len(before.power), np.full(len(before.power), 1.0 / len(before.power)), RESAMPLES)
    shares = [_share(before.excess(draw), after.excess(draw)) for draw in draws.astype(float)]
    low, high = np.quantile(shares, [0.025, 0.975])
    first, then = (np.maximum(item.ratios() - 1.0, 0.0) for item in (before, after))
    by_channel = {name: _share(float(first[k]), float(then[k])) for k, name in enumerate(before.channels)}
    return Shrink(_share(before.excess(), after.excess()), (float(low), float(high)), by_channel)


def comes_closer(before: FreeErrors, after: FreeErrors, seed: int) -> bool:
    """Whether free runs come closer than before, at 95 %, or leave nothing but noise whose size is in doubt."""
    return after.excess() <= DOUBTED - 1.0 or shrink(before, after, seed).interval95[0] > 0.0


def _share(before: float, after: float) -> float:
    return 1.0 - after / before if before > 0 else 0.0


@dataclass(frozen=True)
class Cell:
    """One cell of the gap map, in noise floors."""

    component: str
    channel: str
    recording: str
    regime: str
    before: float
    after: float


def gap_map(base: FittedModel, before: FreeErrors, after: FreeErrors) -> tuple[Cell, ...]:
    """Return rms errors over noise floors by channel, recording and regime, of samples that both models account for.

    A channel that is read earlier loses some.
    """
    cells: list[Cell] = []
    for first, then in zip(before.runs, after.runs, strict=True):
        labels: IntArray = regimes(base.model, first)
        for k, channel in enumerate(base.model.problem.drive.outputs):
            for code, regime in enumerate(REGIMES):
                at = (labels == code) & np.isfinite(first.measured[:, k]) & np.isfinite(then.measured[:, k])
                if np.any(at):
                    sizes = (_rms(run, k, at) / before.floors[k] for run in (first, then))
                    cells.append(Cell(channel.part, channel.name, first.name, regime, *sizes))
    return tuple(cells)


def _rms(run: FreeRun, column: int, at: BoolArray) -> float:
    error: FloatArray = run.simulated[at, column] - run.measured[at, column]
    return float(np.sqrt(np.mean(error**2)))
