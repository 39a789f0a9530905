"""Rivals and a motion: what a recording of it, made by one of them, would say against the others. Motions are tasks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from functools import cached_property
from itertools import permutations
from typing import Any

from friction_ocp.diagnosis.bench import Seat, footing_document, restored_footing, seated, value_of
from friction_ocp.diagnosis.fitted_model import FittedModel
from friction_ocp.estimation.horizon import judged_alike
from friction_ocp.estimation.model import prepare, with_drive
from friction_ocp.estimation.problem import Problem
from friction_ocp.excitation.limits import Limits
from friction_ocp.excitation.motions import MOTIONS
from friction_ocp.excitation.trial_run import TrialRun, trial_run
from friction_ocp.excitation.worth import Evidence, evidence
from friction_ocp.execution.executor import AbstractExecutor
from friction_ocp.execution.plain import plain, restored
from friction_ocp.execution.run import Watch, run_tasks, unwatched
from friction_ocp.execution.task import Json, Task
from friction_ocp.recording.recording import Channel, Recording


@dataclass(frozen=True)
class Contest:
    """Rivals of one base model that a motion within limits is to tell apart, as any process can set them up."""

    problem: Problem
    """Of the base model."""
    footing: Json
    seats: tuple[Seat, ...]
    limits: Limits

    @classmethod
    def between(cls, base: FittedModel, rivals: Sequence[FittedModel], limits: Limits) -> Contest:
        """Take down where rivals stand; this process has them already."""
        found = cls(base.model.problem, footing_document(base.footing), tuple(map(Seat.of, rivals)), limits)
        found.__dict__["rivals"] = tuple(rivals)
        return found

    @cached_property
    def rivals(self) -> tuple[FittedModel, ...]:
        """The rivals, set up."""
        model = judged_alike(prepare(self.problem))
        foot = restored_footing(self.footing, model)
        return tuple(seated(with_drive(model, seat.drive), foot, seat.point) for seat in self.seats)

    def __getstate__(self) -> dict[str, Any]:
        """Leave behind what is set up: model functions belong to their process."""
        return {item.name: getattr(self, item.name) for item in fields(self)}


def contested(
    contest: Contest, executor: AbstractExecutor, watch: Watch = unwatched
) -> list[tuple[TrialRun, Evidence]]:
    """Return the motions that all rivals can make, as the first makes them, with the least evidence over all pairs."""
    tasks = [Task(f"motion-{k}", contest_over, (k,)) for k in range(len(MOTIONS))]
    outcomes = run_tasks("motions that separate candidates", tasks, contest, "", executor, watch=watch)
    values = [value_of(outcome) for outcome in outcomes.values()]
    return [_restored(k, value) for k, value in enumerate(values) if value is not None]


def contest_over(contest: Contest, index: int) -> Json:
    """Let every rival make a motion and every other say what it makes of that; null where one cannot make it."""
    runs = list[TrialRun]()
    for rival in contest.rivals:
        run = trial_run(rival, MOTIONS[index], contest.limits)
        if run is None:
            return None
        runs.append(run)
    pairs = permutations(range(len(runs)), 2)
    least = min(evidence(contest.rivals[k], runs[j].recording).separation for j, k in pairs)
    first, channels = runs[0], runs[0].recording.channels.values()
    series = [(item.name, item.time, item.values, item.unit) for item in channels]
    return plain({"separation": least, "amplitude": first.amplitude, "peaks": first.peaks, "channels": series})


def _restored(index: int, value: Json) -> tuple[TrialRun, Evidence]:
    found, motion = restored(value), MOTIONS[index]
    channels = {name: Channel(name, *series) for name, *series in found["channels"]}
    recording = Recording(motion.name, channels, title=motion.sentence)
    return TrialRun(motion, found["amplitude"], recording, found["peaks"]), Evidence(found["separation"])
