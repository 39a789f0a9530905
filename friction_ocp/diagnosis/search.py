"""Additions one by one: the rounds of a diagnosis, and what is gone over again between them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from friction_ocp.diagnosis.additions import forms_of, with_additions
from friction_ocp.diagnosis.allowance import Tell, measured_out
from friction_ocp.diagnosis.aside import OtherReadings
from friction_ocp.diagnosis.bench import Bench, bettered, on_shorter_steps, opened_better, sharpened
from friction_ocp.diagnosis.benchmark import beats
from friction_ocp.diagnosis.contenders import completed_rivals, displaced, to_refit, with_outright
from friction_ocp.diagnosis.crew import Crew
from friction_ocp.diagnosis.excess import excess
from friction_ocp.diagnosis.finer_steps import SEARCHING, on_steps_of
from friction_ocp.diagnosis.fitted_model import FittedModel
from friction_ocp.diagnosis.held_out import folds
from friction_ocp.diagnosis.kinks import freed
from friction_ocp.diagnosis.left_out import LeftOut
from friction_ocp.diagnosis.options import NONE, Considered, places
from friction_ocp.diagnosis.reexamine import exchanged, gone_back, without_small, without_superfluous
from friction_ocp.diagnosis.refit import MOST_OF, without_addition
from friction_ocp.diagnosis.rival import Rival, is_same
from friction_ocp.diagnosis.select import Round, choose, with_first, with_refused, withdrawn
from friction_ocp.diagnosis.slow_torque import significant
from friction_ocp.diagnosis.weighed_shapes import weighed_in_shape
from friction_ocp.diagnosis.worth import gain, grows, innovations, may_grow, required, samples, shapes, shortlist
from friction_ocp.effects.effect import Key
from friction_ocp.estimation.node_ends import UNIMPORTANT
from friction_ocp.estimation.problem import Problem
from friction_ocp.estimation.refinement import SHIFT
from friction_ocp.execution.effort import limited
from friction_ocp.statistics.execution import Execution

MOST_ROUNDS = 4
NOTABLE = 0.05
"""Share of what is left by which another fit of the same model must be better to look for effects anew."""
INSTEAD = 2
"""Other effects, nearest first, from which the search goes on where the first addition leads nowhere."""
HOPE = 0.25
"""Predicted gain over that share from which a refit is tried: predictions fall short where effects are large."""


@dataclass
class Search:
    """Adds to a base model what its recordings ask for, until noise is left or nothing helps."""

    bench: Bench
    """Of the model with what was accepted."""
    run: Execution
    meant: Considered
    """What competes."""
    level: float
    tell: Tell
    patience: float = 1.0
    """Effort that the search may take, over the usual one."""
    readings: OtherReadings | None = None
    """Other readings of the inputs, to be looked at where something is missing."""
    rounds: list[Round] = field(default_factory=list[Round])
    accepted: list[Key] = field(default_factory=list[Key])
    taken_back: list[Round] = field(default_factory=list[Round])
    """Rounds that no longer count, with what they had added."""
    outdone: Problem | None = None
    """The problem with its inputs read another way, where that alone does more than any addition: no more is tried."""
    unexamined: list[str] = field(default_factory=list[str])
    """Why candidates whose work failed were left out, a line each."""
    _begun: int = 0
    _fitted_base: FittedModel | None = None

    def __post_init__(self) -> None:
        self.rng = np.random.default_rng(self.bench.problem.estimation.seed)
        self._left_out = LeftOut(self.run)
        self.allowance = measured_out(self.bench.base, self.patience, self.tell)

    @property
    def fitted_base(self) -> FittedModel:
        """The base model on the footing that it was fitted on, which need not be the one that the search ends on."""
        return self._fitted_base or self.bench.base

    @property
    def lost_its_way(self) -> bool:
        """Whether simulations of a model far off lead nowhere: nothing was added, or it stays far off with that."""
        base = self.bench.base
        return base.astray and not base.footing.predicted and (not self.accepted or self.bench.current.astray)

    def go(self) -> None:
        """Add until noise is left, nothing helps or the rounds are used up; then look at all of it again."""
        with limited(self.allowance.limit):
            self._add()
        if self.outdone is not None:
            return
        unknown = not self.allowance.spent and innovations(self.bench.current).significant(self.level)
        if unknown and len(set(self.accepted)) > 1:
            current, self.accepted = without_small(self.bench, self.rounds, self.accepted)
            self.bench = self.bench.at(current)
        if self.accepted and not self._left_out.helps(self.bench, self.level):
            self._withdraw()
        if self.accepted:
            with limited(self.allowance.limit):
                self._sharpen()
            self.bench = on_shorter_steps(self.bench, SHIFT)

    def _add(self) -> None:
        for _ in range(MOST_ROUNDS):
            done = self._round(self.bench, self.accepted, self.meant)
            if not self.rounds and self._seems_missing(done) and self._better_base():
                done = self._round(self.bench, self.accepted, self.meant)
            back = None if done.accepted is None else gone_back(self.bench, done.accepted.fitted, not self.accepted)
            if back is not None:
                self.bench = back
                done = self._round(self.bench, self.accepted, self.meant)
            if done.accepted is None and done.excess.significant(self.level):
                done = self._in_its_shape(done) or self._elsewhere() or done
            self.outdone = None if self.rounds else self._read_better(done)
            self.rounds.append(done)
            if self.outdone is not None:
                return
            if done.accepted is None:
                break
            self._take(done.accepted)
            if not innovations(self.bench.current).significant(self.level):
                self._settle()
                if not self._left_out.fall_short(self.bench, self.level):
                    break
            if self.allowance.exhausted():
                self._give_shapes()
                break

    def _seems_missing(self, first: Round) -> bool:
        """Whether candidates were worth refits, or a slow torque is missing, where the base model leaves just noise."""
        noise = not first.excess.significant(self.level)
        return noise and (bool(first.choice.rivals) or significant(self.bench.slow, self.level))

    def _read_better(self, first: Round) -> Problem | None:
        """Return the problem with its inputs read another way, if that does more than any addition of the first round.

        Without a parameter more it has to be worth an addition. What is astray comes nearer by chance.
        """
        if self.readings is None or not first.excess.significant(self.level):
            return None
        current = self.bench.current
        enough = current.cost - required(self.bench.base, current)
        reached = min([enough, *(rival.standing.cost for rival in first.choice.rivals)])
        ends = [pair for pair in self.readings.fitted(self.bench.base) if not (current.astray and pair[1].astray)]
        able = [(end.cost, read) for read, end in ends if end.cost < reached]
        return min(able, key=lambda pair: pair[0], default=(0.0, None))[1]

    def _better_base(self) -> bool:
        """Look for a better fit of the base model; whether there is one."""
        known, self.bench = self.bench, opened_better(self.bench, self.run)
        return self.bench is not known

    def _in_its_shape(self, done: Round) -> Round | None:
        """Take what explains most, and yet not for certain, for what it is in its more general shape, if that is.

        What the catalogue's shape of an effect leaves may be so much that whether it helps is chance.
        """
        current = self.bench.current
        noise = 0.5 * samples(current)
        rival = next(iter(done.choice.rivals), None)
        if rival is None or current.cost - rival.standing.cost < MOST_OF * (current.cost - noise):
            return None
        if not grows(rival, self.bench.clues) or self.allowance.exhausted():
            return None
        bench, keys = self.bench.at(rival.fitted), [*self.accepted, rival.key]
        grown = self._round(bench, keys, NONE)
        if grown.accepted is None or not beats(grown.accepted.fitted, current, self.level, self.rng):
            return None
        self.rounds.append(replace(done, accepted=rival))
        self.bench, self.accepted = bench, keys
        return grown

    def _elsewhere(self) -> Round | None:
        """Look for an addition from other models than the current one."""
        for way in (self._from_better, self._from_alias, self._reopened, self._from_rival):
            done = None if not self.accepted or self.allowance.exhausted() else way()
            if done is not None:
                return done
        return None

    def _from_better(self) -> Round | None:
        """Go on from a better fit of what was accepted, if there is one: what is left may be no more than that."""
        known, better = self.bench.current, bettered(self.bench, self.run)
        notable = NOTABLE * (known.objective - 0.5 * samples(known))
        if better is self.bench or known.objective - better.current.objective < notable:
            return None
        self.bench = self.bench.at(better.current)
        return self._round(self.bench, self.accepted, self.meant)

    def _from_alias(self) -> Round | None:
        """Go on from what might be in the place of the last addition, where that itself leads nowhere.

        That is what the recordings could not tell from it, since of two effects the one may be found only beside the
        other; and what came as near to them and may have a more general shape, where the addition may not.
        Not where the model is as far from the recordings as before: what came nearest to them then says little.
        """
        last = self.rounds[-1] if self.rounds else None
        if last is None or last.accepted is None:
            return None
        if self.bench.current.astray and last.accepted.standing.cost > MOST_OF * last.before.cost:
            return None
        before = [key for key in self.accepted if key != last.accepted.key]
        cost, tried = last.accepted.standing.cost, {*self.accepted}
        clues, nearer = self.bench.clues, list[Rival]()
        if not may_grow(self.bench.current.model.problem.drive, last.accepted.key, clues):
            found = [rival for rival in last.choice.rivals if rival.standing.cost < cost]
            nearer = [rival for rival in found if grows(rival, clues)]
        for rival in (*last.choice.named, *nearer):
            if rival.key in tried or is_same(rival, last.accepted):
                continue
            if self.allowance.exhausted():
                break
            tried.add(rival.key)
            bench, keys = self._on_steps(rival.fitted), [*before, rival.key]
            done = self._round(bench, keys, self.meant)
            if done.accepted is not None:
                self.rounds[-1] = replace(last, choice=with_first(last.choice, rival), accepted=rival)
                self.bench, self.accepted = bench, keys
                return done
        return None

    def _from_rival(self) -> Round | None:
        """Go on from other effects in the place of the only addition, where with the next one they lead further.

        What comes nearest to two effects that are missing may be neither, and leave nothing that could be told.
        """
        if len(self.rounds) != 1 or self.bench.current.astray:
            return None
        (first,), current = self.rounds, self.bench.current
        held, enough = first.accepted, required(self.bench.base, current)
        if held is None:
            return None
        tried = {item.key for item in first.choice.named}
        others = [item for item in first.choice.rivals if item.key[0] != held.key[0] and item.key not in tried]
        for rival in sorted(others, key=lambda item: item.standing.cost)[:INSTEAD]:
            if self.allowance.exhausted():
                break
            bench = self._on_steps(rival.fitted)
            done = self._round(bench, [rival.key], self.meant)
            if done.accepted is not None and current.cost - done.accepted.standing.cost >= enough:
                self.rounds = [replace(first, choice=with_first(first.choice, rival), accepted=rival)]
                self.bench, self.accepted = bench, [rival.key]
                return done
        return None

    def _reopened(self) -> Round | None:
        """Take the place of an earlier addition up again where others, beside the later ones, lead further.

        Of two effects that are missing the first addition is what comes nearest to both, be it neither; what is one of
        them may not have been worth a refit then.
        """
        base, current = self.bench.base, self.bench.current
        for index, item in enumerate(self.rounds[:-1]):
            held = item.accepted
            if held is None or self.accepted.count(held.key) != 1:
                continue
            if self.allowance.exhausted():
                break
            kept = [key for key in self.accepted if key != held.key]
            simpler = without_addition(current, with_additions(base, kept, forms_of(self.rounds)))
            if not simpler.holds:
                continue
            bench = self.bench.at(simpler)
            done = self._round(bench, kept, self.meant)
            if done.accepted is not None and done.accepted.standing.cost < current.cost - UNIMPORTANT:
                self.bench, self.accepted = bench, kept
                self.taken_back.append(self.rounds.pop(index))
                return done
        return None

    def _take(self, rival: Rival) -> None:
        """Add what a round has found; drop or exchange earlier additions that it makes superfluous."""
        self.tell("examining earlier additions again", 0.0)
        bench, keys = self._with(rival), [*self.accepted, rival.key]
        current, self.accepted = without_superfluous(bench, self.rounds, keys, self.level, self.rng, self.run)
        self.bench = on_shorter_steps(bench.at(current), SEARCHING)
        if innovations(self.bench.current).significant(self.level) and not self.allowance.exhausted():
            self._exchange()

    def _with(self, rival: Rival) -> Bench:
        """Return the bench of a rival's model: one that is far off is freed only now that it is to be accepted."""
        return self._on_steps(freed(rival.fitted) if rival.fitted.astray else rival.fitted)

    def _on_steps(self, fitted: FittedModel) -> Bench:
        """Return the bench of another model on the integrator steps of the current one."""
        return self.bench.at(on_steps_of(self.bench.current.model, fitted))

    def _sharpen(self) -> None:
        """Go over additions again where channels show more than torque noise, on a footing that goes by that."""
        bench, base = sharpened(self.bench), self.bench.base
        if bench is self.bench:
            return
        if len(set(self.accepted)) > 1:
            found = without_superfluous(bench, self.rounds, self.accepted, self.level, self.rng, self.run, latest=False)
            bench, self.accepted = bench.at(found[0]), found[1]
        self.bench, self._fitted_base = bench, base

    def _exchange(self) -> None:
        spent = self.allowance.exhausted
        found = exchanged(self.bench, self.rounds, self.accepted, self.level, self.rng, self.run, spent)
        current, self.rounds, self.accepted = found
        self.bench = self.bench.at(current)

    def _settle(self) -> None:
        """Go over additions that leave nothing but noise: their more general shapes, then the rivals of earlier ones.

        What a shape leaves is too little to tell as power, and yet enough to tell rivals apart that are the same; and
        what an earlier addition explained may have been no more than that shape.
        """
        self._give_shapes()
        if len(set(self.accepted)) > 1:
            self.tell("weighing rivals of earlier additions again", 0.0)
            self._exchange()
        elif self.accepted:
            self._weigh_shapes()

    def _give_shapes(self) -> None:
        """Give additions the more general shapes that the recordings ask for, however much a search has taken."""
        for _ in set(self.accepted):
            done = self._round(self.bench, self.accepted, NONE)
            if done.accepted is None:
                break
            self.bench, self.rounds = self.bench.at(done.accepted.fitted), [*self.rounds, done]
            self.accepted = [*self.accepted, done.accepted.key]
            found = without_superfluous(self.bench, self.rounds, self.accepted, self.level, self.rng, self.run)
            self.bench, self.accepted = self.bench.at(found[0]), found[1]

    def _weigh_shapes(self) -> None:
        """Weigh the only addition against others, each in the shape that the recordings give it."""

        def grown(rival: Rival) -> Round:
            return self._round(self._on_steps(rival.fitted), [rival.key], NONE)

        held = self.accepted[0]
        is_own = [item.accepted is not None and item.accepted.key == held for item in self.rounds]
        own = [item for item, yes in zip(self.rounds, is_own, strict=True) if yes]
        dropped = [item for item, yes in zip(self.rounds, is_own, strict=True) if not yes]
        current, own = weighed_in_shape(self.bench, own, grown, self.allowance.exhausted, self.level, self.rng)
        self.bench, self.rounds = self.bench.at(current), [*dropped, *own]
        self.accepted = [item.accepted.key for item in own if item.accepted is not None]

    def _withdraw(self) -> None:
        """Take back what does not help, for what the recordings could not tell from the first addition and does.

        What comes nearest where it was fitted need not be what carries over.
        """
        first, tried = self.rounds[0], set(self.accepted)
        self.taken_back += [item for item in self.rounds if item.accepted is not None]
        for rival in first.choice.named:
            if rival.key in tried:
                continue
            bench = self._with(rival)
            if self._left_out.helps(bench, self.level):
                held = replace(first, choice=with_first(first.choice, rival), accepted=rival)
                self.bench, self.rounds, self.accepted = bench, [held], [rival.key]
                return
        self.bench, self.rounds, self.accepted = self.bench.at(self.bench.base), [withdrawn(first)], []

    def _told_of(self, number: int) -> Tell:
        return lambda what, share: self.tell(f"round {number}: {what}", share)

    def _round(self, bench: Bench, accepted: Sequence[Key], meant: Considered) -> Round:
        """Decide on an addition to the model of a bench, or on a more general shape of what it has.

        The shape of an accepted effect need not be worth an effect of its own.
        """
        self._begun += 1
        number = self._begun
        current, blocks, level = bench.current, bench.current.blocks, self.level
        power = excess(current.linear.rows, blocks)
        aside = None if accepted or not power.significant(level) else self.readings
        crew = Crew(bench, self.run, number, self._told_of(number), aside, self.unexamined)
        enough = required(bench.base, current) if meant.names else np.inf
        again = shapes(current, bench.clues, accepted)
        keys = [*places(current, meant), *again]
        found = crew.screened(keys)
        may_be, known = accepted or bench.standard.may_be_met, {item.key: item for item in found}
        hopeful = [item for item in found if may_be and (item.gain >= HOPE * enough or item.key in again)]
        gap = power.significant(level) or (bool(meant.names) and significant(bench.slow, level))
        chosen = shortlist(hopeful, np.inf if gap else level / max(len(found), 1))
        chosen += displaced(self.rounds, known, chosen)
        if power.significant(level):
            chosen = with_outright(chosen, [known[key] for key in again if key in known])
        chosen, unfitted = to_refit(crew, chosen, found, again)
        parts = len(folds(current))
        choice = choose([], blocks, parts, level, self.rng)
        asked = {key: -np.inf if key in again else enough for key in known}
        for rivals in completed_rivals(crew, chosen, unfitted, known, asked, self.allowance.exhausted):
            able = [item.key in again or (item.standing.material and gain(current, item) >= enough) for item in rivals]
            fit = [item for item, yes in zip(rivals, able, strict=True) if yes]
            choice = choose(fit, blocks, parts, level, self.rng)
            choice = with_refused(choice, tuple(item for item, yes in zip(rivals, able, strict=True) if not yes))
            if choice.significant or not gap:
                break
        shape = next((item for item in choice.aliases if item.key in again), None)
        best = (shape or choice.rivals[0]) if choice.significant else None
        return Round(tuple(found), choice, current, power, best)
