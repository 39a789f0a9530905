"""What the times of samples say of themselves: gaps."""

from __future__ import annotations

import numpy as np
import pytest

from friction_ocp.recording.sampling import CHANCE, gaps


@pytest.mark.parametrize("steps", ["uniform", "jitter", "pairs", "random"])
def test_gaps_are_found_whatever_the_stamps(steps: str) -> None:
    """Three interruptions are found between uniform, jittered, paired and random stamps, and nothing beside them."""
    rng = np.random.default_rng(5)
    made = {
        "uniform": np.full(5000, 1e-3),
        "jitter": 1e-3 * rng.lognormal(0.0, 0.5, 5000),
        "pairs": np.tile([1e-5, 2e-3], 2500),
        "random": rng.exponential(1e-3, 5000),
    }[steps]
    made[[700, 2000, 4000]] = 0.8, 0.05, 30.0
    time = np.cumsum(made)
    assert gaps(time) == tuple((time[k - 1], time[k]) for k in (700, 2000, 4000))


def test_random_stamps_have_gaps_no_more_often_than_stated() -> None:
    """Of recordings with samples at random instants about one in a hundred seems to have a gap."""
    rng = np.random.default_rng(6)
    alarms = sum(bool(gaps(np.cumsum(rng.exponential(1.0, 500)))) for _ in range(2000))
    assert alarms <= 2000 * CHANCE + 3.0 * np.sqrt(2000 * CHANCE)
