"""Controllers close the loop as in the plant, tick by tick; continuous ones as their closed forms say."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from plant import Plant, PlantAmplifier, PlantController, PlantFriction, PlantMotor, PlantSensor, PlantShaft, Trajectory
from twin import Bench, Run, Twin, worst

from friction_ocp.drive.following import DELAYED
from friction_ocp.drive.parts import Channel, Controller, Drive, Motor, Shaft
from friction_ocp.friction.element import FrictionElement
from friction_ocp.friction.static import CoulombViscous

STEP_ERROR = 1e-4
"""Relative error of steps of 1 ms across stops, carried round the loop."""

TIME = np.linspace(0.0, 2.0, 2001)
ANGLE = Trajectory(TIME, np.sin(2 * np.pi * TIME), "linear")
SPEED = Trajectory(TIME, 2 * np.pi * np.cos(2 * np.pi * TIME), "linear")
SLOW = {"sample_time": 2e-3}
LOOP = {"name": "loop", "feedback": "seen"}

LOOPS: dict[str, tuple[PlantController, str]] = {
    "p": (PlantController(type="p", kp=5.0, **LOOP), "torque"),
    "p saturated, late": (
        PlantController(type="p", kp=3.0, sample_time=5e-3, delay=2e-3, saturation=(-0.5, 0.6), **LOOP),
        "torque",
    ),
    "p late by 2.5 samples": (PlantController(type="p", kp=2.0, delay=5e-3, **SLOW, **LOOP), "torque"),
    "p late by 2 samples": (PlantController(type="p", kp=2.0, delay=4e-3, **SLOW, **LOOP), "torque"),
    "duty": (
        PlantController(type="duty", kp=2.0, sample_time=0.01, delay=4e-3, saturation=(-0.9, 0.9), supply=12.0, **LOOP),
        "voltage",
    ),
    "pd": (PlantController(type="pd", kp=10.0, kd=0.3, **LOOP), "current"),
    "pd two-tap mean": (
        PlantController(type="pd", kp=10.0, kd=0.3, derivative="two_tap_mean", **SLOW, **LOOP),
        "torque",
    ),
    "pi": (PlantController(type="pi_velocity", kp=0.2, ki=2.0, **SLOW, **LOOP), "torque"),
    "pi saturated": (
        PlantController(type="pi_velocity", kp=0.2, ki=2.0, saturation=(-0.1, 0.1), **SLOW, **LOOP),
        "torque",
    ),
    "pi winding up": (
        PlantController(type="pi_velocity", kp=0.2, ki=2.0, saturation=(-0.1, 0.1), anti_windup=False, **SLOW, **LOOP),
        "torque",
    ),
    "pi on a speed": (PlantController(type="pi_velocity", kp=0.2, ki=2.0, **SLOW, **LOOP), "torque"),
    "cascade": (
        PlantController(type="cascade", kp=5.0, kd=0.3, ki=2.0, delay=1e-3, saturation=(-0.4, 0.4), **SLOW, **LOOP),
        "current",
    ),
}


@pytest.mark.parametrize("name", LOOPS)
def test_a_sampled_loop_follows_the_plant(name: str) -> None:
    """Motion and command agree with the plant, for every rule of sampling, delay, saturation and differentiation."""
    controller, output = LOOPS[name]
    motor = PlantMotor("drive", "axis", output, torque_constant=0.5, resistance=2.0, controller="loop")
    measured = "axis.omega" if name == "pi on a speed" else "axis.theta"
    sensors = (
        PlantSensor("seen", measured, controller.sample_time, gain=1.05, offset=0.02),
        PlantSensor("command", f"drive.{output}"),
    )
    shaft = PlantShaft("axis", 0.01, PlantFriction("coulomb_viscous", tau_c=0.05, viscous=0.01))
    plant = Plant((shaft,), (), (motor,), (controller,), sensors)
    twin = Twin(plant, {"reference.theta": ANGLE, "reference.omega": SPEED})
    before = {"controller.previous1": 0.02, "controller.previous2": 0.02}
    truth, run = twin.run(2.0, before, controller.supply)
    assert worst(truth, run, "axis.theta", "axis.omega", "command") < STEP_ERROR


def test_a_sampled_loop_sees_its_channel_as_late_as_it_is() -> None:
    """A cascade whose encoder is late by 1.5 ms, three quarters of its period: to first order in the delay."""
    late, expansion = 1.5e-3, 2e-4
    controller = PlantController(type="cascade", kp=5.0, kd=0.3, ki=2.0, **SLOW, **LOOP)
    motor = PlantMotor("drive", "axis", "current", torque_constant=0.5, resistance=2.0, controller="loop")
    shaft = PlantShaft("axis", 0.01, PlantFriction("coulomb_viscous", tau_c=0.05, viscous=0.01))
    runs = list[tuple[Run, Run]]()
    for delay in (late, 0.0):
        sensors = (
            PlantSensor("seen", "axis.theta", controller.sample_time, delay=delay),
            PlantSensor("command", "drive.current"),
        )
        plant = Plant((shaft,), (), (motor,), (controller,), sensors)
        runs.append(Twin(plant, {"reference.theta": ANGLE, "reference.omega": SPEED}).run(2.0))
    (truth, ours), (_, punctual) = runs
    assert worst(truth, ours, "axis.theta") < expansion < 0.02 * worst(truth, punctual, "axis.theta")


@pytest.mark.parametrize("shown", ["current", "command"])
def test_a_current_is_shown_behind_the_lag_or_before_it(shown: str) -> None:
    """A motor that follows its controller late: a channel shows what it does, or what it is told to."""
    controller = PlantController(type="cascade", kp=5.0, kd=0.3, ki=2.0, **SLOW, **LOOP)
    amplifier = PlantAmplifier(time_constant=5e-3)
    motor = PlantMotor("drive", "axis", torque_constant=0.5, controller="loop", amplifier=amplifier)
    shaft = PlantShaft("axis", 0.01, PlantFriction("coulomb_viscous", tau_c=0.05, viscous=0.01))
    sensors = (PlantSensor("seen", "axis.theta", controller.sample_time), PlantSensor("shown", f"drive.{shown}"))
    plant = Plant((shaft,), (), (motor,), (controller,), sensors)
    twin = Twin(plant, {"reference.theta": ANGLE, "reference.omega": SPEED})
    first = float(twin.run(0.01)[0]["shown"][0])
    truth, run = twin.run(2.0, {"drive.lagged": first})
    assert worst(truth, run, "axis.theta", "axis.omega", "shown") < STEP_ERROR


def test_a_sampled_loop_feels_the_dead_time_of_its_motor() -> None:
    """Commands that are acted on 1.5 periods late, then with a lag: within what steps of a command make of it."""
    late, expansion = PlantAmplifier(delay=3e-3, time_constant=5e-3), 2e-3
    controller = PlantController(type="cascade", kp=5.0, kd=0.1, ki=2.0, **SLOW, **LOOP)
    motor = PlantMotor("drive", "axis", torque_constant=0.5, controller="loop", amplifier=late)
    shaft = PlantShaft("axis", 0.01, PlantFriction("coulomb_viscous", tau_c=0.05, viscous=0.01))
    sensors = (PlantSensor("seen", "axis.theta", controller.sample_time), PlantSensor("current", "drive.current"))
    plant = Plant((shaft,), (), (motor,), (controller,), sensors)
    twin = Twin(plant, {"reference.theta": ANGLE, "reference.omega": SPEED})
    first = float(twin.run(0.01)[0]["current"][0])
    begin = {f"drive.{name}": first for name in (*DELAYED, "lagged")}
    truth, ours = twin.run(2.0, begin)
    amplifier = PlantAmplifier(time_constant=late.time_constant)
    prompt = replace(plant, motors=(replace(motor, amplifier=amplifier),))
    _, punctual = Twin(prompt, {"reference.theta": ANGLE, "reference.omega": SPEED}).run(2.0, begin)
    for name in ("axis.theta", "axis.omega"):
        assert worst(truth, ours, name) < expansion < 0.1 * worst(truth, punctual, name)


def servo(controller: Controller, motor: Motor) -> Bench:
    """One shaft with viscous friction under a continuous controller."""
    channels = (
        Channel("seen", "axis.theta"),
        Channel("theta_ref", "reference.theta", "input"),
        Channel("omega_ref", "reference.omega", "input"),
        Channel("supply", "drive.supply_voltage", "input"),
    )
    shaft = Shaft("axis", 0.01, FrictionElement(CoulombViscous(0.0, 0.05)))
    return Bench(Drive((shaft,), (), (motor,), controller, channels))


def test_a_continuous_pd_loop_is_an_oscillator() -> None:
    """Continuous PD control of a viscous shaft decays as the second-order system it is."""
    bench = servo(Controller("pd", "seen", "torque", kp=4.0, kd=0.05), Motor("drive", "axis"))
    run = bench.run(1.0, {"theta_ref": 1.0, "omega_ref": 0.0, "supply": 1.0}, step=2.5e-4)
    decay, rate = 0.1 / 0.02, np.sqrt(4.0 / 0.01 - 25.0)
    wanted = 1.0 - np.exp(-decay * run.time) * (np.cos(rate * run.time) + decay / rate * np.sin(rate * run.time))
    phase = 3e-5
    """(rate x step)^2 / 12 over 20 rad."""
    assert run["axis.theta"] == pytest.approx(wanted, abs=phase)


@pytest.mark.parametrize("inductance", [None, 4e-3])
def test_a_continuous_pi_loop_leaves_no_error(inductance: float | None) -> None:
    """A continuous PI velocity loop over a voltage motor ends at the reference speed, its integral holding the load."""
    controller = Controller("pi_velocity", "seen", "voltage", kp=0.5, ki=5.0, saturation=(-24.0, 24.0))
    bench = servo(controller, Motor("drive", "axis", 0.5, 2.0, inductance))
    run = bench.run(6.0, {"theta_ref": 0.0, "omega_ref": 4.0, "supply": 1.0})
    settled = 1e-9
    assert run["axis.omega"][-1] == pytest.approx(4.0, rel=settled)
    assert run["controller.integral"][-1] == pytest.approx(0.5 * 4.0 + 2.0 * (0.05 * 4.0 / 0.5), rel=settled)


def test_a_duty_controller_scales_the_measured_supply() -> None:
    """The saturated duty times the supply voltage is the terminal voltage."""
    controller = Controller("duty", "seen", kp=2.0, saturation=(-0.9, 0.8))
    bench = servo(controller, Motor("drive", "axis", 0.5, 2.0))
    run = bench.run(5e-3, {"theta_ref": 1.0, "omega_ref": 0.0, "supply": 11.0}, step=1e-5)
    damping = 0.05 + 0.5**2 / 2.0
    wanted = 0.8 * 11.0 * 0.5 / 2.0 / damping * (1.0 - np.exp(-damping / 0.01 * run.time))
    step_error = 1e-6
    assert run["axis.omega"] == pytest.approx(wanted, rel=step_error)
