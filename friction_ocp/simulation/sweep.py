"""Simulation of many segments with sensitivities: the one front of native code and CasADi's virtual machine."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache

import casadi as ca
import numpy as np

from friction_ocp.drive.input_noise import with_input_noise
from friction_ocp.drive.parts import Drive
from friction_ocp.drive.stepping import SteppedDrive, stepped
from friction_ocp.execution.effort import count
from friction_ocp.execution.processors import processors
from friction_ocp.kept import kept
from friction_ocp.simulation.compiled import compile_sweep
from friction_ocp.simulation.grid import FloatArray, Grid, IntArray
from friction_ocp.simulation.interpreted import InterpretedKernel
from friction_ocp.simulation.kernel import AbstractKernel, Piece, SweepRequest, SweepResult, empty_result

__all__ = ["Sweep", "SweepRequest", "SweepResult", "sweep_of"]

TOGETHER = 1024
"""Nodes whose start states are evaluated in one call: CasADi's maps take long to make where they are long."""
MAPS = 16
"""Maps of the start states that a sweep keeps."""
BESIDE = 6e4
"""Effort of a call beside its integrator steps, in steps: what prepares it and what is made of its result. On a
telescope axis under diagnosis, whose recordings take 18,000 steps, that is most of the time."""


class Sweep:
    """The one-step functions of a drive, looped over grids."""

    def __init__(self, drive: SteppedDrive, active: Sequence[int], values_only: bool = False) -> None:
        self.drive = drive
        self.active = tuple(active)
        self.start = _start_with_slope(drive, self.active)
        """(y, dy, ddy, u, p) -> start state and its derivative by the active numbers."""
        self.starts = lru_cache(MAPS)(self.start.map)
        """The same at as many nodes as asked for."""
        self._states = lru_cache(MAPS)(drive.start.map)
        self.kernel: AbstractKernel = compile_sweep(drive, self.active, values_only) or InterpretedKernel(
            drive, self.active
        )

    def start_states(self, signals: Sequence[FloatArray], p: FloatArray) -> FloatArray:
        """Return (k, states) start states at k nodes from the signals there: y, dy, ddy, u, (k, channels) each."""
        count = len(signals[0])
        states = np.zeros((count, len(self.drive.state_names)))
        for first in range(0, count, TOGETHER):
            block = [signal[first : first + TOGETHER].T for signal in signals]
            states[first : first + TOGETHER] = np.asarray(self._states(block[0].shape[1])(*block, p)).T
        return states

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
        pieces = [Piece(request, into, into.course) for request, into in zip(requests, results, strict=True)]
        count(BESIDE + sum(piece.effort for piece in pieces))
        self.kernel.run(pieces, processors())
        return results

    def _empty(self, request: SweepRequest) -> SweepResult:
        drive = self.drive
        result = empty_result(request, len(drive.state_names), len(drive.output_names), len(self.active))
        if not (request.with_course and self.kernel.keeps_course):
            return result
        return replace(result, course=np.empty((request.grid.time.size, len(drive.state_names))))


@kept(64)
def sweep_of(drive: Drive, active: tuple[int, ...], values_only: bool = False, noisy: tuple[str, ...] = ()) -> Sweep:
    """Return the sweep of a drive, with the noise of `noisy` inputs as states; the last ones are kept."""
    return Sweep(with_input_noise(stepped(drive), noisy), active, values_only)


def _start_with_slope(drive: SteppedDrive, active: Sequence[int]) -> ca.Function:
    arguments = [ca.SX.sym(f"a{k}", drive.start.size1_in(k)) for k in range(5)]
    value = drive.start.call(arguments, True, False)[0]
    chosen = ca.vertcat(*[arguments[4][k] for k in active]) if active else ca.SX(0, 1)
    return ca.Function("start", arguments, [ca.densify(value), ca.densify(ca.jacobian(value, chosen))])
