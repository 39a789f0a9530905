"""What the tasks of one problem share, in whatever process they run."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

from friction_ocp.estimation.model import Model
from friction_ocp.estimation.preparation import prepare_identification
from friction_ocp.estimation.problem import Problem, RecordingUse
from friction_ocp.estimation.rounds import Fitted
from friction_ocp.execution.content import fingerprint
from friction_ocp.statistics.optimum import Optimum


@dataclass(frozen=True)
class Workshop:
    """A problem and, once it is known, its optimum; the model is built in every process where it is first needed."""

    problem: Problem
    optimum: Optimum | None = None

    @cached_property
    def model(self) -> Model:
        """The problem made ready to compute, with what was settled at the optimum."""
        model = prepare_identification(self.problem)
        return model if self.optimum is None else self.optimum.settled(model)

    @cached_property
    def fitted(self) -> Fitted:
        """The optimum with its program."""
        assert self.optimum is not None
        return self.optimum.fitted(self.model)

    @cached_property
    def fingerprint(self) -> str:
        """Of all that decides a number: drive, recordings, options, optimum; not of titles, comments and paths."""
        problem = self.problem
        parts = (problem.static, problem.static_validation)
        uses = [[_content(use) for use in part] for part in (problem.train, problem.validation)]
        static = [
            [(use.name, dict(use.set), use.points.sha256, dict(use.points.columns)) for use in part] for part in parts
        ]
        optimum = None if self.optimum is None else self.optimum.document()
        return fingerprint(problem.drive, uses, static, problem.constraints, problem.estimation, optimum)

    def at(self, optimum: Optimum) -> Workshop:
        """Return the same problem at its optimum, with the model if that is built."""
        moved = Workshop(self.problem, optimum)
        if "model" in self.__dict__:
            moved.__dict__["model"] = optimum.settled(self.model)
        return moved

    def __getstate__(self) -> dict[str, Any]:
        """Leave behind what is built: model functions belong to their process."""
        return {"problem": self.problem, "optimum": self.optimum}


def _content(use: RecordingUse) -> tuple[Any, ...]:
    recording = use.recording
    return use.name, dict(use.set), dict(recording.channels), recording.log_began, recording.counted_from
