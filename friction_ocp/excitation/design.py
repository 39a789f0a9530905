"""Design on one page: base fit -> motions within limits -> what each would tell -> the best."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from friction_ocp.diagnosis.base_fit import fit_base
from friction_ocp.diagnosis.clues import clues_of
from friction_ocp.diagnosis.fitted_model import FittedModel
from friction_ocp.diagnosis.refit import completed, quick_refit
from friction_ocp.diagnosis.screen import Screened, screen
from friction_ocp.effects.registry import candidates, effects
from friction_ocp.errors import Finding, FrictionOcpError
from friction_ocp.estimation.model import prepare_fit
from friction_ocp.estimation.problem import Problem
from friction_ocp.estimation.uncertainty import inverse_information
from friction_ocp.excitation.contest import Contest, contested
from friction_ocp.excitation.limits import Limits, limits_of, stated_limits
from friction_ocp.excitation.motions import MOTIONS
from friction_ocp.excitation.trial_run import TrialRun, refuse_what_is_not_driven, trial_run
from friction_ocp.excitation.worth import information, known_information
from friction_ocp.execution.executor import AbstractExecutor, InProcess
from friction_ocp.execution.linear_algebra import with_one_thread
from friction_ocp.execution.run import Tally
from friction_ocp.simulation.grid import FloatArray

Criterion = Literal["D", "A", "separation"]
Key = tuple[str, str]
"""Effect and component."""
Tell = Callable[[str, float], None]

WIDE = 10.0
"""Standard deviation of every parameter before any recording, over its size."""


@dataclass(frozen=True)
class Option:
    """A motion and what it would tell."""

    run: TrialRun
    worth: float
    """By the criterion; larger is better."""
    power: float | None = None
    """Probability that it decides between the rivals, the least over them."""
    std_errors: FloatArray | None = None
    """(parameters,) expected with this recording beside those at hand."""


@dataclass(frozen=True)
class Design:
    """Motions that were considered, best first."""

    problem: Problem
    fitted: FittedModel
    criterion: Criterion
    limits: Limits
    options: tuple[Option, ...]
    std_errors: FloatArray
    """(parameters,) with the recordings at hand."""
    between: tuple[Key, ...] = ()
    """Candidates that were named to be told apart."""


@with_one_thread
def design(
    problem: Problem,
    criterion: Criterion = "D",
    between: Sequence[Key] = (),
    tell: Tell = lambda what, share: None,
) -> Design:
    """Find what to record for a problem: to sharpen its parameters or, where candidates are named, to tell them apart.

    `between` names them as pairs of effect and component, such as ("stribeck", "motor"). Raises FrictionOcpError where
    one is named that there is not, or only one.
    """
    refuse_what_is_not_driven(problem.drive)
    stated_limits(problem)
    entries = {(effect.name, place): effect for effect, place in candidates(problem.drive, list(effects()))}
    _refuse_unknown(between, list(entries))
    tell("base model", 0.0)
    base = fit_base(prepare_fit(problem))
    if not between:
        return sharpening(base, criterion, tell)
    clues = clues_of(base)
    seen = {key: screen(base, entries[key], key[1], clues) for key in dict.fromkeys(between)}
    rivals = [completed(quick_refit(base, item)) for item in _begun(seen)]
    return replace(separating(base, rivals, tell=tell), between=tuple(between))


def _refuse_unknown(between: Sequence[Key], known: Sequence[Key]) -> None:
    wrong = [
        Finding(f"--between {name}@{place}", "there is no such candidate", f"{_nearest(name, known)}")
        for name, place in between
        if (name, place) not in known
    ]
    if between and not wrong and len(set(between)) < 2:
        wrong = [Finding("--between", "one candidate has nothing to be told from", "two or more EFFECT@PLACE")]
    if wrong:
        raise FrictionOcpError(wrong)


def _begun(seen: Mapping[Key, Screened | None]) -> list[Screened]:
    """Return the candidates that a refit can begin with; raises FrictionOcpError where fewer than two are left."""
    begun = [item for item in seen.values() if item is not None and item.starts]
    if len(begun) < 2:
        what, remedy = "the recordings give no size to begin with", "name others, or design without --between first"
        allowed = "two or more candidates that the recordings hint at"
        left = [key for key, item in seen.items() if item is None or not item.starts]
        raise FrictionOcpError([Finding(f"--between {name}@{place}", what, allowed, remedy) for name, place in left])
    return begun


def _nearest(name: str, known: Sequence[Key]) -> str:
    """Return the places of an effect, or all candidates where there is no such effect."""
    same = [key for key in known if key[0] == name] or known
    return ", ".join(f"{effect}@{place}" for effect, place in same)


def sharpening(fitted: FittedModel, criterion: Criterion, tell: Tell = lambda what, share: None) -> Design:
    """Find the motion that sharpens the parameters of a fitted model most.

    D: the largest gain in the logarithm of the determinant of the information, half of it that of the volume of the
    confidence ellipsoid. A: the smallest mean of squared relative standard errors. Source: Pukelsheim 2006; with a wide
    prior, as what the recordings at hand do not tell has no volume (Chaloner & Verdinelli 1995).
    """
    limits = limits_of(fitted.model.problem, clues_of(fitted))
    known, size = known_information(fitted), np.maximum(np.abs(fitted.theta), fitted.model.space.scale)
    options: list[Option] = []
    for run in _runs(fitted, limits, tell):
        both = known + information(fitted, run.recording)
        gained = _volume(both, size) - _volume(known, size) if criterion == "D" else -_mean_square(both, size)
        options.append(Option(run, gained, std_errors=_std_errors(both)))
    options.sort(key=lambda option: -option.worth)
    return Design(fitted.model.problem, fitted, criterion, limits, tuple(options), _std_errors(known))


def separating(
    base: FittedModel,
    rivals: Sequence[FittedModel],
    executor: AbstractExecutor = InProcess(),
    tell: Tell = lambda what, share: None,
) -> Design:
    """Find the motion that tells rivals apart best: the least separation over all pairs, either being true."""
    limits = limits_of(base.model.problem, clues_of(base))

    def watch(tally: Tally) -> None:
        tell(tally.what, tally.done / max(tally.total, 1))

    found = contested(Contest.between(base, rivals, limits), executor, watch)
    options = [Option(run, told.separation, power=told.power) for run, told in found]
    options.sort(key=lambda option: -option.worth)
    errors = _std_errors(known_information(base))
    return Design(base.model.problem, base, "separation", limits, tuple(options), errors)


def _runs(fitted: FittedModel, limits: Limits, tell: Tell) -> list[TrialRun]:
    found: list[TrialRun] = []
    for k, motion in enumerate(MOTIONS):
        tell(f"motion {motion.name}", k / len(MOTIONS))
        run = trial_run(fitted, motion, limits)
        found += [] if run is None else [run]
    return found


def _relative(matrix: FloatArray, size: FloatArray) -> FloatArray:
    """Return the information on parameters over their sizes, with that of the wide prior."""
    return matrix * np.outer(size, size) + np.eye(size.size) / WIDE**2


def _volume(matrix: FloatArray, size: FloatArray) -> float:
    """Return the logarithm of the determinant of the information."""
    return float(np.linalg.slogdet(_relative(matrix, size))[1])


def _mean_square(matrix: FloatArray, size: FloatArray) -> float:
    """Return the mean of squared standard errors over sizes."""
    return float(np.mean(_std_errors(_relative(matrix, size)) ** 2))


def _std_errors(matrix: FloatArray) -> FloatArray:
    """Return (parameters,) standard errors, huge for what nothing is known of."""
    return np.sqrt(np.diag(np.add(*inverse_information(matrix))))
