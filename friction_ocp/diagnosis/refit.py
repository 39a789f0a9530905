"""Fits that begin at the answer of another model: of a candidate, of the same again, of what is left of additions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from friction_ocp.diagnosis.contrast import Contrast, contrast
from friction_ocp.diagnosis.easing import eased
from friction_ocp.diagnosis.fitted_model import FittedModel
from friction_ocp.diagnosis.kinks import freed
from friction_ocp.diagnosis.led_back import led_back
from friction_ocp.diagnosis.polishing import QUICK, loosely, loosely_joined, polished, timed
from friction_ocp.diagnosis.screen import Screened, Start
from friction_ocp.drive.parts import Drive
from friction_ocp.estimation.model import Model, resolving, with_drive
from friction_ocp.estimation.node_ends import UNIMPORTANT
from friction_ocp.estimation.parameter_space import ParameterSpace
from friction_ocp.estimation.program import Point, Program
from friction_ocp.simulation.grid import FloatArray

SIZES = (1.0, 0.3, 3.0, 10.0)
"""Sizes over the predicted one that are simulated, itself first: under a large misfit predictions fall short."""
NEARLY = 0.01
"""Share of what one model explains by which another falls short of it at most where kinks alone may make that."""
MOST_OF = 0.5
"""Share of a misfit short of which a small effect has not explained it, and a large one is tried."""
NUDGES, NUDGE, CLOSE_BY = 2, 0.05, 1.2
"""Fits that begin again at a time, the relative change of the parameters from which they do, and their objective after
a few steps over the known one up to which they go on."""
ALONG = 0.1
"""The relative change of the parameter that changes most, of those that the recordings tell least about together."""
UNTOLD = 1e-12
"""Share of the most that they tell up to which they tell nothing but rounding."""


def quick_refit(base: FittedModel, item: Screened) -> FittedModel:
    """Fit a candidate, a few steps from each of the starts that the score test predicts.

    The prediction is linear: the size at which a simulation comes closest to the recordings is where steps begin, too.
    Where they gain less than it promises, under a large misfit, wide gaps lead the way from where the parameters were;
    where most of a misfit stays, steps begin at a large effect, too. Of free runs that miss much steps begin where
    loosely joined segments lead, too, and so they always do at large effects that no prediction shows. Where nearly the
    same can be done another way, the end begins there again.
    """
    drive = item.augmentation.drive
    model, built = with_drive(base.model, drive), contrast(base.model, base.linear, drive)
    program = base.footing.training(model)
    points = [point for start in item.starts for point in _launches(base, item, start, model, built, program)]
    ends = [timed(_steps(base, model, program, point), QUICK) for point in points]
    best = min([end.objective for end in ends], default=np.inf)
    if base.astray and base.footing.joined and base.objective - best < item.gain:
        away = [_point(base, model, built, base.values | start.added(item.augmentation.off)) for start in item.starts]
        far = [_steps(base, model, program, eased(program, point, base.missed)) for point in away]
        ends += [timed(end, QUICK) for end in far]
    loose = [start.values(item.augmentation.off, base.values, 1.0) for start in item.starts[:1]] if base.lost else []
    ends += [_led_loosely(base, model, values) for values in loose]
    ends += _outright(base, model, item.augmentation.outright, min([end.objective for end in ends], default=np.inf))
    large, best = item.augmentation.large, min(end.objective for end in ends)
    beyond = base.objective * (1.0 - 1.0 / max(base.missed, 1.0))
    if large is not None and base.objective - best < MOST_OF * beyond:
        tried = [large(start.added(item.augmentation.off)) for start in item.starts]
        ends += [
            _steps(base, model, program, _point(base, model, built, {**base.values, **values})) for values in tried
        ]
    found = min(ends, key=lambda fitted: fitted.objective)
    if item.augmentation.otherwise is None:
        return found
    theta = model.space.with_known({**base.values, **found.values, **item.augmentation.otherwise(found.values)})
    return min(found, timed(polished(model, base.footing, theta, None, QUICK), QUICK), key=lambda end: end.objective)


def fitted_loosely(loose: FittedModel, item: Screened) -> float:
    """Return the objective of a candidate on loosely joined segments, fitted from where its first start is.

    Or from a large effect, where no start shows that.
    """
    model = with_drive(loose.model, item.augmentation.drive)
    added = [start.added(item.augmentation.off) for start in item.starts[:1]]
    added += [dict(values) for values in item.augmentation.outright]
    starts = [model.space.clip(model.space.with_known({**loose.values, **values})) for values in added]
    program, point = loosely_joined(model, starts)
    return program.objective(point)


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


def _outright(
    base: FittedModel, model: Model, begins: Sequence[Mapping[str, float]], known: float
) -> list[FittedModel]:
    """Fit from large effects; the best of them to its end: under a large misfit where it comes closer than is `known`,
    else where it gains half as much.

    A few steps do not lead far where one rattles between flanks, or springs take over from a bristle.
    """
    tried = begins if base.astray else begins[:1]
    ends = [_led_loosely(base, model, {**base.values, **values}) for values in tried]
    if not ends:
        return ends
    best = min(ends, key=lambda end: end.objective)
    half = base.objective - max(MOST_OF * (base.objective - known), UNIMPORTANT)
    return [*ends, completed(best)] if best.objective < (known if base.astray else half) else ends


def _led_loosely(base: FittedModel, model: Model, values: Mapping[str, float]) -> FittedModel:
    return timed(polished(model, base.footing, loosely(model, values), None, QUICK), QUICK)


def _steps(base: FittedModel, model: Model, program: Program, point: Point) -> FittedModel:
    finite = np.isfinite(program.objective(point))
    return polished(model, base.footing, point.theta, point.nodes if finite else None, QUICK)


def completed(fitted: FittedModel, thorough: bool = True) -> FittedModel:
    """Continue a refit to its end, around the kinks of exact friction that catch it.

    On steps that resolve its motion, unless it is far off: where such a fit ends no spring means anything.
    One that is still far from the recordings there lacks more than a way around kinks gives back: unless it is of
    segments and to be `thorough`, or of free runs that loosely joined segments do not lead, it is not freed until it is
    accepted, which most of those are not.
    """
    model = fitted.model if fitted.astray else resolving(fitted.model, fitted.theta)
    ended = timed(polished(model, fitted.footing, fitted.theta, fitted.linear.point.nodes))
    left = ended.astray and ended.footing.segment_s is not None and not thorough
    return ended if ended.leads_loosely or left else freed(ended)


def begun_beside(fitted: FittedModel, nodes: Sequence[FloatArray]) -> FittedModel:
    """Fit again from the node states of another model, if that is better; the same where they are of another kind.

    Exact friction lets every short segment stick or slide, and ends differ by which of them do: two models that say the
    same in other words would seem to be told apart by that.
    """
    begun = with_nodes_of(fitted, nodes)
    if begun is None:
        return fitted
    again = polished(fitted.model, fitted.footing, fitted.theta, begun)
    return again if again.objective < fitted.objective - UNIMPORTANT else fitted


def with_nodes_of(fitted: FittedModel, nodes: Sequence[FloatArray]) -> tuple[FloatArray, ...] | None:
    """Return where segments of a model begin if they do so as those of another; None where they are of another kind.

    What a motor makes of its command stays its own: behind one with an offset it is off by that.
    """
    own = fitted.linear.point.nodes
    if not fitted.footing.joined or [one.shape for one in nodes] != [one.shape for one in own]:
        return None
    drive = fitted.model.drive
    behind = [drive.state_names.index(name) for name in drive.mechanism.following_names]
    begun = tuple(one.copy() for one in nodes)
    for one, known in zip(begun, own, strict=True):
        one[:, behind] = known[:, behind]
    return begun


def levelled(one: FittedModel, other: FittedModel, without: float) -> tuple[FittedModel, FittedModel]:
    """Return two models, the worse begun again from the node states of the better and that from those of what is then.

    The same where one explains notably more of what a model `without` either costs.
    """
    for _ in range(2):
        better, worse = sorted((one, other), key=lambda fitted: fitted.cost)
        if worse.cost - better.cost > NEARLY * (without - better.cost):
            break
        again = begun_beside(worse, better.linear.point.nodes)
        one, other = (again if fitted is worse else fitted for fitted in (one, other))
        if again.cost >= better.cost:
            break
    return one, other


def nudged(fitted: FittedModel, seed: int) -> FittedModel:
    """Fit again from parameters that chance has changed a little.

    Exact friction has kinks, and between them many ends: an answer that is not the best one leaves a torque that no
    effect explains. Free runs of steps cut short tell no more than whether they have gone astray.
    """
    rng = np.random.default_rng(seed)
    return _from_beside(fitted, NUDGE * rng.standard_normal(fitted.theta.size))


def nudged_along(fitted: FittedModel, turn: int) -> FittedModel:
    """Fit again from parameters changed together, in a way about which the recordings tell little; in turn, the least
    first, both ways.

    Two parameters that share an effect, such as dry friction on both sides of a joint, make a valley with kinks across
    it: chance does not lead along it.
    """
    rank, back = divmod(turn, 2)
    ways = untold_ways(fitted)
    if not len(ways):
        return fitted
    return _from_beside(fitted, (-ALONG if back else ALONG) * ways[rank % len(ways)])


def untold_ways(fitted: FittedModel) -> FloatArray:
    """Return (ways, parameters) relative changes of parameters, the largest of each one; least told ones first.

    These are eigenvectors of the information about the parameters with the nodes free, each parameter in units of its
    value. One that is pressed against a bound stays.
    """
    rows = fitted.linear.rows
    relative = np.where(rows.pressed, 0.0, rows.jacobian * fitted.theta)
    told, ways = np.linalg.eigh(relative.T @ relative)
    ways = ways[:, told > UNTOLD * told.max(initial=0.0)].T
    return ways / np.abs(ways).max(axis=1, keepdims=True)


def _from_beside(fitted: FittedModel, change: FloatArray) -> FittedModel:
    """Fit again from relatively changed parameters."""
    end = polished(fitted.model, fitted.footing, fitted.theta * (1.0 + change), None, QUICK)
    near = end.objective < CLOSE_BY * fitted.objective
    if not near and (end.astray or end.footing.segment_s is not None):
        return end
    return freed(polished(end.model, end.footing, end.theta, end.linear.point.nodes))


def guessed(current: FittedModel, stated: ParameterSpace) -> FloatArray:
    """Return the guesses of what the problem states, and what was found of additions to it."""
    guesses = dict(zip(stated.names, map(float, stated.guess), strict=True))
    return current.model.space.clip(current.model.space.with_known(current.values | guesses))


def begun_again(current: FittedModel, stated: ParameterSpace) -> FittedModel:
    """Fit the current model from the guesses: what kinks had caught on the way there may be free from here."""
    end = polished(current.model, current.footing, guessed(current, stated), None)
    return freed(end) if end.objective < CLOSE_BY * current.objective else end


def best_nudged(fitted: FittedModel, seed: int) -> FittedModel:
    """Return the best of a fit and of those from beside it."""
    return min([fitted, *(nudged(fitted, seed + k) for k in range(NUDGES))], key=lambda end: end.objective)


def without_addition(current: FittedModel, drive: Drive) -> FittedModel:
    """Fit a drive that lacks something that the current model has.

    From where its parameters are now and, where that costs more, from where they do what the addition did.
    """
    model = with_drive(current.model, drive)
    fitted = timed(polished(model, current.footing, model.space.with_known(current.values), None))
    back = led_back(current, model) if fitted.objective > current.objective + UNIMPORTANT else None
    if back is not None:
        fitted = min(fitted, timed(polished(model, current.footing, back, None)), key=lambda end: end.objective)
    return fitted if fitted.astray and not current.astray else freed(fitted)
