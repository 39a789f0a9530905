"""Tasks for the tests: workers import them by name."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Callable
from pathlib import Path

from friction_ocp.execution.effort import count, effort, piece, spent
from friction_ocp.execution.processors import processors

PATIENCE = 30.0
"""Seconds to wait for another task."""


def noted(folder: Path, name: str, value: float) -> dict[str, float]:
    """Leave a line that says that this was done, and return a value."""
    with (folder / "done").open("a", encoding="utf-8") as file:
        file.write(f"{name}\n")
    return {"value": value}


def slowly_noted(folder: Path, name: str, seconds: float) -> dict[str, float]:
    """The same after a while."""
    time.sleep(seconds)
    return noted(folder, name, seconds)


def failing(folder: Path, name: str) -> None:
    """Leave a line and fail."""
    noted(folder, name, 0.0)
    raise ZeroDivisionError(f"{name} cannot be done")


def dying(folder: Path, name: str) -> dict[str, float]:
    """Kill the worker, but only once."""
    first = not (folder / f"{name}-died").exists()
    (folder / f"{name}-died").touch()
    if first:
        os.kill(os.getpid(), signal.SIGKILL)
    return noted(folder, name, 1.0)


def environment(folder: Path, name: str) -> str | None:
    """Return a variable of the worker's environment."""
    return os.environ.get(name)


def counting(folder: Path, work: float) -> float:
    """Count some work; less than none is an error."""
    count(work)
    if work < 0.0:
        raise ValueError("no work at all")
    return work


def taking_processors(folder: Path, name: str, others: list[str]) -> list[int]:
    """Return how many processors this may take beside others, and how many once they have ended.

    The one called `long` waits for that.
    """

    def have(what: str) -> bool:
        done = (folder / "done").read_text(encoding="utf-8").split()
        return all(f"{other}-{what}" in done for other in others)

    noted(folder, f"{name}-begun", 0.0)
    _wait_for(lambda: have("begun"))
    beside = processors()
    noted(folder, f"{name}-looked", 0.0)
    _wait_for(lambda: have("looked"))
    if name == "long":
        _wait_for(lambda: processors() != beside)
    return [beside, processors()]


def _wait_for(happened: Callable[[], bool]) -> None:
    until = time.monotonic() + PATIENCE
    while not happened() and time.monotonic() < until:
        time.sleep(0.01)


def patient(folder: Path, most: float) -> float:
    """Count one by one until that is enough, or nothing is left of a limit."""
    begun = effort()
    with piece():
        while not spent() and effort() - begun < most:
            count(1.0)
    return effort() - begun
