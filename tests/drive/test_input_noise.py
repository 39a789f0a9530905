"""Noise of an input as states: a drive feels what is shown without it."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

from friction_ocp.drive.input_noise import noise_states, with_input_noise
from friction_ocp.drive.parts import Channel, Drive, Hold, Motor, Shaft
from friction_ocp.drive.stepping import SteppedDrive, stepped
from friction_ocp.friction.element import FrictionElement
from friction_ocp.friction.static import CoulombViscous

STEP, SHOWN, NOISE, RATE = 1e-3, 2.0, 0.3, 40.0


def drive(hold: Hold) -> SteppedDrive:
    axis = Shaft("axis", inertia=1e-3, friction=FrictionElement(CoulombViscous(0.1, 1e-3)))
    shown = Channel("current", "motor.current", "input", hold=hold)
    seen = (Channel("position", "axis.theta"), Channel("acceleration", "axis.alpha"))
    return stepped(Drive((axis,), (), (Motor("motor", "axis", torque_constant=0.5),), channels=(shown, *seen)))


def numbers(of: SteppedDrive) -> ca.DM:
    known = {"axis.inertia": 1e-3, "axis.friction.tau_c": 0.1, "axis.friction.viscous": 1e-3}
    known["motor.torque_constant"] = 0.5
    usual = {name: 0.0 if name.endswith(("offset", "delay")) else 1.0 for name in of.parameter_names}
    return ca.DM([known.get(name, value) for name, value in usual.items()])


def after(of: SteppedDrive, state: list[float], shown: float) -> list[float]:
    width = ca.DM.zeros(of.step.size1_in(4))
    return np.asarray(of.step(state, shown, numbers(of), STEP, width)).ravel().tolist()


@pytest.mark.parametrize("hold", ["linear", "zero"])
def test_a_drive_feels_what_is_shown_without_the_noise(hold: Hold) -> None:
    plain, noisy = drive(hold), with_input_noise(drive(hold), ("current",))
    rate, start = RATE if hold == "linear" else 0.0, [0.4, 3.0]
    felt = SHOWN - NOISE - 0.5 * STEP * rate
    further = [NOISE, rate] if hold == "linear" else [NOISE]
    moved = after(noisy, [*start, *further], SHOWN)
    assert moved[:2] == pytest.approx(after(plain, start, felt))
    assert moved[2:] == pytest.approx([NOISE + STEP * rate, rate][: len(further)])
    width, known = ca.DM.zeros(plain.output.size1_in(4)), numbers(plain)
    shown = noisy.output([*start, *further], SHOWN, known, STEP, width)
    expected = plain.output(start, SHOWN - NOISE, known, STEP, width)
    assert np.asarray(shown).ravel().tolist() == pytest.approx(np.asarray(expected).ravel().tolist())


def test_only_what_runs_in_lines_has_a_rate() -> None:
    assert with_input_noise(drive("linear"), ("current",)).state_names[2:] == ("current.noise", "current.noise_rate")
    held = with_input_noise(drive("zero"), ("current",))
    assert held.state_names[2:] == ("current.noise",)
    assert noise_states(held) == ((2,), ())
    assert with_input_noise(held, ()) is held
