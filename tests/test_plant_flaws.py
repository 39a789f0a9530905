"""Imperfections of the plant against closed forms and balances of energy."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from plant import (
    Plant,
    PlantAmplifier,
    PlantEndStop,
    PlantFriction,
    PlantFrictionMemory,
    PlantLoop,
    PlantMotor,
    PlantRipple,
    PlantSaturation,
    PlantSensor,
    PlantShaft,
    PlantTransmission,
    PlantWarmUp,
    Trajectory,
)

STEP = 2e-5
ROUNDING = 1e-9
STEP_ERROR = 1e-6
"""Relative error of the second-order step at 2e-5 s on motions slower than 100 rad/s."""
RIPPLE = PlantRipple(0.5, (0.1, -0.04, 0.02), (0.06, 0.03))
DRY = PlantFriction("coulomb_viscous", tau_c=0.2, viscous=0.01)


def ripple(x: np.ndarray) -> np.ndarray:
    """Return RIPPLE at x."""
    w = 2 * np.pi / 0.5 * np.asarray(x)
    low = 0.1 * np.cos(w) + 0.06 * np.sin(w)
    return low - 0.04 * np.cos(2 * w) + 0.03 * np.sin(2 * w) + 0.02 * np.cos(3 * w)


def ripple_integral(x: np.ndarray) -> np.ndarray:
    """Return an integral of RIPPLE."""
    k = 2 * np.pi / 0.5
    low = (0.1 * np.sin(k * x) - 0.06 * np.cos(k * x)) / k
    return low + (-0.04 * np.sin(2 * k * x) - 0.03 * np.cos(2 * k * x)) / (2 * k) + 0.02 * np.sin(3 * k * x) / (3 * k)


def axis(motor: PlantMotor | None = None, *sensors: PlantSensor, **shaft) -> Plant:
    """One shaft of 0.01 kg m^2 under a torque, or the stated motor."""
    drive = motor or PlantMotor("drive", "axis", "torque")
    return Plant((PlantShaft("axis", 0.01, **shaft),), motors=(drive,), sensors=sensors)


def turned(plant: Plant, speed: float | Trajectory, duration: float = 1.0, **inputs) -> dict[str, np.ndarray]:
    """Return the truth while the axis is turned at a prescribed speed."""
    command = {f"drive.{plant.motors[0].drive}": 0.0} | {f"axis.{key}": value for key, value in inputs.items()}
    return plant.simulate(duration, {"axis.omega": speed, **command}, truth_rate=1000).truth


def two_masses(**joint) -> Plant:
    """Two inertias of 0.02 and 0.5 kg m^2 with ratio 5 and a spring of 400 N m/rad."""
    return Plant(
        (PlantShaft("motor", 0.02), PlantShaft("load", 0.5)),
        (PlantTransmission("motor", "load", 5.0, 400.0, **joint),),
        (PlantMotor("drive", "motor", "torque"),),
    )


def twisted(joint: dict, speed: Trajectory, duration: float) -> tuple[np.ndarray, np.ndarray]:
    """Return twist and torque of a joint whose output stands still."""
    inputs = {"motor.omega": speed, "load.omega": 0.0, "drive.torque": 0.0}
    truth = two_masses(**joint).simulate(duration, inputs, truth_rate=1000).truth
    return truth["motor.theta"] / 5.0, truth["motor-load.torque"]


def test_cogging_conserves_energy() -> None:
    """Cogging of several harmonics is a potential: what the speed loses comes back within a period."""
    plant = axis(PlantMotor("drive", "axis", "torque", cogging=RIPPLE))
    truth = plant.simulate(1.0, {"drive.torque": 0.0}, initial={"axis.omega": 3.0}, truth_rate=1000).truth
    energy = 0.005 * truth["axis.omega"] ** 2 - ripple_integral(truth["axis.theta"])
    assert energy == pytest.approx(energy[0], abs=10 * STEP_ERROR * 0.045)
    assert np.ptp(truth["axis.omega"]) > 0.1


def test_torque_ripple_is_proportional_to_the_current() -> None:
    """At 2 A and 4 A the torque is kt i (1 + ripple(theta)); the current itself does not ripple."""
    motor = PlantMotor("drive", "axis", torque_constant=0.3, torque_ripple=RIPPLE)
    sensors = [PlantSensor(name, f"drive.{name}") for name in ("torque", "current")]
    plant = axis(motor, *sensors)
    for current in (2.0, 4.0):
        run = plant.simulate(1.0, {"axis.omega": 1.0, "drive.current": current}, truth_rate=1000)
        theta = run.channels["torque"][0]
        assert run.channels["torque"][1] == pytest.approx(0.3 * current * (1 + ripple(theta)), abs=30 * STEP)
        assert np.all(run.channels["current"][1] == current)


def test_a_rippling_voltage_motor_converts_all_its_power() -> None:
    """Electrical power that is not lost in the winding is mechanical, ripple or not."""
    motor = PlantMotor("drive", "axis", "voltage", 0.1, resistance=2.0, torque_ripple=RIPPLE)
    seen = [PlantSensor(name, f"drive.{name}") for name in ("torque", "current", "voltage")]
    plant = axis(motor, *seen, PlantSensor("omega", "axis.omega"), friction=DRY)
    channels = plant.simulate(1.0, {"drive.voltage": 9.0}).channels
    torque, current, voltage, omega = (channels[name][1] for name in ("torque", "current", "voltage", "omega"))
    assert torque * omega == pytest.approx(voltage * current - 2.0 * current**2, abs=1e-3)
    assert np.ptp(torque) > 0.01


def test_friction_ripples_over_the_angle() -> None:
    """Dry friction follows 1 + ripple(theta), viscous friction its own ripple."""
    other = PlantRipple(0.5, 0.3)
    truth = turned(axis(friction=DRY, ripple=RIPPLE, viscous_ripple=other), 2.0)
    theta = truth["axis.theta"][1:] - 0.5 * STEP * 2.0
    wet = 0.02 * (1 + 0.3 * np.cos(4 * np.pi * theta))
    assert truth["axis.friction"][1:] == pytest.approx(0.2 * (1 + ripple(theta)) + wet, abs=STEP_ERROR)


def test_warm_up_by_time_is_exponential() -> None:
    """Dry friction falls by 40 % and viscous friction by 60 % along 1 - exp(-t / T), from any initial warmth."""
    plant = axis(friction=DRY, warm_up=PlantWarmUp(0.4, dry=-0.4, viscous=-0.6))
    inputs = {"axis.omega": 2.0, "drive.torque": 0.0}
    truth = plant.simulate(1.0, inputs, initial={"axis.warmth": 0.25}, truth_rate=1000).truth
    warmth = 1 - 0.75 * np.exp(-truth["time"][1:] / 0.4)
    wanted = 0.2 * (1 - 0.4 * warmth) + 0.02 * (1 - 0.6 * warmth)
    assert truth["axis.friction"][1:] == pytest.approx(wanted, abs=STEP * 0.1 / 0.4)


def test_warm_up_by_friction_power_settles_at_the_balance() -> None:
    """Heat in balance: W P0 = tau_c (1 - 0.4 W) w."""
    coulomb = PlantFriction("coulomb", tau_c=0.2)
    plant = axis(friction=coulomb, warm_up=PlantWarmUp(0.05, dry=-0.4, power=0.5))
    warmth = 0.2 * 3.0 / (0.5 + 0.4 * 0.2 * 3.0)
    assert turned(plant, 3.0)["axis.friction"][-1] == pytest.approx(0.2 * (1 - 0.4 * warmth), rel=STEP_ERROR)


def test_a_standing_axis_does_not_heat() -> None:
    """Friction that only holds loses no power."""
    plant = axis(friction=DRY, warm_up=PlantWarmUp(0.05, dry=-0.4, power=0.5))
    truth = plant.simulate(1.0, {"drive.torque": 0.19}, truth_rate=100).truth
    assert np.all(truth["axis.omega"] == 0.0)


def test_friction_remembers_acceleration() -> None:
    """Under constant acceleration dry friction grows by share tanh(a / scale), under deceleration it shrinks so."""
    plant = axis(friction=DRY, memory=PlantFrictionMemory(0.3, 20.0, 0.005))
    speed = Trajectory(np.array([0.0, 0.5, 1.0]), np.array([1.0, 6.0, 1.0]), "linear")
    truth = turned(plant, speed)
    dry = truth["axis.friction"] - 0.01 * truth["axis.omega"]
    assert dry[[400, 900]] == pytest.approx(0.2 * (1 + 0.3 * np.tanh(0.5) * np.array([1, -1])), abs=STEP)


def test_friction_follows_its_inputs() -> None:
    """A factor scales all friction, added dry friction comes on top and holds an axis without any of its own."""
    factor = Trajectory(np.array([0.0, 0.5]), np.array([1.0, 1.5]))
    truth = turned(axis(friction=DRY), 2.0, friction_factor=factor, added_coulomb=0.1)
    assert truth["axis.friction"][[400, 900]] == pytest.approx([0.32, 0.43], rel=ROUNDING)
    stick = Trajectory(np.array([0.0, 0.3]), np.array([0.0, 1.0]))
    run = axis().simulate(1.0, {"drive.torque": 0.1, "axis.added_coulomb": stick}, truth_rate=1000)
    omega = run.truth["axis.omega"]
    assert omega[300] == pytest.approx(3.0, rel=ROUNDING) and np.all(omega[340:] == 0.0)


def test_a_disturbance_shakes_a_free_inertia() -> None:
    """The speed of a free inertia is the integral of the disturbance over J."""
    truth = axis(disturbance=RIPPLE).simulate(1.0, {"drive.torque": 0.0}, truth_rate=1000).truth
    wanted = (ripple_integral(truth["time"]) - ripple_integral(np.zeros(1))) / 0.01
    assert truth["axis.omega"] == pytest.approx(wanted, abs=STEP_ERROR)


def test_an_end_stop_returns_what_it_takes() -> None:
    """A bumper of stiffness k holds a free inertia for half a period, pi sqrt(J / k), and sends it back as fast."""
    plant = axis(end_stop=PlantEndStop(-0.5, 0.5, 100.0))
    truth = plant.simulate(1.0, {"drive.torque": 0.0}, initial={"axis.omega": 2.0}, truth_rate=20000).truth
    omega, theta = truth["axis.omega"], truth["axis.theta"]
    assert np.mean(theta > 0.5) == pytest.approx(np.pi * np.sqrt(0.01 / 100.0), abs=1e-4)
    assert theta.max() == pytest.approx(0.5 + 2.0 * np.sqrt(0.01 / 100.0), rel=1e-4)
    after = (theta > -0.5) & (theta < 0.5) & (truth["time"] > 0.3)
    assert np.abs(omega[after]) == pytest.approx(2.0, rel=1e-3) and omega[after].min() < 0 < omega[after].max()


def test_a_damped_end_stop_takes_energy_and_never_pulls() -> None:
    """A damped bumper returns less, and an inertia that leaves it is not held."""
    plant = axis(end_stop=PlantEndStop(-0.5, 0.5, 100.0, 1.0))
    truth = plant.simulate(0.5, {"drive.torque": 0.0}, initial={"axis.omega": 2.0}, truth_rate=20000).truth
    assert -2.0 < truth["axis.omega"][-1] < -0.2
    assert np.all(np.diff(truth["axis.omega"]) <= 0.0)


@pytest.mark.parametrize("joint", [{"cubic": 4e6}, {"second_stage": (600.0, 0.004)}], ids=["cubic", "second_stage"])
def test_a_stiffening_joint_keeps_energy(joint: dict) -> None:
    """The stored energy of the stiffening spring comes back."""
    truth = two_masses(**joint).simulate(1.0, {"drive.torque": 0.0}, initial={"motor.theta": 0.05}, truth_rate=1000)
    truth = truth.truth
    x = truth["motor.theta"] / 5.0 - truth["load.theta"]
    stored = 200.0 * x**2 + joint.get("cubic", 0.0) * x**4 / 4
    if "second_stage" in joint:
        stored += 300.0 * np.maximum(np.abs(x) - 0.004, 0.0) ** 2
    energy = 0.01 * truth["motor.omega"] ** 2 + 0.25 * truth["load.omega"] ** 2 + stored
    assert energy == pytest.approx(energy[0], rel=1e-4)
    assert stored[0] > 1.2 * 200.0 * x[0] ** 2


UP_DOWN = Trajectory(np.array([0.0, 0.5, 1.5]), np.array([0.1, -0.1, 0.0]))


def test_stiffening_is_what_it_says() -> None:
    """Slowly twisted, a joint carries k x + cubic x^3."""
    twist, torque = twisted({"cubic": 4e6}, UP_DOWN, 0.5)
    assert torque == pytest.approx(400.0 * twist + 4e6 * twist**3, abs=400.0 * 0.02 * STEP * 4)


def test_a_sharp_loop_follows_masing() -> None:
    """Jenkins elements load up to their torque and unload over twice the range."""
    twist, torque = twisted({"loop": PlantLoop(((0.5, 0.002), (0.3, 0.005)))}, UP_DOWN, 1.5)
    extra = torque - 400.0 * twist
    up = np.arange(twist.size) <= 500
    loading = 0.5 * np.minimum(twist / 0.002, 1) + 0.3 * np.minimum(twist / 0.005, 1)
    way = 0.01 - twist
    falling = 0.5 * (1 - np.minimum(way / 0.002, 2)) + 0.3 * (1 - np.minimum(way / 0.005, 2))
    late = (400.0 + 250.0 + 60.0) * 0.02 * STEP
    assert extra[up] == pytest.approx(loading[up], abs=late)
    assert extra[~up] == pytest.approx(falling[~up], abs=late)


def test_a_smooth_loop_is_exponential() -> None:
    """A smooth element approaches its torque as 1 - exp(-x / twist), and from there the other way."""
    twist, torque = twisted({"loop": PlantLoop(((0.5, 0.002),), smooth=True)}, UP_DOWN, 1.5)
    extra, up = torque - 400.0 * twist, np.arange(twist.size) <= 500
    top = 1 - np.exp(-0.01 / 0.002)
    wanted = np.where(up, 1 - np.exp(-twist / 0.002), -1 + (1 + top) * np.exp(-(0.01 - twist) / 0.002))
    assert extra == pytest.approx(0.5 * wanted, abs=(400.0 + 250.0) * 0.02 * STEP)


@pytest.mark.parametrize("over", ["input", "output"])
def test_a_kinematic_error_does_no_work(over: str) -> None:
    """Two masses joined through a rippling ratio keep their energy, and the load follows the error."""
    error = PlantRipple(0.8, (2e-3, 5e-4), 1e-3)
    plant = two_masses(kinematic_error=error, error_over=over)
    start = {"motor.omega": 4.0, "load.omega": 0.8, "load.theta": 2.5e-3}
    truth = plant.simulate(2.0, {"drive.torque": 0.0}, initial=start, truth_rate=1000).truth
    w = 2 * np.pi / 0.8 * (truth["motor.theta"] if over == "input" else truth["load.theta"])
    ripples = 2e-3 * np.cos(w) + 5e-4 * np.cos(2 * w) + 1e-3 * np.sin(w)
    x = truth["motor.theta"] / 5.0 + ripples - truth["load.theta"]
    energy = 0.01 * truth["motor.omega"] ** 2 + 0.25 * truth["load.omega"] ** 2 + 200.0 * x**2
    assert energy == pytest.approx(energy[0], rel=1e-5)
    assert np.ptp(truth["motor.theta"] / 5.0 - truth["load.theta"]) > 2e-3


def test_an_amplifier_is_late() -> None:
    """A step of the command arrives after the delay and then as 1 - exp(-t / T); the command itself is not late."""
    amplifier = PlantAmplifier(delay=0.02, time_constant=0.01)
    motor = PlantMotor("drive", "axis", torque_constant=0.3, amplifier=amplifier)
    sensors = [PlantSensor(name, f"drive.{name}") for name in ("current", "command", "torque")]
    command = Trajectory(np.array([0.0, 0.1]), np.array([0.0, 2.0]))
    channels = axis(motor, *sensors).simulate(0.3, {"drive.current": command}).channels
    time, current = channels["current"]
    assert current == pytest.approx(2.0 * -np.expm1(-np.maximum(time - 0.12, 0.0) / 0.01), abs=ROUNDING)
    assert channels["command"][1] == pytest.approx(command.at(time), abs=ROUNDING)
    assert channels["torque"][1] == pytest.approx(0.3 * current, abs=ROUNDING)


def test_a_slow_amplifier_makes_ramps() -> None:
    """A rate limit turns a step into a ramp that ends at the step."""
    motor = PlantMotor("drive", "axis", amplifier=PlantAmplifier(rate_limit=20.0))
    command = Trajectory(np.array([0.0, 0.1]), np.array([0.0, 2.0]))
    run = axis(motor, PlantSensor("current", "drive.current")).simulate(0.3, {"drive.current": command})
    time, current = run.channels["current"]
    assert current == pytest.approx(np.clip(20.0 * (time - 0.1), 0.0, 2.0), abs=ROUNDING)


@pytest.mark.parametrize("hold", ["linear", "zero"])
def test_iron_keeps_some_torque(hold: str) -> None:
    """On the way up the torque lacks, on the way down it exceeds, share times width of the hysteresis."""
    amplifier = PlantAmplifier(hysteresis_share=0.1, hysteresis_width=0.5)
    motor = PlantMotor("drive", "axis", torque_constant=0.3, amplifier=amplifier)
    grid = np.linspace(0.0, 1.0, 101)
    command = Trajectory(grid, 4.0 * np.minimum(grid, 1.0 - grid), hold)
    plant = axis(motor, PlantSensor("torque", "drive.torque"))
    time, torque = plant.simulate(1.0, {"drive.current": command}).channels["torque"]
    current = command.at(time)
    lost = np.where(time < 0.5, np.minimum(current, 0.5), np.maximum(current - 1.5, -0.5))
    assert torque == pytest.approx(0.3 * (current - 0.1 * lost), abs=ROUNDING)


@pytest.mark.parametrize(
    ("form", "wanted"),
    [
        ("tanh", lambda i: 3.0 * np.tanh(i / 3.0)),
        ("algebraic", lambda i: i / np.cbrt(1 + np.abs(i / 3.0) ** 3)),
        ("cubic", lambda i: np.clip(i, -3, 3) - np.clip(i, -3, 3) ** 3 / 27.0),
    ],
)
def test_saturation_bends_the_torque(form: str, wanted) -> None:
    """Torque per ampere falls with the current as stated, alike in both directions."""
    motor = PlantMotor("drive", "axis", torque_constant=0.3, saturation=PlantSaturation(3.0, form, 3.0))
    command = Trajectory(np.array([0.0, 1.0]), np.array([-6.0, 6.0]), "linear")
    plant = axis(motor, PlantSensor("torque", "drive.torque"))
    time, torque = plant.simulate(1.0, {"drive.current": command}).channels["torque"]
    assert torque == pytest.approx(0.3 * wanted(command.at(time)), abs=ROUNDING)


def test_an_eccentric_encoder_ripples_once_a_turn() -> None:
    """The angle reads true + ripple(true), the speed is its derivative; the sensor's gain comes after."""
    wobble = PlantRipple(2 * np.pi, 0.02, -0.01)
    sensors = (
        PlantSensor("angle", "axis.theta", eccentricity=wobble, gain=2.0),
        PlantSensor("speed", "axis.omega", eccentricity=wobble),
        PlantSensor("free", "axis.theta"),
    )
    channels = axis(None, *sensors).simulate(1.0, {"axis.omega": 9.0, "drive.torque": 0.0}).channels
    time, angle = channels["angle"]
    theta = 9.0 * time
    assert channels["free"][1] == pytest.approx(theta, abs=ROUNDING)
    assert angle == pytest.approx(2.0 * (theta + 0.02 * np.cos(theta) - 0.01 * np.sin(theta)), abs=ROUNDING)
    slope = 1 - 0.02 * np.sin(theta) - 0.01 * np.cos(theta)
    assert channels["speed"][1] == pytest.approx(9.0 * slope, abs=9.0 * 0.025 * 9.0 * STEP)


def test_what_needs_a_spring_is_refused_in_a_rigid_joint() -> None:
    """Stiffening, loops and kinematic errors of a rigid joint raise; so does a bumper too hard for the step."""
    part = PlantTransmission("motor", "load", 5.0)
    for flaw in ({"cubic": 1.0}, {"loop": PlantLoop(((1.0, 0.1),))}, {"kinematic_error": RIPPLE}):
        plant = replace(two_masses(), transmissions=(replace(part, **flaw),))
        with pytest.raises(ValueError, match="finite stiffness"):
            plant.simulate(0.1, {"drive.torque": 0.0})
    with pytest.raises(ValueError, match="too long for a bumper"):
        axis(end_stop=PlantEndStop(0.0, 1.0, 1e8)).simulate(0.1, {"drive.torque": 0.0})
