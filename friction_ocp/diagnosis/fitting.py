"""Fits of the models that compete: the base model from its guesses, a candidate from the base model's answer."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np

from friction_ocp.diagnosis.contrast import Contrast, contrast
from friction_ocp.diagnosis.easing import FAR, along, eased, finer, missed
from friction_ocp.diagnosis.footing import Footing, footing
from friction_ocp.diagnosis.linear import LinearProgram, linear_program
from friction_ocp.diagnosis.own_noise import with_own_noise
from friction_ocp.diagnosis.screen import Screened, Start
from friction_ocp.diagnosis.standstill import settled
from friction_ocp.drive.parts import Drive
from friction_ocp.errors import Finding, FrictionOcpError
from friction_ocp.estimation.fit import fit
from friction_ocp.estimation.gauss_newton import Solution, Tolerances, solve_gauss_newton
from friction_ocp.estimation.model import Model, in_time, with_drive
from friction_ocp.estimation.nodes import solve_nodes
from friction_ocp.estimation.program import Point, Program
from friction_ocp.estimation.splicing import carried_on, spliced
from friction_ocp.estimation.stages import WIDTHS, mean_error, predictions, relaxed
from friction_ocp.execution.effort import once
from friction_ocp.simulation.grid import FloatArray
from friction_ocp.simulation.losses import Absolute, Squares

COARSE = Tolerances(decrease=1e-3, progress=1e-2, max_iterations=12)
QUICK = Tolerances(decrease=1e-4, negligible=0.1, progress=1e-3, max_iterations=10)
WARM = Tolerances(decrease=1e-6, negligible=0.01, progress=1e-4, max_iterations=40)
BLUNT = 0.2
"""Rounding of the absolute loss over the mean error while models compete: kinks would catch a refit of a few steps."""
SIZES = (1.0, 0.3, 3.0, 10.0)
"""Sizes over the predicted one that are simulated, itself first: under a large misfit predictions fall short."""
DETOURS = (0.02, 0.004, 0.0008, 0.00016)
"""Smoothing of the sign over the typical speed on the way around kinks, and back step by step: in one step, nodes that
wide smoothing has moved are caught at kinks that are not theirs."""
HARDLY = (0.0005, 0.0002)
"""The same for the nodes alone: an accelerometer sees every change of the sign, and wide smoothing leads astray."""
NODE_STEPS = 8
MOST_TURNS = 8
STEPS_OF_NODES = 3
MOST_OF = 0.5
"""Share of a large misfit short of which a small effect has not explained it, and a large one is tried."""
NUDGE, CLOSE_BY = 0.05, 1.2
"""Relative change of the parameters from which a fit begins again, and its objective after a few steps over the known
one up to which it goes on."""
UNIMPORTANT = 1.0
"""Difference of the objective that is not worth a step; half a unit is a standard error."""
NEGLIGIBLE = 0.05
"""The same for one of several steps of the nodes."""
MARGINAL = 1e-3
"""Share of what noise does not explain that is not worth going on for."""


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
    def determined(self) -> int:
        """The number of parameters that lie within their bounds, not at one."""
        low, high = self.model.space.ends(self.theta)
        return int(np.sum(~low & ~high))

    @property
    def objective(self) -> float:
        """The cost of all residuals: half their sum of squares, or what the loss makes of them."""
        return self.linear.program.objective(self.linear.point) + self._unseen

    @property
    def holds(self) -> bool:
        """Whether the simulation does not break down."""
        return bool(np.isfinite(self.objective))

    @property
    def missed(self) -> float:
        """The power of the residuals over that of noise."""
        return missed(self.linear.program, self.linear.point)

    @property
    def astray(self) -> bool:
        """Whether something so large is missing that the parameters that the fit has found say little."""
        return FAR < self.missed < np.inf

    @cached_property
    @once
    def cost(self) -> float:
        """The same with the noise that this model's own inertia would show: what models are compared by."""
        program, wider = with_own_noise(self.linear.program, self.model, self.footing, self.theta)
        point = solve_nodes(program, self.linear.point, STEPS_OF_NODES)
        return program.objective(point) + float(sum(np.sum(part) for part in wider)) + self._unseen

    @property
    def _unseen(self) -> float:
        """What samples that reading late channels earlier lost count for, lest losing them looks like a gain."""
        program = self.linear.program
        return sum(float(np.sum(program.lost_costs(k))) for k in range(len(program.experiments)))


