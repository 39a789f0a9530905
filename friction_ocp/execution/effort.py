"""How much work was done, in steps and not in seconds: the same on every machine, in any number of processes."""

from __future__ import annotations

from collections.abc import Callable, Generator
from contextlib import contextmanager
from contextvars import ContextVar
from functools import wraps
from typing import ParamSpec, TypeVar

P = ParamSpec("P")
R = TypeVar("R")

_done: ContextVar[float] = ContextVar("effort", default=0.0)


def effort() -> float:
    """Return what was done so far in this context."""
    return _done.get()


def count(work: float) -> None:
    """Count work, in whatever unit all of it is counted in."""
    _done.set(_done.get() + work)


@contextmanager
def uncounted() -> Generator[None]:
    """Count nothing inside: what a process does once, whoever asks first, is no work of that one."""
    before = _done.get()
    try:
        yield
    finally:
        _done.set(before)


def once(function: Callable[P, R]) -> Callable[P, R]:
    """Do not count the work of a function whose result is kept."""

    @wraps(function)
    def call(*args: P.args, **kwargs: P.kwargs) -> R:
        with uncounted():
            return function(*args, **kwargs)

    return call
