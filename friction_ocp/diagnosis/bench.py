"""Where the candidates of a round are worked on: tasks that need nothing of one another, on disk when they end."""

from __future__ import annotations

import json
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any

import numpy as np

from friction_ocp.diagnosis.base_fit import fit_base, predicting
from friction_ocp.diagnosis.clues import clues_of
from friction_ocp.diagnosis.finer_steps import fitted_on, on_short_steps
from friction_ocp.diagnosis.fitted_model import FittedModel
from friction_ocp.diagnosis.footing import Footing, training_pieces
from friction_ocp.diagnosis.linear import linear_program
from friction_ocp.diagnosis.options import level_of
from friction_ocp.diagnosis.polishing import loosely_joined
from friction_ocp.diagnosis.refit import NUDGES, begun_again, guessed, nudged, nudged_along
from friction_ocp.diagnosis.sharpening import fitted_sharply, seen_on
from friction_ocp.diagnosis.slow_torque import SlowTorque, significant, slow_torques
from friction_ocp.diagnosis.worth import Standard, innovations
from friction_ocp.drive.parts import Drive
from friction_ocp.effects.effect import Clues
from friction_ocp.errors import Finding, FrictionOcpError
from friction_ocp.estimation.horizon import judged_alike
from friction_ocp.estimation.model import Model, late_of, prepare, with_drive, with_late, with_step
from friction_ocp.estimation.node_ends import UNIMPORTANT, begun
from friction_ocp.estimation.problem import Problem
from friction_ocp.estimation.program import Point
from friction_ocp.execution.content import fingerprint
from friction_ocp.execution.effort import once
from friction_ocp.execution.executor import InProcess
from friction_ocp.execution.plain import plain, restored
from friction_ocp.execution.run import run_tasks
from friction_ocp.execution.task import Json, Outcome, Task
from friction_ocp.simulation.losses import Absolute, Huber, Squares, StudentT
from friction_ocp.statistics.execution import Execution
from friction_ocp.statistics.workshop import Workshop

MOST_TURNS = 3
"""How often fits from parameters changed by chance may go on from a better one."""
LOSSES = (Absolute, Huber, Squares, StudentT)


_built: dict[str, FittedModel] = {}
"""The base model that was built last, by all that decides it."""


@dataclass(frozen=True)
class Seat:
    """Where a fit stands, as a file can hold it: all that it takes to linearise it again, in any process."""

    drive: Drive
    point: Json

    @classmethod
    def of(cls, fitted: FittedModel) -> Seat:
        """Take down where a fit stands."""
        return cls(fitted.model.problem.drive, point_document(fitted))


