"""CasADi as in its example sysid.py: multiple shooting, SX-expanded, Gauss-Newton Hessian, Ipopt.

`exact` is the example itself, one node a sample and gaps as constraints; `slack` weights the gaps between segments by
the process noise instead, as this package does.
"""

from __future__ import annotations

import time

import casadi as ca
import numpy as np
from peer_cases import Case

from peer_tools.shooting import Answer, segment_function, segments_of

ITERATIONS = 200


def solve_slack(case: Case) -> Answer:
    """Penalise the gaps between segments."""
    return solve(case, case.problem.estimation.segment, exact=False)


def solve_exact(case: Case) -> Answer:
    """Close the gaps after every sample, which initialises all states from the measurement."""
    return solve(case, 1, exact=True)


def solve(case: Case, samples: int, exact: bool) -> Answer:
    """Solve with segments of some samples."""
    began = time.perf_counter()
    segment = segment_function(case, samples).expand()
    p = ca.MX.sym("p", case.guess.size)
    errors, gaps, nodes, starts = [], [], [], []
    weight = case.gap_root(samples * case.period) if case.input_noise else np.diag(1.0 / (0.05 * case.state_scale))
    for run in case.runs:
        first, inputs, spans, measured = segments_of(case, run, samples)
        count = first.shape[1]
        scaled = ca.MX.sym("X", case.state_scale.size, count)
        states = scaled * np.repeat(case.state_scale[:, None], count, axis=1)
        end, error = segment.map(count)(states, inputs, spans, measured, ca.repmat(p, 1, count))
        errors.append(ca.vec(error))
        gaps.append(
            ca.vec(ca.mtimes(np.diag(1.0 / case.state_scale) if exact else weight, end[:, :-1] - states[:, 1:]))
        )
        nodes.append(ca.vec(scaled))
        starts.append((first / case.state_scale[:, None]).T.ravel())
    variables = ca.veccat(p, *nodes)
    residual = ca.vertcat(*errors) if exact else ca.vertcat(*errors, *gaps)
    jacobian = ca.jacobian(residual, variables)
    scale, multipliers = ca.MX.sym("lam_f"), ca.MX.sym("lam_g", sum(gap.numel() for gap in gaps) if exact else 0)
    hessian = ca.Function(
        "hess_lag",
        [variables, ca.MX(), scale, multipliers],
        [scale * ca.triu(jacobian.T @ jacobian)],
        ["x", "p", "lam_f", "lam_g"],
        ["triu_hess_gamma_x_x"],
    )
    program = {"x": variables, "f": 0.5 * ca.dot(residual, residual)}
    if exact:
        program["g"] = ca.vertcat(*gaps)
    options = {
        "ipopt": {"print_level": 0, "max_iter": ITERATIONS, "sb": "yes"},
        "print_time": False,
        "hess_lag": hessian,
    }
    solver = ca.nlpsol("solver", "ipopt", program, options)
    built = time.perf_counter()
    free = np.full(sum(start.size for start in starts), np.inf)
    found = solver(
        x0=np.concatenate([case.guess / case.scale, *starts]),
        lbx=np.concatenate([case.lower / case.scale, -free]),
        ubx=np.concatenate([case.upper / case.scale, free]),
        lbg=0,
        ubg=0,
    )
    values = np.asarray(found["x"]).ravel()[: case.guess.size] * case.scale
    stats = solver.stats()
    note = f"{stats['iter_count']} iterations" + ("" if stats["success"] else f", {stats['return_status']}")
    return Answer(values, built - began, time.perf_counter() - built, bool(stats["success"]), note)
