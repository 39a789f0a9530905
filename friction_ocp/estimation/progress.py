"""What a fit reports while it runs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from friction_ocp.estimation.program import Point


@dataclass(frozen=True)
class Report:
    """One accepted step of a fit."""

    phase: str
    phases_done: int
    phases: int
    iteration: int
    objective: float
    point: Point

    @property
    def share(self) -> float:
        """Rough share of the work that is done; a phase counts as half done after five iterations."""
        return (self.phases_done + self.iteration / (self.iteration + 5.0)) / max(self.phases, 1)


Progress = Callable[[Report], None]


def silent(report: Report) -> None:
    """Report nothing."""


class Phases:
    """Counts the phases of a fit and passes their steps on."""

    def __init__(self, progress: Progress, total: int) -> None:
        self._progress, self._total, self._begun = progress, total, 0

    def begin(self, phase: str) -> Callable[[int, float, Point], None]:
        """Return what a solver calls after each step of a new phase."""
        done = self._begun
        self._begun += 1
        total = max(self._total, self._begun)
        return lambda iteration, objective, point: self._progress(
            Report(phase, done, total, iteration, objective, point)
        )
