"""Make data/lto: the Leighton 10 m telescope as the plant of the tests has it, with the numbers of its paper.

python problems/lto/make_data.py [--seed 1] [--only PART]

Two motors on one bull gear, each with its own reducer. The curve: both motors held at 20 speeds by speed loops, their
currents read 25 times, each reading with a scatter of 3e-3 N m, and averaged. Start and stop: both motors follow a step
of speed kinematically, as in eq. 12 and Fig. 11 of the paper; an accelerometer of unknown scale on the reflector is
logged at 100 Hz with 4e-3 rad/s^2 of noise. Families: the curve again while a torque on the structure loads the gears,
whose friction grows with what they transmit.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "tests"))

import leighton  # noqa: E402
from plant import (  # noqa: E402
    Plant,
    PlantController,
    PlantFriction,
    PlantMotor,
    PlantSensor,
    PlantShaft,
    PlantTransmission,
    Trajectory,
)

from friction_ocp.recording.hdf5 import write_recording, write_static_points  # noqa: E402
from friction_ocp.recording.recording import Channel, Recording  # noqa: E402
from friction_ocp.recording.static_points import StaticPoints  # noqa: E402

SIDES = ("east", "west")
SPEEDS = np.linspace(5.0, leighton.SLEW, 20)
READINGS, TORQUE_SCATTER = 25, 3e-3
ACCELEROMETER_PERIOD, ACCELEROMETER_NOISE, ACCELEROMETER_GAIN = 0.01, 4e-3, 1.18
STOP_AT, RUN = 2.0, 8.0
PLANT_STEP = 1e-4
SOURCE = "problems/lto/make_data.py"


@dataclass(frozen=True)
class Telescope:
    """Where the friction is: its numbers at the motor over the motor's speed."""

    name: str
    fast: PlantFriction
    slow: PlantFriction
    """On its own shaft, twice that of one chain."""
    truth: dict[str, float]
    """By the parameter names of the problem files; of one chain."""
    pull: float = 0.0
    """N m; torque on the whole structure against the motion."""


def high_speed_polyline(c2h: float = 0.000117) -> Telescope:
    """Return the reading of eq. 13: the break is in the fast part. c2h = c2 - R c1l of eqs. 6 and 10, not rounded."""
    truth = {
        "motor.friction.tau_c": 0.11,
        "motor.friction.slopes.0": 0.0039,
        "motor.friction.slopes.1": c2h,
        "motor.friction.breaks.0": leighton.BREAK,
        "load.friction.tau_c": leighton.RATIO * 0.0347,
        "load.friction.viscous": leighton.RATIO**2 * 0.0003,
        "motor-load.stiffness": leighton.STIFFNESS,
    }
    return Telescope("high", leighton.fast_polyline(second=c2h), leighton.slow_friction(chains=2), truth)


def low_speed_polyline() -> Telescope:
    """Return the same sum with the break in the slow part (eq. 11, c1h = 0.0003)."""
    total = leighton.slow_polyline(first=0.0039, second=0.000117)
    doubled = PlantFriction(
        "polyline", tau_c=2.0 * total.tau_c, slopes=tuple(2.0 * slope for slope in total.slopes), breaks=total.breaks
    )
    truth = {
        "motor.friction.tau_c": 0.11,
        "motor.friction.viscous": 0.0003,
        "load.friction.tau_c": total.tau_c,
        "load.friction.slopes.0": total.slopes[0],
        "load.friction.slopes.1": total.slopes[1],
        "load.friction.breaks.0": total.breaks[0],
        "motor-load.stiffness": leighton.STIFFNESS,
    }
    return Telescope("low", leighton.fast_linear(), doubled, truth)


def quadratic() -> Telescope:
    """Return the refined model of eq. 16."""
    truth = {
        "motor.friction.tau_c": 0.13,
        "motor.friction.viscous": 0.0042,
        "motor.friction.quadratic": -1.147e-5,
        "load.friction.tau_c": leighton.RATIO * 0.00537,
        "load.friction.viscous": leighton.RATIO**2 * 0.000786,
        "motor-load.stiffness": leighton.STIFFNESS,
    }
    fast = leighton.fast_quadratic(0.13, 0.0042)
    return Telescope("quadratic", fast, leighton.slow_friction(0.00537, 0.000786, chains=2), truth)


LOADS = {"light": 0.0, "medium": 4000.0, "heavy": 8000.0}
"""N m on the structure, by member of the family."""
LOAD_COULOMB, LOAD_VISCOUS = 0.08, 5e-4
"""Shares of the transmitted torque, 1 and s/rad, by which the fast part's friction grows; the paper has a picture."""


def family(load: str) -> Telescope:
    """Return the refined model of eq. 16 with friction of the fast part that grows with the load (Fig. 18)."""
    plain = quadratic()
    fast = replace(plain.fast, load_coulomb=LOAD_COULOMB, load_viscous=LOAD_VISCOUS)
    truth = {name: value for name, value in plain.truth.items() if name.startswith("motor.")}
    truth |= {"motor.friction.load.coulomb": LOAD_COULOMB, "motor.friction.load.viscous": LOAD_VISCOUS}
    return Telescope(load, fast, plain.slow, truth, LOADS[load])


TELESCOPES = (high_speed_polyline, low_speed_polyline, quadratic)


