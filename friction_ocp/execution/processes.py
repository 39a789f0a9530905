"""Worker processes on this machine.

Each is spawned, never forked: CasADi and compiled sweeps hold threads that a fork would leave locked. A worker that
dies takes its own task with it and no other, which the pools of the standard library do not offer.
"""

from __future__ import annotations

import multiprocessing
import os
import pickle
import signal
import threading
from collections.abc import Callable, Generator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from multiprocessing.context import SpawnProcess
from typing import Any

from friction_ocp.errors import Finding, FrictionOcpError
from friction_ocp.execution.executor import AbstractExecutor
from friction_ocp.execution.linear_algebra import LINEAR_ALGEBRA
from friction_ocp.execution.processors import THREADS, Number, processors, take_share
from friction_ocp.execution.task import Outcome, Task, attempt

ONE_THREAD = {THREADS: "1", **LINEAR_ALGEBRA}
"""Environment of a worker: the processors are shared out among those that work."""
CONTEXT = multiprocessing.get_context("spawn")
PATIENCE = 5.0
"""Seconds that a worker has to end before it is killed."""


@dataclass(frozen=True)
class Processes(AbstractExecutor):
    """A fixed number of worker processes, each with one task at a time."""

    workers: int = 2

    def run(self, tasks: Sequence[Task], shared: Any) -> Generator[Outcome]:
        with self.kept() as kept:
            yield from kept.run(tasks, shared)

    @contextmanager
    def kept(self, function: Callable[..., Any] | None = None) -> Generator[AbstractExecutor]:
        team = _Team(self.workers, function)
        try:
            if function is not None:
                team.hire(self.workers)
            yield team
        finally:
            team.dismiss()


@dataclass
class _Worker:
    process: SpawnProcess
    connection: Connection
    ready: bool = False
    task: Task | None = None
    version: int = 0
    """The shared argument that it has."""


class _Team(AbstractExecutor):
    """Workers, what each is doing, and what is left to do; they stay from one run to the next.

    Together they take a processor for each; where few tasks are left, those at work take those of the others, too.
    """

    def __init__(self, size: int, function: Callable[..., Any] | None) -> None:
        self._size, self._loaded = size, pickle.dumps(function)
        self._most, self._each = min(size, processors()), CONTEXT.RawValue("i", 1)
        self._shared: Any = None
        self._packed, self._version = b"", 0
        self._waiting: list[Task] = []
        self._workers: list[_Worker] = []

    def run(self, tasks: Sequence[Task], shared: Any) -> Generator[Outcome]:
        if self._version == 0 or shared is not self._shared:
            self._shared, self._packed, self._version = shared, pickle.dumps(shared), self._version + 1
        self._waiting, left = list(tasks)[::-1], len(tasks)
        try:
            self.hire(min(self._size, left) - len(self._workers))
            for worker in self._workers.copy():
                self._hand_out(worker)
            while left:
                for outcome in self._listen():
                    left -= 1
                    yield outcome
        finally:
            if left:  # what still runs is of no use to the next run
                self.dismiss()

    def hire(self, count: int) -> None:
        """Start workers."""
        with environment(ONE_THREAD):
            for _ in range(count):
                ours, theirs = CONTEXT.Pipe()
                process = CONTEXT.Process(target=_serve, args=(theirs, self._loaded, self._each), daemon=True)
                process.start()
                theirs.close()
                self._workers.append(_Worker(process, ours))

    def _listen(self) -> list[Outcome]:
        """Wait for any worker to speak or die; hand out the next tasks and return what has ended."""
        speaking = wait([worker.connection for worker in self._workers])
        heard = [self._hear(worker) for worker in self._workers.copy() if worker.connection in speaking]
        self._share_out()
        return [outcome for outcome in heard if outcome is not None]

    def _hear(self, worker: _Worker) -> Outcome | None:
        try:
            outcome: Outcome | None = worker.connection.recv()
        except (EOFError, OSError):
            return self._bury(worker)
        worker.ready, worker.task = True, None
        self._hand_out(worker)
        return outcome

    def _hand_out(self, worker: _Worker) -> None:
        """Give the next task to a worker that is idle, with the shared argument where it has that of another run."""
        if not worker.ready or worker.task is not None or not self._waiting:
            return
        task = worker.task = self._waiting.pop()
        self._share_out()
        try:
            packed = self._packed if worker.version != self._version else None
            worker.connection.send_bytes(pickle.dumps((packed, task)))
        except OSError:  # it died while it was idle: whoever takes its place takes the task
            self._waiting.append(task)
            worker.task = None
            return
        worker.version = self._version

    def _share_out(self) -> None:
        """Give the processors to the workers that have a task."""
        working = sum(worker.task is not None for worker in self._workers)
        self._each.value = max(1, self._most // max(1, working))

    def _bury(self, worker: _Worker) -> Outcome | None:
        """Replace a worker that died; its task is lost."""
        worker.process.join(PATIENCE)
        code = worker.process.exitcode
        self._release(worker)
        if not worker.ready:
            what = f"a worker process ended with code {code} before it could begin"
            remedy = "a script that calls this needs `if __name__ == '__main__':`; or run with one worker"
            raise FrictionOcpError(Finding("execution", what, remedy=remedy))
        if self._waiting:
            self.hire(1)
        if worker.task is None:
            return None
        return Outcome(worker.task.key, error=f"its process ended with code {code}", lost=True)

    def _release(self, worker: _Worker) -> None:
        worker.connection.close()
        self._workers.remove(worker)

    def dismiss(self) -> None:
        """Let all workers go."""
        for worker in self._workers:
            worker.process.terminate()
        for worker in self._workers.copy():
            worker.process.join(PATIENCE)
            if worker.process.is_alive():
                worker.process.kill()
            self._release(worker)


@contextmanager
def environment(changes: dict[str, str]) -> Generator[None]:
    """Set variables of the environment for a while."""
    before = {name: os.environ.get(name) for name in changes}
    os.environ.update(changes)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value


def _serve(connection: Connection, loaded: bytes, threads: Number) -> None:
    """Work on tasks until the other end closes, in as many threads as there are to be then; Ctrl-C is for the parent.

    What is `loaded` is a function, for the modules that it needs.
    """
    take_share(threads)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    pickle.loads(loaded)
    shared: Any = None
    connection.send(None)
    while True:
        try:
            content = connection.recv_bytes()
        except (EOFError, OSError):
            return
        packed, task = pickle.loads(content)
        shared = shared if packed is None else pickle.loads(packed)
        connection.send(attempt(task, shared))


def _end_with_parent() -> None:
    """Leave at once where the parent was killed: nobody would hear the outcome."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        wait([parent.sentinel])
        os._exit(1)
