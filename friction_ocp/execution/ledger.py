"""Outcomes on disk, one file a task, found again by content."""

from __future__ import annotations

import json
import re
from abc import ABC, abstractmethod
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

from friction_ocp.execution.content import fingerprint, toolkit_fingerprint
from friction_ocp.execution.task import Outcome, Task
from friction_ocp.whole_file import whole_file

FORMAT = "friction-ocp-task/1"
"""{format, key, fingerprint, seconds, effort} with `value`, or with `error` and `trace`."""


class AbstractLedger(ABC):
    """Where outcomes outlive a run."""

    @abstractmethod
    def find(self, task: Task, shared_fingerprint: str) -> Outcome | None:
        """Return the outcome of a task from an earlier run; None where there is none, or none that can be read."""

    @abstractmethod
    def keep(self, task: Task, shared_fingerprint: str, outcome: Outcome) -> None:
        """Write an outcome; not that of a lost task, which the next run tries again."""


@dataclass(frozen=True)
class Ledger(AbstractLedger):
    """Outcomes in a folder; without one nothing is kept.

    A file is named after its task and the fingerprint of everything that decides its value: the shared argument, the
    task's own, its limit, and the code of the toolkit. What was changed is therefore never found, and is done again.
    """

    folder: Path | None = None

    def find(self, task: Task, shared_fingerprint: str) -> Outcome | None:
        path = self._path(task, shared_fingerprint)
        if path is None:
            return None
        try:
            content: Any = json.loads(path.read_text(encoding="utf-8"))
        except (OSError, ValueError):
            return None
        if not isinstance(content, dict) or content.get("format") != FORMAT:  # pyright: ignore[reportUnknownMemberType]
            return None
        return _outcome(task, cast("dict[str, Any]", content))

    def keep(self, task: Task, shared_fingerprint: str, outcome: Outcome) -> None:
        path = self._path(task, shared_fingerprint)
        if path is None or outcome.lost:
            return
        content = {"format": FORMAT, "key": task.key, "seconds": outcome.seconds, "effort": outcome.effort}
        content |= {"error": outcome.error, "trace": outcome.trace} if outcome.error else {"value": outcome.value}
        with whole_file(path) as staged:
            staged.write_text(json.dumps(content, allow_nan=False), encoding="utf-8")

    def _path(self, task: Task, shared_fingerprint: str) -> Path | None:
        if self.folder is None:
            return None
        decides = (shared_fingerprint, task.function, task.arguments, task.limit)
        content = fingerprint(toolkit_fingerprint(), *decides)
        stem = re.sub(r"[^\w.@-]+|\.{2,}", "_", task.key, flags=re.ASCII)[:80]
        return self.folder / f"{stem}-{content[:16]}.json"


def _outcome(task: Task, content: dict[str, Any]) -> Outcome:
    error, trace = (str(content.get(name, "")) for name in ("error", "trace"))
    seconds, effort = (float(content.get(name, 0.0)) for name in ("seconds", "effort"))
    return Outcome(task.key, content.get("value"), error, trace, seconds, effort)
