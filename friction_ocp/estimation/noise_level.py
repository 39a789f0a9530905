"""Torque noise of the shafts by maximum likelihood, the parameters and the noise floors of the channels given.

The relaxed program is linearised once with a node at every sample. Its states are then normal, and integrating them out
leaves the innovation likelihood of a Kalman filter along the fitted motion, as a function of the levels alone.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy.optimize as _optimize  # pyright: ignore[reportMissingTypeStubs]

from friction_ocp.estimation.elimination import halved
from friction_ocp.estimation.experiment import Experiment
from friction_ocp.estimation.gap import RELATIVE_GAP
from friction_ocp.estimation.model import Model
from friction_ocp.estimation.noise import LevelWord, NoiseLevel
from friction_ocp.estimation.program import Point, Program
from friction_ocp.estimation.stages import cuts, relaxed
from friction_ocp.estimation.torque_noise import acceleration_noise, torque_covariance
from friction_ocp.simulation.grid import FloatArray
from friction_ocp.simulation.losses import Squares

optimize: Any = _optimize  # its own types are incomplete

STIFF_GAP = 1e-9
"""Standard deviation, over its typical size, of what a state without torque noise may move from sample to sample."""
DECADES = 4.0
"""How far a level is looked for on either side of where the search starts."""
AT_END = 0.05
"""Distance from the end of that range, in decades, at which a level counts as not found inside."""
CURVED = 0.1
"""Step in the logarithm of a level over which the curvature of the likelihood is taken."""
REACH95 = 1.959964


@dataclass(frozen=True)
class _Chain:
    """One recording as a linear chain of states about the fitted motion."""

    item: Experiment
    spans: FloatArray
    """(n - 1,) s between nodes."""
    own: FloatArray
    """(n, states, states) information of samples and priors on each node."""
    pull: FloatArray
    """(n, states) gradient of the same."""
    advance: FloatArray
    """(n - 1, states, states) derivative of a node by the one before."""
    jump: FloatArray
    """(n - 1, states) predicted minus fitted state."""
    per_level: Mapping[str, FloatArray]
    """By shaft (groups,): density of the acceleration noise for a level of one."""


@dataclass(frozen=True)
class Likelihood:
    """Negative log-likelihood of the levels of some shafts."""

    model: Model
    chains: tuple[_Chain, ...]
    known: Mapping[str, float]
    shafts: tuple[str, ...]

    def __call__(self, logarithms: Sequence[float] | FloatArray) -> float:
        """Return it at natural logarithms of the levels."""
        levels = {**self.known, **dict(zip(self.shafts, np.exp(np.asarray(logarithms)), strict=True))}
        return sum(_chain_cost(chain, self._inverse_covariance(chain, levels)) for chain in self.chains)

    def _inverse_covariance(self, chain: _Chain, levels: Mapping[str, float]) -> FloatArray:
        power = np.sum([(level * chain.per_level[shaft]) ** 2 for shaft, level in levels.items()], axis=0)
        noise = np.asarray(np.sqrt(power), dtype=np.float64)
        still = np.diag((STIFF_GAP * self.model.state_scale) ** 2)
        covariance = torque_covariance(self.model.drive.mechanism, still, noise, chain.spans)
        return np.asarray(np.linalg.inv(covariance), dtype=np.float64)


def likelihood(model: Model, program: Program, point: Point) -> Likelihood:
    """Return the likelihood of the levels that a problem asks for, along a fitted motion."""
    options = model.problem.estimation
    known = {name: level for name, level in options.process_noise.items() if name not in options.estimated_noise}
    chains = tuple(_chain(model, program, point, index) for index in range(len(program.experiments)))
    return Likelihood(model, chains, known, options.estimated_noise)


def _chain(model: Model, program: Program, point: Point, index: int) -> _Chain:
    """Linearise one recording about its fitted motion, a node at every sample."""
    item = program.experiments[index]
    options = replace(model.problem.estimation, segment=1, initial_state="estimated")
    fine = replace(model, problem=replace(model.problem, estimation=options), space=program.space)
    joined = relaxed(fine, (item,), 0.0, Squares())
    cut = joined.segments[0]
    assert cut.gap_weight is not None
    apart = replace(joined, segments=(replace(cut, gap_weight=np.zeros_like(cut.gap_weight)),))
    one = replace(program, experiments=(item,), segments=(program.segments[index],))
    at = apart.point_along(one, Point(point.theta, (point.nodes[index],)))
    blocks = apart.linearise(at).blocks[0]
    swept = apart.simulate(0, at, derivatives=True)
    assert swept.dend is not None
    states = at.nodes[0].shape[1]
    mech, numbers = model.drive.mechanism, model.space.numbers(point.theta, item.name)
    shafts = {*model.process_noise, *model.problem.estimation.estimated_noise}
    return _Chain(
        item,
        np.diff(item.grid.time[cut.first])[:-1],
        blocks.node_node,
        blocks.node_gradient,
        swept.dend[:-1, :, :states],
        swept.end[:-1] - at.nodes[0][1:],
        {shaft: acceleration_noise(mech, {shaft: 1.0}, numbers) for shaft in shafts},
    )


def _chain_cost(chain: _Chain, weight: FloatArray) -> float:
    """Return the negative log-likelihood of a chain whose jumps have the inverse covariances `weight`."""
    forward = chain.advance.transpose(0, 2, 1) @ weight
    diagonal, gradient = chain.own.copy(), chain.pull.copy()
    diagonal[:-1] += forward @ chain.advance
    diagonal[1:] += weight
    gradient[:-1] += np.einsum("kij,kj->ki", forward, chain.jump)
    gradient[1:] -= np.einsum("kij,kj->ki", weight, chain.jump)
    squares = float(np.einsum("ki,kij,kj->", chain.jump, weight, chain.jump))
    determinant, gained = _reduced(diagonal, -forward, gradient)
    return 0.5 * (squares - gained + determinant - float(np.sum(np.linalg.slogdet(weight)[1])))


def _reduced(diagonal: FloatArray, upper: FloatArray, right: FloatArray) -> tuple[float, float]:
    """Return log det H and right' H^-1 right of a symmetric positive block-tridiagonal H by cyclic reduction.

    `diagonal` (n, s, s), `upper` (n - 1, s, s) right of the diagonal, `right` (n, s).
    """
    determinant, gained, right = 0.0, 0.0, right[:, :, None]
    while len(diagonal) > 1:
        half = halved(diagonal, upper, right)
        determinant += float(np.sum(np.linalg.slogdet(diagonal[1::2])[1]))
        gained += float(np.sum(right[1::2] * half.alone))
        diagonal, upper, right = 0.5 * (half.diagonal + half.diagonal.transpose(0, 2, 1)), half.upper, half.right
    last = np.asarray(np.linalg.solve(diagonal[0], right[0]), dtype=np.float64)
    return determinant + float(np.linalg.slogdet(diagonal[0])[1]), gained + float(np.sum(right[0] * last))


def most_likely(model: Model, program: Program, point: Point) -> tuple[NoiseLevel, ...]:
    """Return the levels that a problem asks for, at the parameters and along the motion of a fit."""
    found = likelihood(model, program, point)
    start = np.log([starting_level(model, shaft) for shaft in found.shafts])
    reach = DECADES * np.log(10.0)
    ends = _searched(found, start, reach)
    curvature = _curvature(found, ends)
    told, spread = _spread(curvature)
    at_end = np.abs(ends - start) > reach - AT_END * np.log(10.0)
    return tuple(
        _level(model, shaft, float(np.exp(ends[k])), float(spread[k]), bool(at_end[k]), bool(told[k]))
        for k, shaft in enumerate(found.shafts)
    )


def _searched(found: Likelihood, start: FloatArray, reach: float) -> FloatArray:
    """Return the most likely logarithms: one level at a time until none moves, as they hardly depend on each other."""
    at = start.copy()
    for _ in range(1 if at.size == 1 else 6):
        before = at.copy()
        for k in range(at.size):

            def cost(value: float, k: int = k) -> float:
                return found(np.concatenate([at[:k], [value], at[k + 1 :]]))

            bounds = (start[k] - reach, start[k] + reach)
            at[k] = float(optimize.minimize_scalar(cost, bounds=bounds, method="bounded", options={"xatol": 1e-3}).x)
        if np.max(np.abs(at - before)) < 1e-2:
            break
    return at


def _curvature(found: Likelihood, at: FloatArray) -> FloatArray:
    """Return the Hessian of the cost by central differences."""
    count = at.size
    steps = CURVED * np.eye(count)
    middle = found(at)
    hessian = np.zeros((count, count))
    for j in range(count):
        hessian[j, j] = (found(at + steps[j]) - 2.0 * middle + found(at - steps[j])) / CURVED**2
        for k in range(j):
            mixed = [found(at + a * steps[j] + b * steps[k]) * a * b for a in (1, -1) for b in (1, -1)]
            hessian[j, k] = hessian[k, j] = sum(mixed) / (4.0 * CURVED**2)
    return hessian


def _spread(curvature: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return of which logarithms the likelihood tells the value, and their standard errors."""
    values, vectors = np.linalg.eigh(curvature)
    lost = values < 1.0 / (np.log(10.0) * DECADES) ** 2
    variances = (vectors**2) @ np.where(lost, 0.0, 1.0 / np.where(lost, 1.0, values))
    told = (vectors**2) @ lost < 0.1
    return told, np.where(told, np.sqrt(variances), np.nan)


