"""Every rule about a problem, run at once."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import chain

from friction_ocp.errors import Finding
from friction_ocp.estimation.problem import Problem
from friction_ocp.execution.linear_algebra import with_one_thread
from friction_ocp.problem_file.rules import (
    dissipation,
    excitation,
    foresight,
    plausibility,
    recordings,
    requests,
    signals,
    static,
    structure,
    terms,
    timing,
    values,
    work,
)
from friction_ocp.problem_file.rules.case import Case, Rule

_PARTS = (*structure.STRUCTURE, *signals.SIGNALS, *values.VALUES, *dissipation.DISSIPATION, *terms.TERMS)
MODEL = (*_PARTS, *recordings.NAMES)
"""Rules about what stands in the file, whatever else is missing there."""
WHOLE = (*structure.WHOLE, *signals.WHOLE, *values.WHOLE, *terms.WHOLE)
"""Rules about what has to be there."""
_DOUBTS = (*recordings.RECORDINGS, *static.STATIC, *excitation.EXCITATION)
_BEFORE_FIT = (*WHOLE, *excitation.FIT, *plausibility.PLAUSIBILITY, *timing.TIMING, *work.WORK)


@with_one_thread
def check(problem: Problem) -> tuple[Finding, ...]:
    """Return everything that is wrong (errors) or doubtful (warnings) about a problem, in the order of the file.

    What the recordings cannot tell comes last, and only where nothing is wrong.
    """
    found = check_before_search(problem)
    return found if _errors(found) else (*found, *foresight.recordings_tell_the_parameters(Case(problem)))


def check_before_fit(problem: Problem) -> tuple[Finding, ...]:
    """Return the same without what a fit does not ask for, or finds out itself: what the recordings cannot tell."""
    return _run(Case(problem), (*MODEL, *_DOUBTS), _BEFORE_FIT)


def check_before_search(problem: Problem) -> tuple[Finding, ...]:
    """Return the same with what `diagnose` and `design` refuse: what is wrong with `diagnosis` and `limits`."""
    return _run(Case(problem), (*MODEL, *_DOUBTS), (*_BEFORE_FIT, *requests.REQUESTS))


def check_file(problem: Problem) -> tuple[Finding, ...]:
    """Return the errors of the file itself: not of its recordings, and not whether there is something to fit."""
    return _errors(_run(Case(problem), MODEL, WHOLE))


def check_rest(problem: Problem, complete: bool) -> tuple[Finding, ...]:
    """Return the errors of what is left of a problem; `complete` if only recordings were taken out."""
    whole = WHOLE if complete else ()
    return _errors(_run(Case(problem), (*MODEL, *recordings.RECORDINGS, *static.STATIC), whole))


def _run(case: Case, rules: Iterable[Rule], if_named: Iterable[Rule]) -> tuple[Finding, ...]:
    """Run all rules; those of `if_named` only if every part is found under its name."""
    found = list(chain.from_iterable(rule(case) for rule in structure.NAMES))
    further = (*rules,) if found else (*rules, *if_named)
    return tuple(dict.fromkeys([*found, *chain.from_iterable(rule(case) for rule in further)]))


def _errors(findings: Iterable[Finding]) -> tuple[Finding, ...]:
    return tuple(finding for finding in findings if finding.severity == "error")
