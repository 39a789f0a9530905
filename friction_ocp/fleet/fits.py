"""One fit of a fleet, as a task, and the store in front of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from friction_ocp.errors import Finding, FrictionOcpError
from friction_ocp.estimation.estimate import identify
from friction_ocp.estimation.problem import Problem, RecordingUse
from friction_ocp.execution.content import fingerprint, toolkit_fingerprint
from friction_ocp.execution.ledger import AbstractLedger
from friction_ocp.execution.task import Json, Outcome, Task
from friction_ocp.fleet.nights import Night
from friction_ocp.fleet.store import Store, StoredFit, StoredParameter, now
from friction_ocp.problem_file.check import check_before_fit
from friction_ocp.recording.hdf5 import read_recording
from friction_ocp.result_document import estimate_document

KEPT = ("fit", "solver", "warnings", "covariance", "provenance")
"""What of a result a row keeps beside its parameters."""


def template_of(problem: Problem) -> Problem:
    """Return the problem without recordings."""
    return replace(problem, train=(), validation=(), static=(), static_validation=())


def problem_fingerprint(problem: Problem) -> str:
    """Return the fingerprint of all that decides a fit but its recording."""
    return fingerprint(toolkit_fingerprint(), problem.drive, problem.constraints, problem.estimation)


def fit_key(problem: str, night: Night) -> str:
    """Return the fingerprint of all that decides a fit; where the file lies does not."""
    return fingerprint(problem, night.sha256, dict(night.set))


def task_of(night: Night, key: str) -> Task:
    """Return the fit of a recording as a task."""
    return Task(key, fit_night, (str(night.path), night.sha256, dict(night.set)))


def fit_night(template: Problem, path: str, sha256: str, numbers: Mapping[str, float]) -> Json:
    """Fit a problem to one recording and return what the store keeps of the result."""
    recording = read_recording(path)
    if recording.sha256 != sha256:
        raise FrictionOcpError(Finding(path, "the file has changed since it was looked at", remedy="run batch again"))
    problem = replace(template, train=(RecordingUse(recording, numbers, path),))
    errors = [finding for finding in check_before_fit(problem) if finding.severity == "error"]
    if errors:
        raise FrictionOcpError(errors)
    document = estimate_document(identify(problem))
    return {key: document[key] for key in ("status", "message", "parameters", *KEPT)}


@dataclass(frozen=True)
class FleetLedger(AbstractLedger):
    """The store as what tasks are looked up in and kept in."""

    store: Store
    problem: str
    nights: Mapping[str, Night]
    """By the key of a fit."""
    known: Mapping[str, StoredFit]

    def find(self, task: Task, shared_fingerprint: str) -> Outcome | None:
        fit = self.known.get(task.key)
        if fit is None:
            return None
        failed = fit.status == "failed"
        return Outcome(task.key, None if failed else {}, fit.message if failed else "", seconds=fit.seconds)

    def keep(self, task: Task, shared_fingerprint: str, outcome: Outcome) -> None:
        if not outcome.lost:
            self.store.add(stored_fit(self.nights[task.key], self.problem, outcome))


def stored_fit(night: Night, problem: str, outcome: Outcome) -> StoredFit:
    """Return the row of an outcome."""
    value: Mapping[str, Any] = outcome.value or {}
    return StoredFit(
        key=outcome.key,
        problem=problem,
        machine=night.machine,
        recording=Path(night.path).as_posix(),
        started=night.started,
        sha256=night.sha256,
        status=str(value.get("status", "failed")),
        message=outcome.error or str(value.get("message", "")),
        seconds=outcome.seconds,
        created=now(),
        document={key: value[key] for key in KEPT if key in value},
        parameters=tuple(_parameter(name, item) for name, item in value.get("parameters", {}).items()),
    )


def _parameter(name: str, item: Mapping[str, Any]) -> StoredParameter:
    low, high = item["interval95"] or (None, None)
    plain = name.partition("@")[0]  # each fit has one recording: its own values need no name of it
    return StoredParameter(plain, item["value"], item["std_error"], low, high, item["unit"], item["verdict"])
