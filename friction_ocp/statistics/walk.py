"""One side of a profile: away from the optimum with one parameter held, in steps of the likelihood."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from friction_ocp.estimation.elimination import reduce_system
from friction_ocp.estimation.model import Model
from friction_ocp.estimation.program import Point, Program
from friction_ocp.execution.task import Json
from friction_ocp.simulation.grid import FloatArray
from friction_ocp.statistics.resolve import resolve
from friction_ocp.statistics.workshop import Workshop

STEPS_TO_THRESHOLD = 4
"""Grid points that a parabola would get between the optimum and the threshold."""
MOST_POINTS = 30
REFINEMENTS = 4
RESTARTS = 3
NEGLIGIBLE = 0.01
"""Gain of the objective, over the rise that reaches the threshold twice, that is not worth another restart of a solver:
one that stopped early would make a profile too narrow."""
CLOSE = 0.02
"""Distance of the signed root from its threshold, relative, at which a crossing is found."""
LARGEST_CHANGE, SMALLEST_CHANGE = 4.0, 0.25
"""Between one step and the next."""
FAR = 100.0
"""How far an unbounded parameter is followed, over its own size."""


@dataclass(frozen=True)
class Aim:
    """What a side of a profile is asked."""

    parameter: int
    direction: int
    """1 or -1."""
    scale: float
    """Divides twice the rise of the objective before it meets the threshold."""
    threshold: float
    step: float
    """First step, in the unit of the parameter."""
    tangent: tuple[float, ...]
    """(parameters,) how the others move with this one, to first order."""


@dataclass(frozen=True)
class _Stop:
    """A value of the held parameter, and the best that the others can do there."""

    value: float
    ratio: float
    """Twice the rise of the objective over the scale; negative below the optimum that the walk began at."""
    point: Point
    converged: bool

    @property
    def root(self) -> float:
        """Signed root of the ratio: straight where the objective is a parabola."""
        return float(np.sign(self.ratio) * np.sqrt(abs(self.ratio)))


def walk_side(workshop: Workshop, aim: Aim) -> Json:
    """Return the points of one side, where it crosses the threshold, and what ended it.

    `end` is `threshold`; `bound`; `far`, a hundred times the size of the parameter; `points`, too many of them; or
    `solver`, where it fails.
    """
    walk = _Walk(workshop.model, workshop.fitted.program, workshop.fitted.solution.point, aim)
    stops, end = walk.outwards()
    stops = walk.inwards(stops)
    crossing = walk.crossing(stops) if end == "threshold" else None
    return {
        "points": [
            {
                "value": stop.value,
                "ratio": stop.ratio,
                "theta": stop.point.theta.tolist(),
                "converged": stop.converged,
            }
            for stop in sorted(stops[1:], key=lambda stop: stop.value)
        ],
        "crossing": crossing,
        "end": end,
    }


class _Walk:
    """Solves the program with one parameter held, each time from what was found nearby."""

    def __init__(self, model: Model, program: Program, optimum: Point, aim: Aim) -> None:
        self._model, self._program, self._optimum, self._aim = model, program, optimum, aim
        self._lowest = program.objective(optimum)
        self._target = float(np.sqrt(aim.threshold))
        k, space = aim.parameter, program.space
        bound = (space.upper if aim.direction > 0 else space.lower)[k]
        far = optimum.theta[k] + aim.direction * FAR * max(abs(optimum.theta[k]), float(space.scale[k]))
        self._limit, self._limit_word = (bound, "bound") if np.isfinite(bound) else (far, "far")

    def outwards(self) -> tuple[list[_Stop], str]:
        """Walk until the threshold is passed or nothing is left to try."""
        stops = [_Stop(float(self._optimum.theta[self._aim.parameter]), 0.0, self._optimum, True)]
        step = self._aim.step
        while len(stops) <= MOST_POINTS:
            last = stops[-1]
            room = abs(self._limit - last.value)
            if room <= 1e-9 * max(abs(self._limit), abs(last.value), 1e-300):
                return stops, self._limit_word
            reach = min(step, room)
            found = self._at(last.value + self._aim.direction * reach, stops)
            if not np.isfinite(found.ratio):
                step = SMALLEST_CHANGE * reach
                if step < 1e-6 * self._aim.step:
                    return stops, "solver"
                continue
            stops.append(found)
            if found.root >= self._target:
                return stops, "threshold"
            wanted = self._target / STEPS_TO_THRESHOLD / max(found.root - last.root, 1e-12)
            step = reach * float(np.clip(wanted, SMALLEST_CHANGE, LARGEST_CHANGE))
        return stops, "points"

    def inwards(self, stops: list[_Stop]) -> list[_Stop]:
        """Walk back where the profile falls: what lies further out had found a better place for the others."""
        for k in range(len(stops) - 2, 0, -1):
            if stops[k].ratio > stops[k + 1].ratio:
                again = self._solve(stops[k].value, self._holding(stops[k + 1].point, stops[k].value))
                stops[k] = min(stops[k], again, key=lambda stop: stop.ratio)
        return stops

    def crossing(self, stops: list[_Stop]) -> float:
        """Return where the profile meets the threshold; its last two points lie on either side."""
        below = max((k for k in range(len(stops)) if stops[k].root < self._target), default=0)
        inner, outer = stops[below], stops[min(below + 1, len(stops) - 1)]
        for _ in range(REFINEMENTS):
            if min(abs(stop.root - self._target) for stop in (inner, outer)) <= CLOSE * self._target:
                break
            found = self._at(self._between(inner, outer), [inner])
            stops.append(found)
            if found.root < self._target:
                inner = found
            else:
                outer = found
        return self._between(inner, outer)

    def _between(self, inner: _Stop, outer: _Stop) -> float:
        share = (self._target - inner.root) / max(outer.root - inner.root, 1e-300)
        return inner.value + min(max(share, 0.0), 1.0) * (outer.value - inner.value)

    def _at(self, value: float, stops: Sequence[_Stop]) -> _Stop:
        """Solve from the better of two starts: where the others were last, and where they seem to be going."""
        starts = [self._holding(stops[-1].point, value), self._holding(self._ahead(value, stops), value)]
        starts.sort(key=self._program.objective)
        found = self._solve(value, starts[0])
        return found if found.converged else min(found, self._solve(value, starts[1]), key=lambda stop: stop.ratio)

    def _ahead(self, value: float, stops: Sequence[_Stop]) -> Point:
        last = stops[-1]
        if len(stops) == 1:
            move = (value - last.value) * np.array(self._aim.tangent)
            node_steps = reduce_system(self._program.linearise(last.point), 1e-9).node_steps(move)
            nodes = tuple(old + step for old, step in zip(last.point.nodes, node_steps, strict=True))
            return Point(last.point.theta + move, nodes)
        before = stops[-2]
        share = (value - last.value) / (last.value - before.value)
        nodes = tuple(b + share * (b - a) for a, b in zip(before.point.nodes, last.point.nodes, strict=True))
        return Point(last.point.theta + share * (last.point.theta - before.point.theta), nodes)

    def _holding(self, point: Point, value: float) -> Point:
        theta: FloatArray = self._program.space.clip(point.theta)
        theta[self._aim.parameter] = value
        return Point(theta, point.nodes)

    def _solve(self, value: float, start: Point) -> _Stop:
        space, k = self._program.space, self._aim.parameter
        lower, upper = space.lower.copy(), space.upper.copy()
        lower[k] = upper[k] = value
        held = replace(self._program, space=replace(space, lower=lower, upper=upper))
        end = resolve(self._model, held, start)
        for _ in range(RESTARTS):
            again = resolve(self._model, held, end.point)
            gained, end = end.objective - again.objective, min(end, again, key=lambda solution: solution.objective)
            if not gained > NEGLIGIBLE * self._aim.threshold * self._aim.scale:
                break
        return _Stop(value, 2.0 * (end.objective - self._lowest) / self._aim.scale, end.point, end.converged)
