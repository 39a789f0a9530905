"""Drives linearised about an operating point, against the closed forms in which both telescope papers reason."""

from __future__ import annotations

from dataclasses import replace

import aries
import leighton
import numpy as np
import pytest
from plant import Plant, PlantFriction, PlantMotor, PlantShaft, PlantTransmission
from twin import Bench, drive_of

from friction_ocp.drive.linear import linearise, without_friction
from friction_ocp.drive.parts import Channel, Drive
from friction_ocp.plots.bode import bode_figure

ROUNDING = 1e-9
MOTOR = PlantMotor("motor", "axis", "torque")
FREQUENCY = np.geomspace(0.05, 500.0, 60)


def torque_driven(plant: Plant, shaft: str) -> Drive:
    """Return the drive with a torque input on its first motor, and angle and speed of a shaft as outputs."""
    motor = plant.motors[0]
    drive = drive_of(
        replace(plant, sensors=(), motors=(replace(motor, drive="torque", controller=None),), controllers=()),
        {f"{motor.name}.torque": 0.0},
    )
    inputs = tuple(channel for channel in drive.channels if channel.role == "input")
    return replace(drive, channels=(*inputs, Channel("angle", f"{shaft}.theta"), Channel("speed", f"{shaft}.omega")))


def schmidt(direction: int) -> Drive:
    """Return the axis of the Schmidt telescope with the numbers of one direction."""
    numbers = {key: value[direction] for key, value in aries.NUMBERS.items()}
    axis = PlantShaft("axis", aries.INERTIA, PlantFriction("lugre", delta=aries.DELTA, **numbers))
    return torque_driven(Plant((axis,), (), (PlantMotor("motor", "axis", "torque"),)), "axis")


@pytest.mark.parametrize("direction", [0, 1])
def test_presliding_is_the_second_order_system_of_the_paper(direction: int) -> None:
    """Eq. 12: theta / u = 1 / (J s^2 + (sigma1 + sigma2) s + sigma0); eqs. 14, 15 give frequency and damping."""
    sigma0, sigma1, sigma2 = (aries.NUMBERS[key][direction] for key in ("sigma0", "sigma1", "viscous"))
    linear = linearise(schmidt(direction))
    s = 2j * np.pi * FREQUENCY
    wanted = 1.0 / (aries.INERTIA * s**2 + (sigma1 + sigma2) * s + sigma0)
    assert linear.between("motor.torque", "angle", FREQUENCY) == pytest.approx(wanted, rel=ROUNDING)
    (mode,) = {round(item.frequency, 6): item for item in linear.modes}.values()
    natural = np.sqrt(sigma0 / aries.INERTIA)
    assert mode.frequency == pytest.approx(natural / (2.0 * np.pi), rel=ROUNDING)
    assert mode.damping == pytest.approx((sigma1 + sigma2) / (2.0 * natural * aries.INERTIA), rel=ROUNDING)
    assert (mode.frequency, mode.damping) == pytest.approx((69.1, 0.5) if direction == 0 else (63.3, 0.5), rel=0.02)


def test_the_steady_slope_is_that_of_the_stribeck_curve() -> None:
    """At 1.11e-4 rad/s friction falls with -1.75e6 N m s/rad, which at low frequency stands in place of damping."""
    speed, omega_s = 1.11e-4, aries.NUMBERS["omega_s"][0]
    tau_c, tau_s = aries.NUMBERS["tau_c"][0], aries.NUMBERS["tau_s"][0]
    ratio = (speed / omega_s) ** aries.DELTA
    slope = -(tau_s - tau_c) * np.exp(-ratio) * ratio * aries.DELTA / speed + aries.NUMBERS["viscous"][0]
    assert slope == pytest.approx(-1.75e6, rel=0.02)
    linear = linearise(schmidt(0), speed)
    slowly = linear.between("motor.torque", "speed", np.array([1e-6]))[0]
    assert slowly == pytest.approx(1.0 / slope, rel=1e-4)
    assert max(linear.poles.real) > 0.0
    assert max(linearise(schmidt(0), 3.9e-2).poles.real) < 1e-6


def test_the_typical_shaft_of_the_leighton_telescope() -> None:
    """Eqs. 3, 4 (Fig. 8): two inertias, each with the slope of its friction, on a spring behind the ratio."""
    plant = leighton.lumped(leighton.fast_polyline(), leighton.slow_friction())
    s = 2j * np.pi * FREQUENCY
    n, k = leighton.RATIO, leighton.STIFFNESS
    for speed, slope in ((50.0, 0.0039), (200.0, 0.0001)):
        linear = linearise(torque_driven(plant, "load"), speed)
        motor = leighton.MOTOR_INERTIA * s**2 + slope * s
        load = 0.5 * leighton.LOAD_INERTIA * s**2 + n**2 * 0.0003 * s
        wanted = k / n / ((motor + k / n**2) * (load + k) - (k / n) ** 2)
        assert linear.between("motor.torque", "angle", FREQUENCY) == pytest.approx(wanted, rel=1e-7)


