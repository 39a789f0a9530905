"""What recordings cost under parameters that they took no part in."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from friction_ocp.diagnosis.fitted_model import FittedModel
from friction_ocp.diagnosis.own_noise import gap_prices, with_own_noise
from friction_ocp.estimation.around_kinks import around_kinks
from friction_ocp.estimation.gauss_newton import Tolerances, solve_gauss_newton
from friction_ocp.estimation.node_ends import STEPS_OF_NODES, UNIMPORTANT
from friction_ocp.estimation.nodes import solve_nodes
from friction_ocp.estimation.program import Point, Program, Tether
from friction_ocp.estimation.quadratic import bounded_step
from friction_ocp.simulation.grid import BoolArray, FloatArray

FOLD = Tolerances(decrease=1e-5, negligible=0.1, progress=1e-3, max_iterations=8)
MOST_FOLDS = 4
"""Groups of recordings that free runs are fitted without, one after another."""
NEARLY = 0.3
"""What a step gains may differ from what it predicts by this share of the prediction and is believed."""
UNTOLD = 1e-8
"""Information added to that of each parameter, as a share of it: a direction that nothing informs stays where it is."""
BROKEN = 1e6
"""Least cost of a row where the simulation of a recording left out has broken down: an error of 1400 floors."""
RUN_AWAY = 1e12
"""Cost of a row from which its simulation has run away, an error of a million floors: beside it nothing would count."""
SHRINK = 0.01
"""Share of the information of a left-out recording that is kept: where nothing else informs, parameters stay near.

