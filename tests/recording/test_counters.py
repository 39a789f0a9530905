"""Counters that start over are told from commands that step."""

from __future__ import annotations

import numpy as np
import pytest

from friction_ocp.recording.counters import looks_like_counter, turnover


@pytest.mark.parametrize("bits", [12, 16])
@pytest.mark.parametrize("signed", [False, True])
def test_a_forgotten_wrap_is_found(bits: int, signed: bool) -> None:
    """Where the counter jumps, and after how many counts it starts over, is that which it was made with."""
    for seed in range(20):
        rng, turn = np.random.default_rng(seed), 2.0**bits
        counts = np.round(turn * (np.cumsum(0.02 * np.sin(np.arange(2000) / 90.0)) + 0.01 * rng.standard_normal(2000)))
        low = -turn / 2.0 if signed else 0.0
        shown = (counts - low) % turn + low
        jumps = tuple((np.flatnonzero(np.abs(np.diff(shown)) > turn / 2.0) + 1).tolist())
        raw, si = looks_like_counter(shown), turnover(1e-4 * shown, "m")
        assert raw is not None and si is not None
        assert (raw.turn, raw.samples, si.samples, si.steps) == (turn, jumps, jumps, 2**bits)
        assert si.turn == pytest.approx(1e-4 * turn)


def test_what_passes_in_a_gap_is_left_aside() -> None:
    """A counter that goes on by a third of a turn while nothing is logged is found between the gaps."""
    time = np.append(np.arange(1000), 1800.0 + np.arange(1000)) * 1e-3
    turn = 65536.0
    shown = np.round(turn * 3.29 * time) % turn
    assert turn / 4.0 < abs(shown[1000] - shown[999]) < 3.0 * turn / 4.0
    found = looks_like_counter(shown, time)
    assert found is not None and (found.turn, len(found.samples)) == (turn, 7)
    assert turnover(1e-4 * shown, "rad", time) is not None


def test_commands_that_step_are_no_counters() -> None:
    """Steps to and fro between two levels, with ramps or noise, are none, whatever their size."""
    rng = np.random.default_rng(3)
    for size in rng.uniform(150.0, 70000.0, 300):
        steps = np.where(np.arange(2000) // rng.integers(50, 400) % 2, np.round(size), 0.0)
        for added in (0.0, np.round(3.0 * rng.standard_normal(2000)), np.round(0.1 * np.abs(np.arange(2000) - 1000.0))):
            assert looks_like_counter(steps + added) is None
            assert turnover(1e-3 * (steps + added), "rad") is None
    assert looks_like_counter(np.arange(70) % 7.0) is None
