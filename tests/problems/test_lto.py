"""The Leighton telescope's problems against the numbers of its paper, or of the plant that has them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from lto_cases import REPOSITORY, script

from friction_ocp import Estimate, check, identify, load_problem
from friction_ocp.estimation.agreement import curve_distance
from friction_ocp.estimation.model import prepare
from friction_ocp.estimation.problem import RecordingUse, StaticUse
from friction_ocp.estimation.score import simulate_recordings
from friction_ocp.result_document import estimate_document

LTO = REPOSITORY / "problems" / "lto"
DATA = script("lto", "make_data")
INTERVALS = 4.0
"""Standard errors within which a single estimate lies."""


def fitted(name: str) -> Estimate:
    """Fit a problem file."""
    estimate = identify(load_problem(LTO / f"{name}.yaml"))
    assert estimate.converged, estimate.message
    return estimate


def assert_close(estimate: Estimate, truth: dict[str, float], largest: dict[str, float]) -> None:
    """Assert that parameters are within their own errors, and these are small enough."""
    for item in estimate.parameters:
        if item.name in truth:
            wanted = truth[item.name]
            assert abs(item.value - wanted) < INTERVALS * item.std_error, item.name
            assert item.std_error < largest.get(item.name, 0.02) * abs(wanted), item.name


@pytest.mark.parametrize("path", sorted(LTO.glob("*.yaml")), ids=lambda path: path.stem)
def test_every_problem_file_is_sound_and_opens_with_its_question(path) -> None:
    """A comment says what is asked and what is known, and no rule finds an error."""
    problem = load_problem(path)
    assert (
        problem.question.startswith("Asked: ") and "Known: " in problem.question
    ) or "same" in problem.question.lower()
    assert [str(finding) for finding in check(problem) if finding.severity == "error"] == []


def test_the_curve_is_the_polyline_of_equation_6() -> None:
    """Eqs. 5, 6: (c0, c1, c2, break) = (0.1447, 0.0042, 0.000417, 104.25)."""
    estimate = fitted("curve")
    wanted = {
        "motor.friction.tau_c": 0.1447,
        "motor.friction.slopes.0": 0.0042,
        "motor.friction.slopes.1": 0.000417,
        "motor.friction.breaks.0": 104.25,
    }
    assert_close(estimate, wanted, {})
    train, again = estimate.simulation.static
    assert train.noise_ratio < 1.5 and again.noise_ratio < 1.6 and again.split == "validation"


@pytest.mark.slow
def test_curve_and_responses_together_tell_how_friction_is_distributed() -> None:
    """Eqs. 8 to 13: every number of both parts, the stiffness, and the scale of the accelerometer."""
    estimate = fitted("joint")
    truth = DATA.high_speed_polyline().truth | {"acceleration.gain": DATA.ACCELEROMETER_GAIN}
    assert_close(estimate, truth, {"motor.friction.slopes.1": 0.05})
    assert all(item.verdict.word == "ok" for item in estimate.parameters)
    (training, _), (held_out, _) = (
        table["acceleration"] for table in (estimate.simulation.train_errors, estimate.simulation.validation_errors)
    )
    assert training.noise_ratio < 1.1 and held_out.noise_ratio < 1.1
    assert_coherent(estimate, "stop_again")
    assert_predicts_the_currents(estimate)


def assert_predicts_the_currents(estimate: Estimate) -> None:
    """Assert that measured and predicted current are as close as their errors let them, as Figs. 15 and 22 show."""
    for fit in estimate.simulation.static:
        assert (fit.effort, fit.unit) == ("current", "A")
        assert np.max(np.abs(fit.predicted / fit.measured - 1.0)) < 0.01
        assert fit.noise_ratio < 1.6


def assert_coherent(estimate: Estimate, recording: str) -> None:
    """Assert that a stop curve and its simulation are as one at the mode of 6.24 Hz, as Figs. 13, 19 and 21 show."""
    found = estimate_document(estimate)["coherence"][recording]["acceleration"]
    frequency, share = np.array(found["frequency_hz"]), np.array(found["share"])
    assert np.all(share[(frequency > 3.0) & (frequency < 9.0)] > 0.99)
    assert found["explained"] > 0.99


@pytest.mark.slow
def test_the_data_decide_in_which_part_the_break_is() -> None:
    """The wrong part fits the same recordings worse by far more than its likelihood could hide, either way."""
    right, wrong = fitted("joint"), identify(load_problem(LTO / "low_speed_part.yaml"))
    assert wrong.solver.objective - right.solver.objective > 100.0
    other = fitted("low_speed_truth")
    assert_close(
        other,
        DATA.low_speed_polyline().truth,
        {"motor.friction.tau_c": 0.1, "load.friction.tau_c": 0.1, "motor.friction.viscous": 0.1},
    )


@pytest.mark.slow
def test_the_ranges_of_equation_10_do_not_move_an_estimate_inside_them() -> None:
    """Constraints that hold at the optimum leave it where it is."""
    free, held = fitted("joint"), fitted("ranges")
    for name, value in free.values.items():
        assert held.values[name] == pytest.approx(value, rel=1e-3)


@pytest.mark.slow
def test_the_ranges_of_equation_11_do_not_move_an_estimate_inside_them() -> None:
    """With the break in the slow part: slopes of the slow part of either sign, c0h and R c0l within c0."""
    estimate = fitted("low_speed_ranges")
    assert_close(
        estimate,
        DATA.low_speed_polyline().truth,
        {"motor.friction.tau_c": 0.1, "load.friction.tau_c": 0.1, "motor.friction.viscous": 0.1},
    )
    for name, value in fitted("low_speed_truth").values.items():
        assert estimate.values[name] == pytest.approx(value, rel=1e-3)


@pytest.mark.slow
def test_a_slope_of_the_fast_part_may_be_negative() -> None:
    """Eq. 10 with R c1l above c1, so that c1h < 0: friction of the fast part that falls up to the break is found.

    As c2h is not negative, this takes a total that grows more steeply beyond the break.
    """
    telescope = DATA.Telescope(
        "falling",
        DATA.leighton.fast_polyline(0.11, -0.0005, 0.0004),
        DATA.leighton.slow_friction(0.0347, 0.0012, chains=2),
        DATA.high_speed_polyline().truth
        | {
            "motor.friction.slopes.0": -0.0005,
            "motor.friction.slopes.1": 0.0004,
            "load.friction.viscous": DATA.leighton.RATIO**2 * 0.0012,
        },
    )
    uses = tuple(
        RecordingUse(DATA.response(telescope, kind, 700 + k, kind)) for k, kind in enumerate(("start", "stop"))
    )
    points = (StaticUse(DATA.curve(telescope, 702)),)
    base = load_problem(LTO / "ranges.yaml")
    estimate = identify(replace(base, train=uses, static=points, validation=(), static_validation=()))
    assert estimate.converged, estimate.message
    assert_close(estimate, telescope.truth, {"load.friction.tau_c": 0.1, "motor.friction.tau_c": 0.1})


@pytest.mark.slow
def test_the_parabola_is_refined_by_curve_and_stop_together() -> None:
    """Eq. 16: 0.13, 0.0042, -1.147e-5 in the fast part, 0.00537 and 0.000786 in the slow one."""
    estimate = fitted("quadratic")
    assert_close(estimate, DATA.quadratic().truth, {"load.friction.tau_c": 0.1})
    assert_coherent(estimate, "stop")
    assert_predicts_the_currents(estimate)


@pytest.mark.slow
def test_the_refined_parabola_is_nearer_by_the_distance_d() -> None:
    """Eqs. 14 to 16: on the stop of eq. 16 the identified numbers have the d of the plant, those of eq. 14 a larger.

    The errors that the likelihood counts tell them apart far better: d takes what is late for what is near.
    """
    problem = load_problem(LTO / "quadratic.yaml")
    stop = tuple(use for use in problem.train if use.name == "stop")
    model = prepare(replace(problem, train=stop, static=(), validation=(), static_validation=()))
    gain = {"acceleration.gain": DATA.ACCELEROMETER_GAIN}
    refined = DATA.quadratic().truth | gain
    first = refined | {
        "motor.friction.tau_c": 0.1007,
        "motor.friction.viscous": 0.0047,
        "load.friction.tau_c": DATA.leighton.RATIO * 0.0347,
        "load.friction.viscous": DATA.leighton.RATIO**2 * 0.0003,
    }
    distances, errors = list[float](), list[float]()
    for values in (identify(problem).values, refined, first):
        (run,) = simulate_recordings(model, model.train, np.array([values[name] for name in model.space.names]))
        own = (run.time > DATA.STOP_AT - 0.05) & (run.time < DATA.STOP_AT + 3.0)
        measured, simulated = run.measured[own, 0], run.simulated[own, 0]
        distances.append(curve_distance(run.time[own], measured, simulated))
        errors.append(float(np.sqrt(np.mean((measured - simulated) ** 2))))
    assert distances[0] == pytest.approx(distances[1], rel=0.02)
    assert distances[2] > 1.5 * distances[1]
    assert errors[2] > 10.0 * errors[1]


@pytest.mark.slow
def test_a_parabola_does_not_explain_a_break() -> None:
    """The stop alone hardly tells, since the stopped motor hides the fast part; the static points do."""
    estimate = fitted("quadratic_on_polyline")
    curve = next(fit for fit in estimate.simulation.static if fit.name == "curve")
    assert curve.noise_ratio > 5.0
    assert any("The static points curve are missed by" in text for text in estimate.warnings)
    assert estimate.uncertainty.kind == "sandwich"


@pytest.mark.slow
def test_with_an_uncertain_inertia_the_slow_side_is_traded_with_it() -> None:
    """Only ratios to the inertia are seen: stiffness and friction of the slow side carry its 3 %."""
    estimate = fitted("inertia_prior")
    by_name = {item.name: item for item in estimate.parameters}
    for name in ("load.friction.tau_c", "load.friction.viscous", "motor-load.stiffness"):
        item = by_name[name]
        assert item.verdict.word == "traded" and "load.inertia" in item.verdict.traded_with
        assert item.std_error / item.value == pytest.approx(0.03, abs=0.03)
    assert by_name["motor.friction.breaks.0"].verdict.word == "ok"


@pytest.mark.slow
def test_draws_are_told_apart() -> None:
    """Three draws of each telescope: its own model has the least objective, by a margin."""
    problems = {
        name: load_problem(LTO / f"{name}.yaml") for name in ("joint", "low_speed_part", "quadratic_on_polyline")
    }
    own = dict(zip(("high", "low", "quadratic"), problems, strict=True))
    for make in DATA.TELESCOPES:
        telescope = make()
        for seed in range(9000, 9003):
            uses = tuple(
                RecordingUse(DATA.response(telescope, kind, seed + k, kind)) for k, kind in enumerate(("start", "stop"))
            )
            points = (StaticUse(DATA.curve(telescope, seed + 2)),)
            ends = {
                name: identify(
                    replace(problem, train=uses, static=points, validation=(), static_validation=())
                ).solver.objective
                for name, problem in problems.items()
            }
            assert min(ends, key=lambda name: ends[name]) == own[telescope.name], ends


def test_a_family_of_curves_tells_how_friction_grows_with_the_load() -> None:
    """Fig. 18: shares of the transmitted torque in dry and viscous friction of the fast part, three loads together."""
    estimate = fitted("families")
    assert_close(estimate, DATA.family("heavy").truth, {"motor.friction.load.coulomb": 0.05})
    assert all(fit.noise_ratio < 1.6 for fit in estimate.simulation.static)
    assert [use.set.get("load.external_torque.constant", 0.0) for use in estimate.problem.static] == [
        -0.5 * pull for pull in DATA.LOADS.values()
    ]


def test_the_data_are_those_of_the_script() -> None:
    """The stop in the folder is what the script makes from its seed."""
    made = DATA.response(DATA.high_speed_polyline(), "stop", 103, "stop")
    kept = next(use for use in load_problem(LTO / "joint.yaml").train if use.name == "stop").recording
    assert kept.channels["acceleration"].values == pytest.approx(made.channels["acceleration"].values, abs=1e-9)
    assert np.array_equal(kept.channels["motor_speed"].values, made.channels["motor_speed"].values)
