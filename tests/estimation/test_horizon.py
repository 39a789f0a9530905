"""A drive that nothing holds is judged over windows, any other over the whole recording."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from axes import CURRENT, INERTIA, POSITION, axis, problem, two_masses

from friction_ocp.drive.parts import Channel, Controller, Drive, Gravity
from friction_ocp.estimation.horizon import LONGEST_WINDOW, fits_free_run, horizon, is_held
from friction_ocp.estimation.model import Model, prepare
from friction_ocp.parameters import Free

PENDULUM = Gravity(0.5)
REFERENCE = Channel("reference", "reference.theta", role="input")
PRESCRIBED = Channel("angle", "motor.theta", role="input")
LOOP = Controller("p", "position", "current", kp=2.0)


@pytest.mark.parametrize(
    ("drive", "held"),
    [
        (axis(), False),
        (axis(gravity=PENDULUM), True),
        (replace(axis(), channels=(REFERENCE, POSITION), controller=LOOP), True),
        (replace(axis(), channels=(PRESCRIBED, CURRENT)), True),
        (two_masses(), False),
        (two_masses(gravity=PENDULUM), True),
        (two_masses(stiffness=None, gravity=PENDULUM), True),
        (replace(two_masses(), transmissions=()), False),
        (replace(two_masses(gravity=PENDULUM), transmissions=()), False),
    ],
    ids=["free", "gravity", "loop", "prescribed", "two free", "elastic", "rigid", "apart", "one of two"],
)
def test_a_drive_is_held_by_gravity_a_loop_or_a_prescribed_motion(drive: Drive, held: bool) -> None:
    """What holds one shaft holds all that transmissions join to it."""
    assert is_held(drive) is held


@pytest.fixture(scope="module")
def drifting() -> Model:
    """One free shaft under a measured current."""
    return prepare(problem(axis(inertia=Free(INERTIA))))


def test_a_drifting_axis_is_judged_over_ten_seconds(drifting: Model) -> None:
    """Nothing in it oscillates, so that the longest window counts; it is not fitted on its free run."""
    assert horizon(drifting) == LONGEST_WINDOW
    assert not fits_free_run(drifting)


def test_a_stated_horizon_is_kept(drifting: Model) -> None:
    """`horizon_s` overrides the rule, and `fit` the choice that follows from it."""
    stated = problem(axis(inertia=Free(INERTIA)), horizon_s=1.5, fit="simulation")
    model = replace(drifting, problem=stated)
    assert horizon(model) == 1.5
    assert fits_free_run(model)


def test_a_drive_that_oscillates_is_judged_over_ten_slowest_periods() -> None:
    """Two free masses on a spring of the output side: omega^2 = k (1 / (N^2 J1) + 1 / J2)."""
    stiffness, ratio = 200.0, 10.0
    omega = np.sqrt(stiffness * (1.0 / (ratio**2 * INERTIA) + 1.0 / 0.3))
    model = prepare(problem(two_masses(stiffness, ratio)))
    assert horizon(model) == pytest.approx(10.0 * 2.0 * np.pi / omega, rel=1e-3)


def test_a_held_drive_is_judged_over_the_whole_recording() -> None:
    """A pendulum under a measured current comes back by itself."""
    model = prepare(problem(axis(inertia=Free(INERTIA), gravity=PENDULUM)))
    assert horizon(model) is None
    assert fits_free_run(model)