@dataclass(frozen=True)
class Bench:
    """What the tasks of a round share: the problem, the base model's end and that of the current model."""

    problem: Problem
    footing: Json
    base_point: Json
    seat: Seat

    @cached_property
    @once
    def base(self) -> FittedModel:
        """The base model on its footing; a process builds that of the rounds of one diagnosis once."""
        key = fingerprint(Workshop(self.problem).fingerprint, json.dumps([self.footing, self.base_point]))
        if key not in _built:
            model = judged_alike(prepare(self.problem))
            _built.clear()
            _built[key] = seated(model, restored_footing(self.footing, model), self.base_point)
        return _built[key]

    @cached_property
    @once
    def current(self) -> FittedModel:
        """The model of this round."""
        base = self.base
        if self.seat.point is self.base_point or self.seat.point == self.base_point:
            return base
        return seated(with_drive(base.model, self.seat.drive), base.footing, self.seat.point)

    @cached_property
    @once
    def unfitted(self) -> FittedModel | None:
        """The current model at the guesses of its problem, and additions as they are: where to begin if it is astray.

        None where that cannot be simulated.
        """
        current = self.current
        model, program = current.model, current.linear.program
        point = begun(program, guessed(current, self.base.model.space))
        if not np.isfinite(program.objective(point)):
            return None
        return FittedModel(model, current.footing, linear_program(program, point))

    @cached_property
    @once
    def loose(self) -> FittedModel | None:
        """The current model on loosely joined segments: where predictions hold though free runs have gone astray.

        None where the footing has segments, or the simulation breaks down.
        """
        current = self.current
        if current.footing.segment_s is not None:
            return None
        program, point = loosely_joined(current.model, [current.theta])
        if not np.isfinite(program.objective(point)):
            return None
        return FittedModel(current.model, current.footing, linear_program(program, point))

    @property
    def clues(self) -> Clues:
        """What the current model says about sizes."""
        return clues_of(self.current)

    @cached_property
    @once
    def slow(self) -> tuple[SlowTorque, ...]:
        """Slow torques and errors that the current model lacks."""
        return slow_torques(self.current, self.clues)

    @cached_property
    def standard(self) -> Standard:
        """What additions to the current model are measured by; after others a slow torque may be no more than shape."""
        first = self.current is self.base
        return Standard(self.current, silent=not (first and significant(self.slow, level_of(self.problem))))

    @cached_property
    def fingerprint(self) -> str:
        """Of all that decides a number of this round."""
        ends = json.dumps([self.footing, self.base_point, self.seat.point])
        return fingerprint(Workshop(self.problem).fingerprint, ends, self.seat.drive)

    def at(self, fitted: FittedModel) -> Bench:
        """Return the bench of the next round, with what is built already."""
        moved = Bench(self.problem, self.footing, self.base_point, Seat.of(fitted))
        moved.__dict__["base"] = self.base
        return moved

    def __getstate__(self) -> dict[str, Any]:
        """Leave behind what is built: model functions belong to their process."""
        return {item.name: getattr(self, item.name) for item in fields(self)}


def point_document(fitted: FittedModel) -> Json:
    """Return parameters and node states, how late channels are read, and the integrator step, s."""
    point, model = fitted.linear.point, fitted.model
    return plain({"theta": point.theta, "nodes": point.nodes, "late": late_of(model), "max_step": model.max_step})


def seated(model: Model, foot: Footing, content: Json) -> FittedModel:
    """Return a fit where `point_document` says that it stands."""
    found = restored(content)
    model = with_step(with_late(model, found["late"]), min(model.max_step, found["max_step"]))
    return FittedModel(model, foot, linear_program(foot.training(model), Point(found["theta"], found["nodes"])))


def footing_document(foot: Footing) -> Json:
    """Return all of a footing but the recordings."""
    return plain({item.name: getattr(foot, item.name) for item in fields(foot) if item.name != "train"})


def restored_footing(content: Json, model: Model) -> Footing:
    """Return the footing with the recordings of the base model."""
    return Footing(**restored(content, LOSSES), train=training_pieces(model))


def open_bench(problem: Problem, execution: Execution) -> Bench:
    """Fit the base model in this process, or read its end from the output folder; then try to better it.

    Not where it leaves no more than noise: there a better fit is looked for when something seems to be missing.
    """
    workshop, task = Workshop(problem), Task("base", fit_base_model)
    with_one = run_tasks("base model", [task], workshop, workshop.fingerprint, InProcess(), execution.ledger)
    bench = _bench_of(problem, value_of(with_one["base"]))
    noise = not innovations(bench.current).significant(level_of(problem))
    return bench if noise else opened_better(bench, execution)


def open_predicting(bench: Bench, execution: Execution) -> Bench:
    """Return the bench of a base model that is compared with others by short predictions from the measured motion."""
    what, task = "base model by short predictions", Task("base-predicting", fit_predicting)
    found = run_tasks(what, [task], bench, bench.fingerprint, execution.executor, execution.ledger)
    return _bench_of(bench.problem, value_of(found[task.key]))


def fit_predicting(bench: Bench) -> Json:
    """Fit the base model to short predictions; the value says where it stands."""
    return _base_document(predicting(bench.base))


def _base_document(base: FittedModel) -> Json:
    return {"footing": footing_document(base.footing), "point": point_document(base)}


