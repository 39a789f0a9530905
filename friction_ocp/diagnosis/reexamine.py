"""Earlier additions, each examined again when the next is in: dropped, exchanged for what competed with it then, or
found to be what the recordings cannot tell from it."""

from __future__ import annotations

from collections.abc import Callable, Collection, Hashable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from friction_ocp.diagnosis.additions import forms_of, with_additions
from friction_ocp.diagnosis.bench import Bench, point_document, seated, value_of
from friction_ocp.diagnosis.benchmark import Benchmark
from friction_ocp.diagnosis.clues import clues_of
from friction_ocp.diagnosis.fitted_model import FittedModel
from friction_ocp.diagnosis.held_out import folds
from friction_ocp.diagnosis.kinks import freed
from friction_ocp.diagnosis.led_back import led_back
from friction_ocp.diagnosis.polishing import loosely, polished, timed
from friction_ocp.diagnosis.refit import MOST_OF, completed, levelled, with_nodes_of, without_addition
from friction_ocp.diagnosis.rival import Rival, is_another, is_same
from friction_ocp.diagnosis.select import Round, choose, gave_shape, turned
from friction_ocp.diagnosis.worth import ALMOST, OF_ALL, may_grow, required, samples
from friction_ocp.drive.parts import Drive
from friction_ocp.effects.effect import Key
from friction_ocp.estimation.model import with_drive
from friction_ocp.execution.run import run_tasks
from friction_ocp.execution.task import Json, Task
from friction_ocp.statistics.execution import Execution

TRIED = 2
"""Rivals of an earlier addition, best first, that are tried in its place."""


def gone_back(bench: Bench, extended: FittedModel, first: bool) -> Bench | None:
    """Return the bench of a better fit of the current model where it does what an addition did; None where it does not.

    Then the addition was no more than a way out of where the fit had been caught. The `first` one led the base model.
    """
    known = bench.current
    back = led_back(extended, known.model)
    if back is None:
        return None
    found = freed(timed(polished(known.model, known.footing, back, None)))
    if known.objective - found.objective < MOST_OF * (known.objective - extended.objective):
        return None
    moved = bench.at(found)
    return replace(moved, base_point=moved.seat.point) if first else moved


def without_superfluous(
    bench: Bench,
    rounds: Sequence[Round],
    accepted: list[Key],
    level: float,
    rng: np.random.Generator,
    run: Execution,
    latest: bool = True,
) -> tuple[FittedModel, list[Key]]:
    """Drop earlier additions that the `latest` one, which stays, has made superfluous on recordings left out.

    Superfluous is what neither gains for certain there nor is worth an addition in sum; beside what leaves no more than
    noise, what is not worth its parameters. Where none is the latest, one stays.
    """
    current, benchmark, forms = bench.current, Benchmark(bench.current), forms_of(rounds)
    earlier = list(dict.fromkeys(accepted[:-1] if latest else accepted))
    known = _fits(
        bench, run, {key: _Wanted(with_additions(bench.base, _less(accepted, key), forms)) for key in earlier}
    )
    for key in earlier:
        kept = _less(accepted, key)
        if not kept and not latest:
            break
        if current is bench.current:
            simpler = known[key]
        else:
            simpler = without_addition(current, with_additions(bench.base, kept, forms))
        if simpler is None or not simpler.holds:
            continue
        gains = benchmark.dearer(simpler)
        little = float(np.sum(gains)) < required(bench.base, simpler) or benchmark.simpler(simpler)
        if little and not benchmark.certain(gains, level, rng):
            current, accepted, benchmark = simpler, kept, Benchmark(simpler)
    return current, accepted


def without_small(bench: Bench, rounds: Sequence[Round], accepted: list[Key]) -> tuple[FittedModel, list[Key]]:
    """Drop additions, the latest first, without which little more of the whole gap is left; one stays.

    For where more than noise is left at the end, though all was tried. A small addition is one for what it does to
    the rest: two effects of which one is small leave next to nothing, and what takes almost all that is left
    without it stays. Beside something unknown the rest is what stand-ins for it leave, whose shape is not quite
    that of the machine, and what explains a part of that is no further effect.
    """
    current, forms = bench.current, forms_of(rounds)
    least = OF_ALL * (bench.base.cost - 0.5 * samples(bench.base))
    for key in reversed(dict.fromkeys(accepted)):
        kept = _less(accepted, key)
        simpler = without_addition(current, with_additions(bench.base, kept, forms)) if kept else None
        if simpler is None or not simpler.holds:
            continue
        if simpler.cost - current.cost < min(least, ALMOST * (simpler.cost - 0.5 * samples(simpler))):
            current, accepted = simpler, kept
    return current, accepted


