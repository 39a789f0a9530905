"""Sums of rounding errors are as large as counting shows them to be, at speeds that beat with the sampling, too."""

from __future__ import annotations

import numpy as np
import pytest

from friction_ocp.diagnosis.rounding import WAVES, Counter, Rounding

SAMPLES, DRAWS = 400, 4000


def counter(phase: np.ndarray) -> Counter:
    """Return a counter without other noise."""
    waves = np.arange(1, WAVES + 1)
    return Counter(np.arange(phase.size), phase, 6.0 / (np.pi * waves) ** 2)


def counted(phase: np.ndarray, columns: np.ndarray) -> np.ndarray:
    """Return the covariance of sums of true rounding errors, in units of their deviation, from anywhere in a count."""
    start = np.random.default_rng(1).random((DRAWS, 1))
    errors = (np.round(phase + start) - phase - start) * np.sqrt(12.0)
    sums = errors @ columns
    return sums.T @ sums / DRAWS


@pytest.mark.parametrize("speed", [6.0, 6.0005, 5.5, 0.3334])
def test_beats_are_counted(speed: float) -> None:
    phase = speed * np.arange(SAMPLES)
    columns = np.column_stack([np.ones(SAMPLES), np.linspace(-1.0, 1.0, SAMPLES)])
    found = Rounding(np.full(SAMPLES, -1), (counter(phase),)).covariance(columns)
    true = counted(phase, columns)
    assert true[0, 0] > 3.0 * SAMPLES, "not white"
    assert found[0, 0] == pytest.approx(true[0, 0], rel=0.15)


def test_what_averages_out_faster_counts_as_white() -> None:
    phase = 6.382 * np.arange(SAMPLES)
    columns = np.ones((SAMPLES, 1))
    found = Rounding(np.full(SAMPLES, -1), (counter(phase),)).covariance(columns)
    assert counted(phase, columns)[0, 0] < 0.2 * SAMPLES
    assert found[0, 0] == pytest.approx(SAMPLES)
