"""A piece of work and what came of it."""

from __future__ import annotations

import time
import traceback
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

from friction_ocp.errors import FrictionOcpError
from friction_ocp.execution.effort import UNLIMITED, Limit, effort, limited, uncounted

Json = Any
"""What a JSON file holds: None, bool, int, finite float, str, lists and dictionaries of these."""


@dataclass(frozen=True)
class Task:
    """A call `function(shared, *arguments)`; function and arguments can be pickled, the value is `Json`."""

    key: str
    """Names the task among those of one run, in progress lines and on disk."""
    function: Callable[..., Json]
    arguments: tuple[Any, ...] = ()
    limit: Limit = UNLIMITED
    """Of the effort that it takes where it could do with less."""


@dataclass(frozen=True)
class Outcome:
    """What came of a task: a value, or the reason why there is none."""

    key: str
    value: Json = None
    error: str = ""
    trace: str = ""
    """Where the error came from, for whoever repairs it."""
    seconds: float = 0.0
    effort: float = 0.0
    """What it counted (`effort.count`)."""
    lost: bool = False
    """The process that worked on it ended before the task did; another run may have more luck."""


def attempt(task: Task, shared: Any) -> Outcome:
    """Do a task; an error is an outcome like any other, only an interrupt gets through."""
    began, before = time.perf_counter(), effort()
    with uncounted(), limited(task.limit):  # whoever asked for the task counts it
        try:
            found = Outcome(task.key, task.function(shared, *task.arguments))
        except FrictionOcpError as error:
            found = Outcome(task.key, error=str(error))
        except Exception as error:
            found = Outcome(task.key, error=f"{type(error).__name__}: {error}", trace=traceback.format_exc())
        return replace(found, seconds=time.perf_counter() - began, effort=effort() - before)
