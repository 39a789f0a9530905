"""Which candidates of a round are refitted, and which of these refits are completed."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from friction_ocp.diagnosis.crew import Crew
from friction_ocp.diagnosis.rival import TOLD, Rival
from friction_ocp.diagnosis.screen import Screened
from friction_ocp.diagnosis.select import Round, gave_shape
from friction_ocp.diagnosis.worth import samples, with_resembling
from friction_ocp.effects.effect import Key
from friction_ocp.effects.registry import effects

FINISHED, CLOSE = 2, 1.5
"""Candidates whose refit is completed: the best after a few steps or by prediction, which leaves noise at least, and
all whose objective is within this factor; and what resembles the best. As many begin again at other sizes where that
leads nowhere."""
BEGUN, MOST_ALIKE = 4, 0.5
"""Candidates that are refitted from the guesses, too, and their predicted gain over the largest: parameters that a fit
has moved far to stand in for what is missing hide what it is. As many are refitted for the predictions of loosely
joined segments."""
OF_LOST = 6
"""Candidates that are tried for what they promise of free runs that are lost, whatever that is: the order of such
promises says little."""
STAYS = 0.25
"""Share of what a refit, or its prediction, leaves over noise that its end may leave of that: steps cut short and
predictions both fall short where effects are large."""
AS_NEAR = 0.01
"""Share of what the best completed refit leaves, of those that may be added, up to which what leaves more after a few
steps is completed, too."""


def _promising(found: Sequence[Screened]) -> list[Screened]:
    """Return the few candidates that promise most."""
    return [item for item in found if item.starts and item.gain >= MOST_ALIKE * found[0].gain][:BEGUN]


def _begun_of(found: Sequence[Screened], keys: Collection[Key]) -> list[Screened]:
    """Return those of some keys that have a start."""
    return [item for item in found if item.key in keys and item.starts]


def to_refit(
    crew: Crew, chosen: Sequence[Screened], found: Sequence[Screened], shapes: Collection[Key] = ()
) -> tuple[list[Screened], list[Screened]]:
    """Return chosen candidates with others of all that were found, and those to be refitted from the guesses, too.

    What may be large and yet promises nothing is tried wherever a model has gone astray; there and from the guesses, so
    are the more general `shapes` of what segments have found, whose promises parameters that are far off hide. From the
    guesses refits begin where a fit is at odds with priors, too: it has gone where parameters stand in for what is
    missing.
    The few that loosely joined segments promise most of are tried beside the first few of lost free runs, whatever
    share of the largest promise that is: neither prediction tells for certain what is worth little. Fits of loosely
    joined segments do, where both are judged by squares and the best is no work of chance, but for what promises most
    of free runs: short segments may not show it. And for what one of those has and more: a fit may have come to rest on
    its way, and of the two the plain one is to be preferred.
    """
    current, keys = crew.bench.current, list(dict.fromkeys(item.key for item in found))
    if not chosen or not current.astray:
        begun = _promising(crew.screened_unfitted(keys)) if chosen and current.at_odds else []
        return with_resembling(chosen, found), begun
    if current.lost:
        first = [item for item in chosen if item.starts][:OF_LOST]
        tried = with_resembling(beginning_at(first, _promising(crew.screened_loosely(keys))), found)
        tried = with_outright(tried, found)
        if not current.leads_loosely:
            return tried, []
        leading = _leading(tried, crew.fitted_loosely(tried), samples(current))
        most = [item.key for item in first[:1]]
        leading = _and(leading, [item for item in tried if item.key in most])
        return _and(leading, [item for item in tried if any(other.holds(item) for other in leading)]), []
    from_guesses = crew.screened_unfitted(keys)
    tried = _and(with_resembling(chosen, found, astray=True), _begun_of(found, shapes))
    unfitted = _and(_promising(from_guesses), _begun_of(from_guesses, shapes))
    return with_outright(tried, found), with_outright(unfitted, found)


def with_outright(chosen: Sequence[Screened], others: Sequence[Screened]) -> list[Screened]:
    """Return chosen candidates with those of others that may begin outright, whatever they promise."""
    return _and(chosen, [item for item in others if item.augmentation.outright])


def _and(chosen: Sequence[Screened], others: Sequence[Screened]) -> list[Screened]:
    """Return chosen candidates with those of others that are not among them."""
    keys = {item.key for item in chosen}
    return [*chosen, *(item for item in others if item.key not in keys)]


def _leading(tried: Sequence[Screened], gains: Sequence[float], count: int) -> list[Screened]:
    """Return candidates that gain a notable share of the most where segments are loosely joined, two at least.

    All, where none is worth its parameters there by BIC over `count` samples: what moves free runs over minutes can be
    hidden in short segments, and what is gained there is chance. And those that lose as much: the model without them
    is one of theirs, so that their fit is no judgement of them.
    """
    chance = [0.5 * len(item.augmentation.off) * np.log(count) for item in tried]
    if not any(gain > least for gain, least in zip(gains, chance, strict=True)):
        return list(tried)
    order = sorted(range(len(tried)), key=lambda k: -gains[k])
    enough = MOST_ALIKE * gains[order[0]]
    leading = [tried[k] for rank, k in enumerate(order) if rank < FINISHED or gains[k] >= enough]
    return _and(leading, [item for k, item in enumerate(tried) if gains[k] < -chance[k]])


def displaced(rounds: Sequence[Round], known: Mapping[Key, Screened], chosen: Sequence[Screened]) -> list[Screened]:
    """Return what might have been in the place of the last addition: what it promises beside that says little.

    Only where another shape took it, since that can do a part of another effect's work.
    """
    if not chosen or not rounds or not gave_shape(rounds, -1):
        return []
    keys, taken = [item.key for item in rounds[-1].choice.aliases], {item.key for item in chosen}
    return [known[key] for key in keys if key in known and key not in taken and known[key].starts]


def beginning_at(chosen: Sequence[Screened], others: Sequence[Screened]) -> list[Screened]:
    """Return chosen candidates and others; of those that are among both the refit begins where either predicts."""
    also = {item.key: item for item in others}
    both = [
        replace(item, starts=(*also.pop(item.key).starts[:1], *item.starts)) if item.key in also else item
        for item in chosen
    ]
    return [*both, *also.values()]


def completed_rivals(
    crew: Crew,
    chosen: Sequence[Screened],
    unfitted: Sequence[Screened],
    known: Mapping[Key, Screened],
    asked: Mapping[Key, float],
    exhausted: Callable[[], bool] = lambda: False,
) -> Iterator[list[Rival]]:
    """Yield the rivals whose refits look best, their refits completed; then, if those will not do, all that were tried.

    What lost free runs promise is no prediction, and nothing is made thorough that is far behind there. Nor is anything
    completed at first that will not come as far as the best has come, unless it resembles that.
    What comes as near as the best that matters is completed beside it, and begun again from its node states: what fits
    better and is not to be added leaves the field to that. What fits best where it was fitted may be worth nothing on
    recordings left out. Where it gains what is `asked` of it and yet will not do, it may have come to rest on the way:
    at last the best of those begin at other sizes. The first FINISHED are completed in any case, and what comes near;
    others as long as the search is not `exhausted`.
    """
    if not chosen:
        return
    without, tried = crew.without(chosen, unfitted)
    refits = [replace(refit, screened=known[refit.key]) for refit in tried]
    if not refits:
        return
    current = crew.bench.current
    noise = 0.5 * samples(current)
    hopes = [refit.cost for refit in refits]
    if not current.leads_loosely:
        hopes = [min(refit.cost, max(current.cost - refit.screened.gain, noise)) for refit in refits]
    close = sum(hope < CLOSE * min(hopes) for hope in hopes)
    count, thorough = max(FINISHED, close), min(FINISHED, close) if current.leads_loosely else FINISHED
    order = sorted(range(len(hopes)), key=lambda k: (hopes[k], refits[k].cost))
    alike = effects()[refits[order[0]].key[0]].resembles
    enough = max(min(refit.cost for refit in refits) - noise, 0.0) + TOLD
    hopeful = [k for k in order if k == order[0] or STAYS * (hopes[k] - noise) < enough]
    first = [k for k in order if k in hopeful[:count] or refits[k].key[0] in alike]
    if len(first) > FINISHED and exhausted():
        first = first[:FINISHED]
    others = [k for k in order if k not in first]
    rivals = crew.rivals([refits[k] for k in first], without, asked, thorough)
    able = [item for item in rivals if item.standing.material] or rivals
    reached = noise + (1.0 + AS_NEAR) * max(min(item.standing.cost for item in able) - noise, 0.0)
    near = [k for k in others if refits[k].cost < reached]
    if near:
        others = [k for k in others if k not in near]
        rivals = [*rivals, *crew.rivals([refits[k] for k in near], without, asked)]
    rivals = crew.levelled(rivals, reached, without, asked)
    yield rivals
    if others and exhausted():
        return
    if others:
        rivals = [*rivals, *crew.rivals([refits[k] for k in others], without, asked)]
        yield rivals
    rivals.sort(key=lambda item: item.standing.cost)
    notable = [item for item in rivals if current.cost - item.standing.cost >= asked[item.key] and item.screened.starts]
    again = notable[:FINISHED]
    if again and not exhausted():
        yield [*crew.retried(again, without, asked), *(item for item in rivals if item not in again)]
