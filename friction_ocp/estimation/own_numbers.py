"""What each recording has of its own, of recordings that took no part in a fit."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from operator import itemgetter
from typing import Any

import numpy as np

from friction_ocp.drive.parts import Drive
from friction_ocp.drive.values import bind_drive, drive_leaves
from friction_ocp.estimation.around_kinks import around_kinks, smoothed
from friction_ocp.estimation.experiment import Experiment
from friction_ocp.estimation.first_nodes import suggested_point
from friction_ocp.estimation.gauss_newton import Tolerances, solve_gauss_newton
from friction_ocp.estimation.model import Model
from friction_ocp.estimation.node_ends import UNIMPORTANT
from friction_ocp.estimation.nodes import solve_nodes
from friction_ocp.estimation.parameter_space import parameter_space
from friction_ocp.estimation.problem import RecordingUse
from friction_ocp.estimation.program import Point, Program
from friction_ocp.estimation.stages import relaxed
from friction_ocp.parameters import Free
from friction_ocp.simulation.grid import FloatArray
from friction_ocp.simulation.losses import Squares

ENOUGH = Tolerances(max_iterations=30)
MOST_STARTS = 3
"""From which they are fitted."""
MOST_SMOOTH = 2
"""From which they are fitted by way of a smoothed sign."""
MOST_PASSES = 4
"""Of all starts on the nodes of the nearest."""
ORIGIN, PERIOD = "origin", "period"
"""How the names end of where a wave begins and of its period."""


def own_numbers(
    model: Model, experiments: Sequence[Experiment], theta: FloatArray, fitted: bool = True
) -> dict[str, Mapping[str, float]]:
    """Return the numbers of `scope: recording`, by path, of recordings by name that took no part in the fit.

    Where nothing was `fitted` these are all recordings for which the problem does not set them.
    As the state in which a recording begins, such a number says nothing about another recording: it is fitted to short
    segments of its own, all that is shared being what the fit has found. It begins at the best values of fitted
    recordings and is bounded as theirs are.
    """
    values = {leaf.path: leaf.value for leaf in drive_leaves(model.problem.drive)}
    if not any(isinstance(value, Free) and value.scope == "recording" for value in values.values()):
        return {}
    those = {use.name for use in model.problem.fitted} if fitted else set[str]()
    uses = {use.name: use for use in model.problem.recordings if use.name not in those}
    known = dict(zip(model.space.names, map(float, theta), strict=True))
    shared = _bound(model, known)
    asked = [item for item in experiments if item.name in uses]
    found = {item.name: _fitted(model, shared, uses[item.name], item, known) for item in asked}
    return {name: numbers for name, numbers in found.items() if numbers}


def _bound(model: Model, known: Mapping[str, float]) -> Drive:
    """Return the drive of a model with the numbers that are known by path, and so are no recording's own."""
    values = {leaf.path: leaf.value for leaf in drive_leaves(model.problem.drive)}
    return bind_drive(model.problem.drive, {path: known.get(path, value) for path, value in values.items()})


def with_numbers(model: Model, own: Mapping[str, Mapping[str, float]]) -> Model:
    """Return a model with numbers, by path, of recordings by name set beside those that the problem sets."""
    if not own:
        return model
    train, validation = (
        tuple(replace(use, set={**use.set, **own.get(use.name, {})}) for use in uses)
        for uses in (model.problem.train, model.problem.validation)
    )
    problem = replace(model.problem, train=train, validation=validation)
    space = parameter_space(problem, model.space.leaf_names, model.space.active)
    known = dict(zip(model.space.names, map(float, model.space.guess), strict=True))
    return replace(model, problem=problem, space=space.moved(space.with_known(known)))


def _fitted(
    model: Model, shared: Drive, use: RecordingUse, item: Experiment, known: Mapping[str, float]
) -> dict[str, float]:
    """Return the numbers that a recording has for itself, beside those that a drive shares."""
    alone = replace(
        model.problem, drive=shared, train=(use,), validation=(), static=(), static_validation=(), constraints=()
    )
    space = parameter_space(alone, model.space.leaf_names, model.space.active)
    if not space.names:
        return {}
    seen = replace(model, problem=alone, space=space, train=(item,), validation=(), found={})
    program, paths = relaxed(seen, (item,), 0.0, Squares()), [name.partition("@")[0] for name in space.names]
    others = [
        np.array([known.get(f"{path}@{other.name}", space.guess[k]) for k, path in enumerate(paths)])
        for other in model.problem.fitted
    ]
    numbers = {leaf.path: leaf.value for leaf in drive_leaves(shared)}
    begins = [space.clip(begin) for start in others for begin in _at_other_crests(start, paths, numbers)]
    starts = [solve_nodes(program, suggested_point(program, begin)) for begin in _different(begins)]
    nearest = _on_the_best_nodes(program, starts)[:MOST_STARTS]
    ends = [solve_gauss_newton(program, start, ENOUGH) for start in nearest]
    ends += [around_kinks(seen, program, start, ENOUGH) for start in _smoothly(seen, program, starts)[:MOST_SMOOTH]]
    best = min(ends, key=lambda end: end.objective)
    return dict(zip(paths, map(float, best.point.theta), strict=True))


def _on_the_best_nodes(program: Program, starts: Sequence[Point]) -> list[Point]:
    """Return starts, the nearest first, each with its own nodes or those that the nearest of all leads to.

    Dry friction leaves nodes at ends of their own, which differ by more than what short segments tell of the numbers.
    """
    cost = itemgetter(0)
    found = [(program.objective(start), start) for start in starts]
    for _ in range(MOST_PASSES):
        before, best = min(found, key=cost)
        led = [solve_nodes(program, Point(item.theta, best.nodes)) for _, item in found if item is not best]
        again = [(program.objective(item), item) for item in led]
        others = [pair for pair in found if pair[1] is not best]
        found = [(before, best), *(min(pairs, key=cost) for pairs in zip(others, again, strict=True))]
        if before - min(map(cost, found)) < UNIMPORTANT:
            break
    return [item for _, item in sorted(found, key=cost)]


def _smoothly(model: Model, program: Program, starts: Sequence[Point]) -> list[Point]:
    """Return starts with the nodes that friction with a smoothed sign has there, the nearest first.

    It tells them apart where exact friction leaves nodes at ends of their own.
    """
    rounded = smoothed(model, program)
    found = [solve_nodes(rounded, suggested_point(rounded, start.theta)) for start in starts]
    return sorted(found, key=rounded.objective)


def _at_other_crests(start: FloatArray, paths: Sequence[str], numbers: Mapping[str, Any]) -> Iterator[FloatArray]:
    """Yield a start, and it with where each wave begins a quarter, half or three quarters of its period away.

    From half a period away an iteration may not lead across, and ends at the worst place instead of the best.
    """
    yield start
    for k, path in enumerate(paths):
        period = numbers.get(f"{path.removesuffix(ORIGIN)}{PERIOD}") if path.endswith(ORIGIN) else None
        if not period or isinstance(period, Free):
            continue
        for share in (0.25, 0.5, 0.75):
            moved = start.copy()
            moved[k] = _nearest_zero(start[k] + share * float(period), float(period))
            yield moved


def _nearest_zero(origin: float, period: float) -> float:
    """Return the same place on a wave, no more than half a period from where the recording begins."""
    return origin - period * round(origin / period)


def _different(starts: Sequence[FloatArray]) -> list[FloatArray]:
    return list({start.tobytes(): start for start in starts}.values())
