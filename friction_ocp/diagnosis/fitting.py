"""Fits of the models that compete: the base model from its guesses, a candidate from the base model's answer."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from friction_ocp.diagnosis.contrast import Contrast, contrast
from friction_ocp.diagnosis.footing import Footing, footing
from friction_ocp.diagnosis.linear import LinearProgram, linear_program
from friction_ocp.drive.parts import Drive
from friction_ocp.effects.effect import Augmentation
from friction_ocp.estimation.fit import fit
from friction_ocp.estimation.gauss_newton import Tolerances, solve_gauss_newton
from friction_ocp.estimation.model import Model, with_drive
from friction_ocp.estimation.program import Point, Program
from friction_ocp.estimation.score import solve_nodes
from friction_ocp.estimation.stages import WIDTHS, mean_error, predictions, relaxed
from friction_ocp.simulation.grid import FloatArray
from friction_ocp.simulation.losses import Absolute, Squares

COARSE = Tolerances(decrease=1e-3, progress=1e-2, max_iterations=12)
QUICK = Tolerances(decrease=1e-4, negligible=0.1, progress=1e-3, max_iterations=5)
WARM = Tolerances(decrease=1e-6, negligible=0.01, progress=1e-4, max_iterations=40)
BLUNT = 0.2
"""Rounding of the absolute loss over the mean error while models compete: kinks would catch a refit of a few steps."""
FARTHER = 5.0
FOLD = Tolerances(decrease=1e-5, negligible=0.1, progress=1e-3, max_iterations=8)
STEPS_FROM_HELD_OUT = 3
MOST_FOLDS = 4
"""Groups of recordings that free runs are fitted without, one after another."""
SHRINK = 0.01
"""Share of the information of a left-out recording that is kept: where nothing else informs, a step stays small."""


@dataclass(frozen=True)
class FittedModel:
    """A model at its best parameters on a footing."""

    model: Model
    footing: Footing
    linear: LinearProgram

    @property
    def theta(self) -> FloatArray:
        """(parameters,)."""
        return self.linear.point.theta

    @property
    def values(self) -> dict[str, float]:
        """Fitted values by name."""
        return dict(zip(self.model.space.names, map(float, self.theta), strict=True))

    @property
    def objective(self) -> float:
        """The cost of all residuals: half their sum of squares, or what the loss makes of them."""
        return self.linear.program.objective(self.linear.point)


def fit_base(model: Model) -> FittedModel:
    """Fit the base model from its guesses and lay the footing on which all models are compared."""
    rough = footing(model, model.space.guess)
    if rough.segment_s is None:
        fitted = fit(model)
        theta = fitted.solution.point.theta
        loss = fitted.program.loss
        if isinstance(loss, Absolute):
            loss = Absolute(BLUNT * mean_error(fitted.program, fitted.solution.point))
        return polished(model, footing(model, theta, loss), theta, None)
    program, end = _rough_answer(model)
    foot = footing(model, end.theta)
    exact = foot.program(model, program.experiments)
    nodes = exact.point_along(program, end).nodes
    return polished(model, foot, end.theta, nodes if foot.train is program.experiments else None)


def _rough_answer(model: Model) -> tuple[Program, Point]:
    """Fit on loosely joined segments, from the guesses and from short predictions."""
    short = predictions(model, model.train, WIDTHS[0])
    start = Point(model.space.guess, short.suggested_nodes(model.space.guess))
    starts = [model.space.guess, solve_gauss_newton(short, start, COARSE).point.theta]
    program = relaxed(model, model.train, 0.0, Squares())
    ends = [solve_gauss_newton(program, Point(theta, program.suggested_nodes(theta)), COARSE) for theta in starts]
    return program, min(ends, key=lambda end: end.objective).point


def polished(
    model: Model,
    foot: Footing,
    theta: FloatArray,
    nodes: tuple[FloatArray, ...] | None,
    limits: Tolerances = WARM,
) -> FittedModel:
    """Minimise the likelihood on the footing from a start."""
    program = foot.training(model)
    theta = model.space.clip(theta)
    point = Point(theta, program.suggested_nodes(theta) if nodes is None else nodes)
    if nodes is None:
        point = solve_nodes(program, point)
    end = solve_gauss_newton(program, point, limits).point if theta.size else solve_nodes(program, point)
    return FittedModel(model, foot, linear_program(program, end))


def quick_refit(base: FittedModel, drive: Drive, starts: Sequence[Mapping[str, float]]) -> FittedModel:
    """Fit a candidate drive, a few steps from each start: the base model's answer and predicted values of the rest."""
    model, built = with_drive(base.model, drive), contrast(base.model, base.linear, drive)
    return min((_quick(base, model, built, values) for values in starts), key=lambda fitted: fitted.objective)


def farther(values: Mapping[str, float], augmentation: Augmentation) -> dict[str, float]:
    """Return a start several times as far from off as predicted: under a large misfit predictions fall short."""
    grown = {path for trial in augmentation.trials for amplitude in trial.amplitudes for path in amplitude}
    inverse = any(trial.inverse for trial in augmentation.trials)
    found = dict(values)
    for path in grown & found.keys():
        off = augmentation.off.get(path, 0.0)
        found[path] = found[path] / FARTHER if inverse else off + FARTHER * (found[path] - off)
    return found


