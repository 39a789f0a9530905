"""Fits that are compared have integrator steps of one length."""

from __future__ import annotations

from pathlib import Path

from diagnosis_cases import axis, write_case

from friction_ocp.diagnosis.base_fit import fit_base
from friction_ocp.diagnosis.finer_steps import on_steps_of
from friction_ocp.estimation.model import prepare, with_step
from friction_ocp.problem_file.load import load_problem


def test_what_was_fitted_on_longer_steps_is_fitted_on_those_of_another_model(tmp_path: Path) -> None:
    """Its parameters go on from where they are; what has steps as short stays what it is."""
    fitted = fit_base(prepare(load_problem(write_case(tmp_path, axis()))))
    shorter = with_step(fitted.model, 0.5e-3)
    moved = on_steps_of(shorter, fitted)
    assert moved.model.max_step == shorter.max_step < fitted.model.max_step
    there = moved.linear.program.objective(fitted.linear.point)
    assert moved.objective <= there
    assert on_steps_of(fitted.model, moved) is moved
    assert on_steps_of(moved.model, moved) is moved
