"""Continuity gaps are weighted by what torque noise can have gathered over a segment."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from axes import INERTIA, axis, problem, two_masses

from friction_ocp.estimation.gap import DETERMINISTIC_GAP, RELATIVE_GAP, gap_covariance, gap_weights
from friction_ocp.estimation.model import Model, prepare
from friction_ocp.estimation.problem import Problem
from friction_ocp.estimation.stages import cuts
from friction_ocp.parameters import Free

DENSITY, SPAN = 3e-4, 0.4
STEPS = 4000
DISCRETE = 1e-3
"""Relative error of noise that changes only every SPAN / STEPS seconds."""


def joined(stated: Problem) -> Model:
    """Return the model of a problem as if its torque noise were that of inputs."""
    return replace(prepare(stated), joins_noise=True)


@pytest.fixture(scope="module")
def model() -> Model:
    """One shaft with torque noise."""
    return joined(problem(axis(inertia=Free(INERTIA)), process_noise={"motor": DENSITY}))


def summed(density: float, inertia: float) -> np.ndarray:
    """Return the covariance of (angle, speed) by summing many independent small kicks of torque."""
    step = SPAN / STEPS
    kick = density * np.sqrt(step) / inertia
    remaining = SPAN - step * (np.arange(STEPS) + 0.5)
    reach = np.column_stack([kick * remaining, np.full(STEPS, kick)])
    return reach.T @ reach


def gathered(model: Model) -> np.ndarray:
    """Return the covariance that the gaps between segments of SPAN are weighted by."""
    item = model.train[0]
    first = cuts(item, round(SPAN / float(np.median(item.grid.dt))))
    root = np.linalg.inv(gap_weights(model, item, first)[0])
    return np.asarray(root @ root.T)


def test_torque_noise_makes_the_speed_a_random_walk(model: Model) -> None:
    """The closed form is the sum of independent kicks and what they become in the angle."""
    assert gathered(model) == pytest.approx(summed(DENSITY, INERTIA), rel=DISCRETE)


def test_each_segment_has_the_noise_of_its_length(model: Model) -> None:
    """Variance of the speed grows with time, and there is one gap less than there are segments."""
    item = model.train[0]
    first = np.cumsum([0, 50, 100, 200, 50])
    weights = gap_weights(model, item, first)
    assert len(weights) == 3
    roots = np.linalg.inv(weights)
    variances = np.einsum("kij,kij->ki", roots, roots)[:, 1]
    assert variances / variances[0] == pytest.approx([1.0, 2.0, 4.0], rel=DISCRETE)


def test_without_stated_noise_a_gap_is_a_share_of_its_state(model: Model) -> None:
    """The default says how far a state may jump, whatever the length of the segment."""
    quiet = replace(model, joins_noise=False, problem=problem(axis(inertia=Free(INERTIA))))
    weights = gap_weights(quiet, model.train[0], cuts(model.train[0], 120))
    assert weights[0] == pytest.approx(np.diag(1.0 / (RELATIVE_GAP * model.state_scale)))


def test_noise_behind_a_rigid_gear_counts_by_its_ratio() -> None:
    """On the first shaft both torque noise and inertia of the second appear divided by the ratio, once and twice."""
    ratio, load = 10.0, 0.3
    geared = joined(problem(two_masses(None, ratio), process_noise={"motor": DENSITY, "load": 20 * DENSITY}))
    density = np.hypot(DENSITY, 20 * DENSITY / ratio)
    assert gathered(geared) == pytest.approx(summed(density, INERTIA + load / ratio**2), rel=DISCRETE)


def test_stated_torque_noise_makes_the_speed_a_random_walk(model: Model) -> None:
    """The closed form is the sum of independent kicks and what they become in the angle."""
    rounding = np.diag((DETERMINISTIC_GAP * model.state_scale) ** 2)
    covariance = gap_covariance(model, model.train[0], np.array([SPAN]))[0] - rounding
    assert covariance == pytest.approx(summed(DENSITY, INERTIA), rel=DISCRETE)


def test_weights_make_gaps_white(model: Model) -> None:
    """W'W is the inverse of the covariance over the length of each segment, where torque noise is stated."""
    item, model = model.train[0], replace(model, joins_noise=False)
    first = cuts(item, 120)
    weights = gap_weights(model, item, first)
    spans = np.diff(item.grid.time[first])[:-1]
    assert len(weights) == len(first) - 2
    for weight, span in zip(weights, spans, strict=True):
        whitened = weight @ gap_covariance(model, item, np.array([span]))[0] @ weight.T
        assert whitened == pytest.approx(np.eye(2), abs=1e-9)
