"""Tasks end on disk, are not done twice, and stop nobody when they fail."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest
from chores import dying, environment, failing, noted, slowly_noted, taking_processors

from friction_ocp.errors import Finding, FrictionOcpError
from friction_ocp.execution.executor import AbstractExecutor, InProcess, executor_of
from friction_ocp.execution.ledger import Ledger
from friction_ocp.execution.processes import Processes
from friction_ocp.execution.run import Tally, run_tasks
from friction_ocp.execution.task import Outcome, Task

HERE = str(Path(__file__).parent)
SPAWNED = Processes(2)


def run(
    tasks: list[Task], folder: Path, executor: AbstractExecutor, shared: str = "", **more: Any
) -> dict[str, Outcome]:
    """Run tasks with a ledger in a folder."""
    return dict(run_tasks("chores", tasks, folder, shared, executor, Ledger(folder / "tasks"), **more))


def done(folder: Path) -> list[str]:
    """Return what was worked on, in order of the alphabet."""
    path = folder / "done"
    return sorted(path.read_text(encoding="utf-8").split()) if path.exists() else []


def chores(*names: str) -> list[Task]:
    """Return tasks that take no time."""
    return [Task(name, noted, (name, float(len(name)))) for name in names]


@pytest.mark.parametrize("executor", [InProcess(), SPAWNED], ids=["in process", "spawned"])
def test_every_task_has_an_outcome(executor: AbstractExecutor, tmp_path: Path) -> None:
    """Values come back under their keys, in the order of the tasks; an error is an outcome and stops no other."""
    tasks = [*chores("one", "three"), Task("bad", failing, ("bad",)), *chores("seven")]
    outcomes = run(tasks, tmp_path, executor)
    assert list(outcomes) == ["one", "three", "bad", "seven"]
    assert [outcomes[key].value for key in ("one", "three", "seven")] == [
        {"value": len(k)} for k in ("one", "three", "seven")
    ]
    assert outcomes["bad"].error == "ZeroDivisionError: bad cannot be done"
    assert "chores.py" in outcomes["bad"].trace
    assert outcomes["bad"].value is None
    assert done(tmp_path) == ["bad", "one", "seven", "three"]


def test_what_is_on_disk_is_not_done_again(tmp_path: Path) -> None:
    """The next run takes values and errors from the folder and does only what is new."""
    before = run([*chores("one"), Task("bad", failing, ("bad",))], tmp_path, InProcess())
    tallies: list[Tally] = []
    after = run([*chores("one", "two"), Task("bad", failing, ("bad",))], tmp_path, InProcess(), watch=tallies.append)
    assert done(tmp_path) == ["bad", "one", "two"]
    assert (after["one"], after["bad"]) == (before["one"], before["bad"])
    assert [(tally.done, tally.total, tally.found, tally.failed) for tally in tallies] == [(2, 3, 2, 1), (3, 3, 2, 1)]


def test_what_was_changed_is_done_again(tmp_path: Path) -> None:
    """Another argument, or another problem behind the same keys, never meets an old result."""
    run(chores("one"), tmp_path, InProcess(), "a problem")
    other = run([Task("one", noted, ("one", 7.0))], tmp_path, InProcess(), "a problem")
    run(chores("one"), tmp_path, InProcess(), "another problem")
    assert other["one"].value == {"value": 7.0}
    assert done(tmp_path) == ["one", "one", "one"]


@pytest.mark.parametrize("text", ["", "{", "[]", '{"format": "friction-ocp-task/9"}'])
def test_a_damaged_result_is_done_again(text: str, tmp_path: Path) -> None:
    """A file that is cut off, of another kind or of a later format is as none."""
    run(chores("one"), tmp_path, InProcess())
    (kept,) = (tmp_path / "tasks").iterdir()
    assert json.loads(kept.read_text(encoding="utf-8"))["format"] == "friction-ocp-task/1"
    kept.write_text(text, encoding="utf-8")
    assert run(chores("one"), tmp_path, InProcess())["one"].value == {"value": 3.0}
    assert done(tmp_path) == ["one", "one"]


def test_a_key_cannot_lead_out_of_the_folder(tmp_path: Path) -> None:
    """Whatever a task is called, its file lies in the folder."""
    run([Task("../../x y", noted, ("x", 1.0))], tmp_path, InProcess())
    assert len(list((tmp_path / "tasks").iterdir())) == 1


def test_two_tasks_of_one_key_are_refused(tmp_path: Path) -> None:
    """One would overwrite the other."""
    with pytest.raises(ValueError, match="same key"):
        run(chores("one", "one"), tmp_path, InProcess())


def test_a_worker_that_dies_loses_its_own_task_only(tmp_path: Path) -> None:
    """Its task is lost and tried again in the next run; the others are done by those that are left and a new one."""
    tasks = [*chores("a", "b"), Task("dying", dying, ("dying",)), *chores("c", "d", "e")]
    first = run(tasks, tmp_path, SPAWNED)
    assert first["dying"].lost and "code -9" in first["dying"].error
    assert done(tmp_path) == ["a", "b", "c", "d", "e"]
    second = run(tasks, tmp_path, SPAWNED)
    assert second["dying"].value == {"value": 1.0}
    assert done(tmp_path) == ["a", "b", "c", "d", "dying", "e"]


def test_workers_do_not_share_out_processors_again(tmp_path: Path) -> None:
    """Each has one thread, and the environment of this process stays as it is."""
    before = dict(os.environ)
    found = run([Task("threads", environment, ("FRICTION_OCP_THREADS",))], tmp_path, SPAWNED)
    assert found["threads"].value == "1"
    assert dict(os.environ) == before


def test_the_last_at_work_takes_the_processors_of_all(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Workers share the processors out among those that have a task; when one is left it takes them all."""
    monkeypatch.setenv("FRICTION_OCP_THREADS", "2")
    tasks = [
        Task("long", taking_processors, ("long", ["short"])),
        Task("short", taking_processors, ("short", ["long"])),
    ]
    found = run(tasks, tmp_path, SPAWNED)
    assert found["long"].value == [1, 2]
    assert found["short"].value[0] == 1


