"""Earlier additions, each examined again when the next is in: dropped, or exchanged for what competed with it then."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from friction_ocp.diagnosis.bench import blocks_like
from friction_ocp.diagnosis.blocks import blocks_of
from friction_ocp.diagnosis.fitting import FittedModel, completed, held_out, polished, without_addition
from friction_ocp.diagnosis.reading import with_additions
from friction_ocp.diagnosis.select import Choice, Rival, Round, resamples
from friction_ocp.diagnosis.worth import Key, required
from friction_ocp.estimation.model import with_drive
from friction_ocp.simulation.grid import FloatArray

TRIED = 2
"""Rivals of an earlier addition, best first, that are tried in its place."""


def without_superfluous(
    base: FittedModel, current: FittedModel, accepted: list[Key], level: float, rng: np.random.Generator
) -> tuple[FittedModel, list[Key]]:
    """Drop earlier additions that the latest one has made superfluous on recordings left out.

    Superfluous is what neither gains for certain there nor is worth an addition in sum.
    """
    for key in dict.fromkeys(accepted[:-1]):
        kept = [other for other in accepted if other != key]
        simpler = without_addition(current, with_additions(base, kept))
        if not simpler.holds:
            continue
        gains = _dearer(simpler, current)
        if not _certain(current, gains, level, rng) and float(np.sum(gains)) < required(base, simpler):
            current, accepted = simpler, kept
    return current, accepted


def exchanged(
    base: FittedModel,
    current: FittedModel,
    rounds: Sequence[Round],
    accepted: list[Key],
    level: float,
    rng: np.random.Generator,
) -> tuple[FittedModel, list[Round], list[Key]]:
    """Put rivals in the place of earlier additions where, beside the later ones, they explain more for certain.

    Alone they were further off: two effects are more than each of them, and what is nearest to both is neither.
    """
    done = list(rounds)
    for index, item in enumerate(done[:-1]):
        key = item.accepted.key if item.accepted is not None else None
        if key is None or accepted.count(key) != 1:
            continue
        for rival in _others(item.choice, accepted):
            keys = [rival.key if other == key else other for other in accepted]
            swapped = _fitted(base, current, rival, keys)
            if swapped.cost < current.cost and _certain(current, -_dearer(swapped, current), level, rng):
                current, accepted = swapped, keys
                done[index] = replace(item, accepted=rival, choice=_turned(item.choice, rival))
                break
    return current, done, accepted


def _others(choice: Choice, accepted: Sequence[Key]) -> list[Rival]:
    others = [rival for rival in choice.rivals if rival.key not in accepted]
    return sorted(others, key=lambda rival: rival.fitted.cost)[:TRIED]


def _fitted(base: FittedModel, current: FittedModel, rival: Rival, keys: Sequence[Key]) -> FittedModel:
    """Fit the base model with some additions, from where the rival ended and what the later ones are now."""
    model = with_drive(base.model, with_additions(base, keys))
    known = {**current.values, **rival.fitted.values}
    theta = np.array([known.get(name, guess) for name, guess in zip(model.space.names, model.space.guess, strict=True)])
    return completed(polished(model, base.footing, theta, None))


def _dearer(other: FittedModel, current: FittedModel) -> FloatArray:
    """Return (blocks,) what another model costs more on recordings left out than the current one, in its blocks."""
    blocks = blocks_of(current.linear.rows)
    return blocks_like(current, other, blocks) - blocks.sums(held_out(current))


def _certain(current: FittedModel, gains: FloatArray, level: float, rng: np.random.Generator) -> bool:
    """Whether gains in the blocks of the current model are more than chance makes of nothing."""
    return bool(np.quantile(resamples(blocks_of(current.linear.rows), rng) @ gains, level) > 0)


def _turned(choice: Choice, rival: Rival) -> Choice:
    """Return a choice that another rival has won, for certain: the two have changed places."""
    order = [rival, *(other for other in choice.rivals if other is not rival)]
    chances = dict(zip((item.key for item in choice.rivals), choice.probabilities, strict=True))
    first = choice.rivals[0].key
    chances[first], chances[rival.key] = chances[rival.key], chances[first]
    found = tuple(chances[item.key] for item in order)
    return replace(choice, rivals=tuple(order), probabilities=found, aliases=(rival,), same=(rival,))
