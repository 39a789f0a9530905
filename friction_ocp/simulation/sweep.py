"""Simulation of many segments with sensitivities, in native code or in CasADi's virtual machine."""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np

from friction_ocp.drive.stepping import SteppedDrive
from friction_ocp.simulation.compiled import compile_sweep
from friction_ocp.simulation.grid import FloatArray, Grid, IntArray


@dataclass(frozen=True)
class SweepResult:
    """Outputs at every node and states at every segment's end; derivatives by [initial state, active parameters]."""

    y: FloatArray
    """(n, outputs); at a node that closes a segment the value of the segment that begins there."""
    end: FloatArray
    """(segments, states)."""
    dy: FloatArray | None = None
    """(n, outputs, states + active)."""
    dend: FloatArray | None = None
    """(segments, states, states + active)."""
    states: FloatArray | None = None
    """(n, states), where asked for."""


class Sweep:
    """The one-step functions of a drive, looped over grids."""

    def __init__(self, drive: SteppedDrive, active: Sequence[int]) -> None:
        self.drive = drive
        self.active = tuple(active)
        self.start = _start_with_slope(drive, self.active)
        """(y, dy, u, p) -> start state and its derivative by the active numbers."""
        library = compile_sweep(drive, self.active)
        if library is None:
            raise RuntimeError("no compiler")
        self._function = library.friction_ocp_sweep
        self._function.restype = None

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
        nodes, states, outputs = grid.time.size, len(self.drive.state_names), len(self.drive.output_names)
        segments, columns = len(first) - 1, states + len(self.active)
        y, end = np.zeros((nodes, outputs)), np.empty((segments, states))
        dy = np.zeros((nodes, outputs, columns)) if derivatives else None
        dend = np.empty((segments, columns, states)) if derivatives else None
        track = np.empty((nodes, states)) if with_states else None
        arrays = [
            np.ascontiguousarray(first, dtype=np.int64),
            grid.dt,
            grid.substeps,
            grid.ticks,
            grid.at_start,
            grid.at_end,
            grid.at_node,
            np.ascontiguousarray(p, dtype=float),
            np.ascontiguousarray(width, dtype=float),
            np.ascontiguousarray(x0, dtype=float),
        ]
        self._function(
            ctypes.c_long(segments),
            *(_pointer(item) for item in arrays),
            ctypes.c_int(derivatives),
            *(_pointer(item) for item in (track, y, dy, end, dend)),
        )
        return SweepResult(y, end, dy, None if dend is None else dend.transpose(0, 2, 1), track)


def _pointer(array: FloatArray | IntArray | None) -> ctypes.c_void_p:
    return ctypes.c_void_p(None if array is None else array.ctypes.data)


def _start_with_slope(drive: SteppedDrive, active: Sequence[int]) -> ca.Function:
    arguments = [ca.SX.sym(f"a{k}", drive.start.size1_in(k)) for k in range(4)]  # pyright: ignore[reportArgumentType]
    value = drive.start.call(arguments, True, False)[0]
    chosen = ca.vertcat(*[arguments[3][k] for k in active]) if active else ca.SX(0, 1)
    return ca.Function("start", arguments, [ca.densify(value), ca.densify(ca.jacobian(value, chosen))])
