"""What the end of a diagnosis says of its rounds: decisions that did not stand, and how sure the others still are."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from friction_ocp.diagnosis.fitted_model import FittedModel
from friction_ocp.diagnosis.select import Choice, Round
from friction_ocp.diagnosis.worth import samples
from friction_ocp.effects.effect import Key

MIMICKED = 0.015
"""Probability that what leaves nothing stands in for something outside the catalogue: it did in 4 of the 266 cases of
the blind suites of seeds 20261125 to 20261127 and 20261130 where a cause was named and noise was left."""
MISSED = 0.07
"""Probability that a refit which came to rest on the way is the cause after all, where nothing explains what is left:
1 of the 15 cases of the blind suite of seed 20261130 where nothing was named and more than noise was left."""
ABSCISSAE = 64
"""At which the loss of normal noise is averaged (Gauss-Hermite quadrature)."""


def merged(rounds: Sequence[Round], checked: Sequence[Round]) -> list[Round]:
    """Return the rounds with those of stated values behind them.

    Where stated values are taken back the round before, which found that nothing is missing, did not stand: it lacked
    these candidates.
    """
    if not checked or not rounds or rounds[-1].accepted is not None:
        return [*rounds, *checked]
    return [*rounds[:-1], replace(checked[0], screened=rounds[-1].screened), *checked[1:]]


def standing(rounds: Sequence[Round], accepted: Sequence[Key]) -> tuple[list[Round], list[Round]]:
    """Return the rounds whose addition was kept, or that found none, and those whose addition was taken back later."""
    stood = [item.accepted is None or item.accepted.key in accepted for item in rounds]
    kept = [item for item, yes in zip(rounds, stood, strict=True) if yes]
    return kept, [item for item, yes in zip(rounds, stood, strict=True) if not yes]


def doubted(rounds: Sequence[Round], final: FittedModel, left_over: bool, lost: float) -> list[Round]:
    """Return rounds whose additions are as sure as what is left at the end lets them be.

    Where nothing explains what is left, an addition may be no more than what comes nearest to one unknown cause of
    both: it is doubted by as large a share as what is left has in it and the addition together. Where the additions
    come no closer to recordings that took no part, be it that more than noise is left anyway, they are doubted by the
    share of the gap that is `lost` there: all three that left a gap and came no closer, where noise alone does
    not keep them as far, stood in for what is outside the catalogue (blind suites of seeds 20261215 to 20261217).

    Where nothing was added, and more than noise is left, candidates that were refitted share what is then doubted of
    the catalogue's not having the cause, by what their refits gained.
    """
    found = list[Round]()
    for item in rounds:
        if item.accepted is not None:
            item = _doubted(item, final, left_over, lost)
        elif left_over:
            item = replace(item, choice=_less_final(item))
        found.append(item)
    return found


def _doubted(item: Round, final: FittedModel, left_over: bool, lost: float) -> Round:
    assert item.accepted is not None
    left = max(_excess(final), 0.0) if left_over else 0.0
    taken = max(item.before.objective - item.accepted.standing.objective, 0.0)
    share = max(left / (left + taken) if left > 0.0 else 0.0, lost)
    return replace(item, choice=_less_sure(item.choice, min(max(share, MIMICKED), 1.0 - MIMICKED)))


def _less_final(item: Round) -> Choice:
    """Return the choice of a round that found nothing whose rivals have a share of the probability of none."""
    choice = item.choice
    gains = [max(item.before.objective - rival.standing.objective, 0.0) for rival in choice.rivals]
    whole = sum(gains)
    if not whole > 0.0:
        return choice
    share = MISSED * choice.nothing
    chances = tuple(known + share * gain / whole for known, gain in zip(choice.probabilities, gains, strict=True))
    return replace(choice, probabilities=chances, nothing=choice.nothing - share)


def _excess(fitted: FittedModel) -> float:
    """Return the objective beyond that of normal noise."""
    nodes, weights = np.polynomial.hermite_e.hermegauss(ABSCISSAE)
    each = float(weights @ fitted.footing.loss.cost(nodes) / np.sum(weights))
    return fitted.objective - each * samples(fitted)


def _less_sure(choice: Choice, share: float) -> Choice:
    """Return a choice whose rivals leave a share of what they are worth to no rival at all."""
    chances = tuple((1.0 - share) * chance for chance in choice.probabilities)
    return replace(choice, probabilities=chances, nothing=choice.nothing + share * sum(choice.probabilities))
