"""A pendulum whose current is measured with noise: free runs wander by it, and segments that it joins do not."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
import yaml
from pendulum import TRUTH, document, record

from friction_ocp.estimation.estimate import Estimate, identify
from friction_ocp.estimation.warnings import LOST_FREE_RUN
from friction_ocp.problem_file.load import load_problem
from friction_ocp.recording.hdf5 import write_recording

NOISE = 0.02


def identified(folder: Path, noise: float, estimation: dict[str, Any], inertia: float = 0.012) -> Estimate:
    """Return what is identified of the pendulum, its inertia guessed."""
    write_recording(record("a", noise, 2.0, 5), folder / "a.h5")
    path = folder / "pendulum.yaml"
    whole = {**document(inertia), "recordings": {"train": ["a.h5"]}, "estimation": estimation}
    path.write_text(yaml.safe_dump(whole, sort_keys=False), encoding="utf-8")
    return identify(load_problem(path))


def widths(found: Estimate) -> dict[str, float]:
    """Return the widths of the intervals over the true values, which they hold."""
    for item in found.parameters:
        low, high = item.interval95
        assert low < TRUTH[item.name] < high
    return {item.name: (item.interval95[1] - item.interval95[0]) / TRUTH[item.name] for item in found.parameters}


def test_noise_of_the_current_joins_segments_instead(tmp_path: Path) -> None:
    """The answer says so, and knows the values several times better than a fit of free runs, which stays to be had."""
    found, free = (identified(tmp_path, NOISE, options) for options in ({}, {"fit": "simulation"}))
    assert found.converged and found.warnings[0] == LOST_FREE_RUN
    assert LOST_FREE_RUN not in free.warnings
    known, before = widths(found), widths(free)
    assert all(known[name] < 0.3 * before[name] for name in TRUTH)
    assert known["arm.friction.tau_c"] < 0.03


def test_segments_begin_where_free_runs_have_ended(tmp_path: Path) -> None:
    """So that their end does not hang on the guesses."""
    one, other = (identified(tmp_path, NOISE, {}, guess) for guess in (0.012, 0.03))
    known = widths(one)
    assert all(abs(one.values[name] - other.values[name]) < 0.1 * known[name] * TRUTH[name] for name in TRUTH)


def test_free_runs_are_fitted_where_the_current_is_known(tmp_path: Path) -> None:
    """What sensors err explains what is left."""
    found = identified(tmp_path, 0.0, {})
    assert found.converged and LOST_FREE_RUN not in found.warnings
    assert found.values["arm.friction.tau_c"] == pytest.approx(TRUTH["arm.friction.tau_c"], rel=1e-3)