def completed(fitted: FittedModel) -> FittedModel:
    """Continue a refit to its end.

    Free runs have local minima that a few steps from the base model's answer do not leave: they are fitted as the base
    model was, from there.
    """
    if fitted.footing.segment_s is None and fitted.theta.size:
        model = fitted.model
        theta = fit(replace(model, space=model.space.moved(fitted.theta))).solution.point.theta
        thorough = polished(model, fitted.footing, theta, None)
        return min(thorough, fitted, key=lambda item: item.objective)
    return polished(fitted.model, fitted.footing, fitted.theta, fitted.linear.point.nodes)


def _quick(base: FittedModel, model: Model, built: Contrast, values: Mapping[str, float]) -> FittedModel:
    wanted = built.theta(values)
    by_name = dict(zip(built.space.names, wanted, strict=True))
    theta = np.array([by_name[name] for name in model.space.names])
    theta = model.space.clip(theta)
    known = {name: value for name, value in zip(model.space.names, theta, strict=True)}
    at = np.array([known[name] for name in built.space.names])
    nodes = tuple(built.simulate(k, item, at)[2] for k, item in enumerate(base.linear.recordings))
    if not all(np.all(np.isfinite(item)) for item in nodes):
        return polished(model, base.footing, theta, None, QUICK)
    return polished(model, base.footing, theta, nodes, QUICK)


def without_addition(current: FittedModel, drive: Drive) -> FittedModel:
    """Fit a drive that lacks something that the current model has."""
    model = with_drive(current.model, drive)
    known = current.values
    theta = np.array([known.get(name, model.space.guess[k]) for k, name in enumerate(model.space.names)])
    return polished(model, current.footing, theta, None)


def held_out(fitted: FittedModel) -> FloatArray:
    """Return (rows,) costs of every recording under parameters that it took no part in; its states are its own.

    Where short segments make the program nearly linear, the parameters without a recording are one Gauss-Newton step
    from those with all of them; free runs are fitted again without it.
    """
    if fitted.footing.segment_s is None:
        return _held_out_free_runs(fitted)
    rows, count = fitted.linear.rows, len(fitted.linear.recordings)
    prior = rows.jacobian[rows.recording < 0]
    hessians = [item.jacobian.T @ item.jacobian for item in fitted.linear.recordings]
    gradients = [item.jacobian.T @ item.residual for item in fitted.linear.recordings]
    costs: list[FloatArray] = []
    for k, item in enumerate(fitted.linear.recordings):
        rest = sum((hessians[j] for j in range(count) if j != k), prior.T @ prior) + SHRINK * hessians[k]
        theta = fitted.model.space.clip(fitted.theta + _solve(rest, gradients[k]))
        program = _only(fitted.linear.program, k)
        nodes = item.nodes + item.moved_by(theta - fitted.theta)
        point = solve_nodes(program, Point(theta, (nodes,)), STEPS_FROM_HELD_OUT)
        costs.append(raw_costs(program, point))
    return np.concatenate([*costs, np.zeros(rows.residual.size - sum(cost.size for cost in costs))])


def _held_out_free_runs(fitted: FittedModel) -> FloatArray:
    program, point = fitted.linear.program, fitted.linear.point
    count = len(program.experiments)
    groups = _folds(fitted)
    costs: dict[int, FloatArray] = {}
    for group in groups:
        others = [k for k in range(count) if k not in group]
        rest = replace(
            program,
            experiments=tuple(program.experiments[k] for k in others),
            segments=tuple(program.segments[k] for k in others),
        )
        start = Point(point.theta, tuple(point.nodes[k] for k in others))
        theta = solve_gauss_newton(rest, start, FOLD).point.theta if others else point.theta
        for k in group:
            alone = _only(program, k)
            costs[k] = raw_costs(alone, solve_nodes(alone, Point(theta, (point.nodes[k],)), STEPS_FROM_HELD_OUT))
    found = [costs[k] for k in range(count)]
    return np.concatenate([*found, np.zeros(fitted.linear.rows.residual.size - sum(cost.size for cost in found))])


def _folds(fitted: FittedModel) -> list[list[int]]:
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
    return replace(program, experiments=(program.experiments[index],), segments=(program.segments[index],))


def raw_costs(program: Program, point: Point) -> FloatArray:
    """Return (rows,) half the squares of all residuals of a program of one recording, in the order of `Rows`."""
    result = program.simulate(0, point)
    item, cut, nodes = program.experiments[0], program.segments[0], point.nodes[0]
    errors = np.where(np.isfinite(item.measured), program.residuals(0, result.y), 0.0)
    parts: list[FloatArray] = []
    if cut.gap_weight is not None and cut.count > 1:
        parts.append(np.einsum("kij,kj->ki", cut.gap_weight, result.end[:-1] - nodes[1:]).ravel())
    if cut.start_weight is not None:
        suggested, _ = program.measured_states(item, point.theta, cut.first[cut.tied])
        parts.append((cut.start_weight[cut.tied] * (nodes[cut.tied] - suggested)).ravel())
    return np.concatenate([program.loss.cost(errors).ravel(), *(0.5 * part**2 for part in parts)])


def _solve(hessian: FloatArray, gradient: FloatArray) -> FloatArray:
    """Solve with directions left alone that the other recordings say nothing about."""
    scale = np.sqrt(np.maximum(np.diag(hessian), 1e-300))
    values, vectors = np.linalg.eigh(hessian / np.outer(scale, scale))
    told = values > 1e-8
    along = vectors.T @ (gradient / scale)
    return (vectors[:, told] @ (along[told] / values[told])) / scale
