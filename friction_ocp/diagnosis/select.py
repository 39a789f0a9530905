"""Which candidate: held-out gain by blocks, probabilities over candidates, alias sets."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from friction_ocp.diagnosis.blocks import Blocks
from friction_ocp.diagnosis.excess import Excess
from friction_ocp.diagnosis.fitted_model import FittedModel
from friction_ocp.diagnosis.rival import Rival, is_same
from friction_ocp.diagnosis.screen import Screened
from friction_ocp.effects.effect import Key
from friction_ocp.simulation.grid import FloatArray

RESAMPLES = 2000
SURE = 0.95
"""Probability that an alias set holds."""
ENOUGH_RECORDINGS = 6
"""From which whole recordings are resampled."""


@dataclass(frozen=True)
class Choice:
    """What the held-out gains say about the rivals, best first."""

    rivals: tuple[Rival, ...]
    """Last those that explain too little to take part."""
    probabilities: tuple[float, ...]
    """Of each rival to be the best."""
    nothing: float
    """Probability that none is better than no addition at all."""
    significant: bool
    """Whether the held-out gain of the best rival is positive at the level asked for; or, where none stands out by
    itself, that of whichever is best, the level being shared among them (Bonferroni)."""
    aliases: tuple[Rival, ...]
    """The best rivals: the smallest set that is sure to hold the best."""
    same: tuple[Rival, ...] = ()
    """The best rival and all that leave the same residuals."""

    @property
    def chances(self) -> dict[Key, float]:
        """The probability of each rival to be the best, by effect and component."""
        return dict(zip((rival.key for rival in self.rivals), self.probabilities, strict=True))

    @property
    def named(self) -> tuple[Rival, ...]:
        """The members of the alias set that are worth naming (`shown`)."""
        return shown(self.aliases, [rival.key for rival in self.same])

    def twins(self, key: Key) -> list[Rival]:
        """Return the others that leave the same residuals as the best, where one of a key does."""
        others = [rival for rival in self.same if rival.key != key]
        return others if len(others) < len(self.same) else []


NOTHING = Choice((), (), 1.0, False, ())
"""No rival takes part."""


@dataclass(frozen=True)
class Round:
    """One decision: which addition, if any."""

    screened: tuple[Screened, ...]
    """All candidates, largest predicted gain first."""
    choice: Choice
    before: FittedModel
    excess: Excess
    accepted: Rival | None


def resamples(blocks: Blocks, rng: np.random.Generator) -> FloatArray:
    """Return (resamples, blocks) how often each block is drawn.

    Whole recordings are drawn where there are enough of them: held-out errors of one share the parameters that it had
    no part in. Otherwise blocks are drawn within their recordings.
    """
    counts = np.zeros((RESAMPLES, blocks.count))
    recordings, place = np.unique(blocks.recording, return_inverse=True)
    if recordings.size >= ENOUGH_RECORDINGS:
        drawn = rng.multinomial(recordings.size, np.full(recordings.size, 1.0 / recordings.size), RESAMPLES)
        return drawn[:, place].astype(float)
    for recording in recordings:
        own = np.flatnonzero(blocks.recording == recording)
        drawn = rng.integers(0, own.size, (RESAMPLES, own.size))
        for k in range(own.size):
            counts[:, own[k]] = np.sum(drawn == k, axis=1)
    return counts


def choose(rivals: Sequence[Rival], blocks: Blocks, parts: int, level: float, rng: np.random.Generator) -> Choice:
    """Weigh rivals by their held-out gains, one of `parts` parts left out at a time; `level` is the significance.

    A rival's probability is its share of the likelihood of what was held out, on average over resampled blocks: where
    two differ by less than chance makes of them, neither takes all. Source: Yao et al. 2018, pseudo-BMA+. Every further
    parameter costs what Schwarz 1978 asks for and what was held out did not charge (`price`), a period more as it is
    told more exactly, and its distance from stated values what their priors say; rivals that leave the same residuals
    share what they have. Of an effect and one that has all of it and more, or is one with other numbers, the plain
    one comes first as long as it is not excluded, or where what the other has more came out as nothing.
    """
    if not rivals:
        return NOTHING
    draws = resamples(blocks, rng)
    totals = np.column_stack([np.zeros(len(draws)), *(draws @ rival.gains for rival in rivals)])
    shares = _weights(totals).mean(axis=0)
    chances = _shared(rivals, totals[:, 1:], float(np.sum(shares[1:])), price(blocks, parts))
    order = sorted(range(len(rivals)), key=lambda k: -chances[k])
    ordered = [rivals[k] for k in order]
    best = totals[:, order[0] + 1]
    alone = bool(np.quantile(best, level) > 0)
    sure = needed([chances[k] for k in order])
    aliases = [rival for k, rival in enumerate(ordered[:sure]) if k == 0 or float(np.sum(rival.gains)) > 0]
    some = bool(shares[0] < level / len(rivals))
    found = Choice(
        rivals=tuple(ordered),
        probabilities=tuple(chances[k] for k in order),
        nothing=float(shares[0]),
        significant=alone or (some and len(aliases) > 1),
        aliases=tuple(aliases),
        same=tuple(rival for rival in ordered if rival is ordered[0] or is_same(rival, ordered[0])),
    )
    others = [rival for rival in ordered[1:] if _has_all_of(ordered[0], rival)]
    special = next((rival for rival in others if rival in aliases or _adds_nothing(ordered[0], rival)), None)
    return found if special is None else with_first(found, special)


def _has_all_of(whole: Rival, part: Rival) -> bool:
    """Whether a rival is another one and more; beside what else is in a model, that one may still be no plainer."""
    plainer = part.standing.determined <= whole.standing.determined
    return plainer and whole.screened.includes(part.screened)


def _adds_nothing(whole: Rival, part: Rival) -> bool:
    """Whether what a rival has beside another one came out as nothing."""
    off, values = whole.screened.augmentation.off, whole.standing.values
    return all(values[name] == off[name] for name in off.keys() - part.screened.augmentation.off.keys())


def with_refused(choice: Choice, refused: tuple[Rival, ...]) -> Choice:
    """Return a choice with rivals that were refitted and take no part, their probability 0."""
    return replace(
        choice, rivals=(*choice.rivals, *refused), probabilities=(*choice.probabilities, *(0.0 for _ in refused))
    )


def gave_shape(rounds: Sequence[Round], index: int) -> bool:
    """Whether a round gave an effect that an earlier one had added a more general shape."""
    held = rounds[index].accepted
    return held is not None and any(item.accepted and item.accepted.key == held.key for item in rounds[:index])


def withdrawn(item: Round) -> Round:
    """Return a round with its addition taken back: its rivals explain too little to take part."""
    return replace(item, choice=with_refused(NOTHING, item.choice.rivals), accepted=None)


def turned(choice: Choice, rival: Rival) -> Choice:
    """Return a choice that another rival has won, for certain: it and the first have changed places.

    What left the same residuals as both still does.
    """
    order = [rival, *(other for other in choice.rivals if other is not rival)]
    chances, first = choice.chances, choice.rivals[0].key
    chances[first], chances[rival.key] = chances[rival.key], chances[first]
    found = tuple(chances[item.key] for item in order)
    same = (rival, *choice.twins(rival.key))
    return replace(choice, rivals=tuple(order), probabilities=found, aliases=(rival,), same=same)


def with_first(choice: Choice, rival: Rival) -> Choice:
    """Return a choice with another rival of its alias set in the place of the best; none of them is excluded."""
    aliases = (rival, *(other for other in choice.aliases if other is not rival))
    same = (rival, *(other for other in choice.rivals if other is not rival and is_same(other, rival)))
    return replace(turned(choice, rival), aliases=aliases, same=same)


def without(choice: Choice, beaten: Collection[Key]) -> Choice:
    """Return a choice in which some rivals take part no more; their chances are the first's."""
    chances = choice.chances
    freed = sum(chances.pop(key) for key in {*beaten} & {*chances})
    first = choice.rivals[0].key
    chances[first] = chances.get(first, 0.0) + freed
    aliases, same = (tuple(item for item in some if item.key not in beaten) for some in (choice.aliases, choice.same))
    found = tuple(chances.get(item.key, 0.0) for item in choice.rivals)
    return replace(choice, probabilities=found, aliases=aliases, same=same)


