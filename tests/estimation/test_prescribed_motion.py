"""A motion that is prescribed, and the torque that it takes: dynamometers and tribometers, against the plant.

The plant is driven the other way round: by a torque, whose motion is then what the drive is told.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from axes import COULOMB, INERTIA, TORQUE_CONSTANT, VISCOUS, problem
from plant import Plant, PlantFriction, PlantMotor, PlantSensor, PlantShaft, PlantTransmission, Trajectory

from friction_ocp.drive.parts import Channel as Sensor
from friction_ocp.drive.parts import Drive, Motor, Shaft, Transmission
from friction_ocp.drive.stepping import stepped
from friction_ocp.estimation.estimate import Estimate, identify
from friction_ocp.estimation.experiment import experiment
from friction_ocp.estimation.problem import RecordingUse
from friction_ocp.friction.bristle import LuGre
from friction_ocp.friction.element import FrictionElement
from friction_ocp.friction.law import AbstractFrictionLaw
from friction_ocp.friction.static import CoulombViscous
from friction_ocp.parameters import Free
from friction_ocp.recording.recording import Channel, Recording

SECONDS, STEP = 4.0, 1e-3
TORQUE_NOISE = 2e-3
"""N m; one hundredth of the torque."""
FAR = 4.0
"""Standard errors; one estimate in 16,000 is farther off by chance."""
LUGRE = {"tau_c": 0.1, "tau_s": 0.14, "omega_s": 2.0, "sigma0": 60.0, "sigma1": 0.4, "viscous": VISCOUS}


def torque_of(time: Any) -> Any:
    """Return N m: slow and fast, both ways, without a jump."""
    return 0.18 * np.sin(2 * np.pi * 0.7 * time) + 0.08 * np.sin(2 * np.pi * 2.3 * time + 0.4)


def driven_plant(friction: PlantFriction) -> Plant:
    """Return one mass with perfect sensors of its motion and a torque sensor that is not."""
    sensors = (
        PlantSensor("angle", "shaft.theta", period=STEP),
        PlantSensor("speed", "shaft.omega", period=STEP),
        PlantSensor("torque", "drive.torque", period=STEP, noise_std=TORQUE_NOISE),
    )
    motor = PlantMotor("drive", "shaft", torque_constant=TORQUE_CONSTANT)
    return Plant((PlantShaft("shaft", INERTIA, friction),), motors=(motor,), sensors=sensors)


def run_of(plant: Plant, seed: int = 1) -> Recording:
    """Drive the plant by the torque and record motion and torque."""
    time = np.arange(0.0, SECONDS + STEP, 0.1 * STEP)
    given = Trajectory(time, torque_of(time) / TORQUE_CONSTANT, "linear")
    run = plant.simulate(SECONDS, {"drive.current": given}, np.random.default_rng(seed))
    units = {"angle": "rad", "speed": "rad/s", "torque": "N m"}
    return Recording("run", {name: Channel(name, *run.channels[name], unit) for name, unit in units.items()})


def prescribed(law: AbstractFrictionLaw, moved_by: str, **shaft: Any) -> Drive:
    """Return the same mass, told its angle or its speed; the torque is what it takes."""
    motion = {"angle": "theta", "speed": "omega"}[moved_by]
    channels = (
        Sensor(moved_by, f"shaft.{motion}", role="input"),
        Sensor("torque", "shaft.drive_torque", noise_std=TORQUE_NOISE),
    )
    free = {"inertia": Free(0.003, 1e-4, 0.04), **shaft}
    return Drive((Shaft("shaft", friction=FrictionElement(law), **free),), (), (), None, channels)


def plain() -> CoulombViscous:
    """Return Coulomb and viscous friction with guesses that are well off."""
    return CoulombViscous(Free(0.07, 0.0, 2.0), Free(2.2e-3, 0.0, 0.03))


def assert_found(estimate: Estimate, truth: dict[str, float], within: float) -> None:
    """Every parameter is within its standard errors of the truth, which are small."""
    assert estimate.converged
    for name, value in truth.items():
        item = next(one for one in estimate.parameters if one.name == name)
        assert abs(item.value - value) < max(FAR * item.std_error, within * value), (name, item.value, item.std_error)
        assert item.std_error < 0.05 * value, (name, item.std_error)


@pytest.mark.parametrize("moved_by", ["speed", "angle"])
def test_friction_and_inertia_are_found_from_the_torque_that_a_motion_takes(moved_by: str) -> None:
    """Inverse dynamics: the same truth whether the speed or the angle is told."""
    recording = run_of(driven_plant(PlantFriction("coulomb_viscous", tau_c=COULOMB, viscous=VISCOUS)))
    estimate = identify(problem(prescribed(plain(), moved_by), recording))
    truth = {"shaft.inertia": INERTIA, "shaft.friction.tau_c": COULOMB, "shaft.friction.viscous": VISCOUS}
    assert_found(estimate, truth, 0.01)
    errors, _ = estimate.simulation.train_errors["torque"]
    assert errors.noise_ratio < 1.2


def test_bristles_turn_with_the_prescribed_motion() -> None:
    """Presliding is seen in the torque of reversals: LuGre from its own plant."""
    recording = run_of(driven_plant(PlantFriction("lugre", **LUGRE)))
    law = LuGre(
        tau_c=Free(0.08, 0.0, 1.0),
        tau_s=Free(0.12, 0.0, 1.0),
        omega_s=2.0,
        sigma0=Free(40.0, 1.0, 1e3),
        sigma1=0.4,
        sigma2=Free(2.2e-3, 0.0, 0.03),
    )
    estimate = identify(problem(prescribed(law, "speed", inertia=INERTIA), recording))
    truth = {f"shaft.friction.{name}": LUGRE[name] for name in ("tau_c", "tau_s", "sigma0")}
    assert_found(estimate, {**truth, "shaft.friction.sigma2": VISCOUS}, 0.02)


def test_the_current_of_a_motor_shows_what_hangs_on_a_spring_behind_it() -> None:
    """Two masses whose motor is told its speed: its current tells the friction of both sides and the spring."""
    truth = {"stiffness": 40.0, "load": 0.05, "damping": 0.05}
    load = PlantShaft("load", truth["load"], PlantFriction("coulomb_viscous", tau_c=0.3, viscous=0.02))
    plain_motor = PlantShaft("shaft", INERTIA, PlantFriction("coulomb_viscous", tau_c=COULOMB, viscous=VISCOUS))
    base = driven_plant(PlantFriction())
    joint = PlantTransmission("shaft", "load", 5.0, truth["stiffness"], truth["damping"])
    run = run_of(Plant((plain_motor, load), (joint,), base.motors, sensors=base.sensors))
    current = Channel("current", run.channels["torque"].time, run.channels["torque"].values / TORQUE_CONSTANT, "A")
    recording = Recording("run", {"speed": run.channels["speed"], "current": current})
    shafts = (
        Shaft("shaft", Free(0.003, 1e-4, 0.04), FrictionElement(plain())),
        Shaft("load", truth["load"], FrictionElement(CoulombViscous(Free(0.2, 0.0, 3.0), Free(0.03, 0.0, 0.5)))),
    )
    transmission = Transmission("shaft", "load", ratio=5.0, stiffness=Free(30.0, 5.0, 500.0), damping=truth["damping"])
    channels = (
        Sensor("speed", "shaft.omega", role="input"),
        Sensor("current", "drive.current", noise_std=TORQUE_NOISE / TORQUE_CONSTANT),
    )
    motor = Motor("drive", "shaft", TORQUE_CONSTANT)
    estimate = identify(problem(Drive(shafts, (transmission,), (motor,), None, channels), recording))
    expected = {"shaft.inertia": INERTIA, "shaft.friction.tau_c": COULOMB, "load.friction.tau_c": 0.3}
    assert_found(estimate, {**expected, "shaft-load.stiffness": truth["stiffness"]}, 0.02)


def test_samples_at_rest_say_nothing_about_dry_friction() -> None:
    """A shaft held still takes any torque up to breakaway: such samples are left out, and those of bristles are not."""
    recording = run_of(driven_plant(PlantFriction("coulomb_viscous", tau_c=COULOMB, viscous=VISCOUS)))
    resting = np.abs(recording.channels["speed"].values) < 1e-6
    assert np.sum(resting) > 50
    lugre = LuGre(tau_c=0.1, tau_s=0.12, omega_s=2.0, sigma0=50.0, sigma1=0.4, sigma2=0.0)
    for law, kept in ((plain(), False), (lugre, True)):
        drive = stepped(prescribed(law, "speed"))
        inputs = prescribed(law, "speed").inputs
        found = experiment(RecordingUse(recording), drive, inputs, STEP)
        time = found.grid.time
        at_rest = np.interp(time, recording.channels["speed"].time, resting) > 0.99
        at_rest &= (time > 10 * STEP) & (time < SECONDS - 10 * STEP)
        assert np.all(np.isfinite(found.measured[at_rest, 0]) == kept)
        assert np.sum(np.isfinite(found.measured)) > 0.8 * resting.size
