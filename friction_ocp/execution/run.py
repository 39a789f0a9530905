"""Tasks through an executor and a ledger: what is on disk is not done again."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from typing import Any

from friction_ocp.execution.effort import count, limit
from friction_ocp.execution.executor import AbstractExecutor
from friction_ocp.execution.ledger import AbstractLedger, Ledger
from friction_ocp.execution.task import Outcome, Task


@dataclass(frozen=True)
class Tally:
    """How far a run of tasks is."""

    what: str
    """What the tasks are, such as "starts"."""
    done: int
    total: int
    found: int
    """How many of `done` were on disk already."""
    failed: int
    last: str = ""
    """Key of the task that ended last."""


Watch = Callable[[Tally], None]


def unwatched(tally: Tally) -> None:
    """Report nothing."""


def run_tasks(
    what: str,
    tasks: Sequence[Task],
    shared: Any,
    shared_fingerprint: str,
    executor: AbstractExecutor,
    ledger: AbstractLedger = Ledger(),
    watch: Watch = unwatched,
) -> Mapping[str, Outcome]:
    """Return the outcome of every task by its key, in the order of the tasks.

    An outcome is on disk before the next one is awaited. An error is an outcome; an interrupt is raised, and the next
    run with the same ledger goes on from there. The effort of all tasks counts, also of those on disk;
    what is left of a limit on it is shared out among them.
    """
    each = limit(len(tasks))
    tasks = [replace(task, limit=each) for task in tasks]
    by_key = {task.key: task for task in tasks}
    if len(by_key) != len(tasks):
        raise ValueError(f"{what}: two tasks have the same key")
    known = {task.key: ledger.find(task, shared_fingerprint) for task in tasks}
    outcomes = {key: outcome for key, outcome in known.items() if outcome is not None}
    found = len(outcomes)

    def tell(last: str = "") -> None:
        failed = sum(bool(outcome.error) for outcome in outcomes.values())
        watch(Tally(what, len(outcomes), len(tasks), found, failed, last))

    tell()
    left = [task for task in tasks if task.key not in outcomes]
    if left:
        with closing(executor.run(left, shared)) as running:
            for outcome in running:
                ledger.keep(by_key[outcome.key], shared_fingerprint, outcome)
                outcomes[outcome.key] = outcome
                tell(outcome.key)
    count(sum(outcome.effort for outcome in outcomes.values()))
    return {task.key: outcomes[task.key] for task in tasks}
