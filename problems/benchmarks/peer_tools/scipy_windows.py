"""scipy.optimize.least_squares on simulations compiled to native code with their derivatives (CasADi).

`windows`: twenty windows a recording, or one a recording where the fit is a free run, each with its own free start
state; `single`: one whole simulation a recording. Scaled by the Jacobian, as its documentation recommends for unlike
parameters; where the fit is judged by absolute errors, the soft absolute loss.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

import casadi as ca
import numpy as np
from peer_cases import Case, FloatArray
from scipy.optimize import least_squares

from peer_tools.shooting import Answer, compiled, segment_function, segments_of

WINDOWS = 20


@dataclass(frozen=True)
class Piece:
    """One window."""

    start: FloatArray
    inputs: FloatArray
    spans: FloatArray
    measured: FloatArray
    samples: int


def solve_windows(case: Case) -> Answer:
    """Solve over windows."""
    return solve(case, WINDOWS if case.input_noise else 1)


def solve_single(case: Case) -> Answer:
    """Solve over whole recordings."""
    return solve(case, 1)


def pieces_of(case: Case, windows: int) -> list[Piece]:
    """Cut all recordings."""
    pieces: list[Piece] = []
    for run in case.runs:
        samples = (run.time.size - 1) // windows
        first, inputs, spans, measured = segments_of(case, run, samples)
        for k in range(windows):
            own = slice(k * samples, (k + 1) * samples)
            pieces.append(Piece(first[:, k], inputs[:, own], spans[:, own], measured[:, own], samples))
    return pieces


def derivative_functions(case: Case, pieces: list[Piece]) -> dict[int, tuple[ca.Function, ca.Function]]:
    """Return by length what gives the errors of a window, and these with their Jacobian over (p, start)."""
    functions: dict[int, tuple[ca.Function, ca.Function]] = {}
    for samples in {piece.samples for piece in pieces}:
        segment = segment_function(case, samples)
        symbols = [ca.MX.sym(f"a{k}", *segment.size_in(k)) for k in range(5)]
        error = segment(*symbols)[1]
        slopes = ca.horzcat(ca.jacobian(error, symbols[4]), ca.jacobian(error, symbols[0]))
        plain = ca.Function(f"error{samples}", symbols, [error])
        steep = ca.Function(f"slope{samples}", symbols, [ca.densify(slopes)])
        functions[samples] = compiled(plain), compiled(steep)
    return functions


def solve(case: Case, windows: int) -> Answer:
    """Solve over windows of equal length."""
    began = time.perf_counter()
    case = case.evenly_weighted()
    pieces = pieces_of(case, windows)
    functions = derivative_functions(case, pieces)
    count, states = case.guess.size, case.state_scale.size
    held = not case.input_noise

    def parts(z: FloatArray) -> list[tuple[Piece, FloatArray]]:
        if held:
            return [(piece, piece.start) for piece in pieces]
        starts = z[count:].reshape(len(pieces), states) * case.state_scale
        return list(zip(pieces, starts, strict=True))

    def errors(z: FloatArray) -> FloatArray:
        rows = [functions[p.samples][0](x, p.inputs, p.spans, p.measured, z[:count]) for p, x in parts(z)]
        return np.nan_to_num(np.concatenate([np.asarray(row).ravel() for row in rows]), nan=1e9, posinf=1e9)

    def slopes(z: FloatArray) -> FloatArray:
        full = np.zeros((sum(p.samples for p in pieces) * case.noise.size, z.size))
        row = 0
        for k, (p, x) in enumerate(parts(z)):
            own = np.asarray(functions[p.samples][1](x, p.inputs, p.spans, p.measured, z[:count]))
            rows = slice(row, row + len(own))
            full[rows, :count] = own[:, :count]
            if not held:
                columns = slice(count + k * states, count + (k + 1) * states)
                full[rows, columns] = own[:, count:] * case.state_scale
            row += len(own)
        return np.nan_to_num(full)

    free = np.zeros(0) if held else np.concatenate([piece.start / case.state_scale for piece in pieces])
    start, open_ends = np.concatenate([case.guess / case.scale, free]), np.full(free.size, np.inf)
    bounds = (
        np.concatenate([case.lower / case.scale, -open_ends]),
        np.concatenate([case.upper / case.scale, open_ends]),
    )
    robust = {"loss": "soft_l1", "f_scale": 0.01 / float(case.noise[0])} if held else {}
    built = time.perf_counter()
    inside = np.clip(start, bounds[0] + 1e-9, bounds[1] - 1e-9)
    end = least_squares(errors, inside, slopes, bounds, x_scale="jac", max_nfev=200, **robust)
    seconds = time.perf_counter() - built
    note = f"{end.nfev} evaluations" + ("" if end.status > 0 else ", limit reached")
    return Answer(end.x[:count] * case.scale, built - began, seconds, end.status > 0, note)
