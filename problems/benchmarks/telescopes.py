"""The lines of the two telescopes, measured; `acceptance.py telescopes` prints them."""

from __future__ import annotations

import importlib.util
import sys
from collections.abc import Callable, Mapping
from dataclasses import replace
from types import ModuleType

import aries_grid
import lto_grid
import numpy as np
import random_starts
from checks import Check
from servo import all_of

from friction_ocp.estimation.problem import RecordingUse, StaticUse
from friction_ocp.problem_file.load import load_problem

PROBLEMS = aries_grid.ROOT / "problems"
MOST = {"sigma1": 0.10}
"""Largest median relative error of a number of the ARIES model where it is not OTHERWISE."""
OTHERWISE, MOST_DELTA = 0.03, 0.05


def aries_data() -> ModuleType:
    """Import the script that makes the ARIES data."""
    spec = importlib.util.spec_from_file_location("aries_make_data", PROBLEMS / "aries" / "make_data.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


def joint_errors(direction: str, draws: int) -> Check:
    """Return the median errors of the joint fit, and of the two steps beside them, over fresh data."""
    data, truth = aries_data(), aries_grid.truth_of(direction) | {"inertia": aries_grid.aries.INERTIA}
    base = load_problem(PROBLEMS / "aries" / f"joint_{direction}.yaml")
    stepwise = load_problem(PROBLEMS / "aries" / f"curve_all_{direction}.yaml")
    fits: list[dict[str, float]] = []
    steps: list[dict[str, float]] = []
    for seed in range(100, 100 + draws):
        curves, made = data.curves(seed), {item.name: item for item in data.responses(seed)}
        uses = tuple(RecordingUse(made[use.name]) for use in base.train)
        points = (StaticUse(curves[f"curve_{direction}"]),)
        problem = replace(base, train=uses, static=points, validation=(), static_validation=())
        _, found = aries_grid.identified(problem, truth)
        fits.append(aries_grid.two_step.errors_of(found, truth))
        known = aries_grid.two_step.static_numbers(
            replace(stepwise, static=(StaticUse(curves[f"curve_all_{direction}"]),), static_validation=())
        )
        known |= aries_grid.two_step.second_order(made[f"small_steps_{direction}"], truth["inertia"], known["sigma2"])
        steps.append(aries_grid.two_step.errors_of(known, truth))
    medians = {name: float(np.median([fit[name] for fit in fits])) for name in truth}
    beside = {name: float(np.median([step[name] for step in steps])) for name in steps[0]}
    held = all(error <= MOST.get(name, OTHERWISE) for name, error in medians.items() if name != "delta")
    held = held and medians["delta"] * truth["delta"] <= MOST_DELTA
    told = [f"{name} {error:.2%} ({beside[name]:.1%})" if name in beside else f"{name} {error:.2%}"
            for name, error in medians.items()]  # fmt: skip
    return Check(f"{direction}, {draws} draws, median error (two steps)", ", ".join(told), held)


def aries(line: str, quick: bool) -> Check:
    """Errors of the joint fit over draws; the remaining parts of the line are tests of tests/problems/test_aries.py."""
    check = all_of(line, [joint_errors(direction, 1 if quick else 20) for direction in aries_grid.SIDES])
    rest = "10 ms log, limit cycle and loop: tests/problems/test_aries.py, not measured here"
    return replace(check, measured=f"{check.measured}\n{rest}", passed=None if check.passed else False)


def lto(line: str, quick: bool) -> Check:
    """Errors and cost beside the grid; the choice between the three models is not measured here."""
    contests = [lto_grid.contest(5000 + 100 * k) for k in range(1 if quick else 25)]
    text = "\n".join([*lto_grid.rows(contests), "choice of the model, coverage and the prior on J: not measured here"])
    return Check(line, text, None)


def starts(line: str, quick: bool) -> Check:
    """How many random starts reach the same optimum."""
    problems = [PROBLEMS / "lto" / "joint.yaml", PROBLEMS / "aries" / "joint_east_west.yaml"]
    return all_of(line, random_starts.compare(problems, 3 if quick else 20, seed=1))


MEASURES: Mapping[str, Callable[[str, bool], Check]] = {"lto": lto, "aries": aries, "random_starts": starts}
"""By ID in done_when.yaml."""
