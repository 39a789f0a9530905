"""What recordings can tell before any fit: the information about the parameters along the measured motion."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from friction_ocp.estimation.elimination import reduce_system
from friction_ocp.estimation.first_nodes import suggested_point
from friction_ocp.estimation.horizon import horizon
from friction_ocp.estimation.identifiability import CONDITION_INDEX, Verdict, verdicts
from friction_ocp.estimation.model import Model
from friction_ocp.estimation.parameter_space import ParameterSpace
from friction_ocp.estimation.program import Linearisation, Point, Program
from friction_ocp.estimation.stages import WIDTHS, along_measurement, free_run
from friction_ocp.estimation.uncertainty import NO_INFORMATION, SMALLEST_INFORMATION, Uncertainty
from friction_ocp.simulation.grid import BoolArray, FloatArray
from friction_ocp.simulation.losses import Squares

NEARBY = 2
"""Points beside the guess: what is doubtful at all of them is so by the recordings, not by the guess."""
SPREAD = 1.5
"""Factor by which their parameters differ from the guess at most."""
FEW_STEPS, MANY_STEPS = 300_000, 1_000_000
"""Integrator steps of all recordings up to which points beside the guess are looked at, and up to which anything is:
a check takes seconds."""
WORTH_A_WORD = 0.1
"""Relative standard error from which a parameter that is traded for others raises a doubt."""


@dataclass(frozen=True)
class View:
    """A program linearised at one point."""

    program: Program
    point: Point
    system: Linearisation

    @property
    def information(self) -> FloatArray:
        """Return (parameters, parameters) the information about the parameters, node states solved for."""
        return information(self.system)

    @property
    def sizes(self) -> FloatArray:
        """Return the magnitude of each parameter, its typical size where it is zero."""
        return np.where(self.point.theta != 0, np.abs(self.point.theta), self.program.space.scale)

    @property
    def errors(self) -> FloatArray:
        """Return (parameters,) expected standard errors over these sizes."""
        return expected(self.information).std_error / self.sizes


@dataclass(frozen=True)
class Survey:
    """What the recordings tell near the guesses, in several views; the guess itself comes first."""

    views: tuple[View, ...]

    @property
    def space(self) -> ParameterSpace:
        """The fitted parameters."""
        return self.views[0].program.space

    def by_sight(self, doubt: Doubt) -> tuple[View, ...]:
        """Return the views, those that tell the members of a doubt best coming first."""
        return tuple(sorted(self.views, key=lambda view: float(np.max(view.errors[list(doubt.members)]))))


@dataclass(frozen=True)
class Doubt:
    """Parameters that the recordings do not tell one by one."""

    members: tuple[int, ...]
    unseen: bool
    """Whether nothing depends on the (single) member; else the members are traded for one another."""


def survey(model: Model) -> Survey | None:
    """Linearise a problem near its guesses; None where no view can be had.

    No view is right everywhere, and each can miss what another sees. Along the measured motion a poor guess spoils
    nothing but sizes: friction taken exactly may stick there, smoothed widely it hides what happens at low speed. What
    no channel shows, such as the twist of a spring seen by an accelerometer alone, moves only in the free run.
    """
    steps = sum(int(np.sum(item.grid.substeps)) for item in model.train)
    if steps > MANY_STEPS:
        return None
    programs = [along_measurement(model, width) for width in (0.0, WIDTHS[0])]
    programs.append(free_run(model, model.train, 0.0, Squares(), horizon(model)))
    views: list[View] = []
    for theta in _thetas(model.space)[: None if steps <= FEW_STEPS else 1]:
        for program in programs:
            point = suggested_point(program, theta)
            with np.errstate(all="ignore"):
                system = program.linearise(point)
            if np.isfinite(system.objective) and np.all(np.isfinite(system.theta_theta)):
                views.append(View(program, point, system))
    return Survey(tuple(views)) if views else None


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
    """Return what is in doubt in every view of a survey, each parameter once."""
    words = [judged(seen.space, view.sizes, view.information) for view in seen.views]
    doubtful = {k for k in range(len(seen.space.names)) if all(word[k].word != "ok" for word in words)}
    unseen = {k for k in doubtful if all(word[k].word == "not_identifiable" for word in words)}
    index = {name: k for k, name in enumerate(seen.space.names)}
    groups = [Doubt((k,), True) for k in sorted(unseen)]
    left = doubtful - unseen
    while left:
        members, front = set[int](), {min(left)}
        while front:
            members |= front
            front = {index[name] for k in front for word in words for name in word[k].traded_with} & left - members
        left -= members
        if len(members) > 1:
            groups.append(Doubt(tuple(sorted(members)), False))
    return tuple(group for group in groups if group.unseen or _is_vague(seen, group))


def _is_vague(seen: Survey, doubt: Doubt) -> bool:
    """Whether in every view some member is expected to be known badly."""
    return all(np.max(view.errors[list(doubt.members)]) > WORTH_A_WORD for view in seen.views)


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
