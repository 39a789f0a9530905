"""Gaps of free runs by regime."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import diagnosis_cases
import numpy as np
import pytest
from diagnosis_cases import axis, write_case

from friction_ocp.diagnosis import free_gap
from friction_ocp.diagnosis.base_fit import fit_base
from friction_ocp.diagnosis.free_gap import BLOCKS, FreeErrors, comes_closer, free_errors, gap_map
from friction_ocp.estimation.experiment import Experiment
from friction_ocp.estimation.model import Model, prepare
from friction_ocp.estimation.score import FreeRun
from friction_ocp.problem_file.load import load_problem
from friction_ocp.simulation.grid import FloatArray

NOISY = 0.02
"""Noise of a current, A."""


def test_samples_that_a_delay_loses_are_left_out_of_the_map(tmp_path: Path) -> None:
    """A model that reads its channels earlier has none at the end; what the others say stays comparable."""
    base = fit_base(prepare(load_problem(write_case(tmp_path, axis()))))
    before = free_errors(base, held_out=False)

    def without_end(errors: FreeErrors) -> FreeErrors:
        runs = [replace(run, measured=run.measured.copy()) for run in errors.runs]
        for run in runs:
            run.measured[-5:] = np.nan
        return replace(errors, runs=tuple(runs))

    cells = gap_map(base, before, without_end(before))
    assert len(cells) == len(gap_map(base, before, before))
    for cell in cells:
        assert np.isfinite(cell.before) and cell.before == pytest.approx(cell.after)


def test_a_simulation_that_outgrows_all_numbers_is_as_far_off_as_can_be(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its errors have squares beyond all numbers, and count like any other."""
    base = fit_base(prepare(load_problem(write_case(tmp_path, axis()))))
    before, simulate = free_errors(base, held_out=False), free_gap.simulate_recordings

    def unstable(model: Model, items: tuple[Experiment, ...], theta: FloatArray) -> tuple[FreeRun, ...]:
        return tuple(replace(run, simulated=run.simulated + 1e200) for run in simulate(model, items, theta))

    monkeypatch.setattr(free_gap, "simulate_recordings", unstable)
    errors = free_errors(base, held_out=False)
    assert np.array_equal(errors.count, before.count)
    assert np.all(np.isfinite(errors.power)) and np.all(errors.power > 1e150)


def errors_of(power: float, seed: int, drift: float = 0.0) -> FreeErrors:
    """Return errors of one channel: in every block their mean square over that of noise, give or take chance."""
    samples = 200.0
    blocks = power * np.random.default_rng(seed).chisquare(samples, (BLOCKS, 1))
    run = FreeRun("a", np.arange(2.0), np.array([[-1e6], [1e6]]), np.zeros((2, 1)), np.zeros((2, 1)), {})
    return FreeErrors((run,), ("position",), np.ones(1), blocks, np.full((BLOCKS, 1), samples), np.array([drift]))


@pytest.mark.parametrize(
    ("before", "after", "carries"), [(9.0, 3.0, True), (9.0, 9.0, False), (9.0, 20.0, False), (1.02, 1.0, True)]
)
def test_only_what_comes_closer_elsewhere_carries_over(before: float, after: float, carries: bool) -> None:
    """Not what leaves free runs as far off as they were or farther; where noise is left there is nothing to close."""
    assert comes_closer(errors_of(before, 1), errors_of(after, 2), 0) is carries


@pytest.mark.parametrize(("after", "drowned"), [(20.0, True), (200.0, False)])
def test_what_is_as_close_as_torque_noise_lets_it_is_drowned(after: float, drowned: bool) -> None:
    assert errors_of(after, 2, drift=50.0).drowned is drowned


def test_free_runs_beside_a_noisy_current_are_no_farther_off_than_its_noise_may_take_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(diagnosis_cases, "CURRENT_NOISE", NOISY)
    plain = axis()
    noisy = replace(plain.sensors[1], noise_std=NOISY)
    path = write_case(tmp_path, replace(plain, sensors=(plain.sensors[0], noisy)))
    errors = free_errors(fit_base(prepare(load_problem(path))), held_out=True)
    assert errors.excess() > 1e4, "noise of the current is most of it"
    assert errors.drowned
    assert np.mean(errors.drift) < 100.0 * errors.excess(), "dry friction takes drift away at reversals"


def test_recordings_left_out_are_simulated_with_parameters_of_the_others(tmp_path: Path) -> None:
    """Without validation recordings the gap is that of folds left out: every sample of training, once."""
    problem = load_problem(write_case(tmp_path, axis()))
    base = fit_base(prepare(replace(problem, validation=())))
    left_out, fitted = free_errors(base, held_out=True), free_errors(base, held_out=False)
    assert [run.name for run in left_out.runs] == [run.name for run in fitted.runs]
    assert np.sum(left_out.count) == np.sum(fitted.count)
    assert np.sum(left_out.power) > np.sum(fitted.power)
