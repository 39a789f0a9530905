"""The only addition against what it resembles or may be, each in the shape that the recordings give it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from friction_ocp.diagnosis.bench import Bench
from friction_ocp.diagnosis.benchmark import Benchmark
from friction_ocp.diagnosis.finer_steps import on_steps_of
from friction_ocp.diagnosis.fitted_model import FittedModel
from friction_ocp.diagnosis.reexamine import gaining, weighed_again
from friction_ocp.diagnosis.refit import MOST_OF, begun_beside
from friction_ocp.diagnosis.rival import Rival, is_same
from friction_ocp.diagnosis.select import Round, with_first, without
from friction_ocp.diagnosis.worth import grows
from friction_ocp.effects.effect import Key
from friction_ocp.effects.registry import effects
from friction_ocp.estimation.node_ends import UNIMPORTANT


def weighed_in_shape(
    bench: Bench,
    rounds: Sequence[Round],
    grown: Callable[[Rival], Round],
    exhausted: Callable[[], bool],
    level: float,
    rng: np.random.Generator,
) -> tuple[FittedModel, list[Round]]:
    """Weigh the only addition, by its rounds, against others until effort is `exhausted`; return model and rounds then.

    In the shape that the catalogue gives them the one may come nearer to what the other is on the machine, and a shape
    tells apart what was as likely before. `grown` is the round that gives a rival its more general shape. What explains
    more for certain takes the place, as does what explains the same with fewer parameters, or is the more probable;
    what explains less for certain takes part no more, nor does what had the place, unless both say the same: then it
    is weighed like the others.
    """
    found, *shaped = rounds
    first = _on_equal_steps(bench.current, found)
    benchmark = Benchmark(bench.current)
    tried, shapes = list[Rival](), dict[Key, list[Round]]()
    for rival in _worth_weighing(first, bench, bool(shaped) or first is not found):
        if exhausted():
            break
        done = _likeliest(grown(rival)) if grows(rival, bench.clues) else None
        shapes[rival.key] = [] if done is None else [done]
        fitted = begun_beside(rival.fitted if done is None else _held(done).fitted, benchmark.fitted.linear.point.nodes)
        gains = -benchmark.dearer(fitted)
        if benchmark.yields(fitted, gains, level, rng):
            held, choice = _held(first), with_first(first.choice, rival)
            same = is_same(rival.refitted(fitted, gains), held.refitted(benchmark.fitted, gains))
            first = replace(first, choice=choice if same else without(choice, {held.key}), accepted=rival)
            tried += [held.refitted(benchmark.fitted, gains)] if same else []
            shapes[held.key], shaped, benchmark = shaped, shapes[rival.key], Benchmark(fitted)
            tried = gaining(tried, benchmark)
        elif fitted.cost > benchmark.fitted.cost + UNIMPORTANT and benchmark.certain(-gains, level, rng):
            first = replace(first, choice=without(first.choice, {rival.key}))
        else:
            tried.append(rival.refitted(fitted, gains))
    first, leader = weighed_again(first, _held(first), benchmark, tried, level, rng)
    if leader is None:
        return benchmark.fitted, [first, *shaped]
    return leader.fitted, [first, *shapes[leader.key]]


def _on_equal_steps(current: FittedModel, first: Round) -> Round:
    """Return a round with rivals that may take the place of its addition fitted on the steps of the current model.

    That was put on shorter ones once it had been added. The same round where they are not longer.
    """
    choice, chances, held = first.choice, first.choice.chances, _held(first)
    shown = {item.key for item in choice.aliases}
    done = dict[int, Rival]()

    def moved(item: Rival) -> Rival:
        simpler = chances[item.key] > 0.0 and item.standing.determined < current.determined
        if item.key == held.key or not (simpler or item.key in shown):
            return item
        fitted = item.fitted if id(item) in done else on_steps_of(current.model, item.fitted)
        if fitted is not item.fitted:
            done[id(item)] = item.refitted(fitted, item.gains)
        return done.get(id(item), item)

    sets = {name: tuple(map(moved, getattr(choice, name))) for name in ("rivals", "aliases", "same")}
    return replace(first, choice=replace(choice, **sets)) if done else first


def _likeliest(shaped: Round) -> Round | None:
    """Return a round with the shape that is more probable than none, be it not for certain, if there is one."""
    choice = shaped.choice
    if shaped.accepted is not None:
        return shaped
    likely = bool(choice.rivals) and choice.probabilities[0] > choice.nothing
    return replace(shaped, accepted=choice.rivals[0]) if likely else None


def _held(done: Round) -> Rival:
    assert done.accepted is not None
    return done.accepted


def _worth_weighing(first: Round, bench: Bench, moved: bool) -> list[Rival]:
    """Return what resembles the addition and came half as near, the nearest of that, and what has fewer parameters.

    And what it may be as well, where it was given a more general shape or shorter steps since: it has `moved`.
    """
    held, choice = _held(first), first.choice
    alike = effects()[held.key[0]].resembles
    most = (1.0 - MOST_OF) * first.before.cost + MOST_OF * bench.current.cost
    near = [
        item
        for item in choice.rivals
        if item.key[0] in alike and grows(item, bench.clues) and item.standing.cost < most
    ]
    others = sorted(near, key=lambda item: item.standing.cost)[:1]
    benchmark, chances = Benchmark(bench.current), choice.chances
    others += [
        item
        for item in choice.rivals
        if item not in others and chances[item.key] > 0.0 and benchmark.simpler(item.standing)
    ]
    if moved:
        others += [item for item in choice.aliases if item.key != held.key and item not in others]
    return others
