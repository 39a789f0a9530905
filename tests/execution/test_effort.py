"""What tasks count is the same wherever they are worked on, and however often they are taken from disk."""

from __future__ import annotations

from pathlib import Path

import pytest
from chores import counting, patient

from friction_ocp.execution.effort import Limit, count, effort, limited, once, piece, spent, uncounted
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


@pytest.mark.parametrize("executor", [InProcess(), Processes(2)], ids=["here", "processes"])
def test_what_is_left_of_a_limit_is_shared_out_among_tasks(tmp_path: Path, executor: AbstractExecutor) -> None:
    """Each may take the least in any case; under another limit, a task on disk is another one."""
    tasks, ledger = [Task("one", patient, (100.0,)), Task("other", patient, (6.0,))], Ledger(tmp_path / "tasks")

    def taken() -> list[float]:
        return [outcome.value for outcome in run_tasks("chores", tasks, tmp_path, "", executor, ledger).values()]

    with limited(Limit(40.0, 3.0)):
        count(10.0)
        assert taken() == [15.0, 6.0]
        assert taken() == [5.0, 5.0]
        assert taken() == [3.0, 3.0]
    assert taken() == [100.0, 6.0]


def test_a_piece_of_work_ends_where_the_limit_does() -> None:
    """Or where it has taken the least that each may; a piece of a piece no later than that."""
    with limited(Limit(5.0, 2.0)):
        with piece():
            count(4.0)
            assert not spent()
            with piece():
                count(1.0)
                assert spent()
        with piece():
            assert not spent()
            count(2.0)
            assert spent()
    with piece():
        count(1e12)
        assert not spent()
