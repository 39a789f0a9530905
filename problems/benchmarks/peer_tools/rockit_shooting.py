"""rockit as in its example of system identification: one control interval a sample, Ipopt, states from the measurement.

The noise of the input is a control whose squares are penalised, as the measured input is not exact.
"""

from __future__ import annotations

import time

import casadi as ca
import numpy as np
from peer_cases import Case, Run
from rockit import MultipleShooting, Ocp

from peer_tools.shooting import Answer, output_function

EVERY = 10


def solve(case: Case) -> Answer:
    """Solve for the first recording, on every tenth sample."""
    began = time.perf_counter()
    case = case.thinned(EVERY)
    run = case.runs[0]
    ocp = Ocp(t0=0, T=float(run.time[-1] - run.time[0]))
    p = ocp.variable(case.guess.size)
    ocp.set_initial(p, case.guess / case.scale)
    ocp.subject_to(case.lower / case.scale <= (p <= case.upper / case.scale))
    state_recording(ocp, case, run, p)
    ocp.solver("ipopt", {"ipopt.print_level": 0, "print_time": False, "ipopt.max_iter": 200, "expand": True})
    ocp._transcribe()
    built = time.perf_counter()
    try:
        found, converged = ocp.solve(), True
    except RuntimeError:
        found, converged = ocp.non_converged_solution, False
    values = np.asarray(found.value(p)).ravel() * case.scale
    seconds = time.perf_counter() - built
    return Answer(values, built - began, seconds, converged, f"every {EVERY}th sample")


def state_recording(stage: Ocp, case: Case, run: Run, p: ca.MX) -> None:
    """State dynamics, data and objective."""
    x = stage.state(case.state_scale.size)
    inputs = [stage.parameter(grid="control") for _ in range(run.inputs.shape[1])]
    measured = [stage.parameter(grid="control") for _ in range(run.measured.shape[1])]
    for symbol, column in zip([*inputs, *measured], data_of(case, run), strict=True):
        stage.set_value(symbol, column)
    driven = ca.vertcat(*inputs)
    if case.input_noise:
        noise = stage.control()
        driven = ca.vertcat(inputs[0] + case.input_noise * noise, *inputs[1:])
        stage.add_objective(stage.sum(0.5 * noise**2))
    states = x * case.state_scale
    slopes = case.equations(ca.vertsplit(states), ca.vertsplit(driven), ca.vertsplit(p * case.scale), ca)
    stage.set_der(x, ca.vertcat(*slopes) / case.state_scale)
    error = output_function(case)(states, driven, p) - ca.vertcat(*measured)
    stage.add_objective(stage.sum(0.5 * ca.sumsqr(error)))
    stage.set_initial(x, (run.states / case.state_scale).T)
    stage.method(MultipleShooting(N=len(run.inputs), M=case.substeps, intg="collocation" if case.stiff else "rk"))


def data_of(case: Case, run: Run) -> list[np.ndarray]:
    """Return the columns of inputs, and measurements over their noise."""
    count = len(run.inputs)
    return [*run.inputs.T, *(run.measured[:count] / case.noise).T]
