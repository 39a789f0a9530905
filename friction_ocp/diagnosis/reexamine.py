"""Earlier additions, each examined again when the next is in: dropped, exchanged for what competed with it then, or
found to be what the recordings cannot tell from it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from friction_ocp.diagnosis.bench import blocks_like
from friction_ocp.diagnosis.blocks import Blocks, blocks_of
from friction_ocp.diagnosis.fitting import FittedModel, completed, polished, without_addition
from friction_ocp.diagnosis.held_out import folds, held_out
from friction_ocp.diagnosis.reading import with_additions
from friction_ocp.diagnosis.rival import Rival, is_same
from friction_ocp.diagnosis.select import Choice, Round, choose, resamples, schwarz, turned
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
    benchmark = _Benchmark(current)
    for key in dict.fromkeys(accepted[:-1]):
        kept = [other for other in accepted if other != key]
        simpler = without_addition(current, with_additions(base, kept))
        if not simpler.holds:
            continue
        gains = benchmark.dearer(simpler)
        if not benchmark.certain(gains, level, rng) and float(np.sum(gains)) < required(base, simpler):
            current, accepted, benchmark = simpler, kept, _Benchmark(simpler)
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

    Alone they were further off: two effects are more than each of them, and what is nearest to both is neither. A rival
    that explains the same with fewer parameters takes the place, too. Where there is none the rivals are weighed again:
    beside all that was missing then a small difference looked like a large one.
    """
    done, benchmark = list(rounds), _Benchmark(current)
    for index, item in enumerate(done[:-1]):
        held = item.accepted
        if held is None or accepted.count(held.key) != 1:
            continue
        seen, tried = set[Key](), list[Rival]()
        others = _others(item.choice, accepted)
        while others:
            rival = others.pop(0)
            seen.add(rival.key)
            keys = [rival.key if other == held.key else other for other in accepted]
            swapped = _fitted(base, current, rival, keys)
            if not swapped.holds:
                continue
            gains = -benchmark.dearer(swapped)
            more = swapped.cost < current.cost and benchmark.certain(gains, level, rng)
            if more or benchmark.simpler(swapped):
                seen.add(held.key)
                held, current, accepted, benchmark = rival, swapped, keys, _Benchmark(swapped)
                item = replace(item, accepted=rival, choice=turned(item.choice, rival))
                tried, others = list[Rival](), _others(item.choice, [*accepted, *seen])
            else:
                tried.append(rival.refitted(swapped, gains))
        done[index], leader = _weighed_again(item, held, benchmark, tried, level, rng)
        if leader is not None:
            current, benchmark = leader.fitted, _Benchmark(leader.fitted)
            accepted = [leader.key if other == held.key else other for other in accepted]
    return current, done, accepted


def _others(choice: Choice, known: Sequence[Key]) -> list[Rival]:
    others = [rival for rival in choice.rivals if rival.key not in known]
    return sorted(others, key=lambda rival: rival.standing.cost)[:TRIED]


def _fitted(base: FittedModel, current: FittedModel, rival: Rival, keys: Sequence[Key]) -> FittedModel:
    """Fit the base model with some additions, from where the rival ended and what the later ones are now.

    Or from where all but the rival are now, if that is nearer.
    """
    model = with_drive(base.model, with_additions(base, keys))
    alone = rival.standing.values
    starts = [{**current.values, **alone}, {**alone, **current.values}]
    ends = [polished(model, base.footing, model.space.with_known(known), None) for known in starts]
    return completed(min(ends, key=lambda end: end.objective))


def _weighed_again(
    item: Round, held: Rival, benchmark: _Benchmark, tried: Sequence[Rival], level: float, rng: np.random.Generator
) -> tuple[Round, Rival | None]:
    """Return a round with the chances that rivals have in the place of what it `held`, now that others are in.

    What they gain is counted from what was accepted, which is worth what it was. Where one of them is now the more
    probable it is accepted instead, and returned beside, with its fit.
    """
    if not tried:
        return item, None
    known = dict(zip((rival.key for rival in item.choice.rivals), item.choice.probabilities, strict=True))
    worth = np.full(benchmark.blocks.count, float(np.sum(held.gains)) / benchmark.blocks.count)
    own = held.refitted(benchmark.fitted, worth)
    others = [replace(rival, gains=worth + rival.gains) for rival in tried]
    again = choose([own, *others], benchmark.blocks, len(folds(benchmark.fitted)), level, rng)
    keys = {rival.key for rival in again.rivals}
    shared = sum(known[key] for key in keys)
    known |= {rival.key: shared * chance for rival, chance in zip(again.rivals, again.probabilities, strict=True)}
    leader = again.rivals[0]
    aliases = [leader, *(rival for rival in again.aliases if rival is not leader)]
    aliases += [rival for rival in item.choice.aliases if rival.key not in keys]
    order = sorted(item.choice.rivals, key=lambda rival: (rival.key != leader.key, -known[rival.key]))
    choice = replace(
        item.choice,
        rivals=tuple(order),
        probabilities=tuple(known[rival.key] for rival in order),
        aliases=tuple(aliases),
        same=(leader, *(rival for rival in again.rivals if rival is not leader and is_same(rival, leader))),
    )
    return replace(item, accepted=order[0], choice=choice), None if leader is own else leader


@dataclass(frozen=True)
class _Benchmark:
    """A model that others are compared with on recordings left out; it is looked at once."""

    fitted: FittedModel

    @cached_property
    def blocks(self) -> Blocks:
        """Blocks of its residuals."""
        return blocks_of(self.fitted.linear.rows)

    @cached_property
    def _costs(self) -> FloatArray:
        return self.blocks.sums(held_out(self.fitted))

    def dearer(self, other: FittedModel) -> FloatArray:
        """Return (blocks,) what another model costs more than this one."""
        return blocks_like(self.fitted, other, self.blocks) - self._costs

    def simpler(self, other: FittedModel) -> bool:
        """Whether another model has fewer parameters and costs no more than they are worth (Schwarz 1978)."""
        fewer = self.fitted.determined - other.determined
        return fewer > 0 and other.cost - self.fitted.cost < schwarz(self.blocks) * fewer

    def certain(self, gains: FloatArray, level: float, rng: np.random.Generator) -> bool:
        """Whether gains in the blocks of this model are more than chance makes of nothing."""
        return bool(np.quantile(resamples(self.blocks, rng) @ gains, level) > 0)
