"""The plant against closed forms: what makes the test data must itself be right."""

from __future__ import annotations

import numpy as np
import pytest
from plant import (
    Plant,
    PlantController,
    PlantFriction,
    PlantMotor,
    PlantSensor,
    PlantShaft,
    PlantTransmission,
    Trajectory,
    steps_and_multisine,
)
from scipy.integrate import solve_ivp

STEP = 2e-5
ROUNDING = 1e-9
STEP_ERROR = 1e-6
"""Relative error of the second-order step at 2e-5 s on motions slower than 100 rad/s."""

LAWS = {
    "coulomb_viscous": (
        PlantFriction("coulomb_viscous", tau_c=(0.2, 0.3), viscous=(0.01, 0.02)),
        {1: lambda w: 0.2 + 0.01 * w, -1: lambda w: 0.3 + 0.02 * w},
    ),
    "viscous": (PlantFriction("viscous", viscous=0.03), {1: lambda w: 0.03 * w, -1: lambda w: 0.03 * w}),
    "stribeck": (
        PlantFriction("stribeck", tau_c=0.2, tau_s=(0.4, 0.5), omega_s=5.0, delta=0.8, viscous=0.03),
        {
            1: lambda w: 0.2 + 0.2 * np.exp(-((w / 5) ** 0.8)) + 0.03 * w,
            -1: lambda w: 0.2 + 0.3 * np.exp(-((w / 5) ** 0.8)) + 0.03 * w,
        },
    ),
    "polyline": (
        PlantFriction("polyline", tau_c=0.1, slopes=(0.02, 0.004, 0.01), breaks=(5.0, (15.0, 12.0))),
        {1: lambda w: 0.1 + 0.1 + 0.04 + 0.01 * (w - 15), -1: lambda w: 0.1 + 0.1 + 0.028 + 0.01 * (w - 12)},
    ),
    "quadratic": (
        PlantFriction("quadratic", tau_c=0.1, viscous=0.01, quadratic=(0.001, 0.002)),
        {1: lambda w: 0.1 + 0.01 * w + 0.001 * w**2, -1: lambda w: 0.1 + 0.01 * w + 0.002 * w**2},
    ),
}


def one_shaft(friction: PlantFriction, inertia: float = 0.01, **parts) -> Plant:
    """A single shaft driven by torque."""
    return Plant((PlantShaft("axis", inertia, friction),), motors=(PlantMotor("motor", "axis", "torque"),), **parts)


NO_FRICTION = PlantFriction()


def two_masses(friction: PlantFriction = NO_FRICTION, backlash: float = 0.0, damping: float = 0.0) -> Plant:
    """Two inertias of 0.02 and 0.5 kg m^2 with ratio 5 and a spring of 400 N m/rad."""
    return Plant(
        (PlantShaft("motor", 0.02, friction), PlantShaft("load", 0.5)),
        (PlantTransmission("motor", "load", 5.0, 400.0, damping, backlash),),
        (PlantMotor("drive", "motor", "torque"),),
    )


def test_coulomb_friction_stops_exactly() -> None:
    """A coasting shaft decelerates at tau_c / J and then stands still for good."""
    run = one_shaft(PlantFriction("coulomb", tau_c=0.2)).simulate(
        0.5, {"motor.torque": 0.0}, initial={"axis.omega": 5.0}, truth_rate=1000
    )
    time, omega, theta = run.truth["time"], run.truth["axis.omega"], run.truth["axis.theta"]
    assert omega == pytest.approx(np.maximum(5.0 - 20.0 * time, 0.0), abs=ROUNDING)
    assert theta[-1] == pytest.approx(25.0 / 40.0, abs=ROUNDING)
    assert np.all(omega[time > 0.2501] == 0.0) and np.ptp(theta[time > 0.2501]) == 0.0


