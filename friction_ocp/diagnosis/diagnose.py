"""Diagnosis on one page: base fit -> gap -> candidates -> choice, one addition a round -> how far."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, cast

import numpy as np

from friction_ocp.diagnosis.bench import Crew, Tell, blocks_like, open_bench
from friction_ocp.diagnosis.blocks import blocks_of
from friction_ocp.diagnosis.clues import clues_of
from friction_ocp.diagnosis.excess import Excess, excess
from friction_ocp.diagnosis.fitting import FittedModel, held_out, without_addition
from friction_ocp.diagnosis.free_gap import FreeErrors, free_errors
from friction_ocp.diagnosis.reading import other_reading
from friction_ocp.diagnosis.screen import Screened
from friction_ocp.diagnosis.select import Choice, Rival, choose, resamples, shown, with_refused
from friction_ocp.diagnosis.slow_torque import SlowTorque, slow_torques
from friction_ocp.diagnosis.stated import contradictions, released
from friction_ocp.drive.parts import Drive
from friction_ocp.effects.registry import candidates, effects
from friction_ocp.errors import Finding, FrictionOcpError
from friction_ocp.estimation.problem import Problem
from friction_ocp.execution.executor import InProcess
from friction_ocp.statistics.execution import Execution

SIGNIFICANCE = 0.01
MOST_ROUNDS = 4
PLAUSIBLE = 0.05
"""Level of the score test where there is a gap for certain."""
REFITTED = 6
"""Candidates that are refitted in a round."""
WORTH_REFITTING = 0.1
"""Predicted gain over the largest one below which a candidate is not refitted: the prediction is that good."""
FINISHED, CLOSE = 2, 1.5
"""Candidates whose refit is completed: the best after a few steps or by prediction, and all whose objective is within
this factor."""
MATERIAL = 0.1
"""Share of the power of free-run errors that an addition must take away: 5 % of the error, the doubt about floors."""
OF_ALL, OF_REST = 0.1, 0.4
"""Share of the excess that the base model left, or of what is left, that an addition must explain, one or the other: a
law of another shape than the machine's leaves up to a fifth of its own effect, which is no further effect; of two
effects of one size each explains half, and of that the same four fifths."""
HOPE = 0.25
"""Predicted gain over that share from which a refit is tried: predictions fall short where effects are large."""

Key = tuple[str, str]


@dataclass(frozen=True)
class Round:
    """One decision: which addition, if any."""

    screened: tuple[Screened, ...]
    """All candidates, largest predicted gain first."""
    choice: Choice
    before: FittedModel
    excess: Excess
    accepted: Rival | None


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

    @property
    def rest(self) -> str | None:
        """The component where what is left sits: where a slow torque explains most of it."""
        largest = max(self.slow, key=lambda item: item.ratio, default=None)
        return largest.component if largest is not None and self.left_over else None

    @property
    def alias_sets(self) -> tuple[tuple[Key, ...], ...]:
        """Sets of candidates that the recordings cannot tell apart."""
        decided = [item for item in self.rounds if item.accepted is not None and item.accepted.key in self.accepted]
        sets = [tuple(rival.key for rival in shown(item.choice.aliases)) for item in decided]
        return tuple(keys for keys in sets if len(keys) > 1)

    @property
    def same(self) -> tuple[tuple[Key, ...], ...]:
        """Sets of what is one and the same in these recordings, the accepted effect first."""
        decided = [item for item in self.rounds if item.accepted is not None and item.accepted.key in self.accepted]
        sets = [tuple(rival.key for rival in item.choice.same) for item in decided]
        return tuple(keys for keys in sets if len(keys) > 1)

    @property
    def verdict(self) -> str:
        """explained, no_gap, unknown_effect or undecided."""
        if not self.gap:
            return "no_gap"
        if self.left_over:
            return "unknown_effect"
        return "undecided" if self.alias_sets else "explained"


def diagnose(
    problem: Problem, tell: Tell = lambda what, share: None, execution: Execution = Execution(InProcess())
) -> Diagnosis:
    """Find what a model lacks; raises FrictionOcpError where the recordings do not fit the drive.

    Where the inputs, read the other way between their samples, leave less to explain, that is how they are read.
    """
    stated, other = _diagnosed(problem, tell, execution), other_reading(problem)
    if other is None or not stated.gap:
        return stated
    power = _innovations(open_bench(other, execution).base)
    if power.ratio >= stated.rounds[0].excess.ratio:
        return stated
    read = _diagnosed(other, tell, execution)
    simpler = (read.left_over, len(read.accepted)) < (stated.left_over, len(stated.accepted))
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
        for number in range(1, MOST_ROUNDS + 1):
            crew = Crew(
                bench,
                replace(execution, executor=executor),
                number,
                lambda what, share, n=number: tell(f"round {n}: {what}", share),
            )
            done = _round(crew, names, level, rng, _required(base, bench.current))
            rounds.append(done)
            if done.accepted is None:
                break
            tell("examining earlier additions again", 0.0)
            keys = [*accepted, done.accepted.key]
            current, accepted = _reexamined(base, done.accepted.fitted, keys, level, rng)
            bench = bench.at(current)
    current, checked = _checked(bench.current, level)
    rounds += checked
    accepted += [item.accepted.key for item in checked if item.accepted is not None]
    return Diagnosis(
        problem=problem,
        base=base,
        final=current,
        rounds=tuple(rounds),
        accepted=tuple(accepted),
        level=level,
        before=free_errors(base, held_out=True),
        after=free_errors(current, held_out=True),
        remainder=_innovations(current),
        slow=slow_torques(current, clues_of(current)),
        seconds=time.perf_counter() - began,
    )


def _innovations(fitted: FittedModel) -> Excess:
    rows = fitted.linear.rows
    return excess(rows, blocks_of(rows))


def _checked(current: FittedModel, level: float) -> tuple[FittedModel, list[Round]]:
    """Take back stated values that the model, once it leaves nothing but noise, contradicts.

    Before that they may be far off because they stand in for what is missing.
    """
    rounds = list[Round]()
    for _ in range(MOST_ROUNDS):
        power = _innovations(current)
        found = [] if power.significant(level) else contradictions(current)
        if not found:
            break
        fitted, choice = released(current, found[0])
        rounds.append(Round((), choice, current, power, choice.rivals[0]))
        current = fitted
    return current, rounds


def _reexamined(
    base: FittedModel, current: FittedModel, accepted: list[Key], level: float, rng: np.random.Generator
) -> tuple[FittedModel, list[Key]]:
    """Drop earlier additions that the latest one has made superfluous on recordings left out."""
    for key in accepted[:-1]:
        kept = [other for other in accepted if other != key]
        simpler = without_addition(current, _with_additions(base, kept))
        blocks = blocks_of(current.linear.rows)
        gains = blocks_like(current, simpler, blocks) - blocks.sums(held_out(current))
        if np.quantile(resamples(blocks, rng) @ gains, level) <= 0:
            current, accepted = simpler, kept
    return current, accepted


def _with_additions(base: FittedModel, keys: Sequence[Key]) -> Drive:
    """Return the drive of the base model with some effects, as they would be added in this order."""
    drive, clues = base.model.problem.drive, clues_of(base)
    for effect, place in keys:
        drive = effects()[effect].augment(drive, place, clues).drive
    return drive


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


def _gain(current: FittedModel, rival: Rival) -> float:
    """Return what a rival gains for certain: held out, but no more than where it was fitted."""
    return min(float(np.sum(rival.gains)), current.objective - rival.fitted.objective)


def _required(base: FittedModel, current: FittedModel) -> float:
    """Return the decrease of the objective that makes an addition an effect of its own."""
    whole, rest = (max(item.objective - 0.5 * samples(item), 0.0) for item in (base, current))
    return min(OF_ALL * whole, OF_REST * rest)


def samples(fitted: FittedModel) -> int:
    """Return the number of samples that an objective counts."""
    rows = fitted.linear.rows
    return int(np.sum((rows.channel >= 0) & (rows.residual != 0.0)))


def _round(crew: Crew, names: list[str], level: float, rng: np.random.Generator, required: float) -> Round:
    current, blocks = crew.bench.current, crew.bench.blocks
    found = crew.screened(_places(current, names))
    power = excess(current.linear.rows, blocks)
    hopeful, gap = [item for item in found if item.gain >= HOPE * required], power.significant(level)
    large = OF_REST * max(current.objective - 0.5 * samples(current), 0.0)
    shortlist = _shortlist(hopeful, PLAUSIBLE, large) if gap else _shortlist(hopeful, level / max(len(found), 1))
    rivals = _rivals(crew, shortlist)
    able = [_gain(current, item) >= required and _is_material(current, item.fitted) for item in rivals]
    choice = choose([item for item, yes in zip(rivals, able, strict=True) if yes], blocks, level, rng)
    best = choice.rivals[0] if choice.significant else None
    refused = tuple(item for item, yes in zip(rivals, able, strict=True) if not yes)
    return Round(tuple(found), with_refused(choice, refused), current, power, best)


def _shortlist(found: Sequence[Screened], limit: float, large: float = np.inf) -> list[Screened]:
    """Return candidates that are worth a refit.

    Where there is a gap for certain, a mere sign of significance is enough as the limit, or a `large` predicted gain,
    which may come from a few blocks alone: the decision is made on recordings left out. Otherwise the limit is
    corrected for the number of candidates (Bonferroni). Places compete: an effect that is worth it at one of them is
    refitted at the others, too.
    """
    significant = [item for item in found if (item.p_value < limit or item.gain >= large) and item.gain > 0]
    if not significant:
        return []
    worth = WORTH_REFITTING * significant[0].gain
    named = {item.effect for item in significant if item.gain >= worth}
    return [item for item in found if item.effect in named and item.gain >= worth][:REFITTED]


def _rivals(crew: Crew, shortlist: Sequence[Screened]) -> list[Rival]:
    if not shortlist:
        return []
    without, refits = crew.without(shortlist)
    current = crew.bench.current
    hopes = [
        min(fitted.objective, current.objective - item.gain) for item, fitted in zip(shortlist, refits, strict=True)
    ]
    count = max(FINISHED, sum(hope < CLOSE * min(hopes) for hope in hopes))
    worst = sorted(hopes)[:count][-1]
    pairs = zip(shortlist, refits, strict=True)
    kept = [pair for pair, hope in zip(pairs, hopes, strict=True) if hope <= worst]
    return crew.rivals(kept, without)


def _places(current: FittedModel, names: list[str]) -> list[Key]:
    """Return effects and places; static points also show friction of shafts whose motion an input prescribes."""
    drive = current.model.problem.drive
    places = [(effect.name, place) for effect, place in candidates(drive, names)]
    prescribed = {item.part for item in drive.inputs if item.signal in ("theta", "omega")}
    if not current.model.static or not prescribed:
        return places
    channels = tuple(replace(item, role="output") if item.part in prescribed else item for item in drive.channels)
    free = candidates(replace(drive, channels=channels), names)
    return list(dict.fromkeys([*places, *((effect.name, place) for effect, place in free if place in prescribed)]))


def _is_material(current: FittedModel, fitted: FittedModel) -> bool:
    """Whether an addition takes away more than the floors are in doubt by: of free runs, or of static points."""
    before, after = free_errors(current, held_out=False), free_errors(fitted, held_out=False)
    pairs = [(before.excess(), after.excess()), (_static_excess(current), _static_excess(fitted))]
    return any(one - other > MATERIAL * (1.0 + other) for one, other in pairs)


def _static_excess(fitted: FittedModel) -> float:
    """Return the mean square of static points' errors over their standard errors, beyond 1."""
    rows = fitted.linear.rows
    own = np.isin(rows.recording, rows.static)
    return max(0.0, float(np.mean(rows.residual[own] ** 2)) - 1.0) if np.any(own) else 0.0
