"""CMA-ES (package cma) on compiled simulations of whole recordings from their smoothed first states.

Coordinates are logarithms where the bounds are positive; first standard deviation and restarts as its documentation
recommends: a quarter of the range in question, no restart where it converges.
"""

from __future__ import annotations

import time

import cma
import numpy as np
from peer_cases import Case, FloatArray

from peer_tools.scipy_windows import pieces_of
from peer_tools.shooting import Answer, compiled, segment_function

EVALUATIONS = 5_000
BROKEN = 1e30


def solve(case: Case) -> Answer:
    """Search from the guess."""
    began = time.perf_counter()
    case = case.evenly_weighted()
    pieces = pieces_of(case, 1)
    functions = {n: compiled(segment_function(case, n)) for n in {piece.samples for piece in pieces}}
    positive = case.lower > 0

    def values(z: FloatArray) -> FloatArray:
        plain = case.lower + z * (case.upper - case.lower)
        low, high = np.where(positive, case.lower, 1.0), np.where(positive, case.upper, 2.0)
        return np.where(positive, low * (high / low) ** z, plain)

    def coordinates(p: FloatArray) -> FloatArray:
        low, high = np.where(positive, case.lower, 1.0), np.where(positive, case.upper, 2.0)
        logarithm = np.log(np.where(positive, p, 1.0) / low) / np.log(high / low)
        return np.where(positive, logarithm, (p - case.lower) / (case.upper - case.lower))

    def cost(z: FloatArray) -> float:
        p = values(np.asarray(z)) / case.scale
        rows = [functions[a.samples](a.start, a.inputs, a.spans, a.measured, p)[1] for a in pieces]
        errors = np.concatenate([np.asarray(row).ravel() for row in rows])
        total = float(np.sum(errors**2) if case.input_noise else np.sum(np.abs(errors)))
        return float(np.log(total)) if np.isfinite(total) else BROKEN

    built = time.perf_counter()
    options = {"bounds": [0, 1], "maxfevals": EVALUATIONS, "seed": 1, "verbose": -9}
    found = cma.CMAEvolutionStrategy(coordinates(case.guess), 0.25, options)
    found.optimize(cost)
    reasons = found.stop()
    seconds = time.perf_counter() - built
    note = f"{found.result.evaluations} evaluations, {', '.join(reasons)}"
    return Answer(values(np.asarray(found.result.xbest)), built - began, seconds, "maxfevals" not in reasons, note)