def price(blocks: Blocks, parts: int) -> float:
    """Return what a parameter costs beside the likelihood of what was held out.

    The marginal likelihood falls by half the logarithm of the number of independent observations for every parameter
    that the data determine (Schwarz 1978); that number is the number of blocks. What is held out, one of `parts` parts
    at a time, has charged some of it: half a unit that the fit gained by following noise, and half of parts/(parts - 1)
    for the error of parameters fitted to the other parts (Stone 1977).
    """
    charged = 0.5 + 0.5 * parts / max(parts - 1, 1)
    return max(schwarz(blocks) - charged, 0.0)


def schwarz(blocks: Blocks) -> float:
    """Return what a parameter costs beside the likelihood of what models were fitted to (Schwarz 1978)."""
    return 0.5 * float(np.log(max(blocks.count, 1)))


def _shared(rivals: Sequence[Rival], totals: FloatArray, whole: float, each: float) -> list[float]:
    """Return probabilities that add up to `whole`; those of the same residuals divide what they have together.

    `totals` (draws, rivals) are held-out gains, `each` is the price of a parameter.
    """
    owner = list[int]()
    for k, rival in enumerate(rivals):
        owner.append(next((owner[j] for j in range(k) if is_same(rival, rivals[owner[j]])), k))
    prices = np.array([_price(rival, each) for rival in rivals])
    shares = whole * _weights(totals - prices).mean(axis=0)
    found = list[float]()
    for k in range(len(rivals)):
        own = [j for j in range(len(rivals)) if owner[j] == owner[k]]
        part = _weights(-prices[None, own])[0][own.index(k)]
        found.append(float(np.sum(shares[own]) * part))
    return found