def plant_of(telescope: Telescope, looped: bool = False) -> Plant:
    """Return both chains; `looped` puts each motor under a speed loop, else its speed is prescribed."""
    shafts = (
        *(PlantShaft(side, leighton.MOTOR_INERTIA, telescope.fast) for side in SIDES),
        PlantShaft("load", leighton.LOAD_INERTIA, telescope.slow, external_torque=-telescope.pull),
    )
    joints = tuple(PlantTransmission(side, "load", leighton.RATIO, leighton.STIFFNESS) for side in SIDES)
    accelerometer = PlantSensor(
        "acceleration", "load.alpha", ACCELEROMETER_PERIOD, ACCELEROMETER_NOISE, gain=ACCELEROMETER_GAIN
    )
    if not looped:
        return Plant(shafts, joints, sensors=(accelerometer,))
    constant = leighton.TORQUE_CONSTANT
    motors = tuple(PlantMotor(side, side, "current", constant, controller=f"{side}-loop") for side in SIDES)
    loops = tuple(
        PlantController(f"{side}-loop", "pi_velocity", f"{side}-speed", kp=0.5, ki=2.0, sample_time=1e-3)
        for side in SIDES
    )
    meters = tuple(
        PlantSensor(f"{side}-current", f"{side}.current", 0.04, noise_std=TORQUE_SCATTER / constant) for side in SIDES
    )
    speeds = tuple(PlantSensor(f"{side}-speed", f"{side}.omega", 1e-3) for side in SIDES)
    return Plant(shafts, joints, motors, loops, (*meters, *speeds))


def curve(telescope: Telescope, seed: int, name: str = "curve", speeds: np.ndarray = SPEEDS) -> StaticPoints:
    """Return the mean current of both motors at constant speeds, averaged over readings."""
    rng = np.random.default_rng(seed)
    plant, settled = plant_of(telescope, looped=True), 4.0
    means, errors = [], []
    for speed in speeds:
        start = {f"{side}.omega": speed for side in SIDES} | {"load.omega": speed / leighton.RATIO}
        wanted = {"reference.omega": float(speed)}
        done = plant.simulate(settled + 0.04 * READINGS, wanted, rng, step=PLANT_STEP, initial=start)
        readings = 0.5 * sum(done.channels[f"{side}-current"][1] for side in SIDES)[-READINGS:]
        means.append(np.mean(readings))
        errors.append(TORQUE_SCATTER / leighton.TORQUE_CONSTANT / np.sqrt(2.0 * READINGS))
    units = {"speed": "rad/s", "current": "A", "std_error": "A", "runs": "1"}
    return StaticPoints(
        name,
        np.asarray(speeds, dtype=float),
        units,
        current=np.array(means),
        std_error=np.array(errors),
        runs=np.full(len(means), float(READINGS)),
        title="Leighton 10 m telescope, mean current of two motors at constant speed, simulated",
        source=f"{SOURCE}, seed {seed}",
        licence="MIT",
    )


def response(telescope: Telescope, kind: str, seed: int, name: str) -> Recording:
    """Return the accelerometer while both motors start to 266 rad/s, or stop from it, at once."""
    rng = np.random.default_rng(seed)
    levels = (0.0, leighton.SLEW) if kind == "start" else (leighton.SLEW, 0.0)
    profile = Trajectory(np.array([0.0, STOP_AT]), np.array(levels), "zero")
    start = {"load.omega": levels[0] / leighton.RATIO}
    inputs = {f"{side}.omega": profile for side in SIDES}
    done = plant_of(telescope).simulate(RUN, inputs, rng, step=PLANT_STEP, initial=start)
    time, acceleration = done.channels["acceleration"]
    channels = {
        "motor_speed": Channel("motor_speed", time, profile.at(time), "rad/s"),
        "acceleration": Channel("acceleration", time, acceleration, "rad/s^2"),
    }
    title = f"Leighton 10 m telescope, {kind} response of the reflector, simulated"
    return Recording(name, channels, title=title, source=f"{SOURCE}, seed {seed}", licence="MIT")


def main() -> None:
    """Write curves and responses of each telescope, the family of curves over load, or both."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=1)
    parts = {"telescopes": _write_telescopes, "families": _write_families}
    parser.add_argument("--only", choices=parts, default=None)
    asked = parser.parse_args()
    for name, write in parts.items():
        if asked.only in (None, name):
            write(asked.seed)


def _write_telescopes(seed: int) -> None:
    """Write a curve and two pairs of responses for each telescope."""
    for k, make in enumerate(TELESCOPES):
        telescope, first = make(), 100 * seed + 10 * k
        folder = ROOT / "data" / "lto" / telescope.name
        folder.mkdir(parents=True, exist_ok=True)
        write_static_points(curve(telescope, first), folder / "curve.h5")
        between = 0.5 * (SPEEDS[1:] + SPEEDS[:-1])
        write_static_points(curve(telescope, first + 1, "curve_again", between), folder / "curve_again.h5")
        for j, name in enumerate(("start", "stop", "start_again", "stop_again")):
            kind = name.partition("_")[0]
            write_recording(response(telescope, kind, first + 2 + j, name), folder / f"{name}.h5")


def _write_families(seed: int) -> None:
    """Write a curve for each load."""
    folder = ROOT / "data" / "lto" / "families"
    folder.mkdir(parents=True, exist_ok=True)
    for k, load in enumerate(LOADS):
        write_static_points(curve(family(load), 100 * seed + 50 + k, load), folder / f"{load}.h5")


if __name__ == "__main__":
    main()
