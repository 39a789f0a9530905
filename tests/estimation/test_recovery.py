"""The truth is found: parameters of the independent plant, and the recorded servo as well as its best fit."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import scipy.stats
from axes import ENCODER_NOISE, TRUTH, fitted_axis, measured_axis
from servo_problem import SERVO_PROBLEMS

from friction_ocp.estimation.estimate import Estimate, Interrupted, identify
from friction_ocp.estimation.progress import Report
from friction_ocp.problem_file.load import load_problem

FAR = 4.0
"""Standard errors; one estimate in 16,000 is farther off by chance."""


@pytest.fixture(scope="module")
def estimate() -> Estimate:
    """One mass with Coulomb and viscous friction, two runs."""
    return identify(fitted_axis(measured_axis(1), measured_axis(2)))


def test_the_parameters_of_the_plant_are_found(estimate: Estimate) -> None:
    """Each is within four of its standard errors of the truth, and known to better than five per cent."""
    assert estimate.converged
    assert set(estimate.values) == TRUTH.keys()
    for item in estimate.parameters:
        assert abs(item.value - TRUTH[item.name]) < FAR * item.std_error
        assert item.std_error < 0.05 * item.value
        assert item.interval95[0] < item.value < item.interval95[1]
        assert item.verdict.word == "ok"


def test_a_fit_of_the_right_model_leaves_noise(estimate: Estimate) -> None:
    """Residuals are white, the free run is off by the noise floor, and there is nothing to warn of."""
    errors, by_recording = estimate.simulation.train_errors["position"]
    assert errors.noise_ratio == pytest.approx(1.0, abs=0.1)
    assert errors.rms == pytest.approx(ENCODER_NOISE, rel=0.1)
    assert set(by_recording) == {"draw1", "draw2"}
    assert all(tests["position"].white for tests in estimate.residuals.values())
    assert estimate.uncertainty.kind == "gauss_newton"
    assert estimate.warnings == ()


def test_the_friction_curve_covers_the_truth(estimate: Estimate) -> None:
    """The band around the friction over speed contains what the plant does, widened to four standard errors."""
    (curve,) = estimate.curves
    moving = curve.speed != 0
    speed, torque = curve.speed[moving], curve.torque[moving]
    truth = np.sign(speed) * TRUTH["motor.friction.tau_c"] + TRUTH["motor.friction.viscous"] * speed
    half = 0.5 * (curve.upper - curve.lower)[moving]
    assert np.all(np.abs(torque - truth) < FAR / 1.96 * half)


def test_a_floor_that_is_stated_too_low_does_not_make_the_answer_sure(estimate: Estimate) -> None:
    """Residuals are white and three times as large: the intervals go by them, and a warning says so."""
    stated = fitted_axis(measured_axis(1), measured_axis(2))
    *others, position = stated.drive.channels
    channels = (*others, replace(position, noise_std=ENCODER_NOISE / 3.0))
    found = identify(replace(stated, drive=replace(stated.drive, channels=channels)))
    assert all(tests["position"].white for tests in found.residuals.values())
    assert found.uncertainty.kind == "sandwich"
    assert re.match(r"Residuals of position are 3\.\d+ times its noise floor, and white", found.warnings[-1])
    for item, right in zip(found.parameters, estimate.parameters, strict=True):
        assert abs(item.value - TRUTH[item.name]) < FAR * item.std_error
        assert item.std_error > 0.5 * right.std_error
    (curve,), known = found.curves, found.uncertainty
    slope = np.array([0.0, 1.0, curve.speed[-1]])
    half = scipy.stats.t.ppf(0.975, known.freedom) * np.sqrt(slope @ known.covariance @ slope)
    assert 0.5 * (curve.upper[-1] - curve.lower[-1]) == pytest.approx(half)


def test_an_interrupt_keeps_the_last_iterate() -> None:
    """Ctrl-C raises Interrupted with an estimate that is called not converged."""

    def stop(report: Report) -> None:
        if report.iteration == 2:
            raise KeyboardInterrupt

    with pytest.raises(Interrupted, match="interrupted in phase") as caught:
        identify(fitted_axis(measured_axis(1)), stop)
    assert not caught.value.estimate.converged
    assert "did not converge" in caught.value.estimate.warnings[0]


def test_the_recorded_servo_is_fitted_as_well_as_the_best_known() -> None:
    """Coulomb and viscous friction explain the training recordings to a mean absolute error of 0.0546 rad."""
    found = identify(load_problem(Path(SERVO_PROBLEMS / "coulomb_viscous.yaml")))
    assert found.converged
    assert found.simulation.train_errors["position"][0].mae <= 0.0546
