"""How much work was done, in steps and not in seconds: the same on every machine, in any number of processes."""

from __future__ import annotations

import math
from collections.abc import Callable, Generator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from functools import wraps
from typing import ParamSpec, TypeVar

P = ParamSpec("P")
R = TypeVar("R")


@dataclass(frozen=True)
class Limit:
    """What the search for something better may take."""

    left: float = math.inf
    """In all, of what is not done yet."""
    least: float = 0.0
    """Every piece of it, in any case."""


UNLIMITED = Limit()

_done: ContextVar[float] = ContextVar("effort", default=0.0)
_end: ContextVar[float] = ContextVar("end", default=math.inf)
"""Effort at which nothing is left of the limit."""
_least: ContextVar[float] = ContextVar("least", default=0.0)
_end_of_piece: ContextVar[float] = ContextVar("end of piece", default=math.inf)


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


def limit(parts: int) -> Limit:
    """Return what each of several parts of the work may take, done elsewhere, of what is left here of the limit."""
    return Limit(max(_end.get() - effort(), 0.0) / max(parts, 1), _least.get())


@contextmanager
def limited(by: Limit) -> Generator[None]:
    """Limit every `piece` of work inside."""
    end, least = _end.set(effort() + by.left), _least.set(by.least)
    try:
        yield
    finally:
        _end.reset(end)
        _least.reset(least)


@contextmanager
def piece() -> Generator[None]:
    """Begin a piece of work that can end early with what it has, and asks for that (`spent`)."""
    end = _end_of_piece.set(min(_end_of_piece.get(), max(_end.get(), effort() + _least.get())))
    try:
        yield
    finally:
        _end_of_piece.reset(end)


def spent() -> bool:
    """Whether the piece of work that this belongs to has taken what it may."""
    return effort() >= _end_of_piece.get()


def once(function: Callable[P, R]) -> Callable[P, R]:
    """Do not count the work of a function whose result is kept."""

    @wraps(function)
    def call(*args: P.args, **kwargs: P.kwargs) -> R:
        with uncounted():
            return function(*args, **kwargs)

    return call
