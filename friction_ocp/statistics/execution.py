"""How the work of a statistic is done, and what it tells meanwhile."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from friction_ocp.estimation.progress import Progress, silent
from friction_ocp.execution.executor import AbstractExecutor
from friction_ocp.execution.ledger import Ledger
from friction_ocp.execution.processes import Processes
from friction_ocp.execution.run import Watch, run_tasks, unwatched
from friction_ocp.execution.task import Outcome, Task
from friction_ocp.statistics.workshop import Workshop


@dataclass(frozen=True)
class Execution:
    """Where tasks run, where their results are kept, who hears of progress."""

    executor: AbstractExecutor = Processes(2)
    folder: Path | None = None
    """Output folder: what ended there in an earlier run, with the same problem and recordings, is not done again."""
    progress: Progress = silent
    """Hears the steps of a fit in this process."""
    watch: Watch = unwatched
    """Hears of every task that ends."""

    @property
    def ledger(self) -> Ledger:
        """Outcomes on disk."""
        return Ledger(None if self.folder is None else self.folder / "tasks")

    def run(self, what: str, tasks: Sequence[Task], workshop: Workshop) -> Mapping[str, Outcome]:
        """Return the outcome of every task by its key; finished ones come from disk."""
        return run_tasks(what, tasks, workshop, workshop.fingerprint, self.executor, self.ledger, self.watch)
