"""Two motors on one bull gear, and the one chain on half of it that stands for them; a motor that is stopped."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from leighton import (
    FAST_STIFFNESS,
    LOAD_INERTIA,
    MOTOR_INERTIA,
    RATIO,
    SLEW,
    STIFFNESS,
    TORQUE_CONSTANT,
    fast_linear,
    fast_polyline,
    lumped,
    slow_friction,
    slow_polyline,
    stop,
)
from plant import Plant, PlantAmplifier, PlantFriction, PlantMotor, PlantShaft, PlantTransmission, Trajectory
from twin import Bench, Run, Twin, drive_of, worst

from friction_ocp.drive.parts import Drive

ROUNDING = 1e-9
STOPS = 4e-3
"""Relative error of steps of 1 ms where the load comes to rest within one, on a joint of 39 rad/s."""

ACCELEROMETER_NOISE = 4e-3
"""rad/s^2."""
TURNING = {"load.omega": SLEW / RATIO}


def two_chains(backlash: float = 0.0) -> Plant:
    """Return both motors on the whole structure; friction of the gear twice that of one chain."""
    shafts = (
        PlantShaft("east", MOTOR_INERTIA, fast_polyline()),
        PlantShaft("west", MOTOR_INERTIA, fast_polyline()),
        PlantShaft("load", LOAD_INERTIA, slow_friction(chains=2)),
    )
    joints = tuple(PlantTransmission(side, "load", RATIO, STIFFNESS, 0.0, backlash) for side in ("east", "west"))
    motors = tuple(PlantMotor(side, side, "current", TORQUE_CONSTANT) for side in ("east", "west"))
    return Plant(shafts, joints, motors)


def run_of(plant: Plant, inputs: dict[str, Trajectory | float], duration: float, initial: dict[str, float]) -> Run:
    drive: Drive = drive_of(plant, inputs)
    return Bench(drive).run(duration, inputs, initial)


def turning(*motors: str) -> dict[str, float]:
    """Return the start at full speed, the springs not stretched."""
    return {f"{name}.omega": SLEW for name in motors} | {"load.omega": SLEW / RATIO}


def test_two_chains_and_one_on_half_the_load_stop_alike() -> None:
    """Stopped together, both motors leave the load the motion that one chain gives to half of it (eq. 13, Fig. 10a)."""
    profile = stop(1.0, 4.0)
    start = {"load.omega": SLEW / RATIO}
    whole = run_of(two_chains(), {"east.omega": profile, "west.omega": profile}, 4.0, start)
    half = run_of(lumped(fast_polyline(), slow_friction()), {"motor.omega": profile}, 4.0, start)
    for signal in ("load.theta", "load.omega"):
        assert whole[signal] == pytest.approx(half[signal], abs=ROUNDING * np.max(np.abs(half[signal])))


def test_equal_currents_make_them_agree_and_unequal_ones_only_the_load() -> None:
    """A bias between the motors winds the springs against each other; the load moves as under the mean current."""
    swing = Trajectory(np.array([0.0, 1.0, 2.0, 4.0]), np.array([0.0, 2.5, -2.5, 1.0]), "linear")
    half = run_of(lumped(fast_polyline(), slow_friction()), {"motor.current": swing}, 4.0, {})
    both = run_of(two_chains(), {"east.current": swing, "west.current": swing}, 4.0, {})
    for signal in ("load.theta", "load.omega"):
        assert both[signal] == pytest.approx(half[signal], abs=ROUNDING * np.max(np.abs(half[signal])))
    sides = {
        name: Trajectory(swing.time, swing.value + bias, "linear") for name, bias in (("east", 0.2), ("west", -0.2))
    }
    biased = run_of(two_chains(), {f"{name}.current": side for name, side in sides.items()}, 4.0, {})
    moving = np.abs(half["load.omega"]) > 0.2 * np.max(np.abs(half["load.omega"]))
    deviation = np.abs(biased["load.omega"] - half["load.omega"])[moving]
    between_breaks = 0.05
    assert np.max(deviation) < between_breaks * np.max(np.abs(half["load.omega"]))
    assert np.max(np.abs(biased["east.theta"] - biased["west.theta"])) > 0.0


@pytest.mark.parametrize(("bias", "taken_up"), [(2.5, True), (0.0, False)])
def test_a_bias_takes_up_the_backlash(bias: float, taken_up: bool) -> None:
    """With the motors pulled apart the load reverses without a dead zone; without a bias it waits in the play."""
    backlash = 4e-5
    swing = Trajectory(np.array([0.0, 2.0, 4.0]), np.array([1.0, 1.0, -1.0]), "linear")

    def reversal(play: float) -> np.ndarray:
        sides = {"east.current": bias, "west.current": -bias}
        inputs = {name: Trajectory(swing.time, swing.value + shift, "linear") for name, shift in sides.items()}
        return run_of(two_chains(play), inputs, 4.0, {})["load.theta"]

    tight, loose = reversal(0.0), reversal(backlash)
    drift = np.ptp((loose - tight)[2000:])
    assert (drift < 0.1 * backlash) == taken_up


def test_one_of_two_motors_acts_late() -> None:
    """Its chain follows 12 ms after its command, with a lag of 5 ms; the other one at once."""
    plant, late = two_chains(), PlantAmplifier(delay=12e-3, time_constant=5e-3)
    east, west = plant.motors
    time = np.linspace(0.0, 2.0, 2001)
    swings = (2.0 * np.sin(2.0 * np.pi * time), np.sin(6.0 * np.pi * time))
    inputs = {
        f"{side}.current": Trajectory(time, swing, "linear")
        for side, swing in zip(("east", "west"), swings, strict=True)
    }
    seen = [f"{shaft.name}.{signal}" for shaft in plant.shafts for signal in ("theta", "omega")]
    truth, ours = Twin(replace(plant, motors=(east, replace(west, amplifier=late))), inputs).run(2.0)
    lagging = replace(west, amplifier=replace(late, delay=0.0))
    _, prompt = Twin(replace(plant, motors=(east, lagging)), inputs).run(2.0)
    assert worst(truth, ours, *seen) < 1e-4 < 1e-2 * worst(truth, prompt, *seen)


def test_the_stepped_drive_follows_the_plant_through_a_stop() -> None:
    """A motor stopped kinematically within 10 ms leaves the load ringing at 6.2 Hz, until it sticks."""
    plant = replace(lumped(fast_polyline(), slow_friction()), motors=())
    twin = Twin(plant, {"motor.omega": stop(0.5, 4.0)})
    truth, run = twin.run(4.0, {"load.omega": SLEW / RATIO})
    assert worst(truth, run, "load.omega") < STOPS
    ringing = run["load.omega"][520:1800]
    crossings = np.flatnonzero(np.diff(np.sign(ringing)) != 0)
    frequency = 0.5 / (1e-3 * np.mean(np.diff(crossings)))
    assert frequency == pytest.approx(np.sqrt(2.0 * STIFFNESS / LOAD_INERTIA) / (2.0 * np.pi), rel=0.02)
    assert frequency == pytest.approx(6.24, abs=0.1)


def ringing(plant: Plant, profile: Trajectory, begin: float, end: float, initial: dict[str, float]) -> float:
    """Return for how long after `begin` the load's acceleration leaves 4e-3 rad/s^2, the accelerometer's noise, s."""
    run = run_of(plant, {"motor.omega": profile}, end, initial)
    acceleration = np.gradient(run["load.omega"], 1e-3)
    heard = run.time[(run.time > begin) & (np.abs(acceleration) > ACCELEROMETER_NOISE)]
    return float(heard[-1] - begin)


def stopped(fast: PlantFriction, slow: PlantFriction) -> float:
    """Return for how long the load rings after a stop from full speed, s."""
    return ringing(replace(lumped(fast, slow), motors=()), stop(0.5, 6.0), 0.5, 6.0, TURNING)


def test_with_the_break_in_the_fast_part_the_load_rings_for_two_seconds() -> None:
    """Table 2: at c0h = 0.11, R c1l = 0.0003 for about the 2 s that were measured; longer the less friction is slow."""

    def cell(c0h: float, slow_viscous: float) -> float:
        fast = fast_polyline(c0h, 0.0042 - slow_viscous, 0.0004 - slow_viscous)
        return stopped(fast, slow_friction(0.1447 - c0h, slow_viscous))

    assert cell(0.11, 0.0003) == pytest.approx(2.0, abs=0.4)
    row = [cell(0.11, slow_viscous) for slow_viscous in (0.0, 0.0001, 0.0002, 0.0003, 0.0004)]
    column = [cell(c0h, 0.0003) for c0h in (0.05, 0.08, 0.11, 0.14)]
    assert row == sorted(row, reverse=True) and column == sorted(column)
    assert max(*row, *column) > 2.5 and min(*row, *column) < 1.5


@pytest.mark.parametrize("c1h", [0.0, 0.0002, 0.0004])
@pytest.mark.parametrize("c0h", [0.05, 0.11, 0.14])
def test_with_the_break_in_the_slow_part_it_is_silent_within_one(c0h: float, c1h: float) -> None:
    """Table 3: all simulations with the break in the slow part are much shorter than 2 s, or even 1 s."""
    slow = slow_polyline(0.1447 - c0h, 0.0042 - c1h, 0.0004 - c1h)
    assert stopped(fast_linear(c0h, c1h), slow) < 1.0


def test_a_start_rings_as_a_stop_does() -> None:
    """Figs. 11, 12: the load on its spring sees the whole speed at once: (omega / n) sqrt(2 K / J) either way."""
    plant = replace(lumped(fast_polyline(), slow_friction()), motors=())
    start = Trajectory(np.array([0.0, 0.5, 0.51, 3.0]), np.array([0.0, 0.0, SLEW, SLEW]), "linear")
    undamped = SLEW / RATIO * np.sqrt(2.0 * STIFFNESS / LOAD_INERTIA)
    for profile, initial, sign in ((start, {}, 1.0), (stop(0.5, 3.0), TURNING, -1.0)):
        acceleration = sign * np.gradient(run_of(plant, {"motor.omega": profile}, 3.0, initial)["load.omega"], 1e-3)
        assert 0.9 * undamped < np.max(acceleration) < undamped
        assert np.argmax(acceleration) < np.argmin(acceleration)


def test_the_spring_of_the_fast_side_is_a_fast_mode_without_visible_effect() -> None:
    """Table 1's 2.11e4 N m/rad with 0.002 kg m^2 rings at 517 Hz; the load's stop hardly changes."""
    shafts = (
        PlantShaft("motor", MOTOR_INERTIA, fast_polyline()),
        PlantShaft("reducer", MOTOR_INERTIA),
        PlantShaft("load", 0.5 * LOAD_INERTIA, slow_friction()),
    )
    joints = (
        PlantTransmission("motor", "reducer", 1.0, FAST_STIFFNESS, 1.0),
        PlantTransmission("reducer", "load", RATIO, STIFFNESS),
    )
    profile = stop(0.5, 3.0)
    start = {"load.omega": SLEW / RATIO, "reducer.omega": SLEW}
    fast = Bench(drive_of(Plant(shafts, joints), {"motor.omega": profile}))
    with_spring = fast.run(3.0, {"motor.omega": profile}, start, step=5e-5)
    without = run_of(lumped(fast_polyline(), slow_friction()), {"motor.omega": profile}, 3.0, start)
    assert np.sqrt(FAST_STIFFNESS / MOTOR_INERTIA) / (2.0 * np.pi) == pytest.approx(517, abs=1)
    assert worst(without, with_spring, "load.omega") < STOPS