def test_sticks_below_breakaway() -> None:
    """A torque below tau_s never moves a shaft at rest and is what friction holds; one just above moves it."""
    plant = one_shaft(PlantFriction("stribeck", tau_c=0.2, tau_s=0.3, omega_s=1.0))
    ramp = Trajectory(np.array([0.0, 1.0]), np.array([0.0, -0.4]), "linear")
    truth = plant.simulate(1.0, {"motor.torque": ramp}, truth_rate=1000).truth
    held = truth["time"] < 0.75
    assert np.all(truth["axis.theta"][held] == 0.0) and np.all(truth["axis.omega"][held] == 0.0)
    assert truth["axis.omega"][truth["time"] > 0.752].max() < 0.0
    half_step = 0.5 * STEP * 0.4
    assert truth["axis.friction"][held] == pytest.approx(-0.4 * truth["time"][held], abs=1.01 * half_step)


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("law", LAWS)
def test_steady_speed_lies_on_the_friction_curve(law: str, sign: int) -> None:
    """Under the torque F(w) each static law settles at the speed w, in both directions."""
    friction, curve = LAWS[law]
    plant = one_shaft(friction, inertia=1e-4)
    run = plant.simulate(
        0.6, {"motor.torque": sign * curve[sign](20.0)}, initial={"axis.omega": sign * 19.0}, truth_rate=100
    )
    assert run.truth["axis.omega"][-1] == pytest.approx(sign * 20.0, rel=STEP_ERROR)


def test_viscous_decay_is_exponential() -> None:
    """Viscous friction alone lets the speed fall as exp(-t viscous / J)."""
    plant = one_shaft(PlantFriction("viscous", viscous=0.05))
    truth = plant.simulate(1.0, {"motor.torque": 0.0}, initial={"axis.omega": 3.0}, truth_rate=1000).truth
    assert truth["axis.omega"] == pytest.approx(3.0 * np.exp(-5.0 * truth["time"]), rel=STEP_ERROR)


def test_two_masses_vibrate_at_their_frequency() -> None:
    """Two masses on a spring vibrate at sqrt(k (1 / (ratio^2 J1) + 1 / J2)) without losing energy."""
    rate = np.sqrt(400.0 * (1 / (25 * 0.02) + 1 / 0.5))
    truth = two_masses().simulate(2.0, {"drive.torque": 0.0}, initial={"load.theta": 0.01}, truth_rate=1000).truth
    twist = truth["motor.theta"] / 5.0 - truth["load.theta"]
    phase_error = 1.1 * (rate * STEP) ** 2 / 24 * rate * 2.0
    assert twist == pytest.approx(-0.01 * np.cos(rate * truth["time"]), abs=0.01 * phase_error + ROUNDING)


def test_rigid_joints_add_inertias_across_branches() -> None:
    """Two geared motors rigid on one bull gear accelerate it as one reflected inertia."""
    plant = Plant(
        (PlantShaft("a", 0.01), PlantShaft("b", 0.02), PlantShaft("gear", 3.0)),
        (PlantTransmission("a", "gear", 10.0), PlantTransmission("b", "gear", -20.0)),
        (PlantMotor("ma", "a", "torque"), PlantMotor("mb", "b", "torque")),
    )
    truth = plant.simulate(0.5, {"ma.torque": 0.3, "mb.torque": -0.1}, truth_rate=100).truth
    alpha = (10 * 0.3 + 20 * 0.1) / (3.0 + 100 * 0.01 + 400 * 0.02)
    assert truth["gear.omega"][-1] == pytest.approx(0.5 * alpha, rel=ROUNDING)
    assert truth["b.omega"][-1] == pytest.approx(-10.0 * alpha, rel=ROUNDING)


def test_gravity_conserves_energy() -> None:
    """A frictionless pendulum keeps its energy."""
    plant = Plant((PlantShaft("arm", 0.5, gravity=(4.0, 0.3)),))
    truth = plant.simulate(3.0, initial={"arm.theta": 2.0}, truth_rate=1000).truth
    energy = 0.25 * truth["arm.omega"] ** 2 - 4.0 * np.cos(truth["arm.theta"] + 0.3)
    assert energy == pytest.approx(energy[0], rel=STEP_ERROR)


LUGRE = PlantFriction(
    "lugre", tau_c=(0.1, 0.12), tau_s=0.15, omega_s=2.0, viscous=(0.001, 0.002), sigma0=200.0, sigma1=0.05
)


@pytest.mark.parametrize("speed", [0.5, 3.0, 100.0, -3.0])
def test_lugre_steady_state(speed: float) -> None:
    """At constant speed LuGre friction is g(w) + sigma2 w of that direction."""
    truth = one_shaft(LUGRE).simulate(0.2, {"axis.omega": speed, "motor.torque": 0.0}, truth_rate=1000).truth
    tau_c, sigma2 = (0.1, 0.001) if speed > 0 else (0.12, 0.002)
    level = tau_c + (0.15 - tau_c) * np.exp(-((speed / 2.0) ** 2))
    assert truth["axis.friction"][-1] == pytest.approx(np.sign(speed) * level + sigma2 * speed, rel=STEP_ERROR)


