"""Rules about what the file asks for beside a fit: by the readers of those who do it, so that both refuse the same."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from friction_ocp.diagnosis.excerpts import samples_of
from friction_ocp.diagnosis.options import considered, effort_of, level_of
from friction_ocp.errors import Finding, FrictionOcpError
from friction_ocp.estimation.problem import Problem
from friction_ocp.excitation.limits import stated_limits
from friction_ocp.problem_file.rules.case import Case, Rule


def diagnosis_is_possible(case: Case) -> Iterator[Finding]:
    """`diagnosis` names effects that exist, at places where they make sense, and numbers that can be."""
    for reader in (considered, level_of, effort_of, samples_of):
        yield from _refused(reader, case.problem)


def limits_are_possible(case: Case) -> Iterator[Finding]:
    """`limits` are positive numbers."""
    yield from _refused(stated_limits, case.problem)


def _refused(reader: Callable[[Problem], object], problem: Problem) -> Iterator[Finding]:
    try:
        reader(problem)
    except FrictionOcpError as error:
        yield from error.findings


REQUESTS: tuple[Rule, ...] = (diagnosis_is_possible, limits_are_possible)
