"""Small drives, recordings and problems for the tests of the estimator."""

from __future__ import annotations

from typing import Any

import numpy as np
from plant import (
    Plant,
    PlantFriction,
    PlantMotor,
    PlantSensor,
    PlantShaft,
    Trajectory,
    steps_and_multisine,
)

from friction_ocp.drive.parts import Channel as Sensor
from friction_ocp.drive.parts import Drive, Gravity, Motor, Shaft, Transmission
from friction_ocp.estimation.problem import EstimationOptions, Problem, RecordingUse
from friction_ocp.friction.element import FrictionElement
from friction_ocp.friction.law import AbstractFrictionLaw
from friction_ocp.friction.static import CoulombViscous, NoFriction
from friction_ocp.parameters import Free
from friction_ocp.recording.recording import Channel, Recording

SECONDS, RATE = 3.0, 500.0
TORQUE_CONSTANT, INERTIA, COULOMB, VISCOUS = 0.35, 0.002, 0.1, 1.5e-3
ENCODER_NOISE = 1.0e-2
CURRENT = Sensor("current", "drive.current", role="input")
POSITION = Sensor("position", "motor.theta", noise_std=ENCODER_NOISE)


def still_recording(name: str = "run", count: int = 500) -> Recording:
    """Return a recording of a smooth motion under a smooth current; nothing in it is meant to be fitted."""
    time = np.arange(count) / RATE
    current = Channel("current", time, np.sin(5.0 * time), "A")
    return Recording(name, {"current": current, "position": Channel("position", time, np.sin(4.0 * time), "rad")})


def axis(law: AbstractFrictionLaw | None = None, **shaft: Any) -> Drive:
    """Return one shaft under a known current."""
    friction = FrictionElement(law or NoFriction())
    motor = Motor("drive", "motor", TORQUE_CONSTANT)
    return Drive(
        (Shaft("motor", **{"inertia": INERTIA, "friction": friction, **shaft}),),
        (),
        (motor,),
        None,
        (CURRENT, POSITION),
    )


def two_masses(stiffness: Any = 200.0, ratio: Any = 10.0, gravity: Gravity | None = None) -> Drive:
    """Return a motor and a load; `stiffness` None joins them rigidly."""
    shafts = (Shaft("motor", Free(INERTIA, 0.0, 1.0)), Shaft("load", 0.3, gravity=gravity))
    joint = Transmission("motor", "load", ratio=ratio, stiffness=stiffness)
    return Drive(shafts, (joint,), (Motor("drive", "motor", TORQUE_CONSTANT),), None, (CURRENT, POSITION))


def problem(drive: Drive, *recordings: Recording | RecordingUse, **estimation: Any) -> Problem:
    """Return a problem with these recordings for training."""
    uses = tuple(item if isinstance(item, RecordingUse) else RecordingUse(item) for item in recordings)
    return Problem(
        "axis", drive, uses or (RecordingUse(still_recording()),), estimation=EstimationOptions(**estimation)
    )


def measured_axis(seed: int) -> Recording:
    """Return a run of the plant: one mass with Coulomb and viscous friction, noise on its encoder."""
    rng = np.random.default_rng(seed)
    current: Trajectory = steps_and_multisine(np.array([0.5, 1.0, 2.0]), (0.2, 0.6), 0.3, (0.5, 40.0), SECONDS, rng)
    plant = Plant(
        shafts=(PlantShaft("motor", INERTIA, PlantFriction("coulomb_viscous", tau_c=COULOMB, viscous=VISCOUS)),),
        motors=(PlantMotor("drive", "motor", torque_constant=TORQUE_CONSTANT),),
        sensors=(PlantSensor("position", "motor.theta", period=1 / RATE, noise_std=ENCODER_NOISE),),
    )
    stamps, values = plant.simulate(SECONDS, {"drive.current": current}, rng).channels["position"]
    channels = {
        "position": Channel("position", stamps, values, "rad"),
        "current": Channel("current", np.asarray(current.time), np.asarray(current.value), "A"),
    }
    return Recording(f"draw{seed}", channels)


def fitted_axis(*recordings: Recording, **estimation: Any) -> Problem:
    """Return the problem of finding inertia and friction of the plant from guesses that are well off."""
    law = CoulombViscous(Free(0.07, 0.0, 2.0), Free(2.2e-3, 0.0, 0.03))
    drive = axis(law, inertia=Free(0.003, 1e-4, 0.04))
    held = Sensor("current", "drive.current", role="input", hold="zero")
    drive = Drive(drive.shafts, (), drive.motors, None, (held, POSITION))
    return problem(drive, *recordings, fit="simulation", **estimation)


TRUTH = {"motor.inertia": INERTIA, "motor.friction.tau_c": COULOMB, "motor.friction.viscous": VISCOUS}