def test_lugre_presliding_is_a_spring() -> None:
    """Slow loading below breakaway moves the shaft by -g / sigma0 log(1 - tau / g), stiffness sigma0 at first."""
    friction = PlantFriction("lugre", tau_c=0.1, sigma0=200.0, sigma1=2.0)
    ramp = Trajectory(np.array([0.0, 2.0]), np.array([0.0, 0.08]), "linear")
    truth = one_shaft(friction).simulate(2.0, {"motor.torque": ramp}, truth_rate=100).truth
    tau = 0.04 * truth["time"]
    inertia_and_damping = 0.04 * 2.0 / 200.0 / 200.0 * 6.0
    assert truth["axis.theta"] == pytest.approx(-0.1 / 200.0 * np.log(1 - tau / 0.1), abs=inertia_and_damping)


def test_dahl_follows_its_closed_form() -> None:
    """Dahl friction depends on travel alone: tau_c (1 - exp(-sigma0 theta / tau_c)) from rest."""
    plant = one_shaft(PlantFriction("dahl", tau_c=0.1, sigma0=50.0))
    sweep = Trajectory(np.linspace(0, 1, 1001), 0.02 * np.linspace(0, 1, 1001) ** 2, "linear")
    truth = plant.simulate(1.0, {"axis.omega": sweep, "motor.torque": 0.0}, truth_rate=1000).truth
    wanted = 0.1 / 50.0 * (1 - np.exp(-50.0 * truth["axis.theta"] / 0.1))
    assert truth["axis.z"] == pytest.approx(wanted, rel=STEP_ERROR, abs=ROUNDING)


def test_gms_yields_element_by_element() -> None:
    """GMS friction rises with the summed stiffness, then with what has not yielded, up to tau_c."""
    plant = one_shaft(PlantFriction("gms", tau_c=0.1, elements=((100.0, 0.5), (20.0, 0.5))))
    truth = plant.simulate(1.0, {"axis.omega": 0.01, "motor.torque": 0.0}, truth_rate=1000).truth
    theta = truth["axis.theta"] - 0.5 * STEP * 0.01
    wanted = np.minimum(100.0 * theta, 0.05) + np.minimum(20.0 * theta, 0.05)
    assert truth["axis.friction"][1:] == pytest.approx(wanted[1:], abs=100.0 * 0.01 * STEP)


def test_two_mass_lugre_agrees_with_an_adaptive_solver() -> None:
    """The fixed step follows a two-mass LuGre drive as an adaptive stiff solver does at 1e-10."""
    friction = PlantFriction("lugre", tau_c=0.1, tau_s=0.15, omega_s=2.0, viscous=0.001, sigma0=200.0, sigma1=0.05)

    def rates(t: float, x: np.ndarray) -> list[float]:
        theta1, theta2, w1, w2, z = x
        g = 0.1 + 0.05 * np.exp(-((w1 / 2.0) ** 2))
        dz = w1 - 200.0 * abs(w1) / g * z
        joint = 400.0 * (theta1 / 5 - theta2) + 0.5 * (w1 / 5 - w2)
        tau = 0.4 * np.sin(2 * np.pi * 2 * t)
        return [w1, w2, (tau - joint / 5 - 200.0 * z - 0.05 * dz - 0.001 * w1) / 0.02, joint / 0.5, dz]

    time = np.linspace(0.0, 1.0, 5001)
    torque = Trajectory(time, 0.4 * np.sin(2 * np.pi * 2 * time), "linear")
    truth = two_masses(friction, damping=0.5).simulate(1.0, {"drive.torque": torque}, truth_rate=100).truth
    wanted = solve_ivp(rates, (0, 1), np.zeros(5), "LSODA", truth["time"], rtol=1e-10, atol=1e-12, max_step=1e-3).y
    bristle_stiffness = 2e-5
    for name, row in zip(("motor.theta", "load.theta", "motor.omega", "load.omega"), wanted, strict=False):
        assert truth[name] == pytest.approx(row, abs=bristle_stiffness * np.abs(row).max()), name


