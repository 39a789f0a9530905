"""archimedes: prediction errors of its extended Kalman filter, Levenberg-Marquardt, as its tutorial does it."""

from __future__ import annotations

import time
from typing import Any

import numpy as np
from archimedes.observers import ExtendedKalmanFilter
from archimedes.sysid import Timeseries, pem
from peer_cases import Case, bristle_rate

from peer_tools.shooting import Answer


def solve(case: Case) -> Answer:
    """Solve from the guess; compilation is part of its solution and cannot be told apart."""
    period, roots = case.period, case.scale
    outputs = case.noise.size

    def slope(x: Any, u: Any, p: Any) -> Any:
        values = case.equations([x[k] for k in range(case.state_scale.size)], u, p, np)
        return np.hstack(values)

    def advance(t: Any, x: Any, u: Any, p: Any) -> Any:
        values = [p[k] * roots[k] for k in range(roots.size)]
        inputs = [u[k] for k in range(case.runs[0].inputs.shape[1])]
        h = period / case.substeps
        for _ in range(case.substeps):
            x = bristle(x, inputs, values, h) if case.stiff else classic(x, inputs, values, h)
        return x

    def classic(x: Any, u: Any, p: Any, h: float) -> Any:
        first = slope(x, u, p)
        second = slope(x + 0.5 * h * first, u, p)
        third = slope(x + 0.5 * h * second, u, p)
        return x + h / 6.0 * (first + 2.0 * second + 2.0 * third + slope(x + h * third, u, p))

    def bristle(x: Any, u: Any, p: Any, h: float) -> Any:
        middle = x
        for reach in (0.5 * h, h):
            rate = bristle_rate(middle[1], p, np)
            after = (x[2] * (1.0 - 0.5 * h * rate) + h * middle[1]) / (1.0 + 0.5 * h * rate)
            at = np.hstack([middle[0], middle[1], 0.5 * (x[2] + after), middle[3], middle[4]])
            middle = x + reach * slope(at, u, p)
        return middle

    def seen(t: Any, x: Any, u: Any, p: Any) -> Any:
        values = [p[k] * roots[k] for k in range(roots.size)]
        states = [x[k] for k in range(case.state_scale.size)]
        rows = case.outputs(states, u, values, np)
        scaled = [rows[k] / case.noise[k] for k in range(outputs)]
        return np.hstack(scaled) if outputs > 1 else np.atleast_1d(scaled[0])  # its hstack takes two or more

    noise = np.linalg.inv(case.gap_root(period))
    predictor = ExtendedKalmanFilter(dyn=advance, obs=seen, Q=noise @ noise.T, R=np.eye(outputs))
    data, starts = [], []
    for run in case.runs:
        ts = period * np.arange(len(run.inputs))
        data.append(Timeseries(ts=ts, us=run.inputs.T, ys=(run.measured[1:] / case.noise).T))
        starts.append(run.states[0])
    spread = np.diag((1e-2 * case.state_scale) ** 2)
    began = time.perf_counter()
    bounds = (case.lower / roots, case.upper / roots)
    found = pem(predictor, tuple(data), case.guess / roots, x0=tuple(starts), bounds=bounds, P0=(spread,) * len(data))
    values = np.asarray(found.p).ravel() * roots
    return Answer(
        values, 0.0, time.perf_counter() - began, bool(found.success), f"{found.nit} iterations, build within"
    )
