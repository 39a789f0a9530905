"""A real Dask scheduler and two workers on this machine: the same numbers, and a lost worker costs its task only."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from axes import fitted_axis, measured_axis
from chores import failing, noted, slowly_noted
from diagnosis_cases import axis, write_case

from friction_ocp.diagnosis.diagnose import diagnose
from friction_ocp.diagnosis_document import diagnosis_document
from friction_ocp.errors import FrictionOcpError
from friction_ocp.execution.cluster import Cluster, _outcome
from friction_ocp.execution.executor import InProcess, executor_of
from friction_ocp.execution.ledger import Ledger
from friction_ocp.execution.run import Tally, run_tasks
from friction_ocp.execution.task import Outcome, Task
from friction_ocp.problem_file.load import load_problem
from friction_ocp.statistics.execution import Execution
from friction_ocp.statistics.multistart import multistart

HERE = Path(__file__).parent
PATIENCE = 60.0


@dataclass
class Workers:
    """A scheduler and its workers, each a process of its own."""

    address: str
    folder: Path
    processes: list[subprocess.Popen[bytes]]

    def hire(self) -> None:
        """Start a worker with one thread, which nobody restarts."""
        options = ["--nthreads", "1", "--no-nanny", "--no-dashboard", "--local-directory", str(self.folder)]
        self.processes.append(_started("dask_worker", self.address, *options))

    def kill_one(self) -> None:
        """End the worker that was hired first, as a power cut would."""
        os.kill(self.processes[0].pid, signal.SIGKILL)
        self.processes.pop(0).wait()


def _started(program: str, *options: str) -> subprocess.Popen[bytes]:
    path = os.pathsep.join([str(HERE), os.environ.get("PYTHONPATH", "")])  # workers import chores by name
    environment = os.environ | {"PYTHONPATH": path, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    command = [sys.executable, "-W", "ignore", "-m", f"distributed.cli.{program}", *options]
    return subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, env=environment)


@pytest.fixture(scope="module")
def scheduler(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Workers]:
    """A scheduler on loopback, without workers."""
    folder = tmp_path_factory.mktemp("cluster")
    file = folder / "scheduler.json"
    options = ["--host", "127.0.0.1", "--port", "0", "--no-dashboard", "--no-show", "--scheduler-file", str(file)]
    process = _started("dask_scheduler", *options)
    began = time.monotonic()
    while not file.exists() or not file.read_text(encoding="utf-8"):
        assert process.poll() is None and time.monotonic() - began < PATIENCE
        time.sleep(0.05)
    yield Workers(json.loads(file.read_text(encoding="utf-8"))["address"], folder, [])
    process.terminate()
    process.wait(timeout=PATIENCE)


@pytest.fixture
def workers(scheduler: Workers) -> Iterator[Workers]:
    """Two workers."""
    scheduler.hire()
    scheduler.hire()
    yield scheduler
    while scheduler.processes:
        scheduler.kill_one()


def test_every_task_has_an_outcome(workers: Workers, tmp_path: Path) -> None:
    """Values and errors come back as from local workers, and are on disk."""
    tasks = [Task("one", noted, ("one", 1.0)), Task("bad", failing, ("bad",)), Task("two", noted, ("two", 2.0))]
    ledger = Ledger(tmp_path / "tasks")
    found = run_tasks("chores", tasks, tmp_path, "", executor_of(scheduler=workers.address), ledger)
    assert [outcome.value for outcome in found.values()] == [{"value": 1.0}, None, {"value": 2.0}]
    assert found["bad"].error == "ZeroDivisionError: bad cannot be done" and not found["bad"].lost
    assert len(list((tmp_path / "tasks").iterdir())) == 3


@dataclass
class Ended:
    """A future that has ended, whose worker was lost before its value was fetched: `status` is what it says of that."""

    status: str
    value: Outcome

    def result(self) -> Outcome:
        """Return the value that another worker has found meanwhile."""
        return self.value

    def exception(self) -> Exception:
        """Return why the cluster has given up."""
        return RuntimeError("three workers died")


@pytest.mark.parametrize("status", ["finished", "pending", "lost"])
def test_a_value_that_is_lost_on_the_way_is_waited_for(status: str) -> None:
    """The cluster does its task again, and what comes of that counts."""
    task = Task("t", slowly_noted, ("t", 0.3))
    again = Outcome("t", value={"value": 0.3})
    assert _outcome(Ended(status, again), task) is again


@pytest.mark.parametrize(("status", "said"), [("error", "three workers died"), ("cancelled", "cancelled")])
def test_a_task_that_the_cluster_gives_up_is_lost(status: str, said: str) -> None:
    """It has no value, and an error that says why."""
    found = _outcome(Ended(status, Outcome("t", value=1.0)), Task("t", slowly_noted, ("t", 0.3)))
    assert found.lost and found.value is None and found.error is not None and said in found.error


def test_a_lost_worker_costs_its_task_only(workers: Workers, tmp_path: Path) -> None:
    """What it worked on is done again by the other one; nothing that had come back is."""
    tasks = [Task(f"t{k}", slowly_noted, (f"t{k}", 0.3)) for k in range(8)]
    back: list[str] = []

    def watch(tally: Tally) -> None:
        if tally.done == 3:
            workers.kill_one()
        if 1 <= tally.done <= 3:
            back.append(tally.last)

    found = run_tasks("chores", tasks, tmp_path, "", Cluster(workers.address), Ledger(tmp_path / "tasks"), watch)
    assert [outcome.value for outcome in found.values()] == [{"value": 0.3}] * 8
    done = (tmp_path / "done").read_text(encoding="utf-8").split()
    assert set(done) == set(found)
    assert len(back) == 3 and all(done.count(key) == 1 for key in back)


def test_a_multistart_that_loses_a_worker_has_the_same_numbers(workers: Workers, tmp_path: Path) -> None:
    """Objectives, ends and standard errors are those of this process, to the last bit."""
    problem = fitted_axis(measured_axis(1))

    def watch(tally: Tally) -> None:
        if tally.done == 2:
            workers.kill_one()

    local = multistart(problem, 6, Execution(InProcess()))
    remote = multistart(problem, 6, Execution(Cluster(workers.address), tmp_path, watch=watch))
    assert len(workers.processes) == 1
    for ours, theirs in zip(local.ends, remote.ends, strict=True):
        assert ours.optimum is not None and theirs.optimum is not None
        assert theirs.optimum.solution.objective == ours.optimum.solution.objective
        np.testing.assert_array_equal(theirs.optimum.solution.point.theta, ours.optimum.solution.point.theta)
    np.testing.assert_array_equal(local.estimate.uncertainty.std_error, remote.estimate.uncertainty.std_error)


@pytest.mark.slow
def test_a_diagnosis_that_loses_a_worker_has_the_same_numbers(workers: Workers, tmp_path: Path) -> None:
    """The whole document, but for the time that it took."""
    problem = load_problem(write_case(tmp_path, axis(law="stribeck", tau_s=0.15, omega_s=6.0)))
    killed: list[bool] = []

    def tell(what: str, share: float) -> None:
        if "refits" in what and not killed:
            killed.append(True)
            workers.kill_one()

    local = document(diagnose(problem))
    remote = document(diagnose(problem, tell, Execution(Cluster(workers.address), tmp_path / "out")))
    assert killed and len(workers.processes) == 1
    assert remote == local
    assert [item["effect"] for item in local["accepted"]] == ["stribeck"]


def document(diagnosis: Any) -> dict[str, Any]:
    """Return the result without what differs between equal runs."""
    found = diagnosis_document(replace(diagnosis, seconds=0.0))
    return {key: value for key, value in found.items() if key != "provenance"}


def test_a_scheduler_without_workers_is_told(scheduler: Workers, monkeypatch: pytest.MonkeyPatch) -> None:
    """With the command that starts some."""
    monkeypatch.setattr("friction_ocp.execution.cluster.PATIENCE", 0.5)
    with pytest.raises(FrictionOcpError, match=r"has no workers; start some with `dask worker"):
        list(Cluster(scheduler.address).run([Task("one", noted, ("one", 1.0))], None))


def test_workers_with_other_code_are_refused(workers: Workers, monkeypatch: pytest.MonkeyPatch) -> None:
    """Their numbers could be others."""
    monkeypatch.setattr("friction_ocp.execution.cluster.toolkit_fingerprint", lambda: "something else")
    with pytest.raises(FrictionOcpError, match="have another version of friction-ocp"):
        list(Cluster(workers.address).run([Task("one", noted, ("one", 1.0))], None))
