"""How many processors the work of a process may take."""

from __future__ import annotations

import os
from typing import Protocol

THREADS = "FRICTION_OCP_THREADS"


class Number(Protocol):
    """A number that another process sets."""

    value: int


_share: Number | None = None


def take_share(share: Number) -> None:
    """Take, from now on, as many processors as a number says at the time."""
    global _share
    _share = share


def processors() -> int:
    """Return how many threads may work: what this process was given, FRICTION_OCP_THREADS, or all its processors."""
    if _share is not None:
        return max(1, _share.value)
    stated = os.environ.get(THREADS, "")
    if stated.isdigit():
        return max(1, int(stated))
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else (os.cpu_count() or 1)