def _level(model: Model, shaft: str, value: float, spread: float, at_end: bool, told: bool) -> NoiseLevel:
    unit = "N/sqrt(Hz)" if model.problem.drive.shaft(shaft).motion == "linear" else "N m/sqrt(Hz)"
    if at_end or not told:
        word: LevelWord = "at_bound" if at_end else "not_identifiable"
        return NoiseLevel(shaft, value, np.nan, (np.nan, np.nan), word, unit)
    ends = (value * float(np.exp(-REACH95 * spread)), value * float(np.exp(REACH95 * spread)))
    return NoiseLevel(shaft, value, value * spread, ends, "ok", unit)


def starting_level(model: Model, shaft: str) -> float:
    """Return the level found or stated as a guess, else one whose gaps are what they are where no noise is stated."""
    stated = model.process_noise.get(shaft)
    if stated:
        return stated
    mech = model.drive.mechanism
    group = mech.topology.group_of[shaft]
    item = model.train[0]
    numbers = model.space.numbers(model.nominal, item.name)
    per_unit = acceleration_noise(mech, {shaft: 1.0}, numbers)[group]
    span = float(np.mean(np.diff(item.grid.time[cuts(item, model.problem.estimation.samples)])))
    column = len(mech.angle_groups) + list(mech.free_groups).index(group)
    return float(RELATIVE_GAP * model.state_scale[column] / (per_unit * np.sqrt(span)))


def with_levels(model: Model, levels: Sequence[NoiseLevel]) -> Model:
    """Return a model whose gaps are weighted by these levels."""
    return replace(model, noise_levels=tuple(levels))
