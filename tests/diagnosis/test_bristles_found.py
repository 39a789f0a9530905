"""Bristles are tried with the dry friction that they need, also where the model before them has lost it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from diagnosis_cases import COULOMB, INERTIA, VISCOUS, axis, write_case
from plant import PlantFriction

from friction_ocp.diagnosis.bench import open_bench
from friction_ocp.diagnosis.clues import clues_of
from friction_ocp.diagnosis.fitted_model import FittedModel
from friction_ocp.diagnosis.linear import linear_program
from friction_ocp.diagnosis.refit import completed, quick_refit
from friction_ocp.diagnosis.screen import screen
from friction_ocp.diagnosis.worth import samples
from friction_ocp.effects.registry import effects
from friction_ocp.estimation.nodes import solve_nodes
from friction_ocp.estimation.program import Point
from friction_ocp.execution.executor import InProcess
from friction_ocp.problem_file.load import load_problem
from friction_ocp.statistics.execution import Execution

LOST = 0.01
"""Dry friction that is left over that of the plant."""
STIFFNESS = 10.0 * COULOMB


def without_dry_friction(base: FittedModel) -> FittedModel:
    """Return a fit whose dry friction has gone, its nodes solved for."""
    values = {**base.values, "motor.friction.tau_c": LOST * COULOMB}
    theta = np.array([values[name] for name in base.model.space.names])
    program = base.linear.program
    point = solve_nodes(program, Point(theta, base.linear.point.nodes), 20)
    return replace(base, linear=linear_program(program, point))


def test_a_refit_finds_the_dry_friction_that_bristles_carry(tmp_path: Path) -> None:
    """A start with next to nothing to carry would have its stiffness off by as much as its dry friction."""
    damping = 0.6 * float(np.sqrt(STIFFNESS * INERTIA))
    law = PlantFriction("lugre", tau_c=COULOMB, viscous=VISCOUS, sigma0=STIFFNESS, sigma1=damping)
    plant = axis()
    plant = replace(plant, shafts=(replace(plant.shafts[0], friction=law),))
    bench = open_bench(load_problem(write_case(tmp_path, plant)), Execution(InProcess()))
    lost = without_dry_friction(bench.base)
    found = screen(lost, effects()["presliding"], "motor", clues_of(lost))
    assert found is not None
    start = found.values
    assert start["motor.friction.tau_c"] > 0.5 * COULOMB
    assert 0.2 * STIFFNESS < start["motor.friction.bristle.sigma0"] < 5.0 * STIFFNESS
    fitted = completed(quick_refit(lost, found))
    assert fitted.objective < samples(fitted)