def fit_base(model: Model) -> FittedModel:
    """Fit the base model from its guesses and lay the footing on which all models are compared.

    Raises FrictionOcpError where no simulation of it holds.
    """
    fitted = _fitted_base(model)
    if not fitted.holds:
        where = f"{model.problem.path or model.problem.title}: diagnose"
        what = "the simulation of the model as it stands breaks down along the recordings"
        remedy = "start from other guesses or narrow the bounds"
        raise FrictionOcpError(Finding(where, what, "a model that can be simulated", remedy))
    return fitted


def _fitted_base(model: Model) -> FittedModel:
    rough = footing(model, model.space.guess)
    if rough.segment_s is None and model.problem.estimation.loss == "squares":
        return _free_base(model, rough)
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
    started = polished(model, foot, end.theta, nodes if len(foot.train) == len(program.experiments) else None)
    return freed(timed(_from_rest(_from_afar(started, [model.space.guess, end.theta]))))


def _from_afar(fitted: FittedModel, starts: Sequence[FloatArray]) -> FittedModel:
    """Fit again through wide gaps from some starts where the fit has missed much, on finer segments where needed."""
    if not fitted.astray:
        return fitted
    program, point, factor = fitted.linear.program, fitted.linear.point, fitted.missed
    foot, wide = finer(fitted.model, fitted.footing, starts, factor)
    finely = foot.training(fitted.model)
    begins = [along(finely, program, point), eased(finely, wide, factor)]
    best = solve_gauss_newton(finely, min(begins, key=finely.objective), WARM).point
    return FittedModel(fitted.model, foot, linear_program(finely, best))


def _free_base(model: Model, rough: Footing) -> FittedModel:
    """Fit free runs by squares from the guesses, and from where loosely joined segments lead; the better end counts."""
    starts = [model.space.guess, _rough_answer(model)[1].theta]
    best = min((_coarse(model, rough, theta) for theta in starts), key=lambda end: end.objective)
    foot = footing(model, best.theta)
    return freed(timed(_from_rest(polished(model, foot, best.theta, best.linear.point.nodes))))


def _coarse(model: Model, foot: Footing, theta: FloatArray) -> FittedModel:
    program, theta = foot.training(model), model.space.clip(theta)
    start = solve_nodes(program, Point(theta, program.suggested_nodes(theta)))
    return polished(model, foot, theta, start.nodes, COARSE)


def _from_rest(fitted: FittedModel) -> FittedModel:
    """Fit again from recordings that start at rest, where that costs less."""
    program, point = fitted.linear.program, fitted.linear.point
    resting = settled(program, point)
    if program.objective(resting) >= program.objective(point):
        return fitted
    return polished(fitted.model, fitted.footing, fitted.theta, resting.nodes)


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
    point = begun(program, theta) if nodes is None else Point(theta, nodes)
    if not theta.size:
        return FittedModel(model, foot, linear_program(program, solve_nodes(program, point)))
    end = solve_gauss_newton(program, point, limits)
    return FittedModel(model, foot, linear_program(program, end.point))


def begun(program: Program, theta: FloatArray) -> Point:
    """Return parameters with the nodes that fit them best."""
    point = solve_nodes(program, Point(theta, program.suggested_nodes(theta)))
    return joined(program, settled(program, point))


def joined(program: Program, point: Point) -> Point:
    """Return the point with nodes that go on from where the segments before them end, as long as that leads on."""
    cost = program.objective(point)
    for _ in range(MOST_TURNS):
        trial = solve_nodes(program, carried_on(program, point), STEPS_OF_NODES, NEGLIGIBLE)
        after = program.objective(trial)
        if not after < cost - worthwhile(program, cost):
            break
        point, cost = trial, after
    return point


