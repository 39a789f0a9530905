"""Other tools on the same recordings: time, what they reach, and how many times longer they take.

python problems/benchmarks/peers.py [CASE ...] [--tools TOOL ...] [--limit 300] [--again] [--out FOLDER]

Cases: the two-mass axis with polyline friction (10,000 samples, 8 parameters; `telescope`: 24,000), with LuGre, EMPS
(from the folder in FRICTION_OCP_EMPS) and the XL330 servo. Every tool runs in a process of its own with a time limit,
starts from the same guesses and is tuned as its documentation recommends. Its parameters are then judged by this
package: the objective with the states solved for, or on the servo the mean absolute error of the free run. A tool
reached the same optimum where that is within 1 % of the best. What was measured stays in FOLDER and is not measured
again without `--again`, so that a run can be done in pieces. Missing tools: pip install 'friction-ocp[peers]'.
"""

from __future__ import annotations

import argparse
import importlib
import json
import subprocess
import sys
import time
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path

import numpy as np
from checks import print_rows
from peer_cases import CASES, SERVO, Case
from xl330_cmaes import FreeRunError

from friction_ocp.estimation.first_nodes import suggested_point
from friction_ocp.estimation.fit import settled
from friction_ocp.estimation.gauss_newton import solve_gauss_newton
from friction_ocp.estimation.horizon import fits_free_run
from friction_ocp.estimation.model import prepare
from friction_ocp.estimation.problem import Problem
from friction_ocp.estimation.stages import relaxed
from friction_ocp.problem_file.load import load_problem
from friction_ocp.simulation.losses import Squares

OURS = "friction_ocp"
FOLDER = Path("results") / "peers"
LIMIT = 300.0
SAME_OPTIMUM = 1.01
INSTALL = "pip install 'friction-ocp[peers]'"
EXPLICIT = ("polyline", "telescope", "lugre", "emps", "xl330")
SMOOTH = ("polyline", "telescope", "lugre", "emps")
"""Without the servo, whose saturated loop collocation cannot take."""


@dataclass(frozen=True)
class Tool:
    """One peer."""

    name: str
    function: str
    """module:function in peer_tools."""
    cases: tuple[str, ...] = EXPLICIT


TOOLS = {
    "casadi-slack": Tool("CasADi, gaps weighted", "casadi_shooting:solve_slack"),
    "casadi-exact": Tool("CasADi, sysid.py", "casadi_shooting:solve_exact"),
    "rockit": Tool("rockit", "rockit_shooting:solve", SMOOTH),
    "do-mpc": Tool("do-mpc MHE", "do_mpc_mhe:solve", SMOOTH),
    "pyomo": Tool("Pyomo.DAE", "pyomo_collocation:solve", SMOOTH),
    "archimedes": Tool("archimedes PEM", "archimedes_pem:solve"),
    "scipy-windows": Tool("scipy, windows", "scipy_windows:solve_windows"),
    "scipy-single": Tool("scipy, single shooting", "scipy_windows:solve_single", SMOOTH),
    "cma": Tool("CMA-ES", "cma_es:solve"),
    "mujoco": Tool("mujoco.sysid", "mujoco_sysid:solve", ("xl330",)),
}


@dataclass(frozen=True)
class Measured:
    """One tool on one case."""

    case: str
    tool: str
    note: str
    seconds: float = np.nan
    build: float = np.nan
    converged: bool = False
    values: dict[str, float] = field(default_factory=dict[str, float])
    merit: float = np.nan
    """Objective of this package at its parameters; on the servo mean absolute error of the free run, rad."""
    validation: float = np.nan
    """Mean absolute error on validation, rad; servo only."""
    worst: float = np.nan
    """Largest relative parameter error."""


def run_ours(problem: Problem) -> tuple[dict[str, float], float, float, bool]:
    """Fit; return parameters, seconds until ready, seconds of the fit, whether it converged."""
    began = time.perf_counter()
    model = prepare(problem)
    built = time.perf_counter()
    _, fitted = settled(model)
    seconds = time.perf_counter() - built
    theta = fitted.solution.point.theta
    values = dict(zip(model.space.names, map(float, theta), strict=True))
    return values, built - began, seconds, fitted.solution.converged


def measure(name: str, key: str) -> Measured:
    """Run one tool on one case in this process and judge what it finds."""
    case = CASES[name]()
    if case is None:
        return Measured(name, key, "FRICTION_OCP_EMPS names no folder with the data")
    if key == OURS:
        values, build, seconds, converged = run_ours(case.problem)
        return judged(case, Measured(name, key, "", seconds, build, converged, values))
    module, _, function = TOOLS[key].function.partition(":")
    try:
        solve = getattr(importlib.import_module(f"peer_tools.{module}"), function)
    except ModuleNotFoundError as error:
        return Measured(name, key, f"no module {error.name}; {INSTALL}")
    answer = solve(case)
    values = dict(zip(case.names, map(float, answer.values), strict=True))
    return judged(case, Measured(name, key, answer.note, answer.seconds, answer.build, answer.converged, values))


