"""Segments begin where the measured motion has taken the states that no channel shows."""

from __future__ import annotations

from pathlib import Path

from joint_with_play import TRUTH, write_joint

from friction_ocp.diagnosis.footing import footing
from friction_ocp.drive.start import unseen_states
from friction_ocp.estimation.first_nodes import suggested_point
from friction_ocp.estimation.model import Model, prepare
from friction_ocp.estimation.nodes import solve_nodes
from friction_ocp.estimation.program import Point, Program
from friction_ocp.problem_file.load import load_problem


def of_truth(folder: Path) -> tuple[Model, Program, Point]:
    """Return the model of a joint with play, its likelihood, and the point suggested for its true numbers."""
    model = prepare(load_problem(write_joint(folder, with_play=True)))
    theta = model.space.with_known(TRUTH)
    program = footing(model, theta).training(model)
    return model, program, suggested_point(program, theta)


def test_what_an_encoder_on_the_motor_does_not_show(tmp_path: Path) -> None:
    """Angle and speed of the load."""
    model, _, _ = of_truth(tmp_path)
    assert [model.drive.state_names[k] for k in unseen_states(model.drive.mechanism)] == ["load.theta", "load.omega"]


def test_a_hidden_load_is_found_in_its_play(tmp_path: Path) -> None:
    """With the true numbers residuals are noise after a few steps of the nodes; from the middle of the play, never."""
    _, program, point = of_truth(tmp_path)
    found = solve_nodes(program, point)
    assert program.objective(found) < 0.5 * program.samples
    pairs = zip(program.experiments, program.segments, strict=True)
    middle = [program.measured_states(item, point.theta, cut.first[:-1])[0] for item, cut in pairs]
    lost = solve_nodes(program, Point(point.theta, tuple(middle)))
    assert program.objective(lost) > 100.0 * program.objective(found)
