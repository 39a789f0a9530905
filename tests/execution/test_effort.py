"""What tasks count is the same wherever they are worked on, and however often they are taken from disk."""

from __future__ import annotations

from pathlib import Path

import pytest
from chores import counting

from friction_ocp.execution.effort import count, effort, once, uncounted
from friction_ocp.execution.executor import AbstractExecutor, InProcess
from friction_ocp.execution.ledger import Ledger
from friction_ocp.execution.processes import Processes
from friction_ocp.execution.run import run_tasks
from friction_ocp.execution.task import Task

TASKS = [Task("small", counting, (2.0,)), Task("large", counting, (40.0,)), Task("failing", counting, (-1.0,))]


@pytest.mark.parametrize("executor", [InProcess(), Processes(2)], ids=["here", "processes"])
def test_the_effort_of_tasks_counts_for_whoever_asked_for_them(tmp_path: Path, executor: AbstractExecutor) -> None:
    """In this process or in others, and again where they are found on disk; errors take effort, too."""
    for _ in range(2):
        before = effort()
        outcomes = run_tasks("chores", TASKS, tmp_path, "", executor, Ledger(tmp_path / "tasks"))
        assert effort() - before == 41.0
        assert [outcomes[key].effort for key in ("small", "large", "failing")] == [2.0, 40.0, -1.0]
        assert outcomes["failing"].error


def test_what_is_done_once_does_not_count() -> None:
    """Nor what is done where nothing is counted, be there an error."""
    before = effort()
    once(count)(5.0)
    with pytest.raises(ZeroDivisionError), uncounted():
        count(5.0)
        raise ZeroDivisionError
    count(1.0)
    assert effort() - before == 1.0
