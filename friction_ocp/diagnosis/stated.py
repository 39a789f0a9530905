"""Stated values that the recordings contradict: fitted parameters far from where their priors put them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from friction_ocp.diagnosis.benchmark import Benchmark
from friction_ocp.diagnosis.blocks import stats
from friction_ocp.diagnosis.clues import clues_of
from friction_ocp.diagnosis.excess import DOUBTED, Excess
from friction_ocp.diagnosis.fitted_model import FittedModel
from friction_ocp.diagnosis.kinks import freed
from friction_ocp.diagnosis.options import Considered
from friction_ocp.diagnosis.polishing import polished
from friction_ocp.diagnosis.refit import completed, quick_refit
from friction_ocp.diagnosis.rival import Rival, is_another
from friction_ocp.diagnosis.screen import Screened, screen
from friction_ocp.diagnosis.select import Choice, needed, schwarz
from friction_ocp.diagnosis.stated_keys import stated_key
from friction_ocp.drive.parts import Drive
from friction_ocp.drive.topology import topology
from friction_ocp.drive.values import bind_drive, drive_leaves
from friction_ocp.effects.effect import Augmentation, Key
from friction_ocp.effects.registry import effects
from friction_ocp.effects.stated_values import STATED
from friction_ocp.effects.torques import mode_of
from friction_ocp.estimation.drive_noise import input_floor
from friction_ocp.estimation.model import with_drive
from friction_ocp.estimation.torque_noise import driving
from friction_ocp.parameters import Free
from friction_ocp.simulation.grid import FloatArray

CONTRADICTED = 3.0
"""Prior deviations between stated and fitted value beyond which the stated one is wrong."""


@dataclass(frozen=True)
class Contradiction:
    """A part whose stated values do not agree with the recordings."""

    effect: str
    component: str
    names: tuple[str, ...]
    """Parameters that lie too far away."""
    deviations: float
    """The largest distance, in prior deviations."""


def contradictions(fitted: FittedModel, left: Excess, level: float) -> list[Contradiction]:
    """Return what lies beyond the limit in a model that leaves noise, the farthest first, meant to compete or not.

    Where more is `left`, that is a gap, and no distance counts.
    """
    if left.significant(level) or left.ratio > DOUBTED:
        return []
    space = fitted.model.space
    distance = _distance(fitted)
    drive = fitted.model.problem.drive
    found: dict[Key, Contradiction] = {}
    far_away = np.flatnonzero(np.isfinite(space.prior_std) & (distance > CONTRADICTED))
    if _may_attenuate(fitted, left) and not all(_heavier(fitted, int(k)) for k in far_away):
        return []
    for k in far_away:
        name, far = space.names[k], float(distance[k])
        key = stated_key(name.partition("@")[0], drive)
        known = found.get(key, Contradiction(*key, (), 0.0))
        found[key] = replace(known, names=(*known.names, name), deviations=max(known.deviations, far))
    return sorted(found.values(), key=lambda item: -item.deviations)


def _may_attenuate(fitted: FittedModel, left: Excess) -> bool:
    """Whether the noise of measured inputs, which nobody states, is less than it is taken for.

    What a loop makes of counts of an encoder that are not recorded looks like noise, and is none. With gaps laid for so
    much of it, errors of the measured motion attenuate what resists it (Fuller 1987): a rotor looks too light.
    """
    model = fitted.model
    inputs = [channel for _, channel, _ in driving(model.problem.drive, {})]
    stated = all(input_floor(model, channel).source in ("noise_std", "resolution") for channel in inputs)
    return not stated and any(fitted.footing.density.values()) and left.ratio * DOUBTED < 1.0


def _heavier(fitted: FittedModel, k: int) -> bool:
    """Whether a parameter is an inertia or a weight, and more than stated, as attenuation makes none."""
    space = fitted.model.space
    name = space.names[k].partition("@")[0]
    return name.endswith((".inertia", ".gravity.torque")) and bool(space.prior_deviations(fitted.theta)[k] > 0.0)


def _distance(fitted: FittedModel) -> FloatArray:
    """Return (parameters,) prior deviations between fitted and stated values.

    What is stated as the inertia of a shaft may count what hangs by a spring on it, or on a shaft rigidly joined to it,
    or not.
    """
    space, values = fitted.model.space, fitted.values
    distance: FloatArray = np.abs(space.prior_deviations(fitted.theta))
    for k, name in enumerate(space.names):
        hung = _hung(fitted, name)
        distance[k] = min(distance[k], abs(values[name] + hung - space.prior_mean[k]) / space.prior_std[k])
    return distance


def _hung(fitted: FittedModel, name: str) -> float:
    """Return the inertia that hangs by springs on a shaft or on those rigidly joined to it; 0 for other parameters.

    What the others have hung of their own, stated inertia is not counted.
    """
    values, model = fitted.values, fitted.model
    shaft, _, quantity = name.rpartition(".")
    modes = {item.name: values.get(f"{mode_of(item.name)}.inertia") for item in model.problem.drive.shafts}
    if quantity != "inertia" or shaft not in modes or not any(modes.values()):
        return 0.0
    numbers = model.space.numbers_by_path(fitted.theta, model.train[0].name)
    joints = topology(bind_drive(model.problem.drive, numbers))
    alike = [other for other in joints.members(joints.group_of[shaft]) if modes.get(other)]
    ratios = [float(joints.speed_ratio[other] / joints.speed_ratio[shaft]) for other in alike]
    hung = [(modes[other] or 0.0) - (0.0 if other == shaft else _lightened(fitted, other)) for other in alike]
    return sum(part * ratio**2 for part, ratio in zip(hung, ratios, strict=True))


def _lightened(fitted: FittedModel, shaft: str) -> float:
    """Return by how much a shaft is lighter than it was stated to be before it got a mode."""
    space, name = fitted.model.space, f"{shaft}.inertia"
    if name not in space.names:
        return 0.0
    k = space.names.index(name)
    stated = space.prior_mean[k] if np.isfinite(space.prior_std[k]) else space.upper[k]
    return float(stated - fitted.theta[k])


def corrected(current: FittedModel, found: Sequence[Contradiction], meant: Considered) -> Choice | None:
    """Fit again with the stated values of one part taken back; return the parts, the one that leaves least first.

    Whatever competes, or where the problem names such effects only what it names: None where that is no part of those.

    It is a part whose fitted values are far from what is stated for them, or one whose values are fixed: fitted ones
    may have given way to it. Every value that is taken back costs what Schwarz 1978 asks for.
    """
    benchmark = Benchmark(current)
    each = schwarz(benchmark.blocks)
    best = dict[Key, tuple[float, Rival]]()
    narrowed = not set(STATED).isdisjoint(meant.names)
    released = [item for item in found if not narrowed or meant.holds(item.effect, item.component)]
    for count, seen, fitted in [*_released(current, released), *_freed(current, found, meant)]:
        score = fitted.cost + count * each
        if seen.key not in best or score < best[seen.key][0]:
            best[seen.key] = score, Rival.of(seen, fitted, -benchmark.dearer(fitted))
    if not best:
        return None
    scores, ordered = zip(*sorted(best.values(), key=lambda pair: pair[0]), strict=True)
    weights = np.exp(scores[0] - np.array([*scores, max(current.cost, scores[0])]))
    *chances, nothing = map(float, weights / weights.sum())
    return Choice(ordered, tuple(chances), nothing, True, ordered[: needed(chances)], ordered[:1])


def _released(current: FittedModel, found: Sequence[Contradiction]) -> Iterator[tuple[int, Screened, FittedModel]]:
    """Yield fits without the priors that are contradicted, part by part, and how many values are taken back."""
    for item in found:
        drive = _without_priors(current.model.problem.drive, item)
        model = with_drive(current.model, drive)
        p_value = float(2.0 * stats.norm.sf(item.deviations))
        seen = Screened(item.effect, item.component, 0.5 * item.deviations**2, p_value, (), Augmentation(drive, {}, ()))
        fitted = freed(polished(model, current.footing, current.theta, current.linear.point.nodes))
        yield len(item.names), seen, fitted


def _freed(
    current: FittedModel, found: Sequence[Contradiction], meant: Considered
) -> Iterator[tuple[int, Screened, FittedModel]]:
    """Yield fits with the fixed values of a part made free, part by part.

    A score test does not tell which: it counts no priors. The way to where contradicted values are as stated is long
    and curved, so fits begin there, too.
    """
    clues, model = clues_of(current), current.model
    stated = dict(zip(model.space.names, map(float, model.space.prior_mean), strict=True))
    wanted = current.values | {name: stated[name] for item in found for name in item.names}
    for effect, place in meant.candidates(model.problem.drive):
        if effect not in STATED:
            continue
        seen = screen(current, effects()[effect], place, clues)
        if seen is None or not seen.starts:
            continue
        near = quick_refit(current, seen)
        far = polished(near.model, near.footing, near.model.space.with_known(near.values | wanted), None)
        fitted = completed(min((near, far), key=lambda fit: fit.objective if fit.holds else np.inf))
        if fitted.holds and not is_another(seen, fitted):
            yield fitted.theta.size - current.theta.size, seen, fitted


def _without_priors(drive: Drive, item: Contradiction) -> Drive:
    values = {leaf.path: leaf.value for leaf in drive_leaves(drive)}
    for name in item.names:
        value = values[name.partition("@")[0]]
        assert isinstance(value, Free)
        values[name.partition("@")[0]] = replace(value, prior_std=None, prior_mean=None)
    return bind_drive(drive, values)
