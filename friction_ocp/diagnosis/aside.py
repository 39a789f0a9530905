"""Base models whose inputs are read the other way, fitted beside the first refits, where processes would be idle."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

from friction_ocp.diagnosis.bench import Bench, point_document, seated
from friction_ocp.diagnosis.fitted_model import FittedModel
from friction_ocp.diagnosis.footing import training_pieces
from friction_ocp.diagnosis.reading import other_readings, read_otherwise
from friction_ocp.estimation.horizon import judged_alike
from friction_ocp.estimation.model import prepare
from friction_ocp.estimation.problem import Problem
from friction_ocp.execution.effort import uncounted
from friction_ocp.execution.task import Json, Task


@dataclass
class OtherReadings:
    """A problem with its inputs read the other way, and where its base model ends then."""

    problem: Problem
    """As it is stated."""
    _of: Json = None
    """The end of the stated base model from which what was found begins."""
    _found: list[Json] = field(default_factory=list[Json])

    def tasks(self) -> list[Task]:
        """Return what fits the base model of a bench to all other readings; no part of the effort of a search."""
        return [Task(f"read-otherwise-{k}", read_base, (k,)) for k in range(len(other_readings(self.problem)))]

    def keep(self, bench: Bench, found: Sequence[Json]) -> None:
        """Keep what these tasks have found."""
        self._of, self._found = bench.base_point, list(found)

    def fitted(self, base: FittedModel) -> list[tuple[Problem, FittedModel]]:
        """Return all other readings, and the base model fitted to each that can be simulated."""
        problems = other_readings(self.problem)
        if self._of is None or self._of != point_document(base):
            self._of, self._found = point_document(base), [_end(other, base) for other in problems]
        points = zip(problems, self._found, strict=True)
        return [(other, _seated(other, base, point)) for other, point in points if point is not None]


def read_base(bench: Bench, index: int) -> Json:
    """Fit the base model to another reading of the inputs; null where it cannot be simulated."""
    with uncounted():
        return _end(other_readings(bench.problem)[index], bench.base)


def _end(read: Problem, base: FittedModel) -> Json:
    fitted = read_otherwise(read, base)
    return point_document(fitted) if fitted.holds else None


def _seated(problem: Problem, base: FittedModel, point: Json) -> FittedModel:
    model = judged_alike(prepare(problem))
    return seated(model, replace(base.footing, train=training_pieces(model)), point)
