"""Hands out the work of one round, task by task, and takes what comes back."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from functools import partial
from typing import Any

import numpy as np

from friction_ocp.diagnosis.allowance import Tell
from friction_ocp.diagnosis.aside import OtherReadings
from friction_ocp.diagnosis.bench import Bench, point_document, seated, value_of
from friction_ocp.diagnosis.benchmark import blocks_like
from friction_ocp.diagnosis.fitted_model import FittedModel
from friction_ocp.diagnosis.held_out import held_out
from friction_ocp.diagnosis.refit import (
    begun_at_size,
    begun_beside,
    best_nudged,
    completed,
    fitted_loosely,
    quick_refit,
)
from friction_ocp.diagnosis.rival import Rival, Standing, is_another
from friction_ocp.diagnosis.screen import Screened, Start, screen
from friction_ocp.effects.effect import Augmentation, Key, Trial
from friction_ocp.effects.registry import effects
from friction_ocp.estimation.model import with_drive
from friction_ocp.execution.plain import plain, restored
from friction_ocp.execution.run import Tally, run_tasks
from friction_ocp.execution.task import Json, Task
from friction_ocp.simulation.grid import FloatArray
from friction_ocp.statistics.execution import Execution

OTHER_SIZES = (3.0, 1.0 / 3.0)
"""Sizes over the predicted one at which the best candidates begin again where nothing else explains a gap."""


@dataclass(frozen=True)
class Refit:
    """A candidate after a few steps."""

    screened: Screened
    point: Json
    cost: float

    @property
    def key(self) -> Key:
        """Effect and component."""
        return self.screened.key


@dataclass(frozen=True)
class Crew:
    """Hands out the work of one round and takes what comes back."""

    bench: Bench
    execution: Execution
    number: int
    tell: Tell
    readings: OtherReadings | None = None
    """What is fitted beside the refits."""
    unexamined: list[str] = field(default_factory=list[str])
    """Why candidates whose work failed were left out, a line each."""

    def screened(self, candidates: Sequence[Key]) -> list[Screened]:
        """Return the score tests of candidates, (effect, component) each, largest predicted gain first."""
        tasks = [self._task("screen", key, screen_candidate, key) for key in candidates]
        return self._tested("screening", tasks, 0.0)

    def screened_unfitted(self, candidates: Sequence[Key]) -> list[Screened]:
        """Return the score tests at the guesses, largest predicted gain first; none where these do not simulate."""
        tasks = [self._task("guess", key, screen_unfitted, key) for key in candidates]
        return self._tested("screening from the guesses", tasks, 0.25)

    def screened_loosely(self, candidates: Sequence[Key]) -> list[Screened]:
        """Return the score tests on loosely joined segments, largest predicted gain first; none where there are none.

        Gains are in units of what such gaps allow: they compare with one another alone.
        """
        tasks = [self._task("loose", key, screen_loose, key) for key in candidates]
        return self._tested("screening on loosely joined segments", tasks, 0.25)

    def fitted_loosely(self, candidates: Sequence[Screened]) -> list[float]:
        """Return by how much candidates, fitted on loosely joined segments, better the objective of these.

        Minus infinity where the simulation breaks down.
        """
        tasks = [self._task("fit-loose", item.key, fit_loose, (screened_document(item),)) for item in candidates]
        values = self._run("fits on loosely joined segments", tasks, 0.4)
        return [-np.inf if value is None else float(restored(value)) for value in values]

    def _tested(self, what: str, tasks: Sequence[Task], begin: float) -> list[Screened]:
        found = [restored_screened(self.bench, value) for value in self._run(what, tasks, begin) if value is not None]
        return sorted(found, key=lambda item: -item.gain)

    def without(
        self, shortlist: Sequence[Screened], unfitted: Sequence[Screened] = ()
    ) -> tuple[FloatArray, list[Refit]]:
        """Return (blocks,) held-out costs of the current model, and refits of candidates after a few steps.

        Those of `unfitted` begin at the guesses; of two refits of one candidate the better one counts. Candidates whose
        simulation breaks down on the way are left out.
        """
        tasks = [Task(f"{self.number}-held-out", held_out_costs)]
        aside = [] if self.readings is None else self.readings.tasks()
        tasks += aside  # takes longer than a refit, mostly, and what takes long comes first
        tasks += [self._task("refit", item.key, refit_candidate, (screened_document(item),)) for item in shortlist]
        tasks += [self._task("begin", item.key, refit_unfitted, (screened_document(item),)) for item in unfitted]
        costs, *values = self._run("refits", tasks, 0.5, 1 + len(aside))
        ends = values[len(aside) :]
        if self.readings is not None:
            self.readings.keep(self.bench, values[: len(aside)])
        best = dict[Key, Refit]()
        for item, end in zip([*shortlist, *unfitted], ends, strict=True):
            cost = np.inf if end is None else float(restored(end["cost"]))
            if end is not None and (item.key not in best or cost < best[item.key].cost):
                best[item.key] = Refit(item, end["point"], cost)
        return restored(costs), list(best.values())

    def rivals(
        self, tried: Sequence[Refit], without: FloatArray, asked: Mapping[Key, float], thorough: int = 0
    ) -> list[Rival]:
        """Return candidates whose refits are completed, the first ones thoroughly, with their gains where left out.

        That is not looked at (NaN) where they do not gain what is `asked` of them where they were fitted.
        """
        tasks = [
            self._task(
                "complete",
                refit.key,
                complete_candidate,
                (screened_document(refit.screened), refit.point, asked[refit.key], k < thorough),
            )
            for k, refit in enumerate(tried)
        ]
        values = self._run("completing refits", tasks, 0.75)
        ends = zip(tried, values, strict=True)
        return [self._rival(refit.screened, value, without) for refit, value in ends if value is not None]

    def levelled(
        self, rivals: Sequence[Rival], most: float, without: FloatArray, asked: Mapping[Key, float]
    ) -> list[Rival]:
        """Return rivals, those of at most some cost begun again from where the segments of the best one begin.

        And that from where those of what is then better do.
        """
        found = {item.key: item for item in rivals if item.standing.cost <= most}
        if len(found) < 2 or not self.bench.current.footing.joined:
            return [*rivals]
        for _ in range(2):
            best = min(found.values(), key=lambda item: item.standing.cost)
            nodes = point_document(best.fitted)
            others = [item for item in found.values() if item is not best]
            tasks = [
                self._task(
                    f"beside-{best.key[0]}-{best.key[1]}",
                    item.key,
                    complete_beside,
                    (screened_document(item.screened), point_document(item.fitted), nodes, asked[item.key]),
                )
                for item in others
            ]
            values = self._run("completing refits from one another", tasks, 0.75)
            found |= {
                item.key: self._rival(item.screened, value, without)
                for item, value in zip(others, values, strict=True)
                if value is not None
            }
            if min(item.standing.cost for item in found.values()) >= best.standing.cost:
                break
        return [found.get(item.key, item) for item in rivals]

    def retried(self, known: Sequence[Rival], without: FloatArray, asked: Mapping[Key, float]) -> list[Rival]:
        """Return rivals, each from the best of the end that is known and those that begin at other sizes."""
        pairs = [(item, k) for item in known for k in range(len(OTHER_SIZES))]
        tasks = [
            self._task(
                f"retry-{k}",
                item.key,
                retry_candidate,
                (screened_document(item.screened), OTHER_SIZES[k], asked[item.key]),
            )
            for item, k in pairs
        ]
        values = self._run("trying other sizes", tasks, 0.75)
        ends = {item.key: [item] for item in known}
        for (item, _), value in zip(pairs, values, strict=True):
            if value is not None:
                ends[item.key].append(self._rival(item.screened, value, without))
        return [min(own, key=lambda item: item.standing.cost) for own in ends.values()]

    def _rival(self, screened: Screened, value: Json, without: FloatArray) -> Rival:
        standing, costs = restored(value["standing"], (Standing,)), restored(value["costs"])
        return Rival(screened, standing, without - costs, partial(seat_candidate, self.bench, screened, value["point"]))

    def _task(self, what: str, key: Key, function: Callable[..., Json], arguments: tuple[Any, ...]) -> Task:
        return Task(f"{self.number}-{what}-{key[0]}-{key[1]}", function, arguments)

    def _run(self, what: str, tasks: Sequence[Task], begin: float, vital: int = 0) -> list[Json]:
        """Return what tasks have found, the first of them `vital`; null where work on one candidate failed.

        That costs the search this candidate, not all the others; a search without any is none.
        """

        def watch(tally: Tally) -> None:
            self.tell(f"{what}: {tally.done} of {tally.total}", begin + 0.25 * tally.done / max(tally.total, 1))

        bench, run = self.bench, self.execution
        outcomes = [*run_tasks(what, tasks, bench, bench.fingerprint, run.executor, run.ledger, watch).values()]
        own = outcomes[vital:]
        failed = [item for item in own if item.trace]
        if len(failed) == len(own) > 1:
            failed = []
        self.unexamined.extend(f"{item.key} failed, and its candidate was left out: {item.error}" for item in failed)
        return [None if item in failed else value_of(item) for item in outcomes]


def screen_candidate(bench: Bench, effect: str, place: str) -> Json:
    """Test an effect at a place; null where the drive with it cannot be simulated."""
    return _tested(bench, bench.current, effect, place)


def screen_unfitted(bench: Bench, effect: str, place: str) -> Json:
    """Test an effect at a place with all parameters at their guesses; null where that cannot be simulated."""
    return _tested(bench, bench.unfitted, effect, place)


def screen_loose(bench: Bench, effect: str, place: str) -> Json:
    """Test an effect at a place on loosely joined segments; null where there are none."""
    return _tested(bench, bench.loose, effect, place)


def fit_loose(bench: Bench, content: Json) -> Json:
    """Return the decrease of the objective of loosely joined segments that a candidate brings, fitted there.

    Zero where there are none.
    """
    if bench.loose is None:
        return 0.0
    fitted = fitted_loosely(bench.loose, restored_screened(bench, content))
    known = bench.loose.linear
    return plain(known.program.objective(known.point) - fitted if np.isfinite(fitted) else -np.inf)


def _tested(bench: Bench, start: FittedModel | None, effect: str, place: str) -> Json:
    if start is None:
        return None
    seen = screen(start, effects()[effect], place, bench.clues)
    return None if seen is None else screened_document(seen)


def held_out_costs(bench: Bench) -> Json:
    """Return (blocks,) costs of the current model on recordings left out."""
    return plain(bench.current.blocks.sums(held_out(bench.current)))


def refit_candidate(bench: Bench, content: Json) -> Json:
    """Refit a candidate, a few steps; null where its simulation breaks down."""
    return _refitted(bench.current, restored_screened(bench, content))


def refit_unfitted(bench: Bench, content: Json) -> Json:
    """Refit a candidate from the guesses, a few steps; null where its simulation breaks down."""
    assert bench.unfitted is not None
    return _refitted(bench.unfitted, restored_screened(bench, content))


def _refitted(start: FittedModel, item: Screened) -> Json:
    fitted = quick_refit(start, item)
    return {"point": point_document(fitted), "cost": plain(fitted.cost)} if fitted.holds else None


def complete_candidate(bench: Bench, content: Json, point: Json, asked: float, thorough: bool) -> Json:
    """Refit a candidate from there to its end, cost it on recordings left out, and see whether it matters.

    Free runs that were lost before and are not now have come close to the recordings, not to the best end.
    """
    item = restored_screened(bench, content)
    fitted = completed(seat_candidate(bench, item, point), thorough)
    if thorough and bench.current.lost and not fitted.astray:
        fitted = best_nudged(fitted, bench.problem.estimation.seed)
    return _judged(bench, item, fitted, asked)


def complete_beside(bench: Bench, content: Json, point: Json, other: Json, asked: float) -> Json:
    """Fit a candidate again from the node states of another one; null where that is no better."""
    item = restored_screened(bench, content)
    known = seat_candidate(bench, item, point)
    fitted = begun_beside(known, restored(other)["nodes"])
    return None if fitted is known else _judged(bench, item, fitted, asked)


def retry_candidate(bench: Bench, content: Json, scale: float, asked: float) -> Json:
    """Do the same from a multiple of the predicted size; null where the simulation breaks down."""
    item = restored_screened(bench, content)
    fitted = completed(begun_at_size(bench.current, item, scale), thorough=False)
    return _judged(bench, item, fitted, asked) if fitted.holds else None


def _judged(bench: Bench, item: Screened, fitted: FittedModel, asked: float) -> Json:
    enough = not bench.current.cost - fitted.cost < asked
    costs = blocks_like(bench.current, fitted) if enough else np.full(bench.current.blocks.count, np.nan)
    standing = Standing.of(fitted, enough and not is_another(item, fitted) and bench.standard.is_material(fitted))
    return {"point": point_document(fitted), "costs": plain(costs), "standing": plain(standing)}


def seat_candidate(bench: Bench, item: Screened, point: Json) -> FittedModel:
    """Return the refit of a candidate where it stands."""
    return seated(with_drive(bench.current.model, item.augmentation.drive), bench.current.footing, point)


def screened_document(item: Screened) -> Json:
    """Return a score test without its drive, which effect and place bring back."""
    return plain({part.name: getattr(item, part.name) for part in fields(item) if part.name != "augmentation"})


def restored_screened(bench: Bench, content: Json) -> Screened:
    """Return the score test with its drive."""
    found: Mapping[str, Any] = restored(content, (Start, Trial))
    drive = bench.current.model.problem.drive
    augmentation: Augmentation = effects()[found["effect"]].addition(drive, found["component"], bench.clues)
    return Screened(**found, augmentation=augmentation)
