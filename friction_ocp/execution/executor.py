"""Where tasks run: one interface, in front of this process, of others, and of a cluster."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Generator, Sequence
from contextlib import contextmanager
from typing import Any

from friction_ocp.execution.task import Outcome, Task, attempt


class AbstractExecutor(ABC):
    """Runs tasks that share one argument."""

    @abstractmethod
    def run(self, tasks: Sequence[Task], shared: Any) -> Generator[Outcome]:
        """Yield the outcome of every task as it ends, in any order; `shared` goes to each worker once.

        It is not to be changed afterwards: workers that are kept have it still when it is shared again. Closing the
        iterator stops whatever still runs.
        """

    @contextmanager
    def kept(self, function: Callable[..., Any] | None = None) -> Generator[AbstractExecutor]:
        """Keep what is costly to start for several runs within, and start it now.

        Whatever tasks with this `function` need is loaded beforehand, while their author is still busy.
        """
        yield self


class InProcess(AbstractExecutor):
    """One task after another in this process: for tests, for a debugger, and where processes may not be started."""

    def run(self, tasks: Sequence[Task], shared: Any) -> Generator[Outcome]:
        for task in tasks:
            yield attempt(task, shared)


def executor_of(workers: int = 2, scheduler: str = "") -> AbstractExecutor:
    """Return what runs tasks: the workers of a Dask scheduler, else processes of this machine; one is this process."""
    if scheduler:
        from friction_ocp.execution.cluster import Cluster

        return Cluster(scheduler)
    from friction_ocp.execution.processes import Processes

    return Processes(workers) if workers > 1 else InProcess()