def worthwhile(program: Program, cost: float) -> float:
    """Return the decrease of a cost that is worth going on for: more than chance, and a share of what is left."""
    return max(UNIMPORTANT, MARGINAL * (cost - 0.5 * program.samples)) if np.isfinite(cost) else UNIMPORTANT


def timed(fitted: FittedModel, limits: Tolerances = WARM) -> FittedModel:
    """Fit again with late channels read as late as they were found to be, until no delay of a whole sample is left."""
    for _ in range(MOST_TURNS):
        nearer = in_time(fitted.model, fitted.theta)
        if nearer is fitted.model:
            break
        fitted = polished(nearer, fitted.footing, fitted.theta, fitted.linear.point.nodes, limits)
    return fitted


def quick_refit(base: FittedModel, item: Screened) -> FittedModel:
    """Fit a candidate, a few steps from each of the starts that the score test predicts.

    The prediction is linear: the size at which a simulation comes closest to the recordings is where steps begin, too.
    Where they gain less than it promises, under a large misfit, wide gaps lead the way from where the parameters were;
    where most of that stays, steps begin at a large effect, too.
    """
    drive = item.augmentation.drive
    model, built = with_drive(base.model, drive), contrast(base.model, base.linear, drive)
    program = base.footing.training(model)
    points = [point for start in item.starts for point in _launches(base, item, start, model, built, program)]
    ends = [timed(_steps(base, model, program, point), QUICK) for point in points]
    best = min(end.objective for end in ends)
    if base.astray and base.footing.segment_s is not None and base.objective - best < item.gain:
        away = [_point(base, model, built, base.values | start.added(item.augmentation.off)) for start in item.starts]
        far = [_steps(base, model, program, eased(program, point, base.missed)) for point in away]
        ends += [timed(end, QUICK) for end in far]
    large, best = item.augmentation.large, min(end.objective for end in ends)
    if base.astray and large is not None and base.objective - best < MOST_OF * base.objective:
        tried = [large(start.added(item.augmentation.off)) for start in item.starts]
        ends += [
            _steps(base, model, program, _point(base, model, built, {**base.values, **values})) for values in tried
        ]
    return min(ends, key=lambda fitted: fitted.objective)


def begun_at_size(base: FittedModel, item: Screened, scale: float) -> FittedModel:
    """Fit a candidate, a few steps from a multiple of its predicted size, all else as it was."""
    drive = item.augmentation.drive
    model, built = with_drive(base.model, drive), contrast(base.model, base.linear, drive)
    values = base.values | item.starts[0].added(item.augmentation.off, scale)
    return _steps(base, model, base.footing.training(model), _point(base, model, built, values))


def _launches(
    base: FittedModel, item: Screened, start: Start, model: Model, built: Contrast, program: Program
) -> list[Point]:
    """Return the point at the predicted size, and the one at the size that comes closest where that is another."""
    off = item.augmentation.off
    points = [_point(base, model, built, start.values(off, base.values, scale)) for scale in SIZES]
    closest = min(range(len(points)), key=lambda k: program.objective(points[k]))
    return [points[k] for k in sorted({0, closest})]


def _point(base: FittedModel, model: Model, built: Contrast, values: Mapping[str, float]) -> Point:
    wanted = dict(zip(built.space.names, built.theta(values), strict=True))
    theta = model.space.clip(np.array([wanted[name] for name in model.space.names]))
    known = dict(zip(model.space.names, theta, strict=True))
    at = np.array([known[name] for name in built.space.names])
    tracks = built.simulate([(k, at) for k in range(len(base.linear.recordings))])
    return Point(theta, tuple(track.nodes for track in tracks))


def _steps(base: FittedModel, model: Model, program: Program, point: Point) -> FittedModel:
    finite = np.isfinite(program.objective(point))
    return polished(model, base.footing, point.theta, point.nodes if finite else None, QUICK)