def test_backlash_carries_nothing_inside_the_gap() -> None:
    """Inside the free play the joint is torque-free and over every bounce momentum and energy are kept."""
    plant = two_masses(backlash=0.02)
    truth = plant.simulate(2.0, {"drive.torque": 0.0}, initial={"motor.omega": 1.0}, truth_rate=50000).truth
    twist = truth["motor.theta"] / 5.0 - truth["load.theta"]
    inside = (np.abs(twist[1:]) < 0.01) & (np.abs(twist[:-1]) < 0.01)
    assert np.any(inside) and np.any(~inside)
    assert np.all(truth["motor-load.torque"][1:][inside] == 0.0)
    momentum = 5 * 0.02 * truth["motor.omega"] + 0.5 * truth["load.omega"]
    assert momentum == pytest.approx(0.1, rel=ROUNDING)
    energy = 0.01 * truth["motor.omega"] ** 2 + 0.25 * truth["load.omega"] ** 2
    stored = 200.0 * np.maximum(np.abs(twist) - 0.01, 0.0) ** 2
    impact = 5e-5
    assert energy + stored == pytest.approx(0.01, rel=impact)


def test_contact_never_pulls() -> None:
    """A damped contact pushes only, and takes energy out of every bounce."""
    plant = two_masses(backlash=0.02, damping=4.0)
    truth = plant.simulate(2.0, {"drive.torque": 0.0}, initial={"motor.omega": 3.0}, truth_rate=50000).truth
    twist = truth["motor.theta"] / 5.0 - truth["load.theta"]
    torque = truth["motor-load.torque"]
    assert np.all(torque * twist >= 0.0) and np.any(torque > 0) and np.any(torque < 0)
    relative = np.abs(truth["motor.omega"] / 5.0 - truth["load.omega"])
    assert relative[-1] < 0.5 * relative[0]


def geared_lift(load_coulomb: float) -> Plant:
    """A motor lifting 8 N m through a rigid gear of 4, with friction that grows with the passed torque."""
    friction = PlantFriction("coulomb", tau_c=0.1, load_coulomb=load_coulomb)
    return Plant(
        (PlantShaft("motor", 0.01, friction), PlantShaft("load", 0.4, external_torque=-8.0)),
        (PlantTransmission("motor", "load", 4.0),),
        (PlantMotor("drive", "motor", "torque"),),
    )


def test_load_dependent_friction_holds_a_rigid_load() -> None:
    """At rest the load of T = 2 N m holds between (1 - mu) T - tau_c and (1 + mu) T + tau_c, and moves outside."""
    plant, hold = geared_lift(0.2), (0.8 * 2.0 - 0.1, 1.2 * 2.0 + 0.1)
    margin = 1e-6
    speeds = [
        plant.simulate(0.1, {"drive.torque": tau}, truth_rate=100).truth["motor.omega"][-1]
        for tau in (hold[0] - margin, hold[0] + margin, hold[1] - margin, hold[1] + margin)
    ]
    assert speeds[0] < 0.0 and speeds[1] == 0.0 and speeds[2] == 0.0 and speeds[3] > 0.0


def test_load_dependent_friction_counts_the_inertia_beyond() -> None:
    """In acceleration the passed torque includes the load's inertia: a solves the scalar balance exactly."""
    truth = geared_lift(0.2).simulate(0.1, {"drive.torque": 5.0}, truth_rate=100).truth
    alpha = (5.0 - 0.1 - 1.2 * 2.0) / (0.01 + 1.2 * 0.4 / 16)
    assert truth["motor.omega"][-1] == pytest.approx(0.1 * alpha, rel=ROUNDING)


def test_lugre_grows_with_the_load_of_a_rigid_joint() -> None:
    """A LuGre motor shaft carrying a rigid load turns at the speed where g(w, T) + sigma2 w balances the torque."""
    friction = PlantFriction(
        "lugre", tau_c=0.1, tau_s=0.15, omega_s=2.0, viscous=0.01, sigma0=200.0, load_coulomb=0.2, load_stribeck=0.1
    )
    plant = Plant(
        (PlantShaft("motor", 0.001, friction), PlantShaft("load", 0.004, external_torque=-8.0)),
        (PlantTransmission("motor", "load", 4.0),),
        (PlantMotor("drive", "motor", "torque"),),
    )
    torque = 2.0 + 0.1 + 0.2 * 2.0 + (0.05 + 0.1 * 2.0) * np.exp(-((4.0 / 2.0) ** 2)) + 0.01 * 4.0
    start = {"motor.omega": 4.0, "motor.z": 0.5 / 200.0}
    slow = plant.simulate(0.5, {"motor.omega": 4.0, "drive.torque": 0.0}, initial={"motor.z": 0.0}, truth_rate=100)
    assert slow.truth["motor.friction"][-1] == pytest.approx(torque - 2.0, rel=STEP_ERROR)
    free = plant.simulate(1e-3, {"drive.torque": torque}, initial=start, truth_rate=1000)
    assert free.truth["motor.omega"][-1] == pytest.approx(4.0, rel=1e-2)