def _bench_of(problem: Problem, base: Json) -> Bench:
    """Return the bench of a base model that stands where `_base_document` says."""
    return Bench(problem, base["footing"], base["point"], Seat(problem.drive, base["point"]))


def sharpened(bench: Bench) -> Bench:
    """Return the bench on a footing that is sharpened, where the current model then leaves no more than noise."""
    found = fitted_sharply(bench.current, guessed(bench.current, bench.base.model.space))
    if found is bench.current:
        return bench
    base = seen_on(found.footing, bench.base)
    return replace(bench, footing=footing_document(found.footing), base_point=point_document(base), seat=Seat.of(found))


def on_shorter_steps(bench: Bench, shift: float) -> Bench:
    """Return the bench on integrator steps as short as the current model demands, the base model on the same.

    Half of them may move a parameter by a `shift` in standard errors.
    """
    found = on_short_steps(bench.current, shift)
    if found is bench.current:
        return bench
    base = fitted_on(bench.base, found.model)
    return replace(bench, base_point=point_document(base), seat=Seat.of(found))


def opened_better(bench: Bench, execution: Execution) -> Bench:
    """Return the bench of a better fit of the base model, or the same bench where none is found."""
    better = bettered(bench, execution)
    return bench if better is bench else replace(better, base_point=better.seat.point)


def bettered(bench: Bench, execution: Execution) -> Bench:
    """Return the bench of the current model where it fits better, found from the guesses or from changed parameters.

    Tries go on from the best one as long as they better it. There are none where much is missed: where a model that
    lacks something large ends says little.
    """
    best, known = None, bench.current.objective
    if bench.current.astray or not bench.current.theta.size:
        return bench
    for turn in range(MOST_TURNS):
        turns = range(turn * NUDGES, (turn + 1) * NUDGES)
        tasks = [Task(f"nudge-{k}", nudge, (best, k)) for k in turns]
        tasks += [Task(f"nudge-along-{k}", nudge_along, (best, k)) for k in turns]
        tasks += [Task("nudge-guesses", begin_again)] if turn == 0 else []
        shared = bench.fingerprint
        outcomes = run_tasks("looking for a better fit", tasks, bench, shared, execution.executor, execution.ledger)
        ends = [value for value in map(value_of, outcomes.values()) if value is not None]
        end = min(ends, key=lambda value: restored(value["objective"]), default=None)
        if end is None or restored(end["objective"]) >= known - UNIMPORTANT:
            break
        best, known = end["point"], restored(end["objective"])
    return bench if best is None else replace(bench, seat=Seat(bench.seat.drive, best))


def nudge(bench: Bench, point: Json, seed: int) -> Json:
    """Fit the current model again from beside a point, its own if that is null; null where that breaks down."""
    return _better_point(nudged(_seated(bench, point), bench.problem.estimation.seed + seed))


def nudge_along(bench: Bench, point: Json, turn: int) -> Json:
    """Do the same from beside it along what the recordings tell little about."""
    return _better_point(nudged_along(_seated(bench, point), turn))


def _seated(bench: Bench, point: Json) -> FittedModel:
    current = bench.current
    return current if point is None else seated(current.model, current.footing, point)


def begin_again(bench: Bench) -> Json:
    """Fit the current model again from the guesses; null where that breaks down."""
    return _better_point(begun_again(bench.current, bench.base.model.space))


def _better_point(fitted: FittedModel) -> Json:
    return {"point": point_document(fitted), "objective": plain(fitted.objective)} if fitted.holds else None


def fit_base_model(workshop: Workshop) -> Json:
    """Fit the base model from its guesses; the value says where it stands."""
    return _base_document(fit_base(prepare(workshop.problem)))


def value_of(outcome: Outcome) -> Json:
    """Return what a task has found; raises FrictionOcpError where it failed."""
    if outcome.error:
        remedy = "run the same command again: it goes on from there" if outcome.lost else ""
        raise FrictionOcpError(Finding(f"diagnose: {outcome.key}", outcome.error, remedy=remedy))
    return outcome.value