def judged(case: Case, found: Measured) -> Measured:
    """Add what this package makes of the parameters."""
    model = prepare(case.problem)
    theta = np.clip([found.values[name] for name in model.space.names], model.space.lower, model.space.upper)
    if fits_free_run(model):
        errors = [FreeRunError.over(model, part)(theta) for part in (model.train, model.validation)]
        return replace(found, merit=errors[0], validation=errors[1])
    pinned = replace(model, space=replace(model.space, guess=theta, lower=theta, upper=theta))
    program = relaxed(pinned, model.train, 0.0, Squares())
    end = solve_gauss_newton(program, suggested_point(program, theta))
    worst = np.nan
    if case.reference is not None:
        own = np.array([found.values[name] for name in case.names])
        worst = float(np.max(np.abs(own / case.reference - 1.0)))
    return replace(found, merit=end.objective, worst=worst)


def measured_apart(name: str, key: str, folder: Path, limit: float, again: bool) -> Measured:
    """Return what is on disk, else run the tool in a process of its own."""
    path = folder / f"{name}-{key}.json"
    if not path.is_file() or again:
        folder.mkdir(parents=True, exist_ok=True)
        path.unlink(missing_ok=True)
        command = [sys.executable, __file__, "--one", name, key, str(path)]
        try:
            run = subprocess.run(command, capture_output=True, text=True, timeout=limit)
        except subprocess.TimeoutExpired:
            store(path, Measured(name, key, f"not within {limit:.0f} s"))
        else:
            if not path.is_file():
                said = (run.stderr.strip().splitlines() or ["no message"])[-1]
                store(path, Measured(name, key, f"failed: {said}"[:160]))
    return Measured(**json.loads(path.read_text(encoding="utf-8")))


def store(path: Path, found: Measured) -> None:
    """Write what was measured, whole."""
    scratch = path.with_suffix(".part")
    scratch.write_text(json.dumps(asdict(found)), encoding="utf-8")
    scratch.replace(path)


def measure_case(
    name: str, keys: Iterable[str], folder: Path, limit: float = LIMIT, again: bool = False
) -> list[Measured]:
    """Measure this package and then every tool that takes the case."""
    wanted = [OURS, *(key for key in keys if name in TOOLS[key].cases)]
    return [measured_apart(name, key, folder, limit, again) for key in wanted]


def best_merit(found: Sequence[Measured]) -> float:
    """Return the best objective that anyone reached."""
    return min((item.merit for item in found if np.isfinite(item.merit)), default=np.nan)


def same_optimum(item: Measured, found: Sequence[Measured]) -> bool:
    """Whether a tool ended within 1 % of the best."""
    return bool(np.isfinite(item.merit)) and item.merit <= SAME_OPTIMUM * best_merit(found)


def row(item: Measured, found: Sequence[Measured]) -> tuple[str, ...]:
    """Return one row of the table."""

    def number(value: float, text: str) -> str:
        return format(value, text) if np.isfinite(value) else ""

    name = TOOLS[item.tool].name if item.tool in TOOLS else item.tool
    merit = item.merit if np.isfinite(item.validation) else item.merit / found[0].merit
    return (
        item.case,
        name,
        number(item.seconds, ".2f"),
        number(item.seconds / found[0].seconds, ".1f"),
        number(item.build, ".1f"),
        number(merit, ".4g"),
        number(item.validation, ".4f"),
        number(100 * item.worst, ".2f"),
        "yes" if same_optimum(item, found) else "no",
        ("" if item.converged or not np.isfinite(item.seconds) else "not converged; ") + item.note,
    )


HEADER = ("case", "tool", "s", "x ours", "build s", "merit", "validation", "worst %", "same optimum", "note")


def servo_models() -> dict[str, float]:
    """Return the seconds of a fit of each of the four servo models, preparation apart."""
    names = ("coulomb_viscous", "stribeck", "load_dependent", "stribeck_load")
    return {name: run_ours(load_problem(SERVO.with_name(f"{name}.yaml")))[2] for name in names}


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("cases", nargs="*", metavar="CASE", help=", ".join(CASES))
    parser.add_argument("--tools", nargs="+", choices=TOOLS, default=list(TOOLS), metavar="TOOL")
    parser.add_argument("--limit", type=float, default=LIMIT, help="seconds of one tool on one case")
    parser.add_argument("--again", action="store_true", help="measure also what is on disk")
    parser.add_argument("--out", type=Path, default=FOLDER)
    parser.add_argument("--one", nargs=3, metavar=("CASE", "TOOL", "FILE"), help=argparse.SUPPRESS)
    options = parser.parse_args(arguments)
    if options.one:
        name, key, path = options.one
        store(Path(path), measure(name, key))
        return 0
    rows: list[tuple[str, ...]] = []
    for name in options.cases or CASES:
        found = measure_case(name, options.tools, options.out, options.limit, options.again)
        rows += [row(item, found) for item in found]
        for cells in rows[-len(found) :]:
            print(" | ".join(cells), file=sys.stderr)
    print_rows(HEADER, rows)
    print("merit: objective over that of friction_ocp; xl330: mean absolute error of the free run, rad")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