def exchanged(
    bench: Bench,
    rounds: Sequence[Round],
    accepted: list[Key],
    level: float,
    rng: np.random.Generator,
    run: Execution,
    exhausted: Callable[[], bool] = lambda: False,
) -> tuple[FittedModel, list[Round], list[Key]]:
    """Put rivals in the place of earlier additions where, beside the later ones, they explain more for certain.

    Alone they were further off: two effects are more than each of them, and what is nearest to both is neither. What
    explains nearly as much begins again from the node states of the better of the two: kinks tell nothing apart. A
    rival that explains the same with fewer parameters takes the place, too. Where there is none the rivals are weighed
    again: beside all that was missing then a small difference looked like a large one. Once the search is `exhausted`
    nothing is fitted again beside what has taken another's place.
    """
    done, current, benchmark, began = list(rounds), bench.current, Benchmark(bench.current), accepted
    wanted = dict[tuple[Key, Key], _Wanted]()
    for index, item in enumerate(done[:-1]):
        held = item.accepted
        if held is not None and _is_open(done, index, accepted):
            for rival in _others(bench, item, accepted):
                keys = _swapped(accepted, held.key, rival.key)
                drive = with_additions(bench.base, keys, forms_of(rounds, {held.key: rival.key}))
                wanted[held.key, rival.key] = _Wanted(drive, rival.standing.values)
    known = _fits(bench, run, wanted)
    for index, item in enumerate(done[:-1]):
        held = item.accepted
        if held is None or not _is_open(done, index, accepted):
            continue
        seen, tried, made = set[Key](), list[Rival](), {held.key: accepted}
        others = _others(bench, item, accepted)
        while others:
            rival = others.pop(0)
            seen.add(rival.key)
            keys = made[rival.key] = _swapped(accepted, held.key, rival.key)
            if accepted == began and (held.key, rival.key) in known:
                swapped = known[held.key, rival.key]
            elif exhausted():
                break
            else:
                drive = with_additions(bench.base, keys, forms_of(done, {held.key: rival.key}))
                swapped = _fitted(bench, current, drive, rival.standing.values)
            if swapped is None or not swapped.holds or is_another(rival.screened, swapped):
                continue
            better, swapped = levelled(current, swapped, item.before.cost)
            if better is not current:
                current, benchmark = better, Benchmark(better)
                tried = gaining(tried, benchmark)
            gains = -benchmark.dearer(swapped)
            if benchmark.yields(swapped, gains, level, rng):
                seen.add(held.key)
                former = [held.refitted(current, gains), *tried]
                held, current, accepted, benchmark = rival, swapped, keys, Benchmark(swapped)
                item = replace(item, accepted=rival, choice=turned(item.choice, rival))
                tried = gaining(former, benchmark)
                others = _others(bench, item, accepted, seen)
            else:
                tried.append(rival.refitted(swapped, gains))
        done[index], leader = weighed_again(item, held, benchmark, tried, level, rng)
        if leader is not None:
            current, benchmark = leader.fitted, Benchmark(leader.fitted)
            accepted = made[leader.key]
    return current, done, accepted


@dataclass(frozen=True)
class _Wanted:
    """Additions to fit together: what is left of the current ones, or them with one exchanged."""

    drive: Drive
    alone: Mapping[str, float] | None = None
    """Where the one that is exchanged ended by itself."""


def _less(accepted: Sequence[Key], key: Key) -> list[Key]:
    return [other for other in accepted if other != key]


def _is_open(rounds: Sequence[Round], index: int, accepted: Sequence[Key]) -> bool:
    """Whether what a round brought is accepted, and the round no more than gave it a more general shape."""
    held = rounds[index].accepted
    if held is None or held.key not in accepted:
        return False
    return accepted.count(held.key) == 1 or not gave_shape(rounds, index)


def _swapped(accepted: Sequence[Key], held: Key, rival: Key) -> list[Key]:
    """Return additions with one in the place of another; the same effect elsewhere takes its more general shape on.

    What is there in a more general shape already does the work of both as it is.
    """
    if rival[0] == held[0]:
        return [rival if other == held else other for other in accepted]
    if accepted.count(rival) > 1:
        return _less(accepted, held)
    first = accepted.index(held)
    return [rival if k == first else other for k, other in enumerate(accepted) if k == first or other != held]


Name = TypeVar("Name", bound=Hashable)


def _fits(bench: Bench, run: Execution, wanted: Mapping[Name, _Wanted]) -> dict[Name, FittedModel | None]:
    """Return fits of other additions than those of the bench, worked out beside one another; None of what broke down.

    They are set up again when they are looked at, which all of them are.
    """
    tasks = {
        name: Task(f"instead-{k}", fit_instead, (item.drive, item.alone))
        for k, (name, item) in enumerate(wanted.items())
    }
    if not tasks:
        return {}
    outcomes = run_tasks(
        "examining additions again", list(tasks.values()), bench, bench.fingerprint, run.executor, run.ledger
    )
    found = dict[Name, FittedModel | None]()
    for name, item in wanted.items():
        point = value_of(outcomes[tasks[name].key])
        model = with_drive(bench.base.model, item.drive)
        found[name] = None if point is None else seated(model, bench.base.footing, point)
    return found