def completed(fitted: FittedModel, thorough: bool = True) -> FittedModel:
    """Continue a refit to its end, around the kinks of exact friction that catch it.

    One of segments that is still far from the recordings there lacks more than better nodes give back: unless the refit
    is to be `thorough` it is not freed until it is accepted, which most of those are not.
    """
    ended = timed(polished(fitted.model, fitted.footing, fitted.theta, fitted.linear.point.nodes))
    enough = ended.astray and fitted.footing.segment_s is not None and not thorough
    return ended if enough else freed(ended)


def freed(fitted: FittedModel) -> FittedModel:
    """Go on through friction with a smoothed sign, and back; keep what came in where that leads to nothing better.

    A shaft that sticks in the model and slides in truth, or the reverse, is an end whose derivatives show nothing: it
    stays there whatever the parameters are, and looks like a torque that the model lacks.
    """
    if not fitted.theta.size:
        return fitted
    program, point = fitted.linear.program, fitted.linear.point
    beyond = around_kinks(fitted.model, program, point, WARM)
    best = beyond.point if beyond.objective < fitted.objective else point
    best = unstuck(fitted.model, program, best)
    return fitted if best is point else replace(fitted, linear=linear_program(program, best))


def unstuck(model: Model, program: Program, point: Point) -> Point:
    """Return where fresh nodes, or those that friction with a hardly smoothed sign leads to, lead on to in turn."""
    ways: list[Callable[[Program, Point], Point]] = [_fresh, *(partial(_rounded, model, width) for width in HARDLY)]
    idle, cost = 0, program.objective(point)
    for turn in range(MOST_TURNS * len(ways)):
        moved = _with_better(program, point, ways[turn % len(ways)](program, point))
        enough, before = worthwhile(program, cost), cost
        if moved is not point:
            end = solve_gauss_newton(program, moved, WARM)
            point, cost = end.point, end.objective
        idle = idle + 1 if before - cost < enough else 1
        if idle == len(ways):
            break
    return point


def _fresh(program: Program, point: Point) -> Point:
    return begun(program, point.theta)


def _rounded(model: Model, width: float, program: Program, point: Point) -> Point:
    """Return the point with nodes that friction with a hardly smoothed sign leads to."""
    rounded = replace(program, width=width * model.speed_scale)
    return solve_nodes(program, solve_nodes(rounded, point, NODE_STEPS, NEGLIGIBLE), NODE_STEPS, NEGLIGIBLE)


def _with_better(program: Program, point: Point, other: Point) -> Point:
    """Return the point with the better stretches of nodes of another, where that is worth a step."""
    trial = joined(program, solve_nodes(program, spliced(program, point, other), STEPS_OF_NODES, NEGLIGIBLE))
    return trial if program.objective(trial) < program.objective(point) - UNIMPORTANT else point


def nudged(fitted: FittedModel, seed: int) -> FittedModel:
    """Fit again from parameters that chance has changed a little.

    Exact friction has kinks, and between them many ends: an answer that is not the best one leaves a torque that no
    effect explains.
    """
    rng = np.random.default_rng(seed)
    theta = fitted.theta * (1.0 + NUDGE * rng.standard_normal(fitted.theta.size))
    end = polished(fitted.model, fitted.footing, theta, None, QUICK)
    if not end.objective < CLOSE_BY * fitted.objective:
        return end
    return freed(polished(end.model, end.footing, end.theta, end.linear.point.nodes))


def without_addition(current: FittedModel, drive: Drive) -> FittedModel:
    """Fit a drive that lacks something that the current model has."""
    model = with_drive(current.model, drive)
    fitted = timed(polished(model, current.footing, model.space.with_known(current.values), None))
    return fitted if fitted.astray and not current.astray else freed(fitted)


def around_kinks(model: Model, program: Program, point: Point, limits: Tolerances) -> Solution:
    """Solve again from where friction with a smoothed sign leads to, less and less of it."""
    for width in DETOURS:
        rounded = replace(program, width=width * model.speed_scale)
        point = solve_gauss_newton(rounded, point, COARSE).point
    return solve_gauss_newton(program, point, limits)
