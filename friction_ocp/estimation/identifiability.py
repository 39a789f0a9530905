"""A verdict for every parameter: trusted, at a bound, not identifiable, or traded with others."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from friction_ocp.estimation.parameter_space import ParameterSpace
from friction_ocp.estimation.uncertainty import Uncertainty
from friction_ocp.simulation.grid import BoolArray, FloatArray

CONDITION_INDEX = 30.0
VARIANCE_SHARE = 0.5
"""Thresholds of Belsley, Kuh & Welsch 1980 for a harmful near-dependency."""
MATERIAL = 0.01
"""Relative standard error from which a near-dependency is worth a word: below it the parameter is known anyway."""


@dataclass(frozen=True)
class Verdict:
    """What the data say about one parameter."""

    word: str
    """ok, at_bound, not_identifiable or traded."""
    traded_with: tuple[str, ...] = ()


def named_in_trades(space: ParameterSpace, judged: tuple[Verdict, ...]) -> BoolArray:
    """Return which parameters are traded, or that others are traded with."""
    named = {name for verdict in judged for name in verdict.traded_with}
    return np.array(
        [verdict.word == "traded" or name in named for name, verdict in zip(space.names, judged, strict=True)]
    )


def beyond_the_log(space: ParameterSpace, judged: tuple[Verdict, ...], too_fast: BoolArray) -> tuple[Verdict, ...]:
    """Call those parameters of a trade not identifiable that act only through motions faster than the recordings.

    Even the combination that is known of them rests on how the inputs ran between the samples, which nobody recorded.
    """
    result = list(judged)
    for k in np.flatnonzero(too_fast):
        naming = tuple(
            name for name, other in zip(space.names, judged, strict=True) if space.names[k] in other.traded_with
        )
        result[k] = Verdict("not_identifiable", judged[k].traded_with or naming)
    return tuple(result)


def verdicts(space: ParameterSpace, theta: FloatArray, found: Uncertainty) -> tuple[Verdict, ...]:
    """Judge every parameter."""
    unseen = _unseen(space, theta, found)
    partners = _partners(found, ~(found.at_bound | unseen))
    nothing_excluded = _covers_the_bounds(space, theta, found)
    vague = ~(found.std_error <= MATERIAL * np.abs(theta))
    result: list[Verdict] = []
    for k in range(theta.size):
        if found.at_bound[k]:
            result.append(Verdict("at_bound"))
        elif unseen[k]:
            result.append(Verdict("not_identifiable"))
        elif partners[k] and vague[k]:
            result.append(Verdict("traded", tuple(space.names[j] for j in partners[k])))
        elif nothing_excluded[k]:
            result.append(Verdict("not_identifiable"))
        else:
            result.append(Verdict("ok"))
    return tuple(result)


def _unseen(space: ParameterSpace, theta: FloatArray, found: Uncertainty) -> BoolArray:
    """Return which parameters the data do not see even with all others known.

    Their conditional standard error exceeds their own size and half of their bounds: nothing is excluded.
    """
    prior = np.where(np.isfinite(space.prior_std), space.prior_std, np.inf) ** -2.0
    own = np.maximum(np.diag(found.information) - prior, 0.0)
    conditional = 1.0 / np.sqrt(np.maximum(own, 1e-300))
    span = space.upper - space.lower
    size = np.where(np.isfinite(span), 0.5 * span, 0.0)
    return (conditional > np.maximum(np.abs(theta), space.scale)) & (conditional > size)


def _covers_the_bounds(space: ParameterSpace, theta: FloatArray, found: Uncertainty) -> BoolArray:
    """Return of which parameters the interval, all others unknown, holds everything that the bounds allow.

    A bound that is infinite is never reached: where there is one, large values are excluded.
    """
    low, high = found.interval(theta).T
    return (low <= space.lower) & (space.upper <= high)


def _partners(found: Uncertainty, free: BoolArray) -> list[list[int]]:
    """Return for each parameter those with which it shares a near-dependency of the information matrix."""
    count = found.information.shape[0]
    partners: list[set[int]] = [set() for _ in range(count)]
    index = np.flatnonzero(free)
    if index.size < 2:
        return [[] for _ in range(count)]
    information = found.information[np.ix_(index, index)]
    size = np.sqrt(np.maximum(np.diag(information), 1e-300))
    values, vectors = np.linalg.eigh(information / np.outer(size, size))
    values = np.maximum(values, 1e-14)
    shares = (vectors**2 / values) / np.sum(vectors**2 / values, axis=1, keepdims=True)
    for k, value in enumerate(values):
        if np.sqrt(values[-1] / value) <= CONDITION_INDEX:
            continue
        together = [int(one) for one in index[shares[:, k] > VARIANCE_SHARE]]
        for one in together:
            partners[one].update(other for other in together if other != one)
    return [sorted(group) for group in partners]