def _price(rival: Rival, each: float) -> float:
    """Return what a rival costs beside the likelihood of what was held out, `each` being what a parameter does."""
    standing = rival.standing
    return each * standing.determined + standing.prior + standing.exactness + float(_blames_sensor(rival))


def _blames_sensor(rival: Rival) -> bool:
    """Whether the measurement, not the machine, is to be wrong: of two equal explanations the less likely one."""
    return rival.key[0].startswith("sensor_")


def shown(aliases: Sequence[Rival], known: Collection[Key] = ()) -> tuple[Rival, ...]:
    """Return the members of an alias set that are worth naming.

    Of those that leave the same residuals as the best, only the one that says something else: another effect, and at
    another component where there is one. The others are no further explanations but the same one in other words; so is
    the same effect elsewhere, beside a rival that differs. Nor is one that has all that another has, and more. Some may
    be `known` to leave the same: fitted again beside other additions, they differ by how a kink has caught them alone.
    """
    if not aliases:
        return ()
    best = aliases[0]
    plain = [rival for rival in aliases[1:] if not any(rival.screened.holds(other.screened) for other in aliases)]
    same = [rival for rival in plain if rival.key in known or is_same(rival, best)]
    others = [rival for rival in plain if rival not in same]
    different = sorted(
        same, key=lambda rival: (rival.key[0] == best.key[0], _blames_sensor(rival), rival.key[1] == best.key[1])
    )
    twin = [rival for rival in different[:1] if not others or rival.key[0] != best.key[0]]
    return (best, *twin, *others)


def _weights(totals: FloatArray) -> FloatArray:
    """Return (resamples, rivals + 1) shares of the likelihood."""
    likelihood = np.exp(totals - totals.max(axis=1, keepdims=True))
    return likelihood / likelihood.sum(axis=1, keepdims=True)


def needed(chances: Sequence[float]) -> int:
    """Return how many rivals, best first, hold what is sure of the probability that all of them have."""
    total, held, count = sum(chances), 0.0, 0
    while held < SURE * total and count < len(chances):
        held, count = held + chances[count], count + 1
    return max(count, 1)


def probabilities(choice: Choice, gap: bool) -> Mapping[str, float]:
    """Return the probabilities of no effect and of one outside the catalogue: what no candidate explains, is either."""
    nothing, outside = (0.0, choice.nothing) if gap else (choice.nothing, 0.0)
    return {"no_effect": nothing, "outside_catalogue": outside}