def test_load_dependent_friction_of_an_elastic_joint() -> None:
    """With an elastic gear the holding torque is the same as with a rigid one."""
    friction = PlantFriction("stribeck", tau_c=0.1, omega_s=1.0, viscous=0.05, load_coulomb=0.2, load_viscous=0.01)
    plant = Plant(
        (PlantShaft("motor", 0.01, friction), PlantShaft("load", 0.4, external_torque=-8.0)),
        (PlantTransmission("motor", "load", 4.0, 1e4, 50.0),),
        (PlantMotor("drive", "motor", "torque"),),
    )
    torque = 2.0 + 0.1 + 0.2 * 2.0 + (0.05 + 0.01 * 2.0) * 10.0
    start = {"motor.omega": 10.0, "load.omega": 2.5, "motor.theta": 4 * 8e-4}
    truth = plant.simulate(1.0, {"drive.torque": torque}, initial=start, truth_rate=100).truth
    assert truth["motor.omega"][-1] == pytest.approx(10.0, rel=STEP_ERROR)


@pytest.mark.parametrize("inductance", [0.0, 5e-3])
def test_voltage_motor_settles_at_its_no_load_speed(inductance: float) -> None:
    """A voltage-driven motor with Coulomb friction settles at (V - R tau_c / kt) / kt and draws tau_c / kt."""
    motor = PlantMotor("drive", "axis", "voltage", torque_constant=0.1, resistance=2.0, inductance=inductance)
    plant = Plant((PlantShaft("axis", 1e-4, PlantFriction("coulomb", tau_c=0.05)),), motors=(motor,))
    truth = plant.simulate(1.0, {"drive.voltage": 12.0}, truth_rate=100).truth
    assert truth["axis.omega"][-1] == pytest.approx((12.0 - 2.0 * 0.5) / 0.1, rel=STEP_ERROR)
    assert truth["drive.current"][-1] == pytest.approx(0.5, rel=STEP_ERROR)


def test_disabled_motor_coasts() -> None:
    """Without enable a voltage motor neither drives nor brakes."""
    motor = PlantMotor("drive", "axis", "voltage", torque_constant=0.1, resistance=2.0)
    plant = Plant((PlantShaft("axis", 1e-3),), motors=(motor,))
    enable = (np.array([0.0, 0.1]), np.array([1.0, 0.0]))
    truth = plant.simulate(0.3, {"drive.voltage": 12.0, "drive.enable": enable}, truth_rate=100).truth
    assert truth["axis.omega"][10] > 1.0
    assert np.ptp(truth["axis.omega"][10:]) == 0.0 and truth["drive.current"][-1] == 0.0


def test_process_noise_is_white_torque() -> None:
    """The speed of a free inertia gathers the variance density^2 t / J^2."""
    plant = one_shaft(PlantFriction(), sensors=(PlantSensor("speed", "axis.omega", period=0.01),))
    noise = {"axis": 2e-3}
    run = plant.simulate(40.0, {"motor.torque": 0.0}, np.random.default_rng(1), process_noise=noise)
    growth = np.diff(run.channels["speed"][1])
    four_sigma = 4 * np.sqrt(2 / growth.size)
    assert np.var(growth) == pytest.approx((2e-3 / 0.01) ** 2 * 0.01, rel=four_sigma)