Of a recording that the model is far from, that is the share of what it can inform of: its errors are no noise, and as a
likelihood reads them they tell as much less as their power is larger.
"""


def held_out(fitted: FittedModel) -> FloatArray:
    """Return (rows,) costs of every recording under parameters that it took no part in; its states are its own.

    Where the program is nearly linear, the parameters without some recordings are one Gauss-Newton step from those with
    all of them; where that step does not gain what it predicts, they are fitted.
    """
    program = fitted.linear.program
    costs: dict[int, FloatArray] = {}
    own = ["@" in name for name in fitted.model.space.names]
    for group in folds(fitted):
        theta = fitted_without(fitted, group)
        for k in group:
            item = fitted.linear.recordings[k]
            alone, (wider,) = with_own_noise(_only(program, k), fitted.model, fitted.footing, theta)
            nodes = item.nodes + item.moved_by(np.where(own, 0.0, theta - fitted.theta))
            point = solve_nodes(alone, Point(theta, (nodes,)), STEPS_OF_NODES)
            prices = gap_prices(item, alone.segments[0], wider)
            costs[k] = told(raw_costs(alone, point, prices))
    found = [costs[k] for k in range(len(program.experiments))]
    found += [_held_out_points(fitted, k) for k in range(len(program.static))]
    return np.concatenate([*found, np.zeros(fitted.linear.rows.residual.size - sum(cost.size for cost in found))])


def _held_out_points(fitted: FittedModel, index: int) -> FloatArray:
    """Return (points,) costs of static points under parameters that every fourth of them took no part in.

    Static points are nearly linear in the parameters: one step.
    """
    program, rows = fitted.linear.program, fitted.linear.rows
    term, own = program.static[index], np.flatnonzero(rows.recording == len(program.experiments) + index)
    costs = np.zeros(own.size)
    for part in range(MOST_FOLDS):
        at = np.arange(own.size) % MOST_FOLDS == part
        left = np.isin(np.arange(rows.residual.size), own[at])
        step = _step_without(fitted, left, _kept(fitted, left))[0] if fitted.theta.size else np.zeros(0)
        errors, _ = term.residuals(fitted.model.space, fitted.theta + step)
        costs[at] = 0.5 * errors[at] ** 2
    return costs


def _kept(fitted: FittedModel, left: BoolArray) -> FloatArray:
    """Return (parameters, parameters) information that is kept of rows that are left out."""
    rows = fitted.linear.rows
    jacobian, residual = rows.jacobian[left], rows.residual[left]
    power = float(np.mean(residual[residual != 0.0] ** 2)) if np.any(residual) else 1.0
    return SHRINK / max(power, 1.0) * jacobian.T @ jacobian


def _step_without(fitted: FittedModel, left: BoolArray, kept: FloatArray) -> tuple[FloatArray, float]:
    """Return the step of the parameters that leaves some rows out, and what it is predicted to gain on the others.

    `kept` is the information that is kept of those rows.
    """
    rows, others = fitted.linear.rows, ~left
    information = rows.jacobian[others].T @ rows.jacobian[others] + kept
    pull = rows.jacobian[others].T @ rows.residual[others]
    information[np.diag_indices_from(information)] *= 1.0 + UNTOLD
    space, none = fitted.model.space, (np.zeros((0, pull.size)), np.zeros(0))
    step = bounded_step(information, pull, space.lower - fitted.theta, space.upper - fitted.theta, *none)
    return step, -float(pull @ step) - 0.5 * float(step @ information @ step)


def fitted_without(fitted: FittedModel, group: Sequence[int]) -> FloatArray:
    """Return the parameters fitted to all recordings but some; what each of these has for itself, to that alone."""
    items, theta = fitted.linear.program.experiments, _shared_without(fitted, group)
    there = {item.name for k, item in enumerate(items) if k not in group}
    for name in dict.fromkeys(items[k].name for k in group):
        own = np.array([path.partition("@")[2] == name for path in fitted.model.space.names], dtype=bool)
        if name not in there and np.any(own):
            theta = _own_of(fitted, [k for k in group if items[k].name == name], theta, own)
    return theta


def _own_of(fitted: FittedModel, group: Sequence[int], theta: FloatArray, own: BoolArray) -> FloatArray:
    """Return parameters with those that one recording has for itself fitted to it, from where it had them."""
    space, change = fitted.model.space, np.where(own, 0.0, theta - fitted.theta)
    pinned = replace(space, lower=np.where(own, space.lower, theta), upper=np.where(own, space.upper, theta))
    nodes = tuple(item.nodes + item.moved_by(change) for item in (fitted.linear.recordings[k] for k in group))
    alone = replace(_some(fitted.linear.program, group), space=pinned)
    return solve_gauss_newton(alone, Point(theta, nodes), FOLD).point.theta


def _shared_without(fitted: FittedModel, group: Sequence[int]) -> FloatArray:
    rows, program, point = fitted.linear.rows, fitted.linear.program, fitted.linear.point
    others = [k for k in range(len(program.experiments)) if k not in group]
    if not others or not fitted.theta.size:
        return fitted.theta
    left = np.isin(rows.recording, group)
    kept = _kept(fitted, left)
    step, predicted = _step_without(fitted, left, kept)
    rest = replace(_some(program, others), tether=Tether(fitted.theta, kept))
    before = rest.objective(Point(fitted.theta, tuple(point.nodes[k] for k in others)))
    moved = tuple(fitted.linear.recordings[k].nodes + fitted.linear.recordings[k].moved_by(step) for k in others)
    gained = before - rest.objective(Point(fitted.theta + step, moved))
    if abs(gained - predicted) <= max(UNIMPORTANT, NEARLY * abs(predicted)):
        return fitted.theta + step
    start = Point(fitted.theta, tuple(point.nodes[k] for k in others))
    ended = solve_gauss_newton(rest, start, FOLD)
    if fitted.footing.segment_s is None:
        ended = min(ended, around_kinks(fitted.model, rest, ended.point, FOLD), key=lambda item: item.objective)
    return ended.point.theta


def folds(fitted: FittedModel) -> list[list[int]]:
    """Return the recordings that are left out together.

    Those made under the same conditions, where the problem states different ones (`set`): a model that only fits two
    conditions at once does not carry over to a third. Neighbours otherwise.
    """
    names = [item.name for item in fitted.linear.program.experiments]
    stated = {use.name: tuple(sorted(use.set.items())) for use in fitted.model.problem.train}
    conditions = [stated.get(name, ()) for name in names]
    kinds = sorted(set(conditions))
    if len(kinds) < 2:
        parts = np.array_split(np.arange(len(names)), min(len(names), MOST_FOLDS))
        return [[int(k) for k in part] for part in parts]
    shared = np.array_split(np.arange(len(kinds)), min(len(kinds), MOST_FOLDS))
    return [[k for k, kind in enumerate(conditions) if kinds.index(kind) in part] for part in shared]


def _only(program: Program, index: int) -> Program:
    return _some(program, [index])


def _some(program: Program, indices: Sequence[int]) -> Program:
    """Return the program of some of the recordings."""
    return replace(
        program,
        experiments=tuple(program.experiments[k] for k in indices),
        segments=tuple(program.segments[k] for k in indices),
    )


def raw_costs(program: Program, point: Point, prices: FloatArray) -> FloatArray:
    """Return (rows,) half the squares of all residuals of a program of one recording, in the order of `Rows`.

    `prices` (gaps,) are what the width of a gap costs beside its residuals.
    """
    result = program.simulate(0, point)
    samples = program.loss.cost(program.sample_errors(0, result.y)) + program.lost_costs(0)
    gaps, starts = program.gap_errors(0, point, result.end), program.start_errors(0, point)
    widths = prices[:, None] / gaps.shape[1]
    return np.concatenate([samples.ravel(), (0.5 * gaps**2 + widths).ravel(), 0.5 * starts.ravel() ** 2])


def told(costs: FloatArray) -> FloatArray:
    """Return costs with numbers in the place of those behind a breakdown of the simulation: no smaller than others."""
    known = costs < RUN_AWAY
    return np.where(known, costs, max(BROKEN, float(np.max(costs[known], initial=0.0))))
