"""What drives a motor behind a dead time and a lag: its step against the continuous form, and against what is meant."""

from __future__ import annotations

import casadi as ca
import numpy as np
import numpy.typing as npt
import pytest
from scipy.integrate import solve_ivp

from friction_ocp.drive.following import DELAYED, Follower

FloatArray = npt.NDArray[np.float64]
STEP = 2e-3
"""s."""
COUNT = len(DELAYED) + 1
"""States of a dead time and a lag."""
TIMES = [(1e-5, 1e-2), (5e-4, 1e-3), (4e-3, 1e-5), (4e-3, 1e-2)]
"""s: dead time and lag, each from a hundredth of a step to several."""


def functions(dead_time: float, lag: float) -> dict[str, ca.Function]:
    """Return (states, command) -> rates, means and ends of a step, and states as they are at a node."""
    states, wanted = ca.SX.sym("states", COUNT), ca.SX.sym("wanted")
    follower = Follower(dead_time, lag, tuple(ca.vertsplit(states)))
    mean, after = follower.stepped(wanted, ca.SX(STEP))
    found = {"rates": follower.rates(wanted), "mean": mean, "after": after}
    found["observed"] = follower.observed(wanted, ca.SX(STEP))
    return {name: ca.Function(name, [states, wanted], [ca.vertcat(*items)]) for name, items in found.items()}


@pytest.mark.parametrize(("dead_time", "lag"), TIMES)
def test_a_step_is_exact_under_a_constant_command(dead_time: float, lag: float) -> None:
    """Ends and means are those of the continuous form (Radau), however short the times."""
    forms, begin = functions(dead_time, lag), np.array([0.3, -0.2, 0.1, 0.5])

    def rates(_: float, x: FloatArray) -> FloatArray:
        return np.concatenate([np.asarray(forms["rates"](x[:COUNT], 1.0)).ravel(), x[:COUNT]])

    wanted = solve_ivp(rates, (0.0, STEP), np.append(begin, np.zeros(COUNT)), "Radau", rtol=1e-10, atol=1e-12).y[:, -1]
    assert np.asarray(forms["after"](begin, 1.0)).ravel() == pytest.approx(wanted[:COUNT], abs=1e-8)
    assert np.asarray(forms["mean"](begin, 1.0)).ravel() == pytest.approx(wanted[COUNT:] / STEP, abs=1e-8)


@pytest.mark.parametrize(("dead_time", "lag"), TIMES)
@pytest.mark.parametrize("frequency", [5.0, 50.0])
def test_a_wave_comes_late_at_the_nodes(dead_time: float, lag: float, frequency: float) -> None:
    """A smooth command, constant at its middle over each step, is seen as late at the nodes as it is."""
    forms, count = functions(dead_time, lag), 1500
    x, seen = np.zeros(COUNT), np.zeros(count)
    for k in range(count):
        x = np.asarray(forms["after"](x, np.sin(frequency * STEP * (k + 0.5)))).ravel()
        seen[k] = float(forms["observed"](x, np.sin(frequency * STEP * (k + 1)))[-1])
    time = STEP * np.arange(1, count + 1)
    truth = np.imag(np.exp(1j * frequency * (time - dead_time)) / (1.0 + 1j * frequency * lag))
    second_order = 0.12
    """Error over the square of a step in radians: of the middle for the mean of a step, and of ramps for waves."""
    assert np.max(np.abs(seen - truth)[count // 2 :]) < second_order * (frequency * STEP) ** 2


def test_no_dead_time_is_the_limit_of_short_ones() -> None:
    """Values and slopes towards the dead time are finite at none, and those of very short ones."""
    states, dead_time = ca.SX.sym("states", COUNT), ca.SX.sym("dead_time")
    mean, after = Follower(dead_time, 1e-2, tuple(ca.vertsplit(states))).stepped(ca.SX(1.0), ca.SX(STEP))
    both = ca.vertcat(*mean, *after)
    form = ca.Function("form", [states, dead_time], [both, ca.jacobian(both, dead_time)])
    (value, slope), (near, nearby) = (form([0.3, -0.2, 0.1, 0.5], short) for short in (0.0, 1e-9))
    assert np.asarray(value).ravel() == pytest.approx(np.asarray(near).ravel(), abs=1e-5)
    assert np.asarray(slope).ravel() == pytest.approx(np.asarray(nearby).ravel(), rel=1e-5, abs=1e-9)