@pytest.mark.parametrize("friction", [LAWS["stribeck"][0], LUGRE], ids=["stribeck", "lugre"])
def test_error_falls_with_the_square_of_the_step(friction: PlantFriction) -> None:
    """Halving the step quarters the error of a smooth motion."""
    plant = two_masses(friction, damping=0.5)
    start = {"motor.omega": 10.0, "load.omega": 2.0}

    def end(step: float) -> float:
        truth = plant.simulate(0.08, {"drive.torque": 1.0}, initial=start, step=step, truth_rate=1 / 0.04).truth
        return float(truth["motor.theta"][-1])

    exact, coarse, fine = end(2.5e-6), end(4e-5), end(2e-5)
    assert (coarse - exact) / (fine - exact) == pytest.approx(4.0, rel=0.1)


def test_sensors_apply_gain_offset_delay_and_resolution() -> None:
    """A sensor records gain * true(t - delay) + offset, rounded to its resolution."""
    sensors = (
        PlantSensor("angle", "axis.theta", period=1.3e-3, gain=2.0, offset=0.5, delay=0.0333, resolution=0.01),
        PlantSensor("exact", "axis.theta", delay=0.01),
        PlantSensor("alpha", "axis.alpha", period=2e-3),
        PlantSensor("torque", "motor.torque", period=2e-3),
    )
    ramp = Trajectory(np.array([0.0, 1.0]), np.array([0.0, 0.06]), "linear")
    channels = one_shaft(PlantFriction(), sensors=sensors).simulate(1.0, {"motor.torque": ramp}).channels
    time, angle = channels["angle"]
    true = np.maximum(time - 0.0333, 0.0) ** 3
    assert angle == pytest.approx(2.0 * true + 0.5, abs=0.005 + 1e-6)
    assert angle / 0.01 == pytest.approx(np.round(angle / 0.01), abs=1e-6)
    time, exact = channels["exact"]
    assert exact == pytest.approx(np.maximum(time - 0.01, 0.0) ** 3, abs=3 * STEP**2)
    time, alpha = channels["alpha"]
    assert alpha == pytest.approx(6.0 * time, abs=ROUNDING)
    assert channels["torque"][1] == pytest.approx(0.06 * time, abs=ROUNDING)


def test_sensor_noise_jitter_and_dropout() -> None:
    """Noise has the stated deviation, jittered stamps are the true instants, and lost samples are NaN."""
    sensors = (
        PlantSensor("noisy", "axis.omega", noise_std=0.1, dropout=0.1),
        PlantSensor("jittery", "axis.theta", jitter=2e-4),
        PlantSensor("late", "axis.theta", stamp_error=1e-4),
    )
    plant = one_shaft(PlantFriction(), sensors=sensors)
    run = plant.simulate(10.0, {"motor.torque": 0.0}, np.random.default_rng(2), initial={"axis.omega": 1.0})
    omega = run.channels["noisy"][1]
    assert np.mean(np.isnan(omega)) == pytest.approx(0.1, abs=0.02)
    assert np.nanstd(omega) == pytest.approx(0.1, rel=4 / np.sqrt(2 * omega.size))
    time, theta = run.channels["jittery"]
    assert theta == pytest.approx(time, abs=ROUNDING) and np.std(np.diff(time)) > 1e-4
    time, theta = run.channels["late"]
    assert np.std(theta - time) == pytest.approx(1e-4, rel=0.1) and np.all(np.diff(time) > 0)


def test_a_stepped_input_is_recorded_as_it_was_applied() -> None:
    """Sampled on its own grid a held command is recorded with the value that starts there, and integrates exactly."""
    rng = np.random.default_rng(3)
    current = steps_and_multisine(np.array([0.5, 1.0]), (0.1, 0.3), 0.2, (1.0, 50.0), 2.0, rng)
    sensors = (PlantSensor("current", "drive.current"), PlantSensor("speed", "axis.omega"))
    plant = Plant(
        (PlantShaft("axis", 0.01),), motors=(PlantMotor("drive", "axis", torque_constant=0.3),), sensors=sensors
    )
    channels = plant.simulate(2.0, {"drive.current": current}).channels
    assert channels["current"][1] == pytest.approx(current.value, abs=ROUNDING)
    assert np.diff(channels["speed"][1]) == pytest.approx(0.3 / 0.01 * 1e-3 * current.value[:-1], abs=ROUNDING)


def servo(controller: PlantController, friction: PlantFriction, drive: str = "torque") -> Plant:
    """One shaft with encoder under a controller."""
    motor = PlantMotor("drive", "axis", drive, torque_constant=0.5, resistance=2.0, controller="loop")
    sensors = (PlantSensor("angle", "axis.theta"), PlantSensor("command", f"drive.{drive}", period=1e-4))
    return Plant((PlantShaft("axis", 0.01, friction),), (), (motor,), (controller,), sensors)


