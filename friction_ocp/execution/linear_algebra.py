"""One thread for the linear algebra: its matrices are small.

Threads that wait for each other on a busy machine take many times as long, and round otherwise than workers do. Work is
shared out by segments and by tasks.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import ParamSpec, TypeVar

from threadpoolctl import threadpool_limits  # pyright: ignore[reportMissingTypeStubs]

P = ParamSpec("P")
R = TypeVar("R")

LINEAR_ALGEBRA = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
"""Environment in which libraries of linear algebra that are loaded later get one thread."""


def with_one_thread(function: Callable[P, R]) -> Callable[P, R]:
    """Give the linear algebra that is loaded one thread while a function runs."""

    @wraps(function)
    def call(*args: P.args, **kwargs: P.kwargs) -> R:
        with threadpool_limits(1, user_api="blas"):
            return function(*args, **kwargs)

    return call
