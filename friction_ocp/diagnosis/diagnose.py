"""Diagnosis on one page: base fit -> gap -> candidates -> choice, one addition a round -> how far."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, cast

import numpy as np

from friction_ocp.diagnosis.bench import Bench, Crew, Tell, open_bench
from friction_ocp.diagnosis.blind_spots import BlindSpot, blind_spots
from friction_ocp.diagnosis.clues import clues_of
from friction_ocp.diagnosis.excess import FLOOR_DOUBT, Excess, excess
from friction_ocp.diagnosis.fitting import FittedModel
from friction_ocp.diagnosis.free_gap import FreeErrors, Shrink, free_errors, shrink
from friction_ocp.diagnosis.held_out import folds
from friction_ocp.diagnosis.reading import explains_more, other_reading
from friction_ocp.diagnosis.reexamine import exchanged, without_superfluous
from friction_ocp.diagnosis.rival import Rival
from friction_ocp.diagnosis.screen import Screened
from friction_ocp.diagnosis.select import Round, choose, shown, with_refused, withdrawn
from friction_ocp.diagnosis.slow_torque import SlowTorque, slow_torques
from friction_ocp.diagnosis.stated import contradictions, corrected
from friction_ocp.diagnosis.worth import (
    Key,
    gain,
    innovations,
    places,
    required,
    shapes,
    shortlist,
    with_resembling,
)
from friction_ocp.effects.registry import effects
from friction_ocp.errors import Finding, FrictionOcpError
from friction_ocp.estimation.problem import Problem
from friction_ocp.execution.executor import InProcess
from friction_ocp.statistics.execution import Execution

SIGNIFICANCE = 0.01
MOST_ROUNDS = 4
FINISHED, CLOSE = 2, 1.5
"""Candidates whose refit is completed: the best after a few steps or by prediction, and all whose objective is within
this factor."""
HOPE = 0.25
"""Predicted gain over that share from which a refit is tried: predictions fall short where effects are large."""


@dataclass(frozen=True)
class Diagnosis:
    """The answer of a diagnosis."""

    problem: Problem
    base: FittedModel
    final: FittedModel
    rounds: tuple[Round, ...]
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
    stated: Problem | None = None
    """The problem as it was given, where its inputs are not read as it states."""

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
        slow = any(item.p_value * len(self.slow) < self.level for item in self.slow)
        return self.remainder.significant(self.level) or (slow and not self.accepted)

    @cached_property
    def closed(self) -> Shrink:
        """How far the gap shrinks on recordings that took no part."""
        return shrink(self.before, self.after, self.problem.estimation.seed)

    @property
    def carries_over(self) -> bool:
        """Whether what was added shrinks the gap on recordings that took no part, or leaves nothing of it there.

        They take no part in choosing; but what helps where it was fitted alone explains nothing. Where the innovations
        showed no gap, and only a stated value was wrong, there is none to shrink.
        """
        doubt = (1.0 + FLOOR_DOUBT) ** 2 - 1.0
        shown = bool(self.accepted) and self.rounds[0].excess.significant(self.level)
        return not shown or self.after.excess() <= doubt or self.closed.interval95[0] > 0.0

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
        """Sets of candidates that the recordings cannot tell apart, the accepted one first.

        What was accepted in another round is there besides, not instead.
        """
        sets = [[rival.key for rival in shown(item.choice.aliases)] for item in self._decided]
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


def diagnose(
    problem: Problem, tell: Tell = lambda what, share: None, execution: Execution = Execution(InProcess())
) -> Diagnosis:
    """Find what a model lacks; raises FrictionOcpError where the recordings do not fit the drive.

    Where the inputs, read the other way between their samples, leave nothing with fewer additions, or where something
    was left, that is how they are read.
    """
    stated, other = _diagnosed(problem, tell, execution), other_reading(problem)
    if other is None or not stated.gap:
        return stated
    tell("the inputs read the other way", 0.0)
    if not explains_more(open_bench(other, execution).base, stated.final, stated.accepted, stated.left_over):
        return stated
    read = _diagnosed(other, tell, execution)
    simpler = not read.left_over and (stated.left_over or len(read.accepted) < len(stated.accepted))
    return replace(read, stated=problem, seconds=stated.seconds + read.seconds) if simpler else stated


def _diagnosed(problem: Problem, tell: Tell, execution: Execution) -> Diagnosis:
    """Find what a model lacks, the inputs read as the problem says.

    The base fit, score tests and refits of a round are tasks: in whatever process, with the same numbers, and taken
    from the output folder where an earlier run ended them.
    """
    began = time.perf_counter()
    level, names = _options(problem)
    tell("base model", 0.0)
    bench = open_bench(problem, execution)
    base = bench.base
    rng = np.random.default_rng(problem.estimation.seed)
    rounds, accepted = list[Round](), list[Key]()
    with execution.executor.kept() as executor:
        run = replace(execution, executor=executor)
        for number in range(1, MOST_ROUNDS + 1):
            crew = _crew(bench, run, number, tell)
            done = _round(crew, names, level, rng, required(base, bench.current), accepted)
            rounds.append(done)
            if done.accepted is None:
                break
            tell("examining earlier additions again", 0.0)
            keys = [*accepted, done.accepted.key]
            current, accepted = without_superfluous(base, done.accepted.fitted, keys, level, rng)
            if innovations(current).significant(level):
                current, rounds, accepted = exchanged(base, current, rounds, accepted, level, rng)
            bench = bench.at(current)
            if not innovations(current).significant(level):
                bench, rounds, accepted = _settled(bench, run, tell, rounds, accepted, level, rng)
                break
    if accepted and not _explains_most(base, bench.current, level):
        bench, rounds, accepted = bench.at(base), [withdrawn(rounds[0])], []
    current, checked = _checked(bench.current, names, level)
    rounds, clues, left = [*rounds, *checked], clues_of(current), innovations(current)
    accepted += [item.accepted.key for item in checked if item.accepted is not None]
    return Diagnosis(
        problem=problem,
        base=base,
        final=current,
        rounds=tuple(rounds),
        accepted=tuple(dict.fromkeys(accepted)),
        level=level,
        before=free_errors(base, held_out=True),
        after=free_errors(current, held_out=True),
        remainder=left,
        slow=slow_torques(current, clues),
        blind=blind_spots(current, left, clues, names),
        seconds=time.perf_counter() - began,
    )


def _explains_most(base: FittedModel, current: FittedModel, level: float) -> bool:
    """Whether what was added leaves nothing, or explains more of the errors of one-step predictions than it leaves.

    Else what is not known is the larger part, and what was added may be no more than its shadow.
    """
    left = innovations(current)
    return not left.significant(level) or left.beyond < 0.5 * innovations(base).beyond


def _crew(bench: Bench, run: Execution, number: int, tell: Tell) -> Crew:
    return Crew(bench, run, number, lambda what, share: tell(f"round {number}: {what}", share))


def _settled(
    bench: Bench,
    run: Execution,
    tell: Tell,
    rounds: list[Round],
    accepted: list[Key],
    level: float,
    rng: np.random.Generator,
) -> tuple[Bench, list[Round], list[Key]]:
    """Go over additions that leave nothing but noise: their more general shapes, then the rivals of earlier ones.

    What a shape leaves is too little to tell as power, and yet enough to tell rivals apart that are the same.
    """
    for _ in set(accepted):
        done = _round(_crew(bench, run, len(rounds) + 1, tell), [], level, rng, np.inf, accepted)
        if done.accepted is None:
            break
        bench, rounds, accepted = bench.at(done.accepted.fitted), [*rounds, done], [*accepted, done.accepted.key]
    if len(set(accepted)) > 1:
        tell("weighing rivals of earlier additions again", 0.0)
        current, rounds, accepted = exchanged(bench.base, bench.current, rounds, accepted, level, rng)
        bench = bench.at(current)
    return bench, rounds, accepted


def _checked(current: FittedModel, names: Sequence[str], level: float) -> tuple[FittedModel, list[Round]]:
    """Take back stated values that the model, once it leaves no more than noise, contradicts.

    Before that they may be far off because they stand in for what is missing: be it what a law of slightly another
    shape leaves, which is too little to be a gap and yet much more than what a value far from its statement costs.
    """
    rounds = list[Round]()
    for _ in range(MOST_ROUNDS):
        power = innovations(current)
        noise = not power.significant(level) and power.ratio <= (1.0 + FLOOR_DOUBT) ** 2
        found = contradictions(current) if noise else []
        if not found:
            break
        fitted, choice = corrected(current, found, names)
        rounds.append(Round((), choice, current, power, choice.rivals[0]))
        current = fitted
    return current, rounds


def considered(problem: Problem) -> list[str]:
    """Return the names of the effects that compete: the catalogue, as far as the file does not narrow it."""
    return _options(problem)[1]


def _options(problem: Problem) -> tuple[float, list[str]]:
    """Return the level of significance and the names of the effects to consider."""
    known = list(effects())
    where = f"{problem.path or problem.title}: diagnosis"
    stated: Mapping[str, Any] = problem.diagnosis
    wanted: Any = stated.get("effects") or known
    left_out: Any = stated.get("exclude") or []
    findings: list[Finding] = []
    for key, names in (("effects", wanted), ("exclude", left_out)):
        if not isinstance(names, list):
            findings.append(Finding(f"{where}.{key}", f"this is {names!r}", "a list of effects"))
            continue
        for name in cast(list[Any], names):
            if name not in known:
                available = f"available: {', '.join(known)}"
                findings.append(Finding(f"{where}.{key}", f"unknown effect {name!r}", available))
    level = stated.get("significance", SIGNIFICANCE)
    if not isinstance(level, (int, float)) or not 0.0 < level < 0.5:
        findings.append(Finding(f"{where}.significance", f"this is {level!r}", "a number between 0 and 0.5"))
    if findings:
        raise FrictionOcpError(findings)
    return float(level), [str(name) for name in wanted if name not in left_out]


def _round(
    crew: Crew, names: list[str], level: float, rng: np.random.Generator, enough: float, accepted: Sequence[Key]
) -> Round:
    """Decide on an addition; a more general shape of an accepted effect need not be worth an effect of its own."""
    current, blocks = crew.bench.current, crew.bench.blocks
    again = shapes(current, crew.bench.clues, accepted)
    found = crew.screened([*places(current, names), *again])
    power = excess(current.linear.rows, blocks)
    hopeful = [item for item in found if item.gain >= HOPE * enough or item.key in again]
    gap = power.significant(level)
    chosen = with_resembling(shortlist(hopeful, np.inf if gap else level / max(len(found), 1)), found)
    parts = len(folds(current))
    choice = choose([], blocks, parts, level, rng)
    for rivals in _completed(crew, chosen):
        able = [item.key in again or (item.standing.material and gain(current, item) >= enough) for item in rivals]
        choice = choose([item for item, yes in zip(rivals, able, strict=True) if yes], blocks, parts, level, rng)
        choice = with_refused(choice, tuple(item for item, yes in zip(rivals, able, strict=True) if not yes))
        if choice.significant or not gap:
            break
    shape = next((item for item in choice.aliases if item.key in again), None)
    best = (shape or choice.rivals[0]) if choice.significant else None
    return Round(tuple(found), choice, current, power, best)


def _completed(crew: Crew, chosen: Sequence[Screened]) -> Iterator[list[Rival]]:
    """Yield the rivals whose refits look best, their refits completed; then, if those will not do, all that were tried.

    What fits best where it was fitted may be worth nothing on recordings left out.
    """
    if not chosen:
        return
    without, refits = crew.without(chosen)
    if not refits:
        return
    current = crew.bench.current
    hopes = [min(refit.cost, current.cost - refit.screened.gain) for refit in refits]
    count = max(FINISHED, sum(hope < CLOSE * min(hopes) for hope in hopes))
    order = sorted(range(len(hopes)), key=lambda k: hopes[k])
    pairs = [refits[k] for k in order]
    rivals = crew.rivals(pairs[:count], without)
    yield rivals
    if len(pairs) > count:
        yield [*rivals, *crew.rivals(pairs[count:], without)]
