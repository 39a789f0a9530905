"""What samples say of when they were taken: gaps, and repeats of a slower logger."""

from __future__ import annotations

import numpy as np
import pytest

from friction_ocp.errors import FrictionOcpError
from friction_ocp.recording.sampling import CHANCE, first_of_each, gaps, held_for


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


@pytest.mark.parametrize("count", [2, 5, 10])
@pytest.mark.parametrize("resolution", [0.0, 0.02])
def test_repeated_values_are_found_and_left_out(count: int, resolution: float) -> None:
    """Values held until the next one comes are found, rounded ones too, and the first of each is kept."""
    rng = np.random.default_rng(count)
    slow = np.sin(np.arange(300) / 17.0) + 0.01 * rng.standard_normal(300)
    slow = np.round(slow / resolution) * resolution if resolution else slow
    held = np.repeat(slow, count)[count // 2 :]
    assert held_for(held) == count
    fresh = first_of_each(held, count, "x")
    seen = np.isfinite(fresh)
    assert np.all(np.diff(np.flatnonzero(seen)) == count)
    np.testing.assert_array_equal(fresh[seen], slow[-np.count_nonzero(seen) :])
    with pytest.raises(FrictionOcpError, match=f"no multiple of held = {count + 1} apart"):
        first_of_each(held, count + 1, "x")


def test_slow_coarse_and_stepping_signals_are_not_repeated() -> None:
    """Noise, a coarse encoder that creeps, stairs of equal steps and a command of few steps are left alone."""
    rng, time = np.random.default_rng(4), np.arange(4000)
    assert held_for(rng.standard_normal(4000)) is None
    assert held_for(np.round(rng.standard_normal(4000))) is None
    assert held_for(np.round(50.0 * np.sin(time / 300.0))) is None
    assert held_for(time // 8 * 0.1) is None
    assert held_for(np.repeat([0.0, 1.0, 3.0, 2.0], 1000)) is None
