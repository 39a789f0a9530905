"""Recordings that start at rest, and samples beside the jump of an acceleration."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from diagnosis_cases import COULOMB, axis, write_case

from friction_ocp.diagnosis.base_fit import fit_base
from friction_ocp.diagnosis.footing import FOLDS
from friction_ocp.diagnosis.standstill import beside_jumps, settled
from friction_ocp.estimation.model import prepare
from friction_ocp.estimation.program import Point
from friction_ocp.problem_file.load import load_problem

SLIDING = 0.3
"""Speed, rad/s, at which a recording is said to start, against the torque that will move it."""


def test_a_start_that_slides_the_wrong_way_is_brought_to_rest(tmp_path: Path) -> None:
    """From sliding nodes the cost returns to that of the fit, which starts at rest."""
    fitted = fit_base(prepare(load_problem(write_case(tmp_path, axis()))))
    program, point = fitted.linear.program, fitted.linear.point
    nodes = tuple(node.copy() for node in point.nodes)
    for node in nodes:
        node[0, 1] = -SLIDING * np.sign(node[1, 1])
    sliding = Point(point.theta, nodes)
    assert program.objective(sliding) > program.objective(point) + 10.0
    assert program.objective(settled(program, sliding)) < program.objective(point) + 1.0


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
