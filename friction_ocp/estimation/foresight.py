"""What recordings can tell before any fit: the information about the parameters along the measured motion."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from friction_ocp.estimation.elimination import reduce_system
from friction_ocp.estimation.identifiability import CONDITION_INDEX, Verdict, verdicts
from friction_ocp.estimation.model import Model
from friction_ocp.estimation.parameter_space import ParameterSpace
from friction_ocp.estimation.program import Linearisation, Point, Program
from friction_ocp.estimation.stages import along_measurement
from friction_ocp.estimation.uncertainty import NO_INFORMATION, SMALLEST_INFORMATION, Uncertainty
from friction_ocp.simulation.grid import BoolArray, FloatArray

NEARBY = 2
"""Points beside the guess: what is doubtful at all of them is so by the recordings, not by the guess."""
SPREAD = 1.5
"""Factor by which their parameters differ from the guess at most."""
WORTH_A_WORD = 0.1
"""Relative standard error from which a parameter that is traded for others raises a doubt."""


@dataclass(frozen=True)
class Survey:
    """The program along the measured motion, linearised at the guess and at points around it."""

    program: Program
    points: tuple[Point, ...]
    """The guess first."""
    systems: tuple[Linearisation, ...]

    @property
    def space(self) -> ParameterSpace:
        """The fitted parameters."""
        return self.program.space

    def sizes(self, number: int) -> FloatArray:
        """Return the magnitude of each parameter at a point, its typical size where it is zero."""
        theta = self.points[number].theta
        return np.where(theta != 0, np.abs(theta), self.space.scale)


@dataclass(frozen=True)
class Doubt:
    """Parameters that the recordings do not tell one by one."""

    members: tuple[int, ...]
    unseen: bool
    """Whether nothing depends on the (single) member; else the members are traded for one another."""


def survey(model: Model) -> Survey | None:
    """Linearise a problem near its guesses; None where the simulation breaks down at the guess.

    Every segment starts from the measured motion, so that a poor guess spoils nothing but sizes, and friction is
    smoothed as widely as at the start of a fit.
    """
    program = along_measurement(model)
    points: list[Point] = []
    systems: list[Linearisation] = []
    for theta in _thetas(model.space):
        point = Point(theta, program.suggested_nodes(theta))
        with np.errstate(all="ignore"):
            system = program.linearise(point)
        if np.isfinite(system.objective) and np.all(np.isfinite(system.theta_theta)):
            points.append(point)
            systems.append(system)
        elif not points:
            return None
    return Survey(program, tuple(points), tuple(systems))


def _thetas(space: ParameterSpace) -> list[FloatArray]:
    """Return the guess and points around it, always the same ones."""
    rng = np.random.default_rng(0)
    found = [space.clip(space.guess)]
    for _ in range(NEARBY):
        factor = SPREAD ** rng.uniform(-1.0, 1.0, space.guess.size)
        shift = (SPREAD - 1.0) * rng.uniform(-1.0, 1.0, space.guess.size) * space.scale
        found.append(space.clip(np.where(space.guess != 0, space.guess * factor, shift)))
    return found


def information(system: Linearisation) -> FloatArray:
    """Return (parameters, parameters) the information about the parameters, node states solved for."""
    return reduce_system(system, 0.0).hessian


def expected(found: FloatArray) -> Uncertainty:
    """Return the uncertainty that an information matrix promises."""
    size = _units(found)
    values, vectors = np.linalg.eigh(found / np.outer(size, size))
    covariance = (vectors / np.maximum(values, SMALLEST_INFORMATION)) @ vectors.T / np.outer(size, size)
    return Uncertainty(covariance, "gauss_newton", np.zeros(len(size), dtype=bool), np.inf, found)


def judged(space: ParameterSpace, sizes: FloatArray, found: FloatArray) -> tuple[Verdict, ...]:
    """Return the verdicts that `identify` would give under an information matrix."""
    return verdicts(space, sizes, expected(found))


def doubts(seen: Survey) -> tuple[Doubt, ...]:
    """Return what is in doubt at every point of a survey, each parameter once."""
    words = [judged(seen.space, seen.sizes(number), information(system)) for number, system in enumerate(seen.systems)]
    doubtful = {k for k in range(len(seen.space.names)) if all(word[k].word != "ok" for word in words)}
    unseen = {k for k in doubtful if words[0][k].word == "not_identifiable"}
    index = {name: k for k, name in enumerate(seen.space.names)}
    groups = [Doubt((k,), True) for k in sorted(unseen)]
    left = doubtful - unseen
    while left:
        members, front = set[int](), {min(left)}
        while front:
            members |= front
            front = {index[name] for k in front for name in words[0][k].traded_with} & left - members
        left -= members
        if len(members) > 1:
            groups.append(Doubt(tuple(sorted(members)), False))
    return tuple(group for group in groups if group.unseen or _is_vague(seen, group))


def _is_vague(seen: Survey, doubt: Doubt) -> bool:
    """Whether at every point some member is expected to be known badly."""
    members = list(doubt.members)
    return all(
        np.max((expected(information(system)).std_error / seen.sizes(number))[members]) > WORTH_A_WORD
        for number, system in enumerate(seen.systems)
    )


def blind_directions(found: FloatArray, members: tuple[int, ...]) -> FloatArray:
    """Return (members, directions): changes of the members that the recordings hardly see."""
    size = _units(found)
    values, vectors = np.linalg.eigh(found / np.outer(size, size))
    blind: BoolArray = np.sqrt(values[-1] / np.maximum(values, SMALLEST_INFORMATION)) > CONDITION_INDEX
    own = vectors[list(members)]
    chosen = blind & (np.sum(own**2, axis=0) > 0.5)
    return own[:, chosen] / size[list(members), None]


def _units(found: FloatArray) -> FloatArray:
    own = np.diag(found)
    return np.sqrt(np.where(own > 0, own, NO_INFORMATION))
