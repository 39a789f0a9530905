"""do-mpc: its moving-horizon estimator with the whole recording as horizon, collocation and process noise, MUMPS.

Parameters are constant over the horizon. Every tenth sample, as the horizon would otherwise have 10^5 unknowns.
"""

from __future__ import annotations

import time

import casadi as ca
import do_mpc
import numpy as np
from peer_cases import Case

from peer_tools.shooting import Answer

EVERY = 10


def solve(case: Case) -> Answer:
    """Solve for the first recording."""
    began = time.perf_counter()
    case = case.thinned(EVERY)
    run, states = case.runs[0], case.state_scale.size
    model = do_mpc.model.Model("continuous", "SX")
    x = model.set_variable("_x", "x", shape=(states, 1))
    p = model.set_variable("_p", "p", shape=(case.guess.size, 1))
    u = model.set_variable("_tvp", "u", shape=(run.inputs.shape[1], 1))
    driven, values, at = ca.vertsplit(u), ca.vertsplit(p * case.scale), ca.vertsplit(x * case.state_scale)
    slopes = ca.vertcat(*case.equations(at, driven, values, ca)) / case.state_scale
    model.set_rhs("x", slopes, process_noise=True)
    model.set_meas("y", ca.vertcat(*case.outputs(at, driven, values, ca)) / case.noise, meas_noise=True)
    model.setup()
    count = len(run.inputs)
    mhe = do_mpc.estimator.MHE(model, ["p"])
    mhe.settings.n_horizon = count
    mhe.settings.t_step = case.period
    mhe.settings.meas_from_data = True
    mhe.settings.store_full_solution = False
    mhe.settings.nlpsol_opts = {"ipopt.print_level": 0, "ipopt.sb": "yes", "print_time": 0, "ipopt.max_iter": 200}
    weight = case.gap_root(case.period) * case.state_scale
    mhe.set_default_objective(
        P_x=np.zeros((states, states)),
        P_v=np.eye(case.noise.size),
        P_p=np.zeros((p.size1(),) * 2),
        P_w=weight.T @ weight,
    )
    mhe.bounds["lower", "_p_est", "p"] = case.lower / case.scale
    mhe.bounds["upper", "_p_est", "p"] = case.upper / case.scale
    template = mhe.get_tvp_template()

    def inputs(_: float) -> object:
        for k in range(count):
            template["_tvp", k] = run.inputs[k]
        return template

    mhe.set_tvp_fun(inputs)
    measured = mhe.get_y_template()

    def outputs(_: float) -> object:
        for k in range(count):
            measured["y_meas", k] = run.measured[k] / case.noise
        return measured

    mhe.set_y_fun(outputs)
    mhe.setup()
    mhe.x0, mhe.p_est0 = run.states[0] / case.state_scale, case.guess / case.scale
    mhe.set_initial_guess()
    for k in range(count + 1):
        mhe.opt_x_num["_x", k] = [run.states[k] / case.state_scale] * len(mhe.opt_x_num["_x", k])
    built = time.perf_counter()
    mhe.solve()
    seconds = time.perf_counter() - built
    found = np.asarray(mhe.opt_x_num["_p_est"]).ravel() * case.scale
    stats = mhe.solver_stats
    note = f"every {EVERY}th sample, {stats['iter_count']} iterations"
    return Answer(found, built - began, seconds, bool(stats["success"]), note)
