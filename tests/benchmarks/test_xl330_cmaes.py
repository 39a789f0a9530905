"""The benchmarks of the servo: constraints and starts, the objective, both methods in small."""

from __future__ import annotations

from concurrent.futures import ProcessPoolExecutor

import numpy as np
import pytest
import random_starts
import xl330_cmaes
from hypothesis import given, settings
from hypothesis import strategies as st
from parameter_box import ParameterBox

from friction_ocp.drive.stepping import stepped
from friction_ocp.estimation.model import prepare
from friction_ocp.estimation.parameter_space import parameter_space
from friction_ocp.estimation.score import errors_of, simulate_recordings
from friction_ocp.problem_file.load import load_problem

ROUNDING = 1e-9
STRIBECK = load_problem(xl330_cmaes.FOLDER / "stribeck.yaml")
BOX = ParameterBox(parameter_space(STRIBECK, stepped(STRIBECK.drive).parameter_names))
NAMES = BOX.space.names
units = st.lists(st.floats(0.0, 1.0), min_size=len(NAMES), max_size=len(NAMES)).map(np.array)


@given(units)
def test_coordinates_go_there_and_back(unit: np.ndarray) -> None:
    """Bounds are 0 and 1, and both ways undo each other."""
    theta = BOX.from_unit(unit)
    assert np.all(theta >= BOX.space.lower) and np.all(theta <= BOX.space.upper)
    np.testing.assert_allclose(BOX.to_unit(theta), unit, atol=ROUNDING)


@given(units)
def test_repair_obeys_the_constraints_and_the_bounds(unit: np.ndarray) -> None:
    """tau_s is never below tau_c, and a point that obeyed already stays."""
    theta = BOX.from_unit(unit)
    repaired = BOX.repaired(theta)
    values = dict(zip(NAMES, repaired, strict=True))
    assert values["servo.friction.tau_s"] >= values["servo.friction.tau_c"] - ROUNDING
    assert np.all(repaired >= BOX.space.lower) and np.all(repaired <= BOX.space.upper)
    np.testing.assert_allclose(BOX.repaired(repaired), repaired, atol=ROUNDING)


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=50)
def test_random_starts_stay_within_the_factor(seed: int) -> None:
    """At most a factor sqrt(10) from every guess, a twentieth of the bounds from a guess of zero."""
    start = BOX.random_start(np.random.default_rng(seed))
    guess = BOX.space.guess
    stated = guess != 0
    ratio = start[stated] / guess[stated]
    assert np.all(ratio <= 10**0.5 + ROUNDING) and np.all(ratio >= 10**-0.5 - ROUNDING)
    span = (BOX.space.upper - BOX.space.lower)[~stated]
    assert np.all(np.abs(start[~stated]) <= 0.05 * span)


def end(theta: float, objective: float, word: str = "ok") -> random_starts.End:
    """Where a start with one parameter led; its standard error is 1."""
    return random_starts.End(np.array([theta]), objective, 1.0, True, "", np.ones(1), (word,))


@pytest.mark.parametrize(
    ("other", "word", "successes", "flat", "strayed"),
    [
        (end(5.05, 1.0005), "ok", 2, (), ()),
        (end(5.5, 1.0005), "ok", 1, (), ("a",)),
        (end(5.5, 1.0005), "traded", 2, ("a",), ()),
        (end(5.05, 1.002), "ok", 1, (), ()),
    ],
)
def test_success_needs_objective_and_parameters(
    other: random_starts.End, word: str, successes: int, flat: tuple[str, ...], strayed: tuple[str, ...]
) -> None:
    """A parameter that strays needs a verdict that says so."""
    summary = random_starts.summarise("p", ("a",), [end(5.0, 1.0, word), other])
    assert (summary.successes, summary.flat, summary.strayed) == (successes, flat, strayed)


def test_objective_is_the_reported_error() -> None:
    """CMA-ES minimises what a result calls the mean absolute error of the free run."""
    model = prepare(load_problem(xl330_cmaes.FOLDER / "coulomb_viscous.yaml"))
    error = xl330_cmaes.FreeRunError.over(model, model.train)(model.space.guess)
    reported = errors_of(simulate_recordings(model, model.train, model.space.guess), 0, 1.0).mae
    assert error == pytest.approx(reported, rel=ROUNDING)


@pytest.mark.slow
def test_both_methods_run(capsys: pytest.CaptureFixture[str]) -> None:
    """A hundred evaluations give a table; the training line holds, CMA-ES being far from done."""
    checks = xl330_cmaes.compare(["coulomb_viscous"], 100)
    assert checks[0].passed
    assert "CMA-ES" in capsys.readouterr().out


@pytest.mark.slow
def test_random_starts_run() -> None:
    """Two starts of the plainest model reach one optimum."""
    with ProcessPoolExecutor(2) as pool:
        summary = random_starts.run_problem(random_starts.DEFAULT[0], 2, 1, pool)
    assert summary.successes == 2
