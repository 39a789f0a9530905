"""Simulation of many segments with sensitivities: the one front of native code and CasADi's virtual machine."""

from __future__ import annotations

import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from itertools import pairwise

import casadi as ca
import numpy as np

from friction_ocp.drive.stepping import SteppedDrive
from friction_ocp.simulation.compiled import compile_sweep
from friction_ocp.simulation.grid import FloatArray, Grid, IntArray
from friction_ocp.simulation.interpreted import InterpretedKernel
from friction_ocp.simulation.kernel import AbstractKernel, SweepRequest, SweepResult, empty_result

__all__ = ["Sweep", "SweepRequest", "SweepResult"]

STEPS_WORTH_A_THREAD = 1500
"""Integrator steps (about 0.3 ms) below which handing work to another thread costs more than it saves."""


class Sweep:
    """The one-step functions of a drive, looped over grids."""

    def __init__(self, drive: SteppedDrive, active: Sequence[int], values_only: bool = False) -> None:
        self.drive = drive
        self.active = tuple(active)
        self.start = _start_with_slope(drive, self.active)
        """(y, dy, ddy, u, p) -> start state and its derivative by the active numbers."""
        self.kernel: AbstractKernel = compile_sweep(drive, self.active, values_only) or InterpretedKernel(
            drive, self.active
        )

    def run(
        self,
        grid: Grid,
        first: IntArray,
        x0: FloatArray,
        p: FloatArray,
        width: FloatArray,
        derivatives: bool = False,
        with_states: bool = False,
    ) -> SweepResult:
        """Simulate segments that begin at nodes `first[:-1]` (the last entry is the last node).

        `x0` (segments, states), `p` (parameters,), `width` (groups + 1,).
        """
        return self.run_many([SweepRequest(grid, first, x0, p, width, derivatives, with_states)])[0]

    def run_many(self, requests: Sequence[SweepRequest]) -> list[SweepResult]:
        """Simulate several recordings, side by side where there is more than one processor."""
        results = [self._empty(request) for request in requests]
        threads = worker_count() if self.kernel.parallel else 1
        pieces = _pieces(requests, threads)

        def work(piece: tuple[int, int, int]) -> None:
            index, begin, stop = piece
            self.kernel.run(requests[index], begin, stop, results[index])

        if threads > 1 and len(pieces) > 1:
            list(_pool(threads).map(work, pieces))
        else:
            for piece in pieces:
                work(piece)
        return results

    def _empty(self, request: SweepRequest) -> SweepResult:
        drive = self.drive
        return empty_result(request, len(drive.state_names), len(drive.output_names), len(self.active))


def worker_count() -> int:
    """Return how many threads may work: FRICTION_OCP_THREADS, else the processors of this process."""
    stated = os.environ.get("FRICTION_OCP_THREADS", "")
    if stated.isdigit():
        return max(1, int(stated))
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else (os.cpu_count() or 1)


@cache
def _pool(threads: int) -> ThreadPoolExecutor:
    return ThreadPoolExecutor(threads, thread_name_prefix="sweep")


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_pool.cache_clear)


def _pieces(requests: Sequence[SweepRequest], threads: int) -> list[tuple[int, int, int]]:
    """Cut requests into (request, first segment, last segment + 1) of about equal work, the largest first."""
    steps = [np.add.reduceat(request.grid.substeps, request.first[:-1]) for request in requests]
    total = sum(int(count.sum()) for count in steps)
    share = max(total / threads, STEPS_WORTH_A_THREAD)
    pieces: list[tuple[int, int, int, int]] = []
    for index, count in enumerate(steps):
        parts = max(1, min(len(count), round(int(count.sum()) / share)))
        goals: FloatArray = count.sum() * np.arange(1, parts) / parts
        cuts = [0, *(int(edge) + 1 for edge in np.searchsorted(np.cumsum(count), goals)), len(count)]
        pieces += [(int(count[a:b].sum()), index, a, b) for a, b in pairwise(cuts) if b > a]
    if total < 2 * STEPS_WORTH_A_THREAD:
        return [(index, 0, len(request.first) - 1) for index, request in enumerate(requests)]
    return [(index, a, b) for _, index, a, b in sorted(pieces, reverse=True)]


def _start_with_slope(drive: SteppedDrive, active: Sequence[int]) -> ca.Function:
    arguments = [ca.SX.sym(f"a{k}", drive.start.size1_in(k)) for k in range(5)]
    value = drive.start.call(arguments, True, False)[0]
    chosen = ca.vertcat(*[arguments[4][k] for k in active]) if active else ca.SX(0, 1)
    return ca.Function("start", arguments, [ca.densify(value), ca.densify(ca.jacobian(value, chosen))])
