"""Recordings that start at rest, and samples beside the jump of an acceleration."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import yaml
from diagnosis_cases import COULOMB, INERTIA, OFF, VISCOUS, axis, write_case

from friction_ocp.diagnosis.base_fit import fit_base
from friction_ocp.diagnosis.footing import FOLDS
from friction_ocp.diagnosis.jumps import beside_jumps
from friction_ocp.estimation.first_nodes import carrying
from friction_ocp.estimation.model import Model, prepare
from friction_ocp.estimation.modes import STEP_PER_RADIAN
from friction_ocp.estimation.nodes import solve_nodes
from friction_ocp.estimation.program import Point
from friction_ocp.estimation.standstill import at_rest
from friction_ocp.problem_file.load import load_problem

SLIDING = 0.3
"""Speed, rad/s, at which a recording is said to start, against the torque that will move it."""
REACH = 0.5
"""Deflection, rad, at which the springs of a shaft slip."""


def test_a_start_that_slides_the_wrong_way_is_brought_to_rest(tmp_path: Path) -> None:
    """From sliding nodes the cost returns to that of the fit, which starts at rest."""
    fitted = fit_base(prepare(load_problem(write_case(tmp_path, axis()))))
    program, point = fitted.linear.program, fitted.linear.point
    nodes = tuple(node.copy() for node in point.nodes)
    for node in nodes:
        node[0, 1] = -SLIDING * np.sign(node[1, 1])
    sliding = Point(point.theta, nodes)
    assert program.objective(sliding) > program.objective(point) + 10.0
    assert program.objective(at_rest(program, sliding)) < program.objective(point) + 1.0


def slipping(folder: Path) -> Model:
    """Return an axis on one spring that slips, its model of the same law, guesses a little off."""
    path = write_case(folder, axis(law="gms", elements=((COULOMB / REACH, 1.0),)))
    document = yaml.safe_load(path.read_text(encoding="utf-8"))
    guesses = {"tau_c": {"guess": 0.98 * COULOMB, "min": 0}, "tau_s": COULOMB, "omega_s": 2.0, "viscous": VISCOUS}
    spring = {"stiffness": {"guess": 1.02 * COULOMB / REACH, "min": 0}, "share": 1.0}
    document["drive"]["shafts"][0]["friction"] = {"law": "gms", "elements": [spring], **guesses}
    path.write_text(yaml.safe_dump(document, sort_keys=False), encoding="utf-8")
    return prepare(load_problem(path))


def test_springs_that_slip_from_the_start_on_are_slackened(tmp_path: Path) -> None:
    """Where they slip no derivative shows that they might be slack: from there the cost returns to that of the fit."""
    fitted = fit_base(slipping(tmp_path))
    program, point = fitted.linear.program, fitted.linear.point
    assert fitted.values["motor.friction.tau_c"] == pytest.approx(COULOMB, rel=0.01)
    assert fitted.values["motor.friction.elements.0.stiffness"] == pytest.approx(COULOMB / REACH, rel=0.01)
    at = fitted.model.drive.state_names.index("motor.friction.z")
    nodes = tuple(node.copy() for node in point.nodes)
    for node in nodes:
        node[0, at] = 1.01 * REACH * np.sign(node[1, 1])
    bent = carrying(program, Point(point.theta, nodes), np.array([at]))
    assert program.objective(solve_nodes(program, bent)) > program.objective(point) + 1000.0
    assert program.objective(at_rest(program, bent)) < program.objective(point) + 1.0


def test_springs_ask_for_steps_as_short_as_they_swing(tmp_path: Path) -> None:
    """A shaft at rest on them is no stiffer than one that creeps."""
    model = slipping(tmp_path)
    rate = np.sqrt(1.02 * COULOMB / REACH / (OFF * INERTIA))
    assert model.max_step == pytest.approx(STEP_PER_RADIAN / rate, rel=0.01)


def test_only_samples_beside_a_jump_are_found() -> None:
    """A step of many deviations is found on both sides; a smooth wave, a vibration and noise are not."""
    rng = np.random.default_rng(0)
    wave = np.sin(0.05 * np.arange(2000)) + 0.01 * rng.standard_normal(2000)
    assert not np.any(beside_jumps(wave, 0.01))
    wave[700:] += 0.5
    found = set(np.flatnonzero(beside_jumps(wave, 0.01)).tolist())
    assert {699, 700} <= found <= {698, 699, 700, 701}
    vibrating = np.sin(2.0 * np.arange(2000))
    assert not np.any(beside_jumps(vibrating, 0.01))


def test_the_only_recording_is_cut_into_pieces(tmp_path: Path) -> None:
    """Where there is one training recording its pieces are fitted together, as recordings are."""
    path = write_case(tmp_path, axis())
    path.write_text(path.read_text(encoding="utf-8").replace("  - a.h5\n  - b.h5\n", "  - a.h5\n"), encoding="utf-8")
    fitted = fit_base(prepare(load_problem(path)))
    assert len(fitted.linear.recordings) == FOLDS
    assert fitted.values["motor.friction.tau_c"] == pytest.approx(COULOMB, rel=0.02)
