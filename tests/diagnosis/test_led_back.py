"""What does nothing that the parameters could not do as well is led back to what the problem states of it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from diagnosis_cases import axis, write_case

from friction_ocp.diagnosis.base_fit import fit_base
from friction_ocp.diagnosis.bench import Seat, open_bench
from friction_ocp.diagnosis.clues import clues_of
from friction_ocp.diagnosis.fitted_model import FittedModel
from friction_ocp.diagnosis.led_back import led_back
from friction_ocp.diagnosis.linear import linear_program
from friction_ocp.diagnosis.polishing import polished
from friction_ocp.diagnosis.reexamine import gone_back
from friction_ocp.effects.registry import effects
from friction_ocp.estimation.model import prepare, with_drive
from friction_ocp.estimation.program import Point
from friction_ocp.execution.executor import InProcess
from friction_ocp.problem_file.load import load_problem
from friction_ocp.statistics.execution import Execution

SCALE = 1.4
"""Of the only encoder; inertia and viscous friction grow with it."""


def scaled(base: FittedModel) -> FittedModel:
    """Return a fit with the scale, and with what makes up for it."""
    factors = {"motor.inertia": SCALE, "motor.friction.viscous": SCALE}
    at = {name: base.values[name] * factor for name, factor in factors.items()}
    added = effects()["sensor_gain"].augment(base.model.problem.drive, "position", clues_of(base)).drive
    model = with_drive(base.model, added)
    held = replace(model.space, lower=model.space.lower.copy(), upper=model.space.upper.copy())
    held.lower[held.names.index("position.gain")] = SCALE
    start = held.with_known({**base.values, **at, "position.gain": SCALE})
    return polished(replace(model, space=held), base.footing, start, None)


def test_a_scale_of_the_only_encoder_goes_back_to_one(tmp_path: Path) -> None:
    """Inertia and friction come back with it to where the fit without it was."""
    base = fit_base(prepare(load_problem(write_case(tmp_path, axis()))))
    fitted = scaled(base)
    assert fitted.values["position.gain"] == pytest.approx(SCALE, rel=0.01)
    back = led_back(fitted, base.model)
    assert back is not None
    np.testing.assert_allclose(back, base.theta, rtol=0.02)


@pytest.mark.slow
@pytest.mark.parametrize("first", [True, False])
def test_a_way_out_of_where_a_fit_was_caught_is_no_effect(tmp_path: Path, first: bool) -> None:
    """The search goes on from the better fit without it; that is the base model's where nothing was added before."""
    opened = open_bench(load_problem(write_case(tmp_path, axis())), Execution(InProcess()))
    best, program = opened.current, opened.current.linear.program
    off = Point(best.theta * 1.01, best.linear.point.nodes)
    seat = Seat.of(FittedModel(best.model, best.footing, linear_program(program, off)))
    caught = replace(opened, seat=seat, base_point=seat.point)
    assert caught.current.objective > best.objective + 100.0
    bench = gone_back(caught, scaled(best), first)
    assert bench is not None
    assert bench.current.objective == pytest.approx(best.objective, abs=0.5)
    assert (bench.base is bench.current) == first
    assert gone_back(bench, scaled(best), first) is None


def test_drag_is_not_led_back(tmp_path: Path) -> None:
    """The simpler model has no number for it."""
    path = write_case(tmp_path, axis(law="quadratic", quadratic=1e-4))
    base = fit_base(prepare(load_problem(path)))
    added = effects()["quadratic_drag"].augment(base.model.problem.drive, "motor", clues_of(base)).drive
    model = with_drive(base.model, added)
    with_drag = polished(model, base.footing, model.space.with_known(base.values), None)
    assert led_back(with_drag, base.model) is None
