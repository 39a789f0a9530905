"""Workers on a Dask cluster, of one machine or many."""

from __future__ import annotations

import os
import pickle
import threading
import warnings
from collections.abc import Generator, Sequence
from dataclasses import dataclass
from typing import Any

from friction_ocp.errors import Finding, FrictionOcpError
from friction_ocp.execution.content import toolkit_fingerprint
from friction_ocp.execution.executor import AbstractExecutor
from friction_ocp.execution.processes import ONE_THREAD
from friction_ocp.execution.task import Outcome, Task, attempt

INSTALL = "pip install 'friction-ocp[cluster]'"
PATIENCE = 10.0
"""Seconds to wait for the scheduler, and for a first worker."""

_one_at_a_time = threading.Lock()


@dataclass(frozen=True)
class Cluster(AbstractExecutor):
    """The workers of a Dask scheduler. A task whose worker is lost is done by another one."""

    address: str
    """Such as tcp://10.0.0.5:8786 or 127.0.0.1:8786."""

    def run(self, tasks: Sequence[Task], shared: Any) -> Generator[Outcome]:
        distributed = _library()
        client = _connected(distributed, self.address)
        try:
            _refuse_other_code(client, self.address)
            with warnings.catch_warnings():
                # what all tasks share is large and stays with the scheduler: a lost worker takes no copy with it
                warnings.filterwarnings("ignore", message="Sending large graph")
                known = client.submit(_unpacked, pickle.dumps(shared), pure=False)
            futures = {
                client.submit(
                    _done, pickle.dumps(task), known, pure=False, key=f"{task.key}-{index}-{os.getpid()}"
                ): task
                for index, task in enumerate(tasks)
            }
            for future in distributed.as_completed(list(futures), loop=client.loop):
                outcome = _outcome(future, futures.pop(future))
                future.release()  # else the cluster would do it again once the worker that holds its value is lost
                yield outcome
        finally:
            client.close(PATIENCE)


def _library() -> Any:
    try:
        import distributed
    except ImportError as error:
        what = "the package 'distributed' is not installed"
        raise FrictionOcpError(Finding("--scheduler", what, remedy=INSTALL)) from error
    return distributed


def _connected(distributed: Any, address: str) -> Any:
    try:
        client = distributed.Client(address, timeout=PATIENCE, set_as_default=False)
    except (OSError, ValueError, TimeoutError) as error:
        what = f"no scheduler answers at {address} ({error})"
        remedy = "start one with `dask scheduler`, and workers with `dask worker ADDRESS --nthreads 1`"
        raise FrictionOcpError(
            Finding("--scheduler", what, "an address such as tcp://127.0.0.1:8786", remedy)
        ) from error
    try:
        client.wait_for_workers(1, timeout=PATIENCE)
    except TimeoutError as error:
        client.close()
        remedy = f"start some with `dask worker {address} --nthreads 1`"
        raise FrictionOcpError(Finding("--scheduler", f"{address} has no workers", remedy=remedy)) from error
    return client


def _refuse_other_code(client: Any, address: str) -> None:
    """Refuse workers whose toolkit is another one: their numbers would not be those of this process."""
    found = client.run(_code, on_error="return")
    other = [worker for worker, code in found.items() if code != toolkit_fingerprint()]
    if other:
        client.close()
        what = f"{', '.join(other)} of {address} have another version of friction-ocp, or none"
        raise FrictionOcpError(Finding("--scheduler", what, remedy="install the same version on every worker"))


def _code() -> str:
    return toolkit_fingerprint()


def _unpacked(content: bytes) -> Any:
    return pickle.loads(content)


def _done(task: bytes, shared: Any) -> Outcome:
    """Do a task on a worker: one at a time in a process, on one thread."""
    with _one_at_a_time:
        os.environ.update(ONE_THREAD)
        return attempt(pickle.loads(task), shared)


def _outcome(future: Any, task: Task) -> Outcome:
    """Return what came of a task; the cluster gives up on one that took several workers with it.

    A worker that is lost between the end of a task and the fetching of its value has another one do it again: a future
    that has ended may be pending once more, and is waited for.
    """
    if future.status in ("error", "cancelled"):
        reason = future.exception() if future.status == "error" else future.status
        return Outcome(task.key, error=f"the cluster lost it ({type(reason).__name__}: {reason})", lost=True)
    return future.result()
