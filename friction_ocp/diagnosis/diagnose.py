"""Diagnosis on one page: base fit -> gap -> candidates -> choice, one addition a round -> how far."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

from friction_ocp.diagnosis.additions import forms_of
from friction_ocp.diagnosis.allowance import Tell
from friction_ocp.diagnosis.aside import OtherReadings
from friction_ocp.diagnosis.bench import open_bench
from friction_ocp.diagnosis.blind_spots import BlindSpot, blind_spots
from friction_ocp.diagnosis.crew import screen_candidate
from friction_ocp.diagnosis.excess import Excess
from friction_ocp.diagnosis.fitted_model import FittedModel
from friction_ocp.diagnosis.free_gap import FreeErrors, Shrink, comes_closer, free_errors, shrink
from friction_ocp.diagnosis.hindsight import doubted, merged, standing
from friction_ocp.diagnosis.loop import driven_as_recorded
from friction_ocp.diagnosis.options import Considered, considered, effort_of, level_of
from friction_ocp.diagnosis.predicted import LEAST_SHARE, led_by_predictions
from friction_ocp.diagnosis.reading import explains_more, is_needless, leaves_less
from friction_ocp.diagnosis.refit import begun_again
from friction_ocp.diagnosis.search import Search
from friction_ocp.diagnosis.select import Round
from friction_ocp.diagnosis.slow_torque import SlowTorque, significant
from friction_ocp.diagnosis.stand_ins import takes_almost_all
from friction_ocp.diagnosis.stated import contradictions, corrected
from friction_ocp.diagnosis.straying import DRAWS, strays_as_far
from friction_ocp.diagnosis.worth import innovations
from friction_ocp.effects.effect import Key
from friction_ocp.effects.stated_values import STATED
from friction_ocp.estimation.node_ends import UNIMPORTANT
from friction_ocp.estimation.problem import Problem
from friction_ocp.execution.effort import limited
from friction_ocp.execution.executor import InProcess
from friction_ocp.execution.linear_algebra import with_one_thread
from friction_ocp.statistics.execution import Execution

LOOKED_AT = frozenset({"closed", "_comes_closer", "stray", "lost"})
"""What a diagnosis finds out about its free runs once it is asked."""
MOST_PARTS = 4
"""Parts whose stated values may be taken back."""


@dataclass(frozen=True)
class Diagnosis:
    """The answer of a diagnosis."""

    problem: Problem
    base: FittedModel
    final: FittedModel
    rounds: tuple[Round, ...]
    """Those whose decision stood, as sure as they are in hindsight."""
    superseded: tuple[Round, ...]
    """Those whose addition was taken back, because what came later makes it superfluous."""
    accepted: tuple[Key, ...]
    level: float
    before: FreeErrors
    after: FreeErrors
    remainder: Excess
    slow: tuple[SlowTorque, ...]
    """Slow torques that the final model lacks, by shaft."""
    blind: tuple[BlindSpot, ...]
    """Effects that the final model lacks and that the recordings, made too fast, would not show."""
    seconds: float
    effort: float = 0.0
    """What the search took, over its limit."""
    cut_short: bool = False
    """Whether the search ended there, with things left to try."""
    unexamined: tuple[str, ...] = ()
    """Why candidates whose work failed were left out, a line each."""
    stated: Problem | None = None
    """The problem as it was given, where its inputs are not read as it states or its loop is opened."""

    def changed(self, **changes: Any) -> Diagnosis:
        """Return it with other probabilities of its rounds, or stated otherwise; what it has looked at does not change.

        How far noise sets free runs apart (`stray`) takes up to a hundred simulations.
        """
        other = replace(self, **changes)
        vars(other).update({name: vars(self)[name] for name in LOOKED_AT & vars(self).keys()})
        return other

    @property
    def by_predictions(self) -> bool:
        """Whether models were compared by short predictions, the simulation straying too far to lead anywhere."""
        return self.base.footing.predicted

    @property
    def gap(self) -> bool:
        """Whether the base model lacks something."""
        return bool(self.accepted) or self.left_over

    @property
    def left_over(self) -> bool:
        """Whether more than noise is left.

        Where nothing was added a slow torque of any shape tells; after an addition the power of the innovations alone,
        because a law of slightly another shape leaves a slow torque too.
        """
        slow = not self.accepted and significant(self.slow, self.level)
        return self.remainder.significant(self.level) or slow

    @cached_property
    def closed(self) -> Shrink:
        """How far the gap shrinks on recordings that took no part."""
        return shrink(self.before, self.after, self.problem.estimation.seed)

    @property
    def carries_over(self) -> bool:
        """Whether what was added shrinks the gap on recordings that took no part, or leaves nothing of it there.

        They take no part in choosing; but what helps where it was fitted alone explains nothing. Where only a stated
        value was wrong, and the innovations showed no gap, there is none to shrink; where noise alone makes free runs
        `stray` as far, they contradict nothing.
        """
        return self._comes_closer or self.stray

    @cached_property
    def _comes_closer(self) -> bool:
        """Whether free runs of recordings that took no part come closer, or there is nothing to shrink."""
        shown = any(item.excess.significant(self.level) for item in (*self.rounds, *self.superseded))
        shown |= any(effect not in STATED for effect, _ in self.accepted)
        return not (self.accepted and shown) or comes_closer(self.before, self.after, self.problem.estimation.seed)

    @cached_property
    def stray(self) -> bool:
        """Whether free runs come no closer, and noise alone sets runs of the final model as far apart.

        As torque noise may take them from where they are, or as noise of the recordings does that is simulated. Where
        more than noise is left anyway no verdict hangs on it, and few draws are enough.
        """
        if self._comes_closer:
            return False
        level = max(self.level, 1.0 / (DRAWS + 1)) if self.left_over else self.level
        return self.after.drowned or strays_as_far(self.final, self.after, self.problem.estimation.seed, level)

    @property
    def torque_noise(self) -> SlowTorque | None:
        """The shaft whose slow torques tell most, as the torque noise that these may be; None where the file states
        some."""
        stated = self.problem.estimation.process_noise.keys() - set(self.problem.estimation.estimated_noise)
        largest = max(self.slow, key=lambda item: item.ratio, default=None)
        return None if largest is None or not largest.density or largest.component in stated else largest

    @property
    def parted_by_torque(self) -> bool:
        """Whether free runs come no closer, though all but torque noise seems to be explained.

        What was added takes almost all of what was louder than the noise, and leaves slow torques alone. A loop holds a
        drive whose friction falls with speed, and corrects what torque noise does: without the same noise its recorded
        current leads every free run elsewhere, the same way, be the model as good as it may.
        """
        told = self.torque_noise is not None and significant(self.slow, self.level)
        return told and not self.carries_over and not self.left_over and takes_almost_all(self.base, self.final)

    @cached_property
    def lost(self) -> bool:
        """Whether free runs of recordings that took no part are lost with and without what was added."""
        return self.before.lost and self.after.lost

    @property
    def unexplained(self) -> bool:
        """Whether more than noise is left, where models were fitted or elsewhere."""
        return self.left_over or not self.carries_over

    @property
    def rest(self) -> str | None:
        """The component where what is left sits: where a slow torque explains most of it."""
        largest = max(self.slow, key=lambda item: item.ratio, default=None)
        return largest.component if largest is not None and self.left_over else None

    @property
    def _decided(self) -> list[Round]:
        """The rounds that brought the accepted effects, and not only another shape of one."""
        brought = {item.accepted.key: item for item in reversed(self.rounds) if item.accepted is not None}
        return [brought[key] for key in self.accepted]

    @property
    def alias_sets(self) -> tuple[tuple[Key, ...], ...]:
        """Sets of candidates that the recordings cannot tell apart, the accepted one first, where noise is left."""
        return () if self.unexplained else self._sets

    @property
    def as_near(self) -> tuple[tuple[Key, ...], ...]:
        """Sets of candidates that come as near to the recordings, the accepted one first, where something is left.

        No alias sets: the cause need not be among them.
        """
        return self._sets if self.unexplained else ()

    @cached_property
    def _sets(self) -> tuple[tuple[Key, ...], ...]:
        """Sets of candidates within the noise of one another; what was accepted elsewhere is there besides."""
        sets = [[rival.key for rival in item.choice.named] for item in self._decided]
        left = [(keys[0], *(key for key in keys[1:] if key not in self.accepted)) for keys in sets if keys]
        return tuple(keys for keys in left if len(keys) > 1)

    @property
    def same(self) -> tuple[tuple[Key, ...], ...]:
        """Sets of what is one and the same in these recordings, the accepted effect first."""
        sets = [tuple(rival.key for rival in item.choice.same) for item in self._decided]
        return tuple(keys for keys in sets if len(keys) > 1)

    @property
    def verdict(self) -> str:
        """explained, no_gap, unknown_effect or undecided."""
        if not self.gap:
            return "no_gap"
        if self.unexplained:
            return "unknown_effect"
        return "undecided" if self.alias_sets else "explained"


@with_one_thread
def diagnose(
    problem: Problem, tell: Tell = lambda what, share: None, execution: Execution = Execution(InProcess())
) -> Diagnosis:
    """Find what a model lacks; raises FrictionOcpError where the recordings do not fit the drive.

    Where the inputs, read the other way between their samples, do more by that alone than any addition, leave nothing
    with fewer additions, or less where something is left, that is how they are read. What a controller makes of noise
    is read from its recorded command.
    """
    driven = driven_as_recorded(problem)
    found = _as_read(problem if driven is None else driven, tell, execution)
    return found if driven is None else found.changed(stated=problem)


def _as_read(problem: Problem, tell: Tell, execution: Execution) -> Diagnosis:
    """Find what a model lacks, its inputs read as the problem says or the other way."""
    readings, began = OtherReadings(problem), time.perf_counter()
    search = _searched(problem, tell, execution, readings)
    if search.outdone is not None:
        read = _read_as(search.outdone, problem, tell, execution, search.allowance.taken, began)
        needless = is_needless(search.bench.base, read.final)
        return _concluded(problem, _searched(problem, tell, execution), began) if needless else read
    stated = _concluded(problem, search, began)
    if not stated.gap:
        return stated
    tell("the inputs read the other way", 0.0)
    final, accepted, left = stated.final, stated.accepted, stated.left_over
    others = readings.fitted(stated.base)
    forms = forms_of(stated.rounds)
    able = [pair for pair in others if explains_more(pair[1], stated.base, final, accepted, forms, left)]
    if not able:
        return stated
    other, _ = min(able, key=lambda pair: innovations(pair[1]).ratio)
    read = _read_as(other, problem, tell, execution, stated.effort, began)
    fewer = len(read.accepted) < len(accepted)
    better = left and leaves_less(read.final, final, fewer) if read.left_over else left or fewer
    return read if better else stated


def _read_as(read: Problem, stated: Problem, tell: Tell, execution: Execution, taken: float, began: float) -> Diagnosis:
    """Find what a model lacks whose inputs are `read` otherwise than stated, where some effort was `taken` before."""
    search = _searched(read, tell, execution, share=max(1.0 - taken, LEAST_SHARE))
    return _concluded(read, search, began).changed(stated=stated)


def _searched(
    problem: Problem, tell: Tell, execution: Execution, readings: OtherReadings | None = None, share: float = 1.0
) -> Search:
    """Search for what a model lacks, the inputs read as the problem says, by a share of the effort; others beside.

    The base fit, score tests and refits of a round are tasks: in whatever process, with the same numbers, and taken
    from the output folder where an earlier run ended them.
    """
    level, meant, patience = level_of(problem), considered(problem), share * effort_of(problem)
    tell("base model", 0.0)
    with execution.executor.kept(screen_candidate) as executor:
        run = replace(execution, executor=executor)
        search = Search(open_bench(problem, run), run, meant, level, tell, patience, readings)
        search.go()
        if search.lost_its_way and search.outdone is None:
            search = led_by_predictions(search, run)
        return search


def _concluded(problem: Problem, search: Search, began: float) -> Diagnosis:
    """Return what a search, `began` at that time, comes to."""
    level, meant = search.level, search.meant
    base, rounds, accepted = search.bench.base, search.rounds, search.accepted
    with limited(search.allowance.limit):
        current, checked = _checked(search.bench.current, base, meant, level)
    ended, left = search.bench.at(current) if checked else search.bench, innovations(current)
    accepted += [item.accepted.key for item in checked if item.accepted is not None]
    stood, superseded = standing(merged(rounds, checked), accepted)
    superseded += search.taken_back
    return _in_hindsight(
        Diagnosis(
            problem=problem,
            base=base,
            final=current,
            rounds=tuple(stood),
            superseded=tuple(superseded),
            accepted=tuple(dict.fromkeys(accepted)),
            level=level,
            before=free_errors(search.fitted_base, held_out=True),
            after=free_errors(current, held_out=True),
            remainder=left,
            slow=ended.slow,
            blind=blind_spots(current, left, ended.clues, meant),
            seconds=time.perf_counter() - began,
            effort=search.allowance.taken,
            cut_short=search.allowance.spent,
            unexamined=tuple(search.unexamined),
        )
    )


def _in_hindsight(found: Diagnosis) -> Diagnosis:
    """Return a diagnosis whose rounds are as sure as its end lets them be.

    Where models were compared by short predictions free runs go astray whatever is added, and cast no doubt.
    """
    overall = found.closed.overall
    closed = min(max(overall, 0.0), 1.0) if math.isfinite(overall) else 0.0
    unasked = found.by_predictions or found.carries_over or found.lost or found.parted_by_torque
    doubt = 0.0 if unasked else 1.0 - closed
    return found.changed(rounds=tuple(doubted(found.rounds, found.final, found.left_over, doubt)))


def _checked(
    current: FittedModel, base: FittedModel, meant: Considered, level: float
) -> tuple[FittedModel, list[Round]]:
    """Take back stated values that the model, once it leaves no more than noise, contradicts.

    Before that they may be far off because they stand in for what is missing: be it what a law of slightly another
    shape leaves, which is too little to be a gap and yet much more than what a value far from its statement costs. Or
    kinks had caught them on their way: a fit from the guesses is better then.
    """
    rounds = list[Round]()
    for _ in range(MOST_PARTS):
        power = innovations(current)
        found = contradictions(current, power, level)
        if found and not rounds:
            again = begun_again(current, base.model.space)
            if again.objective < current.objective - UNIMPORTANT:
                current, power = again, innovations(again)
                found = contradictions(current, power, level)
        choice = corrected(current, found, meant) if found else None
        if choice is None:
            break
        rounds.append(Round((), choice, current, power, choice.rivals[0]))
        current = choice.rivals[0].fitted
    return current, rounds