def fit_instead(bench: Bench, drive: Drive, alone: Mapping[str, float] | None) -> Json:
    """Fit a drive with other additions than the bench; the value says where, null where the simulation breaks down."""
    current = bench.current
    fitted = without_addition(current, drive) if alone is None else _fitted(bench, current, drive, alone)
    return point_document(fitted) if fitted.holds else None


def _others(bench: Bench, item: Round, accepted: Sequence[Key], seen: Collection[Key] = ()) -> list[Rival]:
    """Return the rivals of a round to be tried in the place of what it has found.

    Those that came nearest, and those that took half as much with fewer parameters: what they lacked may be what was
    found later. One that was accepted since may do the work of both, in a more general shape.
    """

    assert item.accepted is not None
    own = item.accepted.key

    def open_to(key: Key) -> bool:
        return key not in accepted or may_grow(with_additions(bench.base, [key]), key, clues_of(bench.base))

    others = [rival for rival in item.choice.rivals if rival.key not in {own, *seen} and open_to(rival.key)]
    others = sorted(others, key=lambda rival: rival.standing.cost)
    held = item.accepted.standing
    most = (1.0 - MOST_OF) * item.before.cost + MOST_OF * held.cost
    simpler = [rival for rival in others[TRIED:] if rival.standing.determined < held.determined]
    return others[:TRIED] + [rival for rival in simpler if rival.standing.cost <= most][:TRIED]


def _fitted(bench: Bench, current: FittedModel, drive: Drive, alone: Mapping[str, float]) -> FittedModel:
    """Fit a drive with some additions, from where one of them ended by itself and what the others are now.

    Or from where all but that one are now, if that is nearer, or from where loosely joined segments lead free runs, or
    with the segments of the current model, where they are of the same kind: on their own they may stick otherwise.
    """
    model = with_drive(bench.base.model, drive)
    starts = [{**current.values, **alone}, {**alone, **current.values}]
    begins = [model.space.with_known(known) for known in starts]
    if bench.base.footing.segment_s is None:
        begins.append(loosely(model, starts[0]))
    ends = [polished(model, bench.base.footing, theta, None) for theta in begins]
    nodes = with_nodes_of(ends[0], current.linear.point.nodes)
    if nodes is not None:
        ends.append(polished(model, bench.base.footing, begins[0], nodes))
    best = min(ends, key=lambda end: end.objective)
    return best if best.astray and not current.astray else completed(best)


def gaining(rivals: Sequence[Rival], benchmark: Benchmark) -> list[Rival]:
    """Return rivals with their gains over another model."""
    return [rival.refitted(rival.fitted, -benchmark.dearer(rival.fitted)) for rival in rivals]


def weighed_again(
    item: Round, held: Rival, benchmark: Benchmark, tried: Sequence[Rival], level: float, rng: np.random.Generator
) -> tuple[Round, Rival | None]:
    """Return a round with the chances that rivals have in the place of what it `held`, now that others are in.

    What they gain is counted from what was accepted, which is worth what the best of the round was: what took its place
    may have been worth nothing before the later ones were in. Where one of them is now the more probable it is accepted
    instead, and returned beside, with its fit.
    """
    if not tried:
        return item, None
    known = item.choice.chances
    best = max(float(np.nansum(rival.gains)) for rival in (held, *item.choice.rivals))
    worth = np.full(benchmark.blocks.count, best / benchmark.blocks.count)
    own = held.refitted(benchmark.fitted, worth)
    others = [replace(rival, gains=worth + rival.gains) for rival in tried]
    again = choose([own, *others], benchmark.blocks, len(folds(benchmark.fitted)), level, rng)
    keys = {rival.key for rival in again.rivals}
    shared = sum(known[key] for key in keys) / sum(again.probabilities)
    known |= {key: shared * chance for key, chance in again.chances.items()}
    leader = again.rivals[0]
    aliases = [leader, *(rival for rival in again.aliases if rival is not leader)]
    aliases += [rival for rival in item.choice.aliases if rival.key not in keys]
    twins = {rival.key: rival for rival in item.choice.twins(leader.key)}
    twins |= {rival.key: rival for rival in again.rivals if rival is not leader and is_same(rival, leader)}
    order = sorted(item.choice.rivals, key=lambda rival: (rival.key != leader.key, -known[rival.key]))
    choice = replace(
        item.choice,
        rivals=tuple(order),
        probabilities=tuple(known[rival.key] for rival in order),
        aliases=tuple(aliases),
        same=(leader, *twins.values()),
    )
    return replace(item, accepted=order[0], choice=choice), None if leader is own else leader
