"""The linear algebra gets one thread while this package works, and what it had before afterwards."""

from __future__ import annotations

import numpy as np
import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from friction_ocp.execution.linear_algebra import with_one_thread


def threads() -> set[int]:
    """Return how many threads the libraries of linear algebra have."""
    np.linalg.norm(np.eye(2))
    return {int(item["num_threads"]) for item in threadpool_info() if item["user_api"] == "blas"}


def test_one_thread_inside_and_as_many_as_before_outside() -> None:
    """Whoever calls this from a program of their own keeps their threads for what they do."""
    with threadpool_limits(2, user_api="blas"):
        assert with_one_thread(threads)() == {1}
        assert threads() == {2}


def test_an_error_gives_the_threads_back() -> None:
    """It passes through."""

    @with_one_thread
    def fail() -> None:
        raise ZeroDivisionError

    with threadpool_limits(2, user_api="blas"):
        with pytest.raises(ZeroDivisionError):
            fail()
        assert threads() == {2}