def test_pi_velocity_leaves_no_error() -> None:
    """A PI velocity loop turns at the reference speed and its torque equals the friction there."""
    loop = PlantController("loop", "pi_velocity", "angle", kp=0.2, ki=2.0)
    plant = servo(loop, PlantFriction("coulomb_viscous", tau_c=0.1, viscous=0.01))
    run = plant.simulate(5.0, {"reference.omega": 4.0}, truth_rate=100)
    assert run.truth["axis.omega"][-1] == pytest.approx(4.0, rel=STEP_ERROR)
    assert run.channels["command"][1][-1] == pytest.approx(0.14, rel=1e-5)


@pytest.mark.parametrize("anti_windup", [True, False])
def test_cascade_saturates_without_winding_up(anti_windup: bool) -> None:
    """A cascade reaches its reference with a saturated command; only anti-windup spares it the overshoot."""
    loop = PlantController(
        "loop", "cascade", "angle", kp=3.0, kd=0.3, ki=2.0, saturation=(-0.05, 0.05), anti_windup=anti_windup
    )
    plant = servo(loop, PlantFriction("viscous", viscous=0.01))
    run = plant.simulate(6.0, {"reference.theta": 3.0}, truth_rate=100)
    assert np.abs(run.channels["command"][1]).max() == 0.05
    assert (run.truth["axis.theta"].max() < 3.01) == anti_windup
    if anti_windup:
        assert run.truth["axis.theta"][-1] == pytest.approx(3.0, abs=1e-3)


def test_duty_is_clipped_and_applied_late() -> None:
    """A duty controller issues supply * clip(kp error), held between ticks and after the stated delay."""
    loop = PlantController(
        "loop", "duty", "angle", kp=5.0, supply=12.0, saturation=(-0.9, 0.9), sample_time=0.01, delay=0.004
    )
    plant = servo(loop, PlantFriction("viscous", viscous=0.5), "voltage")
    reference = (np.array([0.0, 0.1]), np.array([0.0, 1.0]))
    run = plant.simulate(3.0, {"reference.theta": reference}, truth_rate=100)
    time, voltage = run.channels["command"]
    assert np.all(voltage[time < 0.10395] == 0.0) and voltage[np.searchsorted(time, 0.10405)] == pytest.approx(10.8)
    assert run.truth["axis.theta"][-1] == pytest.approx(1.0, abs=1e-6)


@pytest.mark.parametrize(("derivative", "lag"), [("backward", 0.5), ("two_tap_mean", 1.0)])
def test_pd_differentiates_the_encoder(derivative: str, lag: float) -> None:
    """The difference quotient lags the speed by half the taps, so on a known motion the command is known."""
    loop = PlantController("loop", "pd", "angle", kp=2.0, kd=0.3, derivative=derivative)
    time = np.linspace(0.0, 0.5, 501)
    moved = Trajectory(time, 4.0 * time, "linear")
    run = servo(loop, PlantFriction()).simulate(0.5, {"axis.omega": moved, "reference.theta": 1.0})
    at = np.array([0.1, 0.3])
    wanted = 2.0 * (1.0 - 2.0 * at**2) - 0.3 * 4.0 * (at - lag * 1e-3)
    command = run.channels["command"][1][[1000, 3000]]
    assert command == pytest.approx(wanted, abs=STEP_ERROR)


def test_what_cannot_be_simulated_is_refused() -> None:
    """Unknown inputs, unused parameters, too long steps and missing generators raise with the remedy."""
    with pytest.raises(ValueError, match=r"no input 'motor\.current'"):
        one_shaft(PlantFriction()).simulate(0.1, {"motor.current": 1.0})
    with pytest.raises(ValueError, match="does not use viscous"):
        one_shaft(PlantFriction("coulomb", tau_c=1.0, viscous=1.0)).simulate(0.1, {"motor.torque": 1.0})
    with pytest.raises(ValueError, match="too long"):
        two_masses().simulate(0.1, {"drive.torque": 1.0}, step=2e-2)
    with pytest.raises(ValueError, match="needs rng"):
        one_shaft(PlantFriction()).simulate(0.1, {"motor.torque": 1.0}, process_noise={"axis": 1.0})
