"""Which of two models is a special case of the other, and whether the recordings need the general one."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import permutations
from typing import Any

import numpy as np
import scipy.stats as _stats  # pyright: ignore[reportMissingTypeStubs]

from friction_ocp.drive.values import drive_leaves
from friction_ocp.estimation.model import Model
from friction_ocp.parameters import Free, Tie, is_off
from friction_ocp.statistics.answer import Answer
from friction_ocp.statistics.misfit import mean_weight

stats: Any = _stats  # its own types are incomplete

NOT_WORSE = 1e-3
"""Relative excess of the general model's objective that its solver may leave."""


@dataclass(frozen=True)
class LikelihoodRatio:
    """Test of a special case against the model that contains it."""

    special: str
    general: str
    stated: bool
    """Whether the user said so; else it was recognised."""
    added: int
    """Parameters more."""
    statistic: float | None
    """Twice the fall of the objective over its scale under misfit; None where the general fit ended worse."""
    p_value: float | None
    """Probability of a larger statistic if the special case is true."""
    at_bound: tuple[str, ...] = ()
    """Added parameters that ended at a bound: the statistic is not distributed as chi2 then."""


def likelihood_ratios(
    fits: Sequence[tuple[str, Answer]], stated: Sequence[tuple[str, str]] = ()
) -> tuple[LikelihoodRatio, ...]:
    """Test every nested pair among fits."""
    return tuple(
        _ratio(special, general, told)
        for special, general in permutations(fits, 2)
        for told in _relations(special, general, stated)
    )


def is_nested(special: Model, general: Model) -> bool:
    """Whether a model is recognised as a special case of another.

    Its fitted parameters are among those of the other, its states are the same, the other fixes or ties nothing to
    anything else, and what the other does not have at all is off. So it is a special case as far as the laws of the
    same names are, which holds for coulomb, viscous, coulomb_viscous within stribeck and quadratic.
    """
    few, many = set(special.space.names), set(general.space.names)
    if not few < many or special.drive.state_names != general.drive.state_names:
        return False
    own = {leaf.path: leaf.value for leaf in drive_leaves(special.problem.drive)}
    other = {leaf.path: leaf.value for leaf in drive_leaves(general.problem.drive)}
    same = all(own[path] == value for path, value in other.items() if path in own and _is_known(value))
    return same and all(is_off(value) for path, value in own.items() if path not in other)


def _is_known(value: Any) -> bool:
    return isinstance(value, (int, float, Tie)) and not isinstance(value, Free)


def _relations(
    special: tuple[str, Answer], general: tuple[str, Answer], stated: Sequence[tuple[str, str]]
) -> Iterator[bool]:
    """Yield whether the pair was stated, if it is nested at all."""
    if (special[0], general[0]) in stated:
        yield True
    elif is_nested(special[1].workshop.model, general[1].workshop.model):
        yield False


def _ratio(special: tuple[str, Answer], general: tuple[str, Answer], told: bool) -> LikelihoodRatio:
    """Compare two optima.

    Twice the fall of the objective is divided by the mean weight of the q added parameters (`mean_weight`) and
    compared with chi2(q); F(q, f), f being the degrees of freedom of the sandwich, takes the place of chi2(q) / q.
    """
    names = set(special[1].workshop.model.space.names)
    added = [k for k, name in enumerate(general[1].workshop.model.space.names) if name not in names]
    difference = len(general[1].estimate.parameters) - len(special[1].estimate.parameters)
    lowest = general[1].workshop.fitted.solution.objective
    fall = special[1].workshop.fitted.solution.objective - lowest
    if fall < -NOT_WORSE * abs(lowest) or difference < 1:
        return LikelihoodRatio(special[0], general[0], told, difference, None, None)
    doubt = general[1].estimate.uncertainty
    statistic = 2.0 * max(fall, 0.0) / mean_weight(doubt, added, ~doubt.at_bound)
    freedom = doubt.freedom
    tail = stats.chi2.sf(statistic, difference)
    if np.isfinite(freedom):
        tail = stats.f.sf(statistic / difference, difference, freedom)
    stuck = tuple(general[1].workshop.model.space.names[k] for k in added if doubt.at_bound[k])
    return LikelihoodRatio(special[0], general[0], told, difference, statistic, float(tail), stuck)
