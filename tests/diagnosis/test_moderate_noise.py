"""A current whose noise moves the encoder by less than its steps, and by more than segments bear."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import pytest
from diagnosis_cases import diagnosed, write_problem
from pendulum import TRUTH, document, record

from friction_ocp.diagnosis.base_fit import fit_base
from friction_ocp.estimation.drive_noise import made_by_inputs
from friction_ocp.estimation.model import prepare
from friction_ocp.estimation.unknown_noise import noise_moves
from friction_ocp.problem_file.load import load_problem
from friction_ocp.recording.recording import Recording

NOISE, SECONDS = 0.1, 2.0


def recorded(name: str, seed: int, noise: float = NOISE) -> Recording:
    """Swing the pendulum."""
    return record(name, noise, SECONDS, seed)


def test_the_base_model_is_not_drawn_by_it(tmp_path: Path) -> None:
    """A heavier rotor answers less to noise: joined by that alone, segments found one 5 % too heavy."""
    model = prepare(load_problem(write_problem(tmp_path, recorded, document())))
    assert not noise_moves(model, made_by_inputs(model))
    fitted = fit_base(model)
    assert fitted.footing.noisy_inputs == ("current",)
    assert fitted.values["arm.inertia"] == pytest.approx(TRUTH["arm.inertia"], rel=0.03)
    assert fitted.values["arm.gravity.torque"] == pytest.approx(TRUTH["arm.gravity.torque"], rel=3e-3)


@pytest.mark.slow
@pytest.mark.parametrize("noise", [0.03, 0.06, 0.1])
def test_it_is_no_gap(noise: float, tmp_path: Path) -> None:
    """And no lag of the drive, which would smooth the noise."""
    result = diagnosed(write_problem(tmp_path, partial(recorded, noise=noise), document()))
    assert result["verdict"] == "no_gap" and not result["accepted"]