def test_a_lone_task_takes_no_more_processors_than_are_stated(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Whoever states one thread has one, however many workers there are."""
    for stated, expected in (("1", 1), ("2", 2), ("64", 2)):
        monkeypatch.setenv("FRICTION_OCP_THREADS", stated)
        folder = tmp_path / stated
        folder.mkdir()
        found = run([Task("alone", taking_processors, ("alone", []))], folder, SPAWNED)
        assert found["alone"].value == [expected, expected]


def test_one_worker_is_this_process() -> None:
    """For a debugger."""
    assert isinstance(executor_of(1), InProcess)
    assert executor_of(3) == Processes(3)


def test_findings_keep_their_text(tmp_path: Path) -> None:
    """An error that was written for the reader is not dressed up as a Python one."""
    outcome = run([Task("bad", _finding)], tmp_path, InProcess())["bad"]
    assert outcome.error == "here: wrong; right; do it"


def _finding(shared: object) -> None:
    raise FrictionOcpError(Finding("here", "wrong", "right", "do it"))


SCRIPT = f"""
import sys
sys.path.insert(0, {HERE!r})
from pathlib import Path
from chores import slowly_noted
from friction_ocp.execution.ledger import Ledger
from friction_ocp.execution.processes import Processes
from friction_ocp.execution.run import run_tasks
from friction_ocp.execution.task import Task

if __name__ == "__main__":
    folder = Path(sys.argv[1])
    tasks = [Task(f"t{{k}}", slowly_noted, (f"t{{k}}", 0.05 if k < 3 else 30.0)) for k in range(6)]
    run_tasks("chores", tasks, folder, "", Processes(2), Ledger(folder / "tasks"))
"""


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGINT], ids=["killed", "interrupted"])
def test_what_had_ended_survives_a_kill(number: signal.Signals, tmp_path: Path) -> None:
    """After kill -9 or Ctrl-C the finished tasks are on disk, the workers are gone, and the next run does the rest."""
    with subprocess.Popen([sys.executable, "-c", SCRIPT, str(tmp_path)], stderr=subprocess.DEVNULL) as process:
        pass_by = time.monotonic() + 60
        while len(done(tmp_path)) < 3 or len(list((tmp_path / "tasks").glob("t*"))) < 3:
            assert time.monotonic() < pass_by
            time.sleep(0.05)
        os.kill(process.pid, number)
        process.wait(timeout=20)
    tasks = [Task(f"t{k}", slowly_noted, (f"t{k}", 0.05 if k < 3 else 30.0)) for k in range(3)]
    tallies: list[Tally] = []
    run(tasks, tmp_path, InProcess(), watch=tallies.append)
    assert tallies[0].found == 3
    assert done(tmp_path) == ["t0", "t1", "t2"]
    assert not list((tmp_path / "tasks").glob(".*"))
