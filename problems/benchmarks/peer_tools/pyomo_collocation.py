"""Pyomo.DAE: Radau collocation with the noise of the input as a variable, solved by Ipopt.

Ipopt is the executable of that name where there is one, else the library that comes with CasADi, which reads Pyomo's
.nl file. Every tenth sample.
"""

from __future__ import annotations

import shutil
import tempfile
import time
from pathlib import Path
from types import SimpleNamespace

import casadi as ca
import numpy as np
import pyomo.environ as pyo
from peer_cases import Case
from pyomo.dae import ContinuousSet, DerivativeVar

from peer_tools.shooting import Answer

EVERY = 10
ARITHMETIC = SimpleNamespace(tanh=pyo.tanh, sqrt=pyo.sqrt, exp=pyo.exp, sin=pyo.sin)


def solve(case: Case) -> Answer:
    """Solve for the first recording."""
    began = time.perf_counter()
    case = case.thinned(EVERY)
    model = build(case)
    built = time.perf_counter()
    executable = shutil.which("ipopt")
    if executable:
        result = pyo.SolverFactory("ipopt").solve(model, options={"max_iter": 200})
        converged, start = pyo.check_optimal_termination(result), built
        values = np.array([pyo.value(model.p[k]) for k in model.p])
    else:
        values, converged, start = by_library(model)
    note = f"every {EVERY}th sample, Ipopt " + ("executable" if executable else "of CasADi")
    return Answer(values * case.scale, start - began, time.perf_counter() - start, converged, note)


def by_library(model: pyo.ConcreteModel) -> tuple[np.ndarray, bool, float]:
    """Solve a model through its .nl file; return parameters, whether it converged, and when the solution began."""
    with tempfile.TemporaryDirectory() as scratch:
        path = str(Path(scratch) / "model.nl")
        _, numbering = model.write(path, io_options={"symbolic_solver_labels": False})
        del numbering
        program = ca.NlpBuilder()
        program.import_nl(path)
        order = column_order(model, path)
    nlp = {"x": ca.vertcat(*program.x), "f": program.f, "g": ca.vertcat(*program.g)}
    options = {"ipopt": {"print_level": 0, "sb": "yes", "max_iter": 200}, "print_time": False}
    solver = ca.nlpsol("solver", "ipopt", nlp, options)
    start = time.perf_counter()
    end = solver(x0=program.x_init, lbx=program.x_lb, ubx=program.x_ub, lbg=program.g_lb, ubg=program.g_ub)
    return np.asarray(end["x"]).ravel()[order], bool(solver.stats()["success"]), start


def column_order(model: pyo.ConcreteModel, path: str) -> list[int]:
    """Return the columns of the parameters in an .nl file."""
    from pyomo.repn.plugins.nl_writer import NLWriter

    with Path(path).with_suffix(".again").open("w") as stream:
        columns = {id(variable): k for k, variable in enumerate(NLWriter().write(model, stream).variables)}
    return [columns[id(model.p[k])] for k in model.p]


def build(case: Case) -> pyo.ConcreteModel:
    """Return the collocated model."""
    run, states = case.runs[0], range(case.state_scale.size)
    stamps = [float(round(stamp - run.time[0], 9)) for stamp in run.time]
    model = pyo.ConcreteModel()
    model.t = ContinuousSet(initialize=stamps)
    low, high, guess = (part / case.scale for part in (case.lower, case.upper, case.guess))
    model.p = pyo.Var(
        range(guess.size), bounds=lambda _, k: (low[k], high[k]), initialize=dict(enumerate(guess.tolist()))
    )
    model.x = pyo.Var(states, model.t)
    model.dx = DerivativeVar(model.x, wrt=model.t)
    model.w = pyo.Var(range(len(run.inputs)), initialize=0.0)
    starts = np.array(stamps)

    def dynamics(m: pyo.ConcreteModel, k: int, t: float) -> object:
        if t == 0.0:
            return pyo.Constraint.Skip
        index = int(np.searchsorted(starts, t - 1e-12)) - 1
        u = [float(value) for value in run.inputs[index]]
        driven = [u[0] + case.input_noise * m.w[index], *u[1:]]
        at = [m.x[j, t] * float(case.state_scale[j]) for j in states]
        values = [m.p[j] * float(case.scale[j]) for j in range(guess.size)]
        return m.dx[k, t] == case.equations(at, driven, values, ARITHMETIC)[k] / float(case.state_scale[k])

    model.dynamics = pyo.Constraint(states, model.t, rule=dynamics)
    pyo.TransformationFactory("dae.collocation").apply_to(
        model, wrt=model.t, nfe=len(stamps) - 1, ncp=2, scheme="LAGRANGE-RADAU"
    )
    for t in model.t:
        index = min(int(np.searchsorted(starts, t - 1e-12)), len(starts) - 1)
        for k in states:
            model.x[k, t] = float(run.states[index, k] / case.state_scale[k])
    errors: list[object] = []
    for index, t in enumerate(stamps):
        at = [model.x[j, t] * float(case.state_scale[j]) for j in states]
        values = [model.p[j] * float(case.scale[j]) for j in range(guess.size)]
        for j, row in enumerate(case.outputs(at, [], values, ARITHMETIC)):
            errors.append(((row - float(run.measured[index, j])) / float(case.noise[j])) ** 2)
    noise = sum(model.w[k] ** 2 for k in model.w)
    model.cost = pyo.Objective(expr=0.5 * (sum(errors) + noise))
    return model
