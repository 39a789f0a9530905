"""Starts around a guess."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from axes import axis, problem, still_recording

from friction_ocp.estimation.model import prepare
from friction_ocp.estimation.parameter_space import ParameterSpace
from friction_ocp.estimation.starts import start_points
from friction_ocp.friction.static import Stribeck
from friction_ocp.parameters import Free


@pytest.fixture(scope="module")
def space() -> ParameterSpace:
    """Four parameters with wide bounds."""
    law = Stribeck(
        tau_c=Free(0.1, 0.0, 1.0), tau_s=Free(0.2, 0.0, 1.0), omega_s=Free(3.0, 0.01, 1e3), viscous=Free(1e-3, 0.0, 0.1)
    )
    return prepare(problem(axis(law), still_recording())).space


def test_starts_lie_within_a_factor_of_the_guess(space: ParameterSpace) -> None:
    """The first start is the guess; the others lie within sqrt(10) of it, repeat with the seed and differ."""
    first, *others = start_points(space, 8, seed=3)
    assert first == pytest.approx(space.guess)
    assert np.all(np.abs(np.log10(np.array(others) / space.guess)) <= 0.5 + 1e-12)
    assert np.array(start_points(space, 8, seed=3)) == pytest.approx(np.array([first, *others]))
    assert not np.any(np.isclose(start_points(space, 8, seed=4)[1], others[0]))


def test_starts_fill_every_stratum_once(space: ParameterSpace) -> None:
    """A Latin hypercube: cut into as many shares of its range as there are starts, a parameter has one in each."""
    others = np.array(start_points(space, 9, seed=5)[1:])
    stratum = np.floor(8 * (np.log10(others / space.guess) + 0.5)).astype(int)
    assert np.all(np.sort(stratum, axis=0) == np.arange(8)[:, None])


def test_a_guess_of_zero_is_left_by_addition_and_bounds_hold(space: ParameterSpace) -> None:
    """Zero has no factors; a start beyond a bound lies on it."""
    bounded = replace(space, guess=np.array([0.0, 0.2, 3.0, 1e-3]), upper=np.array([1.0, 0.25, 1e3, 0.1]))
    points = np.array(start_points(bounded, 12, seed=6)[1:])
    assert np.all((points >= bounded.lower) & (points <= bounded.upper))
    assert np.any(points[:, 0] > 0.0) and np.all(points[:, 0] <= bounded.scale[0])
    assert np.any(points[:, 1] == 0.25)