def test_a_stopped_motor_leaves_the_load_on_its_spring() -> None:
    """With the motor's speed prescribed the one mode is that of the stop response, 6.24 Hz."""
    plant = replace(leighton.lumped(leighton.fast_polyline(), leighton.slow_friction()), motors=())
    inertia, viscous = 0.5 * leighton.LOAD_INERTIA, leighton.RATIO**2 * 0.0003
    linear = linearise(drive_of(plant, {"motor.omega": 0.0}), at={"load.omega": 1e-3})
    (mode,) = linear.modes
    assert mode.frequency == pytest.approx(np.sqrt(leighton.STIFFNESS / inertia) / (2.0 * np.pi), rel=ROUNDING)
    assert mode.frequency == pytest.approx(6.24, abs=0.01)
    assert mode.damping == pytest.approx(0.5 * viscous / np.sqrt(leighton.STIFFNESS * inertia), rel=ROUNDING)


def test_the_state_space_steps_as_the_drive_does() -> None:
    """A small step on the presliding drive is that of the scipy object made of its linear form."""
    drive = schmidt(0)
    linear = linearise(drive)
    time = np.arange(0.0, 0.1, 1e-3)
    from friction_ocp.drive.linear import signal

    _, wanted = signal.step(linear.state_space(), T=time)
    run = Bench(drive).run(0.099, {"motor.torque": 1.0}, {}, step=2e-5)
    assert run["angle"] == pytest.approx(np.asarray(wanted)[:, 0], abs=2e-3 * np.max(wanted))


def test_friction_that_grows_with_load_is_linearised_about_its_torque() -> None:
    """Through a rigid gear the torque that loads the friction is solved for at the operating point."""
    loaded = PlantFriction("coulomb_viscous", 0.02, viscous=0.003, load_viscous=0.01)
    shafts = (PlantShaft("a", 0.01, loaded), PlantShaft("b", 0.2, PlantFriction("coulomb_viscous", 0.5, viscous=0.1)))
    plant = Plant(shafts, (PlantTransmission("a", "b", 5.0),), (PlantMotor("m", "a", "torque"),))
    linear = linearise(torque_driven(plant, "a"), 30.0)
    torque = linear.at["a-b.torque"]
    assert torque != 0.0
    difference = 1e-4

    def acceleration(speed: float) -> float:
        from twin import drive_of as twin_of

        run = Bench(twin_of(plant, {"m.torque": 0.0})).run(1e-6, {"m.torque": 0.0}, {"a.omega": speed}, 1e-6, 1e-6)
        return float(run["a.omega"][-1] - run["a.omega"][0]) / 1e-6

    slope = (acceleration(30.0 + difference) - acceleration(30.0 - difference)) / (2.0 * difference)
    (mode,) = linear.modes
    assert mode.pole.real == pytest.approx(slope, rel=1e-3)


@pytest.mark.parametrize("speed", [0.0, 1e-6, 2.0])
def test_drag_alone_damps_at_standstill_as_it_does_in_motion(speed: float) -> None:
    """Without dry friction a rest is nothing special: the pole is - b / J at every speed."""
    plant = Plant((PlantShaft("axis", 0.01, PlantFriction("viscous", viscous=0.02)),), (), (MOTOR,))
    assert sorted(linearise(torque_driven(plant, "axis"), speed).poles.real) == pytest.approx([-2.0, 0.0], abs=1e-6)


def test_a_bode_picture_shows_what_friction_does() -> None:
    """Two lines, with and without friction: at low frequency friction carries the torque, at high frequency nothing."""
    drive = torque_driven(leighton.lumped(leighton.fast_polyline(), leighton.slow_friction()), "load")
    both = {
        "with friction": linearise(drive, 200.0).between("motor.torque", "speed", FREQUENCY),
        "without": linearise(without_friction(drive), 200.0).between("motor.torque", "speed", FREQUENCY),
    }
    figure = bode_figure(FREQUENCY, both, "Load speed over motor torque", "rad/s per N m")
    assert [len(axes.lines) for axes in figure.axes] == [2, 2]
    ratio = np.abs(both["with friction"] / both["without"])
    assert ratio[0] < 0.9 and ratio[-1] == pytest.approx(1.0, rel=1e-3)
